//! Uploading new software: find out who is there, enter the loader, send, and trust only the new banner.
//!
//! The rules, each of which has broken a real upload somewhere:
//! - no record leaves before the loader's own prompt, and none after the first text that says otherwise: a record
//!   begins with `S` and may contain `D`, which are keys of the menu;
//! - text from before a reset proves nothing about after it: each stage reads what is newer than its mark;
//! - "loaded" proves only that the end record arrived; product and version in the new banner have to be the image's;
//! - every wait has an end, and every end says what the unit is now.

mod enter;
mod pages;
mod records;
mod report;
mod telling;
mod transfer;
mod under_way;
mod verify;

pub use report::{LoadReport, Phase, Progress, Proof, SEE_POWER, SILENT, UnitNow, Verdict};
pub(super) use telling::size;

use super::event::{LoadOrder, Outcome, UnitState};
use super::identify::Identify;
use super::job::{Desk, Signal, Work};
use super::leaving::Leaving;
use crate::image::DefectId;
use crate::time::Instant;
use crate::version::Version;
use crate::wire::{Message, Prompt};
use transfer::Transfer;
use verify::After;

/// What brings a loader out of a record it has lost its place in: as many digits as the longest record has (it takes
/// anything for a digit), and a line end. At a menu Enter does nothing.
const FILLER: [u8; 516] = [b'\r'; 516];

/// The job.
pub(super) struct Upload {
    order: LoadOrder,
    /// Product name, once it is known.
    product: Option<String>,
    version_before: Option<Version>,
    transfer: Option<Transfer>,
    stage: Stage,
    /// The unit is not asked for its loader any more, but may still ask something.
    leaving: Option<Leaving>,
    deadline: Option<Instant>,
    /// What is to be sent if nothing is heard until then.
    unheard: Option<(Instant, Unheard)>,
    /// The password has been queued.
    password_sent: bool,
    /// Keys a loader that wants one has got.
    keys_sent: u32,
    /// What speaks against the image for this unit.
    misfit: Option<DefectId>,
    /// When a loader that was found waiting was asked something that may still be answered.
    asked_in_loader: Option<Instant>,
    /// The unit was waiting in its loader when it was found.
    found_in_loader: bool,
    attempt: Attempt,
    /// How long a silent unit is asked again and again.
    patience: Option<Instant>,
    /// What the unit says from this offset on answers the question who is there.
    asked_from: u64,
    /// Text that begins before this offset is history.
    mark: u64,
    /// The last text heard in this job that was not a row of the stream.
    heard: String,
    cancelled: bool,
    /// When a hold is reported again.
    hold_due: Option<Instant>,
    after: After,
    progress: Option<Progress>,
    /// When the loader had taken the first data, and how many characters it had then.
    first_data: Option<(Instant, usize)>,
}

/// What is kept of one pass through the file; the next one starts from scratch.
#[derive(Debug, Default)]
struct Attempt {
    /// Lines of unknown words since the loader has acknowledged anything, and the records sent before the first.
    strange: usize,
    strange_from: usize,
    /// Letters of a text without a line end among the records, and until when something that may be talking is heard out
    /// before the next record goes.
    talk: String,
    talks_until: Option<Instant>,
    /// The loader has been brought out of a record once.
    filled: bool,
}

enum Stage {
    Check(Identify),
    /// L is out.
    AskedForLoader(Answer),
    /// The password is out.
    PasswordSent,
    /// No loader has asked for the file: who is there is asked.
    AskWho(Identify),
    /// The loader's prompt has been seen; more of it may come, until then at most.
    Settle {
        until: Instant,
    },
    Transfer,
    /// The end record is out; the unit has to have come back by then.
    Finish {
        until: Instant,
    },
    /// The unit runs but has not said its version: it is asked.
    AskVersion(Identify),
    /// The loader, or something else, has said that it is over; whether the loader waits again decides what the unit is now.
    Failing {
        what: String,
        unit: UnitNow,
        phase: Phase,
        /// What happens as soon as the loader waits for a file again, if anything does.
        then: Option<Again>,
    },
}

/// What a unit has answered to L.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    /// Nothing that is understood.
    None,
    /// Something that sounds like a refusal, and may be a note before the question.
    Refusal,
    /// The question for the password, which it may still be printing.
    Question,
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

impl Upload {
    pub(super) fn new(order: LoadOrder) -> Self {
        Upload {
            order,
            product: None,
            version_before: None,
            transfer: None,
            stage: Stage::Check(Identify::default()),
            leaving: None,
            deadline: None,
            unheard: None,
            password_sent: false,
            keys_sent: 0,
            misfit: None,
            found_in_loader: false,
            asked_in_loader: None,
            attempt: Attempt::default(),
            patience: None,
            asked_from: 0,
            mark: 0,
            heard: String::new(),
            cancelled: false,
            hold_due: None,
            after: After::default(),
            progress: None,
            first_data: None,
        }
    }

    fn cancel(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        match &self.stage {
            Stage::Check(_) => {
                let unit = self.as_found(desk);
                self.end(desk, Verdict::Interrupted, unit, "cancelled before anything was changed")
            }
            Stage::AskedForLoader(_) => {
                self.turn_back(desk, Verdict::Interrupted, "cancelled before anything was changed");
                None
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
            Stage::Finish { .. } | Stage::AskVersion(_) => {
                let what = "cancelled after the end of the file, before the unit came back";
                self.end(desk, Verdict::Interrupted, UnitNow::Unknown, what)
            }
            Stage::Failing { then: Some(_), .. } => {
                self.end(desk, Verdict::Interrupted, UnitNow::Loader, "cancelled in the middle of the file")
            }
            Stage::Failing { .. } => self.failed(desk),
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
            Stage::AskedForLoader(_) => (UnitNow::Application, "the connection was lost before anything was changed"),
            Stage::PasswordSent | Stage::AskWho(_) => {
                (UnitNow::Unknown, "the connection was lost while the unit reset into its loader")
            }
            Stage::Settle { .. } => (UnitNow::Loader, "the connection was lost before the file was sent"),
            Stage::Transfer => (UnitNow::Loader, "the connection was lost in the middle of the file"),
            Stage::Failing { .. } => (UnitNow::Loader, "the upload failed, then the connection was lost"),
            Stage::Finish { .. } | Stage::AskVersion(_) => {
                (UnitNow::Unknown, "the connection was lost after the end of the file, before the unit came back")
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
            &mut Stage::AskedForLoader(answer) if due => {
                match answer {
                    Answer::Question => self.send_password(desk),
                    Answer::Refusal => self.refused(desk),
                    Answer::None => self.not_asked(desk),
                }
                None
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
            Stage::Finish { .. } if due => self.judge(desk),
            Stage::AskVersion(identify) => {
                let outcome = identify.handle(Signal::Tick, desk);
                self.deadline = identify.deadline();
                outcome.and_then(|_| self.judge(desk))
            }
            Stage::Failing { .. } if due => self.failed(desk),
            _ => None,
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

impl Work for Upload {
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(leaving) = &mut self.leaving {
            // Why nothing is uploaded has been decided.
            return leaving.handle(signal, leaving.then(), desk);
        }
        match signal {
            Signal::Begin => {
                self.asked_from = desk.received;
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
                        self.attempt.strange = 0;
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
                    Stage::AskedForLoader(_) | Stage::PasswordSent if is_news => self.entering(text, message, desk),
                    &mut Stage::Settle { until } => self.settling(message, until, desk),
                    Stage::Transfer if is_news => {
                        self.transferring(text, message, desk);
                        None
                    }
                    Stage::Finish { .. } if is_news => {
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
        if let Some(leaving) = &self.leaving {
            return Some(leaving.due());
        }
        [self.deadline, self.unheard.map(|(due, _)| due), self.hold_due].into_iter().flatten().min()
    }

    fn awaits(&self, prompt: Prompt) -> bool {
        matches!(self.stage, Stage::AskedForLoader(_)) && self.leaving.is_none() && prompt == Prompt::Password
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_application_shows_its_menu_its_first_start_rows_or_its_version() {
        use crate::version::Version;
        use crate::wire::{Confidence, LoaderText, MenuKey, SoftwareName};
        let software = |version| {
            Message::Software(SoftwareName {
                product: Some("AXTC4CO".into()),
                version,
                confidence: Confidence::WithProduct,
            })
        };
        assert!(shows_application(&Message::MenuKey(MenuKey::View)));
        assert!(shows_application(&Message::FirstStart));
        assert!(shows_application(&software(Some(Version::new(1, 2, 0)))));
        // A loader names the product as well.
        assert!(!shows_application(&software(None)));
        assert!(!shows_application(&Message::Text) && !shows_application(&Message::Loader(LoaderText::Waiting)));
    }
}
