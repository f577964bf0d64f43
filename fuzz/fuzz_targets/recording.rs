//! Recordings: any bytes are read or refused with a place, the same in any chunks; what was read can be recorded and
//! read again.
#![no_main]

use axcon::endpoint::Secrecy;
use axcon::record::{Cast, Header, Piece, Reader};
use axcon::time::Instant;
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

/// The pieces after the header, in a recording of our own.
fn record(pieces: &[Piece]) -> Vec<u8> {
    let mut cast = Cast::begin(Vec::new(), &Header::default(), Instant::ZERO).expect("a vector takes all");
    for piece in pieces {
        let taken = match piece {
            Piece::Bytes { at, direction, bytes } => cast.push(*at, *direction, Secrecy::Open, bytes),
            Piece::Mark { at, text } => cast.mark(*at, text),
            Piece::Header(_) => Ok(()),
        };
        taken.expect("a vector takes all");
    }
    cast.into_inner()
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    let whole = read(std::iter::once(bytes));
    assert_eq!(whole, read(bytes.chunks(usize::from(size).max(1))));
    let (pieces, _) = whole;
    let contents = |pieces: &[Piece]| -> Vec<_> {
        let of = |piece: &Piece| match piece {
            Piece::Bytes { direction, bytes, .. } if !bytes.is_empty() => Some((Some(*direction), bytes.clone())),
            Piece::Mark { text, .. } => Some((None, text.clone().into_bytes())),
            Piece::Bytes { .. } | Piece::Header(_) => None,
        };
        pieces.iter().filter_map(of).collect()
    };
    let (again, end) = read(std::iter::once(record(&pieces).as_slice()));
    assert_eq!(contents(&pieces), contents(&again), "{end}");
});
