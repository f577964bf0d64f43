//! Restoring the default object dictionary (D): the unit asks, takes a Yes, and resets itself (AXTC4CO manual, section
//! 4.1.2).
//!
//! Only the banner shows that the unit has reset itself. Many a menu names product and version as a banner does, and a
//! unit that restores nothing may print its menu behind the Yes; so the menu is asked for once more, and only what is more
//! than that is a banner.

use std::collections::BTreeSet;

use super::console::ANSWER;
use super::event::{Awaited, Job, Outcome};
use super::job::{Desk, Signal, Work};
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt, Text, complains, visible};

/// A reset with banner and menu: 5 s until the AXRTD8CO has values, doubled.
const RESET: Duration = Duration::from_secs(10);
/// Silence that ends a banner, or a menu: a unit that starts may pause between its lines.
const QUIET: Duration = Duration::from_millis(1000);
/// How long either may go on: other text may come without end.
const LONGEST: Duration = Duration::from_secs(5);
/// Different lines that are looked at of a banner and of a menu.
const MOST_LINES: usize = 500;

/// The job.
#[derive(Debug, Default)]
pub(super) struct RestoreDefaults {
    stage: Stage,
    deadline: Option<Instant>,
    /// When the text that is being heard has to have ended.
    ends: Instant,
    heard: Option<Span>,
    /// Where in the record the answer to the Yes begins.
    from: u64,
    /// What the unit says before its banner that sounds like a failure.
    failure: Option<(String, Span)>,
    /// Lines since the Yes, and lines of the menu behind them: their letters.
    since: BTreeSet<String>,
    menu: BTreeSet<String>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    /// D is out.
    #[default]
    Asked,
    /// Yes is out.
    Confirmed,
    /// A product has been named: the banner goes on, or a menu does.
    Banner,
    /// M is out, to know what is no banner.
    Menu,
}

impl RestoreDefaults {
    fn listen(&mut self, stage: Stage, within: Duration, desk: &Desk<'_>) {
        self.stage = stage;
        self.ends = desk.now + LONGEST.max(within);
        self.deadline = Some(desk.now + within);
    }

    fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.heard = Some(text.span);
        match (self.stage, message) {
            (Stage::Asked, Message::Prompt(Prompt::ConfirmDefaults)) => {
                desk.send(b"Yes\r");
                self.from = desk.received;
                self.listen(Stage::Confirmed, RESET, desk);
            }
            (Stage::Asked, _) | (_, Message::Row(_)) => {}
            (Stage::Confirmed, Message::Refusal) => {
                return Some(refused("the unit did not restore its defaults".into(), self.heard));
            }
            (Stage::Confirmed, _) => {
                // The question may stand before it, unless a row of the stream has parted them.
                let question = self.from.saturating_sub(text.span.start) as usize;
                let said = text.text.get(question..).filter(|said| !said.is_empty()).unwrap_or(&text.text);
                if *message == Message::Text && tells_of_failure(said) {
                    self.failure.get_or_insert((visible::line(said.trim().as_bytes()), text.span));
                }
                note(&mut self.since, said);
                if matches!(message, Message::Software(name) if name.product.is_some()) {
                    self.listen(Stage::Banner, QUIET, desk);
                }
            }
            (Stage::Banner, _) => {
                note(&mut self.since, &text.text);
                self.deadline = Some((desk.now + QUIET).min(self.ends));
            }
            (Stage::Menu, _) => {
                note(&mut self.menu, &text.text);
                self.deadline = Some((desk.now + QUIET).min(self.ends));
            }
        }
        None
    }

    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let no_answer = |awaited, heard| Some(Outcome::NoAnswer { job: Job::RestoreDefaults, awaited, heard });
        let failure = self.failure.take();
        match self.stage {
            Stage::Asked => {
                let heard = desk.pending.map(|text| text.span).or(self.heard);
                self.decline(desk);
                no_answer(Awaited::DefaultsQuestion, heard)
            }
            Stage::Confirmed | Stage::Banner if failure.is_some() => {
                let (said, span) = failure.unzip();
                let reason = format!("behind the Yes the unit says \"{}\"", said.unwrap_or_default());
                Some(refused(reason, span))
            }
            Stage::Confirmed => no_answer(Awaited::Banner, desk.pending.map(|text| text.span).or(self.heard)),
            Stage::Banner => {
                desk.send(b"m");
                self.listen(Stage::Menu, ANSWER, desk);
                None
            }
            Stage::Menu if self.since.is_subset(&self.menu) => Some(Outcome::DefaultsTaken),
            Stage::Menu => Some(Outcome::Done(Job::RestoreDefaults)),
        }
    }

    /// Leaves a question that is not understood. A bare Enter is a Yes to many a question: `[Y/n]`.
    fn decline(&self, desk: &mut Desk<'_>) {
        if self.stage == Stage::Asked {
            desk.send(b"No\r");
        }
    }
}

fn refused(reason: String, heard: Option<Span>) -> Outcome {
    Outcome::Refused { job: Job::RestoreDefaults, reason, heard }
}

/// Keeps a line by its letters: numbers in a menu may have changed since. The echo of what was sent is none.
fn note(lines: &mut BTreeSet<String>, line: &str) {
    let letters: String = line.chars().filter(|letter| letter.is_alphabetic()).collect();
    if letters.len() > 1 && !letters.eq_ignore_ascii_case("yes") && lines.len() < MOST_LINES {
        lines.insert(letters.to_lowercase());
    }
}

/// Whether a line behind the Yes tells that nothing has come of it: "Not done", "Restoring failed", "EEPROM write error".
/// That errors have been cleared is none.
fn tells_of_failure(line: &str) -> bool {
    let lower = line.to_lowercase();
    let words: Vec<&str> =
        lower.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let clears = ["clear", "erase", "reset"].iter().any(|word| lower.contains(word));
    let done = ["done", "restored", "changed", "saved", "stored", "written", "successful", "ok", "possible", "reset"];
    // "Do not switch off" is none.
    let is_not_done = |pair: &[&str]| pair[0] == "not" && done.contains(&pair[1]);
    let fails = |word: &&str| matches!(*word, "cannot" | "unable") || word.starts_with("fail");
    words.windows(2).any(is_not_done) || words.iter().any(fails) || (!clears && complains(line))
}

impl Work for RestoreDefaults {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin => {
                desk.send(b"d");
                self.listen(Stage::Asked, ANSWER, desk);
                None
            }
            Signal::Heard(text, message) => self.heard(text, message, desk),
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.time_is_up(desk),
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Cancel => {
                self.decline(desk);
                Some(Outcome::Cancelled(Job::RestoreDefaults))
            }
            Signal::LinkLost => Some(Outcome::Cancelled(Job::RestoreDefaults)),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        self.stage == Stage::Asked && prompt == Prompt::ConfirmDefaults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_tells_of_a_failure_does_so_in_its_own_words() {
        for line in ["Not done", "Restoring failed", "EEPROM write error", "FAILURE 3", "Cannot write"] {
            assert!(tells_of_failure(line), "{line}");
        }
        for line in ["Done.", "Defaults restored", "Error list cleared", "Errors: 0", "Resetting, do not switch off"] {
            assert!(!tells_of_failure(line), "{line}");
        }
    }
}
