//! The emulated loaders take any bytes at any time: no panic, and the flash stays what its last records made it.
#![no_main]

use axcon::device::{LoaderKind, Product};
use axcon::emulator::{Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::time::{Duration, Instant};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, Vec<(u8, Vec<u8>)>)| {
    let (choice, chunks) = input;
    let product = &Product::all()[usize::from(choice & 1)];
    let loader = LoaderKind::ALL[usize::from(choice >> 1) % LoaderKind::ALL.len()];
    // Empty flash: the loader waits for a file.
    let flash = vec![0xFF; product.flash.program_words as usize * 2];
    let setup = Setup { product, loader, seed: 1, dialect: u64::from(choice >> 4), flash, parameters: Vec::new() };
    let mut unit = Unit::new(setup);
    let mut now = Instant::ZERO;
    unit.power_on(now);
    for (wait, bytes) in chunks {
        let then = now + Duration::from_millis(u64::from(wait) * 4);
        while let Some(due) = unit.poll_timeout().filter(|due| *due <= then) {
            now = due.max(now);
            unit.handle_timeout(now);
            while unit.poll_transmit().is_some() {}
        }
        now = then;
        unit.handle_bytes(now, &bytes);
        while unit.poll_transmit().is_some() {}
    }
    assert_eq!(unit.flash().len(), product.flash.program_words as usize * 2);
});
