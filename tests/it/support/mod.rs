//! What several stories need.

pub mod screen;
pub mod shell;
