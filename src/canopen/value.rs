//! Values of an object dictionary, with the types the units use (CiA 301, section 7.4.7).

use std::fmt;

use serde::Deserialize;

/// Type of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum DataType {
    /// True or false, a byte on the bus.
    Boolean,
    /// Signed, 8 bits.
    Integer8,
    /// Signed, 16 bits.
    Integer16,
    /// Signed, 32 bits.
    Integer32,
    /// Unsigned, 8 bits.
    Unsigned8,
    /// Unsigned, 16 bits.
    Unsigned16,
    /// Unsigned, 32 bits.
    Unsigned32,
    /// IEEE 754 single precision; the manuals call it FLOAT32.
    Real32,
}

/// A value of one of these types.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// See [`DataType::Boolean`].
    Boolean(bool),
    /// See [`DataType::Integer8`].
    Integer8(i8),
    /// See [`DataType::Integer16`].
    Integer16(i16),
    /// See [`DataType::Integer32`].
    Integer32(i32),
    /// See [`DataType::Unsigned8`].
    Unsigned8(u8),
    /// See [`DataType::Unsigned16`].
    Unsigned16(u16),
    /// See [`DataType::Unsigned32`].
    Unsigned32(u32),
    /// See [`DataType::Real32`].
    Real32(f32),
}

impl DataType {
    /// All types.
    pub const ALL: [DataType; 8] = [
        DataType::Boolean,
        DataType::Integer8,
        DataType::Integer16,
        DataType::Integer32,
        DataType::Unsigned8,
        DataType::Unsigned16,
        DataType::Unsigned32,
        DataType::Real32,
    ];

    /// Its index in the dictionary of types, as an EDS names it.
    pub const fn code(self) -> u16 {
        match self {
            DataType::Boolean => 0x0001,
            DataType::Integer8 => 0x0002,
            DataType::Integer16 => 0x0003,
            DataType::Integer32 => 0x0004,
            DataType::Unsigned8 => 0x0005,
            DataType::Unsigned16 => 0x0006,
            DataType::Unsigned32 => 0x0007,
            DataType::Real32 => 0x0008,
        }
    }

    /// Its name in the standard.
    pub const fn name(self) -> &'static str {
        match self {
            DataType::Boolean => "BOOLEAN",
            DataType::Integer8 => "INTEGER8",
            DataType::Integer16 => "INTEGER16",
            DataType::Integer32 => "INTEGER32",
            DataType::Unsigned8 => "UNSIGNED8",
            DataType::Unsigned16 => "UNSIGNED16",
            DataType::Unsigned32 => "UNSIGNED32",
            DataType::Real32 => "REAL32",
        }
    }

    /// Bytes a value takes on the bus.
    pub const fn bytes(self) -> usize {
        match self {
            DataType::Boolean | DataType::Integer8 | DataType::Unsigned8 => 1,
            DataType::Integer16 | DataType::Unsigned16 => 2,
            DataType::Integer32 | DataType::Unsigned32 | DataType::Real32 => 4,
        }
    }

    /// Lowest and highest whole number of the type; `None` for REAL32.
    pub const fn range(self) -> Option<(i64, i64)> {
        match self {
            DataType::Boolean => Some((0, 1)),
            DataType::Integer8 => Some((i8::MIN as i64, i8::MAX as i64)),
            DataType::Integer16 => Some((i16::MIN as i64, i16::MAX as i64)),
            DataType::Integer32 => Some((i32::MIN as i64, i32::MAX as i64)),
            DataType::Unsigned8 => Some((0, u8::MAX as i64)),
            DataType::Unsigned16 => Some((0, u16::MAX as i64)),
            DataType::Unsigned32 => Some((0, u32::MAX as i64)),
            DataType::Real32 => None,
        }
    }

    /// The whole number as a value of this type, if it fits; REAL32 takes those it can hold exactly enough.
    pub fn integer(self, number: i64) -> Option<Value> {
        Some(match self {
            DataType::Boolean => match number {
                0 => Value::Boolean(false),
                1 => Value::Boolean(true),
                _ => return None,
            },
            DataType::Integer8 => Value::Integer8(number.try_into().ok()?),
            DataType::Integer16 => Value::Integer16(number.try_into().ok()?),
            DataType::Integer32 => Value::Integer32(number.try_into().ok()?),
            DataType::Unsigned8 => Value::Unsigned8(number.try_into().ok()?),
            DataType::Unsigned16 => Value::Unsigned16(number.try_into().ok()?),
            DataType::Unsigned32 => Value::Unsigned32(number.try_into().ok()?),
            DataType::Real32 => Value::Real32(number as f32),
        })
    }

    /// Reads a value as people write it: decimal, `0x1F`, `1Fh`, with a point or an exponent for a REAL32, `true` or
    /// `false` for a BOOLEAN.
    pub fn parse(self, text: &str) -> Option<Value> {
        let text = text.trim();
        if self == DataType::Boolean {
            match text.to_ascii_lowercase().as_str() {
                "true" => return Some(Value::Boolean(true)),
                "false" => return Some(Value::Boolean(false)),
                _ => {}
            }
        }
        let hexadecimal = text
            .strip_prefix("0x")
            .or_else(|| text.strip_prefix("0X"))
            .or_else(|| text.strip_suffix(['h', 'H']))
            .filter(|digits| !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_hexdigit()));
        if let Some(digits) = hexadecimal {
            let bits = u32::from_str_radix(digits, 16).ok()?;
            return if self == DataType::Real32 {
                Some(Value::Real32(f32::from_bits(bits)))
            } else {
                self.integer(i64::from(bits))
            };
        }
        match self {
            DataType::Real32 => text.parse().ok().filter(|value: &f32| value.is_finite()).map(Value::Real32),
            _ => text.parse().ok().and_then(|number| self.integer(number)),
        }
    }

    /// Reads a value as it is on the bus; `None` if the length is not that of the type, or a BOOLEAN is neither 0 nor
    /// 1.
    pub fn decode(self, bytes: &[u8]) -> Option<Value> {
        Some(match self {
            DataType::Boolean => match bytes {
                [0] => Value::Boolean(false),
                [1] => Value::Boolean(true),
                _ => return None,
            },
            DataType::Integer8 => Value::Integer8(i8::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Integer16 => Value::Integer16(i16::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Integer32 => Value::Integer32(i32::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Unsigned8 => Value::Unsigned8(u8::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Unsigned16 => Value::Unsigned16(u16::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Unsigned32 => Value::Unsigned32(u32::from_le_bytes(bytes.try_into().ok()?)),
            DataType::Real32 => Value::Real32(f32::from_le_bytes(bytes.try_into().ok()?)),
        })
    }
}

impl Value {
    /// What a REAL32 holds when there is no value: FFFFFFFFh, which is not a number (AXTC4CO manual, section 3.3.3).
    pub const NOT_A_NUMBER: Value = Value::Real32(f32::from_bits(0xFFFF_FFFF));

    /// Its type.
    pub const fn data_type(self) -> DataType {
        match self {
            Value::Boolean(_) => DataType::Boolean,
            Value::Integer8(_) => DataType::Integer8,
            Value::Integer16(_) => DataType::Integer16,
            Value::Integer32(_) => DataType::Integer32,
            Value::Unsigned8(_) => DataType::Unsigned8,
            Value::Unsigned16(_) => DataType::Unsigned16,
            Value::Unsigned32(_) => DataType::Unsigned32,
            Value::Real32(_) => DataType::Real32,
        }
    }

    /// The bytes on the bus, lowest first.
    pub fn encode(self) -> Vec<u8> {
        match self {
            Value::Boolean(value) => vec![u8::from(value)],
            Value::Integer8(value) => value.to_le_bytes().to_vec(),
            Value::Integer16(value) => value.to_le_bytes().to_vec(),
            Value::Integer32(value) => value.to_le_bytes().to_vec(),
            Value::Unsigned8(value) => vec![value],
            Value::Unsigned16(value) => value.to_le_bytes().to_vec(),
            Value::Unsigned32(value) => value.to_le_bytes().to_vec(),
            Value::Real32(value) => value.to_le_bytes().to_vec(),
        }
    }

    /// The whole number; `None` for a REAL32.
    pub fn as_integer(self) -> Option<i64> {
        Some(match self {
            Value::Boolean(value) => i64::from(value),
            Value::Integer8(value) => i64::from(value),
            Value::Integer16(value) => i64::from(value),
            Value::Integer32(value) => i64::from(value),
            Value::Unsigned8(value) => i64::from(value),
            Value::Unsigned16(value) => i64::from(value),
            Value::Unsigned32(value) => i64::from(value),
            Value::Real32(_) => return None,
        })
    }

    /// The number, whatever its type.
    pub fn as_f64(self) -> f64 {
        match (self, self.as_integer()) {
            (Value::Real32(value), _) => f64::from(value),
            (_, Some(integer)) => integer as f64,
            (_, None) => f64::NAN,
        }
    }
}

/// Equal is what is the same on the bus: type and bits, so that "not a number" equals itself.
impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Value::Real32(one), Value::Real32(other)) => one.to_bits() == other.to_bits(),
            _ => self.data_type() == other.data_type() && self.as_integer() == other.as_integer(),
        }
    }
}

impl Eq for Value {}

/// The plain number: `1`, `-200`, `16.0`; not a number as its bits.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (*self, self.as_integer()) {
            (Value::Real32(value), _) if value.is_nan() => write!(f, "0x{:08X}", value.to_bits()),
            (Value::Real32(value), _) => write!(f, "{value:?}"),
            (_, Some(integer)) => write!(f, "{integer}"),
            (_, None) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_comes_back_from_its_bytes() {
        let values = [
            Value::Boolean(true),
            Value::Integer8(-5),
            Value::Integer16(-512),
            Value::Integer32(-70_000),
            Value::Unsigned8(0x61),
            Value::Unsigned16(65_535),
            Value::Unsigned32(0x6576_6173),
            Value::Real32(-23.5),
            Value::NOT_A_NUMBER,
        ];
        for value in values {
            let bytes = value.encode();
            assert_eq!(bytes.len(), value.data_type().bytes());
            assert_eq!(value.data_type().decode(&bytes), Some(value), "{value:?}");
            assert_eq!(
                value.data_type().decode(&[bytes.clone(), vec![0]].concat()),
                None,
                "{value:?}, a byte too many"
            );
            assert_eq!(value.data_type().decode(&bytes[1..]), None, "{value:?}, a byte too few");
        }
        assert_eq!(Value::Unsigned32(0x6576_6173).encode(), b"save");
        assert_eq!(DataType::Boolean.decode(&[2]), None);
    }

    #[test]
    fn whole_numbers_fit_or_are_refused() {
        for data_type in DataType::ALL {
            let Some((low, high)) = data_type.range() else { continue };
            assert_eq!(data_type.integer(low).and_then(Value::as_integer), Some(low));
            assert_eq!(data_type.integer(high).and_then(Value::as_integer), Some(high));
            assert_eq!((data_type.integer(low - 1), data_type.integer(high + 1)), (None, None), "{data_type:?}");
        }
    }

    #[test]
    fn values_are_read_as_people_write_them() {
        let table = [
            (DataType::Unsigned16, "0x1F", Some(Value::Unsigned16(31))),
            (DataType::Unsigned16, "1Fh", Some(Value::Unsigned16(31))),
            (DataType::Integer16, " -200 ", Some(Value::Integer16(-200))),
            (DataType::Real32, "1.5e2", Some(Value::Real32(150.0))),
            (DataType::Real32, "0xFFFFFFFF", Some(Value::NOT_A_NUMBER)),
            (DataType::Boolean, "True", Some(Value::Boolean(true))),
            (DataType::Boolean, "0", Some(Value::Boolean(false))),
            (DataType::Unsigned8, "256", None),
            (DataType::Unsigned8, "1.0", None),
            (DataType::Unsigned8, "h", None),
            (DataType::Real32, "inf", None),
            (DataType::Unsigned32, "", None),
        ];
        for (data_type, text, value) in table {
            assert_eq!(data_type.parse(text), value, "{text} as {data_type:?}");
        }
    }

    #[test]
    fn numbers_print_as_people_write_them() {
        let texts = [Value::Real32(16.0), Value::Integer16(-200), Value::NOT_A_NUMBER].map(|value| value.to_string());
        assert_eq!(texts, ["16.0", "-200", "0xFFFFFFFF"]);
    }
}
