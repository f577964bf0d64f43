//! The menu's keys, the questions they lead to, and the view of the object dictionary (manuals, section 4.1).
//!
//! One dialogue at a time gets the keys. What is printed meanwhile by itself, rows and pages, is in the parent module.

use super::prompt::{ESCAPE, Echo, Line, Typed};
use super::{Firmware, view};
use crate::emulator::dialect::Sentence;
use crate::emulator::memory::StreamSetting;
use crate::emulator::network::NetworkState;
use crate::emulator::{Board, Reset};
use crate::time::Instant;
use crate::wire::stream::Source;

/// Repetition rate that an empty answer takes (errata E-105).
const DEFAULT_PERIOD_MS: u16 = 1_000;

/// The password for new software. Real ones come from Axiomatic; this is the emulator's build setting (errata E-112).
const PASSWORD: &str = "AXIO-2010";

/// What gets the keys.
#[derive(Debug)]
pub(super) enum Dialogue {
    Menu,
    /// The source that was chosen, where the question wants Enter after its key.
    StreamSource {
        chosen: Option<Source>,
    },
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
    /// The object dictionary is shown; scanning and CAN are halted since the moment it was opened.
    View {
        /// Objects that have been shown after the block of PDO parameters.
        shown: usize,
        since: Instant,
    },
    /// The reset follows when the last text has left.
    Leaving,
}

impl Firmware {
    /// Gives a key to the dialogue that is open.
    pub(super) fn key(&mut self, board: &mut Board<'_>, key: u8) {
        self.dialogue = match std::mem::replace(&mut self.dialogue, Dialogue::Menu) {
            Dialogue::Menu => self.menu_key(board, key.to_ascii_lowercase()),
            Dialogue::StreamSource { chosen } => self.source_key(board, key, chosen),
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
            Dialogue::View { shown, since } => self.view_key(board, key, shown, since),
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
            b't' => self.ask(board, Sentence::AskSource, Dialogue::StreamSource { chosen: None }),
            b's' => {
                self.toggle_diagnostics(board);
                Dialogue::Menu
            }
            b'l' => self.ask(board, Sentence::AskPassword, Dialogue::Password { line: Line::new(Echo::Stars) }),
            _ => Dialogue::Menu,
        }
    }

    fn source_key(&mut self, board: &mut Board<'_>, key: u8, chosen: Option<Source>) -> Dialogue {
        let source = match (self.dialect.source_of(key), key, chosen) {
            (Some(source), _, _) => {
                self.echo(board, &[key]);
                if self.dialect.source_wants_enter() {
                    return Dialogue::StreamSource { chosen: Some(source) };
                }
                source
            }
            (None, b'\r', Some(source)) => source,
            (None, b'\r' | ESCAPE, _) => return self.cancel(board),
            (None, _, _) => return Dialogue::StreamSource { chosen },
        };
        let limits = board.product.measurement.stream_period_ms;
        let prompt = self.dialect.ask_period(limits, DEFAULT_PERIOD_MS);
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
            Typed::More(echo) => self.echo(board, echo),
            Typed::Character(character) => self.echo(board, &[character]),
            Typed::Answer(answer) => return answered(self, board, answer),
            Typed::Cancelled => return self.cancel(board),
        }
        stay(line)
    }

    fn stream_on(&mut self, board: &mut Board<'_>, source: Source, answer: &str) -> Dialogue {
        let Some(period_ms) = parse_period(answer, board.product.measurement.stream_period_ms) else {
            let text = self.dialect.bad_period(board.product.measurement.stream_period_ms);
            self.say(board, &text);
            return Dialogue::Menu;
        };
        let stream = StreamSetting { on: true, source, period_ms };
        board.parameters.change(board.stores, |values| values.stream = stream);
        let text = self.dialect.stream_on(source, period_ms);
        self.say(board, &text);
        self.arm_stream(board, stream);
        Dialogue::Menu
    }

    fn restore_defaults(&mut self, board: &mut Board<'_>, answer: String) -> Dialogue {
        if answer != board.product.console.defaults_answer {
            return self.cancel(board);
        }
        // Stream settings, node-ID and bit rate are kept apart from the object dictionary (errata E-106).
        board.parameters.restore(board.stores, None);
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
            self.page_at = Some(board.now.max(self.measurement.first_data_at()));
        }
    }

    fn open_view(&mut self, board: &mut Board<'_>) -> Dialogue {
        if self.network.state() != NetworkState::PreOperational {
            self.print(board, Sentence::ViewRefused);
            return Dialogue::Menu;
        }
        self.print(board, Sentence::ViewTitle);
        self.say_objects(board, view::pdo_block(board.product));
        self.print(board, Sentence::ViewNext);
        Dialogue::View { shown: 0, since: board.now }
    }

    fn view_key(&mut self, board: &mut Board<'_>, key: u8, shown: usize, since: Instant) -> Dialogue {
        let next = match key {
            b'\r' => view::object(board.product, shown),
            b'x' | b'X' => None,
            _ => return Dialogue::View { shown, since },
        };
        match next {
            Some(object) => {
                self.say_objects(board, std::iter::once(object));
                Dialogue::View { shown: shown + 1, since }
            }
            None => {
                self.resume(since, board.now);
                self.print(board, Sentence::ViewEnd);
                self.print_menu(board);
                Dialogue::Menu
            }
        }
    }

    fn ask(&mut self, board: &mut Board<'_>, prompt: Sentence, dialogue: Dialogue) -> Dialogue {
        self.print(board, prompt);
        dialogue
    }

    fn cancel(&mut self, board: &mut Board<'_>) -> Dialogue {
        self.print(board, Sentence::Cancelled);
        Dialogue::Menu
    }
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
