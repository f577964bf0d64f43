//! Talks with the firmware: switching the stream (T).
//!
//! Questions are answered by what they offer. Where a question is not understood the job leaves the dialogue, with
//! Enter and no answer, and says what it was waiting for; it never guesses. A unit may take the Enter for a value that it
//! offers itself, and stream: then it is switched off again.

use super::event::{Awaited, Event, Job, Outcome};
use super::job::{Desk, Signal, Work};
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;
use crate::wire::{Message, Prompt, SourceKeys, Text, visible};

/// How long a unit may take to ask or to answer.
pub(super) const ANSWER: Duration = Duration::from_millis(1500);
/// How long a single key may go without a reaction before Enter is sent behind it.
const KEY_ALONE: Duration = Duration::from_millis(400);
/// How long after T a line without a question means "switched off".
pub(super) const NO_QUESTION: Duration = Duration::from_millis(400);
/// How long after T rows may still come that were on their way: those an adapter and the unit's own buffer held.
pub(super) const ROWS_ON_THEIR_WAY: Duration = Duration::from_millis(300);
/// How often T is pressed to switch the stream off: it may be lost on the line.
const MOST_TOGGLES: u32 = 3;
/// How long behind the repetition time the unit may refuse it, or ask for it once more.
const TAKEN: Duration = Duration::from_millis(600);
/// No values come for 3 s after power-up (AXTC4CO manual, section 1.1; 5 s on the AXRTD8CO): rows may take that long.
pub(super) const FIRST_VALUES: Duration = Duration::from_secs(6);
/// How long behind a question that was left its unit may ask another one, or begin to stream all the same.
const LEFT: Duration = Duration::from_millis(2500);
/// Questions that are left one behind the other.
const MOST_LEFT: u32 = 3;

/// Switches the stream on.
#[derive(Debug)]
pub(super) struct StreamOn {
    source: Source,
    period: Duration,
    was_on: bool,
    stage: OnStage,
    deadline: Option<Instant>,
    heard: Option<Span>,
    /// The question for the repetition time: many a unit names in it what it takes.
    question: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OnStage {
    /// T is out: a question says that the stream was off, its absence that it was on and is off now.
    Toggled,
    /// The key for the source is out.
    Source { enter_sent: bool },
    /// The period is out; whether the unit has asked for it once more.
    Period { again: bool },
    /// Nobody has refused it: the stream is on, and its first row proves that.
    Row,
    /// A question was not understood and has been left, as this many before it.
    Left { awaited: Awaited, questions: u32, heard: Option<Span> },
}

impl StreamOn {
    pub(super) fn new(source: Source, period: Duration) -> Self {
        let stage = OnStage::Toggled;
        StreamOn { source, period, was_on: false, stage, deadline: None, heard: None, question: None }
    }

    fn toggle(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"t");
        self.stage = OnStage::Toggled;
        self.deadline = Some(desk.now + ANSWER);
    }

    fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.heard = Some(text.span);
        match (self.stage, message) {
            (OnStage::Toggled, Message::Prompt(Prompt::Source(keys))) => {
                desk.send(key_for(self.source, *keys).encode_utf8(&mut [0; 4]).as_bytes());
                self.stage = OnStage::Source { enter_sent: false };
                self.deadline = Some(desk.now + KEY_ALONE);
            }
            (OnStage::Source { .. } | OnStage::Toggled, Message::Prompt(Prompt::Period)) => {
                desk.send(format!("{}\r", self.period.as_millis()).as_bytes());
                self.question = Some(visible::line(text.text.trim().as_bytes()));
                self.stage = OnStage::Period { again: false };
                self.deadline = Some(desk.now + TAKEN);
            }
            (OnStage::Period { .. }, Message::Prompt(Prompt::Period)) => {
                self.stage = OnStage::Period { again: true };
            }
            (OnStage::Row, Message::Prompt(Prompt::Period)) => {
                desk.leave_dialogue();
                return Some(self.refused(desk));
            }
            (OnStage::Toggled, Message::Prompt(_)) => return self.give_up(desk),
            // It has taken the Enter for its own values. One that streamed before does so again, as it was found.
            (OnStage::Left { .. }, Message::Row(_)) if !self.was_on => {
                desk.send(b"t");
                desk.facts.stream = None;
                return Some(self.left());
            }
            (OnStage::Toggled, Message::Row(_)) => {}
            (OnStage::Toggled, _) => {
                let soon = desk.now + NO_QUESTION;
                self.deadline = self.deadline.map(|deadline| deadline.min(soon));
            }
            (OnStage::Period { .. } | OnStage::Row, Message::Row(row)) if row.source == self.source => {
                return Some(Outcome::StreamRuns { was_on: self.was_on });
            }
            (OnStage::Period { .. } | OnStage::Row, Message::Refusal) => return Some(self.refused(desk)),
            _ => {}
        }
        None
    }

    fn tick(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match self.stage {
            OnStage::Toggled if desk.pending.is_none() && !self.was_on => {
                self.was_on = true;
                self.toggle(desk);
                None
            }
            OnStage::Source { enter_sent: false } => {
                desk.send(b"\r");
                self.stage = OnStage::Source { enter_sent: true };
                self.deadline = Some(desk.now + ANSWER);
                None
            }
            OnStage::Period { again: true } if desk.pending.is_some() => {
                desk.leave_dialogue();
                Some(self.refused(desk))
            }
            OnStage::Period { .. } => {
                desk.facts.stream = Some(self.source);
                desk.events.push_back(Event::FactsChanged);
                self.stage = OnStage::Row;
                self.deadline = Some(desk.now + FIRST_VALUES + self.period * 2);
                None
            }
            OnStage::Left { awaited, questions, heard } if desk.pending.is_some() && questions < MOST_LEFT => {
                desk.leave_dialogue();
                self.stage = OnStage::Left { awaited, questions: questions + 1, heard };
                self.deadline = Some(desk.now + LEFT);
                None
            }
            OnStage::Left { .. } => Some(self.left()),
            OnStage::Toggled | OnStage::Source { enter_sent: true } | OnStage::Row => self.give_up(desk),
        }
    }

    fn refused(&self, desk: &mut Desk<'_>) -> Outcome {
        desk.facts.stream = None;
        let question = self.question.as_ref().map(|question| format!(", asked for with \"{question}\""));
        let millis = self.period.as_millis();
        let reason = format!("the unit did not take {millis} ms{}", question.unwrap_or_default());
        Outcome::Refused { job: Job::StreamOn, reason, heard: self.heard }
    }

    /// Whether the unit has a question open.
    fn is_asked(&self) -> bool {
        !matches!(self.stage, OnStage::Period { again: false } | OnStage::Row | OnStage::Left { .. })
    }

    fn give_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let awaited = match self.stage {
            OnStage::Source { .. } => Awaited::PeriodQuestion,
            OnStage::Toggled | OnStage::Left { .. } => Awaited::SourceQuestion,
            OnStage::Period { .. } | OnStage::Row => {
                desk.facts.stream = None;
                Awaited::Row
            }
        };
        let heard = desk.pending.map(|text| text.span).or(self.heard);
        if !self.is_asked() {
            return Some(Outcome::NoAnswer { job: Job::StreamOn, awaited, heard });
        }
        desk.leave_dialogue();
        self.stage = OnStage::Left { awaited, questions: 1, heard };
        if heard.is_none() {
            return Some(self.left());
        }
        self.deadline = Some(desk.now + LEFT);
        None
    }

    /// How it ended, of a question that was left.
    fn left(&self) -> Outcome {
        let (awaited, heard) = match self.stage {
            OnStage::Left { awaited, heard, .. } => (awaited, heard),
            _ => (Awaited::SourceQuestion, self.heard),
        };
        Outcome::NoAnswer { job: Job::StreamOn, awaited, heard }
    }
}

impl Work for StreamOn {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin => {
                self.toggle(desk);
                None
            }
            Signal::Heard(text, message) => self.heard(text, message, desk),
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.tick(desk),
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Cancel => {
                if self.is_asked() {
                    desk.leave_dialogue();
                }
                Some(Outcome::Cancelled(Job::StreamOn))
            }
            Signal::LinkLost => Some(Outcome::Cancelled(Job::StreamOn)),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        match self.stage {
            OnStage::Toggled => matches!(prompt, Prompt::Source(_) | Prompt::Period),
            OnStage::Source { .. } => prompt == Prompt::Period,
            OnStage::Period { .. } | OnStage::Row | OnStage::Left { .. } => false,
        }
    }
}

/// Switches the stream off. Silence alone does not show that it is: a unit without power is silent as well.
#[derive(Debug, Default)]
pub(super) struct StreamOff {
    toggled_at: Instant,
    toggles: u32,
    /// Somebody is there: something has come since the first T.
    heard: bool,
    /// The menu has been asked for, to see whether somebody is.
    asked: bool,
    deadline: Option<Instant>,
}

impl StreamOff {
    fn toggle(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"t");
        self.toggled_at = desk.now;
        self.toggles += 1;
        self.deadline = Some(desk.now + ANSWER);
    }
}

impl Work for StreamOff {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        self.heard |= matches!(signal, Signal::Heard(..));
        match signal {
            Signal::Begin => {
                self.toggle(desk);
                None
            }
            // A question: it was off already, and shall stay so.
            Signal::Heard(_, Message::Prompt(_)) => {
                desk.leave_dialogue();
                desk.facts.stream = None;
                Some(Outcome::Done(Job::StreamOff))
            }
            Signal::Heard(_, Message::Row(_)) if desk.now < self.toggled_at + ROWS_ON_THEIR_WAY => None,
            Signal::Heard(_, Message::Row(_)) if self.toggles < MOST_TOGGLES => {
                self.toggle(desk);
                None
            }
            Signal::Heard(text, Message::Row(_)) => {
                let awaited = Awaited::StreamOff;
                Some(Outcome::NoAnswer { job: Job::StreamOff, awaited, heard: Some(text.span) })
            }
            Signal::Heard(..) => {
                let soon = desk.now + NO_QUESTION;
                self.deadline = self.deadline.map(|deadline| deadline.min(soon));
                None
            }
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => match desk.pending {
                Some(text) => {
                    desk.leave_dialogue();
                    let awaited = Awaited::StreamOff;
                    Some(Outcome::NoAnswer { job: Job::StreamOff, awaited, heard: Some(text.span) })
                }
                None if self.heard => {
                    desk.facts.stream = None;
                    Some(Outcome::Done(Job::StreamOff))
                }
                None if !self.asked => {
                    desk.send(b"m");
                    self.asked = true;
                    self.deadline = Some(desk.now + ANSWER);
                    None
                }
                None => {
                    let awaited = Awaited::StreamOff;
                    Some(Outcome::NoAnswer { job: Job::StreamOff, awaited, heard: None })
                }
            },
            Signal::Tick | Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Cancel => {
                desk.leave_dialogue();
                Some(Outcome::Cancelled(Job::StreamOff))
            }
            Signal::LinkLost => Some(Outcome::Cancelled(Job::StreamOff)),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        matches!(prompt, Prompt::Source(_) | Prompt::Period)
    }
}

fn key_for(source: Source, keys: SourceKeys) -> char {
    match source {
        Source::FieldValue => keys.field_value,
        Source::ProcessValue => keys.process_value,
    }
}
