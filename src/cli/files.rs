//! Files that commands write.

use std::path::{Path, PathBuf};

use super::error::{CliError, Kind};

/// Writes a file so that the old or the new one is there at any moment.
///
/// # Errors
/// If it cannot be written.
pub fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let mut new = file.as_os_str().to_owned();
    new.push(".new");
    let new = PathBuf::from(new);
    std::fs::write(&new, bytes).and_then(|()| std::fs::rename(&new, file)).map_err(|error| {
        let context = format!("cannot write '{}'", file.display());
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(context))
    })
}
