//! An upload in virtual time: console and emulated unit on one line, behind an adapter that shows late what comes.

use axcon::device::{LoaderKind, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::{Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::image::{CheckedImage, make};
use axcon::secret::Secret;
use axcon::session::{Command, Event, LoadOrder, LoadReport, Outcome, Session};
use axcon::time::{Duration, Instant, character_time};

/// Bits a second on the service port.
const BAUD: u32 = 115_200;
/// When the upload begins: the unit has started.
const BEGIN: Instant = Instant::from_millis(6_000);
/// The record at which something happens, if anything is to.
const TROUBLE_AT: usize = 30;
/// The character of that record which arrives as another one.
const DAMAGED_CHARACTER: usize = 20;

/// One upload.
#[derive(Clone, Copy)]
pub struct Upload<'a> {
    pub product: &'static Product,
    pub loader: LoaderKind,
    pub latency: Duration,
    pub image: &'a CheckedImage,
    pub packed: bool,
    pub trouble: Option<Trouble>,
}

/// What happens in the middle of an upload.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// A record is damaged, and the loader says so in its own words.
    Error,
    /// The unit starts anew, and its banner comes. It takes no more records.
    Banner,
    /// The unit stops us and never lets us go on.
    Hold,
}

/// What came of it.
pub struct Seen {
    pub report: LoadReport,
    /// Characters of all records sent.
    pub characters: usize,
    /// Records that left behind the moment at which the whole text of the trouble had arrived at the console; none if
    /// the upload had ended before.
    pub behind: usize,
}

/// An image of so many words.
pub fn image(product: &Product, version: &str, words: u32) -> CheckedImage {
    let target = product.target();
    let recipe = make::Recipe { target: &target, version: version.parse().expect("a version"), words, flaw: None };
    let file = make::make(&recipe).expect("an image of this size");
    let report = axcon::image::check(file.as_slice(), None, &[target], None, &[]).expect("a slice can be read");
    report.image().unwrap_or_else(|| panic!("{:?}", report.defects))
}

/// What goes over the line, character by character.
struct Wire {
    unit: Plugged<Unit>,
    back: Line,
    trouble: Option<Trouble>,
    /// Records begun so far, and characters of them.
    records: usize,
    characters: usize,
    /// Place in the record.
    place: usize,
    /// Nothing of the unit is heard any more.
    is_mute: bool,
    /// Characters that arrive until the text of the trouble has.
    until_text: Option<usize>,
    /// What the console has heard since a record was damaged.
    heard: Option<String>,
    /// Records begun when the text had arrived.
    arrived: Option<usize>,
}

/// Runs it.
pub fn run(upload: &Upload<'_>) -> Seen {
    let Upload { product, loader, latency, image, packed, trouble } = *upload;
    // Erased flash: as quick as a loader can be.
    let mut flash = vec![0xFF; product.flash.program_words as usize * 2];
    for block in &self::image(product, "1.1.0", 1_000).image().blocks {
        let at = block.address as usize * 2;
        flash[at..at + block.data.len()].copy_from_slice(&block.data);
    }
    let mut unit = Unit::new(Setup { product, loader, seed: 1, dialect: 0, flash, parameters: Vec::new() });
    unit.power_on(Instant::ZERO);
    let mut wire = Wire {
        // An adapter shows late what comes; what is sent leaves at once.
        unit: Plugged::new(unit, Line::new(character_time(BAUD), Duration::ZERO)),
        back: Line::new(Duration::ZERO, latency),
        trouble,
        records: 0,
        characters: 0,
        place: 0,
        is_mute: false,
        until_text: None,
        heard: None,
        arrived: None,
    };
    let password = Secret::new(b"AXIO-2010".to_vec());
    let order = LoadOrder { packed, loader: Some(loader), ..LoadOrder::new(image.clone(), password) };
    let mut order = Some(Box::new(order));
    let mut session = Session::new(BAUD);
    let mut now = Instant::ZERO;
    loop {
        if now >= BEGIN
            && let Some(order) = order.take()
        {
            session.command(now, Command::Load(order)).expect("taken");
        }
        while let Some(transmit) = session.poll_transmit() {
            wire.send(now, &transmit.bytes);
        }
        while let Some(event) = session.poll_event() {
            if let Event::Finished(Outcome::Loaded(report)) = event {
                let behind = wire.arrived.map_or(0, |arrived| wire.records - arrived);
                return Seen { report: *report, characters: wire.characters, behind };
            }
        }
        let begin = order.as_ref().map(|_| BEGIN);
        let due = [session.poll_timeout(), wire.unit.poll_timeout(), wire.back.next_arrival(), begin];
        now = due.into_iter().flatten().min().expect("something is always due").max(now);
        let (back, is_mute) = (&mut wire.back, wire.is_mute);
        wire.unit.advance(now, |at, bytes| {
            if !is_mute {
                back.push(at, bytes);
            }
        });
        while let Some((at, byte)) = wire.back.pop_arrived(now) {
            session.handle_bytes(at.max(now), &[byte]);
            wire.hears(byte);
        }
        session.handle_timeout(now);
    }
}

impl Wire {
    fn send(&mut self, now: Instant, bytes: &[u8]) {
        for &byte in bytes {
            // No digit is an S, and nothing else that is sent in an upload has one.
            if byte == b'S' {
                self.records += 1;
                self.place = 0;
                if self.records == TROUBLE_AT {
                    self.begin_trouble(now);
                }
            }
            self.place += 1;
            self.characters += usize::from(self.records > 0);
            let damaged =
                self.trouble == Some(Trouble::Error) && self.records == TROUBLE_AT && self.place == DAMAGED_CHARACTER;
            let arrives = match byte {
                b'0' if damaged => b'1',
                _ if damaged => b'0',
                _ => byte,
            };
            self.unit.send(now, &[arrives]);
        }
    }

    fn begin_trouble(&mut self, now: Instant) {
        let text: &[u8] = match self.trouble {
            None => return,
            Some(Trouble::Error) => {
                self.heard = Some(String::new());
                return;
            }
            Some(Trouble::Banner) => b"\r\nAXTC4CO - 4 Thermocouple Scanner\r\nSoftware Version V1.1.0\r\n",
            Some(Trouble::Hold) => b"\x13",
        };
        self.is_mute = true;
        for (number, byte) in (1..).zip(text) {
            self.back.push(now + character_time(BAUD) * number, &[*byte]);
        }
        self.until_text = Some(self.back.in_flight());
    }

    fn hears(&mut self, byte: u8) {
        let has_arrived = match (&mut self.until_text, &mut self.heard) {
            (Some(characters), _) => {
                *characters -= 1;
                *characters == 0
            }
            (None, Some(heard)) => {
                heard.push(char::from(byte));
                heard.contains("rror") && byte == b'\n'
            }
            (None, None) => return,
        };
        if has_arrived {
            self.arrived = Some(self.records);
            (self.until_text, self.heard) = (None, None);
        }
    }
}
