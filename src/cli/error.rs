//! What goes wrong, for a person and for a script: kind, causes, hints, exit code.
//!
//! Everything below `cli` says what happened and to what; only here is added what to do next.

use std::fmt;

use super::output::Closed;

/// Why a command ended without success.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Something without a number of its own.
    Failed,
    /// The command line makes no sense.
    Usage,
    /// The command destroys or halts something and nobody said yes.
    NeedsYes,
    /// There is no serial port.
    PortNone,
    /// There are several and none was named.
    PortAmbiguous,
    /// The named port does not exist, or is not a serial port.
    PortMissing,
    /// The system denies access.
    PortDenied,
    /// Another program has the port.
    PortBusy,
    /// The port went away.
    PortGone,
    /// The port does not do the line rate that was asked for.
    PortRate,
    /// No answer in time.
    NoAnswer,
    /// The image has defects, cannot be read, or is not for this unit.
    ImageRefused,
    /// The unit refused.
    UnitRefused,
    /// The upload failed and the unit waits in its loader.
    UploadFailedLoader,
    /// The upload failed and the state of the unit is unknown.
    UploadFailedUnknown,
    /// The unit runs, but not what was sent.
    WrongApplication,
    /// Interrupted by the user.
    Interrupted,
}

impl Kind {
    /// All kinds, for documentation and tests.
    pub const ALL: [Kind; 17] = [
        Kind::Failed,
        Kind::Usage,
        Kind::NeedsYes,
        Kind::PortNone,
        Kind::PortAmbiguous,
        Kind::PortMissing,
        Kind::PortDenied,
        Kind::PortBusy,
        Kind::PortGone,
        Kind::PortRate,
        Kind::NoAnswer,
        Kind::ImageRefused,
        Kind::UnitRefused,
        Kind::UploadFailedLoader,
        Kind::UploadFailedUnknown,
        Kind::WrongApplication,
        Kind::Interrupted,
    ];

    /// The documented exit code.
    pub const fn exit_code(self) -> u8 {
        match self {
            Kind::Failed => 1,
            Kind::Usage | Kind::NeedsYes => 2,
            Kind::PortNone
            | Kind::PortAmbiguous
            | Kind::PortMissing
            | Kind::PortDenied
            | Kind::PortBusy
            | Kind::PortGone
            | Kind::PortRate => 3,
            Kind::NoAnswer => 4,
            Kind::ImageRefused => 5,
            Kind::UnitRefused => 6,
            Kind::UploadFailedLoader => 7,
            Kind::UploadFailedUnknown => 8,
            Kind::WrongApplication => 9,
            Kind::Interrupted => 130,
        }
    }

    /// The stable name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Failed => "failed",
            Kind::Usage => "usage",
            Kind::NeedsYes => "needs-yes",
            Kind::PortNone => "port-none",
            Kind::PortAmbiguous => "port-ambiguous",
            Kind::PortMissing => "port-missing",
            Kind::PortDenied => "port-denied",
            Kind::PortBusy => "port-busy",
            Kind::PortGone => "port-gone",
            Kind::PortRate => "port-rate",
            Kind::NoAnswer => "no-answer",
            Kind::ImageRefused => "image-refused",
            Kind::UnitRefused => "unit-refused",
            Kind::UploadFailedLoader => "upload-failed-loader",
            Kind::UploadFailedUnknown => "upload-failed-unknown",
            Kind::WrongApplication => "wrong-application",
            Kind::Interrupted => "interrupted",
        }
    }
}

/// An error on its way to the user.
#[derive(Debug)]
pub struct CliError {
    /// What kind, and so which exit code.
    pub kind: Kind,
    /// What happened and to what, with its causes.
    pub error: anyhow::Error,
    /// What to do next, most useful first.
    pub hints: Vec<String>,
    /// Whether the command has already said all this itself (as a report does); then only the exit code is left.
    pub reported: bool,
}

impl CliError {
    /// An error of a kind.
    pub fn new(kind: Kind, error: impl Into<anyhow::Error>) -> Self {
        CliError { kind, error: error.into(), hints: Vec::new(), reported: false }
    }

    /// An error of a kind from a message.
    pub fn message(kind: Kind, message: impl fmt::Display + fmt::Debug + Send + Sync + 'static) -> Self {
        CliError::new(kind, anyhow::Error::msg(message))
    }

    /// Only the exit code: the command has already reported.
    pub fn reported(kind: Kind) -> Self {
        CliError { kind, error: anyhow::Error::msg(kind.name()), hints: Vec::new(), reported: true }
    }

    /// Ends a command that has already printed its result; only the exit code is left to give. It is the same if nobody
    /// reads the result, and if the result could not be written; then the reason is given as well.
    ///
    /// # Errors
    /// If something was found that has an exit code, or `written` failed.
    pub fn found(kind: Option<Kind>, written: Result<(), CliError>) -> Result<(), CliError> {
        match (kind, written) {
            (None, written) => written,
            (Some(kind), Err(error)) if !error.error.is::<Closed>() => Err(CliError { kind, ..error }),
            (Some(kind), _) => Err(CliError::reported(kind)),
        }
    }

    /// What every command says when the user has interrupted it.
    pub fn interrupted() -> Self {
        CliError::message(Kind::Interrupted, "interrupted")
    }

    /// Adds what to do next.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }
}

impl fmt::Display for CliError {
    /// Message and causes in one line, without hints.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#}", self.error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_decides_and_not_who_reads_it() {
        let closed = || Err(CliError::new(Kind::Failed, Closed));
        let full = || Err(CliError::message(Kind::Failed, "no space left"));
        let ended = |kind, written| CliError::found(kind, written).map_err(|error| (error.kind, error.reported)).err();
        assert_eq!(ended(None, Ok(())), None);
        assert_eq!(ended(None, full()), Some((Kind::Failed, false)));
        assert_eq!(ended(Some(Kind::ImageRefused), Ok(())), Some((Kind::ImageRefused, true)));
        assert_eq!(ended(Some(Kind::ImageRefused), closed()), Some((Kind::ImageRefused, true)));
        assert_eq!(ended(Some(Kind::ImageRefused), full()), Some((Kind::ImageRefused, false)), "with the reason");
    }
}
