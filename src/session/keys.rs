//! What is sent to a unit, as its keys: the letters its menu takes, in either case and without Enter (AXTC4CO manual,
//! section 4.1), as opposed to those of an answer or of a file.

use crate::wire::MenuKey;

/// Most bytes of a piece that a user may have typed: a longer one is a record of a file, and its letters are not keys.
pub(super) const LONGEST_TYPED: usize = 16;

const ESCAPE: u8 = 0x1B;

/// One key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// One of the main menu.
    Menu(MenuKey),
    /// X leaves the view; then the menu is printed.
    Leave,
    /// Enter: the end of an answer, and in the view the next object.
    Enter,
    /// Means nothing to the menu, or is part of an answer.
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

/// A part of what was typed, which is secret or open as a whole.
pub(super) struct Stroke<'a> {
    /// The keys.
    pub(super) keys: &'a [u8],
    /// The Enter after them, or nothing. It is never secret.
    pub(super) enter: &'a [u8],
    /// Set if the last of the keys is an L of the menu: what follows may be the password.
    pub(super) opens: Option<MenuKey>,
}

/// How something was typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TypedBy {
    /// In one piece: a key, or what was pasted.
    Hand,
    /// As the next part of a file.
    File,
}

/// Reads what is typed, or what is sent.
#[derive(Debug, Default)]
pub(super) struct KeyReader {
    /// The key, D or L, after which what is typed is an answer: the `s` of `Yes` is not a key.
    question: Option<MenuKey>,
    place: Place,
}

/// Where in a piece the next character is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Place {
    /// Where an `l` is a key.
    #[default]
    Open,
    /// After characters that are not keys, so an `l` is part of a word.
    Word,
    /// Within the sequence that a key without a character sends: Escape, `[` or `O`, parameters, and a letter or `~`.
    Escape,
}

impl KeyReader {
    /// These bytes have been sent, none of them secret.
    pub(super) fn read(&mut self, bytes: &[u8]) -> Typed {
        if bytes.len() > LONGEST_TYPED {
            return Typed::File;
        }
        self.begin();
        Typed::Keys(bytes.iter().map(|&byte| self.key(byte)).collect())
    }

    /// Something new is typed or sent, so an `l` at its beginning is a key.
    pub(super) fn begin(&mut self) {
        self.place = Place::Open;
    }

    /// Reads what has been typed, and returns it in parts: Enter ends one, and so does an L of the menu.
    pub(super) fn strokes<'a>(&mut self, typed: &'a [u8], by: TypedBy) -> Vec<Stroke<'a>> {
        if by == TypedBy::Hand {
            self.begin();
        }
        let (mut strokes, mut rest) = (Vec::new(), typed);
        let mut length = 0;
        for &byte in typed {
            length += 1;
            let (enter, opens) = match self.key(byte) {
                Key::Enter => (1, None),
                Key::Menu(MenuKey::Load) => (0, Some(MenuKey::Load)),
                Key::Menu(_) | Key::Leave | Key::Other => continue,
            };
            let (stroke, after) = rest.split_at(length);
            let (keys, enter) = stroke.split_at(length - enter);
            strokes.push(Stroke { keys, enter, opens });
            (rest, length) = (after, 0);
        }
        if !rest.is_empty() {
            strokes.push(Stroke { keys: rest, enter: &[], opens: None });
        }
        strokes
    }

    fn key(&mut self, byte: u8) -> Key {
        let key = match byte.to_ascii_lowercase() {
            // Enter is CR; a script may send the line feeds of its file.
            b'\r' | b'\n' => Key::Enter,
            _ if self.question.is_some() && byte != ESCAPE => return Key::Other,
            b'l' if self.place == Place::Word => Key::Other,
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
        self.place = match (self.place, key) {
            _ if byte == ESCAPE => Place::Escape,
            (Place::Escape, _) if matches!(byte, b'[' | b'O' | b';') || byte.is_ascii_digit() => Place::Escape,
            (Place::Escape, _) | (_, Key::Enter) => Place::Open,
            _ if byte.is_ascii_whitespace() => Place::Open,
            (_, Key::Other) => Place::Word,
            (place, Key::Menu(_) | Key::Leave) => place,
        };
        key
    }

    /// The unit has shown its menu, or has restarted: no question is open any more, even if no Enter has ended it.
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
        assert_eq!(read(b"lA\ns"), [Key::Menu(MenuKey::Load), Key::Other, Key::Enter, DIAGNOSTICS]);
    }

    #[test]
    fn an_l_is_a_key_unless_it_is_part_of_a_word() {
        let opens = |pieces: &[&[u8]], by| {
            let mut reader = KeyReader::default();
            pieces.iter().flat_map(|piece| reader.strokes(piece, by)).find_map(|stroke| stroke.opens)
        };
        let load = Some(MenuKey::Load);
        for piece in ["l", "ml", "hello\rl", "\x1B[Al", "\x1B[15~l", "he\x1BOPl", "t1000\nl", " l", "he\tl"] {
            assert_eq!(opens(&[piece.as_bytes()], TypedBy::Hand), load, "{piece:?}");
        }
        for piece in ["hello", "all", "S1l", "hello\x1BOP\x03"] {
            assert_eq!(opens(&[piece.as_bytes()], TypedBy::Hand), None, "{piece:?}");
        }
        // Keys come one at a time; a file goes on.
        for pieces in [[&b"\x1B[A"[..], b"l"], [b"he", b"l"]] {
            assert_eq!(opens(&pieces, TypedBy::Hand), load);
        }
        assert_eq!(opens(&[b"he", b"llo"], TypedBy::File), None);
        assert_eq!(opens(&[b"he\r\n", b"l"], TypedBy::File), load);
        // A file does not go on with what was typed before it.
        let mut reader = KeyReader::default();
        reader.strokes(b"he", TypedBy::Hand);
        reader.begin();
        assert!(reader.strokes(b"l", TypedBy::File).iter().any(|stroke| stroke.opens == load));
    }

    #[test]
    fn strokes_are_all_that_was_typed() {
        let mut reader = KeyReader::default();
        let strokes = reader.strokes(b"ml1\n\rok", TypedBy::Hand);
        let parts: Vec<_> = strokes.iter().map(|stroke| (stroke.keys, stroke.enter)).collect();
        assert_eq!(parts, [(&b"ml"[..], &b""[..]), (b"1", b"\n"), (b"", b"\r"), (b"ok", b"")]);
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
        assert_eq!(reader.read(&[b'l'; LONGEST_TYPED + 1]), Typed::File);
        assert_eq!(reader.question(), None);
        assert_eq!(reader.read(&[b'1'; LONGEST_TYPED]), Typed::Keys(vec![Key::Other; LONGEST_TYPED]));
        assert_eq!(reader.read(b"s"), Typed::Keys(vec![DIAGNOSTICS]));
    }
}
