//! How this unit shows its object dictionary.
//!
//! The manuals fix that indices are hexadecimal; everything else is drawn. Two things hold in every dialect: a setting is
//! shown with all its digits, so that what has been read can be written again, and a measured value with no more digits
//! than the unit resolves.

use std::fmt::Write;

use super::Dialect;
use super::phrases::{EntryStyle, IndexStyle, NumberStyle};
use crate::canopen::{DataType, Value};
use crate::device::Product;
use crate::device::dictionary::{Access, Entry, Object, ObjectKind};

/// An entry of the view with its present value.
#[derive(Clone, Copy, Debug)]
pub struct ViewEntry {
    /// The entry.
    pub entry: &'static Entry,
    /// Its value.
    pub value: Value,
}

/// Decimal places of measured values other than temperatures: of V, mA and ohm (a guess).
const MEASURED_DECIMALS: usize = 3;

impl Dialect {
    /// An object of a product with its entries.
    pub fn view_object(&self, product: &Product, object: &Object, entries: impl Iterator<Item = ViewEntry>) -> String {
        let index = match self.phrases.index {
            IndexStyle::Suffix => format!("{:04X}h", object.index),
            IndexStyle::Prefix => format!("0x{:04X}", object.index),
            IndexStyle::Dollar => format!("${:04X}", object.index),
        };
        let mut text = String::new();
        if self.phrases.entry.has_heading() {
            let _ = write!(text, "{index} {}\r\n", object.name);
        }
        for shown in entries {
            self.view_entry(&mut text, product, object, &index, shown);
        }
        text
    }

    fn view_entry(&self, text: &mut String, product: &Product, object: &Object, index: &str, shown: ViewEntry) {
        let ViewEntry { entry, value } = shown;
        let number = self.value(product, object, entry, value);
        let unit = entry.unit.as_deref().filter(|_| self.phrases.units && !number.starts_with("0x"));
        let unit = unit.map(|unit| format!(" {}", ascii(unit))).unwrap_or_default();
        let meaning = entry.meaning(value).filter(|_| self.phrases.meanings);
        let meaning = meaning.map(|meaning| format!(" ({meaning})")).unwrap_or_default();
        let (sub, name) = (entry.sub, &entry.name);
        let full = match object.kind {
            ObjectKind::Var => object.name.clone(),
            ObjectKind::Array | ObjectKind::Record => format!("{} {name}", object.name),
        };
        let _ = match self.phrases.entry {
            EntryStyle::Heading => write!(text, "  {sub:02X}h {name:<32} = {number}{unit}{meaning}\r\n"),
            EntryStyle::SubHeading => write!(text, "    sub {sub}: {number}{unit}{meaning}\r\n"),
            EntryStyle::Bracketed => {
                write!(text, "[{:04X}:{sub:02X}] {full} = {number}{unit}{meaning}\r\n", object.index)
            }
            EntryStyle::Glued => write!(text, "{:04X}sub{sub:X}\t{number}{unit}\t{full}\r\n", object.index),
            EntryStyle::Colon => write!(text, "{index}:{sub:02X}  {full}: {number}{unit}{meaning}\r\n"),
            EntryStyle::Dots => {
                let room = 44usize.saturating_sub(full.len()).max(3);
                write!(text, "{index}.{sub} {full} {} {number}{unit}{meaning}\r\n", ".".repeat(room))
            }
        };
    }

    /// A value as this unit prints it.
    fn value(&self, product: &Product, object: &Object, entry: &Entry, value: Value) -> String {
        let NumberStyle { decimals, not_a_number, hexadecimal, .. } = self.phrases.numbers;
        match value {
            Value::Real32(number) if number.is_nan() => not_a_number.into(),
            Value::Real32(number) if entry.access == Access::ReadOnly => {
                let resolved = match entry.unit.as_deref() {
                    Some("°C") => product.stream.field_value.decimals,
                    _ => MEASURED_DECIMALS,
                };
                format!("{number:.*}", decimals.min(resolved))
            }
            Value::Real32(number) => with_all_digits(number, decimals),
            Value::Boolean(flag) => u8::from(flag).to_string(),
            Value::Unsigned32(bits) if entry.unit.is_none() => self.hexadecimal(u64::from(bits), 8),
            Value::Unsigned8(bits) if object.index == 0x1001 || (object.index == 0x6150 && entry.sub > 0) => {
                self.hexadecimal(u64::from(bits), 2)
            }
            _ => {
                let integer = value.as_integer().unwrap_or_default();
                let unsigned = matches!(value.data_type(), DataType::Unsigned8 | DataType::Unsigned16);
                if hexadecimal && unsigned && entry.unit.is_none() && entry.sub > 0 {
                    self.hexadecimal(integer as u64, value.data_type().bytes() * 2)
                } else {
                    integer.to_string()
                }
            }
        }
    }

    fn hexadecimal(&self, bits: u64, digits: usize) -> String {
        if self.phrases.numbers.suffix { format!("{bits:0digits$X}h") } else { format!("0x{bits:0digits$X}") }
    }
}

/// As many digits as it takes to read the same number again, and at least `decimals` decimal places.
fn with_all_digits(number: f32, decimals: usize) -> String {
    let shortest = number.to_string();
    let decimal_places = shortest.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    if decimal_places < decimals { format!("{number:.decimals$}") } else { shortest }
}

/// A unit's name in the characters a serial terminal has.
fn ascii(unit: &str) -> String {
    unit.replace('°', "").replace('µ', "u").replace('Ω', "Ohm").replace('²', "2").replace('⁴', "4")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::objects::Objects;

    fn view(dialect: &Dialect, product: &Product, object: &Object, shown: ViewEntry) -> String {
        dialect.view_object(product, object, std::iter::once(shown))
    }

    #[test]
    fn every_dialect_shows_every_index_in_characters_of_a_terminal() {
        for product in Product::all() {
            let objects = Objects::factory(product, 127);
            for seed in 0..100 {
                let dialect = Dialect::drawn(seed);
                for object in product.dictionary.objects() {
                    let entries = object
                        .entries
                        .iter()
                        .map(|entry| ViewEntry { entry, value: objects.get(object.index, entry.sub) });
                    let text = dialect.view_object(product, object, entries);
                    assert!(text.contains(&format!("{:04X}", object.index)), "seed {seed}: {text}");
                    assert!(text.is_ascii(), "seed {seed}: {text}");
                    assert!(text.lines().count() >= object.entries.len(), "seed {seed}: {text}");
                }
            }
        }
    }

    #[test]
    fn every_dialect_shows_every_setting_with_all_its_digits() {
        for product in Product::all() {
            for (at, object, entry) in product.dictionary.entries() {
                // Values that nothing else in the line looks like.
                let values = match entry.data_type {
                    DataType::Real32 if entry.access == Access::ReadOnly => continue,
                    DataType::Real32 => [-5.853_116, 1.234_567e-4, 18.125, -9_999.875].map(Value::Real32).to_vec(),
                    DataType::Boolean => vec![Value::Boolean(true)],
                    other => vec![other.integer(93).expect("it fits all of them")],
                };
                for (seed, value) in (0..100).flat_map(|seed| values.iter().map(move |&value| (seed, value))) {
                    let text = view(&Dialect::drawn(seed), product, object, ViewEntry { entry, value });
                    let line = text.lines().last().unwrap_or_default();
                    let is_shown = line.split_whitespace().any(|word| entry.data_type.parse(word) == Some(value));
                    assert!(is_shown, "{at} is {value}, seed {seed} shows {line}");
                }
            }
        }
    }

    #[test]
    fn no_dialect_shows_more_digits_than_a_unit_resolves() {
        for (name, index, sub, shown) in [
            ("AXTC4CO", 0x6100, 1, ["102.351", "102.35"]),
            ("AXTC4CO", 0x3100, 0, ["102.351", "102.35"]),
            ("AXRTD8CO", 0x6100, 8, ["102.4", "102.4"]),
            ("AXRTD8CO", 0x2100, 3, ["102.4", "102.4"]),
            ("AXRTD8CO", 0x2000, 1, ["102.351", "102.35"]),
        ] {
            let product = Product::named(name).expect("built in");
            let object = product.dictionary.object(index).expect("an object");
            let entry = object.entry(sub).expect("an entry");
            let shown = shown.map(|number| Value::Real32(number.parse().expect("a number")));
            for seed in 0..100 {
                let value = Value::Real32(102.350_655);
                let text = view(&Dialect::drawn(seed), product, object, ViewEntry { entry, value });
                let read = text.split_whitespace().filter_map(|word| word.parse().ok().map(Value::Real32));
                assert!(read.into_iter().any(|value| shown.contains(&value)), "{index:04X}h, seed {seed}: {text}");
            }
        }
    }

    #[test]
    fn a_setting_has_as_many_digits_as_the_others_or_more() {
        for (number, decimals, text) in [
            (16.0, 3, "16.000"),
            (16.0, 2, "16.00"),
            (-5.853_116, 3, "-5.853116"),
            (0.000_1, 3, "0.0001"),
            (18.125, 2, "18.125"),
            (-1000.0, 6, "-1000.000000"),
        ] {
            assert_eq!(with_all_digits(number, decimals), text);
        }
    }
}
