//! What may be written to the communication and mapping parameters of PDOs: 1400h-1403h, 1800h-1803h and 1A00h-1A03h
//! (manuals, sections 3.2.14 and 3.2.15; CiA 301, sections 7.3.5 and 7.5.2.35).

use super::Objects;
use crate::canopen::{Abort, ObjectAddress, Value};

/// A PDO does not exist: bit 31 of its COB-ID.
const PDO_ABSENT: u32 = 0x8000_0000;
/// No remote frames: bit 30 (errata E-08).
const NO_REMOTE_FRAMES: u32 = 0x4000_0000;
/// The identifier: 11 bits.
const CAN_ID: u32 = 0x7FF;
/// Bits a PDO carries.
const PDO_BITS: u32 = 64;
/// Entries of a mapping (errata E-B14).
const MAPPING_ENTRIES: u8 = 4;

impl Objects {
    /// Re-mapping has an order (section 3.2): the PDO is switched off, the number of entries set to 0, the entries
    /// written, the number set, the PDO switched on.
    pub(super) fn check_mapping(&self, at: ObjectAddress, value: Value) -> Result<(), Abort> {
        let bits = value.as_integer().unwrap_or_default() as u32;
        let cob_id = self.integer(at.index - 0x200, 1) as u32;
        let count = self.integer(at.index, 0);
        if cob_id & PDO_ABSENT == 0 || (at.sub > 0 && count != 0) {
            return Err(Abort::UnsupportedAccess);
        }
        if at.sub > 0 {
            return if bits == 0 { Ok(()) } else { self.mapped_bits(bits).map(|_| ()) };
        }
        let mut total = 0;
        for sub in 1..=(bits as u8).min(MAPPING_ENTRIES) {
            total += self.mapped_bits(self.integer(at.index, sub) as u32)?;
        }
        if total > PDO_BITS { Err(Abort::MappingTooLong) } else { Ok(()) }
    }

    /// Length of a mapped entry, if it is one that can be mapped, and as long as the mapping says.
    fn mapped_bits(&self, mapping: u32) -> Result<u32, Abort> {
        let at = ObjectAddress::new((mapping >> 16) as u16, (mapping >> 8) as u8);
        let entry = self.product.dictionary.entry(at).filter(|entry| entry.mappable).ok_or(Abort::NotMappable)?;
        let bits = entry.data_type.bytes() as u32 * 8;
        if mapping & 0xFF == bits { Ok(bits) } else { Err(Abort::NotMappable) }
    }
}

/// An identifier changes only while the PDO does not exist, and is one that PDOs may have (CiA 301, sections 7.3.5 and
/// 7.5.2.35).
pub(super) fn check_cob_id(present: Value, new: Value) -> Result<(), Abort> {
    let bits = |value: Value| value.as_integer().unwrap_or_default() as u32;
    let (present, new) = (bits(present), bits(new));
    let exists = |cob_id: u32| cob_id & PDO_ABSENT == 0;
    let id = new & CAN_ID;
    let plain = new & !(PDO_ABSENT | NO_REMOTE_FRAMES | CAN_ID) == 0;
    let restricted = matches!(
        id,
        0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF
    );
    let moved = exists(present) && exists(new) && present & CAN_ID != id;
    if !plain || new & NO_REMOTE_FRAMES == 0 || moved || (exists(new) && restricted) {
        return Err(Abort::ValueRange);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::Effect;
    use super::super::tests::{at, tc4, write};
    use super::*;

    // B-047, B-048, B-049, B-102, B-103, B-104, B-050
    #[test]
    fn a_pdo_is_mapped_anew_in_the_printed_order_only() {
        let mut objects = tc4();
        let cob = |bits: u32| f64::from(bits);
        assert_eq!(write(&mut objects, 0x1A00, 0, 0.0), Err(Abort::UnsupportedAccess), "the PDO exists");
        assert_eq!(write(&mut objects, 0x1802, 1, cob(0xC000_03FF)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 0, 0.0), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 1, cob(0x6100_0120)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 2, cob(0x6100_0220)), Ok(Effect::None));
        for (mapping, why) in [
            (0x6110_0110u32, "not mappable"),
            (0x6100_0510, "no such entry"),
            (0x6100_0110, "half its length"),
            (0x6100_0008, "sub-index 0"),
            (0x1234_0010, "no such object"),
        ] {
            assert_eq!(write(&mut objects, 0x1A02, 3, cob(mapping)), Err(Abort::NotMappable), "{why}");
        }
        for index in [0x6100u32, 0x6150, 0x7130, 0x2100, 0x2130] {
            let bits = objects.get(index as u16, 1).data_type().bytes() as u32 * 8;
            assert_eq!(write(&mut objects, 0x1A02, 3, cob(index << 16 | 0x100 | bits)), Ok(Effect::None), "{index:X}h");
        }
        assert_eq!(write(&mut objects, 0x1A02, 0, 5.0), Err(Abort::TooHigh));
        assert_eq!(write(&mut objects, 0x1A02, 3, cob(0x5000_0020)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 0, 3.0), Err(Abort::MappingTooLong));
        assert_eq!(write(&mut objects, 0x1A02, 0, 4.0), Err(Abort::NotMappable), "the fourth is empty");
        assert_eq!(write(&mut objects, 0x1A02, 0, 2.0), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 1, 0.0), Err(Abort::UnsupportedAccess), "entries are in use");
        assert_eq!(write(&mut objects, 0x1802, 1, cob(0x4000_03FF)), Ok(Effect::None));
        assert_eq!(write(&mut objects, 0x1A02, 0, 0.0), Err(Abort::UnsupportedAccess), "it exists again");
        assert_eq!(write(&mut objects, 0x1600, 1, 0.0), Err(Abort::ReadOnly));
        assert_eq!(objects.write(at(0x1A00, 0), &[0, 0]), Err(Abort::TooLong));
    }

    // B-045, B-046, B-95, B-96
    #[test]
    fn an_identifier_moves_only_while_its_pdo_does_not_exist() {
        let mut objects = tc4();
        let mut set = |cob_id: u32| write(&mut objects, 0x1800, 1, f64::from(cob_id));
        assert_eq!(set(0x4000_0200), Err(Abort::ValueRange), "it exists");
        assert_eq!(set(0x0000_01FF), Err(Abort::ValueRange), "remote frames");
        assert_eq!(set(0xE000_01FF), Err(Abort::ValueRange), "29 bits");
        assert_eq!(set(0xC000_01FF), Ok(Effect::None));
        assert_eq!(set(0xC000_0211), Ok(Effect::None));
        for restricted in [0x000, 0x07F, 0x180, 0x5FF, 0x67F, 0x6E0, 0x77F, 0x7FF] {
            assert_eq!(set(0x4000_0000 | restricted), Err(Abort::ValueRange), "{restricted:03X}h");
        }
        assert_eq!(set(0x4000_0211), Ok(Effect::None));
        for index in [0x1400, 0x1800] {
            let expected = if index == 0x1400 { 255 } else { 254 };
            assert_eq!(objects.get(index, 2), Value::Unsigned8(expected));
            assert_eq!(objects.write(at(index, 2), &[1]), Err(Abort::ReadOnly));
            for (sub, data) in [(3, &[10u8, 0][..]), (4, &[1]), (5, &[200, 0])] {
                assert_eq!(objects.write(at(index, sub), data), Ok(Effect::None), "{index:X}h:{sub}");
            }
        }
    }
}
