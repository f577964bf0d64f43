//! From voltages to facts: readings, field and process values, status, thresholds, averages (manuals, sections 1.1 to
//! 1.4, 3.3 and 3.4).
//!
//! How a product reads its inputs is its own affair (`thermocouples`, `rtds`); what becomes of a reading is the same
//! for both and is here. Results go to the object dictionary and nowhere else: stream, view and diagnostics read it
//! there.

mod rtds;
mod thermocouples;

use super::errors::{ActiveErrors, DEVICE_SPECIFIC, INPUT_OVERLOAD, LIMIT_EXCEEDED};
use super::objects::Objects;
use super::sensors::Sensors;
use crate::canopen::Value;
use crate::device::emergency::Emergency;
use crate::device::{Product, SensorKind};
use crate::time::{Duration, Instant};
use crate::wire::stream::{Reading as Field, Row, Source};
use rtds::Rtds;
use thermocouples::Thermocouples;

/// What a channel has to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// °C.
    Celsius(f64),
    /// Switched off (object 6112h).
    Off,
    /// Switched on, and not read since.
    Unread,
    /// Open circuit.
    Open,
    /// Short circuit.
    Short,
    /// The temperature cannot be computed.
    MathError,
    /// The converter delivers no new data.
    Frozen,
}

/// The measuring part of a unit that runs.
#[derive(Clone, Debug)]
pub struct Measurement {
    scan: Scan,
    /// When the converter's next reading is due.
    reading_at: Instant,
    channels: Vec<Channel>,
    /// No temperature is published before: the converters have to settle.
    first_data_at: Instant,
    published: bool,
}

#[derive(Clone, Debug)]
enum Scan {
    Thermocouples(Thermocouples),
    Rtds(Rtds),
}

/// Which channels a reading of the converter is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Updated {
    All,
    One(u8),
    /// It was of the current source, or the first of two that belong together.
    None,
}

/// A channel's evaluation.
#[derive(Clone, Debug)]
struct Channel {
    reading: Reading,
    thresholds: [Threshold; 3],
    /// What the last evaluation rested on: a change restarts what was pending (errata E-D20).
    settings: Settings,
    sensor_error: Option<Emergency>,
}

/// What a channel's evaluation rests on besides its reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Settings {
    /// Objects 4000h, 4010h and 4020h, in 0.1 °C.
    thresholds: [i64; 3],
    /// Object 4030h.
    delay_ms: u16,
    /// Object 6110h, and 3000h of an RTD: another sensor or curve has another temperature.
    sensor: (i64, Option<i64>),
}

/// One threshold of a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Threshold {
    #[default]
    Kept,
    /// Exceeded since then, not long enough yet.
    Pending(Instant),
    Exceeded,
}

/// What a threshold watches for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Watch {
    index: u16,
    /// Low warnings are below their threshold, the others from it on (errata E-60, E-D4).
    below: bool,
    /// Error description and bit of the status (section 3.2.4).
    description: u8,
}

/// In the order in which errors of the same moment are listed: the shutdown is the newest.
const WATCHES: [Watch; 3] = [
    Watch { index: 0x4000, below: true, description: 0x10 },
    Watch { index: 0x4010, below: false, description: 0x20 },
    Watch { index: 0x4020, below: false, description: 0x40 },
];

/// Distance from a threshold at which its error clears, in °C (section 1.2).
const HYSTERESIS_C: f64 = 1.0;
/// Status of a high shutdown: the value counts as not valid, and the warning is not shown beside it (errata E-17).
const STATUS_SHUTDOWN: u8 = 0x41;

/// Process values in the place of a measured one (section 1.2).
const PV_OFF: i16 = -1;
const PV_OPEN: i16 = -512;
const PV_SHORT: i16 = -448;
const PV_FROZEN: i16 = -384;

impl Measurement {
    /// Begins at the unit's start. The supply is known at once, everything else has no value yet.
    pub fn start(now: Instant, product: &Product, sensors: &Sensors, objects: &mut Objects) -> Self {
        let channel = Channel {
            reading: Reading::Unread,
            thresholds: [Threshold::Kept; 3],
            settings: Settings::default(),
            sensor_error: None,
        };
        let channels = product.measurement.channels;
        for channel in 1..=channels {
            objects.set(0x6100, channel, Value::NOT_A_NUMBER);
            objects.set(0x7130, channel, Value::Integer16(PV_OFF));
        }
        objects.set(0x5000, 0, Value::Real32(sensors.supply(now) as f32));
        let scan = match product.measurement.sensors {
            SensorKind::Thermocouple => Scan::Thermocouples(Thermocouples::start(channels, objects)),
            SensorKind::Rtd => Scan::Rtds(Rtds::start(channels, objects)),
        };
        let measurement = Measurement {
            reading_at: now + scan.reading_time(),
            scan,
            channels: vec![channel; usize::from(channels)],
            first_data_at: now + Duration::from_millis(u64::from(product.measurement.first_data_ms)),
            published: false,
        };
        measurement.average(objects);
        measurement
    }

    /// When the next reading is due.
    pub fn deadline(&self) -> Instant {
        self.reading_at
    }

    /// When the first temperatures are published, or were.
    pub fn first_data_at(&self) -> Instant {
        self.first_data_at
    }

    /// Goes on after it was halted since a moment: the next reading is a reading's time away, and converters that had
    /// not settled by then still need the rest of their time, up to a reading.
    pub fn resume(&mut self, halted_at: Instant, now: Instant) {
        let reading_time = self.scan.reading_time();
        self.reading_at = now + reading_time;
        if self.first_data_at > halted_at {
            let left = self.first_data_at.since(halted_at);
            self.first_data_at = now;
            while self.first_data_at < now + left {
                self.first_data_at += reading_time;
            }
        }
    }

    /// Takes the reading that is due. If anything new has been published, gives the errors that have become active.
    pub fn step(
        &mut self,
        now: Instant,
        sensors: &Sensors,
        objects: &mut Objects,
        errors: &mut ActiveErrors,
    ) -> Option<Vec<Emergency>> {
        if self.reading_at > now {
            return None;
        }
        let reading_at = self.reading_at;
        self.reading_at += self.scan.reading_time();
        let channels = &mut self.channels;
        let mut read = |channel: u8, reading| channels[usize::from(channel) - 1].reading = reading;
        let updated = match &mut self.scan {
            Scan::Thermocouples(scan) => scan.step(reading_at, sensors, objects, &mut read),
            Scan::Rtds(scan) => scan.step(reading_at, sensors, objects, &mut read),
        };
        objects.set(0x5000, 0, Value::Real32(sensors.supply(now) as f32));
        if now < self.first_data_at {
            return None;
        }
        let mut raised = Vec::new();
        let all = !std::mem::replace(&mut self.published, true);
        for (number, channel) in (1u8..).zip(&mut self.channels) {
            // A channel that is switched off says so at once, whichever is being read.
            let off = objects.integer(0x6112, number) == 0;
            channel.reading = match channel.reading {
                _ if off => Reading::Off,
                Reading::Off => Reading::Unread,
                reading => reading,
            };
            if all || off || updated.includes(number) {
                raised.extend(channel.evaluate(now, number, objects, errors));
            }
        }
        self.average(objects);
        Some(raised)
    }

    /// Averages of the banks and of all, over the channels that have a temperature (sections 1.3 and 3.4.3 to 3.4.7).
    fn average(&self, objects: &mut Objects) {
        let half = self.channels.len() / 2;
        let banks = [&self.channels[..half], &self.channels[half..], &self.channels[..]];
        for (sub, bank) in (1u8..).zip(banks) {
            let (sum, count) = bank.iter().fold((0.0, 0u32), |(sum, count), channel| match channel.reading {
                Reading::Celsius(celsius) => (sum + celsius, count + 1),
                _ => (sum, count),
            });
            let available = objects.integer(0x2112, sub) != 0 && count > 0;
            let average = available.then(|| sum / f64::from(count));
            let (factor, offset) = (objects.number(0x2126, sub), objects.number(0x2127, sub));
            objects.set(0x2100, sub, average.map_or(Value::NOT_A_NUMBER, |celsius| Value::Real32(celsius as f32)));
            let counts = average.map_or(PV_OFF, |celsius| scaled(celsius, factor, offset));
            objects.set(0x2130, sub, Value::Integer16(counts));
        }
    }
}

impl Scan {
    /// Time from one reading of the converter to the next.
    fn reading_time(&self) -> Duration {
        match self {
            Scan::Thermocouples(_) => thermocouples::SCAN_TIME,
            Scan::Rtds(_) => rtds::READING_TIME,
        }
    }
}

impl Updated {
    fn includes(self, number: u8) -> bool {
        match self {
            Updated::All => true,
            Updated::One(channel) => channel == number,
            Updated::None => false,
        }
    }
}

impl Settings {
    fn of(objects: &Objects, number: u8) -> Self {
        let curve = match objects.product().measurement.sensors {
            SensorKind::Thermocouple => None,
            SensorKind::Rtd => Some(objects.integer(0x3000, number)),
        };
        Settings {
            thresholds: WATCHES.map(|watch| objects.integer(watch.index, number)),
            delay_ms: objects.integer(0x4030, number) as u16,
            sensor: (objects.integer(0x6110, number), curve),
        }
    }
}

impl Channel {
    /// Publishes what the present reading comes to. Gives the errors that have become active.
    fn evaluate(
        &mut self,
        now: Instant,
        number: u8,
        objects: &mut Objects,
        errors: &mut ActiveErrors,
    ) -> Vec<Emergency> {
        let (mut raised, mut cleared) = self.watch(now, number, objects);
        let sensor_error = match self.reading {
            Reading::Celsius(_) | Reading::Off | Reading::Unread => None,
            Reading::Open => Some(Emergency { code: INPUT_OVERLOAD, channel: number, description: 0x02 }),
            Reading::Short => Some(Emergency { code: INPUT_OVERLOAD, channel: number, description: 0x04 }),
            Reading::MathError => Some(Emergency { code: DEVICE_SPECIFIC, channel: number, description: 0x08 }),
            Reading::Frozen => Some(Emergency { code: DEVICE_SPECIFIC, channel: number, description: 0x80 }),
        };
        if self.sensor_error != sensor_error {
            raised.extend(sensor_error);
            cleared.extend(std::mem::replace(&mut self.sensor_error, sensor_error));
        }
        let raised = errors.change(&raised, &cleared, objects);
        let (factor, offset) = (objects.number(0x6126, number), objects.number(0x6127, number));
        let (field_value, process_value) = match self.reading {
            Reading::Celsius(celsius) => (Value::Real32(celsius as f32), scaled(celsius, factor, offset)),
            Reading::Off | Reading::Unread => (Value::NOT_A_NUMBER, PV_OFF),
            Reading::Open => (Value::NOT_A_NUMBER, PV_OPEN),
            Reading::Short => (Value::NOT_A_NUMBER, PV_SHORT),
            // Errata E-C22.
            Reading::MathError | Reading::Frozen => (Value::NOT_A_NUMBER, PV_FROZEN),
        };
        objects.set(0x6100, number, field_value);
        objects.set(0x7130, number, Value::Integer16(process_value));
        objects.set(0x6150, number, Value::Unsigned8(self.status()));
        raised
    }

    /// Compares with the thresholds: only what is exceeded for the reaction delay without a break counts, and what
    /// counts goes at once when it has cleared by the hysteresis (section 1.2). Gives the errors that count from now
    /// on, and those that no longer do.
    fn watch(&mut self, now: Instant, number: u8, objects: &Objects) -> (Vec<Emergency>, Vec<Emergency>) {
        let settings = Settings::of(objects, number);
        let unchanged = std::mem::replace(&mut self.settings, settings) == settings;
        let delay = Duration::from_millis(u64::from(settings.delay_ms));
        let (mut raised, mut cleared) = (Vec::new(), Vec::new());
        for (threshold, (watch, tenths)) in self.thresholds.iter_mut().zip(WATCHES.iter().zip(settings.thresholds)) {
            let limit = tenths as f64 / 10.0;
            let was_exceeded = *threshold == Threshold::Exceeded;
            *threshold = match (self.reading, *threshold) {
                (Reading::Celsius(celsius), Threshold::Exceeded) => {
                    let clears =
                        if watch.below { celsius > limit + HYSTERESIS_C } else { celsius < limit - HYSTERESIS_C };
                    if clears { Threshold::Kept } else { Threshold::Exceeded }
                }
                (Reading::Celsius(celsius), pending) => {
                    let beyond = if watch.below { celsius < limit } else { celsius >= limit };
                    let since = match pending {
                        Threshold::Pending(since) if unchanged => since,
                        _ => now,
                    };
                    match beyond {
                        true if now.since(since) >= delay => Threshold::Exceeded,
                        true => Threshold::Pending(since),
                        false => Threshold::Kept,
                    }
                }
                // Without a temperature there is nothing to compare (errata E-75).
                (_, _) => Threshold::Kept,
            };
            let error = Emergency { code: LIMIT_EXCEEDED, channel: number, description: watch.description };
            match (was_exceeded, *threshold == Threshold::Exceeded) {
                (false, true) => raised.push(error),
                (true, false) => cleared.push(error),
                (false, false) | (true, true) => {}
            }
        }
        (raised, cleared)
    }

    /// Object 6150h.
    fn status(&self) -> u8 {
        let [low, high, shutdown] = self.thresholds.map(|threshold| threshold == Threshold::Exceeded);
        match self.reading {
            Reading::Off | Reading::Unread => 0x00,
            Reading::Open => 0x03,
            Reading::Short => 0x05,
            Reading::MathError => 0x09,
            Reading::Frozen => 0x81,
            Reading::Celsius(_) if shutdown => STATUS_SHUTDOWN,
            Reading::Celsius(_) if high => 0x20,
            Reading::Celsius(_) if low => 0x10,
            Reading::Celsius(_) => 0x00,
        }
    }
}

/// The last values as a row of the stream (section 4.1.3).
pub fn row(objects: &Objects, source: Source) -> Row {
    let product = objects.product();
    let value_index = match source {
        Source::FieldValue => 0x6100,
        Source::ProcessValue => 0x7130,
    };
    let mut row = product.stream.row(source);
    if product.measurement.sensors == SensorKind::Thermocouple {
        // The cold junction comes first (errata E-104).
        let index = match source {
            Source::FieldValue => 0x3100,
            Source::ProcessValue => 0x3130,
        };
        // A converter that has been frozen since the start has never read it.
        let unread = objects.number(0x3100, 0).is_nan();
        row.readings.push(if unread { Field::Disabled } else { Field::Value(objects.number(index, 0)) });
    }
    row.readings.extend((1..=product.measurement.channels).map(|channel| {
        let status = objects.integer(0x6150, channel);
        // No value, and no error that explains it: it is off, or has not been read since it was switched on.
        let unread = status == 0 && objects.number(0x6100, channel).is_nan();
        match status {
            _ if unread || objects.integer(0x6112, channel) == 0 => Field::Disabled,
            0x03 => Field::Open,
            0x05 => Field::Short,
            0x09 | 0x81 if source == Source::FieldValue => Field::Error,
            _ => Field::Value(objects.number(value_index, channel)),
        }
    }));
    row
}

/// Process value = field value x factor + offset, to the nearest, saturating (section 1.2, errata E-48, E-C18, E-C19).
fn scaled(celsius: f64, factor: f64, offset: f64) -> i16 {
    (celsius * factor + offset).round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16
}

#[cfg(test)]
mod tests;
