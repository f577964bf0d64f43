//! The process the unit measures, and the knobs to disturb it.
//!
//! An engine that runs: two exhaust thermocouples that drift, the coolant, the surroundings. Every value is a
//! function of the seed and the time alone, made of additions and multiplications (no library sine), so that it is
//! the same on every machine and however often it is asked. What the firmware makes of it (open-circuit detection,
//! scaling) is in `firmware/scanner.rs`.

use crate::rng::Rng;
use crate::time::{Duration, Instant};

/// Thermocouple inputs of the unit (AXTC4CO manual, section 1.1).
pub const CHANNELS: usize = 4;

/// Standard deviation of one reading, roughly, in °C: lively in the third decimal, quiet in the first.
const NOISE_C: f64 = 0.02;

/// A thermocouple input, TC1 to TC4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Channel(usize);

impl Channel {
    /// The channel with this number, counted from 1 as the manual does.
    pub fn new(number: usize) -> Option<Self> {
        (1..=CHANNELS).contains(&number).then_some(Channel(number))
    }

    /// All of them in order.
    pub fn all() -> [Channel; CHANNELS] {
        std::array::from_fn(|position| Channel(position + 1))
    }

    /// Its number, from 1.
    pub fn number(self) -> usize {
        self.0
    }

    /// Its place in a list, from 0.
    pub fn position(self) -> usize {
        self.0 - 1
    }
}

/// What is connected to an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Condition {
    /// The default process.
    Process,
    /// A thermocouple at this temperature in °C.
    Temperature(f64),
    /// A broken wire.
    Open,
}

/// What the inputs carry at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Temperature of each thermocouple in °C; `None` where the circuit is open.
    pub thermocouples: [Option<f64>; CHANNELS],
    /// Cold junction in °C.
    pub cold_junction: f64,
    /// Supply voltage in V.
    pub supply: f64,
}

/// The process with its knobs. It goes on whether the unit has power or not.
#[derive(Clone, Debug)]
pub struct Sensors {
    chance: Rng,
    conditions: [Condition; CHANNELS],
    enabled: [bool; CHANNELS],
}

impl Sensors {
    /// The default process of a seed.
    pub fn new(seed: u64) -> Self {
        Sensors {
            chance: Rng::new(seed).fork("process"),
            conditions: [Condition::Process; CHANNELS],
            enabled: [true; CHANNELS],
        }
    }

    /// Connects something to an input.
    pub fn set(&mut self, channel: Channel, condition: Condition) {
        self.conditions[channel.position()] = condition;
    }

    /// Switches an input on or off, as a write to object 6112h does.
    pub fn set_enabled(&mut self, channel: Channel, enabled: bool) {
        self.enabled[channel.position()] = enabled;
    }

    /// Whether an input is switched on (object 6112h).
    pub fn is_enabled(&self, channel: Channel) -> bool {
        self.enabled[channel.position()]
    }

    /// Switches all inputs on, the factory setting of 6112h.
    pub fn restore_defaults(&mut self) {
        self.enabled = [true; CHANNELS];
    }

    /// What the inputs carry now.
    pub fn sample(&self, now: Instant) -> Sample {
        let thermocouples = Channel::all().map(|channel| match self.conditions[channel.position()] {
            Condition::Process => Some(self.signal(now, &THERMOCOUPLES[channel.position()])),
            Condition::Temperature(celsius) => Some(celsius + self.noise(now, THERMOCOUPLES[channel.position()].name)),
            Condition::Open => None,
        });
        Sample { thermocouples, cold_junction: self.signal(now, &COLD_JUNCTION), supply: self.signal(now, &SUPPLY) }
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

/// Below the warning threshold of 125 °C (object 4010h) all of them: a healthy engine.
const THERMOCOUPLES: [Signal; CHANNELS] = [
    Signal { name: "exhaust 1", low: 60.0, high: 110.0, drift: Duration::from_secs(45), noise: 1.0 },
    Signal { name: "exhaust 2", low: 60.0, high: 110.0, drift: Duration::from_secs(60), noise: 1.0 },
    Signal { name: "coolant", low: 77.0, high: 83.0, drift: Duration::from_secs(90), noise: 1.0 },
    Signal { name: "ambient", low: 23.0, high: 27.0, drift: Duration::from_secs(300), noise: 1.0 },
];
const COLD_JUNCTION: Signal =
    Signal { name: "cold junction", low: 24.0, high: 28.0, drift: Duration::from_secs(240), noise: 0.5 };
const SUPPLY: Signal = Signal { name: "supply", low: 24.0, high: 24.6, drift: Duration::from_secs(20), noise: 0.5 };

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_process_depends_on_seed_and_time_alone() {
        let (one, same, other) = (Sensors::new(1), Sensors::new(1), Sensors::new(2));
        let now = Instant::from_millis(123_400);
        assert_eq!(one.sample(now), same.sample(now));
        assert_ne!(one.sample(now), other.sample(now));
        assert_ne!(one.sample(now), one.sample(now + Duration::from_millis(200)));
    }

    #[test]
    fn it_drifts_within_its_bounds_and_never_jumps() {
        let sensors = Sensors::new(7);
        let mut before = sensors.sample(Instant::ZERO);
        let (mut lowest, mut highest) = (f64::MAX, f64::MIN);
        for scan in 1..20_000u64 {
            let sample = sensors.sample(Instant::from_millis(scan * 200));
            for (now, then) in sample.thermocouples.iter().zip(before.thermocouples) {
                let (now, then) = (now.expect("no wire is broken"), then.expect("no wire is broken"));
                assert!((23.0..=110.0).contains(&now), "{now}");
                assert!((now - then).abs() < 0.7, "from {then} to {now} in one scan");
            }
            let exhaust = sample.thermocouples[0].unwrap_or_default();
            (lowest, highest) = (lowest.min(exhaust), highest.max(exhaust));
            assert!((24.0..=28.0).contains(&sample.cold_junction) && (24.0..=24.6).contains(&sample.supply));
            before = sample;
        }
        assert!(highest - lowest > 30.0, "alive: {lowest} to {highest}");
    }

    #[test]
    fn a_knob_is_a_temperature_with_noise_or_nothing() {
        let mut sensors = Sensors::new(3);
        let [first, second, ..] = Channel::all();
        sensors.set(first, Condition::Temperature(250.0));
        sensors.set(second, Condition::Open);
        let sample = sensors.sample(Instant::from_millis(1));
        assert!((sample.thermocouples[0].expect("closed") - 250.0).abs() < 0.1);
        assert_eq!(sample.thermocouples[1], None);
        assert_eq!((Channel::new(0), Channel::new(5)), (None, None));
    }
}
