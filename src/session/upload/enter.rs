//! The way into the loader: which unit is there, whether the image fits it, L, the password, a key if the loader wants
//! one, and the loader's prompt.

use super::super::event::{Facts, Outcome, UnitState};
use super::super::identify::Identify;
use super::super::job::{Desk, Signal, Work};
use super::super::leaving::{ENTER, Leaving};
use super::{Answer, Attempt, FILLER, Stage, Transfer, Unheard, UnitNow, Upload, Verdict, shows_application};
use crate::device::{Product, longest_erase};
use crate::image::Software;
use crate::record::REDACTED;
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, Message, Prompt, Text, is_question, is_word_of_refusal, visible};

/// How long the unit may take to ask for the password.
const PASSWORD_PROMPT: Duration = Duration::from_millis(2500);
/// How long the rest of a question may take if what has come of it does not end in a sign such as `:`. A slow unit
/// prints it in pieces, and keys sent between them may be lost.
const REST_OF_THE_QUESTION: Duration = Duration::from_millis(500);
/// How long the question may take after something that sounds like a refusal, but may be a note before the question: "A
/// wrong password is refused."
const QUESTION_AFTER_A_NOTE: Duration = Duration::from_millis(500);
/// How long after the password the loader's prompt, or a refusal, may take.
const LOADER_PROMPT: Duration = Duration::from_secs(8);
/// How long after a question has been left the unit may ask another one.
const LEFT: Duration = Duration::from_millis(600);
/// Letters that are enough to recognise a question when it comes again.
const SHORTEST_QUESTION: usize = 3;
/// Silence after the loader's prompt before the first record: by then whatever else it prints should have come.
const SETTLE: Duration = Duration::from_millis(80);
/// How long a loader may go on printing after its prompt. Whatever prints longer is not taken for a loader.
const LONGEST_SETTLE: Duration = Duration::from_secs(3);
/// How long a loader that was found waiting may take to report the keys sent to identify it as an error.
const CLEAR_LINE: Duration = Duration::from_millis(300);
/// How long after the password a loader that wants a key may take to ask for it, before the key is sent unasked. Less
/// than the 10 s for which the loader waits for a key (errata E-I12).
const UNASKED_KEY: Duration = Duration::from_millis(3000);
/// The same after the loader's header, or after a key that had no effect.
const UNASKED_KEY_AFTER_HEADER: Duration = Duration::from_millis(1000);
/// How many keys are sent to a loader at most: its reset may take longer than expected, and the line may lose one.
const MOST_KEYS: u32 = 3;
/// How long a loader may take, after the longest time for erasing, to say something.
const AFTER_THE_ERASE: Duration = Duration::from_secs(4);

impl Upload {
    /// The unit has been identified, or is silent: decides whether the image may be sent, and asks for the loader.
    pub(super) fn checked(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let facts: Facts = desk.facts.clone();
        self.version_before = facts.version.as_ref().map(|known| known.value);
        // What an application said before this job may be true of another unit: nothing shows that the cable was moved.
        // A loader does not name its product, which is still the one that was known when the loader was entered.
        let is_loader = facts.state == UnitState::Loader;
        let said = facts.product.as_ref().filter(|known| is_loader || known.span.start >= self.asked_from);
        let said = said.map(|known| known.value.clone());
        match facts.state {
            UnitState::Silent if self.may_come_back(desk) => {
                let mut identify = Identify::default();
                let outcome = identify.handle(Signal::Begin, desk);
                self.stage = Stage::Check(identify);
                return outcome.and_then(|_| self.checked(desk));
            }
            UnitState::Silent => {
                return self.end(desk, Verdict::NoAnswer, UnitNow::Unknown, "nothing answers on this port");
            }
            UnitState::Unknown => {
                let what = "something talks on this port, but it is not a unit this program knows";
                return self.end(desk, Verdict::NoAnswer, UnitNow::Unknown, what);
            }
            UnitState::Application | UnitState::Loader => {}
        }
        self.found_in_loader = facts.state == UnitState::Loader;
        self.asked_in_loader = self.found_in_loader.then_some(desk.now);
        let unit = if self.found_in_loader { UnitNow::Loader } else { UnitNow::Application };
        let ordered = self.order.product.clone();
        if let (Some(said), Some(ordered)) = (&said, &ordered)
            && !said.eq_ignore_ascii_case(ordered)
        {
            self.product = Some(said.clone());
            let what = format!("the unit is an {said}, not an {ordered}");
            return self.end(desk, Verdict::Refused, unit, what);
        }
        let Some(product) = said.or(ordered) else {
            desk.facts.product = None;
            let what = "the unit does not say which product it is";
            return self.end(desk, Verdict::Refused, unit, what);
        };
        let Some(known) = Product::named(&product) else {
            let what = format!("{product} is not a product this program knows");
            return self.end(desk, Verdict::Refused, unit, what);
        };
        self.product = Some(known.name.clone());
        let loader = self.order.loader.unwrap_or(known.loader.kind);
        let ran = self.order.ran.map(Software::Ran);
        let software = self.version_before.map(Software::Runs).or(ran);
        let misfits = self.order.image.misfits(&known.target_with(loader), software);
        if let Some(misfit) = misfits.into_iter().find(|misfit| !self.order.allowed.contains(&misfit.id)) {
            self.misfit = Some(misfit.id);
            return self.end(desk, Verdict::Refused, unit, misfit.message);
        }
        let (packed, flaw) = (self.order.packed, self.order.flaw);
        self.transfer = Some(Transfer::new(self.order.image.image(), &known.flash, loader.pacing(), packed, flaw));
        self.mark = desk.received;
        if self.found_in_loader {
            // The keys sent to identify the loader may still be in its line buffer. Enter makes an error of them now,
            // and not together with the first record.
            desk.send(b"\r");
            self.stage = Stage::Settle { until: desk.now + LONGEST_SETTLE };
            self.deadline = Some(desk.now + CLEAR_LINE);
        } else {
            desk.send(b"l");
            // What was heard before is not an answer to L.
            self.heard.clear();
            self.stage = Stage::AskedForLoader(Answer::None);
            self.deadline = Some(desk.now + PASSWORD_PROMPT);
        }
        self.report_progress(desk);
        None
    }

    /// Something was heard after L, or after the password.
    pub(super) fn entering(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        let password_sent = matches!(self.stage, Stage::PasswordSent);
        match message {
            // Some units ask for no password.
            Message::Loader(LoaderText::Waiting) | Message::Prompt(Prompt::WaitingForFile) => {
                return self.entered(desk);
            }
            Message::Prompt(Prompt::Password) if !password_sent => {
                if text.text.trim_end().ends_with(|end: char| !end.is_alphanumeric()) {
                    self.send_password(&text.text, desk);
                } else {
                    self.stage = Stage::AskedForLoader(Answer::Question);
                    self.deadline = Some(desk.now + REST_OF_THE_QUESTION);
                }
            }
            Message::Prompt(Prompt::AnyKey) | Message::Loader(LoaderText::AnyKey) => self.send_key(desk),
            Message::Loader(LoaderText::Header) if password_sent && self.asks_for_key() => {
                self.unheard = Some((desk.now + UNASKED_KEY_AFTER_HEADER, Unheard::Key));
            }
            _ if password_sent && self.is_refusal(text, message) => {
                let what = "the unit did not accept the password";
                if matches!(message, Message::MenuKey(_)) {
                    return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
                }
                // The unit may ask for the password once more.
                self.turn_back(desk, Verdict::UnitRefused, what);
            }
            Message::Prompt(_) if !password_sent => {
                self.turn_back(desk, Verdict::NoAnswer, "the unit asks for something other than the password");
            }
            Message::Refusal => {
                let soon = desk.now + QUESTION_AFTER_A_NOTE;
                self.stage = Stage::AskedForLoader(Answer::Refusal);
                self.deadline = Some(self.deadline.map_or(soon, |deadline| deadline.min(soon)));
            }
            _ => {}
        }
        None
    }

    /// The unit asks for the password: sends it, or gives up if there is none.
    pub(super) fn send_password(&mut self, question: &str, desk: &mut Desk<'_>) {
        let Some(password) = &self.order.password else {
            return self.turn_back(desk, Verdict::UnitRefused, "the unit asks for its password, and none was given");
        };
        desk.send_secret(password.reveal());
        self.question = letters(question);
        self.password_sent = true;
        self.stage = Stage::PasswordSent;
        self.deadline = Some(desk.now + LOADER_PROMPT);
        self.unheard = self.asks_for_key().then_some((desk.now + UNASKED_KEY, Unheard::Key));
    }

    /// Gives up, with the application as it was: leaves the question at hand, and ends the job once none is open.
    pub(super) fn turn_back(&mut self, desk: &mut Desk<'_>, verdict: Verdict, what: &str) {
        let outcome = self.outcome(desk, verdict, UnitNow::Application, what);
        self.leaving = Some(Leaving::begin(ENTER, LEFT, desk, outcome));
    }

    /// The unit has said something that sounds like a refusal, and no question has followed.
    pub(super) fn refused(&mut self, desk: &mut Desk<'_>) {
        self.turn_back(desk, Verdict::UnitRefused, "the unit refuses to load new software");
    }

    /// The unit has not asked for the password in time, or has done so in unknown words.
    pub(super) fn not_asked(&mut self, desk: &mut Desk<'_>) {
        if let Some(question) = desk.pending {
            self.heard = visible::quoted(&question.text);
        }
        let (verdict, what) = match (desk.pending, self.heard.is_empty()) {
            (Some(_), _) => {
                (Verdict::NoAnswer, "the unit asks something that is not understood, and not for its password")
            }
            (None, false) => (Verdict::NoAnswer, "the unit does not ask for its password in words that are understood"),
            (None, true) => (Verdict::UnitRefused, "the unit does not ask for the password"),
        };
        self.turn_back(desk, verdict, what);
    }

    /// The loader has prompted for the file.
    pub(super) fn entered(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.unheard = None;
        if self.cancelled {
            return self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled; nothing has been sent");
        }
        self.attempt = Attempt::default();
        self.stage = Stage::Settle { until: desk.now + LONGEST_SETTLE };
        self.deadline = Some(desk.now + SETTLE);
        None
    }

    /// The loader has printed more after its prompt: the wait for silence starts over.
    pub(super) fn settling(&mut self, message: &Message, until: Instant, desk: &mut Desk<'_>) -> Option<Outcome> {
        if shows_application(message) || matches!(message, Message::Prompt(Prompt::Password)) {
            let what = "the unit left its loader before the file was sent";
            return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
        }
        if desk.now >= until {
            let what = "the loader asks for the file, but does not stop talking";
            return self.end(desk, Verdict::UnitRefused, UnitNow::Unknown, what);
        }
        let quiet = desk.now + SETTLE;
        self.deadline = Some(self.deadline.map_or(quiet, |deadline| deadline.max(quiet)).min(until));
        None
    }

    /// Sends a key to a loader that wants one, and later another, in case this one is lost or comes too early.
    pub(super) fn send_key(&mut self, desk: &mut Desk<'_>) {
        if self.keys_sent < MOST_KEYS {
            self.keys_sent += 1;
            desk.send(b"\r");
            self.unheard = Some((desk.now + UNASKED_KEY_AFTER_HEADER, Unheard::Key));
        }
    }

    /// No loader has prompted for the file in time: identifies the unit once more.
    pub(super) fn ask_who(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.unheard = None;
        if desk.transmitter.keeps_secret() {
            // The password that is still queued is withdrawn as the job ends.
            let what = "the unit asks for its password, but does not take it (held by XOFF)";
            return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
        }
        let mut identify = Identify::default();
        let outcome = identify.handle(Signal::Begin, desk);
        self.stage = Stage::AskWho(identify);
        outcome.and_then(|_| self.who_is_there(desk))
    }

    /// Decides what has become of a unit that took the password and did not show its loader.
    pub(super) fn who_is_there(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let (unit, what) = match desk.facts.state {
            UnitState::Loader => return self.entered(desk),
            UnitState::Application => {
                (UnitNow::Application, "the unit did not go into its loader; perhaps it did not accept the password")
            }
            UnitState::Silent | UnitState::Unknown => {
                (UnitNow::Unknown, "the password was sent, but no loader asks for the file")
            }
        };
        self.end(desk, Verdict::UnitRefused, unit, what)
    }

    /// Whether a silent unit is asked again, since it may be a loader: one that an earlier upload has left in the
    /// middle of a record, and that takes every question for the rest of it, or one that erases its flash and does not
    /// listen. Only if the order names the product, as it does after an interrupted upload. The first call sends
    /// [`FILLER`].
    fn may_come_back(&mut self, desk: &mut Desk<'_>) -> bool {
        let Some(product) = self.order.product.as_deref().and_then(Product::named) else { return false };
        if self.patience.is_none() {
            self.patience = Some(desk.now + longest_erase(&product.flash) + AFTER_THE_ERASE);
            self.fill_up(desk);
        }
        self.patience.is_some_and(|until| desk.now < until)
    }

    pub(super) fn fill_up(&mut self, desk: &mut Desk<'_>) {
        self.attempt.filled = true;
        desk.send(&FILLER);
    }

    /// Whether the answer to the password shows that it was not accepted. A unit that says "Wrong password" to the password
    /// `wrong` says "***** password" here.
    fn is_refusal(&self, text: &Text, message: &Message) -> bool {
        match message {
            Message::Refusal | Message::MenuKey(_) | Message::Prompt(Prompt::Password) => true,
            Message::Text => {
                let is_starred = text.text.contains(char::from(REDACTED)) && text.text.contains(char::is_alphabetic);
                is_starred && self.order.password.as_ref().is_some_and(|password| is_word_of_refusal(password.reveal()))
            }
            _ => false,
        }
    }

    /// The password is out, and the unit asks for it once more, in the words it has asked in before.
    pub(super) fn is_asked_again(&self, desk: &Desk<'_>) -> bool {
        desk.pending.filter(|text| is_question(&text.text)).is_some_and(|text| {
            let asked = letters(&text.text);
            // The echo of the key may have come before the first one.
            let is_same = asked.contains(&self.question) || self.question.ends_with(&asked);
            asked.len().min(self.question.len()) >= SHORTEST_QUESTION && is_same
        })
    }

    fn asks_for_key(&self) -> bool {
        self.product.as_deref().and_then(Product::named).is_some_and(|product| product.loader.asks_for_key)
    }
}

/// The letters of a question: what stays of it when it is asked again, perhaps with the number of tries that are left.
fn letters(question: &str) -> String {
    question.chars().filter(char::is_ascii_alphabetic).map(|letter| letter.to_ascii_lowercase()).collect()
}
