//! What leads to an upload and what prevents it, in sentences.

use ratatui::crossterm::event::KeyCode;

use super::stage::*;
use crate::image::DefectId;
use crate::record::Span;
use crate::session::{Event, Facts, Known, LoadReport, Origin, Outcome, UnitNow, UnitState, Verdict};
use crate::tui::{Effect, FileEntry, FileKind, ImageFacts, Input, LinkInfo, Noted};
use crate::version::Version;

#[test]
fn a_unit_in_its_loader_is_asked_for_no_password_and_an_empty_one_is_named() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    assert!(stage.shows("neither L nor a password"), "{}", stage.picture());
    stage.asked();
    stage.press(KeyCode::Enter).keys("y");
    assert!(stage.asked().iter().any(|effect| matches!(effect, Effect::UploadBegins { .. })), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter).press(KeyCode::Enter);
    assert!(stage.shows("The password is missing"), "{}", stage.picture());
    stage.keys("A");
    assert!(!stage.shows("The password is missing"), "{}", stage.picture());
}

#[test]
fn an_upload_is_noted_once_it_is_taken_and_before_its_first_byte() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    stage.press(KeyCode::Enter).keys("y");
    assert!(stage.shows("── Loading"), "the note spares the label: {}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter).keys("AXIO-2010").asked();
    stage.press(KeyCode::Enter);
    let effects = stage.asked();
    let note = effects
        .iter()
        .position(|effect| matches!(effect, Effect::UploadBegins { noted, .. } if noted.product == "AXTC4CO"));
    let first = effects.iter().position(|effect| matches!(effect, Effect::Transmit(_)));
    assert!(note.is_some() && (first.is_none() || note < first), "{effects:?}");
}

#[test]
fn only_y_gives_an_upload_up() {
    for key in [KeyCode::Esc, KeyCode::Char('q')] {
        let mut stage = Stage::loading(SMALL);
        stage.press(key).asked();
        assert!(stage.shows("Y cancel the upload") || stage.shows("Y leave"), "{}", stage.picture());
        let question = stage.picture();
        stage.press(KeyCode::Enter);
        assert_eq!((stage.asked(), stage.picture()), (Vec::new(), question), "pressed out of habit");
        stage.keys("n");
        assert!(stage.asked().is_empty() && stage.shows("── Loading"), "{}", stage.picture());
    }
}

#[test]
fn leaving_a_unit_in_its_loader_says_what_it_waits_for() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO"));
    stage.asked();
    stage.keys("q");
    assert!(stage.shows("waits in its loader for a file") && stage.shows("sent again (L)"), "{}", stage.picture());
    stage.keys("n").resized((60, 10)).keys("q");
    assert!(stage.asked().is_empty() && stage.shows("Leave axcon?"), "{}", stage.picture());
    stage.keys("y");
    assert_eq!(stage.asked(), [Effect::Quit]);
}

#[test]
fn a_question_about_an_upload_says_what_is_true_once_it_has_ended_or_goes_with_it() {
    let ended = |unit| Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, unit))));
    let mut stage = Stage::loading(SMALL);
    stage.keys("q");
    assert!(stage.shows("Leave axcon?") && stage.shows("New software is being loaded."), "{}", stage.picture());
    stage.fold(ended(UnitNow::Application));
    assert!(stage.shows("── Verdict") && !stage.shows("Leave axcon?"), "{}", stage.picture());
    let mut stage = Stage::loading(SMALL);
    let in_loader = Facts { state: UnitState::Loader, ..Facts::default() };
    stage.keys("q").fold_with(Event::FactsChanged, &in_loader).fold_with(ended(UnitNow::Loader), &in_loader);
    assert!(stage.shows("Leave axcon?") && stage.shows("The unit waits in its loader"), "{}", stage.picture());
}

#[test]
fn findings_that_are_all_in_sight_are_not_offered_to_be_moved() {
    let stage = Stage::connected(SMALL).with_image(nameless_image(&[]));
    assert!(stage.shows("one finding") && !stage.shows("↑↓ findings"), "{}", stage.picture());
    let stage = Stage::connected(SMALL).with_image(bad_image());
    assert!(stage.shows("↑↓ findings"), "{}", stage.picture());
}

#[test]
fn the_end_of_every_finding_can_be_read() {
    let facts = bad_image();
    let last = facts.defects.last().and_then(|text| text.split_whitespace().last()).expect("findings").to_owned();
    let mut stage = Stage::connected(SMALL).with_image(facts.clone());
    let mut seen = stage.picture();
    for _ in 0..200 {
        stage.press(KeyCode::Down);
        seen.push_str(&stage.picture());
    }
    for defect in &facts.defects {
        for word in defect.split_whitespace() {
            assert!(seen.contains(word), "no '{word}' of '{defect}'");
        }
    }
    assert!(stage.shows(&last), "{}", stage.picture());
    let end = stage.picture();
    stage.press(KeyCode::Up);
    assert_ne!(stage.picture(), end, "one step back is one line");
}

#[test]
fn an_upload_cannot_start_while_anything_stands_against_it() {
    let cases = [
        (bad_image(), "the file has errors"),
        (ImageFacts { product: Some("AXRTD8CO".into()), ..good_image() }, "the file is for an AXRTD8CO"),
    ];
    for (facts, why) in cases {
        let mut stage = Stage::connected(SMALL).with_image(facts);
        stage.sent();
        assert!(stage.shows(why), "{}", stage.picture());
        stage.press(KeyCode::Enter);
        assert!(!stage.shows("Password"));
        assert_eq!(stage.sent(), b"");
    }
    let mut stage = Stage::with_ports(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("no unit is connected") && !stage.shows("Password"));
}

#[test]
fn an_answer_about_a_file_nobody_waits_for_is_ignored() {
    let mut stage = Stage::connected(SMALL).picking();
    stage.input(Input::ImageChecked(Box::new(good_image())));
    assert!(stage.shows("Choose a file"));
}

#[test]
fn folders_are_walked_and_the_way_back_finds_the_folder_again() {
    let mut stage = Stage::connected(SMALL).picking();
    stage.asked();
    stage.press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images/bad".into())]);
    stage.input(Input::FilesListed { directory: "/home/service/images/bad".into(), entries: Ok(Vec::new()) });
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [], "Esc leaves something, and this is where one came to");
    assert!(stage.shows("Backspace folder above"), "{}", stage.picture());
    stage.press(KeyCode::Backspace);
    assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images".into())]);
    let bad = FileEntry { name: "bad".into(), kind: FileKind::Folder, bytes: 0, begins: Vec::new(), modified: None };
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(vec![bad]) });
    assert!(stage.shows("› bad/"));
}

#[test]
fn long_records_are_chosen_with_a_key_and_the_plan_says_so() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    assert!(stage.shows("K pack") && !stage.shows("in records of another length"), "{}", stage.picture());
    stage.keys("k");
    assert!(stage.shows("in records of another length"), "{}", stage.picture());
}

#[test]
fn an_error_is_allowed_by_its_name_in_one_file_only_and_the_plan_says_so() {
    let mut stage = Stage::connected(SMALL).with_image(bad_image());
    stage.keys("o ");
    assert!(stage.shows("part of the program unknown"), "{}", stage.picture());
    let faulty = ImageFacts { ok: false, checked: None, errors: vec![DefectId::IdentityCrc], ..good_image() };
    let path = faulty.path.clone();
    let mut stage = Stage::connected(SMALL).with_image(faulty);
    assert!(stage.shows("O override"), "{}", stage.picture());
    stage.asked();
    stage.keys("o");
    assert!(stage.shows("waits in its loader") && stage.shows("identity-crc"), "{}", stage.picture());
    // A password typed from habit begins like this: nothing of it is shown, and nothing comes of it.
    stage.keys("-2010y").press(KeyCode::Enter);
    assert!(stage.asked().is_empty() && stage.shows("› identity-crc") && !stage.shows("2010"), "{}", stage.picture());
    stage.keys(" ");
    let allow = vec![DefectId::IdentityCrc];
    assert_eq!(stage.asked(), [Effect::CheckImage { path: path.clone(), loader: None, allow: allow.clone() }]);
    stage.input(Input::ImageChecked(Box::new(ImageFacts { allowed: allow, ..good_image() })));
    assert!(stage.shows("passed in spite of identity-crc"), "{}", stage.picture());
    stage.keys("p/other.S").press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::CheckImage { path: "/other.S".into(), loader: None, allow: Vec::new() }]);
}

#[test]
fn what_an_override_means_is_said_of_the_chosen_error() {
    let mut stage = report_beside(SMALL, "AXTC4CO", Some(Version::new(1, 10, 0)));
    stage.keys("o");
    assert!(stage.shows("The file is sound, but older") && !stage.shows("not what was built"), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(nameless_image(&[]));
    stage.keys("o");
    assert!(stage.shows("does not say what it is: nobody can see"), "{}", stage.picture());
    let faulty = ImageFacts {
        ok: false,
        checked: None,
        errors: vec![DefectId::IdentityCrc, DefectId::BadChecksum],
        ..good_image()
    };
    let path = faulty.path.clone();
    let mut stage = Stage::connected(SMALL).with_image(faulty);
    stage.keys("o").press(KeyCode::Down).press(KeyCode::Down).asked();
    assert!(stage.shows("› bad-checksum") && stage.shows("not what was built"), "{}", stage.picture());
    stage.press(KeyCode::Up).press(KeyCode::Down).keys(" ");
    assert_eq!(stage.asked(), [Effect::CheckImage { path, loader: None, allow: vec![DefectId::BadChecksum] }]);
}

#[test]
fn a_note_starts_nothing_before_somebody_has_said_that_it_is_that_unit() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    assert!(stage.shows("Enter asks whether it is that unit."), "{}", stage.picture());
    stage.asked();
    stage.press(KeyCode::Enter).press(KeyCode::Enter).press(KeyCode::Enter);
    let asked = stage.picture();
    for words in ["Is it the unit this was begun for?", "AXTC4CO_V1.2.0.elf.S", "2026-01-30 16:20:00", "Its label"] {
        assert!(asked.contains(words), "{words}: {asked}");
    }
    assert_eq!(stage.asked(), [], "Enter is not an answer");
    stage.press(KeyCode::Esc);
    assert!(stage.shows("── Plan") && stage.asked().is_empty(), "{}", stage.picture());
    stage.press(KeyCode::Enter).keys("n");
    assert!(stage.asked().is_empty() && stage.shows("Which product is the unit?"), "{}", stage.picture());
    stage.keys("axtc4co").press(KeyCode::Enter);
    let begins = |effect: &Effect| matches!(effect, Effect::UploadBegins { noted, .. } if noted.product == "AXTC4CO");
    assert!(stage.asked().iter().any(begins), "noted as the product is written: {}", stage.picture());
}

#[test]
fn a_note_that_is_wrong_locks_no_file_out() {
    let mut stage = Stage::in_loader(SMALL, noted("AXRTD8CO")).with_image(good_image());
    assert!(stage.shows("our note says AXRTD8CO") && stage.shows("N other unit"), "{}", stage.picture());
    stage.keys("n");
    assert!(stage.shows("Which product is the unit?"), "{}", stage.picture());
    stage.press(KeyCode::Esc);
    assert!(stage.shows("is set aside: another unit") && !stage.shows("N other unit"), "{}", stage.picture());
    assert!(stage.shows("not known; its label says which") && !stage.shows("asked first"), "{}", stage.picture());
    stage.press(KeyCode::Enter).asked();
    stage.keys("AXTC4CO").press(KeyCode::Enter);
    assert!(stage.asked().iter().any(|effect| matches!(effect, Effect::UploadBegins { .. })), "{}", stage.picture());
}

#[test]
fn a_product_that_does_not_exist_is_refused_and_can_be_corrected() {
    for word in ["tc4", "/images/AXTC4CO.S"] {
        let mut stage = Stage::in_loader(SMALL, None).with_image(good_image());
        stage.press(KeyCode::Enter).keys(word).press(KeyCode::Enter);
        assert!(stage.shows("There is no such product. Those there are: AXTC4CO, AXRTD8CO."), "{}", stage.picture());
        assert!(stage.shows(&format!("› {word}")) && !stage.shows("another product:"), "{}", stage.picture());
    }
    let mut stage = Stage::in_loader(SMALL, None).with_image(good_image());
    stage.press(KeyCode::Enter).keys("axrtd8co").press(KeyCode::Enter);
    assert!(stage.shows("The file is for another product"), "{}", stage.picture());
}

#[test]
fn what_is_compared_with_is_named() {
    let noted = noted("AXTC4CO").map(|noted| Noted { ran: Some(Version::new(1, 1, 0)), ..noted });
    let stage = Stage::in_loader(SMALL, noted).with_image(good_image());
    assert!(stage.shows("Unit now    AXTC4CO 1.1.0 by our note, before"), "{}", stage.picture());
}

#[test]
fn a_unit_that_has_fallen_silent_is_not_said_to_wait() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    let in_loader = Facts { state: UnitState::Loader, ..Facts::default() };
    stage.fold_with(Event::FactsChanged, &in_loader);
    let failed = || Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Loader))));
    stage.bytes(b".").wait(1000).fold_with(failed(), &in_loader);
    assert!(stage.shows("waits in its loader") && stage.shows("│ in loader │"), "{}", stage.picture());
    stage.wait(2000).fold_with(failed(), &in_loader);
    let silent = stage.picture();
    assert!(silent.contains("Unit now    silent: in its loader, or without power"), "{silent}");
    assert!(silent.contains("See that it has power") && silent.contains("│ silent, in loader? │"), "{silent}");
    stage.bytes(b"\x11");
    assert!(!stage.shows("silent"), "{}", stage.picture());
}

#[test]
fn a_unit_whose_link_is_lost_in_the_middle_is_not_said_to_wait() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.bytes(b".").lost().finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Loader))));
    let doubts = |picture: &str| {
        picture.contains("Unit now    in its loader, or without power") && picture.contains("See that it has power")
    };
    assert!(doubts(&stage.picture()) && !stage.shows("Keep the unit powered"), "{}", stage.picture());
    // Nobody has answered yet on the link that is back.
    stage.input(Input::LinkBack("/dev/ttyUSB0".into()));
    assert!(doubts(&stage.picture()), "{}", stage.picture());
}

#[test]
fn nothing_is_said_to_be_sent_of_a_file_that_was_not_counted_yet() {
    let mut stage = Stage::loading(SMALL);
    stage.wait(1000).lost();
    assert!(stage.shows("before anything was changed") && !stage.shows("Sent  "), "{}", stage.picture());
}

#[test]
fn the_versions_of_an_upload_are_told_as_far_as_they_are_known() {
    let known = |patch: Option<u16>| patch.map(|patch| Version::new(1, 1, patch));
    for (before, after, words) in [
        (Some(0), Some(1), "1.1.0 before, 1.1.1 afterwards"),
        (Some(0), None, "1.1.0 before, unknown afterwards"),
        (None, Some(1), "unknown before, 1.1.1 afterwards"),
        (None, None, "unknown\n"),
    ] {
        let versions = (known(before), known(after));
        let report = LoadReport {
            version_before: versions.0,
            version_after: versions.1,
            ..report(Verdict::Failed, UnitNow::Loader)
        };
        let mut stage = Stage::connected(SMALL).with_image(good_image());
        stage.finished(Outcome::Loaded(Box::new(report)));
        assert!(stage.shows(&format!("Version     {words}")), "{}", stage.picture());
    }
}

#[test]
fn a_note_about_another_unit_stays_in_sight_beside_one_that_runs() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter);
    stage.input(Input::LinkOpened(LinkInfo { noted: noted("AXTC4CO"), ..link_info("/dev/ttyUSB0") }));
    stage.bytes(BANNER).bytes(MENU).wait(3000);
    let mut stage = stage.with_image(good_image());
    assert!(stage.shows("Our note    AXTC4CO_V1.2.0.elf.S was begun here for an AXTC4CO"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Password"), "what the unit says goes first: {}", stage.picture());
}

#[test]
fn enter_says_what_stands_against_an_upload() {
    let mut stage = Stage::with_ports(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Not started: no unit is connected. Press 1 to choose a link."), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(bad_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Not started: the file has errors"), "{}", stage.picture());
}

#[test]
fn what_stood_against_one_file_is_not_said_of_the_next() {
    let for_another = ImageFacts { product: Some("AXRTD8CO".into()), ..good_image() };
    let mut stage = Stage::connected(SMALL).with_image(for_another);
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Not started: the file is for an AXRTD8CO"), "{}", stage.picture());
    stage.press(KeyCode::Esc);
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
    stage.click("AXTC4CO_V1.1.0").click("AXTC4CO_V1.1.0");
    let path = "/home/service/images/AXTC4CO_V1.1.0.elf.S".into();
    stage.input(Input::ImageChecked(Box::new(ImageFacts { path, ..good_image() })));
    assert!(stage.shows("Enter start") && !stage.shows("Not started"), "{}", stage.picture());
}

/// A unit of this product that runs this version, or says nothing of it; the file is V1.2.0.
fn report_beside(size: (u16, u16), product: &str, version: Option<Version>) -> Stage {
    let mut stage = Stage::connected(size).with_image(good_image());
    let known = |value: String| Known { value, origin: Origin::Menu, span: Span::default() };
    let version = version.map(|value| Known { value, origin: Origin::Menu, span: Span::default() });
    let product = Some(known(product.to_owned()));
    stage
        .fold_with(Event::FactsChanged, &Facts { state: UnitState::Application, product, version, ..Facts::default() });
    stage
}

#[test]
fn what_stands_against_an_upload_can_be_read_to_its_end() {
    let stage = report_beside(SMALL, "AXTC4CO", Some(Version::new(1, 10, 0)));
    let picture = stage.picture();
    for word in "Cannot start: the image is V1.2.0, older than the V1.10.0 that the unit runs. O sends it all the same."
        .split(' ')
    {
        assert!(picture.contains(word), "no '{word}': {picture}");
    }
    assert!(picture.contains("(older: a downgrade)"), "{picture}");
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.keys("k");
    assert!(stage.shows("the loader needs."), "{}", stage.picture());
}

#[test]
fn a_version_that_nobody_knows_is_remarked_upon() {
    let remark = "Note        Nobody knows which version the unit has: the file may be older.";
    for size in [SMALL, LARGE] {
        let stage = report_beside(size, "AXTC4CO", None);
        assert!(stage.shows(remark) && stage.shows("(cannot be compared)"), "{}", stage.picture());
        let stage = report_beside(size, "AXTC4CO", Some(Version::new(1, 1, 0)));
        assert!(!stage.shows("Note") && stage.shows("(newer)"), "{}", stage.picture());
        let stage = report_beside(size, "AXRTD8CO", None);
        assert!(!stage.shows("Note") && stage.shows("Cannot start"), "another product: {}", stage.picture());
        let stage = Stage::connected(size).with_image(nameless_image(&[DefectId::NoIdentity]));
        assert!(stage.shows("The file does not say its version"), "{}", stage.picture());
        // What the note of an upload knows is compared with.
        let noted = noted("AXTC4CO").map(|noted| Noted { ran: Some(Version::new(1, 1, 0)), ..noted });
        let stage = Stage::in_loader(size, noted).with_image(good_image());
        assert!(!stage.shows("Note") && stage.shows("(newer)"), "{}", stage.picture());
    }
}

#[test]
fn what_to_do_next_stands_below_any_number_of_words_of_the_unit() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.bytes(b"noise");
    let report = LoadReport { heard: "\u{9b}noise ".repeat(200), ..report(Verdict::Failed, UnitNow::Loader) };
    stage.fold(Event::Finished(Outcome::Loaded(Box::new(report))));
    assert!(
        stage.shows("What next   Keep the unit powered") && stage.shows("back to the loader."),
        "{}",
        stage.picture()
    );
    assert!(stage.shows("Heard  ") && stage.shows(" …") && stage.shows("Enter goes back"), "{}", stage.picture());
}

#[test]
fn all_findings_can_be_reached_while_the_link_is_lost() {
    let mut stage = Stage::connected(SMALL).with_image(bad_image());
    stage.lost().press(KeyCode::End);
    assert!(stage.shows("── Findings ──") && !stage.shows("more line"), "{}", stage.picture());
}
