//! `axcon terminal`: keys out, bytes in.
//!
//! A session is between the two, so that the unit's XON and XOFF are obeyed and a password is recorded by its number of
//! characters only; it runs no job. What is shown and logged is taken from its record, so the password is in neither.

mod conversation;
mod keys;
mod sending;
mod shown;

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::SyncSender;

use jiff::tz::TimeZone;

use super::calendar::Calendar;
use super::error::{CliError, Kind};
use super::link;
use super::output::Output;
use super::{Global, files, waiting};
use crate::host::clock::Clock;
use crate::host::comeback::{Cable, Comeback};
use crate::host::link::LinkSpec;
use crate::host::terminal::RawMode;
use crate::host::{self, Input};
use crate::record::{Direction, Ending, Piece};
use crate::session::Session;
use crate::time::Instant;
use conversation::{Conversation, Settings, Typing};
use sending::{NewLine, Sending};
use shown::{LineEnd, Look, Shown};

/// Arguments of `axcon terminal`.
///
/// What the unit sends is shown with its control characters made visible, except line ends, tabs and backspaces.
/// Ctrl-] leaves; Ctrl-T and a key do the rest: h hexadecimal, t times, e local echo, r raw, f send a file, b break.
/// Where standard input is not a terminal, what comes is sent, its line ends as --newline-out says, and the command ends
/// when the input has ended and the line has been silent for a second (6 s if nothing was heard since the last byte left),
/// or after 10 s where it is never silent. A recording is shown as it was.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Append what the unit sends to FILE, byte for byte; only a password it repeats is replaced.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Show bytes as they are: the terminal obeys whatever the unit sends.
    #[arg(long, conflicts_with_all = ["hex", "timestamps"])]
    raw: bool,
    /// Show both directions as hexadecimal rows.
    #[arg(long)]
    hex: bool,
    /// Put the local time before each line.
    #[arg(long)]
    timestamps: bool,
    /// Show what is typed as well; the units do not repeat it.
    #[arg(long)]
    echo: bool,
    /// What ends a line of what comes.
    #[arg(long, value_name = "END", value_enum, default_value_t = LineEnd::Auto)]
    newline_in: LineEnd,
    /// What Enter sends, and the line ends of files and of what comes through a pipe; the units want CR.
    #[arg(long, value_name = "END", value_enum, default_value_t = NewLine::Cr)]
    newline_out: NewLine,
    /// Send FILE, its line ends as --newline-out says, and end when the line falls silent (or stay, at a terminal).
    #[arg(long, value_name = "FILE")]
    send: Option<PathBuf>,
}

impl Args {
    fn look(&self) -> Look {
        if self.raw {
            Look::Raw
        } else if self.hex {
            Look::Hex
        } else {
            Look::Text
        }
    }
}

/// Connects the user with the unit, or shows a recording.
///
/// # Errors
/// If the port does not open or goes away, or a signal ends the command.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if output.json {
        return Err(CliError::message(Kind::Usage, "a terminal shows the bytes that come, so --json does not apply")
            .hint("'axcon stream --json' and 'axcon diagnostics --json' write what the unit says as objects"));
    }
    let spec = link::spec(global)?;
    if let LinkSpec::Replay(path) = &spec {
        if args.send.is_some() {
            return Err(link::read_only("take a file"));
        }
        link::not_recorded_again(global)?;
        return replay(path, &args, output);
    }
    converse(&spec, args, global, output)
}

/// Opens the link and goes on until the conversation ends.
fn converse(spec: &LinkSpec, args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let look = args.look();
    let clock = Clock::start();
    let (sender, inputs) = host::channel();
    if let Some(log) = &args.log {
        files::has_folder(log).map_err(|error| log_error(log, error))?;
    }
    let sending = args.send.as_deref().map(|path| Sending::open(path, args.newline_out)).transpose()?;
    let plan = link::recording(global)?;
    let _signals = waiting::hear_signals(sender.clone())?;
    let connection = link::open(spec, global, clock, sender.clone(), &inputs)?;
    // Not before: a port that does not open leaves no file.
    let log = args.log.map(open_log).transpose()?;
    let recorder = link::start_recording(&plan, &connection, clock, output)?;
    let interactive = io::stdin().is_terminal();
    let comeback = Comeback::of(spec, link::options(global)).filter(|_| interactive);
    if interactive {
        output.remark(&format!("{} at {}; Ctrl-] leaves, Ctrl-T ? helps", connection.port(), connection.settings()));
    }
    let (raw_mode, typing) = take_input(interactive, sending.is_some(), sender.clone())?;
    let shown = Shown::new(look, args.timestamps, args.newline_in, io::stdout().is_terminal() && interactive);
    let mut conversation = Conversation::new(
        (Cable::new(connection, comeback), sender, inputs),
        (clock, recorder, Session::plain(global.baud)),
        typing,
        shown,
        Settings { log, new_line: args.newline_out, echo: args.echo, interactive },
    );
    conversation.start_sending(sending);
    let end = conversation.run(output);
    let warning = conversation.take_warning();
    drop(conversation);
    drop(raw_mode);
    if interactive {
        output.remark("");
    }
    if let Some(warning) = warning {
        output.remark(&format!("axcon: {warning}"));
    }
    end
}

/// The user's terminal in raw mode, if there is a user, and what is typed there or piped in. A command that sends a
/// file without a user does not read standard input.
fn take_input(
    interactive: bool,
    sends_file: bool,
    inputs: SyncSender<Input>,
) -> Result<(Option<RawMode>, Typing), CliError> {
    let raw_mode = interactive
        .then(RawMode::enter)
        .transpose()
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot use the terminal")))?;
    let typing = if sends_file && !interactive { Typing::ended() } else { Typing::listen(inputs)? };
    Ok((raw_mode, typing))
}

/// Shows a recording as it was, as fast as it can be read.
fn replay(path: &Path, args: &Args, output: &mut Output) -> Result<(), CliError> {
    let look = args.look();
    let (sender, inputs) = host::channel();
    let _signals = waiting::hear_signals(sender.clone())?;
    let mut recording = link::open_recording(path, sender, &inputs)?;
    let mut log = args.log.clone().map(open_log).transpose()?;
    let time_of = time_of(Calendar::Recording(recording.header().unix_millis));
    let mut shown = Shown::new(look, args.timestamps, args.newline_in, false);
    while let Some(piece) = recording.next().map_err(link::recording_error)? {
        if let Ok(Input::Signal(_)) = inputs.try_recv() {
            return Err(CliError::reported(Kind::Interrupted));
        }
        let mut out = Vec::new();
        match piece {
            Piece::Header(_) => {}
            Piece::Bytes { at, direction, bytes } => {
                if direction == Direction::FromUnit
                    && let Some((path, log)) = &mut log
                {
                    log.write_all(&bytes).map_err(|error| log_error(path, error))?;
                }
                if direction == Direction::FromUnit || args.echo || look == Look::Hex {
                    shown.push(at, direction, &bytes, &time_of, &mut out);
                }
            }
            Piece::Mark { at, text } => {
                shown.break_line(&time_of, &mut out);
                output.remark(&format!("-- {} {} --", time_of(at), printable(&text)));
            }
        }
        output.data(&out)?;
    }
    let mut out = Vec::new();
    shown.finish(&time_of, &mut out);
    output.data(&out)?;
    if recording.ending() == Some(Ending::CutShort) {
        output.remark(link::CUT_SHORT);
    }
    Ok(())
}

/// Names moments by the local time of day.
fn time_of(calendar: Calendar) -> impl Fn(Instant) -> String {
    let zone = TimeZone::system();
    move |at| calendar.at(at).to_zoned(zone.clone()).strftime("%H:%M:%S%.3f").to_string()
}

fn printable(text: &str) -> String {
    crate::wire::visible::line(text.as_bytes())
}

fn open_log(path: PathBuf) -> Result<(PathBuf, File), CliError> {
    match File::options().append(true).create(true).open(&path) {
        Ok(file) => Ok((path, file)),
        Err(error) => Err(log_error(&path, error)),
    }
}

fn log_error(path: &Path, error: io::Error) -> CliError {
    CliError::new(
        Kind::Failed,
        anyhow::Error::new(error).context(format!("cannot write the log '{}'", files::shown(path))),
    )
}
