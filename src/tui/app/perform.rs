//! What a screen or an answered question has asked for, done.

use std::path::PathBuf;

use super::App;
use super::link::Next;
use crate::secret::Secret;
use crate::session::{Command, Job, LoadOrder, Refusal};
use crate::tui::action::Action;
use crate::tui::input::{Effect, Noted};
use crate::tui::link_name;
use crate::tui::picker::expanded;
use crate::tui::popup::{PickedFor, Popup, Question};
use crate::tui::screens::ScreenId;
use crate::tui::view::Tone;
use crate::tui::widgets::format;

impl App {
    pub(super) fn perform(&mut self, action: Action, effects: &mut Vec<Effect>) {
        self.dirty = true;
        match action {
            Action::Go(screen) => self.go(screen, effects),
            // A recording can be opened again as it was; before a unit is left, the user is asked.
            Action::Open(link) => {
                let link = link_name::expanded(&link, self.options.home.as_deref());
                match self.view.can_send() {
                    true => self.ask(Question::Disconnect { then: Some(link) }),
                    false => self.open(link, effects),
                }
            }
            Action::Reconnect => {
                if let Some(link) = self.view.link.name.clone() {
                    self.open(link, effects);
                }
            }
            Action::Disconnect { then } => self.leave(then.map_or(Next::Disconnect, Next::Open), effects),
            Action::ListPorts => {
                self.connect.listing();
                effects.push(Effect::ListPorts);
            }
            Action::ListFiles(directory) => effects.push(Effect::ListFiles(directory)),
            Action::CheckImage(path) => {
                // It was about the file as it was, or about another one.
                self.view.forget_notice();
                let path = self.expanded(path);
                self.load.check(path.clone());
                let (loader, allow) = (self.load.loader(), self.load.allowed().to_vec());
                effects.push(Effect::CheckImage { path, loader, allow });
            }
            Action::Allow(error) => {
                if let Some(action) = self.load.allow(error) {
                    self.perform(action, effects);
                }
            }
            Action::Tell(why) => self.view.tell(Tone::Quiet, why),
            Action::Ask(question) => self.ask(question),
            Action::Command(command) => {
                let reads = matches!(command, Command::ReadDictionary);
                if self.can_send() && self.command(command) && reads {
                    self.view.unit.entries_read = 0;
                    self.front = ScreenId::Dictionary;
                }
            }
            Action::ViewDictionary => {
                if self.can_send() && self.command(Command::Keys(b"v".to_vec())) {
                    self.front = ScreenId::Terminal;
                    self.terminal.follow();
                    self.view
                        .tell(Tone::Quiet, "V is sent. Enter shows the next object, X leaves and lets scanning go on.");
                }
            }
            Action::StartLoad { password, product } => self.start_load(password, product, effects),
            Action::OtherUnit => self.other_unit(effects),
            Action::DismissReport => self.view.load.report = None,
            Action::RestartExtremes => {
                self.view.restart_extremes();
                let time = format::time_of_day(self.start_of_day, self.now);
                self.view.tell(Tone::Quiet, format!("Minimum, maximum and mean restart at {time}."));
            }
            Action::Mark(at) => self.mark(at, effects),
            Action::Find(words) => match self.front {
                ScreenId::Terminal => {
                    let area = self.screen_area();
                    self.terminal.find(words, &self.view, &self.scrollback, area);
                }
                _ => self.dictionary.find(&words),
            },
            Action::ExportStream(path) => self.export_stream(self.expanded(path), effects),
            Action::EndExport => self.end_export(None),
            Action::ExportDictionary(path) => self.export_dictionary(self.expanded(path), effects),
            Action::Compare(path) => effects.push(Effect::ReadFile(self.expanded(path))),
            Action::PickFile(PickedFor::ToSend) if !self.may_send_file() => {}
            Action::PickFile(purpose) => {
                self.ask(Question::pick_file(purpose, &self.folder));
                effects.push(Effect::ListFiles(self.folder.clone()));
            }
            Action::ReadToSend(path) => effects.push(Effect::ReadBytes(self.expanded(path))),
            Action::SendFile { name, bytes } => self.send_file(name, bytes, effects),
            Action::Break if self.can_send() => effects.push(Effect::Break),
            Action::Break => {}
            Action::ListRecordings => effects.push(Effect::ListRecordings),
            Action::Play(playback) => effects.push(Effect::Play(playback)),
            Action::Order(line) if self.view.emulated().is_some() => {
                self.bench.ordered(self.now, line.clone());
                effects.push(Effect::Order(line));
            }
            Action::Order(_) => {}
            Action::Quit => self.leave(Next::Quit, effects),
        }
    }

    fn go(&mut self, screen: ScreenId, effects: &mut Vec<Effect>) {
        if self.front != screen {
            // It was about what was done there, and would hide what is being done.
            self.view.forget_notice();
        }
        self.front = screen;
        match screen {
            ScreenId::Load => {
                if let Some(action) = self.load.entered() {
                    self.perform(action, effects);
                }
            }
            ScreenId::Recordings => effects.push(Effect::ListRecordings),
            ScreenId::Connect
            | ScreenId::Overview
            | ScreenId::Terminal
            | ScreenId::Dictionary
            | ScreenId::Stream
            | ScreenId::Diagnostics
            | ScreenId::Bench => {}
        }
    }

    fn start_load(&mut self, password: Option<Secret>, label: Option<String>, effects: &mut Vec<Effect>) {
        if !self.can_send() {
            return;
        }
        let Some(facts) = self.load.image() else { return };
        let Some(image) = facts.checked.clone() else { return };
        let file = facts.path.display().to_string();
        // What the unit says goes first, then the user, then the note of an upload that was left in the middle.
        let said = self.view.facts.product.as_ref().map(|known| known.value.clone());
        let product = label.or_else(|| self.view.noted().map(|noted| noted.product.clone()));
        let known = said.or(product.clone());
        let ran = self.view.ran();
        let packed = self.load.is_packed();
        let (loader, allowed) = (self.load.loader(), self.load.allowed().to_vec());
        let order = LoadOrder { product, ran, packed, loader, allowed, ..LoadOrder::new(image, password) };
        if self.command(Command::Load(Box::new(order)))
            && let (Some(link), Some(product)) = (self.view.link.name.clone(), known)
        {
            // Noted before the first byte leaves: what the session sends is drained after this.
            let begun = format!("at {}", format::time_of_day(self.start_of_day, self.now));
            let noted = Noted { product, image: file, ran, begun };
            self.view.link.noted = Some(noted.clone());
            effects.push(Effect::UploadBegins { link, noted });
        }
    }

    /// Sets the note of an upload aside. It stays where it is kept: it may still be true of the unit it was made for,
    /// until another upload on this link takes its place.
    fn other_unit(&mut self, effects: &mut Vec<Effect>) {
        let Some(noted) = self.view.link.noted.take() else { return };
        if let Some(action) = self.load.ask_label(&self.view) {
            self.perform(action, effects);
        }
        let about = format!("{}, {}", noted.product, noted.begun);
        self.view.tell(Tone::Quiet, format!("Our note ({about}) is set aside: another unit."));
    }

    /// Gives a command to the session. Says whether it was taken; if not, the user knows why.
    pub(super) fn command(&mut self, command: Command) -> bool {
        let Some(session) = &mut self.session else { return false };
        let job = match &command {
            Command::Keys(_) | Command::Cancel => None,
            Command::Identify => Some(Job::Identify),
            Command::StreamOn { .. } => Some(Job::StreamOn),
            Command::StreamOff => Some(Job::StreamOff),
            Command::RestoreDefaults => Some(Job::RestoreDefaults),
            Command::ReadDictionary => Some(Job::ReadDictionary),
            Command::Diagnostics { .. } | Command::DiagnosticsOff => Some(Job::Diagnostics),
            Command::Overhear => Some(Job::Overhear),
            Command::Load(_) => Some(Job::Load),
            Command::SendFile(_) => Some(Job::SendFile),
        };
        let period = match &command {
            Command::StreamOn { period, .. } => Some(*period),
            _ => None,
        };
        // What is typed at the unit's own prompts is not followed: it may set any other period.
        let may_set = matches!(&command, Command::Keys(keys) if keys.iter().any(|key| b"TtDd".contains(key)));
        let viewing = match &command {
            Command::Keys(keys) if !session.password_open() => opens_view(keys),
            _ => None,
        };
        let ends = matches!(command, Command::Cancel | Command::DiagnosticsOff);
        // A user who wants something else need not wait minutes for a slow stream's first row.
        if self.view.awaits_first_row() && !matches!(command, Command::Cancel) {
            let _ = session.command(self.now, Command::Cancel);
        }
        match session.command(self.now, command) {
            Ok(()) => {
                self.view.is_ending = ends || (self.view.is_ending && job.is_none());
                if let Some(job) = job {
                    self.view.job = Some(job);
                    self.view.forget_notice();
                }
                self.view.unit.wanted_period = period.or(self.view.unit.wanted_period.filter(|_| job.is_none()));
                if may_set {
                    self.view.unit.monitor.stream.set_period(None);
                }
                if viewing == Some(true) {
                    self.view.unit.monitor.stream.interrupt();
                }
                if job == Some(Job::Load) {
                    self.view.load = Default::default();
                    self.front = ScreenId::Load;
                }
                self.view.unit.viewing = viewing.unwrap_or(self.view.unit.viewing);
                true
            }
            Err(Refusal::Busy(job)) => {
                self.view.tell(Tone::Refused, format!("Not sent: axcon is still {}.", job.doing()));
                false
            }
            Err(refusal) => {
                self.view.tell(Tone::Refused, format!("Not sent: {refusal}."));
                false
            }
        }
    }

    /// A path with the user's home folder in place of `~`.
    pub(super) fn expanded(&self, path: PathBuf) -> PathBuf {
        expanded(path, self.options.home.as_deref())
    }

    pub(super) fn ask(&mut self, question: Question) {
        // It was about something else.
        self.view.forget_notice();
        self.popup = Some(Popup::Asking(question));
    }
}

/// Whether keys typed at the unit's menu leave its view open (true), closed, or (`None`) as it was.
fn opens_view(keys: &[u8]) -> Option<bool> {
    keys.iter().rev().find_map(|key| match key.to_ascii_lowercase() {
        b'v' => Some(true),
        b'x' => Some(false),
        _ => None,
    })
}
