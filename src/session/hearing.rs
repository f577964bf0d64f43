//! From bytes to what they mean: the record first, then lines and questions, then messages, then facts.
//!
//! What may hold the password is separated on the way, so that it reaches no record, message or fact.

use super::event::{Event, Job, Known, Origin, UnitState};
use super::job::Signal;
use super::redactor::Piece;
use super::watching::Saw;
use super::{Mode, Session};
use crate::endpoint::Secrecy;
use crate::record::{Direction, REDACTED};
use crate::time::{Duration, Instant};
use crate::wire::{Confidence, Item, LoaderText, MenuKey, Message, NmtState, Prompt, Text, is_question};

/// Silence after a text without a line end that makes it a prompt: several character times, and more than an adapter's
/// latency of 16 ms.
const PROMPT_QUIET: Duration = Duration::from_millis(60);

/// Silence after a complete line that makes it a question, if it may be one: a text that only mentions the subject goes
/// on. Less than a job waits after such a line.
const LINE_QUIET: Duration = Duration::from_millis(250);

/// Up to this many bytes, a text is checked for the question for the password while it comes. A longer one is checked
/// when the unit has fallen silent.
const LONGEST_PROMPT: usize = 200;

/// How long what comes after a request for the menu counts as its answer.
pub(super) const MENU_ANSWER: Duration = Duration::from_millis(1500);

/// How long after its header a loader may print that it wants a key.
const LOADER_HEADER: Duration = Duration::from_secs(2);

/// Watches for text without a line end after which the unit falls silent.
#[derive(Debug, Default)]
pub(super) struct PromptWatch {
    /// When the text counts as a prompt.
    pub(super) due: Option<Instant>,
    /// End of the text that has been looked at already.
    seen: u64,
    /// The last text that was understood without its line end.
    heard: Option<Text>,
    /// The last line, if it may be a question that a job waits for, and when it counts as one.
    line: Option<(Instant, Text, Prompt)>,
}

impl PromptWatch {
    /// Whether this line is a text that has been understood already, and only its end has come since.
    fn was(&self, line: &Text) -> bool {
        let same = |heard: &Text| heard.span.start == line.span.start && heard.text.trim() == line.text.trim();
        self.heard.as_ref().is_some_and(same)
    }

    /// Whether this text has been looked at to its end.
    pub(super) fn has_seen(&self, text: &Text) -> bool {
        text.span.end <= self.seen
    }

    /// When the last line counts as a question.
    pub(super) fn line_due(&self) -> Option<Instant> {
        self.line.as_ref().map(|(due, ..)| *due)
    }

    /// Text has followed the line. If it has letters or digits, the line was no question; signs alone mark the place
    /// for the answer.
    fn goes_on(&mut self, now: Instant, pending: Option<&Text>) {
        let Some(text) = pending else { return };
        if text.text.contains(char::is_alphanumeric) {
            self.line = None;
        }
        if let Some((due, ..)) = &mut self.line {
            *due = now + LINE_QUIET;
        }
    }

    /// Nothing is waited for any more.
    pub(super) fn forget(&mut self) {
        (self.due, self.line) = (None, None);
    }
}

impl Session {
    /// Appends to the record; the echo of the password is secret, and the password itself wherever it appears.
    pub(super) fn append(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let pieces = self.password.take(&mut rest);
            self.take_in(pieces);
        }
        self.password.wait_for_more(self.now);
    }

    /// Takes what looked like the beginning of the password, since nothing has followed it for long enough.
    pub(super) fn hand_out_echo(&mut self) {
        let pieces = self.password.hand_out();
        self.take_in(pieces);
    }

    fn take_in(&mut self, pieces: Vec<Piece>) {
        for (bytes, secrecy) in pieces {
            self.record.push(self.dated, Direction::FromUnit, secrecy, &bytes);
            // What is read from here on is what the record shows.
            match secrecy {
                Secrecy::Open => self.frame(&bytes),
                Secrecy::Secret => self.frame(&vec![REDACTED; bytes.len()]),
            }
        }
    }

    fn frame(&mut self, bytes: &[u8]) {
        let mut items = Vec::new();
        self.framer.push(bytes, |item| items.push(item));
        for item in items {
            match item {
                Item::Line(text) => self.line(text),
                Item::Hold(held) => {
                    self.transmitter.hold(self.now, held);
                    self.events.push_back(Event::Held(held));
                    self.signal(Signal::Hold(held));
                }
            }
        }
        let pending = self.framer.pending();
        self.prompt.goes_on(self.now, pending.as_ref());
        let asks_password = pending.as_ref().is_some_and(|text| {
            text.text.len() <= LONGEST_PROMPT && self.vocabulary.asks_password(&text.text, self.is_after_load())
        });
        if asks_password {
            self.password.question();
        }
        self.prompt.due = pending.map(|_| self.now + PROMPT_QUIET);
    }

    /// A line is complete.
    fn line(&mut self, mut text: Text) {
        self.prompt.line = None;
        let recognises = self.mode != Mode::Plain;
        if recognises {
            self.password.scrub(&mut text.text);
        }
        let matters = self.password.is_asked() || recognises;
        let before_row = matters.then(|| self.vocabulary.before_row(&text.text)).flatten();
        // Rows of the stream may go on while the unit waits for its password.
        let still_asks = match before_row {
            Some((prompt, _)) => prompt == Some(Prompt::Password),
            None => self.password.is_asked() && self.vocabulary.is_row(&text.text),
        };
        if !still_asks {
            self.password.question_over();
        }
        if !recognises {
            return;
        }
        if self.prompt.was(&text) {
            return;
        }
        if let Some((prompt, at)) = before_row {
            if prompt == Some(Prompt::Password) {
                self.password.question();
            }
            let row = Text { text: text.text.split_off(at), ..text.clone() };
            if !self.prompt.was(&text) {
                let message = prompt.map_or_else(|| self.understand(&text.text), Message::Prompt);
                self.heard(text, message);
            }
            text = row;
        }
        let message = self.understand(&text.text);
        let asks = (message == Message::Text).then(|| self.asked_in_a_line(&text.text)).flatten();
        self.prompt.line = asks.map(|prompt| (self.now + LINE_QUIET, text.clone(), prompt));
        self.heard(text, message);
    }

    /// The question that a complete line may be: one that the running job waits for.
    fn asked_in_a_line(&self, line: &str) -> Option<Prompt> {
        let running = self.running.as_ref()?;
        if !is_question(line) {
            return None;
        }
        let is_password = self.vocabulary.asks_password(line, self.is_after_load());
        let prompt = if is_password { Some(Prompt::Password) } else { self.vocabulary.prompt(line) };
        prompt.filter(|&prompt| running.work.awaits(prompt))
    }

    /// Looks at the text after which the unit has fallen silent, if it has been silent for long enough.
    pub(super) fn look_if_due(&mut self) {
        if self.prompt.due.is_some_and(|due| due <= self.now) {
            self.look_at_prompt();
        }
        let now = self.now;
        let Some((_, text, prompt)) = self.prompt.line.take_if(|(due, ..)| *due <= now) else { return };
        if self.running.as_ref().is_some_and(|running| running.work.awaits(prompt)) {
            self.signal(Signal::Heard(&text, &Message::Prompt(prompt)));
        }
    }

    /// Looks at a text without a line end after which the unit has fallen silent.
    pub(super) fn look_at_prompt(&mut self) {
        self.prompt.due = None;
        let Some(mut text) = self.framer.pending() else { return };
        self.password.scrub(&mut text.text);
        self.prompt.seen = text.span.end;
        let is_password = self.vocabulary.asks_password(&text.text, self.is_after_load());
        let message = match self.vocabulary.prompt(&text.text) {
            _ if is_password => Message::Prompt(Prompt::Password),
            Some(prompt) => Message::Prompt(prompt),
            None => self.understand(&text.text),
        };
        if message != Message::Text {
            self.prompt.heard = Some(text.clone());
            self.heard(text, message);
        }
    }

    /// L has been sent, and nothing has been answered since: a question that comes now is that for the password, or
    /// leads to it.
    fn is_after_load(&self) -> bool {
        self.keys.question() == Some(MenuKey::Load)
    }

    /// Notes that the stream has stopped, once there has been no sign of it for long enough.
    pub(super) fn look_at_stream(&mut self) {
        if self.toggled.is_over(self.dated) {
            self.stream_stopped();
        }
    }

    pub(super) fn stream_stopped(&mut self) {
        if self.facts.stream.take().is_some() {
            self.events.push_back(Event::FactsChanged);
        }
    }

    /// What a line means. A row without a number looks the same from either source: it counts as the one asked for.
    fn understand(&self, line: &str) -> Message {
        match self.vocabulary.line(line) {
            Message::Row(row) => {
                let other = self.source.and_then(|source| self.vocabulary.row_as(line, &row, source));
                Message::Row(other.unwrap_or(row))
            }
            other => other,
        }
    }

    fn heard(&mut self, text: Text, message: Message) {
        if self.toggled.heard(self.dated, &message) {
            self.stream_stopped();
        }
        self.learn(&text, &message);
        // A unit that starts has forgotten that it stopped us, and will never send the XON.
        let starts = matches!(
            message,
            Message::Software(_)
                | Message::FirstStart
                | Message::Loader(LoaderText::Header | LoaderText::Waiting)
                | Message::Prompt(Prompt::WaitingForFile)
        );
        if starts || matches!(message, Message::MenuKey(_)) {
            self.question_over();
            self.password.at_menu();
        }
        if starts && self.transmitter.held_since().is_some() {
            self.transmitter.hold(self.now, false);
            self.events.push_back(Event::Held(false));
        }
        self.events.push_back(match &message {
            Message::Row(row) => Event::Row { at: self.dated, span: text.span, row: row.clone() },
            _ => Event::Heard { at: self.dated, span: text.span, message: message.clone() },
        });
        self.signal(Signal::Heard(&text, &message));
        self.watch(Saw::Heard(&text, &message));
    }

    /// Folds a message into the facts.
    fn learn(&mut self, text: &Text, message: &Message) {
        let span = text.span;
        let before = self.facts.clone();
        let asked = self.menu_asked_at.is_some_and(|at| self.now <= at + MENU_ANSWER);
        // What comes in a dialogue is not a banner, except in those that end with a reset.
        let talks = matches!(self.job(), Some(Job::Identify | Job::ReadDictionary | Job::StreamOn | Job::StreamOff));
        let asked = asked || talks;
        let come = self.facts.diagnostics.is_some();
        let pages = self.job() == Some(Job::Diagnostics) || self.dialogue.shows_pages(self.dated) || (come && !asked);
        let origin = if asked { Origin::Menu } else { Origin::Banner };
        let is_page = come && self.pages.owns(&text.text);
        self.counted = *message == Message::Text && !is_page && !self.dialogue.owns(self.dated, &text.text);
        let identifies = self.job() == Some(Job::Identify);
        let facts = &mut self.facts;
        // While the unit is being identified, its state is decided once the whole answer has come.
        if facts.state == UnitState::Silent && !identifies {
            facts.state = UnitState::Unknown;
        }
        match message {
            Message::Text => facts.unrecognised_lines += u64::from(self.counted),
            Message::Refusal | Message::Prompt(_) => {}
            Message::Row(row) => {
                facts.state = UnitState::Application;
                facts.stream = Some(row.source);
                if row.readings.iter().any(|reading| reading.value().is_some()) {
                    self.source = Some(row.source);
                }
            }
            Message::MenuKey(_) => {
                facts.state = UnitState::Application;
                facts.unrecognised_lines = facts.unrecognised_lines.saturating_sub(self.dialogue.menu());
            }
            Message::FirstStart => facts.state = UnitState::Application,
            // An application may print "press any key" and "restarting" as well.
            Message::Loader(LoaderText::Waiting) => facts.enter_loader(),
            Message::Loader(_) => {}
            Message::Software(name) => {
                // Three numbers with points between them do not show that what talks is a unit.
                if name.product.is_some() || name.confidence > Confidence::Bare {
                    facts.state = UnitState::Application;
                }
                if name.product.is_some() {
                    self.dialogue.named();
                }
                // An object in the view may have the product's name; a banner has the version as well.
                if name.product.is_some() && name.version.is_some() && !asked && facts.stream.is_some() {
                    self.toggled.restarted(self.dated);
                }
                if let Some(product) = &name.product {
                    facts.name_product(Known { value: product.clone(), origin, span });
                }
                if let Some(version) = name.version {
                    facts.version = Some(Known { value: version, origin, span });
                }
            }
            Message::Network(network) => {
                let origin = if pages { Origin::Diagnostics } else { origin };
                if let Some(value) = network.node_id {
                    facts.node_id = Some(Known { value, origin, span });
                }
                if let Some(value) = network.can_kbps {
                    facts.can_kbps = Some(Known { value, origin, span });
                }
                if let Some(state) = network.nmt_state {
                    facts.nmt_state = Some(Known { value: NmtState::name(state).to_owned(), origin, span });
                }
            }
        }
        if matches!(message, Message::Prompt(Prompt::WaitingForFile)) {
            facts.enter_loader();
        }
        // What prints a loader's header and then wants a key is a loader.
        let headed = self.loader_headed_at.is_some_and(|at| self.dated <= at + LOADER_HEADER);
        let wants_key = matches!(message, Message::Loader(LoaderText::AnyKey) | Message::Prompt(Prompt::AnyKey));
        if headed && wants_key {
            facts.enter_loader();
        }
        self.loader_headed_at = match message {
            Message::Loader(LoaderText::Header) => Some(self.dated),
            Message::Text => self.loader_headed_at,
            _ => None,
        };
        if *facts != before {
            self.events.push_back(Event::FactsChanged);
        }
    }
}
