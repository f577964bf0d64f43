//! A line the user types: echoed, correctable, bounded.

/// Characters an answer may have; what comes beyond is not taken. The longest sensible answer is a password.
pub const LINE_LIMIT: usize = 32;

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7F;
/// Leaves a question.
pub const ESCAPE: u8 = 0x1B;

/// What comes back for a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// The character itself.
    Plain,
    /// A star, for a password.
    Stars,
}

/// An answer being typed.
#[derive(Debug)]
pub struct Line {
    typed: String,
    echo: Echo,
}

/// What a key has done to an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Typed {
    /// It goes on; these bytes are echoed.
    More(&'static [u8]),
    /// It goes on; this character is echoed.
    Character(u8),
    /// Enter: this is the answer.
    Answer(String),
    /// Escape.
    Cancelled,
}

impl Line {
    /// An empty answer.
    pub fn new(echo: Echo) -> Self {
        Line { typed: String::new(), echo }
    }

    /// Takes a key.
    pub fn take(&mut self, key: u8) -> Typed {
        match key {
            b'\r' => Typed::Answer(std::mem::take(&mut self.typed)),
            ESCAPE => Typed::Cancelled,
            BACKSPACE | DELETE => match self.typed.pop() {
                Some(_) => Typed::More(b"\x08 \x08"),
                None => Typed::More(b""),
            },
            _ if (key.is_ascii_graphic() || key == b' ') && self.typed.len() < LINE_LIMIT => {
                self.typed.push(char::from(key));
                match self.echo {
                    Echo::Plain => Typed::Character(key),
                    Echo::Stars => Typed::More(b"*"),
                }
            }
            _ => Typed::More(b""),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(keys: &[u8]) -> Option<String> {
        let mut line = Line::new(Echo::Plain);
        keys.iter().find_map(|&key| match line.take(key) {
            Typed::Answer(answer) => Some(answer),
            Typed::More(_) | Typed::Character(_) | Typed::Cancelled => None,
        })
    }

    #[test]
    fn an_answer_can_be_corrected_and_has_an_end() {
        assert_eq!(answer(b"Yexx\x08\x7fs\r").as_deref(), Some("Yes"));
        assert_eq!(answer(b"\x08\x08Yes\r").as_deref(), Some("Yes"));
        assert_eq!(answer(b"a\x00\xff\tb\r").as_deref(), Some("ab"), "only printable characters are taken");
        let long = [vec![b'x'; 100], b"\r".to_vec()].concat();
        assert_eq!(answer(&long).map(|answer| answer.len()), Some(LINE_LIMIT));
    }

    #[test]
    fn a_password_comes_back_as_stars() {
        let mut line = Line::new(Echo::Stars);
        assert_eq!(line.take(b'A'), Typed::More(b"*"));
        assert_eq!(line.take(0x08), Typed::More(b"\x08 \x08"));
        assert_eq!(line.take(0x1B), Typed::Cancelled);
    }
}
