//! What was recorded before, and how a recording is played.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::time::Duration;
use crate::tui::action::Action;
use crate::tui::input::{Pace, Playback, Playing, RecordingEntry, RecordingList};
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Recordings";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "recording above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "choose", long: "recording below" },
    Binding {
        keys: &[Press::Plain(KeyCode::Enter)],
        cmd: Cmd::Accept,
        short: "open",
        long: "open the chosen one, at its end",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char(' '))],
        cmd: Cmd::Pause,
        short: "pause",
        long: "stop playing, or go on; at the end: from the beginning",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('+'))],
        cmd: Cmd::Faster,
        short: "faster",
        long: "1, 2, 5, 10, 60 times as fast, or all at once",
    },
    Binding { keys: &[Press::Plain(KeyCode::Char('-'))], cmd: Cmd::Slower, short: "slower", long: "one step slower" },
    Binding {
        keys: &[Press::Plain(KeyCode::Left)],
        cmd: Cmd::Left,
        short: "",
        long: "10 seconds back, or a hundredth of a long recording",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Right)],
        cmd: Cmd::Right,
        short: "move",
        long: "10 seconds on, or a hundredth of a long recording",
    },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "to its beginning" },
    Binding { keys: &[Press::Plain(KeyCode::End)], cmd: Cmd::Last, short: "to its end", long: "to its end" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Refresh,
        short: "refresh",
        long: "look for recordings again",
    },
];

/// How fast a recording can be played, slowest first.
const PACES: [Pace; 6] =
    [Pace::Times(1), Pace::Times(2), Pace::Times(5), Pace::Times(10), Pace::Times(60), Pace::AtOnce];
/// What an arrow moves by at least.
const LEAST_STEP: Duration = Duration::from_secs(10);
/// Rows of what is being played.
const PLAYER_ROWS: u16 = 4;
/// Rows below the list: where the chosen one lies, and how it is passed on.
const DETAIL_ROWS: u16 = 6;

/// The page.
#[derive(Debug, Default)]
pub struct Recordings {
    listing: Listing,
    cursor: usize,
    /// The pace to go on with after a pause.
    pace: Option<Pace>,
}

#[derive(Debug, Default)]
enum Listing {
    #[default]
    Awaited,
    Listed(RecordingList),
    Failed(String),
}

impl Recordings {
    /// The list has come.
    pub fn listed(&mut self, found: Result<RecordingList, String>) {
        self.listing = found.map_or_else(Listing::Failed, Listing::Listed);
        self.cursor = self.cursor.min(self.entries().len().saturating_sub(1));
    }

    /// What was found, newest first.
    pub fn entries(&self) -> &[RecordingEntry] {
        match &self.listing {
            Listing::Listed(list) => &list.entries,
            Listing::Awaited | Listing::Failed(_) => &[],
        }
    }

    /// The keys of the footer, by what they do now.
    pub fn footer(view: &View) -> Vec<Binding> {
        let ended = view.playing.is_some_and(is_at_end);
        let named = |binding: &Binding| match (binding.cmd, view.playing) {
            (Cmd::Pause, Some(playing)) if ended || playing.pace == Pace::Paused => {
                Binding { short: "play", ..*binding }
            }
            _ => *binding,
        };
        BINDINGS.iter().map(named).collect()
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View) -> Option<Action> {
        let last = self.entries().len().saturating_sub(1);
        match cmd {
            Cmd::Up => self.cursor = self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor = (self.cursor + 1).min(last),
            Cmd::Refresh => return Some(Action::ListRecordings),
            Cmd::Accept => return self.entries().get(self.cursor).map(|entry| Action::Open(entry.link.clone())),
            _ => {}
        }
        let Some(playing) = view.playing else {
            let what = match (cmd, self.entries().is_empty()) {
                (Cmd::Up | Cmd::Down, _) => return None,
                (_, true) => "Nothing is being played.",
                (_, false) => "Nothing is being played: Enter opens the chosen recording.",
            };
            return Some(Action::Tell(what.to_owned()));
        };
        let step = step(playing);
        let play = match cmd {
            // There is nothing to stop or to go on with: it begins again.
            Cmd::Pause if is_at_end(playing) => Playback::Again(pace_from_end(playing)),
            // Looking again at once would show nothing new.
            Cmd::Faster if is_at_end(playing) => match step_of_pace(pace_from_end(playing), 1) {
                Pace::AtOnce => return None,
                pace => Playback::Pace(pace),
            },
            Cmd::Slower if is_at_end(playing) => Playback::Pace(step_of_pace(pace_from_end(playing), -1)),
            Cmd::Pause if playing.pace != Pace::Paused => {
                self.pace = Some(playing.pace);
                Playback::Pace(Pace::Paused)
            }
            Cmd::Pause => Playback::Pace(self.pace.unwrap_or(Pace::Times(1))),
            Cmd::Faster => Playback::Pace(step_of_pace(playing.pace, 1)),
            Cmd::Slower => Playback::Pace(step_of_pace(playing.pace, -1)),
            Cmd::Left => Playback::Seek(playing.position.saturating_sub(step)),
            Cmd::Right => Playback::Seek(playing.position + step),
            Cmd::First => Playback::Seek(Duration::ZERO),
            Cmd::Last => Playback::Seek(playing.length.unwrap_or(Duration::MAX)),
            _ => return None,
        };
        Some(Action::Play(play))
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let rest = match scene.view.playing {
            Some(playing) => {
                let (upper, rest) = lines::split(area, PLAYER_ROWS);
                lines::draw(frame, upper, player(scene, playing, upper.width));
                rest
            }
            None => area,
        };
        let theme = scene.theme;
        let detail = self.detail(scene, area.width);
        let (rest, lower) = lines::split(rest, rest.height.saturating_sub(detail.len() as u16));
        lines::draw(frame, lower, detail);
        let (heading, list) = lines::split(rest, 1);
        lines::draw(frame, heading, [lines::rule(theme, area.width, "Recordings", &self.remark())]);
        match &self.listing {
            Listing::Awaited => lines::draw(frame, list, [Line::styled("  Looking for recordings ...", theme.quiet())]),
            Listing::Failed(why) => {
                let why = lines::paragraph(&visible::text(why), usize::from(list.width), theme.bad());
                lines::draw(frame, list, why);
            }
            Listing::Listed(RecordingList { entries, .. }) if entries.is_empty() => {
                let text = "  None yet. Every connection is recorded from its first byte.";
                lines::draw(frame, list, [Line::styled(text, theme.quiet())]);
            }
            Listing::Listed(RecordingList { entries, .. }) => {
                let first = lines::first_visible(self.cursor, entries.len(), usize::from(list.height));
                let shown = entries.iter().enumerate().skip(first);
                let columns = usize::from(list.width);
                lines::draw(
                    frame,
                    list,
                    shown.map(|(number, entry)| row(theme, entry, number == self.cursor, columns)),
                );
            }
        }
    }

    /// How many there are, and whether these are all.
    fn remark(&self) -> String {
        match &self.listing {
            Listing::Listed(RecordingList { entries, older: 0 }) if !entries.is_empty() => {
                format!("{}, newest first", entries.len())
            }
            Listing::Listed(RecordingList { entries, older: older @ 1.. }) => {
                format!("{} of {}, newest first", entries.len(), format::grouped(entries.len() + older))
            }
            Listing::Listed(_) | Listing::Awaited | Listing::Failed(_) => String::new(),
        }
    }

    /// The entry that is drawn in row `y` of the screen.
    pub fn entry_at(&self, scene: Scene, area: Rect, y: u16) -> Option<usize> {
        let above = 1 + if scene.view.playing.is_some() { PLAYER_ROWS } else { 0 };
        let below = self.detail(scene, area.width).len() as u16;
        let room = area.height.saturating_sub(above + below);
        let row = y.checked_sub(area.y + above).filter(|row| *row < room)?;
        let first = lines::first_visible(self.cursor, self.entries().len(), usize::from(room));
        Some(first + usize::from(row)).filter(|number| *number < self.entries().len())
    }

    /// Puts the cursor on an entry. Says whether it was there already.
    pub fn choose(&mut self, number: usize) -> bool {
        std::mem::replace(&mut self.cursor, number) == number
    }

    /// Where the chosen one lies, and what to do with it.
    fn detail(&self, scene: Scene, columns: u16) -> Vec<Line<'static>> {
        let Some(entry) = self.entries().get(self.cursor) else { return Vec::new() };
        let theme = scene.theme;
        let path = visible::text(&entry.path);
        let room = usize::from(columns).saturating_sub(4);
        let (heading, text) = match &entry.content {
            Ok(_) => (
                "To send it to somebody",
                "Attach this file: every byte, both directions, with times; of a password only its length. As one page \
                 to read: axcon report --port replay:FILE --out report.html"
                    .to_owned(),
            ),
            Err(why) => ("Cannot be read", format!("{}.", visible::sentence(why))),
        };
        let mut rows = vec![lines::rule(theme, columns, heading, "")];
        // A user who copies the path needs all of it, and the file's name in one piece.
        let name = path.rfind('/').filter(|_| format::width(&path) > room).map_or(0, |slash| slash + 1);
        let (folder, name) = path.split_at(name);
        let parts = [folder, name].into_iter().filter(|part| !part.is_empty());
        rows.extend(
            parts
                .flat_map(|part| format::pieces(part, room))
                .map(|piece| Line::styled(format!("  {piece}"), theme.strong())),
        );
        rows.extend(lines::paragraph(&text, usize::from(columns), Style::new()));
        rows.truncate(usize::from(DETAIL_ROWS));
        rows
    }
}

/// An entry of the list: a recording, or why the file is not one.
fn row(theme: Theme, entry: &RecordingEntry, is_chosen: bool, columns: usize) -> Line<'static> {
    let mark = if is_chosen { "›" } else { " " };
    let recorded = match &entry.content {
        Ok(recorded) => recorded,
        Err(why) => {
            let path = visible::text(&entry.path);
            let name = path.rsplit('/').next().unwrap_or_default();
            let text = format!(" {mark} {name}  cannot be read: {}", visible::text(why));
            return Line::styled(format::left(&text, columns), if is_chosen { theme.bar() } else { theme.bad() });
        }
    };
    let length = recorded.length.map_or_else(|| "?".to_owned(), format::minutes);
    let size = format!("{} kB", format::grouped(entry.bytes.div_ceil(1000)));
    let fixed = format!(" {mark} {}  {length:>9}  {size:>11}  ", format::left(&recorded.begun, 19));
    let mut port = visible::text(&recorded.port);
    if recorded.part > 1 {
        port.push_str(&format!(", part {}", recorded.part));
    }
    if recorded.is_being_written {
        port.push_str(", being written");
    }
    let room = columns.saturating_sub(format::width(&fixed));
    let style = if is_chosen { theme.bar() } else { Style::new() };
    Line::styled(format!("{fixed}{}", format::left(&format::keep_end(&port, room), room)), style)
}

/// What an arrow moves by.
fn step(playing: Playing) -> Duration {
    playing.length.map_or(LEAST_STEP, |length| (length / 100).max(LEAST_STEP))
}

fn is_at_end(playing: Playing) -> bool {
    playing.length.is_some_and(|length| playing.position >= length)
}

/// The pace it is played at from its beginning once it is at its end.
fn pace_from_end(playing: Playing) -> Pace {
    match playing.pace {
        Pace::Times(times) => Pace::Times(times),
        Pace::Paused | Pace::AtOnce => Pace::Times(1),
    }
}

/// A pace in words.
fn words(pace: Pace) -> String {
    match pace {
        Pace::Paused => "paused".into(),
        Pace::Times(1) => "as fast as it was".into(),
        Pace::Times(times) => format!("{times} times as fast"),
        Pace::AtOnce => "all at once".into(),
    }
}

fn step_of_pace(pace: Pace, step: isize) -> Pace {
    let place = PACES.iter().position(|&known| known == pace).unwrap_or(0);
    PACES[place.saturating_add_signed(step).min(PACES.len() - 1)]
}

/// What is being played: how far, how fast.
fn player(scene: Scene, playing: Playing, columns: u16) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let name = scene.view.link.name.as_deref().map(visible::text).unwrap_or_default();
    let ended = is_at_end(playing);
    let defect = scene.view.link.defect.as_deref();
    let pace = match playing.pace {
        _ if ended && defect.is_some() => "cannot be read on".to_owned(),
        _ if ended => "at its end".to_owned(),
        pace => words(pace),
    };
    // One that is being written is longer by now than when it was listed.
    let length = playing.length.map(|length| length.max(playing.position));
    let length = length.map_or_else(|| "?".to_owned(), format::minutes);
    let place = format!("{} of {length}", format::minutes(playing.position));
    let room = usize::from(columns).saturating_sub(format::width(&place) + format::width(&pace) + 10);
    let part = playing
        .length
        .filter(|length| !length.is_zero())
        .map_or(0.0, |length| (playing.position.as_secs_f64() / length.as_secs_f64()).min(1.0));
    let filled = (part * room as f64) as usize;
    let heading = format::keep_end(&name, usize::from(columns).saturating_sub(20));
    vec![
        lines::rule(theme, columns, "Playing", &heading),
        Line::from(vec![
            Span::styled(format!("  {place}  "), theme.strong()),
            Span::styled("█".repeat(filled), theme.curve()),
            Span::styled("░".repeat(room.saturating_sub(filled)), theme.quiet()),
            Span::raw(format!("  {pace}")),
        ]),
        match defect.filter(|_| ended) {
            // Its place is at the end.
            Some(defect) => Line::styled(
                format!("  {}", format::keep_end(&visible::text(defect), usize::from(columns).saturating_sub(4))),
                theme.bad(),
            ),
            None if ended => Line::styled(
                format!(
                    "  Space plays it, {} (+ -). Arrows: {}, Home: its start.",
                    words(pace_from_end(playing)),
                    format::period(step(playing))
                ),
                theme.quiet(),
            ),
            None => Line::styled(
                format!(
                    "  All screens show the unit as it was then. Arrows move {}, Home to its start.",
                    format::period(step(playing))
                ),
                theme.quiet(),
            ),
        },
        Line::default(),
    ]
}
