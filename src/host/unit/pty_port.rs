//! An emulated unit on a pseudo-terminal.

use std::io::{self, PipeReader, PipeWriter, Read, Write};
use std::os::fd::AsFd;
use std::path::Path;

use rustix::event::PollFlags;

use super::port::{Bell, ClientSettings, UnitPort, Visit, Woken};
use super::{BAUD, ORDERS};
use crate::host::ports;
use crate::host::pty::Pty;
use crate::host::wait::ready;
use crate::time::Duration;

/// A pseudo-terminal, and a pipe that rings: a byte on it says that there is an order, its end that it is over.
#[derive(Debug)]
pub(super) struct PtyPort {
    pty: Pty,
    ring: PipeReader,
}

impl PtyPort {
    /// A new pseudo-terminal, and the bell of its unit.
    pub(super) fn open() -> io::Result<(Self, PipeWriter)> {
        let (ring, bell) = io::pipe()?;
        Ok((PtyPort { pty: Pty::open(BAUD)?, ring }, bell))
    }
}

impl Bell for PipeWriter {
    fn ring(&self) -> bool {
        let mut writer = self;
        writer.write_all(&[1]).is_ok()
    }
}

impl UnitPort for PtyPort {
    fn path(&self) -> &Path {
        self.pty.path()
    }

    fn visits(&self) -> io::Result<Vec<Visit>> {
        self.pty.visits()
    }

    fn is_attended(&self) -> bool {
        ports::holder(self.pty.path()).is_some()
    }

    fn client_settings(&self) -> io::Result<ClientSettings> {
        self.pty.client_settings()
    }

    fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        self.pty.read(buffer)
    }

    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        self.pty.write(bytes)
    }

    fn unread(&self) -> u64 {
        self.pty.unread()
    }

    fn reset(&self) -> io::Result<()> {
        self.pty.reset()
    }

    fn pull(&mut self) -> io::Result<()> {
        // The new one is there before the old one goes, so it cannot get its name: a client that opens that finds no port.
        self.pty = Pty::open(BAUD)?;
        Ok(())
    }

    fn wait(&mut self, wants_bytes: bool, timeout: Option<Duration>) -> io::Result<Woken> {
        let input = if wants_bytes { PollFlags::IN } else { PollFlags::empty() };
        let fds =
            [(self.pty.as_fd(), input), (self.pty.visits_fd(), PollFlags::IN), (self.ring.as_fd(), PollFlags::IN)];
        let [_, _, rung] = ready(fds, timeout)?;
        if rung.is_empty() {
            return Ok(Woken::Line);
        }
        let mut rings = [0; ORDERS];
        Ok(if matches!(self.ring.read(&mut rings), Ok(0)) { Woken::End } else { Woken::Bell })
    }
}
