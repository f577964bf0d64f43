//! How the AXRTD8CO reads: one channel after the other, 100 ms each, and the current source once in a sweep (manual,
//! section 1.1).
//!
//! The wires of 3- and 4-wire sensors take a second reading. It is made in the first sweep, after a change of the type or
//! mode of a channel, and then once in 600 readings of the converter, which is once a minute; one channel in a sweep,
//! so that each is still updated once a second (errata E-C4 to E-C6).

use super::super::objects::Objects;
use super::super::rtd_curve::Curve;
use super::super::sensors::{Sensors, Wiring};
use super::{Reading, Updated};
use crate::canopen::Value;
use crate::time::{Duration, Instant};

/// One reading of the converter.
pub(super) const READING_TIME: Duration = Duration::from_millis(100);
/// Readings between two of the same wires.
const READINGS_BETWEEN_WIRES: u64 = 600;
/// Below this the sensor is shorted, above that the circuit is open (appendix A, errata E-C11).
const SHORT_BELOW_OHM: f64 = 5.0;
const OPEN_ABOVE_OHM: f64 = 600.0;
/// One step of the converter in V: 24 bits over 5 V (a guess, finer than 0.001 ohm).
const STEP_V: f64 = 5.0 / 8_388_608.0;
/// Current through the sensors in A, until it has been measured (section 1.2).
const NOMINAL_AMPERE: f64 = 0.004;
/// Sweeps without new data that make a frozen converter (errata E-C24).
const FROZEN_SWEEPS: u32 = 2;

/// The converter's state.
#[derive(Clone, Debug)]
pub(super) struct Rtds {
    next: Slot,
    /// Readings made so far.
    readings: u64,
    /// Current through the sensors in A, as last measured. Never 0: the wires' resistance is kept for a minute.
    ampere: f64,
    /// A wire has been read in this sweep already.
    wire_read: bool,
    /// Sweeps that have ended since the converter stopped.
    frozen_sweeps: u32,
    channels: Vec<Input>,
}

/// What is read next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    Current,
    Channel(u8),
    /// The wire of a channel whose sensor has just been read.
    Wire(u8),
}

/// The voltage of a sensor, as last read.
#[derive(Clone, Copy, Debug, Default)]
enum Sensor {
    #[default]
    Unread,
    /// The converter is at the end of its range.
    Saturated,
    /// In V.
    Volts(f64),
}

#[derive(Clone, Debug, Default)]
struct Input {
    sensor: Sensor,
    wire_ohm: f64,
    /// The reading at which the wires were read, if that still counts.
    wires_at: Option<u64>,
    /// Object 6110h at that time.
    wires_of: i64,
}

impl Rtds {
    pub(super) fn start(channels: u8, objects: &mut Objects) -> Self {
        objects.set(0x5001, 0, Value::NOT_A_NUMBER);
        for channel in 1..=channels {
            objects.set(0x2000, channel, Value::NOT_A_NUMBER);
        }
        Rtds {
            next: Slot::Current,
            readings: 0,
            ampere: NOMINAL_AMPERE,
            wire_read: false,
            frozen_sweeps: 0,
            channels: vec![Input::default(); usize::from(channels)],
        }
    }

    /// Makes one reading.
    pub(super) fn step(
        &mut self,
        now: Instant,
        sensors: &Sensors,
        objects: &mut Objects,
        read: &mut impl FnMut(u8, Reading),
    ) -> Updated {
        self.readings += 1;
        let slot = self.next;
        if !sensors.is_frozen() {
            self.frozen_sweeps = 0;
            match slot {
                Slot::Current => {
                    let milliampere = sensors.current(now);
                    self.ampere = milliampere / 1_000.0;
                    objects.set(0x5001, 0, Value::Real32(milliampere as f32));
                }
                Slot::Channel(number) => {
                    let terminals = sensors.rtd(now, number, wiring(objects, number), curve(objects, number));
                    let volts = terminals.main.map(quantised);
                    self.input(number).sensor = volts.map_or(Sensor::Saturated, Sensor::Volts);
                    if let Some(volts) = volts {
                        objects.set(0x2010, number, Value::Integer32((volts * 1e6).round() as i32));
                    }
                }
                Slot::Wire(number) => {
                    let terminals = sensors.rtd(now, number, wiring(objects, number), curve(objects, number));
                    let (readings, ampere) = (self.readings, self.ampere);
                    let input = self.input(number);
                    input.wire_ohm = quantised(terminals.wire) / ampere;
                    input.wires_at = Some(readings);
                    input.wires_of = objects.integer(0x6110, number);
                    self.wire_read = true;
                }
            }
        }
        let channel = match slot {
            Slot::Current => None,
            Slot::Channel(number) if self.wants_wire(objects, number) => {
                self.next = Slot::Wire(number);
                return Updated::None;
            }
            Slot::Channel(number) | Slot::Wire(number) => Some(number),
        };
        self.next = self.following(objects, channel.unwrap_or(0));
        if self.next == Slot::Current {
            self.wire_read = false;
            self.frozen_sweeps += u32::from(sensors.is_frozen());
        }
        let Some(number) = channel else { return Updated::None };
        let reading = self.evaluate(objects, number);
        read(number, reading);
        Updated::One(number)
    }

    /// Resistance and temperature from what has been read.
    fn evaluate(&mut self, objects: &mut Objects, number: u8) -> Reading {
        if self.frozen_sweeps >= FROZEN_SWEEPS {
            return Reading::Frozen;
        }
        let (ampere, wiring, curve) = (self.ampere, wiring(objects, number), curve(objects, number));
        let Input { sensor, wire_ohm, .. } = *self.input(number);
        let volts = match sensor {
            Sensor::Volts(volts) => volts,
            Sensor::Saturated => {
                objects.set(0x2000, number, Value::NOT_A_NUMBER);
                return Reading::Open;
            }
            // Its wires have been read, by a converter that stood still before.
            Sensor::Unread => return Reading::Unread,
        };
        let wires = match wiring {
            Wiring::Two => 0.0,
            Wiring::Three => 2.0 * wire_ohm,
            Wiring::Four => wire_ohm,
        };
        let ohm = volts / ampere - wires;
        objects.set(0x2000, number, Value::Real32(ohm as f32));
        if ohm > OPEN_ABOVE_OHM {
            Reading::Open
        } else if ohm < SHORT_BELOW_OHM {
            Reading::Short
        } else {
            curve.temperature(ohm).map_or(Reading::MathError, Reading::Celsius)
        }
    }

    /// Whether the wires of a channel are due. What is known of them is forgotten when the type of the sensor has changed.
    fn wants_wire(&mut self, objects: &Objects, number: u8) -> bool {
        let (readings, wire_read) = (self.readings, self.wire_read);
        let input = self.input(number);
        if wiring(objects, number) == Wiring::Two || input.wires_of != objects.integer(0x6110, number) {
            input.wires_at = None;
        }
        match input.wires_at {
            None => wiring(objects, number) != Wiring::Two,
            Some(at) => !wire_read && readings - at >= READINGS_BETWEEN_WIRES,
        }
    }

    /// The next channel that is on, or the current source: the sweep is over. Channels that are off are passed over, and
    /// their wires are read again when they are on again.
    fn following(&mut self, objects: &Objects, number: u8) -> Slot {
        for next in number + 1..=self.channels.len() as u8 {
            if objects.integer(0x6112, next) != 0 {
                return Slot::Channel(next);
            }
            self.input(next).wires_at = None;
        }
        Slot::Current
    }

    fn input(&mut self, number: u8) -> &mut Input {
        &mut self.channels[usize::from(number) - 1]
    }
}

fn quantised(volts: f64) -> f64 {
    (volts / STEP_V).round() * STEP_V
}

/// Object 6110h.
fn wiring(objects: &Objects, number: u8) -> Wiring {
    match objects.integer(0x6110, number) {
        10_000 => Wiring::Two,
        10_002 => Wiring::Four,
        _ => Wiring::Three,
    }
}

/// Objects 3010h, 3020h and 3030h.
fn curve(objects: &Objects, number: u8) -> Curve {
    Curve::from_objects([0x3010, 0x3020, 0x3030].map(|index| objects.number(index, number)))
}
