//! What threads find out for the loop, and how it is told of it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;

use super::connecting::{Dial, OpenedRecording};
use super::{Check, Console, files};
use crate::device::LoaderKind;
use crate::host;
use crate::host::unit;
use crate::image::DefectId;
use crate::tui::{Input, LARGEST_SENT};

/// Answers that wait for the loop at most. A thread with another one waits until there is room.
const MOST_WAITING: usize = 64;
/// Orders that wait for the emulated unit at most.
const MOST_ORDERS: usize = 64;

/// What the app asks of files, folders and ports. What takes its time to answer does so in a thread.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Inquiry {
    /// The serial ports.
    Ports,
    /// What is in a folder.
    Folder(PathBuf),
    /// The recordings.
    Recordings,
    /// A text file.
    Text(PathBuf),
    /// A file as it is.
    Bytes(PathBuf),
    /// An image file, read and checked for a loader, if not each product's own, with these errors allowed.
    Image { path: PathBuf, loader: Option<LoaderKind>, allow: Vec<DefectId> },
}

/// An inquiry that a thread is at.
pub(super) struct OpenInquiry {
    inquiry: Inquiry,
    /// The same was asked meanwhile: what the thread finds may be older than that.
    again: bool,
}

/// What a thread has found out.
pub(super) enum Found {
    /// Something that nobody has asked for: other ports, a file that is written.
    News(Input),
    /// The answer to an inquiry.
    Answer(Inquiry, Input),
    /// What came of dialling a network link.
    Dialled(Box<Dial>),
    /// What came of opening a recording.
    Recording(Box<OpenedRecording>),
}

impl From<Input> for Found {
    fn from(input: Input) -> Self {
        Found::News(input)
    }
}

/// Where the loop finds what threads have reported.
pub(super) type Answers = Receiver<Found>;

/// The way of a thread to the loop.
#[derive(Clone)]
pub(super) struct Reporter {
    found: SyncSender<Found>,
    waker: SyncSender<host::Input>,
}

/// An order to the emulated unit, and where its answer comes.
pub(super) struct PendingOrder {
    line: String,
    answer: Receiver<unit::Answer>,
}

/// Answers come on a channel of their own, and wake the loop through its own.
pub(super) fn channel(waker: SyncSender<host::Input>) -> (Reporter, Answers) {
    let (found, answers) = sync_channel(MOST_WAITING);
    (Reporter { found, waker }, answers)
}

impl Reporter {
    /// Reports, from a thread that the loop does not wait for.
    pub(super) fn report(&self, found: impl Into<Found>) {
        if self.found.send(found.into()).is_ok() {
            wake(&self.waker);
        }
    }
}

/// Ends the loop's wait. A full channel does that by itself.
fn wake(waker: &SyncSender<host::Input>) {
    let _ = waker.try_send(host::Input::Wake);
}

impl Console {
    /// Takes what threads have found out, and says whether that was anything.
    pub(super) fn take_answers(&mut self) -> bool {
        let mut has_come = false;
        // A thread that reports without end does not keep the keys waiting.
        for _ in 0..MOST_WAITING {
            let Ok(found) = self.answers.try_recv() else { break };
            self.take_found(found);
            has_come = true;
        }
        while let Some(input) = self.next_ordered() {
            self.handle(input);
            has_come = true;
        }
        has_come
    }

    pub(super) fn take_found(&mut self, found: Found) {
        match found {
            Found::News(input) => self.handle(input),
            Found::Answer(inquiry, input) => {
                self.close_inquiry(&inquiry);
                self.handle(input);
            }
            Found::Dialled(dial) => self.take_dialled(*dial),
            Found::Recording(opened) => self.take_recording(*opened),
        }
    }

    fn next_ordered(&mut self) -> Option<Input> {
        let answer = match self.orders.front()?.answer.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(answer) => answer,
            Err(TryRecvError::Disconnected) => Err("the unit has not taken it".to_owned()),
        };
        self.orders.pop_front().map(|order| Input::Ordered { line: order.line, answer })
    }

    /// Has the emulated unit do something.
    pub(super) fn order(&mut self, line: String) {
        let refusal = match self.connection() {
            // The unit was on its link.
            None => "the unit is gone with its link, C starts a new one",
            Some(_) if self.orders.len() >= MOST_ORDERS => "too many orders wait for the unit",
            Some(link) => {
                // Each with a channel of its own, which has room: the unit's thread must never wait for the loop, which
                // waits for it when the link is closed.
                let (answered, answer) = sync_channel(1);
                let waker = self.sender.clone();
                link.order(&line, move |result| {
                    let _ = answered.try_send(result);
                    wake(&waker);
                });
                return self.orders.push_back(PendingOrder { line, answer });
            }
        };
        self.handle(Input::Ordered { line, answer: Err(refusal.to_owned()) });
    }

    /// Asks in a thread. While a thread is at the same inquiry no other one is started for it, so that a key that is held
    /// down does not start one after the other on a disk that hangs: it is made once more when that one has answered.
    pub(super) fn ask(&mut self, inquiry: Inquiry) {
        match self.inquiries.iter_mut().find(|open| open.inquiry == inquiry) {
            Some(open) => open.again = true,
            None => self.begin_inquiry(inquiry),
        }
    }

    fn begin_inquiry(&mut self, inquiry: Inquiry) {
        self.inquiries.push(OpenInquiry { inquiry: inquiry.clone(), again: false });
        let (written, check) = (self.recorder.path().map(Path::to_owned), self.world.check);
        self.in_thread(move || {
            let input = inquiry.answer(written, check);
            Found::Answer(inquiry, input)
        });
    }

    /// A thread has answered.
    fn close_inquiry(&mut self, inquiry: &Inquiry) {
        let Some(place) = self.inquiries.iter().position(|open| open.inquiry == *inquiry) else { return };
        let OpenInquiry { inquiry, again } = self.inquiries.swap_remove(place);
        if again {
            self.begin_inquiry(inquiry);
        }
    }

    /// Finds something out in a thread; where the system has none to give, here: late is better than never.
    pub(super) fn in_thread(&mut self, find_out: impl FnOnce() -> Found + Clone + Send + 'static) {
        let (reporter, find_out_there) = (self.reporter.clone(), find_out.clone());
        let started = thread::Builder::new().name("answer".to_owned()).spawn(move || reporter.report(find_out_there()));
        if started.is_err() {
            self.take_found(find_out());
        }
    }
}

impl Inquiry {
    /// Finds it out, which may take long. `written` is the recording that is being written, `check` checks images.
    fn answer(&self, written: Option<PathBuf>, check: Check) -> Input {
        match self {
            Inquiry::Ports => Input::PortsListed(files::ports()),
            Inquiry::Folder(directory) => files::folder(directory),
            Inquiry::Recordings => Input::RecordingsListed(files::recordings(files::state_folder(), written)),
            Inquiry::Text(path) => Input::FileRead { path: path.clone(), text: files::text(path) },
            Inquiry::Bytes(path) => Input::BytesRead { path: path.clone(), bytes: files::bytes(path, LARGEST_SENT) },
            Inquiry::Image { path, .. } if path.is_dir() => files::folder(path),
            Inquiry::Image { path, loader, allow } => {
                match files::open(path).and_then(|_| check(path.clone(), *loader, allow)) {
                    Ok(facts) => Input::ImageChecked(Box::new(facts)),
                    Err(why) => Input::ImageUnreadable { path: path.clone(), why },
                }
            }
        }
    }
}
