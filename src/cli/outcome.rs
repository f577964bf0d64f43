//! What a job's outcome means to the user: an error, where it is one, and what to do next.

use super::error::{CliError, Kind};
use super::talk::Talk;
use crate::record::Span;
use crate::session::{Awaited, DictionaryReading, FileEnd, Outcome};
use crate::wire::visible;

/// Characters of what a unit said that an error quotes.
const QUOTED: usize = 120;

impl Talk {
    /// The error that says that no unit answers, with what was heard instead.
    pub fn no_unit(&self) -> CliError {
        let heard = self.last_words();
        if heard.is_empty() {
            if self.is_recorded() {
                return CliError::message(Kind::NoAnswer, format!("{}: the unit says nothing in it", self.port()));
            }
            let error = CliError::message(Kind::NoAnswer, format!("{}: nothing answers", self.port()));
            return no_answer_hints(error);
        }
        CliError::message(
            Kind::NoAnswer,
            format!("{}: something talks, but it is not a unit axcon knows; last heard: \"{heard}\"", self.port()),
        )
        .hint("is it the right port? 'axcon ports' lists them, 'axcon terminal' shows everything it sends")
        .hint("a unit at another line rate sends garbage: the units have 115200 baud")
    }

    /// The error that a job's outcome is, where it is one, with what the unit said.
    ///
    /// # Errors
    /// If the outcome is not what was wanted.
    pub fn expect_done(&self, outcome: &Outcome) -> Result<(), CliError> {
        let (error, heard) = match outcome {
            Outcome::Identified
            | Outcome::Done(_)
            | Outcome::DefaultsTaken
            | Outcome::StreamRuns { .. }
            | Outcome::DictionaryRead(_) => return Ok(()),
            Outcome::Cancelled(_) => return Err(CliError::interrupted()),
            Outcome::Loaded(report) => return Err(CliError::message(Kind::Failed, report.what.clone())),
            Outcome::FileSent { end: FileEnd::Whole, .. } => return Ok(()),
            Outcome::FileSent { sent, total, end: FileEnd::Cancelled | FileEnd::LinkLost } => {
                let message = format!("{sent} of the file's {total} bytes have left");
                return Err(CliError::message(Kind::Interrupted, message));
            }
            Outcome::Refused { reason, heard, .. } => (CliError::message(Kind::UnitRefused, reason.clone()), heard),
            Outcome::NoAnswer { awaited, heard, .. } if self.is_recorded() => {
                let message = format!("the recording does not show what was looked for: {awaited}");
                (CliError::message(Kind::NoAnswer, message), heard)
            }
            Outcome::NoAnswer { awaited, heard, .. } => (unanswered(*awaited), heard),
        };
        let message = error.to_string();
        let said = heard.map(|span| self.quoted(span)).filter(|said| !said.is_empty() && !message.contains(said));
        Err(match said {
            Some(said) => {
                CliError { hints: [vec![format!("the unit said: \"{said}\"")], error.hints].concat(), ..error }
            }
            None => error,
        })
    }

    /// What was read of the object dictionary, by the job that reads it.
    ///
    /// # Errors
    /// If the outcome is another.
    pub fn expect_reading(&self, outcome: Outcome) -> Result<Box<DictionaryReading>, CliError> {
        match outcome {
            Outcome::DictionaryRead(reading) => Ok(reading),
            outcome => {
                self.expect_done(&outcome)?;
                Err(CliError::message(Kind::Failed, "the reading ended without a result"))
            }
        }
    }

    /// The end of what the unit has said, on one line.
    fn last_words(&self) -> String {
        let end = self.session().record().received();
        self.quoted(Span { start: end.saturating_sub(4 * QUOTED as u64), end })
    }

    /// What lies there in the record, on one line; of a long text its end.
    fn quoted(&self, span: Span) -> String {
        let text = visible::line(&self.session().record().bytes(span));
        let characters: Vec<char> = text.trim().chars().collect();
        characters[characters.len().saturating_sub(QUOTED)..].iter().collect()
    }
}

/// The error of a job that has waited in vain, with hints that say how it has left the unit: a question that was not
/// understood has been left with an answer that does the least harm, whatever the unit makes of it.
fn unanswered(awaited: Awaited) -> CliError {
    let message = format!("the unit did not answer as expected: {awaited}");
    let error = CliError::message(Kind::NoAnswer, message);
    const BY_HAND: &str = "'axcon terminal' shows what the unit prints, and takes the answer by hand";
    match awaited {
        Awaited::SourceQuestion | Awaited::PeriodQuestion => error
            .hint("no guess was made: the question was left with Enter. A unit that then takes a value of its own may keep it")
            .hint(BY_HAND),
        Awaited::Banner | Awaited::NothingElse => {
            CliError::message(Kind::NoAnswer, format!("the answer Yes has been given, but {awaited}"))
                .hint("'axcon identify' says whether the unit runs; 'axcon dictionary dump' shows its parameters")
        }
        Awaited::DefaultsQuestion => {
            error.hint("no guess was made: whatever the unit asked was answered with No").hint(BY_HAND)
        }
        _ => error.hint("'axcon terminal' shows what the unit prints"),
    }
}

/// The error of a job that was interrupted and has not come to an end of its own.
pub fn abandoned() -> CliError {
    CliError::interrupted()
        .hint("the unit may still be in a dialogue, or in its view with scanning halted: Enter and X leave them")
}

/// Hints for a unit that does not answer: what has to be checked, most likely first (manuals, chapter 4).
pub fn no_answer_hints(error: CliError) -> CliError {
    error
        .hint("is the unit powered? Is it the right port? 'axcon ports' lists them")
        .hint("is the cable the right way round? Ground, transmit and receive of the unit go to pins 5, 2, 3 of the DB-9:")
        .hint("pins 1, 2, 3 of the AXTC4CO's grey connector, pins 6, 7, 8 of the AXRTD8CO's")
        .hint("is the port as fast as the unit? They have 115200 baud, and so has axcon without --baud")
        .hint("a unit that another program has stopped by Xoff was sent an Xon; 'axcon terminal' shows all that comes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_question_it_is_said_how_it_was_left() {
        let hints = |awaited| {
            let error = unanswered(awaited);
            assert_eq!(error.kind, Kind::NoAnswer);
            error.hints.join(" ")
        };
        assert!(hints(Awaited::SourceQuestion).contains("left with Enter"));
        assert!(hints(Awaited::DefaultsQuestion).contains("answered with No"));
        assert!(!hints(Awaited::Row).contains("guess") && !hints(Awaited::StreamOff).contains("guess"));
    }
}
