//! The unit's serial port: characters leave one after the other at the line rate, and the client may stop them.
//!
//! 115200 baud, 8 data bits, no parity, 1 stop bit, XON/XOFF (AXTC4CO manual, appendix A). What to print, and what to
//! drop when the line is behind, is decided by the programs that use the port.

use std::collections::VecDeque;

use crate::device::BAUD;
use crate::endpoint::Transmit;
use crate::time::{Duration, Instant, character_time};

/// Lets the other side go on.
pub const XON: u8 = 0x11;
/// Stops the other side.
pub const XOFF: u8 = 0x13;

/// Characters handed over together: a good millisecond's worth, so that a busy line costs its reader a wake-up a
/// millisecond and not one a character.
const CHARACTERS_PER_RELEASE: usize = 12;

/// The transmitter with what waits for it.
#[derive(Debug)]
pub struct Uart {
    character_time: Duration,
    waiting: VecDeque<u8>,
    /// When the first waiting character began, or may begin, to leave.
    begin: Instant,
    hold: Hold,
    /// The next release. It is asked for many times between two changes, so it is reckoned at each change.
    next: Option<Release>,
    released: VecDeque<Transmit>,
}

/// Characters that leave together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Release {
    characters: usize,
    /// When the last of them has left.
    at: Instant,
}

/// Whether the client lets us send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    Free,
    /// The client has sent XOFF. A character that had begun by then still leaves: a shift register cannot be stopped.
    Held {
        last_character: bool,
    },
}

impl Uart {
    /// A port with nothing to send.
    pub fn new() -> Self {
        Uart {
            character_time: character_time(BAUD),
            waiting: VecDeque::new(),
            begin: Instant::ZERO,
            hold: Hold::Free,
            next: None,
            released: VecDeque::new(),
        }
    }

    /// Queues bytes after those already waiting.
    pub fn send(&mut self, now: Instant, bytes: &[u8]) {
        if self.waiting.is_empty() {
            self.begin = self.begin.max(now);
        }
        self.waiting.extend(bytes);
        self.plan();
    }

    /// The client has sent XOFF: nothing leaves but the character that is on its way.
    pub fn hold(&mut self, now: Instant) {
        if self.hold != Hold::Free {
            return;
        }
        self.release(self.finished_by(now));
        let last_character = !self.waiting.is_empty() && self.begin < now;
        self.hold = Hold::Held { last_character };
        self.plan();
    }

    /// The client has sent XON.
    pub fn resume(&mut self, now: Instant) {
        if let Hold::Held { last_character } = self.hold {
            self.hold = Hold::Free;
            if !last_character {
                self.begin = self.begin.max(now);
            }
            self.plan();
        }
    }

    /// The microcontroller resets: what has not left is lost, and a hold is forgotten.
    pub fn reset(&mut self) {
        self.waiting.clear();
        self.hold = Hold::Free;
        self.plan();
    }

    /// A reset in the middle of a text, or the end of power: what the line has carried by now has arrived.
    pub fn cut(&mut self, now: Instant) {
        self.release(self.finished_by(now));
        self.reset();
    }

    /// Hands over what has left by `now`, if a release is due.
    pub fn step(&mut self, now: Instant) {
        if let Some(release) = self.next.filter(|release| release.at <= now) {
            self.release(release.characters);
            if let Hold::Held { last_character } = &mut self.hold {
                *last_character = false;
            }
            self.plan();
        }
    }

    /// When the next release is due.
    pub fn deadline(&self) -> Option<Instant> {
        self.next.map(|release| release.at)
    }

    /// Bytes that have left.
    pub fn poll_transmit(&mut self) -> Option<Transmit> {
        self.released.pop_front()
    }

    /// Characters that have not left yet.
    pub fn backlog(&self) -> usize {
        self.waiting.len()
    }

    /// When everything that waits will have left, if nothing stops it.
    pub fn finished_at(&self) -> Instant {
        self.end_of(self.waiting.len())
    }

    /// Works out the next release again. It ends after a flow-control character, whose moment matters to the reader.
    fn plan(&mut self) {
        let characters = match self.hold {
            Hold::Held { last_character } => usize::from(last_character),
            Hold::Free => {
                let most = self.waiting.len().min(CHARACTERS_PER_RELEASE);
                let flow = self.waiting.iter().take(most).position(|&byte| byte == XON || byte == XOFF);
                flow.map_or(most, |position| position + 1)
            }
        };
        self.next = (characters > 0).then(|| Release { characters, at: self.end_of(characters) });
    }

    fn finished_by(&self, now: Instant) -> usize {
        match self.hold {
            Hold::Free => {
                let elapsed = now.since(self.begin).as_nanos() / self.character_time.as_nanos();
                usize::try_from(elapsed).unwrap_or(usize::MAX).min(self.waiting.len())
            }
            Hold::Held { last_character } => usize::from(last_character && self.end_of(1) <= now),
        }
    }

    fn end_of(&self, characters: usize) -> Instant {
        self.begin + self.character_time * characters as u32
    }

    fn release(&mut self, characters: usize) {
        if characters > 0 {
            self.begin = self.end_of(characters);
            let bytes: Vec<u8> = self.waiting.drain(..characters).collect();
            self.released.push_back(Transmit::open(bytes));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs the port until `until` and gives every release with its moment in microseconds.
    fn releases(uart: &mut Uart, until: Instant) -> Vec<(u64, Vec<u8>)> {
        let mut found = Vec::new();
        while let Some(due) = uart.deadline().filter(|&due| due <= until) {
            uart.step(due);
            while let Some(transmit) = uart.poll_transmit() {
                found.push((due.as_nanos() / 1_000, transmit.bytes));
            }
        }
        found
    }

    fn bytes(releases: &[(u64, Vec<u8>)]) -> Vec<u8> {
        releases.iter().flat_map(|(_, bytes)| bytes.clone()).collect()
    }

    #[test]
    fn text_leaves_at_the_line_rate_in_small_lots() {
        let mut uart = Uart::new();
        uart.send(Instant::ZERO, &[b'x'; 30]);
        let found = releases(&mut uart, Instant::from_millis(100));
        let lots: Vec<_> = found.iter().map(|(at, bytes)| (*at, bytes.len())).collect();
        assert_eq!(lots, [(1_041, 12), (2_083, 12), (2_604, 6)], "30 characters take 2.604 ms at 115200 baud");
        uart.send(Instant::from_millis(200), b"y");
        assert_eq!(releases(&mut uart, Instant::NEVER), [(200_086, b"y".to_vec())], "one key's echo does not wait");
    }

    #[test]
    fn xoff_stops_after_the_character_that_has_begun_and_xon_loses_nothing() {
        let mut uart = Uart::new();
        uart.send(Instant::ZERO, b"0123456789abcdef");
        // 300 µs: three characters are out, the fourth is on its way.
        uart.hold(Instant::from_micros(300));
        let found = releases(&mut uart, Instant::from_millis(50));
        assert_eq!(bytes(&found), b"0123");
        assert_eq!(uart.deadline(), None, "held");
        uart.resume(Instant::from_millis(50));
        let rest = releases(&mut uart, Instant::from_millis(100));
        assert_eq!(bytes(&rest), b"456789abcdef");
        assert_eq!(rest.last().map(|(at, _)| *at), Some(51_041), "12 characters after the XON");
    }

    #[test]
    fn a_flow_character_is_released_at_its_own_moment() {
        let mut uart = Uart::new();
        uart.send(Instant::ZERO, &[b'.', XOFF, b'a', b'b']);
        let found = releases(&mut uart, Instant::from_millis(1));
        assert_eq!(found, [(173, vec![b'.', XOFF]), (347, b"ab".to_vec())]);
    }
}
