//! What the user's keys mean in the plain terminal: for the unit, or for the terminal itself.
//!
//! Ctrl-] leaves, as in telnet; Ctrl-T makes the next key the terminal's own, as in other serial terminals. No menu of a
//! unit uses either.

use std::path::PathBuf;

/// Ctrl-].
const LEAVE: u8 = 0x1D;
/// Ctrl-T.
const PREFIX: u8 = 0x14;
const ESCAPE: u8 = 0x1B;
const CANCEL: u8 = 0x03;

/// Bytes of a file's name at most.
const LONGEST_NAME: usize = 4096;

/// What follows the prefix, for the help.
pub const HELP: &str = "Ctrl-T and then: h hexadecimal, t times, e local echo, r raw, f send a file, b break, Ctrl-T \
                        itself; Ctrl-] leaves";

/// What the user wants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Bytes for the unit.
    Send(Vec<u8>),
    /// The end.
    Leave,
    /// Hexadecimal, or text again.
    Hex,
    /// Times before the lines, or no longer.
    Times,
    /// What is typed is shown, or no longer.
    Echo,
    /// Bytes as they are, or text again.
    Raw,
    /// A break on the line.
    Break,
    /// The keys.
    Help,
    /// The name of a file is typed: show it so far.
    Naming(String),
    /// Send this file.
    SendFile(PathBuf),
    /// No file after all, or no more of it.
    Cancel,
}

/// What the next key means.
#[derive(Debug, Default)]
pub struct Keys {
    stage: Stage,
    /// A file is being sent: keys for the unit are not taken until its end, and Ctrl-C ends it.
    sending: bool,
}

#[derive(Debug, Default)]
enum Stage {
    #[default]
    Typing,
    AfterPrefix,
    Naming(Vec<u8>),
}

impl Keys {
    /// Says whether a file is being sent. After [`Wish::SendFile`] one is, until this says that it could not be opened.
    pub fn set_sending(&mut self, sending: bool) {
        self.sending = sending;
    }

    /// Takes what was typed and gives what it means.
    pub fn press(&mut self, keys: &[u8]) -> Vec<Wish> {
        let mut wishes = Vec::new();
        for &key in keys {
            match &mut self.stage {
                _ if key == LEAVE => {
                    wishes.push(Wish::Leave);
                    return wishes;
                }
                Stage::Typing if key == PREFIX => self.stage = Stage::AfterPrefix,
                Stage::Typing if self.sending => {
                    if key == CANCEL {
                        wishes.push(Wish::Cancel);
                    }
                }
                Stage::Typing => match wishes.last_mut() {
                    Some(Wish::Send(bytes)) => bytes.push(key),
                    _ => wishes.push(Wish::Send(vec![key])),
                },
                Stage::AfterPrefix => {
                    self.stage = Stage::Typing;
                    match key.to_ascii_lowercase() {
                        PREFIX => wishes.push(Wish::Send(vec![PREFIX])),
                        b'h' => wishes.push(Wish::Hex),
                        b't' => wishes.push(Wish::Times),
                        b'e' => wishes.push(Wish::Echo),
                        b'r' => wishes.push(Wish::Raw),
                        b'b' => wishes.push(Wish::Break),
                        b'f' if !self.sending => {
                            self.stage = Stage::Naming(Vec::new());
                            wishes.push(Wish::Naming(String::new()));
                        }
                        _ => wishes.push(Wish::Help),
                    }
                }
                Stage::Naming(name) => match key {
                    b'\r' | b'\n' => {
                        let name = String::from_utf8_lossy(name).trim().to_owned();
                        self.stage = Stage::Typing;
                        if name.is_empty() {
                            wishes.push(Wish::Cancel);
                        } else {
                            // What was typed or pasted with the name must not get ahead of the file.
                            self.sending = true;
                            wishes.push(Wish::SendFile(name.into()));
                        }
                    }
                    ESCAPE | CANCEL => {
                        self.stage = Stage::Typing;
                        wishes.push(Wish::Cancel);
                    }
                    0x08 | 0x7F => {
                        // A whole character goes, however many bytes it has.
                        while name.pop().is_some_and(|byte| byte & 0xC0 == 0x80) {}
                        wishes.push(Wish::Naming(String::from_utf8_lossy(name).into_owned()));
                    }
                    0..0x20 => {}
                    _ if name.len() < LONGEST_NAME => {
                        name.push(key);
                        wishes.push(Wish::Naming(String::from_utf8_lossy(name).into_owned()));
                    }
                    _ => {}
                },
            }
        }
        wishes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_the_units_but_for_two() {
        let mut keys = Keys::default();
        assert_eq!(keys.press(b"m\r\x03"), [Wish::Send(b"m\r\x03".to_vec())]);
        assert_eq!(keys.press(b"\x14\x14v"), [Wish::Send(b"\x14v".to_vec())]);
        assert_eq!(keys.press(b"\x14h\x14T\x14?"), [Wish::Hex, Wish::Times, Wish::Help]);
        assert_eq!(keys.press(b"a\x1dlost"), [Wish::Send(b"a".to_vec()), Wish::Leave]);
    }

    #[test]
    fn a_files_name_is_typed_corrected_and_given_up() {
        let mut keys = Keys::default();
        keys.press("\u{14}fa.Ä".as_bytes());
        assert_eq!(keys.press(b"\x7f"), [Wish::Naming("a.".into())]);
        assert_eq!(keys.press(b"S\r"), [Wish::Naming("a.S".into()), Wish::SendFile("a.S".into())]);
        keys.set_sending(false);
        keys.press(b"\x14fx");
        assert_eq!(keys.press(b"\x1b"), [Wish::Cancel]);
        assert_eq!(keys.press(b"m"), [Wish::Send(b"m".to_vec())], "and the next key is the unit's again");
    }

    #[test]
    fn what_is_pasted_with_the_name_of_a_file_does_not_reach_the_unit() {
        let mut keys = Keys::default();
        let wishes = keys.press(b"m\x14fx\rDDD\x03");
        assert_eq!(wishes.first(), Some(&Wish::Send(b"m".to_vec())));
        assert_eq!(wishes[wishes.len() - 2..], [Wish::SendFile("x".into()), Wish::Cancel]);
    }

    #[test]
    fn while_a_file_is_sent_nothing_comes_between_and_ctrl_c_ends_it() {
        let mut keys = Keys { sending: true, ..Keys::default() };
        assert_eq!(keys.press(b"mmm"), []);
        assert_eq!(keys.press(b"\x03"), [Wish::Cancel]);
        assert_eq!(keys.press(b"\x14f"), [Wish::Help]);
    }
}
