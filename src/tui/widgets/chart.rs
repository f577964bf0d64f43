//! A curve over time, with its scale, a cursor and marks.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType};

use super::{format, lines};
use crate::time::{Duration, Instant};
use crate::tui::theme::Theme;

/// What a chart shows.
pub struct Curve {
    /// Samples, oldest first; `None` where nothing was measured: the curve has a gap there.
    pub samples: Vec<(Instant, Option<f64>)>,
    /// The moments at the left and at the right edge; those of the samples if not said.
    pub window: Option<(Instant, Instant)>,
    /// The moment somebody looks at.
    pub cursor: Option<Instant>,
    /// Moments somebody has marked.
    pub marks: Vec<Instant>,
}

/// Least span of the scale: less than this is noise.
const LEAST_SPAN: f64 = 1.0;

/// Draws it; `start_of_day` is the time of day at the start of time.
pub fn draw(theme: Theme, start_of_day: Duration, curve: &Curve, area: Rect, frame: &mut Frame) {
    let known: Vec<(Instant, f64)> =
        curve.samples.iter().filter_map(|&(at, value)| value.map(|value| (at, value))).collect();
    let (Some(&(first, _)), Some(&(last, _))) = (known.first(), known.last()) else {
        return lines::draw(frame, area, [Line::styled("  No value in this time.", theme.quiet())]);
    };
    let (from, to) = curve.window.unwrap_or((first, last));
    // Seconds behind the left edge; negative for what lies before it, which the chart cuts off.
    let x = |at: Instant| at.since(from).as_secs_f64() - from.since(at).as_secs_f64();
    let points: Vec<_> = curve.samples.iter().map(|&(at, value)| value.map(|value| (x(at), value))).collect();
    let stretches: Vec<Vec<(f64, f64)>> = points
        .split(Option::is_none)
        .map(|stretch| stretch.iter().flatten().copied().collect())
        .filter(|stretch: &Vec<_>| !stretch.is_empty())
        .collect();
    let (low, high) = known.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.1), h.max(p.1)));
    let spare = (LEAST_SPAN - (high - low)).max((high - low) * 0.1) / 2.0;
    let bounds = [low - spare, high + spare];
    let upright = |at: Instant| [(x(at), bounds[0]), (x(at), bounds[1])];
    let cursor = curve.cursor.map(upright);
    let marks: Vec<_> = curve.marks.iter().filter(|&&at| from <= at && at <= to).map(|&at| upright(at)).collect();
    let line =
        |points, marker, style| Dataset::default().marker(marker).graph_type(GraphType::Line).style(style).data(points);
    let mut datasets: Vec<Dataset> = marks.iter().map(|mark| line(mark, Marker::Dot, theme.quiet())).collect();
    datasets.extend(cursor.as_ref().map(|cursor| line(cursor, Marker::Braille, theme.strong())));
    datasets.extend(stretches.iter().map(|stretch| line(stretch, Marker::Braille, theme.curve())));
    let time = |at: Instant| format::time_of_day(start_of_day, at);
    let scale = |value: f64| format!("{value:>9.1}");
    let chart = Chart::new(datasets)
        .x_axis(
            Axis::default().bounds([0.0, x(to).max(1.0)]).labels([time(from), time(to.max(from))]).style(theme.quiet()),
        )
        .y_axis(
            Axis::default()
                .bounds(bounds)
                .labels([scale(bounds[0]), scale((bounds[0] + bounds[1]) / 2.0), scale(bounds[1])])
                .style(theme.quiet()),
        );
    frame.render_widget(chart, area);
}
