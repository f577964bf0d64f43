//! The plain terminal, on a terminal and without.

use std::fs;
use std::os::unix::fs::symlink;

use axcon::host::ports;

use super::*;
use crate::support::puppet::Puppet;

/// What a unit has got so far.
fn got(notes: &Mutex<Notes>) -> Vec<u8> {
    notes.lock().expect("no panic").got.iter().map(|(_, byte)| *byte).collect()
}

#[test]
fn the_terminal_shows_what_is_harmless_and_logs_what_came() {
    let world = World::new();
    let unit = host(echo());
    let sent = b"caf\xc3\xa9\x1b[2J\xff\x9b\ttab\r\n";
    let args = ["terminal", "--port", text(unit.serial()), "--log", "raw.log", "--newline-out", "keep"];
    let ran = world.run(&args, sent);
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

#[test]
fn a_break_is_marked_and_the_next_key_still_arrives() {
    let world = World::new();
    let fake = echo();
    let notes = fake.notes.clone();
    let unit = host(fake);
    let args = ["terminal", "--record", "it.cast", "--port", text(unit.serial())];
    let mut screen = Screen::start(world.command(&args), 24, 80);
    screen.wait("Ctrl-] leaves");
    wait_until("raw mode", || !screen.is_as_the_shell_left_it());
    screen.keys("\x14b");
    screen.wait("-- break --");
    screen.keys("m");
    wait_until("the key", || !got(&notes).is_empty());
    screen.keys("\x1d");
    assert_eq!(screen.wait_end(), Some(0));
    assert_eq!(got(&notes), b"m");
    let recording = fs::read_to_string(world.path("it.cast")).expect("a recording");
    let (mark, key) = (recording.find(r#","m","break"]"#), recording.find(r#","i","m"]"#));
    assert!(mark.is_some() && mark < key, "{recording}");
}

#[test]
fn a_terminal_goes_on_when_its_cable_comes_back() {
    let world = World::new();
    let link = world.path("unit");
    let first = host(echo());
    symlink(first.serial(), &link).expect("plugged in");
    let args = ["terminal", "--record", "it.cast", "--port", text(&link)];
    let mut screen = Screen::start(world.command(&args), 24, 200);
    screen.wait("Ctrl-] leaves");
    wait_until("raw mode", || !screen.is_as_the_shell_left_it());
    screen.keys("alpha");
    screen.wait("alpha");
    drop(first);
    screen.wait("waiting for it to come back");
    fs::remove_file(&link).expect("pulled out");
    let fake = echo();
    let notes = fake.notes.clone();
    let second = host(fake);
    symlink(second.serial(), &link).expect("plugged in again");
    screen.wait("-- link back as ");
    screen.keys("omega");
    screen.wait("omega");
    screen.keys("\x1d");
    assert_eq!(screen.wait_end(), Some(0));
    assert!(screen.is_given_back());
    assert_eq!(got(&notes), b"omega");
    let recording = fs::read_to_string(world.path("it.cast")).expect("a recording");
    let marks = [r#","m","link lost"]"#, r#","m","link back as "#].map(|mark| recording.find(mark));
    assert!(marks[0].is_some() && marks[0] < marks[1], "{recording}");
    assert!(marks[1] < recording.rfind(r#","i","#), "one recording of both: {recording}");
}

#[test]
fn a_signal_ends_a_terminal_that_is_blocked_in_a_write_and_gives_the_terminal_back() {
    let world = World::new();
    let made = std::process::Command::new("mkfifo").arg(world.path("pipe")).status();
    assert!(made.expect("a program of every Unix").success());
    let unit = Puppet::silent();
    let script = "\"$@\" > pipe; echo \"ended with $?\" >&2";
    let program = env!("CARGO_BIN_EXE_axcon");
    let args = ["-c", script, "sh", program, "terminal", "--no-record", "--port", unit.port()];
    let mut screen = Screen::start(world.command_of(Path::new("/bin/sh"), &args), 24, 100);
    // Nobody reads from it.
    let pipe = fs::File::open(world.path("pipe")).expect("somebody writes");
    screen.wait("Ctrl-] leaves");
    wait_until("raw mode", || !screen.is_as_the_shell_left_it());
    unit.say(&[b'x'; 90_000]);
    wait_until("the pipe is full", || rustix::io::ioctl_fionread(&pipe).expect("a number") > 60_000);
    let holder = ports::holder(unit.path()).expect("the program has it");
    let pid = i32::try_from(holder.pid).ok().and_then(rustix::process::Pid::from_raw).expect("a process");
    rustix::process::kill_process(pid, Signal::TERM).expect("the signal goes out");
    screen.wait("ended with 130");
    assert!(screen.is_given_back());
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn a_file_for_a_port_that_takes_no_more_bytes_ends_with_3() {
    let world = World::new();
    let deaf = Pty::open(115_200).expect("a pseudo-terminal");
    fs::write(world.path("long.txt"), vec![b'x'; 1_000_000]).expect("written");
    let args = ["terminal", "--no-record", "--baud", "3000000", "--send", "long.txt", "--port", text(deaf.path())];
    let ran = world.run(&args, b"");
    assert_eq!((ran.code, ran.out.as_str()), (Some(3), ""), "{}", ran.err);
    assert!(ran.err.contains("too much waits to be sent"), "{}", ran.err);
}

#[test]
fn a_file_whose_last_bytes_a_deaf_port_never_takes_ends_with_3() {
    let world = World::new();
    let deaf = Pty::open(115_200).expect("a pseudo-terminal");
    let flags = rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY | rustix::fs::OFlags::NONBLOCK;
    let client = rustix::fs::open(deaf.path(), flags, rustix::fs::Mode::empty()).expect("opened");
    while rustix::io::write(&client, &[b'x'; 64]).is_ok() {}
    drop(client);
    // Less than the queue for the port holds, and more than the kernel may find room for after all.
    fs::write(world.path("short.txt"), vec![b'x'; 12_000]).expect("written");
    let args = ["terminal", "--no-record", "--baud", "3000000", "--send", "short.txt", "--port", text(deaf.path())];
    let ran = world.run(&args, b"");
    assert_eq!((ran.code, ran.out.as_str()), (Some(3), ""), "{}", ran.err);
    assert!(ran.err.contains("it has taken no byte for 5 s"), "{}", ran.err);
}

#[test]
fn what_comes_through_a_pipe_gets_the_line_ends_that_a_file_gets() {
    let table = [("cr", "m\rx\rs\r"), ("lf", "m\nx\ns\n"), ("crlf", "m\r\nx\r\ns\r\n"), ("keep", "m\nx\r\ns\r")];
    for (end, expected) in table {
        let world = World::new();
        let fake = echo();
        let notes = fake.notes.clone();
        let unit = host(fake);
        let args = ["terminal", "--no-record", "--newline-out", end, "--port", text(unit.serial())];
        let ran = world.run(&args, b"m\nx\r\ns\r");
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert_eq!(String::from_utf8_lossy(&got(&notes)), expected, "{end}");
    }
}
