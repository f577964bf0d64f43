//! Reading diagnostics: S switches pages on that come every second, and off again (AXTC4CO manual, section 4.1.4).
//!
//! The key only toggles, and no text of a unit is known to say which way. So the pages themselves are the evidence:
//! what comes in one go, has numbers in it and comes again. Pages that come already are simply read; once there are
//! enough, S is pressed until they have stopped.

mod assembler;

pub(super) use assembler::{Assembler, Page, PageEnd};

use super::event::{Awaited, Event, Job, Outcome};
use super::job::{Desk, Signal, Work};
use super::leaving::{ENTER, Leaving};
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{Message, Prompt};

/// How long to look for pages that come already: one comes every second.
const WATCH: Duration = Duration::from_millis(1300);
/// How long the first page may take: a unit has no values for up to 5 s after its power-up (AXRTD8CO manual,
/// section 1.1).
pub(super) const FIRST_PAGE: Duration = Duration::from_millis(6500);
/// Times after the key at which the number of received bytes is noted. A unit that has sent more by each of them, and
/// by the end, goes on talking.
const LOOKS: [Duration; 2] = [Duration::from_millis(1500), Duration::from_millis(4000)];
/// How long the next page may take.
const NEXT_PAGE: Duration = Duration::from_millis(2500);
/// Time without a page after the key that stops them.
pub(super) const STOPPED: Duration = Duration::from_millis(1500);
/// A page that comes this soon after that key was under way before it.
pub(super) const UNDER_WAY: Duration = Duration::from_millis(700);
/// How long the rest of the menu may take.
const MENU: Duration = Duration::from_millis(300);
/// How long after a question has been left the unit may ask another one.
const LEFT: Duration = Duration::from_millis(600);
/// How often the key is pressed to stop them.
const MOST_STOPS: u32 = 3;

/// The job.
#[derive(Debug)]
pub(super) struct Diagnostics {
    /// Pages wanted; `None` for as many as come until the job is cancelled.
    wanted: Option<u32>,
    taken: u32,
    stage: Stage,
    /// The unit asks something instead.
    leaving: Option<Leaving>,
    page: Assembler,
    deadline: Option<Instant>,
    heard: Option<Span>,
    /// Something has come since the key was last pressed.
    answered: bool,
    /// When the key was pressed.
    asked_at: Instant,
    /// Whether rows of a stream were coming then.
    streamed: bool,
    /// Bytes that had been received at each of the [`LOOKS`].
    looks: Vec<u64>,
    /// Lines that are no rows.
    lines: u64,
    /// Pages come that no job has asked for, and all that is wanted is that they stop.
    only_stops: bool,
}

#[derive(Debug)]
enum Stage {
    /// Pages may come already.
    Watching,
    /// The key has been pressed.
    Asked,
    /// What the key has switched on cannot be read as pages, and has been switched off again.
    NotUnderstood,
    /// Pages come.
    Reading,
    /// The key that stops pages has been pressed: how often, and when last.
    Stopping { presses: u32, at: Instant, then: Outcome },
    /// Pages have stopped, and nothing else has come: the menu is asked for, to see whether a unit is there.
    AskingForMenu { then: Outcome },
}

impl Diagnostics {
    pub(super) fn new(wanted: Option<u32>) -> Self {
        Diagnostics {
            wanted,
            taken: 0,
            stage: Stage::Watching,
            leaving: None,
            page: Assembler::default(),
            deadline: None,
            heard: None,
            answered: false,
            asked_at: Instant::ZERO,
            streamed: false,
            looks: Vec::new(),
            lines: 0,
            only_stops: false,
        }
    }

    /// The job that stops pages that come.
    pub(super) fn off() -> Self {
        Diagnostics { only_stops: true, ..Diagnostics::new(None) }
    }

    /// What has come may be a page.
    fn page_complete(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let page = self.page.complete(desk)?;
        match &self.stage {
            Stage::Stopping { at, .. } if page.at.since(*at) < UNDER_WAY => {
                self.deadline = Some(desk.now + STOPPED);
            }
            // The key was lost, or went the other way.
            Stage::Stopping { presses: MOST_STOPS, .. } => return Some(self.no_answer(Awaited::DiagnosticsOff)),
            Stage::Stopping { presses, then, .. } => self.stop(desk, presses + 1, then.clone()),
            Stage::AskingForMenu { .. } | Stage::NotUnderstood => {}
            Stage::Watching | Stage::Asked | Stage::Reading => {
                self.stage = Stage::Reading;
                self.deadline = Some(desk.now + NEXT_PAGE);
                self.taken += 1;
                desk.events.push_back(Event::Page { at: page.at, lines: page.lines });
                if self.wanted.is_some_and(|wanted| self.taken >= wanted) {
                    self.stop(desk, 1, DONE);
                }
            }
        }
        None
    }

    fn switch_on(&mut self, desk: &mut Desk<'_>) {
        desk.send(b"s");
        self.page.pressed();
        self.stage = Stage::Asked;
        (self.asked_at, self.streamed) = (desk.now, desk.facts.stream.is_some());
        self.looks.clear();
        self.deadline = Some(desk.now + LOOKS[0]);
    }

    /// How much the unit has said so far. Among rows of a stream only other lines count.
    fn said(&self, desk: &Desk<'_>) -> u64 {
        if self.streamed { self.lines } else { desk.received }
    }

    /// Whether the unit has been talking ever since the key was pressed, as it did not before.
    fn goes_on(&self, desk: &Desk<'_>) -> bool {
        let all: Vec<u64> = self.looks.iter().copied().chain([self.said(desk)]).collect();
        all.windows(2).all(|pair| pair[0] < pair[1])
    }

    /// Stops the pages, and ends the job with this outcome once they have stopped.
    fn stop(&mut self, desk: &mut Desk<'_>, presses: u32, then: Outcome) {
        desk.send(b"s");
        self.stage = Stage::Stopping { presses, at: desk.now, then };
        self.deadline = Some(desk.now + STOPPED);
        self.answered = false;
    }

    fn tick(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if self.page.due().is_some_and(|due| due <= desk.now)
            && let Some(outcome) = self.page_complete(desk)
        {
            return Some(outcome);
        }
        // What is awaited may be on its way: a page takes a second at most.
        let is_over = self.page.due().is_none() && self.deadline.is_some_and(|deadline| deadline <= desk.now);
        if is_over { self.time_is_up(desk) } else { None }
    }

    fn time_is_up(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match &self.stage {
            // What looked like a page before the key was not one, or pages have been stopped meanwhile.
            Stage::Reading if self.taken == 1 => self.switch_on(desk),
            Stage::Watching => self.switch_on(desk),
            Stage::Asked if self.looks.len() < LOOKS.len() => {
                let said = self.said(desk);
                self.looks.push(said);
                self.deadline = Some(self.asked_at + LOOKS.get(self.looks.len()).copied().unwrap_or(FIRST_PAGE));
            }
            Stage::Asked if self.goes_on(desk) => {
                desk.send(b"s");
                self.stage = Stage::NotUnderstood;
                self.deadline = Some(desk.now + STOPPED);
            }
            Stage::NotUnderstood => return Some(self.no_answer(Awaited::Page)),
            Stage::Asked => {
                let no_answer = self.no_answer(if self.taken > 0 { Awaited::NextPage } else { Awaited::Page });
                if desk.pending.is_none() {
                    return Some(no_answer);
                }
                self.leave(desk, no_answer);
            }
            // Pages may only be late, so they are stopped.
            Stage::Reading => {
                let late = self.no_answer(Awaited::NextPage);
                self.stop(desk, 1, late);
            }
            Stage::Stopping { then, .. } | Stage::AskingForMenu { then } if self.answered => {
                desk.facts.diagnostics = None;
                return Some(then.clone());
            }
            // A unit without power prints no pages either.
            Stage::Stopping { then, .. } => {
                desk.send(b"m");
                self.stage = Stage::AskingForMenu { then: then.clone() };
                self.deadline = Some(desk.now + STOPPED);
            }
            Stage::AskingForMenu { then: late @ Outcome::NoAnswer { .. } } => return Some(late.clone()),
            Stage::AskingForMenu { .. } => return Some(self.no_answer(Awaited::DiagnosticsOff)),
        }
        None
    }

    /// Leaves what the unit asks.
    fn leave(&mut self, desk: &mut Desk<'_>, then: Outcome) {
        self.leaving = Some(Leaving::begin(ENTER, LEFT, desk, then));
    }

    fn no_answer(&self, awaited: Awaited) -> Outcome {
        Outcome::NoAnswer { job: Job::Diagnostics, awaited, heard: self.heard }
    }
}

const DONE: Outcome = Outcome::Done(Job::Diagnostics);
const CANCELLED: Outcome = Outcome::Cancelled(Job::Diagnostics);

/// Whether a line can be one of a page: it has a word, or is a rule of signs.
pub(super) fn has_words(line: &str) -> bool {
    line.contains(char::is_alphabetic) || !line.contains(|sign: char| sign.is_ascii_digit())
}

impl Work for Diagnostics {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(leaving) = &mut self.leaving {
            return leaving.handle(signal, CANCELLED, desk);
        }
        self.answered |= matches!(signal, Signal::Heard(..));
        self.lines += u64::from(matches!(signal, Signal::Heard(_, message) if !matches!(message, Message::Row(_))));
        if matches!((&self.stage, &signal), (Stage::AskingForMenu { .. }, Signal::Heard(..))) {
            // Rows may go on for ever after the menu.
            let soon = desk.now + MENU;
            self.deadline = self.deadline.map(|deadline| deadline.min(soon));
            return None;
        }
        match signal {
            Signal::Begin if self.only_stops => {
                self.stop(desk, 1, DONE);
                None
            }
            Signal::Begin => {
                self.deadline = Some(desk.now + WATCH);
                None
            }
            // A question had been left open. While pages come, it is a line that only ends like a question.
            Signal::Heard(_, Message::Prompt(Prompt::Password | Prompt::ConfirmDefaults))
                if matches!(self.stage, Stage::Watching | Stage::Asked) =>
            {
                let no_answer = self.no_answer(Awaited::Page);
                self.leave(desk, no_answer);
                None
            }
            Signal::Heard(_, Message::Row(_) | Message::Prompt(_)) => None,
            // Numbers alone: the end of a row of the stream for which the unit had no room as a whole.
            Signal::Heard(text, _) if !has_words(&text.text) => {
                self.heard = Some(text.span);
                None
            }
            Signal::Heard(text, _) => {
                self.heard = Some(text.span);
                self.page.line(text, desk.now);
                // Pages that came before any key was sent answer none, so without the job their lines count as not
                // understood.
                desk.understood = matches!(self.stage, Stage::Reading);
                None
            }
            Signal::Hold(_) | Signal::Typed(_) | Signal::Over => None,
            Signal::Tick => self.tick(desk),
            Signal::Cancel => match &self.stage {
                Stage::Watching => Some(CANCELLED),
                Stage::Asked | Stage::Reading => {
                    self.stop(desk, 1, CANCELLED);
                    None
                }
                Stage::Stopping { .. } | Stage::AskingForMenu { .. } | Stage::NotUnderstood => None,
            },
            Signal::LinkLost => Some(CANCELLED),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.leaving.as_ref().map(Leaving::due).or(self.page.due()).or(self.deadline)
    }
}
