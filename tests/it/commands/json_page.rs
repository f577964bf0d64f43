//! What the commands write with `--json`, held to the page that describes it.

use std::collections::{BTreeMap, BTreeSet};

use super::*;

/// What may stand in a member, by the path of its names.
type Shape = BTreeMap<String, BTreeSet<String>>;

/// Members that are not always there. What ports a machine has is its own affair: `src/cli/ports.rs` tries made ones.
const SOMETIMES: [(&str, &str); 2] = [("axcon.error/1", "port"), ("axcon.ports/1", "ports[]")];

/// What the page allows, and none of the objects below has: it takes a unit that does not say who it is, a loader that
/// surprises, or a number on a page of diagnostics that can be read in two ways.
const RARELY: [(&str, &str, &str); 7] = [
    ("axcon.defaults/1", "node_id", "null"),
    ("axcon.defaults/1", "product", "null"),
    ("axcon.defaults/1", "version", "null"),
    ("axcon.diagnostics/1", "values[].value", "null"),
    ("axcon.dictionary/1", "product", "null"),
    ("axcon.dictionary/1", "version", "null"),
    ("axcon.load/1", "remark", "string"),
];

/// The kinds of object that the page describes.
fn page() -> BTreeMap<String, Shape> {
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/json.md")).expect("the page");
    let mut kinds: BTreeMap<String, Shape> = BTreeMap::new();
    let mut kind = String::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("## ") {
            kind = name.to_owned();
            kinds.insert(kind.clone(), Shape::from([("schema".into(), BTreeSet::from(["string".into()]))]));
        }
        let Some((member, rest)) = line.strip_prefix("| `").and_then(|line| line.split_once("` | ")) else { continue };
        let types = rest.split(" |").next().unwrap_or_default().split(" or ").map(str::to_owned).collect();
        let described = kinds.get_mut(&kind).expect("a heading stands before it").insert(member.to_owned(), types);
        assert!(described.is_none(), "{kind} has {member} twice");
    }
    kinds
}

/// Notes the members of a value, with their types, by their paths.
fn note(path: &str, value: &Value, found: &mut Shape) {
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(elements) => {
            let path = format!("{path}[]");
            found.entry(path.clone()).or_default();
            return elements.iter().for_each(|element| note(&path, element, found));
        }
        Value::Object(_) => "object",
    };
    if !path.is_empty() {
        found.entry(path.to_owned()).or_default().insert(kind.to_owned());
    }
    let Value::Object(members) = value else { return };
    for (name, member) in members {
        // Who has a port is told in its own line of the page.
        if path == "ports[].busy_by" {
            continue;
        }
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        note(&path, member, found);
    }
}

/// Objects of all kinds, from commands that are run for that.
fn written() -> Vec<Value> {
    let mut bench = Bench::with_image("1500");
    let mut all = Vec::new();
    let mut take = |ran: Ran| {
        all.extend(ran.out.lines().filter(|line| line.starts_with('{')).map(json));
        all.extend(ran.err.lines().filter(|line| line.starts_with('{')).map(json));
    };
    let (new, bad) = ("new.S", concat!(env!("CARGO_MANIFEST_DIR"), "/firmware_images/bad/bad-checksum.elf.S"));
    let nameless = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware_images/odd/no-identity.elf.S");
    let empty = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware_images/bad/empty-file.elf.S");
    let make = ["image", "make", "--product", "axtc4co", "--version", "1.3.0", "--words", "1600", "--json"];
    take(bench.world.run(&[&make[..], &["--out", "newer.S"]].concat(), b""));
    take(bench.world.run(&["image", "info", new, "--json"], b""));
    take(bench.world.run(&["image", "info", empty, "--json"], b""));
    take(bench.world.run(&["image", "check", bad, "--json", "--allow", "bad-checksum"], b""));
    take(bench.world.run(&["image", "diff", new, "newer.S", "--json"], b""));
    take(bench.world.run(&["image", "diff", nameless, nameless, "--json"], b""));
    take(bench.world.run(&["load", nameless, "--allow", "no-identity", "--dry-run", "--json"], b""));
    let head = r#"{"version":2,"width":80,"height":24}"#;
    let loader = r#"[0.1,"o","Waiting for application S-Record.\r\n"]"#;
    fs::write(bench.world.path("loader.cast"), format!("{head}\n{loader}\n")).expect("written");
    let report = ["report", "--out", "loader.html", "--yes", "--port", "replay:loader.cast", "--json"];
    take(bench.world.run(&report, b""));
    take(bench.world.run(&["ports", "--json"], b""));
    take(bench.world.run(&["identify", "--json", "--port", "nowhere"], b""));
    let mut unit = bench.world.start(&["emulate", "axtc4co", "--link", "u9", "--json"]);
    unit.wait_out("axcon.emulate/1");
    unit.input(b"open 1\n");
    unit.wait_out("axcon.emulate-answer/1");
    unit.input(b"nonsense\nquit\n");
    take(unit.wait());
    take(bench.run(&["identify", "--deep", "--yes", "--json"]));
    // It has started. Now a channel has no value.
    let unit = bench.unit.as_mut().expect("it runs");
    unit.input(b"open 3\nread 6110:2\n");
    unit.wait_out("6110:02 = ");
    for command in [
        &["dictionary", "dump", "--yes"][..],
        &["stream", "--period", "100", "--count", "1"],
        &["stream", "--source", "pv", "--period", "100", "--count", "1"],
        &["stream", "--off"],
        &["diagnostics", "--count", "1"],
        &["report", "--out", "unit.html", "--seconds", "1", "--yes"],
        &["defaults", "--yes"],
        &["load", bad, "--yes", "--password-file", "pw"],
        &["load", new, "--dry-run"],
    ] {
        take(bench.run(&[command, &["--json"]].concat()));
    }
    let dump = bench.run(&["dictionary", "dump", "--yes", "--json", "--out", "unit.json"]);
    assert_eq!(dump.code, Some(0), "{}", dump.err);
    let mut other = json(&fs::read_to_string(bench.world.path("unit.json")).expect("a dump"));
    let entries = other["entries"].as_array_mut().expect("entries");
    entries.retain(|entry| entry["index"] != "6126");
    let missing = serde_json::json!([{ "index": "6126", "subindex": 1 }]);
    other["missing"] = missing;
    fs::write(bench.world.path("other.json"), other.to_string()).expect("written");
    all.push(other);
    let mut take = |ran: Ran| all.extend(ran.out.lines().map(json));
    take(bench.world.run(&["dictionary", "diff", "unit.json", "other.json", "--all", "--json"], b""));
    take(bench.world.run(&["dictionary", "diff", "other.json", "unit.json", "--all", "--json"], b""));
    take(bench.load(new, &["--json"]));
    take(bench.world.run(&["load", new, "--dry-run", "--json", "--port", "u0", "--port", "nowhere"], b""));
    all
}

#[test]
fn the_page_of_json_has_each_member_of_each_object_with_its_type_and_no_other() {
    let page = page();
    let mut found: BTreeMap<String, Shape> = BTreeMap::new();
    for object in written() {
        let kind = object["schema"].as_str().expect("every object says what it is").to_owned();
        note("", &object, found.entry(kind).or_default());
    }
    let left = Bench::left_in_loader();
    note("", &json(&left.run(&["identify", "--json"]).out), found.entry("axcon.identify/1".into()).or_default());
    let kinds = |shapes: &BTreeMap<String, Shape>| shapes.keys().cloned().collect::<Vec<_>>();
    assert_eq!(kinds(&found), kinds(&page), "kinds of object");
    let mut never = Vec::new();
    for (kind, members) in &page {
        let written = &found[kind];
        for (member, types) in written {
            let Some(described) = members.get(member) else { panic!("{kind}: {member} is not on the page") };
            for kind_of_value in types {
                // A whole number is a number too.
                let fits =
                    described.contains(kind_of_value) || (kind_of_value == "integer" && described.contains("number"));
                assert!(fits, "{kind}: {member} is {kind_of_value}, the page says {described:?}");
            }
        }
        for (member, types) in members {
            let is_sometimes = |&(of, begins): &(&str, &str)| of == kind && member.starts_with(begins);
            let Some(written) = written.get(member) else {
                assert!(SOMETIMES.iter().any(is_sometimes), "{kind}: nothing has {member}");
                continue;
            };
            for wanted in types {
                let is_whole = wanted == "number" && written.contains("integer");
                let is_rare = RARELY.contains(&(kind.as_str(), member.as_str(), wanted.as_str()));
                if !(is_whole || written.contains(wanted) || is_rare || SOMETIMES.iter().any(is_sometimes)) {
                    never.push(format!("{kind}: {member} is never {wanted}"));
                }
            }
        }
    }
    assert!(never.is_empty(), "the page allows what nothing shows:\n{}", never.join("\n"));
    for (kind, member, wanted) in RARELY {
        assert!(page[kind][member].contains(wanted), "{kind}: {member} may not even be {wanted}");
    }
}
