//! What threads find out for the loop, and how it hears of it.

use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use super::Console;
use super::connecting::Dial;
use crate::host;
use crate::host::unit;
use crate::tui::Input;

/// Answers that wait for the loop at most. A thread with another one waits until there is room.
const MOST_WAITING: usize = 64;
/// Orders that wait for the emulated unit at most.
const MOST_ORDERS: usize = 64;

/// What a thread has found out.
pub(super) enum Found {
    /// Something the app has asked for.
    Answer(Input),
    /// What came of dialling a network link.
    Dialled(Box<Dial>),
}

impl From<Input> for Found {
    fn from(input: Input) -> Self {
        Found::Answer(input)
    }
}

/// Where the loop finds what threads have reported.
pub(super) type Answers = Receiver<Found>;

/// The way of a thread to the loop.
#[derive(Clone)]
pub(super) struct Reporter {
    found: SyncSender<Found>,
    waker: SyncSender<host::Input>,
}

/// An order to the emulated unit, and where its answer comes.
pub(super) struct PendingOrder {
    line: String,
    answer: Receiver<unit::Answer>,
}

/// Answers come on a channel of their own, and wake the loop through its own.
pub(super) fn channel(waker: SyncSender<host::Input>) -> (Reporter, Answers) {
    let (found, answers) = sync_channel(MOST_WAITING);
    (Reporter { found, waker }, answers)
}

impl Reporter {
    /// Reports, from a thread that the loop does not wait for.
    pub(super) fn report(&self, found: impl Into<Found>) {
        if self.found.send(found.into()).is_ok() {
            wake(&self.waker);
        }
    }
}

/// Ends the loop's wait. A full channel does that by itself.
fn wake(waker: &SyncSender<host::Input>) {
    let _ = waker.try_send(host::Input::Wake);
}

impl Console {
    /// Takes what threads have found out, and says whether that was anything.
    pub(super) fn take_answers(&mut self) -> bool {
        let mut has_come = false;
        // A thread that reports without end does not keep the keys waiting.
        for _ in 0..MOST_WAITING {
            let Ok(found) = self.answers.try_recv() else { break };
            self.take_found(found);
            has_come = true;
        }
        while let Some(input) = self.next_ordered() {
            self.handle(input);
            has_come = true;
        }
        has_come
    }

    fn take_found(&mut self, found: Found) {
        match found {
            Found::Answer(input) => self.handle(input),
            Found::Dialled(dial) => self.take_dialled(*dial),
        }
    }

    fn next_ordered(&mut self) -> Option<Input> {
        let answer = match self.orders.front()?.answer.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(answer) => answer,
            Err(TryRecvError::Disconnected) => Err("the unit has not taken it".to_owned()),
        };
        self.orders.pop_front().map(|order| Input::Ordered { line: order.line, answer })
    }

    /// Has the emulated unit do something.
    pub(super) fn order(&mut self, line: String) {
        let refusal = match self.connection() {
            // The unit was on its link.
            None => "the unit is gone with its link, C starts a new one",
            Some(_) if self.orders.len() >= MOST_ORDERS => "too many orders wait for the unit",
            Some(link) => {
                // Each with a channel of its own, which has room: the unit's thread must never wait for the loop, which
                // waits for it when the link is closed.
                let (answered, answer) = sync_channel(1);
                let waker = self.sender.clone();
                link.order(&line, move |result| {
                    let _ = answered.try_send(result);
                    wake(&waker);
                });
                return self.orders.push_back(PendingOrder { line, answer });
            }
        };
        self.handle(Input::Ordered { line, answer: Err(refusal.to_owned()) });
    }

    /// Finds something out in a thread; where the system has none to give, here: late is better than never.
    pub(super) fn ask<T: Into<Found>>(&mut self, find_out: impl FnOnce() -> T + Send + 'static) {
        let work = Arc::new(Mutex::new(Some(find_out)));
        let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
        let (shared, reporter) = (Arc::clone(&work), self.reporter.clone());
        let started = thread::Builder::new().name("answer".to_owned()).spawn(move || {
            if let Some(find_out) = take(&shared) {
                reporter.report(find_out());
            }
        });
        if started.is_err()
            && let Some(find_out) = take(&work)
        {
            self.take_found(find_out().into());
        }
    }
}
