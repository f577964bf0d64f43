//! The session's jobs with nobody at the other end but a script: what is sent, when, and how the job ends. Nothing wakes
//! the session but its own deadlines, so a wait that does not end by itself shows here and nowhere else.

mod edges;
mod typed;
mod uploads;
mod walks;

use axcon::device::Product;
use axcon::endpoint::Endpoint;
use axcon::session::{Awaited, Command, Event, FileEnd, Job, LoadReport, Outcome, Refusal, Session, Verdict, WalkEnd};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;

use crate::support::bench::{order, small_image};
use crate::support::words::{ROW, millis, on};

/// A session, what it has sent, and what the other end says to that.
struct Alone {
    session: Session,
    now: Instant,
    /// Each piece that was sent, with the milliseconds since the command.
    sent: Vec<(u64, String)>,
    pages: usize,
    /// The lines of all pages.
    lines: Vec<String>,
    /// What is said when a piece that begins so has been sent, and how many milliseconds later; the last one is the next.
    /// Without a piece it belongs to the one before.
    script: Vec<(&'static str, u64, &'static str)>,
    /// What is under way.
    says: Vec<(Instant, &'static str)>,
}

impl Alone {
    fn with(script: &[(&'static str, u64, &'static str)]) -> Self {
        let script = script.iter().rev().copied().collect();
        let session = Session::new(115_200);
        Alone { session, now: Instant::ZERO, sent: Vec::new(), pages: 0, lines: Vec::new(), script, says: Vec::new() }
    }

    /// Gives a command and lets its job come to its end: how, and behind how many milliseconds.
    fn ask(&mut self, command: Command) -> (Outcome, u64) {
        let begun = self.now;
        self.session.command(self.now, command).expect("it is free");
        self.end(begun)
    }

    fn end(&mut self, begun: Instant) -> (Outcome, u64) {
        loop {
            self.take_sent(begun);
            while let Some(event) = self.session.poll_event() {
                match event {
                    Event::Finished(outcome) => return (outcome, millis(self.now.since(begun))),
                    Event::Page { lines, .. } => {
                        self.pages += 1;
                        self.lines.extend(lines.into_iter().map(|line| line.text));
                    }
                    _ => {}
                }
            }
            self.step();
        }
    }

    /// Takes what has been sent, and what is said to it.
    fn take_sent(&mut self, begun: Instant) {
        while let Some(piece) = self.session.poll_transmit() {
            let text = String::from_utf8(piece.bytes).expect("keys").replace('\r', "~");
            // A piece that is awaited, and everything that is said behind it.
            if self.script.last().is_some_and(|(awaited, _, _)| !awaited.is_empty() && text.starts_with(awaited)) {
                let (_, late, says) = self.script.pop().expect("the last one");
                self.says.push((self.now + Duration::from_millis(late), says));
                while let Some((_, late, says)) = self.script.pop_if(|(awaited, _, _)| awaited.is_empty()) {
                    self.says.push((self.now + Duration::from_millis(late), says));
                }
            }
            self.sent.push((millis(self.now.since(begun)), text));
        }
    }

    /// Goes on to the next moment at which something happens.
    fn step(&mut self) {
        self.take_sent(Instant::ZERO);
        let due = self.session.poll_timeout();
        self.says.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
        let said = self.says.last().map(|(at, _)| *at);
        let next = due.into_iter().chain(said).min().expect("a job has a deadline");
        self.now = next.max(self.now);
        assert!(self.now < Instant::from_millis(180_000), "an end");
        match self.says.pop_if(|(at, _)| *at <= self.now) {
            Some((_, text)) => self.session.handle_bytes(self.now, text.as_bytes()),
            None => self.session.handle_timeout(self.now),
        }
    }

    /// Everything that was sent, with times.
    fn log(&self) -> String {
        self.sent.iter().map(|(at, text)| format!("{at}:{text}")).collect::<Vec<_>>().join(" ")
    }
}

fn at(moment: Instant) -> u64 {
    millis(moment.since(Instant::ZERO))
}

/// What becomes of an upload to a unit that says this behind L, and behind the password.
fn upload_behind(script: &[(&'static str, u64, &'static str)]) -> (LoadReport, Alone) {
    let mut alone = Alone::with(&[&[("\u{11}m", 3, MENU)][..], script].concat());
    match alone.ask(Command::Load(Box::new(order(small_image("AXRTD8CO", "1.2.0"))))) {
        (Outcome::Loaded(report), _) => (*report, alone),
        (other, _) => panic!("{other:?}"),
    }
}

/// How many milliseconds behind L the password was sent, if it was.
fn password_at(alone: &Alone) -> Option<u64> {
    let at = |key: &str| alone.sent.iter().find(|(_, text)| text == key).map(|(at, _)| *at);
    Some(at("AXIO-2010")? - at("l").expect("L"))
}

/// All that is recorded, in both directions.
fn recorded(session: &Session) -> String {
    let bytes: Vec<u8> = session.record().entries().flat_map(|entry| entry.bytes.clone()).collect();
    String::from_utf8(bytes).expect("text")
}

const MENU: &str = "AXRTD8CO V1.0.0\r\nV - View Object Dictionary\r\nD - Default Object Dictionary\r\n\
                    T - Toggle Stream\r\nS - Diagnostics\r\nL - Load New Software\r\n";

const TC_MENU: &str = "AXTC4CO V1.1.0\r\nV - View Object Dictionary\r\nD - Default Object Dictionary\r\n\
                       T - Toggle Stream\r\nS - Diagnostics\r\nL - Load New Software\r\n";

#[test]
fn a_silent_line_ends_every_job_by_its_own_deadlines() {
    let no_answer = |job, awaited| Outcome::NoAnswer { job, awaited, heard: None };
    let table = [
        (on(), no_answer(Job::StreamOn, Awaited::SourceQuestion), "0:t 1500:t 3000:~", 3000),
        (Command::StreamOff, no_answer(Job::StreamOff, Awaited::StreamOff), "0:t 1500:m", 3000),
        (Command::RestoreDefaults, no_answer(Job::RestoreDefaults, Awaited::DefaultsQuestion), "0:d 1500:No~", 1500),
        (Command::Diagnostics { pages: Some(1) }, no_answer(Job::Diagnostics, Awaited::Page), "1300:s", 1300 + 6500),
        (
            Command::ReadDictionary,
            no_answer(Job::ReadDictionary, Awaited::Dictionary),
            "0:v 1200:x 1320:m 2520:x 2640:m 3840:x 3960:m",
            5160,
        ),
        (Command::Identify, Outcome::Identified, "0:\u{11}m 800:~m 1600:xm", 2400),
    ];
    for (command, outcome, log, time) in table {
        let mut alone = Alone::with(&[]);
        let name = format!("{command:?}");
        assert_eq!(alone.ask(command), (outcome, time), "{name}: {}", alone.log());
        assert_eq!(alone.log(), log, "{name}");
    }
}

#[test]
fn rows_behind_the_key_that_stops_them_are_forgiven_for_a_moment_and_it_is_pressed_three_times() {
    let mut alone = Alone::with(&[("t", 299, ROW), ("", 300, ROW), ("t", 400, ROW), ("t", 299, ROW), ("", 301, ROW)]);
    let (outcome, time) = alone.ask(Command::StreamOff);
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::StreamOff, heard: Some(_), .. }), "{outcome:?}");
    assert_eq!((alone.log().as_str(), time), ("0:t 300:t 700:t", 1001));
    // The second press is heard.
    let mut alone = Alone::with(&[("t", 310, ROW)]);
    assert_eq!(alone.ask(Command::StreamOff), (Outcome::Done(Job::StreamOff), 310 + 1500), "{}", alone.log());
    assert_eq!(alone.session.facts().stream, None, "the row that came is history");
}

#[test]
fn what_looked_like_a_page_before_the_key_does_not_keep_anybody_from_pressing_it() {
    let page = "Supply voltage: 24.1 V\r\nInternal temperature: 31.0 C\r\n";
    // Something with numbers comes once, unasked, then nothing: the pages have to be switched on all the same.
    let mut alone = Alone::with(&[("s", 900, page), ("s", 1000, ""), ("m", 5, MENU)]);
    alone.says.push((Instant::from_millis(500), page));
    let (outcome, _) = alone.ask(Command::Diagnostics { pages: Some(2) });
    assert_eq!((outcome, alone.pages), (Outcome::Done(Job::Diagnostics), 2), "{}", alone.log());
    // 500, 400 of silence, 2,500 without a next page; 900, 400, and the key that stops them. The menu shows that the
    // silence after it is not that of a unit without power.
    assert_eq!(alone.log(), "3400:s 4700:s 6200:m");
}

#[test]
fn a_page_that_was_under_way_is_no_sign_that_the_key_was_lost_and_a_later_one_is() {
    let page = "Supply voltage: 24.1 V\r\n";
    let script = [("s", 100, page), ("s", 300, page), ("", 1300, page), ("s", 10, "Off.\r\n")];
    let mut alone = Alone::with(&script);
    let (outcome, time) = alone.ask(Command::Diagnostics { pages: Some(1) });
    assert_eq!((outcome, alone.pages), (Outcome::Done(Job::Diagnostics), 1), "{}", alone.log());
    // Asked at 1,300, a page complete at 1,800, one under way at 2,100, and one too many at 3,100.
    assert_eq!((alone.log().as_str(), time), ("1300:s 1800:s 3500:s", 5000));
    // A unit that does not stop at all is told so.
    let script = [("s", 100, page), ("s", 1000, page), ("s", 1000, page), ("s", 1000, page)];
    let (outcome, _) = Alone::with(&script).ask(Command::Diagnostics { pages: Some(1) });
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::DiagnosticsOff, .. }), "{outcome:?}");
}

#[test]
fn silence_is_no_proof_that_anything_is_off() {
    // The unit says nothing to T, but is there.
    let mut alone = Alone::with(&[("m", 5, MENU)]);
    assert_eq!(alone.ask(Command::StreamOff), (Outcome::Done(Job::StreamOff), 1500 + 5 + 400), "{}", alone.log());
    assert_eq!(alone.log(), "0:t 1500:m");
    // Its power goes with the key that stops the pages.
    let page = "Supply voltage: 24.1 V\r\n";
    let mut alone = Alone::with(&[("s", 100, page)]);
    let (outcome, time) = alone.ask(Command::Diagnostics { pages: Some(1) });
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::DiagnosticsOff, .. }), "{outcome:?}");
    assert_eq!((alone.log().as_str(), time), ("1300:s 1800:s 3300:m", 4800));
}

#[test]
fn a_slow_stream_counts_as_on_once_its_time_is_taken_and_a_refused_time_is_told_with_the_question() {
    let slow = || Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(60_000) };
    let period = "Every how many ms (100-50000)? ";
    let dialogue = [("t", 5, "F - field value, P - process value: "), ("f", 5, period)];
    // Nobody refuses it: on, long before its first row.
    let mut alone = Alone::with(&[&dialogue[..], &[("60000~", 5, "OK\r\n"), ("", 30_000, ROW)]].concat());
    alone.session.command(alone.now, slow()).expect("it is free");
    while alone.session.facts().stream.is_none() {
        alone.step();
    }
    assert!(alone.now < Instant::from_millis(2_000), "{:?}", alone.now);
    let (outcome, _) = alone.end(Instant::ZERO);
    assert_eq!(outcome, Outcome::StreamRuns { was_on: false });
    // It asks once more, which refuses without a word that is known.
    let mut alone = Alone::with(&[&dialogue[..], &[("60000~", 5, period)]].concat());
    let (outcome, time) = alone.ask(slow());
    let Outcome::Refused { reason, .. } = outcome else { panic!("{outcome:?}") };
    assert_eq!(reason, "the unit did not take 60000 ms, asked for with \"Every how many ms (100-50000)?\"");
    assert_eq!((time, alone.log().as_str()), (3_230, "0:t 65:f 130:60000~ 730:~"), "the question is left");
    assert_eq!(alone.session.facts().stream, None);
    // The same late.
    let mut alone = Alone::with(&[&dialogue[..], &[("60000~", 1_500, period)]].concat());
    let (outcome, time) = alone.ask(slow());
    assert!(matches!(outcome, Outcome::Refused { .. }), "{outcome:?}");
    assert_eq!((time, alone.log().as_str()), (4_190, "0:t 65:f 130:60000~ 1690:~"));
    assert_eq!(alone.session.facts().stream, None);
    // No row comes: it was not on after all.
    let mut alone = Alone::with(&dialogue);
    let (outcome, _) = alone.ask(slow());
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::Row, .. }), "{outcome:?}");
    assert_eq!(alone.session.facts().stream, None);
}

#[test]
fn a_dialogue_that_is_cancelled_is_left_with_enter_and_one_that_is_over_is_not() {
    let cancelled = |command: Command, script: &[(&'static str, u64, &'static str)], behind: &str| {
        let mut alone = Alone::with(script);
        alone.session.command(alone.now, command).expect("it is free");
        alone.take_sent(Instant::ZERO);
        while !alone.log().contains(behind) {
            alone.step();
            alone.take_sent(Instant::ZERO);
        }
        alone.session.command(alone.now, Command::Cancel).expect("always");
        let (outcome, _) = alone.end(Instant::ZERO);
        (
            outcome,
            alone.log().split(' ').next_back().unwrap_or_default().split(':').nth(1).unwrap_or_default().to_owned(),
        )
    };
    let defaults = [("d", 3, "Enter Yes to restore the default object dictionary: ")];
    let stream =
        [("t", 5, "F - field value, P - process value: "), ("f", 5, "Every how many ms? "), ("200~", 5, "OK\r\n")];
    let table = [
        (on(), &[][..], ":t", Job::StreamOn, "~"),
        (on(), &stream, ":f", Job::StreamOn, "~"),
        (on(), &stream, ":200~", Job::StreamOn, "200~"),
        (Command::StreamOff, &[], ":t", Job::StreamOff, "~"),
        (Command::RestoreDefaults, &defaults, ":d", Job::RestoreDefaults, "No~"),
        (Command::RestoreDefaults, &defaults, ":Yes~", Job::RestoreDefaults, "Yes~"),
    ];
    for (command, script, behind, job, last) in table {
        assert_eq!(cancelled(command, script, behind), (Outcome::Cancelled(job), last.to_owned()), "{job:?} {behind}");
    }
}

#[test]
fn a_unit_that_takes_the_enter_for_values_of_its_own_does_not_stream_on() {
    let asks = [("t", 5, "6100 or 7130 [6100]: "), ("~", 5, "\r\nRepeat after [1000]: "), ("~", 5, ROW)];
    let mut alone = Alone::with(&asks);
    let (outcome, _) = alone.ask(on());
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::SourceQuestion, .. }), "{outcome:?}");
    assert_eq!(alone.log(), "0:t 1500:~ 4000:~ 4005:t");
    assert_eq!(alone.session.facts().stream, None);
    // One that asks for ever is left to itself.
    let mut alone = Alone::with(&[("t", 5, "Which? "), ("~", 5, "Which? "), ("~", 5, "Which? "), ("~", 5, "Which? ")]);
    let (outcome, time) = alone.ask(on());
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::SourceQuestion, .. }), "{outcome:?}");
    assert_eq!((alone.log().as_str(), time), ("0:t 1500:~ 4000:~ 6500:~", 9_000));
    // What streams already when its questions are not understood was found so.
    let mut alone = Alone::with(&[("t", 5, "off\r\n"), ("t", 5, "6100 or 7130 [6100]: "), ("~", 5, ROW)]);
    let (outcome, _) = alone.ask(on());
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::SourceQuestion, .. }), "{outcome:?}");
    assert!(alone.log().ends_with(":~"), "{}", alone.log());
}

#[test]
fn a_walk_goes_on_over_objects_that_nobody_can_read() {
    let (first, last) = ("6126h:01 TC1 = 16.000\r\n", "6126h:02 TC2 = 17.000\r\n");
    let unread = [("~", 5, "one 1\r\n"), ("~", 5, "two 2\r\n"), ("~", 5, "three 3\r\n"), ("~", 5, "four 4\r\n")];
    let read = |script: &[(&'static str, u64, &'static str)]| match Alone::with(script).ask(Command::ReadDictionary).0 {
        Outcome::DictionaryRead(reading) => (reading.entries.len(), reading.end),
        other => panic!("{other:?}"),
    };
    let over = [&[("v", 5, first)][..], &unread, &[("~", 5, last)]].concat();
    assert_eq!(read(&over), (2, WalkEnd::Stopped), "and ends where nothing is answered");
    // What says the same again and again is the end.
    let same = [&[("v", 5, first)][..], &[("~", 5, "page 1\r\n"); 8], &[("~", 5, last)]].concat();
    assert_eq!(read(&same), (1, WalkEnd::NotUnderstood { first: "page 1".into() }));
}

#[test]
fn a_question_that_nobody_expects_is_left_and_a_refusal_is_one() {
    // Somebody has left L open.
    let mut alone = Alone::with(&[("t", 5, "Password: ")]);
    let (outcome, _) = alone.ask(on());
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::SourceQuestion, .. }), "{outcome:?}");
    assert!(alone.log().ends_with(":~"), "{}", alone.log());
    let mut alone = Alone::with(&[("s", 5, "Password: ")]);
    let (outcome, _) = alone.ask(Command::Diagnostics { pages: Some(1) });
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::Page, .. }), "{outcome:?}");
    assert!(alone.log().ends_with(":~"), "{}", alone.log());
    // The unit refuses in words that are known; rows of the other source are no proof.
    let period = ("f", 5, "Every how many ms? ");
    let script =
        [("t", 5, "F - field value, P - process value: "), period, ("200~", 5, "Invalid rate: not 1..100\r\n")];
    let (outcome, time) = Alone::with(&script).ask(on());
    assert!(matches!(outcome, Outcome::Refused { job: Job::StreamOn, .. }) && time < 600, "{outcome:?} {time}");
    let other = " 4768;    0;Null ;Open ;32128\r\n";
    let script = [script[0], period, ("200~", 5, other), ("", 900, ROW)];
    let (outcome, time) = Alone::with(&script).ask(on());
    assert!(outcome == Outcome::StreamRuns { was_on: false } && time > 900, "{outcome:?} {time}");
}

#[test]
fn a_file_goes_as_fast_as_the_line_and_not_to_a_unit_that_does_not_take_what_was_typed() {
    let mut alone = Alone::with(&[]);
    let (outcome, time) = alone.ask(Command::SendFile(vec![b'x'; 11_520]));
    assert_eq!(outcome, Outcome::FileSent { sent: 11_520, total: 11_520, end: FileEnd::Whole });
    assert!((990..1_010).contains(&time), "a second's worth of characters: {time}");
    let mut alone = Alone::with(&[]);
    alone.session.handle_bytes(alone.now, b"\x13");
    assert_eq!(alone.session.may_send_file(), Ok(()), "nothing waits");
    alone.session.command(alone.now, Command::Keys(b"m".to_vec())).expect("it waits");
    assert_eq!(alone.session.command(alone.now, Command::SendFile(b"x".to_vec())), Err(Refusal::Held));
    // A cable that comes back has no hold, and nothing of what waited; but the unit may still be asking.
    alone.session.handle_bytes(alone.now, b"\x11Password: ");
    assert!(alone.session.password_open());
    alone.session.link_lost(alone.now);
    assert_eq!(alone.session.waiting(), 0);
    alone.session.link_back(alone.now);
    assert!(alone.session.password_open() && alone.session.held_since().is_none());
    assert_eq!(alone.session.command(alone.now, Command::SendFile(b"x".to_vec())), Err(Refusal::PasswordOpen));
    alone.session.command(alone.now, Command::Keys(b"\r".to_vec())).expect("it is free");
    assert_eq!(alone.session.may_send_file(), Ok(()));
}

#[test]
fn a_file_that_the_unit_does_not_let_go_on_waits_for_it_and_says_so_once() {
    let mut alone = Alone::with(&[]);
    alone.session.command(alone.now, Command::SendFile(vec![b'x'; 1_000])).expect("it is free");
    alone.take_sent(Instant::ZERO);
    let hold = |alone: &mut Alone, at: u64, byte: &[u8]| {
        alone.now = Instant::from_millis(at);
        alone.session.handle_bytes(alone.now, byte);
        alone.take_sent(Instant::ZERO);
    };
    // What comes of it, and when, until nothing is due any more.
    let news = |alone: &mut Alone| {
        let mut news = Vec::new();
        while let Some(due) = alone.session.poll_timeout() {
            alone.now = due.max(alone.now);
            alone.session.handle_timeout(alone.now);
            alone.take_sent(Instant::ZERO);
            while let Some(event) = alone.session.poll_event() {
                match event {
                    Event::FileHeld { since, sent, total } => {
                        news.push(format!("{}: {sent} of {total} since {}", at(alone.now), at(since)));
                    }
                    Event::Finished(outcome) => news.push(format!("{}: {outcome:?}", at(alone.now))),
                    _ => {}
                }
            }
        }
        news
    };
    hold(&mut alone, 10, b"\x13");
    assert_eq!(news(&mut alone), ["3010: 64 of 1000 since 10"], "and nobody wakes for it any more");
    assert_eq!(alone.session.job(), Some(Job::SendFile), "it is not given up");
    // A hold of a moment is none of the user's business, one more that is long is.
    hold(&mut alone, 60_000, b"\x11");
    hold(&mut alone, 60_010, b"\x13");
    hold(&mut alone, 60_020, b"\x11");
    hold(&mut alone, 60_030, b"\x13");
    let told = news(&mut alone);
    assert!(told.len() == 1 && told[0].starts_with("63030: ") && told[0].ends_with("since 60030"), "{told:?}");
    hold(&mut alone, 70_000, b"\x11");
    let told = news(&mut alone);
    assert!(told.len() == 1 && told[0].contains("sent: 1000, total: 1000, end: Whole"), "{told:?}");
}

#[test]
fn the_question_for_yes_is_answered_twice_at_most_and_only_a_banner_is_the_end() {
    let question = "Enter Yes to restore the default object dictionary: ";
    let script =
        [("d", 3, question), ("Yes~", 50, "\r\nV1.0.0\r\n"), ("", 2_000, "AXTC4CO V1.1.0\r\n"), ("m", 5, MENU)];
    let mut alone = Alone::with(&script);
    let (outcome, time) = alone.ask(Command::RestoreDefaults);
    assert_eq!(outcome, Outcome::Done(Job::RestoreDefaults));
    let (at, _) = alone.sent[1];
    // It has a second to go on, and so has the menu.
    assert_eq!((alone.sent.len(), time), (3, at + 4_005), "a version alone is no banner: {}", alone.log());
    // What the menu shows anyway is none either, and what tells of a failure counts for more than a banner.
    let restored = |behind: &'static str| {
        Alone::with(&[("d", 3, question), ("Yes~", 50, behind), ("m", 5, MENU)]).ask(Command::RestoreDefaults).0
    };
    assert_eq!(restored(MENU), Outcome::DefaultsTaken);
    for failed in
        ["Restoring failed\r\nAXTC4CO V1.1.0\r\n", "EEPROM write error\r\n(c) Axiomatic\r\nAXTC4CO V1.1.0\r\n"]
    {
        let Outcome::Refused { reason, .. } = restored(failed) else { panic!("{failed}") };
        assert!(reason.contains(failed.split("\r").next().expect("a line")), "{reason}");
    }
    // What a unit says as it starts may sound like one.
    let starts = "Watchdog timeout 1 s\r\nParameters invalid, defaults loaded\r\nAXTC4CO V1.1.0\r\n";
    assert_eq!(restored(starts), Outcome::Done(Job::RestoreDefaults));
    // It never comes back.
    let mut alone = Alone::with(&[("d", 3, question), ("Yes~", 50, question), ("Yes~", 50, question)]);
    let (outcome, time) = alone.ask(Command::RestoreDefaults);
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: Awaited::NothingElse, heard: Some(_), .. }));
    assert_eq!((alone.sent.len(), time), (4, alone.sent[2].0 + 10_000 + 1_500), "{}", alone.log());
    assert!(alone.log().ends_with(":No~"), "{}", alone.log());
}

#[test]
fn what_a_job_could_not_send_in_its_time_is_not_sent_later() {
    for (command, typed) in [(Command::Diagnostics { pages: Some(1) }, "x"), (on(), ""), (Command::StreamOff, "")] {
        let name = format!("{command:?}");
        let mut alone = Alone::with(&[]);
        alone.session.handle_bytes(alone.now, b"AXTC4CO V1.1.0\r\n\x13");
        if !typed.is_empty() {
            alone.session.command(alone.now, Command::Keys(typed.as_bytes().to_vec())).expect("it is free");
        }
        let (outcome, _) = alone.ask(command);
        assert!(matches!(outcome, Outcome::NoAnswer { .. }), "{name}: {outcome:?}");
        assert_eq!(alone.log(), "", "{name}");
        alone.now += Duration::from_secs(600);
        alone.session.handle_bytes(alone.now, b"\x11");
        alone.take_sent(alone.now);
        assert_eq!(alone.log(), if typed.is_empty() { "" } else { "0:x" }, "{name}");
    }
    // A password that could not leave was not sent.
    let (report, mut alone) = upload_behind(&[("l", 5, "Password: \x13")]);
    assert_eq!((report.verdict, report.password_sent), (Verdict::UnitRefused, false), "{report:?}");
    assert!(!report.what.contains("did not accept") && password_at(&alone).is_none(), "{report:?}");
    alone.session.handle_bytes(alone.now, b"\x11");
    alone.take_sent(alone.now);
    assert!(alone.log().ends_with(":l"), "{}", alone.log());
}

#[test]
fn a_question_on_a_line_of_its_own_is_answered_when_nothing_follows() {
    // Where the answer goes may be marked on the next line.
    for (asks, at) in [
        ("Enter password:\r\n", 255),
        ("Enter password:\r\n> ", 255),
        ("Enter the password\r\n", 255 + 500),
        ("Please enter the password.\r\n>", 255),
    ] {
        let (report, alone) = upload_behind(&[("l", 5, asks)]);
        assert!(report.password_sent && password_at(&alone) == Some(at), "{asks:?}: {}", alone.log());
    }
    let lines = [
        ("t", 5, "Field value (F) or process value (P)?\r\n"),
        ("f", 5, "Repetition rate in ms (1..60000):\r\n"),
        ("200~", 5, "OK\r\n"),
        ("", 200, ROW),
    ];
    let mut alone = Alone::with(&lines);
    assert_eq!(alone.ask(on()).0, Outcome::StreamRuns { was_on: false }, "{}", alone.log());
    assert!(alone.log().starts_with("0:t 255:f 510:200~"), "{}", alone.log());
    let mut alone = Alone::with(&lines[..1]);
    assert_eq!(alone.ask(Command::StreamOff).0, Outcome::Done(Job::StreamOff));
    assert_eq!(alone.log(), "0:t 255:~", "the question is left");
    let mut alone = Alone::with(&[("d", 5, "Restore the defaults? Enter Yes:\r\n"), ("Yes~", 50, MENU)]);
    alone.ask(Command::RestoreDefaults);
    assert!(alone.log().starts_with("0:d 255:Yes~"), "{}", alone.log());
    let mut alone = Alone::with(&[("d", 5, "Type Yes to restore the defaults\r\n"), ("Yes~", 50, MENU)]);
    alone.ask(Command::RestoreDefaults);
    assert!(alone.log().starts_with("0:d 255:Yes~"), "{}", alone.log());
    // Something follows.
    for follows in ["Ask your dealer\r\n", "Ask"] {
        let (report, alone) = upload_behind(&[("l", 5, "About the password:\r\n"), ("", 200, follows)]);
        assert!(!report.password_sent, "{}", alone.log());
    }
    // A statement is not a question.
    let (report, alone) = upload_behind(&[("l", 5, "Password needed\r\n")]);
    assert!(!report.password_sent, "{}", alone.log());
}

#[test]
fn a_question_after_t_that_is_not_understood_is_left_and_rows_tell_whether_that_was_right() {
    const SOURCE: (&str, u64, &str) = ("t", 5, "Source: field or process?\r\n> ");
    let mut alone = Alone::with(&[SOURCE]);
    let awaited = Awaited::SourceQuestion;
    assert!(matches!(alone.ask(on()).0, Outcome::NoAnswer { awaited: is, .. } if is == awaited), "{}", alone.log());
    assert_eq!(alone.log(), "0:t 405:~");
    let mut alone = Alone::with(&[SOURCE]);
    assert_eq!((alone.ask(Command::StreamOff).0, alone.log().as_str()), (Outcome::Done(Job::StreamOff), "0:t 405:~"));
    // The question was whether to stop, and the rows go on.
    const STOP: [(&str, u64, &str); 2] = [("t", 5, "Stop the stream (Y/N)?\r\n"), ("~", 300, ROW)];
    let mut alone = Alone::with(&[STOP, STOP, STOP].concat());
    let awaited = Awaited::StreamOff;
    let (outcome, _) = alone.ask(Command::StreamOff);
    assert!(matches!(outcome, Outcome::NoAnswer { awaited: is, .. } if is == awaited), "{outcome:?}: {}", alone.log());
    assert_eq!(alone.log(), "0:t 405:~ 705:t 1110:~ 1410:t 1815:~");
    // A row comes on the question's own line.
    let on_its_line =
        [("t", 5, "Turn off (Y/N)?  23.500;  24.125;Disabled;OpenCct ; -12.750\r\n"), ("~", 300, "off\r\n")];
    let mut alone = Alone::with(&on_its_line);
    assert_eq!(alone.ask(Command::StreamOff).0, Outcome::Done(Job::StreamOff));
    assert!(alone.log().starts_with("0:t 405:~"), "{}", alone.log());
}

#[test]
fn pages_that_nobody_understands_are_switched_off_among_rows_as_well() {
    let pages = [1_000, 2_000, 3_000, 4_000, 5_000, 6_000].map(|late| ("", late, "Housing\r\n99.9 C\r\n"));
    let rows = [700, 1_700, 2_700, 3_700, 4_700, 5_700].map(|late| ("", late, ROW));
    let mut alone = Alone::with(&[&[("s", 0, "")][..], &pages, &rows].concat());
    alone.session.handle_bytes(alone.now, ROW.as_bytes());
    let (outcome, _) = alone.ask(Command::Diagnostics { pages: Some(1) });
    assert!(matches!(outcome, Outcome::NoAnswer { job: Job::Diagnostics, .. }), "{outcome:?}");
    assert_eq!(alone.sent.iter().filter(|(_, text)| text == "s").count(), 2, "{}", alone.log());
}

#[test]
fn a_view_that_ends_without_a_word_has_ended_if_nothing_is_missing_and_the_unit_still_answers() {
    let entries = Product::named("AXTC4CO").expect("built in").dictionary.entries();
    let view: String = entries.map(|(at, ..)| format!("{:04X}h:{:02X} x = 0\r\n", at.index, at.sub)).collect();
    let (whole, first) = (&*view.clone().leak(), &*view[..view.len() / 2].to_owned().leak());
    for (view, menu, end) in [
        (whole, ("m", 5, TC_MENU), WalkEnd::Whole),
        (whole, ("m", 5, ""), WalkEnd::Stopped),
        (first, ("m", 5, TC_MENU), WalkEnd::Stopped),
    ] {
        let mut alone = Alone::with(&[("v", 5, view), menu]);
        alone.session.handle_bytes(alone.now, TC_MENU.as_bytes());
        let (Outcome::DictionaryRead(reading), _) = alone.ask(Command::ReadDictionary) else {
            panic!("{}", alone.log())
        };
        assert_eq!(reading.end, end, "{} entries: {}", reading.entries.len(), alone.log());
    }
}

#[test]
fn a_command_that_is_refused_has_changed_nothing() {
    let mut session = Session::new(115_200);
    let now = Instant::from_millis(1);
    session.command(now, Command::StreamOff).expect("it is free");
    let load = Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0"))));
    assert_eq!(session.command(now, load), Err(Refusal::Busy(Job::StreamOff)));
    session.handle_bytes(now, b"AXIO-2010\r\n");
    assert!(recorded(&session).contains("AXIO-2010"), "nobody has said that this is a password");
    // A row without a number is one of the source that was asked for.
    let process = Command::StreamOn { source: Source::ProcessValue, period: Duration::from_millis(200) };
    assert_eq!(session.command(now, process), Err(Refusal::Busy(Job::StreamOff)));
    while session.poll_event().is_some() {}
    session.handle_bytes(now, b"Disabled;Disabled;Disabled;Disabled; -12.750\r\n");
    session.handle_bytes(now, b"Disabled;Disabled;Disabled;Disabled;OpenCct \r\n");
    assert_eq!(session.facts().stream, Some(Source::FieldValue));
}
