//! What a loader's flow control shows: what is awaited after each record, what a hold proves, and what none does.

use std::ops::RangeInclusive;

use super::super::super::flaw::Flaw;
use super::super::pages;
use super::super::records;
use super::way::Way;
use super::{Pages, Size, Stall, Transfer, WINDOW, believed_size};
use crate::device::Pacing;
use crate::time::{Duration, Instant};

/// How long after the last character of a record that crosses into another page the loader's XOFF may take: an
/// adapter shows it 20 ms late at worst, a busy computer later still.
const HOLD_EXPECTED: Duration = Duration::from_millis(300);
/// How long after the header the XOFF of a loader may take that was not expected to send one: the echo of the header's
/// text, and an adapter of 20 ms.
const HEADER_HOLD: Duration = Duration::from_millis(120);
/// How long after a record the XON may take that says it is taken, if the loader shows otherwise that it is there:
/// words are programmed in 3 ms, but here the end of it is a failed upload, so a busy computer gets more time.
const ACKNOWLEDGED: Duration = Duration::from_millis(1000);
/// How long the loader may hold us. Writing a page takes it some 30 ms. Erasing all of its flash takes seconds, which
/// come on top.
const LONGEST_HOLD: Duration = Duration::from_secs(4);
/// The same, if nothing at all has been heard since the crossing before: a unit that lost its power is worth a moment,
/// and not one more record, since what comes back may be its menu.
const SIGN_OF_LIFE: Duration = Duration::from_millis(1500);
/// How long after each record a hold may take while it is not known where the loader stops its sender: an adapter of 20 ms
/// there and back, and a busy computer.
const WATCHED: Duration = Duration::from_millis(120);
/// Words that may leave, from the header on, without any sign of life: the largest pages of such parts have 512, and twice
/// that is looked at, the record that crosses included.
const MOST_UNHEARD: u32 = 1280;
/// Records that have to be acknowledged one by one before more than one is on its way: the header, and the first data.
const PROVEN: usize = 2;

/// How the loader stops its sender as far as is known, and what has been seen of that. Which of them it is is assumed
/// first; holds, and their absence, decide.
#[derive(Debug)]
pub(super) enum Pace {
    /// Where another page begins.
    Pages(Paging),
    /// After every record.
    Ring(Ring),
}

/// What has been seen of a loader that keeps one page.
#[derive(Debug)]
pub(super) struct Paging {
    /// Where it stops us.
    pages: Pages,
    /// It has done so elsewhere than assumed.
    surprised: bool,
    /// Records before this one left before the loader was watched.
    watched_from: usize,
    /// After a record that the loader may stop us after: when its last character has left.
    crossing: Option<Instant>,
    /// No hold came after the header where none was expected.
    header_passed: bool,
    /// Nor after the last data.
    end_passed: bool,
}

/// What has been seen of a loader with a ring.
#[derive(Debug, Default)]
pub(super) struct Ring {
    /// The header and the first data have been acknowledged, each by a hold of its own: only a loader with a ring does so.
    proven: bool,
    /// Since when it stops us. The transmitter's own knowledge will not do: it takes a header that names a unit, and is
    /// echoed, for a unit that starts and has forgotten that it stopped us.
    stopped_since: Option<Instant>,
}

impl Pace {
    /// Nothing has been seen yet: what the product's file says.
    pub(super) fn believed(pacing: Pacing, page_words: u32) -> Self {
        match pacing {
            Pacing::Pages => Pace::Pages(Paging::believed(page_words)),
            Pacing::Records => Pace::Ring(Ring::default()),
        }
    }

    /// Since when a loader stops us that does so after every record.
    pub(super) fn stopped_since(&self) -> Option<Instant> {
        match self {
            Pace::Pages(_) => None,
            Pace::Ring(ring) => ring.stopped_since,
        }
    }
}

impl Paging {
    /// Pages of this many words.
    fn believed(page_words: u32) -> Self {
        Paging {
            pages: Pages::Words(page_words),
            surprised: false,
            watched_from: 0,
            crossing: None,
            header_passed: false,
            end_passed: false,
        }
    }

    /// Nothing is assumed, before this record is let go.
    pub(super) fn watched(record: usize) -> Self {
        Paging { pages: Pages::watched(), surprised: true, watched_from: record, ..Paging::believed(0) }
    }

    /// The header has been waited for already.
    fn behind_the_header(self) -> Self {
        Paging { header_passed: true, ..self }
    }

    /// A record of these words is let go, after those that end with `before`.
    pub(super) fn let_go(&mut self, believed: u32, before: Option<u32>, words: &RangeInclusive<u32>, left_at: Instant) {
        if self.pages.may_hold(believed, before, words) {
            self.crossing = Some(left_at);
        }
    }

    /// Whether it has stopped us where it was not expected to, or has not where it was.
    pub(super) fn is_surprised(&self) -> bool {
        self.surprised
    }

    /// Where it stops us, if that is elsewhere than assumed.
    pub(super) fn surprise(&self) -> Option<&Pages> {
        self.surprised.then_some(&self.pages)
    }

    /// The belief about pages is given up: where they end shows record by record from here on.
    fn watch(&mut self, way: &Way) {
        self.surprised = true;
        self.pages = Pages::watched();
        self.watched_from = way.sent;
    }

    /// Whether the loader has stopped us after the record let go last, which was alone on its way.
    fn see(&mut self, way: &Way, held: bool) {
        let last = way.sent.saturating_sub(1);
        if last >= self.watched_from
            && let Some(words) = &way.records[last].words
        {
            self.pages.seen(way.last_word(last), words, held);
        }
    }

    /// Whether the loader has done as the product's file says.
    fn is_as_believed(&self) -> bool {
        matches!(self.pages, Pages::Words(_))
    }

    /// Until when an answer is awaited before the next record may go, if one is.
    fn waits_until(&self, way: &Way, alive: bool) -> Option<Instant> {
        // The header may be what an unexpected g3 stops us after; its ring is soon full.
        if way.sent == 1 && !self.header_passed {
            return Some(*way.left_at.back()? + HEADER_HOLD);
        }
        match (self.crossing, &self.pages) {
            (Some(crossing), Pages::Watched { .. } | Pages::Unheld) => Some(crossing + WATCHED),
            (Some(crossing), Pages::Words(_)) => Some(crossing + if alive { HOLD_EXPECTED } else { SIGN_OF_LIFE }),
            // Success is reported for a page that is lost here, so the last data gets its time wherever it lies.
            (None, _) if way.is_before_the_end() && !self.end_passed => Some(*way.left_at.back()? + WATCHED),
            (None, _) => None,
        }
    }
}

impl Transfer {
    /// The loader has sent XOFF (`true`) or XON.
    pub(in crate::session::upload) fn hold(&mut self, now: Instant, held: bool) {
        self.unheard_words = 0;
        self.before = None;
        if held && self.is_stopped_behind_the_header() {
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
                    // Not where it was expected: its pages have another size, or the line made an XOFF of something.
                    paging.watch(&self.way);
                    paging.crossing = Some(now);
                }
            }
            (false, None) => {}
            (false, Some(_)) => {
                // XON alone will do: it comes when the page is written, and the XOFF may have been lost on the line.
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
        // Only both together count: what is damaged on the line must not count twice.
        if was_stopped && !held {
            self.alive = false;
            self.acknowledged = true;
            self.way.take_one();
            ring.proven |= self.way.taken == PROVEN;
            // After a long hold the ring may have had more in it. It is empty now.
            while self.way.left_at.front().is_some_and(|&left_at| left_at + HOLD_EXPECTED <= now) {
                self.way.take_one();
            }
        }
    }

    /// The hold after the header shows how late an acknowledgement is, before any data has left.
    fn choose_size(&mut self, now: Instant) {
        let Some(&left_at) = self.way.left_at.front().filter(|_| self.packed) else { return };
        let late = now.since(left_at).as_nanos() / self.character_time.as_nanos().max(1);
        let late = usize::try_from(late).unwrap_or(usize::MAX);
        self.resize(Size::Packed(records::longest_acknowledged(WINDOW, late)));
    }

    pub(super) fn longest_hold(&self) -> Duration {
        if self.is_erasing() { self.longest_erase + LONGEST_HOLD } else { LONGEST_HOLD }
    }

    /// Until when an answer of the loader is awaited before the next record may go, if one is.
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
                // The header and the first data have to show first that this loader answers, and after the end nothing
                // may be lost. Where two records may be taken in one hold, and the second time, each is alone.
                let fits = self.writes_in_time && !self.again;
                let fits = fits && self.way.characters() + next.text.len() <= WINDOW;
                let fits = fits && self.way.taken >= PROVEN && !self.way.is_before_the_end();
                (!fits).then(|| left_at + if self.alive { ACKNOWLEDGED } else { SIGN_OF_LIFE })
            }
        }
    }

    /// No XOFF came where one should have. A loader of another kind may do without, if it shows in another way that it
    /// is there.
    pub(super) fn pass_unheld(&mut self) -> Result<(), Stall> {
        match self.pace {
            Pace::Pages(_) => self.pass_unheld_page(),
            Pace::Ring(_) => self.pass_unheld_record(),
        }
    }

    fn pass_unheld_page(&mut self) -> Result<(), Stall> {
        let Pace::Pages(paging) = &mut self.pace else { return Ok(()) };
        match (paging.crossing, &paging.pages) {
            // That proves nothing: it may not have come.
            _ if self.way.sent == 1 => {
                paging.header_passed = true;
                return Ok(());
            }
            (None, _) => {
                paging.end_passed = true;
                return Ok(());
            }
            // Its pages may be larger than assumed, and it has nothing to say before the first one is full.
            (Some(_), pages)
                if self.unheard_words < MOST_UNHEARD && !(self.acknowledged && paging.is_as_believed()) =>
            {
                match pages {
                    Pages::Words(_) if self.alive => {}
                    Pages::Words(_) => paging.watch(&self.way),
                    Pages::Watched { .. } | Pages::Unheld => paging.see(&self.way, false),
                }
            }
            (Some(_), _) if !self.alive => return Err(Stall::Silent),
            (Some(_), _) => {}
        }
        paging.crossing = None;
        self.alive = false;
        self.take_all_sent();
        Ok(())
    }

    fn pass_unheld_record(&mut self) -> Result<(), Stall> {
        let Pace::Ring(ring) = &self.pace else { return Ok(()) };
        match (self.way.taken, self.again) {
            // G1 says nothing after the header.
            (0, false) => {
                self.resize(believed_size(self.packed, Pacing::Pages));
                self.pass_as_pages(Paging::believed(self.believed.1));
            }
            // The header was acknowledged, and the first data is not: a g3 may have lost it, or a hold after the header
            // was something else.
            (taken, false) if taken < PROVEN => self.start_over(),
            // The second time round it was something else.
            (taken, true) if taken < PROVEN && !ring.proven => self.pass_as_pages(Paging::watched(self.way.sent)),
            (_, _) if !self.alive => return Err(Stall::Silent),
            (_, true) => return Err(Stall::Unacknowledged),
            (_, false) => self.start_over(),
        }
        Ok(())
    }

    /// What does not stop us after its records has no ring: what has left is taken, as far as anybody can say.
    fn pass_as_pages(&mut self, paging: Paging) {
        self.pace = Pace::Pages(paging.behind_the_header());
        self.alive = false;
        self.take_all_sent();
    }

    /// Whether a hold now is one after the header, which only a loader with a ring makes: no page can have been full
    /// since.
    fn is_stopped_behind_the_header(&self) -> bool {
        let Pace::Pages(paging) = &self.pace else { return false };
        self.way.sent > 0
            && self.way.taken == 0
            && paging.crossing.is_none()
            && pages::fit_any_page(self.way.records[..self.way.sent].iter().filter_map(|record| record.words.as_ref()))
    }
}
