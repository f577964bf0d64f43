//! What a unit asks for.
//!
//! Prompts are known by what they offer, never by their place in a dialogue (their wording is lost with the manual's
//! figures). What cannot be told is no prompt: the session then leaves the dialogue instead of guessing.

use super::words::Words;

/// A question of the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// The password of L.
    Password,
    /// Field value or process value, and which key says what.
    Source(SourceKeys),
    /// The repetition time in milliseconds.
    Period,
    /// Whether the defaults shall be restored; `Yes` does it (AXTC4CO manual, section 4.1.2).
    ConfirmDefaults,
    /// Any key goes on.
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
    if words.has_any(&["password", "passcode", "pwd"]) {
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

/// Which keys a question for the source offers: `(F)ield value or (P)rocess value`, `1=FV 6100h, 2=PV`, `F/P`.
fn source_keys(text: &str) -> Option<SourceKeys> {
    let lower: Vec<char> = text.to_lowercase().chars().collect();
    let field = offered_key(&lower, &["field", "fv"]);
    let process = offered_key(&lower, &["process", "pv"]);
    match (field, process) {
        (Some(field_value), Some(process_value)) if field_value != process_value => {
            Some(SourceKeys { field_value, process_value })
        }
        _ if offers(text, 'f', 'p') => Some(SourceKeys { field_value: 'f', process_value: 'p' }),
        _ => None,
    }
}

/// The key offered for one of these names: bracketed as the name's first letter, or standing before or behind it.
fn offered_key(text: &[char], names: &[&str]) -> Option<char> {
    names.iter().find_map(|name| {
        let name: Vec<char> = name.chars().collect();
        // `(F)ield`, `[f]ield`, `<F>ield`
        let bracketed = text.windows(3).enumerate().find_map(|(at, window)| {
            let rest = &text[at + 3..];
            (is_bracket(window[0]) && window[1] == name[0] && is_bracket(window[2]) && rest.starts_with(&name[1..]))
                .then_some(window[1])
        });
        if bracketed.is_some() {
            return bracketed;
        }
        let at = text.windows(name.len()).position(|window| window == name.as_slice())?;
        // `1=FV`, `f - field value`, `[1] Field value`: nothing but signs between the key and the name.
        let before = text[..at].iter().rposition(|c| c.is_alphanumeric()).filter(|&key| {
            let gap = &text[key + 1..at];
            stands_alone(text, key) && gap.iter().any(|&c| "=-:)]>.".contains(c))
        });
        // `FV=1`, `field value (1)`, `Field value: f`
        let behind = text[at + name.len()..]
            .iter()
            .position(|c| "=(:[<".contains(*c))
            .map(|sign| at + name.len() + sign + 1)
            .and_then(|from| text[from..].iter().position(|c| c.is_alphanumeric()).map(|key| from + key))
            .filter(|&key| stands_alone(text, key) && !text[at..key].contains(&','));
        before.or(behind).map(|key| text[key])
    })
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
            ("(F)ield value or (P)rocess value? ", keys('f', 'p')),
            ("1=FV 6100h, 2=PV 7130h: ", keys('1', '2')),
            ("Send field value (1) or process value (2)? ", keys('1', '2')),
            ("F - field value, P - process value", keys('f', 'p')),
            ("Source [F/P]: ", keys('f', 'p')),
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
}
