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
    listed.unwrap_or_else(|| Port { path: path.display().to_string(), kind, usb: None, driver: None })
}

/// Where an adapter is now that was at `path` before the cable was pulled: a USB adapter keeps its identity and not its
/// name. Everything else is known by its path. `None` while it is not there.
pub fn find_again(path: &Path, adapter: Option<&Adapter>) -> Option<PathBuf> {
    let Some(adapter) = adapter else { return path.exists().then(|| path.to_owned()) };
    again(&list().unwrap_or_default(), path, adapter)
}

fn again(ports: &[Port], path: &Path, adapter: &Adapter) -> Option<PathBuf> {
    let same: Vec<&Port> = ports
        .iter()
        .filter(|port| {
            port.usb.clone().map(Adapter::from).is_some_and(|other| {
                (&other.vid, &other.pid, &other.serial_number) == (&adapter.vid, &adapter.pid, &adapter.serial_number)
            })
        })
        .collect();
    // Without a serial number, adapters of one kind are told apart by their place only.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let at_its_place = same.iter().find(|port| Path::new(&port.path) == target);
    match (at_its_place, same.as_slice()) {
        (Some(port), _) => Some(port.path.clone().into()),
        (None, [only]) => Some(only.path.clone().into()),
        (None, _) => None,
    }
}

/// The first process that has the port open, apart from the host of a pseudo-terminal itself. `None` also where the
/// system does not say: other users' processes are not visible.
pub fn holder(path: &Path) -> Option<Holder> {
    processes::holders(&[path]).pop().flatten()
}

/// The same for several ports at the price of one, in their order.
pub fn holders(ports: &[Port]) -> Vec<Option<Holder>> {
    let paths: Vec<&Path> = ports.iter().map(|port| Path::new(&port.path)).collect();
    processes::holders(&paths)
}

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
    Port { driver: driver(&info.port_name), path: info.port_name, kind, usb }
}

fn driver(path: &str) -> Option<String> {
    let mut device = std::fs::canonicalize(sysfs(path)?.join("device")).ok()?;
    // Since Linux 6.5 a UART has two more devices between itself and its hardware, whose driver is called "port".
    while target_name(&device.join("subsystem"))? == "serial-base" {
        device.pop();
    }
    target_name(&device.join("driver"))
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

    pub fn holders(paths: &[&Path]) -> Vec<Option<Holder>> {
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
                look_at(&processes, pid, &mut wanted);
            }
        }
        wanted.into_iter().map(|port| port.holder).collect()
    }

    /// Whether the process uses one of the ports. The host of a pseudo-terminal keeps one descriptor of the client's side
    /// open; that one does not count.
    fn look_at(processes: &OwnedFd, pid: u32, wanted: &mut [Wanted]) {
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
            let name = fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
            port.holder = Some(Holder { name: name.trim_end().to_owned(), pid });
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

    pub fn holders(paths: &[&Path]) -> Vec<Option<Holder>> {
        vec![None; paths.len()]
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
            let is_serial = event.file_name().is_some_and(|name| name.to_bytes().starts_with(b"tty"));
            if !is_serial {
                continue;
            }
            // The rights are set, and the adapter's other ports come, a moment later.
            std::thread::sleep(SETTLED);
            changed();
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

    #[test]
    fn an_adapter_is_found_again_under_another_name_and_never_mistaken() {
        let port = |path: &str, number: Option<&str>| {
            let usb = Usb {
                vid: 0x0403,
                pid: 0x6001,
                serial_number: number.map(str::to_owned),
                manufacturer: None,
                product: None,
            };
            Port { path: path.into(), kind: Kind::Usb, usb: Some(usb), driver: None }
        };
        let adapter = |number: Option<&str>| Adapter::from(port("", number).usb.expect("an adapter"));
        let was = Path::new("/dev/ttyUSB0");
        let found = |ports: &[Port], number| again(ports, was, &adapter(number));
        let numbered = [port("/dev/ttyUSB1", Some("B2")), port("/dev/ttyUSB2", Some("A1"))];
        assert_eq!(found(&numbered, Some("A1")), Some("/dev/ttyUSB2".into()));
        assert_eq!(found(&numbered, Some("C3")), None);
        let plain = [port("/dev/ttyUSB1", None), port("/dev/ttyUSB2", None)];
        assert_eq!(found(&plain, None), None, "which of the two it is nobody can say");
        assert_eq!(found(&plain[..1], None), Some("/dev/ttyUSB1".into()));
        let at_its_place = [port("/dev/ttyUSB1", None), port("/dev/ttyUSB0", None)];
        assert_eq!(found(&at_its_place, None), Some("/dev/ttyUSB0".into()));
    }

    #[test]
    fn listing_never_fails_where_there_is_nothing() {
        for port in list().expect("a list, if an empty one") {
            assert!(!port.path.is_empty());
        }
        assert_eq!(holder(Path::new("/nowhere/ttyUSB0")), None);
    }
}
