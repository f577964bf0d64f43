//! Errors as the list 1003h and EMCY messages name them, in words (AXTC4CO manual, section 3.2.4, tables 2 and 3;
//! AXRTD8CO manual, section 3.2.4, tables 3 and 4).

use std::fmt;

use super::{Product, SensorKind};

/// An error: the 32 bits of an entry of 1003h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// EMCY error code, bits 15-0.
    pub code: u16,
    /// Channel, bits 23-16; for a heartbeat that is missing the node-ID it should come from.
    pub channel: u8,
    /// What kind of error, bits 31-24.
    pub description: u8,
}

impl From<u32> for Emergency {
    fn from(entry: u32) -> Self {
        let [description, channel, high, low] = entry.to_be_bytes();
        Emergency { code: u16::from_be_bytes([high, low]), channel, description }
    }
}

impl From<Emergency> for u32 {
    fn from(Emergency { code, channel, description }: Emergency) -> u32 {
        let [high, low] = code.to_be_bytes();
        u32::from_be_bytes([description, channel, high, low])
    }
}

impl fmt::Display for Emergency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02X}{:02X}{:04X}h", self.description, self.channel, self.code)
    }
}

impl Emergency {
    /// In words: `TC2: open circuit`. What the manual does not name is shown as it is.
    pub fn words(self, product: &Product) -> String {
        let what = match (self.code, self.description) {
            (0x0000, _) => return "no error".into(),
            (0x8110, _) => return "CAN overrun".into(),
            (0x8130, 0x10) => return "life guarding: the master is silent".into(),
            (0x8130, 0x80) => return format!("no heartbeat from node {}", self.channel),
            (0xF001, 0x04) => "short circuit",
            (0xF001, 0x02) => "open circuit",
            (0xF001, _) if product.measurement.sensors == SensorKind::Thermocouple => "open circuit",
            (0xF011, 0x10) => "low warning threshold exceeded",
            (0xF011, 0x20) => "high warning threshold exceeded",
            (0xF011, 0x40) => "high shutdown threshold exceeded",
            (0xFF00, 0x08) => "math error",
            (0xFF00, 0x80) => "frozen data from the converter",
            _ => return format!("error {self}"),
        };
        format!("{}: {what}", self.channel_name(product))
    }

    /// The channel as the stream names it: `TC2`.
    fn channel_name(self, product: &Product) -> String {
        let inputs = usize::from(product.measurement.channels);
        let names = &product.stream.channels;
        // A unit may send its cold junction before its inputs.
        let in_front = names.len().saturating_sub(inputs);
        let place = usize::from(self.channel).checked_sub(1).filter(|place| *place < inputs);
        let name = place.and_then(|place| names.get(in_front + place));
        name.cloned().unwrap_or_else(|| format!("channel {}", self.channel))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_in_the_manuals_words() {
        let words =
            |product: &str, entry: u32| Emergency::from(entry).words(Product::named(product).expect("built in"));
        for (product, entry, expected) in [
            ("AXTC4CO", 0x0002_F001, "TC2: open circuit"),
            ("AXTC4CO", 0x4004_F011, "TC4: high shutdown threshold exceeded"),
            ("AXTC4CO", 0x1000_8130, "life guarding: the master is silent"),
            ("AXTC4CO", 0x8021_8130, "no heartbeat from node 33"),
            ("AXTC4CO", 0x0000_8110, "CAN overrun"),
            ("AXTC4CO", 0x0009_F001, "channel 9: open circuit"),
            ("AXTC4CO", 0x1234_5678, "error 12345678h"),
            ("AXTC4CO", 0, "no error"),
            ("AXRTD8CO", 0x0208_F001, "RTD8: open circuit"),
            ("AXRTD8CO", 0x0401_F001, "RTD1: short circuit"),
            ("AXRTD8CO", 0x0001_F001, "error 0001F001h"),
            ("AXRTD8CO", 0x8003_FF00, "RTD3: frozen data from the converter"),
            ("AXRTD8CO", 0x0800_FF00, "channel 0: math error"),
        ] {
            assert_eq!(words(product, entry), expected, "{entry:08X}");
            assert_eq!(u32::from(Emergency::from(entry)), entry, "there and back");
        }
    }
}
