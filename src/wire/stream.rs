//! Rows of the data stream: `CJ;TC1;TC2;TC3;TC4` (AXTC4CO manual, section 4.1.3) and `RTD1;...;RTD8` (AXRTD8CO).
//!
//! The manuals fix these rows to the character (separator, order, field widths, words for a missing value), so
//! writing and reading stand side by side here: the emulated unit writes, the console reads.

use serde::Deserialize;

/// How a product words its rows.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// Names of the fields in their order, e.g. `CJ`, `TC1`.
    pub channels: Vec<String>,
    /// Fields when the unit sends field values (object 6100h), in °C.
    pub field_value: FieldFormat,
    /// Fields when the unit sends process values (object 7130h), as integers.
    pub process_value: FieldFormat,
}

/// How one field looks.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldFormat {
    /// Characters a field takes; the first is what the unit sends, the others are accepted as well.
    pub widths: Vec<usize>,
    /// Digits after the point.
    pub decimals: usize,
    /// Word for a channel that is switched off.
    pub disabled: String,
    /// Word for an open circuit.
    pub open: String,
    /// Word for a short circuit, where the product has one.
    pub short: Option<String>,
    /// Word for a value that is missing for another reason, where the product has one.
    pub error: Option<String>,
}

/// Which value a row carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// Field value, object 6100h, in °C.
    FieldValue,
    /// Process value, object 7130h, scaled to an integer.
    ProcessValue,
}

/// What a row says of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// A number: °C for field values, counts for process values.
    Value(f64),
    /// The channel is switched off (object 6112h).
    Disabled,
    /// The sensor's circuit is open.
    Open,
    /// The sensor is shorted.
    Short,
    /// The unit has no value for another reason: its converter or its computation has failed.
    Error,
}

/// One row.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which value the readings are.
    pub source: Source,
    /// Digits after the point of its numbers, as printed.
    pub decimals: usize,
    /// One reading for each channel of the layout, in its order.
    pub readings: Vec<Reading>,
}

impl Layout {
    /// An empty row of this source, for one reading after the other.
    pub fn row(&self, source: Source) -> Row {
        Row { source, decimals: self.format(source).decimals, readings: Vec::with_capacity(self.channels.len()) }
    }

    /// The row as the unit prints it, without a line end. A number wider than its field is printed whole.
    pub fn emit(&self, row: &Row) -> String {
        let (format, decimals) = (self.format(row.source), row.decimals);
        let width = format.widths.first().copied().unwrap_or_default();
        let mut text = String::new();
        for (position, reading) in row.readings.iter().enumerate() {
            if position > 0 {
                text.push(';');
            }
            match reading {
                Reading::Value(value) => {
                    // Rounded first: nothing is "-0.0".
                    let scale = 10f64.powi(decimals as i32);
                    let value = (value * scale).round() / scale + 0.0;
                    text.push_str(&format!("{value:>width$.decimals$}"));
                }
                Reading::Disabled => text.push_str(&format!("{:<width$}", format.disabled)),
                Reading::Open => text.push_str(&format!("{:<width$}", format.open)),
                Reading::Short => {
                    let word = format.short.as_deref().unwrap_or(&format.open);
                    text.push_str(&format!("{word:<width$}"));
                }
                Reading::Error => {
                    let word = format.error.as_deref().unwrap_or(&format.open);
                    text.push_str(&format!("{word:<width$}"));
                }
            }
        }
        text
    }

    /// Reads a line as a row, if it is exactly one: the right number of fields, each of the right width, each a number
    /// or one of the words. Anything else, a row cut by noise above all, is not guessed at.
    ///
    /// The blanks that fill up the last field may be missing, since many tools strip them.
    pub fn parse(&self, line: &str) -> Option<Row> {
        [Source::FieldValue, Source::ProcessValue].into_iter().find_map(|source| self.parse_as(source, line))
    }

    /// Characters of a row on the line, its line end included.
    pub fn row_characters(&self, source: Source) -> usize {
        let width = self.format(source).widths.first().copied().unwrap_or_default();
        (width + 1) * self.channels.len() + 1
    }

    /// Field format of a source.
    pub fn format(&self, source: Source) -> &FieldFormat {
        match source {
            Source::FieldValue => &self.field_value,
            Source::ProcessValue => &self.process_value,
        }
    }

    /// Reads a line as a row of this source, if it is exactly one.
    pub(super) fn parse_as(&self, source: Source, line: &str) -> Option<Row> {
        let last = self.channels.len().checked_sub(1)?;
        // Most lines are no row, or one of another layout.
        if line.bytes().filter(|&byte| byte == b';').count() != last {
            return None;
        }
        let format = self.format(source);
        let readings = format.widths.iter().find_map(|&width| {
            let fields = line.split(';').enumerate();
            fields.map(|(position, field)| format.reading(field, width, position == last)).collect::<Option<Vec<_>>>()
        })?;
        Some(Row { source, decimals: format.decimals, readings })
    }
}

impl Source {
    /// As files and options name it: `fv`, `pv`.
    pub const fn short(self) -> &'static str {
        match self {
            Source::FieldValue => "fv",
            Source::ProcessValue => "pv",
        }
    }
}

impl Reading {
    /// The number, where there is one.
    pub const fn value(self) -> Option<f64> {
        match self {
            Reading::Value(value) => Some(value),
            Reading::Disabled | Reading::Open | Reading::Short | Reading::Error => None,
        }
    }

    /// In words for a person: `ok` or what is wrong.
    pub const fn words(self) -> &'static str {
        match self {
            Reading::Value(_) => "ok",
            Reading::Disabled => "disabled",
            Reading::Open => "open circuit",
            Reading::Short => "short circuit",
            Reading::Error => "no reading",
        }
    }

    /// Whether something is wrong with the channel.
    pub const fn is_fault(self) -> bool {
        matches!(self, Reading::Open | Reading::Short | Reading::Error)
    }

    /// As files name it: `ok` or why there is no number.
    pub const fn state(self) -> &'static str {
        match self {
            Reading::Value(_) => "ok",
            Reading::Disabled => "disabled",
            Reading::Open => "open",
            Reading::Short => "short",
            Reading::Error => "error",
        }
    }
}

impl Row {
    /// The heading of the rows as CSV.
    pub fn csv_heading(channels: &[String]) -> String {
        format!("time,source,{}\n", channels.join(","))
    }

    /// The row as a line of CSV, its numbers as printed: `2026-01-31T12:00:00.123Z,fv,23.500,open`.
    pub fn csv(&self, time: &str) -> String {
        let mut line = format!("{time},{}", self.source.short());
        let decimals = self.decimals;
        for &reading in &self.readings {
            line.push(',');
            match reading {
                Reading::Value(value) => line.push_str(&format!("{value:.decimals$}")),
                _ => line.push_str(reading.state()),
            }
        }
        line.push('\n');
        line
    }

    /// A word among such rows: `2026-01-31T12:00:00.123Z,mark 1,,,,,`, with as many fields as rows of that many channels.
    pub fn csv_note(time: &str, text: &str, channels: usize) -> String {
        format!("{time},{text}{}\n", ",".repeat(channels))
    }
}

impl FieldFormat {
    fn reading(&self, field: &str, width: usize, is_last: bool) -> Option<Reading> {
        let length = field.chars().count();
        let word = field.trim_end();
        let words = [
            (Some(self.disabled.as_str()), Reading::Disabled),
            (Some(self.open.as_str()), Reading::Open),
            (self.short.as_deref(), Reading::Short),
            (self.error.as_deref(), Reading::Error),
        ];
        for (candidate, reading) in words {
            if candidate == Some(word) {
                return (length == width || (is_last && length < width)).then_some(reading);
            }
        }
        // A number fills its field, or is too wide for it and then has no blank in front.
        let number = field.trim_start();
        let fills = length == width || (length > width && number.len() == field.len());
        // No digits after the point means no point either.
        let fraction = number.split_once('.').map(|(_, digits)| digits.len());
        let plain = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-' || byte == b'.');
        if !fills || !plain || fraction != Some(self.decimals).filter(|&decimals| decimals > 0) {
            return None;
        }
        // Some hundred digits in a row are no measurement, and would become infinite.
        number.parse().ok().filter(|value: &f64| value.is_finite()).map(Reading::Value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thermocouples() -> Layout {
        Layout {
            channels: ["CJ", "TC1", "TC2", "TC3", "TC4"].map(String::from).to_vec(),
            field_value: FieldFormat {
                widths: vec![8],
                decimals: 3,
                disabled: "Disabled".into(),
                open: "OpenCct".into(),
                short: None,
                error: None,
            },
            process_value: FieldFormat {
                widths: vec![5],
                decimals: 0,
                disabled: "Null".into(),
                open: "Open".into(),
                short: None,
                error: None,
            },
        }
    }

    fn rtds() -> Layout {
        let format = |widths: &[usize], decimals| FieldFormat {
            widths: widths.to_vec(),
            decimals,
            disabled: "Null".into(),
            open: "Open".into(),
            short: Some("Short".into()),
            error: None,
        };
        Layout {
            channels: (1..=2).map(|n| format!("RTD{n}")).collect(),
            field_value: format(&[6, 5], 1),
            process_value: format(&[6, 5], 0),
        }
    }

    #[test]
    fn rows_are_what_the_manual_prints_and_read_back_the_same() {
        let layout = thermocouples();
        let cases = [
            (
                Source::FieldValue,
                vec![
                    Reading::Value(23.5),
                    Reading::Value(-273.0),
                    Reading::Disabled,
                    Reading::Open,
                    Reading::Value(1735.0),
                ],
                "  23.500;-273.000;Disabled;OpenCct ;1735.000",
            ),
            (
                Source::ProcessValue,
                vec![
                    Reading::Value(4768.0),
                    Reading::Value(0.0),
                    Reading::Disabled,
                    Reading::Open,
                    Reading::Value(32128.0),
                ],
                " 4768;    0;Null ;Open ;32128",
            ),
            (
                Source::ProcessValue,
                vec![Reading::Value(-10000.0), Reading::Open, Reading::Open, Reading::Open, Reading::Open],
                "-10000;Open ;Open ;Open ;Open ",
            ),
        ];
        for (source, readings, text) in cases {
            let row = Row { readings, ..layout.row(source) };
            assert_eq!(layout.emit(&row), text);
            assert_eq!(layout.parse(text), Some(row.clone()), "{text:?}");
            assert_eq!(layout.parse(text.trim_end()), Some(row), "{text:?} without its last blanks");
        }
    }

    #[test]
    fn a_row_cut_by_noise_is_not_guessed_at() {
        let layout = thermocouples();
        for text in [
            "",
            ";;;;",
            "  23.500;  21.000;  21.000;  21.000",
            "  23.500;  21.000;  21.000;  21.000; 1.000",
            "  23.500;  21.00;  21.000;  21.000;  21.000",
            "  23.500;  21.000;  2\u{fffd}.000;  21.000;  21.000",
            "23.500;  21.000;  21.000;  21.000;  21.000",
            "  23.500;  21.000;  21.000;  21.000;  21.000;",
            "     inf;  21.000;  21.000;  21.000;  21.000",
            "  2-.500;  21.000;  21.000;  21.000;  21.000",
            " 4768; 4768; 4768; 4768; 47.8",
            " 4768; 4768; 4768; 4768; 476.",
            &format!("{}.000;  21.000;  21.000;  21.000;  21.000", "9".repeat(400)),
            "CJ;TC1;TC2;TC3;TC4",
        ] {
            assert_eq!(layout.parse(text), None, "{text:?}");
        }
    }

    #[test]
    fn both_field_widths_of_the_rtd_scanner_are_read() {
        let layout = rtds();
        let wide = layout.parse("  21.5;Short ").expect("six characters a field");
        assert_eq!(wide.readings, [Reading::Value(21.5), Reading::Short]);
        let narrow = layout.parse(" 21.5;Open ").expect("five characters a field");
        assert_eq!(narrow.readings, [Reading::Value(21.5), Reading::Open]);
        assert_eq!(layout.parse(" 21.5;Short "), None, "two widths in one row are noise");
    }

    #[test]
    fn a_line_of_csv_has_the_digits_that_the_unit_printed() {
        for (layout, text, csv) in [
            (
                thermocouples(),
                "  23.500;-273.000;Disabled;OpenCct ;1735.000",
                "t,fv,23.500,-273.000,disabled,open,1735.000\n",
            ),
            (thermocouples(), " 4768;    0;Null ;Open ;32128", "t,pv,4768,0,disabled,open,32128\n"),
            (rtds(), "  56.0;  63.9", "t,fv,56.0,63.9\n"),
            (rtds(), "  -0.0;Short ", "t,fv,-0.0,short\n"),
            (rtds(), "   560;  -384", "t,pv,560,-384\n"),
        ] {
            assert_eq!(layout.parse(text).map(|row| row.csv("t")).as_deref(), Some(csv), "{text:?}");
        }
    }
}
