//! What every loader does with its transmitter: texts, marks of progress, and XOFF and XON for the sender.

use super::Board;
use crate::emulator::uart::{XOFF, XON};

/// A loader's half of the line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Voice {
    /// XOFF has been sent, XON not yet.
    holds_sender: bool,
    /// Marks or a header's text have been printed on the last line.
    line_begun: bool,
}

impl Voice {
    /// Says a text.
    pub fn say(&mut self, board: &mut Board<'_>, text: &str) {
        board.uart.send(board.now, text.as_bytes());
    }

    /// Says what the product's manual quotes of a loader that waits for a file.
    pub fn prompt(&mut self, board: &mut Board<'_>) {
        self.say(board, &format!("{}\r\n", board.product.console.loader_prompt));
    }

    /// Prints the product's mark of progress, after those on the line.
    pub fn mark(&mut self, board: &mut Board<'_>) {
        self.echo(board, board.product.loader.progress.to_string().as_bytes());
    }

    /// Prints bytes as they are, after those on the line.
    pub fn echo(&mut self, board: &mut Board<'_>, bytes: &[u8]) {
        board.uart.send(board.now, bytes);
        self.line_begun = true;
    }

    /// Ends the line with marks on it, if there is one.
    pub fn end_line(&mut self, board: &mut Board<'_>) {
        if std::mem::take(&mut self.line_begun) {
            self.say(board, "\r\n");
        }
    }

    /// Stops the sender, once.
    pub fn hold(&mut self, board: &mut Board<'_>) {
        if !std::mem::replace(&mut self.holds_sender, true) {
            board.uart.send(board.now, &[XOFF]);
        }
    }

    /// Lets the sender go on, if it was stopped.
    pub fn let_go_on(&mut self, board: &mut Board<'_>) {
        if std::mem::take(&mut self.holds_sender) {
            board.uart.send(board.now, &[XON]);
        }
    }

    /// Whether the sender is stopped.
    pub fn holds_sender(&self) -> bool {
        self.holds_sender
    }
}
