//! The screens: each with its title, its keys, what they do, and its picture.
//!
//! A screen holds its own cursor and scroll positions and nothing else; what is known lies in the view.

pub mod connect;
pub mod help;
pub mod load;
pub mod overview;
pub mod terminal;

use super::keymap::Binding;
use super::scrollback::Scrollback;
use super::theme::Theme;
use super::view::View;
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
    pub const ALL: [ScreenId; 4] = [ScreenId::Connect, ScreenId::Overview, ScreenId::Terminal, ScreenId::Load];

    /// Name on the tab.
    pub const fn title(self) -> &'static str {
        match self {
            ScreenId::Connect => connect::TITLE,
            ScreenId::Overview => overview::TITLE,
            ScreenId::Terminal => terminal::TITLE,
            ScreenId::Load => load::TITLE,
        }
    }

    /// Keys of the screen.
    pub const fn bindings(self) -> &'static [Binding] {
        match self {
            ScreenId::Connect => connect::BINDINGS,
            ScreenId::Overview => overview::BINDINGS,
            ScreenId::Terminal => terminal::BINDINGS,
            ScreenId::Load => load::BINDINGS,
        }
    }

    /// The screen `steps` further, around the end.
    pub fn step(self, steps: usize) -> ScreenId {
        let position = ScreenId::ALL.iter().position(|&id| id == self).unwrap_or_default();
        ScreenId::ALL[(position + steps) % ScreenId::ALL.len()]
    }
}
