//! The only clock. It is asked once for each input and each wake-up; everything else is told.

use jiff::Timestamp;

use crate::time::{Duration, Instant};

/// A clock that counts from the moment it was started.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: std::time::Instant,
}

impl Clock {
    /// Starts counting.
    pub fn start() -> Self {
        Clock { start: std::time::Instant::now() }
    }

    /// The time since the start. Never runs backward.
    pub fn now(&self) -> Instant {
        Instant::ZERO + self.start.elapsed()
    }

    /// How long it is until `at`, zero if that is over.
    pub fn until(&self, at: Instant) -> Duration {
        at.since(self.now())
    }

    /// What the calendar said at a moment of this clock, in UTC. Asked from the system's clock as it is set now, so a
    /// corrected clock corrects the past as well.
    pub fn wall(&self, at: Instant) -> Timestamp {
        let ago = self.now().since(at);
        Timestamp::now().checked_sub(ago).unwrap_or(Timestamp::UNIX_EPOCH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calendar_follows_the_clock() {
        let clock = Clock::start();
        let early = clock.wall(Instant::ZERO);
        let later = clock.wall(clock.now());
        assert!(early <= later);
        assert!(later.as_second() > 1_700_000_000);
        assert_eq!(clock.until(Instant::ZERO), Duration::ZERO);
    }
}
