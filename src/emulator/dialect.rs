//! How this unit words its prose.
//!
//! The manuals fix the keys, a few quoted strings and the stream rows; their pictures of banner, menu, prompts and
//! pages are lost (errata E-99). So every sentence here is invented, and nothing outside this file may invent one. A
//! console that depends on a wording of this file is wrong: other dialects will be drawn from a seed.

use std::fmt::Write;

use super::memory::Parameters;
use crate::image::Identity;
use crate::time::Duration;
use crate::wire::stream::Source;

/// One way of wording things.
#[derive(Clone, Debug)]
pub struct Dialect {
    phrases: Phrases,
}

/// Sentences without numbers in them.
#[derive(Clone, Debug)]
struct Phrases {
    menu_title: &'static str,
    menu: [&'static str; 5],
    ask_source: &'static str,
    ask_defaults: &'static str,
    ask_password: &'static str,
    cancelled: &'static str,
    stream_off: &'static str,
    bad_period: &'static str,
    defaults_restored: &'static str,
    wrong_password: &'static str,
    right_password: &'static str,
    view_refused: &'static str,
    view_title: &'static str,
    view_next: &'static str,
    view_end: &'static str,
    diagnostics_on: &'static str,
    diagnostics_off: &'static str,
}

/// Sentences the firmware picks from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sentence {
    /// Prompt: field value or process value.
    AskSource,
    /// Prompt: restore defaults.
    AskDefaults,
    /// Prompt: password for new software.
    AskPassword,
    /// A prompt has been left without an answer, or with one that means no.
    Cancelled,
    /// The stream has been switched off.
    StreamOff,
    /// The repetition rate is none.
    BadPeriod,
    /// Defaults are restored, the reset follows.
    DefaultsRestored,
    /// The password is wrong.
    WrongPassword,
    /// The password is right, the reset follows.
    RightPassword,
    /// The view works in pre-operational state only.
    ViewRefused,
    /// Head of the view, with the warning of the manual.
    ViewTitle,
    /// How to get to the next object, or out.
    ViewNext,
    /// The view has ended.
    ViewEnd,
    /// Diagnostics have been switched on.
    DiagnosticsOn,
    /// Diagnostics have been switched off.
    DiagnosticsOff,
}

/// State of the CANopen node (DS-301).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkState {
    /// After power-up; SDO only.
    PreOperational,
    /// With process data.
    Operational,
    /// Nothing but node control.
    Stopped,
}

/// One line of the view: an object or an entry of one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ViewLine {
    /// Index and name.
    Object(u16, &'static str),
    /// Sub-index, name and value.
    Entry(u8, String, String),
}

/// What a diagnostics page shows.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Supply voltage in V.
    pub supply: f64,
    /// Cold junction in °C.
    pub cold_junction: f64,
    /// For each channel its field value as the stream prints it, and its raw reading in µV.
    pub channels: Vec<(String, i32)>,
    /// Channels in error.
    pub errors: usize,
    /// Time since the start.
    pub uptime: Duration,
    /// State of the node.
    pub network: NetworkState,
}

impl Dialect {
    /// The wording units have unless told otherwise.
    pub fn plain() -> Self {
        Dialect {
            phrases: Phrases {
                menu_title: "Main Menu",
                menu: [
                    "V - View Object Dictionary",
                    "D - Default Object Dictionary",
                    "T - Toggle RS-232 Stream On/Off",
                    "S - Show/Stop Diagnostics",
                    "L - Load New Software",
                ],
                ask_source: "Send (F)ield Value or (P)rocess Value? ",
                ask_defaults: "Restore the default object dictionary? Enter Yes to confirm: ",
                ask_password: "Password: ",
                cancelled: "Cancelled.",
                stream_off: "RS-232 stream is now OFF.",
                bad_period: "Not a repetition rate from 1 to 60000 ms. Nothing changed.",
                defaults_restored: "Defaults restored. Resetting...",
                wrong_password: "Wrong password.",
                right_password: "Resetting to load new software...",
                view_refused: "The object dictionary can be viewed in Pre-Operational state only.",
                view_title: "Object Dictionary (scanning and CAN are halted)",
                view_next: "<Enter> next object, <X> exit",
                view_end: "End of view. Scanning and CAN resumed.",
                diagnostics_on: "Diagnostics ON.",
                diagnostics_off: "Diagnostics OFF.",
            },
        }
    }

    /// Printed once when the application starts.
    pub fn banner(&self, identity: &Identity, title: &str) -> String {
        let Identity { product, version, build_date, build_time, .. } = identity;
        format!(
            "\r\nAxiomatic Technologies Corporation\r\n\
             {product} - {title}\r\n\
             Software Version V{version}, built {build_date} {build_time}\r\n\r\n"
        )
    }

    /// The main menu with the basic values of the network (AXTC4CO manual, section 4.1).
    pub fn menu(&self, identity: &Identity, parameters: &Parameters, network: NetworkState) -> String {
        let mut text = format!("\r\n{} - {} V{}\r\n", self.phrases.menu_title, identity.product, identity.version);
        for item in self.phrases.menu {
            let _ = write!(text, "  {item}\r\n");
        }
        let Parameters { node_id, kbps, .. } = parameters;
        let _ = write!(
            text,
            "CANopen: Node-ID {node_id} (0x{node_id:02X}), Baud Rate {kbps} kbit/s, State {}\r\n",
            self.network_state(network)
        );
        text
    }

    /// A sentence. Prompts have no line end: the answer is echoed behind them.
    pub fn sentence(&self, sentence: Sentence) -> String {
        let phrases = &self.phrases;
        let line = |phrase: &str| format!("\r\n{phrase}\r\n");
        let prompt = |phrase: &str| format!("\r\n{phrase}");
        match sentence {
            Sentence::AskSource => prompt(phrases.ask_source),
            Sentence::AskDefaults => prompt(phrases.ask_defaults),
            Sentence::AskPassword => prompt(phrases.ask_password),
            Sentence::Cancelled => line(phrases.cancelled),
            Sentence::StreamOff => line(phrases.stream_off),
            Sentence::BadPeriod => line(phrases.bad_period),
            Sentence::DefaultsRestored => line(phrases.defaults_restored),
            Sentence::WrongPassword => line(phrases.wrong_password),
            Sentence::RightPassword => line(phrases.right_password),
            Sentence::ViewRefused => line(phrases.view_refused),
            Sentence::ViewTitle => line(phrases.view_title),
            Sentence::ViewNext => line(phrases.view_next),
            Sentence::ViewEnd => line(phrases.view_end),
            Sentence::DiagnosticsOn => line(phrases.diagnostics_on),
            Sentence::DiagnosticsOff => line(phrases.diagnostics_off),
        }
    }

    /// Prompt: repetition rate; an empty answer takes the default.
    pub fn ask_period(&self, default_ms: u16) -> String {
        format!("\r\nRepetition rate in ms (1-60000) [{default_ms}]: ")
    }

    /// The stream has been switched on.
    pub fn stream_on(&self, source: Source, period_ms: u16) -> String {
        let value = match source {
            Source::FieldValue => "Field Value",
            Source::ProcessValue => "Process Value",
        };
        format!("\r\nRS-232 stream is now ON: {value} every {period_ms} ms.\r\n")
    }

    /// A line of the view.
    pub fn view_line(&self, line: &ViewLine) -> String {
        match line {
            ViewLine::Object(index, name) => format!("{index:04X}h {name}\r\n"),
            ViewLine::Entry(sub, name, value) => format!("  {sub:02X}h {name:<32} = {value}\r\n"),
        }
    }

    /// A page of diagnostics.
    pub fn diagnostics(&self, diagnosis: &Diagnosis) -> String {
        let seconds = diagnosis.uptime.as_secs();
        let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
        let mut text = format!(
            "\r\nDiagnostics                 up {hours}:{minutes:02}:{seconds:02}\r\n\
             Supply Voltage             {:8.2} V\r\n\
             Cold Junction              {:8.3} C\r\n",
            diagnosis.supply, diagnosis.cold_junction
        );
        for (position, (value, microvolts)) in diagnosis.channels.iter().enumerate() {
            let _ = write!(text, "TC{} {value} C   raw {microvolts:7} uV\r\n", position + 1);
        }
        let _ = write!(
            text,
            "Active Errors              {:8}\r\nCAN State                  {}\r\n",
            diagnosis.errors,
            self.network_state(diagnosis.network)
        );
        text
    }

    fn network_state(&self, state: NetworkState) -> &'static str {
        match state {
            NetworkState::PreOperational => "Pre-Operational",
            NetworkState::Operational => "Operational",
            NetworkState::Stopped => "Stopped",
        }
    }
}
