//! The numbers this program holds itself to, measured: one command for all of them, and one table at the end.
//!
//! `cargo bench --bench goals` runs everything, in less than ten minutes; `cargo bench --bench goals -- uploads flood`
//! runs these topics only. A topic prints its details as it goes. The table has each figure beside its goal, and the
//! ratio of the two, or to a peer where the goal is one. Nothing here fails a build: a machine that is busy otherwise
//! gives other figures, and the ratios less so.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark prints its figures")]

#[cfg(unix)]
mod console;
mod emulator;
#[cfg(unix)]
mod flood;
mod images;
mod reaction;
mod simulation;
#[cfg(unix)]
mod start;
mod support;
mod table;
mod uploads;

use std::process::ExitCode;

use table::{Goal, Row, Table};

/// A name, and what prints its details and adds its rows.
type Topic = (&'static str, fn(&mut Table));

/// What can be asked for, in the order in which it runs. Some of it needs pseudo-terminals.
const TOPICS: &[Topic] = &[
    ("uploads", uploads::run),
    ("reaction", reaction::run),
    ("images", images::run),
    #[cfg(unix)]
    ("flood", flood::run),
    #[cfg(unix)]
    ("console", console::run),
    #[cfg(unix)]
    ("start", start::run),
    ("emulator", emulator::run),
    ("elsewhere", elsewhere),
];

fn main() -> ExitCode {
    if let Some(path) = std::env::var_os(images::FILE) {
        images::measure(path.as_ref());
        return ExitCode::SUCCESS;
    }
    // What begins with a dash is cargo's.
    let asked: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    if let Some(unknown) = asked.iter().find(|asked| TOPICS.iter().all(|(name, _)| name != asked)) {
        let known: Vec<&str> = TOPICS.iter().map(|(name, _)| *name).collect();
        eprintln!("there is no topic {unknown}; there are {}", known.join(", "));
        return ExitCode::from(2);
    }
    if let Ok(load) = std::fs::read_to_string("/proc/loadavg") {
        println!("load of the machine before: {}", load.split_whitespace().next().unwrap_or("-"));
    }
    let mut table = Table::default();
    for (name, run) in TOPICS {
        if asked.is_empty() || asked.iter().any(|asked| asked == name) {
            println!("== {name}");
            run(&mut table);
            println!();
        }
    }
    print!("{table}");
    ExitCode::SUCCESS
}

/// What takes longer than a benchmark may.
fn elsewhere(table: &mut Table) {
    println!("docs/testing.md has the commands and their last results.");
    table.push(Row::not_measured(
        "swarm: false successes, hangs, lost units",
        Goal::at_most(0.0),
        "hours; docs/testing.md, The swarm",
    ));
    table.push(Row::not_measured(
        "fuzzing of every reader: panics",
        Goal::at_most(0.0),
        "hours; docs/testing.md, Fuzzing",
    ));
}
