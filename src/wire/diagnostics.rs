//! Pages of diagnostics, which S shows every second (AXTC4CO manual, section 4.1.4).
//!
//! What a page shows is lost with the manual's figures, so nothing is expected of it: wherever a line puts a number
//! after words, that is a quantity with its label. The page itself stays as printed.

use super::units::unit;
use super::words::Words;

/// A number on a page, and what the page calls it.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// The words before it. A further quantity with one word or none, such as `raw`, is about what was named before,
    /// and its label begins with that: `TC1 raw`.
    pub label: String,
    /// The number; `None` where it is not certain: `24,061` may be 24.061 or 24061.
    pub value: Option<f64>,
    /// Digits after its point, as printed: `70.0` says more than `70`.
    pub decimals: usize,
    /// The unit after it, as printed, if the next word is one.
    pub unit: Option<String>,
}

/// Most digits after the point that are reported: no unit measures more, and an exponent may be any number.
const MOST_DECIMALS: usize = 12;

/// Most quantities that are read from one line.
const MOST_QUANTITIES: usize = 64;

/// The quantities a line shows, in its order. A time like `0:01:02` and an address are not quantities.
pub fn quantities(line: &str) -> Vec<Quantity> {
    let mut found: Vec<Quantity> = Vec::new();
    // What numbers without a name of their own are about.
    let mut name = Name::default();
    for cell in line.split(is_cell_border) {
        if found.len() < MOST_QUANTITIES {
            of_cell(cell, &mut name, &mut found);
        }
    }
    found.truncate(MOST_QUANTITIES);
    found
}

/// What further numbers of a line are about.
#[derive(Default)]
struct Name {
    words: String,
    /// It was in a cell of its own: what the next cells begin with is about the same.
    is_for_all: bool,
}

/// The quantities of a line or of one cell of it.
fn of_cell(cell: &str, name: &mut Name, found: &mut Vec<Quantity>) {
    let mut label: Vec<&str> = Vec::new();
    let mut is_new_cell = true;
    let words = words(cell);
    let mut words = words.iter().copied().peekable();
    while let Some((word, is_equated)) = words.next() {
        let Some((value, decimals, glued)) = number(word) else {
            if word.contains(char::is_alphanumeric) || is_unit(word) {
                label.push(word.trim_end_matches(':'));
            }
            continue;
        };
        let unit = match glued {
            Some(unit) => Some(unit.to_owned()),
            None => words.next_if(|(next, _)| is_unit(next)).map(|(unit, _)| unit.to_owned()),
        };
        if label.is_empty() && name.words.is_empty() {
            // A number that nothing names is not a quantity, but may be part of a name: `2 Supply`.
            label.push(word);
            continue;
        }
        // `TC1 100 C raw 3991 uV` is about TC1; `Supply Voltage=24.1V Isrc=4.0mA` is about two things, and so is
        // `TC1 100 C | TC2 80 C`.
        let starts_anew = name.words.is_empty() || label.len() > 1 || (is_equated && !label.is_empty());
        let starts_anew = starts_anew || (is_new_cell && !label.is_empty() && !name.is_for_all);
        let own = std::mem::take(&mut label);
        let words = if starts_anew { own.join(" ") } else { [&[name.words.as_str()][..], &own].concat().join(" ") };
        let has_name = words.contains(char::is_alphabetic);
        if !has_name && unit.is_none() {
            // Numbers among numbers: a row of the stream that has lost its beginning.
            continue;
        }
        if starts_anew {
            *name = Name { words: words.clone(), is_for_all: false };
        }
        is_new_cell = false;
        found.push(Quantity { label: words, value, decimals, unit });
    }
    if !label.is_empty() && is_new_cell && name.words.is_empty() {
        *name = Name { words: label.join(" "), is_for_all: true };
    }
}

/// What separates the cells of a table: a bar, and those of a terminal that draws boxes.
fn is_cell_border(sign: char) -> bool {
    matches!(sign, '|' | '\u{2500}'..='\u{259F}')
}

/// The words of a cell, and whether an equals sign comes before each. A comma within a number belongs to it.
fn words(cell: &str) -> Vec<(&str, bool)> {
    let mut words = Vec::new();
    let mut start = 0;
    let mut is_equated = false;
    let is_digit = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_digit);
    let bytes = cell.as_bytes();
    for (at, sign) in cell.char_indices().chain([(cell.len(), ' ')]) {
        let within_number = sign == ','
            && at > start
            && matches!(bytes[at - 1], b'0'..=b'9' | b'+' | b'-')
            && is_digit(bytes.get(at + 1))
            && cell[start..at].bytes().all(|byte| byte.is_ascii_digit() || b"+-.,".contains(&byte));
        if !matches!(sign, ' ' | '\t' | '=' | ';' | ',') || within_number {
            continue;
        }
        let word = bare(&cell[start..at]);
        if !word.is_empty() {
            words.push((word, is_equated));
            is_equated = false;
        }
        is_equated |= sign == '=';
        start = at + sign.len_utf8();
    }
    words
}

/// Whether a line says that the pages have been switched on or off, as a unit may answer the key before its first page.
/// A heading that names both is not such a line.
pub fn is_switch(line: &str) -> bool {
    switch(line).is_some()
}

/// What such a line says: `true` that pages are on, `false` that they are off.
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
    // In `RTD 5:` the number is part of a name: it keeps its colon, so that it is not read as a number.
    let is_ordinal = word.strip_suffix(':').is_some_and(|digits| digits.bytes().all(|digit| digit.is_ascii_digit()));
    let word = if is_ordinal { word } else { word.trim_end_matches([':', '.']) };
    let inner = word.trim_start_matches([':', '.']);
    // `.5` is a number, and `....5` leads to one.
    let dots = word.len() - inner.len();
    let is_fraction = dots == 1 && word.starts_with('.') && inner.starts_with(|first: char| first.is_ascii_digit());
    if is_fraction { word } else { inner }
}

/// A decimal number, the digits after its point, and a unit that is glued to it: `24.1V`. With a comma it has a value
/// only if the comma can only be a decimal one, as before an exponent.
fn number(word: &str) -> Option<(Option<f64>, usize, Option<&str>)> {
    let end = word.find(|c: char| !matches!(c, '0'..='9' | '.' | ',' | '+' | '-')).unwrap_or(word.len());
    let end = end + exponent(&word[..end], &word[end..]);
    let (digits, rest) = word.split_at(end);
    if !digits.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let commas = digits.matches(',').count();
    let is_decimal_comma = commas == 1 && !digits.contains('.') && digits.contains(['e', 'E']);
    let point = digits.replace(',', ".");
    let value: Option<f64> = match commas {
        0 => finite(digits)?,
        _ if is_decimal_comma => finite(&point)?,
        // With a sign in the middle, as in a range, it is no number at all.
        _ if digits[1..].contains(['+', '-']) => return None,
        _ => None,
    };
    let (mantissa, power) = point.split_once(['e', 'E']).unwrap_or((&point, "0"));
    let behind_point = mantissa.split_once('.').map_or(0, |(_, behind)| behind.len());
    let power: i64 = power.parse().unwrap_or(0);
    let decimals = usize::try_from(i64::try_from(behind_point).unwrap_or(0).saturating_sub(power)).unwrap_or(0);
    let decimals = decimals.min(MOST_DECIMALS);
    match rest {
        "" => Some((value, decimals, None)),
        unit if is_unit(unit) => Some((value, decimals, Some(unit))),
        _ => None,
    }
}

/// A number, and its value if it is not too large to have one; `None` if it is not a number.
fn finite(digits: &str) -> Option<Option<f64>> {
    digits.parse().ok().map(|value: f64| Some(value).filter(|value| value.is_finite()))
}

/// Length of an exponent after the digits of a mantissa. One without a sign, after digits without a point, may be
/// hexadecimal.
fn exponent(mantissa: &str, rest: &str) -> usize {
    let Some(power) = rest.strip_prefix(['e', 'E']) else { return 0 };
    let signed = usize::from(power.starts_with(['+', '-']));
    let digits = power[signed..].bytes().take_while(u8::is_ascii_digit).count();
    let is_one = (1..=3).contains(&digits) && (signed > 0 || mantissa.contains(['.', ',']));
    if is_one { 1 + signed + digits } else { 0 }
}

/// Whether a word is a unit. On a page `min` begins the smallest value.
fn is_unit(word: &str) -> bool {
    unit(word).is_some_and(|unit| unit.name != "min")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Vec<(String, Option<f64>, Option<String>)> {
        quantities(line).into_iter().map(|quantity| (quantity.label, quantity.value, quantity.unit)).collect()
    }

    fn quantity(label: &str, value: f64, unit: Option<&str>) -> (String, Option<f64>, Option<String>) {
        (label.to_owned(), Some(value), unit.map(str::to_owned))
    }

    #[test]
    fn numbers_are_found_with_what_the_page_calls_them() {
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
            ("RTD1 10.0 kohm raw 5", vec![quantity("RTD1", 10.0, Some("kohm")), quantity("RTD1 raw", 5.0, None)]),
            ("TC1 24.5 min 20.0 C", vec![quantity("TC1", 24.5, None), quantity("TC1 min", 20.0, Some("C"))]),
            ("1  24.5 C", vec![quantity("1", 24.5, Some("C"))]),
            ("Active Errors              0", vec![quantity("Active Errors", 0.0, None)]),
            ("Cold junction (°C) -12.5", vec![quantity("Cold junction °C", -12.5, None)]),
            (
                "RTD3 | 109.73 Ohm | 25.0 °C",
                vec![quantity("RTD3", 109.73, Some("Ohm")), quantity("RTD3", 25.0, Some("°C"))],
            ),
            (
                "Vsup=24.06V Isrc=4.000mA | RTD1 56.4C 121.9ohm | RTD2 -46.4C 81.7ohm | err=2",
                vec![
                    quantity("Vsup", 24.06, Some("V")),
                    quantity("Isrc", 4.0, Some("mA")),
                    quantity("RTD1", 56.4, Some("C")),
                    quantity("RTD1", 121.9, Some("ohm")),
                    quantity("RTD2", -46.4, Some("C")),
                    quantity("RTD2", 81.7, Some("ohm")),
                    quantity("err", 2.0, None),
                ],
            ),
            (
                "│ TC1 │ 191.980 °C │ raw 7440 │ OK │",
                vec![quantity("TC1", 191.98, Some("°C")), quantity("TC1 raw", 7440.0, None)],
            ),
            ("║ Supply voltage ║ 24.061 V ║", vec![quantity("Supply voltage", 24.061, Some("V"))]),
            ("╔══════════════╗", vec![]),
            ("TC1,24.5,C", vec![quantity("TC1", 24.5, Some("C"))]),
            ("Gain 1.5e-3 V", vec![quantity("Gain", 0.0015, Some("V"))]),
            ("Load .5 A", vec![quantity("Load", 0.5, Some("A"))]),
            ("Offset -.25 V", vec![quantity("Offset", -0.25, Some("V"))]),
            ("Load ....5 A", vec![quantity("Load", 5.0, Some("A"))]),
            ("Supply 2: ---", vec![]),
            ("RTD 5: not ready", vec![]),
            ("RTD 5: 23.5 C", vec![quantity("RTD 5", 23.5, Some("C"))]),
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
    fn a_number_with_a_comma_has_a_value_only_if_that_is_certain() {
        let unknown = |label: &str, unit: Option<&str>| (label.to_owned(), None, unit.map(str::to_owned));
        let table = [
            ("UB = 24,061V   CJC = 23,500°C", vec![unknown("UB", Some("V")), unknown("CJC", Some("°C"))]),
            ("TC1: 24,5 C raw 3991", vec![unknown("TC1", Some("C")), quantity("TC1 raw", 3991.0, None)]),
            ("Total 1,234.5", vec![unknown("Total", None)]),
            ("Total 1.234,5 V", vec![unknown("Total", Some("V"))]),
            ("TC1: 1,919800E+02 ; 7440 ; 00h", vec![quantity("TC1", 191.98, None), quantity("TC1", 7440.0, None)]),
            ("Supply 24.1, cold 23.5", vec![quantity("Supply", 24.1, None), quantity("Supply cold", 23.5, None)]),
            ("Errors 1,2-4", vec![]),
            ("Offset = -,5 V", vec![unknown("Offset", Some("V"))]),
            ("Code 1E5", vec![]),
            ("Supply 1.0e999 V", vec![unknown("Supply", Some("V"))]),
            ("Supply -1,0e999 V", vec![unknown("Supply", Some("V"))]),
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
        assert_eq!(decimals("RTD1 70.0 C raw 4000 uV 24.125V 1.9198e+02 5e-1"), [1, 0, 3, 2, 1]);
    }

    proptest! {
        #[test]
        fn a_decimal_comma_is_never_read_as_two_numbers(whole in 0u32..10_000, part in "[0-9]{1,6}", unit in "( ?V)?") {
            let line = format!("UB = {whole},{part}{unit}   CJC 23.5 C");
            let values: Vec<_> = quantities(&line).iter().map(|quantity| quantity.value).collect();
            prop_assert_eq!(values, [None, Some(23.5)]);
        }

        #[test]
        fn any_text_is_read_without_complaint(line in "\\PC{0,200}") {
            prop_assert!(quantities(&line).len() <= MOST_QUANTITIES);
        }
    }
}
