//! `axcon dictionary`: the unit's object dictionary through its own V, and what differs between two of them.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::Global;
use super::ask::{READS_DICTIONARY, confirm};
use super::error::{CliError, Kind};
use super::files::Destination;
use super::identify::PRE_OPERATIONAL;
use super::numbers::counted;
use super::output::{Closed, Output};
use super::talk::{Ended, Talk};
use super::{files, link, names};
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::dump::{self, Difference, Dump, DumpError};
use crate::session::{Command, DictionaryReading, Outcome, WalkEnd};
use crate::wire::visible;

/// Arguments of `axcon dictionary`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Deed,
}

#[derive(Debug, Subcommand)]
enum Deed {
    /// Read the whole object dictionary.
    ///
    /// It is read through the unit's V, which works in pre-operational state only; meanwhile the unit may halt scanning
    /// and CAN. The view is left in any case. Exit code 4 if the unit stops answering before the end: what it has shown is
    /// written all the same.
    Dump {
        /// How it is written. Otherwise FILE's ending says so (.json, .csv, .dcf), or --json.
        #[arg(long, value_enum)]
        format: Option<Format>,
        /// Write to FILE instead of standard output.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Compare the settings of two dumps (JSON), or of a dump with factory:PRODUCT. Exit code 1 if they differ.
    Diff {
        /// A dump, or factory:PRODUCT.
        #[arg(value_name = "A")]
        left: String,
        /// A dump, or factory:PRODUCT.
        #[arg(value_name = "B")]
        right: String,
        /// Compare what the units measure and what is their own as well.
        #[arg(long)]
        all: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Table,
    Json,
    Csv,
    Dcf,
}

impl Args {
    /// Whether a unit is read, rather than files.
    pub fn reads_a_unit(&self) -> bool {
        match self.command {
            Deed::Dump { .. } => true,
            Deed::Diff { .. } => false,
        }
    }
}

impl Format {
    /// The format that a file's name promises.
    fn of_file(file: &Path) -> Option<Self> {
        match file.extension()?.to_str()?.to_lowercase().as_str() {
            "json" => Some(Format::Json),
            "csv" => Some(Format::Csv),
            "dcf" => Some(Format::Dcf),
            _ => None,
        }
    }
}

#[derive(Serialize)]
struct DifferenceObject<'a> {
    index: String,
    subindex: u8,
    name: &'a str,
    left: Option<&'a str>,
    right: Option<&'a str>,
    setting: bool,
}

#[derive(Serialize)]
struct DiffObject<'a> {
    schema: &'static str,
    equal: bool,
    differences: Vec<DifferenceObject<'a>>,
}

/// What names the factory's values on the command line.
const FACTORY: &str = "factory:";
/// Bytes of the largest dump that is read back: ten times that of the product with the most entries.
const LARGEST_DUMP: u64 = 4 << 20;

/// Reads or compares.
///
/// # Errors
/// If nobody said yes, no unit answers, the unit refuses, or a dump cannot be read or written.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    match args.command {
        Deed::Dump { format, out } => {
            let promised = out.as_deref().and_then(Format::of_file);
            let format = output.format(format, promised, Format::Json, Format::Table)?;
            dump(format, Destination::admit(out.as_deref(), global.yes)?, global, output)
        }
        Deed::Diff { left, right, all } => diff(&left, &right, all, output),
    }
}

fn dump(format: Format, mut out: Destination, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if !link::is_recording(global) {
        confirm(READS_DICTIONARY, global, output)?;
    }
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    let (reading, stopped_by) = read(&mut talk)?;
    let facts = talk.session().facts().clone();
    let product = facts.product.as_ref().and_then(|known| Product::named(&known.value));
    let dump = Dump::of(&reading, product, &facts);
    let text = match (format, product) {
        (Format::Json, _) => dump.json(),
        (Format::Table, _) => dump.table(),
        (Format::Csv, _) => dump.csv(),
        (Format::Dcf, Some(product)) => {
            let unix_millis = talk.calendar().at(talk.now()).as_millisecond();
            dump::configuration(&reading, product, &facts, unix_millis)
        }
        (Format::Dcf, None) => {
            let message = "a DCF needs to know the product, and the unit does not say it";
            return Err(CliError::message(Kind::Failed, message).hint("--format json keeps everything that was read"));
        }
    };
    let written = out.save(text.as_bytes(), output);
    say_what_is_open(&dump, output);
    if dump.complete {
        return written;
    }
    // That it is not everything counts, even if nobody reads the output any more.
    written.or_else(|error| if error.error.is::<Closed>() { Ok(()) } else { Err(error) })?;
    match stopped_by {
        Some(error) => {
            let entries = dump.entries.len();
            Err(error.hint(format!("what was read is written all the same; entries read: {entries}")))
        }
        None => Err(not_all(&reading, &dump, talk.is_recorded())),
    }
}

/// Reads the object dictionary, to its end or until an interrupt or the loss of the link stops it: then the error comes
/// with what was read.
fn read(talk: &mut Talk) -> Result<(Box<DictionaryReading>, Option<CliError>), CliError> {
    let (outcome, stopped_by) = match talk.run(Command::ReadDictionary, |_, _| Ok(()))? {
        Ended::Finished { outcome, interrupted: false } => (outcome, None),
        Ended::Finished { outcome, interrupted: true } => {
            (outcome, Some(CliError::message(Kind::Interrupted, "interrupted; the view has been left")))
        }
        Ended::Lost { outcome, error } => {
            (outcome, Some(error.hint("the unit may still be in its view, with scanning halted: X leaves it")))
        }
    };
    let stopped_by = match stopped_by {
        Some(error) if !matches!(outcome, Outcome::DictionaryRead(_)) => return Err(error),
        stopped_by => stopped_by,
    };
    let reading = talk.expect_reading(outcome).map_err(|error| match error.kind {
        Kind::UnitRefused => error.hint(PRE_OPERATIONAL),
        _ => error,
    })?;
    Ok((reading, stopped_by))
}

/// Remarks on values that are missing or not certain in a dump that is otherwise what was asked for.
fn say_what_is_open(dump: &Dump, output: &mut Output) {
    if has_no_reading(dump) {
        output.remark(
            "axcon: no input has a reading: a unit that has just started has none for up to 5 s, and measures nothing while \
             it shows its object dictionary; read it again",
        );
    }
    if dump.doubtful() > 0 {
        let values = counted(dump.doubtful(), "value");
        output.remark(&format!(
            "{values} left open: the unit prints hexadecimal numbers without a mark, so digits may be either"
        ));
    }
}

/// Whether the unit lists its field values (6100h) and none of them has a value. The first ones come 3 s after power-up
/// (AXTC4CO manual, section 1.1), on the AXRTD8CO 5 s.
fn has_no_reading(dump: &Dump) -> bool {
    let is_input = |at: ObjectAddress| at.index == FIELD_VALUE && at.sub > 0;
    let mut inputs = dump.entries.iter().filter(|entry| is_input(entry.at())).peekable();
    inputs.peek().is_some() && inputs.all(|entry| entry.value.is_none())
}

/// The object with the field values.
const FIELD_VALUE: u16 = 0x6100;

/// The error of a reading that has ended before the object dictionary did, with the reason.
fn not_all(reading: &DictionaryReading, dump: &Dump, is_recorded: bool) -> CliError {
    let (missing, entries) = (dump.missing.len(), dump.entries.len());
    let message = match &reading.end {
        WalkEnd::NotUnderstood { first } => format!(
            "the object dictionary is not all understood: {} not, the first is \"{}\"; entries read: {entries}, missing: \
             {missing}",
            counted(reading.unrecognised_lines, "line"),
            visible::line(first.as_bytes()),
        ),
        WalkEnd::Restarted => {
            format!("the unit restarted in the middle of its object dictionary; entries read: {entries}")
        }
        WalkEnd::Whole | WalkEnd::Stopped | WalkEnd::Cancelled if is_recorded => {
            format!("the recording does not show the end of the object dictionary; entries read: {entries}")
        }
        WalkEnd::Whole | WalkEnd::Stopped | WalkEnd::Cancelled => {
            format!("the unit stopped answering before the end of its object dictionary; entries read: {entries}")
        }
    };
    let error = CliError::message(Kind::NoAnswer, message).hint("what was read is written all the same");
    match reading.end {
        WalkEnd::NotUnderstood { .. } => {
            error.hint("the recording of this session has every line; 'axcon terminal' shows them")
        }
        WalkEnd::Restarted => error.hint("read it again; a unit that resets itself may be short of supply"),
        WalkEnd::Whole | WalkEnd::Stopped | WalkEnd::Cancelled => error,
    }
}

fn diff(left: &str, right: &str, all: bool, output: &mut Output) -> Result<(), CliError> {
    let mut found = dump::differences(&source(left)?, &source(right)?);
    found.retain(|difference| all || difference.setting);
    let written = if output.json {
        let differences = found.iter().map(|difference| DifferenceObject {
            index: format!("{:04X}", difference.at.index),
            subindex: difference.at.sub,
            name: &difference.name,
            left: difference.left.as_deref(),
            right: difference.right.as_deref(),
            setting: difference.setting,
        });
        let differences: Vec<_> = differences.collect();
        output.object(&DiffObject { schema: "axcon.dictionary-diff/1", equal: differences.is_empty(), differences })
    } else {
        let mut lines = String::new();
        for difference in &found {
            let Difference { at, name, .. } = difference;
            let side = |value: Option<String>| value.unwrap_or_else(|| "not there".into());
            let (left, right) = (side(difference.shown_left()), side(difference.shown_right()));
            lines.push_str(&format!("{at}  {name:<58} {left:>14}  {right:>14}\n"));
        }
        output.data(lines.as_bytes())
    };
    CliError::found((!found.is_empty()).then_some(Kind::Failed), written)
}

fn source(named: &str) -> Result<Dump, CliError> {
    if let Some(name) = named.strip_prefix(FACTORY) {
        let refused = |complaint| CliError::message(Kind::Usage, format!("'{named}': {complaint}"));
        return names::product(name).map(Dump::factory).map_err(refused);
    }
    let file = Path::new(named);
    let text = files::read_text(file, LARGEST_DUMP).map_err(|error| {
        CliError::new(Kind::Usage, anyhow::Error::new(error).context(format!("cannot read the dump '{named}'")))
    })?;
    Dump::parse(named, &text).map_err(|error| {
        let no_dump = matches!(error, DumpError::Syntax { .. });
        let error = match &error {
            DumpError::Syntax { name, fault } if fault.is_syntax() || fault.is_eof() => {
                let what = if fault.is_eof() { "the file ends before its JSON does" } else { "this is not JSON" };
                // In an empty file serde counts from 0.
                let (line, column) = (fault.line(), fault.column().max(1));
                CliError::message(Kind::Usage, format!("{name}:{line}:{column}: {what}"))
            }
            DumpError::Syntax { .. } | DumpError::Schema { .. } => CliError::new(Kind::Usage, error),
        };
        if no_dump { error.hint("'axcon dictionary dump --format json --out FILE' writes one") } else { error }
    })
}
