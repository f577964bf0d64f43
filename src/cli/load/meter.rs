//! How an upload's progress is shown: JSON lines, a bar, a line for each phase, or a line of a board with several.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex};

use serde::Serialize;

use super::verdict::phase_name;
use crate::cli::numbers::grouped;
use crate::cli::output::Output;
use crate::host::terminal;
use crate::session::{Phase, Progress};
use crate::time::Duration;

/// Shows one upload's progress.
pub struct Meter {
    port: String,
    style: Style,
    phase: Option<Phase>,
}

enum Style {
    Json,
    Bar,
    Phases,
    /// A line of a board, by its number.
    Line(Arc<Board>, usize),
}

#[derive(Serialize)]
struct ProgressObject<'a> {
    schema: &'static str,
    port: &'a str,
    phase: &'static str,
    record: usize,
    records: usize,
    address: u32,
    bytes: usize,
    bytes_total: usize,
    rate: f64,
    eta_s: Option<f64>,
    held_s: Option<f64>,
    again: bool,
}

/// Characters of the bar at most, and at least: a shorter one shows nothing.
const LONGEST_BAR: usize = 30;
const SHORTEST_BAR: usize = 4;
/// Columns and rows where nobody says how many there are.
const SIZE: (usize, usize) = (80, 24);
/// A hold that lasts this long is shown.
const LONG_HOLD: Duration = Duration::from_secs(1);

impl Meter {
    /// For a single upload.
    pub fn new(port: &str, json: bool) -> Self {
        let style = match (json, std::io::stderr().is_terminal()) {
            (true, _) => Style::Json,
            (false, true) => Style::Bar,
            (false, false) => Style::Phases,
        };
        Meter { port: port.to_owned(), style, phase: None }
    }

    /// For one of several uploads, on its line of a board.
    pub fn on_board(port: &str, board: Arc<Board>, line: usize) -> Self {
        Meter { port: port.to_owned(), style: Style::Line(board, line), phase: None }
    }

    /// Shows how far it is. An upload does not end because nobody reads this any more.
    pub fn show(&mut self, progress: &Progress, output: &mut Output) {
        let is_new_phase = self.phase.replace(progress.phase) != Some(progress.phase);
        match &self.style {
            Style::Json => {
                let _ = output.object(&self.object(progress));
            }
            Style::Bar => {
                let line = format!("\r{}\x1b[K", text(progress, size().0));
                let _ = output.err.write_all(line.as_bytes()).and_then(|()| output.err.flush());
            }
            Style::Phases if is_new_phase => output.remark(&format!("{} ...", phase_name(progress.phase))),
            Style::Phases => {}
            Style::Line(board, line) => board.set(*line, text(progress, board.room())),
        }
    }

    /// The upload is over.
    pub fn end(&self, output: &mut Output) {
        if matches!(self.style, Style::Bar) && self.phase.is_some() {
            output.remark("");
        }
    }

    fn object(&self, progress: &Progress) -> ProgressObject<'_> {
        ProgressObject {
            schema: "axcon.progress/1",
            port: &self.port,
            phase: phase_name(progress.phase),
            record: progress.records,
            records: progress.records_total,
            address: progress.address,
            bytes: progress.bytes,
            bytes_total: progress.bytes_total,
            rate: progress.rate().round(),
            eta_s: progress.eta().map(|eta| (eta.as_secs_f64() * 10.0).round() / 10.0),
            held_s: progress.held.map(|held| held.as_secs_f64()),
            again: progress.again,
        }
    }
}

/// Columns and rows of the terminal.
fn size() -> (usize, usize) {
    terminal::size().unwrap_or(SIZE)
}

/// One line that leaves the last of this many columns free, since many terminals wrap a line that fills them. The bar
/// takes what the text leaves.
fn text(progress: &Progress, columns: usize) -> String {
    let Progress { records, records_total, bytes, bytes_total, address, .. } = *progress;
    let share = if bytes_total == 0 { 0.0 } else { bytes as f64 / bytes_total as f64 };
    let kilobytes = |bytes: usize| bytes.div_ceil(1000);
    let (taken, total) = (grouped(records as u64), grouped(records_total as u64));
    let mut members = vec![format!("{:>3.0} % {taken}/{total} rec", share * 100.0)];
    if records > 1 {
        members.push(format!("{address:#07x}"));
    }
    members.push(format!("{}/{} kB", kilobytes(bytes), kilobytes(bytes_total)));
    match progress.held.filter(|held| *held >= LONG_HOLD) {
        Some(held) => members.push(format!("XOFF {:.0} s", held.as_secs_f64())),
        None if progress.rate() > 0.0 => members.push(format!("{:.1} kB/s", progress.rate() / 1000.0)),
        None => {}
    }
    members.extend(progress.eta().map(|eta| format!("{:.0} s left", eta.as_secs_f64())));
    let once_more = if progress.again { " again" } else { "" };
    let (phase, members) = (format!("{}{once_more}", phase_name(progress.phase)), members.join(" "));
    let room = columns.saturating_sub(1);
    let bar = room.saturating_sub(phase.len() + members.len() + " [] ".len()).min(LONGEST_BAR);
    let line = if bar < SHORTEST_BAR {
        format!("{phase} {members}")
    } else {
        let filled = ((share * bar as f64) as usize).min(bar);
        format!("{phase} [{}{}] {members}", "#".repeat(filled), " ".repeat(bar - filled))
    };
    cut(&line, room)
}

fn cut(line: &str, columns: usize) -> String {
    line.chars().take(columns).collect()
}

/// A line for each of several uploads. They are repainted in place on a terminal that has room for all of them;
/// elsewhere a line is printed when its phase changes.
pub struct Board {
    state: Mutex<State>,
    names: Vec<String>,
    on_terminal: bool,
    size: fn() -> (usize, usize),
}

struct State {
    lines: Vec<String>,
    /// The lines are right above the cursor.
    painted: bool,
    to: Box<dyn Write + Send>,
}

impl Board {
    /// A board for uploads on these ports.
    pub fn new(ports: &[String], to: Box<dyn Write + Send>, on_terminal: bool) -> Self {
        Board::of_size(ports, to, on_terminal, size)
    }

    fn of_size(ports: &[String], to: Box<dyn Write + Send>, on_terminal: bool, size: fn() -> (usize, usize)) -> Self {
        let lines = vec!["waits".to_owned(); ports.len()];
        let width = ports.iter().map(|port| port.chars().count()).max().unwrap_or_default();
        let names = ports.iter().map(|port| format!("{port:<width$}")).collect();
        Board { state: Mutex::new(State { lines, painted: false, to }), names, on_terminal, size }
    }

    /// Columns of a line after its name.
    pub fn room(&self) -> usize {
        let name = self.names.first().map_or(0, |name| name.chars().count() + 2);
        (self.size)().0.saturating_sub(name)
    }

    /// What a line says now.
    pub fn set(&self, line: usize, text: String) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let is_news = first_word(&state.lines[line]) != first_word(&text);
        state.lines[line] = text;
        let (columns, rows) = (self.size)();
        // The cursor is below the lines, and cannot go up to a line that has left the screen.
        let in_place = self.on_terminal && self.names.len() < rows;
        let painted = if in_place {
            let up = if state.painted { format!("\x1b[{}A", state.lines.len()) } else { String::new() };
            let room = columns.saturating_sub(1);
            let lines = self.names.iter().zip(&state.lines);
            let lines = lines.map(|(name, line)| format!("\r{}\x1b[K\r\n", cut(&format!("{name}  {line}"), room)));
            up + &lines.collect::<String>()
        } else if is_news {
            // Elsewhere without its bar, which only a person looks at.
            let said = match state.lines[line].split_once(" [") {
                Some((phase, _)) if !self.on_terminal => format!("{phase} ..."),
                _ => state.lines[line].clone(),
            };
            format!("{}  {said}\n", self.names[line])
        } else {
            return;
        };
        state.painted = in_place;
        let _ = state.to.write_all(painted.as_bytes()).and_then(|()| state.to.flush());
    }
}

fn first_word(text: &str) -> Option<&str> {
    text.split_whitespace().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().expect("no panic").extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn board(on_terminal: bool, size: fn() -> (usize, usize)) -> (Board, Shared) {
        let shared = Shared::default();
        let ports = ["/dev/ttyUSB0".to_owned(), "u1".to_owned()];
        (Board::of_size(&ports, Box::new(shared.clone()), on_terminal, size), shared)
    }

    fn said(shared: &Shared) -> String {
        String::from_utf8(shared.0.lock().expect("no panic").clone()).expect("UTF-8")
    }

    #[test]
    fn a_pipe_and_a_terminal_without_room_for_all_lines_get_only_what_is_new() {
        let roomy: fn() -> (usize, usize) = || (40, 24);
        for (on_terminal, size) in [(false, roomy), (true, || (40, 2))] {
            let (board, shared) = board(on_terminal, size);
            board.set(1, "transfer   1 %".into());
            board.set(1, "transfer   2 %".into());
            board.set(0, "check".into());
            assert_eq!(said(&shared), "u1            transfer   1 %\n/dev/ttyUSB0  check\n");
        }
    }

    #[test]
    fn a_terminal_gets_all_lines_in_place() {
        let (board, shared) = board(true, || (40, 3));
        board.set(0, "check".into());
        board.set(1, "done".into());
        let text = said(&shared);
        assert!(text.ends_with("\x1b[2A\r/dev/ttyUSB0  check\x1b[K\r\n\ru1            done\x1b[K\r\n"), "{text:?}");
    }

    #[test]
    fn a_line_that_is_repainted_never_fills_its_terminal() {
        let (board, shared) = board(true, || (40, 24));
        board.set(0, "x".repeat(100));
        assert!(said(&shared).contains(&format!("\r/dev/ttyUSB0  {}\x1b[K", "x".repeat(39 - 14))));
        assert_eq!(board.room(), 40 - 14);
    }

    fn progress(seconds: u64, records: usize, bytes: usize) -> Progress {
        Progress {
            phase: Phase::Transfer,
            records,
            records_total: 3_074,
            bytes,
            bytes_total: 242_742,
            address: 0xBFFF,
            elapsed: Duration::from_secs(seconds),
            moving: Duration::from_secs(seconds),
            moved: bytes,
            held: None,
            again: false,
        }
    }

    #[test]
    fn the_bar_takes_the_room_that_what_is_said_leaves() {
        let now = progress(10, 1_500, 121_371);
        let line = |columns| text(&now, columns);
        assert_eq!(line(80), "transfer [###    ]  50 % 1,500/3,074 rec 0x0bfff 122/243 kB 12.1 kB/s 10 s left");
        assert_eq!(line(60), "transfer  50 % 1,500/3,074 rec 0x0bfff 122/243 kB 12.1 kB/s");
        assert!(line(200).contains(&format!("[{}{}]", "#".repeat(15), " ".repeat(15))));
        for columns in 0..200 {
            let held = Progress { held: Some(Duration::from_secs(12)), ..now };
            for progress in [&now, &held, &progress(0, 0, 0)] {
                assert!(text(progress, columns).chars().count() < columns.max(1), "{columns}");
            }
        }
    }
}
