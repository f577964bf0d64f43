//! Banner and main menu (AXTC4CO manual, section 4.1).
//!
//! The keys, the subjects after them, the product name and a version of three numbers are fixed. Wording and layout are
//! unknown, so a line is taken for what its words and numbers say, in any order.

use super::words::Words;
use crate::version::Version;

/// An entry of the main menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MenuKey {
    /// M: print the menu.
    Menu,
    /// V: view the object dictionary.
    View,
    /// D: restore the default object dictionary.
    Default,
    /// T: toggle the data stream.
    Stream,
    /// S: show or stop diagnostics.
    Diagnostics,
    /// L: load new software.
    Load,
}

impl MenuKey {
    /// The key as it is printed.
    pub const fn letter(self) -> char {
        match self {
            MenuKey::Menu => 'M',
            MenuKey::View => 'V',
            MenuKey::Default => 'D',
            MenuKey::Stream => 'T',
            MenuKey::Diagnostics => 'S',
            MenuKey::Load => 'L',
        }
    }
}

/// Product and software version, as far as a line names them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SoftwareName {
    /// Product name, in the product file's spelling.
    pub product: Option<String>,
    /// Version of three numbers.
    pub version: Option<Version>,
    /// How sure it is that the version is the application's: a line may speak of hardware or of a protocol instead.
    pub confidence: Confidence,
}

/// How sure it is that a version is the application's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// The version stands alone.
    Bare,
    /// The line calls it software, firmware or application.
    Named,
    /// The line has the product name as well.
    WithProduct,
}

/// The menu entry a line offers: its key as a word of its own (or bracketed within its word), and its subject.
pub(super) fn key(line: &str, words: &Words) -> Option<MenuKey> {
    let subjects: [(char, &[&str], MenuKey); 6] = [
        ('v', &["view", "dictionary"], MenuKey::View),
        ('d', &["default", "restore"], MenuKey::Default),
        ('t', &["toggle", "stream"], MenuKey::Stream),
        ('s', &["diagnos"], MenuKey::Diagnostics),
        ('l', &["load", "software"], MenuKey::Load),
        ('m', &["menu"], MenuKey::Menu),
    ];
    // Entries may be numbered: `1. [V]iew`.
    let letter = |word: &str| word.chars().next().filter(|first| word.len() == 1 && first.is_alphabetic());
    let first = words.iter().take(3).find_map(letter)?;
    // A sentence about the subject is not an entry: the key leads the line, or is the last of a short one.
    let leads = line.trim_start().trim_start_matches(|c: char| !c.is_alphabetic()).to_lowercase();
    let alone = |c: char| leads.strip_prefix(c).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric));
    let subject_words = Words::joined(line);
    let pressed = words.get(0) == Some("press") || words.get(0) == Some("hit") || words.get(0) == Some("key");
    subjects
        .iter()
        .find(|(key, subject, _)| *key == first && (alone(*key) || pressed) && subject_words.has_any(subject))
        .map(|&(_, _, entry)| entry)
}

/// Product and version a line names.
pub(super) fn software(words: &Words, products: &[&str]) -> Option<SoftwareName> {
    let product = products
        .iter()
        .find(|product| words.iter().any(|word| word.eq_ignore_ascii_case(product)))
        .map(|product| (*product).to_owned());
    let mut found: Option<(Confidence, Version)> = None;
    for (at, word) in words.iter().enumerate() {
        let Ok(version) = word.parse::<Version>() else { continue };
        let own = match subject(words, at, product.as_deref()) {
            Some(Subject::Other) => continue,
            Some(Subject::Own) => true,
            Some(Subject::Product) | None => false,
        };
        let confidence = match (&product, own) {
            (Some(_), _) => Confidence::WithProduct,
            (None, true) => Confidence::Named,
            (None, false) => Confidence::Bare,
        };
        // "AXTC4CO 2.0.1, software 1.2.0": what is called software wins, else what comes first.
        if own {
            found = Some((confidence, version));
            break;
        }
        found = found.or(Some((confidence, version)));
    }
    let confidence = match (found, &product) {
        (Some((confidence, _)), _) => confidence,
        (None, Some(_)) => Confidence::WithProduct,
        (None, None) => return None,
    };
    Some(SoftwareName { product, version: found.map(|(_, version)| version), confidence })
}

/// What a version belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Subject {
    /// The application.
    Own,
    /// Whatever has the product's name.
    Product,
    /// Something else.
    Other,
}

/// What the version at this place in a line belongs to: what was named last before it, or first after it.
fn subject(words: &Words, version_at: usize, product: Option<&str>) -> Option<Subject> {
    let own = ["software", "firmware", "application", "program", "fw", "sw"];
    let other = ["hardware", "hw", "loader", "bootloader", "boot", "protocol", "profile", "manual", "board"];
    let of = |word: &str| {
        let any = |beginnings: &[&str]| beginnings.iter().any(|beginning| word.starts_with(beginning));
        if product.is_some_and(|product| product.eq_ignore_ascii_case(word)) {
            Some(Subject::Product)
        } else if any(&own) {
            Some(Subject::Own)
        // Next to a product's name "CANopen" says what kind of product that is.
        } else if any(&other) || (product.is_none() && word.starts_with("canopen")) {
            Some(Subject::Other)
        } else {
            None
        }
    };
    let before = || words.iter().take(version_at).filter_map(of).last();
    let after = || words.iter().skip(version_at + 1).find_map(of);
    // "V1.0.0 boot loader, V1.2.0 application": where a version comes first, each belongs to what follows it.
    let leads = words
        .iter()
        .find_map(|word| if word.parse::<Version>().is_ok() { Some(true) } else { of(word).map(|_| false) });
    if leads == Some(true) { after().or_else(before) } else { before().or_else(after) }
}

/// Whether the unit refuses what was typed.
pub(super) fn is_refusal(words: &Words) -> bool {
    if words.has_any(&REFUSALS) {
        return true;
    }
    if words.iter().any(|word| matches!(word, "cancelled" | "canceled" | "aborted" | "unchanged")) {
        return true;
    }
    // "Not in pre-operational state", "only available in ...": the two words have to be close to each other, or "not"
    // is about something else ("Do not switch off, preparing to restart").
    let list: Vec<&str> = words.iter().collect();
    let denies = |word: &str| {
        matches!(word, "allowed" | "accepted" | "available" | "possible" | "permitted" | "valid" | "correct" | "pre")
            || word.starts_with("preop")
    };
    list.iter().enumerate().any(|(at, word)| {
        let after = list[at + 1..].iter().take(REFUSAL_REACH);
        let before = list[..at].iter().rev().take(REFUSAL_REACH);
        match *word {
            "not" => after.into_iter().any(|word| denies(word)),
            "only" => after.chain(before).any(|word| denies(word)),
            _ => false,
        }
    })
}

/// Words that say no by themselves.
const REFUSALS: [&str; 7] = ["wrong", "invalid", "incorrect", "denied", "refused", "illegal", "rejected"];

/// Whether these bytes are a word that says no by itself, in any case. Keeps no copy of them.
pub fn is_word_of_refusal(word: &[u8]) -> bool {
    REFUSALS.iter().any(|refusal| word.eq_ignore_ascii_case(refusal.as_bytes()))
}

/// Words after "not", and on either side of "only", that say what is not so.
const REFUSAL_REACH: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_menu_entry_is_known_by_key_and_subject() {
        let table = [
            ("V - View Object Dictionary", Some(MenuKey::View)),
            ("  [D] Default Object Dictionary", Some(MenuKey::Default)),
            ("T – Toggle RS-232 Stream On/Off", Some(MenuKey::Stream)),
            ("s) show/stop diagnostics", Some(MenuKey::Diagnostics)),
            ("(L)oad new software", Some(MenuKey::Load)),
            ("Press M for the menu", Some(MenuKey::Menu)),
            ("L: LOAD NEW SOFTWARE", Some(MenuKey::Load)),
            ("1. [V]iew Object Dictionary", Some(MenuKey::View)),
            ("5) (L)oad new software", Some(MenuKey::Load)),
            ("2. D - Defaults", Some(MenuKey::Default)),
            ("V1.2.3", None),
            ("Supply voltage V 24.1", None),
            ("T 23.5", None),
            ("Load New Software", None),
        ];
        for (line, expected) in table {
            assert_eq!(key(line, &Words::of(line)), expected, "{line:?}");
        }
    }

    #[test]
    fn product_and_version_are_found_in_any_order_and_other_versions_are_not_taken() {
        let table = [
            (
                "AXTC4CO 4 Thermocouple Scanner V1.1.0",
                Some((Some("AXTC4CO"), Some((1, 1, 0)), Confidence::WithProduct)),
            ),
            ("Version 1.2.0 of axtc4co", Some((Some("AXTC4CO"), Some((1, 2, 0)), Confidence::WithProduct))),
            ("Software version: V1.2.0", Some((None, Some((1, 2, 0)), Confidence::Named))),
            ("V1.2.0", Some((None, Some((1, 2, 0)), Confidence::Bare))),
            ("Welcome to AXTC4CO", Some((Some("AXTC4CO"), None, Confidence::WithProduct))),
            ("Hardware version 2.0.1", None),
            ("Boot loader V1.0.0", None),
            ("CANopen stack 4.2.0", None),
            ("Node-ID 127", None),
            ("AXTC4CO Hardware V2.0.1", Some((Some("AXTC4CO"), None, Confidence::WithProduct))),
            ("AXTC4CO Boot V1.0.0", Some((Some("AXTC4CO"), None, Confidence::WithProduct))),
            ("AXTC4CO CANopen scanner 1.1.0", Some((Some("AXTC4CO"), Some((1, 1, 0)), Confidence::WithProduct))),
            (
                "AXTC4CO Hardware 2.0.1 Software 1.2.0",
                Some((Some("AXTC4CO"), Some((1, 2, 0)), Confidence::WithProduct)),
            ),
            ("AXTC4CO 2.0.1 (software 1.2.0)", Some((Some("AXTC4CO"), Some((1, 2, 0)), Confidence::WithProduct))),
            ("V1.0.0 boot loader, V1.2.0 application", Some((None, Some((1, 2, 0)), Confidence::Named))),
        ];
        for (line, expected) in table {
            let found =
                software(&Words::of(line), &["AXTC4CO"]).map(|name| (name.product, name.version, name.confidence));
            let expected = expected.map(|(product, version, confidence)| {
                (product.map(String::from), version.map(|(a, b, c)| Version::new(a, b, c)), confidence)
            });
            assert_eq!(found, expected, "{line:?}");
        }
    }

    #[test]
    fn a_refusal_says_close_by_what_is_not_so() {
        for line in [
            "Wrong password",
            "Not correct.",
            "This code is not valid",
            "Not in pre-operational state",
            "Only in Pre-Operational state!",
            "This is not allowed now",
            "View is not currently possible",
            "Available only in preoperational state",
            "The dictionary shows in Pre-Operational state only",
            "Cancelled, the dictionary is unchanged.",
        ] {
            assert!(is_refusal(&Words::of(line)), "{line:?}");
        }
        for line in [
            "Password accepted. Do not switch off",
            "Do not switch off, preparing bootloader",
            "Note: press Enter for the next object",
            "The previous object is not shown",
        ] {
            assert!(!is_refusal(&Words::of(line)), "{line:?}");
        }
    }
}
