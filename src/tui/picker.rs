//! Choosing a file: what of a folder is offered, and a cursor on it.
//!
//! The load screen shows one, and a question that wants a file. Neither reads a folder: what has to be read is asked for
//! ([`Picked::Folder`]), and comes back as [`Picker::listed`].

use std::cmp::Reverse;
use std::path::{Path, PathBuf};

use ratatui::style::Style;
use ratatui::text::Line;

use super::input::{FileEntry, FileKind, MOST_LISTED};
use super::keymap::Cmd;
use super::theme::Theme;
use super::visible;
use super::widgets::{format, lines};

/// A folder and the files in it that may be meant.
#[derive(Debug)]
pub struct Picker {
    offers: Offers,
    directory: PathBuf,
    listing: Listing,
    /// The folder that was asked for last, until it has been told of.
    awaited: Option<PathBuf>,
    cursor: usize,
}

/// Which files are offered; folders are always.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offers {
    /// Software images, by name or by how they begin.
    Images,
    /// Saved object dictionaries, newest first.
    Dumps,
    /// Every file.
    Anything,
}

/// What is in the folder.
#[derive(Debug)]
enum Listing {
    /// Nobody has asked yet.
    Unread,
    Reading,
    Read {
        entries: Vec<FileEntry>,
        /// There is more in the folder than was read.
        is_cut: bool,
    },
    Failed(String),
}

/// What the user has chosen.
#[derive(Debug, PartialEq)]
pub enum Picked {
    /// This folder is to be read.
    Folder(PathBuf),
    /// This file is meant.
    File(PathBuf),
}

/// Schema of a saved object dictionary, as it appears at its beginning.
const DUMP: &[u8] = b"axcon.dictionary/";

impl Picker {
    /// In a folder that nobody has read yet.
    pub fn new(offers: Offers, directory: PathBuf) -> Self {
        Picker { offers, directory, listing: Listing::Unread, awaited: None, cursor: 0 }
    }

    /// Where it is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Whether its folder has been asked for and been told of, well or not.
    pub fn is_read(&self) -> bool {
        matches!(self.listing, Listing::Read { .. } | Listing::Failed(_))
    }

    /// Wants a folder read; what is there stays in sight until then.
    pub fn list(&mut self, directory: PathBuf) -> PathBuf {
        if !matches!(self.listing, Listing::Read { .. }) {
            self.listing = Listing::Reading;
        }
        self.awaited = Some(directory.clone());
        directory
    }

    /// Whether this folder was asked for last. Folders are read side by side: a slow one may come when nobody wants it any
    /// more.
    pub fn awaits(&self, directory: &Path) -> bool {
        self.awaited.as_deref() == Some(directory)
    }

    /// A folder has been read.
    pub fn listed(&mut self, directory: PathBuf, entries: Result<Vec<FileEntry>, String>) {
        let came_from = self.directory.file_name().map(|name| name.to_string_lossy().into_owned());
        let is_parent = self.directory.parent() == Some(&*directory);
        let stays = self.directory == directory && self.is_read();
        let chosen = self.entries().get(self.cursor).map(|entry| entry.name.clone()).filter(|_| stays);
        self.directory = directory;
        self.awaited = None;
        self.cursor = 0;
        self.listing = match entries {
            Err(why) => Listing::Failed(why),
            Ok(entries) => {
                let is_cut = entries.len() >= MOST_LISTED;
                let entries = offered(self.offers, entries, self.directory.parent().is_some());
                let wanted = chosen.or(came_from.filter(|_| is_parent));
                let position = entries.iter().position(|entry| Some(&entry.name) == wanted.as_ref());
                let first_file = entries.iter().position(|entry| entry.kind == FileKind::File);
                // A question wants a file, of dumps the newest; on a screen one looks around first.
                let first = first_file.filter(|_| self.offers != Offers::Images).unwrap_or(0);
                self.cursor = position.unwrap_or(first);
                Listing::Read { entries, is_cut }
            }
        };
    }

    /// What a command does; `page` is the number of rows in sight.
    pub fn on(&mut self, cmd: Cmd, page: usize) -> Option<Picked> {
        let last = self.entries().len().saturating_sub(1);
        if let Some(place) = cmd.moved(self.cursor, last, page) {
            self.cursor = place;
            return None;
        }
        match cmd {
            Cmd::Refresh => Some(Picked::Folder(self.list(self.directory.clone()))),
            Cmd::Back => self.parent(),
            Cmd::Accept => {
                let entry = self.entries().get(self.cursor)?;
                let path = self.directory.join(&entry.name);
                match entry.kind {
                    FileKind::Folder if entry.name == ".." => self.parent(),
                    FileKind::Folder => Some(Picked::Folder(self.list(path))),
                    FileKind::File => Some(Picked::File(path)),
                }
            }
            _ => None,
        }
    }

    /// What is in the folder, in `room` rows; `otherwise` says how else a file can be named.
    pub fn rows(&self, theme: Theme, columns: usize, room: usize, otherwise: &str) -> Vec<Line<'static>> {
        let entries = match &self.listing {
            Listing::Unread | Listing::Reading => {
                return vec![Line::styled("  Reading the folder ...", theme.quiet())];
            }
            Listing::Failed(why) => {
                let text = format!("The folder cannot be read: {}", visible::text(why));
                let mut told = lines::paragraph(&text, columns, theme.bad());
                told.push(Line::raw(format!("  {otherwise}")));
                return told;
            }
            Listing::Read { entries, .. } => entries,
        };
        let remark = self.remark().map(|text| Line::styled(format!("  {text} {otherwise}"), theme.quiet()));
        let mut rows: Vec<Line> = remark.into_iter().collect();
        let room = room.saturating_sub(rows.len());
        let first = lines::first_visible(self.cursor, entries.len(), room);
        let shown = entries.iter().enumerate().skip(first).take(room);
        rows.extend(shown.map(|(number, entry)| file_row(theme, entry, number == self.cursor, columns)));
        rows
    }

    /// The entry that is drawn in row `row` of these `room` rows.
    pub fn entry_at(&self, row: usize, room: usize) -> Option<usize> {
        let Listing::Read { entries, .. } = &self.listing else { return None };
        let above = usize::from(self.remark().is_some());
        let room = room.saturating_sub(above);
        let row = row.checked_sub(above)?;
        let number = lines::first_visible(self.cursor, entries.len(), room) + row;
        (row < room && number < entries.len()).then_some(number)
    }

    /// Puts the cursor on an entry. Says whether it was there already.
    pub fn choose(&mut self, number: usize) -> bool {
        std::mem::replace(&mut self.cursor, number) == number
    }

    fn parent(&mut self) -> Option<Picked> {
        let parent = self.directory.parent()?.to_path_buf();
        Some(Picked::Folder(self.list(parent)))
    }

    fn entries(&self) -> &[FileEntry] {
        match &self.listing {
            Listing::Read { entries, .. } => entries,
            Listing::Unread | Listing::Reading | Listing::Failed(_) => &[],
        }
    }

    /// What has to be said above the entries.
    fn remark(&self) -> Option<&'static str> {
        let Listing::Read { entries, is_cut } = &self.listing else { return None };
        let has_file = entries.iter().any(|entry| entry.kind == FileKind::File);
        match self.offers {
            _ if *is_cut => Some("There is more in this folder than was read."),
            _ if has_file => None,
            Offers::Images => Some("No image here, by name or by first bytes."),
            Offers::Dumps => Some("No saved object dictionary here (JSON)."),
            Offers::Anything => Some("No file here."),
        }
    }
}

/// Where a typed path lies: absolute, from the user's home folder (`~`, to be found by the caller), or else from
/// this folder.
pub fn placed(directory: &Path, typed: &str) -> PathBuf {
    let typed = typed.trim();
    match typed.starts_with('~') {
        true => PathBuf::from(typed),
        false => directory.join(typed),
    }
}

/// A path with the home folder in place of a leading `~`. Another user's (`~name`) stays as it is.
pub fn expanded(path: PathBuf, home: Option<&Path>) -> PathBuf {
    match (path.strip_prefix("~"), home) {
        (Ok(rest), Some(home)) if rest.as_os_str().is_empty() => home.to_path_buf(),
        (Ok(rest), Some(home)) => home.join(rest),
        _ => path,
    }
}

/// Whether a name is that of an image, by its ending.
pub fn is_image_name(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    matches!(ending.as_deref(), Some("s" | "s19" | "srec" | "hex"))
}

/// Whether a file begins like one, whatever its name: with the type and length of an S-record or of Intel HEX.
pub fn begins_like_an_image(begins: &[u8]) -> bool {
    let text = begins.strip_prefix(b"\xef\xbb\xbf").unwrap_or(begins).trim_ascii_start();
    let is_hex = |digits: &[u8]| !digits.is_empty() && digits.iter().all(u8::is_ascii_hexdigit);
    match text {
        [b'S' | b's', kind, length @ ..] => kind.is_ascii_digit() && length.get(..2).is_some_and(is_hex),
        [b':', rest @ ..] => rest.get(..8).is_some_and(is_hex),
        _ => false,
    }
}

/// Whether a file begins like a saved object dictionary.
fn begins_like_a_dump(begins: &[u8]) -> bool {
    begins.windows(DUMP.len()).any(|bytes| bytes == DUMP)
}

/// Folders first, then the files that are offered, by name or newest first; everything else is left out.
fn offered(offers: Offers, entries: Vec<FileEntry>, has_parent: bool) -> Vec<FileEntry> {
    let mut offered: Vec<FileEntry> = entries
        .into_iter()
        .filter(|entry| match entry.kind {
            FileKind::Folder => !entry.name.starts_with('.'),
            FileKind::File => match offers {
                Offers::Images => is_image_name(&entry.name) || begins_like_an_image(&entry.begins),
                Offers::Dumps => begins_like_a_dump(&entry.begins),
                Offers::Anything => true,
            },
        })
        .collect();
    offered.sort_by_key(|entry| {
        let age = Reverse(entry.modified.clone().filter(|_| offers == Offers::Dumps && entry.kind == FileKind::File));
        (entry.kind == FileKind::File, age, entry.name.to_lowercase())
    });
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
        FileKind::File => (visible::text(&entry.name), format::counted(entry.bytes, "byte")),
    };
    let modified = entry.modified.as_deref().map(visible::text).unwrap_or_default();
    let room = columns.saturating_sub(42);
    let text = format!(" {mark} {} {size:>18}  {} ", format::left(&name, room), format::left(&modified, 16));
    Line::styled(text, if is_chosen { theme.bar() } else { Style::new() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::theme::Palette;

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
        let names: Vec<_> = offered(Offers::Images, entries, true).into_iter().map(|entry| entry.name).collect();
        assert_eq!(names, ["..", "zoo", "A.s19", "b.S"]);
        assert!(["x.elf.S", "x.SREC", "x.hex"].into_iter().all(is_image_name));
    }

    #[test]
    fn a_folder_of_which_not_all_was_read_says_so() {
        let rows = |count: usize| {
            let mut picker = Picker::new(Offers::Anything, "/".into());
            picker.listed("/".into(), Ok((0..count).map(|n| entry(&n.to_string(), FileKind::File)).collect()));
            let rows = picker.rows(Theme::new(Palette::Mono), 80, 5, "Type a path.");
            assert_eq!(picker.entry_at(rows.len() - 1, 5).is_some(), count > 0, "the last row can be clicked");
            rows[0].to_string()
        };
        assert_eq!(rows(0), "  No file here. Type a path.");
        assert!(rows(9).contains("0"), "{}", rows(9));
        assert_eq!(rows(MOST_LISTED), "  There is more in this folder than was read. Type a path.");
    }

    #[test]
    fn saved_dictionaries_are_offered_newest_first_and_known_by_how_they_begin() {
        let dump = |name: &str, day: &str, begins: &str| FileEntry {
            modified: Some(format!("2026-01-{day} 12:00")),
            begins: begins.as_bytes().to_vec(),
            ..entry(name, FileKind::File)
        };
        let entries = vec![
            dump("a.json", "29", r#"{"schema":"axcon.dictionary/1","#),
            dump("b.json", "31", "{\n  \"schema\": \"axcon.dictionary/1\""),
            dump("c.json", "30", r#"{"schema":"axcon.image/1","#),
        ];
        let names: Vec<_> = offered(Offers::Dumps, entries, false).into_iter().map(|entry| entry.name).collect();
        assert_eq!(names, ["b.json", "a.json"]);
    }

    #[test]
    fn a_typed_path_is_absolute_from_home_or_from_the_folder() {
        let home = Some(Path::new("/home/me"));
        let path = |typed: &str| expanded(placed(Path::new("/images"), typed), home);
        assert_eq!(
            [path("a.S"), path("/a.S"), path(" ~/a.S "), path("~"), path("~you/a.S"), path("a~")],
            ["/images/a.S", "/a.S", "/home/me/a.S", "/home/me", "~you/a.S", "/images/a~"].map(PathBuf::from)
        );
        assert_eq!(expanded("~/a".into(), None), PathBuf::from("~/a"), "where nobody knows the home folder");
    }

    #[test]
    fn a_file_without_the_ending_is_offered_if_it_begins_like_an_image() {
        for begins in ["S00600004844521B", "\u{feff}S11300", ":020000040000", "\r\ns113"] {
            let file = FileEntry { begins: begins.as_bytes().to_vec(), ..entry("firmware.bin", FileKind::File) };
            assert_eq!(offered(Offers::Images, vec![file], false).len(), 1, "{begins}");
        }
        for begins in ["", "S", "Sxx", "SHORT", ":", ": a smile", "\x7fELF"] {
            let file = FileEntry { begins: begins.as_bytes().to_vec(), ..entry("firmware.bin", FileKind::File) };
            assert_eq!(offered(Offers::Images, vec![file], false).len(), 0, "{begins}");
        }
    }
}
