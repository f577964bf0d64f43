//! Index and sub-index: where an entry lies in an object dictionary.

use std::fmt;
use std::str::FromStr;

/// An entry's place in the object dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectAddress {
    /// Index of the object.
    pub index: u16,
    /// Sub-index of the entry; 0 for an object that is a single variable.
    pub sub: u8,
}

impl ObjectAddress {
    /// The place with this index and sub-index.
    pub const fn new(index: u16, sub: u8) -> Self {
        ObjectAddress { index, sub }
    }
}

/// `6126:01`: index and sub-index in hexadecimal digits.
impl fmt::Display for ObjectAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}:{:02X}", self.index, self.sub)
    }
}

/// Text that names no entry.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not an entry of an object dictionary: write index and sub-index in hexadecimal digits, e.g. 6126:1")]
pub struct ObjectAddressError(String);

/// Reads `6126:1`, `6126h:1`, `0x6126:01`; a missing sub-index is 0.
impl FromStr for ObjectAddress {
    type Err = ObjectAddressError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (index, sub) = text.split_once(':').unwrap_or((text, "0"));
        let number = |digits: &str| {
            let digits = digits.trim();
            let digits = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")).unwrap_or(digits);
            let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
            let plain = !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            plain.then(|| u16::from_str_radix(digits, 16).ok()).flatten()
        };
        number(index)
            .zip(number(sub).and_then(|sub| u8::try_from(sub).ok()))
            .map(|(index, sub)| ObjectAddress { index, sub })
            .ok_or_else(|| ObjectAddressError(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_named_by_hexadecimal_digits() {
        for text in ["6126:1", "6126h:01", "0x6126:1", " 6126 : 1h "] {
            assert_eq!(text.parse(), Ok(ObjectAddress::new(0x6126, 1)), "{text}");
        }
        assert_eq!("5000".parse(), Ok(ObjectAddress::new(0x5000, 0)));
        for text in ["", ":", "6126:", "x", "6126:100", "16126:1", "6126:-1", "+126:1"] {
            assert!(text.parse::<ObjectAddress>().is_err(), "{text}");
        }
        assert_eq!(ObjectAddress::new(0x1A00, 0x11).to_string(), "1A00:11");
    }
}
