//! The program's own end of a link, without the rest of the program.

use std::sync::mpsc::Receiver;

use axcon::host::clock::Clock;
use axcon::host::link::{Connection, LinkSpec, Options};
use axcon::host::{Input, channel};

use super::shell::PATIENCE;

/// An open link, and what comes over it.
pub fn connected(spec: &LinkSpec, baud: u32) -> (Connection, Receiver<Input>) {
    let (inputs, received) = channel();
    (Connection::open(spec, Options { baud }, Clock::start(), inputs).expect("opened"), received)
}

/// Bytes from the link until there are this many.
pub fn receive(received: &Receiver<Input>, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        match received.recv_timeout(PATIENCE).expect("more bytes") {
            Input::Bytes { bytes: more, .. } => bytes.extend(more),
            other => panic!("{other:?} after {:?}", bytes.escape_ascii().to_string()),
        }
    }
    bytes
}
