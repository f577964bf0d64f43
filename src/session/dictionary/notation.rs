//! How a unit writes its numbers, as far as it matters for what they are.
//!
//! `250` is 250 wherever hexadecimal numbers are marked. From a unit that prints `C000027F` it may be 592 as well, so
//! digits without a mark are not a value in such a walk, unless they are the same number either way. The vendor and
//! product code (object 1018h), which the manual fixes for every unit, show how numbers are written.

use std::collections::BTreeMap;

use crate::canopen::{DataType, ObjectAddress, Value};
use crate::device::Product;
use crate::session::event::ReadEntry;
use crate::wire::dictionary::Shown;

/// Entries whose values are the same in every unit of a product.
const CONSTANTS: [ObjectAddress; 2] = [ObjectAddress::new(0x1018, 1), ObjectAddress::new(0x1018, 2)];
/// Digits of a 32-bit number with leading zeros in hexadecimal. Decimal numbers are not printed like that.
const ALL_DIGITS: usize = 8;

/// Whether the digits shown for a constant are its value if they are hexadecimal, and if they are decimal.
fn constant(
    entries: &BTreeMap<ObjectAddress, ReadEntry>,
    at: ObjectAddress,
    product: &Product,
) -> Option<(bool, bool)> {
    let numeral = &entries.get(&at)?.reading.as_ref()?.numeral;
    let default = product.dictionary.object(at.index)?.entry(at.sub)?.default?.value.as_integer()?;
    let is = |radix| i64::from_str_radix(numeral, radix).is_ok_and(|number| number == default);
    Some((is(16), is(10)))
}

/// Once a walk is over: withdraws values that are not certain, and fills in those that are. A single doubtful entry
/// already shows that plain decimal digits may be hexadecimal.
pub(super) fn settle(entries: &mut BTreeMap<ObjectAddress, ReadEntry>, product: &Product) {
    let constants = CONSTANTS.map(|at| constant(entries, at, product));
    let contradicts = constants.iter().flatten().any(|(hexadecimal, decimal)| *hexadecimal && !decimal);
    if !contradicts && !entries.values().any(ReadEntry::is_doubtful) {
        return;
    }
    let agrees = constants.iter().all(|constant| constant.is_some_and(|(hexadecimal, _)| hexadecimal));
    for (at, entry) in entries {
        let Some(reading) = &mut entry.reading else { continue };
        if reading.plain && matches!(reading.shown, Shown::Value(value) if !is_same_in_both(value)) {
            reading.shown = Shown::Hexadecimal;
        }
        if reading.shown != Shown::Hexadecimal || !agrees {
            continue;
        }
        let Some(entry) = product.dictionary.entry(*at) else { continue };
        let numeral = reading.numeral.as_str();
        let is_sure = numeral.len() == ALL_DIGITS
            || numeral.contains(|c: char| c.is_ascii_alphabetic())
            || CONSTANTS.contains(at);
        let is_whole = entry.data_type != DataType::Real32;
        let number = i64::from_str_radix(numeral, 16).ok().filter(|_| is_sure && is_whole);
        if let Some(value) = number.and_then(|number| entry.data_type.integer(number)) {
            reading.shown = Shown::Value(value);
        }
    }
}

/// Whether the digits of a decimal number are the same number if they are hexadecimal.
fn is_same_in_both(value: Value) -> bool {
    match (value, value.as_integer()) {
        (Value::Real32(number), _) => number == 0.0,
        (_, Some(number)) => (0..10).contains(&number),
        (_, None) => false,
    }
}
