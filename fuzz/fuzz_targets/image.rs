//! Images in either format: any bytes are checked, the same from any reader; what passes is sound, differs from itself
//! in nothing, and is the same image when it is written in any other shape and read again.
#![no_main]

use std::io::Read;

use axcon::device::Product;
use axcon::image::{self, AddressUnit, DefectId, Format, Image, LineEnd, Report, Shape};
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

fn check(reader: impl Read, allow: &[DefectId]) -> Report {
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    image::check(reader, None, &targets, None, allow).expect("a slice")
}

fn convert(image: &Image, record_bytes: u8) {
    for format in [Format::SRecord, Format::IntelHex] {
        for address_unit in [AddressUnit::Word, AddressUnit::Byte] {
            for record_bytes in [None, Some(record_bytes)] {
                let shape = Shape { format, address_unit, record_bytes, line_end: LineEnd::CrLf };
                let Ok(written) = image::convert(image, &shape) else { continue };
                let again = check(written.as_slice(), &[DefectId::AddressUnit]);
                assert_eq!(again.facts.format, Some(format));
                // What the words are for is not a matter of the shape; whether lines are sound is.
                for defect in &again.defects {
                    let of_lines = [DefectId::BadCharacter, DefectId::BadChecksum, DefectId::BadLength];
                    assert!(!of_lines.contains(&defect.id), "{shape:?}: {defect:?}");
                }
                // A single record does not show what its address counts.
                if let Some(again) = again.image().filter(|again| again.image().address_unit == address_unit) {
                    assert!(image::diff(image, again.image()).is_none(), "{shape:?}\n{image:?}\n{:?}", again.image());
                }
            }
        }
    }
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    let whole = check(bytes, &[]);
    let slow = check(Slowly(bytes, usize::from(size).max(1)), &[]);
    assert_eq!((&whole.facts, &whole.defects), (&slow.facts, &slow.defects));
    assert_eq!((whole.errors, whole.warnings), (slow.errors, slow.warnings));
    // Of what is no image only the beginning is read.
    assert!(whole.facts.format.is_none() || whole.facts.size == bytes.len() as u64);
    for defect in &whole.defects {
        assert!(defect.line >= 1 && defect.column >= 1, "{defect:?}");
    }
    assert!(whole.errors + whole.warnings >= whole.defects.len() as u64);
    // Everything that may be forgiven is forgiven: then more passes.
    let lenient = check(bytes, &DefectId::ALL);
    assert_eq!(whole.defects.len(), lenient.defects.len());
    if let Some(checked) = whole.image().or_else(|| lenient.image()) {
        let image = checked.image();
        assert!(!image.blocks.is_empty());
        assert!(image::diff(image, image).is_none());
        convert(image, size);
    }
});
