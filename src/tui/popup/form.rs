//! A line that is typed in a question.

use std::borrow::Cow;
use std::path::PathBuf;

use crate::tui::widgets::field::TextField;

/// A line that is typed.
#[derive(Debug, Default)]
pub struct Form {
    /// What has been typed.
    pub typed: TextField,
    /// What is wrong with it.
    pub complaint: Option<Cow<'static, str>>,
    /// What was made of it and is on its way, until there is an answer.
    pub sent: Option<Sent>,
}

/// What was made of a line that was typed.
#[derive(Debug, PartialEq, Eq)]
pub enum Sent {
    /// An order to the emulated unit.
    Order(String),
    /// A file that is being written under this name.
    File(PathBuf),
}

impl Form {
    /// A line with this text in it.
    pub(super) fn with(text: impl Into<String>) -> Self {
        Form { typed: TextField::new(text), ..Form::default() }
    }

    /// What has been typed, without the blanks around it.
    pub(super) fn text(&self) -> &str {
        self.typed.text().trim()
    }

    /// Changes what has been typed. What was wrong with it was wrong with what it was.
    pub(super) fn edit(&mut self, change: impl FnOnce(&mut TextField)) {
        self.complaint = None;
        change(&mut self.typed);
    }

    /// Says what is wrong with it. Nothing of it is on its way then.
    pub(super) fn refuse(&mut self, why: impl Into<Cow<'static, str>>) {
        (self.sent, self.complaint) = (None, Some(why.into()));
    }
}
