//! What has gone over a line, in numbers: what a maintainer asks for first when something was lost on the way.

use std::fmt;

use super::{Direction, XOFF, XON};
use crate::count::noun;
use crate::time::{Duration, Instant};

/// Numbers of one session.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    received: u64,
    sent: u64,
    /// How often the unit has stopped us, and let us go on.
    xoff: u64,
    xon: u64,
    held_since: Option<Instant>,
    longest_hold: Duration,
    last_received: Option<Instant>,
    longest_silence: Duration,
}

impl Tally {
    /// Counts bytes that came or went.
    pub fn count(&mut self, at: Instant, direction: Direction, bytes: &[u8]) {
        match direction {
            Direction::ToUnit => self.sent += bytes.len() as u64,
            Direction::FromUnit => {
                self.received += bytes.len() as u64;
                let silence = self.last_received.map_or(Duration::ZERO, |last| at.since(last));
                self.longest_silence = self.longest_silence.max(silence);
                self.last_received = Some(at);
                for &byte in bytes.iter().filter(|byte| matches!(**byte, XON | XOFF)) {
                    self.flow(at, byte == XOFF);
                }
            }
        }
    }

    /// The longest time the unit has held us by XOFF, if it ever did; a hold that has not ended counts up to `now`.
    pub fn longest_hold(&self, now: Instant) -> Duration {
        self.longest_hold.max(self.held_since.map_or(Duration::ZERO, |since| now.since(since)))
    }

    /// All of it in one line, at the moment `now`.
    pub fn summary(&self, now: Instant) -> impl fmt::Display {
        let Tally { received, sent, xoff, xon, .. } = self;
        let (hold, silence) = (self.longest_hold(now).as_secs_f64(), self.longest_silence.as_secs_f64());
        format!(
            "{received} {} received, {sent} sent; XOFF {xoff} {}, XON {xon} {}; longest hold {hold:.3} s, \
             longest silence of the unit {silence:.3} s",
            noun(*received, "byte"),
            noun(*xoff, "time"),
            noun(*xon, "time")
        )
    }

    fn flow(&mut self, at: Instant, stops: bool) {
        if stops {
            self.xoff += 1;
            self.held_since.get_or_insert(at);
        } else {
            self.xon += 1;
            if let Some(since) = self.held_since.take() {
                self.longest_hold = self.longest_hold.max(at.since(since));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_and_silences_are_measured_and_an_open_hold_goes_on() {
        let mut tally = Tally::default();
        let ms = Instant::from_millis;
        tally.count(ms(0), Direction::FromUnit, b"a\x13");
        tally.count(ms(30), Direction::FromUnit, b"\x11");
        tally.count(ms(31), Direction::ToUnit, b"m\x11");
        tally.count(ms(50), Direction::FromUnit, b"\x13\x13");
        assert_eq!(tally.longest_hold(ms(60)), Duration::from_millis(30));
        assert_eq!(tally.longest_hold(ms(150)), Duration::from_millis(100));
        assert_eq!(
            tally.summary(ms(150)).to_string(),
            "5 bytes received, 2 sent; XOFF 3 times, XON 1 time; longest hold 0.100 s, longest silence of the unit 0.030 s"
        );
    }
}
