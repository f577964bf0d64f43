//! How the writing of a stream ends before it is enough.

use crate::cli::error::{CliError, Kind};

/// Why no more rows are written, though more were wanted.
#[derive(Debug)]
pub enum End {
    /// The reader of our output has enough, which is as good an end.
    ReaderGone,
    /// The link is lost. It may come back.
    LinkLost(CliError),
    /// The unit is silent, or another one answers: nobody is there whose stream could be left as it was found.
    UnitGone(CliError),
    /// Anything else, an interrupt too. The unit is there.
    Failed(CliError),
}

impl From<CliError> for End {
    /// What a conversation failed with.
    fn from(error: CliError) -> Self {
        match error.kind {
            Kind::PortGone => End::LinkLost(error),
            _ => End::Failed(error),
        }
    }
}

impl End {
    /// What it is to the user.
    ///
    /// # Errors
    /// Always, unless it was the reader.
    pub fn result(self) -> Result<(), CliError> {
        match self {
            End::ReaderGone => Ok(()),
            End::LinkLost(error) | End::UnitGone(error) | End::Failed(error) => Err(error),
        }
    }
}
