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
use crate::tui::view::LinkState;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::units;

/// Name on the tab.
pub const TITLE: &str = "Diagnostics";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "a line up" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "scroll", long: "a line down" },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "", long: "a page up" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "", long: "a page down" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "to the first line" },
    Binding { keys: &[Press::Plain(KeyCode::End)], cmd: Cmd::Last, short: "", long: "to the last line" },
];

/// Columns of the numbers found and their extremes, their labels aside.
const FOUND_COLUMNS: usize = 33;
/// Columns of a label at most: a value far from its name is hard to read.
const LONGEST_LABEL: usize = 36;
/// From this width on the page and what was found on it are side by side.
const BESIDE: u16 = 120;
/// Columns of the numbers at least where they are beside the page, with their extremes.
const LEAST_FOUND_COLUMNS: u16 = 60;
/// Rows that the numbers get at least below a page.
const LEAST_FOUND_ROWS: u16 = 7;

/// The page.
#[derive(Debug, Default)]
pub struct Diagnostics {
    scrolled: usize,
}

impl Diagnostics {
    /// What a command does here; `last` is how far the longer half can be scrolled, `page` the height of the picture.
    pub fn on(&mut self, cmd: Cmd, last: usize, page: usize) -> Option<Action> {
        let page = page.saturating_sub(3).max(1);
        self.scrolled = cmd.moved(self.scrolled, last, page).unwrap_or(self.scrolled.min(last));
        None
    }

    /// How far the longer half can be scrolled.
    pub fn last(scene: Scene, area: Rect) -> usize {
        let parts = Parts::of(scene, area);
        let hidden = parts.page.len().saturating_sub(parts.page_room());
        hidden.max(parts.found_rows().saturating_sub(parts.found_room()))
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (theme, view) = (scene.theme, scene.view);
        let diagnostics = &view.unit.monitor.diagnostics;
        let runs = view.job == Some(Job::Diagnostics) || view.facts.diagnostics.is_some();
        let Some(at) = diagnostics.at else {
            let mut rows = vec![lines::rule(theme, area.width, "Diagnostics", "")];
            let text = match (runs, &view.link.name) {
                (true, Some(_)) if !view.can_send() => "Waiting for the unit's next page.",
                (true, _) => "Waiting for the unit's first page: one comes every second.",
                (false, None) => "Not connected. Press 1 to choose a port or an emulated unit.",
                (false, Some(_)) if !view.can_send() => "No page of diagnostics in this recording.",
                (false, Some(_)) => "Press S: the unit shows its diagnostics once a second, until S stops it.",
            };
            rows.push(Line::raw(format!("  {text}")));
            return lines::draw(frame, area, rows);
        };
        let time = format::time_of_day(scene.start_of_day, at);
        let state = match (runs, &view.link.state) {
            // Nobody knows what the unit does meanwhile.
            (_, LinkState::Lost(_)) => "link lost",
            (true, _) if !view.can_send() => "running",
            (true, _) if view.job.is_none() => "running, S stops them",
            (true, _) => "S stops",
            (false, _) => "stopped",
        };
        let mut remark = format!("page {}, {time}, {state}", format::grouped(diagnostics.pages));
        let parts = Parts::of(scene, area);
        let (heading, body) = lines::split(parts.left, 1);
        // The longer half sets how far it goes; the other one stops at its end.
        let first = self.scrolled.min(parts.page.len().saturating_sub(parts.page_room()));
        if let Some(more) = more(parts.page.len(), first, parts.page_room()) {
            remark = format!("{more}, {remark}");
        }
        lines::draw(frame, heading, [lines::rule(theme, parts.left.width, "As the unit prints it", &remark)]);
        lines::draw(frame, body, parts.page.iter().skip(first).map(|line| Line::raw(format!("  {line}"))));
        self.draw_found(scene, &parts, frame);
    }

    /// The numbers on the page: with what they have been where there is room, else in two columns.
    fn draw_found(&self, scene: Scene, parts: &Parts, frame: &mut Frame) {
        let (theme, area, found) = (scene.theme, parts.right, &parts.found);
        let (heading, body) = lines::split(area, 1);
        let first = self.scrolled.min(parts.found_rows().saturating_sub(parts.found_room()));
        let remark = more(parts.found_rows(), first, parts.found_room()).unwrap_or_default();
        lines::draw(frame, heading, [lines::rule(theme, area.width, "Numbers on it", &remark)]);
        if parts.is_wide() {
            let label = usize::from(area.width).saturating_sub(FOUND_COLUMNS).min(LONGEST_LABEL);
            let (head, body) = lines::split(body, 1);
            let heads = format!("{}{:>12}{:>10}{:>10}", format::left(" ", label), "Now", "Min", "Max");
            lines::draw(frame, head, [Line::styled(heads, theme.quiet())]);
            return lines::draw(frame, body, found.iter().skip(first).map(|tracked| row(scene, tracked, label, true)));
        }
        let half = body.width / 2;
        let label = usize::from(half).saturating_sub(14);
        for (number, column) in found.chunks(parts.found_rows().max(1)).enumerate() {
            let place = Rect { x: body.x + half * number as u16, width: half, ..body };
            lines::draw(frame, place, column.iter().skip(first).map(|tracked| row(scene, tracked, label, false)));
        }
    }
}

/// The page and its numbers, and where they are.
struct Parts {
    left: Rect,
    right: Rect,
    /// The page's lines, broken where they have to be.
    page: Vec<String>,
    found: Vec<Tracked>,
}

impl Parts {
    fn of(scene: Scene, area: Rect) -> Self {
        let diagnostics = &scene.view.unit.monitor.diagnostics;
        let printed: Vec<String> = diagnostics.lines.iter().map(|line| visible::text(line)).collect();
        // Rows broken in the middle of a number are hard to read: the numbers have what the page leaves beside it, or
        // stand below.
        let longest = printed.iter().map(|line| format::width(line)).max().unwrap_or_default();
        let needed = u16::try_from(longest + 4).unwrap_or(u16::MAX).max(area.width / 2);
        let is_beside = area.width >= BESIDE && needed.saturating_add(LEAST_FOUND_COLUMNS) < area.width;
        // Cut lines would hide what the unit says.
        let room = usize::from(if is_beside { needed } else { area.width }).saturating_sub(2);
        let page: Vec<String> = printed.iter().flat_map(|line| format::pieces(line, room)).collect();
        let found = named(&diagnostics.found);
        let (left, right) = if is_beside {
            let rest = Rect { x: area.x + needed + 1, width: area.width - needed - 1, ..area };
            (Rect { width: needed, ..area }, rest)
        } else {
            let rows = (page.len() as u16 + 1).min(area.height.saturating_sub(LEAST_FOUND_ROWS));
            lines::split(area, rows)
        };
        Parts { left, right, page, found }
    }

    fn page_room(&self) -> usize {
        usize::from(self.left.height.saturating_sub(1))
    }

    /// Whether the numbers have room for what they have been.
    fn is_wide(&self) -> bool {
        self.right.width >= LEAST_FOUND_COLUMNS && self.right.height > LEAST_FOUND_ROWS * 2
    }

    /// Rows that the numbers need, in two columns where they are not wide.
    fn found_rows(&self) -> usize {
        if self.is_wide() { self.found.len() } else { self.found.len().div_ceil(2) }
    }

    fn found_room(&self) -> usize {
        usize::from(self.right.height.saturating_sub(if self.is_wide() { 2 } else { 1 }))
    }
}

/// Which of this many rows are not in sight.
fn more(rows: usize, first: usize, room: usize) -> Option<String> {
    match (first, rows.saturating_sub(first + room)) {
        (0, 0) => None,
        (0, below) => Some(format!("↓ {below} more")),
        (above, 0) => Some(format!("↑ {above} more")),
        (above, below) => Some(format!("↑ {above} and ↓ {below} more")),
    }
}

/// Words that a page has in place of a channel's temperature (`wire::stream` knows those of the rows).
const STATES: [&str; 9] = ["open", "short", "shorted", "opencct", "shortcct", "disabled", "null", "off", "error"];

/// The numbers under names of their own. Where a channel has no temperature its state comes before the number after it,
/// `RTD1 Short C raw 4001 uV`: that is the `RTD1 raw` of other pages. Two quantities of one name are told apart by what
/// their units measure.
fn named(found: &[Tracked]) -> Vec<Tracked> {
    let mut named: Vec<Tracked> = Vec::new();
    let mut stated: Vec<Stated> = Vec::new();
    for tracked in found {
        let label = without_state(&tracked.label, &mut stated);
        let same = |known: &&mut Tracked| {
            known.label == label && known.unit == tracked.unit && (known.value.is_none() || tracked.value.is_none())
        };
        match named.iter_mut().find(same) {
            Some(known) => {
                known.value = known.value.or(tracked.value);
                known.decimals = known.decimals.max(tracked.decimals);
                (known.min, known.max) = (known.min.min(tracked.min), known.max.max(tracked.max));
            }
            None => named.push(Tracked { label, ..tracked.clone() }),
        }
    }
    let labels: Vec<(String, Option<String>)> =
        named.iter().map(|tracked| (tracked.label.clone(), tracked.unit.clone())).collect();
    for tracked in &mut named {
        let is_shared = labels.iter().any(|(label, unit)| *label == tracked.label && *unit != tracked.unit);
        let had_state = stated.iter().any(|known| known.about == tracked.label);
        if let Some(unit) = tracked.unit.as_deref().and_then(units::unit).filter(|_| is_shared || had_state) {
            tracked.label = format!("{} {}", tracked.label, unit.quantity);
        }
    }
    named
}

/// A label with a state in it, `RTD1 Short C raw`, and what the line is about.
struct Stated {
    label: String,
    about: String,
}

/// A label without its state, and without the unit of the temperature that the state stands for. `stated` are the
/// labels that had one so far. A later label on the same line inherits that line's name.
fn without_state(label: &str, stated: &mut Vec<Stated>) -> String {
    let of_line = stated.iter().find_map(|known| {
        let rest = label.strip_prefix(known.label.as_str())?;
        (rest.is_empty() || rest.starts_with(' ')).then(|| format!("{}{rest}", known.about))
    });
    if let Some(label) = of_line {
        return label;
    }
    let words: Vec<&str> = label.split(' ').collect();
    let is_state = |word: &&str| STATES.contains(&word.to_lowercase().as_str());
    let is_celsius = |word: &&str| units::unit(word).is_some_and(|unit| unit.name == "C");
    let state = words.iter().position(is_state);
    let state = state.filter(|state| *state > 0 && words.get(state + 1).is_some_and(is_celsius));
    let Some(state) = state else { return label.to_owned() };
    stated.push(Stated { label: label.to_owned(), about: words[..state].join(" ") });
    [&words[..state], &words[state + 2..]].concat().join(" ")
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::diagnostics::quantities;

    /// The names under which the numbers of these lines are shown, with the value they have now.
    fn names(lines: &[&str]) -> Vec<String> {
        let found: Vec<Tracked> = lines.iter().flat_map(|line| quantities(line)).filter_map(Tracked::first).collect();
        named(&found).into_iter().map(|tracked| tracked.label).collect()
    }

    #[test]
    fn two_quantities_of_a_channel_have_names_of_their_own() {
        assert_eq!(
            names(&["RTD5 125.8 C raw 7310 uV 148.25 Ohm PV 1258"]),
            ["RTD5 temperature", "RTD5 raw", "RTD5 resistance", "RTD5 PV"]
        );
        assert_eq!(names(&["Supply 24.1 V", "TC1 100.1 C"]), ["Supply", "TC1"], "where nothing is mixed up");
        assert_eq!(names(&["RTD1 10.0 kohm 20.0 C"]), ["RTD1 resistance", "RTD1 temperature"]);
        assert_eq!(names(&["Scan 12 ms 80 Hz"]), ["Scan time", "Scan frequency"]);
    }

    #[test]
    fn a_state_is_no_part_of_the_name_of_the_number_behind_it() {
        let row = "RTD1  Short C   raw    4001 uV   0.00 Ohm   PV  0";
        assert_eq!(names(&[row]), ["RTD1 raw", "RTD1 resistance", "RTD1 PV"]);
        let row = "RTD5   Null C   raw       0 uV   PV  0";
        assert_eq!(names(&[row]), ["RTD5 raw", "RTD5 PV"], "a channel that is switched off");
        assert_eq!(names(&["Short Circuits 3", "Last Error Code 7"]), ["Short Circuits", "Last Error Code"]);
        let mut found: Vec<Tracked> = Vec::new();
        for (line, value) in [("RTD1 20.0 C raw 4000 uV", None), ("RTD1 Short C raw 4001 uV", Some(()))] {
            let tracked = quantities(line).into_iter().filter_map(Tracked::first);
            found.extend(tracked.map(|tracked| Tracked { value: value.and(tracked.value), ..tracked }));
        }
        let shown: Vec<_> = named(&found).into_iter().map(|it| (it.label, it.value, it.min, it.max)).collect();
        assert_eq!(
            shown,
            [("RTD1 temperature".into(), None, 20.0, 20.0), ("RTD1 raw".into(), Some(4001.0), 4000.0, 4001.0)]
        );
    }
}
