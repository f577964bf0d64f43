//! Images in either format: any bytes are checked, the same from any reader; what passes does not differ from itself, and
//! is the same image, with no new error, when it is written in any other shape and read again.
#![no_main]

use std::io::Read;

use axcon::device::Product;
use axcon::image::{self, AddressUnit, ConvertError, DefectId, Format, Image, LineEnd, Report, Severity, Shape};
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

/// Errors that a unit's addresses decide. They can come with another unit, and where no entry point was given.
const OF_ADDRESSES: [DefectId; 6] = [
    DefectId::AddressUnit,
    DefectId::AddressWrap,
    DefectId::OutOfRange,
    DefectId::BootFlash,
    DefectId::DataMemory,
    DefectId::EntryOutside,
];
/// A record for each byte can be more of them than are read.
const MOST_RECORDS: usize = 65_536;

fn errors(report: &Report) -> Vec<DefectId> {
    report.defects.iter().filter(|defect| defect.severity == Severity::Error).map(|defect| defect.id).collect()
}

fn convert(before: &Report, image: &Image, record_bytes: u8) {
    for format in [Format::SRecord, Format::IntelHex] {
        for address_unit in [AddressUnit::Word, AddressUnit::Byte] {
            for record_bytes in [None, Some(record_bytes)] {
                let shape = Shape { format, address_unit, record_bytes, line_end: LineEnd::CrLf };
                match image::convert(image, &shape) {
                    Ok(written) => compare(before, image, &shape, &written),
                    Err(error) => assert!(may_refuse(image, &shape, error), "{shape:?}: {error}\n{image:?}"),
                }
            }
        }
    }
}

/// The written file is the image again.
fn compare(before: &Report, image: &Image, shape: &Shape, written: &[u8]) {
    let after = check(written, &DefectId::ALL);
    assert_eq!(after.facts.format, Some(shape.format));
    if after.defects.iter().any(|defect| defect.id == DefectId::TooLarge) {
        assert!(written.iter().filter(|&&byte| byte == b'\n').count() > MOST_RECORDS, "{shape:?}");
        return;
    }
    let again = after.image().unwrap_or_else(|| panic!("{shape:?}: {:?}\n{image:?}", after.defects));
    let again = again.image();
    if shape.format == Format::SRecord {
        assert!(image.header.starts_with(&again.header) && image.header.len() <= again.header.len() + 2);
    }
    // What addresses count is seen from how they advance, and longer records advance less often.
    if again.address_unit != shape.address_unit {
        return;
    }
    assert!(image::diff(image, again).is_none(), "{shape:?}\n{image:?}\n{again:?}");
    let (before_errors, is_same_unit) = (errors(before), shape.address_unit == image.address_unit);
    for id in errors(&after) {
        let may_be_new = OF_ADDRESSES.contains(&id) && (!is_same_unit || before.facts.entry.is_none());
        assert!(before_errors.contains(&id) || may_be_new, "{shape:?}: {id} is new\n{image:?}\n{:?}", after.defects);
    }
}

/// Whether an image has something that the shape cannot express.
fn may_refuse(image: &Image, shape: &Shape, error: ConvertError) -> bool {
    match error {
        ConvertError::RecordBytes { bytes } => bytes == 0 || usize::from(bytes) > image::MOST_BLOCK_BYTES,
        ConvertError::HalfWords { bytes } => bytes % 2 == 1 && shape.address_unit == AddressUnit::Word,
        ConvertError::Odd { .. } => (image.address_unit, shape.address_unit) == (AddressUnit::Byte, AddressUnit::Word),
        ConvertError::TooHigh { address } => address > u64::from(u32::MAX),
    }
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    let whole = check(bytes, &[]);
    let slow = check(Slowly(bytes, usize::from(size).max(1)), &[]);
    assert_eq!((&whole.facts, &whole.defects), (&slow.facts, &slow.defects));
    assert_eq!((whole.errors, whole.warnings), (slow.errors, slow.warnings));
    // Of what is not an image only the beginning is read.
    assert!(whole.facts.format.is_none() || whole.facts.size == bytes.len() as u64);
    for defect in &whole.defects {
        assert!(defect.line >= 1 && defect.column >= 1, "{defect:?}");
    }
    assert!(whole.errors + whole.warnings >= whole.defects.len() as u64);
    // With everything forgiven that can be, more passes.
    let lenient = check(bytes, &DefectId::ALL);
    assert_eq!(whole.defects.len(), lenient.defects.len());
    if let Some(checked) = whole.image().or_else(|| lenient.image()) {
        let image = checked.image();
        assert!(!image.blocks.is_empty());
        assert!(image::diff(image, image).is_none());
        convert(&lenient, image, size);
    }
});
