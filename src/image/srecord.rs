//! One line of S-record text, in both directions.
//!
//! `S`, a type digit, a length byte (what follows it, in bytes), an address of two to four bytes, data, and a checksum:
//! all bytes from the length on, the checksum included, add up to FFh modulo 256. Whole-file rules are
//! [`super::check()`]'s. The decoder works on bytes, and puts those of a record into a buffer of the caller, because a
//! file of any size passes through it and may hold anything at all.

use std::fmt;

use super::digits::{self, INVALID, LOWER, digit};
use crate::count::counted;

/// What a record is for, and how wide its address is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `S0`: a text about the file. Its address is two bytes wide here; CodeWarrior writes four.
    Header,
    /// `S1`: data at a two-byte address.
    Data16,
    /// `S2`: data at a three-byte address.
    Data24,
    /// `S3`: data at a four-byte address.
    Data32,
    /// `S5`: number of data records before it, in two bytes.
    Count16,
    /// `S6`: number of data records before it, in three bytes.
    Count24,
    /// `S7`: end of the file, four-byte entry point.
    Start32,
    /// `S8`: end of the file, three-byte entry point.
    Start24,
    /// `S9`: end of the file, two-byte entry point.
    Start16,
}

impl Kind {
    /// All kinds there are; `S4` is reserved.
    pub const ALL: [Kind; 9] = [
        Kind::Header,
        Kind::Data16,
        Kind::Data24,
        Kind::Data32,
        Kind::Count16,
        Kind::Count24,
        Kind::Start32,
        Kind::Start24,
        Kind::Start16,
    ];

    /// The kind with this digit.
    pub const fn from_digit(digit: u8) -> Option<Kind> {
        Some(match digit {
            b'0' => Kind::Header,
            b'1' => Kind::Data16,
            b'2' => Kind::Data24,
            b'3' => Kind::Data32,
            b'5' => Kind::Count16,
            b'6' => Kind::Count24,
            b'7' => Kind::Start32,
            b'8' => Kind::Start24,
            b'9' => Kind::Start16,
            _ => return None,
        })
    }

    /// The digit after the `S`.
    pub const fn digit(self) -> u8 {
        match self {
            Kind::Header => b'0',
            Kind::Data16 => b'1',
            Kind::Data24 => b'2',
            Kind::Data32 => b'3',
            Kind::Count16 => b'5',
            Kind::Count24 => b'6',
            Kind::Start32 => b'7',
            Kind::Start24 => b'8',
            Kind::Start16 => b'9',
        }
    }

    /// Bytes of the address (of the number, in a count).
    pub const fn address_bytes(self) -> usize {
        match self {
            Kind::Header | Kind::Data16 | Kind::Count16 | Kind::Start16 => 2,
            Kind::Data24 | Kind::Count24 | Kind::Start24 => 3,
            Kind::Data32 | Kind::Start32 => 4,
        }
    }

    /// Whether bytes may follow the address.
    pub const fn takes_data(self) -> bool {
        matches!(self, Kind::Header | Kind::Data16 | Kind::Data24 | Kind::Data32)
    }

    /// The most data bytes one record can hold.
    pub const fn most_data(self) -> usize {
        if self.takes_data() { 255 - 1 - self.address_bytes() } else { 0 }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "S{}", char::from(self.digit()))
    }
}

/// A record, its data borrowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a> {
    /// What it is for.
    pub kind: Kind,
    /// Address, entry point, or number of records.
    pub address: u32,
    /// Data bytes.
    pub data: &'a [u8],
}

/// A line that could be read as a record, and what is odd about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// What it says.
    pub record: Record<'a>,
    /// The checksum, if it is not the record's.
    pub wrong_checksum: Option<WrongChecksum>,
    /// Whether a letter in it is lower case.
    pub lower_case: bool,
    /// Characters the record takes; whatever follows on the line is not part of it.
    pub characters: usize,
}

/// A checksum that does not belong to its record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongChecksum {
    /// What the line says.
    pub stored: u8,
    /// What its bytes give.
    pub computed: u8,
}

/// Why a line is not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineError {
    /// It does not begin with `S`.
    #[error("a record begins with S, this line with {}", Shown(*.0))]
    NotARecord(u8),
    /// There is no such type.
    #[error("there is no record type S{}", Bare(*.0))]
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
    #[error("the length says {}, the line ends after {holds}", counted(*says, "byte"))]
    Short {
        /// Bytes that should follow the length.
        says: usize,
        /// Whole bytes that do.
        holds: usize,
    },
    /// The length is impossible for the type.
    #[error("an {kind} record of length {says} cannot be: {} {needs}", if kind.takes_data() { "it needs at least" } else { "it has" })]
    Length {
        /// The type.
        kind: Kind,
        /// Bytes the length announces.
        says: usize,
        /// Bytes for address and checksum.
        needs: usize,
    },
}

impl LineError {
    /// Where in the line, from 1.
    pub const fn column(&self) -> usize {
        match self {
            LineError::NotARecord(_) => 1,
            LineError::UnknownType(_) => 2,
            LineError::Character { column, .. } => *column,
            LineError::Short { .. } | LineError::Length { .. } => 3,
        }
    }
}

/// Room for the bytes of one record, from the address to the checksum.
pub type Room = [u8; 255];

/// Reads one line, without its line end. Whatever follows the record is left to the caller.
///
/// # Errors
/// If the line is not a record. A wrong checksum is not an error here: the record can still be shown.
pub fn parse<'a>(line: &[u8], room: &'a mut Room) -> Result<Line<'a>, LineError> {
    let (&first, rest) = line.split_first().ok_or(LineError::NotARecord(b' '))?;
    if !first.eq_ignore_ascii_case(&b'S') {
        return Err(LineError::NotARecord(first));
    }
    let (&type_digit, rest) = rest.split_first().ok_or(LineError::Short { says: 1, holds: 0 })?;
    let kind = Kind::from_digit(type_digit).ok_or(LineError::UnknownType(type_digit))?;
    let (&[high, low], body) = rest.split_first_chunk::<2>().ok_or(LineError::Short { says: 1, holds: 0 })?;
    let mut marks = digit(high) | digit(low);
    let length = digits::byte(digit(high), digit(low));
    let says = usize::from(length);
    let mut sum = length;
    let mut holds = 0;
    for (slot, pair) in room.iter_mut().zip(body.chunks_exact(2)).take(says) {
        let (high, low) = (digit(pair[0]), digit(pair[1]));
        marks |= high | low;
        *slot = digits::byte(high, low);
        sum = sum.wrapping_add(*slot);
        holds += 1;
    }
    if marks & INVALID != 0 {
        return Err(first_bad_character(line, says));
    }
    let needs = kind.address_bytes() + 1;
    if says < needs || (says > needs && !kind.takes_data()) {
        return Err(LineError::Length { kind, says, needs });
    }
    if holds < says {
        return Err(LineError::Short { says, holds });
    }
    let (address, data) = room[..says - 1].split_at(kind.address_bytes());
    let stored = room[says - 1];
    let computed = !sum.wrapping_sub(stored);
    Ok(Line {
        record: Record {
            kind,
            address: address.iter().fold(0, |address, &byte| (address << 8) | u32::from(byte)),
            data,
        },
        wrong_checksum: (stored != computed).then_some(WrongChecksum { stored, computed }),
        lower_case: marks & LOWER != 0 || first == b's',
        characters: 4 + says * 2,
    })
}

impl Record<'_> {
    /// Appends the record as text, upper case and without a line end.
    ///
    /// # Panics
    /// If the address or the data does not fit the record's type.
    pub fn write(&self, text: &mut Vec<u8>) {
        let width = self.kind.address_bytes();
        assert!(self.data.len() <= self.kind.most_data(), "{} takes {} data bytes", self.kind, self.kind.most_data());
        assert!(width == 4 || self.address >> (width * 8) == 0, "{:#x} is too wide for {}", self.address, self.kind);
        let length = (width + self.data.len() + 1) as u8;
        text.extend([b'S', self.kind.digit()]);
        let mut sum = 0u8;
        let mut put = |byte: u8| {
            sum = sum.wrapping_add(byte);
            digits::put(text, byte);
        };
        put(length);
        self.address.to_be_bytes()[4 - width..].iter().for_each(|&byte| put(byte));
        self.data.iter().for_each(|&byte| put(byte));
        let checksum = !sum;
        digits::put(text, checksum);
    }

    /// The record as text, upper case and without a line end.
    ///
    /// # Panics
    /// If the address or the data does not fit the record's type.
    pub fn to_text(&self) -> Vec<u8> {
        let mut text = Vec::with_capacity(self.characters());
        self.write(&mut text);
        text
    }

    /// Characters of that text.
    pub const fn characters(&self) -> usize {
        4 + (self.kind.address_bytes() + self.data.len() + 1) * 2
    }
}

/// The header as CodeWarrior writes it and as loaders want it: a four-byte address 0, then the text.
///
/// # Panics
/// If the text is longer than [`LONGEST_HEADER`].
pub fn write_header(header: &[u8], text: &mut Vec<u8>) {
    let mut data = vec![0, 0];
    data.extend_from_slice(header);
    Record { kind: Kind::Header, address: 0, data: &data }.write(text);
}

/// The longest text of a header with a four-byte address.
pub const LONGEST_HEADER: usize = Kind::Header.most_data() - 2;

/// Characters of such a header without text.
pub(super) const FEWEST_HEADER_CHARACTERS: usize = 14;

/// Characters of a terminator with a four-byte entry point.
pub(super) const TERMINATOR_CHARACTERS: usize = 14;

/// A character as a message shows it: never a control code.
pub(super) struct Shown(pub(super) u8);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            b' ' => f.write_str("a blank"),
            graphic if graphic.is_ascii_graphic() => write!(f, "'{}'", char::from(graphic)),
            other => write!(f, "byte 0x{other:02X}"),
        }
    }
}

struct Bare(u8);

impl fmt::Display for Bare {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_ascii_graphic() {
            write!(f, "{}", char::from(self.0))
        } else {
            write!(f, " + byte 0x{:02X}", self.0)
        }
    }
}

/// The first character that is not a digit, among those the record takes; called only when there is one.
#[cold]
fn first_bad_character(line: &[u8], says: usize) -> LineError {
    let end = line.len().min(4 + says * 2);
    match digits::first_bad(line.get(2..end).unwrap_or_default()) {
        Some((at, found)) => LineError::Character { column: at + 3, found },
        None => LineError::Short { says, holds: 0 },
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parsed(line: &[u8], check: impl FnOnce(Line<'_>)) {
        let mut room = [0; 255];
        match parse(line, &mut room) {
            Ok(line) => check(line),
            Err(error) => panic!("{}: {error}", line.escape_ascii()),
        }
    }

    fn refused(line: &[u8]) -> LineError {
        match parse(line, &mut [0; 255]) {
            Err(error) => error,
            Ok(line) => panic!("{line:?}"),
        }
    }

    #[test]
    fn lines_and_the_records_they_are() {
        let table: [(&str, Kind, u32, &[u8]); 11] = [
            ("S0110000000050524F4752414D264441544196", Kind::Header, 0, b"\0\0PROGRAM&DATA"),
            ("S0030000FC", Kind::Header, 0, b""),
            ("S1051234AABB4F", Kind::Data16, 0x1234, &[0xAA, 0xBB]),
            ("S205123456AAB4", Kind::Data24, 0x12_3456, &[0xAA]),
            ("S30600010000A553", Kind::Data32, 0x0001_0000, &[0xA5]),
            ("S305FFFFFFFFFE", Kind::Data32, 0xFFFF_FFFF, b""),
            ("S5030C00F0", Kind::Count16, 0x0C00, b""),
            ("S604010000FA", Kind::Count24, 0x01_0000, b""),
            ("S705000000A05A", Kind::Start32, 0xA0, b""),
            ("S804000000FB", Kind::Start24, 0, b""),
            ("S9030000FC", Kind::Start16, 0, b""),
        ];
        for (text, kind, address, data) in table {
            parsed(text.as_bytes(), |line| {
                assert_eq!(line.record, Record { kind, address, data }, "{text}");
                assert_eq!(line.wrong_checksum, None, "{text}");
                assert_eq!(line.characters, text.len(), "{text}");
                assert!(!line.lower_case, "{text}");
                assert_eq!(line.record.to_text(), text.as_bytes());
            });
        }
    }

    #[test]
    fn lower_case_is_read_and_noticed() {
        for text in ["s30600010000A553", "S30600010000a553"] {
            parsed(text.as_bytes(), |line| {
                assert!(line.lower_case && line.wrong_checksum.is_none(), "{text}");
                assert_eq!(line.record.data, [0xA5]);
            });
        }
    }

    #[test]
    fn a_wrong_checksum_still_shows_the_record_and_the_rest_of_the_line_is_left() {
        parsed(b"S30600010000A552S9", |line| {
            assert_eq!(line.wrong_checksum, Some(WrongChecksum { stored: 0x52, computed: 0x53 }));
            assert_eq!((line.record.address, line.characters), (0x1_0000, 16));
        });
    }

    #[test]
    fn lines_that_are_no_records_say_where_and_why() {
        let table: [(&[u8], LineError); 16] = [
            (b"", LineError::NotARecord(b' ')),
            (b"T305", LineError::NotARecord(b'T')),
            (b"\xEF\xBB\xBFS0", LineError::NotARecord(0xEF)),
            (b"S", LineError::Short { says: 1, holds: 0 }),
            (b"S3", LineError::Short { says: 1, holds: 0 }),
            (b"S32", LineError::Short { says: 1, holds: 0 }),
            (b"S4030000FC", LineError::UnknownType(b'4')),
            (b"S\xFF", LineError::UnknownType(0xFF)),
            (b"S9+30000FC", LineError::Character { column: 3, found: b'+' }),
            (b"S3GG", LineError::Character { column: 3, found: b'G' }),
            (b"S30600010G00A553", LineError::Character { column: 10, found: b'G' }),
            (b"S3060001\x000000A553", LineError::Character { column: 9, found: 0 }),
            (b"S30600010000A5", LineError::Short { says: 6, holds: 5 }),
            (b"S30600010000A55", LineError::Short { says: 6, holds: 5 }),
            (b"S001FE", LineError::Length { kind: Kind::Header, says: 1, needs: 3 }),
            (b"S70600000000AA4F", LineError::Length { kind: Kind::Start32, says: 6, needs: 5 }),
        ];
        for (line, error) in table {
            assert_eq!(refused(line), error, "{}", line.escape_ascii());
        }
    }

    fn any_record() -> impl Strategy<Value = (Kind, u32, Vec<u8>)> {
        (prop::sample::select(&Kind::ALL[..]), any::<u32>(), prop::collection::vec(any::<u8>(), 0..=252)).prop_map(
            |(kind, address, mut data)| {
                data.truncate(kind.most_data());
                (kind, address >> (32 - kind.address_bytes() * 8), data)
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_written_is_read((kind, address, data) in any_record(), lower in any::<bool>()) {
            let record = Record { kind, address, data: &data };
            let mut text = record.to_text();
            prop_assert_eq!(text.len(), record.characters());
            if lower {
                text.make_ascii_lowercase();
            }
            let mut room = [0; 255];
            let line = parse(&text, &mut room);
            prop_assert_eq!(line.map(|line| (line.record, line.wrong_checksum)), Ok((record, None)));
        }

        #[test]
        fn any_single_wrong_digit_is_noticed((kind, address, data) in any_record(), at in any::<prop::sample::Index>(), digit in 0usize..16) {
            let mut text = Record { kind, address, data: &data }.to_text();
            let at = 4 + at.index(text.len() - 4);
            prop_assume!(text[at] != b"0123456789ABCDEF"[digit]);
            text[at] = b"0123456789ABCDEF"[digit];
            prop_assert!(parse(&text, &mut [0; 255]).is_ok_and(|line| line.wrong_checksum.is_some()));
        }

        #[test]
        fn nothing_panics(mut line in prop::collection::vec(any::<u8>(), 0..600), record_like in any::<bool>()) {
            if record_like {
                line.splice(..0, *b"S3");
            }
            let _ = parse(&line, &mut [0; 255]);
        }

        #[test]
        fn the_srec_crate_agrees_about_valid_records((kind, address, data) in any_record()) {
            let text = Record { kind, address, data: &data }.to_text();
            let text = String::from_utf8_lossy(&text).into_owned();
            // The crate panics on a header that is not UTF-8.
            prop_assume!(kind != Kind::Header);
            let theirs = text.parse::<srec::Record>();
            let narrow = address as u16;
            let ours = match kind {
                Kind::Header => return Ok(()),
                Kind::Data16 => srec::Record::S1(srec::Data { address: srec::Address16(narrow), data }),
                Kind::Data24 => srec::Record::S2(srec::Data { address: srec::Address24(address), data }),
                Kind::Data32 => srec::Record::S3(srec::Data { address: srec::Address32(address), data }),
                Kind::Count16 => srec::Record::S5(srec::Count16(narrow)),
                Kind::Count24 => srec::Record::S6(srec::Count24(address)),
                Kind::Start32 => srec::Record::S7(srec::Address32(address)),
                Kind::Start24 => srec::Record::S8(srec::Address24(address)),
                Kind::Start16 => srec::Record::S9(srec::Address16(narrow)),
            };
            prop_assert_eq!(theirs, Ok(ours));
        }
    }
}
