//! The object dictionary: what the unit shows, beside what its manual says.
//!
//! Before it has been read the manual's own table is there to look things up.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::device::dictionary::{Access, Bound, Entry, Limits, Object};
use crate::dump::{self, Difference, Dump, DumpEntry, Measure};
use crate::session::Job;
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::{Purpose, Question, Wanted};
use crate::tui::view::{LinkState, View};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Dictionary";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "entry above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "choose", long: "entry below" },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "", long: "a page up" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "", long: "a page down" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "first entry" },
    Binding { keys: &[Press::Plain(KeyCode::End)], cmd: Cmd::Last, short: "", long: "last entry" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('/'))],
        cmd: Cmd::Find,
        short: "find",
        long: "only what has these words in address, name, value, meaning",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('o'))],
        cmd: Cmd::Only,
        short: "only",
        long: "everything, only deviations, only what differs from the dump",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('w'))],
        cmd: Cmd::Compare,
        short: "with",
        long: "compare with a saved dump (JSON)",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('e'))],
        cmd: Cmd::Export,
        short: "export",
        long: "write what was read to a file: .json, .csv, .dcf or .txt",
    },
    Binding { keys: &[Press::Plain(KeyCode::Esc)], cmd: Cmd::Back, short: "everything", long: "show everything again" },
];

const HEADING: &str = "Object dictionary";
/// Rows of the pane that explains the chosen entry, its heading included.
const DETAIL_ROWS: u16 = 8;
/// From this width on that pane stands beside the table ...
const BESIDE_AT: u16 = 150;
/// ... and takes so many columns at least; the table takes no more than these.
const DETAIL_COLUMNS: u16 = 64;
const TABLE_COLUMNS: u16 = 140;
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

/// The page.
#[derive(Debug, Default)]
pub struct Dictionary {
    cursor: usize,
    words: String,
    only: Only,
    other: Option<Other>,
}

/// Which entries are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Only {
    #[default]
    Everything,
    Deviations,
    Differences,
}

/// A dump to compare with.
#[derive(Debug)]
struct Other {
    name: String,
    dump: Dump,
}

/// One row of the table.
struct Row<'a> {
    at: ObjectAddress,
    /// What the manual says.
    known: Option<(&'static Object, &'static Entry)>,
    /// What the unit shows.
    read: Option<&'a DumpEntry>,
    /// How the other dump differs.
    difference: Option<Difference>,
}

/// The products of a dump and of the unit, where they are not the same.
pub fn other_product(dump: &Dump, view: &View) -> Option<(String, String)> {
    let ours = view.dictionary.as_ref().and_then(|read| read.dump.product.as_deref());
    let (theirs, ours) = dump.product.as_deref().zip(ours)?;
    (!theirs.eq_ignore_ascii_case(ours)).then(|| (visible::text(theirs), visible::text(ours)))
}

impl Dictionary {
    /// Another link: what it showed is gone.
    pub fn begin_link(&mut self) {
        self.cursor = 0;
    }

    /// Shows only what has these words; none for everything.
    pub fn find(&mut self, words: &str) {
        self.words = words.to_lowercase();
        self.cursor = 0;
    }

    /// A dump to compare with has been read.
    pub fn compare(&mut self, name: String, dump: Dump) {
        self.other = Some(Other { name, dump });
        self.only = Only::Differences;
        self.cursor = 0;
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View, page: usize) -> Option<Action> {
        let last = self.rows(view).len().saturating_sub(1);
        let page = page.saturating_sub(usize::from(DETAIL_ROWS) + 2).max(1);
        self.cursor = match cmd {
            Cmd::Up => self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor + 1,
            Cmd::PageUp => self.cursor.saturating_sub(page),
            Cmd::PageDown => self.cursor + page,
            Cmd::First => 0,
            Cmd::Last => last,
            _ => self.cursor,
        }
        .min(last);
        match cmd {
            Cmd::Find => return Some(Action::Ask(Question::find(&self.words))),
            Cmd::Only => {
                self.only = match self.only {
                    Only::Everything => Only::Deviations,
                    Only::Deviations if self.other.is_some() => Only::Differences,
                    Only::Deviations | Only::Differences => Only::Everything,
                };
                self.cursor = 0;
            }
            Cmd::Back => {
                (self.only, self.other, self.cursor) = (Only::Everything, None, 0);
                self.words.clear();
            }
            Cmd::Compare | Cmd::Export if view.dictionary.is_none() => {
                let what = match view.can_send() {
                    true => "Nothing has been read yet: V reads the object dictionary.".to_owned(),
                    false => format!("Nothing has been read. {}", without_unit(view)),
                };
                return Some(Action::Tell(what));
            }
            Cmd::Compare if view.current_dictionary().is_none() => {
                return Some(Action::Tell("What was read is from before the restart: V reads it again.".to_owned()));
            }
            Cmd::Compare => return Some(Action::Choose(Wanted::Dump)),
            Cmd::Export => return Some(Action::Ask(Question::file(Purpose::ExportDictionary, view))),
            _ => {}
        }
        None
    }

    /// Whether something is left out, or compared: Esc ends that.
    pub fn is_narrowed(&self) -> bool {
        self.only != Only::Everything || self.other.is_some() || !self.words.is_empty()
    }

    /// Everything there is to show: what was read, what the manual has besides, and what only the other dump has.
    fn all_rows<'a>(&self, view: &'a View) -> Vec<Row<'a>> {
        let product = view.product();
        let known = |at: ObjectAddress| {
            let object = product?.dictionary.object(at.index)?;
            Some((object, object.entry(at.sub)?))
        };
        let mut rows: Vec<Row> = match &view.dictionary {
            Some(read) => {
                let entries = read.dump.entries.iter().filter_map(|entry| Some((entry.at()?, entry)));
                let mut rows: Vec<_> = entries
                    .map(|(at, entry)| Row { at, known: known(at), read: Some(entry), difference: None })
                    .collect();
                let missing = manual(product).filter(|row| read.reading.entries.iter().all(|read| read.at != row.at));
                rows.extend(missing.collect::<Vec<_>>());
                rows
            }
            None => manual(product).collect(),
        };
        if let (Some(other), Some(read)) = (&self.other, &view.dictionary) {
            // What is measured is another value at every reading.
            for difference in dump::differences(&other.dump, &read.dump).into_iter().filter(|found| found.setting) {
                let index = u16::from_str_radix(&difference.index, 16).unwrap_or_default();
                let at = ObjectAddress::new(index, difference.subindex);
                match rows.iter_mut().find(|row| row.at == at) {
                    Some(row) => row.difference = Some(difference),
                    None => rows.push(Row { at, known: known(at), read: None, difference: Some(difference) }),
                }
            }
        }
        rows.sort_by_key(|row| (row.at.index, row.at.sub));
        rows
    }

    /// The rows that are shown.
    fn rows<'a>(&self, view: &'a View) -> Vec<Row<'a>> {
        self.chosen(self.all_rows(view))
    }

    fn chosen<'a>(&self, mut rows: Vec<Row<'a>>) -> Vec<Row<'a>> {
        rows.retain(|row| match self.only {
            Only::Everything => true,
            Only::Deviations => row.read.is_some_and(|read| read.deviates),
            Only::Differences => row.difference.is_some(),
        });
        if !self.words.is_empty() {
            let words: Vec<&str> = self.words.split_whitespace().collect();
            rows.retain(|row| {
                let text = row.text();
                words.iter().all(|word| text.contains(word))
            });
        }
        rows
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (theme, view) = (scene.theme, scene.view);
        let all = self.all_rows(view);
        let total = all.len();
        let rows = self.chosen(all);
        let (upper, detail) = parts(area);
        let (head, table) = lines::split(upper, 2);
        let heading = [lines::rule(theme, upper.width, HEADING, &self.remark(scene, rows.len(), total, upper.width))];
        let columns = usize::from(upper.width);
        let factory = match &self.other {
            // Beside the heading of the values `in d1.json` would read as part of it.
            Some(other) => format!("{} has", visible::text(&other.name)),
            None => "Factory".into(),
        };
        let widths = Widths::of(&rows, &factory, self.other.is_some(), columns);
        let mut heads = format!(
            "    {}{} {}  {} ",
            format::left("Address", 9),
            format::left("Name", widths.name),
            format::left("Value", widths.value),
            format::left(&factory, widths.factory)
        );
        if columns >= MEANING_AT {
            heads.push_str("Meaning");
        }
        lines::draw(frame, head, heading.into_iter().chain([Line::styled(heads, theme.quiet())]));
        if rows.is_empty() {
            let text = match (view.product(), &view.dictionary) {
                (None, Some(_)) if self.only == Only::Deviations => {
                    "Compared with nothing: the unit has not said what it is, so its factory values are not known. Esc \
                     shows everything again."
                }
                (_, Some(_)) if self.only == Only::Deviations && self.words.is_empty() => {
                    "Nothing differs from the factory's. Esc shows everything again."
                }
                (_, Some(_)) if self.only == Only::Differences && self.words.is_empty() => {
                    "Nothing differs between the two. Esc shows everything again."
                }
                (None, None) if view.can_send() => {
                    "Nothing to show: the unit has not said what it is. V reads its dictionary all the same."
                }
                (None, None) => without_unit(view),
                _ => "Nothing here matches. O chooses what is shown, / what it has to contain, Esc shows everything.",
            };
            let broken = format::wrap(text, columns.saturating_sub(4));
            return lines::draw(frame, table, broken.into_iter().map(|line| Line::raw(format!("  {line}"))));
        }
        let cursor = self.cursor.min(rows.len() - 1);
        let first = lines::first_visible(cursor, rows.len(), usize::from(table.height));
        let shown = rows.iter().enumerate().skip(first).take(usize::from(table.height));
        lines::draw(frame, table, shown.map(|(number, row)| row.line(scene, number == cursor, &widths)));
        lines::draw(frame, detail, rows[cursor].detail(scene, detail.width, detail.height > DETAIL_ROWS));
    }

    /// The row of the table that is drawn in row `y` of the screen.
    pub fn row_at(&self, view: &View, area: Rect, y: u16) -> Option<usize> {
        let (_, table) = lines::split(parts(area).0, 2);
        let rows = self.rows(view).len();
        let first = lines::first_visible(self.cursor.min(rows.saturating_sub(1)), rows, usize::from(table.height));
        let row = first + usize::from(y.checked_sub(table.y)?);
        (y < table.bottom() && row < rows).then_some(row)
    }

    /// Puts the cursor on a row.
    pub fn choose(&mut self, row: usize) {
        self.cursor = row;
    }

    /// What the table shows, in as many words as there is room for: what is left out goes before what it is left out of.
    fn remark(&self, scene: Scene, shown: usize, total: usize, columns: u16) -> String {
        let view = scene.view;
        let dump = self.other.as_ref().and_then(|other| other_product(&other.dump, view));
        let dump = dump.map(|(theirs, _)| format!("dump of an {theirs}"));
        let only = match self.only {
            Only::Everything => None,
            Only::Deviations => Some("only those".to_owned()),
            Only::Differences => Some("only differences".into()),
        };
        let words = (!self.words.is_empty()).then(|| format!("with '{}'", visible::text(&self.words)));
        let is_outdated = view.dictionary.as_ref().is_some_and(|read| read.is_outdated);
        let (mut compared, mut time) = (None, None);
        let counted = match &view.dictionary {
            _ if view.job == Some(Job::ReadDictionary) => {
                Some(format!("reading: {} so far", format::grouped(view.entries_read)))
            }
            None if view.can_send() => Some("the manual's; V reads the unit's".to_owned()),
            None => view.product().map(|_| "the manual's".into()),
            Some(read) => {
                compared = Some(match view.product() {
                    _ if is_outdated => "from before the restart".to_owned(),
                    Some(_) => format!("{} not as factory", read.dump.deviations()),
                    // Nobody knows what the factory's values are: none of them differs, and none is the same.
                    None => "compared with nothing".into(),
                });
                time = Some(format::time_of_day(scene.start_of_day, read.at));
                Some(format!("{shown} of {total}"))
            }
        };
        // `only those` are those that are not as the factory made them, and what is old is never shown as if it were not.
        let least = compared.clone().filter(|_| self.only == Only::Deviations || is_outdated);
        let text = |compared: &Option<String>, time: &Option<String>| {
            let parts = [&dump, &counted, compared, time, &only, &words];
            parts.into_iter().flatten().map(String::as_str).collect::<Vec<_>>().join(", ")
        };
        let room = usize::from(columns).saturating_sub(format::width(HEADING) + RULE_COLUMNS);
        let longer = [text(&compared, &time), text(&compared, &None)];
        longer.into_iter().find(|text| format::width(text) <= room).unwrap_or_else(|| text(&least, &None))
    }
}

/// Why V cannot read a unit's dictionary.
fn without_unit(view: &View) -> &'static str {
    match &view.link.state {
        LinkState::Closed | LinkState::Opening => "Not connected: press 1 to choose a port or an emulated unit.",
        LinkState::Lost(_) => "The link is lost: C connects again.",
        LinkState::Open { .. } => "Nobody has read it in this recording up to here.",
    }
}

/// Where the table with its heading stands, and where the chosen entry is explained.
fn parts(area: Rect) -> (Rect, Rect) {
    match area.width >= BESIDE_AT {
        true => {
            // Names are as long as they are: what is left beside them goes to what explains.
            let width = (area.width - DETAIL_COLUMNS).min(TABLE_COLUMNS);
            let beside = Rect { x: area.x + width + 2, width: area.width - width - 2, ..area };
            (Rect { width, ..area }, beside)
        }
        false => lines::split(area, area.height.saturating_sub(DETAIL_ROWS)),
    }
}

/// The manual's entries, as nobody has read them.
fn manual<'a>(product: Option<&'static Product>) -> impl Iterator<Item = Row<'a>> {
    product.into_iter().flat_map(|product| product.dictionary.entries()).map(|(at, object, entry)| Row {
        at,
        known: Some((object, entry)),
        read: None,
        difference: None,
    })
}

/// How wide the columns are.
struct Widths {
    name: usize,
    value: usize,
    factory: usize,
    /// The meaning of the value has a column.
    meaning: bool,
}

impl Widths {
    /// As wide as what is in them, within limits; the names have the rest.
    fn of(rows: &[Row], factory: &str, compares: bool, columns: usize) -> Self {
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

/// What stands between two values, which may be of many words.
const VALUES_APART: &str = "  ";
/// Columns of a heading's rule beside its texts, and of the blank in its title.
const RULE_COLUMNS: usize = 11;

impl Row<'_> {
    fn name(&self) -> String {
        match self.known {
            Some((object, entry)) => dump::name(object, entry),
            None => "not in the manual".into(),
        }
    }

    /// How its numbers stand for a quantity, where they do.
    fn measure(&self) -> Option<Measure> {
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

    fn value(&self) -> String {
        match (self.read.is_some_and(|read| read.value.is_some()), self.measure()) {
            (true, Some(measure)) => format!("{} {}", self.bare_value(), measure.unit),
            _ => self.bare_value(),
        }
    }

    /// The value in so many columns: rather the whole number without its unit, which is told below, than half of both.
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

    /// The same in so many columns: with its unit where there is room for both.
    fn other_cell(&self, columns: usize) -> String {
        let bare = self.other();
        let with_unit = self.measure().map(|measure| format!("{bare} {}", measure.unit));
        let is_number = bare.trim_start_matches('-').starts_with(|first: char| first.is_ascii_digit());
        with_unit.filter(|text| is_number && format::width(text) <= columns).unwrap_or(bare)
    }

    /// What the value stands for; what stands in place of one needs no other words.
    fn meaning(&self) -> Option<&str> {
        self.read.filter(|read| read.value.is_some()).and_then(|read| read.meaning.as_deref())
    }

    /// What is searched, in lower case.
    fn text(&self) -> String {
        let description = self.known.and_then(|(_, entry)| entry.description.as_deref()).unwrap_or_default();
        // Also as the unit keeps it: that is what other tools show.
        let raw = self.read.map(DumpEntry::shown).unwrap_or_default();
        let (value, meaning) = (self.value(), self.meaning().unwrap_or(""));
        let text = format!("{} {} {value} {raw} {meaning} {description}", self.at, self.name());
        text.to_lowercase()
    }

    fn line(&self, scene: Scene, is_chosen: bool, widths: &Widths) -> Line<'static> {
        let theme = scene.theme;
        let deviates = self.read.is_some_and(|read| read.deviates);
        let was_read = scene.view.dictionary.is_some();
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

    /// Everything about it; without much room the first lines of it.
    fn detail(&self, scene: Scene, columns: u16, has_room: bool) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let room = usize::from(columns).saturating_sub(2 + lines::LABEL_COLUMNS);
        let section = self.known.map(|(object, _)| format!("section {}", object.section)).unwrap_or_default();
        let long = self.known.map(|_| format!("manual, {section}")).unwrap_or_default();
        let address = self.at.to_string();
        // What is left beside address, remark, and the rule between and around them.
        let left = |remark: &str| {
            usize::from(columns).saturating_sub(format::width(&address) + format::width(remark) + RULE_COLUMNS)
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
            None if scene.view.dictionary.is_some() => value = "not shown by the unit".into(),
            None if scene.view.can_send() => value = "not read yet: V reads it".into(),
            None => value = format!("not read. {}", without_unit(scene.view)),
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
