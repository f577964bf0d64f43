//! What is in a unit's memory: an identity block and an image of the parameters are read or refused, and what was
//! read is what is written again.
#![no_main]

use axcon::device::Product;
use axcon::emulator::memory::{IMAGE_BYTES, ParameterStore, Parameters};
use axcon::image::{Identity, IdentityError};
use axcon_fuzz::parameter;
use libfuzzer_sys::fuzz_target;

fn identity(program: &[u8]) {
    let Ok(mut identity) = Identity::read(program) else {
        assert!(Identity::verify(program).is_err());
        return;
    };
    let words = identity.program_words as usize;
    match Identity::verify(program) {
        Ok(verified) => assert_eq!(verified, identity),
        Err(error) => assert!(matches!(error, IdentityError::Crc { stored, .. } if stored == identity.crc)),
    }
    // Stamped again it is sound, and says the same.
    let mut stamped = program[..words * 2].to_vec();
    identity.stamp(&mut stamped);
    assert_eq!(Identity::verify(&stamped), Ok(identity));
}

/// The bytes as a whole memory whose slots are intact: chance finds no checksum.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut image = bytes.to_vec();
    image.resize(IMAGE_BYTES, 0xFF);
    for slot in image.chunks_mut(IMAGE_BYTES / 2) {
        let end = 16 + usize::from(u16::from_le_bytes([slot[6], slot[7]]));
        if end + 4 <= slot.len() {
            let crc = crc32fast::hash(&slot[..end]);
            slot[end..end + 4].copy_from_slice(&crc.to_le_bytes());
        }
    }
    image
}

fn parameters(product: &'static Product, image: Vec<u8>) {
    let read = Parameters::read(product, &image);
    let mut stores = Default::default();
    let mut store = ParameterStore::new(product, 1, image, &mut stores);
    let mut expected = read.unwrap_or_else(|_| Parameters::factory(product));
    // A memory without a serial number has been given one.
    expected.serial_number.get_or_insert(1);
    assert_eq!(store.values(), &expected);
    // Whatever was there, the next change is kept.
    let on = !store.values().stream.on;
    store.change(&mut stores, |values| values.stream.on = on);
    assert_eq!(Parameters::read(product, store.image()).as_ref(), Ok(store.values()));
    assert_eq!(store.values().stream.on, on);
    // What is kept can be put into the dictionary.
    let _ = store.objects();
}

fuzz_target!(|input: &[u8]| {
    let Some((choice, bytes)) = parameter(input) else { return };
    let product = &Product::all()[usize::from(choice & 1)];
    match choice >> 1 & 3 {
        0 | 1 => identity(bytes),
        2 => parameters(product, bytes.to_vec()),
        _ => parameters(product, sealed(bytes)),
    }
});
