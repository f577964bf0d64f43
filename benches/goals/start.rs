//! How long a short command takes from its start to its end, beside `picocom`.

use std::process::{Command, Stdio};
use std::time::Instant;

use crate::support::median;
use crate::table::{Goal, Row, Table};

/// Starts of each program, one after the other in turn.
const STARTS: usize = 101;

pub fn run(table: &mut Table) {
    let (name, goal) = ("axcon ports, start to end", Goal::at_most(2.0).of("picocom"));
    let (mut ours, mut without, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..STARTS {
        ours.extend(milliseconds(env!("CARGO_BIN_EXE_axcon"), "ports"));
        without.extend(milliseconds(env!("CARGO_BIN_EXE_axcon"), "--version"));
        theirs.extend(milliseconds("picocom", "--help"));
    }
    let ports = median(&mut ours);
    println!("axcon ports {ports:.2} ms, axcon --version {:.2} ms (medians of {STARTS})", median(&mut without));
    if theirs.is_empty() {
        return table.push(Row::not_measured(name, goal, "picocom is not installed"));
    }
    let picocom = median(&mut theirs);
    println!("picocom --help {picocom:.2} ms");
    table.push(Row::beside(name, goal, ports, "ms", picocom));
}

fn milliseconds(program: &str, argument: &str) -> Option<f64> {
    let begun = Instant::now();
    Command::new(program).arg(argument).stdout(Stdio::null()).stderr(Stdio::null()).status().ok()?;
    Some(begun.elapsed().as_secs_f64() * 1e3)
}
