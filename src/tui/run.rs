//! The loop around [`App`]: the one file of the console that touches the system.
//!
//! Everything that happens comes on one channel; the app is told, its effects are performed in their order, and the
//! picture is drawn when something has changed: at once after a key, else at most a frame apart. Nothing wakes the
//! loop without an input or a due timer. Files, ports and folders are looked at in threads of their own, and a network
//! link is dialled in one, so that a slow disk or a silent host does not hold the keys.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel};
use std::thread;

use ratatui::crossterm::event::{Event as TerminalEvent, KeyCode, KeyModifiers};

use super::{App, Effect, Failure, FileEntry, FileKind, ImageFacts, Input, LinkInfo, Options, PortEntry};
use crate::host;
use crate::host::clock::Clock;
use crate::host::comeback::Comeback;
use crate::host::link::{self, Connection, LinkError, LinkSpec};
use crate::host::ports;
use crate::host::recorder::{Plan, Recorder};
use crate::host::replay::{Recording, RecordingError};
use crate::host::signal::Signals;
use crate::host::socket::Dialled;
use crate::host::terminal::{self, Screen};
use crate::record::{Direction, Ending, Piece};
use crate::time::{Duration, Instant};

/// Least time between two pictures that no key asked for: thirty a second.
const FRAME: Duration = Duration::from_millis(33);
/// Longest wait: bounds the arithmetic, nothing else.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);
/// Entries of a folder that are shown at most.
const MOST_ENTRIES: usize = 10_000;

/// What the loop cannot know itself: how the command line names links, and what helps when they fail.
pub struct World {
    /// The link to open at once.
    pub link: Option<String>,
    /// Line rate.
    pub baud: u32,
    /// Where sessions are recorded.
    pub recording: Plan,
    /// Whether to use colours.
    pub colour: bool,
    /// Opens a link by its name.
    pub open: fn(&str, u32, Clock, SyncSender<host::Input>) -> Result<Connection, Failure>,
    /// Says what a lost link means.
    pub explain: fn(LinkError) -> Failure,
    /// Says why a recording cannot be read.
    pub unreadable: fn(RecordingError) -> Failure,
    /// Reads and checks an image file.
    pub check: fn(PathBuf) -> ImageFacts,
    /// Notes that an upload of this product begins on this link, or (`None`) that the unit on it runs.
    pub note: fn(&str, Option<(&str, &str)>),
}

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
    let _signals = Signals::start(sender.clone())?;
    terminal::listen(sender.clone())?;
    let size = screen.terminal.size()?;
    let app = App::new(Options {
        link: world.link.clone(),
        directory: std::env::current_dir().unwrap_or_else(|_| PathBuf::from(".")),
        colour: world.colour,
        size: (size.width, size.height),
    });
    let (answer, answers) = channel();
    let (dialling, dialled) = channel();
    let mut console = Console {
        app,
        world,
        clock,
        inputs,
        sender,
        answer,
        answers,
        link: None,
        dialling,
        dialled,
        dial: 0,
        comeback: None,
        retry: None,
        replay: None,
        skew: Duration::ZERO,
        recorder: Recorder::nothing(),
        left: VecDeque::new(),
    };
    console.serve(&mut screen)
}

/// Which dial, of what, and what came of it.
type DialResult = (u64, String, LinkSpec, Result<Dialled, LinkError>);

struct Console {
    app: App,
    world: World,
    clock: Clock,
    inputs: Receiver<host::Input>,
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
    replay: Option<Replay>,
    /// By how much the console's time is ahead of the clock: recordings pass faster than they were made.
    skew: Duration,
    recorder: Recorder,
    /// Inputs taken from the channel while a link was closed.
    left: VecDeque<host::Input>,
}

/// A recording that is being played.
struct Replay {
    recording: Recording,
    begun: Instant,
}

/// Pieces of a recording between two looks at the keyboard.
const PIECES: usize = 64;

impl Console {
    /// The console's time. Never runs backward.
    fn now(&self) -> Instant {
        self.clock.now() + self.skew
    }

    fn serve(&mut self, screen: &mut Screen) -> io::Result<End> {
        let mut next_frame = Instant::ZERO;
        let effects = self.app.start();
        if self.perform(effects) {
            return Ok(End::Quit);
        }
        loop {
            let now = self.now();
            if self.app.is_dirty() && now >= next_frame {
                screen.terminal.draw(|frame| self.app.draw(frame))?;
                self.app.drawn();
                next_frame = now + FRAME;
            }
            // A flood of inputs must not keep a timer from expiring.
            if self.app.poll_timeout().is_some_and(|due| due <= now) && self.handle(Input::Timeout) {
                return Ok(End::Quit);
            }
            if self.retry.is_some_and(|due| due <= now) {
                self.look_for_link();
            }
            if self.replay.is_some() {
                self.play();
            }
            let due = self.app.is_dirty().then_some(next_frame);
            let at_once = self.replay.as_ref().map(|_| now);
            let wake = [due, self.retry, at_once, self.app.poll_timeout()].into_iter().flatten().min();
            let wake = wake.unwrap_or(Instant::NEVER);
            let Some(input) = self.next_input(wake) else { continue };
            let leaves = match input {
                host::Input::Terminal(event) => {
                    // What a key changes is seen at once.
                    next_frame = Instant::ZERO;
                    if is_suspend(&event) && !self.app.passes_keys() {
                        suspend(screen)?;
                        false
                    } else {
                        self.handle(Input::Terminal(event))
                    }
                }
                host::Input::Bytes { bytes, .. } => self.handle(Input::Bytes(bytes)),
                host::Input::Gone(error) => {
                    let failure = (self.world.explain)(error);
                    self.lose_link(failure)
                }
                host::Input::Signal(_) => {
                    self.handle(Input::Signal);
                    return Ok(End::Signal);
                }
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
                host::Input::Typed(_) | host::Input::TypedEnd => false,
            };
            if leaves {
                return Ok(End::Quit);
            }
        }
    }

    /// The next input; `None` when it is time.
    fn next_input(&mut self, wake: Instant) -> Option<host::Input> {
        if let Some(input) = self.left.pop_front() {
            return Some(input);
        }
        // An error is the time that is over: the channel cannot be closed, since this struct holds a sender.
        self.inputs.recv_timeout(wake.since(self.now()).min(LONGEST_WAIT)).ok()
    }

    /// Tells the app, and does what it wants. Gives `true` when that is to end.
    fn handle(&mut self, input: Input) -> bool {
        let effects = self.app.handle(self.now(), input);
        self.recorder.follow(self.app.record());
        self.perform(effects)
    }

    fn perform(&mut self, effects: Vec<Effect>) -> bool {
        let mut leaves = false;
        for effect in effects {
            match effect {
                Effect::OpenLink(name) => {
                    self.close_link();
                    match name.parse::<LinkSpec>() {
                        Ok(spec) if spec.is_network() => self.dial(name, spec),
                        Ok(_) | Err(_) => {
                            let opened = self.open(&name);
                            leaves |= self.handle(opened);
                        }
                    }
                }
                Effect::CloseLink => self.close_link(),
                Effect::Transmit(transmit) => {
                    if let Some(link) = &self.link
                        && let Err(error) = link.send(transmit.bytes)
                    {
                        let text = format!("{}: {error}", link.port());
                        leaves |= self.lose_link(Failure { text, hints: Vec::new() });
                    }
                }
                Effect::ListPorts => self.ask(|| Input::PortsListed(list_ports())),
                Effect::ListFiles(directory) => self.ask(move || list_files(&directory)),
                Effect::CheckImage(path) => {
                    let check = self.world.check;
                    self.ask(move || Input::ImageChecked(Box::new(check(path))));
                }
                Effect::UploadBegins { link, product, image } => (self.world.note)(&link, Some((&product, &image))),
                Effect::UploadEnds { link } => (self.world.note)(&link, None),
                Effect::Quit => {
                    self.close_link();
                    leaves = true;
                }
            }
        }
        leaves
    }

    fn open(&mut self, name: &str) -> Input {
        let spec = name.parse::<LinkSpec>();
        if let Ok(LinkSpec::Replay(path)) = &spec {
            return match Recording::open(path) {
                Ok(recording) => self.begin_replay(name, recording),
                Err(error) => Input::LinkFailed((self.world.unreadable)(error)),
            };
        }
        match (self.world.open)(name, self.world.baud, self.clock, self.sender.clone()) {
            Ok(connection) => self.begin(name, connection, spec.ok()),
            Err(failure) => Input::LinkFailed(failure),
        }
    }

    /// Begins to dial a network link, in a thread: a host that is switched off answers nothing for seconds.
    fn dial(&mut self, name: String, spec: LinkSpec) {
        let (dial, clock, options) = (self.dial, self.clock, link::Options { baud: self.world.baud });
        let (dialling, sender) = (self.dialling.clone(), self.sender.clone());
        let begun = thread::Builder::new().name("dial".into()).spawn(move || {
            let result = Connection::dial(&spec, options, clock);
            if dialling.send((dial, name, spec, result)).is_ok() {
                let _ = sender.send(host::Input::Wake);
            }
        });
        debug_assert!(begun.is_ok());
    }

    /// Takes what came of dialling, unless the user has gone on to something else. Gives `true` when it is to end.
    fn take_dialled(&mut self, (dial, name, spec, result): DialResult) -> bool {
        if dial != self.dial {
            return false;
        }
        let options = link::Options { baud: self.world.baud };
        let connection =
            result.and_then(|dialled| Connection::over(&spec, dialled, options, self.clock, self.sender.clone()));
        let input = match connection {
            Ok(connection) => self.begin(&name, connection, Some(spec)),
            Err(error) => Input::LinkFailed((self.world.explain)(error)),
        };
        self.handle(input)
    }

    /// Takes over an open link and starts its recording.
    fn begin(&mut self, name: &str, connection: Connection, spec: Option<LinkSpec>) -> Input {
        self.recorder = Recorder::start(&self.world.recording, &connection, self.clock);
        let recording = self.recorder.path().map(|path| path.display().to_string());
        let recording = recording.or_else(|| self.recorder.take_warning());
        let options = link::Options { baud: self.world.baud };
        self.comeback = spec.and_then(|spec| Comeback::of(&spec, &connection, options));
        self.link = Some(connection);
        let start_of_day = host::clock::day_before(self.clock.time_of_day(), self.skew);
        Input::LinkOpened(LinkInfo {
            link: name.to_owned(),
            baud: self.world.baud,
            read_only: false,
            recording,
            start_of_day,
        })
    }

    fn begin_replay(&mut self, name: &str, recording: Recording) -> Input {
        let begun = self.now();
        let time_of_day = host::clock::time_of_day(recording.header().unix_millis);
        self.replay = Some(Replay { recording, begun });
        Input::LinkOpened(LinkInfo {
            link: name.to_owned(),
            baud: self.world.baud,
            read_only: true,
            recording: None,
            start_of_day: host::clock::day_before(time_of_day, begun.since_start()),
        })
    }

    /// Plays the next pieces of a recording: as fast as they can be read, each at its own time.
    fn play(&mut self) {
        for _ in 0..PIECES {
            let Some(replay) = &mut self.replay else { return };
            let begun = replay.begun;
            let input = match replay.recording.next() {
                Ok(Some(Piece::Header(_))) => continue,
                Ok(Some(Piece::Bytes { at, direction: Direction::FromUnit, bytes })) => (at, Input::Bytes(bytes)),
                Ok(Some(Piece::Bytes { at, direction: Direction::ToUnit, bytes })) => (at, Input::Sent(bytes)),
                Ok(Some(Piece::Mark { at, text })) => (at, Input::Mark(text)),
                Ok(None) => {
                    let cut = replay.recording.ending() == Some(Ending::CutShort);
                    let text = "The recording ends in the middle of a line: whoever wrote it was killed.".to_owned();
                    let failure = cut.then(|| Failure { text, hints: Vec::new() });
                    self.replay = None;
                    self.handle(Input::RecordingOver(failure));
                    return;
                }
                Err(error) => {
                    self.replay = None;
                    let failure = (self.world.unreadable)(error);
                    self.handle(Input::RecordingOver(Some(failure)));
                    return;
                }
            };
            let (at, input) = input;
            let then = begun + at.since_start();
            while let Some(due) = self.app.poll_timeout().filter(|due| *due <= then && *due > self.now()) {
                self.pass_time_to(due);
                self.handle(Input::Timeout);
            }
            self.pass_time_to(then);
            self.handle(input);
        }
    }

    fn pass_time_to(&mut self, then: Instant) {
        self.skew += then.since(self.now());
    }

    fn lose_link(&mut self, failure: Failure) -> bool {
        if self.link.is_none() {
            return false;
        }
        let recorder = std::mem::take(&mut self.recorder);
        let comeback = self.comeback.take();
        self.close_link();
        if comeback.is_some() {
            self.recorder = recorder;
            self.recorder.mark(self.now(), "link lost");
            self.retry = Some(self.now() + Comeback::RETRY);
        }
        self.comeback = comeback;
        self.handle(Input::LinkGone(failure))
    }

    /// Looks whether the lost link is there again.
    fn look_for_link(&mut self) {
        let Some(comeback) = &self.comeback else { return self.retry = None };
        let Some(connection) = comeback.open(self.clock, self.sender.clone()) else {
            self.retry = Some(self.now() + Comeback::RETRY);
            return;
        };
        self.retry = None;
        let name = connection.port().to_owned();
        self.recorder.mark(self.now(), &format!("link back as {name}"));
        self.link = Some(connection);
        self.handle(Input::LinkBack(name));
    }

    /// Closes the link; what it has put on the channel and nobody has taken is forgotten.
    fn close_link(&mut self) {
        self.dial += 1;
        self.replay = None;
        self.comeback = None;
        self.retry = None;
        if self.link.take().is_some() {
            let waiting = self
                .inputs
                .try_iter()
                .filter(|input| !matches!(input, host::Input::Bytes { .. } | host::Input::Gone(_)));
            self.left.extend(waiting);
        }
        self.recorder = Recorder::nothing();
    }

    /// Finds something out in a thread, which wakes the loop when it has.
    fn ask(&self, find_out: impl FnOnce() -> Input + Send + 'static) {
        let (answer, sender) = (self.answer.clone(), self.sender.clone());
        let begun = thread::Builder::new().name("answer".into()).spawn(move || {
            if answer.send(find_out()).is_ok() {
                let _ = sender.send(host::Input::Wake);
            }
        });
        // Without threads there is no program either: the key thread came first.
        debug_assert!(begun.is_ok());
    }
}

/// Ctrl-Z, as every program of a shell understands it.
fn is_suspend(event: &TerminalEvent) -> bool {
    matches!(event, TerminalEvent::Key(key) if key.code == KeyCode::Char('z') && key.modifiers == KeyModifiers::CONTROL)
}

#[cfg(unix)]
fn suspend(screen: &mut Screen) -> io::Result<()> {
    screen.suspend()
}

#[cfg(not(unix))]
fn suspend(_screen: &mut Screen) -> io::Result<()> {
    Ok(())
}

fn list_ports() -> Result<Vec<PortEntry>, String> {
    let ports = ports::list().map_err(|error| format!("the serial ports cannot be listed: {error}"))?;
    Ok(ports
        .into_iter()
        .map(|port| PortEntry {
            busy_by: ports::holder(Path::new(&port.path)).map(|holder| holder.to_string()),
            description: describe(&port),
            link: port.path,
        })
        .collect())
}

/// `USB, FTDI FT232R USB UART, 0403:6001, serial number AX12345, ftdi_sio`.
fn describe(port: &ports::Port) -> String {
    let mut parts = vec![match port.kind {
        ports::Kind::Usb => "USB".to_owned(),
        ports::Kind::Native => "built in".to_owned(),
        ports::Kind::Pty => "pseudo-terminal".to_owned(),
        ports::Kind::Bluetooth => "Bluetooth".to_owned(),
    }];
    if let Some(usb) = &port.usb {
        let words: Vec<&str> = [usb.manufacturer.as_deref(), usb.product.as_deref()].into_iter().flatten().collect();
        parts.extend((!words.is_empty()).then(|| words.join(" ")));
        parts.push(format!("{:04x}:{:04x}", usb.vid, usb.pid));
        parts.extend(usb.serial_number.as_ref().map(|number| format!("serial number {number}")));
    }
    parts.extend(port.driver.clone());
    parts.join(", ")
}

fn list_files(directory: &Path) -> Input {
    let directory = std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned());
    let entries = std::fs::read_dir(&directory).map_err(|error| error.to_string()).map(|entries| {
        entries
            .flatten()
            .take(MOST_ENTRIES)
            .filter_map(|entry| {
                // Behind a link, what it leads to.
                let metadata = std::fs::metadata(entry.path()).ok()?;
                let kind = if metadata.is_dir() { FileKind::Folder } else { FileKind::File };
                Some(FileEntry {
                    name: entry.file_name().to_string_lossy().into_owned(),
                    kind,
                    bytes: if kind == FileKind::File { metadata.len() } else { 0 },
                    modified: metadata.modified().ok().and_then(host::clock::local_date_and_time),
                })
            })
            .collect()
    });
    Input::FilesListed { directory, entries }
}
