//! `axcon terminal --log` under a flood, against `cat` on the same kind of port, in one run.
//!
//! 50 MB are written to a pseudo-terminal as fast as its reader takes them. `cat` copies them to a file; axcon logs
//! them, records them with their times, makes them safe for a terminal, and looks for flow control and prompts
//! meanwhile. What counts is the ratio, and that not a byte is lost.
//!
//! Then the console on the screen under the same flood: how long a key takes from the keyboard to the port, and how often
//! the picture is drawn.
//!
//! `cargo bench --bench flood`

#![allow(clippy::print_stdout, missing_docs)]

#[cfg(not(unix))]
fn main() {}

#[cfg(unix)]
fn main() {
    unix::main();
}

#[cfg(unix)]
mod unix {
    use std::fs::{self, File};
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;
    use std::time::{Duration, Instant};

    use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer, openpt, unlockpt};
    use rustix::termios::{Winsize, tcsetwinsize};

    use axcon::host::pty::Pty;

    const BYTES: usize = 50_000_000;
    const ROUNDS: usize = 5;

    /// How long the console is flooded, and how long a key waits behind the one before.
    const FLOOD_TIME: Duration = Duration::from_secs(10);
    const KEY_PAUSE: Duration = Duration::from_millis(37);

    pub fn main() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log");
        let text = rows();
        let noise = noise();
        for (name, flood) in [("rows of a stream", &text), ("random bytes", &noise)] {
            let mut ratios = Vec::new();
            let (mut ours, mut cats) = (Vec::new(), Vec::new());
            for _ in 0..ROUNDS {
                let cat = time(flood, &log, |port| {
                    let mut cat = Command::new("cat");
                    cat.arg(port).stdout(File::create(&log).expect("a file"));
                    cat
                });
                let axcon = time(flood, &log, |port| {
                    let mut axcon = Command::new(env!("CARGO_BIN_EXE_axcon"));
                    axcon.arg("terminal").arg("--port").arg(port).arg("--log").arg(&log);
                    axcon.arg("--record").arg(folder.path().join("cast")).stdout(Stdio::null()).stdin(Stdio::piped());
                    axcon
                });
                ratios.push(cat.as_secs_f64() / axcon.as_secs_f64());
                cats.push(cat.as_secs_f64());
                ours.push(axcon.as_secs_f64());
            }
            let rate = |times: &mut Vec<f64>| BYTES as f64 / 1e6 / median(times);
            println!(
                "{name}: axcon {:.1} MB/s, cat {:.1} MB/s, ratio {:.2} (median of {ROUNDS}), 0 bytes lost",
                rate(&mut ours),
                rate(&mut cats),
                median(&mut ratios)
            );
        }
        console(&text);
    }

    /// Keys into the console while its port is flooded.
    fn console(flood: &[u8]) {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let terminal = openpt(flags).expect("a terminal");
        unlockpt(&terminal).expect("unlocked");
        let size = Winsize { ws_row: 50, ws_col: 160, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&terminal, size).expect("sized");
        let slave = ioctl_tiocgptpeer(&terminal, flags).expect("its other side");
        let copy = || slave.try_clone().expect("a copy");
        let port = Pty::open(115_200).expect("a pseudo-terminal");
        let mut axcon = Command::new(env!("CARGO_BIN_EXE_axcon"));
        axcon.arg("--port").arg(port.path()).arg("--no-record").env("TERM", "xterm-256color");
        let mut child = axcon.stdin(copy()).stdout(copy()).stderr(Stdio::null()).spawn().expect("it starts");
        wait_for(&port, &mut child);
        let terminal = Arc::new(terminal);
        let (screen, drawn) = (terminal.clone(), Arc::new(AtomicUsize::new(0)));
        let frames = drawn.clone();
        thread::spawn(move || {
            let mut buffer = [0; 65536];
            while let Ok(count @ 1..) = rustix::io::read(&*screen, &mut buffer) {
                // Each picture ends by hiding the cursor.
                frames
                    .fetch_add(buffer[..count].windows(6).filter(|end| end == b"\x1b[?25l").count(), Ordering::Relaxed);
            }
        });
        // Whoever is there is asked first; then the terminal screen, on which keys go to the unit.
        thread::sleep(Duration::from_secs(12));
        let key = |key: &[u8]| rustix::io::write(&*terminal, key).expect("typed");
        key(b"3");
        thread::sleep(Duration::from_millis(300));
        let mut ignored = [0; 4096];
        while port.read(&mut ignored).expect("read") > 0 {}

        let (begun, frames_before) = (Instant::now(), drawn.load(Ordering::Relaxed));
        let (mut written, mut typed, mut times) = (0, None::<Instant>, Vec::new());
        let mut next_key = KEY_PAUSE;
        while begun.elapsed() < FLOOD_TIME {
            let rest = &flood[written % flood.len()..];
            written += port.write(&rest[..rest.len().min(4096)]).expect("written");
            if port.read(&mut ignored).expect("read") > 0
                && let Some(typed) = typed.take()
            {
                times.push(typed.elapsed().as_secs_f64() * 1e3);
                next_key = begun.elapsed() + KEY_PAUSE;
            }
            if typed.is_none() && begun.elapsed() >= next_key {
                typed = Some(Instant::now());
                key(b"x");
            }
        }
        let seconds = begun.elapsed().as_secs_f64();
        let pictures = (drawn.load(Ordering::Relaxed) - frames_before) as f64 / seconds;
        let _ = child.kill();
        let _ = child.wait();
        let slowest = times.iter().copied().fold(0.0, f64::max);
        println!(
            "console: key to port {:.2} ms (median of {}, slowest {slowest:.2}; goal 5), {pictures:.0} pictures a second (goal: \
             at most 30), port at {:.1} MB/s",
            median(&mut times),
            times.len(),
            written as f64 / 1e6 / seconds
        );
    }

    /// From the first byte to the last one in the log.
    fn time(flood: &[u8], log: &Path, command: impl Fn(&Path) -> Command) -> Duration {
        let _ = fs::remove_file(log);
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        let mut child = command(pty.path()).stderr(Stdio::null()).spawn().expect("it starts");
        wait_for(&pty, &mut child);
        let start = Instant::now();
        let mut rest = flood;
        while !rest.is_empty() {
            let count = pty.write(rest).expect("written");
            rest = &rest[count..];
            if count == 0 {
                std::thread::sleep(Duration::from_micros(50));
            }
        }
        while fs::metadata(log).map_or(0, |log| log.len()) < flood.len() as u64 {
            assert!(start.elapsed() < Duration::from_secs(120), "bytes are lost");
            std::thread::sleep(Duration::from_micros(200));
        }
        let time = start.elapsed();
        assert!(fs::read(log).expect("a log") == flood, "the log is what was sent");
        let _ = child.kill();
        let _ = child.wait();
        time
    }

    fn wait_for(pty: &Pty, child: &mut Child) {
        // The port is raw before anybody opens it, so bytes wait for a reader that is late.
        let mine = std::process::id();
        while axcon::host::ports::holder(pty.path()).is_none_or(|holder| holder.pid == mine) {
            assert!(child.try_wait().expect("a child").is_none(), "it runs");
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis(50));
    }

    fn rows() -> Vec<u8> {
        let row = |number: usize| format!("{:8.3};{:8.3};Disabled;OpenCct ;  -3.250\r\n", 25.0, (number % 9000) as f64);
        let mut text: Vec<u8> = (0..BYTES / 46 + 1).flat_map(|number| row(number).into_bytes()).collect();
        text.truncate(BYTES);
        text
    }

    /// Everything but the password's echo and flow control can be in it.
    fn noise() -> Vec<u8> {
        let mut state = 0x9E37_79B9_7F4A_7C15_u64;
        let mut byte = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 32) as u8
        };
        (0..BYTES).map(|_| byte()).collect()
    }

    fn median(values: &mut [f64]) -> f64 {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }
}
