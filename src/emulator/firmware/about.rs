//! What the software knows of itself: objects 1018h and 1020h (manuals, sections 3.2.11 and 3.2.12).

use crate::canopen::Value;
use crate::emulator::objects::Objects;
use crate::image::Identity;
use crate::version::Version;

/// Puts it into the object dictionary.
pub fn put(objects: &mut Objects, identity: &Identity, serial_number: u32) {
    objects.set(0x1018, 3, Value::Unsigned32(revision(identity.version)));
    objects.set(0x1018, 4, Value::Unsigned32(serial_number));
    objects.set(0x1020, 1, Value::Unsigned32(build_date(identity)));
    objects.set(0x1020, 2, Value::Unsigned32(build_time(identity)));
}

/// 1018h:3, bits 31-16: revision of the object dictionary, and bits 15-8: of the hardware (errata E-21).
const DICTIONARY_AND_HARDWARE_REVISION: u32 = 0x0001_0100;

/// 1018h:3: software version in the lowest byte, a digit for the major and one for the minor number.
fn revision(version: Version) -> u32 {
    DICTIONARY_AND_HARDWARE_REVISION | u32::from(version.major & 0xF) << 4 | u32::from(version.minor & 0xF)
}

/// 1020h:1: day, month and year, their decimal digits read as hexadecimal ones (errata E-22).
fn build_date(identity: &Identity) -> u32 {
    let mut parts = identity.build_date.split('-');
    let mut next = || digits(parts.next());
    let (year, month, day) = (next(), next(), next());
    day << 24 | month << 16 | year
}

/// 1020h:2: hour and minute in the same way.
fn build_time(identity: &Identity) -> u32 {
    let mut parts = identity.build_time.split(':');
    let mut next = || digits(parts.next());
    next() << 8 | next()
}

fn digits(text: Option<&str>) -> u32 {
    text.and_then(|text| u32::from_str_radix(text, 16).ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    // B-006, B-007, B-5, B-4, B-005
    #[test]
    fn the_software_says_itself_when_it_was_compiled_and_which_version_it_is() {
        for product in crate::device::Product::all() {
            let mut objects = Objects::factory(product, 127);
            let identity = Identity {
                product: product.name.clone(),
                version: Version::new(1, 2, 3),
                build_date: "2010-08-10".into(),
                build_time: "16:20:00".into(),
                program_words: 0,
                crc: 0,
            };
            put(&mut objects, &identity, 7);
            assert_eq!(objects.get(0x1020, 1), Value::Unsigned32(0x1008_2010));
            assert_eq!(objects.get(0x1020, 2), Value::Unsigned32(0x0000_1620));
            assert_eq!(objects.get(0x1018, 3), Value::Unsigned32(0x0001_0112));
            assert_eq!(objects.get(0x1018, 4), Value::Unsigned32(7));
            assert_eq!(objects.get(0x1018, 1), Value::Unsigned32(0x55));
            assert_eq!(objects.get(0x1018, 2), Value::Unsigned32(product.can.product_code));
        }
    }
}
