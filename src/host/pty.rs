//! A pseudo-terminal whose client's side looks like a serial port.
//!
//! One descriptor of the client's side stays open (the keeper), so that clients come and go without a hang-up on our
//! side. A fresh pseudo-terminal echoes and edits lines, so it is made raw before the first byte, and again when the
//! last client has gone. The client's settings are read on our side: the line
//! rate it chose, and whether it obeys XOFF.

use std::fs;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{InputModes, OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};

/// Our side of a pseudo-terminal.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    keeper: OwnedFd,
    path: PathBuf,
    watch: watch::Watch,
}

/// What the client has set on its side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientSettings {
    /// Line rate in baud; 0 means hung up.
    pub baud: u32,
    /// Whether the client's output stops at XOFF.
    pub obeys_xoff: bool,
}

/// What a client did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Somebody opened the port.
    Opened,
    /// Somebody closed it.
    Closed,
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
        // Watching begins behind the keeper's own opening.
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

    use super::Visit;

    #[derive(Debug)]
    pub struct Watch {
        inotify: OwnedFd,
    }

    impl Watch {
        pub fn start(path: &Path) -> io::Result<Self> {
            let inotify = inotify::init(CreateFlags::CLOEXEC | CreateFlags::NONBLOCK)?;
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

    use super::Visit;

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

/// A name for a port that stays the same: a symbolic link, removed on drop if it is still ours.
#[derive(Debug)]
pub struct PortLink {
    link: PathBuf,
    target: PathBuf,
}

/// Why a link could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PortLinkError {
    /// Something else than a link to a pseudo-terminal has the name.
    #[error("'{}' exists and is {what}; it is left as it is", link.display())]
    Taken {
        /// The name.
        link: PathBuf,
        /// What has it.
        what: String,
    },
    /// The system refused.
    #[error("cannot make the link '{}'", link.display())]
    Io {
        /// The name.
        link: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
}

impl PortLink {
    /// Makes `link` point at `target`. A link to a pseudo-terminal, which a killed emulator leaves behind, is replaced
    /// in one step; anything else is not touched.
    ///
    /// # Errors
    /// If the name is taken by something else, or the system refuses.
    pub fn create(link: &Path, target: &Path) -> Result<Self, PortLinkError> {
        let failed = |source| PortLinkError::Io { link: link.to_owned(), source };
        match fs::symlink_metadata(link) {
            Ok(metadata) if metadata.is_symlink() => {
                let former = fs::read_link(link).map_err(failed)?;
                // A dangling link is stale whatever it pointed at.
                if !former.starts_with("/dev/pts") && link.exists() {
                    let what = format!("a link to '{}', not to a pseudo-terminal", former.display());
                    return Err(PortLinkError::Taken { link: link.to_owned(), what });
                }
                if let Some(host) = super::ports::other_host(link) {
                    let what = format!("the port of a unit that {host} emulates");
                    return Err(PortLinkError::Taken { link: link.to_owned(), what });
                }
            }
            Ok(metadata) => {
                let what = if metadata.is_dir() { "a directory" } else { "a file" };
                return Err(PortLinkError::Taken { link: link.to_owned(), what: what.into() });
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(failed(error)),
        }
        let mut temporary = link.as_os_str().to_owned();
        temporary.push(format!(".{}.tmp", std::process::id()));
        let temporary = PathBuf::from(temporary);
        // Left behind by a process of the same number that was killed: in a container they all have the same.
        let _ = fs::remove_file(&temporary);
        std::os::unix::fs::symlink(target, &temporary).map_err(failed)?;
        if let Err(error) = fs::rename(&temporary, link) {
            let _ = fs::remove_file(&temporary);
            return Err(failed(error));
        }
        Ok(PortLink { link: link.to_owned(), target: target.to_owned() })
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.link
    }
}

impl Drop for PortLink {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|target| target == self.target) {
            let _ = fs::remove_file(&self.link);
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

    #[test]
    fn clients_are_seen_coming_and_going() {
        let pty = Pty::open(115_200).expect("a pseudo-terminal");
        // Not as a controlling terminal: its hang-up would end the tests.
        let flags = rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY;
        drop(rustix::fs::open(pty.path(), flags, rustix::fs::Mode::empty()).expect("opened"));
        assert_eq!(pty.visits().expect("visits"), [Visit::Opened, Visit::Closed]);
    }

    #[test]
    fn a_link_replaces_only_a_link_to_a_pseudo_terminal() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = folder.path().join("port");
        let create = |name: &Path| PortLink::create(name, Path::new("/dev/pts/4711"));

        let stale = folder.path().join("stale");
        std::os::unix::fs::symlink("/dev/pts/4712", &stale).expect("a link");
        let half_way = folder.path().join(format!("stale.{}.tmp", std::process::id()));
        std::os::unix::fs::symlink("/dev/pts/4713", half_way).expect("a link");
        drop(create(&stale).expect("replaced"));
        assert!(fs::symlink_metadata(&stale).is_err(), "removed on drop");

        let link = create(&name).expect("made");
        fs::remove_file(&name).expect("removed");
        fs::write(&name, "mine now").expect("a file");
        drop(link);
        assert!(name.exists(), "another's file stays");
        let error = create(&name).expect_err("refused").to_string();
        assert!(error.contains("exists and is a file"), "{error}");

        let foreign = folder.path().join("foreign");
        std::os::unix::fs::symlink(&name, &foreign).expect("a link");
        let error = create(&foreign).expect_err("refused").to_string();
        assert!(error.contains("not to a pseudo-terminal"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 2, "nothing temporary is left");
    }
}
