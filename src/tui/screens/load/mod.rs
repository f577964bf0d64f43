//! Load new software (AXTC4CO manual, section 4.1.5): choose a file, read its report and the plan, watch, read the
//! verdict.
//!
//! An upload cannot be started while anything stands against it; what stands against it is on the screen.

use std::path::{Path, PathBuf};

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::monitor::{Origin, TextLine};
use crate::session::{Job, LoadReport, Phase, Progress, UnitNow, Verdict};
use crate::time::Duration;
use crate::tui::action::Action;
use crate::tui::input::{FileEntry, FileKind, ImageFacts};
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::Question;
use crate::tui::theme::Theme;
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
    Binding {
        keys: &[Press::Plain(KeyCode::Esc), Press::Plain(KeyCode::Backspace)],
        cmd: Cmd::Back,
        short: "back",
        long: "folder above, other file; while loading: cancel",
    },
    Binding { keys: &[Press::Plain(KeyCode::Char('p'))], cmd: Cmd::Type, short: "path", long: "type a path" },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('k'))],
        cmd: Cmd::Pack,
        short: "",
        long: "send long records: the same words in a sixth less time",
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
const OTHER: Binding = footer(ESC, Cmd::Back, "other file");

/// What the footer shows at each stage; the keys themselves are those of [`BINDINGS`].
const CHECKING_KEYS: &[Binding] = &[OTHER];
const REPORT_KEYS: &[Binding] = &[FINDINGS, OTHER, AGAIN];
const READY_KEYS: &[Binding] = &[footer(ENTER, Cmd::Accept, "start"), PACK, OTHER, AGAIN];
const READY_KEYS_WITH_FINDINGS: &[Binding] = &[footer(ENTER, Cmd::Accept, "start"), PACK, FINDINGS, OTHER];
const RUNNING_KEYS: &[Binding] = &[footer(ESC, Cmd::Back, "cancel")];
const VERDICT_KEYS: &[Binding] = &[footer(ENTER, Cmd::Accept, "close the report")];

const fn footer(keys: &'static [Press], cmd: Cmd, short: &'static str) -> Binding {
    Binding { keys, cmd, short, long: "" }
}

/// Lines of findings shown at once on a small screen before the plan takes its place.
const LEAST_DEFECT_ROWS: usize = 3;
/// Lines that say what the file is, with their heading.
const REPORT_ROWS: usize = 4;
/// Steps of the plan.
const PLAN_STEPS: usize = 4;
/// The steps of an upload.
const PHASES: [(Phase, &str); 6] = [
    (Phase::Check, "check the unit"),
    (Phase::EnterLoader, "enter the loader"),
    (Phase::Erase, "erase"),
    (Phase::Transfer, "transfer"),
    (Phase::Finish, "finish"),
    (Phase::Verify, "verify by the new banner"),
];

/// Choosing a file and reading about it.
#[derive(Debug)]
pub struct Load {
    directory: PathBuf,
    listing: Listing,
    cursor: usize,
    stage: Stage,
    /// Long records are sent instead of the file's own.
    packed: bool,
}

/// What is in the folder.
#[derive(Debug)]
enum Listing {
    /// Nobody has asked yet.
    Unread,
    Reading,
    Read(Vec<FileEntry>),
    Failed(String),
}

/// Where the choosing stands.
#[derive(Debug)]
enum Stage {
    Picking,
    Checking(PathBuf),
    Report { facts: Box<ImageFacts>, scrolled: usize },
}

impl Load {
    /// Starts in a folder.
    pub fn new(directory: PathBuf) -> Self {
        Load { directory, listing: Listing::Unread, cursor: 0, stage: Stage::Picking, packed: false }
    }

    /// The screen comes to the front: a folder that has never been read is read now.
    pub fn entered(&mut self) -> Option<Action> {
        matches!(self.listing, Listing::Unread).then(|| self.list(self.directory.clone()))
    }

    /// A folder has been read.
    pub fn listed(&mut self, directory: PathBuf, entries: Result<Vec<FileEntry>, String>) {
        let came_from = self.directory.file_name().map(|name| name.to_string_lossy().into_owned());
        let is_parent = self.directory.parent() == Some(&*directory);
        self.directory = directory;
        self.cursor = 0;
        self.listing = match entries {
            Err(why) => Listing::Failed(why),
            Ok(entries) => {
                let entries = offered(entries, self.directory.parent().is_some());
                if is_parent {
                    let position = entries.iter().position(|entry| Some(&entry.name) == came_from.as_ref());
                    self.cursor = position.unwrap_or(0);
                }
                Listing::Read(entries)
            }
        };
    }

    /// A file has been checked. An answer to an older question is not wanted any more.
    pub fn checked(&mut self, facts: Box<ImageFacts>) {
        if matches!(&self.stage, Stage::Checking(path) if *path == facts.path) {
            self.stage = Stage::Report { facts, scrolled: 0 };
        }
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

    /// Checks a file.
    pub fn check(&mut self, path: PathBuf) -> Action {
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
                let (all, room) = (findings(facts, area.width).len(), findings_room(facts, view, area));
                let last = all.saturating_sub(room);
                match cmd {
                    Cmd::Up => *scrolled = scrolled.saturating_sub(1),
                    Cmd::Down => *scrolled = (*scrolled + 1).min(last),
                    Cmd::PageUp => *scrolled = scrolled.saturating_sub(room),
                    Cmd::PageDown => *scrolled = (*scrolled + room).min(last),
                    Cmd::First => *scrolled = 0,
                    Cmd::Last => *scrolled = last,
                    Cmd::Back => {
                        self.stage = Stage::Picking;
                        return Some(self.list(self.directory.clone()));
                    }
                    Cmd::Refresh => {
                        let path = facts.path.clone();
                        return Some(self.check(path));
                    }
                    Cmd::Type => return Some(Action::Ask(Question::image(&self.directory))),
                    Cmd::Pack => self.packed = !self.packed,
                    Cmd::Accept if objections(facts, view).is_empty() => {
                        return Some(Action::Ask(Question::start_load(view, facts)));
                    }
                    _ => {}
                }
                None
            }
        }
    }

    /// The keys that mean something now, for the footer.
    pub fn footer(&self, view: &View) -> &'static [Binding] {
        if view.job == Some(Job::Load) {
            return RUNNING_KEYS;
        }
        if view.load.report.is_some() {
            return VERDICT_KEYS;
        }
        match &self.stage {
            Stage::Picking => BINDINGS,
            Stage::Checking(_) => CHECKING_KEYS,
            Stage::Report { facts, .. } if objections(facts, view).is_empty() => match facts.defects.is_empty() {
                true => READY_KEYS,
                false => READY_KEYS_WITH_FINDINGS,
            },
            Stage::Report { .. } => REPORT_KEYS,
        }
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let rows = if scene.view.job == Some(Job::Load) {
            self.running(scene, area)
        } else if let Some(report) = &scene.view.load.report {
            verdict(scene, report, area)
        } else {
            match &self.stage {
                Stage::Picking => self.picker(scene, area),
                Stage::Checking(path) => vec![
                    lines::rule(scene.theme, area.width, "Image", ""),
                    Line::raw(format!("  Reading and checking {} ...", file_name(path))),
                ],
                Stage::Report { facts, scrolled } => report(scene, facts, self.packed, *scrolled, area),
            }
        };
        lines::draw(frame, area, rows);
    }

    fn pick(&mut self, cmd: Cmd, page: usize) -> Option<Action> {
        let entries: &[FileEntry] = match &self.listing {
            Listing::Read(entries) => entries,
            Listing::Unread | Listing::Reading | Listing::Failed(_) => &[],
        };
        let last = entries.len().saturating_sub(1);
        match cmd {
            Cmd::Up => self.cursor = self.cursor.saturating_sub(1),
            Cmd::Down => self.cursor = (self.cursor + 1).min(last),
            Cmd::PageUp => self.cursor = self.cursor.saturating_sub(page / 2),
            Cmd::PageDown => self.cursor = (self.cursor + page / 2).min(last),
            Cmd::First => self.cursor = 0,
            Cmd::Last => self.cursor = last,
            Cmd::Refresh => return Some(self.list(self.directory.clone())),
            Cmd::Type => return Some(Action::Ask(Question::image(&self.directory))),
            Cmd::Back => return self.directory.parent().map(Path::to_path_buf).map(|parent| self.list(parent)),
            Cmd::Accept => {
                let entry = entries.get(self.cursor)?.clone();
                return match entry.kind {
                    FileKind::Folder if entry.name == ".." => self.directory.parent().map(Path::to_path_buf),
                    FileKind::Folder => Some(self.directory.join(&entry.name)),
                    FileKind::File => {
                        let path = self.directory.join(&entry.name);
                        return Some(self.check(path));
                    }
                }
                .map(|directory| self.list(directory));
            }
            _ => {}
        }
        None
    }

    fn list(&mut self, directory: PathBuf) -> Action {
        if !matches!(self.listing, Listing::Read(_)) {
            self.listing = Listing::Reading;
        }
        Action::ListFiles(directory)
    }

    fn picker(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let directory = visible::text(&self.directory.to_string_lossy());
        let place = format::keep_end(&directory, usize::from(area.width).saturating_sub(30));
        let mut rows = vec![lines::rule(theme, area.width, "Choose a file", &place)];
        let entries = match &self.listing {
            Listing::Unread | Listing::Reading => {
                rows.push(Line::styled("  Reading the folder ...", theme.quiet()));
                return rows;
            }
            Listing::Failed(why) => {
                rows.push(Line::from(vec![
                    Span::styled("  The folder cannot be read: ", theme.bad()),
                    Span::raw(visible::text(why)),
                ]));
                rows.push(Line::raw("  Esc goes to the folder above, P types another path."));
                return rows;
            }
            Listing::Read(entries) => entries,
        };
        if !entries.iter().any(|entry| entry.kind == FileKind::File) {
            let text = "  No image here, neither by name nor by how it begins. P types another path.";
            rows.push(Line::styled(text, theme.quiet()));
        }
        let room = usize::from(area.height).saturating_sub(rows.len());
        let first = lines::first_visible(self.cursor, entries.len(), room);
        let shown = entries.iter().enumerate().skip(first).take(room);
        rows.extend(
            shown.map(|(number, entry)| file_row(theme, entry, number == self.cursor, usize::from(area.width))),
        );
        rows
    }

    /// The file or folder that is drawn in row `y` of the screen.
    pub fn entry_at(&self, view: &View, area: Rect, y: u16) -> Option<usize> {
        let is_picking =
            view.job != Some(Job::Load) && view.load.report.is_none() && matches!(self.stage, Stage::Picking);
        let Listing::Read(entries) = &self.listing else { return None };
        let above = 1 + u16::from(!entries.iter().any(|entry| entry.kind == FileKind::File));
        let room = usize::from(area.height.saturating_sub(above));
        let row = usize::from(y.checked_sub(area.y + above).filter(|_| is_picking)?);
        let number = lines::first_visible(self.cursor, entries.len(), room) + row;
        (row < room && number < entries.len()).then_some(number)
    }

    /// Puts the cursor on an entry. Says whether it was there already.
    pub fn choose(&mut self, number: usize) -> bool {
        std::mem::replace(&mut self.cursor, number) == number
    }

    fn running(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let name = self.image().map(|facts| file_name(&facts.path)).unwrap_or_default();
        let mut rows = vec![lines::rule(theme, area.width, "Loading", &name), Line::default()];
        let progress = scene.view.load.progress;
        let current = progress.map_or(Phase::Check, |progress| progress.phase);
        // A loader that erases page by page has no step for it.
        let steps = PHASES.into_iter().filter(|(phase, _)| *phase != Phase::Erase || current == Phase::Erase);
        for (phase, words) in steps {
            let (mark, style) = match phase.cmp(&current) {
                std::cmp::Ordering::Less => ("done", theme.quiet()),
                std::cmp::Ordering::Equal => ("now", theme.strong()),
                std::cmp::Ordering::Greater => ("", theme.quiet()),
            };
            rows.push(Line::from(vec![Span::styled(format!("  {mark:<6}"), theme.good()), Span::styled(words, style)]));
        }
        rows.push(Line::default());
        match progress {
            None => rows.push(Line::styled("  Nothing has been sent yet.", theme.quiet())),
            Some(progress) => rows.extend(gauge_and_numbers(scene, &progress, usize::from(area.width))),
        }
        rows.push(Line::default());
        rows.push(Line::raw("  Keep the unit powered and the cable in. Esc cancels, after a question."));
        rows
    }
}

/// Whether a name is that of an image, by its ending.
pub fn is_image_name(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    matches!(ending.as_deref(), Some("s" | "s19" | "srec" | "hex"))
}

/// Whether a file begins like one, whatever its name: with the type and length of an S-record or of Intel HEX.
fn begins_like_an_image(begins: &[u8]) -> bool {
    let text = begins.strip_prefix(b"\xef\xbb\xbf").unwrap_or(begins).trim_ascii_start();
    let is_hex = |digits: &[u8]| !digits.is_empty() && digits.iter().all(u8::is_ascii_hexdigit);
    match text {
        [b'S' | b's', kind, length @ ..] => kind.is_ascii_digit() && length.get(..2).is_some_and(is_hex),
        [b':', rest @ ..] => rest.get(..8).is_some_and(is_hex),
        _ => false,
    }
}

/// What stands against sending this image now, one sentence each.
fn objections(facts: &ImageFacts, view: &View) -> Vec<String> {
    let mut against = Vec::new();
    if !facts.ok || facts.checked.is_none() {
        against.push("the file has errors and must not be sent.".to_owned());
    }
    if !view.can_send() {
        against.push("no unit is connected. Press 1 to choose a link.".to_owned());
    }
    if let (Some(unit), Some(image)) = (&view.facts.product, &facts.product)
        && !unit.value.eq_ignore_ascii_case(image)
    {
        let (image, unit) = (visible::text(image), visible::text(&unit.value));
        against.push(format!("the file is for an {image}, the unit is an {unit}."));
    }
    if let (Some(noted), Some(image)) = (view.noted(), &facts.product)
        && !noted.product.eq_ignore_ascii_case(image)
    {
        let (image, unit) = (visible::text(image), visible::text(&noted.product));
        against.push(format!("the file is for an {image}, our notes say {unit}."));
    }
    if view.job.is_some() {
        against.push("something else is being done with the unit. Wait for it to end.".to_owned());
    }
    against
}

/// Folders first, then images, by name; everything else is left out.
fn offered(entries: Vec<FileEntry>, has_parent: bool) -> Vec<FileEntry> {
    let mut offered: Vec<FileEntry> = entries
        .into_iter()
        .filter(|entry| match entry.kind {
            FileKind::Folder => !entry.name.starts_with('.'),
            FileKind::File => is_image_name(&entry.name) || begins_like_an_image(&entry.begins),
        })
        .collect();
    offered.sort_by_key(|entry| (entry.kind == FileKind::File, entry.name.to_lowercase()));
    if has_parent {
        offered.insert(
            0,
            FileEntry { name: "..".into(), kind: FileKind::Folder, bytes: 0, begins: Vec::new(), modified: None },
        );
    }
    offered
}

fn file_row(theme: Theme, entry: &FileEntry, is_chosen: bool, columns: usize) -> Line<'static> {
    let mark = if is_chosen { "›" } else { " " };
    let (name, size) = match entry.kind {
        FileKind::Folder if entry.name == ".." => ("../".to_owned(), "folder above".to_owned()),
        FileKind::Folder => (format!("{}/", visible::text(&entry.name)), "folder".to_owned()),
        FileKind::File => (visible::text(&entry.name), format!("{} bytes", format::grouped(entry.bytes))),
    };
    let modified = entry.modified.as_deref().map(visible::text).unwrap_or_default();
    let room = columns.saturating_sub(42);
    let text = format!(" {mark} {} {size:>18}  {} ", format::left(&name, room), format::left(&modified, 16));
    Line::styled(text, if is_chosen { theme.bar() } else { Style::new() })
}

/// Everything about the file, what stands against it, and what will happen.
fn report(scene: Scene, facts: &ImageFacts, packed: bool, scrolled: usize, area: Rect) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let version = facts.version.map(|version| format!(" {version}")).unwrap_or_default();
    let product = facts.product.as_deref().map_or("does not say what it is".into(), visible::text);
    let mut rows = vec![
        lines::rule(theme, area.width, "Image", &file_name(&facts.path)),
        lines::labelled(theme, "Software", format!("{product}{version}")),
        lines::labelled(
            theme,
            "To send",
            format!("{} records, {} characters", format::grouped(facts.records), format::grouped(facts.characters)),
        ),
        lines::labelled(theme, "Check", check_word(theme, facts)),
    ];
    let plan = plan(scene, facts, packed, area.width);
    if !facts.defects.is_empty() {
        let all = findings(facts, area.width);
        let room = findings_room(facts, scene.view, area);
        let first = scrolled.min(all.len() - room);
        let below = all.len() - first - room;
        let range = if below > 0 { format!("↓ {} more lines", format::grouped(below)) } else { String::new() };
        rows.push(lines::rule(theme, area.width, "Findings", &range));
        rows.extend(all.into_iter().skip(first).take(room).map(Line::raw));
    }
    rows.extend(plan);
    rows
}

/// Every finding, in as many lines as it needs.
fn findings(facts: &ImageFacts, columns: u16) -> Vec<String> {
    let room = usize::from(columns).saturating_sub(6).max(1);
    let lines = |defect: &String| {
        let broken = format::wrap(&visible::text(defect), room);
        broken
            .into_iter()
            .enumerate()
            .map(|(number, line)| format!("{}{line}", if number == 0 { "  " } else { "    " }))
    };
    facts.defects.iter().flat_map(lines).collect()
}

/// How many lines of the findings have room beside the plan.
fn findings_room(facts: &ImageFacts, view: &View, area: Rect) -> usize {
    let others = REPORT_ROWS + 1 + plan_rows(facts, view);
    let room = usize::from(area.height).saturating_sub(others);
    room.max(LEAST_DEFECT_ROWS).min(findings(facts, area.width).len())
}

/// Lines of the plan: what is going to happen, and what stands against it or how it is begun.
fn plan_rows(facts: &ImageFacts, view: &View) -> usize {
    let steps = if facts.ok { PLAN_STEPS + 2 } else { 0 };
    1 + steps + objections(facts, view).len().max(1)
}

fn check_word(theme: Theme, facts: &ImageFacts) -> Span<'static> {
    let findings = match facts.defects.len() {
        0 => String::new(),
        1 => ", one finding".into(),
        count => format!(", {} findings", format::grouped(count)),
    };
    match facts.ok {
        true => Span::styled(format!("passed{findings}"), theme.good()),
        false => Span::styled(format!("failed{findings}"), theme.bad()),
    }
}

fn plan(scene: Scene, facts: &ImageFacts, packed: bool, columns: u16) -> Vec<Line<'static>> {
    let (theme, view) = (scene.theme, scene.view);
    let mut rows = vec![lines::rule(theme, columns, "Plan", "")];
    let product =
        facts.product.as_deref().map_or("the right product".into(), |name| format!("an {}", visible::text(name)));
    let time = format::minutes(Duration::from_secs_f64(facts.time.as_secs_f64().ceil()));
    let sent = format::grouped(facts.characters);
    let expected = match (&facts.product, facts.version) {
        (Some(product), Some(version)) => format!("name {} {version}", visible::text(product)),
        _ => "name what the file holds".into(),
    };
    if facts.ok {
        let steps: [String; PLAN_STEPS] = [
            format!("Make sure that the unit is {product}."),
            "Send L and the password; the unit resets into its loader.".into(),
            match packed {
                false => format!("Send {sent} characters: some {time} with what the loader needs."),
                true => format!("Send fewer than {sent} characters, in long records: less than {time}."),
            },
            format!("Wait for the banner of the new software: it must {expected}."),
        ];
        let numbered = steps.into_iter().enumerate();
        rows.extend(numbered.map(|(number, step)| Line::raw(format!("  {}. {step}", number + 1))));
        rows.push(lines::labelled(theme, "Unit now", unit_version(view)));
        rows.push(lines::labelled(
            theme,
            "Afterwards",
            format!("{} ({})", expected_version(facts), change(view, facts)),
        ));
    }
    let against = objections(facts, view);
    if against.is_empty() {
        rows.push(Line::from(vec![
            Span::styled("  Enter", theme.key()),
            Span::raw(" asks for the password and starts. Keep the unit powered meanwhile."),
        ]));
    } else {
        rows.extend(
            against
                .into_iter()
                .map(|objection| Line::from(vec![Span::styled("  Cannot start: ", theme.bad()), Span::raw(objection)])),
        );
    }
    rows
}

fn unit_version(view: &View) -> String {
    let product = view.facts.product.as_ref().map(|known| visible::text(&known.value));
    let version = view.facts.version.as_ref().map(|known| known.value.to_string());
    match (product, version) {
        (Some(product), Some(version)) => format!("{product} {version}"),
        (Some(product), None) => format!("{product}, version not known"),
        (None, _) => match view.noted() {
            Some(noted) => {
                let image = file_name(Path::new(&noted.image));
                format!("{}, which {image} was begun to be sent to", visible::text(&noted.product))
            }
            None => "not known; the unit is asked first".into(),
        },
    }
}

fn expected_version(facts: &ImageFacts) -> String {
    let product = facts.product.as_deref().map_or("what the file holds".into(), visible::text);
    facts.version.map_or_else(|| product.clone(), |version| format!("{product} {version}"))
}

fn change(view: &View, facts: &ImageFacts) -> &'static str {
    let unit = view.facts.product.as_ref().map(|known| known.value.to_ascii_lowercase());
    if unit.is_none() || unit != facts.product.as_ref().map(|product| product.to_ascii_lowercase()) {
        return "cannot be compared";
    }
    match (view.facts.version.as_ref().map(|known| known.value), facts.version) {
        (Some(now), Some(then)) if then > now => "newer",
        (Some(now), Some(then)) if then < now => "older: a downgrade",
        (Some(_), Some(_)) => "the same version again",
        _ => "cannot be compared",
    }
}

fn gauge_and_numbers(scene: Scene, progress: &Progress, columns: usize) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let share = if progress.bytes_total == 0 { 0.0 } else { progress.bytes as f64 / progress.bytes_total as f64 };
    let share = share.clamp(0.0, 1.0);
    let room = columns.saturating_sub(11).min(100);
    let filled = (share * room as f64).floor() as usize;
    let left = progress.eta().map_or_else(
        || "time left not known yet".to_owned(),
        |eta| format!("{} left", format::minutes(Duration::from_secs_f64(eta.as_secs_f64().ceil()))),
    );
    let held = match (scene.view.load.held_since, progress.held) {
        (Some(since), _) => Some(scene.now.since(since)),
        (None, held) => held,
    };
    let line = match held {
        Some(held) => Span::styled(
            format!("held by the unit (XOFF) for {}.{} s", held.as_secs(), held.subsec_millis() / 100),
            theme.warning(),
        ),
        None => Span::raw("free"),
    };
    let of = |part: usize, whole: usize| format!("{} of {}", format::grouped(part), format::grouped(whole));
    vec![
        Line::from(vec![
            Span::raw("  "),
            Span::styled("█".repeat(filled), theme.good()),
            Span::styled("░".repeat(room - filled), theme.quiet()),
            Span::styled(format!("  {:>3.0} %", (share * 100.0).floor()), theme.strong()),
        ]),
        Line::default(),
        lines::labelled(theme, "Records", of(progress.records, progress.records_total)),
        lines::labelled(theme, "Characters", of(progress.bytes, progress.bytes_total)),
        lines::labelled(
            theme,
            "Time",
            format!(
                "{} gone, {left}, {} characters a second",
                format::minutes(progress.elapsed),
                format::grouped(progress.rate() as u64)
            ),
        ),
        lines::labelled(theme, "Line", line),
        lines::labelled(theme, "Last heard", Span::raw(last_heard(scene, columns))),
    ]
}

/// The unit's last words: what a loader says while it takes a file, its dots too.
fn last_heard(scene: Scene, columns: usize) -> String {
    let said = |line: &&TextLine| line.origin == Origin::Unit && !line.text.trim().is_empty();
    let text = scene.scrollback.lines().rev().find(said).map_or("nothing yet", |line| line.text.trim());
    format::keep_end(text, columns.saturating_sub(lines::LABEL_COLUMNS + 4))
}

fn verdict(scene: Scene, report: &LoadReport, area: Rect) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let room = usize::from(area.width).saturating_sub(lines::LABEL_COLUMNS + 4);
    let (word, style) = match report.verdict {
        Verdict::Done => ("Done", theme.good()),
        Verdict::Refused => ("Refused, nothing was changed", theme.warning()),
        Verdict::UnitRefused => ("The unit refused", theme.bad()),
        Verdict::NoAnswer => ("No answer", theme.bad()),
        Verdict::Failed => ("Failed", theme.bad()),
        Verdict::WrongApplication => ("The unit does not run what was sent", theme.bad()),
        Verdict::Interrupted => ("Cancelled", theme.warning()),
    };
    let unit = match report.unit {
        UnitNow::Application => "runs its application",
        UnitNow::Loader => "waits in its loader for a file",
        UnitNow::Unknown => "nobody can say",
    };
    let version = |version: Option<crate::version::Version>| version.map_or("not known".into(), |v| v.to_string());
    let mut rows = vec![
        lines::rule(
            theme,
            area.width,
            "Verdict",
            report.product.as_deref().map(visible::text).unwrap_or_default().as_str(),
        ),
        Line::default(),
        Line::from(vec![Span::raw("  "), Span::styled(word, style)]),
        Line::default(),
    ];
    let mut paragraph = |label: &str, text: &str| {
        for (number, line) in format::wrap(&visible::text(text), room).into_iter().enumerate() {
            rows.push(lines::labelled(theme, if number == 0 { label } else { "" }, line));
        }
    };
    paragraph("Happened", &visible::sentence(&report.what));
    paragraph("Unit now", unit);
    paragraph(
        "Version",
        &format!("before {}, after {}", version(report.version_before), version(report.version_after)),
    );
    let (sent, total) = (format::grouped(report.records), format::grouped(report.records_total));
    paragraph("Sent", &format!("{sent} of {total} records in {}", format::minutes(report.duration)));
    if let Some(address) = report.address.filter(|_| report.verdict != Verdict::Done) {
        paragraph("Stopped at", &format!("{address:#08x}"));
    }
    if !report.heard.is_empty() {
        paragraph("Heard", &report.heard);
    }
    paragraph("What next", &format!("{}.", visible::sentence(report.advice())));
    rows.push(Line::default());
    rows.push(Line::from(vec![
        Span::styled("  Enter", theme.key()),
        Span::raw(" goes back to the file and its plan."),
    ]));
    rows
}

fn file_name(path: &Path) -> String {
    visible::text(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, kind: FileKind) -> FileEntry {
        FileEntry { name: name.into(), kind, bytes: 1, begins: Vec::new(), modified: None }
    }

    #[test]
    fn folders_and_images_are_offered_and_nothing_else() {
        let entries = vec![
            entry("b.S", FileKind::File),
            entry("zoo", FileKind::Folder),
            entry("notes.txt", FileKind::File),
            entry(".git", FileKind::Folder),
            entry("A.s19", FileKind::File),
            entry("S", FileKind::File),
        ];
        let names: Vec<_> = offered(entries, true).into_iter().map(|entry| entry.name).collect();
        assert_eq!(names, ["..", "zoo", "A.s19", "b.S"]);
        assert!(["x.elf.S", "x.SREC", "x.hex"].into_iter().all(is_image_name));
    }

    #[test]
    fn a_file_without_the_ending_is_offered_if_it_begins_like_an_image() {
        for begins in ["S00600004844521B", "\u{feff}S11300", ":020000040000", "\r\ns113"] {
            let file = FileEntry { begins: begins.as_bytes().to_vec(), ..entry("firmware.bin", FileKind::File) };
            assert_eq!(offered(vec![file], false).len(), 1, "{begins}");
        }
        for begins in ["", "S", "Sxx", "SHORT", ":", ": a smile", "\x7fELF"] {
            let file = FileEntry { begins: begins.as_bytes().to_vec(), ..entry("firmware.bin", FileKind::File) };
            assert_eq!(offered(vec![file], false).len(), 0, "{begins}");
        }
    }
}
