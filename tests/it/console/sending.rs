//! Files sent from the terminal as they are.

use super::*;

/// Asked to send a file of this content from the terminal screen, the question answered with `answer`.
fn send_file<'a>(desk: &'a mut Desk, name: &str, bytes: &[u8], answer: &str) -> &'a mut Desk {
    desk.files.clear();
    desk.files.insert(name.into(), bytes.to_vec());
    desk.sent.clear();
    desk.keys("3").key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("f").press(KeyCode::Enter);
    desk.keys(answer)
}

#[test]
fn a_file_goes_from_the_terminal_to_the_unit_as_it_is() {
    let mut desk = Desk::new();
    send_file(&mut desk, "keys.txt", b"mm\n\xff", "");
    let question = desk.picture();
    assert!(question.contains("keys.txt, 4 bytes, goes to the unit as if typed."), "{question}");
    assert!(desk.sent.is_empty(), "nothing leaves before the answer");
    desk.keys("y");
    let told = desk.wait_for("Sent: all of keys.txt has left, 4 bytes.");
    assert!(told.contains("the file keys.txt is sent, 4 bytes"), "{told}");
    assert_eq!(desk.sent, b"mm\n\xff");
    assert_eq!(desk.marks, ["the file keys.txt is sent, 4 bytes"], "in the recording, too");
}

#[test]
fn an_image_sent_by_hand_is_warned_of_held_stopped_and_counted_truly() {
    let mut desk = Desk::new();
    let image = new_image();
    send_file(&mut desk, "new.S", &image, "l");
    assert!(desk.picture().contains("Choose a file"), "the load screen does it safely: {}", desk.picture());
    send_file(&mut desk, "new.S", &image, "");
    assert!(desk.picture().contains("It is a software image."), "{}", desk.picture());
    desk.keys("y").run(Duration::from_millis(500));
    // Some 11,520 bytes a second, whatever the unit says to them.
    assert!((4_000..7_000).contains(&desk.sent.len()), "{}", desk.sent.len());
    assert!(desk.picture().contains("Sending a file") && desk.picture().contains("Esc stops it"), "{}", desk.picture());
    desk.keys("m");
    assert!(desk.picture().contains("Not sent: axcon is still sending a file."), "{}", desk.picture());
    desk.keys("2v");
    assert!(desk.picture().contains("Not sent: "), "{}", desk.picture());
    // The unit stops us ...
    desk.input(Input::Bytes(vec![0x13]));
    let held = desk.sent.len();
    desk.run(Duration::from_secs(5));
    assert_eq!(desk.sent.len(), held, "nothing leaves while the unit holds us");
    desk.keys("3");
    assert!(desk.picture().contains("held by XOFF since"), "{}", desk.picture());
    // ... and lets us go on.
    desk.input(Input::Bytes(vec![0x11]));
    desk.run(Duration::from_millis(500)).press(KeyCode::Esc);
    let sent = desk.sent.len();
    assert!(sent > held && image.starts_with(&desk.sent), "{sent}");
    let told = desk.picture();
    let grouped = format!("{},{:03} of the 24", sent / 1000, sent % 1000);
    assert!(told.contains(&format!("Cancelled after {grouped}")), "{sent}: {told}");
    desk.run(Duration::from_secs(5));
    assert_eq!(desk.sent.len(), sent, "nothing more leaves");
}

#[test]
fn a_file_goes_alone_and_not_over_a_link_that_is_gone() {
    let mut desk = Desk::on_cable();
    desk.keys("s");
    desk.wait_for("page 1");
    send_file(&mut desk, "keys.txt", b"m", "");
    assert!(desk.picture().contains("Not sent: axcon is still reading the diagnostics."), "{}", desk.picture());
    assert!(desk.sent.is_empty());
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("2s").run(Duration::from_secs(3));
    send_file(&mut desk, "long.txt", &[b'x'; 100_000], "y").run(Duration::from_secs(1)).pull();
    let told = desk.picture();
    assert!(told.contains("The link was lost when about") && told.contains("of the 100,000 bytes"), "{told}");
}

#[test]
fn no_file_is_offered_to_a_unit_that_waits_for_its_password() {
    let mut desk = Desk::new();
    desk.keys("3").key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("3l");
    desk.run(Duration::from_secs(1));
    desk.sent.clear();
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("f");
    let told = desk.picture();
    assert!(told.contains("Not sent: the unit asks for a password") && !told.contains("Send a file"), "{told}");
    assert!(desk.sent.is_empty());
}

#[test]
fn a_password_in_a_file_is_recorded_by_its_number_only() {
    let mut desk = Desk::new();
    send_file(&mut desk, "load.txt", b"lAXIO-2010\r", "y").run(Duration::from_secs(3));
    assert_eq!(desk.sent, b"lAXIO-2010\r");
    let record = desk.app.record();
    let all: Vec<u8> = record.entries().flat_map(|entry| entry.bytes.to_vec()).collect();
    assert!(!String::from_utf8_lossy(&all).contains("AXIO"), "{}", String::from_utf8_lossy(&all));
}

#[test]
fn a_break_is_sent_once_and_the_next_key_goes_on_to_the_unit() {
    let mut desk = Desk::new();
    desk.keys("3").sent.clear();
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("b");
    assert_eq!((desk.breaks, desk.marks.clone()), (1, vec!["break sent".to_owned()]));
    assert!(desk.sent.is_empty() && desk.picture().contains("── break sent"), "{}", desk.picture());
    desk.keys("m");
    assert_eq!((desk.breaks, desk.sent.as_slice()), (1, &b"m"[..]));
}
