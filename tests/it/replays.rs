//! What was recorded of a talk gives what the talk gave, in virtual time: each job that listens, and all of them together.

use axcon::endpoint::Endpoint;
use axcon::record::{Direction, Entry};
use axcon::session::{Awaited, Command, DictionaryReading, Event, Job, Outcome, Refusal, Session, UnitState};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;

use crate::support::bench::{Bench, axtc4co, flash_with, order, small_image};

/// Plays a record to one job; what it has told, and how it ended.
fn replayed(record: &[Entry], command: Command) -> (Session, Vec<Event>, Option<Outcome>) {
    replayed_with(record, &[], command)
}

/// The same with remarks in the recording.
fn replayed_with(
    record: &[Entry],
    marks: &[(Instant, &str)],
    command: Command,
) -> (Session, Vec<Event>, Option<Outcome>) {
    let mut session = Session::of_recording(115_200);
    session.command(Instant::ZERO, command).expect("it listens");
    let look_after = |session: &mut Session, until: Instant| {
        while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
            session.handle_timeout(due);
        }
    };
    let mut marks = marks.iter().peekable();
    for entry in record {
        while let Some((at, text)) = marks.next_if(|(at, _)| *at <= entry.at) {
            look_after(&mut session, *at);
            session.handle_mark(*at, text);
        }
        look_after(&mut session, entry.at);
        match entry.direction {
            Direction::ToUnit => session.handle_sent(entry.at, &entry.bytes),
            Direction::FromUnit => session.handle_bytes(entry.at, &entry.bytes),
        }
    }
    for (at, text) in marks {
        look_after(&mut session, *at);
        session.handle_mark(*at, text);
    }
    let end = record.last().map_or(Instant::ZERO, |entry| entry.at) + Duration::from_secs(5);
    look_after(&mut session, end);
    session.recording_over(end);
    let (mut told, mut outcome) = (Vec::new(), None);
    while let Some(event) = session.poll_event() {
        match event {
            Event::Finished(ended) => outcome = Some(ended),
            event => told.push(event),
        }
    }
    (session, told, outcome)
}

fn recorded(bench: &Bench) -> Vec<Entry> {
    bench.session.record().entries().cloned().collect()
}

fn dictionary(bench: &mut Bench) -> DictionaryReading {
    match bench.ask(Command::ReadDictionary) {
        Outcome::DictionaryRead(reading) => *reading,
        outcome => panic!("{outcome:?}"),
    }
}

fn values(reading: &DictionaryReading) -> Vec<String> {
    reading.entries.iter().map(|entry| format!("{} {:?}", entry.at, entry.value())).collect()
}

fn pages(told: &[Event]) -> Vec<Vec<&str>> {
    let mut pages = Vec::new();
    for event in told {
        if let Event::Page { lines, .. } = event {
            pages.push(lines.iter().map(|line| line.text.as_str()).collect());
        }
    }
    pages
}

#[test]
fn a_dictionary_is_read_from_the_keys_and_entries_of_its_recording() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    let live = dictionary(&mut bench);
    let (session, _, outcome) = replayed(&recorded(&bench), Command::ReadDictionary);
    let Some(Outcome::DictionaryRead(reading)) = outcome else { panic!("{outcome:?}") };
    assert_eq!((values(&reading), reading.is_complete()), (values(&live), true));
    assert_eq!(session.facts().product, bench.session.facts().product);
    // Menus and rows have numbers as well; a recording without the view has no dictionary.
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(500) });
    bench.ask(Command::StreamOff);
    let (_, _, outcome) = replayed(&recorded(&bench), Command::ReadDictionary);
    assert!(
        matches!(outcome, Some(Outcome::NoAnswer { job: Job::ReadDictionary, awaited: Awaited::Entry, .. })),
        "{outcome:?}"
    );
}

#[test]
fn pages_are_counted_as_they_were_asked_for() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Diagnostics { pages: Some(3) });
    let record = recorded(&bench);
    let (_, told, outcome) = replayed(&record, Command::Diagnostics { pages: None });
    assert_eq!((pages(&told).len(), outcome), (3, Some(Outcome::Done(Job::Diagnostics))));
    let (_, told, outcome) = replayed(&record, Command::Diagnostics { pages: Some(2) });
    assert_eq!((pages(&told).len(), outcome), (2, Some(Outcome::Done(Job::Diagnostics))));
    let (_, told, outcome) = replayed(&record[..2], Command::Diagnostics { pages: Some(1) });
    assert!(pages(&told).is_empty() && matches!(outcome, Some(Outcome::NoAnswer { .. })), "{outcome:?}");
}

#[test]
fn whoever_listens_to_everything_hears_dictionary_and_pages() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    let live = dictionary(&mut bench);
    bench.ask(Command::Diagnostics { pages: Some(2) });
    let (_, told, outcome) = replayed(&recorded(&bench), Command::Overhear);
    assert_eq!(outcome, Some(Outcome::Done(Job::Overhear)));
    let read: Vec<&DictionaryReading> = told
        .iter()
        .filter_map(|event| if let Event::Overheard { reading, .. } = event { Some(&**reading) } else { None })
        .collect();
    assert_eq!(read.iter().map(|read| values(read)).collect::<Vec<_>>(), [values(&live)], "once");
    assert_eq!(pages(&told).len(), 2);
    assert!(!pages(&told)[0].iter().any(|line| line.contains("1018")), "an entry is no line of a page");
    let (mut session, ..) = replayed(&recorded(&bench), Command::Overhear);
    session.command(Instant::from_millis(900_000), Command::Overhear).expect("once more");
    session.command(Instant::from_millis(900_000), Command::Cancel).expect("always");
    let last = std::iter::from_fn(|| session.poll_event()).last();
    assert_eq!(last, Some(Event::Finished(Outcome::Cancelled(Job::Overhear))));
}

/// What the facts say of the stream, as it changes, when this came or was sent (`>`), each so many milliseconds behind the
/// one before; and at last what they say behind the recording's end.
fn stream_facts(story: &[(u64, &str)]) -> (String, Option<Source>) {
    let mut session = Session::of_recording(115_200);
    let (mut millis, mut changes, mut before) = (0, Vec::new(), None);
    let mut look = |session: &Session, at: Instant| {
        let stream = session.facts().stream;
        if stream != before {
            let at = at.since(Instant::ZERO).as_nanos() / 1_000_000;
            changes.push(format!("{at}:{}", stream.map_or("off", Source::short)));
            before = stream;
        }
    };
    for (behind, text) in story.iter().chain(&[(20_000, "")]) {
        let until = Instant::from_millis(millis + behind);
        while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
            session.handle_timeout(due);
            look(&session, due);
        }
        millis += behind;
        match text.strip_prefix('>') {
            Some(keys) => session.handle_sent(until, keys.as_bytes()),
            None => session.handle_bytes(until, text.as_bytes()),
        }
        look(&session, until);
    }
    session.recording_over(Instant::from_millis(millis));
    (changes.join(" "), session.facts().stream)
}

#[test]
fn a_stream_is_on_until_a_key_or_a_restart_has_ended_its_rows() {
    const ROW: &str = "  23.500;  24.125;Disabled;OpenCct ; -12.750\r\n";
    const BANNER: &str = "AXTC4CO V1.1.0\r\n";
    let rows = |apart: u64| [(apart, ROW), (apart, ROW)];
    let field_values = Some(Source::FieldValue);
    let table = [
        ("silence behind the key", 500, vec![(100, ">t"), (290, ROW)], "500:fv 2600:off", None),
        ("a line behind the key", 500, vec![(100, ">t"), (20, "Stream is off.\r\n")], "500:fv 1520:off", None),
        ("a question behind the key", 500, vec![(100, ">t"), (20, "Source [F/P]: ")], "500:fv 1180:off", None),
        ("the menu behind the key", 500, vec![(100, ">T"), (600, ">m"), (5, "V - View\r\n")], "500:fv 2105:off", None),
        ("a key that was lost", 500, vec![(100, ">t"), (20, "?\r\n"), (300, ROW)], "500:fv", field_values),
        ("a slow stream, the key lost", 9_000, vec![(100, ">t"), (9_000, ROW)], "9000:fv", field_values),
        ("a slow stream, off", 9_000, vec![(100, ">t"), (20_000, "")], "9000:fv 36100:off", None),
        ("other keys", 500, vec![(100, ">m"), (5, "V - View\r\n"), (50, ">f"), (50, "1000\r")], "500:fv", field_values),
        ("a record of a file", 500, vec![(100, ">S0110000000050524F4752414D264441544196t")], "500:fv", field_values),
        ("a restart, rows as before", 500, vec![(100, BANNER), (5_000, ROW)], "500:fv", field_values),
        ("a restart without rows", 500, vec![(100, BANNER), (5, "V - View\r\n")], "500:fv 8100:off", None),
        (
            "off and on again",
            500,
            vec![(100, ">t"), (2_000, ">t"), (900, ROW)],
            "500:fv 2600:off 4000:fv",
            field_values,
        ),
    ];
    for (name, apart, behind, changes, at_last) in table {
        let story = [&rows(apart)[..], &behind].concat();
        assert_eq!(stream_facts(&story), (changes.to_owned(), at_last), "{name}");
    }
}

#[test]
fn a_recording_says_of_the_stream_what_the_live_session_said() {
    for dialect in 0..40 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(4));
        let same = |bench: &Bench, on: bool, story: &str| {
            let (session, ..) = replayed(&recorded(bench), Command::Overhear);
            let (live, told) = (bench.session.facts().stream, session.facts().stream);
            assert_eq!((live.is_some(), told), (on, live), "dialect {dialect}, {story}:\n{}", bench.transcript());
        };
        let period = Duration::from_millis(500);
        bench.ask(Command::StreamOn { source: Source::FieldValue, period });
        same(&bench, true, "on");
        bench.ask(Command::StreamOn { source: Source::ProcessValue, period });
        same(&bench, true, "changed");
        bench.ask(Command::StreamOff);
        same(&bench, false, "off");
        bench.ask(Command::StreamOn { source: Source::FieldValue, period });
        bench.run_for(Duration::from_secs(2));
        bench.command(Command::Keys(b"t".to_vec()));
        bench.run_for(Duration::from_secs(3));
        same(&bench, false, "off by hand");
    }
}

#[test]
fn what_answers_the_key_is_no_line_of_the_first_page() {
    for dialect in 0..60 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(5));
        bench.command(Command::Diagnostics { pages: Some(3) });
        let (end, mut live) = (bench.now + Duration::from_secs(12), Vec::new());
        bench.run_until(end, |event| {
            live.extend(matches!(event, Event::Page { .. }).then(|| event.clone()));
            false
        });
        let (_, told, _) = replayed(&recorded(&bench), Command::Diagnostics { pages: None });
        for pages in [pages(&live), pages(&told)] {
            let lengths: Vec<usize> = pages.iter().map(Vec::len).collect();
            assert!(lengths.len() == 3 && lengths.iter().all(|length| *length == lengths[1]), "{dialect}: {pages:?}");
        }
    }
}

#[test]
fn a_recording_of_noise_is_of_somebody_and_one_of_nothing_of_nobody() {
    let noise = Session::of_recording(115_200);
    let state = |mut session: Session, bytes: &[u8]| {
        session.handle_bytes(Instant::from_millis(1), bytes);
        session.recording_over(Instant::from_millis(2));
        session.facts().state
    };
    assert_eq!(state(noise, b"\x9b\x80"), UnitState::Unknown);
    assert_eq!(state(Session::of_recording(115_200), b""), UnitState::Silent);
    let mut session = Session::of_recording(115_200);
    let sent = session.command(Instant::ZERO, Command::Keys(b"m".to_vec()));
    assert_eq!(sent, Err(Refusal::ReadOnly));
    assert_eq!(Session::new(115_200).command(Instant::ZERO, Command::Overhear), Err(Refusal::Live));
}

fn readings(told: &[Event]) -> Vec<(Instant, &DictionaryReading)> {
    let mut read = Vec::new();
    for event in told {
        if let Event::Overheard { at, reading } = event {
            read.push((*at, &**reading));
        }
    }
    read
}

#[test]
fn a_reading_ends_where_its_link_was_lost_and_is_not_all_of_it() {
    for dialect in 0..30 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(4));
        bench.ask(Command::Identify);
        bench.command(Command::ReadDictionary);
        bench.run_for(Duration::from_millis(900));
        let lost = bench.now;
        bench.lose_link();
        bench.run_for(Duration::from_secs(60));
        let back = bench.now;
        bench.session.link_back(back);
        let marks = [(lost, "link lost"), (back, "link back as /dev/ttyUSB0")];
        let (_, told, _) = replayed_with(&recorded(&bench), &marks, Command::Overhear);
        let [(at, reading)] = readings(&told)[..] else { panic!("dialect {dialect}: {told:?}") };
        assert!(!reading.is_complete() && !reading.entries.is_empty(), "dialect {dialect}: {reading:?}");
        assert!(at <= lost && lost <= at + Duration::from_secs(1), "dialect {dialect}: {at:?}, {lost:?}");
        // The one behind it is its own.
        bench.ask(Command::Identify);
        let live = dictionary(&mut bench);
        let record = recorded(&bench);
        let (_, told, _) = replayed_with(&record, &marks, Command::Overhear);
        let read = readings(&told);
        assert_eq!(
            read.iter().map(|(_, read)| read.is_complete()).collect::<Vec<_>>(),
            [false, true],
            "dialect {dialect}"
        );
        assert_eq!(values(read[1].1), values(&live), "dialect {dialect}");
        assert!(read[1].0 > back, "dialect {dialect}");
        let (_, _, outcome) = replayed_with(&record, &marks, Command::ReadDictionary);
        let Some(Outcome::DictionaryRead(dumped)) = outcome else { panic!("{outcome:?}") };
        assert_eq!((values(&dumped), dumped.is_complete()), (values(&live), true), "dialect {dialect}");
    }
}

#[test]
fn a_reading_ends_where_its_unit_starts_anew() {
    for dialect in 0..30 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(4));
        bench.ask(Command::Identify);
        typed(&mut bench, "v\r\r\r\r");
        let cut = bench.now;
        bench.power_cycle(Duration::from_secs(1));
        bench.run_for(Duration::from_secs(60));
        let (_, told, _) = replayed(&recorded(&bench), Command::Overhear);
        let (at, reading) = *readings(&told).first().expect("some of it");
        assert!(!reading.is_complete() && at <= cut, "dialect {dialect}: {at:?}, {}", bench.transcript());
    }
}

/// Types with the pauses of a hand; the pages that the session has told of meanwhile.
fn typed(bench: &mut Bench, keys: &str) -> Vec<Event> {
    let mut told = Vec::new();
    for key in keys.bytes() {
        bench.command(Command::Keys(vec![key]));
        told.extend(live_pages(bench, Duration::from_millis(230)));
    }
    told
}

/// The pages that a live session has told of so far.
fn live_pages(bench: &mut Bench, time: Duration) -> Vec<Event> {
    let (end, mut told) = (bench.now + time, Vec::new());
    bench.run_until(end, |event| {
        told.extend(matches!(event, Event::Page { .. }).then(|| event.clone()));
        false
    });
    told
}

#[test]
fn pages_that_a_hand_has_asked_for_are_known_live_and_in_the_recording_and_no_dialogue_is_one() {
    for dialect in 0..60 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(6));
        bench.ask(Command::Identify);
        let before = bench.session.facts().unrecognised_lines;
        bench.command(Command::Keys(b"s".to_vec()));
        let mut live = live_pages(&mut bench, Duration::from_secs(5));
        let heard = |bench: &Bench| format!("dialect {dialect}:\n{}", bench.transcript());
        assert!((4..=5).contains(&live.len()), "{}, {}", live.len(), heard(&bench));
        assert!(bench.session.facts().diagnostics.is_some(), "{}", heard(&bench));
        // What somebody else has to say meanwhile is on no page.
        live.extend(typed(&mut bench, "tp1000\r\r"));
        live.extend(live_pages(&mut bench, Duration::from_secs(4)));
        bench.command(Command::Keys(b"m".to_vec()));
        live.extend(live_pages(&mut bench, Duration::from_secs(3)));
        let shown = pages(&live);
        let lengths: Vec<usize> = shown.iter().map(Vec::len).collect();
        assert!(
            shown.len() >= 10 && lengths.iter().all(|length| *length == lengths[0]),
            "{shown:#?}, {}",
            heard(&bench)
        );
        assert!(bench.session.facts().diagnostics.is_some(), "{}", heard(&bench));
        assert_eq!(bench.session.facts().unrecognised_lines, before, "{}", heard(&bench));
        let (session, told, _) = replayed(&recorded(&bench), Command::Overhear);
        let told = pages(&told);
        assert!(told.len().abs_diff(shown.len()) <= 1, "dialect {dialect}: {} and {}", told.len(), shown.len());
        assert!(told.iter().all(|page| page.len() == lengths[0]), "dialect {dialect}: {told:#?}");
        assert!(session.facts().diagnostics.is_none(), "behind the end of the recording none have come for long");
        // And off again.
        bench.command(Command::Keys(b"s".to_vec()));
        bench.run_for(Duration::from_secs(3));
        assert_eq!(bench.session.facts().diagnostics, None, "{}", heard(&bench));
    }
}

#[test]
fn pages_that_came_before_we_did_are_known_and_stopped() {
    for dialect in 0..60 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(6));
        typed(&mut bench, "s");
        bench.run_for(Duration::from_millis(2_000 + dialect * 17));
        bench.reconnect();
        bench.ask(Command::Identify);
        let told = live_pages(&mut bench, Duration::from_secs(5));
        let heard = |bench: &Bench| format!("dialect {dialect}:\n{}", bench.transcript());
        assert!(pages(&told).len() >= 4, "{}", heard(&bench));
        assert!(bench.session.facts().diagnostics.is_some(), "{}", heard(&bench));
        assert_eq!(bench.ask(Command::DiagnosticsOff), Outcome::Done(Job::Diagnostics), "{}", heard(&bench));
        assert_eq!(bench.session.facts().diagnostics, None, "{}", heard(&bench));
        assert!(live_pages(&mut bench, Duration::from_secs(4)).is_empty(), "{}", heard(&bench));
        // Asked for while they come they are joined, and off behind it.
        typed(&mut bench, "s");
        bench.run_for(Duration::from_secs(3));
        assert!(bench.session.facts().diagnostics.is_some(), "{}", heard(&bench));
        let outcome = bench.ask(Command::Diagnostics { pages: Some(2) });
        assert_eq!((outcome, bench.session.facts().diagnostics), (Outcome::Done(Job::Diagnostics), None));
        assert!(live_pages(&mut bench, Duration::from_secs(4)).is_empty(), "{}", heard(&bench));
    }
}

#[test]
fn menus_views_and_streams_are_no_diagnostics() {
    for dialect in 0..60 {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(6));
        for _ in 0..4 {
            bench.ask(Command::Identify);
        }
        let mut told = typed(&mut bench, "v\r\r\r\r\r\r\rxmmmtp1000\r");
        told.extend(live_pages(&mut bench, Duration::from_secs(5)));
        told.extend(typed(&mut bench, "tmdm\rl\rtf500\rt"));
        told.extend(live_pages(&mut bench, Duration::from_secs(5)));
        bench.power_cycle(Duration::from_secs(1));
        bench.run_for(Duration::from_secs(5));
        dictionary(&mut bench);
        assert!(pages(&told).is_empty(), "dialect {dialect}: {:#?}", pages(&told));
        assert_eq!(bench.session.facts().diagnostics, None, "dialect {dialect}:\n{}", bench.transcript());
        let (session, told, _) = replayed(&recorded(&bench), Command::Overhear);
        assert!(pages(&told).is_empty(), "dialect {dialect}: {:#?}", pages(&told));
        assert_eq!(session.facts().diagnostics, None);
    }
}

#[test]
fn pages_that_go_on_behind_a_lost_link_are_known_again_and_those_of_a_restarted_unit_are_over() {
    for (dialect, restarts) in (0..40).map(|number| (number / 2, number % 2 == 1)) {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(6));
        bench.ask(Command::Identify);
        bench.command(Command::Diagnostics { pages: None });
        bench.run_for(Duration::from_secs(5));
        let lost = bench.now;
        bench.lose_link();
        assert_eq!(bench.session.facts().diagnostics, None, "nobody knows");
        if restarts {
            bench.power_cycle(Duration::from_secs(1));
        }
        // What is said meanwhile nobody hears.
        bench.disturb_answers(|_, _| Vec::new());
        bench.run_for(Duration::from_secs(6));
        bench.leave_in_peace();
        let back = bench.now;
        bench.session.link_back(back);
        bench.session.forget_unit();
        bench.ask(Command::Identify);
        bench.run_for(Duration::from_millis(2500));
        let comes = bench.session.facts().diagnostics.is_some();
        assert_eq!(comes, !restarts, "dialect {dialect}:\n{}", bench.transcript());
        let marks = [(lost, "link lost"), (back, "link back as /dev/ttyUSB0")];
        let (_, told, _) = replayed_with(&recorded(&bench), &marks, Command::Overhear);
        let times = told.iter().filter_map(|event| if let Event::Page { at, .. } = event { Some(*at) } else { None });
        assert_eq!(times.max().is_some_and(|at| at > back), !restarts, "dialect {dialect}");
    }
}

#[test]
fn what_the_facts_say_of_a_link_that_was_lost_is_what_it_was_when_it_is_back() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(500) });
    let lost = bench.now;
    let marks = [(lost, "link lost"), (lost + Duration::from_secs(2), "link back as /dev/ttyUSB0")];
    let (session, ..) = replayed_with(&recorded(&bench), &marks, Command::Overhear);
    assert_eq!(session.facts().stream, None, "nobody has heard a row since");
    assert_eq!(session.facts().product, bench.session.facts().product);
    bench.run_for(Duration::from_secs(4));
    let (session, ..) = replayed_with(&recorded(&bench), &marks, Command::Overhear);
    assert_eq!(session.facts().stream, Some(Source::FieldValue));
}

#[test]
fn each_way_to_note_that_a_link_is_back_is_understood() {
    for back in ["link back as /dev/ttyUSB0", "link back after 2.8 s as /dev/ttyUSB1"] {
        let mut session = Session::of_recording(115_200);
        let at = Instant::from_millis(1);
        session.handle_bytes(at, b"\x13");
        session.handle_mark(at, "link lost");
        assert_eq!(session.held_since(), Some(at));
        session.handle_mark(at, back);
        assert_eq!(session.held_since(), None, "{back}");
    }
}

#[test]
fn a_recording_of_an_upload_ends_with_what_the_unit_was_then() {
    let mut bench = Bench::with(flash_with(&small_image("AXTC4CO", "1.1.0")), Duration::ZERO);
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    let read = dictionary(&mut bench);
    // Nobody presses the next key while the menu is still coming.
    bench.run_for(Duration::from_secs(1));
    typed(&mut bench, "s");
    bench.run_for(Duration::from_secs(3));
    bench.command(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0")))));
    bench.outcome();
    bench.run_for(Duration::from_secs(5));
    let (session, told, _) = replayed(&recorded(&bench), Command::Overhear);
    let (live, then) = (bench.session.facts(), session.facts());
    assert_eq!((&live.product, &live.version, live.state), (&then.product, &then.version, then.state));
    assert_eq!(then.version.as_ref().map(|known| known.value.to_string()).as_deref(), Some("1.2.0"));
    assert_eq!((live.diagnostics, then.diagnostics), (None, None), "no page survives a restart");
    let complete: Vec<_> =
        readings(&told).iter().map(|(_, reading)| (values(reading), reading.is_complete())).collect();
    assert_eq!(complete, [(values(&read), true)]);
    assert!((3..=5).contains(&pages(&told).len()), "{:#?}", pages(&told));
}
