//! How jobs end, whatever the unit does and whenever they are cancelled: in time, with nothing left to be sent, and with
//! no question open that they have opened.

use std::collections::VecDeque;

use axcon::endpoint::{Endpoint, Transmit};
use axcon::session::{Awaited, Command, Event, Job, Outcome, Session, WalkEnd};
use axcon::time::{Duration, Instant};

use crate::support::bench::{BAUD, order, small_image};
use crate::support::visit::HandMade;
use crate::support::words::{MENU, ROW, on};

/// What happens to a job from outside.
#[derive(Clone, Copy, Debug)]
enum Meanwhile {
    Nothing,
    CancelledAfter(u64),
    UnpluggedAfter(u64),
}

/// How long a unit is watched after the outcome: what it has been sent has to arrive, and what it asks to show.
const AFTERWARDS: Duration = Duration::from_millis(800);

struct Told {
    outcome: Outcome,
    took: Duration,
    pages: Vec<Vec<String>>,
    session: Session,
}

/// Gives a command to a session at a unit, and goes on for a moment after its outcome.
fn ask<U: HandMade>(unit: &mut U, command: &Command, meanwhile: Meanwhile) -> Told {
    let mut session = Session::new(BAUD);
    let mut now = Instant::from_millis(1);
    let begun = now;
    session.command(now, command.clone()).expect("it is free");
    let (mut outcome, mut pages) = (None, Vec::new());
    let mut interruption = match meanwhile {
        Meanwhile::Nothing => None,
        Meanwhile::CancelledAfter(millis) | Meanwhile::UnpluggedAfter(millis) => {
            Some(begun + Duration::from_millis(millis))
        }
    };
    loop {
        if interruption.is_some_and(|at| at <= now) {
            interruption = None;
            match meanwhile {
                Meanwhile::UnpluggedAfter(_) => session.link_lost(now),
                _ => session.command(now, Command::Cancel).expect("always"),
            }
        }
        while let Some(transmit) = session.poll_transmit() {
            unit.handle_bytes(now, &transmit.bytes);
        }
        while let Some(event) = session.poll_event() {
            match event {
                Event::Finished(ended) => outcome = Some((ended, now)),
                Event::Page { lines, .. } => pages.push(lines.into_iter().map(|line| line.text).collect()),
                _ => {}
            }
        }
        let end = outcome.as_ref().map(|(_, at)| *at + AFTERWARDS);
        if end.is_some_and(|end| end <= now) {
            break;
        }
        assert!(now < Instant::from_millis(200_000), "{command:?} does not end");
        let due = [session.poll_timeout(), unit.poll_timeout(), interruption, end];
        now = due.into_iter().flatten().min().expect("a job has a deadline").max(now + Duration::from_micros(1));
        unit.handle_timeout(now);
        while let Some(place) = unit.says().iter().position(|(at, _)| *at <= now) {
            let (_, text) = unit.says().remove(place).expect("it is there");
            session.handle_bytes(now, &text);
        }
        session.handle_timeout(now);
    }
    let (outcome, at) = outcome.expect("an outcome");
    Told { outcome, took: at.since(begun), pages, session }
}

const SOURCE: &str = "F - field value, P - process value: ";
const PERIOD: &str = "Repetition rate in ms (1-60000) [1000]: ";
const CONFIRM: &str = "Enter Yes to restore the default object dictionary: ";
const WAITS: &str = "\r\nWaiting for application S-Record.\r\n";
const PAGE: &str = "Supply 24.1 V\r\nTC1 100.0 C\r\n";
const ENTRY: &str = "6126h:01 TC1 = 16.000\r\n";

/// Answers as it is told to, key by key, and then says one thing for ever: by itself, and to every key.
struct Repeater {
    script: VecDeque<(u8, &'static str)>,
    text: &'static str,
    every: Duration,
    next: Instant,
    says: VecDeque<(Instant, Vec<u8>)>,
}

impl Repeater {
    fn new(script: &[(u8, &'static str)], text: &'static str, every_millis: u64) -> Self {
        let every = Duration::from_millis(every_millis);
        Repeater {
            script: script.iter().copied().collect(),
            text,
            every,
            next: Instant::ZERO + every,
            says: VecDeque::new(),
        }
    }
}

impl Endpoint for Repeater {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for byte in bytes {
            let says = match self.script.front() {
                None => self.text,
                Some((key, _)) if key != byte => continue,
                Some(_) => self.script.pop_front().map_or("", |(_, says)| says),
            };
            self.says.push_back((now + Duration::from_millis(5), says.into()));
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.next <= now {
            self.next = now + self.every;
            if self.script.is_empty() {
                self.says.push_back((now, self.text.into()));
            }
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.says.iter().map(|(at, _)| *at).chain([self.next]).min()
    }
}

impl HandMade for Repeater {
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)> {
        &mut self.says
    }
}

#[test]
fn whatever_a_unit_repeats_for_ever_every_stage_of_every_job_ends_in_time() {
    type Script = &'static [(u8, &'static str)];
    let stages: [(Command, u64, &[Script]); 8] = [
        (Command::Identify, 5, &[&[]]),
        (
            on(),
            20,
            &[
                &[],
                &[(b't', "off\r\n")],
                &[(b't', SOURCE)],
                &[(b't', SOURCE), (b'f', PERIOD)],
                &[(b't', SOURCE), (b'f', PERIOD), (b'\r', "OK\r\n")],
            ],
        ),
        (Command::StreamOff, 30, &[&[], &[(b't', ROW)], &[(b't', SOURCE)], &[(b't', ""), (b'm', MENU)]]),
        (
            Command::RestoreDefaults,
            40,
            &[
                &[],
                &[(b'd', CONFIRM)],
                &[(b'd', CONFIRM), (b'\r', CONFIRM)],
                &[(b'd', CONFIRM), (b'\r', MENU)],
                &[(b'd', CONFIRM), (b'\r', MENU), (b'm', MENU)],
            ],
        ),
        (
            Command::Diagnostics { pages: Some(2) },
            40,
            &[&[], &[(b's', PAGE)], &[(b's', "Diagnostics on.\r\n")], &[(b's', PAGE), (b's', PAGE)]],
        ),
        (Command::DiagnosticsOff, 20, &[&[], &[(b's', PAGE)], &[(b's', ""), (b'm', MENU)]]),
        (
            Command::ReadDictionary,
            60,
            &[&[], &[(b'v', ENTRY)], &[(b'v', ENTRY), (b'\r', ENTRY)], &[(b'v', "no\r\n"), (b'x', "no\r\n")]],
        ),
        (
            Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0")))),
            90,
            &[
                &[],
                &[(b'm', MENU)],
                &[(b'm', MENU), (b'l', "Password: ")],
                &[(b'm', MENU), (b'l', "Password: "), (b'\r', WAITS)],
                &[(b'm', MENU), (b'l', "Password: "), (b'\r', WAITS), (b'7', ".")],
            ],
        ),
    ];
    let texts = [
        ROW,
        " 4768;    0;Null ;Open ;32128\r\n",
        MENU,
        SOURCE,
        PERIOD,
        CONFIRM,
        PAGE,
        ENTRY,
        "Password: ",
        "Which? ",
        "Invalid entry\r\n",
        "something\r\n",
        "something 5\r\n",
        "Yes",
        ".",
        "\u{13}",
        "AXTC4CO V1.1.0\r\n",
        "Waiting for application S-Record.\r\n",
    ];
    for (command, most, scripts) in &stages {
        for (script, text) in scripts.iter().flat_map(|script| texts.map(|text| (script, text))) {
            for every in [40, 250, 950, 3_000] {
                let told = ask(&mut Repeater::new(script, text, every), command, Meanwhile::Nothing);
                let took = told.took;
                assert!(
                    took <= Duration::from_secs(*most),
                    "{:?} behind {script:?}: {text:?} each {every} ms: {took:?}",
                    told.outcome
                );
            }
        }
    }
}

/// What an Enter without an answer does at a question.
#[derive(Clone, Copy, Debug, PartialEq)]
enum OnEnter {
    Aborts,
    TakesItsOwnValue,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Menu,
    Source,
    Period,
    /// How often Yes has been typed.
    Confirm(u32),
    View,
}

/// A unit with one way of asking.
#[derive(Clone, Debug)]
struct Asker {
    on_enter: OnEnter,
    /// Milliseconds until it answers.
    late: u64,
    asks_source: &'static str,
    asks_period: &'static str,
    /// It takes no period, and asks again.
    refuses: Option<&'static str>,
    asks_defaults: &'static str,
    /// How often it wants a Yes, and what it asks from the second on.
    confirmations: u32,
    asks_again: &'static str,
    state: State,
    typed: String,
    streams: bool,
    next_row: Instant,
    /// Pages are on; when the next one comes, by the milliseconds between them; and those between its lines.
    pages: bool,
    next_page: Instant,
    apart: VecDeque<u64>,
    pause: u64,
    restored: u32,
    says: VecDeque<(Instant, Vec<u8>)>,
}

impl Asker {
    fn new(on_enter: OnEnter, late: u64) -> Self {
        Asker {
            on_enter,
            late,
            asks_source: SOURCE,
            asks_period: PERIOD,
            refuses: None,
            asks_defaults: CONFIRM,
            confirmations: 1,
            asks_again: "Are you sure (Yes/No)? ",
            state: State::Menu,
            typed: String::new(),
            streams: false,
            next_row: Instant::ZERO,
            pages: false,
            next_page: Instant::ZERO,
            apart: VecDeque::new(),
            pause: 0,
            restored: 0,
            says: VecDeque::new(),
        }
    }

    fn say(&mut self, now: Instant, text: &str) {
        self.says.push_back((now + Duration::from_millis(self.late), text.into()));
    }

    fn stream(&mut self, now: Instant) {
        (self.state, self.streams) = (State::Menu, true);
        self.next_row = now + Duration::from_millis(self.late + 1_000);
        self.say(now, "\r\nStream on\r\n");
    }

    fn abort(&mut self, now: Instant) {
        self.state = State::Menu;
        self.say(now, "\r\nnothing done\r\n");
    }

    fn ask(&mut self, now: Instant, state: State, question: &'static str) {
        self.state = state;
        self.say(now, question);
    }

    fn key(&mut self, now: Instant, key: u8) {
        let lower = key.to_ascii_lowercase();
        match (self.state, lower) {
            (State::Menu, b'm') => self.say(now, MENU),
            (State::Menu, b't') if self.streams => {
                self.streams = false;
                self.say(now, "Stream off\r\n");
            }
            (State::Menu, b't') => self.ask(now, State::Source, self.asks_source),
            (State::Menu, b'd') => self.ask(now, State::Confirm(0), self.asks_defaults),
            (State::Menu, b'v') => self.ask(now, State::View, ENTRY),
            (State::Menu, b's') => {
                self.pages = !self.pages;
                self.next_page = now + Duration::from_millis(100);
            }
            (State::Menu, _) => {}
            (State::View, b'x') => self.ask(now, State::Menu, MENU),
            (State::View, _) => {}
            (State::Source, b'f' | b'p') => self.ask(now, State::Period, self.asks_period),
            (State::Source, b'\r') if self.on_enter == OnEnter::TakesItsOwnValue => {
                self.ask(now, State::Period, self.asks_period);
            }
            (State::Source, b'\r') => self.abort(now),
            (State::Source, _) => {}
            (State::Period, b'\r') => {
                let typed = std::mem::take(&mut self.typed);
                match (self.refuses, self.on_enter) {
                    (Some(refusal), _) if !typed.is_empty() => {
                        self.say(now, refusal);
                        self.say(now, self.asks_period);
                    }
                    (_, OnEnter::Aborts) if typed.is_empty() => self.abort(now),
                    _ => self.stream(now),
                }
            }
            (State::Confirm(yes), b'\r') => match std::mem::take(&mut self.typed).as_str() {
                "Yes" if yes + 1 < self.confirmations => self.ask(now, State::Confirm(yes + 1), self.asks_again),
                "Yes" => {
                    self.restored += 1;
                    self.state = State::Menu;
                    self.say(now, "\r\nAXTC4CO V1.1.0\r\nstarted\r\n");
                }
                "" if self.on_enter == OnEnter::TakesItsOwnValue => panic!("a bare Enter is a Yes here"),
                _ => self.abort(now),
            },
            (State::Period | State::Confirm(_), _) => self.typed.push(char::from(key)),
        }
    }
}

impl Endpoint for Asker {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes.iter().filter(|byte| **byte != 0x11) {
            self.key(now, byte);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.streams && self.next_row <= now {
            self.next_row = now + Duration::from_millis(500);
            self.says.push_back((now, ROW.into()));
        }
        if self.pages && self.next_page <= now {
            self.next_page = now + Duration::from_millis(self.apart.pop_front().unwrap_or(1_000));
            for (line, text) in
                ["Supply 24.1 V\r\n", "TC1 100.0 C\r\n", "TC2 110.0 C\r\n", "CJ 23.0 C\r\n"].iter().enumerate()
            {
                self.says.push_back((now + Duration::from_millis(self.pause * line as u64), text.as_bytes().to_vec()));
            }
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let row = self.streams.then_some(self.next_row);
        let page = self.pages.then_some(self.next_page);
        self.says.iter().map(|(at, _)| *at).chain(row).chain(page).min()
    }
}

impl HandMade for Asker {
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)> {
        &mut self.says
    }
}

fn askers() -> Vec<Asker> {
    let mut askers = Vec::new();
    for on_enter in [OnEnter::Aborts, OnEnter::TakesItsOwnValue] {
        for late in [5, 300] {
            let plain = Asker::new(on_enter, late);
            askers.extend([
                Asker { streams: true, ..plain.clone() },
                Asker { asks_source: "F/P [F]: ", ..plain.clone() },
                Asker { asks_source: "6100 or 7130 [6100]: ", ..plain.clone() },
                Asker { asks_period: "How often [1000]: ", ..plain.clone() },
                Asker { refuses: Some(""), ..plain.clone() },
                Asker { refuses: Some("\r\nInvalid entry\r\n"), ..plain.clone() },
                Asker { asks_defaults: "Restore? [Y/n] ", ..plain.clone() },
                Asker { confirmations: 2, ..plain.clone() },
                Asker { confirmations: 2, asks_again: "Really and truly? ", ..plain.clone() },
                Asker { confirmations: 3, ..plain.clone() },
                Asker { pages: true, pause: 250, ..plain.clone() },
                plain,
            ]);
        }
    }
    askers
}

#[test]
fn however_a_job_ends_nothing_waits_to_be_sent_and_none_of_its_questions_is_open() {
    let commands = [
        Command::Identify,
        on(),
        Command::StreamOff,
        Command::RestoreDefaults,
        Command::Diagnostics { pages: Some(2) },
        Command::ReadDictionary,
    ];
    let moments = [0, 3, 50, 80, 140, 320, 500, 700, 1_200, 1_700, 2_600, 4_200];
    let meanwhile: Vec<Meanwhile> =
        [Meanwhile::Nothing].into_iter().chain(moments.map(Meanwhile::CancelledAfter)).collect();
    for (command, asker) in commands.iter().flat_map(|command| askers().into_iter().map(move |asker| (command, asker)))
    {
        for &meanwhile in &meanwhile {
            let mut unit = asker.clone();
            let told = ask(&mut unit, command, meanwhile);
            let of = format!("{command:?}, {meanwhile:?}: {:?} of {asker:?}", told.outcome);
            assert_eq!(unit.state, State::Menu, "{of}");
            assert_eq!(told.session.waiting(), 0, "{of}");
            match &told.outcome {
                Outcome::StreamRuns { .. } => assert!(unit.streams, "{of}"),
                Outcome::Done(Job::StreamOff) => assert!(!unit.streams, "{of}"),
                Outcome::Done(Job::RestoreDefaults) => assert_eq!(unit.restored, 1, "{of}"),
                Outcome::NoAnswer { job: Job::StreamOn, .. } | Outcome::Refused { job: Job::StreamOn, .. } => {
                    assert!(asker.streams || !unit.streams, "{of}");
                }
                Outcome::NoAnswer { job: Job::RestoreDefaults, .. } => assert_eq!(unit.restored, 0, "{of}"),
                Outcome::Done(Job::Diagnostics) | Outcome::Cancelled(Job::Diagnostics) => {
                    // Who cancels before anything has been sent leaves the unit as it was.
                    assert!(!unit.pages || asker.pages && told.took < Duration::from_millis(1_300), "{of}");
                }
                _ => {}
            }
        }
    }
}

#[test]
fn a_stream_that_was_off_is_off_after_a_question_that_enter_answers() {
    let unit = Asker { asks_source: "F/P [F]: ", ..Asker::new(OnEnter::TakesItsOwnValue, 5) };
    let mut off = unit.clone();
    let told = ask(&mut off, &Command::StreamOff, Meanwhile::Nothing);
    assert_eq!((told.outcome, off.state, off.streams), (Outcome::Done(Job::StreamOff), State::Menu, false));
    let mut on_again = Asker { streams: true, ..unit };
    // While the second T is being answered.
    let told = ask(&mut on_again, &on(), Meanwhile::CancelledAfter(440));
    assert_eq!(
        (told.outcome, on_again.state, on_again.streams),
        (Outcome::Cancelled(Job::StreamOn), State::Menu, true)
    );
}

#[test]
fn a_user_who_has_said_yes_is_sure_and_a_refusal_is_told_as_one() {
    let unit = Asker { confirmations: 2, ..Asker::new(OnEnter::Aborts, 5) };
    let mut twice = unit.clone();
    let told = ask(&mut twice, &Command::RestoreDefaults, Meanwhile::Nothing);
    assert_eq!((told.outcome, twice.restored), (Outcome::Done(Job::RestoreDefaults), 1));
    let mut thrice = Asker { confirmations: 3, ..unit };
    let told = ask(&mut thrice, &Command::RestoreDefaults, Meanwhile::Nothing);
    assert!(
        matches!(told.outcome, Outcome::NoAnswer { awaited: Awaited::NothingElse, heard: Some(_), .. }),
        "{:?}",
        told.outcome
    );
    let mut refuses = Repeater::new(&[(b'd', "Not allowed in this state\r\n")], "", 60_000);
    let told = ask(&mut refuses, &Command::RestoreDefaults, Meanwhile::Nothing);
    assert!(refuses.script.is_empty(), "it has refused");
    let Outcome::Refused { reason, .. } = told.outcome else { panic!("{:?}", told.outcome) };
    assert_eq!(reason, "the unit does not ask for the Yes, but says \"Not allowed in this state\"");
}

#[test]
fn pages_that_stay_away_are_stopped_and_one_under_way_is_waited_for() {
    let mut late = Asker { apart: [1_000, 3_500].into(), ..Asker::new(OnEnter::Aborts, 5) };
    let told = ask(&mut late, &Command::Diagnostics { pages: None }, Meanwhile::Nothing);
    assert!(matches!(told.outcome, Outcome::NoAnswer { awaited: Awaited::NextPage, .. }), "{:?}", told.outcome);
    assert_eq!((told.pages.len(), late.pages), (2, false));
    let mut just = Asker { apart: [1_000, 2_600].into(), pause: 100, ..Asker::new(OnEnter::Aborts, 5) };
    let told = ask(&mut just, &Command::Diagnostics { pages: Some(3) }, Meanwhile::Nothing);
    assert_eq!((told.outcome, told.pages.len()), (Outcome::Done(Job::Diagnostics), 3));
}

#[test]
fn a_page_whose_lines_come_with_pauses_is_one_page() {
    for pause in [0, 100, 150, 250] {
        let mut unit = Asker { pause, ..Asker::new(OnEnter::Aborts, 5) };
        let told = ask(&mut unit, &Command::Diagnostics { pages: Some(3) }, Meanwhile::Nothing);
        let lines: Vec<usize> = told.pages.iter().map(Vec::len).collect();
        assert_eq!(
            (told.outcome, lines, unit.pages),
            (Outcome::Done(Job::Diagnostics), vec![4; 3], false),
            "{pause} ms"
        );
    }
}

#[test]
fn what_has_been_read_of_a_dictionary_outlives_its_link() {
    // Enter shows nothing more from the second on, and the view is left at half a second.
    let read = |text: &'static str, after: u64| {
        let mut unit = Repeater::new(&[(b'v', ENTRY)], text, 60_000);
        match ask(&mut unit, &Command::ReadDictionary, Meanwhile::UnpluggedAfter(after)).outcome {
            Outcome::DictionaryRead(reading) => Some((reading.entries.len(), reading.end)),
            Outcome::Cancelled(Job::ReadDictionary) => None,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(read("the end\r\n", 3), None);
    assert_eq!(read("the end\r\n", 300), Some((1, WalkEnd::Stopped)));
    assert_eq!(read("the end\r\n", 560), Some((1, WalkEnd::Whole)), "while the view is being left");
}
