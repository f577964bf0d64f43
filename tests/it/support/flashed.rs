//! What lies in a unit's flash, compared with an image by a reader that shares nothing with ours.

use std::fs;
use std::path::Path;

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

/// The flash file of a unit's state directory holds every word of the image.
pub fn assert_flash_holds(flash: &Path, image: &Path) {
    let flash = fs::read(flash).expect("flash.bin");
    let words = words_of(image);
    assert!(!words.is_empty());
    for (at, data) in words {
        assert_eq!(flash[at..at + data.len()], data, "from byte {at:#x} on");
    }
}
