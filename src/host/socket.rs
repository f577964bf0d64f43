//! The two threads of a network link: a raw socket, or a remote serial port on one.
//!
//! Both wait in the system's own read and write; shutting the socket down ends either. Closing half of it first lets
//! the other side take everything before it sees the end: a connection that is dropped with unread bytes is reset,
//! and a reset throws away what the other side has not read yet, the key that leaves a sub-menu for example.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use super::address::Address;
use super::clock::Clock;
use super::link::{Cause, LinkError, Operation, Options, QUEUED, WRITE_PATIENCE};
use super::network::{self, NetworkError};
use super::outlet::Outlet;
use super::{Input, LinkId};
use crate::telnet::{self, Client};
use crate::time::{Duration, Instant};

/// What is spoken on a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// Nothing but the unit's bytes.
    Raw,
    /// Telnet with a serial port to set up (RFC 2217).
    ComPort,
}

/// The threads of an open connection.
#[derive(Debug)]
pub struct Lines {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    /// One message each: everything queued is out, and the other side has closed.
    written: Receiver<()>,
    ended: Receiver<()>,
}

/// Bytes read at once.
const READ: usize = 4096;

/// An established connection, with its port set up where there is one to set up; nobody reads from it yet.
#[derive(Debug)]
pub struct Dialled {
    name: String,
    socket: TcpStream,
    /// For a remote port only.
    client: Option<Client>,
    /// What the unit has said already.
    early: Vec<u8>,
}

/// Connects, and sets the port up where there is one to set up. `name` is the link as the user wrote it. Takes as long
/// as the resolver and the other side let it wait, within [`network::LOOK_UP_PATIENCE`], [`network::CONNECT_PATIENCE`] and
/// [`network::SET_UP_PATIENCE`].
pub fn dial(
    name: String,
    (protocol, address): (Protocol, &Address),
    options: Options,
    clock: Clock,
) -> Result<Dialled, LinkError> {
    let failed = |operation| {
        let port = name.clone();
        move |cause: Cause| LinkError { port, operation, cause }
    };
    let socket = network::connect(address, clock).map_err(Cause::from).map_err(failed(Operation::Open))?;
    let mut early = Vec::new();
    let client = match protocol {
        Protocol::Raw => None,
        Protocol::ComPort => {
            let mut client = Client::new(options.baud);
            network::negotiate(&socket, &mut client, clock, &mut early)
                .map_err(port_cause)
                .map_err(failed(Operation::Configure))?;
            Some(client)
        }
    };
    Ok(Dialled { name, socket, client, early })
}

/// Starts the threads; the sender feeds the writer, which ends when it is dropped.
pub fn start(
    dialled: Dialled,
    clock: Clock,
    link: LinkId,
    inputs: SyncSender<Input>,
) -> Result<(Lines, SyncSender<Vec<u8>>), LinkError> {
    let Dialled { name, socket, client, early } = dialled;
    let protocol = if client.is_some() { Protocol::ComPort } else { Protocol::Raw };
    let port = name.clone();
    let system = |error: io::Error| LinkError { port, operation: Operation::Open, cause: Cause::Io(error) };
    let shared = Arc::new(Shared {
        socket,
        outlet: Outlet::new(name, link, inputs),
        turn: Mutex::new(()),
        suspended: Mutex::new(client.as_ref().is_some_and(Client::is_suspended)),
        resumed: Condvar::new(),
        closing: AtomicBool::new(false),
    });
    let (outgoing, queue) = sync_channel(QUEUED);
    let (done, written) = sync_channel(1);
    let (over, ended) = sync_channel(1);
    let mut lines = Lines { shared: shared.clone(), threads: Vec::new(), written, ended };
    let reading = shared.clone();
    let reader = thread::Builder::new().name("port reader".into()).spawn(move || {
        reading.read(client, early, clock);
        let _ = over.try_send(());
    });
    match reader {
        Ok(reader) => lines.threads.push(reader),
        Err(error) => return Err(system(error)),
    }
    let writer = thread::Builder::new().name("port writer".into()).spawn(move || {
        shared.write(&queue, protocol);
        let _ = done.try_send(());
    });
    match writer {
        Ok(writer) => lines.threads.push(writer),
        Err(error) => {
            lines.close(Duration::ZERO);
            return Err(system(error));
        }
    }
    Ok((lines, outgoing))
}

impl Lines {
    /// Ends the threads: what is queued may leave for this long and be taken by the other side, then everything stops.
    pub fn close(&mut self, patience: Duration) {
        let begun = Clock::start();
        self.shared.closing.store(true, Ordering::Relaxed);
        if self.written.recv_timeout(patience).is_ok() {
            let _ = self.shared.socket.shutdown(Shutdown::Write);
            let _ = self.ended.recv_timeout(patience.saturating_sub(begun.now().since_start()));
        }
        let _ = self.shared.socket.shutdown(Shutdown::Both);
        self.shared.resumed.notify_all();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }

    /// A break is not sent over the network.
    pub fn send_break(&self) -> io::Result<()> {
        Err(io::Error::new(ErrorKind::Unsupported, "not possible over the network"))
    }
}

/// What both threads have.
#[derive(Debug)]
struct Shared {
    socket: TcpStream,
    outlet: Outlet,
    /// Whose turn it is to write: a reply must not get between the bytes of a piece.
    turn: Mutex<()>,
    /// Whether the server wants nothing for now.
    suspended: Mutex<bool>,
    resumed: Condvar,
    /// From here on nobody wants to hear anything.
    closing: AtomicBool,
}

impl Shared {
    fn read(&self, mut client: Option<Client>, early: Vec<u8>, clock: Clock) {
        if !early.is_empty() {
            self.deliver(clock.now(), early);
        }
        let mut buffer = [0; READ];
        loop {
            let count = match (&self.socket).read(&mut buffer) {
                Ok(0) => return self.report(Operation::Read, Cause::Gone),
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return self.report(Operation::Read, cause(error)),
            };
            let bytes = match &mut client {
                None => buffer[..count].to_vec(),
                Some(client) => {
                    let mut data = Vec::with_capacity(count);
                    client.receive(&buffer[..count], &mut data);
                    *locked(&self.suspended) = client.is_suspended();
                    self.resumed.notify_all();
                    data
                }
            };
            if !bytes.is_empty() {
                self.deliver(clock.now(), bytes);
            }
            if let Some(client) = &mut client {
                while let Some(reply) = client.poll_transmit() {
                    if let Err(cause) = self.send(&reply) {
                        return self.report(Operation::Write, cause);
                    }
                }
                if let Some(refusal) = client.refusal() {
                    return self.report(Operation::Read, port_cause(NetworkError::Port(refusal.clone())));
                }
            }
        }
    }

    fn write(&self, queue: &Receiver<Vec<u8>>, protocol: Protocol) {
        // A connection that has ended, in whatever way, drops the sender.
        while let Ok(bytes) = queue.recv() {
            let bytes = match protocol {
                Protocol::Raw => bytes,
                Protocol::ComPort => telnet::escape(&bytes),
            };
            let sent = if self.may_send() { self.send(&bytes) } else { Err(Cause::Stuck { after: WRITE_PATIENCE }) };
            if let Err(cause) = sent {
                return self.report(Operation::Write, cause);
            }
        }
    }

    /// Waits while the server wants nothing; `false` if it takes too long.
    fn may_send(&self) -> bool {
        let is_suspended = |suspended: &mut bool| *suspended && !self.closing.load(Ordering::Relaxed);
        let waited = self.resumed.wait_timeout_while(locked(&self.suspended), WRITE_PATIENCE, is_suspended);
        let (suspended, _) = waited.unwrap_or_else(PoisonError::into_inner);
        !*suspended
    }

    /// Writes all of these, with nothing in between.
    fn send(&self, mut left: &[u8]) -> Result<(), Cause> {
        let _turn = locked(&self.turn);
        while !left.is_empty() {
            match (&self.socket).write(left) {
                Ok(0) => return Err(Cause::Gone),
                Ok(count) => left = &left[count..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                // The socket's own timeout, which two systems name differently.
                Err(error) if error.kind() == ErrorKind::WouldBlock || is_write_timeout(&error) => {
                    return Err(Cause::Stuck { after: WRITE_PATIENCE });
                }
                Err(error) => return Err(cause(error)),
            }
        }
        Ok(())
    }

    fn report(&self, operation: Operation, cause: Cause) {
        // Closing it is what ends the reads.
        if !self.closing.load(Ordering::Relaxed) {
            self.outlet.report(operation, cause, |time| self.is_closing(time));
        }
    }

    /// Hands over what has been read; while the connection is being closed, nobody wants it.
    fn deliver(&self, at: Instant, bytes: Vec<u8>) {
        if !self.closing.load(Ordering::Relaxed) {
            self.outlet.deliver(at, bytes, |time| self.is_closing(time));
        }
    }

    /// Waits for this long, and says whether the connection is being closed.
    fn is_closing(&self, time: Duration) -> bool {
        thread::sleep(time);
        self.closing.load(Ordering::Relaxed)
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn is_write_timeout(error: &io::Error) -> bool {
    cfg!(windows) && error.kind() == ErrorKind::TimedOut
}

fn cause(error: io::Error) -> Cause {
    if network::is_hang_up(&error) { Cause::Gone } else { NetworkError::Lost(error).into() }
}

/// A line rate that the port does not do is the same trouble at a port of our own.
fn port_cause(error: NetworkError) -> Cause {
    match error {
        NetworkError::Port(telnet::Refusal::Baud { asked, set }) => Cause::Baud { asked, set },
        error => error.into(),
    }
}
