//! What is said to the user: what is old, what is not there, what cannot be done and why.

use ratatui::crossterm::event::KeyCode;

use super::stage::*;
use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::dump::Dump;
use crate::image::DefectId;
use crate::record::Span;
use crate::session::{
    Awaited, DictionaryReading, Event, Facts, Job, Known, LoadReport, Origin, Outcome, ReadEntry, UnitNow, UnitState,
    Verdict, WalkEnd,
};
use crate::tui::popup::ORDERS;
use crate::tui::{Effect, Input, LinkInfo, LinkKind};
use crate::wire::dictionary::{Reading, Shown};
use crate::wire::stream::Source;

/// Connected to an emulated unit that streams.
fn on_the_bench() -> Stage {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(BANNER).bytes(MENU).wait(3000);
    let mut stage = stage.with_rows();
    stage.keys("9");
    stage
}

#[test]
fn the_bench_calls_values_old_as_the_other_screens_do() {
    let mut stage = on_the_bench();
    assert!(stage.shows("newest row 12:01:33") && !stage.shows("old"), "{}", stage.picture());
    stage.wait(10_000);
    for screen in ["9", "2", "6"] {
        stage.keys(screen);
        assert!(stage.shows("No new row: these values are old."), "{}", stage.picture());
    }
    let mut stage = on_the_bench();
    stage.fold_with(Event::FactsChanged, &Facts { state: UnitState::Loader, ..Facts::default() });
    for screen in ["9", "2", "6"] {
        stage.keys(screen);
        assert!(stage.shows("is in its loader: these are its last values"), "{}", stage.picture());
    }
}

#[test]
fn a_stream_that_was_just_switched_on_is_waited_for_and_not_called_late() {
    let facts = |stream| Facts { stream, state: UnitState::Application, ..Facts::default() };
    let mut stage = Stage::streaming(SMALL);
    stage.fold_with(Event::FactsChanged, &facts(None));
    stage.wait(600_000).keys("2");
    assert!(stage.shows("The stream is off: these are its last values."), "{}", stage.picture());
    stage.fold_with(Event::FactsChanged, &facts(Some(Source::FieldValue)));
    assert!(stage.shows("no row has come yet, these values are from before."), "{}", stage.picture());
    stage.keys("6").wait(2000);
    assert!(stage.shows("no row has come yet, these values are from before."), "{}", stage.picture());
    stage.wait(10_000);
    assert!(stage.shows("No new row: these values are old."), "the stream had a row a second: {}", stage.picture());
    stage.bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
    assert!(!stage.shows("values are"), "{}", stage.picture());
}

#[test]
fn a_dictionary_from_before_a_restart_is_compared_with_nothing() {
    let mut stage = Stage::with_dictionary(SMALL);
    assert!(stage.shows("W with"), "{}", stage.picture());
    stage.fold_with(Event::FactsChanged, &Facts { state: UnitState::Loader, ..Facts::default() });
    assert!(stage.shows("from before the restart") && !stage.shows("W with"), "{}", stage.picture());
    stage.keys("w");
    assert!(stage.shows("V reads it again.") && !stage.shows("Compare with a saved"), "{}", stage.picture());
}

#[test]
fn a_heading_leaves_out_what_can_be_missed_before_what_cannot() {
    let mut stage = Stage::with_dictionary(SMALL);
    stage.input(Input::FileRead { path: "d1.json".into(), text: Ok(Dump::factory(axtc4co()).json()) });
    assert!(stage.shows("3 not as factory, only differences"), "{}", stage.picture());
    stage.keys("/threshold");
    assert!(stage.shows("with 'threshold'") && stage.shows("only differences"), "{}", stage.picture());
    stage.press(KeyCode::Enter).press(KeyCode::Esc).keys("o");
    assert!(stage.shows("3 of 227, 3 not as factory, 12:00:03, only those ──"), "{}", stage.picture());
    stage.resized(LARGE);
    assert!(stage.shows("3 of 227, 3 not as factory, 12:00:03, only those ──"), "{}", stage.picture());
}

#[test]
fn bits_are_compared_in_the_digits_they_are_read_in() {
    let mut stage = Stage::with_dictionary(SMALL);
    let mut dump = Dump::factory(axtc4co());
    let cob_id = dump.entries.iter_mut().find(|entry| entry.at() == ObjectAddress::new(0x1800, 1)).expect("there");
    cob_id.value = Some(0x8000_01FFu32.into());
    stage.input(Input::FileRead { path: "d1.json".into(), text: Ok(dump.json()) });
    let picture = stage.picture();
    let row = picture.lines().find(|line| line.contains("1800:01")).unwrap_or_default();
    assert!(row.contains("0x400001FF") && row.contains("0x800001FF"), "{picture}");
}

#[test]
fn a_unit_that_only_notes_know_is_named_as_what_it_may_be() {
    let stage = Stage::in_loader(SMALL, noted("AXTC4CO"));
    assert!(stage.shows(" axcon │ AXTC4CO? │ in loader │"), "{}", stage.picture());
    let stage = Stage::in_loader(SMALL, None);
    assert!(stage.shows(" axcon │ unknown unit │ in loader │"), "{}", stage.picture());
}

#[test]
fn a_path_of_nothing_is_refused_where_it_was_typed_and_can_be_corrected() {
    let mut stage = Stage::connected(SMALL).picking();
    stage.keys("pnew.S").press(KeyCode::Enter).asked();
    let unreadable = |why: &str| Input::ImageUnreadable { path: "/home/service/images/new.S".into(), why: why.into() };
    stage.input(unreadable("there is no such file"));
    let picture = stage.picture();
    assert!(picture.contains("There is no such file: /home/service/images/new.S"), "{picture}");
    assert!(picture.contains("› new.S") && !picture.contains("Software  "), "the box is still open: {picture}");
    stage.press(KeyCode::Backspace).keys("s19");
    assert!(!stage.shows("There is no such file"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    let path = "/home/service/images/new.s19".into();
    assert_eq!(stage.asked(), [Effect::CheckImage { path, loader: None, allow: Vec::new() }]);
    stage.input(unreadable("nobody waits for that any more"));
    assert!(!stage.shows("Nobody waits"), "{}", stage.picture());
    // One that was chosen and cannot be read.
    let mut stage = Stage::connected(SMALL).picking();
    stage.click("AXTC4CO_V1.1.0").click("AXTC4CO_V1.1.0");
    let path = "/home/service/images/AXTC4CO_V1.1.0.elf.S".into();
    stage.input(Input::ImageUnreadable { path, why: "it may not be read".into() });
    assert!(stage.shows("It may not be read: /home") && stage.shows("Not read"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Choose a file"), "{}", stage.picture());
}

#[test]
fn the_order_box_says_what_there_is_and_so_does_help() {
    let mut stage = on_the_bench();
    stage.keys("/").asked();
    for (orders, does) in ORDERS {
        assert!(stage.shows(&orders.join(", ")) && stage.shows(does), "{orders:?}: {}", stage.picture());
    }
    stage.keys("Help").press(KeyCode::Enter);
    assert!(stage.shows("They are above") && stage.shows("Enter do it"), "{}", stage.picture());
    assert_eq!(stage.asked(), []);
    stage.keys("heal").press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::Order("heal".into())], "the word itself is gone");
}

#[test]
fn a_key_is_named_as_it_is_pressed_on_the_terminal() {
    let mut stage = Stage::new(SMALL);
    stage.keys("3m");
    assert!(stage.shows("Press Ctrl-] 1 to choose a link."), "{}", stage.picture());
    stage.prefix().keys("1m");
    assert!(stage.shows("Press 1 to choose a link."), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").lost().keys("m");
    assert!(stage.shows("Press Ctrl-] C to connect") && stage.shows("Ctrl-] 1 lists links."), "{}", stage.picture());
}

#[test]
fn v_reads_no_dictionary_where_no_unit_is() {
    let mut stage = Stage::with_ports(SMALL);
    stage.keys("5");
    assert!(stage.shows("Not connected: press 1") && !stage.shows("V reads"), "{}", stage.picture());
    stage.keys("e");
    assert!(stage.shows("Nothing has been read. Not connected"), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL);
    stage.keys("5");
    assert!(stage.shows("V reads the unit's") && stage.shows("V reads it"), "{}", stage.picture());
    stage.keys("w");
    assert!(stage.shows("Nothing has been read yet: V reads"), "{}", stage.picture());
    stage.lost();
    assert!(!stage.shows("V reads it") && stage.shows("C connects again"), "{}", stage.picture());
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter);
    stage
        .input(Input::LinkOpened(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }))
        .bytes(BANNER)
        .keys("5");
    assert!(!stage.shows("V reads") && stage.shows("read it in this recording"), "{}", stage.picture());
}

#[test]
fn a_dictionary_that_is_being_read_is_nowhere_said_to_wait_for_v() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("v").press(KeyCode::Enter);
    assert!(stage.shows("reading: 0 so far") && stage.shows("Value       being read"), "{}", stage.picture());
    for key in ["e", "w"] {
        stage.keys(key);
        let picture = stage.picture();
        assert!(picture.contains("is being read: wait until") && !picture.contains("V reads"), "{key}: {picture}");
    }
}

#[test]
fn a_file_without_a_name_is_sound_named_once_and_goes_if_the_user_answers_for_it() {
    let facts = nameless_image(&[]);
    assert_eq!(facts.defects.iter().filter(|text| text.contains("no-identity")).count(), 1, "{:?}", facts.defects);
    let mut stage = Stage::connected(SMALL).with_image(facts);
    assert!(stage.shows("passed as a file, but it has no name, one finding"), "{}", stage.picture());
    assert!(
        stage.shows("does not say what it is. O sends it all the same.") && stage.shows("O override"),
        "{}",
        stage.picture()
    );
    stage.keys("o ");
    let allowed = nameless_image(&[DefectId::NoIdentity]);
    stage.input(Input::ImageChecked(Box::new(allowed)));
    assert!(stage.shows("passed in spite of no-identity") && stage.shows("Enter start"), "{}", stage.picture());
}

#[test]
fn a_dump_of_another_product_is_called_that() {
    let mut stage = Stage::with_dictionary(SMALL);
    for (product, is_other) in [("AXRTD8CO", true), ("AXTC4CO", false)] {
        let dump = Dump::factory(Product::named(product).expect("built in"));
        stage.input(Input::FileRead { path: "d1.json".into(), text: Ok(dump.json()) });
        assert_eq!(
            stage.shows("d1.json is of another product, an AXRTD8CO; this unit is"),
            is_other,
            "{}",
            stage.picture()
        );
        assert_eq!(stage.shows("dump of an AXRTD8CO"), is_other, "also when the word has gone: {}", stage.picture());
        assert!(stage.shows("  d1.json has"), "{}", stage.picture());
    }
}

#[test]
fn keys_that_do_nothing_now_are_not_offered_and_say_why() {
    let mut stage = Stage::with_ports(SMALL);
    assert!(!stage.shows("X close"), "{}", stage.picture());
    for (keys, offered, why) in [
        ("x", "X close", "No link is open."),
        ("6k", "K mark", "Nothing to mark: no unit is connected."),
        ("6e", "E export", "There are no rows to write to a file yet."),
        ("5w", "W with", "Nothing has been read."),
        ("8 ", "Space pause", "Nothing is being played."),
        ("9o", "O open", "No emulated unit is connected"),
    ] {
        stage.keys(keys);
        assert!(!stage.shows(offered) && stage.shows(why), "{keys}: {}", stage.picture());
    }
    let mut stage = Stage::streaming(SMALL);
    for (keys, offered) in [("1", "X close"), ("6", "K mark"), ("6", "E export")] {
        stage.keys(keys);
        assert!(stage.shows(offered), "{}", stage.picture());
    }
    let stage = Stage::with_ports(SMALL).with_image(good_image());
    assert!(!stage.shows("findings"), "{}", stage.picture());
}

#[test]
fn a_bench_whose_unit_is_gone_takes_no_orders_and_offers_a_new_one() {
    let mut stage = on_the_bench();
    assert!(stage.shows("O open") && !stage.shows("C new unit"), "{}", stage.picture());
    stage.lost().asked();
    assert!(!stage.shows("O open") && stage.shows("C new unit"), "{}", stage.picture());
    stage.keys("o").press(KeyCode::Enter);
    assert_eq!(stage.asked(), []);
    assert!(stage.shows("The emulated unit is gone with its link: C starts a new one."), "{}", stage.picture());
    stage.click("C new unit");
    assert!(stage.shows("as the factory made it"), "{}", stage.picture());
}

#[test]
fn e_says_what_it_does_while_rows_go_to_a_file() {
    let mut stage = Stage::streaming(SMALL);
    stage.keys("6");
    assert!(stage.shows("E export") && !stage.shows("E end export"), "{}", stage.picture());
    stage.keys("e").press(KeyCode::Enter).written();
    assert!(stage.shows("E end export"), "{}", stage.picture());
    stage.keys("e");
    assert!(stage.shows("E export") && !stage.shows("E end export"), "{}", stage.picture());
}

#[test]
fn a_word_that_is_not_true_any_more_goes() {
    let known = |facts: Facts| Facts { state: UnitState::Application, ..facts };
    let pages = || known(Facts { diagnostics: Some(Span::default()), ..Facts::default() });
    let streams = || known(Facts { stream: Some(Source::FieldValue), ..Facts::default() });
    let product = Known { value: "AXTC4CO".to_owned(), origin: Origin::Banner, span: Span::default() };
    let named = known(Facts { product: Some(product), ..Facts::default() });
    let no_page = Outcome::NoAnswer { job: Job::Diagnostics, awaited: Awaited::Page, heard: None };
    let cases = [
        (Outcome::Done(Job::Diagnostics), "The diagnostics are off.", pages(), streams()),
        (no_page, "no page of diagnostics came", pages(), streams()),
        (Outcome::Done(Job::StreamOff), "The stream is off.", streams(), pages()),
        (Outcome::Identified, "does not say what it is", named, pages()),
    ];
    for (outcome, word, refutes, says_nothing) in cases {
        let mut stage = Stage::with_ports(SMALL);
        stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
        stage.fold_with(Event::FactsChanged, &known(Facts::default())).finished(outcome).keys("");
        assert!(stage.shows(word), "{}", stage.picture());
        stage.fold_with(Event::FactsChanged, &says_nothing);
        assert!(stage.shows(word), "{}", stage.picture());
        stage.fold_with(Event::FactsChanged, &refutes);
        assert!(!stage.shows(word), "{}", stage.picture());
    }
}

#[test]
fn a_unit_that_does_not_answer_is_not_said_to_be_there() {
    let mut stage = Stage::streaming(SMALL);
    stage.fold_with(Event::FactsChanged, &Facts::default());
    for screen in ["2", "6"] {
        stage.keys(screen);
        assert!(stage.shows("has not answered: these are its last values"), "{}", stage.picture());
        assert!(!stage.shows("is back") && !stage.shows("T switches it"), "{}", stage.picture());
    }
}

#[test]
fn a_dictionary_that_was_never_read_has_no_deviations_and_says_so() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("5/temperature").press(KeyCode::Enter).keys("o");
    assert!(stage.shows("Nothing has been read of the unit"), "{}", stage.picture());
    assert!(!stage.shows("Nothing here matches"), "{}", stage.picture());
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").bytes(b"?\r\n").wait(5000);
    stage.keys("5");
    assert!(stage.shows("V reads its dictionary"), "{}", stage.picture());
    stage.keys("v").press(KeyCode::Enter);
    assert!(stage.shows("The dictionary is being read.") && !stage.shows("V reads its"), "{}", stage.picture());
}

#[test]
fn a_file_for_another_product_says_how_to_choose_another() {
    let mut facts = good_image();
    facts.product = Some("AXRTD8CO".into());
    let stage = Stage::connected(SMALL).with_image(facts);
    assert!(stage.shows("for an AXRTD8CO, the unit is an AXTC4CO. Esc"), "{}", stage.picture());
    assert!(stage.shows("chooses another."), "{}", stage.picture());
}

#[test]
fn a_value_over_its_shutdown_limit_is_no_ok_and_stands_with_the_faults() {
    let mut stage = Stage::with_dictionary(SMALL);
    stage.keys("2").bytes(b"  23.500; 300.000;  96.000; 110.000;Disabled\r\n");
    let picture = stage.picture();
    let row = picture.lines().find(|line| line.contains("TC1")).unwrap_or_default();
    assert!(row.contains("300.000 °C   over shutdown"), "{picture}");
    assert!(picture.contains("1 over shutdown") && picture.contains("300.0 °C, its shutdown limit"), "{picture}");
}

#[test]
fn packed_records_are_counted_before_they_are_sent() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    assert!(stage.shows("3,074 records, 242,742 characters") && stage.shows("K pack "), "{}", stage.picture());
    stage.keys("k");
    let picture = stage.picture();
    assert!(picture.contains("packed from 242,742") && picture.contains("K packed: on"), "{picture}");
    assert!(!picture.contains("3,074 records"), "{picture}");
}

#[test]
fn one_is_one_and_not_ones() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("v").press(KeyCode::Enter);
    let at = ObjectAddress::new(0x1001, 0);
    let reading = Some(Reading { shown: Shown::Nothing, numeral: "?".into(), plain: false });
    let entry = ReadEntry { at, text: "?".into(), span: Span::default(), reading };
    let ends =
        [(WalkEnd::Whole, "The dictionary is read: 1 entry, "), (WalkEnd::Stopped, "was shown: 1 entry was read.")];
    for (end, told) in ends {
        let reading = DictionaryReading { entries: vec![entry.clone()], end, unrecognised_lines: 0 };
        stage.finished(Outcome::DictionaryRead(Box::new(reading)));
        assert!(stage.shows(told), "{}", stage.picture());
    }
}

#[test]
fn minimum_and_maximum_do_not_restart_without_a_word() {
    let mut stage = Stage::streaming(SMALL);
    stage.keys("2r");
    assert!(stage.shows("Minimum, maximum and mean restart at 12:01:33."), "{}", stage.picture());
}

#[test]
fn t_is_refused_at_once_in_a_loader_also_while_it_is_asked_who_it_is() {
    let mut stage = Stage::in_loader(SMALL, None);
    stage.keys("m").keys("t");
    assert!(stage.shows("Not sent: the unit is in its loader") && !stage.shows("Every, in ms"), "{}", stage.picture());
}

#[test]
fn what_has_happened_in_an_upload_ends_with_a_full_stop() {
    for what in ["the unit did not accept the password", "It went wrong."] {
        let mut stage = Stage::connected(SMALL).with_image(good_image());
        let report = LoadReport { what: what.into(), ..report(Verdict::UnitRefused, UnitNow::Application) };
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report))));
        let picture = stage.picture();
        assert!(picture.lines().any(|line| line.contains("Happened") && line.ends_with('.')), "{picture}");
        assert!(!picture.contains(".."), "{picture}");
    }
}

#[test]
fn no_reading_on_all_channels_is_not_laid_to_the_sensors_alone() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").wait(1000);
    stage.bytes(b"Error ;Error ;Error ;Error ;Error ;Error ;Null  ;Null  \r\n");
    assert!(stage.shows("on all channels: converter or wiring"), "{}", stage.picture());
    stage.wait(1000).bytes(b"Error ;Error ;Error ;Error ;Error ;  20.0;Null  ;Null  \r\n");
    assert!(stage.shows("check sensor, wire and connector") && !stage.shows("converter"), "{}", stage.picture());
}

#[test]
fn a_process_value_that_may_stand_for_a_fault_says_so() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").wait(1000);
    stage.bytes(b"  -384;  4768;  4768;  4768;  4768;  4768;  4768;  4768\r\n");
    for screen in ["2", "6"] {
        stage.keys(screen);
        assert!(stage.shows("converter?"), "{}", stage.picture());
        assert!(stage.shows("RTD1: -384 marks a failed converter, or is a value; 6150h"), "{}", stage.picture());
    }
}

#[test]
fn the_text_beside_the_bytes_is_whole_with_times_at_80_columns() {
    let mut stage = Stage::connected(SMALL);
    stage.bytes(b"0123456789abcdef0123456789abcdef").keys("3").prefix().keys("h").prefix().keys("w");
    let picture = stage.picture();
    assert!(picture.contains("12:00:03") && picture.contains("789abcdef"), "{picture}");
    let last = picture.lines().rev().find(|line| line.contains("12:00:03")).expect("bytes");
    assert!(last.split("  ").last().is_some_and(|text| text.len() >= 8), "{picture}");
}

#[test]
fn a_path_used_before_that_depends_on_a_folder_says_so() {
    for (port, depends) in [("bench/tty", true), ("/tmp/tty", false), ("tcp://hall:4001", false)] {
        let mut stage = Stage::with_ports(SMALL);
        stage.recordings(vec![recording("2026-01-31 11:00:00", port, 1, None)]);
        (0..5).for_each(|_| {
            stage.press(KeyCode::Down);
        });
        assert!(stage.shows("Connected before"), "{port}: {}", stage.picture());
        assert_eq!(stage.shows("A path from the folder of that time"), depends, "{port}: {}", stage.picture());
    }
}
