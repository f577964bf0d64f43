//! A file that goes to the unit as it is, as a terminal program sends it.
//!
//! Its bytes go out as if typed, a little ahead of the line, under the same flow control and into the same record. What
//! the unit makes of them is unknown: only how much has left is reported.

use super::event::{Event, FileEnd, Outcome};
use super::job::{Desk, Signal, Work};
use crate::time::{Duration, Instant};

/// How long the unit may hold the file before the user is told what is being waited for. Writing a page of flash takes
/// it some 30 ms; a count that stands still for seconds has to be explained.
const LONG_HOLD: Duration = Duration::from_secs(3);
/// Most bytes that wait for the line: enough pieces that it never runs dry, and few enough to be withdrawn.
const AHEAD: usize = 256;

/// A file on its way.
pub(super) struct SendFile {
    bytes: Vec<u8>,
    /// Bytes handed to the transmitter.
    handed: usize,
    /// Bytes that have left the line's queue, as last reported.
    told: usize,
    /// The user has been told of the current hold.
    hold_told: bool,
    deadline: Option<Instant>,
}

impl SendFile {
    pub(super) fn new(bytes: Vec<u8>) -> Self {
        SendFile { bytes, handed: 0, told: 0, hold_told: false, deadline: None }
    }

    /// Bytes that have left. What waits in the queue is the last part of the file: keys typed before it leave first.
    fn sent(&self, desk: &Desk<'_>) -> usize {
        self.handed.saturating_sub(desk.transmitter.waiting())
    }

    fn go_on(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let sent = self.sent(desk);
        if sent != self.told {
            self.told = sent;
            desk.events.push_back(Event::FileProgress { sent, total: self.bytes.len() });
        }
        if sent == self.bytes.len() {
            // The last piece has been let go, and still needs its time on the line.
            let free_at = desk.transmitter.free_at();
            if free_at <= desk.now {
                return Some(self.ended(FileEnd::Whole, sent));
            }
            self.deadline = Some(free_at);
            return None;
        }
        let room = AHEAD.saturating_sub(desk.transmitter.waiting());
        let end = self.bytes.len().min(self.handed + room);
        desk.typed.extend_from_slice(&self.bytes[self.handed..end]);
        self.handed = end;
        self.deadline = match desk.transmitter.held_since() {
            // The transmitter causes ticks only while something waits, and none when the last piece has left.
            None => {
                self.hold_told = false;
                let waiting = desk.transmitter.waiting() + desk.typed.len();
                Some(desk.now + desk.transmitter.time_for(waiting))
            }
            Some(_) if self.hold_told => None,
            Some(since) if desk.now < since + LONG_HOLD => Some(since + LONG_HOLD),
            Some(since) => {
                self.hold_told = true;
                desk.events.push_back(Event::FileHeld { since, sent, total: self.bytes.len() });
                None
            }
        };
        None
    }

    fn ended(&self, end: FileEnd, sent: usize) -> Outcome {
        Outcome::FileSent { sent, total: self.bytes.len(), end }
    }
}

impl Work for SendFile {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin | Signal::Tick | Signal::Hold(_) => self.go_on(desk),
            Signal::Cancel => {
                let sent = self.sent(desk);
                desk.transmitter.clear();
                Some(self.ended(FileEnd::Cancelled, sent))
            }
            // The session has emptied the queue already.
            Signal::LinkLost => Some(self.ended(FileEnd::LinkLost, self.told)),
            Signal::Heard(..) | Signal::Typed(_) | Signal::Over => None,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }
}
