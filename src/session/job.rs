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
    /// Its deadline has come, or time has passed before that.
    Tick,
    /// The user cancels the job.
    Cancel,
    /// The port is gone: nothing can be sent or heard any more.
    LinkLost,
    /// In a recording: this was sent.
    Typed(&'a Typed),
    /// In a recording: it has ended.
    Over,
}

/// What a job can see and do.
pub(super) struct Desk<'a> {
    pub(super) now: Instant,
    pub(super) transmitter: &'a mut Transmitter,
    pub(super) facts: &'a mut Facts,
    pub(super) events: &'a mut VecDeque<Event>,
    /// Words without a line end, the last thing the unit has printed: perhaps a question. `None` for signs alone, like
    /// the `>` of a command line.
    pub(super) pending: Option<&'a Text>,
    /// To be set if what the unit prints from now on is an answer, and not the rest of the line in which it fell
    /// silent.
    pub(super) cut: bool,
    /// To be set if the job has understood a line that no recogniser did.
    pub(super) understood: bool,
    /// The line that the job is given has been counted as not understood.
    pub(super) counted: bool,
    /// Bytes received so far: text that begins here or later is newer than this moment.
    pub(super) received: u64,
    /// Has to be told when secret bytes have been queued.
    pub(super) password: &'a mut PasswordGuard,
    /// What a job puts here goes out as if it were typed: a password in it is recognised by the question it answers.
    pub(super) typed: Vec<u8>,
}

impl Desk<'_> {
    /// Sends keys.
    pub(super) fn send(&mut self, keys: &[u8]) {
        self.cut = true;
        // There is room: the queue fills only while the unit holds us, and jobs send a few bytes between two deadlines.
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
    /// Takes a signal; returns the outcome once the job is over.
    fn handle(&mut self, signal: Signal<'_>, desk: &mut Desk<'_>) -> Option<Outcome>;

    /// When the job wants its next [`Signal::Tick`].
    fn deadline(&self) -> Option<Instant>;

    /// Whether the job waits for this question now. If a unit ends a question as a line and falls silent, only this
    /// distinguishes it from a text on the same subject.
    fn awaits(&self, _: Prompt) -> bool {
        false
    }
}
