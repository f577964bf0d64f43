//! What the newest page of diagnostics says.

use ratatui::text::{Line, Span};

use crate::device::Product;
use crate::monitor::Tracked;
use crate::tui::screens::Scene;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::units;

/// Columns of a channel and its value on a page of diagnostics, where the stream is off.
const DIAGNOSED_COLUMNS: usize = 2 + 6 + 12;

/// The channels' temperatures on the newest page of diagnostics: without a stream they are all there is to know.
pub(super) fn values(scene: Scene, columns: u16) -> Vec<Line<'static>> {
    let Some(at) = scene.view.unit.monitor.diagnostics.at else { return Vec::new() };
    let cell = |name: &String| Some(format!("  {name:<6}{:>12}", value(scene, name)?));
    let cells: Vec<String> = channels(scene).iter().filter_map(cell).collect();
    let time = format::time_of_day(scene.start_of_day, at);
    let heading = format!("  On the diagnostics' last page, {time}:");
    let heading = (!cells.is_empty()).then(|| Line::styled(heading, scene.theme.quiet()));
    let in_a_row = (usize::from(columns) / DIAGNOSED_COLUMNS).max(1);
    let rows = cells.chunks(in_a_row).map(|row| Line::styled(row.concat(), scene.theme.quiet()));
    heading.into_iter().chain(rows).collect()
}

/// What the unit's diagnostics say beside the channels: supply, cold junction, active errors.
pub(super) fn beside_channels(scene: Scene, columns: u16) -> Option<Line<'static>> {
    let view = scene.view;
    let at = view.unit.monitor.diagnostics.at?;
    let of_channel =
        |label: &str| view.unit.monitor.stream.channels.iter().any(|channel| label.starts_with(channel.name.as_str()));
    let known = channels(scene);
    let said =
        view.unit.monitor.diagnostics.found.iter().filter(|found| {
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

/// The channels of the unit. One that has not said what it is gives itself away by those that it diagnoses.
fn channels(scene: Scene) -> &'static [String] {
    let has_most = |product: &&Product| {
        let names = &product.stream.channels;
        names.iter().filter(|name| value(scene, name).is_some()).count() * 2 > names.len()
    };
    let product = scene.view.product().or_else(|| Product::all().iter().find(has_most));
    product.map_or(&[], |product| &product.stream.channels)
}

/// A channel's temperature on the newest page of diagnostics.
fn value(scene: Scene, name: &str) -> Option<String> {
    let unit = |found: &Tracked| found.unit.as_deref().and_then(units::unit);
    let is_celsius = |found: &&Tracked| unit(found).is_some_and(|unit| unit.name == "C");
    let found =
        scene.view.unit.monitor.diagnostics.found.iter().filter(is_celsius).find(|found| found.label == name)?;
    Some(format!("{} °C", found.text(found.value?)))
}
