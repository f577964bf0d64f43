//! What keys and pasted text do to what stands in front of a screen.

use std::path::PathBuf;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::{LONGEST_PERIOD_MS, Popup, Purpose, Question, SHORTEST_PERIOD_MS, Wanted};
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
    /// nothing: who pastes a text that begins with a Y has not said yes.
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
    fn on(&mut self, key: KeyEvent) -> Answer {
        let with_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Esc => self.leave(),
            KeyCode::Char('c') if with_ctrl => self.leave(),
            _ if self.is_on_its_way() => Answer::Stay,
            KeyCode::Char('u') if with_ctrl => {
                self.edit(TextField::clear, PasswordField::clear);
                self.changed()
            }
            // Pressed out of habit, or twice behind a path, it destroys nothing: where only Y is named, only Y is meant.
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
                | Question::Begun { .. }
                | Question::Paste { .. }
                | Question::SendFile { .. }
                | Question::Disconnect { .. }
                | Question::Quit
        )
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

    /// Enter, or Y.
    fn accept(&mut self) -> Answer {
        match self {
            Question::Link(field) if field.text().trim().is_empty() => Answer::Stay,
            Question::Link(field) => Answer::Act(Action::Open(field.text().trim().to_owned())),
            Question::File { typed, .. } if typed.text().trim().is_empty() => Answer::Stay,
            Question::File { purpose, typed, directory, complaint, .. } => {
                let path = placed(directory, typed.text());
                *complaint = None;
                match purpose {
                    // A name typed wrong is mended here: the box goes when the file has been read.
                    Purpose::Image => Answer::Meanwhile(Action::CheckImage(path)),
                    Purpose::ExportStream => Answer::Meanwhile(Action::ExportStream(path)),
                    Purpose::ExportDictionary => Answer::Meanwhile(Action::ExportDictionary(path)),
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
            Question::Temperature { input, typed, complaint, sent } => match typed.text().trim().parse::<f64>() {
                Ok(value) if value.is_finite() => {
                    let line = format!("set {input} temperature {value}");
                    *sent = Some(line.clone());
                    Answer::Meanwhile(Action::Order(line))
                }
                _ => {
                    *complaint = Some("A number of degrees, e.g. 451.5.".to_owned());
                    Answer::Stay
                }
            },
            Question::Order { typed, .. } if typed.text().trim().is_empty() => Answer::Stay,
            Question::Order { typed, complaint, sent } => match typed.text().trim() {
                // The emulator's own help is made for a page, not for a line of answers.
                text if text.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("help")) => {
                    *complaint = Some("They stand above; docs/emulator.md has all, with every fault.".to_owned());
                    // What is typed next is the order that was looked for.
                    typed.clear();
                    Answer::Stay
                }
                text => {
                    *sent = Some(text.to_owned());
                    Answer::Meanwhile(Action::Order(text.to_owned()))
                }
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
            Question::Allow { errors, cursor, complaint } => match errors.get(*cursor) {
                Some(error) if error.can_be_allowed() => Answer::Act(Action::Allow(*error)),
                _ => {
                    *complaint = Some("It leaves part of the program unknown: there is nothing to send.");
                    Answer::Stay
                }
            },
            Question::Begun { noted, in_loader } => {
                Answer::Act(Question::then_password(*in_loader, Some(noted.product.clone())))
            }
            Question::Label { typed, image, in_loader, complaint } => {
                let label = typed.text().trim();
                // Noted and compared as the product is written, however it is typed.
                let known = Product::named(label).map(|product| product.name.as_str());
                let of_image = image.as_deref().filter(|image| image.eq_ignore_ascii_case(label));
                *complaint = Some(match known.or(of_image) {
                    _ if label.is_empty() => "The part number is missing.".to_owned(),
                    None => {
                        let names: Vec<&str> = Product::all().iter().map(|product| product.name.as_str()).collect();
                        format!("There is no such product. Those there are: {}.", names.join(", "))
                    }
                    Some(_) if image.is_some() && of_image.is_none() => {
                        "The file is for another product: it must not be sent to this unit.".to_owned()
                    }
                    Some(name) => return Answer::Act(Question::then_password(*in_loader, Some(name.to_owned()))),
                });
                Answer::Stay
            }
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
                '0'..='9' if std::mem::take(is_suggested) => *millis = TextField::new(character),
                '0'..='9' if millis.text().len() < LONGEST_PERIOD_MS.to_string().len() => {
                    self.edit(|field| field.push(character), |_| {});
                }
                _ => {}
            },
            // Only the key that is named: what is typed here may be a password, for which nothing has asked.
            Question::Allow { .. } if character == ' ' => return self.accept(),
            Question::Allow { .. } => {}
            Question::Begun { .. } if character.eq_ignore_ascii_case(&'n') => return Answer::Act(Action::OtherUnit),
            Question::View if character.eq_ignore_ascii_case(&'t') => return Answer::Act(Action::ViewDictionary),
            Question::SendFile { is_image: true, .. } if character.eq_ignore_ascii_case(&'l') => {
                return Answer::Act(Action::Go(ScreenId::Load));
            }
            // Whoever types on without looking must not close them: the rest would be keys to the unit.
            Question::Paste { .. } | Question::SendFile { .. } if !character.eq_ignore_ascii_case(&'y') => {}
            _ if self.has_field() => {
                self.edit(|field| field.push(character), |field| field.push(character));
                return self.changed();
            }
            _ => match character.to_ascii_lowercase() {
                'y' => return self.accept(),
                'n' => return Answer::Close,
                _ => {}
            },
        }
        Answer::Stay
    }

    /// Changes what has been typed. What was wrong with it was wrong with what it was.
    fn edit(&mut self, text: impl FnOnce(&mut TextField), password: impl FnOnce(&mut PasswordField)) {
        match self {
            Question::Link(field) | Question::Choose { typed: field, .. } | Question::Find(field) => text(field),
            Question::File { typed: field, complaint, .. } => {
                *complaint = None;
                text(field);
            }
            Question::Order { typed: field, complaint, .. } | Question::Temperature { typed: field, complaint, .. } => {
                *complaint = None;
                text(field);
            }
            Question::Defaults { typed: field, complaint } => {
                *complaint = None;
                text(field);
            }
            Question::Label { typed: field, complaint, .. } => {
                *complaint = None;
                text(field);
            }
            Question::Stream { millis, is_suggested, complaint, .. } => {
                (*is_suggested, *complaint) = (false, None);
                text(millis);
            }
            Question::Password { field, complaint, .. } => {
                *complaint = None;
                password(field);
            }
            Question::View
            | Question::Allow { .. }
            | Question::Begun { .. }
            | Question::CancelLoad
            | Question::Paste { .. }
            | Question::SendFile { .. }
            | Question::Disconnect { .. }
            | Question::Quit => {}
        }
    }

    /// Whether something is typed here.
    fn has_field(&self) -> bool {
        match self {
            Question::Link(_)
            | Question::File { .. }
            | Question::Choose { .. }
            | Question::Find(_)
            | Question::Temperature { .. }
            | Question::Order { .. }
            | Question::Stream { .. }
            | Question::Defaults { .. }
            | Question::Label { .. }
            | Question::Password { .. } => true,
            Question::View
            | Question::Allow { .. }
            | Question::Begun { .. }
            | Question::CancelLoad
            | Question::Paste { .. }
            | Question::SendFile { .. }
            | Question::Disconnect { .. }
            | Question::Quit => false,
        }
    }
}
