//! The system layer over real pseudo-terminals: ports that do not open, the line's rate, flow control, the plain
//! terminal, and the life of an emulator.
//!
//! Nothing here measures how fast the machine is: what is asserted about time is read from the unit's own clock, or is
//! a bound that only a hang exceeds.

mod emulator;
mod line;
mod ports;
mod terminal;

use std::path::Path;
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rustix::process::Signal;

use axcon::emulator::Store;
use axcon::emulator::scenario::Verb;
use axcon::endpoint::{Endpoint, Transmit};
use axcon::host::Input;
use axcon::host::link::{Cause, Connection, LinkSpec};
use axcon::host::pty::Pty;
use axcon::host::unit::{AHEAD, Answer, Hosted, HostedUnit, Hosting, LineRate, Power};
use axcon::time::Instant;

use crate::support::connection::{connected, receive};
use crate::support::screen::Screen;
use crate::support::shell::{PATIENCE, Running, World};

const XOFF: u8 = 0x13;
const XON: u8 = 0x11;

/// A unit for these stories: notes what it gets and when, echoes it, and can hold the sender.
#[derive(Default)]
struct Fake {
    notes: Arc<Mutex<Notes>>,
    echo: bool,
    /// Hold after this many bytes, and for how long.
    hold: Option<(usize, Duration)>,
    holding_until: Option<Instant>,
    /// Said when power comes.
    greeting: &'static [u8],
    outgoing: Vec<u8>,
}

#[derive(Default)]
struct Notes {
    got: Vec<(Instant, u8)>,
    /// Bytes that came between XOFF and XON.
    while_holding: usize,
    released: bool,
}

impl Endpoint for Fake {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let mut notes = self.notes.lock().expect("no panic");
        notes.got.extend(bytes.iter().map(|&byte| (now, byte)));
        if self.holding_until.is_some() {
            notes.while_holding += bytes.len();
        }
        if self.echo {
            self.outgoing.extend_from_slice(bytes);
        }
        if let Some((after, time)) = self.hold
            && notes.got.len() >= after
        {
            self.hold = None;
            self.holding_until = Some(now + time);
            self.outgoing.push(XOFF);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.holding_until.is_some_and(|until| until <= now) {
            self.holding_until = None;
            self.notes.lock().expect("no panic").released = true;
            self.outgoing.push(XON);
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        (!self.outgoing.is_empty()).then(|| Transmit::open(std::mem::take(&mut self.outgoing)))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.holding_until
    }
}

impl Hosted for Fake {
    fn power_on(&mut self, _now: Instant) {
        self.outgoing.extend_from_slice(self.greeting);
    }

    fn perform(&mut self, _now: Instant, verb: &Verb) -> Answer {
        Err(format!("{verb:?} is nothing this one can do"))
    }

    fn holds_sender(&self) -> bool {
        self.holding_until.is_some()
    }

    fn poll_store(&mut self) -> Option<Store> {
        None
    }
}

fn echo() -> Fake {
    Fake { echo: true, ..Fake::default() }
}

fn host(fake: Fake) -> HostedUnit {
    HostedUnit::start(fake, Hosting::default()).expect("hosted")
}

fn connect(path: &Path, baud: u32) -> (Connection, Receiver<Input>) {
    connected(&LinkSpec::Serial(path.to_owned()), baud)
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = std::time::Instant::now() + PATIENCE;
    while !is_so() {
        assert!(std::time::Instant::now() < end, "{what}: not in time");
        thread::sleep(Duration::from_millis(2));
    }
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}
