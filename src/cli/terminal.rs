//! `axcon terminal`: keys out, bytes in.
//!
//! A session stands between the two, so that the unit's XON and XOFF are obeyed and a password is recorded by its number
//! of characters only; it runs no job.

use std::fs::File;
use std::io::{self, IsTerminal, Read, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};

use super::Global;
use super::error::{CliError, Kind};
use super::link;
use super::output::Output;
use crate::endpoint::Endpoint;
use crate::host::clock::Clock;
use crate::host::link::Connection;
use crate::host::recorder::Recorder;
use crate::host::signal::Signals;
use crate::host::terminal::RawMode;
use crate::host::{self, Input};
use crate::session::{Command, Session};
use crate::time::{Duration, Instant};
use crate::wire::visible::{Controls, Visible};
use crate::wire::{XOFF, XON};

/// Arguments of `axcon terminal`.
///
/// What the unit sends is shown with its control characters made visible, except line ends, tabs and backspaces.
/// Ctrl-] leaves. Where standard input is not a terminal, what comes is sent as it is, and the command ends when the
/// input has ended and the line has been silent for a second.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Append what the unit sends to FILE, byte for byte.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

/// Ctrl-], as in telnet: no menu of a unit uses it.
const LEAVE: u8 = 0x1D;

/// How long the line must have been silent after the end of the input: a unit answers a key much faster, and repeats
/// its diagnostics every second.
const SILENCE: Duration = Duration::from_secs(1);

/// How long the beginning of a UTF-8 character waits for its end before it is shown as bytes.
const HALF_CHARACTER: Duration = Duration::from_millis(100);

/// Bytes of standard input taken at once, and how many may wait before the next are asked for.
const TYPED: usize = 1024;
const WAITING: usize = 64;

/// Connects the user with the unit.
///
/// # Errors
/// If the port does not open or goes away, or a signal ends the command.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let clock = Clock::start();
    let (sender, inputs) = host::channel();
    let log = args.log.map(open_log).transpose()?;
    let spec = link::spec(global)?;
    let _signals = Signals::start(sender.clone()).map_err(|error| CliError::new(Kind::Failed, error))?;
    let connection = link::open(&spec, global, clock, sender.clone())?;
    let mut recorder = Recorder::start(&link::recording(global), &connection, clock);
    if let Some(warning) = recorder.take_warning() {
        output.remark(&warning);
    }
    let interactive = io::stdin().is_terminal();
    if interactive {
        output.remark(&format!("{} at {}; Ctrl-] leaves", connection.port(), connection.settings()));
    }
    let raw_mode = interactive
        .then(RawMode::enter)
        .transpose()
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot use the terminal")))?;
    let more = listen_to_standard_input(sender)?;
    let mut conversation = Conversation {
        connection,
        recorder,
        log,
        clock,
        more,
        asked_for_more: true,
        session: Session::new(global.baud),
        shown: Visible::new(Controls::Layout),
        interactive,
        ended: false,
        last: clock.now(),
    };
    let end = conversation.run(&inputs, output);
    let warning = conversation.recorder.take_warning();
    drop(conversation);
    drop(raw_mode);
    if interactive {
        output.remark("");
    }
    if let Some(warning) = warning {
        output.remark(&warning);
    }
    end
}

struct Conversation {
    connection: Connection,
    recorder: Recorder,
    log: Option<(PathBuf, File)>,
    clock: Clock,
    /// Asks the reader of standard input for the next piece, so that a long file waits there and not here.
    more: SyncSender<()>,
    asked_for_more: bool,
    session: Session,
    shown: Visible,
    interactive: bool,
    /// Whether standard input has ended.
    ended: bool,
    /// When a byte last went either way.
    last: Instant,
}

impl Conversation {
    fn run(&mut self, inputs: &Receiver<Input>, output: &mut Output) -> Result<(), CliError> {
        loop {
            let now = self.clock.now();
            self.send(now)?;
            let silent_at = (self.ended && self.session.waiting() == 0).then(|| self.last + SILENCE);
            if silent_at.is_some_and(|at| at <= now) {
                return self.show(&[], true, output);
            }
            let whole_at = self.shown.keeps_back().then(|| self.last + HALF_CHARACTER);
            if whole_at.is_some_and(|at| at <= now) {
                self.show(&[], true, output)?;
            }
            let wake = [silent_at, whole_at, self.session.poll_timeout()].into_iter().flatten().min();
            let input = match wake {
                None => inputs.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(at) => inputs.recv_timeout(self.clock.until(at)),
            };
            match input {
                Ok(Input::Bytes { at, bytes }) => {
                    self.last = at;
                    self.hear(at, &bytes, output)?;
                }
                Ok(Input::Typed(bytes)) => {
                    self.asked_for_more = false;
                    let leaves = self.interactive.then(|| bytes.iter().position(|&byte| byte == LEAVE)).flatten();
                    self.type_keys(&bytes[..leaves.unwrap_or(bytes.len())], output);
                    if leaves.is_some() {
                        return self.send(self.clock.now());
                    }
                }
                Ok(Input::TypedEnd) => {
                    self.ended = true;
                    self.last = self.clock.now();
                }
                Ok(Input::Gone(error)) => return Err(link::link_error(error)),
                Ok(Input::Signal(_)) => return Err(CliError::reported(Kind::Interrupted)),
                Ok(Input::Terminal(_) | Input::Wake) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    fn hear(&mut self, at: Instant, bytes: &[u8], output: &mut Output) -> Result<(), CliError> {
        self.session.handle_bytes(at, bytes);
        self.recorder.follow(self.session.record());
        while self.session.poll_event().is_some() {}
        if let Some((path, log)) = &mut self.log {
            log.write_all(bytes).map_err(|error| log_error(path, error))?;
        }
        let text: Vec<u8> = bytes.iter().copied().filter(|byte| !matches!(*byte, XON | XOFF)).collect();
        self.show(&text, false, output)
    }

    fn show(&mut self, bytes: &[u8], whole: bool, output: &mut Output) -> Result<(), CliError> {
        let mut text = String::new();
        self.shown.push(bytes, &mut text);
        if whole {
            self.shown.finish(&mut text);
        }
        if text.is_empty() { Ok(()) } else { output.data(text.as_bytes()) }
    }

    fn type_keys(&mut self, keys: &[u8], output: &mut Output) {
        if let Err(refusal) = self.session.command(self.clock.now(), Command::Keys(keys.to_vec())) {
            output.remark(&format!("axcon: {refusal}"));
        }
    }

    fn send(&mut self, now: Instant) -> Result<(), CliError> {
        self.session.handle_timeout(now);
        while self.session.poll_event().is_some() {}
        while let Some(transmit) = self.session.poll_transmit() {
            self.last = now;
            self.recorder.follow(self.session.record());
            self.connection
                .send(transmit.bytes)
                .map_err(|error| CliError::message(Kind::PortGone, format!("{}: {error}", self.connection.port())))?;
        }
        if !self.asked_for_more && self.session.waiting() <= WAITING {
            self.asked_for_more = self.more.try_send(()).is_ok();
        }
        Ok(())
    }
}

/// Reads standard input in a thread that lives as long as the process, one piece each time it is asked.
fn listen_to_standard_input(inputs: SyncSender<Input>) -> Result<SyncSender<()>, CliError> {
    let (more, asked) = sync_channel(1);
    let _ = more.try_send(());
    let read = move || {
        let mut buffer = [0; TYPED];
        while asked.recv().is_ok() {
            let input = loop {
                match io::stdin().lock().read(&mut buffer) {
                    Ok(0) => break Input::TypedEnd,
                    Ok(count) => break Input::Typed(buffer[..count].to_vec()),
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => break Input::TypedEnd,
                }
            };
            let over = matches!(input, Input::TypedEnd);
            if inputs.send(input).is_err() || over {
                return;
            }
        }
    };
    std::thread::Builder::new().name("standard input".into()).spawn(read).map_err(|error| {
        CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen to standard input"))
    })?;
    Ok(more)
}

fn open_log(path: PathBuf) -> Result<(PathBuf, File), CliError> {
    match File::options().append(true).create(true).open(&path) {
        Ok(file) => Ok((path, file)),
        Err(error) => Err(log_error(&path, error)),
    }
}

fn log_error(path: &std::path::Path, error: io::Error) -> CliError {
    CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot write the log '{}'", path.display())))
}
