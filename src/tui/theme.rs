//! Colours and attributes, in one place.
//!
//! Nothing on the screen is said by colour alone: every state has its word, every selection its bar. Without colours
//! (`NO_COLOR`, monochrome terminals) the attributes bold, dim and reversed remain.

use ratatui::style::{Color, Modifier, Style};

use crate::wire::stream::Reading;

/// How things look.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    colour: bool,
}

impl Theme {
    /// A theme with or without colours.
    pub const fn new(colour: bool) -> Self {
        Theme { colour }
    }

    /// Header line and selected rows.
    pub fn bar(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// Headings.
    pub fn heading(self) -> Style {
        self.tint(Color::Cyan).add_modifier(Modifier::BOLD)
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
        self.tint(Color::Green).add_modifier(Modifier::BOLD)
    }

    /// Worth a look.
    pub fn warning(self) -> Style {
        self.tint(Color::Yellow).add_modifier(Modifier::BOLD)
    }

    /// Wrong.
    pub fn bad(self) -> Style {
        self.tint(Color::Red).add_modifier(Modifier::BOLD)
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
        self.tint(Color::Cyan)
    }

    /// Curves.
    pub fn curve(self) -> Style {
        self.tint(Color::Cyan)
    }

    fn tint(self, colour: Color) -> Style {
        if self.colour { Style::new().fg(colour) } else { Style::new() }
    }
}
