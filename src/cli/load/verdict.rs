//! How an upload went: the object for a program, words for a person, the exit code.

use serde::Serialize;

use super::Target;
use crate::cli::error::{CliError, Kind};
use crate::cli::image::{self as image_cli, DefectObject};
use crate::cli::numbers::{counted, grouped};
use crate::cli::outcome::no_answer_hints;
use crate::cli::output::{Closed, Output};
use crate::image::{DefectId, Report};
use crate::session::{LoadReport, Phase, SEE_POWER, UnitNow, UnitState, Verdict};

#[derive(Serialize)]
struct LoadObject<'a> {
    schema: &'static str,
    port: Option<&'a str>,
    exit_code: u8,
    verdict: &'static str,
    unit: &'static str,
    phase: &'static str,
    product: Option<&'a str>,
    version_before: Option<String>,
    version_after: Option<String>,
    records: usize,
    records_total: usize,
    address: Option<u32>,
    seconds: f64,
    what: &'a str,
    heard: &'a str,
    remark: Option<&'a str>,
    next: &'a str,
    defects: Vec<DefectObject<'a>>,
}

impl<'a> LoadObject<'a> {
    /// Of this image, as long as there is nothing else to say.
    fn of_nothing_sent(report: &'a Report) -> Self {
        LoadObject {
            schema: "axcon.load/1",
            port: None,
            exit_code: 0,
            verdict: "",
            unit: unit_name(UnitNow::Unknown),
            phase: phase_name(Phase::Check),
            product: None,
            version_before: None,
            version_after: None,
            records: 0,
            records_total: report.facts.records as usize,
            address: None,
            seconds: 0.0,
            what: "",
            heard: "",
            remark: None,
            next: "",
            defects: image_cli::defect_objects(report),
        }
    }

    /// Of an upload that has ended, and the exit code's kind.
    fn of_upload(report: &'a LoadReport, kind: Option<Kind>, next: &'a str, image: &'a Report, port: &'a str) -> Self {
        LoadObject {
            schema: "axcon.load/1",
            port: Some(port),
            exit_code: kind.map_or(0, Kind::exit_code),
            verdict: verdict_name(report.verdict),
            unit: unit_name(report.unit),
            phase: phase_name(report.phase),
            product: report.product.as_deref(),
            version_before: report.version_before.map(|version| version.to_string()),
            version_after: report.version_after.map(|version| version.to_string()),
            records: report.records,
            // What was refused before it was packed and counted has the records of its file.
            records_total: match report.verdict {
                Verdict::Refused if report.records_total == 0 => image.facts.records as usize,
                _ => report.records_total,
            },
            address: report.address,
            seconds: (report.duration.as_secs_f64() * 1000.0).round() / 1000.0,
            what: &report.what,
            heard: &report.heard,
            remark: report.remark.as_deref(),
            next,
            defects: with_misfit(image, report.misfit, &report.what),
        }
    }
}

/// A dry run has come to its end without an objection.
pub fn planned(
    report: &Report,
    target: Option<&Target>,
    product: Option<&str>,
    output: &mut Output,
) -> Result<(), CliError> {
    if !output.json {
        return Ok(());
    }
    let state = target.map_or(UnitNow::Unknown, |target| as_it_is(target.facts.state));
    let version = target.and_then(|target| target.facts.version.as_ref());
    output.object(&LoadObject {
        port: target.map(|target| target.port),
        verdict: "planned",
        unit: unit_name(state),
        product,
        version_before: version.map(|known| known.value.to_string()),
        what: "a dry run: nothing has been sent",
        next: "run the same command without --dry-run",
        ..LoadObject::of_nothing_sent(report)
    })
}

/// The image has errors: report, nothing else.
pub fn refuse(report: &Report, name: &str, port: Option<&str>, output: &mut Output) -> Result<(), CliError> {
    let written = if output.json {
        let identity = report.facts.identity.as_ref();
        output.object(&LoadObject {
            port,
            exit_code: Kind::ImageRefused.exit_code(),
            verdict: "refused",
            product: identity.map(|identity| identity.product.as_str()),
            what: "the image has errors; nothing has been sent",
            next: "use an image without errors",
            ..LoadObject::of_nothing_sent(report)
        })
    } else {
        let written = output.data(image_cli::report_text(report, name).as_bytes());
        output.remark("axcon: the image is refused; nothing has been sent");
        written
    };
    CliError::found(Some(Kind::ImageRefused), written)
}

/// The defects of the file, and after them why it is not for this unit, if it is not; no line of the file shows that.
fn with_misfit<'a>(image: &'a Report, misfit: Option<DefectId>, message: &'a str) -> Vec<DefectObject<'a>> {
    let mut defects = image_cli::defect_objects(image);
    defects.extend(misfit.map(|id| image_cli::misfit_object(id, message)));
    defects
}

/// A dry run has found that the image is not for this unit: writes the object that the upload itself would end with.
pub fn would_be_refused(
    image: &Report,
    target: &Target,
    product: &str,
    misfit: DefectId,
    error: &CliError,
    output: &mut Output,
) -> Result<(), CliError> {
    let what = error.to_string();
    let next = error.hints.join("; ");
    let written = output.object(&LoadObject {
        port: Some(target.port),
        exit_code: Kind::ImageRefused.exit_code(),
        verdict: verdict_name(Verdict::Refused),
        unit: unit_name(as_it_is(target.facts.state)),
        product: Some(product),
        version_before: target.facts.version.as_ref().map(|known| known.value.to_string()),
        what: &what,
        next: &next,
        defects: with_misfit(image, Some(misfit), &what),
        ..LoadObject::of_nothing_sent(image)
    });
    CliError::found(Some(Kind::ImageRefused), written)
}

/// Says how it went, and what to do next. `lost`: why the link was lost, if it was; `is_silent`: nothing was heard of
/// the unit at the end.
pub fn conclude(
    report: &LoadReport,
    lost: Option<CliError>,
    is_silent: bool,
    image: &Report,
    port: &str,
    output: &mut Output,
) -> Result<(), CliError> {
    let kind = exit_kind(report, lost.is_some());
    let next = next_step(report, report.doubt(lost.is_some(), is_silent));
    if output.json {
        let written = output.object(&LoadObject::of_upload(report, kind, &next, image, port));
        return CliError::found(kind, written.map_err(|error| untold(report, error, output)));
    }
    match kind {
        None => say_done(report, output),
        Some(kind) => Err(failure(report, kind, lost, next)),
    }
}

/// The words for a success.
fn say_done(report: &LoadReport, output: &mut Output) -> Result<(), CliError> {
    let before = report.version_before.map_or_else(String::new, |version| format!(" (before: V{version})"));
    let seconds = report.duration.as_secs_f64();
    if let Some(remark) = &report.remark {
        output.remark(&format!("note: {remark}"));
    }
    let done = format!("done: {}{before}; {} in {seconds:.1} s\n", report.what, counted(report.records, "record"));
    output.data(done.as_bytes()).map_err(|error| untold(report, error, output))
}

/// The error that any other verdict is: what was sent and heard, then `next`, what to do.
fn failure(report: &LoadReport, kind: Kind, lost: Option<CliError>, next: String) -> CliError {
    let mut error = CliError::message(kind, report.what.clone());
    if report.records > 0 && report.verdict != Verdict::WrongApplication {
        error = error.hint(sent(report));
    }
    if !report.heard.is_empty() {
        error = error.hint(format!("last heard: \"{}\"", report.heard));
    }
    if let Some(remark) = &report.remark {
        error = error.hint(remark.clone());
    }
    if let Some(misfit) = report.misfit {
        error = error.hint(format!("if it is wanted all the same: --allow {misfit}"));
    }
    if let Some(lost) = lost {
        error = error.hint(format!("the port: {lost}"));
    }
    if report.verdict == Verdict::NoAnswer && report.unit != UnitNow::Application {
        error = no_answer_hints(error);
    }
    error.hint(next)
}

/// How much of the file has left.
fn sent(report: &LoadReport) -> String {
    let (records, total) = (grouped(report.records), counted(report.records_total, "record"));
    let address = report.address.map_or_else(String::new, |address| format!(", address {address:#06x}"));
    format!("sent: {records} of {total}{address}")
}

/// What to do next, and how it is said on a command line. `doubt` is what [`LoadReport::doubt`] says.
fn next_step(report: &LoadReport, doubt: Option<&str>) -> String {
    if let Some(doubt) = doubt {
        return format!("the unit is {doubt}; {SEE_POWER}");
    }
    let advice = report.advice();
    match (report.verdict, &report.product) {
        (Verdict::Refused, None) => format!("{advice}: --product NAME, for example --product AXTC4CO"),
        _ => advice.to_owned(),
    }
}

/// The verdict could not be written to standard output. It goes to standard error too, since what has become of the
/// unit matters more than why it could not be written.
fn untold(report: &LoadReport, error: CliError, output: &mut Output) -> CliError {
    if !error.error.is::<Closed>() {
        output.remark(&format!("axcon: {}: {}", verdict_name(report.verdict), report.what));
    }
    error
}

/// The exit code's kind; `None` is success.
fn exit_kind(report: &LoadReport, link_lost: bool) -> Option<Kind> {
    Some(match report.verdict {
        Verdict::Done => return None,
        Verdict::Refused if report.product.is_none() => Kind::Usage,
        Verdict::Refused => Kind::ImageRefused,
        Verdict::UnitRefused => Kind::UnitRefused,
        Verdict::NoAnswer => Kind::NoAnswer,
        Verdict::Failed if link_lost && report.records == 0 => Kind::PortGone,
        Verdict::Failed => match report.unit {
            UnitNow::Loader => Kind::UploadFailedLoader,
            UnitNow::Unknown => Kind::UploadFailedUnknown,
            UnitNow::Application => Kind::WrongApplication,
        },
        Verdict::WrongApplication => Kind::WrongApplication,
        Verdict::Interrupted => Kind::Interrupted,
    })
}

fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Done => "done",
        Verdict::Refused => "refused",
        Verdict::UnitRefused => "unit-refused",
        Verdict::NoAnswer | Verdict::Failed => "failed",
        Verdict::WrongApplication => "wrong-application",
        Verdict::Interrupted => "interrupted",
    }
}

/// What a unit is while nothing has been done to it.
fn as_it_is(state: UnitState) -> UnitNow {
    match state {
        UnitState::Loader => UnitNow::Loader,
        UnitState::Application => UnitNow::Application,
        UnitState::Silent | UnitState::Unknown => UnitNow::Unknown,
    }
}

fn unit_name(unit: UnitNow) -> &'static str {
    match unit {
        UnitNow::Application => "application",
        UnitNow::Loader => "loader",
        UnitNow::Unknown => "unknown",
    }
}

pub fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Check => "check",
        Phase::EnterLoader => "enter-loader",
        Phase::Erase => "erase",
        Phase::Transfer => "transfer",
        Phase::Finish => "finish",
        Phase::Verify => "verify",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Proof;
    use crate::time::Duration;

    fn refused() -> LoadReport {
        LoadReport {
            verdict: Verdict::Refused,
            proof: Proof::Banner,
            phase: Phase::Check,
            unit: UnitNow::Application,
            found_in_loader: false,
            password_sent: false,
            product: None,
            version_before: None,
            version_after: None,
            records: 0,
            records_total: 0,
            address: None,
            duration: Duration::ZERO,
            what: String::new(),
            heard: String::new(),
            misfit: None,
            remark: None,
        }
    }

    #[test]
    fn a_user_who_has_to_name_the_product_is_told_how() {
        let report = refused();
        assert!(next_step(&report, None).contains("--product NAME"), "{}", next_step(&report, None));
        let other = LoadReport { product: Some("AXTC4CO".into()), ..report };
        assert!(!next_step(&other, None).contains("--product"), "{}", next_step(&other, None));
    }

    #[test]
    fn records_are_told_with_their_thousands_apart() {
        let report = LoadReport { records: 1_117, records_total: 1_252, address: Some(0xa0), ..refused() };
        assert_eq!(sent(&report), "sent: 1,117 of 1,252 records, address 0x00a0");
    }

    #[test]
    fn a_unit_of_which_nothing_is_heard_is_told_of_before_what_to_do_about_it() {
        let half = LoadReport { verdict: Verdict::Failed, unit: UnitNow::Loader, records: 9, ..refused() };
        let silent = next_step(&half, half.doubt(false, true));
        assert_eq!(silent, format!("the unit is silent: in its loader, or without power; {SEE_POWER}"));
        assert_eq!(next_step(&half, half.doubt(false, false)), half.advice());
    }
}
