//! Commands that read, and what all of them have in common: ports, JSON, readers that go.

use super::*;

#[test]
fn no_port_is_3_and_a_port_that_talks_nonsense_is_4() {
    let bench = Bench::new();
    for args in [&["identify"][..], &["stream"], &["load", "new.S", "--yes", "--password-file", "pw"]] {
        let mut args = args.to_vec();
        args.extend(["--json", "--port", "nowhere"]);
        let ran = bench.world.run(&args, b"");
        assert_eq!(ran.code, Some(3), "{args:?}: {}", ran.err);
        assert_eq!(error_object(&ran)["kind"], "port-missing", "{}", ran.err);
    }
    // The unit at a rate it does not have: garbage both ways.
    let unit = bench.world.start(&["emulate", "axtc4co", "--link", "u1"]);
    unit.wait_out("serial: ");
    let ran = bench.world.run(&["identify", "--json", "--port", "u1", "--baud", "9600"], b"");
    assert_eq!(ran.code, Some(4), "{} {}", ran.out, ran.err);
    assert_eq!(error_object(&ran)["kind"], "no-answer");
    let ran =
        bench.world.run(&["load", "new.S", "--yes", "--password-file", "pw", "--port", "u1", "--baud", "9600"], b"");
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    assert!(ran.err.contains("nothing was changed"), "{}", ran.err);
}

#[test]
fn the_stream_is_written_as_csv_and_json_and_left_as_it_was() {
    let bench = Bench::new();
    // What the unit has said at the end of it.
    let last_words = |recording: &str| {
        let shown = bench.world.run(&["terminal", "--port", &format!("replay:{recording}")], b"").out;
        shown.lines().rfind(|line| line.contains("stream is now")).unwrap_or_default().to_owned()
    };
    let ran = bench.run(&["stream", "--period", "200", "--count", "3", "--record", "off.cast"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let lines: Vec<&str> = ran.out.lines().collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0], "time,source,CJ,TC1,TC2,TC3,TC4");
    assert!(lines[1].contains("Z,fv,"), "{}", lines[1]);
    assert_eq!(last_words("off.cast"), "RS-232 stream is now OFF.");

    let ran = bench.run(&["stream", "--source", "pv", "--period", "200", "--count", "2", "--json", "--keep"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    for row in objects(&ran.out) {
        assert_eq!((&row["schema"], &row["source"]), (&"axcon.stream/1".into(), &"pv".into()));
        let channels: Vec<&str> =
            row["values"].as_array().expect("values").iter().filter_map(|v| v["channel"].as_str()).collect();
        assert_eq!(channels, ["CJ", "TC1", "TC2", "TC3", "TC4"]);
        assert!(row["values"][0]["value"].is_i64() && row["values"][0]["state"] == "ok", "{row}");
    }
    // It has been kept: it is changed for a moment, and as it was after that.
    let ran = bench.run(&["stream", "--source", "fv", "--period", "300", "--count", "1", "--record", "changed.cast"]);
    assert!(ran.code == Some(0) && ran.out.contains("Z,fv,"), "{} {}", ran.out, ran.err);
    let set_back = last_words("changed.cast");
    assert!(set_back.starts_with("RS-232 stream is now ON: Process Value every "), "{set_back}");
    // Now it is joined, and then switched off.
    let ran = bench.run(&["stream", "--count", "2", "--format", "csv"]);
    assert!(ran.out.contains("Z,pv,"), "{}", ran.out);
    assert_eq!(bench.run(&["stream", "--off"]).code, Some(0));
    let ran = bench.run(&["stream", "--period", "100", "--count", "1"]);
    assert!(ran.out.contains("Z,fv,"), "the default after the stream was off: {}", ran.out);
    // A file's ending says how rows are written; one that says nothing gets CSV.
    for (name, is_csv) in [("rows.raw", false), ("rows.txt", true)] {
        let ran = bench.run(&["stream", "--period", "100", "--count", "1", "--out", name]);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let rows = fs::read(bench.world.path(name)).expect("rows");
        assert_eq!(rows.starts_with(b"time,source,"), is_csv, "{name}");
    }
}

#[test]
fn a_dump_of_a_unit_that_has_no_values_yet_says_so() {
    let world = World::new();
    // Its view is opened before its first values have come, and none come while it is.
    let ran = world.run(&["dictionary", "dump", "--port", "emu:axtc4co", "--yes", "--out", "unit.json"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("no input has a reading"), "{}", ran.err);
}

#[test]
fn a_dictionary_is_dumped_compared_and_its_deviations_are_named() {
    let world = World::new();
    let mut unit = world.start(&["emulate", "axtc4co", "--link", "u1", "--line-rate", "off"]);
    unit.wait_out("serial: ");
    std::thread::sleep(std::time::Duration::from_millis(200));
    unit.input(b"write 4010:2 1300\nwrite 6126:1 18\nread 6126:1\n");
    unit.wait_out("6126:01 = 18.0");
    let dump = ["dictionary", "dump", "--yes", "--port", "u1"];
    let ran = world.run(&[&dump[..], &["--json", "--out", "one.json", "--record", "one.cast"]].concat(), b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let one = json(&std::fs::read_to_string(world.path("one.json")).expect("written"));
    assert_eq!((&one["schema"], &one["product"]), (&"axcon.dictionary/1".into(), &"AXTC4CO".into()));
    assert_eq!((&one["complete"], &one["missing"]), (&true.into(), &serde_json::json!([])));
    assert_eq!(one["unrecognised_lines"], 0, "titles, hints and the menu behind the view are none");
    let entries = one["entries"].as_array().expect("a list");
    assert_eq!(entries.len(), 227);
    let deviating: Vec<String> = entries
        .iter()
        .filter(|entry| entry["deviates"] == true)
        .map(|entry| format!("{}:{} {} {}", entry["index"], entry["subindex"], entry["value"], entry["default"]))
        .collect();
    assert_eq!(deviating, ["\"4010\":2 1300 1250", "\"6126\":1 18.0 16.0"]);
    // The other forms from what the unit said then: reading it takes its time.
    let again = ["dictionary", "dump", "--port", "replay:one.cast"];
    let table = world.run(&again, b"");
    assert!(table.out.contains("* 4010:02  High Temperature Warning Threshold, TC2"), "{}", table.out);
    assert!(table.out.contains("227 entries, 2 differ from the factory's (*)"), "{}", table.out);
    assert!(table.out.contains("0x10020194"), "{}", table.out);
    let same = world.run(&["dictionary", "diff", "one.json", "one.json"], b"");
    assert_eq!((same.code, same.out.as_str()), (Some(0), ""), "{}", same.err);
    let factory = world.run(&["dictionary", "diff", "one.json", "factory:axtc4co"], b"");
    assert_eq!((factory.code, factory.out.lines().count()), (Some(1), 2), "{}", factory.out);
    // Half of it is written, and not taken for all of it.
    let whole = fs::read_to_string(world.path("one.cast")).expect("a recording");
    let lines: Vec<&str> = whole.lines().collect();
    fs::write(world.path("half.cast"), lines[..lines.len() / 2].join("\n") + "\n").expect("written");
    let half = world.run(&["dictionary", "dump", "--json", "--port", "replay:half.cast"], b"");
    let read = json(&half.out);
    assert_eq!((half.code, &read["complete"]), (Some(4), &false.into()), "{}", half.err);
    assert_eq!(error_object(&half)["kind"], "no-answer", "{}", half.err);
    assert!((50..227).contains(&read["entries"].as_array().expect("a list").len()), "{}", half.out);
    let csv = world.run(&[&again[..], &["--format", "csv"]].concat(), b"");
    assert_eq!(csv.out.lines().count(), 228, "{}", csv.out);
    let bad = world.run(&["dictionary", "diff", "u1-nowhere.json", "factory:axtc4co"], b"");
    assert_eq!(bad.code, Some(2));
    assert!(bad.err.contains("cannot read the dump 'u1-nowhere.json'"), "{}", bad.err);
    fs::write(world.path("other.json"), "{\"a\": 1}").expect("written");
    let bad = world.run(&["dictionary", "diff", "other.json", "factory:axtc4co"], b"");
    let said = "axcon: other.json:1:8: this is not a dump: missing field `schema`\n";
    assert!(bad.err.starts_with(said), "what is wrong once, and its place once: {}", bad.err);
    for (text, said) in
        [("time,source,CJ\n", ": this is not JSON\n"), ("{\n\"a\": [", ": the file ends before its JSON does\n")]
    {
        fs::write(world.path("values.csv"), text).expect("written");
        let bad = world.run(&["dictionary", "diff", "one.json", "values.csv"], b"");
        assert_eq!(bad.code, Some(2), "{}", bad.err);
        let place = format!("axcon: values.csv:{}:", text.lines().count());
        assert!(bad.err.starts_with(&place) && bad.err.contains(said), "{}", bad.err);
        assert!(bad.err.contains("dictionary dump --format json"), "{}", bad.err);
    }
    let unasked = world.run(&["dictionary", "dump", "--port", "u1"], b"");
    assert_eq!(unasked.code, Some(2), "{}", unasked.err);
}

#[test]
fn a_report_tells_all_of_a_unit_and_its_recording_tells_the_same() {
    let mut bench = Bench::new();
    let args = ["report", "--out", "unit.html", "--seconds", "2"];
    let unasked = bench.run(&args);
    assert_eq!(unasked.code, Some(2), "it halts the unit: {}", unasked.err);
    assert!(!bench.world.path("unit.html").exists());
    assert_eq!(bench.version(), "1.1.0", "it has started");
    let unit = bench.unit.as_mut().expect("it runs");
    unit.input(b"open 3\nwrite 6110:2 2\nread 6110:2\n");
    unit.wait_out("6110:02 = 2 (type K)");
    let ran = bench.run(&[&args[..], &["--yes", "--record", "said.cast"]].concat());
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let page = |name: &str| fs::read_to_string(bench.world.path(name)).expect("a page");
    let live = page("unit.html");
    for said in [
        "<td>AXTC4CO</td>",
        "<td class=\"bad\">open circuit</td>",
        "TC3: open circuit",
        "1 not as the factory made them",
        "<td class=\"mark\">type K</td>",
        "Supply Voltage",
        "<polyline",
        "Main Menu",
    ] {
        assert!(live.contains(said), "no {said} in\n{live}");
    }
    assert_eq!(json(&bench.run(&["stream", "--off", "--json"]).out)["stream"], "off");

    let replay = ["report", "--out", "again.html", "--port", "replay:said.cast", "--json"];
    let ran = bench.world.run(&replay, b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let said = json(&ran.out);
    assert_eq!((&said["schema"], &said["file"]), (&"axcon.report/1".into(), &"again.html".into()));
    assert_eq!((&said["product"], &said["missing"]), (&"AXTC4CO".into(), &serde_json::json!([])), "{said}");
    let again = page("again.html");
    let section = |page: &str, name: &str| {
        let text = page.split(&format!("<h2>{name}</h2>")).nth(1).and_then(|text| text.split("<h2>").next());
        text.unwrap_or_else(|| panic!("no {name} in\n{page}")).to_owned()
    };
    for name in ["Object dictionary", "Diagnostics"] {
        assert_eq!(section(&again, name), section(&live, name), "{name}");
    }
    let ran = bench.world.run(&["report", "--out", "nowhere/unit.html", "--port", "replay:said.cast"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("cannot write 'nowhere/unit.html'"), "{}", ran.err);
}

#[test]
fn what_a_recording_does_not_show_is_missing_in_its_report() {
    let world = World::new();
    let recording = concat!(
        r#"{"version":2,"width":80,"height":24}"#,
        "\n",
        r#"[0.1,"o","(c) Motorola Inc. S-Record loader. Version 1.3\r\nWaiting for application S-Record.\r\n"]"#,
        "\n",
    );
    fs::write(world.path("loader.cast"), recording).expect("written");
    let report = ["report", "--out", "unit.html", "--yes", "--port", "replay:loader.cast", "--json"];
    let missing = |more: &[&str]| {
        let ran = world.run(&[&report[..], more].concat(), b"");
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let said = json(&ran.out);
        assert_eq!(said["product"], Value::Null, "{said}");
        said["missing"].clone()
    };
    let (stream, pages) = ("Not in the recording: the stream.", "Not in the recording: diagnostics.");
    let all = serde_json::json!([stream, pages, "Not in the recording: the object dictionary."]);
    assert_eq!(missing(&[]), all);
    let page = fs::read_to_string(world.path("unit.html")).expect("a page");
    assert!(page.contains("in its loader") && page.contains(stream), "{page}");
    assert_eq!(missing(&["--no-dictionary"]), serde_json::json!([stream, pages]), "what nobody wants is not missing");
}

#[test]
fn a_signal_ends_the_wait_for_a_recording_that_comes_through_a_pipe() {
    for command in ["terminal", "stream"] {
        let world = World::new();
        let made = std::process::Command::new("mkfifo").arg(world.path("pipe")).status();
        assert!(made.expect("a program of every Unix").success());
        let running = world.start(&[command, "--port", "replay:pipe"]);
        // This waits until it is read from: signals are heard by then.
        let writer = fs::File::options().write(true).open(world.path("pipe")).expect("a reader");
        running.signal(rustix::process::Signal::TERM);
        assert_eq!(running.wait().code, Some(130), "{command}");
        drop(writer);
    }
}

#[test]
fn a_signal_ends_a_terminal_whose_recording_does_not_go_on() {
    let world = World::new();
    let mut running = world.start(&["terminal", "--port", "replay:/dev/stdin"]);
    running.input(b"{\"version\":2,\"width\":80,\"height\":24}\n[0.1,\"o\",\"hello\\r\\n\"]\n");
    running.wait_out("hello");
    running.signal(rustix::process::Signal::TERM);
    assert_eq!(running.wait().code, Some(130));
}

#[test]
fn an_interrupt_in_the_middle_of_a_dump_leaves_the_view() {
    let world = World::new();
    let mut unit = world.start(&["emulate", "axtc4co", "--link", "u1"]);
    unit.wait_out("serial: ");
    let dump = world.start(&["dictionary", "dump", "--yes", "--port", "u1", "--record", "dump.cast"]);
    // The unit stands in its view once it is asked for the second entry.
    world.wait_in("dump.cast", "\"i\",\"v\"");
    world.wait_in("dump.cast", "\"i\",\"\\r");
    dump.signal(rustix::process::Signal::INT);
    let ran = dump.wait();
    assert_eq!(ran.code, Some(130), "{}{}", ran.out, ran.err);
    unit.input(b"read 6126:1\n");
    unit.wait_out("6126:01 = 16.0");
}

#[test]
fn what_was_read_before_the_cable_is_pulled_is_written_and_the_link_is_the_error() {
    let world = World::new();
    let fault = "unplug from-unit at byte 4000";
    let unit = world.start(&["emulate", "axtc4co", "--link", "u1", "--fault", fault]);
    unit.wait_out("serial: ");
    let ran = world.run(&["dictionary", "dump", "--yes", "--port", "u1", "--out", "unit.json"], b"");
    assert_eq!(ran.code, Some(3), "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("what was read is written all the same; entries read: "), "{}", ran.err);
    let dump = json(&std::fs::read_to_string(world.path("unit.json")).expect("a dump"));
    assert_eq!(dump["complete"], false);
    assert!(dump["entries"].as_array().is_some_and(|entries| entries.len() > 10), "{dump}");
}

#[test]
fn diagnostics_and_defaults_are_commands_of_their_own() {
    let world = World::new();
    let mut unit = world.start(&["emulate", "axrtd8co", "--link", "u1"]);
    unit.wait_out("serial: ");
    std::thread::sleep(std::time::Duration::from_millis(200));
    unit.input(b"write 6126:1 18\nwrite 1010:1 0x65766173\nread 6126:1\n");
    unit.wait_out("6126:01 = 18.0");
    let ran = world.run(&["diagnostics", "--count", "1", "--json", "--port", "u1"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let page = json(&ran.out);
    assert_eq!(page["schema"], "axcon.diagnostics/1");
    let values = page["values"].as_array().expect("a list");
    assert!(values.iter().any(|value| value["label"] == "Supply Voltage" && value["unit"] == "V"), "{page}");
    let ran = world.run(&["defaults", "--port", "u1"], b"");
    assert_eq!(ran.code, Some(2), "nobody said yes: {}", ran.err);
    let ran = world.run(&["defaults", "--yes", "--json", "--port", "u1"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_eq!(json(&ran.out)["product"], "AXRTD8CO");
    unit.input(b"read 6126:1\n");
    unit.wait_out("6126:01 = 16.0");
}

#[test]
fn a_deep_look_says_the_serial_number_and_a_wait_hears_the_banner() {
    let world = World::new();
    let mut unit = world.start(&["emulate", "axtc4co", "--link", "u1", "--line-rate", "off", "--seed", "7"]);
    unit.wait_out("serial: ");
    std::thread::sleep(std::time::Duration::from_millis(200));
    unit.input(b"read 1018:4\n");
    let said = unit.wait_out("1018:04 = ");
    let serial: u32 = said.rsplit("= ").next().and_then(|text| text.trim().parse().ok()).expect("a number");
    let unasked = world.run(&["identify", "--deep", "--port", "u1"], b"");
    assert_eq!(unasked.code, Some(2), "{}", unasked.err);
    let ran = world.run(&["identify", "--deep", "--yes", "--json", "--port", "u1"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let identity = json(&ran.out);
    assert_eq!((&identity["serial_number"], &identity["product"]), (&serial.into(), &"AXTC4CO".into()));
    let waiting = world.start(&["identify", "--wait", "--json", "--port", "u1"]);
    waiting.wait_err("switch the unit's power off and on");
    std::thread::sleep(std::time::Duration::from_millis(300));
    unit.input(b"power cycle 0.1\n");
    let ran = waiting.wait();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let identity = json(&ran.out);
    assert_eq!((&identity["version"], &identity["sources"]["version"]), (&"1.1.0".into(), &"banner".into()));
}

#[test]
fn a_stream_that_ends_before_its_first_row_is_off_all_the_same() {
    let bench = Bench::new();
    fs::write(bench.world.path("old.csv"), "yesterday\n").expect("written");
    let run = |args: &[&str]| {
        let mut all = vec!["stream", "--port", "u0"];
        all.extend(args);
        all.extend(FAST);
        bench.world.start(&all)
    };
    // One for each: an interrupt while the first row is awaited, and a row that cannot be written.
    let early = run(&["--period", "10000", "--out", "old.csv", "--yes", "--record", "early.cast"]);
    bench.world.wait_in("early.cast", "10000");
    early.signal(rustix::process::Signal::INT);
    let ran = early.wait();
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    let said = |recording: &str| bench.world.run(&["terminal", "--port", &format!("replay:{recording}")], b"").out;
    assert!(said("early.cast").contains("RS-232 stream is now OFF"), "{}", said("early.cast"));
    assert_eq!(fs::read_to_string(bench.world.path("old.csv")).expect("there"), "yesterday\n", "nothing came for it");

    let full = run(&["--period", "200", "--out", "/dev/full", "--record", "full.cast"]).wait();
    assert_eq!(full.code, Some(1), "{}", full.err);
    assert!(full.err.contains("cannot write '/dev/full'"), "{}", full.err);
    assert!(said("full.cast").contains("RS-232 stream is now OFF"), "{}", said("full.cast"));

    // What is there is not replaced unasked, and nobody troubles the unit for it.
    for command in [&["stream", "--out", "old.csv"][..], &["report", "--no-dictionary", "--out", "old.csv"]] {
        let ran = bench.run(command);
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        assert!(ran.err.contains("old.csv exists already"), "{}", ran.err);
    }
}

#[test]
fn an_interrupt_before_all_rows_have_come_is_told() {
    let bench = Bench::new();
    let mut args = vec!["stream", "--port", "u0", "--period", "100", "--count", "9999", "--out", "rows.jsonl"];
    args.extend(FAST);
    let rows = bench.world.start(&args);
    bench.world.wait_in("rows.jsonl", "axcon.stream/1");
    rows.signal(rustix::process::Signal::INT);
    let ran = rows.wait();
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    assert!(ran.err.contains("axcon: interrupted: ") && ran.err.contains(" of 9999 written"), "{}", ran.err);
}

#[test]
fn a_report_on_a_unit_that_dies_keeps_what_was_found_out() {
    let mut bench = Bench::new();
    let mut args = vec!["report", "--out", "r.html", "--seconds", "2", "--no-dictionary", "--record", "r.cast"];
    args.extend(["--port", "u0"]);
    args.extend(FAST);
    let report = bench.world.start(&args);
    bench.world.wait_in("r.cast", r#""i","500"#);
    bench.unit.as_mut().expect("it runs").input(b"power off\n");
    let ran = report.wait();
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    assert!(ran.err.contains("in the report all the same: r.html"), "{}", ran.err);
    let page = fs::read_to_string(bench.world.path("r.html")).expect("a page");
    assert!(page.contains("AXTC4CO") && page.contains("Not found out: diagnostics."), "{page}");
}

#[test]
fn a_cable_is_said_to_be_in_when_its_port_is_there() {
    let world = World::new();
    let mut unit = world.start(&["emulate", "axtc4co", "--json"]);
    unit.wait_out("axcon.emulate/1");
    unit.input(b"unplug\nplug\n");
    let said = unit.wait_out("\"verb\":\"plug\"");
    let whole = &said[..said.rfind('\n').expect("a line")];
    let told: Vec<String> = objects(whole)
        .iter()
        .map(|told| told["verb"].as_str().or(told["schema"].as_str()).expect("one of them").to_owned())
        .collect();
    assert_eq!(told[..4], ["axcon.emulate/1", "unplug", "axcon.emulate/1", "plug"], "{said}");
}

#[test]
fn pages_whose_reader_has_gone_are_stopped() {
    let bench = Bench::new();
    let mut command = bench.world.command(&["diagnostics", "--port", "u0", "--record", "pages.cast"]);
    let mut child = command.args(FAST).stdout(std::process::Stdio::piped()).spawn().expect("it starts");
    let mut first = [0; 16];
    std::io::Read::read_exact(&mut child.stdout.take().expect("piped"), &mut first).expect("a page");
    // The reader is gone with the end of that line.
    let begun = Instant::now();
    let status = loop {
        match child.try_wait().expect("a child") {
            Some(status) => break status,
            None => assert!(begun.elapsed() < PATIENCE, "it goes on for ever"),
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    assert_eq!(status.code(), Some(0));
    let asked = fs::read_to_string(bench.world.path("pages.cast")).expect("a recording");
    assert!(asked.matches("\"i\",\"s\"").count() >= 2, "switched on and off: {asked}");
}

#[test]
fn a_command_line_that_makes_no_sense_is_told_as_json_where_that_was_asked_for() {
    let world = World::new();
    for args in [
        &["frobnicate", "--json"][..],
        &["identify", "--bogus", "--json"],
        &["image", "check", "x", "--product", "n", "--json"],
    ] {
        let ran = world.run(args, b"");
        assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""), "{args:?}");
        let error = json(&ran.err);
        assert_eq!((&error["schema"], &error["exit_code"]), (&"axcon.error/1".into(), &2.into()), "{}", ran.err);
    }
    let twice = world.run(&["load", "x.S", "--port", "a", "--port", "a", "--yes"], b"");
    assert_eq!(twice.code, Some(2));
    assert!(twice.err.contains("'a' is named twice"), "{}", twice.err);
}

#[test]
fn what_is_no_text_on_standard_input_ends_no_emulator() {
    let world = World::new();
    let endless = vec![b'x'; 100_000];
    let input = [&b"status\n\xff\xfe\nfoo\n"[..], &endless, b"\nstatus\nquit\n"].concat();
    let ran = world.run(&["emulate", "axtc4co", "--json"], &input);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let answers: Vec<Value> =
        objects(&ran.out).into_iter().filter(|object| object["schema"] == "axcon.emulate-answer/1").collect();
    let refused = answers.iter().filter(|answer| answer["ok"] == false && answer["unit"].is_null()).count();
    assert_eq!(refused, 2 + 2, "an endless line is looked at in pieces: {}", ran.out);
}

#[test]
fn man_pages_that_are_there_are_replaced_only_if_somebody_says_yes() {
    let world = World::new();
    assert_eq!(world.run(&["man", "--out", "pages"], b"").code, Some(0));
    let page = world.path("pages/axcon-load.1");
    fs::write(&page, "somebody's own").expect("written");
    let kept = world.run(&["man", "--out", "pages"], b"");
    assert_eq!(kept.code, Some(2), "{}", kept.err);
    assert!(kept.err.contains(" exists already"), "{}", kept.err);
    assert_eq!(fs::read_to_string(&page).expect("a page"), "somebody's own");
    assert_eq!(world.run(&["man", "--out", "pages", "--yes"], b"").code, Some(0));
    assert!(fs::read_to_string(&page).expect("a page").contains(".TH "));
}

#[test]
fn an_option_that_would_be_ignored_is_refused() {
    let world = World::new();
    for (args, complaint) in [
        (&["ports", "--port", "u0"][..], "'axcon ports' does not use a unit, so --port does not apply"),
        (&["--port", "u0", "ports"], "'axcon ports' does not use a unit, so --port does not apply"),
        (&["eds", "axtc4co", "--record", "it.cast"], "'axcon eds' does not use a unit, so --record does not apply"),
        (&["image", "info", "x.S", "--baud", "9600"], "'axcon image info' does not use a unit, so --baud"),
        (&["dictionary", "diff", "a", "b", "--port", "u0"], "'axcon dictionary diff' does not use a unit, so --port"),
        (&["terminal", "--json", "--port", "u0"], "--json does not apply"),
        (&["stream", "--format", "csv", "--json", "--port", "u0"], "--json and --format csv contradict each other"),
        (&["diagnostics", "--json", "--format", "text", "--port", "u0"], "--json and --format text contradict"),
        (&["dictionary", "dump", "--json", "--format", "dcf", "--port", "u0"], "--json and --format dcf contradict"),
        (&["eds", "axtc4co", "--json"], "'axcon eds' writes an electronic data sheet and no JSON, so --json does not"),
        (&["--json", "completions", "bash"], "'axcon completions' writes a script for a shell and no JSON, so --json"),
        (&["man", "--json"], "'axcon man' writes man pages and no JSON, so --json does not apply"),
    ] {
        let ran = world.run(args, b"");
        assert_eq!(ran.code, Some(2), "{args:?}: {}", ran.err);
        assert!(ran.err.contains(complaint), "{args:?}: {}", ran.err);
    }
    // What the environment says is said to all commands.
    let mut command = world.command(&["ports"]);
    command.env("AXCON_PORT", "u0");
    assert_eq!(Running::start(command).wait().code, Some(0));
}

#[test]
fn a_number_that_is_not_taken_is_answered_with_those_that_are() {
    let world = World::new();
    for (args, complaint) in [
        (&["stream", "--reconnect", "-1"][..], "'-1' for '--reconnect <S>': it takes a whole number, 0 or more"),
        (&["stream", "--count", "-1"], "'-1' for '--count <N>': it takes a whole number, 1 or more"),
        (&["stream", "--period", "abc"], "'abc' for '--period <MS>': it takes a whole number from 1 to 60,000"),
        (&["stream", "--duration", "abc"], "'abc' for '--duration <S>': it takes seconds, more than 0 and"),
        (&["stream", "--duration", "-1"], "it takes seconds, more than 0 and no more than 31,622,400"),
        (&["report", "--out", "r.html", "--seconds", "-1"], "it takes a whole number from 1 to 3,600"),
        (&["diagnostics", "--count", "0"], "it takes a whole number from 1 to 4,294,967,295"),
        (
            &["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "-5"],
            "'-5' for '--words <N>': it takes a whole number from 0 to 4,294,967,295",
        ),
        (&["emulate", "axtc4co", "--seed", "-1"], "'-1' for '--seed <N>': it takes a whole number, 0 or more"),
        (&["emulate", "axtc4co", "--count", "257"], "it takes a whole number from 1 to 256"),
        (&["identify", "--baud", "49"], "it takes a whole number from 50 to 12,000,000"),
    ] {
        let ran = world.run(args, b"");
        assert_eq!(ran.code, Some(2), "{args:?}: {}", ran.err);
        assert!(ran.err.contains(complaint), "{args:?}: {}", ran.err);
    }
}

#[test]
fn a_file_that_cannot_be_written_is_said_before_the_port_is_looked_at() {
    let world = World::new();
    for command in [&["stream"][..], &["dictionary", "dump", "--yes"], &["report", "--yes"]] {
        let ran = world.run(&[command, &["--out", "nowhere/it", "--port", "no-such-port"]].concat(), b"");
        assert_eq!(ran.code, Some(1), "{}", ran.err);
        assert!(ran.err.starts_with("axcon: cannot write 'nowhere/it': "), "{}", ran.err);
    }
    let ran = world.run(&["terminal", "--log", "nowhere/log", "--port", "no-such-port"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.starts_with("axcon: cannot write the log 'nowhere/log': "), "{}", ran.err);
    let ran = world.run(&["terminal", "--log", "log", "--port", "no-such-port"], b"");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(!world.path("log").exists(), "a port that does not open leaves no file");
}

#[test]
fn help_that_cannot_be_written_is_1_with_the_reason() {
    let world = World::new();
    let program = env!("CARGO_BIN_EXE_axcon");
    for args in ["--help", "-h", "--version", "load --help", "help load"] {
        let line = format!("'{program}' {args} > /dev/full");
        let ran = Running::start(world.command_of(Path::new("/bin/sh"), &["-c", &line])).wait();
        assert_eq!(ran.code, Some(1), "{args}: {}", ran.err);
        assert!(ran.err.contains("cannot write to standard output"), "{args}: {}", ran.err);
    }
}

#[test]
fn a_files_name_is_itself_in_json_and_acts_on_no_terminal() {
    let world = World::new();
    let name = "a\t\u{1b}[2J\u{202e}b.S";
    fs::write(world.path(name), "S0030000FC\n").expect("written");
    let ran = world.run(&["image", "check", "--json", name], b"");
    assert_eq!(json(&ran.out)["file"], name, "{}", ran.err);
    let ran = world.run(&["image", "check", name], b"");
    assert!(ran.out.contains("a^I^[[2J‹202e›b.S:"), "{}", ran.out);
}

#[test]
fn hints_fit_where_the_trouble_is() {
    let world = World::new();
    fs::write(world.path("empty.json"), "").expect("written");
    let ran = world.run(&["dictionary", "diff", "empty.json", "factory:axtc4co"], b"");
    assert!(ran.code == Some(2) && ran.err.contains("empty.json:1:1: "), "{}", ran.err);
    let program = env!("CARGO_BIN_EXE_axcon");
    let line = format!("'{program}' image check - < .");
    let ran = Running::start(world.command_of(Path::new("/bin/sh"), &["-c", &line])).wait();
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    assert!(ran.err.contains("Name the .S file itself") && !ran.err.contains("local disk"), "{}", ran.err);
}

#[test]
fn a_defect_that_cannot_be_allowed_is_answered_with_those_that_can() {
    let world = World::new();
    let ran = world.run(&["image", "check", "x.S", "--allow", "foo"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    let (_, known) = ran.err.split_once("there is no defect called 'foo'; possible: ").expect(&ran.err);
    let known: Vec<&str> = known.lines().next().unwrap_or_default().split(", ").collect();
    assert!(known.contains(&"bad-checksum") && known.contains(&"no-identity"), "{known:?}");
    for name in known {
        let ran = world.run(&["image", "check", "x.S", "--allow", name], b"");
        assert_eq!(ran.code, Some(5), "{name} is taken, the file is missing: {}", ran.err);
    }
    let ran = world.run(&["image", "check", "x.S", "--allow", "no-data"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
}

#[test]
fn what_is_no_fact_is_not_counted_as_not_recognised() {
    let bench = Bench::new();
    for args in [&["identify", "--json"][..], &["identify", "--json", "--deep", "--yes", "--record", "deep.cast"]] {
        let ran = bench.run(args);
        assert_eq!(json(&ran.out)["unrecognised_lines"], 0, "{args:?}: {}", ran.out);
    }
    assert_eq!(bench.run(&["diagnostics", "--count", "2", "--record", "pages.cast"]).code, Some(0));
    for recording in ["replay:deep.cast", "replay:pages.cast"] {
        let ran = bench.world.run(&["identify", "--json", "--port", recording], b"");
        assert_eq!(json(&ran.out)["unrecognised_lines"], 0, "{recording}: {}", ran.out);
    }
}

#[test]
fn what_was_found_is_the_exit_code_whoever_still_reads() {
    let world = World::new();
    let bad = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/bad/bad-checksum.elf.S");
    let bad = bad.display().to_string();
    fs::write(world.path("pw"), "AXIO-2010").expect("written");
    for (name, version) in [("a.S", "1.2.0"), ("b.S", "1.3.0")] {
        let make = ["image", "make", "--product", "axtc4co", "--version", version, "--words", "600", "--out", name];
        assert_eq!(world.run(&make, b"").code, Some(0));
    }
    let silent = crate::support::puppet::Puppet::silent();
    let port = silent.path().display().to_string();
    for (args, code) in [
        (&["image", "check", &bad][..], 5),
        (&["image", "check", "a.S"], 0),
        (&["image", "diff", "a.S", "b.S"], 1),
        (&["image", "convert", &bad, "--out", "c.S"], 5),
        (&["load", &bad, "--yes", "--password-file", "pw", "--port", "nowhere"], 5),
        (&["dictionary", "diff", "factory:axtc4co", "factory:axrtd8co"], 1),
        (&["identify", "--port", &port], 4),
    ] {
        for json in [&[][..], &["--json"]] {
            let (reader, writer) = std::io::pipe().expect("a pipe");
            drop(reader);
            let mut command = world.command(&[args, json].concat());
            let ran = command.stdout(writer).stderr(std::process::Stdio::null()).status().expect("it runs");
            assert_eq!(ran.code(), Some(code), "{args:?} {json:?}");
        }
    }
}

#[test]
fn a_report_leaves_a_stream_on_that_was_too_slow_to_be_seen() {
    let bench = Bench::new();
    let slow = bench.world.start(&["stream", "--period", "60000", "--keep", "--port", "u0", "--record", "slow.cast"]);
    bench.world.wait_in("slow.cast", "\"i\",\"60000");
    slow.signal(rustix::process::Signal::INT);
    assert_eq!(slow.wait().code, Some(130));
    let ran = bench.run(&["report", "--out", "unit.html", "--seconds", "1", "--no-dictionary"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("the stream was on before, at a rate too slow to be seen"), "{}", ran.err);
    assert_eq!(bench.run(&["stream", "--off", "--record", "off.cast"]).code, Some(0));
    let said = bench.world.run(&["terminal", "--port", "replay:off.cast"], b"").out;
    assert!(said.contains("RS-232 stream is now OFF"), "it was on: {said}");
}
