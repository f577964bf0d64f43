//! What is known of the unit, its live values and its faults, on one page.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{Scene, terminal};
use crate::device::Product;
use crate::monitor::{Channel, Fault, Tracked};
use crate::session::{Known, Origin, UnitState};
use crate::time::Instant;
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::chart::{self, Curve, Quantity};
use crate::tui::widgets::spark::sparkline;
use crate::tui::widgets::{format, lines};
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
        long: "start minimum and maximum anew",
    },
];

/// From this width on the raw terminal has room beside the values.
const BESIDE_COLUMNS: u16 = 140;
/// From this height on the chosen channel gets a chart.
const CHART_ROWS: u16 = 32;
/// Smallest span of a trend, in °C and in counts: less than this is noise.
const LEAST_SPAN: [f64; 2] = [1.0, 10.0];
/// Columns of the values before the trend begins.
const TABLE_COLUMNS: usize = 64;
/// Beside the time of a fault a trend of fewer columns says nothing.
const LEAST_TREND: usize = 12;
/// Rows of the faults that the rest of the page leaves room for, with their heading, where there are any.
const FAULT_ROWS: usize = 3;
/// Columns of a fault's channel, and of what it is.
const CHANNEL_COLUMNS: usize = 8;
const KIND_COLUMNS: usize = 15;
/// Columns of a channel and its value on a page of diagnostics, where the stream is off.
const DIAGNOSED_COLUMNS: usize = 2 + 6 + 12;
/// From this width on the limits have columns of their own ...
const LIMITS_AT: u16 = 110;
/// ... of this width each.
const LIMIT_COLUMNS: usize = 9;

/// The page.
#[derive(Debug, Default)]
pub struct Overview {
    cursor: usize,
    /// Faults above those that are shown.
    scrolled: usize,
}

/// Where the parts of the page stand.
struct Parts {
    unit: Vec<Line<'static>>,
    values: Vec<Line<'static>>,
    chart_rows: u16,
    faults: Rect,
}

impl Overview {
    /// What a command does here; `faults` is how many of them can stand above those that are shown, and how many are
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

    /// How many faults can stand above those that are shown, and how many are shown at once.
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
        if let Some(channel) = scene.view.monitor.stream.channels.get(self.cursor).filter(|_| parts.chart_rows > 0) {
            draw_chart(scene, channel, lines::split(rest, parts.chart_rows).0, frame);
        }
        lines::draw(frame, parts.faults, self.faults(scene, parts.faults));
    }

    fn parts(&self, scene: Scene, area: Rect) -> Parts {
        let (mut unit, mut values) = (unit(scene, area.width), self.values(scene, area));
        // Faults are what one looks for: the blank line and what stands below the values make room for them.
        let least = if fault_rows(scene).is_empty() { 0 } else { FAULT_ROWS };
        let too_many = |unit: &Vec<_>, values: &Vec<_>| unit.len() + values.len() + least > usize::from(area.height);
        if too_many(&unit, &values) {
            unit.pop();
        }
        if too_many(&unit, &values) && is_current(scene) {
            values.pop();
        }
        let (_, rest) = lines::split(area, (unit.len() + values.len()) as u16);
        let has_chart = area.height >= CHART_ROWS && !scene.view.monitor.stream.channels.is_empty();
        let chart_rows = if has_chart { rest.height * 3 / 5 } else { 0 };
        Parts { unit, values, chart_rows, faults: lines::split(rest, chart_rows).1 }
    }

    fn values(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let columns = area.width;
        let (theme, stream) = (scene.theme, &scene.view.monitor.stream);
        let newest = stream.newest.map(|at| format::time_of_day(scene.start_of_day, at));
        let Some(source) = stream.source else {
            let mut shown = vec![lines::rule(theme, columns, "Values", "")];
            let room = usize::from(columns).saturating_sub(4);
            let broken = without_values(scene).into_iter().flat_map(|text| format::wrap(text, room));
            shown.extend(broken.map(|line| Line::raw(format!("  {line}"))));
            shown.extend(diagnosed_values(scene, columns));
            shown.push(Line::default());
            return shown;
        };
        let what = match source {
            Source::FieldValue => "field value (6100h) in °C",
            Source::ProcessValue => "process value (7130h) in counts",
        };
        let remark = format!("{what}, {}, newest {}", format::counted(stream.rows, "row"), newest.unwrap_or_default());
        let mut shown = vec![lines::rule(theme, columns, "Values", &remark)];
        // They are temperatures: beside counts they would say nothing.
        let has_limits = source == Source::FieldValue && scene.view.current_dictionary().is_some();
        let has_columns = has_limits && columns >= LIMITS_AT;
        let limit_heads =
            if has_columns { format!("{:>9}{:>9}{:>9}", "Low", "High", "Shutdown") } else { String::new() };
        let heads = format!(
            "    {:<8}{:>13}   {:<14}{:>10}{:>10}{limit_heads}  Trend",
            "Channel", "Value", "State", "Min", "Max"
        );
        shown.push(Line::styled(heads, theme.quiet()));
        let decimals = decimals(scene.view, source);
        let taken = TABLE_COLUMNS + 2 + if has_columns { 3 * LIMIT_COLUMNS } else { 0 };
        let room = usize::from(columns).saturating_sub(taken);
        for (number, channel) in stream.channels.iter().enumerate() {
            shown.push(value_row(scene, channel, number == self.cursor, source, decimals, room, has_columns));
        }
        if area.height >= CHART_ROWS {
            shown.extend(averages(scene, columns));
        }
        shown.push(match scene.view.why_old() {
            Some(why) => Line::styled(format!("  {}", why.text()), theme.warning()),
            None => {
                let chosen = stream.channels.get(self.cursor).map(|channel| channel.name.as_str());
                limits_line(scene, source, chosen.unwrap_or_default(), has_columns)
            }
        });
        shown
    }
}

/// The part of the screen that the page takes: where there is room, the terminal stands beside it.
fn page(area: Rect) -> Rect {
    if area.width < BESIDE_COLUMNS { area } else { Rect { width: area.width * 3 / 5, ..area } }
}

/// Whether the values are those of now, so that nothing has to be said about them.
fn is_current(scene: Scene) -> bool {
    scene.view.monitor.stream.source.is_some() && scene.view.why_old().is_none()
}

/// The limits of one channel in a line, or how to see them.
fn limits_line(scene: Scene, source: Source, channel: &str, has_columns: bool) -> Line<'static> {
    let (theme, view) = (scene.theme, scene.view);
    let reads = |how: &str| if view.can_send() { format!("{how}V reads them") } else { String::new() };
    let text = match (view.current_dictionary(), view.limits(channel)) {
        _ if source != Source::FieldValue => return Line::default(),
        (None, _) if view.dictionary.is_some() => {
            format!("  Limits: those read are from before the restart{}.", reads(", "))
        }
        (None, _) => format!("  Limits: not read so far{}.", reads(", ")),
        (Some(read), _) if has_columns => {
            let time = format::time_of_day(scene.start_of_day, read.at);
            format!("  Limits read {time}{}.", reads("; "))
        }
        (Some(_), None) => format!("  {channel} has no limits."),
        (Some(read), Some(limits)) => {
            let show = |limit: Option<f64>| limit.map_or_else(|| "-".to_owned(), |limit| format!("{limit:.1}"));
            format!(
                "  Limits of {channel}: low {}, high {}, shutdown {} °C, read {}.",
                show(limits.low),
                show(limits.high),
                show(limits.shutdown),
                format::time_of_day(scene.start_of_day, read.at)
            )
        }
    };
    Line::styled(text, theme.quiet())
}

/// The unit's averages, as they were when its dictionary was read.
fn averages(scene: Scene, columns: u16) -> Option<Line<'static>> {
    let read = scene.view.current_dictionary()?;
    let averages = scene.view.averages();
    let time = format::time_of_day(scene.start_of_day, read.at);
    let columns = usize::from(columns);
    // Which channels a bank has is left out where there is no room for it; the numbers are not.
    let short = |name: &str| name.split(" (").next().unwrap_or(name).to_owned();
    let texts = [&(|name: &str| name.to_owned()) as &dyn Fn(&str) -> String, &short].map(|named| {
        let said: Vec<String> = averages.iter().map(|(name, value)| format!("{} {value:.1}", named(name))).collect();
        format!("  Averages in °C, read {time}: {}", said.join(", "))
    });
    let [long, short] = texts;
    let text = if format::width(&long) <= columns { long } else { format::keep_start(&short, columns) };
    (!averages.is_empty()).then(|| Line::styled(text, scene.theme.quiet()))
}

/// Digits behind the point, as the product prints them.
pub fn decimals(view: &View, source: Source) -> usize {
    // A row that has been understood is one of a product that we know, if the unit has named itself or not.
    let channels = &view.monitor.stream.channels;
    let has_these =
        |product: &&Product| product.stream.channels.iter().eq(channels.iter().map(|channel| &channel.name));
    view.product().or_else(|| Product::all().iter().find(has_these)).map_or_else(
        || if source == Source::FieldValue { 3 } else { 0 },
        |product| product.stream.format(source).decimals,
    )
}

fn unit(scene: Scene, columns: u16) -> Vec<Line<'static>> {
    let (theme, facts) = (scene.theme, &scene.view.facts);
    let title = scene.view.product().map(|product| product.title.clone()).unwrap_or_default();
    let stream = match (facts.stream, scene.view.monitor.stream.period()) {
        (None, _) if facts.state == UnitState::Loader => "none, in the loader".to_owned(),
        (None, _) if scene.view.stream_is_off => "off".to_owned(),
        (None, _) => "no row so far".to_owned(),
        (Some(source), period) => {
            let source = match source {
                Source::FieldValue => "field value",
                Source::ProcessValue => "process value",
            };
            let every = period.map(|period| format!(", every {}", format::period(period))).unwrap_or_default();
            format!("{source}{every}")
        }
    };
    let state = match facts.state {
        UnitState::Silent if scene.view.link.name.is_none() => Span::styled("not connected", theme.quiet()),
        UnitState::Silent if scene.record.entry_count() > 0 && scene.view.monitor.stream.rows > 0 => {
            Span::styled("silent now", theme.warning())
        }
        UnitState::Silent => Span::styled("silent: nothing heard yet", theme.warning()),
        UnitState::Unknown => Span::styled("talks, in words not known", theme.warning()),
        UnitState::Application if scene.view.viewing => Span::styled("view open, halted", theme.warning()),
        UnitState::Application => Span::styled("application runs", theme.good()),
        UnitState::Loader => Span::styled("waits in its loader", theme.warning()),
    };
    let other_text = match facts.unrecognised_lines {
        0 => "none".to_owned(),
        1 => "1 line, see the terminal".into(),
        count => format!("{} lines, see the terminal", format::grouped(count)),
    };
    let half = usize::from(columns) / 2 - 2;
    let left = [
        ("Product", known(&facts.product, |product| visible::text(product))),
        ("Version", known(&facts.version, |version| version.to_string())),
        ("Node-ID", known(&facts.node_id, |id| id.to_string())),
        ("CAN", known(&facts.can_kbps, |rate| format!("{rate} kbit/s"))),
    ];
    let right = [
        ("State", state),
        ("CANopen", canopen_state(scene, usize::from(columns).saturating_sub(half + 2 + lines::LABEL_COLUMNS))),
        ("Stream", Span::raw(stream)),
        ("Other text", Span::raw(other_text)),
    ];
    let mut shown = vec![lines::rule(theme, columns, "Unit", &title)];
    for ((left_label, left_value), (right_label, right_value)) in left.into_iter().zip(right) {
        let mut line = lines::labelled(theme, left_label, left_value);
        let missing = half.saturating_sub(line.width());
        line.push_span(Span::raw(" ".repeat(missing)));
        line.spans.extend(lines::labelled(theme, right_label, right_value).spans);
        shown.push(line);
    }
    shown.extend(diagnosed(scene, columns));
    shown.push(Line::default());
    shown
}

/// A channel's temperature on the newest page of diagnostics.
fn diagnosed_value(scene: Scene, name: &str) -> Option<String> {
    let is_celsius = |found: &&Tracked| found.unit.as_deref().is_some_and(|unit| matches!(unit, "C" | "°C" | "degC"));
    let found = scene.view.monitor.diagnostics.found.iter().filter(is_celsius).find(|found| found.label == name)?;
    Some(format!("{} °C", found.text(found.value?)))
}

/// The channels of the unit. One that has not said what it is gives itself away by those that it diagnoses.
fn diagnosed_channels(scene: Scene) -> &'static [String] {
    let has_most = |product: &&Product| {
        let names = &product.stream.channels;
        names.iter().filter(|name| diagnosed_value(scene, name).is_some()).count() * 2 > names.len()
    };
    let product = scene.view.product().or_else(|| Product::all().iter().find(has_most));
    product.map_or(&[], |product| &product.stream.channels)
}

/// The channels' temperatures on the newest page of diagnostics: without a stream they are all there is to know.
fn diagnosed_values(scene: Scene, columns: u16) -> Vec<Line<'static>> {
    let Some(at) = scene.view.monitor.diagnostics.at else { return Vec::new() };
    let cell = |name: &String| Some(format!("  {name:<6}{:>12}", diagnosed_value(scene, name)?));
    let cells: Vec<String> = diagnosed_channels(scene).iter().filter_map(cell).collect();
    let time = format::time_of_day(scene.start_of_day, at);
    let heading = format!("  On the diagnostics' last page, {time}:");
    let heading = (!cells.is_empty()).then(|| Line::styled(heading, scene.theme.quiet()));
    let in_a_row = (usize::from(columns) / DIAGNOSED_COLUMNS).max(1);
    let rows = cells.chunks(in_a_row).map(|row| Line::styled(row.concat(), scene.theme.quiet()));
    heading.into_iter().chain(rows).collect()
}

/// What the unit's diagnostics say beside the channels: supply, cold junction, active errors.
fn diagnosed(scene: Scene, columns: u16) -> Option<Line<'static>> {
    let view = scene.view;
    let at = view.monitor.diagnostics.at?;
    let of_channel =
        |label: &str| view.monitor.stream.channels.iter().any(|channel| label.starts_with(channel.name.as_str()));
    let known = diagnosed_channels(scene);
    let said =
        view.monitor.diagnostics.found.iter().filter(|found| {
            !of_channel(&found.label) && !known.iter().any(|name| found.label.starts_with(name.as_str()))
        });
    let said = said.filter_map(|found| {
        let unit = found.unit.as_deref().map(|unit| format!(" {}", visible::text(unit))).unwrap_or_default();
        Some(format!("{} {}{unit}", visible::text(&found.label), found.text(found.value?)))
    });
    let mut said: Vec<String> = said.collect();
    // What does not fit is cut off, and that must not be the errors.
    said.sort_by_key(|text| !text.to_lowercase().contains("error"));
    let room = usize::from(columns).saturating_sub(lines::LABEL_COLUMNS + 13);
    let text = format::keep_start(&said.join(", "), room);
    let time = format::time_of_day(scene.start_of_day, at);
    (!said.is_empty()).then(|| lines::labelled(scene.theme, "Diagnosed", Span::raw(format!("{text} ({time})"))))
}

/// The CANopen state, in `room` columns. Any master on the bus changes it without the unit saying so here: what was
/// heard a while ago is told with its age, and does not look like what is.
fn canopen_state(scene: Scene, room: usize) -> Span<'static> {
    let state = &scene.view.facts.nmt_state;
    let now = known(state, |state| visible::text(state));
    let age = scene.view.nmt_heard.and_then(|heard| format::ago(heard, scene.now));
    let Some(state) = state else { return now };
    let Some(age) = age else {
        // Where it comes from is said in full or not at all.
        return if now.width() <= room {
            now
        } else {
            Span::raw(format::keep_start(&visible::text(&state.value), room))
        };
    };
    let full = format!("{}, {age}", now.content);
    let text = if format::width(&full) <= room { full } else { format!("{}, {age}", visible::text(&state.value)) };
    Span::styled(text, scene.theme.quiet())
}

/// A fact and where it comes from: `127 (menu)`.
fn known<T>(fact: &Option<Known<T>>, show: impl Fn(&T) -> String) -> Span<'static> {
    match fact {
        None => Span::raw("not known"),
        Some(known) => {
            let origin = match known.origin {
                Origin::Banner => "banner",
                Origin::Menu => "menu",
                Origin::Dictionary => "object dictionary",
                Origin::Diagnostics => "diagnostics",
            };
            Span::raw(format!("{} ({origin})", show(&known.value)))
        }
    }
}

/// What to do to see values.
pub fn without_values(scene: Scene) -> Vec<&'static str> {
    if scene.view.link.name.is_none() {
        return vec!["Not connected. Press 1 to choose a port or an emulated unit."];
    }
    match (scene.view.facts.state, scene.view.facts.stream) {
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
        (UnitState::Application, None) if !scene.view.stream_is_off => {
            vec!["The unit has sent no values so far.", "Press T to switch its stream on."]
        }
        (UnitState::Application, None) => {
            vec!["The stream is off, so the unit sends no values.", "Press T to switch it on."]
        }
    }
}

fn value_row(
    scene: Scene,
    channel: &Channel,
    is_chosen: bool,
    source: Source,
    decimals: usize,
    room: usize,
    has_limits: bool,
) -> Line<'static> {
    let theme = scene.theme;
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"));
    let unit = match source {
        Source::FieldValue => " °C",
        Source::ProcessValue => "   ",
    };
    let value = match channel.reading.value() {
        Some(value) => format!("{}{unit}", number(Some(value))),
        None => "-   ".into(),
    };
    let limits = scene.view.limits(&channel.name).filter(|_| source == Source::FieldValue);
    let beyond = limits.zip(channel.reading.value()).and_then(|(limits, value)| limits.word(value));
    let (state, style) = match beyond {
        Some(word) => (format!("{}, {word}", channel.reading.words()), theme.warning()),
        None => (channel.reading.words().to_owned(), theme.state(channel.reading)),
    };
    let limit_columns = match has_limits {
        true => {
            let limits = limits.unwrap_or_default();
            let show = |limit: Option<f64>| limit.map_or_else(|| "-".to_owned(), |limit| format!("{limit:.1}"));
            [limits.low, limits.high, limits.shutdown].map(|limit| format!("{:>LIMIT_COLUMNS$}", show(limit))).concat()
        }
        false => String::new(),
    };
    let span = LEAST_SPAN[usize::from(source == Source::ProcessValue)];
    let lasting = scene.view.monitor.faults.iter().find(|fault| fault.until.is_none() && fault.channel == channel.name);
    // Since when is wanted before what was before; the list below may have no room for it.
    let since = lasting.map(|fault| format!("since {}", format::time_of_day(scene.start_of_day, fault.since)));
    let taken = since.as_ref().map_or(0, |since| since.len() + 2);
    let values: Vec<_> = channel.newest(room).map(|(_, value)| value).collect();
    let trend = match room.saturating_sub(taken) {
        room if taken == 0 || room >= LEAST_TREND => sparkline(&values, room, span),
        _ => String::new(),
    };
    let since = since.map(|since| if trend.is_empty() { since } else { since + "  " }).unwrap_or_default();
    let name = format!("  {} {:<8}", if is_chosen { "›" } else { " " }, channel.name);
    let value_style = if scene.view.why_old().is_some() { theme.quiet() } else { theme.strong() };
    Line::from(vec![
        Span::styled(name, if is_chosen { theme.strong() } else { ratatui::style::Style::new() }),
        Span::styled(format!("{value:>13}"), value_style),
        Span::raw("   "),
        Span::styled(format!("{state:<14}"), style),
        Span::raw(format!("{:>10}{:>10}", number(channel.min), number(channel.max))),
        Span::styled(limit_columns, theme.quiet()),
        Span::raw("  "),
        Span::styled(since, theme.bad()),
        Span::styled(trend, theme.curve()),
    ])
}

impl Overview {
    fn faults(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let all = &scene.view.monitor.faults;
        let rows = fault_rows(scene);
        let room = usize::from(area.height.saturating_sub(1));
        let first = self.scrolled.min(rows.len().saturating_sub(room));
        let below = rows.len().saturating_sub(first + room);
        let lasting = all.iter().filter(|fault| fault.until.is_none()).count();
        let mut remark = Vec::new();
        if !all.is_empty() {
            let when = if is_current(scene) { "now" } else { "when last seen" };
            remark.push(format!("{lasting} {when}, {} since connecting", all.len()));
        }
        // How far it can be scrolled stands in the heading: a row of its own would take that of a fault.
        remark.extend((first > 0).then(|| format!("↑ {first} more")));
        remark.extend((below > 0).then(|| format!("↓ {below} more, PgDn")));
        let mut shown = vec![lines::rule(theme, area.width, "Faults", &remark.join(", "))];
        if rows.is_empty() {
            let word = if scene.view.monitor.stream.rows > 0 {
                "None seen."
            } else {
                "None known: open and short circuits show in the stream."
            };
            shown.push(Line::styled(format!("  {word}"), theme.quiet()));
        }
        shown.extend(rows.into_iter().skip(first).take(room));
        shown
    }
}

/// All faults, one in a row.
fn fault_rows(scene: Scene) -> Vec<Line<'static>> {
    let all = &scene.view.monitor.faults;
    // Lasting faults first: they are the ones to work on.
    let lasting = all.iter().filter(|fault| fault.until.is_none());
    let ended = all.iter().filter(|fault| fault.until.is_some());
    let mut rows: Vec<Line> = lasting.map(|fault| fault_row(scene, fault)).collect();
    rows.extend(listed(scene));
    rows.extend(ended.map(|fault| fault_row(scene, fault)));
    rows
}

/// The errors in the unit's own list, as it was when the dictionary was read.
fn listed(scene: Scene) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let Some(read) = scene.view.current_dictionary() else { return Vec::new() };
    let time = format::time_of_day(scene.start_of_day, read.at);
    let row = |words: &str| {
        let words = visible::text(words);
        // In the columns of the faults that were seen, where it is about a channel.
        let (channel, words) = match words.split_once(": ") {
            Some((channel, kind)) if format::width(channel) < CHANNEL_COLUMNS => {
                (format::left(channel, CHANNEL_COLUMNS), format::left(kind, KIND_COLUMNS.max(format::width(kind) + 2)))
            }
            _ => (String::new(), format!("{words}  ")),
        };
        Line::from(vec![
            Span::raw(format!("    {channel}")),
            Span::styled(words, theme.bad()),
            Span::styled(format!("in the unit's list of errors (1003h), read {time}"), theme.quiet()),
        ])
    };
    read.dump.errors().map(row).collect()
}

fn fault_row(scene: Scene, fault: &Fault) -> Line<'static> {
    let theme = scene.theme;
    let time = |at: Instant| format::time_of_day(scene.start_of_day, at);
    let kind = fault.kind.words();
    let name = Span::raw(format!("    {:<CHANNEL_COLUMNS$}", fault.channel));
    match fault.until {
        None => Line::from(vec![
            name,
            Span::styled(format!("{kind:<KIND_COLUMNS$}"), theme.bad()),
            Span::raw(format!("since {}: check sensor, wire and connector", time(fault.since))),
        ]),
        Some(until) => {
            let lasted = format::period(until.since(fault.since));
            let text = format!("{kind:<KIND_COLUMNS$}over, {} to {}, lasted {lasted}", time(fault.since), time(until));
            Line::from(vec![name, Span::styled(text, theme.quiet())])
        }
    }
}

fn draw_chart(scene: Scene, channel: &Channel, area: Rect, frame: &mut Frame) {
    let (heading, canvas) = lines::split(area, 1);
    let (theme, stream) = (scene.theme, &scene.view.monitor.stream);
    lines::draw(frame, heading, [lines::rule(theme, area.width, &format!("Trend of {}", channel.name), "")]);
    let source = stream.source.unwrap_or(Source::FieldValue);
    let samples: Vec<_> = channel.newest(usize::MAX).collect();
    let ends = samples.first().zip(samples.last());
    let curve = Curve {
        window: ends.map(|(first, last)| (first.0, last.0)).unwrap_or_default(),
        quantity: Quantity::of(source, decimals(scene.view, source)),
        cursor: None,
        marks: stream.marks.iter().copied().collect(),
        without: super::stream::without_value(channel),
        label_columns: 0,
        samples,
    };
    let (canvas, _) = lines::split(canvas, canvas.height.saturating_sub(1));
    chart::draw(theme, scene.start_of_day, &curve, canvas, frame);
}
