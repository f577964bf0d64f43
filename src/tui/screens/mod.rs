//! The screens: each with its title, its keys, what they do, and its picture.
//!
//! A screen holds its own cursor and scroll positions and nothing else; what is known lies in the view.

pub mod bench;
pub mod connect;
pub mod diagnostics;
pub mod dictionary;
pub mod help;
pub mod load;
pub mod overview;
pub mod recordings;
pub mod stream;
pub mod terminal;

use super::keymap::{Binding, Cmd};
use super::theme::Theme;
use super::view::View;
use crate::monitor::Scrollback;
use crate::record::Record;
use crate::time::{Duration, Instant};

/// Which screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScreenId {
    /// Ports and emulated units.
    Connect,
    /// Identity, values, faults.
    Overview,
    /// The line as it is.
    Terminal,
    /// Files, plan, progress, verdict.
    Load,
    /// The object dictionary.
    Dictionary,
    /// Table and curves of the stream.
    Stream,
    /// The unit's diagnostics.
    Diagnostics,
    /// What was recorded.
    Recordings,
    /// Sensors and power of an emulated unit.
    Bench,
}

/// What a screen draws from.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// What is known.
    pub view: &'a View,
    /// Every byte.
    pub record: &'a Record,
    /// The same as text.
    pub scrollback: &'a Scrollback,
    /// How things look.
    pub theme: Theme,
    /// The latest moment the console knows of.
    pub now: Instant,
    /// Local time of day at the start of time.
    pub start_of_day: Duration,
}

impl ScreenId {
    /// All of them, in the order of their keys.
    pub const ALL: [ScreenId; 9] = [
        ScreenId::Connect,
        ScreenId::Overview,
        ScreenId::Terminal,
        ScreenId::Load,
        ScreenId::Dictionary,
        ScreenId::Stream,
        ScreenId::Diagnostics,
        ScreenId::Recordings,
        ScreenId::Bench,
    ];

    /// Name on the tab.
    pub const fn title(self) -> &'static str {
        match self {
            ScreenId::Connect => connect::TITLE,
            ScreenId::Overview => overview::TITLE,
            ScreenId::Terminal => terminal::TITLE,
            ScreenId::Load => load::TITLE,
            ScreenId::Dictionary => dictionary::TITLE,
            ScreenId::Stream => stream::TITLE,
            ScreenId::Diagnostics => diagnostics::TITLE,
            ScreenId::Recordings => recordings::TITLE,
            ScreenId::Bench => bench::TITLE,
        }
    }

    /// A shorter name, where all tabs have to fit in 80 columns.
    pub const fn short_title(self) -> &'static str {
        match self {
            ScreenId::Connect => "Link",
            ScreenId::Overview => "Unit",
            ScreenId::Terminal => "Term",
            ScreenId::Load => "Load",
            ScreenId::Dictionary => "Dict",
            ScreenId::Stream => stream::TITLE,
            ScreenId::Diagnostics => "Diag",
            ScreenId::Recordings => "Rec",
            ScreenId::Bench => bench::TITLE,
        }
    }

    /// Keys of the screen.
    pub const fn bindings(self) -> &'static [Binding] {
        match self {
            ScreenId::Connect => connect::BINDINGS,
            ScreenId::Overview => overview::BINDINGS,
            ScreenId::Terminal => terminal::BINDINGS,
            ScreenId::Load => load::BINDINGS,
            ScreenId::Dictionary => dictionary::BINDINGS,
            ScreenId::Stream => stream::BINDINGS,
            ScreenId::Diagnostics => diagnostics::BINDINGS,
            ScreenId::Recordings => recordings::BINDINGS,
            ScreenId::Bench => bench::BINDINGS,
        }
    }

    /// What the footer leaves out first where there is no room for all keys: F1 has them all.
    pub const fn dispensable(self) -> &'static [Cmd] {
        match self {
            ScreenId::Connect => &[Cmd::Refresh, Cmd::Down],
            ScreenId::Overview => &[Cmd::Down],
            ScreenId::Load => &[Cmd::Last, Cmd::Refresh, Cmd::Loader, Cmd::Down],
            ScreenId::Dictionary => &[Cmd::Back, Cmd::Down],
            ScreenId::Stream => &[Cmd::Restart, Cmd::Accept, Cmd::Last, Cmd::Right, Cmd::Down],
            ScreenId::Diagnostics => &[],
            ScreenId::Recordings => &[Cmd::Refresh, Cmd::Last, Cmd::Slower, Cmd::Faster, Cmd::Down],
            ScreenId::Bench => &[Cmd::Right, Cmd::Down],
            ScreenId::Terminal => &[Cmd::Times, Cmd::SendFile, Cmd::Hex],
        }
    }

    /// The screen `steps` further, around the end.
    pub fn step(self, steps: usize) -> ScreenId {
        let position = ScreenId::ALL.iter().position(|&id| id == self).unwrap_or_default();
        ScreenId::ALL[(position + steps) % ScreenId::ALL.len()]
    }
}
