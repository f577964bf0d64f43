//! Uploading new software: identify the unit, enter its loader, send the records, and trust only the new banner.
//!
//! The rules, each learnt from an upload that failed:
//! - no record leaves before the loader has prompted for the file, and at most one more after the first text that does
//!   not come from a loader taking records: a record begins with `S` and may contain `D`, which are keys of the menu;
//! - text printed before a reset proves nothing about the time after it: each stage ignores text older than its mark;
//! - "loaded" proves only that the end record arrived; the new banner has to name the image's product and version;
//! - every wait has an end, and every report says what state the unit is in now.

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
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::{Message, Prompt, visible};
use transfer::Transfer;
use verify::After;

/// Gets a g3 out of a record in which it has lost its place: enough characters to fill the longest record (the loader
/// takes any character for a digit), and a line end. At a menu Enter does nothing.
const FILLER: [u8; 516] = [b'\r'; 516];

/// How long a question may go on that begins like the one for the password.
const ASKED_AGAIN: Duration = Duration::from_millis(80);

/// The job.
pub(super) struct Upload {
    order: LoadOrder,
    /// Product name, once it is known.
    product: Option<String>,
    version_before: Option<Version>,
    transfer: Option<Transfer>,
    stage: Stage,
    /// Set once the upload has been given up before the reset: the unit may still have a question open, which is left.
    leaving: Option<Leaving>,
    /// When the stage is looked at again. One that asks who is there has a deadline of its own.
    deadline: Option<Instant>,
    /// What is sent at this time, unless what is heard until then makes it unnecessary.
    unheard: Option<(Instant, Unheard)>,
    /// The password has been queued.
    password_sent: bool,
    /// The letters of the question that it answers.
    question: String,
    /// When that question counts as asked again.
    asked_again: Option<Instant>,
    /// How many keys have been sent to a loader that wants one.
    keys_sent: u32,
    /// Why the image does not fit this unit, if the upload was refused for that.
    misfit: Option<DefectId>,
    /// When the last key before the first record was sent to a loader that was found waiting. It may answer late.
    asked_in_loader: Option<Instant>,
    /// The unit was waiting in its loader when it was found.
    found_in_loader: bool,
    attempt: Attempt,
    /// Until when a silent unit is asked again and again.
    patience: Option<Instant>,
    /// Bytes received before this job began. A product that was named earlier may be that of another unit.
    asked_from: u64,
    /// Text that begins before this offset, in bytes received, is too old for the current stage.
    mark: u64,
    /// The last text heard in this job that was not a row of the stream.
    heard: String,
    cancelled: bool,
    /// When a hold that lasts is reported again.
    hold_due: Option<Instant>,
    after: After,
    progress: Option<Progress>,
    /// When the loader had taken the first data, and how many characters it had then.
    first_data: Option<(Instant, usize)>,
}

/// The state of one pass through the file, reset before the next one.
#[derive(Debug, Default)]
struct Attempt {
    /// Lines of unknown words since the loader last acknowledged anything.
    strange: usize,
    /// Records that had been sent when the first of these lines came.
    strange_from: usize,
    /// Letters of the text without a line end that was heard last.
    talk: String,
    /// Before this time no record leaves: words that have come are heard out.
    talks_until: Option<Instant>,
    /// [`FILLER`] has been queued, and all of it leaves unless the loader is heard first.
    filled: bool,
}

enum Stage {
    Check(Identify),
    /// L has been sent.
    AskedForLoader(Answer),
    /// The password has been sent.
    PasswordSent,
    /// No loader has prompted for the file in time: the unit is identified again.
    AskWho(Identify),
    /// The loader has prompted for the file and may go on printing, until `until` at the latest.
    Settle {
        until: Instant,
    },
    Transfer,
    /// The end record has been sent; the unit has to be back by `until`.
    Finish {
        until: Instant,
    },
    /// The application runs but has not said its version: it is asked for it.
    AskVersion(Identify),
    /// The transfer has failed. What is heard next, such as the loader's prompt, decides what is reported of the unit.
    Failing {
        what: String,
        unit: UnitNow,
        phase: Phase,
        /// Whether and why everything is sent again as soon as the loader prompts.
        then: Option<Again>,
    },
}

/// What a unit has answered to L.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    /// Nothing that is understood.
    None,
    /// Something that sounds like a refusal, but may be a note before the question.
    Refusal,
    /// The question for the password, which the unit may still be printing.
    Question,
}

/// Why everything is sent once more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Again {
    /// The records came too fast for the loader.
    Slower,
    /// The error was the loader's late answer to a key sent before the first record; no record caused it.
    AsBefore,
}

/// What is sent to a loader from which nothing, or nothing that is understood, is heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unheard {
    /// The key for which it is assumed to wait.
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
            question: String::new(),
            asked_again: None,
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
            // The reset cannot be called off. Within a few seconds it shows what state the unit is in.
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

    /// The state in which the unit was found; it holds as long as nothing has changed the unit.
    fn as_found(&self, desk: &Desk<'_>) -> UnitNow {
        match desk.facts.state {
            UnitState::Application => UnitNow::Application,
            UnitState::Loader => UnitNow::Loader,
            UnitState::Silent | UnitState::Unknown => UnitNow::Unknown,
        }
    }

    /// The port is gone: the unit's state is inferred from the stage that was reached.
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
        let is_asked_again = matches!(self.stage, Stage::PasswordSent) && self.is_asked_again(desk);
        self.asked_again = is_asked_again.then(|| self.asked_again.unwrap_or(desk.now + ASKED_AGAIN));
        if self.asked_again.is_some_and(|due| due <= desk.now) {
            self.heard = desk.pending.map(|text| visible::quoted(&text.text)).unwrap_or_default();
            self.turn_back(desk, Verdict::UnitRefused, "the unit did not accept the password");
            return None;
        }
        let due = self.deadline.is_some_and(|deadline| deadline <= desk.now);
        match &mut self.stage {
            Stage::Check(identify) => identify.handle(Signal::Tick, desk).and_then(|_| self.checked(desk)),
            &mut Stage::AskedForLoader(answer) if due => {
                match answer {
                    Answer::Question => {
                        let question = self.heard.clone();
                        self.send_password(&question, desk);
                    }
                    Answer::Refusal => self.refused(desk),
                    Answer::None => self.not_asked(desk),
                }
                None
            }
            Stage::PasswordSent if due => self.ask_who(desk),
            Stage::AskWho(identify) => identify.handle(Signal::Tick, desk).and_then(|_| self.who_is_there(desk)),
            Stage::Settle { .. } if due => {
                desk.cut = true;
                self.mark = desk.received;
                self.stage = Stage::Transfer;
                self.transfer(desk)
            }
            Stage::Transfer => self.transfer(desk),
            Stage::Finish { .. } if due => self.judge(desk),
            Stage::AskVersion(identify) => identify.handle(Signal::Tick, desk).and_then(|_| self.judge(desk)),
            Stage::Failing { .. } if due => self.failed(desk),
            _ => None,
        }
    }
}

/// Whether a unit says that it takes no more passwords for now: "Locked for 20 s".
fn tells_of_a_lock(text: &str) -> bool {
    let lower = text.to_lowercase();
    lower.contains("lock") || lower.contains("too many")
}

/// Whether only an application prints such a message.
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
            // Why nothing is uploaded has been decided. The unit may still say what came of it.
            if let Signal::Heard(text, _) = signal
                && tells_of_a_lock(&text.text)
            {
                self.heard = visible::quoted(&text.text);
            }
            let mut outcome = leaving.handle(signal, leaving.then(), desk);
            if let Some(Outcome::Loaded(report)) = &mut outcome {
                report.heard.clone_from(&self.heard);
            }
            return outcome;
        }
        match signal {
            Signal::Begin => {
                self.asked_from = desk.received;
                if let Stage::Check(identify) = &mut self.stage {
                    identify.handle(Signal::Begin, desk);
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
                        if matches!(self.stage, Stage::AskVersion(_)) {
                            self.finishing(message, text.span.end, desk);
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
        let stage = match &self.stage {
            Stage::Check(identify) | Stage::AskWho(identify) | Stage::AskVersion(identify) => identify.deadline(),
            _ => self.deadline,
        };
        [stage, self.unheard.map(|(due, _)| due), self.hold_due, self.asked_again].into_iter().flatten().min()
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
        // A loader may name the product, too.
        assert!(!shows_application(&software(None)));
        assert!(!shows_application(&Message::Text) && !shows_application(&Message::Loader(LoaderText::Waiting)));
    }
}
