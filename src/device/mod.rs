//! What is known about the products: one data file for each, taken from its manual.
//!
//! Shared by both ends of the cable, so it holds only what a manual (or a public fact) says, never what one side does
//! about it. What is not known is left out here and treated as unknown there.

mod complaint;
pub mod dictionary;
pub mod eds;
pub mod emergency;
mod loader;
pub mod schema;

pub use complaint::{Complaint, Complaints};
pub use dictionary::Dictionary;
pub use loader::{
    ERASE_TIME, LoaderKind, PROGRAM_TIME, Pacing, RING, SECTOR_WORDS, line_time, longest_erase, transfer_time,
};

use std::sync::OnceLock;

use serde::Deserialize;

use crate::image::{AddressRange, FlashMap, Target};
use crate::version::Version;
use crate::wire::stream;

/// One product, as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Product {
    /// Part number, e.g. `AXTC4CO`; what banners and identity blocks print.
    pub name: String,
    /// What it is, in words.
    pub title: String,
    /// Number of the manual.
    pub manual: String,
    /// Identity and factory settings on the CAN side.
    pub can: Can,
    /// How the serial cable is wired.
    pub cable: Cable,
    /// Texts the manual quotes.
    pub console: Console,
    /// Rows of the data stream.
    pub stream: stream::Layout,
    /// How it measures.
    pub measurement: Measurement,
    /// Program flash.
    pub flash: FlashMap,
    /// The flash of its bootloader.
    pub boot_flash: BootFlash,
    /// The bootloader.
    pub loader: Loader,
    /// The object dictionary.
    pub dictionary: Dictionary,
}

/// Identity and factory settings on the CAN side.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Can {
    /// Vendor, object 1018h sub-index 1.
    pub vendor_id: u32,
    /// Product code, object 1018h sub-index 2.
    pub product_code: u32,
    /// Factory node-ID.
    pub node_id: u8,
    /// Factory bit rate in kbit/s.
    pub kbps: u16,
}

/// How the serial cable is wired.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cable {
    /// Which of the unit's connectors.
    pub connector: String,
    /// The unit transmits.
    pub transmit: Pin,
    /// The unit receives.
    pub receive: Pin,
    /// Ground.
    pub ground: Pin,
}

/// One wire: a pin of the unit's connector and one of the DB-9.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// Pin of the unit's connector.
    pub unit: u8,
    /// Pin of the DB-9 plug.
    pub db9: u8,
}

/// Texts the manual quotes. A unit's other words are unknown.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Console {
    /// What confirms restoring the defaults.
    pub defaults_answer: String,
    /// What the bootloader prints when it wants a file.
    pub loader_prompt: String,
    /// What the bootloader prints when it has taken a file.
    pub loaded: Option<String>,
    /// What the new software prints when it runs for the first time.
    pub first_start: Option<String>,
}

/// How a product measures.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// What is connected to its inputs.
    pub sensors: SensorKind,
    /// Number of inputs.
    pub channels: u8,
    /// From power-up to the first values, in ms; it is not operational before either.
    pub first_data_ms: u16,
    /// What becomes of an NMT start in that time.
    pub early_start: EarlyStart,
    /// Shortest and longest repetition time of the stream in ms.
    pub stream_period_ms: (u16, u16),
}

/// What is connected to a product's inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorKind {
    /// Thermocouples, with a cold junction in the unit.
    Thermocouple,
    /// Resistance temperature detectors with 2, 3 or 4 wires.
    Rtd,
}

/// What becomes of an NMT start that comes before the first values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EarlyStart {
    /// It is carried out when the values are there.
    Deferred,
    /// It is lost.
    Ignored,
}

/// The flash in which the bootloader lives; nothing can be loaded there. Addresses are those of the program flash.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BootFlash {
    /// Its first address.
    pub start: u32,
    /// Its size in addresses.
    pub words: u32,
}

/// The bootloader.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Loader {
    /// The kind that is assumed to be in the unit.
    pub kind: LoaderKind,
    /// Whether it waits for any key before it wants the file.
    pub asks_for_key: bool,
    /// What it prints now and then while it takes the file.
    pub progress: char,
    /// Version of the program that emulated units leave the factory with.
    pub factory_version: Version,
    /// How upload files are named, `{version}` standing for the version.
    pub file_name: String,
}

/// Line rate of the service port, in baud (AXTC4CO manual, appendix A).
pub const BAUD: u32 = 115_200;

/// Highest node-ID (CiA 301); the lowest is 1.
pub const HIGHEST_NODE_ID: u8 = 127;

/// Bit rates on the CAN side that LSS can set, in kbit/s (manuals, section 3.1.2).
pub const BIT_RATES_KBPS: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

impl Product {
    /// All products, in a fixed order.
    ///
    /// # Panics
    /// If a file built into the program is wrong, which a test excludes.
    pub fn all() -> &'static [Product] {
        static ALL: OnceLock<Vec<Product>> = OnceLock::new();
        ALL.get_or_init(|| {
            FILES
                .iter()
                .map(|(name, text)| {
                    schema::read(name, text).unwrap_or_else(|complaints| panic!("{}", Complaint::list(&complaints)))
                })
                .collect()
        })
    }

    /// The product of this name, in any case.
    pub fn named(name: &str) -> Option<&'static Product> {
        Product::all().iter().find(|product| product.name.eq_ignore_ascii_case(name))
    }

    /// The layout of rows with this many channels: by them a unit is known that has not said what it is.
    pub fn layout_with(channels: usize) -> Option<&'static stream::Layout> {
        Product::all().iter().map(|product| &product.stream).find(|layout| layout.channels.len() == channels)
    }

    /// What the check of an image needs to know of this product.
    pub fn target(&self) -> Target {
        let BootFlash { start, words } = self.boot_flash;
        Target {
            product: self.name.clone(),
            flash: self.flash,
            file_name: self.loader.file_name.clone(),
            boot: Some(AddressRange { start: start.into(), end: u64::from(start) + u64::from(words) }),
            outside: self.loader.kind.outside(),
        }
    }

    /// The same with another loader than the product is assumed to have.
    pub fn target_with(&self, loader: LoaderKind) -> Target {
        Target { outside: loader.outside(), ..self.target() }
    }

    /// What the upload file of a version is called.
    pub fn file_name(&self, version: Version) -> String {
        self.loader.file_name.replace("{version}", &version.to_string())
    }
}

const FILES: [(&str, &str); 2] =
    [("axtc4co.toml", include_str!("axtc4co.toml")), ("axrtd8co.toml", include_str!("axrtd8co.toml"))];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Prompt, Vocabulary};

    #[test]
    fn every_product_file_is_sound() {
        for (file, text) in FILES {
            let product =
                schema::read(file, text).unwrap_or_else(|complaints| panic!("{}", Complaint::list(&complaints)));
            assert_eq!(file, format!("{}.toml", product.name.to_lowercase()));
            for (at, object, entry) in product.dictionary.entries() {
                assert!(!object.name.is_empty() && !entry.name.is_empty(), "{file}: {at} has no name");
                assert!(entry.mappable || entry.default.is_some() || at.index < 0x3000, "{file}: {at} has no value");
            }
        }
    }

    #[test]
    fn dictionaries_are_as_large_as_the_manuals_tables() {
        // B-002, B-6: as the errata resolve them.
        for (name, objects, entries) in [("AXTC4CO", 55, 227), ("AXRTD8CO", 56, 326)] {
            let dictionary = &Product::named(name).expect("built in").dictionary;
            assert_eq!((dictionary.objects().len(), dictionary.entries().count()), (objects, entries), "{name}");
        }
    }

    #[test]
    fn names_are_found_in_any_case() {
        assert_eq!(Product::named("axtc4co").map(|product| product.can.product_code), Some(0x0001_0114));
        assert_eq!(Product::named("AXTC4"), None);
    }

    #[test]
    fn a_question_is_known_before_a_row_that_follows_it() {
        let products = Product::all();
        let vocabulary = Vocabulary {
            products: products.iter().map(|product| product.name.as_str()).collect(),
            layouts: products.iter().map(|product| &product.stream).collect(),
        };
        let table = [
            ("Password:   23.500;Disabled;OpenCct ;  25.000; 100.125", Some((Some(Prompt::Password), 10))),
            ("Password:     23.500;  24.000;  24.000;  25.000; 100.125", Some((Some(Prompt::Password), 12))),
            ("Enter Yes:  21.5; 21.5; 21.5; 21.5;Null ; 21.5; 21.5;Open", Some((Some(Prompt::ConfirmDefaults), 11))),
            ("  23.500;  24.000;  24.000;  25.000; 100.125", None),
            ("Selection:   23.500;  24.000;  24.000;  25.000; 100.125", Some((None, 11))),
            ("> 23.500;  24.000;  24.000;  25.000; 100.125", None),
            ("Password:   23.500;  24.000;  24.000", None),
            ("Password: ", None),
        ];
        for (line, expected) in table {
            assert_eq!(vocabulary.before_row(line), expected, "{line:?}");
        }
    }
}
