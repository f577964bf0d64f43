//! The line as it is: what the unit prints, what we send, and every key straight to the unit.
//!
//! Only characters, Enter, Backspace, Tab, Esc and Ctrl-letters go to the unit. Arrows and the like never do: terminals
//! write them as escape sequences, and the last byte of "cursor left" is a `D`, the menu's key for restoring defaults.

use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

mod hex;

use hex::HexPlace;

use super::Scene;
use crate::monitor::{Origin, Scrollback, TextLine};
use crate::record::Record;
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::{PickedFor, Question};
use crate::tui::view::{Sending, View};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Terminal";

/// Keys of the screen. All but the scrolling ones and the prefix itself come after the prefix.
pub const BINDINGS: &[Binding] = &[
    Binding {
        keys: &[Press::Ctrl(']')],
        cmd: Cmd::Prefix,
        short: "",
        long: "the next key is for axcon; twice: send Ctrl-] itself",
    },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "scroll", long: "a page up" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "", long: "a page down" },
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "a line up" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "", long: "a line down" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "to the oldest line" },
    Binding {
        keys: &[Press::Plain(KeyCode::End)],
        cmd: Cmd::Last,
        short: "follow",
        long: "to the newest line, and follow",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('f'))],
        cmd: Cmd::SendFile,
        short: "file",
        long: "send a file as it is, byte for byte",
    },
    Binding { keys: &[Press::Plain(KeyCode::Char('h'))], cmd: Cmd::Hex, short: "hex", long: "text or hexadecimal" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('w'))],
        cmd: Cmd::Times,
        short: "when",
        long: "with or without times",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('/'))],
        cmd: Cmd::Find,
        short: "find",
        long: "look for words in the lines, newest first",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('n'))],
        cmd: Cmd::FindNext,
        short: "",
        long: "the next place further up that has them",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('b'))],
        cmd: Cmd::Break,
        short: "",
        long: "send a break: the line held low for a quarter of a second",
    },
];

/// Rows that tell of a file being sent.
const SENDING_ROWS: u16 = 3;
/// Rows that are kept free below what was found: the question for words has seven.
const ROWS_BELOW_FOUND: usize = 8;
/// Columns of a time with its milliseconds, the blank after it included.
const TIME_COLUMNS: usize = 13;

/// The terminal.
#[derive(Debug, Default)]
pub struct Terminal {
    mode: Mode,
    with_times: bool,
    after_prefix: bool,
    /// What is looked for, in lower case; empty for nothing.
    words: String,
    /// Number of the line where it was found.
    found: Option<u64>,
}

/// What is shown, and from where. Without a position the newest is followed.
#[derive(Debug, Clone, Copy)]
enum Mode {
    /// Lines; the number after that of the last line in sight.
    Text(Option<u64>),
    /// Bytes; rows hidden below, counted at the given numbers of bytes received and sent.
    Hex(Option<HexPlace>),
}

impl Default for Mode {
    fn default() -> Self {
        Mode::Text(None)
    }
}

/// What a key means here.
pub enum Meaning {
    /// It is for the unit.
    Keys(Vec<u8>),
    /// It is for the console.
    Console,
    /// Nothing.
    Nothing,
}

impl Terminal {
    /// Whose a key is. After the prefix the next key is the console's.
    pub fn meaning(&mut self, key: KeyEvent) -> Meaning {
        if std::mem::take(&mut self.after_prefix) {
            if Press::Ctrl(']').is(key) {
                return Meaning::Keys(vec![0x1d]);
            }
            return Meaning::Console;
        }
        if Press::Ctrl(']').is(key) {
            self.after_prefix = true;
            return Meaning::Nothing;
        }
        match key.code {
            KeyCode::Char(character) if key.modifiers.contains(KeyModifiers::CONTROL) => {
                control(character).map_or(Meaning::Nothing, |byte| Meaning::Keys(vec![byte]))
            }
            KeyCode::Char(_) if key.modifiers.contains(KeyModifiers::ALT) => Meaning::Nothing,
            KeyCode::Char(character) if character.is_ascii() => Meaning::Keys(vec![character as u8]),
            KeyCode::Enter => Meaning::Keys(vec![b'\r']),
            KeyCode::Backspace => Meaning::Keys(vec![0x08]),
            KeyCode::Tab => Meaning::Keys(vec![b'\t']),
            KeyCode::Esc => Meaning::Keys(vec![0x1b]),
            KeyCode::Char(_) => Meaning::Nothing,
            _ => Meaning::Console,
        }
    }

    /// Whether the next key is the console's.
    pub fn is_after_prefix(&self) -> bool {
        self.after_prefix
    }

    /// The record starts again: what the hex view was stopped at is in the one before. The lines go on.
    pub fn begin_record(&mut self) {
        if let Mode::Hex(_) = self.mode {
            self.mode = Mode::Hex(None);
        }
    }

    /// Back to the newest line, as after sending something.
    pub fn follow(&mut self) {
        self.mode = match self.mode {
            Mode::Text(_) => Mode::Text(None),
            Mode::Hex(_) => Mode::Hex(None),
        };
    }

    /// Goes to the newest line that has these words; nothing is looked for without any.
    pub fn find(&mut self, words: String, view: &View, scrollback: &Scrollback, area: Rect) {
        self.words = words.to_lowercase();
        self.found = None;
        if self.words.is_empty() {
            return self.follow();
        }
        self.go_to_match(scrollback.end(), scrollback, body(view, area).0);
    }

    /// Whether words are looked for and no line has them.
    fn finds_nothing(&self) -> bool {
        !self.words.is_empty() && self.found.is_none()
    }

    /// Goes to the newest line before line number `before` that has the words; if there is none, nothing moves.
    fn go_to_match(&mut self, before: u64, scrollback: &Scrollback, body: Rect) {
        let older = usize::try_from(before.saturating_sub(scrollback.start())).unwrap_or(usize::MAX);
        let place = scrollback.lines().take(older).rposition(|line| line.text.to_lowercase().contains(&self.words));
        if let (Some(place), false) = (place, self.words.is_empty()) {
            let number = scrollback.start() + place as u64;
            self.found = Some(number);
            // What follows is in sight as well, and the question in front of it hides none of what was found.
            let mut room = ROWS_BELOW_FOUND.min(usize::from(body.height) / 2);
            let follows = scrollback.lines().skip(place + 1).take_while(|line| {
                let rows = rows_of(line, usize::from(body.width), self.with_times);
                let fits = rows <= room;
                room = room.saturating_sub(rows);
                fits
            });
            let end = number + 1 + follows.count() as u64;
            self.mode = Mode::Text((end < scrollback.end()).then_some(end));
        }
    }

    /// What a command does here; `area` is that of the picture.
    pub fn on(
        &mut self,
        cmd: Cmd,
        view: &View,
        scrollback: &Scrollback,
        record: &Record,
        area: Rect,
    ) -> Option<Action> {
        let body = body(view, area).0;
        let page = usize::from(body.height).saturating_sub(1).max(1) as i64;
        match cmd {
            Cmd::Up => self.scroll(1, scrollback, record, body),
            Cmd::Down => self.scroll(-1, scrollback, record, body),
            Cmd::PageUp => self.scroll(page, scrollback, record, body),
            Cmd::PageDown => self.scroll(-page, scrollback, record, body),
            Cmd::First => self.scroll(i64::MAX, scrollback, record, body),
            Cmd::Last => self.follow(),
            Cmd::Hex => {
                self.mode = match self.mode {
                    Mode::Text(_) => Mode::Hex(None),
                    Mode::Hex(_) => Mode::Text(None),
                }
            }
            Cmd::Break => return Some(Action::Break),
            Cmd::SendFile => return Some(Action::PickFile(PickedFor::ToSend)),
            Cmd::Times => self.with_times = !self.with_times,
            Cmd::Find => return Some(Action::Ask(Question::find(&self.words))),
            Cmd::FindNext => {
                let before = self.found.unwrap_or(scrollback.end());
                self.go_to_match(before, scrollback, body);
            }
            _ => {}
        }
        None
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let (heading, _) = lines::split(area, 1);
        let (body, below) = body(scene.view, area);
        if let Some(sending) = &scene.view.unit.sending {
            lines::draw(frame, below, sending_rows(scene, sending, below.width));
        }
        let (name, following) = match self.mode {
            Mode::Text(place) => ("Text", place.is_none()),
            Mode::Hex(place) => ("Hexadecimal", place.is_none()),
        };
        let place = if following { "follows" } else { "stopped, End follows again" };
        let received = format::counted(scene.record.received(), "byte");
        let sent = format::grouped(scene.record.sent());
        let found = match (self.words.is_empty(), self.finds_nothing()) {
            (true, _) => String::new(),
            (false, true) => format!("'{}' is nowhere, ", visible::text(&self.words)),
            (false, false) => format!("'{}', ", visible::text(&self.words)),
        };
        let longest = format!("{found}{received} received, {sent} sent, {place}");
        let room = usize::from(area.width).saturating_sub(format::width(name) + lines::BESIDE_HEADING);
        // Where it has been stopped is wanted before what has gone by.
        let remark = if format::width(&longest) <= room { longest } else { format!("{found}{place}") };
        lines::draw(frame, heading, [lines::rule(scene.theme, area.width, name, &remark)]);
        let rows = match self.mode {
            Mode::Text(place) => text_rows(scene, body, place, self.with_times, &self.words),
            Mode::Hex(place) => hex::rows(scene, body, place, self.with_times),
        };
        if rows.is_empty() {
            let text = match scene.view.link.name {
                Some(_) => "  Nothing has gone over the line yet. Keys go straight to the unit.",
                None => "  Not connected.",
            };
            return lines::draw(frame, body, [Line::styled(text, scene.theme.quiet())]);
        }
        lines::draw(frame, body, rows);
    }

    /// Moves by lines or rows, positive to the older ones: until the oldest is in sight, and the picture full. At the newest
    /// one the view follows again.
    fn scroll(&mut self, up: i64, scrollback: &Scrollback, record: &Record, body: Rect) {
        let up = up.clamp(-(1 << 40), 1 << 40);
        self.mode = match self.mode {
            Mode::Text(place) => {
                let lowest = end_of_first_page(scrollback, body, self.with_times) as i64;
                let end = (place.unwrap_or(scrollback.end()) as i64).max(lowest);
                let moved = (end - up).max(lowest) as u64;
                Mode::Text((moved < scrollback.end()).then_some(moved))
            }
            Mode::Hex(place) => {
                let place = place.unwrap_or_else(|| HexPlace::newest(record));
                Mode::Hex(place.moved(up, record, usize::from(body.height)))
            }
        };
    }
}

/// Where the lines or bytes are, and below them what is being sent.
fn body(view: &View, area: Rect) -> (Rect, Rect) {
    let (_, body) = lines::split(area, 1);
    let below = if view.unit.sending.is_some() { SENDING_ROWS } else { 0 };
    lines::split(body, body.height.saturating_sub(below))
}

/// How far a file has come that is sent as it is.
fn sending_rows(scene: Scene, sending: &Sending, columns: u16) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let share = if sending.total == 0 { 1.0 } else { sending.sent as f64 / sending.total as f64 };
    let (sent, total) = (format::grouped(sending.sent), format::grouped(sending.total));
    let mut told = vec![
        Span::raw(format!("  {sent} of {total} bytes out, ")),
        Span::styled("Esc", theme.key()),
        Span::raw(" stops it"),
    ];
    if let Some(since) = scene.view.load.held_since {
        let since = format::time_of_day(scene.start_of_day, since);
        told.push(Span::styled(format!("; held by XOFF since {since}"), theme.warning()));
    }
    vec![
        lines::rule(theme, columns, "Sending a file", &visible::text(&sending.name)),
        lines::gauge(theme, share, usize::from(columns)),
        Line::from(told),
    ]
}

/// The newest lines that fit, for a place beside other things.
pub fn newest_lines(scene: Scene, area: Rect) -> Vec<Line<'static>> {
    text_rows(scene, area, None, false, "")
}

/// Lines ending at a place, as many as fit, long ones broken.
fn text_rows(scene: Scene, area: Rect, place: Option<u64>, with_times: bool, words: &str) -> Vec<Line<'static>> {
    let scrollback = scene.scrollback;
    let room = usize::from(area.height);
    let drawn = |line: &TextLine| {
        let broken = text_line(scene, line, usize::from(area.width), with_times);
        if !words.is_empty() && line.text.to_lowercase().contains(words) {
            broken.into_iter().map(|row| row.patch_style(scene.theme.bar())).collect()
        } else {
            broken
        }
    };
    if place.is_some_and(|end| end <= end_of_first_page(scrollback, area, with_times)) {
        // Above it there is not enough: the picture begins with the oldest line, and is full all the same.
        return scrollback.lines().take(room).flat_map(drawn).take(room).collect();
    }
    let end = place.map_or(usize::MAX, |end| end.saturating_sub(scrollback.start()) as usize);
    let mut rows: Vec<Line> = Vec::new();
    for line in scrollback.lines().take(end.min(scrollback.lines().len())).rev() {
        rows.extend(drawn(line).into_iter().rev());
        if rows.len() >= room {
            break;
        }
    }
    rows.truncate(room);
    rows.reverse();
    rows
}

/// The number after that of the last line of a picture that begins with the oldest one.
fn end_of_first_page(scrollback: &Scrollback, area: Rect, with_times: bool) -> u64 {
    let room = usize::from(area.height);
    let mut rows = 0;
    let is_in_sight = |line: &&TextLine| {
        let fits = rows < room;
        rows += rows_of(line, usize::from(area.width), with_times);
        fits
    };
    scrollback.start() + scrollback.lines().take_while(is_in_sight).count().max(1) as u64
}

/// Rows that a line takes.
fn rows_of(line: &TextLine, columns: usize, with_times: bool) -> usize {
    format::pieces(&line.text, text_columns(line, columns, with_times)).len()
}

/// Columns that the text of a line has beside its time and its mark.
fn text_columns(line: &TextLine, columns: usize, with_times: bool) -> usize {
    let mark = match line.origin {
        Origin::Unit | Origin::Us => 2,
        Origin::Console => 3,
    };
    let time = if with_times { TIME_COLUMNS } else { 0 };
    columns.saturating_sub(time + mark).max(1)
}

fn text_line(scene: Scene, line: &TextLine, columns: usize, with_times: bool) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let (mark, style) = match line.origin {
        Origin::Unit => ("  ", Style::new()),
        Origin::Us => ("» ", theme.sent()),
        Origin::Console => ("── ", theme.quiet()),
    };
    let time = if with_times {
        format!("{} ", format::time_of_day_millis(scene.start_of_day, line.at))
    } else {
        String::new()
    };
    let indent = format::width(&time) + format::width(mark);
    let pieces = format::pieces(&line.text, text_columns(line, columns, with_times));
    let first = |piece: &String| {
        vec![
            Span::styled(time.clone(), theme.quiet()),
            Span::styled(mark, theme.quiet()),
            Span::styled(piece.clone(), style),
        ]
    };
    pieces
        .iter()
        .enumerate()
        .map(|(number, piece)| match number {
            0 => Line::from(first(piece)),
            _ => Line::from(vec![Span::raw(" ".repeat(indent)), Span::styled(piece.clone(), style)]),
        })
        .collect()
}

/// The byte a terminal sends for a character with Ctrl.
fn control(character: char) -> Option<u8> {
    match character.to_ascii_uppercase() {
        letter @ '@'..='_' => Some(letter as u8 - b'@'),
        ' ' => Some(0),
        // Names under which the bytes 1Ch to 1Fh arrive.
        digit @ '4'..='7' => Some(digit as u8 - b'4' + 0x1c),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(code: KeyCode, modifiers: KeyModifiers) -> Option<Vec<u8>> {
        match Terminal::default().meaning(KeyEvent::new(code, modifiers)) {
            Meaning::Keys(bytes) => Some(bytes),
            Meaning::Console | Meaning::Nothing => None,
        }
    }

    #[test]
    fn characters_go_to_the_unit_and_cursor_keys_never_do() {
        let plain = |code| sent(code, KeyModifiers::NONE);
        assert_eq!(plain(KeyCode::Char('D')), Some(b"D".to_vec()));
        assert_eq!(plain(KeyCode::Enter), Some(b"\r".to_vec()));
        assert_eq!(plain(KeyCode::Backspace), Some(b"\x08".to_vec()));
        assert_eq!(sent(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(b"\x03".to_vec()));
        for code in [KeyCode::Left, KeyCode::Up, KeyCode::PageUp, KeyCode::F(1), KeyCode::Delete, KeyCode::BackTab] {
            assert_eq!(plain(code), None, "{code:?}");
        }
        assert_eq!(plain(KeyCode::Char('é')), None, "the unit knows ASCII only");
    }

    #[test]
    fn the_prefix_gives_one_key_to_the_console_and_twice_sends_itself() {
        let mut terminal = Terminal::default();
        let prefix = KeyEvent::new(KeyCode::Char('5'), KeyModifiers::CONTROL);
        let letter = KeyEvent::new(KeyCode::Char('h'), KeyModifiers::NONE);
        assert!(matches!(terminal.meaning(prefix), Meaning::Nothing));
        assert!(matches!(terminal.meaning(letter), Meaning::Console));
        assert!(matches!(terminal.meaning(letter), Meaning::Keys(_)));
        terminal.meaning(prefix);
        assert!(matches!(terminal.meaning(prefix), Meaning::Keys(bytes) if bytes == [0x1d]));
    }
}
