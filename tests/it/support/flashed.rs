//! What lies in a unit's flash, compared with an image by a reader that shares nothing with ours.

use std::fs;
use std::path::Path;

use super::flash::{assert_begins, laid_out};

/// What a file of S-records puts into flash, read by a program that shares nothing with ours.
fn words_of(file: &Path) -> Vec<(usize, Vec<u8>)> {
    let text = fs::read_to_string(file).expect("an image");
    let mut words = Vec::new();
    for line in text.lines().filter(|line| !line.is_empty()) {
        if let srec::Record::S3(data) = line.parse().expect("a record") {
            words.push((u32::from(data.address) as usize * 2, data.data));
        }
    }
    words
}

/// The flash file of a unit's state directory holds every word of the image, and none of an older one among them.
#[track_caller]
pub fn assert_flash_holds(flash: &Path, image: &Path) {
    let words = words_of(image);
    let wanted = laid_out(words.iter().map(|(at, data)| (*at, data.as_slice())));
    assert_begins(&fs::read(flash).expect("flash.bin"), &wanted, &flash.display().to_string());
}
