//! How long uploads take, as ratios to what they have to take: the characters on the line at 11,520 a second, and the
//! loader's own busy time.

use axcon::device::{ERASE_TIME, LoaderKind, PROGRAM_TIME, Pacing, Product};
use axcon::image::CheckedImage;
use axcon::session::Verdict;
use axcon::time::Duration;

use crate::simulation::{self, Upload};
use crate::table::{Goal, Row, Table};

/// Characters a second on the service port.
const LINE: f64 = 11_520.0;
/// From the end record until the new banner is complete and the line silent behind it: nobody's to shorten.
const START: Duration = Duration::from_millis(600);

const LATE_XON: &str = "a loader that writes page by page is deaf until its XON has come: a late adapter costs its latency once a \
                        page, packed or not";
const RING: &str = "two records have to fit what may be on its way to a ring, so they are no longer (of the characters alone: \
                    above); and all of the flash is erased first, which takes as long for either";

/// An upload's time and what it sent.
struct Taken {
    seconds: f64,
    characters: usize,
    /// To what it had to take.
    ratio: f64,
}

pub fn run(table: &mut Table) {
    println!("time of an upload / (characters / 11,520 per s + the loader's busy time), in virtual time");
    println!(
        "{:<9} {:<6} {:>8} {:>12} {:>9} {:>11} {:>21}",
        "product", "loader", "latency", "own records", "packed", "packed/own", "of the characters"
    );
    let products = [("AXTC4CO", 0xC000), ("AXRTD8CO", 0x2_8000)].map(|(name, words)| {
        let product = Product::named(name).expect("a product");
        (product, simulation::image(product, "1.2.0", words))
    });
    for loader in LoaderKind::ALL {
        let mut shares = Vec::new();
        for (latency, goal) in [(0, 1.02), (4, 1.10), (16, 1.10)] {
            let mut worst = 0.0f64;
            for (product, image) in &products {
                let [own, packed] = [false, true].map(|packed| upload(product, loader, latency, image, packed));
                let share = packed.seconds / own.seconds;
                println!(
                    "{:<9} {:<6} {latency:>5} ms {:>12.3} {:>9.3} {share:>11.3} {:>21.3}",
                    product.name,
                    loader.name(),
                    own.ratio,
                    packed.ratio,
                    packed.characters as f64 / own.characters as f64
                );
                shares.push(share);
                // Behind a late adapter packed records count.
                worst = worst.max(packed.ratio).max(if latency == 0 { own.ratio } else { 0.0 });
            }
            let how = if latency == 0 { "" } else { ", packed" };
            let name = format!("upload to {}, {latency} ms{how}", loader.name());
            table.push(Row::new(name, Goal::at_most(goal), worst, "").because(LATE_XON));
        }
        let worst = shares.into_iter().fold(0.0, f64::max);
        let name = format!("upload to {}: packed / own, at worst", loader.name());
        let reason = match loader.pacing() {
            Pacing::Pages => LATE_XON,
            Pacing::Records => RING,
        };
        table.push(Row::new(name, Goal::at_most(0.85), worst, "").because(reason));
    }
}

fn upload(product: &'static Product, loader: LoaderKind, latency_ms: u64, image: &CheckedImage, packed: bool) -> Taken {
    let latency = Duration::from_millis(latency_ms);
    let seen = simulation::run(&Upload { product, loader, latency, image, packed, trouble: None });
    assert_eq!(seen.report.verdict, Verdict::Done, "{:?}", seen.report);
    let seconds = seen.report.duration.saturating_sub(START).as_secs_f64();
    let has_to = seen.characters as f64 / LINE + busy_time(product, loader, image).as_secs_f64();
    Taken { seconds, characters: seen.characters, ratio: seconds / has_to }
}

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
        LoaderKind::G3 | LoaderKind::G3Early => ERASE_TIME * product.flash.program_words.div_ceil(512),
    }
}
