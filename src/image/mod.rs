//! Program images: S-record files, what they hold, and whether they may be sent.

mod check;
pub mod identity;
pub mod srecord;

use serde::Deserialize;

pub use check::CheckedImage;
pub use identity::{Identity, IdentityError};

/// What an address of an image counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AddressUnit {
    /// 16-bit words, low byte first: 32 data bytes advance the address by 16.
    Word,
    /// Bytes.
    Byte,
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
    /// The bytes, at least one.
    pub data: Vec<u8>,
}
