//! The serial bootloaders a unit may have, as profiles.
//!
//! Which one a real unit runs is not known; three generations of the Freescale S-record loader for 16-bit 56F8xx parts
//! are public facts, and a product's file says which one is assumed. Both ends use this page: the emulated loader
//! behaves as its profile says, the console sends as the profile wants.

use serde::Deserialize;

use super::BAUD;
use crate::image::{FlashMap, Outside};
use crate::time::{BITS_PER_CHARACTER, Duration};

/// Which generation of loader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoaderKind {
    /// SDK, 2000-2004: one page buffer, one parked record, XOFF when the data crosses into another page.
    G1,
    /// 56F83xx generation: known by its texts and error numbers. How it stops its sender is not known; it is assumed to
    /// do so like [`G1`](LoaderKind::G1), with which it shares prompt, dots and errors (a guess).
    G2,
    /// Circular buffer, 2005 and later: XOFF after every record.
    G3,
    /// The same up to version 1.3: it takes the checksum of a record with an odd number of data bytes as data, and waits
    /// for ever. The console sends whole words to every loader, so it treats both alike.
    #[serde(rename = "g3-1.3")]
    G3Early,
}

impl LoaderKind {
    /// All kinds, for the command line.
    pub const ALL: [LoaderKind; 4] = [LoaderKind::G1, LoaderKind::G2, LoaderKind::G3, LoaderKind::G3Early];

    /// The name the command line and the product files use.
    pub const fn name(self) -> &'static str {
        match self {
            LoaderKind::G1 => "g1",
            LoaderKind::G2 => "g2",
            LoaderKind::G3 => "g3",
            LoaderKind::G3Early => "g3-1.3",
        }
    }

    /// What it does with data outside of the program flash.
    pub const fn outside(self) -> Outside {
        match self {
            LoaderKind::G1 | LoaderKind::G2 => Outside::Folds,
            LoaderKind::G3 | LoaderKind::G3Early => Outside::Refuses,
        }
    }

    /// How it stops and releases its sender.
    pub const fn pacing(self) -> Pacing {
        match self {
            LoaderKind::G1 | LoaderKind::G2 => Pacing::Pages,
            LoaderKind::G3 | LoaderKind::G3Early => Pacing::Records,
        }
    }
}

/// How a loader stops and releases its sender: what XOFF and XON prove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pacing {
    /// XOFF when the data crosses into another page, XON when the old page is written. One more record may be on its
    /// way, no second one.
    Pages,
    /// XOFF after every record, XON when the receive ring is empty: each pair says that a record has been taken. S0
    /// erases all of the program flash before its XON. Nothing counts what is in the ring of [`RING`] characters.
    Records,
}

/// Characters a G3 loader's receive ring holds; one more overwrites the first ("about 550": public sources).
pub const RING: usize = 550;

/// Erasing one page or sector (public data sheet of the 56F83xx, likely the part).
pub const ERASE_TIME: Duration = Duration::from_millis(20);

/// Words a G3 loader erases together: a sector of the 56F8367's interleaved program flash (likely). 512 KByte take 10.2 s.
pub const SECTOR_WORDS: u32 = 512;

/// Programming one word (public data sheet of the 56F83xx, likely the part).
pub const PROGRAM_TIME: Duration = Duration::from_micros(20);

/// How long this many characters take on the units' line, one directly after the other.
pub fn line_time(characters: u64) -> Duration {
    Duration::from_secs_f64(characters as f64 * f64::from(BITS_PER_CHARACTER) / f64::from(BAUD))
}

/// How long an image of this many characters with this many bytes of data takes, from its first record to its last: the
/// line, and what the loader of the unit does besides. One that stops for pages erases and programs one after the other
/// while the line is idle; one that stops for records erases all of the flash after the header, whatever the image's size,
/// and programs while characters come. An estimate, for plans only.
pub fn transfer_time(characters: u64, data_bytes: u64, unit: Option<(LoaderKind, &FlashMap)>) -> Duration {
    let line = line_time(characters);
    match unit {
        Some((loader, flash)) if loader.pacing() == Pacing::Records => {
            line + ERASE_TIME * flash.program_words.div_ceil(SECTOR_WORDS)
        }
        _ => {
            let page_words = unit.map_or(SMALLEST_PAGE_WORDS, |(_, flash)| flash.page_words);
            let pages = data_bytes.div_ceil(2 * u64::from(page_words));
            line + (ERASE_TIME + PROGRAM_TIME * page_words) * u32::try_from(pages).unwrap_or(u32::MAX)
        }
    }
}

/// Words of the smallest page any part of the family has.
const SMALLEST_PAGE_WORDS: u32 = 256;

/// The longest that erasing all of the program flash can take: page by page, with the smallest pages any part of the
/// family has. A part with larger sectors, or one that erases in bulk, is quicker.
pub fn longest_erase(flash: &FlashMap) -> Duration {
    ERASE_TIME * flash.program_words.div_ceil(SMALLEST_PAGE_WORDS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::AddressUnit;

    #[test]
    fn a_plan_counts_what_each_loader_does_besides_the_line() {
        let flash = FlashMap { address_unit: AddressUnit::Word, program_words: 0x40000, page_words: 256 };
        let seconds = |unit| transfer_time(11_520, 5_120, unit).as_secs_f64();
        let of = |kind| seconds(Some((kind, &flash)));
        // Ten pages, each erased and programmed; or 512 sectors, however small the image is.
        for paged in [seconds(None), of(LoaderKind::G1), of(LoaderKind::G2)] {
            assert!((paged - 1.2512).abs() < 1e-6, "{paged}");
        }
        for whole in [of(LoaderKind::G3), of(LoaderKind::G3Early)] {
            assert!((whole - 11.24).abs() < 1e-6, "{whole}");
        }
        // Five larger pages: half the time for erasing.
        let larger = FlashMap { page_words: 512, ..flash };
        let five = seconds(Some((LoaderKind::G1, &larger)));
        assert!((five - 1.1512).abs() < 1e-6, "{five}");
    }

    #[test]
    fn erasing_half_a_megabyte_page_by_page_takes_twenty_seconds() {
        for page_words in [256, 512] {
            let flash = FlashMap { address_unit: AddressUnit::Word, program_words: 0x40000, page_words };
            assert_eq!(longest_erase(&flash), Duration::from_millis(20_480), "the part may have smaller ones");
        }
    }
}
