//! A pseudo-terminal whose client's side looks like a serial port.
//!
//! One descriptor of the client's side stays open (the keeper), so that clients come and go without a hang-up on our
//! side. A fresh pseudo-terminal echoes and edits lines, so it is made raw before the first byte, and again when the
//! last client has gone. The client's settings are read on our side: the line
//! rate it chose, and whether it obeys XOFF.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{InputModes, OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};

use super::unit::port::{ClientSettings, Visit};

/// Our side of a pseudo-terminal.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    keeper: OwnedFd,
    path: PathBuf,
    watch: watch::Watch,
}

impl Pty {
    /// A new pseudo-terminal, raw, with nobody on it, at this line rate until a client sets another.
    ///
    /// # Errors
    /// If the system gives none.
    pub fn open(baud: u32) -> io::Result<Self> {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(std::ffi::OsString::from(
            name.into_string().map_err(|_| io::Error::other("the system names a pseudo-terminal without letters"))?,
        ));
        let keeper = open_keeper(&master, &path)?;
        rustix::fs::fcntl_setfl(&master, rustix::fs::fcntl_getfl(&master)? | rustix::fs::OFlags::NONBLOCK)?;
        // Watching begins after the keeper's own opening.
        let watch = watch::Watch::start(&path)?;
        let mut settings = tcgetattr(&keeper)?;
        settings.input_modes -= InputModes::IXON;
        settings.set_speed(baud)?;
        tcsetattr(&keeper, OptionalActions::Now, &settings)?;
        let pty = Pty { master, keeper, path, watch };
        pty.reset()?;
        Ok(pty)
    }

    /// What a client opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the port ready for the next client: raw, running, unlocked, empty. Line rate and flow control stay as the
    /// last client left them, as on real ports, where `stty` sets them for the program that comes next.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn reset(&self) -> io::Result<()> {
        let mut settings = tcgetattr(&self.keeper)?;
        let kept = settings.input_modes & InputModes::IXON;
        settings.make_raw();
        settings.input_modes -= InputModes::IXOFF | InputModes::IXANY;
        // With IXON on and off again, an output that an XOFF has stopped runs again.
        for flow_control in [InputModes::IXON, InputModes::empty(), kept] {
            settings.input_modes -= InputModes::IXON;
            settings.input_modes |= flow_control;
            tcsetattr(&self.keeper, OptionalActions::Now, &settings)?;
        }
        // A client that was killed leaves its lock behind.
        ioctl_tiocnxcl(&self.keeper)?;
        tcflush(&self.keeper, QueueSelector::IOFlush)?;
        Ok(())
    }

    /// What the client has set.
    ///
    /// # Errors
    /// If the system does not tell.
    pub fn client_settings(&self) -> io::Result<ClientSettings> {
        let settings = tcgetattr(&self.master)?;
        Ok(ClientSettings {
            baud: settings.output_speed(),
            obeys_xoff: settings.input_modes.contains(InputModes::IXON),
        })
    }

    /// Takes what the client has sent, without waiting: no bytes if there are none.
    ///
    /// # Errors
    /// If the system does not give them.
    pub fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        match rustix::io::read(&self.master, buffer) {
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => Err(error.into()),
        }
    }

    /// Gives bytes to the client, without waiting: those that find no room are not taken.
    ///
    /// # Errors
    /// If the system does not take them.
    pub fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = 0;
        while written < bytes.len() {
            match rustix::io::write(&self.master, &bytes[written..]) {
                Ok(count) => written += count,
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => break,
                Err(error) => return Err(error.into()),
            }
        }
        Ok(written)
    }

    /// Bytes that the client has not read yet. What was written a moment ago may be missing: the kernel carries it over
    /// in its own time.
    pub fn unread(&self) -> u64 {
        rustix::io::ioctl_fionread(&self.keeper).unwrap_or(0)
    }

    /// Clients that came and went since the last question, oldest first.
    ///
    /// # Errors
    /// If the system does not tell.
    pub fn visits(&self) -> io::Result<Vec<Visit>> {
        self.watch.take()
    }

    /// Ready for reading when a client has come or gone.
    pub fn visits_fd(&self) -> BorrowedFd<'_> {
        self.watch.as_fd()
    }
}

impl AsFd for Pty {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

#[cfg(target_os = "linux")]
fn open_keeper(master: &OwnedFd, _path: &Path) -> io::Result<OwnedFd> {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    Ok(rustix::pty::ioctl_tiocgptpeer(master, flags)?)
}

#[cfg(not(target_os = "linux"))]
fn open_keeper(master: &OwnedFd, path: &Path) -> io::Result<OwnedFd> {
    use rustix::fs::{Mode, OFlags};
    rustix::pty::grantpt(master)?;
    Ok(rustix::fs::open(path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?)
}

#[cfg(target_os = "linux")]
mod watch {
    //! Who opens and closes the client's side, from inotify.

    use std::io;
    use std::mem::MaybeUninit;
    use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
    use std::path::Path;

    use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
    use rustix::io::Errno;

    use crate::host::unit::port::Visit;

    #[derive(Debug)]
    pub struct Watch {
        inotify: OwnedFd,
    }

    impl Watch {
        pub fn start(path: &Path) -> io::Result<Self> {
            let inotify = inotify::init(CreateFlags::CLOEXEC | CreateFlags::NONBLOCK)
                .map_err(|error| refused(error, || std::fs::File::open("/dev/null").is_ok()))?;
            let events = WatchFlags::OPEN | WatchFlags::CLOSE_WRITE | WatchFlags::CLOSE_NOWRITE;
            inotify::add_watch(&inotify, path, events)?;
            Ok(Watch { inotify })
        }

        pub fn take(&self) -> io::Result<Vec<Visit>> {
            // An event without a name takes 16 bytes: room for 64 at once.
            let mut buffer = [MaybeUninit::uninit(); 1024];
            let mut events = inotify::Reader::new(&self.inotify, &mut buffer);
            let mut visits = Vec::new();
            loop {
                match events.next() {
                    Ok(event) if event.events().contains(ReadFlags::OPEN) => visits.push(Visit::Opened),
                    Ok(event) if event.events().intersects(ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE) => {
                        visits.push(Visit::Closed);
                    }
                    Ok(_) | Err(Errno::INTR) => {}
                    Err(Errno::AGAIN) => return Ok(visits),
                    Err(error) => return Err(error.into()),
                }
            }
        }
    }

    /// Why there is no watch. The system says "too many open files" to two limits; that of the process leaves no file at
    /// all.
    pub(super) fn refused(error: Errno, has_files: impl FnOnce() -> bool) -> io::Error {
        if error == Errno::MFILE && has_files() {
            let why = "each emulated unit takes an inotify instance, and the user has no more of them (sysctl \
                       fs.inotify.max_user_instances)";
            return io::Error::other(why);
        }
        error.into()
    }

    impl AsFd for Watch {
        fn as_fd(&self) -> BorrowedFd<'_> {
            self.inotify.as_fd()
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod watch {
    //! Elsewhere nobody says who opens and closes: one client is assumed, from the beginning and for ever.

    use std::cell::Cell;
    use std::io::{self, PipeReader, PipeWriter};
    use std::os::fd::{AsFd, BorrowedFd};
    use std::path::Path;

    use crate::host::unit::port::Visit;

    #[derive(Debug)]
    pub struct Watch {
        begun: Cell<bool>,
        silent: PipeReader,
        _open: PipeWriter,
    }

    impl Watch {
        pub fn start(_path: &Path) -> io::Result<Self> {
            let (silent, open) = io::pipe()?;
            Ok(Watch { begun: Cell::new(false), silent, _open: open })
        }

        pub fn take(&self) -> io::Result<Vec<Visit>> {
            Ok(if self.begun.replace(true) { Vec::new() } else { vec![Visit::Opened] })
        }
    }

    impl AsFd for Watch {
        fn as_fd(&self) -> BorrowedFd<'_> {
            self.silent.as_fd()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fresh_port_neither_echoes_nor_stops() {
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        assert_eq!(pty.write(b"boot\r\n\x13").expect("written"), 7);
        for _ in 0..1_000 {
            if pty.unread() == 7 {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        assert_eq!(pty.unread(), 7);
        let mut buffer = [0; 16];
        assert_eq!(pty.read(&mut buffer).expect("read"), 0, "nothing comes back");
        assert!(!pty.client_settings().expect("settings").obeys_xoff);
        assert_eq!(pty.visits().expect("visits"), []);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn which_limit_leaves_no_watch_is_named() {
        let why = |error, has_files| watch::refused(error, || has_files).to_string();
        assert!(why(Errno::MFILE, true).contains("fs.inotify.max_user_instances"), "{}", why(Errno::MFILE, true));
        assert!(why(Errno::MFILE, false).starts_with("Too many open files"), "{}", why(Errno::MFILE, false));
        assert!(!why(Errno::NOMEM, true).contains("inotify"), "{}", why(Errno::NOMEM, true));
    }

    #[test]
    fn clients_are_seen_coming_and_going() {
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        // Not as a controlling terminal: its hang-up would end the tests.
        let flags = rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY;
        drop(rustix::fs::open(pty.path(), flags, rustix::fs::Mode::empty()).expect("opened"));
        assert_eq!(pty.visits().expect("visits"), [Visit::Opened, Visit::Closed]);
    }
}
