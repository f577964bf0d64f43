//! Rules about an image as a whole: where its data lies, whether it fits the unit, and what it says it is.

use super::content::{Content, MOST_BYTES, Piece, Steps};
use super::defect::{DefectId, Findings, Severity};
use super::identity::{self, Identity, IdentityError};
use super::report::{AddressRange, Facts, Format};
use super::{AddressUnit, Destination, Outside, Target, is_marked_as_data};
use crate::count::counted;

/// What the caller knows and wants.
pub(super) struct Request<'a> {
    pub file_name: Option<&'a str>,
    pub targets: &'a [Target],
    pub expected: Option<&'a str>,
}

/// What reading the file has shown, besides the data.
pub(super) struct Whole<'a> {
    pub steps: &'a Steps,
    /// Whether all data was read and kept; if not, what is missing is already an error.
    pub complete: bool,
    /// Line and column of the entry point.
    pub entry_at: Option<(u64, usize)>,
    pub format: Format,
}

impl Whole<'_> {
    /// Notes the defects of the image as a whole, and fills in the facts.
    pub(super) fn judge(
        &self,
        request: &Request<'_>,
        content: &mut Content,
        facts: &mut Facts,
        findings: &mut Findings,
    ) {
        let seen = self.steps.unit();
        facts.address_unit = seen.map(|(unit, _)| unit);
        content.unit = facts.address_unit.unwrap_or(AddressUnit::Word);
        let identity = self.identity(request, content, findings);
        let target = target(request, identity.as_ref());
        if facts.address_unit.is_none() {
            content.unit = target.flash.map_or(AddressUnit::Word, |flash| flash.address_unit);
        }
        facts.identity = identity;
        facts.judged_for = target.product.clone();
        facts.flash_bytes = target.flash.map(|flash| u64::from(flash.program_words) * 2);

        let by_address = by_address(content);
        facts.ranges = ranges(content, &by_address);
        let column = self.format.address_column();
        odd_lengths(content, self.format.length_column(), findings);
        wraps(content, column, findings);
        overlaps(content, &by_address, column, findings);
        data_memory(content, &target, column, findings);
        let Some(flash) = target.flash else { return };
        if let Some((unit, line)) = seen.filter(|(unit, _)| *unit != flash.address_unit) {
            findings.note(DefectId::AddressUnit, line, column, || wrong_unit(unit, &target));
            // Every address means something other than it says, so more defects of addresses would only mislead.
            return;
        }
        elsewhere(content, &target, flash.end(), column, findings);
        if self.complete {
            gaps(content, &by_address, flash.end(), column, findings);
        }
        self.entry(content, facts, findings);
    }

    /// Reads the identity block and compares it with what is expected.
    fn identity(&self, request: &Request<'_>, content: &Content, findings: &mut Findings) -> Option<Identity> {
        let program = program(content);
        let line = line_of(content, identity::WORD_ADDRESS * 2 / content.unit.bytes());
        let identity = Identity::read(&program);
        if self.complete {
            match Identity::verify(&program) {
                Ok(_) => {}
                Err(IdentityError::Absent) => {
                    let severity = if request.expected.is_some() { Severity::Error } else { Severity::Warning };
                    findings.note_as(severity, DefectId::NoIdentity, line.unwrap_or(1), 1, || {
                        "the program does not say which product and version it is".into()
                    });
                }
                Err(error @ IdentityError::Malformed(_)) => {
                    findings.note(DefectId::IdentityMalformed, line.unwrap_or(1), 1, || error.to_string());
                }
                Err(error @ IdentityError::Crc { .. }) => {
                    findings.note(DefectId::IdentityCrc, line.unwrap_or(1), 1, || error.to_string());
                }
            }
        }
        let identity = identity.ok()?;
        let known = named(request.targets, &identity.product);
        let line = line.unwrap_or(1);
        if known.is_none() {
            findings
                .note(DefectId::UnknownProduct, line, 1, || format!("'{}' is not a known product", identity.product));
        }
        if let Some(expected) = request.expected.filter(|expected| !identity.is_for(expected)) {
            findings.note(DefectId::WrongProduct, line, 1, || {
                format!("the image is for {}, not for {expected}", identity.product)
            });
        }
        if let Some((product, version)) = claim(request)
            && (!identity.is_for(product) || version != identity.version)
        {
            findings.note(DefectId::FileName, line, 1, || {
                format!(
                    "the file's name says {product} V{version}, its content {} V{}",
                    identity.product, identity.version
                )
            });
        }
        Some(identity)
    }

    fn entry(&self, content: &Content, facts: &Facts, findings: &mut Findings) {
        let (Some((line, column)), true) = (self.entry_at, self.complete) else { return };
        let entry = facts.entry.unwrap_or_default();
        if line_of(content, entry).is_none() {
            findings.note(DefectId::EntryOutside, line, column, || {
                format!("no record writes the entry point 0x{entry:08X}: the program could not start")
            });
        }
    }
}

/// What the image is judged for.
pub(super) struct Judged {
    product: Option<String>,
    flash: Option<super::FlashMap>,
    boot: Option<AddressRange>,
    outside: Outside,
}

/// The product the image names, else the one expected, else the one its file name claims. If none is known, the image
/// is judged for the largest flash: what does not fit there fits nowhere.
fn target(request: &Request<'_>, identity: Option<&Identity>) -> Judged {
    let claimed = claim(request).map(|(product, _)| product);
    let names = [identity.map(|identity| identity.product.as_str()), request.expected, claimed];
    match names.into_iter().flatten().find_map(|name| named(request.targets, name)) {
        Some(target) => Judged::of(target),
        None => {
            let largest = request.targets.iter().max_by_key(|target| target.flash.program_words);
            let flash = largest.map(|target| target.flash);
            Judged { product: None, flash, boot: None, outside: Outside::Unknown }
        }
    }
}

fn named<'a>(targets: &'a [Target], product: &str) -> Option<&'a Target> {
    targets.iter().find(|target| target.product.eq_ignore_ascii_case(product))
}

/// Product and version the file's name claims.
fn claim<'a>(request: &Request<'a>) -> Option<(&'a str, crate::version::Version)> {
    let name = request.file_name?.rsplit(['/', '\\']).next()?;
    request.targets.iter().find_map(|target| Some((target.product.as_str(), target.version_in_name(name)?)))
}

/// The program's bytes from address 0 to the last that is written, FFh where nothing is.
fn program(content: &Content) -> Vec<u8> {
    let mut program = Vec::new();
    for piece in &content.pieces {
        let data = content.data(piece);
        let start = u64::from(piece.address) * u64::from(content.unit.bytes());
        if start + data.len() as u64 > MOST_BYTES as u64 {
            continue;
        }
        let (start, end) = (start as usize, start as usize + data.len());
        if program.len() < end {
            program.resize(end, 0xFF);
        }
        if let Some(place) = program.get_mut(start..end) {
            place.copy_from_slice(data);
        }
    }
    program.resize(program.len().next_multiple_of(content.unit.bytes() as usize), 0xFF);
    program
}

/// The addresses a piece takes.
fn span(content: &Content, piece: &Piece) -> AddressRange {
    let start = u64::from(piece.address);
    AddressRange { start, end: start + content.unit.addresses(piece.length()) }
}

/// The line that writes an address.
fn line_of(content: &Content, address: u32) -> Option<u64> {
    let address = u64::from(address);
    let holds = |piece: &&Piece| (span(content, piece).start..span(content, piece).end).contains(&address);
    content.pieces.iter().find(holds).map(|piece| piece.line)
}

/// Pieces in the order of their addresses; those with the same address as in the file.
fn by_address(content: &Content) -> Vec<Piece> {
    let mut pieces = content.pieces.clone();
    if !pieces.is_sorted_by_key(|piece| piece.address) {
        pieces.sort_by_key(|piece| piece.address);
    }
    pieces
}

fn ranges(content: &Content, by_address: &[Piece]) -> Vec<AddressRange> {
    let mut ranges: Vec<AddressRange> = Vec::new();
    for piece in by_address {
        let span = span(content, piece);
        match ranges.last_mut() {
            Some(last) if span.start <= last.end => last.end = last.end.max(span.end),
            _ => ranges.push(span),
        }
    }
    ranges
}

fn odd_lengths(content: &Content, column: usize, findings: &mut Findings) {
    if content.unit == AddressUnit::Byte {
        return;
    }
    for piece in content.pieces.iter().filter(|piece| piece.length() % 2 == 1) {
        findings.note(DefectId::OddLength, piece.line, column, || {
            format!("{}: the last word has no high byte", counted(piece.length(), "data byte"))
        });
    }
}

fn wraps(content: &Content, column: usize, findings: &mut Findings) {
    for piece in content.pieces.iter().filter(|piece| span(content, piece).end > ADDRESSES) {
        findings.note(DefectId::AddressWrap, piece.line, column, || {
            format!("{} bytes from 0x{:08X} on run past the last address", piece.length(), piece.address)
        });
    }
}

fn overlaps(content: &Content, by_address: &[Piece], column: usize, findings: &mut Findings) {
    let mut furthest: Option<&Piece> = None;
    for piece in by_address {
        let this = span(content, piece);
        if let Some(before) = furthest {
            let end = span(content, before).end;
            if this.start < end {
                let (line, other) = (piece.line.max(before.line), piece.line.min(before.line));
                findings.note(DefectId::Overlap, line, column, || {
                    format!("{}: written by line {other} already", shown(this.start, this.end.min(end)))
                });
            }
            if this.end <= end {
                continue;
            }
        }
        furthest = Some(piece);
    }
}

impl Judged {
    /// A product's own flash and loader.
    pub(super) fn of(target: &Target) -> Self {
        Judged {
            product: Some(target.product.clone()),
            flash: Some(target.flash),
            boot: target.boot,
            outside: target.outside,
        }
    }

    /// Whether the address is marked as data memory: by the linker or, unless the loader refuses such data, by its
    /// upper half.
    pub(super) fn is_data_memory(&self, address: u32) -> bool {
        match self.outside {
            Outside::Folds | Outside::Unknown => Destination::of(address.into()) == Destination::Data,
            Outside::Refuses => is_marked_as_data(address.into()),
        }
    }

    /// What becomes of data outside of the program flash, from this address on.
    pub(super) fn fate(&self, start: u64, flash_end: u64) -> String {
        let folded = address(start % flash_end);
        match self.outside {
            Outside::Folds => match Destination::of(start) {
                Destination::Program => format!("the loader folds that to {folded} over the program, silently"),
                Destination::Data | Destination::Skipped => "the loader skips that, silently".into(),
            },
            Outside::Refuses => "the loader stops there, with the old program erased".into(),
            Outside::Unknown => format!("a loader skips that or folds it to {folded}, silently"),
        }
    }
}

fn data_memory(content: &Content, target: &Judged, column: usize, findings: &mut Findings) {
    let flagged = content
        .pieces
        .iter()
        .copied()
        .filter(|piece| span(content, piece).end <= ADDRESSES && target.is_data_memory(piece.address));
    runs(content, flagged, |line, run| {
        findings.note(DefectId::DataMemory, line, column, || {
            format!(
                "{}: marked as data memory; loaders that do not know the mark write into the program",
                shown(run.start, run.end)
            )
        });
    });
}

/// Notes what is outside the program flash, separately for the boot flash and for all else.
fn elsewhere(content: &Content, target: &Judged, flash_end: u64, column: usize, findings: &mut Findings) {
    let whose = target.product.as_ref().map_or("any unit's".to_owned(), |product| format!("the {product}'s"));
    let in_boot = |span: &AddressRange| target.boot.is_some_and(|boot| span.start < boot.end && boot.start < span.end);
    let outside = |piece: &Piece| {
        let span = span(content, piece);
        span.end > flash_end && span.end <= ADDRESSES && !target.is_data_memory(piece.address)
    };
    let pieces = || content.pieces.iter().copied().filter(outside);
    runs(content, pieces().filter(|piece| in_boot(&span(content, piece))), |line, run| {
        findings.note(DefectId::BootFlash, line, column, || {
            let fate = target.fate(run.start, flash_end);
            format!("{}: {whose} boot flash, where the loader lives; {fate}", shown(run.start, run.end))
        });
    });
    runs(content, pieces().filter(|piece| !in_boot(&span(content, piece))), |line, run| {
        findings.note(DefectId::OutOfRange, line, column, || {
            let start = run.start.max(flash_end);
            let fate = target.fate(start, flash_end);
            let last = address(flash_end - 1);
            format!("{}: outside {whose} program flash (to {last}); {fate}", shown(start, run.end))
        });
    });
}

/// Joins pieces that continue one another in the file and calls `each` with the first line and all addresses.
fn runs(content: &Content, pieces: impl Iterator<Item = Piece>, mut each: impl FnMut(u64, AddressRange)) {
    let mut run: Option<(u64, AddressRange)> = None;
    for piece in pieces {
        let span = span(content, &piece);
        match &mut run {
            Some((_, range)) if range.end == span.start => range.end = span.end,
            _ => {
                if let Some((line, range)) = run.replace((piece.line, span)) {
                    each(line, range);
                }
            }
        }
    }
    if let Some((line, range)) = run {
        each(line, range);
    }
}

fn gaps(content: &Content, by_address: &[Piece], flash_end: u64, column: usize, findings: &mut Findings) {
    let mut next = 0;
    for piece in by_address {
        let span = span(content, piece);
        if span.start >= flash_end {
            break;
        }
        if span.start > next {
            findings.note(DefectId::Gap, piece.line, column, || {
                format!("no record writes {}; what an older program left there may stay", shown(next, span.start))
            });
        }
        next = next.max(span.end);
    }
}

fn wrong_unit(unit: AddressUnit, target: &Judged) -> String {
    let whose = target.product.as_deref().unwrap_or("unit");
    let (seen, wanted) = match unit {
        AddressUnit::Byte => ("bytes", "words"),
        AddressUnit::Word => ("words", "bytes"),
    };
    format!("addresses count {seen}, the {whose}'s count {wanted}; did a general tool convert the file?")
}

fn shown(start: u64, end: u64) -> String {
    if end == start + 1 { address(start) } else { format!("{} to {}", address(start), address(end - 1)) }
}

/// An address as text, short where it is small.
fn address(address: u64) -> String {
    if address < 0x1_0000 { format!("0x{address:04X}") } else { format!("0x{address:08X}") }
}

/// Number of addresses a record can name.
const ADDRESSES: u64 = 1 << 32;
