//! Texts of the bootloader.
//!
//! Known strings: `Waiting for application S-Record` (AXTC4CO manual, section 4.1.5; AXRTD8CO, section 4.1.5),
//! `S-File has been loaded successfully` (AXRTD8CO). From the public loaders of the 56F8xx parts: the copyright line,
//! `Error # 000N`, `Restarting.`, `Loaded 0x.... Program and 0x.... Data words.`, `Application started.`,
//! `Download Complete`, `Error: ` with four hex digits.

use std::fmt;

use super::words::{Words, number};

/// What the bootloader says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoaderText {
    /// Its copyright line or header.
    Header,
    /// It wants the file.
    Waiting,
    /// It wants a key first.
    AnyKey,
    /// A sign of progress: nothing but dots or stars.
    Progress,
    /// Something was wrong.
    Error(LoaderError),
    /// It starts over and wants the header record again.
    Restarting,
    /// It says that it has taken the file. Proves only that the terminator arrived.
    Loaded,
    /// It hands over to the application.
    Started,
}

/// An error that a loader reports. Displayed as the loader prints it, with its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoaderError {
    /// A number (generations g1 and g2).
    Number(u32),
    /// The bits of a status word (generation g3).
    Status(u16),
}

/// What the error numbers mean.
const NUMBERS: [(u32, &str); 7] = [
    (1, "characters lost or damaged on the line"),
    (2, "a character that belongs to no record"),
    (3, "a record it does not take"),
    (4, "wrong checksum"),
    (5, "records came faster than it takes them"),
    (6, "the flash could not be written"),
    (7, "internal error"),
];

/// What the bits of the status word mean.
const BITS: [(u16, &str); 8] = [
    (0x0001, "wrong checksum"),
    (0x0002, "no record, or one it does not take"),
    (0x0004, "the flash could not be accessed"),
    (0x0008, "the flash is protected"),
    (0x0010, "the flash could not be written"),
    (0x0020, "an impossible start address"),
    (0x0040, "characters lost or damaged on the line"),
    (0x0080, "an address outside its flash"),
];

impl fmt::Display for LoaderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let meanings: Vec<&str> = match self {
            LoaderError::Number(number) => {
                write!(f, "{number}")?;
                NUMBERS.iter().filter(|(known, _)| known == number).map(|(_, meaning)| *meaning).collect()
            }
            LoaderError::Status(status) => {
                write!(f, "{status:04X}")?;
                BITS.iter().filter(|(bit, _)| status & bit != 0).map(|(_, meaning)| *meaning).collect()
            }
        };
        if meanings.is_empty() { Ok(()) } else { write!(f, " ({})", meanings.join("; ")) }
    }
}

/// What a line says, if it is the loader's.
pub(super) fn recognise(line: &str, words: &Words) -> Option<LoaderText> {
    let marks = line.trim();
    if !marks.is_empty() && marks.chars().all(|c| c == '.' || c == '*') {
        return Some(LoaderText::Progress);
    }
    let s_record = words.has_any(&["srec", "sfile"])
        || words.iter().zip(words.iter().skip(1)).any(|(a, b)| a == "s" && (b.starts_with("rec") || b == "file"));
    if words.has_any(&["waiting", "ready"]) && (s_record || words.has_all(&["appl", "file"])) {
        return Some(LoaderText::Waiting);
    }
    if let Some(error) = error(line, words) {
        return Some(LoaderText::Error(error));
    }
    if words.has_any(&["restarting"]) {
        return Some(LoaderText::Restarting);
    }
    let loaded_words = words.has_all(&["loaded", "program", "words"]);
    let loaded_well = words.has_any(&["loaded", "download"]) && words.has_any(&["success", "complete"]);
    if loaded_words || loaded_well {
        return Some(LoaderText::Loaded);
    }
    if words.has_all(&["application", "started"]) {
        return Some(LoaderText::Started);
    }
    if words.has_all(&["any", "key"]) && words.has_any(&["hit", "press", "strike", "continue"]) {
        return Some(LoaderText::AnyKey);
    }
    if words.has_any(&["loader", "bootloader"]) && words.has_any(&["version", "v", "copyright", "serial"]) {
        return Some(LoaderText::Header);
    }
    None
}

/// `Error # 0004`, `error #4`, `Error: 0001`: the word first, then nothing but its number or its bits.
fn error(line: &str, words: &Words) -> Option<LoaderError> {
    // Progress marks may come before it on the same line.
    if words.get(0) != Some("error") || words.iter().count() > 3 {
        return None;
    }
    let code = words.iter().nth(1)?;
    let digits = code.strip_prefix("0x").unwrap_or(code);
    if line.contains(':') {
        // Exactly four digits: in "Error: bad" it is a word.
        let status = u16::from_str_radix(digits, 16).ok().filter(|_| digits.len() == STATUS_DIGITS);
        status.map(LoaderError::Status)
    } else {
        number(code).and_then(|code| u32::try_from(code).ok()).map(LoaderError::Number)
    }
}

/// Whether a loader says in words of its own that something is wrong.
pub fn complains(text: &str) -> bool {
    let words = Words::of(text);
    // "No errors", "0 errors" and "Errors: 0" come from a loader that counts errors. "Error 0" is an error number.
    let counts_none = |at: usize, word: &str| {
        let before = at.checked_sub(1).and_then(|at| words.get(at));
        let beside = before.into_iter().chain(words.get(at + 1));
        before == Some("no") || word == "errors" && beside.into_iter().any(|word| number(word) == Some(0))
    };
    words.iter().enumerate().any(|(at, word)| {
        let begins = |beginnings: &[&str]| beginnings.iter().any(|beginning| word.starts_with(beginning));
        match word {
            "bad" | "err" | "nak" => true,
            _ if begins(&["error", "fehler"]) => !counts_none(at, word),
            _ => begins(&[
                "abort",
                "abbruch",
                "fail",
                "retry",
                "retries",
                "invalid",
                "illegal",
                "wrong",
                "incorrect",
                "mismatch",
                "corrupt",
                "overrun",
                "overflow",
                "refused",
                "rejected",
                "denied",
                "timeout",
            ]),
        }
    })
}

/// Hexadecimal digits of a status word.
const STATUS_DIGITS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_texts_of_three_generations_are_recognised() {
        let table = [
            ("Waiting for application S-Record.", Some(LoaderText::Waiting)),
            ("Waiting for application S-Record", Some(LoaderText::Waiting)),
            ("Waiting for application S-Rec", Some(LoaderText::Waiting)),
            ("(c) 2000-2004 S-Record loader. Version 1.3", Some(LoaderText::Header)),
            ("Serial Bootloader v2.0", Some(LoaderText::Header)),
            ("....", Some(LoaderText::Progress)),
            ("...*", Some(LoaderText::Progress)),
            ("Error # 0004", Some(LoaderText::Error(LoaderError::Number(4)))),
            ("...Error # 0002", Some(LoaderText::Error(LoaderError::Number(2)))),
            ("Error: 0010", Some(LoaderText::Error(LoaderError::Status(0x10)))),
            ("Restarting.", Some(LoaderText::Restarting)),
            ("Loaded 0xC000 Program and 0x0000 Data words.", Some(LoaderText::Loaded)),
            ("S-File has been loaded successfully", Some(LoaderText::Loaded)),
            ("Download Complete", Some(LoaderText::Loaded)),
            ("Application started.", Some(LoaderText::Started)),
            ("Hit any key to continue", Some(LoaderText::AnyKey)),
            ("56F83xx Serial Bootloader v2.0", Some(LoaderText::Header)),
            ("Application started!", Some(LoaderText::Started)),
            ("L - Load New Software", None),
            ("Error count 0", None),
            ("Error register 00h", None),
            ("Errors: 3", None),
            ("Error: Bad password", None),
            ("Error: 3", None),
            ("AXTC4CO V1.1.0", None),
        ];
        for (line, expected) in table {
            assert_eq!(recognise(line, &Words::of(line)), expected, "{line:?}");
        }
    }

    #[test]
    fn complaints_are_known_in_words_of_any_loader() {
        for text in [
            "Transfer aborted: reason 6",
            "*** Fehler 6",
            "...Error",
            "Verify error at line 6, please retry",
            "Bad record",
            "err 5",
            "NAK",
            "FAILED",
            "programming failure",
            "Invalid S-record",
            "wrong checksum",
            "Error # 00\u{fffd}4",
            "Error 0",
        ] {
            assert!(complains(text), "{text:?}");
        }
        for text in [
            "",
            "....",
            "Sector written",
            "Erasing sector 5",
            "Badge 7",
            "07%",
            "Verify ok",
            "Verifying page 3",
            "Page 3 verified",
            "0 errors",
            "Errors: 0",
            "no errors so far",
            "S3150000BAD0",
            "terror",
        ] {
            assert!(!complains(text), "{text:?}");
        }
    }

    #[test]
    fn errors_are_told_in_words_number_by_number_and_bit_by_bit() {
        let table = [
            (LoaderError::Number(4), "4 (wrong checksum)"),
            (LoaderError::Number(9), "9"),
            (LoaderError::Status(0x0001), "0001 (wrong checksum)"),
            (LoaderError::Status(0x0012), "0012 (no record, or one it does not take; the flash could not be written)"),
            (LoaderError::Status(0x0100), "0100"),
        ];
        for (error, expected) in table {
            assert_eq!(error.to_string(), expected);
        }
    }
}
