//! Signals as inputs, so that the program can leave in order. Where its loop does not look, they end it all the same.

use std::convert::Infallible;
use std::io;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};

use super::{Input, terminal};
use crate::time::Duration;

/// Turns interrupt, termination and hang-up into [`Input::Signal`] until it is dropped: on Windows Ctrl-C, Ctrl-Break,
/// and the window that is closed. While there is none, they end the process as they do by default.
///
/// Each one has to have a loop that takes its inputs: a signal that nobody takes ends the process.
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

    /// Starts listening, also for the signal that continues a stopped program: its screen is to be drawn again.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn of_screen(inputs: SyncSender<Input>) -> io::Result<Self> {
        system::listen(inputs, true).map(|_listening| Signals { _listening })
    }
}

/// A signal on its way to a loop. Dropping it says that the loop has taken it.
#[derive(Debug)]
pub struct Caught {
    number: i32,
    _untaken: SyncSender<Infallible>,
}

impl Caught {
    /// A signal, and what is disconnected as soon as it is taken.
    pub(super) fn new(number: i32) -> (Self, Receiver<Infallible>) {
        let (untaken, taken) = sync_channel(0);
        (Caught { number, _untaken: untaken }, taken)
    }

    /// The signal's number.
    pub fn number(&self) -> i32 {
        self.number
    }
}

#[cfg(test)]
impl From<i32> for Caught {
    fn from(number: i32) -> Self {
        Caught::new(number).0
    }
}

/// How often a loop is looked at that has not taken its signal.
const RETRY: Duration = Duration::from_millis(5);

/// How long a signal may go untaken: a loop that looks takes it within milliseconds. One that does not is blocked in a
/// read or a write that nobody ends, a full pipe or a stopped terminal.
const PATIENCE: Duration = Duration::from_secs(2);

/// The same when it is sent again. Not at once: a terminal and a supervisor may both send one.
#[cfg(unix)]
const PATIENCE_WHEN_REPEATED: Duration = Duration::from_millis(250);

/// The exit code of a program that was interrupted.
const INTERRUPTED: i32 = 130;

/// How long the terminal may take to be given back; one that is stopped takes nothing.
const GIVING_BACK: Duration = Duration::from_millis(500);

/// A signal that is being handed to a loop.
struct Delivery {
    inputs: SyncSender<Input>,
    /// While the channel is full.
    unsent: Option<Input>,
    taken: Receiver<Infallible>,
}

impl Delivery {
    fn new(signal: i32, inputs: SyncSender<Input>) -> Self {
        let (caught, taken) = Caught::new(signal);
        Delivery { inputs, unsent: Some(Input::Signal(caught)), taken }
    }

    /// Hands it over as soon as there is room. Says whether the loop has taken it, or is gone.
    fn is_over(&mut self) -> bool {
        if let Some(input) = self.unsent.take()
            && let Err(TrySendError::Full(back)) = self.inputs.try_send(input)
        {
            self.unsent = Some(back);
        }
        self.taken.try_recv() == Err(TryRecvError::Disconnected)
    }
}

/// Ends the process, whatever its loop is doing.
fn end_process() -> ! {
    // What blocks the loop may hold what writing to the terminal needs.
    let (done, given_back) = sync_channel(1);
    let giver = std::thread::Builder::new().name("giving back".into()).spawn(move || {
        terminal::give_back();
        let _ = done.try_send(());
    });
    if giver.is_ok() {
        let _ = given_back.recv_timeout(GIVING_BACK);
    }
    std::process::exit(INTERRUPTED)
}

#[cfg(unix)]
mod system {
    use std::io;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc::SyncSender;
    use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

    use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGTERM};
    use signal_hook::flag::register_conditional_default;
    use signal_hook::iterator::{Handle, Signals};

    use super::{Delivery, PATIENCE, PATIENCE_WHEN_REPEATED, RETRY};
    use crate::host::Input;
    use crate::time::Duration;

    pub const CONTINUES: Option<i32> = Some(SIGCONT);

    /// The signals that end a program.
    const ENDS: [i32; 3] = [SIGINT, SIGTERM, SIGHUP];

    /// What the system does by default is lost with the first handler, and has to be done in its place.
    struct Defaults {
        /// How many listen.
        listening: usize,
        /// Set while nobody does; `None` before anybody has.
        apply: Option<Arc<AtomicBool>>,
    }

    static DEFAULTS: Mutex<Defaults> = Mutex::new(Defaults { listening: 0, apply: None });

    fn defaults() -> MutexGuard<'static, Defaults> {
        DEFAULTS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[derive(Debug)]
    pub struct Listening(Handle);

    pub fn listen(inputs: SyncSender<Input>, of_screen: bool) -> io::Result<Listening> {
        let mut defaults = defaults();
        if defaults.apply.is_none() {
            let apply = Arc::new(AtomicBool::new(false));
            for signal in ENDS {
                register_conditional_default(signal, apply.clone())?;
            }
            defaults.apply = Some(apply);
        }
        let mut signals = Signals::new(ENDS.into_iter().chain(of_screen.then_some(SIGCONT)))?;
        let handle = signals.handle();
        std::thread::Builder::new().name("signals".into()).spawn(move || deliver_all(&mut signals, &inputs))?;
        defaults.listening += 1;
        defaults.set();
        Ok(Listening(handle))
    }

    fn deliver_all(signals: &mut Signals, inputs: &SyncSender<Input>) {
        let over = signals.handle();
        let mut next = None;
        while let Some(signal) = next.take().or_else(|| signals.forever().next()) {
            let mut delivery = Delivery::new(signal, inputs.clone());
            // Counted rather than measured: the time for which the process is stopped is not the loop's.
            let mut waited = Duration::ZERO;
            while !over.is_closed() && !delivery.is_over() {
                next = next.or_else(|| signals.pending().find(|signal| ENDS.contains(signal)));
                match (ENDS.contains(&signal), next) {
                    (true, None) if waited >= PATIENCE => super::end_process(),
                    (true, Some(_)) if waited >= PATIENCE_WHEN_REPEATED => super::end_process(),
                    // Nobody needs a screen that is about to go.
                    (false, Some(_)) => break,
                    _ => {}
                }
                std::thread::sleep(RETRY);
                waited += RETRY;
            }
        }
    }

    impl Defaults {
        fn set(&self) {
            if let Some(apply) = &self.apply {
                apply.store(self.listening == 0, Ordering::SeqCst);
            }
        }
    }

    impl Drop for Listening {
        fn drop(&mut self) {
            let mut defaults = defaults();
            defaults.listening -= 1;
            defaults.set();
            self.0.close();
        }
    }
}

#[cfg(not(unix))]
mod system {
    //! A process has one handler there, which cannot be taken back: it serves all that listen at the moment.

    use std::io;
    use std::sync::mpsc::SyncSender;
    use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

    use super::{Delivery, INTERRUPTED, PATIENCE, RETRY};
    use crate::host::Input;
    use crate::time::Duration;

    pub const CONTINUES: Option<i32> = None;

    /// What an interrupt is called elsewhere.
    const INTERRUPT: i32 = 2;

    /// All that listen, with their numbers.
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
        let mut deliveries: Vec<_> =
            all.into_iter().map(|(number, inputs)| (number, Delivery::new(INTERRUPT, inputs))).collect();
        let mut waited = Duration::ZERO;
        loop {
            let is_listening = |number: u64| listeners().all.iter().any(|(listening, _)| *listening == number);
            deliveries.retain_mut(|(number, delivery)| is_listening(*number) && !delivery.is_over());
            if deliveries.is_empty() {
                return;
            }
            if waited >= PATIENCE {
                super::end_process();
            }
            std::thread::sleep(RETRY);
            waited += RETRY;
        }
    }

    impl Drop for Listening {
        fn drop(&mut self) {
            listeners().all.retain(|(number, _)| *number != self.0);
        }
    }
}

/// Whether a signal continues a program that was stopped.
pub fn continues(signal: &Caught) -> bool {
    system::CONTINUES == Some(signal.number())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_taken_when_its_loop_has_looked_at_it_and_not_when_it_waits() {
        let (sender, inputs) = sync_channel(1);
        sender.send(Input::Wake).expect("there is room");
        let mut delivery = Delivery::new(15, sender);
        assert!(!delivery.is_over(), "the channel is full");
        assert!(matches!(inputs.recv(), Ok(Input::Wake)));
        assert!(!delivery.is_over(), "it waits on the channel");
        let looked_at = inputs.recv();
        assert!(matches!(&looked_at, Ok(Input::Signal(caught)) if caught.number() == 15));
        assert!(!delivery.is_over(), "it is looked at");
        drop(looked_at);
        assert!(delivery.is_over());
    }

    #[test]
    fn a_loop_that_has_ended_wants_no_signal() {
        let (sender, inputs) = sync_channel(1);
        let mut delivery = Delivery::new(15, sender);
        assert!(!delivery.is_over());
        drop(inputs);
        assert!(delivery.is_over());
    }
}
