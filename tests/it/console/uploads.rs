//! Uploads from the screen: refused, watched, cancelled, judged.

use super::*;

#[test]
fn an_older_version_is_refused_before_the_password_is_asked_for_and_goes_if_the_user_says_so() {
    let mut desk = Desk::new();
    desk.files.insert("/images/old.S".into(), image_of(Version::new(1, 0, 0)));
    desk.keys("lp/images/old.S").press(KeyCode::Enter);
    let plan = desk.picture();
    assert!(plan.contains("the image is V1.0.0, older than the V1.1.0 that the unit runs. O sends it"), "{plan}");
    desk.press(KeyCode::Enter);
    assert!(desk.picture().contains("Not started: the image is V1.0.0"), "{}", desk.picture());
    desk.keys("o ");
    let plan = desk.picture();
    assert!(plan.contains("passed in spite of downgrade") && plan.contains("Enter start"), "{plan}");
    desk.press(KeyCode::Enter).keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("1.0.0 afterwards");
}

#[test]
fn an_upload_goes_from_the_plan_to_the_new_banner() {
    let mut desk = Desk::new();
    desk.keys("lp/images/AXTC4CO_V1.2.0.elf.S").press(KeyCode::Enter);
    let plan = desk.picture();
    assert!(plan.contains("passed") && plan.contains("AXTC4CO 1.2.0 (newer)"), "{plan}");
    desk.press(KeyCode::Enter).keys("AXIO-2010");
    assert_eq!(desk.picture().matches("AXIO-2010").count(), 1, "in the hint for emulated units, not in the field");
    desk.press(KeyCode::Enter);
    desk.wait_for("50 %");
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("Done") && verdict.contains("1.1.0 before, 1.2.0 afterwards"), "{verdict}");
    assert_eq!(desk.unit.unit().flash()[..0xC000 * 2], flash_with(&full_image("1.2.0"))[..0xC000 * 2]);
    desk.press(KeyCode::Enter);
    assert!(desk.picture().contains("the same version again"), "{}", desk.picture());
}

#[test]
fn a_wrong_password_changes_nothing_and_says_so() {
    let mut desk = Desk::new();
    desk.about_to_load().keys("axio-2010").press(KeyCode::Enter);
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("The unit refused") && verdict.contains("1.1.0, as before"), "{verdict}");
}

#[test]
fn a_cancelled_upload_is_sent_again_and_nothing_is_asked_of_a_unit_that_was_never_away() {
    let mut desk = Desk::new();
    desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("20 %");
    desk.keys("q");
    assert!(desk.picture().contains("Leave axcon?"), "{}", desk.picture());
    desk.press(KeyCode::Esc).press(KeyCode::Esc);
    assert!(desk.picture().contains("Cancel the upload?"), "{}", desk.picture());
    desk.keys("y");
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("Cancelled") && verdict.contains("send the file again"), "{verdict}");
    desk.run(Duration::from_secs(5)).press(KeyCode::Enter).press(KeyCode::Enter);
    // It is the one that has said its name on this link: neither its label nor its password is asked for.
    let begun = desk.picture();
    assert!(begun.contains("── Loading") && !begun.contains('╭'), "{begun}");
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("1.2.0 afterwards"), "{verdict}");
    desk.keys("q");
    assert!(desk.over);
}

#[test]
fn a_question_that_an_upload_has_outrun_goes_with_it() {
    for key in [KeyCode::Char('q'), KeyCode::Esc] {
        let mut desk = Desk::new();
        desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
        desk.wait_for("50 %");
        desk.press(key);
        let asked = desk.picture();
        assert!(asked.contains("Leave axcon?") || asked.contains("Cancel the upload?"), "{asked}");
        let verdict = desk.wait_for("1.2.0 afterwards");
        assert!(verdict.contains("Done") && !verdict.contains("╭"), "{verdict}");
        desk.keys("q");
        assert!(desk.over, "there is nothing left to ask: {}", desk.picture());
    }
}

#[test]
fn a_unit_that_loses_its_power_in_an_upload_is_not_said_to_wait() {
    let mut desk = Desk::new();
    desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("20 %");
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("silent: in its loader, or without power"), "{verdict}");
    assert!(verdict.contains("│ silent, in loader? │") && verdict.contains("See that it has power"), "{verdict}");
}
