//! `axcon report`: everything known of a unit on one page.

use std::ops::ControlFlow;
use std::path::PathBuf;

use jiff::tz::TimeZone;
use serde::Serialize;

use super::ask::{READS_DICTIONARY, confirm};
use super::error::{CliError, Kind};
use super::files::Destination;
use super::output::{Closed, Output};
use super::stream::found::{leave_as_found, watch};
use super::talk::{Ended, Talk};
use super::{Global, link, numbers};
use crate::device::Product;
use crate::dump::Dump;
use crate::host::clock;
use crate::monitor::{Monitor, Scrollback};
use crate::report::Contents;
use crate::session::{Awaited, Command, DictionaryReading, Event, Outcome, Session};
use crate::time::Duration;
use crate::wire::stream::Source;

/// Arguments of `axcon report`.
///
/// Of a unit: values are read for some seconds, then a page of diagnostics and the object dictionary; the stream is left
/// as it was found. Of a recording: what was asked then; the page says what is not in it. If the unit dies meanwhile, the
/// page says what is missing, and the exit code is 4, or 3 if the port has gone.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The page, HTML.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// How long values are read.
    #[arg(long, value_name = "S", default_value_t = 10, allow_negative_numbers = true, value_parser = numbers::within::<u64>(1..=3600))]
    seconds: u64,
    /// Leave the object dictionary out: while it is read, the unit may halt scanning and CAN.
    #[arg(long)]
    no_dictionary: bool,
}

/// Time between rows, where the stream is not on already.
const PERIOD: Duration = Duration::from_millis(500);

/// What is asked of a unit, one after the other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Step {
    Values,
    Diagnostics,
    Dictionary,
}

impl Step {
    const ALL: [Step; 3] = [Step::Values, Step::Diagnostics, Step::Dictionary];

    fn what(self) -> &'static str {
        match self {
            Step::Values => "the stream",
            Step::Diagnostics => "diagnostics",
            Step::Dictionary => "the object dictionary",
        }
    }
}

/// What is being found out.
#[derive(Default)]
struct Findings {
    monitor: Monitor,
    reading: Option<DictionaryReading>,
    missing: Vec<String>,
}

#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    file: String,
    product: Option<&'a str>,
    version: Option<String>,
    missing: &'a [String],
}

/// Makes the report.
///
/// # Errors
/// If nobody said yes, no unit answers or it stops answering, or the file cannot be written. What a unit that answers does not show is missing
/// in the report, which says so.
pub fn run(args: &Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let is_recording = link::is_recording(global);
    let mut out = Destination::admit(Some(&args.out), global.yes)?;
    if !is_recording && !args.no_dictionary {
        confirm(READS_DICTIONARY, global, output)?;
    }
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    let mut findings = Findings::default();
    let mut died = None;
    if is_recording {
        findings.ask(&mut talk, Command::Overhear, "the recording")?;
        findings.note_unrecorded(args.no_dictionary);
    } else {
        died = findings.of_unit(&mut talk, args, output)?;
    }
    let facts = talk.session().facts().clone();
    let product = facts.product.as_ref().and_then(|known| Product::named(&known.value));
    let dump = findings.reading.as_ref().map(|reading| Dump::of(reading, product, &facts));
    let mut transcript = Scrollback::default();
    transcript.follow(talk.session().record());
    let start = talk.calendar().at(crate::time::Instant::ZERO);
    let made = talk.calendar().at(talk.now()).to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M").to_string();
    let contents = Contents {
        link: talk.port(),
        made: &made,
        facts: &facts,
        monitor: &findings.monitor,
        dump: dump.as_ref(),
        missing: &findings.missing,
        transcript: &transcript,
        start_of_day: clock::time_of_day(start.as_millisecond()),
    };
    let saved = out.save(contents.html().as_bytes(), output);
    if let Some(died) = died {
        // What became of the unit counts, even if nobody reads the output any more.
        saved.or_else(|error| if error.error.is::<Closed>() { Ok(()) } else { Err(error) })?;
        let place = if out.is_standard_output() { "standard output".to_owned() } else { out.shown() };
        return Err(died.hint(format!("what was found out before is in the report all the same: {place}")));
    }
    saved?;
    if out.is_standard_output() {
        return Ok(());
    }
    let file = out.shown();
    if output.json {
        return output.object(&Object {
            schema: "axcon.report/1",
            file,
            product: facts.product.as_ref().map(|known| known.value.as_str()),
            version: facts.version.as_ref().map(|known| known.value.to_string()),
            missing: &findings.missing,
        });
    }
    output.remark(&format!("axcon: the report is in {file}"));
    Ok(())
}

impl Findings {
    fn fold(&mut self, session: &Session, event: &Event) {
        let product = session.facts().product.as_ref().and_then(|known| Product::named(&known.value));
        self.monitor.fold(event, product);
        if let Event::Overheard { reading, .. } = event {
            // What was broken off later does not undo what was read to its end.
            if reading.is_complete() || self.reading.as_ref().is_none_or(|before| !before.is_complete()) {
                self.reading = Some((**reading).clone());
            }
        }
    }

    /// Notes what a recording does not show: nobody asked then, or nobody answered.
    fn note_unrecorded(&mut self, no_dictionary: bool) {
        let is_there = |step: &Step| match step {
            Step::Values => self.monitor.stream.newest.is_some(),
            Step::Diagnostics => self.monitor.diagnostics.at.is_some(),
            Step::Dictionary => no_dictionary || self.reading.is_some(),
        };
        let absent = Step::ALL.into_iter().filter(|step| !is_there(step));
        let sentences: Vec<String> = absent.map(|step| format!("Not in the recording: {}.", step.what())).collect();
        self.missing.extend(sentences);
    }

    /// Finds out all there is of a unit. Gives why it was left in the middle, if the unit or the link to it is gone: what is
    /// known by then is still worth a page.
    fn of_unit(&mut self, talk: &mut Talk, args: &Args, output: &mut Output) -> Result<Option<CliError>, CliError> {
        let mut died = None;
        for step in Step::ALL {
            if step == Step::Dictionary && args.no_dictionary {
                continue;
            }
            if died.is_some() {
                self.missing.push(format!("Not found out: {}.", step.what()));
                continue;
            }
            let done = match step {
                Step::Values => self.watch_values(talk, args.seconds, output),
                Step::Diagnostics => self.ask(talk, Command::Diagnostics { pages: Some(1) }, step.what()).map(|_| ()),
                Step::Dictionary => self.ask(talk, Command::ReadDictionary, step.what()).map(|_| ()),
            };
            match done {
                Err(error) if matches!(error.kind, Kind::NoAnswer | Kind::PortGone) => {
                    self.missing.push(format!("Not found out to the end: {}. {error}.", step.what()));
                    died = Some(error);
                }
                done => done?,
            }
        }
        Ok(died)
    }

    /// Watches the stream for some seconds; one that is off is switched on for as long.
    fn watch_values(&mut self, talk: &mut Talk, seconds: u64, output: &mut Output) -> Result<(), CliError> {
        let mut before = watch(talk)?;
        if before.seen().is_some() {
            return self.listen(talk, seconds);
        }
        let begun = self.ask(talk, Command::StreamOn { source: Source::FieldValue, period: PERIOD }, "the stream");
        if matches!(begun, Ok(Outcome::StreamRuns { was_on: true })) {
            before.was_on();
        }
        let watched = match begun {
            Ok(Outcome::StreamRuns { .. }) => self.listen(talk, seconds),
            // Nothing has been switched on, and nobody knows what the unit would make of another T.
            Ok(Outcome::NoAnswer { awaited: Awaited::SourceQuestion | Awaited::PeriodQuestion, .. }) => return Ok(()),
            Ok(_) => Ok(()),
            Err(error) => Err(error),
        };
        // However it ended.
        watched.and(leave_as_found(talk, before, output))
    }

    fn listen(&mut self, talk: &mut Talk, seconds: u64) -> Result<(), CliError> {
        let until = talk.now() + Duration::from_secs(seconds);
        talk.hear(until, |session, event| {
            self.fold(session, event);
            Ok(ControlFlow::Continue(()))
        })
    }

    /// Asks for something that the report can do without: where the unit does not show it, it is among what is missing.
    fn ask(&mut self, talk: &mut Talk, command: Command, what: &str) -> Result<Outcome, CliError> {
        let ended = talk.run(command, |session, event| {
            self.fold(session, event);
            Ok(())
        })?;
        let outcome = match ended {
            Ended::Finished { interrupted: true, .. } => return Err(CliError::interrupted()),
            Ended::Lost { error, .. } => return Err(error),
            Ended::Finished { outcome, .. } => outcome,
        };
        if let Outcome::DictionaryRead(reading) = &outcome {
            self.reading = Some((**reading).clone());
        }
        if let Err(error) = talk.expect_done(&outcome) {
            self.missing.push(format!("Not found out: {what}. {error}."));
        }
        Ok(outcome)
    }
}
