//! Recordings read back: chunks of a file in, bytes with their direction and time out.
//!
//! Reads what [`super::Cast`] writes, and asciicast v2 and v3 of other programs. A line is all that is kept in memory,
//! and its length is bounded. What is not a recording is refused with the line and column where it stops being one; only a
//! last line without its end is forgiven, since that is what a killed writer leaves.

use serde::Deserialize;
use serde_json::Value;

use super::Direction;
use super::cast::{Adapter, Header, LATIN_1, SCHEMA};
use crate::time::{Duration, Instant};

/// The most bytes of a line. This program's own lines have 25,000; other recorders write a screen at once.
pub const LONGEST_LINE: usize = 4 << 20;

/// The longest time a recording may span: thirty years, so that arithmetic on moments never saturates.
const LONGEST: f64 = 1e9;

/// What a recording holds, in its order.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// Its head; always the first.
    Header(Header),
    /// Bytes that came or went.
    Bytes {
        /// When, since the recording began.
        at: Instant,
        /// Which side sent.
        direction: Direction,
        /// What, at least one byte.
        bytes: Vec<u8>,
    },
    /// A remark.
    Mark {
        /// When, since the recording began.
        at: Instant,
        /// What it says.
        text: String,
    },
}

/// Why a file is not a recording, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {what}")]
pub struct ReadError {
    /// Line, counted from 1.
    pub line: u64,
    /// Column in bytes, counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub what: String,
}

/// How a recording ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// With a complete line.
    Whole,
    /// In the middle of a line: its writer was killed, its disk was full, or the file was cut.
    CutShort,
}

/// Reads a recording piece by piece.
#[derive(Debug, Default)]
pub struct Reader {
    line: Vec<u8>,
    /// Number of the line under construction, from 0.
    number: u64,
    format: Option<Format>,
    last: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Format {
    /// Times count from the event before (v3), not from the beginning (v2).
    relative: bool,
    latin_1: bool,
}

#[derive(Deserialize)]
struct HeaderLine {
    version: u64,
    timestamp: Option<f64>,
    title: Option<String>,
    axcon: Option<Details>,
}

#[derive(Deserialize)]
struct Details {
    schema: String,
    begun_ms: Option<i64>,
    encoding: Option<String>,
    port: Option<String>,
    settings: Option<String>,
    driver: Option<String>,
    adapter: Option<Adapter>,
    part: Option<u32>,
}

impl Reader {
    /// Takes the next bytes of the file and hands out what they complete.
    ///
    /// # Errors
    /// If a line is not one of a recording. The reader is of no more use then.
    pub fn push(&mut self, bytes: &[u8], mut out: impl FnMut(Piece)) -> Result<(), ReadError> {
        for part in bytes.split_inclusive(|&byte| byte == b'\n') {
            if self.line.len() + part.len() > LONGEST_LINE {
                let what = format!("the line has more than {LONGEST_LINE} bytes");
                return Err(ReadError { line: self.number + 1, column: 1, what });
            }
            self.line.extend_from_slice(part);
            if part.ends_with(b"\n") {
                self.end_line(&mut out)?;
            }
        }
        Ok(())
    }

    /// The file has ended.
    ///
    /// # Errors
    /// If there was nothing in it.
    pub fn finish(&mut self, mut out: impl FnMut(Piece)) -> Result<Ending, ReadError> {
        let ending = if self.format.is_none() {
            self.end_line(&mut out)?;
            Ending::Whole
        } else {
            match self.end_line(&mut out) {
                Ok(()) => Ending::Whole,
                Err(_) => Ending::CutShort,
            }
        };
        match self.format {
            Some(_) => Ok(ending),
            None => Err(ReadError { line: 1, column: 1, what: "the file is empty".into() }),
        }
    }

    fn end_line(&mut self, out: &mut impl FnMut(Piece)) -> Result<(), ReadError> {
        self.number += 1;
        let line = std::mem::take(&mut self.line);
        let line = line.trim_ascii_end();
        // Comments are part of v3.
        let is_comment = self.format.is_some_and(|format| format.relative) && line.starts_with(b"#");
        if line.is_empty() || is_comment {
            return Ok(());
        }
        match self.format {
            None => out(Piece::Header(self.header(line)?)),
            Some(format) => {
                if let Some(piece) = self.event(line, format)? {
                    out(piece);
                }
            }
        }
        Ok(())
    }

    fn header(&mut self, line: &[u8]) -> Result<Header, ReadError> {
        let read: HeaderLine = serde_json::from_slice(line).map_err(|error| {
            let what = format!("this is not an asciicast recording: {}", cause(&error));
            self.error(error.column(), what)
        })?;
        if !matches!(read.version, 2 | 3) {
            let what = format!("asciicast version {} is not read; 2 and 3 are", read.version);
            return Err(self.error(1, what));
        }
        if let Some(details) = read.axcon.as_ref().filter(|details| details.schema != SCHEMA) {
            let schema = details.schema.escape_debug();
            return Err(self.error(1, format!("a recording of the kind '{schema}' is not read; '{SCHEMA}' is")));
        }
        let encoding = read.axcon.as_ref().and_then(|details| details.encoding.as_deref());
        if let Some(other) = encoding.filter(|encoding| *encoding != LATIN_1) {
            return Err(self.error(1, format!("the encoding '{}' is not known", other.escape_debug())));
        }
        self.format = Some(Format { relative: read.version == 3, latin_1: encoding.is_some() });
        let details = read.axcon;
        let timestamp = read.timestamp.filter(|seconds| seconds.abs() < 1e12).unwrap_or_default();
        let begun = details.as_ref().and_then(|details| details.begun_ms);
        let unix_millis = begun.unwrap_or((timestamp * 1000.0) as i64);
        let part = details.as_ref().and_then(|details| details.part).unwrap_or(1);
        Ok(match details {
            Some(details) => Header {
                unix_millis,
                port: details.port.unwrap_or_default(),
                settings: details.settings.unwrap_or_default(),
                driver: details.driver,
                adapter: details.adapter,
                part,
            },
            None => Header { unix_millis, port: read.title.unwrap_or_default(), part, ..Header::default() },
        })
    }

    fn event(&mut self, line: &[u8], format: Format) -> Result<Option<Piece>, ReadError> {
        let (seconds, code, data): (f64, String, Value) = serde_json::from_slice(line)
            .map_err(|error| self.error(error.column(), format!("this is not an event: {}", cause(&error))))?;
        if !(0.0..=LONGEST).contains(&seconds) {
            return Err(self.error(2, format!("{seconds} s is not a time of a recording")));
        }
        let since = if format.relative { self.last } else { Instant::ZERO };
        // A clock that was set back while somebody recorded.
        let at = (since + Duration::from_secs_f64(seconds)).max(self.last);
        if at.since_start().as_secs_f64() > 2.0 * LONGEST {
            return Err(self.error(2, "the recording spans more than thirty years".into()));
        }
        self.last = at;
        let direction = match code.as_str() {
            "o" => Direction::FromUnit,
            "i" => Direction::ToUnit,
            "m" => {
                return Ok(data.as_str().map(|text| Piece::Mark { at, text: text.to_owned() }));
            }
            // A resized window, and whatever later versions have.
            _ => return Ok(None),
        };
        let Value::String(text) = data else {
            return Err(self.error(1, format!("an event '{code}' holds text, and this one does not")));
        };
        let bytes = if format.latin_1 {
            let bytes: Result<Vec<u8>, char> = text.chars().map(|c| u8::try_from(c).map_err(|_| c)).collect();
            bytes.map_err(|c| self.error(column_of(line, c), format!("'{}' is not a byte", c.escape_debug())))?
        } else {
            text.into_bytes()
        };
        Ok((!bytes.is_empty()).then_some(Piece::Bytes { at, direction, bytes }))
    }

    fn error(&self, column: usize, what: String) -> ReadError {
        ReadError { line: self.number, column: column.max(1), what }
    }
}

/// Where a character is in a line, as itself; 1 if it is written as an escape.
fn column_of(line: &[u8], character: char) -> usize {
    let written = character.to_string();
    line.windows(written.len()).position(|window| window == written.as_bytes()).map_or(1, |at| at + 1)
}

/// The library's message without its own place.
fn cause(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.split(" at line ").next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Secrecy;
    use crate::record::Cast;
    use proptest::prelude::*;

    fn read(chunks: &[&[u8]]) -> Result<(Vec<Piece>, Ending), ReadError> {
        let mut reader = Reader::default();
        let mut pieces = Vec::new();
        for chunk in chunks {
            reader.push(chunk, |piece| pieces.push(piece))?;
        }
        let ending = reader.finish(|piece| pieces.push(piece))?;
        Ok((pieces, ending))
    }

    fn whole(text: &str) -> Result<(Vec<Piece>, Ending), ReadError> {
        read(&[text.as_bytes()])
    }

    fn header() -> Header {
        let adapter = Adapter { vid: "0403".into(), pid: "6001".into(), ..Adapter::default() };
        Header {
            unix_millis: 1_769_860_800_123,
            port: "/dev/ttyUSB0".into(),
            settings: "115200 8N1".into(),
            driver: Some("ftdi_sio".into()),
            adapter: Some(adapter),
            part: 2,
        }
    }

    #[test]
    fn another_programs_recordings_are_read_as_well() {
        let v2 = "{\"version\": 2, \"width\": 80, \"height\": 24, \"timestamp\": 7}\r\n[0.5, \"o\", \"23 °C\"]\r\n\r\n[0.25, \"r\", \"80x25\"]\n[1, \"o\", \"\"]\n";
        let (pieces, ending) = whole(v2).expect("a recording");
        assert_eq!(ending, Ending::Whole);
        assert_eq!(pieces.len(), 2, "{pieces:?}");
        assert!(matches!(&pieces[0], Piece::Header(header) if header.unix_millis == 7000), "{pieces:?}");
        let at = Instant::from_millis(500);
        assert_eq!(pieces[1], Piece::Bytes { at, direction: Direction::FromUnit, bytes: "23 °C".into() });
        let v3 = "{\"version\":3,\"term\":{\"cols\":80,\"rows\":24}}\n# a comment\n[0.5,\"o\",\"a\"]\n[0.5,\"i\",\"b\"]\n[0.1,\"x\",3]\n";
        let (pieces, _) = whole(v3).expect("a recording");
        let at = Instant::from_millis(1000);
        assert_eq!(pieces[2], Piece::Bytes { at, direction: Direction::ToUnit, bytes: b"b".into() });
    }

    #[test]
    fn what_is_no_recording_is_said_with_its_line_and_column() {
        let own = "{\"version\":2,\"axcon\":{\"schema\":\"axcon.recording/1\",\"encoding\":\"latin-1\"}}\n";
        let with = |line: &str| format!("{own}{line}\n");
        let table = [
            (String::new(), 1, 1, "the file is empty"),
            ("S0030000FC\n".into(), 1, 1, "this is not an asciicast recording: expected value"),
            ("{\"width\":80}\n".into(), 1, 12, "this is not an asciicast recording: missing field `version`"),
            ("{\"version\":1}\n".into(), 1, 1, "asciicast version 1 is not read; 2 and 3 are"),
            (
                "{\"version\":2,\"axcon\":{\"schema\":\"axcon.recording/9\"}}\n".into(),
                1,
                1,
                "a recording of the kind 'axcon.recording/9' is not read; 'axcon.recording/1' is",
            ),
            (with("[0.1,\"o\",\"a\""), 2, 12, "this is not an event: EOF while parsing a list"),
            (with("[0.1,\"o\"]"), 2, 9, "this is not an event: invalid length 2, expected a tuple of size 3"),
            (with("\n[\"o\",\"o\",\"a\"]"), 3, 4, "this is not an event: invalid type: string \"o\", expected f64"),
            (with("[-1,\"o\",\"a\"]"), 2, 2, "-1 s is not a time of a recording"),
            (with("[1e300,\"o\",\"a\"]"), 2, 2, "1000"),
            (with("[0,\"o\",7]"), 2, 1, "an event 'o' holds text, and this one does not"),
            (with("[0,\"o\",\"a\u{20ac}\"]"), 2, 10, "'\u{20ac}' is not a byte"),
        ];
        for (text, line, column, what) in table {
            let error = whole(&text).expect_err(&text);
            assert_eq!((error.line, error.column), (line, column), "{text:?}: {error}");
            assert!(error.what.starts_with(what), "{text:?}: {error}");
        }
        let error = read(&[own.as_bytes(), &vec![b' '; LONGEST_LINE + 1]]).expect_err("too long");
        assert_eq!((error.line, error.what.as_str()), (2, "the line has more than 4194304 bytes"));
    }

    #[test]
    fn thirty_years_can_be_read_twice_over_and_not_a_second_more() {
        let v3 =
            |last: &str| format!("{{\"version\":3}}\n[1e9,\"o\",\"a\"]\n[1e9,\"o\",\"b\"]\n[{last},\"o\",\"c\"]\n");
        assert!(whole(&v3("0")).is_ok());
        let error = whole(&v3("1")).expect_err("too long");
        assert_eq!((error.line, error.what.as_str()), (4, "the recording spans more than thirty years"));
    }

    #[test]
    fn a_killed_writers_last_line_is_forgiven_and_nothing_before_it_lost() {
        let mut cast = Cast::begin(Vec::new(), &header(), Instant::ZERO).expect("written");
        for second in 0..3 {
            cast.push(Instant::from_millis(second * 1000), Direction::FromUnit, Secrecy::Open, b"row\r\n").expect("it");
        }
        let text = cast.into_inner();
        let lines: Vec<usize> = text.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at).collect();
        for cut in lines[0]..text.len() {
            let (pieces, ending) = read(&[&text[..cut]]).expect("readable");
            let complete = lines[1..].iter().filter(|&&end| end <= cut).count();
            assert_eq!(pieces.len(), 1 + complete, "cut at {cut}");
            let in_a_line = !lines.contains(&cut) && !lines.contains(&(cut - 1));
            assert_eq!(ending == Ending::CutShort, in_a_line, "cut at {cut}");
        }
    }

    proptest! {
        #[test]
        fn what_was_written_comes_back_however_the_file_is_cut_into_chunks(
            events in prop::collection::vec((0u64..5_000_000, any::<bool>(), prop::collection::vec(any::<u8>(), 1..40)), 0..20),
            size in 1usize..200,
        ) {
            let begun = Instant::from_millis(77);
            let mut cast = Cast::begin(Vec::new(), &header(), begun).expect("written");
            let mut at = begun;
            let mut expected = vec![Piece::Header(header())];
            for (micros, from_unit, bytes) in events {
                at += Duration::from_micros(micros);
                let direction = if from_unit { Direction::FromUnit } else { Direction::ToUnit };
                cast.push(at, direction, Secrecy::Open, &bytes).expect("written");
                expected.push(Piece::Bytes { at: Instant::ZERO + at.since(begun), direction, bytes });
            }
            let text = cast.into_inner();
            let chunks: Vec<&[u8]> = text.chunks(size).collect();
            let (mut pieces, ending) = read(&chunks).expect("readable");
            // Seconds are written as decimals of a double: a few nanoseconds may go.
            for piece in &mut pieces {
                if let Piece::Bytes { at, .. } = piece {
                    *at = Instant::from_micros((at.as_nanos() + 500) / 1000);
                }
            }
            prop_assert_eq!(ending, Ending::Whole);
            prop_assert_eq!(pieces, expected);
        }

        #[test]
        fn nothing_makes_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), head in any::<bool>()) {
            let own = b"{\"version\":2,\"axcon\":{\"schema\":\"axcon.recording/1\",\"encoding\":\"latin-1\"}}\n[0,";
            let _ = read(&[if head { own } else { b"" }, &bytes]);
        }
    }
}
