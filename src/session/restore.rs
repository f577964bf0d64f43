//! Restoring the default object dictionary (D): the unit asks, takes a Yes, and resets itself (AXTC4CO manual, section
//! 4.1.2).
//!
//! Only the banner shows that the unit has reset itself. Many menus name product and version as a banner does, and a
//! unit that restores nothing may print its menu after the Yes. So the menu is requested afterwards, and only lines
//! that it does not have count as a banner.

use std::collections::BTreeSet;

use super::console::ANSWER;
use super::event::{Awaited, Job, Outcome};
use super::job::{Desk, Signal, Work};
use super::leaving::Leaving;
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt, Text, is_question, visible};

/// How long a reset with banner and menu may take: twice the 5 s until the AXRTD8CO has values.
const RESET: Duration = Duration::from_secs(10);
/// Silence that ends a banner, a menu or a refusal: a unit that starts may pause between its lines.
const QUIET: Duration = Duration::from_millis(1000);
/// How long a banner or a menu may go on: other text may come without end.
const LONGEST: Duration = Duration::from_secs(5);
/// Most different lines that are kept of a banner, and of a menu.
const MOST_LINES: usize = 500;
/// How often Yes is given: a unit may ask whether the user is sure.
const MOST_YES: u32 = 2;
/// What leaves a question. Many take a bare Enter for a Yes: `[Y/n]`.
const NO: &[u8] = b"No\r";

/// The job.
#[derive(Debug, Default)]
pub(super) struct RestoreDefaults {
    stage: Stage,
    /// Set once the outcome is known and an open question is left, unanswered.
    leaving: Option<Leaving>,
    deadline: Option<Instant>,
    /// When the text that is being heard, a banner or a menu, has to have ended.
    ends: Instant,
    heard: Option<Span>,
    /// How often Yes has been given.
    confirmed: u32,
    is_cancelled: bool,
    /// Where the answer to the last Yes begins, in bytes received.
    from: u64,
    /// What the unit has said before its banner that sounds like a failure.
    failure: Option<(String, Span)>,
    /// The letters of each line since the last Yes.
    since: BTreeSet<String>,
    /// The letters of each line of the menu that was requested afterwards.
    menu: BTreeSet<String>,
}

#[derive(Debug, Default)]
enum Stage {
    /// D has been sent.
    #[default]
    Asked,
    /// Yes has been sent.
    Confirmed,
    /// A product has been named: more of the banner, or of a menu, may come.
    Banner,
    /// M has been sent, to learn which of the lines belong to the menu.
    Menu,
}

impl RestoreDefaults {
    fn listen(&mut self, stage: Stage, within: Duration, desk: &Desk<'_>) {
        self.stage = stage;
        self.ends = desk.now + LONGEST.max(within);
        self.deadline = Some(desk.now + within);
    }

    fn confirm(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"Yes\r");
        self.confirmed += 1;
        self.from = desk.received;
        self.failure = None;
        self.since.clear();
        self.listen(Stage::Confirmed, RESET, desk);
    }

    fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) {
        self.heard = Some(text.span);
        match (&self.stage, message) {
            (Stage::Asked, Message::Prompt(Prompt::ConfirmDefaults)) => self.confirm(desk),
            (Stage::Asked, Message::Refusal) => self.failed(&text.text, text.span, desk),
            (Stage::Asked, _) | (_, Message::Row(_)) => {}
            (Stage::Confirmed, Message::Refusal) if !is_about_the_start(&text.text) => {
                self.failed(&text.text, text.span, desk);
            }
            (Stage::Confirmed, _) => {
                // The text may begin with the question that was answered, unless a row of the stream has come between.
                let question = self.from.saturating_sub(text.span.start) as usize;
                let said = text.text.get(question..).filter(|said| !said.is_empty()).unwrap_or(&text.text);
                match message {
                    Message::Prompt(Prompt::ConfirmDefaults) if self.asks_again(said) => return self.confirm(desk),
                    Message::Text if tells_of_failure(said) => {
                        self.failure.get_or_insert((visible::quoted(said), text.span));
                    }
                    _ => {}
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
    }

    /// Whether this asks for another Yes that the user would give. The echo of the first one, or a sentence with a yes
    /// in it, is not a question: a Yes sent then would act as keys of the menu.
    fn asks_again(&self, said: &str) -> bool {
        is_question(said) && self.confirmed < MOST_YES && self.failure.is_none() && !self.is_cancelled
    }

    /// The unit says no, and may ask something after that.
    fn failed(&mut self, said: &str, span: Span, desk: &Desk<'_>) {
        self.failure.get_or_insert((visible::quoted(said), span));
        let soon = desk.now + QUIET;
        self.deadline = self.deadline.map(|deadline| deadline.min(soon));
    }

    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let is_silent = self.heard.is_none() && desk.pending.is_none();
        let failure = self.failure.take();
        match &self.stage {
            Stage::Asked if is_silent => {
                desk.send(NO);
                Some(self.no_answer(Awaited::DefaultsQuestion, desk))
            }
            Stage::Asked => match failure {
                Some((said, span)) => {
                    let reason = format!("the unit does not ask for the Yes, but says \"{said}\"");
                    self.end_without_question(refused(reason, span), desk)
                }
                // The last line may have been a question, though it had a line end.
                None => {
                    let no_answer = self.no_answer(Awaited::DefaultsQuestion, desk);
                    self.leave(desk, no_answer);
                    None
                }
            },
            Stage::Confirmed if self.is_cancelled => self.end_without_question(CANCELLED, desk),
            Stage::Confirmed | Stage::Banner => match failure {
                Some((said, span)) => {
                    let reason = format!("after the Yes the unit says \"{said}\"");
                    self.end_without_question(refused(reason, span), desk)
                }
                None if matches!(self.stage, Stage::Banner) => {
                    desk.send(b"m");
                    self.listen(Stage::Menu, ANSWER, desk);
                    None
                }
                None => {
                    let is_asked = desk.pending.is_some();
                    let no_answer = self.no_answer(if is_asked { Awaited::NothingElse } else { Awaited::Banner }, desk);
                    self.end_without_question(no_answer, desk)
                }
            },
            Stage::Menu if self.since.is_subset(&self.menu) => Some(Outcome::DefaultsTaken),
            Stage::Menu => Some(Outcome::Done(Job::RestoreDefaults)),
        }
    }

    fn no_answer(&self, awaited: Awaited, desk: &Desk<'_>) -> Outcome {
        let heard = desk.pending.map(|text| text.span).or(self.heard);
        Outcome::NoAnswer { job: Job::RestoreDefaults, awaited, heard }
    }

    /// Ends the job with this outcome once no question is open.
    fn end_without_question(&mut self, outcome: Outcome, desk: &mut Desk<'_>) -> Option<Outcome> {
        if desk.pending.is_none() {
            return Some(outcome);
        }
        self.leave(desk, outcome);
        None
    }

    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        self.leaving = Some(Leaving::begin(NO, ANSWER, desk, then));
    }

    fn cancel(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match &self.stage {
            Stage::Asked => self.leave(desk, CANCELLED),
            // Within a moment it shows whether the unit asks once more.
            Stage::Confirmed => {
                self.is_cancelled = true;
                let soon = desk.now + ANSWER;
                self.deadline = self.deadline.map(|deadline| deadline.min(soon));
            }
            Stage::Banner | Stage::Menu => return Some(CANCELLED),
        }
        None
    }
}

const CANCELLED: Outcome = Outcome::Cancelled(Job::RestoreDefaults);

fn refused(reason: String, span: Span) -> Outcome {
    Outcome::Refused { job: Job::RestoreDefaults, reason, heard: Some(span) }
}

/// Keeps a line by its letters: numbers in a menu may have changed since. The echo of what was sent is not kept.
fn note(lines: &mut BTreeSet<String>, line: &str) {
    let letters: String = line.chars().filter(|letter| letter.is_alphabetic()).collect();
    if letters.len() > 1 && !letters.eq_ignore_ascii_case("yes") && lines.len() < MOST_LINES {
        lines.insert(letters.to_lowercase());
    }
}

/// Whether a line tells why a unit that starts has its defaults: "Parameters invalid, defaults loaded".
fn is_about_the_start(line: &str) -> bool {
    line.to_lowercase().contains("default") && !tells_of_failure(line)
}

/// Whether a line after the Yes tells that nothing has come of it: "Not done", "Restoring failed", "EEPROM write
/// error". That errors have been cleared is not a failure, and neither is what a unit says as it starts: "Watchdog
/// timeout 1 s", "Parameters invalid, defaults loaded".
fn tells_of_failure(line: &str) -> bool {
    let lower = line.to_lowercase();
    let words: Vec<&str> =
        lower.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let clears = ["clear", "erase", "reset"].iter().any(|word| lower.contains(word));
    let done = ["done", "restored", "changed", "saved", "stored", "written", "successful", "ok", "possible", "reset"];
    // "Do not switch off" is not a failure.
    let is_not_done = |pair: &[&str]| pair[0] == "not" && done.contains(&pair[1]);
    let fails = |word: &&str| matches!(*word, "cannot" | "unable") || word.starts_with("fail");
    let has_none = words.iter().any(|word| matches!(*word, "no" | "0"));
    let has_error = words.iter().any(|word| word.starts_with("error"));
    words.windows(2).any(is_not_done) || words.iter().any(fails) || (has_error && !has_none && !clears)
}

impl Work for RestoreDefaults {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(leaving) = &mut self.leaving {
            return leaving.handle(signal, CANCELLED, desk);
        }
        match signal {
            Signal::Begin => {
                desk.send(b"d");
                self.listen(Stage::Asked, ANSWER, desk);
                None
            }
            Signal::Heard(text, message) => {
                self.heard(text, message, desk);
                None
            }
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.time_is_up(desk),
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Cancel => self.cancel(desk),
            Signal::LinkLost => Some(CANCELLED),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.leaving.as_ref().map(Leaving::due).or(self.deadline)
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        matches!(self.stage, Stage::Asked) && self.leaving.is_none() && prompt == Prompt::ConfirmDefaults
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
        for line in [
            "Done.",
            "Defaults restored",
            "Error list cleared",
            "Errors: 0",
            "No errors",
            "Resetting, do not switch off",
            "Watchdog timeout 1 s",
            "Parameters invalid, defaults loaded",
        ] {
            assert!(!tells_of_failure(line), "{line}");
        }
    }
}
