//! What several stories need.

pub mod bench;
#[cfg(unix)]
pub mod connection;
#[cfg(unix)]
pub mod disturbed;
pub mod flash;
pub mod flashed;
pub mod foreign;
pub mod json;
#[cfg(unix)]
pub mod puppet;
#[cfg(unix)]
pub mod screen;
#[cfg(unix)]
pub mod server;
#[cfg(unix)]
pub mod shell;
pub mod visit;
pub mod words;
