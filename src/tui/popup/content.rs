//! What each popup says, and which keys answer it.

use std::path::Path;

use ratatui::crossterm::event::KeyCode;
use ratatui::text::{Line, Span};

use super::warnings::{consequence, in_the_middle, loses_rows, too_fast};
use super::{Form, NamedFor, ORDERS, PickedFor, Popup, Question};
use crate::image::DefectId;
use crate::time::{BITS_PER_CHARACTER, Duration};
use crate::tui::input::{Failure, Noted};
use crate::tui::keymap::Press;
use crate::tui::picker::Picker;
use crate::tui::theme::Theme;
use crate::tui::view::{LinkState, View};
use crate::tui::visible;
use crate::tui::widgets::format;
use crate::wire::stream::Source;

/// Columns of the orders that are examples.
const EXAMPLE_COLUMNS: usize = 33;
/// The row of its content in which a list of files begins.
pub(super) const LIST_ROW: usize = 3;
/// What is said of a text that goes to the unit as it is.
const MENU_KEYS: &str = "Every M, V, D, T, S and L in it is a key of the unit's menu.";

/// A key and what it does here.
type Hint = (Press, &'static str);

const ENTER: Press = Press::Plain(KeyCode::Enter);
const ESC: Press = Press::Plain(KeyCode::Esc);
const DOWN: Press = Press::Plain(KeyCode::Down);
const BACKSPACE: Press = Press::Plain(KeyCode::Backspace);
const CLEAR: Press = Press::Ctrl('u');

pub(super) const fn letter(letter: char) -> Press {
    Press::Plain(KeyCode::Char(letter))
}

/// What a popup says.
pub(super) struct Content {
    pub(super) title: &'static str,
    pub(super) rows: Vec<Line<'static>>,
    /// The keys that answer.
    pub(super) hints: Vec<Hint>,
}

impl Content {
    fn new(title: &'static str, rows: Vec<Line<'static>>, hints: impl Into<Vec<Hint>>) -> Self {
        Content { title, rows, hints: hints.into() }
    }
}

/// What a popup says in this many columns; a list of files in it has `room` rows.
pub(super) fn content(popup: &Popup, view: &View, theme: Theme, (columns, room): (usize, usize)) -> Content {
    let sheet = Sheet { theme, columns };
    match popup {
        Popup::Asking(question) => question.content(view, sheet, room),
        Popup::Waiting { what, hint } => Content::new("One moment", sheet.paragraphs(&[what]), [*hint]),
        Popup::Failed { title, failure } => Content::new(title, failed(failure, sheet), [(ENTER, "close")]),
    }
}

impl Question {
    fn content(&self, view: &View, sheet: Sheet, room: usize) -> Content {
        match self {
            Question::Link(form) => link(form, sheet),
            Question::FileName { purpose, form, directory } => file_name(*purpose, form, directory, sheet),
            Question::PickFile { purpose, picker, form } => pick_file(*purpose, picker, form, sheet, room),
            Question::SendFile { name, bytes, is_image } => send_file(name, bytes.len(), *is_image, view, sheet),
            Question::Find(form) => {
                let row = sheet.typed("", form.typed.text());
                Content::new("Find", vec![row], [(ENTER, "keep"), (ESC, "end the search")])
            }
            Question::Temperature { input, form } => {
                let rows = sheet.form(&[format!("Input {input}, in °C")], form);
                Content::new("Temperature of the sensor", rows, [(ENTER, "set"), (ESC, "back")])
            }
            Question::Order(form) => order(form, sheet),
            Question::Stream { source, millis, .. } => stream(*source, millis, view, sheet),
            Question::View => view_dictionary(sheet),
            Question::Defaults(form) => defaults(form, sheet),
            Question::Allow { errors, cursor, complaint } => allow(errors, *cursor, *complaint, sheet),
            Question::SameUnit { noted, in_loader } => same_unit(noted, *in_loader, sheet),
            Question::Label { form, image, .. } => label(form, image.as_deref(), sheet),
            Question::Password { field, complaint, .. } => password(&field.dots(), *complaint, view, sheet),
            Question::CancelLoad => {
                let rows = sheet.paragraphs(&[consequence(view.load.progress.map(|progress| progress.phase))]);
                let hints = [(letter('y'), "cancel the upload"), (letter('n'), "go on loading")];
                Content::new("Cancel the upload?", rows, hints)
            }
            Question::Paste { bytes, left_out } => paste(bytes, *left_out, sheet),
            Question::Disconnect { then } => disconnect(then.as_deref(), view, sheet),
            Question::Quit => {
                let hints = [(letter('y'), "leave"), (letter('n'), "stay")];
                Content::new("Leave axcon?", sheet.paragraphs(&in_the_middle(view)), hints)
            }
        }
    }
}

fn failed(failure: &Failure, sheet: Sheet) -> Vec<Line<'static>> {
    let mut rows = sheet.paragraphs(&[visible::sentence(&failure.text)]);
    for hint in &failure.hints {
        rows.push(Line::default());
        let broken = format::wrap(&visible::text(hint), sheet.columns.saturating_sub(2));
        let marks = std::iter::once("·").chain(std::iter::repeat(" "));
        rows.extend(marks.zip(broken).map(|(mark, line)| Line::raw(format!("{mark} {line}"))));
    }
    rows
}

fn link(form: &Form, sheet: Sheet) -> Content {
    let text = "A serial port (/dev/ttyUSB0, COM3) or its adapter's serial number, an address in the network \
                (tcp://host:port), or an emulated unit (emu:axtc4co).";
    Content::new("Connect to", sheet.form(&[text], form), [(ENTER, "connect"), (ESC, "back")])
}

fn file_name(purpose: NamedFor, form: &Form, directory: &Path, sheet: Sheet) -> Content {
    let (title, text, key) = match purpose {
        NamedFor::Image => ("Image file", "A path, absolute or from this folder:", "check it"),
        NamedFor::ExportStream => (
            "Write rows to a CSV file",
            "A new file; the rows that are kept go first, then all that come until E ends it.",
            "begin",
        ),
        NamedFor::ExportDictionary => (
            "Write the object dictionary to a file",
            "A new file. Its ending says how: .json (to compare with later), .csv, .dcf, .txt.",
            "write",
        ),
    };
    let mut rows = sheet.paragraphs(&[text]);
    if purpose == NamedFor::Image {
        rows.push(sheet.folder(directory));
    }
    rows.extend(sheet.field(form.typed.text(), form.complaint.as_deref()));
    Content::new(title, rows, [(ENTER, key), (CLEAR, "clear"), (ESC, "back")])
}

/// A file that is there, picked in `room` rows.
fn pick_file(purpose: PickedFor, picker: &Picker, form: &Form, sheet: Sheet, room: usize) -> Content {
    let (title, explained, key) = match purpose {
        PickedFor::Dump => {
            ("Compare with a saved dictionary", "As E here or 'axcon dictionary dump' writes it, as JSON.", "compare")
        }
        PickedFor::ToSend => {
            ("Send a file as it is", "Byte for byte, as if typed. Software goes by screen 4.", "choose")
        }
    };
    let above: [Line; LIST_ROW] = [Line::raw(explained), sheet.folder(picker.directory()), Line::default()];
    let mut rows = Vec::from(above);
    let mut shown = picker.rows(sheet.theme, sheet.columns, room, "Type a path.");
    // The popup keeps its height from folder to folder.
    shown.resize(room, Line::default());
    rows.extend(shown);
    let text = form.typed.text();
    rows.extend([Line::default(), sheet.typed("or a path ", text)]);
    let clear = if text.is_empty() { (BACKSPACE, "folder above") } else { (CLEAR, "clear") };
    Content::new(title, rows, [(ENTER, key), clear, (ESC, "back")])
}

fn send_file(name: &str, length: usize, is_image: bool, view: &View, sheet: Sheet) -> Content {
    let size = format::counted(length, "byte");
    let meaning = if is_image {
        "It is a software image. The load screen (4) checks it first, waits where the unit needs time, notices every \
         error and proves the result; here nobody does. A unit in its loader may be left without software, one in \
         its menu takes every S and D for a key."
    } else {
        MENU_KEYS
    };
    let time = length as f64 * f64::from(BITS_PER_CHARACTER) / f64::from(view.link.baud.max(1));
    let time = format::minutes(Duration::from_secs_f64(time.ceil()));
    let rows = sheet.paragraphs(&[
        format!("{}, {size}, goes to the unit as if typed.", visible::text(name)),
        meaning.to_owned(),
        format!("It takes {time} or more. Esc stops it."),
    ]);
    let hints = if is_image {
        vec![(letter('l'), "load screen"), (letter('y'), "send all the same"), (ESC, "do not send")]
    } else {
        vec![(letter('y'), "send"), (ESC, "do not send")]
    };
    Content::new("Send this file as it is?", rows, hints)
}

fn order(form: &Form, sheet: Sheet) -> Content {
    let room = sheet.columns.saturating_sub(EXAMPLE_COLUMNS);
    let example = |(orders, does): &(&[&str], &str)| {
        Line::from(vec![
            Span::raw(format::left(&orders.join(", "), EXAMPLE_COLUMNS)),
            Span::styled(format::keep_start(does, room), sheet.theme.quiet()),
        ])
    };
    // What is wrong has to be read to its end: on a small screen it takes the place of examples.
    let wrong = form.complaint.as_deref().map_or(0, |text| format::wrap(text, sheet.columns).len());
    let examples = ORDERS.iter().take(ORDERS.len() - wrong.saturating_sub(1).min(ORDERS.len()));
    let mut rows: Vec<Line> = examples.map(example).collect();
    rows.extend(sheet.field(form.typed.text(), form.complaint.as_deref()));
    Content::new("Order to the emulated unit", rows, [(ENTER, "do it"), (ESC, "back")])
}

fn stream(source: Source, millis: &Form, view: &View, sheet: Sheet) -> Content {
    let theme = sheet.theme;
    let choice = |mine: Source, text: &str| chosen(mine == source, text, theme);
    let mut rows = vec![
        choice(Source::FieldValue, "F  field value, object 6100h, in °C"),
        choice(Source::ProcessValue, "P  process value, object 7130h, in counts"),
        Line::default(),
        sheet.typed("Every, in ms: ", millis.typed.text()),
        Line::default(),
    ];
    let stored = "The unit stores this: the stream comes back after every power cycle until T switches it off.";
    rows.extend(sheet.paragraphs(&[stored]));
    for text in [too_fast(view, source, millis.typed.text()), loses_rows(view, source)].into_iter().flatten() {
        rows.push(Line::default());
        rows.extend(format::wrap(&text, sheet.columns).into_iter().map(|row| Line::styled(row, theme.warning())));
    }
    rows.extend(sheet.complaint(millis.complaint.as_deref()));
    let hints = [(letter('f'), "field"), (letter('p'), "process"), (ENTER, "switch on"), (ESC, "back")];
    Content::new("Switch the data stream on", rows, hints)
}

fn view_dictionary(sheet: Sheet) -> Content {
    let rows = sheet.paragraphs(&[
        "While the object dictionary is viewed, the unit halts temperature scanning and CAN. It has to be \
         pre-operational.",
        "axcon reads all of it, which takes some seconds, and leaves the view again; or look at it yourself on the \
         terminal: Enter shows the next object, X leaves.",
    ]);
    let hints = [(ENTER, "read all of it"), (letter('t'), "on the terminal"), (ESC, "back")];
    Content::new("View the object dictionary", rows, hints)
}

fn defaults(form: &Form, sheet: Sheet) -> Content {
    let texts = [
        "All settings of the object dictionary go back to the factory's. The unit applies them at once: it restarts. \
         Node-ID and bit rate stay as LSS has set them.",
        "Type Yes to do it.",
    ];
    Content::new("Restore the default object dictionary", sheet.form(&texts, form), [(ENTER, "restore"), (ESC, "back")])
}

fn allow(errors: &[DefectId], cursor: usize, complaint: Option<&str>, sheet: Sheet) -> Content {
    let row = |(number, error): (usize, &DefectId)| chosen(number == cursor, error.name(), sheet.theme);
    let mut rows: Vec<Line> = errors.iter().enumerate().map(row).collect();
    rows.push(Line::default());
    rows.extend(sheet.paragraphs(&[errors.get(cursor).map_or("", |error| in_spite_of(*error))]));
    rows.extend(sheet.complaint(complaint));
    let choose = (errors.len() != 1).then_some((DOWN, "choose"));
    let hints = choose.into_iter().chain([(letter(' '), "allow it and check again"), (ESC, "back")]);
    Content::new("Send in spite of this?", rows, hints.collect::<Vec<_>>())
}

/// A row of which one is chosen.
fn chosen(is_chosen: bool, text: &str, theme: Theme) -> Line<'static> {
    if is_chosen { Line::styled(format!("› {text}"), theme.strong()) } else { Line::raw(format!("  {text}")) }
}

/// What it means to send a file in spite of this.
fn in_spite_of(error: DefectId) -> &'static str {
    match error {
        DefectId::Downgrade => {
            "The file is sound, but older than the software the unit runs or ran. The unit runs the older one then; what \
             newer software has set may mean something else to it."
        }
        DefectId::NoIdentity => {
            "The file does not say what it is: nobody can see beforehand whether it is for this unit, nor afterwards whether \
             the unit runs it. If it does not run, the unit waits in its loader, without scanning and CAN."
        }
        _ => {
            "What is sent is not what was built, or not for this unit. It may not run, and the unit then waits in its \
             loader, without scanning and CAN, for a file that is sound."
        }
    }
}

fn same_unit(noted: &Noted, in_loader: bool, sheet: Sheet) -> Content {
    let Noted { product, image, begun, .. } = noted;
    let image = Path::new(image).file_name().map_or(image.clone(), |name| name.to_string_lossy().into_owned());
    let note = format!(
        "By our note {} was begun on this link for an {}, {}.",
        visible::text(&image),
        visible::text(product),
        visible::text(begun)
    );
    let unit = "The unit that is there now cannot say what it is, and another on the same cable looks the same. A file \
                for another product would make it useless until the right one is sent. Its label says the product.";
    let rows = sheet.paragraphs(&[note.as_str(), unit]);
    let yes = if in_loader { "it is: start" } else { "it is: go on" };
    let hints = [(letter('y'), yes), (letter('n'), "another unit"), (ESC, "back")];
    Content::new("Is it the unit this was begun for?", rows, hints)
}

fn label(form: &Form, image: Option<&str>, sheet: Sheet) -> Content {
    let image = image.map_or("not said".to_owned(), visible::text);
    let text = "The unit cannot say what it is: a loader knows only how to take a file. A file for another product would \
                make the unit useless until the right one is sent.";
    let named = format!("The file is for: {image}. Type the part number on the unit's label.");
    let rows = sheet.form(&[text, named.as_str()], form);
    Content::new("Which product is the unit?", rows, [(ENTER, "go on"), (ESC, "back")])
}

fn password(dots: &str, complaint: Option<&str>, view: &View, sheet: Sheet) -> Content {
    let origin = match view.emulated() {
        Some(_) => "Emulated units take AXIO-2010.",
        None => "Your Axiomatic contact has it. Capital and small letters count.",
    };
    let mut rows = sheet.paragraphs(&[origin, "It is neither shown nor recorded."]);
    rows.extend(sheet.field(dots, complaint));
    Content::new("Password for loading software", rows, [(ENTER, "start the upload"), (ESC, "back")])
}

fn paste(bytes: &[u8], left_out: usize, sheet: Sheet) -> Content {
    // What follows the last line end, if anything, is a line as well.
    let rows = bytes.split_inclusive(|&byte| byte == b'\r').count();
    let lines = if rows == 1 { "one line".to_owned() } else { format!("{} lines", format::grouped(rows)) };
    let go = if bytes.len() == 1 { "goes" } else { "go" };
    let mut texts = vec![
        format!("{}, {lines}, {go} to the unit as if typed.", format::counted(bytes.len(), "character")),
        MENU_KEYS.to_owned(),
    ];
    if left_out > 0 {
        let left_out = format::counted(left_out, "character");
        texts.push(format!("Left out: {left_out} that a unit does not know; it takes ASCII only."));
    }
    let hints = [(letter('y'), "send"), (ESC, "do not send")];
    Content::new("Send the pasted text?", sheet.paragraphs(&texts), hints)
}

fn disconnect(then: Option<&str>, view: &View, sheet: Sheet) -> Content {
    let name = view.link.name.as_deref().map_or("The link".into(), visible::text);
    let mut texts: Vec<String> = match &view.link.state {
        // It was, when this was asked.
        LinkState::Lost(_) => vec![format!("{name} is lost.")],
        _ if view.would_be_left() => in_the_middle(view).map(str::to_owned).to_vec(),
        _ => vec![format!("{name} is connected.")],
    };
    let is_emulated = view.emulated().is_some();
    if is_emulated {
        texts.push("The emulated unit is gone with its link, with all that was set and loaded.".into());
    }
    let is_same = then == view.link.name.as_deref();
    texts.extend(then.map(visible::text).map(|link| match (is_same, is_emulated) {
        (true, true) => "Then a new one begins, as the factory made it.".to_owned(),
        (true, false) => format!("Then {link} is opened again."),
        (false, _) => format!("{link} is opened first: if that fails, the link stays."),
    }));
    let hints = match &view.link.state {
        LinkState::Lost(_) if is_emulated && is_same => [(letter('y'), "new unit"), (letter('n'), "stay here")],
        _ => [(letter('y'), "close the link"), (letter('n'), "stay connected")],
    };
    Content::new("Close the link?", sheet.paragraphs(&texts), hints)
}

/// What a popup is written on.
#[derive(Clone, Copy)]
struct Sheet {
    theme: Theme,
    columns: usize,
}

impl Sheet {
    /// Texts with a blank line between them.
    fn paragraphs(self, texts: &[impl AsRef<str>]) -> Vec<Line<'static>> {
        let mut rows = Vec::new();
        for text in texts {
            if !rows.is_empty() {
                rows.push(Line::default());
            }
            rows.extend(format::wrap(text.as_ref(), self.columns).into_iter().map(Line::raw));
        }
        rows
    }

    /// Texts, and below them a line that is typed.
    fn form(self, texts: &[impl AsRef<str>], form: &Form) -> Vec<Line<'static>> {
        let mut rows = self.paragraphs(texts);
        rows.extend(self.field(form.typed.text(), form.complaint.as_deref()));
        rows
    }

    /// A field below what is asked, and below it what is wrong with what was typed.
    fn field(self, text: &str, complaint: Option<&str>) -> Vec<Line<'static>> {
        let mut rows = vec![Line::default(), self.typed("", text)];
        rows.extend(self.complaint(complaint));
        rows
    }

    /// What is typed: its end is what one looks at meanwhile.
    fn typed(self, label: &'static str, text: &str) -> Line<'static> {
        let room = self.columns.saturating_sub(format::width(label) + 3);
        let text = format::keep_end(&visible::text(text), room);
        Line::from(vec![
            Span::styled(label, self.theme.quiet()),
            Span::styled("› ", self.theme.quiet()),
            Span::styled(text, self.theme.strong()),
            Span::styled(" ", self.theme.bar()),
        ])
    }

    fn complaint(self, complaint: Option<&str>) -> Vec<Line<'static>> {
        let Some(text) = complaint else { return Vec::new() };
        let broken = format::wrap(text, self.columns).into_iter().map(|line| Line::styled(line, self.theme.bad()));
        std::iter::once(Line::default()).chain(broken).collect()
    }

    fn folder(self, directory: &Path) -> Line<'static> {
        let directory = visible::text(&directory.to_string_lossy());
        Line::styled(format::keep_end(&directory, self.columns), self.theme.quiet())
    }
}
