//! How an upload's progress is shown: JSON lines, a bar, a line for each phase, or a line of a board with several.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex};

use serde::Serialize;

use super::phase_name;
use crate::cli::output::Output;
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
    /// The so-manieth line of a board.
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
}

/// Characters of the bar.
const BAR: usize = 30;
/// A hold that lasts so long is told.
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

    /// Shows how far it is. That nobody reads it any more is no reason to end an upload.
    pub fn show(&mut self, progress: &Progress, output: &mut Output) {
        let is_new_phase = self.phase.replace(progress.phase) != Some(progress.phase);
        match &self.style {
            Style::Json => {
                let _ = output.object(&self.object(progress));
            }
            Style::Bar => {
                let line = format!("\r{}\x1b[K", text(progress));
                let _ = output.err.write_all(line.as_bytes()).and_then(|()| output.err.flush());
            }
            Style::Phases if is_new_phase => output.remark(&format!("{} ...", phase_name(progress.phase))),
            Style::Phases => {}
            Style::Line(board, line) => board.set(*line, text(progress)),
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
        }
    }
}

fn text(progress: &Progress) -> String {
    let share = if progress.bytes_total == 0 { 0.0 } else { progress.bytes as f64 / progress.bytes_total as f64 };
    let filled = (share * BAR as f64) as usize;
    let eta = progress.eta().map_or_else(String::new, |eta| format!(", {:.0} s left", eta.as_secs_f64()));
    let held = progress.held.filter(|held| *held >= LONG_HOLD);
    let held = held.map_or_else(String::new, |held| format!(", held by XOFF for {:.0} s", held.as_secs_f64()));
    format!(
        "{:<12} [{}{}] {:>3.0} %  {}/{} records{eta}{held}",
        phase_name(progress.phase),
        "#".repeat(filled),
        " ".repeat(BAR - filled),
        share * 100.0,
        progress.records,
        progress.records_total
    )
}

/// A line for each of several uploads: repainted in place on a terminal, printed anew elsewhere when its phase changes.
pub struct Board {
    state: Mutex<State>,
    names: Vec<String>,
    in_place: bool,
}

struct State {
    lines: Vec<String>,
    painted: bool,
    to: Box<dyn Write + Send>,
}

impl Board {
    /// A board for uploads on these ports.
    pub fn new(ports: &[String], to: Box<dyn Write + Send>, in_place: bool) -> Self {
        let lines = vec!["waits".to_owned(); ports.len()];
        let width = ports.iter().map(|port| port.chars().count()).max().unwrap_or_default();
        let names = ports.iter().map(|port| format!("{port:<width$}")).collect();
        Board { state: Mutex::new(State { lines, painted: false, to }), names, in_place }
    }

    /// What a line says now.
    pub fn set(&self, line: usize, text: String) {
        let mut state = self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let first_word = |text: &str| text.split_whitespace().next().map(str::to_owned);
        let is_news = first_word(&state.lines[line]) != first_word(&text);
        state.lines[line] = text;
        let painted = if self.in_place {
            let up = if state.painted { format!("\x1b[{}A", state.lines.len()) } else { String::new() };
            let lines = self.names.iter().zip(&state.lines).map(|(name, line)| format!("\r{name}  {line}\x1b[K\r\n"));
            up + &lines.collect::<String>()
        } else if is_news {
            format!("{}  {}\n", self.names[line], state.lines[line])
        } else {
            return;
        };
        state.painted = true;
        let _ = state.to.write_all(painted.as_bytes()).and_then(|()| state.to.flush());
    }
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

    fn board(in_place: bool) -> (Board, Shared) {
        let shared = Shared::default();
        let ports = ["/dev/ttyUSB0".to_owned(), "u1".to_owned()];
        (Board::new(&ports, Box::new(shared.clone()), in_place), shared)
    }

    fn said(shared: &Shared) -> String {
        String::from_utf8(shared.0.lock().expect("no panic").clone()).expect("UTF-8")
    }

    #[test]
    fn each_upload_has_its_line_and_a_pipe_gets_only_what_is_new() {
        let (board, shared) = board(false);
        board.set(1, "transfer   1 %".into());
        board.set(1, "transfer   2 %".into());
        board.set(0, "check".into());
        assert_eq!(said(&shared), "u1            transfer   1 %\n/dev/ttyUSB0  check\n");
    }

    #[test]
    fn a_terminal_gets_all_lines_in_place() {
        let (board, shared) = board(true);
        board.set(0, "check".into());
        board.set(1, "done".into());
        let text = said(&shared);
        assert!(text.ends_with("\x1b[2A\r/dev/ttyUSB0  check\x1b[K\r\n\ru1            done\x1b[K\r\n"), "{text:?}");
    }
}
