//! What the screens may read: everything known, folded from the session's events.

use std::path::PathBuf;

mod fold;
mod limits;
mod mark;
mod old;

pub use mark::marked;

use super::input::{Failure, LinkKind, Noted, Playing};
use super::returning::Returning;
use super::widgets::format;
use crate::device::Product;
use crate::dump::Dump;
use crate::monitor::Monitor;
use crate::session::{DictionaryReading, Facts, Job, LoadReport, Phase, Progress, SILENT, UnitState};
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::MenuKey;

/// How long no other news takes the place of a refusal.
const REFUSAL_STAYS: Duration = Duration::from_secs(4);

/// Everything a screen may read.
#[derive(Debug, Default)]
pub struct View {
    /// The link.
    pub link: Link,
    /// What the unit has shown, and what it was told.
    pub unit: UnitView,
    /// What is known of the unit.
    pub facts: Facts,
    /// The job that runs.
    pub job: Option<Job>,
    /// The job has been told to end, and is on its way to that.
    pub is_ending: bool,
    /// The file that rows are written to.
    pub export: Option<Export>,
    /// After a lost link has come back: the unit of before, until it is known who is there now.
    pub returning: Option<Returning>,
    /// The upload.
    pub load: Load,
    /// How a recording is played, where the link is one.
    pub playing: Option<Playing>,
    /// The key that was typed on the terminal and whose question is still open: the unit takes the next key for an answer.
    pub question: Option<MenuKey>,
    /// When the unit said last which CANopen state it is in: it says so on request, and changes it without a word.
    pub nmt_heard: Option<Instant>,
    /// When that has become old enough for another word.
    ages_at: Option<Instant>,
    /// When the unit's last byte came.
    heard_at: Option<Instant>,
    /// The latest word to the user.
    pub notice: Option<Notice>,
    /// News that has to wait for it.
    next_notice: Option<Notice>,
    /// The time.
    pub now: Instant,
}

/// What the unit at hand has shown, and what it was told: none of it is true of another one.
#[derive(Debug, Default)]
pub struct UnitView {
    /// Stream, faults, diagnostics.
    pub monitor: Monitor,
    /// The unit's object dictionary, once it has been read.
    pub dictionary: Option<DictionaryRead>,
    /// Entries read so far while it is being read.
    pub entries_read: usize,
    /// The serial number of the unit (1018h:4), as its object dictionary had it when that was read last.
    pub serial: Option<u32>,
    /// The file that is being sent as it is.
    pub sending: Option<Sending>,
    /// The stream was seen to be switched off. Without that, silence may be a long repetition time.
    pub stream_is_off: bool,
    /// In a recording: the link was lost, and no row has come since.
    is_cut_off: bool,
    /// The repetition time that the stream was asked for and has not confirmed yet.
    pub wanted_period: Option<Duration>,
    /// The repetition time that the stream was last switched on with, also once it is off.
    pub last_period: Option<Duration>,
    /// The unit's view sub-menu is open, as far as our keys tell: scanning and CAN are halted.
    pub viewing: bool,
}

/// The link and its state.
#[derive(Debug, Default)]
pub struct Link {
    /// What opened it, or was to open it.
    pub name: Option<String>,
    /// What is at its other end.
    pub kind: LinkKind,
    /// Baud rate.
    pub baud: u32,
    /// Where the recording is written.
    pub recording: Option<String>,
    /// An upload on it that has not ended well.
    pub noted: Option<Noted>,
    /// Why a recording that is played has ended before its end.
    pub defect: Option<String>,
    /// Why nothing is recorded any more, where that was not wanted.
    pub unrecorded: Option<String>,
    /// The start of time, in milliseconds since 1970, UTC.
    pub start_millis: i64,
    /// Its state.
    pub state: LinkState,
}

/// The state of a link.
#[derive(Debug, Default, PartialEq)]
pub enum LinkState {
    /// No link.
    #[default]
    Closed,
    /// Being opened.
    Opening,
    /// Open.
    Open,
    /// It has ended by itself.
    Lost(Failure),
}

/// The upload.
#[derive(Debug, Default)]
pub struct Load {
    /// Where it is.
    pub progress: Option<Progress>,
    /// Since when the unit holds us by XOFF.
    pub held_since: Option<Instant>,
    /// How the last one ended, until the user has read it.
    pub report: Option<LoadReport>,
    /// The last one was refused because nobody knew the product.
    pub product_unknown: bool,
    /// The report is of the unit that was on the cable before the one there now.
    pub is_of_earlier_unit: bool,
    /// The unit has fallen silent in it: it is in its loader, or without power.
    pub is_silent: bool,
}

/// A file that is being sent as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Sending {
    /// Its name.
    pub name: String,
    /// Bytes that have left.
    pub sent: usize,
    /// Bytes of it.
    pub total: usize,
}

/// The object dictionary as the unit showed it.
#[derive(Debug)]
pub struct DictionaryRead {
    /// What was read, with its meaning.
    pub dump: Dump,
    /// What was read.
    pub reading: DictionaryReading,
    /// When it was complete, or its last entry came.
    pub at: Instant,
    /// The unit has restarted since, or is in its loader: it may have other values.
    pub is_outdated: bool,
}

/// A file that rows are written to as they come.
#[derive(Debug)]
pub struct Export {
    /// Which.
    pub path: PathBuf,
    /// Rows written so far.
    pub rows: u64,
    /// The channels it has columns for.
    pub channels: Vec<String>,
}

/// A word to the user, shown until the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct Notice {
    /// How much it matters.
    pub tone: Tone,
    /// What it says.
    pub text: String,
    /// Until when no news takes its place: it answers a key, and the user has to have read it.
    until: Option<Instant>,
    /// What makes it untrue.
    refuted_by: Option<Refutation>,
}

/// What makes a word untrue: a user who read both would not know which to believe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Refutation {
    /// The unit says something.
    Answer,
    /// The unit says its name.
    Product,
    /// A page of diagnostics comes.
    Page,
    /// The stream is on.
    Stream,
}

/// How much a word matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Good to know.
    Quiet,
    /// It has worked.
    Good,
    /// It has not.
    Bad,
    /// What a key asks for is not done. Stays for a while, as an answer that has to be read.
    Refused,
}

impl View {
    /// Bytes of the unit have come.
    pub fn heard(&mut self, now: Instant) {
        self.heard_at = Some(now);
        self.load.is_silent = false;
    }

    /// Whether nothing has come from the unit for longer than a loader that takes a file is silent.
    fn is_silent_since(&self, now: Instant) -> bool {
        self.heard_at.is_none_or(|heard| now.since(heard) >= SILENT)
    }

    /// The time is `now` while an upload runs: a loader that erases or holds us says nothing meanwhile, and says so first.
    pub fn look_for_silence(&mut self, now: Instant) {
        let sends = self.load.progress.is_some_and(|at| at.phase == Phase::Transfer && at.records > 1);
        self.load.is_silent = sends && self.load.held_since.is_none() && self.is_silent_since(now);
    }

    /// When [`View::timeout`] is wanted.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.unit.monitor.stream.late_at().filter(|_| self.facts.stream.is_some())
    }

    /// The time is `now`. Says whether anything has changed.
    pub fn timeout(&mut self, now: Instant) -> bool {
        let is_read = self.next_notice_at().is_some_and(|due| due <= now);
        if is_read {
            self.read_notice();
        }
        let late = self.poll_timeout().is_some_and(|due| due <= now);
        self.unit.monitor.stream.late |= late;
        late || is_read
    }

    /// Whether something that is known for a while is to be called older.
    pub fn aged(&mut self, now: Instant) -> bool {
        let aged = self.ages_at.is_some_and(|due| due <= now);
        if aged {
            self.ages_at = self.nmt_heard.map(|heard| format::ages_at(heard, now));
        }
        aged
    }

    /// When what is known for a while is to be called older: only for a screen that says so, and while it is about a unit.
    pub fn ages_at(&self) -> Option<Instant> {
        self.ages_at.filter(|_| self.can_send())
    }

    /// Restarts minimum, maximum and mean of every channel.
    pub fn restart_extremes(&mut self) {
        self.unit.monitor.stream.restart_extremes();
    }

    /// A new link: what was known of the unit before says nothing about the one at its end.
    pub fn begin_link(&mut self, link: Link) {
        *self = View { link, now: self.now, ..View::default() };
    }

    /// The lost link is there again; whether the unit is the one from before is not known yet.
    pub fn link_back(&mut self) {
        // A link that is lost again meanwhile changes nothing: the unit of before is still the one that was known.
        if self.returning.is_none() {
            self.returning = Some(Returning::new(self.facts.clone()));
        }
        self.unit.viewing = false;
        self.unit.monitor.stream.interrupt();
    }

    /// The unit on the cable is not the one from before, or may not be: nothing of that one is shown as its own.
    pub fn begin_unit(&mut self) {
        self.unit = UnitView::default();
        self.load.product_unknown = false;
        self.load.is_of_earlier_unit = self.load.report.is_some();
    }

    /// Whether keys and commands can reach a unit.
    pub fn can_send(&self) -> bool {
        self.link.state == LinkState::Open && self.link.kind != LinkKind::Recording
    }

    /// Whether the link is a recording.
    pub fn is_recording(&self) -> bool {
        self.link.state == LinkState::Open && self.link.kind == LinkKind::Recording
    }

    /// The product of the unit that this program emulates at the other end, if it does.
    pub fn emulated(&self) -> Option<&'static Product> {
        match self.link.kind {
            LinkKind::Emulated(product) => Some(product),
            LinkKind::Unit | LinkKind::Recording => None,
        }
    }

    /// Whether a job runs that has to be ended before the unit is left alone. Being asked who it is, or listened to,
    /// leaves a unit as it was.
    pub fn has_job_to_end(&self) -> bool {
        self.job.is_some_and(|job| !matches!(job, Job::Identify | Job::Overhear)) && !self.awaits_first_row()
    }

    /// Whether the stream is switched on and all that is left to do is to wait for its first row, for minutes perhaps.
    pub fn awaits_first_row(&self) -> bool {
        self.job == Some(Job::StreamOn) && self.facts.stream.is_some()
    }

    /// Why the unit takes no other job now, and what ends the one it has.
    pub fn busy(&self) -> Option<&'static str> {
        match self.job.filter(|_| !self.awaits_first_row())? {
            Job::SendFile => Some("a file is being sent: Esc on the terminal screen stops it"),
            Job::Diagnostics if self.is_ending => Some("the diagnostics are being stopped: wait a moment"),
            Job::Diagnostics => Some("the unit prints its diagnostics: S stops them first"),
            Job::Identify => Some("the unit is being asked who it is: wait a moment"),
            Job::ReadDictionary => Some("the object dictionary is being read: Esc on its screen cancels that"),
            Job::Load => Some("new software is being loaded: Esc on its screen cancels that"),
            Job::StreamOn | Job::StreamOff | Job::RestoreDefaults | Job::Overhear => {
                Some("the unit is being given an order: wait a moment")
            }
        }
    }

    /// Whether something would stay half done if the link were closed now.
    pub fn is_in_the_middle(&self) -> bool {
        self.has_job_to_end() || self.unit.viewing || self.question.is_some()
    }

    /// Whether the unit at the line waits in its loader for a file.
    pub fn waits_in_loader(&self) -> bool {
        self.can_send() && self.facts.state == UnitState::Loader
    }

    /// Whether something would stay half done, or has been left so, and a user who leaves now should know.
    pub fn would_be_left(&self) -> bool {
        self.is_in_the_middle() || self.waits_in_loader()
    }

    /// The product, where it is one we know.
    pub fn product(&self) -> Option<&'static Product> {
        self.facts.product.as_ref().and_then(|known| Product::named(&known.value))
    }

    /// Whether the user has to say what the unit is, because nobody else can.
    pub fn needs_label(&self) -> bool {
        let is_mute = self.facts.state == UnitState::Loader || self.load.product_unknown;
        self.facts.product.is_none() && is_mute && self.noted().is_none()
    }

    /// The note of an upload, where it is all there is to know the unit by: what the unit says itself goes first.
    pub fn noted(&self) -> Option<&Noted> {
        let is_mute = self.facts.product.is_none() && self.facts.state != UnitState::Application;
        self.link.noted.as_ref().filter(|_| is_mute)
    }

    /// The software the unit runs, or ran before the upload that was left in the middle.
    pub fn ran(&self) -> Option<Version> {
        let said = self.facts.version.as_ref().map(|known| known.value);
        let product = self.facts.product.as_ref().map(|known| known.value.as_str());
        let is_of_unit = |noted: &&Noted| product.is_none_or(|product| noted.product.eq_ignore_ascii_case(product));
        let noted = self.link.noted.as_ref().filter(|_| self.facts.state != UnitState::Application);
        said.or_else(|| noted.filter(is_of_unit)?.ran)
    }

    /// Says something to the user.
    pub fn tell(&mut self, tone: Tone, text: impl Into<String>) {
        self.notify(tone, text.into(), None);
    }

    /// Says something that is true until this happens.
    fn tell_until(&mut self, refuted_by: Refutation, tone: Tone, text: impl Into<String>) {
        self.notify(tone, text.into(), Some(refuted_by));
    }

    fn notify(&mut self, tone: Tone, text: String, refuted_by: Option<Refutation>) {
        let is_refusal = tone == Tone::Refused;
        let until = is_refusal.then(|| self.now + REFUSAL_STAYS);
        let notice = Some(Notice { tone, text, until, refuted_by });
        let is_kept = |before: &Notice| before.until.is_some_and(|until| until > self.now);
        match self.notice.as_ref().is_some_and(is_kept) && !is_refusal {
            true => self.next_notice = notice,
            false => (self.notice, self.next_notice) = (notice, None),
        }
    }

    /// The user goes on: nothing of the last word has to stay.
    pub fn read_notice(&mut self) {
        if let Some(notice) = &mut self.notice {
            notice.until = None;
        }
        if let Some(next) = self.next_notice.take() {
            self.notice = Some(next);
        }
    }

    /// The last word was about something else.
    pub fn forget_notice(&mut self) {
        (self.notice, self.next_notice) = (None, None);
    }

    /// When news that waits takes the place of a refusal.
    pub fn next_notice_at(&self) -> Option<Instant> {
        let until = self.notice.as_ref().map_or(Some(self.now), |notice| notice.until);
        until.filter(|_| self.next_notice.is_some())
    }

    /// What was read of the unit's object dictionary, as long as it can be what the unit has.
    pub fn current_dictionary(&self) -> Option<&DictionaryRead> {
        self.unit.dictionary.as_ref().filter(|read| !read.is_outdated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Span;
    use crate::session::{Event, Known, Origin};
    use crate::wire::stream::{Reading, Row, Source};

    fn row(view: &mut View, millis: u64, readings: [Reading; 5]) {
        let at = Instant::from_millis(millis);
        let row = Row { source: Source::FieldValue, decimals: 3, readings: readings.to_vec() };
        view.fold(at, &Event::Row { at, span: Span::default(), row }, &Facts::default());
    }

    fn with_first(reading: Reading) -> [Reading; 5] {
        [reading, Reading::Value(1.0), Reading::Value(1.0), Reading::Disabled, Reading::Value(1.0)]
    }

    #[test]
    fn a_stream_is_late_after_three_of_its_periods_and_nothing_ticks_before() {
        let mut view = View::default();
        for number in 0..10 {
            row(&mut view, 5000 * number, with_first(Reading::Value(20.0)));
        }
        assert_eq!(view.poll_timeout(), None, "no stream is known to be on");
        let facts = Facts { stream: Some(Source::FieldValue), ..Facts::default() };
        view.fold(Instant::from_millis(45_000), &Event::FactsChanged, &facts);
        assert_eq!(view.poll_timeout(), Some(Instant::from_millis(60_000)));
        assert!(!view.timeout(Instant::from_millis(59_999)));
        assert!(view.timeout(Instant::from_millis(60_000)));
        assert_eq!(view.poll_timeout(), None, "it cannot get later than late");
        row(&mut view, 61_000, with_first(Reading::Value(20.0)));
        assert!(!view.unit.monitor.stream.late);
    }

    #[test]
    fn a_state_that_was_heard_ages_until_it_is_heard_again() {
        let mut view = View::default();
        view.link.state = LinkState::Open;
        let said = |start| {
            let known = Known { value: "stopped".into(), origin: Origin::Menu, span: Span { start, end: start + 9 } };
            Facts { nmt_state: Some(known), ..Facts::default() }
        };
        view.fold(Instant::from_millis(5000), &Event::FactsChanged, &said(0));
        assert_eq!(view.ages_at(), Some(Instant::from_millis(15_000)));
        assert!(!view.aged(Instant::from_millis(14_999)));
        assert!(view.aged(Instant::from_millis(15_000)));
        assert_eq!(view.ages_at(), Some(Instant::from_millis(25_000)));
        view.fold(Instant::from_millis(20_000), &Event::FactsChanged, &said(50));
        assert_eq!(view.nmt_heard, Some(Instant::from_millis(20_000)), "the same word again");
        view.fold(Instant::from_millis(21_000), &Event::FactsChanged, &said(50));
        assert_eq!(view.nmt_heard, Some(Instant::from_millis(20_000)), "something else has changed");
        view.link.kind = LinkKind::Recording;
        assert_eq!(view.ages_at(), None, "a recording does not age");
    }
}
