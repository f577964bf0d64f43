//! The emulated unit alone, driven in virtual time over a line at 115200 baud.

mod console;
mod dictionary;
mod loader;
mod loader_g2;
mod loader_g3;
mod rtd;
mod sender;

use axcon::canopen::{ObjectAddress, Value};
use axcon::device::{LoaderKind, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::knob::Knob;
use axcon::emulator::{Area, NmtCommand, Refusal, Setup, Unit};
use axcon::image::Identity;
use axcon::time::{Duration, Instant, character_time};
use axcon::version::Version;

const BAUD: u32 = 115_200;
const XON: u8 = 0x11;
const XOFF: u8 = 0x13;

fn product() -> &'static Product {
    Product::named("AXTC4CO").expect("built in")
}

/// A program of this many words for a product, bytes in S-record order. Its content depends on the version.
fn program(name: &str, version: Version, words: usize) -> Vec<u8> {
    let mut bytes: Vec<u8> = (0..words * 2)
        .map(|at| (at as u8).wrapping_mul(31).wrapping_add((at >> 8) as u8 ^ version.minor as u8))
        .collect();
    let mut identity = Identity {
        product: name.into(),
        version,
        build_date: "2026-01-31".into(),
        build_time: "12:34:56".into(),
        program_words: 0,
        crc: 0,
    };
    identity.stamp(&mut bytes);
    bytes
}

/// A program as the flash that holds it, erased after it.
fn flash_with(program: &[u8]) -> Vec<u8> {
    let mut flash = program.to_vec();
    flash.resize(product().flash.program_words as usize * 2, 0xFF);
    flash
}

fn setup(flash: Vec<u8>) -> Setup {
    Setup { product: product(), loader: LoaderKind::G1, seed: 1, dialect: 0, flash, parameters: Vec::new() }
}

/// What a unit of a test runs before anything is loaded.
fn old_program() -> Vec<u8> {
    program("AXTC4CO", Version::new(1, 2, 3), 1024)
}

/// A unit on a line, and everything it has said.
struct Bench {
    plugged: Plugged<Unit>,
    now: Instant,
    /// Each character with the moment of the release it came with.
    heard: Vec<(Instant, u8)>,
    taken: usize,
}

impl Bench {
    /// A unit that gets its power at time zero.
    fn new(setup: Setup) -> Self {
        let unit = Unit::new(setup);
        let plugged = Plugged::new(unit, Line::new(character_time(BAUD), Duration::ZERO));
        let mut bench = Bench { plugged, now: Instant::ZERO, heard: Vec::new(), taken: 0 };
        bench.power_on();
        bench
    }

    /// A unit with the old program in it, its menu printed.
    fn at_menu() -> Self {
        let mut bench = Bench::new(setup(flash_with(&old_program())));
        bench.run_ms(500);
        bench.take();
        bench
    }

    /// A unit of a product, with a program of V1.2.3 in it and a dialect, its menu printed.
    fn of(name: &str, dialect: u64) -> Self {
        let product = Product::named(name).expect("built in");
        let mut flash = program(name, Version::new(1, 2, 3), 1024);
        flash.resize(product.flash.program_words as usize * 2, 0xFF);
        let setup = Setup { product, loader: product.loader.kind, seed: 1, dialect, flash, parameters: Vec::new() };
        let mut bench = Bench::new(setup);
        bench.run_ms(500);
        bench.take();
        bench
    }

    /// Turns a knob.
    fn turn(&mut self, knob: Knob) {
        let now = self.now;
        self.unit().turn(now, knob).expect("a knob of this unit");
    }

    /// The network writes an entry, as `6112:1` names it.
    fn write(&mut self, entry: &str, number: f64) -> Result<(), Refusal> {
        let at: ObjectAddress = entry.parse().expect("an entry");
        let data_type = self.unit().product().dictionary.entry(at).expect("an entry").data_type;
        let value = match data_type.range() {
            None => Value::Real32(number as f32),
            Some(_) => data_type.integer(number as i64).expect("a value of the type"),
        };
        let now = self.now;
        self.unit().write_object(now, at, &value.encode())
    }

    /// The network writes "save" to 1010h sub-index 1.
    fn save(&mut self) {
        assert_eq!(self.write("1010:1", f64::from(0x6576_6173)), Ok(()));
    }

    /// The network reads an entry.
    fn read(&mut self, entry: &str) -> Result<f64, Refusal> {
        let now = self.now;
        self.unit().read_object(now, entry.parse().expect("an entry")).map(Value::as_f64)
    }

    /// The network master orders something.
    fn nmt(&mut self, command: NmtCommand) {
        let now = self.now;
        self.unit().nmt(now, command);
    }

    fn unit(&mut self) -> &mut Unit {
        self.plugged.unit_mut()
    }

    fn power_on(&mut self) {
        let now = self.now;
        self.unit().power_on(now);
    }

    fn power_off(&mut self) {
        let now = self.now;
        self.unit().power_off(now);
        self.plugged.to_unit_mut().clear();
    }

    /// Flash and parameters of a unit that has lost its power; its flash was like this when it got it. A host that died
    /// with the power has the same memories in its files.
    fn memories_without_power(&mut self, began_with: Vec<u8>) -> (Vec<u8>, Vec<u8>) {
        let memories = (self.unit().flash().to_vec(), self.unit().parameters().to_vec());
        let mut files = (began_with, vec![0xFF; memories.1.len()]);
        while let Some(store) = self.unit().poll_store() {
            let file = match store.area {
                Area::Flash => &mut files.0,
                Area::Parameters => &mut files.1,
            };
            file[store.offset..store.offset + store.bytes.len()].copy_from_slice(&store.bytes);
        }
        assert!(files == memories, "a write is missing from the files, or was never made");
        memories
    }

    fn run(&mut self, time: Duration) {
        self.now += time;
        let heard = &mut self.heard;
        self.plugged.advance(self.now, |at, bytes| heard.extend(bytes.iter().map(|&byte| (at, byte))));
    }

    fn run_ms(&mut self, millis: u64) {
        self.run(Duration::from_millis(millis));
    }

    fn send(&mut self, bytes: &[u8]) {
        self.plugged.send(self.now, bytes);
    }

    /// Presses keys and gives what the unit says within the next 300 ms.
    fn keys(&mut self, keys: &[u8]) -> String {
        self.send(keys);
        self.run_ms(300);
        self.take()
    }

    /// What has been heard since the last time.
    fn take(&mut self) -> String {
        let new = self.heard[self.taken..].iter().map(|&(_, byte)| byte).collect();
        self.taken = self.heard.len();
        String::from_utf8(new).expect("the port speaks ASCII")
    }

    /// Whether the unit's last word on it was XOFF.
    fn is_stopped(&self) -> bool {
        self.heard.iter().rev().find(|(_, byte)| [XON, XOFF].contains(byte)).is_some_and(|&(_, byte)| byte == XOFF)
    }
}
