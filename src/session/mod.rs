//! Our end of the cable: commands in, bytes and events out.
//!
//! A session appends every byte to the record first, then splits them into lines, recognises what it can, folds that
//! into [`Facts`], and drives at most one job: a dialogue with the unit that ends in an [`Outcome`]. It knows the unit
//! only through bytes. Whatever a job does, lines and rows are reported as events too.

mod console;
mod diagnostics;
mod dialogue;
mod dictionary;
mod echo;
mod event;
#[doc(hidden)]
pub mod flaw;
mod hearing;
mod identify;
mod job;
mod keys;
mod leaving;
mod overheard;
mod pages;
mod password;
mod redactor;
mod restore;
mod sending;
mod toggled;
mod transmitter;
mod upload;
mod watching;

pub use event::*;
pub use upload::{LoadReport, Phase, Progress, Proof, SEE_POWER, SILENT, UnitNow, Verdict};

use std::collections::VecDeque;

use crate::device::Product;
use crate::endpoint::{Arrived, Endpoint, Secrecy, Transmit};
use crate::record::{Direction, LINK_BACK, LINK_LOST, Record};
use crate::secret::Secret;
use crate::time::{Duration, Instant, character_time};
use crate::wire::stream::Source;
use crate::wire::{Framer, MenuKey, Message, Text, Vocabulary};
use dialogue::Dialogue;
use hearing::PromptWatch;
use job::{Desk, Signal, Work};
use keys::{KeyReader, LONGEST_TYPED, Typed, TypedBy};
use pages::Pages;
use password::PasswordGuard;
use toggled::Toggled;
use transmitter::{Sender, Transmitter};
use watching::Saw;

/// A conversation with one unit.
pub struct Session {
    now: Instant,
    /// The time at which what is heard is dated: before `now` for bytes that had to wait for us.
    dated: Instant,
    record: Record,
    framer: Framer,
    vocabulary: Vocabulary<'static>,
    transmitter: Transmitter,
    facts: Facts,
    running: Option<Running>,
    /// The job that begins once the unit has been identified.
    queued: Option<Running>,
    events: VecDeque<Event>,
    prompt: PromptWatch,
    /// Decides what is secret of all that is typed and received.
    password: PasswordGuard,
    mode: Mode,
    /// When the menu was asked for last.
    menu_asked_at: Option<Instant>,
    /// Reads keys as they are typed: they may have to wait before they leave.
    typing: KeyReader,
    /// Reads keys as they leave, typed or sent by a job.
    keys: KeyReader,
    /// Which lines answer a key.
    dialogue: Dialogue,
    /// When a loader printed its header, if nothing but unknown text has come since.
    loader_headed_at: Option<Instant>,
    /// Whether the stream is still on.
    toggled: Toggled,
    /// Pages of diagnostics, no matter what asked for them.
    pages: Pages,
    /// The current line was counted as not understood.
    counted: bool,
    /// What the stream was asked to send, or was last seen to send.
    source: Option<Source>,
}

/// What a session is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// A unit: lines are looked at for what they mean, and jobs talk to it.
    Live,
    /// A unit on a plain terminal: lines are not looked at.
    Plain,
    /// A recording: lines are looked at, and nothing is ever sent.
    Recording,
}

/// A job, and which it is.
struct Running {
    job: Job,
    work: Box<dyn Work + Send>,
    /// Number of the first piece it queues, once it has begun.
    first_piece: u64,
}

/// When a job may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Now,
    /// Once the unit has been identified.
    Next,
}

impl Session {
    /// A conversation about to begin on a line of this many baud.
    ///
    /// # Panics
    /// If `baud` is 0.
    pub fn new(baud: u32) -> Self {
        let products = Product::all();
        Session {
            now: Instant::ZERO,
            dated: Instant::ZERO,
            record: Record::new(),
            framer: Framer::default(),
            vocabulary: Vocabulary {
                products: products.iter().map(|product| product.name.as_str()).collect(),
                layouts: products.iter().map(|product| &product.stream).collect(),
            },
            transmitter: Transmitter::new(character_time(baud)),
            facts: Facts::default(),
            running: None,
            queued: None,
            events: VecDeque::new(),
            prompt: PromptWatch::default(),
            password: PasswordGuard::default(),
            mode: Mode::Live,
            menu_asked_at: None,
            typing: KeyReader::default(),
            keys: KeyReader::default(),
            dialogue: Dialogue::default(),
            loader_headed_at: None,
            toggled: Toggled::default(),
            pages: Pages::default(),
            counted: false,
            source: None,
        }
    }

    /// A conversation in which nothing is recognised but flow control and prompts, for a terminal that must keep up
    /// with any flood: facts and rows stay unknown, and no job can work.
    ///
    /// # Panics
    /// If `baud` is 0.
    pub fn plain(baud: u32) -> Self {
        Session { mode: Mode::Plain, ..Session::new(baud) }
    }

    /// A conversation from a recording: it is fed what both ends said ([`Session::handle_sent`]) and sends nothing;
    /// jobs read what they can from what they hear, until [`Session::recording_over`].
    ///
    /// # Panics
    /// If `baud` is 0.
    pub fn of_recording(baud: u32) -> Self {
        Session { mode: Mode::Recording, ..Session::new(baud) }
    }

    /// Takes a command, or says why not.
    ///
    /// # Errors
    /// If another job runs or the command makes no sense; nothing has been sent then, and nothing has changed.
    pub fn command(&mut self, now: Instant, command: Command) -> Result<(), Refusal> {
        self.now = self.now.max(now);
        let source = match &command {
            Command::StreamOn { source, .. } => Some(*source),
            _ => None,
        };
        let password = match &command {
            Command::Load(order) => order.password.clone(),
            _ => None,
        };
        let is_recording = self.mode == Mode::Recording;
        let (job, work): (Job, Box<dyn Work + Send>) = match command {
            Command::Cancel => {
                self.cancel();
                return Ok(());
            }
            Command::ReadDictionary if is_recording => (Job::ReadDictionary, Box::<overheard::Dictionary>::default()),
            Command::Diagnostics { pages } if is_recording => {
                (Job::Diagnostics, Box::new(overheard::Diagnostics::new(pages)))
            }
            Command::Overhear if is_recording => (Job::Overhear, Box::new(overheard::Everything::new())),
            Command::Overhear => return Err(Refusal::Live),
            _ if is_recording => return Err(Refusal::ReadOnly),
            Command::Keys(keys) => return self.keys(&keys),
            Command::SendFile(bytes) => {
                self.may_send_file()?;
                (Job::SendFile, Box::new(sending::SendFile::new(bytes)))
            }
            Command::Identify => (Job::Identify, Box::new(identify::Identify::default())),
            Command::StreamOn { source, period } => {
                if !(Duration::from_millis(1)..=Duration::from_secs(60)).contains(&period) {
                    return Err(Refusal::Period(period));
                }
                (Job::StreamOn, Box::new(console::StreamOn::new(source, period)))
            }
            Command::StreamOff => (Job::StreamOff, Box::new(console::StreamOff::default())),
            Command::RestoreDefaults => (Job::RestoreDefaults, Box::new(restore::RestoreDefaults::default())),
            Command::ReadDictionary => (Job::ReadDictionary, Box::new(dictionary::ReadDictionary::new())),
            Command::Diagnostics { pages } => (Job::Diagnostics, Box::new(diagnostics::Diagnostics::new(pages))),
            Command::DiagnosticsOff => (Job::Diagnostics, Box::new(diagnostics::Diagnostics::off())),
            Command::Load(order) => {
                let password = order.password.as_ref().map(Secret::reveal);
                if password.is_some_and(|bytes| bytes.is_empty() || bytes.iter().any(u8::is_ascii_control)) {
                    return Err(Refusal::Password);
                }
                (Job::Load, Box::new(upload::Upload::new(*order)))
            }
        };
        let turn = self.admit(job)?;
        self.source = source.or(self.source);
        if let Some(password) = password {
            self.password.look_for(password.reveal());
        }
        let next = Running { job, work, first_piece: 0 };
        match turn {
            Turn::Now => self.begin(next),
            Turn::Next => self.queued = Some(next),
        }
        Ok(())
    }

    /// When this job may begin, if it may.
    fn admit(&self, job: Job) -> Result<Turn, Refusal> {
        let question = self.typing.question().filter(|_| job != Job::SendFile);
        match (&self.running, question) {
            (None, None) => Ok(Turn::Now),
            // Identifying the unit takes a moment and changes nothing, so the next job waits for it instead of being
            // refused.
            (Some(Running { job: Job::Identify, .. }), None) if self.queued.is_none() && job != Job::Identify => {
                Ok(Turn::Next)
            }
            (None | Some(Running { job: Job::Identify, .. }), Some(key)) => Err(Refusal::QuestionOpen(key)),
            (Some(running), _) => Err(Refusal::Busy(running.job)),
        }
    }

    fn begin(&mut self, next: Running) {
        if next.job == Job::SendFile {
            self.typing.begin();
        }
        self.running = Some(Running { first_piece: self.transmitter.next_number(), ..next });
        self.signal(Signal::Begin);
    }

    fn cancel(&mut self) {
        if let Some(queued) = self.queued.take() {
            self.events.push_back(Event::Finished(Outcome::Cancelled(queued.job)));
        }
        self.signal(Signal::Cancel);
    }

    /// The key, D or L, that was typed by hand and whose question has not been answered yet: what is sent next belongs
    /// to the answer.
    pub fn open_question(&self) -> Option<MenuKey> {
        self.typing.question().filter(|_| self.running.is_none())
    }

    /// The port is gone: ends the running job, and sends nothing more.
    pub fn link_lost(&mut self, now: Instant) {
        self.now = self.now.max(now);
        self.transmitter.clear();
        self.signal(Signal::LinkLost);
        self.forget_pages();
        self.toggled = Toggled::default();
        self.transmitter.clear();
        self.cut_line();
    }

    /// The port is back, and the unit may be in another state. It does not hold us until it sends XOFF again. If it was
    /// asking for its password, it may still be.
    pub fn link_back(&mut self, now: Instant) {
        self.transmitter.hold(now, false);
        self.password.cut_off();
        self.question_over();
        self.stream_stopped();
        self.cut_line();
    }

    /// Forgets what is known of the unit: another one may be connected.
    pub fn forget_unit(&mut self) {
        self.facts = Facts { unrecognised_lines: self.facts.unrecognised_lines, ..Facts::default() };
        self.source = None;
        self.events.push_back(Event::FactsChanged);
    }

    /// In a recording: these bytes were sent.
    pub fn handle_sent(&mut self, now: Instant, bytes: &[u8]) {
        self.pass_to(now);
        self.record.push(self.now, Direction::ToUnit, Secrecy::Open, bytes);
        let typed = self.note_typed(bytes);
        self.signal(Signal::Typed(&typed));
    }

    /// In a recording: a remark, by which the recorder notes that the link was lost, or was back.
    pub fn handle_mark(&mut self, now: Instant, text: &str) {
        self.pass_to(now);
        if text == LINK_LOST {
            self.link_lost(now);
            // Once the link is back, rows show whether the unit still streams.
            self.stream_stopped();
        } else if text.starts_with(LINK_BACK) {
            self.link_back(now);
        }
    }

    /// In a recording: it has ended. The running job ends with what it has heard.
    pub fn recording_over(&mut self, now: Instant) {
        self.pass_to(now);
        self.look_at_prompt();
        if self.facts.state == UnitState::Silent && self.record.received() > 0 {
            self.facts.state = UnitState::Unknown;
        }
        self.signal(Signal::Over);
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// What is known of the unit.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// The job that runs.
    pub fn job(&self) -> Option<Job> {
        self.running.as_ref().map(|running| running.job)
    }

    /// Every byte, both directions.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Since when the unit holds us by XOFF.
    pub fn held_since(&self) -> Option<Instant> {
        self.transmitter.held_since()
    }

    /// Bytes that wait to be sent.
    pub fn waiting(&self) -> usize {
        self.transmitter.waiting()
    }

    /// Whether the unit is asking for the password: what is typed now is secret.
    pub fn password_open(&self) -> bool {
        self.password.is_open()
    }

    /// Whether a file can be sent as it is.
    ///
    /// # Errors
    /// While the unit asks for its password, or holds what waits already.
    pub fn may_send_file(&self) -> Result<(), Refusal> {
        if self.password_open() {
            return Err(Refusal::PasswordOpen);
        }
        if self.held_since().is_some() && self.waiting() > 0 {
            return Err(Refusal::Held);
        }
        Ok(())
    }

    fn keys(&mut self, keys: &[u8]) -> Result<(), Refusal> {
        // A queued job would send its keys after these, and into a question that these may open.
        let busy = self.running.as_ref().filter(|running| running.job != Job::Identify).or(self.queued.as_ref());
        if let Some(busy) = busy {
            return Err(Refusal::Busy(busy.job));
        }
        self.type_in(keys, TypedBy::Hand)?;
        // The next attempt to identify the unit begins with Enter, which would be the answer to the question.
        if self.typing.question().is_some() && self.job() == Some(Job::Identify) {
            self.signal(Signal::Cancel);
        }
        Ok(())
    }

    /// Queues keys; what is typed where the password is asked for is secret.
    fn type_in(&mut self, keys: &[u8], by: TypedBy) -> Result<(), Refusal> {
        // All of them or none: what is refused has not been sent.
        if !self.transmitter.has_room(keys.len()) {
            return Err(Refusal::Held);
        }
        for stroke in self.typing.strokes(keys, by) {
            let secrecy = self.password.secrecy_of(&stroke);
            self.transmitter.push_text(stroke.keys, secrecy, Sender::User);
            self.transmitter.push_text(stroke.enter, Secrecy::Open, Sender::User);
            self.password.typed(&stroke);
        }
        Ok(())
    }

    /// Takes the first part of a backlog, so that a key does not have to wait for a whole flood. The rest has to follow
    /// through [`handle_backlog`](Endpoint::handle_backlog) before any timer is handled.
    pub fn begin_backlog(&mut self, now: Instant, backlog: &[Arrived]) {
        self.now = self.now.max(now);
        for piece in backlog {
            self.dated = piece.at.clamp(self.dated, self.now);
            self.append(&piece.bytes);
        }
    }

    /// Sets the time to `now`, also for dating what is heard.
    fn pass_to(&mut self, now: Instant) {
        self.now = self.now.max(now);
        self.dated = self.now;
    }

    /// Notes what has been sent, since what is printed soon may answer it: a menu that was asked for is not a banner.
    fn note_typed(&mut self, sent: &[u8]) -> Typed {
        if sent.len() <= LONGEST_TYPED {
            self.look_if_due();
            self.cut_answered();
        }
        let typed = self.keys.read(sent);
        self.menu_asked_at = typed.asks_menu().then_some(self.now);
        self.dialogue.sent(self.now, &typed);
        if self.facts.stream.is_some() {
            self.toggled.sent(self.now, &typed);
        }
        typed
    }

    /// Words without a line end, the last thing the unit has printed.
    fn pending(&self) -> Option<Text> {
        let mut text = self.framer.pending().filter(|text| text.text.contains(char::is_alphanumeric))?;
        self.password.scrub(&mut text.text);
        Some(text)
    }

    /// What a job, or a listener beside it, can see and do at this moment.
    fn desk<'a>(&'a mut self, pending: Option<&'a Text>) -> Desk<'a> {
        Desk {
            now: self.now,
            transmitter: &mut self.transmitter,
            facts: &mut self.facts,
            events: &mut self.events,
            pending,
            cut: false,
            understood: false,
            counted: self.counted,
            received: self.record.received(),
            password: &mut self.password,
            typed: Vec::new(),
        }
    }

    /// Tells the running job something, and ends it if it says so.
    fn signal(&mut self, signal: Signal<'_>) {
        let Some(mut running) = self.running.take() else { return };
        let lost = matches!(signal, Signal::LinkLost);
        let before = self.facts.clone();
        let pending = self.pending();
        let last_words = self.transmitter.next_number();
        let mut desk = self.desk(pending.as_ref());
        let outcome = running.work.handle(signal, &mut desk);
        let Desk { cut, typed, understood, .. } = desk;
        if understood && self.counted && matches!(signal, Signal::Heard(_, Message::Text)) {
            self.counted = false;
            self.facts.unrecognised_lines = self.facts.unrecognised_lines.saturating_sub(1);
        }
        if self.facts != before {
            self.events.push_back(Event::FactsChanged);
        }
        // A job types no more than the queue has room for.
        let _ = self.type_in(&typed, TypedBy::File);
        if cut {
            self.cut_answered();
        }
        match outcome {
            Some(outcome) => {
                self.transmitter.withdraw_job(running.first_piece, last_words);
                // Other jobs leave the questions they open. During these two, what has been sent may be the user's.
                if !matches!(running.job, Job::Identify | Job::SendFile) {
                    self.keys.question_over();
                }
                self.events.push_back(Event::Finished(outcome));
                match self.queued.take() {
                    Some(next) if lost => {
                        self.running = Some(next);
                        self.signal(Signal::LinkLost);
                    }
                    Some(next) => self.begin(next),
                    None => {}
                }
            }
            None => self.running = Some(running),
        }
    }

    /// Time has passed for those who listen for pages, and for the running job.
    fn look_after(&mut self) {
        self.watch(Saw::Tick);
        self.signal(Signal::Tick);
    }

    /// No question is open any more, typed or from a job.
    fn question_over(&mut self) {
        self.typing.question_over();
        self.keys.question_over();
    }

    /// Something is sent: what the unit prints from now on is an answer, and not the rest of the text after which it
    /// fell silent. A line that the unit is still printing goes on.
    fn cut_answered(&mut self) {
        if self.framer.pending().is_none_or(|text| self.prompt.has_seen(&text)) {
            self.cut_line();
        }
    }

    /// Drops what the unit has printed without a line end: it stays in the record, and produces no event.
    fn cut_line(&mut self) {
        self.prompt.forget();
        self.framer.cut(|_| {});
    }
}

impl Endpoint for Session {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        self.pass_to(now);
        self.append(bytes);
        self.look_after();
    }

    fn handle_backlog(&mut self, now: Instant, backlog: &[Arrived]) {
        self.begin_backlog(now, backlog);
        self.look_after();
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.pass_to(now);
        if self.password.due().is_some_and(|due| due <= self.now) {
            self.hand_out_echo();
        }
        self.look_if_due();
        self.look_at_stream();
        self.look_after();
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        if self.mode == Mode::Recording {
            return None;
        }
        let transmit = self.transmitter.poll(self.now)?;
        if transmit.secrecy == Secrecy::Open {
            let typed = self.note_typed(&transmit.bytes);
            self.watch(Saw::Typed(&typed));
        } else {
            self.look_if_due();
            self.cut_answered();
        }
        // The record is in order of time: nothing received after this is dated before it.
        self.dated = self.now;
        self.record.push(self.now, Direction::ToUnit, transmit.secrecy, &transmit.bytes);
        Some(transmit)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let job = self.running.as_ref().and_then(|running| running.work.deadline());
        let ours = [
            self.prompt.due,
            self.prompt.line_due(),
            self.password.due(),
            self.toggled.due(),
            self.watching_due(),
            self.transmitter.poll_timeout(),
        ];
        ours.into_iter().chain([job]).flatten().min()
    }
}
