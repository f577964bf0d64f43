//! The format of a product's file, and what makes one sound.
//!
//! A file is TOML. What serde refuses (a key that does not exist, something that is not a number) ends the reading with one
//! complaint; everything that can be read is then checked as a whole, and every fault is reported, each with file, line,
//! column, key, what was found and what is allowed. Here is the product as a whole; `object` reads its dictionary.

mod object;

use serde::Deserialize;
use toml::Spanned;

use super::complaint::{Complaint, Complaints};
use super::dictionary::{Dictionary, Object};
use super::{
    BIT_RATES_KBPS, BootFlash, Cable, Can, Console, HIGHEST_NODE_ID, Loader, Measurement, Product, SensorKind,
};
use crate::image::FlashMap;
use crate::image::identity::LONGEST_NAME;
use crate::wire::stream;
use object::RawObject;

/// A file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawProduct {
    name: Spanned<String>,
    title: String,
    manual: String,
    can: Spanned<Can>,
    cable: Cable,
    console: Console,
    stream: Spanned<stream::Layout>,
    measurement: Spanned<Measurement>,
    flash: Spanned<FlashMap>,
    boot_flash: Spanned<BootFlash>,
    loader: Spanned<Loader>,
    #[serde(default)]
    object: Vec<Spanned<RawObject>>,
}

/// The most channels of a row, and characters of a field: more than any product of this kind has, and few enough for a row
/// to stay a line.
const MOST_CHANNELS: usize = 64;
const WIDEST_FIELD: usize = 40;
/// The most words of program flash: an emulated unit has all of it in memory. The largest product has 262,144.
const MOST_WORDS: u32 = 1 << 22;

/// Reads a product's file.
///
/// # Errors
/// If it is not TOML or not a product's file, with one complaint; otherwise with everything that is wrong with it.
pub fn read(file: &str, text: &str) -> Result<Product, Vec<Complaint>> {
    let complaints = Complaints::about(file, text);
    let raw: RawProduct = match toml::from_str(text) {
        Ok(raw) => raw,
        Err(error) => return Err(complaints.ended_by(&error)),
    };
    let mut reader = Reader { complaints };
    let product = reader.product(raw);
    reader.complaints.or(product)
}

struct Reader<'a> {
    complaints: Complaints<'a>,
}

impl Reader<'_> {
    fn complain(&mut self, at: usize, key: impl Into<String>, message: impl Into<String>) {
        self.complaints.add(at, key, message);
    }

    fn product(&mut self, raw: RawProduct) -> Product {
        self.check_name(&raw.name);
        self.check_can(&raw.can);
        self.check_stream(&raw.stream);
        self.check_measurement(&raw.measurement, raw.stream.get_ref());
        self.check_flash(&raw.flash);
        self.check_boot_flash(&raw.boot_flash, raw.flash.get_ref());
        let loader = raw.loader.get_ref();
        if !loader.file_name.contains("{version}") {
            let message = format!("'{}' has no {{version}} in it", loader.file_name);
            self.complain(raw.loader.span().start, "loader.file_name", message);
        }
        let mut objects: Vec<(usize, Object)> = Vec::new();
        for raw in raw.object {
            let start = raw.get_ref().index.span().start;
            let object = self.object(raw.into_inner());
            if objects.iter().any(|(_, before)| before.index == object.index) {
                self.complain(start, "object.index", format!("{:04X}h is there already", object.index));
            }
            objects.push((start, object));
        }
        let dictionary = Dictionary::new(objects.iter().map(|(_, object)| object.clone()).collect());
        for (start, object) in &objects {
            self.check_bounds(&dictionary, object, *start);
        }
        Product {
            name: raw.name.into_inner(),
            title: raw.title,
            manual: raw.manual,
            can: raw.can.into_inner(),
            cable: raw.cable,
            console: raw.console,
            stream: raw.stream.into_inner(),
            measurement: raw.measurement.into_inner(),
            flash: raw.flash.into_inner(),
            boot_flash: raw.boot_flash.into_inner(),
            loader: raw.loader.into_inner(),
            dictionary,
        }
    }

    fn check_name(&mut self, name: &Spanned<String>) {
        let plain = !name.get_ref().is_empty() && name.get_ref().bytes().all(|byte| byte.is_ascii_alphanumeric());
        if !plain || name.get_ref().len() > LONGEST_NAME {
            let message =
                format!("'{}' is not 1 to {LONGEST_NAME} letters and digits, as an identity block has", name.get_ref());
            self.complain(name.span().start, "name", message);
        }
    }

    fn check_can(&mut self, can: &Spanned<Can>) {
        let Can { node_id, kbps, .. } = *can.get_ref();
        if !(1..=HIGHEST_NODE_ID).contains(&node_id) {
            self.complain(can.span().start, "can.node_id", format!("{node_id} is not 1 to {HIGHEST_NODE_ID}"));
        }
        if !BIT_RATES_KBPS.contains(&kbps) {
            let allowed = BIT_RATES_KBPS.map(|rate| rate.to_string()).join(", ");
            self.complain(can.span().start, "can.kbps", format!("{kbps} is not one of {allowed}"));
        }
    }

    fn check_stream(&mut self, layout: &Spanned<stream::Layout>) {
        let at = layout.span().start;
        let layout = layout.get_ref();
        if layout.channels.is_empty() {
            self.complain(at, "stream.channels", "there is no channel");
        }
        if layout.channels.len() > MOST_CHANNELS {
            let message = format!("{} are more than {MOST_CHANNELS}", layout.channels.len());
            self.complain(at, "stream.channels", message);
        }
        for (name, format) in [("field_value", &layout.field_value), ("process_value", &layout.process_value)] {
            let key = format!("stream.{name}");
            let Some(&width) = format.widths.first() else {
                self.complain(at, format!("{key}.widths"), "there is no width");
                continue;
            };
            if let Some(wrong) = format.widths.iter().find(|width| !(1..=WIDEST_FIELD).contains(*width)) {
                let message = format!("{wrong} is not a width of 1 to {WIDEST_FIELD} characters");
                self.complain(at, format!("{key}.widths"), message);
            }
            // There is at least one digit before the point.
            if format.decimals > 0 && format.decimals.saturating_add(2) > width {
                let message = format!("{} decimal places do not fit into {width} characters", format.decimals);
                self.complain(at, format!("{key}.decimals"), message);
            }
            let words = [Some(&format.disabled), Some(&format.open), format.short.as_ref(), format.error.as_ref()];
            for word in words.into_iter().flatten() {
                if word.is_empty() || word.len() > width {
                    self.complain(at, key.clone(), format!("'{word}' is not a word of 1 to {width} characters"));
                }
            }
        }
    }

    fn check_measurement(&mut self, measurement: &Spanned<Measurement>, layout: &stream::Layout) {
        let at = measurement.span().start;
        let Measurement { sensors, channels, stream_period_ms: (shortest, longest), .. } = *measurement.get_ref();
        if channels == 0 {
            self.complain(at, "measurement.channels", "there is no channel");
        }
        // The cold junction comes before the inputs (errata E-104).
        let fields = match sensors {
            SensorKind::Thermocouple => usize::from(channels) + 1,
            SensorKind::Rtd => usize::from(channels),
        };
        if layout.channels.len() != fields {
            let message = format!("a row of {fields} fields belongs to them, not one of {}", layout.channels.len());
            self.complain(at, "measurement.channels", message);
        }
        if shortest == 0 || shortest > longest {
            let message = format!("from {shortest} to {longest} is not a range of times");
            self.complain(at, "measurement.stream_period_ms", message);
        }
    }

    fn check_flash(&mut self, flash: &Spanned<FlashMap>) {
        let FlashMap { program_words, page_words, .. } = *flash.get_ref();
        if page_words == 0 || program_words == 0 || !program_words.is_multiple_of(page_words) {
            let message = format!("{program_words} words are not a whole number of pages of {page_words}");
            self.complain(flash.span().start, "flash.program_words", message);
        }
        if program_words > MOST_WORDS {
            let message = format!("{program_words} words are more than {MOST_WORDS}");
            self.complain(flash.span().start, "flash.program_words", message);
        }
    }

    fn check_boot_flash(&mut self, boot: &Spanned<BootFlash>, flash: &FlashMap) {
        let BootFlash { start, words } = *boot.get_ref();
        if words == 0 || u64::from(start) < flash.end() || start.checked_add(words).is_none() {
            let message = format!("{words} words at {start:#x} do not lie after the program flash");
            self.complain(boot.span().start, "boot_flash", message);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = include_str!("../axtc4co.toml");

    /// The complaints about the shipped file with one text in it replaced.
    fn complaints(from: &str, to: &str) -> Vec<String> {
        assert_eq!(GOOD.matches(from).count(), 1, "{from:?}");
        let complaints = read("unit.toml", &GOOD.replace(from, to)).expect_err(to);
        complaints.iter().map(Complaint::to_string).collect()
    }

    #[test]
    fn each_fault_is_named_with_its_place_its_key_and_what_is_allowed() {
        let threshold = "limits = [-2730, \"4010:n - 100\"]";
        let table = [
            ("node_id = 127 ", "node_id = 128 ", "can.node_id: 128 is not 1 to 127"),
            ("kbps = 125 ", "kbps = 115 ", "can.kbps: 115 is not one of 10, 20, 50, 125, 250, 500, 800, 1000"),
            ("name = \"AXTC4CO\"", "name = \"AX TC4\"", "name: 'AX TC4' is not 1 to 12 letters and digits"),
            ("page_words = 256", "page_words = 255", "65536 words are not a whole number of pages of 255"),
            ("start = 0x20000", "start = 0x2000", "boot_flash: 4096 words at 0x2000 do not lie after"),
            ("_V{version}", "_V", "loader.file_name: 'AXTC4CO_V.elf.S' has no {version} in it"),
            ("widths = [8]", "widths = [0]", "stream.field_value.widths: 0 is not a width of 1 to 40 characters"),
            ("widths = [8]", "widths = [8, 4000000000]", "stream.field_value.widths: 4000000000 is not a width"),
            ("decimals = 3", "decimals = 7", "field_value.decimals: 7 decimal places do not fit into 8"),
            ("decimals = 3", "decimals = 9223372036854775807", "do not fit into 8 characters"),
            ("program_words = 0x10000", "program_words = 4294967040", "4294967040 words are more than 4194304"),
            ("open = \"OpenCct\"", "open = \"OpenCircuit\"", "stream.field_value: 'OpenCircuit' is not a word"),
            ("[1, 60000]", "[100, 10]", "measurement.stream_period_ms: from 100 to 10 is not a range"),
            ("index = 0x5010", "index = 0x5000", "object.index: 5000h is there already"),
            ("values = [1, 2, 7]", "values = [1, 70000]", "object 6110h, entry 1, values: 70000 is not a whole number"),
            ("values = [50, 60]", "values = [50, 61]", "object 5010h, default: 60 is not within the limits"),
            (threshold, "limits = [-2730, \"4011:n - 100\"]", "4000h, entry 1, limits: there is no entry 4011:01"),
            (
                threshold,
                "limits = [-2730, \"4010 less 100\"]",
                "limits: '4010 less 100' is not a bound: write a number",
            ),
            (threshold, "limits = [-2730, \"4010:n --9223372036854775808\"]", "is not a bound: write a number"),
            (threshold, "limits = [-2730, \"4010:n + -100\"]", "limits: '4010:n + -100' is not a bound"),
            (threshold, "limits = [-2730]", "limits: 1 values are not the lowest and the highest"),
            (threshold, "limits = [-100, -200]", "limits: -100 to -200 is not a range"),
            (
                "\"$NODEID + 0x40000180\"",
                "\"$NODE + 1\"",
                "object 1800h, entry 1, default: '$NODE + 1' is not a default",
            ),
            (
                "channels = 4\n",
                "channels = 5\n",
                "measurement.channels: a row of 6 fields belongs to them, not one of 5",
            ),
            ("\"$NODEID + 0x40000180\"", "\"$NODEID + 0xFFFFFF81\"", "'$NODEID + 0xFFFFFF81' is not a default"),
            ("\"$NODEID + 0x40000180\"", "\"$NODEID + 0x+180\"", "'$NODEID + 0x+180' is not a default"),
            (
                "default = 200000",
                "default = 1.5",
                "object 6114h, entry 1, default: 1.5 is not a whole number from 0 to",
            ),
            ("\"7\" = \"type T\"", "\"T\" = \"type T\"", "meanings: 'T' is not a value of an UNSIGNED16"),
            ("section = \"3.4.17\"", "section = \"\"", "object 5010h, section: there is none"),
            (
                "entries = [\"Configuration Date\", \"Configuration Time\"]",
                "entries = []",
                "1020h, entries: there are none",
            ),
            ("{ sub = 0, name = \"Number of errors\"", "{ sub = 5, name = \"Number of errors\"", "5 does not follow"),
            ("sensors = \"thermocouple\"", "sensors = \"hygrometer\"", "unknown variant `hygrometer`, expected"),
            ("title = ", "titel = ", "unknown field `titel`, expected one of `name`, `title`"),
            ("index = 0x1017", "index = 0x11017", "invalid value: integer `69655`, expected u16"),
        ];
        for (from, to, expected) in table {
            let found = complaints(from, to);
            assert!(found.iter().any(|complaint| complaint.contains(expected)), "{to}:\n{}", found.join("\n"));
        }
    }

    #[test]
    fn a_complaint_leads_to_its_line_and_column_and_none_hides_another() {
        let text = GOOD.replace("values = [50, 60]", "values = [50, 61]").replace("kbps = 125 ", "kbps = 1 ");
        let complaints = read("unit.toml", &text).expect_err("two faults");
        assert_eq!(complaints.len(), 2);
        let line = |needle: &str| text[..text.find(needle).expect(needle)].matches('\n').count() + 1;
        assert_eq!(complaints[0].line, line("[can]"));
        assert_eq!((complaints[1].line, complaints[1].column), (line("index = 0x5010"), 9));
        let broken = read("unit.toml", "name = ").expect_err("no TOML");
        assert_eq!((broken.len(), broken[0].line, broken[0].column), (1, 1, 8), "{broken:?}");
    }
}
