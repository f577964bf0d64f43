//! What an emulated unit keeps while it has no power, in a directory.
//!
//! `flash.bin` is the program flash, bytes in S-record order; it is written in place, as flash is, so a power cut in
//! the middle of an upload leaves half an image, as in life. `parameters.bin` is the non-volatile memory; it is
//! replaced as a whole, so that it is the old one or the new one at any moment. A file that does not fit is an error
//! and never replaced: it may be somebody's only copy.

use std::fs::{self, File, TryLockError};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use crate::emulator::{Area, Store};

/// A unit's state directory, locked for this process.
#[derive(Debug)]
pub struct State {
    folder: PathBuf,
    flash: File,
    parameters: Vec<u8>,
    _lock: File,
}

/// The memories that outlive the power.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contents {
    /// Program flash.
    pub flash: Vec<u8>,
    /// Non-volatile parameters.
    pub parameters: Vec<u8>,
}

/// Why a state directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// Another emulator uses it.
    #[error("the state directory '{}' is in use by another emulator", folder.display())]
    InUse {
        /// The directory.
        folder: PathBuf,
    },
    /// A file has not the size of the product's memory.
    #[error("'{}' has {found} bytes, this product's has {expected}; it is left as it is", file.display())]
    WrongSize {
        /// The file.
        file: PathBuf,
        /// Bytes the product has.
        expected: usize,
        /// Bytes the file has.
        found: usize,
    },
    /// The system refused.
    #[error("cannot {operation} '{}'", path.display())]
    Io {
        /// What was being done.
        operation: &'static str,
        /// With which file or directory.
        path: PathBuf,
        /// Why not.
        #[source]
        source: io::Error,
    },
}

const FLASH: &str = "flash.bin";
const PARAMETERS: &str = "parameters.bin";
const LOCK: &str = "lock";

impl State {
    /// Opens a state directory and gives what lies in it; where nothing does, `initial` is written. The sizes of
    /// `initial` are those of the product's memories.
    ///
    /// # Errors
    /// If another emulator uses the directory, a file does not fit, or the system refuses.
    pub fn open(folder: &Path, initial: &Contents) -> Result<(Self, Contents), StateError> {
        fs::create_dir_all(folder).map_err(failed("create", folder))?;
        let lock = lock(folder)?;
        let flash = load(&folder.join(FLASH), &initial.flash)?;
        let parameters = load(&folder.join(PARAMETERS), &initial.parameters)?;
        let file = folder.join(FLASH);
        let open = File::options().read(true).write(true).open(&file).map_err(failed("write", &file))?;
        let state = State { folder: folder.to_owned(), flash: open, parameters: parameters.clone(), _lock: lock };
        Ok((state, Contents { flash, parameters }))
    }

    /// Carries out writes of the unit, in their order.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn write(&mut self, stores: &[Store]) -> Result<(), StateError> {
        for (at, store) in stores.iter().enumerate() {
            match store.area {
                Area::Flash => {
                    let file = self.folder.join(FLASH);
                    self.flash.write_all_at(&store.bytes, store.offset as u64).map_err(failed("write", &file))?;
                }
                Area::Parameters => {
                    let end = store.offset + store.bytes.len();
                    if self.parameters.len() < end {
                        self.parameters.resize(end, 0xFF);
                    }
                    self.parameters[store.offset..end].copy_from_slice(&store.bytes);
                    // What the unit writes in one go goes to disk in one go.
                    if stores.get(at + 1).is_none_or(|next| next.area != Area::Parameters) {
                        replace(&self.folder.join(PARAMETERS), &self.parameters)?;
                    }
                }
            }
        }
        Ok(())
    }
}

fn lock(folder: &Path) -> Result<File, StateError> {
    let path = folder.join(LOCK);
    let file = File::options().create(true).truncate(false).write(true).open(&path).map_err(failed("create", &path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StateError::InUse { folder: folder.to_owned() }),
        Err(TryLockError::Error(error)) => Err(failed("lock", &path)(error)),
    }
}

fn load(file: &Path, initial: &[u8]) -> Result<Vec<u8>, StateError> {
    match fs::read(file) {
        Ok(bytes) if bytes.len() == initial.len() => Ok(bytes),
        Ok(bytes) => Err(StateError::WrongSize { file: file.to_owned(), expected: initial.len(), found: bytes.len() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            replace(file, initial)?;
            Ok(initial.to_vec())
        }
        Err(error) => Err(failed("read", file)(error)),
    }
}

/// Writes a whole file so that the old or the new content is there at any moment.
fn replace(file: &Path, bytes: &[u8]) -> Result<(), StateError> {
    let mut new = file.as_os_str().to_owned();
    new.push(".new");
    let new = PathBuf::from(new);
    fs::write(&new, bytes).map_err(failed("write", &new))?;
    fs::rename(&new, file).map_err(failed("replace", file))
}

fn failed(operation: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StateError {
    let path = path.to_owned();
    move |source| StateError::Io { operation, path, source }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn initial() -> Contents {
        Contents { flash: vec![0xFF; 64], parameters: vec![1, 2, 3, 4] }
    }

    #[test]
    fn what_a_unit_writes_is_there_at_the_next_start() {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut state, contents) = State::open(folder.path(), &initial()).expect("created");
        assert_eq!(contents, initial());
        let store = |area, offset, bytes: &[u8]| Store { area, offset, bytes: bytes.to_vec() };
        state
            .write(&[
                store(Area::Flash, 10, b"abc"),
                store(Area::Parameters, 1, b"x"),
                store(Area::Parameters, 3, b"y"),
                store(Area::Flash, 11, b"B"),
            ])
            .expect("written");
        drop(state);
        let (_state, contents) = State::open(folder.path(), &initial()).expect("opened");
        assert_eq!(&contents.flash[9..14], b"\xffaBc\xff");
        assert_eq!(contents.parameters, [1, b'x', 3, b'y']);
    }

    #[test]
    fn two_emulators_cannot_share_a_directory() {
        let folder = tempfile::tempdir().expect("a folder");
        let (_state, _) = State::open(folder.path(), &initial()).expect("created");
        let error = State::open(folder.path(), &initial()).expect_err("locked");
        assert!(matches!(error, StateError::InUse { .. }), "{error}");
    }

    #[test]
    fn a_file_that_does_not_fit_is_named_and_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join(FLASH);
        fs::write(&file, "too short").expect("written");
        let error = State::open(folder.path(), &initial()).expect_err("refused").to_string();
        assert!(error.contains("flash.bin' has 9 bytes, this product's has 64"), "{error}");
        assert_eq!(fs::read(&file).expect("still there"), b"too short");
    }
}
