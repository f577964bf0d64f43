//! Marked moments, as a recording has them.

use crate::time::Duration;

/// Begins the remark in a recording that is a mark.
const MARK: &str = "mark ";

/// How a recording says that a moment was marked: `mark 1`, or of a moment of before `mark 1, 12.5 s before`.
pub fn marked(number: u64, before: Duration) -> String {
    // The rows have no finer times.
    match before.as_millis() {
        0 => format!("{MARK}{number}"),
        millis => format!("{MARK}{number}, {} s before", millis as f64 / 1000.0),
    }
}

/// The number of such a mark, and how long before it was set its moment lies.
pub(super) fn read_mark(text: &str) -> Option<(u64, Duration)> {
    let rest = text.strip_prefix(MARK)?;
    let (number, before) = rest.split_once(", ").map_or((rest, None), |(number, before)| (number, Some(before)));
    let before = before.map(|before| before.strip_suffix(" s before")?.parse().ok());
    let before = before.map_or(Some(Duration::ZERO), |seconds| Duration::try_from_secs_f64(seconds?).ok())?;
    Some((number.parse().ok()?, before))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_read_as_it_was_written() {
        for millis in [0, 1, 12_345, 86_400_000] {
            let before = Duration::from_millis(millis);
            assert_eq!(read_mark(&marked(7, before)), Some((7, before)));
        }
        assert_eq!(marked(2, Duration::from_nanos(541_544_519)), "mark 2, 0.541 s before");
        for other in ["mark", "mark x", "mark 1, 5 s", "mark 1, -5 s before", "marked 1", "break sent"] {
            assert_eq!(read_mark(other), None, "{other}");
        }
    }
}
