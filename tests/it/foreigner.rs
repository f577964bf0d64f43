//! A second unit that shares nothing with our emulator, nor with the first stranger, but what the manual fixes: an
//! eight-channel scanner that paints its screens with cursor moves and colours, ends lines with CR alone or not at all,
//! writes indices as `$6110/1` with the value before the name, takes single keys without Enter, and repaints its
//! dictionary and its diagnostics in place while its stream runs on.

use std::collections::VecDeque;
use std::fmt::Write as _;

use axcon::canopen::{DataType, Value};
use axcon::device::Product;
use axcon::endpoint::Endpoint;
use axcon::record::Span;
use axcon::session::{Awaited, Command, Event, Job, Outcome, UnitState};
use axcon::time::{Duration, Instant};
use axcon::version::Version;
use axcon::wire::diagnostics;
use axcon::wire::stream::{Reading, Source};

use crate::support::visit::{HandMade, Visit};

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Menu,
    Source,
    Period(Source),
    /// The view, at its so-manieth object.
    View(usize),
    Confirm,
}

struct Foreigner {
    state: State,
    digits: Vec<u8>,
    operational: bool,
    rows: Option<(Source, Duration)>,
    next_row: Instant,
    pages: bool,
    next_page: Instant,
    painted: u32,
    says: VecDeque<(Instant, Vec<u8>)>,
    /// How often the factory's values were restored.
    restored: u32,
    /// It asks before it restores in words that offer no Yes.
    asks_strangely: bool,
}

fn product() -> &'static Product {
    Product::named("AXRTD8CO").expect("the scanner for RTDs")
}

impl Foreigner {
    fn new() -> Self {
        Foreigner {
            state: State::Menu,
            digits: Vec::new(),
            operational: false,
            rows: None,
            next_row: Instant::ZERO,
            pages: false,
            next_page: Instant::ZERO,
            painted: 0,
            says: VecDeque::new(),
            restored: 0,
            asks_strangely: false,
        }
    }

    fn say(&mut self, now: Instant, after_ms: u64, text: impl Into<Vec<u8>>) {
        self.says.push_back((now + Duration::from_millis(after_ms), text.into()));
    }

    /// A screen without a single line end.
    fn menu(&mut self, now: Instant, after_ms: u64) {
        let nmt = if self.operational { "Operational" } else { "Pre-Operational" };
        let text = format!(
            "\x1b[2J\x1b[1;1H\x1b[7m RTD SCANNER \x1b[0m\x1b[2;1HAXRTD8CO firmware V2.1.1 built 2013\
             \x1b[3;1HBootloader V2.0.0\x1b[4;1HCAN: node 7Fh at 250 kBaud, mode {nmt}\
             \x1b[6;1H<V>iew dictionary\x1b[7;1H<D>efault parameters\x1b[8;1H<T>oggle stream\
             \x1b[9;1H<S>how diagnostics\x1b[10;1H<L>oad software\x1b[11;1H<M>enu\x1b[13;1HKey:"
        );
        self.say(now, after_ms, text);
    }

    fn objects() -> Vec<Vec<String>> {
        let mut objects: Vec<Vec<String>> = Vec::new();
        let mut last = None;
        for (at, object, entry) in product().dictionary.entries() {
            let value = entry.default.map(|default| default.on_node(127));
            let shown = match (value, entry.data_type) {
                (Some(value), DataType::Real32) => format!("{:.1}", value.as_f64()),
                (Some(value), _) => match (value.as_integer(), entry.data_type) {
                    (Some(bits), DataType::Unsigned32) => format!("{bits:08X}h"),
                    (Some(number), _) => number.to_string(),
                    (None, _) => "---".into(),
                },
                (None, _) => "---".into(),
            };
            let line = if object.entries.len() == 1 {
                format!("${:04X} {shown} {}", at.index, object.name)
            } else {
                format!("${:04X}/{} {shown} {}", at.index, at.sub, entry.name)
            };
            if last == Some(at.index) {
                objects.last_mut().expect("one").push(line);
            } else {
                objects.push(vec![line]);
            }
            last = Some(at.index);
        }
        objects
    }

    fn object(&mut self, now: Instant, number: usize) {
        let objects = Foreigner::objects();
        let mut text = String::from("\x1b[2J\x1b[H");
        match objects.get(number) {
            Some(lines) => {
                for (row, line) in lines.iter().enumerate() {
                    let _ = write!(text, "\x1b[{};3H\x1b[33m{line}\x1b[0m", row + 2);
                }
                text.push_str("\x1b[24;1H<Enter> goes on, <X> leaves");
            }
            None => text.push_str("nothing more"),
        }
        self.say(now, 15, text);
    }

    fn key(&mut self, now: Instant, key: u8) {
        let lower = key.to_ascii_lowercase();
        match self.state {
            State::Menu => match lower {
                b'm' => self.menu(now, 4),
                b'v' if self.operational => self.say(now, 4, "\rView refused: only in pre-operational mode.\r"),
                b'v' => {
                    self.state = State::View(0);
                    self.object(now, 0);
                }
                b't' if self.rows.take().is_some() => self.say(now, 4, "\rstream is off\r"),
                b't' => {
                    self.state = State::Source;
                    self.say(now, 30, "\rField value <F> / process value <P>: ");
                }
                b's' => {
                    self.pages = !self.pages;
                    self.next_page = now + Duration::from_millis(300);
                }
                b'd' => {
                    self.state = State::Confirm;
                    let asked = if self.asks_strangely {
                        "\rAll values will be lost! Are you certain (type the magic word)? "
                    } else {
                        "\rAll values will be lost! Type Yes if you are certain: "
                    };
                    self.say(now, 20, asked);
                }
                _ => {}
            },
            State::Source => match lower {
                b'f' | b'p' => {
                    let source = if lower == b'f' { Source::FieldValue } else { Source::ProcessValue };
                    self.state = State::Period(source);
                    self.say(now, 10, format!("{}\rSend every ... milliseconds: ", char::from(key)));
                }
                _ => self.back(now),
            },
            State::Period(source) => match key {
                b'\r' => {
                    let digits = String::from_utf8_lossy(&std::mem::take(&mut self.digits)).into_owned();
                    self.state = State::Menu;
                    if let Ok(period) = digits.parse() {
                        self.rows = Some((source, Duration::from_millis(period)));
                        self.next_row = now + Duration::from_millis(period);
                        self.say(now, 4, "\r");
                    } else {
                        self.back(now);
                    }
                }
                _ => self.digits.push(key),
            },
            State::View(number) => match lower {
                b'\r' => {
                    self.state = State::View(number + 1);
                    self.object(now, number + 1);
                }
                b'x' => {
                    self.state = State::Menu;
                    self.menu(now, 10);
                }
                _ => {}
            },
            State::Confirm => match key {
                b'\r' => {
                    let typed = std::mem::take(&mut self.digits);
                    self.state = State::Menu;
                    if typed == b"Yes" {
                        self.restored += 1;
                        self.rows = None;
                        self.menu(now, 2500);
                    } else {
                        self.back(now);
                    }
                }
                _ => self.digits.push(key),
            },
        }
    }

    fn back(&mut self, now: Instant) {
        self.state = State::Menu;
        self.digits.clear();
        self.say(now, 5, "\rnothing done\r");
    }
}

impl Endpoint for Foreigner {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes.iter().filter(|byte| **byte != 0x11) {
            self.key(now, byte);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if let Some((source, period)) = self.rows
            && self.next_row <= now
        {
            self.next_row = now + period;
            let row = match source {
                Source::FieldValue => " 100.1; -20.5;Short ;Open  ;Null  ;   0.0; 850.0;-200.0\r",
                Source::ProcessValue => "  5970;  4040;Short ;Open  ;Null  ;  4368; 17968;  1168\r",
            };
            self.say(now, 0, row);
        }
        if self.pages && self.next_page <= now {
            self.next_page = now + Duration::from_secs(1);
            self.painted += 1;
            let page = format!(
                "\x1b[s\x1b[1;1H\x1b[2KUb = 23.9 V\x1b[2;1H\x1b[2KRTD1 = 100.1 C (138.9 Ohm)\x1b[3;1H\x1b[2Kpainted {} times\x1b[u",
                self.painted
            );
            self.say(now, 0, page);
        }
    }

    fn poll_transmit(&mut self) -> Option<axcon::endpoint::Transmit> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let said = self.says.iter().map(|(at, _)| *at).min();
        let row = self.rows.map(|_| self.next_row);
        let page = self.pages.then_some(self.next_page);
        [said, row, page].into_iter().flatten().min()
    }
}

impl HandMade for Foreigner {
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)> {
        &mut self.says
    }
}

fn visit() -> Visit<Foreigner> {
    Visit::to(Foreigner::new())
}

#[test]
fn a_painted_menu_is_read_and_its_loaders_version_is_not_taken() {
    let mut bench = visit();
    assert_eq!(bench.ask(Command::Identify), Outcome::Identified);
    let facts = bench.session.facts();
    assert_eq!(facts.state, UnitState::Application);
    assert_eq!(facts.product.as_ref().map(|known| known.value.as_str()), Some("AXRTD8CO"));
    assert_eq!(facts.version.as_ref().map(|known| known.value), Some(Version::new(2, 1, 1)));
    assert_eq!(facts.node_id.as_ref().map(|known| known.value), Some(127));
    assert_eq!(facts.can_kbps.as_ref().map(|known| known.value), Some(250));
    assert_eq!(facts.nmt_state.as_ref().map(|known| known.value.as_str()), Some("pre-operational"));
}

#[test]
fn single_keys_are_given_without_enter_and_both_sources_are_told_apart() {
    for (source, keys) in [(Source::FieldValue, "tf250\r"), (Source::ProcessValue, "tp250\r")] {
        let mut bench = visit();
        bench.ask(Command::Identify);
        bench.wire.clear();
        let (outcome, heard) = bench.ask_and_listen(Command::StreamOn { source, period: Duration::from_millis(250) });
        assert_eq!(outcome, Outcome::StreamRuns { was_on: false });
        assert_eq!(String::from_utf8_lossy(&bench.wire), keys);
        let row = heard.iter().rev().find_map(|event| match event {
            Event::Row { row, .. } => Some(row),
            _ => None,
        });
        let row = row.expect("a row");
        assert_eq!((row.source, row.readings.len()), (source, 8));
        assert_eq!(row.readings[2..5], [Reading::Short, Reading::Open, Reading::Disabled]);
        assert_eq!(bench.ask(Command::StreamOff), Outcome::Done(Job::StreamOff));
    }
}

#[test]
fn a_repainted_dictionary_is_read_to_its_end_while_rows_run_through_it() {
    let mut bench = visit();
    bench.ask(Command::Identify);
    let outcome = bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(200) });
    assert_eq!(outcome, Outcome::StreamRuns { was_on: false });
    let before = bench.session.record().received();
    let outcome = bench.ask(Command::ReadDictionary);
    let Outcome::DictionaryRead(reading) = outcome else { panic!("{outcome:?}") };
    assert!(reading.is_complete());
    assert_eq!(bench.unit.state, State::Menu, "the view has been left");
    // A row that comes after the hint goes on with its line, so the bytes are counted, and not the rows understood.
    let record = bench.session.record();
    let heard = record.bytes(Span { start: before, end: record.received() });
    let rows = String::from_utf8_lossy(&heard).matches("850.0;-200.0\r").count();
    assert!(rows > 20, "{rows} rows came while it was read");
    assert!(bench.unit.rows.is_some(), "and the stream goes on");
    for (at, object, entry) in product().dictionary.entries() {
        let read = reading.entries.iter().find(|read| read.at == at);
        let read = read.unwrap_or_else(|| panic!("{at} {} {} is missing", object.name, entry.name));
        let expected = entry.default.map(|default| default.on_node(127));
        let same = match (read.value(), expected) {
            (Some(Value::Real32(read)), Some(expected)) => (f64::from(read) - expected.as_f64()).abs() < 0.1,
            (read, expected) => read == expected,
        };
        assert!(same, "{at}: {:?} from {:?}, not {expected:?}", read.value(), read.text);
    }
}

#[test]
fn a_view_that_is_refused_says_why() {
    let mut bench = visit();
    bench.unit.operational = true;
    bench.ask(Command::Identify);
    let outcome = bench.ask(Command::ReadDictionary);
    let Outcome::Refused { reason, .. } = outcome else { panic!("{outcome:?}") };
    assert!(reason.contains("only in pre-operational mode"), "{reason}");
}

#[test]
fn repainted_diagnostics_are_pages_and_are_stopped() {
    let mut bench = visit();
    bench.ask(Command::Identify);
    let (outcome, heard) = bench.ask_and_listen(Command::Diagnostics { pages: Some(3) });
    assert_eq!(outcome, Outcome::Done(Job::Diagnostics));
    assert!(!bench.unit.pages, "and no more come");
    let pages: Vec<_> = heard
        .iter()
        .filter_map(|event| match event {
            Event::Page { lines, .. } => Some(lines),
            _ => None,
        })
        .collect();
    assert_eq!(pages.len(), 3);
    let quantities: Vec<_> = pages[0].iter().flat_map(|line| diagnostics::quantities(&line.text)).collect();
    assert_eq!((quantities[0].value, quantities[0].unit.as_deref()), (Some(23.9), Some("V")));
}

#[test]
fn defaults_are_restored_where_the_question_offers_yes_and_never_guessed_where_it_does_not() {
    let mut bench = visit();
    bench.ask(Command::Identify);
    // Its banner is what its menu shows.
    assert_eq!(bench.ask(Command::RestoreDefaults), Outcome::DefaultsTaken);
    assert_eq!(bench.unit.restored, 1);

    bench.unit.asks_strangely = true;
    bench.wire.clear();
    let outcome = bench.ask(Command::RestoreDefaults);
    let Outcome::NoAnswer { awaited, heard: Some(heard), .. } = outcome else { panic!("{outcome:?}") };
    assert_eq!(awaited, Awaited::DefaultsQuestion);
    let said = String::from_utf8(bench.session.record().bytes(heard)).expect("ASCII");
    assert!(said.contains("magic word"), "the question is shown: {said:?}");
    assert_eq!(bench.wire, b"dNo\r", "and answered with No");
    assert_eq!((bench.unit.restored, bench.unit.state), (1, State::Menu));
}
