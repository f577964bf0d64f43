//! Runs an endpoint over a connection, without a screen: bytes and deadlines in, bytes out, and a look at the endpoint
//! after each step.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, SyncSender};

use super::clock::Clock;
use super::comeback::Cable;
use super::link::{Connection, LinkError, SendError};
use super::recorder::Recorder;
use super::replay::RecordingError;
use super::{Closed, Inbox, Input};
use crate::endpoint::{Arrived, Endpoint};
use crate::record::Record;
use crate::time::{Duration, Instant};

/// A connection with the loop that serves it.
#[derive(Debug)]
pub struct Pump {
    cable: Cable,
    inbox: Inbox,
    clock: Clock,
    recorder: Recorder,
}

/// Why a loop ended before the command had what it wanted. The endpoint is as it was, and the pump can run it again: to
/// cancel what it does, for example.
#[derive(Debug, thiserror::Error)]
pub enum PumpError {
    /// The port failed.
    #[error(transparent)]
    Link(LinkError),
    /// The port takes no more bytes.
    #[error("{port}: {error}")]
    Send {
        /// Which port.
        port: String,
        /// Why.
        error: SendError,
    },
    /// The deadline is over.
    #[error("no end in time")]
    Deadline,
    /// A signal came.
    #[error("interrupted")]
    Interrupted,
    /// The recording that was played has ended.
    #[error("the recording has ended")]
    Over,
    /// The recording that was played is not one from some place on.
    #[error(transparent)]
    Recording(RecordingError),
}

/// Longest wait for anything: bounds the arithmetic, nothing else.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

impl Pump {
    /// A pump for an open link, whose inputs (and signals) come on this channel.
    pub fn new(cable: Cable, inputs: Receiver<Input>, clock: Clock, recorder: Recorder) -> Self {
        Pump { cable, inbox: Inbox::new(inputs), clock, recorder }
    }

    /// Runs until `look` breaks with what the command wanted, or `deadline`. `look` sees the endpoint after each step, and
    /// what has gone wrong with the recording meanwhile; `record` gives the endpoint's own record, which the recording follows.
    ///
    /// # Errors
    /// If the port fails, the deadline passes, or a signal comes.
    pub fn run<E: Endpoint, T>(
        &mut self,
        endpoint: &mut E,
        deadline: Instant,
        record: impl Fn(&E) -> &Record,
        mut look: impl FnMut(&mut E, Option<String>) -> ControlFlow<T>,
    ) -> Result<T, PumpError> {
        loop {
            let arrived = self.inbox.arrived();
            let now = self.hand_over(&arrived, endpoint, &record);
            endpoint.handle_timeout(now);
            self.drain(endpoint, &record)?;
            if let ControlFlow::Break(result) = look(endpoint, self.recorder.take_warning()) {
                // A command given in the last look may have something to say.
                self.drain(endpoint, &record)?;
                return Ok(result);
            }
            self.drain(endpoint, &record)?;
            if now >= deadline {
                return Err(PumpError::Deadline);
            }
            let wake = endpoint.poll_timeout().unwrap_or(Instant::NEVER).min(deadline);
            match self.inbox.next(self.clock.until(wake).min(LONGEST_WAIT)) {
                Ok(Some(Input::Gone { error, .. })) => {
                    let rest = self.cable.rest(&mut self.inbox);
                    self.hand_over(&rest, endpoint, &record);
                    return Err(PumpError::Link(error));
                }
                Ok(Some(Input::Signal(_))) => return Err(PumpError::Interrupted),
                Ok(Some(Input::Bytes { .. } | Input::Typed(_) | Input::TypedEnd | Input::Wake) | None) => {}
                // The connection's threads hold the other end as long as it lives.
                Err(Closed) => return Err(self.send_error(SendError::Gone)),
            }
        }
    }

    /// Whether a lost link is looked for.
    pub fn may_come_back(&self) -> bool {
        self.cable.may_come_back()
    }

    /// Closes a lost link; `endpoint` gets the last of what it has brought.
    pub fn lose<E: Endpoint>(&mut self, endpoint: &mut E, record: impl Fn(&E) -> &Record) {
        let rest = self.cable.lose(&mut self.inbox, self.clock.now());
        self.hand_over(&rest, endpoint, &record);
    }

    /// Opens a lost link again if it is time to try, and it is back. Gives its name, which may be another one.
    pub fn try_again(&mut self, inputs: &SyncSender<Input>) -> Option<&str> {
        self.cable.try_again(self.clock.now(), self.clock, inputs).map(Connection::port)
    }

    /// Waits for this long while the link is lost; a signal ends it. No bytes are handed over: there is no connection that
    /// could bring any.
    ///
    /// # Errors
    /// If a signal comes.
    pub fn pause(&mut self, time: Duration) -> Result<(), PumpError> {
        let until = self.clock.now() + time;
        while self.clock.now() < until {
            self.inbox.arrived();
            if let Ok(Some(Input::Signal(_))) = self.inbox.next(self.clock.until(until)) {
                return Err(PumpError::Interrupted);
            }
        }
        Ok(())
    }

    /// The clock that all moments are of.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The recorder, to ask what became of the recording.
    pub fn recorder_mut(&mut self) -> &mut Recorder {
        &mut self.recorder
    }

    fn drain<E: Endpoint>(&mut self, endpoint: &mut E, record: &impl Fn(&E) -> &Record) -> Result<(), PumpError> {
        while let Some(transmit) = endpoint.poll_transmit() {
            self.recorder.follow(record(endpoint));
            let sent = self.cable.connection().map_or(Err(SendError::Gone), |link| link.send(transmit.bytes));
            if let Err(error) = sent {
                let rest = self.cable.rest(&mut self.inbox);
                self.hand_over(&rest, endpoint, record);
                return Err(self.send_error(error));
            }
        }
        Ok(())
    }

    /// Hands over what has arrived, before the clock goes on. Gives the moment it is.
    fn hand_over<E: Endpoint>(
        &mut self,
        arrived: &[Arrived],
        endpoint: &mut E,
        record: &impl Fn(&E) -> &Record,
    ) -> Instant {
        let now = self.clock.now();
        if !arrived.is_empty() {
            endpoint.handle_backlog(now, arrived);
            self.recorder.follow(record(endpoint));
        }
        now
    }

    fn send_error(&self, error: SendError) -> PumpError {
        PumpError::Send { port: self.cable.port().to_owned(), error }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::endpoint::{Secrecy, Transmit};
    use crate::host::LinkId;
    use crate::host::link::{LinkSpec, Options};
    use crate::host::pty::Pty;
    use crate::record::Direction;

    /// Notes what it hears, in order.
    #[derive(Default)]
    struct Notes {
        record: Record,
        told: Vec<String>,
    }

    impl Endpoint for Notes {
        fn handle_bytes(&mut self, _now: Instant, _bytes: &[u8]) {}

        fn handle_backlog(&mut self, now: Instant, backlog: &[Arrived]) {
            for piece in backlog {
                assert!(piece.at < now);
                self.record.push(piece.at, Direction::FromUnit, Secrecy::Open, &piece.bytes);
                let text = String::from_utf8_lossy(&piece.bytes).into_owned();
                self.told.push(format!("{text} of {:?}", piece.at.since_start()));
            }
        }

        fn handle_timeout(&mut self, _now: Instant) {
            self.told.push("it is late".into());
        }

        fn poll_transmit(&mut self) -> Option<Transmit> {
            None
        }

        fn poll_timeout(&self) -> Option<Instant> {
            Some(Instant::ZERO)
        }
    }

    fn pump(recorder: Recorder) -> (Pty, Pump, std::sync::mpsc::SyncSender<Input>) {
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        let (sender, inputs) = crate::host::channel();
        let clock = Clock::start();
        let spec = LinkSpec::Serial(pty.path().to_owned());
        let connection =
            Connection::open(&spec, Options { baud: 115_200 }, clock, sender.clone()).expect("the link opens");
        (pty, Pump::new(Cable::new(connection, None), inputs, clock, recorder), sender)
    }

    #[test]
    fn what_arrived_while_the_loop_was_kept_away_is_looked_at_before_the_clock() {
        let (_pty, mut pump, sender) = pump(Recorder::nothing());
        for (at, text) in [(1, "XOFF"), (2, "XON")] {
            let at = Instant::ZERO + Duration::from_nanos(at);
            let link = LinkId::next();
            sender.send(Input::Bytes { link, at, bytes: text.into() }).expect("there is room");
        }
        let mut notes = Notes::default();
        let ended = pump.run(&mut notes, Instant::ZERO, |notes| &notes.record, |_, _| ControlFlow::<()>::Continue(()));
        assert!(matches!(ended, Err(PumpError::Deadline)), "{ended:?}");
        assert_eq!(notes.told, ["XOFF of 1ns", "XON of 2ns", "it is late"]);
    }

    #[test]
    fn what_the_reader_has_brought_after_the_writer_noticed_the_loss_is_handed_over() {
        let (_pty, mut pump, sender) = pump(Recorder::nothing());
        let link = pump.cable.connection().expect("open").id();
        let error = LinkError {
            port: "u0".into(),
            operation: crate::host::link::Operation::Write,
            cause: crate::host::link::Cause::Gone,
        };
        let last = Input::Bytes { link, at: Instant::ZERO, bytes: b"last words".to_vec() };
        for input in [Input::Gone { link, error }, last] {
            sender.send(input).expect("there is room");
        }
        let mut notes = Notes::default();
        let ended = pump.run(&mut notes, Instant::NEVER, |notes| &notes.record, |_, _| ControlFlow::<()>::Continue(()));
        assert!(matches!(ended, Err(PumpError::Link(_))), "{ended:?}");
        assert_eq!(notes.told.last().map(String::as_str), Some("last words of 0ns"));
    }

    #[test]
    fn that_a_recording_ends_is_told_at_once() {
        let (_pty, mut pump, sender) = pump(crate::host::recorder::tests::doomed());
        let x = Input::Bytes { link: LinkId::next(), at: Instant::ZERO, bytes: b"x".to_vec() };
        sender.send(x).expect("there is room");
        let told = pump.run(
            &mut Notes::default(),
            Instant::NEVER,
            |notes| &notes.record,
            |_, warning| warning.map_or(ControlFlow::Continue(()), ControlFlow::Break),
        );
        assert!(told.is_ok_and(|warning| warning.starts_with("the recording ends here: ")));
    }
}
