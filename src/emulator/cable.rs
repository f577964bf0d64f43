//! The cable to the unit, and the unit on it: line rate, adapter latency, bytes in flight.
//!
//! Pure. A simulation runs it in virtual time, the pseudo-terminal host in real time; both get the same unit, byte for
//! byte, because the moment a byte reaches the unit is computed here and not read from a clock.

use std::collections::VecDeque;

use crate::endpoint::Endpoint;
use crate::time::{Duration, Instant};

/// One direction of the line: characters leave one after the other, each arrives when its stop bit is over and the
/// latency has passed.
#[derive(Clone, Debug)]
pub struct Line {
    character_time: Duration,
    latency: Duration,
    free_at: Instant,
    in_flight: VecDeque<(Instant, u8)>,
}

impl Line {
    /// A line on which one character takes `character_time` (zero: as fast as asked) and arrives `latency` later.
    pub fn new(character_time: Duration, latency: Duration) -> Self {
        Line { character_time, latency, free_at: Instant::ZERO, in_flight: VecDeque::new() }
    }

    /// Puts bytes on the line, after those already waiting.
    pub fn push(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes {
            self.free_at = self.free_at.max(now) + self.character_time;
            self.in_flight.push_back((self.free_at + self.latency, byte));
        }
    }

    /// When the next byte arrives.
    pub fn next_arrival(&self) -> Option<Instant> {
        self.in_flight.front().map(|&(at, _)| at)
    }

    /// Takes the next byte off the line if it has arrived by `now`.
    pub fn pop_arrived(&mut self, now: Instant) -> Option<(Instant, u8)> {
        let &(at, _) = self.in_flight.front()?;
        if at <= now { self.in_flight.pop_front() } else { None }
    }

    /// Bytes that have been pushed and not arrived.
    pub fn in_flight(&self) -> usize {
        self.in_flight.len()
    }

    /// Loses what is on the line, as when the cable is pulled.
    pub fn clear(&mut self) {
        self.in_flight.clear();
    }
}

/// A unit with a cable plugged in.
#[derive(Debug)]
pub struct Plugged<U> {
    unit: U,
    to_unit: Line,
    now: Instant,
}

impl<U: Endpoint> Plugged<U> {
    /// Plugs a cable into a unit. The other direction needs no line here: a unit paces its own transmitter.
    pub fn new(unit: U, to_unit: Line) -> Self {
        Plugged { unit, to_unit, now: Instant::ZERO }
    }

    /// The client sends bytes.
    pub fn send(&mut self, now: Instant, bytes: &[u8]) {
        self.to_unit.push(now, bytes);
    }

    /// Lets time pass until `now`: bytes arrive and timers expire in their order, and `heard` gets what the unit sends,
    /// with the moment its last byte has left.
    pub fn advance(&mut self, now: Instant, mut heard: impl FnMut(Instant, &[u8])) {
        loop {
            let arrival = self.to_unit.next_arrival().unwrap_or(Instant::NEVER);
            let timer = self.unit.poll_timeout().unwrap_or(Instant::NEVER);
            let next = arrival.min(timer).max(self.now);
            if next > now {
                break;
            }
            self.now = next;
            match self.to_unit.pop_arrived(next) {
                Some((_, byte)) => self.unit.handle_bytes(next, &[byte]),
                None => self.unit.handle_timeout(next),
            }
            self.drain(&mut heard);
        }
        self.now = self.now.max(now);
        self.unit.handle_timeout(self.now);
        self.drain(&mut heard);
    }

    /// When [`advance`](Plugged::advance) is wanted next.
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.to_unit.next_arrival(), self.unit.poll_timeout()].into_iter().flatten().min()
    }

    /// The unit.
    pub fn unit(&self) -> &U {
        &self.unit
    }

    /// The unit, to turn its knobs.
    pub fn unit_mut(&mut self) -> &mut U {
        &mut self.unit
    }

    /// The line to the unit.
    pub fn to_unit(&self) -> &Line {
        &self.to_unit
    }

    /// The line to the unit, to disturb it.
    pub fn to_unit_mut(&mut self) -> &mut Line {
        &mut self.to_unit
    }

    fn drain(&mut self, heard: &mut impl FnMut(Instant, &[u8])) {
        while let Some(transmit) = self.unit.poll_transmit() {
            heard(self.now, &transmit.bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::character_time;

    #[test]
    fn characters_follow_each_other_at_the_line_rate() {
        let mut line = Line::new(character_time(115_200), Duration::from_millis(16));
        line.push(Instant::ZERO, b"ab");
        line.push(Instant::from_millis(10), b"c");
        let mut arrivals = Vec::new();
        while let Some((at, byte)) = line.pop_arrived(Instant::from_millis(100)) {
            arrivals.push((at.as_nanos() / 1_000, byte));
        }
        assert_eq!(arrivals, [(16_086, b'a'), (16_173, b'b'), (26_086, b'c')]);
    }
}
