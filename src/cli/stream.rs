//! `axcon stream`: the unit's data stream as CSV, JSON lines or as it is.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;

use super::Global;
use super::error::{CliError, Kind};
use super::output::{Closed, Output};
use super::talk::{Talk, expect_done};
use crate::device::Product;
use crate::host::clock::Clock;
use crate::session::{Command, Event, Outcome};
use crate::time::{Duration, Instant};
use crate::wire::stream::{Layout, Reading, Row, Source};

/// Arguments of `axcon stream`.
///
/// The stream is switched on, written until it is enough (or Ctrl-C), and left as it was found. A stream that runs
/// already is joined, unless another source or period is asked for.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Field values (fv: °C) or process values (pv: counts).
    #[arg(long, value_enum)]
    source: Option<SourceName>,
    /// Repetition time in ms.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=60_000))]
    period: Option<u64>,
    /// How rows are written. JSON lines if --json is given.
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Write to FILE instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// End after N rows.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
    /// End after S seconds.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Leave the stream on.
    #[arg(long)]
    keep: bool,
    /// Switch the stream off and do nothing else.
    #[arg(long, conflicts_with_all = ["source", "period", "format", "out", "count", "duration", "keep"])]
    off: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SourceName {
    Fv,
    Pv,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
    Jsonl,
    Raw,
}

/// Repetition time asked for where the user says nothing (errata E-105: the units' own default).
const PERIOD: Duration = Duration::from_millis(1000);

/// Characters a second at 115,200 baud, 8N1.
const CHARACTERS_PER_SECOND: f64 = 11_520.0;

/// How long the beginnings of a running stream are watched for.
const LISTEN_FIRST: Duration = Duration::from_millis(1200);

/// Streams.
///
/// # Errors
/// If the link does not open, no unit answers, or the unit does not do as asked.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let duration = args.duration.map(seconds).transpose()?;
    let format = args.format.unwrap_or(if output.json { Format::Jsonl } else { Format::Csv });
    let file = args.out.as_ref().map(create).transpose()?;
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    if args.off {
        let outcome = talk.ask(Command::StreamOff)?;
        talk.close(output);
        return expect_done(outcome);
    }
    let found = watch(&mut talk)?;
    let wanted = args.source.map(|source| match source {
        SourceName::Fv => Source::FieldValue,
        SourceName::Pv => Source::ProcessValue,
    });
    let period = args.period.map(Duration::from_millis);
    let joins = found.is_some_and(|found| period.is_none() && wanted.is_none_or(|wanted| wanted == found.source));
    let mut was_on = found.is_some();
    if !joins {
        let source = wanted.or(found.map(|found| found.source)).unwrap_or(Source::FieldValue);
        let period = period.or(found.and_then(|found| found.period)).unwrap_or(PERIOD);
        warn_of_rate(&talk, source, period, output);
        match talk.ask(Command::StreamOn { source, period })? {
            Outcome::StreamRuns { was_on: on } => was_on |= on,
            other => expect_done(other)?,
        }
    }
    let mut sink = Sink { file, format, clock: talk.clock(), header_written: false, rows: 0 };
    let written = write_rows(&mut talk, &mut sink, args.count, duration, output);
    let left = if args.keep || (joins && was_on) { Ok(()) } else { leave_as_found(&mut talk, was_on, found, output) };
    let flushed = sink.flush();
    talk.close(output);
    written.and(left).and(flushed)
}

/// A stream that was on before we came.
#[derive(Clone, Copy, Debug)]
struct Found {
    source: Source,
    /// Time between its rows, as far as two were seen.
    period: Option<Duration>,
}

/// Looks for a stream that runs already.
fn watch(talk: &mut Talk) -> Result<Option<Found>, CliError> {
    let mut first: Option<(Instant, Source)> = None;
    let mut last = None;
    let mut rows = 0u32;
    let until = talk.now() + LISTEN_FIRST;
    talk.listen(until, |_, event| {
        if let Event::Row { at, row, .. } = event {
            first.get_or_insert((*at, row.source));
            last = Some((*at, row.source));
            rows += 1;
        }
        Ok(ControlFlow::Continue(()))
    })?;
    Ok(first.zip(last).map(|((begun, _), (ended, source))| {
        let period = (rows > 1).then(|| ended.since(begun) / (rows - 1));
        // Rows come at whole milliseconds; the clock that saw them is not that exact.
        let period =
            period.map(|period| Duration::from_millis((period.as_secs_f64() * 1000.0).round().max(1.0) as u64));
        Found { source, period }
    }))
}

fn write_rows(
    talk: &mut Talk,
    sink: &mut Sink,
    count: Option<u64>,
    duration: Option<Duration>,
    output: &mut Output,
) -> Result<(), CliError> {
    let until = duration.map_or(Instant::NEVER, |duration| talk.now() + duration);
    let result = talk.listen(until, |session, event| {
        if let Event::Row { at, span, row } = event {
            sink.row(*at, row, &session.record().bytes(*span), output)?;
        }
        Ok(if count.is_some_and(|count| sink.rows >= count) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    });
    match result {
        Ok(_) => Ok(()),
        // Whoever read our output has enough: that is a way to end.
        Err(error) if error.error.is::<Closed>() => Ok(()),
        Err(error) => Err(error),
    }
}

/// Puts the stream back to what it was.
fn leave_as_found(talk: &mut Talk, was_on: bool, found: Option<Found>, output: &mut Output) -> Result<(), CliError> {
    match (was_on, found) {
        (false, _) => expect_done(talk.ask(Command::StreamOff)?),
        (true, Some(Found { source, period: Some(period) })) => {
            expect_done(talk.ask(Command::StreamOn { source, period })?)
        }
        (true, _) => {
            output.remark("axcon: the stream was on before, at a rate too slow to be seen; it is left at the new one");
            Ok(())
        }
    }
}

/// Says so if the line cannot carry the rate.
fn warn_of_rate(talk: &Talk, source: Source, period: Duration, output: &mut Output) {
    let Some(layout) = layout(talk) else { return };
    let format = layout.format(source);
    let width = format.widths.first().copied().unwrap_or_default();
    let characters = (width + 1) * layout.channels.len() + 1;
    let asked = characters as f64 / period.as_secs_f64();
    if asked > CHARACTERS_PER_SECOND {
        let most = (characters as f64 / CHARACTERS_PER_SECOND * 1000.0).ceil();
        output.remark(&format!(
            "axcon: a row of {characters} characters every {} ms is {asked:.0} characters/s; the line carries \
             {CHARACTERS_PER_SECOND:.0}, a row every {most} ms: the unit will leave rows out",
            period.as_millis()
        ));
    }
}

fn layout(talk: &Talk) -> Option<&'static Layout> {
    let product = talk.session().facts().product.as_ref()?;
    Product::named(&product.value).map(|product| &product.stream)
}

/// Where rows go.
struct Sink {
    file: Option<(PathBuf, BufWriter<File>)>,
    format: Format,
    clock: Clock,
    header_written: bool,
    rows: u64,
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
    fn row(&mut self, at: Instant, row: &Row, raw: &[u8], output: &mut Output) -> Result<(), CliError> {
        let channels = channels_of(row);
        let time = self.clock.wall(at).strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string();
        let mut text = Vec::new();
        match self.format {
            Format::Raw => text.extend_from_slice(raw),
            Format::Csv => {
                if !self.header_written {
                    text.extend_from_slice(format!("time,source,{}\n", channels.join(",")).as_bytes());
                }
                let values: Vec<String> = row.readings.iter().map(|reading| csv_value(row.source, *reading)).collect();
                text.extend_from_slice(format!("{time},{},{}", name(row.source), values.join(",")).as_bytes());
            }
            Format::Jsonl => {
                let values = channels.iter().zip(&row.readings);
                let values = values.map(|(channel, reading)| json_value(channel, row.source, *reading)).collect();
                let object = RowObject { schema: "axcon.stream/1", time, source: name(row.source), values };
                serde_json::to_writer(&mut text, &object).map_err(|error| CliError::new(Kind::Failed, error))?;
            }
        }
        text.push(b'\n');
        self.header_written = true;
        self.rows += 1;
        match &mut self.file {
            None => output.data(&text),
            Some((path, file)) => {
                file.write_all(&text).and_then(|()| file.flush()).map_err(|error| file_error(path, error))
            }
        }
    }

    fn flush(&mut self) -> Result<(), CliError> {
        match &mut self.file {
            None => Ok(()),
            Some((path, file)) => file.flush().map_err(|error| file_error(path, error)),
        }
    }
}

/// Names of a row's fields, from the layout that has as many.
fn channels_of(row: &Row) -> &'static [String] {
    Product::all()
        .iter()
        .map(|product| product.stream.channels.as_slice())
        .find(|channels| channels.len() == row.readings.len())
        .unwrap_or_default()
}

fn name(source: Source) -> &'static str {
    match source {
        Source::FieldValue => "fv",
        Source::ProcessValue => "pv",
    }
}

fn csv_value(source: Source, reading: Reading) -> String {
    match reading {
        Reading::Value(value) if source == Source::ProcessValue => format!("{value:.0}"),
        Reading::Value(value) => format!("{value:.3}"),
        Reading::Disabled | Reading::Open | Reading::Short | Reading::Error => state(reading).to_owned(),
    }
}

fn json_value(channel: &str, source: Source, reading: Reading) -> ValueObject<'_> {
    let value = match reading {
        Reading::Value(value) if source == Source::ProcessValue => Some(serde_json::Number::from(value as i64)),
        Reading::Value(value) => serde_json::Number::from_f64(value),
        Reading::Disabled | Reading::Open | Reading::Short | Reading::Error => None,
    };
    ValueObject { channel, value, state: state(reading) }
}

fn state(reading: Reading) -> &'static str {
    match reading {
        Reading::Value(_) => "ok",
        Reading::Disabled => "disabled",
        Reading::Open => "open",
        Reading::Short => "short",
        Reading::Error => "error",
    }
}

fn seconds(seconds: f64) -> Result<Duration, CliError> {
    Duration::try_from_secs_f64(seconds).ok().filter(|duration| !duration.is_zero()).ok_or_else(|| {
        CliError::message(Kind::Usage, format!("--duration {seconds} is not a length of time in seconds"))
    })
}

fn create(path: &PathBuf) -> Result<(PathBuf, BufWriter<File>), CliError> {
    match File::create(path) {
        Ok(file) => Ok((path.clone(), BufWriter::new(file))),
        Err(error) => Err(file_error(path, error)),
    }
}

fn file_error(path: &std::path::Path, error: std::io::Error) -> CliError {
    CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot write '{}'", path.display())))
}
