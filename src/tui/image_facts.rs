//! What the console shows of an image file: what it is, what was found in it, and what would be sent.

use std::path::PathBuf;

use crate::device::{self, LoaderKind, Product};
use crate::image::{CheckedImage, DefectId, Report, Severity};
use crate::session::LoadOrder;
use crate::time::Duration;
use crate::version::Version;

/// What is to be sent of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amount {
    /// Records, header and terminator included.
    pub records: usize,
    /// Characters.
    pub characters: usize,
    /// What sending them takes, roughly.
    pub time: Duration,
}

/// What reading and checking an image file brought.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFacts {
    /// Which file.
    pub path: PathBuf,
    /// Whether it may be sent: no error is left.
    pub ok: bool,
    /// Product the image says it is for.
    pub product: Option<String>,
    /// Version the image says it is.
    pub version: Option<Version>,
    /// What is sent of the file as it is.
    pub own: Amount,
    /// What is sent if it is packed, as long as the loader keeps up with that.
    pub packed: Amount,
    /// Every defect in one line each, errors first: `line 12, column 43: ...`.
    pub defects: Vec<String>,
    /// Which errors are left, each once.
    pub errors: Vec<DefectId>,
    /// Errors in spite of which it may be sent, because the user says so.
    pub allowed: Vec<DefectId>,
    /// The image itself, if it may be sent.
    pub checked: Option<CheckedImage>,
}

impl ImageFacts {
    /// What a check for units with this loader, or with the one their product has, has found that allowed these errors; the
    /// others come first.
    pub fn of_report(path: PathBuf, report: &Report, loader: Option<LoaderKind>, allow: &[DefectId]) -> Self {
        let identity = report.facts.identity.as_ref();
        let mut errors: Vec<DefectId> = Vec::new();
        for defect in report.defects.iter().filter(|defect| defect.severity == Severity::Error) {
            if !errors.contains(&defect.id) {
                errors.push(defect.id);
            }
        }
        // What does not say what it is cannot be compared with the unit, nor with its banner: as 'axcon load' has it, it
        // goes only if the user answers for it. As a file it is sound, and what the check calls it stands once.
        let ok = report.is_ok() && (identity.is_some() || allow.contains(&DefectId::NoIdentity));
        let is_nameless = report.is_ok() && !ok;
        errors.extend(is_nameless.then_some(DefectId::NoIdentity));
        let mut defects: Vec<_> = report.defects.iter().collect();
        let stands = |id, severity| severity == Severity::Error || is_nameless && id == DefectId::NoIdentity;
        defects.sort_by_key(|defect| !stands(defect.id, defect.severity));
        let mut defects: Vec<String> = defects
            .into_iter()
            .map(|defect| {
                let (severity, id) = (defect.severity.name(), defect.id);
                let text =
                    format!("{severity} {id}: line {}, column {}: {}", defect.line, defect.column, defect.message);
                match is_nameless && id == DefectId::NoIdentity {
                    true => format!("{text}, so nobody could tell afterwards what the unit runs"),
                    false => text,
                }
            })
            .collect();
        match report.unlisted() {
            0 => {}
            1 => defects.push("1 more defect is not listed".to_owned()),
            count => defects.push(format!("{count} more defects are not listed")),
        }
        let image = report.image().filter(|_| ok);
        let product = identity.and_then(|identity| Product::named(&identity.product));
        let unit = product.map(|product| (loader.unwrap_or(product.loader.kind), &product.flash));
        let amount = |records, characters| {
            let time = device::transfer_time(characters as u64, report.facts.data_bytes, unit);
            Amount { records, characters, time }
        };
        let packed = image.clone().map_or(Amount::default(), |image| {
            let order = LoadOrder { packed: true, loader, ..LoadOrder::new(image, None) };
            let beginning = order.at_its_beginning();
            amount(beginning.records_total, beginning.bytes_total)
        });
        ImageFacts {
            path,
            ok,
            product: identity.map(|identity| identity.product.clone()),
            version: identity.map(|identity| identity.version),
            own: amount(report.facts.records as usize, report.facts.characters as usize),
            packed,
            defects,
            errors,
            allowed: allow.to_vec(),
            checked: image,
        }
    }

    /// Whether nothing is wrong with the file but that it does not say what it is.
    pub fn is_nameless(&self) -> bool {
        !self.ok && self.errors == [DefectId::NoIdentity]
    }
}
