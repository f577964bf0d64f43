//! Recordings: every session, unasked, in the user's state directory, within limits.
//!
//! A recording that cannot be made is a warning, once, and never the reason why a command fails.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::clock::Clock;
use super::link::Connection;
use crate::endpoint::Secrecy;
use crate::record::{Cast, Direction, Header, Record};
use crate::time::Instant;

/// Where a session is recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Plan {
    /// In the state directory, oldest recordings making room.
    Unasked,
    /// In this file, without a limit; an existing one is overwritten.
    File(PathBuf),
    /// Nowhere.
    Nothing,
}

/// The recording of one session.
#[derive(Debug)]
pub struct Recorder {
    open: Option<Open>,
    warning: Option<String>,
    /// Entries of the record that [`follow`](Recorder::follow) has written already.
    followed: u64,
}

#[derive(Debug)]
struct Open {
    cast: Cast<File>,
    path: PathBuf,
    /// What makes the next part, for recordings with a limit.
    series: Option<Series>,
}

#[derive(Debug)]
struct Series {
    folder: PathBuf,
    stem: String,
    part: u32,
    header: Header,
    limits: Limits,
}

/// How much is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Limits {
    bytes: u64,
    files: usize,
    part_bytes: u64,
}

/// What recordings may take together: months of ordinary work, and little on any disk of today. A part is small enough
/// that dropping the oldest one drops little.
const LIMITS: Limits = Limits { bytes: 200_000_000, files: 200, part_bytes: 20_000_000 };

/// Ending of a recording's name; nothing else in the directory is ever deleted.
const ENDING: &str = ".cast";

impl Recorder {
    /// Starts recording a connection. Never fails: see [`take_warning`](Recorder::take_warning).
    pub fn start(plan: &Plan, connection: &Connection, clock: Clock) -> Self {
        let header = Header {
            unix_seconds: clock.wall(clock.now()).as_second(),
            port: connection.port().to_owned(),
            settings: connection.settings().to_owned(),
            driver: connection.driver().map(str::to_owned),
        };
        Recorder::begin(plan, header, &stem(clock, connection.port()))
    }

    /// Records nothing.
    pub fn nothing() -> Self {
        Recorder { open: None, warning: None, followed: 0 }
    }

    fn begin(plan: &Plan, header: Header, stem: &str) -> Self {
        let opened = match plan {
            Plan::Nothing => return Recorder::nothing(),
            Plan::File(path) => part(path, &header).map(|cast| Open { cast, path: path.clone(), series: None }),
            Plan::Unasked => folder()
                .ok_or_else(|| io::Error::other("there is no home directory"))
                .and_then(|folder| series(folder, stem, header, LIMITS)),
        };
        match opened {
            Ok(open) => Recorder { open: Some(open), warning: None, followed: 0 },
            Err(error) => {
                let place = match plan {
                    Plan::File(path) => path.display().to_string(),
                    Plan::Unasked | Plan::Nothing => folder().unwrap_or_default().display().to_string(),
                };
                Recorder {
                    open: None,
                    warning: Some(format!("this session is not recorded: {place}: {error}")),
                    followed: 0,
                }
            }
        }
    }

    /// Writes what has come to a session's record since the last call. To be called after each input, so that a process
    /// that is killed has recorded what it has shown.
    pub fn follow(&mut self, record: &Record) {
        let from = std::mem::replace(&mut self.followed, record.entry_count());
        for entry in record.entries_from(from) {
            self.push(entry.at, entry.direction, entry.secrecy, &entry.bytes);
        }
    }

    /// Records bytes; secret ones by their number only.
    fn push(&mut self, at: Instant, direction: Direction, secrecy: Secrecy, bytes: &[u8]) {
        let Some(open) = &mut self.open else { return };
        let pushed = open.cast.push(at, direction, secrecy, bytes).and_then(|()| open.next_part_if_full());
        if let Err(error) = pushed {
            self.warning = Some(format!("the recording ends here: {}: {error}", open.path.display()));
            self.open = None;
        }
    }

    /// The file being written.
    pub fn path(&self) -> Option<&Path> {
        self.open.as_ref().map(|open| open.path.as_path())
    }

    /// What went wrong, to be told once.
    pub fn take_warning(&mut self) -> Option<String> {
        self.warning.take()
    }
}

impl Open {
    fn next_part_if_full(&mut self) -> io::Result<()> {
        let Some(series) = &mut self.series else { return Ok(()) };
        if self.cast.written() >= series.limits.part_bytes {
            series.part += 1;
            (self.cast, self.path) = series.open()?;
        }
        Ok(())
    }
}

impl Series {
    fn open(&self) -> io::Result<(Cast<File>, PathBuf)> {
        make_room(&self.folder, self.limits)?;
        let name = match self.part {
            1 => format!("{}{ENDING}", self.stem),
            part => format!("{}-{part}{ENDING}", self.stem),
        };
        let path = self.folder.join(name);
        Ok((part(&path, &self.header)?, path))
    }
}

fn series(folder: PathBuf, stem: &str, header: Header, limits: Limits) -> io::Result<Open> {
    fs::create_dir_all(&folder)?;
    let series = Series { folder, stem: stem.to_owned(), part: 1, header, limits };
    let (cast, path) = series.open()?;
    Ok(Open { cast, path, series: Some(series) })
}

fn part(path: &Path, header: &Header) -> io::Result<Cast<File>> {
    let mut options = File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    {
        // What a unit says is its owner's business.
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    let file = options.open(path)?;
    // Tells other sessions that this one is being written. Where locks do not work, its age protects it well enough.
    let _ = file.try_lock_shared();
    Cast::begin(file, header)
}

/// Deletes the oldest recordings until a full part more fits. Their names begin with the time, so their order is their
/// age. One that is being written is left alone.
fn make_room(folder: &Path, limits: Limits) -> io::Result<()> {
    let mut recordings: Vec<(PathBuf, u64)> = fs::read_dir(folder)?
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().ends_with(ENDING))
        .filter_map(|entry| Some((entry.path(), entry.metadata().ok().filter(fs::Metadata::is_file)?.len())))
        .collect();
    recordings.sort();
    let mut bytes: u64 = recordings.iter().map(|&(_, bytes)| bytes).sum();
    let mut files = recordings.len();
    for (path, size) in recordings {
        if bytes + limits.part_bytes <= limits.bytes && files < limits.files {
            break;
        }
        let written = File::open(&path).is_ok_and(|file| file.try_lock().is_err());
        if !written && fs::remove_file(&path).is_ok() {
            bytes -= size;
            files -= 1;
        }
    }
    Ok(())
}

/// Where recordings are kept.
pub fn folder() -> Option<PathBuf> {
    state_folder().map(|state| state.join("recordings"))
}

/// Where this program keeps what outlives it, by the customs of the system.
pub fn state_folder() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = if cfg!(windows) {
        variable("LOCALAPPDATA")?
    } else if cfg!(target_os = "macos") {
        variable("HOME")?.join("Library/Application Support")
    } else {
        variable("XDG_STATE_HOME").or_else(|| Some(variable("HOME")?.join(".local/state")))?
    };
    Some(state.join("axcon"))
}

/// Time, port and process: `20260131T120000Z-ttyUSB0-4711`.
fn stem(clock: Clock, port: &str) -> String {
    let time = clock.wall(clock.now()).strftime("%Y%m%dT%H%M%SZ").to_string();
    let port = port.strip_prefix("/dev/").unwrap_or(port);
    let port: String = port.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(40).collect();
    format!("{time}-{port}-{}", std::process::id())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header { unix_seconds: 0, port: "u0".into(), settings: "115200 8N1".into(), driver: None }
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("listed")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn the_oldest_recordings_make_room_and_nothing_else_does() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["20200101T000000Z-a-1.cast", "20200102T000000Z-a-1.cast", "20200103T000000Z-a-1.cast"] {
            fs::write(folder.path().join(name), [0; 100]).expect("written");
        }
        fs::write(folder.path().join("00-notes.txt"), [0; 1000]).expect("written");
        let limits = Limits { bytes: 1_000, files: 3, part_bytes: 500 };
        let open = series(folder.path().to_owned(), "20260131T120000Z-u0-7", header(), limits).expect("opened");
        assert_eq!(
            names(folder.path()),
            ["00-notes.txt", "20200102T000000Z-a-1.cast", "20200103T000000Z-a-1.cast", "20260131T120000Z-u0-7.cast"]
        );
        drop(open);
    }

    #[test]
    fn a_long_session_goes_on_in_parts_and_its_first_parts_go_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let limits = Limits { bytes: 2_000, files: 100, part_bytes: 500 };
        let open = series(folder.path().to_owned(), "20260131T120000Z-u0-7", header(), limits).expect("opened");
        let mut recorder = Recorder { open: Some(open), warning: None, followed: 0 };
        for round in 0..100 {
            recorder.push(Instant::from_millis(round), Direction::FromUnit, Secrecy::Open, &[b'x'; 50]);
        }
        assert_eq!(recorder.take_warning(), None);
        let sizes: u64 = fs::read_dir(folder.path())
            .expect("listed")
            .map(|e| e.expect("entry").metadata().expect("size").len())
            .sum();
        assert!(sizes <= 2_200, "{sizes}");
        assert!(names(folder.path()).len() >= 2);
    }

    #[test]
    fn a_recording_that_cannot_be_made_is_a_warning_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut recorder = Recorder::begin(&Plan::File(folder.path().to_owned()), header(), "x");
        recorder.push(Instant::ZERO, Direction::ToUnit, Secrecy::Open, b"m");
        let warning = recorder.take_warning().expect("a warning");
        assert!(warning.starts_with("this session is not recorded: "), "{warning}");
        assert_eq!(recorder.take_warning(), None);
        assert_eq!(recorder.path(), None);
    }
}
