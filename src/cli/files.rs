//! Files that commands read and write.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use super::error::{CliError, Kind};
pub use super::image::shown;
use crate::host::save::{self, SaveError};

/// Reads a text of no more bytes than that: whatever a name leads to need not have an end.
///
/// # Errors
/// If it cannot be read, has more bytes, or is no text.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {} MiB", most >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        io::Error::new(ErrorKind::InvalidData, format!("it is no text: byte {at} is no UTF-8"))
    })
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_read_than_there_may_be_and_nothing_but_text() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            read_text(&path, 1 << 20).map_err(|error| error.to_string())
        };
        let full = vec![b'x'; 1 << 20];
        assert_eq!(read(&full).map(|text| text.len()), Ok(1 << 20));
        assert_eq!(read(&[&full[..], b"x"].concat()), Err("it is larger than 1 MiB".into()));
        assert_eq!(read(b"ab\xff"), Err("it is no text: byte 2 is no UTF-8".into()));
        assert!(read_text(folder.path(), 1).is_err(), "a folder");
        #[cfg(unix)]
        assert!(read_text(Path::new("/dev/zero"), 1 << 20).is_err(), "no end");
    }
}
