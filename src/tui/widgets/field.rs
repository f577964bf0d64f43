//! Text fields: one for plain text, one for the password.

use zeroize::{Zeroize, Zeroizing};

use crate::secret::Secret;

/// Characters a plain field takes: a long path.
const LONGEST_TEXT: usize = 1024;
/// Characters a password takes; also the capacity reserved, so that no copy is left behind by growing.
const LONGEST_PASSWORD: usize = 64;

/// One line of text, typed at its end.
#[derive(Clone, Debug, Default)]
pub struct TextField {
    text: String,
}

impl TextField {
    /// A field with a text in it.
    pub fn new(text: impl Into<String>) -> Self {
        TextField { text: text.into() }
    }

    /// What is in it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds a character, unless it is a control character or the field is full.
    pub fn push(&mut self, character: char) {
        if !character.is_control() && self.text.chars().count() < LONGEST_TEXT {
            self.text.push(character);
        }
    }

    /// Takes the last character away.
    pub fn pop(&mut self) {
        self.text.pop();
    }

    /// Takes everything away.
    pub fn clear(&mut self) {
        self.text.clear();
    }
}

/// A password being typed: shown as dots, wiped when it goes.
#[derive(Default)]
pub struct PasswordField {
    typed: Zeroizing<Vec<u8>>,
}

impl PasswordField {
    /// An empty field.
    pub fn new() -> Self {
        PasswordField { typed: Zeroizing::new(Vec::with_capacity(LONGEST_PASSWORD)) }
    }

    /// Adds a character, unless it is a control character or the field is full.
    pub fn push(&mut self, character: char) {
        let mut bytes = [0; 4];
        let encoded = character.encode_utf8(&mut bytes).len();
        if !character.is_control() && self.typed.len() + encoded <= LONGEST_PASSWORD {
            self.typed.extend_from_slice(&bytes[..encoded]);
        }
        bytes.zeroize();
    }

    /// Takes the last character away.
    pub fn pop(&mut self) {
        while let Some(byte) = self.typed.pop() {
            // The first byte of a UTF-8 character is never 10xxxxxx.
            if byte & 0xC0 != 0x80 {
                break;
            }
        }
    }

    /// Takes everything away.
    pub fn clear(&mut self) {
        self.typed.zeroize();
        self.typed.reserve(LONGEST_PASSWORD);
    }

    /// Whether nothing has been typed.
    pub fn is_empty(&self) -> bool {
        self.typed.is_empty()
    }

    /// One dot for each character.
    pub fn dots(&self) -> String {
        "•".repeat(self.typed.iter().filter(|&byte| byte & 0xC0 != 0x80).count())
    }

    /// The password, ready to be sent.
    pub fn secret(&self) -> Secret {
        Secret::new(self.typed.to_vec())
    }
}

impl std::fmt::Debug for PasswordField {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("PasswordField(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_shows_dots_and_nothing_else() {
        let mut field = PasswordField::new();
        "Aé1\n".chars().for_each(|character| field.push(character));
        assert_eq!(field.dots(), "•••");
        assert_eq!(format!("{field:?}"), "PasswordField(..)");
        field.pop();
        field.pop();
        assert_eq!(field.secret().reveal(), b"A");
        field.clear();
        assert!(field.is_empty());
    }

    #[test]
    fn fields_are_bounded_and_take_no_control_characters() {
        let (mut text, mut password) = (TextField::default(), PasswordField::new());
        for _ in 0..2000 {
            text.push('x');
            password.push('x');
        }
        text.push('\x1b');
        assert_eq!(text.text().len(), LONGEST_TEXT);
        assert_eq!(password.secret().reveal().len(), LONGEST_PASSWORD);
    }
}
