//! What every headless command does with a unit: open the link, record, run jobs, end in order. A recording takes the
//! unit's place where a command only reads.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, SyncSender};

use super::calendar::Calendar;
use super::error::{CliError, Kind};
use super::outcome::abandoned;
use super::output::{Closed, Output, Remarks};
use super::playback::Playback;
use super::{Global, link, waiting};
use crate::host::clock::Clock;
use crate::host::comeback::{Cable, Comeback};
use crate::host::link::LinkSpec;
use crate::host::pump::{Pump, PumpError};
use crate::host::signal::Signals;
use crate::host::{self, Input};
use crate::record::{Ending, LINK_BACK, LINK_LOST};
use crate::session::{Command, Event, Outcome, Session, UnitState};
use crate::time::{Duration, Instant};

/// A conversation with a unit over an open link, or one that has been.
pub struct Talk {
    line: Line,
    session: Session,
    port: String,
    spec: LinkSpec,
    inputs: SyncSender<Input>,
    remarks: Remarks,
    _signals: Signals,
}

impl Drop for Talk {
    /// Tells the user what became of the recording, if something did.
    fn drop(&mut self) {
        match &mut self.line {
            Line::Live(pump) => {
                if let Some(warning) = pump.recorder_mut().take_warning() {
                    self.remarks.say(&format!("axcon: {warning}"));
                }
            }
            Line::Recorded(playback) if playback.recording().ending() == Some(Ending::CutShort) => {
                self.remarks.say(link::CUT_SHORT);
            }
            Line::Recorded(_) => {}
        }
    }
}

enum Line {
    Live(Box<Pump>),
    Recorded(Box<Playback>),
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

/// How long a job may take from being cancelled to a safe end: it leaves one dialogue.
const WINDING_UP: Duration = Duration::from_secs(10);

impl Talk {
    /// Opens the link that the command line names and starts recording, or opens the recording it names.
    ///
    /// # Errors
    /// If there is no such link, it does not open, or the user interrupts.
    pub fn open(global: &Global, output: &mut Output) -> Result<Self, CliError> {
        let spec: LinkSpec = link::spec(global)?;
        let (sender, inputs) = host::channel();
        let (line, session, signals) = if let LinkSpec::Replay(path) = &spec {
            link::not_recorded_again(global)?;
            let signals = waiting::hear_signals(sender.clone())?;
            let recording = link::open_recording(path, sender.clone(), &inputs)?;
            let line = Line::Recorded(Box::new(Playback::new(recording, inputs)));
            (line, Session::of_recording(global.baud), signals)
        } else {
            let clock = Clock::start();
            let plan = link::recording(global)?;
            let signals = waiting::hear_signals(sender.clone())?;
            let connection = link::open(&spec, global, clock, sender.clone(), &inputs)?;
            let recorder = link::start_recording(&plan, &connection, clock, output)?;
            let cable = Cable::new(connection, Comeback::of(&spec, link::options(global)));
            let line = Line::Live(Box::new(Pump::new(cable, inputs, clock, recorder)));
            (line, Session::new(global.baud), signals)
        };
        let (port, remarks) = (spec.to_string(), output.err.clone());
        Ok(Talk { line, session, port, spec, inputs: sender, remarks, _signals: signals })
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
                let had_failed = failed.is_some();
                match finished(session, &mut news, &mut failed) {
                    None if failed.is_some() == had_failed => ControlFlow::Continue(()),
                    outcome => ControlFlow::Break(outcome),
                }
            });
            match step {
                Ok(Some(outcome)) => return failed.map_or(Ok(Ended::Finished { outcome, interrupted }), Err),
                // Whatever becomes of our own output, the unit is left in order.
                Ok(None) => deadline = deadline.min(self.cancel()),
                Err(PumpError::Interrupted) if !interrupted => {
                    interrupted = true;
                    deadline = deadline.min(self.cancel());
                }
                // The unit may want something done, which a reader of our output that has gone must not hide.
                Err(PumpError::Interrupted | PumpError::Deadline) => {
                    let failed = failed.filter(|error: &CliError| !error.error.is::<Closed>());
                    return Err(failed.unwrap_or_else(abandoned));
                }
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

    /// Cancels the job. Gives the moment by which it has to have come to its end.
    fn cancel(&mut self) -> Instant {
        let now = self.now();
        // Never refused: it needs no job.
        let _ = self.session.command(now, Command::Cancel);
        now + WINDING_UP
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
    pub fn listen<E: From<CliError>>(
        &mut self,
        until: Instant,
        mut news: impl FnMut(&Session, &Event) -> Result<ControlFlow<()>, E>,
    ) -> Result<bool, E> {
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
            Err(error) => Err(link::pump_error(error).into()),
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
        if self.listen(until, news)? { Ok(()) } else { Err(CliError::interrupted()) }
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
        if patience.is_zero() || !pump.may_come_back() {
            return Err(lost);
        }
        pump.lose(&mut self.session, Session::record);
        let clock = pump.clock();
        let gone = clock.now();
        self.session.link_lost(gone);
        pump.recorder_mut().mark(gone, LINK_LOST);
        output.remark(&format!("axcon: {lost}; waiting {} s for it to come back", patience.as_secs()));
        let deadline = gone + patience;
        let port = loop {
            match pump.pause(Comeback::RETRY) {
                Err(_) => return Ok(false),
                Ok(()) if clock.now() >= deadline => return Err(lost),
                Ok(()) => {}
            }
            if let Some(port) = pump.try_again(&self.inputs) {
                break port.to_owned();
            }
        };
        let away = clock.now().since(gone).as_secs_f64();
        let text = format!("{LINK_BACK}after {away:.1} s as {port}");
        output.remark(&format!("axcon: {text}"));
        pump.recorder_mut().mark(clock.now(), &text);
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

    /// Finds out what is at the other end; anything but a unit whose firmware runs is an error. A recording
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
}

/// Hands the session's events to `news`, up to the one that ends the job, or until `news` fails; from then on only the end
/// counts.
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
        }
        if let Event::Finished(outcome) = event {
            return Some(outcome);
        }
    }
    None
}
