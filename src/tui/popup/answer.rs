//! What keys and pasted text do to what is in front of a screen.

use std::borrow::Cow;
use std::path::PathBuf;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::{Form, LONGEST_PERIOD_MS, NamedFor, PickedFor, Popup, Question, SHORTEST_PERIOD_MS, Sent};
use crate::device::Product;
use crate::session::Command;
use crate::time::Duration;
use crate::tui::action::Action;
use crate::tui::keymap::Cmd;
use crate::tui::picker::{Picked, placed};
use crate::tui::screens::ScreenId;
use crate::tui::widgets::field::{PasswordField, TextField};
use crate::wire::stream::Source;

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

/// Rows that a page key moves in a list of files.
const PAGE: usize = 8;
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

    /// Pasted text goes into a field as if it had been typed, up to its first line end. Where there is no field it answers
    /// nothing: pasting a text that begins with a Y is not saying yes.
    pub fn paste(&mut self, text: &str) -> Answer {
        let Popup::Asking(question) = self else { return Answer::Stay };
        if !question.has_field() {
            return Answer::Stay;
        }
        for character in text.chars().take_while(|character| !character.is_control()) {
            question.typed(character);
        }
        question.changed()
    }
}

impl PickedFor {
    /// What is to be done with the file.
    fn action(self, path: PathBuf) -> Action {
        match self {
            PickedFor::Dump => Action::Compare(path),
            PickedFor::ToSend => Action::ReadToSend(path),
        }
    }
}

impl Question {
    fn on(&mut self, key: KeyEvent) -> Answer {
        let with_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Esc => self.leave(),
            KeyCode::Char('c') if with_ctrl => self.leave(),
            // What was typed is on its way: what is typed meanwhile would be lost or done twice.
            _ if self.form().is_some_and(|form| form.sent.is_some()) => Answer::Stay,
            KeyCode::Char('u') if with_ctrl => {
                self.edit(TextField::clear, PasswordField::clear);
                self.changed()
            }
            // Pressed out of habit, or twice after a path, it destroys nothing: where only Y is named, only Y is meant.
            KeyCode::Enter if self.wants_y() => Answer::Stay,
            KeyCode::Enter => self.accept(),
            // Nothing is left of what was typed: as in the list of the load screen.
            KeyCode::Backspace if self.is_untyped_choice() => self.move_in_list(Cmd::Back),
            KeyCode::Up | KeyCode::Down if matches!(self, Question::Allow { .. }) => self.move_in_errors(key.code),
            KeyCode::Up => self.move_in_list(Cmd::Up),
            KeyCode::Down => self.move_in_list(Cmd::Down),
            KeyCode::PageUp => self.move_in_list(Cmd::PageUp),
            KeyCode::PageDown => self.move_in_list(Cmd::PageDown),
            KeyCode::Home => self.move_in_list(Cmd::First),
            KeyCode::End => self.move_in_list(Cmd::Last),
            KeyCode::Backspace => {
                self.edit(TextField::pop, PasswordField::pop);
                self.changed()
            }
            KeyCode::Char(character) if !with_ctrl && !key.modifiers.contains(KeyModifiers::ALT) => {
                self.typed(character)
            }
            _ => Answer::Stay,
        }
    }

    /// Whether it is answered by Y alone, because something is given up by that or goes to the unit unseen.
    fn wants_y(&self) -> bool {
        matches!(
            self,
            Question::CancelLoad
                | Question::Allow { .. }
                | Question::SameUnit { .. }
                | Question::Paste { .. }
                | Question::SendFile { .. }
                | Question::Disconnect { .. }
                | Question::Quit
        )
    }

    fn is_untyped_choice(&self) -> bool {
        matches!(self, Question::PickFile { form, .. } if form.typed.text().is_empty())
    }

    /// Moves in the list of files, where there is one.
    fn move_in_list(&mut self, cmd: Cmd) -> Answer {
        let Question::PickFile { picker, .. } = self else { return Answer::Stay };
        let picked = picker.on(cmd, PAGE);
        self.picked(picked)
    }

    /// Moves among the errors that may be allowed.
    fn move_in_errors(&mut self, code: KeyCode) -> Answer {
        if let Question::Allow { errors, cursor, complaint } = self {
            *complaint = None;
            *cursor = match code {
                KeyCode::Up => cursor.saturating_sub(1),
                _ => (*cursor + 1).min(errors.len().saturating_sub(1)),
            };
        }
        Answer::Stay
    }

    fn picked(&self, picked: Option<Picked>) -> Answer {
        match (picked, self) {
            (Some(Picked::Folder(directory)), _) => Answer::Meanwhile(Action::ListFiles(directory)),
            (Some(Picked::File(path)), Question::PickFile { purpose, .. }) => Answer::Act(purpose.action(path)),
            _ => Answer::Stay,
        }
    }

    /// Esc. A user who leaves a search wants to see everything again.
    fn leave(&self) -> Answer {
        match self {
            Question::Find(_) => Answer::Act(Action::Find(String::new())),
            _ => Answer::Close,
        }
    }

    /// The field has changed.
    fn changed(&self) -> Answer {
        match self {
            Question::Find(form) => Answer::Meanwhile(Action::Find(form.typed.text().to_owned())),
            _ => Answer::Stay,
        }
    }

    /// Enter, or Y.
    fn accept(&mut self) -> Answer {
        match self {
            Question::Link(form) | Question::FileName { form, .. } | Question::Order(form)
                if form.text().is_empty() =>
            {
                Answer::Stay
            }
            Question::Link(form) => Answer::Act(Action::Open(form.text().to_owned())),
            Question::FileName { purpose, form, directory } => {
                let path = placed(directory, form.typed.text());
                form.complaint = None;
                match purpose {
                    // A mistyped name can be corrected here: the box goes when the file has been read.
                    NamedFor::Image => Answer::Meanwhile(Action::CheckImage(path)),
                    NamedFor::ExportStream => Answer::Meanwhile(Action::ExportStream(path)),
                    NamedFor::ExportDictionary => Answer::Meanwhile(Action::ExportDictionary(path)),
                }
            }
            Question::PickFile { picker, form, .. } if form.text().is_empty() => {
                let picked = picker.on(Cmd::Accept, PAGE);
                self.picked(picked)
            }
            Question::PickFile { purpose, picker, form } => {
                Answer::Act(purpose.action(placed(picker.directory(), form.typed.text())))
            }
            Question::Find(_) => Answer::Close,
            Question::Temperature { input, form } => set_temperature(*input, form),
            Question::Order(form) => order(form),
            Question::Stream { source, millis, .. } => switch_stream_on(*source, millis),
            Question::View => Answer::Act(Action::Command(Command::ReadDictionary)),
            Question::Defaults(form) if form.typed.text() == YES => {
                Answer::Act(Action::Command(Command::RestoreDefaults))
            }
            Question::Defaults(form) => form.wrong("Only the word Yes, written like this, starts it."),
            Question::Allow { errors, cursor, complaint } => match errors.get(*cursor) {
                Some(error) if error.can_be_allowed() => Answer::Act(Action::Allow(*error)),
                _ => {
                    *complaint = Some("It leaves part of the program unknown: there is nothing to send.");
                    Answer::Stay
                }
            },
            Question::SameUnit { noted, in_loader } => {
                Answer::Act(Question::then_password(*in_loader, Some(noted.product.clone())))
            }
            Question::Label { form, image, in_loader } => match product_of_label(form.text(), image.as_deref()) {
                Ok(product) => Answer::Act(Question::then_password(*in_loader, Some(product))),
                Err(why) => form.wrong(why),
            },
            Question::Password { field, complaint, .. } if field.is_empty() => {
                *complaint = Some("The password is missing: without it the unit does not go into its loader.");
                Answer::Stay
            }
            Question::Password { field, product, .. } => {
                Answer::Act(Action::StartLoad { password: Some(field.secret()), product: product.take() })
            }
            Question::CancelLoad => Answer::Act(Action::Command(Command::Cancel)),
            Question::Paste { bytes, .. } => Answer::Act(Action::Command(Command::Keys(std::mem::take(bytes)))),
            Question::SendFile { name, bytes, .. } => {
                Answer::Act(Action::SendFile { name: std::mem::take(name), bytes: std::mem::take(bytes) })
            }
            Question::Disconnect { then } => Answer::Act(Action::Disconnect { then: then.take() }),
            Question::Quit => Answer::Act(Action::Quit),
        }
    }

    fn typed(&mut self, character: char) -> Answer {
        match self {
            Question::Stream { source, millis, is_suggested, .. } => match character.to_ascii_lowercase() {
                'f' => *source = Source::FieldValue,
                'p' => *source = Source::ProcessValue,
                '0'..='9' if std::mem::take(is_suggested) => *millis = Form::with(character),
                '0'..='9' if millis.typed.text().len() < LONGEST_PERIOD_MS.to_string().len() => {
                    self.edit(|field| field.push(character), |_| {});
                }
                _ => {}
            },
            // Only the key that is named: what is typed here may be a password, for which nothing has asked.
            Question::Allow { .. } if character == ' ' => return self.accept(),
            Question::Allow { .. } => {}
            Question::SameUnit { .. } if character.eq_ignore_ascii_case(&'n') => return Answer::Act(Action::OtherUnit),
            Question::View if character.eq_ignore_ascii_case(&'t') => return Answer::Act(Action::ViewDictionary),
            Question::SendFile { is_image: true, .. } if character.eq_ignore_ascii_case(&'l') => {
                return Answer::Act(Action::Go(ScreenId::Load));
            }
            // A user who types on without looking must not close them: the rest would be keys to the unit.
            Question::Paste { .. } | Question::SendFile { .. } if !character.eq_ignore_ascii_case(&'y') => {}
            _ => {
                if !self.has_field() {
                    return self.answered(character);
                }
                self.edit(|field| field.push(character), |field| field.push(character));
                return self.changed();
            }
        }
        Answer::Stay
    }

    /// A letter where nothing is typed.
    fn answered(&mut self, letter: char) -> Answer {
        match letter.to_ascii_lowercase() {
            'y' => self.accept(),
            'n' => Answer::Close,
            _ => Answer::Stay,
        }
    }

    /// Changes what has been typed.
    fn edit(&mut self, text: impl FnOnce(&mut TextField), password: impl FnOnce(&mut PasswordField)) {
        match self {
            Question::Password { field, complaint, .. } => {
                *complaint = None;
                return password(field);
            }
            Question::Stream { is_suggested, .. } => *is_suggested = false,
            _ => {}
        }
        if let Some(form) = self.form() {
            form.edit(text);
        }
    }

    /// Whether something is typed here.
    fn has_field(&mut self) -> bool {
        matches!(self, Question::Password { .. }) || self.form().is_some()
    }
}

impl Form {
    /// It stays, to be corrected.
    fn wrong(&mut self, why: impl Into<Cow<'static, str>>) -> Answer {
        self.refuse(why);
        Answer::Stay
    }

    /// This order goes to the emulated unit, whose answer the form awaits.
    fn send_order(&mut self, line: String) -> Answer {
        self.sent = Some(Sent::Order(line.clone()));
        Answer::Meanwhile(Action::Order(line))
    }
}

fn set_temperature(input: usize, form: &mut Form) -> Answer {
    match form.text().parse::<f64>() {
        Ok(value) if value.is_finite() => form.send_order(format!("set {input} temperature {value}")),
        _ => form.wrong("A number of degrees, e.g. 451.5."),
    }
}

fn order(form: &mut Form) -> Answer {
    let line = form.text().to_owned();
    // The emulator's own help is made for a page, not for a line of answers.
    if line.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("help")) {
        // What is typed next is the order that was looked for.
        form.typed.clear();
        return form.wrong("They are above; docs/emulator.md has all, with every fault.");
    }
    form.send_order(line)
}

fn switch_stream_on(source: Source, millis: &mut Form) -> Answer {
    match millis.text().parse() {
        Ok(number @ SHORTEST_PERIOD_MS..=LONGEST_PERIOD_MS) => {
            let period = Duration::from_millis(number);
            Answer::Act(Action::Command(Command::StreamOn { source, period }))
        }
        _ => millis.wrong("A whole number of milliseconds from 1 to 60000."),
    }
}

/// The product that a label names, as the product is written, however it is typed; `image` is what the file is for. Or why
/// the file must not be sent.
fn product_of_label(label: &str, image: Option<&str>) -> Result<String, Cow<'static, str>> {
    let known = Product::named(label).map(|product| product.name.as_str());
    let of_image = image.filter(|image| image.eq_ignore_ascii_case(label));
    match known.or(of_image) {
        _ if label.is_empty() => Err("The part number is missing.".into()),
        None => {
            let names: Vec<&str> = Product::all().iter().map(|product| product.name.as_str()).collect();
            Err(format!("There is no such product. Those there are: {}.", names.join(", ")).into())
        }
        Some(_) if image.is_some() && of_image.is_none() => {
            Err("The file is for another product: it must not be sent to this unit.".into())
        }
        Some(name) => Ok(name.to_owned()),
    }
}
