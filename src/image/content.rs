//! What is kept while a file is read: the data of all records, and how their addresses advance.

use super::AddressUnit;

/// What was read: data bytes of all records in a row, and where each record's lie.
#[derive(Debug)]
pub(super) struct Content {
    bytes: Vec<u8>,
    pub(super) pieces: Vec<Piece>,
    pub(super) unit: AddressUnit,
}

/// The data of one record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) line: u64,
    pub(super) address: u32,
    start: u32,
    length: u8,
}

impl Content {
    pub(super) fn new() -> Self {
        Content { bytes: Vec::new(), pieces: Vec::new(), unit: AddressUnit::Word }
    }

    pub(super) fn data(&self, piece: &Piece) -> &[u8] {
        let start = piece.start as usize;
        self.bytes.get(start..start + usize::from(piece.length)).unwrap_or_default()
    }

    /// Keeps a record's data, at most 255 bytes, if there is room.
    pub(super) fn keep(&mut self, line: u64, address: u32, data: &[u8]) -> bool {
        let Ok(length) = u8::try_from(data.len()) else { return false };
        if self.bytes.len() + data.len() > MOST_BYTES || self.pieces.len() >= MOST_PIECES {
            return false;
        }
        let start = self.bytes.len() as u32;
        self.pieces.push(Piece { line, address, start, length });
        self.bytes.extend_from_slice(data);
        true
    }

    #[cfg(test)]
    pub(super) fn kept(&self) -> usize {
        self.bytes.len()
    }
}

impl Piece {
    pub(super) fn length(&self) -> usize {
        usize::from(self.length)
    }
}

/// The largest flash of these parts: 256 K words.
pub(super) const MOST_BYTES: usize = 512 * 1024;
/// That flash in records of eight bytes, shorter than any linker writes.
pub(super) const MOST_PIECES: usize = 65_536;

/// How addresses advance from one record to the next.
#[derive(Debug, Default)]
pub(super) struct Steps {
    /// Steps of half as many addresses as the record before has bytes.
    words: u64,
    /// Steps of as many addresses as the record before has bytes.
    bytes: u64,
    /// The first line with a step of words.
    word_line: u64,
    /// The first line with a step of bytes.
    byte_line: u64,
    last: Option<(u32, usize)>,
}

impl Steps {
    pub(super) fn step(&mut self, line: u64, address: u32, length: usize) {
        if let Some((last, length)) = self.last {
            let advance = u64::from(address.wrapping_sub(last));
            if advance == length as u64 {
                self.bytes += 1;
                self.byte_line = if self.bytes == 1 { line } else { self.byte_line };
            } else if advance * 2 == length as u64 {
                self.words += 1;
                self.word_line = if self.words == 1 { line } else { self.word_line };
            }
        }
        self.last = Some((address, length));
    }

    /// A record is missing here, so the step to the next one shows nothing.
    pub(super) fn interrupt(&mut self) {
        self.last = None;
    }

    /// What addresses count, and the first line that shows it.
    ///
    /// In a file of words, a gap as long as a record looks like a step of bytes; so the majority decides.
    pub(super) fn unit(&self) -> Option<(AddressUnit, u64)> {
        match (self.words, self.bytes) {
            (0, 0) => None,
            (words, bytes) if words >= bytes => Some((AddressUnit::Word, self.word_line)),
            _ => Some((AddressUnit::Byte, self.byte_line)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_the_largest_flash_and_for_its_records_and_for_no_more() {
        let mut content = Content::new();
        for number in 0..(MOST_BYTES / 128) as u32 {
            assert!(content.keep(1, number * 64, &[0; 128]), "{number}");
        }
        assert!(!content.keep(1, 0, &[0]));
        assert_eq!(content.kept(), MOST_BYTES);

        let mut content = Content::new();
        assert!((0..MOST_PIECES).all(|_| content.keep(1, 0, &[0])));
        assert!(!content.keep(1, 0, &[0]));
        assert_eq!(content.pieces.len(), MOST_PIECES);
    }
}
