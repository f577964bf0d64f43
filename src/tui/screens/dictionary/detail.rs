//! Everything about one entry: the pane beside or below the table.

use ratatui::text::Line;

use super::row::Row;
use super::{Scene, without_unit};
use crate::device::dictionary::{Access, Bound, Entry, Limits};
use crate::dump::{self, Measure};
use crate::session::Job;
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

impl Row<'_> {
    /// Everything about it; without much room the first lines of it.
    pub(super) fn detail(&self, scene: Scene, columns: u16, has_room: bool) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let room = usize::from(columns).saturating_sub(2 + lines::LABEL_COLUMNS);
        let mut rows = vec![self.heading(theme, columns, has_room)];
        let mut labelled = |label: &str, text: String, most: usize| {
            let most = if has_room { usize::MAX } else { most };
            rows.extend(lines::labelled_rows(theme, label, format::wrap(&text, room).into_iter().take(most)));
        };
        labelled("Value", self.value_in_words(scene.view), 1);
        let Some((object, entry)) = self.known else {
            let text = self.read.map(|read| visible::text(&read.text)).unwrap_or_default();
            labelled("Printed", text, 3);
            return rows;
        };
        labelled("Factory", self.factory_in_words(entry), 1);
        let access = match entry.access {
            Access::ReadOnly => "read only",
            Access::ReadWrite => "read and write",
        };
        let mappable = if entry.mappable { ", a PDO may carry it" } else { "" };
        let data_type = format!("{:?}", entry.data_type).to_uppercase();
        labelled("Type", format!("{data_type}, {access}{mappable}{}", range(&entry.limits, entry)), 1);
        if !entry.meanings.is_empty() {
            let meanings: Vec<String> =
                entry.meanings.iter().map(|meaning| format!("{} {}", meaning.value, meaning.text)).collect();
            labelled("Values", meanings.join(", "), 2);
        }
        if let Some(description) = &entry.description {
            labelled("What for", description.clone(), 3);
        }
        if let Some(read) = self.read.filter(|read| !read.text.is_empty()) {
            labelled("Printed", visible::text(&read.text), 1);
        }
        if has_room {
            labelled("Described", format!("in the manual, section {}", object.section), 1);
        }
        rows
    }

    /// Its address and name, and where the manual has it. Beside the table there are rows for that, and no columns.
    fn heading(&self, theme: Theme, columns: u16, has_room: bool) -> Line<'static> {
        let (name, address) = (self.name(), self.at.to_string());
        // What is left beside address, remark, and the rule between and around them.
        let left = |remark: &str| {
            let taken = format::width(&address) + 1 + format::width(remark) + lines::BESIDE_HEADING;
            usize::from(columns).saturating_sub(taken)
        };
        let section = self.known.filter(|_| !has_room).map(|(object, _)| format!("section {}", object.section));
        let section = section.unwrap_or_default();
        let long = format!("manual, {section}");
        let is_roomy = !section.is_empty() && format::width(&name) <= left(&long);
        let remark = if is_roomy { long } else { section };
        let title = format!("{address} {}", format::keep_ends(&name, left(&remark)));
        lines::rule(theme, columns, &title, &remark)
    }

    /// Its value with all that is to be said of it, or why there is none.
    fn value_in_words(&self, view: &View) -> String {
        let Some(read) = self.read else {
            return match &view.unit.dictionary {
                Some(read) if !read.reading.is_complete() => "not read: the reading was not completed".to_owned(),
                Some(_) => "not shown by the unit".to_owned(),
                None if view.job == Some(Job::ReadDictionary) => "being read".to_owned(),
                None if view.can_send() => "not read yet: V reads it".to_owned(),
                None => format!("not read. {}", without_unit(view)),
            };
        };
        let mut value = self.value();
        if self.measure().is_some_and(|measure| measure.is_scaled()) {
            value.push_str(&format!(" (raw {})", read.number()));
        }
        if let Some(meaning) = self.meaning() {
            value.push_str(&format!(": {meaning}"));
        }
        if read.deviates {
            value.push_str("; not as the factory made it");
        }
        value
    }

    /// The factory's value with its unit and what it stands for.
    fn factory_in_words(&self, entry: &Entry) -> String {
        let Some(default) = entry.default else { return "none: the unit itself supplies it".to_owned() };
        let meaning = entry.meaning(default.value).map(|text| format!(": {text}")).unwrap_or_default();
        let node = if default.plus_node_id { " + node-ID" } else { "" };
        let raw = dump::shown(entry, default.value);
        let value = match self.measure() {
            Some(measure) => measure.quantity(default.value.as_f64(), &raw),
            None => raw,
        };
        format!("{value}{node}{meaning}")
    }
}

/// `, 0 to 100 °C`.
fn range(limits: &Limits, entry: &Entry) -> String {
    let measure = entry.unit.as_deref().map(Measure::of);
    let number = |value: f64, raw: String| match &measure {
        Some(measure) => measure.number(value, &raw),
        None => raw,
    };
    let bound = |bound: &Bound| match bound {
        Bound::Value(value) => number(value.as_f64(), value.to_string()),
        Bound::Entry { at, offset: 0 } => format!("{at}"),
        Bound::Entry { at, offset } => {
            let sign = if *offset < 0 { '-' } else { '+' };
            let size = offset.unsigned_abs();
            format!("{at} {sign} {}", number(size as f64, size.to_string()))
        }
    };
    let unit = measure.as_ref().map(|measure| format!(" {}", measure.unit)).unwrap_or_default();
    let values: Vec<String> = limits.values.iter().map(|value| number(value.as_f64(), value.to_string())).collect();
    let span = match (&limits.low, &limits.high) {
        (Some(low), Some(high)) => Some(format!("{} to {}{unit}", bound(low), bound(high))),
        (Some(low), None) => Some(format!("from {}{unit}", bound(low))),
        (None, Some(high)) => Some(format!("up to {}{unit}", bound(high))),
        (None, None) => None,
    };
    let parts: Vec<String> = values.into_iter().chain(span).collect();
    if parts.is_empty() { String::new() } else { format!(", {}", parts.join(" or ")) }
}
