//! A report on an image, as text for a person and as JSON for a program.

use std::fmt::Write as _;

use serde::Serialize;

use crate::image::{self, Defect, DefectId, Report};

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
    // Sound as a file; but nobody could tell what runs then, so somebody has to answer for it ('axcon load').
    let is_nameless = report.defects.iter().any(|defect| defect.id == DefectId::NoIdentity && !defect.allowed);
    let verdict = match report.is_ok() {
        true if is_nameless => "may be sent with --allow no-identity",
        true => "may be sent",
        false => "must not be sent",
    };
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
pub(super) fn facts_text(report: &Report, file: &str) -> String {
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
pub(super) fn contents(report: &Report) -> String {
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

/// `2 errors`; nothing if there are none.
pub(super) fn counted(number: u64, what: &str) -> String {
    match number {
        0 => String::new(),
        1 => format!("1 {what}"),
        _ => format!("{} {what}s", grouped(number)),
    }
}

/// A number with its thousands apart.
pub(super) fn grouped(number: u64) -> String {
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
}
