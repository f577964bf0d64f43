//! `axcon ports`: the serial ports, what they hang on, and who holds them.

use serde::Serialize;

use super::Global;
use super::error::{CliError, Kind};
use super::output::Output;
use crate::host::ports::{self, Holder, Port};
use crate::wire::visible;

/// Arguments of `axcon ports`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// All ports, one object.
#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    ports: Vec<PortObject<'a>>,
}

#[derive(Serialize)]
struct PortObject<'a> {
    path: &'a str,
    kind: &'static str,
    vid: Option<String>,
    pid: Option<String>,
    serial_number: Option<&'a str>,
    manufacturer: Option<&'a str>,
    product: Option<&'a str>,
    driver: Option<&'a str>,
    busy_by: Option<HolderObject>,
}

#[derive(Serialize)]
struct HolderObject {
    name: String,
    pid: u32,
}

/// Lists the ports.
///
/// # Errors
/// If the system does not list them, or standard output cannot be written.
pub fn run(_args: Args, _global: &Global, output: &mut Output) -> Result<(), CliError> {
    let ports = ports::list().map_err(|error| {
        CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot list the serial ports"))
    })?;
    let holders = ports::holders(&ports);
    let ports: Vec<(Port, Option<Holder>)> = ports.into_iter().zip(holders).collect();
    if output.json {
        let ports = ports.iter().map(|(port, holder)| object(port, holder.as_ref())).collect();
        return output.object(&Object { schema: "axcon.ports/1", ports });
    }
    if ports.is_empty() {
        output.remark(NOTHING);
        return Ok(());
    }
    output.data(table(&ports).as_bytes())
}

const NOTHING: &str = "no serial ports found
  plug the adapter in and look again; 'dmesg' says what the system made of it
  a unit needs an RS-232 adapter (USB to DB-9) and the manual's cable
  to try axcon without one: --port emu:axtc4co";

fn object<'a>(port: &'a Port, holder: Option<&Holder>) -> PortObject<'a> {
    let usb = port.usb.as_ref();
    PortObject {
        path: &port.path,
        kind: port.kind.name(),
        vid: usb.map(|usb| format!("{:04x}", usb.vid)),
        pid: usb.map(|usb| format!("{:04x}", usb.pid)),
        serial_number: usb.and_then(|usb| usb.serial_number.as_deref()),
        manufacturer: usb.and_then(|usb| usb.manufacturer.as_deref()),
        product: usb.and_then(|usb| usb.product.as_deref()),
        driver: port.driver.as_deref(),
        busy_by: holder.map(|holder| HolderObject { name: holder.name.clone(), pid: holder.pid }),
    }
}

fn table(ports: &[(Port, Option<Holder>)]) -> String {
    let mut rows = vec![["PORT", "KIND", "USB", "SERIAL NUMBER", "DRIVER", "DEVICE", "IN USE BY"].map(str::to_owned)];
    for (port, holder) in ports {
        let usb = port.usb.as_ref();
        // What a USB device says about itself is not ours: nothing of it may act on the terminal.
        let said = |text: Option<&String>| text.map_or_else(|| "-".to_owned(), |text| visible::line(text.as_bytes()));
        rows.push([
            port.path.clone(),
            port.kind.name().to_owned(),
            usb.map_or_else(|| "-".to_owned(), |usb| format!("{:04x}:{:04x}", usb.vid, usb.pid)),
            said(usb.and_then(|usb| usb.serial_number.as_ref())),
            said(port.driver.as_ref()),
            said(usb.and_then(|usb| usb.product.as_ref())),
            holder.as_ref().map_or_else(|| "-".to_owned(), |holder| visible::line(holder.to_string().as_bytes())),
        ]);
    }
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let line: String = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}  ")).collect();
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::ports::{Kind, Usb};

    fn found() -> Vec<(Port, Option<Holder>)> {
        let usb = Usb {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: Some("AX12345".into()),
            manufacturer: Some("FTDI".into()),
            product: Some("USB\x1b[2J serial".into()),
        };
        vec![
            (
                Port {
                    path: "/dev/ttyUSB0".into(),
                    kind: Kind::Usb,
                    usb: Some(usb),
                    driver: Some("ftdi_sio".into()),
                    place: None,
                },
                Some(Holder { name: "picocom".into(), pid: 4711 }),
            ),
            (Port { path: "/dev/ttyS0".into(), kind: Kind::Native, usb: None, driver: None, place: None }, None),
        ]
    }

    #[test]
    fn the_table_lines_up_and_obeys_no_device() {
        assert_eq!(
            table(&found()),
            "PORT          KIND    USB        SERIAL NUMBER  DRIVER    DEVICE           IN USE BY\n\
             /dev/ttyUSB0  usb     0403:6001  AX12345        ftdi_sio  USB^[[2J serial  picocom (process 4711)\n\
             /dev/ttyS0    native  -          -              -         -                -\n"
        );
    }

    #[test]
    fn the_object_has_the_documented_members() {
        let ports = found();
        let object = serde_json::to_value(object(&ports[0].0, ports[0].1.as_ref())).expect("an object");
        for (member, value) in [
            ("path", "/dev/ttyUSB0"),
            ("kind", "usb"),
            ("vid", "0403"),
            ("pid", "6001"),
            ("serial_number", "AX12345"),
            ("driver", "ftdi_sio"),
        ] {
            assert_eq!(object[member], value, "{member}");
        }
        assert_eq!(object["busy_by"], serde_json::json!({"name": "picocom", "pid": 4711}));
    }
}
