//! From `--port` to an open link: which port, and what to do when it does not open.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender};

use super::error::{CliError, Kind};
use super::output::Output;
use super::{Global, files, waiting};
use crate::host::Input;
use crate::host::clock::Clock;
use crate::host::link::{Cause, Connection, LinkError, LinkSpec, LinkSpecError, Options};
use crate::host::network::NetworkError;
use crate::host::ports::{self, Port};
use crate::host::pump::PumpError;
use crate::host::recorder::{self, Plan, Recorder};
use crate::host::replay::{Recording, RecordingError};
use crate::telnet::Refusal;

/// The link that the user named, or the only USB serial port there is.
///
/// # Errors
/// If the name makes no sense, or none was given and there is not exactly one candidate.
pub fn spec(global: &Global) -> Result<LinkSpec, CliError> {
    match global.port() {
        Some(text) => named(text, || ports::list().unwrap_or_default()),
        None => only_port(ports::list().map_err(|error| CliError::new(Kind::PortNone, error))?),
    }
}

/// The link with this name: a path or an address, the serial number of an adapter among the `found` ports, or the name
/// the system gives a port by what it is.
///
/// # Errors
/// If the name makes no sense, or several ports have that serial number.
pub fn named(text: &str, found: impl FnOnce() -> Vec<Port>) -> Result<LinkSpec, CliError> {
    let spec: LinkSpec = text.parse().map_err(spec_error)?;
    match &spec {
        // What is not a file may be an adapter's serial number: it stays the same, whatever the port is called today.
        LinkSpec::Serial(path) if !path.exists() => {
            let named = by_serial_number(&found(), text)?;
            Ok(named.or_else(|| by_id(text)).unwrap_or(spec))
        }
        LinkSpec::Serial(_) | LinkSpec::Emulated(_) | LinkSpec::Replay(_) | LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_) => {
            Ok(spec)
        }
    }
}

/// Two of these names that mean the same device: one may be a symbolic link to it, or its adapter's serial number. Not
/// found here, the second would be refused because this very program has the port.
pub fn same_device(names: &[String]) -> Option<(&str, &str)> {
    let [_, _, ..] = names else { return None };
    let device = |name: &String| match named(name, || ports::list().unwrap_or_default()) {
        Ok(LinkSpec::Serial(path)) => std::fs::canonicalize(path).ok(),
        // What makes no sense is said when it is opened.
        Ok(_) | Err(_) => None,
    };
    let devices: Vec<_> = names.iter().map(device).collect();
    devices.iter().enumerate().find_map(|(at, device)| {
        let before = devices[..at].iter().position(|before| before.is_some() && before == device)?;
        Some((names[before].as_str(), names[at].as_str()))
    })
}

/// What a name that is not a link means to the user.
pub fn spec_error(error: LinkSpecError) -> CliError {
    CliError::new(Kind::Usage, anyhow::Error::new(error).context("--port"))
}

/// Opens a link as the command line says. Signals come on `inputs` meanwhile: a server that does not answer may take
/// seconds.
///
/// # Errors
/// If it does not open, with what to do about it, or the user interrupts.
pub fn open(
    spec: &LinkSpec,
    global: &Global,
    clock: Clock,
    sender: SyncSender<Input>,
    inputs: &Receiver<Input>,
) -> Result<Connection, CliError> {
    let options = options(global);
    if !spec.is_network() {
        return Connection::open(spec, options, clock, sender).map_err(link_error);
    }
    let server = spec.clone();
    let dialled = waiting::begin(sender.clone(), move || Connection::dial(&server, options, clock))?;
    let dialled = waiting::end(inputs, &dialled)?.map_err(link_error)?;
    Connection::over(spec, dialled, options, clock, sender).map_err(link_error)
}

/// Opens a recording. Signals come on `inputs` meanwhile: a pipe is waited for, and what comes first through it.
///
/// # Errors
/// If it cannot be read, or the user interrupts.
pub fn open_recording(path: &Path, sender: SyncSender<Input>, inputs: &Receiver<Input>) -> Result<Recording, CliError> {
    let path = path.to_owned();
    let opened = waiting::begin(sender, move || Recording::open(&path))?;
    waiting::end(inputs, &opened)?.map_err(recording_error)
}

/// What the journal of uploads calls the port of a link: the adapter's serial number if it has one, since the port may
/// have another name next time, else the path as the user gives it; of a network link its address. `None` for units
/// that end with this process.
pub fn journal_key(spec: &LinkSpec) -> Option<String> {
    match spec {
        LinkSpec::Emulated(_) | LinkSpec::Replay(_) => None,
        LinkSpec::Tcp(_) | LinkSpec::Rfc2217(_) => Some(spec.to_string()),
        LinkSpec::Serial(path) => {
            let resolved = std::fs::canonicalize(path).unwrap_or_else(|_| path.clone());
            let own_name = || std::path::absolute(path).unwrap_or_else(|_| path.clone()).display().to_string();
            Some(adapter_key(&ports::list().unwrap_or_default(), &resolved).unwrap_or_else(own_name))
        }
    }
}

/// The name of an adapter's port that lasts: `usb:A1`. An adapter may have several ports, and some makers give all their
/// adapters one number; each leads to another unit, so the place it is plugged in tells them apart.
fn adapter_key(found: &[Port], path: &Path) -> Option<String> {
    let number = |port: &Port| port.usb.as_ref().and_then(|usb| usb.serial_number.clone());
    let port = found.iter().find(|port| Path::new(&port.path) == path)?;
    let of_its_number = number(port)?;
    match found.iter().filter(|other| number(other).as_ref() == Some(&of_its_number)).count() {
        1 => Some(format!("usb:{of_its_number}")),
        _ => Some(format!("usb:{of_its_number} at {}", port.place.as_ref()?)),
    }
}

/// Where a session is recorded, as the command line says: to be asked before a link opens.
///
/// # Errors
/// If a file is there that should stay.
pub fn recording(global: &Global) -> Result<Plan, CliError> {
    match &global.record {
        _ if global.no_record => Ok(Plan::Nothing),
        Some(file) => files::admit(file, global.yes).map(|()| Plan::File(file.clone())),
        None => Ok(Plan::Unasked),
    }
}

/// Refuses to record what is a recording already.
///
/// # Errors
/// If the user named a file for it.
pub fn not_recorded_again(global: &Global) -> Result<(), CliError> {
    match &global.record {
        None => Ok(()),
        Some(_) => Err(CliError::message(Kind::Usage, "a recording is not recorded again, so --record does not apply")),
    }
}

/// Starts recording. Without the recording that the user has asked for there is no session; if another one cannot be
/// written, that is only a warning.
///
/// # Errors
/// If the file that the user named cannot be written.
pub fn start_recording(
    plan: &Plan,
    connection: &Connection,
    clock: Clock,
    output: &mut Output,
) -> Result<Recorder, CliError> {
    let mut recorder = Recorder::start(plan, connection, clock);
    match (plan, recorder.take_warning()) {
        (_, None) => Ok(recorder),
        (Plan::File(_), Some(warning)) => Err(CliError::message(Kind::Failed, warning)
            .hint("Look whether the folder exists, may be written to, and has room.")
            .hint("Nothing has been sent.")),
        (Plan::Unasked | Plan::Nothing, Some(warning)) => {
            output.remark(&format!("axcon: {warning}"));
            Ok(recorder)
        }
    }
}

/// What a failed link means to the user, and what helps.
pub fn link_error(error: LinkError) -> CliError {
    let kind = match &error.cause {
        Cause::Missing | Cause::NotSerial { .. } => Kind::PortMissing,
        Cause::Denied { .. } => Kind::PortDenied,
        Cause::Busy { .. } => Kind::PortBusy,
        Cause::Gone | Cause::Stuck { .. } | Cause::Io(_) => Kind::PortGone,
        Cause::Network(error) => network_kind(error),
        // Not the command line: another port does the same rate, and nobody may have asked for it.
        Cause::Baud { .. } => Kind::PortRate,
    };
    let mut hints = Vec::new();
    let is_network = error.port.parse().is_ok_and(|spec: LinkSpec| spec.is_network());
    match &error.cause {
        Cause::Gone if is_network => {
            hints.push(
                "the other side closed the connection: is ser2net still running, and its serial port there?".to_owned(),
            );
            hints.push("most servers let one client in at a time: is another one connected?".to_owned());
        }
        Cause::Stuck { .. } if is_network => {
            hints.push("the server does not read: restart it, or its serial port".to_owned())
        }
        Cause::Network(network) => hints.extend(network_hints(network, &error.port)),
        Cause::Missing => {
            hints.push("'axcon ports' lists what there is; is the adapter plugged in?".to_owned());
        }
        Cause::Denied { group: Some(group) } => {
            hints.push(format!("join the group that has access, then log in again: sudo usermod -aG {group} $USER"));
        }
        Cause::Denied { group: None } => {
            hints.push("only its owner has access: 'ls -l' names the owner; ask them, or set a udev rule".to_owned())
        }
        Cause::Busy { holder: Some(holder) } => hints.push(format!("close {holder} first")),
        Cause::Busy { holder: None } => {
            hints.push("close the other program; 'sudo fuser PORT' names it".to_owned());
        }
        Cause::NotSerial { .. } => hints.push("'axcon ports' lists the serial ports".to_owned()),
        Cause::Gone => {
            hints.push("plug the adapter in again; its name may be another one then: 'axcon ports'".to_owned())
        }
        Cause::Stuck { .. } => hints.push("unplug the adapter and plug it in again".to_owned()),
        Cause::Baud { .. } => hints.push("the units have 115200: leave out --baud, or use another adapter".to_owned()),
        Cause::Io(_) => {}
    }
    let mut refused = CliError::new(kind, error);
    refused.hints = hints;
    refused
}

fn network_kind(error: &NetworkError) -> Kind {
    match error {
        NetworkError::UnknownHost { .. }
        | NetworkError::Refused
        | NetworkError::NoAnswer { .. }
        | NetworkError::Unreachable(_) => Kind::PortMissing,
        NetworkError::Closed { .. } | NetworkError::Port(_) | NetworkError::Unset { .. } | NetworkError::Lost(_) => {
            Kind::PortGone
        }
    }
}

/// What helps with a network link.
fn network_hints(error: &NetworkError, port: &str) -> Vec<String> {
    let (_, address) = port.split_once("://").unwrap_or(("", port));
    match error {
        NetworkError::UnknownHost { .. } => vec!["is the name right? an address will do as well".to_owned()],
        NetworkError::Refused => vec![
            "is ser2net (or another server) running there, and is the port number right?".to_owned(),
            "a server that listens on 127.0.0.1 only lets nobody in from outside".to_owned(),
        ],
        NetworkError::NoAnswer { .. } | NetworkError::Unreachable(_) => {
            vec!["is the host on, in this network, and the port open in its firewall?".to_owned()]
        }
        NetworkError::Closed { .. } => {
            vec!["most servers let one client in at a time: is another one connected?".to_owned()]
        }
        NetworkError::Port(Refusal::NoComPort | Refusal::NoBinary | Refusal::Nonsense) | NetworkError::Unset { .. } => {
            vec![
                format!("if it is a raw socket whose server sets the line rate: --port tcp://{address}"),
                "ser2net speaks RFC 2217 with 'telnet(rfc2217),tcp,PORT' as its accepter".to_owned(),
            ]
        }
        NetworkError::Port(Refusal::Baud { .. } | Refusal::Setting { .. }) => {
            vec!["does the server fix its port's settings, or has it another client?".to_owned()]
        }
        NetworkError::Lost(_) => vec!["is the host still on, and the network up?".to_owned()],
    }
}

/// What the end of a headless session means to the user, where the command knows nothing better.
pub fn pump_error(error: PumpError) -> CliError {
    match error {
        PumpError::Link(error) => link_error(error),
        PumpError::Send { .. } => CliError::new(Kind::PortGone, error),
        PumpError::Deadline => CliError::new(Kind::NoAnswer, error),
        PumpError::Interrupted => CliError::new(Kind::Interrupted, error),
        PumpError::Over => CliError::new(Kind::NoAnswer, error),
        PumpError::Recording(error) => recording_error(error),
    }
}

/// What a recording that cannot be read means to the user.
pub fn recording_error(error: RecordingError) -> CliError {
    let kind = match &error {
        RecordingError::File { error, .. } => match error.kind() {
            ErrorKind::NotFound => Kind::PortMissing,
            ErrorKind::PermissionDenied => Kind::PortDenied,
            _ => Kind::PortGone,
        },
        RecordingError::Content { .. } => Kind::Usage,
    };
    let is_missing = kind == Kind::PortMissing;
    let error = CliError::new(kind, error);
    match recorder::folder() {
        Some(folder) if is_missing => error.hint(format!("recordings are in {}", folder.display())),
        Some(_) | None => error,
    }
}

/// What is said of a recording that was read to its end, if it did not end as recordings do.
pub const CUT_SHORT: &str =
    "axcon: the recording ends in the middle of a line: the program that wrote it was killed, or its disk was full";

/// Whether the command line names a recording.
pub fn is_recording(global: &Global) -> bool {
    global.port().is_some_and(|text| matches!(text.parse(), Ok(LinkSpec::Replay(_))))
}

/// The error of a command that would have to send something to a recording.
pub fn read_only(deed: &str) -> CliError {
    CliError::message(Kind::Usage, format!("a recording cannot be told to {deed}: nothing reaches the unit"))
        .hint("name the unit's port with --port")
}

/// How serial ports are opened, as the command line says.
pub fn options(global: &Global) -> Options {
    Options { baud: global.baud }
}

/// The port with this name among those the system names by what they are.
fn by_id(text: &str) -> Option<LinkSpec> {
    const BY_ID: &str = "/dev/serial/by-id";
    let path = Path::new(BY_ID).join(text);
    (!text.contains('/') && path.exists()).then_some(LinkSpec::Serial(path))
}

/// The port of the USB adapter with this serial number; `usb:` may precede it.
fn by_serial_number(found: &[Port], text: &str) -> Result<Option<LinkSpec>, CliError> {
    let wanted = text.strip_prefix("usb:").unwrap_or(text);
    let number = |port: &Port| port.usb.as_ref().and_then(|usb| usb.serial_number.clone());
    let ports: Vec<&Port> = found.iter().filter(|port| number(port).as_deref() == Some(wanted)).collect();
    match ports.as_slice() {
        [] => Ok(None),
        [only] => Ok(Some(LinkSpec::Serial(only.path.clone().into()))),
        several => {
            let names = several.iter().map(|port| port.path.clone()).collect::<Vec<_>>().join(", ");
            let message = format!("several ports have the serial number {wanted}: {names}");
            Err(CliError::message(Kind::PortAmbiguous, message).hint("name one of them with --port"))
        }
    }
}

fn only_port(found: Vec<Port>) -> Result<LinkSpec, CliError> {
    let names = |ports: &[&Port]| ports.iter().map(|port| port.path.clone()).collect::<Vec<_>>().join(", ");
    let usb: Vec<&Port> = found.iter().filter(|port| port.kind == ports::Kind::Usb).collect();
    match usb.as_slice() {
        [only] => Ok(LinkSpec::Serial(only.path.clone().into())),
        [] => {
            let others: Vec<&Port> = found.iter().collect();
            let error = CliError::message(Kind::PortNone, "there is no USB serial port");
            let error = if others.is_empty() {
                error.hint("plug the adapter in; 'axcon ports' lists the ports")
            } else {
                error.hint(format!("there are others: {}; name one with --port", names(&others)))
            };
            Err(error.hint("an emulated unit needs no port: --port emu:axtc4co"))
        }
        several => {
            let message = format!("there are {} USB serial ports: {}", several.len(), names(several));
            Err(CliError::message(Kind::PortAmbiguous, message).hint("name one with --port, or set AXCON_PORT"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::ports::Holder;

    fn port(path: &str, kind: ports::Kind) -> Port {
        Port { path: path.into(), kind, usb: None, driver: None, place: None }
    }

    #[test]
    fn only_a_single_usb_port_is_taken_unasked() {
        use ports::Kind::{Native, Usb};
        assert_eq!(
            only_port(vec![port("/dev/ttyUSB0", Usb), port("/dev/ttyS0", Native)]).expect("the only one"),
            LinkSpec::Serial("/dev/ttyUSB0".into())
        );
        let error = only_port(vec![port("/dev/ttyUSB0", Usb), port("/dev/ttyUSB1", Usb)]).expect_err("two");
        assert_eq!(error.kind, Kind::PortAmbiguous);
        assert_eq!(error.to_string(), "there are 2 USB serial ports: /dev/ttyUSB0, /dev/ttyUSB1");
        let error = only_port(vec![port("/dev/ttyS0", Native)]).expect_err("none on USB");
        assert_eq!(error.kind, Kind::PortNone);
        assert_eq!(error.hints[0], "there are others: /dev/ttyS0; name one with --port");
        assert_eq!(only_port(Vec::new()).expect_err("none").kind, Kind::PortNone);
    }

    fn adapter(path: &str, number: &str) -> Port {
        let serial_number = Some(number.to_owned());
        let usb = ports::Usb { vid: 0x0403, pid: 0x6001, serial_number, manufacturer: None, product: None };
        Port { usb: Some(usb), ..port(path, ports::Kind::Usb) }
    }

    #[test]
    fn ports_that_share_a_serial_number_share_no_note_in_the_journal() {
        let placed = |path: &str, number: &str, place: &str| Port {
            place: (!place.is_empty()).then(|| place.to_owned()),
            ..adapter(path, number)
        };
        let found = [
            placed("/dev/ttyUSB0", "A1", "1-1:1.0"),
            placed("/dev/ttyUSB1", "0001", "1-2:1.0"),
            placed("/dev/ttyUSB2", "0001", "1-3:1.0"),
            placed("/dev/ttyUSB3", "FT4232", "1-4:1.0"),
            placed("/dev/ttyUSB4", "FT4232", "1-4:1.1"),
            placed("/dev/ttyUSB5", "0001", ""),
            port("/dev/ttyS0", ports::Kind::Native),
        ];
        let keys: Vec<Option<String>> = found.iter().map(|port| adapter_key(&found, Path::new(&port.path))).collect();
        let keys: Vec<Option<&str>> = keys.iter().map(Option::as_deref).collect();
        assert_eq!(
            keys,
            [
                Some("usb:A1"),
                Some("usb:0001 at 1-2:1.0"),
                Some("usb:0001 at 1-3:1.0"),
                Some("usb:FT4232 at 1-4:1.0"),
                Some("usb:FT4232 at 1-4:1.1"),
                None,
                None,
            ]
        );
        assert_eq!(adapter_key(&found, Path::new("/dev/ttyUSB9")), None);
    }

    #[test]
    fn an_adapter_is_found_by_its_serial_number() {
        let found = [adapter("/dev/ttyUSB0", "A1"), adapter("/dev/ttyUSB1", "B2"), adapter("/dev/ttyUSB2", "B2")];
        for text in ["A1", "usb:A1"] {
            let spec = by_serial_number(&found, text).expect("one of them");
            assert_eq!(spec, Some(LinkSpec::Serial("/dev/ttyUSB0".into())), "{text}");
        }
        assert_eq!(by_serial_number(&found, "/dev/ttyUSB9").expect("none"), None);
        let error = by_serial_number(&found, "B2").expect_err("two of them");
        assert_eq!(
            (error.kind, error.to_string().as_str()),
            (Kind::PortAmbiguous, "several ports have the serial number B2: /dev/ttyUSB1, /dev/ttyUSB2")
        );
    }

    #[test]
    fn every_cause_has_its_kind_and_says_what_helps() {
        use crate::host::link::Operation::Open;
        let shown = |cause| {
            let error = link_error(LinkError { port: "/dev/ttyUSB0".into(), operation: Open, cause });
            (error.kind, error.hints.join("; "))
        };
        let holder = Holder { name: "picocom".into(), pid: 7 };
        for (cause, kind, hint) in [
            (Cause::Missing, Kind::PortMissing, "plugged in"),
            (Cause::Denied { group: Some("dialout".into()) }, Kind::PortDenied, "-aG dialout"),
            (Cause::Busy { holder: Some(holder) }, Kind::PortBusy, "close picocom (process 7)"),
            (Cause::Busy { holder: None }, Kind::PortBusy, "fuser"),
            (Cause::NotSerial { what: "a directory" }, Kind::PortMissing, "axcon ports"),
            (Cause::Gone, Kind::PortGone, "plug the adapter in again"),
            (Cause::Baud { asked: 3_000_000, set: 9_600 }, Kind::PortRate, "115200"),
        ] {
            let (found, hints) = shown(cause);
            assert_eq!(found, kind);
            assert!(hints.contains(hint), "{hints}");
        }
    }
}
