//! Load new software (AXTC4CO manual, section 4.1.5): choose a file, read its report and the plan, watch, read the
//! verdict.
//!
//! An upload cannot be started while anything prevents it; what does is on the screen.

mod progress;
mod report;
mod verdict;

use std::path::{Path, PathBuf};

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::text::Line;

use report::{findings_shown, misfits, objections, report};
use verdict::verdict;

use super::Scene;
use crate::device::LoaderKind;
use crate::image::DefectId;
use crate::session::Job;
use crate::tui::action::Action;
use crate::tui::image_facts::ImageFacts;
use crate::tui::input::FileEntry;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::picker::{Offers, Picked, Picker};
use crate::tui::popup::Question;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Name on the tab.
pub const TITLE: &str = "Load software";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "entry or line above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "choose", long: "entry or line below" },
    Binding { keys: &[Press::Plain(KeyCode::PageUp)], cmd: Cmd::PageUp, short: "", long: "a page up" },
    Binding { keys: &[Press::Plain(KeyCode::PageDown)], cmd: Cmd::PageDown, short: "", long: "a page down" },
    Binding { keys: &[Press::Plain(KeyCode::Home)], cmd: Cmd::First, short: "", long: "to the first" },
    Binding { keys: &[Press::Plain(KeyCode::End)], cmd: Cmd::Last, short: "", long: "to the last" },
    Binding {
        keys: &[Press::Plain(KeyCode::Enter)],
        cmd: Cmd::Accept,
        short: "go on",
        long: "open the folder, check the file, start the upload, go back",
    },
    Binding { keys: &[Press::Plain(KeyCode::Backspace)], cmd: Cmd::Above, short: "folder above", long: "folder above" },
    Binding {
        keys: &[Press::Plain(KeyCode::Esc)],
        cmd: Cmd::Back,
        short: "",
        long: "other file; while loading: cancel",
    },
    Binding { keys: &[Press::Plain(KeyCode::Char('p'))], cmd: Cmd::Type, short: "path", long: "type a path" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('k'))],
        cmd: Cmd::Pack,
        short: "",
        long: "send long records: the same words in a sixth less time",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('g'))],
        cmd: Cmd::Loader,
        short: "",
        long: "another kind of loader than the product's: g1, g2, g3",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('o'))],
        cmd: Cmd::Allow,
        short: "",
        long: "send in spite of what speaks against it",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('n'))],
        cmd: Cmd::OtherUnit,
        short: "",
        long: "the unit is not the one our note is about: ask which it is",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Refresh,
        short: "read again",
        long: "read the folder or the file again",
    },
];

const ENTER: &[Press] = &[Press::Plain(KeyCode::Enter)];
const ESC: &[Press] = &[Press::Plain(KeyCode::Esc)];
const FINDINGS: Binding = footer(&[Press::Plain(KeyCode::Down)], Cmd::Down, "findings");
const AGAIN: Binding = footer(&[Press::Plain(KeyCode::Char('r'))], Cmd::Refresh, "read again");
const PACK: Binding = footer(&[Press::Plain(KeyCode::Char('k'))], Cmd::Pack, "pack");
const UNPACK: Binding = footer(&[Press::Plain(KeyCode::Char('k'))], Cmd::Pack, "packed: on");
const LOADER: Binding = footer(&[Press::Plain(KeyCode::Char('g'))], Cmd::Loader, "loader");
const START: Binding = footer(ENTER, Cmd::Accept, "start");
const OVERRIDE: Binding = footer(&[Press::Plain(KeyCode::Char('o'))], Cmd::Allow, "override");
const OTHER_UNIT: Binding = footer(&[Press::Plain(KeyCode::Char('n'))], Cmd::OtherUnit, "other unit");
const OTHER: Binding = footer(ESC, Cmd::Back, "other file");

/// What the footer shows at each stage; the keys themselves are those of [`BINDINGS`].
const CHECKING_KEYS: &[Binding] = &[OTHER];
const REPORT_KEYS: &[Binding] = &[OVERRIDE, START, OTHER_UNIT, PACK, LOADER, FINDINGS, OTHER, AGAIN];
const RUNNING_KEYS: &[Binding] = &[footer(ESC, Cmd::Back, "cancel")];
const VERDICT_KEYS: &[Binding] = &[footer(ENTER, Cmd::Accept, "close the report")];

const fn footer(keys: &'static [Press], cmd: Cmd, short: &'static str) -> Binding {
    Binding { keys, cmd, short, long: "" }
}

/// Choosing a file and reading about it.
#[derive(Debug)]
pub struct Load {
    picker: Picker,
    stage: Stage,
    /// Long records are sent instead of the file's own.
    packed: bool,
    /// The loader the unit has, where the user knows better than the product's file.
    loader: Option<LoaderKind>,
    /// Errors in spite of which the file may be sent.
    allow: Vec<DefectId>,
}

/// How far the choosing has come.
#[derive(Debug)]
enum Stage {
    Picking,
    /// A file is being read and checked.
    Checking(PathBuf),
    Report {
        facts: Box<ImageFacts>,
        scrolled: usize,
    },
}

impl Load {
    /// Starts in a folder.
    pub fn new(directory: PathBuf) -> Self {
        Load {
            picker: Picker::new(Offers::Images, directory),
            stage: Stage::Picking,
            packed: false,
            loader: None,
            allow: Vec::new(),
        }
    }

    /// The screen comes to the front: a folder that has never been read is read now.
    pub fn entered(&mut self) -> Option<Action> {
        (!self.picker.is_read()).then(|| self.list())
    }

    /// A folder has been read. One that was typed as if it were a file is opened.
    pub fn listed(&mut self, directory: PathBuf, entries: Result<Vec<FileEntry>, String>) {
        if self.is_checking(&directory) {
            self.stage = Stage::Picking;
        }
        self.picker.listed(directory, entries);
    }

    /// Whether this folder is waited for.
    pub fn awaits(&self, directory: &Path) -> bool {
        self.picker.awaits(directory)
    }

    fn list(&mut self) -> Action {
        let directory = self.picker.directory().to_path_buf();
        Action::ListFiles(self.picker.list(directory))
    }

    fn pick(&mut self, cmd: Cmd, page: usize) -> Option<Action> {
        if cmd == Cmd::Type {
            return Some(Action::Ask(Question::image(self.picker.directory())));
        }
        // Esc leaves something, and there is nothing here to leave.
        let cmd = match cmd {
            Cmd::Back => return None,
            Cmd::Above => Cmd::Back,
            cmd => cmd,
        };
        Some(match self.picker.on(cmd, page / 2)? {
            Picked::Folder(directory) => Action::ListFiles(directory),
            Picked::File(path) => self.check(path),
        })
    }

    /// The file or folder that is drawn in row `y` of the screen.
    pub fn entry_at(&self, view: &View, area: Rect, y: u16) -> Option<usize> {
        let is_picking =
            view.job != Some(Job::Load) && view.load.report.is_none() && matches!(self.stage, Stage::Picking);
        let row = usize::from(y.checked_sub(area.y + 1).filter(|_| is_picking)?);
        self.picker.entry_at(row, usize::from(area.height.saturating_sub(1)))
    }

    /// Puts the cursor on an entry. Says whether it was there already.
    pub fn choose(&mut self, number: usize) -> bool {
        self.picker.choose(number)
    }

    /// A file has been checked. An answer to an older question is not wanted any more.
    pub fn checked(&mut self, facts: Box<ImageFacts>) {
        if self.is_checking(&facts.path) {
            self.stage = Stage::Report { facts, scrolled: 0 };
        }
    }

    /// Whether this file is being read.
    pub fn is_checking(&self, path: &Path) -> bool {
        matches!(&self.stage, Stage::Checking(of) if of == path)
    }

    /// There is nothing to check: another file has to be chosen. Says whether anybody has waited for it.
    pub fn unreadable(&mut self, path: &Path) -> bool {
        let is_awaited = self.is_checking(path);
        if is_awaited {
            self.stage = Stage::Picking;
        }
        is_awaited
    }

    /// Asks what the unit's label says, where that and nothing else is wanted now.
    pub fn ask_label(&self, view: &View) -> Option<Action> {
        let facts =
            self.image().filter(|facts| view.needs_label() && objections(facts, view, self.loader).is_empty())?;
        Some(Action::Ask(Question::label(view, facts)))
    }

    /// The image the report is about.
    pub fn image(&self) -> Option<&ImageFacts> {
        match &self.stage {
            Stage::Report { facts, .. } => Some(facts),
            Stage::Picking | Stage::Checking(_) => None,
        }
    }

    /// Whether long records are to be sent.
    pub fn is_packed(&self) -> bool {
        self.packed
    }

    /// The loader the unit is said to have; `None` for the one its product is assumed to have.
    pub fn loader(&self) -> Option<LoaderKind> {
        self.loader
    }

    /// Another unit: what was said of the loader was said of the one before. A file that was judged for that loader is to
    /// be checked again.
    pub fn begin_unit(&mut self) -> Option<Action> {
        self.loader.take()?;
        let path = self.image()?.path.clone();
        Some(self.check(path))
    }

    /// The next kind of loader; after the last one the product's own again.
    fn next_loader(&mut self) {
        let next = match self.loader {
            None => 0,
            Some(kind) => LoaderKind::ALL.iter().position(|known| *known == kind).map_or(0, |place| place + 1),
        };
        self.loader = LoaderKind::ALL.get(next).copied();
    }

    /// Errors in spite of which the file may be sent.
    pub fn allowed(&self) -> &[DefectId] {
        &self.allow
    }

    /// Allows one more error, and checks the file again.
    pub fn allow(&mut self, error: DefectId) -> Option<Action> {
        let path = self.image()?.path.clone();
        let action = self.check(path);
        self.allow.push(error);
        Some(action)
    }

    /// Checks a file. What was allowed in another one is not allowed in it.
    pub fn check(&mut self, path: PathBuf) -> Action {
        if self.image().is_none_or(|facts| facts.path != path) && !self.is_checking(&path) {
            self.allow.clear();
        }
        self.stage = Stage::Checking(path.clone());
        Action::CheckImage(path)
    }

    /// What a command does here; `area` is that of the picture.
    pub fn on(&mut self, cmd: Cmd, view: &View, area: Rect) -> Option<Action> {
        let page = usize::from(area.height);
        if view.job == Some(Job::Load) {
            return (cmd == Cmd::Back).then_some(Action::Ask(Question::CancelLoad));
        }
        if view.load.report.is_some() {
            return matches!(cmd, Cmd::Accept | Cmd::Back).then_some(Action::DismissReport);
        }
        match &mut self.stage {
            Stage::Picking => self.pick(cmd, page),
            Stage::Checking(_) => {
                if cmd == Cmd::Back {
                    self.stage = Stage::Picking;
                }
                None
            }
            Stage::Report { facts, scrolled } => {
                let (all, room) = findings_shown(facts, view, (self.packed, self.loader), area);
                if let Some(place) = cmd.moved(*scrolled, all.saturating_sub(room), room) {
                    *scrolled = place;
                    return None;
                }
                match cmd {
                    Cmd::Back => {
                        self.stage = Stage::Picking;
                        return Some(self.list());
                    }
                    Cmd::Refresh => {
                        let path = facts.path.clone();
                        return Some(self.check(path));
                    }
                    Cmd::Type => return Some(Action::Ask(Question::image(self.picker.directory()))),
                    Cmd::Pack => self.packed = !self.packed,
                    Cmd::Loader => {
                        // What a loader does with some defects differs: the file is judged again.
                        let path = facts.path.clone();
                        self.next_loader();
                        return Some(self.check(path));
                    }
                    Cmd::Allow => {
                        let errors = overridable(facts, view, self.loader);
                        return (!errors.is_empty()).then(|| Action::Ask(Question::allow(errors)));
                    }
                    Cmd::OtherUnit => return view.noted().map(|_| Action::OtherUnit),
                    Cmd::Accept => {
                        return Some(match objections(facts, view, self.loader).first() {
                            Some(objection) => Action::Tell(format!("Not started: {objection}")),
                            None => Question::start_load(view, facts),
                        });
                    }
                    _ => {}
                }
                None
            }
        }
    }

    /// The keys that mean something now, for the footer; `area` is that of the picture.
    pub fn footer(&self, view: &View, area: Rect) -> Vec<Binding> {
        if view.job == Some(Job::Load) {
            return RUNNING_KEYS.to_vec();
        }
        if view.load.report.is_some() {
            return VERDICT_KEYS.to_vec();
        }
        let facts = match &self.stage {
            Stage::Picking => return BINDINGS.to_vec(),
            Stage::Checking(_) => return CHECKING_KEYS.to_vec(),
            Stage::Report { facts, .. } => facts,
        };
        let can_start = objections(facts, view, self.loader).is_empty();
        let (all, shown) = findings_shown(facts, view, (self.packed, self.loader), area);
        let has_place = |binding: &Binding| match binding.cmd {
            Cmd::Accept => can_start,
            Cmd::Pack => facts.ok,
            Cmd::OtherUnit => view.noted().is_some(),
            Cmd::Allow => !overridable(facts, view, self.loader).is_empty(),
            // Where all of them are in sight there is nothing to move.
            Cmd::Down => shown < all,
            _ => true,
        };
        let named = |binding: Binding| if binding.cmd == Cmd::Pack && self.packed { UNPACK } else { binding };
        REPORT_KEYS.iter().copied().filter(has_place).map(named).collect()
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let rows = if scene.view.job == Some(Job::Load) {
            self.running(scene, area)
        } else if let Some(report) = &scene.view.load.report {
            verdict(scene, report, area)
        } else {
            match &self.stage {
                Stage::Picking => {
                    let directory = visible::text(&self.picker.directory().to_string_lossy());
                    let place = format::keep_end(&directory, usize::from(area.width).saturating_sub(30));
                    let mut rows = vec![lines::rule(scene.theme, area.width, "Choose a file", &place)];
                    let (columns, room) = (usize::from(area.width), usize::from(area.height).saturating_sub(1));
                    let otherwise = "P types a path.";
                    rows.extend(self.picker.rows(scene.theme, columns, room, otherwise));
                    rows
                }
                Stage::Checking(path) => vec![
                    lines::rule(scene.theme, area.width, "Image", ""),
                    Line::raw(format!("  Reading and checking {} ...", file_name(path))),
                ],
                Stage::Report { facts, scrolled } => report(scene, facts, (self.packed, self.loader), *scrolled, area),
            }
        };
        lines::draw(frame, area, rows);
    }
}

/// What speaks against the file, or against sending it to this unit, by the names that O takes.
fn overridable(facts: &ImageFacts, view: &View, loader: Option<LoaderKind>) -> Vec<DefectId> {
    let misfits = misfits(facts, view, loader).into_iter().map(|misfit| misfit.id);
    facts.errors.iter().copied().chain(misfits).collect()
}

fn file_name(path: &Path) -> String {
    visible::text(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy())
}
