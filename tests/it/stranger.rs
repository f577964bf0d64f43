//! A unit that shares nothing with our emulator but what the manual fixes: keys, quoted strings, the product's name, a
//! version of three numbers, rows. Its banner, menu and prompts are worded and laid out otherwise, it wants Enter
//! behind single answers, it echoes the password, and its loader stops nobody and prints stars.

use std::collections::VecDeque;

use axcon::endpoint::Endpoint;
use axcon::image::DefectId;
use axcon::secret::Secret;
use axcon::session::{Command, LoadReport, Outcome, UnitNow, UnitState, Verdict};
use axcon::time::{Duration, Instant};
use axcon::version::Version;
use axcon::wire::stream::Source;

use crate::support::bench::{order, small_image};
use crate::support::visit::{HandMade, Visit};

/// What the stranger is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Menu,
    Password,
    Source,
    Period,
    Loader,
}

struct Stranger {
    state: State,
    version: &'static str,
    /// The version it has after the next upload.
    next: &'static str,
    line: Vec<u8>,
    records: usize,
    row_every: Option<Duration>,
    next_row: Instant,
    says: VecDeque<(Instant, Vec<u8>)>,
    /// Every record it got while no loader listened.
    strays: usize,
    /// The loader fails behind this many records.
    fails_at: Option<usize>,
}

impl Stranger {
    fn new() -> Self {
        Stranger {
            state: State::Menu,
            version: "2.10.7",
            next: "1.2.0",
            line: Vec::new(),
            records: 0,
            row_every: None,
            next_row: Instant::ZERO,
            says: VecDeque::new(),
            strays: 0,
            fails_at: None,
        }
    }

    fn say(&mut self, now: Instant, after_ms: u64, text: &str) {
        self.says.push_back((now + Duration::from_millis(after_ms), text.as_bytes().to_vec()));
    }

    fn menu(&mut self, now: Instant) {
        let text = format!(
            "\n\r\x1b[1m*** thermocouple scanner ***\x1b[0m\n\rtype: AxTc4Co\n\rhardware revision 3.0.1\n\rfw version {}\n\r\
             network: id=7Fh  125000 bit/s  NMT PREOPERATIONAL\n\r[m] this menu\n\r[v] object dictionary view\n\r\
             [d] restore defaults\n\r[t] data stream on/off\n\r[s] diagnostics\n\r[l] new software load\n\r> ",
            self.version
        );
        self.say(now, 5, &text);
    }

    fn key(&mut self, now: Instant, key: u8) {
        match self.state {
            State::Menu => match key.to_ascii_lowercase() {
                b'm' => self.menu(now),
                b't' if self.row_every.is_some() => {
                    self.row_every = None;
                    self.say(now, 5, "stream stopped\n\r> ");
                }
                b't' => {
                    self.state = State::Source;
                    self.say(now, 40, "1=FV 6100h, 2=PV 7130h : ");
                }
                b'l' => {
                    self.state = State::Password;
                    self.say(now, 40, "PASSWORD ? ");
                }
                b's' | b'0'..=b'9' => self.strays += usize::from(key == b'S'),
                _ => {}
            },
            State::Password | State::Source | State::Period => {
                let echo = [key];
                self.say(now, 0, std::str::from_utf8(&echo).unwrap_or("?"));
                if key == b'\r' { self.answer(now) } else { self.line.push(key) }
            }
            State::Loader => {
                if key == b'\r' {
                    self.record(now)
                } else {
                    self.line.push(key)
                }
            }
        }
    }

    fn answer(&mut self, now: Instant) {
        let line = std::mem::take(&mut self.line);
        match (self.state, line.as_slice()) {
            (State::Password, b"Geheim-1") => {
                self.state = State::Loader;
                self.records = 0;
                self.say(now, 300, "\n\r\n\rBOOT 2.0\n\rWaiting for application S-Record");
            }
            (State::Password, _) => {
                self.state = State::Menu;
                self.say(now, 200, "\n\raccess denied\n\r> ");
            }
            (State::Source, b"1" | b"2") => {
                self.state = State::Period;
                self.say(now, 5, "\n\rinterval [msec] ? ");
            }
            (State::Period, digits) if !digits.is_empty() => {
                self.state = State::Menu;
                let period = String::from_utf8_lossy(digits).parse().expect("digits");
                self.row_every = Some(Duration::from_millis(period));
                self.next_row = now + Duration::from_millis(period);
                self.say(now, 5, "\n\rok\n\r");
            }
            _ => {
                self.state = State::Menu;
                self.say(now, 5, "\n\r?\n\r> ");
            }
        }
    }

    fn record(&mut self, now: Instant) {
        let line = std::mem::take(&mut self.line);
        let good = line.starts_with(b"S") && line[1..].iter().all(u8::is_ascii_hexdigit);
        self.records += 1;
        if !good || self.fails_at == Some(self.records) {
            self.say(now, 1, "\n\rError # 0004\n\rRestarting.\n\rWaiting for application S-Record");
            self.records = 0;
            self.fails_at = None;
        } else if line.starts_with(b"S7") {
            self.state = State::Menu;
            self.version = self.next;
            self.say(now, 900, "\n\rS-File has been loaded successfully\n\r");
            self.menu(now + Duration::from_millis(1500));
        } else if self.records.is_multiple_of(8) {
            self.say(now, 1, "*");
        }
    }
}

impl Endpoint for Stranger {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes.iter().filter(|byte| **byte != 0x11) {
            self.key(now, byte);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if let Some(period) = self.row_every
            && self.state == State::Menu
            && self.next_row <= now
        {
            self.next_row = now + period;
            self.say(now, 0, "  25.125; 101.500;Disabled;OpenCct ;  -3.250\n\r");
        }
    }

    fn poll_transmit(&mut self) -> Option<axcon::endpoint::Transmit> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let said = self.says.iter().map(|(at, _)| *at).min();
        let row = self.row_every.filter(|_| self.state == State::Menu).map(|_| self.next_row);
        [said, row].into_iter().flatten().min()
    }
}

impl HandMade for Stranger {
    fn says(&mut self) -> &mut VecDeque<(Instant, Vec<u8>)> {
        &mut self.says
    }
}

fn visit() -> Visit<Stranger> {
    Visit::to(Stranger::new())
}

fn load(bench: &mut Visit<Stranger>, password: &str) -> LoadReport {
    let mut order = order(small_image("AXTC4CO", "1.2.0"));
    order.password = Some(Secret::new(password.as_bytes().to_vec()));
    order.allowed = vec![DefectId::Downgrade]; // It runs V2.10.7.
    match bench.ask(Command::Load(Box::new(order))) {
        Outcome::Loaded(report) => *report,
        other => panic!("{other:?}"),
    }
}

fn record(bench: &Visit<Stranger>) -> String {
    bench.session.record().entries().map(|entry| String::from_utf8_lossy(&entry.bytes).into_owned()).collect()
}

#[test]
fn a_stranger_is_identified_by_what_it_says_wherever_it_says_it() {
    let mut bench = visit();
    assert_eq!(bench.ask(Command::Identify), Outcome::Identified);
    let facts = bench.session.facts();
    assert_eq!(facts.state, UnitState::Application);
    assert_eq!(facts.product.as_ref().map(|known| known.value.as_str()), Some("AXTC4CO"));
    assert_eq!(facts.version.as_ref().map(|known| known.value), Some(Version::new(2, 10, 7)), "and not the hardware's");
    assert_eq!(facts.node_id.as_ref().map(|known| known.value), Some(127));
    assert_eq!(facts.can_kbps.as_ref().map(|known| known.value), Some(125));
    assert_eq!(facts.nmt_state.as_ref().map(|known| known.value.as_str()), Some("pre-operational"));
}

#[test]
fn a_strangers_prompts_are_answered_by_what_they_offer() {
    let mut bench = visit();
    bench.ask(Command::Identify);
    bench.wire.clear();
    let outcome = bench.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(250) });
    assert_eq!(outcome, Outcome::StreamRuns { was_on: false }, "{}", bench.wire.escape_ascii());
    assert_eq!(bench.wire, b"t1\r250\r", "the key it offers for field values, and Enter when it wants one");
}

#[test]
fn a_stranger_with_another_loader_is_uploaded_to() {
    let mut bench = visit();
    let report = load(&mut bench, "Geheim-1");
    assert_eq!((report.verdict, report.unit), (Verdict::Done, UnitNow::Application), "{report:?}");
    assert_eq!(report.version_before, Some(Version::new(2, 10, 7)));
    assert_eq!(bench.unit.strays, 0, "no record for the menu");
    // It echoed the password.
    assert!(!record(&bench).contains("Geheim"), "{}", record(&bench));
}

#[test]
fn a_stranger_that_runs_something_else_afterwards_is_not_called_done() {
    let mut bench = visit();
    bench.unit.next = "1.1.9";
    let report = load(&mut bench, "Geheim-1");
    assert_eq!((report.verdict, report.unit), (Verdict::WrongApplication, UnitNow::Application), "{report:?}");
    assert_eq!(report.version_after, Some(Version::new(1, 1, 9)));
}

#[test]
fn a_strangers_error_stops_the_upload_and_its_denial_is_understood() {
    let mut bench = visit();
    let report = load(&mut bench, "geheim-1");
    assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Application), "{report:?}");
    bench.unit.fails_at = Some(40);
    let report = load(&mut bench, "Geheim-1");
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert!((40..=42).contains(&report.records), "{}", report.records);
    let report = load(&mut bench, "Geheim-1");
    assert_eq!(report.verdict, Verdict::Done, "from where it was left: {report:?}");
}
