//! Choosing a file.

use std::path::{Path, PathBuf};

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::{Listing, Load, Stage};
use crate::session::Job;
use crate::tui::action::Action;
use crate::tui::input::{FileEntry, FileKind};
use crate::tui::keymap::Cmd;
use crate::tui::popup::Question;
use crate::tui::screens::Scene;
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

impl Load {
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

    pub(super) fn pick(&mut self, cmd: Cmd, page: usize) -> Option<Action> {
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

    pub(super) fn list(&mut self, directory: PathBuf) -> Action {
        if !matches!(self.listing, Listing::Read(_)) {
            self.listing = Listing::Reading;
        }
        Action::ListFiles(directory)
    }

    pub(super) fn picker(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
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
