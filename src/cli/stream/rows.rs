//! Rows as they are written: CSV, JSON lines or as they came.

use std::path::Path;

use clap::ValueEnum;
use serde::Serialize;

use super::end::End;
use crate::cli::calendar::Calendar;
use crate::cli::error::{CliError, Kind};
use crate::cli::files::Destination;
use crate::cli::output::{Closed, Output};
use crate::device::Product;
use crate::time::Instant;
use crate::wire::stream::{Reading, Row, Source};

/// How rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    Csv,
    Jsonl,
    Raw,
}

impl Format {
    /// The format that a file's name promises.
    pub fn of_file(file: &Path) -> Option<Self> {
        match file.extension()?.to_str()?.to_lowercase().as_str() {
            "csv" => Some(Format::Csv),
            "jsonl" | "ndjson" => Some(Format::Jsonl),
            "raw" => Some(Format::Raw),
            _ => None,
        }
    }
}

/// Where rows go.
pub struct Sink {
    pub out: Destination,
    pub format: Format,
    /// Rows of another source are left out.
    pub source: Option<Source>,
    pub calendar: Calendar,
    /// How many channels the rows have, once one was written.
    pub channels: Option<usize>,
    /// Rows written so far.
    pub rows: u64,
}

#[derive(Serialize)]
struct RowObject<'a> {
    schema: &'static str,
    time: String,
    source: &'static str,
    values: Vec<ValueObject<'a>>,
}

#[derive(Serialize)]
struct ValueObject<'a> {
    channel: &'a str,
    value: Option<serde_json::Number>,
    state: &'static str,
}

impl Sink {
    /// Writes a row. Returns `false`, and writes nothing, if the row is of a source that is not wanted.
    ///
    /// # Errors
    /// If it is another unit's, cannot be written, or nobody reads it.
    pub fn row(&mut self, at: Instant, row: &Row, raw: &[u8], output: &mut Output) -> Result<bool, End> {
        let now = row.readings.len();
        if let Some(before) = self.channels.filter(|&before| before != now) {
            return Err(another_unit(format!("the unit's rows have {now} values now and had {before}")));
        }
        if self.source.is_some_and(|source| source != row.source) {
            return Ok(false);
        }
        let channels: &[String] = Product::layout_with(now).map_or(&[], |layout| &layout.channels);
        let time = self.calendar.text(at);
        let mut text = Vec::new();
        match self.format {
            Format::Raw => text.extend_from_slice(raw),
            Format::Csv => {
                if self.channels.is_none() {
                    text.extend_from_slice(Row::csv_heading(channels).as_bytes());
                }
                text.extend_from_slice(row.csv(&time).trim_end().as_bytes());
            }
            Format::Jsonl => {
                let values = channels.iter().zip(&row.readings);
                let values = values.map(|(channel, reading)| json_value(channel, row.decimals, *reading)).collect();
                let object = RowObject { schema: "axcon.stream/1", time, source: row.source.short(), values };
                serde_json::to_writer(&mut text, &object).map_err(|error| CliError::new(Kind::Failed, error))?;
            }
        }
        text.push(b'\n');
        self.channels = Some(now);
        self.rows += 1;
        match self.out.append(&text, output) {
            Ok(()) => Ok(true),
            Err(error) if error.error.is::<Closed>() => Err(End::ReaderGone),
            Err(error) => Err(End::Failed(error)),
        }
    }
}

/// The end of a stream that another unit goes on with than the one that was asked.
pub fn another_unit(what: String) -> End {
    const LEFT: &str =
        "another unit answers: its values are not written after those of the first one, and it is left as it is";
    End::UnitGone(CliError::message(Kind::Failed, what).hint(LEFT))
}

fn json_value(channel: &str, decimals: usize, reading: Reading) -> ValueObject<'_> {
    let value = match reading {
        Reading::Value(value) if decimals == 0 => Some(serde_json::Number::from(value as i64)),
        Reading::Value(value) => serde_json::Number::from_f64(value),
        Reading::Disabled | Reading::Open | Reading::Short | Reading::Error => None,
    };
    ValueObject { channel, value, state: reading.state() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_of_a_file_says_what_is_written() {
        let of = |name| Format::of_file(Path::new(name));
        assert_eq!([of("a.jsonl"), of("a.CSV"), of("a.txt")], [Some(Format::Jsonl), Some(Format::Csv), None]);
    }

    #[test]
    fn a_number_in_json_is_the_one_that_was_printed() {
        let json = |decimals, value| json_value("RTD1", decimals, Reading::Value(value)).value.map(|n| n.to_string());
        let written = [json(1, 63.9), json(1, 56.0), json(3, 23.5), json(0, 4768.0)];
        assert_eq!(written.map(Option::unwrap_or_default), ["63.9", "56.0", "23.5", "4768"]);
    }
}
