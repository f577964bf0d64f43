//! Where the threads of a port put what they have heard, and what became of the port.
//!
//! Ports differ in how they wait and stop; delivering what they heard is the same for all.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};

use super::link::{Cause, LinkError, Operation};
use super::{Input, LinkId};
use crate::time::{Duration, Instant};

/// How often it is tried again to hand over bytes while the channel is full. The owner is late then, and a wait on the
/// channel itself could not be called off.
const RETRY: Duration = Duration::from_millis(2);

/// The threads' way to the owner of the connection.
#[derive(Debug)]
pub(super) struct Outlet {
    /// The port as the user named it.
    port: String,
    link: LinkId,
    inputs: SyncSender<Input>,
    /// Whether it has been said that the port is gone.
    gone: AtomicBool,
}

impl Outlet {
    pub(super) fn new(port: String, link: LinkId, inputs: SyncSender<Input>) -> Self {
        Outlet { port, link, inputs, gone: AtomicBool::new(false) }
    }

    /// Hands over what has been read; `false` if nobody wants it any more. `wait` waits for this long, and says whether
    /// the connection is being closed.
    pub(super) fn deliver(&self, at: Instant, bytes: Vec<u8>, wait: impl Fn(Duration) -> bool) -> bool {
        self.put(Input::Bytes { link: self.link, at, bytes }, wait)
    }

    /// Says that the port is gone, and why. The second thread that notices says nothing.
    pub(super) fn report(&self, operation: Operation, cause: Cause, wait: impl Fn(Duration) -> bool) {
        if !self.gone.swap(true, Ordering::Relaxed) {
            let error = LinkError { port: self.port.clone(), operation, cause };
            self.put(Input::Gone { link: self.link, error }, wait);
        }
    }

    fn put(&self, mut input: Input, wait: impl Fn(Duration) -> bool) -> bool {
        loop {
            match self.inputs.try_send(input) {
                Ok(()) => return true,
                Err(TrySendError::Disconnected(_)) => return false,
                Err(TrySendError::Full(back)) => input = back,
            }
            if wait(RETRY) {
                return false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::mpsc::sync_channel;

    use super::*;

    #[test]
    fn what_finds_no_room_waits_until_there_is_some_or_the_connection_is_closed() {
        let (inputs, received) = sync_channel(1);
        let outlet = Outlet::new("p".into(), LinkId::next(), inputs);
        let wakes = Cell::new(0);
        assert!(outlet.deliver(Instant::ZERO, vec![1], |_| unreachable!("there is room")));
        let makes_room = |_| {
            wakes.set(wakes.get() + 1);
            if wakes.get() == 3 {
                received.recv().expect("the first one");
            }
            false
        };
        assert!(outlet.deliver(Instant::ZERO, vec![1], makes_room));
        assert_eq!(wakes.get(), 3);
        assert!(!outlet.deliver(Instant::ZERO, vec![1], |_| true), "it is being closed");
        drop(received);
        assert!(!outlet.deliver(Instant::ZERO, vec![1], |_| unreachable!("nobody is there")));
    }

    #[test]
    fn a_port_goes_once() {
        let (inputs, received) = sync_channel(4);
        let outlet = Outlet::new("p".into(), LinkId::next(), inputs);
        outlet.report(Operation::Read, Cause::Gone, |_| false);
        outlet.report(Operation::Write, Cause::Gone, |_| false);
        let Ok(Input::Gone { error, .. }) = received.try_recv() else { panic!("it is said") };
        assert_eq!((error.port.as_str(), error.operation), ("p", Operation::Read));
        assert!(received.try_recv().is_err(), "and not twice");
    }
}
