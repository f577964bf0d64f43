//! Which serial ports there are, what they hang on, and who holds them.

#[cfg(unix)]
mod locks;
#[cfg_attr(not(target_os = "linux"), path = "no_processes.rs")]
mod processes;

use std::path::{Path, PathBuf};

use serialport::{SerialPortInfo, SerialPortType};

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
    Ok(of_system(serialport::available_ports()?))
}

/// What the system lists, in our order and without what is not there.
fn of_system(found: Vec<SerialPortInfo>) -> Vec<Port> {
    let mut ports: Vec<Port> = found.into_iter().filter(|info| !is_phantom(&info.port_name)).map(port).collect();
    ports.sort_by_key(|port| (port.kind != Kind::Usb, natural_key(&port.path)));
    ports
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

fn port(info: SerialPortInfo) -> Port {
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

/// Orders `ttyUSB10` after `ttyUSB9`.
fn natural_key(path: &str) -> (String, u64) {
    let digits = path.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (name, number) = path.split_at(path.len() - digits);
    (name.to_owned(), number.parse().unwrap_or(0))
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

    #[test]
    fn what_the_system_says_of_a_port_is_kept_and_adapters_come_first() {
        let info = |path: &str, port_type| SerialPortInfo { port_name: path.into(), port_type };
        let said = serialport::UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: Some("A1".into()),
            manufacturer: Some("FTDI".into()),
            product: None,
        };
        // Names no machine has, so that it says nothing else of them.
        let ports = of_system(vec![
            info("/dev/ttyNone9", SerialPortType::Unknown),
            info("/dev/ttyNoneUSB10", SerialPortType::UsbPort(said.clone())),
            info("/dev/rfcommNone0", SerialPortType::BluetoothPort),
            info("/dev/ttyNoneUSB9", SerialPortType::UsbPort(said)),
        ]);
        let kinds: Vec<(&str, Kind)> = ports.iter().map(|port| (port.path.as_str(), port.kind)).collect();
        let expected = [
            ("/dev/ttyNoneUSB9", Kind::Usb),
            ("/dev/ttyNoneUSB10", Kind::Usb),
            ("/dev/rfcommNone0", Kind::Bluetooth),
            ("/dev/ttyNone9", Kind::Native),
        ];
        assert_eq!(kinds, expected);
        let Usb { vid, pid, serial_number, manufacturer, product } = ports[0].usb.clone().expect("an adapter");
        assert_eq!((vid, pid, product), (0x0403, 0x6001, None));
        assert_eq!((serial_number.as_deref(), manufacturer.as_deref()), (Some("A1"), Some("FTDI")));
        assert_eq!(ports[3].usb, None);
    }

    #[test]
    fn listing_never_fails_where_there_is_nothing() {
        assert!(list().expect("a list, if an empty one").iter().all(|port| !port.path.is_empty()));
        assert_eq!(holder(Path::new("/nowhere/ttyUSB0")), None);
    }
}
