//! The console: keys, bytes and time in; a picture, effects and a deadline out.
//!
//! One way through: an input changes the session or a screen, the session's news are folded into the view, what it
//! wants sent becomes effects, and the picture is drawn from the view when the loop around finds it worth drawing.

mod files;
mod keys;
mod link;

use std::path::PathBuf;

use ratatui::Frame;
use ratatui::layout::Rect;

use link::Next;

use super::action::Action;
use super::frame;
use super::input::{Effect, Input, Noted};
use super::keymap::{Binding, Cmd};
use super::picker::expanded;
use super::popup::{self, Popup, Question, Wanted};
use super::screens::bench::{self, Bench};
use super::screens::connect::Connect;
use super::screens::diagnostics::Diagnostics;
use super::screens::dictionary::Dictionary;
use super::screens::help::Help;
use super::screens::load::Load;
use super::screens::overview::Overview;
use super::screens::recordings::Recordings;
use super::screens::stream::Stream;
use super::screens::terminal::Terminal;
use super::screens::{Scene, ScreenId};
use super::theme::{Palette, Theme};
use super::view::{LinkState, Tone, View};
use super::widgets::lines;
use crate::endpoint::Endpoint;
use crate::monitor::Scrollback;
use crate::record::Record;
use crate::session::{Command, Event, Facts, Job, LoadOrder, Outcome, Refusal, Session, UnitNow};
use crate::time::{Duration, Instant};

/// How often the picture moves while an upload runs, so that its times go on when the unit is silent.
const UPLOAD_TICK: Duration = Duration::from_millis(500);

/// Begins the name of a recording as a link.
const REPLAY: &str = "replay:";

/// What the console is started with.
#[derive(Clone, Debug)]
pub struct Options {
    /// The link to open at once; without one the list of ports is shown.
    pub link: Option<String>,
    /// Where the file picker starts.
    pub directory: PathBuf,
    /// What `~` means in a path; nothing where the system does not say.
    pub home: Option<PathBuf>,
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
    /// The link that is being opened, while the one before may still be open.
    opening: Option<String>,
    /// The link is about to be closed: what comes then, and until when the unit has time.
    leaving: Option<(Next, Instant)>,
    help: Option<Help>,
    connect: Connect,
    overview: Overview,
    terminal: Terminal,
    load: Load,
    /// Where the last file that is there was chosen.
    folder: PathBuf,
    dictionary: Dictionary,
    stream: Stream,
    diagnostics: Diagnostics,
    recordings: Recordings,
    bench: Bench,
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
            opening: None,
            leaving: None,
            help: None,
            connect: Connect::default(),
            overview: Overview::default(),
            terminal: Terminal::default(),
            load: Load::new(options.directory.clone()),
            folder: options.directory.clone(),
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
            Input::Arrived(backlog) => {
                if let (LinkState::Open { .. }, Some(session)) = (&self.view.link.state, &mut self.session) {
                    session.handle_backlog(now, &backlog);
                }
            }
            Input::ArrivedSoFar(backlog) => {
                if let (LinkState::Open { .. }, Some(session)) = (&self.view.link.state, &mut self.session) {
                    session.begin_backlog(now, &backlog);
                }
            }
            Input::Timeout => self.timeout(now),
            Input::PortsListed(ports) => {
                self.connect.listed(ports);
                self.dirty = true;
            }
            Input::LinkOpened(info) => self.link_opened(now, info, &mut effects),
            Input::LinkFailed(failure) => self.link_failed(failure),
            Input::LinkGone(failure) => self.link_gone(now, failure, &mut effects),
            Input::LinkBack(name) => self.link_back(now, &name, &mut effects),
            Input::Sent(bytes) => {
                if let Some(session) = &mut self.session {
                    session.handle_sent(now, &bytes);
                }
            }
            Input::Mark(text) => {
                if let Some(session) = &mut self.session {
                    session.handle_mark(now, &text);
                }
                self.view.remarked(now, &text);
                self.scrollback.note(now, super::visible::text(&text));
            }
            Input::Unrecorded(why) => self.unrecorded(now, why),
            Input::RecordingOver(failure) => self.recording_over(now, failure),
            Input::FilesListed { directory, entries } => self.files_listed(directory, entries),
            Input::BytesRead { path, bytes } => self.bytes_read(&path, bytes),
            Input::ImageChecked(facts) => self.image_checked(facts),
            Input::ImageUnreadable { path, why } => self.image_unreadable(&path, &why),
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
        self.is_terminal() && !self.view.is_recording()
    }

    /// Whether the terminal screen is in front, and nothing before it.
    fn is_terminal(&self) -> bool {
        self.front == ScreenId::Terminal && self.popup.is_none() && self.help.is_none()
    }

    /// When [`Input::Timeout`] is wanted next. `None`: only an input from outside can bring anything new.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let is_open = matches!(self.view.link.state, LinkState::Open { .. });
        let session = self.session.as_ref().and_then(Session::poll_timeout);
        let tick = (self.view.job == Some(Job::Load)).then(|| self.now + UPLOAD_TICK);
        let late = self.view.poll_timeout().filter(|_| is_open);
        let leaving = self.leaving.as_ref().map(|(_, until)| *until);
        // No other screen says how old anything is.
        let ages = self.view.ages_at().filter(|_| self.front == ScreenId::Overview);
        [session, tick, late, ages, leaving].into_iter().flatten().min()
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
        let is_over = matches!(event, Event::Finished(Outcome::Loaded(_)));
        if is_over && matches!(self.popup, Some(Popup::Asking(Question::CancelLoad))) {
            // There is nothing left to cancel, and what would come of it is not true any more.
            self.popup = None;
        }
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
        let area = frame.area();
        if frame::is_too_small((area.width, area.height)) {
            let asks = matches!(self.popup, Some(Popup::Asking(Question::Quit)));
            return frame::too_small(&self.view, asks, frame);
        }
        let columns = usize::from(area.width);
        let row = |y: u16| Rect { y, height: 1, ..area };
        let front = self.help.is_none().then_some(self.front);
        let theme = self.theme;
        lines::draw(frame, row(0), [frame::header(&self.view, theme, columns)]);
        lines::draw(frame, row(1), [frame::tabs(&self.view, front, theme, columns)]);
        let lost = frame::lost(&self.view, self.front, theme, columns);
        let (banner, body) = lines::split(frame::body(area, &self.view), lost.len() as u16);
        lines::draw(frame, banner, lost);
        self.draw_screen(body, frame);
        let notice = frame::notice(&self.view, theme, columns);
        let height = notice.len() as u16;
        lines::draw(frame, Rect { y: area.height - 2 - height, height, ..area }, notice);
        lines::draw(frame, row(area.height - 2), [frame::menu(theme)]);
        let keys = match self.front {
            _ if self.help.is_some() => frame::help_keys(theme),
            ScreenId::Terminal if !self.view.is_recording() => {
                frame::terminal_keys(theme, self.front, self.terminal.is_after_prefix(), columns)
            }
            _ => frame::keys(theme, &self.footer(columns)),
        };
        lines::draw(frame, row(area.height - 1), [keys]);
        if let Some(popup) = &self.popup {
            popup::draw(popup, &self.view, theme, frame::body(area, &self.view), frame);
        }
    }

    /// The bindings of the screen in front that mean something now, as many as have room.
    fn footer(&self, columns: usize) -> Vec<Binding> {
        let bindings = match self.front {
            ScreenId::Load => self.load.footer(&self.view),
            ScreenId::Dictionary => self.dictionary.footer(&self.view),
            screen => screen.bindings().to_vec(),
        };
        let meant = bindings.into_iter().filter(|binding| self.means_something(binding.cmd)).collect();
        frame::fitting(self.theme, meant, self.front.dispensable(), columns)
    }

    /// Whether a key of the screen in front does something now. One that does not is left out of the footer.
    fn means_something(&self, cmd: Cmd) -> bool {
        let view = &self.view;
        let has_rows = !view.monitor.stream.channels.is_empty();
        match (self.front, cmd) {
            (ScreenId::Connect, Cmd::Disconnect) => {
                matches!(view.link.state, LinkState::Open { .. } | LinkState::Lost(_))
            }
            (ScreenId::Overview, Cmd::PageDown) => !view.monitor.faults.is_empty(),
            (ScreenId::Stream, Cmd::Mark) => view.link.name.is_some(),
            (ScreenId::Stream, Cmd::Export) => has_rows || view.export.is_some(),
            (ScreenId::Overview | ScreenId::Stream, _) => has_rows,
            (ScreenId::Dictionary, Cmd::Compare) => view.current_dictionary().is_some(),
            (ScreenId::Dictionary, Cmd::Export | Cmd::Only) => view.dictionary.is_some(),
            (ScreenId::Dictionary, Cmd::Back) => self.dictionary.is_narrowed() || view.job == Some(Job::ReadDictionary),
            (ScreenId::Dictionary, _) => view.dictionary.is_some() || view.product().is_some(),
            (ScreenId::Diagnostics, _) => view.monitor.diagnostics.at.is_some(),
            (ScreenId::Recordings, Cmd::Down | Cmd::Accept) => !self.recordings.entries().is_empty(),
            (ScreenId::Recordings, cmd) if cmd != Cmd::Refresh => view.playing.is_some(),
            (ScreenId::Bench, _) => bench::emulated(view).is_some(),
            (ScreenId::Terminal, Cmd::SendFile | Cmd::Break) => view.can_send(),
            (ScreenId::Connect | ScreenId::Terminal | ScreenId::Load | ScreenId::Recordings, _) => true,
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

    /// Whether nothing is drawn but that the terminal is too small.
    fn is_too_small(&self) -> bool {
        frame::is_too_small(self.size)
    }

    /// Whether clicks and the wheel mean something here. On the terminal screen they are the terminal program's own, to
    /// select and copy what the unit prints.
    pub fn wants_mouse(&self) -> bool {
        !self.is_terminal()
    }

    fn perform(&mut self, action: Action, effects: &mut Vec<Effect>) {
        self.dirty = true;
        match action {
            Action::Go(screen) => {
                if self.front != screen {
                    // It was about what was done there, and stands before what is being done.
                    self.view.notice = None;
                }
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
            // A recording can be opened again as it was; whoever has a unit at the line is asked.
            Action::Open(link) => {
                let link = self.link_named(link);
                match self.view.can_send() {
                    true => self.ask(Question::Disconnect { then: Some(link) }),
                    false => self.open(link, effects),
                }
            }
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
                let path = self.expanded(path);
                self.load.check(path.clone());
                let (loader, allow) = (self.load.loader(), self.load.allowed().to_vec());
                effects.push(Effect::CheckImage { path, loader, allow });
            }
            Action::Allow(error) => {
                if let Some(action) = self.load.allow(error) {
                    self.perform(action, effects);
                }
            }
            Action::Tell(why) => self.view.tell(Tone::Quiet, why),
            Action::Ask(question) => self.ask(question),
            Action::Command(command) => {
                let reads = matches!(command, Command::ReadDictionary);
                if self.can_send() && self.command(command) && reads {
                    self.view.entries_read = 0;
                    self.front = ScreenId::Dictionary;
                }
            }
            Action::ViewDictionary => {
                if self.can_send() && self.command(Command::Keys(b"v".to_vec())) {
                    self.front = ScreenId::Terminal;
                    self.terminal.follow();
                    self.view
                        .tell(Tone::Quiet, "V is sent. Enter shows the next object, X leaves and lets scanning go on.");
                }
            }
            Action::StartLoad { password, product } => {
                if !self.can_send() {
                    return;
                }
                let Some(facts) = self.load.image() else { return };
                let Some(image) = facts.checked.clone() else { return };
                let file = facts.path.display().to_string();
                // What the unit says goes first, then the user, then the note of an upload that was left in the middle.
                let said = self.view.facts.product.as_ref().map(|known| known.value.clone());
                let product = product.or_else(|| self.view.noted().map(|noted| noted.product.clone()));
                let known = said.or(product.clone());
                let ran = self.view.ran();
                let packed = self.load.is_packed();
                let (loader, allowed) = (self.load.loader(), self.load.allowed().to_vec());
                let order = LoadOrder { product, ran, packed, loader, allowed, ..LoadOrder::new(image, password) };
                if self.command(Command::Load(Box::new(order)))
                    && let (Some(link), Some(product)) = (self.view.link.name.clone(), known)
                {
                    // Noted before the first byte leaves: what the session sends is drained behind this.
                    let noted = Noted { product, image: file, ran };
                    self.view.link.noted = Some(noted.clone());
                    effects.push(Effect::UploadBegins { link, noted });
                }
            }
            Action::DismissReport => self.view.load.report = None,
            Action::RestartExtremes => self.view.restart_extremes(),
            Action::Mark(at) => self.mark(at, effects),
            Action::Find(words) => match self.front {
                ScreenId::Terminal => {
                    let area = self.screen_area();
                    self.terminal.find(words, &self.view, &self.scrollback, area);
                }
                _ => self.dictionary.find(&words),
            },
            Action::ExportStream(path) => self.export_stream(self.expanded(path), effects),
            Action::EndExport => self.end_export(None),
            Action::ExportDictionary(path) => self.export_dictionary(self.expanded(path), effects),
            Action::Compare(path) => effects.push(Effect::ReadFile(self.expanded(path))),
            Action::Choose(Wanted::ToSend) if !self.may_send_file() => {}
            Action::Choose(wanted) => {
                self.ask(Question::choose(wanted, &self.folder));
                effects.push(Effect::ListFiles(self.folder.clone()));
            }
            Action::ReadToSend(path) => effects.push(Effect::ReadBytes(self.expanded(path))),
            Action::SendFile { name, bytes } => self.send_file(name, bytes, effects),
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
            Command::Keys(_) | Command::Cancel => None,
            Command::Identify => Some(Job::Identify),
            Command::StreamOn { .. } => Some(Job::StreamOn),
            Command::StreamOff => Some(Job::StreamOff),
            Command::RestoreDefaults => Some(Job::RestoreDefaults),
            Command::ReadDictionary => Some(Job::ReadDictionary),
            Command::Diagnostics { .. } | Command::DiagnosticsOff => Some(Job::Diagnostics),
            Command::Overhear => Some(Job::Overhear),
            Command::Load(_) => Some(Job::Load),
            Command::SendFile(_) => Some(Job::SendFile),
        };
        let period = match &command {
            Command::StreamOn { period, .. } => Some(*period),
            _ => None,
        };
        // What is typed at the unit's own prompts is not followed: it may set any other period.
        let may_set = matches!(&command, Command::Keys(keys) if keys.iter().any(|key| b"TtDd".contains(key)));
        let viewing = match &command {
            Command::Keys(keys) if !session.password_open() => opens_view(keys),
            _ => None,
        };
        // Whoever wants something else need not wait for minutes for a slow stream's first row.
        if self.view.awaits_first_row() && !matches!(command, Command::Cancel) {
            let _ = session.command(self.now, Command::Cancel);
        }
        match session.command(self.now, command) {
            Ok(()) => {
                if let Some(job) = job {
                    self.view.job = Some(job);
                    self.view.notice = None;
                }
                self.view.wanted_period = period.or(self.view.wanted_period.filter(|_| job.is_none()));
                if may_set {
                    self.view.monitor.stream.set_period(None);
                }
                if viewing == Some(true) {
                    self.view.monitor.stream.interrupt();
                }
                if job == Some(Job::Load) {
                    self.view.load = Default::default();
                    self.front = ScreenId::Load;
                }
                self.view.viewing = viewing.unwrap_or(self.view.viewing);
                true
            }
            Err(Refusal::Busy(job)) => {
                self.view.tell(Tone::Bad, format!("Not sent: axcon is still {}.", job.doing()));
                false
            }
            Err(refusal) => {
                self.view.tell(Tone::Bad, format!("Not sent: {refusal}."));
                false
            }
        }
    }

    /// A path with the user's home folder in place of `~`.
    fn expanded(&self, path: PathBuf) -> PathBuf {
        expanded(path, self.options.home.as_deref())
    }

    /// The same for a link: the path of a port, or of a recording.
    fn link_named(&self, name: String) -> String {
        let (kind, path) = match name.strip_prefix(REPLAY) {
            Some(path) => (REPLAY, path),
            None => ("", name.as_str()),
        };
        match path.starts_with('~') {
            true => format!("{kind}{}", self.expanded(path.into()).display()),
            false => name,
        }
    }

    fn ask(&mut self, question: Question) {
        // It was about something else.
        self.view.notice = None;
        self.popup = Some(Popup::Asking(question));
    }

    fn timeout(&mut self, now: Instant) {
        if let Some(session) = &mut self.session {
            session.handle_timeout(now);
        }
        self.dirty |= self.view.timeout(now) || self.view.job == Some(Job::Load);
        self.dirty |= self.view.aged(now) && self.front == ScreenId::Overview;
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
            let serial = self.view.serial;
            let facts = self.session.as_ref().map_or(&self.no_facts, Session::facts);
            self.view.fold(self.now, &event, facts);
            if let (Event::Finished(_), Some(session)) = (&event, &self.session) {
                // One that had to wait for the end of this one runs by now. Listening to a recording is no job of the user's.
                self.view.job = session.job().filter(|job| *job != Job::Overhear);
            }
            self.dirty = true;
            match &event {
                // Whose it is is not known yet: it waits.
                Event::Row { .. } if self.view.returning.is_some() => {}
                Event::Row { at, row, .. } => self.export_row(*at, row, effects),
                // The answer to the question who is there; before it, only a name is one.
                Event::Finished(_) => self.decide_who_returned(effects),
                Event::FactsChanged if self.view.facts.product.is_some() && self.view.job.is_none() => {
                    self.decide_who_returned(effects);
                }
                _ => {}
            }
            self.compare_serial(serial, effects);
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
