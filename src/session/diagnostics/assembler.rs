//! Assembles pages from lines: a page is what comes in one go and has numbers in it.

use crate::session::job::Desk;
use crate::time::{Duration, Instant};
use crate::wire::{Text, diagnostics};

/// Silence that ends a page: most units print all of one within milliseconds, but some measure between two lines.
const QUIET: Duration = Duration::from_millis(400);
/// How long a page may take: the next one begins a second after it.
const LONGEST: Duration = Duration::from_millis(900);
/// How long a text without a line end must stay as it is to count as the last line of a page. Before that, it may be a
/// row of the stream under way, or half a line on a busy computer.
const STILL: Duration = Duration::from_millis(300);
/// Most lines of a page; more than a screen at 200x60 shows.
const MOST_LINES: usize = 200;

/// A page.
#[derive(Clone, Debug)]
pub(in crate::session) struct Page {
    /// When its last line came.
    pub(in crate::session) at: Instant,
    /// Its lines, as printed.
    pub(in crate::session) lines: Vec<Text>,
    /// What has ended it.
    pub(in crate::session) end: PageEnd,
}

/// What shows that a page is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session) enum PageEnd {
    /// Nothing more has come for a while.
    Silence,
    /// Lines go on, for longer than a page takes.
    Time,
}

/// The page under construction.
#[derive(Debug, Default)]
pub(in crate::session) struct Assembler {
    lines: Vec<Text>,
    /// When its first line came.
    begun: Instant,
    /// When its last line came.
    at: Instant,
    /// When the page counts as complete.
    due: Option<Instant>,
    /// Where a text without a line end ended when the page was first looked at.
    unended: Option<u64>,
    /// The key has been pressed, and no page has come since: the unit may answer it on the lines before the first one.
    is_answer: bool,
}

impl Assembler {
    /// A line that may be part of a page.
    pub(in crate::session) fn line(&mut self, text: &Text, now: Instant) {
        if self.due.is_none() {
            self.begun = now;
        }
        if self.lines.len() < MOST_LINES {
            self.lines.push(text.clone());
        }
        self.at = now;
        self.due = Some((now + QUIET).min(self.begun + LONGEST));
        self.unended = None;
    }

    /// The key that switches pages has been pressed.
    pub(in crate::session) fn pressed(&mut self) {
        self.is_answer = true;
    }

    /// When the page may be complete.
    pub(in crate::session) fn due(&self) -> Option<Instant> {
        self.due
    }

    /// The page is due: returns it if it shows numbers. `None` also while a text without a line end may still grow.
    pub(in crate::session) fn complete(&mut self, desk: &mut Desk<'_>) -> Option<Page> {
        let end = if desk.now < self.at + QUIET { PageEnd::Time } else { PageEnd::Silence };
        let unended = desk.pending.map(|text| text.span.end);
        let looked_at = std::mem::replace(&mut self.unended, unended);
        if unended.is_some() && looked_at.is_none() && end == PageEnd::Silence {
            self.due = Some(desk.now + STILL);
            return None;
        }
        self.due = None;
        let mut lines = std::mem::take(&mut self.lines);
        if let Some(text) = desk.pending.filter(|_| unended == looked_at) {
            lines.push(text.clone());
            // It has been read: what is painted over it is the next page.
            desk.cut = true;
        }
        if std::mem::take(&mut self.is_answer) {
            let heading = lines.iter().take_while(|line| diagnostics::quantities(&line.text).is_empty());
            let answers = heading.enumerate().filter(|(_, line)| diagnostics::is_switch(&line.text));
            let answer = answers.last().map_or(0, |(at, _)| at + 1);
            lines.drain(..answer);
            if let Some(first) = lines.first_mut().filter(|_| answer == 0) {
                without_echo(first);
            }
        }
        let has_numbers = lines.iter().any(|line| !diagnostics::quantities(&line.text).is_empty());
        has_numbers.then_some(Page { at: self.at, lines, end })
    }
}

/// Takes the echo of the key off the first line of a page: the key was sent as `s`, and no label looks like `sSUP`.
fn without_echo(line: &mut Text) {
    let is_echo = |rest: &str| rest.starts_with(|first: char| first.is_uppercase() || !first.is_ascii());
    if line.text.strip_prefix('s').is_some_and(is_echo) {
        line.text.remove(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Span;

    #[test]
    fn the_echo_of_the_key_is_no_part_of_a_label() {
        for (line, expected) in [
            ("sSUP 24.061", "SUP 24.061"),
            ("s│ Supply │ 24.061 V │", "│ Supply │ 24.061 V │"),
            ("supply 24.061", "supply 24.061"),
            ("SUP 24.061", "SUP 24.061"),
            ("s", "s"),
        ] {
            let mut text = Text { span: Span::default(), text: line.to_owned() };
            without_echo(&mut text);
            assert_eq!(text.text, expected);
        }
    }
}
