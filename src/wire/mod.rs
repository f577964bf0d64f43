//! The text of the service port.
//!
//! What a unit prints, as messages where we understand it and as plain text where we do not. Nothing here fails:
//! unknown is text.

pub mod stream;
pub mod visible;

/// What a line, prompt or page means.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Nothing we know: it stays what it is.
    Text,
}
