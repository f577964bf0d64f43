//! Where a loader that keeps one page stops its sender.
//!
//! How many words a page has is assumed from the product's file: no manual says it, and the parts that may be in these
//! units have pages of other sizes. As long as the loader stops us where it should, the assumption holds, and a hold is
//! awaited only after records that cross into another page. As soon as the loader does not stop us there, or stops us
//! elsewhere, a hold is awaited after every record until one page size explains all that was seen. If none does, that
//! goes on to the end of the file, slowly but safely.

use std::ops::RangeInclusive;

/// Sizes a page may have, in words: those of the parts of this kind, and some to spare on either side.
const SIZES: [u32; 6] = [64, 128, 256, 512, 1024, 2048];

/// Holds that a size has to explain before it counts as known.
const PROOF: u32 = 2;

/// What is known of the pages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Pages {
    /// This many words each.
    Words(u32),
    /// Not known yet: the sizes that explain what was seen so far, and how many holds that was.
    Watched { possible: Vec<u32>, holds: u32 },
    /// The loader never stops its sender, so its page size does not show.
    Unheld,
}

impl Pages {
    /// Nothing is known.
    pub(super) fn watched() -> Self {
        Pages::Watched { possible: SIZES.to_vec(), holds: 0 }
    }

    /// Whether the loader may stop us after a record of these words; `before` is the last word before them. `believed`:
    /// words of a page as assumed, used for a loader that never stops us.
    pub(super) fn may_hold(&self, believed: u32, before: Option<u32>, words: &RangeInclusive<u32>) -> bool {
        match self {
            Pages::Words(size) => crosses(*size, before, words),
            Pages::Watched { .. } => true,
            Pages::Unheld => crosses(believed, before, words),
        }
    }

    /// Notes whether the loader has stopped us (`held`) after a record that was alone on its way.
    pub(super) fn seen(&mut self, before: Option<u32>, words: &RangeInclusive<u32>, held: bool) {
        let Pages::Watched { possible, holds } = self else { return };
        possible.retain(|&size| crosses(size, before, words) == held);
        *holds += u32::from(held);
        if let &[size] = possible.as_slice()
            && *holds >= PROOF
        {
            *self = Pages::Words(size);
        } else if possible.is_empty() && *holds == 0 {
            *self = Pages::Unheld;
        }
    }
}

/// Whether, with pages of this many words, a record begins in another page than the data before it ended in, or goes on
/// into another.
fn crosses(size: u32, before: Option<u32>, words: &RangeInclusive<u32>) -> bool {
    let page = |word: u32| word / size.max(1);
    page(*words.start()) != page(*words.end()) || before.is_some_and(|before| page(before) != page(*words.start()))
}

/// Whether these records stay within one page, whatever its size.
pub(super) fn fit_any_page<'a>(records: impl Iterator<Item = &'a RangeInclusive<u32>>) -> bool {
    let mut before = None;
    for words in records {
        if crosses(SIZES[0], before, words) {
            return false;
        }
        before = Some(*words.end());
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records of 16 words from 0 on, held as a loader with pages of this size does.
    fn watch(size: u32, records: u32) -> (Pages, u32) {
        let mut pages = Pages::watched();
        let mut before = None;
        let mut watched = 0;
        for number in 0..records {
            let words = number * 16..=number * 16 + 15;
            watched += u32::from(matches!(pages, Pages::Watched { .. }));
            pages.seen(before, &words, crosses(size, before, &words));
            before = Some(*words.end());
        }
        (pages, watched)
    }

    #[test]
    fn a_record_that_leaves_its_page_crosses_wherever_in_it_that_is() {
        let cases = [
            (None, 0..=124, false),
            (Some(124), 125..=249, false),
            (Some(249), 250..=374, true),
            (Some(374), 375..=499, false),
            (Some(499), 512..=516, true),
            (Some(300), 20..=30, true),
        ];
        for (before, words, expected) in cases {
            assert_eq!(Pages::Words(256).may_hold(64, before, &words), expected, "{words:?}");
        }
    }

    #[test]
    fn two_holds_are_enough_to_know_the_size() {
        for size in SIZES {
            let (pages, watched) = watch(size, 400);
            assert_eq!(pages, Pages::Words(size));
            assert!(watched <= 2 * size / 16 + 2, "{size}: {watched}");
        }
    }

    #[test]
    fn what_no_size_explains_is_watched_for_ever() {
        let mut pages = Pages::watched();
        for number in 0..100u32 {
            pages.seen(Some(number * 16), &(number * 16 + 1..=number * 16 + 16), number % 7 == 3);
        }
        assert_eq!(pages, Pages::Watched { possible: Vec::new(), holds: 14 });
        assert!(pages.may_hold(256, Some(1), &(2..=3)));
    }

    #[test]
    fn a_loader_that_stops_nobody_is_not_watched_for_ever() {
        let mut pages = Pages::watched();
        let mut watched = 0;
        for number in 0..200 {
            watched += u32::from(pages != Pages::Unheld);
            pages.seen(Some(number * 16), &(number * 16 + 1..=number * 16 + 16), false);
        }
        assert_eq!((pages, watched), (Pages::Unheld, 2048 / 16));
    }

    #[test]
    fn the_first_words_of_any_page_are_no_reason_to_be_stopped() {
        assert!(fit_any_page([0..=15, 16..=31, 32..=47, 48..=63].iter()));
        assert!(!fit_any_page([0..=15, 16..=31, 32..=47, 48..=63, 64..=79].iter()));
        assert!(!fit_any_page(std::iter::once(&(0..=124))), "a packed record");
    }
}
