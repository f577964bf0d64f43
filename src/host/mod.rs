//! All that touches the system: clock, ports, pseudo-terminals, terminal, files. Thin: decisions are made elsewhere.
//!
//! Threads here do nothing but wait for one thing each and put what comes on the one channel of their owner
//! ([`Input`]); the owner's loop is the only place where something is done about it. What differs between systems is
//! named in this directory and nowhere else.

pub mod address;
pub mod clock;
pub mod comeback;
pub mod journal;
pub mod library;
pub mod link;
pub mod network;
pub mod ports;
pub mod pump;
pub mod recorder;
pub mod replay;
pub mod signal;
pub mod terminal;

#[cfg(any(windows, test))]
mod duplex;
mod lines;
#[cfg(unix)]
mod serial;
pub mod socket;
#[cfg(unix)]
mod wait;

#[cfg(unix)]
pub mod pty;
#[cfg(unix)]
pub mod state;
#[cfg(unix)]
pub mod unit;

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use crate::time::Instant;
use link::LinkError;

/// What the world did, on the one channel of a program's loop.
#[derive(Debug)]
pub enum Input {
    /// Bytes came from the port.
    Bytes {
        /// When they were read.
        at: Instant,
        /// What, at least one byte.
        bytes: Vec<u8>,
    },
    /// The port is gone, and nothing more comes from this connection.
    Gone(LinkError),
    /// The process got a signal (its number).
    Signal(i32),
    /// Bytes from standard input, where it is read as such.
    Typed(Vec<u8>),
    /// Standard input has ended.
    TypedEnd,
    /// A thread of the loop's own has left something for it elsewhere.
    Wake,
}

/// Inputs that wait at most: with the reader's 4 KiB each, a quarter of a megabyte, behind which the reader stops
/// reading and the system's own flow control takes over.
pub const INPUTS: usize = 64;

/// The one channel of a program's loop.
pub fn channel() -> (SyncSender<Input>, Receiver<Input>) {
    sync_channel(INPUTS)
}
