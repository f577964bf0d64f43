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

use std::collections::VecDeque;

use super::super::flaw::Flaw;
use super::super::transmitter::Transmitter;
use super::pages::{self, Pages};
use super::records::{self, Outgoing, Size};
use crate::device::{PROGRAM_TIME, Pacing, RING, longest_erase};
use crate::endpoint::Transmit;
use crate::image::{FlashMap, Image};
use crate::time::{Duration, Instant};

/// How long behind the last character of a record that crosses into another page the loader's XOFF may take: an
/// adapter shows it 20 ms late at worst, a busy computer later still.
const HOLD_EXPECTED: Duration = Duration::from_millis(300);
/// How long behind the header the XOFF of a loader may take that was not expected to send one: the echo of the header's
/// text, and an adapter of 20 ms.
const HEADER_HOLD: Duration = Duration::from_millis(120);
/// How long behind a record the XON may take that says it is taken, if the loader shows otherwise that it is there:
/// words are programmed in 3 ms, but here the end of it is a failed upload, so a busy computer gets more time.
const ACKNOWLEDGED: Duration = Duration::from_millis(1000);
/// How long the loader may hold us. Writing a page takes it some 30 ms. Erasing all of its flash takes seconds, which
/// come on top.
const LONGEST_HOLD: Duration = Duration::from_secs(4);
/// The same, if nothing at all has been heard since the crossing before: a unit that lost its power is worth a moment,
/// and not one more record, since what comes back may be its menu.
const SIGN_OF_LIFE: Duration = Duration::from_millis(1500);
/// How long behind each record a hold may take while nobody knows where the loader stops its sender: an adapter of 20 ms
/// there and back, and a busy computer.
const WATCHED: Duration = Duration::from_millis(120);
/// Words that may leave, from the header on, without any sign of life: the largest pages of such parts have 512, and twice
/// that is looked at, the record that crosses included.
const MOST_UNHEARD: u32 = 1280;
/// Characters on their way to a ring of [`RING`] at most: six records of 32 data bytes, and 50 to spare for keys that
/// were pressed before. More than the 369 that a line carries in the 32 ms an adapter makes of the way there and back.
const WINDOW: usize = RING - 50;

/// Why a transfer cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stall {
    /// The loader has held us for [`LONGEST_HOLD`].
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

    /// The loader has sent XOFF (`true`) or XON.
    pub(super) fn hold(&mut self, now: Instant, held: bool) {
        self.unheard_words = 0;
        self.before = None;
        if self.pacing == Pacing::Pages && held && self.is_behind_the_header() {
            self.pacing = Pacing::Records;
        }
        match self.pacing {
            Pacing::Pages if self.sent == 0 => {}
            Pacing::Pages if held => {
                self.alive = true;
                if self.crossing.is_none() {
                    // Not where it was expected: its pages have another size, or the line made an XOFF of something.
                    self.watch();
                    self.crossing = Some(now);
                }
            }
            Pacing::Pages if self.crossing.is_none() => {}
            Pacing::Pages => {
                // XON alone will do: it comes when the page is written, and the XOFF may have been lost on the line.
                self.crossing = None;
                self.alive = false;
                self.acknowledged = true;
                self.see(true);
                self.take_all_sent();
            }
            Pacing::Records => {
                self.alive = true;
                if held && self.taken == 0 && self.sent == 1 {
                    self.choose_size(now);
                }
                let was_stopped = self.stopped_since.is_some();
                self.stopped_since = held.then(|| self.stopped_since.unwrap_or(now));
                // Only both together count: what is damaged on the line must not count twice.
                if was_stopped && !held {
                    self.alive = false;
                    self.acknowledged = true;
                    self.take_one();
                    self.proven |= self.taken == PROVEN;
                    // Behind a long hold the ring may have had more in it. It is empty now.
                    while self.left_at.front().is_some_and(|&left_at| left_at + HOLD_EXPECTED <= now) {
                        self.take_one();
                    }
                }
            }
        }
    }

    /// The hold behind the header shows how late an acknowledgement is, before any data has left.
    fn choose_size(&mut self, now: Instant) {
        let Some(&left_at) = self.left_at.front().filter(|_| self.size != Size::AsInFile) else { return };
        let late = now.since(left_at).as_nanos() / self.character_time.as_nanos().max(1);
        let late = usize::try_from(late).unwrap_or(usize::MAX);
        self.resize(Size::Packed(records::longest_acknowledged(WINDOW, late)));
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

    fn longest_hold(&self) -> Duration {
        if self.is_erasing() { self.longest_erase + LONGEST_HOLD } else { LONGEST_HOLD }
    }

    /// Until when an answer of the loader is awaited before the next record may go, if one is.
    fn waits_until(&self) -> Option<Instant> {
        match self.flaw {
            Some(Flaw::IgnoresHolds) => return None,
            Some(Flaw::EndsAtOnce) if self.sent + 1 == self.records.len() => return None,
            Some(_) | None => {}
        }
        match self.pacing {
            // The header may be what an unexpected g3 stops us behind; its ring is soon full.
            Pacing::Pages if self.sent == 1 && !self.header_passed => Some(*self.left_at.back()? + HEADER_HOLD),
            Pacing::Pages => match (self.crossing, &self.pages) {
                (Some(crossing), Pages::Watched { .. } | Pages::Unheld) => Some(crossing + WATCHED),
                (Some(crossing), Pages::Words(_)) => {
                    Some(crossing + if self.alive { HOLD_EXPECTED } else { SIGN_OF_LIFE })
                }
                // Success is reported for a page that is lost here, so the last data gets its time wherever it lies.
                (None, _) if self.sent + 1 == self.records.len() && !self.end_passed => {
                    Some(*self.left_at.back()? + WATCHED)
                }
                (None, _) => None,
            },
            Pacing::Records => {
                let &left_at = self.left_at.back()?;
                let next = self.records.get(self.sent)?;
                let on_their_way = records::characters(&self.records[self.taken..self.sent]);
                let is_end = self.sent + 1 == self.records.len();
                // The header and the first data have to show first that this loader answers.
                let fits = self.window.is_some_and(|window| on_their_way + next.text.len() <= window);
                let fits = fits && self.taken >= PROVEN && !is_end;
                (!fits).then(|| left_at + if self.alive { ACKNOWLEDGED } else { SIGN_OF_LIFE })
            }
        }
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

    /// The belief about pages is given up: where they end shows record by record from here on.
    fn watch(&mut self) {
        self.surprised = true;
        self.pages = Pages::watched();
        self.watched_from = self.sent;
    }

    /// Whether the loader has stopped us behind the record let go last, which was alone on its way.
    fn see(&mut self, held: bool) {
        let last = self.sent.saturating_sub(1);
        if last >= self.watched_from
            && let Some(words) = &self.records[last].words
        {
            self.pages.seen(self.last_word(last), words, held);
        }
    }

    /// The last word of the data before a record.
    fn last_word(&self, record: usize) -> Option<u32> {
        self.records[..record].iter().rev().find_map(|record| Some(*record.words.as_ref()?.end()))
    }

    /// Whether the loader has done as the product's file says.
    fn is_believed(&self) -> bool {
        matches!(self.pages, Pages::Words(_))
    }

    /// Whether a hold can only be the one behind the header: no page can have been full since.
    fn is_behind_the_header(&self) -> bool {
        self.sent > 0
            && self.taken == 0
            && self.crossing.is_none()
            && pages::fit_any_page(self.records[..self.sent].iter().filter_map(|record| record.words.as_ref()))
    }

    fn take_one(&mut self) {
        if self.left_at.pop_front().is_some() {
            self.bytes_taken += self.records[self.taken].text.len();
            self.taken += 1;
        }
    }

    /// No XOFF came where one should have. A loader of another kind may do without, if it shows in another way that it
    /// is there.
    fn pass_unheld(&mut self) -> Result<(), Stall> {
        match self.pacing {
            // G1 says nothing behind the header.
            Pacing::Records if self.taken == 0 && !self.again => {
                self.pacing = Pacing::Pages;
                self.resize(believed_size(self.size != Size::AsInFile, self.pacing));
            }
            // That proves nothing: it may not have come.
            Pacing::Pages if self.sent == 1 => {
                self.header_passed = true;
                return Ok(());
            }
            // The header was acknowledged, and the first data is not: a g3 may have lost it, or a hold behind the header
            // was something else. The second time round it was something else.
            Pacing::Records if self.taken < PROVEN && !self.again => {
                self.start_over();
                return Ok(());
            }
            Pacing::Records if self.taken < PROVEN && !self.proven => {
                self.pacing = Pacing::Pages;
                self.header_passed = true;
                self.watch();
            }
            Pacing::Pages if self.crossing.is_none() => {
                self.end_passed = true;
                return Ok(());
            }
            Pacing::Pages if self.unheard_words < MOST_UNHEARD && !(self.acknowledged && self.is_believed()) => {
                // Its pages may be larger than believed, and it has nothing to say before the first one is full.
                match self.pages {
                    Pages::Words(_) if self.alive => {}
                    Pages::Words(_) => self.watch(),
                    Pages::Watched { .. } | Pages::Unheld => self.see(false),
                }
            }
            _ if !self.alive => return Err(Stall::Silent),
            Pacing::Records if self.again => return Err(Stall::Unacknowledged),
            Pacing::Records => {
                self.start_over();
                return Ok(());
            }
            Pacing::Pages => {}
        }
        self.crossing = None;
        self.alive = false;
        self.take_all_sent();
        Ok(())
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

/// Records that have to be acknowledged one by one before more than one is on its way: the header, and the first data.
const PROVEN: usize = 2;
