//! What the screens may read: everything known, folded from the session's events.

use std::collections::VecDeque;

use super::input::Failure;
use crate::device::Product;
use crate::session::{Event, Facts, Job, LoadReport, Outcome, Progress, UnitState};
use crate::time::{Duration, Instant};
use crate::wire::stream::{Layout, Reading, Row, Source};

/// Samples kept of each channel: an hour at one row a second, and more than a wide screen can show.
pub const KEPT_SAMPLES: usize = 3600;
/// Faults kept, the newest first.
pub const KEPT_FAULTS: usize = 200;

/// A stream is late after this many of its periods without a row ...
const LATE_PERIODS: u32 = 3;
/// ... but not before this time: a busy unit may swallow a row or two.
const LATE_AT_LEAST: Duration = Duration::from_secs(2);

/// Everything a screen may read.
#[derive(Debug, Default)]
pub struct View {
    /// The link.
    pub link: Link,
    /// What is known of the unit.
    pub facts: Facts,
    /// The job that runs.
    pub job: Option<Job>,
    /// The data stream.
    pub stream: Stream,
    /// Faults seen since connecting, newest first.
    pub faults: VecDeque<Fault>,
    /// The upload.
    pub load: Load,
    /// The unit's view sub-menu is open, as far as our keys tell: scanning and CAN are halted.
    pub viewing: bool,
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

/// The data stream.
#[derive(Debug, Default)]
pub struct Stream {
    /// What the newest row carries.
    pub source: Option<Source>,
    /// The channels, in the row's order.
    pub channels: Vec<Channel>,
    /// Rows since the channels began.
    pub rows: u64,
    /// When the newest row came.
    pub newest: Option<Instant>,
    /// Time between rows, smoothed.
    pub period: Option<Duration>,
    /// No row for longer than the stream's period explains.
    pub late: bool,
}

/// One channel of the stream.
#[derive(Debug)]
pub struct Channel {
    /// Its name, `TC1`.
    pub name: String,
    /// The newest reading.
    pub reading: Reading,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// The newest samples, oldest first; no value where the channel had none.
    pub history: VecDeque<(Instant, Option<f64>)>,
}

/// A wiring fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The channel's name.
    pub channel: String,
    /// Open or short circuit.
    pub kind: FaultKind,
    /// First row that showed it.
    pub since: Instant,
    /// First row that did not.
    pub until: Option<Instant>,
}

/// What is wrong with a sensor's circuit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// Open circuit.
    Open,
    /// Short circuit.
    Short,
    /// The unit has no value for another reason.
    Failed,
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
            Event::Heard { .. } | Event::Page { .. } | Event::EntriesRead(_) => {}
            Event::Row { at, row, .. } => self.row(*at, row),
            Event::FactsChanged => self.facts_changed(facts),
            Event::Held(true) => self.load.held_since = Some(now),
            Event::Held(false) => self.load.held_since = None,
            Event::Progress(progress) => {
                self.job = Some(Job::Load);
                self.load.progress = Some(*progress);
            }
            Event::Finished(outcome) => self.finished(outcome),
        }
    }

    /// A new link: what was known of the unit before says nothing about the one at its end.
    pub fn begin_link(&mut self, link: Link) {
        *self = View { link, ..View::default() };
    }

    /// When [`View::timeout`] is wanted.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let newest = self.stream.newest.filter(|_| !self.stream.late && self.facts.stream.is_some())?;
        Some(newest + (self.stream.period.unwrap_or_default() * LATE_PERIODS).max(LATE_AT_LEAST))
    }

    /// The time is `now`. Says whether anything has changed.
    pub fn timeout(&mut self, now: Instant) -> bool {
        let late = self.poll_timeout().is_some_and(|due| due <= now);
        self.stream.late |= late;
        late
    }

    /// Whether keys and commands can reach a unit.
    pub fn can_send(&self) -> bool {
        self.link.state == LinkState::Open { read_only: false }
    }

    /// The product, where it is one we know.
    pub fn product(&self) -> Option<&'static Product> {
        self.facts.product.as_ref().and_then(|known| Product::named(&known.value))
    }

    /// Whether the user has to say what the unit is, because nobody else can.
    pub fn needs_label(&self) -> bool {
        self.facts.product.is_none() && (self.facts.state == UnitState::Loader || self.load.product_unknown)
    }

    /// Says something to the user.
    pub fn tell(&mut self, tone: Tone, text: impl Into<String>) {
        self.notice = Some(Notice { tone, text: text.into() });
    }

    /// Starts minimum and maximum of every channel anew.
    pub fn restart_extremes(&mut self) {
        for channel in &mut self.stream.channels {
            let value = value_of(channel.reading);
            (channel.min, channel.max) = (value, value);
        }
    }

    fn row(&mut self, at: Instant, row: &Row) {
        let names = self.channel_names(row.readings.len());
        let stream = &mut self.stream;
        let same =
            stream.source == Some(row.source) && stream.channels.iter().map(|channel| &channel.name).eq(names.iter());
        if !same {
            *stream = Stream { source: Some(row.source), ..Stream::default() };
            stream.channels = names.into_iter().map(Channel::new).collect();
        }
        if let Some(before) = stream.newest {
            let gap = at.since(before);
            // A new setting shows at once, jitter hardly.
            stream.period = Some(match stream.period {
                Some(period) if gap < period * 2 && gap * 2 > period => (period * 7 + gap) / 8,
                _ => gap,
            });
        }
        stream.newest = Some(at);
        stream.rows += 1;
        stream.late = false;
        for (channel, &reading) in stream.channels.iter_mut().zip(&row.readings) {
            channel.read(at, reading);
            let fault = match reading {
                Reading::Open => Some(FaultKind::Open),
                Reading::Short => Some(FaultKind::Short),
                Reading::Error => Some(FaultKind::Failed),
                Reading::Value(_) | Reading::Disabled => None,
            };
            note_fault(&mut self.faults, &channel.name, fault, at);
        }
    }

    fn facts_changed(&mut self, facts: &Facts) {
        if facts.stream.is_none() {
            self.stream.late = false;
        }
        if facts.state == UnitState::Application && self.facts.state != UnitState::Application {
            // Whatever sub-menu was open, a restart has closed it.
            self.viewing = false;
        }
        self.facts = facts.clone();
    }

    fn finished(&mut self, outcome: &Outcome) {
        self.job = None;
        match outcome {
            Outcome::DictionaryRead(_) => self.tell(Tone::Good, done(Job::ReadDictionary)),
            Outcome::Identified => self.identified(),
            Outcome::StreamRuns { was_on: true } => {
                self.tell(Tone::Good, "The stream was on already and now sends what you asked for.");
            }
            Outcome::StreamRuns { was_on: false } => self.tell(Tone::Good, done(Job::StreamOn)),
            Outcome::Done(job) => self.tell(Tone::Good, done(*job)),
            Outcome::NoAnswer { job, awaited, .. } => {
                self.tell(Tone::Bad, format!("No answer: waited for {awaited}, {}.", doing(*job)));
            }
            Outcome::Refused { job, reason, .. } => {
                self.tell(Tone::Bad, format!("The unit refused, {}: {reason}", doing(*job)));
            }
            Outcome::Cancelled(job) => self.tell(Tone::Quiet, format!("Cancelled, {}.", doing(*job))),
            Outcome::Loaded(report) => {
                self.load.progress = None;
                self.load.held_since = None;
                self.load.product_unknown =
                    report.verdict == crate::session::Verdict::Refused && report.product.is_none();
                self.load.report = Some((**report).clone());
            }
        }
    }

    fn identified(&mut self) {
        let version = self.facts.version.as_ref().map(|known| format!(" {}", known.value)).unwrap_or_default();
        match (self.facts.state, &self.facts.product) {
            (UnitState::Silent, _) => self.tell(Tone::Bad, "Nobody has answered: check power, cable and port."),
            (UnitState::Loader, _) => self.tell(Tone::Quiet, "The unit waits in its loader for a file: L loads one."),
            (UnitState::Unknown | UnitState::Application, Some(product)) => {
                let text = format!("The unit is an {}{version}.", product.value);
                self.tell(Tone::Good, text);
            }
            (UnitState::Unknown | UnitState::Application, None) => {
                self.tell(Tone::Quiet, "The unit talks, but has not said what it is; after a power cycle it does.");
            }
        }
    }

    /// Names from the product's file; a unit that has not said what it is gives them away by their number.
    fn channel_names(&self, count: usize) -> Vec<String> {
        let fits = |layout: &&Layout| layout.channels.len() == count;
        let known = self.product().map(|product| &product.stream).filter(fits);
        let likely = || Product::all().iter().map(|product| &product.stream).find(fits);
        match known.or_else(likely) {
            Some(layout) => layout.channels.clone(),
            None => (1..=count).map(|number| format!("#{number}")).collect(),
        }
    }
}

impl Channel {
    fn new(name: String) -> Self {
        Channel { name, reading: Reading::Disabled, min: None, max: None, history: VecDeque::new() }
    }

    fn read(&mut self, at: Instant, reading: Reading) {
        let value = value_of(reading);
        self.reading = reading;
        if let Some(value) = value {
            self.min = Some(self.min.map_or(value, |min| min.min(value)));
            self.max = Some(self.max.map_or(value, |max| max.max(value)));
        }
        self.history.push_back((at, value));
        if self.history.len() > KEPT_SAMPLES {
            self.history.pop_front();
        }
    }
}

/// What a job was about, to follow "No answer: waited for ...,".
pub fn doing(job: Job) -> &'static str {
    match job {
        Job::Identify => "asking who is there",
        Job::StreamOn => "switching the stream on",
        Job::StreamOff => "switching the stream off",
        Job::RestoreDefaults => "restoring the defaults",
        Job::ReadDictionary => "reading the object dictionary",
        Job::Diagnostics => "reading the diagnostics",
        Job::Load => "loading new software",
    }
}

fn done(job: Job) -> &'static str {
    match job {
        Job::Identify => "The unit has answered.",
        Job::StreamOn => "The stream is on, also after a power cycle, until T switches it off.",
        Job::StreamOff => "The stream is off.",
        Job::RestoreDefaults => "The defaults are restored and the unit has restarted.",
        Job::ReadDictionary => "The object dictionary has been read.",
        Job::Diagnostics => "The diagnostics are off.",
        Job::Load => "The upload has ended.",
    }
}

fn value_of(reading: Reading) -> Option<f64> {
    match reading {
        Reading::Value(value) => Some(value),
        Reading::Disabled | Reading::Open | Reading::Short | Reading::Error => None,
    }
}

fn note_fault(faults: &mut VecDeque<Fault>, channel: &str, seen: Option<FaultKind>, at: Instant) {
    let open = faults.iter_mut().find(|fault| fault.until.is_none() && fault.channel == channel);
    if open.as_ref().map(|fault| fault.kind) == seen {
        return;
    }
    if let Some(fault) = open {
        fault.until = Some(at);
    }
    if let Some(kind) = seen {
        faults.push_front(Fault { channel: channel.to_owned(), kind, since: at, until: None });
        faults.truncate(KEPT_FAULTS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(view: &mut View, millis: u64, readings: [Reading; 5]) {
        let at = Instant::from_millis(millis);
        let row = Row { source: Source::FieldValue, readings: readings.to_vec() };
        view.fold(at, &Event::Row { at, span: Default::default(), row }, &Facts::default());
    }

    fn with_first(reading: Reading) -> [Reading; 5] {
        [reading, Reading::Value(1.0), Reading::Value(1.0), Reading::Disabled, Reading::Value(1.0)]
    }

    #[test]
    fn a_fault_is_remembered_with_its_beginning_and_its_end() {
        let mut view = View::default();
        let readings = [Reading::Value(20.0), Reading::Open, Reading::Open, Reading::Short, Reading::Value(21.0)];
        for (number, reading) in readings.into_iter().enumerate() {
            row(&mut view, 1000 * number as u64, with_first(reading));
        }
        let seen: Vec<_> = view.faults.iter().map(|f| (f.kind, f.since, f.until)).collect();
        let at = Instant::from_millis;
        assert_eq!(seen, [(FaultKind::Short, at(3000), Some(at(4000))), (FaultKind::Open, at(1000), Some(at(3000)))]);
        assert_eq!((view.stream.channels[0].min, view.stream.channels[0].max), (Some(20.0), Some(21.0)));
    }

    #[test]
    fn history_is_bounded() {
        let mut view = View::default();
        for number in 0..(KEPT_SAMPLES as u64 + 100) {
            row(&mut view, number, with_first(if number % 2 == 0 { Reading::Open } else { Reading::Short }));
        }
        assert!(view.stream.channels.iter().all(|channel| channel.history.len() == KEPT_SAMPLES));
        assert_eq!(view.faults.len(), KEPT_FAULTS);
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
        assert!(!view.stream.late);
    }
}
