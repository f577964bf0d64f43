//! The terminal of the stories in `it`, without the rest of their world.

#[path = "../it/support/screen.rs"]
pub mod screen;

pub mod shell {
    /// Longest wait for anything the program does.
    pub const PATIENCE: std::time::Duration = std::time::Duration::from_secs(20);
}
