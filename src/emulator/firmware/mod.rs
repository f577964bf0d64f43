//! The application: power-up, what it prints by itself, and its side of the network (manuals, chapter 4).
//!
//! What it says is worded by [`Dialect`]; what it is comes from the program flash it was started from; what it measures and
//! its settings are in its object dictionary ([`Objects`]). Keys come one by one; while the port has more to send than
//! [`BLOCKED_AT`] characters, the program is stuck in printing and keys wait, as many as the receiver can keep. What a key
//! does is in `dialogue`.

mod about;
mod diagnosis;
mod dialogue;
mod prompt;
mod view;

use std::collections::VecDeque;

use super::dialect::{Dialect, Sentence};
use super::errors::{ActiveErrors, Class};
use super::measurement::{self, Measurement};
use super::memory::StreamSetting;
use super::network::{Network, NetworkState, NmtCommand};
use super::objects::{Effect, Objects};
use super::uart::{XOFF, XON};
use super::{Board, Refusal, Reset};
use crate::canopen::{ObjectAddress, Value};
use crate::device::dictionary::{Group, Object};
use crate::device::emergency::Emergency;
use crate::image::Identity;
use crate::time::{Duration, Instant};
use dialogue::Dialogue;

/// A diagnostics page comes at this interval (section 4.1.4).
const DIAGNOSTICS_PERIOD: Duration = Duration::from_secs(1);

/// Characters waiting to be sent at which the program is stuck in printing and takes no keys.
const BLOCKED_AT: usize = 2_048;
/// Keys the receiver keeps meanwhile; further ones are lost.
const KEYS_KEPT: usize = 64;
/// Characters that may wait to be sent together with a row. What does not fit is dropped whole: the line is behind
/// (errata E-105, E-119).
const ROW_BUFFER: usize = 512;
/// The same with a page of diagnostics: it has room after any number of rows, and all that waits is less than a tenth of
/// a second of the line.
const PAGE_BUFFER: usize = 1_024;

/// The application while it runs.
#[derive(Debug)]
pub struct Firmware {
    dialect: Dialect,
    identity: Identity,
    started_at: Instant,
    dialogue: Dialogue,
    keys: VecDeque<u8>,
    /// The last key was CR: an LF after it belongs to it.
    after_return: bool,
    objects: Objects,
    measurement: Measurement,
    errors: ActiveErrors,
    network: Network,
    /// When the next row is due, if the stream is on.
    row_at: Option<Instant>,
    /// The row of the last scan, once it has been asked for: fast streams repeat it many times.
    row: Option<String>,
    /// When the next diagnostics page is due, if they are on.
    page_at: Option<Instant>,
}

impl Firmware {
    /// Starts the application that lies in flash: first-start text if it is new, banner, menu.
    pub fn start(board: &mut Board<'_>, identity: Identity, dialect: Dialect) -> Self {
        let mut objects = board.parameters.objects();
        about::put(&mut objects, &identity, board.parameters.values().serial_number.unwrap_or_default());
        let autonomous = objects.get(0x5555, 0) == Value::Boolean(true);
        let mut firmware = Firmware {
            dialect,
            identity,
            started_at: board.now,
            dialogue: Dialogue::Menu,
            keys: VecDeque::new(),
            after_return: false,
            measurement: Measurement::start(board.now, board.product, board.sensors, &mut objects),
            objects,
            errors: ActiveErrors::default(),
            network: Network::start(board.now, board.product, autonomous),
            row_at: None,
            row: None,
            page_at: None,
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
        firmware.arm_stream(board, board.parameters.values().stream);
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

    /// When something is due. While the view is open scanning and CAN are halted (AXTC4CO manual, section 4.1.1).
    pub fn deadline(&self) -> Instant {
        let or_never = |due: Option<Instant>| due.unwrap_or(Instant::NEVER);
        let shown = or_never(self.row_at).min(or_never(self.page_at));
        if self.is_viewing() {
            return shown;
        }
        shown.min(self.measurement.deadline()).min(or_never(self.network.deadline()))
    }

    /// Does what is due: a reading first, so that a row of the same moment carries it.
    pub fn step(&mut self, board: &mut Board<'_>) {
        self.take_keys(board);
        let now = board.now;
        if !self.is_viewing() {
            self.network.step(now);
            if let Some(raised) = self.measurement.step(now, board.sensors, &mut self.objects, &mut self.errors) {
                self.row = None;
                self.react(&raised);
            }
        }
        if self.row_at.is_some_and(|due| due <= now) {
            let stream = board.parameters.values().stream;
            self.row_at = self.row_at.map(|due| due + stream.period());
            let objects = &self.objects;
            let row = self.row.take().unwrap_or_else(|| {
                let row = board.product.stream.emit(&measurement::row(objects, stream.source));
                row + self.dialect.line_end()
            });
            self.repeat(board, &row, ROW_BUFFER);
            self.row = Some(row);
        }
        if self.page_at.is_some_and(|due| due <= now) {
            self.page_at = self.page_at.map(|due| due + DIAGNOSTICS_PERIOD);
            let page = self.with_line_ends(self.dialect.diagnostics(&self.diagnosis(board)));
            self.repeat(board, &page, PAGE_BUFFER);
        }
    }

    /// Object 1029h: what errors that have become active do to the node's state.
    fn react(&mut self, raised: &[Emergency]) {
        for &error in raised {
            let class = Class::of(error, self.objects.product().measurement.sensors);
            let reaction = self.objects.integer(0x1029, class.sub_index());
            self.network.react(reaction);
        }
    }

    /// State of the CANopen node.
    pub fn network_state(&self) -> NetworkState {
        self.network.state()
    }

    /// The network orders something. While the view is open nobody listens.
    pub fn nmt(&mut self, board: &mut Board<'_>, command: NmtCommand) {
        if self.is_viewing() || matches!(self.dialogue, Dialogue::Leaving) {
            return;
        }
        self.network.command(board.now, command);
        match command {
            NmtCommand::ResetNode => {
                // The network does not wait for a terminal, which may have sent XOFF.
                board.uart.cut(board.now);
                self.dialogue = Dialogue::Leaving;
                *board.reset = Some(Reset::Start);
            }
            // Errata E-93, E-G4.
            NmtCommand::ResetCommunication => {
                self.objects.take_over(Group::Communication, &board.parameters.objects());
            }
            NmtCommand::Start | NmtCommand::Stop | NmtCommand::PreOperational => {}
        }
    }

    /// The network reads an entry.
    ///
    /// # Errors
    /// If nobody answers, or the entry cannot be read.
    pub fn read_object(&self, at: ObjectAddress) -> Result<Value, Refusal> {
        self.check_answers()?;
        self.objects.read(at).map_err(Refusal::Abort)
    }

    /// The network writes an entry; what that brings about has happened when this returns.
    ///
    /// # Errors
    /// If nobody answers, or the value is refused.
    pub fn write_object(&mut self, board: &mut Board<'_>, at: ObjectAddress, data: &[u8]) -> Result<(), Refusal> {
        self.check_answers()?;
        match self.objects.write(at, data).map_err(Refusal::Abort)? {
            Effect::None => {}
            Effect::Save(group) => board.parameters.save(board.stores, group, &self.objects),
            Effect::Restore(group) => board.parameters.restore(board.stores, group),
            Effect::ClearErrors => self.errors.clear_list(&mut self.objects),
        }
        Ok(())
    }

    /// A node that is stopped or whose view is open answers no SDO (CiA 301; section 4.1.1).
    fn check_answers(&self) -> Result<(), Refusal> {
        let silent = self.is_viewing()
            || matches!(self.dialogue, Dialogue::Leaving)
            || self.network.state() == NetworkState::Stopped;
        if silent { Err(Refusal::NoAnswer) } else { Ok(()) }
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

    /// Rows come at whole periods from now, but not before the first valid data.
    fn arm_stream(&mut self, board: &Board<'_>, stream: StreamSetting) {
        self.row = None;
        self.row_at = stream.on.then(|| self.measurement.first_data_at().max(board.now + stream.period()));
    }

    /// Goes on after the view, which was opened at this moment. What had not become valid by then is not printed yet: no
    /// measured values before the converters have settled (section 1.1; errata B-199, C-15).
    fn resume(&mut self, halted_at: Instant, now: Instant) {
        self.measurement.resume(halted_at, now);
        let first_data_at = self.measurement.first_data_at();
        self.network.resume(now.since(halted_at), first_data_at);
        for due in [&mut self.row_at, &mut self.page_at].into_iter().flatten() {
            *due = first_data_at.max(*due);
        }
    }

    /// A row or page: only while nothing else is asked or shown (errata E-117) and no more than `room` waits with it;
    /// otherwise it is dropped whole.
    fn repeat(&mut self, board: &mut Board<'_>, text: &str, room: usize) {
        if matches!(self.dialogue, Dialogue::Menu) && board.uart.backlog() + text.len() <= room {
            board.uart.send(board.now, text.as_bytes());
        }
    }

    fn is_viewing(&self) -> bool {
        matches!(self.dialogue, Dialogue::View { .. })
    }

    fn print_menu(&mut self, board: &mut Board<'_>) {
        let menu = self.dialect.menu(&self.identity, board.parameters.values(), self.network.state());
        self.say(board, &menu);
    }

    fn print(&mut self, board: &mut Board<'_>, sentence: Sentence) {
        let text = self.dialect.sentence(sentence);
        self.say(board, &text);
    }

    fn say_objects(&mut self, board: &mut Board<'_>, shown: impl Iterator<Item = &'static Object>) {
        let mut text = String::from("\r\n");
        for object in shown {
            text.push_str(&self.dialect.view_object(board.product, object, view::entries(object, &self.objects)));
        }
        self.say(board, &text);
    }

    fn echo(&mut self, board: &mut Board<'_>, bytes: &[u8]) {
        if self.dialect.echoes() {
            board.uart.send(board.now, bytes);
        }
    }

    fn say(&mut self, board: &mut Board<'_>, text: &str) {
        let text = self.with_line_ends(text.to_owned());
        board.uart.send(board.now, text.as_bytes());
    }

    fn with_line_ends(&self, text: String) -> String {
        if self.dialect.line_end() == "\r\n" { text } else { text.replace("\r\n", self.dialect.line_end()) }
    }
}
