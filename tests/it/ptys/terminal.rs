//! The plain terminal, on a terminal and without.

use std::fs;

use super::*;

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
