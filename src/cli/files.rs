//! Files that commands read and write.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use super::error::{CliError, Kind};
use super::output::Output;
use crate::host::save::{self, SaveError};
use crate::wire::visible;

/// Reads a text of at most `most` bytes, since a name may lead to something without an end, such as a device.
///
/// # Errors
/// If it cannot be read, has more bytes, or is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {} MiB", most >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        io::Error::new(ErrorKind::InvalidData, format!("it is not text: byte {at} is not UTF-8"))
    })
}

/// Where a command's data goes: standard output, or what `--out` names. A file that is there already is replaced only if
/// the user has said `--yes`; a pipe or a device is written to as it is.
#[derive(Debug)]
pub struct Destination {
    path: PathBuf,
    overwrite: bool,
    place: Place,
}

#[derive(Debug)]
enum Place {
    StandardOutput,
    /// A pipe or a device.
    Stream(File),
    /// Made when there is something for it.
    File(Option<File>),
}

impl Destination {
    /// A place that may be written. Call it before anything is asked of the unit, and before signals are taken, since
    /// opening a pipe waits for its reader. `None`, `-` and the system's names for it are standard output. `overwrite`:
    /// the user has said `--yes`.
    ///
    /// # Errors
    /// If something is there that should stay, there is no such folder, or the pipe or device does not open.
    pub fn admit(path: Option<&Path>, overwrite: bool) -> Result<Self, CliError> {
        let path = path.unwrap_or(Path::new("-"));
        let place = if STANDARD_OUTPUT.iter().any(|name| path == Path::new(name)) {
            Place::StandardOutput
        } else if save::is_stream(path) {
            let opened = File::options().write(true).open(path);
            Place::Stream(opened.map_err(|error| save_error(path, SaveError::Io(error)))?)
        } else {
            admit(path, overwrite)?;
            // Found out now, not after all the work.
            has_folder(path).map_err(|error| save_error(path, SaveError::Io(error)))?;
            Place::File(None)
        };
        Ok(Destination { path: path.to_owned(), overwrite, place })
    }

    /// Whether it is standard output, which then takes nothing but this data.
    pub fn is_standard_output(&self) -> bool {
        matches!(self.place, Place::StandardOutput)
    }

    /// The name, harmless on a terminal.
    pub fn shown(&self) -> String {
        shown(&self.path)
    }

    /// Writes all of it at once. A file is replaced as a whole: at any moment either the old or the new one is there.
    ///
    /// # Errors
    /// If a file that should stay has appeared meanwhile, or it cannot be written.
    pub fn save(&mut self, bytes: &[u8], output: &mut Output) -> Result<(), CliError> {
        match &self.place {
            Place::File(_) => {
                save::save(&self.path, bytes, self.overwrite).map_err(|error| save_error(&self.path, error))
            }
            Place::StandardOutput | Place::Stream(_) => self.append(bytes, output),
        }
    }

    /// Appends. The first piece makes the file; until then an older one stays.
    ///
    /// # Errors
    /// As [`save`](Destination::save).
    pub fn append(&mut self, bytes: &[u8], output: &mut Output) -> Result<(), CliError> {
        let written = match &mut self.place {
            Place::StandardOutput => return output.data(bytes),
            Place::Stream(open) | Place::File(Some(open)) => open.write_all(bytes),
            Place::File(place @ None) => {
                let mut options = File::options();
                options.write(true).create(true).truncate(true).create_new(!self.overwrite);
                options.open(&self.path).and_then(|file| place.insert(file).write_all(bytes))
            }
        };
        written.map_err(|error| {
            let exists = error.kind() == ErrorKind::AlreadyExists;
            save_error(&self.path, if exists { SaveError::Exists } else { SaveError::Io(error) })
        })
    }
}

/// Names of standard output. The last three are not opened as files: if standard output leads to a file, that would be
/// written from its beginning.
const STANDARD_OUTPUT: [&str; 4] = ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// Whether a command may write this file: to be asked before the unit is. `overwrite`: the user has said `--yes`.
///
/// # Errors
/// If something is there that should stay.
pub fn admit(path: &Path, overwrite: bool) -> Result<(), CliError> {
    save::admit(path, overwrite).map_err(|error| save_error(path, error))
}

/// Makes sure that the folder of a file is there.
///
/// # Errors
/// If it is not.
pub fn has_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if std::fs::metadata(folder)?.is_dir() { Ok(()) } else { Err(ErrorKind::NotADirectory.into()) }
}

/// A path for the screen, on which nothing in a name acts.
pub fn shown(path: &Path) -> String {
    if path == Path::new("-") {
        return "standard input".into();
    }
    visible::line(path.as_os_str().as_encoded_bytes())
}

/// A path for JSON, which can hold every character. Bytes that are not UTF-8 become U+FFFD.
pub fn named(path: &Path) -> String {
    if path == Path::new("-") { shown(path) } else { path.to_string_lossy().into_owned() }
}

/// What it means that a file is not written.
fn save_error(path: &Path, error: SaveError) -> CliError {
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
    use crate::cli::output::Remarks;

    fn nowhere() -> Output {
        Output { json: false, out: Box::new(io::sink()), err: Remarks::to(io::sink()) }
    }

    #[test]
    fn what_has_come_meanwhile_is_not_replaced_unasked() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, output) = (folder.path().join("rows.csv"), &mut nowhere());
        let place = |overwrite| Destination::admit(Some(&path), overwrite).expect("nothing is there, or may go");
        let (mut rows, mut whole) = (place(false), place(false));
        std::fs::write(&path, "somebody else's").expect("written");
        let refused = [rows.append(b"row", output), whole.save(b"all", output)];
        for refused in refused.map(|written| written.expect_err("refused")) {
            assert_eq!(refused.kind, Kind::NeedsYes, "{refused}");
        }
        let mut rows = place(true);
        assert_eq!(std::fs::read(&path).expect("there"), b"somebody else's", "no row has come");
        rows.append(b"one\n", output).and_then(|()| rows.append(b"two\n", output)).expect("appended");
        assert_eq!(std::fs::read(&path).expect("there"), b"one\ntwo\n");
        assert!(Destination::admit(Some(folder.path()), true).is_err(), "a folder");
        assert!(Destination::admit(Some(&folder.path().join("no/rows.csv")), true).is_err(), "no folder for it");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_take_what_comes_and_stay_what_they_are() {
        let output = &mut nowhere();
        let null = || Destination::admit(Some(Path::new("/dev/null")), false).expect("a device");
        null().save(b"all", output).and_then(|()| null().append(b"row", output)).expect("taken");
        assert!(save::is_stream(Path::new("/dev/null")), "no file has taken its place");
        let full = Destination::admit(Some(Path::new("/dev/full")), true);
        let error = full.and_then(|mut full| full.save(b"x", output)).expect_err("there is no room");
        assert!(error.to_string().starts_with("cannot write '/dev/full'"), "{error}");
        for name in [None, Some(Path::new("-")), Some(Path::new("/dev/stdout"))] {
            assert!(Destination::admit(name, false).expect("always there").is_standard_output());
        }
    }

    #[test]
    fn a_file_name_cannot_reach_the_terminal_as_control_codes() {
        let table = [("a\x1b[31m.S", "a^[[31m.S"), ("a\n\tb", "a^J^Ib"), ("a\u{202e}S.b", "a‹202e›S.b")];
        for (name, on_screen) in table {
            assert_eq!(shown(Path::new(name)), on_screen);
            assert_eq!(named(Path::new(name)), name, "JSON writes it so that it can be read back");
        }
        assert_eq!((shown(Path::new("-")), named(Path::new("-"))), ("standard input".into(), "standard input".into()));
    }

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
        assert_eq!(read(b"ab\xff"), Err("it is not text: byte 2 is not UTF-8".into()));
        assert!(read_text(folder.path(), 1).is_err(), "a folder");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_has_no_end_is_not_read_to_its_end() {
        assert!(read_text(Path::new("/dev/zero"), 1 << 20).is_err());
    }
}
