//! Writing a file so that nobody ever sees half of one: beside its place first, then in one step into it.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Why a file is not written. What was there is there.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// A file is there, and should stay.
    #[error("it exists already")]
    Exists,
    /// Something else is there: a folder, a device.
    #[error("it is not a file")]
    NotAFile,
    /// The system refuses.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Whether a file may be written there: to be asked before somebody works for what goes into it.
///
/// # Errors
/// If something is there that should stay.
pub fn admit(path: &Path, overwrite: bool) -> Result<(), SaveError> {
    match fs::metadata(path) {
        Ok(found) if !found.is_file() => Err(SaveError::NotAFile),
        Ok(_) if !overwrite => Err(SaveError::Exists),
        // A symbolic link that leads nowhere.
        Err(_) if !overwrite && fs::symlink_metadata(path).is_ok() => Err(SaveError::Exists),
        Ok(_) | Err(_) => Ok(()),
    }
}

/// Whether bytes go there one after the other, and no file may take its place.
#[cfg(unix)]
pub fn is_stream(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;

    let kind = fs::metadata(path).map(|found| found.file_type());
    kind.is_ok_and(|kind| kind.is_fifo() || kind.is_char_device())
}

/// The same where devices are not files.
#[cfg(not(unix))]
pub fn is_stream(_path: &Path) -> bool {
    false
}

/// Writes a file. An existing one is replaced only if that is wanted; of a symbolic link, what it leads to.
///
/// # Errors
/// If a file is there and should stay, if the place is not a file, or the system refuses. Then nothing has changed.
pub fn save(path: &Path, bytes: &[u8], overwrite: bool) -> Result<(), SaveError> {
    admit(path, overwrite)?;
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let beside = beside(&place);
    let mut file = make(&beside)?;
    let written = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| match fs::metadata(&place) {
            Ok(replaced) => fs::set_permissions(&beside, replaced.permissions()),
            Err(_) => Ok(()),
        })
        .and_then(|()| if overwrite { fs::rename(&beside, &place) } else { put(&beside, &place) });
    written.map_err(|error| {
        let _ = fs::remove_file(&beside);
        match error.kind() {
            io::ErrorKind::AlreadyExists => SaveError::Exists,
            _ => error.into(),
        }
    })
}

/// Gives a file its name, unless there is one of that name, which another process may have made a moment ago.
fn put(beside: &Path, place: &Path) -> io::Result<()> {
    match fs::hard_link(beside, place) {
        // The file has its name; that it has another one as well is nobody's loss.
        Ok(()) => {
            let _ = fs::remove_file(beside);
            Ok(())
        }
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(error),
        Err(_) => put_without_links(beside, place),
    }
}

/// The same where the file system has no hard links.
fn put_without_links(beside: &Path, place: &Path) -> io::Result<()> {
    File::create_new(place)?;
    fs::rename(beside, place).inspect_err(|_| {
        let _ = fs::remove_file(place);
    })
}

/// Makes a file of a name that [`beside`] gave.
fn make(beside: &Path) -> io::Result<File> {
    match File::create_new(beside) {
        // Left by a process of the same number that was killed: in a container they all have the same.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            fs::remove_file(beside)?;
            File::create_new(beside)
        }
        made => made,
    }
}

/// A name in the same folder that no other run of the program uses, nor another thread of this one.
fn beside(path: &Path) -> PathBuf {
    static NEXT: AtomicU32 = AtomicU32::new(1);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}-{number}.part", std::process::id()));
    path.with_file_name(name)
}

/// Whether a file is one that some run of the program wrote beside this place and did not put into it.
pub fn is_beside(file: &Path, place: &Path) -> bool {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let (file, place) = (name(file), name(place));
    let numbers = file.strip_prefix(&place).and_then(|rest| rest.strip_prefix('.')?.strip_suffix(".part"));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    // Of the process, and of the file within it where it has one.
    numbers.is_some_and(|numbers| numbers.splitn(2, '-').all(is_number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_written_beside_a_place_is_taken_for_that() {
        let place = Path::new("a/x.bin");
        assert!(is_beside(&beside(place), place) && is_beside(Path::new("a/x.bin.7.part"), place));
        for other in ["a/x.bin", "a/x.bin.part", "a/x.bin..part", "a/x.bin.old.part", "a/y.bin.7.part"] {
            assert!(!is_beside(Path::new(other), place), "{other}");
        }
        assert!(!is_beside(Path::new("a/x.bin.7-.part"), place) && !is_beside(Path::new("a/x.bin.7-1-2.part"), place));
    }

    // Elsewhere a file that somebody has open is not replaced.
    #[cfg(unix)]
    #[test]
    fn threads_that_write_to_one_place_leave_a_whole_file_of_one_of_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.json");
        std::thread::scope(|scope| {
            for letter in *b"abcd" {
                let path = &path;
                scope.spawn(move || (0..10).for_each(|_| save(path, &[letter; 10_000], true).expect("written")));
            }
        });
        let written = fs::read(&path).expect("there");
        assert!(b"abcd".iter().any(|&letter| written == [letter; 10_000]));
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn a_file_is_whole_or_as_it_was_and_nothing_else_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.S");
        save(&path, b"one", false).expect("written");
        assert!(matches!(save(&path, b"two", false), Err(SaveError::Exists)));
        assert_eq!(fs::read(&path).expect("there"), b"one");
        save(&path, b"three", true).expect("replaced");
        assert_eq!(fs::read(&path).expect("there"), b"three");
        let beside = beside(&path);
        fs::write(&beside, b"half").expect("left by another");
        make(&beside).expect("made again");
        assert_eq!(fs::read(&beside).expect("there"), b"");
        fs::remove_file(&beside).expect("removed");
        assert!(matches!(save(folder.path(), b"four", true), Err(SaveError::NotAFile)));
        assert!(matches!(save(&folder.path().join("no/such/x.S"), b"five", true), Err(SaveError::Io(_))));
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn what_another_process_has_put_there_meanwhile_stays() {
        for put in [put, put_without_links] {
            let folder = tempfile::tempdir().expect("a folder");
            let (place, beside) = (folder.path().join("x.S"), folder.path().join("x.S.7.part"));
            fs::write(&beside, b"ours").expect("written");
            put(&beside, &place).expect("nothing is there");
            assert_eq!(fs::read(&place).expect("there"), b"ours");
            assert!(!beside.exists());
            fs::write(&beside, b"later").expect("written");
            assert_eq!(put(&beside, &place).map_err(|error| error.kind()), Err(io::ErrorKind::AlreadyExists));
            assert_eq!(fs::read(&place).expect("there"), b"ours");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_rights_stay_as_they_were() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().expect("a folder");
        let (path, link) = (folder.path().join("x.json"), folder.path().join("latest"));
        fs::write(&path, b"one").expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("set");
        std::os::unix::fs::symlink(&path, &link).expect("linked");
        save(&link, b"two", true).expect("replaced");
        assert!(link.is_symlink());
        assert_eq!(fs::read(&path).expect("there"), b"two");
        assert_eq!(fs::metadata(&path).expect("there").permissions().mode() & 0o777, 0o640);
        fs::remove_file(&path).expect("removed");
        assert!(matches!(admit(&link, false), Err(SaveError::Exists)), "a link that leads nowhere");
    }
}
