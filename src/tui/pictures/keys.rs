//! What keys, clicks and the mouse do, in sentences.

use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

use super::stage::*;
use crate::canopen::{ObjectAddress, Value};
use crate::endpoint::Transmit;
use crate::image::DefectId;
use crate::record::Span;
use crate::session::{DictionaryReading, Event, Facts, Job, Known, Origin, Outcome, ReadEntry};
use crate::time::Duration;
use crate::tui::{
    App, Effect, Failure, FileEntry, FileKind, ImageFacts, Input, LinkInfo, Options, Pace, Palette, Playback, Playing,
};
use crate::wire::stream::Source;

#[test]
fn connecting_asks_the_unit_who_it_is() {
    let mut stage = Stage::with_ports(SMALL);
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB0".into())]);
    stage.opened("/dev/ttyUSB0");
    stage.wait(10_000);
    let sent = stage.sent();
    assert!(sent.contains(&b'm'), "{sent:?}");
    assert!(!sent.iter().any(|byte| b"VvDdTtSsLl".contains(byte)), "nothing but the menu is asked for: {sent:?}");
}

#[test]
fn the_link_given_at_the_start_is_opened_at_once() {
    let mut app = App::new(Options {
        link: Some("emu:axtc4co".into()),
        directory: "/".into(),
        home: None,
        palette: Palette::Dark,
        size: SMALL,
    });
    assert_eq!(app.start(), [Effect::ListPorts, Effect::ListRecordings, Effect::OpenLink("emu:axtc4co".into())]);
}

#[test]
fn another_link_is_asked_about_and_opened_before_the_first_is_given_up() {
    let opens = |link: &str| Effect::OpenLink(link.into());
    let mut stage = Stage::connected(SMALL);
    stage.keys("1").press(KeyCode::Down).asked();
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Close the link?") && stage.shows("if that fails, the link stays"), "{}", stage.picture());
    stage.keys("n");
    assert_eq!(stage.asked(), [], "not without a yes");
    stage.press(KeyCode::Enter).keys("y");
    assert_eq!(stage.asked(), [opens("/dev/ttyUSB1")]);
    stage.input(Input::LinkFailed(Failure { text: "no such port".into(), hints: Vec::new() }));
    assert!(stage.shows("Not connected") && stage.shows("No such port"), "{}", stage.picture());
    stage.press(KeyCode::Enter).keys("2m");
    assert!(stage.shows("AXTC4CO 1.1.0") && stage.shows("/dev/ttyUSB0 │ connected"), "{}", stage.picture());
    assert!(stage.sent().ends_with(b"m"), "the first link goes on");
    stage.wait(3000).keys("1").press(KeyCode::Enter).keys("y").asked();
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [Effect::DoNotOpen]);
    stage.press(KeyCode::Enter).keys("y").lost();
    assert!(stage.shows("Opening /dev/ttyUSB1."), "the first may go meanwhile: {}", stage.picture());
    stage.opened("/dev/ttyUSB1");
    assert!(stage.shows("/dev/ttyUSB1 │ connected") && !stage.shows("AXTC4CO 1.1.0"), "{}", stage.picture());
    // The same port cannot be opened twice; a recording is asked about as well.
    stage.keys("1").press(KeyCode::Enter).keys("y");
    assert!(stage.asked().ends_with(&[Effect::CloseLink, opens("/dev/ttyUSB1")]));
    let mut stage = Stage::connected(SMALL).with_recordings();
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!((stage.asked(), stage.shows("Close the link?")), (Vec::new(), true), "{}", stage.picture());
}

#[test]
fn a_unit_in_its_loader_is_asked_for_no_password_and_an_empty_one_is_named() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    assert!(stage.shows("neither L nor a password") && stage.shows("Enter starts."), "{}", stage.picture());
    stage.asked();
    stage.press(KeyCode::Enter);
    assert!(stage.asked().iter().any(|effect| matches!(effect, Effect::UploadBegins { .. })), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter).press(KeyCode::Enter);
    assert!(stage.shows("The password is missing"), "{}", stage.picture());
    stage.keys("A");
    assert!(!stage.shows("The password is missing"), "{}", stage.picture());
}

#[test]
fn a_long_word_takes_two_lines_and_the_next_screen_ends_it() {
    let mut stage = Stage::connected(SMALL);
    let reason = "the unit does not show its object dictionary in the operational state: stop it".to_owned();
    stage.finished(Outcome::Refused { job: Job::ReadDictionary, reason, heard: None });
    assert!(stage.shows("The unit refused") && stage.shows("state: stop it"), "{}", stage.picture());
    stage.keys("2");
    assert!(stage.shows("The unit refused"), "it is the same screen: {}", stage.picture());
    stage.keys("5");
    assert!(!stage.shows("The unit refused"), "{}", stage.picture());
}

#[test]
fn faults_are_in_sight_with_their_times_and_the_list_of_them_is_scrolled() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
    let row = |stage: &mut Stage, open: &[usize]| {
        let values = (0..8).map(|n| if open.contains(&n) { "Open  ".to_owned() } else { format!("{:6.1}", 20.5) });
        let row = values.collect::<Vec<_>>().join(";") + "\r\n";
        stage.wait(1000).bytes(row.as_bytes());
    };
    for open in [&[] as &[usize], &[1], &[], &[2], &[], &[3], &[3], &[3, 6]] {
        row(&mut stage, open);
    }
    let picture = stage.picture();
    for line in ["RTD4 ", "RTD7 "] {
        let rows: Vec<_> = picture.lines().filter(|row| row.contains(line)).collect();
        assert_eq!(rows.len(), 2, "in the values and below them: {picture}");
        assert!(rows.iter().all(|row| row.contains("open circuit") && row.contains("since 12:00:")), "{picture}");
    }
    assert!(stage.shows("2 now, 4 since connecting, ↓ 2 more, PgDn"), "{picture}");
    stage.press(KeyCode::PageDown);
    assert!(stage.shows("RTD2    open circuit   over, 12:00:0"), "{}", stage.picture());
    assert!(stage.shows("↑ 2 more"), "{}", stage.picture());
    stage.press(KeyCode::PageDown).press(KeyCode::PageUp);
    assert!(stage.shows("↓ 2 more"), "what cannot be scrolled is not: {}", stage.picture());
}

#[test]
fn what_cannot_be_done_is_said_in_words_and_with_the_files_name() {
    let mut stage = Stage::with_dictionary(SMALL);
    for text in [Err("no such file".to_owned()), Ok("nonsense".to_owned())] {
        stage.input(Input::FileRead { path: "old.json".into(), text });
        assert!(stage.shows("Not compared: old.json"), "{}", stage.picture());
    }
    stage.keys("3v").asked();
    assert!(stage.shows("Not sent: axcon is still reading the object dictionary."), "{}", stage.picture());
}

#[test]
fn a_curve_is_not_drawn_across_an_outage() {
    let mut stage = Stage::streaming(SMALL);
    stage.wait(20_000).bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
    let trend = stage.picture().lines().find(|line| line.contains("TC1 ")).map(str::to_owned);
    let trend: String = trend.unwrap_or_default().chars().rev().take(2).collect();
    assert!(trend.ends_with(' '), "a gap before the newest value: {}", stage.picture());
}

#[test]
fn the_period_shown_is_the_one_that_was_set() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("t20").press(KeyCode::Enter);
    let facts = Facts { stream: Some(Source::FieldValue), ..Facts::default() };
    stage.fold_with(Event::FactsChanged, &facts);
    stage.fold_with(Event::Finished(Outcome::StreamRuns { was_on: false }), &facts);
    for _ in 0..20 {
        stage.wait(19).bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
    }
    assert!(stage.shows("every 20 ms"), "{}", stage.picture());
}

#[test]
fn errors_stand_first_in_what_the_diagnostics_say() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("s").wait(2000);
    let page = b"Diagnostics\r\n Supply Voltage Source Current: 24.02 mA\r\n Cold Junction Temperature: 24.5 C\r\n\
        \x20Active Errors: 3\r\n";
    stage.bytes(page).wait(1500).bytes(page).wait(1500).keys("2");
    assert!(stage.shows("Diagnosed   Active Errors 3, Supply"), "{}", stage.picture());
}

#[test]
fn a_dictionary_of_no_known_product_is_compared_with_nothing_until_it_is_known() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").keys("5");
    let at = ObjectAddress::new(0x6110, 2);
    let value = Some(Value::Unsigned16(2));
    let entry = ReadEntry { at, value, text: "type = 2".into(), span: Span::default(), known: true };
    let reading = DictionaryReading { entries: vec![entry], complete: true, unrecognised_lines: 0 };
    stage.finished(Outcome::DictionaryRead(Box::new(reading)));
    assert!(stage.shows("1 of 1, compared with nothing") && !stage.shows("not as"), "{}", stage.picture());
    stage.keys("o");
    assert!(stage.shows("Compared with nothing: the unit has not said"), "{}", stage.picture());
    let product = Known { value: "AXTC4CO".to_owned(), origin: Origin::Menu, span: Span::default() };
    stage.fold_with(Event::FactsChanged, &Facts { product: Some(product), ..Facts::default() });
    assert!(stage.shows("1 not as factory") && stage.shows("Thermocouple Sensor"), "{}", stage.picture());
}

#[test]
fn a_lost_link_is_opened_again_by_c_and_the_terminal_keeps_its_lines() {
    let mut stage = Stage::connected(SMALL);
    stage.lost().asked();
    stage.keys("c");
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB0".into())]);
    stage.opened("/dev/ttyUSB0");
    stage.keys("3");
    assert!(stage.shows("Software Version V1.1.0") && stage.shows("link lost"), "{}", stage.picture());
}

#[test]
fn a_recording_is_steered_by_its_keys() {
    let mut stage = Stage::with_ports(SMALL).with_recordings();
    stage.keys(" +").press(KeyCode::Left);
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("replay:/home/user/2026-01-31 11:00:00.cast".into())]);
    stage.input(Input::LinkOpened(LinkInfo {
        link: "replay:x".into(),
        baud: 115_200,
        read_only: true,
        noted: None,
        recording: None,
        start_of_day: NOON,
        start_millis: 0,
    }));
    let seconds = Duration::from_secs;
    let plays = |stage: &mut Stage, position, pace| {
        stage.input(Input::Playing(Playing { position: seconds(position), length: Some(seconds(100)), pace }));
        stage.asked();
    };
    plays(&mut stage, 50, Pace::Times(5));
    for (key, wanted) in [
        (KeyCode::Char(' '), Playback::Pace(Pace::Paused)),
        (KeyCode::Char('+'), Playback::Pace(Pace::Times(10))),
        (KeyCode::Char('-'), Playback::Pace(Pace::Times(2))),
        (KeyCode::Left, Playback::Seek(seconds(40))),
        (KeyCode::Right, Playback::Seek(seconds(60))),
        (KeyCode::Home, Playback::Seek(seconds(0))),
        (KeyCode::End, Playback::Seek(seconds(100))),
    ] {
        stage.press(key);
        assert_eq!(stage.asked(), [Effect::Play(wanted)]);
    }
    plays(&mut stage, 50, Pace::Paused);
    stage.keys(" ");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Pace(Pace::Times(5)))], "as fast as before the pause");
    plays(&mut stage, 100, Pace::AtOnce);
    plays(&mut stage, 100, Pace::Paused);
    stage.keys(" ");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Again(Pace::Times(1)))], "from the beginning");
}

#[test]
fn a_click_is_the_key_it_stands_on_and_the_wheel_moves() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_dictionary(size);
        let click = |stage: &mut Stage, kind, text: &str| {
            let picture = stage.picture();
            let (row, line) = picture.lines().enumerate().find(|(_, line)| line.contains(text)).expect(text);
            let column = line.split(text).next().map_or(0, |before| before.chars().count()) as u16 + 1;
            let mouse = MouseEvent { kind, column, row: row as u16, modifiers: KeyModifiers::NONE };
            stage.input(Input::Terminal(TerminalEvent::Mouse(mouse)));
        };
        let left = MouseEventKind::Down(MouseButton::Left);
        click(&mut stage, MouseEventKind::ScrollDown, "Object");
        assert!(stage.shows("› "), "{}", stage.picture());
        assert!(stage.shows("1001:00 Error Register"), "{}", stage.picture());
        for (tab, shows) in
            [("6 Stream", "The stream is off"), ("8 Rec", "Looking for recordings"), ("5 Dict", "Object")]
        {
            click(&mut stage, left, tab);
            assert!(stage.shows(shows), "{}", stage.picture());
        }
        click(&mut stage, left, "T stream");
        assert!(stage.shows("Switch the data stream on"), "{}", stage.picture());
        click(&mut stage, left, "5 Dict");
        assert!(stage.shows("Switch the data stream on"), "a question wants an answer first");
    }
}

#[test]
fn rows_go_on_to_their_file_when_the_same_link_is_back_and_end_with_another() {
    let row = b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n";
    let appended = |stage: &mut Stage| {
        stage.wait(1000).bytes(row);
        stage.asked().iter().any(|effect| matches!(effect, Effect::AppendFile { .. }))
    };
    let mut stage = Stage::streaming(SMALL);
    stage.keys("6e").press(KeyCode::Enter).asked();
    assert!(appended(&mut stage));
    stage.lost().keys("c").opened("/dev/ttyUSB0");
    assert!(appended(&mut stage), "the same link");
    stage.wait(10_000).keys("1").press(KeyCode::Down).press(KeyCode::Enter).keys("y");
    stage.opened("/dev/ttyUSB1");
    assert!(!appended(&mut stage), "another unit's rows are not mixed in");
}

#[test]
fn only_an_emulated_unit_is_given_orders() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("9");
    stage.asked();
    stage.keys("ohp").press(KeyCode::Right).press(KeyCode::Enter);
    assert_eq!(stage.asked(), []);
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("EMU:AXTC4CO");
    stage.keys("9").asked();
    stage.press(KeyCode::Down).press(KeyCode::Enter).keys("x").press(KeyCode::Enter);
    assert!(stage.shows("A number of degrees"), "{}", stage.picture());
    stage.press(KeyCode::Backspace).keys("451.5").press(KeyCode::Enter);
    stage.input(Input::Ordered { line: "set 2 temperature 451.5".into(), answer: Ok(None) });
    stage.press(KeyCode::Left).keys("p");
    let order = |line: &str| Effect::Order(line.into());
    assert_eq!(
        stage.asked(),
        [order("set 2 temperature 451.5"), order("set 2 temperature 441.5"), order("power cycle 1")]
    );
}

#[test]
fn menu_keys_do_what_the_manual_says_in_either_case() {
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("S").wait(2000);
    assert_eq!(stage.sent(), b"s");
    assert!(stage.shows("Waiting for the unit's first page"), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("v");
    assert_eq!(stage.sent(), b"", "V halts scanning: it is asked first");
    stage.keys("t");
    assert_eq!(stage.sent(), b"v");
    assert!(stage.shows("halted by V"));
    stage.keys("x");
    assert_eq!(stage.sent(), b"x");
    assert!(!stage.shows("halted by V"));
}

#[test]
fn leaving_with_the_view_open_offers_to_close_it() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("vt").prefix().keys("2q");
    stage.asked();
    stage.press(KeyCode::Enter);
    let effects = stage.asked();
    assert_eq!(effects, [Effect::Transmit(Transmit::open(*b"x")), Effect::Quit]);
}

#[test]
fn a_view_opened_by_a_typed_key_is_asked_about_on_every_way_out_and_closed() {
    for way in ["q", "1x"] {
        let mut stage = Stage::connected(SMALL);
        stage.keys("3v").sent();
        assert!(stage.shows("halted by V"), "{}", stage.picture());
        stage.prefix().keys("2").keys(way);
        assert!(stage.shows("The unit's view is open"), "{way}: {}", stage.picture());
        stage.keys("y");
        let effects = stage.asked();
        assert_eq!(effects.first(), Some(&Effect::Transmit(Transmit::open(*b"x"))), "{way}");
        assert!(matches!(effects.last(), Some(Effect::Quit | Effect::CloseLink)), "{way}: {effects:?}");
    }
    let mut stage = Stage::connected(SMALL);
    stage.keys("3vx").prefix().keys("q");
    assert_eq!(stage.asked().last(), Some(&Effect::Quit), "it was closed again: nothing to ask");
}

#[test]
fn a_silent_unit_holds_a_signal_for_two_seconds_and_q_for_none() {
    let reading = || {
        let mut stage = Stage::connected(SMALL);
        stage.keys("v").press(KeyCode::Enter).wait(200).asked();
        stage.input(Input::Signal);
        assert!(!stage.effects.contains(&Effect::Quit), "the unit is left in order first");
        stage
    };
    let mut stage = reading();
    stage.wait(1999);
    assert!(!stage.effects.contains(&Effect::Quit));
    stage.wait(1);
    assert!(stage.effects.contains(&Effect::Quit));
    let mut stage = reading();
    assert!(stage.shows("Leaving the unit in order"), "{}", stage.picture());
    stage.keys("q");
    assert!(stage.effects.contains(&Effect::Quit));
    let mut stage = reading();
    stage.lost();
    assert!(stage.effects.contains(&Effect::Quit), "nobody is there to wait for");
}

#[test]
fn another_link_is_opened_once_the_first_has_been_left_in_order() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3v").prefix().keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    stage.asked();
    assert!(stage.shows("/dev/ttyUSB1 is opened first"), "{}", stage.picture());
    stage.keys("y");
    let opens = Effect::OpenLink("/dev/ttyUSB1".into());
    assert_eq!(stage.asked(), [Effect::Transmit(Transmit::open(*b"x")), opens]);
}

#[test]
fn ctrl_z_stops_the_program_but_not_in_the_middle_of_a_job() {
    let ctrl_z = |stage: &mut Stage| {
        stage.asked();
        stage.key(KeyCode::Char('z'), KeyModifiers::CONTROL).asked()
    };
    assert_eq!(ctrl_z(&mut Stage::connected(SMALL)), [Effect::Suspend]);
    assert_eq!(ctrl_z(&mut typed(Stage::connected(SMALL), "t")), [Effect::Suspend], "also in front of a question");
    let mut stage = Stage::loading(SMALL);
    assert_eq!(ctrl_z(&mut stage), []);
    assert!(stage.shows("Not stopped: a job runs."), "{}", stage.picture());
    let mut stage = typed(Stage::connected(SMALL), "3");
    assert_eq!(ctrl_z(&mut stage), [Effect::Transmit(Transmit::open([0x1a]))], "the bare terminal passes it on");
}

#[test]
fn an_upload_is_noted_once_it_is_taken_and_before_its_first_byte() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("── Loading"), "the note spares the label: {}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter).keys("AXIO-2010").asked();
    stage.press(KeyCode::Enter);
    let effects = stage.asked();
    let note = effects
        .iter()
        .position(|effect| matches!(effect, Effect::UploadBegins { product, .. } if product == "AXTC4CO"));
    let first = effects.iter().position(|effect| matches!(effect, Effect::Transmit(_)));
    assert!(note.is_some() && (first.is_none() || note < first), "{effects:?}");
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
fn defaults_are_restored_only_after_yes_written_like_this() {
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("dyes").press(KeyCode::Enter);
    stage.wait(1000);
    assert_eq!(stage.sent(), b"");
    stage.key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("Yes").press(KeyCode::Enter);
    assert_eq!(stage.sent(), b"d");
}

#[test]
fn t_switches_a_running_stream_off_and_asks_before_it_switches_one_on() {
    let mut stage = Stage::streaming(SMALL);
    stage.sent();
    stage.keys("t");
    assert_eq!(stage.sent(), b"t");
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("t");
    assert_eq!(stage.sent(), b"");
    assert!(stage.shows("field value, object 6100h"));
    stage.press(KeyCode::Esc);
    assert!(!stage.shows("field value, object 6100h"));
}

#[test]
fn letters_typed_into_a_question_are_no_commands() {
    let mut stage = Stage::with_ports(SMALL);
    stage.asked();
    stage.keys("pq1?lt");
    assert_eq!(stage.asked(), []);
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("q1?lt".into())]);
}

#[test]
fn on_the_terminal_screen_letters_go_to_the_unit_and_the_prefix_takes_one_back() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    stage.keys("q1").press(KeyCode::Enter).press(KeyCode::Left).press(KeyCode::Up).press(KeyCode::Tab);
    assert_eq!(stage.sent(), b"q1\r\t");
    stage.prefix().keys("q");
    assert_eq!(stage.asked(), [Effect::Quit]);
    stage.prefix().prefix();
    assert_eq!(stage.sent(), b"\x1d");
}

#[test]
fn pasted_text_goes_to_the_unit_only_after_a_yes() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    stage.input(Input::Terminal(TerminalEvent::Paste("m\n\x1b[D\n".into())));
    assert_eq!(stage.sent(), b"");
    stage.keys("y");
    assert_eq!(stage.sent(), b"m\r[D\r", "the escape character is not passed on");
}

#[test]
fn the_terminal_stays_where_it_was_scrolled_to_while_more_comes() {
    let mut stage = Stage::connected(SMALL);
    (0..100).for_each(|n| {
        stage.bytes(format!("line {n}\r\n").as_bytes());
    });
    stage.keys("3").press(KeyCode::PageUp);
    assert!(stage.shows("stopped") && !stage.shows("line 99"));
    let stopped = stage.picture();
    let place = stopped.lines().nth(10).map(str::to_owned);
    stage.bytes(b"more\r\n");
    assert_eq!(stage.picture().lines().nth(10).map(str::to_owned), place);
    stage.press(KeyCode::End);
    assert!(stage.shows("follows") && stage.shows("more"));
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
    assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images".into())]);
    let bad = FileEntry { name: "bad".into(), kind: FileKind::Folder, bytes: 0, begins: Vec::new(), modified: None };
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(vec![bad]) });
    assert!(stage.shows("› bad/"));
}

#[test]
fn nothing_a_unit_sends_reaches_the_screen_as_a_control_code() {
    let mut stage = Stage::connected(LARGE);
    let every: Vec<u8> = (0..=255).collect();
    stage.bytes(&every).bytes(b"\r\n");
    for keys in ["2", "3"] {
        stage.keys(keys);
        assert!(stage.picture().chars().all(|character| character == '\n' || !character.is_control()));
    }
    stage.prefix().keys("h");
    assert!(stage.picture().chars().all(|character| character == '\n' || !character.is_control()));
}

#[test]
fn an_idle_console_wants_nothing_and_draws_nothing() {
    let mut stage = Stage::connected(SMALL);
    stage.wait(60_000);
    // The overview says how old the CANopen state is: now once a minute.
    let due = stage.app.poll_timeout().expect("an age");
    stage.app.drawn();
    stage.wait(due.since(stage.now).as_millis() as u64);
    assert!(stage.app.is_dirty() && stage.shows("pre-operational, 2 min ago"), "{}", stage.picture());
    assert!(stage.app.poll_timeout().is_some_and(|next| next == due + Duration::from_secs(60)));
    // Nothing else ages.
    stage.keys("4");
    stage.wait(60_000);
    stage.app.drawn();
    assert_eq!(stage.app.poll_timeout(), None);
    stage.input(Input::Timeout);
    stage.input(Input::Terminal(TerminalEvent::FocusGained));
    assert!(!stage.app.is_dirty());
    let mut release = KeyEvent::new(KeyCode::Char('2'), KeyModifiers::NONE);
    release.kind = KeyEventKind::Release;
    stage.input(Input::Terminal(TerminalEvent::Key(release)));
    assert!(!stage.app.is_dirty(), "the release of a key is not a key");
    stage.keys("3");
    assert!(stage.app.is_dirty());
}

#[test]
fn a_signal_ends_the_program_without_a_question() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("m").asked();
    stage.input(Input::Signal);
    assert_eq!(stage.asked(), [Effect::Quit]);
}

/// The screens with something chosen, and what stands on the chosen row.
fn scenes_with_a_choice() -> [(&'static str, Stage); 4] {
    let mut with_ports = Stage::with_ports(SMALL);
    with_ports.press(KeyCode::Down);
    [
        ("› /dev/ttyUSB1", with_ports),
        ("› bad/", pressed(Stage::connected(SMALL).picking(), KeyCode::Down)),
        ("› ", pressed(Stage::with_dictionary(SMALL), KeyCode::Down)),
        ("› 2026-01-31", Stage::with_ports(SMALL).with_recordings()),
    ]
}

#[test]
fn what_is_chosen_is_seen_without_colours_and_colours_are_those_of_the_ground() {
    use ratatui::style::{Color, Modifier};
    for (words, mut stage) in scenes_with_a_choice() {
        let colours_of = |stage: &Stage| {
            let buffer = stage.draw().buffer().clone();
            let mut colours: Vec<Color> = buffer.content().iter().flat_map(|cell| [cell.fg, cell.bg]).collect();
            colours.dedup();
            colours.retain(|colour| *colour != Color::Reset);
            colours
        };
        assert_eq!(colours_of(&stage), [], "{words}: none without colours");
        let picture = stage.picture();
        let row = picture.lines().position(|line| line.contains(words)).expect(words);
        let buffer = stage.draw().buffer().clone();
        let cells = &buffer.content()[row * usize::from(SMALL.0)..][4..20];
        assert!(cells.iter().all(|cell| cell.modifier.contains(Modifier::REVERSED)), "{words} has its bar");
        stage.press(KeyCode::F(2));
        let dark = colours_of(&stage);
        stage.press(KeyCode::F(2));
        let light = colours_of(&stage);
        assert!(dark.contains(&Color::Cyan) && !light.is_empty(), "{words}: {dark:?} {light:?}");
        let pale = [Color::Yellow, Color::Cyan, Color::White, Color::Gray];
        assert!(!light.iter().any(|colour| pale.contains(colour)), "{words}: {light:?} on a light ground");
        assert!(stage.shows("Colours: for a light ground."), "{}", stage.picture());
    }
}

#[test]
fn a_link_that_takes_long_to_open_is_given_up_by_esc() {
    let mut stage = pressed(Stage::with_ports(SMALL), KeyCode::Enter);
    stage.asked();
    assert!(stage.shows("Opening /dev/ttyUSB0.") && stage.shows("Esc do not wait"), "{}", stage.picture());
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [Effect::CloseLink]);
    stage.press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB1".into())], "another can be chosen");
}

#[test]
fn a_click_chooses_an_entry_of_a_list_and_a_second_one_does_it() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_ports(size);
        stage.asked();
        stage.click("/dev/ttyUSB1");
        assert_eq!((stage.asked(), stage.shows("› /dev/ttyUSB1")), (Vec::new(), true), "{}", stage.picture());
        stage.click("/dev/ttyUSB1");
        assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB1".into())]);
        let mut stage = Stage::connected(size).picking();
        stage.asked();
        stage.click("bad/").click("bad/");
        assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images/bad".into())]);
        let mut stage = Stage::with_ports(size).with_recordings();
        stage.asked();
        stage.click("2026-01-30").click("2026-01-30");
        assert_eq!(stage.asked(), [Effect::OpenLink("replay:/home/user/2026-01-30 09:15:00.cast".into())]);
        let mut stage = Stage::with_dictionary(size);
        stage.click("1003:00");
        assert!(
            stage.picture().lines().any(|line| line.contains("› ") && line.contains("1003:00")),
            "{}",
            stage.picture()
        );
    }
}

#[test]
fn a_break_is_sent_by_its_key_and_stands_between_the_lines_and_in_the_recording() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").asked();
    stage.prefix().keys("b");
    assert_eq!(stage.asked(), [Effect::Break]);
    stage.input(Input::BreakSent(Ok(())));
    assert_eq!(stage.asked(), [Effect::Mark("break sent".into())]);
    assert!(stage.shows("── break sent"), "{}", stage.picture());
    stage.input(Input::BreakSent(Err("this link cannot send one".into())));
    assert!(stage.shows("No break sent: this link cannot send one."), "{}", stage.picture());
}

#[test]
fn long_records_are_chosen_with_a_key_and_the_plan_says_so() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    assert!(stage.shows("K pack") && !stage.shows("in long records"), "{}", stage.picture());
    stage.keys("k");
    assert!(stage.shows("in long records"), "{}", stage.picture());
}

#[test]
fn an_error_is_allowed_by_its_name_in_one_file_only_and_the_plan_says_so() {
    let mut stage = Stage::connected(SMALL).with_image(bad_image());
    stage.keys("obad-character").press(KeyCode::Enter);
    assert!(stage.shows("part of the program unknown"), "{}", stage.picture());
    let faulty = ImageFacts { ok: false, checked: None, errors: vec![DefectId::IdentityCrc], ..good_image() };
    let path = faulty.path.clone();
    let mut stage = Stage::connected(SMALL).with_image(faulty);
    assert!(stage.shows("O override"), "{}", stage.picture());
    stage.asked();
    stage.keys("o");
    assert!(stage.shows("waits in its loader") && stage.shows("identity-crc"), "{}", stage.picture());
    stage.keys("identity-crc").press(KeyCode::Enter);
    let allow = vec![DefectId::IdentityCrc];
    assert_eq!(stage.asked(), [Effect::CheckImage { path: path.clone(), loader: None, allow: allow.clone() }]);
    stage.input(Input::ImageChecked(Box::new(ImageFacts { allowed: allow, ..good_image() })));
    assert!(stage.shows("passed in spite of identity-crc"), "{}", stage.picture());
    stage.keys("p/other.S").press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::CheckImage { path: "/other.S".into(), loader: None, allow: Vec::new() }]);
}
