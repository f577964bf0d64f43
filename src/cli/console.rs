//! `axcon` without a command: the console on the screen.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::error::{CliError, Kind};
use super::{Global, image as image_cli, link};
use crate::host::Input;
use crate::host::clock::Clock;
use crate::host::journal::{Journal, Note};
use crate::host::link::{Connection, LinkSpec, Options};
use crate::image::{Report, Severity};
use crate::time::Instant;
use crate::tui::run::{End, World};
use crate::tui::{self, Failure, ImageFacts};

/// Runs the console until the user leaves it.
///
/// # Errors
/// If there is no terminal to draw on, or a signal ends it.
pub fn run(global: &Global) -> Result<(), CliError> {
    // A name that makes no sense is said before the screen is taken.
    let link = global.port.as_ref().map(|_| link::spec(global)).transpose()?;
    let world = World {
        link: link.map(|link| link.to_string()),
        baud: global.baud,
        recording: link::recording(global),
        colour: std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
        open,
        explain: |error| failure(&link::link_error(error)),
        check,
        note,
    };
    match tui::run::run(world) {
        Ok(End::Quit) => Ok(()),
        Ok(End::Signal) => Err(CliError::reported(Kind::Interrupted)),
        Err(error) => {
            Err(CliError::new(Kind::Failed, anyhow::Error::new(error).context("the console needs a terminal"))
                .hint("'axcon --help' lists the commands that do without one"))
        }
    }
}

fn open(name: &str, baud: u32, clock: Clock, inputs: SyncSender<Input>) -> Result<Connection, Failure> {
    let spec: LinkSpec = name.parse().map_err(|error| failure(&link::spec_error(error)))?;
    Connection::open(&spec, Options { baud }, clock, inputs).map_err(|error| failure(&link::link_error(error)))
}

fn failure(error: &CliError) -> Failure {
    Failure { text: error.to_string(), hints: error.hints.clone() }
}

fn check(path: PathBuf) -> ImageFacts {
    match image_cli::read(&path, None, &[]) {
        Ok(report) => facts(path, &report),
        Err(error) => ImageFacts {
            path,
            ok: false,
            product: None,
            version: None,
            records: 0,
            characters: 0,
            defects: vec![error.to_string()],
            checked: None,
        },
    }
}

fn facts(path: PathBuf, report: &Report) -> ImageFacts {
    let identity = report.facts.identity.as_ref();
    let mut defects: Vec<_> = report.defects.iter().collect();
    defects.sort_by_key(|defect| defect.severity != Severity::Error);
    let mut defects: Vec<String> = defects
        .into_iter()
        .map(|defect| {
            let (severity, id) = (defect.severity.name(), defect.id);
            format!("{severity} {id}: line {}, column {}: {}", defect.line, defect.column, defect.message)
        })
        .collect();
    if report.unlisted() > 0 {
        defects.push(format!("{} more defects are not listed", report.unlisted()));
    }
    ImageFacts {
        path,
        ok: report.is_ok(),
        product: identity.map(|identity| identity.product.clone()),
        version: identity.map(|identity| identity.version),
        records: report.facts.records as usize,
        characters: report.facts.characters as usize,
        defects,
        checked: report.image(),
    }
}

/// The console says what it notes; that a note could not be written costs a question later, no more.
fn note(link: &str, upload: Option<(&str, &str)>) {
    let key = link.parse().ok().and_then(|spec: LinkSpec| link::journal_key(&spec));
    let (Some(key), Some(journal)) = (key, Journal::of_user()) else { return };
    let _ = match upload {
        Some((product, image)) => {
            let unix_seconds = Clock::start().wall(Instant::ZERO).as_second();
            journal.begin(&key, Note { product: product.to_owned(), image: image.to_owned(), unix_seconds })
        }
        None => journal.end(&key),
    };
}
