//! When the values on the screen are not those of now.

use super::{LinkState, View};
use crate::session::{Job, UnitState};

/// Why the values that are shown are those of before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Old {
    /// Nothing comes from it any more.
    LinkLost,
    /// The unit runs its loader, and measures nothing.
    InLoader,
    /// It has not answered.
    Silent,
    /// It measures nothing while it shows its object dictionary ...
    DictionaryIsRead,
    /// ... nor while its view is open.
    Viewing,
    /// It measures, and does not say what.
    StreamOff,
    /// It has said nothing since it is there again: its stream may be off, or slow.
    NotHeard,
    /// It should have said something by now.
    NoRow,
    /// It will say something, but has not yet.
    NoRowYet,
}

impl Old {
    /// The reason alone, for a line that has more to say.
    pub fn reason(self) -> &'static str {
        match self {
            Old::LinkLost => "The link is lost.",
            Old::InLoader => "The unit is in its loader.",
            Old::Silent => "The unit has not answered.",
            Old::DictionaryIsRead => "The dictionary is being read.",
            Old::Viewing => "The view is open.",
            Old::StreamOff => "The stream is off.",
            Old::NotHeard => "No row yet.",
            Old::NoRow => "No new row: old values.",
            Old::NoRowYet => "No row yet.",
        }
    }

    /// The reason, what it means for the values, and what to do about it.
    pub fn text(self) -> &'static str {
        match self {
            Old::LinkLost => "The link is lost: these are its last values.",
            Old::InLoader => "The unit is in its loader: these are its last values. L loads software.",
            Old::Silent => "The unit has not answered: these are its last values. Check power, M asks.",
            Old::DictionaryIsRead => "These values are old: the unit measures nothing while its dictionary is read.",
            Old::Viewing => "These values are old: the view is open and halts the unit. M closes it.",
            Old::StreamOff => "The stream is off: these are its last values. T switches it on.",
            Old::NotHeard => "No row since the unit came back: these are its last values. T switches it on.",
            Old::NoRow => "No new row: these values are old. M asks whether the unit still answers.",
            Old::NoRowYet => "The stream is on: no row has come yet, these values are from before.",
        }
    }
}

impl View {
    /// Why the values that are shown are those of before, if there are any and they are.
    pub fn why_old(&self) -> Option<Old> {
        let stream = &self.unit.monitor.stream;
        stream.newest?;
        match self.facts.state {
            _ if matches!(self.link.state, LinkState::Lost(_)) => Some(Old::LinkLost),
            UnitState::Loader => Some(Old::InLoader),
            UnitState::Silent => Some(Old::Silent),
            _ if self.job == Some(Job::ReadDictionary) => Some(Old::DictionaryIsRead),
            _ if self.unit.viewing => Some(Old::Viewing),
            _ if self.facts.stream.is_none() && self.unit.stream_is_off => Some(Old::StreamOff),
            _ if self.facts.stream.is_none() => Some(Old::NotHeard),
            _ if stream.late => Some(Old::NoRow),
            _ if stream.awaits_first_row() => Some(Old::NoRowYet),
            UnitState::Unknown | UnitState::Application => None,
        }
    }
}
