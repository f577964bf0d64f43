//! Program images: S-record and Intel HEX files, what they hold, and whether they may be sent.
//!
//! [`check()`] reads a file of any size once and gives a [`Report`] with every defect in it; only a report without an
//! error yields a [`CheckedImage`], and only a checked image can be uploaded. [`srecord`] and [`ihex`] know one line,
//! [`make`] builds sample files. This module does not know the products: the caller passes them as [`Target`]s.

mod check;
mod content;
mod convert;
mod defect;
mod diff;
mod digits;
mod fit;
pub mod identity;
pub mod ihex;
mod ihex_file;
mod lines;
pub mod make;
mod nature;
mod report;
mod scan;
pub mod srecord;
mod srecord_file;
mod whole;

use serde::Deserialize;

use crate::version::Version;

pub use check::check;
pub use convert::{ConvertError, Shape, convert};
pub use defect::{Defect, DefectId, Severity, UnknownDefect};
pub use diff::{Change, Difference, Differing, count_words, diff};
pub use fit::{Misfit, Software};
pub use identity::{Identity, IdentityError};
pub use lines::LineEnd;
pub use report::{AddressRange, CheckedImage, Facts, Format, Report};

/// What an address of an image counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AddressUnit {
    /// 16-bit words, low byte first: 32 data bytes advance the address by 16.
    Word,
    /// Bytes.
    Byte,
}

impl AddressUnit {
    /// The name in JSON and in product files.
    pub const fn name(self) -> &'static str {
        match self {
            AddressUnit::Word => "word",
            AddressUnit::Byte => "byte",
        }
    }

    /// Bytes at one address.
    pub const fn bytes(self) -> u32 {
        match self {
            AddressUnit::Word => 2,
            AddressUnit::Byte => 1,
        }
    }

    /// Addresses that this many bytes take; half a word takes a whole one.
    pub const fn addresses(self, bytes: usize) -> u64 {
        (bytes as u64).div_ceil(self.bytes() as u64)
    }
}

/// The program flash of a product.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlashMap {
    /// What addresses count.
    pub address_unit: AddressUnit,
    /// 16-bit words of program flash, from address 0 on.
    pub program_words: u32,
    /// 16-bit words that are erased and written together.
    pub page_words: u32,
}

impl FlashMap {
    /// The first address after the program flash, in the map's unit.
    pub fn end(&self) -> u64 {
        self.address_unit.addresses(self.program_words as usize * 2)
    }
}

/// A product an image may be for, as far as an image's check needs to know it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// Product name as identity blocks write it.
    pub product: String,
    /// Its program flash.
    pub flash: FlashMap,
    /// How its upload files are named, with `{version}` for the version.
    pub file_name: String,
    /// Its boot flash, in the flash map's unit: the loader lives there and cannot replace itself.
    pub boot: Option<AddressRange>,
    /// What its loader does with data that belongs elsewhere.
    pub outside: Outside,
}

/// What a loader does with data outside of the program flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outside {
    /// Addresses of a larger part of the family (below 00200000h) are folded onto the program flash, those marked as
    /// data memory go there ([`Destination`]), others are skipped. All of this is silent, and success is reported.
    Folds,
    /// It stops with an error, after it has erased the old program.
    Refuses,
    /// The loader is not known.
    Unknown,
}

/// Where a loader that [folds](Outside::Folds) puts a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Destination {
    /// Into program flash, at the address modulo its size.
    Program,
    /// Into data memory.
    Data,
    /// Nowhere.
    Skipped,
}

impl Destination {
    /// Where a word of this address goes.
    pub const fn of(address: u64) -> Self {
        let high_half = address >> 16;
        if is_marked_as_data(address) || high_half == DATA_HIGH_HALF {
            Destination::Data
        } else if high_half < DATA_HIGH_HALF {
            Destination::Program
        } else {
            Destination::Skipped
        }
    }
}

/// Whether an address carries the linker's mark for data memory, whatever other bits it has.
const fn is_marked_as_data(address: u64) -> bool {
    address & DATA_MARK != 0
}

/// CodeWarrior's mark for data memory in an address.
const DATA_MARK: u64 = 0x0200_0000;
/// The upper half of the addresses that a folding loader takes for data memory.
const DATA_HIGH_HALF: u64 = 0x0020;

impl Target {
    /// The version a file name claims to hold, if the name is one of this product's.
    ///
    /// Copies are often renamed (`AXTC4CO_V1.2.0 (1).elf.S`), so only the start of the name has to fit.
    pub fn version_in_name(&self, file_name: &str) -> Option<Version> {
        let (before, _) = self.file_name.split_once("{version}")?;
        let start = file_name.get(..before.len())?;
        let rest = file_name.get(before.len()..)?;
        if !start.eq_ignore_ascii_case(before) {
            return None;
        }
        let end = rest.find(|found: char| !found.is_ascii_digit() && found != '.').unwrap_or(rest.len());
        rest.get(..end)?.trim_end_matches('.').parse().ok()
    }
}

/// A program image as its file gives it: decoded, in the file's order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Text bytes of the header record S0, without its address.
    pub header: Vec<u8>,
    /// Data records in the file's order.
    pub blocks: Vec<Block>,
    /// Entry point of the terminating record.
    pub entry: u32,
    /// What addresses count.
    pub address_unit: AddressUnit,
}

/// The data of one record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Address of the first byte, in the image's unit.
    pub address: u32,
    /// The bytes, 1 to [`MOST_BLOCK_BYTES`]; whole words where addresses count words.
    pub data: Vec<u8>,
}

/// The most bytes an S3 record can hold. Records of other kinds may have a few more; they become two blocks.
pub const MOST_BLOCK_BYTES: usize = srecord::Kind::Data32.most_data();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_tells_its_version_even_when_a_copy_was_renamed() {
        let target = Target {
            product: "AXTC4CO".into(),
            flash: FlashMap { address_unit: AddressUnit::Word, program_words: 0x10000, page_words: 256 },
            file_name: "AXTC4CO_V{version}.elf.S".into(),
            boot: None,
            outside: Outside::Unknown,
        };
        for name in ["AXTC4CO_V1.2.0.elf.S", "axtc4co_v1.2.0.elf.s", "AXTC4CO_V1.2.0 (1).elf.S", "AXTC4CO_V1.2.0.S"] {
            assert_eq!(target.version_in_name(name), Some(Version::new(1, 2, 0)), "{name}");
        }
        for name in ["", "AXTC4CO", "AXTC4CO_Vx.y.z.elf.S", "AXRTD8CO_V1.2.0.elf.S", "AXTC4CO_V1.2.elf.S", "ÄXTC4CO_V1"]
        {
            assert_eq!(target.version_in_name(name), None, "{name}");
        }
    }
}
