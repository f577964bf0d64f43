//! The system layer over real pseudo-terminals: ports that do not open, the line's rate, flow control, the plain
//! terminal, and the life of an emulator.
//!
//! Nothing here measures how fast the machine is: what is asserted about time is read from the unit's own clock, or is
//! a bound that only a hang exceeds.

use std::fs;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt, symlink};
use std::path::Path;
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rustix::process::Signal;

use axcon::emulator::Store;
use axcon::emulator::scenario::Verb;
use axcon::endpoint::{Endpoint, Transmit};
use axcon::host::clock::Clock;
use axcon::host::link::{Cause, Connection, LinkSpec, Options};
use axcon::host::pty::Pty;
use axcon::host::unit::{AHEAD, Answer, Hosted, HostedUnit, Hosting, LineRate, Power};
use axcon::host::{Input, channel};
use axcon::time::Instant;

use crate::support::screen::Screen;
use crate::support::shell::{PATIENCE, Running, World};

const XOFF: u8 = 0x13;
const XON: u8 = 0x11;

/// A unit for these stories: notes what it gets and when, echoes it, and can hold the sender.
#[derive(Default)]
struct Fake {
    notes: Arc<Mutex<Notes>>,
    echo: bool,
    /// Hold after this many bytes, and for how long.
    hold: Option<(usize, Duration)>,
    holding_until: Option<Instant>,
    /// Said when power comes.
    greeting: &'static [u8],
    outgoing: Vec<u8>,
}

#[derive(Default)]
struct Notes {
    got: Vec<(Instant, u8)>,
    /// Bytes that came between XOFF and XON.
    while_holding: usize,
    released: bool,
}

impl Endpoint for Fake {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let mut notes = self.notes.lock().expect("no panic");
        notes.got.extend(bytes.iter().map(|&byte| (now, byte)));
        if self.holding_until.is_some() {
            notes.while_holding += bytes.len();
        }
        if self.echo {
            self.outgoing.extend_from_slice(bytes);
        }
        if let Some((after, time)) = self.hold
            && notes.got.len() >= after
        {
            self.hold = None;
            self.holding_until = Some(now + time);
            self.outgoing.push(XOFF);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.holding_until.is_some_and(|until| until <= now) {
            self.holding_until = None;
            self.notes.lock().expect("no panic").released = true;
            self.outgoing.push(XON);
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        (!self.outgoing.is_empty()).then(|| Transmit::open(std::mem::take(&mut self.outgoing)))
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.holding_until
    }
}

impl Hosted for Fake {
    fn power_on(&mut self, _now: Instant) {
        self.outgoing.extend_from_slice(self.greeting);
    }

    fn perform(&mut self, _now: Instant, verb: &Verb) -> Answer {
        Err(format!("{verb:?} is nothing this one can do"))
    }

    fn holds_sender(&self) -> bool {
        self.holding_until.is_some()
    }

    fn poll_store(&mut self) -> Option<Store> {
        None
    }
}

fn echo() -> Fake {
    Fake { echo: true, ..Fake::default() }
}

fn host(fake: Fake) -> HostedUnit {
    HostedUnit::start(fake, Hosting::default()).expect("hosted")
}

fn connect(path: &Path, baud: u32) -> (Connection, Receiver<Input>) {
    let (inputs, received) = channel();
    let spec = LinkSpec::Serial(path.to_owned());
    (Connection::open(&spec, Options { baud }, Clock::start(), inputs).expect("opened"), received)
}

/// Bytes from the connection until there are this many.
fn receive(received: &Receiver<Input>, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while bytes.len() < count {
        match received.recv_timeout(PATIENCE).expect("more bytes") {
            Input::Bytes { bytes: more, .. } => bytes.extend(more),
            other => panic!("{other:?} after {:?}", bytes.escape_ascii().to_string()),
        }
    }
    bytes
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = std::time::Instant::now() + PATIENCE;
    while !is_so() {
        assert!(std::time::Instant::now() < end, "{what}: not in time");
        thread::sleep(Duration::from_millis(2));
    }
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

// Ports that do not open.

#[test]
fn what_is_no_port_is_refused_with_its_kind_and_exit_code() {
    let world = World::new();
    fs::write(world.path("file"), "").expect("a file");
    for (port, kind, message) in [
        ("missing", "port-missing", "cannot open missing: there is no such port"),
        (".", "port-gone", "cannot open .: a directory, not a serial port"),
        ("file", "port-gone", "cannot open file: a regular file, not a serial port"),
        ("/dev/null", "port-gone", "cannot open /dev/null: some other device, not a serial port"),
    ] {
        let ran = world.run(&["terminal", "--json", "--port", port], b"");
        assert_eq!(ran.code, Some(3), "{port}: {}", ran.err);
        let error: serde_json::Value = serde_json::from_str(&ran.err).expect("one object");
        assert_eq!((&error["kind"], &error["message"]), (&kind.into(), &message.into()));
        assert_eq!(error["schema"], "axcon.error/1");
        assert!(error["hints"].as_array().is_some_and(|hints| !hints.is_empty()), "{port}: no hint");
        assert_eq!(ran.out, "");
    }
}

#[test]
fn links_that_name_nothing_say_so() {
    let world = World::new();
    for port in ["replay:", "emu:toaster", ""] {
        let ran = world.run(&["terminal", "--port", port], b"");
        assert_eq!(ran.code, Some(2), "{port}: {}", ran.err);
        assert!(ran.err.starts_with("axcon: --port: "), "{}", ran.err);
    }
}

#[test]
fn a_port_without_permission_names_the_group_that_has_it() {
    use std::os::unix::process::CommandExt;

    const NOBODY: u32 = 65_534;
    let world = World::new();
    let pty = Pty::open(115_200).expect("a pseudo-terminal");
    fs::set_permissions(pty.path(), fs::Permissions::from_mode(0o000)).expect("closed to all");
    let mut command = world.command(&["terminal", "--no-record", "--port", text(pty.path())]);
    let copy;
    if rustix::process::geteuid().is_root() {
        // Root passes every permission, so the program has to be somebody else, and has to lie where he may go.
        copy = tempfile::Builder::new().permissions(fs::Permissions::from_mode(0o755)).tempdir().expect("a folder");
        let program = copy.path().join("axcon");
        // By another process: a program that is open for writing cannot be started, and a test next door that starts
        // one just then would keep it open.
        let cp = std::process::Command::new("cp").arg(env!("CARGO_BIN_EXE_axcon")).arg(&program).status();
        assert!(cp.expect("cp runs").success());
        command = world.command_of(&program, &["terminal", "--no-record", "--port", text(pty.path())]);
        command.uid(NOBODY).gid(NOBODY).current_dir("/");
    }
    let mut running = Running::start(command);
    running.end_input();
    let ran = running.wait();
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.err.contains("permission denied (it belongs to group '"), "{}", ran.err);
    assert!(ran.err.contains("usermod -aG "), "{}", ran.err);
}

#[test]
fn a_second_opener_is_told_who_has_the_port() {
    let world = World::new();
    let unit = host(echo());
    let (connection, received) = connect(unit.serial(), 115_200);
    let ran = world.run(&["terminal", "--json", "--port", text(unit.serial())], b"");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    let error: serde_json::Value = serde_json::from_str(&ran.err).expect("one object");
    assert_eq!(error["kind"], "port-busy");
    let message = error["message"].as_str().expect("a text");
    assert!(message.contains(&format!("(process {})", std::process::id())), "{message}");

    // The first one goes on undisturbed, and the port is free when it has closed.
    connection.send(*b"still here").expect("sent");
    assert_eq!(receive(&received, 10), b"still here");
    drop(connection);
    let ran = world.run(&["terminal", "--no-record", "--port", text(unit.serial())], b"me");
    assert_eq!((ran.code, ran.out.as_str()), (Some(0), "me"), "{}", ran.err);
}

#[test]
fn a_port_that_goes_away_ends_the_connection_with_one_message() {
    let unit = host(echo());
    let (_connection, received) = connect(unit.serial(), 115_200);
    drop(unit);
    match received.recv_timeout(PATIENCE).expect("a message") {
        Input::Gone { error, .. } => assert!(matches!(error.cause, Cause::Gone), "{error}"),
        other => panic!("{other:?}"),
    }
    assert!(received.recv_timeout(Duration::from_millis(50)).is_err(), "one is enough");
}

#[test]
fn closing_takes_a_bounded_time_whatever_the_other_side_does() {
    // Nobody reads: the pipe of the pseudo-terminal fills, and the writer waits for room.
    let deaf = Pty::open(115_200).expect("a pseudo-terminal");
    let (connection, _received) = connect(deaf.path(), 115_200);
    for _ in 0..100 {
        connection.send(vec![b'x'; 1000]).expect("queued");
    }
    let begun = std::time::Instant::now();
    drop(connection);
    assert!(begun.elapsed() < PATIENCE / 2);

    // Nobody takes the inputs: the reader waits for room in the channel.
    let loud = Pty::open(115_200).expect("a pseudo-terminal");
    let (connection, received) = connect(loud.path(), 115_200);
    wait_until("the reader is behind", || {
        let stuck = loud.write(&[b'x'; 4096]).expect("written") == 0;
        thread::sleep(Duration::from_millis(1));
        stuck
    });
    let begun = std::time::Instant::now();
    drop(connection);
    assert!(begun.elapsed() < PATIENCE / 2);
    drop(received);
}

// The ports there are.

#[test]
fn ports_are_one_object_with_the_documented_members() {
    let world = World::new();
    let ran = world.run(&["ports", "--json"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let object: serde_json::Value = serde_json::from_str(&ran.out).expect("one object");
    assert_eq!(object["schema"], "axcon.ports/1");
    for port in object["ports"].as_array().expect("a list") {
        for member in ["path", "kind", "vid", "pid", "serial_number", "driver", "busy_by"] {
            assert!(port.get(member).is_some(), "no {member} in {port}");
        }
    }
    let ran = world.run(&["ports"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.starts_with("PORT ") || ran.err.starts_with("no serial ports found"), "{} {}", ran.out, ran.err);
}

// The line.

#[test]
fn bytes_reach_the_unit_no_faster_than_the_line_carries_them() {
    const COUNT: usize = 3_000;
    let fake = Fake::default();
    let notes = fake.notes.clone();
    let unit = host(fake);
    let (connection, _received) = connect(unit.serial(), 115_200);
    for _ in 0..COUNT / 100 {
        connection.send([b'x'; 100]).expect("queued");
    }
    wait_until("all bytes", || notes.lock().expect("no panic").got.len() == COUNT);
    let notes = notes.lock().expect("no panic");
    let character = Duration::from_nanos(86_805);
    for pair in notes.got.windows(2) {
        assert!(pair[1].0.since(pair[0].0) >= character, "two bytes within {:?}", pair[1].0.since(pair[0].0));
    }
    // Without a gap, as far as the client keeps the line busy: the unit's clock shows it, however late its host woke.
    let took = notes.got[COUNT - 1].0.since(notes.got[0].0);
    assert!(took < character * (COUNT as u32) * 2, "{took:?}");
}

#[test]
fn without_a_line_rate_bytes_come_as_they_are_at_any_setting() {
    let hosting = Hosting { line_rate: LineRate::Off, ..Hosting::default() };
    let unit = HostedUnit::start(echo(), hosting).expect("hosted");
    let (connection, received) = connect(unit.serial(), 9_600);
    let sent: Vec<u8> = (0..=255).cycle().take(5_000).collect();
    for piece in sent.chunks(100) {
        connection.send(piece).expect("queued");
    }
    assert_eq!(receive(&received, sent.len()), sent);
}

#[test]
fn a_client_at_another_rate_sends_and_gets_garbage() {
    let fake = echo();
    let notes = fake.notes.clone();
    let unit = host(fake);
    let (connection, received) = connect(unit.serial(), 9_600);
    connection.send(*b"menu").expect("sent");
    let garbage = receive(&received, 4);
    assert!(garbage.iter().all(|byte| *byte >= 0x80), "{garbage:02x?}");
    wait_until("all bytes", || notes.lock().expect("no panic").got.len() == 4);
    assert!(notes.lock().expect("no panic").got.iter().all(|(_, byte)| *byte >= 0x80));
}

#[test]
fn what_the_unit_says_first_is_heard_by_the_first_client() {
    let hosting = Hosting { power: Power::AtFirstClient, ..Hosting::default() };
    let unit = HostedUnit::start(Fake { greeting: b"AXTC4CO", ..echo() }, hosting).expect("hosted");
    let (_connection, received) = connect(unit.serial(), 115_200);
    assert_eq!(receive(&received, 7), b"AXTC4CO");
}

#[test]
fn the_last_words_can_be_read_before_the_port_goes() {
    let hosting = Hosting { power: Power::AtFirstClient, ..Hosting::default() };
    let unit = HostedUnit::start(Fake { greeting: b"last words", ..Fake::default() }, hosting).expect("hosted");
    let settings = serialport::new(text(unit.serial()), 115_200).timeout(PATIENCE);
    let mut client = settings.open().expect("opened");
    wait_until("the greeting", || client.bytes_to_read().expect("a number") == 10);
    let closing = thread::spawn(move || drop(unit));
    let mut buffer = [0; 10];
    std::io::Read::read_exact(&mut client, &mut buffer).expect("still there");
    assert_eq!(&buffer, b"last words");
    closing.join().expect("closed");
}

// Flow control.

/// Sends 4,000 bytes to a unit that says XOFF after 500 and XON 60 ms later; gives what came in between.
fn bytes_that_slip_past_an_xoff(flow_control: serialport::FlowControl) -> usize {
    let fake = Fake { hold: Some((500, Duration::from_millis(60))), ..Fake::default() };
    let notes = fake.notes.clone();
    let unit = host(fake);
    let settings = serialport::new(text(unit.serial()), 115_200).flow_control(flow_control).timeout(PATIENCE);
    let mut client = settings.open().expect("opened");
    std::io::Write::write_all(&mut client, &[b'x'; 4_000]).expect("written");
    wait_until("all bytes", || notes.lock().expect("no panic").got.len() == 4_000);
    let notes = notes.lock().expect("no panic");
    assert!(notes.released);
    notes.while_holding
}

#[test]
fn a_client_that_obeys_xoff_is_held_with_what_waits_in_the_pseudo_terminal() {
    let slipped = bytes_that_slip_past_an_xoff(serialport::FlowControl::Software);
    assert!(slipped <= AHEAD, "{slipped} bytes");
}

#[test]
fn a_client_that_does_not_obey_xoff_overruns_the_unit() {
    // At the line's rate 690 characters come in that time, if the client is never late.
    let slipped = bytes_that_slip_past_an_xoff(serialport::FlowControl::None);
    assert!((10 * AHEAD..=700).contains(&slipped), "{slipped} bytes");
}

#[test]
fn a_client_that_was_killed_while_held_leaves_a_port_that_works() {
    let unit = host(Fake { hold: Some((1, Duration::from_millis(30))), ..echo() });
    {
        let settings = serialport::new(text(unit.serial()), 115_200).flow_control(serialport::FlowControl::Software);
        let mut client = settings.timeout(Duration::from_millis(5)).open().expect("opened");
        std::io::Write::write_all(&mut client, b"xxxxxxxx").expect("written");
        thread::sleep(Duration::from_millis(10));
    }
    thread::sleep(Duration::from_millis(60));
    let (connection, received) = connect(unit.serial(), 115_200);
    connection.send(*b"m").expect("sent");
    assert!(receive(&received, 1).ends_with(b"m"));
}

#[test]
fn visitors_do_not_disturb_the_client_that_stays() {
    let unit = host(echo());
    let (connection, received) = connect(unit.serial(), 115_200);
    for round in 0..20u8 {
        // As `stty` and `fuser` do, faster than anybody can look.
        for _ in 0..5 {
            // Not as a controlling terminal: its hang-up would end the tests.
            let flags = rustix::fs::OFlags::NOCTTY.bits() as i32;
            drop(fs::File::options().read(true).custom_flags(flags).open(unit.serial()).expect("opened"));
        }
        connection.send([round]).expect("sent");
        assert_eq!(receive(&received, 1), [round]);
    }
}

// The plain terminal.

#[test]
fn the_terminal_shows_what_is_harmless_and_logs_what_came() {
    let world = World::new();
    let unit = host(echo());
    let sent = b"caf\xc3\xa9\x1b[2J\xff\x9b\ttab\r\n";
    let ran = world.run(&["terminal", "--port", text(unit.serial()), "--log", "raw.log"], sent);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_eq!(ran.out, "café^[[2J‹ff›‹9b›\ttab\n");
    assert_eq!(fs::read(world.path("raw.log")).expect("a log"), sent);

    let recordings = world.files("state/axcon/recordings");
    let [recording] = recordings.as_slice() else { panic!("{recordings:?}") };
    let recording = fs::read_to_string(recording).expect("a recording");
    assert!(recording.contains(r#""o","#) && recording.contains("[2J"), "{recording}");
    let typed = recording.lines().find(|line| line.contains(r#""i","#)).expect("typed bytes");
    assert!(typed.contains("caf") && typed.contains("[2J"), "{typed}");
}

#[test]
fn the_terminal_obeys_xoff() {
    let world = World::new();
    let fake = Fake { hold: Some((100, Duration::from_millis(500))), ..Fake::default() };
    let notes = fake.notes.clone();
    let unit = host(fake);
    let ran = world.run(&["terminal", "--no-record", "--port", text(unit.serial())], &[b'x'; 3_000]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_eq!(ran.out, "", "XON and XOFF are not text");
    let notes = notes.lock().expect("no panic");
    assert_eq!(notes.got.len(), 3_000);
    // What is on the line, and what left before the XOFF was read: milliseconds, or more on a busy machine. All the
    // rest would come meanwhile if nobody obeyed.
    assert!(notes.while_holding <= 2_000, "{} bytes", notes.while_holding);
}

#[test]
fn keys_go_out_and_ctrl_bracket_gives_the_terminal_back() {
    let world = World::new();
    let unit = host(echo());
    let mut screen = Screen::start(world.command(&["terminal", "--port", text(unit.serial())]), 24, 80);
    screen.wait("Ctrl-] leaves");
    wait_until("raw mode", || !screen.is_as_the_shell_left_it());
    screen.keys("hello\x1bOP\x03");
    screen.wait("hello^[OP^C");
    screen.keys("\x1d");
    assert_eq!(screen.wait_end(), Some(0));
    assert!(screen.is_given_back());
}

#[test]
fn whoever_ends_the_terminal_gives_the_terminal_back() {
    for signal in [Signal::TERM, Signal::HUP, Signal::INT] {
        let world = World::new();
        let unit = host(echo());
        let mut screen = Screen::start(world.command(&["terminal", "--port", text(unit.serial())]), 24, 80);
        screen.wait("Ctrl-] leaves");
        wait_until("raw mode", || !screen.is_as_the_shell_left_it());
        screen.signal(signal);
        assert_eq!(screen.wait_end(), Some(130), "{signal:?}");
        assert!(screen.is_given_back(), "{signal:?}");
    }
}

#[test]
fn a_port_that_goes_away_gives_the_terminal_back_and_says_why() {
    let world = World::new();
    let unit = host(echo());
    let mut screen = Screen::start(world.command(&["terminal", "--port", text(unit.serial())]), 24, 100);
    screen.wait("Ctrl-] leaves");
    wait_until("raw mode", || !screen.is_as_the_shell_left_it());
    drop(unit);
    assert_eq!(screen.wait_end(), Some(3));
    screen.wait("the port has gone");
    assert!(screen.is_given_back());
}

// The life of an emulator.

#[test]
fn an_emulator_says_where_it_is_and_takes_its_link_along() {
    let world = World::new();
    let link = world.path("unit");
    symlink("/dev/pts/4711", &link).expect("a stale link");
    let emulator = world.start(&["emulate", "axtc4co", "--link", text(&link)]);
    let said = emulator.wait_out("\n");
    assert_eq!(said, format!("serial: {}\n", link.display()));
    assert!(fs::read_link(&link).expect("a link").starts_with("/dev/pts"));
    let ran = world.run(&["terminal", "--no-record", "--port", text(&link)], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    emulator.signal(Signal::TERM);
    let ran = emulator.wait();
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    assert!(fs::symlink_metadata(&link).is_err(), "the link is gone");
}

#[test]
fn an_emulator_ends_in_order_on_every_signal_and_on_its_verb() {
    for signal in [Some(Signal::INT), Some(Signal::HUP), None] {
        let world = World::new();
        let link = world.path("unit");
        let mut emulator = world.start(&["emulate", "axtc4co", "--link", text(&link)]);
        emulator.wait_out("serial: ");
        match signal {
            Some(signal) => emulator.signal(signal),
            None => emulator.input(b"quit\n"),
        }
        assert_eq!(emulator.wait().code, Some(0), "{signal:?}");
        assert!(fs::symlink_metadata(&link).is_err(), "{signal:?}");
    }
}

#[test]
fn an_emulator_goes_on_when_its_input_ends_and_answers_what_it_does_not_know() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co"]);
    emulator.wait_out("serial: /dev/pts/");
    emulator.input(b"help\npower off\nexplode\n");
    emulator.wait_err("'explode' is not known; there is: set, process, open");
    emulator.end_input();
    thread::sleep(Duration::from_millis(50));
    emulator.signal(Signal::TERM);
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn verbs_and_scenarios_do_to_a_unit_what_they_say() {
    let world = World::new();
    fs::write(
        world.path("day.toml"),
        "product = 'axtc4co'\n[[at]]\nseconds = 0\ndo = ['set 2 temperature 77.5', 'write 6112:4 0']\n",
    )
    .expect("written");
    let mut emulator = world.start(&["emulate", "axtc4co", "axrtd8co", "--scenario", "day.toml"]);
    emulator.wait_out("serial: ");
    // A unit answers nobody in its first moments.
    thread::sleep(Duration::from_millis(200));
    emulator.input(b"set 1 temperature 250\n2 set 3 resistance 100\n");
    emulator.input(b"all status\n1 write 6126:1 18.0\n1 read 6126:1\n2 read 3000:1\n2 write 3000:1 7\n");
    // Each unit answers in its own time.
    for said in ["1: AXTC4CO runs", "2: AXRTD8CO runs", "1: 6126:01 = 18.0", "2: 3000:01 = 1 (IEC 0.00385)"] {
        emulator.wait_out(said);
    }
    emulator.wait_err("2: 3000:01 <- 7: the value is above the high limit (abort 06090031h)");
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_scenario_that_cannot_be_played_is_refused_with_every_fault() {
    let world = World::new();
    fs::write(world.path("bad.toml"), "[[at]]\nseconds = 1\ndo = ['opne 3']\n[[at]]\nseconds = -2\ndo = []\n")
        .expect("written");
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "bad.toml"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    for complaint in ["bad.toml:3:8: at.do: 'opne' is not known", "bad.toml:5:11: at.seconds: -2 is not 0 to 604800"] {
        assert!(ran.err.contains(complaint), "{}", ran.err);
    }
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "nowhere.toml"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("cannot read the scenario 'nowhere.toml'"), "{}", ran.err);
}

#[test]
fn an_emulator_leaves_a_real_file_alone() {
    let world = World::new();
    fs::write(world.path("unit"), "mine").expect("a file");
    let ran = world.run(&["emulate", "axtc4co", "--link", "unit"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("'unit' exists and is a file; it is left as it is"), "{}", ran.err);
    assert_eq!(fs::read(world.path("unit")).expect("still there"), b"mine");
}

#[test]
fn an_emulator_leaves_the_link_of_a_running_one_alone_and_takes_that_of_a_killed_one() {
    let world = World::new();
    let args = ["emulate", "axtc4co", "--link", "unit"];
    let first = world.start(&args);
    first.wait_out("serial: ");
    let port = fs::read_link(world.path("unit")).expect("a link");
    let second = world.run(&args, b"");
    assert_eq!(second.code, Some(1), "{}", second.err);
    assert!(second.err.contains("'unit' exists and is the port of a unit that axcon (process "), "{}", second.err);
    assert_eq!(fs::read_link(world.path("unit")).expect("still there"), port);
    first.signal(Signal::KILL);
    first.wait();
    let third = world.start(&args);
    third.wait_out("serial: ");
    third.signal(Signal::TERM);
    assert_eq!(third.wait().code, Some(0));
}

#[test]
fn several_units_have_several_ports() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co", "AXTC4CO", "--link", "unit", "--json"]);
    let said = emulator.wait_out("unit-2");
    let first: serde_json::Value = serde_json::from_str(said.lines().next().expect("a line")).expect("an object");
    assert_eq!(first["schema"], "axcon.emulate/1");
    assert_eq!((&first["product"], &first["serial"]), (&"AXTC4CO".into(), &"unit".into()));
    for link in ["unit", "unit-2"] {
        assert!(fs::read_link(world.path(link)).expect("a link").starts_with("/dev/pts"), "{link}");
    }
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_state_directory_is_kept_and_belongs_to_one_emulator() {
    let world = World::new();
    let emulator = world.start(&["emulate", "axtc4co", "--state", "state-of-unit"]);
    emulator.wait_out("serial: ");
    assert_eq!(fs::metadata(world.path("state-of-unit/flash.bin")).expect("flash").len(), 131_072);
    let second = world.run(&["emulate", "axtc4co", "--state", "state-of-unit"], b"");
    assert_eq!(second.code, Some(1));
    assert!(second.err.contains("is in use by another emulator"), "{}", second.err);
    emulator.signal(Signal::TERM);
    assert_eq!(emulator.wait().code, Some(0));

    fs::write(world.path("state-of-unit/flash.bin"), "short").expect("spoilt");
    fs::write(world.path("state-of-unit/parameters.bin"), [7; 4096]).expect("spoilt");
    let third = world.start(&["emulate", "axtc4co", "--state", "state-of-unit"]);
    third.wait_out("serial: ");
    let said = third.wait_err("parameters.bin.damaged-1");
    assert!(said.contains("flash.bin' cannot be used: it has 5 bytes"), "{said}");
    assert!(said.contains("kept as 'state-of-unit/flash.bin.damaged-1'"), "{said}");
    assert_eq!(fs::read(world.path("state-of-unit/flash.bin.damaged-1")).expect("kept"), b"short");
    third.signal(Signal::TERM);
    assert_eq!(third.wait().code, Some(0));

    let other = world.run(&["emulate", "axrtd8co", "--state", "state-of-unit"], b"");
    assert_eq!(other.code, Some(1));
    assert!(other.err.contains("is of AXTC4CO, not of AXRTD8CO"), "{}", other.err);
}

#[test]
fn a_fault_on_the_command_line_cuts_an_upload_off_and_the_next_one_saves_the_unit() {
    let world = World::new();
    fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "2000", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    let fault = "power-cut at record 40 for 0.3";
    let mut emulator = world.start(&["emulate", "axtc4co", "--link", "unit", "--loader", "g2", "--fault", fault]);
    emulator.wait_out("serial: unit");
    let load = ["load", "new.S", "--yes", "--password-file", "pw", "--product", "axtc4co", "--port", "unit"];
    let cut_off = world.run(&load, b"");
    assert_eq!(cut_off.code, Some(7), "{}{}", cut_off.out, cut_off.err);
    let saved = world.run(&load, b"");
    assert_eq!(saved.code, Some(0), "{}{}", saved.out, saved.err);
    assert!(saved.err.contains("1.2.0") || saved.out.contains("1.2.0"), "{}{}", saved.out, saved.err);
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_pulled_cable_hangs_up_and_comes_back_as_another_port_under_the_same_link() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co", "--link", "unit", "--json"]);
    emulator.wait_out("\"unit\":1");
    let first = fs::read_link(world.path("unit")).expect("a link");
    let (_connection, received) = connect(&world.path("unit"), 115_200);
    emulator.input(b"unplug\nstatus\n");
    emulator.wait_out("its cable is out");
    while !matches!(received.recv_timeout(PATIENCE).expect("a hang-up"), Input::Gone { .. }) {}
    assert!(!first.exists(), "the port is gone");
    emulator.input(b"plug\n");
    wait_until("the link follows", || fs::read_link(world.path("unit")).is_ok_and(|target| target != first));
    let ran = world.run(&["identify", "--json", "--port", "unit"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("AXTC4CO"), "{}", ran.out);
    emulator.input(b"quit\n");
    let ended = emulator.wait();
    assert_eq!(ended.out.matches("axcon.emulate/1").count(), 2, "{}", ended.out);
    assert!(fs::symlink_metadata(world.path("unit")).is_err(), "the link goes with the emulator");
}

#[test]
fn a_fault_that_is_none_is_refused_with_its_column() {
    let world = World::new();
    let ran = world.run(&["emulate", "axtc4co", "--fault", "lost to-unit at bite 5"], b"");
    assert_eq!(ran.code, Some(2));
    let complaint = "--fault 'lost to-unit at bite 5': column 17: 'bite' is not known; there is: byte";
    assert!(ran.err.contains(complaint), "{}", ran.err);
}

#[test]
fn an_emulated_link_needs_no_port() {
    let world = World::new();
    let ran = world.run(&["terminal", "--no-record", "--port", "emu:axtc4co"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}
