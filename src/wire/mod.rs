//! The text of the service port.
//!
//! What a unit prints, as messages where we understand it and as plain text where we do not. Nothing here fails: what
//! is not recognised is text. The manuals quote a few strings and fix the keys and the stream; the rest of a real
//! unit's wording is unknown, so recognition goes by words and numbers, never by position or layout.

mod boot;
pub mod diagnostics;
pub mod dictionary;
mod framer;
mod menu;
mod network;
mod prompt;
pub mod stream;
pub mod units;
pub mod visible;
mod words;

pub use crate::record::{XOFF, XON};
pub use boot::{LoaderError, LoaderText, complains};
pub use framer::{Framer, Item, LONGEST_LINE, Text};
pub use menu::{Confidence, MenuKey, SoftwareName, is_word_of_refusal};
pub use network::{Network, NmtState};
pub use prompt::{Prompt, SourceKeys, is_question};

use stream::{Layout, Row, Source};

/// What a line means.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Nothing that is known: it stays text.
    Text,
    /// A row of the data stream.
    Row(Row),
    /// A text of the bootloader.
    Loader(LoaderText),
    /// The new software runs for the first time (AXTC4CO manual, section 4.1.5).
    FirstStart,
    /// An entry of the main menu.
    MenuKey(MenuKey),
    /// Product, software version, or both.
    Software(SoftwareName),
    /// One or more of the CANopen network variables.
    Network(Network),
    /// A question, recognised once the unit has fallen silent after it.
    Prompt(Prompt),
    /// The unit refuses what was typed: wrong password, invalid entry, not in this state.
    Refusal,
}

/// What recognition needs to know of the products.
#[derive(Clone, Debug)]
pub struct Vocabulary<'a> {
    /// Product names, as banners print them.
    pub products: Vec<&'a str>,
    /// Stream layouts.
    pub layouts: Vec<&'a Layout>,
}

impl Vocabulary<'_> {
    /// What a complete line means.
    pub fn line(&self, line: &str) -> Message {
        if let Some(row) = self.layouts.iter().find_map(|layout| layout.parse(line)) {
            return Message::Row(row);
        }
        let words = words::Words::of(line);
        if let Some(text) = boot::recognise(line, &words) {
            return Message::Loader(text);
        }
        // A wrong line rate, or another device, sends damaged text without end: what is damaged proves nothing.
        if line.contains(char::REPLACEMENT_CHARACTER) {
            return Message::Text;
        }
        if words.has_all(&["first", "start"]) && words.has_any(&["performing", "initialization", "initialisation"]) {
            return Message::FirstStart;
        }
        if let Some(key) = menu::key(line, &words) {
            return Message::MenuKey(key);
        }
        if let Some(name) = menu::software(&words, &self.products) {
            return Message::Software(name);
        }
        let network = network::network(&words);
        // "Only in pre-operational state" names a state, but is a refusal.
        let names_numbers = network.as_ref().is_some_and(|found| found.node_id.is_some() || found.can_kbps.is_some());
        if menu::is_refusal(&words) && !names_numbers {
            return Message::Refusal;
        }
        if let Some(network) = network {
            return Message::Network(network);
        }
        Message::Text
    }

    /// A row without a number looks the same from either source: reads it as one of `source`. `None` if it is one
    /// already, has a number, or cannot be read so.
    pub fn row_as(&self, line: &str, row: &Row, source: Source) -> Option<Row> {
        if row.source == source || row.readings.iter().any(|reading| reading.value().is_some()) {
            return None;
        }
        self.layouts.iter().find_map(|layout| layout.parse_as(source, line))
    }

    /// Whether a line is a row of the stream.
    pub fn is_row(&self, line: &str) -> bool {
        self.layouts.iter().any(|layout| layout.parse(line).is_some())
    }

    /// Where a row of the stream begins in a line that begins with something else, and the question that comes before
    /// it, if it is one we know.
    pub fn before_row(&self, line: &str) -> Option<(Option<Prompt>, usize)> {
        let first_end = line.find(';')?;
        let formats = self.layouts.iter().flat_map(|layout| [&layout.field_value, &layout.process_value]);
        formats.flat_map(|format| &format.widths).find_map(|width| {
            let at = first_end.checked_sub(*width).filter(|&at| at > 0)?;
            let (before, row) = line.split_at_checked(at)?;
            let is_part = !self.is_row(line) && before.contains(char::is_alphanumeric) && self.is_row(row);
            is_part.then(|| (self.prompt(before), at))
        })
    }

    /// Whether a text without a line end asks for the password. `after_load`: it answers an L, after which more words
    /// can mean nothing else. Called for every byte that comes, so it has to be cheap for other texts.
    pub fn asks_password(&self, text: &str, after_load: bool) -> bool {
        let speaks_of_it = text
            .as_bytes()
            .windows(3)
            .any(|letters| letters.eq_ignore_ascii_case(b"pas") || letters.eq_ignore_ascii_case(b"pwd"));
        (speaks_of_it && self.prompt(text) == Some(Prompt::Password))
            || (after_load && prompt::asks_password_after_load(text))
    }

    /// What a text without a line end asks for, once the unit has fallen silent after it.
    pub fn prompt(&self, text: &str) -> Option<Prompt> {
        prompt::recognise(text, &words::Words::of(text))
    }
}
