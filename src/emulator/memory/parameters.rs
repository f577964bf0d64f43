//! Non-volatile parameters: what the unit remembers on its own.
//!
//! Two slots of fixed size take turns. A change is written to the slot that does not hold the current values, and
//! counts only once its CRC is right, so whatever byte a power cut or a crash of the host stops at, the unit finds
//! the old values or the new ones. Layout of a slot, numbers low byte first:
//!
//! | offset | bytes | |
//! |---|---|---|
//! | 0 | 4 | `AXNV` |
//! | 4 | 2 | format, 3; 2 is read as well, it has no serial number |
//! | 6 | 2 | bytes of the values |
//! | 8 | 4 | sequence number; the higher of two good slots is the current one |
//! | 12 | 4 | product code, object 1018h sub-index 2 |
//! | 16 | 10 | stream on, stream source (0 FV, 1 PV), period in ms (2), node-ID, 0, bit rate in kbit/s (2), start delay (0 at once, FFh waits for ever), first start pending |
//! | 26 | 4 | serial number, object 1018h sub-index 4; FFFFFFFFh if none has been given yet |
//! | 30 | 2 | number of kept parameters |
//! | 32 | 4 + n each | index (2), sub-index, bytes n of the value, the value |
//! | then | 4 | CRC-32 (IEEE 802.3) of all before |
//! | then | | not looked at, to the end of the slot |
//!
//! Kept parameters are those of the object dictionary that have been saved by 1010h and differ from the factory's
//! (AXTC4CO manual, sections 3.2.7 and 3.2.8). Stream settings, node-ID, bit rate and serial number are kept on their
//! own and no restoring touches them (sections 4.1.2 and 4.1.3, errata E-106).

use std::collections::VecDeque;

use super::super::objects::{Objects, Saved, is_parameter};
use super::super::{Area, Store};
use crate::canopen::ObjectAddress;
use crate::device::dictionary::Group;
use crate::device::{BIT_RATES_KBPS, HIGHEST_NODE_ID, Product};
use crate::time::Duration;
use crate::wire::stream::Source;

/// Bytes of the whole image: two slots.
pub const IMAGE_BYTES: usize = 2 * SLOT_BYTES;

const SLOT_BYTES: usize = 2048;
const MAGIC: &[u8; 4] = b"AXNV";
const FORMAT: u16 = 3;
/// The format before: without the serial number.
const FORMAT_2: u16 = 2;
/// Stands for a serial number that has not been given yet, as erased memory reads.
const NO_SERIAL_NUMBER: u32 = u32::MAX;
const HEADER_BYTES: usize = 16;
const SCALAR_BYTES: usize = 10;
const CRC_BYTES: usize = 4;
/// Repetition time from the factory (errata E-105).
const FACTORY_PERIOD_MS: u16 = 1_000;
const BLANK: u8 = 0xFF;

/// What the unit remembers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// The RS-232 stream (AXTC4CO manual, section 4.1.3).
    pub stream: StreamSetting,
    /// CANopen node-ID; restoring defaults does not touch it (section 4.1.2).
    pub node_id: u8,
    /// CAN bit rate in kbit/s; restoring defaults does not touch it.
    pub kbps: u16,
    /// What the loader does when power comes.
    pub start_delay: StartDelay,
    /// New software has been loaded and has not run yet.
    pub first_start: bool,
    /// Serial number, given once and kept for ever (section 3.2.11). `None` in a memory that is blank, or that an older
    /// version of this program has written.
    pub serial_number: Option<u32>,
    /// Saved parameters of the object dictionary that differ from the factory's.
    pub saved: Saved,
}

/// Settings of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSetting {
    /// Whether rows are sent.
    pub on: bool,
    /// Which value they carry.
    pub source: Source,
    /// Repetition time in ms, within what the product takes.
    pub period_ms: u16,
}

impl StreamSetting {
    /// Time from one row to the next.
    pub fn period(self) -> Duration {
        Duration::from_millis(u64::from(self.period_ms))
    }
}

/// What the loader does when power comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartDelay {
    /// Starts the application, if there is a good one.
    AtOnce,
    /// Waits for a file: a load has begun and not ended.
    WaitsForEver,
}

/// Why stored parameters cannot be used. A unit with such a memory runs on its factory settings.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParametersError {
    /// The image is not two slots long.
    #[error("the parameter memory has {0} bytes, not {IMAGE_BYTES}")]
    Length(usize),
    /// No slot has the right CRC.
    #[error("neither slot of the parameter memory is intact")]
    Corrupt,
    /// The newest intact slot was written by some other version of this program.
    #[error("the parameter memory has format {0}, not {FORMAT}")]
    Format(u16),
    /// The newest intact slot holds a value that cannot be.
    #[error("the {0} in the parameter memory makes no sense")]
    Value(&'static str),
    /// The memory is that of another product.
    #[error("the parameter memory is of {}, not of {expected}", found.as_deref().unwrap_or("an unknown product"))]
    Product {
        /// Whose it is, where that is known.
        found: Option<String>,
        /// Whose it should be.
        expected: String,
    },
}

impl Parameters {
    /// As the product leaves the factory.
    pub fn factory(product: &Product) -> Self {
        Parameters {
            stream: StreamSetting { on: false, source: Source::FieldValue, period_ms: FACTORY_PERIOD_MS },
            node_id: product.can.node_id,
            kbps: product.can.kbps,
            start_delay: StartDelay::AtOnce,
            first_start: false,
            serial_number: None,
            saved: Saved::new(),
        }
    }

    /// Reads an image as [`Unit::parameters`](super::super::Unit::parameters) gave it. An empty or blank one is a
    /// unit fresh from the factory.
    ///
    /// # Errors
    /// If the image cannot be used; the unit itself would then run on its factory settings.
    pub fn read(product: &Product, image: &[u8]) -> Result<Self, ParametersError> {
        if image.iter().all(|&byte| byte == BLANK) {
            return Ok(Parameters::factory(product));
        }
        let (_, slot) = newest(image)?;
        Parameters::from_slot(product, slot)
    }

    /// Reads an intact slot.
    fn from_slot(product: &Product, slot: &[u8]) -> Result<Self, ParametersError> {
        let format = u16_at(slot, 4);
        if ![FORMAT, FORMAT_2].contains(&format) {
            return Err(ParametersError::Format(format));
        }
        let code = u32_at(slot, 12);
        if code != product.can.product_code {
            let found = Product::all().iter().find(|other| other.can.product_code == code);
            return Err(ParametersError::Product {
                found: found.map(|other| other.name.clone()),
                expected: product.name.clone(),
            });
        }
        let (values, kept) = slot[HEADER_BYTES..HEADER_BYTES + payload_length(slot)]
            .split_first_chunk::<SCALAR_BYTES>()
            .ok_or(ParametersError::Value("length"))?;
        let (serial_number, kept) = match format {
            FORMAT_2 => (None, kept),
            _ => {
                let (number, kept) = kept.split_first_chunk().ok_or(ParametersError::Value("length"))?;
                (Some(u32::from_le_bytes(*number)).filter(|&number| number != NO_SERIAL_NUMBER), kept)
            }
        };
        let flag = |value: u8, name| match value {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(ParametersError::Value(name)),
        };
        let source = if flag(values[1], "stream source")? { Source::ProcessValue } else { Source::FieldValue };
        let period_ms = u16_at(values, 2);
        let (shortest, longest) = product.measurement.stream_period_ms;
        if !(shortest..=longest).contains(&period_ms) {
            return Err(ParametersError::Value("stream period"));
        }
        if !(1..=HIGHEST_NODE_ID).contains(&values[4]) {
            return Err(ParametersError::Value("node-ID"));
        }
        let kbps = u16_at(values, 6);
        if !BIT_RATES_KBPS.contains(&kbps) {
            return Err(ParametersError::Value("bit rate"));
        }
        let start_delay = match values[8] {
            0 => StartDelay::AtOnce,
            0xFF => StartDelay::WaitsForEver,
            _ => return Err(ParametersError::Value("start delay")),
        };
        Ok(Parameters {
            stream: StreamSetting { on: flag(values[0], "stream switch")?, source, period_ms },
            node_id: values[4],
            kbps,
            start_delay,
            first_start: flag(values[9], "first-start flag")?,
            serial_number,
            saved: read_saved(product, kept).ok_or(ParametersError::Value("list of saved parameters"))?,
        })
    }

    /// The used part of a slot.
    fn to_slot(&self, product: &Product, sequence: u32) -> Vec<u8> {
        let mut values = Vec::new();
        values.push(u8::from(self.stream.on));
        values.push(match self.stream.source {
            Source::FieldValue => 0,
            Source::ProcessValue => 1,
        });
        values.extend(self.stream.period_ms.to_le_bytes());
        values.extend([self.node_id, 0]);
        values.extend(self.kbps.to_le_bytes());
        values.push(match self.start_delay {
            StartDelay::AtOnce => 0,
            StartDelay::WaitsForEver => 0xFF,
        });
        values.push(u8::from(self.first_start));
        values.extend(self.serial_number.unwrap_or(NO_SERIAL_NUMBER).to_le_bytes());
        values.extend((self.saved.len() as u16).to_le_bytes());
        for (at, value) in &self.saved {
            let bytes = value.encode();
            values.extend(at.index.to_le_bytes());
            values.extend([at.sub, bytes.len() as u8]);
            values.extend(bytes);
        }
        let mut slot = MAGIC.to_vec();
        slot.extend(FORMAT.to_le_bytes());
        slot.extend((values.len() as u16).to_le_bytes());
        slot.extend(sequence.to_le_bytes());
        slot.extend(product.can.product_code.to_le_bytes());
        slot.extend(values);
        let crc = crc32fast::hash(&slot);
        slot.extend(crc.to_le_bytes());
        slot
    }
}

/// Reads the list of saved parameters, which is in order and names each once: so what is saved next has room, whatever
/// was there. Entries that are not parameters of the product are left out: the list may be from another version of its
/// dictionary.
fn read_saved(product: &Product, bytes: &[u8]) -> Option<Saved> {
    let (count, mut rest) = bytes.split_first_chunk::<2>()?;
    let mut saved = Saved::new();
    let mut last = None;
    for _ in 0..u16::from_le_bytes(*count) {
        let (head, after) = rest.split_first_chunk::<4>()?;
        let (value, after) = after.split_at_checked(usize::from(head[3]))?;
        let at = ObjectAddress::new(u16::from_le_bytes([head[0], head[1]]), head[2]);
        if last.replace(at).is_some_and(|last| last >= at) {
            return None;
        }
        let parameter = product.dictionary.entry(at).filter(|entry| is_parameter(at, entry));
        let known = parameter.and_then(|entry| entry.data_type.decode(value));
        saved.extend(known.map(|value| (at, value)));
        rest = after;
    }
    rest.is_empty().then_some(saved)
}

/// The memory with the values in it.
#[derive(Debug)]
pub struct ParameterStore {
    product: &'static Product,
    image: Vec<u8>,
    values: Parameters,
}

impl ParameterStore {
    /// Takes over an image. One that is empty or cannot be used is replaced by factory settings, which are reported
    /// as a write like any other. A memory that has no serial number gets this one.
    pub fn new(product: &'static Product, serial_number: u32, image: Vec<u8>, stores: &mut VecDeque<Store>) -> Self {
        if let Ok(values) = Parameters::read(product, &image)
            && newest(&image).is_ok()
        {
            let mut store = ParameterStore { product, image, values };
            store.change(stores, |values| values.serial_number = values.serial_number.or(Some(serial_number)));
            return store;
        }
        let values = Parameters { serial_number: Some(serial_number), ..Parameters::factory(product) };
        let mut image = values.to_slot(product, 1);
        image.resize(IMAGE_BYTES, BLANK);
        stores.push_back(Store { area: Area::Parameters, offset: 0, bytes: image.clone() });
        ParameterStore { product, image, values }
    }

    /// The image.
    pub fn image(&self) -> &[u8] {
        &self.image
    }

    /// The values.
    pub fn values(&self) -> &Parameters {
        &self.values
    }

    /// Changes values: into the slot that does not hold the current ones. Nothing is written if nothing changes.
    pub fn change(&mut self, stores: &mut VecDeque<Store>, change: impl FnOnce(&mut Parameters)) {
        let mut values = self.values.clone();
        change(&mut values);
        if values == self.values {
            return;
        }
        self.values = values;
        let (slot, sequence) = match newest(&self.image) {
            Ok((current, bytes)) => (1 - current, u32_at(bytes, 8).wrapping_add(1)),
            Err(_) => (0, 1),
        };
        let offset = slot * SLOT_BYTES;
        let bytes = self.values.to_slot(self.product, sequence);
        self.image[offset..offset + bytes.len()].copy_from_slice(&bytes);
        stores.push_back(Store { area: Area::Parameters, offset, bytes });
    }

    /// Keeps the present parameters of a group, or of all; the other groups stay as they are kept (1010h).
    pub fn save(&mut self, stores: &mut VecDeque<Store>, group: Option<Group>, objects: &Objects) {
        self.change(stores, |values| {
            let present = objects.deviations(values.node_id);
            values.saved.retain(|(at, _)| !belongs(*at, group));
            values.saved.extend(present.into_iter().filter(|(at, _)| belongs(*at, group)));
            values.saved.sort_by_key(|(at, _)| *at);
        });
    }

    /// Forgets what is kept of a group, or of all (1011h).
    pub fn restore(&mut self, stores: &mut VecDeque<Store>, group: Option<Group>) {
        self.change(stores, |values| values.saved.retain(|(at, _)| !belongs(*at, group)));
    }

    /// The object dictionary as the unit starts with it.
    pub fn objects(&self) -> Objects {
        Objects::with_saved(self.product, self.values.node_id, &self.values.saved)
    }
}

fn belongs(at: ObjectAddress, group: Option<Group>) -> bool {
    group.is_none_or(|group| Group::of(at.index) == Some(group))
}

/// Bytes of a slot's values, never more than fit.
fn payload_length(slot: &[u8]) -> usize {
    usize::from(u16_at(slot, 6)).min(SLOT_BYTES - HEADER_BYTES - CRC_BYTES)
}

/// Number and bytes of the current slot: of the intact ones that with the higher sequence number.
fn newest(image: &[u8]) -> Result<(usize, &[u8]), ParametersError> {
    if image.len() != IMAGE_BYTES {
        return Err(ParametersError::Length(image.len()));
    }
    let mut intact = image.chunks_exact(SLOT_BYTES).enumerate().filter(|(_, slot)| {
        let crc_at = HEADER_BYTES + payload_length(slot);
        &slot[0..4] == MAGIC && crc32fast::hash(&slot[..crc_at]) == u32_at(slot, crc_at)
    });
    let first = intact.next().ok_or(ParametersError::Corrupt)?;
    // A difference of more than half the range means the counter has run over.
    let is_newer = |later: &[u8], earlier: &[u8]| u32_at(later, 8).wrapping_sub(u32_at(earlier, 8)) < u32::MAX / 2;
    Ok(match intact.next() {
        Some(second) if is_newer(second.1, first.1) => second,
        _ => first,
    })
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::Value;
    use crate::rng::Rng;

    const SERIAL_NUMBER: u32 = 4711;

    fn product() -> &'static Product {
        Product::named("AXTC4CO").expect("built in")
    }

    fn fresh() -> (ParameterStore, VecDeque<Store>) {
        let mut stores = VecDeque::new();
        let store = ParameterStore::new(product(), SERIAL_NUMBER, Vec::new(), &mut stores);
        (store, stores)
    }

    fn rtd8() -> &'static Product {
        Product::named("AXRTD8CO").expect("built in")
    }

    /// Something a user, the network or the loader may do to the memory.
    fn disturb(memory: &mut ParameterStore, objects: &mut Objects, chance: &mut Rng, stores: &mut VecDeque<Store>) {
        let groups = [None, Some(Group::Communication), Some(Group::Application), Some(Group::Manufacturer)];
        let group = groups[chance.below(4) as usize];
        match chance.below(6) {
            0 => memory.change(stores, |values| {
                values.stream.on = chance.chance(50);
                values.stream.period_ms = 100 + chance.below(1_000) as u16;
            }),
            1 => memory.change(stores, |values| {
                values.node_id = 1 + chance.below(127) as u8;
                values.first_start = chance.chance(50);
            }),
            2 => memory.restore(stores, group),
            _ => {
                for _ in 0..chance.below(8) {
                    let channel = 1 + chance.below(4) as u8;
                    let value = Value::Real32(chance.below(20_000) as f32 / 10.0 - 1_000.0);
                    let index = [0x6126, 0x6127, 0x2126][chance.below(3) as usize];
                    let _ = objects.write(ObjectAddress::new(index, channel), &value.encode());
                }
                memory.save(stores, group, objects);
            }
        }
    }

    // B-157, B-150: the power may go at any byte of any write.
    #[test]
    fn whatever_byte_a_cut_stops_at_the_values_are_old_or_new() {
        for (seed, product) in (0..6).flat_map(|seed| [(seed, product()), (seed, rtd8())]) {
            let mut chance = Rng::new(seed);
            let mut stores = VecDeque::new();
            let mut memory = ParameterStore::new(product, SERIAL_NUMBER, Vec::new(), &mut stores);
            let mut objects = memory.objects();
            stores.clear();
            for round in 0..12 {
                let before = memory.image().to_vec();
                let old = memory.values().clone();
                disturb(&mut memory, &mut objects, &mut chance, &mut stores);
                let new = memory.values().clone();
                assert!(stores.len() <= 1, "a change is one write");
                let Some(store) = stores.pop_front() else {
                    assert_eq!(old, new);
                    continue;
                };
                let used = store.bytes.len();
                for cut in 0..=used {
                    let mut image = before.clone();
                    image[store.offset..store.offset + cut].copy_from_slice(&store.bytes[..cut]);
                    let read = Parameters::read(product, &image).expect("an intact slot is left");
                    // What lay there before may have had the same last bytes.
                    let is_new = image[store.offset..store.offset + used] == store.bytes;
                    assert_eq!(read, if is_new { new.clone() } else { old.clone() }, "seed {seed}, {round}, {cut}");
                    // A unit that goes on from here can store again.
                    if cut % 16 == 0 {
                        let mut again = ParameterStore::new(product, 8, image, &mut stores);
                        again.change(&mut stores, |values| values.kbps = 10);
                        stores.clear();
                        let read = Parameters::read(product, again.image()).expect("stored");
                        assert_eq!((read.kbps, read.serial_number), (10, Some(SERIAL_NUMBER)));
                    }
                }
            }
        }
    }

    #[test]
    fn the_largest_set_of_parameters_fits_a_slot() {
        for product in Product::all() {
            let entries = product.dictionary.entries();
            let saved =
                entries.filter(|(_, _, entry)| entry.access == crate::device::dictionary::Access::ReadWrite).map(
                    |(at, _, entry)| (at, entry.data_type.decode(&vec![1; entry.data_type.bytes()]).expect("a value")),
                );
            let all = Parameters { saved: saved.collect(), ..Parameters::factory(product) };
            assert!(all.saved.len() > 80 && all.to_slot(product, 1).len() <= SLOT_BYTES, "{}", product.name);
        }
    }

    #[test]
    fn a_list_that_is_not_in_order_is_refused_and_what_is_no_parameter_is_left_out() {
        let at = |index, sub| ObjectAddress::new(index, sub);
        let read = |saved: Saved| {
            let mut image = Parameters { saved, ..Parameters::factory(product()) }.to_slot(product(), 1);
            image.resize(IMAGE_BYTES, BLANK);
            Parameters::read(product(), &image).map(|values| values.saved)
        };
        let factor = |sub| (at(0x6126, sub), Value::Real32(18.0));
        assert_eq!(read(vec![factor(1), factor(2)]), Ok(vec![factor(1), factor(2)]));
        let refused = Err(ParametersError::Value("list of saved parameters"));
        assert_eq!(read(vec![factor(2), factor(1)]), refused);
        // Nothing of another group takes their place: a save of the others would have no room.
        assert_eq!(read(vec![factor(1); 200]), refused);
        let others = [(at(0x1000, 0), Value::Unsigned32(1)), (at(0x1003, 0), Value::Unsigned8(200))];
        assert_eq!(read(others.into_iter().chain([factor(1)]).collect()), Ok(vec![factor(1)]));
    }

    // B-155, B-116, B-151
    #[test]
    fn a_group_is_saved_and_restored_without_the_others() {
        let (mut memory, mut stores) = fresh();
        let mut objects = memory.objects();
        let at = |index, sub| ObjectAddress::new(index, sub);
        let entries = [
            (at(0x100C, 0), Value::Unsigned16(100), Group::Communication),
            (at(0x6110, 1), Value::Unsigned16(2), Group::Application),
            (at(0x4030, 1), Value::Unsigned16(0), Group::Manufacturer),
        ];
        for (at, value, _) in entries {
            objects.write(at, &value.encode()).expect("within its limits");
        }
        for (_, _, saved_group) in entries {
            memory.restore(&mut stores, None);
            memory.save(&mut stores, Some(saved_group), &objects);
            for (at, value, group) in entries {
                assert_eq!(memory.objects().read(at) == Ok(value), group == saved_group, "{at} with {saved_group:?}");
            }
        }
        memory.save(&mut stores, None, &objects);
        memory.restore(&mut stores, Some(Group::Application));
        let kept: Vec<ObjectAddress> = memory.values().saved.iter().map(|(at, _)| *at).collect();
        assert_eq!(kept, [at(0x100C, 0), at(0x4030, 1)]);
        // E-94: saving after a restore keeps the values that are in use.
        memory.save(&mut stores, None, &objects);
        assert_eq!(memory.objects().read(at(0x6110, 1)), Ok(Value::Unsigned16(2)));
    }

    // B-156, B-117
    #[test]
    fn restoring_touches_neither_node_id_nor_bit_rate_nor_the_stream() {
        let (mut memory, mut stores) = fresh();
        memory.change(&mut stores, |values| {
            (values.node_id, values.kbps, values.stream.on, values.stream.period_ms) = (5, 250, true, 77);
        });
        let before = memory.values().clone();
        memory.restore(&mut stores, None);
        assert_eq!(*memory.values(), before);
    }

    #[test]
    fn a_serial_number_is_given_once_and_an_older_memory_gets_one() {
        let (mut memory, mut stores) = fresh();
        memory.change(&mut stores, |values| values.node_id = 5);
        let image = memory.image().to_vec();
        stores.clear();
        let memory = ParameterStore::new(product(), 8, image.clone(), &mut stores);
        assert_eq!((memory.values().serial_number, memory.image()), (Some(SERIAL_NUMBER), &image[..]));
        assert_eq!(stores.len(), 0, "nothing to write");
        // As format 2 has it: the same without the four bytes.
        let values = Parameters { node_id: 9, ..Parameters::factory(product()) };
        let mut older = values.to_slot(product(), 7);
        older.drain(HEADER_BYTES + SCALAR_BYTES..HEADER_BYTES + SCALAR_BYTES + 4);
        older[4] = 2;
        older[6] -= 4;
        let crc_at = older.len() - CRC_BYTES;
        let crc = crc32fast::hash(&older[..crc_at]);
        older[crc_at..].copy_from_slice(&crc.to_le_bytes());
        older.resize(IMAGE_BYTES, BLANK);
        assert_eq!(Parameters::read(product(), &older), Ok(values.clone()));
        let memory = ParameterStore::new(product(), 8, older, &mut stores);
        assert_eq!(*memory.values(), Parameters { serial_number: Some(8), ..values });
        assert_eq!(stores.pop_front().map(|store| store.offset), Some(SLOT_BYTES), "beside the older one");
    }

    #[test]
    fn a_memory_of_another_product_is_not_taken() {
        let mut stores = VecDeque::new();
        let memory = ParameterStore::new(rtd8(), SERIAL_NUMBER, Vec::new(), &mut stores);
        let error = Parameters::read(product(), memory.image()).expect_err("another product");
        assert_eq!(error.to_string(), "the parameter memory is of AXRTD8CO, not of AXTC4CO");
    }

    #[test]
    fn a_changed_byte_in_one_slot_brings_back_the_other() {
        let (mut memory, mut stores) = fresh();
        let old = memory.values().clone();
        stores.clear();
        memory.change(&mut stores, |values| values.node_id = 5);
        let store = stores.pop_front().expect("one write");
        let image = memory.image().to_vec();
        for at in store.offset..store.offset + store.bytes.len() {
            let mut changed = image.clone();
            changed[at] ^= 0x40;
            assert_eq!(Parameters::read(product(), &changed), Ok(old.clone()), "byte {at}");
            changed[10] ^= 1;
            assert_eq!(Parameters::read(product(), &changed), Err(ParametersError::Corrupt), "byte {at} and the other");
        }
    }

    #[test]
    fn nonsense_is_reported_and_the_unit_runs_on_factory_settings() {
        let factory = Parameters::factory(product());
        let image = |mut slot: Vec<u8>| {
            slot.resize(IMAGE_BYTES, BLANK);
            slot
        };
        let wrong_value = image(Parameters { node_id: 128, ..factory.clone() }.to_slot(product(), 1));
        let wrong_rate = image(Parameters { kbps: 100, ..factory.clone() }.to_slot(product(), 1));
        let mut newer_format = factory.to_slot(product(), 1);
        newer_format[4] = 9;
        let crc_at = newer_format.len() - CRC_BYTES;
        let crc = crc32fast::hash(&newer_format[..crc_at]);
        newer_format[crc_at..].copy_from_slice(&crc.to_le_bytes());
        let cases = [
            (vec![0; 7], ParametersError::Length(7)),
            (vec![0; IMAGE_BYTES], ParametersError::Corrupt),
            (wrong_value, ParametersError::Value("node-ID")),
            (wrong_rate, ParametersError::Value("bit rate")),
            (image(newer_format), ParametersError::Format(9)),
        ];
        for (image, error) in cases {
            assert_eq!(Parameters::read(product(), &image), Err(error));
            let mut stores = VecDeque::new();
            let memory = ParameterStore::new(product(), SERIAL_NUMBER, image, &mut stores);
            assert_eq!(*memory.values(), Parameters { serial_number: Some(SERIAL_NUMBER), ..factory.clone() });
            assert_eq!(stores.pop_front().map(|store| store.bytes), Some(memory.image().to_vec()));
        }
        assert_eq!(Parameters::read(product(), &[]), Ok(factory.clone()));
        assert_eq!(Parameters::read(product(), &[BLANK; IMAGE_BYTES]), Ok(factory));
    }

    #[test]
    fn a_sequence_number_that_runs_over_stays_the_newest() {
        let factory = Parameters::factory(product());
        let mut image = factory.to_slot(product(), u32::MAX);
        image.resize(SLOT_BYTES, BLANK);
        image.extend(Parameters { node_id: 9, ..factory }.to_slot(product(), 0));
        image.resize(IMAGE_BYTES, BLANK);
        assert_eq!(Parameters::read(product(), &image).map(|values| values.node_id), Ok(9));
    }
}
