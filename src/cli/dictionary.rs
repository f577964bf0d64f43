//! `axcon dictionary`: the unit's object dictionary through its own V, and what differs between two of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use serde::{Deserialize, Serialize};

use super::Global;
use super::confirm::confirm;
use super::error::{CliError, Kind};
use super::link;
use super::output::Output;
use super::talk::{Ended, Talk};
use crate::canopen::{DataType, ObjectAddress, Value};
use crate::device::dictionary::{Access, Entry, Object};
use crate::device::{Product, eds};
use crate::session::{Command, DictionaryReading, Facts, Outcome};
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
    /// and CAN. The view is left in any case.
    Dump {
        /// How it is written. JSON if --json is given.
        #[arg(long, value_enum)]
        format: Option<Format>,
        /// Write to FILE instead of standard output.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Compare two dumps (JSON), or a dump with factory:PRODUCT. Exit code 1 if they differ.
    Diff {
        /// A dump, or factory:PRODUCT.
        #[arg(value_name = "A")]
        left: String,
        /// A dump, or factory:PRODUCT.
        #[arg(value_name = "B")]
        right: String,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Table,
    Json,
    Csv,
    Dcf,
}

/// A dump as it is written and read again.
#[derive(Debug, Serialize, Deserialize)]
struct Dump {
    schema: String,
    product: Option<String>,
    version: Option<String>,
    complete: bool,
    unrecognised_lines: u64,
    entries: Vec<DumpEntry>,
    missing: Vec<Missing>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct DumpEntry {
    index: String,
    subindex: u8,
    name: String,
    value: Option<serde_json::Number>,
    text: String,
    default: Option<serde_json::Number>,
    deviates: bool,
    unit: Option<String>,
    meaning: Option<String>,
    /// Bits, and not a number of something: people read these in hexadecimal digits.
    #[serde(skip)]
    bits: bool,
}

#[derive(Debug, Serialize, Deserialize)]
struct Missing {
    index: String,
    subindex: u8,
}

#[derive(Serialize)]
struct Difference<'a> {
    index: &'a str,
    subindex: u8,
    name: &'a str,
    left: Option<&'a str>,
    right: Option<&'a str>,
}

#[derive(Serialize)]
struct DiffObject<'a> {
    schema: &'static str,
    equal: bool,
    differences: Vec<Difference<'a>>,
}

const SCHEMA: &str = "axcon.dictionary/1";
/// What stands for the factory's values on the command line.
const FACTORY: &str = "factory:";
/// Largest dump that is read back; one of the largest product has a tenth of it.
const LARGEST_DUMP: u64 = 4 << 20;

/// Reads or compares.
///
/// # Errors
/// If nobody said yes, no unit answers, the unit refuses, or a dump cannot be read or written.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    match args.command {
        Deed::Dump { format, out } => {
            let format = format.unwrap_or(if output.json { Format::Json } else { Format::Table });
            dump(format, out.as_deref(), global, output)
        }
        Deed::Diff { left, right } => diff(&left, &right, output),
    }
}

fn dump(format: Format, out: Option<&Path>, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if !link::is_recording(global) {
        confirm("While the object dictionary is read, the unit may halt scanning and CAN", global, output)?;
    }
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    let ended = talk.run(Command::ReadDictionary, |_, _| Ok(()))?;
    let facts = talk.session().facts().clone();
    talk.close(output);
    let reading = match ended {
        Ended::Finished { outcome: Outcome::DictionaryRead(reading), interrupted: false } => reading,
        Ended::Finished { interrupted: true, .. } => {
            return Err(CliError::message(Kind::Interrupted, "interrupted; the view has been left"));
        }
        Ended::Finished { outcome, interrupted: false } => {
            return talk
                .expect_done(outcome)
                .and_then(|()| Err(CliError::message(Kind::Failed, "the reading ended without a result")));
        }
        Ended::Lost { error, .. } => {
            return Err(error.hint("the unit may still stand in its view, with scanning halted: X leaves it"));
        }
    };
    let product = facts.product.as_ref().and_then(|known| Product::named(&known.value));
    let dump = Dump::of(&reading, product, &facts);
    if !dump.complete {
        output.remark("axcon: the unit stopped answering before the end of its object dictionary");
    }
    let text = match format {
        Format::Json => serde_json::to_string(&dump).map_err(|error| CliError::new(Kind::Failed, error))? + "\n",
        Format::Table => dump.table(),
        Format::Csv => dump.csv(),
        Format::Dcf => configuration(&reading, product, &facts)?,
    };
    match out {
        None => output.data(text.as_bytes()),
        Some(file) => write_whole(file, text.as_bytes()),
    }
}

impl Dump {
    fn of(reading: &DictionaryReading, product: Option<&Product>, facts: &Facts) -> Self {
        let node_id = facts.node_id.as_ref().map_or(127, |known| known.value);
        let entries = reading.entries.iter().map(|read| {
            let object = product.and_then(|product| product.dictionary.object(read.at.index));
            let entry = object.and_then(|object| object.entry(read.at.sub));
            let default = entry.and_then(|entry| entry.default).map(|default| default.on_node(node_id));
            DumpEntry {
                index: format!("{:04X}", read.at.index),
                subindex: read.at.sub,
                name: object.zip(entry).map_or_else(String::new, |(object, entry)| name(object, entry)),
                value: read.value.and_then(number),
                text: visible::line(read.text.as_bytes()),
                default: default.and_then(number),
                deviates: entry.is_some_and(|entry| deviates(read.at, entry, read.value, default)),
                unit: entry.and_then(|entry| entry.unit.clone()),
                meaning: entry.zip(read.value).and_then(|(entry, value)| entry.meaning(value)).map(str::to_owned),
                bits: entry.is_some_and(|entry| entry.data_type == DataType::Unsigned32 && entry.unit.is_none()),
            }
        });
        let missing = product.into_iter().flat_map(|product| product.dictionary.entries()).filter_map(|(at, _, _)| {
            let there = reading.entries.iter().any(|read| read.at == at);
            (!there).then(|| Missing { index: format!("{:04X}", at.index), subindex: at.sub })
        });
        Dump {
            schema: SCHEMA.to_owned(),
            product: facts.product.as_ref().map(|known| known.value.clone()),
            version: facts.version.as_ref().map(|known| known.value.to_string()),
            complete: reading.complete,
            unrecognised_lines: reading.unrecognised_lines,
            entries: entries.collect(),
            missing: missing.collect(),
        }
    }

    /// The factory's values as a dump.
    fn factory(product: &Product) -> Self {
        let entries = product.dictionary.entries().filter(|(_, _, entry)| entry.access == Access::ReadWrite);
        let entries = entries.filter_map(|(at, object, entry)| {
            let default = entry.default?.on_node(product.can.node_id);
            Some(DumpEntry {
                index: format!("{:04X}", at.index),
                subindex: at.sub,
                name: name(object, entry),
                value: number(default),
                text: default.to_string(),
                default: number(default),
                deviates: false,
                unit: entry.unit.clone(),
                meaning: entry.meaning(default).map(str::to_owned),
                bits: false,
            })
        });
        Dump {
            schema: SCHEMA.to_owned(),
            product: Some(product.name.clone()),
            version: None,
            complete: true,
            unrecognised_lines: 0,
            entries: entries.collect(),
            missing: Vec::new(),
        }
    }

    fn table(&self) -> String {
        let mut text = String::new();
        let deviations = self.entries.iter().filter(|entry| entry.deviates).count();
        for entry in &self.entries {
            let DumpEntry { index, subindex, name, unit, meaning, .. } = entry;
            let bits = entry.value.as_ref().filter(|_| entry.bits).and_then(serde_json::Number::as_u64);
            let value = bits.map_or_else(|| entry.shown(), |bits| format!("0x{bits:08X}"));
            let unit = unit.as_deref().map(|unit| format!(" {unit}")).unwrap_or_default();
            let meaning = meaning.as_deref().map(|meaning| format!("  {meaning}")).unwrap_or_default();
            let mark = if entry.deviates { "*" } else { " " };
            let factory = entry.default.as_ref().filter(|_| entry.deviates);
            let factory = factory.map(|default| format!("  (factory {default})")).unwrap_or_default();
            text.push_str(&format!("{mark} {index}:{subindex:02X}  {name:<58} {value:>14}{unit}{meaning}{factory}\n"));
        }
        text.push_str(&format!("{} entries, {deviations} differ from the factory's (*)\n", self.entries.len()));
        if !self.missing.is_empty() {
            let list: Vec<String> = self.missing.iter().map(|at| format!("{}:{:02X}", at.index, at.subindex)).collect();
            text.push_str(&format!("not shown by the unit: {}\n", list.join(", ")));
        }
        text
    }

    fn csv(&self) -> String {
        let mut text = String::from("index,subindex,name,value,unit,meaning,default,deviates,text\n");
        for entry in &self.entries {
            let number =
                |number: &Option<serde_json::Number>| number.as_ref().map(ToString::to_string).unwrap_or_default();
            let fields = [
                entry.index.clone(),
                entry.subindex.to_string(),
                quoted(&entry.name),
                number(&entry.value),
                quoted(entry.unit.as_deref().unwrap_or_default()),
                quoted(entry.meaning.as_deref().unwrap_or_default()),
                number(&entry.default),
                u8::from(entry.deviates).to_string(),
                quoted(&entry.text),
            ];
            text.push_str(&fields.join(","));
            text.push('\n');
        }
        text
    }
}

impl DumpEntry {
    /// The value for a person; what the unit printed where there is none.
    fn shown(&self) -> String {
        self.value.as_ref().map_or_else(|| "-".to_owned(), ToString::to_string)
    }
}

fn name(object: &Object, entry: &Entry) -> String {
    if object.entries.len() == 1 { object.name.clone() } else { format!("{}, {}", object.name, entry.name) }
}

/// Whether a parameter is not what the factory made it. Measurements and what is a unit's own are no deviations.
fn deviates(at: ObjectAddress, entry: &Entry, value: Option<Value>, default: Option<Value>) -> bool {
    let parameter = entry.access == Access::ReadWrite && !matches!(at.index, 0x1003 | 0x1010 | 0x1011);
    let differs = value.zip(default).is_some_and(|(value, default)| match (value, default) {
        // The unit prints as many digits as it likes.
        (Value::Real32(value), Value::Real32(default)) => (value - default).abs() > default.abs().max(1.0) * 1e-3,
        _ => value != default,
    });
    parameter && differs
}

fn number(value: Value) -> Option<serde_json::Number> {
    match (value, value.as_integer()) {
        // The shortest decimal that is this value: 0.1, not 0.10000000149.
        (Value::Real32(real), _) => serde_json::Number::from_f64(real.to_string().parse().ok()?),
        (_, integer) => integer.map(serde_json::Number::from),
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn configuration(reading: &DictionaryReading, product: Option<&Product>, facts: &Facts) -> Result<String, CliError> {
    let product = product.ok_or_else(|| {
        CliError::message(Kind::Failed, "a DCF needs to know the product, and the unit does not say it")
            .hint("--format json keeps everything that was read")
    })?;
    let values = reading.entries.iter().filter_map(|read| Some((read.at, read.value?))).collect::<BTreeMap<_, _>>();
    let configuration = eds::Configuration {
        node_id: facts.node_id.as_ref().map_or(product.can.node_id, |known| known.value),
        kbps: facts.can_kbps.as_ref().map_or(product.can.kbps, |known| known.value),
        values,
    };
    Ok(eds::write_configuration(product, &configuration))
}

/// Writes a file so that the old or the new one is there at any moment.
fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let mut new = file.as_os_str().to_owned();
    new.push(".new");
    let new = PathBuf::from(new);
    std::fs::write(&new, bytes).and_then(|()| std::fs::rename(&new, file)).map_err(|error| {
        let context = format!("cannot write '{}'", file.display());
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(context))
    })
}

fn diff(left: &str, right: &str, output: &mut Output) -> Result<(), CliError> {
    let (left, right) = (source(left)?, source(right)?);
    let by_address = |dump: &Dump| -> BTreeMap<(String, u8), DumpEntry> {
        dump.entries.iter().map(|entry| ((entry.index.clone(), entry.subindex), entry.clone())).collect()
    };
    let (of_left, of_right) = (by_address(&left), by_address(&right));
    // Against the factory only what it defines can differ.
    let factory = left.version.is_none() || right.version.is_none();
    let mut addresses: Vec<&(String, u8)> = of_left.keys().chain(of_right.keys()).collect();
    addresses.sort();
    addresses.dedup();
    let shown = |entry: Option<&DumpEntry>| entry.map(DumpEntry::shown);
    let mut found = Vec::new();
    for address in addresses {
        let (left, right) = (of_left.get(address), of_right.get(address));
        let same = match (left, right) {
            (Some(left), Some(right)) => same_number(left.value.as_ref(), right.value.as_ref()),
            (None, _) | (_, None) => factory,
        };
        if !same {
            let name = left.or(right).map(|entry| entry.name.clone()).unwrap_or_default();
            found.push((address, name, shown(left), shown(right)));
        }
    }
    if output.json {
        let differences = found.iter().map(|(address, name, left, right)| Difference {
            index: &address.0,
            subindex: address.1,
            name,
            left: left.as_deref(),
            right: right.as_deref(),
        });
        let differences: Vec<Difference<'_>> = differences.collect();
        output.object(&DiffObject { schema: "axcon.dictionary-diff/1", equal: differences.is_empty(), differences })?;
    } else {
        for ((index, sub), name, left, right) in &found {
            let side = |value: &Option<String>| value.clone().unwrap_or_else(|| "not there".into());
            let line = format!("{index}:{sub:02X}  {name:<58} {:>14}  {:>14}\n", side(left), side(right));
            output.data(line.as_bytes())?;
        }
    }
    if found.is_empty() { Ok(()) } else { Err(CliError::reported(Kind::Failed)) }
}

/// Equal, as far as a unit's number of digits shows.
fn same_number(left: Option<&serde_json::Number>, right: Option<&serde_json::Number>) -> bool {
    match (left.and_then(serde_json::Number::as_f64), right.and_then(serde_json::Number::as_f64)) {
        (Some(left), Some(right)) if left.fract() == 0.0 && right.fract() == 0.0 => left == right,
        (Some(left), Some(right)) => (left - right).abs() <= right.abs().max(1.0) * 1e-3,
        (left, right) => left == right,
    }
}

fn source(named: &str) -> Result<Dump, CliError> {
    if let Some(name) = named.strip_prefix(FACTORY) {
        let product = Product::named(name).ok_or_else(|| {
            let known: Vec<String> = Product::all().iter().map(|product| product.name.to_lowercase()).collect();
            CliError::message(Kind::Usage, format!("'{name}' is no product; there is {}", known.join(", ")))
        })?;
        return Ok(Dump::factory(product));
    }
    let file = Path::new(named);
    let failed =
        |error: anyhow::Error| CliError::new(Kind::Usage, error.context(format!("cannot read the dump '{named}'")));
    let length = std::fs::metadata(file).map_err(|error| failed(error.into()))?.len();
    if length > LARGEST_DUMP {
        return Err(failed(anyhow::anyhow!("it has {length} bytes, a dump has at most {LARGEST_DUMP}")));
    }
    let text = std::fs::read_to_string(file).map_err(|error| failed(error.into()))?;
    let dump: Dump = serde_json::from_str(&text).map_err(|error| {
        let (line, column) = (error.line(), error.column());
        CliError::message(Kind::Usage, format!("{named}:{line}:{column}: this is no dump: {error}"))
            .hint("'axcon dictionary dump --format json --out FILE' writes one")
    })?;
    if dump.schema != SCHEMA {
        let message = format!("'{named}' has the schema '{}', not '{SCHEMA}'", visible::line(dump.schema.as_bytes()));
        return Err(CliError::message(Kind::Usage, message));
    }
    Ok(dump)
}
