//! What may happen to a terminal beside keys: another size, a signal, something that writes over the picture.

use rustix::termios::tcsetwinsize;

use super::screen::{Screen, size};
use super::shell::send_signal;

impl Screen {
    /// Something else writes over what is on the screen.
    pub fn spoil(&self) {
        self.picture.lock().expect("no panic").process(b"\x1b[2J\x1b[Hsomething else");
    }

    /// Gives the terminal another size; the program is told by a signal.
    pub fn resize(&self, rows: u16, columns: u16) {
        tcsetwinsize(&*self.master, size(rows, columns)).expect("sized");
        let (rows, columns) = (rows.try_into().expect("rows"), columns.try_into().expect("columns"));
        self.picture.lock().expect("no panic").screen_mut().set_size(rows, columns);
    }

    pub fn signal(&self, signal: rustix::process::Signal) {
        send_signal(&self.child, signal);
    }
}
