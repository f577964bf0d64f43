//! What a unit has shown so far, kept in bounded memory: the values of its stream with their trends, faults, diagnostics,
//! and the text of the line. The console shows it, a report prints it.

mod diagnostics;
mod scrollback;
mod stand_in;
mod stream;
mod trend;

pub use diagnostics::{Diagnostics, Tracked};
pub use scrollback::{KEPT_LINES, Origin, Scrollback, TextLine};
pub use stand_in::StandIn;
pub use stream::{Channel, Fault, Faults, Mark, Sample, Stream};

use crate::device::Product;
use crate::session::Event;

/// Values, faults and diagnostics.
#[derive(Debug, Default)]
pub struct Monitor {
    /// The data stream.
    pub stream: Stream,
    /// Faults seen since connecting.
    pub faults: Faults,
    /// The unit's diagnostics.
    pub diagnostics: Diagnostics,
}

impl Monitor {
    /// Takes in one event; the product's file has the names of the channels.
    pub fn fold(&mut self, event: &Event, product: Option<&Product>) {
        match event {
            Event::Row { at, row, .. } => self.stream.row(*at, row, product, &mut self.faults),
            Event::Page { at, lines } => self.diagnostics.page(*at, lines),
            Event::Heard { .. }
            | Event::EntriesRead(_)
            | Event::Overheard { .. }
            | Event::FactsChanged
            | Event::Held(_)
            | Event::Progress(_)
            | Event::FileProgress { .. }
            | Event::FileHeld { .. }
            | Event::Finished(_) => {}
        }
    }
}
