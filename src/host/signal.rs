//! Signals as inputs: whoever ends the program lets it leave in order.

use std::io;
use std::sync::mpsc::SyncSender;
#[cfg(unix)]
use std::sync::mpsc::TrySendError;

#[cfg(unix)]
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGTERM};

use super::Input;

/// Turns interrupt, termination and hang-up into [`Input::Signal`] until it is dropped.
#[derive(Debug)]
pub struct Signals {
    #[cfg(unix)]
    handle: signal_hook::iterator::Handle,
}

#[cfg(unix)]
impl Signals {
    /// Starts listening.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn start(inputs: SyncSender<Input>) -> io::Result<Self> {
        Signals::listen(inputs, &[SIGINT, SIGTERM, SIGHUP])
    }

    /// Starts listening, also for the signal that continues a stopped program: its screen is to be drawn anew.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of_screen(inputs: SyncSender<Input>) -> io::Result<Self> {
        Signals::listen(inputs, &[SIGINT, SIGTERM, SIGHUP, SIGCONT])
    }

    fn listen(inputs: SyncSender<Input>, numbers: &[i32]) -> io::Result<Self> {
        let mut signals = signal_hook::iterator::Signals::new(numbers)?;
        let handle = signals.handle();
        let over = handle.clone();
        std::thread::Builder::new().name("signals".into()).spawn(move || {
            for signal in signals.forever() {
                let mut input = Input::Signal(signal);
                while !over.is_closed() {
                    match inputs.try_send(input) {
                        Ok(()) | Err(TrySendError::Disconnected(_)) => break,
                        Err(TrySendError::Full(back)) => input = back,
                    }
                    std::thread::sleep(RETRY);
                }
            }
        })?;
        Ok(Signals { handle })
    }
}

/// How often a signal is offered while the channel is full.
#[cfg(unix)]
const RETRY: crate::time::Duration = crate::time::Duration::from_millis(5);

#[cfg(unix)]
impl Drop for Signals {
    fn drop(&mut self) {
        self.handle.close();
    }
}

#[cfg(not(unix))]
impl Signals {
    /// Nothing to listen to: Ctrl-C ends the program, which leaves no port behind.
    ///
    /// # Errors
    /// Never.
    pub fn start(_inputs: SyncSender<Input>) -> io::Result<Self> {
        Ok(Signals {})
    }

    /// Nothing to listen to.
    ///
    /// # Errors
    /// Never.
    pub fn of_screen(inputs: SyncSender<Input>) -> io::Result<Self> {
        Signals::start(inputs)
    }
}

/// Whether a signal continues a program that was stopped.
pub fn continues(signal: i32) -> bool {
    cfg!(unix) && signal == CONTINUES
}

#[cfg(unix)]
const CONTINUES: i32 = SIGCONT;
/// There is none.
#[cfg(not(unix))]
const CONTINUES: i32 = 0;
