//! The end of the cable at which an emulated unit hangs.

use std::fmt;
use std::io;
use std::path::Path;

use crate::time::Duration;

/// What the thread of a unit reads from, writes to and sleeps on.
pub(in crate::host) trait UnitPort: Send + 'static {
    /// What a client opens.
    fn path(&self) -> &Path;
    /// Clients that came and went since the last question, oldest first.
    fn visits(&self) -> io::Result<Vec<Visit>>;
    /// Whether anybody has the port open, as far as the system tells.
    fn is_attended(&self) -> bool;
    /// What the client has set.
    fn client_settings(&self) -> io::Result<ClientSettings>;
    /// Takes what the client has sent, without waiting: no bytes if there are none.
    fn read(&self, buffer: &mut [u8]) -> io::Result<usize>;
    /// Gives bytes to the client, without waiting: those that find no room are not taken.
    fn write(&self, bytes: &[u8]) -> io::Result<usize>;
    /// Bytes that the client has not read yet.
    fn unread(&self) -> u64;
    /// Makes the port ready for the next client.
    fn reset(&self) -> io::Result<()>;
    /// Pulls the cable: the client is hung up on, and from now on this is another port.
    fn pull(&mut self) -> io::Result<()>;
    /// Sleeps until something happens, or the time is over. Bytes that wait wake only where they are wanted.
    fn wait(&mut self, wants_bytes: bool, timeout: Option<Duration>) -> io::Result<Woken>;
}

/// Wakes the thread of a unit; dropped, it says that the unit is over.
pub(in crate::host) trait Bell: fmt::Debug + Send + Sync {
    /// There is something to do. `false` if nobody hears it any more.
    fn ring(&self) -> bool;
}

/// What ended a sleep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::host) enum Woken {
    /// The line, or the time.
    Line,
    /// The bell.
    Bell,
    /// The bell is gone.
    End,
}

/// What the client has set on its side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientSettings {
    /// Line rate in baud; 0 means hung up.
    pub baud: u32,
    /// Whether the client's output stops at XOFF.
    pub obeys_xoff: bool,
}

/// What a client did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Somebody opened the port.
    Opened,
    /// Somebody closed it.
    Closed,
}
