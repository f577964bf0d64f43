//! Talks with the firmware: switching the stream on and off (T).
//!
//! Questions are answered by what they offer. A question that is not understood is left with Enter and no answer, and
//! the job says what it was waiting for; it never guesses. A unit may take the Enter for its default value, and stream:
//! then the stream is switched off again.

use super::event::{Awaited, Job, Outcome};
use super::job::{Desk, Signal, Work};
use super::leaving::{ENTER, Leaving};
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;
use crate::wire::{Message, Prompt, SourceKeys, Text, is_question, visible};

/// How long a unit may take to ask or to answer.
pub(super) const ANSWER: Duration = Duration::from_millis(1500);
/// How long a single key may go without a reaction before Enter is sent after it.
const KEY_ALONE: Duration = Duration::from_millis(400);
/// How long after a line that follows T the question may take; without one, T has switched the stream off.
pub(super) const NO_QUESTION: Duration = Duration::from_millis(400);
/// How long after T rows may still arrive that were on their way, in an adapter and in the unit's own buffer.
pub(super) const ROWS_ON_THEIR_WAY: Duration = Duration::from_millis(300);
/// How often T is pressed to switch the stream off: it may be lost on the line.
const MOST_TOGGLES: u32 = 3;
/// How long after the repetition time the unit may refuse it, or ask for it once more.
const TAKEN: Duration = Duration::from_millis(600);
/// No values come for 3 s after power-up (AXTC4CO manual, section 1.1; 5 s on the AXRTD8CO): rows may take that long.
pub(super) const FIRST_VALUES: Duration = Duration::from_secs(6);
/// How long after a question has been left the unit may ask another one, or begin to stream all the same.
const LEFT: Duration = Duration::from_millis(2500);

const ON_CANCELLED: Outcome = Outcome::Cancelled(Job::StreamOn);
const OFF_CANCELLED: Outcome = Outcome::Cancelled(Job::StreamOff);

/// Switches the stream on.
#[derive(Debug)]
pub(super) struct StreamOn {
    source: Source,
    period: Duration,
    /// The first T has switched off a stream that was on.
    was_on: bool,
    /// A stream was known to be on when the job began.
    found_on: bool,
    is_cancelled: bool,
    /// The last line since T is worded as a question.
    asks: bool,
    stage: OnStage,
    /// Set once the outcome is known and an open question is left, unanswered.
    leaving: Option<Leaving>,
    deadline: Option<Instant>,
    heard: Option<Span>,
    /// The question for the repetition time, in which many units name the times they take.
    question: Option<String>,
}

#[derive(Debug)]
enum OnStage {
    /// T has been sent: a question says that the stream was off, its absence that it was on and is off now.
    Toggled,
    /// The key for the source has been sent.
    Source { enter_sent: bool },
    /// The period has been sent; whether the unit has asked for it once more.
    Period { again: bool },
    /// The unit has not refused the period: the stream counts as on, and its first row proves that.
    Row,
}

impl StreamOn {
    pub(super) fn new(source: Source, period: Duration) -> Self {
        StreamOn {
            source,
            period,
            was_on: false,
            found_on: false,
            is_cancelled: false,
            asks: false,
            stage: OnStage::Toggled,
            leaving: None,
            deadline: None,
            heard: None,
            question: None,
        }
    }

    fn toggle(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"t");
        self.asks = false;
        self.stage = OnStage::Toggled;
        self.deadline = Some(desk.now + ANSWER);
    }

    fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.heard = Some(text.span);
        match (&mut self.stage, message) {
            (OnStage::Toggled, Message::Prompt(_)) if self.is_cancelled => self.leave(desk, ON_CANCELLED),
            (OnStage::Toggled, Message::Prompt(Prompt::Source(keys))) => {
                desk.send(key_for(self.source, *keys).encode_utf8(&mut [0; 4]).as_bytes());
                self.stage = OnStage::Source { enter_sent: false };
                self.deadline = Some(desk.now + KEY_ALONE);
            }
            (OnStage::Source { .. } | OnStage::Toggled, Message::Prompt(Prompt::Period)) => {
                desk.send(format!("{}\r", self.period.as_millis()).as_bytes());
                self.question = Some(visible::quoted(&text.text));
                self.stage = OnStage::Period { again: false };
                self.deadline = Some(desk.now + TAKEN);
            }
            (OnStage::Period { again }, Message::Prompt(Prompt::Period)) => *again = true,
            (OnStage::Row, Message::Prompt(Prompt::Period)) => {
                let refused = self.refused(desk);
                self.leave(desk, refused);
            }
            (OnStage::Toggled, Message::Prompt(_)) => return self.give_up(Awaited::SourceQuestion, desk),
            (OnStage::Toggled, Message::Row(_)) => {}
            (OnStage::Toggled, _) => {
                self.asks = *message == Message::Text && is_question(&text.text);
                let soon = desk.now + NO_QUESTION;
                self.deadline = self.deadline.map(|deadline| deadline.min(soon));
            }
            (OnStage::Period { .. } | OnStage::Row, Message::Row(row)) if row.source == self.source => {
                return Some(self.ended(Outcome::StreamRuns { was_on: self.was_on }));
            }
            // The unit may ask once more now.
            (OnStage::Period { .. } | OnStage::Row, Message::Refusal) => {
                let refused = self.refused(desk);
                self.leaving = Some(Leaving::if_asked(ENTER, LEFT, desk.now + NO_QUESTION, refused));
            }
            _ => {}
        }
        None
    }

    fn tick(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match &mut self.stage {
            // The stream was on, and T has switched it off. It is switched on again: to set it or, if the job has been
            // cancelled, to have it as it was.
            OnStage::Toggled
                if !self.asks && desk.pending.is_none() && !self.was_on && (self.found_on || !self.is_cancelled) =>
            {
                self.was_on = true;
                self.toggle(desk);
                None
            }
            OnStage::Source { enter_sent: enter_sent @ false } => {
                desk.send(ENTER);
                *enter_sent = true;
                self.deadline = Some(desk.now + ANSWER);
                None
            }
            OnStage::Period { again: true } if desk.pending.is_some() => {
                let refused = self.refused(desk);
                self.leave(desk, refused);
                None
            }
            OnStage::Period { .. } if self.is_cancelled => Some(self.ended(Outcome::Done(Job::StreamOn))),
            OnStage::Period { .. } => {
                desk.facts.stream = Some(self.source);
                self.stage = OnStage::Row;
                self.deadline = Some(desk.now + FIRST_VALUES + self.period * 2);
                None
            }
            OnStage::Toggled => self.give_up(Awaited::SourceQuestion, desk),
            OnStage::Source { .. } => self.give_up(Awaited::PeriodQuestion, desk),
            OnStage::Row => {
                desk.facts.stream = None;
                let no_answer = self.no_answer(Awaited::Row, desk);
                if desk.pending.is_none() {
                    return Some(no_answer);
                }
                self.leave(desk, no_answer);
                None
            }
        }
    }

    fn refused(&self, desk: &mut Desk<'_>) -> Outcome {
        desk.facts.stream = None;
        let question = self.question.as_ref().map(|question| format!(", asked for with \"{question}\""));
        let millis = self.period.as_millis();
        let reason = format!("the unit did not take {millis} ms{}", question.unwrap_or_default());
        Outcome::Refused { job: Job::StreamOn, reason, heard: self.heard }
    }

    fn no_answer(&self, awaited: Awaited, desk: &Desk<'_>) -> Outcome {
        let heard = desk.pending.map(|text| text.span).or(self.heard);
        Outcome::NoAnswer { job: Job::StreamOn, awaited, heard }
    }

    /// Leaves what the unit asks, if it asks anything. Nothing more is awaited of a unit that has said nothing at all.
    fn give_up(&mut self, awaited: Awaited, desk: &mut Desk<'_>) -> Option<Outcome> {
        let no_answer = self.no_answer(awaited, desk);
        if desk.pending.is_none() && self.heard.is_none() {
            desk.leave_dialogue();
            return Some(self.ended(no_answer));
        }
        self.leave(desk, no_answer);
        None
    }

    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        self.leaving = Some(Leaving::begin(ENTER, LEFT, desk, self.ended(then)));
    }

    fn ended(&self, outcome: Outcome) -> Outcome {
        if self.is_cancelled { ON_CANCELLED } else { outcome }
    }

    fn cancel(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.is_cancelled = true;
        match &self.stage {
            // Within a moment it shows what the unit makes of the keys that have been sent.
            OnStage::Toggled | OnStage::Period { .. } => None,
            OnStage::Row if desk.pending.is_none() => Some(ON_CANCELLED),
            OnStage::Source { .. } | OnStage::Row => {
                self.leave(desk, ON_CANCELLED);
                None
            }
        }
    }
}

impl Work for StreamOn {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(leaving) = &mut self.leaving {
            // The unit has taken the Enter for its default values, and streams. If its stream was on before, it stays
            // on.
            if matches!(signal, Signal::Heard(_, Message::Row(_))) && !self.was_on {
                desk.send(b"t");
                desk.facts.stream = None;
                return Some(leaving.then());
            }
            return leaving.handle(signal, ON_CANCELLED, desk);
        }
        match signal {
            Signal::Begin => {
                self.found_on = desk.facts.stream.is_some();
                self.toggle(desk);
                None
            }
            Signal::Heard(text, message) => self.heard(text, message, desk),
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.tick(desk),
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Cancel => self.cancel(desk),
            Signal::LinkLost => Some(ON_CANCELLED),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.leaving.as_ref().map(Leaving::due).or(self.deadline)
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        match self.stage {
            _ if self.leaving.is_some() => false,
            OnStage::Toggled => matches!(prompt, Prompt::Source(_) | Prompt::Period),
            OnStage::Source { .. } => prompt == Prompt::Period,
            OnStage::Period { .. } | OnStage::Row => false,
        }
    }
}

/// Switches the stream off. Silence alone does not show that it is off: a unit without power is silent as well.
#[derive(Debug, Default)]
pub(super) struct StreamOff {
    stage: OffStage,
    /// T has opened a question.
    leaving: Option<Leaving>,
    toggled_at: Instant,
    toggles: u32,
    /// Something has come since the first T: a unit is there.
    heard: bool,
    /// The last line since T is worded as a question.
    asks: bool,
    is_cancelled: bool,
    deadline: Option<Instant>,
}

#[derive(Debug, Default)]
enum OffStage {
    /// T has been sent.
    #[default]
    Toggled,
    /// Nothing has come. The menu has been asked for, to see whether a unit is there.
    AskedMenu,
}

impl StreamOff {
    fn toggle(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"t");
        (self.stage, self.leaving, self.asks) = (OffStage::Toggled, None, false);
        self.toggled_at = desk.now;
        self.toggles += 1;
        self.deadline = Some(desk.now + ANSWER);
    }

    fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.heard = true;
        match (&self.stage, message) {
            (_, Message::Prompt(_)) => {
                desk.facts.stream = None;
                self.leave(desk, Outcome::Done(Job::StreamOff));
            }
            (OffStage::Toggled, Message::Row(_)) if desk.now < self.toggled_at + ROWS_ON_THEIR_WAY => {}
            // Rows go on, so the key was lost.
            (_, Message::Row(_)) => {
                if self.is_cancelled || self.toggles == MOST_TOGGLES {
                    return Some(self.ended(still_on(Some(text.span))));
                }
                self.toggle(desk);
            }
            _ => {
                self.asks = *message == Message::Text && is_question(&text.text);
                let soon = desk.now + NO_QUESTION;
                self.deadline = self.deadline.map(|deadline| deadline.min(soon));
            }
        }
        None
    }

    fn tick(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match (&self.stage, desk.pending) {
            // Which question it is, rows show: they go on if it was whether to stop.
            (_, None) if self.asks => {
                desk.facts.stream = None;
                self.leave(desk, Outcome::Done(Job::StreamOff));
                None
            }
            (_, Some(text)) => {
                let span = text.span;
                self.leave(desk, still_on(Some(span)));
                None
            }
            (_, None) if self.heard => {
                desk.facts.stream = None;
                Some(self.ended(Outcome::Done(Job::StreamOff)))
            }
            (OffStage::Toggled, None) if self.is_cancelled => {
                desk.leave_dialogue();
                Some(self.ended(still_on(None)))
            }
            (OffStage::Toggled, None) => {
                desk.send(b"m");
                self.stage = OffStage::AskedMenu;
                self.deadline = Some(desk.now + ANSWER);
                None
            }
            (OffStage::AskedMenu, None) => Some(self.ended(still_on(None))),
        }
    }

    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        self.leaving = Some(Leaving::begin(ENTER, LEFT, desk, self.ended(then)));
    }

    /// Takes a signal while a question is left.
    fn leave_on(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.is_cancelled |= matches!(signal, Signal::Cancel);
        let leaving = self.leaving.as_mut()?;
        match signal {
            // The Enter that left the question has switched the stream on.
            Signal::Heard(_, Message::Row(_)) if self.toggles < MOST_TOGGLES => {
                self.toggle(desk);
                None
            }
            Signal::Heard(text, Message::Row(_)) if !self.is_cancelled => {
                leaving.end_as(still_on(Some(text.span)));
                None
            }
            _ => leaving.handle(signal, OFF_CANCELLED, desk),
        }
    }

    fn ended(&self, outcome: Outcome) -> Outcome {
        if self.is_cancelled { OFF_CANCELLED } else { outcome }
    }
}

fn still_on(heard: Option<Span>) -> Outcome {
    Outcome::NoAnswer { job: Job::StreamOff, awaited: Awaited::StreamOff, heard }
}

impl Work for StreamOff {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if self.leaving.is_some() {
            return self.leave_on(signal, desk);
        }
        match signal {
            Signal::Begin => {
                self.toggle(desk);
                None
            }
            Signal::Heard(text, message) => self.heard(text, message, desk),
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.tick(desk),
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            // Within a moment it shows what T has done.
            Signal::Cancel => {
                self.is_cancelled = true;
                None
            }
            Signal::LinkLost => Some(OFF_CANCELLED),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.leaving.as_ref().map(Leaving::due).or(self.deadline)
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        self.leaving.is_none() && matches!(prompt, Prompt::Source(_) | Prompt::Period)
    }
}

fn key_for(source: Source, keys: SourceKeys) -> char {
    match source {
        Source::FieldValue => keys.field_value,
        Source::ProcessValue => keys.process_value,
    }
}
