//! What a plain terminal shows of the bytes that come: text made safe, hexadecimal rows, or the bytes themselves.

use std::fmt::Write as _;

use crate::record::Direction;
use crate::time::Instant;
use crate::wire::visible::{self, Controls, Visible};
use crate::wire::{XOFF, XON};

/// How it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// As text. Line ends, tabs and backspaces act, all other control characters are shown.
    Text,
    /// As rows of hexadecimal digits, both directions.
    Hex,
    /// As they are: the user's terminal obeys whatever comes.
    Raw,
}

/// What ends a line of what comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LineEnd {
    /// CR, LF, CR LF or LF CR, whichever comes.
    Auto,
    /// CR; LF is shown.
    Cr,
    /// LF; CR is left out.
    Lf,
    /// Only what the terminal itself makes of CR and LF.
    Keep,
}

/// Makes what is shown of what comes, wherever it is cut into pieces.
pub struct Shown {
    look: Look,
    times: bool,
    ends: LineEnd,
    /// What a new line is on the way out.
    new_line: &'static str,
    visible: Visible,
    /// The last byte, if it ended a line. The other byte of a CR LF or LF CR that follows it ends no second line.
    ended_by: Option<u8>,
    at_start: bool,
    row: Row,
}

/// A row of hexadecimal digits under construction.
#[derive(Default)]
struct Row {
    direction: Option<Direction>,
    at: Instant,
    start: u64,
    bytes: Vec<u8>,
    received: u64,
    sent: u64,
}

/// Bytes of a row.
const ROW: usize = 16;

impl Shown {
    /// Shows nothing yet. `on_terminal`: the other side is a terminal in raw mode, where a line feed only goes down.
    pub fn new(look: Look, times: bool, ends: LineEnd, on_terminal: bool) -> Self {
        Shown {
            look,
            times,
            ends,
            new_line: if on_terminal { "\r\n" } else { "\n" },
            visible: Visible::new(Controls::Layout),
            ended_by: None,
            at_start: true,
            row: Row::default(),
        }
    }

    /// Takes bytes and appends what they look like. `time_of` names a moment for the reader.
    pub fn push(
        &mut self,
        at: Instant,
        direction: Direction,
        bytes: &[u8],
        time_of: impl Fn(Instant) -> String,
        out: &mut Vec<u8>,
    ) {
        match self.look {
            Look::Raw => out.extend_from_slice(bytes),
            Look::Text => self.text(at, bytes, time_of, out),
            Look::Hex => {
                for &byte in bytes {
                    if self.row.direction != Some(direction) || self.row.bytes.len() == ROW {
                        self.end_row(&time_of, out);
                    }
                    // Also a row that was shown at the end of a chunk or in a pause is over: the next begins here.
                    if self.row.bytes.is_empty() {
                        self.row.direction = Some(direction);
                        self.row.at = at;
                        self.row.start = self.row.count(direction);
                    }
                    self.row.bytes.push(byte);
                    *self.row.counter(direction) += 1;
                }
                if self.row.bytes.len() == ROW {
                    self.end_row(&time_of, out);
                }
            }
        }
    }

    /// Shows what was kept back: no more bytes will come soon.
    pub fn finish(&mut self, time_of: impl Fn(Instant) -> String, out: &mut Vec<u8>) {
        self.end_row(&time_of, out);
        let mut text = String::new();
        self.visible.finish(&mut text);
        out.extend_from_slice(text.as_bytes());
    }

    /// Whether something is kept back.
    pub fn keeps_back(&self) -> bool {
        self.visible.keeps_back() || !self.row.bytes.is_empty()
    }

    /// A line of the program's own is about to be written: begins a new one if the present one is not empty.
    pub fn break_line(&mut self, time_of: impl Fn(Instant) -> String, out: &mut Vec<u8>) {
        self.finish(time_of, out);
        if !self.at_start {
            out.extend_from_slice(self.new_line.as_bytes());
            self.at_start = true;
        }
    }

    /// Shows in another way from here on.
    pub fn set_look(&mut self, look: Look) {
        self.look = look;
    }

    /// How it is shown.
    pub fn look(&self) -> Look {
        self.look
    }

    /// Puts the time before each line, or no longer; says which.
    pub fn toggle_times(&mut self) -> bool {
        self.times = !self.times;
        self.times
    }

    fn text(&mut self, at: Instant, bytes: &[u8], time_of: impl Fn(Instant) -> String, out: &mut Vec<u8>) {
        let mut text = String::with_capacity(bytes.len() + 16);
        let mut rest = bytes;
        while let Some(&first) = rest.first() {
            let plain = rest.iter().position(|byte| matches!(*byte, b'\r' | b'\n' | XON | XOFF)).unwrap_or(rest.len());
            if plain > 0 {
                if std::mem::take(&mut self.at_start) && self.times {
                    let _ = write!(text, "[{}] ", time_of(at));
                }
                self.ended_by = None;
                self.visible.push(&rest[..plain], &mut text);
                rest = &rest[plain..];
                continue;
            }
            rest = &rest[1..];
            if matches!(first, XON | XOFF) {
                continue;
            }
            self.visible.finish(&mut text);
            self.line_end(first, &mut text);
        }
        out.extend_from_slice(text.as_bytes());
    }

    fn line_end(&mut self, byte: u8, text: &mut String) {
        let is_partner = self.ended_by.is_some_and(|other| other != byte);
        let ends = match self.ends {
            LineEnd::Keep => {
                text.push(char::from(byte));
                self.at_start = byte == b'\n';
                return;
            }
            LineEnd::Auto if is_partner => {
                self.ended_by = None;
                return;
            }
            LineEnd::Auto => true,
            LineEnd::Cr => byte == b'\r',
            LineEnd::Lf => byte == b'\n',
        };
        self.ended_by = Some(byte);
        if ends {
            text.push_str(self.new_line);
            self.at_start = true;
        } else if self.ends == LineEnd::Cr {
            text.push_str("^J");
        }
    }

    fn end_row(&mut self, time_of: &impl Fn(Instant) -> String, out: &mut Vec<u8>) {
        let Some(direction) = self.row.direction.filter(|_| !self.row.bytes.is_empty()) else { return };
        let mut text = String::new();
        if self.times {
            let _ = write!(text, "[{}] ", time_of(self.row.at));
        }
        let mark = match direction {
            Direction::FromUnit => '<',
            Direction::ToUnit => '>',
        };
        let _ = write!(text, "{mark} {:08x} ", self.row.start);
        for place in 0..ROW {
            match self.row.bytes.get(place) {
                Some(byte) => {
                    let _ = write!(text, " {byte:02x}");
                }
                None => text.push_str("   "),
            }
        }
        text.push_str("  ");
        text.extend(self.row.bytes.iter().map(|&byte| visible::column(byte)));
        text.push_str(self.new_line);
        out.extend_from_slice(text.as_bytes());
        self.row.bytes.clear();
        self.at_start = true;
    }
}

impl Row {
    fn count(&self, direction: Direction) -> u64 {
        match direction {
            Direction::FromUnit => self.received,
            Direction::ToUnit => self.sent,
        }
    }

    fn counter(&mut self, direction: Direction) -> &mut u64 {
        match direction {
            Direction::FromUnit => &mut self.received,
            Direction::ToUnit => &mut self.sent,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Instant = Instant::from_millis(1500);

    fn time_of(at: Instant) -> String {
        format!("{}", at.since_start().as_millis())
    }

    fn shown(mut shown: Shown, chunks: &[&[u8]]) -> String {
        let mut out = Vec::new();
        for chunk in chunks {
            shown.push(T, Direction::FromUnit, chunk, time_of, &mut out);
        }
        shown.finish(time_of, &mut out);
        String::from_utf8(out).expect("UTF-8")
    }

    fn text(ends: LineEnd, chunks: &[&[u8]]) -> String {
        shown(Shown::new(Look::Text, false, ends, false), chunks)
    }

    #[test]
    fn each_kind_of_line_end_is_one_new_line_wherever_it_is_cut() {
        for end in ["\r", "\n", "\r\n", "\n\r"] {
            let bytes = format!("a{end}b{end}{end}c");
            assert_eq!(text(LineEnd::Auto, &[bytes.as_bytes()]), "a\nb\n\nc", "{end:?}");
            let pieces: Vec<&[u8]> = bytes.as_bytes().chunks(1).collect();
            assert_eq!(text(LineEnd::Auto, &pieces), "a\nb\n\nc", "{end:?} in pieces");
        }
        assert_eq!(text(LineEnd::Lf, &[b"a\r\nb\r"]), "a\nb");
        assert_eq!(text(LineEnd::Cr, &[b"a\rb\nc"]), "a\nb^Jc");
        assert_eq!(text(LineEnd::Keep, &[b"a\rb\r\n"]), "a\rb\r\n");
    }

    #[test]
    fn nothing_a_terminal_would_obey_comes_out_of_text_and_everything_out_of_raw() {
        let hostile = b"\x1b]52;c;AAAA\x07\x11\x9b2J\x00\xff\xe2\x80\xaeok";
        assert_eq!(text(LineEnd::Auto, &[hostile]), "^[]52;c;AAAA^G‹9b›2J^@‹ff›‹202e›ok");
        let mut out = Vec::new();
        Shown::new(Look::Raw, false, LineEnd::Auto, true).push(T, Direction::FromUnit, hostile, time_of, &mut out);
        assert_eq!(out, hostile);
    }

    #[test]
    fn times_stand_before_lines_that_have_begun() {
        let said = shown(Shown::new(Look::Text, true, LineEnd::Auto, false), &[b"a\r", b"\nb", b"c\r\n"]);
        assert_eq!(said, "[1500] a\n[1500] bc\n");
    }

    #[test]
    fn hexadecimal_rows_show_both_directions_and_offsets() {
        let mut shown = Shown::new(Look::Hex, false, LineEnd::Auto, false);
        let mut out = Vec::new();
        shown.push(T, Direction::FromUnit, b"0123456789", time_of, &mut out);
        shown.push(T, Direction::FromUnit, b"abcdef\x13", time_of, &mut out);
        shown.push(T, Direction::ToUnit, b"m", time_of, &mut out);
        shown.break_line(time_of, &mut out);
        let text = String::from_utf8(out).expect("UTF-8");
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows[0], "< 00000000  30 31 32 33 34 35 36 37 38 39 61 62 63 64 65 66  0123456789abcdef");
        assert!(rows[1].starts_with("< 00000010  13   ") && rows[2].starts_with("> 00000000  6d   "), "{text}");
    }

    #[test]
    fn the_offset_of_a_row_holds_wherever_the_bytes_are_cut_and_shown() {
        for size in [1, 7, 16, 32, 48] {
            let mut shown = Shown::new(Look::Hex, false, LineEnd::Auto, false);
            let mut out = Vec::new();
            for chunk in [b'x'; 160].chunks(size) {
                shown.push(T, Direction::FromUnit, chunk, time_of, &mut out);
            }
            shown.finish(time_of, &mut out);
            let text = String::from_utf8(out).expect("UTF-8");
            let starts: Vec<String> = text.lines().map(|row| row[2..10].to_owned()).collect();
            let wanted: Vec<String> = (0..10).map(|row| format!("{:08x}", row * 16)).collect();
            assert_eq!(starts, wanted, "chunks of {size}");
        }
        let mut shown = Shown::new(Look::Hex, false, LineEnd::Auto, false);
        let mut out = Vec::new();
        for (direction, bytes) in [
            (Direction::ToUnit, &b"m"[..]),
            (Direction::FromUnit, &[b'x'; 32]),
            (Direction::ToUnit, b"s"),
            (Direction::FromUnit, b"12345"),
        ] {
            shown.push(T, direction, bytes, time_of, &mut out);
        }
        shown.finish(time_of, &mut out);
        shown.push(T, Direction::FromUnit, b"6", time_of, &mut out);
        shown.finish(time_of, &mut out);
        let text = String::from_utf8(out).expect("UTF-8");
        let starts: Vec<&str> = text.lines().map(|row| &row[..10]).collect();
        assert_eq!(
            starts,
            ["> 00000000", "< 00000000", "< 00000010", "> 00000001", "< 00000020", "< 00000025"],
            "{text}"
        );
    }
}
