//! `axcon load`: check, plan, upload, and believe only the new banner.

mod meter;
mod several;

use std::path::PathBuf;

use serde::Serialize;

use super::error::{CliError, Kind};
use super::image::{self as image_cli, DefectObject};
use super::journal::Desk;
use super::output::Output;
use super::talk::{Ended, Talk, no_answer_hints};
use super::{Global, ask, link, names, password};
use crate::device::{self, LoaderKind, Product};
use crate::host::journal::Note;
use crate::image::{CheckedImage, DefectId, Report, Software};
use crate::secret::Secret;
use crate::session::{Command, Event, Facts, LoadOrder, LoadReport, Outcome, Phase, UnitNow, UnitState, Verdict};
use meter::Meter;

/// Arguments of `axcon load`.
///
/// The image is checked before anything is sent; one error and nothing happens (exit code 5). The unit must say that it
/// is the product the image is for. A failed upload leaves a unit that waits in its loader: run the same command again.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The image: a file of S-records or Intel HEX.
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Check the image, find out who is there, show the plan, and stop.
    #[arg(long)]
    dry_run: bool,
    /// The unit's product, where the unit itself cannot say it (it waits in its loader). If the note of an upload that
    /// was left on this port says another one, that counts, unless --allow wrong-product says that the note is wrong.
    #[arg(long, value_name = "NAME", value_parser = names::product)]
    product: Option<&'static Product>,
    /// Send long records instead of the file's own: the same words in fewer characters, a sixth less time.
    #[arg(long)]
    pack: bool,
    /// The loader the unit has, where it is known to be another than its product's (g1, g2, g3, g3-1.3); what it really
    /// does shows behind the first record in any case.
    #[arg(long, value_name = "PROFILE", value_parser = names::loader)]
    loader: Option<LoaderKind>,
    /// Read the password from FILE; otherwise AXCON_PASSWORD is taken, or it is asked for.
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// Send in spite of this defect; docs/images.md lists their names.
    #[arg(long, value_name = "DEFECT", value_parser = image_cli::allowable)]
    allow: Vec<DefectId>,
}

/// Uploads.
///
/// # Errors
/// As the exit codes say: see the report.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if let (Some(file), [_, _, ..]) = (&global.record, global.ports.as_slice()) {
        let message = format!("several units cannot be recorded to one file, {}", image_cli::shown(file));
        return Err(CliError::message(Kind::Usage, message)
            .hint("leave --record away: each upload has its own recording in the state directory"));
    }
    let name = image_cli::shown(&args.image);
    let expected = args.product.map(|product| product.name.as_str());
    let report = image_cli::read_for(&args.image, &image_cli::targets_with(args.loader), expected, &args.allow)?;
    let Some(image) = report.image() else {
        return refuse(&report, &name, output);
    };
    if image.identity().is_none() && !args.allow.contains(&DefectId::NoIdentity) {
        let message =
            format!("{name} does not say which product and version it is, so nobody could tell what runs then");
        return Err(CliError::message(Kind::ImageRefused, message)
            .hint("if you know that it is made for this unit: --allow no-identity, and compare the banner yourself"));
    }
    if !output.json && (report.warnings > 0 || report.allowed > 0) {
        output.remark(image_cli::report_text(&report, &name).trim_end());
    }
    let interactive = ask::somebody();
    if !args.dry_run && !global.yes && !interactive {
        return Err(CliError::message(Kind::NeedsYes, "an upload replaces the unit's software and nobody said yes")
            .hint("add --yes where nobody can be asked"));
    }
    let password = if args.dry_run { None } else { password::find(args.password_file.as_deref())? };
    if args.dry_run && global.ports.is_empty() {
        plan(&report, &image, &name, args.loader, None, output)?;
        return planned(&report, None, image.identity().map(|identity| identity.product.as_str()), output);
    }
    let mut prepared = Prepared { args, name, report, image, password };
    match global.ports.as_slice() {
        [] | [_] => {
            let meter = Meter::new(global.port().unwrap_or_default(), output.json);
            upload(&prepared, global, meter, output)
        }
        several if prepared.args.dry_run => several::plan(several, &prepared, global, output),
        several => {
            if !global.yes && !ask::is_yes(&format!("Upload to {} units? Type yes: ", several.len()), None, output)? {
                return Err(CliError::message(Kind::NeedsYes, "not confirmed; nothing has been sent"));
            }
            let password = prepared.password.take().map_or_else(|| password::ask(None), Ok)?;
            prepared.password = Some(password);
            several::run(several, &prepared, global, output)
        }
    }
}

/// What is known before a unit is looked at.
struct Prepared {
    args: Args,
    name: String,
    report: Report,
    image: CheckedImage,
    password: Option<Secret>,
}

/// Uploads to one unit.
fn upload(prepared: &Prepared, global: &Global, mut meter: Meter, output: &mut Output) -> Result<(), CliError> {
    let Prepared { args, name, report, image, password } = prepared;
    if link::is_recording(global) {
        return Err(link::read_only("take new software"));
    }
    let mut talk = Talk::open(global, output)?;
    talk.ask(Command::Identify)?;
    let journal = Desk::of(&talk);
    find_product(&mut talk, args, global, output)?;
    let facts = talk.session().facts().clone();
    plan(report, image, name, args.loader, Some((&facts, talk.port(), journal.note.as_ref())), output)?;
    if let Some(product) = args.product
        && let Some(note) = journal.against(&facts, &product.name)
        && !args.allow.contains(&DefectId::WrongProduct)
    {
        talk.close(output);
        return Err(contradicted(note, product));
    }
    let noted = journal.note.as_ref().map(|note| note.product.clone());
    let said = facts.product.as_ref().map(|known| known.value.clone());
    let believed = said.or(args.product.map(|product| product.name.clone())).or_else(|| noted.clone());
    let ran = believed.and_then(|product| journal.ran(&product));
    let talks = matches!(facts.state, UnitState::Loader | UnitState::Application);
    if talks && facts.version.is_none() && ran.is_none() && image.identity().is_some() {
        output.remark("axcon: which version the unit ran is not known, so nobody can say whether the image is older");
    }
    if args.dry_run {
        let port = talk.port().to_owned();
        talk.close(output);
        let product = check_fit(image, &facts, &journal, args)?;
        return planned(report, Some((&facts, &port)), Some(&product.name), output);
    }
    // What the unit says goes first, then the user, then the note of an upload that was left in the middle.
    let product = args.product.map(|product| product.name.clone()).or(noted);
    let needs_password = facts.state != UnitState::Loader;
    if needs_password && password.is_none() && !ask::somebody() {
        talk.close(output);
        return Err(CliError::message(Kind::Usage, "the password is missing")
            .hint("give it with --password-file FILE or in AXCON_PASSWORD"));
    }
    if !global.yes && !ask::is_yes("Upload? Type yes: ", Some(&mut talk), output)? {
        talk.close(output);
        return Err(CliError::message(Kind::NeedsYes, "not confirmed; nothing has been sent"));
    }
    let password = match password {
        None if needs_password => Some(password::ask(Some(&mut talk))?),
        password => password.clone(),
    };
    // Whom nobody but the note has told of the product has to learn how a wrong note is corrected.
    let doubt = journal.note.as_ref().filter(|_| args.product.is_none() && facts.product.is_none()).map(doubt);
    let mut note = journal.compose(&facts, product.as_deref(), name, &talk);
    let order = LoadOrder {
        product,
        ran,
        loader: args.loader,
        packed: args.pack,
        allowed: args.allow.clone(),
        ..LoadOrder::new(image.clone(), password)
    };
    // Until the unit has been found to be the right one the session has nothing to tell of.
    meter.show(&order.at_its_beginning(), output);
    let ended = talk.run(Command::Load(Box::new(order)), |_, event| {
        if let Event::Progress(progress) = event {
            // The unit has been found to be the right one, and L or the first record is about to leave.
            if let Some(note) = note.take() {
                journal.begin(note, output);
            }
            meter.show(progress, output);
        }
        Ok(())
    })?;
    meter.end(output);
    let (outcome, lost) = match ended {
        Ended::Finished { outcome, .. } => (outcome, None),
        Ended::Lost { outcome, error } => (outcome, Some(error)),
    };
    let Outcome::Loaded(result) = outcome else {
        return Err(CliError::message(Kind::Failed, "the upload ended without a report"));
    };
    journal.end(&result, output);
    let is_wrong_product = result.misfit == Some(DefectId::WrongProduct);
    let result = conclude(&result, lost, report, talk.port(), output);
    let result = match doubt.filter(|_| is_wrong_product) {
        Some(doubt) => result.map_err(|error| error.hint(doubt)),
        None => result,
    };
    talk.close(output);
    result
}

/// Finds out the product of a unit whose menu does not name it: its object dictionary does.
fn find_product(talk: &mut Talk, args: &Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let facts = talk.session().facts();
    if facts.state != UnitState::Application || facts.product.is_some() || args.product.is_some() {
        return Ok(());
    }
    if args.dry_run && !global.yes {
        output.remark(
            "axcon: the unit's menu does not name it; with --yes its object dictionary is asked (scanning halts)",
        );
        return Ok(());
    }
    output.remark("axcon: the unit's menu does not name it; its object dictionary is asked");
    // What it showed is among the facts then; if it would not, the upload says what is missing.
    talk.ask(Command::ReadDictionary).map(|_| ())
}

/// The note of an upload that was left in the middle knows the unit as another product than the user says.
fn contradicted(note: &Note, product: &Product) -> CliError {
    let Note { product: noted, image, .. } = note;
    let message = format!(
        "the unit is an {noted}, not an {}: so says the note of the upload of '{image}' that was left on this port",
        product.name
    );
    CliError::message(Kind::ImageRefused, message)
        .hint("nothing was changed: take the file that is made for this unit, without --product")
        .hint("if the note is wrong, since another unit is there now: the same command with --allow wrong-product")
}

/// How a note is corrected that is all there is to know the product by.
fn doubt(note: &Note) -> String {
    let Note { product, image, .. } = note;
    format!("{product} is what the note of '{image}' says; if that is wrong: --product NAME --allow wrong-product")
}

/// What the upload itself would say of this image for this unit.
fn check_fit(image: &CheckedImage, facts: &Facts, journal: &Desk, args: &Args) -> Result<&'static Product, CliError> {
    let refused = |message: String| CliError::message(Kind::ImageRefused, message + ": it would be refused");
    let said = facts.product.as_ref().and_then(|known| Product::named(&known.value));
    if let (Some(said), Some(ordered)) = (said, args.product)
        && said.name != ordered.name
    {
        return Err(refused(format!("the unit is an {}, not an {}", said.name, ordered.name)));
    }
    let note = journal.note.as_ref();
    let noted = note.and_then(|note| Product::named(&note.product));
    if matches!(facts.state, UnitState::Silent | UnitState::Unknown) {
        return Err(no_answer_hints(CliError::message(Kind::NoAnswer, "no unit answers on this port")));
    }
    let Some(product) = said.or(args.product).or(noted) else {
        let message = "the unit does not say which product it is";
        return Err(CliError::message(Kind::Usage, message).hint("look at its label and say it: --product NAME"));
    };
    let unit = product.target_with(args.loader.unwrap_or(product.loader.kind));
    let runs = facts.version.as_ref().map(|known| Software::Runs(known.value));
    let misfits = image.misfits(&unit, runs.or_else(|| journal.ran(&product.name).map(Software::Ran)));
    match misfits.into_iter().find(|misfit| !args.allow.contains(&misfit.id)) {
        None => Ok(product),
        Some(misfit) => {
            let allow = format!("if it is wanted all the same: --allow {}", misfit.id);
            let error = refused(misfit.message).hint(allow);
            let is_noted_only = misfit.id == DefectId::WrongProduct && said.is_none() && args.product.is_none();
            Err(note.filter(|_| is_noted_only).map(doubt).into_iter().fold(error, CliError::hint))
        }
    }
}

/// A dry run has come to its end without an objection.
fn planned(
    report: &Report,
    unit: Option<(&Facts, &str)>,
    product: Option<&str>,
    output: &mut Output,
) -> Result<(), CliError> {
    if !output.json {
        return Ok(());
    }
    let state = match unit.map(|(facts, _)| facts.state) {
        Some(UnitState::Loader) => UnitNow::Loader,
        Some(_) => UnitNow::Application,
        None => UnitNow::Unknown,
    };
    let version = unit.and_then(|(facts, _)| facts.version.as_ref());
    output.object(&LoadObject {
        schema: "axcon.load/1",
        port: unit.map(|(_, port)| port),
        exit_code: 0,
        verdict: "planned",
        unit: unit_name(state),
        phase: phase_name(Phase::Check),
        product,
        version_before: version.map(|known| known.value.to_string()),
        version_after: None,
        records: 0,
        records_total: report.facts.records as usize,
        address: None,
        seconds: 0.0,
        what: "a dry run: nothing has been sent",
        heard: "",
        remark: None,
        next: "run the same command without --dry-run",
        defects: image_cli::defect_objects(report),
    })
}

/// The image has errors: report, nothing else.
fn refuse(report: &Report, name: &str, output: &mut Output) -> Result<(), CliError> {
    let written = if output.json {
        let identity = report.facts.identity.as_ref();
        output.object(&LoadObject {
            schema: "axcon.load/1",
            port: None,
            exit_code: Kind::ImageRefused.exit_code(),
            verdict: "refused",
            unit: "unknown",
            phase: phase_name(Phase::Check),
            product: identity.map(|identity| identity.product.as_str()),
            version_before: None,
            version_after: None,
            records: 0,
            records_total: report.facts.records as usize,
            address: None,
            seconds: 0.0,
            what: "the image has errors; nothing has been sent",
            heard: "",
            remark: None,
            next: "use an image without errors",
            defects: image_cli::defect_objects(report),
        })
    } else {
        let written = output.data(image_cli::report_text(report, name).as_bytes());
        output.remark("axcon: the image is refused; nothing has been sent");
        written
    };
    CliError::found(Some(Kind::ImageRefused), written)
}

/// Says what is going to happen.
fn plan(
    report: &Report,
    image: &CheckedImage,
    name: &str,
    loader: Option<LoaderKind>,
    unit: Option<(&Facts, &str, Option<&Note>)>,
    output: &mut Output,
) -> Result<(), CliError> {
    if output.json {
        return Ok(());
    }
    let contents = image.identity().map_or_else(
        || "it does not say what it is".to_owned(),
        |identity| format!("{} V{}", identity.product, identity.version),
    );
    output.remark(&format!("image  {name}: {contents}, {} records", report.facts.records));
    if let Some((facts, port, note)) = unit {
        let version = facts.version.as_ref().map_or_else(String::new, |known| format!(" V{}", known.value));
        let unit = match (&facts.product, facts.state) {
            (_, UnitState::Loader) => match note {
                Some(note) => format!("waits in its loader; it is the {} that '{}' was for", note.product, note.image),
                None => "waits in its loader".to_owned(),
            },
            (Some(product), _) => format!("{}{version}", product.value),
            (None, UnitState::Silent) => match note {
                Some(note) => {
                    format!("does not answer; an upload of '{}' was begun here and may still erase", note.image)
                }
                None => "does not answer".to_owned(),
            },
            (None, _) => "does not say what it is".to_owned(),
        };
        output.remark(&format!("unit   {port}: {unit}"));
    }
    let said = unit.and_then(|(facts, ..)| Some(facts.product.as_ref()?.value.as_str()));
    let noted = || unit.and_then(|(_, _, note)| Some(note?.product.as_str()));
    let named = || image.identity().map(|identity| identity.product.as_str());
    let product = said.or_else(noted).or_else(named).and_then(Product::named);
    let pace = product.map(|product| (loader.unwrap_or(product.loader.kind), &product.flash));
    let (characters, data_bytes) = (report.facts.characters, report.facts.data_bytes);
    let seconds = device::transfer_time(characters, data_bytes, pace).as_secs_f64();
    let enter = match unit {
        Some((facts, ..)) if facts.state == UnitState::Loader => "",
        Some(_) | None => "enter the loader, ",
    };
    output.remark(&format!(
        "plan   {enter}send {} characters (some {seconds:.0} s), then believe only the new banner",
        report.facts.characters
    ));
    Ok(())
}

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

/// Says how it went, and what to do next.
fn conclude(
    report: &LoadReport,
    lost: Option<CliError>,
    image: &Report,
    port: &str,
    output: &mut Output,
) -> Result<(), CliError> {
    let kind = exit_kind(report, lost.is_some());
    let next = report.advice();
    if output.json {
        let written = output.object(&LoadObject {
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
            records_total: report.records_total,
            address: report.address,
            seconds: (report.duration.as_secs_f64() * 1000.0).round() / 1000.0,
            what: &report.what,
            heard: &report.heard,
            remark: report.remark.as_deref(),
            next,
            defects: image_cli::defect_objects(image),
        });
        return CliError::found(kind, written);
    }
    let Some(kind) = kind else {
        let before = report.version_before.map_or_else(String::new, |version| format!(" (before: V{version})"));
        let seconds = report.duration.as_secs_f64();
        if let Some(remark) = &report.remark {
            output.remark(&format!("note: {remark}"));
        }
        return output
            .data(format!("done: {}{before}; {} records in {seconds:.1} s\n", report.what, report.records).as_bytes());
    };
    let mut error = CliError::message(kind, report.what.clone());
    if report.records > 0 && report.verdict != Verdict::WrongApplication {
        let address = report.address.map_or_else(String::new, |address| format!(", address {address:#06x}"));
        error = error.hint(format!("sent: {} of {} records{address}", report.records, report.records_total));
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
    if report.verdict == Verdict::NoAnswer {
        error = no_answer_hints(error);
    }
    if report.verdict == Verdict::Refused && report.product.is_none() {
        error = error.hint("say it with --product, for example: --product AXTC4CO");
    }
    Err(error.hint(next))
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

fn unit_name(unit: UnitNow) -> &'static str {
    match unit {
        UnitNow::Application => "application",
        UnitNow::Loader => "loader",
        UnitNow::Unknown => "unknown",
    }
}

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Check => "check",
        Phase::EnterLoader => "enter-loader",
        Phase::Erase => "erase",
        Phase::Transfer => "transfer",
        Phase::Finish => "finish",
        Phase::Verify => "verify",
    }
}
