//! What can be wrong with an image: stable names, how bad it is, and where it was found.
//!
//! `docs/images.md` lists the same names with what to do about them; a test compares the two.

use std::fmt;
use std::str::FromStr;

/// Whether an image with this defect may be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Severity {
    /// It may not, unless the defect is allowed by name.
    Error,
    /// It may; what is sent is sound, but the file is not as expected.
    Warning,
}

impl Severity {
    /// The name in text and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// Every defect there is. Names never change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DefectId {
    /// The file holds nothing.
    EmptyFile,
    /// The file is something else altogether.
    NotSRecord,
    /// More data than any unit's flash holds.
    TooLarge,
    /// A UTF-8 byte order mark at the start.
    ByteOrderMark,
    /// A line longer than any record.
    LongLine,
    /// A line that does not begin with `S`.
    NotARecord,
    /// A record type that does not exist.
    UnknownType,
    /// A character that is not a hexadecimal digit.
    BadCharacter,
    /// The line ends before the record does.
    ShortRecord,
    /// A length that is impossible for the type.
    BadLength,
    /// The checksum is not the record's.
    BadChecksum,
    /// The line goes on after the checksum.
    TrailingCharacters,
    /// The line ends with blanks.
    TrailingBlanks,
    /// A record type that loaders refuse.
    RefusedType,
    /// A data record without data.
    EmptyRecord,
    /// A line without any character.
    BlankLine,
    /// Lower-case letters.
    LowerCase,
    /// More than one kind of line end.
    MixedLineEnds,
    /// The last line has no line end.
    NoLineEnd,
    /// No S0 at all.
    MissingHeader,
    /// Data before S0.
    DataBeforeHeader,
    /// A second S0.
    DuplicateHeader,
    /// S0 without a four-byte address.
    HeaderForm,
    /// No S7: the file is cut off.
    MissingTerminator,
    /// Lines after S7.
    AfterTerminator,
    /// A record count, which is not sent.
    CountRecord,
    /// A record count that is wrong.
    WrongCount,
    /// No data at all.
    NoData,
    /// An odd number of bytes where addresses count words.
    OddLength,
    /// Addresses that run past 2^32.
    AddressWrap,
    /// Addresses that go backwards.
    Descending,
    /// Two records for one address.
    Overlap,
    /// Addresses count bytes where the unit counts words, or the other way round.
    AddressUnit,
    /// Addresses outside the program flash.
    OutOfRange,
    /// Addresses in the boot flash, where the loader lives.
    BootFlash,
    /// Addresses flagged as data memory.
    DataMemory,
    /// Words inside the program that no record writes.
    Gap,
    /// The entry point is not in the program.
    EntryOutside,
    /// Data that runs past the last offset of its base (Intel HEX).
    SegmentWrap,
    /// An offset in a record that has no use for one (Intel HEX).
    OffsetIgnored,
    /// No entry point is given (Intel HEX).
    MissingEntry,
    /// A second entry point (Intel HEX).
    DuplicateEntry,
    /// Nothing says which product and version this is.
    NoIdentity,
    /// The identity block makes no sense.
    IdentityMalformed,
    /// The program is not the one the identity block was made for.
    IdentityCrc,
    /// The identity block names a product that is not known.
    UnknownProduct,
    /// The image is for another product.
    WrongProduct,
    /// The unit runs newer software.
    Downgrade,
    /// The file's name says something else than its content.
    FileName,
}

impl DefectId {
    /// All defects, in the order of the documentation.
    pub const ALL: [DefectId; 49] = [
        DefectId::EmptyFile,
        DefectId::NotSRecord,
        DefectId::TooLarge,
        DefectId::ByteOrderMark,
        DefectId::LongLine,
        DefectId::NotARecord,
        DefectId::UnknownType,
        DefectId::BadCharacter,
        DefectId::ShortRecord,
        DefectId::BadLength,
        DefectId::BadChecksum,
        DefectId::TrailingCharacters,
        DefectId::TrailingBlanks,
        DefectId::RefusedType,
        DefectId::EmptyRecord,
        DefectId::BlankLine,
        DefectId::LowerCase,
        DefectId::MixedLineEnds,
        DefectId::NoLineEnd,
        DefectId::MissingHeader,
        DefectId::DataBeforeHeader,
        DefectId::DuplicateHeader,
        DefectId::HeaderForm,
        DefectId::MissingTerminator,
        DefectId::AfterTerminator,
        DefectId::CountRecord,
        DefectId::WrongCount,
        DefectId::NoData,
        DefectId::OddLength,
        DefectId::AddressWrap,
        DefectId::Descending,
        DefectId::Overlap,
        DefectId::AddressUnit,
        DefectId::OutOfRange,
        DefectId::BootFlash,
        DefectId::DataMemory,
        DefectId::Gap,
        DefectId::EntryOutside,
        DefectId::SegmentWrap,
        DefectId::OffsetIgnored,
        DefectId::MissingEntry,
        DefectId::DuplicateEntry,
        DefectId::NoIdentity,
        DefectId::IdentityMalformed,
        DefectId::IdentityCrc,
        DefectId::UnknownProduct,
        DefectId::WrongProduct,
        DefectId::Downgrade,
        DefectId::FileName,
    ];

    /// The stable name.
    pub const fn name(self) -> &'static str {
        match self {
            DefectId::EmptyFile => "empty-file",
            DefectId::NotSRecord => "not-s-record",
            DefectId::TooLarge => "too-large",
            DefectId::ByteOrderMark => "byte-order-mark",
            DefectId::LongLine => "long-line",
            DefectId::NotARecord => "not-a-record",
            DefectId::UnknownType => "unknown-type",
            DefectId::BadCharacter => "bad-character",
            DefectId::ShortRecord => "short-record",
            DefectId::BadLength => "bad-length",
            DefectId::BadChecksum => "bad-checksum",
            DefectId::TrailingCharacters => "trailing-characters",
            DefectId::TrailingBlanks => "trailing-blanks",
            DefectId::RefusedType => "refused-type",
            DefectId::EmptyRecord => "empty-record",
            DefectId::BlankLine => "blank-line",
            DefectId::LowerCase => "lower-case",
            DefectId::MixedLineEnds => "mixed-line-ends",
            DefectId::NoLineEnd => "no-line-end",
            DefectId::MissingHeader => "missing-header",
            DefectId::DataBeforeHeader => "data-before-header",
            DefectId::DuplicateHeader => "duplicate-header",
            DefectId::HeaderForm => "header-form",
            DefectId::MissingTerminator => "missing-terminator",
            DefectId::AfterTerminator => "after-terminator",
            DefectId::CountRecord => "count-record",
            DefectId::WrongCount => "wrong-count",
            DefectId::NoData => "no-data",
            DefectId::OddLength => "odd-length",
            DefectId::AddressWrap => "address-wrap",
            DefectId::Descending => "descending",
            DefectId::Overlap => "overlap",
            DefectId::AddressUnit => "address-unit",
            DefectId::OutOfRange => "out-of-range",
            DefectId::BootFlash => "boot-flash",
            DefectId::DataMemory => "data-memory",
            DefectId::Gap => "gap",
            DefectId::EntryOutside => "entry-outside",
            DefectId::SegmentWrap => "segment-wrap",
            DefectId::OffsetIgnored => "offset-ignored",
            DefectId::MissingEntry => "missing-entry",
            DefectId::DuplicateEntry => "duplicate-entry",
            DefectId::NoIdentity => "no-identity",
            DefectId::IdentityMalformed => "identity-malformed",
            DefectId::IdentityCrc => "identity-crc",
            DefectId::UnknownProduct => "unknown-product",
            DefectId::WrongProduct => "wrong-product",
            DefectId::Downgrade => "downgrade",
            DefectId::FileName => "file-name",
        }
    }

    /// How bad it is. [`DefectId::NoIdentity`] becomes an error when a product is expected.
    pub const fn severity(self) -> Severity {
        match self {
            DefectId::ByteOrderMark
            | DefectId::TrailingBlanks
            | DefectId::EmptyRecord
            | DefectId::BlankLine
            | DefectId::LowerCase
            | DefectId::MixedLineEnds
            | DefectId::NoLineEnd
            | DefectId::HeaderForm
            | DefectId::CountRecord
            | DefectId::Descending
            | DefectId::Gap
            | DefectId::OffsetIgnored
            | DefectId::MissingEntry
            | DefectId::NoIdentity
            | DefectId::FileName => Severity::Warning,
            DefectId::EmptyFile
            | DefectId::NotSRecord
            | DefectId::TooLarge
            | DefectId::LongLine
            | DefectId::NotARecord
            | DefectId::UnknownType
            | DefectId::BadCharacter
            | DefectId::ShortRecord
            | DefectId::BadLength
            | DefectId::BadChecksum
            | DefectId::TrailingCharacters
            | DefectId::RefusedType
            | DefectId::MissingHeader
            | DefectId::DataBeforeHeader
            | DefectId::DuplicateHeader
            | DefectId::MissingTerminator
            | DefectId::AfterTerminator
            | DefectId::WrongCount
            | DefectId::NoData
            | DefectId::OddLength
            | DefectId::AddressWrap
            | DefectId::Overlap
            | DefectId::AddressUnit
            | DefectId::OutOfRange
            | DefectId::BootFlash
            | DefectId::DataMemory
            | DefectId::EntryOutside
            | DefectId::SegmentWrap
            | DefectId::DuplicateEntry
            | DefectId::IdentityMalformed
            | DefectId::IdentityCrc
            | DefectId::UnknownProduct
            | DefectId::WrongProduct
            | DefectId::Downgrade => Severity::Error,
        }
    }

    /// Whether the defect can be allowed. It cannot if part of the program is not known: there is nothing to send.
    pub const fn can_be_allowed(self) -> bool {
        !matches!(
            self,
            DefectId::EmptyFile
                | DefectId::NotSRecord
                | DefectId::TooLarge
                | DefectId::LongLine
                | DefectId::NotARecord
                | DefectId::UnknownType
                | DefectId::BadCharacter
                | DefectId::ShortRecord
                | DefectId::BadLength
                | DefectId::NoData
        )
    }
}

impl fmt::Display for DefectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no defect of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no defect called '{0}'")]
pub struct UnknownDefect(String);

impl FromStr for DefectId {
    type Err = UnknownDefect;

    fn from_str(name: &str) -> Result<Self, UnknownDefect> {
        DefectId::ALL.into_iter().find(|id| id.name() == name).ok_or_else(|| UnknownDefect(name.to_owned()))
    }
}

/// One defect, found in one place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Defect {
    /// Which.
    pub id: DefectId,
    /// How bad.
    pub severity: Severity,
    /// Whether it was allowed by name.
    pub allowed: bool,
    /// Line, from 1.
    pub line: u64,
    /// Character in the line, from 1.
    pub column: u32,
    /// What was found, in plain words; never holds control codes.
    pub message: String,
}

/// Collects defects and counts those it does not keep.
#[derive(Debug, Default)]
pub(super) struct Findings {
    allow: Vec<DefectId>,
    listed: Vec<Defect>,
    errors: u64,
    warnings: u64,
    allowed: u64,
    overridden: Vec<DefectId>,
    /// Kinds of defects that have been found.
    seen: Vec<DefectId>,
}

/// The result of [`Findings`].
#[derive(Debug)]
pub(super) struct Found {
    /// In the order of the file.
    pub listed: Vec<Defect>,
    pub errors: u64,
    pub warnings: u64,
    /// How many of the errors were allowed.
    pub allowed: u64,
    /// Which, each once.
    pub overridden: Vec<DefectId>,
}

impl Findings {
    pub(super) fn new(allow: &[DefectId]) -> Self {
        let allow = allow.iter().copied().filter(|id| id.can_be_allowed()).collect();
        Findings { allow, ..Findings::default() }
    }

    /// Notes a defect with its usual severity. The message is only made when the defect is kept.
    pub(super) fn note(&mut self, id: DefectId, line: u64, column: usize, message: impl FnOnce() -> String) {
        self.note_as(id.severity(), id, line, column, message);
    }

    /// Notes a defect.
    pub(super) fn note_as(
        &mut self,
        severity: Severity,
        id: DefectId,
        line: u64,
        column: usize,
        message: impl FnOnce() -> String,
    ) {
        let allowed = severity == Severity::Error && self.allow.contains(&id);
        let count = match severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
        };
        *count += 1;
        if allowed {
            self.allowed += 1;
            if !self.overridden.contains(&id) {
                self.overridden.push(id);
            }
        }
        // Warnings must not crowd out errors, so each severity has its own limit. No kind of defect may crowd out the
        // others, so the first of each kind is always listed.
        let is_first = !self.seen.contains(&id);
        if is_first {
            self.seen.push(id);
        }
        if is_first || *count <= MOST_LISTED {
            let column = u32::try_from(column).unwrap_or(u32::MAX);
            self.listed.push(Defect { id, severity, allowed, line, column, message: message() });
        }
    }

    pub(super) fn conclude(mut self) -> Found {
        self.listed.sort_by_key(|defect| (defect.line, defect.column));
        Found {
            listed: self.listed,
            errors: self.errors,
            warnings: self.warnings,
            allowed: self.allowed,
            overridden: self.overridden,
        }
    }
}

/// Most defects of each severity that are listed, besides the first of each kind. More would not be read, and a file of
/// junk must not fill the memory.
pub(super) const MOST_LISTED: u64 = 1000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_of_one_kind_hide_no_other() {
        let mut findings = Findings::new(&[]);
        for line in 1..=2_000 {
            findings.note(DefectId::RefusedType, line, 1, String::new);
        }
        findings.note(DefectId::AddressUnit, 3, 5, String::new);
        let found = findings.conclude();
        assert_eq!(found.errors, 2_001);
        assert!(found.listed.iter().any(|defect| defect.id == DefectId::AddressUnit));
        assert_eq!(found.listed.len() as u64, MOST_LISTED + 1);
    }

    #[test]
    fn names_are_unique_and_read_back() {
        for id in DefectId::ALL {
            assert_eq!(id.name().parse(), Ok(id));
        }
        assert!("no-such".parse::<DefectId>().is_err());
    }
}
