//! Images: any bytes are checked, the same from any reader, and what passes is sound.
#![no_main]

use std::io::Read;

use axcon::device::Product;
use axcon::image;
use libfuzzer_sys::fuzz_target;

/// Gives a few bytes at a time.
struct Slowly<'a>(&'a [u8], usize);

impl Read for Slowly<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.1.min(self.0.len()).min(buffer.len());
        buffer[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        Ok(count)
    }
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let whole = image::check(bytes, None, &targets, None, &[]).expect("a slice");
    let slow = image::check(Slowly(bytes, usize::from(size).max(1)), None, &targets, None, &[]).expect("a slice");
    assert_eq!(format!("{:?}", whole.defects), format!("{:?}", slow.defects));
    for defect in &whole.defects {
        assert!(defect.line >= 1 && defect.column >= 1, "{defect:?}");
    }
    if let Some(checked) = whole.image() {
        assert!(!checked.image().blocks.is_empty());
    }
});
