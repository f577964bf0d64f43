//! The newest row of the stream, channel by channel, with limits and trends.

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::{CHART_ROWS, Overview, diagnosed, is_asked, source_words, value_text, without_values};
use crate::monitor::Channel;
use crate::tui::screens::Scene;
use crate::tui::widgets::spark::sparkline;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Source;

/// Smallest span of a trend, in °C and in counts: less than this is noise.
const LEAST_SPAN: [f64; 2] = [1.0, 10.0];
/// Columns of the values before the trend begins.
const TABLE_COLUMNS: usize = 64;
/// Beside the time of a fault a trend of fewer columns says nothing.
const LEAST_TREND: usize = 12;
/// From this width on the limits have columns of their own ...
const LIMITS_AT: u16 = 110;
/// ... of this width each.
const LIMIT_COLUMNS: usize = 9;
/// What is said of the values while it is not known whose they are.
const ASKED: &str = "The unit is being asked: these are the last values of the one before.";
/// Digits after the point of a limit.
const LIMIT_DECIMALS: usize = 1;

impl Overview {
    /// The values with their heading, and what has to be said of them below.
    pub(super) fn values(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let columns = area.width;
        let (theme, stream) = (scene.theme, &scene.view.unit.monitor.stream);
        let newest = stream.newest.map(|at| format::time_of_day(scene.start_of_day, at));
        let Some(source) = stream.source else {
            let mut shown = vec![lines::rule(theme, columns, "Values", "")];
            shown.extend(without_values(scene, columns));
            shown.extend(diagnosed::values(scene, columns));
            shown.push(Line::default());
            return shown;
        };
        let what = source_words(source);
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
        let taken = TABLE_COLUMNS + 2 + if has_columns { 3 * LIMIT_COLUMNS } else { 0 };
        let room = usize::from(columns).saturating_sub(taken);
        for (number, channel) in stream.channels.iter().enumerate() {
            shown.push(value_row(scene, channel, number == self.chosen(stream), source, room, has_columns));
        }
        if area.height >= CHART_ROWS {
            shown.extend(averages(scene, columns));
        }
        shown.push(match scene.view.why_old() {
            Some(_) if is_asked(scene) => Line::styled(format!("  {ASKED}"), theme.warning()),
            Some(why) => Line::styled(format!("  {}", why.text()), theme.warning()),
            None => {
                let chosen = stream.channels.get(self.chosen(stream));
                match chosen.and_then(stand_in_line) {
                    Some(text) => Line::styled(text, theme.warning()),
                    None => limits_line(scene, source, chosen.map_or("", |channel| channel.name.as_str()), has_columns),
                }
            }
        });
        shown
    }
}

fn value_row(
    scene: Scene,
    channel: &Channel,
    is_chosen: bool,
    source: Source,
    room: usize,
    has_limits: bool,
) -> Line<'static> {
    let theme = scene.theme;
    let decimals = scene.view.unit.monitor.stream.decimals;
    let number = |value: Option<f64>| format::decimal(value, decimals);
    let value = value_text(channel.reading.value(), source, decimals);
    let limits = scene.view.limits(&channel.name).filter(|_| source == Source::FieldValue);
    let beyond = limits.zip(channel.reading.value()).and_then(|(limits, value)| limits.word(value));
    let (state, style) = match beyond {
        Some(word) => (word.to_owned(), theme.warning()),
        None if channel.stand_in().is_some() => (channel.words().to_owned(), theme.warning()),
        None => (channel.words().to_owned(), theme.state(channel.reading)),
    };
    let limit_columns = if has_limits {
        let limits = limits.unwrap_or_default();
        let column = |limit: Option<f64>| format!("{:>LIMIT_COLUMNS$}", format::decimal(limit, LIMIT_DECIMALS));
        [limits.low, limits.high, limits.shutdown].map(column).concat()
    } else {
        String::new()
    };
    let span = LEAST_SPAN[usize::from(source == Source::ProcessValue)];
    let lasting = scene.view.unit.monitor.faults.lasting().find(|fault| fault.channel == channel.name);
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
        Span::styled(name, if is_chosen { theme.strong() } else { Style::new() }),
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

/// What follows a number that is not known to be a value.
pub fn stand_in_line(channel: &Channel) -> Option<String> {
    let (stand_in, value) = (channel.stand_in()?, channel.reading.value()?);
    let meaning = stand_in.meaning();
    Some(format!("  {}: {value:.0} marks {meaning}, or is a value; 6150h of it says which.", channel.name))
}

/// The limits of one channel in a line, or how to see them.
fn limits_line(scene: Scene, source: Source, channel: &str, has_columns: bool) -> Line<'static> {
    let (theme, view) = (scene.theme, scene.view);
    let reads = |how: &str| if view.can_send() { format!("{how}V reads them") } else { String::new() };
    let text = match (view.current_dictionary(), view.limits(channel)) {
        _ if source != Source::FieldValue => return Line::default(),
        (None, _) if view.unit.dictionary.is_some() => {
            format!("  Limits: those read are from before the restart{}.", reads(", "))
        }
        (None, _) => format!("  Limits: not read so far{}.", reads(", ")),
        (Some(read), _) if has_columns => {
            let time = format::time_of_day(scene.start_of_day, read.at);
            format!("  Limits read {time}{}.", reads("; "))
        }
        (Some(_), None) => format!("  {channel} has no limits."),
        (Some(read), Some(limits)) => {
            let show = |limit: Option<f64>| format::decimal(limit, LIMIT_DECIMALS);
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
