//! One line of Intel HEX text, read and written.
//!
//! `:`, a length byte (of the data alone), a two-byte offset, a type, data, and a checksum: all bytes add up to 0
//! modulo 256. Six types: data, the end, two ways to say where the 64 K of the offsets lie, and two to name the entry
//! point. Whole-file rules are `ihex_file`'s. Lines are read here, since a file may hold anything and a defect
//! needs its column; they are written by the crate `ihex`.

use std::fmt;

use super::digits::{self, INVALID, digit};
use super::srecord::Shown;

/// What a record is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `00`: data at an offset.
    Data,
    /// `01`: end of the file.
    EndOfFile,
    /// `02`: what is added to offsets, in units of 16.
    SegmentBase,
    /// `03`: entry point as segment and offset.
    SegmentStart,
    /// `04`: the upper two bytes of addresses.
    LinearBase,
    /// `05`: entry point as a four-byte address.
    LinearStart,
}

impl Kind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Kind; 6] =
        [Kind::Data, Kind::EndOfFile, Kind::SegmentBase, Kind::SegmentStart, Kind::LinearBase, Kind::LinearStart];

    /// The kind with this number.
    pub fn from_number(number: u8) -> Option<Kind> {
        Kind::ALL.get(usize::from(number)).copied()
    }

    /// Data bytes a record of this kind has; those of data vary.
    pub const fn data_bytes(self) -> Option<usize> {
        match self {
            Kind::Data => None,
            Kind::EndOfFile => Some(0),
            Kind::SegmentBase | Kind::LinearBase => Some(2),
            Kind::SegmentStart | Kind::LinearStart => Some(4),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Data => "a data record (00)",
            Kind::EndOfFile => "an end record (01)",
            Kind::SegmentBase => "a segment record (02)",
            Kind::SegmentStart => "a start record (03)",
            Kind::LinearBase => "an upper address record (04)",
            Kind::LinearStart => "a start record (05)",
        })
    }
}

/// A record, its data borrowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a> {
    /// What it is for.
    pub kind: Kind,
    /// The lower two bytes of a data record's address; 0 in the others.
    pub offset: u16,
    /// Data bytes.
    pub data: &'a [u8],
}

impl Record<'_> {
    /// The data as a number, high byte first: what records other than data hold.
    pub fn number(&self) -> u32 {
        self.data.iter().take(4).fold(0, |number, &byte| (number << 8) | u32::from(byte))
    }
}

/// A line that could be read as a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// What it says.
    pub record: Record<'a>,
    /// The checksums stored and computed, if they differ.
    pub wrong_checksum: Option<(u8, u8)>,
    /// Characters the record takes; whatever follows on the line is not part of it.
    pub characters: usize,
}

/// Why a line is not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineError {
    /// It does not begin with a colon.
    #[error("a record begins with ':', this line with {}", Shown(*.0))]
    NotARecord(u8),
    /// There is no such type.
    #[error("there is no record type {0:02X}")]
    UnknownType(u8),
    /// A character that is not a hexadecimal digit.
    #[error("{} is not a hexadecimal digit", Shown(*found))]
    Character {
        /// Position in the line, from 1.
        column: usize,
        /// What is there.
        found: u8,
    },
    /// The line ends before the record does.
    #[error("a record of {needs} bytes is announced, the line ends after {holds}")]
    Short {
        /// Bytes of the record, its length byte included.
        needs: usize,
        /// Whole bytes there are.
        holds: usize,
    },
    /// The length is impossible for the type.
    #[error("{kind} of length {says} cannot be")]
    Length {
        /// The type.
        kind: Kind,
        /// Bytes the length announces.
        says: usize,
    },
}

impl LineError {
    /// Where in the line, from 1.
    pub const fn column(&self) -> usize {
        match self {
            LineError::NotARecord(_) => 1,
            LineError::UnknownType(_) => TYPE_COLUMN,
            LineError::Character { column, .. } => *column,
            LineError::Short { .. } | LineError::Length { .. } => 2,
        }
    }
}

/// Room for the bytes of one record, the length included.
pub type Room = [u8; 260];

/// Reads one line, without its line end. Whatever follows the record is left to the caller.
///
/// # Errors
/// If the line is not a record. A wrong checksum is not an error here: the record can still be shown.
pub fn parse<'a>(line: &[u8], room: &'a mut Room) -> Result<Line<'a>, LineError> {
    let (&first, body) = line.split_first().ok_or(LineError::NotARecord(b' '))?;
    if first != b':' {
        return Err(LineError::NotARecord(first));
    }
    let says = match body {
        [high, low, ..] if (digit(*high) | digit(*low)) & INVALID == 0 => digits::byte(digit(*high), digit(*low)),
        _ => return Err(bad_character(body, 0).unwrap_or(LineError::Short { needs: FEWEST_BYTES, holds: 0 })),
    };
    let needs = usize::from(says) + FEWEST_BYTES;
    let (mut marks, mut sum, mut holds) = (0, 0u8, 0);
    for (slot, pair) in room.iter_mut().zip(body.chunks_exact(2)).take(needs) {
        let (high, low) = (digit(pair[0]), digit(pair[1]));
        marks |= high | low;
        *slot = digits::byte(high, low);
        sum = sum.wrapping_add(*slot);
        holds += 1;
    }
    if marks & INVALID != 0 {
        return Err(bad_character(body, needs).unwrap_or(LineError::Short { needs, holds }));
    }
    if holds <= TYPE_BYTE {
        return Err(LineError::Short { needs, holds });
    }
    let says = usize::from(says);
    let kind = Kind::from_number(room[TYPE_BYTE]).ok_or(LineError::UnknownType(room[TYPE_BYTE]))?;
    if kind.data_bytes().is_some_and(|bytes| bytes != says) {
        return Err(LineError::Length { kind, says });
    }
    if holds < needs {
        return Err(LineError::Short { needs, holds });
    }
    let stored = room[needs - 1];
    let computed = stored.wrapping_sub(sum);
    Ok(Line {
        record: Record { kind, offset: u16::from_be_bytes([room[1], room[2]]), data: &room[TYPE_BYTE + 1..needs - 1] },
        wrong_checksum: (stored != computed).then_some((stored, computed)),
        characters: 1 + needs * 2,
    })
}

/// The first character that is not a digit, among those of the first `bytes`; the length's are always looked at.
#[cold]
fn bad_character(body: &[u8], bytes: usize) -> Option<LineError> {
    let end = body.len().min(bytes.max(1) * 2);
    let (at, found) = digits::first_bad(body.get(..end)?)?;
    Some(LineError::Character { column: at + 2, found })
}

/// Bytes of a record without data: length, offset, type, checksum.
const FEWEST_BYTES: usize = 5;
/// Which byte is the type.
const TYPE_BYTE: usize = 3;
/// Column of the type's first digit.
const TYPE_COLUMN: usize = 8;
/// Column of the offset's first digit.
pub(super) const OFFSET_COLUMN: usize = 4;
/// Column of the length's first digit.
pub(super) const LENGTH_COLUMN: usize = 2;
/// Column of the data's first digit.
pub(super) const DATA_COLUMN: usize = 10;

#[cfg(test)]
mod tests {
    use ::ihex::Record as Theirs;
    use proptest::prelude::*;

    use super::*;

    fn refused(line: &[u8]) -> LineError {
        match parse(line, &mut [0; 260]) {
            Err(error) => error,
            Ok(line) => panic!("{line:?}"),
        }
    }

    #[test]
    fn lines_and_the_records_they_are() {
        let table: [(&str, Kind, u16, &[u8]); 7] = [
            (":0401000001020304F1", Kind::Data, 0x0100, &[1, 2, 3, 4]),
            (":00012300DC", Kind::Data, 0x0123, &[]),
            (":00000001FF", Kind::EndOfFile, 0, &[]),
            (":020000021200EA", Kind::SegmentBase, 0, &[0x12, 0x00]),
            (":0400000300003800C1", Kind::SegmentStart, 0, &[0, 0, 0x38, 0]),
            (":02000004FFFFFC", Kind::LinearBase, 0, &[0xFF, 0xFF]),
            (":04000005000000CD2A", Kind::LinearStart, 0, &[0, 0, 0, 0xCD]),
        ];
        for (text, kind, offset, data) in table {
            let mut room = [0; 260];
            let line = parse(text.as_bytes(), &mut room).unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!(line.record, Record { kind, offset, data }, "{text}");
            assert_eq!((line.wrong_checksum, line.characters), (None, text.len()), "{text}");
            let lower = text.to_lowercase();
            assert!(parse(lower.as_bytes(), &mut [0; 260]).is_ok_and(|line| line.record.data == data), "{lower}");
        }
    }

    #[test]
    fn lines_that_are_no_records_say_where_and_why() {
        let table: [(&[u8], LineError); 15] = [
            (b"", LineError::NotARecord(b' ')),
            (b"S00", LineError::NotARecord(b'S')),
            (b":", LineError::Short { needs: 5, holds: 0 }),
            (b":0", LineError::Short { needs: 5, holds: 0 }),
            (b":0G", LineError::Character { column: 3, found: b'G' }),
            (b":G", LineError::Character { column: 2, found: b'G' }),
            (b":00", LineError::Short { needs: 5, holds: 1 }),
            (b":00000001F", LineError::Short { needs: 5, holds: 4 }),
            (b":000000010G", LineError::Character { column: 11, found: b'G' }),
            (b":01000000GGFF", LineError::Character { column: 10, found: b'G' }),
            (b":00000006FA", LineError::UnknownType(6)),
            (b":000000FF01", LineError::UnknownType(0xFF)),
            (b":0100000100FE", LineError::Length { kind: Kind::EndOfFile, says: 1 }),
            (b":0100000400FB", LineError::Length { kind: Kind::LinearBase, says: 1 }),
            (b":04010000010203F5", LineError::Short { needs: 9, holds: 8 }),
        ];
        for (line, error) in table {
            assert_eq!(refused(line), error, "{}", line.escape_ascii());
            assert!(error.column() >= 1 && !error.to_string().is_empty());
        }
    }

    #[test]
    fn a_wrong_checksum_still_shows_the_record_and_the_rest_of_the_line_is_left() {
        let mut room = [0; 260];
        let line = parse(b":0401000001020304F2:00", &mut room).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((line.wrong_checksum, line.characters), (Some((0xF2, 0xF1)), 19));
    }

    proptest! {
        #[test]
        fn what_the_ihex_crate_writes_is_read(offset in any::<u16>(), value in prop::collection::vec(any::<u8>(), 0..=255)) {
            let text = Theirs::Data { offset, value: value.clone() }.to_record_string();
            let text = text.map_err(|error| TestCaseError::fail(error.to_string()))?;
            let mut room = [0; 260];
            let line = parse(text.as_bytes(), &mut room).map_err(|error| TestCaseError::fail(error.to_string()))?;
            prop_assert_eq!(line.record, Record { kind: Kind::Data, offset, data: &value });
            prop_assert_eq!((line.wrong_checksum, line.characters), (None, text.len()));
        }

        #[test]
        fn a_line_that_is_read_without_complaint_is_the_same_to_the_ihex_crate(line in "(:|)([0-9A-F]{2}){0,20}") {
            let mut room = [0; 260];
            if let Ok(ours) = parse(line.as_bytes(), &mut room) && ours.wrong_checksum.is_none() && ours.characters == line.len() {
                prop_assert!(Theirs::from_record_string(&line).is_ok(), "{}", line);
            }
        }

        #[test]
        fn junk_never_panics(junk in prop::collection::vec(any::<u8>(), 0..40)) {
            let mut line = b":".to_vec();
            line.extend(junk);
            let _ = parse(&line, &mut [0; 260]);
        }
    }
}
