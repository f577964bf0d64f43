//! Everything that needs more than one module, in one binary.

mod acceptance;
mod answers;
#[cfg(unix)]
mod commands;
mod console;
mod dialects;
#[cfg(unix)]
mod eds;
mod emulator;
mod endings;
mod errata;
mod faults;
mod foreigner;
#[cfg(unix)]
mod hostile;
mod image_corpus;
mod image_files;
mod images;
#[cfg(unix)]
mod lines;
mod live;
#[cfg(unix)]
mod network;
mod oddities;
mod paced;
#[cfg(unix)]
mod ptys;
#[cfg(unix)]
mod recordings;
mod reference;
mod replays;
mod stranger;
mod support;
mod swarm;
mod talks;
mod tidy;
mod transcripts;
mod uploads;
mod wire_page;
