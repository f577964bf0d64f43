//! Lines drawn one below the other, and rules with a heading.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::format;
use crate::tui::theme::Theme;

/// `── Values ───────────────── field value, °C ──` over the whole width.
pub fn rule(theme: Theme, columns: u16, heading: &str, remark: &str) -> Line<'static> {
    let columns = usize::from(columns);
    let heading = format!(" {} ", format::keep_start(heading, columns.saturating_sub(6)));
    let room = columns.saturating_sub(2 + format::width(&heading) + 4);
    let remark = match format::keep_start(remark, room.saturating_sub(2)) {
        remark if remark.is_empty() => remark,
        remark => format!(" {remark} "),
    };
    let tail = if remark.is_empty() { 0 } else { 2 };
    let middle = columns.saturating_sub(2 + format::width(&heading) + format::width(&remark) + tail);
    Line::from(vec![
        Span::styled("──", theme.quiet()),
        Span::styled(heading, theme.heading()),
        Span::styled("─".repeat(middle), theme.quiet()),
        Span::raw(remark),
        Span::styled("─".repeat(tail), theme.quiet()),
    ])
}

/// Columns of a heading's rule beside its two texts.
pub const BESIDE_HEADING: usize = 10;

/// A label and what it is: `  Version   1.1.0`.
pub fn labelled(theme: Theme, label: &str, value: impl Into<Span<'static>>) -> Line<'static> {
    Line::from(vec![Span::styled(format!("  {}", format::left(label, LABEL_COLUMNS)), theme.quiet()), value.into()])
}

/// The same for a text in several lines: the label is beside the first of them.
pub fn labelled_rows(theme: Theme, label: &str, text: impl IntoIterator<Item = String>) -> Vec<Line<'static>> {
    let labels = std::iter::once(label).chain(std::iter::repeat(""));
    labels.zip(text).map(|(label, line)| labelled(theme, label, line)).collect()
}

/// Columns of a label, the blank after it included.
pub const LABEL_COLUMNS: usize = 12;

/// A text broken between words, with two columns to its left and right in an area of `columns`.
pub fn paragraph(text: &str, columns: usize, style: Style) -> Vec<Line<'static>> {
    let broken = format::wrap(text, columns.saturating_sub(4)).into_iter();
    broken.map(|line| Line::styled(format!("  {line}"), style)).collect()
}

/// Columns of a gauge's bar at most.
const MOST_GAUGE_COLUMNS: usize = 100;
/// Columns beside it: the blanks before it, and the percentage.
const BESIDE_GAUGE: usize = 11;

/// How much of something is done, from 0 to 1, in an area of `columns`: `  ██████░░░░   60 %`.
pub fn gauge(theme: Theme, share: f64, columns: usize) -> Line<'static> {
    let share = share.clamp(0.0, 1.0);
    let room = columns.saturating_sub(BESIDE_GAUGE).min(MOST_GAUGE_COLUMNS);
    let filled = (share * room as f64).floor() as usize;
    Line::from(vec![
        Span::raw("  "),
        Span::styled("█".repeat(filled), theme.good()),
        Span::styled("░".repeat(room - filled), theme.quiet()),
        Span::styled(format!("  {:>3.0} %", (share * 100.0).floor()), theme.strong()),
    ])
}

/// Draws lines from the top of an area on; what does not fit is left out.
pub fn draw(frame: &mut Frame, area: Rect, lines: impl IntoIterator<Item = Line<'static>>) {
    let area = area.intersection(frame.area());
    for (y, line) in (area.top()..area.bottom()).zip(lines) {
        frame.render_widget(line, Rect { y, height: 1, ..area });
    }
}

/// The part of `count` rows to show in `room` rows so that row `cursor` is in sight: the first row.
pub fn first_visible(cursor: usize, count: usize, room: usize) -> usize {
    let centred = cursor.saturating_sub(room / 2);
    centred.min(count.saturating_sub(room))
}

/// Splits an area after `rows` rows.
pub fn split(area: Rect, rows: u16) -> (Rect, Rect) {
    let rows = rows.min(area.height);
    (Rect { height: rows, ..area }, Rect { y: area.y + rows, height: area.height - rows, ..area })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_is_exactly_as_wide_as_asked() {
        let theme = Theme::new(crate::tui::theme::Palette::Mono);
        for columns in 10..100 {
            for remark in ["", "newest 12:00:00"] {
                assert_eq!(rule(theme, columns, "Values", remark).width(), usize::from(columns), "{columns} {remark}");
            }
        }
    }

    #[test]
    fn a_gauge_is_full_only_when_all_is_done_and_takes_any_share() {
        let theme = Theme::new(crate::tui::theme::Palette::Mono);
        let drawn = |share| gauge(theme, share, 21).to_string();
        assert_eq!(drawn(0.999), "  █████████░   99 %");
        assert_eq!([drawn(-1.0), drawn(1.0), drawn(2.0)], [drawn(0.0), drawn(7.0), "  ██████████  100 %".to_owned()]);
    }

    #[test]
    fn the_cursor_is_always_in_sight() {
        for (cursor, first) in [(0, 0), (4, 0), (5, 0), (6, 1), (18, 10), (19, 10)] {
            assert_eq!(first_visible(cursor, 20, 10), first, "{cursor}");
        }
        assert_eq!(first_visible(3, 4, 10), 0);
    }
}
