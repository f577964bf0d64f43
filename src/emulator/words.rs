//! Lines of words that say what is to be done to a unit, read with the column of every word.

use std::fmt;

use crate::time::Duration;

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WordError {
    /// Column of the word it is about, from 1.
    pub column: usize,
    /// What was found, and what is allowed.
    pub message: String,
}

impl fmt::Display for WordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column, self.message)
    }
}

impl std::error::Error for WordError {}

/// The most characters of a word that an error quotes.
const LONGEST_QUOTE: usize = 60;
/// Longest time for which a supply is off, or a cable out, before it comes back by itself: a day.
pub const LONGEST_OFF_S: f64 = 86_400.0;

/// Words with their columns.
pub struct Words<'a> {
    words: Vec<(usize, &'a str)>,
    next: usize,
    /// The column after the last word.
    end: usize,
}

impl<'a> Words<'a> {
    /// The words of a line.
    pub fn of(line: &'a str) -> Self {
        let mut words = Vec::new();
        let mut rest = line;
        let mut column = 1;
        while let Some(begin) = rest.find(|c: char| !c.is_whitespace()) {
            column += rest[..begin].chars().count();
            rest = &rest[begin..];
            let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
            words.push((column, &rest[..end]));
            column += rest[..end].chars().count();
            rest = &rest[end..];
        }
        Words { words, next: 0, end: column }
    }

    /// The next word with its column.
    pub fn take(&mut self) -> Option<(usize, &'a str)> {
        let word = self.words.get(self.next).copied();
        self.next += 1;
        word
    }

    /// Whether no word is left.
    pub fn is_over(&self) -> bool {
        self.next >= self.words.len()
    }

    /// The next word with its column.
    ///
    /// # Errors
    /// If there is none: `what` is missing, which may be one of `allowed`.
    pub fn require(&mut self, what: &str, allowed: &str) -> Result<(usize, &'a str), WordError> {
        self.take().ok_or_else(|| WordError { column: self.end, message: format!("{what} is missing: {allowed}") })
    }

    /// The next word, which has to be this one, in any case.
    ///
    /// # Errors
    /// If it is another, or none.
    pub fn exactly(&mut self, wanted: &str) -> Result<(), WordError> {
        let (column, word) = self.require("a word", wanted)?;
        if word.eq_ignore_ascii_case(wanted) { Ok(()) } else { Err(unknown(column, word, wanted)) }
    }

    /// A finite number.
    ///
    /// # Errors
    /// If the next word is not a number; `what` says what it should have been.
    pub fn number(&mut self, what: &str) -> Result<f64, WordError> {
        let (column, word) = self.require(what, "a number")?;
        word.parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| WordError {
            column,
            message: format!("'{}' is not {what}: write a number like 23.5", shown(word)),
        })
    }

    /// A whole number of these, decimal or, with 0x before it, hexadecimal; `what` it is.
    ///
    /// # Errors
    /// If the next word is not one of them.
    pub fn whole(&mut self, what: &str, range: std::ops::RangeInclusive<u64>) -> Result<u64, WordError> {
        let allowed = format!("{} to {}", range.start(), range.end());
        let (column, word) = self.require(what, &allowed)?;
        let hexadecimal = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X"));
        let (digits, radix) = hexadecimal.map_or((word, 10), |digits| (digits, 16));
        // The parser would take a sign as well.
        let plain = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        u64::from_str_radix(digits, radix)
            .ok()
            .filter(|number| plain && range.contains(number))
            .ok_or_else(|| WordError { column, message: format!("'{}' is not {allowed}", shown(word)) })
    }

    /// A time of up to `longest` seconds.
    ///
    /// # Errors
    /// If the next word is not a time.
    pub fn seconds(&mut self, longest: f64) -> Result<Duration, WordError> {
        let (column, word) = self.words.get(self.next).copied().unwrap_or((self.end, ""));
        let seconds = self.number("a time in seconds")?;
        if !(0.0..=longest).contains(&seconds) {
            return Err(WordError { column, message: format!("'{}' is not 0 to {longest} seconds", shown(word)) });
        }
        Ok(Duration::from_secs_f64(seconds))
    }

    /// Makes sure that no word is left.
    ///
    /// # Errors
    /// If one is.
    pub fn end(&mut self) -> Result<(), WordError> {
        match self.take() {
            None => Ok(()),
            Some((column, word)) => Err(WordError {
                column,
                message: format!("'{}' is too much: the line is complete before it", shown(word)),
            }),
        }
    }
}

/// A word that is not one of those there are.
pub fn unknown(column: usize, word: &str, allowed: &str) -> WordError {
    WordError { column, message: format!("'{}' is not known; there is: {allowed}", shown(word)) }
}

/// The user's number as an error quotes it: not with all the digits of an absurd one.
pub fn number(value: f64) -> String {
    if value.abs() < 1e15 { value.to_string() } else { format!("{value:e}") }
}

/// The user's word as an error quotes it: the start of an endless one.
pub fn shown(word: &str) -> String {
    let begin: String = word.chars().take(LONGEST_QUOTE).collect();
    let rest = if begin.len() < word.len() { " ..." } else { "" };
    crate::wire::visible::line(begin.as_bytes()) + rest
}
