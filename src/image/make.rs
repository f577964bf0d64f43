//! Sample images in the form CodeWarrior gives them, sound ones and ones with a single defect.
//!
//! The same product, version and size give the same bytes for ever: the repository holds such files, and a test makes
//! them again. The "program" is drawn from a generator and does nothing; only its identity block means something, to
//! the emulated unit and to the console.

use crate::rng::Rng;
use crate::version::Version;

use super::defect::DefectId;
use super::identity::{self, Identity};
use super::srecord::{self, Kind, Record};
use super::{AddressUnit, Target};

/// What to make.
#[derive(Clone, Copy, Debug)]
pub struct Recipe<'a> {
    /// For which product.
    pub target: &'a Target,
    /// Of which version.
    pub version: Version,
    /// How many 16-bit words.
    pub words: u32,
    /// With which defect.
    pub flaw: Option<DefectId>,
}

/// Why an image cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MakeError {
    /// There is no room for vectors, identity block and a few instructions, or for a flaw after them.
    #[error("an image needs {FEWEST_WORDS} words at least, not {words}")]
    TooSmall {
        /// What was asked for.
        words: u32,
    },
    /// It does not fit the flash.
    #[error("{words} words do not fit the {product}'s program flash of {most}")]
    TooBig {
        /// What was asked for.
        words: u32,
        /// The product.
        product: String,
        /// What would fit.
        most: u32,
    },
    /// The identity block has no room for it.
    #[error("version {version} has more than the {} characters that an image has room for", identity::LONGEST_VERSION)]
    VersionTooLong {
        /// What was asked for.
        version: Version,
    },
    /// The defect depends on more than the file.
    #[error("no file of its own can show the defect '{0}'")]
    NoSuchFlaw(DefectId),
}

/// The smallest image: vectors, identity block, and enough after them for a flaw.
pub const FEWEST_WORDS: u32 = 320;

/// The defects [`make`] can put into a file. The others need a file of more than 512 KByte, depend on what is
/// expected, or are those of Intel HEX.
pub fn flaws() -> impl Iterator<Item = DefectId> {
    DefectId::ALL.into_iter().filter(|id| {
        !matches!(
            id,
            DefectId::TooLarge
                | DefectId::SegmentWrap
                | DefectId::OffsetIgnored
                | DefectId::MissingEntry
                | DefectId::DuplicateEntry
                | DefectId::WrongProduct
                | DefectId::Downgrade
                | DefectId::FileName
        )
    })
}

/// The usual size of a product's sample image: three quarters of its flash, but no more than 80 K words.
pub fn usual_words(target: &Target) -> u32 {
    (target.flash.program_words / 4 * 3).min(MOST_USUAL_WORDS)
}

/// Samples of large products stay moderate: 160 KByte of program, enough for addresses of more than 16 bits.
const MOST_USUAL_WORDS: u32 = 0x1_4000;

/// Makes the file's bytes.
///
/// # Errors
/// If the size is impossible, or no file can show the defect.
pub fn make(recipe: &Recipe<'_>) -> Result<Vec<u8>, MakeError> {
    let Recipe { target, words, .. } = *recipe;
    let most = target.flash.program_words;
    let version = recipe.version;
    if version.to_string().len() > identity::LONGEST_VERSION {
        return Err(MakeError::VersionTooLong { version });
    }
    if words < FEWEST_WORDS {
        return Err(MakeError::TooSmall { words });
    }
    if words > most {
        return Err(MakeError::TooBig { words, product: target.product.clone(), most });
    }
    if let Some(flaw) = recipe.flaw.filter(|flaw| !flaws().any(|possible| possible == *flaw)) {
        return Err(MakeError::NoSuchFlaw(flaw));
    }
    if recipe.flaw == Some(DefectId::BootFlash) && target.boot.is_none() {
        return Err(MakeError::NoSuchFlaw(DefectId::BootFlash));
    }
    let mut draft = Draft::new(recipe, &program(recipe));
    if let Some(flaw) = recipe.flaw {
        draft.spoil(flaw, recipe);
    }
    Ok(draft.bytes())
}

/// The program alone, its identity block included: bytes in S-record order, from word 0 on.
///
/// # Panics
/// If the recipe asks for fewer than [`FEWEST_WORDS`], or for a version that the identity block has no room for.
pub fn program(recipe: &Recipe<'_>) -> Vec<u8> {
    let Recipe { target, version, words, flaw } = *recipe;
    let mut rng = Rng::new(PROGRAMS).fork(&target.product).fork(&version.to_string());
    let mut clock = rng.fork("build time");
    let mut program = Vec::with_capacity(words as usize * 2);
    // A vector is a jump instruction and its target; the block and the code follow.
    for vector in 0..identity::WORD_ADDRESS {
        let word = if vector % 2 == 0 { JUMP } else { (ENTRY as u64 + rng.below(u64::from(words - ENTRY))) as u16 };
        program.extend(word.to_le_bytes());
    }
    // Code repeats itself: most words are one of a few, the others are operands.
    let palette: Vec<u16> = (0..PALETTE).map(|_| rng.next_u64() as u16).collect();
    while program.len() < words as usize * 2 {
        let operand = !rng.chance(70);
        let word = if operand { rng.next_u64() as u16 } else { palette[rng.below(PALETTE) as usize] };
        program.extend(word.to_le_bytes());
    }
    match flaw {
        // The check takes words that no record writes for erased flash; so does this CRC.
        Some(DefectId::Gap) => program[DAMAGED * STEP..(DAMAGED + 1) * STEP].fill(0xFF),
        // The missing half of the last word is sent as FFh.
        Some(DefectId::OddLength) => {
            let last = program.len() - 1;
            program[last] = 0xFF;
        }
        _ => {}
    }
    let mut identity = Identity {
        product: if flaw == Some(DefectId::UnknownProduct) { "AX000000".into() } else { target.product.clone() },
        version,
        build_date: format!(
            "{}-{:02}-{:02}",
            2024 + version.major % 100,
            1 + version.minor % 12,
            1 + version.patch % 28
        ),
        build_time: format!("{:02}:{:02}:{:02}", 8 + clock.below(10), clock.below(60), clock.below(60)),
        program_words: 0,
        crc: 0,
    };
    identity.stamp(&mut program);
    let block = identity::WORD_ADDRESS as usize * 2;
    match flaw {
        Some(DefectId::NoIdentity) => program[block..block + 4].fill(0),
        Some(DefectId::IdentityMalformed) => program[block + 4] = 0xFF,
        Some(DefectId::IdentityCrc) => program[DAMAGED * STEP] ^= 0x01,
        _ => {}
    }
    program
}

/// A file in the making: lines, each with its end.
struct Draft {
    lines: Vec<(Vec<u8>, &'static [u8])>,
    front: &'static [u8],
    /// What takes the place of the lines.
    instead: Option<Vec<u8>>,
}

impl Draft {
    fn new(recipe: &Recipe<'_>, program: &[u8]) -> Self {
        let unit = match (recipe.target.flash.address_unit, recipe.flaw) {
            (AddressUnit::Word, Some(DefectId::AddressUnit)) => AddressUnit::Byte,
            (AddressUnit::Byte, Some(DefectId::AddressUnit)) => AddressUnit::Word,
            (unit, _) => unit,
        };
        let mut draft = Draft { lines: Vec::new(), front: b"", instead: None };
        let mut header = Vec::new();
        srecord::write_header(HEADER, &mut header);
        draft.push(header);
        for (number, data) in program.chunks(STEP).enumerate() {
            let address = number as u32 * STEP as u32 / unit.bytes();
            draft.push(Record { kind: Kind::Data32, address, data }.to_text());
        }
        let entry = ENTRY * 2 / unit.bytes();
        draft.push(Record { kind: Kind::Start32, address: entry, data: &[] }.to_text());
        draft
    }

    fn push(&mut self, line: Vec<u8>) {
        self.lines.push((line, b"\r\n"));
    }

    fn insert(&mut self, at: usize, record: Record<'_>) {
        self.lines.insert(at, (record.to_text(), b"\r\n"));
    }

    fn bytes(self) -> Vec<u8> {
        if let Some(instead) = self.instead {
            return instead;
        }
        let mut bytes = self.front.to_vec();
        for (line, end) in self.lines {
            bytes.extend(line);
            bytes.extend(end);
        }
        bytes
    }

    /// Puts a defect into the lines. Those of the program itself are made with the program.
    fn spoil(&mut self, flaw: DefectId, recipe: &Recipe<'_>) {
        // Lines are header, data from address 0 on, terminator; `DAMAGED` is a data record's number.
        let damaged = DAMAGED + 1;
        let last = self.lines.len() - 1;
        let unit = recipe.target.flash.address_unit;
        let address = (DAMAGED * STEP) as u32 / unit.bytes();
        let data_records = last as u32 - 1;
        let data32 = |address: u32, data: &'static [u8]| Record { kind: Kind::Data32, address, data };
        let bare = |kind: Kind, address: u32| Record { kind, address, data: &[] };
        match flaw {
            DefectId::EmptyFile => self.instead = Some(Vec::new()),
            DefectId::NotSRecord => self.instead = Some(PAGE.to_vec()),
            DefectId::ByteOrderMark => self.front = b"\xEF\xBB\xBF",
            DefectId::LongLine => self.lines[damaged].0.resize(1200, b'0'),
            DefectId::NotARecord => self.lines[damaged].0[0] = b'T',
            DefectId::UnknownType => self.lines[damaged].0[1] = b'4',
            DefectId::BadCharacter => self.lines[damaged].0[20] = b'G',
            DefectId::ShortRecord => self.lines[damaged].0.truncate(40),
            DefectId::BadLength => self.lines.insert(damaged, (b"S30200FD".to_vec(), b"\r\n")),
            DefectId::BadChecksum => {
                let line = &mut self.lines[damaged].0;
                let at = line.len() - 1;
                line[at] = if line[at] == b'0' { b'1' } else { b'0' };
            }
            DefectId::TrailingCharacters => self.lines[damaged].0.extend(b"00"),
            DefectId::TrailingBlanks => self.lines[damaged].0.extend(b"  "),
            DefectId::RefusedType => self.lines[last] = (bare(Kind::Start16, ENTRY).to_text(), b"\r\n"),
            DefectId::EmptyRecord => self.insert(damaged, data32(address, &[])),
            DefectId::BlankLine => self.lines.insert(damaged, (Vec::new(), b"\r\n")),
            DefectId::LowerCase => self.lines[damaged].0.make_ascii_lowercase(),
            DefectId::MixedLineEnds => self.lines[damaged].1 = b"\n",
            DefectId::NoLineEnd => self.lines[last].1 = b"",
            DefectId::MissingHeader => {
                self.lines.remove(0);
            }
            DefectId::DataBeforeHeader => self.lines.swap(0, 1),
            DefectId::DuplicateHeader => {
                let header = self.lines[0].clone();
                self.lines.insert(damaged, header);
            }
            DefectId::HeaderForm => {
                let header = Record { kind: Kind::Header, address: 0, data: HEADER };
                self.lines[0].0 = header.to_text();
            }
            DefectId::MissingTerminator => self.lines.truncate(last),
            DefectId::AfterTerminator => {
                let record = self.lines[last - 1].clone();
                self.lines.push(record);
            }
            DefectId::CountRecord => self.insert(last, bare(Kind::Count16, data_records)),
            DefectId::WrongCount => self.insert(last, bare(Kind::Count16, data_records + 1)),
            DefectId::NoData => {
                self.lines.drain(1..last);
            }
            DefectId::OddLength => self.shorten(last - 1),
            DefectId::AddressWrap => self.insert(last, data32(u32::MAX, &[0x12, 0x34, 0x56, 0x78])),
            DefectId::Descending => self.lines.swap(damaged, damaged + 1),
            DefectId::Overlap => {
                let record = self.lines[damaged].clone();
                self.lines.insert(damaged, record);
            }
            DefectId::OutOfRange => {
                // If the boot flash follows directly, an address in it would be another defect.
                let end = recipe.target.flash.end();
                let boot = recipe.target.boot.filter(|boot| (boot.start..boot.end).contains(&end));
                self.insert(last, data32(boot.map_or(end, |boot| boot.end) as u32, &[0x12, 0x34]));
            }
            DefectId::BootFlash => {
                let start = recipe.target.boot.map_or(0, |boot| boot.start as u32);
                self.insert(last, data32(start, &[0x12, 0x34]));
            }
            DefectId::DataMemory => self.insert(last, data32(0x0200_0000, &[0x12, 0x34])),
            DefectId::Gap => {
                self.lines.remove(damaged);
            }
            DefectId::EntryOutside => {
                let end = recipe.target.flash.end() as u32;
                self.lines[last].0 = bare(Kind::Start32, end - 1).to_text();
            }
            // Made with the program, or not made at all.
            DefectId::AddressUnit
            | DefectId::NoIdentity
            | DefectId::IdentityMalformed
            | DefectId::IdentityCrc
            | DefectId::UnknownProduct
            | DefectId::TooLarge
            | DefectId::SegmentWrap
            | DefectId::OffsetIgnored
            | DefectId::MissingEntry
            | DefectId::DuplicateEntry
            | DefectId::WrongProduct
            | DefectId::Downgrade
            | DefectId::FileName => {}
        }
    }

    /// Takes the last byte off a record.
    fn shorten(&mut self, at: usize) {
        let mut room = [0; 255];
        if let Ok(line) = srecord::parse(&self.lines[at].0, &mut room) {
            let Record { kind, address, data } = line.record;
            self.lines[at].0 = Record { kind, address, data: &data[..data.len() - 1] }.to_text();
        }
    }
}

/// Text of the header CodeWarrior writes.
const HEADER: &[u8] = b"PROGRAM&DATA";
/// Data bytes of a record.
const STEP: usize = 32;
/// Number of the data record that carries a flaw: after the identity block, in the middle of the code.
const DAMAGED: usize = 13;
/// Word at which the program starts, directly after the identity block.
const ENTRY: u32 = identity::WORD_ADDRESS + identity::LENGTH as u32 / 2;
/// First word of a vector.
const JUMP: u16 = 0xE254;
/// Different words that make up most of the code.
const PALETTE: u64 = 48;
/// Seed of all programs. Changing it changes every sample file.
const PROGRAMS: u64 = 0x4158_434F_4E00_0001;
/// What a browser saves when a download went wrong.
const PAGE: &[u8] = b"<!DOCTYPE html>\r\n<html><head><title>404 Not Found</title></head>\r\n\
    <body><h1>Not Found</h1><p>The file is no longer here.</p></body></html>\r\n";

#[cfg(test)]
mod tests {
    use super::super::{FlashMap, Outside, check};
    use super::*;

    fn target(address_unit: AddressUnit) -> Target {
        Target {
            product: "AXTEST".into(),
            flash: FlashMap { address_unit, program_words: 0x10000, page_words: 256 },
            file_name: "AXTEST_V{version}.elf.S".into(),
            boot: None,
            outside: Outside::Unknown,
        }
    }

    #[test]
    fn a_sample_is_sound_and_says_what_it_is() {
        for unit in [AddressUnit::Word, AddressUnit::Byte] {
            let target = target(unit);
            let version = Version::new(1, 2, 3);
            for words in [FEWEST_WORDS, 1001, 0x10000] {
                let recipe = Recipe { target: &target, version, words, flaw: None };
                let file = make(&recipe).unwrap_or_else(|error| panic!("{error}"));
                let report = check(&file[..], None, std::slice::from_ref(&target), Some("AXTEST"), &[]);
                let report = report.unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(report.defects, [], "{unit:?} {words}");
                let image = report.image().unwrap_or_else(|| panic!("{words}"));
                assert_eq!(
                    image.identity().map(|identity| (identity.version, identity.program_words)),
                    Some((version, words))
                );
                let bytes: usize = image.image().blocks.iter().map(|block| block.data.len()).sum();
                assert_eq!((bytes, image.image().address_unit), (words as usize * 2, unit));
                assert_eq!(image.image().header, HEADER);
            }
        }
    }

    #[test]
    fn impossible_images_are_refused() {
        let target = target(AddressUnit::Word);
        let with = |words, flaw| make(&Recipe { target: &target, version: Version::new(1, 0, 0), words, flaw });
        assert!(matches!(with(FEWEST_WORDS - 1, None), Err(MakeError::TooSmall { .. })));
        assert!(matches!(with(0x10001, None), Err(MakeError::TooBig { .. })));
        assert_eq!(with(FEWEST_WORDS, Some(DefectId::TooLarge)), Err(MakeError::NoSuchFlaw(DefectId::TooLarge)));
        // The identity block has room for twelve characters.
        let of = |version| make(&Recipe { target: &target, version, words: FEWEST_WORDS, flaw: None });
        assert!(of(Version::new(1000, 1000, 100)).is_err() && of(Version::new(1000, 1000, 10)).is_ok());
        let version = Version::new(u16::MAX, u16::MAX, u16::MAX);
        assert_eq!(of(version), Err(MakeError::VersionTooLong { version }));
    }
}
