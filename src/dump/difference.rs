//! What differs between two dumps.

use std::collections::BTreeMap;

use super::{Dump, DumpEntry};

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
}

/// Every entry that differs, by index and sub-index. Against the factory only what it defines can differ.
pub fn differences(left: &Dump, right: &Dump) -> Vec<Difference> {
    let by_address = |dump: &Dump| -> BTreeMap<(String, u8), DumpEntry> {
        dump.entries.iter().map(|entry| ((entry.index.clone(), entry.subindex), entry.clone())).collect()
    };
    let (of_left, of_right) = (by_address(left), by_address(right));
    let with_factory = left.version.is_none() || right.version.is_none();
    let mut addresses: Vec<&(String, u8)> = of_left.keys().chain(of_right.keys()).collect();
    addresses.sort();
    addresses.dedup();
    let differs = |address: &(String, u8)| {
        let (left, right) = (of_left.get(address), of_right.get(address));
        let same = match (left, right) {
            (Some(left), Some(right)) => same_number(left.value.as_ref(), right.value.as_ref()),
            (None, _) | (_, None) => with_factory,
        };
        let shown = |entry: Option<&DumpEntry>| entry.map(DumpEntry::number);
        let name = left.or(right).map(|entry| entry.name.clone()).unwrap_or_default();
        let (index, subindex) = address.clone();
        (!same).then(|| Difference { index, subindex, name, left: shown(left), right: shown(right) })
    };
    addresses.into_iter().filter_map(differs).collect()
}

/// Equal, as far as a unit's number of digits shows.
fn same_number(left: Option<&serde_json::Number>, right: Option<&serde_json::Number>) -> bool {
    match (left.and_then(serde_json::Number::as_f64), right.and_then(serde_json::Number::as_f64)) {
        (Some(left), Some(right)) if left.fract() == 0.0 && right.fract() == 0.0 => left == right,
        (Some(left), Some(right)) => (left - right).abs() <= right.abs().max(1.0) * 1e-3,
        (left, right) => left == right,
    }
}
