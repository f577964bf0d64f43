//! Serial ports on Windows: one thread for both directions.
//!
//! The library's handles are synchronous there: a write waits while another thread sits in a read. So one thread reads
//! with a short timeout and looks at the queue in between. The same code runs in the tests of other systems, over a
//! pseudo-terminal.

use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::{self, JoinHandle};

use serialport::{ErrorKind, FlowControl, SerialPort};

use super::clock::Clock;
use super::link::{Cause, LinkError, Operation, Options, QUEUED, WRITE_PATIENCE};
use super::outlet::Outlet;
use super::{Input, LinkId};
use crate::telnet;
use crate::time::Duration;

/// The thread of an open port.
#[derive(Debug)]
pub struct Lines {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    written: Receiver<()>,
}

/// How long a read waits, and so how long a key may wait to be sent: too short for a person to notice.
const READ_TIMEOUT: Duration = Duration::from_millis(5);

/// Bytes read at once.
const READ: usize = 4096;

/// Opens a port and starts its thread; the sender feeds it, and closing begins when it is dropped.
pub fn open(
    path: &Path,
    options: Options,
    clock: Clock,
    link: LinkId,
    inputs: SyncSender<Input>,
) -> Result<(Lines, SyncSender<Vec<u8>>), LinkError> {
    let name = path.display().to_string();
    let failed = |operation, cause| LinkError { port: name.clone(), operation, cause };
    let port = serialport::new(name.clone(), options.baud)
        .flow_control(FlowControl::None)
        .timeout(READ_TIMEOUT)
        .dtr_on_open(true)
        .open()
        .map_err(|error| failed(Operation::Open, open_cause(error)))?;
    let set = port.baud_rate().map_err(|error| failed(Operation::Configure, Cause::Io(error.into())))?;
    if !telnet::rate_is_close(options.baud, set) {
        return Err(failed(Operation::Configure, Cause::Baud { asked: options.baud, set }));
    }
    let (outgoing, queue) = sync_channel(QUEUED);
    let (done, written) = sync_channel(1);
    let stop = Arc::new(AtomicBool::new(false));
    let outlet = Outlet::new(name.clone(), link, inputs);
    let worker = Worker { port, stop: stop.clone(), outlet, clock };
    let thread = thread::Builder::new()
        .name("port".into())
        .spawn(move || worker.run(&queue, &done))
        .map_err(|error| failed(Operation::Open, Cause::Io(error)))?;
    Ok((Lines { stop, thread: Some(thread), written }, outgoing))
}

impl Lines {
    /// A break would have to pass the thread that reads; nobody has needed one here yet.
    #[cfg(windows)]
    pub fn send_break(&self) -> io::Result<()> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "not possible on this system"))
    }

    /// Ends the thread: what is queued may leave for this long, then everything stops.
    pub fn close(&mut self, patience: Duration) {
        let _ = self.written.recv_timeout(patience);
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Worker {
    port: Box<dyn SerialPort>,
    stop: Arc<AtomicBool>,
    outlet: Outlet,
    clock: Clock,
}

impl Worker {
    fn run(mut self, queue: &Receiver<Vec<u8>>, done: &SyncSender<()>) {
        let mut buffer = [0; READ];
        while !self.stop.load(Ordering::Relaxed) {
            loop {
                match queue.try_recv() {
                    Ok(bytes) => {
                        if let Err(cause) = self.write(&bytes) {
                            return self.report(Operation::Write, cause);
                        }
                    }
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => {
                        let _ = done.try_send(());
                        break;
                    }
                }
            }
            match self.port.read(&mut buffer) {
                // Windows reports a read that timed out as a read of nothing.
                Ok(0) if cfg!(windows) => {}
                Ok(0) => return self.report(Operation::Read, Cause::Gone),
                Ok(count) => {
                    let bytes = buffer[..count].to_vec();
                    if !self.outlet.deliver(self.clock.now(), bytes, |time| self.is_closing(time)) {
                        return;
                    }
                }
                Err(error) if is_pause(&error) => {}
                Err(error) => return self.report(Operation::Read, cause(error)),
            }
        }
    }

    fn write(&mut self, mut left: &[u8]) -> Result<(), Cause> {
        let mut deadline = self.clock.now() + WRITE_PATIENCE;
        while !left.is_empty() && !self.stop.load(Ordering::Relaxed) {
            match self.port.write(left) {
                Ok(0) => {}
                Ok(count) => {
                    left = &left[count..];
                    deadline = self.clock.now() + WRITE_PATIENCE;
                }
                Err(error) if is_pause(&error) => {}
                Err(error) => return Err(cause(error)),
            }
            if self.clock.now() > deadline {
                return Err(Cause::Stuck { after: WRITE_PATIENCE });
            }
        }
        Ok(())
    }

    fn report(&self, operation: Operation, cause: Cause) {
        self.outlet.report(operation, cause, |time| self.is_closing(time));
    }

    /// Waits for this long, and says whether the connection is being closed.
    fn is_closing(&self, time: Duration) -> bool {
        thread::sleep(time);
        self.stop.load(Ordering::Relaxed)
    }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

fn cause(error: io::Error) -> Cause {
    match error.kind() {
        io::ErrorKind::BrokenPipe | io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied => Cause::Gone,
        _ => Cause::Io(error),
    }
}

fn open_cause(error: serialport::Error) -> Cause {
    match error.kind {
        ErrorKind::Io(io::ErrorKind::NotFound) => Cause::Missing,
        // Windows denies access to a port that is open already.
        ErrorKind::Io(io::ErrorKind::PermissionDenied) if cfg!(windows) => Cause::Busy { holder: None },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => Cause::Denied { group: None },
        ErrorKind::NoDevice if cfg!(windows) => Cause::Missing,
        ErrorKind::NoDevice => Cause::Busy { holder: None },
        ErrorKind::InvalidInput | ErrorKind::Unknown | ErrorKind::Io(_) => Cause::Io(error.into()),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::host::pty::Pty;

    #[test]
    fn one_thread_carries_both_directions_and_notices_the_end() {
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        let (inputs, received) = super::super::channel();
        let (mut lines, outgoing) =
            open(pty.path(), Options { baud: 115_200 }, Clock::start(), LinkId::next(), inputs).expect("opened");
        pty.write(b"hello").expect("written");
        match received.recv_timeout(Duration::from_secs(5)) {
            Ok(Input::Bytes { bytes, .. }) => assert_eq!(bytes, b"hello"),
            other => panic!("{other:?}"),
        }
        outgoing.send(b"m".to_vec()).expect("queued");
        drop(outgoing);
        lines.close(Duration::from_secs(5));
        let mut buffer = [0; 4];
        assert_eq!(pty.read(&mut buffer).expect("read"), 1);
        assert_eq!(buffer[0], b'm');
    }
}
