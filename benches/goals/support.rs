//! What several topics need.

use std::time::Instant;

/// The value in the middle.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// CPU time of this thread, so that other programs on the machine count for less.
pub struct Stopwatch {
    begun: Instant,
    cpu: Option<f64>,
}

impl Stopwatch {
    pub fn start() -> Self {
        Stopwatch { begun: Instant::now(), cpu: cpu_seconds() }
    }

    /// Seconds of CPU time since the start; of the clock where the system does not tell.
    pub fn seconds(&self) -> f64 {
        let cpu = self.cpu.and_then(|then| Some(cpu_seconds()? - then));
        cpu.unwrap_or_else(|| self.begun.elapsed().as_secs_f64())
    }
}

fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e9)
}

#[cfg(unix)]
pub use unix::{Screen, is_used, rows};

#[cfg(unix)]
mod unix {
    use std::fs::File;
    use std::os::fd::OwnedFd;
    use std::process::{Child, Command, Stdio};
    use std::sync::Arc;
    use std::thread;
    use std::time::Duration;

    use axcon::host::ports;
    use axcon::host::pty::Pty;
    use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer, openpt, unlockpt};
    use rustix::termios::{Winsize, tcsetwinsize};

    /// Rows of a stream, as many bytes as asked for.
    pub fn rows(bytes: usize) -> Vec<u8> {
        let row = |number: usize| format!("{:8.3};{:8.3};Disabled;OpenCct ;  -3.250\r\n", 25.0, (number % 9000) as f64);
        let mut text: Vec<u8> = (0..=bytes / 46).flat_map(|number| row(number).into_bytes()).collect();
        text.truncate(bytes);
        text
    }

    /// Waits until the program has the port open. A port is raw before anybody opens it, so bytes wait for a reader that
    /// is late. `false` if the program ends instead.
    pub fn is_used(port: &Pty, program: &mut Child) -> bool {
        let mine = std::process::id();
        while ports::holder(port.path()).is_none_or(|holder| holder.pid == mine) {
            if !matches!(program.try_wait(), Ok(None)) {
                return false;
            }
            thread::sleep(Duration::from_millis(2));
        }
        thread::sleep(Duration::from_millis(50));
        true
    }

    /// A terminal as a user has it, whose keys are ours.
    pub struct Screen {
        ours: Arc<OwnedFd>,
        theirs: OwnedFd,
    }

    impl Screen {
        pub fn open() -> Self {
            let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
            let ours = openpt(flags).expect("a terminal");
            unlockpt(&ours).expect("unlocked");
            let size = Winsize { ws_row: 50, ws_col: 160, ws_xpixel: 0, ws_ypixel: 0 };
            tcsetwinsize(&ours, size).expect("sized");
            let theirs = ioctl_tiocgptpeer(&ours, flags).expect("its other side");
            Screen { ours: Arc::new(ours), theirs }
        }

        /// Starts a program on it. What it draws is looked at by `drawn`, as it comes.
        pub fn start(&self, mut program: Command, drawn: impl Fn(&[u8]) + Send + 'static) -> std::io::Result<Child> {
            let side = || self.theirs.try_clone().map(File::from);
            program.env("TERM", "xterm-256color").stdin(side()?).stdout(side()?).stderr(Stdio::null());
            let ours = self.ours.clone();
            thread::spawn(move || {
                let mut buffer = [0; 65536];
                while let Ok(count @ 1..) = rustix::io::read(&*ours, &mut buffer) {
                    drawn(&buffer[..count]);
                }
            });
            program.spawn()
        }

        pub fn press(&self, key: &[u8]) {
            rustix::io::write(&*self.ours, key).expect("typed");
        }
    }
}
