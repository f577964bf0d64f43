//! Numbers of things, as people read them, and as they write them on a command line.

use std::ops::RangeInclusive;

pub use crate::count::{counted, grouped};
use crate::time::Duration;

/// What there is of several kinds, `2 errors, 1 warning`; `None` if there is nothing.
pub fn counted_all(kinds: &[(u64, &str)]) -> Option<String> {
    let there = kinds.iter().filter(|(number, _)| *number > 0);
    let list: Vec<String> = there.map(|&(number, what)| counted(number, what)).collect();
    (!list.is_empty()).then(|| list.join(", "))
}

/// Reads a whole number of the command line that has to lie in this range. A refusal says which numbers are taken.
pub fn within<T>(range: RangeInclusive<u64>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: TryFrom<u64> + 'static,
{
    move |text: &str| {
        let number = text.parse::<u64>().ok().filter(|number| range.contains(number));
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| match (*range.start(), *range.end()) {
            (least, u64::MAX) => format!("it takes a whole number, {} or more", grouped(least)),
            (least, most) => format!("it takes a whole number from {} to {}", grouped(least), grouped(most)),
        })
    }
}

/// The longest time that is taken, a year: who wants more wants no end.
const LONGEST: Duration = Duration::from_secs(366 * 24 * 3600);

/// Reads a time of the command line, in seconds.
///
/// # Errors
/// If it is none, or too long or too short, with the times that are taken.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let time = text.parse::<f64>().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.filter(|time| !time.is_zero() && *time <= LONGEST)
        .ok_or_else(|| format!("it takes seconds, more than 0 and no more than {}", grouped(LONGEST.as_secs())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_outside_its_range_is_answered_with_the_range() {
        let period = within::<u64>(1..=60_000);
        assert_eq!([period("1"), period("60000")], [Ok(1), Ok(60_000)]);
        for refused in ["0", "60001", "-1", "abc", "1.5", ""] {
            assert_eq!(period(refused), Err("it takes a whole number from 1 to 60,000".into()), "{refused}");
        }
        assert_eq!(within::<u64>(1..=u64::MAX)("0"), Err("it takes a whole number, 1 or more".into()));
        assert_eq!(within::<u8>(1..=250)("250"), Ok(250));
    }

    #[test]
    fn a_time_has_a_fraction_and_an_end() {
        assert_eq!([seconds("0.5"), seconds("31622400")], [Ok(Duration::from_millis(500)), Ok(LONGEST)]);
        for refused in ["0", "-0.0", "-1", "1e-12", "31622401", "1e300", "inf", "nan", "abc", ""] {
            let said = "it takes seconds, more than 0 and no more than 31,622,400";
            assert_eq!(seconds(refused), Err(said.into()), "{refused}");
        }
    }

    #[test]
    fn what_is_not_there_is_not_said() {
        assert_eq!(counted_all(&[(0, "error"), (0, "warning")]), None);
        assert_eq!(counted_all(&[(2, "error"), (0, "note"), (1, "warning")]).as_deref(), Some("2 errors, 1 warning"));
    }
}
