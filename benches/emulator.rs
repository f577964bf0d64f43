//! How fast emulated units run in virtual time, and what many of them cost.
//!
//! Prints ratios against real time, with the goal beside each; `cargo bench --bench emulator`. A ratio says how many
//! seconds of a unit's life one second of one core computes.

#![allow(clippy::print_stdout, reason = "a benchmark prints its figures")]

use std::time::Instant as WallInstant;

use axcon::device::Product;
use axcon::emulator::Unit;
use axcon::emulator::cable::{Line, Plugged};
use axcon::host::unit::factory_setup;
use axcon::time::{Duration, Instant, character_time};

/// Bits a second on the service port.
const BAUD: u32 = 115_200;
/// Ratio to real time that one streaming scanner should have.
const GOAL_ONE: f64 = 5_000.0;
/// Units in one process.
const MANY: usize = 500;

fn main() {
    println!("{:<44} {:>12} {:>10}  verdict", "one unit in virtual time", "x real time", "goal");
    for (product, period) in [
        ("AXTC4CO", None),
        ("AXTC4CO", Some(1_000)),
        ("AXTC4CO", Some(100)),
        ("AXTC4CO", Some(1)),
        ("AXRTD8CO", None),
        ("AXRTD8CO", Some(1_000)),
        ("AXRTD8CO", Some(100)),
    ] {
        let ratio = one(product, period);
        let what = period.map_or("quiet".to_owned(), |period| format!("a row every {period} ms"));
        let verdict = if ratio >= GOAL_ONE { "met" } else { "missed" };
        println!("{:<44} {ratio:>12.0} {GOAL_ONE:>10.0}  {verdict}", format!("{product}, {what}"));
    }
    println!();
    println!("{:<44} {:>12} {:>10}  verdict", format!("{MANY} units in one process"), "figure", "goal");
    let (ratio, kilobytes) = many();
    let verdict = if ratio >= 1.0 { "met" } else { "missed" };
    println!("{:<44} {ratio:>12.1} {:>10.1}  {verdict}", "x real time on one core, streams of 1 s", 1.0);
    println!("{:<44} {kilobytes:>12.0} {:>10}", "KiB resident for each unit (flash 128/512)", "-");
}

/// A unit that streams at a period, powered on.
fn unit(product: &str, period: Option<u32>, seed: u64) -> Plugged<Unit> {
    let product = Product::named(product).expect("built in");
    let mut plugged =
        Plugged::new(Unit::new(factory_setup(product, seed)), Line::new(character_time(BAUD), Duration::ZERO));
    plugged.unit_mut().power_on(Instant::ZERO);
    plugged.advance(Instant::from_millis(500), |_, _| {});
    if let Some(period) = period {
        plugged.send(Instant::from_millis(500), format!("tf{period}\r").as_bytes());
    }
    plugged.advance(Instant::from_millis(6_000), |_, _| {});
    plugged
}

/// Seconds of one unit's life in a second of one core.
fn one(product: &str, period: Option<u32>) -> f64 {
    let mut plugged = unit(product, period, 1);
    let (mut now, mut characters) = (Instant::from_millis(6_000), 0usize);
    let begin = WallInstant::now();
    let mut simulated = Duration::ZERO;
    while begin.elapsed() < Duration::from_millis(700) {
        let step = Duration::from_secs(10);
        now += step;
        simulated += step;
        plugged.advance(now, |_, bytes| characters += bytes.len());
    }
    assert!(period.is_none() || characters > 0, "it streams");
    simulated.as_secs_f64() / begin.elapsed().as_secs_f64()
}

/// The same for many units at once, and the memory each takes.
fn many() -> (f64, f64) {
    let before = resident_kilobytes();
    let mut units: Vec<Plugged<Unit>> = (0..MANY)
        .map(|number| unit(if number % 2 == 0 { "AXTC4CO" } else { "AXRTD8CO" }, Some(1_000), number as u64))
        .collect();
    let kilobytes = (resident_kilobytes() - before) / MANY as f64;
    let mut now = Instant::from_millis(6_000);
    let begin = WallInstant::now();
    let mut simulated = Duration::ZERO;
    while begin.elapsed() < Duration::from_millis(1_500) {
        let step = Duration::from_secs(1);
        now += step;
        simulated += step;
        for unit in &mut units {
            unit.advance(now, |_, _| {});
        }
    }
    (simulated.as_secs_f64() / begin.elapsed().as_secs_f64(), kilobytes)
}

/// Resident memory of this process; 0 where the system does not tell in this way.
fn resident_kilobytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()).and_then(|number| number.parse().ok()).unwrap_or_default()
}
