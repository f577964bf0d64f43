//! Foreign texts made fit for the screen, on top of what `wire` does with bytes.
//!
//! No control code of a device reaches the user's terminal. It is not dropped either, since it may be the evidence one
//! is looking for: it becomes a visible sign.

use crate::wire::visible;
pub use crate::wire::visible::column;

/// A text from outside (a file name, an error of the system, something a unit said) on one line, without anything that
/// moves the cursor or turns the direction of writing.
pub fn text(foreign: &str) -> String {
    visible::line(foreign.as_bytes())
}

/// The same, beginning with a capital: errors of the system begin in lower case, since they follow other words.
pub fn sentence(foreign: &str) -> String {
    let text = text(foreign);
    let mut characters = text.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => text,
    }
}
