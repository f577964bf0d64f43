//! The object dictionary: what the unit shows, beside what its manual says.
//!
//! Before it has been read the manual's own table is there to look things up.

use std::collections::BTreeMap;

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Line;

mod detail;
mod row;

use row::{Row, Widths};

use super::Scene;
use crate::canopen::ObjectAddress;
use crate::dump::{self, Dump};
use crate::session::{Command, Job};
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::{NamedFor, PickedFor, Question};
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
        cmd: Cmd::Filter,
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
    Binding {
        keys: ESC,
        cmd: Cmd::Back,
        short: "everything",
        long: "show everything again; while it is being read: cancel",
    },
];

const ESC: &[Press] = &[Press::Plain(KeyCode::Esc)];
/// What the footer shows while the unit is being read: until then nothing else is wanted of it.
const READING_KEYS: &[Binding] = &[Binding { keys: ESC, cmd: Cmd::Back, short: "cancel", long: "" }];

const HEADING: &str = "Object dictionary";
/// Rows above the table: its heading, and those of its columns.
const HEAD_ROWS: u16 = 2;
/// Rows of the pane that explains the chosen entry, its heading included.
const DETAIL_ROWS: u16 = 8;
/// From this width on that pane is beside the table ...
const BESIDE_AT: u16 = 150;
/// ... and takes this many columns at least; the table takes no more than these.
const DETAIL_COLUMNS: u16 = 64;
const TABLE_COLUMNS: u16 = 140;

/// The page.
#[derive(Debug, Default)]
pub struct Dictionary {
    cursor: usize,
    words: String,
    filter: Filter,
    other: Option<Other>,
}

/// Which entries are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Filter {
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

/// The products of a dump and of the unit, where they are not the same.
pub fn other_product(dump: &Dump, view: &View) -> Option<(String, String)> {
    let ours = view.unit.dictionary.as_ref().and_then(|read| read.dump.product.as_deref());
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
        self.filter = Filter::Differences;
        self.cursor = 0;
    }

    /// What a command does here; `area` is that of the picture.
    pub fn on(&mut self, cmd: Cmd, view: &View, area: Rect) -> Option<Action> {
        let last = self.rows(view).len().saturating_sub(1);
        let page = usize::from(table(area).height).max(1);
        self.cursor = cmd.moved(self.cursor, last, page).unwrap_or(self.cursor.min(last));
        match cmd {
            Cmd::Find => return Some(Action::Ask(Question::find(&self.words))),
            Cmd::Filter => {
                self.filter = match self.filter {
                    Filter::Everything => Filter::Deviations,
                    Filter::Deviations if self.other.is_some() => Filter::Differences,
                    Filter::Deviations | Filter::Differences => Filter::Everything,
                };
                self.cursor = 0;
            }
            Cmd::Back if view.job == Some(Job::ReadDictionary) => return Some(Action::Command(Command::Cancel)),
            Cmd::Back => {
                (self.filter, self.other, self.cursor) = (Filter::Everything, None, 0);
                self.words.clear();
            }
            Cmd::Compare | Cmd::Export if view.unit.dictionary.is_none() => {
                let what = match view.job {
                    Some(Job::ReadDictionary) => {
                        "The object dictionary is being read: wait until it is complete.".to_owned()
                    }
                    _ if view.can_send() => "Nothing has been read yet: V reads the object dictionary.".to_owned(),
                    _ => format!("Nothing has been read. {}", without_unit(view)),
                };
                return Some(Action::Tell(what));
            }
            Cmd::Compare if view.current_dictionary().is_none() => {
                return Some(Action::Tell("What was read is from before the restart: V reads it again.".to_owned()));
            }
            Cmd::Compare => return Some(Action::PickFile(PickedFor::Dump)),
            Cmd::Export => return Some(Action::Ask(Question::file_name(NamedFor::ExportDictionary, view))),
            _ => {}
        }
        None
    }

    /// Whether something is left out, or compared: Esc ends that.
    pub fn is_narrowed(&self) -> bool {
        self.filter != Filter::Everything || self.other.is_some() || !self.words.is_empty()
    }

    /// The keys that mean something now, for the footer.
    pub fn footer(&self, view: &View) -> Vec<Binding> {
        match view.job {
            Some(Job::ReadDictionary) => READING_KEYS.to_vec(),
            _ => BINDINGS.to_vec(),
        }
    }

    /// Everything there is to show: what was read, what the manual has besides, and what only the other dump has.
    fn all_rows<'a>(&self, view: &'a View) -> Vec<Row<'a>> {
        let product = view.product();
        let known = |at: ObjectAddress| {
            let object = product?.dictionary.object(at.index)?;
            Some((object, object.entry(at.sub)?))
        };
        let mut rows: BTreeMap<ObjectAddress, Row> = Row::of_manual(product).map(|row| (row.at, row)).collect();
        for entry in view.unit.dictionary.iter().flat_map(|read| &read.dump.entries) {
            let at = entry.at();
            rows.insert(at, Row { at, known: known(at), read: Some(entry), difference: None });
        }
        if let (Some(other), Some(read)) = (&self.other, &view.unit.dictionary) {
            // What is measured is another value at every reading.
            for difference in dump::differences(&other.dump, &read.dump).into_iter().filter(|found| found.setting) {
                let at = difference.at;
                let row = rows.entry(at).or_insert_with(|| Row { at, known: known(at), read: None, difference: None });
                row.difference = Some(difference);
            }
        }
        rows.into_values().collect()
    }

    /// The rows that are shown.
    fn rows<'a>(&self, view: &'a View) -> Vec<Row<'a>> {
        self.chosen(self.all_rows(view))
    }

    fn chosen<'a>(&self, mut rows: Vec<Row<'a>>) -> Vec<Row<'a>> {
        rows.retain(|row| match self.filter {
            Filter::Everything => true,
            Filter::Deviations => row.read.is_some_and(|read| read.deviates),
            Filter::Differences => row.difference.is_some(),
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
        let (head, table) = lines::split(upper, HEAD_ROWS);
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
        if widths.meaning {
            heads.push_str("Meaning");
        }
        lines::draw(frame, head, heading.into_iter().chain([Line::styled(heads, theme.quiet())]));
        if rows.is_empty() {
            let text = match (view.product(), &view.unit.dictionary) {
                (None, Some(_)) if self.filter == Filter::Deviations => {
                    "Compared with nothing: the unit has not said what it is, so its factory values are not known. Esc \
                     shows everything again."
                }
                (_, Some(_)) if self.filter == Filter::Deviations && self.words.is_empty() => {
                    "Nothing differs from the factory's. Esc shows everything again."
                }
                (_, Some(_)) if self.filter == Filter::Differences && self.words.is_empty() => {
                    "Nothing differs between the two. Esc shows everything again."
                }
                (None, None) if view.job == Some(Job::ReadDictionary) => "The dictionary is being read.",
                (None, None) if view.can_send() => {
                    "Nothing to show: the unit has not said what it is. V reads its dictionary all the same."
                }
                (None, None) => without_unit(view),
                (Some(_), None) if self.filter == Filter::Deviations => {
                    "Nothing has been read of the unit, so nothing is known to differ: V reads it. Esc shows the manual's \
                     entries again."
                }
                _ => "Nothing here matches. O chooses what is shown, / what it has to contain, Esc shows everything.",
            };
            return lines::draw(frame, table, lines::paragraph(text, columns, Style::new()));
        }
        let cursor = self.cursor.min(rows.len() - 1);
        let first = lines::first_visible(cursor, rows.len(), usize::from(table.height));
        let shown = rows.iter().enumerate().skip(first).take(usize::from(table.height));
        lines::draw(frame, table, shown.map(|(number, row)| row.line(scene, number == cursor, &widths)));
        lines::draw(frame, detail, rows[cursor].detail(scene, detail.width, detail.height > DETAIL_ROWS));
    }

    /// The row of the table that is drawn in row `y` of the screen.
    pub fn row_at(&self, view: &View, area: Rect, y: u16) -> Option<usize> {
        let table = table(area);
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
        let only = match self.filter {
            Filter::Everything => None,
            Filter::Deviations => Some("only those".to_owned()),
            Filter::Differences => Some("only differences".into()),
        };
        let words = (!self.words.is_empty()).then(|| format!("with '{}'", visible::text(&self.words)));
        let is_outdated = view.unit.dictionary.as_ref().is_some_and(|read| read.is_outdated);
        let (mut compared, mut time) = (None, None);
        let counted = match &view.unit.dictionary {
            _ if view.job == Some(Job::ReadDictionary) => {
                Some(format!("reading: {} so far", format::grouped(view.unit.entries_read)))
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
                Some(if read.reading.is_complete() {
                    format!("{shown} of {total}")
                } else if shown == total {
                    format!("incomplete: {} of {total} read", read.dump.entries.len())
                } else {
                    format!("{shown} of {total}, incomplete")
                })
            }
        };
        // `only those` are those that are not as the factory made them, and what is old is never shown as if it were not.
        let least = compared.clone().filter(|_| self.filter == Filter::Deviations || is_outdated);
        let text = |compared: &Option<String>, time: &Option<String>| {
            let parts = [&dump, &counted, compared, time, &only, &words];
            parts.into_iter().flatten().map(String::as_str).collect::<Vec<_>>().join(", ")
        };
        let room = usize::from(columns).saturating_sub(format::width(HEADING) + lines::BESIDE_HEADING);
        let longer = [text(&compared, &time), text(&compared, &None), text(&least, &None)];
        let fits = longer.into_iter().find(|text| format::width(text) <= room);
        // What is looked for explains what is missing: it goes last, and its beginning stays.
        fits.unwrap_or_else(|| match &words {
            Some(words) => format::keep_start(words, room),
            None => text(&least, &None),
        })
    }
}

/// Why V cannot read a unit's dictionary.
fn without_unit(view: &View) -> &'static str {
    match &view.link.state {
        LinkState::Closed | LinkState::Opening => "Not connected: press 1 to choose a port or an emulated unit.",
        LinkState::Lost(_) => "The link is lost: C connects again.",
        LinkState::Open => "Nobody has read it in this recording up to here.",
    }
}

/// Where the rows of the table are.
fn table(area: Rect) -> Rect {
    lines::split(parts(area).0, HEAD_ROWS).1
}

/// Where the table with its heading is, and where the chosen entry is explained.
fn parts(area: Rect) -> (Rect, Rect) {
    if area.width < BESIDE_AT {
        return lines::split(area, area.height.saturating_sub(DETAIL_ROWS));
    }
    // Names are as long as they are: what is left beside them goes to what explains.
    let width = (area.width - DETAIL_COLUMNS).min(TABLE_COLUMNS);
    let beside = Rect { x: area.x + width + 2, width: area.width - width - 2, ..area };
    (Rect { width, ..area }, beside)
}
