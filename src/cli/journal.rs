//! What the journal of uploads knows of a unit that says little: which software it was to get.

use super::link;
use super::output::Output;
use super::talk::Talk;
use crate::host::journal::{Journal, Note};
use crate::session::{Facts, LoadReport, UnitNow, UnitState};
use crate::version::Version;

/// The journal of uploads, as far as it is about one port.
pub struct PortJournal {
    /// The journal, and what it calls the port; `None` where nothing is noted.
    journal: Option<(Journal, String)>,
    /// The upload that began here and has not ended well, unless the unit runs its software.
    pub note: Option<Note>,
}

impl PortJournal {
    /// Looks up what is noted of this port. The unit has been identified.
    pub fn of(talk: &Talk) -> Self {
        let journal = link::journal_key(talk.spec()).and_then(|key| Some((Journal::of_user()?, key)));
        // A loader that erases its flash, or has lost its place in a record, does not say that it is one.
        let says_nothing = talk.session().facts().state != UnitState::Application;
        let note = journal.as_ref().filter(|_| says_nothing).and_then(|(journal, key)| journal.note(key));
        PortJournal { journal, note }
    }

    /// The note, if it names another product than the user does and the unit names none.
    pub fn against(&self, facts: &Facts, product: &str) -> Option<&Note> {
        self.note.as_ref().filter(|note| facts.product.is_none() && !note.product.eq_ignore_ascii_case(product))
    }

    /// The software that ran before the noted upload, if that was to this product.
    pub fn ran(&self, product: &str) -> Option<Version> {
        self.note.as_ref().filter(|note| note.product.eq_ignore_ascii_case(product))?.ran
    }

    /// The note to make of this upload; `None` if no product is known. An older note that names another product stays,
    /// with the new time, until the unit runs: an upload that fails does not prove it wrong.
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
            // Where none could be made, none stays.
            && journal.note(key).is_some()
        {
            output.remark(&format!("axcon: the note of this upload stays: {error}"));
        }
    }
}
