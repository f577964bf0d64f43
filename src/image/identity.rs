//! The identity block: what a program image says about itself.
//!
//! The emulated application *is* what is in flash, so product, version and a checksum have to be there too. The
//! block is our own convention (`docs/images.md` has the table); nothing is known about one in the real units, so
//! the console treats a file without it as "says nothing", not as wrong by itself.

use crate::version::Version;

/// Program word at which the block starts (byte offset 100h in flash, after the interrupt vectors).
pub const WORD_ADDRESS: u32 = 0x80;
/// Bytes the block takes.
pub const LENGTH: usize = 64;

/// The most ASCII characters of a product name.
pub const LONGEST_NAME: usize = 12;

/// The most ASCII characters of a version.
pub const LONGEST_VERSION: usize = 12;

const BYTE_OFFSET: usize = WORD_ADDRESS as usize * 2;
const MAGIC: &[u8; 4] = b"AXID";
const FORMAT: u16 = 1;
const CRC_OFFSET: usize = BYTE_OFFSET + 60;

/// Product, version and build of a program image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Product name, e.g. `AXTC4CO`; at most 12 ASCII characters.
    pub product: String,
    /// Software version.
    pub version: Version,
    /// Build date, `2026-01-31`.
    pub build_date: String,
    /// Build time, `12:00:00`.
    pub build_time: String,
    /// Words the program takes, counted from word 0; the CRC covers them all.
    pub program_words: u32,
    /// CRC-32 (IEEE 802.3) of the program's bytes in S-record order, the CRC field itself taken as FFh.
    pub crc: u32,
}

/// Why no identity could be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IdentityError {
    /// There is no block at the place.
    #[error("no identity block at word {WORD_ADDRESS:#06x}")]
    Absent,
    /// There is a block, but a field of it makes no sense.
    #[error("the identity block's {0} makes no sense")]
    Malformed(&'static str),
    /// The program is not the one the block was made for.
    #[error("the program's CRC is {computed:08x}, its identity block says {stored:08x}")]
    Crc {
        /// What the block says.
        stored: u32,
        /// What the program's bytes give.
        computed: u32,
    },
}

impl Identity {
    /// Reads the block from a program's bytes (S-record order, from word 0 on) and checks the CRC.
    ///
    /// # Errors
    /// If there is no block, a field makes no sense, or the CRC differs.
    pub fn verify(program: &[u8]) -> Result<Self, IdentityError> {
        let identity = Self::read(program)?;
        let computed = identity.crc_of(program);
        if computed == identity.crc { Ok(identity) } else { Err(IdentityError::Crc { stored: identity.crc, computed }) }
    }

    /// Whether the program is for this product. Names are compared in any case of their letters.
    pub fn is_for(&self, product: &str) -> bool {
        self.product.eq_ignore_ascii_case(product)
    }

    /// Reads the block without checking the CRC.
    ///
    /// # Errors
    /// If there is no block, or a field makes no sense.
    pub fn read(program: &[u8]) -> Result<Self, IdentityError> {
        let block = program.get(BYTE_OFFSET..BYTE_OFFSET + LENGTH).ok_or(IdentityError::Absent)?;
        if &block[0..4] != MAGIC {
            return Err(IdentityError::Absent);
        }
        let u16_at = |at: usize| u16::from_le_bytes([block[at], block[at + 1]]);
        let u32_at = |at: usize| u32::from_le_bytes([block[at], block[at + 1], block[at + 2], block[at + 3]]);
        if u16_at(4) != FORMAT || usize::from(u16_at(6)) != LENGTH {
            return Err(IdentityError::Malformed("format"));
        }
        let program_words = u32_at(52);
        let needed = (BYTE_OFFSET + LENGTH) as u64;
        if u64::from(program_words) * 2 < needed || u64::from(program_words) * 2 > program.len() as u64 {
            return Err(IdentityError::Malformed("program length"));
        }
        let version = text(&block[20..32], "version")?;
        Ok(Identity {
            product: text(&block[8..20], "product")?,
            version: version.parse().map_err(|_| IdentityError::Malformed("version"))?,
            build_date: text(&block[32..42], "build date")?,
            build_time: text(&block[42..50], "build time")?,
            program_words,
            crc: u32_at(60),
        })
    }

    /// Writes the block into a program, its CRC included; `program_words` and `crc` are set from the program.
    ///
    /// # Panics
    /// If the program ends before the block does, is an odd number of bytes, or a text is longer than its field.
    pub fn stamp(&mut self, program: &mut [u8]) {
        assert!(program.len() >= BYTE_OFFSET + LENGTH && program.len().is_multiple_of(2), "no room for the block");
        self.program_words = (program.len() / 2) as u32;
        let block = &mut program[BYTE_OFFSET..BYTE_OFFSET + LENGTH];
        block.fill(0);
        block[0..4].copy_from_slice(MAGIC);
        block[4..6].copy_from_slice(&FORMAT.to_le_bytes());
        block[6..8].copy_from_slice(&(LENGTH as u16).to_le_bytes());
        let mut put = |at: usize, room: usize, text: &str| {
            assert!(text.len() <= room && text.is_ascii(), "'{text}' does not fit its field");
            block[at..at + text.len()].copy_from_slice(text.as_bytes());
        };
        put(8, LONGEST_NAME, &self.product);
        put(20, LONGEST_VERSION, &self.version.to_string());
        put(32, 10, &self.build_date);
        put(42, 8, &self.build_time);
        block[52..56].copy_from_slice(&self.program_words.to_le_bytes());
        self.crc = self.crc_of(program);
        program[CRC_OFFSET..CRC_OFFSET + 4].copy_from_slice(&self.crc.to_le_bytes());
    }

    fn crc_of(&self, program: &[u8]) -> u32 {
        let program = &program[..self.program_words as usize * 2];
        let mut crc = crc32fast::Hasher::new();
        crc.update(&program[..CRC_OFFSET]);
        crc.update(&[0xFF; 4]);
        crc.update(&program[CRC_OFFSET + 4..]);
        crc.finalize()
    }
}

/// A NUL-padded field as text: printable ASCII, at least one character.
fn text(field: &[u8], name: &'static str) -> Result<String, IdentityError> {
    let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
    let text = &field[..end];
    if text.is_empty() || !text.iter().all(u8::is_ascii_graphic) {
        return Err(IdentityError::Malformed(name));
    }
    Ok(String::from_utf8_lossy(text).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamped(words: usize) -> (Identity, Vec<u8>) {
        let mut program: Vec<u8> = (0..words * 2).map(|at| at as u8).collect();
        let mut identity = Identity {
            product: "AXTC4CO".into(),
            version: Version::new(1, 2, 0),
            build_date: "2026-01-31".into(),
            build_time: "12:00:00".into(),
            program_words: 0,
            crc: 0,
        };
        identity.stamp(&mut program);
        (identity, program)
    }

    #[test]
    fn what_is_stamped_is_read_whatever_follows_the_program() {
        let (identity, mut program) = stamped(512);
        assert_eq!(Identity::verify(&program), Ok(identity.clone()));
        program.resize(131_072, 0xFF);
        assert_eq!(Identity::verify(&program), Ok(identity));
    }

    #[test]
    fn any_changed_bit_of_the_program_is_noticed() {
        let (_, program) = stamped(512);
        for at in 0..program.len() {
            let mut changed = program.clone();
            changed[at] ^= 0x10;
            assert!(Identity::verify(&changed).is_err(), "byte {at:#x}");
        }
    }

    #[test]
    fn nonsense_is_refused_and_nothing_panics() {
        let (_, program) = stamped(512);
        for end in 0..program.len() {
            assert!(Identity::verify(&program[..end]).is_err(), "cut at {end:#x}");
        }
        assert_eq!(Identity::verify(&[0xFF; 131_072]), Err(IdentityError::Absent));
    }
}
