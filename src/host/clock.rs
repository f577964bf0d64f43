//! The only clock. It is asked once for each input and each wake-up; everything else is told the time.

use std::time::SystemTime;

use jiff::Timestamp;
use jiff::tz::TimeZone;

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

    /// Local time of day at the start of this clock; UTC where the system does not say its zone.
    pub fn time_of_day(&self) -> Duration {
        time_of_day(self.wall(Instant::ZERO).as_millisecond())
    }
}

/// Local time of day at a moment, in milliseconds since 1970; UTC where the system does not say its zone.
pub fn time_of_day(unix_millis: i64) -> Duration {
    let moment = Timestamp::from_millisecond(unix_millis).unwrap_or(Timestamp::UNIX_EPOCH);
    let local = moment.to_zoned(TimeZone::system());
    let seconds = i64::from(local.hour()) * 3600 + i64::from(local.minute()) * 60 + i64::from(local.second());
    Duration::from_secs(seconds.unsigned_abs()) + Duration::from_millis(local.millisecond().unsigned_abs().into())
}

/// The time of day this long before another one.
pub fn day_before(time_of_day: Duration, earlier: Duration) -> Duration {
    const DAY: u128 = 24 * 3600 * 1_000_000_000;
    let nanos = (time_of_day.as_nanos() % DAY + DAY - earlier.as_nanos() % DAY) % DAY;
    Duration::from_nanos(u64::try_from(nanos).unwrap_or_default())
}

/// A moment in milliseconds since 1970 as local date and time, to the second.
pub fn local_text(unix_millis: i64) -> String {
    let moment = Timestamp::from_millisecond(unix_millis).unwrap_or(Timestamp::UNIX_EPOCH);
    moment.to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M:%S").to_string()
}

/// A moment of the file system as local date and time, to the minute.
pub fn local_date_and_time(moment: SystemTime) -> Option<String> {
    let timestamp = Timestamp::try_from(moment).ok()?;
    Some(timestamp.to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M").to_string())
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

    #[test]
    fn the_time_of_day_goes_back_over_midnight_as_often_as_it_has_to() {
        let hours = |hours: u64| Duration::from_secs(hours * 3600);
        for (now, ago, then) in [(13, 1, 12), (1, 2, 23), (0, 0, 0), (5, 24, 5), (1, 50, 23)] {
            assert_eq!(day_before(hours(now), hours(ago)), hours(then), "{now} less {ago}");
        }
    }
}
