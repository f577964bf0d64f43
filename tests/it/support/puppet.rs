//! A port whose other side says just what a test wants, over a real pseudo-terminal.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use axcon::host::pty::Pty;

use super::shell::PATIENCE;

/// What the other side does with bytes that come: gives its answer.
pub type Answer = Box<dyn FnMut(&[u8]) -> Vec<u8> + Send>;

/// The other side. Ends when dropped; the port is gone then.
pub struct Puppet {
    path: PathBuf,
    pty: Arc<Pty>,
    heard: Arc<Mutex<Vec<u8>>>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Puppet {
    /// A port that answers so.
    pub fn start(mut answer: Answer) -> Self {
        let pty = Arc::new(Pty::open(115_200).expect("a pseudo-terminal"));
        let heard = Arc::new(Mutex::new(Vec::new()));
        let over = Arc::new(AtomicBool::new(false));
        let (at, notes, ends) = (pty.clone(), heard.clone(), over.clone());
        let thread = thread::spawn(move || {
            let mut buffer = [0; 4096];
            while !ends.load(Ordering::Relaxed) {
                let count = at.read(&mut buffer).unwrap_or(0);
                if count == 0 {
                    thread::sleep(Duration::from_millis(1));
                    continue;
                }
                notes.lock().expect("no panic").extend_from_slice(&buffer[..count]);
                write(&at, &answer(&buffer[..count]), &ends);
            }
        });
        Puppet { path: pty.path().to_owned(), pty, heard, over, thread: Some(thread) }
    }

    /// A port that never answers.
    pub fn silent() -> Self {
        Puppet::start(Box::new(|_| Vec::new()))
    }

    /// What opens it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The same, for a command line.
    pub fn port(&self) -> &str {
        self.path.to_str().expect("UTF-8")
    }

    /// Says something unasked, all of it, as fast as somebody reads it.
    pub fn say(&self, bytes: &[u8]) {
        assert!(write(&self.pty, bytes, &self.over), "nobody reads what is said");
    }

    /// Waits until somebody listens: bytes said before would be thrown away.
    pub fn wait_for_client(&self) {
        let end = Instant::now() + PATIENCE;
        while axcon::host::ports::holder(&self.path).is_none_or(|holder| holder.pid == std::process::id()) {
            assert!(Instant::now() < end, "nobody opens the port");
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// What has been sent to it so far.
    pub fn heard(&self) -> Vec<u8> {
        self.heard.lock().expect("no panic").clone()
    }
}

impl Drop for Puppet {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Writes all of it. `false` if it is over before, or nobody has read any of it for too long.
fn write(pty: &Pty, mut bytes: &[u8], over: &AtomicBool) -> bool {
    let mut end = Instant::now() + PATIENCE;
    while !bytes.is_empty() {
        if over.load(Ordering::Relaxed) || Instant::now() >= end {
            return false;
        }
        let count = pty.write(bytes).unwrap_or(0);
        bytes = &bytes[count..];
        if count == 0 {
            thread::sleep(Duration::from_micros(200));
        } else {
            end = Instant::now() + PATIENCE;
        }
    }
    true
}
