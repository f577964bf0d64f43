//! What differs between two dumps.

use std::collections::{BTreeMap, BTreeSet};

use super::{Dump, DumpEntry, hexadecimal, rounding};
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::device::dictionary::Access;

/// One entry that is not the same on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Where it is.
    pub at: ObjectAddress,
    /// Its name.
    pub name: String,
    /// Its value on the left; `None` if it is not there.
    pub left: Option<String>,
    /// Its value on the right; `None` if it is not there.
    pub right: Option<String>,
    /// Bits, not a number of something: people read these in hexadecimal digits.
    bits: bool,
    /// Somebody has set it. What a unit measures, and what is its own, differs by itself.
    pub setting: bool,
}

impl Difference {
    /// The value on the left for a person; `None` if the entry is not there.
    pub fn shown_left(&self) -> Option<String> {
        self.shown(self.left.as_deref())
    }

    /// The value on the right for a person; `None` if the entry is not there.
    pub fn shown_right(&self) -> Option<String> {
        self.shown(self.right.as_deref())
    }

    fn shown(&self, number: Option<&str>) -> Option<String> {
        number.map(|number| match number.parse() {
            Ok(bits) if self.bits => hexadecimal(bits),
            _ => number.to_owned(),
        })
    }
}

/// Every entry that differs, by index and sub-index. Against the factory only what it sets can differ.
pub fn differences(left: &Dump, right: &Dump) -> Vec<Difference> {
    let product = left.product.as_deref().or(right.product.as_deref()).and_then(Product::named);
    let is_setting = |entry: &DumpEntry| {
        let known = product.and_then(|product| product.dictionary.entry(entry.at()));
        known.is_none_or(|entry| entry.access == Access::ReadWrite)
    };
    let (of_left, of_right) = (by_place(left), by_place(right));
    let places: BTreeSet<ObjectAddress> = of_left.keys().chain(of_right.keys()).copied().collect();
    let differs = |at: ObjectAddress| {
        let left = Side { entry: of_left.get(&at).copied(), factory: left.factory };
        let right = Side { entry: of_right.get(&at).copied(), factory: right.factory };
        let entry = left.entry.or(right.entry).filter(|_| !same(left, right))?;
        Some(Difference {
            at,
            name: entry.name.clone(),
            left: left.entry.map(printed),
            right: right.entry.map(printed),
            bits: entry.bits,
            setting: is_setting(entry),
        })
    };
    places.into_iter().filter_map(differs).collect()
}

fn by_place(dump: &Dump) -> BTreeMap<ObjectAddress, &DumpEntry> {
    dump.entries.iter().map(|entry| (entry.at(), entry)).collect()
}

/// One side of a comparison.
#[derive(Clone, Copy)]
struct Side<'a> {
    /// The entry, if the dump has it.
    entry: Option<&'a DumpEntry>,
    /// Whether the dump is the factory's.
    factory: bool,
}

impl Side<'_> {
    /// How far an entry's value may be from what is printed of it. The manual gives its numbers in as few digits as will
    /// do, and means them.
    fn rounding(self, entry: &DumpEntry, value: f64) -> f64 {
        if self.factory { 0.0 } else { rounding(&entry.text, value) }
    }
}

fn same(left: Side<'_>, right: Side<'_>) -> bool {
    let number = |entry: &DumpEntry| entry.value.as_ref().and_then(serde_json::Number::as_f64);
    match (left.entry, right.entry) {
        (Some(of_left), Some(of_right)) => match (number(of_left), number(of_right)) {
            (Some(a), Some(b)) => {
                let open = left.rounding(of_left, a).max(right.rounding(of_right, b));
                (a - b).abs() <= open.max(b.abs() * f64::from(f32::EPSILON))
            }
            // What is not a number is compared as the unit printed it.
            (None, None) => of_left.text == of_right.text,
            (Some(_), None) | (None, Some(_)) => false,
        },
        // The factory has nothing to say about what it does not set; a unit that does not show what it sets lacks it.
        (Some(_), None) => right.factory,
        (None, Some(_)) => left.factory,
        (None, None) => true,
    }
}

/// An entry's value as a number; as the unit printed it if it is not one.
fn printed(entry: &DumpEntry) -> String {
    if entry.value.is_some() { entry.number() } else { entry.text.clone() }
}

#[cfg(test)]
mod tests {
    use super::super::half_a_unit;
    use super::*;

    #[test]
    fn a_number_may_be_off_by_half_of_what_is_printed_last() {
        let table = [
            ("18.000", 5e-4),
            ("18", 0.5),
            ("1.8e1", 0.5),
            ("-0.25", 5e-3),
            ("4.37e3", 5.0),
            ("1e-3", 5e-4),
            ("7.", 0.5),
        ];
        for (numeral, expected) in table {
            let found = half_a_unit(numeral);
            assert!((found - expected).abs() < expected * 1e-9, "{numeral}: {found}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_compared_as_it_is_printed() {
        let product = Product::named("AXTC4CO").expect("built in");
        let (left, mut right) = (Dump::factory(product), Dump::factory(product));
        assert_eq!(differences(&left, &right), []);
        let mut left = left;
        for dump in [&mut left, &mut right] {
            dump.factory = false;
            dump.entries[0].value = None;
            dump.entries[0].text = "Ver. A".into();
        }
        assert_eq!(differences(&left, &right), []);
        right.entries[0].text = "Ver. B".into();
        let found = differences(&left, &right);
        let sides: Vec<_> = found.iter().map(|found| (found.left.as_deref(), found.right.as_deref())).collect();
        assert_eq!(sides, [(Some("Ver. A"), Some("Ver. B"))]);
        left.entries[0].value = Some(1.into());
        assert_eq!(differences(&left, &right)[0].left.as_deref(), Some("1"));
    }

    #[test]
    fn what_is_printed_exactly_is_compared_exactly() {
        assert!(rounding("6127h sub 2 = 4370.00 uV", 4370.0) < 2.0, "two microvolts are a deviation");
        assert!(rounding("A = 3.910E-03", f64::from(3.91e-3_f32)) < 1e-5);
        assert!(rounding("no numeral", 16.0) < 1e-4);
    }
}
