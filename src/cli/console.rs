//! `axcon` without a command: the console on the screen.

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use super::error::{CliError, Kind};
use super::output::Output;
use super::{Global, image as image_cli, link};
use crate::device::LoaderKind;
use crate::host::Input;
use crate::host::clock::{self, Clock};
use crate::host::journal::{Journal, Note};
use crate::host::link::{Connection, LinkSpec, Options};
use crate::host::ports;
use crate::image::DefectId;
use crate::time::Instant;
use crate::tui::run::{End, World};
use crate::tui::{self, Failure, ImageFacts, Noted, Palette};

/// Runs the console until the user leaves it.
///
/// # Errors
/// If there is no terminal to draw on, or a signal ends it.
pub fn run(global: &Global) -> Result<(), CliError> {
    if std::io::stdout().is_terminal() && !may_draw(std::env::var_os("TERM").as_deref()) {
        return Err(CliError::message(Kind::Usage, "this terminal cannot be drawn on: TERM is empty or 'dumb'").hint(
            "'axcon terminal --port PORT' talks to a unit line by line; 'axcon --help' lists the other commands",
        ));
    }
    // A name that makes no sense is said before the screen is taken.
    let link = global.port().map(|_| link::spec(global)).transpose()?;
    let world = World {
        link: link.map(|link| link.to_string()),
        baud: global.baud,
        recording: link::recording(global)?,
        noted: |link| {
            let note = journal(link).and_then(|(journal, key)| journal.note(&key));
            note.map(|Note { product, image, ran, unix_seconds }| {
                let begun = clock::local_text(unix_seconds.saturating_mul(1000));
                Noted { product, image, ran, begun }
            })
        },
        palette: palette(|name| std::env::var_os(name))?,
        resolve,
        open,
        explain: |error| failure(&link::link_error(error)),
        unreadable: |error| failure(&link::recording_error(error)),
        check,
        note,
        incomplete,
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

/// Whether a terminal of this name can be drawn on. One without a name is taken for one that can.
fn may_draw(term: Option<&OsStr>) -> bool {
    term.is_none_or(|name| !name.is_empty() && name != "dumb")
}

/// `NO_COLOR` and `AXCON_THEME`, which says what the terminal's ground is; nobody can ask every terminal.
fn palette(variable: impl Fn(&str) -> Option<OsString>) -> Result<Palette, CliError> {
    if variable("NO_COLOR").is_some_and(|value| !value.is_empty()) {
        return Ok(Palette::Mono);
    }
    let theme = variable("AXCON_THEME").unwrap_or_default().to_string_lossy().to_lowercase();
    match theme.as_str() {
        "" | "dark" => Ok(Palette::Dark),
        "light" => Ok(Palette::Light),
        "none" => Ok(Palette::Mono),
        _ => Err(CliError::message(Kind::Usage, "AXCON_THEME may be dark, light or none")),
    }
}

/// What a name typed on the screen means: the same as after `--port`.
fn resolve(name: &str) -> Result<LinkSpec, Failure> {
    link::named(name, || ports::list().unwrap_or_default()).map_err(|error| failure(&error))
}

fn open(spec: &LinkSpec, baud: u32, clock: Clock, inputs: SyncSender<Input>) -> Result<Connection, Failure> {
    Connection::open(spec, Options { baud }, clock, inputs).map_err(|error| failure(&link::link_error(error)))
}

fn failure(error: &CliError) -> Failure {
    Failure { text: error.to_string(), hints: error.hints.clone() }
}

fn check(path: PathBuf, loader: Option<LoaderKind>, allow: &[DefectId]) -> Result<ImageFacts, String> {
    let report = image_cli::read_for(&path, &image_cli::targets_with(loader), None, allow);
    report.map(|report| ImageFacts::of_report(path, &report, loader, allow)).map_err(|error| error.to_string())
}

/// The console has ended, the disk has not.
fn incomplete(paths: &[PathBuf]) {
    let mut output = Output::standard(false);
    for path in paths {
        output.remark(&format!("axcon: {} is incomplete: the disk takes too long", path.display()));
    }
}

/// Notes an upload, or forgets it. A note that cannot be written costs the user a question later, and nothing else.
fn note(link: &str, upload: Option<Noted>) {
    let Some((journal, key)) = journal(link) else { return };
    let _ = match upload {
        Some(Noted { product, image, ran, .. }) => {
            let unix_seconds = Clock::start().wall(Instant::ZERO).as_second();
            journal.begin(&key, Note { product, image, unix_seconds, ran })
        }
        None => journal.end(&key),
    };
}

/// The journal of uploads, and what it calls the port of a link; `None` where nothing is noted.
fn journal(link: &str) -> Option<(Journal, String)> {
    Some((Journal::of_user()?, link::journal_key(&resolve(link).ok()?)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_that_says_it_takes_text_only_is_not_drawn_on() {
        for (term, expected) in [(None, true), (Some(""), false), (Some("dumb"), false), (Some("xterm"), true)] {
            assert_eq!(may_draw(term.map(OsStr::new)), expected, "{term:?}");
        }
    }

    #[test]
    fn the_environment_chooses_the_colours() {
        let chosen = |set: &[(&str, &str)]| {
            palette(|name| set.iter().find(|(known, _)| *known == name).map(|(_, value)| value.into())).ok()
        };
        assert_eq!(chosen(&[]), Some(Palette::Dark));
        assert_eq!(chosen(&[("AXCON_THEME", "Light")]), Some(Palette::Light));
        assert_eq!(chosen(&[("AXCON_THEME", "light"), ("NO_COLOR", "1")]), Some(Palette::Mono));
        assert_eq!(chosen(&[("NO_COLOR", "")]), Some(Palette::Dark), "empty is as if it were not set");
        assert_eq!(chosen(&[("AXCON_THEME", "pink")]), None);
    }
}
