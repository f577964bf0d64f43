//! The device's end of the cable: an emulated unit as a machine without clock, thread or file.

pub mod cable;

use crate::device::{LoaderKind, Product};
use crate::endpoint::{Endpoint, Transmit};
use crate::time::Instant;

/// What a unit is made of before power comes.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Which product.
    pub product: &'static Product,
    /// Which bootloader is in its boot flash.
    pub loader: LoaderKind,
    /// Decides everything that chance decides: noise, the simulated process, serial number.
    pub seed: u64,
    /// Program flash, bytes in S-record order; as long as the product's flash, FFh where erased.
    pub flash: Vec<u8>,
    /// Non-volatile memory as [`Unit::parameters`] gave it; empty for a unit fresh from the factory.
    pub parameters: Vec<u8>,
}

/// A write to memory that outlives the power, for the host to carry out in the order given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Store {
    /// Which memory.
    pub area: Area,
    /// Byte offset.
    pub offset: usize,
    /// What lies there now.
    pub bytes: Vec<u8>,
}

/// Memory that outlives the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Program flash.
    Flash,
    /// Non-volatile parameters.
    Parameters,
}

/// An emulated unit. As an [`Endpoint`] it is the unit's RS-232 port.
#[derive(Debug)]
pub struct Unit {
    setup: Setup,
}

impl Unit {
    /// A unit without power.
    ///
    /// # Panics
    /// If the flash is not as long as the product's.
    pub fn new(setup: Setup) -> Self {
        Unit { setup }
    }

    /// Supply voltage comes: the unit starts. Nothing happens if it is on.
    pub fn power_on(&mut self, _now: Instant) {}

    /// Supply voltage goes: everything but flash and parameters is lost, in the middle of a word if need be.
    pub fn power_off(&mut self, _now: Instant) {}

    /// Program flash, bytes in S-record order.
    pub fn flash(&self) -> &[u8] {
        &self.setup.flash
    }

    /// Non-volatile parameters, as [`Setup::parameters`] takes them.
    pub fn parameters(&self) -> &[u8] {
        &self.setup.parameters
    }

    /// The next write to memory that outlives the power.
    pub fn poll_store(&mut self) -> Option<Store> {
        None
    }

    /// Whether the unit has sent XOFF and not yet XON.
    pub fn holds_sender(&self) -> bool {
        false
    }
}

impl Endpoint for Unit {
    fn handle_bytes(&mut self, _now: Instant, _bytes: &[u8]) {}
    fn handle_timeout(&mut self, _now: Instant) {}
    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}
