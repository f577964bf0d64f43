//! What a session can be asked, and what it has to say.
//!
//! Events carry spans into the record: a fact always points at the bytes it was read from.

use super::flaw::Flaw;
use super::upload::{LoadReport, Phase, Progress};
use crate::canopen::{ObjectAddress, Value};
use crate::device::LoaderKind;
use crate::image::{CheckedImage, DefectId};
use crate::record::Span;
use crate::secret::Secret;
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::dictionary::{Reading, Shown};
use crate::wire::stream::{Row, Source};
use crate::wire::{MenuKey, Text};

/// What the user wants of the unit. One job runs at a time, and one more is queued if it is given while the unit is
/// being identified. [`Command::Keys`] and [`Command::Cancel`] are not jobs.
#[derive(Clone, Debug)]
pub enum Command {
    /// Keys for the unit as they are, from the raw terminal or the menu. Refused while a job other than
    /// [`Command::Identify`] runs.
    Keys(Vec<u8>),
    /// Send a file as it is, as if it were typed. [`Event::FileProgress`] reports how far it has come.
    SendFile(Vec<u8>),
    /// Find out what is at the other end.
    Identify,
    /// Switch the data stream on, or change what it sends.
    StreamOn {
        /// Field values or process values.
        source: Source,
        /// Repetition time, 1 ms to 60 s (errata E-105).
        period: Duration,
    },
    /// Switch the data stream off.
    StreamOff,
    /// Restore the default object dictionary; the unit resets itself (AXTC4CO manual, section 4.1.2).
    RestoreDefaults,
    /// Read the whole object dictionary through V. Scanning and CAN are halted meanwhile (AXTC4CO manual, section
    /// 4.1.1).
    ReadDictionary,
    /// Read this many pages of diagnostics, or all until the job is cancelled; then stop them.
    Diagnostics {
        /// How many.
        pages: Option<u32>,
    },
    /// Stop pages of diagnostics that come, no matter what asked for them.
    DiagnosticsOff,
    /// In a recording: understand everything as it goes by. Each walk through the dictionary is reported by
    /// [`Event::Overheard`].
    Overhear,
    /// Upload new software.
    Load(Box<LoadOrder>),
    /// End the running job as soon as that is safe, and say what the unit is now.
    Cancel,
}

/// Everything an upload needs.
#[derive(Clone, Debug)]
pub struct LoadOrder {
    /// What to send.
    pub image: CheckedImage,
    /// The password of the menu's L; a unit that waits in its loader asks for none.
    pub password: Option<Secret>,
    /// The product, where the user says it or a journal knows it; otherwise the unit is asked.
    pub product: Option<String>,
    /// The software it ran before, where a journal knows it: a loader does not say.
    pub ran: Option<Version>,
    /// The loader it has, where the user knows better than the product's file. How it really paces its sender shows
    /// after the header in any case.
    pub loader: Option<LoaderKind>,
    /// Send long records instead of the file's: fewer characters for the same words.
    pub packed: bool,
    /// Defects of the image, as such or for this unit, that the user knows of and allows.
    pub allowed: Vec<DefectId>,
    /// Makes the sender misbehave in a known way, so that a test shows that the checker notices.
    #[doc(hidden)]
    pub flaw: Option<Flaw>,
}

impl LoadOrder {
    /// An upload in the file's own records, to whatever is at the other end.
    pub fn new(image: CheckedImage, password: impl Into<Option<Secret>>) -> Self {
        LoadOrder {
            image,
            password: password.into(),
            product: None,
            ran: None,
            loader: None,
            packed: false,
            allowed: Vec::new(),
            flaw: None,
        }
    }

    /// Its progress before anything has been done: the unit is being identified.
    pub fn at_its_beginning(&self) -> Progress {
        let (records_total, bytes_total) = super::upload::size(self);
        Progress {
            phase: Phase::Check,
            records: 0,
            records_total,
            bytes: 0,
            bytes_total,
            address: 0,
            elapsed: Duration::ZERO,
            moving: Duration::ZERO,
            moved: 0,
            held: None,
            again: false,
        }
    }
}

/// Which job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Job {
    /// [`Command::Identify`].
    Identify,
    /// [`Command::StreamOn`].
    StreamOn,
    /// [`Command::StreamOff`].
    StreamOff,
    /// [`Command::RestoreDefaults`].
    RestoreDefaults,
    /// [`Command::ReadDictionary`].
    ReadDictionary,
    /// [`Command::Diagnostics`], [`Command::DiagnosticsOff`].
    Diagnostics,
    /// [`Command::Overhear`].
    Overhear,
    /// [`Command::Load`].
    Load,
    /// [`Command::SendFile`].
    SendFile,
}

impl Job {
    /// What it is about, to follow "still" or "cancelled,".
    pub fn doing(self) -> &'static str {
        match self {
            Job::Identify => "asking who is there",
            Job::StreamOn => "switching the stream on",
            Job::StreamOff => "switching the stream off",
            Job::RestoreDefaults => "restoring the defaults",
            Job::ReadDictionary => "reading the object dictionary",
            Job::Diagnostics => "reading the diagnostics",
            Job::Overhear => "listening",
            Job::Load => "loading new software",
            Job::SendFile => "sending a file",
        }
    }
}

/// Why a command was not taken. Nothing has been sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Another job runs.
    #[error("axcon is still {}", .0.doing())]
    Busy(Job),
    /// The period is outside what the unit takes.
    #[error("a repetition time of {} ms is outside 1 ms to 60 s", .0.as_secs_f64() * 1000.0)]
    Period(Duration),
    /// The password is empty or holds a control character, which would end it early.
    #[error("the password is empty or holds a control character")]
    Password,
    /// The session has a unit, which is asked instead of listened to.
    #[error("only a recording is listened to; a unit is asked")]
    Live,
    /// The session listens to a recording.
    #[error("this is a recording: nothing can be sent to the unit")]
    ReadOnly,
    /// The unit asks for the password, and a file is not one.
    #[error("the unit asks for a password: answer that first, or leave it with Enter")]
    PasswordOpen,
    /// The question after a key that was typed takes whatever is sent as its answer: after a `Ye`, a key that another
    /// job sends could complete the word that restores the defaults.
    #[error("the question after the {} that was typed is still open: end it on the terminal with Enter", .0.letter())]
    QuestionOpen(MenuKey),
    /// The unit holds us by XOFF, and too much waits already.
    #[error("the unit does not take what has been typed so far (held by XOFF)")]
    Held,
}

/// What has happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The unit has printed a line (or a page, or a prompt); what it means is in the message, if anything.
    Heard {
        /// When its last byte came.
        at: Instant,
        /// Where it lies in the record.
        span: Span,
        /// What it means.
        message: crate::wire::Message,
    },
    /// A row of the stream.
    Row {
        /// When its last byte came.
        at: Instant,
        /// Where it lies in the record.
        span: Span,
        /// What it says.
        row: Row,
    },
    /// This many entries of the object dictionary have been read so far.
    EntriesRead(usize),
    /// A page of diagnostics is complete.
    Page {
        /// When its last line came.
        at: Instant,
        /// Its lines, as printed.
        lines: Vec<Text>,
    },
    /// In a recording: a walk through the object dictionary, to its end or not.
    Overheard {
        /// When its last entry came.
        at: Instant,
        /// What was read.
        reading: Box<DictionaryReading>,
    },
    /// What is known of the unit has changed: see `Session::facts`.
    FactsChanged,
    /// The unit has stopped us (XOFF) or lets us go on (XON).
    Held(bool),
    /// The upload has moved on.
    Progress(Progress),
    /// A file that is sent as it is has come further.
    FileProgress {
        /// Bytes that have left.
        sent: usize,
        /// Bytes of the file.
        total: usize,
    },
    /// A file that is sent as it is makes no progress: the unit has held it by XOFF for a long time. Reported once for
    /// each hold. The wait goes on until the user cancels, or the unit sends XON and [`Event::FileProgress`] follows.
    FileHeld {
        /// Since when.
        since: Instant,
        /// Bytes that have left.
        sent: usize,
        /// Bytes of the file.
        total: usize,
    },
    /// A job has ended.
    Finished(Outcome),
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// What is at the other end is known now, or that nothing is: see `Session::facts`.
    Identified,
    /// The job has done what it should.
    Done(Job),
    /// The unit has taken the Yes that restores its defaults, but has printed only what its menu has as well: no
    /// restart was seen.
    DefaultsTaken,
    /// The stream runs as asked; rows have come.
    StreamRuns {
        /// Whether it was on before, with whatever settings.
        was_on: bool,
    },
    /// The object dictionary has been read, as far as the unit showed it.
    DictionaryRead(Box<DictionaryReading>),
    /// The unit did not answer in time, or not in a way we understand.
    NoAnswer {
        /// Which job.
        job: Job,
        /// What was awaited.
        awaited: Awaited,
        /// Where the last text heard lies.
        heard: Option<Span>,
    },
    /// The unit understood and said no.
    Refused {
        /// Which job.
        job: Job,
        /// Its reason, as far as it gave one.
        reason: String,
        /// Where it said so.
        heard: Option<Span>,
    },
    /// The job was cancelled, and has ended what it had begun with the unit.
    Cancelled(Job),
    /// An upload has ended, well or not.
    Loaded(Box<LoadReport>),
    /// A file has been sent as it is, as far as it came; what the unit has made of it is not known.
    FileSent {
        /// Bytes that have left.
        sent: usize,
        /// Bytes of the file.
        total: usize,
        /// Why it ended.
        end: FileEnd,
    },
}

/// What a job has waited for in vain. Its text says what did not happen, as a sentence without a full stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Awaited {
    /// The question that offers the stream's sources, after T.
    #[error("the unit did not ask, in words that are understood, which values its stream is to send")]
    SourceQuestion,
    /// The question after that one.
    #[error("the unit did not ask, in words that are understood, for the repetition time")]
    PeriodQuestion,
    /// The first row of a stream that was switched on.
    #[error("no row of the stream came")]
    Row,
    /// A sign that no more rows will come.
    #[error("the unit did not confirm that the stream is off")]
    StreamOff,
    /// The question after D.
    #[error("the unit did not ask, in words that are understood, for the Yes that restores its defaults")]
    DefaultsQuestion,
    /// The banner of a unit that restores its defaults.
    #[error("the banner after the reset did not come")]
    Banner,
    /// The same, where the unit asked something other than for a Yes.
    #[error("the unit asked something else after it and was answered No, so nobody can say what it has restored")]
    NothingElse,
    /// Anything after V.
    #[error("the unit did not show its object dictionary")]
    Dictionary,
    /// An entry among what came after V.
    #[error("no entry of the object dictionary came")]
    Entry,
    /// The first page of diagnostics.
    #[error("no page of diagnostics came that is understood")]
    Page,
    /// One more, after the first ones.
    #[error("the next page of diagnostics did not come")]
    NextPage,
    /// A sign that no more pages will come.
    #[error("the unit did not confirm that the diagnostics are off")]
    DiagnosticsOff,
}

/// Why the sending of a file has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileEnd {
    /// All of it has left.
    Whole,
    /// The user has cancelled; no more of it leaves.
    Cancelled,
    /// The link is gone. Some of the bytes that left last may not have reached the unit.
    LinkLost,
}

/// How far a walk through the object dictionary came.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum WalkEnd {
    /// To its end.
    Whole,
    /// No further: the unit stopped answering, or the user did not go on.
    #[default]
    Stopped,
    /// As far as the user wanted.
    Cancelled,
    /// The unit restarted in the middle of it.
    Restarted,
    /// Perhaps to its end, but lines of it were not understood, and may be the entries that are missing.
    NotUnderstood {
        /// The first of them.
        first: String,
    },
}

/// What the unit showed of its object dictionary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DictionaryReading {
    /// Entries by index and sub-index.
    pub entries: Vec<ReadEntry>,
    /// How far the walk came.
    pub end: WalkEnd,
    /// Lines of the view with a number in them that were not understood: neither an entry nor otherwise known.
    pub unrecognised_lines: u64,
}

impl DictionaryReading {
    /// Whether this is all that the unit has.
    pub fn is_complete(&self) -> bool {
        self.end == WalkEnd::Whole
    }
}

/// An entry as the unit showed it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadEntry {
    /// Where it lies.
    pub at: ObjectAddress,
    /// What the line says besides index and sub-index.
    pub text: String,
    /// Where in the record it was read.
    pub span: Span,
    /// What the text says of the value; `None` where the product's manual does not have the entry, or is not known.
    pub reading: Option<Reading>,
}

impl ReadEntry {
    /// Its value, where the unit shows one that is certain.
    pub fn value(&self) -> Option<Value> {
        match self.reading.as_ref()?.shown {
            Shown::Value(value) => Some(value),
            Shown::Nothing | Shown::Hexadecimal => None,
        }
    }

    /// The text says a value, but which one is uncertain: this unit prints hexadecimal numbers without a mark.
    pub fn is_doubtful(&self) -> bool {
        self.reading.as_ref().is_some_and(|reading| reading.shown == Shown::Hexadecimal)
    }
}

/// What is known of the unit, and from where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// What is talking.
    pub state: UnitState,
    /// Product name.
    pub product: Option<Known<String>>,
    /// Software version.
    pub version: Option<Known<Version>>,
    /// CANopen node-ID.
    pub node_id: Option<Known<u8>>,
    /// CAN bit rate in kbit/s.
    pub can_kbps: Option<Known<u16>>,
    /// CANopen state, in lower case: `pre-operational`, `operational`, `stopped`.
    pub nmt_state: Option<Known<String>>,
    /// Whether the stream runs, and with what.
    pub stream: Option<Source>,
    /// Whether pages of diagnostics come, no matter what asked for them, and where the first sign of that is.
    pub diagnostics: Option<Span>,
    /// Lines that no recogniser understood and that answer no key: titles of the menu, questions, pages and the view do
    /// not count.
    pub unrecognised_lines: u64,
}

impl Facts {
    /// The loader talks: what the application said of itself does not hold any more, except for the product.
    pub(super) fn enter_loader(&mut self) {
        let product = self.product.take();
        let unrecognised_lines = self.unrecognised_lines;
        *self = Facts { state: UnitState::Loader, product, unrecognised_lines, ..Facts::default() };
    }

    /// The unit says which product it is. If that is another one than before, the cable is in another unit, and what
    /// the one before said of itself is forgotten.
    pub(super) fn name_product(&mut self, product: Known<String>) {
        let is_other = |before: &Known<String>| !before.value.eq_ignore_ascii_case(&product.value);
        if self.product.as_ref().is_some_and(is_other) {
            let Facts { state, unrecognised_lines, diagnostics, .. } = *self;
            *self = Facts { state, unrecognised_lines, diagnostics, ..Facts::default() };
        }
        self.product = Some(product);
    }
}

/// A fact and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Known<T> {
    /// The fact.
    pub value: T,
    /// Where it comes from.
    pub origin: Origin,
    /// Where in the record it was read.
    pub span: Span,
}

/// Where a fact comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The power-up banner.
    Banner,
    /// The main menu, printed on request.
    Menu,
    /// The object dictionary.
    Dictionary,
    /// A page of diagnostics.
    Diagnostics,
}

/// What is talking at the other end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnitState {
    /// Nothing has been heard yet.
    #[default]
    Silent,
    /// Something talks, but nothing we recognise.
    Unknown,
    /// The application runs.
    Application,
    /// The bootloader waits for a file.
    Loader,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_says_in_words_what_keeps_the_command_back() {
        assert_eq!(Refusal::Busy(Job::ReadDictionary).to_string(), "axcon is still reading the object dictionary");
        let period = |micros| Refusal::Period(Duration::from_micros(micros)).to_string();
        assert_eq!(period(500), "a repetition time of 0.5 ms is outside 1 ms to 60 s");
        assert_eq!(period(60_001_000), "a repetition time of 60001 ms is outside 1 ms to 60 s");
    }
}
