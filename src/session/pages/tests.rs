//! Stories: what was typed (`>`) and what came, or that the link was lost for a moment (`!`), each with the milliseconds
//! since the entry before. Each story is played twice: as a recording to the job that listens to it, and in a live
//! session with keys typed by hand. Both have to come to the same result.

use crate::endpoint::Endpoint;
use crate::session::{Command, Event, Session};
use crate::time::Instant;

type Story<'a> = &'a [(u64, &'a str)];

/// The result of a story.
#[derive(Debug, PartialEq, Eq)]
struct Told {
    pages: Vec<Vec<String>>,
    /// Lines that were not understood.
    unknown: u64,
    /// Whether the unit shows its diagnostics at the end of the story.
    shows: bool,
}

/// How long after its last piece a story ends: long enough for the end of a page, and for nothing else.
const TAIL: u64 = 850;

fn tell(mut session: Session, story: Story<'_>, typed: fn(&mut Session, Instant, &str)) -> Session {
    let mut millis = 0;
    for (behind, text) in story.iter().chain([&(TAIL, "")]) {
        // Timers that expire on the way are handled when they do.
        let until = Instant::from_millis(millis + behind);
        while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
            session.handle_timeout(due);
            while session.poll_transmit().is_some() {}
        }
        millis += behind;
        match text.strip_prefix('>') {
            Some(keys) => typed(&mut session, until, keys),
            None if *text == "!" => {
                session.link_lost(until);
                session.link_back(until);
            }
            None if text.is_empty() => session.handle_timeout(until),
            None => session.handle_bytes(until, text.as_bytes()),
        }
    }
    session
}

fn told(mut session: Session) -> Told {
    let facts = session.facts();
    let (unknown, shows) = (facts.unrecognised_lines, facts.diagnostics.is_some());
    let mut pages = Vec::new();
    while let Some(event) = session.poll_event() {
        if let Event::Page { lines, .. } = event {
            pages.push(lines.into_iter().map(|line| line.text).collect());
        }
    }
    Told { pages, unknown, shows }
}

fn by_hand(session: &mut Session, now: Instant, keys: &str) {
    session.command(now, Command::Keys(keys.as_bytes().to_vec())).expect("no job runs");
    while session.poll_transmit().is_some() {}
}

fn both(story: Story<'_>) -> Told {
    let mut recording = Session::of_recording(115_200);
    recording.command(Instant::ZERO, Command::Diagnostics { pages: None }).expect("it is free");
    let recorded = tell(recording, story, |session, now, keys| session.handle_sent(now, keys.as_bytes()));
    let live = tell(Session::new(115_200), story, by_hand);
    let (recorded, live) = (told(recorded), told(live));
    assert_eq!(recorded, live, "a recording, and a live session");
    live
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

/// Number of pages, lines that were not understood, and whether pages are shown at the end.
fn outcome(story: Story<'_>) -> (usize, u64, bool) {
    let told = both(story);
    (told.pages.len(), told.unknown, told.shows)
}

const PAGE: &str = "Supply 24.1 V\r\nTC1 100.0 C\r\n";
const LONG: &str = "Supply 24.1 V\r\nTC1 100.0 C\r\nTC2 110.0 C\r\nTC3 120.0 C\r\nTC4 130.0 C\r\nCJ 23.0 C\r\n";
const BANNER: &str = "Some Corporation 1\r\nAXTC4CO V1.1.0\r\nNode-ID: 127\r\n";
const SWITCH: [(u64, &str); 3] = [(1_000, ">t"), (10, "F - field value, P - process value: "), (500, ">f")];
const SWITCHED: [(u64, &str); 3] = [
    (10, "\r\nRepetition rate in ms (1-60000) [1000]: "),
    (500, ">30000\r"),
    (10, "30000\r\nStream is now ON: every 30000 ms.\r\n"),
];

#[test]
fn after_the_key_for_it_the_first_page_counts_and_otherwise_the_one_that_comes_again() {
    for (story, expected) in [
        (&[(0, ">s"), (800, PAGE)][..], (1, 0, true)),
        (&[(0, ">s"), (800, PAGE), (1_000, PAGE), (100, ">s"), (3_000, "")], (2, 0, false)),
        // No key is known to have been pressed: two of these are pages, one may be anything.
        (&[(0, PAGE)], (0, 2, false)),
        (&[(0, PAGE), (1_000, PAGE)], (2, 0, true)),
        (&[(0, PAGE), (1_000, PAGE), (1_000, "Something 1 else\r\n"), (1_000, PAGE), (1_000, PAGE)], (4, 1, true)),
        // Keys are typed: only what comes by itself, a second apart, is a page.
        (&[(0, ">1"), (3_000, PAGE), (1_000, PAGE)], (2, 0, true)),
        (&[(0, ">1"), (3_000, PAGE), (2_500, PAGE)], (0, 4, false)),
        (&[(0, ">1"), (3_000, PAGE), (300, ">1"), (700, PAGE)], (0, 4, false)),
    ] {
        assert_eq!(outcome(story), expected, "{story:?}");
    }
}

#[test]
fn a_dialogue_is_not_a_page_and_pages_come_before_and_after_one() {
    let twice = [SWITCH, SWITCHED, SWITCH, SWITCHED].concat();
    assert!(both(&twice).pages.is_empty());
    let story = [&twice[..], &[(1_000, ">s"), (800, PAGE), (1_000, PAGE), (100, ">s"), (900, "Off 1.\r\n")]].concat();
    assert_eq!(both(&story).pages.len(), 2);
    let story = [(0, PAGE), (1_000, PAGE), (500, ">m"), (500, PAGE), (1_000, PAGE), (1_000, PAGE)];
    assert_eq!(outcome(&story), (5, 0, true));
}

#[test]
fn a_page_that_answers_come_with_is_given_without_them() {
    let menu = format!("V - View Object Dictionary 1\r\nanything 7\r\n{PAGE}");
    let told = both(&[(0, ">s"), (800, PAGE), (900, ">m"), (100, &menu)]);
    assert_eq!(told.pages, [lines(PAGE), lines(PAGE)]);
    // Most of a page has to remain: the view may have a line like one of the page.
    let told = both(&[(0, ">s"), (800, LONG), (900, ">v"), (100, "TC1 100.0 C\r\n7 more\r\n")]);
    assert_eq!(told.pages, [lines(LONG)]);
    // The echo of the key, its answer, and the end of a row of the stream. What says the same on a later page is a line
    // of that page.
    let told = both(&[(0, ">s"), (100, &format!("s{PAGE}"))]);
    assert_eq!(told.pages, [lines(PAGE)]);
    let headed = format!("Diagnostics running\r\n{PAGE}");
    let told = both(&[(0, ">s"), (800, &headed), (1_000, &headed)]);
    assert_eq!(told.pages, [lines(PAGE), lines(&headed)]);
    let told = both(&[(0, ">s"), (800, &format!("-12.750\r\n{PAGE}"))]);
    assert_eq!(told.pages, [lines(PAGE)]);
}

#[test]
fn the_last_line_of_a_page_needs_no_end() {
    let page = PAGE.trim_end();
    assert_eq!(both(&[(0, ">s"), (800, page), (1_000, page)]).pages, [lines(PAGE), lines(PAGE)]);
}

#[test]
fn what_looks_like_a_page_changes_with_the_pages_that_come_by_themselves() {
    let other = "Board 30.0 C\r\nFan 1200 rpm\r\n";
    let story = [(0, PAGE), (1_000, PAGE), (1_000, other), (1_000, other), (500, ">m"), (500, other)];
    assert_eq!(both(&story).pages.len(), 5);
    // One line that looks like one of its does not make a page of two that do not.
    let unlike = "TC1 100.0 C\r\nOther 7 things\r\nMore 8 things\r\n";
    assert_eq!(both(&[(0, ">s"), (800, PAGE), (1_000, unlike)]).pages, [lines(PAGE)]);
}

#[test]
fn a_link_that_was_lost_parts_what_came_before_from_what_comes_after() {
    assert_eq!(outcome(&[(0, PAGE), (500, "!"), (500, PAGE)]), (0, 4, false), "and not pages by themselves");
    assert_eq!(outcome(&[(0, ">s"), (800, PAGE), (500, "!"), (500, PAGE)]), (2, 0, true), "it still looks like one");
    // That no pages are shown any more is told, once.
    let mut session = tell(Session::new(115_200), &[(0, ">s"), (800, PAGE)], by_hand);
    assert!(session.facts().diagnostics.is_some());
    while session.poll_event().is_some() {}
    let lost = Instant::from_millis(1_700);
    session.link_lost(lost);
    session.link_lost(lost);
    assert_eq!(session.facts().diagnostics, None);
    assert_eq!((session.poll_event(), session.poll_event()), (Some(Event::FactsChanged), None));
}

#[test]
fn a_key_in_the_middle_of_what_may_be_a_page_makes_it_doubtful() {
    let (first, second) = PAGE.split_at(PAGE.find("TC1").expect("it is there"));
    let doubtful = [(0, ">s"), (800, first), (5, ">1"), (5, second)];
    assert_eq!(both(&doubtful).pages.len(), 0);
    // The next page is not doubtful.
    let story = [&doubtful[..], &[(1_000, PAGE)]].concat();
    assert_eq!(both(&story).pages.len(), 1);
    // So does what only a loader says, and a file that is sent.
    let restarting = format!("{first}Restarting.\r\n{second}");
    assert_eq!(both(&[(0, ">s"), (800, &restarting)]).pages.len(), 0);
    assert_eq!(both(&[(0, ">s"), (100, ">S00600004844521B something"), (500, PAGE)]).pages.len(), 0);
    // A key that was sent together with the S has been answered by then.
    assert_eq!(both(&[(0, ">ms"), (800, PAGE)]).pages.len(), 1);
}

#[test]
fn a_page_may_pause_between_its_lines() {
    let lines = |pause| [(pause, "Supply 24.1 V\r\n"), (250, "TC1 100.0 C\r\n"), (250, "CJ 23.0 C\r\n")];
    let unasked = both(&[lines(0), lines(500)].concat());
    assert_eq!(unasked.pages.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
    let asked = both(
        &[&[(0, ">s")][..], &lines(800), &lines(500), &[(100, ">s"), (100, "CJ 23.0 C\r\n"), (2_000, "")]].concat(),
    );
    assert_eq!((asked.pages.len(), asked.shows), (2, false), "and none after the key");
}

#[test]
fn lines_that_never_pause_are_no_pages_unless_somebody_asks_for_them() {
    let endless: Vec<(u64, &str)> = std::iter::repeat_n((300, "Supply 24.1 V\r\n"), 20).collect();
    assert_eq!(both(&endless).pages.len(), 0);
    let at_once = "Supply 24.1 V\r\n".repeat(3);
    let pauses_at_last = [&endless[..3], &[(300, at_once.as_str())]].concat();
    assert_eq!(both(&pauses_at_last).pages.len(), 0, "the three before did not pause");
}

#[test]
fn other_keys_of_the_menu_end_the_wait_for_a_first_page() {
    for (key, pages) in [(">m", 0), (">v", 0), (">1", 1), (">x", 1)] {
        assert_eq!(both(&[(0, ">s"), (10, key), (1_500, PAGE)]).pages.len(), pages, "{key}");
    }
    // The letters of a file are no keys.
    assert_eq!(outcome(&[(0, ">S00600004844521B something"), (1_500, PAGE)]), (0, 2, false));
}

#[test]
fn the_key_stops_pages_whoever_has_started_them_and_the_one_under_way_is_no_sign_against_it() {
    let (first, second) = PAGE.split_at(PAGE.find("TC1").expect("it is there"));
    let stopped = [(0, PAGE), (1_000, PAGE), (1_000, first), (5, ">s"), (5, second)];
    assert!(both(&stopped).shows, "it may have been lost");
    assert!(!both(&[&stopped[..], &[(1_200, "")]].concat()).shows);
    assert!(both(&[&stopped[..], &[(990, PAGE)]].concat()).shows, "it was");
}

#[test]
fn a_unit_says_itself_whether_pages_come() {
    let started = [(0, ">s"), (20, "Diagnostics started.\r\n")];
    assert!(both(&started).shows, "before any page");
    assert!(!both(&[&started[..], &[(7_000, "")]].concat()).shows, "none has come");
    assert!(!both(&[(0, ">1"), (20, "Diagnostics started.\r\n")]).shows, "nobody has asked for them");
    let stopped = [(0, ">s"), (800, PAGE), (500, ">s"), (20, "Diagnostics stopped.\r\n")];
    assert!(!both(&stopped).shows);
    assert!(both(&[(0, ">s"), (800, PAGE), (900, "Diagnostics stopped.\r\n")]).shows, "a line like any other");
}

#[test]
fn a_unit_that_restarts_shows_no_pages_any_more() {
    let defaults =
        [(0, ">d"), (10, "Enter Yes to restore the defaults: "), (900, ">Yes\r"), (10, "Yes\r\n"), (10, BANNER)];
    assert!(both(&defaults).pages.is_empty());
    let shown = [(0, ">s"), (500, PAGE), (1_000, PAGE)];
    let story = [&shown[..], &[(5_000, BANNER), (5_000, "Node-ID: 127\r\n")]].concat();
    assert_eq!(both(&story).pages.len(), 2);
    for (piece, shows) in [
        ((900, "AXTC4CO V1.1.0\r\n"), false),
        ((900, "Waiting for application S-Record\r\n"), false),
        ((900, "Restarting.\r\n"), true),
    ] {
        assert_eq!(both(&[&shown[..], &[piece]].concat()).shows, shows, "{piece:?}");
    }
    // The menu that was asked for says the name as well.
    assert!(both(&[&shown[..], &[(500, ">m"), (20, "AXTC4CO V1.1.0\r\n")]].concat()).shows);
}
