//! Units of measurement, as devices print them.

/// A unit in one spelling, and what it measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// What it measures, in a word: `voltage`.
    pub quantity: &'static str,
    /// How it is written here, in ASCII: `mV`, `ohm`.
    pub name: &'static str,
}

/// The unit a word is, in any case and with any sign for "micro". `None` for any other word.
pub fn unit(word: &str) -> Option<Unit> {
    let (quantity, name) = match word.to_lowercase().replace(['µ', 'μ'], "u").as_str() {
        "v" => ("voltage", "V"),
        "mv" => ("voltage", "mV"),
        "uv" => ("voltage", "uV"),
        "a" => ("current", "A"),
        "ma" => ("current", "mA"),
        "ua" => ("current", "uA"),
        "w" => ("power", "W"),
        "s" | "sec" => ("time", "s"),
        "ms" => ("time", "ms"),
        "us" => ("time", "us"),
        "min" => ("time", "min"),
        "c" | "°c" | "degc" | "deg" => ("temperature", "C"),
        "f" | "°f" | "degf" => ("temperature", "F"),
        "ohm" | "ohms" | "ω" => ("resistance", "ohm"),
        "kohm" => ("resistance", "kohm"),
        "hz" => ("frequency", "Hz"),
        "khz" => ("frequency", "kHz"),
        "kbit/s" | "kbps" => ("bit rate", "kbit/s"),
        "%" => ("share", "%"),
        _ => return None,
    };
    Some(Unit { quantity, name })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_known_in_its_usual_spellings() {
        for (word, name) in
            [("µV", "uV"), ("μV", "uV"), ("UV", "uV"), ("°C", "C"), ("Ω", "ohm"), ("kOhm", "kohm"), ("%", "%")]
        {
            assert_eq!(unit(word).map(|unit| unit.name), Some(name), "{word}");
        }
        for word in ["", "volt", "TC1", "°", "k"] {
            assert_eq!(unit(word), None, "{word}");
        }
    }
}
