//! How a unit writes its numbers, as far as it matters for what they are.
//!
//! `250` is 250 wherever hexadecimal numbers are marked. Of a unit that prints `C000027F` it may be 592 as well, so digits
//! without a mark are not a value in such a walk, unless they are the same number either way. The vendor and product code
//! (object 1018h), which the manual fixes for every unit, show how numbers are written.

use std::collections::{BTreeMap, BTreeSet};

use crate::canopen::{DataType, ObjectAddress, Value};
use crate::device::Product;
use crate::session::event::ReadEntry;

/// Entries that every unit of a product has the same value in.
const CONSTANTS: [ObjectAddress; 2] = [ObjectAddress::new(0x1018, 1), ObjectAddress::new(0x1018, 2)];
/// Digits of a number of 32 bits that nobody writes out in decimal digits.
const ALL_DIGITS: usize = 8;

/// What a constant is if its digits are hexadecimal, and if they are decimal.
fn constant(
    entries: &BTreeMap<ObjectAddress, ReadEntry>,
    at: ObjectAddress,
    product: &Product,
) -> Option<(bool, bool)> {
    let numeral = entries.get(&at)?.numeral.as_deref()?;
    let default = product.dictionary.object(at.index)?.entry(at.sub)?.default?.value.as_integer()?;
    let is = |radix| i64::from_str_radix(numeral, radix).is_ok_and(|number| number == default);
    Some((is(16), is(10)))
}

/// Takes values back that are not certain, and gives those that are, once a walk is over. `plain` are the entries whose
/// value is decimal digits alone. Those that are doubtful already show that such digits may be others.
pub(super) fn settle(
    entries: &mut BTreeMap<ObjectAddress, ReadEntry>,
    plain: &BTreeSet<ObjectAddress>,
    product: &Product,
) {
    let constants = CONSTANTS.map(|at| constant(entries, at, product));
    let contradicts = constants.iter().flatten().any(|(hexadecimal, decimal)| *hexadecimal && !decimal);
    if !contradicts && !entries.values().any(|entry| entry.doubtful) {
        return;
    }
    let agrees = constants.iter().all(|constant| constant.is_some_and(|(hexadecimal, _)| hexadecimal));
    for (at, entry) in entries {
        if plain.contains(at) && entry.value.is_some_and(|value| !is_same_in_both(value)) {
            (entry.value, entry.doubtful) = (None, true);
        }
        if !entry.doubtful || !agrees {
            continue;
        }
        let data_type =
            product.dictionary.object(at.index).and_then(|object| object.entry(at.sub)).map(|entry| entry.data_type);
        let Some((numeral, data_type)) = entry.numeral.as_deref().zip(data_type) else { continue };
        let is_sure = numeral.len() == ALL_DIGITS
            || numeral.contains(|c: char| c.is_ascii_alphabetic())
            || CONSTANTS.contains(at);
        let number = i64::from_str_radix(numeral, 16).ok().filter(|_| is_sure && data_type != DataType::Real32);
        if let Some(value) = number.and_then(|number| data_type.integer(number)) {
            (entry.value, entry.doubtful) = (Some(value), false);
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
