//! Ports that do not open, that go away, and those there are.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Stdio;
use std::sync::mpsc::sync_channel;

use axcon::host::link::WRITE_PATIENCE;
use axcon::host::ports;

use super::*;
use crate::support::server::Server;
use crate::support::shell::Ran;

#[test]
fn what_is_no_port_is_refused_with_its_kind_and_exit_code() {
    let world = World::new();
    fs::write(world.path("file"), "").expect("a file");
    for (port, kind, message) in [
        ("missing", "port-missing", "cannot open missing: there is no such port"),
        (".", "port-missing", "cannot open .: a directory, not a serial port"),
        ("file", "port-missing", "cannot open file: a regular file, not a serial port"),
        ("/dev/null", "port-missing", "cannot open /dev/null: some other device, not a serial port"),
    ] {
        let ran = world.run(&["identify", "--json", "--port", port], b"");
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
fn a_port_without_permission_names_the_group_that_has_it_if_one_has() {
    use std::os::unix::fs::MetadataExt;

    let pty = Pty::open(115_200).expect("a pseudo-terminal");
    let refused = |mode: u32| {
        fs::set_permissions(pty.path(), fs::Permissions::from_mode(mode)).expect("it is ours");
        let ran = opened_by_nobody(pty.path());
        assert_eq!(ran.code, Some(3), "{}", ran.err);
        assert!(ran.err.contains("permission denied"), "{}", ran.err);
        ran.err
    };
    // Nobody is asked to join the group of root.
    let group = fs::metadata(pty.path()).expect("it is there").gid();
    let told = refused(0o060);
    assert_eq!(told.contains("usermod -aG "), group != 0, "{told}");
    let told = refused(0o000);
    assert!(told.contains("only its owner has access") && !told.contains("usermod"), "{told}");
}

/// What a user without any rights is told who opens this port.
fn opened_by_nobody(port: &Path) -> Ran {
    use std::os::unix::process::CommandExt;

    const NOBODY: u32 = 65_534;
    let world = World::new();
    let arguments = ["terminal", "--no-record", "--port", text(port)];
    let mut command = world.command(&arguments);
    let copy;
    if rustix::process::geteuid().is_root() {
        // Root passes every permission, so the program has to be somebody else, and has to lie where he may go.
        copy = tempfile::Builder::new().permissions(fs::Permissions::from_mode(0o755)).tempdir().expect("a folder");
        let program = copy.path().join("axcon");
        // By another process: a program that is open for writing cannot be started, and a test next door that starts
        // one just then would keep it open.
        let cp = std::process::Command::new("cp").arg(env!("CARGO_BIN_EXE_axcon")).arg(&program).status();
        assert!(cp.expect("cp runs").success());
        command = world.command_of(&program, &arguments);
        command.uid(NOBODY).gid(NOBODY).current_dir("/");
    }
    let mut running = Running::start(command);
    running.end_input();
    running.wait()
}

#[test]
fn a_second_opener_is_told_who_has_the_port() {
    let world = World::new();
    let unit = host(echo());
    let (connection, received) = connect(unit.serial(), 115_200);
    let ran = world.run(&["identify", "--json", "--port", text(unit.serial())], b"");
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

#[test]
fn a_link_that_takes_no_byte_for_five_seconds_is_stuck() {
    let deaf = Pty::open(115_200).expect("a pseudo-terminal");
    let (over, ends) = sync_channel::<()>(1);
    let server = Server::start(move |_client| {
        let _ = ends.recv_timeout(PATIENCE);
    });
    let links = [LinkSpec::Serial(deaf.path().to_owned()), server.link("tcp").parse().expect("a link")];
    let begun = std::time::Instant::now();
    let open: Vec<_> = links.iter().map(|link| connected(link, 115_200)).collect();
    // More than all buffers on the way take.
    for (connection, _) in &open {
        (0..16).for_each(|_| connection.send(vec![b'x'; 1 << 20]).expect("queued"));
    }
    for (_, received) in &open {
        match received.recv_timeout(PATIENCE).expect("a message") {
            Input::Gone { error, .. } => {
                assert!(matches!(error.cause, Cause::Stuck { after } if after == WRITE_PATIENCE), "{error}");
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(begun.elapsed() >= WRITE_PATIENCE, "{:?}", begun.elapsed());
    over.send(()).expect("the server waits");
}

#[test]
fn the_process_that_has_a_port_is_named_and_the_host_of_the_port_is_not() {
    let world = World::new();
    let unit = host(echo());
    assert_eq!(ports::holder(unit.serial()), None, "nobody but its host has it");
    let mut command = world.command(&["terminal", "--no-record", "--port", text(unit.serial())]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program starts");
    wait_until("it has the port", || ports::holder(unit.serial()).is_some());
    let found = ports::holder(unit.serial()).expect("it still has it");
    let port = ports::describe(unit.serial());
    let listed = ports::holders(&[port]);
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    assert_eq!((found.pid, found.name.as_str()), (child.id(), "axcon"));
    assert_eq!(listed, [Some(found)]);
    assert_eq!(ports::holder(unit.serial()), None, "it has closed it");
}

/// What the members say of a port is tried with made ones (`src/cli/ports.rs`): a machine need not have any.
#[test]
fn ports_are_one_object_with_a_list_or_a_table_with_a_head() {
    let world = World::new();
    let ran = world.run(&["ports", "--json"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let object: serde_json::Value = serde_json::from_str(&ran.out).expect("one object");
    assert_eq!(object["schema"], "axcon.ports/1");
    assert!(object["ports"].is_array(), "{object}");
    let ran = world.run(&["ports"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.starts_with("PORT ") || ran.err.starts_with("no serial ports found"), "{} {}", ran.out, ran.err);
}
