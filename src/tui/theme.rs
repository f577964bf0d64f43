//! Colours and attributes, in one place.
//!
//! Nothing on the screen is said by colour alone: every state has its word, every selection its bar. Without colours
//! (`NO_COLOR`, monochrome terminals) the attributes bold, dim and reversed remain. Only the terminal's own eight colours
//! are used, so that what its owner has made of them holds here too.

use ratatui::style::{Color, Modifier, Style};

use crate::wire::stream::Reading;

/// Which colours there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Palette {
    /// For light letters on a dark ground.
    #[default]
    Dark,
    /// For dark letters on a light ground, where yellow and cyan cannot be read.
    Light,
    /// None.
    Mono,
}

impl Palette {
    /// The one after it, for a key.
    pub const fn next(self) -> Self {
        match self {
            Palette::Dark => Palette::Light,
            Palette::Light => Palette::Mono,
            Palette::Mono => Palette::Dark,
        }
    }

    /// What it is for.
    pub const fn words(self) -> &'static str {
        match self {
            Palette::Dark => "for a dark ground",
            Palette::Light => "for a light ground",
            Palette::Mono => "none",
        }
    }
}

/// How things look.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    palette: Palette,
}

impl Theme {
    /// A theme with these colours.
    pub const fn new(palette: Palette) -> Self {
        Theme { palette }
    }

    /// Its colours.
    pub const fn palette(self) -> Palette {
        self.palette
    }

    /// Header line and selected rows.
    pub fn bar(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// Headings.
    pub fn heading(self) -> Style {
        self.tint(Color::Cyan, Color::Blue).add_modifier(Modifier::BOLD)
    }

    /// Keys in hints.
    pub fn key(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    /// Rules, labels and explanations.
    pub fn quiet(self) -> Style {
        Style::new().add_modifier(Modifier::DIM)
    }

    /// What one came for.
    pub fn strong(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    /// All is well.
    pub fn good(self) -> Style {
        self.tint(Color::Green, Color::Green).add_modifier(Modifier::BOLD)
    }

    /// Worth a look.
    pub fn warning(self) -> Style {
        self.tint(Color::Yellow, Color::Magenta).add_modifier(Modifier::BOLD)
    }

    /// Wrong.
    pub fn bad(self) -> Style {
        self.tint(Color::Red, Color::Red).add_modifier(Modifier::BOLD)
    }

    /// A message that must not be overlooked, such as a lost link.
    pub fn alarm(self) -> Style {
        self.bad().add_modifier(Modifier::REVERSED)
    }

    /// A channel's state.
    pub fn state(self, reading: Reading) -> Style {
        match reading {
            Reading::Value(_) => self.good(),
            Reading::Disabled => self.quiet(),
            Reading::Open | Reading::Short | Reading::Error => self.bad(),
        }
    }

    /// What we sent, in the terminal.
    pub fn sent(self) -> Style {
        self.tint(Color::Cyan, Color::Blue)
    }

    /// Curves.
    pub fn curve(self) -> Style {
        self.tint(Color::Cyan, Color::Blue)
    }

    fn tint(self, on_dark: Color, on_light: Color) -> Style {
        match self.palette {
            Palette::Dark => Style::new().fg(on_dark),
            Palette::Light => Style::new().fg(on_light),
            Palette::Mono => Style::new(),
        }
    }
}
