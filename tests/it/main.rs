//! Everything that needs more than one module, in one binary.

mod emulator;
mod support;
mod talks;
mod tidy;
mod uploads;
