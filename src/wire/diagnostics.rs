//! Pages of diagnostics, which S shows every second (AXTC4CO manual, section 4.1.4).
//!
//! What a page shows is lost with the manual's figures, so nothing is expected of it: wherever a line puts a number
//! behind words, that is a quantity with its label. The page itself stays as printed.

use super::words::Words;

/// A number on a page, and what the page calls it.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The words before it. A further quantity of a line with one word or none, `raw`, is one of what the first one names.
    pub label: String,
    /// The number.
    pub value: f64,
    /// Digits behind its point, as printed: `70.0` says more than `70`.
    pub decimals: usize,
    /// The unit behind it, as printed, if the word behind it is one.
    pub unit: Option<String>,
}

/// Units as pages write them, in lower case, `µ` as `u`.
const UNITS: [&str; 22] = [
    "v", "mv", "uv", "a", "ma", "c", "°c", "degc", "deg", "f", "°f", "ohm", "ohms", "Ω", "ms", "s", "us", "%", "hz",
    "kbit/s", "kbps", "w",
];

/// Quantities of one line a page may have; a line is not longer than the framer lets it be.
const MOST_QUANTITIES: usize = 64;

/// The quantities a line shows, in its order. A time like `0:01:02` and an address are none.
pub fn quantities(line: &str) -> Vec<Quantity> {
    let mut found: Vec<Quantity> = Vec::new();
    let mut label: Vec<&str> = Vec::new();
    let mut words = line.split([' ', '\t', '=', '|', ';', ',']).map(bare).filter(|word| !word.is_empty()).peekable();
    while let Some(word) = words.next() {
        let Some((value, decimals, glued)) = number(word) else {
            label.push(word);
            continue;
        };
        let unit = match glued {
            Some(unit) => Some(unit.to_owned()),
            None => words.next_if(|next| is_unit(next)).map(str::to_owned),
        };
        if label.is_empty() && found.is_empty() {
            // A number that nothing names is no quantity, but may be part of a name: `2 Supply`.
            label.push(word);
            continue;
        }
        // `TC1 100 C raw 3991 uV` is about TC1; `Supply Voltage=24.1V Source Current=4.0mA` is about two things.
        let first = found.first().map(|quantity| quantity.label.as_str()).filter(|_| label.len() < 2);
        let label: Vec<&str> = first.into_iter().chain(std::mem::take(&mut label)).collect();
        let has_name = label.iter().any(|word| word.contains(char::is_alphabetic));
        if !has_name && unit.is_none() {
            // Numbers among numbers: a row of the stream that has lost its beginning.
            continue;
        }
        found.push(Quantity { label: label.join(" "), value, decimals, unit });
        if found.len() == MOST_QUANTITIES {
            break;
        }
    }
    found
}

/// Whether a line says that the pages have been switched on or off, as a unit may answer the key before its first page. A
/// heading that tells of both has something else to say.
pub fn is_switch(line: &str) -> bool {
    switch(line).is_some()
}

/// Which of the two such a line says: that they are on, or off.
pub fn switch(line: &str) -> Option<bool> {
    let words = Words::of(line);
    let on = ["on", "started", "enabled", "active", "running"];
    let off = ["off", "stopped", "disabled", "inactive"];
    let says = |states: &[&str]| words.iter().any(|word| states.contains(&word));
    let (is_on, is_off) = (says(&on), says(&off));
    let is_one = words.iter().any(|word| word.contains("diagnos")) && is_on != is_off && quantities(line).is_empty();
    is_one.then_some(is_on)
}

/// A word without the signs around it.
fn bare(word: &str) -> &str {
    let word = word.trim_matches(['(', ')', '[', ']', '<', '>', '*', '"', '\'']);
    word.trim_end_matches([':', '.']).trim_start_matches([':', '.'])
}

/// A decimal number, the digits behind its point, and a unit that is glued to it: `24.1V`.
fn number(word: &str) -> Option<(f64, usize, Option<&str>)> {
    let end = word.find(|c: char| !matches!(c, '0'..='9' | '.' | '+' | '-')).unwrap_or(word.len());
    let (digits, rest) = word.split_at(end);
    if !digits.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let value: f64 = digits.parse().ok()?;
    let decimals = digits.split_once('.').map_or(0, |(_, behind)| behind.len());
    match rest {
        "" => Some((value, decimals, None)),
        unit if is_unit(unit) => Some((value, decimals, Some(unit))),
        _ => None,
    }
}

fn is_unit(word: &str) -> bool {
    let word = word.to_lowercase().replace(['µ', 'μ'], "u");
    UNITS.iter().any(|unit| *unit == word || unit.to_lowercase() == word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Vec<(String, f64, Option<String>)> {
        quantities(line).into_iter().map(|quantity| (quantity.label, quantity.value, quantity.unit)).collect()
    }

    #[test]
    fn numbers_are_found_with_what_the_page_calls_them() {
        let quantity = |label: &str, value, unit: Option<&str>| (label.to_owned(), value, unit.map(str::to_owned));
        let table = [
            ("Supply Voltage: 24.10 V", vec![quantity("Supply Voltage", 24.1, Some("V"))]),
            ("VSUP=23.9V", vec![quantity("VSUP", 23.9, Some("V"))]),
            (
                "TC1  100.123 C   raw   3991 uV",
                vec![quantity("TC1", 100.123, Some("C")), quantity("TC1 raw", 3991.0, Some("uV"))],
            ),
            (
                "Supply Voltage=24.28V Source Current=4.000mA",
                vec![quantity("Supply Voltage", 24.28, Some("V")), quantity("Source Current", 4.0, Some("mA"))],
            ),
            ("7.300;  66.123;  81.685;  24.546", vec![]),
            ("275 ; 89.947", vec![]),
            ("1  24.5 C", vec![quantity("1", 24.5, Some("C"))]),
            ("Active Errors              0", vec![quantity("Active Errors", 0.0, None)]),
            ("Cold junction (°C) -12.5", vec![quantity("Cold junction °C", -12.5, None)]),
            (
                "RTD3 | 109.73 Ohm | 25.0 °C",
                vec![quantity("RTD3", 109.73, Some("Ohm")), quantity("RTD3", 25.0, Some("°C"))],
            ),
            ("Diagnostics   up 0:00:12", vec![]),
            ("CAN State  Pre-Operational", vec![]),
            ("12.5", vec![]),
            ("----------", vec![]),
            ("", vec![]),
        ];
        for (line, expected) in table {
            assert_eq!(read(line), expected, "{line:?}");
        }
    }

    #[test]
    fn what_answers_the_key_is_told_from_a_heading() {
        for line in
            ["Diagnostics ON.", "DIAGNOSTICS STARTED", "sDiagnostics: on", "Diagnostics OFF.", "diagnosis enabled"]
        {
            assert!(is_switch(line), "{line:?}");
            assert_eq!(switch(line), Some(!line.contains("OFF")), "{line:?}");
        }
        for line in
            ["--- Diagnostics ---", "Diagnostics (S: on/off)", "Diagnostics on: 12 s", "Supply on", "Diagnostics", ""]
        {
            assert!(!is_switch(line), "{line:?}");
        }
    }

    #[test]
    fn digits_behind_the_point_are_counted_as_printed() {
        let decimals = |line| quantities(line).iter().map(|quantity| quantity.decimals).collect::<Vec<_>>();
        assert_eq!(decimals("RTD1 70.0 C raw 4000 uV 24.125V"), [1, 0, 3]);
    }

    proptest! {
        #[test]
        fn any_text_is_read_without_complaint(line in "\\PC{0,200}") {
            prop_assert!(quantities(&line).len() <= MOST_QUANTITIES);
        }
    }
}
