//! What a check found, and the image if it may be sent.

use super::content::Content;
use super::defect::{Defect, DefectId};
use super::identity::Identity;
use super::lines::LineEnd;
use super::{AddressUnit, Block, Image, MOST_BLOCK_BYTES, ihex, srecord_file};

/// Everything known about an image file.
#[derive(Debug)]
pub struct Report {
    /// What is in the file.
    pub facts: Facts,
    /// Defects in the order of the file: the first thousand errors and warnings each, and the first of each kind.
    pub defects: Vec<Defect>,
    /// Number of errors, allowed ones included.
    pub errors: u64,
    /// Number of warnings.
    pub warnings: u64,
    /// Number of errors that were allowed by name.
    pub allowed: u64,
    /// Which errors those are, each once.
    pub overridden: Vec<DefectId>,
    pub(super) content: Content,
}

impl Report {
    /// Whether the image may be sent.
    pub fn is_ok(&self) -> bool {
        self.errors == self.allowed
    }

    /// Defects that are counted but not listed.
    pub fn unlisted(&self) -> u64 {
        (self.errors + self.warnings).saturating_sub(self.defects.len() as u64)
    }

    /// The image, if it may be sent.
    ///
    /// An odd record of a word-addressed image, which has to be allowed by name, is filled up with FFh.
    pub fn image(&self) -> Option<CheckedImage> {
        if !self.is_ok() {
            return None;
        }
        let image = self.image_as(self.content.unit);
        Some(CheckedImage { image, identity: self.facts.identity.clone(), overridden: self.overridden.clone() })
    }

    /// The image, whatever is wrong with it, its addresses taken for this unit.
    pub(super) fn image_as(&self, address_unit: AddressUnit) -> Image {
        let mut blocks = Vec::with_capacity(self.content.pieces.len());
        for piece in &self.content.pieces {
            let mut address = piece.address;
            for data in self.content.data(piece).chunks(MOST_BLOCK_BYTES) {
                let mut data = data.to_vec();
                data.resize(data.len().next_multiple_of(address_unit.bytes() as usize), 0xFF);
                let next = address.wrapping_add(address_unit.addresses(data.len()) as u32);
                blocks.push(Block { address, data });
                address = next;
            }
        }
        Image {
            header: self.facts.header.clone().unwrap_or_default(),
            blocks,
            entry: self.facts.entry.unwrap_or_default(),
            address_unit,
        }
    }
}

/// What is in an image file, as far as it can be told.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// What kind of file it is.
    pub format: Option<Format>,
    /// Bytes read; of a file that is not an image, only the beginning is read.
    pub size: u64,
    /// The first line end.
    pub line_end: Option<LineEnd>,
    /// Readable records of any type.
    pub records: u64,
    /// Text of the header.
    pub header: Option<Vec<u8>>,
    /// Bytes in data records.
    pub data_bytes: u64,
    /// Addresses that are written, ascending and apart from each other; of a file that is too large, the first ones.
    pub ranges: Vec<AddressRange>,
    /// Entry point.
    pub entry: Option<u32>,
    /// What addresses count, as seen from how they advance.
    pub address_unit: Option<AddressUnit>,
    /// What the program says about itself.
    pub identity: Option<Identity>,
    /// Name of the known product the image was judged for.
    pub judged_for: Option<String>,
    /// Bytes of program flash it was judged for.
    pub flash_bytes: Option<u64>,
    /// Characters on the wire if the records are sent as they are, each with one character as its line end.
    pub characters: u64,
}

/// Kinds of image files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Motorola S-records.
    SRecord,
    /// Intel HEX.
    IntelHex,
}

impl Format {
    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Format::SRecord => "srec",
            Format::IntelHex => "ihex",
        }
    }

    /// The name in text.
    pub const fn title(self) -> &'static str {
        match self {
            Format::SRecord => "S-record",
            Format::IntelHex => "Intel HEX",
        }
    }

    /// Characters of the longest record.
    pub(super) const fn longest_record(self) -> usize {
        match self {
            Format::SRecord => 514,
            Format::IntelHex => 521,
        }
    }

    /// What ends a file.
    pub(super) const fn terminator(self) -> &'static str {
        match self {
            Format::SRecord => "a terminator (S7)",
            Format::IntelHex => "an end record (01)",
        }
    }

    /// Column of a data record's address.
    pub(super) const fn address_column(self) -> usize {
        match self {
            Format::SRecord => srecord_file::ADDRESS_COLUMN,
            Format::IntelHex => ihex::OFFSET_COLUMN,
        }
    }

    /// Column of a record's length.
    pub(super) const fn length_column(self) -> usize {
        match self {
            Format::SRecord => srecord_file::LENGTH_COLUMN,
            Format::IntelHex => ihex::LENGTH_COLUMN,
        }
    }
}

/// Addresses from `start` up to but not including `end`, in the image's unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AddressRange {
    /// First address.
    pub start: u64,
    /// The address after the last.
    pub end: u64,
}

/// An image without errors, but for those that were allowed by name. Only a [`Report`] makes one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckedImage {
    image: Image,
    identity: Option<Identity>,
    overridden: Vec<DefectId>,
}

impl CheckedImage {
    /// The records.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// What the image says it is, if it says anything.
    pub fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// The errors it has that were allowed by name.
    pub fn overridden(&self) -> &[DefectId] {
        &self.overridden
    }
}
