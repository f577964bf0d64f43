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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::make::{self, FEWEST_WORDS, Recipe, make};
    use super::super::{CheckedImage, FlashMap, Severity};
    use super::*;
    use crate::version::Version;

    fn target() -> Target {
        Target {
            product: "AXTEST".into(),
            flash: FlashMap { address_unit: AddressUnit::Word, program_words: 0x10000, page_words: 256 },
            file_name: "AXTEST_V{version}.elf.S".into(),
        }
    }

    fn sample(flaw: Option<DefectId>) -> Vec<u8> {
        let recipe = Recipe { target: &target(), version: Version::new(1, 2, 0), words: FEWEST_WORDS, flaw };
        make(&recipe).unwrap_or_else(|error| panic!("{error}"))
    }

    fn report_with(file: &[u8], name: Option<&str>, expected: Option<&str>, allow: &[DefectId]) -> Report {
        check(file, name, &[target()], expected, allow).unwrap_or_else(|error| panic!("{error}"))
    }

    fn report(file: &[u8]) -> Report {
        report_with(file, None, None, &[])
    }

    /// Name, line, column.
    type Found = (&'static str, u64, u32);

    fn found(report: &Report) -> Vec<Found> {
        report.defects.iter().map(|defect| (defect.id.name(), defect.line, defect.column)).collect()
    }

    /// A file of a few records, written here by hand: the checks of structure, without an identity.
    const HEAD: &str = "S0110000000050524F4752414D264441544196\n";

    #[test]
    fn small_files_and_all_that_is_wrong_with_them() {
        let one = "S307000000001122C5\n";
        let two = "S30700000001334480\n";
        let end = "S70500000000FA\n";
        let table: [(String, &[Found]); 24] = [
            (format!("{HEAD}{one}{two}{end}"), &[("no-identity", 1, 1)]),
            (String::new(), &[("empty-file", 1, 1)]),
            ("\r\n \n".into(), &[("empty-file", 1, 1)]),
            ("hello\n".into(), &[("not-s-record", 1, 1)]),
            (":10010000214601360121470136007EFE09D2190140\n".into(), &[("not-s-record", 1, 1)]),
            ("\u{7F}ELF\u{1}".into(), &[("not-s-record", 1, 1)]),
            (format!("{one}{end}"), &[("no-identity", 1, 1), ("missing-header", 1, 1)]),
            (HEAD.into(), &[("missing-terminator", 1, 1), ("no-data", 1, 1)]),
            (format!("{HEAD}{end}"), &[("no-data", 2, 1)]),
            (format!("{HEAD}{one}"), &[("no-identity", 1, 1), ("missing-terminator", 2, 1)]),
            (
                format!("{HEAD}S3070000000011226EE5\n{end}"),
                &[("bad-checksum", 2, 17), ("trailing-characters", 2, 19), ("no-identity", 1, 1)],
            ),
            (format!("{HEAD}\n{one}{end}\n"), &[("no-identity", 1, 1), ("blank-line", 2, 1)]),
            (format!("\u{FEFF}{HEAD}{one}{end}"), &[("byte-order-mark", 1, 1), ("no-identity", 1, 1)]),
            (format!("{HEAD}{}{end}", one.replace("1122", "11ä2")), &[("bad-character", 2, 15)]),
            (format!("{HEAD}{}{end}", one.replace("1122", "1\0\u{7F}2")), &[("bad-character", 2, 14)]),
            (format!("{HEAD}{one}{one}{end}"), &[("no-identity", 1, 1), ("overlap", 3, 5)]),
            (format!("{HEAD}{two}{one}{end}"), &[("no-identity", 1, 1), ("descending", 3, 5)]),
            (format!("{HEAD}{two}{end}"), &[("no-identity", 1, 1), ("gap", 2, 5), ("entry-outside", 3, 5)]),
            (format!("{HEAD}{one}S5030001FB\n{end}"), &[("no-identity", 1, 1), ("count-record", 3, 1)]),
            (
                format!("{HEAD}{one}S5030002FA\n{end}"),
                &[("no-identity", 1, 1), ("count-record", 3, 1), ("wrong-count", 3, 5)],
            ),
            (format!("{HEAD}{one}{end}{end}{one}"), &[("no-identity", 1, 1), ("after-terminator", 4, 1)]),
            (format!("{HEAD}{one}S9030000FC\n"), &[("no-identity", 1, 1), ("refused-type", 3, 1)]),
            (format!("{HEAD}{one}S30300EE\n{end}"), &[("bad-length", 3, 3)]),
            (format!("S001FE\n{one}{end}"), &[("bad-length", 1, 3)]),
        ];
        for (file, expected) in table {
            let (mut found, mut expected) = (found(&report(file.as_bytes())), expected.to_vec());
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected, "{file:?}");
        }
    }

    #[test]
    fn every_flaw_that_can_be_made_is_found_and_no_other_error() {
        for flaw in make::flaws() {
            let report = report(&sample(Some(flaw)));
            assert!(report.defects.iter().any(|defect| defect.id == flaw), "{flaw}: {:?}", report.defects);
            let others = report.defects.iter().filter(|other| other.id != flaw && other.severity == Severity::Error);
            assert_eq!(others.count(), 0, "{flaw}: {:?}", report.defects);
            assert_eq!(report.image().is_some(), flaw.severity() == Severity::Warning, "{flaw}");
        }
    }

    #[test]
    fn what_is_expected_is_compared() {
        let file = sample(None);
        let other = Target { product: "AXOTHER".into(), file_name: "AXOTHER_V{version}.elf.S".into(), ..target() };
        let targets = [target(), other];
        let with = |name, expected| check(&file[..], name, &targets, expected, &[]).map(|report| found(&report)).ok();
        assert_eq!(with(Some("/a/b/AXTEST_V1.2.0.elf.S"), Some("axtest")), Some(vec![]));
        assert_eq!(with(Some("AXTEST_V1.2.1.elf.S"), None), Some(vec![("file-name", 10, 1)]));
        assert_eq!(with(Some("AXOTHER_V1.2.0.elf.S"), None), Some(vec![("file-name", 10, 1)]));
        assert_eq!(with(None, Some("AXOTHER")), Some(vec![("wrong-product", 10, 1)]));
        let nameless = report_with(&sample(Some(DefectId::NoIdentity)), None, Some("AXTEST"), &[]);
        assert_eq!(nameless.errors, 1, "when a product is expected, silence is an error: {:?}", nameless.defects);
    }

    #[test]
    fn an_allowed_error_is_listed_and_recorded_and_others_still_count() {
        let file = sample(Some(DefectId::BadChecksum));
        let report = report_with(&file, None, None, &[DefectId::BadChecksum, DefectId::Overlap]);
        assert!(report.is_ok() && report.defects[0].allowed);
        assert_eq!(report.image().map(|image| image.overridden().to_vec()), Some(vec![DefectId::BadChecksum]));
        assert!(!report_with(&file, None, None, &[DefectId::Overlap]).is_ok());
        let lost = report_with(&sample(Some(DefectId::BadCharacter)), None, None, &[DefectId::BadCharacter]);
        assert!(!lost.is_ok(), "what cannot be read cannot be sent");
    }

    #[test]
    fn odd_data_is_filled_up_when_it_is_allowed() {
        let report = report_with(&sample(Some(DefectId::OddLength)), None, None, &[DefectId::OddLength]);
        let last = report.image().and_then(|image| image.image().blocks.last().cloned());
        assert_eq!(last.map(|block| (block.data.len(), block.data.last().copied())), Some((32, Some(0xFF))));
    }

    #[test]
    fn all_line_ends_give_the_same_image() {
        let file = sample(None);
        let text = String::from_utf8_lossy(&file).into_owned();
        let image = report(&file).image();
        assert!(image.is_some());
        for end in ["\r", "\n"] {
            let report = report(text.replace("\r\n", end).as_bytes());
            assert_eq!((report.defects.len(), report.image()), (0, image.clone()), "{end:?}");
        }
        assert_eq!(report(text.to_lowercase().as_bytes()).image(), image);
    }

    #[test]
    fn the_srec_crate_reads_the_same_data() {
        let file = sample(None);
        let text = String::from_utf8_lossy(&file).into_owned();
        let theirs: Vec<(u32, Vec<u8>)> = srec::read_records(&text)
            .filter_map(|record| match record {
                Ok(srec::Record::S3(data)) => Some((data.address.0, data.data)),
                _ => None,
            })
            .collect();
        let image = report(&file).image();
        let ours =
            image.iter().flat_map(|image| &image.image().blocks).map(|block| (block.address, block.data.clone()));
        assert_eq!(ours.collect::<Vec<_>>(), theirs);
    }

    #[test]
    fn junk_gives_a_bounded_report() {
        let mut file = b"S0030000FC\n".to_vec();
        file.extend(b"?\n".repeat(50_000));
        let report = report(&file);
        assert_eq!(report.errors, 50_002 - 1, "every line and the missing terminator");
        assert_eq!(report.defects.len() as u64, super::super::defect::MOST_LISTED + report.warnings);
    }

    #[test]
    fn more_than_any_flash_holds_is_not_kept() {
        let mut file = HEAD.as_bytes().to_vec();
        for address in (0..0x50_0000u32).step_by(125) {
            Record { kind: Kind::Data32, address, data: &[0x5A; 250] }.write(&mut file);
            file.push(b'\r');
            if file.len() > 2_000_000 {
                break;
            }
        }
        file.extend(b"S70500000000FA\r");
        let report = report(&file);
        assert!(report.content.bytes.len() <= MOST_BYTES);
        assert_eq!(report.defects.iter().filter(|defect| defect.id == DefectId::TooLarge).count(), 1);
        assert!(report.image().is_none());
    }

    /// Gives one to `most` bytes at a time.
    struct Dribble<'a> {
        bytes: &'a [u8],
        most: usize,
    }

    impl Read for Dribble<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let size = (1 + self.bytes.len() % self.most).min(buffer.len());
            self.bytes.read(&mut buffer[..size])
        }
    }

    fn every_flaw() -> Vec<Option<DefectId>> {
        make::flaws().map(Some).chain([None]).collect()
    }

    /// Samples with one of these flaws, then damaged anywhere.
    fn damaged(flaws: Vec<Option<DefectId>>) -> impl Strategy<Value = Vec<u8>> {
        let damage = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3), 0..6);
        (prop::sample::select(flaws), damage).prop_map(|(flaw, damage)| {
            let mut file = sample(flaw);
            for (at, byte, deed) in damage {
                let at = at.index(file.len() + 1);
                match deed {
                    0 => file.insert(at, byte),
                    1 if at < file.len() => file[at] = byte,
                    2 if at < file.len() => drop(file.remove(at)),
                    _ => {}
                }
            }
            file
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn no_chunking_and_no_buffer_changes_a_report(file in damaged(every_flaw()), most in 1usize..600, buffer in 0usize..300) {
            let whole = report(&file);
            let lines = Lines::with_buffer(Dribble { bytes: &file, most }, lines::SMALLEST_BUFFER + buffer);
            let pieces = check_lines(lines, None, &[target()], None, &[]);
            let pieces = pieces.map_err(|error| TestCaseError::fail(error.to_string()))?;
            prop_assert_eq!(&whole.defects, &pieces.defects);
            prop_assert_eq!(&whole.facts, &pieces.facts);
            prop_assert_eq!(whole.image(), pieces.image());
        }

        #[test]
        fn damage_never_passes_as_another_program(file in damaged(vec![None])) {
            let sorted = |image: CheckedImage| {
                let mut blocks: Vec<(u32, Vec<u8>)> =
                    image.image().blocks.iter().map(|block| (block.address, block.data.clone())).collect();
                blocks.sort();
                blocks
            };
            if let Some(image) = report(&file).image() && image.identity().is_some() {
                prop_assert_eq!(Some(sorted(image)), report(&sample(None)).image().map(sorted));
            }
        }

        #[test]
        fn junk_never_panics(junk in prop::collection::vec(any::<u8>(), 0..6000), record_like in any::<bool>()) {
            let mut file = if record_like { b"S0030000FC\rS3".to_vec() } else { Vec::new() };
            file.extend(junk);
            let report = report(&file);
            prop_assert!(!report.is_ok());
            for defect in &report.defects {
                prop_assert!(!defect.message.chars().any(char::is_control), "{:?}", defect);
                prop_assert!(defect.line >= 1 && defect.column >= 1);
            }
        }

        #[test]
        fn lines_of_records_never_panic(records in prop::collection::vec((prop::sample::select(&Kind::ALL[..]), any::<u32>(), 0usize..40), 0..40)) {
            let mut file = b"S0030000FC\n".to_vec();
            for (kind, address, length) in records {
                let data = vec![0xA5; length.min(kind.most_data())];
                Record { kind, address: address >> (32 - kind.address_bytes() * 8), data: &data }.write(&mut file);
                file.push(b'\n');
            }
            prop_assert!(report_with(&file, Some("x"), None, &DefectId::ALL).facts.records > 0);
        }
    }
}
