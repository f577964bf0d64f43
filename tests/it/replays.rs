//! What was recorded of a talk gives what the talk gave, in virtual time: each job that listens, and all of them together.

use axcon::endpoint::Endpoint;
use axcon::record::{Direction, Entry};
use axcon::session::{Awaited, Command, DictionaryReading, Event, Job, Outcome, Refusal, Session, UnitState};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;

use crate::support::bench::Bench;

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
    let awaited = "an entry of the object dictionary";
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
