//! Waiting for what may block for ever, an answer at the terminal or a server: in a thread of its own, so that signals are
//! heard meanwhile.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use super::error::{CliError, Kind};
use crate::host::Input;
use crate::host::signal::Signals;

/// Hears signals from now on, until what it gives is dropped.
///
/// # Errors
/// If the system refuses.
pub fn hear_signals(inputs: SyncSender<Input>) -> Result<Signals, CliError> {
    Signals::start(inputs)
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen for signals")))
}

/// Does something in a thread of its own, which wakes the loop when it has.
///
/// # Errors
/// If the system gives no thread.
pub fn begin<T: Send + 'static>(
    wake: SyncSender<Input>,
    act: impl FnOnce() -> T + Send + 'static,
) -> Result<Receiver<T>, CliError> {
    let (result, done) = sync_channel(1);
    let thread = thread::Builder::new().name("waiting".into()).spawn(move || {
        let acted = act();
        if result.send(acted).is_ok() {
            let _ = wake.send(Input::Wake);
        }
    });
    thread.map(|_| done).map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot wait")))
}

/// Waits for what was begun. Anything else that comes on the channel meanwhile is thrown away, except a signal.
///
/// # Errors
/// If the user interrupts.
pub fn end<T>(inputs: &Receiver<Input>, done: &Receiver<T>) -> Result<T, CliError> {
    loop {
        match inputs.recv() {
            Ok(Input::Signal(_)) => return Err(CliError::interrupted()),
            Ok(_) => {}
            Err(_) => return Err(CliError::message(Kind::Failed, "nobody answers")),
        }
        if let Ok(result) = done.try_recv() {
            return Ok(result);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host;

    #[test]
    fn a_signal_ends_the_wait_and_so_does_what_is_waited_for() {
        let (sender, inputs) = host::channel();
        let done = begin(sender.clone(), || "yes").map_err(|error| error.to_string()).expect("a thread");
        assert_eq!(end(&inputs, &done).ok(), Some("yes"));
        let (never, undone) = sync_channel::<&str>(1);
        sender.send(Input::Wake).and_then(|()| sender.send(Input::Signal(15.into()))).expect("there is room");
        let error = end(&inputs, &undone).expect_err("a signal");
        assert_eq!(error.kind, Kind::Interrupted);
        drop(never);
    }
}
