//! What is wrong with a file that a person has written: where, which key, what was found, what is allowed.

use std::fmt;

use crate::wire::visible;

/// One thing that is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// The key it is about, e.g. `object 6126h, entry 1, default`; empty if the file is not TOML.
    pub key: String,
    /// What was found, and what is allowed.
    pub message: String,
}

impl Complaint {
    /// Complaints one below the other.
    pub fn list(complaints: &[Complaint]) -> String {
        complaints.iter().map(Complaint::to_string).collect::<Vec<_>>().join("\n")
    }
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Complaint { file, line, column, key, message } = self;
        let colon = if key.is_empty() { "" } else { ": " };
        let text = format!("{file}:{line}:{column}: {key}{colon}{message}");
        // It quotes the file, which may hold anything, to a terminal.
        f.write_str(&visible::line(text.as_bytes()))
    }
}

/// The most complaints about one file that are shown: more are of no help, and each is looked up in the text.
const MOST_COMPLAINTS: usize = 100;
/// The most characters of a message that are shown: a key or a text of the file may have any length.
const LONGEST_MESSAGE: usize = 400;

/// The complaints about one file.
#[derive(Debug)]
pub struct Complaints<'a> {
    file: &'a str,
    text: &'a str,
    found: Vec<Complaint>,
}

impl<'a> Complaints<'a> {
    /// None yet, about a file with this text.
    pub fn about(file: &'a str, text: &'a str) -> Self {
        Complaints { file, text, found: Vec::new() }
    }

    /// One more, about what is at a byte of the text. After the last one that is shown, it is only said that there are more.
    pub fn add(&mut self, at: usize, key: impl Into<String>, message: impl Into<String>) {
        match self.found.len() {
            0..MOST_COMPLAINTS => self.put(at, key.into(), message.into()),
            MOST_COMPLAINTS => self.put(at, String::new(), "and more is wrong".into()),
            _ => {}
        }
    }

    fn put(&mut self, at: usize, key: String, mut message: String) {
        if let Some((end, _)) = message.char_indices().nth(LONGEST_MESSAGE) {
            message.truncate(end);
            message.push_str(" ...");
        }
        let before = self.text.get(..at).unwrap_or_default();
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        self.found.push(Complaint {
            file: self.file.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            key,
            message,
        });
    }

    /// The complaints with one more at the end: the text is not TOML, or not of the shape that is wanted.
    pub fn ended_by(mut self, error: &toml::de::Error) -> Vec<Complaint> {
        let at = error.span().map_or(0, |span| span.start);
        self.add(at, "", error.message().trim_end().replace('\n', "; "));
        self.found
    }

    /// The complaints, or what was read if there are none.
    ///
    /// # Errors
    /// If there are complaints.
    pub fn or<T>(self, read: T) -> Result<T, Vec<Complaint>> {
        if self.found.is_empty() { Ok(read) } else { Err(self.found) }
    }
}
