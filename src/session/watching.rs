//! Pages of diagnostics that no job has asked for, in a live session: S was pressed by hand, or before the session
//! began. They are watched while the job for diagnostics runs as well, but then the job reports them.

use super::event::{Event, Job};
use super::keys::Typed;
use super::{Mode, Session};
use crate::time::Instant;
use crate::wire::{Message, Text};

/// What has happened.
#[derive(Clone, Copy)]
pub(super) enum Saw<'a> {
    /// This has left, and none of it is secret.
    Typed(&'a Typed),
    /// The unit has printed something.
    Heard(&'a Text, &'a Message),
    /// Time has passed.
    Tick,
}

impl Session {
    /// Whether pages are listened for: in a recording its jobs do that, and what a loader says is not a page.
    fn watches(&self) -> bool {
        self.mode == Mode::Live && !matches!(self.job(), Some(Job::Load | Job::SendFile))
    }

    /// When to call [`Session::watch`] next.
    pub(super) fn watching_due(&self) -> Option<Instant> {
        self.pages.due().filter(|_| self.watches())
    }

    /// Pages are not listened for, or the link is gone: nobody knows whether the unit still shows them. In a recording
    /// the job knows.
    pub(super) fn forget_pages(&mut self) {
        if self.mode != Mode::Recording && self.facts.diagnostics.take().is_some() {
            self.events.push_back(Event::FactsChanged);
        }
        self.pages.interrupt();
    }

    /// Looks for pages in what has happened.
    pub(super) fn watch(&mut self, saw: Saw<'_>) {
        if !self.watches() {
            return self.forget_pages();
        }
        let is_due = self.watching_due().is_some_and(|due| due <= self.now);
        match saw {
            Saw::Tick if !is_due => return,
            // Floods are made of rows, and no row is on a page.
            Saw::Heard(_, Message::Row(_)) => return,
            // An entry of the view is not a line of a page.
            Saw::Heard(..) if self.job() == Some(Job::ReadDictionary) => return,
            _ => {}
        }
        let before = (self.facts.diagnostics, self.facts.unrecognised_lines);
        let mut pages = std::mem::take(&mut self.pages);
        let pending = self.pending();
        let mut desk = self.desk(pending.as_ref());
        let mut given = Vec::new();
        match saw {
            Saw::Typed(typed) => pages.typed(typed, &mut desk),
            Saw::Heard(text, message) => pages.heard(text, message, &mut desk),
            Saw::Tick => given = pages.tick(&mut desk),
        }
        let cut = desk.cut;
        self.pages = pages;
        if (self.facts.diagnostics, self.facts.unrecognised_lines) != before {
            self.events.push_back(Event::FactsChanged);
        }
        // The job reports the pages itself.
        if self.job() == Some(Job::Diagnostics) {
            return;
        }
        for page in given {
            self.events.push_back(Event::Page { at: page.at, lines: page.lines });
        }
        if cut {
            self.cut_answered();
        }
    }
}
