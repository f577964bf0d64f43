//! Files that rows and dictionaries go to, written in a thread, in the order in which they were asked for.
//!
//! A new file is on the disk before it has its name, which takes seconds on a slow one: neither keys nor bytes wait for it.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use super::files;

/// Pieces that wait for the disk at most: minutes of a fast stream.
const MOST_WAITING: usize = 4096;

/// What is to be written.
pub(super) enum Piece {
    /// A new file.
    New(PathBuf, Vec<u8>),
    /// More at the end of a file that was new.
    More(PathBuf, Vec<u8>),
}

/// Writes files.
pub(super) struct Writer {
    tasks: SyncSender<Task>,
    /// Nothing is ever sent here: it closes when the thread has ended.
    ended: Receiver<()>,
    unwritten: Arc<Unwritten>,
    /// Files of which a piece found no room: nothing more is added to them.
    given_up: BTreeSet<PathBuf>,
}

enum Task {
    Write(Piece),
    /// Something else that the disk may hold up, and what is dropped once it is done.
    Run(Box<dyn FnOnce() + Send>, SyncSender<()>),
}

/// How many pieces of each file wait.
#[derive(Default)]
struct Unwritten(Mutex<BTreeMap<PathBuf, usize>>);

/// Whether something has been done.
pub(super) struct Done(Receiver<()>);

impl Piece {
    fn path(&self) -> &PathBuf {
        let (Piece::New(path, _) | Piece::More(path, _)) = self;
        path
    }
}

impl Writer {
    /// `report` is told, in another thread, of every new file and of whatever could not be written.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(report: impl Fn(PathBuf, Result<(), String>) + Send + 'static) -> io::Result<Self> {
        let (tasks, waiting) = sync_channel(MOST_WAITING);
        let (ends, ended) = sync_channel(0);
        let unwritten = Arc::<Unwritten>::default();
        let shared = Arc::clone(&unwritten);
        thread::Builder::new().name("writer".to_owned()).spawn(move || {
            let _ends: SyncSender<()> = ends;
            let mut disk = Disk { report, refused: BTreeSet::new() };
            for task in waiting {
                match task {
                    Task::Write(piece) => {
                        let path = piece.path().clone();
                        disk.write(piece);
                        shared.remove(&path);
                    }
                    Task::Run(work, _done) => work(),
                }
            }
        })?;
        Ok(Writer { tasks, ended, unwritten, given_up: BTreeSet::new() })
    }

    /// Has a piece written after those before it.
    ///
    /// # Errors
    /// If too much waits to be written. Nothing more is added to the file, whose path is given.
    pub(super) fn write(&mut self, piece: Piece) -> Result<(), PathBuf> {
        let path = piece.path().clone();
        match &piece {
            Piece::New(..) => drop(self.given_up.remove(&path)),
            Piece::More(..) if self.given_up.contains(&path) => return Ok(()),
            Piece::More(..) => {}
        }
        self.unwritten.add(&path);
        match self.tasks.try_send(Task::Write(piece)) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.unwritten.remove(&path);
                self.given_up.insert(path.clone());
                Err(path)
            }
        }
    }

    /// Has something done after what is written before it; at once where too much waits, since it has to be done.
    pub(super) fn run(&self, work: impl FnOnce() + Send + 'static) -> Done {
        let (done, is_done) = sync_channel(0);
        if let Err(TrySendError::Full(task) | TrySendError::Disconnected(task)) =
            self.tasks.try_send(Task::Run(Box::new(work), done))
            && let Task::Run(work, _) = task
        {
            work();
        }
        Done(is_done)
    }

    /// Waits until everything is written, but no longer than this; gives the files that are incomplete.
    pub(super) fn finish(self, patience: Duration) -> Vec<PathBuf> {
        let Writer { tasks, ended, unwritten, .. } = self;
        drop(tasks);
        match ended.recv_timeout(patience) {
            Err(RecvTimeoutError::Timeout) => unwritten.paths(),
            Ok(()) | Err(RecvTimeoutError::Disconnected) => Vec::new(),
        }
    }
}

impl Done {
    /// Waits for it, but no longer than this.
    pub(super) fn wait(self, patience: Duration) {
        let _ = self.0.recv_timeout(patience);
    }
}

impl Unwritten {
    fn pieces(&self) -> MutexGuard<'_, BTreeMap<PathBuf, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add(&self, path: &Path) {
        *self.pieces().entry(path.to_path_buf()).or_default() += 1;
    }

    fn remove(&self, path: &Path) {
        let mut pieces = self.pieces();
        if let Some(count) = pieces.get_mut(path) {
            *count -= 1;
            if *count == 0 {
                pieces.remove(path);
            }
        }
    }

    fn paths(&self) -> Vec<PathBuf> {
        self.pieces().keys().cloned().collect()
    }
}

/// Writes one piece after the other.
struct Disk<R> {
    report: R,
    /// Files that could not be made, since they existed already or the disk refused, and those that could not take what
    /// was to be added: nothing more is added to them, since it would follow on a gap.
    refused: BTreeSet<PathBuf>,
}

impl<R: Fn(PathBuf, Result<(), String>)> Disk<R> {
    fn write(&mut self, piece: Piece) {
        match piece {
            Piece::New(path, bytes) => {
                let result = files::create(&path, &bytes);
                match result {
                    Ok(()) => self.refused.remove(&path),
                    Err(_) => self.refused.insert(path.clone()),
                };
                (self.report)(path, result);
            }
            Piece::More(path, _) if self.refused.contains(&path) => {}
            Piece::More(path, bytes) => {
                if let Err(why) = files::append(&path, &bytes) {
                    self.refused.insert(path.clone());
                    (self.report)(path, Err(why));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::fs;

    use super::*;

    #[test]
    fn nothing_is_added_after_what_could_not_be_written_until_there_is_a_new_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, aside) = (folder.path().join("rows.csv"), folder.path().join("aside.csv"));
        let told = RefCell::new(Vec::new());
        let report = |_: PathBuf, result: Result<(), String>| told.borrow_mut().push(result.is_ok());
        let mut disk = Disk { report, refused: BTreeSet::new() };
        let create = |text: &str| Piece::New(path.clone(), text.into());
        let append = |text: &str| Piece::More(path.clone(), text.into());
        let written = || fs::read_to_string(&path).expect("there");
        disk.write(create("a"));
        fs::rename(&path, &aside).expect("moved away");
        disk.write(append("b"));
        fs::rename(&aside, &path).expect("moved back");
        disk.write(append("c"));
        assert_eq!((written(), told.take()), ("a".into(), vec![true, false]));
        fs::remove_file(&path).expect("removed");
        disk.write(create("d"));
        disk.write(append("e"));
        assert_eq!((written(), told.take()), ("de".into(), vec![true]));
    }

    #[test]
    fn a_disk_that_hangs_keeps_nobody_waiting_and_its_files_are_named() {
        let mut writer = Writer::start(|_, _| {}).expect("a thread");
        let (release, hangs) = sync_channel::<()>(0);
        writer.run(move || {
            let _ = hangs.recv();
        });
        let path = PathBuf::from("rows.csv");
        let more = || Piece::More(path.clone(), Vec::new());
        let refused = (0..=MOST_WAITING).find_map(|_| writer.write(more()).err());
        assert_eq!(refused.as_ref(), Some(&path));
        assert_eq!(writer.write(more()), Ok(()), "it is said once");
        assert_eq!(writer.finish(Duration::ZERO), [path]);
        drop(release);
    }
}
