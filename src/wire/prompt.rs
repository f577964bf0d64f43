//! What a unit asks for.
//!
//! Prompts are known by what they offer, never by their place in a dialogue (their wording is lost with the manual's
//! figures). A question that is not recognised is not a prompt: the session then leaves the dialogue instead of
//! guessing.

use super::words::Words;

/// A question of the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// The password of L.
    Password,
    /// Field value or process value, and which key stands for which.
    Source(SourceKeys),
    /// The repetition time in milliseconds.
    Period,
    /// Whether the defaults shall be restored; `Yes` does it (AXTC4CO manual, section 4.1.2).
    ConfirmDefaults,
    /// Any key, to continue.
    AnyKey,
    /// The bootloader wants the file; its text may come without a line end.
    WaitingForFile,
}

/// The keys that answer the question for the stream's source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceKeys {
    /// Field value, object 6100h.
    pub field_value: char,
    /// Process value, object 7130h.
    pub process_value: char,
}

/// The question, if it is one we know.
pub(super) fn recognise(text: &str, words: &Words) -> Option<Prompt> {
    match super::boot::recognise(text, words) {
        Some(super::LoaderText::Waiting) => return Some(Prompt::WaitingForFile),
        Some(super::LoaderText::AnyKey) => return Some(Prompt::AnyKey),
        Some(_) => return None,
        None => {}
    }
    // The echo of the key may come before it: "lPassword:".
    if words.iter().any(|word| ["password", "passcode", "pwd"].iter().any(|asked| word.contains(asked))) {
        return Some(Prompt::Password);
    }
    let joined = Words::joined(text);
    let names_both = joined.has_any(&["field", "fv"]) && joined.has_any(&["process", "pv"]);
    let names_both = names_both || offers(text, 'f', 'p');
    if names_both {
        return source_keys(text).map(Prompt::Source);
    }
    let asks_for_time = words.has_any(&["rate", "period", "interval", "repetition", "time", "every"]);
    if asks_for_time && words.has_any(&["ms", "msec", "millisec", "milliseconds"]) {
        return Some(Prompt::Period);
    }
    if words.iter().any(|word| word == "yes") {
        return Some(Prompt::ConfirmDefaults);
    }
    None
}

/// Whether a text is worded as a question, and not as a sentence about its subject: it ends with a sign that something
/// is to come, or tells the user to give it ("Enter the password", "Type Yes to confirm.").
pub fn is_question(text: &str) -> bool {
    text.trim_end().ends_with(['?', ':', '>', ')', ']', '='])
        || Words::of(text).iter().any(|word| matches!(word, "enter" | "type" | "input"))
}

/// Whether a question after an L asks for the password in other words: `Code:`, `PW>`. It has to look like a question,
/// and to be about nothing else: a key to be pressed, an error's code.
pub(super) fn asks_password_after_load(text: &str) -> bool {
    if !text.trim_end().ends_with([':', '>']) {
        return false;
    }
    let words = Words::of(text);
    if super::boot::recognise(text, &words).is_some() || words.has_any(&ABOUT_SOMETHING_ELSE) {
        return false;
    }
    // The echo of the key may come before it: "lPW:".
    words.iter().any(|word| SECRETS.iter().any(|name| word == *name || word.strip_prefix('l') == Some(name)))
}

/// What a password may be called where nothing else can be asked for.
const SECRETS: [&str; 11] =
    ["password", "passcode", "passphrase", "passwd", "passwort", "kennwort", "pass", "code", "pin", "pw", "key"];

/// Words that show that a text asks for something else, or is not a question.
const ABOUT_SOMETHING_ELSE: [&str; 12] =
    ["any", "press", "hit", "strike", "error", "product", "vendor", "order", "wrong", "invalid", "yes", "sure"];

/// Which keys a question for the source offers: `(F)ield value or (P)rocess value`, `1=FV 6100h, 2=PV`,
/// `field value <F> / process value <P>`, `F/P`. Both keys are in the same place relative to their names.
fn source_keys(text: &str) -> Option<SourceKeys> {
    let lower: Vec<char> = text.to_lowercase().chars().collect();
    let offered = [bracketed, before, after].into_iter().find_map(|place: Place| {
        let field_value = offered_key(&lower, &["field", "fv"], place)?;
        let process_value = offered_key(&lower, &["process", "pv"], place)?;
        (field_value != process_value).then_some(SourceKeys { field_value, process_value })
    });
    let letters = SourceKeys { field_value: 'f', process_value: 'p' };
    offered.or_else(|| offers(text, 'f', 'p').then_some(letters))
}

/// Looks for the key of a name at some place in a text.
type Place = fn(&[char], &[char]) -> Option<char>;

fn offered_key(text: &[char], names: &[&str], place: Place) -> Option<char> {
    names.iter().find_map(|name| place(text, &name.chars().collect::<Vec<char>>()))
}

/// The name's first letter in brackets: `(F)ield`, `[f]ield`, `<F>ield`.
fn bracketed(text: &[char], name: &[char]) -> Option<char> {
    text.windows(3).enumerate().find_map(|(at, window)| {
        let rest = &text[at + 3..];
        (is_bracket(window[0]) && window[1] == name[0] && is_bracket(window[2]) && rest.starts_with(&name[1..]))
            .then_some(window[1])
    })
}

/// `1=FV`, `f - field value`, `[1] Field value`: nothing but signs between the key and the name.
fn before(text: &[char], name: &[char]) -> Option<char> {
    let at = text.windows(name.len()).position(|window| window == name)?;
    let key = text[..at].iter().rposition(|c| c.is_alphanumeric())?;
    let gap = &text[key + 1..at];
    (stands_alone(text, key) && gap.iter().any(|&c| "=-:)]>.".contains(c))).then(|| text[key])
}

/// `FV=1`, `field value (1)`, `Field value: f`: in brackets, or after a sign, before the next entry.
fn after(text: &[char], name: &[char]) -> Option<char> {
    let end = text.windows(name.len()).position(|window| window == name)? + name.len();
    let sign = end + text[end..].iter().position(|c| "=(:[<".contains(*c))? + 1;
    let key = sign + text[sign..].iter().position(|c| c.is_alphanumeric())?;
    (stands_alone(text, key) && !text[end..key].contains(&',')).then(|| text[key])
}

/// Whether the letter or digit is not part of a longer word.
fn stands_alone(text: &[char], at: usize) -> bool {
    let part = |neighbour: Option<&char>| neighbour.is_some_and(|c| c.is_alphanumeric());
    !part(at.checked_sub(1).and_then(|before| text.get(before))) && !part(text.get(at + 1))
}

/// Whether the text offers two keys as `F/P` or `(f,p)`.
fn offers(text: &str, first: char, second: char) -> bool {
    let lower: Vec<char> = text.to_lowercase().chars().collect();
    lower.windows(3).enumerate().any(|(at, window)| {
        window[0] == first
            && window[2] == second
            && matches!(window[1], '/' | ',' | '|')
            && stands_alone(&lower, at)
            && stands_alone(&lower, at + 2)
    })
}

fn is_bracket(c: char) -> bool {
    matches!(c, '(' | ')' | '[' | ']' | '<' | '>' | '\'' | '"')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prompts_are_known_by_what_they_offer() {
        let keys = |field_value, process_value| Some(Prompt::Source(SourceKeys { field_value, process_value }));
        let table = [
            ("Password: ", Some(Prompt::Password)),
            ("Enter the password >", Some(Prompt::Password)),
            ("lPassword: ", Some(Prompt::Password)),
            ("(F)ield value or (P)rocess value? ", keys('f', 'p')),
            ("1=FV 6100h, 2=PV 7130h: ", keys('1', '2')),
            ("Send field value (1) or process value (2)? ", keys('1', '2')),
            ("F - field value, P - process value", keys('f', 'p')),
            ("Source [F/P]: ", keys('f', 'p')),
            ("Field value <F> / process value <P>: ", keys('f', 'p')),
            ("process value: 2 / field value: 1 ?", keys('1', '2')),
            ("Repetition rate in ms (1..60000): ", Some(Prompt::Period)),
            ("Interval [milliseconds]? ", Some(Prompt::Period)),
            ("Restore defaults? Enter Yes: ", Some(Prompt::ConfirmDefaults)),
            ("Hit any key ", Some(Prompt::AnyKey)),
            ("Waiting for application S-Record.", Some(Prompt::WaitingForFile)),
            ("Field value or process value? ", None),
            ("....", None),
            ("> ", None),
        ];
        for (text, expected) in table {
            assert_eq!(recognise(text, &Words::of(text)), expected, "{text:?}");
        }
    }

    #[test]
    fn a_question_is_known_by_its_last_sign_or_by_what_it_tells_the_user_to_do() {
        for text in [
            "Password:",
            "Restore? (Yes/No) ",
            "Interval [ms]",
            "Enter the password",
            "Please input the password.",
            "Type Yes to restore the defaults.",
        ] {
            assert!(is_question(text), "{text:?}");
        }
        for text in ["", "Password accepted", "About the password.", "Yes, restoring", "Re-entered"] {
            assert!(!is_question(text), "{text:?}");
        }
    }

    #[test]
    fn after_an_l_a_password_may_have_other_names() {
        for text in [
            "Please enter the access code you have received from us (case sensitive): ",
            "Code: ",
            "PW:",
            "lPW:",
            "PIN >",
            "Access key> ",
            "Passwort:",
        ] {
            assert!(asks_password_after_load(text), "{text:?}");
        }
        for text in [
            "Code",
            "PIN?",
            "Your choice: ",
            "Decode: ",
            "Press a key to go on:",
            "Hit Enter key >",
            "Error code: ",
            "Wrong code:",
            "Erase the code? Enter Yes: ",
            "Waiting for application S-Record, code:",
            ":",
        ] {
            assert!(!asks_password_after_load(text), "{text:?}");
        }
    }
}
