//! Keeps the password to the line: decides which bytes are secret, of those that are typed and of those that come.
//!
//! It knows the password from three sides, and none of them needs the others:
//! - *The question.* As long as the unit asks for the password, what is typed is secret. The session hears the question
//!   and its end; rows of the stream that go on meanwhile are no end.
//! - *The keys.* Behind an L of the menu what follows up to Enter may be the password, even if the unit asks for it in
//!   words that nobody knows; and a password that has been begun is one up to its Enter, whatever becomes of the question.
//! - *The answers.* Behind a secret that was typed or sent comes its echo, up to the end of the line: the [`Echo`] tells
//!   it from what the unit says itself. Wherever else the unit repeats it, the [`Redactor`] finds it.
//!
//! What holds whatever happens:
//! - What has been called secret is never called open later, and nothing that is typed or received is lost by being secret.
//! - A limit makes more secret, never less: what is typed beyond [`LONGEST`] is as secret as what is before it.
//! - It has no `Debug`, so that nothing that holds it can be printed with the password in it.

use zeroize::Zeroizing;

use super::echo::Echo;
use super::redactor::{LONGEST, Piece, Redactor};
use crate::endpoint::Secrecy;
use crate::time::{Duration, Instant};

/// How long bytes that may be the beginning of the password wait for the next ones.
const ECHO_QUIET: Duration = Duration::from_millis(30);

/// What is secret in a conversation with a unit.
#[derive(Default)]
pub(super) struct PasswordGuard {
    /// The unit asks for the password.
    asked: bool,
    /// A password has been typed or sent, and the unit may echo it until its line ends.
    echoes: bool,
    echo: Echo,
    typed: Typed,
    redactor: Redactor,
    /// When bytes that are kept back are handed out.
    due: Option<Instant>,
}

/// What has been typed by hand since the last Enter.
#[derive(Default)]
enum Typed {
    /// Nothing but what can be keys of the menu; an `l` among them would have been the last.
    #[default]
    MenuKeys,
    /// Words of some kind: an `l` in them is no key.
    Text,
    /// What may be a password: it goes on up to Enter.
    Secret(TypedSecret),
    /// Nothing behind an L and its Enter. The Enter may have come before the question, as from a script that sends
    /// everything at once: the next line may be the password still.
    Nothing,
}

/// Whether these can be keys of the menu, or of the view.
fn are_menu_keys(keys: &[u8]) -> bool {
    keys.iter().all(|key| b"mvdtslx".contains(&key.to_ascii_lowercase()))
}

/// A part of what was typed, which is secret or open as a whole.
pub(super) struct Stroke<'a> {
    /// The keys.
    pub(super) keys: &'a [u8],
    /// The Enter behind them, or nothing. It is never secret.
    pub(super) enter: &'a [u8],
}

/// What was typed in parts: Enter ends a password, and behind an L begins what may be one.
pub(super) fn strokes(typed: &[u8]) -> impl Iterator<Item = Stroke<'_>> {
    // Enter is CR; a script may send the line feeds of its file.
    typed.split_inclusive(|key| matches!(key, b'\r' | b'\n' | b'l' | b'L')).map(|part| {
        let (keys, enter) = part.split_at(part.len() - usize::from(part.ends_with(b"\r") || part.ends_with(b"\n")));
        Stroke { keys, enter }
    })
}

impl PasswordGuard {
    /// This is the password: wherever the unit repeats it, it is secret.
    pub(super) fn look_for(&mut self, secret: &[u8]) {
        self.redactor.look_for(secret);
    }

    /// The unit asks for the password.
    pub(super) fn question(&mut self) {
        self.asked = true;
    }

    /// It has gone on to something else.
    pub(super) fn question_over(&mut self) {
        self.asked = false;
    }

    /// Whether it asks.
    pub(super) fn is_asked(&self) -> bool {
        self.asked
    }

    /// Whether a password is in the air: the unit asks, or may be echoing one.
    pub(super) fn is_open(&self) -> bool {
        self.asked || self.echoes
    }

    /// The conversation was cut off: nothing that was under way in it goes on. What is looked for stays.
    pub(super) fn cut_off(&mut self) {
        (self.asked, self.echoes, self.typed) = (false, false, Typed::MenuKeys);
    }

    /// What the next keys are, typed by hand or of a file that is sent as if typed.
    pub(super) fn secrecy_of(&self, stroke: &Stroke<'_>) -> Secrecy {
        let is_secret = match self.typed {
            _ if self.is_open() => true,
            Typed::Secret(_) => true,
            Typed::Nothing => !are_menu_keys(stroke.keys),
            Typed::MenuKeys | Typed::Text => false,
        };
        if is_secret { Secrecy::Secret } else { Secrecy::Open }
    }

    /// These keys have been typed; what they are was [asked](PasswordGuard::secrecy_of) before.
    pub(super) fn typed(&mut self, stroke: &Stroke<'_>) {
        let is_secret = self.secrecy_of(stroke) == Secrecy::Secret;
        let typed = match std::mem::take(&mut self.typed) {
            Typed::Secret(secret) => Typed::Secret(secret),
            _ if is_secret => Typed::Secret(TypedSecret::new()),
            Typed::Nothing if stroke.keys.is_empty() => return self.typed = Typed::Nothing,
            Typed::Nothing => Typed::MenuKeys,
            other => other,
        };
        self.typed = match typed {
            Typed::Secret(mut secret) => {
                if !stroke.keys.is_empty() {
                    // What is typed behind a password whose echo has not ended may come back with it.
                    if !self.echoes && secret.is_empty() {
                        self.echo.begin();
                    }
                    self.echo.typed(stroke.keys);
                    self.echoes = true;
                }
                secret.type_in(stroke.keys);
                if !stroke.enter.is_empty() {
                    self.echo.entered();
                    self.redactor.look_for(&secret.kept);
                }
                Typed::Secret(secret)
            }
            // An `l` in a word is no key.
            Typed::MenuKeys if are_menu_keys(stroke.keys) => match stroke.keys.last() {
                Some(b'l' | b'L') => Typed::Secret(TypedSecret::new()),
                Some(_) | None => Typed::MenuKeys,
            },
            Typed::MenuKeys | Typed::Text | Typed::Nothing => Typed::Text,
        };
        if !stroke.enter.is_empty() {
            self.typed = match &self.typed {
                Typed::Secret(secret) if secret.is_empty() => Typed::Nothing,
                _ => Typed::MenuKeys,
            };
        }
    }

    /// This secret has been queued by a job: what comes back until the next line end may echo it.
    pub(super) fn sent(&mut self, secret: &[u8]) {
        self.echo.begin();
        self.echo.typed(secret);
        self.echo.entered();
        self.echoes = true;
    }

    /// Takes some of the bytes that have come and gives those whose nature is known, in their order. To be called until
    /// none are left: each time what was given has been looked at first, since a job may answer to it with a secret.
    pub(super) fn take(&mut self, bytes: &mut &[u8]) -> Vec<Piece> {
        let is_line_end = |byte: &u8| matches!(byte, b'\r' | b'\n');
        if !self.echoes {
            let pieces = self.echo.flush();
            let mut pieces = self.redact(pieces);
            pieces.extend(self.redactor.push(std::mem::take(bytes)));
            return pieces;
        }
        let end = bytes.iter().position(is_line_end).unwrap_or(bytes.len());
        let (line, rest) = bytes.split_at(end);
        *bytes = rest;
        let mut pieces = self.echo.push(line);
        if !rest.is_empty() {
            self.echo.finish();
            pieces.extend(self.echo.flush());
            self.echoes = false;
        }
        self.redact(pieces)
    }

    /// What is no echo may hold the password all the same, or another one.
    fn redact(&mut self, pieces: Vec<Piece>) -> Vec<Piece> {
        let mut redacted = Vec::new();
        for (bytes, secrecy) in pieces {
            if secrecy == Secrecy::Open {
                redacted.extend(self.redactor.push(&bytes));
            } else {
                redacted.extend(self.redactor.flush());
                redacted.push((bytes, secrecy));
            }
        }
        redacted
    }

    /// All that has come has been taken: what is kept back waits for a moment from now on.
    pub(super) fn wait_for_more(&mut self, now: Instant) {
        self.due = (self.echo.keeps_back() || self.redactor.keeps_back()).then(|| now + ECHO_QUIET);
    }

    /// When what is kept back is to be [handed out](PasswordGuard::hand_out).
    pub(super) fn due(&self) -> Option<Instant> {
        self.due
    }

    /// What looked like the beginning of the password has stood still for long enough.
    pub(super) fn hand_out(&mut self) -> Vec<Piece> {
        self.due = None;
        let pieces = self.echo.flush();
        let mut pieces = self.redact(pieces);
        pieces.extend(self.redactor.flush());
        pieces
    }

    /// Replaces the password in a text.
    pub(super) fn scrub(&self, text: &mut String) {
        self.redactor.scrub(text);
    }
}

/// What has been typed of a password by hand, as the unit has it: with what was taken back taken back.
///
/// It keeps as much as is ever compared. Of the rest it only counts the keys, so that taking back works; they are as
/// secret as the others, and no memory grows by somebody who leans on a key where the unit asks.
struct TypedSecret {
    kept: Zeroizing<Vec<u8>>,
    /// How many more have been typed.
    beyond: usize,
}

impl TypedSecret {
    fn new() -> Self {
        // With its room from the beginning: a vector that grows leaves copies behind that nobody wipes.
        TypedSecret { kept: Zeroizing::new(Vec::with_capacity(LONGEST)), beyond: 0 }
    }

    fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    fn type_in(&mut self, keys: &[u8]) {
        for &key in keys {
            match key {
                0x08 | 0x7F if self.beyond > 0 => self.beyond -= 1,
                0x08 | 0x7F => {
                    self.kept.pop();
                }
                _ if self.kept.len() < LONGEST => self.kept.push(key),
                _ => self.beyond += 1,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::REDACTED;

    /// Types it, and gives what of it is secret as stars.
    fn type_in(guard: &mut PasswordGuard, typed: &str) -> String {
        let mut shown = String::new();
        for stroke in strokes(typed.as_bytes()) {
            let open = guard.secrecy_of(&stroke) == Secrecy::Open;
            shown.extend(stroke.keys.iter().map(|&key| char::from(if open { key } else { REDACTED })));
            shown.extend(stroke.enter.iter().map(|_| '/'));
            guard.typed(&stroke);
        }
        shown
    }

    /// What is left of what comes, in one piece.
    fn hear(guard: &mut PasswordGuard, said: &str) -> String {
        let mut bytes = said.as_bytes();
        let mut pieces = Vec::new();
        while !bytes.is_empty() {
            pieces.extend(guard.take(&mut bytes));
        }
        guard.wait_for_more(Instant::ZERO);
        shown(pieces)
    }

    fn shown(pieces: Vec<Piece>) -> String {
        let bytes = pieces.into_iter().flat_map(|(bytes, secrecy)| {
            bytes.into_iter().map(move |byte| if secrecy == Secrecy::Open { byte } else { REDACTED })
        });
        bytes.map(char::from).collect()
    }

    #[test]
    fn behind_an_l_of_the_menu_all_is_secret_up_to_enter_and_an_l_in_a_word_is_none() {
        for (typed, expected) in [
            ("mlAXIO-2010\rm", "ml*********/*"),
            ("L\rm", "L/m"),
            ("hello\rlx\r", "hello/l*/"),
            ("ml l\r", "ml**/"),
            ("vll\r", "vl*/"),
            ("all\rm", "all/m"),
            // A script sends everything at once, and its Enter before the question has come.
            ("l\rAXIO-2010\rm", "l/*********/*"),
            ("T\rL\r\rAXIO-2010\r", "T/L//*********/"),
            ("m\nL\n\nAXIO-2010\n", "m/L//*********/"),
            ("L\r\nAXIO-2010\r\n", "L//*********//"),
            ("L\rmt\rpx\r", "L/mt/px/"),
        ] {
            assert_eq!(type_in(&mut PasswordGuard::default(), typed), expected, "{typed:?}");
        }
        // One key at a time is the same.
        let mut guard = PasswordGuard::default();
        let shown: String = "mlAX\r".chars().map(|key| type_in(&mut guard, &key.to_string())).collect();
        assert_eq!(shown, "ml**/");
        assert!(guard.is_open(), "it may be echoed");
        assert_eq!(hear(&mut guard, "AX\r\nV"), "**\r\nV");
        assert!(!guard.is_open());
    }

    #[test]
    fn what_is_typed_at_the_question_is_secret_and_stays_so_when_the_question_is_over() {
        let mut guard = PasswordGuard::default();
        assert_eq!(type_in(&mut guard, "he"), "he");
        guard.question();
        assert!(guard.is_asked() && guard.is_open());
        assert_eq!(type_in(&mut guard, "AXI"), "***");
        guard.question_over();
        assert_eq!(hear(&mut guard, "\r\n"), "\r\n");
        assert!(!guard.is_open());
        assert_eq!(type_in(&mut guard, "O-2010\rm"), "******/*", "the rest of it, and what its echo may be among");
        assert_eq!(hear(&mut guard, "\r\nAXIO-2010!"), "\r\n*********!");
    }

    #[test]
    fn an_echo_is_secret_in_any_form_and_what_the_unit_says_around_it_is_not() {
        let mut guard = PasswordGuard::default();
        guard.look_for(b"AXIO-2010");
        assert_eq!(hear(&mut guard, "so AXIO-2010, and AX"), "so *********, and ");
        guard.sent(b"AXIO-2010");
        assert_eq!(hear(&mut guard, "io"), "", "it may be its beginning");
        assert_eq!(guard.due(), Some(Instant::ZERO + ECHO_QUIET));
        assert_eq!(shown(guard.hand_out()), "AX**", "what was kept back comes first");
        assert_eq!(hear(&mut guard, "-2010 ok."), "***** ok.");
        assert_eq!(hear(&mut guard, "\rio"), "\rio");
        assert!(!guard.is_open());
        // A unit that echoes nothing, not even the line end, and says it again on the same line.
        guard.sent(b"AXIO-2010");
        assert_eq!(hear(&mut guard, "Axis: no AXIO-2010 here\r\n"), "Axis: no ********* here\r\n");
    }

    #[test]
    fn what_was_kept_back_of_an_echo_when_the_link_was_lost_comes_first() {
        let mut guard = PasswordGuard::default();
        guard.sent(b"AXIO-2010");
        assert_eq!(hear(&mut guard, "AX"), "");
        guard.cut_off();
        assert_eq!(hear(&mut guard, "Hello"), "**Hello");
    }

    #[test]
    fn what_may_be_its_beginning_is_due_in_a_moment() {
        let mut guard = PasswordGuard::default();
        guard.look_for(b"AXIO-2010");
        assert_eq!((hear(&mut guard, "no AXI").as_str(), guard.due()), ("no ", Some(Instant::ZERO + ECHO_QUIET)));
        assert_eq!((shown(guard.hand_out()).as_str(), guard.due()), ("AXI", None));
    }

    #[test]
    fn beyond_what_is_compared_all_is_secret_still_and_can_be_taken_back() {
        let mut guard = PasswordGuard::default();
        let long = "x".repeat(LONGEST + 900);
        assert_eq!(type_in(&mut guard, &format!("l{long}")), format!("l{}", "*".repeat(long.len())));
        let Typed::Secret(secret) = &guard.typed else { panic!("it goes on") };
        assert_eq!((secret.kept.len(), secret.beyond), (LONGEST, 900));
        // All but four are taken back, among them those that were only counted.
        type_in(&mut guard, &format!("{}\r", "\x08".repeat(long.len() - 4)));
        assert_eq!(hear(&mut guard, "\r\nwas xxxx?"), "\r\nwas ****?");
        // Not taken back, it is found as far as it is compared.
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, &format!("l{long}\r"));
        assert_eq!(hear(&mut guard, &format!("\r\n{}!", "x".repeat(LONGEST))), format!("\r\n{}!", "*".repeat(LONGEST)));
    }

    #[test]
    fn what_was_under_way_when_the_link_was_lost_is_no_part_of_the_next_password() {
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "lAXI");
        guard.cut_off();
        assert!(!guard.is_open());
        assert_eq!(type_in(&mut guard, "mlAXIO-2010\r"), "ml*********/");
        assert_eq!(hear(&mut guard, "\r\nAXIO-2010"), "\r\n*********", "and not AXIAXIO-2010");
    }
}
