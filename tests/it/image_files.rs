//! Images as files: compared, converted to another form and back, and loaded from Intel HEX.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value as Json;

use crate::support::shell::{Ran, World};

fn image(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images").join(name).display().to_string()
}

fn json(text: &str) -> Json {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn run(world: &World, args: &[&str]) -> Ran {
    world.run(&[&["image"][..], args].concat(), b"")
}

fn bytes(path: impl Into<PathBuf>) -> Vec<u8> {
    fs::read(path.into()).expect("a file")
}

const OLD: &str = "AXTC4CO_V1.1.0.elf.S";
const NEW: &str = "AXTC4CO_V1.2.0.elf.S";

#[test]
fn a_file_in_the_canonical_form_is_written_as_it_is() {
    let world = World::new();
    let done = run(&world, &["convert", &image(NEW), "--out", "x.S"]);
    assert_eq!(done.code, Some(0), "{}", done.err);
    assert_eq!(done.err, "x.S: AXTC4CO V1.2.0, 3,074 records, addresses count words, 245,816 bytes written\n");
    assert!(bytes(world.path("x.S")) == bytes(image(NEW)));
    for (end, text) in [("cr", "\r"), ("lf", "\n"), ("crlf", "\r\n")] {
        let out = run(&world, &["convert", &image(NEW), "--out", "-", "--line-end", end]).out;
        assert!(out.ends_with(&format!("S705000000A05A{text}")) && out.matches(text).count() == 3_074, "{end}");
    }
}

#[test]
fn through_intel_hex_through_bytes_and_other_records_the_program_stays_the_same() {
    let world = World::new();
    let steps: [(&str, &[&str], &str); 6] = [
        ("AXTC4CO_V1.2.0.hex", &[], "ihex"),
        ("bytes.hex", &["--address-unit", "byte"], "ihex"),
        ("bytes.S", &["--format", "srec", "--line-end", "lf"], "srec"),
        ("long.S", &["--record-bytes", "250"], "srec"),
        ("words.S", &["--address-unit", "word", "--record-bytes", "16"], "srec"),
        ("again.S", &["--record-bytes", "32"], "srec"),
    ];
    let mut from = image(NEW);
    for (to, options, format) in steps {
        // A file of byte addresses is refused for these units, which is not this test's matter.
        let options = [&["convert", &from, "--out", to, "--allow", "address-unit"], options].concat();
        let done = run(&world, &options);
        assert_eq!(done.code, Some(0), "{to}: {}", done.err);
        let info = json(&run(&world, &["info", "--json", to]).out);
        assert_eq!((&info["format"], &info["version"]), (&format.into(), &"1.2.0".into()), "{to}");
        let differing = run(&world, &["diff", "--json", &image(NEW), to]);
        assert_eq!(differing.code, Some(0), "{to}: {}", differing.out);
        from = to.to_owned();
    }
    let (text, of_last) = (bytes(image(NEW)), bytes(world.path("again.S")));
    let lines = |text: &[u8]| text.split(|&byte| byte == b'\n').skip(1).map(<[u8]>::to_vec).collect::<Vec<_>>();
    assert!(lines(&text) == lines(&of_last), "all but the header, which Intel HEX does not have");
    let checked = run(&world, &["check", "bytes.S"]);
    assert_eq!(checked.code, Some(5));
    assert!(checked.out.contains("error address-unit: addresses count bytes"), "{}", checked.out);
}

#[test]
fn an_image_with_errors_is_not_converted_and_leaves_no_file() {
    let world = World::new();
    let bad = image("bad/bad-checksum.elf.S");
    let refused = run(&world, &["convert", &bad, "--out", "x.S"]);
    assert_eq!(refused.code, Some(5));
    assert!(
        refused.err.contains(":15:77: error bad-checksum") && refused.err.contains("nothing is written"),
        "{}",
        refused.err
    );
    assert_eq!(world.files("."), Vec::<PathBuf>::new());
    assert_eq!(json(&run(&world, &["convert", "--json", &bad, "--out", "x.S"]).out)["ok"], false);

    let mended = run(&world, &["convert", &bad, "--out", "x.S", "--allow", "bad-checksum"]);
    assert_eq!(mended.code, Some(0), "{}", mended.err);
    assert_eq!(run(&world, &["check", "x.S"]).code, Some(0));
    let kept = run(&world, &["convert", &bad, "--out", "x.S", "--allow", "bad-checksum"]);
    assert_eq!(kept.code, Some(2));
    assert!(kept.err.contains("x.S exists already"), "{}", kept.err);
    assert_eq!(world.files(".").len(), 1, "no half file is left");
    for options in [["--record-bytes", "251"], ["--record-bytes", "0"], ["--record-bytes", "7"]] {
        let refused = run(&world, &[&["convert", &image(NEW), "--out", "y.S"], &options[..]].concat());
        assert_eq!(refused.code, Some(2), "{options:?}: {}", refused.err);
    }
    let unknown = world
        .run(&["image", "convert", "-", "--out", "y.S", "--address-unit", "word"], b":020000000102FB\n:00000001FF\n");
    assert_eq!(unknown.code, Some(5), "{}", unknown.err);
    assert!(unknown.err.contains("whether its addresses count words or bytes"), "{}", unknown.err);
}

#[test]
fn two_versions_are_compared_word_for_word() {
    let world = World::new();
    let differing = run(&world, &["diff", &image(OLD), &image(NEW)]);
    assert_eq!(differing.code, Some(1), "{}", differing.err);
    assert!(
        differing.out.starts_with(&format!("a  {}: AXTC4CO V1.1.0, 3,074 records, 49,152 words\nb  ", image(OLD))),
        "{}",
        differing.out
    );
    assert!(differing.out.contains("more ranges; --json lists them\n"), "{}", differing.out);
    let found = json(&run(&world, &["diff", "--json", &image(OLD), &image(NEW)]).out);
    assert_eq!(found["schema"], "axcon.image-diff/1");
    assert_eq!(
        (&found["equal"], &found["a"]["version"], &found["b"]["version"]),
        (&false.into(), &"1.1.0".into(), &"1.2.0".into())
    );
    let of_ranges: u64 =
        found["ranges"].as_array().expect("a list").iter().filter_map(|range| range["words"].as_u64()).sum();
    assert_eq!(found["words_changed"], of_ranges);
    assert!(of_ranges > 1000 && found["words_only_a"] == 0 && found["words_only_b"] == 0, "{found}");

    let same = run(&world, &["diff", &image(NEW), &image(NEW)]);
    assert_eq!(same.code, Some(0));
    assert!(same.out.ends_with("equal: every word and the entry point\n"), "{}", same.out);
}

#[test]
fn a_damaged_image_is_compared_as_long_as_its_data_is_known() {
    let world = World::new();
    let sound = ["make", "--product", "AXTC4CO", "--version", "1.2.0", "--words", "320", "--out", "sound.S"];
    assert_eq!(run(&world, &sound).code, Some(0));
    let one_bit = run(&world, &["diff", "sound.S", &image("bad/identity-crc.elf.S")]);
    assert_eq!(one_bit.code, Some(1));
    assert!(one_bit.out.contains("0x00D0 to 0x00D0  1 word changed\n"), "{}", one_bit.out);
    assert!(one_bit.err.contains("has 1 error; see 'axcon image check'"), "{}", one_bit.err);
    let gap = run(&world, &["diff", "sound.S", &image("odd/gap.elf.S")]);
    assert!(gap.out.contains("0x00D0 to 0x00DF  16 words only in a\n"), "{}", gap.out);
    let unknown = run(&world, &["diff", "sound.S", &image("bad/bad-character.elf.S")]);
    assert_eq!(unknown.code, Some(5));
    assert!(unknown.err.contains("cannot be compared"), "{}", unknown.err);
    let missing = run(&world, &["diff", "sound.S", "nosuch.S"]);
    assert_eq!(missing.code, Some(5));
}

#[test]
fn an_intel_hex_file_is_loaded_like_any_other() {
    let world = World::new();
    assert_eq!(run(&world, &["convert", &image(NEW), "--out", "x.hex"]).code, Some(0));
    let planned = world.run(&["load", "x.hex", "--dry-run"], b"");
    assert_eq!(planned.code, Some(0), "{}", planned.err);
    assert!(planned.out.contains("image  x.hex: AXTC4CO V1.2.0"), "{}", planned.out);
    let checked = run(&world, &["check", "x.hex", "--product", "axtc4co"]);
    assert_eq!(
        (checked.code, checked.out.as_str()),
        (Some(0), "x.hex: AXTC4CO V1.2.0, 3,074 records: may be sent, no defects\n")
    );

    assert_eq!(run(&world, &["convert", &image(NEW), "--out", "b.hex", "--address-unit", "byte"]).code, Some(0));
    let refused = world.run(&["load", "b.hex", "--dry-run"], b"");
    assert_eq!(refused.code, Some(5), "{}", refused.err);
    assert!(refused.out.contains("address-unit"), "{}", refused.out);
}
