//! Dumps of object dictionaries: what is read is written and read again the same, differs from itself in nothing, and
//! is one row of a table for each entry.
#![no_main]

use axcon::dump::{Dump, differences};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let dump = match Dump::parse("d.json", text) {
        Ok(dump) => dump,
        Err(error) => {
            assert!(!error.to_string().chars().any(char::is_control), "{error:?}");
            return;
        }
    };
    let again = Dump::parse("d.json", &dump.json()).expect("what was written is read");
    assert_eq!(dump, again);
    assert_eq!(dump.json(), again.json());
    assert_eq!(differences(&dump, &again), []);
    assert!(dump.deviations() <= dump.entries.len() && dump.errors().count() <= dump.entries.len());
    // Whoever edited the file, a terminal shows it as it is and a row stays a row.
    assert!(!dump.table().chars().any(|c| c.is_control() && c != '\n'));
    assert!(dump.table().lines().count() <= dump.entries.len() + 2);
    assert!(!dump.csv().is_empty());
});
