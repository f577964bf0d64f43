//! Time as a value.
//!
//! The machines of this program never ask what time it is: they are told, with every input. An [`Instant`] is a
//! count of nanoseconds since some start that only its owner knows (the moment the program began, or zero in a
//! simulation), so a test writes it as a number and a replay runs the same machine from a file. The one place that
//! turns the system's clock into an `Instant` is `host::clock`.

use std::ops::{Add, AddAssign, Sub};

pub use core::time::Duration;

/// A moment, counted from the start of the program or simulation. Never runs backward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Instant {
    nanos: u64,
}

impl Instant {
    /// The start of time.
    pub const ZERO: Instant = Instant { nanos: 0 };
    /// Later than any moment a program reaches (some 584 years).
    pub const NEVER: Instant = Instant { nanos: u64::MAX };

    /// The moment this many nanoseconds after the start.
    pub const fn from_nanos(nanos: u64) -> Self {
        Instant { nanos }
    }

    /// The moment this many microseconds after the start.
    pub const fn from_micros(micros: u64) -> Self {
        Instant { nanos: micros * 1_000 }
    }

    /// The moment this many milliseconds after the start.
    pub const fn from_millis(millis: u64) -> Self {
        Instant { nanos: millis * 1_000_000 }
    }

    /// Nanoseconds since the start.
    pub const fn as_nanos(self) -> u64 {
        self.nanos
    }

    /// Time since the start.
    pub const fn since_start(self) -> Duration {
        Duration::from_nanos(self.nanos)
    }

    /// Time from `earlier` to this moment, zero if `earlier` is the later one.
    pub const fn since(self, earlier: Instant) -> Duration {
        Duration::from_nanos(self.nanos.saturating_sub(earlier.nanos))
    }
}

impl Add<Duration> for Instant {
    type Output = Instant;

    fn add(self, after: Duration) -> Instant {
        let nanos = u64::try_from(after.as_nanos()).unwrap_or(u64::MAX);
        Instant { nanos: self.nanos.saturating_add(nanos) }
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, after: Duration) {
        *self = *self + after;
    }
}

impl Sub<Duration> for Instant {
    type Output = Instant;

    fn sub(self, before: Duration) -> Instant {
        let nanos = u64::try_from(before.as_nanos()).unwrap_or(u64::MAX);
        Instant { nanos: self.nanos.saturating_sub(nanos) }
    }
}

/// Bits on the wire for one character: a start bit, 8 data bits, a stop bit (AXTC4CO manual, appendix A).
pub const BITS_PER_CHARACTER: u32 = 10;

/// How long one character takes at `baud` bits a second.
///
/// # Panics
/// If `baud` is 0.
pub fn character_time(baud: u32) -> Duration {
    assert!(baud > 0, "a line of 0 baud carries nothing");
    Duration::from_nanos(u64::from(BITS_PER_CHARACTER) * 1_000_000_000 / u64::from(baud))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_saturates_at_both_ends() {
        assert_eq!(Instant::ZERO - Duration::from_secs(1), Instant::ZERO);
        assert_eq!(Instant::NEVER + Duration::from_secs(1), Instant::NEVER);
        assert_eq!(Instant::ZERO + Duration::MAX, Instant::NEVER);
        assert_eq!(Instant::from_millis(1).since(Instant::from_millis(3)), Duration::ZERO);
        assert_eq!(Instant::from_millis(3).since(Instant::from_micros(1_000)), Duration::from_millis(2));
    }
}
