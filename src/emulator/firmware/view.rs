//! What V shows: first the PDO communication and mapping parameters, then object by object (AXTC4CO manual, section
//! 4.1.1).
//!
//! A true subset of the object dictionary with the unit's present values; object numbers, names and factory values
//! are those of chapter 3. How a line looks is the dialect's business.

use super::super::dialect::ViewLine;
use super::super::memory::Parameters;
use super::super::sensors::Channel;
use super::scanner::{FACTOR, FieldValue, OFFSET, SCAN_TIME, Scanner};
use crate::device::Product;
use crate::image::Identity;
use crate::version::Version;

/// What the values are taken from.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// The product.
    pub product: &'a Product,
    /// The software that runs.
    pub identity: &'a Identity,
    /// Non-volatile parameters.
    pub parameters: &'a Parameters,
    /// The last scan.
    pub scanner: &'a Scanner,
    /// Serial number, object 1018h sub-index 4.
    pub serial_number: u32,
}

/// 1000h: a DS-404 device; the first thermocouple scanner (section 3.2.1).
const DEVICE_TYPE: u32 = 0x1002_0194;
/// 1018h:3, bits 31-16: revision of the object dictionary, and bits 15-8: of the hardware (errata E-21).
const DICTIONARY_AND_HARDWARE_REVISION: u32 = 0x0001_0100;
/// RPDOs do not exist and allow no remote frames; a TPDO that exists allows none either (errata E-08).
const PDO_ABSENT: u32 = 0xC000_0000;
const PDO_PRESENT: u32 = 0x4000_0000;
/// 6100h of a channel without a value, as the bits of a REAL32 that is no number (section 3.3.3).
const NOT_A_NUMBER: &str = "0xFFFFFFFF";

/// Lines of the first block: all PDO communication and mapping parameters (sections 3.2.14 and 3.2.15).
pub fn pdo_block(sources: &Sources<'_>) -> Vec<ViewLine> {
    let mut lines = Vec::new();
    for (number, &(index, name)) in RPDO_COMMUNICATION.iter().enumerate() {
        let cob_id = PDO_ABSENT | pdo_id(0x200, number, sources.parameters.node_id);
        communication(&mut lines, index, name, cob_id, 255, 0);
    }
    for &(index, name) in &RPDO_MAPPING {
        mapping(&mut lines, index, name, 0, [0; 4]);
    }
    for (number, &(index, name)) in TPDO_COMMUNICATION.iter().enumerate() {
        let presence = if number < 2 { PDO_PRESENT } else { PDO_ABSENT };
        let cob_id = presence | pdo_id(0x180, number, sources.parameters.node_id);
        let event_timer_ms = if number == 0 { 1_000 } else { 0 };
        communication(&mut lines, index, name, cob_id, 254, event_timer_ms);
    }
    let mapped = [
        (4, [0x7130_0110, 0x7130_0210, 0x7130_0310, 0x7130_0410]),
        (4, [0x2130_0110, 0x2130_0210, 0x2130_0310, 0x3130_0010]),
        (0, [0; 4]),
        (0, [0; 4]),
    ];
    for (&(index, name), (count, entries)) in TPDO_MAPPING.iter().zip(mapped) {
        mapping(&mut lines, index, name, count, entries);
    }
    lines
}

/// Lines of the object at this place of the walk, `None` behind the last.
pub fn object(sources: &Sources<'_>, place: usize) -> Option<Vec<ViewLine>> {
    let &(index, name) = OBJECTS.get(place)?;
    let mut lines = vec![ViewLine::Object(index, name)];
    let mut entry = |sub: u8, name: &str, value: String| lines.push(ViewLine::Entry(sub, name.to_owned(), value));
    let scanner = sources.scanner;
    match index {
        0x1000 => entry(0, name, hex32(DEVICE_TYPE)),
        0x1001 => entry(0, name, format!("0x{:02X}", u8::from(scanner.errors() > 0))),
        0x1017 | 0x100C | 0x100D => entry(0, name, "0".into()),
        0x1018 => {
            entry(0, "Number of entries", "4".into());
            entry(1, "Vendor ID", hex32(sources.product.can.vendor_id));
            entry(2, "Product Code", hex32(sources.product.can.product_code));
            entry(3, "Revision Number", hex32(revision(sources.identity.version)));
            entry(4, "Serial Number", hex32(sources.serial_number));
        }
        0x1020 => {
            entry(0, "Number of entries", "2".into());
            entry(1, "Configuration Date", hex32(build_date(sources.identity)));
            entry(2, "Configuration Time", hex32(build_time(sources.identity)));
        }
        0x3100 => entry(0, name, format!("{:.3}", scanner.cold_junction())),
        0x5000 => entry(0, name, format!("{:.2}", scanner.supply())),
        0x5010 => entry(0, name, "60".into()),
        0x5555 => entry(0, name, "0".into()),
        _ => {
            entry(0, "Number of entries", Channel::all().len().to_string());
            for channel in Channel::all() {
                let number = channel.number() as u8;
                entry(number, &format!("TC{number}"), channel_value(scanner, index, channel));
            }
        }
    }
    Some(lines)
}

/// Objects that have an entry for each channel.
fn channel_value(scanner: &Scanner, index: u16, channel: Channel) -> String {
    let value = scanner.field_value(channel);
    match index {
        0x6100 => match value {
            FieldValue::Celsius(celsius) => format!("{celsius:.3}"),
            FieldValue::Disabled | FieldValue::Open => NOT_A_NUMBER.into(),
        },
        0x6110 | 0x2000 => "1".into(),
        0x6112 => u8::from(value != FieldValue::Disabled).to_string(),
        0x6114 => SCAN_TIME.as_micros().to_string(),
        0x6126 => format!("{FACTOR:.3}"),
        0x6127 => format!("{OFFSET:.3}"),
        0x7130 => scanner.process_value(channel).to_string(),
        0x6150 => match value {
            FieldValue::Open => "0x03".into(),
            FieldValue::Celsius(_) | FieldValue::Disabled => "0x00".into(),
        },
        0x2010 => scanner.microvolts(channel).to_string(),
        0x4000 => "-200".into(),
        0x4010 => "1250".into(),
        0x4020 => "2500".into(),
        0x4030 => "5000".into(),
        _ => unreachable!("object {index:04X}h is listed without a value"),
    }
}

fn communication(
    lines: &mut Vec<ViewLine>,
    index: u16,
    name: &'static str,
    cob_id: u32,
    transmission_type: u8,
    event_timer_ms: u16,
) {
    lines.push(ViewLine::Object(index, name));
    let entries = [
        ("Number of entries", "5".to_owned()),
        ("COB-ID", hex32(cob_id)),
        ("Transmission type", transmission_type.to_string()),
        ("Inhibit Time", "0".to_owned()),
        ("Compatibility entry", "0".to_owned()),
        ("Event-timer", event_timer_ms.to_string()),
    ];
    lines.extend((0u8..).zip(entries).map(|(sub, (name, value))| ViewLine::Entry(sub, name.to_owned(), value)));
}

fn mapping(lines: &mut Vec<ViewLine>, index: u16, name: &'static str, count: u8, entries: [u32; 4]) {
    lines.push(ViewLine::Object(index, name));
    lines.push(ViewLine::Entry(0, "Number of mapped objects".into(), count.to_string()));
    for (sub, entry) in (1u8..).zip(entries) {
        lines.push(ViewLine::Entry(sub, format!("Mapped object {sub}"), hex32(entry)));
    }
}

/// CAN-ID of the numbered PDO, from 0, in the pre-defined connection set (DS-301).
fn pdo_id(base: u32, number: usize, node_id: u8) -> u32 {
    base + 0x100 * number as u32 + u32::from(node_id)
}

/// 1018h:3: software version in the lowest byte, a digit for the major and one for the minor number.
fn revision(version: Version) -> u32 {
    DICTIONARY_AND_HARDWARE_REVISION | u32::from(version.major & 0xF) << 4 | u32::from(version.minor & 0xF)
}

/// 1020h:1: day, month and year, their decimal digits read as hexadecimal ones (errata E-22).
fn build_date(identity: &Identity) -> u32 {
    let mut parts = identity.build_date.split('-');
    let mut next = || digits(parts.next());
    let (year, month, day) = (next(), next(), next());
    day << 24 | month << 16 | year
}

/// 1020h:2: hour and minute in the same way.
fn build_time(identity: &Identity) -> u32 {
    let mut parts = identity.build_time.split(':');
    let mut next = || digits(parts.next());
    next() << 8 | next()
}

fn digits(text: Option<&str>) -> u32 {
    text.and_then(|text| u32::from_str_radix(text, 16).ok()).unwrap_or_default()
}

fn hex32(value: u32) -> String {
    format!("0x{value:08X}")
}

const RPDO_COMMUNICATION: [(u16, &str); 4] = [
    (0x1400, "RPDO1 Communication Parameter"),
    (0x1401, "RPDO2 Communication Parameter"),
    (0x1402, "RPDO3 Communication Parameter"),
    (0x1403, "RPDO4 Communication Parameter"),
];
const RPDO_MAPPING: [(u16, &str); 4] = [
    (0x1600, "RPDO1 Mapping Parameter"),
    (0x1601, "RPDO2 Mapping Parameter"),
    (0x1602, "RPDO3 Mapping Parameter"),
    (0x1603, "RPDO4 Mapping Parameter"),
];
const TPDO_COMMUNICATION: [(u16, &str); 4] = [
    (0x1800, "TPDO1 Communication Parameter"),
    (0x1801, "TPDO2 Communication Parameter"),
    (0x1802, "TPDO3 Communication Parameter"),
    (0x1803, "TPDO4 Communication Parameter"),
];
const TPDO_MAPPING: [(u16, &str); 4] = [
    (0x1A00, "TPDO1 Mapping Parameter"),
    (0x1A01, "TPDO2 Mapping Parameter"),
    (0x1A02, "TPDO3 Mapping Parameter"),
    (0x1A03, "TPDO4 Mapping Parameter"),
];

/// The walk behind the first block, in the order of the manual's tables (sections 3.2, 3.3 and 3.4).
const OBJECTS: [(u16, &str); 25] = [
    (0x1000, "Device Type"),
    (0x1001, "Error Register"),
    (0x100C, "Guard Time"),
    (0x100D, "Life Time Factor"),
    (0x1017, "Producer Heartbeat Time"),
    (0x1018, "Identity Object"),
    (0x1020, "Verify Configuration"),
    (0x6100, "Thermocouple Input Field Value"),
    (0x6110, "Thermocouple Sensor Type"),
    (0x6112, "Thermocouple Operating Mode"),
    (0x6114, "ADC Sampling Rate"),
    (0x6126, "Thermocouple Scaling Factor"),
    (0x6127, "Thermocouple Scaling Offset"),
    (0x7130, "Thermocouple Input Process Value"),
    (0x6150, "Thermocouple Status"),
    (0x2000, "Cold Junction Auto-Correct"),
    (0x2010, "Thermocouple Microvolts"),
    (0x3100, "Cold Junction Input Field Value"),
    (0x4000, "Low Temperature Warning Threshold"),
    (0x4010, "High Temperature Warning Threshold"),
    (0x4020, "High Temperature Shutdown Threshold"),
    (0x4030, "Error React Delay"),
    (0x5000, "Power Supply Measured"),
    (0x5010, "ADC Filter Frequency"),
    (0x5555, "Start in Operational Mode"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_object_has_values_and_identity_reads_as_the_manual_prints_it() {
        let product = Product::named("AXTC4CO").expect("built in");
        let identity = Identity {
            product: "AXTC4CO".into(),
            version: Version::new(1, 2, 3),
            build_date: "2010-08-10".into(),
            build_time: "16:20:00".into(),
            program_words: 0,
            crc: 0,
        };
        let sources = Sources {
            product,
            identity: &identity,
            parameters: &Parameters::factory(product),
            scanner: &Scanner::default(),
            serial_number: 7,
        };
        let text: String = (0..OBJECTS.len())
            .flat_map(|place| object(&sources, place).expect("listed"))
            .map(|line| format!("{line:?}\n"))
            .collect();
        assert!(text.contains(r#"Entry(1, "Configuration Date", "0x10082010")"#), "{text}");
        assert!(text.contains(r#"Entry(2, "Configuration Time", "0x00001620")"#), "{text}");
        assert!(text.contains(r#"Entry(2, "Product Code", "0x00010114")"#), "{text}");
        assert!(text.contains(r#"Entry(4, "TC4", "200000")"#), "{text}");
        assert_eq!(object(&sources, OBJECTS.len()), None);
        let block: String = pdo_block(&sources).iter().map(|line| format!("{line:?}\n")).collect();
        for cob_id in ["0xC000027F", "0xC000057F", "0x400001FF", "0x400002FF", "0xC00003FF", "0xC00004FF"] {
            assert!(block.contains(cob_id), "{cob_id}");
        }
    }
}
