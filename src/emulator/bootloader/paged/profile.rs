//! What tells the generations of loaders with a page buffer apart, as data.
//!
//! The pages themselves are those of the product's flash (`[flash] page_words` in its file): what a loader keeps in its
//! buffer is what its flash erases at once, as far as the public sources go.

use super::record::Ignores;
use crate::time::Duration;

/// One generation.
#[derive(Debug)]
pub struct Profile {
    /// What it says first, line ends included; the prompt of the product follows.
    pub header: &'static str,
    /// Data records that may wait while a page is written, the one that began the next page included. One more is
    /// error 5.
    pub parks: usize,
    /// Silence on the line after which it stops to listen and begins to write.
    pub silence: Duration,
    /// Control characters it does not see.
    pub ignores: Ignores,
    /// What it says at the end.
    pub ending: Ending,
}

/// What a loader says when S7 has come and everything is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// How many words have come, and that the application is started.
    Counts,
    /// From which address, which is the entry point of the file, the application is started.
    Address,
}

/// The loader of the SDK, 2000 to 2004 (public facts). The middle of its copyright line is not known to the letter.
pub static G1: Profile = Profile {
    header: "(c) Motorola Inc. S-Record loader. Version 1.3\r\n",
    parks: 1,
    silence: Duration::from_micros(600),
    ignores: Ignores::Controls,
    ending: Ending::Counts,
};

/// The loader of the 56F83xx generation. Known are its prompt, its dots, `Application started from address 0x....` and
/// its error numbers 1 to 7. The rest is a **guess**: that it is the loader before it, grown by a second place to park a
/// record and stricter with control characters; that it stops its sender after each record that crosses into another
/// page, with the pages and the silence of G1; and that it says nothing before its prompt.
pub static G2: Profile =
    Profile { header: "", parks: 2, silence: G1.silence, ignores: Ignores::LineEnds, ending: Ending::Address };
