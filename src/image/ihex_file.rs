//! What the lines of an Intel HEX file mean: data, where its offsets lie, the entry point, the end.
//!
//! There is no header, and an entry point need not be given. Addresses are offsets to a base; readers disagree whether
//! data that runs past offset FFFFh starts again at the base or goes on after it, so such a file is refused.

use super::defect::{DefectId, MOST_LISTED};
use super::ihex::{self, DATA_COLUMN, Kind, LENGTH_COLUMN, LineError, OFFSET_COLUMN, Record, Room};
use super::report::Format;
use super::scan::{Grammar, Scan, Terminator};
use super::{AddressUnit, srecord};

/// An Intel HEX file as far as it has been read.
pub(super) struct IntelHexFile {
    /// What is added to offsets; `None` after an unreadable record that should have set it.
    base: Option<u32>,
    /// Line of the entry point.
    start: Option<u64>,
    /// An entry point was given, though it may be unreadable.
    start_seen: bool,
    /// Lines of records that run past their base's last offset if addresses count bytes, but not if they count words.
    wraps_of_bytes: Vec<u64>,
}

impl IntelHexFile {
    pub(super) fn new() -> Self {
        IntelHexFile { base: Some(0), start: None, start_seen: false, wraps_of_bytes: Vec::new() }
    }
}

impl Grammar for IntelHexFile {
    type Room = Room;

    const ROOM: Room = [0; 260];

    fn line(&mut self, scan: &mut Scan, text: &[u8], room: &mut Room) {
        match ihex::parse(text, room) {
            Ok(line) => {
                if let Some((stored, computed)) = line.wrong_checksum {
                    scan.wrong_checksum(line.characters, stored, computed);
                }
                scan.rest_of_line(text, line.characters);
                self.record(scan, &line.record);
            }
            Err(error) => {
                scan.unreadable(self, text, defect(&error), error.column(), || error.to_string());
            }
        }
    }

    #[cold]
    fn lose(&mut self, scan: &mut Scan, text: &[u8]) -> bool {
        match text.get(7..9).filter(|_| text.first() == Some(&b':')) {
            // A record without data and offset can hardly have been anything but the end.
            Some(kind) if text.starts_with(b":000000") && !kind.iter().all(u8::is_ascii_hexdigit) => {
                scan.terminator = Some(Terminator::Lost);
            }
            Some(b"01") => scan.terminator = Some(Terminator::Lost),
            Some(b"02" | b"04") => self.base = None,
            Some(b"03" | b"05") => self.start_seen = true,
            Some(b"00") => {}
            Some(_) | None => return false,
        }
        true
    }

    fn conclude(&mut self, scan: &mut Scan) {
        if scan.steps.unit().is_some_and(|(unit, _)| unit == AddressUnit::Byte) {
            for line in std::mem::take(&mut self.wraps_of_bytes) {
                note_wrap(scan, line);
            }
        }
        if scan.facts.data_bytes == 0 {
            return;
        }
        // The image is sent with an empty header, and with a terminator in any case.
        let frame = srecord::FEWEST_HEADER_CHARACTERS + 1 + srecord::TERMINATOR_CHARACTERS + 1;
        scan.facts.characters += frame as u64;
        if let (false, Some(Terminator::Read(line))) = (self.start_seen, scan.terminator) {
            scan.entry_at = Some((line, 1));
            scan.findings.note(DefectId::MissingEntry, line, 1, || {
                "no entry point is given; the reset vector at address 0 is taken for it".into()
            });
        }
    }

    fn format(&self) -> Format {
        Format::IntelHex
    }
}

impl IntelHexFile {
    fn record(&mut self, scan: &mut Scan, record: &Record<'_>) {
        scan.facts.records += 1;
        if record.kind != Kind::Data && record.offset != 0 {
            scan.findings.note(DefectId::OffsetIgnored, scan.line, OFFSET_COLUMN, || {
                format!("{} has no use for its offset 0x{:04X}", record.kind, record.offset)
            });
        }
        match record.kind {
            Kind::Data => self.data(scan, record),
            Kind::EndOfFile => scan.terminator = Some(Terminator::Read(scan.line)),
            Kind::SegmentBase => self.base = Some(record.number() << 4),
            Kind::LinearBase => self.base = Some(record.number() << 16),
            Kind::SegmentStart => {
                let number = record.number();
                self.entry(scan, ((number >> 16) << 4) + (number & 0xFFFF));
            }
            Kind::LinearStart => self.entry(scan, record.number()),
        }
    }

    fn data(&mut self, scan: &mut Scan, record: &Record<'_>) {
        if record.data.is_empty() {
            scan.findings.note(DefectId::EmptyRecord, scan.line, LENGTH_COLUMN, || {
                "a data record without data; not sent".into()
            });
            return;
        }
        // If the base is not known, an error has been reported already, and nothing can be said about the data's place.
        let Some(base) = self.base else { return };
        self.look_for_wrap(scan, base, record);
        scan.data(base + u32::from(record.offset), OFFSET_COLUMN, record.data);
    }

    /// Notes a record that runs past the last offset. At the last base this is another defect (`address-wrap`), since
    /// no reader can go on after it.
    fn look_for_wrap(&mut self, scan: &mut Scan, base: u32, record: &Record<'_>) {
        let room = OFFSETS - usize::from(record.offset);
        if base == LAST_BASE || record.data.len() <= room {
            return;
        }
        if record.data.len().div_ceil(2) > room {
            note_wrap(scan, scan.line);
        } else if (self.wraps_of_bytes.len() as u64) < MOST_LISTED {
            self.wraps_of_bytes.push(scan.line);
        }
    }

    fn entry(&mut self, scan: &mut Scan, entry: u32) {
        self.start_seen = true;
        if let Some(first) = self.start {
            scan.findings.note(DefectId::DuplicateEntry, scan.line, DATA_COLUMN, || {
                format!("an entry point was given in line {first} already")
            });
            return;
        }
        self.start = Some(scan.line);
        scan.entry_at = Some((scan.line, DATA_COLUMN));
        scan.facts.entry = Some(entry);
    }
}

fn note_wrap(scan: &mut Scan, line: u64) {
    scan.findings.note(DefectId::SegmentWrap, line, OFFSET_COLUMN, || {
        "the data runs past offset 0xFFFF; some readers start again at the base, others go on after it".into()
    });
}

const fn defect(error: &LineError) -> DefectId {
    match error {
        LineError::NotARecord(_) => DefectId::NotARecord,
        LineError::UnknownType(_) => DefectId::UnknownType,
        LineError::Character { .. } => DefectId::BadCharacter,
        LineError::Short { .. } => DefectId::ShortRecord,
        LineError::Length { .. } => DefectId::BadLength,
    }
}

/// Offsets a base has.
const OFFSETS: usize = 0x1_0000;
/// The base of the last 64 K addresses.
const LAST_BASE: u32 = 0xFFFF_0000;
