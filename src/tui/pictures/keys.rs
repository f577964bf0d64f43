//! What keys, clicks and the mouse do, in sentences.

use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

use super::stage::*;
use crate::canopen::{ObjectAddress, Value};
use crate::record::Span;
use crate::session::{DictionaryReading, Event, Facts, Job, Known, Origin, Outcome, ReadEntry, WalkEnd};
use crate::time::Duration;
use crate::tui::{Effect, Input, LinkInfo, LinkKind, Pace, Playback, Playing};
use crate::wire::dictionary::{Reading, Shown};
use crate::wire::stream::Source;

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
    let reading = Reading { shown: Shown::Value(Value::Unsigned16(2)), numeral: "2".into(), plain: true };
    let entry = ReadEntry { at, text: "type = 2".into(), span: Span::default(), reading: Some(reading) };
    let reading = DictionaryReading { entries: vec![entry], end: WalkEnd::Whole, unrecognised_lines: 0 };
    stage.finished(Outcome::DictionaryRead(Box::new(reading)));
    assert!(stage.shows("1 of 1, compared with nothing") && !stage.shows("not as"), "{}", stage.picture());
    stage.keys("o");
    assert!(stage.shows("Compared with nothing: the unit has not said"), "{}", stage.picture());
    let product = Known { value: "AXTC4CO".to_owned(), origin: Origin::Menu, span: Span::default() };
    stage.fold_with(Event::FactsChanged, &Facts { product: Some(product), ..Facts::default() });
    assert!(stage.shows("1 not as factory") && stage.shows("Thermocouple Sensor"), "{}", stage.picture());
}

#[test]
fn a_recording_is_steered_by_its_keys() {
    let mut stage = Stage::with_ports(SMALL).with_recordings();
    stage.keys(" +").press(KeyCode::Left);
    stage.asked();
    stage.press(KeyCode::Enter);
    let file = cast_file("2026-01-31 11:00:00", "/dev/ttyUSB0", 1);
    assert_eq!(stage.asked(), [Effect::OpenLink(format!("replay:{file}"))]);
    stage.input(Input::LinkOpened(LinkInfo {
        link: "replay:x".into(),
        baud: 115_200,
        kind: LinkKind::Recording,
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
    // Where every recording is that has just been opened, and one that was played to its end.
    for pace in [Pace::AtOnce, Pace::Times(1), Pace::Paused] {
        plays(&mut stage, 100, pace);
        stage.keys(" ");
        assert_eq!(stage.asked(), [Effect::Play(Playback::Again(Pace::Times(1)))], "from the beginning, {pace:?}");
    }
    // There + and - say how fast Space will play it, which is in sight.
    plays(&mut stage, 100, Pace::AtOnce);
    assert!(stage.shows("Space plays it, as fast as it was (+ -)."), "{}", stage.picture());
    assert!(stage.shows("Space play ") && !stage.shows("Space pause"), "{}", stage.picture());
    stage.keys("+");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Pace(Pace::Times(2)))]);
    plays(&mut stage, 100, Pace::Times(60));
    assert!(stage.shows("Space plays it, 60 times as fast (+ -)."), "{}", stage.picture());
    stage.keys("+");
    assert_eq!(stage.asked(), [], "at once would show what is there already");
    stage.keys(" ");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Again(Pace::Times(60)))]);
    // It is being written while it is played.
    plays(&mut stage, 101, Pace::Times(1));
    assert!(stage.shows("1:41 of 1:41"), "{}", stage.picture());
    stage.input(Input::Playing(Playing { position: seconds(0), length: Some(seconds(3600)), pace: Pace::Paused }));
    assert!(stage.shows("Arrows move 36 s"), "{}", stage.picture());
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
            [("6 Stream", "has sent no values"), ("8 Rec", "Looking for recordings"), ("5 Dict", "Object")]
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

/// The screens with something chosen, and what is on the chosen row.
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
        let file = cast_file("2026-01-30 09:15:00", "rfc2217://terminal-server-in-hall-4:4001", 2);
        assert_eq!(stage.asked(), [Effect::OpenLink(format!("replay:{file}"))]);
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
fn keys_on_the_terminal_of_a_recording_are_the_consoles() {
    let mut stage = Stage::with_ports(SMALL);
    stage
        .press(KeyCode::Enter)
        .input(Input::LinkOpened(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }));
    stage.bytes(BANNER).keys("3");
    assert!(stage.shows("H hex") && !stage.shows("keys to the unit"), "{}", stage.picture());
    assert!(!stage.shows("F file"), "{}", stage.picture());
    stage.keys("h");
    assert!(stage.shows("── Hexadecimal ──"), "{}", stage.picture());
    stage.keys("m");
    assert!(stage.shows("Not sent: this is a recording. Press 1 to choose a link."), "{}", stage.picture());
    stage.prefix().keys("2");
    assert!(stage.shows("── Unit ──"), "a user who is used to the prefix is not stopped: {}", stage.picture());
}

#[test]
fn a_recording_from_its_beginning_shows_nothing_that_has_not_happened_yet() {
    let mut stage = Stage::with_ports(SMALL);
    stage
        .press(KeyCode::Enter)
        .input(Input::LinkOpened(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }));
    stage.bytes(BANNER).bytes(b"Waiting for application S-Record.\r\n").keys("3");
    assert!(stage.shows("S-Record"), "{}", stage.picture());
    stage.input(Input::PlayedAnew(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }));
    stage.bytes(BANNER);
    assert!(stage.shows("from the beginning") && !stage.shows("S-Record"), "{}", stage.picture());
}

#[test]
fn arrows_on_the_bench_add_up_also_when_they_are_faster_than_the_unit() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(BANNER).bytes(MENU).wait(3000);
    stage.keys("9").asked();
    stage.press(KeyCode::Right).press(KeyCode::Right).press(KeyCode::Down).press(KeyCode::Right);
    let orders = ["set 1 temperature 30.0", "set 1 temperature 40.0", "set 2 temperature 30.0"];
    assert_eq!(stage.asked(), orders.map(|order| Effect::Order(order.into())));
    stage.input(Input::Ordered { line: orders[0].into(), answer: Ok(None) }).press(KeyCode::Up).press(KeyCode::Right);
    assert_eq!(stage.asked(), [Effect::Order("set 1 temperature 50.0".into())]);
}
