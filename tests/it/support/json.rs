//! JSON that the program has written.

use serde_json::Value;

/// The one object, or whatever it is, that a text holds.
pub fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}
