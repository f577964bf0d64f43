//! Units behind a network: raw sockets and remote serial ports (RFC 2217), with servers of our own and one by pyserial.
//!
//! All servers listen on free ports of this machine. Nothing waits for time to pass except where silence is the story.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};

use serde_json::Value;

use axcon::host::Input;
use axcon::host::link::{CLOSE_PATIENCE, Cause, Connection};

use crate::support::connection::{connected, receive};
use crate::support::foreign::python;
use crate::support::screen::Screen;
use crate::support::server::Server;
use crate::support::shell::{PATIENCE, Running, World};

const RAW: &str = "tcp";
const RFC2217: &str = "rfc2217";

/// A server's answers to a client that wants 115,200 baud without flow control: agreed, and set.
const AGREED: &[u8] = b"\xff\xfb\x00\xff\xfd\x00\xff\xfd\x2c";
const SET: &[u8] = b"\xff\xfa\x2c\x69\x01\xff\xf0\xff\xfa\x2c\x65\x00\x01\xc2\x00\xff\xf0";
/// The end of the client's requests, and of its settings.
const ASKED: &[u8] = b"\xff\xfb\x2c";
const SETTINGS: &[u8] = b"\x2c\x01\x00\x01\xc2\x00\xff\xf0";

fn unit(world: &World) -> Running {
    let unit = world.start(&["emulate", "axtc4co", "--link", "u0", "--line-rate", "off"]);
    unit.wait_out("serial: ");
    unit
}

fn facts(world: &World, link: &str) -> Value {
    let ran = world.run(&["identify", "--json", "--yes", "--record", "said.cast", "--port", link], b"");
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    let mut facts: Value = serde_json::from_str(&ran.out).expect("one object");
    assert_eq!((&facts["product"], &facts["version"]), (&"AXTC4CO".into(), &"1.1.0".into()), "{facts}");
    // The first one to ask also hears the unit start.
    facts.as_object_mut().expect("an object").remove("unrecognised_lines");
    facts
}

/// The header of the recording that [`facts`] has made.
fn header(world: &World) -> String {
    let recording = std::fs::read_to_string(world.path("said.cast")).expect("a recording");
    recording.lines().next().expect("a header").to_owned()
}

fn open(link: &str) -> (Connection, Receiver<Input>) {
    connected(&link.parse().expect("a link"), 115_200)
}

/// Reads until what was read ends so.
fn read_to(client: &mut TcpStream, end: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    while !bytes.ends_with(end) {
        let mut byte = [0];
        client.read_exact(&mut byte).expect("another byte");
        bytes.push(byte[0]);
    }
    bytes
}

/// Agrees to everything as a server would.
fn agree(client: &mut TcpStream) {
    read_to(client, ASKED);
    client.write_all(AGREED).expect("said");
    read_to(client, SETTINGS);
    client.write_all(SET).expect("said");
}

/// What the program says about a link it cannot use: exit code, kind, message.
fn refused(link: &str) -> (Option<i32>, String, String) {
    let ran = World::new().run(&["identify", "--json", "--no-record", "--port", link], b"");
    let error: Value = serde_json::from_str(&ran.err).unwrap_or_else(|_| panic!("no object: {}{}", ran.out, ran.err));
    assert!(error["hints"].as_array().is_some_and(|hints| !hints.is_empty()), "no hint: {error}");
    let text = |member: &str| error[member].as_str().expect("a text").to_owned();
    (ran.code, text("kind"), text("message"))
}

#[test]
fn a_unit_behind_a_raw_socket_is_the_same_unit() {
    let world = World::new();
    let _unit = unit(&world);
    let direct = facts(&world, "u0");
    let server = Server::of_port(&world.path("u0"));
    assert_eq!(facts(&world, &server.link(RAW)), direct);
    let header = header(&world);
    for said in [&server.link(RAW), "\"driver\":\"tcp\"", "line rate set by the server"] {
        assert!(header.contains(said), "no {said} in {header}");
    }
    let ran = world.run(&["stream", "--period", "100", "--count", "3", "--port", &server.link(RAW)], b"");
    assert_eq!((ran.code, ran.out.lines().count()), (Some(0), 4), "{}{}", ran.out, ran.err);
}

#[test]
fn a_port_where_nobody_listens_is_missing() {
    let port = TcpListener::bind("127.0.0.1:0").expect("a free port").local_addr().expect("an address").port();
    for scheme in [RAW, RFC2217] {
        let link = format!("{scheme}://127.0.0.1:{port}");
        let message = format!("cannot open {link}: nothing listens there (connection refused)");
        assert_eq!(refused(&link), (Some(3), "port-missing".into(), message));
    }
}

#[test]
fn a_host_that_nobody_knows_is_missing() {
    let (code, kind, message) = refused("tcp://nowhere.invalid:2000");
    assert_eq!((code, kind.as_str()), (Some(3), "port-missing"), "{message}");
    assert!(message.starts_with("cannot open tcp://nowhere.invalid:2000: the host 'nowhere.invalid' is not found"));
}

#[test]
fn an_address_that_is_none_is_a_usage_error_that_says_what_is_wrong() {
    let world = World::new();
    for (link, complaint) in [
        ("tcp://bench", "'bench' has no port number after it: such a link is tcp://HOST:PORT"),
        ("rfc2217://bench:ttyS0", "'ttyS0' is not a port number (1 to 65535): such a link is rfc2217://HOST:PORT"),
        ("tcp://::1:2000", "has to be in brackets"),
        ("tcp://", "no host is named"),
    ] {
        let ran = world.run(&["identify", "--port", link], b"");
        assert_eq!(ran.code, Some(2), "{link}: {}", ran.err);
        assert!(ran.err.starts_with("axcon: --port: ") && ran.err.contains(complaint), "{}", ran.err);
    }
}

#[test]
fn a_server_that_closes_in_the_middle_is_a_port_that_has_gone() {
    let server = Server::start(|mut client| {
        // The first key, then no more.
        let _ = client.read(&mut [0]);
    });
    let link = server.link(RAW);
    let (code, kind, message) = refused(&link);
    assert_eq!((code, kind.as_str()), (Some(3), "port-gone"), "{message}");
    assert_eq!(message, format!("cannot read from {link}: the port has gone"));
}

#[test]
fn servers_without_a_serial_port_to_set_up_say_which_way_they_lack_it() {
    for (says, code, kind, complaint) in [
        (&b"\xff\xfe\x2c"[..], 3, "port-gone", "the server speaks telnet, but refuses RFC 2217 (COM-PORT-OPTION)"),
        (b"\xff\xfe\x00", 3, "port-gone", "the server refuses to pass all bytes unchanged (telnet BINARY)"),
        (
            b"\xff\xfd\x2c\xff\xfa\x2c\x65\x00\x00\x25\x80\xff\xf0",
            3,
            "port-rate",
            "it runs at 9600 baud when asked for 115200",
        ),
        (
            b"\xff\xfd\x2c\xff\xfa\x2c\x69\x02\xff\xf0",
            3,
            "port-gone",
            "asked for no flow control, the server answers 2",
        ),
    ] {
        let server = Server::start(move |mut client| {
            read_to(&mut client, ASKED);
            client.write_all(says).expect("said");
            let _ = client.read_to_end(&mut Vec::new());
        });
        let link = server.link(RFC2217);
        let expected = (Some(code), kind.to_owned(), format!("cannot set up {link}: {complaint}"));
        assert_eq!(refused(&link), expected);
    }
}

#[test]
fn a_server_that_has_its_client_already_is_quoted() {
    let server = Server::start(|mut client| {
        read_to(&mut client, ASKED);
        client.write_all(b"Port already in use\r\n").expect("said");
    });
    let (code, kind, message) = refused(&server.link(RFC2217));
    assert_eq!((code, kind.as_str()), (Some(3), "port-gone"));
    assert!(message.ends_with("the other side closed the connection, saying 'Port already in use'"), "{message}");
}

#[test]
fn a_raw_socket_taken_for_a_remote_port_is_told_by_its_silence() {
    let server = Server::start(|mut client| {
        client.write_all(b"TC1;20.5\r\n").expect("said");
        let _ = client.read_to_end(&mut Vec::new());
    });
    let (code, kind, message) = refused(&server.link(RFC2217));
    assert_eq!((code, kind.as_str()), (Some(3), "port-gone"));
    assert!(message.ends_with("what listens there says no word of telnet within 3 s"), "{message}");
}

#[test]
fn whoever_waits_for_a_server_can_interrupt_that() {
    let (asked, is_asked) = std::sync::mpsc::channel();
    let server = Server::start(move |mut client| {
        read_to(&mut client, ASKED);
        asked.send(()).expect("somebody waits");
        let _ = client.read_to_end(&mut Vec::new());
    });
    let world = World::new();
    let running = world.start(&["identify", "--no-record", "--port", &server.link(RFC2217)]);
    is_asked.recv().expect("it connects");
    running.signal(rustix::process::Signal::INT);
    assert_eq!(running.wait().code, Some(130));
}

#[test]
fn an_interrupt_is_heard_behind_a_question_and_by_every_upload_that_waits_for_its_server() {
    let (asked, is_asked) = mpsc::channel();
    let silent = || {
        let asked = asked.clone();
        Server::start(move |mut client| {
            read_to(&mut client, ASKED);
            asked.send(()).expect("somebody waits");
            let _ = client.read_to_end(&mut Vec::new());
        })
    };
    let world = World::new();
    let server = silent();
    let command = world.command(&["defaults", "--no-record", "--port", &server.link(RFC2217)]);
    let mut screen = Screen::start(command, 24, 80);
    screen.wait("Type yes to go on: ");
    screen.keys("yes\r");
    is_asked.recv_timeout(PATIENCE).expect("it connects");
    screen.keys("\x03");
    assert_eq!(screen.wait_end(), Some(130), "{}", screen.text());

    let image = world.path("new.S").display().to_string();
    let make = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "600", "--out", &image];
    assert_eq!(world.run(&make, b"").code, Some(0));
    std::fs::write(world.path("pw"), "AXIO-2010").expect("written");
    let (one, other) = (silent(), silent());
    let (one, other) = (one.link(RFC2217), other.link(RFC2217));
    let args = ["load", &image, "--yes", "--password-file", "pw", "--no-record", "--port", &one, "--port", &other];
    let loading = world.start(&args);
    (0..2).for_each(|_| is_asked.recv_timeout(PATIENCE).expect("both connect"));
    loading.signal(rustix::process::Signal::INT);
    let ran = loading.wait();
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    assert!(ran.err.contains("0 of 2 units"), "{}", ran.err);
}

#[test]
fn what_a_unit_says_while_its_port_is_set_up_is_heard() {
    let server = Server::start(|mut client| {
        client.write_all(b"early,").expect("said");
        agree(&mut client);
        client.write_all(b"late\xff\xff\x11\x13").expect("said");
        let _ = client.read_to_end(&mut Vec::new());
    });
    let (connection, received) = open(&server.link(RFC2217));
    assert_eq!(receive(&received, 13), b"early,late\xff\x11\x13");
    assert_eq!((connection.settings(), connection.driver()), ("115200 8N1", Some("rfc2217")));
}

#[test]
fn a_port_that_is_changed_under_us_ends_the_connection() {
    let server = Server::start(|mut client| {
        agree(&mut client);
        read_to(&mut client, b"opened");
        client.write_all(b"\xff\xfa\x2c\x65\x00\x00\x25\x80\xff\xf0").expect("said");
        let _ = client.read_to_end(&mut Vec::new());
    });
    let (connection, received) = open(&server.link(RFC2217));
    connection.send(*b"opened").expect("queued");
    match received.recv_timeout(PATIENCE).expect("a message") {
        Input::Gone { error, .. } => assert!(matches!(error.cause, Cause::Baud { set: 9_600, .. }), "{error}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_server_that_suspends_its_client_gets_nothing_until_it_resumes() {
    let (tell, told) = mpsc::channel();
    let server = Server::start(move |mut client| {
        agree(&mut client);
        client.write_all(b"\xff\xfa\x2c\x6c\xff\xf0!").expect("said");
        client.set_read_timeout(Some(Duration::from_millis(50))).expect("set");
        let silent = client.read(&mut [0]).is_err();
        client.set_read_timeout(Some(PATIENCE)).expect("set");
        client.write_all(b"\xff\xfa\x2c\x6d\xff\xf0").expect("said");
        let _ = tell.send((silent, read_to(&mut client, b"key")));
        let _ = client.read_to_end(&mut Vec::new());
    });
    let (connection, received) = open(&server.link(RFC2217));
    // It came behind the order to be silent.
    assert_eq!(receive(&received, 1), b"!");
    connection.send(*b"key").expect("queued");
    assert_eq!(told.recv_timeout(PATIENCE).expect("told"), (true, b"key".to_vec()));
}

#[test]
fn the_last_key_arrives_although_nobody_has_read_what_the_unit_says() {
    let (tell, told) = mpsc::channel();
    let server = Server::start(move |mut client| {
        // More than the client takes from the line while its channel is full; then the unit goes on talking.
        let mut talking = client.try_clone().expect("a second handle");
        let talker = std::thread::spawn(move || while talking.write_all(&[b'x'; 4096]).is_ok() {});
        let mut heard = Vec::new();
        let ended = client.read_to_end(&mut heard);
        let _ = client.shutdown(Shutdown::Both);
        talker.join().expect("no panic");
        let _ = tell.send((ended.is_ok(), heard));
    });
    let (connection, _received) = open(&server.link(RAW));
    connection.send(*b"\x1b").expect("queued");
    let begun = Instant::now();
    drop(connection);
    assert!(begun.elapsed() < PATIENCE / 2);
    assert_eq!(told.recv_timeout(PATIENCE).expect("told"), (true, b"\x1b".to_vec()));
}

#[test]
fn closing_takes_a_bounded_time_when_the_other_side_reads_nothing() {
    let (go, wait) = mpsc::channel::<()>();
    let server = Server::start(move |client| {
        let _ = wait.recv_timeout(PATIENCE);
        drop(client);
    });
    let (connection, _received) = open(&server.link(RAW));
    // More than the buffers of two sockets take.
    while connection.send(vec![b'x'; 1 << 20]).is_ok() {}
    let begun = Instant::now();
    drop(connection);
    assert!(begun.elapsed() < CLOSE_PATIENCE + PATIENCE / 2);
    go.send(()).expect("somebody waits");
}

#[test]
fn a_break_is_refused_over_the_network() {
    let server = Server::start(drop);
    let (connection, _received) = open(&server.link(RAW));
    let error = connection.send_break().expect_err("the network has none");
    assert_eq!(error.to_string(), "not possible over the network");
}

// The console.

#[test]
fn the_console_shows_a_unit_behind_a_raw_socket() {
    let world = World::new();
    let _unit = unit(&world);
    let server = Server::of_port(&world.path("u0"));
    let mut screen = Screen::start(world.command(&["--port", &server.link(RAW)]), 24, 80);
    let overview = screen.wait("application runs");
    assert!(overview.contains("AXTC4CO") && overview.contains("tcp://127.0.0.1"), "{overview}");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn the_console_can_be_left_while_a_server_says_nothing_and_says_why_when_that_lasts() {
    let server = Server::start(|mut client| {
        let _ = client.read_to_end(&mut Vec::new());
    });
    let world = World::new();
    for leaves in [true, false] {
        let mut screen = Screen::start(world.command(&["--port", &server.link(RFC2217)]), 24, 100);
        screen.wait("Opening rfc2217://127.0.0.1");
        if leaves {
            screen.keys("q");
            assert_eq!(screen.wait_end(), Some(0));
        } else {
            let failed = screen.wait("Not connected");
            assert!(failed.contains("no word of telnet"), "{failed}");
        }
    }
}

// The foreign server.

/// A server by pyserial for a port; `None`, and said so, where there is no pyserial.
fn pyserial_server(world: &World, port: &Path) -> Option<(Running, String)> {
    let python = python("server", "pyserial")?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/serve_rfc2217.py");
    let args = [script.to_str().expect("UTF-8"), port.to_str().expect("UTF-8")];
    let server = Running::start(world.command_of(&python, &args));
    let number = server.wait_out("\n");
    let link = format!("rfc2217://localhost:{}", number.trim());
    Some((server, link))
}

#[test]
fn a_unit_behind_a_server_that_nobody_here_wrote_is_the_same_unit() {
    let world = World::new();
    let _unit = unit(&world);
    let direct = facts(&world, "u0");
    let Some((server, link)) = pyserial_server(&world, &world.path("u0")) else { return };
    assert_eq!(facts(&world, &link), direct);
    let header = header(&world);
    assert!(header.contains("\"settings\":\"115200 8N1\",\"driver\":\"rfc2217\""), "{header}");
    // It was opened with 9600 baud and Xon/Xoff: all that was set by the client, and was there when it left.
    server.wait_out("left: 115200 8 N 1 none\n");
    let ran = world.run(&["stream", "--period", "100", "--count", "5", "--port", &link], b"");
    assert_eq!((ran.code, ran.out.lines().count()), (Some(0), 6), "{}{}", ran.out, ran.err);
}

#[test]
fn every_byte_passes_a_server_that_nobody_here_wrote_both_ways() {
    let world = World::new();
    let echo = crate::support::puppet::Puppet::start(Box::new(<[u8]>::to_vec));
    let Some((_server, link)) = pyserial_server(&world, echo.path()) else { return };
    let (connection, received) = open(&link);
    let all: Vec<u8> = (0..=255).chain([255, 255, 17, 19, 13, 0, 13, 10]).collect();
    for piece in all.chunks(7) {
        connection.send(piece).expect("queued");
    }
    assert_eq!(receive(&received, all.len()), all);
}
