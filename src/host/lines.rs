//! The threads of an open connection, whatever it goes through.

use std::io;

use super::socket;
use crate::time::Duration;

#[cfg(windows)]
use super::duplex as serial;
#[cfg(unix)]
use super::serial;
#[cfg(any(not(unix), test))]
use super::unit::memory;

/// What a connection reads and writes through.
#[derive(Debug)]
pub enum Lines {
    /// A serial port of this machine.
    Serial(serial::Lines),
    /// A socket.
    Socket(socket::Lines),
    /// A unit in this process, where there are no pseudo-terminals.
    #[cfg(any(not(unix), test))]
    Memory(memory::Lines),
}

impl Lines {
    /// Ends the threads: what is queued may leave for this long, then everything stops.
    pub fn close(&mut self, patience: Duration) {
        match self {
            Lines::Serial(lines) => lines.close(patience),
            Lines::Socket(lines) => lines.close(patience),
            #[cfg(any(not(unix), test))]
            Lines::Memory(lines) => lines.close(patience),
        }
    }

    /// Sends a break, where the link can do that.
    pub fn send_break(&self) -> io::Result<()> {
        match self {
            Lines::Serial(lines) => lines.send_break(),
            Lines::Socket(lines) => lines.send_break(),
            #[cfg(any(not(unix), test))]
            Lines::Memory(lines) => lines.send_break(),
        }
    }
}

impl From<serial::Lines> for Lines {
    fn from(lines: serial::Lines) -> Self {
        Lines::Serial(lines)
    }
}

impl From<socket::Lines> for Lines {
    fn from(lines: socket::Lines) -> Self {
        Lines::Socket(lines)
    }
}

#[cfg(any(not(unix), test))]
impl From<memory::Lines> for Lines {
    fn from(lines: memory::Lines) -> Self {
        Lines::Memory(lines)
    }
}
