//! The recordings that are there.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::recorder::ENDING;
use super::recording_file;
use super::regular;
use super::replay::{Recording, RecordingError};
use crate::record::Header;
use crate::time::Duration;

/// Recordings that are looked into at most, newest first.
const MOST: usize = 500;
/// Bytes of a file's end in which its last line is looked for: the longest line a recorder writes is shorter.
const TAIL: u64 = 64 << 10;

/// The recordings of a folder.
#[derive(Debug, Default, PartialEq)]
pub struct Library {
    /// Newest first.
    pub listed: Vec<Listed>,
    /// How many older ones were not looked into.
    pub older: usize,
}

/// One file with the name of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// The file.
    pub path: PathBuf,
    /// Bytes of the file.
    pub bytes: u64,
    /// What it holds, or why it cannot be read.
    pub content: Result<Content, String>,
}

/// What a recording holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// What its head says.
    pub header: Header,
    /// How long it is, where its last line can be read.
    pub length: Option<Duration>,
    /// A program, this one or another, is writing it.
    pub is_being_written: bool,
}

/// The recordings of a folder. One that is not there is empty.
///
/// # Errors
/// If the folder cannot be read.
pub fn list(folder: &Path) -> io::Result<Library> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Library::default()),
        entries => entries?,
    };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING)))
        .collect();
    // Names begin with the time.
    files.sort_by(|a, b| b.file_name().cmp(&a.file_name()));
    let older = files.len().saturating_sub(MOST);
    files.truncate(MOST);
    Ok(Library { listed: files.into_iter().filter_map(look).collect(), older })
}

/// One recording, wherever it is; `None` if there is no such file.
pub fn look(path: PathBuf) -> Option<Listed> {
    let (bytes, content) = match fs::metadata(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        Err(error) => (0, Err(error.to_string())),
        Ok(metadata) if !metadata.is_file() => (0, Err(regular::NOT_REGULAR.to_owned())),
        Ok(metadata) => (metadata.len(), content(&path)),
    };
    Some(Listed { path, bytes, content })
}

fn content(path: &Path) -> Result<Content, String> {
    let header = Recording::open_file(path).map_err(reason)?.header().clone();
    let length = length(path).ok().flatten();
    Ok(Content { header, length, is_being_written: recording_file::is_being_written(path) })
}

/// Why a recording cannot be read, for where its name is shown already.
fn reason(error: RecordingError) -> String {
    match error {
        RecordingError::File { error, .. } if error.kind() == io::ErrorKind::PermissionDenied => {
            "it may not be read".to_owned()
        }
        RecordingError::File { error, .. } => error.to_string(),
        RecordingError::Content { error, .. } => format!("line {}: {}", error.line, error.what),
    }
}

/// The moment of the last event: a recording's lines are `[seconds, kind, text]`.
fn length(path: &Path) -> io::Result<Option<Duration>> {
    let mut file = File::open(path)?;
    let bytes = file.metadata()?.len();
    file.seek(SeekFrom::Start(bytes.saturating_sub(TAIL)))?;
    let mut tail = Vec::new();
    file.take(TAIL).read_to_end(&mut tail)?;
    let tail = String::from_utf8_lossy(&tail);
    let seconds = tail.lines().rev().find_map(|line| line.strip_prefix('[')?.split(',').next()?.trim().parse().ok());
    Ok(seconds.and_then(|seconds: f64| Duration::try_from_secs_f64(seconds).ok()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Secrecy;
    use crate::host::recording_file::Existing;
    use crate::record::{Cast, Direction};
    use crate::time::Instant;

    #[test]
    fn recordings_are_listed_newest_first_and_what_cannot_be_read_with_its_reason() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, millis) in [("20260131T120000Z-a-1.cast", 1_500), ("20260201T120000Z-b-1.cast", 61_000)] {
            let header = Header { port: name.into(), settings: "115200 8N1".into(), part: 1, ..Header::default() };
            let file = File::create(folder.path().join(name)).expect("a file");
            let mut cast = Cast::begin(file, &header, Instant::ZERO).expect("begun");
            cast.push(Instant::from_millis(millis), Direction::FromUnit, Secrecy::Open, b"x\r\n").expect("written");
        }
        fs::write(folder.path().join("20260301T120000Z-c-1.cast"), "no recording").expect("written");
        fs::write(folder.path().join("notes.txt"), "no recording").expect("written");
        fs::create_dir(folder.path().join("20260101T120000Z-d-1.cast")).expect("made");
        let found = list(folder.path()).expect("listed");
        let seen: Vec<_> = found
            .listed
            .iter()
            .map(|found| found.content.as_ref().map(|content| (content.header.port.as_str(), content.length)))
            .collect();
        let millis = |millis| Some(Duration::from_millis(millis));
        assert_eq!(
            seen[1..3],
            [Ok(("20260201T120000Z-b-1.cast", millis(61_000))), Ok(("20260131T120000Z-a-1.cast", millis(1_500)))]
        );
        let why = seen[0].as_ref().expect_err("no recording");
        assert!(why.starts_with("line 1: "), "{why}");
        assert_eq!(seen[3], Err(&"it is not a regular file".to_owned()));
        assert_eq!((found.listed.len(), found.older), (4, 0));
        assert_eq!(list(&folder.path().join("nowhere")).expect("empty"), Library::default());
    }

    #[test]
    fn a_recording_is_being_written_as_long_as_its_writer_holds_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("20260131T120000Z-a-1.cast");
        let file = recording_file::create(&path, Existing::Stays).expect("created");
        let cast = Cast::begin(file, &Header::default(), Instant::ZERO).expect("begun");
        let is_being_written = || {
            let content = look(path.clone()).expect("there").content.expect("a recording");
            content.is_being_written
        };
        assert!(is_being_written());
        drop(cast);
        assert!(!is_being_written());
    }
}
