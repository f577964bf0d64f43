//! A unit's object dictionary with what it means: names, units, the factory's values, what differs.
//!
//! A session reads what the unit shows ([`DictionaryReading`]); here it is set beside what the product's manual says.
//! [`differences`] compares two of them; they are written for people and spreadsheets, and read again as JSON.

mod difference;
mod measure;
mod text;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use difference::{Difference, differences};
pub use measure::Measure;

use crate::canopen::{DataType, ObjectAddress, Value};
use crate::device::dictionary::{Access, Entry, Object};
use crate::device::emergency::Emergency;
use crate::device::{Product, eds};
use crate::session::{DictionaryReading, Facts, ReadEntry};
use crate::wire::dictionary::Shown;
use crate::wire::visible;

/// The list of active errors (CiA 301).
const ERROR_FIELD: u16 = 0x1003;
/// What a dump says it is.
const SCHEMA: &str = "axcon.dictionary/1";

/// An object dictionary as read from a unit, or as the factory makes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dump {
    schema: String,
    /// The product, where known.
    pub product: Option<String>,
    /// The software's version, where known.
    pub version: Option<String>,
    /// These are the factory's values from the manual, and not a unit's.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub factory: bool,
    /// Whether the unit showed all of it.
    pub complete: bool,
    /// Lines of the view in which no entry was recognised.
    pub unrecognised_lines: u64,
    /// In the unit's order.
    pub entries: Vec<DumpEntry>,
    /// What the manual has and the unit did not show.
    pub missing: Vec<Missing>,
}

/// One entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DumpEntry {
    #[serde(with = "digits")]
    index: u16,
    subindex: u8,
    /// Object and entry as the manual names them; empty if it has no such entry.
    pub name: String,
    /// The value, where the unit shows one that fits the entry's type.
    pub value: Option<serde_json::Number>,
    /// The value as the unit printed it; where it is not understood, all that follows index and sub-index.
    pub text: String,
    /// The factory's value on this node, where it has one.
    pub default: Option<serde_json::Number>,
    /// Whether this parameter is not what the factory made it.
    pub deviates: bool,
    /// Physical unit.
    pub unit: Option<String>,
    /// What the value means.
    pub meaning: Option<String>,
    /// The text says a value, but which one is uncertain.
    #[serde(default)]
    pub doubtful: bool,
    /// Bits, not a number of something: people read these in hexadecimal digits.
    #[serde(skip)]
    bits: bool,
}

/// An entry that was not shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    #[serde(with = "digits")]
    index: u16,
    subindex: u8,
}

/// An index as four hexadecimal digits.
mod digits {
    use serde::de::{Error, Unexpected};
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(index: &u16, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{index:04X}"))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u16, D::Error> {
        let text = String::deserialize(deserializer)?;
        let is_index = text.len() == 4 && text.bytes().all(|digit| digit.is_ascii_hexdigit());
        let index = u16::from_str_radix(&text, 16).ok().filter(|_| is_index);
        index.ok_or_else(|| D::Error::invalid_value(Unexpected::Str(&text), &"four hexadecimal digits"))
    }
}

/// What FFFFFFFFh, `nan`, or dashes mean in an entry that is measured (AXTC4CO manual, section 3.3.3).
const NO_READING: &str = "no reading";

/// What digits mean that may be decimal or hexadecimal.
const DOUBTFUL: &str = "not certain: hexadecimal?";

/// Why a text is not a dump.
#[derive(Debug, thiserror::Error)]
pub enum DumpError {
    /// It is not JSON, or not that of a dump.
    #[error("{name}:{}:{}: this is not a dump: {}", fault.line(), fault.column().max(1), without_place(fault))]
    Syntax {
        /// What it was read from.
        name: String,
        /// Where and what. It is in the message, so not a cause, which would be printed again after it.
        fault: serde_json::Error,
    },
    /// It is another kind of document.
    #[error("'{name}' has the schema '{found}', not '{SCHEMA}'")]
    Schema {
        /// What it was read from.
        name: String,
        /// The schema it names.
        found: String,
    },
}

impl Dump {
    /// What a unit showed, with what the manual says of it.
    pub fn of(reading: &DictionaryReading, product: Option<&Product>, facts: &Facts) -> Self {
        let node_id = facts.node_id.as_ref().map_or(127, |known| known.value);
        let entries = reading.entries.iter().map(|read| {
            let object = product.and_then(|product| product.dictionary.object(read.at.index));
            let entry = object.and_then(|object| object.entry(read.at.sub));
            let default = entry.and_then(|entry| entry.default).map(|default| default.on_node(node_id));
            DumpEntry {
                index: read.at.index,
                subindex: read.at.sub,
                name: object.zip(entry).map_or_else(String::new, |(object, entry)| name(object, entry)),
                value: read.value().and_then(number),
                text: visible::line(read.reading.as_ref().map_or(&read.text, |reading| &reading.numeral).as_bytes()),
                default: default.and_then(number),
                deviates: entry.is_some_and(|entry| deviates(read, entry, default)),
                unit: entry.and_then(|entry| entry.unit.clone()),
                // What could not be read may be anything.
                meaning: entry.zip(read.reading.as_ref()).and_then(|(entry, reading)| match reading.shown {
                    Shown::Value(value) => meaning(product?, read.at, entry, value),
                    Shown::Hexadecimal => Some(DOUBTFUL.to_owned()),
                    Shown::Nothing => (entry.data_type == DataType::Real32).then(|| NO_READING.to_owned()),
                }),
                doubtful: read.is_doubtful(),
                bits: entry.is_some_and(is_bits),
            }
        });
        let missing = product.into_iter().flat_map(|product| product.dictionary.entries()).filter_map(|(at, _, _)| {
            let there = reading.entries.iter().any(|read| read.at == at);
            (!there).then_some(Missing { index: at.index, subindex: at.sub })
        });
        Dump {
            schema: SCHEMA.to_owned(),
            product: facts.product.as_ref().map(|known| known.value.clone()),
            version: facts.version.as_ref().map(|known| known.value.to_string()),
            factory: false,
            complete: reading.is_complete(),
            unrecognised_lines: reading.unrecognised_lines,
            entries: entries.collect(),
            missing: missing.collect(),
        }
    }

    /// The factory's values as a dump.
    pub fn factory(product: &Product) -> Self {
        let entries = product.dictionary.entries().filter(|(_, _, entry)| entry.access == Access::ReadWrite);
        let entries = entries.filter_map(|(at, object, entry)| {
            let default = entry.default?.on_node(product.can.node_id);
            Some(DumpEntry {
                index: at.index,
                subindex: at.sub,
                name: name(object, entry),
                value: number(default),
                text: default.to_string(),
                default: number(default),
                deviates: false,
                unit: entry.unit.clone(),
                meaning: entry.meaning(default).map(str::to_owned),
                doubtful: false,
                bits: is_bits(entry),
            })
        });
        Dump {
            schema: SCHEMA.to_owned(),
            product: Some(product.name.clone()),
            version: None,
            factory: true,
            complete: true,
            unrecognised_lines: 0,
            entries: entries.collect(),
            missing: Vec::new(),
        }
    }

    /// Reads a dump back that [`Dump::json`] has written; `name` is for errors. Texts in it are made harmless: anybody
    /// may have edited the file.
    ///
    /// # Errors
    /// If it is not one.
    pub fn parse(name: &str, text: &str) -> Result<Self, DumpError> {
        let mut dump: Dump =
            serde_json::from_str(text).map_err(|fault| DumpError::Syntax { name: name.to_owned(), fault })?;
        if dump.schema != SCHEMA {
            let found = visible::line(dump.schema.as_bytes());
            return Err(DumpError::Schema { name: name.to_owned(), found });
        }
        let clean = |text: &mut String| *text = visible::line(text.as_bytes());
        [&mut dump.product, &mut dump.version].into_iter().flatten().for_each(clean);
        for entry in &mut dump.entries {
            [&mut entry.name, &mut entry.text].into_iter().for_each(clean);
            [&mut entry.unit, &mut entry.meaning].into_iter().flatten().for_each(clean);
        }
        if let Some(product) = dump.product.as_deref().and_then(Product::named) {
            for entry in &mut dump.entries {
                entry.bits = product.dictionary.entry(entry.at()).is_some_and(is_bits);
            }
        }
        Ok(dump)
    }

    /// All of it in one line of JSON.
    pub fn json(&self) -> String {
        // Strings, numbers and lists of them: there is nothing JSON could refuse.
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// The errors in the unit's list 1003h, the newest first, in words.
    pub fn errors(&self) -> impl Iterator<Item = &str> {
        let listed = |entry: &&DumpEntry| {
            entry.index == ERROR_FIELD
                && entry.subindex > 0
                && entry.value.as_ref().and_then(serde_json::Number::as_u64).is_some_and(|bits| bits != 0)
        };
        self.entries.iter().filter(listed).map(|entry| entry.meaning.as_deref().unwrap_or(&entry.text))
    }

    /// How many entries show a value that is not certain.
    pub fn doubtful(&self) -> usize {
        self.entries.iter().filter(|entry| entry.doubtful).count()
    }

    /// How many parameters are not what the factory made them.
    pub fn deviations(&self) -> usize {
        self.entries.iter().filter(|entry| entry.deviates).count()
    }
}

impl DumpEntry {
    /// Where it is.
    pub fn at(&self) -> ObjectAddress {
        ObjectAddress { index: self.index, sub: self.subindex }
    }

    /// The value as a number; `-` where there is none.
    pub fn number(&self) -> String {
        self.value.as_ref().map_or_else(|| "-".to_owned(), ToString::to_string)
    }

    /// The value for a person: bits in hexadecimal digits.
    pub fn shown(&self) -> String {
        self.person(self.value.as_ref())
    }

    /// The factory's value for a person; `-` where there is none.
    pub fn shown_default(&self) -> String {
        self.person(self.default.as_ref())
    }

    fn person(&self, value: Option<&serde_json::Number>) -> String {
        match value.map(|value| (value, value.as_u64())) {
            None => "-".to_owned(),
            Some((_, Some(bits))) if self.bits => hexadecimal(bits),
            Some((value, _)) => value.to_string(),
        }
    }
}

impl Missing {
    /// Where it is.
    pub fn at(&self) -> ObjectAddress {
        ObjectAddress { index: self.index, sub: self.subindex }
    }
}

/// What is wrong with a text, without the place that serde adds to it.
fn without_place(fault: &serde_json::Error) -> String {
    let text = fault.to_string();
    text.rfind(" at line ").map_or(text.as_str(), |end| &text[..end]).to_owned()
}

/// The entry's name with its object's, which tells sub-indices of the same name apart.
pub fn name(object: &Object, entry: &Entry) -> String {
    if object.entries.len() == 1 { object.name.clone() } else { format!("{}, {}", object.name, entry.name) }
}

/// A value of an entry for a person: bits in hexadecimal digits.
pub fn shown(entry: &Entry, value: Value) -> String {
    match value.as_integer() {
        Some(bits) if is_bits(entry) => hexadecimal(bits as u64),
        _ => value.to_string(),
    }
}

fn hexadecimal(bits: u64) -> String {
    format!("0x{bits:08X}")
}

/// What a value means; an error of the list 1003h in words.
fn meaning(product: &Product, at: ObjectAddress, entry: &Entry, value: Value) -> Option<String> {
    let error = value.as_integer().and_then(|bits| u32::try_from(bits).ok()).filter(|&bits| bits != 0);
    match (at.index, at.sub, error) {
        (ERROR_FIELD, 1.., Some(bits)) => Some(Emergency::from(bits).words(product)),
        _ => entry.meaning(value).map(str::to_owned),
    }
}

/// Whether an entry holds bits and not a number of something.
fn is_bits(entry: &Entry) -> bool {
    entry.data_type == DataType::Unsigned32 && entry.unit.is_none()
}

/// Whether a parameter is not what the factory made it. Measurements and what is a unit's own are not deviations.
fn deviates(read: &ReadEntry, entry: &Entry, default: Option<Value>) -> bool {
    let parameter = entry.access == Access::ReadWrite && !matches!(read.at.index, 0x1003 | 0x1010 | 0x1011);
    let differs = read.value().zip(default).is_some_and(|(value, default)| match (value, default) {
        (Value::Real32(value), Value::Real32(default)) => {
            let (value, default) = (f64::from(value), f64::from(default));
            (value - default).abs() > rounding(&read.text, value)
        }
        _ => value != default,
    });
    parameter && differs
}

/// How far a number may be from what a text shows of it: half a unit of the last digit that is printed, and no less than
/// a REAL32 leaves open.
fn rounding(text: &str, value: f64) -> f64 {
    let least = value.abs() * f64::from(f32::EPSILON);
    let numerals = text.split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)));
    let shown = numerals.filter(|numeral| numeral.parse::<f64>().is_ok_and(|shown| (shown - value).abs() <= least));
    // Where several look like it, the one with the fewest digits says least.
    shown.map(half_a_unit).fold(least, f64::max)
}

/// Half a unit of a numeral's last digit.
fn half_a_unit(numeral: &str) -> f64 {
    let (mantissa, exponent) = numeral.split_once(['e', 'E']).unwrap_or((numeral, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len()) as i32;
    0.5 * 10f64.powi(exponent.parse::<i32>().unwrap_or(0).saturating_sub(decimals).clamp(-40, 40))
}

fn number(value: Value) -> Option<serde_json::Number> {
    match (value, value.as_integer()) {
        // The shortest decimal that is this value: 0.1, not 0.10000000149.
        (Value::Real32(real), _) => serde_json::Number::from_f64(real.to_string().parse().ok()?),
        (_, integer) => integer.map(serde_json::Number::from),
    }
}

/// The reading as a device configuration file (DCF) for this product, read at this moment since 1970.
pub fn configuration(reading: &DictionaryReading, product: &Product, facts: &Facts, unix_millis: i64) -> String {
    let values = reading.entries.iter().filter_map(|read| Some((read.at, read.value()?))).collect::<BTreeMap<_, _>>();
    let configuration = eds::Configuration {
        node_id: facts.node_id.as_ref().map_or(product.can.node_id, |known| known.value),
        kbps: facts.can_kbps.as_ref().map_or(product.can.kbps, |known| known.value),
        unix_millis,
        values,
    };
    eds::write_configuration(product, &configuration)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::WalkEnd;
    use crate::wire::dictionary::Reading;

    #[test]
    fn what_is_measured_and_shown_as_nothing_is_no_reading() {
        let product = Product::named("AXTC4CO").expect("built in");
        let facts = Facts::default();
        let at = ObjectAddress::new(0x6100, 1);
        let dump = |text: &str, reading: Option<(Shown, &str)>| {
            let reading = reading.map(|(shown, numeral)| Reading { shown, numeral: numeral.into(), plain: false });
            let entries = vec![ReadEntry { at, text: text.into(), span: Default::default(), reading }];
            Dump::of(&DictionaryReading { entries, end: WalkEnd::Whole, unrecognised_lines: 0 }, Some(product), &facts)
        };
        let nothing = dump("TC1 0xFFFFFFFF", Some((Shown::Nothing, "0xFFFFFFFF")));
        let something = dump("TC1 23.5", Some((Shown::Value(Value::Real32(23.5)), "23.5")));
        assert_eq!(nothing.entries[0].meaning.as_deref(), Some("no reading"));
        assert!(nothing.table().contains(" -  no reading\n"), "{}", nothing.table());
        assert_eq!(nothing.entries[0].text, "0xFFFFFFFF", "without what the line calls it");
        let doubtful = dump("TC1 41E80000", Some((Shown::Hexadecimal, "41E80000")));
        assert_eq!((doubtful.doubtful(), doubtful.entries[0].meaning.as_deref()), (1, Some(DOUBTFUL)));
        assert_eq!(Dump::parse("d.json", &doubtful.json()).expect("a dump"), doubtful);
        assert_eq!((nothing.doubtful(), something.doubtful()), (0, 0));
        let unread = dump("TC1: 23,500", None);
        assert_eq!((unread.entries[0].meaning.as_deref(), unread.entries[0].text.as_str()), (None, "TC1: 23,500"));
        assert_eq!(something.entries[0].meaning, None);
        assert!(something.table().contains("23.5 °C"), "{}", something.table());
    }

    #[test]
    fn a_dump_that_somebody_has_edited_says_nothing_to_the_terminal() {
        let product = Product::named("AXTC4CO").expect("built in");
        let mut dump = Dump::factory(product);
        assert_eq!(Dump::parse("d.json", &dump.json()).expect("a dump"), dump);
        dump.version = Some("1\u{9b}J".into());
        dump.entries[0].name = "\u{1b}[2Jname".into();
        dump.entries[0].text = "\n".into();
        dump.entries[0].unit = Some("\t".into());
        dump.entries[0].meaning = Some("\u{202e}on".into());
        let read = Dump::parse("d.json", &dump.json()).expect("a dump");
        let entry = &read.entries[0];
        assert_eq!((entry.name.as_str(), entry.text.as_str()), ("^[[2Jname", "^J"));
        assert_eq!((entry.unit.as_deref(), entry.meaning.as_deref()), (Some("^I"), Some("‹202e›on")));
        assert_eq!(read.version.as_deref(), Some("1‹9b›J"));
        assert!(!read.table().chars().any(|c| c.is_control() && c != '\n'));
    }

    #[test]
    fn an_index_is_four_hexadecimal_digits_in_any_case_and_nothing_else() {
        let mut dump = Dump::factory(Product::named("AXTC4CO").expect("built in"));
        dump.entries.retain(|entry| entry.index == 0x100C);
        dump.missing.push(Missing { index: 0x6A, subindex: 1 });
        let text = dump.json();
        assert!(text.contains(r#""index":"100C""#) && text.contains(r#""index":"006A""#), "{text}");
        assert_eq!(Dump::parse("d.json", &text.replace("100C", "100c")).expect("a dump"), dump);
        for wrong in ["1O0C", "100", "+00C", "0100C", "", "10\\r\\u009b"] {
            let error = Dump::parse("d.json", &text.replace("100C", wrong)).expect_err(wrong).to_string();
            assert!(error.starts_with("d.json:1:") && error.contains("four hexadecimal digits"), "{error}");
            assert!(!error.contains(char::is_control), "{error:?}");
        }
    }

    #[test]
    fn a_dump_of_an_earlier_version_is_read() {
        let mut dump = Dump::factory(Product::named("AXTC4CO").expect("built in"));
        dump.factory = false;
        let text = dump.json().replace(r#","doubtful":false"#, "");
        assert!(!text.contains("doubtful"));
        assert_eq!(Dump::parse("d.json", &text).expect("a dump"), dump);
    }
}
