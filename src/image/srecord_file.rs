//! What the lines of an S-record file mean: header, data, counts, terminator, and their order.

use super::defect::DefectId;
use super::report::Format;
use super::scan::{Grammar, Repeated, Scan, Terminator};
use super::srecord::{self, Kind, LineError, Record, Room};

/// An S-record file as far as it has been read.
pub(super) struct SRecordFile {
    header_seen: bool,
    /// Line of the first data before a header.
    early_data: Option<u64>,
    /// Lines that begin as data records, readable or not: what a count record counts.
    data_lines: u64,
    lower_case: Repeated,
    /// Types that loaders do not take, what each would be taken as, and where.
    refused: Vec<(Kind, &'static str, Repeated)>,
}

impl SRecordFile {
    pub(super) fn new() -> Self {
        SRecordFile {
            header_seen: false,
            early_data: None,
            data_lines: 0,
            lower_case: Repeated::default(),
            refused: Vec::new(),
        }
    }
}

impl Grammar for SRecordFile {
    type Room = Room;

    const ROOM: Room = [0; 255];

    fn line(&mut self, scan: &mut Scan, text: &[u8], room: &mut Room) {
        match srecord::parse(text, room) {
            Ok(line) => {
                if line.lower_case {
                    self.lower_case.seen(scan.line, 1);
                }
                if let Some(wrong) = line.wrong_checksum {
                    scan.wrong_checksum(line.characters, wrong.stored, wrong.computed);
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
        let meant = text.first().is_some_and(|first| first.eq_ignore_ascii_case(&b'S'));
        match text.get(1).filter(|_| meant) {
            Some(b'0') => self.header_seen = true,
            Some(b'1'..=b'3') => {
                self.data_lines += 1;
                self.note_early_data(scan);
            }
            Some(b'5' | b'6') => {}
            Some(b'7'..=b'9') => scan.terminator = Some(Terminator::Lost),
            Some(_) | None => return false,
        }
        true
    }

    fn conclude(&mut self, scan: &mut Scan) {
        self.lower_case.note(&mut scan.findings, DefectId::LowerCase, "lower-case letters");
        for (kind, instead, lines) in &self.refused {
            let what = format!("loaders take S0, S3 and S7 only; {kind}, which they would take as {instead}");
            lines.note(&mut scan.findings, DefectId::RefusedType, &what);
        }
        if !self.header_seen && !scan.may_have_lost_header() {
            scan.findings.note(DefectId::MissingHeader, 1, 1, || "there is no header (S0)".into());
        }
    }

    fn format(&self) -> Format {
        Format::SRecord
    }
}

impl SRecordFile {
    fn record(&mut self, scan: &mut Scan, record: &Record<'_>) {
        scan.facts.records += 1;
        match record.kind {
            Kind::Header => self.header(scan, record),
            Kind::Data32 => self.data(scan, record),
            Kind::Data16 | Kind::Data24 => {
                self.refused(scan, record.kind, "S3");
                self.data(scan, record);
            }
            Kind::Count16 | Kind::Count24 => self.count(scan, record),
            Kind::Start32 => start(scan, record),
            Kind::Start24 | Kind::Start16 => {
                self.refused(scan, record.kind, "S7");
                start(scan, record);
            }
        }
    }

    /// A record of a type that loaders do not take. As a rule every line of such a file has one, so each type is
    /// reported once.
    fn refused(&mut self, scan: &Scan, kind: Kind, instead: &'static str) {
        let known = self.refused.iter_mut().find(|(known, ..)| *known == kind);
        match known {
            Some((.., lines)) => lines.seen(scan.line, 1),
            None => {
                let mut lines = Repeated::default();
                lines.seen(scan.line, 1);
                self.refused.push((kind, instead, lines));
            }
        }
    }

    fn header(&mut self, scan: &mut Scan, record: &Record<'_>) {
        if self.header_seen {
            scan.findings.note(DefectId::DuplicateHeader, scan.line, 1, || {
                "a second header: it would restart the download".into()
            });
            return;
        }
        self.header_seen = true;
        if let Some(line) = self.early_data {
            let header_line = scan.line;
            scan.findings.note(DefectId::DataBeforeHeader, line, 1, || {
                format!("data before the header, which follows in line {header_line}")
            });
        }
        let text = match record.data {
            [0, 0, text @ ..] if record.address == 0 => text,
            text => {
                scan.findings.note(DefectId::HeaderForm, scan.line, ADDRESS_COLUMN, || {
                    "the header has no four-byte address; it is sent with one".into()
                });
                text
            }
        };
        // The text of a header with a two-byte address may be two bytes longer than with a four-byte address.
        let text = &text[..text.len().min(srecord::LONGEST_HEADER)];
        scan.facts.characters += (srecord::FEWEST_HEADER_CHARACTERS + text.len() * 2 + 1) as u64;
        scan.facts.header = Some(text.to_vec());
    }

    fn note_early_data(&mut self, scan: &Scan) {
        if !self.header_seen && self.early_data.is_none() {
            self.early_data = Some(scan.line);
        }
    }

    fn data(&mut self, scan: &mut Scan, record: &Record<'_>) {
        self.data_lines += 1;
        self.note_early_data(scan);
        if record.data.is_empty() {
            scan.findings.note(DefectId::EmptyRecord, scan.line, LENGTH_COLUMN, || {
                "a data record without data; not sent".into()
            });
            return;
        }
        scan.data(record.address, ADDRESS_COLUMN, record.data);
    }

    fn count(&mut self, scan: &mut Scan, record: &Record<'_>) {
        let (kind, says, counted) = (record.kind, u64::from(record.address), self.data_lines);
        scan.findings.note(DefectId::CountRecord, scan.line, 1, || format!("an {kind} record; not sent"));
        if !(counted..=counted + scan.unknown_lines()).contains(&says) {
            scan.findings.note(DefectId::WrongCount, scan.line, ADDRESS_COLUMN, || {
                format!("its number of data records is {says}, and {counted} precede it")
            });
        }
    }
}

fn start(scan: &mut Scan, record: &Record<'_>) {
    scan.terminator = Some(Terminator::Read(scan.line));
    scan.entry_at = Some((scan.line, ADDRESS_COLUMN));
    scan.facts.entry = Some(record.address);
    scan.facts.characters += srecord::TERMINATOR_CHARACTERS as u64 + 1;
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

/// Column of the length's first digit.
pub(super) const LENGTH_COLUMN: usize = 3;
/// Column of the address's first digit.
pub(super) const ADDRESS_COLUMN: usize = 5;
