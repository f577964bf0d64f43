//! Resistance of a platinum sensor as a function of its temperature: the Callendar-Van Dusen equation (AXRTD8CO manual,
//! section 1.2), R(t) = R0 (1 + A t + B t² + C (t - 100) t³), the last term below 0 °C only.

/// Resistance at 0 °C in ohm, of every sensor: no number of the manual fits another (errata E-C1).
pub const R0: f64 = 100.0;

/// The constants of a sensor, in 1/°C, 1/°C² and 1/°C⁴.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// Constant A.
    pub a: f64,
    /// Constant B.
    pub b: f64,
    /// Constant C.
    pub c: f64,
}

/// Units of objects 3010h, 3020h and 3030h: 10⁻³, 10⁻⁷ and 10⁻¹² (section 1.2, table 1).
pub const SCALE: [f64; 3] = [1e-3, 1e-7, 1e-12];

/// Values of 3010h, 3020h and 3030h for the coefficients 1 to 5 of object 3000h (table 1).
const COEFFICIENTS: [[f32; 3]; 5] = [
    [3.9083, -5.775, -4.18301],
    [3.974_673, -5.8973, -4.353],
    [3.96, -5.93, -4.3],
    [3.9848, -5.87, -4.0],
    [3.981_531, -5.853_116, -4.354_53],
];

/// What object 3000h loads into 3010h, 3020h and 3030h; `None` for 0, the user's own.
pub fn coefficients(selected: i64) -> Option<[f32; 3]> {
    let place = usize::try_from(selected.checked_sub(1)?).ok()?;
    COEFFICIENTS.get(place).copied()
}

/// The most steps of the iteration; it needs four from anywhere in the range.
const MOST_STEPS: usize = 50;
/// The iteration ends when a step is smaller than this, in °C.
const CLOSE_ENOUGH: f64 = 1e-9;

impl Curve {
    /// From the values of objects 3010h, 3020h and 3030h.
    pub fn from_objects(values: [f64; 3]) -> Self {
        let [a, b, c] = values;
        Curve { a: a * SCALE[0], b: b * SCALE[1], c: c * SCALE[2] }
    }

    /// Resistance in ohm at a temperature in °C.
    pub fn resistance(self, celsius: f64) -> f64 {
        R0 * self.ratio(celsius)
    }

    /// Temperature in °C at a resistance in ohm; `None` where the equation has no solution: a math error (errata E-C14,
    /// E-C15).
    pub fn temperature(self, ohm: f64) -> Option<f64> {
        let ratio = ohm / R0;
        let quadratic = self.quadratic(ratio)?;
        let celsius = if ratio >= 1.0 { quadratic } else { self.iterate(ratio, quadratic)? };
        celsius.is_finite().then_some(celsius)
    }

    fn ratio(self, t: f64) -> f64 {
        let above = 1.0 + self.a * t + self.b * t * t;
        if t < 0.0 { above + self.c * (t - 100.0) * t * t * t } else { above }
    }

    fn quadratic(self, ratio: f64) -> Option<f64> {
        let constant = 1.0 - ratio;
        if self.b == 0.0 {
            return (self.a != 0.0).then(|| -constant / self.a);
        }
        let discriminant = self.a * self.a - 4.0 * self.b * constant;
        (discriminant >= 0.0).then(|| (-self.a + discriminant.sqrt()) / (2.0 * self.b))
    }

    /// Newton's method on the full polynomial, for below 0 °C.
    fn iterate(self, ratio: f64, from: f64) -> Option<f64> {
        let mut t = from;
        for _ in 0..MOST_STEPS {
            let slope =
                self.a + 2.0 * self.b * t + if t < 0.0 { self.c * (4.0 * t * t * t - 300.0 * t * t) } else { 0.0 };
            let step = (self.ratio(t) - ratio) / slope;
            t -= step;
            if !t.is_finite() {
                return None;
            }
            if step.abs() < CLOSE_ENOUGH {
                return Some(t);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // B-21, B-22, B-24, B-28
    #[test]
    fn resistances_become_temperatures_on_all_five_curves() {
        let table = [
            (10.0, [-219.539, -216.021, -216.737, -215.811, -215.735]),
            (18.52, [-200.000, -196.776, -197.435, -196.528, -196.508]),
            (60.0, [-100.631, -98.973, -99.321, -98.753, -98.819]),
            (92.16, [-20.000, -19.667, -19.739, -19.617, -19.633]),
            (100.0, [0.0; 5]),
            (109.73, [24.988, 24.570, 24.662, 24.506, 24.526]),
            (138.5055, [100.000, 98.311, 98.695, 98.047, 98.126]),
            (194.10, [250.005, 245.707, 246.743, 244.989, 245.178]),
            (350.0, [715.259, 702.127, 705.940, 699.453, 699.915]),
        ];
        for (ohm, expected) in table {
            for (selected, expected) in (1..).zip(expected) {
                let curve = Curve::from_objects(coefficients(selected).expect("a curve").map(f64::from));
                let celsius = curve.temperature(ohm).expect("a temperature");
                assert!((celsius - expected).abs() < 0.01, "{ohm} ohm on curve {selected}: {celsius}, not {expected}");
            }
        }
        assert_eq!((coefficients(0), coefficients(6), coefficients(-1)), (None, None, None));
    }

    #[test]
    fn there_and_back_over_the_whole_range_is_the_same_temperature() {
        for selected in 1..=5 {
            let curve = Curve::from_objects(coefficients(selected).expect("a curve").map(f64::from));
            for tenth in -2_200..=8_500 {
                let celsius = f64::from(tenth) / 10.0;
                let back = curve.temperature(curve.resistance(celsius)).expect("a temperature");
                assert!((back - celsius).abs() < 1e-6, "curve {selected} at {celsius}: {back}");
            }
        }
    }

    // B-45
    #[test]
    fn constants_without_a_solution_are_a_math_error() {
        assert_eq!(Curve::from_objects([1.0, -9.9, 0.0]).temperature(350.0), None, "a negative discriminant");
        assert_eq!(Curve::from_objects([0.0, 0.0, 0.0]).temperature(120.0), None, "no slope at all");
        assert!(Curve::from_objects([3.9, 0.0, 0.0]).temperature(139.0).is_some_and(|t| (t - 100.0).abs() < 1e-9));
    }
}
