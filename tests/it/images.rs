//! The sample files, the documentation and the program agree; and `axcon image` as a user meets it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use axcon::image::{DefectId, Severity, make};

use crate::support::json::json;
use crate::support::shell::{Ran, World};

fn axcon(arguments: &[&str]) -> Ran {
    World::new().run(arguments, b"")
}

fn in_tree(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn in_tree_text(path: &str) -> String {
    in_tree(path).display().to_string()
}

/// The sound files.
const SOUND: [(&str, &str); 4] =
    [("AXTC4CO", "1.1.0"), ("AXTC4CO", "1.2.0"), ("AXRTD8CO", "2.1.1"), ("AXRTD8CO", "2.2.0")];

/// The bad and the odd files, by defect, with the line at which each is found.
const BAD: [(&str, u64); 41] = [
    ("empty-file", 1),
    ("not-s-record", 1),
    ("byte-order-mark", 1),
    ("long-line", 15),
    ("not-a-record", 15),
    ("unknown-type", 15),
    ("bad-character", 15),
    ("short-record", 15),
    ("bad-length", 15),
    ("bad-checksum", 15),
    ("trailing-characters", 15),
    ("trailing-blanks", 15),
    ("refused-type", 22),
    ("empty-record", 15),
    ("blank-line", 15),
    ("lower-case", 15),
    ("mixed-line-ends", 15),
    ("no-line-end", 22),
    ("missing-header", 1),
    ("data-before-header", 1),
    ("duplicate-header", 15),
    ("header-form", 1),
    ("missing-terminator", 21),
    ("after-terminator", 23),
    ("count-record", 22),
    ("wrong-count", 22),
    ("no-data", 2),
    ("odd-length", 21),
    ("address-wrap", 22),
    ("descending", 16),
    ("overlap", 16),
    ("address-unit", 3),
    ("out-of-range", 22),
    ("boot-flash", 22),
    ("data-memory", 22),
    ("gap", 15),
    ("entry-outside", 22),
    ("no-identity", 10),
    ("identity-malformed", 10),
    ("identity-crc", 10),
    ("unknown-product", 10),
];

/// Where the sample with a defect lies: a file with an error is bad, one with a warning is odd.
fn sample(id: DefectId) -> String {
    let folder = if id.severity() == Severity::Error { "bad" } else { "odd" };
    format!("{folder}/{id}.elf.S")
}

#[test]
fn the_program_makes_every_sample_file_again() {
    for (product, version) in SOUND {
        let made = axcon(&["image", "make", "--product", product, "--version", version, "--out", "-"]);
        let kept = fs::read(in_tree(&format!("firmware_images/{product}_V{version}.elf.S"))).expect("a sample");
        assert!(made.out.as_bytes() == kept, "{product} V{version} is not what the program makes: {}", made.err);
    }
    let mut kept: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for folder in ["bad", "odd"] {
        for entry in fs::read_dir(in_tree("firmware_images").join(folder)).expect("a folder of samples") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            kept.insert(format!("{folder}/{name}"), fs::read(&path).expect("a file"));
        }
    }
    let recipe = ["image", "make", "--product", "AXTC4CO", "--version", "1.2.0", "--words", "320", "--out", "-"];
    for flaw in make::flaws() {
        let made = axcon(&[&recipe[..], &["--defect", flaw.name()]].concat());
        assert!(made.code == Some(0), "{flaw}: {}", made.err);
        let name = sample(flaw);
        let kept = kept.remove(&name);
        assert!(kept.is_some_and(|kept| kept == made.out.as_bytes()), "{name} is not what the program makes");
    }
    assert_eq!(kept.into_keys().collect::<Vec<_>>(), Vec::<String>::new(), "files nothing makes");
}

#[test]
fn each_bad_file_shows_its_defect_in_its_line_and_no_other_error() {
    for (name, line) in BAD {
        let id: DefectId = name.parse().expect("a defect");
        let checked = axcon(&["image", "check", "--json", &in_tree_text(&format!("firmware_images/{}", sample(id)))]);
        let refused = id.severity() == Severity::Error;
        assert_eq!(checked.code, Some(if refused { 5 } else { 0 }), "{name}");
        let report = json(&checked.out);
        assert_eq!((&report["schema"], &report["ok"]), (&"axcon.image/1".into(), &(!refused).into()), "{name}");
        let defects = report["defects"].as_array().expect("a list");
        let own: Vec<_> = defects.iter().filter(|defect| defect["id"] == name).collect();
        assert_eq!(own.len(), 1, "{name}: {defects:?}");
        assert_eq!(own[0]["line"], line, "{name}");
        let others = defects.iter().filter(|defect| defect["id"] != name && defect["severity"] == "error");
        assert_eq!(others.count(), 0, "{name}: {defects:?}");
    }
    let named: Vec<&str> = BAD.iter().map(|(name, _)| *name).collect();
    assert_eq!(named, make::flaws().map(DefectId::name).collect::<Vec<_>>());
}

#[test]
fn the_documentation_lists_every_defect_with_its_severity() {
    let document = fs::read_to_string(in_tree("docs/images.md")).expect("the document");
    let section = document.split("## Defects").nth(1).expect("the section");
    let listed: Vec<(String, String)> = section
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| `")?.split('|').map(str::trim);
            Some((cells.next()?.trim_end_matches('`').to_owned(), cells.next()?.to_owned()))
        })
        .collect();
    let severity = |id: DefectId| match id {
        DefectId::NoIdentity => "warning (error with `--product`)".to_owned(),
        _ if id.severity() == Severity::Error && !id.can_be_allowed() => "error*".to_owned(),
        _ => id.severity().name().to_owned(),
    };
    let known: Vec<(String, String)> =
        DefectId::ALL.into_iter().map(|id| (id.name().to_owned(), severity(id))).collect();
    assert_eq!(listed, known);
}

#[test]
fn a_sound_image_is_told_in_words_and_as_data() {
    let file = in_tree_text("firmware_images/AXTC4CO_V1.2.0.elf.S");
    let checked = axcon(&["image", "check", "--product", "axtc4co", &file]);
    assert_eq!(checked.code, Some(0));
    assert_eq!(checked.out, format!("{file}: AXTC4CO V1.2.0, 3,074 records: may be sent, no defects\n"));

    let told = axcon(&["image", "info", &file]).out;
    let rows: Vec<&str> = told.lines().skip(1).collect();
    assert_eq!(
        rows,
        [
            "Format        S-record, 3,074 records, line ends CR LF",
            "Header        PROGRAM&DATA",
            "Product       AXTC4CO",
            "Version       1.2.0, built 2025-03-01 08:19:49",
            "Addresses     count words",
            "Program       0x0000 to 0xBFFF",
            "Entry point   0x00A0",
            "Data          98,304 bytes, 75 % of the AXTC4CO's flash",
            "To send       242,742 characters, 21.1 s at 115200 baud",
            "Defects       none",
        ]
    );

    let report = json(&axcon(&["image", "check", "--json", &file]).out);
    let expected = serde_json::json!({
        "schema": "axcon.image/1", "format": "srec", "ok": true, "product": "AXTC4CO", "version": "1.2.0",
        "records": 3074, "address_unit": "word", "ranges": [{"start": 0, "end": 49152}], "defects": [],
    });
    for (member, value) in expected.as_object().expect("an object") {
        assert_eq!(&report[member], value, "{member}");
    }
}

#[test]
fn an_image_without_a_name_is_sound_and_sent_only_by_whoever_answers_for_it() {
    let file = in_tree_text("firmware_images/odd/no-identity.elf.S");
    let checked = axcon(&["image", "check", &file]);
    let said = checked.out;
    assert_eq!(checked.code, Some(0), "{said}");
    assert!(said.ends_with(": may be sent with --allow no-identity, 1 warning\n"), "{said}");
    let refused = axcon(&["load", "--dry-run", &file]);
    assert_eq!(refused.code, Some(5));
    assert!(refused.err.contains("--allow no-identity"), "{}", refused.err);
    let allowed = axcon(&["load", "--dry-run", "--allow", "no-identity", &file]);
    assert_eq!(allowed.code, Some(0), "{}", allowed.err);
}

#[test]
fn an_image_is_checked_against_the_flash_of_its_product() {
    let file = in_tree_text("firmware_images/AXRTD8CO_V2.2.0.elf.S");
    let report = json(&axcon(&["image", "check", "--json", "--product", "axrtd8co", &file]).out);
    let expected = serde_json::json!({
        "ok": true, "product": "AXRTD8CO", "version": "2.2.0", "records": 5122, "address_unit": "word",
        "ranges": [{"start": 0, "end": 0x1_4000}], "defects": [],
    });
    for (member, value) in expected.as_object().expect("an object") {
        assert_eq!(&report[member], value, "{member}");
    }
    let told = axcon(&["image", "info", &file]).out;
    assert!(told.contains("163,840 bytes, 31 % of the AXRTD8CO's flash"), "{told}");

    // For the smaller unit it is the wrong product, and too large.
    let other = axcon(&["image", "check", "--json", "--product", "axtc4co", &file]);
    assert_eq!(other.code, Some(5));
    let report = json(&other.out);
    let defects: Vec<&str> =
        report["defects"].as_array().expect("a list").iter().filter_map(|defect| defect["id"].as_str()).collect();
    assert!(defects.contains(&"wrong-product"), "{defects:?}");

    // What becomes of data elsewhere depends on the loader.
    let folded = in_tree_text("firmware_images/bad/boot-flash.elf.S");
    let said = |options: &[&str]| axcon(&[&["image", "check", &folded], options].concat()).out;
    assert!(said(&[]).contains("folds that to 0x0000 over the program, silently"), "{}", said(&[]));
    let refused = said(&["--loader", "g3"]);
    assert!(refused.contains("the loader stops there, with the old program erased"), "{refused}");
    assert_eq!(axcon(&["image", "check", "--loader", "g9", &folded]).code, Some(2));

    // Behind the last of 512 KByte and the boot flash.
    let folder = tempfile::tempdir().expect("a folder");
    let beyond = folder.path().join("AXRTD8CO_V2.2.0.elf.S").display().to_string();
    let recipe = ["--words", "320", "--defect", "out-of-range", "--out", &beyond];
    let made = axcon(&[&["image", "make", "--product", "AXRTD8CO", "--version", "2.2.0"][..], &recipe].concat());
    assert_eq!(made.code, Some(0), "{}", made.err);
    let refused = axcon(&["image", "check", &beyond]);
    assert_eq!(refused.code, Some(5));
    let said = refused.out;
    assert!(said.contains("out-of-range") && said.contains("0x00044000: outside the AXRTD8CO"), "{said}");
}

#[test]
fn a_refused_image_is_one_line_for_each_defect_and_a_verdict() {
    let file = in_tree_text("firmware_images/bad/bad-checksum.elf.S");
    let refused = axcon(&["image", "check", &file]);
    assert_eq!(refused.code, Some(5));
    assert_eq!(
        refused.out,
        format!(
            "{file}:15:77: error bad-checksum: the record's bytes give checksum 9F, it says 90\n\
             {file}: AXTC4CO V1.2.0, 22 records: must not be sent, 1 error\n"
        )
    );
    let allowed = axcon(&["image", "check", "--allow", "bad-checksum", &file]);
    assert_eq!(allowed.code, Some(0));
    assert!(allowed.out.contains(":15:77: allowed bad-checksum: "), "{}", allowed.out);
    assert!(allowed.out.ends_with(": may be sent, 1 allowed error\n"), "{}", allowed.out);
    assert_eq!(axcon(&["image", "check", "--allow", "bad-character", &file]).code, Some(2));
    assert_eq!(axcon(&["image", "check", "--product", "NOSUCH", &file]).code, Some(2));
}

#[test]
fn a_file_that_cannot_be_read_is_refused_with_a_hint() {
    let folder = in_tree_text("firmware_images");
    let missing = in_tree_text("firmware_images/NOSUCH.elf.S");
    for (file, what) in [(folder, "is a directory"), (missing, "cannot read the image")] {
        for command in ["check", "info"] {
            let refused = axcon(&["image", command, &file, "--json"]);
            assert_eq!(refused.code, Some(5), "{file}");
            let error = json(&refused.err);
            assert_eq!(error["kind"], "image-refused");
            assert!(error["message"].as_str().is_some_and(|message| message.contains(what)), "{error}");
            assert!(error["hints"].as_array().is_some_and(|hints| !hints.is_empty()), "{error}");
        }
    }
}

#[test]
fn make_does_not_overwrite_unasked() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.elf.S").display().to_string();
    let make = ["image", "make", "--product", "AXTC4CO", "--version", "V1.0.0", "--words", "320", "--out", &file];
    assert_eq!(axcon(&make).code, Some(0));
    let refused = axcon(&make);
    assert_eq!(refused.code, Some(2));
    assert!(refused.err.contains("--yes"), "{}", refused.err);
    assert_eq!(axcon(&[&make[..], &["--yes"]].concat()).code, Some(0));
    assert_eq!(axcon(&["image", "make", "--product", "AXTC4CO", "--version", "1.0.0", "--words", "9"]).code, Some(2));
}
