//! What is known of the unit, its live values and its faults, on one page.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Line;

mod diagnosed;
mod faults;
mod unit;
mod values;

use faults::fault_rows;
use unit::unit;
pub use values::stand_in_line;

use super::{Scene, terminal};
use crate::monitor::{Channel, Stream};
use crate::session::{Job, UnitState};
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::view::LinkState;
use crate::tui::widgets::chart::{self, Curve, Quantity};
use crate::tui::widgets::lines;
use crate::wire::stream::Source;

/// Name on the tab.
pub const TITLE: &str = "Overview";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "channel above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "channel", long: "channel below" },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "", long: "faults above" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "faults", long: "faults below" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Restart,
        short: "restart min/max",
        long: "restart minimum and maximum",
    },
];

/// From this width on the raw terminal has room beside the values.
const BESIDE_COLUMNS: u16 = 140;
/// From this height on the chosen channel gets a chart.
const CHART_ROWS: u16 = 32;
/// Rows of the faults that the rest of the page leaves room for, with their heading, where there are any.
const FAULT_ROWS: usize = 3;

/// Rows of the unit that stay in any case: heading, product and version.
const LEAST_UNIT_ROWS: usize = 3;

/// The page.
#[derive(Debug, Default)]
pub struct Overview {
    cursor: usize,
    /// Faults above those that are shown.
    scrolled: usize,
}

/// Where the parts of the page are.
struct Parts {
    unit: Vec<Line<'static>>,
    values: Vec<Line<'static>>,
    chart_rows: u16,
    faults: Rect,
}

impl Overview {
    /// What a command does here; `faults` is how many of them there can be above those shown, and how many are
    /// shown at once.
    pub fn on(&mut self, cmd: Cmd, channels: usize, (last, shown): (usize, usize)) -> Option<Action> {
        self.scrolled = self.scrolled.min(last);
        self.cursor = self.cursor.min(channels.saturating_sub(1));
        match cmd {
            Cmd::Up => self.cursor = self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor = (self.cursor + 1).min(channels.saturating_sub(1)),
            Cmd::PageUp => self.scrolled = self.scrolled.saturating_sub(shown.max(1)),
            Cmd::PageDown => self.scrolled = (self.scrolled + shown.max(1)).min(last),
            Cmd::Restart => return Some(Action::RestartExtremes),
            _ => {}
        }
        None
    }

    /// How many faults there can be above those shown, and how many are shown at once.
    pub fn faults_at(&self, scene: Scene, area: Rect) -> (usize, usize) {
        let room = usize::from(self.parts(scene, page(area)).faults.height.saturating_sub(1));
        (fault_rows(scene).len().saturating_sub(room), room)
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let left = page(area);
        if left == area {
            return self.draw_page(scene, area, frame);
        }
        let right = Rect { x: area.x + left.width + 2, width: area.width - left.width - 2, ..area };
        self.draw_page(scene, left, frame);
        let (heading, text) = lines::split(right, 1);
        lines::draw(frame, heading, [lines::rule(scene.theme, right.width, "On the line", "3 shows all of it")]);
        lines::draw(frame, text, terminal::newest_lines(scene, text));
    }

    fn draw_page(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let parts = self.parts(scene, area);
        let (upper, rest) = lines::split(area, parts.unit.len() as u16);
        lines::draw(frame, upper, parts.unit);
        let (middle, rest) = lines::split(rest, parts.values.len() as u16);
        lines::draw(frame, middle, parts.values);
        let stream = &scene.view.unit.monitor.stream;
        if let Some(channel) = stream.channels.get(self.chosen(stream)).filter(|_| parts.chart_rows > 0) {
            draw_chart(scene, channel, lines::split(rest, parts.chart_rows).0, frame);
        }
        lines::draw(frame, parts.faults, self.faults(scene, parts.faults));
    }

    fn parts(&self, scene: Scene, area: Rect) -> Parts {
        let (mut unit, mut values) = (unit(scene, area.width), self.values(scene, area));
        // Faults are what one looks for: the blank line and what is below the values make room for them.
        let least = if has_faults(scene) { FAULT_ROWS } else { 0 };
        let too_many = |unit: &Vec<_>, values: &Vec<_>| unit.len() + values.len() + least > usize::from(area.height);
        if too_many(&unit, &values) {
            unit.pop();
        }
        // The line on top of every screen says it of a lost link already.
        let is_lost = matches!(scene.view.link.state, LinkState::Lost(_));
        if too_many(&unit, &values) && (is_lost || is_current(scene)) {
            values.pop();
        }
        // What was seen last outlives how the unit stood.
        while is_lost && too_many(&unit, &values) && unit.len() > LEAST_UNIT_ROWS {
            unit.pop();
        }
        let (_, rest) = lines::split(area, (unit.len() + values.len()) as u16);
        let has_chart = area.height >= CHART_ROWS && !scene.view.unit.monitor.stream.channels.is_empty();
        let chart_rows = if has_chart { rest.height * 3 / 5 } else { 0 };
        Parts { unit, values, chart_rows, faults: lines::split(rest, chart_rows).1 }
    }

    /// The number of the chosen channel: another unit may have fewer than the one before.
    fn chosen(&self, stream: &Stream) -> usize {
        self.cursor.min(stream.channels.len().saturating_sub(1))
    }
}

/// The part of the screen that the page takes: where there is room, the terminal is beside it.
fn page(area: Rect) -> Rect {
    if area.width < BESIDE_COLUMNS { area } else { Rect { width: area.width * 3 / 5, ..area } }
}

/// Whether there is anything in the list of faults: seen in the stream, or listed by the unit.
pub fn has_faults(scene: Scene) -> bool {
    !fault_rows(scene).is_empty()
}

/// Whether the link is there again, and the unit is being asked who it is and has not had the time to say so.
fn is_asked(scene: Scene) -> bool {
    let view = scene.view;
    let awaits = view.returning.is_some() && view.job == Some(Job::Identify);
    awaits && view.can_send() && view.facts.state == UnitState::Silent
}

/// Whether the values are those of now, so that nothing has to be said about them.
fn is_current(scene: Scene) -> bool {
    scene.view.unit.monitor.stream.source.is_some() && scene.view.why_old().is_none()
}

/// What rows of this source carry.
pub fn source_words(source: Source) -> &'static str {
    match source {
        Source::FieldValue => "field value (6100h) in °C",
        Source::ProcessValue => "process value (7130h) in counts",
    }
}

/// A value and its unit, the digits of all rows in the same columns. A unit after nothing would look like a value.
pub fn value_text(value: Option<f64>, source: Source, decimals: usize) -> String {
    let unit = match source {
        Source::FieldValue => " °C",
        Source::ProcessValue => "   ",
    };
    value.map_or_else(|| "-   ".to_owned(), |value| format!("{value:.decimals$}{unit}"))
}

/// What stands in the place of values where there are none: what to do to see them.
pub fn without_values(scene: Scene, columns: u16) -> Vec<Line<'static>> {
    let told = to_see_values(scene).into_iter();
    told.flat_map(|text| lines::paragraph(text, usize::from(columns), Style::new())).collect()
}

/// The same in sentences.
fn to_see_values(scene: Scene) -> Vec<&'static str> {
    if scene.view.link.name.is_none() {
        return vec!["Not connected. Press 1 to choose a port or an emulated unit."];
    }
    let mut told = match (scene.view.facts.state, scene.view.facts.stream) {
        (UnitState::Loader, _) => {
            vec!["The unit waits in its loader and measures nothing. Press L to load software."]
        }
        (_, Some(_)) => vec!["The stream is on. Waiting for its first row."],
        (UnitState::Silent, None) => vec![
            "Nothing has been heard from the unit.",
            "Check power and cable, then press M to ask again, or switch the unit off and on.",
        ],
        (UnitState::Unknown, None) => vec![
            "Something talks, but nothing that is known. Press 3 to see what it says.",
            "Signs like ‹9b› mean another baud rate: the units have 115200, 8 data bits, no parity.",
        ],
        (UnitState::Application, None) if !scene.view.unit.stream_is_off => {
            vec!["The unit has sent no values so far.", "Press T to switch its stream on."]
        }
        (UnitState::Application, None) => {
            vec!["The stream is off, so the unit sends no values.", "Press T to switch it on."]
        }
    };
    // What there is to do takes a unit; what signs mean is true of a recording, too.
    if !scene.view.can_send() && scene.view.facts.state != UnitState::Unknown {
        told.truncate(1);
    }
    told
}

fn draw_chart(scene: Scene, channel: &Channel, area: Rect, frame: &mut Frame) {
    let (heading, canvas) = lines::split(area, 1);
    let (theme, stream) = (scene.theme, &scene.view.unit.monitor.stream);
    lines::draw(frame, heading, [lines::rule(theme, area.width, &format!("Trend of {}", channel.name), "")]);
    let source = stream.source.unwrap_or(Source::FieldValue);
    let samples: Vec<_> = channel.newest(usize::MAX).collect();
    let ends = samples.first().zip(samples.last());
    let curve = Curve {
        window: ends.map(|(first, last)| (first.0, last.0)).unwrap_or_default(),
        quantity: Quantity::of(source, stream.decimals),
        cursor: None,
        marks: stream.marks.iter().copied().collect(),
        without: super::stream::without_value(channel),
        label_columns: 0,
        samples,
    };
    let (canvas, _) = lines::split(canvas, canvas.height.saturating_sub(1));
    chart::draw(theme, scene.start_of_day, &curve, canvas, frame);
}
