//! `axcon stream`: the unit's data stream as CSV, JSON lines or as it is.

pub mod found;
mod rows;

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;

use super::error::{CliError, Kind};
use super::files::Destination;
use super::numbers::counted;
use super::output::{Closed, Output};
use super::talk::{Ended, Talk};
use super::{Global, link, numbers};
use crate::device::Product;
use crate::session::{Command, Event, Outcome};
use crate::time::{BITS_PER_CHARACTER, Duration, Instant};
use crate::wire::stream::{Layout, Source};
use found::{Before, leave_as_found, watch};
use rows::{AnotherUnit, Format, Sink, another_unit};

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
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
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

/// Repetition time asked for where the user says nothing (errata E-105: the units' own default).
const PERIOD: Duration = Duration::from_millis(1000);

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
    let duration = args.duration.map(seconds).transpose()?;
    let promised = args.out.as_deref().and_then(Format::of_file);
    let format = output.format(args.format, promised, Format::Jsonl, Format::Csv)?;
    let wanted = args.source.map(|source| match source {
        SourceName::Fv => Source::FieldValue,
        SourceName::Pv => Source::ProcessValue,
    });
    if link::is_recording(global) && (args.off || args.period.is_some() || args.keep) {
        return Err(link::read_only("change its stream"));
    }
    let out = Destination::admit(args.out.as_deref(), global.yes)?;
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    if args.off {
        let outcome = talk.ask(Command::StreamOff)?;
        talk.expect_done(&outcome)?;
        if output.json {
            return output.object(&OffObject { schema: "axcon.stream-off/1", stream: "off" });
        }
        output.remark("axcon: the stream is off");
        return Ok(());
    }
    let sink = Sink { out, format, source: wanted, calendar: talk.calendar(), channels: None, rows: 0 };
    let period = args.period.map(Duration::from_millis);
    let limits = Limits::new(args.count, duration);
    let mut stream = Stream {
        talk,
        sink,
        limits,
        setting: None,
        before: Before::Off,
        is_known: true,
        patience: PATIENCE + SLOWEST * 3,
    };
    if stream.talk.is_recorded() {
        return stream.write_rows(output);
    }
    stream.before = watch(&mut stream.talk)?;
    let found = stream.before.seen();
    let joins = found.is_some_and(|found| period.is_none() && wanted.is_none_or(|wanted| wanted == found.source));
    if let Some(period) = found.and_then(|found| found.period) {
        stream.patience = PATIENCE + period * 3;
    }
    let begun = if joins {
        Ok(())
    } else {
        let source = wanted.or(found.map(|found| found.source)).unwrap_or(Source::FieldValue);
        let period = period.or(found.and_then(|found| found.period)).unwrap_or(PERIOD);
        warn_of_rate(&stream.talk, source, period, global.baud, output);
        stream.switch_on(source, period, output)
    };
    let written = begun.and_then(|()| stream.keep_writing(Duration::from_secs(args.reconnect), output));
    let Stream { mut talk, setting, before, is_known, .. } = stream;
    // However it ended, and also if the first row never came: what has been changed is changed back.
    let is_gone = written.as_ref().is_err_and(|error| {
        error.kind == Kind::PortGone || error.error.is::<AnotherUnit>() || error.error.is::<NoRows>()
    });
    let left = if setting.is_none() || args.keep || is_gone {
        Ok(())
    } else if is_known {
        leave_as_found(&mut talk, before, output)
    } else {
        output.remark("axcon: the unit has not shown itself again, so no key is pressed: its stream is left as it is");
        Ok(())
    };
    let written = match written {
        // The reader of our output has enough: that is a way to end.
        Err(error) if error.error.is::<Closed>() => Ok(()),
        written => written,
    };
    written.and(left)
}

/// When it is enough.
struct Limits {
    count: Option<u64>,
    duration: Option<Duration>,
    /// When the time is over, once the first row has begun it.
    until: Instant,
}

impl Limits {
    fn new(count: Option<u64>, duration: Option<Duration>) -> Self {
        Limits { count, duration, until: Instant::NEVER }
    }

    /// Whether it is enough, with this many rows at this moment. The first row begins the time.
    fn reached(&mut self, rows: u64, now: Instant) -> bool {
        self.begin(rows, now);
        self.has_all(rows) || self.until <= now
    }

    /// Begins the time if there is one and it has not begun; says whether it has now.
    fn begin(&mut self, rows: u64, at: Instant) -> bool {
        let Some(duration) = self.duration.filter(|_| rows > 0 && self.until == Instant::NEVER) else { return false };
        self.until = at + duration;
        true
    }

    fn has_all(&self, rows: u64) -> bool {
        self.count.is_some_and(|count| rows >= count)
    }
}

/// A stream being written down.
struct Stream {
    talk: Talk,
    sink: Sink,
    limits: Limits,
    /// What the stream was switched to, if that was begun.
    setting: Option<(Source, Duration)>,
    /// What it was before, as far as is known.
    before: Before,
    /// Whether the unit has shown itself since the link was opened: another one, or something else, may be behind a
    /// cable that is back, and takes every key for its own.
    is_known: bool,
    /// How long no row may come.
    patience: Duration,
}

/// How long no row may come, beside three periods: a unit that restarts needs up to 6 s, goes on by itself, and may do
/// so twice; later than that it is not coming back.
const PATIENCE: Duration = Duration::from_secs(15);

/// The longest period a unit takes: that of a stream of which too little was seen to know it.
const SLOWEST: Duration = Duration::from_secs(60);

/// How long the rows of a unit that was on all the time may take to come after a cable is back, beside their
/// period: a unit that was switched off as well has none for up to 5 s (AXRTD8CO manual, section 1.1).
const ROWS_AGAIN: Duration = Duration::from_secs(7);

impl Stream {
    /// Switches the stream on. The row that proves it is the first one written.
    fn switch_on(&mut self, source: Source, period: Duration, output: &mut Output) -> Result<(), CliError> {
        // What is found on after the cable has come back is our own.
        let is_first = self.setting.replace((source, period)).is_none();
        self.patience = PATIENCE + period * 3;
        let mut proof = None;
        let ended = self.talk.run(Command::StreamOn { source, period }, |session, event| {
            if let Event::Row { at, span, row } = event {
                proof = Some((*at, row.clone(), session.record().bytes(*span)));
            }
            Ok(())
        })?;
        match ended {
            Ended::Finished { outcome: Outcome::StreamRuns { was_on }, interrupted: false } => {
                if was_on && is_first {
                    self.before.was_on();
                }
            }
            Ended::Finished { outcome, interrupted: false } => return self.talk.expect_done(&outcome),
            Ended::Finished { interrupted: true, .. } => return Err(CliError::interrupted()),
            Ended::Lost { error, .. } => return Err(error),
        }
        match proof {
            Some((at, row, raw)) => self.sink.row(at, &row, &raw, output).map(drop),
            None => Ok(()),
        }
    }

    /// Writes rows until it is enough, also over a cable that was pulled out in between.
    fn keep_writing(&mut self, patience: Duration, output: &mut Output) -> Result<(), CliError> {
        loop {
            let lost = match self.write_rows(output) {
                Err(error) if error.kind == Kind::PortGone => error,
                ended => return ended,
            };
            self.is_known = false;
            let is_back = self.talk.reconnect(lost, patience, output)?;
            if !(is_back && self.ask_again(output)?) {
                return self.had_enough();
            }
        }
    }

    /// A unit that has lost its power with the cable may have come back without its stream. `Ok(false)` if the user has
    /// had enough.
    fn ask_again(&mut self, output: &mut Output) -> Result<bool, CliError> {
        let Some((source, period)) = self.setting else { return Ok(true) };
        let until = self.talk.now() + ROWS_AGAIN + period;
        let (sink, is_known) = (&mut self.sink, &mut self.is_known);
        let undisturbed = self.talk.listen(until, |session, event| {
            let Event::Row { at, span, row } = event else { return Ok(ControlFlow::Continue(())) };
            // Rows of another source are those of a stream that has to be switched.
            if !sink.row(*at, row, &session.record().bytes(*span), output)? {
                return Ok(ControlFlow::Continue(()));
            }
            *is_known = true;
            Ok(ControlFlow::Break(()))
        })?;
        if undisturbed && !self.is_known {
            let product = |talk: &Talk| talk.session().facts().product.as_ref().map(|known| known.value.clone());
            let before = product(&self.talk);
            self.talk.find_application()?;
            let now = product(&self.talk);
            if let (Some(before), Some(now)) = (before, now)
                && before != now
            {
                return Err(another_unit(format!("the unit is an {now} now and was an {before}")));
            }
            self.is_known = true;
            self.switch_on(source, period, output)?;
        }
        Ok(undisturbed)
    }

    fn write_rows(&mut self, output: &mut Output) -> Result<(), CliError> {
        let mut last = self.talk.now();
        while !self.limits.reached(self.sink.rows, self.talk.now()) {
            // A recording ends by itself.
            let silent_at = if self.talk.is_recorded() { Instant::NEVER } else { last + self.patience };
            let until = self.limits.until.min(silent_at);
            let (sink, limits) = (&mut self.sink, &mut self.limits);
            let mut is_limited = false;
            let undisturbed = self.talk.listen(until, |session, event| {
                let Event::Row { at, span, row } = event else { return Ok(ControlFlow::Continue(())) };
                if !sink.row(*at, row, &session.record().bytes(*span), output)? {
                    return Ok(ControlFlow::Continue(()));
                }
                last = *at;
                // Either it is enough, or the time has got an end.
                is_limited = limits.begin(sink.rows, *at) || limits.has_all(sink.rows);
                Ok(if is_limited { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            if !undisturbed {
                return self.had_enough();
            }
            if is_limited || self.limits.until <= self.talk.now() {
                continue;
            }
            if self.talk.is_recorded() {
                return self.recording_is_over(output);
            }
            if last + self.patience <= self.talk.now() {
                return Err(self.no_rows());
            }
        }
        Ok(())
    }

    /// A recording has no more rows than it has.
    fn recording_is_over(&self, output: &mut Output) -> Result<(), CliError> {
        let rows = counted(self.sink.rows, "row");
        match (self.sink.rows, self.limits.count) {
            (0, _) => {
                let what = self.sink.source.map_or("", |source| match source {
                    Source::FieldValue => " with field values",
                    Source::ProcessValue => " with process values",
                });
                Err(CliError::message(Kind::NoAnswer, format!("the recording has no row of the stream{what}")))
            }
            (_, Some(count)) => {
                output.remark(&format!("axcon: the recording has no more: {rows} of {count} written"));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The user has interrupted: the normal end where nothing else was to end it and something has come.
    fn had_enough(&self) -> Result<(), CliError> {
        let Limits { count, duration, .. } = self.limits;
        let rows = counted(self.sink.rows, "row");
        let message = match (count, duration) {
            (Some(count), _) => format!("interrupted: {rows} of {count} written"),
            (None, Some(duration)) => {
                format!("interrupted before {} s were over: {rows} written", duration.as_secs_f64())
            }
            (None, None) if self.sink.rows > 0 => return Ok(()),
            (None, None) => "interrupted: no row has come".to_owned(),
        };
        Err(CliError::message(Kind::Interrupted, message))
    }

    fn no_rows(&self) -> CliError {
        let written = match self.sink.rows {
            0 => "nothing is written".to_owned(),
            rows => format!("what came before is written: {}", counted(rows, "row")),
        };
        let state = match self.setting {
            Some(_) => "the stream was not switched off: should the unit come back it may go on; 'axcon stream --off'",
            None => "the stream was on before, and nothing was done to it",
        };
        CliError::new(Kind::NoAnswer, NoRows { seconds: self.patience.as_secs_f64() })
            .hint("has the unit power, and is its cable in? 'axcon identify' says whether it answers")
            .hint("if it does, somebody has switched its stream off: run the same command again")
            .hint(written)
            .hint(state)
    }
}

/// A unit that has streamed is silent.
#[derive(Debug, thiserror::Error)]
#[error("no row has come for {seconds} s: the unit does not stream any more")]
struct NoRows {
    seconds: f64,
}

/// Says so if the line cannot carry the rate.
fn warn_of_rate(talk: &Talk, source: Source, period: Duration, baud: u32, output: &mut Output) {
    let Some(layout) = layout(talk) else { return };
    let characters = layout.row_characters(source);
    let asked = characters as f64 / period.as_secs_f64();
    let carries = f64::from(baud) / f64::from(BITS_PER_CHARACTER);
    if asked > carries {
        let most = (characters as f64 / carries * 1000.0).ceil();
        output.remark(&format!(
            "axcon: a row of {characters} characters every {} ms is {asked:.0} characters/s; the line carries \
             {carries:.0}, a row every {most} ms: the unit will leave rows out",
            period.as_millis()
        ));
    }
}

fn layout(talk: &Talk) -> Option<&'static Layout> {
    let product = talk.session().facts().product.as_ref()?;
    Product::named(&product.value).map(|product| &product.stream)
}

fn seconds(seconds: f64) -> Result<Duration, CliError> {
    let duration = Duration::try_from_secs_f64(seconds).ok();
    duration.filter(|duration| !duration.is_zero() && *duration <= LONGEST).ok_or_else(|| {
        let message = format!("--duration {seconds:?} is not between a nanosecond and a year, in seconds");
        CliError::message(Kind::Usage, message)
    })
}

/// A stream for longer than this is one without --duration.
const LONGEST: Duration = Duration::from_secs(366 * 24 * 3600);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::output::Remarks;

    fn nowhere() -> Output {
        Output { json: false, out: Box::new(std::io::sink()), err: Remarks::to(std::io::sink()) }
    }

    /// At a unit whose stream is off.
    fn stream(limits: Limits, patience: Duration) -> Stream {
        let global = Global {
            ports: vec!["emu:axtc4co".into()],
            baud: 115_200,
            json: false,
            yes: false,
            record: None,
            no_record: true,
        };
        let talk = Talk::open(&global, &mut nowhere()).expect("an emulated unit");
        let out = Destination::admit(None, false).expect("always there");
        let sink = Sink { out, format: Format::Csv, source: None, calendar: talk.calendar(), channels: None, rows: 0 };
        Stream { talk, sink, limits, setting: None, before: Before::Off, is_known: true, patience }
    }

    #[test]
    fn a_unit_that_streams_no_more_is_not_waited_for_for_ever() {
        let mut stream = stream(Limits::new(None, None), Duration::from_millis(200));
        stream.setting = Some((Source::FieldValue, PERIOD));
        let error = stream.write_rows(&mut nowhere()).expect_err("nothing comes");
        assert_eq!(error.kind, Kind::NoAnswer);
        assert_eq!(error.to_string(), "no row has come for 0.2 s: the unit does not stream any more");
        assert!(error.hints.iter().any(|hint| hint.contains("stream --off")), "{:?}", error.hints);
        stream.limits.duration = Some(Duration::from_millis(50));
        assert!(stream.write_rows(&mut nowhere()).is_err(), "a first row begins the time that was asked for");
        stream.sink.rows = 1;
        assert!(stream.write_rows(&mut nowhere()).is_ok(), "and now it is over before");
    }

    #[test]
    fn an_interrupt_is_the_normal_end_only_where_nothing_else_is_awaited() {
        let mut stream = stream(Limits::new(None, None), SLOWEST);
        let said = |stream: &Stream| stream.had_enough().map_err(|error| (error.kind, error.to_string()));
        let interrupted = |what: &str| Err((Kind::Interrupted, what.to_owned()));
        assert_eq!(said(&stream), interrupted("interrupted: no row has come"));
        stream.sink.rows = 3;
        assert_eq!(said(&stream), Ok(()));
        stream.limits = Limits::new(Some(9), None);
        assert_eq!(said(&stream), interrupted("interrupted: 3 rows of 9 written"));
        stream.limits = Limits::new(None, Some(Duration::from_millis(1500)));
        assert_eq!(said(&stream), interrupted("interrupted before 1.5 s were over: 3 rows written"));
    }
}
