//! Keeps the password to the line: decides which bytes are secret, of those that are typed and of those that come.
//!
//! It recognises the password in three ways, none of which needs the others:
//! - *The question.* As long as the unit asks for the password, what is typed is secret. The session reports the
//!   question and its end; rows of the stream that go on meanwhile do not end it.
//! - *The keys.* After an L of the menu what follows up to Enter may be the password, even if the unit asks for it in
//!   unknown words; and a password that has been begun goes on up to its Enter, whatever becomes of the question.
//! - *The answers.* After a secret that was typed or sent comes its echo, up to the end of the line: the [`Echo`]
//!   distinguishes it from what the unit says itself. Wherever else the unit repeats it, the [`Redactor`] finds it.
//!
//! What always holds:
//! - What has been called secret is never called open later, and nothing that is typed or received is lost by being
//!   secret.
//! - A limit makes more secret, never less: what is typed beyond [`LONGEST`] is as secret as what is before it.
//! - It has no `Debug`, so that nothing that holds it can be printed with the password in it.

use zeroize::Zeroizing;

use super::echo::Echo;
use super::keys::{KeyReader, Stroke, TypedBy};
use super::redactor::{LONGEST, Piece, Redactor};
use crate::endpoint::Secrecy;
use crate::time::{Duration, Instant};

/// How long bytes that may be the beginning of the password wait for the next ones.
const ECHO_QUIET: Duration = Duration::from_millis(30);

/// What is secret in a conversation with a unit.
#[derive(Default)]
pub(super) struct PasswordGuard {
    asked: Asked,
    /// A password has been typed or sent, and the unit may echo it until its line ends.
    echoes: bool,
    echo: Echo,
    typed: Typed,
    redactor: Redactor,
    /// When bytes that are kept back are handed out.
    due: Option<Instant>,
}

/// Whether the unit asks for the password.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Asked {
    #[default]
    No,
    Yes,
    /// The unit was asking, or a password was being typed, when the link was lost. A replugged adapter does not reset
    /// the unit, so it may still be asking, until Enter is typed or the unit says something else.
    Perhaps,
}

/// What has been typed by hand since the last Enter.
#[derive(Default)]
enum Typed {
    /// Nothing that may be a password.
    #[default]
    Open,
    /// What may be a password: it goes on up to Enter.
    Secret(TypedSecret),
    /// Nothing after an L and its Enter. The Enter may have come before the question, as from a script that sends
    /// everything at once: the next line may still be the password.
    Nothing,
}

/// Whether these can be keys of the menu, or of the view.
fn are_menu_keys(keys: &[u8]) -> bool {
    keys.iter().all(|key| b"mvdtslx".contains(&key.to_ascii_lowercase()))
}

impl PasswordGuard {
    /// This is the password: wherever the unit repeats it, it is secret.
    pub(super) fn look_for(&mut self, secret: &[u8]) {
        self.redactor.look_for(secret);
    }

    /// The unit asks for the password.
    pub(super) fn question(&mut self) {
        self.asked = Asked::Yes;
    }

    /// The unit has gone on to something else.
    pub(super) fn question_over(&mut self) {
        let is_answered_perhaps = self.asked == Asked::Perhaps && matches!(self.typed, Typed::Secret(_));
        if !is_answered_perhaps {
            self.asked = Asked::No;
        }
    }

    /// The unit shows its menu, or has started: it cannot be asking any more. What was typed while that was unknown
    /// were keys of the menu.
    pub(super) fn at_menu(&mut self) {
        if self.asked != Asked::Perhaps {
            return;
        }
        self.asked = Asked::No;
        if let Typed::Secret(secret) = std::mem::take(&mut self.typed) {
            self.echoes = false;
            for stroke in KeyReader::default().strokes(&secret.kept, TypedBy::Hand) {
                self.typed(&stroke);
            }
        }
    }

    /// Whether the unit asks, or may be asking.
    pub(super) fn is_asked(&self) -> bool {
        self.asked != Asked::No
    }

    /// Whether the unit asks for a password, or may be echoing one.
    pub(super) fn is_open(&self) -> bool {
        self.is_asked() || self.echoes
    }

    /// The link was lost. What had been typed of a password is not part of the next one, but the unit may still be
    /// asking for it. The known password is still looked for.
    pub(super) fn cut_off(&mut self) {
        if self.is_asked() || matches!(self.typed, Typed::Secret(_)) {
            self.asked = Asked::Perhaps;
        }
        (self.echoes, self.typed) = (false, Typed::Open);
    }

    /// Whether the next keys are secret, typed by hand or of a file that is sent as if typed.
    pub(super) fn secrecy_of(&self, stroke: &Stroke<'_>) -> Secrecy {
        let is_secret = match self.typed {
            _ if self.is_open() => true,
            Typed::Secret(_) => true,
            Typed::Nothing => !are_menu_keys(stroke.keys),
            Typed::Open => false,
        };
        if is_secret { Secrecy::Secret } else { Secrecy::Open }
    }

    /// These keys have been typed. [Ask](PasswordGuard::secrecy_of) before whether they are secret.
    pub(super) fn typed(&mut self, stroke: &Stroke<'_>) {
        let is_secret = self.secrecy_of(stroke) == Secrecy::Secret;
        let typed = match std::mem::take(&mut self.typed) {
            Typed::Secret(secret) => Typed::Secret(secret),
            _ if is_secret => Typed::Secret(TypedSecret::new()),
            Typed::Nothing if stroke.keys.is_empty() => return self.typed = Typed::Nothing,
            Typed::Nothing => Typed::Open,
            other => other,
        };
        self.typed = match typed {
            Typed::Secret(mut secret) => {
                if !stroke.keys.is_empty() {
                    // What is typed after a password whose echo has not ended may come back with it.
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
            Typed::Open | Typed::Nothing => match stroke.opens {
                Some(_) => Typed::Secret(TypedSecret::new()),
                None => Typed::Open,
            },
        };
        if !stroke.enter.is_empty() {
            if self.asked == Asked::Perhaps {
                self.asked = Asked::No;
            }
            self.typed = match &self.typed {
                Typed::Secret(secret) if secret.is_empty() => Typed::Nothing,
                _ => Typed::Open,
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

    /// Takes some of the bytes that have come. Returns those of which it is known whether they are secret, in their
    /// order. To be called until none are left. What it returns has to be handled before the next call, since a job may
    /// answer it with a secret.
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

    /// Looks for the known password in what is not an echo. It need not be the one that is echoed.
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

    /// Hands out what looked like the beginning of the password, since nothing has followed it for long enough.
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

/// What has been typed of a password by hand, as the unit has it: with backspaces applied.
///
/// It keeps as much as is ever compared. Further keys are only counted, so that backspaces work; they are as secret as
/// the others. So a key that is held down at the question does not use up memory.
struct TypedSecret {
    kept: Zeroizing<Vec<u8>>,
    /// How many more have been typed.
    beyond: usize,
}

impl TypedSecret {
    fn new() -> Self {
        // Allocated in full size: a vector that grows leaves unwiped copies behind.
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
        type_with(&mut KeyReader::default(), guard, typed)
    }

    fn type_with(reader: &mut KeyReader, guard: &mut PasswordGuard, typed: &str) -> String {
        let mut shown = String::new();
        for stroke in reader.strokes(typed.as_bytes(), TypedBy::Hand) {
            let open = guard.secrecy_of(&stroke) == Secrecy::Open;
            shown.extend(stroke.keys.iter().map(|&key| char::from(if open { key } else { REDACTED })));
            shown.extend(stroke.enter.iter().map(|_| '/'));
            guard.typed(&stroke);
        }
        shown
    }

    /// What comes out for what comes in one piece, with stars for what is secret.
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
    fn after_an_l_of_the_menu_all_is_secret_up_to_enter_and_an_l_in_a_word_is_not_a_key() {
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
        let mut reader = KeyReader::default();
        let shown: String = "mlAX\r".chars().map(|key| type_with(&mut reader, &mut guard, &key.to_string())).collect();
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
    fn after_enter_what_the_unit_says_itself_is_no_echo_of_single_keys() {
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "lAXIO-2010\r");
        assert_eq!(hear(&mut guard, "Access denied\r\n"), "Access denied\r\n");
        // And nothing is an echo of the password before.
        type_in(&mut guard, "lGeheim-2\r");
        assert_eq!(hear(&mut guard, "AXTC4CO refuses\r\n"), "AXTC4CO refuses\r\n");
    }

    #[test]
    fn keys_that_are_typed_before_the_echo_has_ended_do_not_bring_it_to_light() {
        let masked = "A*X*I*O*-*2*0*1*0*\r\n";
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "lAXIO-2010\rm");
        assert_eq!(hear(&mut guard, masked), "******************\r\n");
        // A line that ends in the middle of the password does not either.
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "lAXI");
        assert_eq!(hear(&mut guard, "\r\n"), "\r\n");
        type_in(&mut guard, "O-2010\r");
        assert_eq!(hear(&mut guard, masked), "******************\r\n");
        // Even within an escape sequence.
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "lAX");
        assert_eq!(hear(&mut guard, "AX\x1b[\r\n"), "**\x1b[\r\n");
        type_in(&mut guard, "2010\r");
        assert_eq!(hear(&mut guard, "2010\r\n"), "****\r\n");
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
        assert_eq!(type_in(&mut guard, "AXIO-2010\r"), "*********/");
        assert_eq!(hear(&mut guard, "\r\nAXIO-2010"), "\r\n*********", "and not AXIAXIO-2010");
        // Nothing was under way.
        let mut guard = PasswordGuard::default();
        type_in(&mut guard, "m");
        guard.cut_off();
        assert!(!guard.is_open());
        assert_eq!(type_in(&mut guard, "ml"), "ml");
    }

    #[test]
    fn a_question_that_was_open_when_the_link_was_lost_may_be_so_still() {
        let lost = |typed: &str| {
            let mut guard = PasswordGuard::default();
            guard.question();
            type_in(&mut guard, typed);
            guard.cut_off();
            guard
        };
        for typed in ["", "AXI", "AXIO-2010\r"] {
            let mut guard = lost(typed);
            assert!(guard.is_open(), "{typed:?}");
            // Enter answers it, whatever it was.
            assert_eq!(type_in(&mut guard, "O-2010\r"), "******/", "{typed:?}");
            assert_eq!(hear(&mut guard, "\r\n"), "\r\n");
            assert!(!guard.is_open(), "{typed:?}");
            assert_eq!(type_in(&mut guard, "m"), "m");
        }
        // The unit says something else before anything is typed.
        let mut guard = lost("");
        guard.question_over();
        assert_eq!(type_in(&mut guard, "ml"), "ml");
        // A line in the middle of what is typed may have nothing to do with it.
        let mut guard = lost("");
        assert_eq!(type_in(&mut guard, "AXIO"), "****");
        guard.question_over();
        assert_eq!(type_in(&mut guard, "-2010\r"), "*****/");
        // The unit's menu shows that what was typed were keys.
        let mut guard = lost("");
        assert_eq!(type_in(&mut guard, "m"), "*");
        guard.at_menu();
        assert!(!guard.is_open());
        assert_eq!(type_in(&mut guard, "lAXIO-2010\r"), "l*********/");
        assert_eq!(hear(&mut guard, "\r\nAXIO-2010"), "\r\n*********", "and not mlAXIO-2010");
        let mut guard = lost("");
        assert_eq!(type_in(&mut guard, "ml"), "**");
        guard.at_menu();
        assert_eq!(type_in(&mut guard, "AXIO-2010\r"), "*********/", "the L was one of the menu");
    }
}
