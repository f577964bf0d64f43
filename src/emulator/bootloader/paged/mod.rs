//! The loaders that take an S-record file into a page buffer and write it to program flash page by page: generations
//! g1 and g2, which are one machine with two [profiles](Profile).
//!
//! A public fact about the Motorola SDK's loaders for 16-bit parts, likely but not proven for these units. Its
//! texts are its own, the manual's prompt and the manual's dots (AXTC4CO manual, section 4.1.5).
//!
//! Decisions where no fact was at hand, all guesses: both cases of hex digits; an S0 in the middle of a load starts
//! a new one; what comes while an error text leaves is lost without another error; after an error the sender is let
//! go on (XON) if it was stopped; S7 waits for silence like a full page does; error 7 is a flash operation that does not
//! end. What is a guess of one generation is said at its profile.

mod profile;
mod record;

use std::collections::VecDeque;

use super::super::memory::{Flash, StartDelay, Written};
use super::super::{Board, Reset};
use super::voice::Voice;
use crate::image::Destination;
use crate::time::Instant;
use profile::Ending;
pub use profile::{G1, G2, Profile};
use record::{DataRecord, Decoder, LoadError, Record};

/// The loader while it runs.
#[derive(Debug)]
pub struct Loader {
    profile: &'static Profile,
    decoder: Decoder,
    activity: Activity,
    load: Option<Load>,
    heard_at: Instant,
    /// Texts are leaving and nobody listens until then.
    deaf_until: Instant,
    voice: Voice,
}

/// What the loader is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Activity {
    Listening,
    /// The page buffer has to be written, as soon as the line is silent.
    AwaitingSilence(Then),
    /// Flash is being written, the receiver is not served.
    Writing {
        then: Then,
        overrun: bool,
    },
    /// The file is in: the reset follows when the last text has left.
    Leaving,
}

/// What follows when a page is written.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Then {
    /// Goes on with what is parked: the rest of the record that did not fit the page, and the records after it.
    TakeUp(VecDeque<DataRecord>),
    /// S7 has come, with this entry point.
    Finish(u32),
}

/// A load between S0 and S7.
#[derive(Debug, Default)]
struct Load {
    page: Option<PageBuffer>,
    program_words: u32,
    data_words: u32,
}

#[derive(Debug)]
struct PageBuffer {
    page: u32,
    words: Vec<u16>,
}

impl Loader {
    /// Starts the loader: it says what it is and what it wants.
    pub fn start(profile: &'static Profile, board: &mut Board<'_>) -> Self {
        let mut loader = Loader {
            profile,
            decoder: Decoder::new(profile.ignores),
            activity: Activity::Listening,
            load: None,
            heard_at: board.now,
            deaf_until: Instant::ZERO,
            voice: Voice::default(),
        };
        loader.voice.say(board, profile.header);
        loader.deaf_until = board.uart.finished_at();
        loader.voice.prompt(board);
        loader
    }

    /// A character has come.
    pub fn receive(&mut self, board: &mut Board<'_>, character: u8) {
        match &mut self.activity {
            Activity::Writing { overrun, .. } => *overrun = true,
            Activity::Leaving => {}
            // Nothing is decoded after S7, but the line is not silent.
            Activity::AwaitingSilence(Then::Finish(_)) => self.heard_at = board.now,
            Activity::Listening | Activity::AwaitingSilence(Then::TakeUp(_)) => {
                if board.now < self.deaf_until {
                    return;
                }
                self.heard_at = board.now;
                match self.decoder.take(character, self.load.is_some()) {
                    Ok(None) => {}
                    Ok(Some(record)) => self.take(board, record),
                    Err(error) => self.fail(board, error),
                }
            }
        }
    }

    /// A character has come that the receiver could not read.
    pub fn receive_garbage(&mut self, board: &mut Board<'_>) {
        match &mut self.activity {
            Activity::Writing { overrun, .. } => *overrun = true,
            Activity::Leaving => {}
            Activity::Listening | Activity::AwaitingSilence(_) if board.now < self.deaf_until => {}
            Activity::Listening | Activity::AwaitingSilence(_) => self.fail(board, LoadError::Receive),
        }
    }

    /// When something is due.
    pub fn deadline(&self, flash: &Flash) -> Option<Instant> {
        match self.activity {
            Activity::AwaitingSilence(_) => Some(self.heard_at + self.profile.silence),
            Activity::Writing { .. } => flash.deadline(),
            Activity::Listening | Activity::Leaving => None,
        }
    }

    /// Does what is due.
    pub fn step(&mut self, board: &mut Board<'_>) {
        if self.deadline(board.flash).is_none_or(|due| due > board.now) {
            return;
        }
        match std::mem::replace(&mut self.activity, Activity::Listening) {
            Activity::AwaitingSilence(then) => self.begin_to_write(board, then),
            Activity::Writing { then, overrun } => match board.flash.step(board.now, board.stores) {
                None => self.activity = Activity::Writing { then, overrun },
                Some(Written::Mismatch | Written::Refused) => self.fail(board, LoadError::Flash),
                Some(Written::Stuck) => self.fail(board, LoadError::Internal),
                Some(Written::Good) if overrun => self.fail(board, LoadError::Receive),
                Some(Written::Good) => self.written(board, then),
            },
            other @ (Activity::Listening | Activity::Leaving) => self.activity = other,
        }
    }

    /// Whether the sender is stopped.
    pub fn holds_sender(&self) -> bool {
        self.voice.holds_sender()
    }

    fn take(&mut self, board: &mut Board<'_>, record: Record) {
        match record {
            Record::Header => self.begin(board),
            Record::Data(data) => match &mut self.activity {
                Activity::AwaitingSilence(Then::TakeUp(parked)) if parked.len() < self.profile.parks => {
                    parked.push_back(data);
                }
                Activity::Listening => self.collect(board, VecDeque::from([data])),
                Activity::AwaitingSilence(_) | Activity::Writing { .. } | Activity::Leaving => {
                    self.fail(board, LoadError::Overrun);
                }
            },
            // A record that is parked is lost here, and success is reported all the same.
            Record::End(entry) => self.activity = Activity::AwaitingSilence(Then::Finish(entry)),
        }
    }

    /// From here on only a complete file brings the application back.
    fn begin(&mut self, board: &mut Board<'_>) {
        self.voice.let_go_on(board);
        self.activity = Activity::Listening;
        self.load = Some(Load::default());
        board.parameters.change(board.stores, |values| values.start_delay = StartDelay::WaitsForEver);
    }

    /// Puts the words of records into the page buffer; where another page begins, the rest is parked and the sender
    /// stopped. It may go on when all of them are in.
    fn collect(&mut self, board: &mut Board<'_>, mut records: VecDeque<DataRecord>) {
        while let Some(data) = records.pop_front() {
            if let Some(rest) = self.fill_page(board, data) {
                records.push_front(rest);
                self.activity = Activity::AwaitingSilence(Then::TakeUp(records));
                self.voice.hold(board);
                return;
            }
        }
        self.voice.let_go_on(board);
    }

    /// Puts the words of a record into the page buffer. Gives those from where another page begins.
    fn fill_page(&mut self, board: &Board<'_>, data: DataRecord) -> Option<DataRecord> {
        let load = self.load.as_mut()?;
        let map = board.flash.map();
        for (number, &word) in data.words.iter().enumerate() {
            let address = data.address.wrapping_add(number as u32);
            // An address of a larger part of the family is folded into this one's flash, one that makes no sense is
            // skipped, both silently.
            match Destination::of(address.into()) {
                Destination::Skipped => {}
                Destination::Data => load.data_words += 1,
                Destination::Program => {
                    let word_address = address % map.program_words;
                    let page = word_address / map.page_words;
                    let buffer = load.page.get_or_insert_with(|| PageBuffer { page, words: board.flash.page(page) });
                    if buffer.page != page {
                        return Some(DataRecord { address, words: data.words[number..].to_vec() });
                    }
                    buffer.words[(word_address % map.page_words) as usize] = word;
                    load.program_words += 1;
                }
            }
        }
        None
    }

    fn begin_to_write(&mut self, board: &mut Board<'_>, then: Then) {
        match self.load.as_mut().and_then(|load| load.page.take()) {
            Some(buffer) => {
                board.flash.write_page(board.now, buffer.page, buffer.words);
                self.activity = Activity::Writing { then, overrun: false };
            }
            None => self.go_on(board, then),
        }
    }

    fn written(&mut self, board: &mut Board<'_>, then: Then) {
        self.voice.mark(board);
        self.go_on(board, then);
    }

    fn go_on(&mut self, board: &mut Board<'_>, then: Then) {
        match then {
            Then::TakeUp(parked) => self.collect(board, parked),
            Then::Finish(entry) => {
                self.voice.let_go_on(board);
                self.finish(board, entry);
            }
        }
    }

    fn finish(&mut self, board: &mut Board<'_>, entry: u32) {
        let load = self.load.take().unwrap_or_default();
        board.parameters.change(board.stores, |values| {
            values.start_delay = StartDelay::AtOnce;
            values.first_start = true;
        });
        self.voice.end_line(board);
        match self.profile.ending {
            Ending::Counts => {
                let (program, data) = (load.program_words, load.data_words);
                self.voice.say(board, &format!("Loaded 0x{program:04X} Program and 0x{data:04X} Data words.\r\n"));
                self.voice.say(board, "Application started.\r\n");
            }
            Ending::Address => self.voice.say(board, &format!("Application started from address 0x{entry:04X}\r\n")),
        }
        self.activity = Activity::Leaving;
        *board.reset = Some(Reset::Start);
    }

    /// Says what is wrong and starts over: what is in the page buffer or parked is lost, S0 is wanted again.
    fn fail(&mut self, board: &mut Board<'_>, error: LoadError) {
        self.decoder = Decoder::new(self.profile.ignores);
        self.activity = Activity::Listening;
        self.load = None;
        self.voice.end_line(board);
        self.voice.say(board, &format!("Error # {:04}\r\nRestarting.\r\n", error.number()));
        self.deaf_until = board.uart.finished_at();
        self.voice.let_go_on(board);
        self.voice.prompt(board);
    }
}
