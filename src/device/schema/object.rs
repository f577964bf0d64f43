//! Objects of the dictionary as a product's file writes them.
//!
//! What an object says holds for every entry that does not say otherwise. What it says of values (limits, defaults, unit,
//! meanings) is only for entries of its own type.

use serde::Deserialize;
use toml::{Spanned, Value as Toml};

use super::Reader;
use crate::canopen::{DataType, ObjectAddress, Value};
use crate::device::HIGHEST_NODE_ID;
use crate::device::dictionary::{Access, Bound, Dictionary, Entry, FactoryValue, Limits, Meaning, Object, ObjectKind};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawObject {
    pub(super) index: Spanned<u16>,
    name: String,
    section: Spanned<String>,
    #[serde(default)]
    kind: RawKind,
    #[serde(rename = "type")]
    data_type: DataType,
    #[serde(default)]
    access: RawAccess,
    #[serde(default)]
    pdo: bool,
    limits: Option<Vec<Toml>>,
    values: Option<Vec<Toml>>,
    unit: Option<String>,
    default: Option<Toml>,
    description: Option<String>,
    #[serde(default)]
    meanings: toml::Table,
    #[serde(default)]
    entries: Vec<Spanned<Toml>>,
}

/// An entry that says something of its own.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEntry {
    sub: Option<u8>,
    name: String,
    #[serde(rename = "type")]
    data_type: Option<DataType>,
    access: Option<RawAccess>,
    limits: Option<Vec<Toml>>,
    values: Option<Vec<Toml>>,
    unit: Option<String>,
    default: Option<Toml>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawKind {
    #[default]
    Var,
    Array,
    Record,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawAccess {
    #[default]
    Ro,
    Rw,
}

/// Name of the implied entry at sub-index 0.
const COUNT_NAME: &str = "Number of entries";

impl Reader<'_> {
    pub(super) fn object(&mut self, mut raw: RawObject) -> Object {
        let index = *raw.index.get_ref();
        let start = raw.index.span().start;
        let key = format!("object {index:04X}h");
        if raw.section.get_ref().is_empty() {
            self.complain(raw.section.span().start, format!("{key}, section"), "there is none");
        }
        let kind = match raw.kind {
            RawKind::Var => ObjectKind::Var,
            RawKind::Array => ObjectKind::Array,
            RawKind::Record => ObjectKind::Record,
        };
        let own = std::mem::take(&mut raw.entries);
        let entries = if kind == ObjectKind::Var {
            if let Some(entry) = own.first() {
                self.complain(entry.span().start, format!("{key}, entries"), "a variable has none");
            }
            vec![self.entry(&key, start, 0, RawEntry::named(raw.name.clone()), &raw)]
        } else {
            if own.is_empty() {
                self.complain(start, format!("{key}, entries"), "there are none");
            }
            self.entries(&key, kind, own, &raw)
        };
        Object { index, name: raw.name, kind, section: raw.section.into_inner(), entries }
    }

    /// The entries of an array or record, that which counts them included.
    fn entries(&mut self, key: &str, kind: ObjectKind, raw: Vec<Spanned<Toml>>, object: &RawObject) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        let mut next = 1u8;
        for raw in raw {
            let at = raw.span().start;
            let Some(entry) = self.raw_entry(key, at, raw.into_inner()) else { continue };
            let sub = entry.sub.unwrap_or(next);
            let own_type = entry.data_type.is_some_and(|own| own != object.data_type);
            if own_type && kind == ObjectKind::Array && sub > 0 {
                let message = "an entry of an array has the array's type; a record may mix them";
                self.complain(at, format!("{key}, entry {sub}, type"), message);
            }
            if entries.iter().any(|before| before.sub == sub) || sub > next {
                let message = format!("{sub} does not follow: the next sub-index is {next}");
                self.complain(at, format!("{key}, entry {sub}"), message);
            }
            next = next.max(sub.saturating_add(1));
            entries.push(self.entry(&format!("{key}, entry {sub}"), at, sub, entry, object));
        }
        if !entries.iter().any(|entry| entry.sub == 0) {
            entries.push(count_entry(next - 1));
        }
        entries.sort_by_key(|entry| entry.sub);
        entries
    }

    fn raw_entry(&mut self, key: &str, at: usize, raw: Toml) -> Option<RawEntry> {
        match raw {
            Toml::String(name) => Some(RawEntry::named(name)),
            Toml::Table(table) => match table.try_into() {
                Ok(entry) => Some(entry),
                Err(error) => {
                    self.complain(at, format!("{key}, entries"), error.message().trim_end().replace('\n', "; "));
                    None
                }
            },
            other => {
                let message = format!("{} is neither a name nor a table of an entry's own properties", shown(&other));
                self.complain(at, format!("{key}, entries"), message);
                None
            }
        }
    }

    fn entry(&mut self, key: &str, at: usize, sub: u8, raw: RawEntry, object: &RawObject) -> Entry {
        let data_type = raw.data_type.unwrap_or(object.data_type);
        // Another type has other values: what the object says of them is not meant for this entry.
        let alike = data_type == object.data_type;
        let shared =
            |own: Option<Vec<Toml>>, of_object: &Option<Vec<Toml>>| own.or(of_object.clone().filter(|_| alike));
        let access = match raw.access.unwrap_or(object.access) {
            RawAccess::Ro => Access::ReadOnly,
            RawAccess::Rw => Access::ReadWrite,
        };
        let limits = self.limits(
            key,
            at,
            sub,
            data_type,
            shared(raw.limits, &object.limits),
            shared(raw.values, &object.values).unwrap_or_default(),
        );
        let own_default = raw.default.is_some();
        let default = raw.default.or(object.default.clone()).and_then(|default| {
            self.default(&format!("{key}, default"), at, data_type, &default, alike || own_default)
        });
        if let Some(default) = default
            && !default.plus_node_id
            && !limits.admit_alone(default.value)
        {
            self.complain(at, format!("{key}, default"), format!("{} is not within the limits", default.value));
        }
        let meanings = if alike { self.meanings(key, at, data_type, &object.meanings) } else { Vec::new() };
        Entry {
            sub,
            name: raw.name,
            data_type,
            access,
            mappable: object.pdo && alike,
            default,
            limits,
            unit: raw.unit.or(object.unit.clone().filter(|_| alike)),
            meanings,
            description: object.description.clone(),
        }
    }

    fn limits(
        &mut self,
        key: &str,
        at: usize,
        sub: u8,
        data_type: DataType,
        range: Option<Vec<Toml>>,
        values: Vec<Toml>,
    ) -> Limits {
        let mut limits = Limits::default();
        if let Some(range) = range {
            let key = format!("{key}, limits");
            if let [low, high] = range.as_slice() {
                limits.low = self.bound(&key, at, sub, data_type, low);
                limits.high = self.bound(&key, at, sub, data_type, high);
                if let (Some(Bound::Value(low)), Some(Bound::Value(high))) = (limits.low, limits.high)
                    && low.as_f64() > high.as_f64()
                {
                    self.complain(at, key, format!("{low} to {high} is not a range"));
                }
            } else {
                self.complain(at, key, format!("{} values are not the lowest and the highest", range.len()));
            }
        }
        for value in values {
            limits.values.extend(self.value(&format!("{key}, values"), at, data_type, &value));
        }
        limits
    }

    fn bound(&mut self, key: &str, at: usize, sub: u8, data_type: DataType, raw: &Toml) -> Option<Bound> {
        let Toml::String(text) = raw else {
            return self.value(key, at, data_type, raw).map(Bound::Value);
        };
        let parsed = dependent(text, sub);
        if parsed.is_none() {
            let message = format!("'{text}' is not a bound: write a number, or another entry like \"4010:n - 100\"");
            self.complain(at, key, message);
        }
        parsed
    }

    fn default(&mut self, key: &str, at: usize, data_type: DataType, raw: &Toml, fits: bool) -> Option<FactoryValue> {
        if let Toml::String(text) = raw {
            return match base_of_cob_id(text).filter(|_| data_type == DataType::Unsigned32) {
                Some(base) => Some(FactoryValue { value: Value::Unsigned32(base), plus_node_id: true }),
                None => {
                    let message = format!(
                        "'{text}' is not a default: write a number, or for an UNSIGNED32 \"$NODEID + 0x40000180\""
                    );
                    self.complain(at, key, message);
                    None
                }
            };
        }
        // The object's default may be meant for its other entries only.
        if !fits && to_value(data_type, raw).is_none() {
            return None;
        }
        self.value(key, at, data_type, raw).map(|value| FactoryValue { value, plus_node_id: false })
    }

    fn meanings(&mut self, key: &str, at: usize, data_type: DataType, raw: &toml::Table) -> Vec<Meaning> {
        let mut meanings = Vec::new();
        for (number, text) in raw {
            let value = number.parse().ok().and_then(|number| data_type.integer(number));
            match (value, text) {
                (Some(value), Toml::String(text)) => meanings.push(Meaning { value, text: text.clone() }),
                (None, _) => {
                    let message = format!("'{number}' is not a value of an {}", data_type.name());
                    self.complain(at, format!("{key}, meanings"), message);
                }
                (Some(_), other) => {
                    self.complain(at, format!("{key}, meanings"), format!("{} is not a text", shown(other)));
                }
            }
        }
        meanings.sort_by_key(|meaning| meaning.value.as_integer());
        meanings
    }

    fn value(&mut self, key: &str, at: usize, data_type: DataType, raw: &Toml) -> Option<Value> {
        let value = to_value(data_type, raw);
        if value.is_none() {
            let allowed = match (data_type, data_type.range()) {
                (DataType::Boolean, _) => "true or false".to_owned(),
                (_, Some((low, high))) => format!("a whole number from {low} to {high}"),
                (_, None) => "a number".to_owned(),
            };
            self.complain(at, key, format!("{} is not {allowed} ({})", shown(raw), data_type.name()));
        }
        value
    }

    /// Bounds on other entries lead to entries that can be compared.
    pub(super) fn check_bounds(&mut self, dictionary: &Dictionary, object: &Object, at: usize) {
        for entry in &object.entries {
            for bound in [entry.limits.low, entry.limits.high].into_iter().flatten() {
                let Bound::Entry { at: other, .. } = bound else { continue };
                let comparable = dictionary.entry(other).is_some_and(|other| other.data_type == entry.data_type);
                if !comparable {
                    let key = format!("object {:04X}h, entry {}, limits", object.index, entry.sub);
                    self.complain(at, key, format!("there is no entry {other} of type {}", entry.data_type.name()));
                }
            }
        }
    }
}

impl RawEntry {
    fn named(name: String) -> Self {
        RawEntry { name, ..RawEntry::default() }
    }
}

/// The implied entry that counts the others.
fn count_entry(count: u8) -> Entry {
    Entry {
        sub: 0,
        name: COUNT_NAME.to_owned(),
        data_type: DataType::Unsigned8,
        access: Access::ReadOnly,
        mappable: false,
        default: Some(FactoryValue { value: Value::Unsigned8(count), plus_node_id: false }),
        limits: Limits::default(),
        unit: None,
        meanings: Vec::new(),
        description: None,
    }
}

/// `$NODEID + 0x40000180`: the number a node-ID is added to. It has room for the largest one.
fn base_of_cob_id(text: &str) -> Option<u32> {
    let digits = text.strip_prefix("$NODEID")?.trim().strip_prefix('+')?.trim().strip_prefix("0x")?;
    let plain = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let base = plain.then(|| u32::from_str_radix(digits, 16).ok()).flatten()?;
    base.checked_add(u32::from(HIGHEST_NODE_ID)).map(|_| base)
}

/// `4010:n - 100`: the entry of 4010h with sub-index `sub`, less 100.
fn dependent(text: &str, sub: u8) -> Option<Bound> {
    let (address, offset) = match text.find(['+', '-']) {
        Some(at) => {
            let digits = text[at + 1..].trim();
            // One sign is enough: the parser would take another.
            let offset: i64 = digits.parse().ok().filter(|_| !digits.starts_with(['+', '-']))?;
            (&text[..at], if text[at..].starts_with('-') { -offset } else { offset })
        }
        None => (text, 0),
    };
    let index = address.trim().strip_suffix(":n")?;
    let index: ObjectAddress = index.parse().ok()?;
    Some(Bound::Entry { at: ObjectAddress::new(index.index, sub), offset })
}

fn to_value(data_type: DataType, raw: &Toml) -> Option<Value> {
    match (data_type, raw) {
        (DataType::Boolean, Toml::Boolean(value)) => Some(Value::Boolean(*value)),
        (DataType::Real32, Toml::Float(value)) if (*value as f32).is_finite() => Some(Value::Real32(*value as f32)),
        (DataType::Boolean, _) => None,
        (_, Toml::Integer(value)) => data_type.integer(*value),
        _ => None,
    }
}

/// A value as it is written, or what it is.
fn shown(raw: &Toml) -> String {
    match raw {
        Toml::String(text) => format!("\"{text}\""),
        Toml::Integer(number) => number.to_string(),
        Toml::Float(number) => number.to_string(),
        Toml::Boolean(value) => value.to_string(),
        other => format!("a value of type {}", other.type_str()),
    }
}
