//! The thread of a hosted unit: bytes and time for it, and what it says for the client.
//!
//! The unit and the cable to it are pure ([`Plugged`]); here they get the clock. A pseudo-terminal hides the line: it
//! takes some 19 kB at once where a wire takes a character in 87 µs, and when the unit says XOFF all that is already
//! on its way. So the client's bytes are taken off it no faster than a wire would carry them, never more than a
//! UART's buffer ahead ([`AHEAD`]); what still lies in the pseudo-terminal counts as not yet sent, and stays there
//! while the unit holds a client that obeys XOFF. Bytes are counted against the clock in small slices, so a late
//! wake-up costs no throughput and lets no more bytes slip past an XOFF. A thread that wakes up much later stops the
//! unit's time for as long (`UnitClock`): what already lies in the pseudo-terminal must not look to the unit as if
//! the line had been silent meanwhile, which is when a loader begins to write and is deaf.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::thread;

use super::port::{ClientSettings, UnitPort, Visit, Woken};
use super::{AHEAD, BAUD, Counts, HostError, Hosted, Hosting, LineRate, Order, Plug, PlugNews, Power};
use crate::emulator::Store;
use crate::emulator::cable::{Line, Plugged};
use crate::host::clock::Clock;
use crate::host::state::State;
use crate::rng::Rng;
use crate::time::{Duration, Instant, character_time};

/// Shortest time between two wake-ups while bytes flow: 11.5 characters, less than [`AHEAD`], so the line never runs
/// dry between two of them.
const TICK: Duration = Duration::from_millis(1);

/// A thread that wakes up later than this does not make up for all of it: the rest has not been for the unit. While it
/// catches up, bytes reach the unit faster than a client can answer an XOFF; no more of them may than after a USB
/// adapter with its 16 ms of latency.
const CATCH_UP: Duration = Duration::from_millis(16);

/// Bytes taken at once without a line rate, before the unit's own clock is looked at again.
const BURST: usize = 4096;

/// How long closing waits for the client to read what was sent; then a hang-up discards it.
const FAREWELL: Duration = Duration::from_millis(500);

/// How often that is looked at: nobody tells.
const FAREWELL_STEP: Duration = Duration::from_millis(5);

/// The unit's time: the real one, less what this thread has overslept.
#[derive(Debug)]
struct UnitClock {
    clock: Clock,
    overslept: Duration,
}

impl UnitClock {
    /// The time now, for a thread that wanted to be awake at `wanted`, if at any time.
    fn now(&mut self, wanted: Option<Instant>) -> Instant {
        let now = self.clock.now() - self.overslept;
        let late = late_beyond(now, wanted);
        self.overslept += late;
        now - late
    }

    /// How long to sleep until `at`.
    fn until(&self, at: Instant) -> Duration {
        self.clock.until(at + self.overslept)
    }
}

/// How much later than can be caught up with it is.
fn late_beyond(now: Instant, wanted: Option<Instant>) -> Duration {
    wanted.map_or(Duration::ZERO, |wanted| now.since(wanted + CATCH_UP))
}

/// The thread's own things.
pub(super) struct Host<U, P> {
    plugged: Plugged<U>,
    port: P,
    clock: UnitClock,
    /// How far the unit's time has come.
    at: Instant,
    line_rate: LineRate,
    power: Power,
    state: Option<State>,
    plug_news: Option<PlugNews>,
    cable_is_in: bool,
    garbage: Rng,
    /// Whether anybody has the port open.
    attended: bool,
    client: ClientSettings,
    /// Whether there were bytes when they were last taken: more may wait, and follow without a gap.
    backlog: bool,
    /// Whether the last client has gone and its last bytes are still to be taken.
    leaving: bool,
    /// What the unit has said and the client has not got yet.
    heard: Vec<u8>,
    counts: Arc<Counts>,
}

impl<U: Hosted, P: UnitPort> Host<U, P> {
    pub(super) fn new(unit: U, hosting: Hosting, port: P, counts: Arc<Counts>) -> Self {
        let line = match hosting.line_rate {
            LineRate::Real => character_time(BAUD),
            LineRate::Off => Duration::ZERO,
        };
        Host {
            plugged: Plugged::new(unit, Line::new(line, Duration::ZERO)),
            port,
            clock: UnitClock { clock: Clock::start(), overslept: Duration::ZERO },
            at: Instant::ZERO,
            line_rate: hosting.line_rate,
            power: hosting.power,
            state: hosting.state,
            plug_news: hosting.plug,
            cable_is_in: true,
            garbage: Rng::new(hosting.seed),
            attended: false,
            client: ClientSettings { baud: BAUD, obeys_xoff: false },
            backlog: false,
            leaving: false,
            heard: Vec::new(),
            counts,
        }
    }

    /// Lets time run until the bell is taken away.
    pub(super) fn run(mut self, orders: &Receiver<Order>) -> Result<(), HostError> {
        if self.power == Power::AtStart {
            self.plugged.unit_mut().power_on(self.at);
        }
        loop {
            self.note_visits()?;
            let now = self.clock.now(self.wake_at());
            self.catch_up(now)?;

            // While the line is full or the unit holds the client, bytes that wait must not wake us.
            let wants_bytes = self.takes_bytes() && !self.backlog;
            let timeout = self.wake_at().map(|at| self.clock.until(at));
            match self.port.wait(wants_bytes, timeout).map_err(failed("watch"))? {
                Woken::Line => {}
                Woken::Bell => self.obey(orders)?,
                Woken::End => {
                    self.farewell();
                    return Ok(());
                }
            }
        }
    }

    fn obey(&mut self, orders: &Receiver<Order>) -> Result<(), HostError> {
        loop {
            let now = self.clock.now(self.wake_at());
            self.catch_up(now)?;
            match orders.try_recv() {
                Ok(Order { verb, answered }) => {
                    let answer = self.plugged.unit_mut().perform(now, &verb);
                    // A listener that hears that the cable is in finds the port.
                    self.note_cable()?;
                    answered(answer);
                }
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return Ok(()),
            }
        }
    }

    fn note_visits(&mut self) -> Result<(), HostError> {
        let visits = self.port.visits().map_err(failed("watch"))?;
        if visits.contains(&Visit::Opened) {
            if !self.attended {
                self.plugged.unit_mut().forget_hold();
            }
            self.attended = true;
            self.leaving = false;
            if self.power == Power::AtFirstClient {
                self.power = Power::AtStart;
                self.plugged.unit_mut().power_on(self.at.max(self.clock.now(None)));
            }
        }
        // Counting would be wrong: events of the same kind melt into one while we sleep.
        if visits.contains(&Visit::Closed) {
            self.attended = self.port.is_attended();
            self.leaving = !self.attended;
        }
        if self.attended {
            self.client = self.port.client_settings().map_err(failed("ask"))?;
        }
        Ok(())
    }

    /// Lets the unit's time pass until `now`: in slices while bytes queue up, so that each slice sees what the unit
    /// said in the one before; else at once.
    fn catch_up(&mut self, now: Instant) -> Result<(), HostError> {
        if now.since(self.at) > TICK + CATCH_UP {
            self.at = now - CATCH_UP;
        }
        while self.backlog && self.at + TICK < now {
            self.step(self.at + TICK)?;
        }
        self.step(now.max(self.at))
    }

    fn step(&mut self, at: Instant) -> Result<(), HostError> {
        self.at = at;
        match self.line_rate {
            LineRate::Real => {
                // What has arrived makes room first, so that the line never runs dry between two slices: a silence of
                // half a millisecond is one to a loader.
                self.advance()?;
                let ahead = AHEAD + self.plugged.unit().queue();
                self.take_bytes(ahead.saturating_sub(self.plugged.to_unit().in_flight()))?;
            }
            LineRate::Off => {
                let mut burst = 0;
                loop {
                    burst += self.take_bytes(AHEAD)?;
                    self.advance()?;
                    if !self.backlog || !self.takes_bytes() || burst >= BURST {
                        break;
                    }
                }
            }
        }
        self.note_cable()
    }

    /// A cable that is pulled hangs up on the client, like an adapter that is pulled; in again, it is another port.
    fn note_cable(&mut self) -> Result<(), HostError> {
        let is_in = self.plugged.unit().is_plugged();
        if is_in == self.cable_is_in {
            return Ok(());
        }
        self.cable_is_in = is_in;
        if is_in {
            if let Some(news) = &mut self.plug_news {
                news(Plug::In(self.port.path()));
            }
            return Ok(());
        }
        if let Some(news) = &mut self.plug_news {
            news(Plug::Out);
        }
        self.port.pull().map_err(failed("open"))?;
        self.client = ClientSettings { baud: BAUD, obeys_xoff: false };
        (self.attended, self.leaving, self.backlog) = (false, false, false);
        self.heard.clear();
        Ok(())
    }

    /// Takes at most `room` bytes of the client and puts them on the line.
    fn take_bytes(&mut self, room: usize) -> Result<usize, HostError> {
        if !self.takes_bytes() {
            self.backlog = false;
            if self.leaving {
                self.forget_client()?;
            }
            return Ok(0);
        }
        if room == 0 {
            return Ok(0);
        }
        let mut buffer = [0; BURST];
        let count = self.port.read(&mut buffer[..room.min(BURST)]).map_err(failed("read"))?;
        // Few bytes need not be all: the system carries them over in its own time. The next slice looks again.
        self.backlog = count > 0;
        if count == 0 {
            if self.leaving {
                self.forget_client()?;
            }
            return Ok(0);
        }
        // A client that sends is there, even if the system would not show us. And it may have changed its settings since it
        // opened the port.
        self.attended |= !self.leaving;
        self.client = self.port.client_settings().map_err(failed("ask"))?;
        let bytes = &mut buffer[..count];
        if self.at_wrong_rate() {
            garble(&mut self.garbage, bytes);
        }
        self.plugged.send(self.at, bytes);
        self.counts.to_unit.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }

    /// Whether what waits in the port may go on the line: not while a client that obeys is held.
    fn takes_bytes(&self) -> bool {
        !(self.plugged.unit().holds_sender() && self.client.obeys_xoff)
    }

    fn advance(&mut self) -> Result<(), HostError> {
        let heard = &mut self.heard;
        self.plugged.advance(self.at, |_, bytes| heard.extend_from_slice(bytes));
        // Memory first: what the unit says about it has to be true.
        let stores: Vec<Store> = std::iter::from_fn(|| self.plugged.unit_mut().poll_store()).collect();
        if let Some(state) = &mut self.state
            && !stores.is_empty()
        {
            state.write(&stores)?;
        }
        if self.heard.is_empty() {
            return Ok(());
        }
        let mut taken = 0;
        if self.attended {
            self.client = self.port.client_settings().map_err(failed("ask"))?;
            if self.at_wrong_rate() {
                garble(&mut self.garbage, &mut self.heard);
            }
            taken = self.port.write(&self.heard).map_err(failed("write"))?;
        }
        self.counts.to_client.fetch_add(taken as u64, Ordering::Relaxed);
        self.counts.lost.fetch_add((self.heard.len() - taken) as u64, Ordering::Relaxed);
        self.heard.clear();
        Ok(())
    }

    fn forget_client(&mut self) -> Result<(), HostError> {
        self.leaving = false;
        self.port.reset().map_err(failed("reset"))
    }

    fn at_wrong_rate(&self) -> bool {
        self.line_rate == LineRate::Real && self.client.baud != BAUD
    }

    /// When to go on even if nothing comes.
    fn wake_at(&self) -> Option<Instant> {
        if self.backlog || self.leaving {
            return Some(self.at + TICK);
        }
        self.plugged.poll_timeout().map(|at| at.max(self.at + TICK))
    }

    /// Lets the client read what was sent: the hang-up that follows discards it.
    fn farewell(&self) {
        let clock = Clock::start();
        while self.attended && clock.now() < Instant::ZERO + FAREWELL {
            // First a moment: what was just written takes one to reach the client's side.
            thread::sleep(FAREWELL_STEP);
            if self.port.unread() == 0 {
                return;
            }
        }
    }
}

/// What it means that the system refuses something.
fn failed(operation: &'static str) -> impl FnOnce(io::Error) -> HostError {
    move |error| HostError::Port(operation, error)
}

/// What a receiver at another rate makes of characters: framing errors, and values nobody sent. Their top bit is set,
/// as mostly happens when a stop bit is read where data is; so garbage never is a key of the menu.
fn garble(garbage: &mut Rng, bytes: &mut [u8]) {
    for byte in bytes {
        *byte = 0x80 | (garbage.next_u64() as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::scenario::Verb;
    use crate::endpoint::{Endpoint, Transmit};
    use crate::host::unit::Answer;
    use crate::host::unit::memory::MemoryPort;

    /// A unit that only listens.
    #[derive(Default)]
    struct Ear(Vec<(Instant, u8)>);

    impl Endpoint for Ear {
        fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
            self.0.extend(bytes.iter().map(|&byte| (now, byte)));
        }

        fn handle_timeout(&mut self, _: Instant) {}

        fn poll_transmit(&mut self) -> Option<Transmit> {
            None
        }

        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }

    impl Hosted for Ear {
        fn power_on(&mut self, _: Instant) {}

        fn perform(&mut self, _: Instant, _: &Verb) -> Answer {
            Ok(None)
        }

        fn holds_sender(&self) -> bool {
            false
        }

        fn poll_store(&mut self) -> Option<Store> {
            None
        }
    }

    #[test]
    fn a_record_sent_at_once_reaches_the_unit_without_a_gap_however_late_the_slices_come() {
        let port = MemoryPort::holding(&[b'S'; 200]);
        let mut host = Host::new(Ear::default(), Hosting::default(), port, Arc::default());
        host.attended = true;
        host.step(Instant::from_millis(1)).expect("a slice");
        for millis in [2, 3, 4, 12, 13, 25] {
            host.catch_up(Instant::from_millis(millis)).expect("slices");
        }
        let arrivals: Vec<Instant> = host.plugged.unit().0.iter().map(|&(at, _)| at).collect();
        assert_eq!(arrivals.len(), 200);
        let widest = arrivals.windows(2).map(|pair| pair[1].since(pair[0])).max();
        assert!(widest < Some(character_time(BAUD) * 2), "{widest:?}");
    }

    #[test]
    fn time_stands_still_for_the_unit_while_its_thread_oversleeps() {
        let at = Instant::from_millis;
        assert_eq!(late_beyond(at(1_000), None), Duration::ZERO, "nothing was due");
        assert_eq!(late_beyond(at(1_000), Some(at(2_000))), Duration::ZERO, "something else woke it");
        assert_eq!(late_beyond(at(1_000), Some(at(990))), Duration::ZERO, "that can be caught up with");
        assert_eq!(late_beyond(at(1_000), Some(at(900))), Duration::from_millis(84));
    }
}
