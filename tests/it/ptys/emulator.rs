//! The life of an emulator: its links, its verbs, its state, its end.

use std::fs;
use std::os::unix::fs::symlink;

use super::*;

#[test]
fn an_emulator_says_where_it_is_and_takes_its_link_along() {
    let world = World::new();
    let link = world.path("unit");
    symlink("/dev/pts/4711", &link).expect("a stale link");
    let emulator = world.start(&["emulate", "axtc4co", "--link", text(&link)]);
    let said = emulator.wait_out("\n");
    assert_eq!(said, format!("serial: {}\n", link.display()));
    assert!(fs::read_link(&link).expect("a link").starts_with("/dev/pts"));
    let ran = world.run(&["terminal", "--no-record", "--port", text(&link)], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    emulator.signal(Signal::TERM);
    let ran = emulator.wait();
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    assert!(fs::symlink_metadata(&link).is_err(), "the link is gone");
}

#[test]
fn an_emulator_ends_in_order_on_every_signal_and_on_its_verb() {
    for signal in [Some(Signal::INT), Some(Signal::HUP), None] {
        let world = World::new();
        let link = world.path("unit");
        let mut emulator = world.start(&["emulate", "axtc4co", "--link", text(&link)]);
        emulator.wait_out("serial: ");
        match signal {
            Some(signal) => emulator.signal(signal),
            None => emulator.input(b"quit\n"),
        }
        assert_eq!(emulator.wait().code, Some(0), "{signal:?}");
        assert!(fs::symlink_metadata(&link).is_err(), "{signal:?}");
    }
}

#[test]
fn an_emulator_goes_on_when_its_input_ends_and_answers_what_it_does_not_know() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co"]);
    let said = emulator.wait_out("\n");
    let port = said.trim().strip_prefix("serial: ").expect("a port");
    assert!(port.starts_with("/dev/pts/"), "{said}");
    emulator.input(b"help\npower off\npower on\nexplode\n");
    emulator.wait_err("'explode' is not known; there is: set, process, open");
    emulator.end_input();
    let ran = world.run(&["identify", "--no-record", "--port", port], b"");
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    emulator.signal(Signal::TERM);
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn help_is_an_object_too_where_objects_are_wanted() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co", "--json"]);
    emulator.wait_out("axcon.emulate/1");
    emulator.input(b"help\nhelp faults\n");
    emulator.wait_out(r#""verb":"help","ok":true,"said":"set N temperature C"#);
    emulator.wait_out(r#""verb":"help faults","ok":true,"said":""#);
    emulator.input(b"quit\n");
    let ran = emulator.wait();
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
}

/// The answers among the lines of an emulator.
fn answers(out: &str) -> Vec<serde_json::Value> {
    let objects = out.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("an object"));
    objects.filter(|object| object["schema"] == "axcon.emulate-answer/1").collect()
}

#[test]
fn every_verb_of_many_in_one_piece_is_carried_out_and_answered() {
    let world = World::new();
    let verbs: Vec<String> = (0..1_000).map(|celsius| format!("set 1 temperature {celsius}")).collect();
    let input = format!("{}\nquit\n", verbs.join("\n"));
    let ran = world.run(&["emulate", "axtc4co", "--json"], input.as_bytes());
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    let told = answers(&ran.out);
    assert!(told.iter().all(|answer| answer["ok"] == true), "{}", ran.out);
    let told: Vec<&str> = told.iter().map(|answer| answer["verb"].as_str().expect("a line")).collect();
    assert_eq!(told, verbs);

    let input = format!("{}quit\n", "all status\n".repeat(100));
    let ran = world.run(&["emulate", "axtc4co", "--count", "8", "--json"], input.as_bytes());
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    let mut by_unit = [0; 8];
    for answer in answers(&ran.out) {
        assert_eq!(answer["ok"], true, "{answer}");
        by_unit[answer["unit"].as_u64().expect("a number") as usize - 1] += 1;
    }
    assert_eq!(by_unit, [100; 8]);
}

#[test]
fn an_answer_names_the_unit_that_the_verb_was_for() {
    let world = World::new();
    let input = b"status\n2 status\n1 set 1 temperature nan\n2 explode\nexplode\n3 status\nhelp\nquit\n";
    let ran = world.run(&["emulate", "axtc4co", "axrtd8co", "--json"], input);
    let units: Vec<Option<u64>> = answers(&ran.out).iter().map(|answer| answer["unit"].as_u64()).collect();
    assert_eq!(units, [Some(1), Some(2), Some(1), Some(2), None, None, None], "{}", ran.out);
}

#[test]
fn verbs_and_scenarios_do_to_a_unit_what_they_say() {
    let world = World::new();
    fs::write(
        world.path("day.toml"),
        "product = 'axtc4co'\n[[at]]\nseconds = 0\ndo = ['set 2 temperature 77.5', 'write 6112:4 0']\n",
    )
    .expect("written");
    let mut emulator = world.start(&["emulate", "axtc4co", "axrtd8co", "--scenario", "day.toml"]);
    emulator.wait_out("serial: ");
    // A unit answers nobody in its first moments.
    thread::sleep(Duration::from_millis(200));
    emulator.input(b"set 1 temperature 250\n2 set 3 resistance 100\n");
    emulator.input(b"all status\n1 write 6126:1 18.0\n1 read 6126:1\n2 read 3000:1\n2 write 3000:1 7\n");
    // Each unit answers in its own time.
    for said in ["1: AXTC4CO runs", "2: AXRTD8CO runs", "1: 6126:01 = 18.0", "2: 3000:01 = 1 (IEC 0.00385)"] {
        emulator.wait_out(said);
    }
    emulator.wait_err("2: 3000:01 <- 7: the value is above the high limit (abort 06090031h)");
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_scenario_that_cannot_be_played_is_refused_with_every_fault() {
    let world = World::new();
    fs::write(world.path("bad.toml"), "[[at]]\nseconds = 1\ndo = ['opne 3']\n[[at]]\nseconds = -2\ndo = []\n")
        .expect("written");
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "bad.toml"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    for complaint in ["bad.toml:3:8: at.do: 'opne' is not known", "bad.toml:5:11: at.seconds: -2 is not 0 to 604800"] {
        assert!(ran.err.contains(complaint), "{}", ran.err);
    }
    let hot = "[[at]]\nseconds = 1\ndo = ['set 1 temperature 5000']\n\
               [[ramp]]\nfrom=1\nto=2\nwhat='supply'\nstart=0\nend=2000";
    fs::write(world.path("hot.toml"), hot).expect("written");
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "hot.toml"], b"");
    assert_eq!(ran.code, Some(2), "what no product could take: {}", ran.err);
    for complaint in ["hot.toml:3:8: at.do: a temperature cannot be 5000", "hot.toml:9:5: ramp.end: a supply cannot"] {
        assert!(ran.err.contains(complaint), "{}", ran.err);
    }
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "nowhere.toml"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("cannot read the scenario 'nowhere.toml'"), "{}", ran.err);
}

#[test]
fn an_emulator_leaves_a_real_file_alone() {
    let world = World::new();
    fs::write(world.path("unit"), "mine").expect("a file");
    let ran = world.run(&["emulate", "axtc4co", "--link", "unit"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("'unit' exists and is a file; it is left as it is"), "{}", ran.err);
    assert_eq!(fs::read(world.path("unit")).expect("still there"), b"mine");
}

#[test]
fn an_emulator_leaves_a_link_that_leads_elsewhere_alone_even_if_nothing_is_there() {
    let world = World::new();
    symlink("/mnt/nas/thing", world.path("unit")).expect("a link");
    let ran = world.run(&["emulate", "axtc4co", "--link", "unit"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("'unit' exists and is a link to '/mnt/nas/thing'"), "{}", ran.err);
    assert_eq!(fs::read_link(world.path("unit")).expect("still there"), Path::new("/mnt/nas/thing"));
}

#[test]
fn an_emulator_leaves_the_link_of_a_running_one_alone_and_takes_that_of_a_killed_one() {
    let world = World::new();
    let args = ["emulate", "axtc4co", "--link", "unit"];
    let first = world.start(&args);
    first.wait_out("serial: ");
    let port = fs::read_link(world.path("unit")).expect("a link");
    let second = world.run(&args, b"");
    assert_eq!(second.code, Some(1), "{}", second.err);
    assert!(second.err.contains("'unit' exists and is the port of a unit that axcon (process "), "{}", second.err);
    assert_eq!(fs::read_link(world.path("unit")).expect("still there"), port);
    first.signal(Signal::KILL);
    first.wait();
    let third = world.start(&args);
    third.wait_out("serial: ");
    third.signal(Signal::TERM);
    assert_eq!(third.wait().code, Some(0));
}

#[test]
fn several_units_have_several_ports() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co", "AXTC4CO", "--link", "unit", "--json"]);
    let said = emulator.wait_out("unit-2");
    let first: serde_json::Value = serde_json::from_str(said.lines().next().expect("a line")).expect("an object");
    assert_eq!(first["schema"], "axcon.emulate/1");
    assert_eq!((&first["product"], &first["serial"]), (&"AXTC4CO".into(), &"unit".into()));
    for link in ["unit", "unit-2"] {
        assert!(fs::read_link(world.path(link)).expect("a link").starts_with("/dev/pts"), "{link}");
    }
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_state_directory_is_kept_and_belongs_to_one_emulator() {
    let world = World::new();
    let emulator = world.start(&["emulate", "axtc4co", "--state", "state-of-unit"]);
    emulator.wait_out("serial: ");
    assert_eq!(fs::metadata(world.path("state-of-unit/flash.bin")).expect("flash").len(), 131_072);
    let second = world.run(&["emulate", "axtc4co", "--state", "state-of-unit"], b"");
    assert_eq!(second.code, Some(1));
    assert!(second.err.contains("is in use by another emulator"), "{}", second.err);
    emulator.signal(Signal::TERM);
    assert_eq!(emulator.wait().code, Some(0));

    fs::write(world.path("state-of-unit/flash.bin"), "short").expect("spoilt");
    fs::write(world.path("state-of-unit/parameters.bin"), [7; 4096]).expect("spoilt");
    let third = world.start(&["emulate", "axtc4co", "--state", "state-of-unit"]);
    third.wait_out("serial: ");
    let said = third.wait_err("parameters.bin.damaged-1");
    assert!(said.contains("flash.bin' cannot be used: it has 5 bytes"), "{said}");
    assert!(said.contains("kept as 'state-of-unit/flash.bin.damaged-1'"), "{said}");
    assert_eq!(fs::read(world.path("state-of-unit/flash.bin.damaged-1")).expect("kept"), b"short");
    third.signal(Signal::TERM);
    assert_eq!(third.wait().code, Some(0));

    fs::write(world.path("state-of-unit/parameters.bin"), "").expect("emptied");
    let fourth = world.start(&["emulate", "axtc4co", "--state", "state-of-unit"]);
    fourth.wait_out("serial: ");
    fourth.wait_err("parameters.bin' cannot be used: it is empty");
    fourth.signal(Signal::TERM);
    assert_eq!(fourth.wait().code, Some(0));

    let other = world.run(&["emulate", "axrtd8co", "--state", "state-of-unit"], b"");
    assert_eq!(other.code, Some(1));
    assert!(other.err.contains("is of AXTC4CO, not of AXRTD8CO"), "{}", other.err);
}

#[test]
fn a_fault_on_the_command_line_cuts_an_upload_off_and_the_next_one_saves_the_unit() {
    let world = World::new();
    fs::write(world.path("pw"), "AXIO-2010\n").expect("written");
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "2000", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    let fault = "power-cut at record 40 for 0.3";
    let mut emulator = world.start(&["emulate", "axtc4co", "--link", "unit", "--loader", "g2", "--fault", fault]);
    emulator.wait_out("serial: unit");
    let load = ["load", "new.S", "--yes", "--password-file", "pw", "--product", "axtc4co", "--port", "unit"];
    let cut_off = world.run(&load, b"");
    assert_eq!(cut_off.code, Some(7), "{}{}", cut_off.out, cut_off.err);
    let saved = world.run(&load, b"");
    assert_eq!(saved.code, Some(0), "{}{}", saved.out, saved.err);
    assert!(saved.err.contains("1.2.0") || saved.out.contains("1.2.0"), "{}{}", saved.out, saved.err);
    emulator.input(b"quit\n");
    assert_eq!(emulator.wait().code, Some(0));
}

#[test]
fn a_pulled_cable_hangs_up_and_comes_back_as_another_port_under_the_same_link() {
    let world = World::new();
    let mut emulator = world.start(&["emulate", "axtc4co", "--link", "unit", "--json"]);
    emulator.wait_out("\"unit\":1");
    let first = fs::read_link(world.path("unit")).expect("a link");
    let (_connection, received) = connect(&world.path("unit"), 115_200);
    emulator.input(b"unplug\nstatus\n");
    emulator.wait_out("its cable is out");
    while !matches!(received.recv_timeout(PATIENCE).expect("a hang-up"), Input::Gone { .. }) {}
    assert!(!first.exists(), "the port is gone");
    // Its number may be another port's soon, and what opens the link must not open that.
    wait_until("the link goes", || fs::symlink_metadata(world.path("unit")).is_err());
    emulator.input(b"plug\n");
    wait_until("the link follows", || fs::read_link(world.path("unit")).is_ok_and(|target| target != first));
    let ran = world.run(&["identify", "--json", "--port", "unit"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("AXTC4CO"), "{}", ran.out);
    emulator.input(b"quit\n");
    let ended = emulator.wait();
    assert_eq!(ended.out.matches("axcon.emulate/1").count(), 2, "{}", ended.out);
    assert!(fs::symlink_metadata(world.path("unit")).is_err(), "the link goes with the emulator");
}

#[test]
fn a_fault_that_is_none_is_refused_with_its_column() {
    let world = World::new();
    let ran = world.run(&["emulate", "axtc4co", "--fault", "lost to-unit at bite 5"], b"");
    assert_eq!(ran.code, Some(2));
    let complaint = "--fault 'lost to-unit at bite 5': column 17: 'bite' is not known; there is: byte";
    assert!(ran.err.contains(complaint), "{}", ran.err);
}

#[test]
fn an_emulated_link_needs_no_port() {
    let world = World::new();
    let ran = world.run(&["terminal", "--no-record", "--port", "emu:axtc4co"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}
