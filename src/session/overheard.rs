//! Jobs on a recording: there is no unit to ask, so they listen to what was said, and end when the recording does.

use super::diagnostics::Page;
use super::dictionary::Collector;
use super::event::{Awaited, DictionaryReading, Event, Job, Outcome, WalkEnd};
use super::hearing::MENU_ANSWER;
use super::job::{Desk, Signal, Work};
use super::keys::Key;
use super::pages::Pages;
use crate::device::Product;
use crate::record::Span;
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, MenuKey, Message};

/// How soon after a walk has left the view another one begins, if it is to read what was lost on the line.
const ANOTHER_WALK: Duration = Duration::from_secs(2);

/// Reads the entries of the object dictionary that somebody walked through.
#[derive(Default)]
pub(super) struct Dictionary {
    collector: Collector,
    /// When the last entry came.
    at: Instant,
    /// When the menu came back after entries: the walk was ended in order.
    left: Option<Instant>,
    /// What was read before the unit restarted or its link was lost, and when its last entry came.
    before: Option<(Instant, DictionaryReading)>,
    /// Whether the view is open, once a key has shown that the recording holds keys.
    viewing: Option<bool>,
    /// When a key was sent that prints the menu: what shows the product's name is then not a banner.
    asked_at: Option<Instant>,
    heard: Option<Span>,
}

impl Dictionary {
    /// Ends the walk where it is: no entry that comes later belongs to it. Returns what was read, and when its last
    /// entry came.
    fn break_off(&mut self) -> Option<(Instant, DictionaryReading)> {
        self.viewing = self.viewing.map(|_| false);
        if self.collector.count() == 0 {
            return None;
        }
        let end = if self.is_complete() { WalkEnd::Whole } else { WalkEnd::Stopped };
        let product = self.collector.product;
        let reading = std::mem::take(&mut self.collector).take(end);
        self.collector.product = product;
        self.left = None;
        Some((self.at, reading))
    }

    fn is_complete(&self) -> bool {
        self.collector.has_all() || (self.left.is_some() && self.collector.product.is_none())
    }

    /// Ends the walk where it is, and keeps what was read until the recording ends. A complete walk is not replaced by
    /// an incomplete later one.
    fn keep(&mut self) {
        if let Some(ended) = self.break_off() {
            let is_better =
                self.before.as_ref().is_none_or(|(_, before)| !before.is_complete() || ended.1.is_complete());
            self.before = if is_better { Some(ended) } else { self.before.take() };
        }
    }

    /// Whether this shows that the unit has restarted. In the view an object may have the product's name.
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

    /// When it is too late for a second walk that reads what was lost on the line: such a walk begins at once.
    fn due(&self) -> Option<Instant> {
        self.left.map(|left| left + ANOTHER_WALK)
    }

    /// Whether this ends the walk under way, so that what follows does not belong to it.
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
            Signal::Typed(typed) => {
                for key in typed.keys() {
                    match key {
                        Key::Menu(MenuKey::View) => (self.viewing, self.left) = (Some(true), None),
                        Key::Menu(_) | Key::Leave => self.viewing = Some(false),
                        Key::Enter | Key::Other => {}
                    }
                    if matches!(key, Key::Menu(MenuKey::Menu | MenuKey::View) | Key::Leave | Key::Enter) {
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
            Signal::Typed(typed) => {
                self.pages.typed(typed, desk);
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

/// Everything that goes by: walks through the dictionary, pages of diagnostics.
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
    use super::*;
    use crate::endpoint::Endpoint;
    use crate::session::{Command, Session};

    /// A recording: what was sent (`>`), remarks (`!`) and what came, each with the milliseconds since the entry
    /// before.
    type Story<'a> = &'a [(u64, &'a str)];

    fn played(story: Story<'_>, command: Command) -> (Vec<Event>, Session) {
        let mut session = Session::of_recording(115_200);
        session.command(Instant::ZERO, command).expect("it is free");
        let mut millis = 0;
        for (behind, text) in story {
            let until = Instant::from_millis(millis + behind);
            while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
                session.handle_timeout(due);
            }
            millis += behind;
            match text.as_bytes() {
                [b'>', keys @ ..] => session.handle_sent(until, keys),
                [b'!', ..] => session.handle_mark(until, &text[1..]),
                bytes => session.handle_bytes(until, bytes),
            }
        }
        session.recording_over(Instant::from_millis(millis + 50));
        (std::iter::from_fn(|| session.poll_event()).collect(), session)
    }

    fn told(reading: &DictionaryReading) -> String {
        let entries: Vec<String> = reading.entries.iter().map(|entry| entry.at.to_string()).collect();
        format!("{}{}", entries.join(" "), if reading.is_complete() { "" } else { " ..." })
    }

    /// The walks through the dictionary as the job that listens to everything reports them: when the last entry came,
    /// which ones, and whether that is all; and the reading that the job for the dictionary gives.
    fn readings(story: Story<'_>) -> (Vec<(u64, String)>, Option<String>) {
        let (events, _) = played(story, Command::Overhear);
        let overheard = events.iter().filter_map(|event| match event {
            Event::Overheard { at, reading } => {
                Some(((at.since(Instant::ZERO).as_nanos() / 1_000_000) as u64, told(reading)))
            }
            _ => None,
        });
        let (events, _) = played(story, Command::ReadDictionary);
        let read = events.iter().find_map(|event| match event {
            Event::Finished(Outcome::DictionaryRead(reading)) => Some(told(reading)),
            _ => None,
        });
        (overheard.collect(), read)
    }

    const FIRST: &str = "6126h:01 TC1 = 16.000\r\n";
    const SECOND: &str = "6126h:02 TC2 = 17.000\r\n";
    const THIRD: &str = "6126h:03 TC3 = 18.000\r\n";
    const MENU: &str = "V - View Object Dictionary\r\nD - Default Object Dictionary\r\n";
    const BANNER: &str = "AXTC4CO V1.1.0\r\n";

    #[test]
    fn a_walk_is_over_when_its_menu_is_back_and_one_right_after_it_belongs_to_it() {
        let walk = [(0, ">v"), (50, FIRST), (400, ">\r"), (50, SECOND), (400, ">x"), (50, MENU)];
        assert_eq!(readings(&walk), (vec![(500, "6126:01 6126:02".into())], Some("6126:01 6126:02".into())));
        let again = [&walk[..], &[(1_900, ">v"), (50, THIRD), (400, ">x"), (50, MENU)]].concat();
        assert_eq!(readings(&again).0, [(2_900, "6126:01 6126:02 6126:03".into())]);
        let later =
            [&walk[..], &[(2_100, ">m"), (50, MENU), (5_000, ">v"), (50, THIRD), (400, ">x"), (50, MENU)]].concat();
        assert_eq!(readings(&later).0, [(500, "6126:01 6126:02".into()), (8_150, "6126:03".into())]);
    }

    #[test]
    fn what_ends_a_walk_in_its_middle_leaves_it_incomplete() {
        let begun = [(0, ">v"), (50, FIRST), (400, ">\r"), (50, SECOND)];
        for end in [
            &[(400, "!link lost")][..],
            &[(400, "S-Record loader. Version 1.3\r\n")],
            &[(400, "Waiting for application S-Record\r\n")],
            &[(400, "Performing First Start Initialization of the controller program\r\n")],
            &[(1_600, BANNER), (5, MENU)],
        ] {
            let story = [&begun[..], end, &[(100, THIRD)]].concat();
            let expected = (vec![(500, "6126:01 6126:02 ...".into())], Some("6126:01 6126:02 ...".into()));
            assert_eq!(readings(&story), expected, "{end:?}");
        }
        assert_eq!(readings(&begun).0, [(500, "6126:01 6126:02 ...".into())], "the recording's end");
    }

    #[test]
    fn an_entry_after_the_menu_shows_that_the_walk_goes_on() {
        let story = [(0, FIRST), (50, MENU), (500, SECOND)];
        let expected = (vec![(550, "6126:01 6126:02 ...".into())], Some("6126:01 6126:02 ...".into()));
        assert_eq!(readings(&story), expected);
    }

    #[test]
    fn an_entry_with_the_products_name_is_not_a_banner() {
        let story = [
            (0, ">v"),
            (50, FIRST),
            (400, ">\r"),
            (50, "1008h Device Name AXTC4CO V1.1.0\r\n"),
            (50, SECOND),
            (400, ">x"),
            (50, MENU),
        ];
        assert_eq!(readings(&story).0.len(), 1, "{:?}", readings(&story));
        assert!(readings(&story).1.is_some_and(|read| read.contains("6126:01") && read.contains("6126:02")));
    }

    #[test]
    fn with_the_view_left_numbers_are_no_entries_and_without_keys_everything_may_be_one() {
        for key in [">x", ">m", ">d", ">t", ">s", ">l"] {
            let story = [(0, ">v"), (50, FIRST), (400, key), (100, SECOND)];
            assert_eq!(readings(&story).1.as_deref(), Some("6126:01 ..."), "{key}");
        }
        assert_eq!(readings(&[(0, FIRST), (400, SECOND), (50, MENU)]).1.as_deref(), Some("6126:01 6126:02"));
        assert_eq!(readings(&[(0, "hello\r\n"), (50, MENU)]), (vec![], None));
    }

    #[test]
    fn the_walk_that_was_complete_goes_before_one_that_was_broken_off() {
        let walk = [(0, ">v"), (50, FIRST), (400, ">\r"), (50, SECOND), (400, ">x"), (50, MENU)];
        let broken = [(9_000, ">v"), (50, THIRD), (400, "!link lost")];
        assert_eq!(readings(&[&walk[..], &broken].concat()).1.as_deref(), Some("6126:01 6126:02"));
        assert_eq!(readings(&[&broken[..], &walk].concat()).1.as_deref(), Some("6126:01 6126:02"));
        let later = [(9_000, ">v"), (50, THIRD), (400, ">x"), (50, MENU)];
        assert_eq!(readings(&[&walk[..], &later].concat()).1.as_deref(), Some("6126:03"), "the last one");
    }

    #[test]
    fn where_nothing_is_found_the_last_thing_heard_is_reported() {
        let (events, _) =
            played(&[(0, "hello 5\r\n"), (50, "AXTC4CO V1.1.0\r\n")], Command::Diagnostics { pages: None });
        let Some(Event::Finished(Outcome::NoAnswer { awaited: Awaited::Page, heard, .. })) = events.last() else {
            panic!("{events:?}")
        };
        assert_eq!(heard.map(Span::len), Some(14));
        let heading = [(0, BANNER), (50, ">v"), (50, "6126h Thermocouple Scaling Factor\r\n")];
        let (events, _) = played(&heading, Command::ReadDictionary);
        let Some(Event::Finished(Outcome::NoAnswer { awaited: Awaited::Entry, heard, .. })) = events.last() else {
            panic!("{events:?}")
        };
        assert_eq!(heard.map(Span::len), Some(33));
        let (_, session) = played(
            &[(0, "Supply 24.1 V\r\n"), (1_000, "Supply 24.1 V\r\n"), (900, "!link lost")],
            Command::Diagnostics { pages: None },
        );
        assert_eq!(session.facts().diagnostics, None);
    }

    #[test]
    fn no_more_pages_are_given_than_were_asked_for() {
        let page = "Supply 24.1 V\r\n";
        // The first is known to be one by the second.
        let (events, _) = played(&[(0, page), (1_000, page), (900, "")], Command::Diagnostics { pages: Some(1) });
        assert_eq!(events.iter().filter(|event| matches!(event, Event::Page { .. })).count(), 1, "{events:?}");
        assert_eq!(events.last(), Some(&Event::Finished(Outcome::Done(Job::Diagnostics))));
    }
}
