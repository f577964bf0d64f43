//! `axcon terminal --log` under a flood, against `cat` on the same kind of port, in one run.
//!
//! 50 MB are written to a pseudo-terminal as fast as its reader takes them. `cat` copies them to a file; axcon logs
//! them, records them with their times, makes them safe for a terminal, and looks for flow control and prompts
//! meanwhile. What counts is the ratio, and that not a byte is lost.
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
    use std::time::{Duration, Instant};

    use axcon::host::pty::Pty;

    const BYTES: usize = 50_000_000;
    const ROUNDS: usize = 5;

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
