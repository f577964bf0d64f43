//! What a screen or an answered question may ask of the console.

use std::path::PathBuf;

use super::popup::Question;
use super::screens::ScreenId;
use crate::secret::Secret;
use crate::session::Command;

/// A wish. `App` performs it, or says why not.
#[derive(Debug)]
pub enum Action {
    /// Show a screen.
    Go(ScreenId),
    /// Open a link.
    Open(String),
    /// Open the lost link again.
    Reconnect,
    /// Close the link.
    Disconnect,
    /// List the ports.
    ListPorts,
    /// List a folder.
    ListFiles(PathBuf),
    /// Read and check an image.
    CheckImage(PathBuf),
    /// Put a question.
    Ask(Question),
    /// Ask the session.
    Command(Command),
    /// Open the unit's view sub-menu (it halts scanning and CAN) and watch it.
    ViewDictionary,
    /// Start the upload of the image on the load screen.
    StartLoad {
        /// The unit's password.
        password: Secret,
        /// What stands on the unit's label, where the unit cannot say it.
        product: Option<String>,
    },
    /// The report of the last upload has been read.
    DismissReport,
    /// Start minimum and maximum anew.
    RestartExtremes,
    /// Leave the program.
    Quit,
    /// Leave the unit's view sub-menu first, then the program.
    LeaveViewAndQuit,
}
