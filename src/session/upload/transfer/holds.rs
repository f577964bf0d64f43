//! What a loader's flow control shows: what is awaited after each record, what a hold (XOFF, then XON) proves, and what
//! follows if none comes.

use std::ops::RangeInclusive;

use super::super::super::flaw::Flaw;
use super::super::pages;
use super::super::records;
use super::way::Way;
use super::{Pages, Size, Stall, Transfer, WINDOW, believed_size};
use crate::device::Pacing;
use crate::time::{Duration, Instant};

/// How long the loader's XOFF may take after the last character of a record that crosses into another page. An adapter
/// shows it 20 ms late at worst, a busy computer later still.
const HOLD_EXPECTED: Duration = Duration::from_millis(300);
/// How long after the header to wait for the XOFF of a loader that is not expected to send one: time for the echo of
/// the header's text, and for an adapter of 20 ms.
const HEADER_HOLD: Duration = Duration::from_millis(120);
/// How long the XON that acknowledges a record may take, if the loader has been heard since it took one. The words are
/// programmed in 3 ms, but if this time runs out the upload may fail, so a busy computer gets more.
const ACKNOWLEDGED: Duration = Duration::from_millis(1000);
/// How long the loader may hold us. Writing a page takes it some 30 ms. The time for erasing all of its flash is added
/// to this.
const LONGEST_HOLD: Duration = Duration::from_secs(4);
/// Replaces [`HOLD_EXPECTED`] and [`ACKNOWLEDGED`] if nothing at all has been heard since the wait before. The unit may
/// have lost its power: it gets this longer moment, but not one more record, since it may come back with its menu.
const SIGN_OF_LIFE: Duration = Duration::from_millis(1500);
/// How long after each record to wait for a hold while it is not known where the loader stops its sender: time for an
/// adapter of 20 ms there and back, and for a busy computer.
const WATCHED: Duration = Duration::from_millis(120);
/// Words that may leave without any sign of life from the loader. The largest pages of such parts have 512 words:
/// this covers two of them, and the record that crosses into the next.
const MOST_UNHEARD: u32 = 1280;
/// Records that have to be acknowledged one by one before more than one may be on its way: the header, and the first
/// data.
const PROVEN: usize = 2;

/// How the loader stops its sender, as far as is known, and what has been seen of that. The product's file gives the
/// first guess; holds that come, or do not come, correct it.
#[derive(Debug)]
pub(super) enum Pace {
    /// It stops us where data crosses into another page.
    Pages(Paging),
    /// It stops us after every record.
    Ring(Ring),
}

/// What has been seen of a loader that keeps one page.
#[derive(Debug)]
pub(super) struct Paging {
    /// Where it stops us.
    pages: Pages,
    /// It has stopped us elsewhere than assumed, or has not stopped us where it should have.
    surprised: bool,
    /// Number of the first record after which the loader is watched. What it did after earlier ones is ignored.
    watched_from: usize,
    /// Set if the loader may stop us, or has, after the record let go last: when its last character has left the line.
    crossing: Option<Instant>,
}

/// What has been seen of a loader with a ring.
#[derive(Debug, Default)]
pub(super) struct Ring {
    /// The header and the first data have each been acknowledged by a hold: only a loader with a ring does so.
    proven: bool,
    /// Since when the loader has been stopping us. The transmitter cannot be asked: if the loader echoes a header that
    /// names a unit, the session takes that for the banner of a unit that has restarted, and releases the transmitter.
    stopped_since: Option<Instant>,
}

impl Pace {
    /// What the product's file says, before anything has been seen.
    pub(super) fn believed(pacing: Pacing, page_words: u32) -> Self {
        match pacing {
            Pacing::Pages => Pace::Pages(Paging::believed(page_words)),
            Pacing::Records => Pace::Ring(Ring::default()),
        }
    }

    /// Since when a loader with a ring has been stopping us.
    pub(super) fn stopped_since(&self) -> Option<Instant> {
        match self {
            Pace::Pages(_) => None,
            Pace::Ring(ring) => ring.stopped_since,
        }
    }
}

impl Paging {
    /// Assumes pages of this many words.
    fn believed(page_words: u32) -> Self {
        Paging { pages: Pages::Words(page_words), surprised: false, watched_from: 0, crossing: None }
    }

    /// Assumes nothing about pages. `record`: the next one to be let go, from which on the loader is watched.
    pub(super) fn watched(record: usize) -> Self {
        Paging { pages: Pages::watched(), surprised: true, watched_from: record, ..Paging::believed(0) }
    }

    /// A record of these words is let go; `before` is the last word before them. `believed`: words of a page as
    /// assumed.
    pub(super) fn let_go(&mut self, believed: u32, before: Option<u32>, words: &RangeInclusive<u32>, left_at: Instant) {
        if self.pages.may_hold(believed, before, words) {
            self.crossing = Some(left_at);
        }
    }

    /// Where the loader stops us, if that is not where it was assumed to.
    pub(super) fn surprise(&self) -> Option<&Pages> {
        self.surprised.then_some(&self.pages)
    }

    /// Gives up the assumption about pages: from here on the loader is watched record by record.
    fn watch(&mut self, way: &Way) {
        self.surprised = true;
        self.pages = Pages::watched();
        self.watched_from = way.sent;
    }

    /// Notes whether the loader has stopped us (`held`) after the record let go last, which was alone on its way.
    fn see(&mut self, way: &Way, held: bool) {
        let last = way.sent.saturating_sub(1);
        if last >= self.watched_from
            && let Some(words) = &way.records[last].words
        {
            self.pages.seen(way.last_word(last), words, held);
        }
    }

    /// Whether the size of a page counts as known: the assumption still holds, or the holds have shown another size.
    fn is_as_believed(&self) -> bool {
        matches!(self.pages, Pages::Words(_))
    }

    /// Until when a hold is awaited before the next record may go, if one is awaited.
    fn waits_until(&self, way: &Way, alive: bool) -> Option<Instant> {
        // This may be a g3 after all, which stops us after the header. Without waiting, its ring would soon be full.
        if way.sent == 1 {
            return Some(*way.left_at.back()? + HEADER_HOLD);
        }
        match (self.crossing, &self.pages) {
            (Some(crossing), Pages::Watched { .. } | Pages::Unheld) => Some(crossing + WATCHED),
            (Some(crossing), Pages::Words(_)) => Some(crossing + if alive { HOLD_EXPECTED } else { SIGN_OF_LIFE }),
            // A page that is lost here is reported as loaded, so a hold after the last data is awaited wherever that
            // lies.
            (None, _) if way.is_before_the_end() => Some(*way.left_at.back()? + WATCHED),
            (None, _) => None,
        }
    }
}

impl Transfer {
    /// The loader has sent XOFF (`true`) or XON.
    pub(in crate::session::upload) fn hold(&mut self, now: Instant, held: bool) {
        self.unheard_words = 0;
        self.before = None;
        if held && self.is_stopped_after_the_header() {
            self.pace = Pace::Ring(Ring::default());
        }
        match self.pace {
            Pace::Pages(_) if self.way.sent == 0 => {}
            Pace::Pages(_) => self.hold_of_a_page(now, held),
            Pace::Ring(_) => self.hold_of_a_record(now, held),
        }
    }

    fn hold_of_a_page(&mut self, now: Instant, held: bool) {
        let Pace::Pages(paging) = &mut self.pace else { return };
        match (held, paging.crossing) {
            (true, crossing) => {
                self.alive = true;
                if crossing.is_none() {
                    // Not where it was expected: the pages have another size, or the line has damaged a character.
                    paging.watch(&self.way);
                    paging.crossing = Some(now);
                }
            }
            (false, None) => {}
            (false, Some(_)) => {
                // XON alone is enough: it comes when the page is written, and the XOFF may have been lost on the line.
                paging.crossing = None;
                paging.see(&self.way, true);
                self.alive = false;
                self.acknowledged = true;
                self.take_all_sent();
            }
        }
    }

    fn hold_of_a_record(&mut self, now: Instant, held: bool) {
        if held && self.way.taken == 0 && self.way.sent == 1 {
            self.choose_size(now);
        }
        let Pace::Ring(ring) = &mut self.pace else { return };
        self.alive = true;
        let was_stopped = ring.stopped_since.is_some();
        ring.stopped_since = held.then(|| ring.stopped_since.unwrap_or(now));
        // Only an XOFF with its XON counts, so that damage on the line does not make two acknowledgements of one.
        if was_stopped && !held {
            self.alive = false;
            self.acknowledged = true;
            self.way.take_one();
            ring.proven |= self.way.taken == PROVEN;
            // XON says that the ring is empty: records that had long left the line have been taken as well.
            while self.way.left_at.front().is_some_and(|&left_at| left_at + HOLD_EXPECTED <= now) {
                self.way.take_one();
            }
        }
    }

    /// The hold after the header shows how late acknowledgements come: chooses the size of packed records by that,
    /// before any data has left.
    fn choose_size(&mut self, now: Instant) {
        let Some(&left_at) = self.way.left_at.front().filter(|_| self.packed) else { return };
        let late = now.since(left_at).as_nanos() / self.character_time.as_nanos().max(1);
        let late = usize::try_from(late).unwrap_or(usize::MAX);
        self.resize(Size::Packed(records::longest_acknowledged(WINDOW, late)));
    }

    pub(super) fn longest_hold(&self) -> Duration {
        if self.is_erasing() { self.longest_erase + LONGEST_HOLD } else { LONGEST_HOLD }
    }

    /// Until when the loader is awaited before the next record may go, if it is.
    pub(super) fn waits_until(&self) -> Option<Instant> {
        match self.flaw {
            Some(Flaw::IgnoresHolds) => return None,
            Some(Flaw::EndsAtOnce) if self.way.is_before_the_end() => return None,
            Some(_) | None => {}
        }
        match &self.pace {
            Pace::Pages(paging) => paging.waits_until(&self.way, self.alive),
            Pace::Ring(_) => {
                let &left_at = self.way.left_at.back()?;
                let next = self.way.records.get(self.way.sent)?;
                // More than one record may be on its way once header and first data have been acknowledged, but not in
                // a second pass. Before the end record all have to be acknowledged: the loader would report success
                // even if one was lost.
                let fits = self.writes_in_time && !self.again;
                let fits = fits && self.way.characters() + next.text.len() <= WINDOW;
                let fits = fits && self.way.taken >= PROVEN && !self.way.is_before_the_end();
                (!fits).then(|| left_at + if self.alive { ACKNOWLEDGED } else { SIGN_OF_LIFE })
            }
        }
    }

    /// The hold that was awaited has not come. Goes on if the loader may be of another kind, and starts over or gives
    /// up if not.
    ///
    /// # Errors
    /// If the loader seems to be gone, or has not acknowledged a record.
    pub(super) fn pass_unheld(&mut self) -> Result<(), Stall> {
        match self.pace {
            Pace::Pages(_) => self.pass_unheld_page(),
            Pace::Ring(_) => self.pass_unheld_record(),
        }
    }

    fn pass_unheld_page(&mut self) -> Result<(), Stall> {
        let Pace::Pages(paging) = &mut self.pace else { return Ok(()) };
        if paging.crossing.is_none() {
            // No hold after the header, or after the last data, does not prove that what has left has arrived, so it
            // does not count as taken. The next record leaves at once, so nothing is awaited twice.
            return Ok(());
        }
        // The pages may be larger than assumed, and the loader says nothing before the first one is full.
        if self.unheard_words < MOST_UNHEARD && !(self.acknowledged && paging.is_as_believed()) {
            match &paging.pages {
                Pages::Words(_) if self.alive => {}
                Pages::Words(_) => paging.watch(&self.way),
                Pages::Watched { .. } | Pages::Unheld => paging.see(&self.way, false),
            }
        } else if !self.alive {
            return Err(Stall::Silent);
        }
        paging.crossing = None;
        self.alive = false;
        self.take_all_sent();
        Ok(())
    }

    fn pass_unheld_record(&mut self) -> Result<(), Stall> {
        let Pace::Ring(ring) = &self.pace else { return Ok(()) };
        match (self.way.taken, self.again) {
            // No hold after the header: it is treated as a g1, which makes none there.
            (0, false) => {
                self.resize(believed_size(self.packed, Pacing::Pages));
                self.pass_as_pages(Paging::believed(self.believed.1));
            }
            // The header was acknowledged, but the first data is not: a g3 may have lost it, or the hold after the
            // header was not an acknowledgement.
            (taken, false) if taken < PROVEN => self.start_over(),
            // The same in the second pass: the hold was not an acknowledgement.
            (taken, true) if taken < PROVEN && !ring.proven => self.pass_as_pages(Paging::watched(self.way.sent)),
            (_, _) if !self.alive => return Err(Stall::Silent),
            (_, true) => return Err(Stall::Unacknowledged),
            (_, false) => self.start_over(),
        }
        Ok(())
    }

    /// Goes on as for a loader with pages: one with a ring would have stopped us. What has left is assumed to be taken.
    fn pass_as_pages(&mut self, paging: Paging) {
        self.pace = Pace::Pages(paging);
        self.alive = false;
        self.take_all_sent();
    }

    /// Whether a hold at this moment can only be one after the header, which only a loader with a ring makes: the data
    /// sent since does not fill a page of any size.
    fn is_stopped_after_the_header(&self) -> bool {
        let Pace::Pages(paging) = &self.pace else { return false };
        self.way.sent > 0
            && self.way.taken == 0
            && paging.crossing.is_none()
            && pages::fit_any_page(self.way.records[..self.way.sent].iter().filter_map(|record| record.words.as_ref()))
    }
}
