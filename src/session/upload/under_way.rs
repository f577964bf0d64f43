//! During the transfer: what the unit says, when the next record waits because of it, and in what state a failure
//! leaves the unit.

use super::super::event::Outcome;
use super::super::flaw::Flaw;
use super::super::job::Desk;
use super::transfer::Stall;
use super::verify::{LONGEST_RETURN, NEW_BANNER};
use super::{Again, Stage, Unheard, UnitNow, Upload, Verdict, records, shows_application};
use crate::time::{Duration, Instant};
use crate::wire::{LoaderError, LoaderText, Message, Prompt, Text, complains, visible};

/// How long after an error the loader may take to prompt for the file again.
const RESTART: Duration = Duration::from_secs(2);
/// Lines of unknown words that a loader may print between two acknowledgements: it may report that it erases. A menu
/// that takes records for keys prints one or two lines after each record.
const MOST_STRANGE: usize = 3;
/// From this many records per line of unknown words on, the lines are taken for a loader's progress, one for each page.
const RECORDS_TO_A_PAGE: usize = 4;
/// How long no record leaves after words that are not (yet) understood: text whose line end was lost is looked at only
/// after 60 ms of silence (`PROMPT_QUIET`), and an adapter adds 20 ms.
const HEARD_OUT: Duration = Duration::from_millis(100);
/// How long an application that shows itself after a failure may take for the rest of its banner.
const BANNER_REST: Duration = Duration::from_millis(300);
/// How long a loader with a ring may be silent after the end record before it is assumed to wait for the rest of it.
const END_UNHEARD: Duration = Duration::from_millis(1500);
/// How late, on a busy computer, a loader that was found waiting may answer the keys sent before the first record.
const LATE_ANSWER: Duration = Duration::from_secs(2);
/// Error number of g1 and g2 for a record that came while there was no place left to park it.
const OVERRUN: u32 = 5;
/// Error number of g1 and g2 for characters that were lost or damaged on the line, or came while a page was written.
const DAMAGED: u32 = 1;

impl Upload {
    /// Whether the text is the header's, which some loaders echo. It may read like any message.
    pub(super) fn is_echo_of_header(&self, text: &Text) -> bool {
        let header = records::header(self.order.image.image());
        let header = String::from_utf8_lossy(&header);
        !header.trim().is_empty() && text.text.trim() == header.trim()
    }

    /// Something was heard during the transfer. Anything but the loader's progress ends it, except a few lines of
    /// unknown words.
    pub(super) fn transferring(&mut self, text: &Text, message: &Message, desk: &mut Desk<'_>) {
        let failed = match message {
            _ if self.is_echo_of_header(text) => None,
            Message::Loader(LoaderText::Progress) => None,
            _ if self.order.flaw == Some(Flaw::SendsBehindErrors) => None,
            Message::Text if !complains(&text.text) => {
                let sent = self.transfer.as_ref().map_or(0, |transfer| transfer.reached().sent);
                if self.attempt.strange == 0 {
                    self.attempt.strange_from = sent;
                }
                if has_a_word(&text.text) {
                    self.attempt.strange += 1;
                    self.attempt.talks_until = Some(desk.now + HEARD_OUT);
                }
                let pages = (sent - self.attempt.strange_from.min(sent)) / RECORDS_TO_A_PAGE;
                let what = "what answers does not talk as a loader does".to_owned();
                (self.attempt.strange > MOST_STRANGE.max(pages)).then_some((what, UnitNow::Unknown))
            }
            Message::Text | Message::Refusal => {
                Some((format!("the loader complains: \"{}\"", visible::quoted(&text.text)), UnitNow::Unknown))
            }
            Message::Loader(LoaderText::Error(error)) => {
                Some((format!("the loader reports error {error}"), UnitNow::Loader))
            }
            Message::Loader(LoaderText::Waiting | LoaderText::Restarting | LoaderText::AnyKey | LoaderText::Header)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                Some(("the loader started over and wants the file from its beginning".to_owned(), UnitNow::Loader))
            }
            Message::Loader(LoaderText::Loaded | LoaderText::Started) => {
                Some(("the loader says it is done before the end of the file was sent".to_owned(), UnitNow::Unknown))
            }
            Message::Prompt(_) => {
                Some(("the unit asks for something else in the middle of the file".to_owned(), UnitNow::Unknown))
            }
            Message::MenuKey(_)
            | Message::Software(_)
            | Message::Network(_)
            | Message::FirstStart
            | Message::Row(_) => {
                Some(("the unit left its loader in the middle of the file".to_owned(), UnitNow::Application))
            }
        };
        match failed {
            None => {
                if let Some(transfer) = &mut self.transfer {
                    transfer.heard();
                }
            }
            Some((what, unit)) => {
                desk.transmitter.clear();
                if unit != UnitNow::Loader {
                    // The records on their way may have acted as keys of a menu: leave whatever question they opened.
                    desk.leave_dialogue();
                }
                let then = self.deserves_another(message, desk);
                self.after.note(message);
                self.fail(desk, text.span.end, what, unit, then);
            }
        }
    }

    /// Until when no record leaves because words are coming. A loader that takes records prints only marks; words may
    /// begin the banner of a unit that has restarted, which would take the records for keys.
    pub(super) fn hears_out(&mut self, desk: &Desk<'_>) -> Option<Instant> {
        let words = desk.pending.map_or("", |text| &text.text);
        let talks = has_a_word(words) || desk.pending.is_some_and(|text| self.is_complaint(text));
        let letters = if talks { words.chars().filter(char::is_ascii_alphabetic).collect() } else { String::new() };
        if self.attempt.talk != letters {
            self.attempt.talks_until =
                (!letters.is_empty()).then_some(desk.now + HEARD_OUT).or(self.attempt.talks_until);
            self.attempt.talk = letters;
        }
        self.attempt.talks_until.filter(|&until| desk.now < until && self.order.flaw != Some(Flaw::SendsBehindErrors))
    }

    /// Whether a text without a line end is a complaint. Its line end may be lost, or it may go on as a question.
    fn is_complaint(&self, text: &Text) -> bool {
        self.order.flaw != Some(Flaw::SendsBehindErrors) && !self.is_echo_of_header(text) && complains(&text.text)
    }

    /// Lets the next records go, unless words are heard out, the loader complains, or the transfer has stalled.
    pub(super) fn transfer(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        if let Some(until) = self.hears_out(desk) {
            self.deadline = Some(until);
            return None;
        }
        if let Some(complaint) = desk.pending.filter(|text| self.is_complaint(text)) {
            self.heard = visible::quoted(&complaint.text);
            desk.transmitter.clear();
            let what = format!("the loader complains: \"{}\"", self.heard);
            self.fail(desk, complaint.span.end, what, UnitNow::Unknown, None);
            return None;
        }
        let transfer = self.transfer.as_mut()?;
        match transfer.advance(desk.now, desk.transmitter) {
            Ok(false) => self.deadline = transfer.deadline(),
            Ok(true) => {
                self.mark = desk.received;
                // The dots for earlier records have no line end: what follows them is newer than the end record, though
                // it is on the same line.
                desk.cut = true;
                self.stage = Stage::Finish { until: desk.now + LONGEST_RETURN };
                self.deadline = Some(desk.now + NEW_BANNER);
                let ends = transfer.may_wait_in_a_record();
                self.unheard = ends.then_some((desk.now + END_UNHEARD, Unheard::Filler));
            }
            Err(stall) => {
                let unit = if transfer.is_taken() { UnitNow::Loader } else { UnitNow::Unknown };
                let what = match stall {
                    Stall::Held => "the loader stopped us (XOFF) and did not let us go on",
                    Stall::Silent => "the loader has fallen silent: its power may be off, or the cable out",
                    Stall::Unacknowledged => "the loader has not acknowledged a record (XOFF, XON), so it may be lost",
                };
                let fill_up = transfer.may_wait_in_a_record();
                desk.transmitter.clear();
                self.fail(desk, desk.received, what.to_owned(), unit, None);
                if fill_up && stall != Stall::Held {
                    self.fill_up(desk);
                }
            }
        }
        self.report_progress(desk);
        None
    }

    /// Whether a second pass may succeed after this error, and for what reason.
    pub(super) fn deserves_another(&mut self, message: &Message, desk: &Desk<'_>) -> Option<Again> {
        let Message::Loader(LoaderText::Error(error)) = message else { return None };
        let transfer = self.transfer.as_ref()?;
        let is_too_fast = match error {
            // A loader that is sent characters while it is deaf reports DAMAGED, but so does one on a bad line. It
            // counts only if the loader's holds have not come where they were expected.
            LoaderError::Number(number) => *number == OVERRUN || *number == DAMAGED && transfer.is_surprised(),
            LoaderError::Status(_) => false,
        };
        if is_too_fast && transfer.may_go_slower() {
            return Some(Again::Slower);
        }
        let asked_at = self.asked_in_loader.take()?;
        (desk.now < asked_at + LATE_ANSWER && transfer.has_hardly_begun()).then_some(Again::AsBefore)
    }

    /// The transfer has failed: what is heard from offset `mark` on, in bytes received, decides what the unit is now.
    pub(super) fn fail(&mut self, desk: &Desk<'_>, mark: u64, what: String, unit: UnitNow, then: Option<Again>) {
        self.mark = mark;
        self.stage = Stage::Failing { what, unit, phase: self.phase(), then };
        self.deadline = Some(desk.now + RESTART);
    }

    /// The time in which the unit could show what it is now is over: ends the job.
    pub(super) fn failed(&mut self, desk: &mut Desk<'_>) -> Option<Outcome> {
        let Stage::Failing { what, unit, .. } = &self.stage else { return None };
        let (mut what, unit) = (what.clone(), *unit);
        if unit == UnitNow::Application
            && let (Some(product), Some((_, version))) = (&self.after.product, self.after.version)
        {
            what += &format!("; it runs {product} V{version} now");
        }
        self.end(desk, Verdict::Failed, unit, what)
    }

    /// Something was heard after a failure: the loader may prompt again, or an application may show itself.
    pub(super) fn failing(&mut self, message: &Message, desk: &mut Desk<'_>) -> Option<Outcome> {
        let Stage::Failing { what, phase, then, .. } = &self.stage else { return None };
        match message {
            Message::Loader(LoaderText::Waiting | LoaderText::AnyKey)
            | Message::Prompt(Prompt::WaitingForFile | Prompt::AnyKey) => {
                let (what, then) = (what.clone(), *then);
                if let (Some(then), Some(transfer)) = (then, &mut self.transfer) {
                    match then {
                        Again::Slower => transfer.start_over_slowly(),
                        Again::AsBefore => transfer.begin_again(),
                    }
                    return self.entered(desk);
                }
                self.end(desk, Verdict::Failed, UnitNow::Loader, what)
            }
            _ if shows_application(message) => {
                let what = what.clone();
                self.after.note(message);
                self.stage = Stage::Failing { what, unit: UnitNow::Application, phase: *phase, then: None };
                // Product and version may be on another line, before this one or after it.
                self.deadline = self.deadline.min(Some(desk.now + BANNER_REST));
                None
            }
            _ => None,
        }
    }

    /// After the end record or a failure the unit is heard: what would be sent to a silent loader is not needed, and
    /// the rest of a [`FILLER`](super::FILLER) is withdrawn. Progress marks do not count: having no line end, those of
    /// earlier records are heard late.
    pub(super) fn listen(&mut self, message: &Message, desk: &mut Desk<'_>) {
        match self.stage {
            _ if matches!(message, Message::Loader(LoaderText::Progress)) => {}
            Stage::Finish { .. } | Stage::Failing { .. } => {
                self.unheard = None;
                if std::mem::take(&mut self.attempt.filled) {
                    desk.transmitter.clear();
                }
            }
            Stage::Check(_)
            | Stage::AskedForLoader(_)
            | Stage::PasswordSent
            | Stage::AskWho(_)
            | Stage::Settle { .. }
            | Stage::Transfer
            | Stage::AskVersion(_) => {}
        }
    }
}

/// Whether a text has a word in it, which damaged characters and digits of a record do not make.
fn has_a_word(text: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphabetic())
        .any(|word| word.len() >= 4 && !word.bytes().all(|c| c.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_told_from_damage_and_digits() {
        for text in ["Erasing sector 5", "0x0400: done", "x1yz Vorg\u{e4}nge", "\u{1}\u{2}ready\u{3}"] {
            assert!(has_a_word(text), "{text:?}");
        }
        // A word has at least four letters, not all of them hexadecimal digits.
        for text in ["", "ok 12 go", "S3150000", "DEADBEEF cafe", "a1b2c3d4", "0123456789", "...."] {
            assert!(!has_a_word(text), "{text:?}");
        }
    }

    #[test]
    fn the_echo_of_the_header_is_no_complaint_whatever_it_says() {
        use crate::image::{check, srecord};
        use crate::record::Span;
        use crate::session::LoadOrder;
        let mut file = Vec::new();
        srecord::write_header(b"FAILSAFE", &mut file);
        file.extend_from_slice(b"\nS307000000001122C5\nS70500000000FA\n");
        let report = check(file.as_slice(), None, &[], None, &[]).expect("a slice");
        let upload = Upload::new(LoadOrder::new(report.image().expect("nothing is wrong with it"), None));
        let complains = |text: &str| upload.is_complaint(&Text { span: Span::default(), text: text.to_owned() });
        assert!(!complains("FAILSAFE") && !complains(" FAILSAFE ") && complains("FAILSAFE: off"));
    }
}
