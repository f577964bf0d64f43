//! S-records as the G3 loader reads them: character by character out of its ring, believing the length byte.
//!
//! A character that is not a digit counts as 0, and so does a letter in lower case. Nothing is looked up before it is needed: a
//! record that ends early is filled with what follows it. S0 is read with a four-byte address, so the usual
//! `S0030000FC` makes the length of its text 3 - 5, which is 254 in a byte: the next records are taken for text.
//! The words of a data record are handed out before the checksum is read. Whatever follows it is skipped up to
//! the CR, so a file with LF alone is mute for ever; an LF after the CR is where the next record should begin.
//!
//! Public facts (docs/loaders.md), likely but not proven for these units. The types beside S0, S3 and S7 are decided in
//! errata E-I12.

/// Which loader of the generation it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// The last one that fails on a record with an odd number of data bytes: it reads whole words, takes the checksum for
    /// the high byte of the last one, and waits for the end of the record for ever. That it swallows all that follows is a
    /// guess.
    V1_3,
    /// Takes them all.
    V2_0,
}

impl Version {
    /// What it calls itself. The manual does not print it.
    pub const fn header(self) -> &'static str {
        match self {
            Version::V1_3 => "56F83xx Serial Bootloader v1.3",
            Version::V2_0 => "56F83xx Serial Bootloader v2.0",
        }
    }
}

/// What is wrong with a file, by the bits of the loader's status word (public facts about the loader).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadError {
    /// The sum is wrong.
    Checksum,
    /// No record, one of a type it does not take, or one out of order.
    Type,
    /// A flash operation does not end.
    Access,
    /// The flash refuses: something is protected.
    Protection,
    /// A word does not read back as programmed.
    Program,
    /// The receiver could not read a character.
    Receive,
    /// The entry point is not in the application's flash.
    StartAddress,
    /// Data outside of the application's flash.
    AddressRange,
}

impl LoadError {
    /// Its bit.
    pub fn bit(self) -> u16 {
        match self {
            LoadError::Checksum => 0x0001,
            LoadError::Type => 0x0002,
            LoadError::Access => 0x0004,
            LoadError::Protection => 0x0008,
            LoadError::Program => 0x0010,
            LoadError::StartAddress => 0x0020,
            LoadError::Receive => 0x0040,
            LoadError::AddressRange => 0x0080,
        }
    }
}

/// What a character leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Read {
    /// More characters are wanted.
    Nothing,
    /// A character of the header's text.
    Text(u8),
    /// Words to program, before anything else is read.
    Words {
        /// Address of the first one.
        address: u32,
        /// Words, low byte first in the record; half a word is filled up as erased flash reads (a guess).
        words: Vec<u16>,
    },
    /// A record is over, its checksum is right.
    End(Kind),
}

/// What a record is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// S0.
    Header,
    /// S1, S2, S3.
    Data,
    /// S7, S8, S9, with the entry point.
    Terminator(u32),
}

/// Takes characters.
#[derive(Debug)]
pub struct Reader {
    version: Version,
    place: Place,
}

/// Where in a record the next character belongs.
#[derive(Debug, Default)]
enum Place {
    #[default]
    Start,
    Type,
    Body(Body),
    /// After the checksum.
    LineEnd(Kind),
}

#[derive(Debug)]
struct Body {
    version: Version,
    shape: Shape,
    high_digit: Option<u8>,
    part: Part,
    sum: u8,
    address: u32,
    data: Vec<u8>,
    /// Data bytes that are still to come.
    data_left: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// The address that follows has this many bytes.
    Length {
        address_bytes: u8,
    },
    /// This many bytes of it are still to come.
    Address(u8),
    Data,
    Checksum,
    /// Past the record's end, without having noticed.
    Lost,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Header,
    Data,
    Terminator,
}

impl Reader {
    /// Before a record.
    pub fn new(version: Version) -> Self {
        Reader { version, place: Place::Start }
    }

    /// Takes the next character. `header_seen` says whether an S0 has come: nothing else is taken before it.
    ///
    /// # Errors
    /// What the loader has against it. The caller starts over with a new reader.
    pub fn take(&mut self, character: u8, header_seen: bool) -> Result<Read, LoadError> {
        match &mut self.place {
            Place::Start if character == b'S' => self.place = Place::Type,
            Place::Start => return Err(LoadError::Type),
            Place::Type => {
                let (shape, address_bytes) = match character {
                    b'0' => (Shape::Header, 4),
                    b'1' if header_seen => (Shape::Data, 2),
                    b'2' if header_seen => (Shape::Data, 3),
                    b'3' if header_seen => (Shape::Data, 4),
                    b'7' if header_seen => (Shape::Terminator, 4),
                    b'8' if header_seen => (Shape::Terminator, 3),
                    b'9' if header_seen => (Shape::Terminator, 2),
                    _ => return Err(LoadError::Type),
                };
                self.place = Place::Body(Body {
                    version: self.version,
                    shape,
                    high_digit: None,
                    part: Part::Length { address_bytes },
                    sum: 0,
                    address: 0,
                    data: Vec::new(),
                    data_left: 0,
                });
            }
            Place::Body(body) => {
                let digit = digit(character);
                let Some(high) = body.high_digit.take() else {
                    body.high_digit = Some(digit);
                    return Ok(Read::Nothing);
                };
                let (read, end) = body.take(high << 4 | digit)?;
                if let Some(kind) = end {
                    self.place = Place::LineEnd(kind);
                }
                return Ok(read);
            }
            Place::LineEnd(kind) => {
                let kind = *kind;
                if character == b'\r' {
                    self.place = Place::Start;
                    return Ok(Read::End(kind));
                }
            }
        }
        Ok(Read::Nothing)
    }
}

impl Body {
    /// Takes a byte. Gives what follows, and after its checksum the record's kind.
    fn take(&mut self, byte: u8) -> Result<(Read, Option<Kind>), LoadError> {
        self.sum = self.sum.wrapping_add(byte);
        match self.part {
            Part::Length { address_bytes } => {
                self.data_left = byte.wrapping_sub(address_bytes + CHECKSUM_BYTES);
                self.part = Part::Address(address_bytes);
            }
            Part::Address(left) => {
                self.address = self.address << 8 | u32::from(byte);
                self.part = match left - 1 {
                    0 if self.data_left == 0 => Part::Checksum,
                    0 => Part::Data,
                    left => Part::Address(left),
                };
            }
            Part::Data => {
                self.data_left -= 1;
                let is_last = self.data_left == 0;
                if is_last {
                    self.part = Part::Checksum;
                }
                match self.shape {
                    Shape::Header => return Ok((Read::Text(byte), None)),
                    Shape::Data => self.data.push(byte),
                    Shape::Terminator => {}
                }
                if is_last && self.shape == Shape::Data && !self.takes_the_sum_as_data() {
                    return Ok((Read::Words { address: self.address, words: words(&self.data) }, None));
                }
            }
            Part::Checksum if self.takes_the_sum_as_data() => {
                self.part = Part::Lost;
                self.data.push(byte);
                return Ok((Read::Words { address: self.address, words: words(&self.data) }, None));
            }
            Part::Lost => {}
            Part::Checksum if self.sum != 0xFF => return Err(LoadError::Checksum),
            Part::Checksum => {
                let kind = match self.shape {
                    Shape::Header => Kind::Header,
                    Shape::Data => Kind::Data,
                    Shape::Terminator => Kind::Terminator(self.address),
                };
                return Ok((Read::Nothing, Some(kind)));
            }
        }
        Ok((Read::Nothing, None))
    }

    fn takes_the_sum_as_data(&self) -> bool {
        self.version == Version::V1_3 && self.shape == Shape::Data && self.data.len() % 2 == 1
    }
}

/// Bytes of the checksum, which the length byte counts.
const CHECKSUM_BYTES: u8 = 1;

fn words(data: &[u8]) -> Vec<u16> {
    data.chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair.get(1).copied().unwrap_or(0xFF)])).collect()
}

fn digit(character: u8) -> u8 {
    match character {
        b'0'..=b'9' => character - b'0',
        b'A'..=b'F' => character - b'A' + 10,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "S00700000000414275\r";

    /// What comes of a text, up to the first error.
    fn read(text: &str) -> (Vec<Read>, Option<LoadError>) {
        let mut reader = Reader::new(Version::V2_0);
        let (mut reads, mut header_seen) = (Vec::new(), false);
        for character in text.bytes() {
            match reader.take(character, header_seen) {
                Ok(Read::Nothing) => {}
                Ok(read) => {
                    header_seen |= read == Read::End(Kind::Header);
                    reads.push(read);
                }
                Err(error) => return (reads, Some(error)),
            }
        }
        (reads, None)
    }

    fn error(text: &str) -> Option<LoadError> {
        read(&(HEADER.to_owned() + text)).1
    }

    #[test]
    fn words_come_before_the_check_sum_and_the_end_after_the_return() {
        let text = HEADER.to_owned() + "S309000000803412CDABB8";
        let words = Read::Words { address: 0x80, words: vec![0x1234, 0xABCD] };
        let header = [Read::Text(b'A'), Read::Text(b'B'), Read::End(Kind::Header)];
        let expected = [&header[..], &[words]].concat();
        assert_eq!(read(&text[..text.len() - 2]), (expected.clone(), None), "no checksum yet");
        assert_eq!(read(&text), (expected.clone(), None), "no return yet");
        let expected = [&expected[..], &[Read::End(Kind::Data), Read::End(Kind::Terminator(0xA0))]].concat();
        assert_eq!(read(&(text + "\rS705000000A05A\r")), (expected, None));
    }

    #[test]
    fn short_addresses_are_taken_as_well() {
        for (text, address) in [("S1050102AABB92", 0x102), ("S206010203AABB8E", 0x1_0203)] {
            let (reads, error) = read(&(HEADER.to_owned() + text + "\r"));
            assert_eq!(error, None, "{text}");
            assert_eq!(reads[3], Read::Words { address, words: vec![0xBBAA] }, "{text}");
        }
        let (reads, _) = read(&(HEADER.to_owned() + "S804010203F5\rS9030102F9\r"));
        assert_eq!(reads[3..], [Read::End(Kind::Terminator(0x1_0203)), Read::End(Kind::Terminator(0x102))]);
    }

    #[test]
    fn lower_case_digits_are_zeros_and_so_the_sum_is_wrong() {
        let (reads, error) = read(&(HEADER.to_owned() + "S309000000803412cdabb8\r"));
        assert_eq!(reads[3], Read::Words { address: 0x80, words: vec![0x1234, 0x0000] });
        assert_eq!(error, Some(LoadError::Checksum));
    }

    #[test]
    fn a_header_with_a_two_byte_address_swallows_what_follows() {
        let text = "S0030000FC\r".to_owned() + &"S3090000008034120000B1\r".repeat(10);
        let (reads, error) = read(&text);
        assert!(reads.iter().all(|read| matches!(read, Read::Text(_))), "{reads:?}");
        assert_eq!(error, None, "it is still reading the text");
        assert_eq!(read(&"S0030000FC\r".repeat(60)).1, Some(LoadError::Checksum), "in the end the sum is wrong");
    }

    #[test]
    fn what_is_not_a_record_is_an_error_of_type() {
        for text in ["\n", "\r", "m", "s3", "S4", "S5", "S6", "SA"] {
            assert_eq!(error(text), Some(LoadError::Type), "{text:?}");
        }
        assert_eq!(read("S3").1, Some(LoadError::Type), "data before the header");
        assert_eq!(read("S7").1, Some(LoadError::Type), "the end before the header");
    }

    #[test]
    fn line_feeds_alone_are_mute_for_ever() {
        let text = HEADER.replace('\r', "\n") + &"S705000000A05A\n".repeat(100);
        assert_eq!(read(&text), (vec![Read::Text(b'A'), Read::Text(b'B')], None));
    }

    #[test]
    fn the_first_one_takes_the_sum_of_any_odd_record_for_data() {
        for (text, words, is_lost) in [
            ("S306000000801168\r", vec![0x6811], true),
            ("S30700000080112245\r", vec![0x2211], false),
            ("S3080000008011223311\r", vec![0x2211, 0x1133], true),
            ("S3090000008011223344CC\r", vec![0x2211, 0x4433], false),
            ("S30A00000080112233445576\r", vec![0x2211, 0x4433, 0x7655], true),
        ] {
            let mut reader = Reader::new(Version::V1_3);
            let reads: Vec<Read> = text.bytes().flat_map(|character| reader.take(character, true)).collect();
            let said: Vec<&Read> = reads.iter().filter(|read| **read != Read::Nothing).collect();
            let end = if is_lost { &[][..] } else { &[&Read::End(Kind::Data)] };
            assert_eq!(said, [&[&Read::Words { address: 0x80, words }], end].concat(), "{text}");
        }
    }

    #[test]
    fn nothing_that_comes_makes_it_panic() {
        let mut rng = crate::rng::Rng::new(1);
        for round in 0..2_000 {
            let version = [Version::V1_3, Version::V2_0][round % 2];
            let mut reader = Reader::new(version);
            for _ in 0..1_000 {
                let character = b"S0123456789ABCDEF\r\n\xffa"[rng.below(21) as usize];
                if reader.take(character, true).is_err() {
                    reader = Reader::new(version);
                }
            }
        }
    }
}
