//! The G3 loader: erases everything at S0, then writes each record as it comes, out of a ring without overrun check.
//!
//! A public fact about the circular-buffer loaders of 2005 and later for 16-bit 56F83xx parts, likely but not proven
//! for these units. From the AXRTD8CO manual, section 4.1.5, are a header, a prompt for any key, the prompt for the file,
//! the dots and the text at the end; from errata E-I12 that the header has the word Bootloader in it, and that without a
//! key the application starts after 10 s. How records are read is in [`reader`], where characters wait in [`ring`].
//!
//! Decisions where no fact was at hand, all guesses: the wording of header and key prompt; after an error the loader
//! empties its ring, prompts again and wants S0; what comes while an error text leaves is lost; XOFF is sent once until
//! XON follows. Only the status bits of [`LoadError`] occur, one at a time.

mod reader;
mod ring;

use super::super::memory::{Flash, StartDelay, Written};
use super::super::{Board, Reset};
use super::voice::Voice;
use crate::device::SECTOR_WORDS;
use crate::time::{Duration, Instant};
pub use reader::Version;
use reader::{Kind, LoadError, Read, Reader};
use ring::Ring;

/// Without a key for this long the application starts, if there is one (errata E-I12).
pub const KEY_TIME: Duration = Duration::from_secs(10);

/// What it asks before it wants the file. The manual does not print it.
const ANY_KEY: &str = "Hit any key to continue ";
/// What the public loader prints at the end, where the product has no text of its own.
const LOADED: &str = "Download Complete\r\nApplication started!";

/// The loader while it runs.
#[derive(Debug)]
pub struct Loader {
    version: Version,
    ring: Ring,
    reader: Reader,
    activity: Activity,
    /// An S0 has come, and its S7 has not.
    loading: bool,
    /// The receiver could not read a character; the reader has not seen it yet.
    unreadable: bool,
    voice: Voice,
}

/// What the loader is doing. Meanwhile the interrupt goes on to fill the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    /// Any key is wanted; without one the application starts at this moment, if there is one.
    AwaitingKey { until: Option<Instant> },
    /// It reads the ring.
    Reading,
    /// S0 has come: this is the word where the sector begins that is being erased.
    Erasing { first_word: u32 },
    /// The words of a record.
    Programming,
    /// An error text leaves until this moment.
    Complaining { until: Instant },
    /// The file is in: the reset follows when the last text has left.
    Leaving,
}

impl Loader {
    /// Starts the loader: it says what it is and asks for a key. `may_leave` says that there is an application to start.
    pub fn start(version: Version, board: &mut Board<'_>, may_leave: bool) -> Self {
        let mut loader = Loader {
            version,
            ring: Ring::new(),
            reader: Reader::new(version),
            activity: Activity::Reading,
            loading: false,
            unreadable: false,
            voice: Voice::default(),
        };
        loader.voice.say(board, &format!("\r\n{}\r\n", version.header()));
        if board.product.loader.asks_for_key {
            loader.voice.say(board, ANY_KEY);
            loader.activity = Activity::AwaitingKey { until: may_leave.then(|| board.now + KEY_TIME) };
        } else {
            loader.voice.prompt(board);
        }
        loader
    }

    /// A character has come.
    pub fn receive(&mut self, board: &mut Board<'_>, character: u8) {
        match self.activity {
            Activity::AwaitingKey { .. } => {
                self.activity = Activity::Reading;
                self.voice.say(board, "\r\n");
                self.voice.prompt(board);
            }
            Activity::Leaving => {}
            Activity::Reading | Activity::Erasing { .. } | Activity::Programming | Activity::Complaining { .. } => {
                self.ring.push(character);
                // The interrupt looks for CR only, wherever in a record the reader may be.
                if character == b'\r' {
                    self.voice.hold(board);
                }
                self.read(board);
            }
        }
    }

    /// A character has come that the receiver could not read. The interrupt notes it; the reader stumbles over it when
    /// it reads on (a guess: the loader's status word has a bit for it).
    pub fn receive_garbage(&mut self, board: &mut Board<'_>) {
        match self.activity {
            Activity::AwaitingKey { .. } | Activity::Leaving | Activity::Complaining { .. } => {}
            Activity::Erasing { .. } | Activity::Programming => self.unreadable = true,
            Activity::Reading => {
                self.unreadable = true;
                self.read(board);
            }
        }
    }

    /// When something is due.
    pub fn deadline(&self, flash: &Flash) -> Option<Instant> {
        match self.activity {
            Activity::AwaitingKey { until } => until,
            Activity::Erasing { .. } | Activity::Programming => flash.deadline(),
            Activity::Complaining { until } => Some(until),
            Activity::Reading | Activity::Leaving => None,
        }
    }

    /// Does what is due.
    pub fn step(&mut self, board: &mut Board<'_>) {
        if self.deadline(board.flash).is_none_or(|due| due > board.now) {
            return;
        }
        match self.activity {
            Activity::AwaitingKey { .. } => {
                self.voice.say(board, "\r\n");
                self.activity = Activity::Leaving;
                *board.reset = Some(Reset::Start);
            }
            Activity::Erasing { first_word } => {
                if let Some(written) = board.flash.step(board.now, board.stores) {
                    match error(written) {
                        None => self.erase(board, first_word + SECTOR_WORDS),
                        Some(error) => self.fail(board, error),
                    }
                }
            }
            Activity::Programming => match board.flash.step(board.now, board.stores).map(error) {
                None => {}
                Some(None) => {
                    self.activity = Activity::Reading;
                    self.read(board);
                }
                Some(Some(error)) => self.fail(board, error),
            },
            Activity::Complaining { .. } => {
                self.ring.clear();
                self.unreadable = false;
                self.activity = Activity::Reading;
                self.read(board);
            }
            Activity::Reading | Activity::Leaving => {}
        }
    }

    /// Whether the sender is stopped.
    pub fn holds_sender(&self) -> bool {
        self.voice.holds_sender()
    }

    /// Reads the ring until it is empty or something has to be waited for.
    fn read(&mut self, board: &mut Board<'_>) {
        while self.activity == Activity::Reading {
            if std::mem::take(&mut self.unreadable) {
                self.fail(board, LoadError::Receive);
                return;
            }
            let Some(character) = self.ring.pop() else {
                self.voice.let_go_on(board);
                return;
            };
            match self.reader.take(character, self.loading) {
                Ok(Read::Nothing) => {}
                // As it comes: the loader does not look at what it echoes.
                Ok(Read::Text(byte)) => self.voice.echo(board, &[byte]),
                Ok(Read::Words { address, words }) => self.program(board, address, words),
                Ok(Read::End(kind)) => self.take(board, kind),
                Err(error) => self.fail(board, error),
            }
        }
    }

    fn take(&mut self, board: &mut Board<'_>, kind: Kind) {
        match kind {
            Kind::Header => {
                self.voice.end_line(board);
                self.loading = true;
                // From here on only a complete file brings an application.
                board.parameters.change(board.stores, |values| values.start_delay = StartDelay::WaitsForEver);
                self.erase(board, 0);
            }
            Kind::Data => self.voice.mark(board),
            Kind::Terminator(entry) if entry >= board.flash.map().program_words => {
                self.fail(board, LoadError::StartAddress);
            }
            Kind::Terminator(_) => self.finish(board),
        }
    }

    /// Erases from this word on, a sector at a time.
    fn erase(&mut self, board: &mut Board<'_>, first_word: u32) {
        let left = board.flash.map().program_words.saturating_sub(first_word);
        if left > 0 {
            board.flash.erase(board.now, first_word, left.min(SECTOR_WORDS));
            self.activity = Activity::Erasing { first_word };
        } else {
            self.activity = Activity::Reading;
            self.read(board);
        }
    }

    fn program(&mut self, board: &mut Board<'_>, address: u32, words: Vec<u16>) {
        let end = u64::from(address) + words.len() as u64;
        if end > u64::from(board.flash.map().program_words) {
            self.fail(board, LoadError::AddressRange);
        } else {
            board.flash.program_words(board.now, address, words);
            self.activity = Activity::Programming;
        }
    }

    fn finish(&mut self, board: &mut Board<'_>) {
        board.parameters.change(board.stores, |values| {
            values.start_delay = StartDelay::AtOnce;
            values.first_start = true;
        });
        self.voice.end_line(board);
        let loaded = board.product.console.loaded.as_deref().unwrap_or(LOADED);
        self.voice.say(board, &format!("{loaded}\r\n"));
        self.voice.let_go_on(board);
        self.activity = Activity::Leaving;
        *board.reset = Some(Reset::Start);
    }

    /// Says what is wrong and starts over; what has been erased stays erased, what has been programmed stays.
    fn fail(&mut self, board: &mut Board<'_>, error: LoadError) {
        self.reader = Reader::new(self.version);
        self.loading = false;
        self.voice.end_line(board);
        self.voice.say(board, &format!("Error: {:04X}\r\n", error.bit()));
        self.voice.prompt(board);
        self.activity = Activity::Complaining { until: board.uart.finished_at() };
    }
}

/// What an operation of the flash that ended like this is called.
fn error(written: Written) -> Option<LoadError> {
    match written {
        Written::Good => None,
        Written::Mismatch => Some(LoadError::Program),
        Written::Refused => Some(LoadError::Protection),
        Written::Stuck => Some(LoadError::Access),
    }
}
