//! Jobs on a recording: nobody can be asked, so they listen to what was said, and end when the recording does.

use super::diagnostics::{Assembler, Page};
use super::dictionary::Collector;
use super::event::{Awaited, Event, Job, Outcome};
use super::job::{Desk, Signal, Work};
use crate::device::Product;
use crate::record::Span;
use crate::time::Instant;
use crate::wire::{Message, diagnostics};

/// Reads the entries of the object dictionary that somebody walked through.
#[derive(Default)]
pub(super) struct Dictionary {
    collector: Collector,
    /// The menu came back behind entries: the walk was ended in order.
    left: bool,
    /// Whether the view is open, once a key has shown that the recording holds keys.
    viewing: Option<bool>,
    heard: Option<Span>,
}

impl Work for Dictionary {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Heard(_, Message::Row(_) | Message::Loader(_) | Message::Software(_) | Message::FirstStart) => None,
            Signal::Heard(_, Message::MenuKey(_)) => {
                self.left = self.collector.count() > 0;
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
                    self.left = false;
                }
                None
            }
            Signal::Over if self.collector.count() == 0 => {
                let awaited = Awaited::Entry;
                Some(Outcome::NoAnswer { job: Job::ReadDictionary, awaited, heard: self.heard })
            }
            Signal::Over => {
                let complete = self.collector.has_all() || (self.left && self.collector.product.is_none());
                Some(Outcome::DictionaryRead(Box::new(self.collector.take(complete))))
            }
            Signal::Cancel | Signal::LinkLost => Some(Outcome::Cancelled(Job::ReadDictionary)),
            Signal::Typed(keys) => {
                for key in keys {
                    match key.to_ascii_lowercase() {
                        b'v' => self.viewing = Some(true),
                        b'x' | b'm' | b'd' | b't' | b's' | b'l' => self.viewing = Some(false),
                        _ => {}
                    }
                }
                None
            }
            Signal::Begin | Signal::Hold(_) | Signal::Tick => None,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        None
    }
}

/// Reads the pages of diagnostics that came. A page is what comes in one go behind an S. Where no key has shown what
/// goes on it is what comes again with the same labels: menus and dictionaries have numbers in them as well.
pub(super) struct Diagnostics {
    wanted: Option<u32>,
    taken: u32,
    page: Assembler,
    /// S has been typed an odd number of times since the unit has started.
    switched_on: bool,
    /// They were switched on when the page under construction began: the key that stops them may come in its middle.
    begun_on: bool,
    /// What is typed is the answer to D's question, up to Enter: the `s` of `Yes` is no key.
    answers: bool,
    /// The recording holds keys.
    has_keys: bool,
    /// The labels of what was a page before there was a key.
    known: Option<Vec<String>>,
    /// The page before, and whether it has been given out.
    before: Option<(Page, Vec<String>, bool)>,
    heard: Option<Span>,
}

impl Diagnostics {
    pub(super) fn new(wanted: Option<u32>) -> Self {
        Diagnostics {
            wanted,
            taken: 0,
            page: Assembler::default(),
            switched_on: false,
            begun_on: false,
            answers: false,
            has_keys: false,
            known: None,
            before: None,
            heard: None,
        }
    }

    fn page(&mut self, page: Page, desk: &mut Desk<'_>) -> Option<Outcome> {
        let quantities = page.lines.iter().flat_map(|line| diagnostics::quantities(&line.text));
        let labels: Vec<String> = quantities.map(|quantity| quantity.label).collect();
        let before = self.before.take();
        let again = before.as_ref().is_some_and(|(_, others, _)| *others == labels)
            && (!self.has_keys || self.known.as_ref() == Some(&labels));
        if again && !self.has_keys {
            self.known = Some(labels.clone());
        }
        let given = self.begun_on || again;
        if let Some((first, _, false)) = before.filter(|_| again) {
            self.give(first, desk);
        }
        if given {
            self.give(page.clone(), desk);
        }
        self.before = Some((page, labels, given));
        self.wanted.is_some_and(|wanted| self.taken >= wanted).then_some(Outcome::Done(Job::Diagnostics))
    }

    fn give(&mut self, page: Page, desk: &mut Desk<'_>) {
        if self.wanted.is_none_or(|wanted| self.taken < wanted) {
            self.taken += 1;
            desk.events.push_back(Event::Page { at: page.at, lines: page.lines });
        }
    }
}

impl Work for Diagnostics {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Heard(_, Message::Row(_) | Message::MenuKey(_) | Message::Loader(_)) => None,
            Signal::Heard(_, Message::Prompt(_)) => None,
            // No page says the name: the unit has started anew, and shows none any more.
            Signal::Heard(_, Message::Software(name)) if name.product.is_some() => {
                (self.switched_on, self.begun_on, self.answers) = (false, false, false);
                None
            }
            Signal::Heard(text, _) => {
                self.heard = Some(text.span);
                if self.page.due().is_none() {
                    self.begun_on = self.switched_on;
                }
                self.page.line(text, desk.now);
                None
            }
            Signal::Typed(keys) => {
                self.has_keys = true;
                for key in keys {
                    match key {
                        b'\r' => self.answers = false,
                        _ if self.answers => {}
                        b'd' | b'D' => self.answers = true,
                        b's' | b'S' => {
                            self.switched_on = !self.switched_on;
                            self.page.pressed();
                        }
                        b'v' | b'V' | b'm' | b'M' | b'l' | b'L' => self.switched_on = false,
                        _ => {}
                    }
                }
                None
            }
            Signal::Tick if self.page.due().is_some_and(|due| due <= desk.now) => {
                let page = self.page.complete(desk)?;
                self.page(page, desk)
            }
            Signal::Over if self.taken == 0 => {
                let awaited = Awaited::Page;
                Some(Outcome::NoAnswer { job: Job::Diagnostics, awaited, heard: self.heard })
            }
            Signal::Over => Some(Outcome::Done(Job::Diagnostics)),
            Signal::Cancel | Signal::LinkLost => Some(Outcome::Cancelled(Job::Diagnostics)),
            Signal::Begin | Signal::Hold(_) | Signal::Tick => None,
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.page.due()
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
}

impl Work for Everything {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Cancel | Signal::LinkLost => return Some(Outcome::Cancelled(Job::Overhear)),
            Signal::Over => {
                let page = self.diagnostics.page.complete(desk);
                page.map(|page| self.diagnostics.page(page, desk));
                if let Some(Outcome::DictionaryRead(read)) = self.dictionary.handle(signal, desk) {
                    desk.events.push_back(Event::Overheard(read));
                }
                return Some(Outcome::Done(Job::Overhear));
            }
            _ => {}
        }
        self.dictionary.handle(signal, desk);
        if !desk.understood {
            self.diagnostics.handle(signal, desk);
        }
        // A walk that has seen everything need not wait for the recording's end.
        if matches!(signal, Signal::Heard(_, Message::MenuKey(_))) && self.dictionary.collector.has_all() {
            let read = self.dictionary.collector.take(true);
            desk.events.push_back(Event::Overheard(Box::new(read)));
        }
        None
    }

    fn deadline(&self) -> Option<Instant> {
        self.diagnostics.deadline()
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
