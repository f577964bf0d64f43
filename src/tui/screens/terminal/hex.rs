//! The bytes of both directions in hexadecimal digits, sixteen in a row.

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::record::{Direction, Record};
use crate::time::{Duration, Instant};
use crate::tui::theme::Theme;
use crate::tui::visible;
use crate::tui::widgets::format;

/// Bytes in a row of the hex view.
const HEX_BYTES: u64 = 16;
/// Columns of a row with time and offset.
const TIMED_COLUMNS: u16 = 88;

/// Where the hex view has been stopped: later bytes are not shown, nor are this many rows above them.
#[derive(Debug, Clone, Copy)]
pub(super) struct HexPlace {
    received: u64,
    sent: u64,
    rows: usize,
}

impl HexPlace {
    /// Behind the newest byte.
    pub(super) fn newest(record: &Record) -> Self {
        HexPlace { received: record.received(), sent: record.sent(), rows: 0 }
    }

    /// This many rows further up, or down, in a picture of `page` rows; `None` at the newest byte.
    pub(super) fn moved(self, up: i64, record: &Record, page: usize) -> Option<HexPlace> {
        let wanted = usize::try_from((self.rows as i64 + up).max(0)).unwrap_or(0);
        // Up to the page that is wanted, and no further: there may be half a million rows.
        let page = page.max(1);
        let there = if up > 0 { last_rows(record, &self, wanted, page).1 } else { usize::MAX };
        let rows = wanted.min(there.saturating_sub(page));
        (rows > 0).then_some(HexPlace { rows, ..self })
    }
}

/// A row of the hex view.
struct HexRow {
    direction: Direction,
    /// Offset of the first place in the row, a multiple of [`HEX_BYTES`].
    start: u64,
    /// Offset of the first byte in it.
    first: u64,
    bytes: Vec<u8>,
    at: Instant,
}

/// Rows of bytes ending at a place, as many as fit.
pub(super) fn rows(scene: Scene, area: Rect, place: Option<HexPlace>, with_times: bool) -> Vec<Line<'static>> {
    let room = usize::from(area.height);
    let place = place.unwrap_or_else(|| HexPlace::newest(scene.record));
    let (rows, _) = last_rows(scene.record, &place, place.rows, room);
    // Where there is no room for both, the time takes the place of the offset: the text at the end says most.
    let with_offset = !with_times || area.width >= TIMED_COLUMNS;
    let times = with_times.then_some(scene.start_of_day);
    rows.iter().rev().map(|row| hex_line(scene.theme, row, times, with_offset)).collect()
}

/// Rows of the newest bytes before a place, newest row first: the first `skip` of them are only counted, `most` are
/// built. Gives these, and how many rows were seen in all.
fn last_rows(record: &Record, place: &HexPlace, skip: usize, most: usize) -> (Vec<HexRow>, usize) {
    let mut rows: Vec<HexRow> = Vec::new();
    let mut seen = 0;
    // The row that is being put together, whether it is built or only counted.
    let mut last: Option<(Direction, u64, u64)> = None;
    for entry in record.entries().rev() {
        let limit = match entry.direction {
            Direction::FromUnit => place.received,
            Direction::ToUnit => place.sent,
        };
        let mut end = (entry.start + entry.bytes.len() as u64).min(limit);
        while end > entry.start {
            let start = ((end - 1) / HEX_BYTES * HEX_BYTES).max(entry.start);
            let bytes = &entry.bytes[(start - entry.start) as usize..(end - entry.start) as usize];
            let row_start = start / HEX_BYTES * HEX_BYTES;
            // Bytes of one row may have come in several pieces.
            let goes_on = last == Some((entry.direction, row_start, end));
            last = Some((entry.direction, row_start, start));
            if !goes_on {
                if rows.len() >= most {
                    return (rows, seen);
                }
                seen += 1;
                if seen > skip {
                    let (direction, at) = (entry.direction, entry.at);
                    rows.push(HexRow { direction, start: row_start, first: start, bytes: bytes.to_vec(), at });
                }
            } else if seen > skip
                && let Some(row) = rows.last_mut()
            {
                row.first = start;
                row.at = entry.at;
                row.bytes.splice(0..0, bytes.iter().copied());
            }
            end = start;
        }
    }
    (rows, seen)
}

fn hex_line(theme: Theme, row: &HexRow, times: Option<Duration>, with_offset: bool) -> Line<'static> {
    let skipped = (row.first - row.start) as usize;
    let mut numbers = String::new();
    let mut text = " ".repeat(skipped);
    for place in 0..HEX_BYTES as usize {
        if place == HEX_BYTES as usize / 2 {
            numbers.push(' ');
        }
        match place.checked_sub(skipped).and_then(|position| row.bytes.get(position)) {
            Some(byte) => {
                numbers.push_str(&format!("{byte:02x} "));
                text.push(visible::column(*byte));
            }
            None => numbers.push_str("   "),
        }
    }
    let (mark, style) = match row.direction {
        Direction::FromUnit => ("  ", Style::new()),
        Direction::ToUnit => ("» ", theme.sent()),
    };
    let time = times.map(|start| format!("{} ", format::time_of_day(start, row.at))).unwrap_or_default();
    Line::from(vec![
        Span::styled(time, theme.quiet()),
        Span::styled(mark, theme.quiet()),
        Span::styled(if with_offset { format!("{:08x}  ", row.start) } else { String::new() }, theme.quiet()),
        Span::styled(format!("{numbers} {text}"), style),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Secrecy;

    #[test]
    fn hex_rows_join_pieces_of_one_direction_and_keep_the_order() {
        let mut record = Record::new();
        let mut say = |millis, direction, bytes: &[u8]| {
            record.push(Instant::from_millis(millis), direction, Secrecy::Open, bytes);
        };
        say(1, Direction::FromUnit, b"0123456789");
        say(2, Direction::FromUnit, b"abcdefgh");
        say(3, Direction::ToUnit, b"m");
        say(4, Direction::FromUnit, b"ij");
        let place = HexPlace::newest(&record);
        let shown = |skip, most| -> Vec<(u64, String)> {
            let (rows, _) = last_rows(&record, &place, skip, most);
            rows.iter().map(|row| (row.start, String::from_utf8_lossy(&row.bytes).into())).collect()
        };
        let rows = shown(0, 9);
        let expected: [(u64, String); 4] =
            [(16, "ij".into()), (0, "m".into()), (16, "gh".into()), (0, "0123456789abcdef".into())];
        assert_eq!(rows, expected);
        for skip in 0..6 {
            assert_eq!(shown(skip, 1), expected.iter().skip(skip).take(1).cloned().collect::<Vec<_>>(), "{skip}");
        }
        assert_eq!(last_rows(&record, &place, 9, 1).1, 4, "all of them are counted");
        assert_eq!(last_rows(&record, &HexPlace { received: 10, sent: 0, rows: 0 }, 0, 9).0.len(), 1);
    }

    #[test]
    fn a_step_far_up_in_a_full_record_builds_one_row_and_not_half_a_million() {
        let mut record = Record::new();
        (0..1500).for_each(|_| {
            record.push(Instant::ZERO, Direction::FromUnit, Secrecy::Open, &[0x55; 4096]);
        });
        let place = HexPlace { received: record.received(), sent: 0, rows: 0 };
        let (rows, seen) = last_rows(&record, &place, 300_000, 1);
        assert_eq!((rows.len(), seen), (1, 300_001));
        assert_eq!(rows[0].start, record.received() - 16 * 300_001);
    }
}
