//! A product's electronic data sheet (CiA 306): what configuration tools know it by.
//!
//! Every sub-index is written out: readers lose entries of the compact form. Limits that depend on another entry are left
//! out, since an EDS has constants only; the unit refuses what does not fit.

use std::collections::BTreeMap;
use std::fmt::Write;

use jiff::Timestamp;

use super::Product;
use super::dictionary::{Access, Bound, Entry, Object, ObjectKind};
use crate::canopen::{ObjectAddress, Value};

/// Vendor's name as the manuals print it.
const VENDOR: &str = "Axiomatic Technologies Corporation";
/// When the data sheets were made: 24 November 2026, noon. Constant, so that the same program always writes the same file.
const MADE: i64 = 1_795_521_600_000;
/// The identity object's revision of a unit (CiA 301).
const REVISION: ObjectAddress = ObjectAddress::new(0x1018, 3);
/// Objects every CANopen node has (CiA 301, section 7.4.4).
const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];
/// Objects that no configuration is written back to: their values are commands (CiA 306, ObjFlags).
const NEVER_RESTORED: [u16; 2] = [0x1010, 0x1011];

/// A unit as a device configuration file describes it.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// Its node-ID.
    pub node_id: u8,
    /// Its bit rate in kbit/s.
    pub kbps: u16,
    /// When it was read, in milliseconds since 1970.
    pub unix_millis: i64,
    /// The values of its entries, where they are known.
    pub values: BTreeMap<ObjectAddress, Value>,
}

/// The data sheet's text, with CR LF.
pub fn write(product: &Product) -> String {
    file(product, None)
}

/// The text of a device configuration file (DCF): the data sheet with a unit's values in it.
pub fn write_configuration(product: &Product, configuration: &Configuration) -> String {
    file(product, Some(configuration))
}

fn file(product: &Product, configuration: Option<&Configuration>) -> String {
    let mut eds = Eds { text: String::new(), configuration };
    let name = &product.name;
    eds.section("FileInfo");
    eds.line("FileName", format!("{name}.{}", if configuration.is_some() { "dcf" } else { "eds" }));
    eds.line("FileVersion", "1");
    eds.line("FileRevision", "0");
    eds.line("EDSVersion", "4.0");
    eds.line("Description", format!("{name}, {}", product.title));
    let (date, time) = date_and_time(configuration.map_or(MADE, |configuration| configuration.unix_millis));
    for (deed, by) in [("Creation", "CreatedBy"), ("Modification", "ModifiedBy")] {
        eds.line(&format!("{deed}Time"), &time);
        eds.line(&format!("{deed}Date"), &date);
        eds.line(by, "axcon");
    }
    if let Some(Configuration { node_id, kbps, .. }) = configuration {
        eds.line("LastEDS", format!("{name}.eds"));
        eds.section("DeviceComissioning");
        eds.line("NodeID", node_id);
        eds.line("NodeName", name);
        eds.line("Baudrate", kbps);
        eds.line("NetNumber", 0);
        eds.line("CANopenManager", 0);
    }

    eds.section("DeviceInfo");
    eds.line("VendorName", VENDOR);
    eds.line("VendorNumber", format!("0x{:08X}", product.can.vendor_id));
    eds.line("ProductName", name);
    eds.line("ProductNumber", format!("0x{:08X}", product.can.product_code));
    let revision = configuration.and_then(|configuration| configuration.values.get(&REVISION)?.as_integer());
    eds.line("RevisionNumber", revision.map_or_else(|| "0".to_owned(), |revision| format!("0x{revision:08X}")));
    eds.line("OrderCode", name);
    for kbps in super::BIT_RATES_KBPS {
        eds.line(&format!("BaudRate_{kbps}"), 1);
    }
    eds.line("SimpleBootUpMaster", 0);
    eds.line("SimpleBootUpSlave", 1);
    eds.line("Granularity", 8);
    eds.line("DynamicChannelsSupported", 0);
    eds.line("GroupMessaging", 0);
    eds.line("NrOfRXPDO", pdos(product, 0x1400));
    eds.line("NrOfTXPDO", pdos(product, 0x1800));
    eds.line("LSS_Supported", 1);

    eds.section("DummyUsage");
    for data_type in 1..=7 {
        eds.line(&format!("Dummy{data_type:04X}"), 0);
    }
    eds.section("Comments");
    eds.line("Lines", 1);
    eds.line("Line1", format!("Made from the manual {}", product.manual));

    let objects = product.dictionary.objects();
    let is_manufacturers = |object: &&Object| (0x2000..0x6000).contains(&object.index);
    let is_mandatory = |object: &&Object| MANDATORY.contains(&object.index);
    eds.list("MandatoryObjects", objects.iter().filter(is_mandatory));
    eds.list("OptionalObjects", objects.iter().filter(|object| !is_mandatory(object) && !is_manufacturers(object)));
    eds.list("ManufacturerObjects", objects.iter().filter(is_manufacturers));
    for object in objects {
        eds.object(object);
    }
    eds.text
}

/// A moment in UTC as the format has it: `11-24-2026`, `12:00PM`.
fn date_and_time(unix_millis: i64) -> (String, String) {
    let moment = Timestamp::from_millisecond(unix_millis).unwrap_or(Timestamp::UNIX_EPOCH);
    (moment.strftime("%m-%d-%Y").to_string(), moment.strftime("%I:%M%p").to_string())
}

fn pdos(product: &Product, first: u16) -> usize {
    product.dictionary.objects().iter().filter(|object| object.index & 0xFE00 == first).count()
}

struct Eds<'a> {
    text: String,
    configuration: Option<&'a Configuration>,
}

impl Eds<'_> {
    fn section(&mut self, name: &str) {
        if !self.text.is_empty() {
            self.text.push_str("\r\n");
        }
        let _ = write!(self.text, "[{name}]\r\n");
    }

    fn line(&mut self, key: &str, value: impl std::fmt::Display) {
        let _ = write!(self.text, "{key}={value}\r\n");
    }

    fn list<'o>(&mut self, name: &str, objects: impl Iterator<Item = &'o Object>) {
        let objects: Vec<&Object> = objects.collect();
        self.section(name);
        self.line("SupportedObjects", objects.len());
        for (number, object) in (1..).zip(objects) {
            self.line(&number.to_string(), format!("0x{:04X}", object.index));
        }
    }

    fn object(&mut self, object: &Object) {
        self.section(&format!("{:04X}", object.index));
        self.line("ParameterName", &object.name);
        let object_type = match object.kind {
            ObjectKind::Var => 0x7,
            ObjectKind::Array => 0x8,
            ObjectKind::Record => 0x9,
        };
        self.line("ObjectType", format!("0x{object_type:X}"));
        if NEVER_RESTORED.contains(&object.index) {
            self.line("ObjFlags", "0x3");
        }
        match (object.kind, object.entries.as_slice()) {
            (ObjectKind::Var, [entry]) => self.entry(object, entry),
            (_, entries) => {
                self.line("SubNumber", entries.len());
                for entry in entries {
                    self.section(&format!("{:04X}sub{:X}", object.index, entry.sub));
                    self.line("ParameterName", &entry.name);
                    self.line("ObjectType", "0x7");
                    if NEVER_RESTORED.contains(&object.index) {
                        self.line("ObjFlags", "0x3");
                    }
                    self.entry(object, entry);
                }
            }
        }
    }

    fn entry(&mut self, object: &Object, entry: &Entry) {
        self.line("DataType", format!("0x{:04X}", entry.data_type.code()));
        let access = match entry.access {
            Access::ReadOnly => "ro",
            Access::ReadWrite => "rw",
        };
        self.line("AccessType", access);
        let constant = |bound: Option<Bound>| match bound {
            Some(Bound::Value(value)) => Some(number(value)),
            Some(Bound::Entry { .. }) | None => None,
        };
        // What is valid besides the range would be refused by a tool that knows the range only: 0 in 1017h.
        let single_below = !entry.limits.values.is_empty();
        if let Some(low) = constant(entry.limits.low).filter(|_| !single_below) {
            self.line("LowLimit", low);
        }
        if let Some(high) = constant(entry.limits.high) {
            self.line("HighLimit", high);
        }
        if let Some(default) = entry.default {
            let value = number(default.value);
            if default.plus_node_id {
                self.line("DefaultValue", format!("$NODEID+{value}"));
            } else {
                self.line("DefaultValue", value);
            }
        }
        self.line("PDOMapping", u8::from(entry.mappable));
        let at = ObjectAddress::new(object.index, entry.sub);
        let configured = self.configuration.and_then(|configuration| configuration.values.get(&at));
        if let Some(value) = configured.filter(|value| value.as_f64().is_finite()) {
            self.line("ParameterValue", number(*value));
        }
        // Keys beyond the standard that python-canopen reads.
        if let Some(unit) = &entry.unit {
            self.line("Unit", unit);
            self.line("Factor", factor(unit));
        }
        if let Some(description) =
            entry.description.as_ref().filter(|_| entry.sub > 0 || object.kind == ObjectKind::Var)
        {
            self.line("Description", description);
        }
    }
}

/// A value as an EDS writes it: whole numbers of 32 bits in hexadecimal digits, REAL32 in decimal.
fn number(value: Value) -> String {
    match value {
        Value::Unsigned32(bits) => format!("0x{bits:08X}"),
        Value::Boolean(flag) => u8::from(flag).to_string(),
        value => value.to_string(),
    }
}

/// What a raw value has to be multiplied with to be in the unit that follows the number: `0.1 °C` counts tenths.
fn factor(unit: &str) -> &str {
    unit.split_once(' ').map(|(number, _)| number).filter(|number| number.parse::<f64>().is_ok()).unwrap_or("1")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sections of an INI file with their keys.
    fn sections(text: &str) -> BTreeMap<String, BTreeMap<String, String>> {
        let mut sections: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
        let mut current = String::new();
        for line in text.split("\r\n").filter(|line| !line.is_empty()) {
            assert!(!line.contains(['\r', '\n']), "{line:?}");
            if let Some(name) = line.strip_prefix('[') {
                current = name.trim_end_matches(']').to_owned();
                assert!(sections.insert(current.clone(), BTreeMap::new()).is_none(), "[{current}] twice");
            } else {
                let (key, value) = line.split_once('=').expect(line);
                let keys = sections.get_mut(&current).expect("a section first");
                assert!(keys.insert(key.to_owned(), value.to_owned()).is_none(), "{key} twice in [{current}]");
            }
        }
        sections
    }

    #[test]
    fn every_entry_is_there_as_the_dictionary_has_it() {
        for product in Product::all() {
            let sections = sections(&write(product));
            for (at, object, entry) in product.dictionary.entries() {
                let name = match object.kind {
                    ObjectKind::Var => format!("{:04X}", at.index),
                    ObjectKind::Array | ObjectKind::Record => format!("{:04X}sub{:X}", at.index, at.sub),
                };
                let keys = &sections[&name];
                assert_eq!(keys["DataType"], format!("0x{:04X}", entry.data_type.code()), "{name}");
                assert_eq!(keys["AccessType"] == "rw", entry.access == Access::ReadWrite, "{name}");
                assert_eq!(keys["PDOMapping"] == "1", entry.mappable, "{name}");
                assert_eq!(keys.contains_key("DefaultValue"), entry.default.is_some(), "{name}");
                assert!(!keys.contains_key("CompactSubObj"));
            }
            let listed: usize = ["MandatoryObjects", "OptionalObjects", "ManufacturerObjects"]
                .iter()
                .map(|list| sections[*list]["SupportedObjects"].parse::<usize>().expect("a number"))
                .sum();
            assert_eq!(listed, product.dictionary.objects().len());
        }
    }

    #[test]
    fn a_configuration_carries_the_units_values() {
        let product = Product::named("AXTC4CO").expect("built in");
        let values = [
            (ObjectAddress::new(0x6126, 2), Value::Real32(18.5)),
            (ObjectAddress::new(0x6100, 1), Value::NOT_A_NUMBER),
            (ObjectAddress::new(0x1800, 1), Value::Unsigned32(0x4000_01A0)),
            (REVISION, Value::Unsigned32(0x0001_0002)),
        ];
        // 31 January 2026, a quarter past one in the afternoon.
        let unix_millis = 1_769_865_300_123;
        let configuration = Configuration { node_id: 32, kbps: 250, unix_millis, values: values.into_iter().collect() };
        let sections = sections(&write_configuration(product, &configuration));
        let info = &sections["FileInfo"];
        assert_eq!((info["CreationDate"].as_str(), info["CreationTime"].as_str()), ("01-31-2026", "01:15PM"));
        assert_eq!((&info["ModificationDate"], &info["LastEDS"]), (&info["CreationDate"], &"AXTC4CO.eds".to_owned()));
        assert_eq!(sections["DeviceInfo"]["RevisionNumber"], "0x00010002");
        assert_eq!(sections["DeviceComissioning"]["NodeID"], "32");
        assert_eq!(sections["DeviceComissioning"]["Baudrate"], "250");
        assert_eq!(sections["6126sub2"]["ParameterValue"], "18.5");
        assert_eq!(sections["1800sub1"]["ParameterValue"], "0x400001A0");
        assert!(!sections["6100sub1"].contains_key("ParameterValue"), "no number, nothing to restore");
        assert!(!sections["6126sub1"].contains_key("ParameterValue"));
    }

    #[test]
    fn the_details_that_readers_stumble_over_are_right() {
        let text = write(Product::named("AXTC4CO").expect("built in"));
        let sections = sections(&text);
        let info = &sections["FileInfo"];
        assert_eq!((info["CreationDate"].as_str(), info["CreationTime"].as_str()), ("11-24-2026", "12:00PM"));
        assert_eq!(sections["DeviceInfo"]["RevisionNumber"], "0", "each unit has its own");
        assert_eq!(sections["6126sub1"]["DefaultValue"], "16.0");
        assert_eq!(sections["1800sub1"]["DefaultValue"], "$NODEID+0x40000180");
        assert_eq!((sections["1010"]["ObjFlags"].as_str(), sections["1011sub1"]["ObjFlags"].as_str()), ("0x3", "0x3"));
        assert!(!sections["1017"].contains_key("LowLimit"), "0 is valid below the printed range");
        assert_eq!(sections["1017"]["HighLimit"], "65535");
        assert!(!sections["4000sub1"].contains_key("HighLimit"), "it depends on another entry");
        assert_eq!(
            (sections["4000sub1"]["LowLimit"].as_str(), sections["4000sub1"]["Factor"].as_str()),
            ("-2730", "0.1")
        );
        assert_eq!(sections["DeviceInfo"]["NrOfTXPDO"], "4");
        assert_eq!(sections["DeviceInfo"]["LSS_Supported"], "1");
    }
}
