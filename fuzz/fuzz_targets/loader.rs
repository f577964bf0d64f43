//! The emulated loaders take any bytes at any time: no panic, the flash holds nothing that nobody sent, and a host that
//! carries out the unit's writes in their order has the same memory.
//!
//! The first byte chooses product, loader and wording, and whether the sender is patient: one byte at a time, at the
//! line's rate, and none while the loader holds it. So an image file behind such a byte is loaded.
#![no_main]

use axcon::device::{LoaderKind, Product};
use axcon::emulator::{Area, Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::time::{Duration, Instant, character_time};
use axcon_fuzz::{parameter, pieces};
use libfuzzer_sys::fuzz_target;

/// How long a patient sender waits at most: longer than any erasing takes.
const PATIENCE: Duration = Duration::from_secs(5);

struct Host {
    unit: Unit,
    now: Instant,
    /// What a host makes of the unit's writes.
    flash: Vec<u8>,
    parameters: Vec<u8>,
}

impl Host {
    fn collect(&mut self) {
        while self.unit.poll_transmit().is_some() {}
        while let Some(store) = self.unit.poll_store() {
            let memory = match store.area {
                Area::Flash => &mut self.flash,
                Area::Parameters => &mut self.parameters,
            };
            let end = store.offset + store.bytes.len();
            memory.resize(memory.len().max(end), 0xFF);
            memory[store.offset..end].copy_from_slice(&store.bytes);
        }
    }

    fn wait(&mut self, time: Duration) {
        let then = self.now + time;
        while let Some(due) = self.unit.poll_timeout().filter(|due| *due <= then) {
            self.now = due.max(self.now);
            self.unit.handle_timeout(self.now);
            self.collect();
        }
        self.now = then;
    }

    fn send(&mut self, bytes: &[u8]) {
        self.unit.handle_bytes(self.now, bytes);
        self.collect();
    }

    fn send_patiently(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let end = self.now + PATIENCE;
            while self.unit.holds_sender() && self.now < end {
                self.wait(Duration::from_millis(1));
            }
            self.wait(character_time(115_200));
            self.send(&[byte]);
        }
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((choice, bytes)) = parameter(input) else { return };
    let product = &Product::all()[usize::from(choice & 1)];
    let loader = LoaderKind::ALL[usize::from(choice >> 1 & 3) % LoaderKind::ALL.len()];
    let patient = choice & 8 != 0;
    // Empty flash: the loader waits for a file.
    let flash = vec![0xFF; product.flash.program_words as usize * 2];
    let setup = Setup {
        product,
        loader,
        seed: 1,
        dialect: u64::from(choice >> 4),
        flash: flash.clone(),
        parameters: Vec::new(),
    };
    let mut host = Host { unit: Unit::new(setup), now: Instant::ZERO, flash, parameters: Vec::new() };
    host.unit.power_on(host.now);
    host.collect();
    // It listens behind its header.
    host.wait(Duration::from_millis(if patient { 500 } else { 0 }));
    for (time, piece) in pieces(bytes) {
        host.wait(time);
        if patient {
            host.send_patiently(&piece);
        } else {
            host.send(&piece);
        }
    }
    // The supply fails in the middle of whatever is under way.
    host.unit.power_off(host.now);
    host.collect();
    assert_eq!(host.unit.flash().len(), product.flash.program_words as usize * 2);
    assert!(host.unit.flash() == host.flash, "the host's flash is another");
    assert!(host.unit.parameters() == host.parameters, "the host's parameters are others");
    if !bytes.iter().any(|byte| byte.eq_ignore_ascii_case(&b'S')) {
        assert!(host.flash.iter().all(|&byte| byte == 0xFF), "words from nowhere");
    }
});
