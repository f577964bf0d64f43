//! What both products make of their inputs, in virtual time, against the acceptance items.

use super::super::knob::{Knob, Lead};
use super::super::rtd_curve::R0;
use super::*;
use crate::canopen::ObjectAddress;

/// A measurement with everything it needs, in virtual time.
struct Bench {
    now: Instant,
    sensors: Sensors,
    objects: Objects,
    active: ActiveErrors,
    measurement: Measurement,
}

impl Bench {
    /// A unit whose process is at rest and whose first data are there.
    fn new(name: &str) -> Self {
        let product = Product::named(name).expect("built in");
        let mut objects = Objects::factory(product, 127);
        let sensors = Sensors::new(product, 1);
        let measurement = Measurement::start(Instant::ZERO, product, &sensors, &mut objects);
        let active = ActiveErrors::default();
        let mut bench = Bench { now: Instant::ZERO, sensors, objects, active, measurement };
        for channel in 1..=product.measurement.channels {
            bench.turn(Knob::Temperature(channel, 20.0));
        }
        match product.measurement.sensors {
            SensorKind::Thermocouple => bench.turn(Knob::ColdJunction(Some(25.0))),
            SensorKind::Rtd => bench.turn(Knob::SourceCurrent(Some(4.0))),
        }
        bench.run_ms(6_000);
        bench
    }

    fn tc4() -> Self {
        Bench::new("AXTC4CO")
    }

    fn rtd8() -> Self {
        Bench::new("AXRTD8CO")
    }

    fn turn(&mut self, knob: Knob) {
        self.sensors.turn(knob).expect("a knob of this unit");
    }

    fn write(&mut self, index: u16, sub: u8, number: f64) {
        let data_type = self.objects.get(index, sub).data_type();
        let value = match data_type.range() {
            None => Value::Real32(number as f32),
            Some(_) => data_type.integer(number as i64).expect("a value of the type"),
        };
        self.objects.write(ObjectAddress::new(index, sub), &value.encode()).expect("taken");
    }

    fn run_ms(&mut self, millis: u64) {
        let end = self.now + Duration::from_millis(millis);
        while self.measurement.deadline() <= end {
            self.now = self.measurement.deadline();
            self.measurement.step(self.now, &self.sensors, &mut self.objects, &mut self.active);
        }
        self.now = end;
    }

    fn celsius(&mut self, channel: u8, celsius: f64, millis: u64) {
        self.turn(Knob::Temperature(channel, celsius));
        self.run_ms(millis);
    }

    fn field_value(&self, channel: u8) -> f64 {
        self.objects.number(0x6100, channel)
    }

    fn process_value(&self, channel: u8) -> i64 {
        self.objects.integer(0x7130, channel)
    }

    fn status(&self, channel: u8) -> i64 {
        self.objects.integer(0x6150, channel)
    }

    fn errors(&self) -> Vec<u32> {
        (1..=self.objects.integer(0x1003, 0) as u8).map(|sub| self.objects.integer(0x1003, sub) as u32).collect()
    }

    fn assert_celsius(&self, channel: u8, expected: f64, within: f64) {
        let found = self.field_value(channel);
        assert!((found - expected).abs() <= within, "channel {channel}: {found} °C, not {expected}");
    }
}

// B-061, B-062, B-063, B-064, B-065
#[test]
fn voltages_become_temperatures_with_the_cold_junction_in_microvolts() {
    let mut bench = Bench::tc4();
    // Voltage of types J, K and T, the temperature with the cold junction at 25 °C, and the one without.
    let table = [
        (3_991.6, 3_096.0, 3_286.5, 100.0, [76.38, 75.89, 78.43]),
        (12_277.9, 9_153.1, 11_021.4, 250.0, [227.0, 225.6, 231.8]),
        (0.0, 0.0, 0.0, 25.0, [0.0, 0.0, 0.0]),
    ];
    for (j, k, t, compensated, plain) in table {
        for ((sensor_type, microvolts), plain) in [(1.0, j), (2.0, k), (7.0, t)].into_iter().zip(plain) {
            bench.write(0x6110, 2, sensor_type);
            bench.turn(Knob::Microvolts(2, microvolts));
            bench.write(0x2000, 2, 1.0);
            bench.run_ms(400);
            bench.assert_celsius(2, compensated, 0.05);
            assert!((bench.objects.number(0x2010, 2) - microvolts).abs() <= 0.6, "the raw reading");
            bench.write(0x2000, 2, 0.0);
            bench.run_ms(400);
            bench.assert_celsius(2, plain, 1.0);
        }
    }
}

// B-061: within 0.05 °C over the whole range of each type, at any cold junction.
#[test]
fn a_thermocouple_is_read_right_over_its_whole_range() {
    for (sensor_type, low, high) in [(1.0, -210.0, 1_200.0), (2.0, -270.0, 1_372.0), (7.0, -270.0, 400.0)] {
        let mut bench = Bench::tc4();
        bench.write(0x6110, 1, sensor_type);
        let steps = 160;
        for step in 0..=steps {
            let celsius = low + (high - low) * f64::from(step) / f64::from(steps);
            bench.turn(Knob::ColdJunction(Some(f64::from(step % 10) * 12.0 - 30.0)));
            bench.celsius(1, celsius, 200);
            bench.assert_celsius(1, celsius, 0.05);
        }
    }
}

// B-060, B-199, B-022, B-023
#[test]
fn all_thermocouples_are_read_together_and_nothing_is_said_before_its_time() {
    let product = Product::named("AXTC4CO").expect("built in");
    let mut objects = Objects::factory(product, 127);
    let mut sensors = Sensors::new(product, 1);
    let mut measurement = Measurement::start(Instant::ZERO, product, &sensors, &mut objects);
    sensors.turn(Knob::Open(3, None)).expect("an input");
    let mut errors = ActiveErrors::default();
    while measurement.deadline() < Instant::from_millis(3_000) {
        let now = measurement.deadline();
        assert_eq!(measurement.step(now, &sensors, &mut objects, &mut errors), None);
    }
    assert_eq!((objects.get(0x6100, 1), errors.count()), (Value::NOT_A_NUMBER, 0));
    let averages = [1, 2, 3].map(|sub| (objects.get(0x2100, sub), objects.integer(0x2130, sub)));
    assert_eq!(averages, [(Value::NOT_A_NUMBER, -1); 3], "no average of nothing");
    assert_eq!(measurement.deadline(), Instant::from_millis(3_000));
    let raised = measurement.step(Instant::from_millis(3_000), &sensors, &mut objects, &mut errors);
    assert_eq!(raised, Some(vec![Emergency { code: INPUT_OVERLOAD, channel: 3, description: 0x02 }]));
    assert!(objects.number(0x6100, 1) > 20.0 && objects.number(0x6100, 4) > 20.0);
    assert_eq!((objects.integer(0x6150, 3), errors.count()), (0x03, 1));
    assert_eq!(measurement.deadline(), Instant::from_millis(3_200));
}

// B-066, B-067, B-069, B-29, B-30, B-33
#[test]
fn process_values_follow_the_formula_and_saturate() {
    for (celsius, counts) in [(-273.0, 0), (0.0, 4368), (25.0, 4768), (100.0, 5968), (250.0, 8368), (1735.0, 32128)] {
        assert_eq!(scaled(celsius, 16.0, 4368.0), counts);
    }
    for (celsius, counts) in [(0.0, 320), (25.0, 770), (100.0, 2120), (-40.0, -400)] {
        assert_eq!(scaled(celsius, 18.0, 320.0), counts, "tenths of °F");
    }
    assert_eq!((scaled(0.1, 16.0, 4368.0), scaled(0.02, 16.0, 4368.0)), (4370, 4368), "to the nearest");
    assert_eq!((scaled(1_000.0, 1_000.0, 0.0), scaled(1_000.0, -1_000.0, 0.0)), (i16::MAX, i16::MIN));
    for mut bench in [Bench::tc4(), Bench::rtd8()] {
        bench.celsius(1, 100.0, 1_000);
        assert!((bench.process_value(1) - 5968).abs() <= 1);
        bench.write(0x6126, 1, 18.0);
        bench.write(0x6127, 1, 320.0);
        bench.run_ms(1_000);
        assert!((bench.process_value(1) - 2120).abs() <= 1, "the next value is scaled with it");
    }
}

// B-070, B-129, B-39, B-40
#[test]
fn a_channel_that_is_switched_off_has_no_value_and_no_errors() {
    for mut bench in [Bench::tc4(), Bench::rtd8()] {
        bench.write(0x4030, 2, 0.0);
        bench.celsius(2, 300.0, 1_000);
        assert_eq!((bench.status(2), bench.errors()), (0x41, vec![0x4002_F011, 0x2002_F011]));
        bench.write(0x6112, 2, 0.0);
        bench.run_ms(200);
        assert_eq!(bench.objects.get(0x6100, 2), Value::NOT_A_NUMBER);
        assert_eq!((bench.process_value(2), bench.status(2), bench.errors()), (-1, 0, vec![]));
        assert_eq!(bench.objects.integer(0x1001, 0), 0);
        bench.write(0x6112, 2, 1.0);
        bench.celsius(2, 30.0, 2_000);
        bench.assert_celsius(2, 30.0, 0.1);
    }
}

// B-071, B-072, B-117, B-100
#[test]
fn an_open_thermocouple_is_found_within_1600_ms_and_its_end_at_once() {
    let mut bench = Bench::tc4();
    bench.turn(Knob::Open(2, None));
    bench.run_ms(1_400);
    assert_eq!(bench.status(2), 0x00);
    bench.assert_celsius(2, 20.0, 0.01);
    bench.run_ms(400);
    assert_eq!((bench.status(2), bench.process_value(2)), (0x03, -512));
    assert_eq!((bench.errors(), bench.objects.get(0x6100, 2)), (vec![0x0202_F001], Value::NOT_A_NUMBER));
    bench.turn(Knob::Repair(2));
    bench.run_ms(200);
    assert_eq!((bench.status(2), bench.errors()), (0x00, vec![]));
    bench.turn(Knob::Microvolts(2, 90_000.0));
    bench.run_ms(1_800);
    assert_eq!(bench.status(2), 0x03, "a voltage beyond the converter's range");
}

// B-130
#[test]
fn an_open_circuit_takes_the_place_of_threshold_errors() {
    let mut bench = Bench::tc4();
    bench.write(0x4030, 1, 0.0);
    bench.celsius(1, 300.0, 400);
    assert_eq!(bench.errors(), [0x4001_F011, 0x2001_F011]);
    bench.turn(Knob::Open(1, None));
    for _ in 0..9 {
        bench.run_ms(200);
        assert_ne!(bench.active.count(), 0, "at no moment is there no error");
    }
    assert_eq!((bench.status(1), bench.errors()), (0x03, vec![0x0201_F001]));
    bench.turn(Knob::Repair(1));
    bench.run_ms(200);
    assert_eq!((bench.status(1), bench.errors()), (0x41, vec![0x4001_F011, 0x2001_F011]));
}

// B-073
#[test]
fn the_cold_junction_is_measured_and_scaled() {
    let mut bench = Bench::tc4();
    assert_eq!((bench.objects.number(0x3100, 0), bench.objects.integer(0x3130, 0)), (25.0, 4768));
    bench.write(0x3126, 0, 10.0);
    bench.write(0x3127, 0, -50.0);
    bench.run_ms(200);
    assert_eq!(bench.objects.integer(0x3130, 0), 200);
}

// B-090, B-091, B-092, B-093, B-116, B-131, B-46, B-47, B-48, B-54, B-55, B-56, B-57, B-58
#[test]
fn thresholds_are_set_at_their_limits_and_clear_one_degree_away() {
    for mut bench in [Bench::tc4(), Bench::rtd8()] {
        let thresholds = [0x4000, 0x4010, 0x4020, 0x4030].map(|index| bench.objects.integer(index, 1));
        assert_eq!(thresholds, [-200, 1250, 2500, 5000], "from the factory");
        for channel in 1..=3 {
            bench.write(0x4030, channel, 0.0);
        }
        let story = [
            (124.8, 0x00, 0),
            (125.2, 0x20, 1),
            (124.2, 0x20, 1),
            (123.8, 0x00, 0),
            (250.2, 0x41, 2),
            (249.2, 0x41, 2),
            (248.8, 0x20, 1),
            (20.0, 0x00, 0),
            (-19.8, 0x00, 0),
            (-20.2, 0x10, 1),
            (-19.2, 0x10, 1),
            (-18.8, 0x00, 0),
        ];
        for (celsius, status, errors) in story {
            bench.celsius(1, celsius, 1_000);
            assert_eq!((bench.status(1), bench.errors().len()), (status, errors), "at {celsius}");
            assert_eq!(bench.process_value(1), i64::from(scaled(celsius, 16.0, 4368.0)), "the value stays");
        }
        bench.celsius(3, 130.0, 1_000);
        bench.celsius(1, -30.0, 1_000);
        assert_eq!(bench.errors(), [0x1001_F011, 0x2003_F011], "each channel has its own");
        assert_eq!((bench.status(1), bench.status(2), bench.status(3)), (0x10, 0x00, 0x20));
    }
}

// B-094, B-095, B-096, B-59, B-127, B-83
#[test]
fn a_threshold_counts_when_it_was_exceeded_without_a_break_for_the_delay() {
    for (mut bench, sweep) in [(Bench::tc4(), 200), (Bench::rtd8(), 1_000)] {
        bench.celsius(1, 100.0, 2_000);
        bench.celsius(1, 130.0, 4_800);
        assert_eq!(bench.status(1), 0x00);
        bench.run_ms(200 + 2 * sweep);
        assert_eq!((bench.status(1), bench.errors()), (0x20, vec![0x2001_F011]));
        bench.celsius(1, 100.0, sweep);
        assert_eq!(bench.status(1), 0x00, "gone at once");
        bench.celsius(1, 130.0, 4_000);
        bench.celsius(1, 124.9, sweep);
        bench.celsius(1, 130.0, 4_000);
        assert_eq!(bench.status(1), 0x00, "the time started over");
        bench.run_ms(1_000 + 2 * sweep);
        assert_eq!(bench.status(1), 0x20);
    }
}

// Errata E-D20.
#[test]
fn a_setting_that_changes_restarts_the_delay() {
    let changes: [(&str, u16, f64); 5] = [
        ("AXTC4CO", 0x4010, 1_240.0),
        ("AXTC4CO", 0x4030, 4_999.0),
        ("AXTC4CO", 0x6110, 2.0),
        ("AXRTD8CO", 0x6110, 10_000.0),
        ("AXRTD8CO", 0x3000, 4.0),
    ];
    for (name, index, number) in changes {
        let mut bench = Bench::new(name);
        bench.celsius(1, 200.0, 4_000);
        bench.write(index, 1, number);
        bench.run_ms(4_000);
        assert_eq!(bench.status(1), 0x00, "{name} {index:04X}h");
        bench.run_ms(3_000);
        assert_eq!(bench.status(1), 0x20, "{name} {index:04X}h");
    }
}

// B-097, B-098, B-49, B-50, B-51, B-115, B-75, B-76
#[test]
fn a_shutdown_is_listed_with_its_warning_and_shown_alone() {
    for (mut bench, channel, entry) in [(Bench::tc4(), 4, 0x4004_F011), (Bench::rtd8(), 8, 0x4008_F011)] {
        bench.celsius(channel, 300.0, 7_000);
        assert_eq!(bench.status(channel), 0x41);
        assert_eq!(bench.errors(), [entry, entry - 0x2000_0000]);
        assert_eq!(bench.objects.integer(0x1001, 0), 1);
    }
}

// B-32: the thresholds are compared with the field value.
#[test]
fn scaling_changes_no_status() {
    for mut bench in [Bench::tc4(), Bench::rtd8()] {
        bench.write(0x4030, 1, 0.0);
        bench.write(0x6126, 1, 1_000.0);
        bench.write(0x6127, 1, 10_000.0);
        bench.run_ms(1_000);
        assert_eq!((bench.process_value(1), bench.status(1)), (30_000, 0));
    }
}

// B-080, B-081, B-082, B-083, B-084, B-63, B-64, B-65, B-66, B-68, B-69
#[test]
fn averages_are_over_the_channels_that_have_a_temperature() {
    for (mut bench, bank) in [(Bench::tc4(), 2u8), (Bench::rtd8(), 4)] {
        let average = |bench: &Bench, sub| bench.objects.number(0x2100, sub);
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 0.05, "{found}, not {expected}");
        for channel in 1..=2 * bank {
            bench.turn(Knob::Temperature(channel, f64::from(channel) * 10.0));
        }
        bench.run_ms(2_000);
        let mean = |from: u8, to: u8| (from..=to).map(|c| f64::from(c) * 10.0).sum::<f64>() / f64::from(to - from + 1);
        close(average(&bench, 1), mean(1, bank));
        close(average(&bench, 2), mean(bank + 1, 2 * bank));
        close(average(&bench, 3), mean(1, 2 * bank));
        let counts = bench.objects.integer(0x2130, 1);
        assert!((counts - (mean(1, bank) * 16.0 + 4368.0).round() as i64).abs() <= 1);
        bench.write(0x6112, 1, 0.0);
        bench.run_ms(1_000);
        close(average(&bench, 1), mean(2, bank));
        bench.turn(Knob::Open(2, None));
        bench.run_ms(2_500);
        for channel in 3..=bank {
            bench.write(0x6112, channel, 0.0);
        }
        bench.run_ms(1_000);
        assert_eq!(bench.objects.get(0x2100, 1), Value::NOT_A_NUMBER, "nobody is left");
        assert_eq!(bench.objects.integer(0x2130, 1), -1);
        close(average(&bench, 3), mean(bank + 1, 2 * bank));
        bench.write(0x2112, 3, 0.0);
        bench.celsius(bank + 1, 300.0, 7_000);
        assert_eq!((bench.objects.get(0x2100, 3), bench.objects.integer(0x2130, 3)), (Value::NOT_A_NUMBER, -1));
        let hot = (mean(bank + 1, 2 * bank) * f64::from(bank) - f64::from(bank + 1) * 10.0 + 300.0) / f64::from(bank);
        close(average(&bench, 2), hot);
        assert_eq!(bench.errors().len(), 3, "averages have none of their own");
    }
}

// B-11, B-12, B-13, B-14, B-18, B-19, B-20
#[test]
fn wires_are_taken_out_as_the_sensor_type_says() {
    let mut bench = Bench::rtd8();
    for (channel, sensor_type) in [(1, 10_000.0), (2, 10_001.0), (3, 10_002.0)] {
        bench.write(0x6110, channel, sensor_type);
        bench.turn(Knob::Resistance(channel, 100.0));
        bench.turn(Knob::LeadResistance(channel, 2.0));
    }
    bench.run_ms(70_000);
    let ohm = |bench: &Bench, channel| (bench.objects.number(0x2000, channel) * 100.0).round() / 100.0;
    assert_eq!([1, 2, 3].map(|channel| ohm(&bench, channel)), [104.0, 100.0, 100.0]);
    bench.assert_celsius(1, 10.25, 0.1);
    bench.assert_celsius(2, 0.0, 0.1);
    bench.assert_celsius(3, 0.0, 0.1);
    assert_eq!([1, 2, 3].map(|channel| bench.objects.integer(0x2010, channel)), [416_000, 416_000, 408_000]);
    bench.turn(Knob::LeadResistance(1, 0.0));
    bench.run_ms(1_000);
    assert_eq!(bench.objects.integer(0x2010, 1), 400_000);
    bench.turn(Knob::Open(3, Some(Lead::A)));
    bench.run_ms(1_000);
    assert_eq!((bench.status(3), bench.process_value(3)), (0x05, -448), "no voltage on B");
}

// B-15, B-16, B-17
#[test]
fn the_current_is_measured_and_taken_into_account() {
    let mut bench = Bench::rtd8();
    bench.turn(Knob::Resistance(1, 138.5055));
    bench.turn(Knob::Supply(Some(48.0)));
    bench.write(0x6110, 1, 10_000.0);
    bench.turn(Knob::LeadResistance(1, 0.0));
    for current in [4.0, 3.8, 4.2] {
        bench.turn(Knob::SourceCurrent(Some(current)));
        bench.run_ms(2_000);
        bench.assert_celsius(1, 100.0, 0.1);
        assert!((bench.objects.number(0x5001, 0) - current).abs() < 0.001);
        assert!((bench.objects.integer(0x2010, 1) as f64 - current * 138_505.5).abs() < 2.0);
    }
    assert_eq!(bench.objects.number(0x5000, 0), 48.0);
}

// B-28
#[test]
fn resistances_become_temperatures_on_the_curve_of_the_channel() {
    let mut bench = Bench::rtd8();
    for (curve, expected) in [(1.0, 715.259), (2.0, 702.127), (3.0, 705.940), (4.0, 699.453), (5.0, 699.915)] {
        bench.write(0x3000, 5, curve);
        bench.turn(Knob::Resistance(5, 350.0));
        bench.run_ms(2_000);
        bench.assert_celsius(5, expected, 0.1);
    }
    bench.write(0x3000, 5, 1.0);
    for (ohm, celsius) in [(10.0, -219.539), (18.52, -200.0), (60.0, -100.631), (R0, 0.0), (194.1, 250.005)] {
        bench.turn(Knob::Resistance(5, ohm));
        bench.run_ms(2_000);
        bench.assert_celsius(5, celsius, 0.1);
    }
}

// B-34, B-35
#[test]
fn a_sweep_reads_one_channel_after_the_other() {
    let mut bench = Bench::rtd8();
    for channel in 1..=8 {
        bench.turn(Knob::Temperature(channel, 80.0));
    }
    let mut seen = vec![None; 8];
    let begin = bench.now;
    while bench.now.since(begin) < Duration::from_millis(1_000) {
        bench.run_ms(50);
        for channel in 1..=8 {
            if seen[usize::from(channel) - 1].is_none() && bench.field_value(channel) > 79.0 {
                seen[usize::from(channel) - 1] = Some(bench.now.since(begin));
            }
        }
    }
    let mut times: Vec<Duration> = seen.into_iter().map(|time| time.expect("updated within a second")).collect();
    times.sort();
    for pair in times.windows(2) {
        let gap = pair[1] - pair[0];
        assert!((Duration::from_millis(50)..=Duration::from_millis(250)).contains(&gap), "{times:?}");
    }
}

// B-37
#[test]
fn the_wires_are_measured_once_a_minute() {
    let mut bench = Bench::rtd8();
    bench.turn(Knob::Resistance(1, 100.0));
    bench.turn(Knob::LeadResistance(1, 2.0));
    bench.run_ms(70_000);
    bench.assert_celsius(1, 0.0, 0.1);
    bench.turn(Knob::LeadResistance(1, 3.0));
    bench.run_ms(1_000);
    assert!(bench.field_value(1) > 4.0, "old wires, new voltage: {}", bench.field_value(1));
    let mut waited = 1_000;
    while bench.field_value(1) > 0.1 {
        bench.run_ms(500);
        waited += 500;
        assert!(waited <= 61_500, "{waited} ms");
    }
    assert!(waited > 5_000, "not in every sweep");
}

// Errata E-C6.
#[test]
fn the_wires_are_measured_anew_when_a_channel_has_another_type_or_is_switched_on() {
    let mut bench = Bench::rtd8();
    bench.turn(Knob::Resistance(1, 100.0));
    for (lead, index, number, back) in
        [(2.0, 0x6110, 10_002.0, 10_001.0), (3.0, 0x6110, 10_000.0, 10_001.0), (4.0, 0x6112, 0.0, 1.0)]
    {
        bench.write(index, 1, number);
        bench.run_ms(2_000);
        bench.turn(Knob::LeadResistance(1, lead));
        bench.write(index, 1, back);
        bench.run_ms(2_000);
        bench.assert_celsius(1, 0.0, 0.1);
    }
}

// B-41, B-42, B-43, B-52, B-61
#[test]
fn open_and_short_circuits_of_an_rtd_are_seen_in_the_sweep_that_finds_them() {
    let mut bench = Bench::rtd8();
    bench.write(0x6126, 3, 18.0);
    bench.write(0x6127, 3, 320.0);
    let story = [
        (10.0, 0x10, None, 0x1003_F011),
        (660.0, 0x03, Some(-512), 0x0203_F001),
        (550.0, 0x41, None, 0x4003_F011),
        (3.0, 0x05, Some(-448), 0x0403_F001),
        (100.0, 0x00, Some(320), 0),
    ];
    for (ohm, status, process_value, entry) in story {
        bench.turn(Knob::Resistance(3, ohm));
        bench.run_ms(1_000);
        if matches!(status, 0x10 | 0x41) {
            assert!(bench.status(3) == 0, "{ohm}: only the thresholds, and these wait");
            bench.run_ms(7_000);
        }
        assert_eq!(bench.status(3), status, "{ohm} ohm");
        assert_eq!(bench.errors().first().copied().unwrap_or(0), entry, "{ohm} ohm");
        if let Some(expected) = process_value {
            assert_eq!(bench.process_value(3), expected, "{ohm} ohm");
        }
    }
    bench.turn(Knob::Open(3, Some(Lead::Ground)));
    bench.run_ms(1_000);
    assert_eq!(bench.status(3), 0x03, "the input is saturated");
}

// B-44, B-53
#[test]
fn a_frozen_converter_is_flagged_on_every_channel_that_is_on() {
    let mut bench = Bench::rtd8();
    bench.write(0x6112, 8, 0.0);
    bench.turn(Knob::Open(2, None));
    bench.run_ms(1_000);
    bench.turn(Knob::Freeze(true));
    bench.run_ms(3_500);
    for channel in 1..=7 {
        assert_eq!((bench.status(channel), bench.process_value(channel)), (0x81, -384), "channel {channel}");
    }
    assert_eq!((bench.status(8), bench.process_value(8)), (0x00, -1));
    let mut errors = bench.errors();
    errors.sort_unstable();
    assert_eq!(errors, (1..=7).map(|channel| 0x8000_FF00 | channel << 16).collect::<Vec<u32>>());
    bench.turn(Knob::Freeze(false));
    bench.run_ms(2_000);
    assert_eq!(bench.errors(), [0x0202_F001], "what was there before is seen again");
}

#[test]
fn a_converter_that_wakes_up_in_the_middle_of_its_first_sweep_reads_no_nonsense() {
    let product = Product::named("AXRTD8CO").expect("built in");
    for thaw_ms in (5_050..7_000).step_by(100) {
        let mut objects = Objects::factory(product, 127);
        let sensors = Sensors::new(product, 1);
        let measurement = Measurement::start(Instant::ZERO, product, &sensors, &mut objects);
        let mut bench = Bench { now: Instant::ZERO, sensors, objects, active: ActiveErrors::default(), measurement };
        bench.turn(Knob::Freeze(true));
        bench.run_ms(thaw_ms);
        assert_eq!([1, 8].map(|channel| bench.status(channel)), [0x81, 0x81]);
        bench.turn(Knob::Freeze(false));
        for _ in 0..50 {
            bench.run_ms(100);
            for channel in 1..=8 {
                let status = bench.status(channel);
                assert!(matches!(status, 0x00 | 0x81), "{status:02X}h of channel {channel}, thawed at {thaw_ms} ms");
            }
        }
        assert_eq!((bench.status(1), bench.status(8), bench.errors()), (0, 0, vec![]));
    }
}

// B-45
#[test]
fn constants_without_a_solution_are_a_math_error() {
    let mut bench = Bench::rtd8();
    bench.write(0x3000, 6, 0.0);
    for (index, constant) in [(0x3010, 1.0), (0x3020, -9.9), (0x3030, 0.0)] {
        bench.write(index, 6, constant);
    }
    bench.turn(Knob::Resistance(6, 350.0));
    bench.run_ms(2_000);
    assert_eq!((bench.status(6), bench.errors()), (0x09, vec![0x0806_FF00]));
}

// B-140
#[test]
fn a_row_says_why_a_value_is_missing() {
    let mut bench = Bench::rtd8();
    bench.write(0x6112, 1, 0.0);
    bench.turn(Knob::Open(2, None));
    bench.turn(Knob::Short(3));
    bench.turn(Knob::LeadResistance(3, 0.0));
    bench.run_ms(2_000);
    let field_values = row(&bench.objects, Source::FieldValue);
    assert_eq!(field_values.readings[..3], [Field::Disabled, Field::Open, Field::Short]);
    assert!(matches!(field_values.readings[3], Field::Value(celsius) if (celsius - 20.0).abs() < 0.1));
    assert_eq!(bench.measurement.channels[0].reading, Reading::Off);
    bench.write(0x6112, 1, 1.0);
    for round in 0..12 {
        assert!(round == 0 || bench.measurement.channels[0].reading != Reading::Off, "it is on");
        let reading = row(&bench.objects, Source::FieldValue).readings[0];
        let is_read = matches!(reading, Field::Value(celsius) if (celsius - 20.0).abs() < 0.1);
        assert!(is_read || reading == Field::Disabled, "{reading:?} of a channel that has just been switched on");
        bench.run_ms(100);
    }
    assert!(matches!(row(&bench.objects, Source::ProcessValue).readings[0], Field::Value(4_688.0)));
    let bench = Bench::tc4();
    let process_values = row(&bench.objects, Source::ProcessValue);
    assert_eq!(process_values.readings.len(), 5);
    assert_eq!(process_values.readings[0], Field::Value(4768.0), "the cold junction first");
}
