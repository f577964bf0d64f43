//! Sending an image to a loader: records built anew, never more on their way than it can keep, flow control awaited where
//! it must come.
//!
//! What decides how to send is in the public sources of the loaders, as profiles (`device::Pacing`):
//!
//! - Generation `g1` keeps one page of 256 words. A record whose data crosses into another page is parked, XOFF goes out,
//!   and after 0.6 ms of silence the old page is written, during which the loader is deaf; XON says that it listens
//!   again. A second record in the meantime is an overrun, and at the end record a parked one is lost while success is
//!   reported. So behind each record that crosses, and before the end record, the sender waits for XON.
//! - Generation `g3` has a ring of some 550 characters without an overrun check. It stops us behind every record and lets
//!   us go on when the ring is empty, so each XOFF with its XON says that one more record has been taken. No more than
//!   [`WINDOW`] characters are on their way without that, so the ring cannot overflow whatever an adapter shows late; and
//!   behind the header, while all of the flash is erased, and before the end record nothing is. Should an
//!   acknowledgement be missing, a record is lost, or its acknowledgement is, or the loader has taken two in one hold, as
//!   it does if it writes more slowly than the line is. Nobody can say which record it was, so everything is sent once
//!   more from the header on, one record at a time.
//!
//! That the XOFF may be shown late by an adapter (16 ms are 184 characters) does not matter either way: it is awaited,
//! not reacted to. Which generation a unit has is believed, not known. A loader that stops us behind the header is a g3
//! whatever the product's file says, and one that stops us neither there nor behind the first data is sent to as a g1.
//! How many words a page has is believed as well: see [`Pages`].

mod holds;

use std::collections::VecDeque;

use super::super::flaw::Flaw;
use super::super::transmitter::Transmitter;
use super::pages::Pages;
use super::records::{self, Outgoing, Size};
use crate::device::{PROGRAM_TIME, Pacing, RING, longest_erase};
use crate::endpoint::Transmit;
use crate::image::{FlashMap, Image};
use crate::time::{Duration, Instant};

/// Characters on their way to a ring of [`RING`] at most: six records of 32 data bytes, and 50 to spare for keys that
/// were pressed before. More than the 369 that a line carries in the 32 ms an adapter makes of the way there and back.
const WINDOW: usize = RING - 50;

/// Why a transfer cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stall {
    /// The loader has held us for too long.
    Held,
    /// Nothing has been heard since the record before.
    Silent,
    /// A record that was alone on its way has not been acknowledged, though the loader did so before: it may be lost.
    Unacknowledged,
}

/// How far a transfer has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reached {
    /// Records let go, header and end included.
    pub(super) sent: usize,
    /// Records the loader must have taken.
    pub(super) taken: usize,
    /// Their characters.
    pub(super) bytes_taken: usize,
}

/// An image on its way.
#[derive(Debug)]
pub(super) struct Transfer {
    image: Image,
    size: Size,
    flaw: Option<Flaw>,
    records: Vec<Outgoing>,
    bytes_total: usize,
    /// Records let go.
    sent: usize,
    /// Records the loader must have taken.
    taken: usize,
    bytes_taken: usize,
    /// When the last character has left of each record let go and not taken.
    left_at: VecDeque<Instant>,
    pacing: Pacing,
    /// Characters on their way to a ring at most. None: one record at a time.
    window: Option<usize>,
    /// The header and the first data have been acknowledged, each by a hold of its own: only a loader with a ring does so.
    proven: bool,
    /// Flow control has shown that something was taken: that nothing came where it was awaited shows nothing.
    acknowledged: bool,
    /// No hold came behind the header where none was expected.
    header_passed: bool,
    /// Nor behind the last data.
    end_passed: bool,
    /// Words of a page by the product's file.
    believed: u32,
    /// Where a loader that keeps a page stops us.
    pages: Pages,
    /// It has done so elsewhere than believed.
    surprised: bool,
    /// Records before this one left before the loader was watched.
    watched_from: usize,
    /// Words let go without a sign of life.
    unheard_words: u32,
    /// Everything is being sent once more.
    again: bool,
    /// How far it had come the first time, as long as nobody has answered the second: a unit without power takes no header
    /// either, and what was taken stays taken until the loader erases it.
    before: Option<Reached>,
    /// Since when a loader that stops us behind every record does so. The transmitter's own knowledge will not do: it
    /// takes a header that names a unit, and is echoed, for a unit that starts and has forgotten that it stopped us.
    stopped_since: Option<Instant>,
    /// How long it may erase behind the header.
    longest_erase: Duration,
    /// Behind a record that the loader may stop us behind: when its last character has left.
    crossing: Option<Instant>,
    /// Something has been heard since the crossing before, or since the record taken last.
    alive: bool,
    begun: Option<Instant>,
    deadline: Option<Instant>,
    /// How long a character takes on the line.
    character_time: Duration,
}

impl Transfer {
    /// An image for this flash. `packed`: in records as long as the loader can keep, instead of the file's.
    pub(super) fn new(image: &Image, flash: &FlashMap, pacing: Pacing, packed: bool, flaw: Option<Flaw>) -> Self {
        let size = believed_size(packed, pacing);
        let records = records::build(image, size, line_end(flaw));
        let bytes_total = records::characters(&records);
        Transfer {
            image: image.clone(),
            size,
            flaw,
            records,
            bytes_total,
            sent: 0,
            taken: 0,
            bytes_taken: 0,
            left_at: VecDeque::new(),
            pacing,
            window: Some(WINDOW),
            proven: false,
            acknowledged: false,
            header_passed: false,
            end_passed: false,
            believed: flash.page_words,
            pages: Pages::Words(flash.page_words),
            surprised: false,
            watched_from: 0,
            unheard_words: 0,
            again: false,
            before: None,
            stopped_since: None,
            longest_erase: longest_erase(flash),
            crossing: None,
            alive: false,
            begun: None,
            deadline: None,
            character_time: Duration::ZERO,
        }
    }

    /// Lets go what may go now. Gives `Ok(true)` once the end record has been let go.
    ///
    /// # Errors
    /// If the loader holds us too long, or nobody seems to be there.
    pub(super) fn advance(&mut self, now: Instant, transmitter: &mut Transmitter) -> Result<bool, Stall> {
        if self.begun.is_none() {
            self.begun = Some(now);
            self.character_time = transmitter.time_for(1);
            // Where a record is written more slowly than it comes, two would be taken in one hold.
            let writing = PROGRAM_TIME * DATA_WORDS;
            self.window = (transmitter.time_for(DATA_CHARACTERS) > writing * 2).then_some(WINDOW);
        }
        self.deadline = None;
        if let Some(since) = transmitter.held_since().or(self.stopped_since) {
            let limit = since + self.longest_hold();
            self.deadline = Some(limit);
            return if limit <= now { Err(Stall::Held) } else { Ok(false) };
        }
        if let Some(limit) = self.waits_until() {
            if now < limit {
                self.deadline = Some(limit);
                return Ok(false);
            }
            self.pass_unheld()?;
        }
        while self.sent < self.records.len() && transmitter.is_empty() {
            if transmitter.ready_at() > now {
                self.deadline = Some(transmitter.ready_at());
                return Ok(false);
            }
            self.let_go(now, transmitter);
            if let Some(limit) = self.waits_until() {
                self.deadline = Some(limit);
                return Ok(false);
            }
        }
        if self.sent == self.records.len() {
            return Ok(true);
        }
        self.deadline = Some(transmitter.ready_at().max(now + Duration::from_micros(100)));
        Ok(false)
    }

    /// Builds the records anew. Nothing but the header may have left, which is the same in any size.
    fn resize(&mut self, size: Size) {
        if size != self.size {
            self.size = size;
            self.records = records::build(&self.image, size, line_end(self.flaw));
            self.bytes_total = records::characters(&self.records);
        }
    }

    /// The loader has printed something.
    pub(super) fn heard(&mut self) {
        self.alive = true;
        self.unheard_words = 0;
    }

    /// Whether it has stopped us where it was not expected to, or has not where it was.
    pub(super) fn is_surprised(&self) -> bool {
        self.surprised
    }

    /// Whether sending record by record may help against an overrun: a loader that keeps pages of another size than
    /// believed gets records while it has no place for them.
    pub(super) fn may_go_slower(&self) -> bool {
        self.pacing == Pacing::Pages && !self.again
    }

    /// How the loader differs from what was believed of it.
    pub(super) fn remark(&self) -> Option<String> {
        let words = match (self.surprised, self.pacing, &self.pages) {
            (true, Pacing::Pages, Pages::Words(words)) => format!("pages of {words} words"),
            (true, Pacing::Pages, Pages::Watched { .. }) => "pages of unknown size".into(),
            (true, Pacing::Pages, Pages::Unheld) => return Some("the loader stops its sender nowhere (XOFF)".into()),
            (false, _, _) | (true, Pacing::Records, _) => return None,
        };
        let twice = if self.again { "; everything was sent twice" } else { "" };
        (self.pages != Pages::Words(self.believed))
            .then(|| format!("the loader keeps {words}, and not of {} as believed{twice}", self.believed))
    }

    /// Whether nothing shows yet that the loader has taken any data.
    pub(super) fn has_hardly_begun(&self) -> bool {
        self.taken <= 1
    }

    /// From the header on, as if nothing had been sent.
    pub(super) fn begin_again(&mut self) {
        self.start_over();
        (self.again, self.proven, self.window, self.before) = (false, false, Some(WINDOW), None);
        (self.header_passed, self.crossing, self.stopped_since) = (false, None, None);
    }

    /// Everything once more from the header on, with no belief about pages.
    pub(super) fn start_over_slowly(&mut self) {
        self.start_over();
        self.watch();
        // The loader has asked for it.
        self.before = None;
        self.header_passed = false;
        self.end_passed = false;
        self.crossing = None;
        self.stopped_since = None;
    }

    /// Whether the loader has shown by its flow control that it takes the records.
    pub(super) fn is_taken(&self) -> bool {
        self.acknowledged || self.stopped_since.is_some()
    }

    /// Whether the loader must be erasing all of its flash.
    pub(super) fn is_erasing(&self) -> bool {
        self.taken == 0 && self.stopped_since.is_some()
    }

    /// Whether a loader that has lost its place in a record waits in silence for the rest of it.
    pub(super) fn may_wait_in_a_record(&self) -> bool {
        self.pacing == Pacing::Records && self.sent > 0
    }

    /// The loader has said that it is through.
    pub(super) fn take_all_sent(&mut self) {
        self.bytes_taken += records::characters(&self.records[self.taken..self.sent]);
        self.taken = self.sent;
        self.before = None;
        self.left_at.clear();
    }

    /// When [`advance`](Transfer::advance) is wanted.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    /// How far it has come; the first time, as long as nobody has answered the second.
    pub(super) fn reached(&self) -> Reached {
        self.before.unwrap_or_else(|| self.reached_now())
    }

    /// Records and characters in all.
    pub(super) fn total(&self) -> (usize, usize) {
        (self.records.len(), self.bytes_total)
    }

    /// Whether what it has [`reached`](Transfer::reached) is that of a second time.
    pub(super) fn is_again(&self) -> bool {
        self.again && self.before.is_none()
    }

    /// Address of the data record let go last.
    pub(super) fn address(&self) -> Option<u32> {
        self.records[..self.reached().sent].iter().rev().find_map(|record| Some(*record.words.as_ref()?.start()))
    }

    /// When the first record was let go.
    pub(super) fn begun(&self) -> Option<Instant> {
        self.begun
    }

    fn reached_now(&self) -> Reached {
        Reached { sent: self.sent, taken: self.taken, bytes_taken: self.bytes_taken }
    }

    /// Lets the next record go.
    fn let_go(&mut self, now: Instant, transmitter: &mut Transmitter) {
        let record = &self.records[self.sent];
        if let Some(words) = &record.words {
            self.unheard_words += words.clone().count() as u32;
        }
        // The piece is let go in this same step, so it leaves behind what has been let go before.
        let left_at = transmitter.free_at().max(now) + transmitter.time_for(record.text.len());
        transmitter.push_piece(Transmit::open(record.text.clone()));
        self.left_at.push_back(left_at);
        let may_hold = record
            .words
            .as_ref()
            .is_some_and(|words| self.pages.may_hold(self.believed, self.last_word(self.sent), words));
        if may_hold && self.pacing == Pacing::Pages {
            self.crossing = Some(left_at);
        }
        self.sent += 1;
    }

    /// From the header on, one record at a time.
    fn start_over(&mut self) {
        self.before = Some(self.reached());
        self.again = true;
        self.window = None;
        (self.sent, self.taken, self.bytes_taken) = (0, 0, 0);
        self.left_at.clear();
        self.alive = false;
        self.unheard_words = 0;
    }

    /// The last word of the data before a record.
    fn last_word(&self, record: usize) -> Option<u32> {
        self.records[..record].iter().rev().find_map(|record| Some(*record.words.as_ref()?.end()))
    }
}

/// Data bytes of the records for a loader that is believed to have this pacing. How late its acknowledgements are shows
/// only behind the header; the adapters in use make no difference.
pub(super) fn believed_size(packed: bool, pacing: Pacing) -> Size {
    match (packed, pacing) {
        (false, _) => Size::AsInFile,
        (true, Pacing::Pages) => Size::Packed(records::LONGEST),
        (true, Pacing::Records) => Size::Packed(records::longest_acknowledged(WINDOW, 0)),
    }
}

fn line_end(flaw: Option<Flaw>) -> &'static [u8] {
    if flaw == Some(Flaw::SendsCrLf) { b"\r\n" } else { records::LINE_END }
}

/// Data words of a record as compilers write them, and its characters with the line end.
const DATA_WORDS: u32 = 16;
/// See [`DATA_WORDS`].
const DATA_CHARACTERS: usize = 79;
