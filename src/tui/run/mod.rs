//! The loop around [`App`]: the one folder of the console that touches the system.
//!
//! The app is told of everything that happens, its effects are performed in order, and the picture is drawn when
//! something has changed: at once after a key, otherwise at most once a frame. Nothing wakes the loop without an input or
//! a due timer. Files, ports and folders are read, network links dialled and recordings opened in threads of their own, and
//! files are written in one, so that a slow disk or a silent host does not hold up the keys.
//!
//! The loop itself waits for the disk in two places, where a disk that hangs holds up the keys too: it records each event
//! before that is shown, so that a killed program has recorded all it has shown; and it reads the recording that it plays,
//! whose next piece says what time it is.

mod answers;
mod connecting;
mod files;
mod player;
mod playing;
#[cfg(all(test, unix))]
mod tests;
mod writer;

use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender};

use ratatui::crossterm::event::Event as TerminalEvent;
use ratatui::layout::Size;

use answers::{Answers, Inquiry, OpenInquiry, PendingOrder, Reporter};
use player::Player;
use writer::{Piece, Writer};

use super::{App, Effect, Failure, ImageFacts, Input, Noted, Options, Palette};
use crate::device::LoaderKind;
use crate::endpoint::Arrived;
use crate::host;
use crate::host::Inbox;
use crate::host::clock::Clock;
use crate::host::comeback::Cable;
use crate::host::link::{Connection, LinkError, LinkSpec};
use crate::host::ports;
use crate::host::recorder::{Plan, Recorder};
use crate::host::replay::RecordingError;
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
/// How long the console waits at its end for files that are still being written, the terminal given back already.
const WRITING_PATIENCE: std::time::Duration = std::time::Duration::from_secs(5);
/// How long an upload waits for its note to be written, and a link for what is noted of it: far longer than a disk takes.
/// Without a note the next upload asks a question.
const NOTE_PATIENCE: std::time::Duration = std::time::Duration::from_millis(250);

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
    /// Says which files are incomplete, once the user has the terminal back.
    pub incomplete: fn(&[PathBuf]),
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
    // Before the screen is taken: a signal in between would leave the terminal raw.
    let signals = Signals::of_screen(sender.clone())?;
    let mut screen = Screen::enter()?;
    let keys = terminal::listen(sender.clone())?;
    let size = screen.terminal.size()?;
    let app = App::new(Options {
        link: world.link.clone(),
        directory: std::env::current_dir().unwrap_or_else(|_| PathBuf::from(".")),
        home: std::env::home_dir(),
        palette: world.palette,
        size: (size.width, size.height),
    });
    let incomplete = world.incomplete;
    let mut console = Console::new(app, world, clock, sender, inputs, keys)?;
    let reporter = console.reporter.clone();
    // Without a watch, R looks again.
    let _ = ports::watch(move || reporter.report(Input::PortsListed(files::ports())));
    let end = console.serve(&mut screen);
    let writer = console.into_writer();
    // A disk that hangs must not hold the user's terminal.
    drop(screen);
    // Nobody takes signals any more: they do what they do by default.
    drop(signals);
    let unwritten = writer.finish(WRITING_PATIENCE);
    if !unwritten.is_empty() {
        incomplete(&unwritten);
    }
    end
}

/// What the loop draws on.
trait Canvas {
    /// Columns and rows.
    fn size(&self) -> io::Result<Size>;
    /// Draws the picture.
    fn draw(&mut self, app: &App) -> io::Result<()>;
    /// Stops the program until its shell continues it.
    fn suspend(&mut self) -> io::Result<()>;
    /// Takes the terminal again after somebody else has stopped and continued the program.
    fn retake(&mut self) -> io::Result<()>;
}

impl Canvas for Screen {
    fn size(&self) -> io::Result<Size> {
        self.terminal.size()
    }

    fn draw(&mut self, app: &App) -> io::Result<()> {
        self.terminal.draw(|frame| app.draw(frame))?;
        self.set_mouse(app.wants_mouse())
    }

    fn suspend(&mut self) -> io::Result<()> {
        Screen::suspend(self)
    }

    fn retake(&mut self) -> io::Result<()> {
        Screen::retake(self)
    }
}

/// When the next picture may be drawn.
#[derive(Debug)]
struct Pace {
    next: Instant,
    /// What a key changes is seen at once: a frame early, which the next one pays for.
    hurries: bool,
}

impl Pace {
    fn due(&self) -> Instant {
        let early = if self.hurries { FRAME } else { Duration::ZERO };
        Instant::ZERO + self.next.since_start().saturating_sub(early)
    }

    fn drawn(&mut self, now: Instant) {
        *self = Pace { next: self.next.max(now) + FRAME, hurries: false };
    }
}

struct Console {
    app: App,
    world: World,
    clock: Clock,
    inbox: Inbox,
    /// What the user does comes before anything else.
    keys: Receiver<TerminalEvent>,
    sender: SyncSender<host::Input>,
    /// The way for threads to say what they have found out.
    reporter: Reporter,
    answers: Answers,
    /// What threads are finding out; none of it twice.
    inquiries: Vec<OpenInquiry>,
    /// Orders to the emulated unit that it has not answered yet, oldest first.
    orders: VecDeque<PendingOrder>,
    /// The link, which may be lost and come back.
    cable: Option<Cable>,
    /// The last link that was asked for, by number: whatever an earlier one brings is no longer wanted.
    dial: u64,
    /// A recording that is being played.
    player: Option<Player>,
    /// By how much the console's time is ahead of the clock: a recording's time passes in no time.
    skew: Duration,
    recorder: Recorder,
    writer: Writer,
    /// Links opened so far.
    sessions: u32,
    pace: Pace,
    /// The program is to be stopped as soon as the effects before that are done.
    suspends: bool,
    /// How the console ends once the unit has been left, where that is not the user's wish.
    over: Option<io::Result<End>>,
    /// The app has left the unit: nothing is done any more.
    quits: bool,
}

impl Console {
    fn new(
        app: App,
        world: World,
        clock: Clock,
        sender: SyncSender<host::Input>,
        inputs: Receiver<host::Input>,
        keys: Receiver<TerminalEvent>,
    ) -> io::Result<Self> {
        let (reporter, answers) = answers::channel(sender.clone());
        let written = reporter.clone();
        let writer = Writer::start(move |path, result| written.report(Input::FileWritten { path, result }))?;
        Ok(Console {
            app,
            world,
            clock,
            inbox: Inbox::new(inputs),
            keys,
            sender,
            reporter,
            answers,
            inquiries: Vec::new(),
            orders: VecDeque::new(),
            cable: None,
            dial: 0,
            player: None,
            skew: Duration::ZERO,
            recorder: Recorder::nothing(),
            writer,
            sessions: 0,
            pace: Pace { next: Instant::ZERO, hurries: false },
            suspends: false,
            over: None,
            quits: false,
        })
    }

    /// What is left to be written. Everything else ends here, so that no thread waits for the loop any more.
    fn into_writer(self) -> Writer {
        self.writer
    }

    /// The console's time: the clock's, or that of the recording being played. Never runs backward.
    fn now(&self) -> Instant {
        self.player.as_ref().map_or_else(|| self.clock.now() + self.skew, Player::now)
    }

    /// Serves until the user leaves, a signal comes, or the terminal fails. The app then leaves the unit in order, which
    /// takes a moment; nothing is drawn meanwhile where the terminal may be gone.
    fn serve(&mut self, canvas: &mut impl Canvas) -> io::Result<End> {
        let effects = self.app.start();
        self.perform(effects);
        while !self.quits {
            self.turn(canvas);
        }
        self.over.take().unwrap_or(Ok(End::Quit))
    }

    /// Does all there is to do, then waits for something to happen.
    fn turn(&mut self, canvas: &mut impl Canvas) {
        self.draw_if_due(canvas);
        self.take_bytes_and_keys(canvas);
        self.let_time_pass();
        // Looked at last: what comes from here on also ends the wait, unless the channel is full, and then there is none.
        let is_idle = !self.take_key(canvas) && !self.take_answers();
        if is_idle && !self.quits {
            self.wait_for_input(canvas);
        }
    }

    fn draw_if_due(&mut self, canvas: &mut impl Canvas) {
        // The clock's time, also while a recording has a time of its own.
        let now = self.clock.now();
        if !self.app.is_dirty() || now < self.pace.due() {
            return;
        }
        if self.over.is_none()
            && let Err(error) = canvas.draw(&self.app)
        {
            self.end(Err(error));
        }
        self.app.drawn();
        self.pace.drawn(now);
    }

    /// A stopped terminal holds up the drawing, Ctrl-Z everything: what the unit has answered meanwhile goes before what
    /// has become due meanwhile.
    fn take_bytes_and_keys(&mut self, canvas: &mut impl Canvas) {
        self.inbox.collect();
        while self.take_arrived() {
            self.take_key(canvas);
        }
    }

    /// A flood of inputs must not keep a timer from expiring.
    fn let_time_pass(&mut self) {
        let now = self.clock.now();
        if self.timer_at().is_some_and(|due| due <= now) {
            self.handle(Input::Timeout);
        }
        self.look_for_link(now);
        self.play();
    }

    fn wait_for_input(&mut self, canvas: &mut impl Canvas) {
        let now = self.clock.now();
        let picture = self.app.is_dirty().then(|| self.pace.due());
        let played = self.player.as_ref().and_then(|player| player.wake_at(now));
        let retry = self.cable.as_ref().and_then(Cable::retry_at);
        let wake = [picture, retry, played, self.timer_at()].into_iter().flatten().min();
        let patience = wake.unwrap_or(Instant::NEVER).since(now).min(LONGEST_WAIT);
        // The channel cannot be closed, since this struct holds a sender.
        let Ok(Some(input)) = self.inbox.next(patience) else { return };
        match input {
            host::Input::Gone { error, .. } => {
                let failure = (self.world.explain)(error);
                self.lose_link(failure);
            }
            // Whatever stopped us, and whatever was drawn meanwhile: it is our terminal again.
            host::Input::Signal(number) if signal::continues(&number) => {
                if let Err(error) = canvas.retake().and_then(|()| self.redraw(canvas)) {
                    self.end(Err(error));
                }
            }
            host::Input::Signal(_) => self.end(Ok(End::Signal)),
            // What the wake-up is for is looked at in every turn.
            host::Input::Wake | host::Input::Bytes { .. } | host::Input::Typed(_) | host::Input::TypedEnd => {}
        }
    }

    /// Everything is drawn with the next frame, in the size that the terminal has now.
    fn redraw(&mut self, canvas: &impl Canvas) -> io::Result<()> {
        let size = canvas.size()?;
        self.handle(Input::Terminal(TerminalEvent::Resize(size.width, size.height)));
        Ok(())
    }

    /// The console ends like this as soon as the app has left the unit.
    fn end(&mut self, end: io::Result<End>) {
        self.over.get_or_insert(end);
        self.handle(Input::Signal);
    }

    /// Tells the app of a key, or of whatever else the terminal says, if there is anything.
    fn take_key(&mut self, canvas: &mut impl Canvas) -> bool {
        let Ok(event) = self.keys.try_recv() else { return false };
        self.pace.hurries = true;
        self.handle(Input::Terminal(event));
        if std::mem::take(&mut self.suspends)
            && let Err(error) = canvas.suspend().and_then(|()| self.redraw(canvas))
        {
            self.end(Err(error));
        }
        true
    }

    /// Hands the app some of the bytes that have come, and says whether there are more.
    fn take_arrived(&mut self) -> bool {
        let (arrived, more) = self.inbox.part_of_arrived(PART);
        self.hand_in(arrived, if more { Input::ArrivedSoFar } else { Input::Arrived });
        more
    }

    fn hand_in(&mut self, mut arrived: Vec<Arrived>, input: fn(Vec<Arrived>) -> Input) {
        if arrived.is_empty() {
            return;
        }
        for piece in &mut arrived {
            piece.at += self.skew;
        }
        self.handle(input(arrived));
    }

    /// When the app's timer expires, by the clock. While a recording is played it expires in the recording's time.
    fn timer_at(&self) -> Option<Instant> {
        let due = self.app.poll_timeout().filter(|_| self.player.is_none())?;
        Some(Instant::ZERO + due.since_start().saturating_sub(self.skew))
    }

    /// Tells the app, and does what it wants.
    fn handle(&mut self, input: Input) {
        if self.quits {
            return;
        }
        let effects = self.app.handle(self.now(), input);
        self.recorder.follow(self.app.record());
        self.perform(effects);
        // Asked after the effects are performed: a recording begins with one.
        if let Some(warning) = self.recorder.take_warning() {
            self.handle(Input::Unrecorded(warning));
        }
    }

    fn perform(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            self.perform_one(effect);
            if self.quits {
                return;
            }
        }
    }

    fn perform_one(&mut self, effect: Effect) {
        match effect {
            Effect::OpenLink(name) => {
                // One that is open stays until this one is, and one that was lost is looked for until then.
                self.dial += 1;
                match (self.world.resolve)(&name) {
                    Ok(spec) if spec.is_network() => self.dial(name, spec),
                    Ok(spec) => self.open(&name, spec),
                    Err(failure) => self.handle(Input::LinkFailed(failure)),
                }
            }
            Effect::CloseLink => {
                self.dial += 1;
                self.close_link();
            }
            Effect::DoNotOpen => self.dial += 1,
            Effect::Transmit(transmit) => {
                if let Some(link) = self.connection()
                    && let Err(error) = link.send(transmit.bytes)
                {
                    let text = format!("{}: {error}", link.port());
                    self.lose_link(Failure { text, hints: Vec::new() });
                }
            }
            Effect::ListPorts => self.ask(Inquiry::Ports),
            Effect::ListFiles(directory) => self.ask(Inquiry::Folder(directory)),
            Effect::ListRecordings => self.ask(Inquiry::Recordings),
            Effect::ReadFile(path) => self.ask(Inquiry::Text(path)),
            Effect::ReadBytes(path) => self.ask(Inquiry::Bytes(path)),
            Effect::CheckImage { path, loader, allow } => self.ask(Inquiry::Image { path, loader, allow }),
            Effect::CreateFile { path, bytes } => self.write(Piece::New(path, bytes)),
            Effect::AppendFile { path, bytes } => self.write(Piece::More(path, bytes)),
            Effect::Mark(text) => self.recorder.mark(self.now(), &text),
            Effect::Play(playback) => self.steer(playback),
            Effect::Order(line) => self.order(line),
            Effect::Break => {
                let sent = match self.connection() {
                    Some(link) => link.send_break().map_err(|error| error.to_string()),
                    None => Err("no link is open".to_owned()),
                };
                self.handle(Input::BreakSent(sent));
            }
            Effect::UploadBegins { link, noted } => {
                let note = self.world.note;
                // Noted before the first byte leaves, unless the journal keeps everybody waiting.
                self.writer.run(move || note(&link, Some(noted))).wait(NOTE_PATIENCE);
            }
            Effect::UploadEnds { link } => {
                let note = self.world.note;
                self.writer.run(move || note(&link, None));
            }
            Effect::Suspend => self.suspends = true,
            Effect::Quit => {
                self.close_link();
                self.quits = true;
            }
        }
    }

    fn write(&mut self, piece: Piece) {
        if let Err(path) = self.writer.write(piece) {
            let result = Err("the disk is too slow".to_owned());
            self.handle(Input::FileWritten { path, result });
        }
    }
}
