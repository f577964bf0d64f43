//! Whether a stream that was on still is: after a T, typed, sent by a job or in a recording, and after a restart.
//!
//! The key only toggles (AXTC4CO manual, section 4.1.3), and nothing a unit prints is known to say which way. A
//! question after it shows that the stream was off and is being set; rows that go on show that the key was lost; if
//! neither comes, the stream has stopped. A unit that restarts goes on with a stream that is stored, so rows that do
//! not come back show the same.

use super::console::{ANSWER, FIRST_VALUES, NO_QUESTION, ROWS_ON_THEIR_WAY};
use super::keys::{Key, Typed};
use crate::time::{Duration, Instant};
use crate::wire::{MenuKey, Message, Prompt};

/// The longest repetition time (errata E-105): rows that are farther apart belong to two streams.
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
    after: After,
    since: Instant,
    /// When the stream counts as stopped, unless something shows otherwise.
    due: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum After {
    Key,
    Restart,
}

impl Toggled {
    /// This has been sent to a unit whose stream is on.
    pub(super) fn sent(&mut self, now: Instant, typed: &Typed) {
        if typed.keys().contains(&Key::Menu(MenuKey::Stream)) {
            let due = now + ANSWER.max(self.apart * 2);
            self.wait = Some(Wait { after: After::Key, since: now, due });
        }
    }

    /// A unit whose stream was on has restarted.
    pub(super) fn restarted(&mut self, now: Instant) {
        let due = now + FIRST_VALUES + self.apart * 2;
        self.wait = Some(Wait { after: After::Restart, since: now, due });
    }

    /// The unit has printed something. Returns whether that shows that the stream has stopped.
    pub(super) fn heard(&mut self, at: Instant, message: &Message) -> bool {
        if let Message::Row(_) = message {
            let apart = self.last_row.map_or(Duration::ZERO, |last| at.since(last));
            self.apart = if apart <= LONGEST_PERIOD { apart } else { Duration::ZERO };
            self.last_row = Some(at);
        }
        let Some(wait) = &mut self.wait else { return false };
        match (wait.after, message) {
            (After::Key, Message::Row(_)) if at < wait.since + ROWS_ON_THEIR_WAY => {}
            (_, Message::Row(_)) => self.wait = None,
            (After::Key, Message::Prompt(Prompt::Source(_) | Prompt::Period)) => {
                self.wait = None;
                return true;
            }
            (After::Key, _) => wait.due = wait.due.min(at + NO_QUESTION),
            // A banner or a menu says nothing about the stream.
            (After::Restart, _) => {}
        }
        false
    }

    /// When to call [`is_over`](Toggled::is_over).
    pub(super) fn due(&self) -> Option<Instant> {
        self.wait.map(|wait| wait.due)
    }

    /// Whether the time for a sign of the stream is over, so that it has stopped. `true` only once.
    pub(super) fn is_over(&mut self, now: Instant) -> bool {
        self.wait.take_if(|wait| wait.due <= now).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::SourceKeys;
    use crate::wire::stream::{Row, Source};

    const KEYS: SourceKeys = SourceKeys { field_value: 'f', process_value: 'p' };

    fn at(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    fn row() -> Message {
        Message::Row(Row { source: Source::FieldValue, decimals: 3, readings: Vec::new() })
    }

    /// A stream with a row each second, the last one at 1000 ms, and T at 1500 ms.
    fn toggled() -> Toggled {
        let mut toggled = Toggled::default();
        assert!(!toggled.heard(at(0), &row()) && !toggled.heard(at(1_000), &row()));
        toggled.sent(at(1_500), &Typed::Keys(vec![Key::Menu(MenuKey::Stream)]));
        toggled
    }

    #[test]
    fn silence_for_two_rows_is_the_end_of_a_stream() {
        let mut toggled = toggled();
        // On its way when the key was pressed.
        assert!(!toggled.heard(at(1_799), &row()));
        assert_eq!(toggled.due(), Some(at(3_500)));
        assert!(!toggled.is_over(at(3_499)));
        assert!(toggled.is_over(at(3_500)));
        assert!(!toggled.is_over(at(9_000)) && toggled.due().is_none(), "that is told once");
    }

    #[test]
    fn rows_that_go_on_show_that_the_key_was_lost_and_a_question_that_it_was_not() {
        let mut lost = toggled();
        assert!(!lost.heard(at(1_800), &row()));
        assert_eq!(lost.due(), None);
        for question in [Prompt::Source(KEYS), Prompt::Period] {
            let mut heard = toggled();
            assert!(heard.heard(at(1_600), &Message::Prompt(question)), "{question:?}");
            assert_eq!(heard.due(), None);
        }
    }

    #[test]
    fn words_after_the_key_shorten_the_wait_and_never_lengthen_it() {
        let mut toggled = toggled();
        assert!(!toggled.heard(at(1_600), &Message::Text));
        assert_eq!(toggled.due(), Some(at(2_000)));
        assert!(!toggled.heard(at(1_900), &Message::Text));
        assert_eq!(toggled.due(), Some(at(2_000)));
    }

    #[test]
    fn after_a_restart_only_rows_say_that_a_stream_is_on() {
        let mut toggled = toggled();
        toggled.restarted(at(5_000));
        let due = at(5_000) + FIRST_VALUES + Duration::from_secs(2);
        for words in [Message::Text, Message::Prompt(Prompt::Period)] {
            assert!(!toggled.heard(at(5_100), &words));
            assert_eq!(toggled.due(), Some(due));
        }
        assert!(!toggled.heard(at(5_200), &row()));
        assert_eq!(toggled.due(), None);
    }

    #[test]
    fn only_the_key_matters_and_rows_of_two_streams_say_nothing_of_their_time() {
        let mut toggled = Toggled::default();
        toggled.sent(at(0), &Typed::Keys(vec![Key::Other, Key::Enter, Key::Menu(MenuKey::Menu)]));
        toggled.sent(at(0), &Typed::File);
        assert_eq!(toggled.due(), None);
        toggled.heard(at(0), &row());
        toggled.heard(at(60_001), &row());
        toggled.sent(at(61_000), &Typed::Keys(vec![Key::Menu(MenuKey::Stream)]));
        assert_eq!(toggled.due(), Some(at(61_000) + ANSWER));
        // The longest repetition time is one of a single stream.
        toggled.heard(at(120_001), &row());
        toggled.sent(at(121_000), &Typed::Keys(vec![Key::Menu(MenuKey::Stream)]));
        assert_eq!(toggled.due(), Some(at(121_000) + LONGEST_PERIOD * 2));
    }
}
