//! What the console says of a unit while it waits, restarts, is halted, or is gone.

use super::*;

/// The network writes an entry and saves all, as a configuration tool does.
fn configured(desk: &mut Desk, index: u16, sub: u8, value: f32) {
    let now = desk.now;
    let unit = desk.unit.unit_mut();
    let at = ObjectAddress::new(index, sub);
    let data_type = unit.product().dictionary.entry(at).expect("an entry").data_type;
    let value = match data_type.range() {
        None => Value::Real32(value),
        Some(_) => data_type.integer(value as i64).expect("in its range"),
    };
    unit.write_object(now, at, &value.encode()).expect("taken");
}

#[test]
fn a_slow_stream_keeps_nobody_waiting_for_its_first_row() {
    let mut desk = Desk::new();
    desk.keys("2t60000").press(KeyCode::Enter).run(Duration::from_secs(3));
    let told = desk.picture();
    assert!(told.contains("first row awaited") && told.contains("every 60 s"), "{told}");
    assert!(told.contains("The stream is on. Waiting for its first row."), "{told}");
    desk.keys("m").run(Duration::from_secs(3));
    assert!(desk.picture().contains("The unit is an AXTC4CO"), "{}", desk.picture());
    desk.keys("t");
    desk.wait_for("The stream is off.");
    assert!(desk.sent.ends_with(b"60000\r\x11mt"), "{}", desk.sent.escape_ascii());
    // Nor is there anything to leave in order.
    desk.keys("t60000").press(KeyCode::Enter).run(Duration::from_secs(3)).keys("q");
    assert!(desk.over, "{}", desk.picture());
}

#[test]
fn a_row_that_comes_late_proves_the_stream_all_the_same() {
    let mut desk = Desk::new();
    desk.keys("2t20000").press(KeyCode::Enter).run(Duration::from_secs(26));
    let told = desk.picture();
    assert!(told.contains("The stream is on, also after a power cycle") && told.contains("1 row"), "{told}");
}

#[test]
fn nothing_is_off_only_because_nobody_answers() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.run(Duration::from_secs(4)).keys("t").run(Duration::from_secs(5));
    let told = desk.picture();
    assert!(told.contains("No answer") && !told.contains("The stream is off."), "{told}");
}

#[test]
fn what_was_read_before_the_defaults_came_back_is_history() {
    let mut desk = Desk::new();
    configured(&mut desk, 0x4010, 2, 600.0);
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("1 not as factory");
    desk.keys("2t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.press(KeyCode::Down);
    assert!(desk.picture().contains("Limits of TC1") && desk.picture().contains("ok, high"), "{}", desk.picture());
    desk.keys("dYes").press(KeyCode::Enter);
    desk.wait_for("The defaults are restored");
    desk.run(Duration::from_secs(10));
    let told = desk.picture();
    assert!(told.contains("Limits: those read are from before the restart") && !told.contains("ok, high"), "{told}");
    desk.keys("5");
    assert!(desk.picture().contains("from before the restart"), "{}", desk.picture());
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    desk.keys("2").run(Duration::from_secs(2));
    assert!(desk.picture().contains("Limits of TC1"), "{}", desk.picture());
    // The same by hand.
    desk.keys("3d").run(Duration::from_secs(1)).keys("Yes").press(KeyCode::Enter).run(Duration::from_secs(5));
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("5");
    assert!(desk.picture().contains("from before the restart"), "{}", desk.picture());
}

#[test]
fn an_open_view_is_told_and_closed_with_m() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.keys("3v").run(Duration::from_secs(3)).key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("2");
    let told = desk.picture();
    assert!(told.contains("the view is open and halts the unit. M closes it."), "{told}");
    assert!(told.contains("view open, halted") && !told.contains("application runs"), "{told}");
    desk.sent.clear();
    for key in ["s", "t", "d", "v"] {
        desk.keys(key);
        assert!(desk.picture().contains("Not sent: the view is open"), "{key}: {}", desk.picture());
    }
    assert!(desk.sent.is_empty());
    desk.keys("m").run(Duration::from_secs(4));
    let told = desk.picture();
    assert!(told.contains("application runs") && !told.contains("M closes it"), "{told}");
}

#[test]
fn no_key_of_a_job_completes_an_answer_that_was_begun_by_hand() {
    let mut desk = Desk::new();
    desk.keys("3dYe").run(Duration::from_secs(1)).key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("2");
    assert!(desk.picture().contains("asks, see 3"), "{}", desk.picture());
    desk.sent.clear();
    desk.keys("s").run(Duration::from_secs(10));
    assert!(desk.picture().contains("the question after the D that was typed is still open"), "{}", desk.picture());
    for key in ["m", "v", "t", "d"] {
        desk.keys(key).run(Duration::from_secs(2));
        assert!(desk.picture().contains("the question after the D"), "{key}: {}", desk.picture());
    }
    assert!(desk.sent.is_empty(), "{:?}", desk.sent);
    desk.keys("q");
    assert!(desk.picture().contains("question after a key typed on the terminal"), "{}", desk.picture());
    desk.keys("n3").press(KeyCode::Enter).run(Duration::from_secs(3));
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("2m").run(Duration::from_secs(3));
    let told = desk.picture();
    assert!(told.contains("application runs") && !told.contains("asks, see 3"), "{told}");
    // The unit has not restarted: nothing has been restored.
    assert!(!desk.sent.is_empty());
}

#[test]
fn a_unit_in_its_loader_has_no_stream_to_switch_on() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.keys("3l").run(Duration::from_secs(1)).keys("AXIO-2010").press(KeyCode::Enter);
    desk.run(Duration::from_secs(3)).key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("2");
    let told = desk.picture();
    assert!(told.contains("waits in its loader") && told.contains("none, in the loader"), "{told}");
    assert!(told.contains("The unit is in its loader: these are its last values. L loads software."), "{told}");
    assert!(!told.contains("T switches it on"), "{told}");
}

#[test]
fn rows_that_the_line_has_no_room_for_are_no_page_of_diagnostics() {
    let mut desk = Desk::new();
    desk.keys("t1").press(KeyCode::Enter);
    desk.wait_for("every 1 ms");
    desk.keys("7s").run(Duration::from_secs(12));
    // A row has four semicolons.
    let page = desk.picture();
    assert!(page.contains("Supply Voltage") && page.contains("Active Errors"), "{page}");
    assert!(page.lines().all(|line| line.matches(';').count() < 4), "{page}");
    desk.keys("s").run(Duration::from_secs(4)).keys("2");
    let told = desk.picture();
    let labels = told.lines().find(|line| line.contains("Diagnosed")).unwrap_or_default();
    assert!(labels.contains("Active Errors") && labels.contains("Supply Voltage"), "{told}");
}

#[test]
fn a_power_cycle_and_a_loader_make_history_of_what_was_read() {
    let mut desk = Desk::new();
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.run(Duration::from_secs(2));
    let now = desk.now;
    desk.unit.unit_mut().power_on(now);
    desk.run(Duration::from_secs(5)).keys("5");
    assert!(desk.picture().contains("from before the restart"), "{}", desk.picture());
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    desk.keys("3l").run(Duration::from_secs(1)).keys("AXIO-2010").press(KeyCode::Enter);
    desk.run(Duration::from_secs(3)).key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("5");
    assert!(desk.picture().contains("from before the restart"), "{}", desk.picture());
}

#[test]
fn reading_the_dictionary_is_cancelled_by_esc_and_the_unit_measures_again() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.keys("v").press(KeyCode::Enter).run(Duration::from_secs(1));
    assert!(desk.picture().contains("reading: ") && desk.picture().contains("Esc cancel"), "{}", desk.picture());
    desk.keys("d");
    assert!(desk.picture().contains("Esc on its screen cancels that"), "{}", desk.picture());
    desk.press(KeyCode::Esc);
    desk.wait_for("Reading the object dictionary was cancelled.");
    assert!(desk.picture().contains("incomplete: "), "what was read of it is not all of it: {}", desk.picture());
    desk.run(Duration::from_secs(2)).keys("2");
    assert!(!desk.picture().contains("values are"), "{}", desk.picture());
}
