//! What the console makes of values: in files, with their age, in physical units, and what it counts as text.

use axcon::emulator::NmtCommand;
use axcon::emulator::scenario::Verb;
use axcon::tui::ORDERS;

use super::*;

#[test]
fn marks_that_were_set_before_an_export_stand_between_its_rows() {
    let mut desk = Desk::new();
    desk.keys("6k").keys("t1000").press(KeyCode::Enter);
    desk.wait_for("every 1 s");
    desk.run(Duration::from_secs(5)).keys("k").run(Duration::from_secs(5)).keys("k");
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("rows.csv").press(KeyCode::Enter);
    let text = String::from_utf8(desk.files[Path::new("rows.csv")].clone()).expect("text");
    let kinds: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split(',').nth(1)).collect();
    let marks: Vec<&&str> = kinds.iter().filter(|kind| **kind != "fv").collect();
    assert_eq!(marks, [&"mark 2", &"mark 3"], "the first mark has no row before it: {text}");
    assert!(kinds.first() == Some(&"fv") && kinds.iter().position(|kind| *kind == "mark 2") > Some(4), "{text}");
    assert!(text.lines().skip(1).map(|line| &line[..24]).is_sorted(), "{text}");
}

#[test]
fn what_answers_a_key_is_not_a_text_that_nobody_understands() {
    let mut desk = Desk::new();
    let other_text = |desk: &mut Desk| {
        desk.keys("2");
        let picture = desk.drawn();
        let line = picture.lines().find(|line| line.contains("Other text")).expect("the line");
        line.split("Other text").nth(1).expect("what it says").trim().to_owned()
    };
    assert_eq!(other_text(&mut desk), "none", "the menu and its titles");
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.keys("t");
    desk.wait_for("The stream is off.");
    assert_eq!(other_text(&mut desk), "none", "a switch with its questions");
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    assert_eq!(other_text(&mut desk), "none", "the object dictionary");
    desk.keys("s").run(Duration::from_secs(10)).keys("s").run(Duration::from_secs(3));
    assert_eq!(other_text(&mut desk), "none", "pages of diagnostics");
    // The same by hand.
    desk.keys("3s").run(Duration::from_secs(10)).keys("sv").run(Duration::from_secs(2));
    desk.press(KeyCode::Enter).press(KeyCode::Enter).keys("xt").run(Duration::from_secs(2)).press(KeyCode::Enter);
    desk.run(Duration::from_secs(5)).key(KeyCode::Char('5'), KeyModifiers::CONTROL);
    assert_eq!(other_text(&mut desk), "none", "no matter who pressed the keys");
}

#[test]
fn a_canopen_state_is_told_with_its_age_until_it_is_heard_again() {
    let mut desk = Desk::new();
    desk.keys("m").run(Duration::from_secs(3));
    assert!(desk.picture().contains("pre-operational (menu)  "), "{}", desk.picture());
    let now = desk.now;
    desk.unit.unit_mut().nmt(now, NmtCommand::Start);
    desk.wait_for("pre-operational (menu), 10 s ago");
    desk.wait_for("pre-operational (menu), 40 s ago");
    desk.wait_for("pre-operational (menu), 1 min ago");
    desk.keys("m").run(Duration::from_secs(1));
    assert!(desk.drawn().contains("CANopen     operational (menu)\n"), "{}", desk.drawn());
}

#[test]
fn a_threshold_is_shown_in_degrees_and_found_by_either_number() {
    let mut desk = Desk::new();
    let now = desk.now;
    let (at, value) = (ObjectAddress::new(0x4000, 2), Value::Integer16(-155));
    desk.unit.unit_mut().write_object(now, at, &value.encode()).expect("written");
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("1 not as factory");
    for words in ["-15.5", "-155"] {
        desk.keys("/").keys(words).press(KeyCode::Enter);
        let picture = desk.drawn();
        assert!(picture.contains("* 4000:02  Low Temperature Warning Threshold, TC2"), "{picture}");
        assert!(picture.contains(" -15.5 °C ") && picture.contains(" -20.0"), "{picture}");
        assert!(picture.contains("Value       -15.5 °C (raw -155); not as the factory made it"), "{picture}");
        assert!(picture.contains("Factory     -20.0 °C"), "{picture}");
        assert!(picture.contains("INTEGER16, read and write, -273.0 to 4010:02 - 10.0 °C"), "{picture}");
        desk.press(KeyCode::Esc);
    }
    // What is written to files is what the unit keeps.
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("a.csv").press(KeyCode::Enter);
    let text = String::from_utf8_lossy(&desk.files[Path::new("a.csv")]).into_owned();
    assert!(text.contains("-155,") && !text.contains("-15.5"), "{text}");
}

#[test]
fn every_order_that_the_bench_shows_is_one_that_the_emulator_takes() {
    for product in Product::all() {
        for order in ORDERS.iter().flat_map(|(orders, _)| *orders) {
            if let Err(error) = Verb::read(order, product) {
                panic!("{}: {order}: {error}", product.name);
            }
        }
    }
}

#[test]
fn the_bench_of_a_unit_without_power_or_in_its_loader_shows_no_old_value_as_live() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.run(Duration::from_secs(3)).keys("9");
    let live = desk.picture();
    assert!(live.contains("newest row") && !live.contains("old"), "{live}");
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.wait_for("these values are old");
    let now = desk.now;
    desk.unit.unit_mut().power_on(now);
    desk.run(Duration::from_secs(5));
    assert!(!desk.picture().contains("old"), "{}", desk.picture());
    desk.keys("3lAXIO-2010").press(KeyCode::Enter).run(Duration::from_secs(10));
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("9");
    assert!(desk.picture().contains("these are its last values"), "{}", desk.picture());
}
