//! Where to connect: the serial ports, the emulated units, anything else by name.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Line;

use super::{Scene, ScreenId};
use crate::device::Product;
use crate::tui::action::Action;
use crate::tui::input::{PortEntry, RecordingEntry};
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::link_name;
use crate::tui::popup::Question;
use crate::tui::theme::Theme;
use crate::tui::view::{LinkState, View};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Connect";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "entry above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "choose", long: "entry below" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "first entry" },
    Binding { keys: &[Press::Plain(KeyCode::End)], cmd: Cmd::Last, short: "", long: "last entry" },
    Binding { keys: &[Press::Plain(KeyCode::Enter)], cmd: Cmd::Accept, short: "connect", long: "connect" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('p'))],
        cmd: Cmd::Type,
        short: "path",
        long: "type the path of a port that is not listed",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Refresh,
        short: "refresh",
        long: "look for ports again",
    },
    Binding { keys: &[Press::Plain(KeyCode::Char('x'))], cmd: Cmd::Disconnect, short: "close", long: "close the link" },
];

/// The heading above the list.
const PORTS: &str = "Serial ports";
/// Rows below the list that explain the chosen entry.
const DETAIL_ROWS: u16 = 6;
/// Links used before that are shown, at most.
const MOST_RECENT: usize = 5;
/// Columns of a port's name; a longer one keeps its end.
const NAME_COLUMNS: usize = 22;

/// The list of links.
#[derive(Debug, Default)]
pub struct Connect {
    ports: Ports,
    /// Links that were used before, newest first.
    recent: Vec<String>,
    /// The link that was opened last.
    current: Option<String>,
    /// How many recordings there are.
    recordings: usize,
    cursor: usize,
    /// The link that could not be opened, until the user chooses another.
    failed: Option<String>,
}

/// The serial ports.
#[derive(Debug, Default)]
enum Ports {
    #[default]
    Listing,
    Listed(Vec<PortEntry>),
    Failed(String),
}

/// What a row of the list stands for.
enum Entry<'a> {
    Port(&'a PortEntry),
    Emulated(&'static Product),
    Recent(&'a str),
    Other,
    Recordings,
}

impl Connect {
    /// A list is on its way. The one there is stays until then.
    pub fn listing(&mut self) {
        if let Ports::Failed(_) = self.ports {
            self.ports = Ports::Listing;
        }
    }

    /// The list has come.
    pub fn listed(&mut self, ports: Result<Vec<PortEntry>, String>) {
        let was_listed = matches!(self.ports, Ports::Listed(_));
        let stays = was_listed || self.cursor > 0;
        self.change(stays, |connect| connect.ports = ports.map_or_else(Ports::Failed, Ports::Listed));
        self.point_at_failed();
    }

    /// The recordings have been listed, newest first: they tell what was connected before.
    pub fn recorded(&mut self, recordings: &[RecordingEntry]) {
        // What is open may not be recorded.
        let mut recent: Vec<String> = self.current.iter().cloned().collect();
        for recorded in recordings.iter().filter_map(|entry| entry.content.as_ref().ok()) {
            if recent.len() < MOST_RECENT && !recent.contains(&recorded.port) {
                recent.push(recorded.port.clone());
            }
        }
        self.change(true, |connect| (connect.recent, connect.recordings) = (recent, recordings.len()));
        self.point_at_failed();
    }

    /// A link is open: it is in the list, whatever it is, and the cursor is on it.
    pub fn opened(&mut self, link: &str) {
        self.failed = None;
        self.change(true, |connect| {
            connect.current = Some(link.to_owned());
            connect.recent.retain(|known| known != link);
            connect.recent.insert(0, link.to_owned());
            connect.recent.truncate(MOST_RECENT);
        });
        let entries = self.entries();
        let place = entries.iter().position(|entry| entry.name().eq_ignore_ascii_case(link));
        self.cursor = place.unwrap_or(self.cursor);
    }

    /// A link could not be opened. An Enter too many must not open another one instead.
    pub fn failed(&mut self, link: String) {
        self.failed = Some(link);
        self.point_at_failed();
    }

    /// Puts the cursor on the link that could not be opened, or on what asks for a name where that is not listed.
    fn point_at_failed(&mut self) {
        let Some(failed) = &self.failed else { return };
        let entries = self.entries();
        let place = |wanted: &dyn Fn(&Entry) -> bool| entries.iter().position(wanted);
        let place = place(&|entry| entry.name().eq_ignore_ascii_case(failed))
            .or_else(|| place(&|entry| matches!(entry, Entry::Other)));
        self.cursor = place.unwrap_or(self.cursor);
    }

    /// Changes the list; the cursor stays on the entry it was on, wherever that is then.
    fn change(&mut self, stays: bool, change: impl FnOnce(&mut Connect)) {
        let name = |connect: &Connect, number: usize| connect.entries().get(number).map(Entry::name);
        let chosen = name(self, self.cursor).filter(|_| stays);
        change(self);
        let kept =
            chosen.and_then(|chosen| (0..self.entries().len()).find(|&n| name(self, n).as_ref() == Some(&chosen)));
        self.cursor = kept.unwrap_or(0);
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View) -> Option<Action> {
        let last = self.entries().len() - 1;
        if matches!(cmd, Cmd::Up | Cmd::Down | Cmd::First | Cmd::Last) {
            self.failed = None;
        }
        match cmd {
            Cmd::Up => self.cursor = self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor = (self.cursor + 1).min(last),
            Cmd::First => self.cursor = 0,
            Cmd::Last => self.cursor = last,
            Cmd::Accept => {
                return Some(match self.entries().get(self.cursor) {
                    Some(Entry::Recordings) => Action::Go(ScreenId::Recordings),
                    Some(Entry::Other) | None => Action::Ask(Question::link()),
                    Some(entry) => Action::Open(entry.name()),
                });
            }
            Cmd::Type => return Some(Action::Ask(Question::link())),
            Cmd::Refresh => return Some(Action::ListPorts),
            Cmd::Disconnect => {
                return match view.link.state {
                    LinkState::Open if view.is_in_the_middle() => {
                        Some(Action::Ask(Question::Disconnect { then: None }))
                    }
                    LinkState::Open | LinkState::Lost(_) => Some(Action::Disconnect { then: None }),
                    LinkState::Closed | LinkState::Opening => Some(Action::Tell("No link is open.".into())),
                };
            }
            _ => {}
        }
        None
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (list, detail) = lines::split(area, area.height.saturating_sub(DETAIL_ROWS));
        let (rows, places) = self.rows(scene, list.width);
        let first = self.first_row(&places, rows.len(), list);
        let below = rows.len().saturating_sub(first + usize::from(list.height));
        let more = match (first > 0, below > 0) {
            (true, true) => "more above ↑ and below ↓",
            (true, false) => "more above ↑",
            (false, true) => "more below ↓",
            (false, false) => "",
        };
        lines::draw(frame, list, rows.into_iter().skip(first));
        lines::draw(frame, detail, self.detail(scene, detail.width, more));
    }

    /// The entry that is drawn in row `y` of the screen.
    pub fn entry_at(&self, scene: Scene, area: Rect, y: u16) -> Option<usize> {
        let (list, _) = lines::split(area, area.height.saturating_sub(DETAIL_ROWS));
        let (rows, places) = self.rows(scene, list.width);
        let row = usize::from(y.checked_sub(list.y)?) + self.first_row(&places, rows.len(), list);
        (y < list.bottom()).then(|| places.iter().position(|&place| place == row))?
    }

    /// Puts the cursor on an entry. Says whether it was there already.
    pub fn choose(&mut self, number: usize) -> bool {
        self.failed = None;
        std::mem::replace(&mut self.cursor, number) == number
    }

    fn first_row(&self, places: &[usize], rows: usize, list: Rect) -> usize {
        let cursor_row = places.get(self.cursor).copied().unwrap_or_default();
        lines::first_visible(cursor_row, rows, usize::from(list.height))
    }

    /// All rows of the list, and in which of them each entry is.
    fn rows(&self, scene: Scene, columns: u16) -> (Vec<Line<'static>>, Vec<usize>) {
        let theme = scene.theme;
        let mut rows = vec![lines::rule(theme, columns, PORTS, "")];
        let mut places = Vec::new();
        match &self.ports {
            Ports::Listing => rows.push(Line::styled("  Looking for ports ...", theme.quiet())),
            Ports::Failed(why) => {
                let text = format!("The ports cannot be listed: {}", visible::text(why));
                rows.extend(lines::paragraph(&text, usize::from(columns), theme.bad()));
            }
            Ports::Listed(ports) if ports.is_empty() => {
                rows.push(Line::raw("  None found. Plug in the adapter and press R, or press P to type a path."));
            }
            Ports::Listed(_) => {}
        }
        let mut heading = PORTS;
        for (number, entry) in self.entries().iter().enumerate() {
            let (section, remark) = match entry {
                Entry::Port(_) => (PORTS, ""),
                Entry::Emulated(_) => ("Emulated units", "no hardware needed"),
                Entry::Recent(_) => ("Used before", ""),
                Entry::Other | Entry::Recordings => ("Other", ""),
            };
            if section != heading {
                heading = section;
                rows.extend([Line::default(), lines::rule(theme, columns, section, remark)]);
            }
            let is_chosen = number == self.cursor;
            places.push(rows.len());
            rows.push(row(scene, entry, is_chosen, usize::from(columns)));
        }
        (rows, places)
    }

    fn detail(&self, scene: Scene, columns: u16, more: &str) -> Vec<Line<'static>> {
        let entries = self.entries();
        let Some(entry) = entries.get(self.cursor) else { return Vec::new() };
        let mut shown = vec![Line::default(), lines::rule(scene.theme, columns, &entry.heading(), more)];
        shown.extend(entry.explained(scene));
        shown
    }

    fn entries(&self) -> Vec<Entry<'_>> {
        let ports: &[PortEntry] = match &self.ports {
            Ports::Listed(ports) => ports,
            Ports::Listing | Ports::Failed(_) => &[],
        };
        let emulated = Product::all().iter().map(Entry::Emulated);
        let mut entries: Vec<Entry> = ports.iter().map(Entry::Port).chain(emulated).collect();
        let listed: Vec<String> = entries.iter().map(Entry::name).collect();
        let is_new = |name: &&String| !listed.iter().any(|known| known.eq_ignore_ascii_case(name));
        entries.extend(self.recent.iter().filter(is_new).map(|name| Entry::Recent(name)));
        entries.push(Entry::Other);
        entries.extend((self.recordings > 0).then_some(Entry::Recordings));
        entries
    }
}

impl Entry<'_> {
    /// What opens it, or what it is.
    fn name(&self) -> String {
        match self {
            Entry::Port(port) => port.link.clone(),
            Entry::Emulated(product) => link_name::emulated(product),
            Entry::Recent(name) => (*name).to_owned(),
            Entry::Other => "another port ...".into(),
            Entry::Recordings => "recordings ...".into(),
        }
    }

    /// Its name above what explains it.
    fn heading(&self) -> String {
        match self {
            Entry::Port(port) => visible::text(&port.link),
            Entry::Emulated(product) => format!("Emulated {}", product.name),
            Entry::Recent(name) => visible::text(name),
            Entry::Other => "Another port".into(),
            Entry::Recordings => "Recordings".into(),
        }
    }

    fn explained(&self, scene: Scene) -> Vec<Line<'static>> {
        match self {
            Entry::Port(port) => about_port(scene.theme, port),
            Entry::Emulated(product) => vec![
                told(&format!("{}, hosted in this program on a real pseudo-terminal.", product.title)),
                told("Behaves as the manual says. Its password for loading software is AXIO-2010."),
            ],
            Entry::Recent(name) => about_recent(scene.view, name),
            Entry::Recordings => {
                vec![told("Every connection is recorded. A recording shows on all screens what happened then.")]
            }
            Entry::Other => vec![
                told("/dev/ttyUSB0 or COM3      a serial port that is not listed"),
                told("/dev/pts/3 or a link      a pseudo-terminal, e.g. of axcon emulate or socat"),
                told("tcp://host:port, rfc2217://host:port  a serial port in the network"),
            ],
        }
    }
}

/// A line of what explains an entry.
fn told(text: &str) -> Line<'static> {
    Line::raw(format!("  {text}"))
}

fn about_port(theme: Theme, port: &PortEntry) -> Vec<Line<'static>> {
    let state = match &port.busy_by {
        Some(holder) => {
            told(&format!("In use by {}: it has to let go first.", visible::text(holder))).style(theme.warning())
        }
        None => told("115200 baud, 8 data bits, no parity, 1 stop bit, flow control Xon/Xoff."),
    };
    let cables = Product::all().iter().map(|product| {
        let cable = &product.cable;
        told(&format!(
            "{}, {}: pin {} to DB-9 pin {}, {} to {}, ground {} to {}.",
            product.name,
            cable.connector,
            cable.transmit.unit,
            cable.transmit.db9,
            cable.receive.unit,
            cable.receive.db9,
            cable.ground.unit,
            cable.ground.db9,
        ))
    });
    std::iter::once(state).chain(cables).collect()
}

fn about_recent(view: &View, name: &str) -> Vec<Line<'static>> {
    let is_ours = view.link.name.as_deref() == Some(name);
    let mut shown = vec![told(match &view.link.state {
        LinkState::Open if is_ours => "Connected now.",
        LinkState::Opening if is_ours => "Being opened.",
        LinkState::Lost(_) if is_ours => "Connected last: the link is lost.",
        _ => "Connected before, according to the recordings.",
    })];
    // Which folder that was is not recorded.
    if name.contains('/') && !name.starts_with('/') && !name.contains("://") {
        shown.push(told("A path from the folder of that time: from another it leads elsewhere."));
    }
    shown
}

fn row(scene: Scene, entry: &Entry, is_chosen: bool, columns: usize) -> Line<'static> {
    let theme = scene.theme;
    let (name, description, link) = match entry {
        Entry::Port(port) => {
            let busy = if port.busy_by.is_some() { "in use: " } else { "" };
            (visible::text(&port.link), format!("{busy}{}", visible::text(&port.description)), Some(port.link.clone()))
        }
        Entry::Emulated(product) => {
            let link = link_name::emulated(product);
            (link.clone(), product.title.clone(), Some(link))
        }
        Entry::Recent(name) => (visible::text(name), String::new(), Some((*name).to_owned())),
        Entry::Other => (entry.name(), "type its path, or an address in the network".into(), None),
        Entry::Recordings => (entry.name(), "what was connected before, to look at again".into(), None),
    };
    let is_ours = link.is_some() && link == scene.view.link.name;
    let state = match &scene.view.link.state {
        LinkState::Open if is_ours => format!("connected, {} baud", scene.view.link.baud),
        LinkState::Opening if is_ours => "opening".into(),
        LinkState::Lost(_) if is_ours => "lost".into(),
        _ => String::new(),
    };
    let mark = if is_chosen { "›" } else { " " };
    let name = format::left(&format::keep_end(&name, NAME_COLUMNS), NAME_COLUMNS);
    let room = columns.saturating_sub(NAME_COLUMNS + 6 + format::width(&state) + 1);
    let text = format!(" {mark} {name}  {} {state} ", format::left(&description, room));
    Line::styled(text, if is_chosen { theme.bar() } else { Style::new() })
}
