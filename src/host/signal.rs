//! Signals as inputs: whoever ends the program lets it leave in order.

use std::io;
use std::sync::mpsc::{SyncSender, TrySendError};

use super::Input;

/// Turns interrupt, termination and hang-up into [`Input::Signal`] until it is dropped: on Windows Ctrl-C, Ctrl-Break,
/// and the window that is closed.
#[derive(Debug)]
pub struct Signals {
    _listening: system::Listening,
}

impl Signals {
    /// Starts listening.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn start(inputs: SyncSender<Input>) -> io::Result<Self> {
        system::listen(inputs, false).map(|_listening| Signals { _listening })
    }

    /// Starts listening, also for the signal that continues a stopped program: its screen is to be drawn anew.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of_screen(inputs: SyncSender<Input>) -> io::Result<Self> {
        system::listen(inputs, true).map(|_listening| Signals { _listening })
    }
}

/// How often a signal is offered while the channel is full.
const RETRY: crate::time::Duration = crate::time::Duration::from_millis(5);

/// Puts a signal on the channel as soon as there is room, unless it is over meanwhile.
fn offer(signal: i32, inputs: &SyncSender<Input>, is_over: impl Fn() -> bool) {
    let mut input = Input::Signal(signal);
    while !is_over() {
        match inputs.try_send(input) {
            Ok(()) | Err(TrySendError::Disconnected(_)) => return,
            Err(TrySendError::Full(back)) => input = back,
        }
        std::thread::sleep(RETRY);
    }
}

#[cfg(unix)]
mod system {
    use std::io;
    use std::sync::mpsc::SyncSender;

    use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGTERM};

    use crate::host::Input;

    pub const CONTINUES: Option<i32> = Some(SIGCONT);

    #[derive(Debug)]
    pub struct Listening(signal_hook::iterator::Handle);

    pub fn listen(inputs: SyncSender<Input>, of_screen: bool) -> io::Result<Listening> {
        let numbers = [SIGINT, SIGTERM, SIGHUP].into_iter().chain(of_screen.then_some(SIGCONT));
        let mut signals = signal_hook::iterator::Signals::new(numbers)?;
        let handle = signals.handle();
        let over = handle.clone();
        std::thread::Builder::new().name("signals".into()).spawn(move || {
            signals.forever().for_each(|signal| super::offer(signal, &inputs, || over.is_closed()));
        })?;
        Ok(Listening(handle))
    }

    impl Drop for Listening {
        fn drop(&mut self) {
            self.0.close();
        }
    }
}

#[cfg(not(unix))]
mod system {
    //! A process has one handler there, which cannot be taken back: it serves whoever listens at the moment.

    use std::io;
    use std::sync::mpsc::SyncSender;
    use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

    use crate::host::Input;

    pub const CONTINUES: Option<i32> = None;

    /// What an interrupt is called elsewhere.
    const INTERRUPT: i32 = 2;

    /// The exit code of a program that is interrupted and has nothing to leave in order.
    const INTERRUPTED: i32 = 130;

    /// Those who listen, with their numbers.
    #[derive(Debug)]
    struct Listeners {
        next: u64,
        all: Vec<(u64, SyncSender<Input>)>,
    }

    static LISTENERS: Mutex<Listeners> = Mutex::new(Listeners { next: 0, all: Vec::new() });

    #[derive(Debug)]
    pub struct Listening(u64);

    fn listeners() -> MutexGuard<'static, Listeners> {
        LISTENERS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn listen(inputs: SyncSender<Input>, _of_screen: bool) -> io::Result<Listening> {
        static HANDLER: OnceLock<Result<(), String>> = OnceLock::new();
        let set = HANDLER.get_or_init(|| ctrlc::set_handler(interrupted).map_err(|error| error.to_string()));
        set.clone().map_err(io::Error::other)?;
        let mut listeners = listeners();
        let number = listeners.next;
        listeners.next += 1;
        listeners.all.push((number, inputs));
        Ok(Listening(number))
    }

    fn interrupted() {
        let all = listeners().all.clone();
        if all.is_empty() {
            std::process::exit(INTERRUPTED);
        }
        for (number, inputs) in all {
            super::offer(INTERRUPT, &inputs, || listeners().all.iter().all(|(listening, _)| *listening != number));
        }
    }

    impl Drop for Listening {
        fn drop(&mut self) {
            listeners().all.retain(|(number, _)| *number != self.0);
        }
    }
}

/// Whether a signal continues a program that was stopped.
pub fn continues(signal: i32) -> bool {
    system::CONTINUES == Some(signal)
}
