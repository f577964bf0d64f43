//! All that touches the system: clock, ports, pseudo-terminals, terminal, files. Thin: decisions are made elsewhere.
//!
//! Threads here do nothing but wait for one thing each and put what comes on the one channel of their owner
//! ([`Input`]); the owner's loop is the only place where something is done about it. What differs between systems is
//! named in this directory and nowhere else.

pub mod address;
pub mod clock;
pub mod comeback;
pub mod journal;
pub mod library;
pub mod link;
pub mod network;
pub mod port_link;
pub mod ports;
pub mod pump;
pub mod recorder;
pub mod regular;
pub mod replay;
pub mod save;
pub mod signal;
pub mod state;
pub mod terminal;
pub mod unit;

#[cfg(any(windows, test))]
mod duplex;
mod lines;
mod outlet;
mod recording_file;
#[cfg(unix)]
mod serial;
pub mod socket;
#[cfg(unix)]
mod wait;

#[cfg(unix)]
pub mod pty;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};

use crate::endpoint::Arrived;
use crate::time::{Duration, Instant};
use link::LinkError;
use signal::Caught;

/// What the world did, on the one channel of a program's loop.
#[derive(Debug)]
pub enum Input {
    /// Bytes came from the port.
    Bytes {
        /// Over which connection.
        link: LinkId,
        /// When they were read.
        at: Instant,
        /// What, at least one byte.
        bytes: Vec<u8>,
    },
    /// The port is gone. Comes once for each connection; what was read before may still follow it.
    Gone {
        /// Which connection has ended.
        link: LinkId,
        /// Why.
        error: LinkError,
    },
    /// The process got a signal.
    Signal(Caught),
    /// Bytes from standard input, where it is read as such.
    Typed(Vec<u8>),
    /// Standard input has ended.
    TypedEnd,
    /// A thread of the loop's own has left something for it elsewhere.
    Wake,
}

/// One connection among all that this process has ever opened; a later one is greater.
///
/// What comes of a connection is marked with it, since two may be open at once: the one that is given up, and the one
/// that takes its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LinkId(u64);

impl LinkId {
    /// The next one, for a connection that is about to be opened.
    pub fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        LinkId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Inputs that wait at most: with the reader's 4 KiB each, a quarter of a megabyte, after which the reader stops
/// reading and the system's own flow control takes over.
pub const INPUTS: usize = 64;

/// The one channel of a program's loop.
pub fn channel() -> (SyncSender<Input>, Receiver<Input>) {
    sync_channel(INPUTS)
}

/// The receiving end of the channel, with what has been taken from it and not looked at.
///
/// A loop that was kept away, by a stopped terminal or a slow disk, finds the answers of the unit here and a clock that
/// has gone on. It takes the bytes first: what came in time must not be lost to a deadline that nobody could keep.
#[derive(Debug)]
pub struct Inbox {
    inputs: Receiver<Input>,
    waiting: VecDeque<Input>,
    /// The connection that was closed last: of it, and of those before it, nothing is wanted any more.
    closed: Option<LinkId>,
}

/// Nobody can put anything on the channel any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Closed;

impl Inbox {
    /// Everything that comes on this channel.
    pub fn new(inputs: Receiver<Input>) -> Self {
        Inbox { inputs, waiting: VecDeque::new(), closed: None }
    }

    /// All bytes that have come, in their pieces, up to the loss of the port if there is one. While two connections are
    /// open, ask for the bytes of one ([`rest`](Inbox::rest)).
    pub fn arrived(&mut self) -> Vec<Arrived> {
        self.collect();
        self.part_of_arrived(usize::MAX).0
    }

    /// Takes what waits on the channel, so that [`part_of_arrived`](Inbox::part_of_arrived) gives all that has come so
    /// far, and comes to an end in a flood.
    pub fn collect(&mut self) {
        self.take(INPUTS.saturating_sub(self.waiting.len()));
    }

    /// The same as [`arrived`](Inbox::arrived), of what has been collected, and no more pieces than hold this many bytes;
    /// and whether there are more of them.
    pub fn part_of_arrived(&mut self, most: usize) -> (Vec<Arrived>, bool) {
        let (mut arrived, mut taken, mut more) = (Vec::new(), 0, false);
        let mut others = VecDeque::new();
        while let Some(input) = self.waiting.pop_front() {
            match input {
                Input::Bytes { at, bytes, .. } if taken < most => {
                    taken += bytes.len();
                    arrived.push(Arrived { at, bytes });
                }
                Input::Bytes { .. } | Input::Gone { .. } => {
                    more = matches!(input, Input::Bytes { .. });
                    self.waiting.push_front(input);
                    break;
                }
                Input::Signal(_) | Input::Typed(_) | Input::TypedEnd | Input::Wake => others.push_back(input),
            }
        }
        others.append(&mut self.waiting);
        self.waiting = others;
        (arrived, more)
    }

    /// The next input that is not bytes. `None` if the time is over, or bytes come first.
    ///
    /// # Errors
    /// If nothing can come any more.
    pub fn next(&mut self, patience: Duration) -> Result<Option<Input>, Closed> {
        if self.waiting.is_empty() {
            match self.inputs.recv_timeout(patience) {
                Ok(input) if is_wanted(&input, self.closed) => self.waiting.push_back(input),
                Ok(_) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => return Err(Closed),
            }
        }
        let is_bytes = matches!(self.waiting.front(), Some(Input::Bytes { .. }));
        Ok(if is_bytes { None } else { self.waiting.pop_front() })
    }

    /// All bytes that have come over one connection, also those after its loss: for an owner that is about to close it.
    /// What another one has brought stays.
    pub fn rest(&mut self, link: LinkId) -> Vec<Arrived> {
        // The channel may be full, whatever waits here already.
        self.take(INPUTS);
        let mut rest = Vec::new();
        let mut others = VecDeque::new();
        for input in self.waiting.drain(..) {
            match input {
                Input::Bytes { link: from, at, bytes } if from == link => rest.push(Arrived { at, bytes }),
                other => others.push_back(other),
            }
        }
        self.waiting = others;
        rest
    }

    /// Forgets a connection that is closed: nothing that came over it is handed out any more, not even what its threads
    /// put on the channel in their last moment. One that was opened later loses nothing.
    pub fn forget(&mut self, link: LinkId) {
        self.closed = self.closed.max(Some(link));
        let closed = self.closed;
        self.waiting.retain(|input| is_wanted(input, closed));
    }

    fn take(&mut self, most: usize) {
        let closed = self.closed;
        self.waiting.extend(self.inputs.try_iter().take(most).filter(|input| is_wanted(input, closed)));
    }
}

/// Whether this is still to be handed out when that connection, and all before it, are closed.
fn is_wanted(input: &Input, closed: Option<LinkId>) -> bool {
    match input {
        Input::Bytes { link, .. } | Input::Gone { link, .. } => Some(*link) > closed,
        Input::Signal(_) | Input::Typed(_) | Input::TypedEnd | Input::Wake => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::{Cause, Operation};

    const FIRST: LinkId = LinkId(1);
    const SECOND: LinkId = LinkId(2);

    fn bytes(millis: u64, text: &str) -> Input {
        bytes_of(FIRST, millis, text)
    }

    fn bytes_of(link: LinkId, millis: u64, text: &str) -> Input {
        Input::Bytes { link, at: Instant::from_millis(millis), bytes: text.into() }
    }

    fn gone(link: LinkId) -> Input {
        let error = LinkError { port: "u0".into(), operation: Operation::Read, cause: Cause::Gone };
        Input::Gone { link, error }
    }

    fn texts(arrived: Vec<Arrived>) -> Vec<String> {
        arrived.into_iter().map(|piece| String::from_utf8(piece.bytes).expect("text")).collect()
    }

    #[test]
    fn bytes_come_first_each_piece_with_its_time_and_none_from_behind_the_loss_of_the_port() {
        let (sender, inputs) = channel();
        let mut inbox = Inbox::new(inputs);
        for input in [bytes(1, "a"), Input::Wake, bytes(2, "b"), gone(FIRST), Input::Signal(2.into()), bytes(3, "c")] {
            sender.send(input).expect("there is room");
        }
        let arrived: Vec<(Instant, Vec<u8>)> =
            inbox.arrived().into_iter().map(|piece| (piece.at, piece.bytes)).collect();
        assert_eq!(arrived, [(Instant::from_millis(1), b"a".to_vec()), (Instant::from_millis(2), b"b".to_vec())]);
        let mut next = || inbox.next(Duration::ZERO);
        assert!(matches!(next(), Ok(Some(Input::Wake))));
        assert!(matches!(next(), Ok(Some(Input::Gone { .. }))));
        assert!(matches!(next(), Ok(Some(Input::Signal(signal))) if signal.number() == 2));
        assert!(matches!(next(), Ok(None)), "bytes are taken by the other way");
        assert_eq!(inbox.arrived().len(), 1);
        assert!(matches!(inbox.next(Duration::ZERO), Ok(None)));
        drop(sender);
        assert_eq!(inbox.next(Duration::ZERO).err(), Some(Closed));
    }

    #[test]
    fn a_backlog_is_had_in_parts_and_ends_while_more_comes() {
        let (sender, inputs) = channel();
        let mut inbox = Inbox::new(inputs);
        let send = |input| sender.send(input).expect("there is room");
        for input in [bytes(1, "abc"), Input::Wake, bytes(2, "d"), bytes(3, "ef"), gone(FIRST), bytes(4, "g")] {
            send(input);
        }
        inbox.collect();
        send(bytes(5, "later"));
        let mut part = || {
            let (arrived, more) = inbox.part_of_arrived(4);
            (texts(arrived).concat(), more)
        };
        assert_eq!(part(), ("abcd".into(), true));
        assert_eq!(part(), ("ef".into(), false), "the loss of the port comes next");
        assert_eq!(part(), (String::new(), false));
    }

    #[test]
    fn what_a_closed_link_has_left_is_forgotten_and_a_signal_is_not() {
        let (sender, inputs) = channel();
        let mut inbox = Inbox::new(inputs);
        for input in [bytes(1, "a"), Input::Signal(15.into())] {
            sender.send(input).expect("there is room");
        }
        inbox.forget(FIRST);
        assert_eq!(inbox.arrived(), []);
        assert!(matches!(inbox.next(Duration::ZERO), Ok(Some(Input::Signal(signal))) if signal.number() == 15));
    }

    #[test]
    fn what_a_new_link_says_before_the_old_one_is_closed_is_not_lost_with_it() {
        let (sender, inputs) = channel();
        let mut inbox = Inbox::new(inputs);
        let send = |input| sender.send(input).expect("there is room");
        for input in [bytes(1, "old"), bytes_of(SECOND, 2, "new"), gone(FIRST), bytes(3, " and last")] {
            send(input);
        }
        assert_eq!(texts(inbox.rest(FIRST)), ["old", " and last"]);
        inbox.forget(FIRST);
        send(bytes(4, "too late"));
        send(bytes_of(SECOND, 5, " and more"));
        assert_eq!(texts(inbox.arrived()), ["new", " and more"]);
        send(gone(FIRST));
        assert!(matches!(inbox.next(Duration::ZERO), Ok(None)), "the loss of the old one is nothing to the new one");
        send(gone(SECOND));
        assert!(matches!(inbox.next(Duration::ZERO), Ok(Some(Input::Gone { link: SECOND, .. }))));
    }
}
