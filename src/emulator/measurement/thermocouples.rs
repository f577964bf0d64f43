//! How the AXTC4CO reads: all channels together every 200 ms (manual, section 1.1).

use super::super::its90::Thermocouple;
use super::super::objects::Objects;
use super::super::sensors::Sensors;
use super::{PV_OFF, Reading, Updated, scaled};
use crate::canopen::Value;
use crate::time::{Duration, Instant};

/// All channels are read together at this interval.
pub(super) const SCAN_TIME: Duration = Duration::from_millis(200);
/// An open circuit is found in the lowest of eight gains, one scan each (errata E-51: at most 1.6 s).
const SCANS_TO_FIND_OPEN: u8 = 8;
/// One step of the converter in µV: 24 bits over 2.5 V after a gain of 32 (a guess that leaves every type its 0.001 °C
/// but at the coldest end).
const STEP_UV: f64 = 2.5e6 / 32.0 / 8_388_608.0;
/// The largest voltage at that gain, in µV; more is an open circuit (errata E-41).
const LARGEST_UV: f64 = 2.5e6 / 32.0;

/// The converter's state.
#[derive(Clone, Debug)]
pub(super) struct Thermocouples {
    /// Scans since a channel's voltage was last within range.
    open_scans: Vec<u8>,
    last: Vec<Reading>,
}

impl Thermocouples {
    pub(super) fn start(channels: u8, objects: &mut Objects) -> Self {
        objects.set(0x3100, 0, Value::NOT_A_NUMBER);
        objects.set(0x3130, 0, Value::Integer16(PV_OFF));
        let channels = usize::from(channels);
        Thermocouples { open_scans: vec![0; channels], last: vec![Reading::Unread; channels] }
    }

    /// Reads all channels.
    pub(super) fn step(
        &mut self,
        now: Instant,
        sensors: &Sensors,
        objects: &mut Objects,
        read: &mut impl FnMut(u8, Reading),
    ) -> Updated {
        // A converter that delivers nothing new leaves the old values: this unit has no status for it.
        if sensors.is_frozen() {
            return Updated::All;
        }
        let cold_junction = to_milli(sensors.cold_junction(now));
        objects.set(0x3100, 0, Value::Real32(cold_junction as f32));
        let (factor, offset) = (objects.number(0x3126, 0), objects.number(0x3127, 0));
        objects.set(0x3130, 0, Value::Integer16(scaled(cold_junction, factor, offset)));
        for (number, (open_scans, last)) in (1u8..).zip(self.open_scans.iter_mut().zip(&mut self.last)) {
            let thermocouple =
                Thermocouple::from_object(objects.integer(0x6110, number)).expect("no other type can be written");
            let voltage = sensors.thermocouple(now, number, thermocouple).filter(|uv| uv.abs() <= LARGEST_UV);
            *last = match voltage {
                Some(voltage) => {
                    *open_scans = 0;
                    let raw = (voltage / STEP_UV).round() * STEP_UV;
                    objects.set(0x2010, number, Value::Integer32(raw.round() as i32));
                    // In the voltage domain: degrees cannot be added (errata E-42). Switched off, the cold junction
                    // counts as 0 °C (errata E-43).
                    let reference = match objects.integer(0x2000, number) {
                        0 => 0.0,
                        _ => thermocouple.microvolts(cold_junction),
                    };
                    Reading::Celsius(to_milli(thermocouple.celsius(raw + reference)))
                }
                None => {
                    *open_scans = open_scans.saturating_add(1);
                    // Until the gains are searched through, the last value stays (errata E-51).
                    if *open_scans >= SCANS_TO_FIND_OPEN { Reading::Open } else { *last }
                }
            };
            // A channel that is read for the first time and open has nothing to hold.
            if *last == Reading::Unread {
                *last = Reading::Open;
            }
            read(number, *last);
        }
        Updated::All
    }
}

/// Rounded to the resolution of 0.001 °C (appendix A).
fn to_milli(celsius: f64) -> f64 {
    (celsius * 1_000.0).round() / 1_000.0
}
