//! Uploads that have begun and not ended well, in the user's state directory.
//!
//! A loader that waits for a file does not say which product it belongs to. The user who asked for it knew: so the product is
//! noted, with the port, before the loader is entered, and the note is removed when the new software runs. A program
//! that is killed in between leaves the note, and the next upload on that port needs no more than being asked for.

use std::collections::BTreeMap;
use std::fs::{self, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::save::{SaveError, save};
use crate::version::Version;

/// The notes.
#[derive(Clone, Debug)]
pub struct Journal {
    file: PathBuf,
}

/// One upload that has begun.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Note {
    /// The unit's product, as it was known before its loader was entered.
    pub product: String,
    /// The image's file.
    pub image: String,
    /// When, in seconds since 1970.
    pub unix_seconds: i64,
    /// The software the unit ran before, where it said so: older software should not take its place unasked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ran: Option<Version>,
}

#[derive(Default, Serialize, Deserialize)]
struct Notes {
    schema: String,
    uploads: BTreeMap<String, Note>,
}

const SCHEMA: &str = "axcon.journal/1";

/// Notes kept at most; the oldest go first. One for each port that was ever left in the middle.
const MOST_NOTES: usize = 200;

/// Bytes of a journal that are read at most: far more than the notes take.
const LARGEST: u64 = 1 << 20;

/// How long another program may be at the journal: it takes milliseconds, unless somebody has stopped it there.
const LOCK_PATIENCE: Duration = Duration::from_secs(2);

/// How often it is looked whether it still is.
const LOCK_RETRY: Duration = Duration::from_millis(5);

impl Journal {
    /// The user's journal; `None` where there is no home directory.
    pub fn of_user() -> Option<Self> {
        super::recorder::state_folder().map(|folder| Journal { file: folder.join("uploads.json") })
    }

    /// A journal in this file.
    pub fn at(file: PathBuf) -> Self {
        Journal { file }
    }

    /// What is noted for a port.
    pub fn note(&self, port: &str) -> Option<Note> {
        self.read().uploads.remove(port)
    }

    /// Notes that an upload is about to begin.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub fn begin(&self, port: &str, note: Note) -> io::Result<()> {
        let _alone = self.lock()?;
        let mut notes = self.read();
        notes.uploads.insert(port.to_owned(), note);
        while notes.uploads.len() > MOST_NOTES {
            let oldest = notes.uploads.iter().min_by_key(|(_, note)| note.unix_seconds).map(|(port, _)| port.clone());
            oldest.and_then(|oldest| notes.uploads.remove(&oldest));
        }
        self.write(notes)
    }

    /// Forgets a port: its unit runs.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub fn end(&self, port: &str) -> io::Result<()> {
        let _alone = self.lock()?;
        let mut notes = self.read();
        if notes.uploads.remove(port).is_some() { self.write(notes) } else { Ok(()) }
    }

    /// Waits until no other upload, of this program or another, is at the journal; given back with the file. One that
    /// stays there is not waited for: an upload must not hang for a note.
    fn lock(&self) -> io::Result<fs::File> {
        let folder = self.file.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let lock = fs::File::options().create(true).append(true).open(self.file.with_extension("lock"))?;
        let give_up = Instant::now() + LOCK_PATIENCE;
        loop {
            match lock.try_lock() {
                Err(TryLockError::WouldBlock) if Instant::now() < give_up => std::thread::sleep(LOCK_RETRY),
                // Without it, two uploads at the same moment may lose a note, which costs a question later.
                Err(TryLockError::WouldBlock) => return Ok(lock),
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => return Ok(lock),
                Err(TryLockError::Error(error)) => return Err(error),
                Ok(()) => return Ok(lock),
            }
        }
    }

    /// A journal that cannot be read holds nothing: the user is asked for the product then, and no harm is done.
    fn read(&self) -> Notes {
        let small = fs::metadata(&self.file).is_ok_and(|metadata| metadata.len() <= LARGEST);
        let text = if small { fs::read(&self.file).unwrap_or_default() } else { Vec::new() };
        serde_json::from_slice(&text).unwrap_or_default()
    }

    /// Replaces the file as a whole: old or new, never torn.
    fn write(&self, mut notes: Notes) -> io::Result<()> {
        SCHEMA.clone_into(&mut notes.schema);
        let text = serde_json::to_string_pretty(&notes)? + "\n";
        save(&self.file, text.as_bytes(), true).map_err(|error| match error {
            SaveError::Io(error) => error,
            SaveError::Exists | SaveError::NotAFile => io::Error::other(error.to_string()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note(unix_seconds: i64) -> Note {
        Note { product: "AXTC4CO".into(), image: "a.S".into(), unix_seconds, ran: None }
    }

    #[test]
    fn a_program_that_stays_at_the_journal_stops_nobody() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = Journal::at(folder.path().join("uploads.json"));
        let _stays = journal.lock().expect("locked");
        journal.begin("/dev/ttyUSB0", note(1)).expect("noted all the same");
        assert_eq!(journal.note("/dev/ttyUSB0"), Some(note(1)));
    }

    #[test]
    fn a_note_lasts_until_the_upload_has_ended() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = Journal::at(folder.path().join("below/uploads.json"));
        assert_eq!(journal.note("u0"), None);
        journal.begin("u0", note(1)).expect("written");
        journal.begin("u1", note(2)).expect("written");
        assert_eq!(journal.note("u0"), Some(note(1)));
        journal.end("u0").expect("written");
        assert_eq!((journal.note("u0"), journal.note("u1")), (None, Some(note(2))));
    }

    #[test]
    fn uploads_at_the_same_moment_lose_no_note() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("uploads.json");
        std::thread::scope(|scope| {
            for number in 0..8 {
                let file = file.clone();
                scope.spawn(move || {
                    let journal = Journal::at(file);
                    for round in 0..10 {
                        journal.begin(&format!("u{number}-{round}"), note(1)).expect("written");
                    }
                });
            }
        });
        let journal = Journal::at(file);
        for number in 0..8 {
            assert!((0..10).all(|round| journal.note(&format!("u{number}-{round}")).is_some()), "{number}");
        }
    }

    #[test]
    fn what_ran_before_is_noted_and_missing_in_notes_of_older_programs() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = Journal::at(folder.path().join("uploads.json"));
        let old =
            r#"{"schema":"axcon.journal/1","uploads":{"u0":{"product":"AXTC4CO","image":"a.S","unix_seconds":1}}}"#;
        fs::write(folder.path().join("uploads.json"), old).expect("written");
        assert_eq!(journal.note("u0"), Some(note(1)));
        let ran = Note { ran: Some(Version::new(1, 2, 0)), ..note(2) };
        journal.begin("u0", ran.clone()).expect("written");
        assert_eq!(journal.note("u0"), Some(ran));
    }

    #[test]
    fn the_oldest_notes_go_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = Journal::at(folder.path().join("uploads.json"));
        for number in 0..=MOST_NOTES {
            journal.begin(&format!("u{number}"), note(number as i64)).expect("written");
        }
        assert_eq!(journal.note("u0"), None);
        assert_eq!(journal.note("u1"), Some(note(1)));
    }

    #[test]
    fn a_journal_that_makes_no_sense_holds_nothing_and_is_rewritten() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("uploads.json");
        fs::write(&file, b"\xff{]").expect("written");
        let journal = Journal::at(file);
        assert_eq!(journal.note("u0"), None);
        journal.begin("u0", note(1)).expect("written");
        assert_eq!(journal.note("u0"), Some(note(1)));
    }
}
