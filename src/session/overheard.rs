//! Jobs on a recording: nobody can be asked, so they listen to what was said, and end when the recording does.

use super::diagnostics::Page;
use super::dictionary::Collector;
use super::event::{Awaited, DictionaryReading, Event, Job, Outcome};
use super::hearing::MENU_ANSWER;
use super::job::{Desk, Signal, Work};
use super::pages::Pages;
use crate::device::Product;
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, Message};

/// How soon behind a walk that has left the view another one begins that reads what was lost on the line.
const ANOTHER_WALK: Duration = Duration::from_secs(2);

/// Reads the entries of the object dictionary that somebody walked through.
#[derive(Default)]
pub(super) struct Dictionary {
    collector: Collector,
    /// When the last entry came.
    at: Instant,
    /// The menu came back behind entries, and since when it has been there: the walk was ended in order.
    left: Option<Instant>,
    /// What was read before the unit started anew or its link was lost, and when its last entry came.
    before: Option<(Instant, DictionaryReading)>,
    /// Whether the view is open, once a key has shown that the recording holds keys.
    viewing: Option<bool>,
    /// A key that has the menu printed was sent then: what says the product's name is no banner.
    asked_at: Option<Instant>,
    heard: Option<Span>,
}

impl Dictionary {
    /// Ends the walk where it is: no entry that comes later belongs to it. Gives what was read of it.
    fn break_off(&mut self) -> Option<(Instant, DictionaryReading)> {
        self.viewing = self.viewing.map(|_| false);
        if self.collector.count() == 0 {
            return None;
        }
        let complete = self.is_complete();
        let product = self.collector.product;
        let reading = std::mem::take(&mut self.collector).take(complete);
        self.collector.product = product;
        self.left = None;
        Some((self.at, reading))
    }

    fn is_complete(&self) -> bool {
        self.collector.has_all() || (self.left.is_some() && self.collector.product.is_none())
    }

    /// The same where only the end of the recording tells. One that had everything goes before what has come of a later
    /// one.
    fn keep(&mut self) {
        if let Some(ended) = self.break_off() {
            let is_better = self.before.as_ref().is_none_or(|(_, before)| !before.complete || ended.1.complete);
            self.before = if is_better { Some(ended) } else { self.before.take() };
        }
    }

    /// Whether the unit shows by this that it has started anew. In the view an object may be called like the product.
    fn is_start(&self, message: &Message, now: Instant) -> bool {
        match message {
            Message::Loader(LoaderText::Header | LoaderText::Waiting) | Message::FirstStart => true,
            // Without keys a menu looks like a banner.
            Message::Software(name) if self.viewing.is_some() => {
                let asked = self.asked_at.is_some_and(|at| now <= at + MENU_ANSWER);
                name.product.is_some() && name.version.is_some() && !asked
            }
            _ => false,
        }
    }

    /// When nobody walks through the view once more for the lines that were lost: who does begins at once.
    fn due(&self) -> Option<Instant> {
        self.left.map(|left| left + ANOTHER_WALK)
    }

    /// Whether this ends the walk under way, so that what follows is none of it.
    fn is_broken_by(&self, signal: Signal<'_>, now: Instant) -> bool {
        match signal {
            Signal::LinkLost => true,
            Signal::Tick => self.due().is_some_and(|due| due <= now),
            Signal::Heard(_, message) => self.is_start(message, now),
            _ => false,
        }
    }
}

impl Work for Dictionary {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if self.is_broken_by(signal, desk.now) {
            self.keep();
        }
        match signal {
            Signal::Heard(_, Message::Row(_) | Message::Loader(_) | Message::Software(_) | Message::FirstStart) => None,
            Signal::Heard(_, Message::MenuKey(_)) => {
                self.left = (self.collector.count() > 0).then_some(desk.now);
                self.collector.interrupt();
                None
            }
            Signal::Heard(..) if self.viewing == Some(false) => None,
            Signal::Heard(text, message) => {
                let product = desk.facts.product.as_ref().and_then(|known| Product::named(&known.value));
                self.collector.product = product.or(self.collector.product);
                desk.understood = self.collector.line(text, message);
                if desk.understood {
                    self.heard = Some(text.span);
                    self.at = desk.now;
                    self.left = None;
                }
                None
            }
            Signal::Over => {
                self.keep();
                Some(match self.before.take() {
                    Some((_, reading)) => Outcome::DictionaryRead(Box::new(reading)),
                    None => {
                        let awaited = Awaited::Entry;
                        Outcome::NoAnswer { job: Job::ReadDictionary, awaited, heard: self.heard }
                    }
                })
            }
            Signal::Cancel => Some(Outcome::Cancelled(Job::ReadDictionary)),
            Signal::Typed(keys) => {
                for key in keys {
                    match key.to_ascii_lowercase() {
                        b'v' => (self.viewing, self.left) = (Some(true), None),
                        b'x' | b'm' | b'd' | b't' | b's' | b'l' => self.viewing = Some(false),
                        _ => {}
                    }
                    if matches!(key.to_ascii_lowercase(), b'x' | b'm' | b'v' | b'\r') {
                        self.asked_at = Some(desk.now);
                    }
                }
                None
            }
            Signal::Begin | Signal::Hold(_) | Signal::Tick | Signal::LinkLost => None,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.due()
    }
}

/// Reads the pages of diagnostics that came.
pub(super) struct Diagnostics {
    wanted: Option<u32>,
    taken: u32,
    pages: Pages,
    heard: Option<Span>,
}

impl Diagnostics {
    pub(super) fn new(wanted: Option<u32>) -> Self {
        Diagnostics { wanted, taken: 0, pages: Pages::default(), heard: None }
    }

    fn give(&mut self, pages: Vec<Page>, desk: &mut Desk<'_>) -> Option<Outcome> {
        for page in pages {
            if self.wanted.is_none_or(|wanted| self.taken < wanted) {
                self.taken += 1;
                desk.events.push_back(Event::Page { at: page.at, lines: page.lines });
            }
        }
        self.wanted.is_some_and(|wanted| self.taken >= wanted).then_some(Outcome::Done(Job::Diagnostics))
    }
}

impl Work for Diagnostics {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Heard(text, message) => {
                if !matches!(message, Message::Row(_) | Message::MenuKey(_) | Message::Loader(_) | Message::Prompt(_)) {
                    self.heard = Some(text.span);
                }
                self.pages.heard(text, message, desk);
                None
            }
            Signal::Typed(keys) => {
                self.pages.typed(keys, desk);
                None
            }
            Signal::Tick => {
                let pages = self.pages.tick(desk);
                if pages.is_empty() { None } else { self.give(pages, desk) }
            }
            Signal::LinkLost => {
                self.pages.interrupt();
                desk.facts.diagnostics = None;
                None
            }
            Signal::Over if self.taken == 0 => {
                let awaited = Awaited::Page;
                Some(Outcome::NoAnswer { job: Job::Diagnostics, awaited, heard: self.heard })
            }
            Signal::Over => Some(Outcome::Done(Job::Diagnostics)),
            Signal::Cancel => Some(Outcome::Cancelled(Job::Diagnostics)),
            Signal::Begin | Signal::Hold(_) => None,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.pages.due()
    }
}

/// Everything that goes by: dictionaries that were walked through, pages that came.
pub(super) struct Everything {
    dictionary: Dictionary,
    diagnostics: Diagnostics,
}

impl Everything {
    pub(super) fn new() -> Self {
        Everything { dictionary: Dictionary::default(), diagnostics: Diagnostics::new(None) }
    }

    fn tell(ended: Option<(Instant, DictionaryReading)>, desk: &mut Desk<'_>) {
        if let Some((at, reading)) = ended {
            desk.events.push_back(Event::Overheard { at, reading: Box::new(reading) });
        }
    }
}

impl Work for Everything {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Cancel => return Some(Outcome::Cancelled(Job::Overhear)),
            Signal::Over => {
                let pages = self.diagnostics.pages.complete(desk);
                self.diagnostics.give(pages, desk);
                Self::tell(self.dictionary.break_off(), desk);
                return Some(Outcome::Done(Job::Overhear));
            }
            _ => {}
        }
        if self.dictionary.is_broken_by(signal, desk.now) {
            Self::tell(self.dictionary.break_off(), desk);
        }
        self.dictionary.handle(signal, desk);
        if !desk.understood {
            self.diagnostics.handle(signal, desk);
        }
        // A walk that has seen everything need not wait for the recording's end.
        if matches!(signal, Signal::Heard(_, Message::MenuKey(_))) && self.dictionary.collector.has_all() {
            Self::tell(self.dictionary.break_off(), desk);
        }
        None
    }

    fn deadline(&self) -> Option<Instant> {
        [self.dictionary.deadline(), self.diagnostics.deadline()].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests {
    use crate::endpoint::Endpoint;
    use crate::session::{Command, Event, Session};
    use crate::time::Instant;

    /// What a recording has to tell: what was sent (`>`) and what came, each so many milliseconds behind the one before.
    fn pages(story: &[(u64, &str)]) -> Vec<Vec<String>> {
        let mut session = Session::of_recording(115_200);
        session.command(Instant::ZERO, Command::Diagnostics { pages: None }).expect("it is free");
        let mut millis = 0;
        for (behind, text) in story {
            // Whatever falls due on the way is looked after when it does.
            let until = Instant::from_millis(millis + behind);
            while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
                session.handle_timeout(due);
            }
            millis += behind;
            match text.strip_prefix('>') {
                Some(keys) => session.handle_sent(until, keys.as_bytes()),
                None => session.handle_bytes(until, text.as_bytes()),
            }
        }
        let end = Instant::from_millis(millis + 5_000);
        while let Some(due) = session.poll_timeout().filter(|due| *due <= end) {
            session.handle_timeout(due);
        }
        session.recording_over(end);
        let mut pages = Vec::new();
        while let Some(event) = session.poll_event() {
            if let Event::Page { lines, .. } = event {
                pages.push(lines.into_iter().map(|line| line.text).collect());
            }
        }
        pages
    }

    const PAGE: &str = "Supply 24.1 V\r\nTC1 100.0 C\r\n";
    const SWITCH: [(u64, &str); 3] = [(1_000, ">t"), (10, "F - field value, P - process value: "), (500, ">f")];
    const SWITCHED: [(u64, &str); 3] = [
        (10, "\r\nRepetition rate in ms (1-60000) [1000]: "),
        (500, ">30000\r"),
        (10, "30000\r\nStream is now ON: every 30000 ms.\r\n"),
    ];

    #[test]
    fn pages_are_what_comes_behind_the_key_for_them_and_no_dialogue_is_one() {
        let twice = [SWITCH, SWITCHED, SWITCH, SWITCHED].concat();
        assert!(pages(&twice).is_empty(), "{:?}", pages(&twice));
        let story =
            [&twice[..], &[(1_000, ">s"), (800, PAGE), (1_000, PAGE), (100, ">s"), (900, "Off 1.\r\n")]].concat();
        assert_eq!(pages(&story).len(), 2, "{:?}", pages(&story));
    }

    #[test]
    fn a_unit_that_starts_anew_shows_no_pages_any_more() {
        let banner = "Some Corporation 1\r\nAXTC4CO V1.1.0\r\nNode-ID: 127\r\n";
        let defaults =
            [(0, ">d"), (10, "Enter Yes to restore the defaults: "), (900, ">Yes\r"), (10, "Yes\r\n"), (10, banner)];
        assert!(pages(&defaults).is_empty(), "{:?}", pages(&defaults));
        let story = [(0, ">s"), (500, PAGE), (1_000, PAGE), (5_000, banner), (5_000, "Node-ID: 127\r\n")];
        assert_eq!(pages(&story).len(), 2, "{:?}", pages(&story));
    }

    #[test]
    fn without_keys_pages_are_what_comes_again_and_they_stay_pages_when_a_key_is_pressed() {
        let story = [(0, PAGE), (1_000, PAGE), (1_000, "Something 1 else\r\n"), (1_000, PAGE)];
        assert_eq!(pages(&story).len(), 2, "{:?}", pages(&story));
        let story = [(0, PAGE), (1_000, PAGE), (500, ">m"), (500, PAGE), (1_000, PAGE), (1_000, PAGE)];
        assert_eq!(pages(&story).len(), 5, "{:?}", pages(&story));
    }
}
