//! The line's rate and flow control.

use std::fs;
use std::os::unix::fs::OpenOptionsExt;

use super::*;

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
    let fake = Fake { hold: Some((1, Duration::from_millis(300))), ..echo() };
    let notes = fake.notes.clone();
    let is_released = || notes.lock().expect("no panic").released;
    let unit = host(fake);
    let settings = serialport::new(text(unit.serial()), 115_200).flow_control(serialport::FlowControl::Software);
    let mut client = settings.timeout(Duration::from_millis(5)).open().expect("opened");
    // A driver that was stopped takes no more.
    wait_until("the client is held", || std::io::Write::write_all(&mut client, b"x").is_err());
    drop(client);
    assert!(!is_released(), "it went while it was held");
    wait_until("the unit lets go", is_released);
    let (connection, received) = connect(unit.serial(), 115_200);
    connection.send(*b"m").expect("sent");
    let mut heard = Vec::new();
    while !heard.ends_with(b"m") {
        heard.extend(receive(&received, 1));
    }
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
