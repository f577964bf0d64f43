//! A recording played into a session, in its own time: seconds pass as fast as the file is read.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, TryRecvError};

use crate::endpoint::Endpoint;
use crate::host::Input;
use crate::host::pump::PumpError;
use crate::host::replay::Recording;
use crate::record::{Direction, Piece};
use crate::session::Session;
use crate::time::{Duration, Instant};

/// A recording under way.
pub struct Playback {
    recording: Recording,
    /// Signals come here.
    inputs: Receiver<Input>,
    now: Instant,
    /// Read, and not due yet.
    next: Option<Piece>,
}

/// How long timers go on after the last byte: the silence after a prompt or a page is still to pass.
const AFTER_THE_END: Duration = Duration::from_secs(2);

impl Playback {
    /// A recording at its beginning.
    pub fn new(recording: Recording, inputs: Receiver<Input>) -> Self {
        Playback { recording, inputs, now: Instant::ZERO, next: None }
    }

    /// Plays until `look` breaks, `until`, or the end.
    ///
    /// # Errors
    /// [`PumpError::Over`] at the end; and if the file fails or a signal comes.
    pub fn run<T>(
        &mut self,
        session: &mut Session,
        until: Instant,
        mut look: impl FnMut(&mut Session, Instant) -> ControlFlow<T>,
    ) -> Result<T, PumpError> {
        loop {
            match self.inputs.try_recv() {
                Ok(Input::Signal(_)) => return Err(PumpError::Interrupted),
                Ok(_) | Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
            }
            if let ControlFlow::Break(result) = look(session, self.now) {
                return Ok(result);
            }
            if self.next.is_none() {
                self.next = self.recording.next().map_err(PumpError::Recording)?;
            }
            let due = self.next.as_ref().map(moment);
            let timer = session.poll_timeout().filter(|&at| match due {
                Some(due) => at <= due,
                None => at <= self.now + AFTER_THE_END,
            });
            let then = match (timer, due) {
                (Some(at), _) | (None, Some(at)) => at.max(self.now),
                (None, None) => return Err(PumpError::Over),
            };
            if then > until {
                self.now = until;
                return Err(PumpError::Deadline);
            }
            self.now = then;
            match (timer, self.next.take()) {
                (Some(_), next) => {
                    self.next = next;
                    session.handle_timeout(then);
                }
                (None, Some(Piece::Bytes { direction: Direction::FromUnit, bytes, .. })) => {
                    session.handle_bytes(then, &bytes);
                }
                (None, Some(Piece::Bytes { direction: Direction::ToUnit, bytes, .. })) => {
                    session.handle_sent(then, &bytes);
                }
                (None, Some(Piece::Mark { text, .. })) => session.handle_mark(then, &text),
                (None, Some(Piece::Header(_)) | None) => {}
            }
        }
    }

    /// The moment it has come to, since the recording began.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// The recording.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }
}

fn moment(piece: &Piece) -> Instant {
    match piece {
        Piece::Header(_) => Instant::ZERO,
        Piece::Bytes { at, .. } | Piece::Mark { at, .. } => *at,
    }
}
