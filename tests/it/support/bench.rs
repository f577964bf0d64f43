//! Two ends, one cable, virtual time: a console session and an emulated unit without threads, clocks or ports.
//!
//! Every byte travels at the moment it would travel on a real line at 115,200 baud, plus the latency of an adapter.
//! A middleman sits on the way to the unit and may change, lose or double a byte.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Mutex;

use axcon::device::{LoaderKind, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::{Running, Setup, Unit};
use axcon::endpoint::{Arrived, Endpoint};
use axcon::image::{CheckedImage, DefectId, make};
use axcon::secret::Secret;
use axcon::session::{Command, Event, LoadOrder, LoadReport, Outcome, Session};
use axcon::time::{Duration, Instant, character_time};
use axcon::version::Version;

use super::flash;

/// The rate of the units (AXTC4CO manual, appendix A).
pub const BAUD: u32 = 115_200;

/// What may happen to a byte on its way to the unit, given its number since the cable was plugged in.
pub type Middleman = Box<dyn FnMut(u64, u8) -> Vec<u8>>;

/// The two ends.
pub struct Bench {
    pub now: Instant,
    pub session: Session,
    pub unit: Plugged<Unit>,
    to_session: Line,
    middleman: Option<Middleman>,
    middleman_back: Option<Middleman>,
    sent: u64,
    received: u64,
    /// Everything that has left for the unit, in order.
    pub wire: Vec<u8>,
    pub events: VecDeque<Event>,
    /// How the job ended that ended while time was let pass.
    ended: Option<Outcome>,
    strays: u64,
    /// The last two characters let go.
    tail: [u8; 2],
}

impl Bench {
    /// A unit with V1.1.0 in flash, just powered on, and a console on a cable without latency.
    pub fn new() -> Self {
        Bench::with(factory_flash("1.1.0"), Duration::ZERO)
    }

    /// A unit with this flash, just powered on, behind an adapter of this latency.
    pub fn with(flash: Vec<u8>, latency: Duration) -> Self {
        Bench::of(axtc4co(), LoaderKind::G1, flash, latency)
    }

    /// A unit of a product with this loader and this flash, just powered on, behind an adapter of this latency.
    pub fn of(product: &'static Product, loader: LoaderKind, flash: Vec<u8>, latency: Duration) -> Self {
        Bench::made_of(Setup { product, loader, seed: 1, dialect: 0, flash, parameters: Vec::new() }, latency)
    }

    /// A unit that words its prose in a dialect of its own, with a small V1.1.0 in flash, just powered on.
    pub fn in_dialect(product: &'static Product, dialect: u64) -> Self {
        let (loader, flash) = (product.loader.kind, flash_with(&small_image(&product.name, "1.1.0")));
        Bench::made_of(Setup { product, loader, seed: 1, dialect, flash, parameters: Vec::new() }, Duration::ZERO)
    }

    /// A unit of which everything is drawn.
    pub fn story(
        product: &'static Product,
        loader: LoaderKind,
        dialect: u64,
        flash: Vec<u8>,
        latency: Duration,
    ) -> Self {
        Bench::made_of(Setup { product, loader, seed: 1, dialect, flash, parameters: Vec::new() }, latency)
    }

    fn made_of(setup: Setup, latency: Duration) -> Self {
        let mut unit = Unit::new(setup);
        unit.power_on(Instant::ZERO);
        Bench {
            now: Instant::ZERO,
            session: Session::new(BAUD),
            unit: Plugged::new(unit, Line::new(character_time(BAUD), latency)),
            to_session: Line::new(Duration::ZERO, latency),
            middleman: None,
            middleman_back: None,
            sent: 0,
            received: 0,
            wire: Vec::new(),
            events: VecDeque::new(),
            ended: None,
            strays: 0,
            tail: [0; 2],
        }
    }

    /// Characters sent to the unit so far, as a middleman counts them.
    pub fn sent_so_far(&self) -> u64 {
        self.sent
    }

    /// Characters received from it.
    pub fn received_so_far(&self) -> u64 {
        self.received
    }

    /// Data records that were let go while the unit's application ran.
    pub fn strays(&self) -> u64 {
        self.strays
    }

    /// Gives the session a command while a job runs.
    pub fn command_again(&mut self, command: Command) {
        self.session.command(self.now, command).expect("the session takes the command");
        self.drain();
    }

    /// The cable is pulled out.
    pub fn lose_link(&mut self) {
        self.session.link_lost(self.now);
        self.drain();
    }

    /// Puts somebody on the way to the unit.
    pub fn disturb(&mut self, middleman: impl FnMut(u64, u8) -> Vec<u8> + 'static) {
        self.middleman = Some(Box::new(middleman));
    }

    /// Puts somebody on the way back.
    pub fn disturb_answers(&mut self, middleman: impl FnMut(u64, u8) -> Vec<u8> + 'static) {
        self.middleman_back = Some(Box::new(middleman));
    }

    /// Takes them away.
    pub fn leave_in_peace(&mut self) {
        self.middleman = None;
        self.middleman_back = None;
    }

    /// Gives the session a command.
    pub fn command(&mut self, command: Command) {
        self.ended = None;
        self.session.command(self.now, command).expect("the session takes the command");
        self.drain();
    }

    /// Lets time pass.
    pub fn run_for(&mut self, span: Duration) {
        let end = self.now + span;
        let mut ended = None;
        self.run_until(end, |event| {
            if let Event::Finished(outcome) = event {
                ended = Some(outcome.clone());
            }
            false
        });
        self.ended = ended.or(self.ended.take());
    }

    /// Lets time pass until a job has ended.
    pub fn outcome(&mut self) -> Outcome {
        if let Some(outcome) = self.ended.take() {
            return outcome;
        }
        let limit = self.now + Duration::from_secs(300);
        match self.run_until(limit, |event| matches!(event, Event::Finished(_))) {
            Some(Event::Finished(outcome)) => outcome,
            _ => panic!("no outcome within {limit:?}; heard:\n{}", self.transcript()),
        }
    }

    /// Gives a command and lets time pass until its job has ended.
    pub fn ask(&mut self, command: Command) -> Outcome {
        self.command(command);
        self.outcome()
    }

    /// Uploads and gives the report.
    pub fn load(&mut self, order: LoadOrder) -> LoadReport {
        match self.ask(Command::Load(Box::new(order))) {
            Outcome::Loaded(report) => *report,
            other => panic!("an upload ended as {other:?}"),
        }
    }

    /// Lets time pass until `end`, or until an event for which `stop` says yes, and gives that event.
    pub fn run_until(&mut self, end: Instant, mut stop: impl FnMut(&Event) -> bool) -> Option<Event> {
        loop {
            while let Some(event) = self.events.pop_front() {
                if stop(&event) {
                    return Some(event);
                }
            }
            let due = [self.session.poll_timeout(), self.unit.poll_timeout(), self.to_session.next_arrival()];
            let next = due.into_iter().flatten().min().unwrap_or(Instant::NEVER).max(self.now);
            if next > end {
                self.now = end;
                return None;
            }
            self.step(next);
        }
    }

    /// The console stands still so long, as behind a terminal that was stopped; then it looks at what has come.
    pub fn stand_still(&mut self, span: Duration) {
        let end = self.now + span;
        let mut backlog = Vec::new();
        loop {
            let due = [self.unit.poll_timeout(), self.to_session.next_arrival()];
            let next = due.into_iter().flatten().min().unwrap_or(Instant::NEVER).max(self.now);
            if next > end {
                break;
            }
            self.now = next;
            let to_session = &mut self.to_session;
            self.unit.advance(next, |at, bytes| to_session.push(at, bytes));
            while let Some((at, byte)) = self.to_session.pop_arrived(next) {
                backlog.push(Arrived { at, bytes: vec![byte] });
            }
        }
        self.now = end;
        self.session.handle_backlog(end, &backlog);
        self.session.handle_timeout(end);
        self.drain();
    }

    /// Cuts the unit's power and gives it back.
    pub fn power_cycle(&mut self, off: Duration) {
        let now = self.now;
        self.unit.unit_mut().power_off(now);
        self.run_for(off);
        let now = self.now;
        self.unit.unit_mut().power_on(now);
    }

    /// Another console comes to the same cable.
    pub fn reconnect(&mut self) {
        self.session = Session::new(BAUD);
        self.events.clear();
    }

    /// What the unit has said, for messages of failing tests.
    pub fn transcript(&self) -> String {
        let record = self.session.record();
        record.entries().map(|entry| entry.bytes.escape_ascii().to_string()).collect::<String>().replace("\\n", "\\n\n")
    }

    fn step(&mut self, next: Instant) {
        self.now = next;
        let to_session = &mut self.to_session;
        self.unit.advance(next, |at, bytes| to_session.push(at, bytes));
        while let Some((at, byte)) = self.to_session.pop_arrived(next) {
            let through = match &mut self.middleman_back {
                Some(middleman) => middleman(self.received, byte),
                None => vec![byte],
            };
            self.received += 1;
            self.session.handle_bytes(at.max(next), &through);
            self.drain();
        }
        self.session.handle_timeout(next);
        self.drain();
    }

    fn drain(&mut self) {
        while let Some(transmit) = self.session.poll_transmit() {
            for &byte in &transmit.bytes {
                self.wire.push(byte);
                self.tail = [self.tail[1], byte];
                let is_record = self.tail == *b"S3" && self.unit.unit().running() == Running::Application;
                self.strays += u64::from(is_record);
                let through = match &mut self.middleman {
                    Some(middleman) => middleman(self.sent, byte),
                    None => vec![byte],
                };
                self.sent += 1;
                self.unit.send(self.now, &through);
            }
        }
        while let Some(event) = self.session.poll_event() {
            self.events.push_back(event);
        }
    }
}

/// The product of most tests.
pub fn axtc4co() -> &'static Product {
    named("AXTC4CO")
}

/// The product with eight channels, more flash and another loader.
pub fn axrtd8co() -> &'static Product {
    named("AXRTD8CO")
}

/// A unit of this product whose flash has pages of so many words, whatever the product's file says.
pub fn with_pages(product: &'static Product, page_words: u32) -> &'static Product {
    static MADE: Mutex<BTreeMap<(String, u32), &'static Product>> = Mutex::new(BTreeMap::new());
    if product.flash.page_words == page_words {
        return product;
    }
    let mut made = MADE.lock().expect("no panic");
    made.entry((product.name.clone(), page_words)).or_insert_with(|| {
        let mut product = product.clone();
        product.flash.page_words = page_words;
        Box::leak(Box::new(product))
    })
}

fn named(product: &str) -> &'static Product {
    Product::named(product).expect("a product of this name")
}

/// An image small enough for many runs: 3,000 words, 12 pages, the last one partly filled.
pub fn small_image(product: &str, version: &str) -> CheckedImage {
    checked(product, version, 3000)
}

/// An image of this many words.
pub fn image_of(product: &str, version: &str, words: u32) -> CheckedImage {
    checked(product, version, words)
}

/// An image of the usual size.
pub fn full_image(version: &str) -> CheckedImage {
    checked("AXTC4CO", version, 0xC000)
}

/// Program flash with a small image in it.
pub fn factory_flash(version: &str) -> Vec<u8> {
    flash_with(&small_image("AXTC4CO", version))
}

/// Erased program flash, of the image's product, with just this image in it.
pub fn flash_with(image: &CheckedImage) -> Vec<u8> {
    let product = named(&image.identity().expect("an image that says what it is").product);
    let mut flash = flash::program(image);
    flash.resize(product.flash.program_words as usize * 2, 0xFF);
    flash
}

/// An order to upload with the right password.
pub fn order(image: CheckedImage) -> LoadOrder {
    LoadOrder::new(image, Secret::new(b"AXIO-2010".to_vec()))
}

/// An image that does not say what it is, for a user who wants it all the same.
pub fn nameless_image(product: &str) -> CheckedImage {
    made(product, "1.2.0", 320, Some(DefectId::NoIdentity))
}

fn checked(product: &str, version: &str, words: u32) -> CheckedImage {
    made(product, version, words, None)
}

fn made(product: &str, version: &str, words: u32, flaw: Option<DefectId>) -> CheckedImage {
    let product = named(product);
    let version: Version = version.parse().expect("a version");
    let target = product.target();
    let recipe = make::Recipe { target: &target, version, words, flaw };
    let file = make::make(&recipe).expect("an image of this size");
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let report =
        axcon::image::check(file.as_slice(), None, &targets, None, flaw.as_slice()).expect("a slice can be read");
    report.image().unwrap_or_else(|| panic!("{:?}", report.defects))
}
