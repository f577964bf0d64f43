//! The commands as a user and a script meet them: the real program on a real port, the emulated unit in another process.

mod json_page;
mod load;
mod reading;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::flashed::assert_flash_holds;
use crate::support::json::json;
use crate::support::shell::{PATIENCE, Ran, Running, World};

/// Without a wire's pace, so that the tests wait for the unit's flash only.
const FAST: &[&str] = &["--baud", "3000000"];

/// A world with a password file, an image of a few pages, and a unit on the link `u0` with its memories in `s0`.
struct Bench {
    world: World,
    unit: Option<Running>,
}

impl Bench {
    fn new() -> Self {
        Bench::with_image("4000")
    }

    fn with_image(words: &str) -> Self {
        let world = World::new();
        fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
        let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", words, "--out", "new.S"];
        let made = world.run(&args, b"");
        assert_eq!(made.code, Some(0), "{}", made.err);
        let mut bench = Bench { world, unit: None };
        bench.power_up();
        bench
    }

    /// With a unit that ran 1.1.0 and has lost its power in the middle of an upload of `new.S`.
    fn left_in_loader() -> Self {
        let mut bench = Bench::with_image("12000");
        let mut command = vec!["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"];
        command.extend(FAST);
        let loading = bench.world.start(&command);
        loading.wait_out(r#""phase":"transfer","record":1"#);
        bench.unit = None;
        loading.wait();
        bench.power_up();
        bench
    }

    /// Starts the emulator, or starts it again.
    fn power_up(&mut self) {
        self.power_up_as("axtc4co", &["--state", "s0"]);
    }

    /// Starts another emulator in its place.
    fn power_up_as(&mut self, product: &str, more: &[&str]) {
        self.unit = None;
        let args = [&["emulate", product, "--link", "u0", "--line-rate", "off"], more].concat();
        let unit = self.world.start(&args);
        unit.wait_out("serial: ");
        self.unit = Some(unit);
    }

    fn run(&self, args: &[&str]) -> Ran {
        let mut all = args.to_vec();
        all.extend(["--port", "u0"]);
        all.extend(FAST);
        self.world.run(&all, b"")
    }

    fn load(&self, image: &str, more: &[&str]) -> Ran {
        let mut args = vec!["load", image, "--yes", "--password-file", "pw"];
        args.extend(more);
        self.run(&args)
    }

    fn version(&self) -> Value {
        let ran = self.run(&["identify", "--json"]);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        json(&ran.out)["version"].clone()
    }
}

fn objects(text: &str) -> Vec<Value> {
    text.lines().map(json).collect()
}

fn error_object(ran: &Ran) -> Value {
    json(ran.err.lines().last().unwrap_or_default())
}
