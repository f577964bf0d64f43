//! What every headless command does with a unit: open the link, record, run jobs, end in order. A recording takes the
//! unit's place where a command only reads.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, SyncSender};

use jiff::Timestamp;

use super::error::{CliError, Kind};
use super::output::{Output, Remarks};
use super::playback::Playback;
use super::{Global, link, waiting};
use crate::host::clock::Clock;
use crate::host::comeback::Comeback;
use crate::host::link::LinkSpec;
use crate::host::pump::{Pump, PumpError};
use crate::host::replay::Recording;
use crate::host::signal::Signals;
use crate::host::{self, Input};
use crate::record::{Ending, LINK_BACK, LINK_LOST, Span};
use crate::session::{Awaited, Command, DictionaryReading, Event, FileEnd, Outcome, Session, UnitState};
use crate::time::{Duration, Instant};
use crate::wire::visible;

/// A conversation with a unit over an open link, or one that has been.
pub struct Talk {
    line: Line,
    session: Session,
    port: String,
    spec: LinkSpec,
    comeback: Option<Comeback>,
    inputs: SyncSender<Input>,
    remarks: Remarks,
    _signals: Signals,
}

enum Line {
    Live(Box<Pump>),
    Recorded(Box<Playback>),
}

/// What the calendar says at moments of a conversation.
#[derive(Clone, Copy, Debug)]
pub enum Calendar {
    /// Of the computer's clock.
    Clock(Clock),
    /// A recording's, which began at so many milliseconds since 1970.
    Recording(i64),
}

impl Calendar {
    /// Date and time in UTC.
    pub fn at(self, moment: Instant) -> Timestamp {
        match self {
            Calendar::Clock(clock) => clock.wall(moment),
            Calendar::Recording(begun) => Timestamp::from_millisecond(begun)
                .and_then(|begun| begun.checked_add(moment.since_start()))
                .unwrap_or(Timestamp::UNIX_EPOCH),
        }
    }

    /// The form data is written in: `2026-01-31T12:00:00.123Z`.
    pub fn text(self, moment: Instant) -> String {
        self.at(moment).strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
    }
}

/// How a job ended that was not left to itself.
#[derive(Debug)]
pub enum Ended {
    /// By itself, or because the user interrupted it.
    Finished {
        /// Its outcome.
        outcome: Outcome,
        /// Whether the user interrupted it.
        interrupted: bool,
    },
    /// The link was lost; a job that has something to say about that says it in its outcome.
    Lost {
        /// Its outcome.
        outcome: Outcome,
        /// What happened to the link.
        error: CliError,
    },
}

/// How long a job may take from the user's interrupt to a safe end: it leaves one dialogue.
const WINDING_UP: Duration = Duration::from_secs(10);

/// Characters of what a unit said that an error quotes.
const QUOTED: usize = 120;

impl Talk {
    /// Opens the link that the command line names and starts recording, or opens the recording it names.
    ///
    /// # Errors
    /// If there is no such link, it does not open, or the user interrupts.
    pub fn open(global: &Global, output: &mut Output) -> Result<Self, CliError> {
        let spec: LinkSpec = link::spec(global)?;
        let (sender, inputs) = host::channel();
        let mut comeback = None;
        let (line, session, signals) = if let LinkSpec::Replay(path) = &spec {
            link::not_recorded_again(global)?;
            // Before signals are heard: nobody hears them while a pipe waits for its writer.
            let recording = Recording::open(path).map_err(link::recording_error)?;
            let signals = waiting::hear_signals(sender.clone())?;
            let line = Line::Recorded(Box::new(Playback::new(recording, inputs)));
            (line, Session::of_recording(global.baud), signals)
        } else {
            let clock = Clock::start();
            let plan = link::recording(global)?;
            let signals = waiting::hear_signals(sender.clone())?;
            let connection = link::open(&spec, global, clock, sender.clone(), &inputs)?;
            comeback = Comeback::of(&spec, link::options(global));
            let recorder = link::start_recording(&plan, &connection, clock, output)?;
            let line = Line::Live(Box::new(Pump::new(connection, inputs, clock, recorder)));
            (line, Session::new(global.baud), signals)
        };
        let (port, remarks) = (spec.to_string(), output.err.clone());
        Ok(Talk { line, session, port, spec, comeback, inputs: sender, remarks, _signals: signals })
    }

    /// Runs a job to its end; `news` hears every event on the way. An interrupt cancels the job, a second one is final.
    ///
    /// # Errors
    /// If the command makes no sense, `news` fails, or a cancelled job finds no end: that is an interrupt, too.
    pub fn run(
        &mut self,
        command: Command,
        mut news: impl FnMut(&Session, &Event) -> Result<(), CliError>,
    ) -> Result<Ended, CliError> {
        let now = self.now();
        self.session.command(now, command).map_err(|error| CliError::new(Kind::Usage, error))?;
        let mut interrupted = false;
        let mut failed = None;
        let mut deadline = Instant::NEVER;
        loop {
            let step = self.step(deadline, |session| {
                finished(session, &mut news, &mut failed).map_or_else(|| ControlFlow::Continue(()), ControlFlow::Break)
            });
            match step {
                Ok(outcome) => return failed.map_or(Ok(Ended::Finished { outcome, interrupted }), Err),
                Err(PumpError::Interrupted) if !interrupted => {
                    interrupted = true;
                    let now = self.now();
                    deadline = now + WINDING_UP;
                    // Never refused: it needs no job.
                    let _ = self.session.command(now, Command::Cancel);
                }
                Err(PumpError::Interrupted | PumpError::Deadline) => return Err(abandoned()),
                Err(error @ (PumpError::Link(_) | PumpError::Send { .. })) => {
                    let now = self.now();
                    self.session.link_lost(now);
                    let error = link::pump_error(error);
                    return match finished(&mut self.session, &mut news, &mut failed) {
                        Some(outcome) => Ok(Ended::Lost { outcome, error }),
                        None => Err(error),
                    };
                }
                // A job that listens ends with the recording.
                Err(PumpError::Over) => {
                    self.session.recording_over(self.now());
                    let ended = finished(&mut self.session, &mut news, &mut failed);
                    let none = || CliError::message(Kind::Failed, "the recording has ended, and the job has not");
                    let outcome = ended.ok_or_else(none)?;
                    return failed.map_or(Ok(Ended::Finished { outcome, interrupted }), Err);
                }
                Err(error) => return Err(link::pump_error(error)),
            }
        }
    }

    /// Runs a job for a command that has nothing to say about interrupts and lost links.
    ///
    /// # Errors
    /// As [`run`](Talk::run), and if the user interrupts or the link is lost.
    pub fn ask(&mut self, command: Command) -> Result<Outcome, CliError> {
        match self.run(command, |_, _| Ok(()))? {
            Ended::Finished { outcome, interrupted: false } => Ok(outcome),
            Ended::Finished { interrupted: true, .. } => Err(CliError::interrupted()),
            Ended::Lost { error, .. } => Err(error),
        }
    }

    /// Listens until `until`, or until `news` says that it is enough. Gives `false` if the user interrupted.
    ///
    /// # Errors
    /// If the link is lost or `news` fails.
    pub fn listen(
        &mut self,
        until: Instant,
        mut news: impl FnMut(&Session, &Event) -> Result<ControlFlow<()>, CliError>,
    ) -> Result<bool, CliError> {
        let step = self.step(until, |session| {
            while let Some(event) = session.poll_event() {
                match news(session, &event) {
                    Ok(ControlFlow::Continue(())) => {}
                    Ok(ControlFlow::Break(())) => return ControlFlow::Break(Ok(())),
                    Err(error) => return ControlFlow::Break(Err(error)),
                }
            }
            ControlFlow::Continue(())
        });
        match step {
            Ok(enough) => enough.map(|()| true),
            Err(PumpError::Deadline) => Ok(true),
            Err(PumpError::Over) => {
                self.session.recording_over(self.now());
                while let Some(event) = self.session.poll_event() {
                    if news(&self.session, &event)?.is_break() {
                        break;
                    }
                }
                Ok(true)
            }
            Err(PumpError::Interrupted) => Ok(false),
            Err(error) => Err(link::pump_error(error)),
        }
    }

    /// Listens where an interrupt is the end of the command.
    ///
    /// # Errors
    /// As [`listen`](Talk::listen), and if the user interrupts.
    pub fn hear(
        &mut self,
        until: Instant,
        news: impl FnMut(&Session, &Event) -> Result<ControlFlow<()>, CliError>,
    ) -> Result<(), CliError> {
        match self.listen(until, news)? {
            true => Ok(()),
            false => Err(CliError::interrupted()),
        }
    }

    /// Listens to a recording to its end.
    ///
    /// # Errors
    /// If the recording cannot be read to its end, or the user interrupts.
    pub fn hear_out(&mut self) -> Result<(), CliError> {
        self.hear(Instant::NEVER, |_, _| Ok(ControlFlow::Continue(())))
    }

    /// Listens until somebody who was asked has answered.
    ///
    /// # Errors
    /// If the user interrupts, or the link is lost.
    pub fn await_answer<T>(&mut self, answer: &Receiver<T>) -> Result<T, CliError> {
        let step = self.step(Instant::NEVER, |session| {
            while session.poll_event().is_some() {}
            answer.try_recv().map_or(ControlFlow::Continue(()), ControlFlow::Break)
        });
        step.map_err(|error| match error {
            PumpError::Interrupted => CliError::interrupted(),
            error => link::pump_error(error),
        })
    }

    /// Where inputs for the conversation are put.
    pub fn inputs(&self) -> SyncSender<Input> {
        self.inputs.clone()
    }

    /// Whether this is a recording, to which nothing can be said.
    pub fn is_recorded(&self) -> bool {
        matches!(self.line, Line::Recorded(_))
    }

    fn step<T>(
        &mut self,
        deadline: Instant,
        mut look: impl FnMut(&mut Session) -> ControlFlow<T>,
    ) -> Result<T, PumpError> {
        match &mut self.line {
            Line::Live(pump) => pump.run(&mut self.session, deadline, Session::record, |session, warning| {
                if let Some(warning) = warning {
                    self.remarks.say(&format!("axcon: {warning}"));
                }
                look(session)
            }),
            Line::Recorded(playback) => playback.run(&mut self.session, deadline, |session, _| look(session)),
        }
    }

    /// Waits for a lost link to come back and opens it again: the same USB adapter under whatever name, or the same
    /// path. The recording goes on, the gap marked. `Ok(false)` if the user has had enough.
    ///
    /// # Errors
    /// If it has not come back within `patience`: the error is the one that it was lost with.
    pub fn reconnect(&mut self, lost: CliError, patience: Duration, output: &mut Output) -> Result<bool, CliError> {
        let Line::Live(pump) = &mut self.line else { return Err(lost) };
        let Some(comeback) = self.comeback.as_mut().filter(|_| !patience.is_zero()) else { return Err(lost) };
        comeback.lost();
        // An adapter whose old name is still open gets another one when it comes back.
        pump.disconnect();
        let clock = pump.clock();
        let gone = clock.now();
        self.session.link_lost(gone);
        pump.recorder_mut().mark(gone, LINK_LOST);
        output.remark(&format!("axcon: {lost}; waiting {} s for it to come back", patience.as_secs()));
        let deadline = gone + patience;
        let connection = loop {
            match pump.pause(Comeback::RETRY) {
                Err(_) => return Ok(false),
                Ok(()) if clock.now() >= deadline => return Err(lost),
                Ok(()) => {}
            }
            if let Some(connection) = comeback.open(clock, self.inputs.clone()) {
                break connection;
            }
        };
        let away = clock.now().since(gone).as_secs_f64();
        let text = format!("{LINK_BACK}after {away:.1} s as {}", connection.port());
        output.remark(&format!("axcon: {text}"));
        pump.recorder_mut().mark(clock.now(), &text);
        pump.replace(connection);
        self.session.link_back(clock.now());
        Ok(true)
    }

    /// The moment it is, or to which a recording has been played.
    pub fn now(&self) -> Instant {
        match &self.line {
            Line::Live(pump) => pump.clock().now(),
            Line::Recorded(playback) => playback.now(),
        }
    }

    /// The calendar of all moments.
    pub fn calendar(&self) -> Calendar {
        match &self.line {
            Line::Live(pump) => Calendar::Clock(pump.clock()),
            Line::Recorded(playback) => Calendar::Recording(playback.recording().header().unix_millis),
        }
    }

    /// What is known of the unit.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The link as the user named it.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// The link.
    pub fn spec(&self) -> &LinkSpec {
        &self.spec
    }

    /// Tells the user what became of the recording, if something did.
    pub fn close(&mut self, output: &mut Output) {
        match &mut self.line {
            Line::Live(pump) => {
                if let Some(warning) = pump.recorder_mut().take_warning() {
                    output.remark(&format!("axcon: {warning}"));
                }
            }
            Line::Recorded(playback) if playback.recording().ending() == Some(Ending::CutShort) => {
                output.remark(link::CUT_SHORT);
            }
            Line::Recorded(_) => {}
        }
    }

    /// Finds out what is at the other end, and makes an error of it if that is no unit whose firmware runs. A recording
    /// shows that by itself.
    ///
    /// # Errors
    /// If nothing or something unknown answers, or the unit waits in its loader.
    pub fn find_application(&mut self) -> Result<(), CliError> {
        if self.is_recorded() {
            return Ok(());
        }
        self.ask(Command::Identify)?;
        match self.session.facts().state {
            UnitState::Application => Ok(()),
            UnitState::Loader => Err(CliError::message(Kind::UnitRefused, "the unit waits in its loader for a file")
                .hint("send it one: axcon load IMAGE")),
            UnitState::Silent | UnitState::Unknown => Err(self.no_unit()),
        }
    }

    /// The error that says that no unit answers, with what was heard instead.
    pub fn no_unit(&self) -> CliError {
        let heard = self.last_words();
        if heard.is_empty() {
            if self.is_recorded() {
                return CliError::message(Kind::NoAnswer, format!("{}: the unit says nothing in it", self.port));
            }
            let error = CliError::message(Kind::NoAnswer, format!("{}: nothing answers", self.port));
            return no_answer_hints(error);
        }
        CliError::message(
            Kind::NoAnswer,
            format!("{}: something talks, but it is not a unit axcon knows; last heard: \"{heard}\"", self.port),
        )
        .hint("is it the right port? 'axcon ports' lists them, 'axcon terminal' shows everything it sends")
        .hint("a unit at another line rate sends garbage: the units have 115200 baud")
    }

    /// The error that a job's outcome is, where it is one, with what the unit said.
    ///
    /// # Errors
    /// If the outcome is not what was wanted.
    pub fn expect_done(&self, outcome: &Outcome) -> Result<(), CliError> {
        let (error, heard) = match outcome {
            Outcome::Identified
            | Outcome::Done(_)
            | Outcome::DefaultsTaken
            | Outcome::StreamRuns { .. }
            | Outcome::DictionaryRead(_) => return Ok(()),
            Outcome::Cancelled(_) => return Err(CliError::interrupted()),
            Outcome::Loaded(report) => return Err(CliError::message(Kind::Failed, report.what.clone())),
            Outcome::FileSent { end: FileEnd::Whole, .. } => return Ok(()),
            Outcome::FileSent { sent, total, end: FileEnd::Cancelled | FileEnd::LinkLost } => {
                let message = format!("{sent} of the file's {total} bytes have left");
                return Err(CliError::message(Kind::Interrupted, message));
            }
            Outcome::Refused { reason, heard, .. } => (CliError::message(Kind::UnitRefused, reason.clone()), heard),
            Outcome::NoAnswer { awaited, heard, .. } if self.is_recorded() => {
                let message = format!("the recording does not show what was looked for: {awaited}");
                (CliError::message(Kind::NoAnswer, message), heard)
            }
            Outcome::NoAnswer { awaited, heard, .. } => (unanswered(*awaited), heard),
        };
        let message = error.to_string();
        let said = heard.map(|span| self.quoted(span)).filter(|said| !said.is_empty() && !message.contains(said));
        Err(match said {
            Some(said) => {
                CliError { hints: [vec![format!("the unit said: \"{said}\"")], error.hints].concat(), ..error }
            }
            None => error,
        })
    }

    /// What was read of the object dictionary, by the job that reads it.
    ///
    /// # Errors
    /// If the outcome is another.
    pub fn expect_reading(&self, outcome: Outcome) -> Result<Box<DictionaryReading>, CliError> {
        match outcome {
            Outcome::DictionaryRead(reading) => Ok(reading),
            outcome => {
                self.expect_done(&outcome)?;
                Err(CliError::message(Kind::Failed, "the reading ended without a result"))
            }
        }
    }

    /// The end of what the unit has said, on one line.
    fn last_words(&self) -> String {
        let end = self.session.record().received();
        self.quoted(Span { start: end.saturating_sub(4 * QUOTED as u64), end })
    }

    /// What lies there in the record, on one line; of a long text its end.
    fn quoted(&self, span: Span) -> String {
        let text = visible::line(&self.session.record().bytes(span));
        let characters: Vec<char> = text.trim().chars().collect();
        characters[characters.len().saturating_sub(QUOTED)..].iter().collect()
    }
}

/// The error of a job that has waited in vain. A question that was not understood is left, and what its unit makes of
/// that nobody knows; a row or a page is awaited when the unit has been told already.
fn unanswered(awaited: Awaited) -> CliError {
    let message = format!("the unit did not answer as expected: {awaited}");
    let error = CliError::message(Kind::NoAnswer, message);
    const BY_HAND: &str = "'axcon terminal' shows what the unit prints, and takes the answer by hand";
    match awaited {
        Awaited::SourceQuestion | Awaited::PeriodQuestion => error
            .hint("no guess was made: the question was left with Enter. A unit that then takes a value of its own may keep it")
            .hint(BY_HAND),
        Awaited::DefaultsQuestion => {
            error.hint("no guess was made: whatever the unit asked was answered with No").hint(BY_HAND)
        }
        _ => error.hint("'axcon terminal' shows what the unit prints"),
    }
}

/// The error of a job that was interrupted and has come to no end of its own.
fn abandoned() -> CliError {
    CliError::interrupted()
        .hint("the unit may still stand in a dialogue, or in its view with scanning halted: Enter and X leave them")
}

/// Hints for a unit that does not answer: what has to be checked, most likely first (manuals, chapter 4).
pub fn no_answer_hints(error: CliError) -> CliError {
    error
        .hint("is the unit powered? Is it the right port? 'axcon ports' lists them")
        .hint("is the cable the right way round? Ground, transmit and receive of the unit go to pins 5, 2, 3 of the DB-9:")
        .hint("pins 1, 2, 3 of the AXTC4CO's grey connector, pins 6, 7, 8 of the AXRTD8CO's")
        .hint("is the port as fast as the unit? They have 115200 baud, and so has axcon without --baud")
        .hint("a unit that another program has stopped by Xoff was sent an Xon; 'axcon terminal' shows all that comes")
}

/// Hands the session's events to `news`, up to the one that ends the job. Whatever becomes of our own output, the unit is
/// left in order: if `news` fails the job is cancelled, and comes to its end.
fn finished(
    session: &mut Session,
    news: &mut impl FnMut(&Session, &Event) -> Result<(), CliError>,
    failed: &mut Option<CliError>,
) -> Option<Outcome> {
    while let Some(event) = session.poll_event() {
        if failed.is_none()
            && let Err(error) = news(session, &event)
        {
            *failed = Some(error);
            // Never refused: it needs no job. The session knows the time.
            let _ = session.command(Instant::ZERO, Command::Cancel);
        }
        if let Event::Finished(outcome) = event {
            return Some(outcome);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_question_it_is_said_how_it_was_left() {
        let hints = |awaited| {
            let error = unanswered(awaited);
            assert_eq!(error.kind, Kind::NoAnswer);
            error.hints.join(" ")
        };
        assert!(hints(Awaited::SourceQuestion).contains("left with Enter"));
        assert!(hints(Awaited::DefaultsQuestion).contains("answered with No"));
        assert!(!hints(Awaited::Row).contains("guess") && !hints(Awaited::StreamOff).contains("guess"));
    }

    #[test]
    fn a_job_that_finds_no_end_was_interrupted_and_the_unit_may_want_something_done() {
        let error = abandoned();
        assert_eq!((error.kind, error.hints.len()), (Kind::Interrupted, 1));
    }
}
