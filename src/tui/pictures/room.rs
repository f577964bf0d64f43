//! What is shown where there is much room, little, or too little.

use ratatui::crossterm::event::{Event as TerminalEvent, KeyCode, KeyModifiers};

use super::stage::*;
use crate::record::Span;
use crate::session::{Event, Facts, Known, Origin};
use crate::time::Duration;
use crate::tui::{Effect, Failure, Input, LinkInfo, LinkKind, Recorded, RecordingList};

/// The terminal with a hundred lines, each with its number.
fn hundred_lines() -> Stage {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
    for number in 0..100 {
        stage.bytes(format!("line {number:02} of them\r\n").as_bytes());
    }
    stage.keys("3");
    stage
}

/// Rows of the screen with a line of the unit in them.
fn lines_in(stage: &Stage) -> Vec<String> {
    let picture = stage.picture();
    let words = |line: &str| line.contains(" of them").then(|| line.trim().to_owned());
    picture.lines().filter_map(words).collect()
}

#[test]
fn the_oldest_lines_fill_the_terminal_and_so_do_those_around_what_is_found() {
    let mut stage = hundred_lines();
    let all = lines_in(&stage).len();
    stage.press(KeyCode::Home);
    let oldest = lines_in(&stage);
    assert!(oldest.len() + 2 >= all && oldest[0] == "line 00 of them", "{}", stage.picture());
    assert!(stage.shows("stopped"), "{}", stage.picture());
    stage.press(KeyCode::Up);
    assert_eq!(lines_in(&stage), oldest, "there is nothing above");
    stage.press(KeyCode::Down);
    assert_ne!(lines_in(&stage).last(), oldest.last(), "every key moves the picture");
    stage.prefix().keys("/line 03").press(KeyCode::Enter);
    assert_eq!(lines_in(&stage), oldest, "what follows is in sight: {}", stage.picture());
    stage.prefix().keys("/").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("line 50");
    let picture = stage.picture();
    assert!(
        picture.contains("line 50 of them") && picture.contains("line 51 of them"),
        "above the question: {picture}"
    );
    stage.press(KeyCode::Enter).prefix().keys("h").press(KeyCode::Home);
    let rows = stage.picture().lines().filter(|line| line.starts_with("  000000")).count();
    assert!(rows > 15 && stage.shows("00000000  6"), "bytes fill it as well: {}", stage.picture());
    // What fits as a whole is followed.
    let mut stage = Stage::connected(LARGE);
    stage.keys("3").press(KeyCode::Home);
    assert!(stage.shows("follows"), "{}", stage.picture());
}

#[test]
fn lines_that_are_broken_fill_the_terminal_from_the_first_piece_on() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").bytes(b"first\r\n");
    for number in 0..30 {
        stage.bytes(format!("{number:02}{}\r\n", "x".repeat(200)).as_bytes());
    }
    stage.keys("3").press(KeyCode::Home);
    assert!(stage.shows("connected to /dev/ttyUSB0") && stage.shows("first"), "{}", stage.picture());
    let rows = stage.picture().lines().filter(|line| line.contains("xxx")).count();
    assert!(rows > 14 && stage.shows("04xx") && !stage.shows("06xx"), "{}", stage.picture());
}

#[test]
fn no_key_does_anything_unseen_but_q_and_that_is_asked_about_in_sight() {
    let mut stage = Stage::connected(SMALL);
    stage.resized((60, 10)).asked();
    stage.keys("tvsdl").press(KeyCode::Enter).press(KeyCode::F(1)).keys("3x");
    stage.input(Input::Terminal(TerminalEvent::Paste("Yes".into())));
    assert_eq!(stage.asked(), []);
    stage.resized(SMALL);
    assert!(stage.shows("── Unit") && !stage.shows("╭"), "nothing has happened: {}", stage.picture());
    // What stood there stays, and no letter gets into it.
    stage.keys("d").resized((60, 10)).keys("Yes").press(KeyCode::Enter).press(KeyCode::Esc);
    stage.resized(SMALL);
    assert!(stage.shows("Type Yes") && !stage.shows("› Yes") && stage.sent().is_empty(), "{}", stage.picture());
    stage.resized((60, 10)).keys("q");
    assert_eq!(stage.asked(), [Effect::Quit]);
    // In the middle of an upload it is asked, whatever the size.
    let mut stage = Stage::loading(SMALL);
    stage.resized((40, 8)).asked();
    stage.keys("q");
    assert!(stage.shows("Leave axcon? Y leaves, N stays."), "{}", stage.picture());
    stage.press(KeyCode::Enter).keys("x");
    assert!(stage.asked().is_empty() && stage.shows("Leave axcon?"), "{}", stage.picture());
    stage.keys("n");
    assert!(!stage.shows("Leave axcon?"), "{}", stage.picture());
    stage.keys("qy").wait(2000);
    assert!(stage.effects.contains(&Effect::Quit));
    // On the terminal as well: no letter goes to the unit unseen.
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").resized((60, 10)).asked();
    stage.keys("dl");
    assert_eq!(stage.asked(), []);
    stage.keys("q");
    assert_eq!(stage.asked(), [Effect::Quit]);
}

#[test]
fn a_page_of_diagnostics_keeps_its_rows_whole_and_says_how_many_numbers_stand_below() {
    for size in [SMALL, (140, 40), LARGE] {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000).bytes(&page_of_eight()).wait(1500);
        let whole = |line: &str| line.contains("RTD2 ") && line.contains("status 0x00");
        assert!(stage.picture().lines().any(whole), "{size:?}: {}", stage.picture());
        assert!(stage.shows("RTD2 temperature") && stage.shows("RTD1 resistance  "), "{}", stage.picture());
        let mut seen = stage.picture();
        for _ in 0..30 {
            stage.press(KeyCode::Down);
            seen.push_str(&stage.picture());
        }
        assert!(seen.contains("RTD8 resistance") && seen.contains("Active Errors   "), "all can be reached: {seen}");
        assert!(!stage.shows("─ ↓ ") && !stage.shows("and ↓"), "the end: {}", stage.picture());
        let end = stage.picture();
        stage.press(KeyCode::Home).press(KeyCode::End);
        assert_eq!(stage.picture(), end);
        assert!(seen.contains("─ ↓ ") || size != SMALL, "{size:?}: {seen}");
    }
}

#[test]
fn averages_and_states_are_said_in_full_or_not_at_all() {
    for columns in [140, 150, 200] {
        let mut stage = Stage::with_dictionary((columns, 40)).with_rows();
        stage.keys("2");
        let picture = stage.picture();
        let line = picture.lines().find(|line| line.contains("Averages in °C")).expect("the line");
        assert!(line.contains("Bank 1") && line.contains("138.5") && line.contains("All 140.5"), "{columns}: {line}");
    }
    let mut stage = Stage::connected(SMALL);
    stage.keys("s").wait(2000).bytes(b"Supply 24.1 V\r\nCAN State   Pre-Operational\r\n").wait(1500).keys("2");
    let picture = stage.picture();
    let line = picture.lines().find(|line| line.contains("CANopen")).expect("the line");
    let state = line.split("CANopen").nth(1).unwrap_or_default();
    assert!(state.contains("pre-operational") && (!state.contains('(') || state.ends_with(')')), "{line}");
}

#[test]
fn an_answer_of_the_bench_is_read_to_its_end_at_80_columns() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9/set 1 temperature 9999").press(KeyCode::Enter);
    let why = "column 19: a temperature cannot be 9999; it is between -270 and 1820 in °C here";
    stage.input(Input::Ordered { line: "set 1 temperature 9999".into(), answer: Err(why.into()) });
    // In the box in which it can be corrected, and in the list of orders behind it.
    let boxed = stage.picture().to_lowercase();
    stage.press(KeyCode::Esc);
    for word in why.split(' ') {
        let (boxed, word, picture) = (&boxed, word.to_lowercase(), stage.picture());
        assert!(boxed.contains(&word), "no '{word}': {boxed}");
        assert!(picture.to_lowercase().contains(&word), "no '{word}': {picture}");
    }
    let mut stage = Stage::connected(SMALL);
    stage.keys("9");
    assert!(stage.shows("in your") && stage.shows("hands."), "{}", stage.picture());
}

#[test]
fn the_footer_names_as_many_keys_as_have_room_and_always_the_way_out() {
    let footer = |stage: &Stage| stage.picture().lines().last().unwrap_or_default().to_owned();
    let mut small = Stage::streaming(SMALL);
    let mut large = Stage::streaming(LARGE);
    small.keys("6");
    large.keys("6");
    for words in ["Enter alone", "←→ cursor", "End follow", "R restart", "Q quit"] {
        assert!(footer(&large).contains(words), "{words}: {}", footer(&large));
    }
    assert!(footer(&small).ends_with("F1 help  Q quit"), "{}", footer(&small));
    let large = Stage::connected(LARGE).with_image(good_image());
    assert!(footer(&large).contains("G loader") && footer(&large).contains("R read again"), "{}", footer(&large));
    let mut bench = Stage::with_ports(SMALL);
    bench.press(KeyCode::Enter).opened("emu:axtc4co").keys("9");
    assert!(footer(&bench).contains("O open") && footer(&bench).ends_with("Q quit"), "{}", footer(&bench));
    for size in [SMALL, LARGE] {
        let mut terminal = Stage::connected(size);
        terminal.keys("3");
        assert!(
            footer(&terminal).contains("F1 help") && footer(&terminal).ends_with("Q quit"),
            "{}",
            footer(&terminal)
        );
    }
    bench.click("Q quit");
    assert!(bench.asked().contains(&Effect::Quit), "a click finds it where it is");
}

#[test]
fn a_recording_s_name_stays_in_one_piece_and_those_being_written_are_called_that() {
    let name = "2026-01-31T12-00-00.cast";
    let entry = |port: &str, is_being_written| {
        let mut entry = recording("2026-01-31 12:00:00", port, 1, Some(Duration::from_secs(1)));
        entry.path = format!("/home/{}/{name}", "a".repeat(47));
        entry.content = entry.content.map(|recorded| Recorded { is_being_written, ..recorded });
        entry
    };
    let mut stage = Stage::connected(SMALL);
    stage.keys("8").recordings(vec![entry("u1", false), entry("u2", true), entry("u3", true)]);
    let picture = stage.picture();
    assert!(picture.contains(name), "{picture}");
    let is_written = |port: &str| picture.lines().any(|line| line.contains(port) && line.contains("being written"));
    assert_eq!(["  u1", "  u2", "  u3"].map(is_written), [false, true, true], "{picture}");
}

#[test]
fn what_cannot_be_read_is_listed_with_its_reason_and_what_is_left_out_is_counted() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_ports(size);
        let why = "line 1: this is no asciicast recording: expected value at column 1";
        let entries = vec![
            no_recording("/home/user/20260301T120000Z-c-1.cast", why),
            recording("2026-01-31 11:00:00", "/dev/ttyUSB0", 1, Some(Duration::from_secs(300))),
        ];
        stage.keys("8").input(Input::RecordingsListed(Ok(RecordingList { entries, older: 7 })));
        let picture = stage.picture();
        assert!(picture.contains("20260301T120000Z-c-1.cast  cannot be read: line 1: this is no"), "{picture}");
        assert!(picture.contains("2 of 9, newest first"), "{picture}");
        for word in why.split(' ') {
            assert!(picture.contains(word), "all of the reason is below: no '{word}' in {picture}");
        }
        assert!(!picture.contains("Attach this file"), "{picture}");
        stage.press(KeyCode::Down);
        assert!(stage.shows("Attach this file"), "{}", stage.picture());
    }
}

#[test]
fn the_list_of_recordings_is_read_again_when_a_link_opens_or_ends_in_front_of_it() {
    let mut stage = Stage::connected(SMALL).with_recordings();
    let is_read = |stage: &mut Stage| stage.asked().contains(&Effect::ListRecordings);
    assert!(is_read(&mut stage), "as the screen comes to the front");
    stage.lost();
    assert!(is_read(&mut stage), "its recording is not written any more");
    stage
        .press(KeyCode::Enter)
        .input(Input::LinkOpened(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }));
    assert!(is_read(&mut stage));
    stage.keys("1").asked();
    stage.keys("x");
    assert!(!is_read(&mut stage), "nobody looks at it");
}

#[test]
fn the_dictionary_gives_what_it_does_not_need_to_what_explains() {
    let blanks = |columns: u16| {
        let mut stage = Stage::with_dictionary((columns, 40));
        stage.press(KeyCode::End);
        let picture = stage.picture();
        let heads = picture.lines().find(|line| line.contains("Address  Name")).expect("the headings").to_owned();
        heads.find("Value").unwrap_or_default() - heads.find("Name").unwrap_or_default()
    };
    assert!(blanks(300) <= blanks(200) + 4 && blanks(200) < 75, "{} {}", blanks(300), blanks(200));
    let mut stage = Stage::with_dictionary(LARGE);
    stage.keys("/4000");
    assert!(stage.picture().lines().any(|line| line.contains("100.0 °C") && line.contains("-20.0 °C")));
}

#[test]
fn help_says_that_more_follows_and_keeps_keys_apart_from_what_they_do() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("4").press(KeyCode::F(1));
    assert!(stage.shows("more lines below") && stage.shows("Backspace        folder above"), "{}", stage.picture());
    for _ in 0..60 {
        stage.press(KeyCode::Down);
    }
    assert!(stage.shows("lines above") && !stage.shows("below"), "{}", stage.picture());
    let end = stage.picture();
    stage.press(KeyCode::Up);
    assert!(
        stage.picture() != end && stage.shows("1 more line below"),
        "one step back is one line: {}",
        stage.picture()
    );
    stage.press(KeyCode::End);
    assert_eq!(stage.picture(), end);
    stage.press(KeyCode::Home);
    assert!(stage.shows("── Load software"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(!stage.shows("more lines below"), "any other key leaves it: {}", stage.picture());
}

#[test]
fn all_keys_can_be_read_on_a_terminal_that_is_wide_and_low() {
    for size in [(160, 24), (160, 40), (200, 60)] {
        let mut stage = Stage::connected(size);
        stage.keys("3").press(KeyCode::F(1));
        let mut seen = stage.picture();
        for _ in 0..60 {
            stage.press(KeyCode::Down);
            seen.push_str(&stage.picture());
        }
        for words in ["send a break", "connect again after the link was lost", "believes only the banner"] {
            assert!(seen.contains(words), "{size:?}: no '{words}'");
        }
    }
}

#[test]
fn the_keys_of_a_question_stay_in_sight_whatever_it_has_to_say() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).input(Input::LinkFailed(Failure {
        text: "cannot open /dev/ttyUSB0: ".to_owned() + &"permission denied ".repeat(12),
        hints: vec!["Ask whoever looks after this computer. ".repeat(4); 5],
    }));
    assert!(stage.shows("Enter close") && stage.shows("│ …"), "{}", stage.picture());
    stage.click("Enter close");
    assert!(!stage.shows("Not connected ─"), "{}", stage.picture());
    // All that can be said of a stream at once.
    let mut stage = Stage::streaming(SMALL);
    stage.fold_with(Event::FactsChanged, &Facts { product: stage_product(), ..Facts::default() });
    stage.keys("tp1");
    assert!(stage.shows("unit will leave rows out.") && stage.shows("recording only."), "{}", stage.picture());
    assert!(stage.shows("Enter switch on") && stage.shows("Every, in ms: › 1"), "{}", stage.picture());
}

fn stage_product() -> Option<Known<String>> {
    Some(Known { value: "AXTC4CO".to_owned(), origin: Origin::Menu, span: Span::default() })
}

#[test]
fn a_channel_is_chosen_also_when_the_unit_has_fewer_than_the_one_before() {
    for screen in ["2", "6"] {
        let mut stage = Stage::eight_channels(LARGE);
        stage.keys(screen);
        (0..7).for_each(|_| {
            stage.press(KeyCode::Down);
        });
        assert!(stage.shows("› RTD8"), "{}", stage.picture());
        stage.bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
        assert!(stage.shows("› TC4"), "{}", stage.picture());
    }
}

#[test]
fn a_narrower_window_stays_where_somebody_looks() {
    let mut stage = Stage::streaming(SMALL);
    stage.keys("6z").press(KeyCode::Left);
    (0..40).for_each(|_| {
        stage.press(KeyCode::Left);
    });
    let looked_at = |stage: &Stage| {
        let picture = stage.picture();
        picture.split("At ").nth(1).map(|text| text[..8].to_owned()).expect("a time")
    };
    let at = looked_at(&stage);
    stage.keys("zzzz");
    assert!(stage.shows("1 minute, held") && looked_at(&stage) == at, "{}", stage.picture());
    let picture = stage.picture();
    let axis = picture.lines().rev().find(|line| line.contains("12:0") && line.trim_start().starts_with("12:"));
    let first = axis.and_then(|line| line.split_whitespace().next()).expect("times below the axis").to_owned();
    assert!(first <= at, "{at} is in sight: {picture}");
}

#[test]
fn a_page_of_the_dictionary_is_what_is_in_sight_of_it() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_dictionary(size);
        let chosen = |stage: &Stage| {
            let picture = stage.picture();
            let row = picture.lines().find(|line| line.starts_with("› ")).expect("a chosen row").to_owned();
            row.split_whitespace().find(|word| word.contains(':')).expect("its address").to_owned()
        };
        let before = stage.picture();
        stage.press(KeyCode::PageDown);
        assert!(!before.contains(&chosen(&stage)), "{size:?}: {}", stage.picture());
        stage.press(KeyCode::Up);
        assert!(before.contains(&chosen(&stage)), "{size:?}, nothing is left out: {}", stage.picture());
    }
}
