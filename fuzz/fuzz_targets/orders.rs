//! Verbs and faults: read in any case and with any blanks, or refused with a column in the line and a harmless text.
#![no_main]

use axcon::device::Product;
use axcon::emulator::fault::Fault;
use axcon::emulator::scenario::Verb;
use axcon::emulator::words::WordError;
use libfuzzer_sys::fuzz_target;

fn check(line: &str, error: &WordError) {
    assert!((1..=line.chars().count() + 1).contains(&error.column), "{line:?}: {error}");
    assert!(!error.message.is_empty() && !error.message.chars().any(char::is_control), "{line:?}: {error}");
}

fuzz_target!(|line: &str| {
    for product in Product::all() {
        let verb = Verb::read(line, product);
        let fault = Fault::read(line, product);
        for error in [verb.as_ref().err(), fault.as_ref().err()].into_iter().flatten() {
            check(line, error);
        }
        let spread = line.split_whitespace().collect::<Vec<_>>().join(" \t ");
        for other in [line.to_ascii_uppercase(), line.to_ascii_lowercase(), spread] {
            assert_eq!(verb.as_ref().ok(), Verb::read(&other, product).as_ref().ok(), "{line:?} and {other:?}");
            assert_eq!(fault.as_ref().ok(), Fault::read(&other, product).as_ref().ok(), "{line:?} and {other:?}");
        }
        if let Ok(fault) = fault {
            let written = fault.to_string();
            assert_eq!(Fault::read(&written, product), Ok(fault), "{line:?} and {written:?}");
            let ordered = Verb::read(&format!("fault {written}"), product);
            assert_eq!(ordered, Ok(Verb::Fault(fault)), "{line:?}");
        }
    }
});
