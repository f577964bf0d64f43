//! Whether a stream that was on still is: behind a T, whoever has pressed it, by hand or in a recording, and behind a
//! restart.
//!
//! The key only toggles (AXTC4CO manual, section 4.1.3), and nothing a unit prints is known to say which way. Behind it a
//! question says that the stream was off and is being set; rows that go on, that the key was lost; neither of them, that
//! the stream has stopped. A unit that starts anew goes on with a stream that is stored, so rows that do not come back say
//! the same.

use super::console::{ANSWER, FIRST_VALUES, NO_QUESTION, ROWS_ON_THEIR_WAY};
use super::dialogue::LONGEST_TYPED;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt};

/// The longest repetition time (errata E-105): rows that lie farther apart are of two streams.
const LONGEST_PERIOD: Duration = Duration::from_secs(60);

/// Waits for what shows whether the stream is still on.
#[derive(Debug, Default)]
pub(super) struct Toggled {
    wait: Option<Wait>,
    last_row: Option<Instant>,
    /// How far apart the last two rows were; zero where that is not known.
    apart: Duration,
}

#[derive(Clone, Copy, Debug)]
struct Wait {
    behind: Behind,
    since: Instant,
    /// When the stream counts as stopped, should nothing show otherwise.
    due: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Behind {
    Key,
    Restart,
}

impl Toggled {
    /// These bytes have been sent to a unit whose stream is on.
    pub(super) fn sent(&mut self, now: Instant, bytes: &[u8]) {
        if bytes.len() <= LONGEST_TYPED && bytes.iter().any(|key| key.eq_ignore_ascii_case(&b't')) {
            let due = now + ANSWER.max(self.apart * 2);
            self.wait = Some(Wait { behind: Behind::Key, since: now, due });
        }
    }

    /// A unit whose stream was on has started anew.
    pub(super) fn restarted(&mut self, now: Instant) {
        let due = now + FIRST_VALUES + self.apart * 2;
        self.wait = Some(Wait { behind: Behind::Restart, since: now, due });
    }

    /// The unit has printed something. Says whether that shows that the stream has stopped.
    pub(super) fn heard(&mut self, at: Instant, message: &Message) -> bool {
        if let Message::Row(_) = message {
            let apart = self.last_row.map_or(Duration::ZERO, |last| at.since(last));
            self.apart = if apart <= LONGEST_PERIOD { apart } else { Duration::ZERO };
            self.last_row = Some(at);
        }
        let Some(wait) = &mut self.wait else { return false };
        match (wait.behind, message) {
            (Behind::Key, Message::Row(_)) if at < wait.since + ROWS_ON_THEIR_WAY => {}
            (_, Message::Row(_)) => self.wait = None,
            (Behind::Key, Message::Prompt(Prompt::Source(_) | Prompt::Period)) => {
                self.wait = None;
                return true;
            }
            (Behind::Key, _) => wait.due = wait.due.min(at + NO_QUESTION),
            // A banner and a menu say nothing of the stream.
            (Behind::Restart, _) => {}
        }
        false
    }

    /// When [`is_over`](Toggled::is_over) is wanted.
    pub(super) fn due(&self) -> Option<Instant> {
        self.wait.map(|wait| wait.due)
    }

    /// Whether the time for a sign of the stream is over: it has stopped.
    pub(super) fn is_over(&mut self, now: Instant) -> bool {
        self.wait.take_if(|wait| wait.due <= now).is_some()
    }
}
