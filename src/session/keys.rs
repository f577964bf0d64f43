//! What is sent to a unit, as its keys: the letters its menu takes, in either case and without Enter (AXTC4CO manual,
//! section 4.1), told from those of an answer or of a file.

use crate::wire::MenuKey;

/// Bytes of a piece that somebody may have typed: anything longer is a record of a file, and its letters are no keys.
pub(super) const LONGEST_TYPED: usize = 16;

/// One key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// One of the main menu.
    Menu(MenuKey),
    /// X leaves the view, behind which the menu is printed.
    Leave,
    /// Enter: the end of an answer, and in the view the next object.
    Enter,
    /// Means nothing to the menu, or stands in an answer.
    Other,
}

/// What has been sent in one piece.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Typed {
    /// Keys.
    Keys(Vec<Key>),
    /// A part of a file.
    File,
}

impl Typed {
    /// The keys; none for a part of a file.
    pub(super) fn keys(&self) -> &[Key] {
        match self {
            Typed::Keys(keys) => keys,
            Typed::File => &[],
        }
    }

    /// Whether the menu is printed for one of them.
    pub(super) fn asks_menu(&self) -> bool {
        self.keys().iter().any(|key| matches!(key, Key::Menu(MenuKey::Menu) | Key::Leave))
    }
}

/// Reads what is sent.
#[derive(Debug, Default)]
pub(super) struct KeyReader {
    /// The key, D or L, behind which what is typed is an answer: the `s` of `Yes` is no key.
    question: Option<MenuKey>,
}

impl KeyReader {
    /// These bytes have been sent, none of them secret.
    pub(super) fn read(&mut self, bytes: &[u8]) -> Typed {
        if bytes.len() > LONGEST_TYPED {
            return Typed::File;
        }
        Typed::Keys(bytes.iter().map(|&byte| self.key(byte)).collect())
    }

    fn key(&mut self, byte: u8) -> Key {
        const ESCAPE: u8 = 0x1B;
        let key = match byte.to_ascii_lowercase() {
            b'\r' => Key::Enter,
            _ if self.question.is_some() && byte != ESCAPE => return Key::Other,
            b'm' => Key::Menu(MenuKey::Menu),
            b'v' => Key::Menu(MenuKey::View),
            b'd' => Key::Menu(MenuKey::Default),
            b't' => Key::Menu(MenuKey::Stream),
            b's' => Key::Menu(MenuKey::Diagnostics),
            b'l' => Key::Menu(MenuKey::Load),
            b'x' => Key::Leave,
            _ => Key::Other,
        };
        self.question = match key {
            Key::Menu(key @ (MenuKey::Default | MenuKey::Load)) => Some(key),
            _ => None,
        };
        key
    }

    /// The unit has shown its menu, or has started anew: no question is open any more, whatever would have ended it.
    pub(super) fn question_over(&mut self) {
        self.question = None;
    }

    /// The key whose question is being answered.
    pub(super) fn question(&self) -> Option<MenuKey> {
        self.question
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEFAULT: Key = Key::Menu(MenuKey::Default);
    const DIAGNOSTICS: Key = Key::Menu(MenuKey::Diagnostics);

    #[test]
    fn letters_of_an_answer_are_no_keys_up_to_its_end() {
        let mut reader = KeyReader::default();
        let mut read = |bytes: &[u8]| reader.read(bytes).keys().to_vec();
        assert_eq!(read(b"sS1"), [DIAGNOSTICS, DIAGNOSTICS, Key::Other]);
        assert_eq!(read(b"dYes"), [DEFAULT, Key::Other, Key::Other, Key::Other]);
        assert_eq!(read(b"s\rs"), [Key::Other, Key::Enter, DIAGNOSTICS]);
        assert_eq!(read(b"lm\x1Bx"), [Key::Menu(MenuKey::Load), Key::Other, Key::Other, Key::Leave]);
        assert_eq!(read(b"tfm"), [Key::Menu(MenuKey::Stream), Key::Other, Key::Menu(MenuKey::Menu)]);
    }

    #[test]
    fn a_question_that_is_answered_without_enter_ends_with_the_menu() {
        let mut reader = KeyReader::default();
        reader.read(b"dy");
        assert_eq!(reader.question(), Some(MenuKey::Default));
        reader.question_over();
        assert_eq!(reader.question(), None);
        assert!(reader.read(b"m").asks_menu());
    }

    #[test]
    fn letters_of_a_file_are_no_keys_and_open_no_question() {
        let mut reader = KeyReader::default();
        assert_eq!(reader.read(b"S30D00000000DEADBEEF"), Typed::File);
        assert_eq!(reader.read(b"s"), Typed::Keys(vec![DIAGNOSTICS]));
    }
}
