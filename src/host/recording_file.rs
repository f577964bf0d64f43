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

/// Opens a file to be written, empty. Until it is closed, however the process ends, [`is_being_written`] says so.
///
/// # Errors
/// If the file exists and has to stay, somebody writes it already, this program or another, or the system refuses. Then
/// what is in it is as it was.
pub fn create(path: &Path, existing: Existing) -> io::Result<File> {
    system::create(path, existing)
}

/// Whether a program, this one or another, is writing the file. Where locks do not work, none is.
pub fn is_being_written(path: &Path) -> bool {
    system::is_being_written(path)
}

#[cfg(unix)]
mod system {
    //! Who writes has an exclusive lock, who asks takes a shared one for a moment: so all who ask see a writer, and none of
    //! them looks like one.

    use std::fs::{File, TryLockError};
    use std::io;
    use std::os::unix::fs::OpenOptionsExt;
    use std::path::Path;
    use std::thread;
    use std::time::Duration;

    use super::Existing;

    /// How often a writer tries to get its lock, each time after [`PAUSE`]: a question takes microseconds.
    const TRIES: u32 = 50;
    const PAUSE: Duration = Duration::from_millis(1);

    pub fn create(path: &Path, existing: Existing) -> io::Result<File> {
        let mut options = File::options();
        options.write(true).create_new(existing == Existing::Stays).create(true).truncate(false);
        let file = options.mode(0o600).open(path)?;
        // Where locks do not work, a recording is protected from the next ones well enough by its age.
        let is_locked_by_other = matches!(lock(&file), Err(TryLockError::WouldBlock));
        // Nobody else writes a file that was not there.
        if is_locked_by_other && existing == Existing::IsReplaced {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "it is being written already"));
        }
        // Not before the lock: somebody else's recording would be lost.
        file.set_len(0)?;
        Ok(file)
    }

    fn lock(file: &File) -> Result<(), TryLockError> {
        for _ in 1..TRIES {
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => thread::sleep(PAUSE),
                locked => return locked,
            }
        }
        file.try_lock()
    }

    pub fn is_being_written(path: &Path) -> bool {
        File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

#[cfg(windows)]
mod system {
    //! A lock would keep others from reading there. That they may read the file, but neither open it for writing nor
    //! delete it, is part of how it is opened; so it is not emptied either while somebody writes it.

    use std::fs::File;
    use std::io;
    use std::os::windows::fs::OpenOptionsExt;
    use std::path::Path;

    use super::Existing;

    const FILE_SHARE_READ: u32 = 1;
    const ERROR_SHARING_VIOLATION: i32 = 32;

    pub fn create(path: &Path, existing: Existing) -> io::Result<File> {
        let mut options = File::options();
        options.write(true).create_new(existing == Existing::Stays).create(true).truncate(true);
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
    fn what_is_being_written_is_not_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mine.cast");
        let mut file = create(&path, Existing::IsReplaced).expect("created");
        file.write_all(b"one").expect("written");
        create(&path, Existing::IsReplaced).expect_err("somebody writes it");
        assert_eq!(fs::read(&path).expect("there"), b"one");
        file.write_all(b" and two").expect("it goes on");
        assert_eq!(fs::read(&path).expect("there"), b"one and two");
    }

    #[cfg(unix)]
    #[test]
    fn who_asks_is_in_the_way_of_nobody() {
        use std::sync::atomic::{AtomicBool, Ordering};

        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mine.cast");
        drop(create(&path, Existing::Stays).expect("created"));
        let question = File::open(&path).expect("there");
        question.try_lock_shared().expect("nobody writes it");
        assert!(!is_being_written(&path), "another question is not a writer");
        drop(question);

        const RECORDINGS: usize = 100;
        let over = AtomicBool::new(false);
        let seen = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    is_being_written(&path);
                }
            });
            let is_seen = |_: &usize| create(&path, Existing::IsReplaced).is_ok_and(|_file| is_being_written(&path));
            let seen = (0..RECORDINGS).filter(is_seen).count();
            over.store(true, Ordering::Relaxed);
            seen
        });
        assert_eq!(seen, RECORDINGS);
    }

    #[test]
    fn what_is_not_there_is_not_being_written() {
        let folder = tempfile::tempdir().expect("a folder");
        assert!(!is_being_written(&folder.path().join("nowhere.cast")));
    }
}
