//! The picture: what is around the screen in front, the screen, and what is in front of it.

use ratatui::Frame;
use ratatui::layout::Rect;

use super::App;
use crate::session::Job;
use crate::tui::frame;
use crate::tui::keymap::{Binding, Cmd};
use crate::tui::popup::{self, Popup, Question};
use crate::tui::screens::bench::Bench;
use crate::tui::screens::recordings::Recordings;
use crate::tui::screens::stream::Stream;
use crate::tui::screens::{Scene, ScreenId, overview};
use crate::tui::view::LinkState;
use crate::tui::widgets::lines;

impl App {
    /// Draws the picture.
    pub fn draw(&self, frame: &mut Frame) {
        let area = frame.area();
        if frame::is_too_small((area.width, area.height)) {
            let asks = matches!(self.popup, Some(Popup::Asking(Question::Quit)));
            return frame::too_small(&self.view, asks, frame);
        }
        let columns = usize::from(area.width);
        let row = |y: u16| Rect { y, height: 1, ..area };
        let front = self.help.is_none().then_some(self.front);
        let theme = self.theme;
        lines::draw(frame, row(0), [frame::header(&self.view, theme, columns)]);
        lines::draw(frame, row(1), [frame::tabs(&self.view, front, theme, columns)]);
        let lost = frame::lost(&self.view, self.front, theme, columns);
        let (banner, body) = lines::split(frame::body(area, &self.view), lost.len() as u16);
        lines::draw(frame, banner, lost);
        self.draw_screen(body, frame);
        let notice = frame::notice(&self.view, theme, columns);
        let height = notice.len() as u16;
        lines::draw(frame, Rect { y: area.height - 2 - height, height, ..area }, notice);
        lines::draw(frame, row(area.height - 2), [frame::menu(theme)]);
        let keys = match self.front {
            _ if self.help.is_some() => frame::help_keys(theme),
            ScreenId::Terminal if !self.view.is_recording() => {
                frame::terminal_keys(theme, self.front, self.terminal.is_after_prefix(), columns)
            }
            _ => frame::keys(theme, &self.footer(columns)),
        };
        lines::draw(frame, row(area.height - 1), [keys]);
        if let Some(popup) = &self.popup {
            popup::draw(popup, &self.view, theme, frame::body(area, &self.view), frame);
        }
    }

    /// The bindings of the screen in front that mean something now, as many as have room.
    pub(super) fn footer(&self, columns: usize) -> Vec<Binding> {
        let bindings = match self.front {
            ScreenId::Load => self.load.footer(&self.view, self.screen_area()),
            ScreenId::Stream => Stream::footer(&self.view),
            ScreenId::Recordings => Recordings::footer(&self.view),
            ScreenId::Dictionary => self.dictionary.footer(&self.view),
            ScreenId::Bench => Bench::footer(&self.view),
            screen => screen.bindings().to_vec(),
        };
        let meant = bindings.into_iter().filter(|binding| self.means_something(binding.cmd)).collect();
        frame::fitting(self.theme, meant, self.front.dispensable(), columns)
    }

    /// Whether a key of the screen in front does something now. One that does not is left out of the footer.
    fn means_something(&self, cmd: Cmd) -> bool {
        let view = &self.view;
        let has_rows = !view.unit.monitor.stream.channels.is_empty();
        match (self.front, cmd) {
            (ScreenId::Connect, Cmd::Disconnect) => {
                matches!(view.link.state, LinkState::Open | LinkState::Lost(_))
            }
            (ScreenId::Overview, Cmd::PageDown) => overview::has_faults(self.scene()),
            (ScreenId::Stream, Cmd::Mark) => view.link.name.is_some(),
            (ScreenId::Stream, Cmd::Export) => has_rows || view.export.is_some(),
            (ScreenId::Overview | ScreenId::Stream, _) => has_rows,
            (ScreenId::Dictionary, Cmd::Compare) => view.current_dictionary().is_some(),
            (ScreenId::Dictionary, Cmd::Export | Cmd::Filter) => view.unit.dictionary.is_some(),
            (ScreenId::Dictionary, Cmd::Back) => self.dictionary.is_narrowed() || view.job == Some(Job::ReadDictionary),
            (ScreenId::Dictionary, _) => view.unit.dictionary.is_some() || view.product().is_some(),
            (ScreenId::Diagnostics, _) => view.unit.monitor.diagnostics.at.is_some(),
            (ScreenId::Recordings, Cmd::Down | Cmd::Accept) => !self.recordings.entries().is_empty(),
            (ScreenId::Recordings, cmd) if cmd != Cmd::Refresh => view.playing.is_some(),
            (ScreenId::Bench, _) => view.emulated().is_some(),
            (ScreenId::Terminal, Cmd::SendFile | Cmd::Break) => view.can_send(),
            (ScreenId::Connect | ScreenId::Terminal | ScreenId::Load | ScreenId::Recordings, _) => true,
        }
    }

    fn draw_screen(&self, area: Rect, frame: &mut Frame) {
        if let Some(help) = &self.help {
            return help.draw(self.theme, self.front, area, frame);
        }
        let scene = self.scene();
        match self.front {
            ScreenId::Connect => self.connect.draw(scene, area, frame),
            ScreenId::Overview => self.overview.draw(scene, area, frame),
            ScreenId::Terminal => self.terminal.draw(scene, area, frame),
            ScreenId::Load => self.load.draw(scene, area, frame),
            ScreenId::Dictionary => self.dictionary.draw(scene, area, frame),
            ScreenId::Stream => self.stream.draw(scene, area, frame),
            ScreenId::Diagnostics => self.diagnostics.draw(scene, area, frame),
            ScreenId::Recordings => self.recordings.draw(scene, area, frame),
            ScreenId::Bench => self.bench.draw(scene, area, frame),
        }
    }

    pub(super) fn scene(&self) -> Scene<'_> {
        Scene {
            view: &self.view,
            record: self.record(),
            scrollback: &self.scrollback,
            theme: self.theme,
            now: self.now,
            start_of_day: self.start_of_day,
        }
    }
}
