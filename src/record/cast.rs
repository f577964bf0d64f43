//! The recording as a file: asciicast v2, `"o"` from the unit, `"i"` to it, `"m"` for remarks.
//!
//! The format is lines of JSON, so a recording is readable up to its last complete line whatever killed the writer,
//! and common players show it. An event holds text, the line holds bytes: every byte becomes the character of the
//! same number (Latin-1), which loses nothing. The header says so in `axcon.encoding`. [`super::Reader`] reads it back.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use super::{Direction, REDACTED};
use crate::endpoint::Secrecy;
use crate::time::Instant;

/// What a recording begins with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// When the recording began, in milliseconds since 1970.
    pub unix_millis: i64,
    /// The port, as the user named it.
    pub port: String,
    /// Line settings, e.g. `115200 8N1`.
    pub settings: String,
    /// Driver or kind of the port, where known.
    pub driver: Option<String>,
    /// The USB adapter, where it is one.
    pub adapter: Option<Adapter>,
    /// Which part of a long session this is, counted from 1.
    pub part: u32,
}

/// What a USB adapter says about itself.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Adapter {
    /// Vendor, four hexadecimal digits.
    pub vid: String,
    /// Product, four hexadecimal digits.
    pub pid: String,
    /// Serial number, where it has one.
    pub serial_number: Option<String>,
    /// Maker, in its own words.
    pub manufacturer: Option<String>,
    /// Product, in its own words.
    pub product: Option<String>,
}

/// A recording being written. Each event is one `write`: a killed process loses nothing it had recorded.
#[derive(Debug)]
pub struct Cast<W> {
    to: W,
    begun: Instant,
    written: u64,
    /// The line being made, kept for its memory.
    line: Vec<u8>,
}

/// What the recordings of this program are called in their header.
pub(super) const SCHEMA: &str = "axcon.recording/1";
/// How bytes become text in them.
pub(super) const LATIN_1: &str = "latin-1";

#[derive(Serialize)]
struct HeaderLine<'a> {
    version: u8,
    width: u8,
    height: u8,
    timestamp: i64,
    title: String,
    axcon: Details<'a>,
}

#[derive(Serialize)]
struct Details<'a> {
    schema: &'static str,
    begun_ms: i64,
    encoding: &'static str,
    program: &'static str,
    port: &'a str,
    settings: &'a str,
    driver: Option<&'a str>,
    adapter: Option<&'a Adapter>,
    part: u32,
}

impl<W: Write> Cast<W> {
    /// Writes the header of a recording that begins at `begun`.
    ///
    /// # Errors
    /// If writing fails.
    pub fn begin(to: W, header: &Header, begun: Instant) -> io::Result<Self> {
        let mut cast = Cast { to, begun, written: 0, line: Vec::new() };
        let head = HeaderLine {
            version: 2,
            width: 80,
            height: 24,
            timestamp: header.unix_millis.div_euclid(1000),
            title: format!("axcon {}", header.port),
            axcon: Details {
                schema: SCHEMA,
                begun_ms: header.unix_millis,
                encoding: LATIN_1,
                program: concat!("axcon ", env!("CARGO_PKG_VERSION")),
                port: &header.port,
                settings: &header.settings,
                driver: header.driver.as_deref(),
                adapter: header.adapter.as_ref(),
                part: header.part,
            },
        };
        serde_json::to_writer(&mut cast.line, &head)?;
        cast.end_line()?;
        Ok(cast)
    }

    /// Appends bytes. The content of secret bytes is replaced, their number stays.
    ///
    /// # Errors
    /// If writing fails; the caller says so and goes on without a recording.
    pub fn push(&mut self, at: Instant, direction: Direction, secrecy: Secrecy, bytes: &[u8]) -> io::Result<()> {
        let code = match direction {
            Direction::FromUnit => "o",
            Direction::ToUnit => "i",
        };
        self.begin_event(at, code)?;
        match secrecy {
            Secrecy::Open => latin_1(bytes, &mut self.line),
            Secrecy::Secret => self.line.extend(bytes.iter().map(|_| REDACTED)),
        }
        self.line.extend_from_slice(b"\"]");
        self.end_line()
    }

    /// Appends a remark, which players show as a marker: that the cable was away, how much has gone over it.
    ///
    /// # Errors
    /// If writing fails.
    pub fn mark(&mut self, at: Instant, text: &str) -> io::Result<()> {
        self.begin_event(at, "m")?;
        // The quotation mark is the library's here.
        self.line.pop();
        serde_json::to_writer(&mut self.line, text)?;
        self.line.push(b']');
        self.end_line()
    }

    /// What it was written to.
    pub fn into_inner(self) -> W {
        self.to
    }

    /// Bytes written so far, for the size limit.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// `[1.5,"o","`
    fn begin_event(&mut self, at: Instant, code: &str) -> io::Result<()> {
        // Six digits: microseconds, as the format has them; a character takes 87.
        let seconds = (at.since(self.begun).as_secs_f64() * 1e6).round() / 1e6;
        write!(self.line, "[{seconds},\"{code}\",\"")
    }

    fn end_line(&mut self) -> io::Result<()> {
        self.line.push(b'\n');
        self.written += self.line.len() as u64;
        let written = self.to.write_all(&self.line);
        self.line.clear();
        written
    }
}

/// Appends bytes as the inside of a JSON text: each is the character of its number. Made by hand, since a flood goes
/// through here.
fn latin_1(bytes: &[u8], line: &mut Vec<u8>) {
    const HEX: &[u8; 16] = b"0123456789abcdef";
    let mut rest = bytes;
    while let Some(&first) = rest.first() {
        let plain = rest.iter().position(|byte| !matches!(byte, b' '..=b'!' | b'#'..=b'[' | b']'..=0x7F));
        let (run, after) = rest.split_at(plain.unwrap_or(rest.len()));
        if !run.is_empty() {
            line.extend_from_slice(run);
            rest = after;
            continue;
        }
        rest = &rest[1..];
        match first {
            b'"' | b'\\' => line.extend_from_slice(&[b'\\', first]),
            b'\n' => line.extend_from_slice(b"\\n"),
            b'\r' => line.extend_from_slice(b"\\r"),
            b'\t' => line.extend_from_slice(b"\\t"),
            0..0x20 => {
                let digits = [HEX[usize::from(first >> 4)], HEX[usize::from(first & 0xF)]];
                line.extend_from_slice(b"\\u00");
                line.extend_from_slice(&digits);
            }
            _ => line.extend_from_slice(&[0xC0 | first >> 6, 0x80 | first & 0x3F]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_and_the_password_does_not() {
        let header = Header { port: "u0".into(), settings: "115200 8N1".into(), part: 1, ..Header::default() };
        let mut cast = Cast::begin(Vec::new(), &header, Instant::from_millis(5)).expect("a vector takes all");
        let all: Vec<u8> = (0..=255).collect();
        cast.push(Instant::from_millis(5), Direction::FromUnit, Secrecy::Open, &all).expect("written");
        cast.push(Instant::from_millis(1505), Direction::ToUnit, Secrecy::Secret, b"AXIO-2010").expect("written");
        cast.mark(Instant::from_millis(1505), "link lost").expect("written");
        let text = String::from_utf8(cast.to.clone()).expect("JSON is UTF-8");
        assert_eq!(cast.written(), text.len() as u64);
        let lines: Vec<serde_json::Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect();
        assert_eq!(lines[0]["version"], 2);
        let back: Vec<u8> =
            lines[1][2].as_str().expect("text").chars().map(|c| u8::try_from(c).expect("Latin-1")).collect();
        assert_eq!(back, all);
        assert_eq!(lines[2], serde_json::json!([1.5, "i", "*********"]));
        assert_eq!(lines[3], serde_json::json!([1.5, "m", "link lost"]));
        assert!(!text.contains("AXIO"));
        assert!(text.contains(r"\u0008\t\n\u000b\u000c\r\u000e"), "short forms where JSON has them: {text}");
    }
}
