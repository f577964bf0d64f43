//! Stories of talks with the firmware: console and unit on one cable, in virtual time.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;

use axcon::canopen::{ObjectAddress, Value};
use axcon::endpoint::{Arrived, Endpoint};
use axcon::record::Direction;
use axcon::rng::Rng;
use axcon::session::{Command, DictionaryReading, Event, Job, Origin, Outcome, Session, UnitState, WalkEnd};
use axcon::time::{Duration, Instant};
use axcon::version::Version;
use axcon::wire::stream::Source;

use crate::support::bench::{Bench, axrtd8co, axtc4co};

#[test]
fn the_unit_says_who_it_is() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    assert_eq!(bench.ask(Command::Identify), Outcome::Identified);
    let facts = bench.session.facts();
    assert_eq!(facts.state, UnitState::Application);
    assert_eq!(facts.product.as_ref().map(|known| known.value.as_str()), Some("AXTC4CO"));
    assert_eq!(facts.version.as_ref().map(|known| known.value), Some(Version::new(1, 1, 0)));
    assert_eq!(facts.node_id.as_ref().map(|known| known.value), Some(127));
    assert_eq!(facts.can_kbps.as_ref().map(|known| known.value), Some(125));
    assert_eq!(facts.nmt_state.as_ref().map(|known| known.value.as_str()), Some("pre-operational"));
}

#[test]
fn a_unit_that_stands_in_a_dialogue_is_found_all_the_same() {
    for keys in [&b"l"[..], b"d", b"t", b"tf", b"v", b"s", b"lAX"] {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        bench.command(Command::Keys(keys.to_vec()));
        bench.run_for(Duration::from_millis(500));
        // Somebody else has left it so.
        bench.session = Session::new(115_200);
        bench.ask(Command::Identify);
        let product = bench.session.facts().product.as_ref().map(|known| known.value.clone());
        assert_eq!(product.as_deref(), Some("AXTC4CO"), "after {}", keys.escape_ascii());
    }
}

#[test]
fn an_xoff_in_noise_keeps_nobody_from_asking_again() {
    let mut session = Session::new(115_200);
    let mut now = Instant::from_millis(1);
    for round in 1..=2 {
        session.command(now, Command::Identify).expect("taken");
        // Held by it, the rest of the questions waits, but the next time it is asked at once.
        let question = session.poll_transmit();
        assert!(question.is_some(), "round {round}");
        session.handle_bytes(now, b"\xf3\x13\xe1zq#\r\n");
        while session.job().is_some() {
            while session.poll_transmit().is_some() {}
            now = session.poll_timeout().expect("a question has its time").max(now);
            session.handle_timeout(now);
        }
        assert_eq!(session.facts().state, UnitState::Unknown, "round {round}");
    }
}

#[test]
fn the_stream_is_switched_on_read_and_switched_off() {
    for source in [Source::FieldValue, Source::ProcessValue] {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        let outcome = bench.ask(Command::StreamOn { source, period: Duration::from_millis(200) });
        assert_eq!(outcome, Outcome::StreamRuns { was_on: false }, "{}", bench.transcript());
        let mut rows = 0;
        let end = bench.now + Duration::from_secs(2);
        bench.run_until(end, |event| {
            if let Event::Row { row, .. } = event {
                assert_eq!((row.source, row.readings.len()), (source, 5));
                rows += 1;
            }
            false
        });
        assert!((9..=11).contains(&rows), "{rows} rows in 2 s at 200 ms");
        assert_eq!(bench.ask(Command::StreamOff), Outcome::Done(Job::StreamOff));
        let end = bench.now + Duration::from_secs(2);
        assert_eq!(bench.run_until(end, |event| matches!(event, Event::Row { .. })), None);
    }
}

#[test]
fn a_stream_that_was_on_is_changed_and_said_to_have_been_on() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(500) });
    let outcome = bench.ask(Command::StreamOn { source: Source::ProcessValue, period: Duration::from_millis(200) });
    assert_eq!(outcome, Outcome::StreamRuns { was_on: true }, "{}", bench.transcript());
    assert_eq!(bench.session.facts().stream, Some(Source::ProcessValue));
}

#[test]
fn a_stream_survives_a_power_cycle() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::StreamOn { source: Source::ProcessValue, period: Duration::from_millis(300) });
    bench.power_cycle(Duration::from_secs(1));
    let end = bench.now + Duration::from_secs(5);
    let row =
        bench.run_until(end, |event| matches!(event, Event::Row { row, .. } if row.source == Source::ProcessValue));
    assert!(row.is_some(), "{}", bench.transcript());
}

#[test]
fn the_defaults_are_restored_by_yes_and_the_unit_comes_back() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    // A setting of the unit's own, kept across its restarts.
    let factor = "6126:1".parse().expect("an entry");
    for (at, data) in [(factor, 18f32.to_le_bytes()), ("1010:1".parse().expect("an entry"), *b"save")] {
        bench.unit.unit_mut().write_object(bench.now, at, &data).expect("taken");
    }
    assert_eq!(bench.ask(Command::RestoreDefaults), Outcome::Done(Job::RestoreDefaults), "{}", bench.transcript());
    let now = bench.now;
    assert_eq!(bench.unit.unit_mut().read_object(now, factor), Ok(Value::Real32(16.0)));
}

/// Pages of diagnostics within a time, as their lines.
fn pages_within(bench: &mut Bench, time: Duration) -> Vec<Vec<String>> {
    let mut pages = Vec::new();
    let end = bench.now + time;
    bench.run_until(end, |event| {
        if let Event::Page { lines, .. } = event {
            pages.push(lines.iter().map(|line| line.text.clone()).collect());
        }
        false
    });
    pages
}

#[test]
fn diagnostics_are_read_page_by_page_and_stopped_whether_they_ran_before_or_not() {
    for (runs_before, streams) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        if streams {
            bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(20) });
        }
        if runs_before {
            bench.command(Command::Keys(b"s".to_vec()));
            bench.run_for(Duration::from_millis(2300));
        }
        bench.command(Command::Diagnostics { pages: Some(3) });
        let pages = pages_within(&mut bench, Duration::from_secs(12));
        assert_eq!(pages.len(), 3, "{runs_before} {streams}: {pages:?}");
        assert!(pages.iter().all(|page| page.iter().any(|line| line.contains("Supply"))), "{pages:?}");
        assert!(pages.iter().flatten().all(|line| !line.contains(';')), "no row is taken for a line: {pages:?}");
        assert_eq!(bench.session.job(), None, "the job has ended");
        let before = bench.transcript().matches("Supply").count();
        bench.run_for(Duration::from_secs(5));
        assert_eq!(bench.transcript().matches("Supply").count(), before, "no page comes any more");
    }
}

#[test]
fn diagnostics_that_are_cancelled_at_any_moment_are_off_afterwards() {
    for moment_ms in (0..4_500).step_by(130) {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        bench.command(Command::Diagnostics { pages: None });
        bench.run_for(Duration::from_millis(moment_ms));
        let outcome = bench.ask(Command::Cancel);
        assert_eq!(outcome, Outcome::Cancelled(Job::Diagnostics), "cancelled after {moment_ms} ms");
        let before = bench.transcript().matches("Supply").count();
        bench.run_for(Duration::from_secs(3));
        assert_eq!(bench.transcript().matches("Supply").count(), before, "cancelled after {moment_ms} ms");
    }
}

#[test]
fn a_reading_of_the_dictionary_that_is_cancelled_at_any_moment_leaves_the_view() {
    let entry = "6100:1".parse().expect("an entry");
    for moment_ms in (10..4_000).step_by(70) {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        bench.command(Command::ReadDictionary);
        bench.run_for(Duration::from_millis(moment_ms));
        let outcome = bench.ask(Command::Cancel);
        match outcome {
            Outcome::Cancelled(Job::ReadDictionary) => assert!(moment_ms < 100, "nothing had been read"),
            Outcome::DictionaryRead(read) => assert!(!read.is_complete(), "cancelled after {moment_ms} ms"),
            other => panic!("{other:?}, cancelled after {moment_ms} ms"),
        }
        assert!(
            bench.unit.unit_mut().read_object(bench.now, entry).is_ok(),
            "after {moment_ms} ms: {}",
            bench.transcript()
        );
    }
}

#[test]
fn a_name_that_was_lost_on_the_line_is_asked_for_again() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.reconnect();
    // The banner and the menu's heading are lost, of the first answer only.
    let first = bench.received_so_far();
    bench.disturb_answers(move |number, byte| if number < first + 150 { Vec::new() } else { vec![byte] });
    bench.ask(Command::Identify);
    let facts = bench.session.facts();
    assert_eq!(facts.product.as_ref().map(|known| known.value.as_str()), Some("AXTC4CO"), "{}", bench.transcript());
}

#[test]
fn a_unit_whose_menu_does_not_name_it_is_known_by_its_product_code() {
    let mut bench = Bench::in_dialect(axrtd8co(), 42);
    bench.run_for(Duration::from_secs(7));
    bench.reconnect();
    bench.ask(Command::Identify);
    assert_eq!(bench.session.facts().product, None, "{}", bench.transcript());
    let Outcome::DictionaryRead(reading) = bench.ask(Command::ReadDictionary) else { panic!("{}", bench.transcript()) };
    let product = bench.session.facts().product.clone().expect("a product");
    assert_eq!((product.value.as_str(), product.origin), ("AXRTD8CO", Origin::Dictionary));
    assert_eq!(reading.entries.len(), axrtd8co().dictionary.entries().count());
    let understood = reading.entries.iter().all(|entry| entry.reading.is_some());
    assert!(understood, "all of it, from the first line on");
}

/// A busy computer keeps back what has come, from any byte on, and gives it with what the unit says next: seconds later,
/// as an answer to something else.
#[test]
fn half_an_entry_is_never_read_as_a_value() {
    const DIALECTS: u64 = 30;
    let read = |dialect: u64, kept_from: Option<u64>| -> BTreeMap<ObjectAddress, (Option<Value>, String)> {
        let mut bench = Bench::in_dialect(axtc4co(), dialect);
        bench.run_for(Duration::from_secs(4));
        bench.ask(Command::Identify);
        let first = bench.received_so_far();
        if let Some(from) = kept_from {
            let asked_again = Rc::new(Cell::new(false));
            let (mut kept, mut given) = (Vec::new(), false);
            let noticed = asked_again.clone();
            bench.disturb_answers(move |number, byte| {
                if given || number < first + from {
                    // What comes before the moment does not bring it nearer.
                    noticed.set(false);
                    return vec![byte];
                }
                kept.push(byte);
                given = noticed.get();
                if given { std::mem::take(&mut kept) } else { Vec::new() }
            });
            bench.disturb(move |_, byte| {
                asked_again.set(true);
                vec![byte]
            });
        }
        match bench.ask(Command::ReadDictionary) {
            Outcome::DictionaryRead(reading) => {
                reading.entries.into_iter().map(|entry| (entry.at, (entry.value(), entry.text))).collect()
            }
            // All of the first answer was kept back.
            Outcome::NoAnswer { .. } => BTreeMap::new(),
            outcome => panic!("kept back from {kept_from:?}: {outcome:?}"),
        }
    };
    for dialect in 0..DIALECTS {
        let whole = read(dialect, None);
        let (mut readings, mut complete) = (0, 0);
        for from in (61 * dialect..9_000).step_by(1_801) {
            let read = read(dialect, Some(from));
            for (at, shown) in &read {
                assert_eq!(whole.get(at), Some(shown), "{at} in dialect {dialect}, kept back from byte {from} on");
            }
            readings += 1;
            complete += u32::from(read.len() == whole.len());
        }
        assert!(complete * 2 > readings, "dialect {dialect}: {complete} of {readings} readings were complete");
    }
}

#[test]
fn a_unit_that_is_operational_says_why_it_shows_no_dictionary() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let now = bench.now;
    bench.unit.unit_mut().nmt(now, axcon::emulator::NmtCommand::Start);
    let Outcome::Refused { reason, .. } = bench.ask(Command::ReadDictionary) else { panic!("{}", bench.transcript()) };
    assert!(reason.contains("Pre-Operational state only"), "{reason}");
}

#[test]
fn a_unit_that_falls_silent_in_its_view_is_left_and_what_was_read_is_kept() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    // The eleventh Enter and all behind it are lost, but not the key that leaves.
    let mut enters = 0;
    bench.disturb(move |_, byte| {
        enters += u32::from(byte == b'\r');
        if byte == b'\r' && enters > 10 { Vec::new() } else { vec![byte] }
    });
    let Outcome::DictionaryRead(reading) = bench.ask(Command::ReadDictionary) else { panic!("{}", bench.transcript()) };
    assert!(!reading.is_complete() && reading.entries.len() > 90, "{}", reading.entries.len());
    let entry = "6100:1".parse().expect("an entry");
    assert!(bench.unit.unit_mut().read_object(bench.now, entry).is_ok(), "the view has been left");
}

/// Reads the dictionary while a part of what the unit answers is lost, by the characters received since the key. Gives
/// the reading, the entries there are, and how often the view was opened.
fn read_with_a_loss(lost: std::ops::Range<u64>) -> (DictionaryReading, usize, usize) {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.ask(Command::Identify);
    let first = bench.received_so_far();
    bench.disturb_answers(move |number, byte| if lost.contains(&(number - first)) { Vec::new() } else { vec![byte] });
    bench.wire.clear();
    let Outcome::DictionaryRead(reading) = bench.ask(Command::ReadDictionary) else { panic!("{}", bench.transcript()) };
    let views = bench.wire.iter().filter(|key| **key == b'v').count();
    let entry = "6100:1".parse().expect("an entry");
    assert!(bench.unit.unit_mut().read_object(bench.now, entry).is_ok(), "the view has been left");
    (*reading, axtc4co().dictionary.entries().count(), views)
}

#[test]
fn lines_of_the_dictionary_that_were_lost_are_read_in_a_second_walk() {
    let (reading, all, views) = read_with_a_loss(0..0);
    assert_eq!((reading.entries.len(), reading.is_complete(), views), (all, true, 1));
    let (reading, all, views) = read_with_a_loss(2000..2100);
    assert_eq!((reading.entries.len(), reading.is_complete(), views), (all, true, 2), "a few lines");
    // So much is no loss of the line; but the menu names its unit, as a banner does that cuts a walk short.
    let (reading, all, views) = read_with_a_loss(1000..3500);
    assert_eq!((reading.entries.len(), reading.is_complete(), views), (all, true, 2), "whole objects");
}

#[test]
fn a_unit_that_starts_anew_in_its_view_has_not_shown_all_of_it() {
    let read = |restarts: usize| {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        bench.command(Command::ReadDictionary);
        // Not in the same place: nothing of a unit's own making ends its view there.
        for restart in 0..restarts {
            bench.run_for(Duration::from_millis(2_000 + 700 * restart as u64));
            bench.power_cycle(Duration::from_millis(100));
        }
        let Outcome::DictionaryRead(reading) = bench.outcome() else { panic!("{}", bench.transcript()) };
        (reading.end.clone(), reading.entries.len())
    };
    let all = axtc4co().dictionary.entries().count();
    assert_eq!(read(1), (WalkEnd::Whole, all), "it is read once more");
    let (end, entries) = read(2);
    assert!(end == WalkEnd::Restarted && entries < all, "{end:?}, {entries} of {all}");
}

#[test]
fn a_unit_without_diagnostics_ends_the_wait() {
    let mut bench = Bench::new();
    bench.disturb(|_, byte| if byte == b's' { Vec::new() } else { vec![byte] });
    bench.run_for(Duration::from_secs(4));
    let outcome = bench.ask(Command::Diagnostics { pages: Some(1) });
    assert!(matches!(outcome, Outcome::NoAnswer { job: Job::Diagnostics, .. }), "{outcome:?}");
}

#[test]
fn a_password_typed_by_hand_is_secret_too() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.command(Command::Keys(b"l".to_vec()));
    bench.run_for(Duration::from_millis(300));
    for key in b"AXIO-2011" {
        bench.command(Command::Keys(vec![*key]));
        bench.run_for(Duration::from_millis(90));
    }
    bench.command(Command::Keys(b"\r".to_vec()));
    bench.run_for(Duration::from_millis(900));
    assert!(bench.wire.ends_with(b"AXIO-2011\r"));
    // Each direction alone: keys and echoes come by turns.
    let kept = |wanted: Direction| -> Vec<u8> {
        let entries = bench.session.record().entries().filter(|entry| entry.direction == wanted);
        entries.flat_map(|entry| entry.bytes.clone()).collect()
    };
    assert_eq!(kept(Direction::ToUnit).escape_ascii().to_string(), "l*********\\r");
    let heard = String::from_utf8_lossy(&kept(Direction::FromUnit)).into_owned();
    assert!(heard.contains("*********") && !heard.contains("AXIO") && !heard.contains("2011"), "{heard}");
    assert!(!bench.session.password_open(), "the next key is no secret any more");
}

#[test]
fn what_is_typed_behind_l_is_secret_however_the_unit_asks_for_it() {
    let mut session = Session::new(115_200);
    let mut now = Instant::ZERO;
    let mut wire = Vec::new();
    // The whole answer may come in one piece, from a script.
    session.command(now, Command::Keys(b"mlAXIO-2010\rm".to_vec())).expect("taken");
    for _ in 0..10 {
        now += Duration::from_millis(10);
        session.handle_timeout(now);
        while let Some(transmit) = session.poll_transmit() {
            wire.extend(transmit.bytes);
        }
    }
    session.handle_bytes(now, b"Geheimwort? AXIO-2010\r\nSo sei es.\r\n");
    assert_eq!(wire, b"mlAXIO-2010\rm");
    let record: Vec<u8> = session.record().entries().flat_map(|entry| entry.bytes.clone()).collect();
    let record = String::from_utf8(record).expect("text");
    assert!(!record.contains("AXIO") && record.starts_with("ml*********\r"), "{record}");
    assert!(record.ends_with("So sei es.\r\n"), "{record}");
}

#[test]
fn a_password_that_is_repeated_with_flow_control_or_a_pause_in_it_is_recorded_nowhere() {
    let mut session = Session::new(115_200);
    session.command(Instant::ZERO, Command::Keys(b"lAXIO-2010\r".to_vec())).expect("taken");
    let mut now = Instant::ZERO;
    let pieces: [&[u8]; 6] =
        [b"\r\nwrong password: AXIO\x13", b"-20\x1110\r\n", b"you said AXIO-", b"2010", b" and ", b"AXIO-2010"];
    for piece in pieces {
        now += Duration::from_millis(40);
        session.handle_timeout(now);
        while session.poll_transmit().is_some() {}
        session.handle_bytes(now, piece);
        let is_held = session.held_since().is_some();
        assert_eq!(is_held, piece.ends_with(b"\x13"), "flow control is obeyed at once");
    }
    session.handle_timeout(now + Duration::from_millis(40));
    let from_unit = session.record().entries().filter(|entry| entry.direction == Direction::FromUnit);
    let record: Vec<u8> = from_unit.flat_map(|entry| entry.bytes.clone()).collect();
    assert_eq!(
        record.escape_ascii().to_string(),
        "\\r\\nwrong password: ****\\x13***\\x11**\\r\\nyou said ********* and *********"
    );
    while let Some(event) = session.poll_event() {
        let told = format!("{event:?}");
        assert!(!told.contains("AXIO") && !told.contains("2010"), "{told}");
    }
}

#[test]
fn a_job_given_while_the_unit_is_being_asked_who_it_is_begins_behind_that() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.command(Command::Identify);
    bench.run_for(Duration::from_millis(30));
    bench.command(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(200) });
    let third = bench.session.command(bench.now, Command::StreamOff);
    assert!(third.is_err(), "one may wait, not two");
    assert_eq!(bench.outcome(), Outcome::Identified);
    assert_eq!(bench.outcome(), Outcome::StreamRuns { was_on: false });

    bench.command(Command::Identify);
    bench.command(Command::StreamOff);
    bench.command(Command::Cancel);
    assert_eq!(bench.outcome(), Outcome::Cancelled(Job::StreamOff));
    assert_eq!(bench.outcome(), Outcome::Identified);
    assert_eq!(bench.session.facts().stream, Some(Source::FieldValue), "what was cancelled has not begun");
}

#[test]
fn noise_is_never_taken_for_a_unit() {
    for seed in 0..40 {
        let mut rng = Rng::new(seed).fork("noise");
        let mut session = Session::new(115_200);
        let mut now = Instant::ZERO;
        session.command(now, Command::Identify).expect("taken");
        let mut ended = false;
        // As fast as a pseudo-terminal lets a stranger talk, for as long as the question takes.
        while !ended {
            now += Duration::from_millis(10);
            let noise: Vec<u8> = (0..1000).map(|_| rng.next_u64() as u8).collect();
            session.handle_bytes(now, &noise);
            session.handle_timeout(now);
            while session.poll_transmit().is_some() {}
            while let Some(event) = session.poll_event() {
                ended |= matches!(event, Event::Finished(Outcome::Identified));
            }
            assert!(now < Instant::from_millis(10_000), "an end");
        }
        assert_eq!(session.facts().state, UnitState::Unknown, "seed {seed}: {:?}", session.facts());
    }
}

#[test]
fn what_had_to_wait_is_dated_when_it_came_and_heard_before_anything_that_was_due() {
    let mut session = Session::new(115_200);
    session.command(Instant::ZERO, Command::Identify).expect("taken");
    while session.poll_transmit().is_some() {}
    let piece = |millis, text: &str| Arrived { at: Instant::from_millis(millis), bytes: text.into() };
    // Ten seconds are more than any question waits.
    let now = Instant::from_millis(10_000);
    let backlog = [piece(40, "AXTC4CO V1.1.0\r\n"), piece(50, "CAN Status: Node ID = 127, Baud Rate = 125 kbps\r\n")];
    session.handle_backlog(now, &backlog);
    assert_eq!(session.facts().state, UnitState::Application);
    let mut dated = Vec::new();
    while let Some(event) = session.poll_event() {
        if let Event::Heard { at, .. } = event {
            dated.push(at);
        }
    }
    assert_eq!(dated, [Instant::from_millis(40), Instant::from_millis(50)]);
    // What follows lies behind it, also in the record.
    session.handle_timeout(now);
    while session.poll_transmit().is_some() {}
    session.handle_backlog(now, &[piece(60, "late\r\n")]);
    let times: Vec<Instant> = session.record().entries().map(|entry| entry.at).collect();
    assert!(times.is_sorted(), "{times:?}");
}
