//! Reading the object dictionary through V (manuals, section 4.1.1).
//!
//! The view shows the PDO parameters first and then an object for each Enter; how many there are nobody says. So Enter is
//! pressed until the menu comes back or nothing new comes any more. While the view is open scanning and CAN may be halted:
//! every way out of this job leaves it, and looks whether the menu is there.

use super::event::{DictionaryReading, Event, Job, Outcome, ReadEntry};
use super::job::{Desk, Signal, Work};
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt, Text, dictionary};

/// How long the unit may take to begin an answer.
const ANSWER: Duration = Duration::from_millis(1200);
/// Silence behind lines that ends an answer: longer than an adapter's latency and a prompt's.
const QUIET: Duration = Duration::from_millis(120);
/// Answers without an entry behind which the walk counts as over: a unit may print a title or a last sentence.
const IDLE_ANSWERS: u32 = 3;
/// Keys that are pressed at most; the largest product has 40 objects behind its first block.
const MOST_STEPS: u32 = 4_000;
/// Entries that are kept at most.
const MOST_ENTRIES: usize = 20_000;
/// Entries of the menu that show that it is there.
const MENU_ENTRIES: u32 = 3;
/// How often leaving is tried.
const MOST_EXITS: u32 = 3;

/// The job.
pub(super) struct ReadDictionary {
    product: Option<&'static Product>,
    reading: DictionaryReading,
    /// The object whose entries follow.
    heading: Option<u16>,
    /// The last entry that was read: its sub-index tells how the next one is written.
    last: Option<ObjectAddress>,
    stage: Stage,
    /// The last answer showed entries.
    fresh: bool,
    /// The last answer had any text.
    answered: bool,
    idle: u32,
    steps: u32,
    menu: u32,
    deadline: Option<Instant>,
    heard: Option<Span>,
}

enum Stage {
    /// V is out.
    Opening,
    /// Enter is out.
    Walking,
    /// X is out, so often, and M behind it if `asked`.
    Leaving { exits: u32, asked: bool, then: Outcome },
}

impl ReadDictionary {
    pub(super) fn new() -> Self {
        ReadDictionary {
            product: None,
            reading: DictionaryReading::default(),
            heading: None,
            last: None,
            stage: Stage::Opening,
            fresh: false,
            answered: false,
            idle: 0,
            steps: 0,
            menu: 0,
            deadline: None,
            heard: None,
        }
    }

    /// A line of the view, or something else.
    fn line(&mut self, text: &Text) {
        self.answered = true;
        let product = self.product;
        let knows = |index| product.is_none_or(|product| product.dictionary.object(index).is_some());
        let Some(line) = dictionary::line(&text.text, knows) else {
            self.reading.unrecognised_lines += 1;
            return;
        };
        if line.index.is_some() {
            self.heading = line.index;
        }
        let Some(index) = self.heading else {
            self.reading.unrecognised_lines += 1;
            return;
        };
        let object = product.and_then(|product| product.dictionary.object(index));
        let single = object.is_none_or(|object| object.entries.len() == 1);
        let before = self.last.filter(|last| last.index == index).map(|last| last.sub);
        let at = ObjectAddress::new(index, line.sub.map_or(0, |sub| sub.behind(before)));
        let entry = object.and_then(|object| object.entry(at.sub));
        let shown = match (object, entry) {
            (Some(object), Some(entry)) if line.sub.is_some() || single => {
                // A unit like `100 µs` holds a number, which is not the value.
                let unit = entry.unit.as_deref().unwrap_or_default();
                let plain = unit.replace('°', "").replace('µ', "u").replace('Ω', "Ohm");
                dictionary::value(&line.rest, entry.data_type, &[&object.name, &entry.name, unit, &plain])
            }
            // A heading.
            (Some(_), Some(_)) => return,
            (Some(_), None) | (None, _) => None,
        };
        match (shown, entry) {
            (Some(shown), _) => {
                let value = match shown {
                    dictionary::Shown::Value(value) => Some(value),
                    dictionary::Shown::Nothing => None,
                };
                self.keep(ReadEntry { at, value, text: line.rest, span: text.span, known: true });
            }
            // An object that the manual does not have is kept as it is printed.
            (None, None) if line.sub.is_some() => {
                self.keep(ReadEntry { at, value: None, text: line.rest, span: text.span, known: false });
            }
            // A heading of such an object, or of a variable whose value stands below.
            (None, None) => {}
            (None, Some(_)) if line.sub.is_none() => {}
            (None, Some(_)) => self.reading.unrecognised_lines += 1,
        }
    }

    fn keep(&mut self, entry: ReadEntry) {
        self.fresh = true;
        self.last = Some(entry.at);
        self.reading.entries.retain(|other| other.at != entry.at);
        if self.reading.entries.len() < MOST_ENTRIES {
            self.reading.entries.push(entry);
        }
    }

    fn step(&mut self, desk: &mut Desk<'_>) {
        self.steps += 1;
        (self.fresh, self.answered) = (false, false);
        desk.send(b"\r");
        self.stage = Stage::Walking;
        self.deadline = Some(desk.now + ANSWER);
        desk.events.push_back(Event::EntriesRead(self.reading.entries.len()));
    }

    /// Leaves the view, wherever in it we are, and ends with this outcome once the menu has been seen.
    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        let exits = match &self.stage {
            Stage::Leaving { exits, .. } => exits + 1,
            Stage::Opening | Stage::Walking => 1,
        };
        self.menu = 0;
        desk.send(b"x");
        self.stage = Stage::Leaving { exits, asked: false, then };
        self.deadline = Some(desk.now + QUIET);
    }

    fn finished(&mut self, complete: bool) -> Outcome {
        self.reading.complete = complete;
        self.reading.entries.sort_by_key(|entry| entry.at);
        Outcome::DictionaryRead(Box::new(std::mem::take(&mut self.reading)))
    }

    fn no_answer(&self, awaited: &'static str) -> Outcome {
        Outcome::NoAnswer { job: Job::ReadDictionary, awaited, heard: self.heard }
    }

    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let menu_is_back = self.menu.count_ones() >= MENU_ENTRIES;
        match &mut self.stage {
            Stage::Opening if self.reading.entries.is_empty() && !self.answered => {
                let outcome = self.no_answer("the object dictionary");
                self.leave(desk, outcome);
                None
            }
            Stage::Opening => {
                self.step(desk);
                None
            }
            Stage::Walking => {
                self.idle = if self.fresh { 0 } else { self.idle + 1 };
                if menu_is_back && !self.fresh {
                    return Some(self.finished(true));
                }
                if self.idle >= IDLE_ANSWERS || self.steps >= MOST_STEPS {
                    let complete = self.answered && self.steps < MOST_STEPS;
                    let outcome = if self.reading.entries.is_empty() {
                        self.no_answer("an entry of the object dictionary")
                    } else {
                        self.finished(complete)
                    };
                    self.leave(desk, outcome);
                    return None;
                }
                if menu_is_back {
                    return Some(self.finished(true));
                }
                self.step(desk);
                None
            }
            Stage::Leaving { then, .. } if menu_is_back => Some(then.clone()),
            Stage::Leaving { asked: asked @ false, .. } => {
                *asked = true;
                desk.send(b"m");
                self.deadline = Some(desk.now + ANSWER);
                None
            }
            Stage::Leaving { exits, then, .. } if *exits >= MOST_EXITS => Some(then.clone()),
            Stage::Leaving { then, .. } => {
                let then = then.clone();
                self.leave(desk, then);
                None
            }
        }
    }
}

impl Work for ReadDictionary {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin => {
                self.product = desk.facts.product.as_ref().and_then(|known| Product::named(&known.value));
                desk.send(b"v");
                self.deadline = Some(desk.now + ANSWER);
                None
            }
            Signal::Heard(_, Message::Row(_)) => None,
            Signal::Heard(text, message) => {
                self.heard = Some(text.span);
                self.deadline = Some(desk.now + QUIET);
                match (message, &self.stage) {
                    (Message::MenuKey(key), _) => self.menu |= 1 << (*key as u32),
                    (_, Stage::Leaving { .. }) => {}
                    (Message::Refusal, Stage::Opening) if self.reading.entries.is_empty() => {
                        let reason = format!("the unit does not show its object dictionary: {}", text.text.trim());
                        let heard = Some(text.span);
                        return Some(Outcome::Refused { job: Job::ReadDictionary, reason, heard });
                    }
                    (Message::Prompt(Prompt::Password | Prompt::ConfirmDefaults | Prompt::Source(_)), _) => {
                        desk.leave_dialogue();
                        return Some(self.no_answer("the object dictionary"));
                    }
                    (_, Stage::Opening | Stage::Walking) => self.line(text),
                }
                None
            }
            Signal::Hold(_) => None,
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.time_is_up(desk),
            Signal::Tick => None,
            Signal::Cancel => {
                if !matches!(self.stage, Stage::Leaving { .. }) {
                    self.leave(desk, Outcome::Cancelled(Job::ReadDictionary));
                }
                None
            }
            Signal::LinkLost => Some(Outcome::Cancelled(Job::ReadDictionary)),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }
}
