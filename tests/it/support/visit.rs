//! A console at a unit that was written by hand, a byte a time, in virtual time.

use std::collections::VecDeque;

use axcon::endpoint::Endpoint;
use axcon::session::{Command, Event, Outcome, Session};
use axcon::time::{Duration, Instant};

use super::bench::BAUD;

/// A unit written by hand. What it says lies in a queue until its moment.
pub trait HandMade: Endpoint {
    /// What it is going to say, and when.
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)>;
}

/// The two of them.
pub struct Visit<U> {
    pub now: Instant,
    pub session: Session,
    pub unit: U,
    /// Everything that was sent to the unit.
    pub wire: Vec<u8>,
    events: VecDeque<Event>,
}

impl<U: HandMade> Visit<U> {
    pub fn to(unit: U) -> Self {
        let now = Instant::from_millis(1);
        Visit { now, session: Session::new(BAUD), unit, wire: Vec::new(), events: VecDeque::new() }
    }

    /// Runs a job and gives its outcome.
    pub fn ask(&mut self, command: Command) -> Outcome {
        self.ask_and_listen(command).0
    }

    /// Runs a job and gives its outcome with all that was heard on the way.
    pub fn ask_and_listen(&mut self, command: Command) -> (Outcome, Vec<Event>) {
        self.session.command(self.now, command).expect("taken");
        let end = self.now + Duration::from_secs(120);
        let mut heard = Vec::new();
        while self.now < end {
            while let Some(event) = self.events.pop_front() {
                if let Event::Finished(outcome) = event {
                    return (outcome, heard);
                }
                heard.push(event);
            }
            self.step();
        }
        panic!("no outcome; sent {}", self.wire.escape_ascii());
    }

    fn step(&mut self) {
        while let Some(transmit) = self.session.poll_transmit() {
            self.wire.extend(&transmit.bytes);
            self.unit.handle_bytes(self.now, &transmit.bytes);
        }
        while let Some(event) = self.session.poll_event() {
            self.events.push_back(event);
        }
        let due = [self.session.poll_timeout(), self.unit.poll_timeout()];
        let next = due.into_iter().flatten().min().unwrap_or(self.now + Duration::from_secs(1));
        self.now = next.max(self.now + Duration::from_micros(1));
        self.unit.handle_timeout(self.now);
        while let Some(at) = self.unit.says().iter().position(|(at, _)| *at <= self.now) {
            let (_, text) = self.unit.says().remove(at).expect("it is there");
            for byte in text {
                self.session.handle_bytes(self.now, &[byte]);
            }
        }
        self.session.handle_timeout(self.now);
    }
}
