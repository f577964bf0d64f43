//! What leaves for the unit, and when: our half of Xon/Xoff, and what is still on its way.
//!
//! The operating system cannot be asked what it has sent (a pseudo-terminal says "all of it" while it is stopped, a USB
//! adapter keeps some hundred bytes), so what is on the line is calculated here: pieces are let go one at a time, each
//! when the one before must have left. There is never more than one piece that can no longer be withdrawn and is not
//! yet on the wire.

use std::collections::VecDeque;

use crate::endpoint::{Secrecy, Transmit};
use crate::time::{Duration, Instant};

/// How long before the line runs dry the next piece is let go: several times as long as a wake-up comes late.
const LEAD: Duration = Duration::from_millis(2);

/// Bytes of typed text in one piece: 5.6 ms at 115,200 baud.
const PIECE: usize = 64;

/// Bytes that may wait while the unit holds us.
const LIMIT: usize = 64 << 10;

/// What a queued piece comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sender {
    /// The user has typed it, or sends it as a file.
    User,
    /// A job: of no use once that has ended.
    Job,
}

/// A piece that waits.
#[derive(Debug)]
struct Waiting {
    piece: Transmit,
    sender: Sender,
    number: u64,
}

/// What waits to be sent, and the state of the line.
#[derive(Debug)]
pub(super) struct Transmitter {
    waiting: VecDeque<Waiting>,
    waiting_bytes: usize,
    /// Number of the next piece to be queued.
    next: u64,
    /// Number of the last piece of a job that has been let go.
    let_go: Option<u64>,
    held_since: Option<Instant>,
    character_time: Duration,
    /// When everything let go so far must have left the line.
    free_at: Instant,
}

impl Transmitter {
    /// A line on which one character takes `character_time`.
    pub(super) fn new(character_time: Duration) -> Self {
        Transmitter {
            waiting: VecDeque::new(),
            waiting_bytes: 0,
            next: 0,
            let_go: None,
            held_since: None,
            character_time,
            free_at: Instant::ZERO,
        }
    }

    /// Whether this many bytes may be queued.
    pub(super) fn has_room(&self, bytes: usize) -> bool {
        self.waiting_bytes + bytes <= LIMIT
    }

    /// Queues text. Returns `false`, and takes nothing, if too much waits already.
    pub(super) fn push_text(&mut self, bytes: &[u8], secrecy: Secrecy, sender: Sender) -> bool {
        if !self.has_room(bytes.len()) {
            return false;
        }
        for piece in bytes.chunks(PIECE) {
            self.push(Transmit { bytes: piece.to_vec(), secrecy }, sender);
        }
        true
    }

    /// Queues one piece of a job that is let go whole.
    pub(super) fn push_piece(&mut self, piece: Transmit) {
        self.push(piece, Sender::Job);
    }

    fn push(&mut self, piece: Transmit, sender: Sender) {
        self.waiting_bytes += piece.bytes.len();
        self.waiting.push_back(Waiting { piece, sender, number: self.next });
        self.next += 1;
    }

    /// Number of the next piece to be queued.
    pub(super) fn next_number(&self) -> u64 {
        self.next
    }

    /// A job has ended. Its first piece has the number `begun`; what it has queued while ending begins with `last`. If
    /// earlier pieces of it still wait, they are withdrawn, since their answers are of no use any more. If none of its
    /// pieces has left, those from `last` on are withdrawn as well: there is nothing they could end.
    pub(super) fn withdraw_job(&mut self, begun: u64, last: u64) {
        let is_late = |waiting: &Waiting| waiting.sender == Sender::Job && waiting.number < last;
        if !self.waiting.iter().any(is_late) {
            return;
        }
        let has_spoken = self.let_go.is_some_and(|number| number >= begun);
        self.waiting.retain(|waiting| waiting.sender == Sender::User || has_spoken && waiting.number >= last);
        self.waiting_bytes = self.waiting.iter().map(|waiting| waiting.piece.bytes.len()).sum();
    }

    /// Whether a secret of a job waits.
    pub(super) fn keeps_secret(&self) -> bool {
        let is_secret = |waiting: &Waiting| waiting.piece.secrecy == Secrecy::Secret;
        self.waiting.iter().any(|waiting| waiting.sender == Sender::Job && is_secret(waiting))
    }

    /// The unit has sent XOFF (`true`) or XON.
    pub(super) fn hold(&mut self, now: Instant, held: bool) {
        self.held_since = match (held, self.held_since) {
            (true, None) => Some(now),
            (true, since) => since,
            (false, _) => None,
        };
    }

    /// The next piece, if it may go now.
    pub(super) fn poll(&mut self, now: Instant) -> Option<Transmit> {
        if self.held_since.is_some() || self.ready_at() > now {
            return None;
        }
        let Waiting { piece, sender, number } = self.waiting.pop_front()?;
        if sender == Sender::Job {
            self.let_go = Some(number);
        }
        self.waiting_bytes -= piece.bytes.len();
        self.free_at = self.free_at.max(now) + self.time_for(piece.bytes.len());
        Some(piece)
    }

    /// When [`poll`](Transmitter::poll) has something, if nothing changes until then.
    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        (self.held_since.is_none() && !self.waiting.is_empty()).then(|| self.ready_at())
    }

    /// When another piece may be let go.
    pub(super) fn ready_at(&self) -> Instant {
        self.free_at - LEAD
    }

    /// When everything let go so far must have left the line.
    pub(super) fn free_at(&self) -> Instant {
        self.free_at
    }

    /// How long this many characters take.
    pub(super) fn time_for(&self, characters: usize) -> Duration {
        self.character_time * characters as u32
    }

    /// Whether nothing waits.
    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Bytes that wait.
    pub(super) fn waiting(&self) -> usize {
        self.waiting_bytes
    }

    /// Since when the unit holds us.
    pub(super) fn held_since(&self) -> Option<Instant> {
        self.held_since
    }

    /// Forgets what has not been let go.
    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.waiting_bytes = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Transmitter {
        Transmitter::new(Duration::from_millis(1))
    }

    #[test]
    fn pieces_go_when_the_one_before_has_all_but_left() {
        let mut line = line();
        line.push_piece(Transmit::open(*b"0123456789"));
        line.push_piece(Transmit::open(*b"next"));
        assert!(line.poll(Instant::ZERO).is_some());
        assert_eq!(line.poll(Instant::from_millis(7)), None);
        assert_eq!(line.poll_timeout(), Some(Instant::from_millis(8)));
        assert!(line.poll(Instant::from_millis(8)).is_some());
        assert_eq!(line.free_at(), Instant::from_millis(14));
    }

    #[test]
    fn nothing_goes_while_the_unit_holds_us() {
        let mut line = line();
        line.push_text(b"m", Secrecy::Open, Sender::User);
        line.hold(Instant::from_millis(3), true);
        line.hold(Instant::from_millis(5), true);
        assert_eq!((line.poll(Instant::from_millis(9)), line.poll_timeout()), (None, None));
        assert_eq!(line.held_since(), Some(Instant::from_millis(3)));
        line.hold(Instant::from_millis(9), false);
        assert!(line.poll(Instant::from_millis(9)).is_some());
    }

    #[test]
    fn a_queue_that_nobody_empties_has_a_limit() {
        let mut line = line();
        assert!(line.push_text(&[b'x'; LIMIT], Secrecy::Open, Sender::User));
        assert!(!line.push_text(b"y", Secrecy::Open, Sender::User));
    }

    /// What leaves once the unit lets it.
    fn rest(line: &mut Transmitter) -> String {
        line.hold(Instant::ZERO, false);
        let mut rest = Vec::new();
        while let Some(due) = line.poll_timeout() {
            rest.extend(line.poll(due).into_iter().flat_map(|piece| piece.bytes));
        }
        assert_eq!(line.waiting(), 0);
        String::from_utf8(rest).expect("keys")
    }

    #[test]
    fn what_a_job_could_not_send_in_its_time_is_withdrawn_and_what_was_typed_is_not() {
        // Nothing of the job has left, so there is nothing to end either.
        let mut line = line();
        line.hold(Instant::ZERO, true);
        line.push_text(b"x", Secrecy::Open, Sender::User);
        let begun = line.next_number();
        line.push_text(b"t", Secrecy::Open, Sender::Job);
        let last = line.next_number();
        line.push_text(b"\r", Secrecy::Open, Sender::Job);
        line.withdraw_job(begun, last);
        assert_eq!(line.waiting(), 1);
        assert_eq!(rest(&mut line), "x");
        // The question after the first key is open: the answer is withdrawn, and the question is left.
        let begun = line.next_number();
        line.push_text(b"t", Secrecy::Open, Sender::Job);
        assert!(line.poll(Instant::from_millis(1_000_000)).is_some());
        line.hold(Instant::ZERO, true);
        line.push_text(b"f", Secrecy::Open, Sender::Job);
        let last = line.next_number();
        line.push_text(b"\r", Secrecy::Open, Sender::Job);
        line.withdraw_job(begun, last);
        assert_eq!(rest(&mut line), "\r");
        // On a line that is not held, what the job queues while ending leaves.
        let begun = line.next_number();
        line.push_text(b"\r", Secrecy::Open, Sender::Job);
        line.withdraw_job(begun, begun);
        assert_eq!(rest(&mut line), "\r");
    }
}
