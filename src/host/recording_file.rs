//! The file of a recording: nobody but its owner may read it, and it shows whether it is being written.

use std::fs::File;
use std::io;
use std::path::Path;

/// What becomes of a file that already exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// The user has named it.
    IsReplaced,
    /// It is another recording.
    Stays,
}

/// Opens a file to be written. Until it is closed, however the process ends, [`is_being_written`] says so.
///
/// # Errors
/// If the file exists and has to stay, another program writes it, or the system refuses.
pub fn create(path: &Path, existing: Existing) -> io::Result<File> {
    let mut options = File::options();
    options.write(true).create_new(existing == Existing::Stays).create(true).truncate(true);
    system::create(options, path)
}

/// Whether a program, this one or another, is writing the file. Where locks do not work, none is.
pub fn is_being_written(path: &Path) -> bool {
    system::is_being_written(path)
}

#[cfg(unix)]
mod system {
    use std::fs::{File, OpenOptions, TryLockError};
    use std::io;
    use std::os::unix::fs::OpenOptionsExt;
    use std::path::Path;

    pub fn create(mut options: OpenOptions, path: &Path) -> io::Result<File> {
        let file = options.mode(0o600).open(path)?;
        // Where locks do not work, a recording is protected from the next ones well enough by its age.
        let _ = file.try_lock_shared();
        Ok(file)
    }

    pub fn is_being_written(path: &Path) -> bool {
        File::open(path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }
}

#[cfg(windows)]
mod system {
    //! A lock would keep its own holder from writing there. That others may not open the file for writing, nor delete
    //! it, is part of how it is opened.

    use std::fs::{File, OpenOptions};
    use std::io;
    use std::os::windows::fs::OpenOptionsExt;
    use std::path::Path;

    const FILE_SHARE_READ: u32 = 1;
    const ERROR_SHARING_VIOLATION: i32 = 32;

    pub fn create(mut options: OpenOptions, path: &Path) -> io::Result<File> {
        options.share_mode(FILE_SHARE_READ).open(path)
    }

    pub fn is_being_written(path: &Path) -> bool {
        let opened = File::options().write(true).open(path);
        opened.is_err_and(|error| error.raw_os_error() == Some(ERROR_SHARING_VIOLATION))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;

    use super::*;

    #[test]
    fn a_file_can_be_written_and_shows_that_it_is_until_it_is_closed() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("20260131T120000Z-a-1.cast");
        let mut file = create(&path, Existing::Stays).expect("created");
        assert!(is_being_written(&path));
        file.write_all(b"one").expect("its owner may write");
        assert_eq!(fs::read(&path).expect("others may read"), b"one");
        drop(file);
        assert!(!is_being_written(&path));
        assert!(create(&path, Existing::Stays).is_err(), "it exists");
        drop(create(&path, Existing::IsReplaced).expect("replaced"));
        assert_eq!(fs::read(&path).expect("there"), b"");
    }

    #[test]
    fn what_is_not_there_is_not_being_written() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(!is_being_written(&folder.path().join("nowhere.cast")));
    }
}
