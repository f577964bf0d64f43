//! Cables that are plugged in again, with the same unit at the other end or another.

use super::*;

/// A unit in the place of the one on the cable, just powered on.
fn swapped(desk: &mut Desk, product: &str, seed: u64) {
    let product = Product::named(product).expect("built in");
    let mut unit = Unit::new(axcon::host::unit::factory_setup(product, seed));
    unit.power_on(desk.now);
    desk.unit = Plugged::new(unit, Line::new(character_time(BAUD), Duration::from_millis(1)));
}

/// Streaming, with a fault, the object dictionary read, on the overview.
fn much_known() -> Desk {
    let mut desk = Desk::on_cable();
    swapped(&mut desk, "AXTC4CO", 1);
    desk.run(Duration::from_secs(5)).keys("mv").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    desk.keys("2t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    let now = desk.now;
    desk.unit.unit_mut().turn(now, Knob::Open(1, None)).expect("TC1");
    desk.wait_for("check sensor, wire and connector");
    desk
}

#[test]
fn the_same_unit_on_a_cable_plugged_in_again_goes_on() {
    let mut desk = much_known();
    desk.pull().input(Input::LinkBack(CABLE.into()));
    let asked = desk.picture();
    assert!(asked.contains("The unit is being asked who it is.") && asked.contains("Below is history"), "{asked}");
    let told = desk.wait_for("The link is back, and the AXTC4CO answers as before.");
    assert!(told.contains("1 when last seen, 1 since connecting") && !told.contains("Below is history"), "{told}");
    desk.keys("5");
    assert!(desk.picture().contains("0 not as factory"), "{}", desk.picture());
    assert_eq!(desk.marks, [""; 0]);
}

#[test]
fn another_product_on_a_cable_plugged_in_again_is_named_and_inherits_nothing() {
    let mut desk = much_known();
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL);
    desk.press(KeyCode::Esc).pull();
    swapped(&mut desk, "AXRTD8CO", 7);
    desk.plug_in();
    let told = desk.picture();
    let words = "Another unit is on the cable now: AXRTD8CO";
    assert!(told.contains(words) && told.contains("before it was AXTC4CO 1.1.0"), "{told}");
    assert!(!told.contains("TC1") && told.contains("None"), "neither values nor faults: {told}");
    assert!(desk.marks.iter().any(|mark| mark.contains(words)), "the recording says so, too: {:?}", desk.marks);
    desk.keys("5");
    let dictionary = desk.picture();
    assert!(dictionary.contains("the manual's; V reads the unit's"), "{dictionary}");
}

#[test]
fn another_unit_of_the_same_kind_is_known_by_its_serial_number() {
    let mut desk = much_known();
    desk.pull();
    swapped(&mut desk, "AXTC4CO", 99);
    desk.plug_in();
    assert!(desk.picture().contains("answers as before"), "they say the same: {}", desk.picture());
    desk.keys("v").press(KeyCode::Enter);
    let told = desk.wait_for("Another unit is on the cable: its serial number is");
    assert!(told.contains("0 not as factory"), "what was read is its own: {told}");
    desk.keys("2");
    assert!(!desk.picture().contains("since connecting"), "the fault was the other's: {}", desk.picture());
}

#[test]
fn nobody_on_a_cable_plugged_in_again_leaves_history_until_somebody_answers() {
    let mut desk = much_known();
    desk.pull();
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.plug_in();
    let silent = desk.picture();
    assert!(
        silent.contains("nobody has answered yet: M asks again") && silent.contains("Below is history"),
        "{silent}"
    );
    let now = desk.now;
    desk.unit.unit_mut().power_on(now);
    desk.wait_for("answers as before");
}

#[test]
fn a_unit_that_runs_in_the_place_of_one_left_half_loaded_is_another() {
    let mut desk = Desk::on_cable();
    desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("20 %");
    desk.pull();
    // The same product and version: only that it runs tells them apart.
    let flash = factory_flash("1.1.0");
    let setup =
        Setup { product: axtc4co(), loader: LoaderKind::G1, seed: 9, dialect: 0, flash, parameters: Vec::new() };
    let mut unit = Unit::new(setup);
    unit.power_on(desk.now);
    desk.unit = Plugged::new(unit, Line::new(character_time(BAUD), Duration::from_millis(1)));
    desk.plug_in();
    desk.run(Duration::from_secs(10));
    let told = desk.picture();
    assert!(told.contains("on the cable runs its software, which the unit that was left half loaded"), "{told}");
    assert!(!told.contains("as before") && !told.contains("Unit now"), "{told}");
    assert!(told.contains("Unit then") && told.contains("not of the unit that is there now"), "{told}");
    desk.press(KeyCode::Enter);
    assert!(desk.picture().contains("Our note"), "the first one is not forgotten: {}", desk.picture());
}
