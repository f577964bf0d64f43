//! Pictures of the popups.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, BorderType, Clear};

use super::{ORDERS, Popup, Purpose, Question, Wanted, consequence};
use crate::session::Job;
use crate::time::{BITS_PER_CHARACTER, Duration};
use crate::tui::keymap::Press;
use crate::tui::picker::Picker;
use crate::tui::screens::bench::emulated;
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Source;

/// Columns of a popup, borders included.
const COLUMNS: u16 = 66;

/// Columns of a popup with a list of files.
const LIST_COLUMNS: u16 = 78;
/// Columns of the orders that are examples.
const EXAMPLE_COLUMNS: usize = 33;
/// Rows of a list of files at most.
const MOST_LIST_ROWS: usize = 24;
/// The row of its content in which the list begins.
const LIST_ROW: usize = 3;
/// Rows of a popup with a list of files that are not the list.
const AROUND_LIST: u16 = 12;

/// A popup with its place, and what can be clicked on it.
struct Laid {
    window: Rect,
    inside: Rect,
    title: Span<'static>,
    rows: Vec<Line<'static>>,
    targets: Vec<(Rect, Target)>,
}

/// What a click on a popup means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The same as this key.
    Key(Press),
    /// An entry of the list of files.
    Entry(usize),
}

/// A key and what it does here.
type Hint = (Press, &'static str);

const ENTER: Press = Press::Plain(KeyCode::Enter);
const ESC: Press = Press::Plain(KeyCode::Esc);
const BACKSPACE: Press = Press::Plain(KeyCode::Backspace);
const CLEAR: Press = Press::Ctrl('u');

const fn letter(letter: char) -> Press {
    Press::Plain(KeyCode::Char(letter))
}

/// Draws a popup in the middle of an area.
pub fn draw(popup: &Popup, view: &View, theme: Theme, area: Rect, frame: &mut Frame) {
    let laid = lay_out(popup, view, theme, area);
    let block = Block::bordered().border_type(BorderType::Rounded).border_style(theme.quiet()).title(laid.title);
    frame.render_widget(Clear, laid.window);
    frame.render_widget(block, laid.window);
    lines::draw(frame, laid.inside, laid.rows);
}

/// What a click at this place of the screen means to the popup.
pub fn target_at(popup: &Popup, view: &View, theme: Theme, area: Rect, place: Position) -> Option<Target> {
    let targets = lay_out(popup, view, theme, area).targets;
    targets.into_iter().find_map(|(rect, target)| rect.contains(place).then_some(target))
}

fn lay_out(popup: &Popup, view: &View, theme: Theme, area: Rect) -> Laid {
    let is_list = matches!(popup, Popup::Asking(Question::Choose { .. }));
    let columns = if is_list { LIST_COLUMNS } else { COLUMNS }.min(area.width);
    let inner = usize::from(columns).saturating_sub(4);
    let room = usize::from(area.height.saturating_sub(AROUND_LIST)).clamp(1, MOST_LIST_ROWS);
    let mut choices: Vec<(usize, Target)> = Vec::new();
    let (title, mut rows, hints) = match popup {
        Popup::Asking(question) => {
            if let Question::Stream { .. } = question {
                choices.extend([(0, Target::Key(letter('f'))), (1, Target::Key(letter('p')))]);
            }
            if let Question::Choose { picker, .. } = question {
                let entry = |row| Some((LIST_ROW + row, Target::Entry(picker.entry_at(row, room)?)));
                choices.extend((0..room).filter_map(entry));
            }
            ask(question, view, theme, (inner, room))
        }
        Popup::Waiting { what, hint } => ("One moment".to_owned(), paragraphs(&[what], inner), vec![*hint]),
        Popup::Failed { title, failure } => {
            let mut rows = paragraphs(&[&visible::sentence(&failure.text)], inner);
            for hint in &failure.hints {
                rows.push(Line::default());
                let broken = format::wrap(&visible::text(hint), inner.saturating_sub(2));
                rows.extend(
                    broken
                        .into_iter()
                        .enumerate()
                        .map(|(number, line)| Line::raw(format!("{} {line}", if number == 0 { "·" } else { " " }))),
                );
            }
            ((*title).to_owned(), rows, vec![(ENTER, "close")])
        }
    };
    let hints_row = rows.len() + 1;
    let mut line = Line::default();
    let mut keys: Vec<(u16, u16, Target)> = Vec::new();
    for (press, meaning) in hints {
        let begin = line.width() as u16;
        line.push_span(Span::styled(press.name(), theme.key()));
        line.push_span(Span::raw(format!(" {meaning}")));
        keys.push((begin, line.width() as u16 - begin, Target::Key(press)));
        line.push_span(Span::raw("   "));
    }
    rows.extend([Line::default(), line]);
    let height = (rows.len() as u16 + 4).min(area.height);
    let y = match popup {
        // What is found has to stay in sight.
        Popup::Asking(Question::Find(_)) => area.bottom() - height,
        Popup::Asking(_) | Popup::Waiting { .. } | Popup::Failed { .. } => area.y + (area.height - height) / 2,
    };
    let window = Rect { x: area.x + (area.width - columns) / 2, y, width: columns, height };
    let style = match popup {
        Popup::Failed { .. } => theme.bad(),
        Popup::Asking(_) | Popup::Waiting { .. } => theme.heading(),
    };
    let inside = Rect {
        x: window.x + 2.min(window.width),
        y: window.y + 2.min(window.height),
        width: window.width.saturating_sub(4),
        height: window.height.saturating_sub(3),
    };
    let place = |row: usize, x: u16, width: u16| {
        let rect = Rect { x: inside.x + x, y: inside.y + row as u16, width, height: 1 };
        rect.intersection(inside)
    };
    let mut targets: Vec<(Rect, Target)> =
        choices.into_iter().map(|(row, target)| (place(row, 0, inside.width), target)).collect();
    targets.extend(keys.into_iter().map(|(x, width, target)| (place(hints_row, x, width), target)));
    Laid { window, inside, title: Span::styled(format!(" {title} "), style), rows, targets }
}

type Content = (String, Vec<Line<'static>>, Vec<Hint>);

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
    let mut rows = above.to_vec();
    let mut shown = picker.rows(theme, columns, room, "Type a path.");
    // The popup keeps its height from folder to folder.
    shown.resize(room, Line::default());
    rows.extend(shown);
    rows.extend([Line::default(), typed(theme, "or a path ", text, columns)]);
    let clear = if text.is_empty() { (BACKSPACE, "folder above") } else { (CLEAR, "clear") };
    (title.to_owned(), rows, vec![(ENTER, key), clear, (ESC, "back")])
}

fn ask(question: &Question, view: &View, theme: Theme, (columns, room): (usize, usize)) -> Content {
    let (title, mut rows, hints) = match question {
        Question::Link(field) => (
            "Connect to",
            {
                let mut rows = paragraphs(
                    &["A serial port (/dev/ttyUSB0, COM3) or its adapter's serial number, an address in the network \
                       (tcp://host:port), or an emulated unit (emu:axtc4co)."],
                    columns,
                );
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows
            },
            vec![(ENTER, "connect"), (ESC, "back")],
        ),
        Question::File { purpose, typed: field, directory, complaint } => {
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
            rows.push(Line::default());
            rows.push(typed(theme, "", field.text(), columns));
            rows.extend(complain(theme, complaint.as_deref(), columns));
            (title, rows, vec![(ENTER, key), (CLEAR, "clear"), (ESC, "back")])
        }
        Question::Find(field) => {
            ("Find", vec![typed(theme, "", field.text(), columns)], vec![(ENTER, "keep"), (ESC, "show everything")])
        }
        Question::Temperature { input, typed: field, complaint } => (
            "Temperature of the sensor",
            {
                let label = format!("Input {input}, in °C");
                let mut rows = paragraphs(&[&label], columns);
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "set"), (ESC, "back")],
        ),
        Question::Order { typed: field, complaint } => (
            "Order to the emulated unit",
            {
                let example = |(orders, does): &(&[&str], &str)| {
                    Line::from(vec![
                        Span::raw(format::left(&orders.join(", "), EXAMPLE_COLUMNS)),
                        Span::styled(format::keep_start(does, columns.saturating_sub(EXAMPLE_COLUMNS)), theme.quiet()),
                    ])
                };
                let mut rows: Vec<Line> = ORDERS.iter().map(example).collect();
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "do it"), (ESC, "back")],
        ),
        Question::Stream { source, millis, complaint, .. } => (
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
                    typed(theme, "Every, in ms: ", millis.text(), columns),
                    Line::default(),
                ];
                rows.extend(paragraphs(
                    &["The unit stores this: the stream comes back after every power cycle until T switches it off."],
                    columns,
                ));
                for text in [too_fast(view, *source, millis.text()), loses_rows(view, *source)].into_iter().flatten() {
                    rows.push(Line::default());
                    rows.extend(format::wrap(&text, columns).into_iter().map(|row| Line::styled(row, theme.warning())));
                }
                rows.extend(complain(theme, *complaint, columns));
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
        Question::Defaults { typed: field, complaint } => (
            "Restore the default object dictionary",
            {
                let mut rows = paragraphs(
                    &[
                        "All settings of the object dictionary go back to the factory's. The unit applies them at once: \
                         it restarts. Node-ID and bit rate stay as LSS has set them.",
                        "Type Yes to do it.",
                    ],
                    columns,
                );
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "restore"), (ESC, "back")],
        ),
        Question::Allow { typed: field, errors, complaint } => (
            "Send in spite of an error?",
            {
                let names: Vec<&str> = errors.iter().map(|error| error.name()).collect();
                let named = format!("Type the name of one: {}.", names.join(", "));
                let consequence = "What is sent is not what was built, or not for this unit. It may not run, and the unit \
                                   then waits in its loader, without scanning and CAN, for a file that is sound.";
                let mut rows = paragraphs(&[consequence, &named], columns);
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "allow it and check again"), (ESC, "back")],
        ),
        Question::Label { typed: field, image, complaint, .. } => (
            "Which product is the unit?",
            {
                let image = image.as_deref().map_or("not said".to_owned(), visible::text);
                let mut rows = paragraphs(
                    &[
                        "The unit cannot say what it is: a loader knows only how to take a file. A file for another \
                         product would make the unit useless until the right one is sent.",
                        &format!("The file is for: {image}. Type the part number on the unit's label."),
                    ],
                    columns,
                );
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "go on"), (ESC, "back")],
        ),
        Question::Password { field, complaint, .. } => (
            "Password for loading software",
            {
                let is_emulated = view.link.name.as_deref().is_some_and(|name| name.starts_with("emu:"));
                let origin = match is_emulated {
                    true => "Emulated units take AXIO-2010.",
                    false => "Your Axiomatic contact has it. Capital and small letters count.",
                };
                let mut rows = paragraphs(&[origin, "It is neither shown nor recorded."], columns);
                rows.push(Line::default());
                rows.push(typed(theme, "", &field.dots(), columns));
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![(ENTER, "start the upload"), (ESC, "back")],
        ),
        Question::CancelLoad => (
            "Cancel the upload?",
            paragraphs(&[consequence(view.load.progress.map(|progress| progress.phase))], columns),
            vec![(letter('y'), "cancel the upload"), (letter('n'), "go on loading")],
        ),
        Question::Paste(bytes) => (
            "Send the pasted text?",
            {
                let rows = bytes.iter().filter(|&&byte| byte == b'\r').count() + 1;
                let lines = if rows == 1 { "one line".to_owned() } else { format!("{rows} lines") };
                paragraphs(
                    &[
                        &format!("{} characters, {lines}, go to the unit as if typed.", format::grouped(bytes.len())),
                        "Every M, V, D, T, S and L in it is a key of the unit's menu.",
                    ],
                    columns,
                )
            },
            vec![(letter('y'), "send"), (ESC, "do not send")],
        ),
        Question::Choose { wanted, picker, typed } => {
            return choose(*wanted, picker, typed.text(), theme, (columns, room));
        }
        Question::SendFile { name, bytes, is_image } => (
            "Send this file as it is?",
            {
                let name = visible::text(name);
                let size = format::grouped(bytes.len());
                let mut texts = vec![format!("{name}, {size} bytes, goes to the unit as if typed.")];
                texts.push(match is_image {
                    true => {
                        "It is a software image. The load screen (4) checks it first, waits where the unit needs time, \
                             notices every error and proves the result; here nobody does. A unit in its loader may be \
                             left without software, one in its menu takes every S and D for a key."
                            .to_owned()
                    }
                    false => "Every M, V, D, T, S and L in it is a key of the unit's menu.".to_owned(),
                });
                let time = bytes.len() as f64 * f64::from(BITS_PER_CHARACTER) / f64::from(view.link.baud.max(1));
                texts.push(format!(
                    "It takes {} or more. Esc stops it.",
                    format::minutes(Duration::from_secs_f64(time.ceil()))
                ));
                let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
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
                let mut texts: Vec<String> = match view.is_in_the_middle() {
                    true => in_the_middle(view).map(str::to_owned).to_vec(),
                    false => {
                        vec![format!("{} is connected.", visible::text(view.link.name.as_deref().unwrap_or("A unit")))]
                    }
                };
                if emulated(view).is_some() {
                    texts.push("The emulated unit is gone with its link, with all that was set and loaded.".into());
                }
                let is_same = *then == view.link.name;
                texts.extend(then.as_deref().map(visible::text).map(|link| match is_same {
                    true => format!("Then {link} is opened again."),
                    false => format!("{link} is opened first: if that fails, the link stays."),
                }));
                let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
                paragraphs(&texts, columns)
            },
            vec![(letter('y'), "close the link"), (letter('n'), "stay connected")],
        ),
        Question::Quit => (
            "Leave axcon?",
            paragraphs(&in_the_middle(view), columns),
            vec![(letter('y'), "leave"), (letter('n'), "stay")],
        ),
    };
    if rows.is_empty() {
        rows.push(Line::default());
    }
    (title.to_owned(), rows, hints)
}

/// What becomes of the rows on the screen, if they are of the other source.
fn loses_rows(view: &View, source: Source) -> Option<String> {
    let stream = &view.monitor.stream;
    let rows = stream.source.filter(|shown| *shown != source).map(|_| format::counted(stream.rows, "row"))?;
    Some(format!("The screens begin anew with it: {rows} of the other kind stay in the recording only."))
}

/// Says so if the line cannot carry a row so often.
fn too_fast(view: &View, source: Source, millis: &str) -> Option<String> {
    let period = millis.parse::<f64>().ok().filter(|&millis| millis > 0.0)? / 1000.0;
    let characters = view.product()?.stream.row_characters(source) as f64;
    let carries = f64::from(view.link.baud) / f64::from(BITS_PER_CHARACTER);
    let least = (characters / carries * 1000.0).ceil();
    (characters / period > carries).then(|| {
        format!(
            "A row has {characters} characters: the line carries one every {least} ms, the unit will leave rows out."
        )
    })
}

/// What is in the middle, and what becomes of it when the link is closed.
pub fn in_the_middle(view: &View) -> [&'static str; 2] {
    match view.job {
        Some(Job::Load) => {
            ["New software is being loaded.", consequence(view.load.progress.map(|progress| progress.phase))]
        }
        Some(Job::ReadDictionary) => [
            "The object dictionary is being read: temperature scanning and CAN are halted.",
            "axcon leaves the view first (X), so that they go on.",
        ],
        Some(Job::Diagnostics) => ["The unit prints its diagnostics.", "axcon stops them first (S)."],
        Some(Job::SendFile) => [
            "A file is being sent to the unit.",
            "What of it has not left yet stays here: the unit has part of it then.",
        ],
        Some(Job::StreamOn | Job::StreamOff | Job::RestoreDefaults) => {
            ["The unit is in the middle of its questions.", "axcon ends them first, so that it is at its menu again."]
        }
        None | Some(Job::Identify | Job::Overhear) => [
            "The unit's view is open: temperature scanning and CAN are halted.",
            "axcon closes it first (X), so that they go on.",
        ],
    }
}

fn paragraphs(texts: &[&str], columns: usize) -> Vec<Line<'static>> {
    let mut rows = Vec::new();
    for text in texts {
        if !rows.is_empty() {
            rows.push(Line::default());
        }
        rows.extend(format::wrap(text, columns).into_iter().map(Line::raw));
    }
    rows
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
