//! A recording as a link: what was said, piece by piece, from a file that is never held whole in memory.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::regular;
use crate::record::{Ending, Header, Piece, ReadError, Reader};

/// A recording being read.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    file: File,
    reader: Reader,
    header: Header,
    waiting: VecDeque<Piece>,
    ending: Option<Ending>,
    /// A fault after what waits.
    fault: Option<ReadError>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or read.
    #[error("cannot read the recording '{}': {error}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It is not a recording.
    #[error("{}:{error}", path.display())]
    Content {
        /// Which.
        path: PathBuf,
        /// Where and why.
        error: ReadError,
    },
}

fn open_any(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    if file.metadata()?.is_dir() { Err(io::ErrorKind::IsADirectory.into()) } else { Ok(file) }
}

/// Bytes read at once.
const READ: usize = 64 << 10;

impl Recording {
    /// Opens a recording and reads its head. A pipe is read like a file, and waited for.
    ///
    /// # Errors
    /// If there is no such file, or it is not a recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Recording::read_head(path, open_any)
    }

    /// The same, but never waits for anybody: only a regular file is read.
    ///
    /// # Errors
    /// If there is no such file, it is not a regular one, or it is not a recording.
    pub fn open_file(path: &Path) -> Result<Self, RecordingError> {
        Recording::read_head(path, regular::open)
    }

    fn read_head(path: &Path, open: fn(&Path) -> io::Result<File>) -> Result<Self, RecordingError> {
        let file = open(path).map_err(|error| RecordingError::File { path: path.to_owned(), error })?;
        let mut recording = Recording {
            path: path.to_owned(),
            file,
            reader: Reader::default(),
            header: Header::default(),
            waiting: VecDeque::new(),
            ending: None,
            fault: None,
        };
        // The reader gives the head first or complains.
        if let Some(Piece::Header(header)) = recording.next()? {
            recording.header = header;
        }
        Ok(recording)
    }

    /// What its head says.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The next piece; `None` at the end.
    ///
    /// # Errors
    /// If the file fails, or is not a recording from here on.
    // Not an iterator: an error ends it for good.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Result<Option<Piece>, RecordingError> {
        if let Some(piece) = self.waiting.pop_front() {
            return Ok(Some(piece));
        }
        let mut buffer = vec![0; READ];
        loop {
            if let Some(piece) = self.waiting.pop_front() {
                return Ok(Some(piece));
            }
            if let Some(error) = self.fault.clone() {
                return Err(RecordingError::Content { path: self.path.clone(), error });
            }
            if self.ending.is_some() {
                return Ok(None);
            }
            let count = match self.file.read(&mut buffer) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(RecordingError::File { path: self.path.clone(), error }),
                Ok(count) => count,
            };
            let waiting = &mut self.waiting;
            let read = if count == 0 {
                self.reader.finish(|piece| waiting.push_back(piece)).map(|ending| self.ending = Some(ending))
            } else {
                self.reader.push(&buffer[..count], |piece| waiting.push_back(piece))
            };
            // What was sound before the fault is handed out first.
            self.fault = read.err();
        }
    }

    /// How it ended, once it has.
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }
}
