//! What lies in a unit's program flash, compared with the image that was sent to it: every word from the first one to
//! the image's last, erased where the image has none. What lies after that is not the image's.

use axcon::emulator::Unit;
use axcon::image::CheckedImage;

/// The image in erased flash, from word 0 to its last one: bytes in S-record order.
pub fn program(image: &CheckedImage) -> Vec<u8> {
    laid_out(image.image().blocks.iter().map(|block| (block.address as usize * 2, block.data.as_slice())))
}

/// Pieces, each with the number of its first byte, in erased flash up to the end of the last of them.
pub fn laid_out<'a>(pieces: impl Iterator<Item = (usize, &'a [u8])>) -> Vec<u8> {
    let mut flash = Vec::new();
    for (at, data) in pieces {
        let end = at + data.len();
        if flash.len() < end {
            flash.resize(end, 0xFF);
        }
        flash[at..end].copy_from_slice(data);
    }
    flash
}

/// Whether the unit's flash holds the image.
pub fn holds(unit: &Unit, image: &CheckedImage) -> bool {
    unit.flash().starts_with(&program(image))
}

/// It holds it, or `story` has failed.
#[track_caller]
pub fn assert_holds(unit: &Unit, image: &CheckedImage, story: &str) {
    assert_begins(unit.flash(), &program(image), story);
}

/// The flash begins with these bytes, or `story` has failed.
#[track_caller]
pub fn assert_begins(flash: &[u8], wanted: &[u8], story: &str) {
    assert!(!wanted.is_empty() && flash.len() >= wanted.len(), "{story}: {} bytes of {}", flash.len(), wanted.len());
    let differing = wanted.iter().zip(flash).position(|(wanted, is)| wanted != is);
    assert_eq!(differing, None, "{story}: from this byte on the flash does not hold the image");
}
