//! Uploading new software: find out who is there, enter the loader, send, and believe only the new banner.
//!
//! The rules, each of which has broken a real upload somewhere:
//! - no record leaves before the loader's own prompt, and none behind the first text that says otherwise: a record
//!   begins with `S` and may contain `D`, which are keys of the menu;
//! - text from before a reset proves nothing about after it: each stage reads what is newer than its mark;
//! - "loaded" proves only that the end record arrived; product and version in the new banner have to be the image's;
//! - every wait has an end, and every end says what the unit is now.

use super::event::{Event, Facts, LoadOrder, LoadReport, Outcome, Phase, Progress, UnitNow, UnitState, Verdict};
use super::flaw::Flaw;
use super::identify::Identify;
use super::job::{Desk, Signal, Work};
use super::records;
use super::transfer::{Stall, Transfer};
use crate::device::{Product, longest_erase};
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::{Confidence, LoaderText, Message, Prompt, Text, visible};

/// How long the unit may take to ask for the password.
const PASSWORD_PROMPT: Duration = Duration::from_millis(2500);
/// How long a reset into the loader may take, or the refusal of a password.
const LOADER_PROMPT: Duration = Duration::from_secs(8);
/// Silence behind the loader's prompt before the first record: whatever else it prints should be out.
const SETTLE: Duration = Duration::from_millis(80);
/// How long a loader that was found waiting may take to call what we asked it an error.
const CLEAR_LINE: Duration = Duration::from_millis(300);
/// How long the loader may take after an error to say that it waits again.
const RESTART: Duration = Duration::from_secs(2);
/// From the end record to the new banner: the last page, the reset, the first start.
const NEW_BANNER: Duration = Duration::from_secs(20);
/// A loader that prompts again behind the end record may still hand over to the application after a start delay.
const SECOND_PROMPT: Duration = Duration::from_secs(3);
/// Silence behind product and version that ends the banner.
const BANNER_QUIET: Duration = Duration::from_millis(300);
/// Silence behind a menu without a version before the unit is asked.
const ASK_VERSION: Duration = Duration::from_millis(1000);
/// How long behind the password a loader that wants a key may take to ask for it, before it gets one unasked. Less than
/// the 10 s for which it wants one (errata E-I12).
const UNASKED_KEY: Duration = Duration::from_millis(3000);
/// The same behind its header.
const UNASKED_KEY_BEHIND_HEADER: Duration = Duration::from_millis(1000);
/// Lines of words nobody knows that a loader may print between two acknowledgements: it may have something to say of its
/// erasing. A menu that takes records for keys says one or two behind each.
const MOST_STRANGE: u32 = 3;
/// How long a loader may take behind the longest erasing until it says something.
const BEHIND_THE_ERASE: Duration = Duration::from_secs(4);
/// How long a loader with a ring may be silent behind the end record, before it is taken to wait for the rest of it.
const END_UNHEARD: Duration = Duration::from_millis(1500);
/// What brings a loader out of a record it has lost its place in: as many digits as the longest record has (it takes
/// anything for a digit), and a line end. At a menu Enter does nothing.
const FILLER: [u8; 516] = [b'\r'; 516];
/// Characters of a quotation.
const QUOTED: usize = 160;

/// The job.
pub(super) struct Upload {
    order: LoadOrder,
    /// Product name, once it is known.
    product: Option<String>,
    version_before: Option<Version>,
    transfer: Option<Transfer>,
    stage: Stage,
    deadline: Option<Instant>,
    /// What is to be sent if nothing is heard until then.
    unheard: Option<(Instant, Unheard)>,
    /// Lines of words nobody knows since the loader has acknowledged anything.
    strange: u32,
    /// The loader has been brought out of a record once.
    filled: bool,
    /// How long a silent unit is asked again and again.
    patience: Option<Instant>,
    /// Text that begins before this offset is history.
    mark: u64,
    /// The last text heard in this job that was not a row of the stream.
    heard: String,
    cancelled: bool,
    after: After,
    progress: Option<Progress>,
    /// When the loader had taken the first data, and how many characters it had then.
    first_data: Option<(Instant, usize)>,
}

enum Stage {
    Check(Identify),
    /// L is out.
    AskedForLoader,
    /// The password is out.
    PasswordSent,
    /// The loader's prompt has been seen; more of it may come.
    Settle,
    Transfer,
    /// The end record is out.
    Finish,
    /// The unit runs but has not said its version: it is asked.
    AskVersion(Identify),
    /// The loader, or somebody, has said that it is over; whether the loader waits again decides what the unit is now.
    Failing {
        what: String,
        unit: UnitNow,
    },
}

/// What is to be sent to a loader that is not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unheard {
    /// The key it must be waiting for.
    Key,
    /// [`FILLER`].
    Filler,
}

/// What has been heard since the end record.
#[derive(Default)]
struct After {
    product: Option<String>,
    version: Option<(Confidence, Version)>,
    application: bool,
    loader_waits: bool,
}

impl Upload {
    pub(super) fn new(order: LoadOrder) -> Self {
        Upload {
            order,
            product: None,
            version_before: None,
            transfer: None,
            stage: Stage::Check(Identify::default()),
            deadline: None,
            unheard: None,
            strange: 0,
            filled: false,
            patience: None,
            mark: 0,
            heard: String::new(),
            cancelled: false,
            after: After::default(),
            progress: None,
            first_data: None,
        }
    }

    /// Decides, once it is known who is there, whether the image may be sent.
    fn checked(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let facts: Facts = desk.facts.clone();
        self.version_before = facts.version.as_ref().map(|known| known.value);
        let said = facts.product.as_ref().map(|known| known.value.clone());
        let image_product = self.order.image.identity().map(|identity| identity.product.clone());
        match facts.state {
            UnitState::Silent if self.may_come_back(desk) => {
                let mut identify = Identify::default();
                let outcome = identify.handle(Signal::Begin, desk);
                self.deadline = identify.deadline();
                self.stage = Stage::Check(identify);
                return outcome.and_then(|_| self.checked(desk));
            }
            UnitState::Silent => {
                return self.end(desk, Verdict::NoAnswer, UnitNow::Unknown, "nothing answers on this port");
            }
            UnitState::Unknown => {
                let what = "something talks on this port, but it is not a unit this program knows";
                return self.end(desk, Verdict::NoAnswer, UnitNow::Unknown, what);
            }
            UnitState::Application | UnitState::Loader => {}
        }
        let unit = if facts.state == UnitState::Loader { UnitNow::Loader } else { UnitNow::Application };
        let ordered = self.order.product.clone();
        if let (Some(said), Some(ordered)) = (&said, &ordered)
            && !said.eq_ignore_ascii_case(ordered)
        {
            let what = format!("the unit is an {said}, not an {ordered}");
            return self.end(desk, Verdict::Refused, unit, what);
        }
        let Some(product) = said.or(ordered) else {
            let what = "the unit does not say which product it is";
            return self.end(desk, Verdict::Refused, unit, what);
        };
        if let Some(image_product) = image_product
            && !image_product.eq_ignore_ascii_case(&product)
        {
            self.product = Some(product.clone());
            let what = format!("the image is for {image_product}, the unit is an {product}");
            return self.end(desk, Verdict::Refused, unit, what);
        }
        let Some(known) = Product::named(&product) else {
            let what = format!("{product} is not a product this program knows");
            return self.end(desk, Verdict::Refused, unit, what);
        };
        self.product = Some(known.name.clone());
        let pacing = self.order.loader.unwrap_or(known.loader.kind).pacing();
        let (packed, flaw) = (self.order.packed, self.order.flaw);
        self.transfer = Some(Transfer::new(self.order.image.image(), &known.flash, pacing, packed, flaw));
        self.mark = desk.received;
        match unit {
            UnitNow::Loader => {
                // The question who is there may still lie in its line buffer: Enter makes an error of it, which is
                // over before the first record.
                desk.send(b"\r");
                self.stage = Stage::Settle;
                self.deadline = Some(desk.now + CLEAR_LINE);
            }
            UnitNow::Application | UnitNow::Unknown => {
                desk.send(b"l");
                self.stage = Stage::AskedForLoader;
                self.deadline = Some(desk.now + PASSWORD_PROMPT);
            }
        }
        self.report_progress(desk);
        None
    }

    fn settle(&mut self, desk: &Desk<'_>) {
        self.stage = Stage::Settle;
        let quiet = desk.now + SETTLE;
        self.deadline = Some(self.deadline.map_or(quiet, |deadline| deadline.max(quiet)));
    }

    /// Whether the silent unit may be a loader: one that has lost its place in a record of an upload before this one, and
    /// takes every question for the rest of it, or one that erases its flash and listens to nobody. That somebody says
    /// which product it is speaks for it.
    fn may_come_back(&mut self, desk: &mut Desk<'_>) -> bool {
        let Some(product) = self.order.product.as_deref().and_then(Product::named) else { return false };
        if self.patience.is_none() {
            self.patience = Some(desk.now + longest_erase(&product.flash) + BEHIND_THE_ERASE);
            self.fill_up(desk);
        }
        self.patience.is_some_and(|until| desk.now < until)
    }

    fn fill_up(&mut self, desk: &mut Desk<'_>) {
        self.filled = true;
        desk.send(&FILLER);
    }

    /// Something was heard while a loader is being asked for.
    fn entering(&mut self, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        let password_sent = matches!(self.stage, Stage::PasswordSent);
        match message {
            Message::Prompt(Prompt::Password) if !password_sent => {
                desk.send_secret(self.order.password.reveal());
                self.stage = Stage::PasswordSent;
                self.deadline = Some(desk.now + LOADER_PROMPT);
                self.unheard = self.asks_for_key().then_some((desk.now + UNASKED_KEY, Unheard::Key));
            }
            Message::Prompt(Prompt::AnyKey) | Message::Loader(LoaderText::AnyKey) if password_sent => {
                desk.send(b"\r");
                // Should it be lost on the line, another one.
                self.unheard = Some((desk.now + UNASKED_KEY_BEHIND_HEADER, Unheard::Key));
            }
            Message::Loader(LoaderText::Header) if password_sent && self.unheard.is_some() => {
                self.unheard = Some((desk.now + UNASKED_KEY_BEHIND_HEADER, Unheard::Key));
            }
            Message::Loader(LoaderText::Waiting) | Message::Prompt(Prompt::WaitingForFile) if password_sent => {
                if self.cancelled {
                    let what = "cancelled; nothing has been sent, the old software is untouched";
                    return self.end(desk, Verdict::Interrupted, UnitNow::Loader, what);
                }
                self.deadline = None;
                self.unheard = None;
                self.settle(desk);
            }
            Message::Refusal | Message::MenuKey(_) | Message::Prompt(Prompt::Password) if password_sent => {
                let what = "the unit did not accept the password";
                if matches!(message, Message::Prompt(_)) {
                    desk.leave_dialogue();
                }
                return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
            }
            Message::Prompt(_) if !password_sent => {
                desk.leave_dialogue();
                let what = "the unit asks something else than the password";
                return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
            }
            Message::Refusal => {
                let what = "the unit refuses to load new software";
                return self.end(desk, Verdict::UnitRefused, UnitNow::Application, what);
            }
            _ => {}
        }
        None
    }

    fn asks_for_key(&self) -> bool {
        self.product.as_deref().and_then(Product::named).is_some_and(|product| product.loader.asks_for_key)
    }

    /// Whether the text is the header's, which some loaders echo, whatever it says.
    fn is_echo_of_header(&self, text: &Text) -> bool {
        let header = records::header(self.order.image.image());
        let header = String::from_utf8_lossy(&header);
        !header.trim().is_empty() && text.text.trim() == header.trim()
    }

    /// Something was heard while records are on their way: anything but the loader's progress ends the transfer.
    fn transferring(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) {
        let failed = match message {
            Message::Loader(LoaderText::Progress | LoaderText::Header) => None,
            _ if self.is_echo_of_header(text) => None,
            _ if self.order.flaw == Some(Flaw::SendsBehindErrors) => None,
            Message::Text | Message::Refusal => {
                self.strange += u32::from(has_a_word(&text.text));
                let what = "what answers does not talk as a loader does".to_owned();
                (self.strange > MOST_STRANGE).then_some((what, UnitNow::Unknown))
            }
            Message::Loader(LoaderText::Error(error)) => {
                Some((format!("the loader reports error {error}"), UnitNow::Loader))
            }
            Message::Loader(LoaderText::Waiting | LoaderText::Restarting | LoaderText::AnyKey)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                Some(("the loader started over and wants the file from its beginning".to_owned(), UnitNow::Loader))
            }
            Message::Loader(LoaderText::Loaded | LoaderText::Started) => {
                Some(("the loader says it is done before the end of the file was sent".to_owned(), UnitNow::Unknown))
            }
            Message::Prompt(_) => {
                Some(("the unit asks for something else in the middle of the file".to_owned(), UnitNow::Unknown))
            }
            Message::MenuKey(_)
            | Message::Software(_)
            | Message::Network(_)
            | Message::FirstStart
            | Message::Row(_) => {
                Some(("the unit left its loader in the middle of the file".to_owned(), UnitNow::Application))
            }
        };
        match failed {
            None => {
                if let Some(transfer) = &mut self.transfer {
                    transfer.heard();
                }
            }
            Some((what, unit)) => {
                desk.transmitter.clear();
                if unit != UnitNow::Loader {
                    // What was on its way may have been keys for a menu: leave whatever dialogue they opened.
                    desk.leave_dialogue();
                }
                self.fail(desk, text.span.end, what, unit);
            }
        }
    }

    /// Nothing is sent any more; what comes behind `mark` says what the unit is now.
    fn fail(&mut self, desk: &Desk<'_>, mark: u64, what: String, unit: UnitNow) {
        self.mark = mark;
        self.stage = Stage::Failing { what, unit };
        self.deadline = Some(desk.now + RESTART);
    }

    /// Something was heard behind the end record.
    /// It ends at `end` in the record.
    fn finishing(&mut self, message: &Message, end: u64, desk: &mut Desk<'_>) {
        let quiet = desk.now + BANNER_QUIET;
        if self.order.flaw == Some(Flaw::BelievesTheLoader)
            && matches!(message, Message::Loader(LoaderText::Loaded | LoaderText::Started))
            && let Some(identity) = self.order.image.identity()
        {
            self.after.product = Some(identity.product.clone());
            self.after.version = Some((Confidence::WithProduct, identity.version));
            self.deadline = Some(desk.now);
        }
        match message {
            Message::Loader(LoaderText::Error(error)) => {
                let what = format!("the loader reports error {error} at the end of the file");
                self.fail(desk, end, what, UnitNow::Loader);
            }
            Message::Loader(LoaderText::Waiting | LoaderText::AnyKey)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                self.after = After { loader_waits: true, ..After::default() };
                self.deadline = Some(desk.now + SECOND_PROMPT);
            }
            Message::Loader(LoaderText::Loaded) => {
                if let Some(transfer) = &mut self.transfer {
                    transfer.take_all_sent();
                }
            }
            Message::Software(name) => {
                self.after.application = true;
                if let Some(product) = &name.product {
                    self.after.product = Some(product.clone());
                }
                if let Some(version) = name.version
                    && self.after.version.is_none_or(|(confidence, _)| name.confidence >= confidence)
                {
                    self.after.version = Some((name.confidence, version));
                }
                if self.after.product.is_some() && self.after.version.is_some() {
                    self.deadline = Some(quiet);
                }
            }
            Message::MenuKey(_) | Message::FirstStart => {
                self.after.application |= matches!(message, Message::MenuKey(_));
                let complete = self.after.product.is_some() && self.after.version.is_some();
                if self.after.application && !complete {
                    self.deadline = Some(desk.now + ASK_VERSION);
                }
            }
            _ => {}
        }
    }

    /// The banner is complete, or its time is over.
    fn judge(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let image = self.order.image.identity().cloned();
        let version = self.after.version.map(|(_, version)| version);
        if self.after.loader_waits && !self.after.application {
            let what = "the loader took the file but waits for another: it does not start what was sent";
            return self.end(desk, Verdict::Failed, UnitNow::Loader, what);
        }
        match (&self.after.product, version) {
            (Some(product), Some(version)) => {
                let runs = format!("the unit runs {product} V{version}");
                let other =
                    image.filter(|image| !image.product.eq_ignore_ascii_case(product) || image.version != version);
                if let Some(transfer) = &mut self.transfer {
                    transfer.take_all_sent();
                }
                self.report_progress_of(Phase::Verify, desk);
                match other {
                    None => self.end(desk, Verdict::Done, UnitNow::Application, runs),
                    Some(sent) => {
                        let what = format!("{runs}, but {} V{} was sent", sent.product, sent.version);
                        self.end(desk, Verdict::WrongApplication, UnitNow::Application, what)
                    }
                }
            }
            _ if self.after.application && !matches!(self.stage, Stage::AskVersion(_)) => {
                let mut identify = Identify::default();
                let outcome = identify.handle(Signal::Begin, desk);
                debug_assert!(outcome.is_none(), "a question has to wait for its answer");
                self.deadline = identify.deadline();
                self.stage = Stage::AskVersion(identify);
                None
            }
            _ if self.after.application => {
                let what = "the unit runs, but does not say which software";
                self.end(desk, Verdict::WrongApplication, UnitNow::Application, what)
            }
            _ => {
                let what = "the file was sent, but the unit has not come back";
                self.end(desk, Verdict::Failed, UnitNow::Unknown, what)
            }
        }
    }

    fn cancel(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match &self.stage {
            Stage::Check(_) => {
                let unit = self.as_found(desk);
                self.end(desk, Verdict::Interrupted, unit, "cancelled before anything was changed")
            }
            Stage::AskedForLoader => {
                desk.leave_dialogue();
                let what = "cancelled before anything was changed";
                self.end(desk, Verdict::Interrupted, UnitNow::Application, what)
            }
            // The reset cannot be called back; what the unit is afterwards is worth a few seconds.
            Stage::PasswordSent => {
                self.cancelled = true;
                None
            }
            Stage::Settle => {
                let what = "cancelled; nothing has been sent, the old software is untouched";
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, what)
            }
            Stage::Transfer => {
                desk.transmitter.clear();
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled in the middle of the file")
            }
            Stage::Finish | Stage::AskVersion(_) => {
                let what = "cancelled behind the end of the file, before the unit came back";
                self.end(desk, Verdict::Interrupted, UnitNow::Unknown, what)
            }
            Stage::Failing { what, unit } => {
                let (what, unit) = (what.clone(), *unit);
                self.end(desk, Verdict::Failed, unit, what)
            }
        }
    }

    /// What the unit is, as long as nothing has been done to it.
    fn as_found(&self, desk: &Desk<'_>) -> UnitNow {
        match desk.facts.state {
            UnitState::Application => UnitNow::Application,
            UnitState::Loader => UnitNow::Loader,
            UnitState::Silent | UnitState::Unknown => UnitNow::Unknown,
        }
    }

    /// The port is gone. What the unit is now follows from how far it was seen to come.
    fn link_lost(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let (unit, what) = match self.stage {
            Stage::Check(_) => (self.as_found(desk), "the connection was lost before anything was changed"),
            Stage::AskedForLoader => (UnitNow::Application, "the connection was lost before anything was changed"),
            Stage::PasswordSent => (UnitNow::Unknown, "the connection was lost while the unit reset into its loader"),
            Stage::Settle => (UnitNow::Loader, "the connection was lost before the file was sent"),
            Stage::Transfer => (UnitNow::Loader, "the connection was lost in the middle of the file"),
            Stage::Failing { .. } => (UnitNow::Loader, "the upload failed, then the connection was lost"),
            Stage::Finish | Stage::AskVersion(_) => {
                (UnitNow::Unknown, "the connection was lost behind the end of the file, before the unit came back")
            }
        };
        self.end(desk, Verdict::Failed, unit, what)
    }

    fn tick(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some((_, unheard)) = self.unheard.take_if(|(due, _)| *due <= desk.now) {
            match unheard {
                Unheard::Key => desk.send(b"\r"),
                Unheard::Filler => self.fill_up(desk),
            }
        }
        let due = self.deadline.is_some_and(|deadline| deadline <= desk.now);
        match &mut self.stage {
            Stage::Check(identify) => {
                let outcome = identify.handle(Signal::Tick, desk);
                self.deadline = identify.deadline();
                outcome.and_then(|_| self.checked(desk))
            }
            Stage::AskedForLoader if due => {
                desk.leave_dialogue();
                let what = "the unit does not ask for the password";
                self.end(desk, Verdict::UnitRefused, UnitNow::Application, what)
            }
            Stage::PasswordSent if due => {
                let what = "the unit took the password, but its loader does not ask for the file";
                self.end(desk, Verdict::UnitRefused, UnitNow::Unknown, what)
            }
            Stage::Settle if due => {
                desk.cut = true;
                self.mark = desk.received;
                self.stage = Stage::Transfer;
                self.transfer(desk)
            }
            Stage::Transfer => self.transfer(desk),
            Stage::Finish if due => self.judge(desk),
            Stage::AskVersion(identify) => {
                let outcome = identify.handle(Signal::Tick, desk);
                self.deadline = identify.deadline();
                outcome.and_then(|_| self.judge(desk))
            }
            Stage::Failing { what, unit } if due => {
                let (what, unit) = (what.clone(), *unit);
                self.end(desk, Verdict::Failed, unit, what)
            }
            _ => None,
        }
    }

    fn transfer(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let transfer = self.transfer.as_mut()?;
        match transfer.advance(desk.now, desk.transmitter) {
            Ok(false) => self.deadline = transfer.deadline(),
            Ok(true) => {
                self.mark = desk.received;
                self.stage = Stage::Finish;
                self.deadline = Some(desk.now + NEW_BANNER);
                let ends = transfer.may_wait_in_a_record();
                self.unheard = ends.then_some((desk.now + END_UNHEARD, Unheard::Filler));
            }
            Err(stall) => {
                let unit = if transfer.is_taken() { UnitNow::Loader } else { UnitNow::Unknown };
                let what = match stall {
                    Stall::Held => "the loader stopped us (XOFF) and did not let us go on",
                    Stall::Silent => "the loader has fallen silent",
                    Stall::Unacknowledged => "the loader has not acknowledged a record (XOFF, XON), so it may be lost",
                };
                let fill_up = transfer.may_wait_in_a_record();
                desk.transmitter.clear();
                self.fail(desk, desk.received, what.to_owned(), unit);
                if fill_up && stall != Stall::Held {
                    self.fill_up(desk);
                }
            }
        }
        self.report_progress(desk);
        None
    }

    fn report_progress(&mut self, desk: &mut Desk<'_>) {
        self.report_progress_of(self.phase(), desk);
    }

    fn report_progress_of(&mut self, phase: Phase, desk: &mut Desk<'_>) {
        let Some(transfer) = &self.transfer else { return };
        let (records, bytes, bytes_total) = transfer.taken();
        // The header is the first record.
        if records > 1 {
            self.first_data.get_or_insert((desk.now, bytes));
        }
        let (first, before) = self.first_data.unwrap_or((desk.now, bytes));
        let progress = Progress {
            phase,
            records,
            records_total: transfer.sent().1,
            bytes,
            bytes_total,
            address: transfer.address().unwrap_or(0),
            elapsed: transfer.begun().map_or(Duration::ZERO, |begun| desk.now.since(begun)),
            moving: desk.now.since(first),
            moved: bytes - before,
            held: desk.transmitter.held_since().map(|since| desk.now.since(since)),
        };
        let moved = self.progress.is_none_or(|before| {
            (before.phase, before.records, before.held.is_some())
                != (progress.phase, progress.records, progress.held.is_some())
        });
        if moved {
            self.progress = Some(progress);
            desk.events.push_back(Event::Progress(progress));
        }
    }

    fn phase(&self) -> Phase {
        match self.stage {
            Stage::Check(_) => Phase::Check,
            Stage::AskedForLoader | Stage::PasswordSent | Stage::Settle => Phase::EnterLoader,
            Stage::Transfer if self.transfer.as_ref().is_some_and(Transfer::is_erasing) => Phase::Erase,
            Stage::Transfer | Stage::Failing { .. } => Phase::Transfer,
            Stage::Finish => Phase::Finish,
            Stage::AskVersion(_) => Phase::Verify,
        }
    }

    fn end(&mut self, desk: &Desk<'_>, verdict: Verdict, unit: UnitNow, what: impl Into<String>) -> Option<Outcome> {
        let transfer = self.transfer.as_ref();
        let (records, records_total) = transfer.map_or((0, 0), Transfer::sent);
        Some(Outcome::Loaded(Box::new(LoadReport {
            verdict,
            phase: if verdict == Verdict::Done { Phase::Verify } else { self.phase() },
            unit,
            product: self.product.clone(),
            version_before: self.version_before,
            version_after: self.after.version.map(|(_, version)| version),
            records,
            records_total,
            address: transfer.and_then(Transfer::address),
            duration: transfer.and_then(Transfer::begun).map_or(Duration::ZERO, |begun| desk.now.since(begun)),
            what: what.into(),
            heard: self.heard.clone(),
        })))
    }

    /// Something is heard: what was to be sent to a loader that is not heard need not be, or not to its end. The marks
    /// of records before are not it: without a line end they are heard late.
    fn listen(&mut self, message: &Message, desk: &mut Desk<'_>) {
        match self.stage {
            _ if matches!(message, Message::Loader(LoaderText::Progress)) => {}
            Stage::Finish | Stage::Failing { .. } => {
                self.unheard = None;
                if std::mem::take(&mut self.filled) {
                    desk.transmitter.clear();
                }
            }
            Stage::Check(_)
            | Stage::AskedForLoader
            | Stage::PasswordSent
            | Stage::Settle
            | Stage::Transfer
            | Stage::AskVersion(_) => {}
        }
    }

    fn quote(&mut self, text: &Text, message: &Message) {
        if !matches!(message, Message::Row(_)) {
            self.heard = visible::line(text.text.trim().as_bytes()).chars().take(QUOTED).collect();
        }
    }
}

/// Whether a text says something: damage and digits do not.
fn has_a_word(text: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphabetic())
        .any(|word| word.len() >= 4 && !word.bytes().all(|c| c.is_ascii_hexdigit()))
}

impl Work for Upload {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        match signal {
            Signal::Begin => {
                if let Stage::Check(identify) = &mut self.stage {
                    identify.handle(Signal::Begin, desk);
                    self.deadline = identify.deadline();
                }
                None
            }
            Signal::Cancel => self.cancel(desk),
            Signal::LinkLost => self.link_lost(desk),
            Signal::Hold(held) => {
                if let (Stage::Transfer, Some(transfer)) = (&self.stage, &mut self.transfer) {
                    transfer.hold(desk.now, held);
                    if !held {
                        self.strange = 0;
                    }
                }
                self.report_progress(desk);
                None
            }
            Signal::Typed(_) | Signal::Over => None,
            Signal::Tick => self.tick(desk),
            Signal::Heard(text, message) => {
                self.quote(text, message);
                self.listen(message, desk);
                let is_news = text.span.start >= self.mark;
                match &mut self.stage {
                    Stage::Check(identify) | Stage::AskVersion(identify) => {
                        identify.handle(Signal::Heard(text, message), desk);
                        let asking = identify.deadline();
                        if matches!(self.stage, Stage::AskVersion(_)) {
                            self.finishing(message, text.span.end, desk);
                        }
                        if matches!(self.stage, Stage::Check(_) | Stage::AskVersion(_)) {
                            self.deadline = asking;
                        }
                        None
                    }
                    Stage::AskedForLoader | Stage::PasswordSent if is_news => self.entering(message, desk),
                    // More of the prompt: the silence begins anew.
                    Stage::Settle => {
                        self.settle(desk);
                        None
                    }
                    Stage::Transfer if is_news => {
                        self.transferring(text, message, desk);
                        None
                    }
                    Stage::Finish if is_news => {
                        self.finishing(message, text.span.end, desk);
                        None
                    }
                    Stage::Failing { what, .. } if is_news => match message {
                        Message::Loader(LoaderText::Waiting | LoaderText::AnyKey)
                        | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                            let what = what.clone();
                            self.end(desk, Verdict::Failed, UnitNow::Loader, what)
                        }
                        _ => None,
                    },
                    _ => None,
                }
            }
        }
    }

    fn deadline(&self) -> Option<Instant> {
        [self.deadline, self.unheard.map(|(due, _)| due)].into_iter().flatten().min()
    }
}
