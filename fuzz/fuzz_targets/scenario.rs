//! Scenario files: any text is a scenario or gives complaints with their place; what is read can be played.
#![no_main]

use std::sync::OnceLock;

use axcon::device::Product;
use axcon::emulator::scenario::{Scenario, Stage};
use axcon::emulator::{Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::image::make;
use axcon::time::{Duration, Instant};
use axcon_fuzz::places;
use libfuzzer_sys::fuzz_target;

/// As long as a scenario is played.
const PLAYED: Duration = Duration::from_secs(3);
/// The most steps a stage takes in that time: a ramp has ten a second, a stream a thousand characters.
const MOST_STEPS: u32 = 200_000;

fn flash(product: &Product) -> Vec<u8> {
    static PROGRAMS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    let programs = PROGRAMS.get_or_init(|| {
        let program = |product: &Product| {
            let version = product.loader.factory_version;
            let recipe = make::Recipe { target: &product.target(), version, words: make::FEWEST_WORDS, flaw: None };
            let mut flash = make::program(&recipe);
            flash.resize(product.flash.program_words as usize * 2, 0xFF);
            flash
        };
        Product::all().iter().map(program).collect()
    });
    let at = Product::all().iter().position(|known| known.name == product.name);
    programs[at.expect("one of them")].clone()
}

fn play(scenario: Scenario, product: &'static Product) {
    let loader = product.loader.kind;
    let setup = Setup { product, loader, seed: 1, dialect: 0, flash: flash(product), parameters: Vec::new() };
    let mut stage = Stage::new(Unit::new(setup), scenario);
    stage.power_on(Instant::ZERO);
    let end = Instant::ZERO + PLAYED;
    let mut now = Instant::ZERO;
    for step in 0.. {
        while stage.poll_transmit().is_some() {}
        let Some(due) = stage.poll_timeout().filter(|&due| due <= end) else { break };
        assert!(step < MOST_STEPS, "no end at {due:?}");
        now = due.max(now);
        stage.handle_timeout(now);
    }
}

fuzz_target!(|text: &str| {
    for product in Product::all() {
        let read = |text: &str| Scenario::read("s.toml", text, product);
        match read(text) {
            Ok(None) => assert_eq!(read(text), Ok(None)),
            Ok(Some(scenario)) => {
                assert_eq!(read(&format!("{text}\n# a remark")).as_ref(), Ok(&Some(scenario.clone())), "{text}");
                play(scenario, product);
            }
            Err(complaints) => places(text, &complaints, |text| read(text).err().unwrap_or_default()),
        }
    }
});
