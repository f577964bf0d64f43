//! Everything that needs more than one module, in one binary.

mod acceptance;
#[cfg(unix)]
mod commands;
mod console;
mod dialects;
#[cfg(unix)]
mod eds;
mod emulator;
mod faults;
mod images;
#[cfg(unix)]
mod live;
#[cfg(unix)]
mod ptys;
mod stranger;
mod support;
mod talks;
mod tidy;
mod uploads;
