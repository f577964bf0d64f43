//! `axcon emulate`: units on pseudo-terminals, until somebody ends it.
//!
//! `orders` reads what standard input says to them, `hosting` carries it out.

mod hosting;
mod orders;

use std::path::PathBuf;

use super::error::{CliError, Kind};
use super::output::Output;
use super::{Global, names, numbers};
use crate::device::{LoaderKind, Product};
use crate::host::unit::LineRate;

/// Arguments of `axcon emulate`.
///
/// While it runs, standard input takes verbs, one a line: `set 1 temperature 250`, `open 3`, `power off`, `read 6100:1`,
/// `quit`, and what `help` lists; with several units, a number first says which one (`2 power off`), or `all`; else it is
/// the first. The end of standard input ends nothing; an interrupt is the normal end.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What to emulate, e.g. axtc4co; several give several units.
    #[arg(value_name = "PRODUCT", required = true, num_args = 1..=MOST_UNITS, value_parser = names::product)]
    products: Vec<&'static Product>,
    /// Make PATH a link to the unit's serial port; further units get PATH-2, PATH-3 and so on.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Keep flash and parameters in DIR across runs; further units get DIR-2, DIR-3 and so on.
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// Whether bytes take their time on the line; a client at another rate than 115200 then gets garbage. While they take
    /// none, only axcon can load: for other clients an XOFF comes too late.
    #[arg(long, value_name = "on|off", value_enum, default_value_t = LineRateName::On, hide_possible_values = true)]
    line_rate: LineRateName,
    /// Play FILE: what happens to the inputs, the wires and the supply, and when (docs/emulator.md).
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Word everything that the manuals leave open in another way for each SEED; further units get the next seeds.
    #[arg(long, value_name = "SEED", allow_negative_numbers = true, value_parser = numbers::within::<u64>(1..=u64::MAX))]
    dialect: Option<u64>,
    /// Which bootloader is in the unit, if not the product's own: g1, g2, g3, or g3-1.3, which hangs on odd data.
    #[arg(long, value_name = "PROFILE", value_parser = names::loader)]
    loader: Option<LoaderKind>,
    /// Let something go wrong: bytes lost, an XON that never comes, a reset or a power cut in the middle of a file, flash
    /// that fails, a slow adapter, a pulled cable. Several are possible; a number before SPEC says which unit it is for,
    /// else it is for all. docs/emulator.md describes them, and so does `help faults` on standard input.
    #[arg(long = "fault", value_name = "SPEC", action = clap::ArgAction::Append)]
    faults: Vec<String>,
    /// So many units of each product. Linux gives a user 128 inotify instances, of which each unit takes one.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = numbers::within::<u16>(1..=MOST_UNITS as u64))]
    count: u16,
    /// Decides everything that chance decides in a unit.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = numbers::within::<u64>(0..=u64::MAX))]
    seed: u64,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum LineRateName {
    On,
    Off,
}

impl LineRateName {
    fn line_rate(self) -> LineRate {
        match self {
            LineRateName::On => LineRate::Real,
            LineRateName::Off => LineRate::Off,
        }
    }
}

/// Units of one run: each has a pseudo-terminal and a thread.
const MOST_UNITS: usize = 256;

pub use hosting::run;
