//! How this unit words its prose.
//!
//! The manuals fix the keys, a few quoted strings and the stream rows; their pictures of banner, menu, prompts and pages
//! are lost (errata E-99). So every sentence here is invented, and nothing outside this folder may invent one. A console
//! that depends on a wording of this folder is wrong: [`Dialect::drawn`] words everything another way for each seed,
//! within what the manuals fix. What there is to draw from is in `words`.

mod words;

use std::fmt::Write;

use super::memory::Parameters;
use super::network::NetworkState;
use crate::canopen::{DataType, Value};
use crate::device::dictionary::{Entry, Object, ObjectKind};
use crate::image::Identity;
use crate::rng::Rng;
use crate::time::Duration;
use crate::wire::stream::Source;
use words::{BannerStyle, DiagnosticsStyle, EntryStyle, IndexStyle, MenuStyle, NetworkStyle, NumberStyle, Words};

/// One way of wording things.
#[derive(Clone, Debug)]
pub struct Dialect {
    words: Words,
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

/// An entry of the view with its present value.
#[derive(Clone, Copy, Debug)]
pub struct ViewEntry {
    /// The entry.
    pub entry: &'static Entry,
    /// Its value.
    pub value: Value,
}

/// What a diagnostics page shows.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Quantities of the unit: name, value, digits behind the point, unit.
    pub unit: Vec<(&'static str, f64, usize, &'static str)>,
    /// Channels.
    pub channels: Vec<ChannelDiagnosis>,
    /// Active errors.
    pub errors: usize,
    /// Time since the start.
    pub uptime: Duration,
    /// State of the node.
    pub network: NetworkState,
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
        Dialect { words: Words::plain() }
    }

    /// Another wording for each seed; 0 is the plain one.
    pub fn drawn(seed: u64) -> Self {
        if seed == 0 {
            return Dialect::plain();
        }
        Dialect { words: Words::drawn(&mut Rng::new(seed).fork("dialect")) }
    }

    /// What lines end with.
    pub fn line_end(&self) -> &'static str {
        self.words.line_end
    }

    /// Whether the characters of an answer come back.
    pub fn echoes(&self) -> bool {
        self.words.echo
    }

    /// Whether the question for the stream's source wants Enter behind its key.
    pub fn source_wants_enter(&self) -> bool {
        self.words.source.wants_enter
    }

    /// The source a key means at its question.
    pub fn source_of(&self, key: u8) -> Option<Source> {
        let key = key.to_ascii_lowercase();
        let source = self.words.source;
        (key == source.field_value)
            .then_some(Source::FieldValue)
            .or((key == source.process_value).then_some(Source::ProcessValue))
    }

    /// Printed once when the application starts. Product name and a version like `V1.2.3` are the manual's.
    pub fn banner(&self, identity: &Identity, title: &str) -> String {
        let Identity { product, version, build_date, build_time, .. } = identity;
        let text = match self.words.banner {
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
        format!("\r\n{}\r\n\r\n", self.words.letters.of(&text))
    }

    /// The main menu with the basic values of the network (section 4.1).
    pub fn menu(&self, identity: &Identity, parameters: &Parameters, network: NetworkState) -> String {
        let words = &self.words;
        let mut text = String::from("\r\n");
        if words.title_names_product {
            let _ = write!(text, "{} - {} V{}\r\n", words.menu_title, identity.product, identity.version);
        } else if !words.menu_title.is_empty() {
            let _ = write!(text, "{}\r\n", words.menu_title);
        }
        if words.network_first {
            text.push_str(&self.network_lines(parameters, network));
        }
        for (key, item) in words::MENU {
            let line = match words.menu {
                MenuStyle::Dash => format!("  {key} - {item}"),
                MenuStyle::Brackets => format!("[{key}] {item}"),
                MenuStyle::InWord => format!(" ({key}){}", &item[1..]),
                MenuStyle::Equals => format!("{key} = {item}"),
                MenuStyle::Colon => format!("    {key}: {item}"),
                MenuStyle::Parenthesis => format!("{key}) {item}"),
            };
            text.push_str(&words.letters.of(&line));
            text.push_str("\r\n");
        }
        if !words.network_first {
            text.push_str(&self.network_lines(parameters, network));
        }
        text
    }

    fn network_lines(&self, parameters: &Parameters, network: NetworkState) -> String {
        let Parameters { node_id, kbps, .. } = parameters;
        let state = self.network_state(network);
        let text = match self.words.network {
            NetworkStyle::OneLine => {
                format!("CANopen: Node-ID {node_id} (0x{node_id:02X}), Baud Rate {kbps} kbit/s, State {state}")
            }
            NetworkStyle::Lines => format!("Node ID: 0x{node_id:02X}\r\nBaudrate: {kbps} kbps\r\nNMT state: {state}"),
            NetworkStyle::Hexadecimal => {
                format!("network: id={node_id:02X}h  {} bit/s  state={state}", u32::from(*kbps) * 1000)
            }
            NetworkStyle::Sentence => format!("Node {node_id} is {state} at {kbps} kbit/s"),
        };
        format!("{}\r\n", self.words.letters.of(&text))
    }

    /// A sentence. Prompts have no line end: the answer is echoed behind them.
    pub fn sentence(&self, sentence: Sentence) -> String {
        let words = &self.words;
        let line = |phrase: &str| format!("\r\n{}\r\n", words.letters.of(phrase));
        let prompt = |phrase: &str| format!("\r\n{phrase}");
        match sentence {
            Sentence::AskSource => prompt(words.source.question),
            Sentence::AskDefaults => prompt(words.ask_defaults),
            Sentence::AskPassword => prompt(words.ask_password),
            Sentence::Cancelled => line(words.cancelled),
            Sentence::StreamOff => line(words.stream_off),
            Sentence::DefaultsRestored => line(words.defaults_restored),
            Sentence::WrongPassword => line(words.wrong_password),
            Sentence::RightPassword => line(words.right_password),
            Sentence::ViewRefused => line(words.view_refused),
            Sentence::ViewTitle => line(words.view_title),
            Sentence::ViewNext => line(words.view_next),
            Sentence::ViewEnd => line(words.view_end),
            Sentence::DiagnosticsOn => line(words.diagnostics_on),
            Sentence::DiagnosticsOff => line(words.diagnostics_off),
        }
    }

    /// Prompt: repetition rate; an empty answer takes the default.
    pub fn ask_period(&self, (shortest, longest): (u16, u16), default_ms: u16) -> String {
        let question = self.words.ask_period;
        let question = question.replace("{low}", &shortest.to_string()).replace("{high}", &longest.to_string());
        format!("\r\n{}", question.replace("{default}", &default_ms.to_string()))
    }

    /// The repetition rate is none.
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
        format!("\r\n{}\r\n", self.words.letters.of(&text))
    }

    /// An object of the view with its entries.
    pub fn view_object(&self, object: &Object, entries: impl Iterator<Item = ViewEntry>) -> String {
        let index = match self.words.index {
            IndexStyle::Suffix => format!("{:04X}h", object.index),
            IndexStyle::Prefix => format!("0x{:04X}", object.index),
            IndexStyle::Dollar => format!("${:04X}", object.index),
        };
        let mut text = String::new();
        let single = object.kind == ObjectKind::Var;
        if self.words.entry.has_heading() {
            let _ = write!(text, "{index} {}\r\n", object.name);
        }
        for entry in entries {
            self.view_entry(&mut text, object, &index, single, entry);
        }
        text
    }

    fn view_entry(&self, text: &mut String, object: &Object, index: &str, single: bool, shown: ViewEntry) {
        let ViewEntry { entry, value } = shown;
        let number = self.value(object, entry, value);
        let unit = entry.unit.as_deref().filter(|_| self.words.units && !number.starts_with("0x"));
        let unit = unit.map(|unit| format!(" {}", ascii(unit))).unwrap_or_default();
        let meaning = entry.meaning(value).filter(|_| self.words.meanings);
        let meaning = meaning.map(|meaning| format!(" ({meaning})")).unwrap_or_default();
        let sub = entry.sub;
        let name = &entry.name;
        let full = if single { object.name.clone() } else { format!("{} {name}", object.name) };
        let digits = &index.trim_start_matches("0x").trim_start_matches('$').trim_end_matches('h');
        let _ = match self.words.entry {
            EntryStyle::Heading => write!(text, "  {sub:02X}h {name:<32} = {number}{unit}{meaning}\r\n"),
            EntryStyle::SubHeading => write!(text, "    sub {sub}: {number}{unit}{meaning}\r\n"),
            EntryStyle::Bracketed => write!(text, "[{digits}:{sub:02X}] {full} = {number}{unit}{meaning}\r\n"),
            EntryStyle::Glued => write!(text, "{digits}sub{sub:X}\t{number}{unit}\t{full}\r\n"),
            EntryStyle::Colon => write!(text, "{index}:{sub:02X}  {full}: {number}{unit}{meaning}\r\n"),
            EntryStyle::Dots => {
                let room = 44usize.saturating_sub(full.len()).max(3);
                write!(text, "{index}.{sub} {full} {} {number}{unit}{meaning}\r\n", ".".repeat(room))
            }
        };
    }

    /// A value as this unit prints it.
    fn value(&self, object: &Object, entry: &Entry, value: Value) -> String {
        let NumberStyle { decimals, not_a_number, hexadecimal, .. } = self.words.numbers;
        match value {
            Value::Real32(number) if number.is_nan() => not_a_number.into(),
            Value::Real32(number) => {
                // Constants of a curve have more digits than a temperature.
                let decimals = if matches!(object.index, 0x3010 | 0x3020 | 0x3030) { 6 } else { decimals };
                format!("{number:.decimals$}")
            }
            Value::Boolean(flag) => u8::from(flag).to_string(),
            Value::Unsigned32(bits) if entry.unit.is_none() => self.hexadecimal(u64::from(bits), 8),
            Value::Unsigned8(bits) if object.index == 0x1001 || (object.index == 0x6150 && entry.sub > 0) => {
                self.hexadecimal(u64::from(bits), 2)
            }
            _ => {
                let integer = value.as_integer().unwrap_or_default();
                let unsigned = matches!(value.data_type(), DataType::Unsigned8 | DataType::Unsigned16);
                if hexadecimal && unsigned && entry.unit.is_none() && entry.sub > 0 {
                    self.hexadecimal(integer as u64, value.data_type().bytes() * 2)
                } else {
                    integer.to_string()
                }
            }
        }
    }

    fn hexadecimal(&self, bits: u64, digits: usize) -> String {
        if self.words.numbers.suffix { format!("{bits:0digits$X}h") } else { format!("0x{bits:0digits$X}") }
    }

    /// A page of diagnostics.
    pub fn diagnostics(&self, diagnosis: &Diagnosis) -> String {
        let seconds = diagnosis.uptime.as_secs();
        let uptime = format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
        let style = self.words.diagnostics;
        let mut text = match style {
            DiagnosticsStyle::Plain => format!("\r\nDiagnostics                 up {uptime}\r\n"),
            DiagnosticsStyle::Repainted => format!("\x1b[2J\x1b[HDiagnostics   up {uptime}\r\n"),
            DiagnosticsStyle::Compact => String::from("\r\n"),
        };
        let compact = style == DiagnosticsStyle::Compact;
        for (name, value, decimals, unit) in &diagnosis.unit {
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
            NetworkState::PreOperational => self.words.pre_operational,
            NetworkState::Operational => "Operational",
            NetworkState::Stopped => "Stopped",
        }
    }
}

/// A unit's name in the characters a serial terminal has.
fn ascii(unit: &str) -> String {
    unit.replace('°', "").replace('µ', "u").replace('Ω', "Ohm").replace('²', "2").replace('⁴', "4")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;
    use crate::emulator::objects::Objects;
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
                for (key, item) in words::MENU {
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
    fn every_dialect_shows_every_index_and_value_of_the_view() {
        for product in Product::all() {
            let objects = Objects::factory(product, 127);
            for seed in 0..100 {
                let dialect = Dialect::drawn(seed);
                for object in product.dictionary.objects() {
                    let entries = object
                        .entries
                        .iter()
                        .map(|entry| ViewEntry { entry, value: objects.get(object.index, entry.sub) });
                    let text = dialect.view_object(object, entries);
                    assert!(text.contains(&format!("{:04X}", object.index)), "seed {seed}: {text}");
                    assert!(text.is_ascii(), "seed {seed}: {text}");
                    assert!(text.lines().count() >= object.entries.len(), "seed {seed}: {text}");
                }
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
