//! After the end record: what comes back has to say that it is what was sent.

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
/// All of that at most, whatever is said meanwhile: a unit that restarts again and again is not waited for.
pub(super) const LONGEST_RETURN: Duration = Duration::from_secs(30);
/// Silence after product and version that ends the banner.
const BANNER_QUIET: Duration = Duration::from_millis(300);
/// Silence after a menu, or rows, without a version before the unit is asked.
const ASK_VERSION: Duration = Duration::from_millis(1000);

/// What has been heard since the end record.
#[derive(Default)]
pub(super) struct After {
    pub(super) product: Option<String>,
    pub(super) version: Option<(Confidence, Version)>,
    application: bool,
    loader_waits: bool,
}

impl After {
    /// Notes what an application says of itself. Gives `false` for everything else.
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
            // A stream that was on comes back with the application, LSS and the network are reported by it alone.
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
    /// Something was heard after the end record. It ends at `end` in the record.
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
            Message::Loader(LoaderText::Loaded) => {
                if let Some(transfer) = &mut self.transfer {
                    transfer.take_all_sent();
                }
            }
            _ if self.after.note(message) => {
                let asked = desk.now + ASK_VERSION;
                match (message, self.after.is_complete()) {
                    (Message::Software(_), true) => self.wait_until(desk.now + BANNER_QUIET),
                    (Message::MenuKey(_), false) => self.wait_until(asked),
                    // Rows may come faster than that: the unit is asked between them.
                    (Message::Row(_) | Message::Network(_), false) => {
                        self.deadline = self.deadline.map(|deadline| deadline.min(asked));
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// What comes back is judged then, or when the time for all of it is over.
    fn wait_until(&mut self, due: Instant) {
        if let Stage::Finish { until } = self.stage {
            self.deadline = Some(due.min(until));
        }
    }

    /// The banner is complete, or its time is over.
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
                self.deadline = identify.deadline();
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
