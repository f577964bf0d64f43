//! Everything about one entry: the pane beside or below the table.

use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::row::Row;
use super::{Scene, without_unit};
use crate::device::dictionary::{Access, Bound, Entry, Limits};
use crate::dump::{self, Measure};
use crate::session::Job;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

impl Row<'_> {
    /// Everything about it; without much room the first lines of it.
    pub(super) fn detail(&self, scene: Scene, columns: u16, has_room: bool) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let room = usize::from(columns).saturating_sub(2 + lines::LABEL_COLUMNS);
        let section = self.known.map(|(object, _)| format!("section {}", object.section)).unwrap_or_default();
        let long = self.known.map(|_| format!("manual, {section}")).unwrap_or_default();
        let address = self.at.to_string();
        // What is left beside address, remark, and the rule between and around them.
        let left = |remark: &str| {
            let taken = format::width(&address) + 1 + format::width(remark) + lines::BESIDE_HEADING;
            usize::from(columns).saturating_sub(taken)
        };
        let fits = |remark: &str| format::width(&self.name()) <= left(remark);
        // Beside the table there are rows for it, and no columns.
        let remark = match has_room {
            true => "",
            false if fits(&long) => &long,
            false => &section,
        };
        let title = format!("{address} {}", format::keep_ends(&self.name(), left(remark)));
        let mut rows = vec![lines::rule(theme, columns, &title, remark)];
        let mut labelled = |label: &str, text: String, most: usize| {
            let most = if has_room { usize::MAX } else { most };
            for (number, line) in format::wrap(&text, room).into_iter().take(most).enumerate() {
                let label = if number == 0 { label } else { "" };
                rows.push(lines::labelled(theme, label, Span::styled(line, Style::new())));
            }
        };
        let mut value = self.value();
        if let Some(read) = self.read.filter(|_| self.measure().is_some_and(|measure| measure.is_scaled())) {
            value.push_str(&format!(" (raw {})", read.number()));
        }
        if let Some(meaning) = self.meaning() {
            value.push_str(&format!(": {meaning}"));
        }
        match self.read {
            Some(read) if read.deviates => value.push_str("; not as the factory made it"),
            Some(_) => {}
            None => match &scene.view.unit.dictionary {
                Some(read) if !read.reading.is_complete() => value = "not read: the reading was not completed".into(),
                Some(_) => value = "not shown by the unit".into(),
                None if scene.view.job == Some(Job::ReadDictionary) => value = "being read".into(),
                None if scene.view.can_send() => value = "not read yet: V reads it".into(),
                None => value = format!("not read. {}", without_unit(scene.view)),
            },
        }
        labelled("Value", value, 1);
        let Some((_, entry)) = self.known else {
            let text = self.read.map(|read| visible::text(&read.text)).unwrap_or_default();
            labelled("Printed", text, 3);
            return rows;
        };
        let factory = entry.default.map_or_else(
            || "none: the unit itself supplies it".to_owned(),
            |default| {
                let meaning = entry.meaning(default.value).map(|text| format!(": {text}")).unwrap_or_default();
                let node = if default.plus_node_id { " + node-ID" } else { "" };
                let raw = dump::shown(entry, default.value);
                let value = match self.measure() {
                    Some(measure) => measure.quantity(default.value.as_f64(), &raw),
                    None => raw,
                };
                format!("{value}{node}{meaning}")
            },
        );
        labelled("Factory", factory, 1);
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
            labelled("Described", format!("in the {long}"), 1);
        }
        rows
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
