//! A curve over time: round numbers and the unit on its axis, round times below it, a cursor and marks.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::dots::Dots;
use super::scale::{self, Scale};
use super::{format, lines};
use crate::monitor::Mark;
use crate::time::{Duration, Instant};
use crate::tui::theme::Theme;
use crate::wire::stream::Source;

/// What a chart shows.
pub struct Curve {
    /// Samples, oldest first; `None` where nothing was measured: the curve has a gap there.
    pub samples: Vec<(Instant, Option<f64>)>,
    /// The moments at the left and at the right edge.
    pub window: (Instant, Instant),
    /// What the values are.
    pub quantity: Quantity,
    /// The moment somebody looks at.
    pub cursor: Option<Instant>,
    /// Moments somebody has marked.
    pub marks: Vec<Mark>,
    /// What to say where there is no value at all.
    pub without: String,
    /// Columns of the labels at least, so that several charts have the same moment in the same column.
    pub label_columns: u16,
}

/// What is drawn: its unit, and how fine it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The unit, `°C`.
    pub unit: &'static str,
    /// What the scale spans at least: less than this is noise.
    pub least_span: f64,
}

/// Shortest window: with the first row alone there is no time to draw.
const SHORTEST: Duration = Duration::from_secs(1);
/// The noise of a thermocouple scanner is some hundredths of a degree.
const LEAST_SPAN: f64 = 0.2;
/// A scale of fewer steps of the last digit would show steps.
const LEAST_STEPS: f64 = 5.0;
/// Rows below the curve: the axis and its times.
const AXIS_ROWS: u16 = 2;

impl Quantity {
    /// What rows of this source carry, with this many digits after the point.
    pub fn of(source: Source, decimals: usize) -> Self {
        let step = 10f64.powi(-i32::try_from(decimals).unwrap_or(i32::MAX));
        let unit = match source {
            Source::FieldValue => "°C",
            Source::ProcessValue => "counts",
        };
        Quantity { unit, least_span: LEAST_SPAN.max(LEAST_STEPS * step) }
    }
}

impl Curve {
    /// The scale of its values in an area of this many rows; `None` if there is no value.
    fn scale(&self, rows: u16) -> Option<Scale> {
        let (low, high) = self.extremes()?;
        Some(Scale::new(low, high, self.quantity.least_span, rows.saturating_sub(AXIS_ROWS)))
    }

    /// Its lowest and its highest value; nothing if there is none.
    pub fn extremes(&self) -> Option<(f64, f64)> {
        scale::extremes(self.samples.iter().filter_map(|&(_, value)| value))
    }

    /// Columns that its labels take in an area of this many rows.
    pub fn needed_columns(&self, rows: u16) -> u16 {
        let Some(scale) = self.scale(rows) else { return 0 };
        let texts = scale.ticks.iter().map(|&tick| scale.label(tick)).chain([self.quantity.unit.to_owned()]);
        // A blank before it, as before everything on the screens.
        texts.map(|text| format::width(&text)).max().unwrap_or_default() as u16 + 2
    }
}

/// Draws it; `start_of_day` is the time of day at the start of time.
pub fn draw(theme: Theme, start_of_day: Duration, curve: &Curve, area: Rect, frame: &mut Frame) {
    let Some(scale) = curve.scale(area.height) else {
        let text = format!("  {}", curve.without);
        return lines::draw(frame, area, [Line::styled(text, theme.quiet())]);
    };
    let rows = area.height.saturating_sub(AXIS_ROWS);
    let labels: Vec<(u16, String)> = scale
        .ticks
        .iter()
        .map(|&tick| (((1.0 - scale.place(tick)) * f64::from(rows.max(1) - 1)).round() as u16, scale.label(tick)))
        .collect();
    let label_columns = curve.needed_columns(area.height).max(curve.label_columns);
    let columns = area.width.saturating_sub(label_columns + 1);
    if columns == 0 || rows == 0 {
        return;
    }
    let (from, to) = (curve.window.0, curve.window.1.max(curve.window.0 + SHORTEST));
    // How much of the window has passed; negative before it, which is cut off.
    let along =
        |at: Instant| (at.since(from).as_secs_f64() - from.since(at).as_secs_f64()) / to.since(from).as_secs_f64();
    let column = |at: Instant| (from <= at && at <= to).then(|| (along(at) * f64::from(columns - 1)).round() as u16);
    let dots = dots(curve, &scale, along, columns, rows);
    let cursor = curve.cursor.and_then(column);
    let marks: Vec<(u16, u64)> = curve.marks.iter().filter_map(|mark| Some((column(mark.at)?, mark.number))).collect();
    for row in 0..rows {
        let label = labels.iter().find(|(at, _)| *at == row).map(|(_, label)| label.as_str());
        let axis = format!(
            "{:>width$} {}",
            label.unwrap_or_default(),
            if label.is_some() { '┤' } else { '│' },
            width = usize::from(label_columns) - 1
        );
        let cells = (0..columns).map(|column| {
            let is_cursor = cursor == Some(column);
            match dots.character(column, row) {
                Some(dot) => (dot, if is_cursor { theme.strong() } else { theme.curve() }),
                None if is_cursor => ('│', theme.strong()),
                None => (mark_sign(&marks, column, row), theme.quiet()),
            }
        });
        let mut line = Line::styled(axis, theme.quiet());
        line.spans.extend(runs(cells));
        lines::draw(frame, Rect { y: area.y + row, height: 1, ..area }, [line]);
    }
    let times = scale::times(start_of_day, from, to, columns);
    let ticks: Vec<(u16, String)> = times.into_iter().filter_map(|(at, label)| Some((column(at)?, label))).collect();
    let below = Rect { y: area.y + rows, height: AXIS_ROWS, ..area };
    lines::draw(frame, below, axis(theme, &ticks, curve.quantity.unit, label_columns, columns));
}

/// The curve, in pieces where it has gaps.
fn dots(curve: &Curve, scale: &Scale, along: impl Fn(Instant) -> f64, columns: u16, rows: u16) -> Dots {
    let mut dots = Dots::new(columns, rows);
    let (right, bottom) = dots.last();
    for stretch in curve.samples.split(|(_, value)| value.is_none()) {
        let known = stretch.iter().filter_map(|&(at, value)| Some((at, value?)));
        dots.line(known.map(|(at, value)| (along(at) * right, (1.0 - scale.place(value)) * bottom)));
    }
    dots
}

/// What a mark puts in a cell: its number at the top, so that it can be told from others, a line below.
fn mark_sign(marks: &[(u16, u64)], column: u16, row: u16) -> char {
    if row > 0 {
        return if marks.iter().any(|(at, _)| *at == column) { '┊' } else { ' ' };
    }
    let digit = |&(at, number): &(u16, u64)| number.to_string().chars().nth(usize::from(column.checked_sub(at)?));
    marks.iter().rev().find_map(digit).unwrap_or(' ')
}

/// The axis with its ticks, the unit before it, and the times below.
fn axis(theme: Theme, ticks: &[(u16, String)], unit: &str, label_columns: u16, columns: u16) -> [Line<'static>; 2] {
    let line: String =
        (0..columns).map(|column| if ticks.iter().any(|(at, _)| *at == column) { '┬' } else { '─' }).collect();
    let padded = " ".repeat(usize::from(label_columns).saturating_sub(format::width(unit) + 1));
    let mut below = String::new();
    let start = usize::from(label_columns) + 1;
    for (at, label) in ticks {
        // Centred below its tick, but within the chart.
        let last = (start + usize::from(columns)).saturating_sub(label.len());
        let begin = (start + usize::from(*at)).saturating_sub(label.len() / 2).min(last);
        let Some(blanks) = begin.checked_sub(format::width(&below)) else { continue };
        below.push_str(&" ".repeat(blanks));
        below.push_str(label);
    }
    [Line::styled(format!("{padded}{unit} └{line}"), theme.quiet()), Line::styled(below, theme.quiet())]
}

/// Neighbours of the same style as one piece.
fn runs(cells: impl Iterator<Item = (char, Style)>) -> Vec<Span<'static>> {
    let mut runs: Vec<(String, Style)> = Vec::new();
    for (character, style) in cells {
        match runs.last_mut() {
            Some((text, before)) if *before == style => text.push(character),
            _ => runs.push((character.to_string(), style)),
        }
    }
    runs.into_iter().map(|(text, style)| Span::styled(text, style)).collect()
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;
    use crate::tui::theme::Palette;

    fn drawn(curve: &Curve, columns: u16, rows: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a test backend");
        let theme = Theme::new(Palette::Mono);
        let noon = Duration::from_secs(12 * 3600);
        terminal.draw(|frame| draw(theme, noon, curve, frame.area(), frame)).expect("drawing in memory");
        let text = terminal.backend().to_string();
        text.lines().map(|line| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    fn curve(samples: impl IntoIterator<Item = (u64, Option<f64>)>) -> Curve {
        Curve {
            samples: samples.into_iter().map(|(at, value)| (Instant::from_millis(at * 1000), value)).collect(),
            window: (Instant::ZERO, Instant::from_millis(60_000)),
            quantity: Quantity::of(Source::FieldValue, 3),
            cursor: None,
            marks: Vec::new(),
            without: "No value.".into(),
            label_columns: 0,
        }
    }

    #[test]
    fn a_curve_stands_between_round_numbers_and_gaps_stay_gaps() {
        let ramp = (0..=60).map(|second| (second, (!(20..40).contains(&second)).then(|| 20.0 + second as f64 / 6.0)));
        let mut curve = curve(ramp);
        curve.marks = vec![Mark { number: 12, at: Instant::from_millis(30_000) }];
        curve.cursor = Some(Instant::from_millis(50_000));
        insta::assert_snapshot!(drawn(&curve, 60, 11));
    }

    #[test]
    fn what_cannot_be_drawn_is_said_or_left_out() {
        assert_eq!(drawn(&curve([(0, None)]), 20, 2).trim_end(), "  No value.");
        let alone = drawn(&curve([(0, Some(20.0))]), 30, 6);
        assert_eq!(alone.chars().filter(|c| ('\u{2801}'..='\u{28FF}').contains(c)).count(), 1, "{alone}");
        for (columns, rows) in (1..20).flat_map(|columns| (1..8).map(move |rows| (columns, rows))) {
            drawn(&curve([(0, Some(20.0)), (60, Some(1e300)), (70, Some(-1e300))]), columns, rows);
        }
    }
}
