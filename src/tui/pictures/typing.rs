//! What is typed, pasted and printed, in sentences.

use ratatui::crossterm::event::{Event as TerminalEvent, KeyCode, KeyModifiers};

use super::stage::*;
use crate::tui::{Effect, Input};

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

fn paste(stage: &mut Stage, text: &str) {
    stage.input(Input::Terminal(TerminalEvent::Paste(text.into())));
}

#[test]
fn pasted_words_are_looked_for_at_once() {
    let mut stage = Stage::with_dictionary(SMALL);
    stage.keys("/");
    paste(&mut stage, "sensor type\nand more");
    assert!(stage.shows("with 'sensor type'") && stage.shows("6110:01"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("with 'sensor type'"), "{}", stage.picture());
}

#[test]
fn pasted_text_answers_no_question_and_takes_nothing_out_of_it() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    paste(&mut stage, "abc");
    paste(&mut stage, "yes");
    assert!(stage.sent().is_empty() && stage.shows("3 characters, one line"), "{}", stage.picture());
    stage.keys("y");
    assert_eq!(stage.sent(), b"abc");
    // Another link was to be opened, and still is.
    let mut stage = Stage::connected(SMALL);
    stage.keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    paste(&mut stage, "y");
    stage.asked();
    stage.keys("y");
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB1".into())]);
}

#[test]
fn what_of_a_paste_the_unit_does_not_know_is_told_before_it_is_sent() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    paste(&mut stage, "m");
    assert!(stage.shows("1 character, one line, goes to the unit") && !stage.shows("Left out"), "{}", stage.picture());
    stage.press(KeyCode::Esc);
    paste(&mut stage, "23 °C ≈ warm");
    assert!(stage.shows("10 characters, one line, go") && stage.shows("Left out: 2 characters"), "{}", stage.picture());
    stage.keys("y");
    assert_eq!(stage.sent(), b"23 C  warm");
    paste(&mut stage, "°");
    assert!(stage.shows("Not sent: the unit knows none of these"), "{}", stage.picture());
    paste(&mut stage, "m\nv\nx\n");
    assert!(stage.shows("6 characters, 3 lines"), "nothing begins after the last line end: {}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(stage.sent().is_empty() && stage.shows("Send the pasted"), "{}", stage.picture());
    stage.press(KeyCode::Esc).lost();
    paste(&mut stage, "m");
    assert!(stage.shows("Not sent: the link is lost.") && !stage.shows("Send the pasted"), "{}", stage.picture());
}

#[test]
fn a_complaint_goes_when_what_it_is_about_does() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("t70000").press(KeyCode::Enter);
    assert!(stage.shows("A whole number of milliseconds"), "{}", stage.picture());
    stage.press(KeyCode::Backspace);
    assert!(stage.shows("7000") && !stage.shows("A whole number"), "{}", stage.picture());
    stage.press(KeyCode::Esc).keys("dyes").press(KeyCode::Enter);
    assert!(stage.shows("Only the word Yes"), "{}", stage.picture());
    stage.key(KeyCode::Char('u'), KeyModifiers::CONTROL);
    assert!(!stage.shows("Only the word Yes"), "{}", stage.picture());
}

#[test]
fn a_name_that_is_refused_is_corrected_where_it_was_typed() {
    let mut stage = Stage::with_dictionary(SMALL);
    stage.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("tc.xml").press(KeyCode::Enter).asked();
    assert!(stage.shows("› tc.xml") && stage.shows("has to end in .json, .csv, .dcf or .txt"), "{}", stage.picture());
    stage.key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("tc.csv").press(KeyCode::Enter).press(KeyCode::Enter);
    stage.keys("x");
    let written = stage.asked();
    assert_eq!(written.len(), 1, "once: {written:?}");
    stage.input(Input::FileWritten { path: "tc.csv".into(), result: Err("a file of that name already exists".into()) });
    assert!(stage.shows("› tc.csv") && stage.shows("already exists"), "{}", stage.picture());
    stage.key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("tc2.csv").press(KeyCode::Enter);
    stage.input(Input::FileWritten { path: "tc2.csv".into(), result: Ok(()) });
    assert!(!stage.shows("› tc2.csv") && stage.shows("tc2.csv is written."), "{}", stage.picture());
}

#[test]
fn an_order_that_is_refused_is_corrected_where_it_was_typed() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9/set 1 temprature 20").press(KeyCode::Enter);
    let refuse = |stage: &mut Stage, line: &str| {
        let (line, answer) = (line.to_owned(), Err("there is no such knob".to_owned()));
        stage.input(Input::Ordered { line, answer });
    };
    refuse(&mut stage, "set 1 temprature 20");
    assert!(stage.shows("› set 1 temprature 20") && stage.shows("There is no such knob."), "{}", stage.picture());
    stage.press(KeyCode::Esc).press(KeyCode::Enter).keys("9999").press(KeyCode::Enter);
    refuse(&mut stage, "set 1 temperature 9999");
    assert!(stage.shows("› 9999") && stage.shows("There is no such knob."), "{}", stage.picture());
    stage.press(KeyCode::Backspace).press(KeyCode::Enter);
    stage.input(Input::Ordered { line: "set 1 temperature 999".into(), answer: Ok(None) });
    assert!(!stage.shows("› 999") && stage.shows("999.0 °C"), "{}", stage.picture());
}

#[test]
fn the_last_line_of_the_terminal_shows_what_is_the_units_and_what_is_not() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3");
    let last = stage.picture().lines().last().unwrap_or_default().to_owned();
    let (before, after) = last.split_once("Ctrl-]").expect("the prefix");
    assert!(before.contains("F1 help") && after.contains("Q quit") && !after.contains("F1"), "{last}");
}
