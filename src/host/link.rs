//! A link to a unit: what the user wrote, and the open connection.
//!
//! A connection is a thread that reads and one that writes. The session owns flow control, so XON and XOFF pass both
//! ways as bytes, and nothing here asks the system whether bytes are "out": a pseudo-terminal and most USB adapters do
//! not know. What the unit has taken, only its answers tell.

use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, TrySendError};

use super::address::{Address, AddressError};
use super::clock::Clock;
use super::lines::Lines;
use super::network::NetworkError;
use super::ports::{self, Holder};
use super::socket::{self, Dialled, Protocol};
use super::unit::{Answer, HostedUnit, Hosting, Power, factory_setup};
use super::{Input, LinkId};
use crate::device::Product;
use crate::emulator::Unit;
use crate::emulator::scenario::{Stage, Verb};
use crate::record::Adapter;
use crate::time::Duration;

#[cfg(windows)]
use super::duplex as serial;
#[cfg(unix)]
use super::serial;

/// Where a unit is, as `--port` says it.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkSpec {
    /// A serial port: a path, or `COM3`.
    Serial(PathBuf),
    /// An emulated unit in this process.
    Emulated(&'static Product),
    /// A recording: what was said, read only.
    Replay(PathBuf),
    /// A raw socket, which leads to a serial port elsewhere.
    Tcp(Address),
    /// A remote serial port (RFC 2217).
    Rfc2217(Address),
}

/// Why a link makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkSpecError {
    /// Nothing was named.
    #[error("the link names nothing")]
    Empty,
    /// No such product can be emulated.
    #[error("there is no emulated '{name}'; there is {}", known.join(", "))]
    UnknownProduct {
        /// What was asked for.
        name: String,
        /// What there is, as links.
        known: Vec<String>,
    },
    /// Something before `://` that is not a kind of link.
    #[error(
        "there are no links of the kind '{kind}'; there are {TCP}HOST:PORT, {RFC2217}HOST:PORT, {EMULATED}PRODUCT and {REPLAY}FILE"
    )]
    UnknownKind {
        /// What stood there.
        kind: String,
    },
    /// A network link without a proper address.
    #[error("{error}: such a link is {scheme}HOST:PORT")]
    Address {
        /// Which kind of link, as it is written.
        scheme: &'static str,
        /// What is wrong.
        error: AddressError,
    },
}

impl std::str::FromStr for LinkSpec {
    type Err = LinkSpecError;

    fn from_str(text: &str) -> Result<Self, LinkSpecError> {
        for (scheme, make) in [(TCP, LinkSpec::Tcp as fn(Address) -> LinkSpec), (RFC2217, LinkSpec::Rfc2217)] {
            if starts_with(text, scheme) {
                let address = text[scheme.len()..].parse();
                return address.map(make).map_err(|error| LinkSpecError::Address { scheme, error });
            }
        }
        if starts_with(text, REPLAY) && text.len() > REPLAY.len() {
            return Ok(LinkSpec::Replay(PathBuf::from(&text[REPLAY.len()..])));
        }
        if text.is_empty() || starts_with(text, REPLAY) {
            return Err(LinkSpecError::Empty);
        }
        if let Some((kind, _)) = text.split_once("://")
            && !kind.is_empty()
            && kind.bytes().all(|byte| byte.is_ascii_alphanumeric())
        {
            return Err(LinkSpecError::UnknownKind { kind: kind.to_owned() });
        }
        if !starts_with(text, EMULATED) {
            return Ok(LinkSpec::Serial(PathBuf::from(text)));
        }
        let name = &text[EMULATED.len()..];
        let unknown = || LinkSpecError::UnknownProduct {
            name: name.to_owned(),
            known: Product::all().iter().map(|product| format!("{EMULATED}{}", product.name.to_lowercase())).collect(),
        };
        Product::named(name).map(LinkSpec::Emulated).ok_or_else(unknown)
    }
}

impl LinkSpec {
    /// Whether opening it may take seconds, because somebody else has to answer.
    pub fn is_network(&self) -> bool {
        matches!(self, LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_))
    }
}

impl fmt::Display for LinkSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkSpec::Serial(path) => path.display().fmt(f),
            LinkSpec::Emulated(product) => write!(f, "{EMULATED}{}", product.name.to_lowercase()),
            LinkSpec::Replay(path) => write!(f, "{REPLAY}{}", path.display()),
            LinkSpec::Tcp(address) => write!(f, "{TCP}{address}"),
            LinkSpec::Rfc2217(address) => write!(f, "{RFC2217}{address}"),
        }
    }
}

/// What went wrong, with which port, while doing what.
#[derive(Debug, thiserror::Error)]
#[error("cannot {operation} {port}: {cause}")]
pub struct LinkError {
    /// The port as the user named it.
    pub port: String,
    /// What was being done.
    pub operation: Operation,
    /// What came of it.
    pub cause: Cause,
}

/// What was being done with a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Opening it.
    Open,
    /// Setting it up.
    Configure,
    /// Reading.
    Read,
    /// Writing.
    Write,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Operation::Open => "open",
            Operation::Configure => "set up",
            Operation::Read => "read from",
            Operation::Write => "write to",
        })
    }
}

/// Why an operation on a port failed.
#[derive(Debug, thiserror::Error)]
pub enum Cause {
    /// There is no such port.
    #[error("there is no such port")]
    Missing,
    /// The system denies access.
    #[error("permission denied{}", group.as_ref().map(|group| format!(" (it belongs to group '{group}')")).unwrap_or_default())]
    Denied {
        /// The group that has access, where the system tells.
        group: Option<String>,
    },
    /// Another program has it.
    #[error("in use by {}", holder.as_ref().map_or_else(|| "another program".to_owned(), Holder::to_string))]
    Busy {
        /// Who, where the system tells.
        holder: Option<Holder>,
    },
    /// It is something else.
    #[error("{what}, not a serial port")]
    NotSerial {
        /// What it is.
        what: &'static str,
    },
    /// It has gone away: unplugged, or the other side of a pseudo-terminal closed.
    #[error("the port has gone")]
    Gone,
    /// The hardware does another line rate than it was asked for.
    #[error("it runs at {set} baud when asked for {asked}")]
    Baud {
        /// What was asked.
        asked: u32,
        /// What the driver set.
        set: u32,
    },
    /// It takes no more bytes.
    #[error("it has taken no byte for {} s", after.as_secs())]
    Stuck {
        /// For how long.
        after: Duration,
    },
    /// What only a network link can run into.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Anything else the system says.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// How to open a serial port. It is always 8 data bits, no parity, one stop bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Line rate.
    pub baud: u32,
}

/// An open link. Dropping it closes the port, within [`CLOSE_PATIENCE`] and a moment more, whatever the other side does.
#[derive(Debug)]
pub struct Connection {
    id: LinkId,
    // Closed in this order: first our side, then the unit that hangs on the other.
    lines: Lines,
    unit: Option<(HostedUnit, &'static Product)>,
    outgoing: Option<SyncSender<Vec<u8>>>,
    port: String,
    settings: String,
    driver: Option<String>,
    adapter: Option<Adapter>,
}

/// Bytes could not be queued.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// [`QUEUED`] pieces already wait: nobody takes them.
    #[error("too much waits to be sent")]
    Full,
    /// The port is gone; the channel says why.
    #[error("the port has gone")]
    Gone,
}

/// Pieces that wait for the writer at most. A session sends a record and waits for the answer; hundreds of pieces mean
/// that nothing leaves any more.
pub const QUEUED: usize = 256;

/// How long the port may take no byte before it counts as gone. Nothing here obeys XOFF, so only a dead driver or the
/// full pipe of a pseudo-terminal that nobody reads takes this long.
pub const WRITE_PATIENCE: Duration = Duration::from_secs(5);

/// How long closing waits for queued bytes to leave: enough for the key that leaves a sub-menu, at any line rate.
pub const CLOSE_PATIENCE: Duration = Duration::from_millis(300);

const EMULATED: &str = "emu:";
const REPLAY: &str = "replay:";
const TCP: &str = "tcp://";
const RFC2217: &str = "rfc2217://";

impl Connection {
    /// Opens a link and starts reading. What comes is put on `inputs`, stamped by `clock`; while that is full, nothing
    /// is read.
    ///
    /// # Errors
    /// If the port cannot be opened or set up, or the emulated unit cannot be hosted.
    pub fn open(spec: &LinkSpec, options: Options, clock: Clock, inputs: SyncSender<Input>) -> Result<Self, LinkError> {
        match spec {
            LinkSpec::Serial(path) => {
                let id = LinkId::next();
                let (lines, outgoing) = serial::open(path, options, clock, id, inputs)?;
                let port = ports::describe(path);
                let mut connection = Connection::new(id, (spec, options), lines, outgoing, port.driver);
                connection.adapter = port.usb.map(Adapter::from);
                Ok(connection)
            }
            LinkSpec::Emulated(product) => Connection::emulated(spec, product, options, clock, inputs),
            LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_) => {
                let dialled = Connection::dial(spec, options, clock)?;
                Connection::over(spec, dialled, options, clock, inputs)
            }
            // There is no line: a command that can do with a recording opens it as one.
            LinkSpec::Replay(_) => Err(LinkError {
                port: spec.to_string(),
                operation: Operation::Open,
                cause: Cause::NotSerial { what: "a recording" },
            }),
        }
    }

    /// The part of opening a network link that may take seconds. Nothing comes before [`over`](Connection::over).
    ///
    /// # Errors
    /// If nobody answers there, the port cannot be set up, or it is another kind of link.
    pub fn dial(spec: &LinkSpec, options: Options, clock: Clock) -> Result<Dialled, LinkError> {
        match spec {
            LinkSpec::Tcp(address) => socket::dial(spec.to_string(), (Protocol::Raw, address), options, clock),
            LinkSpec::Rfc2217(address) => socket::dial(spec.to_string(), (Protocol::ComPort, address), options, clock),
            LinkSpec::Serial(_) | LinkSpec::Emulated(_) | LinkSpec::Replay(_) => Err(LinkError {
                port: spec.to_string(),
                operation: Operation::Open,
                cause: Cause::Io(io::ErrorKind::Unsupported.into()),
            }),
        }
    }

    /// The rest of opening a network link: starts reading, as [`open`](Connection::open) does. Never waits.
    ///
    /// # Errors
    /// If the system has no more threads.
    pub fn over(
        spec: &LinkSpec,
        dialled: Dialled,
        options: Options,
        clock: Clock,
        inputs: SyncSender<Input>,
    ) -> Result<Self, LinkError> {
        let driver = if matches!(spec, LinkSpec::Tcp(_)) { "tcp" } else { "rfc2217" };
        let id = LinkId::next();
        let (lines, outgoing) = socket::start(dialled, clock, id, inputs)?;
        let mut connection = Connection::new(id, (spec, options), lines, outgoing, Some(driver.into()));
        if matches!(spec, LinkSpec::Tcp(_)) {
            connection.settings = "line rate set by the server".into();
        }
        Ok(connection)
    }

    /// A unit that hangs on a pseudo-terminal of its own, which is opened like any other port; on one within this
    /// process where the system has none.
    fn emulated(
        spec: &LinkSpec,
        product: &'static Product,
        options: Options,
        clock: Clock,
        inputs: SyncSender<Input>,
    ) -> Result<Self, LinkError> {
        let hosting = Hosting { power: Power::AtFirstClient, ..Hosting::default() };
        let unit = Stage::bare(Unit::new(factory_setup(product, 0)));
        let id = LinkId::next();
        #[cfg(unix)]
        let (unit, lines, outgoing) = {
            let failed = |error| LinkError {
                port: spec.to_string(),
                operation: Operation::Open,
                cause: Cause::Io(io::Error::other(anyhow::Error::new(error))),
            };
            let unit = HostedUnit::start(unit, hosting).map_err(failed)?;
            let (lines, outgoing) = serial::open(unit.serial(), options, clock, id, inputs)?;
            (unit, lines, outgoing)
        };
        #[cfg(not(unix))]
        let (unit, lines, outgoing) =
            super::unit::memory::open(unit, hosting, &spec.to_string(), (options, clock), id, inputs)?;
        let mut connection = Connection::new(id, (spec, options), lines, outgoing, Some("emulator".into()));
        connection.unit = Some((unit, product));
        Ok(connection)
    }

    fn new(
        id: LinkId,
        (spec, options): (&LinkSpec, Options),
        lines: impl Into<Lines>,
        outgoing: SyncSender<Vec<u8>>,
        driver: Option<String>,
    ) -> Self {
        Connection {
            id,
            lines: lines.into(),
            unit: None,
            outgoing: Some(outgoing),
            port: spec.to_string(),
            settings: format!("{} 8N1", options.baud),
            driver,
            adapter: None,
        }
    }

    /// Queues bytes for the line. Never waits.
    ///
    /// # Errors
    /// If the port is gone or takes nothing.
    pub fn send(&self, bytes: impl Into<Vec<u8>>) -> Result<(), SendError> {
        let outgoing = self.outgoing.as_ref().ok_or(SendError::Gone)?;
        outgoing.try_send(bytes.into()).map_err(|error| match error {
            TrySendError::Full(_) => SendError::Full,
            TrySendError::Disconnected(_) => SendError::Gone,
        })
    }

    /// Sends a break: the line held low for a quarter of a second and more. Does not wait for its end.
    ///
    /// # Errors
    /// If the link cannot do that.
    pub fn send_break(&self) -> io::Result<()> {
        self.lines.send_break()
    }

    /// What its inputs are marked with.
    pub fn id(&self) -> LinkId {
        self.id
    }

    /// The port as the user named it.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Line settings, e.g. `115200 8N1`.
    pub fn settings(&self) -> &str {
        &self.settings
    }

    /// Driver of the port, where known.
    pub fn driver(&self) -> Option<&str> {
        self.driver.as_deref()
    }

    /// The USB adapter, where it is one.
    pub fn adapter(&self) -> Option<&Adapter> {
        self.adapter.as_ref()
    }

    /// The emulated unit at the other end, if it lives in this process.
    pub fn unit(&self) -> Option<&HostedUnit> {
        self.unit.as_ref().map(|(unit, _)| unit)
    }

    /// Has something done to the emulated unit in this process, in the words of `axcon emulate`; `answered` hears what
    /// came of it, perhaps from another thread. If the unit takes no more orders, it is dropped unheard.
    pub fn order(&self, line: &str, answered: impl FnOnce(Answer) + Send + 'static) {
        let Some((unit, product)) = &self.unit else {
            return answered(Err("there is no emulated unit at the other end".into()));
        };
        match Verb::read(line, product) {
            Err(error) => answered(Err(error.to_string())),
            // An order that is not taken is dropped with `answered`, and with the channel in it: who waits there sees that.
            Ok(verb) => {
                unit.order(verb, answered);
            }
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // The writer ends when the queue is empty and closed.
        self.outgoing = None;
        self.lines.close(CLOSE_PATIENCE);
    }
}

fn starts_with(text: &str, scheme: &str) -> bool {
    text.get(..scheme.len()).is_some_and(|start| start.eq_ignore_ascii_case(scheme))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_read_as_documented() {
        let read = |text: &str| text.parse::<LinkSpec>();
        let unknown = read("telnet://host:23").expect_err("no such kind");
        assert!(unknown.to_string().contains("'telnet'") && unknown.to_string().contains("rfc2217://"), "{unknown}");
        assert_eq!(read("/dev/ttyUSB0"), Ok(LinkSpec::Serial("/dev/ttyUSB0".into())));
        assert_eq!(read("COM3"), Ok(LinkSpec::Serial("COM3".into())));
        assert_eq!(read("EMU:AxTc4Co").map(|link| link.to_string()), Ok("emu:axtc4co".to_owned()));
        assert_eq!(read(""), Err(LinkSpecError::Empty));
        let error = read("emu:toaster").expect_err("no such product").to_string();
        assert!(error.starts_with("there is no emulated 'toaster'; there is emu:axtc4co"), "{error}");
        assert_eq!(read("Replay:a.cast"), Ok(LinkSpec::Replay("a.cast".into())));
        assert_eq!(read("replay:"), Err(LinkSpecError::Empty));
        for (text, shown) in [("TCP://bench:2000", "tcp://bench:2000"), ("rfc2217://[::1]:1", "rfc2217://[::1]:1")] {
            assert_eq!(read(text).map(|link| link.to_string()), Ok(shown.to_owned()));
        }
        let error = read("tcp://bench").expect_err("no port").to_string();
        assert_eq!(error, "'bench' has no port number after it: such a link is tcp://HOST:PORT");
    }

    #[test]
    fn errors_say_port_operation_and_cause() {
        let error = |operation, cause| LinkError { port: "/dev/ttyUSB0".into(), operation, cause }.to_string();
        for (said, expected) in [
            (error(Operation::Open, Cause::Missing), "cannot open /dev/ttyUSB0: there is no such port"),
            (
                error(Operation::Open, Cause::Denied { group: Some("dialout".into()) }),
                "cannot open /dev/ttyUSB0: permission denied (it belongs to group 'dialout')",
            ),
            (
                error(Operation::Open, Cause::Busy { holder: Some(Holder { name: "picocom".into(), pid: 7 }) }),
                "cannot open /dev/ttyUSB0: in use by picocom (process 7)",
            ),
            (
                error(Operation::Open, Cause::NotSerial { what: "a directory" }),
                "cannot open /dev/ttyUSB0: a directory, not a serial port",
            ),
            (error(Operation::Read, Cause::Gone), "cannot read from /dev/ttyUSB0: the port has gone"),
            (
                error(Operation::Configure, Cause::Baud { asked: 250_000, set: 9_600 }),
                "cannot set up /dev/ttyUSB0: it runs at 9600 baud when asked for 250000",
            ),
        ] {
            assert_eq!(said, expected);
        }
    }
}
