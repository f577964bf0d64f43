//! Waiting for file descriptors, with a way to be called off.

use std::io::{self, PipeReader, PipeWriter};
use std::os::fd::{AsFd, BorrowedFd};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::clock::Clock;
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
/// is over, and says what each is ready for: nothing is ready only if all of the time is over.
pub fn ready<const N: usize>(
    fds: [(BorrowedFd<'_>, PollFlags); N],
    timeout: Option<Duration>,
) -> io::Result<[PollFlags; N]> {
    let mut polled = fds.map(|(fd, flags)| PollFd::from_borrowed_fd(fd, flags));
    despite_signals(timeout, |left| poll(&mut polled, left.map(timespec).as_ref()))?;
    Ok(polled.map(|fd| fd.revents()))
}

fn timespec(time: Duration) -> Timespec {
    Timespec { tv_sec: i64::try_from(time.as_secs()).unwrap_or(i64::MAX), tv_nsec: time.subsec_nanos().into() }
}

/// Waits again after each signal, for what is left of the time.
fn despite_signals<T>(
    timeout: Option<Duration>,
    mut wait: impl FnMut(Option<Duration>) -> rustix::io::Result<T>,
) -> io::Result<T> {
    let begun = Clock::start();
    loop {
        match wait(timeout.map(|timeout| timeout.saturating_sub(begun.now().since_start()))) {
            Err(Errno::INTR) => {}
            waited => return waited.map_err(io::Error::from),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_does_not_end_a_wait_and_does_not_make_it_longer() {
        for timeout in [Some(Duration::from_secs(5)), Some(Duration::ZERO), None] {
            let mut waits = Vec::new();
            let waited = despite_signals(timeout, |left| {
                waits.push(left);
                if waits.len() < 3 { Err(Errno::INTR) } else { Ok("ready") }
            });
            assert_eq!(waited.ok(), Some("ready"));
            assert_eq!(waits.len(), 3);
            assert!(waits.iter().all(|&left| left <= timeout && left.is_some() == timeout.is_some()), "{waits:?}");
        }
    }
}
