//! Which serial ports there are, what they hang on, and who holds them.

use std::path::{Path, PathBuf};

use serialport::SerialPortType;

use crate::record::Adapter;

/// A serial port of this computer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// What to open.
    pub path: String,
    /// What it hangs on.
    pub kind: Kind,
    /// USB vendor and product.
    pub usb: Option<Usb>,
    /// The kernel's driver, where the system tells.
    pub driver: Option<String>,
    /// Where a USB adapter is plugged in, with its interface (`1-1.4:1.0`), where the system tells.
    pub place: Option<String>,
}

/// What a port hangs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A USB adapter or device.
    Usb,
    /// A UART of the computer itself.
    Native,
    /// A pseudo-terminal, named by hand: the system lists none.
    Pty,
    /// A Bluetooth serial profile.
    Bluetooth,
}

impl Kind {
    /// The stable name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Usb => "usb",
            Kind::Native => "native",
            Kind::Pty => "pty",
            Kind::Bluetooth => "bluetooth",
        }
    }
}

/// What a USB device says about itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usb {
    /// Vendor.
    pub vid: u16,
    /// Product.
    pub pid: u16,
    /// Serial number, where it has one.
    pub serial_number: Option<String>,
    /// Maker, in its own words.
    pub manufacturer: Option<String>,
    /// Product, in its own words.
    pub product: Option<String>,
}

impl From<Usb> for Adapter {
    fn from(usb: Usb) -> Self {
        Adapter {
            vid: format!("{:04x}", usb.vid),
            pid: format!("{:04x}", usb.pid),
            serial_number: usb.serial_number,
            manufacturer: usb.manufacturer,
            product: usb.product,
        }
    }
}

/// A process that has a port open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Name of the program, as the system shows it.
    pub name: String,
    /// Process number.
    pub pid: u32,
}

impl std::fmt::Display for Holder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (process {})", self.name, self.pid)
    }
}

/// All serial ports, USB first, each kind in the order of its numbers.
///
/// # Errors
/// If the system does not list them.
pub fn list() -> Result<Vec<Port>, serialport::Error> {
    // serialport 4.10 panics where the directory is missing, as in small containers.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let mut ports: Vec<Port> =
        serialport::available_ports()?.into_iter().filter(|info| !is_phantom(&info.port_name)).map(port).collect();
    ports.sort_by_key(|port| (port.kind != Kind::Usb, natural_key(&port.path)));
    Ok(ports)
}

/// What a path names, for one that a list need not hold.
pub fn describe(path: &Path) -> Port {
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let listed = list().unwrap_or_default().into_iter().find(|port| Path::new(&port.path) == target);
    let kind = if target.starts_with("/dev/pts") { Kind::Pty } else { Kind::Native };
    listed.unwrap_or_else(|| Port { path: path.display().to_string(), kind, usb: None, driver: None, place: None })
}

/// The other ports whose adapters nobody could tell from this one by what they say of themselves.
pub fn alike(port: &Port) -> Vec<Port> {
    list().unwrap_or_default().into_iter().filter(|other| is_alike(other, port) && other.path != port.path).collect()
}

/// Where an adapter is now whose cable was pulled: it keeps its identity and not its name. `others` are those
/// [`alike`] when the link was lost, which it cannot be. `None` while it is not there, or nobody can say that it is the
/// same: what hangs on another adapter is another unit.
pub fn find_again(port: &Port, others: &[Port]) -> Option<PathBuf> {
    again(&list().unwrap_or_default(), port, others)
}

fn again(ports: &[Port], port: &Port, others: &[Port]) -> Option<PathBuf> {
    let was_there =
        |found: &Port| others.iter().any(|other| (&other.path, &other.place) == (&found.path, &found.place));
    let found: Vec<&Port> = ports.iter().filter(|found| is_alike(found, port) && !was_there(found)).collect();
    let at_its_place = found.iter().find(|found| found.place.is_some() && found.place == port.place);
    let of_its_name = || found.iter().find(|found| found.path == port.path);
    // Some makers give all their adapters one number.
    let is_unique = others.is_empty() && port.usb.as_ref().is_some_and(|usb| usb.serial_number.is_some());
    let by_number = || found.first().filter(|_| is_unique && found.len() == 1);
    at_its_place.or_else(of_its_name).or_else(by_number).map(|found| PathBuf::from(&found.path))
}

fn is_alike(one: &Port, other: &Port) -> bool {
    let identity = |port: &Port| port.usb.as_ref().map(|usb| (usb.vid, usb.pid, usb.serial_number.clone()));
    identity(one).is_some() && identity(one) == identity(other)
}

/// The first process that has the port open, apart from the host of a pseudo-terminal itself. `None` also where the
/// system does not say: other users' processes are not visible.
pub fn holder(path: &Path) -> Option<Holder> {
    processes::holders(&[path], |_| true).pop().flatten()
}

/// The same for several ports at the price of one, in their order.
pub fn holders(ports: &[Port]) -> Vec<Option<Holder>> {
    let paths: Vec<&Path> = ports.iter().map(|port| Path::new(&port.path)).collect();
    processes::holders(&paths, |_| true)
}

/// The same without this process, and without one that it is just starting: until that runs its own program, it has this
/// one's files.
pub fn other_holder(path: &Path) -> Option<Holder> {
    processes::holders(&[path], |pid| !processes::is_ours(pid)).pop().flatten()
}

/// Another process that runs this program and hosts the pseudo-terminal of this path.
pub fn other_host(path: &Path) -> Option<Holder> {
    processes::other_host(path)
}

/// The process that says it has the port by a lock file (`/run/lock/LCK..ttyUSB0`), as terminal programs have done since
/// UUCP. `None` for one whose process is gone, or this one.
#[cfg(unix)]
pub fn lock_holder(path: &Path) -> Option<Holder> {
    LOCK_FOLDERS.iter().find_map(|folder| locks::holder(Path::new(folder), path))
}

/// Where systems keep lock files of ports.
#[cfg(unix)]
const LOCK_FOLDERS: [&str; 3] = ["/run/lock", "/var/lock", "/var/spool/uucp"];

fn port(info: serialport::SerialPortInfo) -> Port {
    let (kind, usb) = match info.port_type {
        SerialPortType::UsbPort(usb) => (
            Kind::Usb,
            Some(Usb {
                vid: usb.vid,
                pid: usb.pid,
                serial_number: usb.serial_number,
                manufacturer: usb.manufacturer,
                product: usb.product,
            }),
        ),
        SerialPortType::BluetoothPort => (Kind::Bluetooth, None),
        SerialPortType::PciPort | SerialPortType::Unknown => (Kind::Native, None),
    };
    let place = usb.as_ref().and_then(|_| place(&info.port_name));
    Port { driver: driver(&info.port_name), path: info.port_name, kind, usb, place }
}

fn driver(path: &str) -> Option<String> {
    let mut device = std::fs::canonicalize(sysfs(path)?.join("device")).ok()?;
    // Since Linux 6.5 a UART has two more devices between itself and its hardware, whose driver is called "port".
    while target_name(&device.join("subsystem"))? == "serial-base" {
        device.pop();
    }
    target_name(&device.join("driver"))
}

/// The USB interface the port hangs on: the nearest device above it that is one.
fn place(path: &str) -> Option<String> {
    let device = std::fs::canonicalize(sysfs(path)?.join("device")).ok()?;
    let is_interface = |device: &&Path| target_name(&device.join("subsystem")).is_some_and(|name| name == "usb");
    let interface = device.ancestors().find(is_interface)?;
    Some(interface.file_name()?.to_string_lossy().into_owned())
}

fn target_name(link: &Path) -> Option<String> {
    Some(std::fs::read_link(link).ok()?.file_name()?.to_string_lossy().into_owned())
}

/// Whether the kernel made a node for a UART that is not there: the 8250 driver always makes a few.
fn is_phantom(path: &str) -> bool {
    let kind = sysfs(path).and_then(|port| std::fs::read_to_string(port.join("type")).ok());
    kind.is_some_and(|kind| kind.trim() == "0")
}

fn sysfs(path: &str) -> Option<PathBuf> {
    cfg!(target_os = "linux").then(|| Path::new("/sys/class/tty").join(path.strip_prefix("/dev/").unwrap_or(path)))
}

/// Orders `ttyUSB10` behind `ttyUSB9`.
fn natural_key(path: &str) -> (String, u64) {
    let digits = path.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (name, number) = path.split_at(path.len() - digits);
    (name.to_owned(), number.parse().unwrap_or(0))
}

#[cfg(target_os = "linux")]
mod processes {
    //! Open files of processes, as `/proc` shows them.
    //!
    //! There are hundreds of processes with thousands of files, and most time of a command that lists ports goes into
    //! them: so they are looked through once for all ports, folder by folder without full paths, and nothing is
    //! allocated for a file.

    use std::fs;
    use std::mem::MaybeUninit;
    use std::os::fd::{AsFd, OwnedFd};
    use std::os::unix::ffi::OsStringExt;
    use std::path::Path;

    use rustix::fs::{CWD, Mode, OFlags, RawDir, openat, readlinkat_raw};
    use rustix::path::Arg;

    use super::Holder;

    /// The first process of our name, but not this one, that has the master of the pseudo-terminal. The name tells an
    /// emulator from a terminal window that has got the number of one which is gone.
    pub fn other_host(path: &Path) -> Option<Holder> {
        let target = fs::canonicalize(path).ok()?.into_os_string().into_vec();
        let own = name(std::process::id())?;
        let hosts = |pid: u32| {
            let files = fs::read_dir(format!("/proc/{pid}/fd")).ok()?;
            let mut files = files.flatten().map(|file| file.file_name());
            files.find_map(|fd| hosted(pid, &fd.to_string_lossy()).filter(|pts| *pts == target))
        };
        let pid = pids()?.into_iter().find(|&pid| {
            !is_ours(pid)
                && name(pid).as_deref() == Some(own.as_str())
                && hosts(pid).is_some()
                && was_told_to_link(pid, path)
        })?;
        Some(Holder { name: own, pid })
    }

    /// Whether a process was started with `--link` and this path, or what this path is numbered from. A link that a
    /// killed emulator has left may lead to the pseudo-terminal of another, which has got its number and has nothing to
    /// do with it.
    fn was_told_to_link(pid: u32, path: &Path) -> bool {
        let Ok(line) = fs::read(format!("/proc/{pid}/cmdline")) else { return false };
        let Ok(folder) = fs::read_link(format!("/proc/{pid}/cwd")) else { return false };
        let Ok(path) = std::path::absolute(path) else { return false };
        let words: Vec<String> =
            line.split(|&byte| byte == 0).map(|word| String::from_utf8_lossy(word).into()).collect();
        let behind = words.windows(2).filter(|pair| pair[0] == "--link").map(|pair| pair[1].as_str());
        let joined = words.iter().filter_map(|word| word.strip_prefix("--link="));
        behind.chain(joined).any(|named| {
            let named = folder.join(named);
            path.to_string_lossy().starts_with(&*named.to_string_lossy())
        })
    }

    fn pids() -> Option<Vec<u32>> {
        let entries = fs::read_dir("/proc").ok()?;
        let mut pids: Vec<u32> = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok()).collect();
        pids.sort_unstable();
        Some(pids)
    }

    /// What the system calls a process.
    pub fn name(pid: u32) -> Option<String> {
        Some(fs::read_to_string(format!("/proc/{pid}/comm")).ok()?.trim_end().to_owned())
    }

    /// Whether it is this process, or a child of it that has not begun its own program yet.
    pub fn is_ours(pid: u32) -> bool {
        let own = std::process::id();
        let program = |pid: u32| fs::read_link(format!("/proc/{pid}/exe")).ok();
        let parent = || {
            let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
            status.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse::<u32>().ok()
        };
        pid == own || (parent() == Some(own) && program(pid) == program(own))
    }

    /// The longest name the system gives for an open file.
    const LONGEST_PATH: usize = 4096;

    /// A port, by what the link of an open file leads to.
    struct Wanted {
        /// `None` where there is no such file.
        target: Option<Vec<u8>>,
        holder: Option<Holder>,
        /// Descriptors of the process that is being looked at.
        uses: usize,
        /// That process hosts this pseudo-terminal.
        hosts: bool,
    }

    /// For each port the first process, of those that count, that uses it.
    pub fn holders(paths: &[&Path], counts: impl Fn(u32) -> bool) -> Vec<Option<Holder>> {
        let wanted = |path: &&Path| {
            let target = fs::canonicalize(path).ok().map(|target| target.into_os_string().into_vec());
            Wanted { target, holder: None, uses: 0, hosts: false }
        };
        let mut wanted: Vec<Wanted> = paths.iter().map(wanted).collect();
        if let Ok(processes) = folder(CWD, "/proc") {
            let mut pids = Vec::new();
            each_entry(&processes, |name| pids.extend(name.to_str().ok().and_then(|name| name.parse::<u32>().ok())));
            pids.sort_unstable();
            for pid in pids {
                if wanted.iter().all(|port| port.target.is_none() || port.holder.is_some()) {
                    break;
                }
                look_at(&processes, pid, &counts, &mut wanted);
            }
        }
        wanted.into_iter().map(|port| port.holder).collect()
    }

    /// Whether the process uses one of the ports. The host of a pseudo-terminal keeps one descriptor of the client's side
    /// open; that one does not count.
    fn look_at(processes: &OwnedFd, pid: u32, counts: &impl Fn(u32) -> bool, wanted: &mut [Wanted]) {
        let Ok(files) = folder(processes, format!("{pid}/fd")) else { return };
        for port in &mut *wanted {
            (port.uses, port.hosts) = (0, false);
        }
        let mut link = [MaybeUninit::uninit(); LONGEST_PATH];
        each_entry(&files, |file| {
            let Ok((open, _)) = readlinkat_raw(&files, file, &mut link) else { return };
            let hosted = if open.ends_with(b"/ptmx") { hosted(pid, &file.to_string_lossy()) } else { None };
            for port in wanted.iter_mut() {
                port.uses += usize::from(port.target.as_deref() == Some(&*open));
                port.hosts |= hosted.is_some() && port.target == hosted;
            }
        });
        for port in wanted.iter_mut().filter(|port| port.holder.is_none() && port.uses > usize::from(port.hosts)) {
            port.holder = counts(pid).then(|| Holder { name: name(pid).unwrap_or_default(), pid });
        }
    }

    fn folder(at: impl AsFd, path: impl Arg) -> rustix::io::Result<OwnedFd> {
        openat(at, path, OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())
    }

    fn each_entry(folder: &OwnedFd, mut act: impl FnMut(&std::ffi::CStr)) {
        let mut buffer = [MaybeUninit::uninit(); 8192];
        let mut entries = RawDir::new(folder, &mut buffer);
        while let Some(Ok(entry)) = entries.next() {
            let is_itself_or_parent = entry.file_name().to_bytes().starts_with(b".");
            if !is_itself_or_parent {
                act(entry.file_name());
            }
        }
    }

    /// The client's side of the pseudo-terminal whose master this descriptor is.
    fn hosted(pid: u32, fd: &str) -> Option<Vec<u8>> {
        let info = fs::read_to_string(format!("/proc/{pid}/fdinfo/{fd}")).ok()?;
        let index = info.lines().find_map(|line| line.strip_prefix("tty-index:"))?;
        Some(format!("/dev/pts/{}", index.trim()).into_bytes())
    }
}

#[cfg(not(target_os = "linux"))]
mod processes {
    //! Not known how to ask here.

    use std::path::Path;

    use super::Holder;

    pub fn holders(paths: &[&Path], _counts: impl Fn(u32) -> bool) -> Vec<Option<Holder>> {
        vec![None; paths.len()]
    }

    pub fn other_host(_path: &Path) -> Option<Holder> {
        None
    }

    #[cfg(unix)]
    pub fn name(_pid: u32) -> Option<String> {
        None
    }

    pub fn is_ours(pid: u32) -> bool {
        pid == std::process::id()
    }
}

#[cfg(unix)]
mod locks {
    //! Lock files, as the Filesystem Hierarchy Standard has them: the process number, ten characters wide.

    use std::fs::File;
    use std::io::Read;
    use std::path::Path;

    use super::{Holder, processes};

    /// Bytes of a lock file that are looked at: number, program and user fit.
    const MOST: u64 = 64;

    pub fn holder(folder: &Path, port: &Path) -> Option<Holder> {
        // Below `/dev/pts` names are bare numbers, which lock files do not tell from others.
        let port = std::fs::canonicalize(port).ok().filter(|port| !port.starts_with("/dev/pts"))?;
        let name = port.file_name()?.to_str()?;
        let mut text = Vec::new();
        File::open(folder.join(format!("LCK..{name}"))).ok()?.take(MOST).read_to_end(&mut text).ok()?;
        let pid = process(&text).filter(|&pid| pid != std::process::id() && is_alive(pid))?;
        Some(Holder { name: processes::name(pid).unwrap_or_else(|| "a program with a lock file".into()), pid })
    }

    /// The process that a lock file names: in digits, or as old programs write it, as a number of four bytes.
    pub(super) fn process(text: &[u8]) -> Option<u32> {
        let digits = std::str::from_utf8(text).ok().and_then(|text| text.split_whitespace().next()?.parse().ok());
        digits.or_else(|| text.try_into().ok().map(u32::from_ne_bytes)).filter(|&pid| pid > 0)
    }

    fn is_alive(pid: u32) -> bool {
        let pid = i32::try_from(pid).ok().and_then(rustix::process::Pid::from_raw);
        // A process of somebody else may not be signalled, but is there.
        pid.is_some_and(|pid| rustix::process::test_kill_process(pid) != Err(rustix::io::Errno::SRCH))
    }
}

/// Calls `changed` from a thread of its own whenever device files have come or gone, a moment after the last of them:
/// an adapter brings several. Where the system does not tell, nothing is ever called.
#[cfg(target_os = "linux")]
pub fn watch(changed: impl Fn() + Send + 'static) -> std::io::Result<()> {
    use rustix::fs::inotify::{self, CreateFlags, Reader, WatchFlags};
    use std::mem::MaybeUninit;

    let watch = inotify::init(CreateFlags::CLOEXEC)?;
    inotify::add_watch(&watch, "/dev", WatchFlags::CREATE | WatchFlags::DELETE | WatchFlags::ATTRIB)?;
    std::thread::Builder::new().name("ports".into()).spawn(move || {
        let mut buffer = [MaybeUninit::uninit(); 4096];
        let mut events = Reader::new(&watch, &mut buffer);
        while let Ok(event) = events.next() {
            // Other devices come and go all day long.
            let mut is_serial = event.file_name().is_some_and(|name| name.to_bytes().starts_with(b"tty"));
            // An adapter brings several, each with several events: one call for all that were read together.
            while !events.is_buffer_empty() {
                let Ok(event) = events.next() else { return };
                is_serial |= event.file_name().is_some_and(|name| name.to_bytes().starts_with(b"tty"));
            }
            if is_serial {
                // The rights are set, and the adapter's other ports come, a moment later: they wait in the queue
                // meanwhile and are read together.
                std::thread::sleep(SETTLED);
                changed();
            }
        }
    })?;
    Ok(())
}

/// The same on a system that does not tell.
#[cfg(not(target_os = "linux"))]
pub fn watch(_changed: impl Fn() + Send + 'static) -> std::io::Result<()> {
    Ok(())
}

/// How long after a device file has come its rights are settled.
#[cfg(target_os = "linux")]
const SETTLED: std::time::Duration = std::time::Duration::from_millis(300);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_ordered_as_a_person_counts() {
        let mut names = ["/dev/ttyUSB10", "/dev/ttyS0", "/dev/ttyUSB9", "COM3", "COM12"];
        names.sort_by_key(|name| natural_key(name));
        assert_eq!(names, ["/dev/ttyS0", "/dev/ttyUSB9", "/dev/ttyUSB10", "COM3", "COM12"]);
    }

    fn adapter(path: &str, number: Option<&str>, place: &str) -> Port {
        let serial_number = number.map(str::to_owned);
        let usb = Usb { vid: 0x1a86, pid: 0x7523, serial_number, manufacturer: None, product: None };
        let place = (!place.is_empty()).then(|| place.to_owned());
        Port { path: path.into(), kind: Kind::Usb, usb: Some(usb), driver: None, place }
    }

    #[test]
    fn an_adapter_with_a_number_of_its_own_is_found_under_any_name_at_any_place() {
        let was = adapter("/dev/ttyUSB0", Some("A1"), "1-1:1.0");
        let found = |ports: &[Port]| again(ports, &was, &[]);
        let other = adapter("/dev/ttyUSB0", Some("B2"), "1-1:1.0");
        assert_eq!(found(std::slice::from_ref(&other)), None, "another adapter at its place");
        assert_eq!(found(&[other, adapter("/dev/ttyUSB2", Some("A1"), "1-2:1.0")]), Some("/dev/ttyUSB2".into()));
        // The ports of one adapter share its number.
        let ports = [adapter("/dev/ttyUSB3", Some("A1"), "1-1:1.1"), adapter("/dev/ttyUSB2", Some("A1"), "1-1:1.0")];
        assert_eq!(found(&ports), Some("/dev/ttyUSB2".into()));
        let moved = [adapter("/dev/ttyUSB3", Some("A1"), "1-2:1.0"), adapter("/dev/ttyUSB4", Some("A1"), "1-2:1.1")];
        assert_eq!(found(&moved), None, "which of the two it is nobody can say");
    }

    #[test]
    fn another_adapter_of_the_same_kind_is_never_taken_for_the_one_that_was_lost() {
        for number in [None, Some("0001")] {
            let was = adapter("/dev/ttyUSB0", number, "1-1:1.0");
            let neighbour = adapter("/dev/ttyUSB1", number, "1-2:1.0");
            let others = [neighbour.clone()];
            let found = |ports: &[Port]| again(ports, &was, &others);
            assert_eq!(found(&others), None, "{number:?}: the neighbour was there all the time");
            let somewhere = adapter("/dev/ttyUSB2", number, "1-3:1.0");
            assert_eq!(found(&[neighbour.clone(), somewhere]), None, "{number:?}: a third one");
            let renamed = adapter("/dev/ttyUSB2", number, "1-1:1.0");
            assert_eq!(found(&[neighbour.clone(), renamed]), Some("/dev/ttyUSB2".into()), "at its place");
            let moved = adapter("/dev/ttyUSB0", number, "1-3:1.0");
            assert_eq!(found(&[neighbour, moved]), Some("/dev/ttyUSB0".into()), "under its name");
            // The neighbour was pulled out as well, and ours has got its name.
            let swapped = adapter("/dev/ttyUSB1", number, "1-1:1.0");
            assert_eq!(found(&[swapped]), Some("/dev/ttyUSB1".into()));
        }
        let was = adapter("/dev/ttyUSB0", None, "1-1:1.0");
        let alone = adapter("/dev/ttyUSB1", None, "1-2:1.0");
        assert_eq!(again(&[alone], &was, &[]), None, "one that nothing tells from others is not enough");
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_file_counts_as_long_as_its_process_lives() {
        assert_eq!(locks::process(b"      1234\n"), Some(1234));
        assert_eq!(locks::process(b"      1234 minicom root\n"), Some(1234));
        assert_eq!(locks::process(&0x0001_02FF_u32.to_ne_bytes()), Some(0x0001_02FF));
        for nonsense in [&b""[..], b"\xff\xff", b"0", b"minicom", b"\0\0\0\0"] {
            assert_eq!(locks::process(nonsense), None, "{}", nonsense.escape_ascii());
        }
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("ttyUSB0");
        std::fs::write(&port, b"").expect("written");
        let lock = |text: String| {
            std::fs::write(folder.path().join("LCK..ttyUSB0"), text).expect("written");
            locks::holder(folder.path(), &port).map(|holder| holder.pid)
        };
        let parent = std::os::unix::process::parent_id();
        assert_eq!(lock(format!("{parent:>10}\n")), Some(parent));
        assert_eq!(lock(format!("{:>10}\n", std::process::id())), None, "our own");
        assert_eq!(lock(format!("{:>10}\n", i32::MAX)), None, "left behind by a process that was killed");
    }

    #[test]
    fn listing_never_fails_where_there_is_nothing() {
        for port in list().expect("a list, if an empty one") {
            assert!(!port.path.is_empty());
        }
        assert_eq!(holder(Path::new("/nowhere/ttyUSB0")), None);
    }
}
