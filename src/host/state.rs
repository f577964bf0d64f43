//! What an emulated unit keeps while it has no power, in a directory.
//!
//! `flash.bin` is the program flash, bytes in S-record order; it is written in place, as flash is, so a power cut in
//! the middle of an upload leaves half an image, as in life. `parameters.bin` is the non-volatile memory; it is
//! replaced as a whole, so that it is the old one or the new one at any moment. A file that cannot be used is kept aside
//! under another name and reported, never replaced in silence: it may be somebody's only copy. A directory of another
//! product is an error, and nothing in it is touched.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::save::{self, SaveError};
use crate::device::Product;
use crate::emulator::memory::{IMAGE_BYTES, Parameters, ParametersError};
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

/// A file that could not be used and was kept aside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damaged {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub what: String,
    /// Where it lies now.
    pub kept: PathBuf,
}

impl std::fmt::Display for Damaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Damaged { file, what, kept } = self;
        write!(
            f,
            "'{}' cannot be used: {what}; it is kept as '{}', and the unit starts without it",
            file.display(),
            kept.display()
        )
    }
}

/// What opening a state directory gives.
#[derive(Debug)]
pub struct Opened {
    /// The directory.
    pub state: State,
    /// What lies in it.
    pub contents: Contents,
    /// What had to be kept aside.
    pub damaged: Vec<Damaged>,
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
    /// It belongs to a unit of another product.
    #[error("the state directory '{}' is of another product: {found}; nothing in it has been touched", folder.display())]
    OtherProduct {
        /// The directory.
        folder: PathBuf,
        /// Which. It is in the message, so it is not a cause, which would be said again after it.
        found: ParametersError,
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
    /// Opens a unit's state directory and gives what lies in it; where nothing usable does, `initial` is written. The
    /// sizes of `initial` are those of the product's memories.
    ///
    /// # Errors
    /// If another emulator uses the directory, it belongs to another product, or the system refuses.
    pub fn open(folder: &Path, product: &Product, initial: &Contents) -> Result<Opened, StateError> {
        fs::create_dir_all(folder).map_err(failed("create", folder))?;
        let lock = lock(folder)?;
        remove_parts(folder);
        let (flash_file, parameters_file) = (folder.join(FLASH), folder.join(PARAMETERS));
        let (name, size) = (&product.name, initial.flash.len());
        let flash = match read(&flash_file, size)? {
            None => Ok(None),
            Some(Found::Whole(bytes)) if bytes.len() == size => Ok(Some(bytes)),
            Some(Found::Whole(bytes)) => {
                Err(format!("it has {} bytes, the program flash of an {name} has {size}", bytes.len()))
            }
            Some(Found::Longer) => Err(format!("it has more than the {size} bytes of an {name}'s program flash")),
        };
        let parameters = match read(&parameters_file, IMAGE_BYTES)? {
            None => Ok(None),
            // An erased memory is blank; an empty file is what a crash or a full disk leaves.
            Some(Found::Whole(bytes)) if bytes.is_empty() => {
                Err(format!("it is empty, the parameter memory has {IMAGE_BYTES} bytes"))
            }
            Some(Found::Whole(bytes)) => match Parameters::read(product, &bytes) {
                Ok(_) => Ok(Some(bytes)),
                Err(found @ ParametersError::Product { .. }) => {
                    return Err(StateError::OtherProduct { folder: folder.to_owned(), found });
                }
                Err(error) => Err(error.to_string()),
            },
            Some(Found::Longer) => Err(format!("it has more than the {IMAGE_BYTES} bytes of the parameter memory")),
        };
        let mut damaged = Vec::new();
        let flash = settle(&flash_file, flash, &initial.flash, &mut damaged)?;
        let parameters = settle(&parameters_file, parameters, &initial.parameters, &mut damaged)?;
        let open = File::options().read(true).write(true).open(&flash_file).map_err(failed("write", &flash_file))?;
        let state = State { folder: folder.to_owned(), flash: open, parameters: parameters.clone(), _lock: lock };
        Ok(Opened { state, contents: Contents { flash, parameters }, damaged })
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
                    self.flash
                        .seek(SeekFrom::Start(store.offset as u64))
                        .and_then(|_| self.flash.write_all(&store.bytes))
                        .map_err(failed("write", &file))?;
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

/// Removes what processes left that were killed while they replaced a file. A process that writes here holds the lock, so none is
/// at work on them; a unit is hosted even if one cannot be removed.
fn remove_parts(folder: &Path) {
    let Ok(found) = fs::read_dir(folder) else { return };
    for path in found.flatten().map(|entry| entry.path()) {
        if save::is_beside(&path, &folder.join(PARAMETERS)) || save::is_beside(&path, &folder.join(FLASH)) {
            let _ = fs::remove_file(&path);
        }
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

/// What lies in a file.
enum Found {
    /// This, and nothing after it.
    Whole(Vec<u8>),
    /// More than there may be.
    Longer,
}

/// Reads a file, but no more of it than a memory has bytes: whatever its name leads to need not have an end.
fn read(file: &Path, most: usize) -> Result<Option<Found>, StateError> {
    match fs::metadata(file) {
        // Opening a pipe would wait for somebody at its other end.
        Ok(found) if !found.is_file() => return Err(failed("read", file)(io::Error::other(SaveError::NotAFile))),
        Ok(_) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed("read", file)(error)),
    }
    let mut bytes = Vec::new();
    File::open(file)
        .and_then(|file| file.take(most as u64 + 1).read_to_end(&mut bytes))
        .map_err(failed("read", file))?;
    Ok(Some(if bytes.len() > most { Found::Longer } else { Found::Whole(bytes) }))
}

/// What is in the file; `initial` from now on if there is none, or something is wrong with it.
fn settle(
    file: &Path,
    found: Result<Option<Vec<u8>>, String>,
    initial: &[u8],
    damaged: &mut Vec<Damaged>,
) -> Result<Vec<u8>, StateError> {
    match found {
        Ok(Some(bytes)) => return Ok(bytes),
        Ok(None) => {}
        Err(what) => {
            let kept = keep_aside(file)?;
            damaged.push(Damaged { file: file.to_owned(), what, kept });
        }
    }
    replace(file, initial)?;
    Ok(initial.to_vec())
}

/// Gives a file a name that is free: `flash.bin.damaged-1`.
fn keep_aside(file: &Path) -> Result<PathBuf, StateError> {
    let named = |number: u32| {
        let mut name = file.as_os_str().to_owned();
        name.push(format!(".damaged-{number}"));
        PathBuf::from(name)
    };
    let kept = (1..).map(named).find(|name| !name.exists()).unwrap_or_else(|| named(0));
    fs::rename(file, &kept).map_err(failed("rename", file))?;
    Ok(kept)
}

/// Writes a whole file so that the old or the new content is there at any moment.
fn replace(file: &Path, bytes: &[u8]) -> Result<(), StateError> {
    save::save(file, bytes, true).map_err(|error| match error {
        SaveError::Io(error) => failed("replace", file)(error),
        other @ (SaveError::Exists | SaveError::NotAFile) => failed("replace", file)(io::Error::other(other)),
    })
}

fn failed(operation: &'static str, path: &Path) -> impl FnOnce(io::Error) -> StateError {
    let path = path.to_owned();
    move |source| StateError::Io { operation, path, source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::unit;

    fn product(name: &str) -> &'static Product {
        Product::named(name).expect("built in")
    }

    fn initial(name: &str) -> Contents {
        let unit = crate::emulator::Unit::new(unit::factory_setup(product(name), 1));
        Contents { flash: unit.flash().to_vec(), parameters: unit.parameters().to_vec() }
    }

    fn open(folder: &Path, name: &str) -> Result<Opened, StateError> {
        State::open(folder, product(name), &initial(name))
    }

    #[test]
    fn what_a_killed_emulator_has_left_is_cleared_away_and_nothing_else_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let left = [("parameters.bin.123.part", false), ("flash.bin.7.part", false), ("notes.7.part", true)];
        left.iter().for_each(|(name, _)| fs::write(folder.path().join(name), b"half").expect("written"));
        drop(open(folder.path(), "AXTC4CO").expect("created"));
        for (name, stays) in left {
            assert_eq!(folder.path().join(name).exists(), stays, "{name}");
        }
    }

    #[test]
    fn what_a_unit_writes_is_there_at_the_next_start() {
        let folder = tempfile::tempdir().expect("a folder");
        let Opened { mut state, contents, damaged } = open(folder.path(), "AXTC4CO").expect("created");
        assert_eq!((contents, damaged), (initial("AXTC4CO"), vec![]));
        let store = |area, offset, bytes: &[u8]| Store { area, offset, bytes: bytes.to_vec() };
        // The second slot of the parameters holds nothing yet.
        state
            .write(&[
                store(Area::Flash, 10, b"abc"),
                store(Area::Parameters, 2_100, b"x"),
                store(Area::Parameters, 2_102, b"y"),
                store(Area::Flash, 11, b"B"),
            ])
            .expect("written");
        drop(state);
        let Opened { contents, damaged, .. } = open(folder.path(), "AXTC4CO").expect("opened");
        assert_eq!(&contents.flash[10..13], b"aBc");
        assert_eq!((&contents.parameters[2_100..2_103], damaged.len()), (&[b'x', 0xFF, b'y'][..], 0));
    }

    #[test]
    fn what_a_unit_wrote_before_a_write_that_fails_is_there_and_nothing_after_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let Opened { mut state, contents: before, .. } = open(folder.path(), "AXTC4CO").expect("created");
        // A folder in the place of the parameters: they cannot be replaced.
        let (parameters, aside) = (folder.path().join(PARAMETERS), folder.path().join("aside"));
        fs::rename(&parameters, &aside).expect("renamed");
        fs::create_dir(&parameters).expect("made");
        let store = |area, offset, bytes: &[u8]| Store { area, offset, bytes: bytes.to_vec() };
        let error = state
            .write(&[
                store(Area::Flash, 10, b"abc"),
                store(Area::Flash, 11, b"B"),
                store(Area::Parameters, 2_100, b"x"),
                store(Area::Flash, 12, b"C"),
            ])
            .expect_err("refused");
        assert!(matches!(error, StateError::Io { operation: "replace", .. }), "{error}");
        drop(state);
        fs::remove_dir(&parameters).expect("removed");
        fs::rename(&aside, &parameters).expect("renamed");
        let Opened { contents, .. } = open(folder.path(), "AXTC4CO").expect("opened");
        assert_eq!(&contents.flash[10..13], b"aBc", "the first two, and not the last");
        assert_eq!(contents.parameters, before.parameters);
    }

    #[test]
    fn two_emulators_cannot_share_a_directory() {
        let folder = tempfile::tempdir().expect("a folder");
        let _opened = open(folder.path(), "AXTC4CO").expect("created");
        let error = open(folder.path(), "AXTC4CO").expect_err("locked");
        assert!(matches!(error, StateError::InUse { .. }), "{error}");
    }

    #[test]
    fn what_cannot_be_used_is_reported_and_kept_aside() {
        let folder = tempfile::tempdir().expect("a folder");
        let (flash, parameters) = (folder.path().join(FLASH), folder.path().join(PARAMETERS));
        for round in 1..=2 {
            fs::write(&flash, "too short").expect("written");
            fs::write(&parameters, vec![0x55; 4_096]).expect("written");
            let Opened { contents, damaged, .. } = open(folder.path(), "AXTC4CO").expect("opened all the same");
            assert_eq!(contents, initial("AXTC4CO"), "the factory's");
            let texts: Vec<String> = damaged.iter().map(Damaged::to_string).collect();
            assert_eq!(texts.len(), 2);
            assert!(texts[0].contains("it has 9 bytes, the program flash of an AXTC4CO has 131072"), "{}", texts[0]);
            assert!(texts[1].contains("neither slot of the parameter memory is intact"), "{}", texts[1]);
            let kept = folder.path().join(format!("{FLASH}.damaged-{round}"));
            assert_eq!(fs::read(&kept).expect("kept"), b"too short");
            assert!(texts[0].contains(&format!("{FLASH}.damaged-{round}")), "{}", texts[0]);
            assert_eq!(fs::read(&flash).expect("new"), initial("AXTC4CO").flash);
        }
    }

    #[test]
    fn an_empty_file_is_reported_and_an_erased_memory_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(open(folder.path(), "AXTC4CO").expect("created"));
        for name in [FLASH, PARAMETERS] {
            fs::write(folder.path().join(name), b"").expect("written");
            let Opened { contents, damaged, .. } = open(folder.path(), "AXTC4CO").expect("opened all the same");
            assert_eq!((contents, damaged.len()), (initial("AXTC4CO"), 1), "{name}");
            assert_eq!(damaged[0].kept, folder.path().join(format!("{name}.damaged-1")));
        }
        fs::write(folder.path().join(PARAMETERS), [0xFF; IMAGE_BYTES]).expect("written");
        assert_eq!(open(folder.path(), "AXTC4CO").expect("opened").damaged, []);
    }

    #[test]
    fn no_more_is_read_of_a_file_than_a_memory_has() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, complaint) in [
            (FLASH, "it has more than the 131072 bytes of an AXTC4CO's program flash"),
            (PARAMETERS, "it has more than the 4096 bytes of the parameter memory"),
        ] {
            // Larger than all memory, and blank as far as it is looked at.
            let mut file = File::create(folder.path().join(name)).expect("created");
            file.write_all(&[0xFF; 200_000]).and_then(|()| file.set_len(1 << 42)).expect("a sparse file");
            let Opened { contents, damaged, .. } = open(folder.path(), "AXTC4CO").expect("opened all the same");
            assert_eq!((contents, damaged.len()), (initial("AXTC4CO"), 1), "{name}");
            assert!(damaged[0].to_string().contains(complaint), "{}", damaged[0]);
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_not_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join(FLASH);
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("a program of every Unix");
        assert!(made.success());
        let error = open(folder.path(), "AXTC4CO").expect_err("nobody writes into it");
        assert!(matches!(error, StateError::Io { operation: "read", .. }), "{error}");
        assert!(pipe.exists(), "it is left alone");
    }

    #[test]
    fn a_directory_of_another_product_is_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(open(folder.path(), "AXRTD8CO").expect("created"));
        let before = fs::read(folder.path().join(FLASH)).expect("flash");
        let error = open(folder.path(), "AXTC4CO").expect_err("refused").to_string();
        assert!(error.contains("is of AXRTD8CO, not of AXTC4CO") && error.contains("nothing in it"), "{error}");
        assert_eq!(fs::read(folder.path().join(FLASH)).expect("flash"), before);
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 3, "flash, parameters, lock");
    }
}
