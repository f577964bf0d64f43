//! The real program in a pinned world: its own home, no variables from outside, every wait with a deadline.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Longest wait for anything the program does: far more than it takes on a busy machine, so that a failure is one.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// A home directory with nothing in it, and nothing else to know.
pub struct World {
    home: TempDir,
}

/// What a command that ended has left.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl World {
    pub fn new() -> Self {
        World { home: tempfile::tempdir().expect("a home") }
    }

    /// A path in this world.
    pub fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    /// The files of a directory in this world, by name.
    pub fn files(&self, folder: &str) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = std::fs::read_dir(self.path(folder))
            .map(|entries| entries.map(|entry| entry.expect("an entry").path()).collect())
            .unwrap_or_default();
        files.sort();
        files
    }

    /// Waits until a file of this world holds a text.
    pub fn wait_in(&self, file: &str, text: &str) {
        let end = Instant::now() + PATIENCE;
        let read = || std::fs::read_to_string(self.path(file)).unwrap_or_default();
        while !read().contains(text) {
            assert!(Instant::now() < end, "no {text:?} in {file}:\n{}", read());
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// The program with these arguments, in this world.
    pub fn command(&self, args: &[&str]) -> Command {
        self.command_of(Path::new(env!("CARGO_BIN_EXE_axcon")), args)
    }

    /// Another copy of the program.
    pub fn command_of(&self, program: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(args).current_dir(self.home.path()).env_clear();
        command.env("PATH", "/usr/bin:/bin").env("TERM", "xterm-256color").env("LANG", "C.UTF-8");
        command.env("HOME", self.home.path()).env("XDG_STATE_HOME", self.path("state"));
        command
    }

    /// Another program in this world, which finds axcon as a user's shell does.
    pub fn tool(&self, program: &Path, args: &[&str]) -> Command {
        let mut command = self.command_of(program, args);
        let folder = Path::new(env!("CARGO_BIN_EXE_axcon")).parent().expect("a folder");
        command.env("PATH", format!("{}:/usr/bin:/bin", folder.display()));
        command
    }

    /// Runs the program to its end, with this on its standard input.
    pub fn run(&self, args: &[&str], input: &[u8]) -> Ran {
        let mut running = Running::start(self.command(args));
        running.input(input);
        running.end_input();
        running.wait()
    }

    /// Starts the program, its standard input open.
    pub fn start(&self, args: &[&str]) -> Running {
        Running::start(self.command(args))
    }
}

/// A program that runs. Killed when dropped.
pub struct Running {
    child: Child,
    input: Option<ChildStdin>,
    out: Arc<Heard>,
    err: Arc<Heard>,
}

/// What a stream has said so far.
#[derive(Default)]
struct Heard {
    said: Mutex<(Vec<u8>, bool)>,
    more: Condvar,
}

impl Running {
    pub fn start(mut command: Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let out = Heard::listen(child.stdout.take().expect("piped"));
        let err = Heard::listen(child.stderr.take().expect("piped"));
        Running { input: child.stdin.take(), child, out, err }
    }

    /// Says something on standard input. A program that has ended already does not hear it.
    pub fn input(&mut self, bytes: &[u8]) {
        if let Some(input) = &mut self.input {
            let _ = input.write_all(bytes);
        }
    }

    pub fn end_input(&mut self) {
        self.input = None;
    }

    /// Waits for text on standard output, and gives all that was said there.
    pub fn wait_out(&self, text: &str) -> String {
        self.out.wait(text, &self.err)
    }

    /// Waits for text on standard error, and gives all that was said there.
    pub fn wait_err(&self, text: &str) -> String {
        self.err.wait(text, &self.out)
    }

    pub fn signal(&self, signal: rustix::process::Signal) {
        send_signal(&self.child, signal);
    }

    /// The most memory it has had so far, in bytes.
    pub fn peak_memory(&self) -> usize {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).expect("it runs");
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
        line.trim().trim_end_matches(" kB").parse::<usize>().expect("a number") * 1024
    }

    /// Waits for the end.
    pub fn wait(self) -> Ran {
        self.wait_within(PATIENCE)
    }

    /// Waits for the end of something that takes longer.
    pub fn wait_within(mut self, limit: Duration) -> Ran {
        let end = Instant::now() + limit;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            assert!(Instant::now() < end, "no end; out:\n{}\nerr:\n{}", self.out.text(), self.err.text());
            thread::sleep(Duration::from_millis(2));
        };
        Ran { code: status.code(), out: self.out.all(), err: self.err.all() }
    }
}

/// Sends a signal to a program that has been started.
pub fn send_signal(child: &Child, signal: rustix::process::Signal) {
    let pid = i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw).expect("a process");
    rustix::process::kill_process(pid, signal).expect("the signal goes out");
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Heard {
    fn listen(mut stream: impl Read + Send + 'static) -> Arc<Heard> {
        let heard = Arc::new(Heard::default());
        let listener = heard.clone();
        thread::spawn(move || {
            let mut buffer = [0; 4096];
            loop {
                let count = stream.read(&mut buffer).unwrap_or(0);
                let mut said = listener.said.lock().expect("no panic");
                said.0.extend_from_slice(&buffer[..count]);
                said.1 = count == 0;
                listener.more.notify_all();
                if count == 0 {
                    return;
                }
            }
        });
        heard
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.said.lock().expect("no panic").0).into_owned()
    }

    fn wait(&self, text: &str, other: &Heard) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            let heard = self.text();
            if heard.contains(text) {
                return heard;
            }
            assert!(Instant::now() < end, "no {text:?} in\n{heard}\nbut elsewhere\n{}", other.text());
            let said = self.said.lock().expect("no panic");
            drop(self.more.wait_timeout(said, Duration::from_millis(50)));
        }
    }

    /// Everything, when the stream has ended.
    fn all(&self) -> String {
        let end = Instant::now() + PATIENCE;
        let mut said = self.said.lock().expect("no panic");
        while !said.1 && Instant::now() < end {
            said = self.more.wait_timeout(said, Duration::from_millis(50)).expect("no panic").0;
        }
        String::from_utf8_lossy(&said.0).into_owned()
    }
}
