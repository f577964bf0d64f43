//! `axcon terminal`: keys out, bytes in.
//!
//! A session stands between the two, so that the unit's XON and XOFF are obeyed and a password is recorded by its number
//! of characters only; it runs no job. What is shown and logged is taken from its record, so the password is in neither.

mod keys;
mod sending;
mod shown;

use std::fs::File;
use std::io::{self, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};

use jiff::tz::TimeZone;

use super::error::{CliError, Kind};
use super::link;
use super::numbers::counted;
use super::output::Output;
use super::talk::Calendar;
use super::{Global, files, waiting};
use crate::endpoint::Endpoint;
use crate::host::clock::Clock;
use crate::host::comeback::Comeback;
use crate::host::link::{Connection, LinkSpec};
use crate::host::recorder::Recorder;
use crate::host::replay::Recording;
use crate::host::terminal::RawMode;
use crate::host::{self, Input};
use crate::record::{Direction, Ending, LINK_BACK, LINK_LOST, Piece};
use crate::session::{Command, Session};
use crate::time::{Duration, Instant};
use keys::{Deed, Keys};
use sending::{NewLine, Sending};
use shown::{LineEnd, Look, Shown};

/// Arguments of `axcon terminal`.
///
/// What the unit sends is shown with its control characters made visible, except line ends, tabs and backspaces.
/// Ctrl-] leaves; Ctrl-T and a key do the rest: h hexadecimal, t times, e local echo, r raw, f send a file, b break.
/// Where standard input is not a terminal, what comes is sent as it is, and the command ends when the input has ended
/// and the line has been silent for a second, or after 10 s where it is never silent. A recording is shown as it was.
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
    /// What Enter sends, and the line ends of files; the units want CR.
    #[arg(long, value_name = "END", value_enum, default_value_t = NewLine::Cr)]
    newline_out: NewLine,
    /// Send FILE, its line ends as --newline-out says, and end when the line falls silent (or stay, at a terminal).
    #[arg(long, value_name = "FILE")]
    send: Option<PathBuf>,
}

/// How long the line must have been silent after the end of the input: a unit answers a key much faster, and repeats
/// its diagnostics every second.
const SILENCE: Duration = Duration::from_secs(1);

/// How long a line that is never silent, with a stream on it, is shown behind the end of the input and of what was sent:
/// a script that pipes keys in waits for its end.
const LISTENING: Duration = Duration::from_secs(10);

/// How long the beginning of a UTF-8 character, or of a hexadecimal row, waits for its end before it is shown.
const HALF_CHARACTER: Duration = Duration::from_millis(100);

/// Bytes of standard input taken at once, and how many may wait before the next are asked for.
const TYPED: usize = 1024;
const WAITING: usize = 64;

/// A hold by XOFF that lasts so long is told: the keys seem dead otherwise.
const LONG_HOLD: Duration = Duration::from_secs(2);

/// Connects the user with the unit.
///
/// # Errors
/// If the port does not open or goes away, or a signal ends the command.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if output.json {
        return Err(CliError::message(Kind::Usage, "a terminal shows the bytes that come, so --json does not apply")
            .hint("'axcon stream --json' and 'axcon diagnostics --json' write what the unit says as objects"));
    }
    let look = match (args.raw, args.hex) {
        (true, _) => Look::Raw,
        (false, true) => Look::Hex,
        (false, false) => Look::Text,
    };
    let spec = link::spec(global)?;
    if let LinkSpec::Replay(path) = &spec {
        if args.send.is_some() {
            return Err(link::read_only("take a file"));
        }
        link::not_recorded_again(global)?;
        return replay(path, look, &args, output);
    }
    let clock = Clock::start();
    let (sender, inputs) = host::channel();
    let log = args.log.map(open_log).transpose()?;
    let sending = args.send.as_deref().map(|path| Sending::open(path, args.newline_out)).transpose()?;
    let plan = link::recording(global)?;
    let _signals = waiting::hear_signals(sender.clone())?;
    let connection = link::open(&spec, global, clock, sender.clone(), &inputs)?;
    let recorder = link::start_recording(&plan, &connection, clock, output)?;
    let interactive = io::stdin().is_terminal();
    let comeback = Comeback::of(&spec, link::options(global)).filter(|_| interactive);
    if interactive {
        output.remark(&format!("{} at {}; Ctrl-] leaves, Ctrl-T ? helps", connection.port(), connection.settings()));
    }
    let raw_mode = interactive
        .then(RawMode::enter)
        .transpose()
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot use the terminal")))?;
    let from_file_only = sending.is_some() && !interactive;
    let more = if from_file_only { sync_channel(1).0 } else { listen_to_standard_input(sender.clone())? };
    let mut keys = Keys::default();
    keys.set_sending(sending.is_some());
    let mut conversation = Conversation {
        connection: Some(connection),
        comeback,
        retry: None,
        inputs: sender,
        recorder,
        log,
        clock,
        more,
        asked_for_more: true,
        keys,
        sending,
        new_line: args.newline_out,
        echo: args.echo,
        session: Session::plain(global.baud),
        followed: 0,
        shown: Shown::new(look, args.timestamps, args.newline_in, io::stdout().is_terminal() && interactive),
        interactive,
        ended: from_file_only,
        hold_told: false,
        last: clock.now(),
        last_sent: clock.now(),
    };
    let end = conversation.run(&inputs, output);
    let warning = conversation.recorder.take_warning();
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

/// A hold that lasts so long has no end: its XON was lost. Loaders hold their sender for seconds while they erase.
const STUCK: Duration = Duration::from_secs(30);

/// When a command that nobody sits at gives up what it cannot send. Who sits at it sees that and leaves.
fn stuck_at(held_since: Option<Instant>, waits: bool, interactive: bool) -> Option<Instant> {
    held_since.filter(|_| waits && !interactive).map(|since| since + STUCK)
}

/// When a command whose input has ended is over: a byte went either way last at the one moment, to the unit at the other.
fn over_at(last: Instant, last_sent: Instant) -> Instant {
    (last + SILENCE).min(last_sent + LISTENING)
}

struct Conversation {
    /// `None` while the cable is away.
    connection: Option<Connection>,
    comeback: Option<Comeback>,
    /// When a lost link is tried again.
    retry: Option<Instant>,
    inputs: SyncSender<Input>,
    recorder: Recorder,
    log: Option<(PathBuf, File)>,
    clock: Clock,
    /// Asks the reader of standard input for the next piece, so that a long file waits there and not here.
    more: SyncSender<()>,
    asked_for_more: bool,
    keys: Keys,
    sending: Option<Sending>,
    new_line: NewLine,
    echo: bool,
    session: Session,
    /// Entries of the session's record that have been shown and logged.
    followed: u64,
    shown: Shown,
    interactive: bool,
    /// Whether standard input has ended.
    ended: bool,
    hold_told: bool,
    /// When a byte last went either way.
    last: Instant,
    /// When one last left, or there was no more to send.
    last_sent: Instant,
}

impl Conversation {
    fn run(&mut self, inputs: &Receiver<Input>, output: &mut Output) -> Result<(), CliError> {
        loop {
            let now = self.clock.now();
            self.send(now, output)?;
            let waits = self.sending.is_some() || self.session.waiting() > 0;
            let silent_at = (self.ended && !waits).then(|| over_at(self.last, self.last_sent));
            if silent_at.is_some_and(|at| at <= now) {
                return self.finish_shown(output);
            }
            let stuck_at = stuck_at(self.session.held_since(), waits, self.interactive);
            if stuck_at.is_some_and(|at| at <= now) {
                self.finish_shown(output)?;
                let message = format!("the unit has held us by XOFF for {} s, and something waits", STUCK.as_secs());
                return Err(CliError::message(Kind::NoAnswer, message)
                    .hint("its XON was lost, or it hangs: 'axcon identify' says whether it answers; then send again"));
            }
            let whole_at = self.shown.keeps_back().then(|| self.last + HALF_CHARACTER);
            if whole_at.is_some_and(|at| at <= now) {
                self.finish_shown(output)?;
            }
            if self.retry.is_some_and(|at| at <= now) {
                self.try_again(now, output);
            }
            let told_at = self.session.held_since().filter(|_| self.interactive && !self.hold_told);
            let told_at = told_at.map(|since| since + LONG_HOLD);
            if told_at.is_some_and(|at| at <= now) {
                self.hold_told = true;
                self.say("the unit holds us by XOFF: what is typed waits for its XON", output)?;
            }
            let whole_at = whole_at.filter(|_| self.shown.keeps_back());
            let told_at = told_at.filter(|_| !self.hold_told);
            let due = [silent_at, stuck_at, whole_at, self.retry, told_at, self.session.poll_timeout()];
            let input = match due.into_iter().flatten().min() {
                None => inputs.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(at) => inputs.recv_timeout(self.clock.until(at)),
            };
            match input {
                Ok(Input::Bytes { at, bytes, .. }) => {
                    self.last = at;
                    self.session.handle_bytes(at, &bytes);
                    self.follow(output)?;
                }
                Ok(Input::Typed(bytes)) => {
                    self.asked_for_more = false;
                    if self.typed(bytes, output)? {
                        return self.send(self.clock.now(), output);
                    }
                }
                Ok(Input::TypedEnd) => {
                    self.ended = true;
                    (self.last, self.last_sent) = (self.clock.now(), self.clock.now());
                }
                // Of a link that is given up already there is nothing more to say.
                Ok(Input::Gone { link, error }) => {
                    if self.connection.as_ref().is_some_and(|connection| connection.id() == link) {
                        self.lost(link::link_error(error), output)?;
                    }
                }
                Ok(Input::Signal(_)) => return Err(CliError::reported(Kind::Interrupted)),
                Ok(Input::Wake) | Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
        }
    }

    /// Takes what came on standard input. Says whether the user leaves.
    fn typed(&mut self, bytes: Vec<u8>, output: &mut Output) -> Result<bool, CliError> {
        if !self.interactive {
            self.type_keys(bytes, output);
            return Ok(false);
        }
        for deed in self.keys.press(&bytes) {
            match deed {
                Deed::Send(keys) => {
                    let keys = keys.iter().flat_map(|key| self.new_line.of_key(key).iter().copied()).collect();
                    self.type_keys(keys, output);
                }
                Deed::Leave => return Ok(true),
                Deed::Hex => self.look(Look::Hex, output)?,
                Deed::Raw => self.look(Look::Raw, output)?,
                Deed::Times => {
                    let on = self.shown.toggle_times();
                    self.say(if on { "times are shown" } else { "times are not shown" }, output)?;
                }
                Deed::Echo => {
                    self.echo = !self.echo;
                    let text = if self.echo { "what is typed is shown" } else { "what is typed is not shown" };
                    self.say(text, output)?;
                }
                Deed::Break => match self.connection.as_ref().map(Connection::send_break) {
                    Some(Ok(())) => {
                        self.recorder.mark(self.clock.now(), "break");
                        self.say("break", output)?;
                    }
                    Some(Err(error)) => self.say(&format!("no break: {error}"), output)?,
                    None => self.say("no break: the link is lost", output)?,
                },
                Deed::Help => self.say(keys::HELP, output)?,
                Deed::Naming(name) => output.data(format!("\r\x1b[Kfile to send: {}", printable(&name)).as_bytes())?,
                Deed::SendFile(path) => {
                    output.data(b"\r\n")?;
                    match Sending::open(&path, self.new_line) {
                        Ok(sending) => {
                            self.keys.set_sending(true);
                            self.say(&format!("sending {}; Ctrl-C ends it", path.display()), output)?;
                            self.sending = Some(sending);
                        }
                        Err(error) => self.say(&error.to_string(), output)?,
                    }
                }
                Deed::Cancel => match self.sending.take() {
                    Some(sending) => {
                        self.keys.set_sending(false);
                        self.say(&format!("ended behind {}", counted(sending.sent(), "byte")), output)?;
                    }
                    None => output.data(b"\r\x1b[K")?,
                },
            }
        }
        Ok(false)
    }

    fn look(&mut self, look: Look, output: &mut Output) -> Result<(), CliError> {
        let look = if self.shown.look() == look { Look::Text } else { look };
        self.shown.set_look(look);
        let text = match look {
            Look::Text => "shown as text",
            Look::Hex => "shown in hexadecimal",
            Look::Raw => "shown as it is: the terminal obeys the unit",
        };
        self.say(text, output)
    }

    /// A remark of the terminal's own, on a line of its own.
    fn say(&mut self, text: &str, output: &mut Output) -> Result<(), CliError> {
        let mut out = Vec::new();
        self.shown.break_line(time_of(Calendar::Clock(self.clock)), &mut out);
        output.data(&out)?;
        let end = if self.interactive { "\r" } else { "" };
        output.remark(&format!("-- {} --{end}", printable(text)));
        Ok(())
    }

    /// Shows, logs and records what has come and gone.
    fn follow(&mut self, output: &mut Output) -> Result<(), CliError> {
        while self.session.poll_event().is_some() {}
        self.recorder.follow(self.session.record());
        if let Some(warning) = self.recorder.take_warning() {
            self.say(&warning, output)?;
        }
        self.hold_told &= self.session.held_since().is_some();
        let time_of = time_of(Calendar::Clock(self.clock));
        let mut out = Vec::new();
        for entry in self.session.record().entries_from(self.followed) {
            if entry.direction == Direction::FromUnit
                && let Some((path, log)) = &mut self.log
            {
                log.write_all(&entry.bytes).map_err(|error| log_error(path, error))?;
            }
            let seen = entry.direction == Direction::FromUnit || self.echo || self.shown.look() == Look::Hex;
            if seen {
                self.shown.push(entry.at, entry.direction, &entry.bytes, &time_of, &mut out);
            }
        }
        self.followed = self.session.record().entry_count();
        if out.is_empty() { Ok(()) } else { output.data(&out) }
    }

    fn finish_shown(&mut self, output: &mut Output) -> Result<(), CliError> {
        let mut out = Vec::new();
        self.shown.finish(time_of(Calendar::Clock(self.clock)), &mut out);
        if out.is_empty() { Ok(()) } else { output.data(&out) }
    }

    fn type_keys(&mut self, keys: Vec<u8>, output: &mut Output) {
        let why = match &self.connection {
            Some(_) => self.session.command(self.clock.now(), Command::Keys(keys)).err().map(|error| error.to_string()),
            None => Some("not sent: the link is lost".to_owned()),
        };
        if let Some(why) = why {
            output.remark(&format!("axcon: {why}{}", if self.interactive { "\r" } else { "" }));
        }
    }

    fn send(&mut self, now: Instant, output: &mut Output) -> Result<(), CliError> {
        self.session.handle_timeout(now);
        if self.connection.is_some() {
            self.send_of_file(now, output)?;
        }
        let mut failed = None;
        while let Some(transmit) = self.session.poll_transmit() {
            (self.last, self.last_sent) = (now, now);
            self.recorder.follow(self.session.record());
            let Some(connection) = &self.connection else { continue };
            if let Err(error) = connection.send(transmit.bytes) {
                let text = format!("{}: {error}", connection.port());
                failed = Some(CliError::message(Kind::PortGone, text));
                break;
            }
        }
        self.follow(output)?;
        if let Some(error) = failed {
            self.lost(error, output)?;
        }
        if !self.asked_for_more && self.session.waiting() <= WAITING {
            self.asked_for_more = self.more.try_send(()).is_ok();
        }
        Ok(())
    }

    /// Hands the session the next piece of the file, when the one before has all but left.
    fn send_of_file(&mut self, now: Instant, output: &mut Output) -> Result<(), CliError> {
        while self.session.waiting() <= WAITING {
            let Some(sending) = &mut self.sending else { return Ok(()) };
            let piece = sending.next()?;
            if piece.is_empty() {
                let text = format!("sent {}", counted(sending.sent(), "byte"));
                self.sending = None;
                self.keys.set_sending(false);
                (self.last, self.last_sent) = (now, now);
                return self.say(&text, output);
            }
            self.session.command(now, Command::Keys(piece)).map_err(|refusal| CliError::new(Kind::Failed, refusal))?;
        }
        Ok(())
    }

    /// The link is lost: the end, or a pause if it may come back.
    fn lost(&mut self, error: CliError, output: &mut Output) -> Result<(), CliError> {
        let Some(comeback) = &mut self.comeback else { return Err(error) };
        if self.connection.take().is_some() {
            comeback.lost();
            let now = self.clock.now();
            self.session.link_lost(now);
            self.sending = None;
            self.keys.set_sending(false);
            self.recorder.mark(now, LINK_LOST);
            self.retry = Some(now + Comeback::RETRY);
            self.say(&format!("{error}; waiting for it to come back, Ctrl-] leaves"), output)?;
        }
        Ok(())
    }

    fn try_again(&mut self, now: Instant, output: &mut Output) {
        let comeback = self.comeback.as_ref();
        let connection = comeback.and_then(|it| it.open(self.clock, self.inputs.clone()));
        match connection {
            Some(connection) => {
                let text = format!("{LINK_BACK}as {}", connection.port());
                self.recorder.mark(now, &text);
                self.session.link_back(now);
                self.connection = Some(connection);
                self.retry = None;
                let _ = self.say(&text, output);
            }
            None => self.retry = Some(now + Comeback::RETRY),
        }
    }
}

/// Shows a recording as it was, as fast as it can be read.
fn replay(path: &Path, look: Look, args: &Args, output: &mut Output) -> Result<(), CliError> {
    let mut recording = Recording::open(path).map_err(link::recording_error)?;
    let mut log = args.log.clone().map(open_log).transpose()?;
    let time_of = time_of(Calendar::Recording(recording.header().unix_millis));
    let mut shown = Shown::new(look, args.timestamps, args.newline_in, false);
    while let Some(piece) = recording.next().map_err(link::recording_error)? {
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

fn log_error(path: &Path, error: io::Error) -> CliError {
    CliError::new(
        Kind::Failed,
        anyhow::Error::new(error).context(format!("cannot write the log '{}'", files::shown(path))),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipe_ends_with_silence_and_also_where_there_is_none() {
        let sent = Instant::from_millis(500);
        assert_eq!(over_at(sent, sent), sent + SILENCE);
        let heard = |seconds| sent + Duration::from_secs(seconds);
        assert_eq!([over_at(heard(2), sent), over_at(heard(60), sent)], [heard(3), sent + LISTENING]);
    }

    #[test]
    fn only_what_nobody_sits_at_gives_up_and_only_if_something_waits() {
        let since = Some(Instant::from_millis(500));
        assert_eq!(stuck_at(since, true, false), Some(Instant::from_millis(500) + STUCK));
        for (since, waits, interactive) in [(since, false, false), (since, true, true), (None, true, false)] {
            assert_eq!(stuck_at(since, waits, interactive), None);
        }
    }
}
