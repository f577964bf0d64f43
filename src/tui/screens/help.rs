//! All keys, made from the tables that give them their meaning.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::ScreenId;
use crate::tui::keymap::{Binding, EVERYWHERE, MENU};
use crate::tui::theme::{Palette, Theme};
use crate::tui::widgets::{format, lines};

/// Columns of the keys.
const KEY_COLUMNS: usize = 17;
/// From this width on two columns of text are side by side, where all of it fits.
const TWO_COLUMNS: u16 = 150;

/// The page for the screen it was called from.
#[derive(Debug, Default)]
pub struct Help {
    /// Rows above those that are shown.
    scrolled: usize,
}

/// How the page lies in an area.
enum Layout {
    /// Keys on the left, the rest on the right.
    Beside([(Rect, Vec<Line<'static>>); 2]),
    /// One below the other.
    Below(Vec<Line<'static>>),
    /// The same, with more rows than there is room for: this many are shown, one row says how many are not.
    Scrolled(Vec<Line<'static>>, usize),
}

impl Help {
    /// Scrolls, if that is what the key does. `screen` and `area` are those of the picture.
    pub fn scrolls(&mut self, key: KeyCode, screen: ScreenId, area: Rect) -> bool {
        let (last, page) = match layout(Theme::new(Palette::Mono), screen, area) {
            Layout::Scrolled(rows, room) => (rows.len() - room, room.max(1)),
            Layout::Beside(_) | Layout::Below(_) => (0, 1),
        };
        let scrolled = self.scrolled.min(last);
        self.scrolled = match key {
            KeyCode::Up => scrolled.saturating_sub(1),
            KeyCode::Down => scrolled + 1,
            KeyCode::PageUp => scrolled.saturating_sub(page),
            KeyCode::PageDown => scrolled + page,
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => return false,
        }
        .min(last);
        true
    }

    /// The picture.
    pub fn draw(&self, theme: Theme, screen: ScreenId, area: Rect, frame: &mut Frame) {
        match layout(theme, screen, area) {
            Layout::Beside(halves) => halves.into_iter().for_each(|(half, rows)| lines::draw(frame, half, rows)),
            Layout::Below(rows) => lines::draw(frame, area, rows),
            Layout::Scrolled(rows, room) => {
                let first = self.scrolled.min(rows.len() - room);
                let more = match rows.len() - room - first {
                    0 => format!("── ↑ {} above ", format::counted(first, "line")),
                    below => format!("── ↓ {} below ", format::counted(below, "more line")),
                };
                let shown = rows.into_iter().skip(first).take(room);
                lines::draw(frame, area, shown.chain([Line::styled(more, theme.quiet())]));
            }
        }
    }
}

fn layout(theme: Theme, screen: ScreenId, area: Rect) -> Layout {
    let room = usize::from(area.height);
    if area.width >= TWO_COLUMNS {
        let half = area.width / 2 - 1;
        let (left, right) = (Rect { width: half, ..area }, Rect { x: area.x + half + 2, width: half, ..area });
        let (keys, notes) = (keys(theme, half, screen), notes(theme, half));
        if keys.len().max(notes.len()) <= room {
            return Layout::Beside([(left, keys), (right, notes)]);
        }
    }
    let mut rows = keys(theme, area.width, screen);
    rows.push(Line::default());
    rows.extend(notes(theme, area.width));
    if rows.len() <= room { Layout::Below(rows) } else { Layout::Scrolled(rows, room.saturating_sub(1)) }
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
        rows.extend(lines::paragraph(note, usize::from(columns), Style::new()));
        rows.push(Line::default());
    }
    rows.pop();
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
