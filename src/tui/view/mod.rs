//! What the screens may read: everything known, folded from the session's events.

use std::path::PathBuf;

mod limits;
mod old;

use super::input::{Failure, Noted, Playing};
use super::returning::Returning;
use super::widgets::format;
use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::dump::Dump;
use crate::monitor::{Mark, Monitor};
use crate::record::LINK_LOST;
use crate::session::{DictionaryReading, Event, Facts, FileEnd, Job, LoadReport, Origin, Outcome, Progress, UnitState};
use crate::time::{Duration, Instant};
use crate::version::Version;

/// Everything a screen may read.
#[derive(Debug, Default)]
pub struct View {
    /// The link.
    pub link: Link,
    /// What is known of the unit.
    pub facts: Facts,
    /// The job that runs.
    pub job: Option<Job>,
    /// What it has shown: stream, faults, diagnostics.
    pub monitor: Monitor,
    /// The file that rows are written to.
    pub export: Option<Export>,
    /// The unit's object dictionary, once it has been read.
    pub dictionary: Option<DictionaryRead>,
    /// Entries read so far while it is being read.
    pub entries_read: usize,
    /// After a lost link has come back: the unit of before, until it is known who is there now.
    pub returning: Option<Returning>,
    /// The serial number of the unit (1018h:4), as its object dictionary had it when that was read last.
    pub serial: Option<u32>,
    /// The upload.
    pub load: Load,
    /// The file that is being sent as it is.
    pub sending: Option<Sending>,
    /// How a recording is played, where the link is one.
    pub playing: Option<Playing>,
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
    /// When the unit said last which CANopen state it is in: it says so on request, and changes it without a word.
    pub nmt_heard: Option<Instant>,
    /// When that has become old enough for another word.
    ages_at: Option<Instant>,
    /// The latest word to the user.
    pub notice: Option<Notice>,
}

/// The link and how it stands.
#[derive(Debug, Default)]
pub struct Link {
    /// What opened it, or was to open it.
    pub name: Option<String>,
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
    /// How it stands.
    pub state: LinkState,
}

/// How a link stands.
#[derive(Debug, Default, PartialEq)]
pub enum LinkState {
    /// No link.
    #[default]
    Closed,
    /// Being opened.
    Opening,
    /// Open.
    Open {
        /// Whether sending is forbidden.
        read_only: bool,
    },
    /// It has ended by itself.
    Lost(Failure),
}

/// The upload.
#[derive(Debug, Default)]
pub struct Load {
    /// Where it stands.
    pub progress: Option<Progress>,
    /// Since when the unit holds us by XOFF.
    pub held_since: Option<Instant>,
    /// How the last one ended, until the user has read it.
    pub report: Option<LoadReport>,
    /// The last one was refused because nobody knew the product.
    pub product_unknown: bool,
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
    /// The unit has started anew since, or is in its loader: it may have other values.
    pub is_outdated: bool,
}

/// Serial number of the identity object (CiA 301; both manuals, section 3.3).
const SERIAL_NUMBER: ObjectAddress = ObjectAddress::new(0x1018, 4);
/// How a recording says that a moment was marked: `mark 1`, or of a moment of before `mark 1, 12.5 s before`.
pub fn marked(number: u64, before: Duration) -> String {
    match before.is_zero() {
        true => format!("{MARK}{number}"),
        false => format!("{MARK}{number}, {} s before", before.as_secs_f64()),
    }
}

/// The number of such a mark, and how long before it was set its moment lies.
fn read_mark(text: &str) -> Option<(u64, Duration)> {
    let rest = text.strip_prefix(MARK)?;
    let (number, before) = rest.split_once(", ").map_or((rest, None), |(number, before)| (number, Some(before)));
    let before = before.map(|before| before.strip_suffix(" s before")?.parse().ok());
    let before = before.map_or(Some(Duration::ZERO), |seconds| Duration::try_from_secs_f64(seconds?).ok())?;
    Some((number.parse().ok()?, before))
}

const MARK: &str = "mark ";

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
}

impl View {
    /// Takes in one event; `facts` are the session's at that moment.
    pub fn fold(&mut self, now: Instant, event: &Event, facts: &Facts) {
        match event {
            Event::Heard { .. } => {}
            Event::Overheard { at, reading } => self.dictionary_overheard(*at, reading),
            Event::EntriesRead(count) => self.entries_read = *count,
            Event::Row { .. } | Event::Page { .. } if self.returning.is_some() => {
                if let Some(returning) = &mut self.returning {
                    returning.wait(event.clone());
                }
            }
            Event::Row { .. } | Event::Page { .. } => {
                let product = self.product();
                self.monitor.fold(event, product);
            }
            Event::FactsChanged => self.facts_changed(now, facts),
            Event::Held(true) => self.load.held_since = Some(now),
            Event::Held(false) => self.load.held_since = None,
            Event::Progress(progress) => {
                self.job = Some(Job::Load);
                self.load.progress = Some(*progress);
            }
            Event::FileProgress { sent, .. } => {
                if let Some(sending) = &mut self.sending {
                    sending.sent = *sent;
                }
            }
            Event::FileHeld { .. } => {
                self.tell(Tone::Bad, "The unit does not let the file go on (XOFF): Esc ends the wait.");
            }
            Event::Finished(outcome) => self.finished(now, outcome),
        }
    }

    /// When [`View::timeout`] is wanted.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.monitor.stream.late_at().filter(|_| self.facts.stream.is_some())
    }

    /// The time is `now`. Says whether anything has changed.
    pub fn timeout(&mut self, now: Instant) -> bool {
        let late = self.poll_timeout().is_some_and(|due| due <= now);
        self.monitor.stream.late |= late;
        late
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

    /// Starts minimum, maximum and mean of every channel anew.
    pub fn restart_extremes(&mut self) {
        self.monitor.stream.restart_extremes();
    }

    /// A remark in a recording: where it is a mark, it is one again. A link that was lost then is lost.
    pub fn remarked(&mut self, at: Instant, text: &str) {
        if text == LINK_LOST {
            self.is_cut_off = true;
            self.monitor.stream.interrupt();
        }
        if let Some((number, before)) = read_mark(text) {
            let at = Instant::ZERO + at.since_start().saturating_sub(before);
            self.monitor.stream.set_mark(Mark { number, at });
        }
    }

    /// A new link: what was known of the unit before says nothing about the one at its end.
    pub fn begin_link(&mut self, link: Link) {
        *self = View { link, ..View::default() };
    }

    /// The lost link is there again; whether the unit is the one from before is not known yet.
    pub fn link_back(&mut self) {
        // A link that is lost again meanwhile changes nothing: the unit of before is still the one that was known.
        if self.returning.is_none() {
            self.returning = Some(Returning::new(self.facts.clone()));
        }
        self.viewing = false;
        self.monitor.stream.interrupt();
    }

    /// The unit on the cable is not the one from before, or may not be: nothing of that one is shown as its own.
    pub fn begin_unit(&mut self) {
        self.monitor = Monitor::default();
        (self.dictionary, self.entries_read, self.serial) = (None, 0, None);
        (self.wanted_period, self.last_period) = (None, None);
        (self.viewing, self.stream_is_off) = (false, false);
        self.load.product_unknown = false;
    }

    /// Whether keys and commands can reach a unit.
    pub fn can_send(&self) -> bool {
        self.link.state == LinkState::Open { read_only: false }
    }

    /// Whether the link is a recording.
    pub fn is_recording(&self) -> bool {
        self.link.state == LinkState::Open { read_only: true }
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
            Job::Diagnostics => Some("the unit prints its diagnostics: S stops them first"),
            Job::Identify => Some("the unit is being asked who it is: wait a moment"),
            Job::ReadDictionary => Some("the object dictionary is being read: Esc on its screen cancels that"),
            Job::Load => Some("new software is being loaded: Esc on its screen cancels that"),
            Job::StreamOn | Job::StreamOff | Job::RestoreDefaults | Job::Overhear => {
                Some("the unit is being told something: wait a moment")
            }
        }
    }

    /// Whether something would stay half done if the link were closed now.
    pub fn is_in_the_middle(&self) -> bool {
        self.has_job_to_end() || self.viewing
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
        self.notice = Some(Notice { tone, text: text.into() });
    }

    fn facts_changed(&mut self, now: Instant, facts: &Facts) {
        let said = |facts: &Facts| facts.nmt_state.as_ref().map(|known| known.span);
        if said(facts) != said(&self.facts) {
            self.nmt_heard = said(facts).map(|_| now);
            self.ages_at = self.nmt_heard.map(|heard| format::ages_at(heard, now));
        }
        if facts.state == UnitState::Application && self.facts.state != UnitState::Application {
            // Whatever sub-menu was open, a restart has closed it.
            self.viewing = false;
        }
        let banner = |facts: &Facts| {
            facts.version.as_ref().filter(|known| known.origin == Origin::Banner).map(|known| known.span)
        };
        let has_started = banner(facts).is_some() && banner(facts) != banner(&self.facts);
        let nobody = |notice: &Notice| notice.text == NOBODY;
        if facts.state != UnitState::Silent && self.notice.as_ref().is_some_and(nobody) {
            self.notice = None;
        }
        let was_loader = self.facts.state == UnitState::Loader && facts.state != UnitState::Loader;
        if has_started || was_loader {
            self.monitor.stream.interrupt();
        }
        match (self.facts.stream, facts.stream) {
            // Who is away, or starts anew, has not been switched off by that.
            (Some(_), None) => {
                let is_away = self.returning.is_some() || has_started || facts.state == UnitState::Loader;
                let is_away = is_away || self.is_cut_off;
                (self.stream_is_off, self.monitor.stream.late) = (!is_away, false);
            }
            (None, None) => {}
            (None, Some(_)) => {
                (self.stream_is_off, self.is_cut_off) = (false, false);
                self.monitor.stream.switched_on(now);
            }
            (Some(_), Some(_)) => {}
        }
        // What was written and not stored is gone, and the defaults or other software bring other values.
        if has_started || was_loader || facts.state == UnitState::Loader {
            self.outdate_dictionary();
        }
        if self.job == Some(Job::StreamOn) && facts.stream.is_some() && self.facts.stream.is_none() {
            self.monitor.stream.set_period(self.wanted_period);
        }
        let product_before = self.product();
        self.facts = facts.clone();
        let product = self.product();
        // While it is asked who is there, the dictionary is history and stays as it was.
        if product_before != product
            && self.returning.is_none()
            && let Some(read) = &mut self.dictionary
        {
            // What was read gets its names, and something to be compared with.
            read.dump = Dump::of(&read.reading, product, &self.facts);
        }
    }

    fn finished(&mut self, now: Instant, outcome: &Outcome) {
        self.job = None;
        match outcome {
            Outcome::Done(Job::RestoreDefaults) => {
                self.outdate_dictionary();
                self.tell(Tone::Good, done(Job::RestoreDefaults));
            }
            Outcome::DictionaryRead(reading) => {
                // Its view was left again.
                self.viewing = false;
                self.monitor.stream.interrupt();
                self.dictionary_read(now, reading);
            }
            Outcome::Identified => self.identified(),
            // The end of a recording is told by whoever has read it, with its reason.
            Outcome::Done(Job::Overhear) => {}
            Outcome::StreamRuns { was_on } => {
                let period = self.wanted_period.take();
                self.last_period = period.or(self.last_period);
                self.monitor.stream.set_period(period);
                let text = match was_on {
                    true => "The stream was on already and now sends what you asked for.",
                    false => done(Job::StreamOn),
                };
                self.tell(Tone::Good, text);
            }
            Outcome::Done(job) => {
                if matches!(job, Job::StreamOff | Job::RestoreDefaults) {
                    self.monitor.stream.set_period(None);
                }
                self.stream_is_off |= *job == Job::StreamOff;
                self.tell(Tone::Good, done(*job));
            }
            Outcome::NoAnswer { awaited, .. } => self.tell(Tone::Bad, format!("No answer: {awaited}.")),
            Outcome::Refused { job, reason, .. } => {
                self.tell(Tone::Bad, format!("The unit refused, {}: {reason}", job.doing()));
            }
            Outcome::Cancelled(Job::StreamOn) if self.facts.stream.is_some() => {
                self.tell(Tone::Quiet, "The stream is switched on; its first row has not come yet.");
            }
            Outcome::Cancelled(job) if matches!(self.link.state, LinkState::Lost(_)) => {
                self.tell(Tone::Bad, format!("The link was lost, {}.", job.doing()));
            }
            Outcome::Cancelled(Job::Diagnostics) => self.tell(Tone::Quiet, done(Job::Diagnostics)),
            Outcome::Cancelled(job) => self.tell(Tone::Quiet, format!("Cancelled, {}.", job.doing())),
            Outcome::FileSent { sent, total, end } => self.file_sent(*sent, *total, *end),
            Outcome::Loaded(report) => {
                self.load.progress = None;
                self.load.held_since = None;
                self.load.product_unknown =
                    report.verdict == crate::session::Verdict::Refused && report.product.is_none();
                self.load.report = Some((**report).clone());
            }
        }
    }

    fn file_sent(&mut self, sent: usize, total: usize, end: FileEnd) {
        let name = self.sending.take().map_or_else(|| "the file".to_owned(), |sending| sending.name);
        let (sent, total) = (format::grouped(sent), format::grouped(total));
        match end {
            FileEnd::Whole => self.tell(Tone::Good, format!("Sent: all {total} bytes of {name} have left.")),
            FileEnd::Cancelled => {
                self.tell(Tone::Bad, format!("Cancelled after {sent} of the {total} bytes of {name}."));
            }
            FileEnd::LinkLost => {
                let text = format!("The link was lost when about {sent} of the {total} bytes of {name} had left.");
                self.tell(Tone::Bad, text);
            }
        }
    }

    /// In a recording: what was broken off later does not undo what was read to its end.
    fn dictionary_overheard(&mut self, at: Instant, reading: &DictionaryReading) {
        match self.current_dictionary() {
            Some(read) if read.reading.complete && !reading.complete => {
                self.tell(Tone::Bad, "The object dictionary was read once more, not to its end.");
            }
            _ => self.dictionary_read(at, reading),
        }
    }

    fn dictionary_read(&mut self, now: Instant, reading: &DictionaryReading) {
        let dump = Dump::of(reading, self.product(), &self.facts);
        let (entries, deviations) = (dump.entries.len(), dump.deviations());
        if dump.complete {
            let compared = match self.product() {
                Some(_) => format!("{deviations} not as the factory's"),
                None => "compared with nothing, as the product is not known".into(),
            };
            self.tell(Tone::Good, format!("The dictionary is read: {entries} entries, {compared}."));
        } else {
            let text = format!("Not all of the object dictionary was shown: {entries} entries were read.");
            self.tell(Tone::Bad, text);
        }
        let serial = reading.entries.iter().find(|read| read.at == SERIAL_NUMBER).and_then(|read| read.value);
        self.serial = serial.and_then(Value::as_integer).and_then(|number| u32::try_from(number).ok());
        self.dictionary = Some(DictionaryRead { dump, reading: reading.clone(), at: now, is_outdated: false });
    }

    /// The unit has other values now than those that were read.
    fn outdate_dictionary(&mut self) {
        if let Some(read) = &mut self.dictionary {
            read.is_outdated = true;
        }
    }

    /// What was read of the unit's object dictionary, as long as it can be what the unit has.
    pub fn current_dictionary(&self) -> Option<&DictionaryRead> {
        self.dictionary.as_ref().filter(|read| !read.is_outdated)
    }

    fn identified(&mut self) {
        let version = self.facts.version.as_ref().map(|known| format!(" {}", known.value)).unwrap_or_default();
        match (self.facts.state, &self.facts.product) {
            (UnitState::Silent, _) => self.tell(Tone::Bad, NOBODY),
            (UnitState::Loader, _) => {
                let which =
                    self.noted().map_or_else(String::new, |noted| format!(", an {} by our notes,", noted.product));
                self.tell(Tone::Quiet, format!("The unit{which} waits in its loader: L loads a file."));
            }
            (UnitState::Unknown | UnitState::Application, Some(product)) => {
                let text = format!("The unit is an {}{version}.", product.value);
                self.tell(Tone::Good, text);
            }
            (UnitState::Unknown | UnitState::Application, None) => {
                let text = "The unit talks, but does not say what it is: V reads that, a power cycle shows it.";
                self.tell(Tone::Quiet, text);
            }
        }
    }
}

/// What is told of a unit that says nothing, until it says something.
const NOBODY: &str = "Nobody has answered: check power, cable and port.";

fn done(job: Job) -> &'static str {
    match job {
        Job::Identify => "The unit has answered.",
        Job::StreamOn => "The stream is on, also after a power cycle, until T switches it off.",
        Job::StreamOff => "The stream is off.",
        Job::RestoreDefaults => "The defaults are restored and the unit has restarted.",
        Job::ReadDictionary => "The object dictionary has been read.",
        Job::Diagnostics => "The diagnostics are off.",
        Job::Overhear => "This is the end of the recording. 3 shows all of it.",
        Job::Load => "The upload has ended.",
        Job::SendFile => "The file has been sent.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Span;
    use crate::session::Known;
    use crate::wire::stream::{Reading, Row, Source};

    fn row(view: &mut View, millis: u64, readings: [Reading; 5]) {
        let at = Instant::from_millis(millis);
        let row = Row { source: Source::FieldValue, readings: readings.to_vec() };
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
        assert!(!view.monitor.stream.late);
    }

    #[test]
    fn a_mark_is_read_as_it_was_written() {
        for millis in [0, 1, 12_345, 86_400_000] {
            let before = Duration::from_millis(millis);
            assert_eq!(read_mark(&marked(7, before)), Some((7, before)));
        }
        for other in ["mark", "mark x", "mark 1, 5 s", "mark 1, -5 s before", "marked 1", "break sent"] {
            assert_eq!(read_mark(other), None, "{other}");
        }
    }

    #[test]
    fn a_state_that_was_heard_ages_until_it_is_heard_again() {
        let mut view = View::default();
        view.link.state = LinkState::Open { read_only: false };
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
        assert_eq!(view.nmt_heard, Some(Instant::from_millis(20_000)), "the same word anew");
        view.fold(Instant::from_millis(21_000), &Event::FactsChanged, &said(50));
        assert_eq!(view.nmt_heard, Some(Instant::from_millis(20_000)), "something else has changed");
        view.link.state = LinkState::Open { read_only: true };
        assert_eq!(view.ages_at(), None, "a recording does not age");
    }
}
