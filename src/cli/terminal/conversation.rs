//! The user and the unit, with what is due meanwhile.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use super::keys::{self, Keys, Wish};
use super::sending::{LineEnds, NewLine, Sending};
use super::shown::{Look, Shown};
use super::{log_error, printable, time_of};
use crate::cli::calendar::Calendar;
use crate::cli::error::{CliError, Kind};
use crate::cli::link;
use crate::cli::numbers::counted;
use crate::cli::output::Output;
use crate::endpoint::{Arrived, Endpoint};
use crate::host::clock::Clock;
use crate::host::comeback::Cable;
use crate::host::link::{Connection, WRITE_PATIENCE};
use crate::host::recorder::Recorder;
use crate::host::{Closed, Inbox, Input};
use crate::record::{Direction, LINK_BACK, LINK_LOST};
use crate::session::{Command, Session};
use crate::time::{Duration, Instant};

/// How long the line must have been silent after the end of the input: a unit answers a key much faster, and repeats
/// its diagnostics every second.
const SILENCE: Duration = Duration::from_secs(1);

/// The same where nothing has been heard since the last byte was sent: a port that takes no more bytes says so after
/// [`WRITE_PATIENCE`], and what waits for it must not pass for sent.
const UNANSWERED: Duration = WRITE_PATIENCE.saturating_add(SILENCE);

/// How long a line that is never silent, with a stream on it, is shown after the end of the input and of what was sent:
/// a script that pipes keys in waits for its end.
const LISTENING: Duration = Duration::from_secs(10);

/// How long the beginning of a UTF-8 character, or of a hexadecimal row, waits for its end before it is shown.
const HALF_CHARACTER: Duration = Duration::from_millis(100);

/// Bytes of standard input taken at once, and how many may wait before the next are asked for.
const TYPED: usize = 1024;
const WAITING: usize = 64;

/// A hold by XOFF that lasts this long is mentioned: the keys seem dead otherwise.
const LONG_HOLD: Duration = Duration::from_secs(2);

/// Longest wait for anything: bounds the arithmetic, nothing else.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

/// A hold that lasts this long has no end: its XON was lost. Loaders hold their sender for seconds while they erase.
const STUCK: Duration = Duration::from_secs(30);

/// When a command without a user at a terminal gives up what it cannot send. A user sees that and leaves.
fn stuck_at(held_since: Option<Instant>, waits: bool, interactive: bool) -> Option<Instant> {
    held_since.filter(|_| waits && !interactive).map(|since| since + STUCK)
}

/// The error of a command whose unit holds it for good.
fn stuck() -> CliError {
    let message = format!("the unit has held us by XOFF for {} s, and something waits", STUCK.as_secs());
    CliError::message(Kind::NoAnswer, message)
        .hint("its XON was lost, or it hangs: 'axcon identify' says whether it answers; then send again")
}

/// What the user does.
pub struct Typing {
    /// Asks the reader of standard input for the next piece, so that a long file waits there and not here.
    more: SyncSender<()>,
    asked_for_more: bool,
    /// Standard input has ended.
    ended: bool,
    keys: Keys,
}

impl Typing {
    /// Nobody types.
    pub fn ended() -> Self {
        Typing { more: sync_channel(1).0, asked_for_more: true, ended: true, keys: Keys::default() }
    }

    /// Reads standard input in a thread that lives as long as the process, one piece each time it is asked.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn listen(inputs: SyncSender<Input>) -> Result<Self, CliError> {
        let more = listen_to_standard_input(inputs)?;
        Ok(Typing { more, asked_for_more: true, ended: false, keys: Keys::default() })
    }

    fn ask_for_more(&mut self) {
        if !self.asked_for_more {
            self.asked_for_more = self.more.try_send(()).is_ok();
        }
    }
}

/// How long nothing has been said.
#[derive(Clone, Copy, Debug)]
struct Quiet {
    /// When a byte last went either way.
    last: Instant,
    /// When one last left, or there was no more to send.
    last_sent: Instant,
    /// Nothing has come since one last left.
    unanswered: bool,
}

impl Quiet {
    fn since(now: Instant) -> Self {
        Quiet { last: now, last_sent: now, unanswered: false }
    }

    fn heard(&mut self, at: Instant) {
        (self.last, self.unanswered) = (at, false);
    }

    fn sent(&mut self, now: Instant) {
        *self = Quiet { unanswered: true, ..Quiet::since(now) };
    }

    /// There is no more to send.
    fn no_more(&mut self, now: Instant) {
        (self.last, self.last_sent) = (now, now);
    }

    /// When a command whose input has ended is over.
    fn over_at(self) -> Instant {
        let silence = if self.unanswered { UNANSWERED } else { SILENCE };
        (self.last + silence).min(self.last_sent + LISTENING)
    }
}

/// What has to be done at some moment.
#[derive(Clone, Copy, Debug)]
enum Due {
    /// The input has ended, and the unit has had its time to answer.
    Over,
    /// The unit holds us, and nobody is there to see it.
    Stuck,
    /// What was kept back as half a character is shown.
    Shown,
    /// The lost link is tried again.
    Retry,
    /// The user is told that the unit holds us.
    Held,
}

/// What the command line says about a conversation.
pub struct Settings {
    pub log: Option<(PathBuf, File)>,
    pub new_line: NewLine,
    pub echo: bool,
    pub interactive: bool,
}

/// The user and the unit.
pub struct Conversation {
    cable: Cable,
    inbox: Inbox,
    inputs: SyncSender<Input>,
    clock: Clock,
    recorder: Recorder,
    session: Session,
    /// Entries of the session's record that have been shown and logged.
    followed: u64,
    typing: Typing,
    sending: Option<Sending>,
    /// Of what comes through a pipe.
    line_ends: LineEnds,
    shown: Shown,
    settings: Settings,
    /// The user knows that the unit holds us.
    hold_told: bool,
    quiet: Quiet,
}

impl Conversation {
    /// Over an open link, whose inputs come on this channel.
    pub fn new(
        (cable, inputs, arriving): (Cable, SyncSender<Input>, Receiver<Input>),
        (clock, recorder, session): (Clock, Recorder, Session),
        typing: Typing,
        shown: Shown,
        settings: Settings,
    ) -> Self {
        Conversation {
            cable,
            inbox: Inbox::new(arriving),
            inputs,
            clock,
            recorder,
            session,
            followed: 0,
            typing,
            sending: None,
            line_ends: LineEnds::new(settings.new_line),
            shown,
            settings,
            hold_told: false,
            quiet: Quiet::since(clock.now()),
        }
    }

    /// Sends a file first.
    pub fn start_sending(&mut self, sending: Option<Sending>) {
        self.typing.keys.set_sending(sending.is_some());
        self.sending = sending;
    }

    /// What went wrong with the recording, once.
    pub fn take_warning(&mut self) -> Option<String> {
        self.recorder.take_warning()
    }

    /// Goes on until the user leaves, the input has ended and the unit is silent, or something fails.
    ///
    /// # Errors
    /// If the link is lost for good, the unit holds what is to be sent, output fails, or a signal comes.
    pub fn run(&mut self, output: &mut Output) -> Result<(), CliError> {
        loop {
            let arrived = self.inbox.arrived();
            self.hear(&arrived, output)?;
            let now = self.clock.now();
            self.send(now, output)?;
            let due = self.due();
            match due.filter(|(at, _)| *at <= now) {
                Some((_, Due::Over)) => return self.finish_shown(output),
                Some((_, Due::Stuck)) => {
                    self.finish_shown(output)?;
                    return Err(stuck());
                }
                Some((_, Due::Shown)) => self.finish_shown(output)?,
                Some((_, Due::Retry)) => self.try_again(now, output)?,
                Some((_, Due::Held)) => {
                    self.hold_told = true;
                    self.say("the unit holds us by XOFF: what is typed waits for its XON", output)?;
                }
                None => {
                    let wake = due.map(|(at, _)| at).into_iter().chain(self.session.poll_timeout()).min();
                    let patience = wake.map_or(LONGEST_WAIT, |at| self.clock.until(at).min(LONGEST_WAIT));
                    match self.inbox.next(patience) {
                        Ok(Some(Input::Typed(bytes))) => {
                            self.typing.asked_for_more = false;
                            if self.typed(bytes, output)? {
                                return self.send(self.clock.now(), output);
                            }
                        }
                        Ok(Some(Input::TypedEnd)) => {
                            self.typing.ended = true;
                            self.quiet.no_more(self.clock.now());
                        }
                        Ok(Some(Input::Gone { error, .. })) => self.lost(link::link_error(error), output)?,
                        Ok(Some(Input::Signal(_))) => return Err(CliError::reported(Kind::Interrupted)),
                        Ok(Some(Input::Bytes { .. } | Input::Wake) | None) => {}
                        Err(Closed) => return Ok(()),
                    }
                }
            }
        }
    }

    /// What has to be done next, beside what the session waits for.
    fn due(&self) -> Option<(Instant, Due)> {
        let waits = self.sending.is_some() || self.session.waiting() > 0;
        let held_since = self.session.held_since();
        let untold = held_since.filter(|_| self.settings.interactive && !self.hold_told);
        let all = [
            (self.typing.ended && !waits).then(|| (self.quiet.over_at(), Due::Over)),
            stuck_at(held_since, waits, self.settings.interactive).map(|at| (at, Due::Stuck)),
            self.shown.keeps_back().then(|| (self.quiet.last + HALF_CHARACTER, Due::Shown)),
            self.cable.retry_at().map(|at| (at, Due::Retry)),
            untold.map(|since| (since + LONG_HOLD, Due::Held)),
        ];
        all.into_iter().flatten().min_by_key(|(at, _)| *at)
    }

    /// Takes what the unit has said.
    fn hear(&mut self, arrived: &[Arrived], output: &mut Output) -> Result<(), CliError> {
        let Some(last) = arrived.last() else { return Ok(()) };
        self.quiet.heard(last.at);
        self.session.handle_backlog(self.clock.now(), arrived);
        self.follow(output)
    }

    /// Takes what came on standard input. Says whether the user leaves.
    fn typed(&mut self, bytes: Vec<u8>, output: &mut Output) -> Result<bool, CliError> {
        if !self.settings.interactive {
            let keys = self.line_ends.converted(&bytes);
            self.type_keys(keys, output);
            return Ok(false);
        }
        for wish in self.typing.keys.press(&bytes) {
            match wish {
                Wish::Send(keys) => {
                    let keys = keys.iter().flat_map(|key| self.settings.new_line.of_key(key).iter().copied()).collect();
                    self.type_keys(keys, output);
                }
                Wish::Leave => return Ok(true),
                Wish::Hex => self.look(Look::Hex, output)?,
                Wish::Raw => self.look(Look::Raw, output)?,
                Wish::Times => {
                    let on = self.shown.toggle_times();
                    self.say(if on { "times are shown" } else { "times are not shown" }, output)?;
                }
                Wish::Echo => {
                    self.settings.echo = !self.settings.echo;
                    let text = if self.settings.echo { "what is typed is shown" } else { "what is typed is not shown" };
                    self.say(text, output)?;
                }
                Wish::Break => match self.cable.connection().map(Connection::send_break) {
                    Some(Ok(())) => {
                        self.recorder.mark(self.clock.now(), "break");
                        self.say("break", output)?;
                    }
                    Some(Err(error)) => self.say(&format!("no break: {error}"), output)?,
                    None => self.say("no break: the link is lost", output)?,
                },
                Wish::Help => self.say(keys::HELP, output)?,
                Wish::Naming(name) => output.data(format!("\r\x1b[Kfile to send: {}", printable(&name)).as_bytes())?,
                Wish::SendFile(path) => {
                    output.data(b"\r\n")?;
                    match Sending::open(&path, self.settings.new_line) {
                        Ok(sending) => {
                            self.say(&format!("sending {}; Ctrl-C ends it", path.display()), output)?;
                            self.sending = Some(sending);
                        }
                        Err(error) => {
                            self.typing.keys.set_sending(false);
                            self.say(&error.to_string(), output)?;
                        }
                    }
                }
                Wish::Cancel => match self.sending.take() {
                    Some(sending) => {
                        self.typing.keys.set_sending(false);
                        self.say(&format!("ended after {}", counted(sending.sent(), "byte")), output)?;
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
        let end = if self.settings.interactive { "\r" } else { "" };
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
                && let Some((path, log)) = &mut self.settings.log
            {
                log.write_all(&entry.bytes).map_err(|error| log_error(path, error))?;
            }
            let seen = entry.direction == Direction::FromUnit || self.settings.echo || self.shown.look() == Look::Hex;
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
        let why = match self.cable.connection() {
            Some(_) => self.session.command(self.clock.now(), Command::Keys(keys)).err().map(|error| error.to_string()),
            None => Some("not sent: the link is lost".to_owned()),
        };
        if let Some(why) = why {
            output.remark(&format!("axcon: {why}{}", if self.settings.interactive { "\r" } else { "" }));
        }
    }

    fn send(&mut self, now: Instant, output: &mut Output) -> Result<(), CliError> {
        self.session.handle_timeout(now);
        let failed = loop {
            let sends_file = self.sending.is_some() && self.cable.connection().is_some();
            if sends_file {
                self.send_of_file(now, output)?;
            }
            let failed = self.let_go(now).err();
            // On a fast line all of that leaves at once, and nothing that waits would wake us for the rest of the file.
            if failed.is_some() || !sends_file || self.session.waiting() > 0 {
                break failed;
            }
        };
        self.follow(output)?;
        if let Some(error) = failed {
            self.lost(error, output)?;
        }
        if self.session.waiting() <= WAITING {
            self.typing.ask_for_more();
        }
        Ok(())
    }

    /// Gives the link what may leave now.
    fn let_go(&mut self, now: Instant) -> Result<(), CliError> {
        while let Some(transmit) = self.session.poll_transmit() {
            self.quiet.sent(now);
            self.recorder.follow(self.session.record());
            let Some(connection) = self.cable.connection() else { continue };
            connection.send(transmit.bytes).map_err(|error| {
                let text = format!("{}: {error}", connection.port());
                CliError::message(Kind::PortGone, text)
            })?;
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
                self.typing.keys.set_sending(false);
                self.quiet.no_more(now);
                return self.say(&text, output);
            }
            self.session.command(now, Command::Keys(piece)).map_err(|refusal| CliError::new(Kind::Failed, refusal))?;
        }
        Ok(())
    }

    /// The link is lost: the end, or a pause if it may come back.
    fn lost(&mut self, error: CliError, output: &mut Output) -> Result<(), CliError> {
        if self.cable.connection().is_none() {
            return Ok(());
        }
        let now = self.clock.now();
        let rest = self.cable.lose(&mut self.inbox, now);
        self.hear(&rest, output)?;
        if !self.cable.may_come_back() {
            return Err(error);
        }
        self.session.link_lost(now);
        self.sending = None;
        self.typing.keys.set_sending(false);
        self.recorder.mark(now, LINK_LOST);
        self.say(&format!("{error}; waiting for it to come back, Ctrl-] leaves"), output)
    }

    fn try_again(&mut self, now: Instant, output: &mut Output) -> Result<(), CliError> {
        let Some(connection) = self.cable.try_again(now, self.clock, &self.inputs) else { return Ok(()) };
        let text = format!("{LINK_BACK}as {}", connection.port());
        self.recorder.mark(now, &text);
        self.session.link_back(now);
        self.say(&text, output)
    }
}

/// Gives what asks for the next piece.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipe_ends_with_silence_and_also_where_there_is_none() {
        let sent = Instant::from_millis(500);
        assert_eq!(Quiet::since(sent).over_at(), sent + SILENCE);
        let heard = |seconds| sent + Duration::from_secs(seconds);
        let over_at = |last| Quiet { last, ..Quiet::since(sent) }.over_at();
        assert_eq!([over_at(heard(2)), over_at(heard(60))], [heard(3), sent + LISTENING]);
    }

    #[test]
    fn what_nobody_has_answered_is_given_the_time_in_which_a_deaf_port_says_so() {
        let sent = Instant::from_millis(500);
        let mut quiet = Quiet::since(Instant::ZERO);
        quiet.sent(sent);
        quiet.no_more(sent);
        assert!(quiet.over_at() > sent + WRITE_PATIENCE);
        quiet.heard(sent);
        assert_eq!(quiet.over_at(), sent + SILENCE);
    }

    #[test]
    fn only_a_command_without_a_user_gives_up_and_only_if_something_waits() {
        let since = Some(Instant::from_millis(500));
        assert_eq!(stuck_at(since, true, false), Some(Instant::from_millis(500) + STUCK));
        for (since, waits, interactive) in [(since, false, false), (since, true, true), (None, true, false)] {
            assert_eq!(stuck_at(since, waits, interactive), None);
        }
    }

    #[cfg(unix)]
    #[test]
    fn the_last_bytes_of_a_lost_link_are_shown_also_if_the_writer_noticed_the_loss_first() {
        use std::sync::{Arc, Mutex};

        use crate::cli::output::Remarks;
        use crate::cli::terminal::shown::LineEnd;
        use crate::host::link::{Cause, LinkError, LinkSpec, Operation, Options};
        use crate::host::pty::Pty;

        #[derive(Clone, Default)]
        struct Screen(Arc<Mutex<Vec<u8>>>);

        impl Write for Screen {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0.lock().expect("no panic").extend_from_slice(bytes);
                Ok(bytes.len())
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }

        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        let (sender, inputs) = crate::host::channel();
        let clock = Clock::start();
        let spec = LinkSpec::Serial(pty.path().to_owned());
        let connection =
            Connection::open(&spec, Options { baud: 115_200 }, clock, sender.clone()).expect("the link opens");
        let link = connection.id();
        let error = LinkError { port: "u0".into(), operation: Operation::Write, cause: Cause::Gone };
        let last = Input::Bytes { link, at: clock.now(), bytes: b"last words\r\n".to_vec() };
        for input in [Input::Gone { link, error }, last] {
            sender.send(input).expect("there is room");
        }
        let mut conversation = Conversation::new(
            (Cable::new(connection, None), sender, inputs),
            (clock, Recorder::nothing(), Session::plain(115_200)),
            Typing::ended(),
            Shown::new(Look::Text, false, LineEnd::Auto, false),
            Settings { log: None, new_line: NewLine::Cr, echo: false, interactive: false },
        );
        let screen = Screen::default();
        let mut output = Output { json: false, out: Box::new(screen.clone()), err: Remarks::to(io::sink()) };
        let ended = conversation.run(&mut output).expect_err("the link is lost");
        assert_eq!(ended.kind, Kind::PortGone);
        let shown = screen.0.lock().expect("no panic").clone();
        assert_eq!(String::from_utf8_lossy(&shown), "last words\n");
    }
}
