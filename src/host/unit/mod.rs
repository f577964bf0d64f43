//! An emulated unit in real time, in a thread of its own.
//!
//! Here is what it is hosted as and what it can be told; `serving` is its thread, `port` what it hangs on: a
//! pseudo-terminal, or where the system has none a cable within this process.

#[cfg(any(not(unix), test))]
pub(super) mod memory;
pub(super) mod port;
#[cfg(unix)]
mod pty_port;
mod serving;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use super::state::{State, StateError};
use crate::device::{BAUD, Product};
use crate::emulator::scenario::{Stage, Verb};
use crate::emulator::{Setup, Store};
use crate::endpoint::Endpoint;
use crate::image::make;
use crate::time::Instant;
use port::{Bell, UnitPort};
use serving::Host;

/// What can be hosted: a unit's serial port with the knobs the host needs.
pub trait Hosted: Endpoint + Send + 'static {
    /// Supply voltage comes.
    fn power_on(&mut self, now: Instant);
    /// Does something to the unit; gives what there is to say about it, or why it refuses.
    ///
    /// # Errors
    /// If the unit refuses.
    fn perform(&mut self, now: Instant, verb: &Verb) -> Answer;
    /// Whether the client has heard XOFF and not yet XON.
    fn holds_sender(&self) -> bool;
    /// Another client has come, which knows nothing of an XOFF.
    fn forget_hold(&mut self) {}
    /// Bytes that an adapter takes ahead of the line, beside [`AHEAD`].
    fn queue(&self) -> usize {
        0
    }
    /// Whether the cable is in.
    fn is_plugged(&self) -> bool {
        true
    }
    /// The next write to memory that outlives the power.
    fn poll_store(&mut self) -> Option<Store>;
}

/// What a verb brought: something to say, nothing, or a refusal.
pub type Answer = Result<Option<String>, String>;

impl Hosted for Stage {
    fn power_on(&mut self, now: Instant) {
        Stage::power_on(self, now);
    }

    fn perform(&mut self, now: Instant, verb: &Verb) -> Answer {
        Stage::perform(self, now, verb)
    }

    fn holds_sender(&self) -> bool {
        self.holds_client()
    }

    fn forget_hold(&mut self) {
        Stage::forget_hold(self);
    }

    fn queue(&self) -> usize {
        Stage::queue(self)
    }

    fn is_plugged(&self) -> bool {
        Stage::is_plugged(self)
    }

    fn poll_store(&mut self) -> Option<Store> {
        Stage::poll_store(self)
    }
}

/// A hosted unit. Dropping it takes the cable away, after the client had a moment to read what was sent.
#[derive(Debug)]
pub struct HostedUnit {
    serial: PathBuf,
    counts: Arc<Counts>,
    orders: SyncSender<Order>,
    /// Rings when there is an order; its end says that it is over.
    bell: Option<Box<dyn Bell>>,
    thread: Option<JoinHandle<()>>,
}

/// What has become of the cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plug<'a> {
    /// It has been pulled: what a client opened before is not a port any more.
    Out,
    /// It is in again; this is what a client opens from then on.
    In(&'a Path),
}

/// Hears of the cable.
pub type PlugNews = Box<dyn FnMut(Plug<'_>) + Send>;

/// How a unit is hosted.
#[derive(Default)]
pub struct Hosting {
    /// Whether the client's bytes arrive as on a wire.
    pub line_rate: LineRate,
    /// When the unit gets its power.
    pub power: Power,
    /// Where the unit's memories are kept; nowhere if `None`.
    pub state: Option<State>,
    /// Decides what garbage looks like.
    pub seed: u64,
    /// Called from the unit's thread when the cable is pulled, and when it is in again.
    pub plug: Option<PlugNews>,
    /// Called once, from the unit's thread, if hosting fails later on.
    pub failed: Option<Box<dyn FnOnce(HostError) + Send>>,
}

/// Whether the client's bytes arrive as on a wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineRate {
    /// At [`BAUD`]; a client at another rate gets garbage and sends garbage.
    #[default]
    Real,
    /// As fast as they come, whatever rate the client has set.
    Off,
}

/// When the unit gets its power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Power {
    /// At once, heard by nobody, like a unit on a running machine.
    #[default]
    AtStart,
    /// When the first client opens the port, so that it hears the power-up messages.
    AtFirstClient,
}

/// What a hosted unit has to do, and what hears the answer.
struct Order {
    verb: Verb,
    answered: Box<dyn FnOnce(Answer) + Send>,
}

/// Why a unit is not hosted, or no longer.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The system has none.
    #[error("emulated units need pseudo-terminals, which this system does not have")]
    NoPseudoTerminals,
    /// What the unit hangs on.
    #[error("cannot {0} the port of an emulated unit")]
    Port(&'static str, #[source] io::Error),
    /// The state directory.
    #[error(transparent)]
    State(#[from] StateError),
}

/// What became of the bytes, for a bench or a test to look at.
#[derive(Debug, Default)]
pub struct Counts {
    /// Bytes that reached the unit.
    pub to_unit: AtomicU64,
    /// Bytes that the client could read.
    pub to_client: AtomicU64,
    /// Bytes of the unit that were lost: the client read too slowly, or was not there.
    pub lost: AtomicU64,
}

/// Characters the line runs ahead of the unit: the transmit buffer of a 16550, which goes on after an XOFF too.
pub const AHEAD: usize = 16;

/// Orders that wait at most: they are a person's, or a script's line by line.
const ORDERS: usize = 64;

impl HostedUnit {
    /// Puts a unit on a new pseudo-terminal and lets time run.
    ///
    /// # Errors
    /// If the system gives no pseudo-terminal or no thread.
    #[cfg(unix)]
    pub fn start<U: Hosted>(unit: U, hosting: Hosting) -> Result<Self, HostError> {
        let (port, bell) = pty_port::PtyPort::open().map_err(|error| HostError::Port("open", error))?;
        HostedUnit::on(port, bell, unit, hosting).map_err(|error| HostError::Port("serve", error))
    }

    /// The same where there are no pseudo-terminals.
    ///
    /// # Errors
    /// Always.
    #[cfg(not(unix))]
    pub fn start<U: Hosted>(_unit: U, _hosting: Hosting) -> Result<Self, HostError> {
        Err(HostError::NoPseudoTerminals)
    }

    /// Puts a unit on a port and lets time run.
    fn on<U: Hosted>(
        port: impl UnitPort,
        bell: impl Bell + 'static,
        unit: U,
        mut hosting: Hosting,
    ) -> Result<Self, io::Error> {
        let (sender, orders) = sync_channel(ORDERS);
        let counts = Arc::new(Counts::default());
        let serial = port.path().to_owned();
        let failed = hosting.failed.take();
        let host = Host::new(unit, hosting, port, counts.clone());
        let thread = thread::Builder::new().name("emulated unit".into()).spawn(move || {
            if let Err(error) = host.run(&orders)
                && let Some(failed) = failed
            {
                failed(error);
            }
        })?;
        Ok(HostedUnit { serial, counts, orders: sender, bell: Some(Box::new(bell)), thread: Some(thread) })
    }

    /// What a client opens, as long as nobody has pulled the cable.
    pub fn serial(&self) -> &Path {
        &self.serial
    }

    /// What became of the bytes.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Has something done to the unit; `answered` hears what came of it, from the unit's thread. `false` if too much
    /// waits to be done, or the unit has ended.
    pub fn order(&self, verb: Verb, answered: impl FnOnce(Answer) + Send + 'static) -> bool {
        let queued = match self.orders.try_send(Order { verb, answered: Box::new(answered) }) {
            Ok(()) => true,
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
        };
        queued && self.bell.as_ref().is_some_and(|bell| bell.ring())
    }
}

impl Drop for HostedUnit {
    fn drop(&mut self) {
        self.bell = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// What a unit is made of as it leaves the factory.
pub fn factory_setup(product: &'static Product, seed: u64) -> Setup {
    let loader = product.loader.kind;
    Setup { product, loader, seed, dialect: 0, flash: factory_flash(product), parameters: Vec::new() }
}

/// The program flash of a unit as it leaves the factory: the sample image of its first version, erased after it.
pub fn factory_flash(product: &Product) -> Vec<u8> {
    let mut flash = vec![0xFF; product.flash.program_words as usize * 2];
    let target = product.target();
    let words = make::usual_words(&target);
    let version = product.loader.factory_version;
    let program = make::program(&make::Recipe { target: &target, version, words, flaw: None });
    flash[..program.len()].copy_from_slice(&program);
    flash
}
