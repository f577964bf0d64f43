//! What hangs on the unit's terminals: sensors, wires, supply, and the process they are in.
//!
//! By default an engine that runs: exhaust, coolant, oil, surroundings. Every value is a function of the seed and the
//! time alone, made of additions and multiplications (no library sine), so that it is the same on every machine and
//! however often it is asked. A [`Knob`] puts something exact in its place, or breaks a wire. What the firmware makes of
//! the voltages is in `measurement`.

use super::its90::Thermocouple;
use super::knob::{Knob, KnobError, Lead};
use super::rtd_curve::Curve;
use crate::device::{Product, SensorKind};
use crate::rng::Rng;
use crate::time::{Duration, Instant};

/// Standard deviation of one reading of the default process, roughly, in °C: lively in the third decimal, quiet in the
/// first.
const NOISE_C: f64 = 0.02;
/// Resistance of each lead of an RTD, in ohm, unless a knob says otherwise: some metres of copper.
const LEAD_OHM: f64 = 0.5;
/// Voltages above this are out of the converter's reach: the current source has nothing more to give (a guess: the
/// supply of an analogue input, 5 V).
const SATURATION_V: f64 = 5.0;
/// Hottest and coldest thing a knob takes, in °C; wider than every sensor's range.
const COLDEST_C: f64 = -273.15;
const HOTTEST_C: f64 = 3_000.0;

/// How a channel of the AXRTD8CO is wired (object 6110h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// A and GND.
    Two,
    /// A, C and GND.
    Three,
    /// A, B, C and GND.
    Four,
}

/// Voltages at the terminals of an RTD against GND, in V; `None` where the input is saturated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terminals {
    /// The voltage that carries the sensor: at A with two and three wires, at B with four.
    pub main: Option<f64>,
    /// The voltage at C: one wire's.
    pub wire: f64,
}

/// The process with its knobs. It goes on whether the unit has power or not.
#[derive(Clone, Debug)]
pub struct Sensors {
    kind: SensorKind,
    chance: Rng,
    inputs: Vec<Input>,
    cold_junction: Option<f64>,
    supply: Option<f64>,
    current: Option<f64>,
    frozen: bool,
}

/// One input's sensor and wires.
#[derive(Clone, Debug)]
struct Input {
    quantity: Quantity,
    /// The sensor's circuit, and the leads A, B, C and GND.
    broken: [bool; 5],
    shorted: bool,
    lead_ohm: f64,
}

/// What an input's sensor shows.
#[derive(Clone, Copy, Debug)]
enum Quantity {
    Process,
    Celsius(f64),
    Ohm(f64),
    Microvolts(f64),
}

impl Sensors {
    /// The default process of a seed.
    pub fn new(product: &Product, seed: u64) -> Self {
        let input = Input { quantity: Quantity::Process, broken: [false; 5], shorted: false, lead_ohm: LEAD_OHM };
        Sensors {
            kind: product.measurement.sensors,
            chance: Rng::new(seed).fork("process"),
            inputs: vec![input; usize::from(product.measurement.channels)],
            cold_junction: None,
            supply: None,
            current: None,
            frozen: false,
        }
    }

    /// Turns a knob; the unit notices at its next reading.
    ///
    /// # Errors
    /// If this unit has no such thing, or cannot have this number.
    pub fn turn(&mut self, knob: Knob) -> Result<(), KnobError> {
        use SensorKind::{Rtd, Thermocouple};
        match knob {
            Knob::Process(number) => {
                let input = self.input(number)?;
                *input = Input { quantity: Quantity::Process, broken: [false; 5], shorted: false, ..*input };
            }
            Knob::Temperature(number, celsius) => {
                within("a temperature", celsius, COLDEST_C, HOTTEST_C)?;
                self.input(number)?.quantity = Quantity::Celsius(celsius);
            }
            Knob::Resistance(number, ohm) => {
                self.only(Rtd, "resistance")?;
                within("a resistance", ohm, 0.0, 1e6)?;
                self.input(number)?.quantity = Quantity::Ohm(ohm);
            }
            Knob::Microvolts(number, microvolts) => {
                self.only(Thermocouple, "voltage of its own")?;
                within("a voltage", microvolts, -1e6, 1e6)?;
                self.input(number)?.quantity = Quantity::Microvolts(microvolts);
            }
            Knob::LeadResistance(number, ohm) => {
                self.only(Rtd, "lead resistance")?;
                within("a lead's resistance", ohm, 0.0, 1_000.0)?;
                self.input(number)?.lead_ohm = ohm;
            }
            Knob::Open(number, lead) => {
                if lead.is_some() {
                    self.only(Rtd, "leads with names")?;
                }
                self.input(number)?.broken[place(lead)] = true;
            }
            Knob::Short(number) => self.input(number)?.shorted = true,
            Knob::Repair(number) => {
                let input = self.input(number)?;
                (input.broken, input.shorted) = ([false; 5], false);
            }
            Knob::ColdJunction(celsius) => {
                self.only(Thermocouple, "cold junction")?;
                celsius.map_or(Ok(()), |celsius| within("a cold junction", celsius, -60.0, 150.0))?;
                self.cold_junction = celsius;
            }
            Knob::Supply(volts) => {
                volts.map_or(Ok(()), |volts| within("a supply", volts, 0.0, 100.0))?;
                self.supply = volts;
            }
            Knob::SourceCurrent(milliamperes) => {
                self.only(Rtd, "current source")?;
                milliamperes.map_or(Ok(()), |current| within("a current", current, 0.1, 10.0))?;
                self.current = milliamperes;
            }
            Knob::Freeze(frozen) => self.frozen = frozen,
        }
        Ok(())
    }

    /// Whether the converter delivers no new data.
    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// Cold junction in °C.
    pub fn cold_junction(&self, now: Instant) -> f64 {
        self.cold_junction.unwrap_or_else(|| self.signal(now, &COLD_JUNCTION))
    }

    /// Supply in V.
    pub fn supply(&self, now: Instant) -> f64 {
        self.supply.unwrap_or_else(|| self.signal(now, &SUPPLY))
    }

    /// Current of the source in mA.
    pub fn current(&self, now: Instant) -> f64 {
        self.current.unwrap_or_else(|| self.signal(now, &CURRENT))
    }

    /// Voltage at the terminals of a thermocouple input in µV, its cold junction included; `None` if the circuit is
    /// open. The thermocouple is of the type the channel is set to. Channels count from 1.
    pub fn thermocouple(&self, now: Instant, channel: u8, thermocouple: Thermocouple) -> Option<f64> {
        let input = &self.inputs[usize::from(channel) - 1];
        // A short bridges whatever is broken beyond it, as at an RTD.
        if input.shorted {
            return Some(0.0);
        }
        if input.broken[place(None)] {
            return None;
        }
        let celsius = match input.quantity {
            Quantity::Microvolts(microvolts) => return Some(microvolts),
            Quantity::Celsius(celsius) => celsius,
            Quantity::Process | Quantity::Ohm(_) => self.signal(now, process(self.kind, channel)),
        };
        Some(thermocouple.microvolts(celsius) - thermocouple.microvolts(self.cold_junction(now)))
    }

    /// Voltages at the terminals of an RTD input (AXRTD8CO manual, section 1.1; errata E-C2, E-C13). The sensor is of
    /// the curve the channel is set to. Channels count from 1.
    pub fn rtd(&self, now: Instant, channel: u8, wiring: Wiring, curve: Curve) -> Terminals {
        let input = &self.inputs[usize::from(channel) - 1];
        let [circuit, a, b, c, ground] = input.broken;
        let ampere = self.current(now) / 1_000.0;
        let ohm = match input.quantity {
            _ if input.shorted => 0.0,
            Quantity::Ohm(ohm) => ohm,
            Quantity::Celsius(celsius) => curve.resistance(celsius).max(0.0),
            Quantity::Process | Quantity::Microvolts(_) => {
                curve.resistance(self.signal(now, process(self.kind, channel))).max(0.0)
            }
        };
        let lead = input.lead_ohm;
        // Where no current can flow, the source drives its terminal to the end of its range.
        let open = (circuit && !input.shorted) || ground || (a && wiring != Wiring::Four);
        let wire = if c || a { 0.0 } else { ampere * lead };
        let main = match wiring {
            _ if open => None,
            Wiring::Two | Wiring::Three => Some(ampere * (ohm + 2.0 * lead)),
            // Without current there is no voltage at B, nor without a wire (section 1.1).
            Wiring::Four if a || b => Some(0.0),
            Wiring::Four => Some(ampere * (ohm + lead)),
        };
        Terminals { main: main.filter(|volts| *volts <= SATURATION_V), wire }
    }

    fn input(&mut self, number: u8) -> Result<&mut Input, KnobError> {
        let inputs = self.inputs.len() as u8;
        let place = usize::from(number).wrapping_sub(1);
        self.inputs.get_mut(place).ok_or(KnobError::NoSuchInput { number, inputs })
    }

    fn only(&self, kind: SensorKind, what: &'static str) -> Result<(), KnobError> {
        if self.kind == kind {
            return Ok(());
        }
        let sensors = match self.kind {
            SensorKind::Thermocouple => "thermocouples",
            SensorKind::Rtd => "RTDs",
        };
        Err(KnobError::NotHere { sensors, what })
    }

    fn signal(&self, now: Instant, signal: &Signal) -> f64 {
        let period = signal.drift.as_nanos() as u64;
        let knot = now.as_nanos() / period;
        let part = (now.as_nanos() % period) as f64 / period as f64;
        let smooth = part * part * (3.0 - 2.0 * part);
        let (from, to) = (self.draw(signal.name, knot), self.draw(signal.name, knot + 1));
        let drift = from + (to - from) * smooth;
        let noise = self.noise(now, signal.name) * signal.noise;
        (signal.low + (signal.high - signal.low) * drift + noise).clamp(signal.low, signal.high)
    }

    /// Four draws together are close enough to a normal distribution.
    fn noise(&self, now: Instant, name: &str) -> f64 {
        let mut chance = self.chance.fork(name);
        let mut moment = Rng::new(chance.next_u64() ^ now.as_nanos());
        let sum: f64 = (0..4).map(|_| moment.unit() - 0.5).sum();
        // The sum of four has a standard deviation of sqrt(4 / 12).
        sum * 1.732 * NOISE_C
    }

    /// A number in 0.0..1.0 that belongs to one signal and one knot of its drift.
    fn draw(&self, name: &str, knot: u64) -> f64 {
        let mut chance = self.chance.fork(name);
        Rng::new(chance.next_u64() ^ knot.wrapping_mul(0x9E37_79B9_7F4A_7C15)).unit()
    }
}

fn place(lead: Option<Lead>) -> usize {
    match lead {
        None => 0,
        Some(Lead::A) => 1,
        Some(Lead::B) => 2,
        Some(Lead::C) => 3,
        Some(Lead::Ground) => 4,
    }
}

fn within(what: &'static str, value: f64, low: f64, high: f64) -> Result<(), KnobError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(KnobError::Value { what, value, low, high }) }
}

/// The default process at an input.
fn process(kind: SensorKind, channel: u8) -> &'static Signal {
    let place = usize::from(channel) - 1;
    match kind {
        SensorKind::Thermocouple => &THERMOCOUPLES[place % THERMOCOUPLES.len()],
        SensorKind::Rtd => &RTDS[place % RTDS.len()],
    }
}

/// A quantity that wanders between two bounds.
struct Signal {
    name: &'static str,
    low: f64,
    high: f64,
    /// How long it takes from one resting point to the next.
    drift: Duration,
    /// Noise, in shares of [`NOISE_C`].
    noise: f64,
}

const fn signal(name: &'static str, low: f64, high: f64, drift_s: u64, noise: f64) -> Signal {
    Signal { name, low, high, drift: Duration::from_secs(drift_s), noise }
}

/// Below the warning threshold of 125 °C (object 4010h) all of them: a healthy engine.
const THERMOCOUPLES: [Signal; 4] = [
    signal("exhaust 1", 60.0, 110.0, 45, 1.0),
    signal("exhaust 2", 60.0, 110.0, 60, 1.0),
    signal("coolant", 77.0, 83.0, 90, 1.0),
    signal("ambient", 23.0, 27.0, 300, 1.0),
];
const RTDS: [Signal; 8] = [
    signal("bearing 1", 55.0, 70.0, 120, 1.0),
    signal("bearing 2", 58.0, 74.0, 110, 1.0),
    signal("winding 1", 70.0, 105.0, 75, 1.0),
    signal("winding 2", 70.0, 105.0, 85, 1.0),
    signal("winding 3", 70.0, 105.0, 95, 1.0),
    signal("oil", 60.0, 80.0, 150, 1.0),
    signal("coolant", 77.0, 83.0, 90, 1.0),
    signal("ambient", 23.0, 27.0, 300, 1.0),
];
const COLD_JUNCTION: Signal = signal("cold junction", 24.0, 28.0, 240, 0.5);
const SUPPLY: Signal = signal("supply", 24.0, 24.6, 20, 0.5);
const CURRENT: Signal = signal("current", 3.98, 4.02, 200, 0.01);

#[cfg(test)]
mod tests {
    use super::*;

    fn sensors(name: &str, seed: u64) -> Sensors {
        Sensors::new(Product::named(name).expect("built in"), seed)
    }

    fn celsius(sensors: &Sensors, now: Instant, channel: u8) -> Option<f64> {
        let voltage = sensors.thermocouple(now, channel, Thermocouple::K)?;
        Some(Thermocouple::K.celsius(voltage + Thermocouple::K.microvolts(sensors.cold_junction(now))))
    }

    #[test]
    fn the_process_depends_on_seed_and_time_alone() {
        let now = Instant::from_millis(123_400);
        let sample = |seed, now| celsius(&sensors("AXTC4CO", seed), now, 1).expect("closed");
        assert_eq!(sample(1, now), sample(1, now));
        assert_ne!(sample(1, now), sample(2, now));
        assert_ne!(sample(1, now), sample(1, now + Duration::from_millis(200)));
    }

    #[test]
    fn it_drifts_below_the_thresholds_and_never_jumps() {
        let sensors = sensors("AXTC4CO", 7);
        let mut before = celsius(&sensors, Instant::ZERO, 1).expect("closed");
        let (mut lowest, mut highest) = (f64::MAX, f64::MIN);
        for scan in 1..20_000u64 {
            let now = Instant::from_millis(scan * 200);
            let exhaust = celsius(&sensors, now, 1).expect("closed");
            assert!((59.9..=110.1).contains(&exhaust) && (exhaust - before).abs() < 0.7, "{before} to {exhaust}");
            (lowest, highest) = (lowest.min(exhaust), highest.max(exhaust));
            assert!(
                (24.0..=28.0).contains(&sensors.cold_junction(now)) && (24.0..=24.6).contains(&sensors.supply(now))
            );
            before = exhaust;
        }
        assert!(highest - lowest > 30.0, "alive: {lowest} to {highest}");
    }

    #[test]
    fn a_short_bridges_a_circuit_that_is_broken() {
        let mut thermocouples = sensors("AXTC4CO", 1);
        let mut rtds = sensors("AXRTD8CO", 1);
        for knob in [Knob::Open(1, None), Knob::Short(1)] {
            thermocouples.turn(knob).expect("a knob of this unit");
            rtds.turn(knob).expect("a knob of this unit");
        }
        assert_eq!(thermocouples.thermocouple(Instant::ZERO, 1, Thermocouple::J), Some(0.0));
        let curve = Curve::from_objects([3.9083, -5.775, -4.18301]);
        assert!(rtds.rtd(Instant::ZERO, 1, Wiring::Two, curve).main.is_some_and(|volts| volts < 0.01));
    }

    // B-10, B-11, B-12, B-13, B-14, B-18
    #[test]
    fn terminals_carry_what_current_sensor_and_wires_make() {
        let mut sensors = sensors("AXRTD8CO", 1);
        for knob in [Knob::SourceCurrent(Some(4.0)), Knob::Resistance(1, 100.0), Knob::LeadResistance(1, 2.0)] {
            sensors.turn(knob).expect("a knob of this unit");
        }
        let millivolts = |sensors: &Sensors, wiring| {
            let curve = Curve::from_objects([3.9083, -5.775, -4.18301]);
            let Terminals { main, wire } = sensors.rtd(Instant::ZERO, 1, wiring, curve);
            (main.map(|volts| (volts * 1e6).round() / 1e3), (wire * 1e6).round() / 1e3)
        };
        assert_eq!(millivolts(&sensors, Wiring::Two), (Some(416.0), 8.0));
        assert_eq!(millivolts(&sensors, Wiring::Three), (Some(416.0), 8.0));
        assert_eq!(millivolts(&sensors, Wiring::Four), (Some(408.0), 8.0));
        sensors.turn(Knob::Open(1, Some(Lead::A))).expect("a lead");
        assert_eq!(millivolts(&sensors, Wiring::Three), (None, 0.0));
        assert_eq!(millivolts(&sensors, Wiring::Four), (Some(0.0), 0.0), "no voltage on B: looks shorted");
        sensors.turn(Knob::Repair(1)).expect("an input");
        for lead in [Some(Lead::Ground), None] {
            sensors.turn(Knob::Open(1, lead)).expect("a lead");
            for wiring in [Wiring::Two, Wiring::Three, Wiring::Four] {
                assert_eq!(millivolts(&sensors, wiring).0, None, "{lead:?} with {wiring:?}");
            }
            sensors.turn(Knob::Repair(1)).expect("an input");
        }
        sensors.turn(Knob::Short(1)).expect("an input");
        assert_eq!(millivolts(&sensors, Wiring::Two).0, Some(16.0), "the wires are left");
    }

    #[test]
    fn knobs_that_are_not_there_are_refused_with_what_is() {
        let mut thermocouples = sensors("AXTC4CO", 1);
        let table = [
            (Knob::Temperature(5, 20.0), "there is no input 5: this unit has inputs 1 to 4"),
            (Knob::Open(0, None), "there is no input 0: this unit has inputs 1 to 4"),
            (Knob::Resistance(1, 100.0), "a unit with thermocouples has no resistance"),
            (Knob::Temperature(1, f64::NAN), "a temperature cannot be NaN: it is from -273.15 to 3000"),
            (Knob::Supply(Some(-1.0)), "a supply cannot be -1: it is from 0 to 100"),
        ];
        for (knob, complaint) in table {
            assert_eq!(thermocouples.turn(knob).expect_err("refused").to_string(), complaint);
        }
        let refused = sensors("AXRTD8CO", 1).turn(Knob::ColdJunction(Some(20.0))).expect_err("refused");
        assert_eq!(refused.to_string(), "a unit with RTDs has no cold junction");
    }
}
