//! A curve in one line of text.

use super::scale::extremes;

const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The newest values, one column each, scaled between their extremes but over no less than `least_span`, so that noise
/// does not look like drama. A missing value leaves a gap.
pub fn sparkline(values: &[Option<f64>], columns: usize, least_span: f64) -> String {
    let newest = &values[values.len().saturating_sub(columns)..];
    let Some((low, high)) = extremes(newest.iter().flatten().copied()) else { return " ".repeat(newest.len()) };
    let spare = (least_span - (high - low)).max(0.0) / 2.0;
    let (low, high) = (low - spare, high + spare);
    let bar = |value: f64| {
        let step = (value - low) / (high - low) * (BARS.len() - 1) as f64;
        BARS[(step.round().max(0.0) as usize).min(BARS.len() - 1)]
    };
    newest.iter().map(|value| value.map_or(' ', bar)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_values_fill_the_line_and_gaps_stay_gaps() {
        let values: Vec<_> = (0..20).map(|n| (n != 17).then_some(f64::from(n))).collect();
        assert_eq!(sparkline(&values, 8, 1.0), "▁▂▃▄▅ ▇█");
        assert_eq!(sparkline(&[], 8, 1.0), "");
        assert_eq!(sparkline(&[None, None], 8, 1.0), "  ");
    }

    #[test]
    fn noise_within_the_least_span_stays_flat() {
        assert_eq!(sparkline(&[Some(20.0), Some(20.01), Some(19.99)], 8, 1.0), "▅▅▄");
    }
}
