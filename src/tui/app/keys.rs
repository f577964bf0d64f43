//! What keys, pastes and the mouse do.

use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use ratatui::layout::{Position, Rect};

use super::App;
use crate::session::{Command, Job, Refusal, Session, UnitState};
use crate::tui::action::Action;
use crate::tui::frame;
use crate::tui::input::Effect;
use crate::tui::keymap::{self, Cmd, EVERYWHERE, MENU, MenuCmd, Press};
use crate::tui::popup::{self, Answer, Form, Popup, Question, Target};
use crate::tui::screens::ScreenId;
use crate::tui::screens::diagnostics::Diagnostics;
use crate::tui::screens::help::Help;
use crate::tui::screens::terminal::Meaning;
use crate::tui::theme::Theme;
use crate::tui::view::{LinkState, Tone};
use crate::tui::widgets::lines;

/// Why a unit in its loader is sent no key of the menu.
const IN_LOADER: &str = "the unit is in its loader, which takes every key for an error: L sends software";

impl App {
    pub(super) fn terminal_event(&mut self, event: TerminalEvent, effects: &mut Vec<Effect>) {
        match event {
            // Windows reports the release of a key as well.
            TerminalEvent::Key(key) if key.kind != KeyEventKind::Release => {
                self.dirty = true;
                self.key(key, effects);
            }
            TerminalEvent::Paste(text) => {
                self.dirty = true;
                self.paste(&text, effects);
            }
            TerminalEvent::Resize(columns, rows) => {
                self.dirty = true;
                self.size = (columns, rows);
            }
            TerminalEvent::Mouse(mouse) => self.mouse(mouse, effects),
            TerminalEvent::Key(_) | TerminalEvent::FocusGained | TerminalEvent::FocusLost => {}
        }
    }

    fn mouse(&mut self, mouse: MouseEvent, effects: &mut Vec<Effect>) {
        if self.is_too_small() {
            return;
        }
        let step = match mouse.kind {
            MouseEventKind::ScrollUp => Some(KeyCode::Up),
            MouseEventKind::ScrollDown => Some(KeyCode::Down),
            _ => None,
        };
        let moves = matches!(&self.popup, None | Some(Popup::Asking(Question::PickFile { .. })));
        if let Some(code) = step.filter(|_| moves) {
            self.dirty = true;
            return self.key(KeyEvent::new(code, KeyModifiers::NONE), effects);
        }
        if mouse.kind != MouseEventKind::Down(MouseButton::Left) {
            return;
        }
        let (columns, rows) = self.size;
        if let Some(popup) = &self.popup {
            let body = frame::body(Rect::new(0, 0, columns, rows), &self.view);
            let place = Position { x: mouse.column, y: mouse.row };
            if let Some(target) = popup::target_at(popup, &self.view, self.theme, body, place) {
                self.dirty = true;
                self.click(target, effects);
            }
            return;
        }
        let column = usize::from(mouse.column);
        let front = self.help.is_none().then_some(self.front);
        let cmd = match mouse.row {
            1 => frame::tab_at(&self.view, front, usize::from(columns), column).map(Cmd::Go),
            row if row + 2 == rows => frame::menu_at(column),
            row if row + 1 == rows && self.help.is_some() => {
                self.dirty = true;
                // The keys of the page scroll it, or leave it.
                self.help = None;
                None
            }
            row if row + 1 == rows => frame::key_at(self.theme, &self.footer(usize::from(columns)), column),
            row => self.choose_at(row),
        };
        if let Some(cmd) = cmd {
            self.dirty = true;
            self.help = None;
            self.on(cmd, effects);
        }
    }

    /// A click on a popup.
    fn click(&mut self, target: Target, effects: &mut Vec<Effect>) {
        match target {
            Target::Key(press) => self.key(press.event(), effects),
            Target::Entry(number) => {
                let Some(Popup::Asking(Question::PickFile { picker, form, .. })) = &mut self.popup else { return };
                form.typed.clear();
                if picker.choose(number) {
                    self.key(Press::Plain(KeyCode::Enter).event(), effects);
                }
            }
        }
    }

    /// A click into a list: what is there is chosen, and what is chosen already is done.
    fn choose_at(&mut self, y: u16) -> Option<Cmd> {
        if self.help.is_some() {
            return None;
        }
        let area = self.screen_area();
        self.dirty = true;
        let again = match self.front {
            ScreenId::Connect => {
                let entry = self.connect.entry_at(self.scene(), area, y)?;
                self.connect.choose(entry)
            }
            ScreenId::Load => {
                let entry = self.load.entry_at(&self.view, area, y)?;
                self.load.choose(entry)
            }
            ScreenId::Recordings => {
                let entry = self.recordings.entry_at(self.scene(), area, y)?;
                self.recordings.choose(entry)
            }
            ScreenId::Dictionary => {
                let row = self.dictionary.row_at(&self.view, area, y)?;
                self.dictionary.choose(row);
                false
            }
            ScreenId::Overview | ScreenId::Terminal | ScreenId::Stream | ScreenId::Diagnostics | ScreenId::Bench => {
                false
            }
        };
        again.then_some(Cmd::Accept)
    }

    fn key(&mut self, key: KeyEvent, effects: &mut Vec<Effect>) {
        self.view.read_notice();
        if self.is_too_small() {
            return self.key_unseen(key, effects);
        }
        // No text and no answer: it means the same in front of everything but the bare terminal.
        if !self.passes_keys() && keymap::find(&[EVERYWHERE], key) == Some(Cmd::Suspend) {
            return self.on(Cmd::Suspend, effects);
        }
        if let Some(popup) = &mut self.popup {
            let is_waiting = matches!(popup, Popup::Waiting { .. });
            match popup.on(key) {
                // A link that takes long to open must not hold the user.
                Answer::Stay if is_waiting && keymap::find(&[EVERYWHERE], key) == Some(Cmd::Quit) => {
                    effects.push(Effect::Quit);
                }
                Answer::Stay if is_waiting && key.code == KeyCode::Esc && self.leaving.is_none() => {
                    self.popup = None;
                    self.give_up_opening(effects);
                }
                answer => self.answered(answer, effects),
            }
            return;
        }
        let area = self.screen_area();
        if let Some(help) = &mut self.help {
            if help.scrolls(key.code, self.front, area) {
                return;
            }
            self.help = None;
            if self.front == ScreenId::Terminal && Press::Ctrl(']').is(key) {
                // The next key is the console's, as it would be without the page.
                self.terminal.meaning(key);
                return;
            }
            // Another screen's key goes there; every other key only closes the page.
            match keymap::find(&[EVERYWHERE], key) {
                Some(cmd @ (Cmd::Go(_) | Cmd::Next | Cmd::Previous)) => return self.on(cmd, effects),
                _ => return,
            }
        }
        // Nothing of a recording takes keys: there they are the console's.
        if self.front == ScreenId::Terminal && !self.view.is_recording() {
            if self.view.job == Some(Job::SendFile) && key.code == KeyCode::Esc && !self.terminal.is_after_prefix() {
                return self.perform(Action::Command(Command::Cancel), effects);
            }
            match self.terminal.meaning(key) {
                Meaning::Keys(bytes) => return self.perform(Action::Command(Command::Keys(bytes)), effects),
                Meaning::Nothing => return,
                Meaning::Console => {}
            }
        }
        if let Some(cmd) = keymap::find(&[self.front.bindings(), MENU, EVERYWHERE], key) {
            self.on(cmd, effects);
        }
    }

    /// A key while the screen cannot be seen, nor what the key would do. Only leaving is possible, and asked
    /// about in the one message there is; and Ctrl-Z, which changes nothing.
    fn key_unseen(&mut self, key: KeyEvent, effects: &mut Vec<Effect>) {
        let cmd = keymap::find(&[EVERYWHERE], key);
        match (&self.popup, cmd, key.code) {
            (_, Some(Cmd::Suspend), _) if !self.passes_keys() => self.on(Cmd::Suspend, effects),
            (Some(Popup::Asking(Question::Quit)), _, KeyCode::Char('y' | 'Y')) => {
                self.popup = None;
                self.perform(Action::Quit, effects);
            }
            (Some(Popup::Asking(Question::Quit)), _, KeyCode::Char('n' | 'N') | KeyCode::Esc) => self.popup = None,
            // It is being left already, or a link is being opened: nobody has to wait for that.
            (Some(Popup::Waiting { .. }), Some(Cmd::Quit), _) => effects.push(Effect::Quit),
            (_, Some(Cmd::Quit), _) => self.on(Cmd::Quit, effects),
            _ => {}
        }
    }

    /// A question has been answered, or not yet.
    fn answered(&mut self, answer: Answer, effects: &mut Vec<Effect>) {
        match answer {
            Answer::Stay => {}
            Answer::Close => self.popup = None,
            Answer::Act(action) => {
                self.popup = None;
                self.perform(action, effects);
            }
            Answer::Meanwhile(action) => self.perform(action, effects),
        }
    }

    fn paste(&mut self, text: &str, effects: &mut Vec<Effect>) {
        if self.is_too_small() || text.is_empty() {
            return;
        }
        if let Some(popup) = &mut self.popup {
            let answer = popup.paste(text);
            return self.answered(answer, effects);
        }
        // What cannot be done is said before it is asked about.
        if self.front != ScreenId::Terminal || self.help.is_some() || !self.can_send() {
            return;
        }
        // Enter is CR on this line (manual, chapter 4); the unit knows ASCII only.
        let joined = text.replace("\r\n", "\r").replace('\n', "\r");
        let is_known = |character: &char| matches!(character, ' '..='~' | '\r' | '\t');
        let bytes: Vec<u8> = joined.chars().filter(is_known).map(|character| character as u8).collect();
        let left_out = joined.chars().count() - bytes.len();
        match bytes.is_empty() {
            true => {
                self.view.tell(Tone::Refused, "Not sent: the unit knows none of these characters; it takes ASCII only.")
            }
            false => self.ask(Question::Paste { bytes, left_out }),
        }
    }

    fn on(&mut self, cmd: Cmd, effects: &mut Vec<Effect>) {
        match cmd {
            Cmd::Menu(menu) => self.menu(menu, effects),
            Cmd::Go(screen) => self.perform(Action::Go(screen), effects),
            Cmd::Next => self.perform(Action::Go(self.front.step(1)), effects),
            Cmd::Previous => self.perform(Action::Go(self.front.step(ScreenId::ALL.len() - 1)), effects),
            Cmd::Help => self.help = Some(Help::default()),
            Cmd::Quit if self.view.would_be_left() => self.ask(Question::Quit),
            Cmd::Quit => effects.push(Effect::Quit),
            // Time goes on while the program is stopped: every deadline of the job would be over.
            Cmd::Suspend if self.view.is_in_the_middle() && self.view.can_send() => {
                let what = match self.view.job {
                    Some(_) => "a job runs",
                    None if self.view.question.is_some() => "the unit waits for an answer: end it with Enter first",
                    None => "the unit's view is open: close it with X first",
                };
                self.view.tell(Tone::Refused, format!("Not stopped: {what}."));
            }
            Cmd::Suspend => effects.push(Effect::Suspend),
            Cmd::Palette => {
                self.theme = Theme::new(self.theme.palette().next());
                self.view.tell(Tone::Quiet, format!("Colours: {}.", self.theme.palette().words()));
            }
            Cmd::Reconnect => match self.view.link.state {
                // It lived on this link only: another one begins as the factory made it.
                LinkState::Lost(_) if self.view.emulated().is_some() => {
                    self.ask(Question::Disconnect { then: self.view.link.name.clone() });
                }
                LinkState::Lost(_) => self.perform(Action::Reconnect, effects),
                LinkState::Closed | LinkState::Opening | LinkState::Open => {
                    self.view.tell(Tone::Quiet, "No link is lost: 1 lists links.");
                }
            },
            Cmd::Up
            | Cmd::Down
            | Cmd::PageUp
            | Cmd::PageDown
            | Cmd::First
            | Cmd::Last
            | Cmd::Accept
            | Cmd::Back
            | Cmd::Above
            | Cmd::Refresh
            | Cmd::Type
            | Cmd::Disconnect
            | Cmd::Hex
            | Cmd::Times
            | Cmd::Restart
            | Cmd::Left
            | Cmd::Right
            | Cmd::Zoom
            | Cmd::Pause
            | Cmd::Mark
            | Cmd::Export
            | Cmd::Find
            | Cmd::FindNext
            | Cmd::Filter
            | Cmd::Compare
            | Cmd::Pack
            | Cmd::Allow
            | Cmd::Loader
            | Cmd::OtherUnit
            | Cmd::Break
            | Cmd::SendFile
            | Cmd::Faster
            | Cmd::Slower
            | Cmd::OpenWire
            | Cmd::ShortWire
            | Cmd::Repair
            | Cmd::Power
            | Cmd::Prefix => self.screen(cmd, effects),
        }
    }

    /// Where the screen itself is drawn, below what is said of a lost link.
    pub(super) fn screen_area(&self) -> Rect {
        let area = frame::body(Rect::new(0, 0, self.size.0, self.size.1), &self.view);
        let lost = frame::lost(&self.view, self.front, self.theme, usize::from(self.size.0)).len() as u16;
        lines::split(area, lost).1
    }

    /// A key of the screen in front.
    fn screen(&mut self, cmd: Cmd, effects: &mut Vec<Effect>) {
        let area = self.screen_area();
        let page = usize::from(area.height);
        let record = self.session.as_ref().map_or(&self.no_record, Session::record);
        let action = match self.front {
            ScreenId::Connect => self.connect.on(cmd, &self.view),
            ScreenId::Overview => {
                let faults = self.overview.faults_at(self.scene(), area);
                self.overview.on(cmd, self.view.unit.monitor.stream.channels.len(), faults)
            }
            ScreenId::Terminal => self.terminal.on(cmd, &self.view, &self.scrollback, record, area),
            ScreenId::Load => self.load.on(cmd, &self.view, area),
            ScreenId::Dictionary => self.dictionary.on(cmd, &self.view, area),
            ScreenId::Stream => self.stream.on(cmd, &self.view),
            ScreenId::Diagnostics => {
                let last = Diagnostics::last(self.scene(), area);
                self.diagnostics.on(cmd, last, page)
            }
            ScreenId::Recordings => self.recordings.on(cmd, &self.view),
            ScreenId::Bench => self.bench.on(cmd, &self.view),
        };
        if let Some(action) = action {
            self.perform(action, effects);
        }
    }

    /// A key of the unit's menu.
    fn menu(&mut self, menu: MenuCmd, effects: &mut Vec<Effect>) {
        if menu == MenuCmd::Load {
            // Files can be looked at without a unit.
            return self.perform(Action::Go(ScreenId::Load), effects);
        }
        if !self.can_send() {
            return;
        }
        // What cannot be done now is said before anything is asked.
        if let Some(key) = self.view.question {
            return self.view.tell(Tone::Refused, format!("Not sent: {}.", Refusal::QuestionOpen(key)));
        }
        let job = self.view.job.filter(|_| !self.view.awaits_first_row());
        let why_not = match (menu, job, self.view.facts.state) {
            // Also while it is asked again: a form that is refused at its end is of no use.
            (menu, Some(Job::Identify), UnitState::Loader) if menu != MenuCmd::Menu => Some(IN_LOADER),
            (MenuCmd::Diagnostics, Some(Job::Diagnostics), _) | (_, Some(Job::Identify), _) => None,
            (_, Some(_), _) => self.view.busy(),
            (MenuCmd::Menu, ..) => None,
            (_, None, _) if self.view.unit.viewing => Some("the view is open and has keys of its own: M closes it"),
            (_, None, UnitState::Loader) => Some(IN_LOADER),
            (_, None, _) => None,
        };
        if let Some(why_not) = why_not {
            return self.view.tell(Tone::Refused, format!("Not sent: {why_not}."));
        }
        match menu {
            MenuCmd::Menu => {
                // In the view a key may be swallowed, and the unit is halted as long as it is open.
                if self.view.unit.viewing {
                    self.perform(Action::Command(Command::Keys(b"x".to_vec())), effects);
                }
                self.perform(Action::Command(Command::Identify), effects);
            }
            MenuCmd::View => self.ask(Question::View),
            MenuCmd::Defaults => {
                self.ask(Question::Defaults(Form::default()));
            }
            MenuCmd::Stream if self.view.facts.stream.is_some() => {
                self.perform(Action::Command(Command::StreamOff), effects);
            }
            MenuCmd::Stream => self.ask(Question::stream(&self.view)),
            MenuCmd::Diagnostics if self.view.job == Some(Job::Diagnostics) => {
                self.perform(Action::Command(Command::Cancel), effects);
            }
            // No matter who asked for them: the key only toggles, and asking for more would stop them.
            MenuCmd::Diagnostics if self.view.facts.diagnostics.is_some() => {
                self.perform(Action::Command(Command::DiagnosticsOff), effects);
            }
            MenuCmd::Diagnostics => {
                self.front = ScreenId::Diagnostics;
                self.perform(Action::Command(Command::Diagnostics { pages: None }), effects);
            }
            MenuCmd::Load => {}
        }
    }
}
