//! What every headless command does with a unit: open the link, record, run jobs, end in order.

use std::ops::ControlFlow;

use super::Global;
use super::error::{CliError, Kind};
use super::link;
use super::output::Output;
use crate::host;
use crate::host::clock::Clock;
use crate::host::link::LinkSpec;
use crate::host::pump::{Pump, PumpError};
use crate::host::recorder::Recorder;
use crate::host::signal::Signals;
use crate::session::{Command, Event, Outcome, Session, UnitState};
use crate::time::{Duration, Instant};
use crate::wire::visible;

/// A conversation with a unit over an open link.
pub struct Talk {
    pump: Pump,
    session: Session,
    port: String,
    spec: LinkSpec,
    _signals: Signals,
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
    /// Opens the link that the command line names and starts recording.
    ///
    /// # Errors
    /// If there is no such link, or it does not open.
    pub fn open(global: &Global, output: &mut Output) -> Result<Self, CliError> {
        let clock = Clock::start();
        let (sender, inputs) = host::channel();
        let spec: LinkSpec = link::spec(global)?;
        let signals = Signals::start(sender.clone()).map_err(|error| CliError::new(Kind::Failed, error))?;
        let connection = link::open(&spec, global, clock, sender)?;
        let mut recorder = Recorder::start(&link::recording(global), &connection, clock);
        if let Some(warning) = recorder.take_warning() {
            output.remark(&format!("axcon: {warning}"));
        }
        Ok(Talk {
            pump: Pump::new(connection, inputs, clock, recorder),
            session: Session::new(global.baud),
            port: spec.to_string(),
            spec,
            _signals: signals,
        })
    }

    /// Runs a job to its end; `news` hears every event on the way. An interrupt cancels the job, a second one is final.
    ///
    /// # Errors
    /// If the command makes no sense, `news` fails, or a cancelled job finds no end.
    pub fn run(
        &mut self,
        command: Command,
        mut news: impl FnMut(&Session, &Event) -> Result<(), CliError>,
    ) -> Result<Ended, CliError> {
        let now = self.now();
        self.session.command(now, command).map_err(|error| CliError::new(Kind::Usage, error))?;
        let mut interrupted = false;
        let mut deadline = Instant::NEVER;
        loop {
            let step = self.pump.run(&mut self.session, deadline, Session::record, |session, _| {
                finished(session, &mut news).map_or_else(|| ControlFlow::Continue(()), ControlFlow::Break)
            });
            match step {
                Ok(outcome) => return Ok(Ended::Finished { outcome: outcome?, interrupted }),
                Err(PumpError::Interrupted(_)) if !interrupted => {
                    interrupted = true;
                    let now = self.now();
                    deadline = now + WINDING_UP;
                    // Never refused: it needs no job.
                    let _ = self.session.command(now, Command::Cancel);
                }
                Err(error @ (PumpError::Link(_) | PumpError::Send { .. })) => {
                    let now = self.now();
                    self.session.link_lost(now);
                    let error = link::pump_error(error);
                    return match finished(&mut self.session, &mut news) {
                        Some(outcome) => Ok(Ended::Lost { outcome: outcome?, error }),
                        None => Err(error),
                    };
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
            Ended::Finished { interrupted: true, .. } => Err(CliError::message(Kind::Interrupted, "interrupted")),
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
        let step = self.pump.run(&mut self.session, until, Session::record, |session, _| {
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
            Err(PumpError::Interrupted(_)) => Ok(false),
            Err(error) => Err(link::pump_error(error)),
        }
    }

    /// The moment it is.
    pub fn now(&self) -> Instant {
        self.pump.clock().now()
    }

    /// The clock all moments are of.
    pub fn clock(&self) -> Clock {
        self.pump.clock()
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
    pub fn close(mut self, output: &mut Output) {
        if let Some(warning) = self.pump.recorder_mut().take_warning() {
            output.remark(&format!("axcon: {warning}"));
        }
    }

    /// Finds out what is at the other end, and makes an error of it if that is no unit whose firmware runs.
    ///
    /// # Errors
    /// If nothing or something unknown answers, or the unit waits in its loader.
    pub fn find_application(&mut self) -> Result<(), CliError> {
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

    /// The end of what the unit has said, on one line.
    fn last_words(&self) -> String {
        let record = self.session.record();
        let end = record.received();
        let start = end.saturating_sub(4 * QUOTED as u64);
        let text = visible::line(&record.bytes(crate::record::Span { start, end }));
        let characters: Vec<char> = text.chars().collect();
        characters[characters.len().saturating_sub(QUOTED)..].iter().collect()
    }
}

/// Hints for a unit that does not answer.
pub fn no_answer_hints(error: CliError) -> CliError {
    error
        .hint("is the unit powered, and the cable the right way round? AXTC4CO, grey connector: pin 1 GND, 2 transmit,")
        .hint("3 receive go to pins 5, 2, 3 of the DB-9")
        .hint("is it the right port? 'axcon ports' lists them; 'axcon terminal' shows everything that comes")
}

/// Hands the session's events to `news`, up to the one that ends the job.
fn finished(
    session: &mut Session,
    news: &mut impl FnMut(&Session, &Event) -> Result<(), CliError>,
) -> Option<Result<Outcome, CliError>> {
    while let Some(event) = session.poll_event() {
        if let Err(error) = news(session, &event) {
            return Some(Err(error));
        }
        if let Event::Finished(outcome) = event {
            return Some(Ok(outcome));
        }
    }
    None
}

/// The error that a job's outcome is, where it is one.
///
/// # Errors
/// If the outcome is not what was wanted.
pub fn expect_done(outcome: Outcome) -> Result<(), CliError> {
    match outcome {
        Outcome::Identified | Outcome::Done(_) | Outcome::StreamRuns { .. } | Outcome::DictionaryRead(_) => Ok(()),
        Outcome::NoAnswer { awaited, .. } => {
            let message = format!("the unit did not answer as expected: {awaited} did not come");
            Err(CliError::message(Kind::NoAnswer, message)
                .hint("'axcon terminal' shows what it prints; the dialogue has been left with Enter"))
        }
        Outcome::Refused { reason, .. } => Err(CliError::message(Kind::UnitRefused, reason)),
        Outcome::Cancelled(_) => Err(CliError::message(Kind::Interrupted, "interrupted")),
        Outcome::Loaded(report) => Err(CliError::message(Kind::Failed, report.what)),
    }
}
