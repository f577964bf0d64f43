//! A report on an image, as text for a person and as JSON for a program.

use std::fmt::Write as _;

use serde::Serialize;

use crate::cli::numbers::{counted, counted_all, grouped};
use crate::device::{BAUD, line_time};
use crate::image::{self, Defect, DefectId, Report};

/// The report as text: a line for each defect, then the verdict.
pub fn report_text(report: &Report, file: &str) -> String {
    let mut text = String::new();
    for Defect { id, severity, allowed, line, column, message } in &report.defects {
        let severity = if *allowed { "allowed" } else { severity.name() };
        let _ = writeln!(text, "{file}:{line}:{column}: {severity} {id}: {message}");
    }
    if report.unlisted() > 0 {
        let are = if report.unlisted() == 1 { "is" } else { "are" };
        let _ = writeln!(text, "{file}: {} {are} not listed", counted(report.unlisted(), "more defect"));
    }
    // The file is sound, but afterwards nobody could tell what the unit runs: 'axcon load' wants it allowed.
    let is_nameless = report.defects.iter().any(|defect| defect.id == DefectId::NoIdentity && !defect.allowed);
    let verdict = if !report.is_ok() {
        "must not be sent"
    } else if is_nameless {
        "may be sent with --allow no-identity"
    } else {
        "may be sent"
    };
    let errors = report.errors - report.allowed;
    let counts = counted_all(&[(errors, "error"), (report.warnings, "warning"), (report.allowed, "allowed error")]);
    let counts = counts.unwrap_or_else(|| "no defects".into());
    let _ = writeln!(text, "{file}: {}: {verdict}, {counts}", contents(report));
    text
}

/// What is in the file, as a table.
pub(super) fn facts_text(report: &Report, file: &str) -> String {
    let facts = &report.facts;
    let mut text = String::new();
    let mut row = |name: &str, value: &str| {
        let _ = writeln!(text, "{name:<13} {value}");
    };
    row("File", &format!("{file}, {}", counted(facts.size, "byte")));
    let ends = facts.line_end.map_or(String::new(), |end| format!(", line ends {}", end.name()));
    match facts.format {
        Some(format) => row("Format", &format!("{}, {}{ends}", format.title(), counted(facts.records, "record"))),
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
        row("", &format!("and {}", counted((facts.ranges.len() - RANGES_SHOWN) as u64, "more range")));
    }
    if let Some(entry) = facts.entry {
        row("Entry point", &format!("0x{entry:04X}"));
    }
    if facts.data_bytes > 0 {
        let seconds = line_time(facts.characters).as_secs_f64();
        row("Data", &format!("{}{}", counted(facts.data_bytes, "byte"), share(report)));
        row("To send", &format!("{} characters, {seconds:.1} s at {BAUD} baud", grouped(facts.characters)));
    }
    match counted_all(&[(report.errors, "error"), (report.warnings, "warning")]) {
        None => row("Defects", "none"),
        Some(counts) => row("Defects", &format!("{counts}; `axcon image check` lists them")),
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
pub(super) fn contents(report: &Report) -> String {
    let records = counted(report.facts.records, "record");
    match &report.facts.identity {
        Some(identity) => format!("{} V{}, {records}", identity.product, identity.version),
        None if report.facts.records == 0 => "no image".into(),
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

/// What speaks against a sound file for one unit, as JSON: it is on no line of the file.
pub fn misfit_object(id: DefectId, message: &str) -> DefectObject<'_> {
    DefectObject { id: id.name(), severity: id.severity().name(), line: 0, column: 0, message, allowed: false }
}

/// A program is one range, rarely two or three.
const RANGES_SHOWN: usize = 8;
