//! The format of a product's file, and what makes one sound.
//!
//! A file is TOML. What serde refuses (a key that does not exist, a number that is none) ends the reading with one
//! complaint; everything that can be read is then checked as a whole, and every fault is reported, each with file, line,
//! column, key, what was found and what is allowed.

use serde::Deserialize;
use toml::{Spanned, Value as Toml};

use super::complaint::{Complaint, Complaints};
use super::dictionary::{Access, Bound, Dictionary, Entry, FactoryValue, Limits, Meaning, Object, ObjectKind};
use super::{BIT_RATES_KBPS, BootFlash, Cable, Can, Console, Loader, Measurement, Product};
use crate::canopen::{DataType, ObjectAddress, Value};
use crate::image::FlashMap;
use crate::image::identity::LONGEST_NAME;
use crate::wire::stream;

/// A file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawProduct {
    name: Spanned<String>,
    title: String,
    manual: String,
    can: Spanned<Can>,
    cable: Cable,
    console: Console,
    stream: Spanned<stream::Layout>,
    measurement: Spanned<Measurement>,
    flash: Spanned<FlashMap>,
    boot_flash: Spanned<BootFlash>,
    loader: Spanned<Loader>,
    #[serde(default)]
    object: Vec<Spanned<RawObject>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject {
    index: Spanned<u16>,
    name: String,
    section: Spanned<String>,
    #[serde(default)]
    kind: RawKind,
    #[serde(rename = "type")]
    data_type: DataType,
    access: Option<RawAccess>,
    #[serde(default)]
    pdo: bool,
    limits: Option<Spanned<Vec<Toml>>>,
    values: Option<Spanned<Vec<Toml>>>,
    unit: Option<String>,
    default: Option<Spanned<Toml>>,
    description: Option<String>,
    meanings: Option<Spanned<toml::Table>>,
    #[serde(default)]
    entries: Vec<Spanned<Toml>>,
}

/// An entry that says something of its own.
#[derive(Deserialize)]
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

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawAccess {
    Ro,
    Rw,
}

/// Channels of a row at most, and characters of one of its fields: more than any product of this kind has, and so few
/// that a row stays a line.
const MOST_CHANNELS: usize = 64;
const WIDEST_FIELD: usize = 40;
/// Words of program flash at most: an emulated unit has all of it in memory. The largest product has 262,144.
const MOST_WORDS: u32 = 1 << 22;

/// Name of the implied entry at sub-index 0.
const COUNT_NAME: &str = "Number of entries";

/// Reads a product's file.
///
/// # Errors
/// If it is no TOML or no product's file, with one complaint; otherwise with everything that is wrong with it.
pub fn read(file: &str, text: &str) -> Result<Product, Vec<Complaint>> {
    let complaints = Complaints::about(file, text);
    let raw: RawProduct = match toml::from_str(text) {
        Ok(raw) => raw,
        Err(error) => return Err(complaints.ended_by(&error)),
    };
    let mut reader = Reader { complaints };
    let product = reader.product(raw);
    reader.complaints.or(product)
}

struct Reader<'a> {
    complaints: Complaints<'a>,
}

impl Reader<'_> {
    fn complain(&mut self, at: usize, key: impl Into<String>, message: impl Into<String>) {
        self.complaints.add(at, key, message);
    }

    fn product(&mut self, raw: RawProduct) -> Product {
        self.check_name(&raw.name);
        self.check_can(&raw.can);
        self.check_stream(&raw.stream);
        self.check_measurement(&raw.measurement);
        self.check_flash(&raw.flash);
        self.check_boot_flash(&raw.boot_flash, raw.flash.get_ref());
        let loader = raw.loader.get_ref();
        if !loader.file_name.contains("{version}") {
            let message = format!("'{}' has no {{version}} in it", loader.file_name);
            self.complain(raw.loader.span().start, "loader.file_name", message);
        }
        let mut objects: Vec<(usize, Object)> = Vec::new();
        for raw in raw.object {
            let start = raw.get_ref().index.span().start;
            let object = self.object(raw.into_inner());
            if objects.iter().any(|(_, before)| before.index == object.index) {
                self.complain(start, "object.index", format!("{:04X}h is there already", object.index));
            }
            objects.push((start, object));
        }
        let dictionary = Dictionary::new(objects.iter().map(|(_, object)| object.clone()).collect());
        for (start, object) in &objects {
            self.check_bounds(&dictionary, object, *start);
        }
        Product {
            name: raw.name.into_inner(),
            title: raw.title,
            manual: raw.manual,
            can: raw.can.into_inner(),
            cable: raw.cable,
            console: raw.console,
            stream: raw.stream.into_inner(),
            measurement: raw.measurement.into_inner(),
            flash: raw.flash.into_inner(),
            boot_flash: raw.boot_flash.into_inner(),
            loader: raw.loader.into_inner(),
            dictionary,
        }
    }

    fn check_name(&mut self, name: &Spanned<String>) {
        let plain = !name.get_ref().is_empty() && name.get_ref().bytes().all(|byte| byte.is_ascii_alphanumeric());
        if !plain || name.get_ref().len() > LONGEST_NAME {
            let message =
                format!("'{}' is not 1 to {LONGEST_NAME} letters and digits, as an identity block has", name.get_ref());
            self.complain(name.span().start, "name", message);
        }
    }

    fn check_can(&mut self, can: &Spanned<Can>) {
        let Can { node_id, kbps, .. } = *can.get_ref();
        if !(1..=127).contains(&node_id) {
            self.complain(can.span().start, "can.node_id", format!("{node_id} is not 1 to 127"));
        }
        if !BIT_RATES_KBPS.contains(&kbps) {
            let allowed = BIT_RATES_KBPS.map(|rate| rate.to_string()).join(", ");
            self.complain(can.span().start, "can.kbps", format!("{kbps} is none of {allowed}"));
        }
    }

    fn check_stream(&mut self, layout: &Spanned<stream::Layout>) {
        let at = layout.span().start;
        let layout = layout.get_ref();
        if layout.channels.is_empty() {
            self.complain(at, "stream.channels", "there is no channel");
        }
        if layout.channels.len() > MOST_CHANNELS {
            let message = format!("{} are more than {MOST_CHANNELS}", layout.channels.len());
            self.complain(at, "stream.channels", message);
        }
        for (name, format) in [("field_value", &layout.field_value), ("process_value", &layout.process_value)] {
            let key = format!("stream.{name}");
            let Some(&width) = format.widths.first() else {
                self.complain(at, format!("{key}.widths"), "there is no width");
                continue;
            };
            if let Some(wrong) = format.widths.iter().find(|width| !(1..=WIDEST_FIELD).contains(*width)) {
                let message = format!("{wrong} is not a width of 1 to {WIDEST_FIELD} characters");
                self.complain(at, format!("{key}.widths"), message);
            }
            // Before the point stands a digit at least.
            if format.decimals > 0 && format.decimals.saturating_add(2) > width {
                let message = format!("{} digits behind the point do not fit into {width} characters", format.decimals);
                self.complain(at, format!("{key}.decimals"), message);
            }
            let words = [Some(&format.disabled), Some(&format.open), format.short.as_ref(), format.error.as_ref()];
            for word in words.into_iter().flatten() {
                if word.is_empty() || word.len() > width {
                    self.complain(at, key.clone(), format!("'{word}' is not a word of 1 to {width} characters"));
                }
            }
        }
    }

    fn check_measurement(&mut self, measurement: &Spanned<Measurement>) {
        let at = measurement.span().start;
        let Measurement { channels, stream_period_ms: (shortest, longest), .. } = *measurement.get_ref();
        if channels == 0 {
            self.complain(at, "measurement.channels", "there is no channel");
        }
        if shortest == 0 || shortest > longest {
            let message = format!("from {shortest} to {longest} is no range of times");
            self.complain(at, "measurement.stream_period_ms", message);
        }
    }

    fn check_flash(&mut self, flash: &Spanned<FlashMap>) {
        let FlashMap { program_words, page_words, .. } = *flash.get_ref();
        if page_words == 0 || program_words == 0 || !program_words.is_multiple_of(page_words) {
            let message = format!("{program_words} words are no whole number of pages of {page_words}");
            self.complain(flash.span().start, "flash.program_words", message);
        }
        if program_words > MOST_WORDS {
            let message = format!("{program_words} words are more than {MOST_WORDS}");
            self.complain(flash.span().start, "flash.program_words", message);
        }
    }

    fn check_boot_flash(&mut self, boot: &Spanned<BootFlash>, flash: &FlashMap) {
        let BootFlash { start, words } = *boot.get_ref();
        if words == 0 || u64::from(start) < flash.end() || start.checked_add(words).is_none() {
            let message = format!("{words} words at {start:#x} do not lie behind the program flash");
            self.complain(boot.span().start, "boot_flash", message);
        }
    }

    fn object(&mut self, raw: RawObject) -> Object {
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
        // What the object says, every entry says that says nothing else.
        let common = Common {
            data_type: raw.data_type,
            access: raw.access.unwrap_or(RawAccess::Ro),
            pdo: raw.pdo,
            limits: raw.limits.as_ref().map(|limits| limits.get_ref().clone()),
            values: raw.values.as_ref().map(|values| values.get_ref().clone()),
            unit: raw.unit,
            default: raw.default.map(Spanned::into_inner),
            description: raw.description,
            meanings: raw.meanings.map(Spanned::into_inner).unwrap_or_default(),
        };
        let mut entries: Vec<Entry> = Vec::new();
        if kind == ObjectKind::Var {
            if let Some(entry) = raw.entries.first() {
                self.complain(entry.span().start, format!("{key}, entries"), "a variable has none");
            }
            let entry = RawEntry::named(raw.name.clone());
            entries.push(self.entry(&key, start, 0, entry, &common));
        } else {
            if raw.entries.is_empty() {
                self.complain(start, format!("{key}, entries"), "there are none");
            }
            let mut next = 1u8;
            for raw in raw.entries {
                let at = raw.span().start;
                let Some(entry) = self.raw_entry(&key, at, raw.into_inner()) else { continue };
                let sub = entry.sub.unwrap_or(next);
                let own_type = entry.data_type.is_some_and(|own| own != common.data_type);
                if own_type && kind == ObjectKind::Array && sub > 0 {
                    let message = "an entry of an array has the array's type; a record may mix them";
                    self.complain(at, format!("{key}, entry {sub}, type"), message);
                }
                if entries.iter().any(|before| before.sub == sub) || sub > next {
                    let message = format!("{sub} does not follow: the next sub-index is {next}");
                    self.complain(at, format!("{key}, entry {sub}"), message);
                }
                next = next.max(sub.saturating_add(1));
                let entry = self.entry(&format!("{key}, entry {sub}"), at, sub, entry, &common);
                entries.push(entry);
            }
            if !entries.iter().any(|entry| entry.sub == 0) {
                entries.push(count_entry(next - 1));
            }
            entries.sort_by_key(|entry| entry.sub);
        }
        Object { index, name: raw.name, kind, section: raw.section.into_inner(), entries }
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

    fn entry(&mut self, key: &str, at: usize, sub: u8, raw: RawEntry, common: &Common) -> Entry {
        let data_type = raw.data_type.unwrap_or(common.data_type);
        // Another type has other values: what the object says of them is not meant for this entry.
        let alike = data_type == common.data_type;
        let shared = |own: Option<Vec<Toml>>, object: &Option<Vec<Toml>>| own.or(object.clone().filter(|_| alike));
        let access = match raw.access.unwrap_or(common.access) {
            RawAccess::Ro => Access::ReadOnly,
            RawAccess::Rw => Access::ReadWrite,
        };
        let limits = self.limits(
            key,
            at,
            sub,
            data_type,
            shared(raw.limits, &common.limits),
            shared(raw.values, &common.values).unwrap_or_default(),
        );
        let own_default = raw.default.is_some();
        let default = raw.default.or(common.default.clone()).and_then(|default| {
            self.default(&format!("{key}, default"), at, data_type, &default, alike || own_default)
        });
        if let Some(default) = default
            && !default.plus_node_id
            && !limits.admit_alone(default.value)
        {
            self.complain(at, format!("{key}, default"), format!("{} is not within the limits", default.value));
        }
        let meanings = if alike { self.meanings(key, at, data_type, &common.meanings) } else { Vec::new() };
        Entry {
            sub,
            name: raw.name,
            data_type,
            access,
            mappable: common.pdo && alike,
            default,
            limits,
            unit: raw.unit.or(common.unit.clone().filter(|_| alike)),
            meanings,
            description: common.description.clone(),
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
                    self.complain(at, key, format!("{low} to {high} is no range"));
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
            let message = format!("'{text}' is no bound: write a number, or another entry like \"4010:n - 100\"");
            self.complain(at, key, message);
        }
        parsed
    }

    fn default(&mut self, key: &str, at: usize, data_type: DataType, raw: &Toml, fits: bool) -> Option<FactoryValue> {
        if let Toml::String(text) = raw {
            let base = text.strip_prefix("$NODEID").map(str::trim).and_then(|rest| rest.strip_prefix('+'));
            let base = base.and_then(|digits| digits.trim().strip_prefix("0x"));
            let base = base.and_then(|digits| u32::from_str_radix(digits, 16).ok());
            return match base.filter(|_| data_type == DataType::Unsigned32) {
                Some(base) => Some(FactoryValue { value: Value::Unsigned32(base), plus_node_id: true }),
                None => {
                    let message = format!(
                        "'{text}' is no default: write a number, or for an UNSIGNED32 \"$NODEID + 0x40000180\""
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
                    let message = format!("'{number}' is no value of an {}", data_type.name());
                    self.complain(at, format!("{key}, meanings"), message);
                }
                (Some(_), other) => {
                    self.complain(at, format!("{key}, meanings"), format!("{} is no text", shown(other)));
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
    fn check_bounds(&mut self, dictionary: &Dictionary, object: &Object, at: usize) {
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

/// What an object says for all its entries.
struct Common {
    data_type: DataType,
    access: RawAccess,
    pdo: bool,
    limits: Option<Vec<Toml>>,
    values: Option<Vec<Toml>>,
    unit: Option<String>,
    default: Option<Toml>,
    description: Option<String>,
    meanings: toml::Table,
}

impl RawEntry {
    fn named(name: String) -> Self {
        RawEntry {
            sub: None,
            name,
            data_type: None,
            access: None,
            limits: None,
            values: None,
            unit: None,
            default: None,
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = include_str!("axtc4co.toml");

    /// The complaints about the shipped file with one text in it replaced.
    fn complaints(from: &str, to: &str) -> Vec<String> {
        assert_eq!(GOOD.matches(from).count(), 1, "{from:?}");
        let complaints = read("unit.toml", &GOOD.replace(from, to)).expect_err(to);
        complaints.iter().map(Complaint::to_string).collect()
    }

    #[test]
    fn each_fault_is_named_with_its_place_its_key_and_what_is_allowed() {
        let threshold = "limits = [-2730, \"4010:n - 100\"]";
        let table = [
            ("node_id = 127 ", "node_id = 128 ", "can.node_id: 128 is not 1 to 127"),
            ("kbps = 125 ", "kbps = 115 ", "can.kbps: 115 is none of 10, 20, 50, 125, 250, 500, 800, 1000"),
            ("name = \"AXTC4CO\"", "name = \"AX TC4\"", "name: 'AX TC4' is not 1 to 12 letters and digits"),
            ("page_words = 256", "page_words = 255", "65536 words are no whole number of pages of 255"),
            ("start = 0x20000", "start = 0x2000", "boot_flash: 4096 words at 0x2000 do not lie behind"),
            ("_V{version}", "_V", "loader.file_name: 'AXTC4CO_V.elf.S' has no {version} in it"),
            ("widths = [8]", "widths = [0]", "stream.field_value.widths: 0 is not a width of 1 to 40 characters"),
            ("widths = [8]", "widths = [8, 4000000000]", "stream.field_value.widths: 4000000000 is not a width"),
            ("decimals = 3", "decimals = 7", "field_value.decimals: 7 digits behind the point do not fit into 8"),
            ("decimals = 3", "decimals = 9223372036854775807", "do not fit into 8 characters"),
            ("program_words = 0x10000", "program_words = 4294967040", "4294967040 words are more than 4194304"),
            ("open = \"OpenCct\"", "open = \"OpenCircuit\"", "stream.field_value: 'OpenCircuit' is not a word"),
            ("[1, 60000]", "[100, 10]", "measurement.stream_period_ms: from 100 to 10 is no range"),
            ("index = 0x5010", "index = 0x5000", "object.index: 5000h is there already"),
            ("values = [1, 2, 7]", "values = [1, 70000]", "object 6110h, entry 1, values: 70000 is not a whole number"),
            ("values = [50, 60]", "values = [50, 61]", "object 5010h, default: 60 is not within the limits"),
            (threshold, "limits = [-2730, \"4011:n - 100\"]", "4000h, entry 1, limits: there is no entry 4011:01"),
            (threshold, "limits = [-2730, \"4010 less 100\"]", "limits: '4010 less 100' is no bound: write a number"),
            (threshold, "limits = [-2730, \"4010:n --9223372036854775808\"]", "is no bound: write a number"),
            (threshold, "limits = [-2730, \"4010:n + -100\"]", "limits: '4010:n + -100' is no bound"),
            (threshold, "limits = [-2730]", "limits: 1 values are not the lowest and the highest"),
            (threshold, "limits = [-100, -200]", "limits: -100 to -200 is no range"),
            ("\"$NODEID + 0x40000180\"", "\"$NODE + 1\"", "object 1800h, entry 1, default: '$NODE + 1' is no default"),
            (
                "default = 200000",
                "default = 1.5",
                "object 6114h, entry 1, default: 1.5 is not a whole number from 0 to",
            ),
            ("\"7\" = \"type T\"", "\"T\" = \"type T\"", "meanings: 'T' is no value of an UNSIGNED16"),
            ("section = \"3.4.17\"", "section = \"\"", "object 5010h, section: there is none"),
            (
                "entries = [\"Configuration Date\", \"Configuration Time\"]",
                "entries = []",
                "1020h, entries: there are none",
            ),
            ("{ sub = 0, name = \"Number of errors\"", "{ sub = 5, name = \"Number of errors\"", "5 does not follow"),
            ("sensors = \"thermocouple\"", "sensors = \"hygrometer\"", "unknown variant `hygrometer`, expected"),
            ("title = ", "titel = ", "unknown field `titel`, expected one of `name`, `title`"),
            ("index = 0x1017", "index = 0x11017", "invalid value: integer `69655`, expected u16"),
        ];
        for (from, to, expected) in table {
            let found = complaints(from, to);
            assert!(found.iter().any(|complaint| complaint.contains(expected)), "{to}:\n{}", found.join("\n"));
        }
    }

    #[test]
    fn a_complaint_leads_to_its_line_and_column_and_none_hides_another() {
        let text = GOOD.replace("values = [50, 60]", "values = [50, 61]").replace("kbps = 125 ", "kbps = 1 ");
        let complaints = read("unit.toml", &text).expect_err("two faults");
        assert_eq!(complaints.len(), 2);
        let line = |needle: &str| text[..text.find(needle).expect(needle)].matches('\n').count() + 1;
        assert_eq!(complaints[0].line, line("[can]"));
        assert_eq!((complaints[1].line, complaints[1].column), (line("index = 0x5010"), 9));
        let broken = read("unit.toml", "name = ").expect_err("no TOML");
        assert_eq!((broken.len(), broken[0].line, broken[0].column), (1, 1, 8), "{broken:?}");
    }
}
