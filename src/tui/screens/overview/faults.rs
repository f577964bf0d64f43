//! Open and short circuits with their times, and what the unit lists itself.

use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{Overview, is_current};
use crate::monitor::Fault;
use crate::time::Instant;
use crate::tui::screens::Scene;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Reading;

/// Columns of a fault's channel, and of what it is.
const CHANNEL_COLUMNS: usize = 8;
const KIND_COLUMNS: usize = 15;

impl Overview {
    pub(super) fn faults(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let faults = &scene.view.unit.monitor.faults;
        let rows = fault_rows(scene);
        let room = usize::from(area.height.saturating_sub(1));
        let first = self.scrolled.min(rows.len().saturating_sub(room));
        let below = rows.len().saturating_sub(first + room);
        let lasting = faults.lasting().count();
        let mut remark = Vec::new();
        if !faults.is_empty() {
            let when = if is_current(scene) { "now" } else { "when last seen" };
            remark.push(format!("{lasting} {when}, {} since connecting", format::grouped(faults.seen)));
        }
        let over = scene.view.over_shutdown().len();
        remark.extend((over > 0).then(|| format!("{over} over shutdown")));
        // How far it can be scrolled is in the heading: a row of its own would take that of a fault.
        remark.extend((first > 0).then(|| format!("↑ {first} more")));
        remark.extend((below > 0).then(|| format!("↓ {below} more, PgDn")));
        let mut shown = vec![lines::rule(theme, area.width, "Faults", &remark.join(", "))];
        if rows.is_empty() {
            let word = if scene.view.unit.monitor.stream.rows > 0 {
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
pub(super) fn fault_rows(scene: Scene) -> Vec<Line<'static>> {
    let faults = &scene.view.unit.monitor.faults;
    // Lasting faults first: they are the ones to work on.
    let mut rows: Vec<Line> = faults.lasting().map(|fault| fault_row(scene, fault)).collect();
    rows.extend(over_shutdown(scene));
    rows.extend(listed(scene));
    rows.extend(faults.ended().map(|fault| fault_row(scene, fault)));
    rows
}

/// The channels that have reached their shutdown limits.
fn over_shutdown(scene: Scene) -> impl Iterator<Item = Line<'static>> {
    let row = move |(channel, value, limit): (&str, f64, f64)| {
        Line::from(vec![
            Span::raw(format!("    {channel:<CHANNEL_COLUMNS$}")),
            Span::styled(format!("{:<KIND_COLUMNS$}", "over shutdown"), scene.theme.bad()),
            Span::raw(format!("{value:.1} °C, its shutdown limit (4020h) is {limit:.1} °C")),
        ])
    };
    scene.view.over_shutdown().into_iter().map(row)
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

/// What to look at. Where no channel that is on has a reading, what they share is as likely as their sensors.
fn to_check(scene: Scene, kind: Reading) -> &'static str {
    let channels = &scene.view.unit.monitor.stream.channels;
    let mut on =
        channels.iter().map(|channel| channel.reading).filter(|reading| *reading != Reading::Disabled).peekable();
    let is_of_all = kind == Reading::Error && on.peek().is_some() && on.all(|reading| reading == Reading::Error);
    if is_of_all && channels.len() > 1 {
        "on all channels: converter or wiring"
    } else {
        "check sensor, wire and connector"
    }
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
            Span::raw(format!("since {}: {}", time(fault.since), to_check(scene, fault.kind))),
        ]),
        Some(until) => {
            let lasted = format::period(until.since(fault.since));
            let text = format!("{kind:<KIND_COLUMNS$}over, {} to {}, lasted {lasted}", time(fault.since), time(until));
            Line::from(vec![name, Span::styled(text, theme.quiet())])
        }
    }
}
