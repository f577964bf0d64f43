//! `axcon image diff`: what differs between two images.
//!
//! Nothing is sent, so errors that leave the data known do not matter here: a damaged image can be compared with a sound
//! one. They are remarked on.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::report::contents;
use super::{read, report_text};
use crate::cli::error::{CliError, Kind};
use crate::cli::files::{named, shown};
use crate::cli::numbers::counted;
use crate::cli::output::Output;
use crate::image::{self, Change, CheckedImage, DefectId, Difference, Differing, Report};

/// Arguments.
///
/// Compared are the words the images write and their entry points, whatever the format, the order and size of records,
/// and whether addresses count words or bytes. Exit code 0 if they are equal, 1 if they differ, 5 if one cannot be read.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The one image.
    a: PathBuf,
    /// The other one. One of them may be -, standard input.
    b: PathBuf,
}

pub(super) fn run(args: &Args, output: &mut Output) -> Result<(), CliError> {
    if args.a == Path::new("-") && args.b == Path::new("-") {
        return Err(CliError::message(Kind::Usage, "both images cannot come from standard input"));
    }
    let (a, b) = (Side::read(&args.a, output)?, Side::read(&args.b, output)?);
    let found = image::diff(a.image.image(), b.image.image());
    let written = if output.json {
        output.object(&DiffObject::new(&a, &b, &found))
    } else {
        output.data(text(&a, &b, &found).as_bytes())
    };
    CliError::found((!found.is_none()).then_some(Kind::Failed), written)
}

/// The report as nobody has allowed anything: that errors do not matter here is not the user's word.
fn as_found(report: Report) -> Report {
    let mut report = report;
    report.defects.iter_mut().for_each(|defect| defect.allowed = false);
    report.allowed = 0;
    report.overridden.clear();
    report
}

/// One of the two.
struct Side {
    /// As it was given.
    file: String,
    /// The same for the screen.
    name: String,
    report: Report,
    image: CheckedImage,
}

impl Side {
    fn read(path: &Path, output: &mut Output) -> Result<Self, CliError> {
        let name = shown(path);
        let report = read(path, None, &DefectId::ALL)?;
        let Some(image) = report.image() else {
            if !output.json {
                output.remark(report_text(&as_found(report), &name).trim_end());
            }
            let message = format!("{name} leaves part of its data unknown, so it cannot be compared");
            return Err(CliError::message(Kind::ImageRefused, message)
                .hint("'axcon image check' says what is wrong with it and where"));
        };
        if report.errors > 0 {
            output.remark(&format!("axcon: {name} has {}; see 'axcon image check'", counted(report.errors, "error")));
        }
        Ok(Side { file: named(path), name, report, image })
    }
}

fn text(a: &Side, b: &Side, found: &Difference) -> String {
    let mut text = String::new();
    for (letter, side) in [("a", a), ("b", b)] {
        let words = counted(image::count_words(side.image.image()), "word");
        let _ = writeln!(text, "{letter}  {}: {}, {words}", side.name, contents(&side.report));
    }
    for Differing { change, words } in found.ranges.iter().take(RANGES_SHOWN) {
        let how = match change {
            Change::Changed => "changed",
            Change::OnlyFirst => "only in a",
            Change::OnlySecond => "only in b",
        };
        let number = counted(words.end - words.start, "word");
        let _ = writeln!(text, "0x{:04X} to 0x{:04X}  {number} {how}", words.start, words.end - 1);
    }
    if found.ranges.len() > RANGES_SHOWN {
        let more = counted((found.ranges.len() - RANGES_SHOWN) as u64, "more range");
        let _ = writeln!(text, "and {more}; --json lists them");
    }
    if found.entry {
        let (a, b) = (a.image.image(), b.image.image());
        let _ = writeln!(text, "entry point 0x{:04X} in a, 0x{:04X} in b", a.entry, b.entry);
    }
    if found.is_none() {
        let _ = writeln!(text, "equal: every word and the entry point");
        return text;
    }
    let mut sums: Vec<String> =
        [(Change::Changed, "changed"), (Change::OnlyFirst, "only in a"), (Change::OnlySecond, "only in b")]
            .into_iter()
            .filter(|&(change, _)| found.words(change) > 0)
            .map(|(change, how)| format!("{} {how}", counted(found.words(change), "word")))
            .collect();
    if found.ranges.is_empty() {
        sums.push("the same words".into());
    } else {
        sums.push(format!("in {}", counted(found.ranges.len() as u64, "range")));
    }
    let _ = writeln!(text, "different: {}", sums.join(", "));
    text
}

/// Both images and what differs, `axcon.image-diff/1`. Addresses count words.
#[derive(Serialize)]
struct DiffObject<'a> {
    schema: &'static str,
    equal: bool,
    a: SideObject<'a>,
    b: SideObject<'a>,
    address_unit: &'static str,
    words_changed: u64,
    words_only_a: u64,
    words_only_b: u64,
    entry_changed: bool,
    ranges: Vec<RangeObject>,
}

#[derive(Serialize)]
struct SideObject<'a> {
    file: &'a str,
    format: Option<&'static str>,
    product: Option<&'a str>,
    version: Option<String>,
    build: Option<String>,
    words: u64,
    entry: u64,
    errors: u64,
    warnings: u64,
}

#[derive(Serialize)]
struct RangeObject {
    start: u64,
    end: u64,
    words: u64,
    change: &'static str,
}

impl<'a> DiffObject<'a> {
    fn new(a: &'a Side, b: &'a Side, found: &Difference) -> Self {
        let ranges = found.ranges.iter().map(|Differing { change, words }| RangeObject {
            start: words.start,
            end: words.end,
            words: words.end - words.start,
            change: change.name(),
        });
        DiffObject {
            schema: "axcon.image-diff/1",
            equal: found.is_none(),
            a: SideObject::new(a),
            b: SideObject::new(b),
            address_unit: image::AddressUnit::Word.name(),
            words_changed: found.words(Change::Changed),
            words_only_a: found.words(Change::OnlyFirst),
            words_only_b: found.words(Change::OnlySecond),
            entry_changed: found.entry,
            ranges: ranges.collect(),
        }
    }
}

impl<'a> SideObject<'a> {
    fn new(side: &'a Side) -> Self {
        let identity = side.image.identity();
        let image = side.image.image();
        SideObject {
            file: &side.file,
            format: side.report.facts.format.map(image::Format::name),
            product: identity.map(|identity| identity.product.as_str()),
            version: identity.map(|identity| identity.version.to_string()),
            build: identity.map(|identity| format!("{}T{}", identity.build_date, identity.build_time)),
            words: image::count_words(image),
            entry: u64::from(image.entry) * u64::from(image.address_unit.bytes()) / 2,
            errors: side.report.errors,
            warnings: side.report.warnings,
        }
    }
}

/// Two versions differ in thousands of places; nobody reads them all.
const RANGES_SHOWN: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::image::targets;

    #[test]
    fn what_nobody_has_allowed_is_not_called_allowed() {
        // A data record is cut off, and with it the rest of the file.
        let file = "S0110000000050524F4752414D264441544196\nS3070000\n";
        let report = image::check(file.as_bytes(), None, &targets(), None, &DefectId::ALL).expect("a slice");
        assert!(report.allowed > 0, "{report:?}");
        let text = report_text(&as_found(report), "trunc.S");
        assert!(text.contains("error missing-terminator") && !text.contains("allowed"), "{text}");
    }
}
