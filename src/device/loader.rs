//! The serial bootloaders a unit may have, as profiles.
//!
//! Which one a real unit runs is not known; three generations of the Freescale S-record loader for 16-bit 56F8xx parts
//! are public facts, and a product's file says which one is believed. Both ends use this page: the emulated loader
//! behaves as its profile says, the console sends as the profile wants.

use serde::Deserialize;

/// Which generation of loader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoaderKind {
    /// SDK, 2000-2004: one page buffer, one parked record, XOFF when the data crosses into another page.
    G1,
    /// Circular buffer, 2005 and later: XOFF behind every record.
    G3,
}

impl LoaderKind {
    /// All kinds, for the command line.
    pub const ALL: [LoaderKind; 2] = [LoaderKind::G1, LoaderKind::G3];

    /// The name the command line and the product files use.
    pub const fn name(self) -> &'static str {
        match self {
            LoaderKind::G1 => "g1",
            LoaderKind::G3 => "g3",
        }
    }
}
