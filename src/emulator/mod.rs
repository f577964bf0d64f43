//! The device's end of the cable: an emulated unit as a machine without clock, thread or file.
//!
//! Here are power and reset: which program runs, and when. The loader lives in flash of its own and runs first; it
//! starts the application if the program in flash is intact and made for this product, unless it has been told to
//! wait for a file. What the programs say and do is in `firmware` and `bootloader`; the port they talk through
//! in `uart`; what outlives the power in [`memory`]; what they measure in `sensors`.
//!
//! Deterministic: the same setup and the same inputs at the same times give the same bytes, however often
//! [`handle_timeout`](Endpoint::handle_timeout) is called in between, because things happen only when they are due.

mod bootloader;
pub mod cable;
mod dialect;
mod errors;
pub mod fault;
mod firmware;
mod its90;
pub mod knob;
mod measurement;
pub mod memory;
mod network;
mod objects;
mod rtd_curve;
pub mod scenario;
mod sensors;
mod uart;
pub mod words;

pub use network::{NetworkState, NmtCommand};

use std::collections::VecDeque;

use crate::canopen::{Abort, ObjectAddress, Value};
use crate::device::{LoaderKind, Product};
use crate::endpoint::{Endpoint, Transmit};
use crate::image::Identity;
use crate::rng::Rng;
use crate::time::{Duration, Instant};
use bootloader::Bootloader;
use dialect::Dialect;
use firmware::Firmware;
use knob::{Knob, KnobError};
use memory::{Defect, Flash, ParameterStore, Parameters, StartDelay};
use sensors::Sensors;
use uart::Uart;

/// From power or reset to the first program's first character; keys are lost meanwhile. A guess.
pub const START_TIME: Duration = Duration::from_millis(50);

/// What a unit is made of before power comes.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Which product.
    pub product: &'static Product,
    /// Which bootloader is in its boot flash.
    pub loader: LoaderKind,
    /// Decides everything that chance decides: noise, the simulated process, and the serial number of a unit that has
    /// none in its non-volatile memory.
    pub seed: u64,
    /// How it words its prose: 0 for the plain way, another seed for another dialect.
    pub dialect: u64,
    /// Program flash, bytes in S-record order; as long as the product's flash, FFh where erased.
    pub flash: Vec<u8>,
    /// Non-volatile memory as [`Unit::parameters`] gave it; empty for a unit fresh from the factory. One that cannot
    /// be used makes the unit run on factory settings: ask [`Parameters::read`] first to know.
    pub parameters: Vec<u8>,
}

/// A write to memory that outlives the power, for the host to carry out in the order given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Store {
    /// Which memory.
    pub area: Area,
    /// Byte offset.
    pub offset: usize,
    /// What is there now.
    pub bytes: Vec<u8>,
}

/// Memory that outlives the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Program flash.
    Flash,
    /// Non-volatile parameters.
    Parameters,
}

/// Why the network gets nothing from the unit's object dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Nobody answers: no power, another program, the node is stopped, or its view is open.
    #[error("the unit does not answer")]
    NoAnswer,
    /// It refuses.
    #[error("{0}")]
    Abort(Abort),
}

/// What a unit is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Running {
    /// Nothing: it has no power.
    Off,
    /// It starts; nothing has been printed yet.
    Starting,
    /// The loader waits for a file, or takes one.
    Loader,
    /// The application.
    Application,
}

/// An emulated unit. As an [`Endpoint`] it is the unit's RS-232 port.
#[derive(Debug)]
pub struct Unit {
    product: &'static Product,
    loader: LoaderKind,
    dialect: u64,
    flash: Flash,
    parameters: ParameterStore,
    sensors: Sensors,
    uart: Uart,
    stores: VecDeque<Store>,
    power: Power,
}

#[derive(Debug)]
enum Power {
    Off,
    On {
        program: Program,
        /// A program has asked for it; it happens when the last text has left.
        reset: Option<Reset>,
    },
}

#[derive(Debug)]
enum Program {
    Starting { until: Instant, reset: Reset },
    Loader(Box<Bootloader>),
    Application(Box<Firmware>),
}

/// Why the unit restarts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reset {
    /// The usual way: power, restored defaults, a finished load.
    Start,
    /// Menu L: the loader has to wait for a file.
    StayInLoader,
}

/// What a program finds on the board, at the moment it does something.
#[derive(Debug)]
struct Board<'a> {
    now: Instant,
    product: &'static Product,
    flash: &'a mut Flash,
    parameters: &'a mut ParameterStore,
    sensors: &'a Sensors,
    uart: &'a mut Uart,
    stores: &'a mut VecDeque<Store>,
    reset: &'a mut Option<Reset>,
}

impl Unit {
    /// A unit without power.
    ///
    /// # Panics
    /// If the flash is not as long as the product's.
    pub fn new(setup: Setup) -> Self {
        let Setup { product, loader, seed, dialect, flash, parameters } = setup;
        let mut stores = VecDeque::new();
        let serial_number = Rng::new(seed).fork("serial number").next_u64() as u32;
        Unit {
            product,
            loader,
            dialect,
            flash: Flash::new(product.flash, flash, seed),
            parameters: ParameterStore::new(product, serial_number, parameters, &mut stores),
            sensors: Sensors::new(product, seed),
            uart: Uart::new(),
            stores,
            power: Power::Off,
        }
    }

    /// Supply voltage comes: the unit starts. Nothing happens if it is on.
    pub fn power_on(&mut self, now: Instant) {
        if matches!(self.power, Power::Off) {
            self.uart.reset();
            let program = Program::Starting { until: now + START_TIME, reset: Reset::Start };
            self.power = Power::On { program, reset: None };
        }
    }

    /// Supply voltage goes: everything but flash and parameters is lost, in the middle of a word if need be.
    pub fn power_off(&mut self, now: Instant) {
        if matches!(self.power, Power::On { .. }) {
            self.run_until(now);
            self.uart.cut(now);
            self.flash.power_lost(now, &mut self.stores);
            self.power = Power::Off;
        }
    }

    /// What the unit is doing.
    pub fn running(&self) -> Running {
        match &self.power {
            Power::Off => Running::Off,
            Power::On { program: Program::Starting { .. }, .. } => Running::Starting,
            Power::On { program: Program::Loader(_), .. } => Running::Loader,
            Power::On { program: Program::Application(_), .. } => Running::Application,
        }
    }

    /// Program flash, bytes in S-record order.
    pub fn flash(&self) -> &[u8] {
        self.flash.bytes()
    }

    /// Non-volatile parameters, as [`Setup::parameters`] takes them.
    pub fn parameters(&self) -> &[u8] {
        self.parameters.image()
    }

    /// The values in the non-volatile parameters.
    pub fn settings(&self) -> &Parameters {
        self.parameters.values()
    }

    /// The next write to memory that outlives the power.
    pub fn poll_store(&mut self) -> Option<Store> {
        self.stores.pop_front()
    }

    /// Whether the unit has sent XOFF and not yet XON.
    pub fn holds_sender(&self) -> bool {
        match &self.power {
            Power::On { program: Program::Loader(loader), .. } => loader.holds_sender(),
            Power::Off | Power::On { .. } => false,
        }
    }

    /// Turns a knob at the unit's terminals; the unit notices at its next reading.
    ///
    /// # Errors
    /// If this unit has no such thing, or cannot have this number.
    pub fn turn(&mut self, now: Instant, knob: Knob) -> Result<(), KnobError> {
        self.run_until(now);
        self.sensors.turn(knob)
    }

    /// Spoils a word of program flash.
    pub fn spoil_word(&mut self, word: u32, defect: Defect) {
        self.flash.spoil(word, defect);
    }

    /// Number of things that are wrong with words of program flash.
    pub fn spoiled(&self) -> usize {
        self.flash.defects()
    }

    /// Makes all words of program flash good again.
    pub fn repair_flash(&mut self) {
        self.flash.repair();
    }

    /// A character has come that the receiver could not read: its stop bit was not where it should be. A running
    /// application does not notice.
    pub fn handle_framing_error(&mut self, now: Instant) {
        self.run_until(now);
        self.with_program(now, |program, board| match program {
            Program::Loader(loader) => loader.receive_garbage(board),
            Program::Starting { .. } | Program::Application(_) => {}
        });
    }

    /// State of the CANopen node; `None` unless the application runs.
    pub fn network_state(&self) -> Option<NetworkState> {
        self.application().map(Firmware::network_state)
    }

    /// The network master orders something. Without effect unless the application runs and listens.
    pub fn nmt(&mut self, now: Instant, command: NmtCommand) {
        self.run_until(now);
        self.with_program(now, |program, board| {
            if let Program::Application(firmware) = program {
                firmware.nmt(board, command);
            }
        });
        self.reset_if_asked(now);
    }

    /// The network reads an entry of the object dictionary.
    ///
    /// # Errors
    /// If the unit does not answer, or refuses.
    pub fn read_object(&mut self, now: Instant, at: ObjectAddress) -> Result<Value, Refusal> {
        self.run_until(now);
        self.application().ok_or(Refusal::NoAnswer)?.read_object(at)
    }

    /// The network writes an entry of the object dictionary, with the bytes as they are on the bus.
    ///
    /// # Errors
    /// If the unit does not answer, or refuses.
    pub fn write_object(&mut self, now: Instant, at: ObjectAddress, data: &[u8]) -> Result<(), Refusal> {
        self.run_until(now);
        let mut result = Err(Refusal::NoAnswer);
        self.with_program(now, |program, board| {
            if let Program::Application(firmware) = program {
                result = firmware.write_object(board, at, data);
            }
        });
        result
    }

    /// What the unit is.
    pub fn product(&self) -> &'static Product {
        self.product
    }

    fn application(&self) -> Option<&Firmware> {
        match &self.power {
            Power::On { program: Program::Application(firmware), .. } => Some(firmware),
            Power::On { .. } | Power::Off => None,
        }
    }

    /// Does everything that is due by `now`, in its order.
    fn run_until(&mut self, now: Instant) {
        while let Some(due) = self.poll_timeout().filter(|&due| due <= now) {
            self.step(due);
        }
    }

    fn step(&mut self, now: Instant) {
        self.uart.step(now);
        self.with_program(now, |program, board| match program {
            Program::Starting { .. } => {}
            Program::Loader(loader) => loader.step(board),
            Program::Application(firmware) => firmware.step(board),
        });
        self.reset_if_asked(now);
        if let Power::On { program: Program::Starting { until, reset }, .. } = self.power
            && until <= now
        {
            self.start_program(now, reset);
        }
    }

    /// Restarts if the program has asked for it. The last text leaves first: the programs print it before they let go.
    fn reset_if_asked(&mut self, now: Instant) {
        if let Power::On { program, reset } = &mut self.power
            && self.uart.backlog() == 0
            && let Some(reset) = reset.take()
        {
            self.uart.reset();
            *program = Program::Starting { until: now + START_TIME, reset };
        }
    }

    /// The boot ROM's decision.
    fn start_program(&mut self, now: Instant, cause: Reset) {
        let identity = Identity::verify(self.flash.bytes()).ok();
        let own = identity.filter(|identity| identity.is_for(&self.product.name));
        let startable = own.filter(|_| self.parameters.values().start_delay == StartDelay::AtOnce);
        let may_leave = startable.is_some();
        let may_start = match cause {
            Reset::Start => startable,
            Reset::StayInLoader => None,
        };
        let (loader, dialect) = (self.loader, self.dialect);
        self.with_program(now, |program, board| {
            *program = match may_start {
                Some(identity) => {
                    Program::Application(Box::new(Firmware::start(board, identity, Dialect::drawn(dialect))))
                }
                None => Program::Loader(Box::new(Bootloader::start(loader, board, may_leave))),
            }
        });
    }

    /// Lets the running program do something with the board.
    fn with_program(&mut self, now: Instant, act: impl FnOnce(&mut Program, &mut Board<'_>)) {
        let Power::On { program, reset } = &mut self.power else { return };
        let mut board = Board {
            now,
            product: self.product,
            flash: &mut self.flash,
            parameters: &mut self.parameters,
            sensors: &self.sensors,
            uart: &mut self.uart,
            stores: &mut self.stores,
            reset,
        };
        act(program, &mut board);
    }
}

impl Endpoint for Unit {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        self.run_until(now);
        for &byte in bytes {
            self.with_program(now, |program, board| match program {
                Program::Starting { .. } => {}
                Program::Loader(loader) => loader.receive(board, byte),
                Program::Application(firmware) => firmware.receive(board, byte),
            });
            self.reset_if_asked(now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.run_until(now);
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        self.uart.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let Power::On { program, .. } = &self.power else { return None };
        // Asked some thousand times a second while the unit talks: plain comparisons, no list of what may be due.
        let program_due = match program {
            Program::Starting { until, .. } => *until,
            Program::Loader(loader) => loader.deadline(&self.flash).unwrap_or(Instant::NEVER),
            Program::Application(firmware) => firmware.deadline(),
        };
        let due = program_due.min(self.uart.deadline().unwrap_or(Instant::NEVER));
        (due < Instant::NEVER).then_some(due)
    }
}
