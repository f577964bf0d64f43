//! Files that rows and dictionaries go to, written in a thread, in the order in which they were asked for.
//!
//! A new file is on the disk before it has its name, which takes seconds on a slow one: neither keys nor bytes wait for it.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::files;

/// Pieces that wait for the disk at most: minutes of a fast stream. Who wants to write more waits as well.
const MOST_WAITING: usize = 4096;

/// What is to be written.
pub(super) enum Piece {
    /// A new file.
    New(PathBuf, Vec<u8>),
    /// Behind what is in a file that was new.
    More(PathBuf, Vec<u8>),
}

/// Writes files.
pub(super) struct Writer {
    pieces: Option<SyncSender<Piece>>,
    thread: Option<JoinHandle<()>>,
    /// Where the system has no thread to give, they are written by whoever wants them written.
    here: Desk,
}

/// Is told of every new file, and of what could not be written.
type Told = Arc<dyn Fn(PathBuf, Result<(), String>) + Send + Sync>;

/// Writes one piece after the other.
struct Desk {
    told: Told,
    /// Files that could not be made, since they were there already or the disk refused: nothing is put behind what is in
    /// them.
    refused: BTreeSet<PathBuf>,
}

impl Writer {
    /// `told` is called from another thread.
    pub(super) fn start(told: impl Fn(PathBuf, Result<(), String>) + Send + Sync + 'static) -> Self {
        let told: Told = Arc::new(told);
        let desk = || Desk { told: Arc::clone(&told), refused: BTreeSet::new() };
        let (sender, pieces) = sync_channel(MOST_WAITING);
        let mut there = desk();
        let work = move || pieces.into_iter().for_each(|piece| there.write(piece));
        let thread = thread::Builder::new().name("writer".to_owned()).spawn(work).ok();
        Writer { pieces: thread.is_some().then_some(sender), thread, here: desk() }
    }

    /// Has a piece written behind those before it.
    pub(super) fn write(&mut self, piece: Piece) {
        let left = match &self.pieces {
            Some(pieces) => pieces.send(piece).err().map(|error| error.0),
            None => Some(piece),
        };
        if let Some(piece) = left {
            self.here.write(piece);
        }
    }
}

impl Drop for Writer {
    /// What was asked for is written.
    fn drop(&mut self) {
        self.pieces = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Desk {
    fn write(&mut self, piece: Piece) {
        match piece {
            Piece::New(path, bytes) => {
                let result = files::create(&path, &bytes);
                match result {
                    Ok(()) => self.refused.remove(&path),
                    Err(_) => self.refused.insert(path.clone()),
                };
                (self.told)(path, result);
            }
            Piece::More(path, _) if self.refused.contains(&path) => {}
            Piece::More(path, bytes) => {
                if let Err(why) = files::append(&path, &bytes) {
                    (self.told)(path, Err(why));
                }
            }
        }
    }
}
