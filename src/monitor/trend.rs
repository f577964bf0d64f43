//! Hours of a channel's values in bounded memory.
//!
//! The newest samples are kept as they came ([`super::stream::KEPT_SAMPLES`]). This keeps the rest: the extremes and
//! the mean of equal stretches of time. When there is no room for another stretch, each two become one, so that the
//! whole time since the beginning is always there, at no less than half of [`MOST_STRETCHES`] points.

use crate::time::{Duration, Instant};

/// Stretches kept at most: more than the widest screen has dots.
pub const MOST_STRETCHES: usize = 4096;
/// Length of a stretch at the beginning: these last a quarter of an hour before two become one.
const FIRST_LENGTH: Duration = Duration::from_millis(250);

/// All values of a channel since the beginning, in stretches.
#[derive(Debug, Default)]
pub struct Trend {
    begun: Option<Instant>,
    /// The length of a stretch is [`FIRST_LENGTH`], doubled this often.
    doublings: u32,
    stretches: Vec<Stretch>,
}

/// What was measured during a stretch of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Smallest value; infinite if there was none.
    pub min: f64,
    /// Largest value; infinite if there was none.
    pub max: f64,
    /// Values.
    pub count: u64,
    /// The channel had no value at some time in it.
    pub has_gap: bool,
}

const NOTHING: Stretch = Stretch { min: f64::INFINITY, max: f64::NEG_INFINITY, count: 0, has_gap: false };

impl Trend {
    /// Takes in a sample, not older than those before it; `None` where the channel had no value.
    pub fn push(&mut self, at: Instant, value: Option<f64>) {
        let begun = *self.begun.get_or_insert(at);
        let mut place = self.place(at.since(begun));
        while place >= MOST_STRETCHES {
            self.halve();
            place = self.place(at.since(begun));
        }
        if place >= self.stretches.len() {
            self.stretches.resize(place + 1, NOTHING);
        }
        if let Some(stretch) = self.stretches.get_mut(place) {
            stretch.take(match value {
                Some(value) => Stretch { min: value, max: value, count: 1, has_gap: false },
                None => Stretch { has_gap: true, ..NOTHING },
            });
        }
    }

    /// The stretches in which there was anything, oldest first, each with the moment in its middle.
    pub fn stretches(&self) -> impl DoubleEndedIterator<Item = (Instant, Stretch)> {
        let (begun, length) = (self.begun.unwrap_or_default(), self.length());
        self.stretches
            .iter()
            .enumerate()
            .filter(|(_, stretch)| stretch.count > 0 || stretch.has_gap)
            .map(move |(place, &stretch)| (begun + length * place as u32 + length / 2, stretch))
    }

    /// Length of a stretch.
    pub fn length(&self) -> Duration {
        FIRST_LENGTH * 2u32.saturating_pow(self.doublings)
    }

    fn place(&self, after: Duration) -> usize {
        usize::try_from(after.as_nanos() / self.length().as_nanos()).unwrap_or(usize::MAX)
    }

    fn halve(&mut self) {
        self.doublings += 1;
        self.stretches = self
            .stretches
            .chunks(2)
            .map(|pair| {
                let mut both = NOTHING;
                pair.iter().for_each(|&stretch| both.take(stretch));
                both
            })
            .collect();
    }
}

impl Stretch {
    fn take(&mut self, other: Stretch) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.count += other.count;
        self.has_gap |= other.has_gap;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_day_of_rows_keeps_its_extremes_in_bounded_memory() {
        let mut trend = Trend::default();
        for second in 0..86_400u64 {
            let value = if second == 40_000 { 999.0 } else { (second % 60) as f64 };
            trend.push(Instant::from_millis(1000 * second), (second != 50_000).then_some(value));
        }
        let stretches: Vec<_> = trend.stretches().collect();
        assert!((MOST_STRETCHES / 2..=MOST_STRETCHES).contains(&stretches.len()), "{}", stretches.len());
        assert_eq!(stretches.iter().map(|(_, stretch)| stretch.count).sum::<u64>(), 86_399);
        let (at, peak) = stretches.iter().find(|(_, stretch)| stretch.max == 999.0).expect("the peak is kept");
        assert!(at.since(Instant::ZERO).abs_diff(Duration::from_secs(40_000)) <= trend.length(), "{at:?} {peak:?}");
        assert_eq!(stretches.iter().filter(|(_, stretch)| stretch.has_gap).count(), 1);
    }

    proptest! {
        #[test]
        fn nothing_is_lost_whatever_the_times(gaps in prop::collection::vec(0u64..10_000_000_000_000, 1..200)) {
            let mut trend = Trend::default();
            let mut at = Instant::from_millis(7);
            for (number, gap) in gaps.iter().enumerate() {
                at += Duration::from_nanos(*gap);
                trend.push(at, Some(number as f64));
            }
            let stretches: Vec<_> = trend.stretches().collect();
            prop_assert!(stretches.len() <= MOST_STRETCHES);
            prop_assert_eq!(stretches.iter().map(|(_, stretch)| stretch.count).sum::<u64>(), gaps.len() as u64);
            prop_assert!(stretches.windows(2).all(|pair| pair[0].0 < pair[1].0));
            let last = stretches.last().expect("something").1;
            prop_assert_eq!(last.max, (gaps.len() - 1) as f64);
        }
    }
}
