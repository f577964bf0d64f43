//! What stands in front of a screen: a question, a wait, or a failure.
//!
//! All text is typed here, so that a letter on a screen is always a command and a letter in a popup never is.

mod draw;

use std::path::{Path, PathBuf};

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::action::Action;
use super::image_facts::ImageFacts;
use super::input::Failure;
use super::keymap::{Cmd, Press};
use super::picker::{Offers, Picked, Picker, placed};
use super::screens::ScreenId;
use super::view::View;
use super::widgets::field::{PasswordField, TextField};
use super::widgets::format;
use crate::image::DefectId;
use crate::session::{Command, Phase, UnitState};
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;

pub use draw::{Target, draw, in_the_middle, target_at};

/// What stands in front of the screen.
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
    Link(TextField),
    /// A file by name, in a folder.
    File {
        /// What it is for.
        purpose: Purpose,
        /// What has been typed; relative to the folder.
        typed: TextField,
        /// The folder; empty for the one the program was started in.
        directory: PathBuf,
        /// Why the file named cannot be read.
        complaint: Option<String>,
    },
    /// A file that is there: chosen from its folder, or its path typed.
    Choose {
        /// What it is for.
        wanted: Wanted,
        /// The folder.
        picker: Picker,
        /// What has been typed; where something has, it is what Enter takes.
        typed: TextField,
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
    Find(TextField),
    /// The temperature of an emulated unit's sensor.
    Temperature {
        /// Which input, from 1.
        input: usize,
        /// What has been typed.
        typed: TextField,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// An order to an emulated unit.
    Order {
        /// What has been typed.
        typed: TextField,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// What the stream shall send.
    Stream {
        /// Field or process value.
        source: Source,
        /// Repetition time in milliseconds.
        millis: TextField,
        /// It is still the suggested one: a digit replaces it.
        is_suggested: bool,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// Shall the object dictionary be read, or its view be opened on the terminal?
    View,
    /// Shall the defaults be restored?
    Defaults {
        /// What has been typed.
        typed: TextField,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// In spite of which error shall the image be sent?
    Allow {
        /// What has been typed.
        typed: TextField,
        /// Which errors there are.
        errors: Vec<DefectId>,
        /// What is wrong with it.
        complaint: Option<&'static str>,
    },
    /// What the unit's label says.
    Label {
        /// What has been typed.
        typed: TextField,
        /// What the image is for.
        image: Option<String>,
        /// It waits in its loader already, which asks for no password.
        in_loader: bool,
        /// What is wrong with it.
        complaint: Option<&'static str>,
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
    Paste(Vec<u8>),
    /// Shall the link be closed though something is in the middle?
    Disconnect {
        /// The link to open instead.
        then: Option<String>,
    },
    /// Shall the program end though something is in the middle?
    Quit,
}

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// An image to load.
    Image,
    /// Rows of the stream go there.
    ExportStream,
    /// The object dictionary goes there.
    ExportDictionary,
}

/// What a file that is there is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// To compare the object dictionary with.
    Dump,
    /// To be sent to the unit as it is.
    ToSend,
}

/// What a key did to a popup.
#[derive(Debug)]
pub enum Answer {
    /// The popup stays.
    Stay,
    /// It goes.
    Close,
    /// It goes, and this is wanted.
    Act(Action),
    /// It stays, and this is wanted.
    Meanwhile(Action),
}

/// Orders to an emulated unit as examples, and what they do; each is one that the emulator takes.
pub const ORDERS: &[(&[&str], &str)] = &[
    (&["set 1 temperature 45.5"], "its sensor has so many °C"),
    (&["process 1"], "back to the default process"),
    (&["open 2", "short 2", "repair 2"], "its wires"),
    (&["fault lost from-unit one in 100"], "something goes wrong"),
    (&["fault latency 16", "heal"], "also; all faults end"),
    (&["nmt start", "nmt stop"], "as the network's master"),
    (&["write 6112:1 0", "read 6100:1"], "the object dictionary"),
    (&["power off", "power cycle 2"], "the supply"),
    (&["unplug", "plug"], "the cable"),
    (&["freeze", "thaw", "status"], "the converter; how it stands"),
];

/// Rows that a page key moves in a list of files.
const PAGE: usize = 8;
/// Repetition time that is suggested where no other is known.
const USUAL_PERIOD_MS: u64 = 1000;
/// Shortest repetition time of the stream (errata E-105).
const SHORTEST_PERIOD_MS: u64 = 1;
/// Longest repetition time of the stream (errata E-105).
const LONGEST_PERIOD_MS: u64 = 60_000;
/// What confirms restoring the defaults (AXTC4CO manual, section 4.1.2).
const YES: &str = "Yes";

impl Popup {
    /// What a key does.
    pub fn on(&mut self, key: KeyEvent) -> Answer {
        match self {
            Popup::Asking(question) => question.on(key),
            // The answer is on its way; only it ends the wait.
            Popup::Waiting { .. } => Answer::Stay,
            Popup::Failed { .. } => match key.code {
                KeyCode::Enter | KeyCode::Esc | KeyCode::Char(_) => Answer::Close,
                _ => Answer::Stay,
            },
        }
    }

    /// Whether there is nothing to wait for or to answer any more once the link is lost.
    pub fn ends_with_link(&self) -> bool {
        matches!(self, Popup::Waiting { .. } | Popup::Asking(Question::CancelLoad | Question::Quit))
    }

    /// Pasted text goes into a field as if it had been typed, up to its first line end.
    pub fn paste(&mut self, text: &str) {
        if let Popup::Asking(question) = self {
            for character in text.chars().take_while(|character| !character.is_control()) {
                question.typed(character);
            }
        }
    }
}

impl Wanted {
    /// What is to be done with the file.
    fn action(self, path: PathBuf) -> Action {
        match self {
            Wanted::Dump => Action::Compare(path),
            Wanted::ToSend => Action::ReadToSend(path),
        }
    }
}

impl Question {
    /// Asks for a link.
    pub fn link() -> Question {
        Question::Link(TextField::default())
    }

    /// Asks for an image.
    pub fn image(directory: &Path) -> Question {
        let directory = directory.to_path_buf();
        Question::File { purpose: Purpose::Image, typed: TextField::default(), directory, complaint: None }
    }

    /// Asks for another file, and suggests a name for a new one.
    pub fn file(purpose: Purpose, view: &View) -> Question {
        let typed = match purpose {
            Purpose::Image => TextField::default(),
            Purpose::ExportStream => TextField::new(suggested(view, "stream", view.monitor.stream.newest, "csv")),
            Purpose::ExportDictionary => {
                let at = view.dictionary.as_ref().map(|read| read.at);
                TextField::new(suggested(view, "dictionary", at, "json"))
            }
        };
        Question::File { purpose, typed, directory: PathBuf::new(), complaint: None }
    }

    /// Asks for a file that is there, beginning in a folder that has to be read.
    pub fn choose(wanted: Wanted, directory: &Path) -> Question {
        let offers = match wanted {
            Wanted::Dump => Offers::Dumps,
            Wanted::ToSend => Offers::Anything,
        };
        let mut picker = Picker::new(offers, directory.to_path_buf());
        picker.list(directory.to_path_buf());
        Question::Choose { wanted, picker, typed: TextField::default() }
    }

    /// Asks for words to look for, those of the last time given.
    pub fn find(words: &str) -> Question {
        Question::Find(TextField::new(words))
    }

    /// Asks for the temperature of an emulated unit's sensor.
    pub fn temperature(input: usize) -> Question {
        Question::Temperature { input, typed: TextField::default(), complaint: None }
    }

    /// Asks for an order to an emulated unit.
    pub fn order() -> Question {
        Question::Order { typed: TextField::default(), complaint: None }
    }

    /// Asks what the stream shall send; what it has sent last is suggested.
    pub fn stream(view: &View) -> Question {
        let stream = &view.monitor.stream;
        let millis =
            stream.period_set().or(view.last_period).map_or(USUAL_PERIOD_MS, |period| period.as_millis() as u64);
        Question::Stream {
            source: stream.source.unwrap_or(Source::FieldValue),
            millis: TextField::new(millis.to_string()),
            is_suggested: true,
            complaint: None,
        }
    }

    /// Asks in spite of which of these errors an image shall be sent.
    pub fn allow(errors: Vec<DefectId>) -> Question {
        Question::Allow { typed: TextField::default(), errors, complaint: None }
    }

    /// Asks for what an upload still needs, or starts it where that is nothing.
    pub fn start_load(view: &View, facts: &ImageFacts) -> Action {
        let in_loader = view.facts.state == UnitState::Loader;
        if view.needs_label() {
            let image = facts.product.clone();
            return Action::Ask(Question::Label { typed: TextField::default(), image, in_loader, complaint: None });
        }
        Question::then_password(in_loader, None)
    }

    /// The password is asked for, but not for a loader, which wants none.
    fn then_password(in_loader: bool, product: Option<String>) -> Action {
        match in_loader {
            true => Action::StartLoad { password: None, product },
            false => Action::Ask(Question::Password { field: PasswordField::new(), product, complaint: None }),
        }
    }

    /// Whether the answer is for the unit that it was asked about.
    pub fn is_about_unit(&self) -> bool {
        match self {
            Question::SendFile { .. }
            | Question::Stream { .. }
            | Question::View
            | Question::Defaults { .. }
            | Question::Label { .. }
            | Question::Password { .. }
            | Question::CancelLoad
            | Question::Paste(_) => true,
            Question::Link(_)
            | Question::File { .. }
            | Question::Choose { .. }
            | Question::Find(_)
            | Question::Temperature { .. }
            | Question::Order { .. }
            | Question::Allow { .. }
            | Question::Disconnect { .. }
            | Question::Quit => false,
        }
    }

    fn on(&mut self, key: KeyEvent) -> Answer {
        let with_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Esc => self.leave(),
            KeyCode::Char('c') if with_ctrl => self.leave(),
            KeyCode::Char('u') if with_ctrl => {
                self.clear();
                self.changed()
            }
            // The Enter behind its path may come twice, and records are keys to a unit in its menu: only Y sends them.
            KeyCode::Enter if matches!(self, Question::SendFile { is_image: true, .. }) => Answer::Stay,
            KeyCode::Enter => self.accept(),
            // Nothing is left of what was typed: as in the list of the load screen.
            KeyCode::Backspace if self.is_untyped_choice() => self.move_in_list(Cmd::Back),
            KeyCode::Up => self.move_in_list(Cmd::Up),
            KeyCode::Down => self.move_in_list(Cmd::Down),
            KeyCode::PageUp => self.move_in_list(Cmd::PageUp),
            KeyCode::PageDown => self.move_in_list(Cmd::PageDown),
            KeyCode::Home => self.move_in_list(Cmd::First),
            KeyCode::End => self.move_in_list(Cmd::Last),
            KeyCode::Backspace => {
                self.pop();
                self.changed()
            }
            KeyCode::Char(character) if !with_ctrl && !key.modifiers.contains(KeyModifiers::ALT) => {
                self.typed(character)
            }
            _ => Answer::Stay,
        }
    }

    fn is_untyped_choice(&self) -> bool {
        matches!(self, Question::Choose { typed, .. } if typed.text().is_empty())
    }

    /// Moves in the list of files, where there is one.
    fn move_in_list(&mut self, cmd: Cmd) -> Answer {
        let Question::Choose { picker, .. } = self else { return Answer::Stay };
        let picked = picker.on(cmd, PAGE);
        self.picked(picked)
    }

    fn picked(&self, picked: Option<Picked>) -> Answer {
        match (picked, self) {
            (Some(Picked::Folder(directory)), _) => Answer::Meanwhile(Action::ListFiles(directory)),
            (Some(Picked::File(path)), Question::Choose { wanted, .. }) => Answer::Act(wanted.action(path)),
            _ => Answer::Stay,
        }
    }

    /// Esc. Who has looked for something and leaves wants to see everything again.
    fn leave(&self) -> Answer {
        match self {
            Question::Find(_) => Answer::Act(Action::Find(String::new())),
            _ => Answer::Close,
        }
    }

    /// The field has changed.
    fn changed(&self) -> Answer {
        match self {
            Question::Find(field) => Answer::Meanwhile(Action::Find(field.text().to_owned())),
            _ => Answer::Stay,
        }
    }

    /// Enter.
    fn accept(&mut self) -> Answer {
        match self {
            Question::Link(field) if field.text().trim().is_empty() => Answer::Stay,
            Question::Link(field) => Answer::Act(Action::Open(field.text().trim().to_owned())),
            Question::File { typed, .. } if typed.text().trim().is_empty() => Answer::Stay,
            Question::File { purpose, typed, directory, .. } => {
                let path = placed(directory, typed.text());
                match purpose {
                    // A name typed wrong is mended here: the box goes when the file has been read.
                    Purpose::Image => Answer::Meanwhile(Action::CheckImage(path)),
                    Purpose::ExportStream => Answer::Act(Action::ExportStream(path)),
                    Purpose::ExportDictionary => Answer::Act(Action::ExportDictionary(path)),
                }
            }
            Question::Choose { picker, typed, .. } if typed.text().trim().is_empty() => {
                let picked = picker.on(Cmd::Accept, PAGE);
                self.picked(picked)
            }
            Question::Choose { wanted, picker, typed } => {
                Answer::Act(wanted.action(placed(picker.directory(), typed.text())))
            }
            Question::Find(_) => Answer::Close,
            Question::Temperature { input, typed, complaint } => match typed.text().trim().parse::<f64>() {
                Ok(value) if value.is_finite() => {
                    Answer::Act(Action::Order(format!("set {input} temperature {value}")))
                }
                _ => {
                    *complaint = Some("A number of degrees, e.g. 451.5.");
                    Answer::Stay
                }
            },
            Question::Order { typed, .. } if typed.text().trim().is_empty() => Answer::Stay,
            Question::Order { typed, complaint } => match typed.text().trim() {
                // The emulator's own help is made for a page, not for a line of answers.
                text if text.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("help")) => {
                    *complaint = Some("They stand above; docs/emulator.md has all, with every fault.");
                    Answer::Stay
                }
                text => Answer::Act(Action::Order(text.to_owned())),
            },
            Question::Stream { source, millis, complaint, .. } => match millis.text().parse() {
                Ok(number @ SHORTEST_PERIOD_MS..=LONGEST_PERIOD_MS) => {
                    let period = Duration::from_millis(number);
                    Answer::Act(Action::Command(Command::StreamOn { source: *source, period }))
                }
                _ => {
                    *complaint = Some("A whole number of milliseconds from 1 to 60000.");
                    Answer::Stay
                }
            },
            Question::View => Answer::Act(Action::Command(Command::ReadDictionary)),
            Question::Defaults { typed, .. } if typed.text() == YES => {
                Answer::Act(Action::Command(Command::RestoreDefaults))
            }
            Question::Defaults { complaint, .. } => {
                *complaint = Some("Only the word Yes, written like this, starts it.");
                Answer::Stay
            }
            Question::Allow { typed, .. } if typed.text().trim().is_empty() => Answer::Stay,
            Question::Allow { typed, errors, complaint } => {
                let named = errors.iter().find(|error| error.name() == typed.text().trim());
                *complaint = Some(match named {
                    Some(error) if error.can_be_allowed() => return Answer::Act(Action::Allow(*error)),
                    Some(_) => "It leaves part of the program unknown: there is nothing to send.",
                    None => "No such error stands in the findings.",
                });
                Answer::Stay
            }
            Question::Label { typed, image, in_loader, complaint } => {
                let label = typed.text().trim().to_owned();
                if label.is_empty() {
                    *complaint = Some("The part number is missing.");
                    return Answer::Stay;
                }
                if image.as_ref().is_some_and(|image| !image.eq_ignore_ascii_case(&label)) {
                    *complaint = Some("The file is for another product: it must not be sent to this unit.");
                    return Answer::Stay;
                }
                Answer::Act(Question::then_password(*in_loader, Some(label)))
            }
            Question::Password { field, complaint, .. } if field.is_empty() => {
                *complaint = Some("The password is missing: without it the unit does not go into its loader.");
                Answer::Stay
            }
            Question::Password { field, product, .. } => {
                Answer::Act(Action::StartLoad { password: Some(field.secret()), product: product.take() })
            }
            Question::CancelLoad => Answer::Act(Action::Command(Command::Cancel)),
            Question::Paste(bytes) => Answer::Act(Action::Command(Command::Keys(std::mem::take(bytes)))),
            Question::SendFile { name, bytes, .. } => {
                Answer::Act(Action::SendFile { name: std::mem::take(name), bytes: std::mem::take(bytes) })
            }
            Question::Disconnect { then } => Answer::Act(Action::Disconnect { then: then.take() }),
            Question::Quit => Answer::Act(Action::Quit),
        }
    }

    fn typed(&mut self, character: char) -> Answer {
        match self {
            Question::Link(field) | Question::Choose { typed: field, .. } => field.push(character),
            Question::File { typed: field, complaint, .. } => {
                *complaint = None;
                field.push(character);
            }
            Question::Find(field) => {
                field.push(character);
                return self.changed();
            }
            Question::Defaults { typed: field, complaint }
            | Question::Label { typed: field, complaint, .. }
            | Question::Allow { typed: field, complaint, .. }
            | Question::Temperature { typed: field, complaint, .. }
            | Question::Order { typed: field, complaint } => {
                *complaint = None;
                field.push(character);
            }
            Question::Stream { source, millis, is_suggested, complaint } => match character.to_ascii_lowercase() {
                'f' => *source = Source::FieldValue,
                'p' => *source = Source::ProcessValue,
                '0'..='9' if std::mem::take(is_suggested) => *millis = TextField::new(character),
                '0'..='9' if millis.text().len() < LONGEST_PERIOD_MS.to_string().len() => {
                    *complaint = None;
                    millis.push(character);
                }
                _ => {}
            },
            Question::Password { field, complaint, .. } => {
                *complaint = None;
                field.push(character);
            }
            Question::View if character.eq_ignore_ascii_case(&'t') => return Answer::Act(Action::ViewDictionary),
            Question::SendFile { is_image: true, .. } if character.eq_ignore_ascii_case(&'l') => {
                return Answer::Act(Action::Go(ScreenId::Load));
            }
            // Whoever types on without looking must not close them: the rest would be keys to the unit.
            Question::Paste(_) | Question::SendFile { .. } if !character.eq_ignore_ascii_case(&'y') => {}
            Question::View
            | Question::CancelLoad
            | Question::Paste(_)
            | Question::SendFile { .. }
            | Question::Disconnect { .. }
            | Question::Quit => match character.to_ascii_lowercase() {
                'y' => return self.accept(),
                'n' => return Answer::Close,
                _ => {}
            },
        }
        Answer::Stay
    }

    fn pop(&mut self) {
        match self {
            Question::Password { field, .. } => field.pop(),
            _ => {
                if let Some(field) = self.field() {
                    field.pop();
                }
            }
        }
    }

    fn clear(&mut self) {
        match self {
            Question::Password { field, .. } => field.clear(),
            _ => {
                if let Some(field) = self.field() {
                    field.clear();
                }
            }
        }
    }

    /// The plain field, if the question has one.
    fn field(&mut self) -> Option<&mut TextField> {
        match self {
            Question::Stream { millis, is_suggested, .. } => {
                *is_suggested = false;
                Some(millis)
            }
            Question::Link(field)
            | Question::File { typed: field, .. }
            | Question::Choose { typed: field, .. }
            | Question::Find(field)
            | Question::Order { typed: field, .. }
            | Question::Temperature { typed: field, .. }
            | Question::Defaults { typed: field, .. }
            | Question::Allow { typed: field, .. }
            | Question::Label { typed: field, .. } => Some(field),
            Question::Password { .. }
            | Question::View
            | Question::CancelLoad
            | Question::Paste(_)
            | Question::SendFile { .. }
            | Question::Disconnect { .. }
            | Question::Quit => None,
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

/// What cancelling the upload in this phase leaves behind.
pub fn consequence(phase: Option<Phase>) -> &'static str {
    match phase {
        None | Some(Phase::Check) => "Nothing has been changed yet: the unit goes on with what it has.",
        Some(Phase::EnterLoader) => {
            "The unit is on its way into its loader. It may wait there until a complete file has been sent."
        }
        Some(Phase::Erase | Phase::Transfer | Phase::Finish) => {
            "The unit's software is incomplete then. It waits in its loader, without scanning and without CAN, until a \
             complete file has been sent. It is not harmed by that."
        }
        Some(Phase::Verify) => {
            "The file has been sent completely. Only the proof is missing: without it nobody knows what the unit runs."
        }
    }
}
