//! The loaders a unit may have in its boot flash: they take an S-record file and write it to program flash.
//!
//! Three generations with one interface: two that keep a page and write it when the next one begins ([`paged`], g1 and
//! g2), and one with a ring of characters ([`g3`]). A loader lives in flash of its own: no file can damage it. It knows
//! nothing of what it loads: success means that the end record has come. Which program runs after the reset is decided by
//! the unit (`emulator/mod.rs`).
//!
//! What the manual quotes of a product's loader comes from the product's file and wins over what the public loaders
//! print. No dialect touches these texts.

mod g3;
mod paged;
mod voice;

use super::Board;
use super::memory::Flash;
use crate::device::LoaderKind;
use crate::time::Instant;

/// The loader while it runs.
#[derive(Debug)]
pub enum Bootloader {
    /// The SDK's, and its successor.
    Paged(paged::Loader),
    /// The one with a circular buffer.
    G3(g3::Loader),
}

impl Bootloader {
    /// Starts the loader: it says what it is and what it wants. `may_leave` says that there is an application it could
    /// start instead.
    pub fn start(kind: LoaderKind, board: &mut Board<'_>, may_leave: bool) -> Self {
        match kind {
            LoaderKind::G1 => Bootloader::Paged(paged::Loader::start(&paged::G1, board)),
            LoaderKind::G2 => Bootloader::Paged(paged::Loader::start(&paged::G2, board)),
            LoaderKind::G3 => Bootloader::G3(g3::Loader::start(g3::Version::V2_0, board, may_leave)),
            LoaderKind::G3Early => Bootloader::G3(g3::Loader::start(g3::Version::V1_3, board, may_leave)),
        }
    }

    /// A character has come.
    pub fn receive(&mut self, board: &mut Board<'_>, character: u8) {
        match self {
            Bootloader::Paged(loader) => loader.receive(board, character),
            Bootloader::G3(loader) => loader.receive(board, character),
        }
    }

    /// A character has come that the receiver could not read.
    pub fn receive_garbage(&mut self, board: &mut Board<'_>) {
        match self {
            Bootloader::Paged(loader) => loader.receive_garbage(board),
            Bootloader::G3(loader) => loader.receive_garbage(board),
        }
    }

    /// When something is due.
    pub fn deadline(&self, flash: &Flash) -> Option<Instant> {
        match self {
            Bootloader::Paged(loader) => loader.deadline(flash),
            Bootloader::G3(loader) => loader.deadline(flash),
        }
    }

    /// Does what is due.
    pub fn step(&mut self, board: &mut Board<'_>) {
        match self {
            Bootloader::Paged(loader) => loader.step(board),
            Bootloader::G3(loader) => loader.step(board),
        }
    }

    /// Whether the sender is stopped.
    pub fn holds_sender(&self) -> bool {
        match self {
            Bootloader::Paged(loader) => loader.holds_sender(),
            Bootloader::G3(loader) => loader.holds_sender(),
        }
    }
}
