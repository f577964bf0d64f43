//! What differs between two dumps.

use std::collections::BTreeMap;

use super::{Dump, DumpEntry, hexadecimal, rounding};
use crate::device::Product;
use crate::device::dictionary::Access;

/// One entry that is not the same on both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Four hexadecimal digits.
    pub index: String,
    /// Sub-index.
    pub subindex: u8,
    /// Its name.
    pub name: String,
    /// Its value on the left; `None` if it is not there.
    pub left: Option<String>,
    /// Its value on the right; `None` if it is not there.
    pub right: Option<String>,
    /// Bits, and not a number of something: people read these in hexadecimal digits.
    bits: bool,
    /// Somebody has set it. What a unit measures, and what is its own, differs without anybody's doing.
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
    let by_address = |dump: &Dump| -> BTreeMap<(String, u8), DumpEntry> {
        dump.entries.iter().map(|entry| ((entry.index.clone(), entry.subindex), entry.clone())).collect()
    };
    let (of_left, of_right) = (by_address(left), by_address(right));
    // The manual gives its numbers in as few digits as will do, and means them.
    let rounding =
        |dump: &Dump, entry: &DumpEntry, value| if dump.factory { 0.0 } else { rounding(&entry.text, value) };
    let product = left.product.as_deref().or(right.product.as_deref()).and_then(Product::named);
    let is_setting = |entry: Option<&DumpEntry>| {
        let at = entry.and_then(DumpEntry::at);
        let known = product.zip(at).and_then(|(product, at)| product.dictionary.object(at.index)?.entry(at.sub));
        known.is_none_or(|entry| entry.access == Access::ReadWrite)
    };
    let mut addresses: Vec<&(String, u8)> = of_left.keys().chain(of_right.keys()).collect();
    addresses.sort();
    addresses.dedup();
    let differs = |address: &(String, u8)| {
        let number = |entry: &DumpEntry| entry.value.as_ref().and_then(serde_json::Number::as_f64);
        let (of_left, of_right) = (of_left.get(address), of_right.get(address));
        let same = match (of_left, of_right) {
            (Some(of_left), Some(of_right)) => match (number(of_left), number(of_right)) {
                (Some(a), Some(b)) => {
                    let open = rounding(left, of_left, a).max(rounding(right, of_right, b));
                    (a - b).abs() <= open.max(b.abs() * f64::from(f32::EPSILON))
                }
                // What is no number is what the unit printed.
                (None, None) => of_left.text == of_right.text,
                (Some(_), None) | (None, Some(_)) => false,
            },
            // The factory has nothing to say of what it does not set; a unit that does not show what it sets lacks it.
            (Some(_), None) => right.factory,
            (None, Some(_)) => left.factory,
            (None, None) => true,
        };
        let (left, right) = (of_left, of_right);
        let shown = |entry: Option<&DumpEntry>| {
            entry.map(|entry| if entry.value.is_some() { entry.number() } else { entry.text.clone() })
        };
        let name = left.or(right).map(|entry| entry.name.clone()).unwrap_or_default();
        let (index, subindex) = address.clone();
        let entry = left.or(right);
        (!same).then(|| Difference {
            index,
            subindex,
            name,
            left: shown(left),
            right: shown(right),
            bits: entry.is_some_and(|entry| entry.bits),
            setting: is_setting(entry),
        })
    };
    addresses.into_iter().filter_map(differs).collect()
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
    fn what_is_no_number_is_compared_as_it_is_printed() {
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
