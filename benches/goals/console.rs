//! The console on the screen: wake-ups at rest, the way of a key while its port is flooded, pictures drawn meanwhile.

use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use axcon::host::pty::Pty;

use crate::support::{Screen, is_used, median, rows};
use crate::table::{Goal, Row, Table};

/// How long the console is left alone, how long it is flooded, and how long a key waits behind the one before.
const IDLE_TIME: Duration = Duration::from_secs(5);
const FLOOD_TIME: Duration = Duration::from_secs(10);
const KEY_PAUSE: Duration = Duration::from_millis(37);
/// Whoever is there is asked first; then there is rest.
const ASKING: Duration = Duration::from_secs(12);

const IDLE: Goal = Goal::at_most(0.0);
const KEY: Goal = Goal::at_most(5.0);
const PICTURES: Goal = Goal::at_most(30.0);

pub fn run(table: &mut Table) {
    let folder = tempfile::tempdir().expect("a folder");
    let port = Pty::open(115_200).expect("a pseudo-terminal");
    let mut axcon = Command::new(env!("CARGO_BIN_EXE_axcon"));
    axcon.arg("--port").arg(port.path()).arg("--record").arg(folder.path().join("cast"));
    let drawn = Arc::new(AtomicUsize::new(0));
    let count = drawn.clone();
    let screen = Screen::open();
    let mut child = screen
        .start(axcon, move |bytes| {
            // Each picture ends by hiding the cursor.
            count.fetch_add(bytes.windows(6).filter(|end| end == b"\x1b[?25l").count(), Ordering::Relaxed);
        })
        .expect("it starts");
    assert!(is_used(&port, &mut child), "it opens the port");
    thread::sleep(ASKING);
    // The terminal screen, on which keys go to the unit.
    screen.press(b"3");
    thread::sleep(Duration::from_millis(300));
    let mut ignored = [0; 4096];
    while port.read(&mut ignored).expect("read") > 0 {}

    match wake_ups(child.id()) {
        Some(before) => {
            thread::sleep(IDLE_TIME);
            let woken = wake_ups(child.id()).unwrap_or_default() - before;
            println!("idle: {woken} wake-ups in {} s", IDLE_TIME.as_secs());
            table.push(Row::new("console at rest: wake-ups", IDLE, woken as f64, ""));
        }
        None => table.push(Row::not_measured("console at rest: wake-ups", IDLE, "no /proc to ask")),
    }

    let flood = rows(1_000_000);
    let (begun, before) = (Instant::now(), drawn.load(Ordering::Relaxed));
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
            screen.press(b"x");
        }
    }
    let seconds = begun.elapsed().as_secs_f64();
    let pictures = (drawn.load(Ordering::Relaxed) - before) as f64 / seconds;
    let _ = child.kill();
    let _ = child.wait();
    let slowest = times.iter().copied().fold(0.0, f64::max);
    let key = median(&mut times);
    println!(
        "flooded at {:.1} MB/s: key to port {key:.2} ms (median of {}, slowest {slowest:.2}), {pictures:.1} pictures a second",
        written as f64 / 1e6 / seconds,
        times.len()
    );
    table.push(Row::new("console under a flood: key to wire", KEY, key, "ms"));
    table.push(Row::new("console under a flood: pictures a second", PICTURES, pictures, ""));
}

/// How often the threads of a process have gone to sleep and been woken. `None` where the system does not tell.
fn wake_ups(pid: u32) -> Option<u64> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).ok()?;
    let of_thread = |task: std::fs::DirEntry| {
        let status = std::fs::read_to_string(task.path().join("status")).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:").map(str::to_owned));
        line.and_then(|count| count.trim().parse::<u64>().ok()).unwrap_or_default()
    };
    Some(tasks.flatten().map(of_thread).sum())
}
