//! Serial ports on Unix: raw, eight bits, no flow control by the kernel, no wait for a drain.
//!
//! Opened by hand rather than through a library, for three reasons found by measuring: the errors keep their cause
//! (denied, busy and "not a terminal" need different advice), a failed second open leaves the first one's lock alone,
//! and the descriptor stays non-blocking, so that a writer can keep a deadline. Opening raises DTR and RTS in every
//! driver, which many USB devices wait for.

use std::convert::Infallible;
use std::fs;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use rustix::event::PollFlags;
use rustix::fs::{FlockOperation, Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{
    Action, ControlModes, InputModes, OptionalActions, QueueSelector, SpecialCodeIndex, Termios, ioctl_tiocexcl,
    ioctl_tiocnxcl, isatty, tcdrain, tcflow, tcflush, tcgetattr, tcsendbreak, tcsetattr,
};

use super::clock::Clock;
use super::link::{Cause, LinkError, Operation, Options, QUEUED, WRITE_PATIENCE};
use super::outlet::Outlet;
use super::ports;
use super::wait::{Stop, Stopper, ready, stop};
use super::{Input, LinkId};
use crate::telnet;
use crate::time::Duration;

/// The two threads of an open port.
#[derive(Debug)]
pub struct Lines {
    port: Arc<OwnedFd>,
    stopper: Option<Stopper>,
    reader: Option<JoinHandle<()>>,
    writer: Option<JoinHandle<()>>,
    written: Receiver<()>,
    /// Disconnected when the last break has ended.
    last_break: Mutex<Option<Receiver<Infallible>>>,
}

/// Bytes read at once: Linux hands out no more than 4 KiB of a terminal's bytes at a time.
const READ: usize = 4096;

/// Opens a port and starts its threads; the sender feeds the writer, which ends when it is dropped.
pub fn open(
    path: &Path,
    options: Options,
    clock: Clock,
    link: LinkId,
    inputs: SyncSender<Input>,
) -> Result<(Lines, SyncSender<Vec<u8>>), LinkError> {
    let name = path.display().to_string();
    let failed = |operation| {
        let port = name.clone();
        move |cause| LinkError { port, operation, cause }
    };
    let port = Arc::new(open_exclusively(path).map_err(failed(Operation::Open))?);
    configure(&port, options.baud).map_err(failed(Operation::Configure))?;

    let system = |error| failed(Operation::Open)(Cause::Io(error));
    let (stopper, stopped) = stop().map_err(system)?;
    let outlet = Arc::new(Outlet::new(name.clone(), link, inputs));
    let stops = stopped.try_clone().map_err(system)?;
    let reader = Worker { port: port.clone(), stopped: stops, outlet: outlet.clone() };
    let writer = Worker { port: port.clone(), stopped, outlet };
    let (outgoing, queue) = sync_channel(QUEUED);
    let (done, written) = sync_channel(1);
    let reader = thread::Builder::new().name("port reader".into()).spawn(move || reader.read(clock)).map_err(system)?;
    let writer = thread::Builder::new()
        .name("port writer".into())
        .spawn(move || {
            writer.write(&queue);
            let _ = done.try_send(());
        })
        .map_err(system)?;
    let last_break = Mutex::new(None);
    let lines = Lines { port, stopper: Some(stopper), reader: Some(reader), writer: Some(writer), written, last_break };
    Ok((lines, outgoing))
}

impl Lines {
    /// Sends a break, from a thread: the system waits for its end.
    pub fn send_break(&self) -> io::Result<()> {
        let mut last = self.last_break.lock().unwrap_or_else(PoisonError::into_inner);
        // A driver that does not end one must not collect a thread for each key.
        if last.as_ref().is_some_and(|ended| ended.try_recv() == Err(TryRecvError::Empty)) {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "the break before it has not ended"));
        }
        let (breaking, ended) = sync_channel(0);
        let port = self.port.clone();
        let send = move || {
            let _ = tcsendbreak(&*port);
            drop((port, breaking));
        };
        thread::Builder::new().name("break".into()).spawn(send)?;
        *last = Some(ended);
        Ok(())
    }

    /// Ends the threads: what is queued, and what the driver has, may leave for this long, then everything stops.
    pub fn close(&mut self, patience: Duration) {
        let begun = Clock::start();
        let left = || patience.saturating_sub(begun.now().since_start());
        match self.written.recv_timeout(patience) {
            Ok(()) | Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        self.stopper = None;
        for thread in [self.reader.take(), self.writer.take()].into_iter().flatten() {
            let _ = thread.join();
        }
        // Closing waits, in the kernel and for up to 30 s, for what the driver has not sent; a port at whose other end
        // nobody takes anything would keep the program that long.
        let (drained, discarded) = (self.port.clone(), self.port.clone());
        let drain = move || while tcdrain(&*drained) == Err(Errno::INTR) {};
        let discard = || {
            let _ = tcflush(&*discarded, QueueSelector::OFlush);
        };
        empty(drain, discard, left());
        let last_break = self.last_break.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        let _ = last_break.map(|ended| ended.recv_timeout(left()));
        // A break or a drain that the driver does not end keeps the port open, and with it our lock.
        let _ = rustix::fs::flock(&self.port, FlockOperation::NonBlockingUnlock);
        // The host of a pseudo-terminal keeps the device open, and with it this lock.
        let _ = ioctl_tiocnxcl(&self.port);
    }
}

/// Waits until a driver has sent what it has, which is what `drain` waits for, without an end of its own and so in a
/// thread. What takes longer than `patience` is discarded, which ends the drain.
fn empty(drain: impl FnOnce() + Send + 'static, discard: impl FnOnce(), patience: Duration) {
    let (done, drained) = sync_channel(1);
    let draining = thread::Builder::new().name("drain".into()).spawn(move || {
        drain();
        let _ = done.try_send(());
    });
    if draining.is_err() || drained.recv_timeout(patience).is_err() {
        discard();
        // The thread has the port open, which is to be free when this returns.
        let _ = drained.recv_timeout(DISCARDED);
    }
}

/// How long a drain may take to notice that there is nothing left to drain.
const DISCARDED: Duration = Duration::from_millis(50);

/// What both threads have.
struct Worker {
    port: Arc<OwnedFd>,
    stopped: Stop,
    outlet: Arc<Outlet>,
}

impl Worker {
    fn read(self, clock: Clock) {
        let mut buffer = [0; READ];
        loop {
            match ready([(self.port.as_fd(), PollFlags::IN), (self.stopped.as_fd(), PollFlags::IN)], None) {
                Ok([_, stopped]) if !stopped.is_empty() => return,
                Ok([port, _]) if port.is_empty() => continue,
                Ok(_) => {}
                Err(error) => return self.report(Operation::Read, Cause::Io(error)),
            }
            match rustix::io::read(&*self.port, &mut buffer) {
                Ok(0) => return self.report(Operation::Read, Cause::Gone),
                Ok(count) => {
                    let bytes = buffer[..count].to_vec();
                    if !self.outlet.deliver(clock.now(), bytes, |time| self.stopped.wait(time)) {
                        return;
                    }
                }
                Err(Errno::INTR | Errno::AGAIN) => {}
                Err(error) => return self.report(Operation::Read, cause(error)),
            }
        }
    }

    fn write(&self, queue: &Receiver<Vec<u8>>) {
        // A connection that has ended, in whatever way, drops the sender.
        while let Ok(bytes) = queue.recv() {
            let mut left = bytes.as_slice();
            while !left.is_empty() {
                match rustix::io::write(&*self.port, left) {
                    Ok(count) => left = &left[count..],
                    Err(Errno::INTR) => {}
                    Err(Errno::AGAIN) => {
                        let fds = [(self.port.as_fd(), PollFlags::OUT), (self.stopped.as_fd(), PollFlags::IN)];
                        match ready(fds, Some(WRITE_PATIENCE)) {
                            Ok([_, stopped]) if !stopped.is_empty() => return,
                            Ok([port, _]) if port.is_empty() => {
                                return self.report(Operation::Write, Cause::Stuck { after: WRITE_PATIENCE });
                            }
                            Ok(_) => {}
                            Err(error) => return self.report(Operation::Write, Cause::Io(error)),
                        }
                    }
                    Err(error) => return self.report(Operation::Write, cause(error)),
                }
            }
        }
    }

    fn report(&self, operation: Operation, cause: Cause) {
        self.outlet.report(operation, cause, |time| self.stopped.wait(time));
    }
}

/// The holder of a port that is taken: another process, or else this one, which has just opened it too.
fn who_has(path: &Path) -> Option<ports::Holder> {
    ports::other_holder(path).or_else(|| ports::holder(path))
}

fn open_exclusively(path: &Path) -> Result<OwnedFd, Cause> {
    // Looked at first: opening is not harmless for every file there is (a watchdog starts, a pipe waits).
    let metadata = fs::metadata(path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Cause::Missing,
        io::ErrorKind::PermissionDenied => Cause::Denied { group: None },
        _ => Cause::Io(error),
    })?;
    let kind = metadata.file_type();
    if !kind.is_char_device() {
        let what = if kind.is_dir() {
            "a directory"
        } else if kind.is_file() {
            "a regular file"
        } else {
            "a pipe, socket or disk"
        };
        return Err(Cause::NotSerial { what });
    }
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let port = rustix::fs::open(path, flags, Mode::empty()).map_err(|error| match error {
        Errno::NOENT => Cause::Missing,
        Errno::ACCESS | Errno::PERM | Errno::ROFS => Cause::Denied { group: group_with_access(&metadata) },
        Errno::BUSY => Cause::Busy { holder: who_has(path) },
        Errno::NXIO | Errno::NODEV | Errno::IO => Cause::Gone,
        error => Cause::Io(error.into()),
    })?;
    if !isatty(&port) {
        return Err(Cause::NotSerial { what: "some other device" });
    }
    // The lock first: TIOCEXCL is the terminal's, not ours, and must not be touched while somebody else works here.
    match rustix::fs::flock(&port, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => {}
        Err(Errno::WOULDBLOCK) => return Err(Cause::Busy { holder: who_has(path) }),
        Err(error) => return Err(cause(error)),
    }
    // Many programs set neither, and two readers would share what the unit says.
    if let Some(holder) = ports::other_holder(path).or_else(|| ports::lock_holder(path)) {
        return Err(Cause::Busy { holder: Some(holder) });
    }
    ioctl_tiocexcl(&port).map_err(cause)?;
    Ok(port)
}

fn configure(port: &OwnedFd, baud: u32) -> Result<(), Cause> {
    let mut settings = tcgetattr(port).map_err(cause)?;
    settings.make_raw();
    settings.special_codes[SpecialCodeIndex::VMIN] = 1;
    settings.special_codes[SpecialCodeIndex::VTIME] = 0;
    settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL | ControlModes::CS8;
    settings.control_modes -= ControlModes::PARENB | ControlModes::CSTOPB | ControlModes::CRTSCTS;
    settings.input_modes -= InputModes::IXOFF | InputModes::IXANY;
    settings.set_speed(baud).map_err(cause)?;
    // A former user may have left the output stopped. That state is the terminal's; removing IXON ends it, but only
    // if IXON was there.
    settings.input_modes |= InputModes::IXON;
    apply(port, &settings)?;
    settings.input_modes -= InputModes::IXON;
    apply(port, &settings)?;
    tcflow(port, Action::OOn).map_err(cause)?;

    // Drivers take a rate they cannot do without complaint: a 16550 then runs at 9600.
    let set = tcgetattr(port).map_err(cause)?.output_speed();
    if !telnet::rate_is_close(baud, set) {
        return Err(Cause::Baud { asked: baud, set });
    }
    Ok(())
}

fn apply(port: &OwnedFd, settings: &Termios) -> Result<(), Cause> {
    tcsetattr(port, OptionalActions::Now, settings).map_err(cause)
}

fn cause(error: Errno) -> Cause {
    match error {
        // An unplugged adapter and the closed side of a pseudo-terminal answer with these.
        Errno::IO | Errno::NXIO | Errno::NODEV | Errno::PIPE => Cause::Gone,
        Errno::NOTTY => Cause::NotSerial { what: "some other device" },
        error => Cause::Io(error.into()),
    }
}

/// The group whose members may read and write: joining one that may not gains nothing, and nobody should join that of
/// root.
fn group_with_access(metadata: &fs::Metadata) -> Option<String> {
    let may = may_be_joined(metadata.mode(), metadata.gid());
    may.then(|| group_name(metadata.gid())).flatten()
}

fn may_be_joined(mode: u32, gid: u32) -> bool {
    const READ_AND_WRITE: u32 = 0o060;
    mode & READ_AND_WRITE == READ_AND_WRITE && gid != 0
}

/// The name of a group, from the file that has them on most systems; its number elsewhere.
fn group_name(gid: u32) -> Option<String> {
    let groups = fs::read_to_string("/etc/group").unwrap_or_default();
    let name = groups.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(gid)).then(|| name.to_owned())
    });
    name.or_else(|| Some(gid.to_string()))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn only_a_group_that_has_access_and_is_not_roots_is_to_be_joined() {
        assert!(may_be_joined(0o020_660, 20));
        for (mode, gid) in [(0o020_600, 20), (0o020_640, 20), (0o020_620, 5), (0o020_660, 0)] {
            assert!(!may_be_joined(mode, gid), "{mode:o} {gid}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_port_that_a_program_without_locks_uses_is_not_shared() {
        use std::process::{Command, Stdio};

        use crate::host::ports::Holder;
        use crate::host::pty::Pty;

        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let port = rustix::fs::open(pty.path(), flags, Mode::empty()).expect("opened");
        let mut reader = Command::new("cat").stdin(port).stdout(Stdio::null()).spawn().expect("cat starts");
        let refused = open_exclusively(pty.path()).map(drop).expect_err("somebody else reads there");
        let Cause::Busy { holder: Some(Holder { name, pid }) } = refused else { panic!("{refused}") };
        assert_eq!((name.as_str(), pid), ("cat", reader.id()));
        reader.kill().and_then(|()| reader.wait()).expect("cat ends");
        open_exclusively(pty.path()).expect("nobody else is there");
    }

    #[test]
    fn what_a_driver_cannot_send_is_discarded_and_keeps_nobody() {
        let (discard, discarded) = mpsc::channel::<()>();
        let (over, ended) = mpsc::channel();
        let drain = move || {
            let _ = discarded.recv();
            let _ = over.send(());
        };
        empty(drain, || drop(discard), Duration::from_millis(1));
        assert_eq!(ended.recv_timeout(Duration::from_secs(10)), Ok(()), "the drain has ended");
        // One that not even that ends is left to itself.
        let (never, ends) = mpsc::channel::<()>();
        let asked = Cell::new(false);
        let stuck = move || {
            let _ = ends.recv();
        };
        empty(stuck, || asked.set(true), Duration::from_millis(1));
        assert!(asked.get());
        drop(never);
    }

    #[test]
    fn what_a_driver_does_send_is_not_discarded() {
        let discarded = Cell::new(false);
        empty(|| thread::sleep(Duration::from_millis(5)), || discarded.set(true), Duration::from_secs(60));
        assert!(!discarded.get());
    }
}
