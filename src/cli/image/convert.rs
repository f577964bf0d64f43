//! `axcon image convert`: the same program in another file.
//!
//! What is written is checked like any other image before it takes its place, so a conversion cannot make a bad file of
//! a good one.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::report::contents;
use super::{allowable, checked, read, report_text, targets};
use crate::cli::Global;
use crate::cli::error::{CliError, Kind};
use crate::cli::files::{Destination, named, shown};
use crate::cli::numbers::{self, counted};
use crate::cli::output::Output;
use crate::image::{self, AddressUnit, ConvertError, DefectId, LineEnd, Report, Shape};

/// Arguments.
///
/// An image with errors is refused, except that --address-unit mends addresses that count the wrong thing. S-records
/// are always written in the form that loaders take: S0 with a four-byte address, S3, S7, upper case.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The image; - is standard input.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Where to write it; - is standard output.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The format; by default Intel HEX if the new name ends with .hex, .ihex or .ihx, else S-records.
    #[arg(long, value_enum)]
    format: Option<FormatName>,
    /// What addresses should count; by default what they count now.
    #[arg(long, value_enum)]
    address_unit: Option<UnitName>,
    /// Data bytes of a record, 250 at most; by default as they are.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::within::<u8>(1..=250))]
    record_bytes: Option<u8>,
    /// How lines end.
    #[arg(long, value_enum, default_value = "crlf")]
    line_end: LineEndName,
    /// Let this error pass. It is written as it would be sent.
    #[arg(long, value_name = "DEFECT", value_parser = allowable)]
    allow: Vec<DefectId>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatName {
    /// Motorola S-records.
    Srec,
    /// Intel HEX.
    Ihex,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum UnitName {
    /// 16-bit words, as the scanners' loaders want.
    Word,
    /// Bytes, as general tools want.
    Byte,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum LineEndName {
    /// Carriage return.
    Cr,
    /// Line feed.
    Lf,
    /// Both.
    Crlf,
}

pub(super) fn run(args: &Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let mut allow = args.allow.clone();
    if args.address_unit.is_some() {
        allow.push(DefectId::AddressUnit);
    }
    let report = read(&args.input, None, &allow)?;
    let Some(image) = report.image() else {
        return refuse(&report, &args.input, "has errors, so nothing is written", output);
    };
    let image = image.image();
    let name = shown(&args.input);
    let shape = shape(args, image.address_unit);
    if args.address_unit.is_some() && report.facts.address_unit.is_none() && report.facts.identity.is_none() {
        let message = format!("nothing in {name} shows whether its addresses count words or bytes");
        return Err(
            CliError::message(Kind::ImageRefused, message).hint("without --address-unit they are written as they are")
        );
    }
    let bytes = image::convert(image, &shape).map_err(|error| inexpressible(error, &name))?;
    // Addresses that general tools want are not a loader's, which is not a mistake here.
    allow.push(DefectId::AddressUnit);
    let written = checked(&bytes[..], &args.out, &targets(), None, &allow)?;
    if !written.is_ok() {
        return refuse(&written, &args.out, "would have errors, so it is not written", output);
    }
    let mut out = Destination::admit(Some(&args.out), global.yes)?;
    out.save(&bytes, output)?;
    if out.is_standard_output() {
        return Ok(());
    }
    if output.json {
        return output.object(&super::ImageObject::new(&written, &named(&args.out)));
    }
    let out = out.shown();
    let unit = shape.address_unit.name();
    output.remark(&format!(
        "{out}: {}, addresses count {unit}s, {} written",
        contents(&written),
        counted(bytes.len() as u64, "byte")
    ));
    Ok(())
}

fn shape(args: &Args, address_unit: AddressUnit) -> Shape {
    let by_name = || {
        let extension = args.out.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if matches!(extension.as_str(), "hex" | "ihex" | "ihx") { FormatName::Ihex } else { FormatName::Srec }
    };
    Shape {
        format: match args.format.unwrap_or_else(by_name) {
            FormatName::Srec => image::Format::SRecord,
            FormatName::Ihex => image::Format::IntelHex,
        },
        address_unit: args.address_unit.map_or(address_unit, |unit| match unit {
            UnitName::Word => AddressUnit::Word,
            UnitName::Byte => AddressUnit::Byte,
        }),
        record_bytes: args.record_bytes,
        line_end: match args.line_end {
            LineEndName::Cr => LineEnd::Cr,
            LineEndName::Lf => LineEnd::Lf,
            LineEndName::Crlf => LineEnd::CrLf,
        },
    }
}

fn inexpressible(error: ConvertError, name: &str) -> CliError {
    match error {
        ConvertError::RecordBytes { .. } | ConvertError::HalfWords { .. } => CliError::new(Kind::Usage, error),
        ConvertError::TooHigh { .. } | ConvertError::Odd { .. } => {
            CliError::new(Kind::ImageRefused, anyhow::Error::new(error).context(format!("cannot convert {name}")))
                .hint("'axcon image info' shows which addresses it has, and what they count")
        }
    }
}

fn refuse(report: &Report, file: &Path, what: &str, output: &mut Output) -> Result<(), CliError> {
    let mut written = Ok(());
    if output.json {
        written = output.object(&super::ImageObject::new(report, &named(file)));
    } else {
        let name = shown(file);
        output.remark(report_text(report, &name).trim_end());
        output.remark(&format!("axcon: {name} {what}"));
    }
    CliError::found(Some(Kind::ImageRefused), written)
}
