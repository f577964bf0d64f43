//! `axcon stream`: the unit's data stream as CSV, JSON lines or as it is.
//!
//! Here it is opened and left. What lies between is in `writing.rs`, how a row is written in `rows.rs`, what the stream
//! was before in `found.rs`.

mod end;
pub mod found;
mod rows;
mod writing;

use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;

use super::error::CliError;
use super::files::Destination;
use super::output::Output;
use super::talk::Talk;
use super::{Global, link, numbers};
use crate::session::Command;
use crate::time::Duration;
use crate::wire::stream::Source;
use end::End;
use rows::{Format, Sink};
use writing::{Limits, Stream};

/// Arguments of `axcon stream`.
///
/// The stream is switched on, written until it is enough (or Ctrl-C), and left as it was found. A stream that runs
/// already is joined, unless another source or period is asked for. A recording's rows are written with the times they
/// had. Exit code 4 if no row comes for 15 s and three periods: what came before is written.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Field values (fv: °C) or process values (pv: counts).
    #[arg(long, value_enum)]
    source: Option<SourceName>,
    /// Repetition time in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true, value_parser = numbers::within::<u64>(1..=60_000))]
    period: Option<u64>,
    /// How rows are written. Otherwise FILE's ending says so (.csv, .jsonl, .raw), or --json.
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Write to FILE instead of standard output. It is made with the first row; an existing one needs --yes.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// End after N rows. Exit code 130 if an interrupt comes first, as with --duration; without both it is the normal end.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::within::<u64>(1..=u64::MAX))]
    count: Option<u64>,
    /// End S seconds after the first row.
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = numbers::seconds)]
    duration: Option<Duration>,
    /// Leave the stream on.
    #[arg(long)]
    keep: bool,
    /// How long to wait for an adapter that was pulled out before giving up; 0 gives up at once.
    #[arg(long, value_name = "S", default_value_t = 10, allow_negative_numbers = true, value_parser = numbers::within::<u64>(0..=u64::MAX))]
    reconnect: u64,
    /// Switch the stream off and do nothing else.
    #[arg(long, conflicts_with_all = ["source", "period", "format", "out", "count", "duration", "keep"])]
    off: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SourceName {
    Fv,
    Pv,
}

impl SourceName {
    fn source(self) -> Source {
        match self {
            SourceName::Fv => Source::FieldValue,
            SourceName::Pv => Source::ProcessValue,
        }
    }
}

#[derive(Serialize)]
struct OffObject {
    schema: &'static str,
    stream: &'static str,
}

/// Streams.
///
/// # Errors
/// If the link does not open, no unit answers, or the unit does not do as asked.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let promised = args.out.as_deref().and_then(Format::of_file);
    let format = output.format(args.format, promised, Format::Jsonl, Format::Csv)?;
    if link::is_recording(global) && (args.off || args.period.is_some() || args.keep) {
        return Err(link::read_only("change its stream"));
    }
    let out = Destination::admit(args.out.as_deref(), global.yes)?;
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    if args.off {
        return switch_off(&mut talk, output);
    }
    let (is_recorded, calendar) = (talk.is_recorded(), talk.calendar());
    let source = args.source.map(SourceName::source);
    let sink = Sink { out, format, source, calendar, channels: None, rows: 0 };
    let mut stream = Stream::new(talk, sink, Limits::new(args.count, args.duration));
    if is_recorded {
        return stream.write_rows(output).or_else(End::result);
    }
    let begun = stream.begin(args.period.map(Duration::from_millis), global.baud, output);
    let written = begun.and_then(|()| stream.keep_writing(Duration::from_secs(args.reconnect), output));
    // However it ended, and also if the first row never came.
    let left = match &written {
        Err(End::LinkLost(_) | End::UnitGone(_)) => Ok(()),
        _ if args.keep => Ok(()),
        Ok(()) | Err(End::ReaderGone | End::Failed(_)) => stream.leave_as_found(output),
    };
    written.or_else(End::result).and(left)
}

fn switch_off(talk: &mut Talk, output: &mut Output) -> Result<(), CliError> {
    let outcome = talk.ask(Command::StreamOff)?;
    talk.expect_done(&outcome)?;
    if output.json {
        return output.object(&OffObject { schema: "axcon.stream-off/1", stream: "off" });
    }
    output.remark("axcon: the stream is off");
    Ok(())
}
