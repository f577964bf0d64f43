//! Where to connect: the serial ports, the emulated units, anything else by name.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::device::Product;
use crate::tui::action::Action;
use crate::tui::input::PortEntry;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::Question;
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

/// Rows below the list that explain the chosen entry.
const DETAIL_ROWS: u16 = 6;
/// Columns of a port's name; a longer one keeps its end.
const NAME_COLUMNS: usize = 22;

/// The list of links.
#[derive(Debug, Default)]
pub struct Connect {
    ports: Ports,
    cursor: usize,
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
    Other,
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
        // The cursor stays on the entry it was on, wherever that is now.
        let was_listed = matches!(self.ports, Ports::Listed(_));
        let chosen = self.link_of(self.cursor).filter(|_| was_listed || self.cursor > 0);
        self.ports = ports.map_or_else(Ports::Failed, Ports::Listed);
        let kept = chosen.and_then(|link| (0..self.entries().len()).find(|&n| self.link_of(n).as_ref() == Some(&link)));
        self.cursor = kept.unwrap_or(0);
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View) -> Option<Action> {
        let last = self.entries().len() - 1;
        match cmd {
            Cmd::Up => self.cursor = self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor = (self.cursor + 1).min(last),
            Cmd::First => self.cursor = 0,
            Cmd::Last => self.cursor = last,
            Cmd::Accept => {
                return Some(match self.link_of(self.cursor) {
                    Some(link) => Action::Open(link),
                    None => Action::Ask(Question::link()),
                });
            }
            Cmd::Type => return Some(Action::Ask(Question::link())),
            Cmd::Refresh => return Some(Action::ListPorts),
            Cmd::Disconnect => {
                return match view.link.state {
                    LinkState::Open { .. } if view.job.is_some() => Some(Action::Ask(Question::Disconnect)),
                    LinkState::Open { .. } | LinkState::Lost(_) => Some(Action::Disconnect),
                    LinkState::Closed | LinkState::Opening => None,
                };
            }
            _ => {}
        }
        None
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (list, detail) = lines::split(area, area.height.saturating_sub(DETAIL_ROWS));
        let (rows, cursor_row) = self.rows(scene, list.width);
        let first = lines::first_visible(cursor_row, rows.len(), usize::from(list.height));
        lines::draw(frame, list, rows.into_iter().skip(first));
        lines::draw(frame, detail, self.detail(scene, detail.width));
    }

    /// All rows of the list, and which of them the cursor is on.
    fn rows(&self, scene: Scene, columns: u16) -> (Vec<Line<'static>>, usize) {
        let theme = scene.theme;
        let mut rows = vec![lines::rule(theme, columns, "Serial ports", "")];
        let mut cursor_row = 0;
        match &self.ports {
            Ports::Listing => rows.push(Line::styled("  Looking for ports ...", theme.quiet())),
            Ports::Failed(why) => rows.push(Line::from(vec![
                Span::styled("  The ports cannot be listed: ", theme.bad()),
                Span::raw(visible::text(why)),
            ])),
            Ports::Listed(ports) if ports.is_empty() => {
                rows.push(Line::raw("  None found. Plug in the adapter and press R, or press P to type a path."));
            }
            Ports::Listed(_) => {}
        }
        let mut heading = 0;
        for (number, entry) in self.entries().iter().enumerate() {
            let section = match entry {
                Entry::Port(_) => 0,
                Entry::Emulated(_) => 1,
                Entry::Other => 2,
            };
            if section != heading {
                heading = section;
                rows.push(Line::default());
                rows.push(match section {
                    1 => lines::rule(theme, columns, "Emulated units", "no hardware needed"),
                    _ => lines::rule(theme, columns, "Other", ""),
                });
            }
            let is_chosen = number == self.cursor;
            if is_chosen {
                cursor_row = rows.len();
            }
            rows.push(row(scene, entry, is_chosen, usize::from(columns)));
        }
        (rows, cursor_row)
    }

    fn detail(&self, scene: Scene, columns: u16) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let text = |line: String| Line::raw(format!("  {line}"));
        let entries = self.entries();
        let Some(entry) = entries.get(self.cursor) else { return Vec::new() };
        let heading = match entry {
            Entry::Port(port) => visible::text(&port.link),
            Entry::Emulated(product) => format!("Emulated {}", product.name),
            Entry::Other => "Another port".into(),
        };
        let mut shown = vec![Line::default(), lines::rule(theme, columns, &heading, "")];
        match entry {
            Entry::Port(port) => {
                match &port.busy_by {
                    Some(holder) => shown.push(Line::styled(
                        format!("  In use by {}: it has to let go first.", visible::text(holder)),
                        theme.warning(),
                    )),
                    None => shown
                        .push(text("115200 baud, 8 data bits, no parity, 1 stop bit, flow control Xon/Xoff.".into())),
                }
                for product in Product::all() {
                    let cable = &product.cable;
                    shown.push(text(format!(
                        "{}, {}: pin {} to DB-9 pin {}, {} to {}, ground {} to {}.",
                        product.name,
                        cable.connector,
                        cable.transmit.unit,
                        cable.transmit.db9,
                        cable.receive.unit,
                        cable.receive.db9,
                        cable.ground.unit,
                        cable.ground.db9,
                    )));
                }
            }
            Entry::Emulated(product) => {
                shown.push(text(format!("{}, hosted in this program on a real pseudo-terminal.", product.title)));
                shown.push(text("Behaves as the manual says. Its password for loading software is AXIO-2010.".into()));
            }
            Entry::Other => {
                shown.push(text("/dev/ttyUSB0 or COM3      a serial port that is not listed".into()));
                shown.push(text("/dev/pts/3 or a link      a pseudo-terminal, e.g. of axcon emulate or socat".into()));
                shown.push(text("emu:axtc4co               an emulated unit in this program".into()));
            }
        }
        shown
    }

    fn entries(&self) -> Vec<Entry<'_>> {
        let ports: &[PortEntry] = match &self.ports {
            Ports::Listed(ports) => ports,
            Ports::Listing | Ports::Failed(_) => &[],
        };
        let emulated = Product::all().iter().map(Entry::Emulated);
        ports.iter().map(Entry::Port).chain(emulated).chain([Entry::Other]).collect()
    }

    fn link_of(&self, number: usize) -> Option<String> {
        match self.entries().get(number)? {
            Entry::Port(port) => Some(port.link.clone()),
            Entry::Emulated(product) => Some(emulated_link(product)),
            Entry::Other => None,
        }
    }
}

fn row(scene: Scene, entry: &Entry, is_chosen: bool, columns: usize) -> Line<'static> {
    let theme = scene.theme;
    let (name, description, link) = match entry {
        Entry::Port(port) => {
            let busy = if port.busy_by.is_some() { "in use: " } else { "" };
            (visible::text(&port.link), format!("{busy}{}", visible::text(&port.description)), Some(port.link.clone()))
        }
        Entry::Emulated(product) => (emulated_link(product), product.title.clone(), Some(emulated_link(product))),
        Entry::Other => ("another port ...".into(), String::new(), None),
    };
    let is_ours = link.is_some() && link == scene.view.link.name;
    let state = match &scene.view.link.state {
        LinkState::Open { .. } if is_ours => format!("connected, {} baud", scene.view.link.baud),
        LinkState::Opening if is_ours => "opening".into(),
        LinkState::Lost(_) if is_ours => "lost".into(),
        _ => String::new(),
    };
    let mark = if is_chosen { "›" } else { " " };
    let name = format::left(&format::keep_end(&name, NAME_COLUMNS), NAME_COLUMNS);
    let room = columns.saturating_sub(NAME_COLUMNS + 6 + format::width(&state) + 1);
    let text = format!(" {mark} {name}  {} {state} ", format::left(&description, room));
    let style = if is_chosen { theme.bar() } else { ratatui::style::Style::new() };
    Line::styled(text, style)
}

fn emulated_link(product: &Product) -> String {
    format!("emu:{}", product.name.to_lowercase())
}
