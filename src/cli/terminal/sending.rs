//! A file on its way to the unit, a piece at a time.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::cli::error::{CliError, Kind};
use crate::cli::files::shown;

/// What Enter is on the line, and the line ends of a file or a pipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum NewLine {
    /// CR, as the units want it (manuals, chapter 4).
    Cr,
    /// LF.
    Lf,
    /// CR LF.
    Crlf,
    /// Whatever the file or the pipe has; Enter is CR.
    Keep,
}

impl NewLine {
    /// What a key is on the line.
    pub fn of_key(self, key: &u8) -> &[u8] {
        match (key, self) {
            (b'\r', NewLine::Lf) => b"\n",
            (b'\r', NewLine::Crlf) => b"\r\n",
            _ => std::slice::from_ref(key),
        }
    }

    fn text(self) -> &'static [u8] {
        match self {
            NewLine::Cr | NewLine::Keep => b"\r",
            NewLine::Lf => b"\n",
            NewLine::Crlf => b"\r\n",
        }
    }
}

/// Gives text the line ends of the line, wherever it is cut into pieces.
pub struct LineEnds {
    new_line: NewLine,
    /// The last byte of the previous piece was a CR: an LF at the beginning of the next belongs to it.
    after_return: bool,
}

impl LineEnds {
    /// A text from its beginning.
    pub fn new(new_line: NewLine) -> Self {
        LineEnds { new_line, after_return: false }
    }

    /// The next piece for the line; nothing if it is the rest of a line end.
    pub fn converted(&mut self, bytes: &[u8]) -> Vec<u8> {
        if self.new_line == NewLine::Keep {
            return bytes.to_vec();
        }
        let mut piece = Vec::with_capacity(bytes.len() + 8);
        for &byte in bytes {
            let follows_return = std::mem::replace(&mut self.after_return, byte == b'\r');
            match byte {
                b'\n' if follows_return => {}
                b'\r' | b'\n' => piece.extend_from_slice(self.new_line.text()),
                _ => piece.push(byte),
            }
        }
        piece
    }
}

/// A file being sent.
pub struct Sending {
    path: PathBuf,
    file: File,
    line_ends: LineEnds,
    sent: u64,
}

/// Bytes of a piece.
const PIECE: usize = 256;

impl Sending {
    /// A file from its beginning.
    ///
    /// # Errors
    /// If it cannot be opened, or is not a regular file: while waiting for a pipe, neither the unit nor the user would be heard.
    pub fn open(path: &Path, new_line: NewLine) -> Result<Self, CliError> {
        match std::fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(failed(path, ErrorKind::IsADirectory.into())),
            Ok(found) if !found.is_file() => {
                let message = format!("cannot send '{}': it is not a file", shown(path));
                return Err(CliError::message(Kind::Failed, message)
                    .hint("what a program writes is sent from standard input: PROGRAM | axcon terminal"));
            }
            Ok(_) | Err(_) => {}
        }
        let file = File::open(path).map_err(|error| CliError { kind: Kind::Usage, ..failed(path, error) })?;
        Ok(Sending { path: path.to_owned(), file, line_ends: LineEnds::new(new_line), sent: 0 })
    }

    /// The next bytes for the line; none at the end.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next(&mut self) -> Result<Vec<u8>, CliError> {
        let mut buffer = [0; PIECE];
        loop {
            let count = match self.file.read(&mut buffer) {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(failed(&self.path, error)),
                Ok(count) => count,
            };
            let piece = self.line_ends.converted(&buffer[..count]);
            if count == 0 || !piece.is_empty() {
                self.sent += piece.len() as u64;
                return Ok(piece);
            }
        }
    }

    /// Bytes handed out so far.
    pub fn sent(&self) -> u64 {
        self.sent
    }
}

fn failed(path: &Path, error: std::io::Error) -> CliError {
    CliError::new(Kind::Failed, anyhow::Error::new(error).context(format!("cannot send '{}'", shown(path))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_ends_of_a_file_become_those_of_the_line_wherever_it_is_cut() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        // The CR LF of some line falls between two pieces.
        for shift in 0..4 {
            let line = "x".repeat(60);
            let text = "y".repeat(shift) + &format!("{line}\r\n{line}\n{line}\r").repeat(20);
            std::fs::write(&path, &text).expect("written");
            for (new_line, end) in [(NewLine::Cr, "\r"), (NewLine::Crlf, "\r\n"), (NewLine::Lf, "\n")] {
                let mut sending = Sending::open(&path, new_line).expect("opened");
                let mut all = Vec::new();
                loop {
                    let piece = sending.next().expect("read");
                    if piece.is_empty() {
                        break;
                    }
                    all.extend(piece);
                }
                let expected = "y".repeat(shift) + &format!("{line}{end}").repeat(60);
                assert_eq!(String::from_utf8(all).expect("ASCII"), expected, "{new_line:?}, {shift}");
            }
        }
        assert!(Sending::open(folder.path(), NewLine::Cr).is_err(), "a folder is not a file");
        #[cfg(unix)]
        assert!(Sending::open(Path::new("/dev/zero"), NewLine::Cr).is_err(), "nor is what has no end");
    }

    #[test]
    fn enter_is_what_the_line_wants_and_every_other_key_itself() {
        assert_eq!(NewLine::Crlf.of_key(&b'\r'), b"\r\n");
        assert_eq!(NewLine::Keep.of_key(&b'\r'), b"\r");
        for key in 0..=255u8 {
            assert!(key == b'\r' || NewLine::Lf.of_key(&key) == [key]);
        }
    }
}
