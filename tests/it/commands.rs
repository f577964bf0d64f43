//! The commands as a user and a script meet them: the real program on a real port, the emulated unit in another process.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::flashed::assert_flash_holds;
use crate::support::shell::{PATIENCE, Ran, Running, World};

/// Without a wire's pace, so that the tests wait for the unit's flash only.
const FAST: &[&str] = &["--baud", "3000000"];

/// A world with a password file, an image of a few pages, and a unit on the link `u0` with its memories in `s0`.
struct Bench {
    world: World,
    unit: Option<Running>,
}

impl Bench {
    fn new() -> Self {
        Bench::with_image("4000")
    }

    fn with_image(words: &str) -> Self {
        let world = World::new();
        fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
        let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", words, "--out", "new.S"];
        let made = world.run(&args, b"");
        assert_eq!(made.code, Some(0), "{}", made.err);
        let mut bench = Bench { world, unit: None };
        bench.power_up();
        bench
    }

    /// Starts the emulator, or starts it again.
    fn power_up(&mut self) {
        self.power_up_as("axtc4co", &["--state", "s0"]);
    }

    /// Starts another emulator in its place.
    fn power_up_as(&mut self, product: &str, more: &[&str]) {
        self.unit = None;
        let args = [&["emulate", product, "--link", "u0", "--line-rate", "off"], more].concat();
        let unit = self.world.start(&args);
        unit.wait_out("serial: ");
        self.unit = Some(unit);
    }

    fn run(&self, args: &[&str]) -> Ran {
        let mut all = args.to_vec();
        all.extend(["--port", "u0"]);
        all.extend(FAST);
        self.world.run(&all, b"")
    }

    fn load(&self, image: &str, more: &[&str]) -> Ran {
        let mut args = vec!["load", image, "--yes", "--password-file", "pw"];
        args.extend(more);
        self.run(&args)
    }

    fn version(&self) -> Value {
        let ran = self.run(&["identify", "--json"]);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        json(&ran.out)["version"].clone()
    }
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn objects(text: &str) -> Vec<Value> {
    text.lines().map(json).collect()
}

fn error_object(ran: &Ran) -> Value {
    json(ran.err.lines().last().unwrap_or_default())
}

#[test]
fn an_upload_puts_exactly_the_image_into_flash_and_the_unit_says_the_new_version() {
    let bench = Bench::new();
    assert_eq!(bench.version(), "1.1.0");
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.starts_with("done: the unit runs AXTC4CO V1.2.0 (before: V1.1.0); "), "{}", ran.out);
    assert!(ran.err.contains("unit   u0: AXTC4CO V1.1.0"), "the plan names the unit: {}", ran.err);
    assert_flash_holds(&bench.world.path("s0/flash.bin"), &bench.world.path("new.S"));
    assert_eq!(bench.version(), "1.2.0");
    for recording in bench.world.files("state/axcon/recordings") {
        let text = fs::read_to_string(&recording).expect("a recording");
        assert!(!text.contains("AXIO"), "{}", recording.display());
    }
}

#[test]
fn an_upload_to_a_loader_that_erases_everything_first_says_so_and_ends_well() {
    let world = World::new();
    fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
    let args = ["image", "make", "--product", "axrtd8co", "--version", "2.2.0", "--words", "4000", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    let unit = world.start(&["emulate", "axrtd8co", "--link", "u0", "--state", "s0", "--line-rate", "off"]);
    unit.wait_out("serial: ");
    let load = ["load", "new.S", "--yes", "--password-file", "pw", "--port", "u0", "--json"];
    let ran = world.run(&[&load[..], FAST].concat(), b"");
    assert_eq!(ran.code, Some(0), "{} {}", ran.out, ran.err);
    let objects = objects(&ran.out);
    let (verdict, progress) = objects.split_last().expect("objects");
    assert_eq!((&verdict["verdict"], &verdict["product"]), (&"done".into(), &"AXRTD8CO".into()));
    assert_eq!((&verdict["version_before"], &verdict["version_after"]), (&"2.1.1".into(), &"2.2.0".into()));
    for phase in ["enter-loader", "erase", "transfer", "finish", "verify"] {
        assert!(progress.iter().any(|object| object["phase"] == phase), "{phase}: {}", ran.out);
    }
    assert_flash_holds(&world.path("s0/flash.bin"), &world.path("new.S"));
}

#[test]
fn an_upload_in_json_is_progress_line_by_line_and_then_the_verdict() {
    let bench = Bench::new();
    let ran = bench.load("new.S", &["--json"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let objects = objects(&ran.out);
    let (verdict, progress) = objects.split_last().expect("objects");
    assert_eq!(verdict["schema"], "axcon.load/1");
    assert_eq!((&verdict["verdict"], &verdict["unit"]), (&"done".into(), &"application".into()));
    assert_eq!((&verdict["version_before"], &verdict["version_after"]), (&"1.1.0".into(), &"1.2.0".into()));
    assert_eq!(verdict["records"], verdict["records_total"]);
    let phases: Vec<&str> = progress.iter().filter_map(|object| object["phase"].as_str()).collect();
    assert!(progress.iter().all(|object| object["schema"] == "axcon.progress/1"));
    for phase in ["enter-loader", "transfer", "finish", "verify"] {
        assert!(phases.contains(&phase), "{phases:?}");
    }
    let bytes: Vec<u64> = progress.iter().filter_map(|object| object["bytes"].as_u64()).collect();
    assert!(bytes.is_sorted(), "{bytes:?}");
    assert_eq!(bytes.last().copied(), progress[0]["bytes_total"].as_u64());
}

#[test]
fn an_image_with_an_error_is_refused_with_its_line_before_the_port_is_opened() {
    let world = World::new();
    fs::write(world.path("pw"), "AXIO-2010").expect("written");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/bad");
    let mut refused = 0;
    for entry in fs::read_dir(folder).expect("bad images") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "S") {
            continue;
        }
        let file = path.display().to_string();
        // No such port: whoever tried to open it would end with 3.
        let args = ["load", &file, "--port", "nowhere", "--yes", "--password-file", "pw"];
        let ran = world.run(&args, b"");
        assert_eq!(ran.code, Some(5), "{file}: {}", ran.err);
        let name = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.split('.').next());
        let name = name.expect("named after its defect");
        assert!(ran.out.contains(&format!(": error {name}: ")), "{file}:\n{}", ran.out);
        refused += 1;
    }
    assert!(refused >= 12, "{refused} bad images");
}

#[test]
fn an_image_that_does_not_say_what_it_is_needs_somebody_who_does() {
    let bench = Bench::new();
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/odd/no-identity.elf.S").display().to_string();
    let ran = bench.load(&file, &[]);
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    assert!(ran.err.contains("--allow no-identity"), "{}", ran.err);
    assert_eq!(bench.version(), "1.1.0");
}

#[test]
fn a_wrong_password_is_6_and_changes_nothing() {
    let bench = Bench::new();
    fs::write(bench.world.path("pw"), "axio-2010\n").expect("written");
    let before = fs::read(bench.world.path("s0/flash.bin")).expect("flash");
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(6), "{}", ran.err);
    assert!(ran.err.contains("did not accept the password") && !ran.err.contains("axio-2010"), "{}", ran.err);
    assert_eq!(fs::read(bench.world.path("s0/flash.bin")).expect("flash"), before);
    assert_eq!(bench.version(), "1.1.0");
}

#[test]
fn a_unit_that_dies_in_the_middle_is_saved_by_the_same_command() {
    let mut bench = Bench::with_image("12000");
    let mut command = vec!["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"];
    command.extend(FAST);
    let loading = bench.world.start(&command);
    loading.wait_out(r#""phase":"transfer","record":1"#);
    let killed = Instant::now();
    bench.unit = None; // Kills the emulator.
    let ran = loading.wait();
    assert!(killed.elapsed() < Duration::from_secs(5), "{:?}", killed.elapsed());
    assert_eq!(ran.code, Some(7), "{}\n{}", ran.out, ran.err);
    let verdict = json(ran.out.lines().last().expect("a verdict"));
    assert_eq!((&verdict["verdict"], &verdict["unit"]), (&"failed".into(), &"loader".into()), "{verdict}");

    bench.power_up();
    let found = bench.run(&["identify", "--json"]);
    assert_eq!(json(&found.out)["state"], "loader", "{}", found.err);
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("it is the AXTC4CO that 'new.S' was for"), "{}", ran.err);
    assert_flash_holds(&bench.world.path("s0/flash.bin"), &bench.world.path("new.S"));
    assert_eq!(bench.version(), "1.2.0");
}

#[test]
fn a_unit_found_in_its_loader_is_not_sent_anything_before_somebody_says_what_it_is() {
    let mut bench = Bench::with_image("12000");
    let mut command = vec!["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"];
    command.extend(FAST);
    let loading = bench.world.start(&command);
    loading.wait_out(r#""phase":"transfer","record":1"#);
    bench.unit = None;
    loading.wait();
    bench.power_up();
    // Another computer, where nobody knows of the first attempt.
    fs::remove_file(bench.world.path("state/axcon/uploads.json")).expect("the note");
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("--product"), "{}", ran.err);
    let ran = bench.load("new.S", &["--product", "axtc4co"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}

#[test]
fn an_interrupt_in_the_middle_says_what_the_unit_is_now() {
    let bench = Bench::with_image("12000");
    let mut command = vec!["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"];
    command.extend(FAST);
    let loading = bench.world.start(&command);
    loading.wait_out(r#""phase":"transfer","record":1"#);
    loading.signal(rustix::process::Signal::INT);
    let ran = loading.wait();
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    let verdict = json(ran.out.lines().last().expect("a verdict"));
    assert_eq!((&verdict["verdict"], &verdict["unit"]), (&"interrupted".into(), &"loader".into()), "{verdict}");
    assert_eq!(bench.load("new.S", &[]).code, Some(0));
}

#[test]
fn whoever_cannot_be_asked_has_to_say_yes_and_give_the_password() {
    let bench = Bench::new();
    let ran = bench.run(&["load", "new.S", "--password-file", "pw"]);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("--yes"), "{}", ran.err);
    let ran = bench.run(&["load", "new.S", "--yes"]);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("--password-file"), "{}", ran.err);
    for (content, complaint) in [("", "empty"), ("two\nlines\n", "more than one line"), (&"x".repeat(300), "longer")] {
        fs::write(bench.world.path("bad"), content).expect("written");
        let ran = bench.run(&["load", "new.S", "--yes", "--password-file", "bad"]);
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        assert!(ran.err.contains(complaint) && !ran.err.contains("lines\nlines"), "{}", ran.err);
    }
    assert_eq!(bench.version(), "1.1.0");
}

#[test]
fn a_dry_run_shows_the_plan_and_sends_no_key_but_the_question() {
    let bench = Bench::new();
    let ran = bench.run(&["load", "new.S", "--dry-run"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("plan ") && ran.err.contains("AXTC4CO V1.2.0"), "{}", ran.err);
    let recordings = bench.world.files("state/axcon/recordings");
    let text = fs::read_to_string(recordings.first().expect("a recording")).expect("text");
    let sent: Vec<&str> = text.lines().filter(|line| line.contains(r#","i","#)).collect();
    assert_eq!(sent.len(), 1, "{sent:?}");
    assert!(sent[0].ends_with("\"\\u0011m\"]"), "{sent:?}");
}

#[test]
fn bad_images_of_every_kind_give_one_message_and_5() {
    let world = World::new();
    fs::write(world.path("empty.S"), "").expect("written");
    fs::create_dir(world.path("folder.S")).expect("made");
    let huge = fs::File::create(world.path("huge.S")).expect("made");
    huge.set_len(1 << 30).expect("a sparse gigabyte");
    for (file, says) in
        [("missing.S", "missing.S"), ("folder.S", "directory"), ("empty.S", "empty"), ("huge.S", "huge.S")]
    {
        let begun = Instant::now();
        let ran = world.run(&["load", file, "--yes", "--port", "nowhere"], b"");
        assert_eq!(ran.code, Some(5), "{file}: {}", ran.err);
        let said = format!("{}{}", ran.out, ran.err);
        assert!(said.contains(says), "{file}: {said}");
        assert!(said.lines().count() <= 5, "one message: {said}");
        assert!(begun.elapsed() < PATIENCE);
    }
}

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
    let ran = bench.run(&["stream", "--period", "200", "--count", "3"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let lines: Vec<&str> = ran.out.lines().collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0], "time,source,CJ,TC1,TC2,TC3,TC4");
    assert!(lines[1].contains("Z,fv,"), "{}", lines[1]);

    let ran = bench.run(&["stream", "--source", "pv", "--period", "200", "--count", "2", "--json", "--keep"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    for row in objects(&ran.out) {
        assert_eq!((&row["schema"], &row["source"]), (&"axcon.stream/1".into(), &"pv".into()));
        let channels: Vec<&str> =
            row["values"].as_array().expect("values").iter().filter_map(|v| v["channel"].as_str()).collect();
        assert_eq!(channels, ["CJ", "TC1", "TC2", "TC3", "TC4"]);
        assert!(row["values"][0]["value"].is_i64() && row["values"][0]["state"] == "ok", "{row}");
    }
    // It has been kept: it is joined now, and off after that.
    let ran = bench.run(&["stream", "--count", "2", "--format", "csv"]);
    assert!(ran.out.contains("Z,pv,"), "{}", ran.out);
    assert_eq!(bench.run(&["stream", "--off"]).code, Some(0));
    let ran = bench.run(&["stream", "--period", "100", "--count", "1"]);
    assert!(ran.out.contains("Z,fv,"), "the default after the stream was off: {}", ran.out);
}

#[test]
fn a_client_nobody_here_wrote_uploads_into_the_emulator() {
    let Some(python) = std::env::var_os("AXCON_TEST_PYTHON") else {
        // Straight to the stream: what the test harness captures of a test that passes is never seen.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: no foreign client; set AXCON_TEST_PYTHON to a Python with pyserial, as .ci/run does"
        );
        return;
    };
    let bench = Bench::new();
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/upload_pyserial.py");
    // Another unit, at line rate and with a driver that does Xon/Xoff: what the manual's terminal program has.
    let unit = bench.world.start(&["emulate", "axtc4co", "--link", "u1", "--state", "s1"]);
    unit.wait_out("serial: ");
    let args = [client.display().to_string(), "u1".into(), "new.S".into(), "V1.2.0".into()];
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let ran = Running::start(bench.world.command_of(&PathBuf::from(python), &args)).wait();
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    assert_flash_holds(&bench.world.path("s1/flash.bin"), &bench.world.path("new.S"));
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
    let csv = world.run(&[&again[..], &["--format", "csv"]].concat(), b"");
    assert_eq!(csv.out.lines().count(), 228, "{}", csv.out);
    let bad = world.run(&["dictionary", "diff", "u1-nowhere.json", "factory:axtc4co"], b"");
    assert_eq!(bad.code, Some(2));
    assert!(bad.err.contains("cannot read the dump 'u1-nowhere.json'"), "{}", bad.err);
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
    assert_eq!(bench.run(&["stream", "--off", "--json"]).code, Some(0));

    let replay = ["report", "--out", "again.html", "--port", "replay:said.cast"];
    let ran = bench.world.run(&replay, b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
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
fn a_dry_run_says_that_the_image_is_for_another_unit() {
    let world = World::new();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/AXRTD8CO_V2.2.0.elf.S");
    let image = image.display().to_string();
    let ran = world.run(&["load", "--dry-run", "--port", "emu:axtc4co", &image], b"");
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    assert!(ran.err.contains("the image is for AXRTD8CO, the unit is an AXTC4CO"), "{}", ran.err);
}

#[test]
fn several_units_are_uploaded_to_at_once_and_one_that_fails_disturbs_none() {
    let world = World::new();
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "1500", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    fs::write(world.path("password"), "AXIO-2010").expect("written");
    let emulators: Vec<_> = ["u1", "u2"]
        .into_iter()
        .map(|link| {
            let emulator = world.start(&["emulate", "axtc4co", "--link", link]);
            emulator.wait_out("\n");
            emulator
        })
        .collect();
    let load = ["load", "new.S", "--yes", "--password-file", "password", "--port", "u1", "--port", "missing"];
    let ran = world.run(&[&load[..], &["--port", "u2"]].concat(), b"");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.out.contains("u1: done: the unit runs AXTC4CO V1.2.0"), "{}", ran.out);
    assert!(ran.out.contains("u2: done: the unit runs AXTC4CO V1.2.0"), "{}", ran.out);
    assert!(ran.err.contains("missing: axcon: cannot open missing") && ran.err.contains("2 of 3 units"), "{}", ran.err);
    let again = ["load", "new.S", "--yes", "--password-file", "password", "--pack", "--json"];
    let ran = world.run(&[&again[..], &["--port", "u1", "--port", "u2"]].concat(), b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let last = ran.out.lines().last().expect("a line");
    let summary: serde_json::Value = serde_json::from_str(last).expect("an object");
    assert_eq!((&summary["schema"], &summary["exit_code"]), (&"axcon.loads/1".into(), &0.into()));
    assert!(ran.out.lines().all(|line| line.starts_with("{\"schema\":\"axcon.")), "{}", ran.out);
    let ran = world.run(&["identify", "--port", "u1", "--port", "u2"], b"");
    assert_eq!(ran.code, Some(2), "what works on one unit says so: {}", ran.err);
    drop(emulators);
}

#[test]
fn an_upload_whose_reader_has_gone_is_finished_all_the_same() {
    let world = World::new();
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "1500", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    fs::write(world.path("password"), "AXIO-2010").expect("written");
    let emulator = world.start(&["emulate", "axtc4co", "--link", "u1"]);
    emulator.wait_out("\n");
    // `head` reads one line of progress and goes.
    let program = env!("CARGO_BIN_EXE_axcon");
    let line = format!("'{program}' load new.S --json --yes --password-file password --port u1 | head -1");
    let mut shell = world.command_of(std::path::Path::new("/bin/sh"), &["-c", &line]);
    assert!(shell.status().expect("a shell").success());
    let ran = world.run(&["identify", "--json", "--port", "u1"], b"");
    assert!(ran.out.contains("\"version\":\"1.2.0\""), "{}", ran.out);
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
fn older_software_than_what_runs_is_sent_when_that_is_wanted() {
    let bench = Bench::new();
    let older = ["image", "make", "--product", "axtc4co", "--version", "1.0.9", "--words", "600", "--out", "old.S"];
    assert_eq!(bench.world.run(&older, b"").code, Some(0));
    for dry in [&["--dry-run"][..], &[]] {
        let refused = bench.load("old.S", dry);
        assert_eq!(refused.code, Some(5), "{}", refused.err);
        assert!(refused.err.contains("older than the V1.1.0 that the unit runs"), "{}", refused.err);
        assert!(refused.err.contains("--allow downgrade"), "{}", refused.err);
    }
    assert_eq!(bench.version(), "1.1.0");
    let sent = bench.load("old.S", &["--allow", "downgrade"]);
    assert_eq!(sent.code, Some(0), "{}", sent.err);
    assert_eq!(bench.version(), "1.0.9");
}

/// In every second dialect the menu does not name the unit.
#[test]
fn a_unit_whose_menu_does_not_name_it_is_asked_for_its_product_code_before_an_upload() {
    let mut bench = Bench::new();
    bench.power_up_as("axtc4co", &["--dialect", "42"]);
    let planned = bench.load("new.S", &["--dry-run", "--json"]);
    assert_eq!(planned.code, Some(0), "{}", planned.err);
    let plan = json(&planned.out);
    assert_eq!((&plan["verdict"], &plan["product"]), (&"planned".into(), &"AXTC4CO".into()));
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("its object dictionary is asked"), "{}", ran.err);
}

#[test]
fn an_upload_that_nobody_answers_leaves_no_note_that_another_unit_would_be_judged_by() {
    let bench = Bench::new();
    let silent = crate::support::puppet::Puppet::silent();
    let link = bench.world.path("u1");
    std::os::unix::fs::symlink(silent.path(), &link).expect("a link");
    let args = ["load", "new.S", "--yes", "--password-file", "pw", "--port", "u1"];
    let ran = bench.world.run(&args, b"");
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    let notes = fs::read_to_string(bench.world.path("state/axcon/uploads.json")).unwrap_or_default();
    assert!(!notes.contains("u1"), "{notes}");
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
    let ran = world.run(&["emulate", "axtc4co", "--json"], b"status\n\xff\xfe\nfoo\nstatus\nquit\n");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let answers: Vec<Value> =
        objects(&ran.out).into_iter().filter(|object| object["schema"] == "axcon.emulate-answer/1").collect();
    let refused = answers.iter().filter(|answer| answer["ok"] == false && answer["unit"].is_null()).count();
    assert_eq!(refused, 2, "{}", ran.out);
}
