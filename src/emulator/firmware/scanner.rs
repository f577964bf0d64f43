//! What the firmware makes of its inputs: one scan of all channels every 200 ms (AXTC4CO manual, section 1.1).
//!
//! Temperatures are taken as the process gives them: the way over microvolts and back (errata E-42) would only add
//! its rounding. The raw microvolts are computed for display, for type J, the factory setting of object 6110h.

use super::super::sensors::{CHANNELS, Channel, Sensors};
use crate::time::{Duration, Instant};
use crate::wire::stream::{Reading, Row, Source};

/// All channels are read together at this interval.
pub const SCAN_TIME: Duration = Duration::from_millis(200);

/// An open circuit is found in the lowest of eight gains, one scan each (errata E-51: at most 1.6 s).
const SCANS_TO_FIND_OPEN: u8 = 8;
/// Range of type J, the factory setting (ITS-90; errata E-41).
const TYPE_J_C: (f64, f64) = (-210.0, 1_200.0);
/// Scaling from the factory: objects 6126h and 6127h.
pub const FACTOR: f64 = 16.0;
/// See [`FACTOR`].
pub const OFFSET: f64 = 4_368.0;

/// Process value of a channel that is switched off (section 1.2).
const PV_DISABLED: i16 = -1;
/// Process value of an open circuit (section 1.2).
const PV_OPEN: i16 = -512;

/// The last scan.
#[derive(Clone, Debug, Default)]
pub struct Scanner {
    channels: [Measured; CHANNELS],
    cold_junction: f64,
    supply: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Measured {
    /// °C, of the last scan with a closed circuit.
    field_value: f64,
    open_scans: u8,
    disabled: bool,
}

/// What a channel has to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldValue {
    /// °C.
    Celsius(f64),
    /// Switched off (object 6112h).
    Disabled,
    /// Open circuit.
    Open,
}

impl Scanner {
    /// Reads all channels.
    pub fn scan(&mut self, now: Instant, sensors: &Sensors) {
        let sample = sensors.sample(now);
        for channel in Channel::all() {
            let measured = &mut self.channels[channel.position()];
            measured.disabled = !sensors.is_enabled(channel);
            match sample.thermocouples[channel.position()] {
                Some(celsius) => {
                    measured.field_value = to_milli(celsius.clamp(TYPE_J_C.0, TYPE_J_C.1));
                    measured.open_scans = 0;
                }
                // Until the gains are searched through, the last value stays (errata E-51).
                None => measured.open_scans = measured.open_scans.saturating_add(1),
            }
        }
        self.cold_junction = to_milli(sample.cold_junction);
        self.supply = sample.supply;
    }

    /// Field value, object 6100h.
    pub fn field_value(&self, channel: Channel) -> FieldValue {
        let measured = &self.channels[channel.position()];
        if measured.disabled {
            FieldValue::Disabled
        } else if measured.open_scans >= SCANS_TO_FIND_OPEN {
            FieldValue::Open
        } else {
            FieldValue::Celsius(measured.field_value)
        }
    }

    /// Process value, object 7130h.
    pub fn process_value(&self, channel: Channel) -> i16 {
        match self.field_value(channel) {
            FieldValue::Celsius(celsius) => scaled(celsius),
            FieldValue::Disabled => PV_DISABLED,
            FieldValue::Open => PV_OPEN,
        }
    }

    /// Cold junction in °C, object 3100h.
    pub fn cold_junction(&self) -> f64 {
        self.cold_junction
    }

    /// Supply voltage in V, object 5000h.
    pub fn supply(&self) -> f64 {
        self.supply
    }

    /// Raw reading in µV, object 2010h; without meaning while the circuit is open (errata E-44).
    pub fn microvolts(&self, channel: Channel) -> i32 {
        let celsius = self.channels[channel.position()].field_value;
        (type_j_microvolts(celsius) - type_j_microvolts(self.cold_junction)).round() as i32
    }

    /// Channels in error.
    pub fn errors(&self) -> usize {
        Channel::all().into_iter().filter(|&channel| self.field_value(channel) == FieldValue::Open).count()
    }

    /// The last scan as a row of the stream: cold junction first (section 4.1.3, errata E-104).
    pub fn row(&self, source: Source) -> Row {
        let number = |celsius| match source {
            Source::FieldValue => celsius,
            Source::ProcessValue => f64::from(scaled(celsius)),
        };
        let mut readings = vec![Reading::Value(number(self.cold_junction))];
        readings.extend(Channel::all().map(|channel| match self.field_value(channel) {
            FieldValue::Celsius(celsius) => Reading::Value(number(celsius)),
            FieldValue::Disabled => Reading::Disabled,
            FieldValue::Open => Reading::Open,
        }));
        Row { source, readings }
    }
}

/// Rounded to the resolution of 0.001 °C (appendix A).
fn to_milli(celsius: f64) -> f64 {
    (celsius * 1_000.0).round() / 1_000.0
}

/// PV = FV x factor + offset, to the nearest, saturating (section 1.2, errata E-48).
fn scaled(celsius: f64) -> i16 {
    (celsius * FACTOR + OFFSET).round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16
}

/// Thermoelectric voltage of type J against 0 °C, in µV: the ITS-90 reference functions.
fn type_j_microvolts(celsius: f64) -> f64 {
    const UP_TO_760: [f64; 9] = [
        0.0,
        5.038_118_781_5e1,
        3.047_583_693_0e-2,
        -8.568_106_572_0e-5,
        1.322_819_529_5e-7,
        -1.705_295_833_7e-10,
        2.094_809_069_7e-13,
        -1.253_839_533_6e-16,
        1.563_172_569_7e-20,
    ];
    const ABOVE_760: [f64; 6] = [
        2.964_562_568_1e5,
        -1.497_612_778_6e3,
        3.178_710_392_4,
        -3.184_768_670_1e-3,
        1.572_081_900_4e-6,
        -3.069_136_905_6e-10,
    ];
    let coefficients: &[f64] = if celsius <= 760.0 { &UP_TO_760 } else { &ABOVE_760 };
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * celsius + coefficient)
}

#[cfg(test)]
mod tests {
    use super::super::super::sensors::Condition;
    use super::*;

    fn scanned(scans: u64, sensors: &Sensors) -> Scanner {
        let mut scanner = Scanner::default();
        for scan in 1..=scans {
            scanner.scan(Instant::ZERO + SCAN_TIME * scan as u32, sensors);
        }
        scanner
    }

    #[test]
    fn process_values_follow_the_manuals_formula() {
        // Errata B-066.
        for (celsius, counts) in [(-273.0, 0), (0.0, 4368), (25.0, 4768), (100.0, 5968), (250.0, 8368), (1735.0, 32128)]
        {
            assert_eq!(scaled(celsius), counts);
        }
        assert_eq!((scaled(9_999.0), scaled(-9_999.0)), (i16::MAX, i16::MIN));
    }

    #[test]
    fn type_j_matches_the_reference_voltages() {
        // Errata B-063: against 0 °C, and with the cold junction at 25 °C.
        assert!((type_j_microvolts(100.0) - 5_268.9).abs() < 0.1);
        assert!((type_j_microvolts(100.0) - type_j_microvolts(25.0) - 3_991.6).abs() < 0.1);
        assert!((type_j_microvolts(250.0) - type_j_microvolts(25.0) - 12_277.9).abs() < 0.1);
        assert!((type_j_microvolts(760.0) - type_j_microvolts(760.001)).abs() < 1.0, "the two ranges meet");
    }

    #[test]
    fn an_open_circuit_is_found_within_1600_ms_and_its_end_at_once() {
        let mut sensors = Sensors::new(1);
        let channel = Channel::all()[2];
        let mut scanner = scanned(1, &sensors);
        sensors.set(channel, Condition::Open);
        let mut scans = 0;
        while scanner.field_value(channel) != FieldValue::Open {
            scans += 1;
            scanner.scan(Instant::from_millis(200 + scans * 200), &sensors);
        }
        assert_eq!(scans * 200, 1_600);
        assert_eq!((scanner.process_value(channel), scanner.errors()), (-512, 1));
        sensors.set(channel, Condition::Process);
        scanner.scan(Instant::from_millis(5_000), &sensors);
        assert!(matches!(scanner.field_value(channel), FieldValue::Celsius(_)));
        sensors.set_enabled(channel, false);
        scanner.scan(Instant::from_millis(5_200), &sensors);
        assert_eq!((scanner.process_value(channel), scanner.errors()), (-1, 0));
    }
}
