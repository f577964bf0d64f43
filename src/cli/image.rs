//! `axcon image`: work on program images without a unit.
//!
//! Reading a file and showing its report are shared with `axcon load`, which refuses for the same reasons in the same
//! words.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write as _};
use std::path::{Path, PathBuf};

use clap::Subcommand;
use serde::Serialize;

use super::Global;
use super::error::{CliError, Kind};
use super::output::Output;
use crate::device::Product;
use crate::image::make::{self, Recipe};
use crate::image::{self, Defect, DefectId, Report, Target};
use crate::version::Version;

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
    #[arg(long, value_name = "NAME", value_parser = product)]
    product: Option<&'static Product>,
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
    #[arg(long, value_name = "NAME", value_parser = product)]
    product: &'static Product,
    /// The version it says it is, e.g. 1.2.0.
    #[arg(long, value_name = "VERSION")]
    version: Version,
    /// Its size in 16-bit words; by default three quarters of the flash, 81,920 at most.
    #[arg(long, value_name = "N")]
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
        Command::Make(args) => make(&args, global, output),
    }
}

fn check(args: &CheckArgs, output: &mut Output) -> Result<(), CliError> {
    let expected = args.product.map(|product| product.name.as_str());
    let report = read(&args.file, expected, &args.allow)?;
    let name = shown(&args.file);
    if output.json {
        output.object(&ImageObject::new(&report, &name))?;
    } else {
        output.data(report_text(&report, &name).as_bytes())?;
    }
    if report.is_ok() { Ok(()) } else { Err(CliError::reported(Kind::ImageRefused)) }
}

fn info(args: &InfoArgs, output: &mut Output) -> Result<(), CliError> {
    let report = read(&args.file, None, &[])?;
    let name = shown(&args.file);
    if output.json {
        output.object(&ImageObject::new(&report, &name))
    } else {
        output.data(facts_text(&report, &name).as_bytes())
    }
}

fn make(args: &MakeArgs, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let target = args.product.target();
    let words = args.words.unwrap_or_else(|| make::usual_words(&target));
    let recipe = Recipe { target: &target, version: args.version, words, flaw: args.defect };
    let bytes = make::make(&recipe).map_err(|error| CliError::new(Kind::Usage, error))?;
    let path = args.out.clone().unwrap_or_else(|| args.product.file_name(args.version).into());
    if path == Path::new("-") {
        return output.data(&bytes);
    }
    write(&path, &bytes, global.yes)?;
    let report =
        image::check(&bytes[..], None, &targets(), None, &[]).map_err(|error| CliError::new(Kind::Failed, error))?;
    let name = shown(&path);
    if output.json {
        return output.object(&ImageObject::new(&report, &name));
    }
    output.remark(&format!("{name}: {}, {} bytes written", contents(&report), grouped(bytes.len() as u64)));
    Ok(())
}

/// Reads and checks an image file for `image` and `load`.
///
/// # Errors
/// Only if the file cannot be read: the kind is [`Kind::ImageRefused`] then. A bad file is a report.
pub fn read(path: &Path, expected: Option<&str>, allow: &[DefectId]) -> Result<Report, CliError> {
    if path == Path::new("-") {
        return checked(io::stdin().lock(), path, expected, allow);
    }
    match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => {
            let message = format!("{} is a directory, not an image file", shown(path));
            return Err(CliError::message(Kind::ImageRefused, message).hint("Name the .S file itself."));
        }
        Ok(_) => {}
        Err(error) => return Err(unreadable(path, error)),
    }
    let file = File::open(path).map_err(|error| unreadable(path, error))?;
    checked(file, path, expected, allow)
}

fn checked(reader: impl Read, path: &Path, expected: Option<&str>, allow: &[DefectId]) -> Result<Report, CliError> {
    let name = path.file_name().map(|name| name.to_string_lossy());
    image::check(reader, name.as_deref(), &targets(), expected, allow).map_err(|error| unreadable(path, error))
}

fn unreadable(path: &Path, error: io::Error) -> CliError {
    let hint = match error.kind() {
        io::ErrorKind::NotFound => "Check the name; upload files are called like AXTC4CO_V1.2.0.elf.S.",
        io::ErrorKind::PermissionDenied => "Ask whoever owns the file for the right to read it, or copy it.",
        _ => "Copy the file to a local disk and try again.",
    };
    let context = format!("cannot read the image {}", shown(path));
    CliError::new(Kind::ImageRefused, anyhow::Error::new(error).context(context)).hint(hint)
}

fn write(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), CliError> {
    let mut options = OpenOptions::new();
    options.write(true);
    if overwrite {
        options.create(true).truncate(true);
    } else {
        options.create_new(true);
    }
    let written = options.open(path).and_then(|mut file| file.write_all(bytes));
    written.map_err(|error| {
        if error.kind() == io::ErrorKind::AlreadyExists {
            let message = format!("{} exists already", shown(path));
            return CliError::message(Kind::NeedsYes, message)
                .hint("Overwrite it with --yes, or name another with --out.");
        }
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot write {}", shown(path))))
    })
}

fn targets() -> Vec<Target> {
    Product::all().iter().map(Product::target).collect()
}

pub(super) fn product(name: &str) -> Result<&'static Product, String> {
    Product::named(name).ok_or_else(|| {
        let known: Vec<&str> = Product::all().iter().map(|product| product.name.as_str()).collect();
        format!("no such product; known: {}", known.join(", "))
    })
}

/// Reads the name of a defect that may be allowed; `load --allow` uses it too.
///
/// # Errors
/// If there is none of this name, or if nothing could be sent in spite of it.
pub fn allowable(name: &str) -> Result<DefectId, String> {
    let id: DefectId = name.parse().map_err(|error| format!("{error}; `docs/images.md` lists them"))?;
    if id.can_be_allowed() {
        Ok(id)
    } else {
        Err("it leaves part of the program unknown, so it cannot be allowed".into())
    }
}

fn flaw(name: &str) -> Result<DefectId, String> {
    make::flaws().find(|id| id.name() == name).ok_or_else(|| {
        let known: Vec<&str> = make::flaws().map(DefectId::name).collect();
        format!("no such defect can be made; possible: {}", known.join(", "))
    })
}

/// The report as text: a line for each defect, then the verdict.
pub fn report_text(report: &Report, file: &str) -> String {
    let mut text = String::new();
    for Defect { id, severity, allowed, line, column, message } in &report.defects {
        let severity = if *allowed { "allowed" } else { severity.name() };
        let _ = writeln!(text, "{file}:{line}:{column}: {severity} {id}: {message}");
    }
    if report.unlisted() > 0 {
        let _ = writeln!(text, "{file}: {} more defects are not listed", grouped(report.unlisted()));
    }
    let verdict = if report.is_ok() { "may be sent" } else { "must not be sent" };
    let mut counts = vec![
        counted(report.errors - report.allowed, "error"),
        counted(report.warnings, "warning"),
        counted(report.allowed, "allowed error"),
    ];
    counts.retain(|count| !count.is_empty());
    let counts = if counts.is_empty() { "no defects".into() } else { counts.join(", ") };
    let _ = writeln!(text, "{file}: {}: {verdict}, {counts}", contents(report));
    text
}

/// What is in the file, as a table.
fn facts_text(report: &Report, file: &str) -> String {
    let facts = &report.facts;
    let mut text = String::new();
    let mut row = |name: &str, value: &str| {
        let _ = writeln!(text, "{name:<13} {value}");
    };
    row("File", &format!("{file}, {} bytes", grouped(facts.size)));
    let ends = facts.line_end.map_or(String::new(), |end| format!(", line ends {}", end.name()));
    match facts.format {
        Some(format) => row("Format", &format!("{}, {} records{ends}", format.title(), grouped(facts.records))),
        None => row("Format", "none that is known"),
    }
    if let Some(header) = &facts.header {
        row("Header", &header.escape_ascii().to_string());
    }
    if let Some(identity) = &facts.identity {
        row("Product", &identity.product);
        row("Version", &format!("{}, built {} {}", identity.version, identity.build_date, identity.build_time));
    } else if facts.records > 0 {
        row("Product", "the image does not say");
    }
    if let Some(unit) = facts.address_unit {
        row("Addresses", &format!("count {}s", unit.name()));
    }
    for (at, range) in facts.ranges.iter().take(RANGES_SHOWN).enumerate() {
        let name = if at == 0 { "Program" } else { "" };
        row(name, &format!("0x{:04X} to 0x{:04X}", range.start, range.end - 1));
    }
    if facts.ranges.len() > RANGES_SHOWN {
        row("", &format!("and {} more ranges", facts.ranges.len() - RANGES_SHOWN));
    }
    if let Some(entry) = facts.entry {
        row("Entry point", &format!("0x{entry:04X}"));
    }
    if facts.data_bytes > 0 {
        let seconds = facts.characters as f64 / CHARACTERS_PER_SECOND;
        row("Data", &format!("{} bytes{}", grouped(facts.data_bytes), share(report)));
        row("To send", &format!("{} characters, {seconds:.1} s at 115200 baud", grouped(facts.characters)));
    }
    let counts = [counted(report.errors, "error"), counted(report.warnings, "warning")];
    let counts: Vec<&str> = counts.iter().map(String::as_str).filter(|count| !count.is_empty()).collect();
    if counts.is_empty() {
        row("Defects", "none");
    } else {
        row("Defects", &format!("{}; `axcon image check` lists them", counts.join(", ")));
    }
    text
}

/// How much of the flash the data takes.
fn share(report: &Report) -> String {
    let facts = &report.facts;
    let Some(flash) = facts.flash_bytes.filter(|&flash| facts.data_bytes <= flash) else { return String::new() };
    let whose = facts.judged_for.as_ref().map_or("largest known".into(), |product| format!("{product}'s"));
    match facts.data_bytes * 100 / flash {
        0 => format!(", less than 1 % of the {whose} flash"),
        percent => format!(", {percent} % of the {whose} flash"),
    }
}

/// What the file holds, in a few words.
fn contents(report: &Report) -> String {
    let records = counted(report.facts.records, "record");
    match &report.facts.identity {
        Some(identity) => format!("{} V{}, {records}", identity.product, identity.version),
        None if records.is_empty() => "no image".into(),
        None => format!("an image without a name, {records}"),
    }
}

/// The report as JSON, `axcon.image/1`.
#[derive(Debug, Serialize)]
pub struct ImageObject<'a> {
    schema: &'static str,
    file: &'a str,
    format: Option<&'static str>,
    ok: bool,
    product: Option<&'a str>,
    version: Option<String>,
    build: Option<String>,
    size: u64,
    header: Option<String>,
    records: u64,
    data_bytes: u64,
    characters: u64,
    address_unit: &'static str,
    ranges: Vec<RangeObject>,
    entry: Option<u32>,
    errors: u64,
    warnings: u64,
    overridden: Vec<&'static str>,
    unlisted: u64,
    defects: Vec<DefectObject<'a>>,
}

#[derive(Debug, Serialize)]
struct RangeObject {
    start: u64,
    end: u64,
}

/// One defect as JSON, in `axcon.image/1` and `axcon.load/1`.
#[derive(Debug, Serialize)]
pub struct DefectObject<'a> {
    id: &'static str,
    severity: &'static str,
    line: u64,
    column: u32,
    message: &'a str,
    allowed: bool,
}

impl<'a> ImageObject<'a> {
    /// The report of a file.
    pub fn new(report: &'a Report, file: &'a str) -> Self {
        let facts = &report.facts;
        let identity = facts.identity.as_ref();
        ImageObject {
            schema: "axcon.image/1",
            file,
            format: facts.format.map(image::Format::name),
            ok: report.is_ok(),
            product: identity.map(|identity| identity.product.as_str()),
            version: identity.map(|identity| identity.version.to_string()),
            build: identity.map(|identity| format!("{}T{}", identity.build_date, identity.build_time)),
            size: facts.size,
            header: facts.header.as_ref().map(|header| header.escape_ascii().to_string()),
            records: facts.records,
            data_bytes: facts.data_bytes,
            characters: facts.characters,
            address_unit: facts.address_unit.map_or("unknown", image::AddressUnit::name),
            ranges: facts.ranges.iter().map(|range| RangeObject { start: range.start, end: range.end }).collect(),
            entry: facts.entry,
            errors: report.errors,
            warnings: report.warnings,
            overridden: report.overridden.iter().map(|id| id.name()).collect(),
            unlisted: report.unlisted(),
            defects: defect_objects(report),
        }
    }
}

/// The defects of a report as JSON.
pub fn defect_objects(report: &Report) -> Vec<DefectObject<'_>> {
    report
        .defects
        .iter()
        .map(|defect| DefectObject {
            id: defect.id.name(),
            severity: defect.severity.name(),
            line: defect.line,
            column: defect.column,
            message: &defect.message,
            allowed: defect.allowed,
        })
        .collect()
}

/// A path for the screen: a name may hold anything, a terminal must not get it.
pub fn shown(path: &Path) -> String {
    if path == Path::new("-") {
        return "standard input".into();
    }
    path.to_string_lossy().chars().map(|letter| if letter.is_control() { '?' } else { letter }).collect()
}

/// `2 errors`; nothing if there are none.
fn counted(number: u64, what: &str) -> String {
    match number {
        0 => String::new(),
        1 => format!("1 {what}"),
        _ => format!("{} {what}s", grouped(number)),
    }
}

/// A number with its thousands apart.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// 115200 baud, ten bits a character.
const CHARACTERS_PER_SECOND: f64 = 11_520.0;
/// A program is one range, rarely two or three.
const RANGES_SHOWN: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        let table = [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")];
        for (number, text) in table {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn a_file_name_cannot_reach_the_terminal_as_control_codes() {
        assert_eq!(shown(Path::new("a\x1b[31m.S")), "a?[31m.S");
    }
}
