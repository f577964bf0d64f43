//! The console on the screen: wake-ups at rest, the way of a key while its port is flooded, pictures drawn meanwhile. And
//! how long the program takes to start, beside `picocom` where it is installed.
//!
//! `cargo bench --bench console`

#![allow(clippy::print_stdout, missing_docs)]

#[cfg(not(unix))]
fn main() {}

#[cfg(unix)]
fn main() {
    unix::main();
}

#[cfg(unix)]
mod unix {
    use std::process::{Child, Command, Stdio};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;
    use std::time::{Duration, Instant};

    use axcon::host::pty::Pty;
    use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer, openpt, unlockpt};
    use rustix::termios::{Winsize, tcsetwinsize};

    /// How long the console is left alone, how long it is flooded, and how long a key waits behind the one before.
    const IDLE_TIME: Duration = Duration::from_secs(5);
    const FLOOD_TIME: Duration = Duration::from_secs(10);
    const KEY_PAUSE: Duration = Duration::from_millis(37);
    /// Starts of a program whose median counts.
    const STARTS: usize = 21;

    pub fn main() {
        let row = |number: usize| format!("{:8.3};{:8.3};Disabled;OpenCct ;  -3.250\r\n", 25.0, (number % 9000) as f64);
        let text: Vec<u8> = (0..20_000).flat_map(|number| row(number).into_bytes()).collect();
        console(&text);
        start();
    }

    /// From nothing to the end of a short command.
    fn start() {
        let time = |program: &str, args: &[&str]| {
            let mut times: Vec<f64> = (0..STARTS)
                .map(|_| {
                    let begun = Instant::now();
                    let status = Command::new(program).args(args).stdout(Stdio::null()).stderr(Stdio::null()).status();
                    status.ok().map(|_| begun.elapsed().as_secs_f64() * 1e3)
                })
                .collect::<Option<_>>()?;
            Some(median(&mut times))
        };
        let ours = time(env!("CARGO_BIN_EXE_axcon"), &["ports"]).expect("it starts");
        match time("picocom", &["--help"]) {
            Some(theirs) => println!(
                "start: axcon ports {ours:.1} ms, picocom --help {theirs:.1} ms, {:.2} times as long (goal: at most 2)",
                ours / theirs
            ),
            None => println!("start: axcon ports {ours:.1} ms; picocom is not installed"),
        }
    }

    /// How often the threads of a process have gone to sleep and been woken.
    fn wake_ups(pid: u32) -> u64 {
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).expect("its threads");
        let of_thread = |task: std::fs::DirEntry| {
            let status = std::fs::read_to_string(task.path().join("status")).unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:").map(str::to_owned));
            line.and_then(|count| count.trim().parse::<u64>().ok()).unwrap_or_default()
        };
        tasks.flatten().map(of_thread).sum()
    }

    /// The console at rest, then keys into it while its port is flooded.
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

        let before = wake_ups(child.id());
        thread::sleep(IDLE_TIME);
        let woken = wake_ups(child.id()) - before;
        println!("console, idle: {woken} wake-ups in {} s (goal: 0)", IDLE_TIME.as_secs());

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
            "console, flooded: key to port {:.2} ms (median of {}, slowest {slowest:.2}; goal 5), {pictures:.0} pictures a second (goal: \
             at most 30), port at {:.1} MB/s",
            median(&mut times),
            times.len(),
            written as f64 / 1e6 / seconds
        );
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

    fn median(values: &mut [f64]) -> f64 {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }
}
