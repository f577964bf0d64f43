//! What a screen or an answered question may ask of the console.

use std::path::PathBuf;

use super::input::Playback;
use super::popup::{PickedFor, Question};
use super::screens::ScreenId;
use crate::image::DefectId;
use crate::secret::Secret;
use crate::session::Command;
use crate::time::Instant;

/// A wish. `App` performs it, or says why not.
#[derive(Debug)]
pub enum Action {
    /// Show a screen.
    Go(ScreenId),
    /// Open a link.
    Open(String),
    /// Open the lost link again.
    Reconnect,
    /// Close the link, the unit left in order.
    Disconnect {
        /// The link to open instead.
        then: Option<String>,
    },
    /// List the ports.
    ListPorts,
    /// List a folder.
    ListFiles(PathBuf),
    /// Read and check an image.
    CheckImage(PathBuf),
    /// Check the image once more, and allow this error.
    Allow(DefectId),
    /// Say why a key does nothing now.
    Tell(String),
    /// Put a question.
    Ask(Question),
    /// Ask the session.
    Command(Command),
    /// Open the unit's view sub-menu (it halts scanning and CAN) and watch it on the terminal.
    ViewDictionary,
    /// Start the upload of the image on the load screen.
    StartLoad {
        /// The unit's password; a unit that waits in its loader asks for none.
        password: Option<Secret>,
        /// What the unit's label says, where the unit cannot.
        product: Option<String>,
    },
    /// The unit is not the one that the note of an upload is about.
    OtherUnit,
    /// The report of the last upload has been read.
    DismissReport,
    /// Restart minimum and maximum.
    RestartExtremes,
    /// Mark this moment, or an earlier one, in chart and recording.
    Mark(Option<Instant>),
    /// Show only what has these words, or go to the newest line that has.
    Find(String),
    /// Write the stream to a new file from now on, the rows kept first.
    ExportStream(PathBuf),
    /// No more rows to the file.
    EndExport,
    /// Write the object dictionary to a new file, in the format its name says.
    ExportDictionary(PathBuf),
    /// Compare the object dictionary with a saved dump.
    Compare(PathBuf),
    /// Ask for a file that is there.
    PickFile(PickedFor),
    /// Read a file that the unit shall get as it is.
    ReadToSend(PathBuf),
    /// Send it.
    SendFile {
        /// Its name.
        name: String,
        /// What is in it.
        bytes: Vec<u8>,
    },
    /// List the recordings.
    ListRecordings,
    /// Play a recording differently.
    Play(Playback),
    /// Hold the line low for a moment.
    Break,
    /// Have something done to the emulated unit.
    Order(String),
    /// Leave the program, the unit left in order.
    Quit,
}
