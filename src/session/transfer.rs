//! Sending an image to a loader: records built anew, one on its way at a time, flow control awaited where it must come.
//!
//! What decides how to send is in the public sources of the loaders (generation `g1`, the SDK's of 2000-2004): it keeps
//! one page of 256 words. A record whose data crosses into another page is parked, XOFF goes out, and after 0.6 ms of
//! silence the old page is written, during which the loader is deaf; XON says that it listens again. A second record
//! in the meantime is an overrun, and at the end record a parked one is lost while success is reported. So behind each
//! record that crosses, and before the end record, the sender waits for XON. That the XOFF may be shown late by an
//! adapter (16 ms are 184 characters) does not matter then: it is awaited, not reacted to.

use super::transmitter::Transmitter;
use crate::endpoint::Transmit;
use crate::image::srecord::{self, Kind, Record};
use crate::image::{FlashMap, Image};
use crate::time::{Duration, Instant};

/// How long behind the last character of a record that crosses into another page the loader's XOFF may take: an
/// adapter shows it 20 ms late at worst, a busy computer later still.
const HOLD_EXPECTED: Duration = Duration::from_millis(300);
/// How long the loader may hold us. Writing a page takes it some 30 ms, erasing all of its flash seconds.
const LONGEST_HOLD: Duration = Duration::from_secs(4);
/// The same, if nothing at all has been heard since the crossing before: a unit that lost its power is worth a moment,
/// and not one more record, since what comes back may be its menu.
const SIGN_OF_LIFE: Duration = Duration::from_millis(1500);

/// Why a transfer cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stall {
    /// The loader has held us for [`LONGEST_HOLD`].
    Held,
    /// Nothing has been heard since the crossing before.
    Silent,
}

/// One record ready to leave.
#[derive(Debug)]
struct Outgoing {
    /// The text with its line end.
    text: Vec<u8>,
    /// Address of a data record.
    address: Option<u32>,
    /// The loader will stop us behind it.
    crosses: bool,
}

/// An image on its way.
#[derive(Debug)]
pub(super) struct Transfer {
    records: Vec<Outgoing>,
    bytes_total: usize,
    /// Records let go.
    sent: usize,
    /// Records the loader must have taken.
    taken: usize,
    bytes_taken: usize,
    /// Behind a record that crosses: when its last character has left.
    crossing: Option<Instant>,
    /// Something has been heard since the crossing before.
    alive: bool,
    begun: Option<Instant>,
    deadline: Option<Instant>,
}

impl Transfer {
    /// Builds the records: upper case, CR behind each (the newer loaders take nothing else), a four-byte header address,
    /// no count records.
    pub(super) fn new(image: &Image, flash: &FlashMap) -> Self {
        let header = &image.header[..image.header.len().min(srecord::LONGEST_HEADER)];
        let header = line(|text| srecord::write_header(header, text));
        let mut records = vec![Outgoing { text: header, address: None, crosses: false }];
        let mut page = None;
        for block in &image.blocks {
            let words = block.data.len().div_ceil(2) as u32;
            let first = block.address / flash.page_words;
            let last = block.address.saturating_add(words.saturating_sub(1)) / flash.page_words;
            let crosses = page.is_some_and(|page| page != first) || first != last;
            page = Some(last);
            let mut data = block.data.clone();
            if data.len() % 2 == 1 {
                data.push(0xFF); // Half a word is filled up as erased flash reads.
            }
            let record = Record { kind: Kind::Data32, address: block.address, data: &data };
            let text = line(|text| record.write(text));
            records.push(Outgoing { text, address: Some(block.address), crosses });
        }
        let end = Record { kind: Kind::Start32, address: image.entry, data: &[] };
        records.push(Outgoing { text: line(|text| end.write(text)), address: None, crosses: false });
        let bytes_total = records.iter().map(|record| record.text.len()).sum();
        Transfer {
            records,
            bytes_total,
            sent: 0,
            taken: 0,
            bytes_taken: 0,
            crossing: None,
            alive: false,
            begun: None,
            deadline: None,
        }
    }

    /// Lets go what may go now. Gives `Ok(true)` once the end record has been let go.
    ///
    /// # Errors
    /// If the loader holds us too long, or nobody seems to be there.
    pub(super) fn advance(&mut self, now: Instant, transmitter: &mut Transmitter) -> Result<bool, Stall> {
        self.begun.get_or_insert(now);
        self.deadline = None;
        if let Some(since) = transmitter.held_since() {
            let limit = since + LONGEST_HOLD;
            self.deadline = Some(limit);
            return if limit <= now { Err(Stall::Held) } else { Ok(false) };
        }
        if let Some(left_at) = self.crossing {
            let limit = left_at + if self.alive { HOLD_EXPECTED } else { SIGN_OF_LIFE };
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
            let record = &self.records[self.sent];
            transmitter.push_piece(Transmit::open(record.text.clone()));
            self.sent += 1;
            if record.crosses {
                // The piece is let go in this same step, so it leaves behind what has been let go before.
                let left_at = transmitter.free_at().max(now) + transmitter.time_for(record.text.len());
                self.crossing = Some(left_at);
                self.deadline = Some(left_at + if self.alive { HOLD_EXPECTED } else { SIGN_OF_LIFE });
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
    pub(super) fn hold(&mut self, held: bool) {
        if self.crossing.is_some() {
            if held {
                self.alive = true;
            } else {
                // XON alone will do: it comes when the page is written, and the XOFF may have been lost on the line.
                self.crossing = None;
                self.alive = false;
                self.take_all_sent();
            }
        }
    }

    /// The loader has printed something.
    pub(super) fn heard(&mut self) {
        self.alive = true;
    }

    /// Whether the loader has shown by its flow control that it takes the records.
    pub(super) fn is_taken(&self) -> bool {
        self.taken > 0
    }

    /// The loader has said that it is through.
    pub(super) fn take_all_sent(&mut self) {
        self.bytes_taken += self.records[self.taken..self.sent].iter().map(|record| record.text.len()).sum::<usize>();
        self.taken = self.sent;
    }

    /// When [`advance`](Transfer::advance) is wanted.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    /// Records let go, and records in all.
    pub(super) fn sent(&self) -> (usize, usize) {
        (self.sent, self.records.len())
    }

    /// Records and characters the loader must have taken, and characters in all.
    pub(super) fn taken(&self) -> (usize, usize, usize) {
        (self.taken, self.bytes_taken, self.bytes_total)
    }

    /// Address of the data record let go last.
    pub(super) fn address(&self) -> Option<u32> {
        self.records[..self.sent].iter().rev().find_map(|record| record.address)
    }

    /// When the first record was let go.
    pub(super) fn begun(&self) -> Option<Instant> {
        self.begun
    }

    /// No XOFF came behind a record that should have brought one. A loader of another kind may do without, if it shows
    /// in another way that it is there.
    fn pass_unheld(&mut self) -> Result<(), Stall> {
        if !self.alive {
            return Err(Stall::Silent);
        }
        self.crossing = None;
        self.alive = false;
        self.take_all_sent();
        Ok(())
    }
}

fn line(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut text = Vec::new();
    write(&mut text);
    text.push(b'\r');
    text
}
