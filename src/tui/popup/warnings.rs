//! What an answer brings about that is not in the question itself.

use crate::session::{Job, Phase};
use crate::time::BITS_PER_CHARACTER;
use crate::tui::view::View;
use crate::tui::widgets::format;
use crate::wire::stream::Source;

/// What becomes of the rows on the screen, if they are of the other source.
pub(super) fn loses_rows(view: &View, source: Source) -> Option<String> {
    let stream = &view.unit.monitor.stream;
    let rows = stream.source.filter(|shown| *shown != source).map(|_| format::counted(stream.rows, "row"))?;
    Some(format!("The screens restart with it: {rows} of the other kind stay in the recording only."))
}

/// What happens if the line cannot carry a row this often.
pub(super) fn too_fast(view: &View, source: Source, millis: &str) -> Option<String> {
    let period = millis.parse::<f64>().ok().filter(|&millis| millis > 0.0)? / 1000.0;
    let characters = view.product()?.stream.row_characters(source) as f64;
    let carries = f64::from(view.link.baud) / f64::from(BITS_PER_CHARACTER);
    let least = (characters / carries * 1000.0).ceil();
    (characters / period > carries).then(|| {
        format!(
            "A row has {characters} characters: the line carries one every {least} ms, the unit will leave rows out."
        )
    })
}

/// What is in the middle or left undone, and what becomes of it when the link is closed.
pub fn in_the_middle(view: &View) -> [&'static str; 2] {
    match view.job {
        Some(Job::Load) => {
            ["New software is being loaded.", consequence(view.load.progress.map(|progress| progress.phase))]
        }
        Some(Job::ReadDictionary) => [
            "The object dictionary is being read: temperature scanning and CAN are halted.",
            "axcon leaves the view first (X), so that they go on.",
        ],
        Some(Job::Diagnostics) => ["The unit prints its diagnostics.", "axcon stops them first (S)."],
        Some(Job::SendFile) => [
            "A file is being sent to the unit.",
            "What of it has not left yet stays here: the unit has part of it then.",
        ],
        Some(Job::StreamOn | Job::StreamOff | Job::RestoreDefaults) => {
            ["The unit is in the middle of its questions.", "axcon ends them first, so that it is at its menu again."]
        }
        None | Some(Job::Identify | Job::Overhear) if view.question.is_some() => [
            "The unit's question after a key typed on the terminal is still open.",
            "It stays open and takes the next key as its answer, no matter who sends it: Enter on the terminal ends it.",
        ],
        None | Some(Job::Identify | Job::Overhear) if view.waits_in_loader() => [
            "The unit waits in its loader for a file: it neither measures nor talks on CAN.",
            "It needs the file sent again (L), now or later: without power it comes back to its loader.",
        ],
        None | Some(Job::Identify | Job::Overhear) => [
            "The unit's view is open: temperature scanning and CAN are halted.",
            "axcon closes it first (X), so that they go on.",
        ],
    }
}

/// What cancelling the upload in this phase leaves behind.
pub(super) fn consequence(phase: Option<Phase>) -> &'static str {
    match phase {
        None | Some(Phase::Check) => "Nothing has been changed yet: the unit goes on with what it has.",
        Some(Phase::EnterLoader) => {
            "The unit is on its way into its loader. It may wait there until a complete file has been sent."
        }
        Some(Phase::Erase | Phase::Transfer | Phase::Finish) => {
            "The unit's software is incomplete then. It waits in its loader, without scanning and without CAN, until a \
             complete file has been sent. It is not harmed by that."
        }
        Some(Phase::Verify) => {
            "The file has been sent completely. Only the proof is missing: without it nobody knows what the unit runs."
        }
    }
}
