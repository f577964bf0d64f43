//! `axcon diagnostics`: the unit's own pages, and the numbers on them.

use serde::Serialize;

use super::Global;
use super::error::{CliError, Kind};
use super::numbers::{self, counted};
use super::output::Output;
use super::talk::{Ended, Talk};
use crate::session::{Command, Event};
use crate::wire::{diagnostics, visible};

/// Arguments of `axcon diagnostics`.
///
/// Pages are shown as the unit prints them, one a second, until it is enough or Ctrl-C; then no more come.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// End after N pages. Exit code 130 if an interrupt comes first; without it an interrupt is the normal end.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = numbers::within::<u32>(1..=u64::from(u32::MAX)))]
    count: Option<u32>,
    /// How pages are written. JSON if --json is given: one object a page, with the numbers found on it.
    #[arg(long, value_enum)]
    format: Option<Format>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    Text,
    Json,
}

#[derive(Serialize)]
struct PageObject {
    schema: &'static str,
    time: String,
    lines: Vec<String>,
    values: Vec<ValueObject>,
}

#[derive(Serialize)]
struct ValueObject {
    label: String,
    /// `null` where the number on the page can be read in more than one way.
    value: Option<f64>,
    unit: Option<String>,
}

/// Reads pages.
///
/// # Errors
/// If no unit answers, or shows no pages.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let json = output.format(args.format, None, Format::Json, Format::Text)? == Format::Json;
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    let calendar = talk.calendar();
    let mut pages = 0u64;
    let ended = talk.run(Command::Diagnostics { pages: args.count }, |_, event| {
        let Event::Page { at, lines } = event else { return Ok(()) };
        pages += 1;
        let lines: Vec<String> = lines.iter().map(|line| visible::line(line.text.trim_end().as_bytes())).collect();
        if json {
            let values = lines.iter().flat_map(|line| diagnostics::quantities(line)).map(|quantity| ValueObject {
                label: quantity.label,
                value: quantity.value,
                unit: quantity.unit,
            });
            let time = calendar.text(*at);
            output.object(&PageObject { schema: "axcon.diagnostics/1", time, values: values.collect(), lines })
        } else {
            output.data(format!("{}\n\n", lines.join("\n")).as_bytes())
        }
    });
    match ended? {
        // Without a count, the interrupt is the way to end.
        Ended::Finished { interrupted: true, .. } => match args.count {
            None if pages > 0 => Ok(()),
            None => Err(CliError::message(Kind::Interrupted, "interrupted: no page has come")),
            Some(count) => {
                let message = format!("interrupted: {} of {count} shown", counted(pages, "page"));
                Err(CliError::message(Kind::Interrupted, message))
            }
        },
        Ended::Finished { outcome, interrupted: false } => talk.expect_done(&outcome),
        Ended::Lost { error, .. } => Err(error),
    }
}
