//! What jobs have in common: the signals they get, and what they can do.

use std::collections::VecDeque;

use super::event::{Event, Facts, Outcome};
use super::keys::Typed;
use super::password::PasswordGuard;
use super::transmitter::{Sender, Transmitter};
use crate::endpoint::{Secrecy, Transmit};
use crate::time::Instant;
use crate::wire::{Message, Prompt, Text};

/// What a job is notified of.
#[derive(Clone, Copy, Debug)]
pub(super) enum Signal<'a> {
    /// It begins.
    Begin,
    /// The unit has printed something; the facts are up to date already.
    Heard(&'a Text, &'a Message),
    /// The unit has stopped us (`true`) or lets us go on; the transmitter knows already.
    Hold(bool),
    /// Its deadline has come, or it is looked after early.
    Tick,
    /// The user has had enough.
    Cancel,
    /// The port is gone: nothing can be sent or heard any more.
    LinkLost,
    /// In a recording: this was sent then.
    Typed(&'a Typed),
    /// In a recording: it has ended.
    Over,
}

/// What a job can do.
pub(super) struct Desk<'a> {
    pub(super) now: Instant,
    pub(super) transmitter: &'a mut Transmitter,
    pub(super) facts: &'a mut Facts,
    pub(super) events: &'a mut VecDeque<Event>,
    /// Words without a line end, the last thing the unit has printed: perhaps a question. `None` for signs alone, like the
    /// `>` of a command line.
    pub(super) pending: Option<&'a Text>,
    /// Set when what the unit prints from now on is an answer, and not part of a line it has fallen silent in.
    pub(super) cut: bool,
    /// Set when the job has read something from what it was told, and no recogniser had.
    pub(super) understood: bool,
    /// The line it has been given has been counted as not understood.
    pub(super) counted: bool,
    /// Bytes received so far: text that begins here or later is newer than this moment.
    pub(super) received: u64,
    /// Is told when secret bytes have been queued.
    pub(super) password: &'a mut PasswordGuard,
    /// What a job puts here goes out as if it were typed: a password among it is known by where it is asked for.
    pub(super) typed: Vec<u8>,
}

impl Desk<'_> {
    /// Sends keys.
    pub(super) fn send(&mut self, keys: &[u8]) {
        self.cut = true;
        // Only a unit that holds us lets this queue fill, and jobs send a few bytes between two deadlines.
        self.transmitter.push_text(keys, Secrecy::Open, Sender::Job);
    }

    /// Sends a secret and Enter.
    pub(super) fn send_secret(&mut self, secret: &[u8]) {
        self.transmitter.push_piece(Transmit { bytes: secret.to_vec(), secrecy: Secrecy::Secret });
        self.transmitter.push_piece(Transmit::open(*b"\r"));
        self.password.sent(secret);
        self.cut = true;
    }

    /// Leaves whatever question is open: Enter without an answer.
    pub(super) fn leave_dialogue(&mut self) {
        self.send(b"\r");
    }
}

/// A job.
pub(super) trait Work {
    /// Takes a signal; gives the outcome when it is over.
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome>;

    /// When it wants to be looked after.
    fn deadline(&self) -> Option<Instant>;

    /// Whether this is the question it waits for now. Where a unit ends it as a line and falls silent, only that tells it
    /// from a text about the same.
    fn awaits(&self, _: Prompt) -> bool {
        false
    }
}
