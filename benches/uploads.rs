//! How long uploads take, in virtual time, as ratios to what they have to take: the characters on the line at 11,520 a
//! second, and the loader's own busy time.
//!
//! `cargo bench --bench uploads`

#![allow(clippy::print_stdout, missing_docs)]

use axcon::device::{ERASE_TIME, LoaderKind, PROGRAM_TIME, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::{Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::image::{CheckedImage, make};
use axcon::secret::Secret;
use axcon::session::{Command, Event, LoadOrder, LoadReport, Outcome, Session, Verdict};
use axcon::time::{Duration, Instant, character_time};

const BAUD: u32 = 115_200;

fn main() {
    println!(
        "upload time / (characters / 11,520 per s + the loader's busy time), in virtual time; and packed / not packed"
    );
    println!(
        "{:<10} {:<6} {:>8} {:>14} {:>14} {:>14}",
        "product", "loader", "latency", "own records", "packed", "packed/own"
    );
    for (product, words) in [("AXTC4CO", 0xC000), ("AXRTD8CO", 0x2_8000)] {
        let product = Product::named(product).expect("a product");
        let image = image(product, "1.2.0", words);
        for loader in LoaderKind::ALL {
            for latency in [0, 4, 16] {
                let (plain, plain_ratio) = upload(product, loader, latency, &image, false);
                let (packed, packed_ratio) = upload(product, loader, latency, &image, true);
                let share = packed.as_secs_f64() / plain.as_secs_f64();
                println!(
                    "{:<10} {:<6} {latency:>5} ms {plain_ratio:>14.3} {packed_ratio:>14.3} {share:>14.3}",
                    product.name,
                    loader.name()
                );
            }
        }
    }
}

/// The time of a transfer, from the first record to the loader's last one, and its ratio to what it has to be.
fn upload(
    product: &'static Product,
    loader: LoaderKind,
    latency_ms: u64,
    image: &CheckedImage,
    packed: bool,
) -> (Duration, f64) {
    // Erased flash: as quick as a loader can be.
    let mut flash = vec![0xFF; product.flash.program_words as usize * 2];
    for block in &self::image(product, "1.1.0", 1_000).image().blocks {
        let at = block.address as usize * 2;
        flash[at..at + block.data.len()].copy_from_slice(&block.data);
    }
    let setup = Setup { product, loader, seed: 1, dialect: 0, flash, parameters: Vec::new() };
    let order =
        LoadOrder { packed, loader: Some(loader), ..LoadOrder::new(image.clone(), Secret::new(b"AXIO-2010".to_vec())) };
    let (report, characters) = run(setup, Duration::from_millis(latency_ms), order);
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
    let line = Duration::from_secs_f64(characters as f64 / 11_520.0);
    let busy = busy_time(product, loader, image);
    // Behind the end record comes the unit's own start, which is nobody's to shorten.
    let taken = report.duration.saturating_sub(START);
    (taken, taken.as_secs_f64() / (line + busy).as_secs_f64())
}

/// From the end record until the new banner is complete and the line silent behind it.
const START: Duration = Duration::from_millis(600);

/// What the loader does while it listens to nobody.
fn busy_time(product: &Product, loader: LoaderKind, image: &CheckedImage) -> Duration {
    let words: usize = image.image().blocks.iter().map(|block| block.data.len() / 2).sum();
    match loader {
        // Each page is programmed while the line stands still, behind 0.6 ms of silence; the small program before
        // takes four of them to be erased.
        LoaderKind::G1 | LoaderKind::G2 => {
            let pages = words.div_ceil(product.flash.page_words as usize) as u32;
            PROGRAM_TIME * words as u32 + Duration::from_micros(600) * pages + ERASE_TIME * 4
        }
        // Everything is erased, in sectors of 512 words; programming goes on while characters come.
        LoaderKind::G3 => ERASE_TIME * product.flash.program_words.div_ceil(512),
    }
}

fn run(setup: Setup, latency: Duration, order: LoadOrder) -> (LoadReport, usize) {
    let mut unit = Unit::new(setup);
    unit.power_on(Instant::ZERO);
    // An adapter shows late what comes; what is sent leaves at once.
    let mut unit = Plugged::new(unit, Line::new(character_time(BAUD), Duration::ZERO));
    let mut back = Line::new(Duration::ZERO, latency);
    let mut session = Session::new(BAUD);
    let mut now = Instant::ZERO;
    let start = Instant::from_millis(6_000);
    let mut order = Some(order);
    let mut characters = 0;
    loop {
        if now >= start
            && let Some(order) = order.take()
        {
            session.command(now, Command::Load(Box::new(order))).expect("taken");
        }
        while let Some(transmit) = session.poll_transmit() {
            let is_record = transmit.bytes.starts_with(b"S");
            characters += if is_record { transmit.bytes.len() } else { 0 };
            unit.send(now, &transmit.bytes);
        }
        while let Some(event) = session.poll_event() {
            if let Event::Finished(Outcome::Loaded(report)) = event {
                return (*report, characters);
            }
        }
        let wait = order.as_ref().map(|_| start);
        let due = [session.poll_timeout(), unit.poll_timeout(), back.next_arrival(), wait];
        now = due.into_iter().flatten().min().expect("something is always due").max(now);
        unit.advance(now, |at, bytes| back.push(at, bytes));
        while let Some((at, byte)) = back.pop_arrived(now) {
            session.handle_bytes(at.max(now), &[byte]);
        }
        session.handle_timeout(now);
    }
}

fn image(product: &Product, version: &str, words: u32) -> CheckedImage {
    let target = product.target();
    let recipe = make::Recipe { target: &target, version: version.parse().expect("a version"), words, flaw: None };
    let file = make::make(&recipe).expect("an image of this size");
    let report = axcon::image::check(file.as_slice(), None, &[target], None, &[]).expect("a slice can be read");
    report.image().unwrap_or_else(|| panic!("{:?}", report.defects))
}
