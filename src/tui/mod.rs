//! The console on the screen.
//!
//! [`App`] is a third machine around the session: it takes keys as well as bytes and time, and gives a picture as well
//! as bytes and a deadline. It has no threads, clocks, files or environment: what it wants of the world it returns as
//! an [`Effect`], and the answer comes back as an [`Input`]. So a test presses keys and looks at pictures, and a replay
//! is the same machine fed from a file. `docs/tui.md` describes the screens and what the loop around `App` has to do.

mod action;
mod app;
mod frame;
mod image_facts;
mod input;
mod keymap;
mod link_name;
mod picker;
mod popup;
mod returning;
pub mod run;
mod screens;
mod theme;
mod view;
mod visible;
mod widgets;

pub use app::{App, Options};
pub use image_facts::ImageFacts;
pub use input::{
    Effect, FIRST_BYTES, Failure, FileEntry, FileKind, Input, LARGEST_SENT, LARGEST_TEXT, LinkInfo, LinkKind,
    MOST_LISTED, Noted, Pace, Playback, Playing, PortEntry, Recorded, RecordingEntry, RecordingList,
};
pub use popup::ORDERS;
pub use theme::Palette;

#[cfg(test)]
mod pictures;
