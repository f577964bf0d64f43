//! Whole-file rules: reads an image once, of whatever size, and lists every defect in it.
//!
//! [`super::scan`] reads the lines, [`super::srecord_file`] and [`super::ihex_file`] know what they mean, and
//! [`super::whole`] judges what can only be said of the whole (addresses, identity), from the data that was kept. No
//! more data is kept than the largest flash holds.

use std::io::{self, Read};

use super::defect::DefectId;
use super::ihex_file::IntelHexFile;
use super::lines::Lines;
use super::nature::{Nature, recognise};
use super::report::Report;
use super::scan::{self, Scan};
use super::srecord_file::SRecordFile;
use super::{Target, whole};

/// Checks an image file, in S-records or Intel HEX.
///
/// `file_name` is compared with what is inside. `targets` are the products there are; the identity block says which of
/// them the image is for, and `expected` which it should be for. Errors whose names are in `allow` do not keep the
/// image from being sent, but are still listed.
///
/// # Errors
/// Only if the reader fails. A bad file gives a report.
pub fn check(
    reader: impl Read,
    file_name: Option<&str>,
    targets: &[Target],
    expected: Option<&str>,
    allow: &[DefectId],
) -> io::Result<Report> {
    check_lines(Lines::new(reader), &whole::Request { file_name, targets, expected }, allow)
}

fn check_lines<R: Read>(mut lines: Lines<R>, request: &whole::Request<'_>, allow: &[DefectId]) -> io::Result<Report> {
    let mut scan = Scan::new(allow);
    let nature = recognise(lines.head()?);
    match nature {
        Nature::SRecord { mark } | Nature::IntelHex { mark } if mark > 0 => {
            scan.findings.note(DefectId::ByteOrderMark, 1, 1, || "the file begins with a byte order mark".into());
            lines.skip(mark);
        }
        _ => {}
    }
    match nature {
        Nature::SRecord { .. } => scan::read(lines, SRecordFile::new(), scan, request),
        Nature::IntelHex { .. } => scan::read(lines, IntelHexFile::new(), scan, request),
        Nature::Empty => {
            scan.findings.note(DefectId::EmptyFile, 1, 1, || "the file holds nothing".into());
            Ok(scan.refuse(lines.bytes()))
        }
        Nature::Other(what) => {
            scan.findings
                .note(DefectId::NotSRecord, 1, 1, || format!("this is {what}, not a file of S-records or Intel HEX"));
            Ok(scan.refuse(lines.bytes()))
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::content::MOST_BYTES;
    use super::super::lines;
    use super::super::make::{self, FEWEST_WORDS, Recipe, make};
    use super::super::srecord::{Kind, Record};
    use super::super::{AddressRange, AddressUnit, CheckedImage, FlashMap, Format, Outside, Severity};
    use super::*;
    use crate::version::Version;

    fn target() -> Target {
        Target {
            product: "AXTEST".into(),
            flash: FlashMap { address_unit: AddressUnit::Word, program_words: 0x10000, page_words: 256 },
            file_name: "AXTEST_V{version}.elf.S".into(),
            boot: Some(AddressRange { start: 0x2_0000, end: 0x2_1000 }),
            outside: Outside::Folds,
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
        let table: [(String, &[Found]); 25] = [
            (format!("{HEAD}{one}{two}{end}"), &[("no-identity", 1, 1)]),
            (String::new(), &[("empty-file", 1, 1)]),
            ("\r\n \n".into(), &[("empty-file", 1, 1)]),
            ("hello\n".into(), &[("not-s-record", 1, 1)]),
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
            (format!("S3G7\n{HEAD}{one}{end}"), &[("bad-character", 1, 3), ("data-before-header", 1, 1)]),
            (
                format!("{HEAD}S30900000000112233444C\nS30700000001334480\nS30900000001112233444B\n{end}"),
                &[("no-identity", 1, 1), ("overlap", 3, 5), ("overlap", 4, 5)],
            ),
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
    fn an_overlap_names_the_line_that_reaches_as_far_first() {
        let file = "S30900000000112233444C\nS30700000001334480\nS30900000001112233444B\nS70500000000FA\n";
        let report = report(format!("{HEAD}{file}").as_bytes());
        let overlaps = report.defects.iter().filter(|defect| defect.id == DefectId::Overlap);
        let said: Vec<&str> = overlaps.map(|defect| defect.message.as_str()).collect();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said.iter().all(|said| said.ends_with("written by line 2 already")), "{said:?}");
    }

    #[test]
    fn one_record_does_not_show_what_addresses_count_so_they_count_what_the_units_do() {
        for (address_unit, end) in [(AddressUnit::Word, 2), (AddressUnit::Byte, 4)] {
            let mut target = target();
            target.flash.address_unit = address_unit;
            let file = format!("{HEAD}S3090000000011223344{:02X}\nS70500000000FA\n", !(9u8 + 0xAA));
            let report = check(file.as_bytes(), None, &[target], None, &[]).expect("a slice");
            assert_eq!(report.facts.address_unit, None);
            assert_eq!(report.facts.ranges, [AddressRange { start: 0, end }]);
        }
    }

    #[test]
    fn what_is_on_many_lines_is_said_once_with_their_number() {
        let (one, end) = ("S307000000001122C5\n", "S70500000000FA\n");
        for (blank, words) in [("\n", "in one line"), ("\n \n\n", "in 3 lines")] {
            let report = report(format!("{HEAD}{blank}{one}{end}").as_bytes());
            let blank = report.defects.iter().find(|defect| defect.id == DefectId::BlankLine).expect("it is there");
            assert_eq!(blank.message, format!("nothing but blanks, {words}"));
        }
    }

    #[test]
    fn one_of_a_kind_is_said_as_one() {
        let (one, end) = ("S307000000001122C5\n", "S70500000000FA\n");
        let said = |file: String, id| {
            let report = report(file.as_bytes());
            report.defects.into_iter().find(|defect| defect.id == id).map(|defect| defect.message)
        };
        let trailing =
            |rest: &str| said(format!("{HEAD}S307000000001122C5{rest}\n{end}"), DefectId::TrailingCharacters);
        assert_eq!(trailing("X").as_deref(), Some("1 character follows the checksum"));
        assert_eq!(trailing("XY").as_deref(), Some("2 characters follow the checksum"));
        let odd = said(format!("{HEAD}{one}S3060000000133C5\n{end}"), DefectId::OddLength);
        assert_eq!(odd.as_deref(), Some("1 data byte: the last word has no high byte"));
        let short = said(format!("{HEAD}{one}S3\n{end}"), DefectId::ShortRecord);
        assert_eq!(short.as_deref(), Some("the length says 1 byte, the line ends after 0"));
    }

    #[test]
    fn the_size_and_the_records_of_a_file_are_those_it_has() {
        let hex = ":040000001122334452\n:040002005566778840\n:0400000500000000F7\n:00000001FF\n";
        let records = format!("{HEAD}S307000000001122C5\nS70500000000FA\n");
        for (file, count) in [(hex, 4), (records.as_str(), 3), ("hello\n", 0), ("", 0)] {
            let report = report(file.as_bytes());
            assert_eq!((report.facts.size, report.facts.records), (file.len() as u64, count), "{file:?}");
        }
    }

    #[test]
    fn records_that_continue_outside_of_the_flash_are_one_complaint_with_all_addresses() {
        let record = |address, data: &[u8]| {
            String::from_utf8(Record { kind: Kind::Data32, address, data }.to_text()).expect("digits") + "\n"
        };
        let inside = record(0, &[1, 2]);
        let (outside, next) = (record(0x1_8000, &[1, 2]), record(0x1_8001, &[3, 4]));
        let report = report(format!("{HEAD}{inside}{outside}{next}S70500000000FA\n").as_bytes());
        let complaints: Vec<_> = report.defects.iter().filter(|defect| defect.id == DefectId::OutOfRange).collect();
        let [one] = complaints.as_slice() else { panic!("{:?}", found(&report)) };
        assert_eq!((one.line, one.column), (3, 5));
        assert!(one.message.contains("program flash (to 0xFFFF)"), "{}", one.message);
        assert!(one.message.starts_with("0x00018000 to 0x00018001: "), "{}", one.message);
    }

    #[test]
    fn a_file_whose_addresses_count_bytes_is_told_so() {
        let bytes = "S30900000000112233444C\nS309000000045566778838\n";
        let report = report(format!("{HEAD}{bytes}S70500000000FA\n").as_bytes());
        let unit = report.defects.iter().find(|defect| defect.id == DefectId::AddressUnit);
        let unit = unit.unwrap_or_else(|| panic!("{:?}", found(&report)));
        assert!(
            unit.message.contains("addresses count bytes") && unit.message.contains("count words"),
            "{}",
            unit.message
        );
    }

    #[test]
    fn an_unreadable_data_record_is_one_of_those_a_count_counts() {
        let (one, end) = ("S307000000001122C5\n", "S70500000000FA\n");
        let spoiled = one.replace("1122", "11x2");
        let report = report(format!("{HEAD}{one}{spoiled}{spoiled}S5030003F9\n{end}").as_bytes());
        assert!(report.defects.iter().all(|defect| defect.id != DefectId::WrongCount), "{:?}", found(&report));
    }

    #[test]
    fn what_follows_from_a_line_that_cannot_be_read_is_not_reported_as_well() {
        let (one, count, end) = ("S307000000001122C5\n", "S5030002FA\n", "S70500000000FA\n");
        let hex = ":040000001122334452\n:040002005566778840\n:0400000500000000F7\n";
        let joined = format!("{HEAD}{}{end}", one.repeat(80)).replace('\n', "");
        let table: [(String, Found); 12] = [
            (format!(" {HEAD}{one}{end}"), ("not-a-record", 1, 1)),
            (format!("\x0C{HEAD}{one}{end}"), ("not-a-record", 1, 1)),
            (format!("SO{}{one}{end}", &HEAD[2..]), ("unknown-type", 1, 2)),
            (format!("{HEAD}{one}S{end}"), ("unknown-type", 3, 2)),
            (format!("{HEAD}{one} {end}"), ("not-a-record", 3, 1)),
            (format!("{HEAD}{one}X{}\n \n", end[1..].trim()), ("not-a-record", 3, 1)),
            (format!("{HEAD}{one}S"), ("short-record", 3, 3)),
            (format!("{joined}\n"), ("long-line", 1, 1024)),
            (format!("{HEAD}{one} {one}{count}{end}"), ("not-a-record", 3, 1)),
            (format!("{hex} :00000001FF\n"), ("not-a-record", 4, 1)),
            (format!("{hex}:0000\n"), ("short-record", 4, 2)),
            (format!("{hex};00000001FF\n"), ("not-a-record", 4, 1)),
        ];
        for (file, expected) in table {
            let report = report(file.as_bytes());
            let errors = report.defects.iter().filter(|defect| defect.severity == Severity::Error);
            let errors: Vec<Found> = errors.map(|defect| (defect.id.name(), defect.line, defect.column)).collect();
            assert_eq!(errors, [expected], "{file:?}");
        }
        // What a line is that begins well is known, so that the rest of the file is judged.
        let cut = report(format!("{HEAD}{one}S3070000").as_bytes());
        assert!(found(&cut).contains(&("missing-terminator", 3, 1)), "{:?}", found(&cut));
        let none = report(format!("{one}X{one}").as_bytes());
        assert!(found(&none).contains(&("missing-header", 1, 1)), "{:?}", found(&none));
    }

    #[test]
    fn small_intel_hex_files_and_all_that_is_wrong_with_them() {
        let one = ":040000001122334452\n:040002005566778840\n";
        let (start, end) = (":0400000500000000F7\n", ":00000001FF\n");
        let sound: Found = ("no-identity", 1, 1);
        let table: [(String, &[Found]); 27] = [
            (format!("{one}{start}{end}"), &[sound]),
            (format!("\u{FEFF}{one}{start}{end}"), &[sound, ("byte-order-mark", 1, 1)]),
            (format!("{one}{end}"), &[sound, ("missing-entry", 3, 1)]),
            (format!("{start}{end}"), &[("no-data", 2, 1)]),
            (format!("{one}{start}"), &[sound, ("missing-terminator", 3, 1)]),
            (format!("{one}{start}{end}{end}"), &[sound, ("after-terminator", 5, 1)]),
            (format!("{one}{start}{end}{one}"), &[sound, ("after-terminator", 5, 1)]),
            (format!("{one}{start}:00000101FE\n"), &[sound, ("offset-ignored", 4, 4)]),
            (format!("{one}{start}{start}{end}"), &[sound, ("duplicate-entry", 4, 10)]),
            (format!("{one}:0400000300000000F9\n{end}"), &[sound]),
            (format!("{one}:0400000300010000F8\n{end}"), &[sound, ("entry-outside", 3, 10)]),
            (format!("{one}:0400000300000001F8\n{end}"), &[sound]),
            (
                format!(":040002005566778840\n{end}"),
                &[sound, ("gap", 1, 4), ("missing-entry", 2, 1), ("entry-outside", 2, 1)],
            ),
            (format!("{one}:04FFFE001122334455\n{start}{end}"), &[sound, ("gap", 3, 4)]),
            (
                format!("{one}:00000000000\n{start}{end}"),
                &[sound, ("empty-record", 3, 2), ("trailing-characters", 3, 12)],
            ),
            (format!("{one}:0000000001\n{start}{end}"), &[sound, ("empty-record", 3, 2), ("bad-checksum", 3, 10)]),
            (format!("{one}:0000000000  \n{start}{end}"), &[sound, ("empty-record", 3, 2), ("trailing-blanks", 3, 12)]),
            (format!("{one}:00000006FA\n{start}{end}"), &[("unknown-type", 3, 8)]),
            (format!("{one}:0100000400FB\n{start}{end}"), &[("bad-length", 3, 2)]),
            (format!("{one}:040000\n{start}{end}"), &[("short-record", 3, 2)]),
            (format!("{one}:04000O\n{start}{end}"), &[("bad-character", 3, 7)]),
            (format!("{one}S9030000FC\n{start}{end}"), &[("not-a-record", 3, 1)]),
            (format!("{one}{one}{start}{end}"), &[sound, ("descending", 3, 4), ("overlap", 3, 4), ("overlap", 4, 4)]),
            (
                // The base of the data after it is not known, so nothing is said about its place.
                format!("{one}:02000004000GF9\n{one}{start}{end}"),
                &[("bad-character", 3, 13)],
            ),
            (
                format!("{one}:04FFFF001122334454\n{start}{end}"),
                &[sound, ("segment-wrap", 3, 4), ("gap", 3, 4), ("out-of-range", 3, 4)],
            ),
            (format!("{one}:02000004FFFFFC\n:04FFFF001122334454\n{start}{end}"), &[sound, ("address-wrap", 4, 4)]),
            (format!("{one}:0104000011EA\n{start}{end}"), &[sound, ("odd-length", 3, 2), ("gap", 3, 4)]),
        ];
        for (file, expected) in table {
            let report = report(file.as_bytes());
            assert_eq!(report.facts.format, Some(Format::IntelHex), "{file:?}");
            let (mut found, mut expected) = (found(&report), expected.to_vec());
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
    fn what_the_loader_would_do_with_data_elsewhere_is_said_before_it_is_sent() {
        let said = |outside, address: u32| {
            let mut file = HEAD.as_bytes().to_vec();
            for address in [0, address] {
                Record { kind: Kind::Data32, address, data: &[0x11, 0x22] }.write(&mut file);
                file.push(b'\n');
            }
            file.extend(b"S70500000000FA\n");
            let target = Target { outside, ..target() };
            let report = check(&file[..], Some("AXTEST_V1.0.0.elf.S"), &[target], None, &[]);
            let report = report.unwrap_or_else(|error| panic!("{error}"));
            let found = report.defects.iter().find(|defect| defect.line == 3);
            found.map(|defect| (defect.id.name(), defect.message.clone())).unwrap_or_default()
        };
        let table = [
            (Outside::Folds, 0x1_0005, "out-of-range", "the loader folds that to 0x0005 over the program, silently"),
            (Outside::Folds, 0x50_0000, "out-of-range", "the loader skips that, silently"),
            (Outside::Folds, 0x20_0000, "data-memory", "0x00200000: marked as data memory"),
            (Outside::Folds, 0x200_0000, "data-memory", "0x02000000: marked as data memory"),
            (Outside::Folds, 0x2_0FFF, "boot-flash", "the loader folds that to 0x0FFF over the program, silently"),
            (Outside::Folds, 0x2_1000, "out-of-range", "the loader folds that to 0x1000 over the program, silently"),
            (Outside::Refuses, 0x1_0005, "out-of-range", "the loader stops there, with the old program erased"),
            (Outside::Refuses, 0x2_0000, "boot-flash", "the loader stops there, with the old program erased"),
            (Outside::Refuses, 0x20_0000, "out-of-range", "the loader stops there, with the old program erased"),
            (Outside::Unknown, 0x1_0005, "out-of-range", "a loader skips that or folds it to 0x0005, silently"),
        ];
        for (outside, address, id, what) in table {
            let (found, message) = said(outside, address);
            assert!(found == id && message.contains(what), "{outside:?} {address:#x}: {found}: {message}");
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
        assert_eq!(report.errors, 50_000, "every line, the last of which may have been the terminator");
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
        assert!(report.content.kept() <= MOST_BYTES);
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
            let pieces = check_lines(lines, &whole::Request { file_name: None, targets: &[target()], expected: None }, &[]);
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
