//! The data stream: a table of all channels and the chosen one's curve over any time.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use super::overview::{source_words, stand_in_line, value_text, without_values};
use crate::monitor::{Channel, Stream as Values};
use crate::time::{Duration, Instant};
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::{NamedFor, Question};
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::chart::{self, Curve, Quantity};
use crate::tui::widgets::spark::sparkline;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::{Reading, Source};

/// Name on the tab.
pub const TITLE: &str = "Stream";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "channel above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "channel", long: "channel below" },
    Binding {
        keys: &[Press::Plain(KeyCode::Enter)],
        cmd: Cmd::Accept,
        short: "alone",
        long: "the chosen channel's curve alone, or all that have room",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('z'))],
        cmd: Cmd::Zoom,
        short: "zoom",
        long: "the chart's time: 1 or 10 minutes, 1 or 8 hours, everything",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char(' '))],
        cmd: Cmd::Pause,
        short: "pause",
        long: "hold the picture, or let it follow; rows come in meanwhile",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Left)],
        cmd: Cmd::Left,
        short: "",
        long: "hold the picture, cursor to an earlier moment",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Right)],
        cmd: Cmd::Right,
        short: "cursor",
        long: "cursor to a later moment",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::End)],
        cmd: Cmd::Last,
        short: "follow",
        long: "follow the newest row again",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('k'))],
        cmd: Cmd::Mark,
        short: "mark",
        long: "mark now or the cursor in chart, recording and CSV file",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Restart,
        short: "restart min/max",
        long: "restart minimum, maximum and mean",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('e'))],
        cmd: Cmd::Export,
        short: "export",
        long: "write rows kept and all that come to a CSV file; again: stop",
    },
];

/// What the chart can show, in the order of the key.
const WINDOWS: [(&str, Option<Duration>); 5] = [
    ("1 minute", Some(Duration::from_secs(60))),
    ("10 minutes", Some(Duration::from_secs(600))),
    ("1 hour", Some(Duration::from_secs(3600))),
    ("8 hours", Some(Duration::from_secs(8 * 3600))),
    ("everything", None),
];
/// Steps of the cursor over the whole width.
const CURSOR_STEPS: u32 = 60;
/// Smallest span of a trend: less than this is noise.
const LEAST_SPAN: f64 = 1.0;
/// Columns of the table before the trend begins.
const TABLE_COLUMNS: usize = 77;
/// A chart of fewer columns or rows, its heading and its axis among them, says little: then fewer are shown.
const LEAST_CHART: (u16, u16) = (60, 9);
/// Charts as high as this are one below the other, so that the same moment is in the same column of all.
const HIGH_CHART: u16 = 11;

/// The page.
#[derive(Debug, Default)]
pub struct Stream {
    channel: usize,
    window: usize,
    held: Option<Held>,
    /// The chosen channel's curve has all the room.
    alone: bool,
}

/// The picture is held.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// What is at the right edge.
    end: Instant,
    /// What is looked at.
    cursor: Instant,
}

impl Stream {
    /// Another link: nothing is held any more.
    pub fn begin_link(&mut self) {
        *self = Stream { window: self.window, alone: self.alone, ..Stream::default() };
    }

    /// The keys of the footer, by what they do now.
    pub fn footer(view: &View) -> Vec<Binding> {
        let named = |binding: &Binding| match binding.cmd {
            Cmd::Export if view.export.is_some() => Binding { short: "end export", ..*binding },
            _ => *binding,
        };
        BINDINGS.iter().map(named).collect()
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View) -> Option<Action> {
        let values = &view.unit.monitor.stream;
        let last = values.channels.len().saturating_sub(1);
        self.channel = self.channel.min(last);
        match cmd {
            Cmd::Up => self.channel = self.channel.saturating_sub(1),
            Cmd::Down => self.channel = (self.channel + 1).min(last),
            Cmd::Zoom => {
                self.window = (self.window + 1) % WINDOWS.len();
                self.keep_cursor_in_sight(values);
            }
            Cmd::Pause if self.held.is_some() => self.held = None,
            Cmd::Pause => self.held = values.newest.map(|at| Held { end: at, cursor: at }),
            Cmd::Left | Cmd::Right => self.move_cursor(values, cmd == Cmd::Left),
            Cmd::Last => self.held = None,
            Cmd::Accept => {
                self.alone = !self.alone;
                let text = if self.alone { "One curve has all the room." } else { "As many curves as fit." };
                return Some(Action::Tell(text.to_owned()));
            }
            Cmd::Restart => return Some(Action::RestartExtremes),
            // Without rows a moment is marked in the recording all the same.
            Cmd::Mark if view.link.name.is_none() => {
                return Some(Action::Tell("Nothing to mark: no unit is connected.".to_owned()));
            }
            Cmd::Export if values.channels.is_empty() && view.export.is_none() => {
                let how = if view.can_send() { " T switches the stream on." } else { "" };
                return Some(Action::Tell(format!("There are no rows to write to a file yet.{how}")));
            }
            Cmd::Mark => return Some(Action::Mark(self.held.map(|held| held.cursor))),
            Cmd::Export if view.export.is_some() => return Some(Action::EndExport),
            Cmd::Export => return Some(Action::Ask(Question::file_name(NamedFor::ExportStream, view))),
            _ => {}
        }
        None
    }

    fn move_cursor(&mut self, values: &Values, earlier: bool) {
        let Some(newest) = values.newest else { return };
        let held = self.held.unwrap_or(Held { end: newest, cursor: newest });
        let (from, _) = self.times(values, held.end);
        let step = (held.end.since(from) / CURSOR_STEPS).max(Duration::from_millis(1));
        let cursor = if earlier {
            from + held.cursor.since(from).saturating_sub(step)
        } else {
            (held.cursor + step).min(newest)
        };
        // The window that was moved to the cursor goes on with it.
        self.held = Some(Held { cursor, end: held.end.max(cursor) });
    }

    /// A narrower window ends where the one before did, which may be long after what is looked at: then it is moved there.
    fn keep_cursor_in_sight(&mut self, values: &Values) {
        let (Some(held), Some(length)) = (self.held, WINDOWS[self.window].1) else { return };
        if held.cursor < self.times(values, held.end).0 {
            self.held = Some(Held { end: (held.cursor + length / 2).min(held.end), ..held });
        }
    }

    /// The moments at the edges of the chart that ends at `end`.
    fn times(&self, values: &Values, end: Instant) -> (Instant, Instant) {
        let begun = values.channels.first().and_then(Channel::begun).unwrap_or(end);
        let from = match WINDOWS[self.window].1 {
            // A chart that is not full yet begins with the first row.
            Some(length) => Instant::ZERO + end.since_start().saturating_sub(length),
            None => begun,
        };
        (from.max(begun).min(end), end)
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (theme, values) = (scene.theme, &scene.view.unit.monitor.stream);
        let Some(newest) = values.newest else {
            let mut rows = vec![lines::rule(theme, area.width, "Stream", "")];
            rows.extend(without_values(scene, area.width));
            return lines::draw(frame, area, rows);
        };
        let table = self.table(scene, area.width);
        let (upper, rest) = lines::split(area, table.len() as u16);
        lines::draw(frame, upper, table);
        let (from, to) = self.times(values, self.held.map_or(newest, |held| held.end));
        let charts = self.charts(values, rest, (from, to));
        let curves: Vec<_> = charts
            .iter()
            .filter_map(|&(number, area)| Some((number, self.curve(scene, number, (from, to))?, area)))
            .collect();
        // Charts one below the other have their times in the same columns.
        let needed = curves.iter().map(|(_, curve, area)| curve.needed_columns(area.height.saturating_sub(1))).max();
        for (number, mut curve, area) in curves {
            curve.label_columns = needed.unwrap_or_default();
            let heading = lines::rule(
                theme,
                area.width,
                &self.title(values, number, &charts),
                &self.remark(scene, &curve, number, &charts),
            );
            let (above, canvas) = lines::split(area, 1);
            lines::draw(frame, above, [heading]);
            chart::draw(theme, scene.start_of_day, &curve, canvas, frame);
        }
    }

    /// Which channels get a chart, by their number, and where: as many as have room, the chosen one among them.
    fn charts(&self, values: &Values, area: Rect, (from, to): (Instant, Instant)) -> Vec<(usize, Rect)> {
        let Some(last) = values.channels.len().checked_sub(1) else { return Vec::new() };
        let chosen = self.channel.min(last);
        let (columns, rows) = room(area);
        if self.alone || columns * rows < 2 {
            return vec![(chosen, area)];
        }
        // A channel that is switched off or open all the time has nothing to draw.
        let draws = |channel: &Channel| channel.samples(from, to).iter().any(|(_, value)| value.is_some());
        let all: Vec<usize> =
            (0..=last).filter(|&number| number == chosen || draws(&values.channels[number])).collect();
        let place = all.iter().position(|&number| number == chosen).unwrap_or_default();
        let room = usize::from(columns) * usize::from(rows);
        let first = place.saturating_sub(room - 1);
        let shown: Vec<usize> = all.into_iter().skip(first).take(room).collect();
        let lines_of = |columns: u16| shown.len().div_ceil(usize::from(columns)).max(1) as u16;
        let columns = (1..columns).find(|&columns| area.height / lines_of(columns) >= HIGH_CHART).unwrap_or(columns);
        let count = lines_of(columns);
        let places = shown.chunks(usize::from(columns)).enumerate().flat_map(|(line, channels)| {
            let (top, bottom) = (share(area.height, count, line), share(area.height, count, line + 1));
            // A text that is alone in the last line has all of it.
            let count = channels.len() as u16;
            channels.iter().enumerate().map(move |(place, &channel)| {
                let (left, right) = (share(area.width, count, place), share(area.width, count, place + 1));
                let width = (right - left).saturating_sub(if right < area.width { 2 } else { 0 });
                (channel, Rect { x: area.x + left, y: area.y + top, width, height: bottom - top })
            })
        });
        places.collect()
    }

    fn curve(&self, scene: Scene, number: usize, window: (Instant, Instant)) -> Option<Curve> {
        let values = &scene.view.unit.monitor.stream;
        let channel = values.channels.get(number)?;
        let source = values.source.unwrap_or(Source::FieldValue);
        Some(Curve {
            samples: channel.samples(window.0, window.1),
            window,
            quantity: Quantity::of(source, values.decimals),
            cursor: self.held.map(|held| held.cursor),
            marks: values.marks.iter().copied().collect(),
            without: without_value(channel),
            label_columns: 0,
        })
    }

    fn is_chosen(&self, values: &Values, number: usize) -> bool {
        number == self.channel.min(values.channels.len().saturating_sub(1))
    }

    fn title(&self, values: &Values, number: usize, charts: &[(usize, Rect)]) -> String {
        let pointer = if self.is_chosen(values, number) && charts.len() > 1 { "› " } else { "" };
        let name = values.channels.get(number).map_or("", |channel| channel.name.as_str());
        format!("{pointer}Curve of {name}")
    }

    /// What its values span, where that is not all that is on the screen, and which time it shows.
    fn remark(&self, scene: Scene, curve: &Curve, number: usize, charts: &[(usize, Rect)]) -> String {
        let values = &scene.view.unit.monitor.stream;
        let decimals = values.decimals;
        let span = curve.extremes().filter(|_| charts.len() > 1);
        let span = span.map(|(low, high)| format!("{low:.decimals$} to {high:.decimals$} {}", curve.quantity.unit));
        let state = if self.held.is_some() { "held, End follows again" } else { "follows" };
        // A chart that is far from full yet has less than its name says.
        let (from, to) = curve.window;
        let so_far = WINDOWS[self.window].1.filter(|length| to.since(from) < *length * 3 / 4);
        let so_far = so_far.map(|_| format!(", {} so far", format::minutes(to.since(from)))).unwrap_or_default();
        let window = format!("{}{so_far}, {state}", WINDOWS[self.window].0);
        let is_chosen = self.is_chosen(values, number);
        let (columns, rows) = charts.first().map_or((0, 0), |(_, area)| room(*area));
        let parts = [
            span,
            is_chosen.then_some(window),
            (is_chosen && charts.len() > 1).then(|| "Enter enlarges".into()),
            (self.alone && columns * rows > 1).then(|| "Enter shows all".into()),
        ];
        parts.into_iter().flatten().collect::<Vec<String>>().join(", ")
    }

    fn table(&self, scene: Scene, columns: u16) -> Vec<Line<'static>> {
        let (theme, values) = (scene.theme, &scene.view.unit.monitor.stream);
        let source = source_words(values.source.unwrap_or(Source::FieldValue));
        let every = values.period().map(|period| format!(", every {}", format::period(period))).unwrap_or_default();
        let remark = format!("{source}{every}, {}", format::counted(values.rows, "row"));
        let mut rows = vec![lines::rule(theme, columns, "Stream", &remark)];
        let time = |at: Instant| format::time_of_day(scene.start_of_day, at);
        let value = self.held.map_or_else(|| "Value".to_owned(), |held| format!("At {}", time(held.cursor)));
        let heads =
            format!("    {:<8}{value:>13}   {:<15}{:>11}{:>11}{:>11}", "Channel", "State", "Min", "Max", "Mean");
        rows.push(Line::styled(heads, theme.quiet()));
        for (number, channel) in values.channels.iter().enumerate() {
            rows.push(self.row(scene, channel, number, columns));
        }
        let chosen = values.channels.get(self.channel.min(values.channels.len().saturating_sub(1)));
        rows.push(note(scene, chosen, usize::from(columns)));
        rows
    }

    fn row(&self, scene: Scene, channel: &Channel, number: usize, columns: u16) -> Line<'static> {
        let (theme, stream) = (scene.theme, &scene.view.unit.monitor.stream);
        let source = stream.source.unwrap_or(Source::FieldValue);
        let decimals = stream.decimals;
        let show = |value: Option<f64>| format::decimal(value, decimals);
        let reading = match self.held {
            None => Some(channel.reading),
            Some(held) => channel.at(held.cursor).map(|(_, reading)| reading),
        };
        let is_chosen = self.is_chosen(stream, number);
        let is_old = scene.view.why_old().is_some() || self.held.is_some();
        let (state, style) = state(theme, channel, reading);
        // Where there is no value its state says why.
        let value = value_text(reading.and_then(Reading::value), source, decimals);
        let name = format!("  {} {:<8}", if is_chosen { "›" } else { " " }, channel.name);
        let mut line = Line::from(vec![
            Span::styled(name, if is_chosen { theme.strong() } else { Style::new() }),
            Span::styled(format!("{value:>13}"), if is_old { theme.quiet() } else { theme.strong() }),
            Span::raw("   "),
            Span::styled(format!("{state:<15}"), style),
            Span::raw(format!("{:>11}{:>11}{:>11}", show(channel.min), show(channel.max), show(channel.mean()))),
        ]);
        let room = usize::from(columns).saturating_sub(TABLE_COLUMNS + 2);
        if room > 10 {
            let values: Vec<_> = channel.newest(room).map(|(_, value)| value).collect();
            line.push_span(Span::styled(format!("  {}", sparkline(&values, room, LEAST_SPAN)), theme.curve()));
        }
        line
    }
}

/// How many charts have room, side by side and one below the other.
fn room(area: Rect) -> (u16, u16) {
    (area.width / LEAST_CHART.0, area.height / LEAST_CHART.1)
}

/// Where the part number `place` of `count` equal parts begins.
fn share(length: u16, count: u16, place: usize) -> u16 {
    (usize::from(length) * place / usize::from(count.max(1))) as u16
}

/// Why there is no curve.
pub fn without_value(channel: &Channel) -> String {
    match channel.reading {
        Reading::Value(_) => format!("{} had no value in this time.", channel.name),
        reading => format!("{}: {}, no value in this time.", channel.name, reading.words()),
    }
}

/// A reading's state as a person reads it.
fn state(theme: Theme, channel: &Channel, reading: Option<Reading>) -> (&'static str, Style) {
    let Some(reading) = reading else { return ("not kept", theme.quiet()) };
    let style = if channel.stand_in_of(reading).is_some() { theme.warning() } else { theme.state(reading) };
    (channel.words_of(reading), style)
}

/// What has to be said below the table: where rows go, or that none come.
fn note(scene: Scene, chosen: Option<&Channel>, columns: usize) -> Line<'static> {
    let (theme, view) = (scene.theme, scene.view);
    // Where rows go says nothing of whether any come: that comes first, shorter where both have to be shown.
    let warning = match view.why_old() {
        Some(old) if view.export.is_some() => format!("  {} ", old.reason()),
        Some(old) => format!("  {}", old.text()),
        None if view.export.is_none() => chosen.and_then(stand_in_line).unwrap_or_default(),
        None => String::new(),
    };
    let mut line = Line::from(Span::styled(warning.clone(), theme.warning()));
    if let Some(export) = &view.export {
        let (begin, end) = (format!("  {} written to ", format::counted(export.rows, "row")), "; E ends it.");
        let room = columns.saturating_sub(format::width(&warning) + format::width(&begin) + format::width(end));
        let path = format::keep_end(&visible::text(&export.path.to_string_lossy()), room);
        let style = if warning.is_empty() { theme.good() } else { theme.quiet() };
        line.push_span(Span::styled(format!("{begin}{path}{end}"), style));
    }
    line
}
