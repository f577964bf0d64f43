//! Active errors: what underlies the error register 1001h and the list 1003h (manuals, sections 3.2.2 and 3.2.4).
//!
//! The list holds what is active, the newest first; an error leaves it when it clears. After the list is cleared by hand,
//! an error that is still active is listed again only once it has cleared and returned (errata E-73, E-D13).

use std::collections::VecDeque;

use super::objects::Objects;
use crate::canopen::Value;
use crate::device::SensorKind;
use crate::device::emergency::Emergency;

/// Classes of errors that object 1029h tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The network: heartbeats, life guarding, overruns.
    Communication,
    /// The sensor: open and short circuits, and the thresholds of the AXTC4CO (errata E-71).
    Sensor,
    /// The thresholds of the AXRTD8CO.
    System,
    /// The converter and the computation of the AXRTD8CO.
    Scanner,
}

/// The active errors of a unit.
#[derive(Clone, Debug, Default)]
pub struct ActiveErrors {
    /// Oldest first.
    active: Vec<Emergency>,
    /// What 1003h shows, newest first.
    listed: VecDeque<Emergency>,
}

/// Open or short circuit (section 3.2.4, table of EMCY codes).
pub const INPUT_OVERLOAD: u16 = 0xF001;
/// A threshold is exceeded.
pub const LIMIT_EXCEEDED: u16 = 0xF011;
/// Frozen converter or math error, AXRTD8CO only.
pub const DEVICE_SPECIFIC: u16 = 0xFF00;

impl Class {
    /// The class of an error of a unit with these sensors.
    pub fn of(error: Emergency, sensors: SensorKind) -> Class {
        match sensors {
            SensorKind::Thermocouple => match error.code {
                INPUT_OVERLOAD | LIMIT_EXCEEDED => Class::Sensor,
                _ => Class::Communication,
            },
            SensorKind::Rtd => match error.code {
                INPUT_OVERLOAD => Class::Sensor,
                LIMIT_EXCEEDED => Class::System,
                DEVICE_SPECIFIC => Class::Scanner,
                _ => Class::Communication,
            },
        }
    }

    /// Its sub-index in the 1029h of a unit that has such errors.
    pub fn sub_index(self) -> u8 {
        match self {
            Class::Communication => 1,
            Class::Sensor => 2,
            Class::System => 3,
            Class::Scanner => 4,
        }
    }
}

impl ActiveErrors {
    /// Errors become active, and others clear, at one and the same moment: the list never holds both, and the unit is
    /// never without an error in between. What is active already, or is not, is passed over. Gives those that have become
    /// active.
    pub fn change(&mut self, raised: &[Emergency], cleared: &[Emergency], objects: &mut Objects) -> Vec<Emergency> {
        let raised: Vec<Emergency> = raised.iter().copied().filter(|error| !self.active.contains(error)).collect();
        let cleared: Vec<Emergency> = cleared.iter().copied().filter(|error| self.active.contains(error)).collect();
        if raised.is_empty() && cleared.is_empty() {
            return raised;
        }
        self.active.retain(|active| !cleared.contains(active));
        self.listed.retain(|listed| !cleared.contains(listed));
        for &error in &raised {
            self.active.push(error);
            self.listed.push_front(error);
        }
        self.publish(objects);
        raised
    }

    /// Empties the list, not the errors.
    pub fn clear_list(&mut self, objects: &mut Objects) {
        self.listed.clear();
        self.publish(objects);
    }

    /// Number of active errors.
    pub fn count(&self) -> usize {
        self.active.len()
    }

    fn publish(&mut self, objects: &mut Objects) {
        let list = objects.product().dictionary.object(0x1003).expect("every product has a list of errors");
        let room = list.entries.len() - 1;
        self.listed.truncate(room);
        objects.set(0x1001, 0, Value::Unsigned8(u8::from(!self.active.is_empty())));
        objects.set(0x1003, 0, Value::Unsigned8(self.listed.len() as u8));
        for (sub, place) in (1u8..).zip(0..room) {
            let entry = self.listed.get(place).map_or(0, |&error| error.into());
            objects.set(0x1003, sub, Value::Unsigned32(entry));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;

    fn objects(name: &str) -> Objects {
        Objects::factory(Product::named(name).expect("built in"), 127)
    }

    fn list(objects: &Objects) -> Vec<u32> {
        (1..=objects.integer(0x1003, 0) as u8).map(|sub| objects.integer(0x1003, sub) as u32).collect()
    }

    fn threshold(channel: u8, description: u8) -> Emergency {
        Emergency { code: LIMIT_EXCEEDED, channel, description }
    }

    // B-110, B-111, B-114, B-70, B-71, B-72
    #[test]
    fn the_list_holds_what_is_active_newest_first() {
        let (mut objects, mut errors) = (objects("AXTC4CO"), ActiveErrors::default());
        let (low, high) = (threshold(1, 0x10), threshold(3, 0x20));
        assert_eq!(errors.change(&[low], &[], &mut objects), [low]);
        assert_eq!(errors.change(&[high], &[], &mut objects), [high]);
        assert_eq!(errors.change(&[high], &[], &mut objects), [], "it is active already");
        assert_eq!(list(&objects), [0x2003_F011, 0x1001_F011]);
        assert_eq!(objects.get(0x1001, 0), Value::Unsigned8(1));
        assert_eq!(objects.get(0x1003, 3), Value::Unsigned32(0), "beyond the count");
        errors.change(&[], &[low], &mut objects);
        assert_eq!(list(&objects), [0x2003_F011]);
        errors.change(&[], &[high], &mut objects);
        assert_eq!((list(&objects), objects.get(0x1001, 0)), (vec![], Value::Unsigned8(0)));
    }

    #[test]
    fn an_error_takes_the_place_of_others_without_a_moment_of_none_or_of_both() {
        let (mut objects, mut errors) = (objects("AXTC4CO"), ActiveErrors::default());
        let open = Emergency { code: INPUT_OVERLOAD, channel: 4, description: 0x02 };
        for channel in 1..=4 {
            errors.change(&[threshold(channel, 0x20), threshold(channel, 0x40)], &[], &mut objects);
        }
        errors.change(&[Emergency { code: 0x8130, channel: 5, description: 0x80 }], &[], &mut objects);
        errors.change(&[open], &[threshold(4, 0x20), threshold(4, 0x40)], &mut objects);
        assert_eq!((list(&objects).len(), list(&objects)[7]), (8, 0x2001_F011), "the full list has lost nothing");
        let all = errors.active.clone();
        errors.change(&[], &all[1..], &mut objects);
        errors.change(&[open], &all, &mut objects);
        assert_eq!(list(&objects), [u32::from(open)]);
        let thresholds = [threshold(1, 0x20), threshold(1, 0x40)];
        assert_eq!(errors.change(&thresholds, &[open], &mut objects), thresholds);
        assert_eq!((list(&objects), errors.count()), (vec![0x4001_F011, 0x2001_F011], 2));
        assert_eq!(errors.change(&[], &[open, thresholds[0], thresholds[1]], &mut objects), []);
        assert_eq!((list(&objects), errors.count()), (vec![], 0));
    }

    // B-113, B-73
    #[test]
    fn a_list_emptied_by_hand_stays_so_until_an_error_comes_again() {
        let (mut objects, mut errors) = (objects("AXRTD8CO"), ActiveErrors::default());
        errors.change(&[threshold(2, 0x20)], &[], &mut objects);
        errors.clear_list(&mut objects);
        assert_eq!((list(&objects), objects.get(0x1001, 0)), (vec![], Value::Unsigned8(1)));
        errors.change(&[threshold(2, 0x20)], &[], &mut objects);
        assert!(list(&objects).is_empty(), "it has never gone");
        errors.change(&[], &[threshold(2, 0x20)], &mut objects);
        errors.change(&[threshold(2, 0x20)], &[], &mut objects);
        assert_eq!(list(&objects), [0x2002_F011]);
    }

    // B-112, B-74
    #[test]
    fn a_full_list_loses_its_oldest() {
        for (name, channels, room) in [("AXTC4CO", 4, 9), ("AXRTD8CO", 8, 17)] {
            let (mut objects, mut errors) = (objects(name), ActiveErrors::default());
            for channel in 1..=channels {
                errors.change(&[threshold(channel, 0x20)], &[], &mut objects);
                errors.change(&[threshold(channel, 0x40)], &[], &mut objects);
            }
            for node in [5, 6] {
                errors.change(&[Emergency { code: 0x8130, channel: node, description: 0x80 }], &[], &mut objects);
            }
            let list = list(&objects);
            assert_eq!(list.len(), room, "{name}");
            assert_eq!(list[..2], [0x8006_8130, 0x8005_8130]);
            assert!(!list.contains(&0x2001_F011), "{name}: the oldest is lost");
        }
    }

    // B-125, B-81
    #[test]
    fn classes_are_those_of_the_products_manual() {
        let error = |code| Emergency { code, channel: 1, description: 0 };
        let classes = |sensors| {
            [0x8130, 0x8110, INPUT_OVERLOAD, LIMIT_EXCEEDED, DEVICE_SPECIFIC]
                .map(|code| Class::of(error(code), sensors))
        };
        use Class::{Communication, Scanner, Sensor, System};
        assert_eq!(classes(SensorKind::Thermocouple), [Communication, Communication, Sensor, Sensor, Communication]);
        assert_eq!(classes(SensorKind::Rtd), [Communication, Communication, Sensor, System, Scanner]);
        for product in Product::all() {
            let behaviour = product.dictionary.object(0x1029).expect("every product has it");
            for class in classes(product.measurement.sensors) {
                assert!(behaviour.entry(class.sub_index()).is_some(), "{}: {class:?}", product.name);
            }
        }
    }
}
