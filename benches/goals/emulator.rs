//! How fast emulated units run in virtual time, and what many of them cost.
//!
//! A ratio says how many seconds of a unit's life one second of one core computes.

use axcon::device::Product;
use axcon::emulator::Unit;
use axcon::emulator::cable::{Line, Plugged};
use axcon::host::unit::factory_setup;
use axcon::time::{Duration, Instant, character_time};

use crate::support::{Stopwatch, median};
use crate::table::{Goal, Row, Table};

/// Bits a second on the service port.
const BAUD: u32 = 115_200;
/// Units in one process.
const MANY: usize = 500;
/// When measuring begins: the unit has started and streams.
const BEGIN: Instant = Instant::from_millis(6_000);
const ROUNDS: usize = 5;

const ONE: Goal = Goal::at_least(5_000.0);
const REAL_TIME: Goal = Goal::at_least(1.0);

pub fn run(table: &mut Table) {
    print!("{:<26}", "x real time");
    Product::all().iter().for_each(|product| print!(" {:>10}", product.name));
    println!();
    for (what, period) in
        [("quiet", None), ("a row a second", Some(1_000)), ("ten rows a second", Some(100)), ("saturated", Some(1))]
    {
        print!("{what:<26}");
        let mut slower = f64::INFINITY;
        for product in Product::all() {
            // The longer rows of the other product come ten times a second at most.
            if period.is_some_and(|period| period < product.measurement.stream_period_ms.0) {
                print!(" {:>10}", "-");
                continue;
            }
            let mut ratios: Vec<f64> = (0..ROUNDS).map(|_| one(product, period)).collect();
            let ratio = median(&mut ratios);
            print!(" {ratio:>10.0}");
            slower = slower.min(ratio);
        }
        println!();
        table.push(Row::new(format!("emulated unit, {what}: x real time"), ONE, slower, ""));
    }
    let (ratio, kilobytes) = many();
    println!("{MANY} units, a row a second each: {ratio:.0} times real time, {kilobytes:.0} KiB resident each");
    table.push(Row::new(format!("{MANY} units on one core: x real time"), REAL_TIME, ratio, ""));
}

/// A unit that streams at a period, powered on.
fn unit(product: &'static Product, period: Option<u16>, seed: u64) -> Plugged<Unit> {
    let line = Line::new(character_time(BAUD), Duration::ZERO);
    let mut plugged = Plugged::new(Unit::new(factory_setup(product, seed)), line);
    plugged.unit_mut().power_on(Instant::ZERO);
    let started = Instant::from_millis(500);
    plugged.advance(started, |_, _| {});
    if let Some(period) = period {
        plugged.send(started, format!("tf{period}\r").as_bytes());
    }
    plugged.advance(BEGIN, |_, _| {});
    plugged
}

/// Seconds of one unit's life in a second of one core.
fn one(product: &'static Product, period: Option<u16>) -> f64 {
    let mut plugged = unit(product, period, 1);
    let (mut now, mut characters) = (BEGIN, 0usize);
    let watch = Stopwatch::start();
    while watch.seconds() < 0.5 {
        now += Duration::from_secs(10);
        plugged.advance(now, |_, bytes| characters += bytes.len());
    }
    assert!(period.is_none() || characters > 0, "it streams");
    now.since(BEGIN).as_secs_f64() / watch.seconds()
}

/// The same for many units at once, and the memory each takes.
fn many() -> (f64, f64) {
    let before = resident_kilobytes();
    let mut units: Vec<Plugged<Unit>> = (0..MANY)
        .map(|number| unit(&Product::all()[number % Product::all().len()], Some(1_000), number as u64))
        .collect();
    let kilobytes = (resident_kilobytes() - before) / MANY as f64;
    let mut now = BEGIN;
    let watch = Stopwatch::start();
    while watch.seconds() < 1.5 {
        now += Duration::from_secs(1);
        for unit in &mut units {
            unit.advance(now, |_, _| {});
        }
    }
    (now.since(BEGIN).as_secs_f64() / watch.seconds(), kilobytes)
}

/// Resident memory of this process; 0 where the system does not tell in this way.
fn resident_kilobytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()).and_then(|number| number.parse().ok()).unwrap_or_default()
}
