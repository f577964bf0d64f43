//! What the session's events make of what the screens may read.

use super::mark::read_mark;
use super::{DictionaryRead, LinkState, Refutation, Tone, View};
use crate::canopen::{ObjectAddress, Value};
use crate::dump::Dump;
use crate::monitor::Mark;
use crate::record::LINK_LOST;
use crate::session::{
    Awaited, DictionaryReading, Event, Facts, FileEnd, Job, Origin, Outcome, ReadEntry, UnitState, Verdict, WalkEnd,
};
use crate::time::Instant;
use crate::tui::visible::sentence;
use crate::tui::widgets::format;
use crate::wire::visible;

/// Serial number of the identity object (CiA 301; both manuals, section 3.3).
const SERIAL_NUMBER: ObjectAddress = ObjectAddress::new(0x1018, 4);

impl View {
    /// Takes in one event; `facts` are the session's at that moment.
    pub fn fold(&mut self, now: Instant, event: &Event, facts: &Facts) {
        match event {
            Event::Heard { .. } => {}
            Event::Overheard { at, reading } => self.dictionary_overheard(*at, reading),
            Event::EntriesRead(count) => self.unit.entries_read = *count,
            Event::Row { .. } | Event::Page { .. } if self.returning.is_some() => {
                if let Some(returning) = &mut self.returning {
                    returning.keep(event.clone());
                }
            }
            Event::Row { .. } | Event::Page { .. } => {
                let product = self.product();
                self.unit.monitor.fold(event, product);
            }
            Event::FactsChanged => self.facts_changed(now, facts),
            Event::Held(true) => self.load.held_since = Some(now),
            Event::Held(false) => self.load.held_since = None,
            Event::Progress(progress) => {
                self.job = Some(Job::Load);
                self.load.progress = Some(*progress);
            }
            Event::FileProgress { sent, .. } => {
                if let Some(sending) = &mut self.unit.sending {
                    sending.sent = *sent;
                }
            }
            Event::FileHeld { .. } => {
                self.tell(Tone::Bad, "The unit does not let the file go on (XOFF): Esc ends the wait.");
            }
            Event::Finished(outcome) => self.finished(now, outcome),
        }
    }

    /// A remark in a recording: where it is a mark, it is one again. A link that was lost then is lost.
    pub fn remarked(&mut self, at: Instant, text: &str) {
        if text == LINK_LOST {
            self.unit.is_cut_off = true;
            self.unit.monitor.stream.interrupt();
        }
        if let Some((number, before)) = read_mark(text) {
            let at = Instant::ZERO + at.since_start().saturating_sub(before);
            self.unit.monitor.stream.set_mark(Mark { number, at });
        }
    }

    fn facts_changed(&mut self, now: Instant, facts: &Facts) {
        let said = |facts: &Facts| facts.nmt_state.as_ref().map(|known| known.span);
        if said(facts) != said(&self.facts) {
            self.nmt_heard = said(facts).map(|_| now);
            self.ages_at = self.nmt_heard.map(|heard| format::ages_at(heard, now));
        }
        if facts.state == UnitState::Application && self.facts.state != UnitState::Application {
            // Whatever sub-menu was open, a restart has closed it.
            self.unit.viewing = false;
        }
        let banner = |facts: &Facts| {
            facts.version.as_ref().filter(|known| known.origin == Origin::Banner).map(|known| known.span)
        };
        let has_started = banner(facts).is_some() && banner(facts) != banner(&self.facts);
        let refutation = self.notice.as_ref().and_then(|notice| notice.refuted_by);
        if refutation.is_some_and(|refutation| refutation.has_come(facts)) {
            self.forget_notice();
        }
        let was_loader = self.facts.state == UnitState::Loader && facts.state != UnitState::Loader;
        if has_started || was_loader {
            self.unit.monitor.stream.interrupt();
        }
        match (self.facts.stream, facts.stream) {
            // A unit that is away, or restarts, has not been switched off by that.
            (Some(_), None) => {
                let is_away = self.returning.is_some() || has_started || facts.state == UnitState::Loader;
                let is_away = is_away || self.unit.is_cut_off;
                (self.unit.stream_is_off, self.unit.monitor.stream.late) = (!is_away, false);
            }
            (None, None) => {}
            (None, Some(_)) => {
                (self.unit.stream_is_off, self.unit.is_cut_off) = (false, false);
                self.unit.monitor.stream.switched_on(now);
            }
            (Some(_), Some(_)) => {}
        }
        // What was written and not stored is gone, and the defaults or other software bring other values.
        if has_started || was_loader || facts.state == UnitState::Loader {
            self.outdate_dictionary();
        }
        if self.job == Some(Job::StreamOn) && facts.stream.is_some() && self.facts.stream.is_none() {
            self.unit.monitor.stream.set_period(self.unit.wanted_period);
        }
        let product_before = self.product();
        self.facts = facts.clone();
        let product = self.product();
        // While it is asked who is there, the dictionary is history and stays as it was.
        if product_before != product
            && self.returning.is_none()
            && let Some(read) = &mut self.unit.dictionary
        {
            // What was read gets its names, and something to be compared with.
            read.dump = Dump::of(&read.reading, product, &self.facts);
        }
    }

    fn finished(&mut self, now: Instant, outcome: &Outcome) {
        self.job = None;
        match outcome {
            Outcome::Done(Job::RestoreDefaults) => {
                self.outdate_dictionary();
                self.tell(Tone::Good, done(Job::RestoreDefaults));
            }
            Outcome::DefaultsTaken => {
                self.outdate_dictionary();
                self.tell(Tone::Good, "The unit has taken the Yes and shows its menu; no restart was seen.");
            }
            Outcome::DictionaryRead(reading) => self.walk_ended(now, reading),
            Outcome::Identified => self.identified(),
            // The end of a recording is reported by its reader, with the reason.
            Outcome::Done(Job::Overhear) => {}
            Outcome::StreamRuns { was_on } => self.stream_runs(*was_on),
            Outcome::Done(Job::StreamOff) => {
                self.unit.monitor.stream.set_period(None);
                self.unit.stream_is_off = true;
                self.tell_until(Refutation::Stream, Tone::Good, done(Job::StreamOff));
            }
            Outcome::Done(Job::Diagnostics) => {
                self.tell_until(Refutation::Page, Tone::Good, done(Job::Diagnostics));
            }
            Outcome::Done(job) => self.tell(Tone::Good, done(*job)),
            Outcome::NoAnswer { awaited: awaited @ (Awaited::Page | Awaited::NextPage), .. } => {
                self.tell_until(Refutation::Page, Tone::Bad, format!("No answer: {awaited}."));
            }
            Outcome::NoAnswer { awaited, .. } => self.tell(Tone::Bad, format!("No answer: {awaited}.")),
            Outcome::Refused { job, reason, .. } => {
                self.tell(Tone::Bad, format!("The unit refused, {}: {reason}", job.doing()));
            }
            Outcome::Cancelled(job) => self.job_cancelled(*job),
            Outcome::FileSent { sent, total, end } => self.file_sent(*sent, *total, *end),
            Outcome::Loaded(report) => {
                self.load.progress = None;
                self.load.held_since = None;
                self.load.product_unknown = report.verdict == Verdict::Refused && report.product.is_none();
                // What the report says of the unit holds only up to the unit's last words.
                self.load.is_silent = report.left_in_the_middle() && self.can_send() && self.is_silent_since(now);
                self.load.is_of_earlier_unit = false;
                self.load.report = Some((**report).clone());
            }
        }
    }

    /// The object dictionary is read, to its end or not.
    fn walk_ended(&mut self, now: Instant, reading: &DictionaryReading) {
        // Its view was left again.
        self.unit.viewing = false;
        self.unit.monitor.stream.interrupt();
        let is_cancelled = reading.end == WalkEnd::Cancelled;
        // A whole one stays.
        if !is_cancelled || self.current_dictionary().is_none_or(|read| !read.reading.is_complete()) {
            self.dictionary_read(now, reading);
        }
        if is_cancelled {
            self.tell(Tone::Quiet, cancelled(Job::ReadDictionary));
        }
    }

    fn stream_runs(&mut self, was_on: bool) {
        let period = self.unit.wanted_period.take();
        self.unit.last_period = period.or(self.unit.last_period);
        self.unit.monitor.stream.set_period(period);
        let text =
            if was_on { "The stream was on already and now sends what you asked for." } else { done(Job::StreamOn) };
        self.tell(Tone::Good, text);
    }

    fn job_cancelled(&mut self, job: Job) {
        match job {
            Job::StreamOn if self.facts.stream.is_some() => {
                self.tell(Tone::Quiet, "The stream is switched on; its first row has not come yet.");
            }
            job if matches!(self.link.state, LinkState::Lost(_)) => {
                self.tell(Tone::Bad, format!("The link was lost, {}.", job.doing()));
            }
            Job::Diagnostics => self.tell_until(Refutation::Page, Tone::Quiet, done(Job::Diagnostics)),
            job => self.tell(Tone::Quiet, cancelled(job)),
        }
    }

    fn file_sent(&mut self, sent: usize, total: usize, end: FileEnd) {
        let name = self.unit.sending.take().map_or_else(|| "the file".to_owned(), |sending| sending.name);
        let (sent, total) = (format::grouped(sent), format::counted(total, "byte"));
        match end {
            FileEnd::Whole => self.tell(Tone::Good, format!("Sent: all of {name} has left, {total}.")),
            FileEnd::Cancelled => {
                self.tell(Tone::Bad, format!("Cancelled after {sent} of the {total} of {name}."));
            }
            FileEnd::LinkLost => {
                let text = format!("The link was lost when about {sent} of the {total} of {name} had left.");
                self.tell(Tone::Bad, text);
            }
        }
    }

    /// In a recording: what was broken off later does not undo what was read to its end.
    fn dictionary_overheard(&mut self, at: Instant, reading: &DictionaryReading) {
        match self.current_dictionary() {
            Some(read) if read.reading.is_complete() && !reading.is_complete() => {
                self.tell(Tone::Bad, "The object dictionary was read once more, not to its end.");
            }
            _ => self.dictionary_read(at, reading),
        }
    }

    fn dictionary_read(&mut self, now: Instant, reading: &DictionaryReading) {
        let dump = Dump::of(reading, self.product(), &self.facts);
        let (entries, deviations) = (format::counted(dump.entries.len(), "entry"), dump.deviations());
        if dump.complete {
            let compared = match self.product() {
                Some(_) => format!("{deviations} not as the factory's"),
                None => "compared with nothing, as the product is not known".into(),
            };
            self.tell(Tone::Good, format!("The dictionary is read: {entries}, {compared}."));
        } else {
            let were = if dump.entries.len() == 1 { "was" } else { "were" };
            self.tell(
                Tone::Bad,
                match &reading.end {
                    WalkEnd::NotUnderstood { first } => {
                        let first = visible::line(first.as_bytes());
                        format!("Not all of it is understood, first: \"{first}\". {entries} {were} read.")
                    }
                    WalkEnd::Restarted => format!("The unit restarted in the middle of it: {entries} {were} read."),
                    WalkEnd::Whole | WalkEnd::Stopped | WalkEnd::Cancelled => {
                        format!("Not all of the object dictionary was shown: {entries} {were} read.")
                    }
                },
            );
        }
        let serial = reading.entries.iter().find(|read| read.at == SERIAL_NUMBER).and_then(ReadEntry::value);
        self.unit.serial = serial.and_then(Value::as_integer).and_then(|number| u32::try_from(number).ok());
        self.unit.dictionary = Some(DictionaryRead { dump, reading: reading.clone(), at: now, is_outdated: false });
    }

    /// The unit has other values now than those that were read.
    fn outdate_dictionary(&mut self) {
        if let Some(read) = &mut self.unit.dictionary {
            read.is_outdated = true;
        }
    }

    fn identified(&mut self) {
        let version = self.facts.version.as_ref().map(|known| format!(" {}", known.value)).unwrap_or_default();
        match (self.facts.state, &self.facts.product) {
            (UnitState::Silent, _) => {
                let text = "Nobody has answered: check power, cable and port.";
                self.tell_until(Refutation::Answer, Tone::Bad, text);
            }
            (UnitState::Loader, _) => {
                let which =
                    self.noted().map_or_else(String::new, |noted| format!(", an {} by our notes,", noted.product));
                self.tell(Tone::Quiet, format!("The unit{which} waits in its loader: L loads a file."));
            }
            (UnitState::Unknown | UnitState::Application, Some(product)) => {
                let text = format!("The unit is an {}{version}.", product.value);
                self.tell(Tone::Good, text);
            }
            (UnitState::Unknown | UnitState::Application, None) => {
                let text = "The unit talks, but does not say what it is: V reads that, a power cycle shows it.";
                self.tell_until(Refutation::Product, Tone::Quiet, text);
            }
        }
    }
}

impl Refutation {
    fn has_come(self, facts: &Facts) -> bool {
        match self {
            Refutation::Answer => facts.state != UnitState::Silent,
            Refutation::Product => facts.product.is_some(),
            Refutation::Page => facts.diagnostics.is_some(),
            Refutation::Stream => facts.stream.is_some(),
        }
    }
}

fn cancelled(job: Job) -> String {
    format!("{} was cancelled.", sentence(job.doing()))
}

fn done(job: Job) -> &'static str {
    match job {
        Job::Identify => "The unit has answered.",
        Job::StreamOn => "The stream is on, also after a power cycle, until T switches it off.",
        Job::StreamOff => "The stream is off.",
        Job::RestoreDefaults => "The defaults are restored and the unit has restarted.",
        Job::ReadDictionary => "The object dictionary has been read.",
        Job::Diagnostics => "The diagnostics are off.",
        Job::Overhear => "This is the end of the recording. 3 shows all of it.",
        Job::Load => "The upload has ended.",
        Job::SendFile => "The file has been sent.",
    }
}
