//! What can happen to the console, and what it wants of the world.
//!
//! Each [`Effect`] that asks for something is answered by exactly one [`Input`]; the comments name the pairs.

use std::path::PathBuf;

use ratatui::crossterm::event::Event as TerminalEvent;

use super::image_facts::ImageFacts;
use crate::device::{LoaderKind, Product};
use crate::endpoint::{Arrived, Transmit};
use crate::image::DefectId;
use crate::time::Duration;
use crate::version::Version;

/// How much of a file tells what it may be: an image's first record, type and length, after a byte order mark; the
/// schema of a saved object dictionary.
pub const FIRST_BYTES: usize = 64;
/// Largest text file that is read: a dump of the largest product has a tenth of it.
pub const LARGEST_TEXT: u64 = 4 << 20;

/// Largest file that is sent as it is: it takes 24 minutes.
pub const LARGEST_SENT: u64 = 16 << 20;
/// Entries of a folder that are read at most.
pub const MOST_LISTED: usize = 10_000;

/// What can happen.
#[derive(Debug)]
pub enum Input {
    /// Keys, paste, resize.
    Terminal(TerminalEvent),
    /// The unit has sent bytes.
    Bytes(Vec<u8>),
    /// The unit has sent bytes in these pieces, which had to wait for the console: before anything that was due.
    Arrived(Vec<Arrived>),
    /// The beginning of such bytes: the rest comes before anything that was due. Keys may come in between.
    ArrivedSoFar(Vec<Arrived>),
    /// The moment [`App::poll_timeout`](super::App::poll_timeout) named has come. Early is harmless.
    Timeout,
    /// Answer to [`Effect::ListPorts`]; an error in one sentence.
    PortsListed(Result<Vec<PortEntry>, String>),
    /// Answer to [`Effect::OpenLink`]: bytes may come and go.
    LinkOpened(LinkInfo),
    /// Answer to [`Effect::OpenLink`]: it could not be opened.
    LinkFailed(Failure),
    /// The open link has ended by itself: adapter pulled out, host gone, write refused. Nothing more will come from it.
    LinkGone(Failure),
    /// The lost link is there again, under this name.
    LinkBack(String),
    /// In a recording: these bytes were sent then.
    Sent(Vec<u8>),
    /// In a recording: a remark.
    Mark(String),
    /// Nothing more of this connection is recorded, and why.
    Unrecorded(String),
    /// The recording has ended, well or (why) not.
    RecordingOver(Option<Failure>),
    /// Answer to [`Effect::ListFiles`].
    FilesListed {
        /// The folder, absolute where that could be found out.
        directory: PathBuf,
        /// What is in it, in any order and no more than [`MOST_LISTED`], or why it cannot be read.
        entries: Result<Vec<FileEntry>, String>,
    },
    /// Answer to [`Effect::CheckImage`].
    ImageChecked(Box<ImageFacts>),
    /// Answer to [`Effect::CheckImage`]: there is nothing to check.
    ImageUnreadable {
        /// Which file.
        path: PathBuf,
        /// Why it cannot be read.
        why: String,
    },
    /// Answer to [`Effect::CreateFile`] and, where it fails, to [`Effect::AppendFile`].
    FileWritten {
        /// Which file.
        path: PathBuf,
        /// Why it could not be written.
        result: Result<(), String>,
    },
    /// Answer to [`Effect::ReadFile`].
    FileRead {
        /// Which file.
        path: PathBuf,
        /// What is in it, or why it cannot be read.
        text: Result<String, String>,
    },
    /// Answer to [`Effect::ReadBytes`].
    BytesRead {
        /// Which file.
        path: PathBuf,
        /// What is in it, or why it cannot be read.
        bytes: Result<Vec<u8>, String>,
    },
    /// Answer to [`Effect::ListRecordings`].
    RecordingsListed(Result<RecordingList, String>),
    /// How the recording is played now.
    Playing(Playing),
    /// The recording restarts: what it showed so far has not happened yet.
    PlayedAnew(LinkInfo),
    /// Answer to [`Effect::Order`].
    Ordered {
        /// The order.
        line: String,
        /// What the unit had to say, or why it refused.
        answer: Result<Option<String>, String>,
    },
    /// Answer to [`Effect::Break`]: why the link cannot do that.
    BreakSent(Result<(), String>),
    /// The system wants the program to end: leave without asking.
    Signal,
}

/// What the console wants done.
#[derive(Debug, PartialEq)]
pub enum Effect {
    /// Give up opening a link; one that is open stays. What comes of it must not be handed in.
    DoNotOpen,
    /// Open a link (`/dev/ttyUSB0`, `emu:axtc4co`) and start its recording, or play a recording (`replay:FILE`): its
    /// bytes come as [`Input::Bytes`] and [`Input::Sent`] at the times they had. Answered by
    /// [`Input::LinkOpened`] or [`Input::LinkFailed`]. A link that is open stays open until this one is, one that was lost is
    /// looked for until then; it is given up before the answer says so.
    OpenLink(String),
    /// Close the open link. Not answered; what still comes from it must not be handed in.
    CloseLink,
    /// Put bytes on the link, after those of earlier effects. The recording sees them as their secrecy says.
    Transmit(Transmit),
    /// List the serial ports. Answered by [`Input::PortsListed`].
    ListPorts,
    /// List a folder. Answered by [`Input::FilesListed`].
    ListFiles(PathBuf),
    /// Read and check an image file. Answered by [`Input::ImageChecked`], by [`Input::ImageUnreadable`], or by
    /// [`Input::FilesListed`] when it is a folder.
    CheckImage {
        /// Which.
        path: PathBuf,
        /// The loader it is for, if not the product's own.
        loader: Option<LoaderKind>,
        /// Errors in spite of which it may be sent.
        allow: Vec<DefectId>,
    },
    /// Write a new file. An existing one is left alone, and that is an error. Answered by
    /// [`Input::FileWritten`].
    CreateFile {
        /// Which.
        path: PathBuf,
        /// What is in it.
        bytes: Vec<u8>,
    },
    /// Write more at the end of a file that [`Effect::CreateFile`] has made.
    AppendFile {
        /// Which.
        path: PathBuf,
        /// What follows.
        bytes: Vec<u8>,
    },
    /// Read a text file of at most [`LARGEST_TEXT`] bytes. Answered by [`Input::FileRead`].
    ReadFile(PathBuf),
    /// Read a file of at most [`LARGEST_SENT`] bytes, as it is. Answered by [`Input::BytesRead`].
    ReadBytes(PathBuf),
    /// Put a remark in the recording.
    Mark(String),
    /// List the recordings. Answered by [`Input::RecordingsListed`].
    ListRecordings,
    /// Play the recording differently. Answered by [`Input::Playing`] whenever it has moved.
    Play(Playback),
    /// Hold the line low for a quarter of a second. Answered by [`Input::BreakSent`].
    Break,
    /// Have the emulated unit at the other end do something, in the words `axcon emulate` takes. Answered by
    /// [`Input::Ordered`].
    Order(String),
    /// Note that an upload begins on a link, before the loader is entered: a loader does not say which product it is of.
    UploadBegins {
        /// The link.
        link: String,
        /// The unit and the image.
        noted: Noted,
    },
    /// The unit on a link runs: forget the note.
    UploadEnds {
        /// The link.
        link: String,
    },
    /// Give the terminal back and stop the program until its shell continues it.
    Suspend,
    /// End the program, after the effects before this one.
    Quit,
}

/// One port the system offers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortEntry {
    /// What opens it, e.g. `/dev/ttyUSB0`.
    pub link: String,
    /// What it is, in a few words: `USB, FTDI FT232R, 0403:6001, serial number AX12345`.
    pub description: String,
    /// Which program holds it, if one does: `picocom, process 4711`.
    pub busy_by: Option<String>,
}

/// An open link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkInfo {
    /// What opened it; the console opens it again by this name.
    pub link: String,
    /// Baud rate.
    pub baud: u32,
    /// What is at its other end.
    pub kind: LinkKind,
    /// Where the recording is written, if one is.
    pub recording: Option<String>,
    /// What is noted of an upload on it that has not ended well.
    pub noted: Option<Noted>,
    /// Local time of day at [`Instant::ZERO`](crate::time::Instant::ZERO): another one in a recording.
    pub start_of_day: Duration,
    /// The same moment in milliseconds since 1970, UTC.
    pub start_millis: i64,
}

/// What is at the other end of a link. Only the loop understands the names of links.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LinkKind {
    /// A unit, or something that passes for one.
    #[default]
    Unit,
    /// A unit that this program emulates.
    Emulated(&'static Product),
    /// A recording, to which nothing can be sent.
    Recording,
}

/// An upload that was begun on a link and has not ended well: the unit may wait in its loader, which says nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Noted {
    /// The unit's product, as it was known before its loader was entered.
    pub product: String,
    /// The image's file.
    pub image: String,
    /// The software the unit ran before, where it said so.
    pub ran: Option<Version>,
    /// When it was begun, in local time: date and time, or the time of day alone if it was on the link as it is open now.
    pub begun: String,
}

/// The recordings that are there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingList {
    /// Newest first.
    pub entries: Vec<RecordingEntry>,
    /// How many older ones nobody has looked into.
    pub older: usize,
}

/// One file with the name of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingEntry {
    /// What plays it: `replay:FILE`.
    pub link: String,
    /// The file.
    pub path: String,
    /// Bytes of the file.
    pub bytes: u64,
    /// What it holds, or why it cannot be read.
    pub content: Result<Recorded, String>,
}

/// What a recording holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// When it began, local date and time.
    pub begun: String,
    /// The link it was made of, as the user named it then.
    pub port: String,
    /// Which part of a long session it is.
    pub part: u32,
    /// How long it is, where its end can be read.
    pub length: Option<Duration>,
    /// A program writes it just now, this one or another.
    pub is_being_written: bool,
}

/// What can be done to a recording that is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Playback {
    /// Go on at this pace.
    Pace(Pace),
    /// Go to this place.
    Seek(Duration),
    /// Restart at this pace.
    Again(Pace),
}

/// How a recording is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playing {
    /// How far it has come.
    pub position: Duration,
    /// How long it is, once its end has been seen.
    pub length: Option<Duration>,
    /// How fast.
    pub pace: Pace,
}

/// How fast a recording is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// Not at all.
    Paused,
    /// This many times as fast as it was made.
    Times(u32),
    /// As fast as it can be read.
    AtOnce,
}

/// Something that did not work outside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What happened and to what, in one sentence.
    pub text: String,
    /// What the user can try, one step each.
    pub hints: Vec<String>,
}

/// One entry of a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileEntry {
    /// Its name, without the folder.
    pub name: String,
    /// Folder or file.
    pub kind: FileKind,
    /// Length in bytes; 0 for a folder.
    pub bytes: u64,
    /// The first bytes of a file whose name does not say what it is, [`FIRST_BYTES`] at most.
    pub begins: Vec<u8>,
    /// When it was last changed, as local date and time, where known.
    pub modified: Option<String>,
}

/// What an entry of a folder is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A folder, or a link to one.
    Folder,
    /// Anything else.
    File,
}
