//! Keeps the password out of the record wherever the unit repeats it.
//!
//! Its echo on the line where it was typed is found in whatever form it comes (`echo.rs`). This is for the rest: a unit
//! that says `wrong password: ...` on the next line, in either case. Bytes that may be the beginning of the password
//! are kept back until the next ones decide, for a moment at most: they are handed out once the line falls silent, or
//! when flow control comes among them, which cannot wait. The password is looked for across both, so no more of it than
//! its first three characters can be seen.

use zeroize::Zeroizing;

use crate::endpoint::Secrecy;
use crate::record::REDACTED;
use crate::wire::{XOFF, XON};

/// Fewest bytes that are looked for: a shorter password, or beginning of one, occurs in too much that has nothing to do
/// with it.
pub(super) const SHORTEST: usize = 4;
/// Most bytes of a password that are compared.
pub(super) const LONGEST: usize = 128;

/// Finds one secret in a stream of bytes.
#[derive(Default)]
pub(super) struct Redactor {
    secret: Zeroizing<Vec<u8>>,
    /// At `n - 1`: length of the longest proper prefix of the secret's first `n` bytes that is also their suffix
    /// (Knuth, Morris and Pratt).
    fallback: Vec<usize>,
    /// The last bytes that came, as they came, as far as they are the beginning of the secret.
    matched: Zeroizing<Vec<u8>>,
    /// How many of `matched` have been handed out.
    told: usize,
    /// What was kept back for the secret that was looked for before, and has not been handed out.
    left: Pieces,
}

/// Bytes, and whether they are the secret.
pub(super) type Piece = (Vec<u8>, Secrecy);

impl Redactor {
    /// Looks for this secret from now on. One that is too short, such as an Enter alone, is ignored: the one before is
    /// still looked for.
    pub(super) fn look_for(&mut self, secret: &[u8]) {
        let secret = &secret[..secret.len().min(LONGEST)];
        if secret.len() < SHORTEST || secret.eq_ignore_ascii_case(&self.secret) {
            return;
        }
        let left = Pieces(self.flush());
        // Allocated in full size: a vector that grows leaves unwiped copies behind.
        let matched = Zeroizing::new(Vec::with_capacity(secret.len()));
        *self = Redactor { left, matched, secret: Zeroizing::new(secret.to_vec()), ..Redactor::default() };
        self.fallback = vec![0; secret.len()];
        let mut length = 0;
        for at in 1..secret.len() {
            while length > 0 && !secret[at].eq_ignore_ascii_case(&secret[length]) {
                length = self.fallback[length - 1];
            }
            length += usize::from(secret[at].eq_ignore_ascii_case(&secret[length]));
            self.fallback[at] = length;
        }
    }

    /// Takes bytes. Returns those of which it is known whether they are secret, in their order.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<Piece> {
        let mut pieces = std::mem::take(&mut self.left);
        if self.secret.is_empty() {
            pieces.push(bytes, Secrecy::Open);
            return pieces.0;
        }
        for &byte in bytes {
            if matches!(byte, XON | XOFF) {
                self.tell(&mut pieces);
                pieces.push(&[byte], Secrecy::Open);
                continue;
            }
            while !self.matched.is_empty() && !self.goes_on_with(byte) {
                let passed = self.matched.len() - self.fallback[self.matched.len() - 1];
                pieces.push(&self.matched[self.told.min(passed)..passed], Secrecy::Open);
                self.told = self.told.saturating_sub(passed);
                self.matched.drain(..passed);
            }
            if !self.goes_on_with(byte) {
                pieces.push(&[byte], Secrecy::Open);
                continue;
            }
            self.matched.push(byte);
            if self.matched.len() == self.secret.len() {
                pieces.push(&self.matched[self.told..], Secrecy::Secret);
                self.matched.clear();
                self.told = 0;
            }
        }
        pieces.0
    }

    /// Whether this is the secret's next byte.
    fn goes_on_with(&self, byte: u8) -> bool {
        self.secret.get(self.matched.len()).is_some_and(|next| next.eq_ignore_ascii_case(&byte))
    }

    /// Whether bytes are kept back.
    pub(super) fn keeps_back(&self) -> bool {
        self.matched.len() > self.told || !self.left.0.is_empty()
    }

    /// Hands out what was kept back, since no more will come soon. If the rest comes all the same, it is recognised.
    pub(super) fn flush(&mut self) -> Vec<Piece> {
        let mut pieces = std::mem::take(&mut self.left);
        self.tell(&mut pieces);
        pieces.0
    }

    fn tell(&mut self, pieces: &mut Pieces) {
        let secrecy = if self.matched.len() < SHORTEST { Secrecy::Open } else { Secrecy::Secret };
        pieces.push(&self.matched[self.told..], secrecy);
        self.told = self.matched.len();
    }

    /// Replaces the secret in a text.
    pub(super) fn scrub(&self, text: &mut String) {
        let length = self.secret.len();
        if length == 0 || text.len() < length {
            return;
        }
        let mut at = 0;
        while let Some(part) = text.as_bytes().get(at..at + length) {
            let is_secret = part.eq_ignore_ascii_case(&self.secret);
            if is_secret && let Some(part) = text.get(at..at + length) {
                let stars = char::from(REDACTED).to_string().repeat(part.chars().count());
                text.replace_range(at..at + length, &stars);
                at += stars.len();
            } else {
                at += 1;
            }
        }
    }
}

/// Bytes in their order, neighbours of the same secrecy together.
#[derive(Default)]
pub(super) struct Pieces(Vec<Piece>);

impl Pieces {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn into_inner(self) -> Vec<Piece> {
        self.0
    }

    pub(super) fn push(&mut self, bytes: &[u8], secrecy: Secrecy) {
        match self.0.last_mut() {
            _ if bytes.is_empty() => {}
            Some((last, nature)) if *nature == secrecy => last.extend_from_slice(bytes),
            Some(_) | None => self.0.push((bytes.to_vec(), secrecy)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What comes out for these chunks, with stars for what is secret. At an empty one the line falls silent.
    fn redacted(secret: &[u8], chunks: &[&[u8]]) -> Vec<u8> {
        let mut redactor = Redactor::default();
        redactor.look_for(secret);
        let mut all = Vec::new();
        for chunk in chunks.iter().copied().chain([&b""[..]]) {
            let pieces = if chunk.is_empty() { redactor.flush() } else { redactor.push(chunk) };
            for (bytes, secrecy) in pieces {
                let is_open = secrecy == Secrecy::Open;
                all.extend(bytes.iter().map(|&byte| if is_open { byte } else { REDACTED }));
            }
        }
        all
    }

    #[test]
    fn the_secret_is_found_in_pieces_and_after_its_own_beginning() {
        let said = |chunks: &[&str]| {
            let chunks: Vec<&[u8]> = chunks.iter().map(|chunk| chunk.as_bytes()).collect();
            String::from_utf8(redacted(b"ABABC", &chunks)).expect("ASCII")
        };
        assert_eq!(said(&["wrong: AB", "ABC", "!"]), "wrong: *****!");
        assert_eq!(said(&["ABABABC"]), "AB*****");
        assert_eq!(said(&["ABAB", "D"]), "ABABD");
        assert_eq!(said(&["ABA"]), "ABA");
        assert_eq!(said(&["wrong: aBab", "c!", "ab"]), "wrong: *****!ab");
        assert_eq!(said(&["abABabc", "aBaBd"]), "ab*****aBaBd", "what is not the secret comes as it came");
        assert_eq!(String::from_utf8(redacted(b"AB", &[b"CAB"])), Ok("CAB".into()), "too short to be looked for");
        // What has come to nothing is no beginning of what follows.
        assert_eq!(String::from_utf8(redacted(b"AABB", &[b"AABABB"])), Ok("AABABB".into()));
    }

    #[test]
    fn neither_flow_control_nor_a_pause_brings_the_secret_through() {
        let said = |chunks: &[&str]| {
            let chunks: Vec<&[u8]> = chunks.iter().map(|chunk| chunk.as_bytes()).collect();
            String::from_utf8(redacted(b"AXIO-2010", &chunks)).expect("ASCII")
        };
        assert_eq!(said(&["wrong: AXIO-\x13\x1120\x1310\x11\r\n"]), "wrong: *****\x13\x11**\x13**\x11\r\n");
        assert_eq!(said(&["A\x13X\x11IO-2010"]), "A\x13X\x11*******", "its first characters could be anything");
        assert_eq!(said(&["AXIO-", "", "20", "", "10"]), "*********");
        assert_eq!(said(&["AX", "", "TC4CO"]), "AXTC4CO", "the beginning of a name, not of a secret");
        assert_eq!(said(&["AXIO-", "", "AXIO-2010"]), "**************");
    }

    #[test]
    fn flow_control_does_not_wait() {
        let mut redactor = Redactor::default();
        redactor.look_for(b"AXIO-2010");
        assert_eq!(redactor.push(b"AX\x13"), [(b"AX\x13".to_vec(), Secrecy::Open)]);
        let told = redactor.push(b"IO\x11");
        assert_eq!(told, [(b"IO".to_vec(), Secrecy::Secret), (b"\x11".to_vec(), Secrecy::Open)]);
    }

    #[test]
    fn what_may_be_its_beginning_is_kept_back_and_given_once() {
        let mut redactor = Redactor::default();
        assert!(!redactor.keeps_back());
        redactor.look_for(b"AXIO-2010");
        assert!(!redactor.keeps_back());
        assert_eq!(redactor.push(b"no AXI"), [(b"no ".to_vec(), Secrecy::Open)]);
        assert!(redactor.keeps_back());
        assert_eq!(redactor.flush(), [(b"AXI".to_vec(), Secrecy::Open)]);
        assert!(!redactor.keeps_back());
        assert_eq!(redactor.flush(), []);
        assert_eq!(redactor.push(b"O-2010"), [(b"O-2010".to_vec(), Secrecy::Secret)], "the rest is known as such");
    }

    #[test]
    fn another_secret_loses_nothing_that_was_kept_back_and_too_short_a_one_is_none() {
        let mut redactor = Redactor::default();
        redactor.look_for(b"AXIO-2010");
        assert_eq!(redactor.push(b"AXIO"), []);
        redactor.look_for(b"1234");
        assert!(redactor.keeps_back());
        let both =
            [(b"AXIO".to_vec(), Secrecy::Secret), (b"-".to_vec(), Secrecy::Open), (b"1234".to_vec(), Secrecy::Secret)];
        assert_eq!(redactor.push(b"-1234"), both);
        assert_eq!(redactor.push(b"12"), []);
        redactor.look_for(b"AXIO");
        assert_eq!(redactor.flush(), [(b"12".to_vec(), Secrecy::Open)]);
        redactor.look_for(b"");
        redactor.look_for(b"x");
        assert_eq!(redactor.push(b"AXIO"), [(b"AXIO".to_vec(), Secrecy::Secret)]);
    }

    #[test]
    fn a_text_is_scrubbed() {
        let mut redactor = Redactor::default();
        redactor.look_for(b"AXIO-2010");
        let mut text = "no such password: AXIO-2010".to_owned();
        redactor.scrub(&mut text);
        assert_eq!(text, "no such password: *********");
        let mut text = "\u{e4}\u{f6} axio-2010: AXIO-2010AXIO-201".to_owned();
        redactor.scrub(&mut text);
        assert_eq!(text, "\u{e4}\u{f6} *********: *********AXIO-201");
        // A password of stars looks like what replaces it.
        redactor.look_for(b"****");
        let mut text = "***** ****".to_owned();
        redactor.scrub(&mut text);
        assert_eq!(text, "***** ****");
        redactor.look_for("Gr\u{fc}n4".as_bytes());
        let mut text = "GR\u{fc}N4".to_owned();
        redactor.scrub(&mut text);
        assert_eq!(text, "*****");
    }

    proptest! {
        #[test]
        fn nothing_is_lost_and_the_secret_never_comes_through(
            secret in "[ab]{4,6}",
            text in "[abcAB\x11\x13]{0,60}",
            cuts in prop::collection::vec(0usize..60, 0..6),
        ) {
            // A place that is cut twice is one at which the line falls silent.
            let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(text.len())).collect();
            cuts.extend([0, text.len()]);
            cuts.sort_unstable();
            let chunks: Vec<&[u8]> = cuts.windows(2).map(|pair| &text.as_bytes()[pair[0]..pair[1]]).collect();
            let found = redacted(secret.as_bytes(), &chunks);
            prop_assert_eq!(found.len(), text.len());
            let shown: Vec<u8> = found.iter().copied().filter(|byte| !matches!(*byte, XON | XOFF)).collect();
            prop_assert!(!shown.windows(secret.len()).any(|part| part.eq_ignore_ascii_case(secret.as_bytes())));
            for (was, is) in text.bytes().zip(&found) {
                prop_assert!(was == *is || *is == REDACTED);
            }
        }
    }
}
