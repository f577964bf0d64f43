//! What is in front of a screen: a question, a wait, or a failure.
//!
//! All text is typed here, so that a letter on a screen is always a command and a letter in a popup never is.
//!
//! | file | what of a question it has |
//! |---|---|
//! | this one | which questions there are, with what is typed and chosen so far; how each is put |
//! | `content.rs` | what it says, and which keys it names |
//! | `warnings.rs` | what it says of the consequences, where that depends on the unit |
//! | `draw.rs` | where it stands on the screen, and what a click on it means |
//! | `answer.rs` | what keys and pasted text do to it, and what follows from its answer |
//! | `form.rs` | the line that many of them have typed |

mod answer;
mod content;
mod draw;
mod form;
mod warnings;

use std::path::{Path, PathBuf};

use super::action::Action;
use super::image_facts::ImageFacts;
use super::input::{Failure, Noted};
use super::keymap::Press;
use super::picker::{Offers, Picker};
use super::view::View;
use super::widgets::field::PasswordField;
use super::widgets::format;
use crate::image::DefectId;
use crate::session::UnitState;
use crate::time::Instant;
use crate::wire::stream::Source;

pub use answer::Answer;
pub use draw::{Target, draw, target_at};
pub use form::{Form, Sent};
pub use warnings::in_the_middle;

/// What is in front of the screen.
#[derive(Debug)]
pub enum Popup {
    /// The user has to answer.
    Asking(Question),
    /// The user has to wait.
    Waiting {
        /// What for.
        what: String,
        /// The key that does not wait, and what it does.
        hint: (Press, &'static str),
    },
    /// Something has failed; what, and what to try.
    Failed {
        /// In a few words.
        title: &'static str,
        /// What happened and what to try.
        failure: Failure,
    },
}

/// A question.
#[derive(Debug)]
pub enum Question {
    /// A link by name.
    Link(Form),
    /// A file by name, in a folder.
    FileName {
        /// What it is for.
        purpose: NamedFor,
        /// Its name, relative to the folder. The box goes when the file has been written.
        form: Form,
        /// The folder; empty for the one the program was started in.
        directory: PathBuf,
    },
    /// A file that is there: chosen from its folder, or its path typed.
    PickFile {
        /// What it is for.
        purpose: PickedFor,
        /// The folder.
        picker: Picker,
        /// A path; where one has been typed, Enter takes that.
        form: Form,
    },
    /// Shall this file go to the unit as it is?
    SendFile {
        /// Its name.
        name: String,
        /// What is in it.
        bytes: Vec<u8>,
        /// It is a software image, which the load screen sends safely.
        is_image: bool,
    },
    /// Words to look for; every letter looks.
    Find(Form),
    /// The temperature of an emulated unit's sensor.
    Temperature {
        /// Which input, from 1.
        input: usize,
        /// In °C.
        form: Form,
    },
    /// An order to an emulated unit.
    Order(Form),
    /// What the stream shall send.
    Stream {
        /// Field or process value.
        source: Source,
        /// Repetition time in milliseconds.
        millis: Form,
        /// It is still the suggested one: a digit replaces it.
        is_suggested: bool,
    },
    /// Shall the object dictionary be read, or its view be opened on the terminal?
    View,
    /// Shall the defaults be restored?
    Defaults(Form),
    /// In spite of which error shall the image be sent? No text: a password typed from habit stood here in clear.
    Allow {
        /// Which errors there are.
        errors: Vec<DefectId>,
        /// The chosen one.
        cursor: usize,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// Is the unit the one that the note of an upload is about? Any that waits in its loader on the same cable looks like it.
    SameUnit {
        /// The note.
        noted: Noted,
        /// It waits in its loader already, which asks for no password.
        in_loader: bool,
    },
    /// What the unit's label says.
    Label {
        /// The part number.
        form: Form,
        /// What the image is for.
        image: Option<String>,
        /// It waits in its loader already, which asks for no password.
        in_loader: bool,
    },
    /// The unit's password.
    Password {
        /// What has been typed.
        field: PasswordField,
        /// What the label says, if that had to be asked.
        product: Option<String>,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// Shall the upload be cancelled?
    CancelLoad,
    /// Shall pasted text go to the unit?
    Paste {
        /// What of it the unit can be sent.
        bytes: Vec<u8>,
        /// How many characters it does not know.
        left_out: usize,
    },
    /// Shall the link be closed though something is in the middle?
    Disconnect {
        /// The link to open instead.
        then: Option<String>,
    },
    /// Shall the program end though something is in the middle?
    Quit,
}

/// What a file whose name is typed is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedFor {
    /// An image to load.
    Image,
    /// Rows of the stream go there.
    ExportStream,
    /// The object dictionary goes there.
    ExportDictionary,
}

/// What a file is for that is picked among those that are there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PickedFor {
    /// To compare the object dictionary with.
    Dump,
    /// To be sent to the unit as it is.
    ToSend,
}

/// Orders to an emulated unit as examples, and what they do; each is one that the emulator takes.
pub const ORDERS: &[(&[&str], &str)] = &[
    (&["set 1 temperature 45.5"], "its sensor's temperature, °C"),
    (&["process 1"], "back to the default process"),
    (&["open 2", "short 2", "repair 2"], "its wires"),
    (&["fault lost from-unit one in 100"], "something goes wrong"),
    (&["fault latency 16", "heal"], "also; all faults end"),
    (&["nmt start", "nmt stop"], "as the network's master"),
    (&["write 6112:1 0", "read 6100:1"], "the object dictionary"),
    (&["power off", "power cycle 2"], "the supply"),
    (&["unplug"], "the unit is gone with it"),
    (&["freeze", "thaw", "status"], "the converter; a summary"),
];

/// Repetition time that is suggested where no other is known.
const USUAL_PERIOD_MS: u64 = 1000;
/// Shortest repetition time of the stream (errata E-105).
const SHORTEST_PERIOD_MS: u64 = 1;
/// Longest repetition time of the stream (errata E-105).
const LONGEST_PERIOD_MS: u64 = 60_000;

impl Popup {
    /// Whether there is nothing left to wait for or to answer once the link is lost.
    pub fn ends_with_link(&self) -> bool {
        matches!(self, Popup::Waiting { .. } | Popup::Asking(Question::CancelLoad | Question::Quit))
    }
}

impl Question {
    /// Asks for a link.
    pub fn link() -> Question {
        Question::Link(Form::default())
    }

    /// Asks for an image.
    pub fn image(directory: &Path) -> Question {
        Question::FileName { purpose: NamedFor::Image, form: Form::default(), directory: directory.to_path_buf() }
    }

    /// Asks for another file, and suggests a name for a new one.
    pub fn file_name(purpose: NamedFor, view: &View) -> Question {
        let form = match purpose {
            NamedFor::Image => Form::default(),
            NamedFor::ExportStream => Form::with(suggested(view, "stream", view.unit.monitor.stream.newest, "csv")),
            NamedFor::ExportDictionary => {
                let at = view.unit.dictionary.as_ref().map(|read| read.at);
                Form::with(suggested(view, "dictionary", at, "json"))
            }
        };
        Question::FileName { purpose, form, directory: PathBuf::new() }
    }

    /// Asks for a file that is there, beginning in a folder that has to be read.
    pub fn pick_file(purpose: PickedFor, directory: &Path) -> Question {
        let offers = match purpose {
            PickedFor::Dump => Offers::Dumps,
            PickedFor::ToSend => Offers::Anything,
        };
        let mut picker = Picker::new(offers, directory.to_path_buf());
        picker.list(directory.to_path_buf());
        Question::PickFile { purpose, picker, form: Form::default() }
    }

    /// Asks for words to look for, those of the last time given.
    pub fn find(words: &str) -> Question {
        Question::Find(Form::with(words))
    }

    /// Asks for the temperature of an emulated unit's sensor.
    pub fn temperature(input: usize) -> Question {
        Question::Temperature { input, form: Form::default() }
    }

    /// Asks for an order to an emulated unit.
    pub fn order() -> Question {
        Question::Order(Form::default())
    }

    /// Asks what the stream shall send; what it has sent last is suggested.
    pub fn stream(view: &View) -> Question {
        let stream = &view.unit.monitor.stream;
        let millis =
            stream.period_set().or(view.unit.last_period).map_or(USUAL_PERIOD_MS, |period| period.as_millis() as u64);
        Question::Stream {
            source: stream.source.unwrap_or(Source::FieldValue),
            millis: Form::with(millis.to_string()),
            is_suggested: true,
        }
    }

    /// Asks in spite of which of these errors an image shall be sent.
    pub fn allow(errors: Vec<DefectId>) -> Question {
        Question::Allow { errors, cursor: 0, complaint: None }
    }

    /// Asks for what an upload still needs, or starts it where that is nothing.
    pub fn start_load(view: &View, facts: &ImageFacts) -> Action {
        let in_loader = view.facts.state == UnitState::Loader;
        if let Some(noted) = view.noted() {
            return Action::Ask(Question::SameUnit { noted: noted.clone(), in_loader });
        }
        if view.needs_label() {
            Action::Ask(Question::label(view, facts))
        } else {
            Question::then_password(in_loader, None)
        }
    }

    /// Asks what the unit's label says.
    pub fn label(view: &View, facts: &ImageFacts) -> Question {
        let (image, in_loader) = (facts.product.clone(), view.facts.state == UnitState::Loader);
        Question::Label { form: Form::default(), image, in_loader }
    }

    /// The password is asked for, but not for a loader, which wants none.
    fn then_password(in_loader: bool, product: Option<String>) -> Action {
        if in_loader {
            Action::StartLoad { password: None, product }
        } else {
            Action::Ask(Question::Password { field: PasswordField::new(), product, complaint: None })
        }
    }

    /// The line that is typed here, if one is. A password is not such a line: it is never text.
    pub fn form(&mut self) -> Option<&mut Form> {
        match self {
            Question::Link(form)
            | Question::FileName { form, .. }
            | Question::PickFile { form, .. }
            | Question::Find(form)
            | Question::Temperature { form, .. }
            | Question::Order(form)
            | Question::Stream { millis: form, .. }
            | Question::Defaults(form)
            | Question::Label { form, .. } => Some(form),
            Question::SendFile { .. }
            | Question::View
            | Question::Allow { .. }
            | Question::SameUnit { .. }
            | Question::Password { .. }
            | Question::CancelLoad
            | Question::Paste { .. }
            | Question::Disconnect { .. }
            | Question::Quit => None,
        }
    }

    /// What was typed is refused: it can be corrected where it was typed.
    pub fn refused(&mut self, why: String) {
        if let Some(form) = self.form() {
            form.refuse(why);
        }
    }

    /// Whether the answer is for the unit that it was asked about.
    pub fn is_about_unit(&self) -> bool {
        match self {
            Question::SendFile { .. }
            | Question::Stream { .. }
            | Question::View
            | Question::Defaults(_)
            | Question::SameUnit { .. }
            | Question::Label { .. }
            | Question::Password { .. }
            | Question::CancelLoad
            | Question::Paste { .. } => true,
            Question::Link(_)
            | Question::FileName { .. }
            | Question::PickFile { .. }
            | Question::Find(_)
            | Question::Temperature { .. }
            | Question::Order(_)
            | Question::Allow { .. }
            | Question::Disconnect { .. }
            | Question::Quit => false,
        }
    }
}

/// A name for a new file: `axtc4co-stream-20260131T120000Z.csv`.
fn suggested(view: &View, what: &str, at: Option<Instant>, extension: &str) -> String {
    let product = view.product().map_or("unit".to_owned(), |product| product.name.to_lowercase());
    let time = format::utc(view.link.start_millis, at.unwrap_or_default());
    let time: String = time.split('.').next().unwrap_or_default().chars().filter(|c| !"-:".contains(*c)).collect();
    format!("{product}-{what}-{time}Z.{extension}")
}
