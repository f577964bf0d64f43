//! An emulated unit without a pseudo-terminal: both ends of its cable are in this process.
//!
//! For systems that have no pseudo-terminals; the same code runs in the tests of all others. Like a pseudo-terminal the
//! cable takes some thousand bytes in each direction: a client waits until there is room again, a unit loses what finds
//! none. It is the client's from the start, and nobody else's: once it is pulled or closed nobody can open it again.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use super::port::{Bell, ClientSettings, UnitPort, Visit, Woken};
use super::{HostError, Hosted, HostedUnit, Hosting};
use crate::host::clock::Clock;
use crate::host::link::{Cause, LinkError, Operation, Options, QUEUED, WRITE_PATIENCE};
use crate::host::outlet::Outlet;
use crate::host::{Input, LinkId};
use crate::time::Duration;

/// Bytes that wait in either direction at most, as in a Linux pseudo-terminal.
const ROOM: usize = 4096;

/// The client's end, with its two threads.
#[derive(Debug)]
pub(in crate::host) struct Lines {
    cable: Arc<Cable>,
    threads: Vec<JoinHandle<()>>,
    written: Receiver<()>,
}

/// Hosts a unit and opens the only way to it. The sender feeds it, and closing begins when it is dropped.
///
/// # Errors
/// If the system has no more threads.
pub(in crate::host) fn open<U: Hosted>(
    unit: U,
    hosting: Hosting,
    name: &str,
    (options, clock): (Options, Clock),
    link: LinkId,
    inputs: SyncSender<Input>,
) -> Result<(HostedUnit, Lines, SyncSender<Vec<u8>>), LinkError> {
    let failed = |error: io::Error| LinkError {
        port: name.into(),
        operation: Operation::Open,
        cause: Cause::Io(io::Error::other(HostError::Port("serve", error))),
    };
    let cable = Arc::new(Cable::default());
    let outlet = Arc::new(Outlet::new(name.into(), link, inputs));
    let (outgoing, queue) = sync_channel(QUEUED);
    let (done, written) = sync_channel(1);
    let mut lines = Lines { cable: cable.clone(), threads: Vec::new(), written };
    let (reads, hears) = (cable.clone(), outlet.clone());
    let reader = thread::Builder::new().name("port reader".into()).spawn(move || reads.read(&hears, clock));
    lines.threads.push(reader.map_err(failed)?);
    let writes = cable.clone();
    let writer = thread::Builder::new().name("port writer".into()).spawn(move || {
        writes.write(&queue, &outlet);
        let _ = done.try_send(());
    });
    match writer {
        Ok(writer) => lines.threads.push(writer),
        Err(error) => {
            lines.close(Duration::ZERO);
            return Err(failed(error));
        }
    }
    let port = MemoryPort { name: name.into(), baud: options.baud, cable: cable.clone() };
    match HostedUnit::on(port, MemoryBell(cable), unit, hosting) {
        Ok(hosted) => Ok((hosted, lines, outgoing)),
        Err(error) => {
            lines.close(Duration::ZERO);
            Err(failed(error))
        }
    }
}

impl Lines {
    /// Ends the threads: what is queued may leave for this long, then everything stops.
    pub(in crate::host) fn close(&mut self, patience: Duration) {
        let _ = self.written.recv_timeout(patience);
        self.cable.change(|ends| {
            ends.closed = true;
            ends.visits.push(Visit::Closed);
        });
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }

    /// There is no line that could be held low.
    pub(in crate::host) fn send_break(&self) -> io::Result<()> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "not possible to a unit in this process"))
    }
}

/// What lies between the two ends.
#[derive(Debug, Default)]
struct Cable {
    ends: Mutex<Ends>,
    changed: Condvar,
}

#[derive(Debug)]
struct Ends {
    to_unit: VecDeque<u8>,
    to_client: VecDeque<u8>,
    visits: Vec<Visit>,
    /// The client has closed its end.
    closed: bool,
    /// The unit's end has been pulled out, or the unit is gone.
    pulled: bool,
    rung: bool,
    over: bool,
}

impl Default for Ends {
    fn default() -> Self {
        Ends {
            to_unit: VecDeque::new(),
            to_client: VecDeque::new(),
            visits: vec![Visit::Opened],
            closed: false,
            pulled: false,
            rung: false,
            over: false,
        }
    }
}

impl Cable {
    /// What both ends see: nothing is ever half done while this is locked, so a panic elsewhere spoils nothing.
    fn ends(&self) -> MutexGuard<'_, Ends> {
        self.ends.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change<T>(&self, change: impl FnOnce(&mut Ends) -> T) -> T {
        let changed = change(&mut self.ends());
        self.changed.notify_all();
        changed
    }

    /// Waits until it is so, or the time is over.
    fn wait_until(&self, timeout: Duration, is_so: impl Fn(&Ends) -> bool) -> MutexGuard<'_, Ends> {
        let waited = self.changed.wait_timeout_while(self.ends(), timeout, |ends| !is_so(ends));
        waited.unwrap_or_else(PoisonError::into_inner).0
    }

    /// The client's reader: until its end is closed, or the other one is gone and everything is read.
    fn read(&self, outlet: &Outlet, clock: Clock) {
        loop {
            let something = |ends: &Ends| !ends.to_client.is_empty() || ends.closed || ends.pulled;
            let mut ends = self.wait_until(Duration::MAX, something);
            let bytes: Vec<u8> = ends.to_client.drain(..).collect();
            let (closed, pulled) = (ends.closed, ends.pulled);
            drop(ends);
            if !bytes.is_empty() {
                if !outlet.deliver(clock.now(), bytes, |time| self.is_closed_within(time)) {
                    return;
                }
            } else if closed {
                return;
            } else if pulled {
                return outlet.report(Operation::Read, Cause::Gone, |time| self.is_closed_within(time));
            }
        }
    }

    /// The client's writer: until nobody sends any more.
    fn write(&self, queue: &Receiver<Vec<u8>>, outlet: &Outlet) {
        while let Ok(bytes) = queue.recv() {
            let mut left = bytes.as_slice();
            while !left.is_empty() {
                let may_go = |ends: &Ends| ends.to_unit.len() < ROOM || ends.closed || ends.pulled;
                let mut ends = self.wait_until(WRITE_PATIENCE, may_go);
                if ends.closed {
                    return;
                }
                let room = ROOM.saturating_sub(ends.to_unit.len());
                let cause = match ends.pulled {
                    true => Some(Cause::Gone),
                    false if room == 0 => Some(Cause::Stuck { after: WRITE_PATIENCE }),
                    false => None,
                };
                if let Some(cause) = cause {
                    drop(ends);
                    return outlet.report(Operation::Write, cause, |time| self.is_closed_within(time));
                }
                let (now, later) = left.split_at(room.min(left.len()));
                ends.to_unit.extend(now);
                left = later;
                drop(ends);
                self.changed.notify_all();
            }
        }
    }

    /// Waits for this long, and says whether the client has closed its end.
    fn is_closed_within(&self, time: Duration) -> bool {
        self.wait_until(time, |ends| ends.closed).closed
    }
}

/// The unit's end.
#[derive(Debug)]
pub(super) struct MemoryPort {
    name: PathBuf,
    baud: u32,
    cable: Arc<Cable>,
}

impl UnitPort for MemoryPort {
    fn path(&self) -> &Path {
        &self.name
    }

    fn visits(&self) -> io::Result<Vec<Visit>> {
        Ok(std::mem::take(&mut self.cable.ends().visits))
    }

    fn is_attended(&self) -> bool {
        let ends = self.cable.ends();
        !ends.closed && !ends.pulled
    }

    fn client_settings(&self) -> io::Result<ClientSettings> {
        Ok(ClientSettings { baud: self.baud, obeys_xoff: false })
    }

    fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(self.cable.change(|ends| {
            let count = buffer.len().min(ends.to_unit.len());
            buffer.iter_mut().zip(ends.to_unit.drain(..count)).for_each(|(place, byte)| *place = byte);
            count
        }))
    }

    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        Ok(self.cable.change(|ends| {
            let room = if ends.pulled { 0 } else { ROOM.saturating_sub(ends.to_client.len()) };
            let count = bytes.len().min(room);
            ends.to_client.extend(&bytes[..count]);
            count
        }))
    }

    fn unread(&self) -> u64 {
        self.cable.ends().to_client.len() as u64
    }

    fn reset(&self) -> io::Result<()> {
        self.cable.change(|ends| {
            ends.to_unit.clear();
            ends.to_client.clear();
        });
        Ok(())
    }

    fn pull(&mut self) -> io::Result<()> {
        self.cable.change(|ends| {
            ends.to_unit.clear();
            ends.pulled = true;
        });
        Ok(())
    }

    fn wait(&mut self, wants_bytes: bool, timeout: Option<Duration>) -> io::Result<Woken> {
        let something = |ends: &Ends| {
            ends.rung || ends.over || !ends.visits.is_empty() || (wants_bytes && !ends.to_unit.is_empty())
        };
        let mut ends = self.cable.wait_until(timeout.unwrap_or(Duration::MAX), something);
        let rung = std::mem::take(&mut ends.rung);
        Ok(match ends.over {
            _ if rung => Woken::Bell,
            true => Woken::End,
            false => Woken::Line,
        })
    }
}

impl Drop for MemoryPort {
    fn drop(&mut self) {
        self.cable.change(|ends| ends.pulled = true);
    }
}

/// Wakes the unit at the other end.
#[derive(Debug)]
pub(super) struct MemoryBell(Arc<Cable>);

impl Bell for MemoryBell {
    fn ring(&self) -> bool {
        self.0.change(|ends| {
            ends.rung = true;
            !ends.over
        })
    }
}

impl Drop for MemoryBell {
    fn drop(&mut self) {
        self.0.change(|ends| ends.over = true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;
    use crate::emulator::Unit;
    use crate::emulator::scenario::{Stage, Verb};
    use crate::host::unit::{BAUD, LineRate, Power, factory_setup};

    impl MemoryPort {
        /// One to which a client has sent this.
        pub(in crate::host::unit) fn holding(bytes: &[u8]) -> Self {
            let cable = Arc::new(Cable::default());
            cable.change(|ends| ends.to_unit.extend(bytes));
            MemoryPort { name: "here".into(), baud: BAUD, cable }
        }
    }

    /// What comes until it contains `text`, or the loss of the port.
    fn hear(received: &Receiver<Input>, text: &str) -> String {
        let mut heard = String::new();
        while !heard.contains(text) {
            match received.recv_timeout(Duration::from_secs(20)) {
                Ok(Input::Bytes { bytes, .. }) => heard.push_str(&String::from_utf8_lossy(&bytes)),
                Ok(Input::Gone { error, .. }) => return format!("{heard}<{error}>"),
                other => panic!("{other:?} after {heard:?}"),
            }
        }
        heard
    }

    fn opened(line_rate: LineRate, baud: u32) -> (HostedUnit, Lines, SyncSender<Vec<u8>>, Receiver<Input>) {
        let product = Product::named("AXTC4CO").expect("built in");
        let unit = Stage::bare(Unit::new(factory_setup(product, 0)));
        let hosting = Hosting { power: Power::AtFirstClient, line_rate, ..Hosting::default() };
        let (inputs, received) = crate::host::channel();
        let how = (Options { baud }, Clock::start());
        let (unit, lines, outgoing) =
            open(unit, hosting, "emu:axtc4co", how, LinkId::next(), inputs).expect("a unit in this process");
        (unit, lines, outgoing, received)
    }

    #[test]
    fn its_client_hears_the_unit_start_and_is_answered() {
        let (unit, mut lines, outgoing, received) = opened(LineRate::Off, BAUD);
        hear(&received, "AXTC4CO V1.1.0");
        hear(&received, "L ");
        outgoing.send(b"m".to_vec()).expect("queued");
        hear(&received, "L ");
        drop(outgoing);
        lines.close(Duration::from_secs(20));
        drop(unit);
    }

    #[test]
    fn a_cable_that_is_pulled_is_the_loss_of_the_port_behind_what_came_over_it() {
        let (unit, mut lines, outgoing, received) = opened(LineRate::Off, BAUD);
        hear(&received, "L ");
        let (told, answer) = sync_channel(1);
        let product = Product::named("AXTC4CO").expect("built in");
        let verb = Verb::read("unplug", product).expect("a verb");
        assert!(unit.order(verb, move |answer| told.send(answer).expect("somebody waits")));
        assert_eq!(answer.recv().expect("answered"), Ok(None));
        let last = hear(&received, "nothing more comes");
        assert!(last.ends_with("<cannot read from emu:axtc4co: the port has gone>"), "{last}");
        drop(outgoing);
        lines.close(Duration::from_secs(20));
    }

    #[test]
    fn a_client_at_another_rate_gets_garbage() {
        let (unit, mut lines, outgoing, received) = opened(LineRate::Real, 9_600);
        match received.recv_timeout(Duration::from_secs(20)) {
            Ok(Input::Bytes { bytes, .. }) => assert!(bytes.iter().all(|byte| byte & 0x80 != 0), "{bytes:?}"),
            other => panic!("{other:?}"),
        }
        drop((outgoing, unit));
        lines.close(Duration::ZERO);
    }

    #[test]
    fn what_finds_no_room_waits_at_the_client_and_is_lost_at_the_unit() {
        let port = MemoryPort::holding(&[b'S'; ROOM - 2]);
        let (cable, written) = (port.cable.clone(), sync_channel(1));
        let outlet = Outlet::new("here".into(), LinkId::next(), crate::host::channel().0);
        let (outgoing, queue) = sync_channel(1);
        outgoing.send(b"abcd".to_vec()).expect("there is room");
        drop(outgoing);
        let writer = thread::spawn(move || {
            cable.write(&queue, &outlet);
            written.0.send(()).expect("somebody waits");
        });
        drop(port.cable.wait_until(Duration::from_secs(20), |ends| ends.to_unit.len() == ROOM));
        assert!(written.1.try_recv().is_err(), "two bytes wait");
        assert_eq!(port.read(&mut [0; ROOM]).expect("read"), ROOM);
        written.1.recv().expect("now they have found room");
        writer.join().expect("it has ended");
        assert_eq!(port.read(&mut [0; ROOM]).expect("read"), 2);

        assert_eq!(port.write(&[0; ROOM - 1]).expect("written"), ROOM - 1);
        assert_eq!((port.write(b"ab").expect("written"), port.unread()), (1, ROOM as u64));
        port.reset().expect("emptied");
        assert_eq!(port.unread(), 0);
    }
}
