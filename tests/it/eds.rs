//! The data sheets, read back by a reader nobody here wrote: python-canopen.

use std::io::Write;
use std::path::{Path, PathBuf};

use axcon::canopen::{DataType, Value};
use axcon::device::Product;
use axcon::device::dictionary::{Access, Bound};
use serde_json::Value as Json;

use crate::support::shell::{Running, World};

#[test]
fn a_data_sheet_goes_to_standard_output_or_to_a_file() {
    let world = World::new();
    let ran = world.run(&["eds", "AXTC4CO"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.starts_with("[FileInfo]\r\nFileName=AXTC4CO.eds\r\n"), "{}", ran.out);
    let written = world.run(&["eds", "axtc4co", "--out", "unit.eds"], b"");
    assert_eq!(written.code, Some(0), "{}", written.err);
    assert_eq!(std::fs::read_to_string(world.path("unit.eds")).expect("written"), ran.out);
    let again = world.run(&["eds", "axtc4co", "--out", "unit.eds"], b"");
    assert_eq!(again.code, Some(2), "{}", again.err);
    // Standard output by its names is standard output, even where it is a file.
    for name in ["-", "/dev/stdout"] {
        let named = world.run(&["eds", "axtc4co", "--out", name], b"");
        assert_eq!((named.code, &named.out), (Some(0), &ran.out), "{name}: {}", named.err);
    }
    let script = "echo before > all; \"$0\" eds axtc4co --out /dev/stdout >> all";
    let args = ["-c", script, env!("CARGO_BIN_EXE_axcon")];
    let appended = Running::start(world.command_of(Path::new("/bin/sh"), &args)).wait();
    assert_eq!(appended.code, Some(0), "{}", appended.err);
    let all = std::fs::read_to_string(world.path("all")).expect("written");
    assert_eq!(all, "before\n".to_owned() + &ran.out);
    let unknown = world.run(&["eds", "axtc5co"], b"");
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.err.contains("axtc4co") || unknown.err.contains("AXTC4CO"), "{}", unknown.err);
    let nowhere = world.run(&["eds", "axtc4co", "--out", "no/such/folder.eds"], b"");
    assert_eq!(nowhere.code, Some(1));
    assert!(nowhere.err.contains("cannot write 'no/such/folder.eds'"), "{}", nowhere.err);
}

#[test]
fn python_canopen_reads_the_dictionary_as_it_is() {
    let Some(python) = std::env::var_os("AXCON_TEST_PYTHON") else {
        // Straight to the stream: what the test harness captures of a test that passes is never seen.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no foreign reader; set AXCON_TEST_PYTHON to a Python with canopen, as .ci/run does"
        );
        return;
    };
    let world = World::new();
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/read_eds.py");
    for product in Product::all() {
        let written = world.run(&["eds", &product.name, "--yes", "--out", "unit.eds"], b"");
        assert_eq!(written.code, Some(0), "{}", written.err);
        let args = [client.display().to_string(), "unit.eds".into(), "127".into()];
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let ran = Running::start(world.command_of(&PathBuf::from(&python), &args)).wait();
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let read: Json = serde_json::from_str(&ran.out).expect("an object");
        assert_eq!(read["objects"], product.dictionary.objects().len(), "{}", product.name);
        let entries = read["entries"].as_array().expect("a list");
        assert_eq!(entries.len(), product.dictionary.entries().count(), "{}", product.name);
        for ((at, object, entry), read) in product.dictionary.entries().zip(entries) {
            let place = format!("{} {at} {}", product.name, object.name);
            assert_eq!((&read["index"], &read["sub"]), (&at.index.into(), &at.sub.into()), "{place}");
            assert_eq!(read["name"], entry.name, "{place}");
            assert_eq!(read["type"], entry.data_type.code(), "{place}");
            assert_eq!(read["access"], if entry.access == Access::ReadWrite { "rw" } else { "ro" }, "{place}");
            assert_eq!(read["mappable"], entry.mappable, "{place}");
            assert_eq!(read["unit"].as_str().unwrap_or(""), entry.unit.as_deref().unwrap_or(""), "{place}");
            let default = entry.default.map(|default| default.on_node(127));
            assert_number(&read["default"], default, &format!("{place}, default"));
            // This reader has no limits for REAL32.
            if entry.data_type == DataType::Real32 {
                assert!(read["low"].is_null() && read["high"].is_null(), "{place}: it has learnt to read them");
                continue;
            }
            let constant = |bound: Option<Bound>| match bound {
                Some(Bound::Value(value)) => Some(value),
                Some(Bound::Entry { .. }) | None => None,
            };
            let low = constant(entry.limits.low).filter(|_| entry.limits.values.is_empty());
            assert_number(&read["low"], low, &format!("{place}, low limit"));
            assert_number(&read["high"], constant(entry.limits.high), &format!("{place}, high limit"));
        }
    }
}

/// The reader's number is the value, or both are nothing.
fn assert_number(read: &Json, value: Option<Value>, place: &str) {
    match value {
        None => assert!(read.is_null(), "{place}: {read}"),
        Some(value) => {
            let number = read.as_f64().or(read.as_bool().map(f64::from)).unwrap_or_else(|| panic!("{place}: {read}"));
            assert!((number - value.as_f64()).abs() < 1e-6, "{place}: {number}, not {value}");
        }
    }
}
