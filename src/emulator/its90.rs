//! Thermoelectric voltages of types J, K and T and the temperatures they mean: the reference functions of ITS-90 (NIST
//! Monograph 175), and their inverses by iteration on the functions themselves.

/// A type of thermocouple, as object 6110h of the AXTC4CO names it (manual, section 3.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thermocouple {
    /// Iron and constantan.
    J,
    /// Chromel and alumel.
    K,
    /// Copper and constantan.
    T,
}

/// A part of a reference function: a polynomial in °C for µV, up to a temperature.
struct Piece {
    up_to: f64,
    coefficients: &'static [f64],
    /// The term a0 exp(a1 (t - a2)²) of type K above 0 °C.
    hump: Option<[f64; 3]>,
}

/// The most steps of the iteration: it halves its interval at worst.
const MOST_STEPS: usize = 80;
/// The iteration ends when a step is smaller than this, in °C.
const CLOSE_ENOUGH: f64 = 1e-7;

impl Thermocouple {
    /// The type with this number in object 6110h.
    pub fn from_object(number: i64) -> Option<Self> {
        match number {
            1 => Some(Thermocouple::J),
            2 => Some(Thermocouple::K),
            7 => Some(Thermocouple::T),
            _ => None,
        }
    }

    /// Lowest and highest temperature of its table in °C.
    pub fn range(self) -> (f64, f64) {
        match self {
            Thermocouple::J => (-210.0, 1_200.0),
            Thermocouple::K => (-270.0, 1_372.0),
            Thermocouple::T => (-270.0, 400.0),
        }
    }

    /// Voltage against a reference at 0 °C, in µV; a temperature beyond the table is taken as its end.
    pub fn microvolts(self, celsius: f64) -> f64 {
        let (low, high) = self.range();
        self.evaluate(celsius.clamp(low, high)).0
    }

    /// Temperature in °C at a voltage against a reference at 0 °C; beyond the table its end (errata E-41).
    pub fn celsius(self, microvolts: f64) -> f64 {
        let (mut low, mut high) = self.range();
        if microvolts <= self.evaluate(low).0 {
            return low;
        }
        if microvolts >= self.evaluate(high).0 {
            return high;
        }
        // Newton's method within an interval that is known to hold the solution: the functions only rise.
        let mut celsius = (microvolts / 50.0).clamp(low, high);
        for _ in 0..MOST_STEPS {
            let (value, slope) = self.evaluate(celsius);
            if value > microvolts {
                high = celsius;
            } else {
                low = celsius;
            }
            let newton = celsius - (value - microvolts) / slope;
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            if (next - celsius).abs() < CLOSE_ENOUGH {
                return next;
            }
            celsius = next;
        }
        celsius
    }

    /// Value and slope.
    fn evaluate(self, t: f64) -> (f64, f64) {
        let pieces = match self {
            Thermocouple::J => &TYPE_J,
            Thermocouple::K => &TYPE_K,
            Thermocouple::T => &TYPE_T,
        };
        let [lower, upper] = pieces;
        let piece = if t <= lower.up_to { lower } else { upper };
        let (mut value, mut slope) = (0.0, 0.0);
        for coefficient in piece.coefficients.iter().rev() {
            slope = slope * t + value;
            value = value * t + coefficient;
        }
        if let Some([a0, a1, a2]) = piece.hump {
            let term = a0 * (a1 * (t - a2) * (t - a2)).exp();
            value += term;
            slope += term * 2.0 * a1 * (t - a2);
        }
        (value, slope)
    }
}

const TYPE_J: [Piece; 2] = [
    Piece {
        up_to: 760.0,
        coefficients: &[
            0.0,
            5.038_118_781_50e1,
            3.047_583_693_00e-2,
            -8.568_106_572_00e-5,
            1.322_819_529_50e-7,
            -1.705_295_833_70e-10,
            2.094_809_069_70e-13,
            -1.253_839_533_60e-16,
            1.563_172_569_70e-20,
        ],
        hump: None,
    },
    Piece {
        up_to: 1_200.0,
        coefficients: &[
            2.964_562_568_10e5,
            -1.497_612_778_60e3,
            3.178_710_392_40,
            -3.184_768_670_10e-3,
            1.572_081_900_40e-6,
            -3.069_136_905_60e-10,
        ],
        hump: None,
    },
];

const TYPE_K: [Piece; 2] = [
    Piece {
        up_to: 0.0,
        coefficients: &[
            0.0,
            3.945_012_802_50e1,
            2.362_237_359_80e-2,
            -3.285_890_678_40e-4,
            -4.990_482_877_70e-6,
            -6.750_905_917_30e-8,
            -5.741_032_742_80e-10,
            -3.108_887_289_40e-12,
            -1.045_160_936_50e-14,
            -1.988_926_687_80e-17,
            -1.632_269_748_60e-20,
        ],
        hump: None,
    },
    Piece {
        up_to: 1_372.0,
        coefficients: &[
            -1.760_041_368_60e1,
            3.892_120_497_50e1,
            1.855_877_003_20e-2,
            -9.945_759_287_40e-5,
            3.184_094_571_90e-7,
            -5.607_284_488_90e-10,
            5.607_505_905_90e-13,
            -3.202_072_000_30e-16,
            9.715_114_715_20e-20,
            -1.210_472_127_50e-23,
        ],
        hump: Some([1.185_976e2, -1.183_432e-4, 1.269_686e2]),
    },
];

const TYPE_T: [Piece; 2] = [
    Piece {
        up_to: 0.0,
        coefficients: &[
            0.0,
            3.874_810_636_40e1,
            4.419_443_434_70e-2,
            1.184_432_310_50e-4,
            2.003_297_355_40e-5,
            9.013_801_955_90e-7,
            2.265_115_659_30e-8,
            3.607_115_420_50e-10,
            3.849_393_988_30e-12,
            2.821_352_192_50e-14,
            1.425_159_477_90e-16,
            4.876_866_228_60e-19,
            1.079_553_927_00e-21,
            1.394_502_706_20e-24,
            7.979_515_392_70e-28,
        ],
        hump: None,
    },
    Piece {
        up_to: 400.0,
        coefficients: &[
            0.0,
            3.874_810_636_40e1,
            3.329_222_788_00e-2,
            2.061_824_340_40e-4,
            -2.188_225_684_60e-6,
            1.099_688_092_80e-8,
            -3.081_575_877_20e-11,
            4.547_913_529_00e-14,
            -2.751_290_167_30e-17,
        ],
        hump: None,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Thermocouple; 3] = [Thermocouple::J, Thermocouple::K, Thermocouple::T];

    /// Millivolts at temperatures in °C, as the tables of ITS-90 print them.
    const TABLES: [(Thermocouple, &[(f64, f64)]); 3] = [
        (
            Thermocouple::J,
            &[
                (-210.0, -8.095),
                (-200.0, -7.890),
                (-150.0, -6.500),
                (-100.0, -4.633),
                (-50.0, -2.431),
                (-10.0, -0.501),
                (0.0, 0.0),
                (10.0, 0.507),
                (25.0, 1.277),
                (50.0, 2.585),
                (100.0, 5.269),
                (150.0, 8.010),
                (200.0, 10.779),
                (250.0, 13.555),
                (300.0, 16.327),
                (400.0, 21.848),
                (500.0, 27.393),
                (600.0, 33.102),
                (700.0, 39.132),
                (760.0, 42.919),
                (800.0, 45.494),
                (900.0, 51.877),
                (1000.0, 57.953),
                (1100.0, 63.792),
                (1200.0, 69.553),
            ],
        ),
        (
            Thermocouple::K,
            &[
                (-270.0, -6.458),
                (-250.0, -6.404),
                (-200.0, -5.891),
                (-150.0, -4.913),
                (-100.0, -3.554),
                (-50.0, -1.889),
                (-10.0, -0.392),
                (0.0, 0.0),
                (10.0, 0.397),
                (25.0, 1.000),
                (50.0, 2.023),
                (100.0, 4.096),
                (150.0, 6.138),
                (200.0, 8.138),
                (250.0, 10.153),
                (300.0, 12.209),
                (400.0, 16.397),
                (500.0, 20.644),
                (600.0, 24.905),
                (700.0, 29.129),
                (800.0, 33.275),
                (900.0, 37.326),
                (1000.0, 41.276),
                (1200.0, 48.838),
                (1372.0, 54.886),
            ],
        ),
        (
            Thermocouple::T,
            &[
                (-270.0, -6.258),
                (-250.0, -6.180),
                (-200.0, -5.603),
                (-150.0, -4.648),
                (-100.0, -3.379),
                (-50.0, -1.819),
                (-10.0, -0.383),
                (0.0, 0.0),
                (10.0, 0.391),
                (25.0, 0.992),
                (50.0, 2.036),
                (100.0, 4.279),
                (150.0, 6.704),
                (200.0, 9.288),
                (250.0, 12.013),
                (300.0, 14.862),
                (350.0, 17.819),
                (400.0, 20.872),
            ],
        ),
    ];

    // B-063
    #[test]
    fn voltages_are_those_of_the_tables() {
        for (thermocouple, table) in TABLES {
            for &(celsius, millivolts) in table {
                let computed = thermocouple.microvolts(celsius) / 1_000.0;
                assert!(
                    (computed - millivolts).abs() <= 0.000_51,
                    "{thermocouple:?} at {celsius} °C: {computed:.4} mV, printed {millivolts}"
                );
            }
        }
    }

    #[test]
    fn temperatures_come_back_over_the_whole_range() {
        for thermocouple in ALL {
            let (low, high) = thermocouple.range();
            let tenths = ((high - low) * 10.0) as i32;
            for tenth in 0..=tenths {
                let celsius = low + f64::from(tenth) / 10.0;
                let back = thermocouple.celsius(thermocouple.microvolts(celsius));
                assert!((back - celsius).abs() < 0.01, "{thermocouple:?} at {celsius}: {back}");
            }
        }
    }

    #[test]
    fn a_voltage_beyond_the_table_is_its_end() {
        for thermocouple in ALL {
            let (low, high) = thermocouple.range();
            assert_eq!((thermocouple.celsius(-1e6), thermocouple.celsius(1e6)), (low, high));
            assert_eq!(thermocouple.microvolts(9_999.0), thermocouple.microvolts(high));
        }
    }
}
