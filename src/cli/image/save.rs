//! Writing a file so that nobody ever sees half of one: beside its place first, then in one step into it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::shown;
use crate::cli::error::{CliError, Kind};

/// Writes a file. What is there already is replaced only if that is wanted.
///
/// # Errors
/// If a file is there and should stay, if the place is no file, or the system refuses. Then what was there is there.
pub(super) fn save(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), CliError> {
    match fs::metadata(path) {
        Ok(found) if !found.is_file() => {
            let message = format!("{} is not a file", shown(path));
            return Err(CliError::message(Kind::Failed, message).hint("Name a file; - is standard output."));
        }
        Ok(_) if !overwrite => {
            let message = format!("{} exists already", shown(path));
            return Err(
                CliError::message(Kind::NeedsYes, message).hint("Overwrite it with --yes, or name another with --out.")
            );
        }
        Ok(_) | Err(_) => {}
    }
    let beside = beside(path);
    let written = File::create_new(&beside)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&beside, path));
    written.map_err(|error| {
        if error.kind() != io::ErrorKind::AlreadyExists {
            let _ = fs::remove_file(&beside);
        }
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot write {}", shown(path))))
            .hint("Look whether the folder exists, may be written to, and has room.")
    })
}

/// A name in the same folder that no other run of the program uses.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_whole_or_as_it_was_and_nothing_stays_behind() {
        let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let path = folder.path().join("x.S");
        assert!(save(&path, b"one", false).is_ok());
        assert_eq!(save(&path, b"two", false).map_err(|error| error.kind), Err(Kind::NeedsYes));
        assert_eq!(fs::read(&path).ok().as_deref(), Some(&b"one"[..]));
        assert!(save(&path, b"three", true).is_ok());
        assert_eq!(fs::read(&path).ok().as_deref(), Some(&b"three"[..]));
        assert_eq!(save(folder.path(), b"four", true).map_err(|error| error.kind), Err(Kind::Failed));
        let nowhere = folder.path().join("no/such/x.S");
        assert_eq!(save(&nowhere, b"five", true).map_err(|error| error.kind), Err(Kind::Failed));
        assert_eq!(fs::read_dir(folder.path()).map(Iterator::count).ok(), Some(1));
    }
}
