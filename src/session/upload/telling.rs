//! What is reported of an upload: its size beforehand, its progress, and how it ended.

use super::super::event::{Event, LoadOrder, Outcome};
use super::super::job::Desk;
use super::{LoadReport, Phase, Progress, Proof, Stage, UnitNow, Upload, Verdict, records, transfer};
use crate::device::{LoaderKind, Pacing, Product};
use crate::time::Duration;
use crate::wire::{Message, Text, visible};
use transfer::Transfer;

/// How often a hold is reported while it lasts.
const HOLD_TOLD: Duration = Duration::from_secs(1);

/// How many records and characters an order sends. That depends on the loader: the one the order names, else that of
/// the product it names, else that of the image's product, else one that stops its sender for pages.
pub(in crate::session) fn size(order: &LoadOrder) -> (usize, usize) {
    let image_for = || order.image.identity().map(|identity| identity.product.as_str());
    let product = order.product.as_deref().or_else(image_for).and_then(Product::named);
    let loader = order.loader.or_else(|| product.map(|product| product.loader.kind));
    let pacing = loader.map_or(Pacing::Pages, LoaderKind::pacing);
    let size = transfer::believed_size(order.packed, pacing);
    let records = records::build(order.image.image(), size, records::LINE_END);
    (records.len(), records::characters(&records))
}

impl Upload {
    pub(super) fn report_progress(&mut self, desk: &mut Desk<'_>) {
        self.report_progress_of(self.phase(), desk);
    }

    pub(super) fn report_progress_of(&mut self, phase: Phase, desk: &mut Desk<'_>) {
        let Some(transfer) = &self.transfer else { return };
        let reached = transfer.reached();
        let (records, bytes) = (reached.taken, reached.bytes_taken);
        let (records_total, bytes_total) = transfer.total();
        // The header is the first record.
        if records > 1 {
            self.first_data.get_or_insert((desk.now, bytes));
        } else {
            self.first_data = None; // No data has been taken yet, perhaps in a second pass.
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
        let place = |at: &Progress| (at.phase, at.records, at.records_total, at.again, at.held.is_some());
        let moved = self.progress.is_none_or(|before| {
            place(&before) != place(&progress)
                || progress.held.zip(before.held).is_some_and(|(now, before)| now >= before + HOLD_TOLD)
        });
        if moved {
            self.hold_due = progress.held.map(|_| desk.now + HOLD_TOLD);
            self.progress = Some(progress);
            desk.events.push_back(Event::Progress(progress));
        }
    }

    pub(super) fn phase(&self) -> Phase {
        match self.stage {
            Stage::Check(_) => Phase::Check,
            Stage::AskedForLoader(_) | Stage::PasswordSent | Stage::AskWho(_) | Stage::Settle { .. } => {
                Phase::EnterLoader
            }
            Stage::Transfer if self.transfer.as_ref().is_some_and(Transfer::is_erasing) => Phase::Erase,
            Stage::Transfer => Phase::Transfer,
            Stage::Failing { phase, .. } => phase,
            Stage::Finish { .. } => Phase::Finish,
            Stage::AskVersion(_) => Phase::Verify,
        }
    }

    /// Ends the upload with this verdict.
    pub(super) fn end(
        &self,
        desk: &Desk<'_>,
        verdict: Verdict,
        unit: UnitNow,
        what: impl Into<String>,
    ) -> Option<Outcome> {
        Some(self.outcome(desk, verdict, unit, what))
    }

    /// The report on an upload that ends now.
    pub(super) fn outcome(&self, desk: &Desk<'_>, verdict: Verdict, unit: UnitNow, what: impl Into<String>) -> Outcome {
        let transfer = self.transfer.as_ref();
        let records = transfer.map_or(0, |transfer| transfer.reached().sent);
        let records_total = transfer.map_or(0, |transfer| transfer.total().0);
        Outcome::Loaded(Box::new(LoadReport {
            verdict,
            proof: if self.order.image.identity().is_some() { Proof::Banner } else { Proof::Missing },
            phase: if verdict == Verdict::Done { Phase::Verify } else { self.phase() },
            unit,
            found_in_loader: self.found_in_loader,
            password_sent: self.password_sent && !desk.transmitter.keeps_secret(),
            product: self.product.clone(),
            // A loader does not say what ran before; the journal of an earlier upload may know.
            version_before: self.version_before.or(self.order.ran),
            version_after: self.after.version.map(|(_, version)| version),
            records,
            records_total,
            address: transfer.and_then(Transfer::address),
            duration: transfer.and_then(Transfer::begun).map_or(Duration::ZERO, |begun| desk.now.since(begun)),
            what: what.into(),
            heard: self.heard.clone(),
            misfit: self.misfit,
            // If the upload failed, what looked like a loader of another kind may have been a unit without power.
            remark: transfer.and_then(Transfer::remark).filter(|_| verdict == Verdict::Done),
        }))
    }

    /// Keeps the last text heard, other than a row of the stream, for the report.
    pub(super) fn quote(&mut self, text: &Text, message: &Message) {
        if !matches!(message, Message::Row(_)) {
            self.heard = visible::quoted(&text.text);
        }
    }
}
