//! S-records as the loaders with a page buffer take them: one character at a time, judged as early as they can.
//!
//! Some control characters are ignored wherever they are; the profile says which. Hex digits are taken in both cases.
//! What is wrong is one of the loader's own error numbers; the console's reader (`image`) is another one and tells more.

use super::super::super::uart::{XOFF, XON};

/// What goes wrong, by the loader's numbers (public facts about the Motorola loaders).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadError {
    /// Characters were lost because the loader did not listen.
    Receive,
    /// A character that cannot be here.
    Character,
    /// A record of a type it does not take, too short, or before S0.
    Record,
    /// The sum is wrong.
    Checksum,
    /// A second data record while one is parked.
    Overrun,
    /// Flash does not read back as written.
    Flash,
    /// Something happened that the loader holds impossible.
    Internal,
}

impl LoadError {
    /// Its number.
    pub fn number(self) -> u8 {
        match self {
            LoadError::Receive => 1,
            LoadError::Character => 2,
            LoadError::Record => 3,
            LoadError::Checksum => 4,
            LoadError::Overrun => 5,
            LoadError::Flash => 6,
            LoadError::Internal => 7,
        }
    }
}

/// A complete record with the right sum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Record {
    /// S0. What it says is of no interest to the loader, not even the length of its address.
    Header,
    /// S3.
    Data(DataRecord),
    /// S7, with its entry point. The application starts by a reset all the same.
    End(u32),
}

/// Data of an S3 record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DataRecord {
    /// Address of the first word.
    pub address: u32,
    /// Words, low byte first in the record. An odd last byte is not a word and is dropped.
    pub words: Vec<u16>,
}

/// Which control characters are as if they had not come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ignores {
    /// All of them.
    Controls,
    /// The line ends CR and LF, and the flow control XON and XOFF; any other is [`LoadError::Character`].
    LineEnds,
}

/// Takes characters and gives records.
#[derive(Debug)]
pub struct Decoder {
    ignores: Ignores,
    place: Place,
}

/// Where in a record the next character belongs.
#[derive(Debug)]
enum Place {
    Start,
    Type,
    Body {
        kind: Kind,
        /// The count and what it counts.
        bytes: Vec<u8>,
        high_digit: Option<u8>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Header,
    Data,
    End,
}

/// Bytes the count byte has to count at least: the checksum, and an address where one is read.
const SHORTEST_HEADER: u8 = 1;
const SHORTEST_WITH_ADDRESS: u8 = 5;
const ADDRESS_BYTES: usize = 4;

impl Ignores {
    fn covers(self, character: u8) -> bool {
        match self {
            Ignores::Controls => character.is_ascii_control(),
            Ignores::LineEnds => [b'\r', b'\n', XON, XOFF].contains(&character),
        }
    }
}

impl Decoder {
    /// Waits for a record.
    pub fn new(ignores: Ignores) -> Self {
        Decoder { ignores, place: Place::Start }
    }

    /// Takes one character. `header_seen` says whether an S0 has come: data and end are refused before it.
    ///
    /// # Errors
    /// What the loader has against the character. The caller starts over with a new decoder.
    pub fn take(&mut self, character: u8, header_seen: bool) -> Result<Option<Record>, LoadError> {
        if self.ignores.covers(character) {
            return Ok(None);
        }
        match &mut self.place {
            Place::Start if character == b'S' => {
                self.place = Place::Type;
                Ok(None)
            }
            Place::Start => Err(LoadError::Character),
            Place::Type => {
                let kind = match character {
                    b'0' => Kind::Header,
                    b'3' if header_seen => Kind::Data,
                    b'7' if header_seen => Kind::End,
                    _ => return Err(LoadError::Record),
                };
                self.place = Place::Body { kind, bytes: Vec::new(), high_digit: None };
                Ok(None)
            }
            Place::Body { kind, bytes, high_digit } => {
                let digit = hex_digit(character).ok_or(LoadError::Character)?;
                let Some(high) = high_digit.take() else {
                    *high_digit = Some(digit);
                    return Ok(None);
                };
                bytes.push(high << 4 | digit);
                let shortest = match kind {
                    Kind::Header => SHORTEST_HEADER,
                    Kind::Data | Kind::End => SHORTEST_WITH_ADDRESS,
                };
                if bytes[0] < shortest {
                    return Err(LoadError::Record);
                }
                if bytes.len() <= usize::from(bytes[0]) {
                    return Ok(None);
                }
                let record = complete(*kind, bytes)?;
                self.place = Place::Start;
                Ok(Some(record))
            }
        }
    }
}

/// Count, content and checksum add up to FFh in their lowest byte.
fn complete(kind: Kind, bytes: &[u8]) -> Result<Record, LoadError> {
    let sum = bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    if sum != 0xFF {
        return Err(LoadError::Checksum);
    }
    if kind == Kind::Header {
        return Ok(Record::Header);
    }
    let (address, data) = bytes[1..bytes.len() - 1].split_at(ADDRESS_BYTES);
    let address = address.iter().fold(0, |address, byte| address << 8 | u32::from(*byte));
    Ok(match kind {
        Kind::Header => Record::Header,
        Kind::End => Record::End(address),
        Kind::Data => {
            let words = data.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
            Record::Data(DataRecord { address, words })
        }
    })
}

fn hex_digit(character: u8) -> Option<u8> {
    char::from(character).to_digit(16).map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(text: &str) -> Result<Vec<Record>, LoadError> {
        decode_as(Ignores::Controls, text)
    }

    fn decode_as(ignores: Ignores, text: &str) -> Result<Vec<Record>, LoadError> {
        let mut decoder = Decoder::new(ignores);
        let mut records = Vec::new();
        for character in text.bytes() {
            let record = decoder.take(character, !records.is_empty())?;
            records.extend(record);
        }
        Ok(records)
    }

    #[test]
    fn records_are_read_in_any_case_and_with_any_control_character() {
        let data = Record::Data(DataRecord { address: 0x80, words: vec![0x1234, 0xABCD] });
        for text in [
            "S0030000FC\rS309000000803412CDABB8\rS70500000000FA\r",
            "S0030000FC\r\nS309000000803412cdabb8\r\nS70500000000fa\r\n",
            "S0110000000050524F4752414D264441544196\nS3\t09\x7f000000803412CDABB8\x00S70500000000FA",
        ] {
            assert_eq!(decode(text), Ok(vec![Record::Header, data.clone(), Record::End(0)]), "{text:?}");
        }
    }

    #[test]
    fn a_strict_reader_ignores_only_line_ends_and_flow_control() {
        let end = Ok(vec![Record::Header, Record::End(0x1_2345)]);
        for text in
            ["S0030000FC\rS7050001234591\r", "S0030000FC\r\nS7050001234591\n", "S003\x130000FC\x11S70500012\n34591"]
        {
            assert_eq!(decode_as(Ignores::LineEnds, text), end, "{text:?}");
        }
        for text in ["\t", "S00\x073", "S0030000FC\x1a", "\0", "\x7f"] {
            assert_eq!(decode_as(Ignores::LineEnds, text), Err(LoadError::Character), "{text:?}");
        }
    }

    #[test]
    fn each_error_has_its_number() {
        let cases = [
            ("s0030000FC", LoadError::Character),
            ("x", LoadError::Character),
            (" ", LoadError::Character),
            ("S0030000FG", LoadError::Character),
            ("S0030000FC\r\u{e9}", LoadError::Character),
            ("S3", LoadError::Record),
            ("S7", LoadError::Record),
            ("S1", LoadError::Record),
            ("S000", LoadError::Record),
            ("S0030000FC\rS5", LoadError::Record),
            ("S0030000FC\rS8", LoadError::Record),
            ("S0030000FC\rS304", LoadError::Record),
            ("S0030000FC\rS704", LoadError::Record),
            ("S0030000FD", LoadError::Checksum),
            ("S0030000FC\rS309000000803412CDABB9", LoadError::Checksum),
        ];
        for (text, error) in cases {
            assert_eq!(decode(text), Err(error), "{text:?}");
        }
    }

    #[test]
    fn an_odd_last_byte_is_not_a_word() {
        let records = decode("S0030000FCS3080000008034120130").map(|records| records[1].clone());
        let words = vec![0x1234];
        assert_eq!(records, Ok(Record::Data(DataRecord { address: 0x80, words })));
    }
}
