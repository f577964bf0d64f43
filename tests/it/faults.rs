//! What is ordered to go wrong goes wrong: each fault against a loader or the whole console, in virtual time, with the
//! same words as on the command line.

use axcon::device::LoaderKind;
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::fault::Fault;
use axcon::emulator::scenario::{Stage, Verb};
use axcon::emulator::{Running, Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::image::CheckedImage;
use axcon::session::{Command, Event, LoadReport, Outcome, Session, UnitNow, Verdict};
use axcon::time::{Duration, Instant, character_time};

use crate::support::bench::{BAUD, axtc4co, flash_with, order, small_image};
use crate::support::flash::assert_holds;

const XOFF: u8 = 0x13;
const XON: u8 = 0x11;

/// A console and a unit with faults on one cable.
struct Faulty {
    now: Instant,
    session: Session,
    stage: Plugged<Stage>,
    /// What the console has heard, with its moments.
    heard: Vec<(Instant, u8)>,
}

impl Faulty {
    fn new(loader: LoaderKind, seed: u64, faults: &[&str]) -> Self {
        let product = axtc4co();
        let flash = flash_with(&small_image("AXTC4CO", "1.1.0"));
        let setup = Setup { product, loader, seed, dialect: 0, flash, parameters: Vec::new() };
        let faults: Vec<Fault> = faults.iter().map(|spec| Fault::read(spec, product).expect(spec)).collect();
        let mut stage = Stage::bare(Unit::new(setup)).with_faults(seed, &faults);
        stage.power_on(Instant::ZERO);
        let stage = Plugged::new(stage, Line::new(character_time(BAUD), Duration::ZERO));
        Faulty { now: Instant::ZERO, session: Session::new(BAUD), stage, heard: Vec::new() }
    }

    /// A unit that has run for a moment.
    fn running(loader: LoaderKind, faults: &[&str]) -> Self {
        let mut bench = Faulty::new(loader, 1, faults);
        bench.run_for(Duration::from_secs(4));
        bench
    }

    fn unit(&self) -> &Unit {
        self.stage.unit().unit()
    }

    fn tell(&mut self, verb: &str) -> Option<String> {
        let verb = Verb::read(verb, axtc4co()).expect(verb);
        let now = self.now;
        self.stage.unit_mut().perform(now, &verb).expect("done")
    }

    fn run_for(&mut self, span: Duration) -> Option<Outcome> {
        let end = self.now + span;
        loop {
            if let Some(outcome) = self.drain() {
                return Some(outcome);
            }
            let due = [self.session.poll_timeout(), self.stage.poll_timeout()];
            let next = due.into_iter().flatten().min().unwrap_or(Instant::NEVER).max(self.now);
            if next > end {
                self.now = end;
                return None;
            }
            self.now = next;
            let (session, heard) = (&mut self.session, &mut self.heard);
            self.stage.advance(next, |at, bytes| {
                heard.extend(bytes.iter().map(|&byte| (at, byte)));
                session.handle_bytes(next, bytes);
            });
            self.session.handle_timeout(next);
        }
    }

    fn drain(&mut self) -> Option<Outcome> {
        while let Some(transmit) = self.session.poll_transmit() {
            self.stage.send(self.now, &transmit.bytes);
        }
        let events = std::iter::from_fn(|| self.session.poll_event());
        let mut ended = events.filter_map(|event| match event {
            Event::Finished(outcome) => Some(outcome),
            _ => None,
        });
        ended.next()
    }

    fn load(&mut self, image: &CheckedImage) -> LoadReport {
        let mut order = order(image.clone());
        order.product = Some("AXTC4CO".into());
        self.session.command(self.now, Command::Load(Box::new(order))).expect("taken");
        match self.run_for(Duration::from_secs(200)) {
            Some(Outcome::Loaded(report)) => *report,
            other => panic!("{other:?}; heard {:?}", self.text()),
        }
    }

    /// The faults end, and the next upload has to succeed.
    fn saved(&mut self, image: &CheckedImage) {
        self.tell("heal");
        self.tell("power on");
        self.run_for(Duration::from_secs(3));
        let report = self.load(image);
        assert_eq!(report.verdict, Verdict::Done, "{report:?}");
        assert_holds(self.unit(), image, "the upload that saves the unit");
    }

    fn text(&self) -> String {
        self.heard.iter().map(|&(_, byte)| char::from(byte)).collect()
    }
}

fn image() -> CheckedImage {
    small_image("AXTC4CO", "1.2.0")
}

#[test]
fn a_byte_of_the_file_that_is_lost_doubled_corrupted_or_unreadable_fails_the_upload_and_says_how() {
    // The 5,000th byte is a digit of the data of a record: without it the S of the next one is taken for the last
    // digit, and with one more, or another, the checksum is wrong.
    for (fault, error) in [
        ("lost to-unit at byte 5000", "error 2 ("),
        ("doubled to-unit at byte 5000", "error 4 ("),
        ("corrupted to-unit at byte 5000", "error 4 ("),
        ("unreadable to-unit at byte 5000", "error 1 ("),
    ] {
        for loader in [LoaderKind::G1, LoaderKind::G2] {
            let mut bench = Faulty::running(loader, &[fault]);
            let report = bench.load(&image());
            assert_eq!(
                (report.verdict, report.unit),
                (Verdict::Failed, UnitNow::Loader),
                "{fault} {loader:?}: {report:?}"
            );
            assert!(report.what.contains(error), "{fault} {loader:?}: {}", report.what);
            bench.saved(&image());
        }
    }
}

#[test]
fn late_bytes_and_a_slow_adapter_cost_time_and_no_record() {
    let seconds = |faults: &[&str]| {
        let mut bench = Faulty::running(LoaderKind::G2, faults);
        let report = bench.load(&image());
        assert_eq!(report.verdict, Verdict::Done, "{faults:?}: {report:?}");
        report.duration.as_secs_f64()
    };
    let undisturbed = seconds(&[]);
    // Eleven pages are crossed, and each XOFF with its XON goes there and back.
    let slow = seconds(&["latency 16"]) - undisturbed;
    assert!((0.2..0.8).contains(&slow), "{slow} s");
    // By this seed two of the characters to the unit are late, and the page of each ends later; on the way back it may
    // be any page's XON, and the banner.
    let late = seconds(&["late from-unit one in 40 by 15", "late to-unit one in 4000 by 15"]) - undisturbed;
    assert!((0.029..0.25).contains(&late), "{late} s");
}

#[test]
fn an_xoff_without_its_xon_is_given_up_in_bounded_time() {
    let mut bench = Faulty::running(LoaderKind::G1, &["no-xon at xoff 3"]);
    let report = bench.load(&image());
    assert_ne!(report.verdict, Verdict::Done, "{report:?}");
    assert!(report.duration < Duration::from_secs(20), "{report:?}");
    assert!(bench.stage.unit().holds_client(), "nobody has let it go on");
    assert_eq!(bench.unit().running(), Running::Loader);
    bench.saved(&image());
    let flow: Vec<u8> = bench.heard.iter().map(|&(_, byte)| byte).filter(|byte| [XON, XOFF].contains(byte)).collect();
    assert_eq!(flow[..6], [XOFF, XON, XOFF, XON, XOFF, XOFF], "the third is alone");
}

#[test]
fn a_reset_or_a_power_cut_at_any_record_leaves_a_unit_that_waits_and_can_be_saved() {
    let image = image();
    for record in [1, 2, 18, 100, 189] {
        for fault in ["reset at record ", "power-cut at record "] {
            let back = if fault.starts_with("power") { " for 0.3" } else { "" };
            let mut bench = Faulty::running(LoaderKind::G2, &[&format!("{fault}{record}{back}")]);
            let report = bench.load(&image);
            assert_eq!(report.verdict, Verdict::Failed, "{fault}{record}: {report:?}");
            // G2 says its prompt on the line of its dots, also after the end record.
            assert_eq!(report.unit, UnitNow::Loader, "{fault}{record}: {report:?}");
            // Nobody can know before the loader speaks again; at the next page its XON is missing.
            let sent = record..=record + 18;
            assert!(sent.contains(&(report.records as u64)), "{fault}{record}: {report:?}");
            assert_eq!(bench.unit().running(), Running::Loader);
            bench.saved(&image);
        }
    }
    let mut bench = Faulty::running(LoaderKind::G1, &["power-cut at record 40"]);
    let report = bench.load(&image);
    assert_ne!(report.verdict, Verdict::Done, "{report:?}");
    assert_eq!(bench.tell("status").as_deref(), Some("AXTC4CO has no power"), "it stays off");
    bench.saved(&image);
}

#[test]
fn flash_that_fails_is_told_by_the_loader_in_its_numbers() {
    for (loader, fault, error) in [
        (LoaderKind::G1, "flash worn-out at word 0x123", "error 6"),
        (LoaderKind::G1, "flash protected at word 0x123", "error 6"),
        (LoaderKind::G2, "flash stuck at word 0x123", "error 7"),
        (LoaderKind::G3, "flash worn-out at word 0x123", "error 0010"),
        (LoaderKind::G3, "flash protected at word 0x123", "error 0008"),
        (LoaderKind::G3, "flash stuck at word 0x123", "error 0004"),
    ] {
        let mut bench = Faulty::running(loader, &[fault]);
        let report = bench.load(&image());
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{fault} {loader:?}: {report:?}");
        assert!(report.what.contains(error), "{fault} {loader:?}: {}", report.what);
        bench.saved(&image());
    }
}

#[test]
fn a_pulled_cable_carries_nothing_until_it_is_in_again_while_the_unit_goes_on() {
    let mut bench = Faulty::running(LoaderKind::G1, &["unplug to-unit at byte 3000 for 5"]);
    let report = bench.load(&image());
    assert_ne!(report.verdict, Verdict::Done, "{report:?}");
    bench.run_for(Duration::from_secs(6));
    assert!(bench.stage.unit().is_plugged());
    bench.saved(&image());

    let mut bench = Faulty::running(LoaderKind::G1, &[]);
    bench.tell("unplug");
    assert_eq!(bench.tell("status").as_deref(), Some("AXTC4CO runs, pre-operational, its cable is out"));
    let heard = bench.heard.len();
    bench.session.command(bench.now, Command::Identify).expect("taken");
    bench.run_for(Duration::from_secs(10));
    assert_eq!(bench.heard.len(), heard);
    bench.tell("plug");
    bench.session.command(bench.now, Command::Identify).expect("taken");
    bench.run_for(Duration::from_secs(10));
    assert!(bench.heard.len() > heard + 100);
}

/// A terminal program: sends until it hears XOFF, through an adapter that has taken more by then.
fn sent_by_a_terminal(queue: &str) -> String {
    let mut bench = Faulty::running(LoaderKind::G1, &[queue]);
    bench.stage.send(bench.now, b"lAXIO-2010\r");
    bench.run_for(Duration::from_secs(1));
    bench.heard.clear();
    let records = records();
    let mut next = 0;
    while next < records.len() && bench.heard.len() < 400 {
        let ahead = (1 + bench.stage.unit().queue()).saturating_sub(bench.stage.to_unit().in_flight());
        if !bench.stage.unit().holds_client() {
            let end = (next + ahead).min(records.len());
            bench.stage.send(bench.now, &records[next..end]);
            next = end;
        }
        bench.run_for(Duration::from_micros(87));
    }
    bench.run_for(Duration::from_secs(1));
    bench.text()
}

/// A file of 3,000 words in records of 32 bytes, the last of it waiting for nobody.
fn records() -> Vec<u8> {
    let mut text = b"S0030000FC\r".to_vec();
    for block in &image().image().blocks {
        let record = axcon::image::srecord::Record {
            kind: axcon::image::srecord::Kind::Data32,
            address: block.address,
            data: &block.data,
        };
        text.extend(record.to_text());
        text.push(b'\r');
    }
    text
}

#[test]
fn a_queue_shorter_than_a_record_is_harmless_and_a_longer_one_overruns_the_loader() {
    let said = sent_by_a_terminal("queue 48");
    assert!(!said.contains("Error") && said.matches('.').count() >= 10, "{said:?}");
    let said = sent_by_a_terminal("queue 256");
    assert!(said.contains("Error # 0005") || said.contains("Error # 0001"), "{said:?}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let said = |seed: u64| {
        let faults = ["corrupted from-unit one in 50", "late from-unit one in 30", "lost to-unit one in 3000"];
        let mut bench = Faulty::new(LoaderKind::G2, seed, &faults);
        bench.run_for(Duration::from_secs(4));
        bench.load(&image());
        bench.heard
    };
    assert!(said(1) == said(1));
    assert!(said(1) != said(2));
}

#[test]
fn asking_a_disturbed_unit_often_changes_nothing() {
    let heard = |step_ms: u64| {
        let faults = ["latency 3", "late from-unit one in 20 by 7", "doubled from-unit one in 90"];
        let mut bench = Faulty::new(LoaderKind::G1, 1, &faults);
        let mut heard: Vec<u8> = Vec::new();
        for at in (0..6_000).step_by(step_ms as usize) {
            if at == 3_000 {
                bench.stage.send(Instant::from_millis(at), b"m");
            }
            bench.stage.unit_mut().handle_timeout(Instant::from_millis(at));
            bench.stage.advance(Instant::from_millis(at), |_, bytes| heard.extend_from_slice(bytes));
        }
        heard
    };
    assert!(heard(1) == heard(100));
    assert!(heard(1).len() > 500);
}
