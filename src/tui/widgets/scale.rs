//! Scales with round numbers on them: of values, and of the time of day.

use crate::time::{Duration, Instant};

/// Rows from one label to the next at least.
const ROWS_PER_LABEL: f64 = 3.0;
/// Room above and below the values, as a part of what they span.
const MARGIN: f64 = 0.05;
/// Blanks between two times at least.
const BLANKS: usize = 4;

/// Seconds in a day.
const DAY: u64 = 86_400;

const MILLISECOND: u64 = 1;
const SECOND: u64 = 1000 * MILLISECOND;
const MINUTE: u64 = 60 * SECOND;
const HOUR: u64 = 60 * MINUTE;
/// From one labelled time to the next: what people count in.
const TIME_STEPS: [u64; 21] = [
    100 * MILLISECOND,
    200 * MILLISECOND,
    500 * MILLISECOND,
    SECOND,
    2 * SECOND,
    5 * SECOND,
    10 * SECOND,
    15 * SECOND,
    30 * SECOND,
    MINUTE,
    2 * MINUTE,
    5 * MINUTE,
    10 * MINUTE,
    15 * MINUTE,
    30 * MINUTE,
    HOUR,
    2 * HOUR,
    3 * HOUR,
    6 * HOUR,
    12 * HOUR,
    24 * HOUR,
];

/// The lowest and the highest of these values; nothing if there is none.
pub fn extremes(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (low <= high).then_some((low, high))
}

/// A scale of values.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// The value at the lower edge.
    pub low: f64,
    /// The value at the upper edge.
    pub high: f64,
    /// The values that get a label, upwards.
    pub ticks: Vec<f64>,
    /// Digits after the point of a label.
    decimals: usize,
}

impl Scale {
    /// A scale over `rows` rows for values from `low` to `high`: hardly more than these, but no less than `least_span`.
    pub fn new(low: f64, high: f64, least_span: f64, rows: u16) -> Self {
        // A number of many digits leaves no room for a finer scale.
        let least_span = least_span.max(low.abs().max(high.abs()) * 1e-9);
        let span = high - low;
        let spare = (span * MARGIN).max((least_span - span) / 2.0);
        let (low, high) = (low - spare, high + spare);
        let mut step = round_step((high - low) * ROWS_PER_LABEL / f64::from(rows.max(1)));
        let mut ticks = multiples(step, low, high);
        if ticks.len() < 2 {
            // One number alone says nothing of the scale. No step of a third of the span is without two.
            step = round_step((high - low) / 5.0);
            ticks = multiples(step, low, high);
        }
        let decimals = (-(step.log10() + HAIR).floor()).clamp(0.0, 9.0) as usize;
        Scale { low, high, ticks, decimals }
    }

    /// Where a value is, 0 at the lower edge, 1 at the upper one.
    pub fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// A value as its label says it.
    pub fn label(&self, value: f64) -> String {
        let decimals = self.decimals;
        // Nothing is "-0".
        format!("{:.decimals$}", value + 0.0)
    }
}

/// By how little numbers may miss each other that are the same to people: systems round powers and logarithms
/// differently, and none of them knows 0.1.
const HAIR: f64 = 1e-9;

/// The step of 1, 2 or 5 times a power of ten that is not less than `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powi((least.log10() + HAIR).floor() as i32);
    let steps = [1.0, 2.0, 5.0].map(|digit| digit * power);
    steps.into_iter().find(|step| *step >= least).unwrap_or(10.0 * power)
}

fn multiples(step: f64, low: f64, high: f64) -> Vec<f64> {
    let first = (low / step - HAIR).ceil();
    // A screen has no room for more; without a limit a value of hundreds of digits would count for ever.
    let all = (0..100).map(|number| (first + f64::from(number)) * step);
    all.take_while(|value| *value <= high + step * HAIR).collect()
}

/// The round times of day from `from` to `to` that have room for a label in `columns` columns, each with its label;
/// `start` is the time of day at the start of time. A midnight says how many days later it is: `00:00 +1d`.
pub fn times(start: Duration, from: Instant, to: Instant, columns: u16) -> Vec<(Instant, String)> {
    let span = to.since(from).as_millis().max(1);
    let widest = |step: u64| {
        let midnight = start + to.since_start();
        let midnight = Duration::from_secs(midnight.as_secs() / DAY * DAY);
        let of_midnight = if midnight >= start + from.since_start() { time_label(midnight, step).len() } else { 0 };
        time_label(Duration::ZERO, step).len().max(of_midnight)
    };
    let has_room = |step: &u64| {
        let room = u128::from(columns) * u128::from(*step) / span;
        room >= (widest(*step) + BLANKS) as u128
    };
    // A scale over days has its labels at midnights, with some days between them.
    let days = (1..12).map(|doublings| (24 * HOUR) << doublings);
    let Some(step) = TIME_STEPS.into_iter().chain(days).find(has_room) else { return Vec::new() };
    let nanos = u128::from(step) * 1_000_000;
    let begin = (start + from.since_start()).as_nanos().div_ceil(nanos) * nanos;
    let at = |number: u128| {
        let time = Duration::from_nanos(u64::try_from(begin + number * nanos).unwrap_or(u64::MAX));
        (Instant::ZERO + time.saturating_sub(start), time_label(time, step))
    };
    (0..u128::from(columns)).map(at).take_while(|(at, _)| *at <= to).collect()
}

/// A time since the first midnight, as finely as the step between two of them needs it.
fn time_label(time: Duration, step: u64) -> String {
    let (days, seconds) = (time.as_secs() / DAY, time.as_secs() % DAY);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match step {
        HOUR.. if days > 0 && time.as_secs().is_multiple_of(DAY) => format!("00:00 +{days}d"),
        MINUTE.. => format!("{hours:02}:{minutes:02}"),
        SECOND.. => format!("{hours:02}:{minutes:02}:{seconds:02}"),
        _ => format!("{hours:02}:{minutes:02}:{seconds:02}.{}", time.subsec_millis() / 100),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(low: f64, high: f64, least_span: f64, rows: u16) -> String {
        let scale = Scale::new(low, high, least_span, rows);
        scale.ticks.iter().map(|&tick| scale.label(tick)).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn labels_are_round_numbers() {
        assert_eq!(labels(61.782, 69.513, 0.2, 12), "62 64 66 68");
        assert_eq!(labels(25.245, 25.295, 0.2, 12), "25.20 25.25 25.30 25.35");
        assert_eq!(labels(-3.0, 4.0, 0.2, 8), "-2 0 2 4");
        assert_eq!(labels(4368.0, 5712.0, 5.0, 20), "4500 5000 5500");
        assert_eq!(labels(20.0, 20.0, 0.2, 3), "19.90 19.95 20.00 20.05 20.10");
    }

    #[test]
    fn a_scale_is_hardly_larger_than_its_values() {
        let scale = Scale::new(61.0, 71.0, 0.2, 12);
        assert_eq!((scale.low, scale.high), (60.5, 71.5));
        let noise = Scale::new(25.00, 25.05, 0.2, 12);
        assert!((noise.high - noise.low - 0.2).abs() < 1e-9, "{noise:?}");
    }

    #[test]
    fn times_are_round_and_have_room() {
        let noon = Duration::from_secs(12 * 3600);
        let shown = |from: u64, to: u64, columns| {
            let times = times(noon, Instant::from_millis(from), Instant::from_millis(to), columns);
            times.into_iter().map(|(_, label)| label).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(shown(33_000, 93_000, 70), "12:00:45 12:01:00 12:01:15 12:01:30");
        assert_eq!(shown(0, 3_600_000, 70), "12:00 12:10 12:20 12:30 12:40 12:50 13:00");
        assert_eq!(shown(0, 1000, 70), "12:00:00.0 12:00:00.2 12:00:00.4 12:00:00.6 12:00:00.8 12:00:01.0");
        assert_eq!(shown(0, 43_200_000, 70), "12:00 15:00 18:00 21:00 00:00 +1d");
        assert_eq!(shown(0, 3 * 86_400_000, 100), "12:00 00:00 +1d 12:00 00:00 +2d 12:00 00:00 +3d 12:00");
        assert_eq!(shown(0, 3 * 86_400_000, 70), "00:00 +1d 00:00 +2d 00:00 +3d");
        assert_eq!(shown(86_400_000, 90_000_000, 70), "12:00 12:10 12:20 12:30 12:40 12:50 13:00");
        assert_eq!(shown(0, 60_000, 5), "12:00", "there is room for one");
        assert_eq!(shown(0, 60_000, 0), "");
    }

    proptest! {
        #[test]
        fn any_values_get_a_scale_that_holds_them(low in -1e12f64..1e12, span in 0f64..1e12, rows in 0u16..200) {
            let scale = Scale::new(low, low + span, 0.2, rows);
            prop_assert!(scale.low <= low && low + span <= scale.high && scale.low < scale.high);
            prop_assert!((2..=100).contains(&scale.ticks.len()), "{scale:?}");
            prop_assert!(scale.ticks.len() <= usize::from(rows).max(6));
            prop_assert!(scale.ticks.iter().all(|&tick| (-1e-6..=1.0 + 1e-6).contains(&scale.place(tick))));
        }

        #[test]
        fn times_lie_in_their_window_and_apart(from in 0u64..1_000_000_000, span in 0u64..10_000_000_000, columns in 0u16..300) {
            let (from, to) = (Instant::from_millis(from), Instant::from_millis(from + span));
            let times = times(Duration::from_secs(50_000), from, to, columns);
            prop_assert!(times.iter().all(|(at, _)| from <= *at && *at <= to));
            prop_assert!(times.len() <= usize::from(columns) / 9 + 1, "{times:?}");
        }
    }
}
