//! The real program on a terminal of its own: keys in, picture out. What else may happen to a terminal is `disturbed`'s.

use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize};

use super::shell::PATIENCE;

/// A terminal with a program on it. The program is killed when dropped.
pub struct Screen {
    pub(super) master: Arc<OwnedFd>,
    /// The program's side, kept open so that its settings can be looked at after its end.
    slave: OwnedFd,
    pub(super) child: Child,
    pub(super) picture: Arc<Mutex<vt100::Parser>>,
}

impl Screen {
    /// Starts a program on a terminal of this size.
    pub fn start(mut command: Command, rows: u16, columns: u16) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = Arc::new(openpt(flags).expect("a terminal"));
        unlockpt(&*master).expect("unlocked");
        tcsetwinsize(&*master, size(rows, columns)).expect("sized");
        let slave = ioctl_tiocgptpeer(&*master, flags).expect("its other side");
        let copy = || slave.try_clone().expect("a copy");
        command.stdin(copy()).stdout(copy()).stderr(copy());
        // A session of its own, so that this is its terminal: sizes and signals of it come to the program.
        #[expect(unsafe_code, reason = "code between fork and exec")]
        // SAFETY: both calls are plain system calls, which are allowed there; nothing is allocated.
        unsafe {
            command.pre_exec(|| {
                rustix::process::setsid()?;
                Ok(rustix::process::ioctl_tiocsctty(rustix::stdio::stdin())?)
            });
        }
        let child = command.spawn().expect("the program starts");
        drop(command);
        let parser = vt100::Parser::new(rows.try_into().expect("rows"), columns.try_into().expect("columns"), 0);
        let picture = Arc::new(Mutex::new(parser));
        let (from, onto) = (master.clone(), picture.clone());
        thread::spawn(move || {
            let mut buffer = [0; 65536];
            while let Ok(count @ 1..) = rustix::io::read(&*from, &mut buffer) {
                onto.lock().expect("no panic").process(&buffer[..count]);
            }
        });
        Screen { master, slave, child, picture }
    }

    /// Types.
    pub fn keys(&self, keys: &str) {
        rustix::io::write(&*self.master, keys.as_bytes()).expect("typed");
    }

    /// What is on the screen now.
    pub fn text(&self) -> String {
        self.picture.lock().expect("no panic").screen().contents()
    }

    /// Waits until the screen shows a text, and gives the whole screen.
    pub fn wait(&self, text: &str) -> String {
        let end = Instant::now() + PATIENCE;
        loop {
            let shown = self.text();
            if shown.contains(text) {
                return shown;
            }
            assert!(Instant::now() < end, "no {text:?} in\n{shown}");
            thread::sleep(Duration::from_millis(2));
        }
    }

    /// Whether the terminal edits lines and echoes, as a shell expects it.
    pub fn is_as_the_shell_left_it(&self) -> bool {
        let modes = tcgetattr(&self.slave).expect("settings").local_modes;
        let parser = self.picture.lock().expect("no panic");
        let screen = parser.screen();
        let has_mouse = screen.mouse_protocol_mode() != vt100::MouseProtocolMode::None;
        modes.contains(LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG)
            && !(screen.alternate_screen() || has_mouse || screen.bracketed_paste() || screen.hide_cursor())
    }

    /// Whether the terminal is given back in time: what the program said last may still be on its way to the picture.
    pub fn is_given_back(&self) -> bool {
        let end = Instant::now() + PATIENCE;
        while !self.is_as_the_shell_left_it() && Instant::now() < end {
            thread::sleep(Duration::from_millis(2));
        }
        self.is_as_the_shell_left_it()
    }

    /// Waits for the program's end and gives its exit code.
    pub fn wait_end(&mut self) -> Option<i32> {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status.code();
            }
            assert!(Instant::now() < end, "no end; the screen shows\n{}", self.text());
            thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(super) fn size(rows: u16, columns: u16) -> Winsize {
    Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 }
}
