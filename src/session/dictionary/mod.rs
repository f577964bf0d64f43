//! Reading the object dictionary through V (manuals, section 4.1.1).
//!
//! The view shows the PDO parameters first and then an object for each Enter, without saying how many there are. So
//! Enter is pressed until the menu comes back or nothing new comes any more. While the view is open, scanning and CAN
//! may be halted: every way out of this job leaves it, and checks that the menu is there.

mod collector;
mod notation;

pub(super) use collector::Collector;

use super::event::{Awaited, Event, Job, Known, Origin, Outcome, WalkEnd};
use super::job::{Desk, Signal, Work};
use crate::device::Product;
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt, Text};

/// How long the unit may take to begin an answer.
const ANSWER: Duration = Duration::from_millis(1200);
/// Silence after lines that ends an answer: longer than an adapter's latency, and than the silence that makes a prompt.
const QUIET: Duration = Duration::from_millis(120);
/// How long an entry without a line end has to stay as it is before it counts, where it is not known whether the unit
/// ends its lines: half of one looks like another entry, and a busy computer may keep the other half back for longer
/// than [`QUIET`].
const STANDS_STILL: Duration = Duration::from_millis(400);
/// How long an answer may go on: other text may come without end.
const LONGEST_ANSWER: Duration = Duration::from_millis(4000);
/// Answers without an entry after which the walk counts as over: a unit may print a title or a last sentence.
const IDLE_ANSWERS: u32 = 3;
/// Most keys that are pressed; the largest product has 40 objects after its first block.
const MOST_STEPS: u32 = 4_000;
/// Entries of the menu that show that it is there.
const MENU_ENTRIES: u32 = 3;
/// Up to this many missing entries per hundred read, a second walk is worth its time: noise costs single lines, but
/// other software may lack whole objects.
const LOST_ON_THE_LINE: usize = 10;
/// Answers in a row with only lines that are not understood, after which the walk is given up. Such lines may be
/// entries in a layout of their own, while others can be read. The largest product has 56 objects.
const UNREAD_ANSWERS: u32 = 400;
/// Fewest letters of a prompt: fewer are in any half of a line.
const PROMPT_LETTERS: usize = 3;
/// How often leaving is tried.
const MOST_EXITS: u32 = 3;

/// The job.
pub(super) struct ReadDictionary {
    collector: Collector,
    stage: Stage,
    answer: Answer,
    line_ends: LineEnds,
    /// Answers in a row with nothing but new lines that were not understood.
    unread: u32,
    /// Answers in a row without anything new.
    idle: u32,
    steps: u32,
    most_steps: u32,
    /// The keys of the first walk, once there is a second one.
    steps_of_first_walk: Option<u32>,
    /// Entries of the menu that have been seen, each a bit.
    menu: u32,
    /// The walk has ended in silence, with nothing missing.
    may_be_whole: bool,
    deadline: Option<Instant>,
    heard: Option<Span>,
}

/// What the unit has answered to the last key.
#[derive(Default)]
struct Answer {
    asked_at: Instant,
    /// It has shown entries.
    is_fresh: bool,
    /// It has shown any text.
    has_text: bool,
    /// It has named a product and its version, as banners and many menus do.
    is_named: bool,
    /// Different lines before it that were not understood.
    unread_before: usize,
}

/// Whether this unit ends its lines, as far as is known.
#[derive(Default)]
struct LineEnds {
    /// Answers whose last entry had a line end, and those whose last had none.
    ended: u32,
    not_ended: u32,
    /// Where an entry without a line end ended when it was first looked at.
    unended: Option<u64>,
    /// Entries without a line end that have been taken: only halves, if it turns out that this unit ends its lines.
    doubtful: Vec<Span>,
    /// The letters of what followed the last answer without a line end.
    prompt: String,
}

enum Stage {
    /// V has been sent.
    Opening,
    /// Enter has been sent.
    Walking,
    /// X has been sent, this often, and M after it if `asked`.
    Leaving { exits: u32, asked: bool, then: Outcome },
}

impl ReadDictionary {
    pub(super) fn new() -> Self {
        ReadDictionary {
            collector: Collector::default(),
            stage: Stage::Opening,
            answer: Answer::default(),
            line_ends: LineEnds::default(),
            unread: 0,
            idle: 0,
            steps: 0,
            most_steps: MOST_STEPS,
            steps_of_first_walk: None,
            menu: 0,
            may_be_whole: false,
            deadline: None,
            heard: None,
        }
    }

    /// Sends keys; what comes from here on is their answer.
    fn ask(&mut self, keys: &[u8], within: Duration, desk: &mut Desk<'_>) {
        desk.send(keys);
        self.answer = Answer { asked_at: desk.now, unread_before: self.collector.unread_lines(), ..Answer::default() };
        self.deadline = Some(desk.now + within);
    }

    /// Takes a line of an answer, and returns whether it was understood. What has been read before is not progress: a
    /// unit may repaint for ever.
    fn take(&mut self, text: &Text, message: &Message) -> bool {
        self.answer.has_text = true;
        let before = self.collector.count();
        let understood = self.collector.line(text, message);
        // In a second walk everything has been read before.
        self.answer.is_fresh |= self.collector.count() > before || (self.steps_of_first_walk.is_some() && understood);
        understood
    }

    fn step(&mut self, desk: &mut Desk<'_>) {
        self.steps += 1;
        self.ask(b"\r", ANSWER, desk);
        self.stage = Stage::Walking;
        desk.events.push_back(Event::EntriesRead(self.collector.count()));
    }

    /// Leaves the view, wherever in it we are, and ends with this outcome once the menu has been seen.
    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        let exits = match &self.stage {
            Stage::Leaving { exits, .. } => exits + 1,
            Stage::Opening | Stage::Walking => 1,
        };
        self.menu = 0;
        self.ask(b"x", QUIET, desk);
        self.stage = Stage::Leaving { exits, asked: false, then };
    }

    /// Opens the view once more, and returns `true`, if the line has lost some entries, or if the walk may have been
    /// ended by a banner: a unit that restarts does not do so in the same place twice.
    fn walks_again(&mut self, desk: &mut Desk<'_>) -> bool {
        let (missing, count) = (self.collector.missing(), self.collector.count());
        let is_little = missing * 100 <= count * LOST_ON_THE_LINE;
        if self.steps_of_first_walk.is_some() || missing == 0 || !(is_little || self.answer.is_named) {
            return false;
        }
        self.steps_of_first_walk = Some(self.steps);
        self.most_steps = if self.answer.is_named { MOST_STEPS } else { self.steps + IDLE_ANSWERS };
        self.collector.interrupt();
        (self.idle, self.steps, self.menu, self.unread) = (0, 0, 0, 0);
        self.ask(b"v", ANSWER, desk);
        self.stage = Stage::Opening;
        true
    }

    /// The menu is back: by itself at the end of the view, or because the unit has restarted.
    fn back_at_menu(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if self.walks_again(desk) {
            return None;
        }
        let is_start = self.answer.is_named
            && self.collector.missing() > 0
            && self.steps_of_first_walk.is_some_and(|steps| steps != self.steps);
        Some(self.finished(if is_start { WalkEnd::Restarted } else { WalkEnd::Whole }, desk))
    }

    fn finished(&mut self, end: WalkEnd, desk: &mut Desk<'_>) -> Outcome {
        // Not every menu names its unit.
        if let (None, Some((product, span))) = (&desk.facts.product, self.collector.product_shown()) {
            desk.facts.product = Some(Known { value: product.name.clone(), origin: Origin::Dictionary, span });
        }
        Outcome::DictionaryRead(Box::new(self.collector.take(end)))
    }

    fn no_answer(&self, awaited: Awaited) -> Outcome {
        Outcome::NoAnswer { job: Job::ReadDictionary, awaited, heard: self.heard }
    }

    /// The last line of an answer may have no line end: there are units of either kind, and half an entry looks like
    /// another one. So it is taken only once it has stopped growing, and only from a unit that does not usually end its
    /// lines. Returns `true` if more of it may come.
    fn waits_for_the_rest(&mut self, desk: &Desk<'_>) -> bool {
        let Some(text) = desk.pending.filter(|text| self.collector.reads(text)) else {
            if self.answer.is_fresh && matches!(self.stage, Stage::Walking) {
                self.line_ends.ended += 1;
            }
            if self.ends_lines() {
                for half in self.line_ends.doubtful.drain(..) {
                    self.collector.forget(half);
                }
            }
            if let Some(text) = desk.pending {
                self.leave_behind(text);
            }
            return false;
        };
        let moves = self.line_ends.unended.replace(text.span.end) != Some(text.span.end);
        let ends_lines = self.ends_lines();
        if (moves || ends_lines) && desk.now < self.answer.asked_at + LONGEST_ANSWER {
            self.deadline = Some((desk.now + STANDS_STILL).min(self.answer.asked_at + LONGEST_ANSWER));
            return true;
        }
        self.line_ends.not_ended += 1;
        if ends_lines {
            // The rest of the line has been lost, and with it the entry: a second walk reads it.
            self.leave_behind(text);
        } else {
            self.line_ends.doubtful.push(text.span);
            self.take(text, &Message::Text);
        }
        false
    }

    fn ends_lines(&self) -> bool {
        self.line_ends.ended > self.line_ends.not_ended
    }

    /// Text without a line end that is not an entry is a prompt, or half a line. Half a line may be a new heading, so
    /// the entries that follow are not taken to belong to the old one. A prompt is the same each time.
    fn leave_behind(&mut self, text: &Text) {
        let letters: String = text.text.chars().filter(|character| character.is_alphabetic()).collect();
        if letters.len() < PROMPT_LETTERS || letters != self.line_ends.prompt {
            self.collector.interrupt();
        }
        self.line_ends.prompt = letters;
    }

    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if matches!(self.stage, Stage::Opening | Stage::Walking) && self.waits_for_the_rest(desk) {
            return None;
        }
        let menu_is_back = self.menu.count_ones() >= MENU_ENTRIES;
        match &mut self.stage {
            Stage::Opening if self.collector.count() == 0 && !self.answer.has_text => {
                let outcome = self.no_answer(Awaited::Dictionary);
                self.leave(desk, outcome);
                None
            }
            Stage::Opening => {
                self.step(desk);
                None
            }
            Stage::Walking => {
                let is_unread = !self.answer.is_fresh && self.collector.unread_lines() > self.answer.unread_before;
                self.unread = if is_unread { self.unread + 1 } else { 0 };
                let goes_on =
                    self.answer.is_fresh || (is_unread && self.collector.count() > 0 && self.unread < UNREAD_ANSWERS);
                self.idle = if goes_on { 0 } else { self.idle + 1 };
                if menu_is_back && !self.answer.is_fresh {
                    return self.back_at_menu(desk);
                }
                if self.idle >= IDLE_ANSWERS || self.steps >= self.most_steps {
                    let is_whole =
                        self.steps_of_first_walk.is_some() || self.answer.has_text && self.steps < self.most_steps;
                    let has_all = self.collector.missing() == 0;
                    let outcome = if self.collector.count() == 0 {
                        self.no_answer(Awaited::Entry)
                    } else {
                        self.finished(if is_whole { WalkEnd::Whole } else { WalkEnd::Stopped }, desk)
                    };
                    // A view may end without a word. If the unit still answers then, that was its end.
                    self.may_be_whole = has_all && desk.facts.product.is_some() && self.steps < self.most_steps;
                    self.leave(desk, outcome);
                    return None;
                }
                if menu_is_back {
                    return self.back_at_menu(desk);
                }
                self.step(desk);
                None
            }
            Stage::Leaving { then, .. } if menu_is_back => {
                let mut then = then.clone();
                if let Outcome::DictionaryRead(reading) = &mut then
                    && self.may_be_whole
                {
                    reading.end = WalkEnd::Whole;
                }
                Some(then)
            }
            Stage::Leaving { asked: asked @ false, .. } => {
                *asked = true;
                self.ask(b"m", ANSWER, desk);
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
                self.collector.product = desk.facts.product.as_ref().and_then(|known| Product::named(&known.value));
                self.ask(b"v", ANSWER, desk);
                None
            }
            Signal::Heard(_, Message::Row(_)) => None,
            Signal::Heard(text, message) => {
                self.heard = Some(text.span);
                self.deadline = Some((desk.now + QUIET).min(self.answer.asked_at + LONGEST_ANSWER));
                self.answer.is_named |=
                    matches!(message, Message::Software(name) if name.product.is_some() && name.version.is_some());
                match (message, &self.stage) {
                    (Message::MenuKey(key), _) => self.menu |= 1 << (*key as u32),
                    (_, Stage::Leaving { .. }) => {}
                    (Message::Refusal, Stage::Opening) if self.collector.count() == 0 => {
                        let reason = format!("the unit does not show its object dictionary: {}", text.text.trim());
                        let heard = Some(text.span);
                        // The view may have opened all the same, and X does nothing at the menu.
                        self.leave(desk, Outcome::Refused { job: Job::ReadDictionary, reason, heard });
                    }
                    (Message::Prompt(Prompt::Password | Prompt::ConfirmDefaults | Prompt::Source(_)), _) => {
                        desk.leave_dialogue();
                        let outcome = self.no_answer(Awaited::Dictionary);
                        self.leave(desk, outcome);
                    }
                    (_, Stage::Opening | Stage::Walking) => {
                        desk.understood = self.take(text, message);
                    }
                }
                None
            }
            Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Tick if self.deadline.is_some_and(|deadline| deadline <= desk.now) => self.time_is_up(desk),
            Signal::Tick => None,
            Signal::Cancel => {
                if !matches!(self.stage, Stage::Leaving { .. }) {
                    let outcome = match self.collector.count() {
                        0 => Outcome::Cancelled(Job::ReadDictionary),
                        _ => self.finished(WalkEnd::Cancelled, desk),
                    };
                    self.leave(desk, outcome);
                }
                None
            }
            // What has been read is not lost with the link.
            Signal::LinkLost => Some(match &self.stage {
                Stage::Leaving { then, .. } => then.clone(),
                Stage::Opening | Stage::Walking if self.collector.count() > 0 => self.finished(WalkEnd::Stopped, desk),
                Stage::Opening | Stage::Walking => Outcome::Cancelled(Job::ReadDictionary),
            }),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.deadline
    }
}
