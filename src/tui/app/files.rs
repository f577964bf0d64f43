//! Files that rows and the dictionary go to, and dumps that are read.

use std::path::{Path, PathBuf};

use super::App;
use crate::dump::{self, Dump};
use crate::session::{Command, Job};
use crate::time::{Duration, Instant};
use crate::tui::image_facts::ImageFacts;
use crate::tui::input::{Effect, FIRST_BYTES, Failure, FileEntry};
use crate::tui::picker::{begins_like_an_image, is_image_name};
use crate::tui::popup::{NamedFor, Popup, Question, Sent};
use crate::tui::screens::dictionary::other_product;
use crate::tui::view::{Export, Sending, Tone, marked};
use crate::tui::visible;
use crate::tui::widgets::format;
use crate::wire::stream::Row;

impl App {
    /// A folder has been read, for the screen or box that still waits for it.
    pub(super) fn files_listed(&mut self, directory: PathBuf, entries: Result<Vec<FileEntry>, String>) {
        self.dirty = true;
        match &mut self.popup {
            Some(Popup::Asking(Question::PickFile { picker, .. })) if picker.awaits(&directory) => {
                picker.listed(directory, entries);
                self.folder = picker.directory().to_path_buf();
            }
            _ if self.load.is_checking(&directory) => {
                self.close_path_box();
                self.load.listed(directory, entries);
            }
            _ if self.load.awaits(&directory) => self.load.listed(directory, entries),
            _ => {}
        }
    }

    /// A file has been checked: who has typed its path looks at the report now.
    pub(super) fn image_checked(&mut self, facts: Box<ImageFacts>) {
        self.dirty = true;
        if self.load.is_checking(&facts.path) {
            self.close_path_box();
        }
        self.load.checked(facts);
    }

    /// There is nothing to check. If the path was typed, that is said where it was typed.
    pub(super) fn image_unreadable(&mut self, path: &Path, why: &str) {
        self.dirty = true;
        if !self.load.unreadable(path) {
            return;
        }
        let text = format!("{}: {}", visible::sentence(why), visible::text(&path.to_string_lossy()));
        match &mut self.popup {
            Some(Popup::Asking(question @ Question::FileName { purpose: NamedFor::Image, .. })) => {
                question.refused(text)
            }
            Some(_) => self.view.tell(Tone::Bad, text),
            None => {
                let failure = Failure { text, hints: Vec::new() };
                self.popup = Some(Popup::Failed { title: "Not read", failure });
            }
        }
    }

    /// The box in which an image's path was typed has done its work.
    fn close_path_box(&mut self) {
        if matches!(self.popup, Some(Popup::Asking(Question::FileName { purpose: NamedFor::Image, .. }))) {
            self.popup = None;
        }
    }

    /// The box in which a file's name was typed says why it is not written; without it the last line does.
    fn not_written(&mut self, why: String) {
        match &mut self.popup {
            Some(Popup::Asking(question @ Question::FileName { .. })) => question.refused(why),
            _ => self.view.tell(Tone::Bad, why),
        }
    }

    /// A file is being written: the box in which its name was typed waits for that.
    fn is_written(&mut self, path: &Path) {
        self.made.remove(path);
        if let Some(Popup::Asking(Question::FileName { form, .. })) = &mut self.popup {
            form.sent = Some(Sent::File(path.to_path_buf()));
        }
    }

    /// What was typed on the bench has been done, or is refused and can be corrected.
    pub(super) fn order_answered(&mut self, line: &str, answer: &Result<Option<String>, String>) {
        let Some(Popup::Asking(question)) = &mut self.popup else { return };
        let sent = question.form().and_then(|form| form.sent.as_ref());
        if !matches!(sent, Some(Sent::Order(order)) if order == line) {
            return;
        }
        match answer {
            Ok(_) => self.popup = None,
            Err(why) => question.refused(format!("{}.", visible::sentence(why).trim_end_matches('.'))),
        }
    }

    /// Whether a file can be sent now; if not, the user is told why.
    pub(super) fn may_send_file(&mut self) -> bool {
        if !self.can_send() {
            return false;
        }
        let job = self.view.job.filter(|job| *job != Job::Identify);
        let refusal = self.session.as_ref().and_then(|session| session.may_send_file().err());
        let why = match (job, refusal) {
            (Some(job), _) => format!("axcon is still {}. A file goes alone", job.doing()),
            (None, Some(refusal)) => refusal.to_string(),
            (None, None) => return true,
        };
        self.view.tell(Tone::Refused, format!("Not sent: {why}."));
        false
    }

    /// A file that the unit shall get has been read: that is asked once more, since nothing of it can be taken back.
    pub(super) fn bytes_read(&mut self, path: &Path, bytes: Result<Vec<u8>, String>) {
        self.dirty = true;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        match bytes {
            Err(why) => self.view.tell(Tone::Refused, format!("Not sent: {}: {why}.", path.display())),
            Ok(bytes) if bytes.is_empty() => self.view.tell(Tone::Refused, format!("Not sent: {name} is empty.")),
            // Meanwhile something else may have begun.
            Ok(_) if self.popup.is_some() || !self.may_send_file() => {}
            Ok(bytes) => {
                let is_image = is_image_name(&name) || begins_like_an_image(&bytes[..bytes.len().min(FIRST_BYTES)]);
                self.ask(Question::SendFile { name, bytes, is_image });
            }
        }
    }

    /// Begins to send a file as it is.
    pub(super) fn send_file(&mut self, name: String, bytes: Vec<u8>, effects: &mut Vec<Effect>) {
        let name = visible::text(&name);
        let total = bytes.len();
        if self.can_send() && self.command(Command::SendFile(bytes)) {
            self.view.unit.sending = Some(Sending { name: name.clone(), sent: 0, total });
            let text = format!("the file {name} is sent, {}", format::counted(total, "byte"));
            self.scrollback.note(self.now, text.clone());
            effects.push(Effect::Mark(text));
            self.terminal.follow();
        }
    }

    /// Marks a moment: now, or the one that is looked at.
    pub(super) fn mark(&mut self, at: Option<Instant>, effects: &mut Vec<Effect>) {
        let at = at.unwrap_or(self.now).min(self.now);
        let mark = self.view.unit.monitor.stream.mark(at);
        let text = marked(mark.number, self.now.since(at));
        let places = match (self.view.link.recording.is_some(), self.view.export.is_some()) {
            (true, true) => "chart, recording and file",
            (true, false) => "chart and recording",
            (false, true) => "chart and file",
            (false, false) => "the chart",
        };
        let time = format::time_of_day(self.start_of_day, at);
        self.view.tell(Tone::Quiet, format!("Mark {} is set at {time}, in {places}.", mark.number));
        self.scrollback.note(self.now, text.clone());
        effects.push(Effect::Mark(text));
        self.export_note(at, &marked(mark.number, Duration::ZERO), effects);
    }

    /// A word among the rows that go to a file.
    pub(super) fn export_note(&mut self, at: Instant, text: &str, effects: &mut Vec<Effect>) {
        let time = format::utc(self.view.link.start_millis, at);
        if let Some(export) = &self.view.export {
            let bytes = Row::csv_note(&time, text, export.channels.len()).into_bytes();
            effects.push(Effect::AppendFile { path: export.path.clone(), bytes });
        }
    }

    pub(super) fn export_stream(&mut self, path: PathBuf, effects: &mut Vec<Effect>) {
        let (stream, start) = (&self.view.unit.monitor.stream, self.view.link.start_millis);
        let channels: Vec<String> = stream.channels.iter().map(|channel| channel.name.clone()).collect();
        if channels.is_empty() {
            return self.not_written("There are no rows yet: T switches the stream on.".to_owned());
        }
        let mut text = Row::csv_heading(&channels);
        let mut rows = 0;
        let mut marks = stream.marks.iter().peekable();
        let mut marks_before = |at: Instant, text: &mut String| {
            while let Some(mark) = marks.next_if(|mark| mark.at < at) {
                let word = marked(mark.number, Duration::ZERO);
                text.push_str(&Row::csv_note(&format::utc(start, mark.at), &word, channels.len()));
            }
        };
        for (at, row) in stream.kept_rows() {
            // A mark is between rows. What was marked before the rows that are kept is among none.
            match rows {
                0 => marks_before(at, &mut String::new()),
                _ => marks_before(at, &mut text),
            }
            text.push_str(&row.csv(&format::utc(start, at)));
            rows += 1;
        }
        marks_before(Instant::NEVER, &mut text);
        self.is_written(&path);
        effects.push(Effect::CreateFile { path: path.clone(), bytes: text.into_bytes() });
        self.view.export = Some(Export { path, rows, channels });
    }

    /// A row for the file that rows are written to.
    pub(super) fn export_row(&mut self, at: Instant, row: &Row, effects: &mut Vec<Effect>) {
        let start = self.view.link.start_millis;
        let Some(export) = &mut self.view.export else { return };
        if export.channels.len() != row.readings.len() {
            return self.end_export(Some("the stream has other channels now"));
        }
        export.rows += 1;
        let bytes = row.csv(&format::utc(start, at)).into_bytes();
        match effects.last_mut() {
            // Rows that came together are written together.
            Some(Effect::AppendFile { path, bytes: before }) if *path == export.path => before.extend(bytes),
            _ => effects.push(Effect::AppendFile { path: export.path.clone(), bytes }),
        }
    }

    pub(super) fn end_export(&mut self, why: Option<&str>) {
        let Some(export) = self.view.export.take() else { return };
        let path = export.path.display();
        let text = match why {
            None => {
                let are = if export.rows == 1 { "is" } else { "are" };
                format!("{} {are} in {path}.", format::counted(export.rows, "row"))
            }
            Some(why) => format!("{path} ends after {}: {why}.", format::counted(export.rows, "row")),
        };
        self.view.tell(if why.is_none() { Tone::Good } else { Tone::Bad }, text);
    }

    pub(super) fn export_dictionary(&mut self, path: PathBuf, effects: &mut Vec<Effect>) {
        if self.view.export.as_ref().is_some_and(|export| export.path == path) {
            return self.not_written("Not written: the rows of the stream go to that file.".to_owned());
        }
        let Some(read) = &self.view.unit.dictionary else {
            return self.not_written("Nothing has been read yet: V reads the object dictionary.".to_owned());
        };
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
        let text = match (ending.as_str(), self.view.product()) {
            ("json", _) => read.dump.json(),
            ("csv", _) => read.dump.csv(),
            ("txt", _) => read.dump.table(),
            ("dcf", Some(product)) => {
                let since_start = i64::try_from(read.at.since_start().as_millis()).unwrap_or_default();
                let unix_millis = self.view.link.start_millis.saturating_add(since_start);
                dump::configuration(&read.reading, product, &self.view.facts, unix_millis)
            }
            ("dcf", None) => {
                return self.not_written("A DCF needs to know the product; .json keeps everything.".to_owned());
            }
            _ => return self.not_written("Not written: the name has to end in .json, .csv, .dcf or .txt.".to_owned()),
        };
        self.is_written(&path);
        effects.push(Effect::CreateFile { path, bytes: text.into_bytes() });
    }

    pub(super) fn file_written(&mut self, path: &Path, result: Result<(), String>) {
        self.dirty = true;
        // A user who looks for it needs to know the folder.
        let shown = self.options.directory.join(path);
        let shown = shown.display();
        let is_export = self.view.export.as_ref().is_some_and(|export| export.path == path);
        let sent = match &mut self.popup {
            Some(Popup::Asking(question)) => question.form().and_then(|form| form.sent.as_ref()),
            _ => None,
        };
        let is_awaited = matches!(sent, Some(Sent::File(of)) if of == path);
        if result.is_ok() {
            self.made.insert(path.to_path_buf());
            if is_awaited {
                self.popup = None;
            }
        }
        match result {
            Ok(()) if is_export => {}
            Ok(()) => self.view.tell(Tone::Good, format!("{shown} is written.")),
            Err(why) => {
                if is_export {
                    self.view.export = None;
                }
                let what = if self.made.contains(path) { "ends early" } else { "is not written" };
                let text = format!("{shown} {what}: {why}.");
                match is_awaited {
                    true => self.not_written(text),
                    false => self.view.tell(Tone::Bad, text),
                }
            }
        }
    }

    pub(super) fn file_read(&mut self, path: &Path, text: Result<String, String>) {
        self.dirty = true;
        let name = path.display().to_string();
        let dump = text
            .map_err(|why| format!("{name}: {why}"))
            .and_then(|text| Dump::parse(&name, &text).map_err(|_| format!("{name} is not a JSON dump")));
        match dump {
            Err(why) => self.view.tell(Tone::Refused, format!("Not compared: {why}.")),
            Ok(_) if self.view.unit.dictionary.is_none() => {
                self.view.tell(Tone::Bad, "Nothing to compare it with yet: V reads the unit's object dictionary.");
            }
            Ok(_) if self.view.current_dictionary().is_none() => {
                self.view.tell(Tone::Bad, "What was read is from before the restart: V reads the dictionary again.");
            }
            Ok(dump) => {
                let short = path.file_name().map_or(name.clone(), |name| name.to_string_lossy().into_owned());
                let other = other_product(&dump, &self.view);
                self.dictionary.compare(short, dump);
                match other {
                    Some((theirs, ours)) => self.view.tell(
                        Tone::Bad,
                        format!(
                            "{name} is of another product, an {theirs}; this unit is an {ours}. Compared all the same."
                        ),
                    ),
                    None => {
                        let text = format!("Compared with {name}: ≠ marks what differs, O chooses what is shown.");
                        self.view.tell(Tone::Quiet, text);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::app::Options;
    use crate::tui::input::Input;
    use crate::tui::theme::Palette;

    #[test]
    fn a_file_that_is_there_ends_early_and_one_that_is_not_is_not_written() {
        let palette = Palette::Mono;
        let options = Options { link: None, directory: "/rows".into(), home: None, palette, size: (80, 24) };
        let mut app = App::new(options);
        let told = |app: &mut App, result: Result<(), &str>| {
            let path = PathBuf::from("tc.csv");
            if result.is_ok() {
                app.view.export = Some(Export { path: path.clone(), rows: 3, channels: vec!["TC1".into()] });
            }
            app.handle(Instant::ZERO, Input::FileWritten { path, result: result.map_err(str::to_owned) });
            app.view.notice.as_ref().map(|notice| notice.text.clone()).unwrap_or_default()
        };
        let shown = Path::new("/rows").join("tc.csv");
        let shown = shown.display();
        assert_eq!(told(&mut app, Err("it is full")), format!("{shown} is not written: it is full."));
        told(&mut app, Ok(()));
        assert!(app.view.export.is_some());
        assert_eq!(told(&mut app, Err("it is full")), format!("{shown} ends early: it is full."));
        assert!(app.view.export.is_none(), "no more rows go there");
        // Another file of that name.
        app.is_written(Path::new("tc.csv"));
        assert_eq!(told(&mut app, Err("it exists")), format!("{shown} is not written: it exists."));
    }
}
