//! The console: keys, bytes and time in; a picture, effects and a deadline out.
//!
//! One way through: an input changes the session or a screen, the session's news are folded into the view, what it
//! wants sent becomes effects, and the picture is drawn from the view when the loop around finds it worth drawing.

mod draw;
mod files;
mod keys;
mod link;
mod perform;

use std::collections::BTreeSet;
use std::path::PathBuf;

use link::Next;

use super::action::Action;
use super::frame;
use super::input::{Effect, Input};
use super::popup::{Popup, Question};
use super::screens::ScreenId;
use super::screens::bench::Bench;
use super::screens::connect::Connect;
use super::screens::diagnostics::Diagnostics;
use super::screens::dictionary::Dictionary;
use super::screens::help::Help;
use super::screens::load::Load;
use super::screens::overview::Overview;
use super::screens::recordings::Recordings;
use super::screens::stream::Stream;
use super::screens::terminal::Terminal;
use super::theme::{Palette, Theme};
use super::view::{LinkState, View};
use crate::endpoint::Endpoint;
use crate::monitor::Scrollback;
use crate::record::Record;
use crate::session::{Event, Facts, Job, Outcome, Session, UnitNow};
use crate::time::{Duration, Instant};

/// How often the picture moves while an upload runs, so that its times go on when the unit is silent.
const UPLOAD_TICK: Duration = Duration::from_millis(500);

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
    /// The folder that the file picker showed last: there it begins.
    folder: PathBuf,
    /// Files that the console has made. What goes wrong with one from then on makes it end early.
    made: BTreeSet<PathBuf>,
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
            made: BTreeSet::new(),
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
        self.view.now = self.now;
        let mut effects = Vec::new();
        match input {
            Input::Terminal(event) => self.terminal_event(event, &mut effects),
            Input::Bytes(bytes) => {
                self.view.heard(now);
                if let (LinkState::Open, Some(session)) = (&self.view.link.state, &mut self.session) {
                    session.handle_bytes(now, &bytes);
                }
            }
            Input::Arrived(backlog) => {
                self.view.heard(now);
                if let (LinkState::Open, Some(session)) = (&self.view.link.state, &mut self.session) {
                    session.handle_backlog(now, &backlog);
                }
            }
            Input::ArrivedSoFar(backlog) => {
                self.view.heard(now);
                if let (LinkState::Open, Some(session)) = (&self.view.link.state, &mut self.session) {
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
            Input::PlayedAnew(info) => self.played_anew(now, info, &mut effects),
            Input::Ordered { line, answer } => {
                self.order_answered(&line, &answer);
                self.bench.answered(&line, answer);
                self.dirty = true;
            }
            Input::BreakSent(result) => self.break_sent(now, result, &mut effects),
            Input::Signal => self.leave(Next::Quit, &mut effects),
        }
        self.drain(&mut effects);
        self.close_settled();
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
        let is_open = self.view.link.state == LinkState::Open;
        let session = self.session.as_ref().and_then(Session::poll_timeout);
        let tick = (self.view.job == Some(Job::Load)).then(|| self.now + UPLOAD_TICK);
        let late = self.view.poll_timeout().filter(|_| is_open);
        let leaving = self.leaving.as_ref().map(|(_, until)| *until);
        let notice = self.view.next_notice_at();
        // No other screen says how old anything is.
        let ages = self.view.ages_at().filter(|_| self.front == ScreenId::Overview);
        [session, tick, late, ages, leaving, notice].into_iter().flatten().min()
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
        self.close_settled();
        // A raw line alone changes the terminal, and whatever else shows it.
        self.dirty = true;
    }

    /// Closes a question about something that has ended meanwhile: there is nothing left to give up, and what would come
    /// of it is not true any more.
    fn close_settled(&mut self) {
        let is_settled = match &self.popup {
            Some(Popup::Asking(Question::CancelLoad)) => self.view.job != Some(Job::Load),
            Some(Popup::Asking(Question::Quit)) => !self.view.would_be_left(),
            _ => false,
        };
        if is_settled {
            self.popup = None;
            self.dirty = true;
        }
    }

    /// Shows what went over the line.
    pub fn follow(&mut self, record: &Record) {
        self.dirty |= self.scrollback.follow(record);
    }

    /// Every byte of the connection, secrets already out of it: what a recording follows after each input.
    pub fn record(&self) -> &Record {
        self.session.as_ref().map_or(&self.no_record, Session::record)
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

    fn timeout(&mut self, now: Instant) {
        if let Some(session) = &mut self.session {
            session.handle_timeout(now);
        }
        if self.view.job == Some(Job::Load) {
            self.view.look_for_silence(now);
        }
        self.dirty |= self.view.timeout(now) || self.view.job == Some(Job::Load);
        self.dirty |= self.view.aged(now) && self.front == ScreenId::Overview;
    }

    /// Everything the session has to say and to send.
    fn drain(&mut self, effects: &mut Vec<Effect>) {
        let is_open = self.view.link.state == LinkState::Open;
        while let Some(transmit) = self.session.as_mut().and_then(Session::poll_transmit) {
            if is_open {
                effects.push(Effect::Transmit(transmit));
            }
        }
        while let Some(event) = self.session.as_mut().and_then(Session::poll_event) {
            let serial = self.view.unit.serial;
            let facts = self.session.as_ref().map_or(&self.no_facts, Session::facts);
            self.view.fold(self.now, &event, facts);
            if let (Event::Finished(_), Some(session)) = (&event, &self.session) {
                // A job that had to wait for the end of this one runs by now. Listening to a recording is not a job of the user's.
                self.view.job = session.job().filter(|job| *job != Job::Overhear);
            }
            self.dirty = true;
            match &event {
                // Whose it is is not known yet: it waits.
                Event::Row { .. } if self.view.returning.is_some() => {}
                Event::Row { at, row, .. } => self.export_row(*at, row, effects),
                // The answer to the question who is there; before it, only a name is one.
                Event::Finished(_) => self.decide_who_returned(true, effects),
                Event::FactsChanged if self.view.facts.product.is_some() && self.view.job.is_none() => {
                    self.decide_who_returned(false, effects);
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
        self.view.question = self.session.as_ref().and_then(Session::open_question);
        let record = self.session.as_ref().map_or(&self.no_record, Session::record);
        self.dirty |= self.scrollback.follow(record);
    }
}
