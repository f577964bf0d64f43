//! Numbers as an engineer reads them: `-20.0 °C`, where the unit keeps `-200` in steps of `0.1 °C`.
//!
//! Only for people. Files keep what the unit keeps.

/// How the numbers of an entry express a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// What a number counts, in `unit`s; `None` where it is the quantity itself.
    step: Option<f64>,
    /// The physical unit, without the number before it.
    pub unit: String,
}

impl Measure {
    /// Of what a product's file says the unit of a value is: `°C`, `0.1 °C`, `100 µs`.
    pub fn of(unit: &str) -> Self {
        let step = unit.split_once(' ').and_then(|(number, rest)| Some((number.parse::<f64>().ok()?, rest)));
        match step.filter(|(step, _)| step.is_normal()) {
            // Nobody counts in hundreds of microseconds.
            Some((step, "µs")) if step >= 100.0 => Measure { step: Some(step / 1000.0), unit: "ms".into() },
            Some((step, rest)) => Measure { step: Some(step), unit: rest.to_owned() },
            None if unit.starts_with("10^") => Measure { step: None, unit: format!("×{unit}") },
            None => Measure { step: None, unit: unit.to_owned() },
        }
    }

    /// Whether what people read is another number than what the unit keeps.
    pub fn is_scaled(&self) -> bool {
        self.step.is_some()
    }

    /// A number without its unit; `raw` is how it is written where nothing is to be scaled.
    pub fn number(&self, value: f64, raw: &str) -> String {
        let Some(step) = self.step else { return raw.to_owned() };
        let decimals = decimals(step);
        format!("{:.decimals$}", value * step + 0.0)
    }

    /// A number with its unit.
    pub fn quantity(&self, value: f64, raw: &str) -> String {
        format!("{} {}", self.number(value, raw), self.unit)
    }
}

/// Decimal places that a step has, so that no number of steps needs more.
fn decimals(step: f64) -> usize {
    let is_whole = |decimals: &i32| {
        let shifted = step * 10f64.powi(*decimals);
        (shifted - shifted.round()).abs() < 1e-6 && shifted.round() != 0.0
    };
    (0..9).find(is_whole).unwrap_or(9) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_become_quantities_and_quantities_stay() {
        let shown = |unit: &str, raw: &str| Measure::of(unit).quantity(raw.parse().expect("a number"), raw);
        let table = [
            ("0.1 °C", "-200", "-20.0 °C"),
            ("0.1 °C", "0", "0.0 °C"),
            ("0.1 °C", "17350", "1735.0 °C"),
            ("100 µs", "15", "1.5 ms"),
            ("0.01 V", "2400", "24.00 V"),
            ("°C", "23.5", "23.5 °C"),
            ("ms", "1000", "1000 ms"),
            ("10^-3 /°C", "3.9083", "3.9083 ×10^-3 /°C"),
            ("0 V", "5", "5 0 V"),
        ];
        for (unit, raw, expected) in table {
            assert_eq!(shown(unit, raw), expected, "{raw} {unit}");
        }
        assert!(Measure::of("0.1 °C").is_scaled() && !Measure::of("°C").is_scaled());
    }

    #[test]
    fn every_unit_of_the_products_is_read() {
        for product in crate::device::Product::all() {
            for (at, _, entry) in product.dictionary.entries() {
                let measure = entry.unit.as_deref().map(Measure::of);
                let is_step = |measure: &Measure| measure.unit.starts_with(|c: char| c.is_ascii_digit());
                assert!(!measure.as_ref().is_some_and(is_step), "{} {at}: {measure:?}", product.name);
            }
        }
    }
}
