//! The application: banner, main menu and its dialogues, data stream, diagnostics (AXTC4CO manual, chapter 4).
//!
//! What it says is worded by [`Dialect`]; who it is stands in the program flash it was started from. Keys come one by
//! one; while the port has more to send than [`BLOCKED_AT`] characters, the program is stuck in printing and keys
//! wait, as many as the receiver can keep.

mod prompt;
mod scanner;
mod view;

use std::collections::VecDeque;

use super::dialect::{Diagnosis, Dialect, NetworkState, Sentence};
use super::memory::StreamSetting;
use super::sensors::Channel;
use super::uart::{XOFF, XON};
use super::{Board, Reset};
use crate::image::Identity;
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;
use prompt::{Echo, Line, Typed};
use scanner::{FieldValue, SCAN_TIME, Scanner};

/// No measured values before the converters have settled (AXTC4CO manual, section 1.1; errata B-199).
pub const FIRST_DATA_AFTER: Duration = Duration::from_secs(3);
/// A diagnostics page comes at this interval (section 4.1.4).
pub const DIAGNOSTICS_PERIOD: Duration = Duration::from_secs(1);
/// Repetition rate that an empty answer takes (errata E-105).
pub const DEFAULT_PERIOD_MS: u16 = 1_000;

/// Characters waiting to be sent at which the program is stuck in printing and takes no keys.
const BLOCKED_AT: usize = 2_048;
/// Keys the receiver keeps meanwhile; further ones are lost.
const KEYS_KEPT: usize = 64;
/// Room for rows and pages waiting to be sent. What does not fit is dropped whole: the line is behind (errata E-105,
/// E-119). Enough for a diagnostics page and some rows, less than a tenth of a second of the line.
const ROW_BUFFER: usize = 1_024;

/// The password for new software. Real ones come from Axiomatic; this is the emulator's build setting (errata E-112).
const PASSWORD: &str = "AXIO-2010";

/// The application while it runs.
#[derive(Debug)]
pub struct Firmware {
    dialect: Dialect,
    identity: Identity,
    started_at: Instant,
    dialogue: Dialogue,
    keys: VecDeque<u8>,
    /// The last key was CR: an LF behind it belongs to it.
    after_return: bool,
    scanner: Scanner,
    scan_at: Instant,
    /// When the next row is due, if the stream is on.
    row_at: Option<Instant>,
    /// The row of the last scan, once it has been asked for: fast streams repeat it many times.
    row: Option<String>,
    /// When the next diagnostics page is due, if they are on.
    page_at: Option<Instant>,
    network: NetworkState,
}

/// Who gets the keys.
#[derive(Debug)]
enum Dialogue {
    Menu,
    StreamSource,
    StreamPeriod {
        source: Source,
        line: Line,
    },
    Defaults {
        line: Line,
    },
    Password {
        line: Line,
    },
    /// The object dictionary is shown up to this place of the walk.
    View {
        place: usize,
    },
    /// The reset follows when the last text has left.
    Leaving,
}

impl Firmware {
    /// Starts the application that lies in flash: first-start text if it is new, banner, menu.
    pub fn start(board: &mut Board<'_>, identity: Identity, dialect: Dialect) -> Self {
        let mut firmware = Firmware {
            dialect,
            identity,
            started_at: board.now,
            dialogue: Dialogue::Menu,
            keys: VecDeque::new(),
            after_return: false,
            scanner: Scanner::default(),
            scan_at: board.now,
            row_at: None,
            row: None,
            page_at: None,
            network: NetworkState::PreOperational,
        };
        if board.parameters.values().first_start {
            // The manual prints one ellipsis character, an ASCII port can only send dots (errata E-114).
            if let Some(text) = &board.product.console.first_start {
                firmware.say(board, &format!("\r\n{}\r\n", text.replace('…', "...")));
            }
            board.parameters.change(board.stores, |values| values.first_start = false);
        }
        let banner = firmware.dialect.banner(&firmware.identity, &board.product.title);
        firmware.say(board, &banner);
        firmware.print_menu(board);
        firmware.arm_stream(board.now, board.parameters.values().stream);
        firmware
    }

    /// A character has come. Flow control works below the program and never waits.
    pub fn receive(&mut self, board: &mut Board<'_>, key: u8) {
        match key {
            XOFF => board.uart.hold(board.now),
            XON => board.uart.resume(board.now),
            _ if self.keys.len() < KEYS_KEPT => self.keys.push_back(key),
            _ => {}
        }
        self.take_keys(board);
    }

    /// When something is due.
    pub fn deadline(&self) -> Instant {
        [self.row_at, self.page_at].into_iter().flatten().fold(self.scan_at, Instant::min)
    }

    /// Does what is due: a scan first, so that a row of the same moment carries it.
    pub fn step(&mut self, board: &mut Board<'_>) {
        self.take_keys(board);
        let now = board.now;
        if self.scan_at <= now {
            self.scan_at += SCAN_TIME;
            if !self.is_viewing() {
                self.scanner.scan(now, board.sensors);
                self.row = None;
            }
        }
        if self.row_at.is_some_and(|due| due <= now) {
            let stream = board.parameters.values().stream;
            self.row_at = self.row_at.map(|due| due + period(stream));
            let scanner = &self.scanner;
            let emit = || format!("{}\r\n", board.product.stream.emit(&scanner.row(stream.source)));
            let row = self.row.take().unwrap_or_else(emit);
            self.repeat(board, &row);
            self.row = Some(row);
        }
        if self.page_at.is_some_and(|due| due <= now) {
            self.page_at = self.page_at.map(|due| due + DIAGNOSTICS_PERIOD);
            let page = self.dialect.diagnostics(&self.diagnosis(board));
            self.repeat(board, &page);
        }
    }

    /// State of the CANopen node.
    pub fn set_network_state(&mut self, state: NetworkState) {
        self.network = state;
    }

    fn take_keys(&mut self, board: &mut Board<'_>) {
        while board.uart.backlog() < BLOCKED_AT
            && let Some(key) = self.keys.pop_front()
        {
            let line_feed_of_return = key == b'\n' && self.after_return;
            self.after_return = key == b'\r';
            if !line_feed_of_return {
                self.key(board, key);
            }
        }
    }

    fn key(&mut self, board: &mut Board<'_>, key: u8) {
        self.dialogue = match std::mem::replace(&mut self.dialogue, Dialogue::Menu) {
            Dialogue::Menu => self.menu_key(board, key.to_ascii_lowercase()),
            Dialogue::StreamSource => self.source_key(board, key),
            Dialogue::StreamPeriod { source, line } => self.line_key(
                board,
                key,
                line,
                |line| Dialogue::StreamPeriod { source, line },
                |firmware, board, answer| firmware.stream_on(board, source, &answer),
            ),
            Dialogue::Defaults { line } => {
                self.line_key(board, key, line, |line| Dialogue::Defaults { line }, Firmware::restore_defaults)
            }
            Dialogue::Password { line } => {
                self.line_key(board, key, line, |line| Dialogue::Password { line }, Firmware::enter_loader)
            }
            Dialogue::View { place } => self.view_key(board, key, place),
            Dialogue::Leaving => Dialogue::Leaving,
        };
    }

    fn menu_key(&mut self, board: &mut Board<'_>, key: u8) -> Dialogue {
        match key {
            b'm' => {
                self.print_menu(board);
                Dialogue::Menu
            }
            b'v' => self.open_view(board),
            b'd' => self.ask(board, Sentence::AskDefaults, Dialogue::Defaults { line: Line::new(Echo::Plain) }),
            b't' if board.parameters.values().stream.on => {
                board.parameters.change(board.stores, |values| values.stream.on = false);
                self.row_at = None;
                self.print(board, Sentence::StreamOff);
                Dialogue::Menu
            }
            b't' => self.ask(board, Sentence::AskSource, Dialogue::StreamSource),
            b's' => {
                self.toggle_diagnostics(board);
                Dialogue::Menu
            }
            b'l' => self.ask(board, Sentence::AskPassword, Dialogue::Password { line: Line::new(Echo::Stars) }),
            _ => Dialogue::Menu,
        }
    }

    fn source_key(&mut self, board: &mut Board<'_>, key: u8) -> Dialogue {
        let source = match key.to_ascii_lowercase() {
            b'f' => Source::FieldValue,
            b'p' => Source::ProcessValue,
            b'\r' | ESCAPE => return self.cancel(board),
            _ => return Dialogue::StreamSource,
        };
        board.uart.send(board.now, &[key]);
        let prompt = self.dialect.ask_period(DEFAULT_PERIOD_MS);
        self.say(board, &prompt);
        Dialogue::StreamPeriod { source, line: Line::new(Echo::Plain) }
    }

    /// A key of an answer: echoes it, and hands the answer on when it is complete.
    fn line_key(
        &mut self,
        board: &mut Board<'_>,
        key: u8,
        mut line: Line,
        stay: impl FnOnce(Line) -> Dialogue,
        answered: impl FnOnce(&mut Self, &mut Board<'_>, String) -> Dialogue,
    ) -> Dialogue {
        match line.take(key) {
            Typed::More(echo) => board.uart.send(board.now, echo),
            Typed::Character(character) => board.uart.send(board.now, &[character]),
            Typed::Answer(answer) => return answered(self, board, answer),
            Typed::Cancelled => return self.cancel(board),
        }
        stay(line)
    }

    fn stream_on(&mut self, board: &mut Board<'_>, source: Source, answer: &str) -> Dialogue {
        let Some(period_ms) = parse_period(answer, board.product.measurement.stream_period_ms) else {
            self.print(board, Sentence::BadPeriod);
            return Dialogue::Menu;
        };
        let stream = StreamSetting { on: true, source, period_ms };
        board.parameters.change(board.stores, |values| values.stream = stream);
        let text = self.dialect.stream_on(source, period_ms);
        self.say(board, &text);
        self.arm_stream(board.now, stream);
        Dialogue::Menu
    }

    fn restore_defaults(&mut self, board: &mut Board<'_>, answer: String) -> Dialogue {
        if answer != board.product.console.defaults_answer {
            return self.cancel(board);
        }
        // Stream settings, node-ID and bit rate are kept apart from the object dictionary (errata E-106).
        board.sensors.restore_defaults();
        self.print(board, Sentence::DefaultsRestored);
        *board.reset = Some(Reset::Start);
        Dialogue::Leaving
    }

    fn enter_loader(&mut self, board: &mut Board<'_>, answer: String) -> Dialogue {
        if answer.is_empty() {
            return self.cancel(board);
        }
        if answer != PASSWORD {
            self.print(board, Sentence::WrongPassword);
            return Dialogue::Menu;
        }
        self.print(board, Sentence::RightPassword);
        *board.reset = Some(Reset::StayInLoader);
        Dialogue::Leaving
    }

    fn toggle_diagnostics(&mut self, board: &mut Board<'_>) {
        if self.page_at.take().is_some() {
            self.print(board, Sentence::DiagnosticsOff);
        } else {
            self.print(board, Sentence::DiagnosticsOn);
            self.page_at = Some(board.now.max(self.started_at + FIRST_DATA_AFTER));
        }
    }

    fn open_view(&mut self, board: &mut Board<'_>) -> Dialogue {
        if self.network != NetworkState::PreOperational {
            self.print(board, Sentence::ViewRefused);
            return Dialogue::Menu;
        }
        self.print(board, Sentence::ViewTitle);
        let lines = view::pdo_block(&self.sources(board));
        self.say_lines(board, &lines);
        self.print(board, Sentence::ViewNext);
        Dialogue::View { place: 0 }
    }

    fn view_key(&mut self, board: &mut Board<'_>, key: u8, place: usize) -> Dialogue {
        let next = match key {
            b'\r' => view::object(&self.sources(board), place),
            b'x' | b'X' => None,
            _ => return Dialogue::View { place },
        };
        let Some(lines) = next else {
            self.print(board, Sentence::ViewEnd);
            self.print_menu(board);
            return Dialogue::Menu;
        };
        self.say_lines(board, &lines);
        Dialogue::View { place: place + 1 }
    }

    fn ask(&mut self, board: &mut Board<'_>, prompt: Sentence, dialogue: Dialogue) -> Dialogue {
        self.print(board, prompt);
        dialogue
    }

    fn cancel(&mut self, board: &mut Board<'_>) -> Dialogue {
        self.print(board, Sentence::Cancelled);
        Dialogue::Menu
    }

    /// Rows come at whole periods from now, but not before the first valid data.
    fn arm_stream(&mut self, now: Instant, stream: StreamSetting) {
        self.row = None;
        let first_data_at = self.started_at + FIRST_DATA_AFTER;
        self.row_at = stream.on.then(|| first_data_at.max(now + period(stream)));
    }

    /// A row or page: only while nothing else is asked or shown (errata E-117) and the line keeps up; otherwise it is
    /// dropped whole.
    fn repeat(&mut self, board: &mut Board<'_>, text: &str) {
        if matches!(self.dialogue, Dialogue::Menu) && board.uart.backlog() + text.len() <= ROW_BUFFER {
            self.say(board, text);
        }
    }

    fn is_viewing(&self) -> bool {
        matches!(self.dialogue, Dialogue::View { .. })
    }

    fn diagnosis(&self, board: &Board<'_>) -> Diagnosis {
        let format = board.product.stream.format(Source::FieldValue);
        let channels = Channel::all().map(|channel| {
            let value = match self.scanner.field_value(channel) {
                FieldValue::Celsius(celsius) => format!("{celsius:8.3}"),
                FieldValue::Disabled => format!("{:<8}", format.disabled),
                FieldValue::Open => format!("{:<8}", format.open),
            };
            (value, self.scanner.microvolts(channel))
        });
        Diagnosis {
            supply: self.scanner.supply(),
            cold_junction: self.scanner.cold_junction(),
            channels: channels.to_vec(),
            errors: self.scanner.errors(),
            uptime: board.now.since(self.started_at),
            network: self.network,
        }
    }

    fn sources<'a>(&'a self, board: &'a Board<'_>) -> view::Sources<'a> {
        view::Sources {
            product: board.product,
            identity: &self.identity,
            parameters: board.parameters.values(),
            scanner: &self.scanner,
            serial_number: board.serial_number,
        }
    }

    fn print_menu(&mut self, board: &mut Board<'_>) {
        let menu = self.dialect.menu(&self.identity, board.parameters.values(), self.network);
        self.say(board, &menu);
    }

    fn print(&mut self, board: &mut Board<'_>, sentence: Sentence) {
        let text = self.dialect.sentence(sentence);
        self.say(board, &text);
    }

    fn say_lines(&mut self, board: &mut Board<'_>, lines: &[super::dialect::ViewLine]) {
        let text: String = lines.iter().map(|line| self.dialect.view_line(line)).collect();
        self.say(board, &format!("\r\n{text}"));
    }

    fn say(&mut self, board: &mut Board<'_>, text: &str) {
        board.uart.send(board.now, text.as_bytes());
    }
}

const ESCAPE: u8 = 0x1B;

fn period(stream: StreamSetting) -> Duration {
    Duration::from_millis(u64::from(stream.period_ms))
}

/// The repetition rate an answer means: nothing typed means the default.
fn parse_period(answer: &str, (shortest, longest): (u16, u16)) -> Option<u16> {
    let answer = answer.trim();
    if answer.is_empty() {
        return Some(DEFAULT_PERIOD_MS);
    }
    let plain = answer.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| answer.parse().ok()).flatten().filter(|period_ms| (shortest..=longest).contains(period_ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repetition_rate_is_a_whole_number_within_its_limits() {
        for (answer, period_ms) in [("", Some(1_000)), ("1", Some(1)), ("60000", Some(60_000)), (" 250 ", Some(250))] {
            assert_eq!(parse_period(answer, (1, 60_000)), period_ms, "{answer:?}");
        }
        for answer in ["0", "60001", "-5", "1.5", "x", "99999999999", "1 0"] {
            assert_eq!(parse_period(answer, (1, 60_000)), None, "{answer:?}");
        }
    }
}
