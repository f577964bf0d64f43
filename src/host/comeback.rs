//! A link that may come back after it was lost: the cable was pulled out and is plugged in again.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::clock::Clock;
use super::link::{Connection, LinkSpec, Options};
use super::ports::{self, Port};
use super::{Inbox, Input};
use crate::endpoint::Arrived;
use crate::time::{Duration, Instant};

/// A link that may be lost and come back.
#[derive(Debug)]
pub struct Cable {
    /// `None` while the link is lost.
    connection: Option<Connection>,
    /// `None` where a lost link does not come back.
    comeback: Option<Comeback>,
    /// When a lost link is tried again.
    retry_at: Option<Instant>,
    port: String,
}

impl Cable {
    /// An open link, and what has to come back when it is lost.
    pub fn new(connection: Connection, comeback: Option<Comeback>) -> Self {
        let port = connection.port().to_owned();
        Cable { connection: Some(connection), comeback, retry_at: None, port }
    }

    /// The connection, while there is one.
    pub fn connection(&self) -> Option<&Connection> {
        self.connection.as_ref()
    }

    /// The port as it is called, or was when the link was lost.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Whether a lost link is looked for.
    pub fn may_come_back(&self) -> bool {
        self.comeback.is_some()
    }

    /// When a lost link is tried again.
    pub fn retry_at(&self) -> Option<Instant> {
        self.retry_at
    }

    /// What the link has brought and nobody has taken: where the writer has noticed the loss first, the reader had more to
    /// hand out.
    pub fn rest(&self, inbox: &mut Inbox) -> Vec<Arrived> {
        self.connection.as_ref().map_or_else(Vec::new, |connection| inbox.rest(connection.id()))
    }

    /// The link is lost: closes it, and gives the last bytes that it has brought.
    pub fn lose(&mut self, inbox: &mut Inbox, now: Instant) -> Vec<Arrived> {
        if let Some(comeback) = &mut self.comeback {
            comeback.lost();
            self.retry_at = Some(now + Comeback::RETRY);
        }
        let rest = self.rest(inbox);
        self.unplug(inbox);
        rest
    }

    /// Closes the link for good; what it has brought and nobody has taken is forgotten.
    pub fn close(mut self, inbox: &mut Inbox) {
        self.unplug(inbox);
    }

    fn unplug(&mut self, inbox: &mut Inbox) {
        if let Some(connection) = self.connection.take() {
            let id = connection.id();
            // Its threads end here, and an adapter whose old name is still open gets another one when it comes back.
            drop(connection);
            inbox.forget(id);
        }
    }

    /// Opens a lost link again if it is time to try, and it is back.
    pub fn try_again(&mut self, now: Instant, clock: Clock, inputs: &SyncSender<Input>) -> Option<&Connection> {
        if self.retry_at.is_none_or(|at| at > now) {
            return None;
        }
        let connection = self.comeback.as_ref()?.open(clock, inputs.clone());
        let Some(connection) = connection else {
            self.retry_at = Some(now + Comeback::RETRY);
            return None;
        };
        self.retry_at = None;
        self.port = connection.port().to_owned();
        Some(self.connection.insert(connection))
    }
}

/// What has to come back.
#[derive(Clone, Debug)]
pub struct Comeback {
    what: What,
    options: Options,
}

#[derive(Clone, Debug)]
enum What {
    /// A USB adapter, and those that look the same and were there when it was lost.
    Adapter { port: Box<Port>, others: Vec<Port> },
    /// Whatever a link of the file system leads to.
    Link(PathBuf),
}

impl Comeback {
    /// How often it is looked for: soon enough for a person, rarely enough for the machine.
    pub const RETRY: Duration = Duration::from_millis(250);

    /// What has to come back; to be asked while it is there. `None` for what has no name that lasts: the number of a
    /// pseudo-terminal belongs to somebody else soon.
    pub fn of(spec: &LinkSpec, options: Options) -> Option<Self> {
        let LinkSpec::Serial(path) = spec else { return None };
        let port = ports::describe(path);
        let what = if port.usb.is_some() {
            What::Adapter { port: Box::new(port), others: Vec::new() }
        } else if path.is_symlink() {
            What::Link(path.clone())
        } else {
            return None;
        };
        Some(Comeback { what, options })
    }

    /// Call this at the moment the link is lost: adapters present now that look alike are other adapters.
    pub fn lost(&mut self) {
        match &mut self.what {
            What::Adapter { port, others } => *others = ports::alike(port),
            What::Link(_) => {}
        }
    }

    /// The link, if it is there and opens. One that does not is to be tried again: the system sets rights and names a
    /// moment after the device.
    pub fn open(&self, clock: Clock, inputs: SyncSender<Input>) -> Option<Connection> {
        let path = match &self.what {
            What::Adapter { port, others } => ports::find_again(port, others)?,
            What::Link(path) => path.exists().then(|| path.clone())?,
        };
        Connection::open(&LinkSpec::Serial(path), self.options, clock, inputs).ok()
    }
}
