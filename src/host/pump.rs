//! Runs an endpoint over a connection, without a screen: bytes and deadlines in, bytes out, and a look at the endpoint
//! after each step.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

use super::Input;
use super::clock::Clock;
use super::link::{Connection, LinkError, SendError};
use super::recorder::Recorder;
use super::replay::RecordingError;
use crate::endpoint::Endpoint;
use crate::record::Record;
use crate::time::{Duration, Instant};

/// A connection with the loop that serves it.
#[derive(Debug)]
pub struct Pump {
    connection: Connection,
    inputs: Receiver<Input>,
    clock: Clock,
    recorder: Recorder,
}

/// Why a loop ended before the command was content. The endpoint is as it was, and the pump can run it again: to
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
    /// A signal came (its number).
    #[error("interrupted")]
    Interrupted(i32),
    /// The recording that was played has ended.
    #[error("the recording has ended")]
    Over,
    /// The recording that was played is none from some place on.
    #[error(transparent)]
    Recording(RecordingError),
}

/// Longest wait for anything: bounds the arithmetic, nothing else.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

impl Pump {
    /// A pump for an open connection, whose inputs (and signals) come on this channel.
    pub fn new(connection: Connection, inputs: Receiver<Input>, clock: Clock, recorder: Recorder) -> Self {
        Pump { connection, inputs, clock, recorder }
    }

    /// Runs until `look` breaks with what the command wanted, or `deadline`. `look` sees the endpoint after each step;
    /// `record` gives the endpoint's own record, which the recording follows.
    ///
    /// # Errors
    /// If the port fails, the deadline passes, or a signal comes.
    pub fn run<E: Endpoint, T>(
        &mut self,
        endpoint: &mut E,
        deadline: Instant,
        record: impl Fn(&E) -> &Record,
        mut look: impl FnMut(&mut E, Instant) -> ControlFlow<T>,
    ) -> Result<T, PumpError> {
        loop {
            let now = self.clock.now();
            endpoint.handle_timeout(now);
            self.drain(endpoint, &record)?;
            if let ControlFlow::Break(result) = look(endpoint, now) {
                // A command given in the last look may have something to say.
                self.drain(endpoint, &record)?;
                return Ok(result);
            }
            self.drain(endpoint, &record)?;
            if now >= deadline {
                return Err(PumpError::Deadline);
            }
            let wake = endpoint.poll_timeout().unwrap_or(Instant::NEVER).min(deadline);
            match self.inputs.recv_timeout(self.clock.until(wake).min(LONGEST_WAIT)) {
                Ok(Input::Bytes { at, bytes }) => {
                    endpoint.handle_bytes(at, &bytes);
                    self.recorder.follow(record(endpoint));
                }
                Ok(Input::Gone(error)) => return Err(PumpError::Link(error)),
                Ok(Input::Signal(signal)) => return Err(PumpError::Interrupted(signal)),
                Ok(Input::Typed(_) | Input::TypedEnd | Input::Wake) | Err(RecvTimeoutError::Timeout) => {}
                // The connection's threads hold the other end as long as it lives.
                Err(RecvTimeoutError::Disconnected) => {
                    let port = self.connection.port().to_owned();
                    return Err(PumpError::Send { port, error: SendError::Gone });
                }
            }
        }
    }

    /// Goes on over another connection, which puts its inputs on the same channel.
    pub fn replace(&mut self, connection: Connection) {
        self.connection = connection;
    }

    /// Waits so long, whatever else comes; a signal ends it.
    ///
    /// # Errors
    /// If a signal comes.
    pub fn pause(&mut self, time: Duration) -> Result<(), PumpError> {
        let until = self.clock.now() + time;
        while self.clock.now() < until {
            if let Ok(Input::Signal(signal)) = self.inputs.recv_timeout(self.clock.until(until)) {
                return Err(PumpError::Interrupted(signal));
            }
        }
        Ok(())
    }

    /// The connection.
    pub fn connection(&self) -> &Connection {
        &self.connection
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
            self.connection
                .send(transmit.bytes)
                .map_err(|error| PumpError::Send { port: self.connection.port().to_owned(), error })?;
        }
        Ok(())
    }
}
