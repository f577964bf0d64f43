//! Bytes of a device as text that is safe on a terminal, with nothing lost from sight.
//!
//! A unit (or whatever answers on a wrong port) may send any byte, and a terminal obeys many of them: colours, titles,
//! answers typed into the shell. What is shown therefore goes through here. Printable text stays, valid UTF-8
//! included; everything else becomes a visible sign: `^X` for control characters, `‹9b›` for bytes and characters
//! that have no picture of their own or change the direction or place of others.

use std::fmt::Write;

/// Which control characters keep their meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Controls {
    /// None: the text stays on one line, for reports and tables.
    Shown,
    /// CR, LF, BS and TAB act, for a plain terminal. The rest is shown.
    Layout,
}

/// Most characters that are quoted of what a unit has said.
const QUOTED: usize = 160;

/// What a unit has said, for a sentence: on one line, every control character shown, and no longer than can be read.
pub fn quoted(said: &str) -> String {
    line(said.trim().as_bytes()).chars().take(QUOTED).collect()
}

/// A complete text on one line, every control character shown.
pub fn line(bytes: &[u8]) -> String {
    let mut visible = Visible::new(Controls::Shown);
    let mut text = String::with_capacity(bytes.len());
    visible.push(bytes, &mut text);
    visible.finish(&mut text);
    text
}

/// One column for one byte, for the text column of a hex view.
pub fn column(byte: u8) -> char {
    match byte {
        b' '..=b'~' => char::from(byte),
        _ => '.',
    }
}

/// Makes a stream of bytes visible, wherever it is cut into pieces.
#[derive(Clone, Debug)]
pub struct Visible {
    controls: Controls,
    /// The beginning of a UTF-8 character whose end has not come yet: at most three bytes.
    begun: Vec<u8>,
}

impl Visible {
    /// A stream from its beginning.
    pub fn new(controls: Controls) -> Self {
        Visible { controls, begun: Vec::new() }
    }

    /// Appends what `bytes` look like to `text`. The beginning of a character is kept back until its end comes.
    pub fn push(&mut self, bytes: &[u8], text: &mut String) {
        let mut rest = bytes;
        // Printable ASCII is most of what comes, and goes through as it is.
        if self.begun.is_empty() {
            let plain = bytes.iter().position(|byte| !matches!(byte, b' '..=b'~')).unwrap_or(bytes.len());
            let (run, behind) = bytes.split_at(plain);
            text.push_str(std::str::from_utf8(run).unwrap_or_default());
            rest = behind;
        }
        if !rest.is_empty() {
            self.push_mixed(rest, text);
        }
    }

    fn push_mixed(&mut self, bytes: &[u8], text: &mut String) {
        let joined;
        let bytes = if self.begun.is_empty() {
            bytes
        } else {
            joined = [std::mem::take(&mut self.begun).as_slice(), bytes].concat();
            &joined
        };
        let mut chunks = bytes.utf8_chunks().peekable();
        while let Some(chunk) = chunks.next() {
            chunk.valid().chars().for_each(|character| self.show(character, text));
            let broken = chunk.invalid();
            if chunks.peek().is_none() && may_go_on(broken) {
                self.begun = broken.to_vec();
            } else {
                show_bytes(broken, text);
            }
        }
    }

    /// Shows what was kept back: no more bytes will come soon.
    pub fn finish(&mut self, text: &mut String) {
        show_bytes(&std::mem::take(&mut self.begun), text);
    }

    /// Whether the beginning of a character is kept back.
    pub fn keeps_back(&self) -> bool {
        !self.begun.is_empty()
    }

    fn show(&self, character: char, text: &mut String) {
        match character {
            ' '..='~' => text.push(character),
            '\r' | '\n' | '\t' | '\x08' if self.controls == Controls::Layout => text.push(character),
            '\0'..='\x1f' | '\x7f' => {
                text.push('^');
                text.push(char::from(character as u8 ^ 0x40));
            }
            _ if is_unsafe(character) => {
                let _ = write!(text, "‹{:02x}›", u32::from(character));
            }
            _ => text.push(character),
        }
    }
}

/// Bytes as `‹9b›`. Formatted by hand for speed, since a flood on a wrong line rate goes through here.
fn show_bytes(bytes: &[u8], text: &mut String) {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    for &byte in bytes {
        text.push('‹');
        text.push(char::from(DIGITS[usize::from(byte >> 4)]));
        text.push(char::from(DIGITS[usize::from(byte & 0xF)]));
        text.push('›');
    }
}

/// Whether these bytes, found at the end of what has come, can still become a UTF-8 character.
fn may_go_on(bytes: &[u8]) -> bool {
    // `utf8_chunks` cuts at the longest prefix that is still sound, so only the length is left to compare.
    let length = match bytes.first() {
        Some(0xC2..=0xDF) => 2,
        Some(0xE0..=0xEF) => 3,
        Some(0xF0..=0xF4) => 4,
        _ => return false,
    };
    bytes.len() < length
}

/// C1 controls, which some terminals obey, and characters without width or with power over the direction of others
/// (Unicode 16, general categories Cc and the bidirectional and invisible ones of Cf, line separators, private use).
fn is_unsafe(character: char) -> bool {
    matches!(character,
        '\u{80}'..='\u{9f}'
        | '\u{ad}'
        | '\u{61c}'
        | '\u{180e}'
        | '\u{200b}'..='\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}'
        | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}'
        | '\u{e000}'..='\u{f8ff}'
        | '\u{e0000}'..='\u{10ffff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown_instead() {
        for (bytes, text) in [
            (&b"plain text"[..], "plain text"),
            (b"\x1b[2J\x1b]0;owned\x07", "^[[2J^[]0;owned^G"),
            (b"a\r\n\tb\x08", "a^M^J^Ib^H"),
            (b"\0\x7f", "^@^?"),
            (b"\x9b31m", "‹9b›31m"),
            ("\u{9b}31m".as_bytes(), "‹9b›31m"),
            ("program…".as_bytes(), "program…"),
            ("\u{202e}txt.exe".as_bytes(), "‹202e›txt.exe"),
            (b"\xff\xfe20 \xb0C", "‹ff›‹fe›20 ‹b0›C"),
            (b"cut \xe2\x80", "cut ‹e2›‹80›"),
        ] {
            assert_eq!(line(bytes), text, "{bytes:02x?}");
        }
    }

    #[test]
    fn layout_acts_on_a_terminal_and_nothing_else_does() {
        let mut visible = Visible::new(Controls::Layout);
        let mut text = String::new();
        visible.push(b"a\tb\x08\r\n\x0b\x1bc", &mut text);
        assert_eq!(text, "a\tb\x08\r\n^K^[c");
    }

    #[test]
    fn any_cutting_gives_the_same_text() {
        let bytes = "é…\u{1f321}\u{85}x".bytes().chain(*b"\xf0\x9f\xe2\x80\xa6\xc3").collect::<Vec<u8>>();
        let whole = line(&bytes);
        for size in 1..=bytes.len() {
            let mut visible = Visible::new(Controls::Shown);
            let mut text = String::new();
            bytes.chunks(size).for_each(|piece| visible.push(piece, &mut text));
            assert!(visible.keeps_back());
            visible.finish(&mut text);
            assert_eq!(text, whole, "in pieces of {size}");
        }
    }

    #[test]
    fn no_control_character_ever_comes_out() {
        for first in 0..=255u8 {
            for second in 0..=255u8 {
                let text = line(&[0xE2, first, second, b'.']);
                assert!(!text.chars().any(char::is_control), "{first:02x} {second:02x}: {text:?}");
            }
        }
    }
}
