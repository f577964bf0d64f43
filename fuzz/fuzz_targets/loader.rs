//! The emulated loaders take any bytes at any time: no panic, every word in flash is one of a record that was sent, and a
//! host that carries out the unit's writes in their order has the same memory.
//!
//! The first byte chooses product, loader and wording, and whether the sender is patient: one byte at a time, at the
//! line's rate, and none while the loader holds it. So an image file after such a byte is loaded.
#![no_main]

use std::collections::BTreeMap;

use axcon::device::{LoaderKind, Pacing, Product};
use axcon::emulator::{Area, Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::time::{Duration, Instant, character_time};
use axcon_fuzz::{parameter, pieces};
use libfuzzer_sys::fuzz_target;

/// The longest a patient sender waits: longer than any erasing takes (10.2 s).
const PATIENCE: Duration = Duration::from_secs(15);

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
    // It listens once its header is out.
    host.wait(Duration::from_millis(if patient { 500 } else { 0 }));
    for (time, piece) in pieces(bytes) {
        host.wait(time);
        if patient {
            host.send_patiently(&piece);
        } else {
            host.send(&piece);
        }
    }
    // What was sent too fast for the ring of a G3 is read in any order.
    if patient || loader.pacing() == Pacing::Pages {
        let sent: Vec<u8> = pieces(bytes).into_iter().flat_map(|(_, piece)| piece).collect();
        check_words(host.unit.flash(), &candidates(&sent, loader, product.flash.program_words), loader);
    } else if !bytes.iter().any(|byte| byte.eq_ignore_ascii_case(&b'S')) {
        assert!(host.unit.flash().iter().all(|&byte| byte == 0xFF), "a word from nowhere");
    }
    // The supply fails in the middle of whatever is under way.
    host.unit.power_off(host.now);
    host.collect();
    assert_eq!(host.unit.flash().len(), product.flash.program_words as usize * 2);
    assert!(host.unit.flash() == host.flash, "the host's flash is another");
    assert!(host.unit.parameters() == host.parameters, "the host's parameters are others");
});

/// Every word that is not erased is one of those sent for its address. A loader that programs records as they come may
/// have programmed two, and clears the bits of both.
fn check_words(flash: &[u8], candidates: &BTreeMap<u32, Vec<u16>>, loader: LoaderKind) {
    for (address, word) in (0u32..).zip(flash.chunks_exact(2)) {
        let word = u16::from_le_bytes([word[0], word[1]]);
        if word == 0xFFFF {
            continue;
        }
        let sent = candidates.get(&address).map_or(&[][..], Vec::as_slice);
        let is_of_two = || sent.iter().any(|first| sent.iter().any(|second| first & second == word));
        let is_sent = sent.contains(&word) || loader.pacing() == Pacing::Records && is_of_two();
        assert!(is_sent, "{word:04X} at word {address:#x} is from nowhere: {sent:04X?}");
    }
}

/// The words that the records in a text have for each address, folded to the flash. Any `S` may begin a record, as what
/// precedes it may have been refused; whether its checksum is right does not matter to every loader.
fn candidates(sent: &[u8], loader: LoaderKind, program_words: u32) -> BTreeMap<u32, Vec<u16>> {
    let pages = loader.pacing() == Pacing::Pages;
    let text: Vec<u8> = sent.iter().copied().filter(|byte| !(pages && byte.is_ascii_control())).collect();
    let mut candidates: BTreeMap<u32, Vec<u16>> = BTreeMap::new();
    for at in text.iter().enumerate().filter(|(_, byte)| **byte == b'S').map(|(at, _)| at) {
        let address_bytes: u8 = match text.get(at + 1) {
            Some(b'1') if !pages => 2,
            Some(b'2') if !pages => 3,
            Some(b'3') => 4,
            _ => continue,
        };
        let mut bytes =
            text[at + 2..].chunks_exact(2).map_while(|pair| Some(digit(pair[0], pages)? << 4 | digit(pair[1], pages)?));
        let Some(count) = bytes.next() else { continue };
        let address = bytes.by_ref().take(address_bytes.into()).fold(0, |address, byte| address << 8 | u32::from(byte));
        let data_bytes = usize::from(count.wrapping_sub(address_bytes + 1));
        let mut data: Vec<u8> = bytes.by_ref().take(data_bytes).collect();
        if data_bytes % 2 == 1 {
            match loader {
                LoaderKind::G1 | LoaderKind::G2 => drop(data.pop()),
                LoaderKind::G3 => data.push(0xFF),
                // It takes the checksum for data.
                LoaderKind::G3Early => data.extend(bytes.next()),
            }
        }
        for (number, pair) in (0..).zip(data.chunks_exact(2)) {
            let address = address.wrapping_add(number) % program_words;
            let words = candidates.entry(address).or_default();
            let word = u16::from_le_bytes([pair[0], pair[1]]);
            if !words.contains(&word) {
                words.push(word);
            }
        }
    }
    candidates
}

/// A hexadecimal digit: those with pages take either case and nothing else, the others take all else for 0.
fn digit(character: u8, pages: bool) -> Option<u8> {
    let digit = char::from(character).to_digit(16).map(|digit| digit as u8);
    if pages { digit } else { Some(digit.filter(|_| !character.is_ascii_lowercase()).unwrap_or(0)) }
}
