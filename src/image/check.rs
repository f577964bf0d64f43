//! Whole-file rules: reads an image once, of whatever size, and lists every defect in it.
//!
//! Defects of a line and of the order of records are noted as the lines pass; what can only be said of the whole
//! (addresses, identity) is [`super::whole`]'s, from the data that was kept. No more data is kept than the largest
//! flash holds. A line that cannot be read is one defect: nothing that merely follows from it is reported as well.

use std::io::{self, Read};

use super::defect::{DefectId, Findings};
use super::lines::{self, LineEnd, Lines, RawLine};
use super::report::{Facts, Format, Report};
use super::srecord::{self, Kind, LineError, Record};
use super::{AddressUnit, Target, whole};

/// Checks an image file.
///
/// `file_name` is compared with what is inside. `targets` are the products there are; the identity block says which of
/// them the image is for, and `expected` which it should be for. Errors whose names are in `allow` do not keep the
/// image from being sent, but are still listed.
///
/// # Errors
/// Only if the reader fails. A bad file is a report.
pub fn check(
    reader: impl Read,
    file_name: Option<&str>,
    targets: &[Target],
    expected: Option<&str>,
    allow: &[DefectId],
) -> io::Result<Report> {
    check_lines(Lines::new(reader), file_name, targets, expected, allow)
}

fn check_lines<R: Read>(
    mut lines: Lines<R>,
    file_name: Option<&str>,
    targets: &[Target],
    expected: Option<&str>,
    allow: &[DefectId],
) -> io::Result<Report> {
    let mut scan = Scan::new(allow);
    match recognise(lines.head()?) {
        Nature::SRecord { mark } => {
            if mark > 0 {
                scan.findings.note(DefectId::ByteOrderMark, 1, 1, || "the file begins with a byte order mark".into());
                lines.skip(mark);
            }
        }
        Nature::Empty => {
            scan.findings.note(DefectId::EmptyFile, 1, 1, || "the file holds nothing".into());
            return Ok(scan.refuse(None, lines.bytes()));
        }
        Nature::Other(format, what) => {
            scan.findings.note(DefectId::NotSRecord, 1, 1, || format!("this is {what}, not an S-record file"));
            return Ok(scan.refuse(format, lines.bytes()));
        }
    }
    let mut room = [0; 255];
    while let Some(line) = lines.next()? {
        scan.line(line, &mut room);
    }
    scan.facts.size = lines.bytes();
    Ok(scan.conclude(&whole::Request { file_name, targets, expected }))
}

/// What a file is, judged by its beginning.
#[derive(Debug, PartialEq, Eq)]
enum Nature {
    /// S-records, behind a byte order mark of this length.
    SRecord { mark: usize },
    /// Nothing, or nothing but blanks.
    Empty,
    /// Something else, with its name.
    Other(Option<Format>, &'static str),
}

fn recognise(head: &[u8]) -> Nature {
    for (magic, what) in MAGICS {
        if head.starts_with(magic) {
            return Nature::Other(None, what);
        }
    }
    let text = head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head);
    let mark = head.len() - text.len();
    let has_record = text.split(|&byte| byte == b'\r' || byte == b'\n').any(|line| {
        line.first().is_some_and(|first| first.eq_ignore_ascii_case(&b'S'))
            && line.get(1).is_some_and(u8::is_ascii_digit)
    });
    if has_record {
        return Nature::SRecord { mark };
    }
    match text.trim_ascii_start() {
        [] if head.len() < lines::HEAD => Nature::Empty,
        [b':', first, second, ..] if first.is_ascii_hexdigit() && second.is_ascii_hexdigit() => {
            Nature::Other(Some(Format::IntelHex), "an Intel HEX file")
        }
        [b'<', ..] => Nature::Other(None, "an HTML or XML page"),
        text if text.iter().any(|byte| matches!(byte, 0..=8 | 14..=25 | 27..=31)) => Nature::Other(None, "binary data"),
        _ => Nature::Other(None, "a text without any record"),
    }
}

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

const MAGICS: [(&[u8], &str); 8] = [
    (b"\x7FELF", "an ELF file (the linker's output before its conversion)"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1F\x8B", "a gzip archive"),
    (b"7z\xBC\xAF", "a 7-Zip archive"),
    (b"MZ", "a Windows program"),
    (b"%PDF", "a PDF document"),
    (b"\xFF\xFE", "UTF-16 text"),
    (b"\xFE\xFF", "UTF-16 text"),
];

/// What was read: data bytes of all records in a row, and where each record's lie.
#[derive(Debug)]
pub(super) struct Content {
    bytes: Vec<u8>,
    pub(super) pieces: Vec<Piece>,
    pub(super) unit: AddressUnit,
}

/// The data of one record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) line: u64,
    pub(super) address: u32,
    start: u32,
    length: u8,
}

impl Content {
    pub(super) fn data(&self, piece: &Piece) -> &[u8] {
        let start = piece.start as usize;
        self.bytes.get(start..start + usize::from(piece.length)).unwrap_or_default()
    }

    /// Keeps a record's data, if there is room.
    fn keep(&mut self, line: u64, record: &Record<'_>) -> bool {
        if self.bytes.len() + record.data.len() > MOST_BYTES || self.pieces.len() >= MOST_PIECES {
            return false;
        }
        let start = self.bytes.len() as u32;
        self.pieces.push(Piece { line, address: record.address, start, length: record.data.len() as u8 });
        self.bytes.extend_from_slice(record.data);
        true
    }
}

impl Piece {
    pub(super) fn length(&self) -> usize {
        usize::from(self.length)
    }
}

/// The largest flash of these parts: 256 K words.
pub(super) const MOST_BYTES: usize = 512 * 1024;
/// That flash in records of eight bytes, shorter than any linker writes.
const MOST_PIECES: usize = 65_536;

/// Something that may be on every line and is reported once.
#[derive(Debug, Default)]
struct Repeated {
    lines: u64,
    line: u64,
    column: usize,
}

impl Repeated {
    fn seen(&mut self, line: u64, column: usize) {
        if self.lines == 0 {
            (self.line, self.column) = (line, column);
        }
        self.lines += 1;
    }

    fn note(&self, findings: &mut Findings, id: DefectId, what: &str) {
        if self.lines > 0 {
            findings.note(id, self.line, self.column, || format!("{what}, in {}", lines_in_words(self.lines)));
        }
    }
}

/// How addresses advance from one record to the next.
#[derive(Debug, Default)]
pub(super) struct Steps {
    /// Steps of half as many addresses as the record before has bytes.
    words: u64,
    /// Steps of as many.
    bytes: u64,
    word_line: u64,
    byte_line: u64,
    last: Option<(u32, usize)>,
}

impl Steps {
    fn step(&mut self, line: u64, record: &Record<'_>) {
        if let Some((address, length)) = self.last {
            let advance = u64::from(record.address.wrapping_sub(address));
            if advance == length as u64 {
                self.bytes += 1;
                self.byte_line = if self.bytes == 1 { line } else { self.byte_line };
            } else if advance * 2 == length as u64 {
                self.words += 1;
                self.word_line = if self.words == 1 { line } else { self.word_line };
            }
        }
        self.last = Some((record.address, record.data.len()));
    }

    /// What addresses count, and the first line that shows it.
    ///
    /// In a file of words, a gap as long as a record looks like a step of bytes; so the majority decides.
    pub(super) fn unit(&self) -> Option<(AddressUnit, u64)> {
        match (self.words, self.bytes) {
            (0, 0) => None,
            (words, bytes) if words >= bytes => Some((AddressUnit::Word, self.word_line)),
            _ => Some((AddressUnit::Byte, self.byte_line)),
        }
    }
}

/// Where the reading stands.
struct Scan {
    findings: Findings,
    facts: Facts,
    content: Content,
    steps: Steps,
    line: u64,
    header_seen: bool,
    /// First data in front of a header.
    early_data: Option<u64>,
    /// Line of the terminator; 0 is one that could not be read.
    terminator: Option<u64>,
    after: Repeated,
    /// Lines that begin as data records, readable or not: what a count record counts.
    data_lines: u64,
    /// Lines nothing could be made of.
    lost: u64,
    last_address: Option<u32>,
    too_large: bool,
    last_end: Option<LineEnd>,
    mixed: Option<(u64, LineEnd)>,
    blank: Repeated,
    blanks_behind: Repeated,
    lower_case: Repeated,
}

impl Scan {
    fn new(allow: &[DefectId]) -> Self {
        Scan {
            findings: Findings::new(allow),
            facts: Facts::default(),
            content: Content { bytes: Vec::new(), pieces: Vec::new(), unit: AddressUnit::Word },
            steps: Steps::default(),
            line: 0,
            header_seen: false,
            early_data: None,
            terminator: None,
            after: Repeated::default(),
            data_lines: 0,
            lost: 0,
            last_address: None,
            too_large: false,
            last_end: None,
            mixed: None,
            blank: Repeated::default(),
            blanks_behind: Repeated::default(),
            lower_case: Repeated::default(),
        }
    }

    /// Ends without reading any record.
    fn refuse(mut self, format: Option<Format>, size: u64) -> Report {
        self.facts.format = format;
        self.facts.size = size;
        self.report()
    }

    fn report(self) -> Report {
        let found = self.findings.conclude();
        Report {
            facts: self.facts,
            defects: found.listed,
            errors: found.errors,
            warnings: found.warnings,
            allowed: found.allowed,
            overridden: found.overridden,
            content: self.content,
        }
    }

    fn line(&mut self, raw: RawLine<'_>, room: &mut srecord::Room) {
        self.line += 1;
        self.line_end(raw.end);
        let text = raw.text;
        if text.trim_ascii().is_empty() && !raw.cut {
            self.blank.seen(self.line, 1);
            return;
        }
        if self.terminator.is_some() {
            self.after.seen(self.line, 1);
            return;
        }
        if raw.cut {
            let longest = lines::LONGEST;
            self.findings.note(DefectId::LongLine, self.line, longest, || {
                format!("the line is longer than {longest} characters; a record has at most 514")
            });
            self.lose(text);
            return;
        }
        match srecord::parse(text, room) {
            Ok(line) => {
                if line.lower_case {
                    self.lower_case.seen(self.line, 1);
                }
                if let Some(wrong) = line.wrong_checksum {
                    self.findings.note(DefectId::BadChecksum, self.line, line.characters - 1, || {
                        format!("the record's bytes give checksum {:02X}, it says {:02X}", wrong.computed, wrong.stored)
                    });
                }
                self.rest_of_line(text, line.characters);
                self.record(&line.record);
            }
            Err(error) => self.unreadable(text, &error),
        }
    }

    fn line_end(&mut self, end: LineEnd) {
        if end != LineEnd::None {
            let first = *self.facts.line_end.get_or_insert(end);
            if end != first && self.mixed.is_none() {
                self.mixed = Some((self.line, end));
            }
        }
        self.last_end = Some(end);
    }

    fn rest_of_line(&mut self, text: &[u8], characters: usize) {
        let Some(rest) = text.get(characters..).filter(|rest| !rest.is_empty()) else { return };
        if rest.trim_ascii().is_empty() {
            self.blanks_behind.seen(self.line, characters + 1);
        } else {
            self.findings.note(DefectId::TrailingCharacters, self.line, characters + 1, || {
                format!("{} characters follow the checksum", rest.len())
            });
        }
    }

    #[cold]
    fn unreadable(&mut self, text: &[u8], error: &LineError) {
        let id = match error {
            LineError::NotARecord(_) => DefectId::NotARecord,
            LineError::UnknownType(_) => DefectId::UnknownType,
            LineError::Character { .. } => DefectId::BadCharacter,
            LineError::Short { .. } => DefectId::ShortRecord,
            LineError::Length { .. } => DefectId::BadLength,
        };
        self.findings.note(id, self.line, error.column(), || error.to_string());
        self.lose(text);
    }

    /// A line nothing can be made of. What it was meant to be is still believed, so that a damaged header is not
    /// reported as a missing one, too.
    #[cold]
    fn lose(&mut self, text: &[u8]) {
        self.lost += 1;
        self.steps.last = None;
        let meant = text.first().is_some_and(|first| first.eq_ignore_ascii_case(&b'S'));
        match text.get(1).filter(|_| meant) {
            Some(b'0') => self.header_seen = true,
            Some(b'1'..=b'3') => {
                self.data_lines += 1;
                self.note_early_data();
            }
            Some(b'7'..=b'9') => self.terminator = Some(0),
            Some(_) | None => {}
        }
    }

    fn record(&mut self, record: &Record<'_>) {
        self.facts.records += 1;
        match record.kind {
            Kind::Header => self.header(record),
            Kind::Data32 => self.data(record),
            Kind::Data16 | Kind::Data24 => {
                self.refused_type(record.kind, "S3");
                self.data(record);
            }
            Kind::Count16 | Kind::Count24 => self.count(record),
            Kind::Start32 => self.start(record),
            Kind::Start24 | Kind::Start16 => {
                self.refused_type(record.kind, "S7");
                self.start(record);
            }
        }
    }

    fn refused_type(&mut self, kind: Kind, instead: &str) {
        self.findings.note(DefectId::RefusedType, self.line, 1, || {
            format!("loaders take S0, S3 and S7 only, this is {kind}; as {instead} it would be taken")
        });
    }

    fn header(&mut self, record: &Record<'_>) {
        if self.header_seen {
            self.findings.note(DefectId::DuplicateHeader, self.line, 1, || {
                "a second header: it would start the download anew".into()
            });
            return;
        }
        self.header_seen = true;
        if let Some(line) = self.early_data {
            let header_line = self.line;
            self.findings.note(DefectId::DataBeforeHeader, line, 1, || {
                format!("data before the header, which follows in line {header_line}")
            });
        }
        let text = match record.data {
            [0, 0, text @ ..] if record.address == 0 => text,
            text => {
                self.findings.note(DefectId::HeaderForm, self.line, 5, || {
                    "the header has no four-byte address; it is sent with one".into()
                });
                text
            }
        };
        // A header with a short address may be two characters longer than one with a long address.
        let text = &text[..text.len().min(srecord::LONGEST_HEADER)];
        self.facts.characters += (srecord::FEWEST_HEADER_CHARACTERS + text.len() * 2 + 1) as u64;
        self.facts.header = Some(text.to_vec());
    }

    fn note_early_data(&mut self) {
        if !self.header_seen && self.early_data.is_none() {
            self.early_data = Some(self.line);
        }
    }

    fn data(&mut self, record: &Record<'_>) {
        self.data_lines += 1;
        self.note_early_data();
        if record.data.is_empty() {
            self.findings.note(DefectId::EmptyRecord, self.line, 3, || "a data record without data; not sent".into());
            return;
        }
        if let Some(last) = self.last_address.filter(|&last| record.address < last) {
            self.findings.note(DefectId::Descending, self.line, 5, || {
                format!("address 0x{:08X} after 0x{last:08X}", record.address)
            });
        }
        self.last_address = Some(record.address);
        self.steps.step(self.line, record);
        self.facts.data_bytes += record.data.len() as u64;
        // An S1 or S2 is sent as an S3, odd data is filled up.
        self.facts.characters += 4 + (4 + record.data.len().next_multiple_of(2) as u64 + 1) * 2 + 1;
        if !self.content.keep(self.line, record) && !self.too_large {
            self.too_large = true;
            self.findings.note(DefectId::TooLarge, self.line, 1, || {
                format!("more than the {} KByte or {MOST_PIECES} records any unit holds", MOST_BYTES / 1024)
            });
        }
    }

    fn count(&mut self, record: &Record<'_>) {
        let (kind, says, counted) = (record.kind, u64::from(record.address), self.data_lines);
        self.findings.note(DefectId::CountRecord, self.line, 1, || format!("an {kind} record; not sent"));
        if says != counted {
            self.findings.note(DefectId::WrongCount, self.line, 5, || {
                format!("it counts {says} data records, there are {counted} before it")
            });
        }
    }

    fn start(&mut self, record: &Record<'_>) {
        self.terminator = Some(self.line);
        self.facts.entry = Some(record.address);
        self.facts.characters += 15;
    }

    fn conclude(mut self, request: &whole::Request<'_>) -> Report {
        self.facts.format = Some(Format::SRecord);
        self.note_repeated();
        if !self.header_seen {
            self.findings.note(DefectId::MissingHeader, 1, 1, || "there is no header (S0)".into());
        }
        if self.terminator.is_none() {
            self.findings.note(DefectId::MissingTerminator, self.line, 1, || {
                "the file ends without a terminator (S7): it is cut off".into()
            });
        }
        if self.content.pieces.is_empty() {
            if self.lost == 0 {
                self.findings.note(DefectId::NoData, self.line, 1, || "there is no data in the file".into());
            }
            return self.report();
        }
        let whole = whole::Whole {
            steps: &self.steps,
            complete: self.lost == 0 && !self.too_large,
            terminator: self.terminator.filter(|&line| line > 0),
        };
        whole.judge(request, &mut self.content, &mut self.facts, &mut self.findings);
        self.report()
    }

    fn note_repeated(&mut self) {
        let findings = &mut self.findings;
        self.blank.note(findings, DefectId::BlankLine, "nothing but blanks");
        self.blanks_behind.note(findings, DefectId::TrailingBlanks, "blanks behind the record");
        self.lower_case.note(findings, DefectId::LowerCase, "lower-case letters");
        self.after.note(findings, DefectId::AfterTerminator, "something behind the terminator");
        if let (Some((line, end)), Some(first)) = (self.mixed, self.facts.line_end) {
            findings.note(DefectId::MixedLineEnds, line, 1, || {
                format!("this line ends with {}, those before with {}", end.name(), first.name())
            });
        }
        if self.last_end == Some(LineEnd::None) {
            findings.note(DefectId::NoLineEnd, self.line, 1, || "the last line has no line end".into());
        }
    }
}

fn lines_in_words(lines: u64) -> String {
    if lines == 1 { "one line".into() } else { format!("{lines} lines") }
}
