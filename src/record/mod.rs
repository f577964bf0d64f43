//! Every byte, both directions, in order, with its time.
//!
//! Structure is an overlay: events point into this record by [`Span`], and what no recogniser understood is here all
//! the same. The record in memory keeps the newest part only; the file on disk keeps the rest.

mod cast;
mod reader;
mod tally;

pub use cast::{Adapter, Cast, Header};
pub use reader::{Ending, LONGEST_LINE, Piece, ReadError, Reader};
pub use tally::Tally;

use std::collections::VecDeque;

use crate::endpoint::Secrecy;
use crate::time::Instant;

/// Which side sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// The unit sent, we received.
    FromUnit,
    /// We sent to the unit.
    ToUnit,
}

/// A stretch of bytes from the unit: offsets into everything it has sent since the record began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Span {
    /// Offset of the first byte.
    pub start: u64,
    /// The offset after the last byte.
    pub end: u64,
}

impl Span {
    /// Number of bytes.
    pub fn len(self) -> u64 {
        self.end - self.start
    }

    /// Whether there are none.
    pub fn is_empty(self) -> bool {
        self.start == self.end
    }

    /// The smallest span that holds both.
    pub fn join(self, other: Span) -> Span {
        Span { start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

/// Bytes that came or went together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// When.
    pub at: Instant,
    /// Which side sent.
    pub direction: Direction,
    /// Whether the content was secret and has been replaced.
    pub secrecy: Secrecy,
    /// Offset of the first byte among those of its direction.
    pub start: u64,
    /// What; secret bytes are already replaced by [`REDACTED`].
    pub bytes: Vec<u8>,
}

/// Xon, "go on" (AXTC4CO manual, appendix A: flow control Xon/Xoff).
pub const XON: u8 = 0x11;
/// Xoff, "stop".
pub const XOFF: u8 = 0x13;

/// What replaces a secret byte in the record.
pub const REDACTED: u8 = b'*';

/// What a recording notes when the link is lost.
pub const LINK_LOST: &str = "link lost";

/// How the note begins that it is back: `link back as /dev/ttyUSB0`, perhaps with `after 2.8 s` in between.
pub const LINK_BACK: &str = "link back ";

/// The most memory kept: hours of ordinary talk, seconds of a flood.
pub const KEPT_BYTES: usize = 8 << 20;

/// Bytes of one entry at most, so that the oldest can be let go in small steps.
const ENTRY_BYTES: usize = 4096;

/// What an entry costs besides its bytes, so that a device that sends single bytes fills no more memory than another.
const ENTRY_COST: usize = size_of::<Entry>() + 16;

/// The newest bytes, both directions, in order.
#[derive(Debug)]
pub struct Record {
    entries: VecDeque<Entry>,
    /// Entries let go since the record began: the number of the first one kept.
    dropped: u64,
    kept: usize,
    from_unit: u64,
    to_unit: u64,
    /// The most memory kept, in bytes.
    limit: usize,
}

impl Default for Record {
    fn default() -> Self {
        Record::new()
    }
}

impl Record {
    /// An empty record.
    pub fn new() -> Self {
        Record::with_limit(KEPT_BYTES)
    }

    /// An empty record that keeps `limit` bytes of memory instead of [`KEPT_BYTES`].
    pub fn with_limit(limit: usize) -> Self {
        Record { entries: VecDeque::new(), dropped: 0, kept: 0, from_unit: 0, to_unit: 0, limit }
    }

    /// Appends bytes and says where they are among those of their direction.
    pub fn push(&mut self, at: Instant, direction: Direction, secrecy: Secrecy, bytes: &[u8]) -> Span {
        let counter = match direction {
            Direction::FromUnit => &mut self.from_unit,
            Direction::ToUnit => &mut self.to_unit,
        };
        let span = Span { start: *counter, end: *counter + bytes.len() as u64 };
        *counter = span.end;
        let mut start = span.start;
        for chunk in bytes.chunks(ENTRY_BYTES) {
            let kept = match secrecy {
                Secrecy::Open => chunk.to_vec(),
                Secrecy::Secret => vec![REDACTED; chunk.len()],
            };
            self.kept += kept.len() + ENTRY_COST;
            self.entries.push_back(Entry { at, direction, secrecy, start, bytes: kept });
            start += chunk.len() as u64;
        }
        while self.kept > self.limit && self.entries.len() > 1 {
            if let Some(oldest) = self.entries.pop_front() {
                self.kept -= oldest.bytes.len() + ENTRY_COST;
                self.dropped += 1;
            }
        }
        span
    }

    /// What is still in memory, oldest first.
    pub fn entries(&self) -> impl DoubleEndedIterator<Item = &Entry> {
        self.entries.iter()
    }

    /// Entries from number `from` on, oldest first, as far as they are still in memory. The first entry ever has number
    /// 0; a reader that has seen all remembers [`Record::entry_count`].
    pub fn entries_from(&self, from: u64) -> impl Iterator<Item = &Entry> {
        let skip = usize::try_from(from.saturating_sub(self.dropped)).unwrap_or(usize::MAX);
        self.entries.range(skip.min(self.entries.len())..)
    }

    /// Number of entries ever appended.
    pub fn entry_count(&self) -> u64 {
        self.dropped + self.entries.len() as u64
    }

    /// The bytes of a span from the unit, as far as they are still in memory.
    pub fn bytes(&self, span: Span) -> Vec<u8> {
        let mut pieces: Vec<&[u8]> = Vec::new();
        // Newest first: spans that are asked for are near the end.
        for entry in self.entries.iter().rev().filter(|entry| entry.direction == Direction::FromUnit) {
            let end = entry.start + entry.bytes.len() as u64;
            if end <= span.start {
                break;
            }
            if entry.start < span.end {
                let from = span.start.saturating_sub(entry.start) as usize;
                let to = (span.end.min(end) - entry.start) as usize;
                pieces.push(&entry.bytes[from..to]);
            }
        }
        pieces.into_iter().rev().flatten().copied().collect()
    }

    /// Bytes ever received from the unit.
    pub fn received(&self) -> u64 {
        self.from_unit
    }

    /// Bytes ever sent to the unit.
    pub fn sent(&self) -> u64 {
        self.to_unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T0: Instant = Instant::ZERO;

    #[test]
    fn a_span_finds_its_bytes_across_entries_and_between_ours() {
        let mut record = Record::new();
        record.push(T0, Direction::FromUnit, Secrecy::Open, b"axc");
        record.push(T0, Direction::ToUnit, Secrecy::Open, b"m");
        let span = record.push(Instant::from_millis(1), Direction::FromUnit, Secrecy::Open, b"on\r\n");
        assert_eq!(span, Span { start: 3, end: 7 });
        assert_eq!(record.bytes(Span { start: 1, end: 5 }), b"xcon");
        assert_eq!(record.bytes(Span { start: 7, end: 9 }), b"");
    }

    #[test]
    fn the_oldest_bytes_go_first_and_offsets_stay() {
        let mut record = Record::with_limit(4096);
        for round in 0..10 {
            record.push(Instant::from_millis(round), Direction::FromUnit, Secrecy::Open, &[round as u8; 1000]);
        }
        assert_eq!((record.received(), record.entry_count()), (10_000, 10));
        assert_eq!(record.bytes(Span { start: 8_999, end: 9_001 }), [8, 9]);
        assert_eq!(record.bytes(Span { start: 0, end: 10 }), b"");
        assert_eq!(record.entries_from(8).map(|entry| entry.bytes[0]).collect::<Vec<_>>(), [8, 9]);
        assert!(record.entries_from(0).count() < 10, "the oldest are gone");
        assert_eq!(record.entries_from(10).count(), 0);
    }

    #[test]
    fn bytes_that_come_at_once_are_kept_in_pieces_that_follow_one_another() {
        let mut record = Record::new();
        record.push(T0, Direction::FromUnit, Secrecy::Open, b"before");
        let bytes: Vec<u8> = (0..3 * ENTRY_BYTES).map(|at| (at / 16) as u8).collect();
        let span = record.push(T0, Direction::FromUnit, Secrecy::Open, &bytes);
        assert_eq!((span.len(), span.is_empty(), record.entry_count()), (3 * ENTRY_BYTES as u64, false, 4));
        assert_eq!(record.bytes(span), bytes);
        let starts: Vec<u64> = record.entries().map(|entry| entry.start).collect();
        assert_eq!(starts, [0, 6, 6 + 4096, 6 + 2 * 4096]);
        assert!(Span { start: 6, end: 6 }.is_empty());
    }

    #[test]
    fn the_last_entry_stays_however_little_may_be_kept() {
        let mut record = Record::with_limit(10);
        record.push(T0, Direction::FromUnit, Secrecy::Open, b"first");
        record.push(T0, Direction::FromUnit, Secrecy::Open, b"second");
        assert_eq!(record.entries().map(|entry| entry.bytes.as_slice()).collect::<Vec<_>>(), [b"second"]);
    }

    #[test]
    fn secret_bytes_keep_their_place_and_lose_their_content() {
        let mut record = Record::new();
        record.push(T0, Direction::ToUnit, Secrecy::Secret, b"AXIO-2010");
        let entry = record.entries().next().expect("one entry");
        assert_eq!(entry.bytes, b"*********");
        assert_eq!(record.sent(), 9);
    }
}
