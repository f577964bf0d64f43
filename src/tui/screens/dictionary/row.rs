//! One row of the table: an entry as the manual has it, as the unit shows it, and as another dump has it.

use ratatui::text::{Line, Span};

use super::Scene;
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::device::dictionary::{Entry, Object};
use crate::dump::{self, Difference, DumpEntry, Measure};
use crate::tui::visible;
use crate::tui::widgets::format;

/// Columns of cursor, mark and address.
const FIXED_COLUMNS: usize = 4 + 9;
/// Columns at most of the value and of the factory's: on a narrow screen they leave room for the longest name.
const MOST_COLUMNS: [(usize, usize); 2] = [(14, 10), (22, 16)];
/// From this width on there is room for the wider ones.
const WIDE_AT: usize = 100;
/// From this width on the meaning of the value has a column.
const MEANING_AT: usize = 120;
/// Columns of it.
const MEANING_COLUMNS: usize = 36;

/// One row of the table.
pub(super) struct Row<'a> {
    pub(super) at: ObjectAddress,
    /// What the manual says.
    pub(super) known: Option<(&'static Object, &'static Entry)>,
    /// What the unit shows.
    pub(super) read: Option<&'a DumpEntry>,
    /// How the other dump differs.
    pub(super) difference: Option<Difference>,
}

/// How wide the columns are.
pub(super) struct Widths {
    pub(super) name: usize,
    pub(super) value: usize,
    pub(super) factory: usize,
    /// The meaning of the value has a column.
    pub(super) meaning: bool,
}

impl Widths {
    /// As wide as what is in them, within limits; the names have the rest.
    pub(super) fn of(rows: &[Row], factory: &str, compares: bool, columns: usize) -> Self {
        let (most_value, most_factory) = MOST_COLUMNS[usize::from(columns >= WIDE_AT || compares)];
        let widest = |head: &str, cells: &mut dyn Iterator<Item = String>| {
            cells.map(|cell| format::width(&cell)).max().unwrap_or_default().max(format::width(head))
        };
        let value = widest("Value", &mut rows.iter().map(|row| row.cell(most_value))).min(most_value);
        let factory = widest(factory, &mut rows.iter().map(|row| row.other_cell(most_factory))).min(most_factory);
        let meaning = columns >= MEANING_AT;
        let taken =
            FIXED_COLUMNS + value + factory + 2 + VALUES_APART.len() + if meaning { MEANING_COLUMNS } else { 0 };
        Widths { name: columns.saturating_sub(taken), value, factory, meaning }
    }
}

/// What separates two values, which may be of many words.
const VALUES_APART: &str = "  ";
impl<'a> Row<'a> {
    /// The manual's entries, as nobody has read them.
    pub(super) fn of_manual(product: Option<&'static Product>) -> impl Iterator<Item = Row<'a>> {
        product.into_iter().flat_map(|product| product.dictionary.entries()).map(|(at, object, entry)| Row {
            at,
            known: Some((object, entry)),
            read: None,
            difference: None,
        })
    }
}

impl Row<'_> {
    pub(super) fn name(&self) -> String {
        match self.known {
            Some((object, entry)) => dump::name(object, entry),
            None => "not in the manual".into(),
        }
    }

    /// How its numbers stand for a quantity, where they do.
    pub(super) fn measure(&self) -> Option<Measure> {
        let of_manual = self.known.and_then(|(_, entry)| entry.unit.as_deref());
        self.read.and_then(|read| read.unit.as_deref()).or(of_manual).map(Measure::of)
    }

    /// A number as people read it, without its unit.
    fn number(&self, raw: String) -> String {
        match (self.measure(), raw.parse()) {
            (Some(measure), Ok(value)) => measure.number(value, &raw),
            _ => raw,
        }
    }

    /// The value without its unit.
    fn bare_value(&self) -> String {
        match self.read {
            Some(read) if read.value.is_none() => read.meaning.clone().unwrap_or_else(|| visible::text(&read.text)),
            Some(read) => self.number(read.shown()),
            None => "-".into(),
        }
    }

    pub(super) fn value(&self) -> String {
        match (self.read.is_some_and(|read| read.value.is_some()), self.measure()) {
            (true, Some(measure)) => format!("{} {}", self.bare_value(), measure.unit),
            _ => self.bare_value(),
        }
    }

    /// The value in this many columns: rather the whole number without its unit, which is shown below, than half of both.
    fn cell(&self, columns: usize) -> String {
        let value = self.value();
        if format::width(&value) <= columns { value } else { self.bare_value() }
    }

    /// The factory's value, without its unit.
    fn default(&self) -> String {
        let manual = || self.known.and_then(|(_, entry)| Some(dump::shown(entry, entry.default?.value)));
        match self.read {
            Some(read) => self.number(read.shown_default()),
            None => manual().map_or_else(|| "-".into(), |raw| self.number(raw)),
        }
    }

    /// What the value is compared with.
    fn other(&self) -> String {
        match &self.difference {
            Some(difference) => difference.shown_left().map_or_else(|| "not there".into(), |raw| self.number(raw)),
            None => self.default(),
        }
    }

    /// The same in this many columns: with its unit where there is room for both.
    fn other_cell(&self, columns: usize) -> String {
        let bare = self.other();
        let with_unit = self.measure().map(|measure| format!("{bare} {}", measure.unit));
        let is_number = bare.trim_start_matches('-').starts_with(|first: char| first.is_ascii_digit());
        with_unit.filter(|text| is_number && format::width(text) <= columns).unwrap_or(bare)
    }

    /// What the value stands for; what takes the place of one needs no other words.
    pub(super) fn meaning(&self) -> Option<&str> {
        self.read.filter(|read| read.value.is_some()).and_then(|read| read.meaning.as_deref())
    }

    /// What is searched, in lower case.
    pub(super) fn text(&self) -> String {
        let description = self.known.and_then(|(_, entry)| entry.description.as_deref()).unwrap_or_default();
        // Also as the unit keeps it: that is what other tools show.
        let raw = self.read.map(DumpEntry::shown).unwrap_or_default();
        let (value, meaning) = (self.value(), self.meaning().unwrap_or(""));
        let text = format!("{} {} {value} {raw} {meaning} {description}", self.at, self.name());
        text.to_lowercase()
    }

    pub(super) fn line(&self, scene: Scene, is_chosen: bool, widths: &Widths) -> Line<'static> {
        let theme = scene.theme;
        let deviates = self.read.is_some_and(|read| read.deviates);
        let was_read = scene.view.unit.dictionary.is_some();
        let mark = match (self.read, &self.difference) {
            (_, Some(_)) => "≠",
            (Some(_), None) if deviates => "*",
            (None, None) if was_read => "?",
            _ => " ",
        };
        let value = self.cell(widths.value);
        let value_style = if deviates || self.difference.is_some() { theme.warning() } else { theme.strong() };
        let mut line = Line::from(vec![
            Span::raw(if is_chosen { "› " } else { "  " }),
            Span::styled(format!("{mark} "), theme.warning()),
            Span::raw(format::left(&self.at.to_string(), 9)),
            Span::raw(format::left(&format::keep_ends(&self.name(), widths.name), widths.name)),
            Span::raw(" "),
            Span::styled(format::left(&value, widths.value), value_style),
            Span::raw(VALUES_APART),
            Span::styled(format::left(&self.other_cell(widths.factory), widths.factory), theme.quiet()),
            Span::raw(" "),
        ]);
        if widths.meaning {
            line.push_span(Span::raw(format::left(self.meaning().unwrap_or_default(), MEANING_COLUMNS)));
        }
        if is_chosen { line.style(theme.bar()) } else { line }
    }
}
