//! Why a node refuses an access to its object dictionary: the SDO abort codes (CiA 301, section 7.2.4.3.17).

use std::fmt;

/// A refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Abort {
    /// The object cannot be accessed in the way asked for.
    UnsupportedAccess,
    /// The entry can only be read.
    ReadOnly,
    /// There is no object with this index.
    NoSuchObject,
    /// The object cannot be mapped into a PDO.
    NotMappable,
    /// The mapped objects are longer than a PDO.
    MappingTooLong,
    /// The parameters do not go together.
    Incompatible,
    /// The data is longer than the entry's type.
    TooLong,
    /// The data is shorter than the entry's type.
    TooShort,
    /// The object has no entry with this sub-index.
    NoSuchEntry,
    /// The value is not one the entry takes.
    ValueRange,
    /// The value is above the entry's high limit.
    TooHigh,
    /// The value is below the entry's low limit.
    TooLow,
    /// The data cannot be transferred or stored: a signature is wrong.
    CannotStore,
}

impl Abort {
    /// The 32-bit code on the bus.
    pub const fn code(self) -> u32 {
        match self {
            Abort::UnsupportedAccess => 0x0601_0000,
            Abort::ReadOnly => 0x0601_0002,
            Abort::NoSuchObject => 0x0602_0000,
            Abort::NotMappable => 0x0604_0041,
            Abort::MappingTooLong => 0x0604_0042,
            Abort::Incompatible => 0x0604_0043,
            Abort::TooLong => 0x0607_0012,
            Abort::TooShort => 0x0607_0013,
            Abort::NoSuchEntry => 0x0609_0011,
            Abort::ValueRange => 0x0609_0030,
            Abort::TooHigh => 0x0609_0031,
            Abort::TooLow => 0x0609_0032,
            Abort::CannotStore => 0x0800_0020,
        }
    }

    /// What it means, in words.
    pub const fn reason(self) -> &'static str {
        match self {
            Abort::UnsupportedAccess => "this access is not supported",
            Abort::ReadOnly => "the entry can only be read",
            Abort::NoSuchObject => "there is no object with this index",
            Abort::NotMappable => "the object cannot be mapped into a PDO",
            Abort::MappingTooLong => "the mapped objects are longer than a PDO",
            Abort::Incompatible => "the parameters do not go together",
            Abort::TooLong => "the data is longer than the entry's type",
            Abort::TooShort => "the data is shorter than the entry's type",
            Abort::NoSuchEntry => "the object has no entry with this sub-index",
            Abort::ValueRange => "the value is not one the entry takes",
            Abort::TooHigh => "the value is above the high limit",
            Abort::TooLow => "the value is below the low limit",
            Abort::CannotStore => "the signature is wrong, nothing was done",
        }
    }
}

impl fmt::Display for Abort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (abort {:08X}h)", self.reason(), self.code())
    }
}
