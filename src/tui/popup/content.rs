//! What each question says, and which keys answer it.

use std::path::Path;

use ratatui::crossterm::event::KeyCode;
use ratatui::text::{Line, Span};

use super::warnings::{consequence, in_the_middle, loses_rows, too_fast};
use super::{Form, ORDERS, Purpose, Question, Wanted};
use crate::image::DefectId;
use crate::time::{BITS_PER_CHARACTER, Duration};
use crate::tui::input::Noted;
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
pub(super) type Hint = (Press, &'static str);

pub(super) const ENTER: Press = Press::Plain(KeyCode::Enter);
const ESC: Press = Press::Plain(KeyCode::Esc);
const DOWN: Press = Press::Plain(KeyCode::Down);
const BACKSPACE: Press = Press::Plain(KeyCode::Backspace);
const CLEAR: Press = Press::Ctrl('u');

pub(super) const fn letter(letter: char) -> Press {
    Press::Plain(KeyCode::Char(letter))
}

/// Title, rows, and the keys that answer.
pub(super) type Content = (String, Vec<Line<'static>>, Vec<Hint>);

/// A file that is there, chosen in `room` rows.
fn choose(wanted: Wanted, picker: &Picker, text: &str, theme: Theme, (columns, room): (usize, usize)) -> Content {
    let (title, explained, key) = match wanted {
        Wanted::Dump => {
            ("Compare with a saved dictionary", "As E here or 'axcon dictionary dump' writes it, as JSON.", "compare")
        }
        Wanted::ToSend => ("Send a file as it is", "Byte for byte, as if typed. Software goes by screen 4.", "choose"),
    };
    let directory = visible::text(&picker.directory().to_string_lossy());
    let above: [Line; LIST_ROW] =
        [Line::raw(explained), Line::styled(format::keep_end(&directory, columns), theme.quiet()), Line::default()];
    let mut rows = Vec::from(above);
    let mut shown = picker.rows(theme, columns, room, "Type a path.");
    // The popup keeps its height from folder to folder.
    shown.resize(room, Line::default());
    rows.extend(shown);
    rows.extend([Line::default(), typed(theme, "or a path ", text, columns)]);
    let clear = if text.is_empty() { (BACKSPACE, "folder above") } else { (CLEAR, "clear") };
    (title.to_owned(), rows, vec![(ENTER, key), clear, (ESC, "back")])
}

/// What a question shows in this many columns; a list of files in it has `room` rows.
pub(super) fn ask(question: &Question, view: &View, theme: Theme, (columns, room): (usize, usize)) -> Content {
    let (title, rows, hints) = match question {
        Question::Link(form) => (
            "Connect to",
            {
                let text = "A serial port (/dev/ttyUSB0, COM3) or its adapter's serial number, an address in the network \
                            (tcp://host:port), or an emulated unit (emu:axtc4co).";
                with_form(theme, paragraphs(&[text], columns), form, columns)
            },
            vec![(ENTER, "connect"), (ESC, "back")],
        ),
        Question::File { purpose, form, directory } => {
            let (title, text, key) = match purpose {
                Purpose::Image => ("Image file", "A path, absolute or from this folder:", "check it"),
                Purpose::ExportStream => (
                    "Write rows to a CSV file",
                    "A new file; the rows that are kept go first, then all that come until E ends it.",
                    "begin",
                ),
                Purpose::ExportDictionary => (
                    "Write the object dictionary to a file",
                    "A new file. Its ending says how: .json (to compare with later), .csv, .dcf, .txt.",
                    "write",
                ),
            };
            let mut rows = paragraphs(&[text], columns);
            if *purpose == Purpose::Image {
                let directory = visible::text(&directory.to_string_lossy());
                rows.push(Line::styled(format::keep_end(&directory, columns), theme.quiet()));
            }
            let rows = with_form(theme, rows, form, columns);
            (title, rows, vec![(ENTER, key), (CLEAR, "clear"), (ESC, "back")])
        }
        Question::Find(form) => {
            ("Find", vec![typed(theme, "", form.typed.text(), columns)], vec![(ENTER, "keep"), (ESC, "end the search")])
        }
        Question::Temperature { input, form } => (
            "Temperature of the sensor",
            {
                let label = format!("Input {input}, in °C");
                with_form(theme, paragraphs(&[&label], columns), form, columns)
            },
            vec![(ENTER, "set"), (ESC, "back")],
        ),
        Question::Order(form) => (
            "Order to the emulated unit",
            {
                let example = |(orders, does): &(&[&str], &str)| {
                    Line::from(vec![
                        Span::raw(format::left(&orders.join(", "), EXAMPLE_COLUMNS)),
                        Span::styled(format::keep_start(does, columns.saturating_sub(EXAMPLE_COLUMNS)), theme.quiet()),
                    ])
                };
                // What is wrong has to be read to its end: on a small screen it takes the place of examples.
                let wrong = form.complaint.as_deref().map_or(0, |text| format::wrap(text, columns).len());
                let examples = ORDERS.iter().take(ORDERS.len() - wrong.saturating_sub(1).min(ORDERS.len()));
                with_form(theme, examples.map(example).collect(), form, columns)
            },
            vec![(ENTER, "do it"), (ESC, "back")],
        ),
        Question::Stream { source, millis, .. } => (
            "Switch the data stream on",
            {
                let choice = |mine: Source, text: &'static str| match mine == *source {
                    true => Line::styled(format!("› {text}"), theme.strong()),
                    false => Line::raw(format!("  {text}")),
                };
                let mut rows = vec![
                    choice(Source::FieldValue, "F  field value, object 6100h, in °C"),
                    choice(Source::ProcessValue, "P  process value, object 7130h, in counts"),
                    Line::default(),
                    typed(theme, "Every, in ms: ", millis.typed.text(), columns),
                    Line::default(),
                ];
                rows.extend(paragraphs(
                    &["The unit stores this: the stream comes back after every power cycle until T switches it off."],
                    columns,
                ));
                for text in
                    [too_fast(view, *source, millis.typed.text()), loses_rows(view, *source)].into_iter().flatten()
                {
                    rows.push(Line::default());
                    rows.extend(format::wrap(&text, columns).into_iter().map(|row| Line::styled(row, theme.warning())));
                }
                rows.extend(complain(theme, millis.complaint.as_deref(), columns));
                rows
            },
            vec![(letter('f'), "field"), (letter('p'), "process"), (ENTER, "switch on"), (ESC, "back")],
        ),
        Question::View => (
            "View the object dictionary",
            paragraphs(
                &[
                    "While the object dictionary is viewed, the unit halts temperature scanning and CAN. It has to be \
                     pre-operational.",
                    "axcon reads all of it, which takes some seconds, and leaves the view again; or look at it \
                     yourself on the terminal: Enter shows the next object, X leaves.",
                ],
                columns,
            ),
            vec![(ENTER, "read all of it"), (letter('t'), "on the terminal"), (ESC, "back")],
        ),
        Question::Defaults(form) => (
            "Restore the default object dictionary",
            {
                let rows = paragraphs(
                    &[
                        "All settings of the object dictionary go back to the factory's. The unit applies them at once: \
                         it restarts. Node-ID and bit rate stay as LSS has set them.",
                        "Type Yes to do it.",
                    ],
                    columns,
                );
                with_form(theme, rows, form, columns)
            },
            vec![(ENTER, "restore"), (ESC, "back")],
        ),
        Question::Allow { errors, cursor, complaint } => (
            "Send in spite of this?",
            {
                let row = |(number, error): (usize, &DefectId)| match number == *cursor {
                    true => Line::styled(format!("› {}", error.name()), theme.strong()),
                    false => Line::raw(format!("  {}", error.name())),
                };
                let mut rows: Vec<Line> = errors.iter().enumerate().map(row).collect();
                rows.push(Line::default());
                rows.extend(paragraphs(&[errors.get(*cursor).map_or("", |error| in_spite_of(*error))], columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            match errors.len() {
                1 => vec![(letter(' '), "allow it and check again"), (ESC, "back")],
                _ => vec![(DOWN, "choose"), (letter(' '), "allow it and check again"), (ESC, "back")],
            },
        ),
        Question::Begun { noted, in_loader } => (
            "Is it the unit this was begun for?",
            {
                let Noted { product, image, begun, .. } = noted;
                let image =
                    Path::new(image).file_name().map_or(image.clone(), |name| name.to_string_lossy().into_owned());
                let note = format!(
                    "By our note {} was begun on this link for an {}, {}.",
                    visible::text(&image),
                    visible::text(product),
                    visible::text(begun)
                );
                let unit = "The unit that is there now cannot say what it is, and another on the same cable looks the same. \
                            A file for another product would make it useless until the right one is sent. Its label says \
                            the product.";
                paragraphs(&[note.as_str(), unit], columns)
            },
            vec![
                (letter('y'), if *in_loader { "it is: start" } else { "it is: go on" }),
                (letter('n'), "another unit"),
                (ESC, "back"),
            ],
        ),
        Question::Label { form, image, .. } => (
            "Which product is the unit?",
            {
                let image = image.as_deref().map_or("not said".to_owned(), visible::text);
                let text = "The unit cannot say what it is: a loader knows only how to take a file. A file for another \
                            product would make the unit useless until the right one is sent.";
                let named = format!("The file is for: {image}. Type the part number on the unit's label.");
                let rows = paragraphs(&[text, named.as_str()], columns);
                with_form(theme, rows, form, columns)
            },
            vec![(ENTER, "go on"), (ESC, "back")],
        ),
        Question::Password { field, complaint, .. } => (
            "Password for loading software",
            {
                let origin = match view.emulated() {
                    Some(_) => "Emulated units take AXIO-2010.",
                    None => "Your Axiomatic contact has it. Capital and small letters count.",
                };
                let rows = paragraphs(&[origin, "It is neither shown nor recorded."], columns);
                with_field(theme, rows, &field.dots(), *complaint, columns)
            },
            vec![(ENTER, "start the upload"), (ESC, "back")],
        ),
        Question::CancelLoad => (
            "Cancel the upload?",
            paragraphs(&[consequence(view.load.progress.map(|progress| progress.phase))], columns),
            vec![(letter('y'), "cancel the upload"), (letter('n'), "go on loading")],
        ),
        Question::Paste { bytes, left_out } => (
            "Send the pasted text?",
            {
                // What follows the last line end, if anything, is a line as well.
                let rows = bytes.split_inclusive(|&byte| byte == b'\r').count();
                let lines = if rows == 1 { "one line".to_owned() } else { format!("{} lines", format::grouped(rows)) };
                let go = if bytes.len() == 1 { "goes" } else { "go" };
                let mut texts = vec![
                    format!("{}, {lines}, {go} to the unit as if typed.", format::counted(bytes.len(), "character")),
                    MENU_KEYS.to_owned(),
                ];
                if *left_out > 0 {
                    let left_out = format::counted(*left_out, "character");
                    texts.push(format!("Left out: {left_out} that a unit does not know; it takes ASCII only."));
                }
                paragraphs(&texts, columns)
            },
            vec![(letter('y'), "send"), (ESC, "do not send")],
        ),
        Question::Choose { wanted, picker, form } => {
            return choose(*wanted, picker, form.typed.text(), theme, (columns, room));
        }
        Question::SendFile { name, bytes, is_image } => (
            "Send this file as it is?",
            {
                let name = visible::text(name);
                let size = format::counted(bytes.len(), "byte");
                let mut texts = vec![format!("{name}, {size}, goes to the unit as if typed.")];
                texts.push(match is_image {
                    true => {
                        "It is a software image. The load screen (4) checks it first, waits where the unit needs time, \
                             notices every error and proves the result; here nobody does. A unit in its loader may be \
                             left without software, one in its menu takes every S and D for a key."
                            .to_owned()
                    }
                    false => MENU_KEYS.to_owned(),
                });
                let time = bytes.len() as f64 * f64::from(BITS_PER_CHARACTER) / f64::from(view.link.baud.max(1));
                texts.push(format!(
                    "It takes {} or more. Esc stops it.",
                    format::minutes(Duration::from_secs_f64(time.ceil()))
                ));
                paragraphs(&texts, columns)
            },
            match is_image {
                true => {
                    vec![(letter('l'), "load screen"), (letter('y'), "send all the same"), (ESC, "do not send")]
                }
                false => vec![(letter('y'), "send"), (ESC, "do not send")],
            },
        ),
        Question::Disconnect { then } => (
            "Close the link?",
            {
                let name = view.link.name.as_deref().map_or("The link".into(), visible::text);
                let mut texts: Vec<String> = match &view.link.state {
                    // It was, when this was asked.
                    LinkState::Lost(_) => vec![format!("{name} is lost.")],
                    _ if view.would_be_left() => in_the_middle(view).map(str::to_owned).to_vec(),
                    _ => vec![format!("{name} is connected.")],
                };
                if view.emulated().is_some() {
                    texts.push("The emulated unit is gone with its link, with all that was set and loaded.".into());
                }
                let is_same = *then == view.link.name;
                texts.extend(then.as_deref().map(visible::text).map(|link| match is_same {
                    true if view.emulated().is_some() => "Then a new one begins, as the factory made it.".to_owned(),
                    true => format!("Then {link} is opened again."),
                    false => format!("{link} is opened first: if that fails, the link stays."),
                }));
                paragraphs(&texts, columns)
            },
            match &view.link.state {
                LinkState::Lost(_) if view.emulated().is_some() && *then == view.link.name => {
                    vec![(letter('y'), "new unit"), (letter('n'), "stay here")]
                }
                _ => vec![(letter('y'), "close the link"), (letter('n'), "stay connected")],
            },
        ),
        Question::Quit => (
            "Leave axcon?",
            paragraphs(&in_the_middle(view), columns),
            vec![(letter('y'), "leave"), (letter('n'), "stay")],
        ),
    };
    (title.to_owned(), rows, hints)
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

/// Texts with a blank line between them.
pub(super) fn paragraphs(texts: &[impl AsRef<str>], columns: usize) -> Vec<Line<'static>> {
    let mut rows = Vec::new();
    for text in texts {
        if !rows.is_empty() {
            rows.push(Line::default());
        }
        rows.extend(format::wrap(text.as_ref(), columns).into_iter().map(Line::raw));
    }
    rows
}

/// A line that is typed, below what is asked.
fn with_form(theme: Theme, asked: Vec<Line<'static>>, form: &Form, columns: usize) -> Vec<Line<'static>> {
    with_field(theme, asked, form.typed.text(), form.complaint.as_deref(), columns)
}

/// A field below what is asked, and below it what is wrong with what was typed.
fn with_field(
    theme: Theme,
    mut asked: Vec<Line<'static>>,
    text: &str,
    complaint: Option<&str>,
    columns: usize,
) -> Vec<Line<'static>> {
    asked.push(Line::default());
    asked.push(typed(theme, "", text, columns));
    asked.extend(complain(theme, complaint, columns));
    asked
}

/// A field: its end is what one looks at while typing.
fn typed(theme: Theme, label: &'static str, text: &str, columns: usize) -> Line<'static> {
    let room = columns.saturating_sub(format::width(label) + 3);
    let text = format::keep_end(&visible::text(text), room);
    Line::from(vec![
        Span::styled(label, theme.quiet()),
        Span::styled("› ", theme.quiet()),
        Span::styled(text, theme.strong()),
        Span::styled(" ", theme.bar()),
    ])
}

fn complain(theme: Theme, complaint: Option<&str>, columns: usize) -> Vec<Line<'static>> {
    let Some(text) = complaint else { return Vec::new() };
    let broken = format::wrap(text, columns).into_iter().map(|line| Line::styled(line, theme.bad()));
    std::iter::once(Line::default()).chain(broken).collect()
}
