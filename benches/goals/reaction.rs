//! How many records still leave when something has happened: counted from the moment at which the last character of the
//! text has arrived at the console, in virtual time.

use axcon::device::{LoaderKind, Product};
use axcon::session::Verdict;
use axcon::time::Duration;

use crate::simulation::{self, Trouble, Upload};
use crate::table::{Goal, Row, Table};

/// Words of the image: many records behind the one at which it happens, packed or not.
const WORDS: u32 = 16_000;

pub fn run(table: &mut Table) {
    println!("records that leave behind the text, own / packed");
    println!("{:<14} {:<6} {:>9} {:>9} {:>9}", "what comes", "loader", "0 ms", "4 ms", "16 ms");
    let product = Product::named("AXTC4CO").expect("a product");
    let image = simulation::image(product, "1.2.0", WORDS);
    for (name, trouble) in [("error text", Trouble::Error), ("second banner", Trouble::Banner), ("hold", Trouble::Hold)]
    {
        let mut most = 0;
        for loader in LoaderKind::ALL {
            print!("{name:<14} {:<6}", loader.name());
            for latency in [0, 4, 16] {
                let behind = [false, true].map(|packed| {
                    let latency = Duration::from_millis(latency);
                    let upload = Upload { product, loader, latency, image: &image, packed, trouble: Some(trouble) };
                    let seen = simulation::run(&upload);
                    assert_eq!(seen.report.verdict, Verdict::Failed, "{:?}", seen.report);
                    seen.behind
                });
                print!(" {:>9}", format!("{} / {}", behind[0], behind[1]));
                most = behind.into_iter().fold(most, usize::max);
            }
            println!();
        }
        table.push(Row::new(format!("records behind: {name}"), Goal::at_most(1.0), most as f64, ""));
    }
}
