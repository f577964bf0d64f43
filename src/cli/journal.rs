//! What the journal of uploads knows of a unit that says little: which software it was to get.

use super::link;
use super::output::Output;
use super::talk::Talk;
use crate::host::journal::{Journal, Note};
use crate::session::{Facts, LoadReport, UnitNow, UnitState};
use crate::version::Version;

/// The journal's part in what is done on one port.
pub struct Desk {
    journal: Option<(Journal, String)>,
    /// The upload that began here and has not ended well, unless the unit runs its software.
    pub note: Option<Note>,
}

impl Desk {
    /// Looks up what is noted of this port. The unit has been identified.
    pub fn of(talk: &Talk) -> Self {
        let journal = link::journal_key(talk.spec()).and_then(|key| Some((Journal::of_user()?, key)));
        // A loader that erases its flash, or has lost its place in a record, does not say that it is one.
        let says_nothing = talk.session().facts().state != UnitState::Application;
        let note = journal.as_ref().filter(|_| says_nothing).and_then(|(journal, key)| journal.note(key));
        Desk { journal, note }
    }

    /// The note, if it knows the unit as another product than the user says and the unit itself does not say.
    pub fn against(&self, facts: &Facts, product: &str) -> Option<&Note> {
        self.note.as_ref().filter(|note| facts.product.is_none() && !note.product.eq_ignore_ascii_case(product))
    }

    /// The software that ran before the noted upload, if that was to this product.
    pub fn ran(&self, product: &str) -> Option<Version> {
        self.note.as_ref().filter(|note| note.product.eq_ignore_ascii_case(product))?.ran
    }

    /// What is to be noted of this upload, if anything can be. A note that knows the unit as another product stays what
    /// it is until the unit runs: an attempt that fails proves nothing against it.
    pub fn compose(&self, facts: &Facts, product: Option<&str>, image: &str, talk: &Talk) -> Option<Note> {
        let said = facts.product.as_ref().map(|known| known.value.as_str());
        let product = said.or(product)?.to_owned();
        let unix_seconds = talk.calendar().at(talk.now()).as_second();
        if let Some(note) = self.against(facts, &product) {
            return Some(Note { unix_seconds, ..note.clone() });
        }
        // A loader does not say what ran before it was entered.
        let ran = facts.version.as_ref().map(|known| known.value).or_else(|| self.ran(&product));
        Some(Note { product, image: image.to_owned(), unix_seconds, ran })
    }

    /// Notes that an upload begins.
    pub fn begin(&self, note: Note, output: &mut Output) {
        let Some((journal, key)) = &self.journal else { return };
        if let Err(error) = journal.begin(key, note) {
            output.remark(&format!("axcon: this upload is not noted, so a failed one will want --product: {error}"));
        }
    }

    /// Forgets the upload if the unit runs.
    pub fn end(&self, report: &LoadReport, output: &mut Output) {
        let Some((journal, key)) = &self.journal else { return };
        if report.unit == UnitNow::Application
            && let Err(error) = journal.end(key)
        {
            output.remark(&format!("axcon: the note of this upload stays: {error}"));
        }
    }
}
