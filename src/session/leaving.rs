//! Leaving a question that a job does not answer.
//!
//! A unit may take the key that leaves a question for an answer, and ask the next one. So the line is watched for a
//! while, and whatever is asked meanwhile is left as well.

use super::event::Outcome;
use super::job::{Desk, Signal};
use crate::time::{Duration, Instant};
use crate::wire::Message;

/// What leaves most questions: no answer.
pub(super) const ENTER: &[u8] = b"\r";
/// Questions that are left, one after the other, before a unit that goes on asking is given up.
const MOST: u32 = 3;

/// Leaves open questions, and keeps how the job ends once none is open.
#[derive(Debug)]
pub(super) struct Leaving {
    /// What leaves a question.
    keys: &'static [u8],
    /// How long the unit may take to ask the next one.
    wait: Duration,
    left: u32,
    is_asked: bool,
    due: Instant,
    then: Outcome,
}

impl Leaving {
    /// Leaves the question at hand.
    pub(super) fn begin(keys: &'static [u8], wait: Duration, desk: &mut Desk<'_>, then: Outcome) -> Self {
        let mut leaving = Leaving::if_asked(keys, wait, desk.now, then);
        leaving.leave(desk);
        leaving
    }

    /// No question is open, but the unit may ask one by `due`.
    pub(super) fn if_asked(keys: &'static [u8], wait: Duration, due: Instant, then: Outcome) -> Self {
        Leaving { keys, wait, left: 0, is_asked: false, due, then }
    }

    fn leave(&mut self, desk: &mut Desk<'_>) {
        desk.send(self.keys);
        self.left += 1;
        self.is_asked = false;
        self.due = desk.now + self.wait;
    }

    /// Takes a signal; returns the outcome once no question is open any more. `cancelled` is the outcome if the user
    /// cancels or the link is lost.
    pub(super) fn handle(&mut self, signal: Signal<'_>, cancelled: Outcome, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            // Other messages change nothing: a row of the stream, or a page, may end the line of a question that is
            // open.
            Signal::Heard(_, message) => self.is_asked |= matches!(message, Message::Prompt(_)),
            Signal::Tick if self.due <= desk.now => return self.time_is_up(desk),
            Signal::Cancel => self.then = cancelled,
            Signal::LinkLost => return Some(cancelled),
            Signal::Begin | Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => {}
        }
        None
    }

    /// Changes how the job ends.
    pub(super) fn end_as(&mut self, then: Outcome) {
        self.then = then;
    }

    /// How the job ends.
    pub(super) fn then(&self) -> Outcome {
        self.then.clone()
    }

    /// When the next [`Signal::Tick`] is wanted.
    pub(super) fn due(&self) -> Instant {
        self.due
    }

    /// The wait is over: leaves the next question if there is one, otherwise ends the job.
    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if (self.is_asked || desk.pending.is_some()) && self.left < MOST {
            self.leave(desk);
            return None;
        }
        Some(self.then())
    }
}
