//! Which of the lines that come are pages of diagnostics, whoever has asked for them: a user at the keys, another
//! console, somebody in a recording.
//!
//! A page is known by how it comes: in one go, with numbers in it, and again every second without a key before it
//! (AXTC4CO manual, section 4.1.4). After an S the first one counts at once. Once a page is known, what looks like it
//! is a page as well, and what does not is something else, for instance the answers to keys that are pressed meanwhile.

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use crate::record::Span;
use crate::session::diagnostics::{Assembler, FIRST_PAGE, Page, PageEnd, STOPPED, UNDER_WAY, has_words};
use crate::session::job::Desk;
use crate::session::keys::{Key, Typed};
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, MenuKey, Message, Text, diagnostics};

/// How long after a key other than S a line may be its answer.
const ANSWER: Duration = Duration::from_millis(1000);
/// Shortest and longest time between the beginnings of two pages. One comes every second, but a busy computer or a full
/// line shifts them.
const APART: (Duration, Duration) = (Duration::from_millis(500), Duration::from_millis(1900));
/// Time without a page after which pages count as stopped.
const CEASED: Duration = Duration::from_secs(3);

/// Listens for pages.
#[derive(Debug, Default)]
pub(in crate::session) struct Pages {
    block: Block,
    switch: Switch,
    /// When the last key was sent, and the last one other than S. Not every recording has keys.
    key_at: Option<Instant>,
    other_key_at: Option<Instant>,
    /// What a page looks like.
    known: Option<Looks>,
    /// The block before the current one, which may turn out to have been a page.
    before: Option<Before>,
    /// Set while pages come: when they count as stopped, unless another has come.
    runs_until: Option<Instant>,
}

/// Lines that came in one go.
#[derive(Debug, Default)]
struct Block {
    lines: Assembler,
    begun: Instant,
    /// What S had been typed for when the block began: the S that stops pages may come in the middle of one.
    begun_with: Switch,
    beside: Beside,
    /// How many of its lines were counted as not understood.
    counted: u64,
}

/// What may be in a block besides the lines of a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Beside {
    #[default]
    Nothing,
    /// The answer to S.
    SwitchAnswer,
    /// Anything: the answer to another key, a menu, a question.
    Other,
}

/// What S has been typed for, and when last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Switch {
    #[default]
    NotTyped,
    On(Instant),
    /// Pages have been stopped by it, or by another key since.
    Off(Instant),
}

impl Switch {
    fn at(self) -> Option<Instant> {
        match self {
            Switch::NotTyped => None,
            Switch::On(at) | Switch::Off(at) => Some(at),
        }
    }

    fn is_on(self) -> bool {
        matches!(self, Switch::On(_))
    }

    /// No pages are asked for any more.
    fn end(&mut self) {
        if let Switch::On(at) = *self {
            *self = Switch::Off(at);
        }
    }
}

/// The block before the current one.
#[derive(Debug)]
struct Before {
    page: Page,
    labels: Vec<String>,
    begun: Instant,
    given: bool,
    counted: u64,
}

/// What the lines of a page begin with. The rest of a line changes: the channel may be open, and have no number.
#[derive(Debug, Default)]
struct Looks {
    words: BTreeSet<String>,
}

impl Looks {
    fn of(lines: &[Text]) -> Self {
        Looks { words: lines.iter().filter_map(|line| first_word(&line.text)).collect() }
    }

    /// Whether a line can be one of such a page.
    fn fits(&self, line: &str) -> bool {
        first_word(line).is_none_or(|word| self.words.contains(&word))
    }

    /// Whether these lines are mostly of such a page. If lines that do not fit have been removed before (`is_picked`),
    /// most of the page has to remain: single lines of a menu or of the view may begin like a line of the page.
    fn matches(&self, lines: &[Text], is_picked: bool) -> bool {
        let words: Vec<String> = lines.iter().filter_map(|line| first_word(&line.text)).collect();
        let known: Vec<&String> = words.iter().filter(|word| self.words.contains(*word)).collect();
        let distinct = known.iter().collect::<BTreeSet<_>>().len();
        !known.is_empty() && known.len() * 2 >= words.len() && (!is_picked || distinct * 2 >= self.words.len())
    }
}

/// The first word of a line, if it has any.
fn first_word(line: &str) -> Option<String> {
    let is_in_word = |c: char| c.is_alphanumeric() || c == '-';
    let from = line.find(char::is_alphanumeric)?;
    let word = line[from..].split(|c: char| !is_in_word(c)).next()?;
    Some(word.to_lowercase())
}

fn labels(lines: &[Text]) -> Vec<String> {
    let quantities = lines.iter().flat_map(|line| diagnostics::quantities(&line.text));
    quantities.map(|quantity| quantity.label).collect()
}

impl Pages {
    /// This has been sent.
    pub(in crate::session) fn typed(&mut self, typed: &Typed, desk: &mut Desk<'_>) {
        self.key_at = Some(desk.now);
        if *typed == Typed::File {
            // Anything may answer a file.
            self.other_key(desk.now);
        }
        for key in typed.keys() {
            match key {
                Key::Menu(MenuKey::Diagnostics) => {
                    // Pages may have been on before the first key that is known here.
                    let stops = self.switch.is_on() || desk.facts.diagnostics.is_some();
                    self.switch = if stops { Switch::Off(desk.now) } else { Switch::On(desk.now) };
                    self.block.beside = self.block.beside.max(Beside::SwitchAnswer);
                    self.block.lines.pressed();
                    if desk.facts.diagnostics.is_some() {
                        self.runs_until = Some(desk.now + STOPPED);
                    }
                }
                Key::Menu(MenuKey::View | MenuKey::Menu | MenuKey::Load) => {
                    self.switch.end();
                    self.other_key(desk.now);
                }
                Key::Menu(MenuKey::Default | MenuKey::Stream) | Key::Leave | Key::Enter | Key::Other => {
                    self.other_key(desk.now);
                }
            }
        }
    }

    fn other_key(&mut self, now: Instant) {
        self.other_key_at = Some(now);
        self.interlude();
    }

    /// Something that is not on a page has come, perhaps in the middle of one.
    fn interlude(&mut self) {
        if self.block.lines.due().is_some() {
            self.block.beside = Beside::Other;
        }
    }

    /// The unit has printed this, and no job has made anything of it.
    pub(in crate::session) fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) {
        match message {
            Message::Row(_) => return,
            Message::MenuKey(_) | Message::Prompt(_) => {
                self.interlude();
                // Titles of a menu that were counted as not understood are uncounted elsewhere (`Dialogue::menu`).
                self.block.counted = 0;
                return;
            }
            // No page names the product: the unit has restarted, and shows no pages any more.
            Message::Software(name) if name.product.is_some() => {
                let asked = self.other_key_at.is_some_and(|at| desk.now <= at + ANSWER);
                self.interlude();
                if !asked {
                    self.restarted(desk);
                }
                return;
            }
            Message::Loader(text) => {
                self.interlude();
                if matches!(text, LoaderText::Waiting) {
                    self.restarted(desk);
                }
                return;
            }
            // Numbers alone: the end of a row of the stream for which the unit had no room as a whole.
            _ if !has_words(&text.text) => return,
            Message::Software(_) | Message::FirstStart | Message::Network(_) | Message::Refusal | Message::Text => {}
        }
        if self.block.lines.due().is_none() {
            let beside = if self.is_soon_after_switch(desk.now) { Beside::SwitchAnswer } else { Beside::Nothing };
            let lines = std::mem::take(&mut self.block.lines);
            self.block = Block { lines, begun: desk.now, begun_with: self.switch, beside, counted: 0 };
        }
        // Keys before the S have been answered by the time the S is.
        let is_newer = |at: Instant| self.switch.at().is_none_or(|switched| switched < at);
        if self.other_key_at.is_some_and(|at| desk.now <= at + ANSWER && is_newer(at)) {
            self.block.beside = Beside::Other;
        }
        self.block.counted += u64::from(desk.counted);
        self.block.lines.line(text, desk.now);
        match diagnostics::switch(&text.text).filter(|_| self.is_soon_after_switch(desk.now)) {
            Some(true) if desk.facts.diagnostics.is_none() => self.come(desk.now + FIRST_PAGE, text.span, desk),
            Some(false) => self.stopped(desk),
            Some(true) | None => {}
        }
    }

    fn is_soon_after_switch(&self, now: Instant) -> bool {
        self.switch.at().is_some_and(|at| now <= at + ANSWER)
    }

    /// The link is gone, or pages are not listened for any more: the rest of the current block will not come, and what
    /// the unit does meanwhile is unknown. What a page looks like stays known.
    pub(in crate::session) fn interrupt(&mut self) {
        *self = Pages { known: self.known.take(), key_at: self.key_at, ..Pages::default() };
    }

    fn restarted(&mut self, desk: &mut Desk<'_>) {
        self.switch.end();
        (self.known, self.before) = (None, None);
        self.stopped(desk);
    }

    /// Pages come. They count as stopped at `until`, unless something shows before that they still come.
    fn come(&mut self, until: Instant, span: Span, desk: &mut Desk<'_>) {
        self.runs_until = Some(until);
        desk.facts.diagnostics.get_or_insert(span);
    }

    fn stopped(&mut self, desk: &mut Desk<'_>) {
        desk.facts.diagnostics = None;
        self.runs_until = None;
        self.switch.end();
    }

    /// When to call [`tick`](Pages::tick) next.
    pub(in crate::session) fn due(&self) -> Option<Instant> {
        // While a page may still be coming, the page decides and not the time.
        self.block.lines.due().or(self.runs_until)
    }

    /// Time has passed: returns the pages that are complete now.
    pub(in crate::session) fn tick(&mut self, desk: &mut Desk<'_>) -> Vec<Page> {
        let mut pages = Vec::new();
        if self.block.lines.due().is_some_and(|due| due <= desk.now) {
            pages = self.complete(desk);
        }
        if self.runs_until.is_some_and(|until| until <= desk.now) && self.block.lines.due().is_none() {
            self.stopped(desk);
        }
        pages
    }

    /// Nothing more comes of the current block: returns the pages that are complete with it.
    pub(in crate::session) fn complete(&mut self, desk: &mut Desk<'_>) -> Vec<Page> {
        let page = self.block.lines.complete(desk);
        let rest = desk.pending.filter(|_| std::mem::take(&mut desk.cut));
        let Some(page) = page else { return Vec::new() };
        let pages = self.judge(page, desk);
        // The text without a line end has been read as the last line of a page, unless it may be a question.
        let fits = |rest: &Text| self.known.as_ref().is_some_and(|known| known.fits(&rest.text));
        desk.cut = rest.is_some_and(|rest| self.block.beside != Beside::Other || fits(rest));
        pages
    }

    fn judge(&mut self, mut page: Page, desk: &mut Desk<'_>) -> Vec<Page> {
        let known = self.known.as_ref();
        let beside = self.block.beside;
        let is_mixed = beside == Beside::Other;
        page.lines.retain(|line| {
            // The answer to a key is not a line of the page that comes with it.
            let is_answer = is_mixed || (beside == Beside::SwitchAnswer && diagnostics::is_switch(&line.text));
            !is_answer || known.map_or(is_mixed, |known| known.fits(&line.text))
        });
        let labels = labels(&page.lines);
        let before = self.before.take();
        if labels.is_empty() {
            return Vec::new();
        }
        let again =
            before.as_ref().is_some_and(|before| before.labels == labels && self.comes_by_itself(before, page.end));
        let given = again
            || match known {
                Some(known) => self.key_at.is_some() && known.matches(&page.lines, is_mixed),
                None => {
                    let is_soon = self.switch.at().is_some_and(|at| self.block.begun <= at + FIRST_PAGE);
                    self.block.begun_with.is_on() && !is_mixed && is_soon
                }
            };
        let (begun, mut counted) = (self.block.begun, std::mem::take(&mut self.block.counted));
        let mut pages = Vec::new();
        if given {
            if self.known.is_none() || again {
                self.known = Some(Looks::of(&page.lines));
            }
            if let Some(first) = before.filter(|before| again && !before.given) {
                counted += first.counted;
                pages.push(first.page);
            }
            pages.push(page.clone());
            let unrecognised = desk.facts.unrecognised_lines.saturating_sub(counted);
            desk.facts.unrecognised_lines = unrecognised;
            // A page that was under way before the S that stops pages does not show what the S has done.
            let is_late = self.switch.at().is_none_or(|at| page.at >= at + UNDER_WAY);
            if is_late || self.switch.is_on() {
                let span = page.lines.first().map_or(Span::default(), |line| line.span);
                self.come(page.at + CEASED, span, desk);
            }
        }
        self.before = Some(Before { page, labels, begun, given, counted });
        pages
    }

    /// Whether a line that comes while pages come may be part of one.
    pub(in crate::session) fn owns(&self, line: &str) -> bool {
        self.known.as_ref().is_some_and(|known| known.fits(line))
    }

    /// Whether this block has come after the one before as pages do: neither answers a key, and there was silence
    /// between them.
    fn comes_by_itself(&self, before: &Before, end: PageEnd) -> bool {
        let apart = self.block.begun.since(before.begun);
        let unasked = self.key_at.is_none_or(|at| at < before.begun) && (APART.0..=APART.1).contains(&apart);
        let is_parted = before.page.end == PageEnd::Silence && end == PageEnd::Silence;
        is_parted && (self.key_at.is_none() || (self.block.beside != Beside::Other && unasked))
    }
}
