//! `axcon` without a command: the console on the screen.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::error::{CliError, Kind};
use super::{Global, image as image_cli, link};
use crate::host::Input;
use crate::host::clock::Clock;
use crate::host::journal::{Journal, Note};
use crate::host::link::{Connection, LinkSpec, Options};
use crate::host::ports;
use crate::time::Instant;
use crate::tui::run::{End, World};
use crate::tui::{self, Failure, ImageFacts};

/// Runs the console until the user leaves it.
///
/// # Errors
/// If there is no terminal to draw on, or a signal ends it.
pub fn run(global: &Global) -> Result<(), CliError> {
    // A name that makes no sense is said before the screen is taken.
    let link = global.port().map(|_| link::spec(global)).transpose()?;
    let world = World {
        link: link.map(|link| link.to_string()),
        baud: global.baud,
        recording: link::recording(global),
        noted: |link| {
            journal(link).and_then(|(journal, key)| journal.note(&key)).map(|note| (note.product, note.image))
        },
        colour: std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
        resolve,
        open,
        explain: |error| failure(&link::link_error(error)),
        unreadable: |error| failure(&link::recording_error(error)),
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

/// What a name typed on the screen means: the same as behind `--port`.
fn resolve(name: &str) -> Result<LinkSpec, Failure> {
    link::named(name, || ports::list().unwrap_or_default()).map_err(|error| failure(&error))
}

fn open(spec: &LinkSpec, baud: u32, clock: Clock, inputs: SyncSender<Input>) -> Result<Connection, Failure> {
    Connection::open(spec, Options { baud }, clock, inputs).map_err(|error| failure(&link::link_error(error)))
}

fn failure(error: &CliError) -> Failure {
    Failure { text: error.to_string(), hints: error.hints.clone() }
}

fn check(path: PathBuf) -> ImageFacts {
    match image_cli::read(&path, None, &[]) {
        Ok(report) => ImageFacts::of_report(path, &report),
        Err(error) => ImageFacts::unreadable(path, error.to_string()),
    }
}

/// The console says what it notes; that a note could not be written costs a question later, no more.
fn note(link: &str, upload: Option<(&str, &str)>) {
    let Some((journal, key)) = journal(link) else { return };
    let _ = match upload {
        Some((product, image)) => {
            let unix_seconds = Clock::start().wall(Instant::ZERO).as_second();
            journal.begin(&key, Note { product: product.to_owned(), image: image.to_owned(), unix_seconds })
        }
        None => journal.end(&key),
    };
}

/// The journal of uploads, and what it calls the port behind a link; `None` where nothing is noted.
fn journal(link: &str) -> Option<(Journal, String)> {
    Some((Journal::of_user()?, link::journal_key(&resolve(link).ok()?)?))
}
