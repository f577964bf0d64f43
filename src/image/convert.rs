//! Writing an image as a file: either format, either unit of addresses, records of any size.
//!
//! S-records are written as CodeWarrior does (S0 with a four-byte address, S3, S7, upper case), Intel HEX with linear
//! addresses (00, 01, 04, 05). Records keep their order, so that of two records for one address the same one counts as
//! before. The whole file is made in memory: an image has 512 KByte at most.

use std::collections::BTreeMap;

use ::ihex::Record as HexRecord;

use super::report::Format;
use super::srecord::{self, Kind, Record};
use super::{AddressUnit, Block, Image, LineEnd, MOST_BLOCK_BYTES};

/// What the file should look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// In which format.
    pub format: Format,
    /// What its addresses count.
    pub address_unit: AddressUnit,
    /// Data bytes of a record, 1 to 250; by default as in the image.
    pub record_bytes: Option<u8>,
    /// How its lines end.
    pub line_end: LineEnd,
}

/// Why an image cannot be written in this shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConvertError {
    /// An address of the new file needs more than 32 bits.
    #[error("address 0x{address:X} in the new file would need more than 32 bits")]
    TooHigh {
        /// The address, in the new unit.
        address: u64,
    },
    /// Counted in words, it lies between two.
    #[error("byte address 0x{address:08X} is in the middle of a word")]
    Odd {
        /// The byte's address.
        address: u64,
    },
    /// Records of this size cannot be.
    #[error("records take 1 to {MOST_BLOCK_BYTES} data bytes; {bytes} cannot be")]
    RecordBytes {
        /// What was asked for.
        bytes: u8,
    },
    /// Records of whole words cannot have this size.
    #[error(
        "where addresses count words, records take an even number of data bytes, 2 to {MOST_BLOCK_BYTES}; {bytes} cannot be"
    )]
    HalfWords {
        /// What was asked for.
        bytes: u8,
    },
}

/// Writes an image.
///
/// # Errors
/// If its addresses cannot be expressed in the unit, or records of the size cannot be.
pub fn convert(image: &Image, shape: &Shape) -> Result<Vec<u8>, ConvertError> {
    let unit = shape.address_unit;
    if let Some(bytes) = shape.record_bytes {
        if bytes == 0 || usize::from(bytes) > MOST_BLOCK_BYTES {
            return Err(ConvertError::RecordBytes { bytes });
        }
        if !u32::from(bytes).is_multiple_of(unit.bytes()) {
            return Err(ConvertError::HalfWords { bytes });
        }
    }
    let kept;
    let blocks = if unit == image.address_unit && shape.record_bytes.is_none() {
        &image.blocks
    } else {
        kept = regrouped(image, unit, shape.record_bytes)?;
        &kept
    };
    let entry = address_in(u64::from(image.entry) * u64::from(image.address_unit.bytes()), unit)?;
    // Readers disagree about where data goes on that runs past the last address; an S-record keeps it as it is.
    let ends = blocks.iter().map(|block| u64::from(block.address) + unit.addresses(block.data.len()));
    if shape.format == Format::IntelHex
        && let Some(end) = ends.max().filter(|&end| end > ADDRESSES)
    {
        return Err(ConvertError::TooHigh { address: end - 1 });
    }
    let mut file = File { bytes: Vec::new(), end: shape.line_end.text() };
    match shape.format {
        Format::SRecord => file.srecords(&image.header, blocks, entry),
        Format::IntelHex => file.intel_hex(blocks, entry, unit),
    }
    Ok(file.bytes)
}

/// An address in a unit, from one in bytes.
fn address_in(byte_address: u64, unit: AddressUnit) -> Result<u32, ConvertError> {
    let bytes = u64::from(unit.bytes());
    if !byte_address.is_multiple_of(bytes) {
        return Err(ConvertError::Odd { address: byte_address });
    }
    let address = byte_address / bytes;
    u32::try_from(address).map_err(|_| ConvertError::TooHigh { address })
}

/// The data in records of another size or unit. Records that continue one another are joined first.
fn regrouped(image: &Image, unit: AddressUnit, record_bytes: Option<u8>) -> Result<Vec<Block>, ConvertError> {
    let longest = image.blocks.iter().map(|block| block.data.len()).max().unwrap_or(MOST_BLOCK_BYTES);
    let size = record_bytes.map_or(longest.next_multiple_of(2).min(MOST_BLOCK_BYTES), usize::from);
    let mut runs: Vec<(u64, Vec<u8>)> = Vec::new();
    for block in &image.blocks {
        let start = u64::from(block.address) * u64::from(image.address_unit.bytes());
        match runs.last_mut() {
            Some((first, data)) if *first + data.len() as u64 == start => data.extend_from_slice(&block.data),
            _ => runs.push((start, block.data.clone())),
        }
    }
    if unit == AddressUnit::Word {
        complete_words(&mut runs);
    }
    let mut blocks = Vec::new();
    for (start, data) in runs {
        for (number, data) in data.chunks(size).enumerate() {
            blocks.push(Block { address: address_in(start + (number * size) as u64, unit)?, data: data.to_vec() });
        }
    }
    Ok(blocks)
}

/// Gives every run that ends in the middle of a word the other half: as an earlier run left it, else as erased flash
/// reads.
fn complete_words(runs: &mut [(u64, Vec<u8>)]) {
    let missing_half = |start: u64, data: &[u8]| Some(start + data.len() as u64).filter(|end| end % 2 == 1);
    let mut halves: BTreeMap<u64, u8> =
        runs.iter().filter_map(|(start, data)| missing_half(*start, data)).map(|address| (address, ERASED)).collect();
    for (start, data) in runs {
        data.extend(missing_half(*start, data).and_then(|address| halves.get(&address)));
        for (address, half) in halves.range_mut(*start..*start + data.len() as u64) {
            *half = data[(address - *start) as usize];
        }
    }
}

/// What a byte of erased flash reads as.
const ERASED: u8 = 0xFF;

/// A file in the making.
struct File {
    bytes: Vec<u8>,
    end: &'static [u8],
}

impl File {
    fn srecords(&mut self, header: &[u8], blocks: &[Block], entry: u32) {
        let header = &header[..header.len().min(srecord::LONGEST_HEADER)];
        srecord::write_header(header, &mut self.bytes);
        self.bytes.extend(self.end);
        for Block { address, data } in blocks {
            self.srecord(&Record { kind: Kind::Data32, address: *address, data });
        }
        self.srecord(&Record { kind: Kind::Start32, address: entry, data: &[] });
    }

    fn srecord(&mut self, record: &Record<'_>) {
        record.write(&mut self.bytes);
        self.bytes.extend(self.end);
    }

    fn intel_hex(&mut self, blocks: &[Block], entry: u32, unit: AddressUnit) {
        let mut base = 0;
        for block in blocks {
            let (mut address, mut rest) = (block.address, &block.data[..]);
            while !rest.is_empty() {
                if address >> 16 != base {
                    base = address >> 16;
                    self.hex(&HexRecord::ExtendedLinearAddress(base as u16));
                }
                // No record runs past the last offset: readers disagree about what that means.
                let room = (OFFSETS - (address & (OFFSETS - 1))) * unit.bytes();
                let (now, later) = rest.split_at(rest.len().min(room as usize));
                self.hex(&HexRecord::Data { offset: address as u16, value: now.to_vec() });
                address = address.wrapping_add(unit.addresses(now.len()) as u32);
                rest = later;
            }
        }
        self.hex(&HexRecord::StartLinearAddress(entry));
        self.hex(&HexRecord::EndOfFile);
    }

    fn hex(&mut self, record: &HexRecord) {
        // This fails only above 255 data bytes, and a block has fewer.
        if let Ok(text) = record.to_record_string() {
            self.bytes.extend(text.into_bytes());
            self.bytes.extend(self.end);
        }
    }
}

/// Offsets a base has.
const OFFSETS: u32 = 0x1_0000;
/// Addresses a file can name.
const ADDRESSES: u64 = 1 << 32;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Report, check};
    use super::*;

    fn shape(format: Format, address_unit: AddressUnit) -> Shape {
        Shape { format, address_unit, record_bytes: None, line_end: LineEnd::Lf }
    }

    fn image(address_unit: AddressUnit, entry: u32, blocks: &[(u32, &[u8])]) -> Image {
        let blocks = blocks.iter().map(|&(address, data)| Block { address, data: data.to_vec() }).collect();
        Image { header: b"HI".to_vec(), blocks, entry, address_unit }
    }

    fn text(image: &Image, shape: &Shape) -> Result<String, ConvertError> {
        convert(image, shape).map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
    }

    fn read(file: &[u8]) -> Report {
        check(file, None, &[], None, &[]).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn both_formats_are_written_as_they_should_look() {
        let image = image(AddressUnit::Word, 0x10, &[(0xFFFF, &[1, 2, 3, 4]), (0x2_0000, &[5, 6])]);
        assert_eq!(
            text(&image, &shape(Format::SRecord, AddressUnit::Word)).as_deref(),
            Ok("S0070000000048496\
                7\nS3090000FFFF01020304EE\nS307000200000506EB\nS70500000010EA\n")
        );
        assert_eq!(
            text(&image, &shape(Format::IntelHex, AddressUnit::Word)).as_deref(),
            Ok(":02FFFF000102FD\n:020000040001F9\n:020000000304F7\n:020000040002F8\n:020000000506F3\n\
                :0400000500000010E7\n:00000001FF\n")
        );
    }

    #[test]
    fn words_become_bytes_and_bytes_become_words() {
        let words = image(AddressUnit::Word, 0x10, &[(0, &[1, 2]), (1, &[3, 4]), (8, &[5, 6])]);
        let bytes = image(AddressUnit::Byte, 0x20, &[(0, &[1, 2]), (2, &[3, 4]), (16, &[5, 6])]);
        for format in [Format::SRecord, Format::IntelHex] {
            for unit in [AddressUnit::Word, AddressUnit::Byte] {
                assert_eq!(
                    text(&words, &shape(format, unit)),
                    text(&bytes, &shape(format, unit)),
                    "{format:?} {unit:?}"
                );
            }
        }
    }

    #[test]
    fn records_that_follow_on_each_other_are_joined_before_they_are_cut_anew() {
        let image =
            image(AddressUnit::Word, 0, &[(4, &[1, 2, 3, 4]), (6, &[5, 6]), (7, &[7, 8, 9, 10]), (16, &[11, 12])]);
        let blocks = regrouped(&image, AddressUnit::Word, Some(8)).expect("they have addresses");
        let expected = [(4, vec![1, 2, 3, 4, 5, 6, 7, 8]), (8, vec![9, 10]), (16, vec![11, 12])]
            .map(|(address, data)| Block { address, data });
        assert_eq!(blocks, expected);
    }

    #[test]
    fn half_a_word_is_filled_up_where_addresses_count_words() {
        let odd = image(AddressUnit::Byte, 0, &[(0, &[1, 2, 3])]);
        let blocks = |unit| regrouped(&odd, unit, None).expect("it has an address");
        assert_eq!(blocks(AddressUnit::Byte), [Block { address: 0, data: vec![1, 2, 3] }]);
        assert_eq!(blocks(AddressUnit::Word), [Block { address: 0, data: vec![1, 2, 3, 0xFF] }]);
    }

    #[test]
    fn half_a_word_that_is_written_again_keeps_the_other_half() {
        let twice = image(AddressUnit::Byte, 0, &[(2, &[0xAA, 0xBB]), (0, &[0xCC, 0xDD, 0xEE]), (8, &[1])]);
        let blocks = regrouped(&twice, AddressUnit::Word, None).expect("even addresses");
        let expected = [(1, vec![0xAA, 0xBB]), (0, vec![0xCC, 0xDD, 0xEE, 0xBB]), (4, vec![1, 0xFF])];
        assert_eq!(blocks, expected.map(|(address, data)| Block { address, data }));
        let thrice = image(AddressUnit::Byte, 0, &[(0, &[1, 2]), (0, &[3]), (0, &[4, 5]), (0, &[6])]);
        let blocks = regrouped(&thrice, AddressUnit::Word, None).expect("even addresses");
        assert_eq!(blocks.last(), Some(&Block { address: 0, data: vec![6, 5] }));
    }

    #[test]
    fn what_has_no_address_in_the_unit_is_refused() {
        let high = image(AddressUnit::Word, 0, &[(0x8000_0000, &[1, 2])]);
        let to_bytes = shape(Format::SRecord, AddressUnit::Byte);
        assert_eq!(convert(&high, &to_bytes), Err(ConvertError::TooHigh { address: 0x1_0000_0000 }));
        let to_words = shape(Format::SRecord, AddressUnit::Word);
        let odd = image(AddressUnit::Byte, 0, &[(3, &[1, 2])]);
        assert_eq!(convert(&odd, &to_words), Err(ConvertError::Odd { address: 3 }));
        let past_the_end = image(AddressUnit::Word, 0, &[(0xFFFF_FFFF, &[1, 2, 3, 4])]);
        let hex = shape(Format::IntelHex, AddressUnit::Word);
        assert_eq!(convert(&past_the_end, &hex), Err(ConvertError::TooHigh { address: 0x1_0000_0000 }));
        let last = image(AddressUnit::Word, 0, &[(0xFFFF_FFFF, &[1, 2])]);
        assert!(convert(&last, &hex).is_ok());
        let entry = image(AddressUnit::Byte, 5, &[(0, &[1, 2])]);
        assert_eq!(convert(&entry, &to_words), Err(ConvertError::Odd { address: 5 }));
        for bytes in [0, 251, 255] {
            let shape = Shape { record_bytes: Some(bytes), ..to_words };
            assert_eq!(convert(&odd, &shape), Err(ConvertError::RecordBytes { bytes }));
        }
        let error = convert(&odd, &Shape { record_bytes: Some(3), ..to_words }).expect_err("half a word");
        assert!(error.to_string().contains("an even number of data bytes, 2 to 250; 3 cannot be"), "{error}");
    }

    /// Word-addressed blocks of whole words, in ascending order.
    fn any_image() -> impl Strategy<Value = Image> {
        let block = (0u32..40, prop::collection::vec(any::<u8>(), 2..=250));
        (prop::collection::vec(block, 1..20), 0u32..0x7FFF_0000).prop_map(|(pieces, start)| {
            let mut address = start;
            let mut blocks = Vec::new();
            for (gap, mut data) in pieces {
                data.truncate(data.len() / 2 * 2);
                address += gap;
                let words = data.len() as u32 / 2;
                blocks.push(Block { address, data });
                address += words;
            }
            Image { header: Vec::new(), blocks, entry: start, address_unit: AddressUnit::Word }
        })
    }

    /// Every byte with its address in bytes.
    fn memory(image: &Image) -> Vec<(u64, u8)> {
        let unit = u64::from(image.address_unit.bytes());
        let of_block = |block: &Block| {
            let start = u64::from(block.address) * unit;
            block.data.iter().enumerate().map(move |(at, &byte)| (start + at as u64, byte)).collect::<Vec<_>>()
        };
        image.blocks.iter().flat_map(of_block).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn any_shape_is_read_back_as_the_same_memory(
            image in any_image(), hex in any::<bool>(), byte in any::<bool>(), size in prop::option::of(1u8..=125),
        ) {
            let format = if hex { Format::IntelHex } else { Format::SRecord };
            let address_unit = if byte { AddressUnit::Byte } else { AddressUnit::Word };
            let record_bytes = size.map(|size| size * 2);
            let shape = Shape { format, address_unit, record_bytes, line_end: LineEnd::CrLf };
            let file = convert(&image, &shape).map_err(|error| TestCaseError::fail(error.to_string()))?;
            let report = read(&file);
            prop_assert_eq!(report.facts.format, Some(format));
            let mut back = report.image_as(address_unit);
            back.address_unit = address_unit;
            prop_assert_eq!(memory(&back), memory(&image));
            prop_assert_eq!(u64::from(back.entry) * u64::from(address_unit.bytes()), u64::from(image.entry) * 2);
        }
    }
}
