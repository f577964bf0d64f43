//! Sending an image to a loader: never more records on their way than it can keep, and its flow control awaited where
//! it must come.
//!
//! How to send depends on how the loader stops its sender, known from the loaders' public sources (`device::Pacing`):
//!
//! - Generation `g1` keeps one page of 256 words. A record whose data crosses into another page is parked, XOFF goes
//!   out, and after 0.6 ms of silence the old page is written, during which the loader is deaf; XON says that it
//!   listens again. A second record in the meantime is an overrun, and at the end record a parked one is lost while
//!   success is reported. So after each record that crosses, and before the end record, the sender waits for XON.
//! - Generation `g3` has a ring of some 550 characters without an overrun check. It stops us after every record and
//!   lets us go on when the ring is empty, so each XOFF with its XON acknowledges one record. No more than [`WINDOW`]
//!   characters are on their way unacknowledged, so the ring cannot overflow however late an adapter shows a hold.
//!   After the header, while all of the flash is erased, nothing leaves until it is acknowledged, and the end record
//!   leaves only when all before it are. A missing acknowledgement has three possible causes: the record was lost, its
//!   acknowledgement was, or a loader that writes more slowly than the line took two records in one hold. Which record
//!   it was cannot be told, so everything is sent once more from the header on, one record at a time.
//!
//! An adapter may show an XOFF late (16 ms are 184 characters). With either generation that does no harm, since the
//! XOFF is awaited, not reacted to. Which generation a unit has is assumed, not known. A loader that stops us after the
//! header is a g3, whatever the product's file says; one that stops us neither there nor after the first data is sent
//! to as a g1. How many words a page has is assumed as well: see `pages.rs`.

mod holds;
mod way;

pub(super) use way::Reached;

use super::super::flaw::Flaw;
use super::super::transmitter::Transmitter;
use super::pages::Pages;
use super::records::{self, Size};
use crate::device::{PROGRAM_TIME, Pacing, RING, longest_erase};
use crate::endpoint::Transmit;
use crate::image::{FlashMap, Image};
use crate::time::{Duration, Instant};
use holds::{Pace, Paging};
use way::Way;

/// Most characters on their way to a ring of [`RING`]: six records of 32 data bytes. 50 are left for keys pressed
/// before. The line carries 369 in the 32 ms that an adapter of 16 ms takes there and back, so it need not stand still.
const WINDOW: usize = RING - 50;

/// Why a transfer cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stall {
    /// The loader has held us for too long.
    Held,
    /// Nothing has been heard since the wait before this one, or since a record was taken.
    Silent,
    /// A record that was alone on its way has not been acknowledged, though others were: it may be lost.
    Unacknowledged,
}

/// An image on its way.
#[derive(Debug)]
pub(super) struct Transfer {
    image: Image,
    flaw: Option<Flaw>,
    packed: bool,
    /// How the loader paces its sender, and how many words its pages have, as assumed from the product's file.
    believed: (Pacing, u32),
    size: Size,
    way: Way,
    pace: Pace,
    /// An XON has acknowledged a record. `false` proves nothing: the XON may have been lost.
    acknowledged: bool,
    /// Something has been heard since the last wait for the loader, or since the last record was taken.
    alive: bool,
    /// Words let go without a sign of life.
    unheard_words: u32,
    /// Everything is being sent once more, one record at a time.
    again: bool,
    /// How far the first pass had come, as long as the loader has not answered the second. It may be without power, and
    /// what it had taken stays in its flash until it erases.
    before: Option<Reached>,
    /// How long the loader may erase after the header.
    longest_erase: Duration,
    /// A loader with a ring writes each record before the next one has come, and acknowledges it alone. On a line of
    /// megabauds it takes two in one hold.
    writes_in_time: bool,
    begun: Option<Instant>,
    deadline: Option<Instant>,
    /// How long a character takes on the line.
    character_time: Duration,
}

impl Transfer {
    /// A transfer of this image to this flash. `packed`: in records as long as the loader can keep, instead of the
    /// file's.
    pub(super) fn new(image: &Image, flash: &FlashMap, pacing: Pacing, packed: bool, flaw: Option<Flaw>) -> Self {
        let size = believed_size(packed, pacing);
        Transfer {
            image: image.clone(),
            flaw,
            packed,
            believed: (pacing, flash.page_words),
            size,
            way: Way::of(records::build(image, size, line_end(flaw))),
            pace: Pace::believed(pacing, flash.page_words),
            acknowledged: false,
            alive: false,
            unheard_words: 0,
            again: false,
            before: None,
            longest_erase: longest_erase(flash),
            writes_in_time: true,
            begun: None,
            deadline: None,
            character_time: Duration::ZERO,
        }
    }

    /// Lets go the records that may go now. Returns `Ok(true)` once the end record has been let go.
    ///
    /// # Errors
    /// If the loader holds us for too long, seems to be gone, or has not acknowledged a record.
    pub(super) fn advance(&mut self, now: Instant, transmitter: &mut Transmitter) -> Result<bool, Stall> {
        if self.begun.is_none() {
            self.begun = Some(now);
            self.character_time = transmitter.time_for(1);
            self.writes_in_time = transmitter.time_for(DATA_CHARACTERS) > PROGRAM_TIME * DATA_WORDS * 2;
        }
        if let Some(since) = transmitter.held_since().or(self.pace.stopped_since()) {
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
        while self.way.sent < self.way.records.len() && transmitter.is_empty() {
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
        if self.way.sent == self.way.records.len() {
            return Ok(true);
        }
        self.deadline = Some(transmitter.ready_at().max(now + Duration::from_micros(100)));
        Ok(false)
    }

    /// Rebuilds the records in this size. Only the header may have left, which is the same in any size.
    fn resize(&mut self, size: Size) {
        if size != self.size {
            self.size = size;
            self.way.replace(records::build(&self.image, size, line_end(self.flaw)));
        }
    }

    /// The loader has printed something.
    pub(super) fn heard(&mut self) {
        self.alive = true;
        self.unheard_words = 0;
    }

    /// Whether the loader has stopped us where it was not expected to, or has not stopped us where it was.
    pub(super) fn is_surprised(&self) -> bool {
        matches!(&self.pace, Pace::Pages(paging) if paging.surprise().is_some())
    }

    /// Whether sending record by record may help against an overrun: a loader that keeps pages of another size than
    /// assumed gets records while it has no place for them.
    pub(super) fn may_go_slower(&self) -> bool {
        matches!(self.pace, Pace::Pages(_)) && !self.again
    }

    /// How the loader differs from what was assumed of it.
    pub(super) fn remark(&self) -> Option<String> {
        let Pace::Pages(paging) = &self.pace else { return None };
        let believed = self.believed.1;
        let words = match paging.surprise()? {
            Pages::Words(words) if *words == believed => return None,
            Pages::Words(words) => format!("pages of {words} words"),
            Pages::Watched { .. } => "pages of unknown size".into(),
            Pages::Unheld => return Some("the loader stops its sender nowhere (XOFF)".into()),
        };
        let twice = if self.again { "; everything was sent twice" } else { "" };
        Some(format!("the loader keeps {words}, and not of {believed} as assumed{twice}"))
    }

    /// Whether nothing shows yet that the loader has taken any data.
    pub(super) fn has_hardly_begun(&self) -> bool {
        self.way.taken <= 1
    }

    /// Starts over from the header, as if nothing had been sent. What was learnt of the loader's pace is forgotten: the
    /// loader was still answering an earlier key, so the absence of a hold proved nothing.
    pub(super) fn begin_again(&mut self) {
        self.start_over();
        (self.again, self.before) = (false, None);
        let (pacing, page_words) = self.believed;
        self.pace = Pace::believed(pacing, page_words);
        self.resize(believed_size(self.packed, pacing));
    }

    /// Starts over from the header, assuming nothing about pages.
    pub(super) fn start_over_slowly(&mut self) {
        self.start_over();
        // The loader has just prompted, so it has power.
        self.before = None;
        self.pace = Pace::Pages(Paging::watched(self.way.sent));
    }

    /// Whether the loader has shown by its flow control that it takes the records.
    pub(super) fn is_taken(&self) -> bool {
        self.acknowledged || self.pace.stopped_since().is_some()
    }

    /// Whether the loader must be erasing all of its flash.
    pub(super) fn is_erasing(&self) -> bool {
        self.way.taken == 0 && self.pace.stopped_since().is_some()
    }

    /// Whether this loader, if it has lost its place in a record, waits in silence for the rest of it.
    pub(super) fn may_wait_in_a_record(&self) -> bool {
        matches!(self.pace, Pace::Ring(_)) && self.way.sent > 0
    }

    /// The loader must have taken everything that has been sent.
    pub(super) fn take_all_sent(&mut self) {
        self.way.take_all();
        self.before = None;
    }

    /// When to call [`advance`](Transfer::advance) next.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    /// How far the transfer has come; that of the first pass as long as the loader has not answered the second.
    pub(super) fn reached(&self) -> Reached {
        self.before.unwrap_or_else(|| self.way.reached())
    }

    /// Records and characters in all.
    pub(super) fn total(&self) -> (usize, usize) {
        (self.way.records.len(), self.way.bytes_total)
    }

    /// Whether [`reached`](Transfer::reached) is about the second pass.
    pub(super) fn is_again(&self) -> bool {
        self.again && self.before.is_none()
    }

    /// Address of the data record let go last.
    pub(super) fn address(&self) -> Option<u32> {
        self.way.records[..self.reached().sent].iter().rev().find_map(|record| Some(*record.words.as_ref()?.start()))
    }

    /// When the first record was let go.
    pub(super) fn begun(&self) -> Option<Instant> {
        self.begun
    }

    /// Lets the next record go.
    fn let_go(&mut self, now: Instant, transmitter: &mut Transmitter) {
        let record = &self.way.records[self.way.sent];
        // The piece is let go in this same step, so it is on the line right after what was let go before.
        let left_at = transmitter.free_at().max(now) + transmitter.time_for(record.text.len());
        transmitter.push_piece(Transmit::open(record.text.clone()));
        if let Some(words) = &record.words {
            self.unheard_words += words.clone().count() as u32;
            if let Pace::Pages(paging) = &mut self.pace {
                paging.let_go(self.believed.1, self.way.last_word(self.way.sent), words, left_at);
            }
        }
        self.way.let_go(left_at);
    }

    /// Starts over from the header, one record at a time.
    fn start_over(&mut self) {
        self.before = Some(self.reached());
        self.again = true;
        self.way.start_over();
        self.alive = false;
        self.unheard_words = 0;
    }
}

/// Data bytes of the records for a loader that is assumed to have this pacing. How late its acknowledgements come shows
/// only after the header; up to half of [`WINDOW`] that makes no difference.
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

/// Data words of a record as compilers write them.
const DATA_WORDS: u32 = 16;
/// Characters of such a record with its line end.
const DATA_CHARACTERS: usize = 79;
