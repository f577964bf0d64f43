//! The records of a transfer, and where they are: not let go yet, on their way, or taken by the loader.

use std::collections::VecDeque;

use super::super::records::{self, Outgoing};
use crate::time::Instant;

/// How far a transfer has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session::upload) struct Reached {
    /// Records let go, header and end included.
    pub(in crate::session::upload) sent: usize,
    /// Records the loader must have taken.
    pub(in crate::session::upload) taken: usize,
    /// Their characters.
    pub(in crate::session::upload) bytes_taken: usize,
}

/// The records of a transfer, in order. The first `taken` of them have been taken by the loader, those up to `sent` are
/// on their way, and the rest has not been let go yet.
#[derive(Debug)]
pub(super) struct Way {
    pub(super) records: Vec<Outgoing>,
    pub(super) bytes_total: usize,
    /// Records let go.
    pub(super) sent: usize,
    /// Records the loader must have taken.
    pub(super) taken: usize,
    bytes_taken: usize,
    /// For each record on its way: when its last character has left the line.
    pub(super) left_at: VecDeque<Instant>,
}

impl Way {
    /// None of these records has been let go yet.
    pub(super) fn of(records: Vec<Outgoing>) -> Self {
        let bytes_total = records::characters(&records);
        Way { records, bytes_total, sent: 0, taken: 0, bytes_taken: 0, left_at: VecDeque::new() }
    }

    /// Replaces the records. Those that have been let go have to be the same as before.
    pub(super) fn replace(&mut self, records: Vec<Outgoing>) {
        self.bytes_total = records::characters(&records);
        self.records = records;
    }

    /// Back to the first record: none has been let go.
    pub(super) fn start_over(&mut self) {
        (self.sent, self.taken, self.bytes_taken) = (0, 0, 0);
        self.left_at.clear();
    }

    /// The next record is let go. Its last character will have left the line at `left_at`.
    pub(super) fn let_go(&mut self, left_at: Instant) {
        self.left_at.push_back(left_at);
        self.sent += 1;
    }

    /// The loader must have taken the oldest record that is on its way.
    pub(super) fn take_one(&mut self) {
        if self.left_at.pop_front().is_some() {
            self.bytes_taken += self.records[self.taken].text.len();
            self.taken += 1;
        }
    }

    /// The loader must have taken all records that are on their way.
    pub(super) fn take_all(&mut self) {
        self.bytes_taken += self.characters();
        self.taken = self.sent;
        self.left_at.clear();
    }

    /// Characters that are on their way.
    pub(super) fn characters(&self) -> usize {
        records::characters(&self.records[self.taken..self.sent])
    }

    /// Whether only the end record has not been let go yet.
    pub(super) fn is_before_the_end(&self) -> bool {
        self.sent + 1 == self.records.len()
    }

    /// How far the transfer has come.
    pub(super) fn reached(&self) -> Reached {
        Reached { sent: self.sent, taken: self.taken, bytes_taken: self.bytes_taken }
    }

    /// Address of the last data word before the record of this number.
    pub(super) fn last_word(&self, record: usize) -> Option<u32> {
        self.records[..record].iter().rev().find_map(|record| Some(*record.words.as_ref()?.end()))
    }
}
