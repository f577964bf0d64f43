//! Numbers in the place of a missing process value.
//!
//! The stream of an AXRTD8CO has words for an open and a shorted sensor and for a channel that is off, but none for a failed
//! converter among process values: there it prints the number that object 7130h has then. With another scaling each of these
//! numbers is a temperature as well (errata E-C20), and only the status object 6150h knows. So they are neither a fault nor
//! a good reading.

use crate::device::Product;
use crate::wire::stream::{Reading, Source};

/// The product that does so.
const PRODUCT: &str = "AXRTD8CO";

/// What such a number stands for, unless it is a value (AXRTD8CO manual, chapter 1 and section 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandIn {
    /// The channel is off.
    Off,
    /// The sensor's circuit is open.
    Open,
    /// The sensor is shorted.
    Short,
    /// The converter or the computation has failed.
    Converter,
}

impl StandIn {
    /// Whether there are such numbers in these rows; a unit that has not said what it is is known by its channels.
    pub(super) fn are_in(source: Source, product: Option<&Product>, names: &[String]) -> bool {
        let is_one = match product {
            Some(product) => product.name == PRODUCT,
            None => Product::named(PRODUCT).is_some_and(|product| product.stream.channels == names),
        };
        is_one && source == Source::ProcessValue
    }

    /// What a reading of such rows may stand for besides a value.
    pub(super) fn of(reading: Reading) -> Option<StandIn> {
        let value = reading.value()?;
        [(-1.0, StandIn::Off), (-512.0, StandIn::Open), (-448.0, StandIn::Short), (-384.0, StandIn::Converter)]
            .into_iter()
            .find_map(|(code, stand_in)| (code == value).then_some(stand_in))
    }

    /// In a word, for a column of states: it is not known.
    pub const fn words(self) -> &'static str {
        match self {
            StandIn::Off => "off?",
            StandIn::Open => "open?",
            StandIn::Short => "short?",
            StandIn::Converter => "converter?",
        }
    }

    /// What the unit means by the number, to follow "marks".
    pub const fn meaning(self) -> &'static str {
        match self {
            StandIn::Off => "a channel that is off",
            StandIn::Open => "an open circuit",
            StandIn::Short => "a short circuit",
            StandIn::Converter => "a failed converter",
        }
    }
}
