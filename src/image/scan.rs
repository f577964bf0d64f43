//! Reading a file line by line, as far as it is the same in both formats.
//!
//! A [`Grammar`] says what a line means. This file deals with lines and their ends, with what may be on every line and
//! is reported once, with the data that is kept, and with the report at the end. A line that cannot be read is one
//! defect: nothing that merely follows from it is reported as well.

use std::io::{self, Read};

use super::content::{Content, MOST_BYTES, MOST_PIECES, Steps};
use super::defect::{DefectId, Findings};
use super::lines::{self, LineEnd, Lines, RawLine};
use super::report::{Facts, Format, Report};
use super::whole;
use crate::count::noun;

/// What lines of one format mean.
pub(super) trait Grammar {
    /// Where the bytes of a record are put.
    type Room;

    /// An empty room.
    const ROOM: Self::Room;

    /// Reads a line that is not blank, not too long and not after the terminator.
    fn line(&mut self, scan: &mut Scan, text: &[u8], room: &mut Self::Room);

    /// Guesses what an unreadable line was meant to be, so that a damaged header is not also reported as missing. Says
    /// whether that can be guessed.
    fn lose(&mut self, scan: &mut Scan, text: &[u8]) -> bool;

    /// The last line has been read.
    fn conclude(&mut self, scan: &mut Scan);

    /// Which format it is.
    fn format(&self) -> Format;
}

/// Reads all lines and judges the whole.
pub(super) fn read<R: Read, G: Grammar>(
    mut lines: Lines<R>,
    mut grammar: G,
    mut scan: Scan,
    request: &whole::Request<'_>,
) -> io::Result<Report> {
    let mut room = G::ROOM;
    while let Some(line) = lines.next()? {
        scan.line(line, &mut grammar, &mut room);
    }
    scan.facts.size = lines.bytes();
    scan.facts.format = Some(grammar.format());
    grammar.conclude(&mut scan);
    Ok(scan.conclude(grammar.format(), request))
}

/// Something that may be on every line and is reported once.
#[derive(Debug, Default)]
pub(super) struct Repeated {
    lines: u64,
    line: u64,
    column: usize,
}

impl Repeated {
    pub(super) fn seen(&mut self, line: u64, column: usize) {
        if self.lines == 0 {
            (self.line, self.column) = (line, column);
        }
        self.lines += 1;
    }

    pub(super) fn note(&self, findings: &mut Findings, id: DefectId, what: &str) {
        if self.lines > 0 {
            findings.note(id, self.line, self.column, || format!("{what}, in {}", lines_in_words(self.lines)));
        }
    }
}

/// The end of a file's data, as its terminator gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Terminator {
    /// It could be read, on this line.
    Read(u64),
    /// There was one, but it could not be read.
    Lost,
}

/// How far the reading has come.
pub(super) struct Scan {
    pub(super) findings: Findings,
    pub(super) facts: Facts,
    /// Number of the line being read, from 1.
    pub(super) line: u64,
    /// Where the entry point is given: line and column.
    pub(super) entry_at: Option<(u64, usize)>,
    pub(super) terminator: Option<Terminator>,
    pub(super) steps: Steps,
    content: Content,
    after: Repeated,
    /// Lines that could not be read.
    lost: u64,
    /// Those of them of which nobody can say what they were meant to be.
    unknown: u64,
    /// One of these came before any record: it may have been the header.
    unknown_first: bool,
    /// One of these is the last line so far: it may have been the terminator.
    unknown_last: bool,
    last_address: Option<u32>,
    too_large: bool,
    last_end: Option<LineEnd>,
    mixed: Option<(u64, LineEnd)>,
    blank: Repeated,
    trailing_blanks: Repeated,
}

impl Scan {
    pub(super) fn new(allow: &[DefectId]) -> Self {
        Scan {
            findings: Findings::new(allow),
            facts: Facts::default(),
            line: 0,
            entry_at: None,
            terminator: None,
            steps: Steps::default(),
            content: Content::new(),
            after: Repeated::default(),
            lost: 0,
            unknown: 0,
            unknown_first: false,
            unknown_last: false,
            last_address: None,
            too_large: false,
            last_end: None,
            mixed: None,
            blank: Repeated::default(),
            trailing_blanks: Repeated::default(),
        }
    }

    /// Ends without reading any record.
    pub(super) fn refuse(mut self, size: u64) -> Report {
        self.facts.size = size;
        self.report()
    }

    /// Notes that a line cannot be read.
    #[cold]
    pub(super) fn unreadable(
        &mut self,
        grammar: &mut impl Grammar,
        text: &[u8],
        id: DefectId,
        column: usize,
        message: impl FnOnce() -> String,
    ) {
        self.findings.note(id, self.line, column, message);
        self.lost += 1;
        self.steps.interrupt();
        // A line that is too long may hold several records, and any of them.
        if !grammar.lose(self, text) || id == DefectId::LongLine {
            self.unknown += 1;
            self.unknown_first |= self.facts.records == 0;
            self.unknown_last = true;
        }
    }

    /// Whether an unreadable line may have been the header.
    pub(super) fn may_have_lost_header(&self) -> bool {
        self.unknown_first
    }

    /// How many unreadable lines may have been anything, such as data.
    pub(super) fn unknown_lines(&self) -> u64 {
        self.unknown
    }

    pub(super) fn wrong_checksum(&mut self, characters: usize, stored: u8, computed: u8) {
        self.findings.note(DefectId::BadChecksum, self.line, characters - 1, || {
            format!("the record's bytes give checksum {computed:02X}, it says {stored:02X}")
        });
    }

    /// Looks at what follows a record of this many characters on its line.
    pub(super) fn rest_of_line(&mut self, text: &[u8], characters: usize) {
        let Some(rest) = text.get(characters..).filter(|rest| !rest.is_empty()) else { return };
        if rest.trim_ascii().is_empty() {
            self.trailing_blanks.seen(self.line, characters + 1);
        } else {
            self.findings.note(DefectId::TrailingCharacters, self.line, characters + 1, || {
                let follow = if rest.len() == 1 { "follows" } else { "follow" };
                format!("{} {} {follow} the checksum", rest.len(), noun(rest.len(), "character"))
            });
        }
    }

    /// Takes the data of a record, at least one byte.
    pub(super) fn data(&mut self, address: u32, address_column: usize, data: &[u8]) {
        if let Some(last) = self.last_address.filter(|&last| address < last) {
            self.findings.note(DefectId::Descending, self.line, address_column, || {
                format!("address 0x{address:08X} after 0x{last:08X}")
            });
        }
        self.last_address = Some(address);
        self.steps.step(self.line, address, data.len());
        self.facts.data_bytes += data.len() as u64;
        // Whatever its type was, the record is sent as an S3, and odd data is filled up.
        self.facts.characters += 4 + (4 + data.len().next_multiple_of(2) as u64 + 1) * 2 + 1;
        if !self.content.keep(self.line, address, data) && !self.too_large {
            self.too_large = true;
            self.findings.note(DefectId::TooLarge, self.line, 1, || {
                format!("more than the {} KByte or {MOST_PIECES} records any unit holds", MOST_BYTES / 1024)
            });
        }
    }

    fn line<G: Grammar>(&mut self, raw: RawLine<'_>, grammar: &mut G, room: &mut G::Room) {
        self.line += 1;
        self.line_end(raw.end);
        let text = raw.text;
        if text.trim_ascii().is_empty() && !raw.cut {
            self.blank.seen(self.line, 1);
            return;
        }
        self.unknown_last = false;
        if self.terminator.is_some() {
            self.after.seen(self.line, 1);
            return;
        }
        if raw.cut {
            let (longest, record) = (lines::LONGEST, grammar.format().longest_record());
            self.unreadable(grammar, text, DefectId::LongLine, longest, || {
                format!("the line is longer than {longest} characters; a record has at most {record}")
            });
            return;
        }
        grammar.line(self, text, room);
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

    fn conclude(mut self, format: Format, request: &whole::Request<'_>) -> Report {
        self.note_repeated();
        if self.terminator.is_none() && !self.unknown_last {
            let terminator = format.terminator();
            self.findings.note(DefectId::MissingTerminator, self.line, 1, || {
                format!("the file ends without {terminator}: it is cut off")
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
            entry_at: self.entry_at,
            format,
        };
        whole.judge(request, &mut self.content, &mut self.facts, &mut self.findings);
        self.report()
    }

    fn note_repeated(&mut self) {
        let findings = &mut self.findings;
        self.blank.note(findings, DefectId::BlankLine, "nothing but blanks");
        self.trailing_blanks.note(findings, DefectId::TrailingBlanks, "blanks after the record");
        self.after.note(findings, DefectId::AfterTerminator, "something after the terminator");
        if let (Some((line, end)), Some(first)) = (self.mixed, self.facts.line_end) {
            findings.note(DefectId::MixedLineEnds, line, 1, || {
                format!("this line ends with {}, those before with {}", end.name(), first.name())
            });
        }
        if self.last_end == Some(LineEnd::None) {
            findings.note(DefectId::NoLineEnd, self.line, 1, || "the last line has no line end".into());
        }
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
}

fn lines_in_words(lines: u64) -> String {
    if lines == 1 { "one line".into() } else { format!("{lines} lines") }
}
