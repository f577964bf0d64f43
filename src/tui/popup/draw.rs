//! Pictures of the popups.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, BorderType, Clear};

use super::{Popup, Purpose, Question, consequence};
use crate::session::Job;
use crate::time::BITS_PER_CHARACTER;
use crate::tui::screens::bench::emulated;
use crate::tui::theme::Theme;
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Source;

/// Columns of a popup, borders included.
const COLUMNS: u16 = 66;

/// Draws a popup in the middle of an area.
pub fn draw(popup: &Popup, view: &View, theme: Theme, area: Rect, frame: &mut Frame) {
    let columns = COLUMNS.min(area.width);
    let inner = usize::from(columns).saturating_sub(4);
    let (title, mut rows, hints) = match popup {
        Popup::Asking(question) => ask(question, view, theme, inner),
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
            ((*title).to_owned(), rows, vec![("Enter", "close")])
        }
    };
    if !hints.is_empty() {
        rows.push(Line::default());
        let mut line = Line::default();
        for (key, meaning) in hints {
            line.push_span(Span::styled(key, theme.key()));
            line.push_span(Span::raw(format!(" {meaning}   ")));
        }
        rows.push(line);
    }
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
    let block = Block::bordered()
        .border_type(BorderType::Rounded)
        .border_style(theme.quiet())
        .title(Span::styled(format!(" {title} "), style));
    frame.render_widget(Clear, window);
    frame.render_widget(block, window);
    let inside = Rect {
        x: window.x + 2.min(window.width),
        y: window.y + 2.min(window.height),
        width: window.width.saturating_sub(4),
        height: window.height.saturating_sub(3),
    };
    lines::draw(frame, inside, rows);
}

type Content = (String, Vec<Line<'static>>, Vec<(&'static str, &'static str)>);

fn ask(question: &Question, view: &View, theme: Theme, columns: usize) -> Content {
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
            vec![("Enter", "connect"), ("Esc", "back")],
        ),
        Question::File { purpose, typed: field, directory } => {
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
                Purpose::Compare => (
                    "Compare with a dump",
                    "A dump as JSON, as E here or 'axcon dictionary dump --format json' writes it.",
                    "compare",
                ),
            };
            let mut rows = paragraphs(&[text], columns);
            if *purpose == Purpose::Image {
                let directory = visible::text(&directory.to_string_lossy());
                rows.push(Line::styled(format::keep_end(&directory, columns), theme.quiet()));
            }
            rows.push(Line::default());
            rows.push(typed(theme, "", field.text(), columns));
            (title, rows, vec![("Enter", key), ("Ctrl-U", "clear"), ("Esc", "back")])
        }
        Question::Find(field) => {
            ("Find", vec![typed(theme, "", field.text(), columns)], vec![("Enter", "keep"), ("Esc", "show everything")])
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
            vec![("Enter", "set"), ("Esc", "back")],
        ),
        Question::Order(field) => (
            "Order to the emulated unit",
            {
                let text = "As on the input of 'axcon emulate': set 1 temperature 451, open 2, fault loss 0.01, heal, \
                            nmt start, write 6112:1 0, power off, status ...";
                let mut rows = paragraphs(&[text], columns);
                rows.push(Line::default());
                rows.push(typed(theme, "", field.text(), columns));
                rows
            },
            vec![("Enter", "do it"), ("Esc", "back")],
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
                if let Some(text) = too_fast(view, *source, millis.text()) {
                    rows.push(Line::default());
                    rows.extend(format::wrap(&text, columns).into_iter().map(|row| Line::styled(row, theme.warning())));
                }
                rows.extend(complain(theme, *complaint, columns));
                rows
            },
            vec![("F P", "choose"), ("Enter", "switch on"), ("Esc", "back")],
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
            vec![("Enter", "read all of it"), ("T", "on the terminal"), ("Esc", "back")],
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
            vec![("Enter", "restore"), ("Esc", "back")],
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
            vec![("Enter", "allow it and check again"), ("Esc", "back")],
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
            vec![("Enter", "go on"), ("Esc", "back")],
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
            vec![("Enter", "start the upload"), ("Esc", "back")],
        ),
        Question::CancelLoad => (
            "Cancel the upload?",
            paragraphs(&[consequence(view.load.progress.map(|progress| progress.phase))], columns),
            vec![("Y", "cancel the upload"), ("N", "go on loading")],
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
            vec![("Y", "send"), ("N", "do not send")],
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
            vec![("Y", "close the link"), ("N", "stay connected")],
        ),
        Question::Quit => {
            ("Leave axcon?", paragraphs(&in_the_middle(view), columns), vec![("Y", "leave"), ("N", "stay")])
        }
    };
    if rows.is_empty() {
        rows.push(Line::default());
    }
    (title.to_owned(), rows, hints)
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
fn in_the_middle(view: &View) -> [&'static str; 2] {
    match view.job {
        Some(Job::Load) => {
            ["New software is being loaded.", consequence(view.load.progress.map(|progress| progress.phase))]
        }
        Some(Job::ReadDictionary) => [
            "The object dictionary is being read: temperature scanning and CAN are halted.",
            "axcon leaves the view first (X), so that they go on.",
        ],
        Some(Job::Diagnostics) => ["The unit prints its diagnostics.", "axcon stops them first (S)."],
        Some(Job::StreamOn | Job::StreamOff | Job::RestoreDefaults) => {
            ["The unit is at one of its prompts.", "axcon answers it first, so that the next key is none."]
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

fn complain(theme: Theme, complaint: Option<&'static str>, columns: usize) -> Vec<Line<'static>> {
    let Some(text) = complaint else { return Vec::new() };
    let broken = format::wrap(text, columns).into_iter().map(|line| Line::styled(line, theme.bad()));
    std::iter::once(Line::default()).chain(broken).collect()
}
