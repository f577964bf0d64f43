//! Uploading new software: find out who is there, enter the loader, send, and believe only the new banner.
//!
//! The rules, each of which has broken a real upload somewhere:
//! - no record leaves before the loader's own prompt, and none behind the first text that says otherwise: a record
//!   begins with `S` and may contain `D`, which are keys of the menu;
//! - text from before a reset proves nothing about after it: each stage reads what is newer than its mark;
//! - "loaded" proves only that the end record arrived; product and version in the new banner have to be the image's;
//! - every wait has an end, and every end says what the unit is now.

mod enter;
mod pages;
mod records;
#[cfg(test)]
mod tests;
mod transfer;
mod verify;

use super::event::{Event, LoadOrder, LoadReport, Outcome, Phase, Progress, UnitNow, UnitState, Verdict};
use super::flaw::Flaw;
use super::identify::Identify;
use super::job::{Desk, Signal, Work};
use crate::device::{LoaderKind, Pacing, Product};
use crate::image::DefectId;
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::{LoaderError, LoaderText, Message, Prompt, Text, visible};
use transfer::{Stall, Transfer};
use verify::{After, NEW_BANNER};

/// How long the loader may take after an error to say that it waits again.
const RESTART: Duration = Duration::from_secs(2);
/// Lines of words nobody knows that a loader may print between two acknowledgements: it may have something to say of its
/// erasing. A menu that takes records for keys says one or two behind each.
const MOST_STRANGE: usize = 3;
/// Records to such a line behind which they are a loader's own way to show its progress: it has one for each page.
const RECORDS_TO_A_PAGE: usize = 4;
/// How long words are given to become something that is known: text whose line end the line has lost is looked at when it
/// has stood still for 60 ms, an adapter of 20 ms on the way.
const HEARD_OUT: Duration = Duration::from_millis(100);
/// How long a loader with a ring may be silent behind the end record, before it is taken to wait for the rest of it.
const END_UNHEARD: Duration = Duration::from_millis(1500);
/// What brings a loader out of a record it has lost its place in: as many digits as the longest record has (it takes
/// anything for a digit), and a line end. At a menu Enter does nothing.
const FILLER: [u8; 516] = [b'\r'; 516];
/// How often a hold is told of while it lasts.
const HOLD_TOLD: Duration = Duration::from_secs(1);
/// How late a loader that was found waiting may answer what it was asked before the first record, on a busy computer.
const LATE_ANSWER: Duration = Duration::from_secs(2);
/// The loaders' number for a record that came while another was parked.
const OVERRUN: u32 = 5;
/// Their number for characters lost or damaged on the line, as those are that come while a page is written.
const DAMAGED: u32 = 1;
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
    /// Keys a loader that wants one has got.
    keys_sent: u32,
    /// What speaks against the image for this unit.
    misfit: Option<DefectId>,
    /// When a loader that was found waiting was asked something that may still be answered.
    asked_in_loader: Option<Instant>,
    /// The unit was waiting in its loader when it was found.
    found_in_loader: bool,
    /// Lines of words nobody knows since the loader has acknowledged anything, and the records sent before the first.
    strange: usize,
    strange_from: usize,
    /// Letters of a text without a line end that stands behind the records, and until when something that may talk is
    /// heard out before the next record goes.
    talk: String,
    talks_until: Option<Instant>,
    /// The loader has been brought out of a record once.
    filled: bool,
    /// How long a silent unit is asked again and again.
    patience: Option<Instant>,
    /// Text that begins before this offset is history.
    mark: u64,
    /// The last text heard in this job that was not a row of the stream.
    heard: String,
    cancelled: bool,
    /// When a hold is told of again.
    hold_due: Option<Instant>,
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
    /// No loader has asked for the file: who is there is asked.
    AskWho(Identify),
    /// The loader's prompt has been seen; more of it may come, until then at most.
    Settle {
        until: Instant,
    },
    Transfer,
    /// The end record is out.
    Finish,
    /// The unit runs but has not said its version: it is asked.
    AskVersion(Identify),
    /// The loader, or somebody, has said that it is over; whether the loader waits again decides what the unit is now.
    Failing {
        what: String,
        unit: UnitNow,
        phase: Phase,
        /// What happens as soon as the loader waits for a file again, if anything does.
        then: Option<Again>,
    },
}

/// Why everything is sent once more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Again {
    /// It was too fast for the loader.
    Slower,
    /// The loader has answered late what was asked before the first record: the error is not that record's.
    AsBefore,
}

/// What is to be sent to a loader that is not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unheard {
    /// The key it must be waiting for.
    Key,
    /// [`FILLER`].
    Filler,
}

/// Records and characters that an order sends to the loader it is believed to meet: the one the user has named, else that
/// of the product, which is the image's as long as nobody has said another.
pub(super) fn size(order: &LoadOrder) -> (usize, usize) {
    let image_for = || order.image.identity().map(|identity| identity.product.as_str());
    let product = order.product.as_deref().or_else(image_for).and_then(Product::named);
    let loader = order.loader.or_else(|| product.map(|product| product.loader.kind));
    let pacing = loader.map_or(Pacing::Pages, LoaderKind::pacing);
    let size = transfer::believed_size(order.packed, pacing);
    let records = records::build(order.image.image(), size, records::LINE_END);
    (records.len(), records::characters(&records))
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
            keys_sent: 0,
            misfit: None,
            found_in_loader: false,
            asked_in_loader: None,
            strange: 0,
            strange_from: 0,
            talk: String::new(),
            talks_until: None,
            filled: false,
            patience: None,
            mark: 0,
            heard: String::new(),
            cancelled: false,
            hold_due: None,
            after: After::default(),
            progress: None,
            first_data: None,
        }
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
            _ if self.is_echo_of_header(text) => None,
            Message::Loader(LoaderText::Progress) => None,
            _ if self.order.flaw == Some(Flaw::SendsBehindErrors) => None,
            Message::Text | Message::Refusal => {
                let sent = self.transfer.as_ref().map_or(0, |transfer| transfer.reached().sent);
                if self.strange == 0 {
                    self.strange_from = sent;
                }
                if has_a_word(&text.text) {
                    self.strange += 1;
                    self.talks_until = Some(desk.now + HEARD_OUT);
                }
                let pages = (sent - self.strange_from.min(sent)) / RECORDS_TO_A_PAGE;
                let what = "what answers does not talk as a loader does".to_owned();
                (self.strange > MOST_STRANGE.max(pages)).then_some((what, UnitNow::Unknown))
            }
            Message::Loader(LoaderText::Error(error)) => {
                Some((format!("the loader reports error {error}"), UnitNow::Loader))
            }
            Message::Loader(LoaderText::Waiting | LoaderText::Restarting | LoaderText::AnyKey | LoaderText::Header)
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
                let then = self.deserves_another(message, desk);
                self.fail(desk, text.span.end, what, unit, then);
            }
        }
    }

    /// Whether the loader complains of something that would not be so the next time, and why.
    fn deserves_another(&mut self, message: &Message, desk: &Desk<'_>) -> Option<Again> {
        let Message::Loader(LoaderText::Error(error)) = message else { return None };
        let transfer = self.transfer.as_ref()?;
        let is_too_fast = match error {
            // Characters that came while it was deaf are no overrun, and may have been damaged on the line as well.
            LoaderError::Number(number) => *number == OVERRUN || *number == DAMAGED && transfer.is_surprised(),
            LoaderError::Status(_) => false,
        };
        if is_too_fast && transfer.may_go_slower() {
            return Some(Again::Slower);
        }
        let asked_at = self.asked_in_loader.take()?;
        (desk.now < asked_at + LATE_ANSWER && transfer.has_hardly_begun()).then_some(Again::AsBefore)
    }

    /// Nothing is sent any more; what comes behind `mark` says what the unit is now.
    fn fail(&mut self, desk: &Desk<'_>, mark: u64, what: String, unit: UnitNow, then: Option<Again>) {
        self.mark = mark;
        self.stage = Stage::Failing { what, unit, phase: self.phase(), then };
        self.deadline = Some(desk.now + RESTART);
    }

    /// Something was heard behind a failure: the loader may wait for a file again.
    fn failing(&mut self, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        let Stage::Failing { what, then, .. } = &self.stage else { return None };
        match message {
            Message::Loader(LoaderText::Waiting | LoaderText::AnyKey)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                let (what, then) = (what.clone(), *then);
                if let (Some(then), Some(transfer)) = (then, &mut self.transfer) {
                    match then {
                        Again::Slower => transfer.start_over_slowly(),
                        Again::AsBefore => transfer.begin_again(),
                    }
                    self.report_progress(desk);
                    return self.entered(desk);
                }
                self.end(desk, Verdict::Failed, UnitNow::Loader, what)
            }
            _ if shows_application(message) => {
                let what = what.clone();
                self.after.note(message);
                self.end(desk, Verdict::Failed, UnitNow::Application, what)
            }
            _ => None,
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
            Stage::PasswordSent | Stage::AskWho(_) => {
                self.cancelled = true;
                None
            }
            Stage::Settle { .. } => {
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled; nothing has been sent")
            }
            Stage::Transfer => {
                desk.transmitter.clear();
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled in the middle of the file")
            }
            Stage::Finish | Stage::AskVersion(_) => {
                let what = "cancelled behind the end of the file, before the unit came back";
                self.end(desk, Verdict::Interrupted, UnitNow::Unknown, what)
            }
            Stage::Failing { then: Some(_), .. } => {
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled in the middle of the file")
            }
            Stage::Failing { what, unit, .. } => {
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
            Stage::PasswordSent | Stage::AskWho(_) => {
                (UnitNow::Unknown, "the connection was lost while the unit reset into its loader")
            }
            Stage::Settle { .. } => (UnitNow::Loader, "the connection was lost before the file was sent"),
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
                Unheard::Key => self.send_key(desk),
                Unheard::Filler => self.fill_up(desk),
            }
        }
        if self.hold_due.take_if(|due| *due <= desk.now).is_some() {
            self.report_progress(desk);
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
            Stage::PasswordSent if due => self.ask_who(desk),
            Stage::AskWho(identify) => {
                let outcome = identify.handle(Signal::Tick, desk);
                self.deadline = identify.deadline();
                outcome.and_then(|_| self.who_is_there(desk))
            }
            Stage::Settle { .. } if due => {
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
            Stage::Failing { what, unit, .. } if due => {
                let (what, unit) = (what.clone(), *unit);
                self.end(desk, Verdict::Failed, unit, what)
            }
            _ => None,
        }
    }

    /// Until when no record goes, because something talks. A loader that takes records makes marks; words may be the
    /// first ones of a unit that has started anew, whose keys the records would be.
    fn hears_out(&mut self, desk: &Desk<'_>) -> Option<Instant> {
        let words = desk.pending.map_or("", |text| &text.text);
        let letters =
            if has_a_word(words) { words.chars().filter(char::is_ascii_alphabetic).collect() } else { String::new() };
        if self.talk != letters {
            self.talks_until = (!letters.is_empty()).then_some(desk.now + HEARD_OUT).or(self.talks_until);
            self.talk = letters;
        }
        self.talks_until.filter(|&until| desk.now < until && self.order.flaw != Some(Flaw::SendsBehindErrors))
    }

    fn transfer(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(until) = self.hears_out(desk) {
            self.deadline = Some(until);
            return None;
        }
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
                self.fail(desk, desk.received, what.to_owned(), unit, None);
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
        let reached = transfer.reached();
        let (records, bytes) = (reached.taken, reached.bytes_taken);
        let (records_total, bytes_total) = transfer.total();
        // The header is the first record.
        if records > 1 {
            self.first_data.get_or_insert((desk.now, bytes));
        } else {
            self.first_data = None; // It begins, perhaps anew.
        }
        let (first, before) = self.first_data.unwrap_or((desk.now, bytes));
        let progress = Progress {
            phase,
            records,
            records_total,
            bytes,
            bytes_total,
            address: transfer.address().unwrap_or(0),
            elapsed: transfer.begun().map_or(Duration::ZERO, |begun| desk.now.since(begun)),
            moving: desk.now.since(first),
            moved: bytes.saturating_sub(before),
            held: desk.transmitter.held_since().map(|since| desk.now.since(since)),
            again: transfer.is_again(),
        };
        let stands = |at: &Progress| (at.phase, at.records, at.records_total, at.again, at.held.is_some());
        let moved = self.progress.is_none_or(|before| {
            stands(&before) != stands(&progress)
                || progress.held.zip(before.held).is_some_and(|(now, before)| now >= before + HOLD_TOLD)
        });
        if moved {
            self.hold_due = progress.held.map(|_| desk.now + HOLD_TOLD);
            self.progress = Some(progress);
            desk.events.push_back(Event::Progress(progress));
        }
    }

    fn phase(&self) -> Phase {
        match self.stage {
            Stage::Check(_) => Phase::Check,
            Stage::AskedForLoader | Stage::PasswordSent | Stage::AskWho(_) | Stage::Settle { .. } => Phase::EnterLoader,
            Stage::Transfer if self.transfer.as_ref().is_some_and(Transfer::is_erasing) => Phase::Erase,
            Stage::Transfer => Phase::Transfer,
            Stage::Failing { phase, .. } => phase,
            Stage::Finish => Phase::Finish,
            Stage::AskVersion(_) => Phase::Verify,
        }
    }

    fn end(&mut self, desk: &Desk<'_>, verdict: Verdict, unit: UnitNow, what: impl Into<String>) -> Option<Outcome> {
        let transfer = self.transfer.as_ref();
        let records = transfer.map_or(0, |transfer| transfer.reached().sent);
        let records_total = transfer.map_or(0, |transfer| transfer.total().0);
        Some(Outcome::Loaded(Box::new(LoadReport {
            verdict,
            phase: if verdict == Verdict::Done { Phase::Verify } else { self.phase() },
            unit,
            found_in_loader: self.found_in_loader,
            product: self.product.clone(),
            version_before: self.version_before,
            version_after: self.after.version.map(|(_, version)| version),
            records,
            records_total,
            address: transfer.and_then(Transfer::address),
            duration: transfer.and_then(Transfer::begun).map_or(Duration::ZERO, |begun| desk.now.since(begun)),
            what: what.into(),
            heard: self.heard.clone(),
            misfit: self.misfit,
            // Before a loader has taken everything, what it seems to be may have been a unit without power.
            remark: transfer.and_then(Transfer::remark).filter(|_| verdict == Verdict::Done),
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
            | Stage::AskWho(_)
            | Stage::Settle { .. }
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

/// Whether only an application says so.
fn shows_application(message: &Message) -> bool {
    match message {
        Message::MenuKey(_) | Message::FirstStart | Message::Row(_) => true,
        Message::Software(name) => name.version.is_some(),
        _ => false,
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
                    Stage::Check(identify) | Stage::AskWho(identify) | Stage::AskVersion(identify) => {
                        identify.handle(Signal::Heard(text, message), desk);
                        let asking = identify.deadline();
                        if matches!(self.stage, Stage::AskVersion(_)) {
                            self.finishing(message, text.span.end, desk);
                        }
                        if matches!(self.stage, Stage::Check(_) | Stage::AskWho(_) | Stage::AskVersion(_)) {
                            self.deadline = asking;
                        }
                        None
                    }
                    Stage::AskedForLoader | Stage::PasswordSent if is_news => self.entering(message, desk),
                    &mut Stage::Settle { until } => self.settling(message, until, desk),
                    Stage::Transfer if is_news => {
                        self.transferring(text, message, desk);
                        None
                    }
                    Stage::Finish if is_news => {
                        self.finishing(message, text.span.end, desk);
                        None
                    }
                    Stage::Failing { .. } if is_news => self.failing(message, desk),
                    _ => None,
                }
            }
        }
    }

    fn deadline(&self) -> Option<Instant> {
        [self.deadline, self.unheard.map(|(due, _)| due), self.hold_due].into_iter().flatten().min()
    }
}
