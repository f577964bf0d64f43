//! Our end of the cable.

mod event;

pub use event::*;

use crate::endpoint::{Endpoint, Transmit};
use crate::record::Record;
use crate::time::Instant;

/// A conversation with one unit.
#[derive(Debug, Default)]
pub struct Session {
    record: Record,
    facts: Facts,
}

impl Session {
    /// A conversation about to begin on a line of this many baud.
    pub fn new(_baud: u32) -> Self {
        Session::default()
    }

    /// Takes a command, or says why not.
    ///
    /// # Errors
    /// If another job runs or the command makes no sense; nothing has been sent then.
    pub fn command(&mut self, _now: Instant, _command: Command) -> Result<(), Refusal> {
        Ok(())
    }

    /// The next piece of news.
    pub fn poll_event(&mut self) -> Option<Event> {
        None
    }

    /// What is known of the unit.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// The job that runs.
    pub fn job(&self) -> Option<Job> {
        None
    }

    /// Every byte, both directions.
    pub fn record(&self) -> &Record {
        &self.record
    }
}

impl Endpoint for Session {
    fn handle_bytes(&mut self, _now: Instant, _bytes: &[u8]) {}
    fn handle_timeout(&mut self, _now: Instant) {}
    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}
