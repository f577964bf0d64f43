//! A link that may come back after it was lost: the cable was pulled out and is plugged in again.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::Input;
use super::clock::Clock;
use super::link::{Connection, LinkSpec, Options};
use super::ports;
use crate::record::Adapter;
use crate::time::Duration;

/// What has to come back.
#[derive(Clone, Debug)]
pub struct Comeback {
    path: PathBuf,
    adapter: Option<Adapter>,
    options: Options,
}

impl Comeback {
    /// How often it is looked for: soon enough for a person, rarely enough for the machine.
    pub const RETRY: Duration = Duration::from_millis(250);

    /// What has to come back; to be asked while it is there. `None` for what has no name that lasts: the number of a
    /// pseudo-terminal belongs to somebody else soon.
    pub fn of(spec: &LinkSpec, connection: &Connection, options: Options) -> Option<Self> {
        match spec {
            LinkSpec::Serial(path) => {
                let adapter = connection.adapter().cloned();
                (adapter.is_some() || path.is_symlink()).then(|| Comeback { path: path.clone(), adapter, options })
            }
            LinkSpec::Emulated(_) | LinkSpec::Replay(_) | LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_) => None,
        }
    }

    /// The link, if it is there and opens. One that does not is to be tried again: the system sets rights and names a
    /// moment after the device.
    pub fn open(&self, clock: Clock, inputs: SyncSender<Input>) -> Option<Connection> {
        let path = ports::find_again(&self.path, self.adapter.as_ref())?;
        Connection::open(&LinkSpec::Serial(path), self.options, clock, inputs).ok()
    }
}
