//! The console: keys, bytes and time in; a picture, effects and a deadline out.
//!
//! One way through: an input changes the session or a screen, the session's news are folded into the view, what it
//! wants sent becomes effects, and the picture is drawn from the view when the loop around finds it worth drawing.

use std::path::{Path, PathBuf};

use ratatui::Frame;
use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use ratatui::layout::Rect;

use super::action::Action;
use super::frame;
use super::input::{Effect, Failure, Input, LinkInfo, Noted};
use super::keymap::{self, Cmd, EVERYWHERE, MENU, MenuCmd};
use super::popup::{self, Answer, Popup, Question};
use super::screens::bench::{self, Bench};
use super::screens::connect::Connect;
use super::screens::diagnostics::Diagnostics;
use super::screens::dictionary::Dictionary;
use super::screens::help::Help;
use super::screens::load::Load;
use super::screens::overview::Overview;
use super::screens::recordings::Recordings;
use super::screens::stream::Stream;
use super::screens::terminal::{Meaning, Terminal};
use super::screens::{Scene, ScreenId};
use super::theme::{Palette, Theme};
use super::view::{Export, Link, LinkState, Tone, View};
use super::widgets::{format, lines};
use crate::dump::{self, Dump};
use crate::endpoint::Endpoint;
use crate::monitor::Scrollback;
use crate::record::Record;
use crate::session::{Command, Event, Facts, Job, LoadOrder, Outcome, Session, UnitNow};
use crate::time::{Duration, Instant};
use crate::wire::stream::Row;

/// How often the picture moves while an upload runs, so that its times go on when the unit is silent.
const UPLOAD_TICK: Duration = Duration::from_millis(500);
/// How long a unit has to answer what puts it in order before its link is closed: it prints a menu in a tenth of that,
/// and whoever leaves, or shuts the computer down, does not wait longer for a unit that is silent.
const WINDING_UP: Duration = Duration::from_secs(2);

/// What the console is started with.
#[derive(Clone, Debug)]
pub struct Options {
    /// The link to open at once; without one the list of ports is shown.
    pub link: Option<String>,
    /// Where the file picker starts.
    pub directory: PathBuf,
    /// Which colours to begin with (`NO_COLOR`, `AXCON_THEME`).
    pub palette: Palette,
    /// Columns and rows of the terminal at the start.
    pub size: (u16, u16),
}

/// The console.
pub struct App {
    options: Options,
    theme: Theme,
    size: (u16, u16),
    /// Local time of day at [`Instant::ZERO`], as the link has it.
    start_of_day: Duration,
    now: Instant,
    dirty: bool,
    session: Option<Session>,
    /// What is drawn from before there is a session.
    no_record: Record,
    no_facts: Facts,
    view: View,
    scrollback: Scrollback,
    front: ScreenId,
    popup: Option<Popup>,
    /// The link is about to be closed: what comes then, and until when the unit has time.
    leaving: Option<(Next, Instant)>,
    help: Option<Help>,
    connect: Connect,
    overview: Overview,
    terminal: Terminal,
    load: Load,
    dictionary: Dictionary,
    stream: Stream,
    diagnostics: Diagnostics,
    recordings: Recordings,
    bench: Bench,
}

/// What comes once the unit has been left in order.
#[derive(Debug)]
enum Next {
    /// The program ends.
    Quit,
    /// The link is closed.
    Disconnect,
    /// Another link is opened.
    Open(String),
}

impl App {
    /// A console that has seen nothing yet. [`App::start`] comes next.
    pub fn new(options: Options) -> Self {
        App {
            theme: Theme::new(options.palette),
            size: options.size,
            start_of_day: Duration::ZERO,
            now: Instant::ZERO,
            dirty: true,
            session: None,
            no_record: Record::new(),
            no_facts: Facts::default(),
            view: View::default(),
            scrollback: Scrollback::default(),
            front: ScreenId::Connect,
            popup: None,
            leaving: None,
            help: None,
            connect: Connect::default(),
            overview: Overview::default(),
            terminal: Terminal::default(),
            load: Load::new(options.directory.clone()),
            dictionary: Dictionary::default(),
            stream: Stream::default(),
            diagnostics: Diagnostics::default(),
            recordings: Recordings::default(),
            bench: Bench::default(),
            options,
        }
    }

    /// The first effects: the ports are listed, the given link is opened.
    pub fn start(&mut self) -> Vec<Effect> {
        let mut effects = vec![Effect::ListPorts, Effect::ListRecordings];
        if let Some(link) = self.options.link.clone() {
            self.perform(Action::Open(link), &mut effects);
        }
        effects
    }

    /// Takes one input; the effects are to be performed in their order.
    pub fn handle(&mut self, now: Instant, input: Input) -> Vec<Effect> {
        self.now = self.now.max(now);
        let mut effects = Vec::new();
        match input {
            Input::Terminal(event) => self.terminal_event(event, &mut effects),
            Input::Bytes(bytes) => {
                if let (LinkState::Open { .. }, Some(session)) = (&self.view.link.state, &mut self.session) {
                    session.handle_bytes(now, &bytes);
                }
            }
            Input::Timeout => self.timeout(now),
            Input::PortsListed(ports) => {
                self.connect.listed(ports);
                self.dirty = true;
            }
            Input::LinkOpened(info) => self.link_opened(now, info, &mut effects),
            Input::LinkFailed(failure) => self.link_failed(failure),
            Input::LinkGone(failure) => self.link_gone(now, failure),
            Input::LinkBack(name) => self.link_back(now, &name),
            Input::Sent(bytes) => {
                if let Some(session) = &mut self.session {
                    session.handle_sent(now, &bytes);
                }
            }
            Input::Mark(text) => self.scrollback.note(now, super::visible::text(&text)),
            Input::Unrecorded(why) => self.unrecorded(now, why),
            Input::RecordingOver(failure) => self.recording_over(now, failure),
            Input::FilesListed { directory, entries } => {
                self.load.listed(directory, entries);
                self.dirty = true;
            }
            Input::ImageChecked(facts) => {
                self.load.checked(facts);
                self.dirty = true;
            }
            Input::FileWritten { path, result } => self.file_written(&path, result),
            Input::FileRead { path, text } => self.file_read(&path, text),
            Input::RecordingsListed(found) => {
                self.recordings.listed(found);
                self.connect.recorded(self.recordings.entries());
                self.dirty = true;
            }
            Input::Playing(playing) => {
                self.dirty |= self.view.playing != Some(playing);
                self.view.playing = Some(playing);
            }
            Input::PlayedAnew(info) => self.played_anew(now, info),
            Input::Ordered { line, answer } => {
                self.bench.answered(&line, answer);
                self.dirty = true;
            }
            Input::BreakSent(result) => self.break_sent(now, result, &mut effects),
            Input::Signal => self.leave(Next::Quit, &mut effects),
        }
        self.drain(&mut effects);
        self.go_on_leaving(&mut effects);
        effects
    }

    /// Whether keys go to the unit as they are, so that none may mean something outside.
    pub fn passes_keys(&self) -> bool {
        self.front == ScreenId::Terminal && self.popup.is_none() && self.help.is_none()
    }

    /// When [`Input::Timeout`] is wanted next. `None`: only an input from outside can bring anything new.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let is_open = matches!(self.view.link.state, LinkState::Open { .. });
        let session = self.session.as_ref().and_then(Session::poll_timeout);
        let tick = (self.view.job == Some(Job::Load)).then(|| self.now + UPLOAD_TICK);
        let late = self.view.poll_timeout().filter(|_| is_open);
        let leaving = self.leaving.as_ref().map(|(_, until)| *until);
        [session, tick, late, leaving].into_iter().flatten().min()
    }

    /// Whether the picture has changed since it was last drawn.
    pub fn is_dirty(&self) -> bool {
        self.dirty
    }

    /// Says that the picture has been drawn.
    pub fn drawn(&mut self) {
        self.dirty = false;
    }

    /// Folds one event of the session into what the screens show; `facts` are the session's at that moment.
    pub fn fold(&mut self, now: Instant, event: &Event, facts: &Facts) {
        self.now = self.now.max(now);
        self.view.fold(now, event, facts);
        // A raw line alone changes the terminal, and whatever else shows it.
        self.dirty = true;
    }

    /// Shows what went over the line.
    pub fn follow(&mut self, record: &Record) {
        self.dirty |= self.scrollback.follow(record);
    }

    /// Every byte of the connection, secrets already out of it: what a recording follows after each input.
    pub fn record(&self) -> &Record {
        self.session.as_ref().map_or(&self.no_record, Session::record)
    }

    /// Draws the picture.
    pub fn draw(&self, frame: &mut Frame) {
        if frame::too_small(frame) {
            return;
        }
        let area = frame.area();
        let columns = usize::from(area.width);
        let row = |y: u16| Rect { y, height: 1, ..area };
        let front = self.help.is_none().then_some(self.front);
        let theme = self.theme;
        lines::draw(frame, row(0), [frame::header(&self.view, theme, columns)]);
        lines::draw(frame, row(1), [frame::tabs(&self.view, front, theme, columns)]);
        let lost = frame::lost(&self.view, theme, columns);
        let (banner, body) = lines::split(frame::body(area), lost.len() as u16);
        lines::draw(frame, banner, lost);
        self.draw_screen(body, frame);
        lines::draw(frame, row(area.height - 3), [frame::notice(&self.view, theme, columns)]);
        lines::draw(frame, row(area.height - 2), [frame::menu(theme)]);
        let keys = match self.front {
            _ if self.help.is_some() => frame::help_keys(theme),
            ScreenId::Terminal => frame::terminal_keys(theme, self.front.bindings(), self.terminal.is_after_prefix()),
            ScreenId::Load => frame::keys(theme, self.load.footer(&self.view)),
            ScreenId::Connect
            | ScreenId::Overview
            | ScreenId::Dictionary
            | ScreenId::Stream
            | ScreenId::Diagnostics
            | ScreenId::Recordings
            | ScreenId::Bench => frame::keys(theme, self.front.bindings()),
        };
        lines::draw(frame, row(area.height - 1), [keys]);
        if let Some(popup) = &self.popup {
            popup::draw(popup, &self.view, theme, frame::body(area), frame);
        }
    }

    fn draw_screen(&self, area: Rect, frame: &mut Frame) {
        if let Some(help) = &self.help {
            return help.draw(self.theme, self.front, area, frame);
        }
        let scene = self.scene();
        match self.front {
            ScreenId::Connect => self.connect.draw(scene, area, frame),
            ScreenId::Overview => self.overview.draw(scene, area, frame),
            ScreenId::Terminal => self.terminal.draw(scene, area, frame),
            ScreenId::Load => self.load.draw(scene, area, frame),
            ScreenId::Dictionary => self.dictionary.draw(scene, area, frame),
            ScreenId::Stream => self.stream.draw(scene, area, frame),
            ScreenId::Diagnostics => self.diagnostics.draw(scene, area, frame),
            ScreenId::Recordings => self.recordings.draw(scene, area, frame),
            ScreenId::Bench => self.bench.draw(scene, area, frame),
        }
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            view: &self.view,
            record: self.record(),
            scrollback: &self.scrollback,
            theme: self.theme,
            now: self.now,
            start_of_day: self.start_of_day,
        }
    }

    fn terminal_event(&mut self, event: TerminalEvent, effects: &mut Vec<Effect>) {
        match event {
            // Windows reports the release of a key as well.
            TerminalEvent::Key(key) if key.kind != KeyEventKind::Release => {
                self.dirty = true;
                self.key(key, effects);
            }
            TerminalEvent::Paste(text) => {
                self.dirty = true;
                self.paste(&text);
            }
            TerminalEvent::Resize(columns, rows) => {
                self.dirty = true;
                self.size = (columns, rows);
            }
            TerminalEvent::Mouse(mouse) => self.mouse(mouse, effects),
            TerminalEvent::Key(_) | TerminalEvent::FocusGained | TerminalEvent::FocusLost => {}
        }
    }

    /// Whether clicks and the wheel mean something here. On the terminal screen they are the terminal program's own, to
    /// select and copy what the unit prints.
    pub fn wants_mouse(&self) -> bool {
        !self.passes_keys()
    }

    fn mouse(&mut self, mouse: MouseEvent, effects: &mut Vec<Effect>) {
        let step = match mouse.kind {
            MouseEventKind::ScrollUp => Some(KeyCode::Up),
            MouseEventKind::ScrollDown => Some(KeyCode::Down),
            _ => None,
        };
        if let Some(code) = step.filter(|_| self.popup.is_none()) {
            self.dirty = true;
            return self.key(KeyEvent::new(code, KeyModifiers::NONE), effects);
        }
        if mouse.kind != MouseEventKind::Down(MouseButton::Left) || self.popup.is_some() {
            return;
        }
        let (columns, rows) = self.size;
        let column = usize::from(mouse.column);
        let front = self.help.is_none().then_some(self.front);
        let cmd = match mouse.row {
            1 => frame::tab_at(&self.view, front, usize::from(columns), column).map(Cmd::Go),
            row if row + 2 == rows => frame::menu_at(column),
            row => self.choose_at(columns, rows, row),
        };
        if let Some(cmd) = cmd {
            self.dirty = true;
            self.help = None;
            self.on(cmd, effects);
        }
    }

    /// A click into a list: what stands there is chosen, and what is chosen already is done.
    fn choose_at(&mut self, columns: u16, rows: u16, y: u16) -> Option<Cmd> {
        if self.help.is_some() {
            return None;
        }
        let body = frame::body(Rect::new(0, 0, columns, rows));
        let (_, area) = lines::split(body, frame::lost(&self.view, self.theme, usize::from(columns)).len() as u16);
        self.dirty = true;
        let again = match self.front {
            ScreenId::Connect => {
                let entry = self.connect.entry_at(self.scene(), area, y)?;
                self.connect.choose(entry)
            }
            ScreenId::Load => {
                let entry = self.load.entry_at(&self.view, area, y)?;
                self.load.choose(entry)
            }
            ScreenId::Recordings => {
                let entry = self.recordings.entry_at(self.scene(), area, y)?;
                self.recordings.choose(entry)
            }
            ScreenId::Dictionary => {
                let row = self.dictionary.row_at(&self.view, area, y)?;
                self.dictionary.choose(row);
                false
            }
            ScreenId::Overview | ScreenId::Terminal | ScreenId::Stream | ScreenId::Diagnostics | ScreenId::Bench => {
                false
            }
        };
        again.then_some(Cmd::Accept)
    }

    fn key(&mut self, key: KeyEvent, effects: &mut Vec<Effect>) {
        // No text and no answer: it means the same in front of everything but the bare terminal.
        if !self.passes_keys() && keymap::find(&[EVERYWHERE], key) == Some(Cmd::Suspend) {
            return self.on(Cmd::Suspend, effects);
        }
        if let Some(popup) = &mut self.popup {
            let is_waiting = matches!(popup, Popup::Waiting { .. });
            match popup.on(key) {
                // A link that takes long to open must not hold the user.
                Answer::Stay if is_waiting && keymap::find(&[EVERYWHERE], key) == Some(Cmd::Quit) => {
                    effects.push(Effect::Quit);
                }
                Answer::Stay if is_waiting && key.code == KeyCode::Esc && self.leaving.is_none() => {
                    self.popup = None;
                    self.disconnect(effects);
                }
                Answer::Stay => {}
                Answer::Close => self.popup = None,
                Answer::Act(action) => {
                    self.popup = None;
                    self.perform(action, effects);
                }
                Answer::Meanwhile(action) => self.perform(action, effects),
            }
            return;
        }
        if let Some(help) = &mut self.help {
            let page = isize::from(i16::try_from(self.size.1).unwrap_or(i16::MAX)) / 2;
            match key.code {
                KeyCode::Up => return help.scroll(-1),
                KeyCode::Down => return help.scroll(1),
                KeyCode::PageUp => return help.scroll(-page),
                KeyCode::PageDown => return help.scroll(page),
                _ => {}
            }
            self.help = None;
            // Another screen's key goes there; every other key only closes the page.
            match keymap::find(&[EVERYWHERE], key) {
                Some(cmd @ (Cmd::Go(_) | Cmd::Next | Cmd::Previous)) => return self.on(cmd, effects),
                _ => return,
            }
        }
        if self.front == ScreenId::Terminal {
            match self.terminal.meaning(key) {
                Meaning::Keys(bytes) => return self.perform(Action::Command(Command::Keys(bytes)), effects),
                Meaning::Nothing => return,
                Meaning::Console => {}
            }
        }
        if let Some(cmd) = keymap::find(&[self.front.bindings(), MENU, EVERYWHERE], key) {
            self.on(cmd, effects);
        }
    }

    fn paste(&mut self, text: &str) {
        if let Some(popup) = &mut self.popup {
            return popup.paste(text);
        }
        if self.front != ScreenId::Terminal || self.help.is_some() {
            return;
        }
        // Enter is CR on this line (manual, chapter 4); the unit knows ASCII only.
        let joined = text.replace("\r\n", "\r").replace('\n', "\r");
        let bytes: Vec<u8> = joined.bytes().filter(|byte| matches!(byte, b' '..=b'~' | b'\r' | b'\t')).collect();
        if !bytes.is_empty() {
            self.popup = Some(Popup::Asking(Question::Paste(bytes)));
        }
    }

    fn on(&mut self, cmd: Cmd, effects: &mut Vec<Effect>) {
        match cmd {
            Cmd::Menu(menu) => self.menu(menu, effects),
            Cmd::Go(screen) => self.perform(Action::Go(screen), effects),
            Cmd::Next => self.perform(Action::Go(self.front.step(1)), effects),
            Cmd::Previous => self.perform(Action::Go(self.front.step(ScreenId::ALL.len() - 1)), effects),
            Cmd::Help => self.help = Some(Help::default()),
            Cmd::Quit if self.view.is_in_the_middle() => self.ask(Question::Quit),
            Cmd::Quit => effects.push(Effect::Quit),
            // Time goes on while the program is stopped: every deadline of the job would be over.
            Cmd::Suspend if self.view.is_in_the_middle() && self.view.can_send() => {
                let what = self.view.job.map_or("the unit's view is open: close it with X first", |_| "a job runs");
                self.view.tell(Tone::Bad, format!("Not stopped: {what}."));
            }
            Cmd::Suspend => effects.push(Effect::Suspend),
            Cmd::Palette => {
                self.theme = Theme::new(self.theme.palette().next());
                self.view.tell(Tone::Quiet, format!("Colours: {}.", self.theme.palette().words()));
            }
            Cmd::Reconnect => {
                if matches!(self.view.link.state, LinkState::Lost(_)) {
                    self.perform(Action::Reconnect, effects);
                }
            }
            Cmd::Up
            | Cmd::Down
            | Cmd::PageUp
            | Cmd::PageDown
            | Cmd::First
            | Cmd::Last
            | Cmd::Accept
            | Cmd::Back
            | Cmd::Refresh
            | Cmd::Type
            | Cmd::Disconnect
            | Cmd::Hex
            | Cmd::Times
            | Cmd::Restart
            | Cmd::Left
            | Cmd::Right
            | Cmd::Zoom
            | Cmd::Pause
            | Cmd::Mark
            | Cmd::Export
            | Cmd::Find
            | Cmd::FindNext
            | Cmd::Only
            | Cmd::Compare
            | Cmd::Pack
            | Cmd::Break
            | Cmd::Faster
            | Cmd::Slower
            | Cmd::OpenWire
            | Cmd::ShortWire
            | Cmd::Repair
            | Cmd::Power
            | Cmd::Prefix => self.screen(cmd, effects),
        }
    }

    fn screen(&mut self, cmd: Cmd, effects: &mut Vec<Effect>) {
        let area = frame::body(Rect::new(0, 0, self.size.0, self.size.1));
        let page = usize::from(area.height);
        let record = self.session.as_ref().map_or(&self.no_record, Session::record);
        let action = match self.front {
            ScreenId::Connect => self.connect.on(cmd, &self.view),
            ScreenId::Overview => self.overview.on(cmd, self.view.monitor.stream.channels.len()),
            ScreenId::Terminal => self.terminal.on(cmd, &self.scrollback, record, page),
            ScreenId::Load => self.load.on(cmd, &self.view, area),
            ScreenId::Dictionary => self.dictionary.on(cmd, &self.view, page),
            ScreenId::Stream => self.stream.on(cmd, &self.view),
            ScreenId::Diagnostics => {
                let found = &self.view.monitor.diagnostics;
                self.diagnostics.on(cmd, found.lines.len().max(found.found.len()), page)
            }
            ScreenId::Recordings => self.recordings.on(cmd, &self.view),
            ScreenId::Bench => self.bench.on(cmd, &self.view),
        };
        if let Some(action) = action {
            self.perform(action, effects);
        }
    }

    /// A key of the unit's menu.
    fn menu(&mut self, menu: MenuCmd, effects: &mut Vec<Effect>) {
        if menu == MenuCmd::Load {
            // Files can be looked at without a unit.
            return self.perform(Action::Go(ScreenId::Load), effects);
        }
        if !self.can_send() {
            return;
        }
        match menu {
            MenuCmd::Menu => self.perform(Action::Command(Command::Identify), effects),
            MenuCmd::View => self.ask(Question::View),
            MenuCmd::Defaults => {
                self.ask(Question::Defaults { typed: Default::default(), complaint: None });
            }
            MenuCmd::Stream if self.view.facts.stream.is_some() => {
                self.perform(Action::Command(Command::StreamOff), effects);
            }
            MenuCmd::Stream => self.ask(Question::stream()),
            MenuCmd::Diagnostics if self.view.job == Some(Job::Diagnostics) => {
                self.perform(Action::Command(Command::Cancel), effects);
            }
            MenuCmd::Diagnostics => {
                self.front = ScreenId::Diagnostics;
                self.perform(Action::Command(Command::Diagnostics { pages: None }), effects);
            }
            MenuCmd::Load => {}
        }
    }

    fn perform(&mut self, action: Action, effects: &mut Vec<Effect>) {
        self.dirty = true;
        match action {
            Action::Go(screen) => {
                self.front = screen;
                match screen {
                    ScreenId::Load => {
                        if let Some(action) = self.load.entered() {
                            self.perform(action, effects);
                        }
                    }
                    ScreenId::Recordings => effects.push(Effect::ListRecordings),
                    _ => {}
                }
            }
            Action::Open(link) if self.view.is_in_the_middle() => self.ask(Question::Disconnect { then: Some(link) }),
            Action::Open(link) => self.open(link, effects),
            Action::Reconnect => {
                if let Some(link) = self.view.link.name.clone() {
                    self.open(link, effects);
                }
            }
            Action::Disconnect { then } => self.leave(then.map_or(Next::Disconnect, Next::Open), effects),
            Action::ListPorts => {
                self.connect.listing();
                effects.push(Effect::ListPorts);
            }
            Action::ListFiles(directory) => effects.push(Effect::ListFiles(directory)),
            Action::CheckImage(path) => {
                self.load.check(path.clone());
                effects.push(Effect::CheckImage(path));
            }
            Action::Ask(question) => self.ask(question),
            Action::Command(command) => {
                let reads = matches!(command, Command::ReadDictionary);
                if self.can_send() && self.command(command) && reads {
                    self.view.entries_read = 0;
                    self.front = ScreenId::Dictionary;
                }
            }
            Action::ViewDictionary => {
                if self.command(Command::Keys(b"v".to_vec())) {
                    self.front = ScreenId::Terminal;
                    self.terminal.follow();
                    self.view
                        .tell(Tone::Quiet, "V is sent. Enter shows the next object, X leaves and lets scanning go on.");
                }
            }
            Action::StartLoad { password, product } => {
                let Some(facts) = self.load.image() else { return };
                let Some(image) = facts.checked.clone() else { return };
                let file = facts.path.display().to_string();
                // What the unit says goes first, then the user, then the note of an upload that was left in the middle.
                let said = self.view.facts.product.as_ref().map(|known| known.value.clone());
                let product = product.or_else(|| self.view.noted().map(|noted| noted.product.clone()));
                let known = said.or(product.clone());
                let packed = self.load.is_packed();
                let order = LoadOrder { product, packed, ..LoadOrder::new(image, password) };
                if self.command(Command::Load(Box::new(order)))
                    && let (Some(link), Some(product)) = (self.view.link.name.clone(), known)
                {
                    // Noted before the first byte leaves: what the session sends is drained behind this.
                    self.view.link.noted = Some(Noted { product: product.clone(), image: file.clone() });
                    effects.push(Effect::UploadBegins { link, product, image: file });
                }
            }
            Action::DismissReport => self.view.load.report = None,
            Action::RestartExtremes => self.view.restart_extremes(),
            Action::Mark => self.mark(effects),
            Action::Find(words) => match self.front {
                ScreenId::Terminal => self.terminal.find(words, &self.scrollback),
                _ => self.dictionary.find(&words),
            },
            Action::ExportStream(path) => self.export_stream(path, effects),
            Action::EndExport => self.end_export(None),
            Action::ExportDictionary(path) => self.export_dictionary(path, effects),
            Action::Compare(path) => effects.push(Effect::ReadFile(path)),
            Action::Break if self.can_send() => effects.push(Effect::Break),
            Action::Break => {}
            Action::ListRecordings => effects.push(Effect::ListRecordings),
            Action::Play(playback) => effects.push(Effect::Play(playback)),
            Action::Order(line) if bench::emulated(&self.view).is_some() => {
                self.bench.ordered(self.now, line.clone());
                effects.push(Effect::Order(line));
            }
            Action::Order(_) => {}
            Action::Quit => self.leave(Next::Quit, effects),
        }
    }

    /// Gives a command to the session. Says whether it was taken; if not, the user knows why.
    fn command(&mut self, command: Command) -> bool {
        let Some(session) = &mut self.session else { return false };
        let job = match &command {
            Command::Keys(_) | Command::Bytes(_) | Command::Cancel => None,
            Command::Identify => Some(Job::Identify),
            Command::StreamOn { .. } => Some(Job::StreamOn),
            Command::StreamOff => Some(Job::StreamOff),
            Command::RestoreDefaults => Some(Job::RestoreDefaults),
            Command::ReadDictionary => Some(Job::ReadDictionary),
            Command::Diagnostics { .. } => Some(Job::Diagnostics),
            Command::Overhear => Some(Job::Overhear),
            Command::Load(_) => Some(Job::Load),
        };
        let viewing = match &command {
            Command::Keys(keys) if !session.password_open() => opens_view(keys),
            _ => None,
        };
        match session.command(self.now, command) {
            Ok(()) => {
                if let Some(job) = job {
                    self.view.job = Some(job);
                    self.view.notice = None;
                }
                if job == Some(Job::Load) {
                    self.view.load = Default::default();
                    self.front = ScreenId::Load;
                }
                self.view.viewing = viewing.unwrap_or(self.view.viewing);
                true
            }
            Err(refusal) => {
                self.view.tell(Tone::Bad, format!("Not sent: {refusal}."));
                false
            }
        }
    }

    /// Whether something can be sent; if not, the user is told why.
    fn can_send(&mut self) -> bool {
        let why = match &self.view.link.state {
            LinkState::Open { read_only: false } => return true,
            LinkState::Open { read_only: true } => "Not sent: this is a recording. Press 1 to choose a link.",
            LinkState::Opening | LinkState::Closed => "Not sent: no unit is connected. Press 1 to choose a link.",
            LinkState::Lost(_) => "Not sent: the link is lost. Press C to connect again.",
        };
        self.view.tell(Tone::Bad, why);
        false
    }

    fn ask(&mut self, question: Question) {
        self.popup = Some(Popup::Asking(question));
    }

    fn open(&mut self, link: String, effects: &mut Vec<Effect>) {
        if matches!(self.view.link.state, LinkState::Open { .. }) {
            effects.push(Effect::CloseLink);
        }
        self.session = None;
        let what = format!("Opening {}.", super::visible::text(&link));
        self.popup = Some(Popup::Waiting { what, hint: ("Esc", "do not wait") });
        self.begin_link(Link { name: Some(link.clone()), state: LinkState::Opening, ..Link::default() });
        effects.push(Effect::OpenLink(link));
    }

    /// Closes the link and goes on. Whatever is in the middle is ended first: a unit whose view stays open neither scans
    /// nor talks on CAN, and one that waits at a prompt takes the next key for an answer.
    fn leave(&mut self, next: Next, effects: &mut Vec<Effect>) {
        if self.leaving.is_some() {
            return;
        }
        if !(self.view.is_in_the_middle() && self.view.can_send()) {
            return self.left(next, effects);
        }
        if self.view.has_job_to_end() {
            self.command(Command::Cancel);
        }
        if self.view.viewing && !self.view.has_job_to_end() {
            self.command(Command::Keys(b"x".to_vec()));
        }
        self.dirty = true;
        let what = "Leaving the unit in order, which takes 2 seconds at most.".into();
        self.popup = Some(Popup::Waiting { what, hint: ("Q", "leave at once") });
        self.leaving = Some((next, self.now + WINDING_UP));
    }

    /// Goes on with what was to come as soon as nothing is in the middle any more, or there was time enough for it.
    fn go_on_leaving(&mut self, effects: &mut Vec<Effect>) {
        let is_over = self.leaving.as_ref().is_some_and(|(_, until)| *until <= self.now);
        let is_settled = !self.view.has_job_to_end() && self.session.as_ref().is_none_or(|it| it.waiting() == 0);
        if !(is_over || is_settled || !self.view.can_send()) {
            return;
        }
        if let Some((next, _)) = self.leaving.take() {
            self.popup = None;
            self.left(next, effects);
        }
    }

    fn left(&mut self, next: Next, effects: &mut Vec<Effect>) {
        match next {
            Next::Quit => effects.push(Effect::Quit),
            Next::Disconnect => self.disconnect(effects),
            Next::Open(link) => self.open(link, effects),
        }
    }

    fn disconnect(&mut self, effects: &mut Vec<Effect>) {
        effects.push(Effect::CloseLink);
        self.scrollback.note(self.now, "link closed".into());
        self.session = None;
        self.begin_link(Link::default());
        self.view.tell(Tone::Quiet, "The link is closed.");
    }

    /// Another link. Rows that go to a file go on if it is the same link again.
    fn begin_link(&mut self, link: Link) {
        let is_same = self.view.link.name == link.name;
        let export = self.view.export.take();
        self.view.begin_link(link);
        self.view.export = export;
        if !is_same {
            self.end_export(None);
        }
    }

    fn link_opened(&mut self, now: Instant, info: LinkInfo, effects: &mut Vec<Effect>) {
        self.dirty = true;
        if self.view.link.state != LinkState::Opening {
            // Nobody waits for it any more.
            effects.push(Effect::CloseLink);
            return;
        }
        self.popup = None;
        let read_only = info.read_only;
        self.scrollback.begin(now, format!("connected to {}", super::visible::text(&info.link)));
        self.begin_session(info);
        // Who has chosen a recording wants to steer it.
        self.front = if self.front == ScreenId::Recordings { self.front } else { ScreenId::Overview };
        if !read_only {
            self.command(Command::Identify);
        }
    }

    /// A session on the link that has just been opened.
    fn begin_session(&mut self, info: LinkInfo) {
        let session = if info.read_only { Session::of_recording } else { Session::new };
        self.session = Some(session(info.baud));
        self.start_of_day = info.start_of_day;
        self.begin_link(Link {
            name: Some(info.link),
            baud: info.baud,
            recording: info.recording,
            noted: info.noted,
            start_millis: info.start_millis,
            state: LinkState::Open { read_only: info.read_only },
            ..Link::default()
        });
        self.dictionary.begin_link();
        self.stream.begin_link();
        self.bench.begin_link();
        if info.read_only {
            // What goes by in a recording is understood as it goes by; nothing is sent for it.
            self.command(Command::Overhear);
            self.view.job = None;
        }
    }

    /// The recording is played from its beginning again: nothing of it has happened yet.
    fn played_anew(&mut self, now: Instant, info: LinkInfo) {
        self.dirty = true;
        if matches!(self.view.link.state, LinkState::Open { read_only: true }) {
            let playing = self.view.playing;
            self.scrollback.begin(now, "from the beginning".into());
            self.begin_session(info);
            self.view.playing = playing;
        }
    }

    fn mark(&mut self, effects: &mut Vec<Effect>) {
        self.view.mark(self.now);
        let text = format!("mark {}", self.view.monitor.stream.marks.len());
        self.scrollback.note(self.now, text.clone());
        self.view.tell(Tone::Quiet, format!("{text} is set, in the chart and in the recording."));
        effects.push(Effect::Mark(text));
    }

    fn break_sent(&mut self, now: Instant, result: Result<(), String>, effects: &mut Vec<Effect>) {
        self.dirty = true;
        match result {
            Ok(()) => {
                self.scrollback.note(now, "break sent".into());
                effects.push(Effect::Mark("break sent".into()));
            }
            Err(why) => self.view.tell(Tone::Bad, format!("No break sent: {why}.")),
        }
    }

    fn export_stream(&mut self, path: PathBuf, effects: &mut Vec<Effect>) {
        let (stream, start) = (&self.view.monitor.stream, self.view.link.start_millis);
        let channels: Vec<String> = stream.channels.iter().map(|channel| channel.name.clone()).collect();
        if channels.is_empty() {
            return self.view.tell(Tone::Bad, "There are no rows yet: T switches the stream on.");
        }
        let mut text = Row::csv_heading(&channels);
        let mut rows = 0;
        for (at, row) in stream.kept_rows() {
            text.push_str(&row.csv(&format::utc(start, at)));
            rows += 1;
        }
        effects.push(Effect::CreateFile { path: path.clone(), bytes: text.into_bytes() });
        self.view.export = Some(Export { path, rows, channels });
    }

    /// A row for the file that rows are written to.
    fn export_row(&mut self, at: Instant, row: &Row, effects: &mut Vec<Effect>) {
        let start = self.view.link.start_millis;
        let Some(export) = &mut self.view.export else { return };
        if export.channels.len() != row.readings.len() {
            return self.end_export(Some("the stream has other channels now"));
        }
        export.rows += 1;
        let bytes = row.csv(&format::utc(start, at)).into_bytes();
        match effects.last_mut() {
            // Rows that came together are written together.
            Some(Effect::AppendFile { path, bytes: before }) if *path == export.path => before.extend(bytes),
            _ => effects.push(Effect::AppendFile { path: export.path.clone(), bytes }),
        }
    }

    fn end_export(&mut self, why: Option<&str>) {
        let Some(export) = self.view.export.take() else { return };
        let path = export.path.display();
        let text = match why {
            None => format!("{} rows are in {path}.", format::grouped(export.rows)),
            Some(why) => format!("{path} ends after {} rows: {why}.", format::grouped(export.rows)),
        };
        self.view.tell(if why.is_none() { Tone::Good } else { Tone::Bad }, text);
    }

    fn export_dictionary(&mut self, path: PathBuf, effects: &mut Vec<Effect>) {
        let Some(read) = &self.view.dictionary else {
            return self.view.tell(Tone::Bad, "Nothing has been read yet: V reads the object dictionary.");
        };
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
        let text = match (ending.as_str(), self.view.product()) {
            ("json", _) => read.dump.json(),
            ("csv", _) => read.dump.csv(),
            ("txt", _) => read.dump.table(),
            ("dcf", Some(product)) => dump::configuration(&read.reading, product, &self.view.facts),
            ("dcf", None) => {
                return self.view.tell(Tone::Bad, "A DCF needs to know the product; .json keeps everything.");
            }
            _ => return self.view.tell(Tone::Bad, "Not written: the name has to end in .json, .csv, .dcf or .txt."),
        };
        effects.push(Effect::CreateFile { path, bytes: text.into_bytes() });
    }

    fn file_written(&mut self, path: &Path, result: Result<(), String>) {
        self.dirty = true;
        let shown = path.display();
        let is_export = self.view.export.as_ref().is_some_and(|export| export.path == path);
        match result {
            Ok(()) if is_export => {}
            Ok(()) => self.view.tell(Tone::Good, format!("{shown} is written.")),
            Err(why) => {
                if is_export {
                    self.view.export = None;
                }
                self.view.tell(Tone::Bad, format!("{shown} is not written: {why}."));
            }
        }
    }

    fn file_read(&mut self, path: &Path, text: Result<String, String>) {
        self.dirty = true;
        let name = path.display().to_string();
        let dump = text.and_then(|text| Dump::parse(&name, &text).map_err(|error| error.to_string()));
        match dump {
            Err(why) => self.view.tell(Tone::Bad, format!("Not compared: {why}.")),
            Ok(_) if self.view.dictionary.is_none() => {
                self.view.tell(Tone::Bad, "Nothing to compare it with yet: V reads the unit's object dictionary.");
            }
            Ok(dump) => {
                let short = path.file_name().map_or(name.clone(), |name| name.to_string_lossy().into_owned());
                self.dictionary.compare(short, dump);
                self.view
                    .tell(Tone::Quiet, format!("Compared with {name}: ≠ marks what differs, O chooses what is shown."));
            }
        }
    }

    fn link_failed(&mut self, failure: Failure) {
        self.dirty = true;
        if self.view.link.state == LinkState::Opening {
            self.session = None;
            self.begin_link(Link::default());
            self.popup = Some(Popup::Failed { title: "Not connected", failure });
        }
    }

    fn link_gone(&mut self, now: Instant, failure: Failure) {
        self.dirty = true;
        if matches!(self.view.link.state, LinkState::Open { .. }) {
            self.scrollback.note(now, "link lost".into());
            self.view.link.state = LinkState::Lost(failure);
            if let Some(session) = &mut self.session {
                session.link_lost(now);
            }
            self.popup = None;
        }
    }

    /// The cable is plugged in again. What stood on the screen goes on; the unit is asked who it is, since it may have
    /// started anew.
    fn link_back(&mut self, now: Instant, name: &str) {
        self.dirty = true;
        if matches!(self.view.link.state, LinkState::Lost(_)) {
            self.scrollback.note(now, format!("link back as {}", super::visible::text(name)));
            self.view.link.state = LinkState::Open { read_only: false };
            self.view.tell(Tone::Good, "The link is back.");
            if let Some(session) = &mut self.session {
                session.link_back(now);
            }
            self.command(Command::Identify);
        }
    }

    /// What happens from now on is not in the recording. That stays in sight: who has to prove something later must know.
    fn unrecorded(&mut self, now: Instant, why: String) {
        self.dirty = true;
        self.scrollback.note(now, format!("not recorded any more: {}", super::visible::text(&why)));
        self.view.tell(Tone::Bad, format!("Not recorded any more: {why}."));
        (self.view.link.recording, self.view.link.unrecorded) = (None, Some(why));
    }

    fn recording_over(&mut self, now: Instant, failure: Option<Failure>) {
        self.dirty = true;
        if let Some(session) = &mut self.session {
            session.recording_over(now);
        }
        match failure {
            None => self.view.tell(Tone::Quiet, "This is the end of the recording. 3 shows all of it."),
            Some(failure) => self.view.tell(Tone::Bad, failure.text),
        }
    }

    fn timeout(&mut self, now: Instant) {
        if let Some(session) = &mut self.session {
            session.handle_timeout(now);
        }
        self.dirty |= self.view.timeout(now) || self.view.job == Some(Job::Load);
    }

    /// Everything the session has to say and to send.
    fn drain(&mut self, effects: &mut Vec<Effect>) {
        let is_open = matches!(self.view.link.state, LinkState::Open { .. });
        while let Some(transmit) = self.session.as_mut().and_then(Session::poll_transmit) {
            if is_open {
                effects.push(Effect::Transmit(transmit));
            }
        }
        while let Some(event) = self.session.as_mut().and_then(Session::poll_event) {
            let facts = self.session.as_ref().map_or(&self.no_facts, Session::facts);
            self.view.fold(self.now, &event, facts);
            self.dirty = true;
            if let Event::Row { at, row, .. } = &event {
                self.export_row(*at, row, effects);
            }
            if let (Event::Finished(Outcome::Loaded(report)), Some(link)) = (&event, self.view.link.name.clone())
                && report.unit == UnitNow::Application
            {
                self.view.link.noted = None;
                effects.push(Effect::UploadEnds { link });
            }
        }
        let record = self.session.as_ref().map_or(&self.no_record, Session::record);
        self.dirty |= self.scrollback.follow(record);
    }
}

/// Whether keys typed at the unit's menu leave its view open (true), closed, or (`None`) as it was.
fn opens_view(keys: &[u8]) -> Option<bool> {
    keys.iter().rev().find_map(|key| match key.to_ascii_lowercase() {
        b'v' => Some(true),
        b'x' => Some(false),
        _ => None,
    })
}
