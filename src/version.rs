//! Software versions as units and files write them: `V1.2.3`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A software version: major, minor, patch. Ordered, so that a downgrade can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Version {
    /// First number.
    pub major: u16,
    /// Second number.
    pub minor: u16,
    /// Third number.
    pub patch: u16,
}

impl Version {
    /// Makes a version of its three numbers.
    pub const fn new(major: u16, minor: u16, patch: u16) -> Self {
        Version { major, minor, patch }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// The text is not three numbers with points between them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is not a version like 1.2.3")]
pub struct NotAVersion(String);

impl FromStr for Version {
    type Err = NotAVersion;

    /// Reads `1.2.3`, with or without a `V` in front.
    fn from_str(text: &str) -> Result<Self, NotAVersion> {
        let complaint = || NotAVersion(text.to_owned());
        let digits = text.strip_prefix(['V', 'v']).unwrap_or(text);
        let mut numbers = digits.split('.').map(|part| {
            let plain = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            plain.then(|| part.parse::<u16>().ok()).flatten()
        });
        let mut next = || numbers.next().flatten().ok_or_else(complaint);
        let version = Version::new(next()?, next()?, next()?);
        if numbers.next().is_some() { Err(complaint()) } else { Ok(version) }
    }
}

impl From<Version> for String {
    fn from(version: Version) -> String {
        version.to_string()
    }
}

impl TryFrom<String> for Version {
    type Error = NotAVersion;

    fn try_from(text: String) -> Result<Self, NotAVersion> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_read_and_compare_by_number() {
        assert_eq!("V1.10.0".parse(), Ok(Version::new(1, 10, 0)));
        assert!(Version::new(1, 10, 0) > Version::new(1, 9, 9));
        for text in ["", "1", "1.2", "1.2.3.4", "1..3", "1.2.x", "+1.2.3", "1.2.99999", "VV1.2.3"] {
            assert!(text.parse::<Version>().is_err(), "{text:?}");
        }
    }
}
