//! Recordings: any bytes are read or refused with a place, the same in any chunks.
#![no_main]

use axcon::record::{Piece, Reader};
use libfuzzer_sys::fuzz_target;

fn read<'a>(chunks: impl Iterator<Item = &'a [u8]>) -> (Vec<Piece>, String) {
    let mut reader = Reader::default();
    let mut pieces = Vec::new();
    for chunk in chunks {
        if let Err(error) = reader.push(chunk, |piece| pieces.push(piece)) {
            return (pieces, error.to_string());
        }
    }
    let end = reader.finish(|piece| pieces.push(piece));
    (pieces, format!("{end:?}"))
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    assert_eq!(read(std::iter::once(bytes)), read(bytes.chunks(usize::from(size).max(1))));
});
