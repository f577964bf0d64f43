//! Units that do one thing in their own way: a menu that says "press any key", a view that talks of notes, an adapter that
//! loses a key, loaders that stop their sender once or never, or tell of each sector in words.

use std::collections::VecDeque;

use axcon::canopen::ObjectAddress;
use axcon::endpoint::{Endpoint, Transmit};
use axcon::session::{Command, Event, Job, LoadOrder, LoadReport, Outcome, Session, UnitNow, UnitState, Verdict};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;

use crate::support::bench::{BAUD, order, small_image};
use crate::support::visit::{HandMade, Visit};

/// What a unit has to say, and how many milliseconds later.
type Says = Vec<(u64, String)>;

/// A unit that is nothing but its answer to each byte.
struct Odd {
    answer: Box<dyn FnMut(u8) -> Says>,
    /// Something it says by itself, so often.
    unasked: Option<(Duration, &'static str)>,
    next: Instant,
    says: VecDeque<(Instant, Vec<u8>)>,
}

impl Odd {
    fn new(answer: impl FnMut(u8) -> Says + 'static) -> Self {
        Odd { answer: Box::new(answer), unasked: None, next: Instant::ZERO, says: VecDeque::new() }
    }
}

impl Endpoint for Odd {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes {
            for (late, text) in (self.answer)(byte) {
                self.says.push_back((now + Duration::from_millis(late), text.into_bytes()));
            }
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if let Some((period, text)) = self.unasked.filter(|_| self.next <= now) {
            self.next = now + period;
            self.says.push_back((now, text.as_bytes().to_vec()));
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let said = self.says.iter().map(|(at, _)| *at).min();
        [said, self.unasked.map(|_| self.next)].into_iter().flatten().min()
    }
}

impl HandMade for Odd {
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)> {
        &mut self.says
    }
}

const MENU: &str = "AXTC4CO V1.1.0\r\nV - View Object Dictionary\r\nD - Default Object Dictionary\r\n\
                    T - Toggle Stream\r\nS - Diagnostics\r\nL - Load New Software\r\n";

fn said(text: &str) -> Says {
    vec![(3, text.to_owned())]
}

#[test]
fn press_any_key_behind_a_menu_makes_no_loader_of_a_unit() {
    let mut bench = Visit::to(Odd::new(|key| match key {
        b'm' => said(&format!("{MENU}Press any key to continue\r\n")),
        _ => Vec::new(),
    }));
    assert_eq!(bench.ask(Command::Identify), Outcome::Identified);
    assert_eq!(bench.session.facts().state, UnitState::Application);
    let Outcome::Loaded(report) = bench.ask(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0"))))) else {
        panic!("an upload")
    };
    assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Application), "{report:?}");
    assert!(!bench.wire.contains(&b'S'), "no record for a menu: {}", bench.wire.escape_ascii());
}

#[test]
fn a_refused_view_is_left_all_the_same() {
    let mut bench = Visit::to(Odd::new(|key| match key {
        b'm' => said(MENU),
        b'v' => said("Viewing is not allowed now\r\n"),
        _ => Vec::new(),
    }));
    bench.ask(Command::Identify);
    let outcome = bench.ask(Command::ReadDictionary);
    assert!(matches!(outcome, Outcome::Refused { job: Job::ReadDictionary, .. }), "{outcome:?}");
    assert!(bench.wire.windows(2).any(|keys| keys == b"vx"), "{}", bench.wire.escape_ascii());
}

#[test]
fn a_view_that_begins_with_a_note_is_read() {
    let mut at = 0;
    let mut bench = Visit::to(Odd::new(move |key| match (key, at) {
        (b'm', _) => said(MENU),
        (b'v', _) => {
            at = 1;
            said("Note: press Enter for the next object, X to leave\r\n1000h 00h Device Type = 131476\r\n")
        }
        (b'\r', 1..) => {
            at += 1;
            if at == 2 { said("1001h 00h Error Register = 0\r\n") } else { said(MENU) }
        }
        _ => Vec::new(),
    }));
    bench.ask(Command::Identify);
    let outcome = bench.ask(Command::ReadDictionary);
    let Outcome::DictionaryRead(reading) = outcome else { panic!("{outcome:?}") };
    let read: Vec<ObjectAddress> = reading.entries.iter().map(|entry| entry.at).collect();
    assert_eq!(read, [ObjectAddress::new(0x1000, 0), ObjectAddress::new(0x1001, 0)]);
    assert!(reading.is_complete(), "{:?}", reading.end);
}

#[test]
fn a_reading_ends_though_something_else_is_printed_without_end() {
    let mut unit = Odd::new(|key| if key == b'm' { said(MENU) } else { Vec::new() });
    unit.unasked = Some((Duration::from_millis(90), "channel 1 is at 23.5 degrees now\r\n"));
    let mut bench = Visit::to(unit);
    bench.ask(Command::Identify);
    let outcome = bench.ask(Command::ReadDictionary);
    assert!(matches!(outcome, Outcome::NoAnswer { .. }), "{outcome:?}");
}

#[test]
fn a_stream_is_called_off_only_when_no_more_rows_come() {
    let mut presses = 0;
    let mut unit = Odd::new(move |key| {
        presses += u32::from(key == b't');
        // The first T is lost.
        if key == b't' && presses == 2 { said("Stream off\r\n") } else { Vec::new() }
    });
    unit.unasked = Some((Duration::from_millis(100), "  25.125; 101.500;Disabled;OpenCct ;  -3.250\r\n"));
    let mut bench = Visit::to(unit);
    // It goes on whatever is pressed: that is said, and not that it is off.
    let outcome = bench.ask(Command::StreamOff);
    assert!(matches!(outcome, Outcome::NoAnswer { job: Job::StreamOff, .. }), "{outcome:?}");
    assert!(bench.wire.iter().filter(|&&key| key == b't').count() > 1, "T is pressed again");
}

#[test]
fn rows_without_a_number_are_what_was_asked_for() {
    let mut bench = Visit::to(Odd::new(|key| match key {
        b't' => said("(F)ield value or (P)rocess value? "),
        b'p' => said("\r\nPeriod in ms: "),
        b'\r' => said("\r\nOpen  ;Open  ;Null  ;Null  ;Null  ;Null  ;Null  ;Null  \r\n"),
        _ => Vec::new(),
    }));
    let source = Source::ProcessValue;
    let outcome = bench.ask(Command::StreamOn { source, period: Duration::from_millis(500) });
    assert_eq!(outcome, Outcome::StreamRuns { was_on: false });
    assert_eq!(bench.session.facts().stream, Some(source));
}

/// What a loader does with records, given their number from the header on.
type Taking = fn(usize) -> Option<&'static str>;

/// A unit with a loader that prints what `taking` says behind each record.
fn with_loader(reset_ms: u64, wants_key: bool, echo: fn(char) -> char, taking: Taking) -> Odd {
    let (mut line, mut place, mut records) = (String::new(), 0, 0);
    Odd::new(move |key| match (place, key) {
        (0, b'm') => said(MENU),
        (0, b'l') => {
            place = 1;
            said("Password: ")
        }
        (1, b'\r') => {
            place = if wants_key { 2 } else { 3 };
            let prompt = if wants_key { "Weiter mit Taste\r\n" } else { "Waiting for application S-Record.\r\n" };
            vec![(5, "\r\n".into()), (reset_ms, prompt.into())]
        }
        (1, key) => said(&echo(key.into()).to_string()),
        (2, _) => {
            place = 3;
            said("Waiting for application S-Record.\r\n")
        }
        (3, b'\r') => {
            let record = std::mem::take(&mut line);
            if record.is_empty() {
                return Vec::new();
            }
            records += 1;
            if record.starts_with("S7") {
                place = 0;
                return vec![(40, "\r\nAXTC4CO V1.2.0\r\n".into()), (60, MENU.replace("1.1.0", "1.2.0"))];
            }
            taking(records - 1).map(said).unwrap_or_default()
        }
        (3, key) => {
            line.push(key.into());
            Vec::new()
        }
        _ => Vec::new(),
    })
}

fn load(unit: Odd) -> (LoadReport, Visit<Odd>) {
    let mut bench = Visit::to(unit);
    match bench.ask(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0"))))) {
        Outcome::Loaded(report) => (*report, bench),
        other => panic!("{other:?}"),
    }
}

#[test]
fn loaders_with_a_way_of_their_own_to_take_records_are_uploaded_to() {
    let ways: [(&str, Taking); 4] = [
        ("stops its sender behind the header alone", |record| match record {
            0 => Some("\u{13}\u{11}"),
            number => number.is_multiple_of(16).then_some("."),
        }),
        ("stops nobody and shows a mark behind each half kilobyte", |record| {
            (record > 0 && record.is_multiple_of(16)).then_some(".")
        }),
        ("stops nobody and shows a mark behind two kilobytes", |record| {
            (record > 0 && record.is_multiple_of(64)).then_some(".")
        }),
        ("tells in words of each sector", |record| {
            (record > 0 && record.is_multiple_of(16)).then_some("Sector written\r\n")
        }),
    ];
    for (way, taking) in ways {
        let (report, bench) = load(with_loader(200, false, |c| c, taking));
        assert_eq!((report.verdict, report.unit), (Verdict::Done, UnitNow::Application), "{way}: {report:?}");
        assert!(report.duration < Duration::from_secs(40), "{way}: {report:?}");
        assert!(bench.wire.ends_with(b"\r") || bench.wire.ends_with(b"m"), "{way}");
    }
}

#[test]
fn a_key_that_is_wanted_late_and_in_unknown_words_is_given() {
    let (report, _) = load(with_loader(3_500, true, |c| c, |record| (record % 16 == 0).then_some("\u{13}.\u{11}")));
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
}

#[test]
fn an_echo_of_the_password_is_quoted_in_no_form() {
    // It echoes in lower case, and then says nothing for ever.
    let (report, bench) = load(with_loader(60_000, false, |c| c.to_ascii_lowercase(), |_| None));
    assert_eq!(report.verdict, Verdict::UnitRefused, "{report:?}");
    let told = format!("{report:?}").to_lowercase();
    assert!(!told.contains("axio") && !told.contains("2010"), "{told}");
    let kept: String = bench.session.record().entries().map(|entry| entry.bytes.escape_ascii().to_string()).collect();
    assert!(!kept.to_lowercase().contains("axio"), "{kept}");
}

/// What a loader says that was asked something while it waits for a file.
const COMPLAINT: &str = "Error # 0002\r\nRestarting.\r\nWaiting for application S-Record.\r\n";

/// A unit that waits in its loader, and complains so late of the first Enter that stands alone. `takes` is what it says to a
/// record, given the record's first two characters.
fn found_waiting(late_ms: u64, mut takes: impl FnMut(&str) -> Says + 'static) -> Odd {
    let (mut line, mut asked) = (String::new(), 0);
    Odd::new(move |key| match key {
        b'm' => said(COMPLAINT),
        b'\r' => {
            let record = std::mem::take(&mut line);
            asked += u32::from(record.is_empty());
            match record.get(..2) {
                Some(kind) => takes(kind),
                None if asked == 1 => vec![(late_ms, COMPLAINT.into())],
                None => Vec::new(),
            }
        }
        b'S' | b'0'..=b'9' | b'A'..=b'F' => {
            line.push(key.into());
            Vec::new()
        }
        _ => Vec::new(),
    })
}

/// Uploads to it, well and without a remark.
fn save(unit: Odd, order: LoadOrder) -> Visit<Odd> {
    let mut bench = Visit::to(unit);
    let Outcome::Loaded(report) = bench.ask(Command::Load(Box::new(order))) else { panic!("an upload") };
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
    assert!(report.found_in_loader && report.remark.is_none(), "{report:?}");
    bench
}

/// The banner and the menu of new software.
fn starts(product: &str) -> Says {
    let menu = MENU.replace("AXTC4CO V1.1.0", &format!("{product} V1.2.0"));
    vec![(40, format!("\r\n{product} V1.2.0\r\n")), (60, menu)]
}

#[test]
fn an_answer_of_a_waiting_loader_that_comes_late_is_not_the_first_records() {
    let mut data = 0;
    // The complaint comes when the header has left.
    let unit = found_waiting(450, move |kind| match kind {
        "S7" => starts("AXTC4CO"),
        "S0" => {
            data = 0;
            Vec::new()
        }
        "S3" => {
            data += 1;
            // Behind each record that crosses into another page of 256 words.
            if data % 16 == 1 && data > 1 { said("\u{13}.\u{11}") } else { Vec::new() }
        }
        _ => Vec::new(),
    });
    let bench = save(unit, LoadOrder { product: Some("AXTC4CO".into()), ..order(small_image("AXTC4CO", "1.2.0")) });
    let headers = bench.wire.windows(2).filter(|start| start == b"S0").count();
    assert_eq!(headers, 2, "it was sent anew");
}

#[test]
fn silence_before_a_late_answer_says_nothing_of_how_the_loader_stops_its_sender() {
    // It has a ring, and is found waiting. Its complaint of what it was asked comes when its silence behind the header has
    // made another kind of loader of it; once it has begun anew it erases, and an adapter shows that late.
    let mut headers = 0;
    let unit = found_waiting(1_600, move |kind| match kind {
        "S7" => starts("AXRTD8CO"),
        "S0" => {
            headers += 1;
            if headers == 1 { vec![(5, "*".into())] } else { vec![(200, "\u{13}".into()), (1_500, "\u{11}".into())] }
        }
        "S3" if headers == 2 => said("\u{13}\u{11}"),
        _ => Vec::new(),
    });
    let image = small_image("AXRTD8CO", "1.2.0");
    let bench = save(unit, LoadOrder { product: Some("AXRTD8CO".into()), packed: true, ..order(image) });
    let sent: Vec<(Instant, &[u8])> =
        bench.session.record().entries().map(|entry| (entry.at, &entry.bytes[..])).collect();
    let begins = |kind: &[u8]| sent.iter().filter(|(_, bytes)| bytes.starts_with(kind)).collect::<Vec<_>>();
    let (headers, data) = (begins(b"S0"), begins(b"S3"));
    let before = data.iter().filter(|(at, _)| *at < headers[1].0).count();
    assert!(headers.len() == 2 && before > 0, "{} headers, {before} records before the second", headers.len());
    let first = data[before].0.since(headers[1].0);
    assert!(first >= Duration::from_millis(1_500), "data leaves for a loader that is erasing: {first:?}");
    let longest = data[before..].iter().map(|(_, bytes)| bytes.len()).max();
    assert!(longest < Some(300), "its ring keeps several of the records: {longest:?}");
}

/// A row of the stream, which comes so fast that the unit is never silent for long.
const ROW: &str = "  23.500;  24.000;  24.000;  25.000; 100.125\r\n";

fn streaming(answer: impl FnMut(u8) -> Says + 'static) -> Visit<Odd> {
    let mut unit = Odd::new(answer);
    unit.unasked = Some((Duration::from_millis(20), ROW));
    Visit::to(unit)
}

#[test]
fn a_question_is_heard_though_rows_go_on_behind_it() {
    let mut typed = Vec::new();
    let mut bench = streaming(move |key| match key {
        b'm' => said(MENU),
        b'l' => said("Password: "),
        b'd' => said("Restore the defaults? Enter Yes: "),
        b'\r' => match std::mem::take(&mut typed).as_slice() {
            b"AXIO-2010" => said("wrong password\r\n"),
            b"Yes" => said("AXTC4CO V1.1.0\r\n"),
            _ => Vec::new(),
        },
        key => {
            typed.extend((!key.is_ascii_control()).then_some(key));
            Vec::new()
        }
    });
    // Its menu shows the same as the banner behind the Yes.
    assert_eq!(bench.ask(Command::RestoreDefaults), Outcome::DefaultsTaken);
    let (outcome, heard) = bench.ask_and_listen(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0")))));
    let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
    assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Application), "{report:?}");
    assert_eq!(report.what, "the unit did not accept the password");
    assert!(heard.iter().any(|event| matches!(event, Event::Row { .. })), "and the rows are not lost");
    let kept: String = bench.session.record().entries().map(|entry| entry.bytes.escape_ascii().to_string()).collect();
    assert!(!kept.contains("AXIO"), "{kept}");
}

#[test]
fn what_is_typed_at_the_password_is_secret_while_rows_go_on() {
    for mut session in [Session::new(BAUD), Session::plain(BAUD)] {
        let mut now = Instant::ZERO;
        session.handle_bytes(now, b"\r\nPassword: ");
        for _ in 0..50 {
            now += Duration::from_millis(20);
            session.handle_timeout(now);
            session.handle_bytes(now, ROW.as_bytes());
            assert!(session.password_open());
        }
        session.command(now, Command::Keys(b"AXIO-2010\r".to_vec())).expect("taken");
        while session.poll_transmit().is_some() {
            now += Duration::from_millis(5);
            session.handle_timeout(now);
        }
        session.handle_bytes(now, b"\r\nwrong\r\n");
        assert!(!session.password_open(), "the question is over");
        let kept: Vec<u8> = session.record().entries().flat_map(|entry| entry.bytes.clone()).collect();
        assert!(!kept.windows(4).any(|window| window == b"AXIO"), "{}", kept.escape_ascii());
    }
}
