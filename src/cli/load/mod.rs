//! `axcon load`: check, plan, upload, and trust only the new banner.

mod meter;
mod several;
mod verdict;

use std::path::{Path, PathBuf};

use super::error::{CliError, Kind};
use super::image as image_cli;
use super::journal::PortJournal;
use super::numbers::{counted, grouped};
use super::outcome::no_answer_hints;
use super::output::Output;
use super::talk::{Ended, Talk};
use super::{Global, ask, files, link, names, password};
use crate::device::{self, LoaderKind, Product};
use crate::host::journal::Note;
use crate::image::{CheckedImage, DefectId, Report, Software};
use crate::record::Direction;
use crate::secret::Secret;
use crate::session::{Command, Event, Facts, LoadOrder, LoadReport, Outcome, SILENT, UnitState};
use crate::version::Version;
use meter::Meter;
use verdict::{conclude, planned, refuse, would_be_refused};

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
    /// does shows after the first record in any case.
    #[arg(long, value_name = "PROFILE", value_parser = names::loader)]
    loader: Option<LoaderKind>,
    /// Read the password from FILE (- is standard input); otherwise AXCON_PASSWORD is taken, or it is asked for.
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
        let message = format!("several units cannot be recorded to one file, {}", files::shown(file));
        return Err(CliError::message(Kind::Usage, message)
            .hint("leave out --record: each upload has its own recording in the state directory"));
    }
    if args.image == Path::new("-") && args.password_file.as_deref() == Some(Path::new("-")) {
        return Err(CliError::message(Kind::Usage, "image and password cannot both come from standard input"));
    }
    let name = files::shown(&args.image);
    let expected = args.product.map(|product| product.name.as_str());
    let report = image_cli::read_for(&args.image, &image_cli::targets_with(args.loader), expected, &args.allow)?;
    let Some(image) = report.image() else {
        return refuse(&report, &name, global.port(), output);
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
    let mut prepared = Prepared { args, name, report, image, password };
    match global.ports.as_slice() {
        [] if prepared.args.dry_run => {
            plan(&prepared, None, output)?;
            let product = prepared.image.identity().map(|identity| identity.product.as_str());
            planned(&prepared.report, None, product, output)
        }
        [] | [_] => {
            let meter = Meter::new(global.port().unwrap_or_default(), output.json);
            upload(&prepared, global, meter, output)
        }
        several if prepared.args.dry_run => several::plan(several, &prepared, global, output),
        several => {
            if !global.yes && !ask::is_yes(&format!("Upload to {} units? Type yes: ", several.len()), None, output)? {
                return Err(not_confirmed());
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

/// The unit that is to get the image, as it is before.
struct Target<'a> {
    port: &'a str,
    facts: &'a Facts,
    /// The upload that was begun on this port and has not ended well, if there is one.
    note: Option<&'a Note>,
}

impl Target<'_> {
    /// What the unit is, in a few words.
    fn words(&self) -> String {
        let version = self.facts.version.as_ref().map_or_else(String::new, |known| format!(" V{}", known.value));
        match (&self.facts.product, self.facts.state, self.note) {
            (_, UnitState::Loader, Some(note)) => {
                format!("waits in its loader; it is the {} that '{}' was for", note.product, note.image)
            }
            (_, UnitState::Loader, None) => "waits in its loader".to_owned(),
            (Some(product), _, _) => format!("{}{version}", product.value),
            (None, UnitState::Silent, Some(note)) => {
                format!("does not answer; an upload of '{}' was begun here and may still erase", note.image)
            }
            (None, UnitState::Silent, None) => "does not answer".to_owned(),
            (None, UnitState::Application | UnitState::Unknown, _) => "does not say what it is".to_owned(),
        }
    }
}

/// Uploads to one unit, or says what that would do.
fn upload(prepared: &Prepared, global: &Global, meter: Meter, output: &mut Output) -> Result<(), CliError> {
    if link::is_recording(global) {
        return Err(link::read_only("take new software"));
    }
    let mut talk = Talk::open(global, output)?;
    upload_over(&mut talk, prepared, global, meter, output)
}

fn upload_over(
    talk: &mut Talk,
    prepared: &Prepared,
    global: &Global,
    meter: Meter,
    output: &mut Output,
) -> Result<(), CliError> {
    let Prepared { args, name, report, password, .. } = prepared;
    talk.ask(Command::Identify)?;
    let journal = PortJournal::of(talk);
    find_product(talk, args, global, output)?;
    let facts = talk.session().facts().clone();
    let target = Target { port: talk.port(), facts: &facts, note: journal.note.as_ref() };
    plan(prepared, Some(&target), output)?;
    if let Some(product) = args.product
        && let Some(note) = journal.against(&facts, &product.name)
        && !args.allow.contains(&DefectId::WrongProduct)
    {
        return Err(contradicted(note, product));
    }
    let ran = ran_before(prepared, &facts, &journal, output);
    if args.dry_run {
        return end_dry_run(prepared, &target, &journal, output);
    }
    let password = consent(talk, password.as_ref(), &facts, global, output)?;
    let order = order(prepared, &facts, &journal, ran, password);
    // A user who relies on the note alone has to learn how a wrong one is corrected.
    let doubt = journal.note.as_ref().filter(|_| args.product.is_none() && facts.product.is_none()).map(doubt);
    let note = journal.compose(&facts, order.product.as_deref(), name, talk);
    let (result, lost) = send(talk, order, note, &journal, meter, output)?;
    journal.end(&result, output);
    let is_wrong_product = result.misfit == Some(DefectId::WrongProduct);
    let concluded = conclude(&result, lost, is_silent(talk), report, talk.port(), output);
    match doubt.filter(|_| is_wrong_product) {
        Some(doubt) => concluded.map_err(|error| error.hint(doubt)),
        None => concluded,
    }
}

/// The version that ran before an upload that was left in the middle, if its note says so. Where neither the note nor
/// the unit gives a version, remarks that an older image would not be noticed.
fn ran_before(prepared: &Prepared, facts: &Facts, journal: &PortJournal, output: &mut Output) -> Option<Version> {
    let said = facts.product.as_ref().map(|known| known.value.as_str());
    let ordered = prepared.args.product.map(|product| product.name.as_str());
    let noted = journal.note.as_ref().map(|note| note.product.as_str());
    let ran = said.or(ordered).or(noted).and_then(|product| journal.ran(product));
    let talks = matches!(facts.state, UnitState::Loader | UnitState::Application);
    if talks && facts.version.is_none() && ran.is_none() && prepared.image.identity().is_some() {
        output.remark("axcon: which version the unit ran is not known, so nobody can say whether the image is older");
    }
    ran
}

/// Ends a dry run with what the upload itself would say of the image.
fn end_dry_run(
    prepared: &Prepared,
    target: &Target,
    journal: &PortJournal,
    output: &mut Output,
) -> Result<(), CliError> {
    let Prepared { args, report, image, .. } = prepared;
    match check_fit(image, target.facts, journal, args) {
        Ok(product) => planned(report, Some(target), Some(&product.name), output),
        Err(Unfit { error, misfit: Some((product, misfit)) }) if output.json => {
            would_be_refused(report, target, &product.name, misfit, &error, output)
        }
        Err(Unfit { error, .. }) => Err(error),
    }
}

/// What the session is told to do. The product is what the user says, else what the unit says, else what the note of
/// an upload that was left in the middle says.
fn order(
    prepared: &Prepared,
    facts: &Facts,
    journal: &PortJournal,
    ran: Option<Version>,
    password: Option<Secret>,
) -> LoadOrder {
    let Prepared { args, image, .. } = prepared;
    let ordered = args.product.map(|product| &product.name);
    let said = facts.product.as_ref().map(|known| &known.value);
    let noted = journal.note.as_ref().map(|note| &note.product);
    LoadOrder {
        product: ordered.or(said).or(noted).cloned(),
        ran,
        loader: args.loader,
        packed: args.pack,
        allowed: args.allow.clone(),
        ..LoadOrder::new(image.clone(), password)
    }
}

/// The user's consent, and the password where the unit will ask for it.
fn consent(
    talk: &mut Talk,
    password: Option<&Secret>,
    facts: &Facts,
    global: &Global,
    output: &mut Output,
) -> Result<Option<Secret>, CliError> {
    let needs_password = facts.state != UnitState::Loader;
    if needs_password && password.is_none() && !ask::somebody() {
        return Err(CliError::message(Kind::Usage, "the password is missing")
            .hint("give it with --password-file FILE or in AXCON_PASSWORD"));
    }
    if !global.yes && !ask::is_yes("Upload? Type yes: ", Some(&mut *talk), output)? {
        return Err(not_confirmed());
    }
    match password {
        None if needs_password => password::ask(Some(talk)).map(Some),
        password => Ok(password.cloned()),
    }
}

fn not_confirmed() -> CliError {
    CliError::message(Kind::NeedsYes, "not confirmed; nothing has been uploaded")
}

/// Does what was ordered and shows how far it is. The note is written when the unit has been found to be the right one.
fn send(
    talk: &mut Talk,
    order: LoadOrder,
    mut note: Option<Note>,
    journal: &PortJournal,
    mut meter: Meter,
    output: &mut Output,
) -> Result<(Box<LoadReport>, Option<CliError>), CliError> {
    // Until the unit has been found to be the right one the session has nothing to tell of.
    meter.show(&order.at_its_beginning(), output);
    let ended = talk.run(Command::Load(Box::new(order)), |_, event| {
        if let Event::Progress(progress) = event {
            // L or the first record is about to leave.
            if let Some(note) = note.take() {
                journal.begin(note, output);
            }
            meter.show(progress, output);
        }
        Ok(())
    });
    meter.end(output);
    match ended? {
        Ended::Finished { outcome: Outcome::Loaded(report), .. } => Ok((report, None)),
        Ended::Lost { outcome: Outcome::Loaded(report), error } => Ok((report, Some(error))),
        Ended::Finished { .. } | Ended::Lost { .. } => {
            Err(CliError::message(Kind::Failed, "the upload ended without a report"))
        }
    }
}

/// Whether the unit has been silent for longer than a loader that takes a file ever is.
fn is_silent(talk: &Talk) -> bool {
    let mut entries = talk.session().record().entries().rev();
    let heard = entries.find(|entry| entry.direction == Direction::FromUnit).map(|entry| entry.at);
    heard.is_none_or(|heard| talk.now().since(heard) >= SILENT)
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
    if global.yes {
        output.remark("axcon: the unit's menu does not name it; its object dictionary is asked");
    } else {
        let question = format!(
            "The unit's menu does not name it; its object dictionary is asked. {}. Type yes: ",
            ask::READS_DICTIONARY
        );
        if !ask::is_yes(&question, Some(&mut *talk), output)? {
            return Err(not_confirmed().hint("--product NAME says what the unit is without asking it"));
        }
    }
    // What it shows is then among the facts. If it shows nothing, the upload itself says what is missing.
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

/// How to correct a wrong note, where nothing but the note says which product the unit is.
fn doubt(note: &Note) -> String {
    let Note { product, image, .. } = note;
    format!("{product} is what the note of '{image}' says; if that is wrong: --product NAME --allow wrong-product")
}

/// Why the upload would be refused.
struct Unfit {
    error: CliError,
    /// If the image is the reason: the product it was judged for, and its defect.
    misfit: Option<(&'static Product, DefectId)>,
}

impl From<CliError> for Unfit {
    fn from(error: CliError) -> Self {
        Unfit { error, misfit: None }
    }
}

/// Judges the image for this unit as the upload itself does.
fn check_fit(
    image: &CheckedImage,
    facts: &Facts,
    journal: &PortJournal,
    args: &Args,
) -> Result<&'static Product, Unfit> {
    let refused = |message: String| CliError::message(Kind::ImageRefused, message + ": it would be refused");
    let said = facts.product.as_ref().and_then(|known| Product::named(&known.value));
    if let (Some(said), Some(ordered)) = (said, args.product)
        && said.name != ordered.name
    {
        let error = refused(format!("the unit is an {}, not an {}", said.name, ordered.name));
        return Err(Unfit { error, misfit: Some((said, DefectId::WrongProduct)) });
    }
    let note = journal.note.as_ref();
    let noted = note.and_then(|note| Product::named(&note.product));
    if matches!(facts.state, UnitState::Silent | UnitState::Unknown) {
        return Err(no_answer_hints(CliError::message(Kind::NoAnswer, "no unit answers on this port")).into());
    }
    let Some(product) = said.or(args.product).or(noted) else {
        let message = "the unit does not say which product it is";
        return Err(CliError::message(Kind::Usage, message)
            .hint("look at its label and say it: --product NAME")
            .into());
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
            let error = note.filter(|_| is_noted_only).map(doubt).into_iter().fold(error, CliError::hint);
            Err(Unfit { error, misfit: Some((product, misfit.id)) })
        }
    }
}

/// Says what is going to happen.
fn plan(prepared: &Prepared, target: Option<&Target>, output: &mut Output) -> Result<(), CliError> {
    if output.json {
        return Ok(());
    }
    let Prepared { args, name, report, image, .. } = prepared;
    let contents = image.identity().map_or_else(
        || "it does not say what it is".to_owned(),
        |identity| format!("{} V{}", identity.product, identity.version),
    );
    let mut lines = vec![format!("image  {name}: {contents}, {}", counted(report.facts.records, "record"))];
    lines.extend(target.map(|target| format!("unit   {}: {}", target.port, target.words())));
    lines.push(format!("plan   {}", steps(prepared, target)));
    for line in lines {
        // Of a dry run this is what was asked for.
        if args.dry_run {
            output.data(format!("{line}\n").as_bytes())?;
        } else {
            output.remark(&line);
        }
    }
    Ok(())
}

/// What an upload does, with the number of characters and the time they take.
fn steps(prepared: &Prepared, target: Option<&Target>) -> String {
    let Prepared { args, report, image, .. } = prepared;
    let (loader, packed) = (args.loader, args.pack);
    let said = target.and_then(|target| Some(target.facts.product.as_ref()?.value.as_str()));
    let noted = || target.and_then(|target| Some(target.note?.product.as_str()));
    let named = || image.identity().map(|identity| identity.product.as_str());
    let product = said.or_else(noted).or_else(named).and_then(Product::named);
    let pace = product.map(|product| (loader.unwrap_or(product.loader.kind), &product.flash));
    let size = packed.then(|| {
        let loader = loader.or(product.map(|product| product.loader.kind));
        let product = product.map(|product| product.name.clone());
        LoadOrder { product, loader, packed, ..LoadOrder::new(image.clone(), None) }.at_its_beginning()
    });
    let characters = size.map_or(report.facts.characters, |size| size.bytes_total as u64);
    let seconds = device::transfer_time(characters, report.facts.data_bytes, pace).as_secs_f64();
    let is_in_loader = target.is_some_and(|target| target.facts.state == UnitState::Loader);
    let enter = if is_in_loader { "" } else { "enter the loader, " };
    let records = size.map_or_else(String::new, |size| format!(" in {}", counted(size.records_total, "record")));
    let characters = grouped(characters);
    format!("{enter}send {characters} characters{records} (some {seconds:.0} s), then trust only the new banner")
}
