//! Non-volatile parameters: what the unit remembers on its own.
//!
//! Two slots of fixed size take turns. A change is written to the slot that does not hold the current values, and
//! counts only once its CRC is right, so whatever byte a power cut or a crash of the host stops at, the unit finds
//! the old values or the new ones. Layout of a slot, numbers low byte first:
//!
//! | offset | bytes | |
//! |---|---|---|
//! | 0 | 4 | `AXNV` |
//! | 4 | 2 | format, 1 |
//! | 6 | 2 | bytes of the values, 10 |
//! | 8 | 4 | sequence number; the higher of two good slots is the current one |
//! | 12 | 10 | stream on, stream source (0 FV, 1 PV), period in ms (2), node-ID, 0, bit rate in kbit/s (2), start delay (0 at once, FFh waits for ever), first start pending |
//! | 22 | 4 | CRC-32 (IEEE 802.3) of the 22 bytes before |
//! | 26 | | FFh to the end of the slot |

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use super::super::{Area, Store};
use crate::device::Product;
use crate::wire::stream::Source;

/// Bytes of the whole image: two slots.
pub const IMAGE_BYTES: usize = 2 * SLOT_BYTES;
/// Repetition times of the stream in ms (errata E-105).
pub const PERIOD_MS: RangeInclusive<u16> = 1..=60_000;

const SLOT_BYTES: usize = 512;
const MAGIC: &[u8; 4] = b"AXNV";
const FORMAT: u16 = 1;
const HEADER_BYTES: usize = 12;
const VALUE_BYTES: usize = 10;
const CRC_AT: usize = HEADER_BYTES + VALUE_BYTES;
const USED_BYTES: usize = CRC_AT + 4;
/// Repetition time from the factory (errata E-105).
const FACTORY_PERIOD_MS: u16 = 1_000;
const BLANK: u8 = 0xFF;

/// What the unit remembers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
}

/// Settings of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamSetting {
    /// Whether rows are sent.
    pub on: bool,
    /// Which value they carry.
    pub source: Source,
    /// Repetition time in ms, within [`PERIOD_MS`].
    pub period_ms: u16,
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
        Parameters::from_slot(slot)
    }

    fn from_slot(slot: &[u8]) -> Result<Self, ParametersError> {
        let format = u16_at(slot, 4);
        if format != FORMAT || usize::from(u16_at(slot, 6)) != VALUE_BYTES {
            return Err(ParametersError::Format(format));
        }
        let values = &slot[HEADER_BYTES..CRC_AT];
        let flag = |value: u8, name| match value {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(ParametersError::Value(name)),
        };
        let source = if flag(values[1], "stream source")? { Source::ProcessValue } else { Source::FieldValue };
        let period_ms = u16_at(values, 2);
        if !PERIOD_MS.contains(&period_ms) {
            return Err(ParametersError::Value("stream period"));
        }
        if !(1..=127).contains(&values[4]) {
            return Err(ParametersError::Value("node-ID"));
        }
        let start_delay = match values[8] {
            0 => StartDelay::AtOnce,
            0xFF => StartDelay::WaitsForEver,
            _ => return Err(ParametersError::Value("start delay")),
        };
        Ok(Parameters {
            stream: StreamSetting { on: flag(values[0], "stream switch")?, source, period_ms },
            node_id: values[4],
            kbps: u16_at(values, 6),
            start_delay,
            first_start: flag(values[9], "first-start flag")?,
        })
    }

    fn to_slot(self, sequence: u32) -> Vec<u8> {
        let mut slot = vec![BLANK; SLOT_BYTES];
        slot[0..4].copy_from_slice(MAGIC);
        slot[4..6].copy_from_slice(&FORMAT.to_le_bytes());
        slot[6..8].copy_from_slice(&(VALUE_BYTES as u16).to_le_bytes());
        slot[8..12].copy_from_slice(&sequence.to_le_bytes());
        let values = &mut slot[HEADER_BYTES..CRC_AT];
        values[0] = u8::from(self.stream.on);
        values[1] = match self.stream.source {
            Source::FieldValue => 0,
            Source::ProcessValue => 1,
        };
        values[2..4].copy_from_slice(&self.stream.period_ms.to_le_bytes());
        values[4] = self.node_id;
        values[5] = 0;
        values[6..8].copy_from_slice(&self.kbps.to_le_bytes());
        values[8] = match self.start_delay {
            StartDelay::AtOnce => 0,
            StartDelay::WaitsForEver => 0xFF,
        };
        values[9] = u8::from(self.first_start);
        let crc = crc32fast::hash(&slot[..CRC_AT]);
        slot[CRC_AT..USED_BYTES].copy_from_slice(&crc.to_le_bytes());
        slot
    }
}

/// The memory with the values in it.
#[derive(Debug)]
pub struct ParameterStore {
    image: Vec<u8>,
    values: Parameters,
}

impl ParameterStore {
    /// Takes over an image. One that is empty or cannot be used is replaced by factory settings, which are reported
    /// as a write like any other.
    pub fn new(product: &Product, image: Vec<u8>, stores: &mut VecDeque<Store>) -> Self {
        if let Ok(values) = Parameters::read(product, &image)
            && newest(&image).is_ok()
        {
            return ParameterStore { image, values };
        }
        let values = Parameters::factory(product);
        let mut image = values.to_slot(1);
        image.resize(IMAGE_BYTES, BLANK);
        stores.push_back(Store { area: Area::Parameters, offset: 0, bytes: image.clone() });
        ParameterStore { image, values }
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
        let mut values = self.values;
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
        let bytes = values.to_slot(sequence);
        self.image[offset..offset + SLOT_BYTES].copy_from_slice(&bytes);
        stores.push_back(Store { area: Area::Parameters, offset, bytes });
    }
}

/// Number and bytes of the current slot: of the intact ones that with the higher sequence number.
fn newest(image: &[u8]) -> Result<(usize, &[u8]), ParametersError> {
    if image.len() != IMAGE_BYTES {
        return Err(ParametersError::Length(image.len()));
    }
    let mut intact = image.chunks_exact(SLOT_BYTES).enumerate().filter(|(_, slot)| {
        let length = usize::from(u16_at(slot, 6)).min(SLOT_BYTES - HEADER_BYTES - 4);
        let crc_at = HEADER_BYTES + length;
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

    fn product() -> &'static Product {
        Product::named("AXTC4CO").expect("built in")
    }

    fn fresh() -> (ParameterStore, VecDeque<Store>) {
        let mut stores = VecDeque::new();
        let store = ParameterStore::new(product(), Vec::new(), &mut stores);
        (store, stores)
    }

    #[test]
    fn whatever_byte_a_crash_stops_at_the_values_are_old_or_new() {
        let (mut memory, mut stores) = fresh();
        stores.clear();
        for round in 0..6u16 {
            let before = memory.image().to_vec();
            let old = *memory.values();
            memory.change(&mut stores, |values| {
                values.stream.on = round.is_multiple_of(2);
                values.stream.period_ms = 1_000 + round;
                values.first_start = !values.first_start;
            });
            let new = *memory.values();
            let store = stores.pop_front().expect("one write");
            assert!(stores.is_empty());
            for cut in 0..=store.bytes.len() {
                let mut image = before.clone();
                image[store.offset..store.offset + cut].copy_from_slice(&store.bytes[..cut]);
                let read = Parameters::read(product(), &image).expect("an intact slot is left");
                assert!(read == if cut < USED_BYTES { old } else { new }, "round {round}, {cut} bytes written");
            }
        }
    }

    #[test]
    fn a_changed_byte_in_one_slot_brings_back_the_other() {
        let (mut memory, mut stores) = fresh();
        let old = *memory.values();
        memory.change(&mut stores, |values| values.node_id = 5);
        let image = memory.image().to_vec();
        for at in SLOT_BYTES..SLOT_BYTES + USED_BYTES {
            let mut changed = image.clone();
            changed[at] ^= 0x40;
            assert_eq!(Parameters::read(product(), &changed), Ok(old), "byte {at}");
            changed[10] ^= 1;
            assert_eq!(Parameters::read(product(), &changed), Err(ParametersError::Corrupt), "byte {at} and the other");
        }
    }

    #[test]
    fn nonsense_is_reported_and_the_unit_runs_on_factory_settings() {
        let factory = Parameters::factory(product());
        let mut wrong_value = Parameters { node_id: 128, ..factory }.to_slot(1);
        wrong_value.resize(IMAGE_BYTES, BLANK);
        let mut newer_format = factory.to_slot(1);
        newer_format[4] = 2;
        let crc = crc32fast::hash(&newer_format[..CRC_AT]);
        newer_format[CRC_AT..USED_BYTES].copy_from_slice(&crc.to_le_bytes());
        newer_format.resize(IMAGE_BYTES, BLANK);
        let cases = [
            (vec![0; 7], ParametersError::Length(7)),
            (vec![0; IMAGE_BYTES], ParametersError::Corrupt),
            (wrong_value, ParametersError::Value("node-ID")),
            (newer_format, ParametersError::Format(2)),
        ];
        for (image, error) in cases {
            assert_eq!(Parameters::read(product(), &image), Err(error));
            let mut stores = VecDeque::new();
            let memory = ParameterStore::new(product(), image, &mut stores);
            assert_eq!(*memory.values(), factory);
            assert_eq!(stores.pop_front().map(|store| store.bytes), Some(memory.image().to_vec()));
        }
        assert_eq!(Parameters::read(product(), &[]), Ok(factory));
        assert_eq!(Parameters::read(product(), &[BLANK; IMAGE_BYTES]), Ok(factory));
    }

    #[test]
    fn a_sequence_number_that_runs_over_stays_the_newest() {
        let factory = Parameters::factory(product());
        let mut image = factory.to_slot(u32::MAX);
        image.extend(Parameters { node_id: 9, ..factory }.to_slot(0));
        assert_eq!(Parameters::read(product(), &image).map(|values| values.node_id), Ok(9));
    }
}
