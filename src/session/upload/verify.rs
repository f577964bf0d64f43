//! After the end record: the new banner has to name what was sent.

use super::super::event::Outcome;
use super::super::flaw::Flaw;
use super::super::identify::Identify;
use super::super::job::{Desk, Signal, Work};
use super::{Phase, Stage, UnitNow, Upload, Verdict};
use crate::time::{Duration, Instant};
use crate::version::Version;
use crate::wire::{Confidence, LoaderText, Message, Prompt};

/// From the end record to the new banner: the last page, the reset, the first start.
pub(super) const NEW_BANNER: Duration = Duration::from_secs(20);
/// A loader that prompts again after the end record may still hand over to the application after a start delay.
const SECOND_PROMPT: Duration = Duration::from_secs(3);
/// Limit for all waits after the end record together, whatever the unit says: one that keeps restarting is given up.
pub(super) const LONGEST_RETURN: Duration = Duration::from_secs(30);
/// Silence after product and version that ends the banner.
const BANNER_QUIET: Duration = Duration::from_millis(300);
/// How long after a menu, or after the first row, without a version the unit is asked for it.
const ASK_VERSION: Duration = Duration::from_millis(1000);

/// What the unit has said since the end record, or since a failure.
#[derive(Default)]
pub(super) struct After {
    pub(super) product: Option<String>,
    pub(super) version: Option<(Confidence, Version)>,
    application: bool,
    loader_waits: bool,
}

impl After {
    /// Notes what an application says of itself. Returns `false` for every other message.
    pub(super) fn note(&mut self, message: &Message) -> bool {
        match message {
            Message::Software(name) => {
                self.application = true;
                if let Some(product) = &name.product {
                    self.product = Some(product.clone());
                }
                if let Some(version) = name.version
                    && self.version.is_none_or(|(confidence, _)| name.confidence >= confidence)
                {
                    self.version = Some((name.confidence, version));
                }
                true
            }
            // Only an application prints these: a stream that was on resumes with it; no loader reports network or LSS.
            Message::MenuKey(_) | Message::Row(_) | Message::Network(_) => {
                self.application = true;
                true
            }
            _ => false,
        }
    }

    pub(super) fn is_complete(&self) -> bool {
        self.product.is_some() && self.version.is_some()
    }
}

impl Upload {
    /// Something was heard after the end record. Its text ends at offset `end`, in bytes received.
    pub(super) fn finishing(&mut self, message: &Message, end: u64, desk: &mut Desk<'_>) {
        if self.order.flaw == Some(Flaw::BelievesTheLoader)
            && matches!(message, Message::Loader(LoaderText::Loaded | LoaderText::Started))
            && let Some(identity) = self.order.image.identity()
        {
            self.after.product = Some(identity.product.clone());
            self.after.version = Some((Confidence::WithProduct, identity.version));
            self.wait_until(desk.now);
        }
        match message {
            Message::Loader(LoaderText::Error(error)) => {
                let what = format!("the loader reports error {error} at the end of the file");
                let then = self.deserves_another(message, desk);
                self.fail(desk, end, what, UnitNow::Loader, then);
            }
            Message::Loader(LoaderText::Waiting | LoaderText::AnyKey)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                self.after = After { loader_waits: true, ..After::default() };
                self.wait_until(desk.now + SECOND_PROMPT);
            }
            _ if self.after.note(message) => {
                let asked = desk.now + ASK_VERSION;
                match (message, self.after.is_complete()) {
                    (Message::Software(_), true) => self.wait_until(desk.now + BANNER_QUIET),
                    (Message::MenuKey(_), false) => self.wait_until(asked),
                    // Rows may come faster than that, so a later one does not put the question off.
                    (Message::Row(_) | Message::Network(_), false) => {
                        self.deadline = self.deadline.map(|deadline| deadline.min(asked));
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// What has come back is judged at `due`, or earlier if the time for the whole stage ends before.
    fn wait_until(&mut self, due: Instant) {
        if let Stage::Finish { until } = self.stage {
            self.deadline = Some(due.min(until));
        }
    }

    /// The banner is complete, or the time for it is over: decides how the upload ended, or asks for the version.
    pub(super) fn judge(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let image = self.order.image.identity().cloned();
        let version = self.after.version.map(|(_, version)| version);
        if self.after.loader_waits && !self.after.application {
            let what = "the loader took the file but waits for another: it does not start what was sent";
            return self.end(desk, Verdict::Failed, UnitNow::Loader, what);
        }
        match (self.after.product.clone(), version) {
            (Some(product), Some(version)) => {
                let runs = format!("the unit runs {product} V{version}");
                if let Some(transfer) = &mut self.transfer {
                    transfer.take_all_sent();
                }
                self.report_progress_of(Phase::Verify, desk);
                let others = self.product.clone().filter(|meant| !meant.eq_ignore_ascii_case(&product));
                match (image, others) {
                    (None, Some(meant)) => {
                        let what = format!("{runs}, but the file was sent to an {meant}");
                        self.end(desk, Verdict::WrongApplication, UnitNow::Application, what)
                    }
                    (None, None) => {
                        let what = format!(
                            "{runs}; whether that is what was sent cannot be told, since the file has no identity"
                        );
                        self.end(desk, Verdict::Done, UnitNow::Application, what)
                    }
                    (Some(sent), _) if sent.is_for(&product) && sent.version == version => {
                        self.end(desk, Verdict::Done, UnitNow::Application, runs)
                    }
                    (Some(sent), _) => {
                        let what = format!("{runs}, but {} V{} was sent", sent.product, sent.version);
                        self.end(desk, Verdict::WrongApplication, UnitNow::Application, what)
                    }
                }
            }
            _ if self.after.application && !matches!(self.stage, Stage::AskVersion(_)) => {
                let mut identify = Identify::default();
                let outcome = identify.handle(Signal::Begin, desk);
                debug_assert!(outcome.is_none(), "a question has to wait for its answer");
                self.stage = Stage::AskVersion(identify);
                None
            }
            _ if self.after.application => {
                let what =
                    "the file was sent and the unit runs, but which software it runs cannot be told from what it says";
                self.end(desk, Verdict::Failed, UnitNow::Unknown, what)
            }
            _ => {
                let what = "the file was sent, but the unit has not come back";
                self.end(desk, Verdict::Failed, UnitNow::Unknown, what)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::SoftwareName;

    fn named(product: Option<&str>, version: (u8, u8, u8), confidence: Confidence) -> Message {
        let (major, minor, patch) = version;
        let version = Some(Version::new(major.into(), minor.into(), patch.into()));
        Message::Software(SoftwareName { product: product.map(str::to_owned), version, confidence })
    }

    #[test]
    fn of_all_versions_the_one_that_is_surest_counts_and_of_those_the_last() {
        let mut after = After::default();
        assert!(after.note(&named(None, (3, 2, 1), Confidence::Bare)));
        assert!(!after.is_complete(), "which product it is has not been said");
        assert!(after.note(&named(Some("AXTC4CO"), (1, 2, 0), Confidence::WithProduct)));
        assert!(after.is_complete());
        after.note(&named(None, (9, 9, 9), Confidence::Named));
        assert_eq!(after.version.map(|(_, version)| version), Some(Version::new(1, 2, 0)));
        after.note(&named(Some("AXTC4CO"), (1, 3, 0), Confidence::WithProduct));
        assert_eq!(after.version.map(|(_, version)| version), Some(Version::new(1, 3, 0)));
        assert!(!after.note(&Message::Text) && !after.note(&Message::Refusal));
    }
}
