//! Files that commands write.

use std::path::Path;

use super::error::{CliError, Kind};
use super::image::shown;
use crate::host::save::{self, SaveError};

/// Whether a command may write this file: to be asked before the unit is. `overwrite`: the user has said `--yes`.
///
/// # Errors
/// If something is there that should stay.
pub fn admit(path: &Path, overwrite: bool) -> Result<(), CliError> {
    save::admit(path, overwrite).map_err(|error| save_error(path, error))
}

/// Writes a file so that the old or the new one is there at any moment. What is there already is replaced only if the
/// user has said `--yes`.
///
/// # Errors
/// If a file is there and should stay, or it cannot be written.
pub fn save(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), CliError> {
    save::save(path, bytes, overwrite).map_err(|error| save_error(path, error))
}

/// What it means that a file is not written.
pub fn save_error(path: &Path, error: SaveError) -> CliError {
    let shown = shown(path);
    match error {
        SaveError::Exists => CliError::message(Kind::NeedsYes, format!("{shown} exists already"))
            .hint("Overwrite it with --yes, or name another."),
        SaveError::NotAFile => CliError::message(Kind::Failed, format!("{shown} is not a file")).hint("Name a file."),
        SaveError::Io(error) => {
            CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot write '{shown}'")))
                .hint("Look whether the folder exists, may be written to, and has room.")
        }
    }
}
