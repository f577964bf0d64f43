//! The records of a transfer, and where they are: still here, on their way, or taken.

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

/// Records on their way to a loader. None is taken before it has been let go, and all are in their order.
#[derive(Debug)]
pub(super) struct Way {
    pub(super) records: Vec<Outgoing>,
    pub(super) bytes_total: usize,
    /// Records let go.
    pub(super) sent: usize,
    /// Records the loader must have taken.
    pub(super) taken: usize,
    bytes_taken: usize,
    /// When the last character has left of each record let go and not taken.
    pub(super) left_at: VecDeque<Instant>,
}

impl Way {
    /// All of these are still here.
    pub(super) fn of(records: Vec<Outgoing>) -> Self {
        let bytes_total = records::characters(&records);
        Way { records, bytes_total, sent: 0, taken: 0, bytes_taken: 0, left_at: VecDeque::new() }
    }

    /// Other records instead of those that have not been let go.
    pub(super) fn replace(&mut self, records: Vec<Outgoing>) {
        self.bytes_total = records::characters(&records);
        self.records = records;
    }

    /// All are here again.
    pub(super) fn start_over(&mut self) {
        (self.sent, self.taken, self.bytes_taken) = (0, 0, 0);
        self.left_at.clear();
    }

    /// The next record is let go, the last character of which will have left then.
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

    /// It must have taken all that are on their way.
    pub(super) fn take_all(&mut self) {
        self.bytes_taken += self.characters();
        self.taken = self.sent;
        self.left_at.clear();
    }

    /// Characters that are on their way.
    pub(super) fn characters(&self) -> usize {
        records::characters(&self.records[self.taken..self.sent])
    }

    /// Whether only the end record is still here.
    pub(super) fn is_before_the_end(&self) -> bool {
        self.sent + 1 == self.records.len()
    }

    /// How far it has come.
    pub(super) fn reached(&self) -> Reached {
        Reached { sent: self.sent, taken: self.taken, bytes_taken: self.bytes_taken }
    }

    /// The last word of the data before a record.
    pub(super) fn last_word(&self, record: usize) -> Option<u32> {
        self.records[..record].iter().rev().find_map(|record| Some(*record.words.as_ref()?.end()))
    }
}
