//! The link: how it opens and closes, is lost and comes back, and how the unit on it is left.

use ratatui::crossterm::event::KeyCode;

use super::App;
use crate::monitor::Scrollback;
use crate::session::{Command, Event, Session, UnitNow, UnitState};
use crate::time::{Duration, Instant};
use crate::tui::input::{Effect, Failure, LinkInfo, LinkKind};
use crate::tui::keymap::Press;
use crate::tui::popup::Popup;
use crate::tui::returning::{Returning, Who};
use crate::tui::screens::ScreenId;
use crate::tui::view::{Link, LinkState, Tone};
use crate::tui::visible;

/// How long a unit has to answer what puts it in order before its link is closed: it prints a menu in a tenth of that,
/// and a user who leaves, or shuts the computer down, does not wait longer for a silent unit.
const WINDING_UP: Duration = Duration::from_secs(2);

/// What comes once the unit has been left in order.
#[derive(Debug)]
pub(super) enum Next {
    /// The program ends.
    Quit,
    /// The link is closed.
    Disconnect,
    /// Another link is opened.
    Open(String),
}

impl App {
    /// Whether something can be sent; if not, the user is told why.
    pub(super) fn can_send(&mut self) -> bool {
        let (what, key, to) = match &self.view.link.state {
            LinkState::Open if self.view.is_recording() => ("this is a recording", "1", "choose a link"),
            LinkState::Open => return true,
            LinkState::Opening | LinkState::Closed => ("no unit is connected", "1", "choose a link"),
            LinkState::Lost(_) => ("the link is lost", "C", "connect again"),
        };
        // There every other key is the unit's.
        let prefix = if self.passes_keys() { "Ctrl-] " } else { "" };
        let why = format!("Not sent: {what}. Press {prefix}{key} to {to}.");
        self.view.tell(Tone::Refused, why);
        false
    }

    /// Opens a link. The open one stays until the new one works, so that a name typed wrong costs nothing, except when both
    /// are the same port. A lost one stays too: what it has shown remains visible, and its cable may be plugged in again.
    pub(super) fn open(&mut self, link: String, effects: &mut Vec<Effect>) {
        let stays = match self.view.link.state {
            LinkState::Open => self.view.link.name.as_ref() != Some(&link),
            LinkState::Lost(_) => true,
            LinkState::Closed | LinkState::Opening => false,
        };
        if !stays {
            if self.view.link.state == LinkState::Open {
                effects.push(Effect::CloseLink);
            }
            self.session = None;
            self.begin_link(Link { name: Some(link.clone()), state: LinkState::Opening, ..Link::default() });
        }
        let what = format!("Opening {}.", visible::text(&link));
        self.popup = Some(Popup::Waiting { what, hint: (Press::Plain(KeyCode::Esc), "do not wait") });
        self.opening = Some(link.clone());
        effects.push(Effect::OpenLink(link));
    }

    /// Nobody waits any more for the link that is being opened; one that is open stays.
    pub(super) fn give_up_opening(&mut self, effects: &mut Vec<Effect>) {
        self.opening = None;
        match self.view.link.state {
            LinkState::Open | LinkState::Lost(_) => effects.push(Effect::DoNotOpen),
            LinkState::Opening | LinkState::Closed => self.disconnect(effects),
        }
    }

    /// Closes the link and goes on. Whatever is in the middle is ended first: a unit whose view stays open neither scans
    /// nor talks on CAN, and one that waits at a prompt takes the next key for an answer.
    pub(super) fn leave(&mut self, next: Next, effects: &mut Vec<Effect>) {
        if self.leaving.is_some() {
            return;
        }
        if !(self.view.is_in_the_middle() && self.view.can_send()) {
            return self.left(next, effects);
        }
        if self.view.has_job_to_end() {
            self.command(Command::Cancel);
        }
        if self.view.unit.viewing && !self.view.has_job_to_end() {
            self.command(Command::Keys(b"x".to_vec()));
        }
        self.dirty = true;
        let what = "Leaving the unit in order, which takes 2 seconds at most.".into();
        self.popup = Some(Popup::Waiting { what, hint: (Press::Plain(KeyCode::Char('q')), "leave at once") });
        self.leaving = Some((next, self.now + WINDING_UP));
    }

    /// Goes on with what was to come as soon as nothing is in the middle any more, or there was time enough for it.
    pub(super) fn go_on_leaving(&mut self, effects: &mut Vec<Effect>) {
        let is_over = self.leaving.as_ref().is_some_and(|(_, until)| *until <= self.now);
        let is_settled = !self.view.has_job_to_end() && self.session.as_ref().is_none_or(|it| it.waiting() == 0);
        if !(is_over || is_settled || !self.view.can_send()) {
            return;
        }
        if let Some((next, _)) = self.leaving.take() {
            self.popup = None;
            self.left(next, effects);
        }
    }

    pub(super) fn left(&mut self, next: Next, effects: &mut Vec<Effect>) {
        match next {
            Next::Quit => effects.push(Effect::Quit),
            Next::Disconnect => self.disconnect(effects),
            Next::Open(link) => self.open(link, effects),
        }
    }

    pub(super) fn disconnect(&mut self, effects: &mut Vec<Effect>) {
        effects.push(Effect::CloseLink);
        self.scrollback.note(self.now, "link closed".into());
        self.session = None;
        self.begin_link(Link::default());
        self.view.tell(Tone::Quiet, "The link is closed.");
        self.list_recordings_in_front(effects);
    }

    /// Which recordings there are, and which are being written, changes with the links.
    fn list_recordings_in_front(&self, effects: &mut Vec<Effect>) {
        if self.front == ScreenId::Recordings {
            effects.push(Effect::ListRecordings);
        }
    }

    /// Another link. Rows that go to a file go on if it is the same link again.
    pub(super) fn begin_link(&mut self, link: Link) {
        let is_same = self.view.link.name == link.name;
        let export = self.view.export.take();
        self.view.begin_link(link);
        self.view.export = export;
        if !is_same {
            self.end_export(None);
        }
    }

    pub(super) fn link_opened(&mut self, now: Instant, info: LinkInfo, effects: &mut Vec<Effect>) {
        self.dirty = true;
        if self.opening.take().is_none() {
            // Nobody waits for it any more.
            effects.push(Effect::CloseLink);
            return;
        }
        self.popup = None;
        let is_recording = info.kind == LinkKind::Recording;
        if is_recording || self.view.is_recording() {
            self.forget_lines();
        }
        if !is_recording {
            self.connect.opened(&info.link);
        }
        self.scrollback.begin(now, format!("connected to {}", visible::text(&info.link)));
        self.begin_session(info, effects);
        // A user who has chosen a recording wants to steer it.
        self.front = if self.front == ScreenId::Recordings { self.front } else { ScreenId::Overview };
        if !is_recording {
            self.command(Command::Identify);
        }
        self.list_recordings_in_front(effects);
    }

    /// The terminal starts from scratch: what it shows happened at other times of day, or has not happened yet.
    fn forget_lines(&mut self) {
        self.scrollback = Scrollback::default();
        self.terminal.follow();
    }

    /// A session on the link that has just been opened.
    pub(super) fn begin_session(&mut self, info: LinkInfo, effects: &mut Vec<Effect>) {
        let is_recording = info.kind == LinkKind::Recording;
        self.session = Some(if is_recording { Session::of_recording(info.baud) } else { Session::new(info.baud) });
        self.start_of_day = info.start_of_day;
        self.begin_link(Link {
            name: Some(info.link),
            baud: info.baud,
            recording: info.recording,
            noted: info.noted,
            start_millis: info.start_millis,
            kind: info.kind,
            state: LinkState::Open,
            ..Link::default()
        });
        self.terminal.begin_record();
        self.dictionary.begin_link();
        self.stream.begin_link();
        self.bench.begin_link();
        self.forget_loader(effects);
        if is_recording {
            // What goes by in a recording is understood as it goes by; nothing is sent for it.
            self.command(Command::Overhear);
            self.view.job = None;
        }
    }

    /// The recording is played from its beginning again: nothing of it has happened yet.
    pub(super) fn played_anew(&mut self, now: Instant, info: LinkInfo, effects: &mut Vec<Effect>) {
        self.dirty = true;
        if self.view.is_recording() {
            let playing = self.view.playing;
            self.forget_lines();
            self.scrollback.begin(now, "from the beginning".into());
            self.begin_session(info, effects);
            self.view.playing = playing;
        }
    }

    pub(super) fn link_failed(&mut self, failure: Failure) {
        self.dirty = true;
        if let Some(link) = self.opening.take() {
            self.connect.failed(link);
            if self.view.link.state == LinkState::Opening {
                self.session = None;
                self.begin_link(Link::default());
            }
            self.popup = Some(Popup::Failed { title: "Not connected", failure });
        }
    }

    pub(super) fn link_gone(&mut self, now: Instant, failure: Failure, effects: &mut Vec<Effect>) {
        self.dirty = true;
        if self.view.link.state == LinkState::Open {
            self.scrollback.note(now, "link lost".into());
            self.export_note(now, "link lost", effects);
            self.view.link.state = LinkState::Lost(failure);
            // It was about the link as it was; what ends with the link is reported after this.
            self.view.forget_notice();
            if let Some(session) = &mut self.session {
                session.link_lost(now);
            }
            if self.opening.is_none() && self.popup.as_ref().is_some_and(Popup::ends_with_link) {
                self.popup = None;
            }
            self.list_recordings_in_front(effects);
        }
    }

    /// The cable is plugged in again. What stood on the screen goes on; the unit is asked who it is, since it may have
    /// restarted.
    pub(super) fn link_back(&mut self, now: Instant, name: &str, effects: &mut Vec<Effect>) {
        self.dirty = true;
        if matches!(self.view.link.state, LinkState::Lost(_)) {
            self.scrollback.note(now, format!("link back as {}", visible::text(name)));
            self.export_note(now, "link back", effects);
            self.view.link.state = LinkState::Open;
            self.view.link_back();
            if let Some(session) = &mut self.session {
                session.link_back(now);
                session.forget_unit();
            }
            self.command(Command::Identify);
        }
    }

    /// The unit on a link that came back has said something of itself, or has had its chance: whether what was shown
    /// before is its own is decided now.
    pub(super) fn decide_who_returned(&mut self, has_said_all: bool, effects: &mut Vec<Effect>) {
        let lacks_version = self.view.returning.as_ref().is_some_and(|before| before.lacks_version(&self.view.facts));
        if lacks_version && !has_said_all {
            // A banner names the product a line before the version, which may be another one.
            return;
        }
        let Some(who) = self.view.returning.as_ref().and_then(|returning| returning.who(&self.view.facts)) else {
            return;
        };
        if !self.view.can_send() {
            // Lost again: the unit that answered is gone.
            return;
        }
        let Some(returning) = self.view.returning.take() else { return };
        let was_left_half_loaded = self.was_left_half_loaded(&returning);
        let has_version_of_before = returning.has_version_of(&self.view.facts);
        let waiting = returning.release();
        match who {
            Who::Same | Who::Unknown if was_left_half_loaded && self.view.facts.state == UnitState::Application => {
                let unit = self.unit_in_words();
                let text = format!(
                    "The {unit} on the cable runs its software, which the unit that was left half loaded cannot: it is \
                     another, or somebody has loaded it since."
                );
                self.begin_unit(text, effects);
            }
            Who::Same => {
                let unit = self.view.product().map_or("unit", |product| product.name.as_str());
                // That what it runs is what it ran is said only where both are known.
                let as_before = if has_version_of_before { " as before" } else { "" };
                self.view.tell(Tone::Good, format!("The link is back, and the {unit} answers{as_before}."));
            }
            Who::Other { now, before } => {
                let text = format!("Another unit is on the cable now: {now}; before it was {before}.");
                self.begin_unit(visible::text(&text), effects);
            }
            Who::Unknown if self.view.facts.state == UnitState::Loader && self.view.link.noted.is_some() => {
                // Where the upload has left it: what it has shown before is its own.
                let text = "The link is back. The unit waits in its loader for a complete file: L loads it.";
                self.view.tell(Tone::Quiet, text);
            }
            Who::Unknown if self.view.facts.state == UnitState::Loader => {
                let text =
                    "The link is back. The unit waits in its loader, where it cannot say which it is: L loads a file.";
                self.begin_unit(text.to_owned(), effects);
            }
            Who::Unknown => {
                let text = "The link is back. The unit has not said whether it is the one from before, so the screens \
                            start from scratch.";
                self.begin_unit(text.to_owned(), effects);
            }
        }
        for event in waiting {
            let facts = self.session.as_ref().map_or(&self.no_facts, Session::facts);
            self.view.fold(self.now, &event, facts);
            if let Event::Row { at, row, .. } = &event {
                self.export_row(*at, row, effects);
            }
        }
    }

    /// Whether the unit of before was left with part of a file: it has nothing to run.
    fn was_left_half_loaded(&self, before: &Returning) -> bool {
        let load = &self.view.load;
        let in_report = load.report.as_ref().filter(|_| !load.is_of_earlier_unit).is_some_and(|report| {
            report.unit == UnitNow::Loader && report.records > 0 && report.records < report.records_total
        });
        in_report || before.was_in_loader() && self.view.link.noted.is_some()
    }

    /// `AXTC4CO 1.1.0`, as far as it has said so.
    fn unit_in_words(&self) -> String {
        let facts = &self.view.facts;
        let product = facts.product.as_ref().map_or("unit".to_owned(), |known| visible::text(&known.value));
        facts.version.as_ref().map_or(product.clone(), |known| format!("{product} {}", known.value))
    }

    /// Two units of one product and version differ in their serial numbers only, which the object dictionary alone has.
    pub(super) fn compare_serial(&mut self, before: Option<u32>, effects: &mut Vec<Effect>) {
        let (Some(before), Some(now)) = (before, self.view.unit.serial) else { return };
        if before != now {
            let read = self.view.unit.dictionary.take();
            let text = format!("Another unit is on the cable: its serial number is {now}, before it was {before}.");
            self.begin_unit(text, effects);
            (self.view.unit.dictionary, self.view.unit.serial) = (read, Some(now));
        }
    }

    /// Another unit, or one that may be another: nothing that was shown is its own.
    pub(super) fn begin_unit(&mut self, text: String, effects: &mut Vec<Effect>) {
        if self.view.export.is_some() {
            self.end_export(Some("another unit may be on the cable"));
        }
        self.view.begin_unit();
        if matches!(&self.popup, Some(Popup::Asking(question)) if question.is_about_unit()) {
            // An answer for one unit is not an answer for another.
            self.popup = None;
        }
        self.dictionary.begin_link();
        self.stream.begin_link();
        self.bench.begin_link();
        self.forget_loader(effects);
        self.scrollback.note(self.now, text.clone());
        effects.push(Effect::Mark(text.clone()));
        self.view.tell(Tone::Bad, text);
    }

    /// What was said of the loader was said of another unit's; a file that was judged for it is judged again.
    fn forget_loader(&mut self, effects: &mut Vec<Effect>) {
        if let Some(action) = self.load.begin_unit() {
            self.perform(action, effects);
        }
    }

    /// What happens from now on is not in the recording. That stays in sight: who has to prove something later must know.
    pub(super) fn unrecorded(&mut self, now: Instant, why: String) {
        self.dirty = true;
        self.scrollback.note(now, format!("not recorded from here on: {}", visible::text(&why)));
        self.view.tell(Tone::Bad, format!("Not recorded: {why}."));
        (self.view.link.recording, self.view.link.unrecorded) = (None, Some(why));
    }

    pub(super) fn recording_over(&mut self, now: Instant, failure: Option<Failure>) {
        self.dirty = true;
        if let Some(session) = &mut self.session {
            session.recording_over(now);
        }
        match failure {
            None => {
                self.view.tell(Tone::Quiet, "This is the end of the recording: 3 shows all of it, Space on 8 plays it.")
            }
            Some(failure) => {
                self.scrollback.note(now, visible::text(&failure.text));
                self.view.link.defect = Some(failure.text.clone());
                self.view.tell(Tone::Bad, failure.text);
            }
        }
    }

    pub(super) fn break_sent(&mut self, now: Instant, result: Result<(), String>, effects: &mut Vec<Effect>) {
        self.dirty = true;
        match result {
            Ok(()) => {
                self.scrollback.note(now, "break sent".into());
                effects.push(Effect::Mark("break sent".into()));
            }
            Err(why) => self.view.tell(Tone::Bad, format!("No break sent: {why}.")),
        }
    }
}
