//! Recordings: every session, unasked, in the user's state directory, within limits.
//!
//! A recording that cannot be made is a warning, once, and never the reason why a command fails.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::clock::Clock;
use super::link::Connection;
use super::recording_file::{self, Existing};
use crate::endpoint::Secrecy;
use crate::record::{Cast, Direction, Header, Record, Tally};
use crate::time::{Duration, Instant};

/// Where a session is recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Plan {
    /// In the state directory, the oldest recordings making room.
    Unasked,
    /// In this file, without a limit; an existing one is overwritten, unless it is being written.
    File(PathBuf),
    /// Nowhere.
    Nothing,
}

impl Plan {
    /// Where a later session of the same program is recorded, the first being number 1: beside the file of the first
    /// one, whose recording stays, under a new name.
    pub fn of_session(&self, number: u32) -> Plan {
        match self {
            Plan::File(first) if number > 1 => {
                let stem = first.file_stem().unwrap_or_default().to_string_lossy();
                let ending = first.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
                let named = |number: u32| first.with_file_name(format!("{stem}-{number}{ending}"));
                Plan::File((number..).map(named).find(|path| !path.exists()).unwrap_or_else(|| named(number)))
            }
            plan => plan.clone(),
        }
    }
}

/// The recording of one session.
#[derive(Debug, Default)]
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
    tally: Tally,
    /// The latest moment that was recorded.
    last: Instant,
}

#[derive(Debug)]
struct Series {
    folder: PathBuf,
    stem: String,
    part: u32,
    /// The first part's head, and the moment it began.
    header: Header,
    begun: Instant,
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
const LIMITS: Limits = Limits { bytes: 200_000_000, files: 20_000, part_bytes: 20_000_000 };

/// Ending of a recording's name; nothing else in the directory is ever deleted.
pub(super) const ENDING: &str = ".cast";

/// Why there is no recording, and where it should have been, where there is a place for it.
fn unrecorded(place: Option<&Path>, error: &io::Error) -> String {
    let place = place.map_or_else(String::new, |place| format!("{}: ", place.display()));
    format!("this session is not recorded: {place}{error}")
}

impl Recorder {
    /// Starts recording a connection. Never fails: see [`take_warning`](Recorder::take_warning).
    pub fn start(plan: &Plan, connection: &Connection, clock: Clock) -> Self {
        Recorder::start_ahead(plan, connection, clock, Duration::ZERO)
    }

    /// The same for a program whose time is this far ahead of the clock: what it records is dated by its own time.
    pub fn start_ahead(plan: &Plan, connection: &Connection, clock: Clock, ahead: Duration) -> Self {
        let now = clock.now();
        let header = Header {
            unix_millis: clock.wall(now).as_millisecond(),
            port: connection.port().to_owned(),
            settings: connection.settings().to_owned(),
            driver: connection.driver().map(str::to_owned),
            adapter: connection.adapter().cloned(),
            part: 1,
        };
        Recorder::begin(plan, header, now + ahead, &stem(clock, connection.port()))
    }

    /// Records nothing.
    pub fn nothing() -> Self {
        Recorder::default()
    }

    fn begin(plan: &Plan, header: Header, now: Instant, stem: &str) -> Self {
        let opened = match plan {
            Plan::Nothing => return Recorder::nothing(),
            Plan::File(path) => {
                part(path, &header, now, Existing::IsReplaced).map(|cast| Open::new(cast, path.clone(), now, None))
            }
            Plan::Unasked => folder()
                .ok_or_else(|| io::Error::other("there is no home directory"))
                .and_then(|folder| series(folder, stem, header, now, LIMITS)),
        };
        match opened {
            Ok(open) => Recorder { open: Some(open), ..Recorder::default() },
            Err(error) => {
                let place = match plan {
                    Plan::File(path) => Some(path.clone()),
                    Plan::Unasked | Plan::Nothing => folder(),
                };
                Recorder { warning: Some(unrecorded(place.as_deref(), &error)), ..Recorder::default() }
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

    /// Puts a remark into the recording.
    pub fn mark(&mut self, at: Instant, text: &str) {
        self.write(at, |open| open.cast.mark(at, text));
    }

    /// Records bytes; secret ones by their number only.
    fn push(&mut self, at: Instant, direction: Direction, secrecy: Secrecy, bytes: &[u8]) {
        self.write(at, |open| {
            open.tally.count(at, direction, bytes);
            open.cast.push(at, direction, secrecy, bytes)
        });
    }

    fn write(&mut self, at: Instant, write: impl FnOnce(&mut Open) -> io::Result<()>) {
        let Some(open) = &mut self.open else { return };
        open.last = open.last.max(at);
        if let Err(error) = write(open).and_then(|()| open.next_part_if_full()) {
            self.warning = Some(format!("the recording ends here: {error} ({})", open.path.display()));
            self.open = None;
        }
    }

    /// The file being written.
    pub fn path(&self) -> Option<&Path> {
        self.open.as_ref().map(|open| open.path.as_path())
    }

    /// What went wrong, once.
    pub fn take_warning(&mut self) -> Option<String> {
        self.warning.take()
    }
}

impl Drop for Open {
    /// The numbers of the session are at its end; those of a killed one can be counted from its bytes.
    fn drop(&mut self) {
        let _ = self.cast.mark(self.last, &format!("end: {}", self.tally.summary(self.last)));
    }
}

impl Open {
    fn new(cast: Cast<File>, path: PathBuf, begun: Instant, series: Option<Series>) -> Self {
        Open { cast, path, series, tally: Tally::default(), last: begun }
    }

    fn next_part_if_full(&mut self) -> io::Result<()> {
        let Some(series) = &mut self.series else { return Ok(()) };
        if self.cast.written() >= series.limits.part_bytes {
            series.part += 1;
            (self.cast, self.path) = series.open(self.last)?;
        }
        Ok(())
    }
}

impl Series {
    fn open(&self, now: Instant) -> io::Result<(Cast<File>, PathBuf)> {
        make_room(&self.folder, self.limits)?;
        // The parts of a session sort in order after its first one, whose name ends here.
        let name = match self.part {
            1 => format!("{}{ENDING}", self.stem),
            part => format!("{}.p{part:05}{ENDING}", self.stem),
        };
        let path = self.folder.join(name);
        let later = i64::try_from(now.since(self.begun).as_millis()).unwrap_or(i64::MAX);
        let unix_millis = self.header.unix_millis.saturating_add(later);
        let header = Header { part: self.part, unix_millis, ..self.header.clone() };
        Ok((part(&path, &header, now, Existing::Stays)?, path))
    }
}

fn series(folder: PathBuf, stem: &str, header: Header, begun: Instant, limits: Limits) -> io::Result<Open> {
    fs::create_dir_all(&folder)?;
    let mut series = Series { folder, stem: stem.to_owned(), part: 1, header, begun, limits };
    for number in 2.. {
        match series.open(begun) {
            // Another recording of this process began in the same second, of a port whose name ends the same.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number <= MOST_NAMESAKES => {
                series.stem = format!("{stem}-{number}");
            }
            opened => {
                let (cast, path) = opened?;
                return Ok(Open::new(cast, path, begun, Some(series)));
            }
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Recordings of one name at most: as many links as one program could possibly open within a second.
const MOST_NAMESAKES: u32 = 1000;

fn part(path: &Path, header: &Header, begun: Instant, existing: Existing) -> io::Result<Cast<File>> {
    Cast::begin(recording_file::create(path, existing)?, header, begun)
}

/// Deletes the oldest recordings until a full part more fits. Their names begin with the time, so their order is their
/// age. A recording that is being written is left alone.
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
        if !recording_file::is_being_written(&path) && fs::remove_file(&path).is_ok() {
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
    format!("{time}-{}-{}", name_of_port(port), std::process::id())
}

/// A port's name in the name of a file. Of a long one its end, where ports of one adapter differ.
fn name_of_port(port: &str) -> String {
    let port = port.strip_prefix("/dev/").unwrap_or(port);
    let name: Vec<char> = port.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    name[name.len().saturating_sub(LONGEST_NAME)..].iter().collect()
}

/// Characters of a port's name in that of a file.
const LONGEST_NAME: usize = 40;

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn header() -> Header {
        Header { port: "u0".into(), settings: "115200 8N1".into(), part: 1, ..Header::default() }
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
        let open =
            series(folder.path().to_owned(), "20260131T120000Z-u0-7", header(), Instant::ZERO, limits).expect("opened");
        assert_eq!(
            names(folder.path()),
            ["00-notes.txt", "20200102T000000Z-a-1.cast", "20200103T000000Z-a-1.cast", "20260131T120000Z-u0-7.cast"]
        );
        drop(open);
    }

    #[test]
    fn a_recording_that_is_being_written_does_not_make_room() {
        let folder = tempfile::tempdir().expect("a folder");
        let limits = Limits { bytes: 10_000, files: 1, part_bytes: 500 };
        let open =
            |stem: &str| series(folder.path().to_owned(), stem, header(), Instant::ZERO, limits).expect("opened");
        let older = open("20260131T120000Z-u0-7");
        let newer = open("20260131T120001Z-u0-8");
        assert_eq!(names(folder.path()).len(), 2);
        drop((older, newer));
        drop(open("20260131T120002Z-u0-9"));
        assert_eq!(names(folder.path()), ["20260131T120002Z-u0-9.cast"]);
    }

    #[test]
    fn a_long_session_goes_on_in_parts_and_its_first_parts_go_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let limits = Limits { bytes: 2_000, files: 100, part_bytes: 500 };
        let open =
            series(folder.path().to_owned(), "20260131T120000Z-u0-7", header(), Instant::ZERO, limits).expect("opened");
        let mut recorder = Recorder { open: Some(open), ..Recorder::default() };
        for round in 0..100 {
            recorder.push(Instant::from_millis(round), Direction::FromUnit, Secrecy::Open, &[b'x'; 50]);
        }
        assert_eq!(recorder.take_warning(), None);
        let sizes: u64 = fs::read_dir(folder.path())
            .expect("listed")
            .map(|e| e.expect("entry").metadata().expect("size").len())
            .sum();
        assert!(sizes <= 2_200, "{sizes}");
        let kept = names(folder.path());
        assert!(kept.len() >= 2, "{kept:?}");
        // The last parts are there, and the first is not.
        let number = |name: &String| name.split(".p").nth(1).and_then(|rest| rest[..5].parse::<u32>().ok());
        let numbers: Vec<u32> = kept.iter().map(|name| number(name).expect("a later part")).collect();
        assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
        drop(recorder);
        let last = std::fs::read_to_string(folder.path().join(&kept[kept.len() - 1])).expect("the last part");
        assert!(last.contains("\"part\":") && last.contains("end: 5000 bytes received"), "{last}");
    }

    #[test]
    fn as_much_is_kept_as_the_documents_say() {
        assert_eq!(LIMITS, Limits { bytes: 200_000_000, files: 20_000, part_bytes: 20_000_000 });
        let words = |page: &str| page.split_whitespace().collect::<Vec<_>>().join(" ");
        let page = words(include_str!("../../docs/recordings.md"));
        for said in ["reaches 20 MB continues in another part", "take at most 200 MB in 20,000 files"] {
            assert!(page.contains(said), "no '{said}' in docs/recordings.md");
        }
        assert!(words(include_str!("../../README.md")).contains("200 MB of them at most"));
    }

    #[test]
    fn recordings_of_one_second_have_files_of_their_own() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = || series(folder.path().to_owned(), "20260131T120000Z-u0-7", header(), Instant::ZERO, LIMITS);
        let all = [open().expect("the first"), open().expect("the second"), open().expect("the third")];
        assert_eq!(
            names(folder.path()),
            ["20260131T120000Z-u0-7-2.cast", "20260131T120000Z-u0-7-3.cast", "20260131T120000Z-u0-7.cast"]
        );
        drop(all);
        let long = "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1.4.2:1.0-port0";
        assert_eq!(name_of_port(long), "h_pci_0000_00_14_0_usb_0_1_4_2_1_0_port0");
    }

    /// A recording that ends with the next byte: there is no place for its next part.
    #[cfg(unix)]
    pub(in crate::host) fn doomed() -> Recorder {
        let folder = tempfile::tempdir().expect("a folder");
        let limits = Limits { bytes: 2_000, files: 100, part_bytes: 1 };
        let open = series(folder.path().to_owned(), "x", header(), Instant::ZERO, limits).expect("opened");
        Recorder { open: Some(open), ..Recorder::default() }
    }

    #[test]
    fn why_nothing_is_recorded_is_said_also_where_there_is_no_place_for_it() {
        let said = |place: Option<&str>| unrecorded(place.map(Path::new), &io::Error::other("it is full"));
        assert_eq!(said(Some("/a")), "this session is not recorded: /a: it is full");
        assert_eq!(said(None), "this session is not recorded: it is full");
    }

    #[test]
    fn a_recording_that_cannot_be_made_is_a_warning_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut recorder = Recorder::begin(&Plan::File(folder.path().to_owned()), header(), Instant::ZERO, "x");
        recorder.push(Instant::ZERO, Direction::ToUnit, Secrecy::Open, b"m");
        let warning = recorder.take_warning().expect("a warning");
        assert!(warning.starts_with("this session is not recorded: "), "{warning}");
        assert_eq!(recorder.take_warning(), None);
        assert_eq!(recorder.path(), None);
    }
}
