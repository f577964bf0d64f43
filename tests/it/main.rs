//! Everything that needs more than one module, in one binary.

mod images;
mod support;
mod talks;
mod tidy;
mod uploads;
