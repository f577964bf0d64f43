//! Date and time of the moments of a conversation, live or recorded.

use jiff::Timestamp;

use crate::host::clock::Clock;
use crate::time::Instant;

/// What the calendar says at moments of a conversation.
#[derive(Clone, Copy, Debug)]
pub enum Calendar {
    /// Of the computer's clock.
    Clock(Clock),
    /// A recording's, which began this many milliseconds after 1970 began.
    Recording(i64),
}

impl Calendar {
    /// Date and time in UTC.
    pub fn at(self, moment: Instant) -> Timestamp {
        match self {
            Calendar::Clock(clock) => clock.wall(moment),
            Calendar::Recording(begun) => Timestamp::from_millisecond(begun)
                .and_then(|begun| begun.checked_add(moment.since_start()))
                .unwrap_or(Timestamp::UNIX_EPOCH),
        }
    }

    /// The form data is written in: `2026-01-31T12:00:00.123Z`.
    pub fn text(self, moment: Instant) -> String {
        self.at(moment).strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
    }
}
