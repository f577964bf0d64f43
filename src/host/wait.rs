//! Waiting for file descriptors, with a way to be called off.

use std::io::{self, PipeReader, PipeWriter};
use std::os::fd::{AsFd, BorrowedFd};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::time::Duration;

/// Calls off every wait on the [`Stop`] made with it, when dropped.
#[derive(Debug)]
pub struct Stopper {
    _end: PipeWriter,
}

/// The other half of a [`Stopper`].
#[derive(Debug)]
pub struct Stop {
    end: PipeReader,
}

/// A pair: dropping the first wakes the second, for ever. A pipe does it: no signal, no unsafe code, and nobody has to
/// look at a flag now and then.
pub fn stop() -> io::Result<(Stopper, Stop)> {
    let (reader, writer) = io::pipe()?;
    Ok((Stopper { _end: writer }, Stop { end: reader }))
}

impl Stop {
    /// Another handle on the same stop, for another thread.
    pub fn try_clone(&self) -> io::Result<Stop> {
        Ok(Stop { end: self.end.try_clone()? })
    }

    /// Waits this long at most; `true` if it was called off.
    pub fn wait(&self, timeout: Duration) -> bool {
        matches!(ready([(self.as_fd(), PollFlags::IN)], Some(timeout)), Ok([ready]) if !ready.is_empty())
    }
}

impl AsFd for Stop {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.end.as_fd()
    }
}

/// Waits until one of the descriptors is ready for what is asked of it (hang-up and errors count as ready) or the time
/// is over, and says what each is ready for. A signal ends the wait early with nothing ready.
pub fn ready<const N: usize>(
    fds: [(BorrowedFd<'_>, PollFlags); N],
    timeout: Option<Duration>,
) -> io::Result<[PollFlags; N]> {
    let mut polled = fds.map(|(fd, flags)| PollFd::from_borrowed_fd(fd, flags));
    let timeout = timeout.map(|timeout| Timespec {
        tv_sec: i64::try_from(timeout.as_secs()).unwrap_or(i64::MAX),
        tv_nsec: timeout.subsec_nanos().into(),
    });
    match poll(&mut polled, timeout.as_ref()) {
        Ok(_) => Ok(polled.map(|fd| fd.revents())),
        Err(rustix::io::Errno::INTR) => Ok([PollFlags::empty(); N]),
        Err(error) => Err(error.into()),
    }
}
