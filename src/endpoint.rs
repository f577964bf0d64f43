//! What both ends of the cable are: a machine that takes bytes and the time, and gives bytes and a deadline.
//!
//! The contract: one input (bytes, a timeout, or a command of the machine's own), then drain
//! [`poll_transmit`](Endpoint::poll_transmit) and the machine's own news, then ask
//! [`poll_timeout`](Endpoint::poll_timeout) when to come back. Time never runs backward. Calling early, or more often
//! than needed, is harmless.

use crate::time::Instant;

/// One end of the cable.
pub trait Endpoint {
    /// Bytes have arrived, all of them at `now`.
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]);

    /// Bytes arrived in these pieces, in this order, and are looked at `now`: nobody was there earlier. Each is dated at
    /// its own moment, what follows from it begins now, and nothing that was due meanwhile happens before all of them.
    fn handle_backlog(&mut self, now: Instant, backlog: &[Arrived]) {
        for piece in backlog {
            self.handle_bytes(now, &piece.bytes);
        }
    }

    /// The time is `now`; what was due by then happens.
    fn handle_timeout(&mut self, now: Instant);

    /// The next bytes to put on the line, if there are any.
    fn poll_transmit(&mut self) -> Option<Transmit>;

    /// When [`handle_timeout`](Endpoint::handle_timeout) is wanted next. `None`: only bytes or a command can bring news.
    fn poll_timeout(&self) -> Option<Instant>;
}

/// Bytes that arrived together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// When.
    pub at: Instant,
    /// At least one byte.
    pub bytes: Vec<u8>,
}

/// Bytes for the line.
#[derive(Clone, PartialEq, Eq)]
pub struct Transmit {
    /// What to send, at least one byte.
    pub bytes: Vec<u8>,
    /// Whether the bytes may be shown and recorded.
    pub secrecy: Secrecy,
}

/// Whether bytes may be shown and recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Secrecy {
    /// Anybody may see them.
    Open,
    /// They hold the password, or may echo it: their place and number is recorded, their content nowhere.
    Secret,
}

impl Transmit {
    /// Bytes that anybody may see.
    pub fn open(bytes: impl Into<Vec<u8>>) -> Self {
        Transmit { bytes: bytes.into(), secrecy: Secrecy::Open }
    }
}

impl std::fmt::Debug for Transmit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.secrecy {
            Secrecy::Open => write!(f, "Transmit({})", self.bytes.escape_ascii()),
            Secrecy::Secret => write!(f, "Transmit({} secret bytes)", self.bytes.len()),
        }
    }
}
