//! Small files with everything that can happen to an image, and what each must give; then the same files, and others
//! made of them, through readers nobody here wrote.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use axcon::device::Product;
use axcon::image::{self, AddressUnit, DefectId, Format, Image, LineEnd, Report, Shape, Target};
use serde_json::Value as Json;

/// Largest file of the corpus: small enough to look at.
const LARGEST: u64 = 2048;

fn corpus(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/image_corpus").join(name)
}

fn files() -> BTreeSet<String> {
    let entries = fs::read_dir(corpus("files")).expect("the corpus");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

/// Rows of a table in the corpus' folder, their cells apart.
fn table(name: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(corpus(name)).expect("the table");
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(|line| line.split('\t').map(str::to_owned).collect()).collect()
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(corpus("files").join(name)).expect("a file")
}

fn report(bytes: &[u8], name: &str, allow: &[DefectId]) -> Report {
    let targets: Vec<Target> = Product::all().iter().map(Product::target).collect();
    image::check(bytes, Some(name), &targets, None, allow).expect("memory is readable")
}

#[test]
fn every_file_of_the_corpus_gives_what_the_table_says() {
    let expected: BTreeMap<String, (String, String)> = table("expected.tsv")
        .into_iter()
        .map(|row| match <[String; 3]>::try_from(row) {
            Ok([file, verdict, defects]) => (file, (verdict, defects)),
            Err(row) => panic!("not three cells: {row:?}"),
        })
        .collect();
    let files = files();
    assert!(files.len() >= 80, "{} files are too few", files.len());
    assert_eq!(expected.keys().cloned().collect::<BTreeSet<_>>(), files, "files and table are not the same");
    let mut wrong = Vec::new();
    for (file, expected) in &expected {
        let bytes = bytes(file);
        assert!((bytes.len() as u64) < LARGEST, "{file} has {} bytes", bytes.len());
        let report = report(&bytes, file, &[]);
        let defects: Vec<String> =
            report.defects.iter().map(|defect| format!("{}:{}:{}", defect.id, defect.line, defect.column)).collect();
        let defects = if defects.is_empty() { "-".to_owned() } else { defects.join(" ") };
        let verdict = if report.image().is_some() { "sound" } else { "refused" };
        if (verdict, defects.as_str()) != (expected.0.as_str(), expected.1.as_str()) {
            wrong.push(format!("{file}\t{verdict}\t{defects}\n  expected {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_corpus_holds_a_file_for_every_defect_a_small_file_can_have() {
    let found: BTreeSet<String> = table("expected.tsv")
        .iter()
        .flat_map(|row| {
            row[2].split(' ').filter_map(|defect| defect.split(':').next()).map(str::to_owned).collect::<Vec<_>>()
        })
        .collect();
    // One needs half a megabyte, one a product that is expected, one a unit.
    let missing: Vec<&str> = DefectId::ALL
        .into_iter()
        .filter(|id| !matches!(id, DefectId::TooLarge | DefectId::WrongProduct | DefectId::Downgrade))
        .map(DefectId::name)
        .filter(|name| !found.contains(*name))
        .collect();
    assert_eq!(missing, Vec::<&str>::new());
}

#[test]
fn every_sound_file_is_the_same_program_in_every_other_form() {
    let mut seen = 0;
    for file in files() {
        let Some(image) = report(&bytes(&file), &file, &[]).image() else { continue };
        let image = image.image();
        for format in [Format::SRecord, Format::IntelHex] {
            for address_unit in [AddressUnit::Word, AddressUnit::Byte] {
                let shape = Shape { format, address_unit, record_bytes: Some(14), line_end: LineEnd::Cr };
                let written = image::convert(image, &shape).unwrap_or_else(|error| panic!("{file}: {error}"));
                let again = report(&written, "x", &[DefectId::AddressUnit]);
                let again = again.image().unwrap_or_else(|| panic!("{file}: {:?}", again.defects));
                // A single record does not show what its address counts.
                if again.image().address_unit == address_unit {
                    assert!(image::diff(image, again.image()).is_none(), "{file} {shape:?}");
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 150, "{seen}");
}

/// Defects of lines and of their sequence, which any reader of these formats should refuse.
const OF_THE_FORMAT: [DefectId; 13] = [
    DefectId::EmptyFile,
    DefectId::NotSRecord,
    DefectId::LongLine,
    DefectId::NotARecord,
    DefectId::UnknownType,
    DefectId::BadCharacter,
    DefectId::ShortRecord,
    DefectId::BadLength,
    DefectId::BadChecksum,
    DefectId::TrailingCharacters,
    DefectId::WrongCount,
    DefectId::MissingTerminator,
    DefectId::AfterTerminator,
];

/// What a foreign reader made of a file: runs of bytes by address, or nothing.
type Understood = Option<BTreeMap<u64, Vec<u8>>>;

/// What the foreign readers that are there make of files; `None`, with a remark, if no Python is named.
fn foreign(files: &[PathBuf]) -> Option<Vec<BTreeMap<String, Understood>>> {
    let Some(python) = std::env::var_os("AXCON_TEST_PYTHON") else {
        // Straight to the stream: what the test harness captures of a test that passes is never seen.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no foreign readers; set AXCON_TEST_PYTHON to a Python with bincopy, as .ci/run does"
        );
        return None;
    };
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/read_images.py");
    let ran = Command::new(python).arg(client).args(files).output().expect("the client runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let said: Vec<BTreeMap<String, Json>> = serde_json::from_slice(&ran.stdout).expect("a list");
    assert_eq!(said.len(), files.len());
    for reader in ["bincopy", "srec_cat"].iter().filter(|reader| said.iter().all(|said| !said.contains_key(**reader))) {
        let _ = writeln!(std::io::stderr(), "skipped: {reader} is not there");
    }
    Some(
        said.into_iter().map(|said| said.into_iter().map(|(name, said)| (name, understood(&said))).collect()).collect(),
    )
}

fn understood(said: &Json) -> Understood {
    let runs = said.get("bytes")?.as_object()?;
    let byte = |hex: &str| u8::from_str_radix(hex, 16).expect("hexadecimal");
    let of_run = |(start, hex): (&String, &Json)| {
        let hex = hex.as_str().expect("a text");
        let data = (0..hex.len()).step_by(2).map(|at| byte(&hex[at..at + 2])).collect();
        (start.parse().expect("a number"), data)
    };
    Some(runs.iter().map(of_run).collect())
}

/// The runs of bytes of our own reading, at byte addresses.
fn memory(image: &Image) -> BTreeMap<u64, Vec<u8>> {
    let mut bytes = BTreeMap::new();
    for block in &image.blocks {
        let start = u64::from(block.address) * u64::from(image.address_unit.bytes());
        bytes.extend(block.data.iter().enumerate().map(|(at, &byte)| (start + at as u64, byte)));
    }
    let mut runs: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
    for (address, byte) in bytes {
        match runs.last_entry() {
            Some(mut last) if last.key() + last.get().len() as u64 == address => last.get_mut().push(byte),
            _ => drop(runs.insert(address, vec![byte])),
        }
    }
    runs
}

#[test]
fn foreign_readers_refuse_and_accept_the_same_files_but_for_known_ones() {
    let files = files();
    let paths: Vec<PathBuf> = files.iter().map(|file| corpus("files").join(file)).collect();
    let Some(opinions) = foreign(&paths) else { return };
    let known: BTreeSet<(String, String, String)> =
        table("foreign.tsv").into_iter().map(|row| (row[0].clone(), row[1].clone(), row[2].clone())).collect();
    let mut found = BTreeSet::new();
    for (file, opinions) in files.iter().zip(&opinions) {
        let report = report(&bytes(file), file, &[]);
        let readable = !report.defects.iter().any(|defect| OF_THE_FORMAT.contains(&defect.id));
        for (reader, understood) in opinions {
            if readable != understood.is_some() {
                let what = if readable { "refuses" } else { "accepts" };
                found.insert((reader.clone(), what.to_owned(), file.clone()));
            }
        }
    }
    let there: BTreeSet<&String> = opinions.iter().flat_map(BTreeMap::keys).collect();
    let known = known.into_iter().filter(|(reader, _, _)| there.contains(reader)).collect::<BTreeSet<_>>();
    let rows = |set: Vec<&(String, String, String)>| {
        set.iter().map(|(reader, what, file)| format!("{reader}\t{what}\t{file}")).collect::<Vec<_>>().join("\n")
    };
    assert!(
        found == known,
        "new:\n{}\ngone:\n{}",
        rows(found.difference(&known).collect()),
        rows(known.difference(&found).collect())
    );
}

#[test]
fn foreign_readers_find_the_same_bytes_once_addresses_count_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut paths = Vec::new();
    let mut images = Vec::new();
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images");
    let sound = ["AXTC4CO_V1.2.0.elf.S", "AXRTD8CO_V2.2.0.elf.S"]
        .map(|name| (name.to_owned(), fs::read(samples.join(name)).expect("a sample")));
    for (name, bytes) in files().into_iter().map(|file| (file.clone(), bytes(&file))).chain(sound) {
        let Some(image) = report(&bytes, &name, &[]).image() else { continue };
        for (format, extension) in [(Format::SRecord, "S"), (Format::IntelHex, "hex")] {
            let shape = Shape { format, address_unit: AddressUnit::Byte, record_bytes: None, line_end: LineEnd::CrLf };
            let path = folder.path().join(format!("{}.{extension}", paths.len()));
            fs::write(&path, image::convert(image.image(), &shape).expect("convertible")).expect("written");
            paths.push(path);
            images.push((name.clone(), format, image.clone()));
        }
    }
    let Some(opinions) = foreign(&paths) else { return };
    let mut compared = 0;
    for ((name, format, image), opinions) in images.iter().zip(&opinions) {
        for (reader, understood) in opinions {
            assert!(
                understood.as_ref() == Some(&memory(image.image())),
                "{reader} reads {name} as {format:?} in another way"
            );
            compared += 1;
        }
    }
    let _ = writeln!(std::io::stderr(), "{compared} readings by foreign readers agree");
}
