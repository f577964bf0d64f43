//! Texts of the bootloader.
//!
//! Known strings: `Waiting for application S-Record` (AXTC4CO manual, section 4.1.5; AXRTD8CO, section 4.1.5),
//! `S-File has been loaded successfully` (AXRTD8CO). From the public loaders of the 56F8xx parts: the copyright line,
//! `Error # 000N`, `Restarting.`, `Loaded 0x.... Program and 0x.... Data words.`, `Application started.`,
//! `Download Complete`, `Error: ` with four hex digits.

use super::words::{Words, number};

/// What the bootloader says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoaderText {
    /// Who it is: copyright line or header.
    Header,
    /// It wants the file.
    Waiting,
    /// It wants a key first.
    AnyKey,
    /// A sign of progress: nothing but dots or stars.
    Progress,
    /// Something was wrong; the number as printed.
    Error(u32),
    /// It starts over and wants the header record again.
    Restarting,
    /// It believes the file has been taken. Proves only that the terminator arrived.
    Loaded,
    /// It hands over to the application.
    Started,
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
    if let Some(code) = error_code(line, words) {
        return Some(LoaderText::Error(code));
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

/// `Error # 0004`, `error #4`, `Error: 0001`: the word first, then nothing but its number.
fn error_code(line: &str, words: &Words) -> Option<u32> {
    // Progress marks may stand before it on the same line.
    if words.get(0) != Some("error") || words.iter().count() > 3 {
        return None;
    }
    let hexadecimal = line.contains(':');
    let code = words.iter().nth(1)?;
    let digits = code.strip_prefix("0x").unwrap_or(code);
    if hexadecimal {
        u32::from_str_radix(digits, 16).ok()
    } else {
        number(code).and_then(|code| u32::try_from(code).ok())
    }
}

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
            ("Error # 0004", Some(LoaderText::Error(4))),
            ("...Error # 0002", Some(LoaderText::Error(2))),
            ("Error: 0010", Some(LoaderText::Error(16))),
            ("Restarting.", Some(LoaderText::Restarting)),
            ("Loaded 0xC000 Program and 0x0000 Data words.", Some(LoaderText::Loaded)),
            ("S-File has been loaded successfully", Some(LoaderText::Loaded)),
            ("Download Complete", Some(LoaderText::Loaded)),
            ("Application started.", Some(LoaderText::Started)),
            ("Hit any key to continue", Some(LoaderText::AnyKey)),
            ("L - Load New Software", None),
            ("Error count 0", None),
            ("Error register 00h", None),
            ("Errors: 3", None),
            ("AXTC4CO V1.1.0", None),
        ];
        for (line, expected) in table {
            assert_eq!(recognise(line, &Words::of(line)), expected, "{line:?}");
        }
    }
}
