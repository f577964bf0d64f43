//! What rarely happens: several things at once, questions nobody expects, halves of lines, a unit that says almost nothing.

use axcon::endpoint::Arrived;
use axcon::record::{Direction, Span};
use axcon::secret::Secret;
use axcon::session::{LoadOrder, Origin, UnitState};
use axcon::wire::{MenuKey, Message, Prompt};

use super::*;
use crate::support::bench::Bench;

type Script = &'static [(&'static str, u64, &'static str)];

const SOURCE: &str = "F - field value, P - process value: ";
const PERIOD: &str = "Every how many ms? ";
const DEFAULTS: &str = "Enter Yes to restore the default object dictionary: ";
const PAGE: &str = "Supply voltage: 24.1 V\r\n";

/// All news so far.
fn news(session: &mut Session) -> Vec<Event> {
    std::iter::from_fn(|| session.poll_event()).collect()
}

/// Lets time pass with the timers that expire.
fn pass(session: &mut Session, until: Instant) {
    while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
        session.handle_timeout(due);
        while session.poll_transmit().is_some() {}
    }
}

/// Keys typed by hand, which leave at once.
fn press(session: &mut Session, now: Instant, keys: &str) {
    session.command(now, Command::Keys(keys.as_bytes().to_vec())).expect("no job runs");
    while session.poll_transmit().is_some() {}
}

/// Goes on until something has happened.
fn until(alone: &mut Alone, has_happened: impl Fn(&Alone) -> bool) {
    alone.take_sent(Instant::ZERO);
    while !has_happened(alone) {
        alone.step();
        alone.take_sent(Instant::ZERO);
    }
}

/// How the job ends, what was sent, and when it ended.
fn told(script: Script, command: Command) -> (Outcome, String, u64) {
    let mut alone = Alone::with(script);
    let (outcome, time) = alone.ask(command);
    (outcome, alone.log(), time)
}

fn no_answer(outcome: &Outcome) -> Option<Awaited> {
    if let Outcome::NoAnswer { awaited, .. } = outcome { Some(*awaited) } else { None }
}

#[test]
fn a_password_that_the_unit_repeats_is_recorded_and_quoted_nowhere() {
    const ENDED: Script =
        &[("l", 5, "Password: "), ("AXIO-2010", 5, "\r\nno such password: AXIO-2010\r\nwrong: AXIP\x08O-2010\r\n")];
    const PENDING: Script = &[("l", 5, "Password: "), ("AXIO-2010", 5, "\r\nwrong: AXIP\x08O-2010")];
    for script in [ENDED, PENDING] {
        let (report, alone) = upload_behind(script);
        assert_eq!((report.verdict, report.heard.as_str()), (Verdict::UnitRefused, "wrong: *********"), "{report:?}");
        assert!(!recorded(&alone.session).contains("AXIO"), "{:?}", recorded(&alone.session));
    }
}

#[test]
fn a_password_that_no_line_can_carry_is_refused() {
    for password in ["", "AXIO\r", "\x1b[AXIO"] {
        let password = Secret::new(password.as_bytes().to_vec());
        let order = LoadOrder { password: Some(password), ..order(small_image("AXTC4CO", "1.2.0")) };
        let mut session = Session::new(115_200);
        assert_eq!(session.command(Instant::ZERO, Command::Load(Box::new(order))), Err(Refusal::Password));
        assert_eq!(session.job(), None);
    }
}

#[test]
fn an_l_at_the_beginning_of_a_file_is_a_key_whatever_was_typed_before() {
    let mut alone = Alone::with(&[]);
    press(&mut alone.session, alone.now, "he");
    let (outcome, _) = alone.ask(Command::SendFile(b"lAXIO-2010\r".to_vec()));
    assert_eq!(outcome, Outcome::FileSent { sent: 11, total: 11, end: FileEnd::Whole });
    assert!(alone.log().contains(":AXIO-2010"), "{}", alone.log());
    assert!(!recorded(&alone.session).contains("AXIO"), "{:?}", recorded(&alone.session));
}

#[test]
fn a_menu_shows_that_no_question_is_open_any_more() {
    let mut alone = Alone::with(&[]);
    alone.session.handle_bytes(alone.now, b"Password: ");
    alone.session.link_lost(alone.now);
    alone.session.link_back(alone.now);
    press(&mut alone.session, alone.now, "m");
    assert!(alone.session.password_open() && recorded(&alone.session).ends_with('*'));
    alone.session.handle_bytes(alone.now, MENU.as_bytes());
    assert!(!alone.session.password_open());
    press(&mut alone.session, alone.now, "t");
    assert!(recorded(&alone.session).ends_with('t'));
    // One that was answered without Enter.
    press(&mut alone.session, alone.now, "dy");
    assert_eq!(alone.session.open_question(), Some(MenuKey::Default));
    alone.session.handle_bytes(alone.now, MENU.as_bytes());
    assert_eq!(alone.session.open_question(), None);
}

#[test]
fn a_question_for_the_password_is_heard_though_a_row_comes_with_it() {
    for (question, is_open) in [("Password: ", true), (SOURCE, false)] {
        let mut session = Session::new(115_200);
        session.handle_bytes(Instant::ZERO, format!("{question}{ROW}").as_bytes());
        assert_eq!(session.password_open(), is_open, "{question}");
    }
}

#[test]
fn what_a_key_answers_is_heard_before_it_leaves_and_is_no_part_of_the_answer() {
    let [asked, typed] = [5, 100].map(Instant::from_millis);
    let mut session = Session::new(115_200);
    session.handle_bytes(asked, b"Password: ");
    press(&mut session, typed, "A");
    let is_question = |event: &Event| matches!(event, Event::Heard { message: Message::Prompt(Prompt::Password), .. });
    assert!(news(&mut session).iter().any(is_question), "no timer had to expire");
    // Words that are no question known here, and on the same line the first of a menu.
    let mut session = Session::new(115_200);
    session.handle_bytes(asked, b"Command: ");
    pass(&mut session, typed);
    press(&mut session, typed, "m");
    session.handle_bytes(typed, b"V - View Object Dictionary\r\n");
    let is_entry = |event: &Event| matches!(event, Event::Heard { message: Message::MenuKey(MenuKey::View), .. });
    assert!(news(&mut session).iter().any(is_entry));
}

#[test]
fn a_password_that_waits_for_xon_is_asked_for_once() {
    const SCRIPT: Script = &[
        ("\u{11}m", 3, MENU),
        ("l", 5, "Password: \x13"),
        ("", 500, "\x11"),
        ("AXIO-2010", 300, "\r\nWaiting for application S-Record.\r\n"),
    ];
    let mut alone = Alone::with(SCRIPT);
    let load = Command::Load(Box::new(order(small_image("AXRTD8CO", "1.2.0"))));
    alone.session.command(alone.now, load).expect("it is free");
    until(&mut alone, |alone| alone.log().contains(":S"));
    assert_eq!(password_at(&alone), Some(500), "{}", alone.log());
    // The link is lost in the middle of the file.
    alone.session.link_lost(alone.now + Duration::from_secs(10));
    let report = news(&mut alone.session).into_iter().find_map(|event| match event {
        Event::Finished(Outcome::Loaded(report)) => Some(report),
        _ => None,
    });
    let duration = report.expect("it ends with the link").duration;
    assert!(duration >= Duration::from_secs(10), "{duration:?}");
}

#[test]
fn a_password_has_been_sent_though_a_key_after_it_still_waits() {
    const SCRIPT: Script = &[("l", 5, "Password: "), ("AXIO-2010", 50, "\r\nOne moment\x13")];
    let (report, _) = upload_behind(SCRIPT);
    assert_eq!((report.verdict, report.password_sent), (Verdict::UnitRefused, true), "{report:?}");
    assert_eq!(report.what, "the password was sent, but no loader asks for the file");
}

#[test]
fn a_sign_after_the_question_begins_the_wait_for_its_end_anew() {
    const SCRIPT: Script = &[("l", 5, "Enter password:\r\n"), ("", 100, "> ")];
    let (_, alone) = upload_behind(SCRIPT);
    assert_eq!(password_at(&alone), Some(100 + 250), "{}", alone.log());
}

#[test]
fn a_row_on_its_way_is_no_answer_to_t() {
    const ON: Script = &[("t", 100, ROW), ("", 800, SOURCE), ("f", 5, PERIOD), ("200~", 300, ROW)];
    let expected = (Outcome::StreamRuns { was_on: false }, "0:t 860:f 925:200~".to_owned(), 1_225);
    assert_eq!(told(ON, on()), expected);
    // It does not show that a stream is on whose question comes next.
    let mut alone = Alone::with(&[("t", 100, ROW), ("", 200, SOURCE)]);
    assert_eq!(alone.ask(Command::StreamOff), (Outcome::Done(Job::StreamOff), 2_760), "{}", alone.log());
    assert_eq!((alone.log().as_str(), alone.session.facts().stream), ("0:t 260:~", None));
}

#[test]
fn a_stream_that_sends_no_row_is_left_with_its_question_if_it_asks_one() {
    const SILENT: Script = &[("t", 5, SOURCE), ("f", 5, PERIOD)];
    const ASKS: Script = &[("t", 5, SOURCE), ("f", 5, PERIOD), ("200~", 5, "Sure? ")];
    for (script, log, time) in [(SILENT, "0:t 65:f 130:200~", 7_130), (ASKS, "0:t 65:f 130:200~ 7130:~", 7_130 + 2_500)]
    {
        let (outcome, sent, ended) = told(script, on());
        assert_eq!((no_answer(&outcome), sent.as_str(), ended), (Some(Awaited::Row), log, time));
    }
    for (script, log, time) in [(SILENT, "0:t 65:f 130:200~", 730), (ASKS, "0:t 65:f 130:200~ 730:~", 730 + 2_500)] {
        let mut alone = Alone::with(script);
        alone.session.command(alone.now, on()).expect("it is free");
        until(&mut alone, |alone| alone.session.facts().stream.is_some());
        alone.session.command(alone.now, Command::Cancel).expect("always");
        assert_eq!(alone.end(Instant::ZERO), (Outcome::Cancelled(Job::StreamOn), time), "{}", alone.log());
        assert_eq!(alone.log(), log);
    }
}

#[test]
fn a_question_on_a_line_of_its_own_that_a_key_has_answered_is_not_answered_again() {
    // The Enter comes a moment after it.
    const SCRIPT: Script = &[("t", 5, SOURCE), ("f", 390, "Repetition rate in ms (1..60000):\r\n")];
    let (outcome, log, time) = told(SCRIPT, on());
    assert_eq!(
        (no_answer(&outcome), log.as_str(), time),
        (Some(Awaited::PeriodQuestion), "0:t 65:f 465:~ 1965:~", 4_465)
    );
}

#[test]
fn a_stream_that_comes_with_every_enter_is_switched_off_three_times_at_most() {
    const ROWS: Script =
        &[("t", 5, SOURCE), ("~", 5, ROW), ("t", 5, SOURCE), ("~", 5, ROW), ("t", 5, SOURCE), ("~", 5, ROW)];
    let (outcome, log, time) = told(ROWS, Command::StreamOff);
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::StreamOff, heard: Some(_), .. }), "{outcome:?}");
    assert_eq!((log.as_str(), time), ("0:t 65:~ 70:t 135:~ 140:t 205:~", 205 + 2_500));
    // Once the user has had enough, that is how it ends.
    let mut alone = Alone::with(&[("t", 5, SOURCE), ("~", 5, ROW), ("t", 5, "off\r\n")]);
    alone.session.command(alone.now, Command::StreamOff).expect("it is free");
    until(&mut alone, |alone| alone.log().ends_with(":~"));
    alone.session.command(alone.now, Command::Cancel).expect("always");
    assert_eq!(alone.end(Instant::ZERO), (Outcome::Cancelled(Job::StreamOff), 75 + 400), "{}", alone.log());
    assert_eq!(alone.log(), "0:t 65:~ 70:t");
}

#[test]
fn a_line_about_something_else_is_no_question_that_a_job_waits_for() {
    const OFF: Script = &[("t", 5, "Off. No password needed:\r\n")];
    let (outcome, log, _) = told(OFF, Command::StreamOff);
    assert_eq!((outcome, log.as_str()), (Outcome::Done(Job::StreamOff), "0:t 405:~"), "left when nothing follows");
    const SHOWN: Script = &[("s", 100, "Supply voltage: 24.1 V\r\nPassword set (yes)\r\n"), ("s", 10, "Off.\r\n")];
    let (outcome, log, time) = told(SHOWN, Command::Diagnostics { pages: Some(1) });
    assert_eq!((outcome, log.as_str(), time), (Outcome::Done(Job::Diagnostics), "1300:s 1800:s", 3_300));
    const NOTHING: Script =
        &[("d", 3, "Restore the defaults [y/n]? "), ("No~", 5, "Nothing done (type Yes to do it)\r\n")];
    let (outcome, log, time) = told(NOTHING, Command::RestoreDefaults);
    assert_eq!((no_answer(&outcome), log.as_str(), time), (Some(Awaited::DefaultsQuestion), "0:d 1500:No~", 3_000));
}

#[test]
fn a_page_has_no_echo_and_no_end_of_a_row_in_it_and_its_last_line_needs_no_end() {
    const ROW_END: Script = &[("s", 100, "-12.750\r\nSupply voltage: 24.1 V\r\n")];
    const ECHO: Script = &[("s", 100, "sSupply voltage: 24.1 V\r\n")];
    const HALVES: Script =
        &[("s", 100, "Supply voltage: 24.1 V\r\nCold jun"), ("", 550, "ction: 31.0 C\r\nUptime 5 h")];
    const TWICE: Script = &[("s", 100, "Supply 24.1 V\r\nUptime 5 h"), ("", 1_100, "Supply 24.2 V\r\nUptime 6 h")];
    for (script, pages, lines, stopped) in [
        (ROW_END, 1, "Supply voltage: 24.1 V", 1_800),
        (ECHO, 1, "Supply voltage: 24.1 V", 1_800),
        (HALVES, 1, "Supply voltage: 24.1 V|Cold junction: 31.0 C|Uptime 5 h", 1_850 + 400 + 300),
        (TWICE, 2, "Supply 24.1 V|Uptime 5 h|Supply 24.2 V|Uptime 6 h", 2_400 + 400 + 300),
    ] {
        let mut alone = Alone::with(&[script, &[("s", 10, "Off.\r\n")]].concat());
        let (outcome, _) = alone.ask(Command::Diagnostics { pages: Some(pages) });
        assert_eq!((outcome, alone.lines.join("|").as_str()), (Outcome::Done(Job::Diagnostics), lines));
        assert_eq!(alone.log(), format!("1300:s {stopped}:s"));
    }
}

#[test]
fn a_unit_that_talks_on_after_s_without_a_page_is_stopped_again() {
    const TALKS: Script =
        &[("s", 500, "nothing to show yet\r\n"), ("", 2_000, "still nothing\r\n"), ("", 5_000, "nothing\r\n")];
    let (outcome, log, time) = told(TALKS, Command::Diagnostics { pages: Some(1) });
    let Outcome::NoAnswer { awaited: Awaited::Page, heard, .. } = outcome else { panic!("{outcome:?}") };
    assert_eq!((log.as_str(), time), ("1300:s 7800:s", 7_800 + 1_500));
    assert_eq!(heard.map(Span::len), Some(7), "the last thing it has said");
    // What it said after an earlier S does not count: a single page came then, and one more S was pressed.
    const ONCE: Script = &[("s", 2_000, PAGE), ("s", 4_800, "something\r\n")];
    let (outcome, log, time) = told(ONCE, Command::Diagnostics { pages: Some(2) });
    assert_eq!((no_answer(&outcome), log.as_str(), time), (Some(Awaited::NextPage), "1300:s 6200:s", 6_200 + 6_500));
}

#[test]
fn pages_that_cease_are_stopped_and_the_menu_shows_that_the_unit_is_still_there() {
    const CEASE: Script = &[("s", 100, PAGE), ("", 1_100, PAGE), ("m", 5, MENU)];
    let mut alone = Alone::with(CEASE);
    let (outcome, time) = alone.ask(Command::Diagnostics { pages: Some(3) });
    assert_eq!((no_answer(&outcome), alone.pages), (Some(Awaited::NextPage), 2), "{outcome:?}");
    // The rest of the menu has a moment to come.
    assert_eq!((alone.log().as_str(), time), ("1300:s 5300:s 6800:m", 6_805 + 300));
    // One that does not stop is told three times.
    const NEVER: Script = &[("s", 100, PAGE), ("s", 1_000, PAGE), ("s", 1_000, PAGE), ("s", 1_000, PAGE)];
    let (outcome, log, time) = told(NEVER, Command::Diagnostics { pages: Some(1) });
    let expected = (Some(Awaited::DiagnosticsOff), "1300:s 1800:s 3200:s 4600:s", 6_000);
    assert_eq!((no_answer(&outcome), log.as_str(), time), expected);
}

#[test]
fn when_the_job_says_that_pages_are_off_they_are_though_the_key_had_to_wait() {
    let mut alone = Alone::with(&[("s", 100, PAGE), ("", 200, "\x13"), ("", 1_500, "\x11"), ("s", 5, "Off.\r\n")]);
    let (outcome, time) = alone.ask(Command::Diagnostics { pages: Some(1) });
    assert_eq!((outcome, alone.log().as_str(), time), (Outcome::Done(Job::Diagnostics), "1300:s 2800:s", 3_300));
    assert_eq!(alone.session.facts().diagnostics, None);
}

#[test]
fn lines_of_a_page_that_the_job_has_given_are_understood() {
    let mut alone = Alone::with(&[("s", 10, "Off.\r\n")]);
    // Two that nobody has asked for, and that have nothing in common: the first one may be anything.
    alone.says.push((Instant::from_millis(500), PAGE));
    alone.says.push((Instant::from_millis(1_500), "Board temperature: 31.0 C\r\n"));
    let (outcome, time) = alone.ask(Command::Diagnostics { pages: Some(2) });
    assert_eq!((outcome, alone.log().as_str(), time), (Outcome::Done(Job::Diagnostics), "1900:s", 3_400));
    assert_eq!((alone.pages, alone.session.facts().unrecognised_lines), (2, 1));
}

#[test]
fn every_question_that_is_asked_while_one_is_left_is_left_as_well() {
    // Rows end the lines of two of them.
    const ASKS: Script =
        &[("s", 5, "Password: "), ("~", 50, "Password: "), ("", 150, ROW), ("", 200, "Password: "), ("", 300, ROW)];
    let (outcome, log, time) = told(ASKS, Command::Diagnostics { pages: Some(1) });
    let expected = (Some(Awaited::Page), "1300:s 1365:~ 1965:~", 1_965 + 600);
    assert_eq!((no_answer(&outcome), log.as_str(), time), expected);
}

#[test]
fn what_is_said_after_the_yes_is_told_from_what_was_said_before_it_and_from_its_echo() {
    const REFUSED: Script = &[("d", 3, DEFAULTS), ("Yes~", 50, "Not allowed in this state\r\n")];
    let (outcome, log, time) = told(REFUSED, Command::RestoreDefaults);
    let Outcome::Refused { reason, .. } = outcome else { panic!("{outcome:?}") };
    assert_eq!(reason, "after the Yes the unit says \"Not allowed in this state\"");
    assert_eq!((log.as_str(), time), ("0:d 63:Yes~", 113 + 1_000));
    const NOTE: Script = &[
        ("d", 3, "Invalid answers are refused.\r\nEnter Yes to restore the default object dictionary: "),
        ("Yes~", 50, "AXTC4CO V1.1.0\r\n"),
        ("m", 5, MENU),
    ];
    assert_eq!(told(NOTE, Command::RestoreDefaults).0, Outcome::Done(Job::RestoreDefaults));
    const ECHO: Script = &[("d", 3, DEFAULTS), ("Yes~", 50, "Yes\r\n"), ("", 60, MENU), ("m", 5, MENU)];
    assert_eq!(told(ECHO, Command::RestoreDefaults).0, Outcome::DefaultsTaken, "the menu alone is no banner");
}

#[test]
fn after_a_job_whose_question_did_not_come_keys_are_keys_again() {
    let mut alone = Alone::with(&[("d", 3, "Not possible in this state\r\n")]);
    let (outcome, _) = alone.ask(Command::RestoreDefaults);
    assert!(matches!(outcome, Outcome::Refused { .. }), "{outcome:?}");
    press(&mut alone.session, alone.now, "s");
    alone.session.handle_bytes(alone.now, b"Diagnostics started.\r\n");
    assert!(alone.session.facts().diagnostics.is_some(), "it answers the S");
}

#[test]
fn a_unit_that_says_little_is_identified_by_as_much_as_can_be_no_accident() {
    let asked = |script: Script| {
        let mut alone = Alone::with(script);
        let (outcome, time) = alone.ask(Command::Identify);
        assert_eq!(outcome, Outcome::Identified);
        (alone.session.facts().state, alone.log().replace('\u{11}', ""), time)
    };
    let application = |log: &str, time: u64| (UnitState::Application, log.to_owned(), time);
    // A name alone may be an object of the view; a single entry beside it, or three without one, make a menu.
    assert_eq!(asked(&[("\u{11}m", 3, "AXTC4CO V1.1.0\r\n")]), application("0:m 800:~m 1600:xm", 2_400));
    const NAMED: Script = &[("\u{11}m", 3, "AXTC4CO V1.1.0\r\nV - View Object Dictionary\r\n")];
    assert_eq!(asked(NAMED), application("0:m", 153));
    // One that is not named is asked once more.
    const THREE: &str = "V - View\r\nD - Default\r\nL - Load\r\n";
    assert_eq!(asked(&[("\u{11}m", 3, THREE), ("~m", 3, THREE)]), application("0:m 153:~m", 306));
    // A loader may have nothing to say but its error.
    let loader = (UnitState::Loader, "0:m".to_owned(), 153);
    assert_eq!(asked(&[("\u{11}m", 3, "Error # 0002\r\n")]), loader);
}

#[test]
fn a_unit_is_known_by_more_than_three_numbers_and_a_restart_by_more_than_a_name() {
    let state = |text: &str| {
        let mut session = Session::new(115_200);
        session.handle_bytes(Instant::ZERO, text.as_bytes());
        session.facts().state
    };
    assert_eq!(state("V1.2.3\r\n"), UnitState::Unknown);
    assert_eq!(state("Software version V1.2.3\r\n"), UnitState::Application);
    // A stream with a row each second, which has to come back after a restart.
    let mut session = Session::new(115_200);
    for at in [0, 1_000] {
        session.handle_bytes(Instant::from_millis(at), ROW.as_bytes());
    }
    for (at, text, stream) in [(1_500, "AXTC4CO\r\n", Some(Source::FieldValue)), (20_000, "AXTC4CO V1.1.0\r\n", None)] {
        session.handle_bytes(Instant::from_millis(at), text.as_bytes());
        pass(&mut session, Instant::from_millis(at + 8_000));
        assert_eq!(session.facts().stream, stream, "{text}");
    }
}

#[test]
fn a_row_without_a_number_is_one_of_the_source_that_was_seen_last() {
    let mut session = Session::new(115_200);
    for row in [
        "  2350;  2360;Null  ;Open  ;  2370;  2380;  2390;  2400\r\n",
        "Null  ;Open  ;Null  ;Null  ;Null  ;Null  ;Null  ;Null  \r\n",
    ] {
        session.handle_bytes(Instant::ZERO, row.as_bytes());
        assert_eq!(session.facts().stream, Some(Source::ProcessValue), "{row}");
    }
}

#[test]
fn what_a_page_says_of_the_network_is_told_from_what_a_banner_says() {
    let origin = |session: &Session| session.facts().node_id.as_ref().map(|known| (known.value, known.origin));
    let [pressed, answered, restarted] = [1, 100, 200].map(Instant::from_millis);
    let mut session = Session::new(115_200);
    press(&mut session, pressed, "s");
    session.handle_bytes(answered, b"Node-ID: 5\r\n");
    assert_eq!(origin(&session), Some((5, Origin::Diagnostics)), "before there is a whole page");
    session.handle_bytes(restarted, b"AXTC4CO V1.1.0\r\nNode-ID: 6\r\n");
    assert_eq!(origin(&session), Some((6, Origin::Banner)));
    // Pages that came before anybody pressed a key.
    let mut session = Session::new(115_200);
    for at in [0, 1_000] {
        session.handle_bytes(Instant::from_millis(at), PAGE.as_bytes());
        pass(&mut session, Instant::from_millis(at + 999));
    }
    session.handle_bytes(Instant::from_millis(2_000), b"Node-ID: 7\r\n");
    assert_eq!(origin(&session), Some((7, Origin::Diagnostics)));
}

#[test]
fn whatever_changes_is_told() {
    let now = Instant::ZERO;
    let holds = |session: &mut Session| {
        let held = |event| if let Event::Held(held) = event { Some(held) } else { None };
        news(session).into_iter().filter_map(held).collect::<Vec<_>>()
    };
    // A unit that starts has forgotten that it stopped us.
    let mut session = Session::new(115_200);
    session.handle_bytes(now, b"\x13AXTC4CO V1.1.0\r\n");
    assert_eq!((holds(&mut session), session.held_since()), (vec![true, false], None));
    // A job changes what is known, and somebody else does.
    session.command(now, Command::Identify).expect("it is free");
    assert_eq!((news(&mut session), session.facts().state), (vec![Event::FactsChanged], UnitState::Silent));
    session.forget_unit();
    assert_eq!((news(&mut session), &session.facts().product), (vec![Event::FactsChanged], &None));
    // Noise may hold an XOFF.
    let mut session = Session::new(115_200);
    session.handle_bytes(now, b"gibberish\r\n\x13");
    session.command(now, Command::Identify).expect("it is free");
    assert_eq!((holds(&mut session), session.held_since()), (vec![true, false], None));
}

#[test]
fn a_lost_link_ends_the_job_that_waits_for_its_turn_and_what_was_known_of_the_rows() {
    let mut session = Session::new(115_200);
    session.command(Instant::ZERO, Command::Identify).expect("it is free");
    session.command(Instant::ZERO, Command::StreamOff).expect("it waits");
    session.link_lost(Instant::ZERO);
    let ended = |event| if let Event::Finished(outcome) = event { Some(outcome) } else { None };
    let ended: Vec<Outcome> = news(&mut session).into_iter().filter_map(ended).collect();
    assert_eq!(ended, [Outcome::Identified, Outcome::Cancelled(Job::StreamOff)]);
    // Rows on either side of the gap say nothing of the repetition time.
    let [gone, back, pressed, over] = [1_000, 31_000, 31_100, 33_000].map(Instant::from_millis);
    let mut session = Session::new(115_200);
    session.handle_bytes(gone, ROW.as_bytes());
    session.link_lost(gone);
    session.link_back(back);
    assert_eq!(session.facts().stream, None, "nobody has heard a row since");
    session.handle_bytes(back, ROW.as_bytes());
    press(&mut session, pressed, "t");
    pass(&mut session, over);
    assert_eq!(session.facts().stream, None, "silence for a moment after T, and not for two times 30 s");
}

#[test]
fn what_waits_while_a_key_leaves_is_recorded_after_it() {
    let [early, late, now] = [500, 600, 1_000].map(Instant::from_millis);
    let arrived = |at, text: &str| [Arrived { at, bytes: text.into() }];
    let mut session = Session::new(115_200);
    session.begin_backlog(now, &arrived(early, "a"));
    press(&mut session, now, "m");
    session.handle_backlog(now, &arrived(late, "b"));
    let entries: Vec<_> = session.record().entries().map(|entry| (entry.at, entry.bytes.clone())).collect();
    assert_eq!(entries, [(early, b"a".to_vec()), (now, b"m".to_vec()), (now, b"b".to_vec())]);
}

#[test]
fn that_a_file_is_held_is_told_once_whatever_comes_meanwhile() {
    let [held, over] = [10, 9_000].map(Instant::from_millis);
    let mut session = Session::new(115_200);
    session.command(Instant::ZERO, Command::SendFile(vec![b'x'; 1_000])).expect("it is free");
    while session.poll_transmit().is_some() {}
    session.handle_bytes(held, b"\x13");
    pass(&mut session, over);
    session.handle_bytes(over, ROW.as_bytes());
    let told = news(&mut session).into_iter().filter(|event| matches!(event, Event::FileHeld { .. })).count();
    assert_eq!((told, session.job()), (1, Some(Job::SendFile)));
}

#[test]
fn two_complete_walks_right_after_each_other_are_two_readings_of_a_recording() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    for _ in 0..2 {
        let outcome = bench.ask(Command::ReadDictionary);
        assert!(matches!(outcome, Outcome::DictionaryRead(_)), "{outcome:?}");
    }
    let mut session = Session::of_recording(115_200);
    session.command(Instant::ZERO, Command::Overhear).expect("it listens");
    for entry in bench.session.record().entries() {
        pass(&mut session, entry.at);
        match entry.direction {
            Direction::ToUnit => session.handle_sent(entry.at, &entry.bytes),
            Direction::FromUnit => session.handle_bytes(entry.at, &entry.bytes),
        }
    }
    session.recording_over(bench.now);
    let is_complete = |event: &Event| matches!(event, Event::Overheard { reading, .. } if reading.is_complete());
    assert_eq!(news(&mut session).iter().filter(|event| is_complete(event)).count(), 2);
}
