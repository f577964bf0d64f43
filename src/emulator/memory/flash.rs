//! Program flash: erasing makes a page FFFFh, programming can only clear bits, and both take their time.
//!
//! The times are those of the public data sheets for the 56F83xx family, which is likely but not proven to be the
//! part in these units. The loader decides what to write; here is how.

use std::collections::VecDeque;

use super::super::{Area, Store};
use crate::device::{ERASE_TIME, PROGRAM_TIME};
use crate::image::FlashMap;
use crate::rng::Rng;
use crate::time::{Duration, Instant};

/// Content of an erased word.
const ERASED: u16 = 0xFFFF;

/// How long a loader waits for an operation that does not end: five times what erasing takes. A guess.
const PATIENCE: Duration = Duration::from_millis(100);

/// Program flash with the operation that runs on it.
#[derive(Debug)]
pub struct Flash {
    map: FlashMap,
    bytes: Vec<u8>,
    operation: Option<Operation>,
    /// Words with what is wrong with them.
    defects: Vec<(u32, Defect)>,
    chance: Rng,
}

/// How a write ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Every word reads back as wanted.
    Good,
    /// At least one word does not.
    Mismatch,
    /// The flash has refused: something there is protected. Nothing has changed.
    Refused,
    /// The operation did not end, and the loader has stopped waiting for it. Nothing has changed.
    Stuck,
}

/// What can be wrong with a word of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// It takes nothing that is programmed; erasing works.
    WornOut,
    /// It is protected: an operation on it or its page is refused.
    Protected,
    /// An operation on it or its page does not end.
    Stuck,
}

/// Words on their way from their old content to the new one.
#[derive(Debug)]
struct Operation {
    first_word: u32,
    wanted: Vec<u16>,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// Nothing will change, and at this moment it is known.
    Failing {
        until: Instant,
        written: Written,
    },
    Erasing {
        until: Instant,
    },
    /// The words (numbers within the operation) that are programmed one after the other from `since` on.
    Programming {
        since: Instant,
        words: Vec<usize>,
    },
}

impl Flash {
    /// Flash with this content, bytes in S-record order.
    ///
    /// # Panics
    /// If the content is not as long as the flash.
    pub fn new(map: FlashMap, bytes: Vec<u8>, seed: u64) -> Self {
        assert_eq!(bytes.len(), map.program_words as usize * 2, "flash content of the wrong length");
        Flash { map, bytes, operation: None, defects: Vec::new(), chance: Rng::new(seed).fork("flash") }
    }

    /// The content, bytes in S-record order (words low byte first).
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its geometry.
    pub fn map(&self) -> FlashMap {
        self.map
    }

    /// The word at an address.
    ///
    /// # Panics
    /// If the flash has no such word.
    pub fn word(&self, address: u32) -> u16 {
        let at = address as usize * 2;
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// All words of a page.
    pub fn page(&self, page: u32) -> Vec<u16> {
        let first = page * self.map.page_words;
        (first..first + self.map.page_words).map(|address| self.word(address)).collect()
    }

    /// Spoils a word. An address beyond the last word is nowhere, and so is the defect.
    pub fn spoil(&mut self, word: u32, defect: Defect) {
        if !self.defects.contains(&(word, defect)) {
            self.defects.push((word, defect));
        }
    }

    /// Number of things that are wrong with words.
    pub fn defects(&self) -> usize {
        self.defects.len()
    }

    /// Makes all words good again.
    pub fn repair(&mut self) {
        self.defects.clear();
    }

    /// Begins to write a page: erases it if some bit has to become 1, then programs the words that differ.
    ///
    /// # Panics
    /// If another write still runs or the page's length is wrong.
    pub fn write_page(&mut self, now: Instant, page: u32, wanted: Vec<u16>) {
        assert!(self.operation.is_none(), "one flash operation at a time");
        assert_eq!(wanted.len(), self.map.page_words as usize, "a page has a fixed length");
        let old = self.page(page);
        let must_erase = old.iter().zip(&wanted).any(|(&old, &new)| new & !old != 0);
        let stage = if must_erase {
            Stage::Erasing { until: now + ERASE_TIME }
        } else {
            Stage::Programming { since: now, words: differing(&old, &wanted) }
        };
        self.begin(now, Operation { first_word: page * self.map.page_words, wanted, stage });
    }

    /// Begins to erase words, whether they need it or not.
    ///
    /// # Panics
    /// If another write still runs or the flash has no such words.
    pub fn erase(&mut self, now: Instant, first_word: u32, words: u32) {
        assert!(self.operation.is_none(), "one flash operation at a time");
        assert!(first_word + words <= self.map.program_words, "no such words to erase");
        let wanted = vec![ERASED; words as usize];
        self.begin(now, Operation { first_word, wanted, stage: Stage::Erasing { until: now + ERASE_TIME } });
    }

    /// Begins to program words as they are, each in its turn, without erasing anything.
    ///
    /// # Panics
    /// If another write still runs or the flash has no such words.
    pub fn program_words(&mut self, now: Instant, first_word: u32, wanted: Vec<u16>) {
        assert!(self.operation.is_none(), "one flash operation at a time");
        assert!(first_word as usize + wanted.len() <= self.map.program_words as usize, "no such words to program");
        let words = (0..wanted.len()).collect();
        self.begin(now, Operation { first_word, wanted, stage: Stage::Programming { since: now, words } });
    }

    /// Begins, unless the flash has something against it.
    fn begin(&mut self, now: Instant, mut operation: Operation) {
        let words = operation.first_word..operation.first_word + operation.wanted.len() as u32;
        let has = |wanted| self.defects.iter().any(|(word, defect)| *defect == wanted && words.contains(word));
        if has(Defect::Protected) {
            operation.stage = Stage::Failing { until: now, written: Written::Refused };
        } else if has(Defect::Stuck) {
            operation.stage = Stage::Failing { until: now + PATIENCE, written: Written::Stuck };
        }
        self.operation = Some(operation);
    }

    /// When something is due.
    pub fn deadline(&self) -> Option<Instant> {
        self.operation.as_ref().map(|operation| match &operation.stage {
            Stage::Failing { until, .. } | Stage::Erasing { until } => *until,
            Stage::Programming { since, words } => *since + PROGRAM_TIME * words.len() as u32,
        })
    }

    /// Does what is due; says so when the words are done.
    pub fn step(&mut self, now: Instant, stores: &mut VecDeque<Store>) -> Option<Written> {
        if self.deadline().is_none_or(|due| due > now) {
            return None;
        }
        let mut operation = self.operation.take()?;
        let first_word = operation.first_word;
        match operation.stage {
            Stage::Failing { written, .. } => Some(written),
            Stage::Erasing { until } => {
                self.put(first_word, &vec![ERASED; operation.wanted.len()], stores);
                let words = differing(&vec![ERASED; operation.wanted.len()], &operation.wanted);
                operation.stage = Stage::Programming { since: until, words };
                self.operation = Some(operation);
                None
            }
            Stage::Programming { words, .. } => {
                self.program(first_word, &words, &operation.wanted, stores);
                let good = (first_word..).zip(&operation.wanted).all(|(address, &wanted)| self.word(address) == wanted);
                Some(if good { Written::Good } else { Written::Mismatch })
            }
        }
    }

    /// Power goes: words due by now are written, the others not; a page being erased holds anything.
    pub fn power_lost(&mut self, now: Instant, stores: &mut VecDeque<Store>) {
        // What was due is finished first, so that a late call does not lose it.
        while self.deadline().is_some_and(|due| due <= now) {
            self.step(now, stores);
        }
        let Some(operation) = self.operation.take() else { return };
        match operation.stage {
            Stage::Failing { .. } => {}
            Stage::Erasing { .. } => {
                // Erasing drives bits to 1: each cell has or has not arrived there.
                let gone = self.chance.chance(50);
                let garbage: Vec<u16> = (0..operation.wanted.len() as u32)
                    .map(|number| {
                        let driven = self.chance.next_u64() as u16;
                        if gone { ERASED } else { self.word(operation.first_word + number) | driven }
                    })
                    .collect();
                self.put(operation.first_word, &garbage, stores);
            }
            Stage::Programming { since, words } => {
                let due = (now.since(since).as_nanos() / PROGRAM_TIME.as_nanos()) as usize;
                let written = &words[..due.min(words.len())];
                self.program(operation.first_word, written, &operation.wanted, stores);
            }
        }
    }

    /// Programs words of a page: the new content is the old AND the wanted. Neighbours are stored together.
    fn program(&mut self, first_word: u32, words: &[usize], wanted: &[u16], stores: &mut VecDeque<Store>) {
        for run in words.chunk_by(|&earlier, &later| later == earlier + 1) {
            let begin = first_word + run[0] as u32;
            let content: Vec<u16> = run
                .iter()
                .map(|&number| {
                    let address = first_word + number as u32;
                    let old = self.word(address);
                    if self.defects.contains(&(address, Defect::WornOut)) { old } else { old & wanted[number] }
                })
                .collect();
            self.put(begin, &content, stores);
        }
    }

    fn put(&mut self, first_word: u32, words: &[u16], stores: &mut VecDeque<Store>) {
        let offset = first_word as usize * 2;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.bytes[offset..offset + bytes.len()].copy_from_slice(&bytes);
        stores.push_back(Store { area: Area::Flash, offset, bytes });
    }
}

fn differing(old: &[u16], wanted: &[u16]) -> Vec<usize> {
    (0..old.len()).filter(|&number| old[number] != wanted[number]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::AddressUnit;
    use crate::time::Duration;

    const MAP: FlashMap = FlashMap { address_unit: AddressUnit::Word, program_words: 16, page_words: 8 };

    fn flash(fill: u8) -> (Flash, VecDeque<Store>) {
        (Flash::new(MAP, vec![fill; 32], 1), VecDeque::new())
    }

    fn finish(flash: &mut Flash, stores: &mut VecDeque<Store>) -> (Instant, Written) {
        loop {
            let due = flash.deadline().expect("a write runs");
            if let Some(written) = flash.step(due, stores) {
                return (due, written);
            }
        }
    }

    #[test]
    fn a_page_is_erased_only_when_a_bit_has_to_become_one() {
        let (mut flash, mut stores) = flash(0xFF);
        flash.write_page(Instant::ZERO, 1, vec![0x1234; 8]);
        let (at, written) = finish(&mut flash, &mut stores);
        assert_eq!((at, written), (Instant::from_micros(160), Written::Good), "8 words at 20 µs, no erase");
        flash.write_page(at, 1, vec![0x1230; 8]);
        assert_eq!(finish(&mut flash, &mut stores).0.since(at), Duration::from_micros(160), "only bits to clear");
        let at = Instant::from_millis(1);
        flash.write_page(at, 1, vec![0xFFFF; 8]);
        assert_eq!(finish(&mut flash, &mut stores).0.since(at), ERASE_TIME, "erased, nothing to program");
        assert_eq!(flash.page(0), vec![0xFFFF; 8], "the other page is as it was");
    }

    #[test]
    fn words_are_programmed_without_an_erase_and_a_bit_that_is_cleared_stays_so() {
        let (mut flash, mut stores) = flash(0xFF);
        flash.program_words(Instant::ZERO, 6, vec![0x00FF, 0x1234, 0xFFFF]);
        let (at, written) = finish(&mut flash, &mut stores);
        assert_eq!((at, written), (Instant::from_micros(60), Written::Good), "3 words at 20 µs");
        flash.program_words(at, 6, vec![0xFF00]);
        assert_eq!(finish(&mut flash, &mut stores).1, Written::Mismatch);
        assert_eq!((flash.word(6), flash.word(7), flash.word(8)), (0x0000, 0x1234, 0xFFFF));
        flash.erase(at, 6, 1);
        assert_eq!(finish(&mut flash, &mut stores).1, Written::Good);
        assert_eq!((flash.word(6), flash.word(7)), (0xFFFF, 0x1234));
    }

    #[test]
    fn a_worn_out_word_is_a_mismatch() {
        let (mut flash, mut stores) = flash(0x00);
        flash.spoil(3, Defect::WornOut);
        flash.write_page(Instant::ZERO, 0, vec![0xA55A; 8]);
        assert_eq!(finish(&mut flash, &mut stores).1, Written::Mismatch);
        assert_eq!(flash.page(0), [0xA55A, 0xA55A, 0xA55A, 0xFFFF, 0xA55A, 0xA55A, 0xA55A, 0xA55A]);
    }

    #[test]
    fn a_protected_word_is_refused_at_once_and_a_stuck_one_in_the_end_and_nothing_changes() {
        for (defect, expected, takes_ms) in
            [(Defect::Protected, Written::Refused, 0), (Defect::Stuck, Written::Stuck, 100)]
        {
            let (mut flash, mut stores) = flash(0x5A);
            flash.spoil(9, defect);
            flash.spoil(1_000_000, defect);
            for page_or_words in 0..3 {
                match page_or_words {
                    0 => flash.write_page(Instant::ZERO, 1, vec![0; 8]),
                    1 => flash.erase(Instant::ZERO, 8, 8),
                    _ => flash.program_words(Instant::ZERO, 9, vec![0]),
                }
                assert_eq!(finish(&mut flash, &mut stores), (Instant::from_millis(takes_ms), expected));
                assert_eq!((flash.page(1), stores.len()), (vec![0x5A5A; 8], 0));
            }
            flash.write_page(Instant::ZERO, 0, vec![0; 8]);
            assert_eq!(finish(&mut flash, &mut stores).1, Written::Good, "the other page is good");
            flash.repair();
            flash.write_page(Instant::ZERO, 1, vec![0; 8]);
            assert_eq!(finish(&mut flash, &mut stores).1, Written::Good);
        }
    }

    #[test]
    fn a_cut_while_programming_leaves_the_words_that_were_due() {
        let (mut flash, mut stores) = flash(0xFF);
        flash.write_page(Instant::ZERO, 0, vec![1; 8]);
        flash.power_lost(Instant::from_micros(70), &mut stores);
        assert_eq!(flash.page(0), [1, 1, 1, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF]);
        assert_eq!(flash.deadline(), None);
    }

    #[test]
    fn a_cut_while_erasing_leaves_nothing_a_zero_that_was_a_one() {
        for seed in 0..32 {
            let mut flash = Flash::new(MAP, vec![0x5A; 32], seed);
            let mut stores = VecDeque::new();
            flash.write_page(Instant::ZERO, 0, vec![0xFFFF; 8]);
            flash.power_lost(Instant::from_millis(10), &mut stores);
            assert!(flash.page(0).iter().all(|word| word & 0x5A5A == 0x5A5A), "erasing clears no bit");
            assert_eq!(flash.page(1), vec![0x5A5A; 8]);
        }
    }

    #[test]
    fn carrying_out_the_stores_gives_the_same_memory() {
        for cut_us in (0..20_400).step_by(97) {
            let (mut flash, mut stores) = flash(0x11);
            let mut copy = flash.bytes().to_vec();
            flash.write_page(Instant::ZERO, 1, (0..8).map(|n| 0x8000 | n).collect());
            flash.power_lost(Instant::from_micros(cut_us), &mut stores);
            for store in stores {
                copy[store.offset..store.offset + store.bytes.len()].copy_from_slice(&store.bytes);
            }
            assert_eq!(copy, flash.bytes(), "cut at {cut_us} µs");
        }
    }
}
