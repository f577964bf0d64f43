//! The loop around [`App`]: the one file of the console that touches the system.
//!
//! Everything that happens comes on one channel; the app is told, its effects are performed in their order, and the
//! picture is drawn when something has changed: at once after a key, else at most a frame apart. Nothing wakes the
//! loop without an input or a due timer. Files, ports and folders are looked at in threads of their own, files are written
//! in one, and a network link is dialled in one, so that a slow disk or a silent host does not hold the keys.

mod connecting;
mod files;
mod player;
#[cfg(all(test, unix))]
mod tests;
mod writer;

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use ratatui::crossterm::event::Event as TerminalEvent;

use connecting::DialResult;
use player::{Player, Step};
use writer::{Piece, Writer};

use super::{App, Effect, Failure, ImageFacts, Input, LARGEST_SENT, Noted, Options, Palette, Playback};
use crate::device::LoaderKind;
use crate::endpoint::Arrived;
use crate::host;
use crate::host::Inbox;
use crate::host::clock::Clock;
use crate::host::comeback::Comeback;
use crate::host::link::{Connection, LinkError, LinkSpec};
use crate::host::ports;
use crate::host::recorder::{Plan, Recorder};
use crate::host::replay::{Recording, RecordingError};
use crate::host::signal::{self, Signals};
use crate::host::terminal::{self, Screen};
use crate::image::DefectId;
use crate::time::{Duration, Instant};

/// Least time between two pictures that no key asked for: fewer than thirty a second.
const FRAME: Duration = Duration::from_millis(34);
/// Longest wait: bounds the arithmetic, nothing else.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);
/// Bytes from the unit between two looks at the keyboard: a few milliseconds' work, when rows come as fast as they can be
/// read.
const PART: usize = 8 * 1024;
/// Pieces of a recording between two looks at the keyboard.
const PIECES: usize = 64;

/// What the loop cannot know itself: how the command line names links, and what helps when they fail.
pub struct World {
    /// The link to open at once.
    pub link: Option<String>,
    /// Line rate.
    pub baud: u32,
    /// Where sessions are recorded.
    pub recording: Plan,
    /// Which colours to begin with.
    pub palette: Palette,
    /// Says which link a name means.
    pub resolve: fn(&str) -> Result<LinkSpec, Failure>,
    /// Opens a link.
    pub open: fn(&LinkSpec, u32, Clock, SyncSender<host::Input>) -> Result<Connection, Failure>,
    /// Says what a lost link means.
    pub explain: fn(LinkError) -> Failure,
    /// Says why a recording cannot be read.
    pub unreadable: fn(RecordingError) -> Failure,
    /// Reads and checks an image file.
    pub check: Check,
    /// Notes that an upload of this product begins on this link, or (`None`) that the unit on it runs.
    pub note: fn(&str, Option<Noted>),
    /// What is noted of an upload on this link that has not ended well.
    pub noted: fn(&str) -> Option<Noted>,
}

/// Reads and checks an image file for a loader, if not each product's own, and allows these errors; or says why it cannot
/// be read.
pub type Check = fn(PathBuf, Option<LoaderKind>, &[DefectId]) -> Result<ImageFacts, String>;

/// How the console ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The user left.
    Quit,
    /// A signal ended it.
    Signal,
}

/// Runs the console until the user leaves it.
///
/// # Errors
/// If there is no terminal, or it fails.
pub fn run(world: World) -> io::Result<End> {
    let clock = Clock::start();
    let (sender, inputs) = host::channel();
    let mut screen = Screen::enter()?;
    let _signals = Signals::of_screen(sender.clone())?;
    let keys = terminal::listen(sender.clone())?;
    let size = screen.terminal.size()?;
    let app = App::new(Options {
        link: world.link.clone(),
        directory: std::env::current_dir().unwrap_or_else(|_| PathBuf::from(".")),
        home: std::env::home_dir(),
        palette: world.palette,
        size: (size.width, size.height),
    });
    let mut console = Console::new(app, world, clock, sender, inputs, keys);
    let (found, waker) = (console.answer.clone(), console.sender.clone());
    // Without a watch, R looks again.
    let _ = ports::watch(move || {
        if found.send(Input::PortsListed(files::ports())).is_ok() {
            let _ = waker.try_send(host::Input::Wake);
        }
    });
    console.serve(&mut screen)
}

struct Console {
    app: App,
    world: World,
    clock: Clock,
    inbox: Inbox,
    /// What the user does comes before anything else.
    keys: Receiver<TerminalEvent>,
    sender: SyncSender<host::Input>,
    /// Where threads put what they found out; they wake the loop behind it.
    answer: Sender<Input>,
    answers: Receiver<Input>,
    link: Option<Connection>,
    /// What has to come back should the link be lost, and when it is looked for again once it is.
    comeback: Option<Comeback>,
    retry: Option<Instant>,
    /// Where threads put what came of dialling a network link; they wake the loop behind it.
    dialling: Sender<DialResult>,
    dialled: Receiver<DialResult>,
    /// The last dial, by number: whatever an earlier one brings is not wanted any more.
    dial: u64,
    /// A recording that is being played.
    player: Option<Player>,
    /// By how much the console's time is ahead of the clock: a recording's time passes in no time.
    skew: Duration,
    recorder: Recorder,
    writer: Writer,
    /// Links opened so far.
    sessions: u32,
    /// The program is to be stopped as soon as the effects before that are done.
    suspends: bool,
    /// How the console ends once the unit has been left, where that is not the user's wish.
    over: Option<io::Result<End>>,
}

impl Console {
    fn new(
        app: App,
        world: World,
        clock: Clock,
        sender: SyncSender<host::Input>,
        inputs: Receiver<host::Input>,
        keys: Receiver<TerminalEvent>,
    ) -> Self {
        let (answer, answers) = channel();
        let (dialling, dialled) = channel();
        let (written, waker) = (answer.clone(), sender.clone());
        let writer = Writer::start(move |path, result| {
            if written.send(Input::FileWritten { path, result }).is_ok() {
                // A full channel wakes the loop by itself.
                let _ = waker.try_send(host::Input::Wake);
            }
        });
        Console {
            app,
            world,
            clock,
            inbox: Inbox::new(inputs),
            keys,
            sender,
            answer,
            answers,
            link: None,
            dialling,
            dialled,
            dial: 0,
            comeback: None,
            retry: None,
            player: None,
            skew: Duration::ZERO,
            recorder: Recorder::nothing(),
            writer,
            sessions: 0,
            suspends: false,
            over: None,
        }
    }

    /// The console's time: the clock's, or that of the recording that is played. Never runs backward.
    fn now(&self) -> Instant {
        self.player.as_ref().map_or_else(|| self.clock.now() + self.skew, Player::now)
    }

    /// Serves until the user leaves, a signal comes, or the terminal fails. The app then has the unit left in order,
    /// which takes a moment; nothing is drawn meanwhile, since the terminal may be gone.
    fn serve(&mut self, screen: &mut Screen) -> io::Result<End> {
        let mut next_frame = Instant::ZERO;
        let mut hurry = false;
        let effects = self.app.start();
        if self.perform(effects) {
            return Ok(End::Quit);
        }
        loop {
            // Of the clock, also while a recording has a time of its own.
            let now = self.clock.now();
            // What a key changes is seen at once: a frame early, which the next one pays for.
            let due = if hurry { Instant::ZERO + next_frame.since_start().saturating_sub(FRAME) } else { next_frame };
            if self.app.is_dirty() && now >= due {
                if self.over.is_none()
                    && let Err(error) = self.draw(screen)
                    && self.end(Err(error))
                {
                    return self.ended();
                }
                self.app.drawn();
                next_frame = next_frame.max(now) + FRAME;
                hurry = false;
            }
            // A stopped terminal keeps the drawing waiting, Ctrl-Z everything: what the unit has answered meanwhile goes
            // before what has become due meanwhile.
            self.inbox.collect();
            loop {
                let (leaves, more) = self.take_arrived();
                if leaves {
                    return self.ended();
                }
                if let Ok(event) = self.keys.try_recv() {
                    hurry = true;
                    if self.take_key(event, screen) {
                        return self.ended();
                    }
                }
                if !more {
                    break;
                }
            }
            let now = self.clock.now();
            // A flood of inputs must not keep a timer from expiring.
            if self.timer_at().is_some_and(|due| due <= now) && self.handle(Input::Timeout) {
                return self.ended();
            }
            if self.retry.is_some_and(|due| due <= now) {
                self.look_for_link();
            }
            self.play();
            if let Ok(event) = self.keys.try_recv() {
                hurry = true;
                if self.take_key(event, screen) {
                    return self.ended();
                }
                continue;
            }
            let due = self.app.is_dirty().then_some(due);
            let played = self.player.as_ref().and_then(|player| player.wake_at(now));
            let wake = [due, self.retry, played, self.timer_at()].into_iter().flatten().min();
            let wake = wake.unwrap_or(Instant::NEVER);
            // The channel cannot be closed, since this struct holds a sender.
            let Ok(Some(input)) = self.inbox.next(wake.since(self.clock.now()).min(LONGEST_WAIT)) else { continue };
            let leaves = match input {
                host::Input::Gone { error, .. } => {
                    let failure = (self.world.explain)(error);
                    self.lose_link(failure)
                }
                // Who stopped us, and whatever was drawn meanwhile: it is our terminal again.
                host::Input::Signal(number) if signal::continues(&number) => {
                    match screen.retake().and_then(|()| self.draw_anew(screen)) {
                        Ok(()) => false,
                        Err(error) => self.end(Err(error)),
                    }
                }
                host::Input::Signal(_) => self.end(Ok(End::Signal)),
                host::Input::Wake => {
                    let mut leaves = false;
                    while let Ok(answer) = self.answers.try_recv() {
                        leaves |= self.handle(answer);
                    }
                    while let Ok(result) = self.dialled.try_recv() {
                        leaves |= self.take_dialled(result);
                    }
                    leaves
                }
                host::Input::Bytes { .. } | host::Input::Typed(_) | host::Input::TypedEnd => false,
            };
            if leaves {
                return self.ended();
            }
        }
    }

    fn draw(&mut self, screen: &mut Screen) -> io::Result<()> {
        screen.terminal.draw(|frame| self.app.draw(frame))?;
        screen.set_mouse(self.app.wants_mouse())
    }

    /// Everything is drawn with the next frame, in the size that the terminal has now.
    fn draw_anew(&mut self, screen: &mut Screen) -> io::Result<()> {
        let size = screen.terminal.size()?;
        self.handle(Input::Terminal(TerminalEvent::Resize(size.width, size.height)));
        Ok(())
    }

    /// The console ends like this as soon as the app has left the unit. Gives `true` when it has.
    fn end(&mut self, end: io::Result<End>) -> bool {
        self.over.get_or_insert(end);
        self.handle(Input::Signal)
    }

    fn ended(&mut self) -> io::Result<End> {
        self.over.take().unwrap_or(Ok(End::Quit))
    }

    /// Tells the app of a key, or of whatever else the terminal says. Gives `true` when it is to end.
    fn take_key(&mut self, event: TerminalEvent, screen: &mut Screen) -> bool {
        self.handle(Input::Terminal(event))
            || (std::mem::take(&mut self.suspends)
                && screen.suspend().and_then(|()| self.draw_anew(screen)).is_err_and(|error| self.end(Err(error))))
    }

    /// Hands the app some of the bytes that have come. Gives whether it is to end, and whether there are more of them.
    fn take_arrived(&mut self) -> (bool, bool) {
        let (arrived, more) = self.inbox.part_of_arrived(PART);
        let leaves = self.hand_in(arrived, if more { Input::ArrivedSoFar } else { Input::Arrived });
        (leaves, more)
    }

    fn hand_in(&mut self, mut arrived: Vec<Arrived>, input: fn(Vec<Arrived>) -> Input) -> bool {
        if arrived.is_empty() {
            return false;
        }
        for piece in &mut arrived {
            piece.at += self.skew;
        }
        self.handle(input(arrived))
    }

    /// When the app's timer expires, by the clock. While a recording is played it expires in the recording's time.
    fn timer_at(&self) -> Option<Instant> {
        let due = self.app.poll_timeout().filter(|_| self.player.is_none())?;
        Some(Instant::ZERO + due.since_start().saturating_sub(self.skew))
    }

    /// Tells the app, and does what it wants. Gives `true` when that is to end.
    fn handle(&mut self, input: Input) -> bool {
        let effects = self.app.handle(self.now(), input);
        self.recorder.follow(self.app.record());
        let leaves = self.perform(effects);
        // Asked behind what was performed: a recording begins there.
        match self.recorder.take_warning() {
            Some(warning) => self.handle(Input::Unrecorded(warning)) || leaves,
            None => leaves,
        }
    }

    fn perform(&mut self, effects: Vec<Effect>) -> bool {
        let mut leaves = false;
        for effect in effects {
            match effect {
                Effect::OpenLink(name) => {
                    // One that is open stays until this one is, and one that was lost is looked for until then.
                    self.dial += 1;
                    match (self.world.resolve)(&name) {
                        Ok(spec) if spec.is_network() => self.dial(name, spec),
                        Ok(spec) => leaves |= self.open(&name, spec),
                        Err(failure) => leaves |= self.handle(Input::LinkFailed(failure)),
                    }
                }
                Effect::CloseLink => {
                    self.dial += 1;
                    self.close_link();
                }
                Effect::DoNotOpen => self.dial += 1,
                Effect::Transmit(transmit) => {
                    if let Some(link) = &self.link
                        && let Err(error) = link.send(transmit.bytes)
                    {
                        let text = format!("{}: {error}", link.port());
                        leaves |= self.lose_link(Failure { text, hints: Vec::new() });
                    }
                }
                Effect::ListPorts => self.ask(|| Input::PortsListed(files::ports())),
                Effect::ListFiles(directory) => self.ask(move || files::folder(&directory)),
                Effect::ListRecordings => {
                    let written = self.recorder.path().map(ToOwned::to_owned);
                    self.ask(move || Input::RecordingsListed(files::recordings(written)));
                }
                Effect::ReadFile(path) => self.ask(move || {
                    let text = files::text(&path);
                    Input::FileRead { path, text }
                }),
                Effect::ReadBytes(path) => self.ask(move || {
                    let bytes = files::bytes(&path, LARGEST_SENT);
                    Input::BytesRead { path, bytes }
                }),
                Effect::CreateFile { path, bytes } => self.writer.write(Piece::New(path, bytes)),
                Effect::AppendFile { path, bytes } => self.writer.write(Piece::More(path, bytes)),
                Effect::Mark(text) => self.recorder.mark(self.now(), &text),
                Effect::Play(playback) => self.steer(playback),
                Effect::Order(line) => leaves |= self.order(line),
                Effect::Break => {
                    let sent = match &self.link {
                        Some(link) => link.send_break().map_err(|error| error.to_string()),
                        None => Err("no link is open".to_owned()),
                    };
                    leaves |= self.handle(Input::BreakSent(sent));
                }
                Effect::CheckImage { path, loader, allow } => {
                    let check = self.world.check;
                    self.ask(move || {
                        if path.is_dir() {
                            return files::folder(&path);
                        }
                        match files::is_there(&path).and_then(|()| check(path.clone(), loader, &allow)) {
                            Ok(facts) => Input::ImageChecked(Box::new(facts)),
                            Err(why) => Input::ImageUnreadable { path, why },
                        }
                    });
                }
                Effect::UploadBegins { link, noted } => (self.world.note)(&link, Some(noted)),
                Effect::UploadEnds { link } => (self.world.note)(&link, None),
                Effect::Suspend => self.suspends = true,
                Effect::Quit => {
                    self.close_link();
                    leaves = true;
                }
            }
        }
        leaves
    }

    /// Plays what is due of a recording.
    fn play(&mut self) {
        for _ in 0..PIECES {
            let (clock, unreadable) = (self.clock.now(), self.world.unreadable);
            let Some(player) = &mut self.player else { return };
            let step = player.step(clock, unreadable);
            match step {
                Step::Nothing => return,
                Step::To(moment) => self.pass_time_to(moment),
                Step::Piece(moment, input) => {
                    self.pass_time_to(moment);
                    self.handle(input);
                }
                Step::Over(failure) => {
                    self.handle(Input::RecordingOver(failure));
                }
            }
            let Some(player) = &self.player else { return };
            self.handle(Input::Playing(player.playing()));
        }
    }

    /// Lets the recording's time pass, with the timers that expire meanwhile.
    fn pass_time_to(&mut self, moment: Instant) {
        while let Some(due) = self.app.poll_timeout().filter(|due| *due <= moment && *due > self.now()) {
            if let Some(player) = &mut self.player {
                player.set_now(due);
            }
            self.handle(Input::Timeout);
        }
        if let Some(player) = &mut self.player {
            player.set_now(moment);
        }
    }

    /// Plays the recording differently.
    fn steer(&mut self, playback: Playback) {
        let clock = self.clock.now();
        let Some(player) = &mut self.player else { return };
        if player.is_behind(playback) {
            match Recording::open(player.path()) {
                Ok(recording) => player.begin_again(recording),
                Err(error) => {
                    let failure = (self.world.unreadable)(error);
                    self.handle(Input::RecordingOver(Some(failure)));
                    return;
                }
            }
            let info = player.link_info(self.world.baud);
            self.handle(Input::PlayedAnew(info));
        }
        if let Some(player) = &mut self.player {
            player.steer(clock, playback);
            let playing = player.playing();
            self.handle(Input::Playing(playing));
        }
    }

    /// Has the emulated unit do something. Gives `true` when the console is to end.
    fn order(&mut self, line: String) -> bool {
        let (answer, sender) = (self.answer.clone(), self.sender.clone());
        let Some(link) = &self.link else {
            // It hung on its link.
            let gone = "the unit is gone with its link, C begins with a new one".to_owned();
            return self.handle(Input::Ordered { line, answer: Err(gone) });
        };
        let text = line.clone();
        link.order(&text, move |answered| {
            if answer.send(Input::Ordered { line, answer: answered }).is_ok() {
                // A full channel wakes the loop by itself.
                let _ = sender.try_send(host::Input::Wake);
            }
        });
        false
    }

    /// Finds something out in a thread, which wakes the loop when it has.
    fn ask(&self, find_out: impl FnOnce() -> Input + Send + 'static) {
        let (answer, sender) = (self.answer.clone(), self.sender.clone());
        in_thread("answer", move || {
            if answer.send(find_out()).is_ok() {
                // A full channel wakes the loop by itself.
                let _ = sender.try_send(host::Input::Wake);
            }
        });
    }
}

/// Does something in a thread of its own; where the system has none to give, it is done here, so that whoever waits for
/// what comes of it does not wait for ever.
fn in_thread(name: &str, work: impl FnOnce() + Send + 'static) {
    let work = Arc::new(Mutex::new(Some(work)));
    let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
    let shared = Arc::clone(&work);
    let begun = thread::Builder::new().name(name.to_owned()).spawn(move || {
        if let Some(work) = take(&shared) {
            work();
        }
    });
    if begun.is_err()
        && let Some(work) = take(&work)
    {
        work();
    }
}
