//! Which mutant is on. Goes into the rewritten tree as `src/mutant.rs`.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};

/// Not yet looked up.
const UNKNOWN: u32 = u32::MAX;
/// None is on; those that are reached are noted.
const NOTING: u32 = u32::MAX - 1;
/// None is on.
const NONE: u32 = u32::MAX - 2;
const MOST: usize = 1 << 14;

static ACTIVE: AtomicU32 = AtomicU32::new(UNKNOWN);
static REACHED: [AtomicBool; MOST] = [const { AtomicBool::new(false) }; MOST];
static NOTES: OnceLock<Mutex<File>> = OnceLock::new();

/// Whether this mutant is to behave as one.
#[inline]
pub fn on(number: u32) -> bool {
    match ACTIVE.load(Ordering::Relaxed) {
        UNKNOWN => {
            look_up();
            on(number)
        }
        NOTING => {
            note(number);
            false
        }
        active => active == number,
    }
}

#[cold]
fn look_up() {
    let mode = if let Some(number) = std::env::var("MUTANT").ok().and_then(|text| text.parse().ok()) {
        number
    } else if let Some(path) = std::env::var_os("MUTANTS_REACHED") {
        NOTES.get_or_init(|| Mutex::new(OpenOptions::new().create(true).append(true).open(path).unwrap()));
        NOTING
    } else {
        NONE
    };
    ACTIVE.store(mode, Ordering::Relaxed);
}

fn note(number: u32) {
    if !REACHED[number as usize].swap(true, Ordering::Relaxed) {
        // One write: children of a test append to the same file.
        let line = format!("{number}\n");
        NOTES.get().unwrap().lock().unwrap().write_all(line.as_bytes()).unwrap();
    }
}
