//! The unit's diagnostics as it prints them, and beside them the numbers found there.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::monitor::Tracked;
use crate::session::Job;
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Diagnostics";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "a line up" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "scroll", long: "a line down" },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "", long: "a page up" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "", long: "a page down" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "to the first line" },
];

/// Columns of the numbers found and their extremes, their labels aside.
const FOUND_COLUMNS: usize = 33;
/// Columns of a label at most: a value far from its name is hard to read.
const LONGEST_LABEL: usize = 36;
/// From this width on the page and what was found on it stand side by side.
const BESIDE: u16 = 120;
/// Rows that the numbers get at least below a page.
const LEAST_FOUND_ROWS: u16 = 7;

/// The page.
#[derive(Debug, Default)]
pub struct Diagnostics {
    scrolled: usize,
}

impl Diagnostics {
    /// What a command does here; `lines` are those of the longer half, `page` is the height of the picture.
    pub fn on(&mut self, cmd: Cmd, lines: usize, page: usize) -> Option<Action> {
        let last = lines.saturating_sub(page.saturating_sub(2));
        let page = page.saturating_sub(3).max(1);
        self.scrolled = match cmd {
            Cmd::Up => self.scrolled.saturating_sub(1),
            Cmd::Down => self.scrolled + 1,
            Cmd::PageUp => self.scrolled.saturating_sub(page),
            Cmd::PageDown => self.scrolled + page,
            Cmd::First => 0,
            _ => self.scrolled,
        }
        .min(last);
        None
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (theme, view) = (scene.theme, scene.view);
        let diagnostics = &view.monitor.diagnostics;
        let runs = view.job == Some(Job::Diagnostics);
        let Some(at) = diagnostics.at else {
            let mut rows = vec![lines::rule(theme, area.width, "Diagnostics", "")];
            let text = match (runs, &view.link.name) {
                (true, _) => "Waiting for the unit's first page: one comes every second.",
                (false, None) => "Not connected. Press 1 to choose a port or an emulated unit.",
                (false, Some(_)) if !view.can_send() => "No page of diagnostics in this recording.",
                (false, Some(_)) => "Press S: the unit shows its diagnostics once a second, until S stops it.",
            };
            rows.push(Line::raw(format!("  {text}")));
            return lines::draw(frame, area, rows);
        };
        let time = format::time_of_day(scene.start_of_day, at);
        let state = if runs { "S stops" } else { "stopped" };
        let remark = format!("page {}, {time}, {state}", format::grouped(diagnostics.pages));
        // Cut lines would hide what the unit says.
        let room = usize::from(if area.width >= BESIDE { area.width / 2 } else { area.width }).saturating_sub(2);
        let broken = diagnostics.lines.iter().flat_map(|line| format::pieces(&visible::text(line), room));
        let page: Vec<Line> = broken.map(|line| Line::raw(format!("  {line}"))).collect();
        let (left, right) = match area.width >= BESIDE {
            true => {
                let half = area.width / 2;
                (Rect { width: half, ..area }, Rect { x: area.x + half + 1, width: area.width - half - 1, ..area })
            }
            false => {
                let rows = (page.len() as u16 + 1).min(area.height.saturating_sub(LEAST_FOUND_ROWS));
                lines::split(area, rows)
            }
        };
        let (heading, body) = lines::split(left, 1);
        lines::draw(frame, heading, [lines::rule(theme, left.width, "As the unit prints it", &remark)]);
        // The longer half sets how far it goes; the other one stops at its end.
        let first = self.scrolled.min(page.len().saturating_sub(usize::from(body.height)));
        lines::draw(frame, body, page.into_iter().skip(first));
        self.draw_found(scene, right, frame);
    }

    /// The numbers on the page: with what they have been where there is room, else in two columns.
    fn draw_found(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (theme, found) = (scene.theme, &scene.view.monitor.diagnostics.found);
        let (heading, body) = lines::split(area, 1);
        let is_wide = area.width >= BESIDE / 2 && area.height > LEAST_FOUND_ROWS * 2;
        lines::draw(frame, heading, [lines::rule(theme, area.width, "Numbers on it", "")]);
        if is_wide {
            let label = usize::from(area.width).saturating_sub(FOUND_COLUMNS).min(LONGEST_LABEL);
            let (head, body) = lines::split(body, 1);
            let heads = format!("{}{:>12}{:>10}{:>10}", format::left(" ", label), "Now", "Min", "Max");
            lines::draw(frame, head, [Line::styled(heads, theme.quiet())]);
            let first = self.scrolled.min(found.len().saturating_sub(usize::from(body.height)));
            return lines::draw(frame, body, found.iter().skip(first).map(|tracked| row(scene, tracked, label, true)));
        }
        let half = body.width / 2;
        let label = usize::from(half).saturating_sub(14);
        let rows = found.len().div_ceil(2).max(1);
        for (number, column) in found.chunks(rows).enumerate() {
            let place = Rect { x: body.x + half * number as u16, width: half, ..body };
            let shown = column.iter().skip(self.scrolled.min(column.len().saturating_sub(usize::from(body.height))));
            lines::draw(frame, place, shown.map(|tracked| row(scene, tracked, label, false)));
        }
    }
}

fn row(scene: Scene, tracked: &Tracked, label: usize, with_extremes: bool) -> Line<'static> {
    let theme = scene.theme;
    let unit = tracked.unit.as_deref().map(visible::text).unwrap_or_default();
    let now = match tracked.value {
        Some(value) => Span::styled(format!("{:>12}", format!("{} {unit}", tracked.text(value))), theme.strong()),
        None => Span::styled(format!("{:>12}", "gone"), theme.quiet()),
    };
    let name = format::left(&visible::text(&tracked.label), label.saturating_sub(3));
    let mut line = Line::from(vec![Span::raw(format!("  {name} ")), now]);
    if with_extremes {
        line.push_span(Span::raw(format!("{:>10}{:>10}", tracked.text(tracked.min), tracked.text(tracked.max))));
    }
    line
}
