//! Known ways to misbehave, so that a test can show that the checker of uploads notices them.
//!
//! A checker that has never found anything may be blind. So the swarm (`tests/it/swarm.rs`) also runs the upload with each
//! of the defects that real senders have, and has to notice every one. Nothing but that test ever names one.

/// One defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// Takes the loader's "loaded" for success, instead of the new banner.
    BelievesTheLoader,
    /// Lets the end record go while a record before it is parked or on its way.
    EndsAtOnce,
    /// Sends the line ends most files have, CR LF, whatever the loader takes.
    SendsCrLf,
    /// Goes on with the next record after an error text, a prompt, or a banner.
    SendsBehindErrors,
    /// Waits for no XON where the loader must be writing.
    IgnoresHolds,
}

impl Flaw {
    /// All of them.
    pub const ALL: [Flaw; 5] =
        [Flaw::BelievesTheLoader, Flaw::EndsAtOnce, Flaw::SendsCrLf, Flaw::SendsBehindErrors, Flaw::IgnoresHolds];
}
