//! Bytes and foreign texts made fit for the screen.
//!
//! No control code of a device reaches the user's terminal. It is not dropped either, since it may be the evidence one
//! is looking for: it becomes a visible sign of one column.

/// Columns between two tab stops.
const TAB: usize = 8;

/// Appends one byte from the line to `text`, a line under construction. A tab goes to the next stop.
///
/// Units print ASCII. Every other byte is shown by its number, since nobody knows which character set was meant.
pub fn push_byte(text: &mut String, byte: u8) {
    match byte {
        b'\t' => {
            let column = text.chars().count();
            text.extend(std::iter::repeat_n(' ', TAB - column % TAB));
        }
        b' '..=b'~' => text.push(char::from(byte)),
        _ => match sign(byte) {
            Some(sign) => text.push(sign),
            None => text.push_str(&format!("\\x{byte:02X}")),
        },
    }
}

/// One column for one byte, for the text column of a hex view.
pub fn column(byte: u8) -> char {
    match byte {
        b' '..=b'~' => char::from(byte),
        _ => sign(byte).unwrap_or('.'),
    }
}

/// A text from outside (a file name, an error of the system, something a unit said) without anything that moves the
/// cursor, turns the direction of writing or has no width.
pub fn text(foreign: &str) -> String {
    let mut shown = String::with_capacity(foreign.len());
    for character in foreign.chars() {
        match character {
            '\t' => shown.push(' '),
            '\0'..='\x1f' | '\x7f' => shown.extend(sign(character as u8)),
            '\u{80}'..='\u{9f}'
            | '\u{ad}'
            | '\u{61c}'
            | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}' => shown.push('\u{fffd}'),
            _ => shown.push(character),
        }
    }
    shown
}

/// The same, beginning with a capital: errors of the system begin in lower case, since they follow other words.
pub fn sentence(foreign: &str) -> String {
    let text = text(foreign);
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => text,
    }
}

/// Unicode has a picture for each control character.
fn sign(byte: u8) -> Option<char> {
    match byte {
        0..=0x1f => char::from_u32(0x2400 + u32::from(byte)),
        0x7f => Some('\u{2421}'),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(bytes: &[u8]) -> String {
        let mut text = String::new();
        bytes.iter().for_each(|&byte| push_byte(&mut text, byte));
        text
    }

    #[test]
    fn every_byte_leaves_a_visible_trace_and_none_a_control_code() {
        for byte in 0..=255 {
            let shown = line(&[byte]);
            assert!(!shown.is_empty(), "{byte:#04x}");
            assert!(!shown.chars().any(char::is_control), "{byte:#04x}");
            assert!(!column(byte).is_control(), "{byte:#04x}");
        }
        assert_eq!(line(b"\x1b[2J\x07"), "␛[2J␇");
        assert_eq!(line(b"\x9b31m\xff"), "\\x9B31m\\xFF");
    }

    #[test]
    fn tabs_go_to_the_next_stop() {
        assert_eq!(line(b"a\tb"), "a       b");
        assert_eq!(line(b"12345678\tb"), "12345678        b");
    }

    #[test]
    fn foreign_texts_keep_their_letters_and_lose_their_tricks() {
        assert_eq!(text("Höytämöntie 6"), "Höytämöntie 6");
        assert_eq!(text("a\x1b[31m\u{9b}1m\u{202e}b\u{200b}\n"), "a␛[31m\u{fffd}1m\u{fffd}b\u{fffd}␊");
    }
}
