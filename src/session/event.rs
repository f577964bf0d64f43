//! What a session can be asked, and what it has to say.
//!
//! Events carry spans into the record: a fact always points at the bytes it was read from.

use super::flaw::Flaw;
use crate::canopen::{ObjectAddress, Value};
use crate::device::LoaderKind;
use crate::image::{CheckedImage, DefectId};
use crate::record::Span;
use crate::secret::Secret;
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::Text;
use crate::wire::stream::{Row, Source};

/// What the user wants of the unit. One job runs at a time, and one more may be given while it is being found out who is
/// there; [`Command::Keys`] and [`Command::Cancel`] are no jobs.
#[derive(Clone, Debug)]
pub enum Command {
    /// Keys for the unit as they are, from the raw terminal or the menu. Refused while a job other than
    /// [`Command::Identify`] runs.
    Keys(Vec<u8>),
    /// Bytes of a file for the unit, as they are: no keys, among which a password may be.
    Bytes(Vec<u8>),
    /// Send a file as it is, as if it were typed, with news of how far it has come: [`Event::FileProgress`].
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
    /// Read the whole object dictionary through V. Scanning and CAN are halted meanwhile (AXTC4CO manual, section 4.1.1).
    ReadDictionary,
    /// Read pages of diagnostics: so many, or until it is cancelled; then no more come.
    Diagnostics {
        /// How many.
        pages: Option<u32>,
    },
    /// In a recording: understand all that goes by, as it goes by. A dictionary that was walked through is told of by
    /// [`Event::Overheard`], as often as that happened.
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
    /// behind the header in any case.
    pub loader: Option<LoaderKind>,
    /// Send long records instead of the file's: fewer characters for the same words.
    pub packed: bool,
    /// Defects of the image that do not matter, for this unit: those the user knows of and wants all the same.
    pub allowed: Vec<DefectId>,
    /// A defect on purpose, to prove the proof.
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

    /// Where it stands before anything has been done: the unit is being looked at.
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
    /// [`Command::Diagnostics`].
    Diagnostics,
    /// [`Command::Overhear`].
    Overhear,
    /// [`Command::Load`].
    Load,
    /// [`Command::SendFile`].
    SendFile,
}

/// Why a command was not taken. Nothing has been sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Another job runs.
    #[error("busy with another job ({0:?})")]
    Busy(Job),
    /// The period is outside what the unit takes.
    #[error("a repetition time of {0:?} is outside 1 ms to 60 s")]
    Period(Duration),
    /// The password is empty or holds a control character, which would end it early.
    #[error("the password is empty or holds a control character")]
    Password,
    /// There is somebody to ask.
    #[error("only a recording is listened to; a unit is asked")]
    Live,
    /// The session listens to a recording.
    #[error("this is a recording: nothing can be sent to the unit")]
    ReadOnly,
    /// The unit asks for the password, and a file is none.
    #[error("the unit asks for a password: answer that first, or leave it with Enter")]
    PasswordOpen,
    /// The unit holds us by XOFF, and too much waits already.
    #[error("the unit does not take what has been typed so far (held by XOFF)")]
    Held,
}

/// News.
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
    /// So many entries of the object dictionary have been read.
    EntriesRead(usize),
    /// A page of diagnostics is complete.
    Page {
        /// When its last line came.
        at: Instant,
        /// Its lines, as printed.
        lines: Vec<Text>,
    },
    /// In a recording: somebody has walked through the object dictionary.
    Overheard(Box<DictionaryReading>),
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
    /// A file that is sent as it is does not come further: the unit holds it by XOFF, and has for long. Told once for each
    /// hold. Nothing is given up: the user ends the wait, or the unit does, and then [`Event::FileProgress`] says so.
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
    /// The job was cancelled and has left the unit in peace.
    Cancelled(Job),
    /// An upload has ended, well or not.
    Loaded(Box<LoadReport>),
    /// A file has been sent as it is, as far as it came; what the unit has made of it nobody knows.
    FileSent {
        /// Bytes that have left.
        sent: usize,
        /// Bytes of the file.
        total: usize,
        /// Why it ended.
        end: FileEnd,
    },
}

/// What a job has waited for in vain. As text it says, as a sentence without its stop, what did not happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Awaited {
    /// The question that offers the stream's sources, behind T.
    #[error("the unit did not ask which values its stream is to send")]
    SourceQuestion,
    /// The question behind that one.
    #[error("the unit did not ask for the repetition time")]
    PeriodQuestion,
    /// The first row of a stream that was switched on.
    #[error("no row of the stream came")]
    Row,
    /// A sign that no more rows will come.
    #[error("the unit did not confirm that the stream is off")]
    StreamOff,
    /// The question behind D.
    #[error("the unit did not ask for the Yes that restores its defaults")]
    DefaultsQuestion,
    /// The banner of a unit that restores its defaults.
    #[error("the banner after the reset did not come")]
    Banner,
    /// Anything behind V.
    #[error("the unit did not show its object dictionary")]
    Dictionary,
    /// An entry among what came behind V.
    #[error("no entry of the object dictionary came")]
    Entry,
    /// The first page of diagnostics.
    #[error("no page of diagnostics came")]
    Page,
    /// One more, behind the first ones.
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
    /// The user has had enough; nothing of it leaves any more.
    Cancelled,
    /// The link is gone. Of what had left for it last, some may not have reached the unit.
    LinkLost,
}

/// What the unit showed of its object dictionary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DictionaryReading {
    /// Entries by index and sub-index.
    pub entries: Vec<ReadEntry>,
    /// Whether the walk came to its end.
    pub complete: bool,
    /// Lines of the view with a number in them that nobody understood: neither an entry nor anything else known.
    pub unrecognised_lines: u64,
}

/// An entry as the unit showed it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadEntry {
    /// Where it lies.
    pub at: ObjectAddress,
    /// Its value; `None` where the unit shows none, or the entry is not known.
    pub value: Option<Value>,
    /// What the line says besides index and sub-index.
    pub text: String,
    /// Where in the record it was read.
    pub span: Span,
    /// Whether the product's manual has it.
    pub known: bool,
}

/// What is known of the unit, and from where.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// Who is talking.
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
    /// Lines that no recogniser understood and that answer no key: titles of the menu, questions, pages and the view are
    /// none.
    pub unrecognised_lines: u64,
}

impl Facts {
    /// The loader talks: what the application said of itself is history. The product stays what it is.
    pub(super) fn enter_loader(&mut self) {
        let product = self.product.take();
        let unrecognised_lines = self.unrecognised_lines;
        *self = Facts { state: UnitState::Loader, product, unrecognised_lines, ..Facts::default() };
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

/// Who is talking at the other end.
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

/// Where an upload stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub phase: Phase,
    /// Records the unit must have taken, header and terminator included.
    pub records: usize,
    /// Records in all.
    pub records_total: usize,
    /// Characters the unit must have taken.
    pub bytes: usize,
    /// Characters in all.
    pub bytes_total: usize,
    /// Program address of the record last sent, in the image's unit.
    pub address: u32,
    /// Time since the first record left.
    pub elapsed: Duration,
    /// Time since the unit had taken the first data: behind the header a loader may erase for ten seconds, which says
    /// nothing of how fast it takes data.
    pub moving: Duration,
    /// Characters it has taken since then.
    pub moved: usize,
    /// How long the unit has held us by XOFF, if it does.
    pub held: Option<Duration>,
    /// Everything is being sent once more: the loader has shown that it had lost something. The counts are those of this
    /// time, and begin at 0.
    pub again: bool,
}

impl Progress {
    /// Characters a second since the first data; 0 before.
    pub fn rate(&self) -> f64 {
        let seconds = self.moving.as_secs_f64();
        if seconds > 0.0 { self.moved as f64 / seconds } else { 0.0 }
    }

    /// Time until all characters have been taken, where that can be told.
    pub fn eta(&self) -> Option<Duration> {
        let rest = self.bytes_total.saturating_sub(self.bytes) as f64;
        let rate = self.rate();
        // Less than a character a second is a unit that holds us: nobody knows for how long.
        (rate >= 1.0).then(|| Duration::from_secs_f64(rest / rate))
    }
}

/// Steps of an upload, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Finding out who is there and whether the image is for it.
    Check,
    /// Asking for the loader: L, password, reset.
    EnterLoader,
    /// The loader erases; only loaders that do so at once.
    Erase,
    /// Records are on their way.
    Transfer,
    /// The terminator is out, the loader has to say how it went.
    Finish,
    /// The unit restarts; its banner has to name the image's product and version.
    Verify,
}

/// How an upload ended, what is true of the unit now, and on what evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadReport {
    /// The verdict.
    pub verdict: Verdict,
    /// How far it came.
    pub phase: Phase,
    /// What is at the other end now.
    pub unit: UnitNow,
    /// It was waiting in its loader when it was found: what software it has was not known before either.
    pub found_in_loader: bool,
    /// Product, as far as known.
    pub product: Option<String>,
    /// Version before, if the unit said it.
    pub version_before: Option<Version>,
    /// Version after, from the new banner only.
    pub version_after: Option<Version>,
    /// Records sent, header and terminator included.
    pub records: usize,
    /// Records in all.
    pub records_total: usize,
    /// Address of the data record last sent, in the image's unit.
    pub address: Option<u32>,
    /// From the first record to the end.
    pub duration: Duration,
    /// What happened, in one sentence.
    pub what: String,
    /// The text the verdict rests on, as printed (control characters made visible), shortened.
    pub heard: String,
    /// What speaks against the image for this unit, if that is why it was refused; it can be allowed by this name.
    pub misfit: Option<DefectId>,
    /// What the loader has shown to be otherwise than believed, in one sentence.
    pub remark: Option<String>,
}

impl LoadReport {
    /// What whoever started it should do now, by what is true of the unit; to follow other words.
    pub fn advice(&self) -> &'static str {
        match (self.verdict, self.unit) {
            (Verdict::Done, _) => "nothing: the unit runs what was sent",
            (Verdict::WrongApplication, _) => {
                "do not put the unit into service: compare its version with the file's and send the right one; if it \
                 comes out the same, keep the recording"
            }
            (Verdict::Refused, _) if self.product.is_none() => {
                "look at the label of the unit and say which product it is"
            }
            (Verdict::Refused, _) if self.misfit == Some(DefectId::Downgrade) => {
                "nothing was changed: take newer software, unless the old one is wanted"
            }
            (Verdict::Refused, _) => "nothing was changed: take the file that is made for this unit",
            (Verdict::UnitRefused, UnitNow::Application) => {
                "the unit runs what it ran: check the password, capital and small letters count, and try again"
            }
            (Verdict::NoAnswer, _) => "nothing was changed: look at power, cable and port, then try again",
            (_, UnitNow::Loader) if self.records == 0 && self.found_in_loader => {
                "nothing was sent: the unit waits in its loader, as it was found; send the file"
            }
            (_, UnitNow::Loader) if self.records == 0 => {
                "nothing was sent: the unit waits in its loader with the software it had; send the file, or switch the \
                 unit off and on"
            }
            (_, UnitNow::Loader) if self.phase == Phase::Finish && self.records == self.records_total => {
                "the unit waits in its loader: send a file that is made for it; 'axcon image info' says what this one is"
            }
            (_, UnitNow::Loader) => {
                "keep the unit powered and send the file again: it waits in its loader and has no complete software; a \
                 power cycle does no harm, it comes back to the loader"
            }
            (_, UnitNow::Application) => "the unit runs its software: nothing was changed, try again",
            (_, UnitNow::Unknown) => {
                "switch the unit off and on, then send again: what it says at power-up tells whether software runs or a \
                 loader waits"
            }
        }
    }
}

/// Verdict on an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The unit runs the image: its new banner says so.
    Done,
    /// Refused before anything was changed: wrong product, or product unknown.
    Refused,
    /// The unit refused: wrong password, or it did not leave the menu.
    UnitRefused,
    /// Nobody answered; nothing was sent but the question.
    NoAnswer,
    /// The upload failed.
    Failed,
    /// The unit runs, but its banner names another product or version than the image.
    WrongApplication,
    /// Cancelled.
    Interrupted,
}

/// What a unit is after an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitNow {
    /// The application runs.
    Application,
    /// It waits in its loader for a file.
    Loader,
    /// Nobody can say.
    Unknown,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(verdict: Verdict, unit: UnitNow, records: usize) -> LoadReport {
        LoadReport {
            verdict,
            phase: Phase::Transfer,
            unit,
            product: Some("AXTC4CO".into()),
            version_before: None,
            version_after: None,
            records,
            records_total: 3074,
            address: None,
            duration: Duration::ZERO,
            what: String::new(),
            heard: String::new(),
            found_in_loader: false,
            misfit: None,
            remark: None,
        }
    }

    #[test]
    fn before_anything_was_sent_nobody_is_told_that_the_software_is_gone() {
        let early = report(Verdict::Interrupted, UnitNow::Loader, 0).advice();
        assert!(early.starts_with("nothing was sent") && !early.contains("no complete software"), "{early}");
        let late = report(Verdict::Interrupted, UnitNow::Loader, 1).advice();
        assert!(late.contains("no complete software"), "{late}");
    }

    #[test]
    fn each_end_of_an_upload_has_advice_that_fits_it() {
        let advice = |report: LoadReport| report.advice().split([':', ';']).next().unwrap_or_default().to_owned();
        let refused = || report(Verdict::Refused, UnitNow::Application, 0);
        assert_eq!(
            advice(LoadReport { product: None, ..refused() }),
            "look at the label of the unit and say which product it is"
        );
        let older = LoadReport { misfit: Some(DefectId::Downgrade), ..refused() };
        assert!(older.advice().contains("take newer software"), "{}", older.advice());
        assert!(refused().advice().contains("made for this unit"), "{}", refused().advice());
        let waits = |records, phase, found_in_loader| {
            LoadReport { phase, found_in_loader, ..report(Verdict::Failed, UnitNow::Loader, records) }.advice()
        };
        assert!(waits(0, Phase::Transfer, true).contains("as it was found"));
        assert!(waits(0, Phase::Transfer, false).contains("with the software it had"));
        assert!(waits(3074, Phase::Finish, false).contains("send a file that is made for it"));
        for (records, phase, found) in
            [(1, Phase::Transfer, true), (3073, Phase::Finish, false), (3074, Phase::Transfer, false)]
        {
            assert!(waits(records, phase, found).contains("no complete software"), "{records} {phase:?}");
        }
    }

    #[test]
    fn the_time_left_counts_from_the_first_data_and_not_from_the_erasing_before_it() {
        let mut progress = Progress {
            phase: Phase::Transfer,
            records: 1,
            records_total: 101,
            bytes: 20,
            bytes_total: 10_020,
            address: 0,
            elapsed: Duration::from_secs(10),
            moving: Duration::ZERO,
            moved: 0,
            held: None,
            again: false,
        };
        assert_eq!((progress.rate(), progress.eta()), (0.0, None));
        progress = Progress { bytes: 5_020, elapsed: Duration::from_secs(15), ..progress };
        progress = Progress { moving: Duration::from_secs(5), moved: 5_000, ..progress };
        assert_eq!((progress.rate(), progress.eta()), (1000.0, Some(Duration::from_secs(5))));
    }
}
