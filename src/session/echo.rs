//! Distinguishes the echo of a password from what the unit says itself on the line after it.
//!
//! Not every unit echoes a line end, or anything: `Password wrong` may come where the echo would. So what comes is
//! compared with the keys that were sent. It is their echo if it consists of them in their order, in either case, even
//! if the line has lost, doubled or damaged some, and with what hides them again (backspaces, stars) in between.
//! Everything else is the unit's own text, including a mask that it shows instead of the keys.
//!
//! What always holds:
//! - Nothing is lost or reordered. Bytes that may become an echo are kept back until the next ones decide, or until
//!   they are [asked for](Echo::flush): then they are secret if an echo is to be expected at this place.
//! - Four consecutive keys never come through.
//! - If there are more keys than are compared, everything is secret.

use zeroize::Zeroizing;

use super::redactor::{LONGEST, Piece, Pieces, SHORTEST};
use crate::endpoint::Secrecy;
use crate::wire::{XOFF, XON};

/// Most bytes that are kept back: a unit may hide what it has echoed with any number of signs.
const MOST_KEPT: usize = 64;
/// After part of an echo, and as long as keys of it are missing, a run of this many keys is part of it as well.
const SHORTEST_REST: usize = 2;

/// The keys that may come back, and how far they have.
#[derive(Default)]
pub(super) struct Echo {
    keys: Zeroizing<Vec<u8>>,
    /// More keys have been typed than are kept.
    is_beyond: bool,
    /// The keys are being typed, so each may come back alone; otherwise the echo comes in one piece, before anything
    /// else.
    by_hand: bool,
    /// How many of the keys have come back, including those lost on the way.
    back: usize,
    /// How many bytes of this line are secret.
    found: usize,
    /// The unit has said something else since.
    spoken: bool,
    run: Run,
    escape: Escape,
    /// The byte before.
    last: u8,
    out: Pieces,
}

/// Bytes in a row that may be an echo, or part of one.
#[derive(Default)]
struct Run {
    /// Those that have not been handed out.
    kept: Vec<(u8, Nature)>,
    /// How many of them are keys, those handed out included.
    matched: usize,
    /// Position in the keys after the last one that has matched.
    next: usize,
    /// The same, if the run consists of keys that have not come back before.
    due: Option<usize>,
    /// The last byte is not the next key. It is damage in place of that key if the byte after it is the key after that.
    is_doubtful: bool,
    /// The last key that has matched.
    last: u8,
    /// Some of it has been handed out as secret.
    is_echo: bool,
}

/// What a byte of a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Nature {
    /// A key, or one of them doubled or damaged.
    Key,
    /// What hides a key, or moves the cursor.
    Own,
}

/// Where in an escape sequence the line is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    Begun,
    Parameters,
}

impl Echo {
    /// A new password: none of it has been sent.
    pub(super) fn begin(&mut self) {
        self.finish();
        let out = std::mem::take(&mut self.out);
        // Allocated in full size: a vector that grows leaves unwiped copies behind.
        *self = Echo { keys: Zeroizing::new(Vec::with_capacity(LONGEST)), out, ..Echo::default() };
    }

    /// These keys of the password have been typed.
    pub(super) fn typed(&mut self, keys: &[u8]) {
        self.by_hand = true;
        for &key in keys.iter().filter(|key| !key.is_ascii_control()) {
            if self.keys.len() < LONGEST {
                self.keys.push(key);
            } else {
                self.is_beyond = true;
            }
        }
    }

    /// Enter has been typed after them: what has not come back is on its way, in one piece.
    pub(super) fn entered(&mut self) {
        (self.by_hand, self.spoken) = (false, false);
    }

    /// Takes bytes of the line. Returns those of which it is known whether they are secret, in their order.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<Piece> {
        for &byte in bytes {
            if matches!(byte, XON | XOFF) {
                // Flow control cannot wait.
                self.tell();
                self.out.push(&[byte], Secrecy::Open);
            } else if self.is_beyond {
                self.tell();
                self.out.push(&[byte], Secrecy::Secret);
            } else {
                self.take(byte);
            }
        }
        std::mem::take(&mut self.out).into_inner()
    }

    /// Whether bytes are kept back.
    pub(super) fn keeps_back(&self) -> bool {
        !self.run.kept.is_empty() || !self.out.is_empty()
    }

    /// Hands out what was kept back, since no more will come soon. If more comes all the same, the run goes on with it.
    pub(super) fn flush(&mut self) -> Vec<Piece> {
        self.tell();
        std::mem::take(&mut self.out).into_inner()
    }

    /// The line is over. What is still kept of it has to be [handed out](Echo::flush) next.
    pub(super) fn finish(&mut self) {
        self.tell();
        self.run = Run::default();
        self.escape = Escape::None;
    }

    fn take(&mut self, byte: u8) {
        let erases = matches!(self.last, 0x08 | 0x7F) && byte == b' ';
        let is_own = self.escape.covers(byte) || byte.is_ascii_control() || erases;
        self.last = byte;
        // The bytes of a run that was no echo are looked at again, without its first one.
        let mut rest = vec![(byte, is_own)];
        while let Some((byte, is_own)) = rest.pop() {
            if !self.goes_on(byte, is_own) {
                rest.push((byte, is_own));
                rest.extend(self.end_run().into_iter().rev());
            }
        }
        if self.run.kept.len() >= MOST_KEPT {
            self.tell();
        }
    }

    /// Adds a byte to the run, begins a run with it, or hands it out if it cannot be part of one. `false`: it does not
    /// belong to the run, which is over.
    fn goes_on(&mut self, byte: u8, is_own: bool) -> bool {
        if self.run.matched == 0 {
            match self.find(0, byte).filter(|_| !is_own) {
                Some(next) => {
                    let due = self.find(self.back, byte);
                    self.run = Run { matched: 1, next, due, last: byte, ..Run::default() };
                    self.run.kept.push((byte, Nature::Key));
                }
                None => self.say(byte, is_own),
            }
        } else if is_own {
            self.run.kept.push((byte, Nature::Own));
        } else if self.run.is_doubtful {
            let Some(next) = self.find(self.run.next + 1, byte).filter(|&next| next == self.run.next + 2) else {
                return false;
            };
            self.run.is_doubtful = false;
            self.go_to(next, byte);
        } else if let Some(next) = self.find(self.run.next, byte) {
            self.go_to(next, byte);
        } else if byte.eq_ignore_ascii_case(&self.run.last) {
            self.run.kept.push((byte, Nature::Key));
        } else if byte == b'*' {
            self.run.kept.push((byte, Nature::Own));
        } else if self.run.next + 1 < self.keys.len() {
            self.run.kept.push((byte, Nature::Key));
            self.run.is_doubtful = true;
        } else {
            return false;
        }
        if self.is_long_enough() && !self.run.is_doubtful {
            self.tell();
        }
        true
    }

    /// The run goes on with the key before `next`.
    fn go_to(&mut self, next: usize, byte: u8) {
        let due = self.run.due.and_then(|due| self.find(due, byte));
        self.run.kept.push((byte, Nature::Key));
        (self.run.next, self.run.due, self.run.last) = (next, due, byte);
        self.run.matched += 1;
    }

    /// The position after the first key, from `from` on, that this byte may be.
    fn find(&self, from: usize, byte: u8) -> Option<usize> {
        let keys = self.keys.get(from..)?;
        keys.iter().position(|key| key.eq_ignore_ascii_case(&byte)).map(|at| from + at + 1)
    }

    fn is_long_enough(&self) -> bool {
        let is_part = self.found > 0 && self.found < self.keys.len();
        let shortest = if is_part { SHORTEST_REST } else { SHORTEST };
        self.run.matched > 0 && self.run.matched >= shortest.min(self.keys.len())
    }

    /// Whether the run is an echo. A run that has ended is not one just because it is where the echo has to come: the
    /// unit's own text begins there too, perhaps with the same letters. But what is typed by hand may come back key by
    /// key, with words between.
    fn is_echo(&self, has_ended: bool) -> bool {
        let is_due = self.run.due.is_some() && (self.by_hand || !self.spoken && !has_ended);
        self.run.matched > 0 && (self.is_long_enough() || self.run.is_echo || is_due)
    }

    /// A byte has come that does not belong to the run. Returns the bytes of the run that are to be looked at again.
    fn end_run(&mut self) -> Vec<(u8, bool)> {
        let doubtful = if self.run.is_doubtful { self.run.kept.pop() } else { None };
        let is_echo = self.is_echo(true);
        self.run.is_doubtful = false;
        let kept = if is_echo { Vec::new() } else { std::mem::take(&mut self.run.kept) };
        self.tell_as(is_echo);
        self.run = Run::default();
        let mut rest = kept.into_iter().chain(doubtful).map(|(byte, nature)| (byte, nature == Nature::Own));
        if !is_echo && let Some((byte, is_own)) = rest.next() {
            self.say(byte, is_own);
        }
        rest.collect()
    }

    /// Hands out what is kept of the run.
    fn tell(&mut self) {
        let is_echo = self.is_echo(false);
        self.tell_as(is_echo);
        self.run.is_doubtful = false;
    }

    fn tell_as(&mut self, is_echo: bool) {
        for (byte, nature) in std::mem::take(&mut self.run.kept) {
            if is_echo && nature == Nature::Key {
                self.out.push(&[byte], Secrecy::Secret);
                self.found += 1;
            } else {
                self.say(byte, nature == Nature::Own);
            }
        }
        if is_echo {
            self.run.is_echo = true;
            self.back = self.run.due.unwrap_or(self.back.max(self.run.next));
        }
    }

    /// Hands out a byte that the unit says itself.
    fn say(&mut self, byte: u8, is_own: bool) {
        self.spoken |= byte.is_ascii_alphanumeric() && !is_own;
        self.out.push(&[byte], Secrecy::Open);
    }
}

impl Escape {
    /// Whether this byte belongs to an escape sequence.
    fn covers(&mut self, byte: u8) -> bool {
        const ESC: u8 = 0x1B;
        let before = *self;
        *self = match (before, byte) {
            (_, ESC) => Escape::Begun,
            (Escape::Begun, b'[') | (Escape::Parameters, b'0'..=b'9' | b';' | b'?') => Escape::Parameters,
            _ => Escape::None,
        };
        // In a sequence without `[`, what follows ESC may be one of the keys.
        matches!(before, Escape::Parameters) || *self != Escape::None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::REDACTED;
    use proptest::prelude::*;

    /// What comes out for these pieces of a line, with stars for what is secret. After each the line falls silent.
    fn redacted(echo: &mut Echo, pieces: &[&[u8]]) -> Vec<u8> {
        let mut all = Vec::new();
        for piece in pieces {
            for (bytes, secrecy) in echo.push(piece).into_iter().chain(echo.flush()) {
                let is_open = secrecy == Secrecy::Open;
                all.extend(bytes.iter().map(|&byte| if is_open { byte } else { REDACTED }));
            }
        }
        all
    }

    /// The password has been sent in one piece.
    fn sent(password: &str) -> Echo {
        let mut echo = Echo::default();
        echo.begin();
        echo.typed(password.as_bytes());
        echo.entered();
        echo
    }

    fn after(password: &str, pieces: &[&str]) -> String {
        let pieces: Vec<&[u8]> = pieces.iter().map(|piece| piece.as_bytes()).collect();
        String::from_utf8(redacted(&mut sent(password), &pieces)).expect("ASCII")
    }

    #[test]
    fn what_the_unit_says_itself_is_no_echo() {
        for (password, says) in [
            ("Pa55-Wort", "Password wrong"),
            ("pa55-wort", "Password wrong"),
            ("Pa55-Wort", ": "),
            ("Pa55-Wort", "Access denied."),
            ("AXIO-2010", "Application rejects it, V2.0"),
            ("AXIO-2010", "#########"),
            ("AXIO-2010", "\x1b[31mWrong\x1b[0m"),
            // Keys that are none of the next ones.
            ("Pa55-Wort", "Paaaa, no"),
        ] {
            assert_eq!(after(password, &[says]), says, "{password}");
        }
    }

    #[test]
    fn an_echo_is_secret_and_the_text_around_it_is_not() {
        for (pieces, expected) in [
            (&["Pa55-Wort"][..], "*********"),
            (&["Password Pa55-Wort accepted"], "Password ********* accepted"),
            (&[": Pa55-Wort ok"], ": ********* ok"),
            (&["PA55-WORT", " no"], "********* no"),
            (&["P", "a5", "5-Wor", "t", " accepted"], "********* accepted"),
            // Shown for a moment each, and hidden again.
            (&["P\x08*a\x08*5\x08*5\x08*-\x08*W\x08*o\x08*r\x08*t\x08*"], &"*\x08*".repeat(9)),
            (&["P\x1b[D*a\x1b[D*5\x1b[D*5\x1b[D*-Wort"], &("*\x1b[D*".repeat(4) + "*****")),
            // Bytes that the line has lost, doubled, or damaged.
            (&["a5-Wrt?"], "******?"),
            (&["PPa555-Wort"], "***********"),
            (&["Pa5~-Wort!"], "*********!"),
            (&["Pa55~~-Wort ok"], "****~~***** ok"),
            (&["Pa55-W~~rt ok"], "******~~** ok"),
            (&["Pa~5-Wort"], "*********"),
            // Nothing follows in which the last key could be seen to be damaged.
            (&["Pa55-Wor?", " no"], "********? no"),
            // Damage is forgotten where the line pauses.
            (&["so Pa5~", "5- no"], "so Pa5~** no"),
            // What has come to nothing may hold the beginning of the echo.
            (&["PaPa55-Wort"], "Pa*********"),
            // Incomplete, but where the echo has to come.
            (&["Pa"], "**"),
            (&["Pa\x1355\x11-Wort"], "**\x13**\x11*****"),
        ] {
            assert_eq!(after("Pa55-Wort", pieces), expected, "{pieces:?}");
        }
    }

    #[test]
    fn what_is_typed_by_hand_comes_back_key_by_key_whatever_is_said_between() {
        let mut echo = Echo::default();
        echo.begin();
        let mut told = String::new();
        for key in "Geheim".bytes() {
            echo.typed(&[key]);
            let piece = redacted(&mut echo, &[&[key], b"\x1b[K", b"12"]);
            told += &String::from_utf8(piece).expect("ASCII");
        }
        assert_eq!(told, "*\x1b[K12".repeat(6));
        echo.entered();
        assert_eq!(redacted(&mut echo, &[b"GEHEIM, he?"]), b"******, he?", "and once more");
        // With a slip of the finger that is taken back.
        echo.begin();
        echo.typed(b"AXIP\x08O-2010");
        assert_eq!(redacted(&mut echo, &[b"AXIP\x08 \x08O-2010"]), b"****\x08 \x08******");
    }

    #[test]
    fn more_keys_than_are_compared_make_all_secret() {
        let mut echo = sent(&"x".repeat(LONGEST + 1));
        assert_eq!(redacted(&mut echo, &[b"abc\x13d"]), b"***\x13*");
        // What was kept back by then comes first.
        let mut echo = Echo::default();
        echo.begin();
        echo.typed(&[b'x'; LONGEST]);
        assert_eq!(echo.push(b"x\x1b["), []);
        echo.typed(b"x");
        let pieces =
            [(b"x".to_vec(), Secrecy::Secret), (b"\x1b[".to_vec(), Secrecy::Open), (b"y".to_vec(), Secrecy::Secret)];
        assert_eq!(echo.push(b"y"), pieces);
    }

    #[test]
    fn what_is_known_to_be_an_echo_is_not_kept_back() {
        assert_eq!(sent("Pa55-Wort").push(b"Pa55"), [(b"Pa55".to_vec(), Secrecy::Secret)]);
    }

    #[test]
    fn nothing_that_was_kept_back_is_lost_by_another_password() {
        let mut echo = sent("Pa55-Wort");
        assert_eq!(echo.push(b"so Pa"), [(b"so ".to_vec(), Secrecy::Open)]);
        assert!(echo.keeps_back());
        echo.begin();
        assert!(echo.keeps_back());
        assert_eq!(echo.push(b""), [(b"Pa".to_vec(), Secrecy::Open)]);
        assert!(!echo.keeps_back());
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_no_four_keys_come_through(
            secret in "[abcD]{4,8}",
            by_hand in any::<bool>(),
            text in "[abcde*\x08\x11\x1b]{0,60}",
            cuts in prop::collection::vec(0usize..60, 0..6),
        ) {
            let mut echo = sent(&secret);
            if by_hand {
                echo.typed(b"");
            }
            let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(text.len())).collect();
            cuts.extend([0, text.len()]);
            cuts.sort_unstable();
            let pieces: Vec<&[u8]> = cuts.windows(2).map(|pair| &text.as_bytes()[pair[0]..pair[1]]).collect();
            let found = redacted(&mut echo, &pieces);
            prop_assert_eq!(found.len(), text.len());
            for (was, is) in text.bytes().zip(&found) {
                prop_assert!(was == *is || *is == REDACTED);
            }
            let secret = secret.to_ascii_lowercase();
            // Where the line pauses, three keys on either side may be seen; within a piece never four.
            let mut at = 0;
            for piece in pieces {
                let shown = &found[at..at + piece.len()];
                at += piece.len();
                prop_assert!(!shown.windows(4).any(|part| secret.as_bytes().windows(4).any(|keys| keys == part)));
            }
        }
    }
}
