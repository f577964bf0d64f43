//! The lines of the terminal: what went over the line, as text.
//!
//! The bytes themselves live in the record. This is the text made of them, folded as they come, so that a picture costs
//! what is on the screen and not what has ever been said. Each direction builds its own line: an echo does not tear a
//! typed word apart.

use std::collections::VecDeque;

use crate::record::{Direction, Record};
use crate::time::Instant;
use crate::wire::visible::{Controls, Visible};
use crate::wire::{XOFF, XON};

/// Lines kept: several minutes of a fast stream, some hours of ordinary talk.
pub const KEPT_LINES: usize = 10_000;
/// Bytes of a line's text at most; a unit that never ends its line gets it ended here.
pub const LONGEST_LINE: usize = 400;
/// Columns between two tab stops.
const TAB: usize = 8;

/// One line of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextLine {
    /// When its first byte came.
    pub at: Instant,
    /// Who wrote it.
    pub origin: Origin,
    /// What it says, fit for the screen.
    pub text: String,
}

/// Who wrote a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The unit.
    Unit,
    /// We.
    Us,
    /// The console, about the link.
    Console,
}

/// The newest lines.
#[derive(Debug, Default)]
pub struct Scrollback {
    lines: VecDeque<TextLine>,
    dropped: u64,
    /// Entries of the record already taken in.
    followed: u64,
    from_unit: Writer,
    to_unit: Writer,
    /// Room for what one byte is shown as.
    shown: String,
}

/// The line of one direction.
#[derive(Debug)]
struct Writer {
    /// Number of the line under construction.
    line: Option<u64>,
    /// The last byte ended a line as CR: an LF after it belongs to it.
    after_return: bool,
    /// Makes characters of the bytes.
    visible: Visible,
}

impl Default for Writer {
    fn default() -> Self {
        Writer { line: None, after_return: false, visible: Visible::new(Controls::Layout) }
    }
}

impl Scrollback {
    /// Takes in what the record has and this has not seen. Says whether there was anything.
    pub fn follow(&mut self, record: &Record) -> bool {
        if record.entry_count() <= self.followed {
            return false;
        }
        for entry in record.entries_from(self.followed) {
            for &byte in &entry.bytes {
                match entry.direction {
                    Direction::FromUnit => self.received(entry.at, byte),
                    Direction::ToUnit => self.sent(entry.at, byte),
                }
            }
        }
        self.followed = record.entry_count();
        true
    }

    /// A word of the console's own, and the start of a new record.
    pub fn begin(&mut self, at: Instant, text: String) {
        self.note(at, text);
        self.followed = 0;
        self.from_unit = Writer::default();
        self.to_unit = Writer::default();
    }

    /// A word of the console's own.
    pub fn note(&mut self, at: Instant, text: String) {
        self.from_unit.line = None;
        self.to_unit.line = None;
        self.push(TextLine { at, origin: Origin::Console, text });
    }

    /// The lines, oldest first.
    pub fn lines(&self) -> impl DoubleEndedIterator<Item = &TextLine> + ExactSizeIterator {
        self.lines.iter()
    }

    /// Number of the line after the newest, counted since the start.
    pub fn end(&self) -> u64 {
        self.dropped + self.lines.len() as u64
    }

    /// Number of the oldest line.
    pub fn start(&self) -> u64 {
        self.dropped
    }

    fn received(&mut self, at: Instant, byte: u8) {
        let follows_return = std::mem::replace(&mut self.from_unit.after_return, byte == b'\r');
        match byte {
            b'\n' if follows_return => {}
            b'\r' | b'\n' => {
                self.line(at, Direction::FromUnit);
                self.end_line(at, Direction::FromUnit);
                // What is typed after this line belongs below it.
                self.to_unit.line = None;
            }
            // Flow control may come anywhere, even between CR and LF: it is not text.
            XON | XOFF => self.from_unit.after_return = follows_return,
            _ => self.write(at, Direction::FromUnit, byte),
        }
    }

    fn sent(&mut self, at: Instant, byte: u8) {
        match byte {
            XON | XOFF => {}
            b'\r' | b'\n' => {
                self.append(at, Direction::ToUnit, if byte == b'\r' { "^M" } else { "^J" });
                self.end_line(at, Direction::ToUnit);
            }
            _ => self.write(at, Direction::ToUnit, byte),
        }
    }

    fn write(&mut self, at: Instant, direction: Direction, byte: u8) {
        let mut text = std::mem::take(&mut self.shown);
        text.clear();
        self.writer_mut(direction).visible.push(&[byte], &mut text);
        self.append(at, direction, &text);
        self.shown = text;
        if self.line(at, direction).text.len() >= LONGEST_LINE {
            self.end_line(at, direction);
        }
    }

    fn append(&mut self, at: Instant, direction: Direction, text: &str) {
        let line = self.line(at, direction);
        for character in text.chars() {
            match character {
                '\t' => line.text.extend(std::iter::repeat_n(' ', TAB - line.text.chars().count() % TAB)),
                // A backspace is shown: what it would rub out may be what one is looking for.
                '\x08' => line.text.push_str("^H"),
                _ => line.text.push(character),
            }
        }
    }

    /// Ends the line under construction, with whatever was begun and will not be completed.
    fn end_line(&mut self, at: Instant, direction: Direction) {
        let mut text = String::new();
        self.writer_mut(direction).visible.finish(&mut text);
        if !text.is_empty() {
            self.append(at, direction, &text);
        }
        self.writer_mut(direction).line = None;
    }

    /// The line under construction; a new one if there is none.
    fn line(&mut self, at: Instant, direction: Direction) -> &mut TextLine {
        let open = self.writer(direction).line.and_then(|number| number.checked_sub(self.dropped));
        let position = match open {
            Some(position) => position as usize,
            None => {
                let origin = match direction {
                    Direction::FromUnit => Origin::Unit,
                    Direction::ToUnit => Origin::Us,
                };
                self.push(TextLine { at, origin, text: String::new() });
                self.writer_mut(direction).line = Some(self.end() - 1);
                self.lines.len() - 1
            }
        };
        &mut self.lines[position]
    }

    fn push(&mut self, line: TextLine) {
        self.lines.push_back(line);
        if self.lines.len() > KEPT_LINES {
            self.lines.pop_front();
            self.dropped += 1;
        }
    }

    fn writer(&self, direction: Direction) -> &Writer {
        match direction {
            Direction::FromUnit => &self.from_unit,
            Direction::ToUnit => &self.to_unit,
        }
    }

    fn writer_mut(&mut self, direction: Direction) -> &mut Writer {
        match direction {
            Direction::FromUnit => &mut self.from_unit,
            Direction::ToUnit => &mut self.to_unit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Secrecy;

    struct Talk {
        record: Record,
        scrollback: Scrollback,
        millis: u64,
    }

    impl Talk {
        fn new() -> Self {
            Talk { record: Record::new(), scrollback: Scrollback::default(), millis: 0 }
        }

        fn says(&mut self, direction: Direction, bytes: &[u8]) -> &mut Self {
            self.millis += 10;
            self.record.push(Instant::from_millis(self.millis), direction, Secrecy::Open, bytes);
            assert!(self.scrollback.follow(&self.record));
            assert!(!self.scrollback.follow(&self.record), "all of it is known now");
            self
        }

        fn unit(&mut self, bytes: &[u8]) -> &mut Self {
            self.says(Direction::FromUnit, bytes)
        }

        fn us(&mut self, bytes: &[u8]) -> &mut Self {
            self.says(Direction::ToUnit, bytes)
        }

        fn text(&self) -> Vec<String> {
            let mark = |line: &TextLine| match line.origin {
                Origin::Unit => "< ",
                Origin::Us => "> ",
                Origin::Console => "- ",
            };
            self.scrollback.lines().map(|line| format!("{}{}", mark(line), line.text)).collect()
        }
    }

    #[test]
    fn any_line_end_ends_a_line_once_and_any_chunking_gives_the_same() {
        let bytes = b"one\r\ntwo\rthree\nfour\r\x13\n\r\nfive";
        let whole = Talk::new().unit(bytes).text();
        assert_eq!(whole, ["< one", "< two", "< three", "< four", "< ", "< five"]);
        let mut talk = Talk::new();
        bytes.iter().for_each(|&byte| {
            talk.unit(&[byte]);
        });
        assert_eq!(talk.text(), whole);
    }

    #[test]
    fn an_echo_does_not_tear_a_typed_word_apart() {
        let mut talk = Talk::new();
        talk.unit(b"Restore defaults? ");
        for key in [b"Y", b"e", b"s"] {
            talk.us(key).unit(key);
        }
        talk.us(b"\r").unit(b"\r\nDone.\r\n").us(b"m");
        assert_eq!(talk.text(), ["< Restore defaults? Yes", "> Yes^M", "< Done.", "> m"]);
    }

    #[test]
    fn every_byte_leaves_a_visible_trace_and_none_a_control_code() {
        let mut talk = Talk::new();
        talk.unit(b"\x1b[2J\x07 \x9b a\tb \xe2\x80\xa6\x08 \xe2\r\n");
        assert_eq!(talk.text(), ["< ^[[2J^G ‹9b› a  b …^H ‹e2›"]);
        for byte in (0..=255u8).filter(|byte| !b"\r\n\x11\x13".contains(byte)) {
            let mut talk = Talk::new();
            talk.unit(&[byte, b'\r']);
            let text = talk.text().concat();
            assert!(text.chars().count() > 2 && !text.chars().any(char::is_control), "{byte:#04x}: {text:?}");
        }
    }

    #[test]
    fn memory_is_bounded_in_both_directions_of_growth() {
        let mut talk = Talk::new();
        talk.unit(&vec![b'x'; LONGEST_LINE * 3]);
        assert_eq!(talk.text().len(), 3);
        talk.unit(&b"\r".repeat(KEPT_LINES + 5));
        assert_eq!(talk.scrollback.lines().len(), KEPT_LINES);
        assert_eq!(talk.scrollback.end() - talk.scrollback.start(), KEPT_LINES as u64);
    }

    #[test]
    fn a_new_connection_starts_a_new_record_below_the_old_lines() {
        let mut talk = Talk::new();
        talk.unit(b"half a li");
        talk.scrollback.begin(Instant::from_millis(99), "connected".into());
        talk.record = Record::new();
        talk.unit(b"hello\r\n");
        assert_eq!(talk.text(), ["< half a li", "- connected", "< hello"]);
    }
}
