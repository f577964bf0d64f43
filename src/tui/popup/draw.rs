//! Where a popup is and what can be clicked on it; what it says is in `content`.

use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, BorderType, Clear};

use super::content::{Content, LIST_ROW, content, letter};
use super::{Popup, Question};
use crate::tui::keymap::Press;
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::widgets::lines;

/// Columns of a popup, borders included.
const COLUMNS: u16 = 66;
/// Columns of a popup with a list of files.
const LIST_COLUMNS: u16 = 78;
/// Rows of a list of files at most.
const MOST_LIST_ROWS: usize = 24;
/// Rows of a popup with a list of files that are not the list.
const AROUND_LIST: u16 = 12;
/// Rows of a popup that are not its content: the borders, and a blank row below the upper one.
const AROUND_CONTENT: u16 = 3;

/// A popup with its place, and what can be clicked on it.
struct Placed {
    window: Rect,
    inside: Rect,
    title: Span<'static>,
    rows: Vec<Line<'static>>,
    targets: Vec<(Rect, Target)>,
}

/// What a click on a popup means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The same as this key.
    Key(Press),
    /// An entry of the list of files.
    Entry(usize),
}

/// Draws a popup in the middle of an area.
pub fn draw(popup: &Popup, view: &View, theme: Theme, area: Rect, frame: &mut Frame) {
    let Placed { window, inside, title, rows, .. } = lay_out(popup, view, theme, area);
    let block = Block::bordered().border_type(BorderType::Rounded).border_style(theme.quiet()).title(title);
    frame.render_widget(Clear, window);
    frame.render_widget(block, window);
    lines::draw(frame, inside, rows);
}

/// What a click at this place of the screen means to the popup.
pub fn target_at(popup: &Popup, view: &View, theme: Theme, area: Rect, place: Position) -> Option<Target> {
    let targets = lay_out(popup, view, theme, area).targets;
    targets.into_iter().find_map(|(rect, target)| rect.contains(place).then_some(target))
}

fn lay_out(popup: &Popup, view: &View, theme: Theme, area: Rect) -> Placed {
    let is_list = matches!(popup, Popup::Asking(Question::PickFile { .. }));
    let columns = if is_list { LIST_COLUMNS } else { COLUMNS }.min(area.width);
    let inner = usize::from(columns).saturating_sub(4);
    let room = usize::from(area.height.saturating_sub(AROUND_LIST)).clamp(1, MOST_LIST_ROWS);
    let Content { title, mut rows, hints } = content(popup, view, theme, (inner, room));
    // What does not fit is left out, but not the keys below it.
    let most = usize::from(area.height.saturating_sub(AROUND_CONTENT)).saturating_sub(2);
    if rows.len() > most {
        rows.truncate(most.saturating_sub(1));
        rows.push(Line::raw("…"));
    }
    let hints_row = rows.len() + 1;
    let (line, keys) = keys_line(theme, hints);
    rows.extend([Line::default(), line]);
    let height = (rows.len() as u16 + 4).min(area.height);
    let y = match popup {
        // What is found has to stay in sight.
        Popup::Asking(Question::Find(_)) => area.bottom() - height,
        Popup::Asking(_) | Popup::Waiting { .. } | Popup::Failed { .. } => area.y + (area.height - height) / 2,
    };
    let window = Rect { x: area.x + (area.width - columns) / 2, y, width: columns, height };
    let style = match popup {
        Popup::Failed { .. } => theme.bad(),
        Popup::Asking(_) | Popup::Waiting { .. } => theme.heading(),
    };
    let inside = Rect {
        x: window.x + 2.min(window.width),
        y: window.y + 2.min(window.height),
        width: window.width.saturating_sub(4),
        height: window.height.saturating_sub(AROUND_CONTENT),
    };
    let place = |row: usize, x: u16, width: u16| {
        let rect = Rect { x: inside.x + x, y: inside.y + row as u16, width, height: 1 };
        rect.intersection(inside)
    };
    let choices = choices(popup, room).into_iter();
    let mut targets: Vec<(Rect, Target)> = choices.map(|(row, target)| (place(row, 0, inside.width), target)).collect();
    targets.extend(keys.into_iter().map(|(x, width, target)| (place(hints_row, x, width), target)));
    Placed { window, inside, title: Span::styled(format!(" {title} "), style), rows, targets }
}

/// The rows of the content that can be clicked on; a list of files has `room` rows.
fn choices(popup: &Popup, room: usize) -> Vec<(usize, Target)> {
    match popup {
        Popup::Asking(Question::Stream { .. }) => vec![(0, Target::Key(letter('f'))), (1, Target::Key(letter('p')))],
        Popup::Asking(Question::PickFile { picker, .. }) => {
            let entry = |row| Some((LIST_ROW + row, Target::Entry(picker.entry_at(row, room)?)));
            (0..room).filter_map(entry).collect()
        }
        Popup::Asking(_) | Popup::Waiting { .. } | Popup::Failed { .. } => Vec::new(),
    }
}

/// The line of the keys that answer, and where each of them is in it: its first column, and how many it has.
fn keys_line(theme: Theme, hints: Vec<(Press, &'static str)>) -> (Line<'static>, Vec<(u16, u16, Target)>) {
    let mut line = Line::default();
    let mut keys = Vec::new();
    for (press, meaning) in hints {
        let begin = line.width() as u16;
        line.push_span(Span::styled(press.name(), theme.key()));
        line.push_span(Span::raw(format!(" {meaning}")));
        keys.push((begin, line.width() as u16 - begin, Target::Key(press)));
        line.push_span(Span::raw("   "));
    }
    (line, keys)
}
