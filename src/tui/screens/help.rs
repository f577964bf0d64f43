//! All keys, made from the tables that give them their meaning.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::ScreenId;
use crate::tui::keymap::{Binding, EVERYWHERE, MENU};
use crate::tui::theme::Theme;
use crate::tui::widgets::{format, lines};

/// Columns of the keys.
const KEY_COLUMNS: usize = 17;
/// From this width on two columns of text stand side by side.
const TWO_COLUMNS: u16 = 150;

/// The page for the screen it was called from.
#[derive(Debug, Default)]
pub struct Help {
    scrolled: usize,
}

impl Help {
    /// Moves by rows, positive to the end.
    pub fn scroll(&mut self, rows: isize) {
        // The picture stops at the end; this stops soon behind it.
        let longest = page(Theme::new(crate::tui::theme::Palette::Mono), 80, ScreenId::Terminal).len();
        self.scrolled = self.scrolled.saturating_add_signed(rows).min(longest);
    }

    /// The picture.
    pub fn draw(&self, theme: Theme, screen: ScreenId, area: Rect, frame: &mut Frame) {
        if area.width >= TWO_COLUMNS {
            let half = area.width / 2 - 1;
            let (left, right) = (Rect { width: half, ..area }, Rect { x: area.x + half + 2, width: half, ..area });
            lines::draw(frame, left, keys(theme, half, screen));
            return lines::draw(frame, right, notes(theme, half));
        }
        let rows = page(theme, area.width, screen);
        let room = usize::from(area.height);
        if rows.len() <= room {
            return lines::draw(frame, area, rows);
        }
        // One row says how much more there is.
        let room = room.saturating_sub(1);
        let first = self.scrolled.min(rows.len().saturating_sub(room));
        let below = rows.len() - first - room.min(rows.len() - first);
        let more = match (first, below) {
            (_, 0) => format!("── ↑ {first} lines above "),
            (_, below) => format!("── ↓ {below} more lines below "),
        };
        let shown = rows.into_iter().skip(first).take(room);
        lines::draw(frame, area, shown.chain([Line::styled(more, theme.quiet())]));
    }
}

fn page(theme: Theme, columns: u16, screen: ScreenId) -> Vec<Line<'static>> {
    let mut rows = keys(theme, columns, screen);
    rows.push(Line::default());
    rows.extend(notes(theme, columns));
    rows
}

fn keys(theme: Theme, columns: u16, screen: ScreenId) -> Vec<Line<'static>> {
    let mut rows = Vec::new();
    let mut section = |heading: &str, remark: &str, table: &[Binding]| {
        if !rows.is_empty() {
            rows.push(Line::default());
        }
        rows.push(lines::rule(theme, columns, heading, remark));
        rows.extend(table.iter().map(|binding| {
            Line::from(vec![
                Span::raw("  "),
                Span::styled(format::left(&binding.names(), KEY_COLUMNS), theme.key()),
                Span::raw(binding.long),
            ])
        }));
    };
    let remark = if screen == ScreenId::Terminal { "letters after Ctrl-]" } else { "" };
    section(screen.title(), remark, screen.bindings());
    section("The unit's menu", "as in chapter 4 of the manual", MENU);
    section("Everywhere", "", EVERYWHERE);
    rows
}

fn notes(theme: Theme, columns: u16) -> Vec<Line<'static>> {
    let mut rows = vec![lines::rule(theme, columns, "Good to know", "")];
    for note in NOTES {
        let broken = format::wrap(note, usize::from(columns).saturating_sub(4));
        rows.extend(broken.into_iter().map(|line| Line::raw(format!("  {line}"))));
        rows.push(Line::default());
    }
    rows
}

const NOTES: [&str; 6] = [
    "On the terminal screen every character goes straight to the unit. Ctrl-] gives the next key to axcon: Ctrl-] 2 \
     shows the overview, Ctrl-] Q leaves. Arrows and page keys scroll and are never sent.",
    "V halts temperature scanning and CAN while the object dictionary is read, or until X leaves the unit's sub-menu.",
    "A click on a tab, a key or an answer does it, the wheel moves. On the terminal screen the mouse selects text; \
     elsewhere Shift and the mouse do.",
    "T is stored in the unit: a stream that is on comes back after every power cycle.",
    "D restores the object dictionary and restarts the unit. Node-ID and bit rate stay as LSS has set them.",
    "L checks the file completely before anything is sent, and believes only the banner of the new software.",
];
