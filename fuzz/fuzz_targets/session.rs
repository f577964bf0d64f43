//! A session against anything: every job ends in bounded time, no more is recorded than came, the password is not, and
//! an upload is done only by a banner.
//!
//! The first byte chooses the job; what follows is what the unit says, with waits (`axcon_fuzz::pieces`).
#![no_main]

use std::sync::OnceLock;

use axcon::device::Product;
use axcon::endpoint::{Endpoint, Secrecy};
use axcon::image::{self, CheckedImage, make};
use axcon::record::Direction;
use axcon::secret::Secret;
use axcon::session::{Command, Event, LoadOrder, Outcome, Session, Verdict};
use axcon::time::{Duration, Instant};
use axcon::version::Version;
use axcon::wire::stream::Source;
use axcon_fuzz::{parameter, pieces};
use libfuzzer_sys::fuzz_target;

const PASSWORD: &[u8] = b"AXIO-2010";
const VERSION: Version = Version::new(1, 2, 0);

fn image() -> CheckedImage {
    static IMAGE: OnceLock<CheckedImage> = OnceLock::new();
    let made = || {
        let target = Product::all()[0].target();
        let recipe = make::Recipe { target: &target, version: VERSION, words: make::FEWEST_WORDS, flaw: None };
        let file = make::make(&recipe).expect("an image");
        let report = image::check(file.as_slice(), None, &[target], None, &[]).expect("a slice");
        report.image().expect("a sound one")
    };
    IMAGE.get_or_init(made).clone()
}

fn command(job: u8) -> Command {
    match job % 8 {
        0 => Command::Identify,
        1 => Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(100) },
        2 => Command::StreamOff,
        3 => Command::RestoreDefaults,
        4 => Command::ReadDictionary,
        5 => Command::Diagnostics { pages: Some(2) },
        packed => {
            let mut order = LoadOrder::new(image(), Secret::new(PASSWORD.to_vec()));
            order.packed = packed == 7;
            Command::Load(Box::new(order))
        }
    }
}

fn count(bytes: &[u8]) -> usize {
    bytes.windows(PASSWORD.len()).filter(|window| *window == PASSWORD).count()
}

struct Console {
    session: Session,
    now: Instant,
    ended: bool,
    /// The entry of the record from which on the password may not be there.
    sent_at: Option<u64>,
}

impl Console {
    fn drain(&mut self) {
        while let Some(transmit) = self.session.poll_transmit() {
            if transmit.secrecy == Secrecy::Secret {
                self.sent_at.get_or_insert(self.session.record().entry_count());
            }
        }
        while let Some(event) = self.session.poll_event() {
            let Event::Finished(outcome) = event else { continue };
            self.ended = true;
            if let Outcome::Loaded(report) = outcome
                && report.verdict == Verdict::Done
            {
                assert_eq!(report.version_after, Some(VERSION), "{report:?}");
                assert_eq!(report.records, report.records_total, "{report:?}");
            }
        }
    }

    fn step(&mut self, due: Instant) {
        self.now = due.max(self.now);
        self.session.handle_timeout(self.now);
        self.drain();
    }
}

fuzz_target!(|input: &[u8]| {
    let Some((job, answers)) = parameter(input) else { return };
    let mut console =
        Console { session: Session::new(115_200), now: Instant::from_millis(1), ended: false, sent_at: None };
    console.session.command(console.now, command(job)).expect("the first job is taken");
    console.drain();
    let answers = pieces(answers);
    for (time, bytes) in &answers {
        let then = console.now + *time;
        while let Some(due) = console.session.poll_timeout().filter(|due| *due <= then) {
            console.step(due);
        }
        console.now = then;
        console.session.handle_bytes(console.now, bytes);
        console.drain();
    }
    // Silence from here on: whatever is under way ends.
    let limit = console.now + Duration::from_secs(120);
    while let Some(due) = console.session.poll_timeout().filter(|_| !console.ended) {
        assert!(due <= limit, "no end");
        console.step(due);
    }
    assert!(console.ended, "the job has ended");
    // What waits to be recorded does not wait for long.
    while let Some(due) = console.session.poll_timeout().filter(|due| *due <= console.now + Duration::from_secs(1)) {
        console.step(due);
    }
    let received: Vec<u8> = answers.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
    let record = console.session.record();
    let from_unit = |from| record.entries_from(from).filter(|entry| entry.direction == Direction::FromUnit);
    let kept: usize = from_unit(0).map(|entry| entry.bytes.len()).sum();
    assert!(kept <= received.len());
    // A password with a pause in it is not an echo of ours.
    let in_one_piece = answers.iter().map(|(_, bytes)| count(bytes)).sum::<usize>() == count(&received);
    if let Some(sent_at) = console.sent_at.filter(|_| in_one_piece) {
        let later: Vec<u8> = from_unit(sent_at).flat_map(|entry| entry.bytes.clone()).collect();
        assert_eq!(count(&later), 0, "the password is in the record");
    }
});
