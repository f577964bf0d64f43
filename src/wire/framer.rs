//! Chunks of bytes to lines.
//!
//! A chunk may end anywhere. Lines end with CR, LF, CR LF or LF CR, or where the cursor is moved; Xon and Xoff are
//! lifted out, since they control the line and are not part of its text; colours and other escape sequences are left
//! out of the text, unless a line end cuts them off. Every byte belongs to the span of what it is part of: the framer
//! copies, it never takes away.
//!
//! What has no line end yet is the [`Framer::pending`] text. Whether that is a prompt depends on time, and is decided
//! by the session.

use crate::record::{Span, XOFF, XON};

/// Most bytes of a line. Longer ones are cut into pieces, so that a device without line ends cannot make us keep
/// everything; the longest row of any product has 55.
pub const LONGEST_LINE: usize = 1024;

/// Most bytes of an escape sequence; what goes on longer is taken as text.
const LONGEST_ESCAPE: usize = 64;

const ESC: u8 = 0x1B;

/// What a chunk held.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// A line that is not blank, without its end.
    Line(Text),
    /// The unit stops us (`true`) or lets us go on.
    Hold(bool),
}

/// Text and where it lies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Text {
    /// Where, line end excluded.
    pub span: Span,
    /// Printable characters; damage (not UTF-8, or a control character) shows as U+FFFD.
    pub text: String,
}

/// Makes lines of chunks.
#[derive(Debug, Default)]
pub struct Framer {
    /// Bytes of the current line. Those of a string in an escape sequence are at its end until the string is complete:
    /// if it never is, they are text.
    line: Vec<u8>,
    /// Where the current line began.
    start: u64,
    /// Bytes seen so far.
    offset: u64,
    escape: Escape,
}

/// Where in an escape sequence the stream is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    /// After ESC.
    Begun,
    /// Within `ESC [ ...`, this many bytes long.
    Control(usize),
    /// Within `ESC ] ...` and the like, which end with BEL or ESC \, this many bytes long.
    String(usize),
    /// After an ESC within such a string.
    StringEnd(usize),
}

impl Framer {
    /// Takes the next bytes and hands out what they complete.
    pub fn push(&mut self, bytes: &[u8], mut out: impl FnMut(Item)) {
        let mut rest = bytes;
        while let Some(&byte) = rest.first() {
            let run = self.plain_run(rest);
            if run > 0 {
                self.text_run(&rest[..run], &mut out);
                rest = &rest[run..];
                continue;
            }
            rest = &rest[1..];
            let at = self.offset;
            self.offset += 1;
            if byte == XON || byte == XOFF {
                out(Item::Hold(byte == XOFF));
            } else if self.in_escape(byte) {
                self.escape_byte(at, byte, &mut out);
            } else {
                self.escape = Escape::None;
                self.text_byte(at, byte, &mut out);
            }
        }
    }

    /// Ends the current line here, without a line end: what comes next answers something we have sent, and is not
    /// part of the prompt before it.
    pub fn cut(&mut self, mut out: impl FnMut(Item)) {
        self.end_line(self.offset, &mut out);
    }

    /// Text since the last line end, if it is not blank.
    pub fn pending(&self) -> Option<Text> {
        let shown = self.line.len().saturating_sub(self.escape.string_length());
        let text = clean(&self.line[..shown]);
        (!text.trim().is_empty()).then_some(Text { span: Span { start: self.start, end: self.offset }, text })
    }

    /// Bytes at the beginning that are text and nothing else, as many as the line has room for.
    fn plain_run(&self, bytes: &[u8]) -> usize {
        if self.escape != Escape::None {
            return 0;
        }
        let room = LONGEST_LINE.saturating_sub(self.line.len());
        let bytes = &bytes[..bytes.len().min(room)];
        bytes.iter().position(|&byte| byte < b' ' || byte == 0x7F).unwrap_or(bytes.len())
    }

    fn text_run(&mut self, run: &[u8], out: &mut impl FnMut(Item)) {
        if self.line.is_empty() {
            self.start = self.offset;
        }
        self.offset += run.len() as u64;
        self.line.extend_from_slice(run);
        if self.line.len() >= LONGEST_LINE {
            self.end_line(self.offset, out);
        }
    }

    /// Whether a byte is part of an escape sequence. A line end never is: noise may have turned another byte into an
    /// ESC, which would swallow the line end.
    fn in_escape(&self, byte: u8) -> bool {
        byte == ESC || (self.escape != Escape::None && !matches!(byte, b'\r' | b'\n'))
    }

    fn escape_byte(&mut self, at: u64, byte: u8, out: &mut impl FnMut(Item)) {
        if moves_cursor(self.escape, byte) {
            self.end_line(at, out);
        }
        let before = self.escape;
        self.escape = before.after(byte);
        match (before, self.escape) {
            _ if before.ends_string(byte) => {
                self.line.truncate(self.line.len().saturating_sub(before.string_length()));
            }
            (Escape::String(_), Escape::String(_)) => {
                if self.line.is_empty() {
                    self.start = at;
                }
                self.line.push(byte);
            }
            // The string goes on for too long.
            (Escape::String(_), Escape::None) => self.text_byte(at, byte, out),
            _ => {}
        }
    }

    fn text_byte(&mut self, at: u64, byte: u8, out: &mut impl FnMut(Item)) {
        match byte {
            b'\r' | b'\n' => self.end_line(at, out),
            // Erases what was typed before it, in the text as on the screen.
            0x08 | 0x7F => {
                self.line.pop();
            }
            _ => {
                if self.line.is_empty() {
                    self.start = at;
                }
                self.line.push(byte);
                if self.line.len() >= LONGEST_LINE {
                    self.end_line(at + 1, out);
                }
            }
        }
    }

    fn end_line(&mut self, end: u64, out: &mut impl FnMut(Item)) {
        if !self.line.iter().all(u8::is_ascii_whitespace) {
            let text = clean(&self.line);
            if !text.trim().is_empty() {
                out(Item::Line(Text { span: Span { start: self.start, end }, text }));
            }
        }
        self.line.clear();
        self.start = self.offset;
    }
}

impl Escape {
    /// The state after one more byte.
    fn after(self, byte: u8) -> Escape {
        match (self, byte) {
            (Escape::None, _) => Escape::Begun,
            (Escape::Begun, b'[') => Escape::Control(0),
            (Escape::Begun, b']' | b'P' | b'X' | b'^' | b'_') => Escape::String(0),
            (Escape::Begun, 0x20..=0x2F) => Escape::Begun,
            (Escape::Begun, _) => Escape::None,
            (Escape::Control(length), 0x20..=0x3F) if length < LONGEST_ESCAPE => Escape::Control(length + 1),
            (Escape::Control(_), _) => Escape::None,
            (Escape::String(_), 0x07) => Escape::None,
            (Escape::String(length), ESC) => Escape::StringEnd(length),
            (Escape::String(length), _) if length < LONGEST_ESCAPE => Escape::String(length + 1),
            // Another sequence begins in the middle of the string.
            (Escape::StringEnd(_), byte) if byte != b'\\' => Escape::Begun.after(byte),
            (Escape::String(_) | Escape::StringEnd(_), _) => Escape::None,
        }
    }

    /// Bytes of the string that has begun.
    fn string_length(self) -> usize {
        match self {
            Escape::String(length) | Escape::StringEnd(length) => length,
            Escape::None | Escape::Begun | Escape::Control(_) => 0,
        }
    }

    /// Whether this byte ends a string as it should.
    fn ends_string(self, byte: u8) -> bool {
        matches!((self, byte), (Escape::String(_), 0x07) | (Escape::StringEnd(_), b'\\'))
    }
}

/// Whether this byte completes a sequence that puts the cursor elsewhere, so that what follows is another line.
fn moves_cursor(escape: Escape, byte: u8) -> bool {
    matches!(
        (escape, byte),
        (Escape::Control(_), b'A'..=b'H' | b'f' | b'J' | b'd') | (Escape::Begun, b'c' | b'D' | b'E')
    )
}

/// Bytes as text: tabs as two blanks, since two separate columns; NUL and BEL, which old devices send between words,
/// left out; any other control character is damage, and shows as U+FFFD like what is not UTF-8.
fn clean(bytes: &[u8]) -> String {
    if bytes.iter().all(|byte| matches!(byte, b' '..=b'~')) {
        return String::from_utf8_lossy(bytes).into_owned();
    }
    let mut text = String::with_capacity(bytes.len());
    for c in String::from_utf8_lossy(bytes).chars() {
        match c {
            '\t' => text.push_str("  "),
            '\0' | '\u{7}' => {}
            c if c.is_control() => text.push(char::REPLACEMENT_CHARACTER),
            c => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(chunks: &[&[u8]]) -> (Vec<Item>, Option<Text>) {
        let mut framer = Framer::default();
        let mut items = Vec::new();
        for chunk in chunks {
            framer.push(chunk, |item| items.push(item));
        }
        (items, framer.pending())
    }

    fn lines(bytes: &[u8]) -> Vec<String> {
        let (items, _) = frame(&[bytes]);
        items
            .into_iter()
            .filter_map(|item| match item {
                Item::Line(text) => Some(text.text),
                Item::Hold(_) => None,
            })
            .collect()
    }

    #[test]
    fn all_four_line_ends_end_a_line() {
        assert_eq!(lines(b"a\rb\nc\r\nd\n\re\r\n\r\nf"), ["a", "b", "c", "d", "e"]);
    }

    #[test]
    fn a_span_holds_just_the_bytes_of_its_line() {
        let (items, pending) = frame(&[b"\r\nab\r\npass"]);
        assert_eq!(items, [Item::Line(Text { span: Span { start: 2, end: 4 }, text: "ab".into() })]);
        assert_eq!(pending, Some(Text { span: Span { start: 6, end: 10 }, text: "pass".into() }));
    }

    #[test]
    fn flow_control_is_lifted_out_of_the_line() {
        let (items, pending) = frame(&[b"..\x13.\x11."]);
        assert_eq!(items, [Item::Hold(true), Item::Hold(false)]);
        assert_eq!(pending.map(|text| text.text).as_deref(), Some("...."));
    }

    #[test]
    fn a_cut_parts_a_prompt_from_the_answer() {
        let mut framer = Framer::default();
        framer.push(b"> ", |item| panic!("{item:?}"));
        let mut items = Vec::new();
        framer.cut(|item| items.push(item));
        framer.push(b"Password? ", |item| panic!("{item:?}"));
        assert_eq!(items, [Item::Line(Text { span: Span { start: 0, end: 2 }, text: "> ".into() })]);
        assert_eq!(framer.pending().map(|text| (text.span.start, text.text)), Some((2, "Password? ".into())));
    }

    #[test]
    fn colours_vanish_and_cursor_moves_part_lines() {
        assert_eq!(lines(b"\x1b[1;32mAXTC4CO\x1b[0m V1.1.0\r\n"), ["AXTC4CO V1.1.0"]);
        assert_eq!(lines(b"6126\t1\t16.0\r\n"), ["6126  1  16.0"], "a tab parts columns");
        assert_eq!(lines(b"\x1b[2J\x1b[1;1HSupply 24.1\x1b[2;1HErrors 0\x1b[3;1H"), ["Supply 24.1", "Errors 0"]);
        assert_eq!(lines(b"\x1b]0;title\x07a\x1b]52;c;AAAA\x1b\\b\r\n"), ["ab"]);
    }

    #[test]
    fn an_escape_sequence_never_swallows_a_line_end() {
        for begun in ["\x1b", "\x1b(", "\x1b[", "\x1b[1;3", "\x1b]", "\x1bP"] {
            for end in ["\r", "\n", "\r\n"] {
                let text = format!("one{begun}{end}two{end}");
                assert_eq!(lines(text.as_bytes()), ["one", "two"], "{text:?}");
            }
        }
        // What was taken for a string is text: it may be all that a loader says.
        assert_eq!(lines(b"\x1bPError # 0004\rRestarting.\r"), ["Error # 0004", "Restarting."]);
        assert_eq!(lines(b"a\x1b]0;title\x1b[1mb\x1b]0;title\x07c\r"), ["a0;titlebc"]);
        let (items, pending) = frame(&[b"Password: \x1b]0;title"]);
        assert_eq!((items, pending.map(|text| text.text).as_deref()), (vec![], Some("Password: ")));
    }

    #[test]
    fn a_line_without_end_is_cut_and_a_string_without_end_given_up() {
        assert_eq!(lines(&[b'x'; LONGEST_LINE * 2 + 1]).len(), 2);
        let mut endless = b"\x1b]0;".to_vec();
        endless.extend([b'y'; 200]);
        endless.extend(b"\r\n");
        assert_eq!(lines(&endless).len(), 1);
        let long = [vec![b'x'; LONGEST_LINE - 1], endless].concat();
        assert_eq!(lines(&long).concat().len(), long.len() - 4, "all but the sequence's beginning and the line end");
    }

    proptest! {
        #[test]
        fn chunks_do_not_matter(bytes in prop::collection::vec(any::<u8>(), 0..400), cuts in prop::collection::vec(0usize..400, 0..8)) {
            let whole = frame(&[&bytes]);
            let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(bytes.len())).collect();
            cuts.extend([0, bytes.len()]);
            cuts.sort_unstable();
            let chunks: Vec<&[u8]> = cuts.windows(2).map(|pair| &bytes[pair[0]..pair[1]]).collect();
            prop_assert_eq!(frame(&chunks), whole);
        }

        #[test]
        fn spans_are_in_order_and_never_overlap(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let (items, pending) = frame(&[&bytes]);
            let mut end = 0;
            let texts = items.iter().filter_map(|item| match item { Item::Line(text) => Some(text), Item::Hold(_) => None });
            for text in texts.chain(pending.as_ref()) {
                prop_assert!(text.span.start >= end && text.span.end > text.span.start);
                prop_assert!(text.span.end <= bytes.len() as u64);
                end = text.span.end;
            }
        }
    }
}
