//! Finding out what is at the other end.
//!
//! The question is `m`, which a unit may be asked at any time (AXTC4CO manual, section 4.1). It may be in a dialogue
//! that swallows the key, so the question is repeated in other forms: Enter leaves every prompt, `x` the view of the
//! object dictionary (section 4.1.1). A loader that waits for a file reports the key as an error, and so reveals
//! itself.

use super::event::{Event, Outcome, UnitState};
use super::job::{Desk, Signal, Work};
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, Message, Prompt, XON};

/// How long a unit may take to begin its answer: the menu comes at once, an adapter adds some 20 ms.
const ANSWER: Duration = Duration::from_millis(800);
/// Silence after an answer that ends it.
const QUIET: Duration = Duration::from_millis(150);
/// How long an answer may go on: the stream may continue after the menu.
const LONGEST_ANSWER: Duration = Duration::from_millis(1500);
/// How long a unit may have been holding us before it is asked regardless: no page takes that long to write, so its XON
/// has been lost, or it has lost its power since.
const STALE_HOLD: Duration = Duration::from_secs(4);
/// From this many different entries on, lines that look like entries of the menu are the menu.
const MENU_ENTRIES: u32 = 3;

/// The ways to ask. Xon first: if an earlier program left the unit stopped, it could not answer.
const QUESTIONS: [&[u8]; 3] = [&[XON, b'm'], b"\rm", b"xm"];

/// The job.
#[derive(Debug, Default)]
pub(super) struct Identify {
    asked: usize,
    asked_at: Instant,
    deadline: Option<Instant>,
    menu: u8,
    software: bool,
    loader: bool,
    /// The unit has said which product it is.
    named: bool,
    /// Anything came at all.
    alive: bool,
}

impl Identify {
    fn ask(&mut self, desk: &mut Desk<'_>) {
        if desk.transmitter.held_since().is_some_and(|since| since + STALE_HOLD <= desk.now) {
            desk.transmitter.hold(desk.now, false);
            desk.events.push_back(Event::Held(false));
        }
        desk.send(QUESTIONS[self.asked]);
        self.asked += 1;
        self.asked_at = desk.now;
        self.deadline = Some(desk.now + ANSWER);
    }

    fn note(&mut self, message: &Message) {
        match message {
            Message::MenuKey(key) => self.menu |= 1 << (*key as u32),
            Message::Software(name) => {
                self.software = true;
                self.named |= name.product.is_some();
            }
            // An application may print the other texts of a loader as well: "press any key", "restarting".
            Message::Loader(LoaderText::Waiting | LoaderText::Error(_)) | Message::Prompt(Prompt::WaitingForFile) => {
                self.loader = true;
            }
            _ => {}
        }
        self.alive = true;
    }

    fn is_answered(&self) -> bool {
        self.loader || self.menu.count_ones() >= MENU_ENTRIES || (self.software && self.menu > 0)
    }

    fn conclude(&self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if self.loader && desk.facts.state != UnitState::Application {
            // If the loader has only reported an error, the facts do not show this yet.
            desk.facts.enter_loader();
        } else if !self.is_answered() && desk.facts.state != UnitState::Application {
            let alive = self.alive || desk.pending.is_some();
            desk.facts.state = if alive { UnitState::Unknown } else { UnitState::Silent };
        }
        Some(Outcome::Identified)
    }
}

impl Work for Identify {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin => {
                // Noise contains an XOFF sooner or later, and no XON follows it.
                if desk.facts.state == UnitState::Unknown && desk.transmitter.held_since().is_some() {
                    desk.transmitter.hold(desk.now, false);
                    desk.events.push_back(Event::Held(false));
                }
                desk.facts.state = UnitState::Silent;
                self.ask(desk);
                None
            }
            Signal::Heard(_, message) => {
                self.note(message);
                if self.is_answered() && !matches!(message, Message::Row(_)) {
                    self.deadline = Some((desk.now + QUIET).min(self.asked_at + LONGEST_ANSWER));
                }
                None
            }
            Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => {
                // Not every menu names its unit. But the line that does may have been lost, so the unit is asked once
                // more.
                let is_nameless = self.asked == 1 && !self.loader && !self.named;
                if self.is_answered() && !is_nameless || self.asked == QUESTIONS.len() {
                    return self.conclude(desk);
                }
                self.ask(desk);
                None
            }
            Signal::Tick => None,
            Signal::Cancel | Signal::LinkLost => self.conclude(desk),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }
}
