//! `axcon terminal --log` under a flood, against `cat` on the same kind of port, in one run; beside it other terminal
//! programs, where they are installed.
//!
//! Bytes are written to a pseudo-terminal as fast as its reader takes them. `cat` copies them to a file; axcon logs them,
//! records them with their times, makes them safe for a terminal, and looks for flow control and prompts meanwhile. What
//! counts is the ratio, and that not a byte is lost.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use axcon::host::pty::Pty;

use crate::support::{Screen, is_used, median, rows};
use crate::table::{Goal, Row, Table};

/// Bytes of a flood.
const BYTES: usize = 50_000_000;
/// The same of bytes that are no text, which takes longer.
const BYTES_OF_NOISE: usize = 10_000_000;
/// Bytes for the others, some of which take seconds for each million.
const BYTES_FOR_OTHERS: usize = 1_000_000;
const ROUNDS: usize = 5;
/// When a log has not grown for that long, nothing more will come.
const PATIENCE: Duration = Duration::from_secs(5);

const ROWS: &str = "rows of a stream";
const NOISE: &str = "random bytes";

const GOAL: Goal = Goal::at_least(0.9).of("cat");
const SIGNS: &str = "each byte that is no text is shown as a sign of three characters and more, so that nothing acts on the \
                     user's terminal; cat and the others pass it on as it is";

pub fn run(table: &mut Table) {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("log");
    let mut lost = 0;
    for (name, flood) in [(ROWS, rows(BYTES)), (NOISE, noise(BYTES_OF_NOISE))] {
        let (mut ours, mut cats, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            let [cat, axcon] = [cat as Start, axcon].map(|start| {
                let port = Pty::open(115_200).expect("a pseudo-terminal");
                drop(fresh(&log));
                let mut child = start(port.path(), &log).stderr(Stdio::null()).spawn().expect("it starts");
                let (rate, missing) = rate(&port, &mut child, &flood, &log);
                lost += missing;
                rate
            });
            ratios.push(axcon / cat);
            cats.push(cat);
            ours.push(axcon);
        }
        let (ours, cats, ratio) = (median(&mut ours), median(&mut cats), median(&mut ratios));
        println!("{name}: axcon {ours:.1} MB/s, cat {cats:.1} MB/s, ratio {ratio:.2} (medians of {ROUNDS})");
        if name == ROWS {
            others(&flood[..BYTES_FOR_OTHERS], &log, cats);
        }
        // The median of the ratios: what the machine does otherwise changes from one round to the next.
        let row = Row::beside(format!("recording a flood: {name}"), GOAL, ours, "MB/s", ours / ratio);
        table.push(if name == NOISE { row.because(SIGNS) } else { row });
    }
    table.push(Row::new("recording a flood: bytes lost", Goal::at_most(0.0), lost as f64, ""));
}

/// A program's command line, for a port and its log.
type Start = fn(&Path, &Path) -> Command;

fn of(program: &str, args: &[&Path]) -> Command {
    let mut command = Command::new(program);
    command.args(args);
    command
}

fn cat(port: &Path, log: &Path) -> Command {
    let mut cat = of("cat", &[port]);
    cat.stdout(fresh(log));
    cat
}

fn axcon(port: &Path, log: &Path) -> Command {
    let mut axcon = of(env!("CARGO_BIN_EXE_axcon"), &["terminal".as_ref(), "--port".as_ref(), port]);
    axcon.arg("--log").arg(log).arg("--record").arg(log.with_extension("cast")).arg("--yes");
    axcon.stdout(Stdio::null()).stdin(Stdio::piped());
    axcon
}

fn fresh(log: &Path) -> File {
    let _ = fs::remove_file(log);
    File::create(log).expect("a file")
}

/// Other programs that log what comes. They want a terminal.
fn others(flood: &[u8], log: &Path, cats: f64) {
    let programs: [(&str, Start); 3] = [
        ("picocom", |port, log| of("picocom", &["--quiet".as_ref(), "--logfile".as_ref(), log, port])),
        ("tio", |port, log| of("tio", &["--log".as_ref(), "--log-file".as_ref(), log, port])),
        ("minicom", |port, log| of("minicom", &["-o".as_ref(), "-D".as_ref(), port, "-C".as_ref(), log])),
    ];
    for (name, start) in programs {
        let port = Pty::open(115_200).expect("a pseudo-terminal");
        drop(fresh(log));
        let screen = Screen::open();
        let Ok(mut child) = screen.start(start(port.path(), log), |_| {}) else {
            println!("  {name:<8} not there");
            continue;
        };
        if !is_used(&port, &mut child) {
            println!("  {name:<8} does not run here");
            continue;
        }
        let (rate, missing) = rate(&port, &mut child, flood, log);
        println!(
            "  {name:<8} {rate:.2} MB/s, {:.3} of cat, {missing} of {} bytes missing or changed",
            rate / cats,
            flood.len()
        );
    }
}

/// MB a second from the first byte to the last one in the log, and the bytes that are not there. The program is ended.
fn rate(port: &Pty, program: &mut Child, flood: &[u8], log: &Path) -> (f64, usize) {
    assert!(is_used(port, program), "it opens the port");
    let begun = Instant::now();
    let (mut rest, mut logged, mut grown) = (flood, 0, begun);
    while logged < flood.len() && grown.elapsed() < PATIENCE {
        let count = port.write(rest).expect("written");
        rest = &rest[count..];
        if count == 0 {
            thread::sleep(Duration::from_micros(50));
        }
        let length = fs::metadata(log).map_or(0, |log| log.len() as usize);
        if length > logged {
            (logged, grown) = (length, Instant::now());
        }
    }
    let seconds = grown.duration_since(begun).as_secs_f64();
    let logged = fs::read(log).unwrap_or_default();
    let missing = flood.len().saturating_sub(logged.len());
    let others =
        if missing == 0 { logged.iter().zip(flood).filter(|(logged, sent)| logged != sent).count() } else { 0 };
    let _ = program.kill();
    let _ = program.wait();
    (logged.len() as f64 / 1e6 / seconds, missing + others)
}

/// Everything but the password's echo and flow control can be in it.
fn noise(bytes: usize) -> Vec<u8> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut byte = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    (0..bytes).map(|_| byte()).collect()
}
