//! What was recorded of a talk gives what the talk gave, in virtual time: each job that listens, and all of them together.

use axcon::endpoint::Endpoint;
use axcon::record::{Direction, Entry};
use axcon::session::{Awaited, Command, DictionaryReading, Event, Job, Outcome, Refusal, Session, UnitState};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;

use crate::support::bench::{Bench, axtc4co};

/// Plays a record to one job; what it has told, and how it ended.
fn replayed(record: &[Entry], command: Command) -> (Session, Vec<Event>, Option<Outcome>) {
    let mut session = Session::of_recording(115_200);
    session.command(Instant::ZERO, command).expect("it listens");
    let look_after = |session: &mut Session, until: Instant| {
        while let Some(due) = session.poll_timeout().filter(|due| *due <= until) {
            session.handle_timeout(due);
        }
    };
    for entry in record {
        look_after(&mut session, entry.at);
        match entry.direction {
            Direction::ToUnit => session.handle_sent(entry.at, &entry.bytes),
            Direction::FromUnit => session.handle_bytes(entry.at, &entry.bytes),
        }
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
    reading.entries.iter().map(|entry| format!("{} {:?}", entry.at, entry.value)).collect()
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
    assert_eq!((values(&reading), reading.complete), (values(&live), true));
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
    let read: Vec<&DictionaryReading> =
        told.iter().filter_map(|event| if let Event::Overheard(read) = event { Some(&**read) } else { None }).collect();
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
