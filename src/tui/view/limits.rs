//! What the unit's object dictionary says of its channels: their limits, and their averages.

use super::View;
use crate::canopen::{ObjectAddress, Value};
use crate::wire::stream::Source;

/// A channel's temperature limits in °C, as far as the unit showed them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Below it there is a low warning (4000h).
    pub low: Option<f64>,
    /// From it on there is a high warning (4010h).
    pub high: Option<f64>,
    /// From it on there is a high shutdown (4020h).
    pub shutdown: Option<f64>,
}

impl Limits {
    /// What a value is beyond these, in a word. The unit itself waits for its reaction delay (4030h) before it says so.
    pub fn word(self, value: f64) -> Option<&'static str> {
        match self {
            Limits { shutdown: Some(limit), .. } if value >= limit => Some("over shutdown"),
            Limits { high: Some(limit), .. } if value >= limit => Some("ok, high"),
            Limits { low: Some(limit), .. } if value < limit => Some("ok, low"),
            Limits { .. } => None,
        }
    }
}

/// Objects of both products with a limit for each channel (manuals, sections 3.4.12 to 3.4.14).
const LOW_WARNING: u16 = 0x4000;
const HIGH_WARNING: u16 = 0x4010;
const HIGH_SHUTDOWN: u16 = 0x4020;
/// Means of the valid channels, by bank and of all (manuals, section 3.4.3).
const AVERAGES: u16 = 0x2100;
/// They are in tenths of a degree.
const LIMIT_STEPS: f64 = 10.0;

impl View {
    /// The limits of a channel, once the object dictionary has been read; `None` for one without.
    pub fn limits(&self, channel: &str) -> Option<Limits> {
        let dictionary = &self.product()?.dictionary;
        let limit = |index| {
            let sub = dictionary.object(index)?.entries.iter().find(|entry| entry.name == channel)?.sub;
            Some(self.read_value(index, sub)?.as_integer()? as f64 / LIMIT_STEPS)
        };
        let limits = Limits { low: limit(LOW_WARNING), high: limit(HIGH_WARNING), shutdown: limit(HIGH_SHUTDOWN) };
        (limits != Limits::default()).then_some(limits)
    }

    /// The channels whose newest value has reached their shutdown limit, with both; the unit itself waits for its reaction
    /// delay (4030h) before it says so.
    pub fn over_shutdown(&self) -> Vec<(&str, f64, f64)> {
        let stream = &self.unit.monitor.stream;
        // They are temperatures: beside counts they would say nothing.
        let channels = stream.channels.iter().filter(|_| stream.source == Some(Source::FieldValue));
        channels
            .filter_map(|channel| {
                let (value, limit) = (channel.reading.value()?, self.limits(&channel.name)?.shutdown?);
                (value >= limit).then_some((channel.name.as_str(), value, limit))
            })
            .collect()
    }

    /// The averages as they were when the object dictionary was read: of what, and in °C.
    pub fn averages(&self) -> Vec<(&str, f64)> {
        let object = self.product().and_then(|product| product.dictionary.object(AVERAGES));
        let entries = object.into_iter().flat_map(|object| &object.entries).filter(|entry| entry.sub > 0);
        let read = |sub| match self.read_value(AVERAGES, sub)? {
            Value::Real32(value) => Some(f64::from(value)),
            _ => None,
        };
        entries.filter_map(|entry| Some((entry.name.as_str(), read(entry.sub)?))).collect()
    }

    fn read_value(&self, index: u16, sub: u8) -> Option<Value> {
        let entries = &self.current_dictionary()?.reading.entries;
        entries.iter().find(|read| read.at == ObjectAddress::new(index, sub))?.value()
    }
}
