//! A link that may come back after it was lost: the cable was pulled out and is plugged in again.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::Input;
use super::clock::Clock;
use super::link::{Connection, LinkSpec, Options};
use super::ports::{self, Port};
use crate::time::Duration;

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

    /// The link is lost; to be told at once, since what is there now and looks the same is something else.
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
