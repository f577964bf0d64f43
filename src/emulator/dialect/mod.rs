//! How this unit words its prose.
//!
//! The manuals fix the keys, a few quoted strings and the stream rows; their pictures of banner, menu, prompts and pages
//! are lost (errata E-99). So every sentence here is invented, and nothing outside this folder may invent one. A console
//! that depends on a wording of this folder is wrong: [`Dialect::drawn`] words everything another way for each seed,
//! within what the manuals fix. What there is to draw from is in `phrases`, how the object dictionary is shown in `view`.

mod phrases;
mod view;

use std::fmt::Write;

use super::memory::Parameters;
use super::network::NetworkState;
use crate::image::Identity;
use crate::rng::Rng;
use crate::time::Duration;
use crate::wire::stream::Source;
use phrases::{BannerStyle, DiagnosticsStyle, MenuStyle, NetworkStyle, Phrases};
pub use view::ViewEntry;

/// One way of wording things.
#[derive(Clone, Debug)]
pub struct Dialect {
    phrases: Phrases,
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

/// What a diagnostics page shows.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Quantities of the unit as a whole.
    pub unit: Vec<Quantity>,
    /// Channels.
    pub channels: Vec<ChannelDiagnosis>,
    /// Active errors.
    pub errors: usize,
    /// Time since the start.
    pub uptime: Duration,
    /// State of the node.
    pub network: NetworkState,
}

/// A quantity with its unit.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Decimal places.
    pub decimals: usize,
    /// Its unit.
    pub unit: &'static str,
}

/// What a diagnostics page shows of a channel.
#[derive(Clone, Debug)]
pub struct ChannelDiagnosis {
    /// Its name, e.g. `TC1`.
    pub name: String,
    /// Its field value as the stream prints it.
    pub field_value: String,
    /// Process value.
    pub process_value: i64,
    /// Status, object 6150h.
    pub status: u8,
    /// Raw reading in µV.
    pub microvolts: i64,
    /// Resistance in ohm, of an RTD.
    pub ohm: Option<f64>,
}

impl Dialect {
    /// The wording units have unless told otherwise.
    pub fn plain() -> Self {
        Dialect { phrases: Phrases::plain() }
    }

    /// Another wording for each seed; 0 is the plain one.
    pub fn drawn(seed: u64) -> Self {
        if seed == 0 {
            return Dialect::plain();
        }
        Dialect { phrases: Phrases::drawn(&mut Rng::new(seed).fork("dialect")) }
    }

    /// What lines end with.
    pub fn line_end(&self) -> &'static str {
        self.phrases.line_end
    }

    /// Whether the characters of an answer come back.
    pub fn echoes(&self) -> bool {
        self.phrases.echo
    }

    /// Whether the question for the stream's source wants Enter after its key.
    pub fn source_wants_enter(&self) -> bool {
        self.phrases.source.wants_enter
    }

    /// The source a key means at its question.
    pub fn source_of(&self, key: u8) -> Option<Source> {
        let key = key.to_ascii_lowercase();
        let source = self.phrases.source;
        (key == source.field_value)
            .then_some(Source::FieldValue)
            .or((key == source.process_value).then_some(Source::ProcessValue))
    }

    /// Printed once when the application starts. Product name and a version like `V1.2.3` are the manual's.
    pub fn banner(&self, identity: &Identity, title: &str) -> String {
        let Identity { product, version, build_date, build_time, .. } = identity;
        let text = match self.phrases.banner {
            BannerStyle::Plain => format!(
                "Axiomatic Technologies Corporation\r\n\
                 {product} - {title}\r\n\
                 Software Version V{version}, built {build_date} {build_time}"
            ),
            BannerStyle::OneLine => format!("{product} {title} V{version} ({build_date})"),
            BannerStyle::Boxed => {
                let rule = "*".repeat(48);
                format!(
                    "{rule}\r\n*  {product}\r\n*  {title}\r\n*  Version: V{version}   Built: {build_date} \
                     {build_time}\r\n{rule}"
                )
            }
            BannerStyle::VersionFirst => {
                format!("Firmware V{version}\r\nCompiled {build_date}, {build_time}\r\nDevice: {product} ({title})")
            }
            BannerStyle::Table => format!(
                "Product      : {product}\r\nDescription  : {title}\r\nSoftware     : V{version}\r\n\
                 Date         : {build_date}"
            ),
        };
        format!("\r\n{}\r\n\r\n", self.phrases.letters.of(&text))
    }

    /// The main menu with the basic values of the network (section 4.1).
    pub fn menu(&self, identity: &Identity, parameters: &Parameters, network: NetworkState) -> String {
        let phrases = &self.phrases;
        let mut text = String::from("\r\n");
        if phrases.title_names_product {
            let _ = write!(text, "{} - {} V{}\r\n", phrases.menu_title, identity.product, identity.version);
        } else if !phrases.menu_title.is_empty() {
            let _ = write!(text, "{}\r\n", phrases.menu_title);
        }
        if phrases.network_first {
            text.push_str(&self.network_lines(parameters, network));
        }
        for (key, item) in phrases::MENU {
            let line = match phrases.menu {
                MenuStyle::Dash => format!("  {key} - {item}"),
                MenuStyle::Brackets => format!("[{key}] {item}"),
                MenuStyle::InWord => format!(" ({key}){}", &item[1..]),
                MenuStyle::Equals => format!("{key} = {item}"),
                MenuStyle::Colon => format!("    {key}: {item}"),
                MenuStyle::Parenthesis => format!("{key}) {item}"),
            };
            text.push_str(&phrases.letters.of(&line));
            text.push_str("\r\n");
        }
        if !phrases.network_first {
            text.push_str(&self.network_lines(parameters, network));
        }
        text
    }

    fn network_lines(&self, parameters: &Parameters, network: NetworkState) -> String {
        let Parameters { node_id, kbps, .. } = parameters;
        let state = self.network_state(network);
        let text = match self.phrases.network {
            NetworkStyle::OneLine => {
                format!("CANopen: Node-ID {node_id} (0x{node_id:02X}), Baud Rate {kbps} kbit/s, State {state}")
            }
            NetworkStyle::Lines => format!("Node ID: 0x{node_id:02X}\r\nBaudrate: {kbps} kbps\r\nNMT state: {state}"),
            NetworkStyle::Hexadecimal => {
                format!("network: id={node_id:02X}h  {} bit/s  state={state}", u32::from(*kbps) * 1000)
            }
            NetworkStyle::Sentence => format!("Node {node_id} is {state} at {kbps} kbit/s"),
        };
        format!("{}\r\n", self.phrases.letters.of(&text))
    }

    /// A sentence. Prompts have no line end: the answer is echoed after them.
    pub fn sentence(&self, sentence: Sentence) -> String {
        let phrases = &self.phrases;
        let line = |phrase: &str| format!("\r\n{}\r\n", phrases.letters.of(phrase));
        let prompt = |phrase: &str| format!("\r\n{phrase}");
        match sentence {
            Sentence::AskSource => prompt(phrases.source.question),
            Sentence::AskDefaults => prompt(phrases.ask_defaults),
            Sentence::AskPassword => prompt(phrases.ask_password),
            Sentence::Cancelled => line(phrases.cancelled),
            Sentence::StreamOff => line(phrases.stream_off),
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
    pub fn ask_period(&self, (shortest, longest): (u16, u16), default_ms: u16) -> String {
        let question = self.phrases.ask_period;
        let question = question.replace("{low}", &shortest.to_string()).replace("{high}", &longest.to_string());
        format!("\r\n{}", question.replace("{default}", &default_ms.to_string()))
    }

    /// What was typed is not a repetition rate.
    pub fn bad_period(&self, (shortest, longest): (u16, u16)) -> String {
        format!("\r\nInvalid rate: not {shortest} to {longest} ms. Nothing changed.\r\n")
    }

    /// The stream has been switched on.
    pub fn stream_on(&self, source: Source, period_ms: u16) -> String {
        let value = match source {
            Source::FieldValue => "Field Value",
            Source::ProcessValue => "Process Value",
        };
        let text = format!("RS-232 stream is now ON: {value} every {period_ms} ms.");
        format!("\r\n{}\r\n", self.phrases.letters.of(&text))
    }

    /// A page of diagnostics.
    pub fn diagnostics(&self, diagnosis: &Diagnosis) -> String {
        let seconds = diagnosis.uptime.as_secs();
        let uptime = format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
        let style = self.phrases.diagnostics;
        let mut text = match style {
            DiagnosticsStyle::Plain => format!("\r\nDiagnostics                 up {uptime}\r\n"),
            DiagnosticsStyle::Repainted => format!("\x1b[2J\x1b[HDiagnostics   up {uptime}\r\n"),
            DiagnosticsStyle::Compact => String::from("\r\n"),
        };
        let compact = style == DiagnosticsStyle::Compact;
        for Quantity { name, value, decimals, unit } in &diagnosis.unit {
            let _ = if compact {
                write!(text, "{name}={value:.decimals$}{unit} ")
            } else {
                write!(text, "{name:<26} {value:8.decimals$} {unit}\r\n")
            };
        }
        if compact {
            text.push_str("\r\n");
        }
        for channel in &diagnosis.channels {
            let ChannelDiagnosis { name, field_value, process_value, status, microvolts, ohm } = channel;
            let ohm = ohm.filter(|ohm| ohm.is_finite());
            let _ = if compact {
                write!(text, "{name}: {} C, pv {process_value}, status {status:02X}h\r\n", field_value.trim())
            } else {
                let ohm = ohm.map(|ohm| format!("   {ohm:8.2} Ohm")).unwrap_or_default();
                write!(
                    text,
                    "{name} {field_value} C   raw {microvolts:7} uV{ohm}   PV {process_value:6}   status \
                     0x{status:02X}\r\n"
                )
            };
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
            NetworkState::PreOperational => self.phrases.pre_operational,
            NetworkState::Operational => "Operational",
            NetworkState::Stopped => "Stopped",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;
    use crate::version::Version;

    fn identity(product: &Product) -> Identity {
        Identity {
            product: product.name.clone(),
            version: Version::new(1, 2, 3),
            build_date: "2010-08-10".into(),
            build_time: "16:20:00".into(),
            program_words: 0,
            crc: 0,
        }
    }

    // B-129, B-184, B-182, B-130: what the manuals fix holds in every dialect.
    #[test]
    fn every_dialect_says_what_the_manuals_fix() {
        for product in Product::all() {
            let parameters = Parameters::factory(product);
            for seed in 0..500 {
                let dialect = Dialect::drawn(seed);
                let banner = dialect.banner(&identity(product), &product.title);
                assert!(
                    banner.to_uppercase().contains(&product.name) && banner.to_uppercase().contains("V1.2.3"),
                    "{banner}"
                );
                let menu = dialect.menu(&identity(product), &parameters, NetworkState::PreOperational);
                let lower = menu.to_lowercase();
                for (key, item) in phrases::MENU {
                    let rest = item[1..].to_lowercase();
                    assert!(lower.contains(&rest), "seed {seed}: {item} in {menu}");
                    assert!(menu.contains(key), "seed {seed}: {key}");
                }
                assert!(menu.contains("127") || lower.contains("7f"), "seed {seed}: {menu}");
                assert!(menu.contains("125"), "seed {seed}: {menu}");
                assert!(dialect.sentence(Sentence::AskDefaults).contains("Yes"), "seed {seed}");
                assert!(dialect.sentence(Sentence::AskPassword).to_lowercase().contains("pass"), "seed {seed}");
                let keys = [b'f', b'p', b'1', b'2'].map(|key| dialect.source_of(key));
                assert!(keys.contains(&Some(Source::FieldValue)) && keys.contains(&Some(Source::ProcessValue)));
                assert!(["\r\n", "\r", "\n"].contains(&dialect.line_end()));
            }
        }
    }

    #[test]
    fn dialects_differ_and_a_seed_is_one_dialect() {
        let product = &Product::all()[0];
        let all = |seed| {
            let dialect = Dialect::drawn(seed);
            let parameters = Parameters::factory(product);
            dialect.banner(&identity(product), &product.title)
                + &dialect.menu(&identity(product), &parameters, NetworkState::Operational)
                + &dialect.sentence(Sentence::AskSource)
        };
        let mut texts: Vec<String> = (0..200).map(all).collect();
        assert_eq!(texts[17], all(17));
        texts.sort();
        texts.dedup();
        assert!(texts.len() > 150, "{} of 200 differ", texts.len());
    }
}
