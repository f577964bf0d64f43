//! What a loader's flow control shows: what is awaited behind each record, what a hold proves, and what none does.

use super::super::super::flaw::Flaw;
use super::super::pages;
use super::super::records;
use super::{Pages, Size, Stall, Transfer, WINDOW, believed_size};
use crate::device::Pacing;
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
/// Records that have to be acknowledged one by one before more than one is on its way: the header, and the first data.
const PROVEN: usize = 2;

impl Transfer {
    /// The loader has sent XOFF (`true`) or XON.
    pub(in crate::session::upload) fn hold(&mut self, now: Instant, held: bool) {
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

    pub(super) fn longest_hold(&self) -> Duration {
        if self.is_erasing() { self.longest_erase + LONGEST_HOLD } else { LONGEST_HOLD }
    }

    /// Until when an answer of the loader is awaited before the next record may go, if one is.
    pub(super) fn waits_until(&self) -> Option<Instant> {
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

    /// No XOFF came where one should have. A loader of another kind may do without, if it shows in another way that it
    /// is there.
    pub(super) fn pass_unheld(&mut self) -> Result<(), Stall> {
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

    /// The belief about pages is given up: where they end shows record by record from here on.
    pub(super) fn watch(&mut self) {
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
}
