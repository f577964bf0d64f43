//! Which of the lines that come are pages of diagnostics, whoever has asked for them: a hand, another console, somebody
//! in a recording.
//!
//! What tells them is what a page is: it comes in one go, has numbers in it, and comes again every second without
//! anybody having pressed a key (AXTC4CO manual, section 4.1.4). Behind an S the first one is believed at once. Once a
//! page is known, what looks like it is one as well, and what does not is something else, for instance the answers of a
//! dialogue that somebody has meanwhile.

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use crate::record::Span;
use crate::session::diagnostics::{Assembler, FIRST_PAGE, Page, STOPPED, UNDER_WAY, has_words};
use crate::session::job::Desk;
use crate::session::keys::{Key, Typed};
use crate::time::{Duration, Instant};
use crate::wire::{LoaderText, MenuKey, Message, Text, diagnostics};

/// How long behind a key other than S a line may be its answer.
const ANSWER: Duration = Duration::from_millis(1000);
/// How far apart two pages come, one every second: a busy computer moves them, and a unit whose line is full.
const APART: (Duration, Duration) = (Duration::from_millis(500), Duration::from_millis(1900));
/// Time without a page behind which they have ceased.
const CEASED: Duration = Duration::from_secs(3);

/// Listens for pages.
#[derive(Debug, Default)]
pub(in crate::session) struct Pages {
    block: Assembler,
    /// When the block under construction began.
    begun: Instant,
    /// Pages were being asked for when it began: the key that stops them may come in its middle.
    begun_on: bool,
    /// Something else may stand in the block: the answer to a key, a menu, a question.
    is_mixed: bool,
    /// S has been pressed while the block came.
    pressed: bool,
    /// Lines of the block that were counted as such that nobody understands.
    counted: u64,
    /// S has been typed an odd number of times since the unit has started.
    switched_on: bool,
    /// Keys are seen at all: not every recording has them.
    has_keys: bool,
    /// When the last key was sent, and the last S.
    key_at: Option<Instant>,
    other_key_at: Option<Instant>,
    switched_at: Option<Instant>,
    /// What a page looks like.
    known: Option<Looks>,
    /// The block before, should it turn out to have been a page.
    before: Option<Before>,
    /// Pages come ...
    runs: bool,
    /// ... and have ceased when none has come by then.
    ceased: Instant,
}

#[derive(Debug)]
struct Before {
    page: Page,
    labels: Vec<String>,
    begun: Instant,
    given: bool,
    counted: u64,
}

/// What the lines of a page begin with. What stands in them changes: a channel may be open, and have no number.
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

    /// Whether these lines are mostly of such a page. Where everything else has been left out of them (`is_picked`), most
    /// of a page has to be left: single lines of a menu or of the view may begin like one of its.
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
        self.has_keys = true;
        self.key_at = Some(desk.now);
        if *typed == Typed::File {
            // Anything may answer it.
            self.other_key(desk.now);
        }
        for key in typed.keys() {
            match key {
                Key::Menu(MenuKey::Diagnostics) => {
                    // They may have been on before anybody here has pressed a key.
                    self.switched_on = !(self.switched_on || desk.facts.diagnostics.is_some());
                    self.switched_at = Some(desk.now);
                    self.pressed = true;
                    self.block.pressed();
                    if desk.facts.diagnostics.is_some() {
                        self.ceased = desk.now + STOPPED;
                    }
                }
                Key::Menu(MenuKey::View | MenuKey::Menu | MenuKey::Load) => {
                    self.switched_on = false;
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
        self.is_mixed |= self.block.due().is_some();
    }

    /// The unit has printed this, and no job has made anything of it.
    pub(in crate::session) fn heard(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) {
        match message {
            Message::Row(_) => return,
            Message::MenuKey(_) | Message::Prompt(_) => {
                self.is_mixed |= self.block.due().is_some();
                // The titles of a menu are taken back by whoever knows that it has come.
                self.counted = 0;
                return;
            }
            // No page says the name: the unit has started anew, and shows none any more.
            Message::Software(name) if name.product.is_some() => {
                let asked = self.other_key_at.is_some_and(|at| desk.now <= at + ANSWER);
                self.is_mixed |= self.block.due().is_some();
                if !asked {
                    self.restarted(desk);
                }
                return;
            }
            Message::Loader(text) => {
                self.is_mixed |= self.block.due().is_some();
                if matches!(text, LoaderText::Waiting) {
                    self.restarted(desk);
                }
                return;
            }
            // Of a row that the unit has had no room for there is its end.
            _ if !has_words(&text.text) => return,
            Message::Software(_) | Message::FirstStart | Message::Network(_) | Message::Refusal | Message::Text => {}
        }
        if self.block.due().is_none() {
            self.begun = desk.now;
            self.begun_on = self.switched_on;
            (self.is_mixed, self.pressed, self.counted) = (false, self.is_soon_behind_switch(desk.now), 0);
        }
        // What answers a key before the S is out by the time the S is answered.
        let is_newer = |at: Instant| self.switched_at.is_none_or(|switched| switched < at);
        self.is_mixed |= self.other_key_at.is_some_and(|at| desk.now <= at + ANSWER && is_newer(at));
        self.counted += u64::from(desk.counted);
        self.block.line(text, desk.now);
        match diagnostics::switch(&text.text).filter(|_| self.is_soon_behind_switch(desk.now)) {
            Some(true) if desk.facts.diagnostics.is_none() => self.come(desk.now + FIRST_PAGE, text.span, desk),
            Some(false) => self.stopped(desk),
            Some(true) | None => {}
        }
    }

    fn is_soon_behind_switch(&self, now: Instant) -> bool {
        self.switched_at.is_some_and(|at| now <= at + ANSWER)
    }

    /// The link is gone, or nothing is listened for: the rest of what came last will not come, and what the unit does
    /// meanwhile nobody knows. What a page looks like stays known.
    pub(in crate::session) fn interrupt(&mut self) {
        if self.block.due().is_some() || self.before.is_some() || self.key_at.is_some() {
            let known = self.known.take();
            *self = Pages { known, has_keys: self.has_keys, ..Pages::default() };
        }
    }

    fn restarted(&mut self, desk: &mut Desk<'_>) {
        (self.switched_on, self.begun_on) = (false, false);
        (self.known, self.before) = (None, None);
        self.stopped(desk);
    }

    /// The unit shows its diagnostics, as long as something shows that before `until`.
    fn come(&mut self, until: Instant, span: Span, desk: &mut Desk<'_>) {
        (self.runs, self.ceased) = (true, until);
        desk.facts.diagnostics.get_or_insert(span);
    }

    fn stopped(&mut self, desk: &mut Desk<'_>) {
        desk.facts.diagnostics = None;
        (self.runs, self.switched_on) = (false, false);
    }

    /// When it wants to be looked after.
    pub(in crate::session) fn due(&self) -> Option<Instant> {
        // A page that may still be going on says more than the time.
        self.block.due().or(self.runs.then_some(self.ceased))
    }

    /// Time has passed: the pages that are complete now.
    pub(in crate::session) fn tick(&mut self, desk: &mut Desk<'_>) -> Vec<Page> {
        let mut pages = Vec::new();
        if self.block.due().is_some_and(|due| due <= desk.now) {
            pages = self.complete(desk);
        }
        if self.runs && self.ceased <= desk.now && self.block.due().is_none() {
            self.stopped(desk);
        }
        pages
    }

    /// Nothing more comes of the block under construction: the pages it makes.
    pub(in crate::session) fn complete(&mut self, desk: &mut Desk<'_>) -> Vec<Page> {
        let cut = std::mem::take(&mut desk.cut);
        let page = self.block.complete(desk);
        let rest = desk.pending.filter(|_| std::mem::replace(&mut desk.cut, cut));
        let Some(page) = page else { return Vec::new() };
        let pages = self.judge(page, desk);
        // What stands there without a line end has been read as the last line of a page. What may be a question stays one.
        let fits = |rest: &Text| self.known.as_ref().is_some_and(|known| known.fits(&rest.text));
        desk.cut |= rest.is_some_and(|rest| !self.is_mixed || fits(rest));
        pages
    }

    fn judge(&mut self, mut page: Page, desk: &mut Desk<'_>) -> Vec<Page> {
        let known = self.known.as_ref();
        page.lines.retain(|line| {
            // The answer to a key is no line of the page that comes with it.
            let is_answer = self.is_mixed || (self.pressed && diagnostics::is_switch(&line.text));
            !is_answer || known.map_or(self.is_mixed, |known| known.fits(&line.text))
        });
        let labels = labels(&page.lines);
        let before = self.before.take();
        if labels.is_empty() {
            return Vec::new();
        }
        let again = before.as_ref().is_some_and(|before| before.labels == labels && self.comes_by_itself(before));
        let given = again
            || match known {
                Some(known) => self.has_keys && known.matches(&page.lines, self.is_mixed),
                None => {
                    let is_soon = self.switched_at.is_some_and(|at| self.begun <= at + FIRST_PAGE);
                    self.begun_on && !self.is_mixed && is_soon
                }
            };
        let (begun, mut counted) = (self.begun, std::mem::take(&mut self.counted));
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
            // A page that was under way before the key that stops them says nothing of what the key has done.
            let is_late = self.switched_at.is_none_or(|at| page.at >= at + UNDER_WAY);
            if is_late || self.switched_on {
                let span = page.lines.first().map_or(Span::default(), |line| line.span);
                self.come(page.at + CEASED, span, desk);
            }
        }
        self.before = Some(Before { page, labels, begun, given, counted });
        pages
    }

    /// Whether a line is one of a page while pages come.
    pub(in crate::session) fn owns(&self, line: &str) -> bool {
        self.known.as_ref().is_some_and(|known| known.fits(line))
    }

    /// Whether this block has come behind the one before as pages do: nobody has asked for either.
    fn comes_by_itself(&self, before: &Before) -> bool {
        let apart = self.begun.since(before.begun);
        let unasked = self.key_at.is_none_or(|at| at < before.begun) && (APART.0..=APART.1).contains(&apart);
        !self.has_keys || (!self.is_mixed && unasked)
    }
}
