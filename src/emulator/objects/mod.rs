//! The unit's live object dictionary: every entry's present value, what may be written to it, and what a write brings
//! about.
//!
//! Two doors: [`read`](Objects::read) and [`write`](Objects::write) are the network's, with a refusal for each
//! violation; [`get`](Objects::get) and [`set`](Objects::set) are the firmware's own, which knows its entries.
//! The rules come from the manuals' chapter 3 and, where they refer to it, from CiA 301; the errata decide the rest.

mod pdo;

use super::rtd_curve;
use crate::canopen::{Abort, ObjectAddress, Value};
use crate::device::dictionary::{Access, Bound, Entry, Group};
use crate::device::{Product, SensorKind};

/// Present values of all entries.
#[derive(Clone, Debug)]
pub struct Objects {
    product: &'static Product,
    /// By place in the product's dictionary.
    values: Vec<(ObjectAddress, Value)>,
}

/// What the unit has to do after a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Nothing.
    None,
    /// Keep the present parameters of a group, or of all, across power cycles.
    Save(Option<Group>),
    /// Forget what is kept of a group, or of all; the present values stay until the next reset.
    Restore(Option<Group>),
    /// Empty the list of errors.
    ClearErrors,
}

/// Parameters that differ from the factory's, to be kept across power cycles.
pub type Saved = Vec<(ObjectAddress, Value)>;

/// The characters `save`, lowest byte first (section 3.2.7).
const SAVE: u32 = 0x6576_6173;
/// The characters `load` (section 3.2.8).
const LOAD: u32 = 0x6461_6F6C;

impl Objects {
    /// As the product leaves the factory, on a node-ID.
    pub fn factory(product: &'static Product, node_id: u8) -> Self {
        let values = product
            .dictionary
            .entries()
            .map(|(at, _, entry)| {
                let zero = entry.data_type.decode(&vec![0; entry.data_type.bytes()]).expect("as long as the type");
                (at, entry.default.map_or(zero, |default| default.on_node(node_id)))
            })
            .collect();
        Objects { product, values }
    }

    /// As the unit starts: the factory's values, and over them what is kept, taken as a whole (errata E-29). Entries
    /// that this product does not have, and values that none of its versions takes, are left out.
    pub fn with_saved(product: &'static Product, node_id: u8, saved: &Saved) -> Self {
        let mut objects = Objects::factory(product, node_id);
        for &(at, value) in saved {
            if let Ok((place, entry)) = objects.find(at)
                && entry.data_type == value.data_type()
                && entry.limits.admit_alone(value)
                && value.as_f64().is_finite()
            {
                objects.values[place].1 = value;
            }
        }
        objects.follow_modes();
        objects
    }

    /// The parameters that differ from the factory's. What equals it is left out: a COB-ID nobody has changed follows
    /// the node-ID (errata E-88).
    pub fn deviations(&self, node_id: u8) -> Saved {
        let entries = self.product.dictionary.entries().zip(&self.values);
        let changed = entries.filter(|((at, _, entry), (_, value))| {
            let default = entry.default.map(|default| default.on_node(node_id));
            is_parameter(*at, entry) && default != Some(*value)
        });
        changed.map(|(_, &kept)| kept).collect()
    }

    /// Takes the parameters of a group over from others of the same product.
    pub fn take_over(&mut self, group: Group, from: &Objects) {
        let entries = self.product.dictionary.entries();
        for ((at, _, entry), (present, kept)) in entries.zip(self.values.iter_mut().zip(&from.values)) {
            if is_parameter(at, entry) && Group::of(at.index) == Some(group) {
                *present = *kept;
            }
        }
    }

    /// The product they are of.
    pub fn product(&self) -> &'static Product {
        self.product
    }

    /// The firmware reads an entry.
    ///
    /// # Panics
    /// If the product has no such entry.
    pub fn get(&self, index: u16, sub: u8) -> Value {
        self.values[self.own_place(index, sub)].1
    }

    /// The firmware reads a whole number.
    ///
    /// # Panics
    /// If the product has no such entry, or it is a REAL32.
    pub fn integer(&self, index: u16, sub: u8) -> i64 {
        self.get(index, sub).as_integer().unwrap_or_else(|| panic!("{index:04X}h is not a whole number"))
    }

    /// The firmware reads a number.
    ///
    /// # Panics
    /// If the product has no such entry.
    pub fn number(&self, index: u16, sub: u8) -> f64 {
        self.get(index, sub).as_f64()
    }

    /// The firmware sets an entry, whatever its access and limits.
    ///
    /// # Panics
    /// If the product has no such entry, or it is of another type.
    pub fn set(&mut self, index: u16, sub: u8, value: Value) {
        let place = self.own_place(index, sub);
        let present = &mut self.values[place].1;
        assert_eq!(present.data_type(), value.data_type(), "{index:04X}h sub-index {sub}");
        *present = value;
    }

    /// The network reads an entry.
    ///
    /// # Errors
    /// If there is no such object or entry.
    pub fn read(&self, at: ObjectAddress) -> Result<Value, Abort> {
        self.find(at).map(|(place, _)| self.values[place].1)
    }

    /// The network writes an entry, with the bytes as they are on the bus. After a refusal nothing has changed.
    ///
    /// # Errors
    /// With the reason, checked in this order: object, entry, access, length, value.
    pub fn write(&mut self, at: ObjectAddress, data: &[u8]) -> Result<Effect, Abort> {
        let (place, entry) = self.find(at)?;
        if entry.access == Access::ReadOnly || self.is_locked(at) {
            return Err(Abort::ReadOnly);
        }
        let value = match data.len().cmp(&entry.data_type.bytes()) {
            std::cmp::Ordering::Greater => return Err(Abort::TooLong),
            std::cmp::Ordering::Less => return Err(Abort::TooShort),
            std::cmp::Ordering::Equal => entry.data_type.decode(data).ok_or(Abort::ValueRange)?,
        };
        if !value.as_f64().is_finite() {
            return Err(Abort::ValueRange); // Errata E-30.
        }
        match at.index {
            0x1010 => return signature(value, SAVE).map(|()| Effect::Save(group(at.sub))),
            0x1011 => return signature(value, LOAD).map(|()| Effect::Restore(group(at.sub))),
            0x1003 if value.as_integer() == Some(0) => return Ok(Effect::ClearErrors),
            0x1003 => return Err(Abort::ValueRange), // Errata E-02.
            _ => {}
        }
        self.check_limits(entry, value)?;
        match (at.index, at.sub) {
            (0x1016, _) => self.check_consumer(at, value)?,
            (0x1400..=0x1403 | 0x1800..=0x1803, 1) => pdo::check_cob_id(self.values[place].1, value)?,
            (0x1A00..=0x1A03, _) => self.check_mapping(at, value)?,
            _ => {}
        }
        self.values[place].1 = value;
        match at.index {
            0x3000 => self.load_constants(at.sub),
            0x6112 => self.follow_modes(),
            _ => {}
        }
        Ok(Effect::None)
    }

    fn place(&self, at: ObjectAddress) -> Option<usize> {
        // In one number, which compares in a step: the firmware looks entries up all the time.
        let key = |at: ObjectAddress| u32::from(at.index) << 8 | u32::from(at.sub);
        self.values.binary_search_by_key(&key(at), |(at, _)| key(*at)).ok()
    }

    fn own_place(&self, index: u16, sub: u8) -> usize {
        let at = ObjectAddress::new(index, sub);
        self.place(at).unwrap_or_else(|| panic!("{} has no entry {at}", self.product.name))
    }

    fn find(&self, at: ObjectAddress) -> Result<(usize, &'static Entry), Abort> {
        let object = self.product.dictionary.object(at.index).ok_or(Abort::NoSuchObject)?;
        let entry = object.entry(at.sub).ok_or(Abort::NoSuchEntry)?;
        Ok((self.own_place(at.index, at.sub), entry))
    }

    /// The constants of a curve can be written only while the channel has a curve of its own (AXRTD8CO manual, section
    /// 3.4.9; errata E-B26).
    fn is_locked(&self, at: ObjectAddress) -> bool {
        let constants = self.product.measurement.sensors == SensorKind::Rtd
            && matches!(at.index, 0x3010 | 0x3020 | 0x3030)
            && at.sub > 0;
        constants && self.integer(0x3000, at.sub) != 0
    }

    fn check_limits(&self, entry: &Entry, value: Value) -> Result<(), Abort> {
        let limits = &entry.limits;
        if limits.values.contains(&value) {
            return Ok(());
        }
        if limits.low.is_none() && limits.high.is_none() {
            return if limits.values.is_empty() { Ok(()) } else { Err(Abort::ValueRange) };
        }
        let bound = |bound: Bound| match bound {
            Bound::Value(value) => value.as_f64(),
            Bound::Entry { at, offset } => self.number(at.index, at.sub) + offset as f64,
        };
        let number = value.as_f64();
        if limits.low.is_some_and(|low| number < bound(low)) {
            return Err(Abort::TooLow);
        }
        if limits.high.is_some_and(|high| number > bound(high)) {
            return Err(Abort::TooHigh);
        }
        Ok(())
    }

    /// A node is watched by one entry only (CiA 301, object 1016h).
    fn check_consumer(&self, at: ObjectAddress, value: Value) -> Result<(), Abort> {
        let node = |value: Value| {
            let bits = value.as_integer().unwrap_or_default();
            (bits & 0xFFFF != 0).then_some(bits >> 16 & 0x7F).filter(|&node| node != 0)
        };
        let taken = self.values.iter().any(|(other, present)| {
            other.index == at.index && other.sub != 0 && other.sub != at.sub && node(*present) == node(value)
        });
        if taken && node(value).is_some() { Err(Abort::Incompatible) } else { Ok(()) }
    }

    /// A curve's constants follow the choice of the curve; the user's own stay as they are (errata E-B27).
    fn load_constants(&mut self, channel: u8) {
        if let Some(constants) = rtd_curve::coefficients(self.integer(0x3000, channel)) {
            for (index, constant) in [0x3010, 0x3020, 0x3030].into_iter().zip(constants) {
                self.set(index, channel, Value::Real32(constant));
            }
        }
    }

    /// The sampling rate of the RTD scanner follows the number of channels that are on: 100 ms each, and 100 for the
    /// current source (AXRTD8CO manual, section 3.3.4; errata E-C7, E-C8).
    fn follow_modes(&mut self) {
        if self.product.measurement.sensors != SensorKind::Rtd {
            return;
        }
        let channels = self.product.measurement.channels;
        let active = (1..=channels).filter(|&channel| self.integer(0x6112, channel) != 0).count() as u32;
        for channel in 1..=channels {
            self.set(0x6114, channel, Value::Unsigned32(100 * (active + 1)));
        }
    }
}

/// Whether an entry is kept by 1010h: what can be written, but the list of errors and the two commands.
pub fn is_parameter(at: ObjectAddress, entry: &Entry) -> bool {
    // The constants follow 3000h and are kept with it, whether or not they can be written at the moment.
    entry.access == Access::ReadWrite && !matches!(at.index, 0x1003 | 0x1010 | 0x1011) && Group::of(at.index).is_some()
}

fn signature(value: Value, expected: u32) -> Result<(), Abort> {
    if value == Value::Unsigned32(expected) { Ok(()) } else { Err(Abort::CannotStore) }
}

/// The group of a sub-index of 1010h and 1011h; `None` for all (errata E-91).
fn group(sub: u8) -> Option<Group> {
    match sub {
        2 => Some(Group::Communication),
        3 => Some(Group::Application),
        4 => Some(Group::Manufacturer),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::DataType;

    fn product(name: &str) -> &'static Product {
        Product::named(name).expect("built in")
    }

    pub(super) fn tc4() -> Objects {
        Objects::factory(product("AXTC4CO"), 127)
    }

    fn rtd8() -> Objects {
        Objects::factory(product("AXRTD8CO"), 127)
    }

    pub(super) fn at(index: u16, sub: u8) -> ObjectAddress {
        ObjectAddress::new(index, sub)
    }

    pub(super) fn write(objects: &mut Objects, index: u16, sub: u8, number: f64) -> Result<Effect, Abort> {
        let data_type = objects.get(index, sub).data_type();
        let value = match data_type {
            DataType::Real32 => Value::Real32(number as f32),
            _ => data_type.integer(number as i64).expect("a value of the type"),
        };
        objects.write(at(index, sub), &value.encode())
    }

    // B-003, B-8, B-7, B-074, B-38
    #[test]
    fn each_violation_has_its_own_refusal() {
        let mut objects = tc4();
        assert_eq!(objects.read(at(0x1005, 0)), Err(Abort::NoSuchObject));
        assert_eq!(objects.read(at(0x6100, 5)), Err(Abort::NoSuchEntry));
        let refusals = [
            (at(0x1005, 0), &[0u8, 0, 0, 0][..], Abort::NoSuchObject),
            (at(0x6126, 5), &[0, 0, 0, 0], Abort::NoSuchEntry),
            (at(0x6100, 1), &[0, 0, 0, 0], Abort::ReadOnly),
            (at(0x6126, 0), &[4], Abort::ReadOnly),
            (at(0x1020, 1), &[0, 0, 0, 0], Abort::ReadOnly),
            (at(0x6126, 1), &[0, 0, 0], Abort::TooShort),
            (at(0x6126, 1), &[], Abort::TooShort),
            (at(0x6126, 1), &[0, 0, 0, 0, 0], Abort::TooLong),
            (at(0x6126, 1), &[0xFF, 0xFF, 0xFF, 0xFF], Abort::ValueRange),
            (at(0x6126, 1), &f32::INFINITY.to_le_bytes(), Abort::ValueRange),
            (at(0x5555, 0), &[2], Abort::ValueRange),
            (at(0x5010, 0), &[55], Abort::ValueRange),
            (at(0x6110, 1), &[3, 0], Abort::ValueRange),
            (at(0x1003, 0), &[1], Abort::ValueRange),
            (at(0x1017, 0), &[9, 0], Abort::TooLow),
            (at(0x4030, 1), &60_001u16.to_le_bytes(), Abort::TooHigh),
            (at(0x1010, 1), b"load", Abort::CannotStore),
            (at(0x1011, 1), b"save", Abort::CannotStore),
            (at(0x1010, 1), b"savex", Abort::TooLong),
        ];
        for (at, data, abort) in refusals {
            let before = objects.values.clone();
            assert_eq!(objects.write(at, data), Err(abort), "{at} <- {data:02X?}");
            assert_eq!(objects.values, before, "{at}: a refused write changes nothing");
        }
    }

    // B-075, B-9, B-31, B-40, B-60, B-068, B-095
    #[test]
    fn every_writable_entry_takes_both_its_limits_and_nothing_beyond() {
        for name in ["AXTC4CO", "AXRTD8CO"] {
            let factory = Objects::factory(product(name), 127);
            let mut checked = 0;
            for (at, _, entry) in product(name).dictionary.entries() {
                let constant = |bound: Option<Bound>| match bound {
                    Some(Bound::Value(value)) => Some(value),
                    Some(Bound::Entry { .. }) | None => None,
                };
                let special = matches!(at.index, 0x1003 | 0x1A00..=0x1A03);
                if entry.access == Access::ReadOnly || special || factory.is_locked(at) {
                    continue;
                }
                for (bound, beyond, abort) in
                    [(entry.limits.low, -1.0, Abort::TooLow), (entry.limits.high, 1.0, Abort::TooHigh)]
                {
                    let Some(limit) = constant(bound) else { continue };
                    let mut objects = factory.clone();
                    assert_eq!(objects.write(at, &limit.encode()), Ok(Effect::None), "{name} {at} <- {limit}");
                    assert_eq!(objects.read(at), Ok(limit));
                    let outside = match limit {
                        Value::Real32(value) => Some(Value::Real32(value * 1.000_001)),
                        _ => limit.data_type().integer(limit.as_integer().unwrap_or_default() + beyond as i64),
                    };
                    if let Some(outside) = outside.filter(|outside| !entry.limits.values.contains(outside)) {
                        assert_eq!(objects.write(at, &outside.encode()), Err(abort), "{name} {at} <- {outside}");
                        assert_eq!(objects.read(at), Ok(limit), "{name} {at} keeps its value");
                        checked += 1;
                    }
                }
                for &value in &entry.limits.values {
                    assert_eq!(factory.clone().write(at, &value.encode()), Ok(Effect::None), "{name} {at} <- {value}");
                }
            }
            assert!(checked > 50, "{name}: {checked} limits");
        }
    }

    // B-099, B-62
    #[test]
    fn thresholds_keep_ten_degrees_between_them() {
        for mut objects in [tc4(), rtd8()] {
            for (index, taken, refused) in [
                (0x4000, &[1150.0, -2730.0][..], &[(1151.0, Abort::TooHigh), (-2731.0, Abort::TooLow)][..]),
                (0x4010, &[-100.0, 2400.0], &[(-101.0, Abort::TooLow), (2401.0, Abort::TooHigh)]),
                (0x4020, &[1350.0, 17_350.0], &[(1349.0, Abort::TooLow), (17_351.0, Abort::TooHigh)]),
            ] {
                let before = objects.number(index, 1);
                for &number in taken {
                    assert_eq!(write(&mut objects, index, 1, number), Ok(Effect::None), "{index:04X}h <- {number}");
                }
                for &(number, abort) in refused {
                    assert_eq!(write(&mut objects, index, 1, number), Err(abort), "{index:04X}h <- {number}");
                }
                assert_eq!(write(&mut objects, index, 1, before), Ok(Effect::None));
            }
            // Moving all three up goes from the highest, down from the lowest.
            assert_eq!(write(&mut objects, 0x4010, 2, 2450.0), Err(Abort::TooHigh));
            for (index, number) in [(0x4020, 3000.0), (0x4010, 2450.0), (0x4000, 2000.0)] {
                assert_eq!(write(&mut objects, index, 2, number), Ok(Effect::None));
            }
        }
    }

    // B-145
    #[test]
    fn a_node_is_watched_by_one_entry() {
        let mut objects = tc4();
        assert_eq!(write(&mut objects, 0x1016, 1, f64::from(0x0005_0064)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1016, 2, f64::from(0x0005_0032)), Err(Abort::Incompatible));
        assert_eq!(write(&mut objects, 0x1016, 1, f64::from(0x0005_0065)), Ok(Effect::None), "its own may change");
        assert_eq!(write(&mut objects, 0x1016, 2, 0.0), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1016, 3, 0.0), Ok(Effect::None), "unused ones are alike");
        assert_eq!(write(&mut objects, 0x1016, 3, f64::from(0x0105_0064)), Err(Abort::TooHigh));
    }

    // B-23, B-25, B-26, B-27
    #[test]
    fn a_curve_loads_its_constants_and_only_the_users_own_can_be_written() {
        let mut objects = rtd8();
        let constants = |objects: &Objects| [0x3010, 0x3020, 0x3030].map(|index| objects.get(index, 3));
        assert_eq!(write(&mut objects, 0x3010, 3, 4.0), Err(Abort::ReadOnly));
        for (selected, expected) in [
            (2, [3.974_673, -5.8973, -4.353]),
            (5, [3.981_531, -5.853_116, -4.354_53]),
            (1, [3.9083, -5.775, -4.183_01]),
        ] {
            assert_eq!(write(&mut objects, 0x3000, 3, f64::from(selected)), Ok(Effect::None));
            assert_eq!(constants(&objects), expected.map(Value::Real32));
        }
        let before = constants(&objects);
        assert_eq!(write(&mut objects, 0x3000, 3, 0.0), Ok(Effect::None));
        assert_eq!(constants(&objects), before, "0 leaves them as they are");
        for limit in [-9.9f32, 9.9] {
            assert_eq!(objects.write(at(0x3020, 3), &limit.to_le_bytes()), Ok(Effect::None));
        }
        assert_eq!(write(&mut objects, 0x3020, 3, 9.91), Err(Abort::TooHigh));
        assert_eq!(write(&mut objects, 0x3010, 4, 1.0), Err(Abort::ReadOnly), "another channel");
        assert_eq!(write(&mut objects, 0x3000, 3, 6.0), Err(Abort::TooHigh));
    }

    // B-36
    #[test]
    fn the_sampling_rate_follows_the_channels_that_are_on() {
        let mut objects = rtd8();
        for (off, expected) in (0..=8u8).zip([900u32, 800, 700, 600, 500, 400, 300, 200, 100]) {
            if off > 0 {
                assert_eq!(write(&mut objects, 0x6112, off, 0.0), Ok(Effect::None));
            }
            for channel in 1..=8 {
                assert_eq!(objects.get(0x6114, channel), Value::Unsigned32(expected));
            }
        }
        let mut objects = tc4();
        assert_eq!(write(&mut objects, 0x6112, 1, 0.0), Ok(Effect::None));
        assert_eq!(objects.get(0x6114, 4), Value::Unsigned32(200_000), "B-060: fixed, errata E-07");
    }

    // B-052, B-124
    #[test]
    fn identifiers_nobody_has_changed_follow_the_node_id() {
        let mut objects = tc4();
        assert_eq!(write(&mut objects, 0x1801, 1, f64::from(0xC000_02FFu32)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1801, 1, f64::from(0x4000_0300)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x6126, 2, 18.0), Ok(Effect::None));
        let saved = objects.deviations(127);
        assert_eq!(saved, [(at(0x1801, 1), Value::Unsigned32(0x4000_0300)), (at(0x6126, 2), Value::Real32(18.0))]);
        let moved = Objects::with_saved(product("AXTC4CO"), 0x20, &saved);
        let cob_ids: Vec<i64> = (0x1800..=0x1803).chain(0x1400..=0x1403).map(|index| moved.integer(index, 1)).collect();
        let expected =
            [0x4000_01A0u32, 0x4000_0300, 0xC000_03A0, 0xC000_04A0, 0xC000_0220, 0xC000_0320, 0xC000_0420, 0xC000_0520];
        assert_eq!(cob_ids, expected.map(i64::from));
        assert_eq!(moved.get(0x6126, 2), Value::Real32(18.0));
    }

    // B-151, B-152, B-153, B-154, B-111, B-113, B-115, B-116
    #[test]
    fn signatures_name_the_group_to_save_or_to_restore() {
        for mut objects in [tc4(), rtd8()] {
            let groups = [None, Some(Group::Communication), Some(Group::Application), Some(Group::Manufacturer)];
            for (sub, group) in (1..).zip(groups) {
                assert_eq!(objects.write(at(0x1010, sub), b"save"), Ok(Effect::Save(group)));
                assert_eq!(objects.write(at(0x1011, sub), b"load"), Ok(Effect::Restore(group)));
                for index in [0x1010, 0x1011] {
                    assert_eq!(objects.read(at(index, sub)), Ok(Value::Unsigned32(1)));
                    assert_eq!(objects.write(at(index, sub), b"SAVE"), Err(Abort::CannotStore));
                }
            }
            assert_eq!(objects.write(at(0x1003, 0), &[0]), Ok(Effect::ClearErrors));
        }
    }

    #[test]
    fn what_is_kept_of_another_product_or_type_is_left_out() {
        let kept = vec![
            (at(0x3000, 1), Value::Unsigned16(2)),
            (at(0x6126, 1), Value::Unsigned8(1)),
            (at(0x6126, 3), Value::Real32(2.0)),
            (at(0x6110, 1), Value::Unsigned16(3)),
            (at(0x6126, 4), Value::NOT_A_NUMBER),
            (at(0x6127, 4), Value::Real32(1e9)),
        ];
        let objects = Objects::with_saved(product("AXTC4CO"), 127, &kept);
        assert_eq!(objects.deviations(127), [(at(0x6126, 3), Value::Real32(2.0))]);
    }
}
