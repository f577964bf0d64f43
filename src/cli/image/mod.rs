//! `axcon image`: work on program images without a unit.
//!
//! Reading a file and showing its report are shared with `axcon load`, which refuses for the same reasons in the same
//! words. Comparing and converting have pages of their own; `report` says a report as text and JSON.

mod convert;
mod diff;
mod report;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use clap::Subcommand;

use super::error::{CliError, Kind};
use super::files::{Destination, named, shown};
use super::numbers::counted;
use super::output::Output;
use super::{Global, names, numbers};
use crate::device::{LoaderKind, Product};
use crate::image::make::{self, Recipe};
use crate::image::{self, DefectId, Report, Severity, Target};
use crate::version::Version;

pub use report::{DefectObject, ImageObject, defect_objects, misfit_object, report_text};
use report::{contents, facts_text};

/// Arguments.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Find every defect of an image; exit code 5 if it must not be sent.
    Check(CheckArgs),
    /// Show what is in an image, sound or not.
    Info(InfoArgs),
    /// Compare two images; exit code 1 if they differ.
    Diff(diff::Args),
    /// Write an image in another format, with other addresses or records; it must be sound.
    Convert(convert::Args),
    /// Make a sample image for trials with an emulated unit.
    // Its own --version says what to make.
    #[command(disable_version_flag = true)]
    Make(MakeArgs),
}

#[derive(Debug, clap::Args)]
struct CheckArgs {
    /// The image; - is standard input.
    file: PathBuf,
    /// The product it should be for.
    #[arg(long, value_name = "NAME", value_parser = names::product)]
    product: Option<&'static Product>,
    /// The loader it is judged for; by default the one the product is assumed to have.
    #[arg(long, value_name = "PROFILE", value_parser = names::loader)]
    loader: Option<LoaderKind>,
    /// Let this error pass. What is allowed is still listed.
    #[arg(long, value_name = "DEFECT", value_parser = allowable)]
    allow: Vec<DefectId>,
}

#[derive(Debug, clap::Args)]
struct InfoArgs {
    /// The image; - is standard input.
    file: PathBuf,
}

#[derive(Debug, clap::Args)]
struct MakeArgs {
    /// The product it is for.
    #[arg(long, value_name = "NAME", value_parser = names::product)]
    product: &'static Product,
    /// The version it says it is, e.g. 1.2.0.
    #[arg(long, value_name = "VERSION")]
    version: Version,
    /// Its size in 16-bit words; by default three quarters of the flash, 81,920 at most.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::within::<u32>(0..=u64::from(u32::MAX)))]
    words: Option<u32>,
    /// Give it this one defect.
    #[arg(long, value_name = "DEFECT", value_parser = flaw)]
    defect: Option<DefectId>,
    /// Where to write it; - is standard output. By default the name the product's upload files have.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// If the image is refused or cannot be read or written.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    match args.command {
        Command::Check(args) => check(&args, output),
        Command::Info(args) => info(&args, output),
        Command::Diff(args) => diff::run(&args, output),
        Command::Convert(args) => convert::run(&args, global, output),
        Command::Make(args) => make(&args, global, output),
    }
}

fn check(args: &CheckArgs, output: &mut Output) -> Result<(), CliError> {
    let expected = args.product.map(|product| product.name.as_str());
    let report = read_for(&args.file, &targets_with(args.loader), expected, &args.allow)?;
    let written = if output.json {
        output.object(&ImageObject::new(&report, &named(&args.file)))
    } else {
        output.data(report_text(&report, &shown(&args.file)).as_bytes())
    };
    CliError::found((!report.is_ok()).then_some(Kind::ImageRefused), written)
}

fn info(args: &InfoArgs, output: &mut Output) -> Result<(), CliError> {
    let report = read(&args.file, None, &[])?;
    if output.json {
        output.object(&ImageObject::new(&report, &named(&args.file)))
    } else {
        output.data(facts_text(&report, &shown(&args.file)).as_bytes())
    }
}

fn make(args: &MakeArgs, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let target = args.product.target();
    let words = args.words.unwrap_or_else(|| make::usual_words(&target));
    let recipe = Recipe { target: &target, version: args.version, words, flaw: args.defect };
    let bytes = make::make(&recipe).map_err(|error| CliError::new(Kind::Usage, error))?;
    let path = args.out.clone().unwrap_or_else(|| args.product.file_name(args.version).into());
    let mut out = Destination::admit(Some(&path), global.yes)?;
    out.save(&bytes, output)?;
    if out.is_standard_output() {
        return Ok(());
    }
    let report =
        image::check(&bytes[..], None, &targets(), None, &[]).map_err(|error| CliError::new(Kind::Failed, error))?;
    if output.json {
        return output.object(&ImageObject::new(&report, &named(&path)));
    }
    let name = out.shown();
    output.remark(&format!("{name}: {}, {} written", contents(&report), counted(bytes.len() as u64, "byte")));
    Ok(())
}

/// Reads and checks an image file for `image` and `load`.
///
/// # Errors
/// Only if the file cannot be read: the kind is [`Kind::ImageRefused`] then. A bad file is a report.
pub fn read(path: &Path, expected: Option<&str>, allow: &[DefectId]) -> Result<Report, CliError> {
    read_for(path, &targets(), expected, allow)
}

/// The same, judged for these units and their loaders.
///
/// # Errors
/// As [`read`].
pub fn read_for(
    path: &Path,
    targets: &[Target],
    expected: Option<&str>,
    allow: &[DefectId],
) -> Result<Report, CliError> {
    if path == Path::new("-") {
        return checked(io::stdin().lock(), path, targets, expected, allow);
    }
    let size = match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => {
            let message = format!("{} is a directory, not an image file", shown(path));
            return Err(CliError::message(Kind::ImageRefused, message).hint("Name the .S file itself."));
        }
        Ok(metadata) => metadata.is_file().then_some(metadata.len()),
        Err(error) => return Err(unreadable(path, error)),
    };
    let file = File::open(path).map_err(|error| unreadable(path, error))?;
    let mut report = checked(file, path, targets, expected, allow)?;
    // What is not an image is not read to its end, but its size is known.
    report.facts.size = size.map_or(report.facts.size, |size| size.max(report.facts.size));
    Ok(report)
}

fn checked(
    reader: impl Read,
    path: &Path,
    targets: &[Target],
    expected: Option<&str>,
    allow: &[DefectId],
) -> Result<Report, CliError> {
    let name = path.file_name().map(|name| name.to_string_lossy());
    image::check(reader, name.as_deref(), targets, expected, allow).map_err(|error| unreadable(path, error))
}

fn unreadable(path: &Path, error: io::Error) -> CliError {
    let hint = match error.kind() {
        io::ErrorKind::NotFound => "Check the name; upload files are called like AXTC4CO_V1.2.0.elf.S.",
        io::ErrorKind::PermissionDenied => "Ask whoever owns the file for the right to read it, or copy it.",
        _ if path == Path::new("-") => "Name the .S file itself, or have a program write it to standard input.",
        _ => "Copy the file to a local disk and try again.",
    };
    let context = format!("cannot read the image {}", shown(path));
    CliError::new(Kind::ImageRefused, anyhow::Error::new(error).context(context)).hint(hint)
}

fn targets() -> Vec<Target> {
    targets_with(None)
}

/// All products, with this loader instead of their own if one is given.
pub fn targets_with(loader: Option<LoaderKind>) -> Vec<Target> {
    Product::all().iter().map(|product| product.target_with(loader.unwrap_or(product.loader.kind))).collect()
}

/// Reads the name of a defect that may be allowed; `load --allow` uses it too.
///
/// # Errors
/// If there is none of this name, or if nothing could be sent in spite of it.
pub fn allowable(name: &str) -> Result<DefectId, String> {
    let id: DefectId = name.parse().map_err(|error| {
        let known: Vec<&str> = DefectId::ALL.into_iter().filter(|id| can_be_meant(*id)).map(DefectId::name).collect();
        format!("{error}; possible: {}", known.join(", "))
    })?;
    if id.can_be_allowed() {
        Ok(id)
    } else {
        Err("it leaves part of the program unknown, so it cannot be allowed".into())
    }
}

/// Whether allowing it makes a difference somewhere: what is only a warning passes by itself, but for the missing
/// identity, which is an error where a product is expected, and the gap, which a unit's loader may not erase.
fn can_be_meant(id: DefectId) -> bool {
    id.can_be_allowed() && (id.severity() == Severity::Error || matches!(id, DefectId::NoIdentity | DefectId::Gap))
}

fn flaw(name: &str) -> Result<DefectId, String> {
    make::flaws().find(|id| id.name() == name).ok_or_else(|| {
        let known: Vec<&str> = make::flaws().map(DefectId::name).collect();
        format!("no such defect can be made; possible: {}", known.join(", "))
    })
}
