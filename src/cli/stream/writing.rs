//! A stream on its way to a file: begun, written until it is enough, and left as it was found.

use std::ops::ControlFlow;

use super::end::End;
use super::found::{Before, leave_as_found, watch};
use super::rows::{Sink, another_unit};
use crate::cli::error::{CliError, Kind};
use crate::cli::numbers::counted;
use crate::cli::output::Output;
use crate::cli::talk::{Ended, Talk};
use crate::device::Product;
use crate::session::{Command, Event, Outcome};
use crate::time::{BITS_PER_CHARACTER, Duration, Instant};
use crate::wire::stream::{Layout, Source};

/// Repetition time asked for where the user says nothing (errata E-105: the units' own default).
const PERIOD: Duration = Duration::from_millis(1000);

/// How long no row may come, beside three periods: a unit that restarts needs up to 6 s, goes on by itself, and may do
/// so twice; later than that it is not coming back.
const PATIENCE: Duration = Duration::from_secs(15);

/// The longest period a unit takes: that of a stream of which too little was seen to know it.
const SLOWEST: Duration = Duration::from_secs(60);

/// How long rows are waited for once a cable is back, beside their period, before the unit is asked again. A unit that
/// has lost its power with the cable has none for up to 5 s (AXRTD8CO manual, section 1.1).
const ROWS_AGAIN: Duration = Duration::from_secs(7);

/// When it is enough.
pub struct Limits {
    count: Option<u64>,
    duration: Option<Duration>,
    /// When the time is over, once the first row has begun it.
    until: Instant,
}

impl Limits {
    /// After so many rows, or so long after the first one, whichever comes first.
    pub fn new(count: Option<u64>, duration: Option<Duration>) -> Self {
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
pub struct Stream {
    talk: Talk,
    sink: Sink,
    limits: Limits,
    /// What the stream was switched to, if that was begun.
    setting: Option<(Source, Duration)>,
    /// What it was before, as far as is known.
    before: Before,
    /// Whether the unit has shown itself since the link was last opened. A cable that is back may lead to another unit,
    /// or to something else that obeys every key.
    is_known: bool,
    /// How long no row may come.
    patience: Duration,
}

impl Stream {
    /// A stream of which nothing is known yet.
    pub fn new(talk: Talk, sink: Sink, limits: Limits) -> Self {
        Stream {
            talk,
            sink,
            limits,
            setting: None,
            before: Before::Off,
            is_known: true,
            patience: PATIENCE + SLOWEST * 3,
        }
    }

    /// Joins a stream that runs already as it is wanted, or else switches it. `period` is the one that was asked for,
    /// `baud` the rate of the line.
    ///
    /// # Errors
    /// If the unit does not do as asked, the link is lost, or the user interrupts.
    pub fn begin(&mut self, period: Option<Duration>, baud: u32, output: &mut Output) -> Result<(), End> {
        self.before = watch(&mut self.talk)?;
        let (found, wanted) = (self.before.seen(), self.sink.source);
        if let Some(period) = found.and_then(|found| found.period) {
            self.patience = PATIENCE + period * 3;
        }
        if found.is_some_and(|found| period.is_none() && wanted.is_none_or(|wanted| wanted == found.source)) {
            return Ok(());
        }
        let source = wanted.or(found.map(|found| found.source)).unwrap_or(Source::FieldValue);
        let period = period.or(found.and_then(|found| found.period)).unwrap_or(PERIOD);
        warn_of_rate(&self.talk, source, period, baud, output);
        self.switch_on(source, period, output)
    }

    /// Switches the stream on. The row that proves it is the first one written.
    fn switch_on(&mut self, source: Source, period: Duration, output: &mut Output) -> Result<(), End> {
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
            Ended::Finished { outcome, interrupted: false } => {
                return self.talk.expect_done(&outcome).map_err(End::from);
            }
            Ended::Finished { interrupted: true, .. } => return Err(End::Failed(CliError::interrupted())),
            Ended::Lost { error, .. } => return Err(End::from(error)),
        }
        match proof {
            Some((at, row, raw)) => self.sink.row(at, &row, &raw, output).map(drop),
            None => Ok(()),
        }
    }

    /// Writes rows until it is enough, also over a cable that was pulled out in between and is back within `patience`.
    ///
    /// # Errors
    /// If it ends before.
    pub fn keep_writing(&mut self, patience: Duration, output: &mut Output) -> Result<(), End> {
        loop {
            let lost = match self.write_rows(output) {
                Err(End::LinkLost(error)) => error,
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
    fn ask_again(&mut self, output: &mut Output) -> Result<bool, End> {
        let Some((source, period)) = self.setting else { return Ok(true) };
        let until = self.talk.now() + ROWS_AGAIN + period;
        let (sink, is_known) = (&mut self.sink, &mut self.is_known);
        let undisturbed = self.talk.listen::<End>(until, |session, event| {
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

    /// Writes rows until it is enough, or a recording ends.
    ///
    /// # Errors
    /// If it ends before.
    pub fn write_rows(&mut self, output: &mut Output) -> Result<(), End> {
        let mut last = self.talk.now();
        while !self.limits.reached(self.sink.rows, self.talk.now()) {
            // A recording ends by itself.
            let silent_at = if self.talk.is_recorded() { Instant::NEVER } else { last + self.patience };
            let until = self.limits.until.min(silent_at);
            let (sink, limits) = (&mut self.sink, &mut self.limits);
            let mut is_limited = false;
            let undisturbed = self.talk.listen::<End>(until, |session, event| {
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
                return Err(End::UnitGone(self.no_rows()));
            }
        }
        Ok(())
    }

    /// Changes back what has been changed. A unit that has not shown itself is left alone.
    ///
    /// # Errors
    /// If the unit does not do as asked.
    pub fn leave_as_found(&mut self, output: &mut Output) -> Result<(), CliError> {
        match self.setting {
            None => Ok(()),
            Some(_) if self.is_known => leave_as_found(&mut self.talk, self.before, output),
            Some(_) => {
                output.remark(
                    "axcon: the unit has not shown itself again, so no key is pressed: its stream is left as it is",
                );
                Ok(())
            }
        }
    }

    /// A recording has no more rows than it has.
    fn recording_is_over(&self, output: &mut Output) -> Result<(), End> {
        let rows = counted(self.sink.rows, "row");
        match (self.sink.rows, self.limits.count) {
            (0, _) => {
                let what = self.sink.source.map_or("", |source| match source {
                    Source::FieldValue => " with field values",
                    Source::ProcessValue => " with process values",
                });
                let message = format!("the recording has no row of the stream{what}");
                Err(End::Failed(CliError::message(Kind::NoAnswer, message)))
            }
            (_, Some(count)) => {
                output.remark(&format!("axcon: the recording has no more: {rows} of {count} written"));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// The user has interrupted: the normal end where nothing else was to end it and something has come.
    fn had_enough(&self) -> Result<(), End> {
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
        Err(End::Failed(CliError::message(Kind::Interrupted, message)))
    }

    /// The error of a unit that has streamed and is silent.
    fn no_rows(&self) -> CliError {
        let seconds = self.patience.as_secs_f64();
        let written = match self.sink.rows {
            0 => "nothing is written".to_owned(),
            rows => format!("what came before is written: {}", counted(rows, "row")),
        };
        let state = match self.setting {
            Some(_) => "the stream was not switched off: should the unit come back it may go on; 'axcon stream --off'",
            None => "the stream was on before, and nothing was done to it",
        };
        let message = format!("no row has come for {seconds} s: the unit does not stream any more");
        CliError::message(Kind::NoAnswer, message)
            .hint("has the unit power, and is its cable in? 'axcon identify' says whether it answers")
            .hint("if it does, somebody has switched its stream off: run the same command again")
            .hint(written)
            .hint(state)
    }
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

#[cfg(test)]
mod tests {
    use super::super::rows::Format;
    use super::*;
    use crate::cli::Global;
    use crate::cli::files::Destination;
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
        Stream { patience, ..Stream::new(talk, sink, limits) }
    }

    #[test]
    fn a_unit_that_streams_no_more_is_not_waited_for_for_ever() {
        let mut stream = stream(Limits::new(None, None), Duration::from_millis(200));
        stream.setting = Some((Source::FieldValue, PERIOD));
        let Err(End::UnitGone(error)) = stream.write_rows(&mut nowhere()) else { panic!("nothing comes") };
        assert_eq!(error.kind, Kind::NoAnswer);
        assert_eq!(error.to_string(), "no row has come for 0.2 s: the unit does not stream any more");
        assert!(error.hints.iter().any(|hint| hint.contains("stream --off")), "{:?}", error.hints);
        stream.limits.duration = Some(Duration::from_millis(50));
        assert!(stream.write_rows(&mut nowhere()).is_err(), "a first row begins the time that was asked for");
        stream.sink.rows = 1;
        assert!(stream.write_rows(&mut nowhere()).is_ok(), "and now it is over before");
    }

    #[test]
    fn rows_of_another_source_are_not_written_and_keep_no_stream_waiting() {
        let (sender, ended) = std::sync::mpsc::channel();
        // In a thread of its own: whoever took them for a sign of life would wait for ever.
        std::thread::spawn(move || {
            let mut stream = stream(Limits::new(None, None), PERIOD);
            stream.talk.find_application().expect("it runs");
            let period = Duration::from_millis(50);
            let on = stream.talk.ask(Command::StreamOn { source: Source::FieldValue, period }).expect("it answers");
            assert_eq!(on, Outcome::StreamRuns { was_on: false });
            stream.sink.source = Some(Source::ProcessValue);
            let before = stream.talk.session().record().received();
            let end = stream.write_rows(&mut nowhere());
            let heard = stream.talk.session().record().received() - before;
            let _ = sender.send((end, heard, stream.sink.rows));
        });
        let ended = ended.recv_timeout(Duration::from_secs(20));
        let (end, heard, written) = ended.expect("they are no sign of life");
        let Err(End::UnitGone(error)) = end else { panic!("{end:?}") };
        assert_eq!((error.kind, written), (Kind::NoAnswer, 0), "{error}");
        assert!(heard > 0, "rows have come");
    }

    #[test]
    fn an_interrupt_is_the_normal_end_only_where_nothing_else_is_awaited() {
        let mut stream = stream(Limits::new(None, None), SLOWEST);
        let said = |stream: &Stream| {
            let end = stream.had_enough().or_else(End::result);
            end.map_err(|error| (error.kind, error.to_string()))
        };
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
