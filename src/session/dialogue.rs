//! Which lines answer a key that was sent: they do not count as not understood, even if no single one of them means
//! anything.
//!
//! A dialogue has questions, echoes and sentences in the unit's own words, a page of diagnostics has headings, and the
//! view of the object dictionary has titles and hints. Jobs read what matters in them; the count of lines not
//! understood is about all other lines. The keys show which is which, typed or sent by a job, so a recording gives the
//! same count.

use super::keys::{Key, Typed};
use crate::time::{Duration, Instant};
use crate::wire::{MenuKey, diagnostics};

/// How long what comes after a key is its answer, and what comes after a page belongs to pages: pages come every
/// second, and a unit that computes needs a moment.
const ANSWER: Duration = Duration::from_secs(3);

/// The dialogue that is open, as far as keys tell.
#[derive(Debug, Default)]
pub(super) struct Dialogue {
    asked: Option<Asked>,
    until: Instant,
    /// Lines since the menu was asked for that were not understood, and are its titles if it comes.
    before_menu: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    /// The menu, which has not come yet: anything may answer an `m`.
    Menu,
    /// The menu, which has come, or what another of its keys opens, such as the view or a question.
    Answer,
    /// Pages, which come until the key is pressed again.
    Pages,
}

impl Dialogue {
    /// This has been sent.
    pub(super) fn sent(&mut self, now: Instant, typed: &Typed) {
        if *typed == Typed::File {
            self.asked = None;
            return;
        }
        for key in typed.keys() {
            match key {
                Key::Menu(MenuKey::Menu) | Key::Leave => (self.asked, self.before_menu) = (Some(Asked::Menu), 0),
                Key::Menu(MenuKey::Diagnostics) => self.asked = Some(Asked::Pages),
                Key::Menu(_) => self.asked = Some(Asked::Answer),
                Key::Enter | Key::Other => {}
            }
        }
        self.until = now + ANSWER;
    }

    /// Whether a line that was not understood belongs to what was asked for.
    pub(super) fn owns(&mut self, at: Instant, line: &str) -> bool {
        let is_soon = at <= self.until;
        match self.asked.filter(|_| is_soon) {
            None => false,
            Some(Asked::Menu) => {
                self.before_menu += 1;
                false
            }
            Some(Asked::Answer) => true,
            Some(Asked::Pages) => {
                if !diagnostics::quantities(line).is_empty() {
                    self.until = at + ANSWER;
                }
                true
            }
        }
    }

    /// Whether what comes now is on a page of diagnostics.
    pub(super) fn shows_pages(&self, at: Instant) -> bool {
        self.asked == Some(Asked::Pages) && at <= self.until
    }

    /// The unit names its product. No page does, so it has restarted and shows no more pages.
    pub(super) fn named(&mut self) {
        self.asked = self.asked.filter(|asked| *asked != Asked::Pages);
    }

    /// An entry of the menu has come: returns how many of the lines before it were titles of the menu.
    pub(super) fn menu(&mut self) -> u64 {
        if self.asked == Some(Asked::Menu) {
            self.asked = Some(Asked::Answer);
        }
        std::mem::take(&mut self.before_menu)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::keys::KeyReader;

    fn at(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    fn sent(dialogue: &mut Dialogue, now: Instant, bytes: &[u8]) {
        dialogue.sent(now, &KeyReader::default().read(bytes));
    }

    #[test]
    fn what_answers_a_key_belongs_to_it_and_what_comes_later_does_not() {
        let mut dialogue = Dialogue::default();
        assert!(!dialogue.owns(at(0), "nobody has asked"));
        sent(&mut dialogue, at(1000), b"t");
        assert!(dialogue.owns(at(1500), "Field or process value?"));
        sent(&mut dialogue, at(60_000), b"1000\r");
        assert!(dialogue.owns(at(60_100), "Now every 1000 ms."));
        assert!(!dialogue.owns(at(63_001), "something else"));
    }

    #[test]
    fn pages_go_on_as_long_as_they_have_numbers() {
        let mut dialogue = Dialogue::default();
        sent(&mut dialogue, at(0), b"s");
        for second in 1..100 {
            assert!(dialogue.owns(at(second * 1000), "--- Diagnostics ---"), "{second}");
            assert!(dialogue.owns(at(second * 1000), "Supply 24.0 V"), "{second}");
            assert!(dialogue.shows_pages(at(second * 1000 + 10)));
        }
        dialogue.named();
        assert!(!dialogue.shows_pages(at(99_500)), "the unit has restarted");
        sent(&mut dialogue, at(100_000), b"s");
        assert!(dialogue.shows_pages(at(102_000)));
        assert!(!dialogue.owns(at(103_001), "noise") && !dialogue.shows_pages(at(103_001)));
    }

    #[test]
    fn titles_belong_to_a_menu_once_it_has_shown_itself() {
        let mut dialogue = Dialogue::default();
        sent(&mut dialogue, at(0), b"\x11m");
        assert!(!dialogue.owns(at(100), "Some Corporation"), "a modem may say so too");
        assert!(!dialogue.owns(at(101), "=========="));
        assert_eq!(dialogue.menu(), 2);
        assert!(dialogue.owns(at(102), "----------"));
        assert_eq!(dialogue.menu(), 0, "taken back once");
    }

    #[test]
    fn a_record_of_a_file_is_no_key() {
        let mut dialogue = Dialogue::default();
        sent(&mut dialogue, at(0), b"S315000000000D0D0D0D0D0D0D0D0D0D0D\r");
        assert!(!dialogue.owns(at(1), "strange"));
    }
}
