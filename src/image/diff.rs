//! What differs between two images: the words they write, and where they start.
//!
//! Order and size of records, the format, and what addresses count make no difference. Of words that are written twice
//! the last one counts, as in a unit.

use super::{AddressRange, AddressUnit, Image};

/// How words of a range differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Change {
    /// Both images write them, differently.
    Changed,
    /// Only the first image writes them.
    OnlyFirst,
    /// Only the second does.
    OnlySecond,
}

impl Change {
    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Change::Changed => "changed",
            Change::OnlyFirst => "only-a",
            Change::OnlySecond => "only-b",
        }
    }
}

/// Words next to each other that differ in the same way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Differing {
    /// How.
    pub change: Change,
    /// Which, in words.
    pub words: AddressRange,
}

/// All differences of two images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Where the words differ, ascending.
    pub ranges: Vec<Differing>,
    /// Whether the entry points differ.
    pub entry: bool,
}

impl Difference {
    /// Whether a unit would run the same program.
    pub fn is_none(&self) -> bool {
        self.ranges.is_empty() && !self.entry
    }

    /// Number of words that differ in this way.
    pub fn words(&self, change: Change) -> u64 {
        let of_kind = self.ranges.iter().filter(|range| range.change == change);
        of_kind.map(|range| range.words.end - range.words.start).sum()
    }
}

/// Compares two images.
pub fn diff(first: &Image, second: &Image) -> Difference {
    let (first_words, second_words) = (words(first), words(second));
    let (mut left, mut right) = (first_words.iter().peekable(), second_words.iter().peekable());
    let mut ranges: Vec<Differing> = Vec::new();
    let mut note = |address: u64, change: Change| match ranges.last_mut() {
        Some(last) if last.change == change && last.words.end == address => last.words.end += 1,
        _ => ranges.push(Differing { change, words: AddressRange { start: address, end: address + 1 } }),
    };
    loop {
        match (left.peek(), right.peek()) {
            (None, None) => break,
            (Some(a), Some(b)) if a.address == b.address => {
                if a.value != b.value {
                    note(a.address, Change::Changed);
                }
                left.next();
                right.next();
            }
            (Some(a), other) if other.is_none_or(|b| a.address < b.address) => {
                note(a.address, Change::OnlyFirst);
                left.next();
            }
            (_, Some(b)) => {
                note(b.address, Change::OnlySecond);
                right.next();
            }
            (Some(_), None) => break,
        }
    }
    Difference { ranges, entry: byte_address(first.entry, first) != byte_address(second.entry, second) }
}

/// Number of words an image writes.
pub fn count_words(image: &Image) -> u64 {
    words(image).len() as u64
}

/// A word and its address in words; half a word is filled up as erased flash reads.
struct Word {
    address: u64,
    value: u16,
}

fn words(image: &Image) -> Vec<Word> {
    let mut bytes: Vec<(u64, u8)> = Vec::new();
    for block in &image.blocks {
        let start = byte_address(block.address, image);
        bytes.extend(block.data.iter().enumerate().map(|(at, &byte)| (start + at as u64, byte)));
    }
    // Stable, so that of two bytes with one address the later one stays the later one.
    bytes.sort_by_key(|&(address, _)| address);
    let mut words: Vec<Word> = Vec::with_capacity(bytes.len() / 2);
    for (address, byte) in bytes {
        let word = address / u64::from(AddressUnit::Word.bytes());
        if words.last().is_none_or(|last| last.address != word) {
            words.push(Word { address: word, value: 0xFFFF });
        }
        if let Some(last) = words.last_mut() {
            let mut halves = last.value.to_le_bytes();
            halves[(address % 2) as usize] = byte;
            last.value = u16::from_le_bytes(halves);
        }
    }
    words
}

fn byte_address(address: u32, image: &Image) -> u64 {
    u64::from(address) * u64::from(image.address_unit.bytes())
}

#[cfg(test)]
mod tests {
    use super::super::Block;
    use super::*;

    fn image(address_unit: AddressUnit, entry: u32, blocks: &[(u32, &[u8])]) -> Image {
        let blocks = blocks.iter().map(|&(address, data)| Block { address, data: data.to_vec() }).collect();
        Image { header: Vec::new(), blocks, entry, address_unit }
    }

    #[test]
    fn order_size_and_unit_make_no_difference_and_of_two_words_the_last_counts() {
        let one = image(AddressUnit::Word, 2, &[(0, &[1, 2, 3, 4, 5, 6])]);
        for other in [
            image(AddressUnit::Word, 2, &[(2, &[5, 6]), (0, &[1, 2, 3, 4])]),
            image(AddressUnit::Byte, 4, &[(0, &[1, 2, 3]), (3, &[4, 5, 6])]),
            image(AddressUnit::Word, 2, &[(0, &[9, 9]), (0, &[1, 2, 3, 4, 5, 6])]),
        ] {
            assert!(diff(&one, &other).is_none(), "{other:?}");
            assert_eq!(count_words(&other), 3);
        }
        assert!(diff(&one, &image(AddressUnit::Word, 1, &[(0, &[1, 2, 3, 4, 5, 6])])).entry);
    }

    #[test]
    fn changed_and_missing_words_are_ranges() {
        let one = image(AddressUnit::Word, 0, &[(0, &[1, 0, 2, 0, 3, 0, 4, 0]), (8, &[5, 0])]);
        let two = image(AddressUnit::Word, 0, &[(1, &[9, 0, 9, 0, 4, 0, 7, 0, 7, 0]), (9, &[5, 0])]);
        let found = diff(&one, &two);
        let ranges: Vec<_> =
            found.ranges.iter().map(|range| (range.change.name(), range.words.start, range.words.end)).collect();
        assert_eq!(
            ranges,
            [("only-a", 0, 1), ("changed", 1, 3), ("only-b", 4, 6), ("only-a", 8, 9), ("only-b", 9, 10)]
        );
        assert_eq!(
            [Change::Changed, Change::OnlyFirst, Change::OnlySecond].map(|change| found.words(change)),
            [2, 2, 3]
        );
        let back = diff(&two, &one);
        assert_eq!(back.words(Change::OnlyFirst), 3);
    }
}
