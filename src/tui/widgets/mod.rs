//! Small pieces of the picture that more than one screen uses.

pub mod chart;
pub mod dots;
pub mod field;
pub mod format;
pub mod lines;
pub mod scale;
pub mod spark;
