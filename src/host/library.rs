//! The recordings that are there.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::recorder::ENDING;
use super::replay::Recording;
use crate::record::Header;
use crate::time::Duration;

/// Recordings that are looked into at most, newest first.
const MOST: usize = 500;
/// Bytes of a file's end in which its last line is looked for: the longest line a recorder writes is shorter.
const TAIL: u64 = 64 << 10;

/// One recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// The file.
    pub path: PathBuf,
    /// What stands at its head.
    pub header: Header,
    /// How long it is, where its last line can be read.
    pub length: Option<Duration>,
    /// Bytes of the file.
    pub bytes: u64,
}

/// The recordings of a folder, newest first. What cannot be read is left out; a folder that is not there is empty.
///
/// # Errors
/// If the folder cannot be read.
pub fn list(folder: &Path) -> io::Result<Vec<Listed>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING)))
        .collect();
    // Names begin with the time.
    files.sort_by(|a, b| b.file_name().cmp(&a.file_name()));
    files.truncate(MOST);
    Ok(files.into_iter().filter_map(look).collect())
}

/// One recording, wherever it lies; `None` for what cannot be read as one.
pub fn look(path: PathBuf) -> Option<Listed> {
    // To open anything but a plain file, a pipe without a writer for example, may wait for ever.
    let bytes = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?.len();
    let header = Recording::open(&path).ok()?.header().clone();
    let length = length(&path).ok().flatten();
    Some(Listed { path, header, length, bytes })
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
    use crate::record::{Cast, Direction};
    use crate::time::Instant;

    #[test]
    fn recordings_are_listed_newest_first_and_nothing_else_is() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, millis) in [("20260131T120000Z-a-1.cast", 1_500), ("20260201T120000Z-b-1.cast", 61_000)] {
            let header = Header { port: name.into(), settings: "115200 8N1".into(), part: 1, ..Header::default() };
            let file = File::create(folder.path().join(name)).expect("a file");
            let mut cast = Cast::begin(file, &header, Instant::ZERO).expect("begun");
            cast.push(Instant::from_millis(millis), Direction::FromUnit, Secrecy::Open, b"x\r\n").expect("written");
        }
        fs::write(folder.path().join("20260301T120000Z-c-1.cast"), "no recording").expect("written");
        fs::write(folder.path().join("notes.txt"), "no recording").expect("written");
        let found = list(folder.path()).expect("listed");
        let seen: Vec<_> = found.iter().map(|found| (found.header.port.as_str(), found.length)).collect();
        let millis = |millis| Some(Duration::from_millis(millis));
        assert_eq!(seen, [("20260201T120000Z-b-1.cast", millis(61_000)), ("20260131T120000Z-a-1.cast", millis(1_500))]);
        assert_eq!(list(&folder.path().join("nowhere")).expect("empty"), []);
    }
}
