//! `load`: what is sent, what is refused, and what is said of the unit afterwards.

use rustix::process::Signal;

use super::*;
use crate::support::foreign::python;
use crate::support::puppet::Puppet;
use crate::support::screen::Screen;

/// What is said of a unit behind a link that is gone in the middle of a file.
const GONE: &str = "the unit is in its loader, or without power; see that it has power";
/// What is said of a unit that has fallen silent in the middle of a file.
const SILENT: &str = "the unit is silent: in its loader, or without power; see that it has power";

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
    let recordings = bench.world.files("state/axcon/recordings");
    let texts: Vec<String> = recordings.iter().map(|path| fs::read_to_string(path).expect("a recording")).collect();
    assert!(texts.iter().all(|text| !text.contains("AXIO")), "{texts:?}");
    let uploads = texts.iter().filter(|text| text.contains(r#","i","*********"]"#)).count();
    assert_eq!((recordings.len(), uploads), (3, 1), "two questions, and one upload with its password: {texts:?}");
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
    // What is said before the unit is known to be the right one agrees with what is sent then.
    assert_eq!(phases.iter().filter(|phase| **phase == "check").count(), 1, "{phases:?}");
    assert_eq!((phases[0], &progress[0]["record"]), ("check", &0.into()));
    assert_eq!(progress[0]["records"], verdict["records_total"]);
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
    assert!(verdict["next"].as_str().is_some_and(|next| next.starts_with(GONE)), "{verdict}");

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
fn a_unit_that_loses_its_power_in_the_middle_is_not_said_to_wait_in_its_loader() {
    let mut bench = Bench::with_image("12000");
    let mut command = vec!["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"];
    command.extend(FAST);
    let loading = bench.world.start(&command);
    loading.wait_out(r#""phase":"transfer","record":2"#);
    bench.unit.as_mut().expect("it runs").input(b"power off\n");
    let ran = loading.wait();
    assert_eq!(ran.code, Some(7), "{}\n{}", ran.out, ran.err);
    let verdict = json(ran.out.lines().last().expect("a verdict"));
    assert_eq!((&verdict["verdict"], &verdict["unit"]), (&"failed".into(), &"loader".into()), "{verdict}");
    assert!(verdict["next"].as_str().is_some_and(|next| next.starts_with(SILENT)), "{verdict}");
}

#[test]
fn a_loader_that_complains_in_the_middle_and_says_no_more_leaves_a_unit_of_which_nobody_knows() {
    let world = World::new();
    fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
    let make = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "600", "--out", "new.S"];
    assert_eq!(world.run(&make, b"").code, Some(0));
    let (mut heard, mut is_over) = (Vec::new(), false);
    let unit = Puppet::start(Box::new(move |bytes| {
        heard.extend_from_slice(bytes);
        let records = heard.windows(2).filter(|pair| **pair == *b"S3").count();
        match records {
            0 if bytes.contains(&b'm') => b"\r\nWaiting for application S-Record.\r\n".to_vec(),
            8.. if !is_over => {
                is_over = true;
                b"\r\nTransfer aborted: reason 6\r\n".to_vec()
            }
            _ => Vec::new(),
        }
    }));
    let load = ["load", "new.S", "--yes", "--password-file", "pw", "--product", "axtc4co", "--json"];
    let ran = world.run(&[&load[..], &["--port", unit.port()]].concat(), b"");
    assert_eq!(ran.code, Some(8), "{}{}", ran.out, ran.err);
    let verdict = json(ran.out.lines().last().expect("a verdict"));
    assert_eq!((&verdict["verdict"], &verdict["unit"]), (&"failed".into(), &"unknown".into()), "{verdict}");
    assert!(verdict["records"].as_u64() < verdict["records_total"].as_u64(), "in the middle: {verdict}");
    assert!(verdict["what"].as_str().is_some_and(|what| what.contains("Transfer aborted: reason 6")), "{verdict}");
}

/// A second program in the file, at addresses that the loader folds onto the first.
#[test]
fn a_unit_that_runs_something_else_than_the_file_says_is_9() {
    let bench = Bench::new();
    let make = ["image", "make", "--product", "axtc4co", "--version", "1.3.0", "--words", "320", "--out", "second.S"];
    assert_eq!(bench.world.run(&make, b"").code, Some(0));
    let lines = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(bench.world.path(name)).expect("an image");
        text.lines().map(str::to_owned).collect()
    };
    let beyond = |line: &String| {
        let (length, rest) = line.strip_prefix("S3")?.split_at_checked(2)?;
        let (data, sum) = rest.strip_prefix("0000")?.split_at_checked(rest.len() - 6)?;
        // One more in the address is one less in the checksum.
        let sum = u8::from_str_radix(sum, 16).expect("digits").wrapping_sub(1);
        Some(format!("S3{length}0001{data}{sum:02X}"))
    };
    let mut both = lines("new.S");
    let end = both.pop().expect("the end record");
    both.extend(lines("second.S").iter().filter_map(beyond));
    both.push(end);
    fs::write(bench.world.path("both.S"), both.join("\r\n") + "\r\n").expect("written");
    let ran = bench.load("both.S", &["--allow", "out-of-range", "--json"]);
    assert_eq!(ran.code, Some(9), "{}{}", ran.out, ran.err);
    let verdict = json(ran.out.lines().last().expect("a verdict"));
    assert_eq!(
        (&verdict["verdict"], &verdict["unit"]),
        (&"wrong-application".into(), &"application".into()),
        "{verdict}"
    );
    assert_eq!((&verdict["version_after"], bench.version()), (&"1.3.0".into(), "1.3.0".into()), "{verdict}");
}

#[test]
fn a_unit_found_in_its_loader_is_not_sent_anything_before_somebody_says_what_it_is() {
    let bench = Bench::left_in_loader();
    // Another computer, where nobody knows of the first attempt.
    fs::remove_file(bench.world.path("state/axcon/uploads.json")).expect("the note");
    let ran = bench.load("new.S", &[]);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("--product"), "{}", ran.err);
    let ran = bench.load("new.S", &["--product", "axtc4co"]);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}

/// What the unit said of itself before it was left in its loader counts more than what somebody says of it afterwards.
#[test]
fn a_product_that_contradicts_the_note_is_refused_and_no_failure_rewrites_the_note() {
    let bench = Bench::left_in_loader();
    let other =
        ["image", "make", "--product", "axrtd8co", "--version", "1.2.0", "--words", "12000", "--out", "other.S"];
    assert_eq!(bench.world.run(&other, b"").code, Some(0));
    let journal = bench.world.path("state/axcon/uploads.json");
    let before = fs::read_to_string(&journal).expect("the note");
    for more in [&["--product", "axrtd8co"][..], &["--product", "axrtd8co", "--dry-run"]] {
        let refused = bench.load("other.S", more);
        assert_eq!(refused.code, Some(5), "{}", refused.err);
        let said = "the unit is an AXTC4CO, not an AXRTD8CO: so says the note of the upload of 'new.S'";
        assert!(refused.err.contains(said) && refused.err.contains("--allow wrong-product"), "{}", refused.err);
    }
    for more in [&[][..], &["--dry-run"]] {
        let refused = bench.load("other.S", more);
        assert_eq!(refused.code, Some(5), "{}", refused.err);
        assert!(refused.err.contains("--product NAME --allow wrong-product"), "{}", refused.err);
    }
    assert_eq!(fs::read_to_string(&journal).expect("the note"), before);

    // Somebody is sure that the note is wrong, and is not right.
    let failed = bench.load("other.S", &["--product", "axrtd8co", "--allow", "wrong-product"]);
    assert_ne!(failed.code, Some(0), "{}", failed.err);
    let after = fs::read_to_string(&journal).expect("the note");
    assert!(after.contains("AXTC4CO") && after.contains("new.S") && !after.contains("AXRTD8CO"), "{after}");
    let saved = bench.load("new.S", &[]);
    assert_eq!(saved.code, Some(0), "{}", saved.err);
    assert_eq!(bench.version(), "1.2.0");
}

#[test]
fn older_software_than_what_ran_before_an_interrupted_upload_is_sent_only_if_it_is_wanted() {
    let bench = Bench::left_in_loader();
    let older = ["image", "make", "--product", "axtc4co", "--version", "1.0.9", "--words", "600", "--out", "old.S"];
    assert_eq!(bench.world.run(&older, b"").code, Some(0));
    for more in [&[][..], &["--dry-run"], &["--product", "axtc4co"]] {
        let refused = bench.load("old.S", more);
        assert_eq!(refused.code, Some(5), "{}", refused.err);
        assert!(refused.err.contains("older than the V1.1.0 that the unit ran before"), "{}", refused.err);
        assert!(refused.err.contains("--allow downgrade"), "{}", refused.err);
    }
    // Where nobody knows what it ran, that is said.
    let journal = bench.world.path("state/axcon/uploads.json");
    fs::remove_file(journal).expect("the note");
    let planned = bench.load("old.S", &["--dry-run", "--product", "axtc4co"]);
    assert_eq!(planned.code, Some(0), "{}", planned.err);
    assert!(planned.err.contains("which version the unit ran is not known"), "{}", planned.err);
}

#[test]
fn a_note_that_is_wrong_is_overridden_by_whoever_says_so() {
    let bench = Bench::left_in_loader();
    let journal = bench.world.path("state/axcon/uploads.json");
    let note = fs::read_to_string(&journal).expect("the note").replace("AXTC4CO", "AXRTD8CO");
    fs::write(&journal, note).expect("written");
    assert_eq!(bench.load("new.S", &["--product", "axtc4co"]).code, Some(5));
    let sent = bench.load("new.S", &["--product", "axtc4co", "--allow", "wrong-product"]);
    assert_eq!(sent.code, Some(0), "{}", sent.err);
    let notes = fs::read_to_string(&journal).expect("the journal");
    assert!(!notes.contains("AXRTD8CO"), "{notes}");
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
    let again = bench.load("new.S", &["--json"]);
    assert_eq!(again.code, Some(0), "{}{}", again.out, again.err);
    // The loader cannot say it, the note of the first one does.
    let verdict = json(again.out.lines().last().expect("a verdict"));
    assert_eq!(
        (&verdict["version_before"], &verdict["version_after"]),
        (&"1.1.0".into(), &"1.2.0".into()),
        "{verdict}"
    );
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
    assert!(ran.out.contains("plan ") && ran.out.contains("AXTC4CO V1.2.0"), "{}", ran.out);
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
fn a_large_file_that_is_no_image_is_told_with_its_whole_size() {
    let world = World::new();
    fs::write(world.path("zeros"), vec![0; 3_000_000]).expect("written");
    let ran = world.run(&["image", "info", "zeros"], b"");
    assert!(ran.out.contains("3,000,000 bytes"), "{}{}", ran.out, ran.err);
    let ran = world.run(&["image", "check", "zeros", "--json"], b"");
    assert_eq!(json(&ran.out)["size"], 3_000_000, "{}", ran.err);
}

#[test]
fn a_client_nobody_here_wrote_uploads_into_the_emulator() {
    let Some(python) = python("client", "pyserial") else { return };
    let bench = Bench::new();
    let client = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/upload_pyserial.py");
    // Another unit, at line rate and with a driver that does Xon/Xoff: what the manual's terminal program has.
    let unit = bench.world.start(&["emulate", "axtc4co", "--link", "u1", "--state", "s1"]);
    unit.wait_out("serial: ");
    let args = [client.display().to_string(), "u1".into(), "new.S".into(), "V1.2.0".into()];
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let ran = Running::start(bench.world.command_of(&python, &args)).wait();
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    assert_flash_holds(&bench.world.path("s1/flash.bin"), &bench.world.path("new.S"));
}

#[test]
fn a_dry_run_says_that_the_image_is_for_another_unit() {
    let world = World::new();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/AXRTD8CO_V2.2.0.elf.S");
    let image = image.display().to_string();
    let ran = world.run(&["load", "--dry-run", "--port", "emu:axtc4co", &image], b"");
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    assert!(ran.err.contains("the image is for AXRTD8CO, the unit is an AXTC4CO"), "{}", ran.err);
    // Its loader leaves old words where the checksum wants erased ones: it would wait for a file for ever.
    let gap = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware_images/odd/gap.elf.S").display().to_string();
    let plan = |more: &[&str]| {
        world.run(&[&["load", "--dry-run", "--port", "emu:axtc4co", &gap, "--allow", "downgrade"], more].concat(), b"")
    };
    let ran = plan(&[]);
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    assert!(ran.err.contains("no record writes 0x00D0 to 0x00DF") && ran.err.contains("--allow gap"), "{}", ran.err);
    assert_eq!([plan(&["--allow", "gap"]).code, plan(&["--loader", "g3"]).code], [Some(0), Some(0)]);
}

#[test]
fn a_plan_of_long_records_counts_those() {
    let bench = Bench::new();
    let plan = |more: &[&str]| {
        let ran = bench.run(&[&["load", "new.S", "--dry-run"], more].concat());
        let (_, plan) = ran.out.split_once("send ").expect("a plan");
        let (characters, rest) = plan.split_once(" characters").expect("their number");
        assert!(characters.contains(','), "thousands are apart: {characters}");
        (characters.replace(',', "").parse::<u32>().expect("a number"), rest.to_owned())
    };
    let ((own, _), (packed, rest)) = (plan(&[]), plan(&["--pack"]));
    assert!(packed * 10 < own * 9, "{packed} of {own}");
    assert!(rest.starts_with(" in 34 records"), "8000 bytes, 250 in each, header and end: {rest}");
}

#[test]
fn the_error_of_one_of_several_units_says_which() {
    let bench = Bench::new();
    let args = ["load", "new.S", "--dry-run", "--json", "--port", "no1", "--port", "no2"];
    let ran = bench.world.run(&args, b"");
    let ports: Vec<Value> = objects(&ran.err).iter().map(|error| error["port"].clone()).collect();
    assert_eq!((ran.code, ports), (Some(3), vec!["no1".into(), "no2".into()]), "{}", ran.err);
}

#[test]
fn how_an_upload_has_ended_is_said_also_if_there_is_no_room_for_it() {
    let bench = Bench::new();
    let program = env!("CARGO_BIN_EXE_axcon");
    let line = format!("'{program}' load new.S --yes --password-file pw --port u0 --baud 3000000 > /dev/full");
    let ran = Running::start(bench.world.command_of(Path::new("/bin/sh"), &["-c", &line])).wait();
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("axcon: done: ") && ran.err.contains("standard output"), "{}", ran.err);
}

#[test]
fn a_note_that_could_not_be_made_does_not_stay() {
    let bench = Bench::new();
    let mut args = vec!["load", "new.S", "--yes", "--password-file", "pw", "--no-record", "--port", "u0"];
    args.extend(FAST);
    let mut command = bench.world.command(&args);
    // A file, so no folder can be made in it.
    command.env("XDG_STATE_HOME", bench.world.path("pw"));
    let ran = Running::start(command).wait();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains("this upload is not noted") && !ran.err.contains("stays"), "{}", ran.err);
}

#[test]
fn a_password_comes_from_standard_input_and_the_image_does_not_at_the_same_time() {
    let bench = Bench::new();
    let mut args = vec!["load", "new.S", "--yes", "--password-file", "-", "--port", "u0"];
    args.extend(FAST);
    let ran = bench.world.run(&args, b"AXIO-2010\n");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let ran = bench.world.run(&args, b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("standard input is empty"), "{}", ran.err);
    args[1] = "-";
    let ran = bench.world.run(&args, b"AXIO-2010\n");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("cannot both"), "{}", ran.err);
    assert_eq!(bench.version(), "1.2.0");
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
    // Two writers would spoil one recording.
    let ran = world.run(&[&again[..], &["--port", "u1", "--port", "u2", "--record", "both.cast"]].concat(), b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("several units cannot be recorded to one file, both.cast"), "{}", ran.err);
    // Behind the command, --port takes the place of the one before it; a unit would be left without its software.
    let apart = [&["--port", "u1"], &again[..], &["--port=u2"]].concat();
    let ran = world.run(&apart, b"");
    assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""), "{}", ran.err);
    assert!(ran.err.contains("--port is given both before the command and after it"), "{}", ran.err);
    // One that is not there keeps nobody from looking at the others.
    let dry = ["load", "new.S", "--dry-run", "--port", "u1", "--port", "missing", "--port", "u2"];
    let ran = world.run(&dry, b"");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.out.contains("unit   u1: ") && ran.out.contains("unit   u2: "), "{}", ran.out);
    assert!(ran.err.contains("cannot open missing") && ran.err.ends_with("2 of 3 units can take it\n"), "{}", ran.err);
    let ran = world.run(&[&dry[..], &["--json"]].concat(), b"");
    let objects = objects(&ran.out);
    let schemas: Vec<&str> = objects.iter().filter_map(|object| object["schema"].as_str()).collect();
    assert_eq!(schemas, ["axcon.load/1", "axcon.load/1", "axcon.loads/1"], "{}", ran.out);
    assert_eq!(objects[2]["units"][1], serde_json::json!({"port": "missing", "exit_code": 3}));
    drop(emulators);
}

#[test]
fn a_port_and_a_link_to_it_are_one_port_named_twice() {
    let bench = Bench::new();
    let device = fs::canonicalize(bench.world.path("u0")).expect("a device").display().to_string();
    let ran = bench.load("new.S", &["--port", &device]);
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("are the same port") && !ran.err.contains("in use"), "{}", ran.err);
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
fn older_software_than_what_runs_is_sent_when_that_is_wanted() {
    let bench = Bench::new();
    let older = ["image", "make", "--product", "axtc4co", "--version", "1.0.9", "--words", "600", "--out", "old.S"];
    assert_eq!(bench.world.run(&older, b"").code, Some(0));
    for dry in [&["--dry-run"][..], &[]] {
        let refused = bench.load("old.S", dry);
        assert_eq!(refused.code, Some(5), "{}", refused.err);
        assert!(refused.err.contains("older than the V1.1.0 that the unit runs"), "{}", refused.err);
        assert!(refused.err.contains("--allow downgrade"), "{}", refused.err);
        let refused = bench.load("old.S", &[dry, &["--json"]].concat());
        let report = json(refused.out.lines().last().expect("a report"));
        assert_eq!((refused.code, &report["schema"]), (Some(5), &"axcon.load/1".into()), "{}", refused.err);
        assert_eq!((&report["verdict"], &report["unit"]), (&"refused".into(), &"application".into()), "{report}");
        assert_eq!(report["defects"][0]["id"], "downgrade", "{report}");
        assert!(report["records_total"].as_u64() > Some(10), "{report}");
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
fn a_units_object_dictionary_is_not_read_before_an_upload_unless_the_user_agrees() {
    let mut bench = Bench::new();
    bench.power_up_as("axtc4co", &["--dialect", "42"]);
    // It says its name at power-up, which the first client hears.
    bench.run(&["identify"]);
    let mut args = vec!["load", "new.S", "--password-file", "pw", "--record", "it.cast", "--port", "u0"];
    args.extend(FAST);
    let mut screen = Screen::start(bench.world.command(&args), 24, 200);
    screen.wait("may halt scanning and CAN. Type yes: ");
    screen.keys("no\r");
    screen.wait("--product NAME");
    assert_eq!(screen.wait_end(), Some(2));
    let recording = fs::read_to_string(bench.world.path("it.cast")).expect("a recording");
    let sent: Vec<&str> = recording.lines().filter(|line| line.contains(r#","i","#)).collect();
    assert!(!sent.is_empty(), "{recording}");
    assert!(!sent.iter().any(|line| line.to_lowercase().contains(r#""v""#)), "{sent:?}");
}

#[test]
fn an_upload_that_nobody_answers_leaves_no_note_that_another_unit_would_be_judged_by() {
    let bench = Bench::new();
    let silent = Puppet::silent();
    let link = bench.world.path("u1");
    std::os::unix::fs::symlink(silent.path(), &link).expect("a link");
    let args = ["load", "new.S", "--yes", "--password-file", "pw", "--port", "u1"];
    let ran = bench.world.run(&args, b"");
    assert_eq!(ran.code, Some(4), "{}", ran.err);
    let notes = fs::read_to_string(bench.world.path("state/axcon/uploads.json")).unwrap_or_default();
    assert!(!notes.contains("u1"), "{notes}");
}

#[test]
fn what_a_killed_upload_has_left_is_said_by_whoever_identifies_the_unit() {
    let bench = Bench::new();
    let loading = bench.world.start(&["load", "new.S", "--yes", "--password-file", "pw", "--json", "--port", "u0"]);
    loading.wait_out(r#""phase":"transfer""#);
    loading.signal(Signal::KILL);
    loading.wait();
    let said = "an upload of new.S to the AXTC4CO on this port has not ended well";
    let left = bench.run(&["identify", "--json"]);
    assert!(left.err.contains(said), "{}", left.err);
    // The image of the note need not be one for this unit.
    assert!(left.err.contains("with an image made for the AXTC4CO brings it back"), "{}", left.err);
    let noted = serde_json::json!({"product": "AXTC4CO", "image": "new.S"});
    assert_eq!(json(&left.out)["unfinished_upload"], noted, "{}", left.out);
    assert_eq!(bench.load("new.S", &[]).code, Some(0));
    let saved = bench.run(&["identify", "--json"]);
    assert_eq!((saved.code, saved.err.as_str()), (Some(0), ""));
    assert!(json(&saved.out)["unfinished_upload"].is_null(), "{}", saved.out);
}
