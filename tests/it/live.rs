//! The console on a terminal of its own, over a real port: what only the real program can show.

use std::fs;

use axcon::device::Product;

use crate::support::puppet::Puppet;
use crate::support::screen::Screen;
use crate::support::shell::World;
use crate::support::words::MENU;

const UP: &str = "\x1b[A";
const NEXT_SCREEN: &str = "\t";

fn console(world: &World, args: &[&str]) -> Screen {
    let mut all = vec!["--port", "emu:axtc4co"];
    all.extend(args);
    Screen::start(world.command(&all), 24, 80)
}

#[test]
fn a_newcomer_sees_the_scanner_talk_and_leaves_in_order() {
    let world = World::new();
    let mut screen = console(&world, &[]);
    // The menu comes line by line, and so do the facts.
    screen.wait("application runs");
    let overview = screen.wait("1.1.0 (");
    assert!(overview.contains("AXTC4CO") && overview.contains("application runs"), "{overview}");
    assert!(overview.contains("M menu  V view  D defaults  T stream  S diagnostics  L load"), "{overview}");
    screen.wait("Press T to switch its stream on.");
    screen.keys("t");
    screen.wait("Switch the data stream on");
    screen.keys("\x7f\x7f\x7f\x7f200\r");
    let values = screen.wait("every 200 ms");
    assert!(values.contains("TC4"), "{values}");
    // The raw text is always there.
    screen.keys(NEXT_SCREEN);
    screen.wait("; ");
    // Found wherever the rows have pushed it meanwhile.
    screen.keys("\x1d/now ON\r");
    screen.wait("RS-232 stream is now ON");
    screen.keys("\x1dq");
    let end = screen.wait_end();
    assert_eq!(end, Some(0));
    assert!(screen.is_given_back());
    let recordings = world.files("state/axcon/recordings");
    assert_eq!(recordings.len(), 1, "the session is recorded, unasked");
    let recording = fs::read_to_string(&recordings[0]).expect("a recording");
    assert!(recording.contains("Technologies"), "{recording}");
}

#[test]
fn an_upload_by_keys_ends_with_the_new_banner() {
    let world = World::new();
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "3000", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    // Another rate would be garbage; this one is the wire's, so the image is small.
    let screen = console(&world, &[]);
    screen.wait("application runs");
    screen.keys("l");
    screen.wait("new.S");
    screen.keys("p");
    screen.keys("new.S\r");
    let plan = screen.wait("Enter asks for the password");
    assert!(plan.contains("passed") && plan.contains("AXTC4CO 1.2.0 (newer)"), "{plan}");
    screen.keys("\r");
    screen.wait("Password for loading software");
    screen.keys("AXIO-2010\r");
    let verdict = screen.wait("── Verdict");
    assert!(verdict.contains("Done") && verdict.contains("1.2.0 afterwards"), "{verdict}");
    let recordings = world.files("state/axcon/recordings");
    assert_eq!(recordings.len(), 1, "{recordings:?}");
    let recording = fs::read_to_string(&recordings[0]).expect("a recording");
    assert!(recording.contains(r#","i","*********"]"#), "its place and length stay");
    assert!(!recording.contains("AXIO"));
}

#[test]
fn a_resize_and_a_terminal_too_small_are_taken_in_stride() {
    let world = World::new();
    let screen = console(&world, &[]);
    screen.wait("application runs");
    screen.resize(10, 40);
    let small = screen.wait("has 40 x 10.");
    assert!(small.contains("axcon needs 80 x 24 characters"), "{small}");
    screen.resize(60, 200);
    let large = screen.wait("application runs");
    assert!(large.lines().any(|line| line.chars().count() > 100), "the room is used:\n{large}");
}

#[test]
fn every_way_out_gives_the_terminal_back() {
    for signal in [rustix::process::Signal::TERM, rustix::process::Signal::HUP, rustix::process::Signal::INT] {
        let world = World::new();
        let mut screen = console(&world, &[]);
        screen.wait("application runs");
        screen.signal(signal);
        assert_eq!(screen.wait_end(), Some(130), "{signal:?}");
        assert!(screen.is_given_back(), "{signal:?}");
    }
}

#[test]
fn without_a_port_the_list_of_ports_comes_first_and_an_emulated_unit_is_a_key_away() {
    let world = World::new();
    let screen = Screen::start(world.command(&[]), 24, 80);
    let list = screen.wait("emu:axtc4co");
    assert!(list.contains("Emulated"), "{list}");
    screen.keys("p");
    screen.keys("nowhere\r");
    let failed = screen.wait("Not connected");
    assert!(failed.contains("nowhere"), "{failed}");
    // The cursor is on what asks for a name, right below the emulated units.
    let above = Product::all().iter().rev().position(|product| product.name == "AXTC4CO").expect("built in") + 1;
    screen.keys(&format!("\r{}", UP.repeat(above)));
    screen.wait("── Emulated AXTC4CO");
    screen.keys("\r");
    screen.wait("application runs");
}

#[test]
fn without_a_terminal_the_console_says_what_it_needs() {
    let world = World::new();
    let ran = world.run(&["--port", "emu:axtc4co"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("terminal") && ran.err.contains("--help"), "{}", ran.err);
    let ran = world.run(&["--port", "emu:axtc5co"], b"");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("axtc4co"), "what there is: {}", ran.err);
}

#[test]
fn a_recording_is_played_to_its_end_with_the_times_it_had() {
    let world = World::new();
    let head = "{\"version\":2,\"timestamp\":1769860800,\"axcon\":{\"schema\":\"axcon.recording/1\",\"begun_ms\":1769860800123,\"encoding\":\"latin-1\"}}";
    let menu = "AXTC4CO V1.1.0\\r\\nV - view object dictionary\\r\\nT - toggle stream\\r\\nS - diagnostics\\r\\n";
    let row = "  23.500;  24.125;Disabled;OpenCct ; -12.750\\r\\n";
    let events = format!(
        "[1.0,\"o\",\"{menu}\"]\n[2.0,\"i\",\"t\"]\n[3.0,\"o\",\"{row}\"]\n[60.0,\"m\",\"link lost\"]\n[3600.5,\"o\",\"{row}\"]\n"
    );
    fs::write(world.path("it.cast"), format!("{head}\n{events}")).expect("written");
    let mut command = world.command(&["--port", "replay:it.cast"]);
    command.env("TZ", "UTC");
    let mut screen = Screen::start(command, 24, 80);
    let overview = screen.wait("end of the recording");
    assert!(overview.contains("read only") && overview.contains("AXTC4CO 1.1.0"), "{overview}");
    assert!(overview.contains("-12.750") && overview.contains("newest 13:00:00"), "{overview}");
    screen.keys("t");
    screen.wait("Not sent: this is a recording.");
    screen.keys(NEXT_SCREEN);
    screen.wait("── link lost");
    screen.keys("\x1dw");
    screen.wait("13:00:00.623");
    screen.keys("\x1dq");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn a_cable_that_is_plugged_in_again_is_connected_by_itself() {
    let world = World::new();
    let link = world.path("unit");
    let first = silent_unit();
    std::os::unix::fs::symlink(first.path(), &link).expect("a link");
    let mut screen = Screen::start(world.command(&["--port", link.to_str().expect("UTF-8")]), 24, 80);
    screen.wait("application runs");
    drop(first);
    screen.wait("Plug the cable in again");
    fs::remove_file(&link).expect("pulled out");
    let second = silent_unit();
    std::os::unix::fs::symlink(second.path(), &link).expect("plugged in again");
    screen.wait("connected");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
    let recordings = world.files("state/axcon/recordings");
    assert_eq!(recordings.len(), 1, "one conversation, one recording");
    let recording = fs::read_to_string(&recordings[0]).expect("a recording");
    assert!(recording.contains("\"m\",\"link lost\"") && recording.contains("\"m\",\"link back as"), "{recording}");
}

/// A shell with job control whose foreground job is the console on a unit that says nothing by itself.
fn console_of_a_shell(world: &World, unit: &Puppet) -> Screen {
    let script = "set -m; \"$@\"; echo the shell is back; read line; fg; echo all over";
    let program = env!("CARGO_BIN_EXE_axcon");
    let args = ["-c", script, "sh", program, "--port", unit.port()];
    Screen::start(world.command_of(std::path::Path::new("/bin/sh"), &args), 24, 80)
}

/// Answers like a unit whose menu is asked for, and is silent else.
fn silent_unit() -> Puppet {
    Puppet::start(Box::new(|keys| if keys.contains(&b'm') { MENU.into() } else { Vec::new() }))
}

#[test]
fn ctrl_z_gives_the_terminal_back_and_fg_redraws_everything() {
    let (world, unit) = (World::new(), silent_unit());
    let mut screen = console_of_a_shell(&world, &unit);
    screen.wait("The unit is an AXTC4CO 1.1.0.");
    screen.keys("\x1a");
    screen.wait("the shell is back");
    assert!(screen.is_given_back(), "{}", screen.text());
    screen.keys("\r");
    // Nothing comes from the unit: only going on itself draws.
    screen.wait("application runs");
    assert!(!screen.is_as_the_shell_left_it());
    screen.keys("q");
    screen.wait("all over");
    assert_eq!(screen.wait_end(), Some(0));
    assert!(screen.is_given_back());
}

#[test]
fn ctrl_z_is_ignored_where_no_shell_could_continue_the_program() {
    let (world, unit) = (World::new(), silent_unit());
    let mut screen = Screen::start(world.command(&["--port", unit.port()]), 24, 80);
    screen.wait("The unit is an AXTC4CO 1.1.0.");
    screen.keys("\x1a");
    screen.keys("?");
    screen.wait("any other key");
    screen.keys("xq");
    assert_eq!(screen.wait_end(), Some(0));
    assert!(screen.is_given_back());
}

#[test]
fn a_program_that_was_stopped_from_outside_takes_its_screen_again() {
    let (world, unit) = (World::new(), silent_unit());
    let mut screen = Screen::start(world.command(&["--port", unit.port()]), 24, 80);
    screen.wait("The unit is an AXTC4CO 1.1.0.");
    screen.signal(rustix::process::Signal::STOP);
    screen.spoil();
    screen.signal(rustix::process::Signal::CONT);
    screen.wait("application runs");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn a_recording_that_finds_no_room_is_told_and_stays_told() {
    let world = World::new();
    let unit =
        Puppet::start(Box::new(|keys| if keys.contains(&b'm') { MENU.repeat(200).into_bytes() } else { Vec::new() }));
    // A file may not grow beyond some kB, as on a disk that is full.
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$@\"";
    let args = ["-c", script, "sh", env!("CARGO_BIN_EXE_axcon"), "--record", "r.cast", "--port", unit.port()];
    let mut screen = Screen::start(world.command_of(std::path::Path::new("/bin/sh"), &args), 24, 80);
    let shown = screen.wait("connected, not recorded");
    assert!(!shown.contains("rec "), "{shown}");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn a_hang_up_in_the_middle_of_the_dictionary_leaves_the_view() {
    for signal in [rustix::process::Signal::HUP, rustix::process::Signal::TERM] {
        let (world, unit) = (World::new(), silent_unit());
        let mut screen = Screen::start(world.command(&["--port", unit.port()]), 24, 80);
        screen.wait("The unit is an AXTC4CO 1.1.0.");
        screen.keys("v\r");
        screen.wait("reading the dictionary");
        screen.signal(signal);
        assert_eq!(screen.wait_end(), Some(130), "{signal:?}");
        let heard = unit.heard();
        let view = heard.iter().rposition(|&key| key == b'v').expect("the view was opened");
        assert!(heard[view..].contains(&b'x'), "{signal:?}: {:?}", String::from_utf8_lossy(&heard));
    }
}

#[test]
fn a_wire_broken_on_the_bench_is_an_open_circuit_in_the_stream() {
    let world = World::new();
    let screen = console(&world, &[]);
    screen.wait("application runs");
    screen.keys("t");
    screen.wait("Switch the data stream on");
    screen.keys("\x7f\x7f\x7f\x7f100\r");
    screen.wait("every 100 ms");
    screen.keys("9");
    screen.wait("of this emulated AXTC4CO");
    screen.keys("\x1b[B\x1b[B");
    screen.wait("› 3");
    screen.keys("\r451\r");
    screen.wait("451.0 °C");
    screen.keys("o");
    let bench = screen.wait("open circuit");
    assert!(bench.contains("broken") && bench.contains("open 3                        done"), "{bench}");
    screen.keys("/warm it up\r");
    screen.wait("Column 1: 'warm' is not known");
    screen.keys("\x03");
    screen.wait("refused: column 1");
    // A click on a tab.
    let column = bench.lines().nth(1).and_then(|tabs| tabs.find("6 Stream")).expect("a tab") + 2;
    screen.keys(&format!("\x1b[<0;{column};2M\x1b[<0;{column};2m"));
    let stream = screen.wait("Curve of CJ");
    assert!(stream.contains("open circuit"), "{stream}");
    screen.keys("e\x15rows.csv\r");
    screen.wait("rows written to rows.csv");
    screen.keys("e");
    screen.wait("rows are in rows.csv");
    let rows = fs::read_to_string(world.path("rows.csv")).expect("written");
    assert!(rows.starts_with("time,source,CJ,TC1,TC2,TC3,TC4\n") && rows.contains(",open,"), "{rows}");
    screen.keys("e\x15rows.csv\r");
    screen.wait("already exists");
    assert_eq!(fs::read_to_string(world.path("rows.csv")).expect("still there"), rows);
}

#[test]
fn recordings_are_listed_and_played_from_any_place() {
    let world = World::new();
    let first = console(&world, &[]);
    first.wait("application runs");
    first.keys("q");
    drop(first);
    let mut screen = Screen::start(world.command(&[]), 24, 80);
    screen.wait("recordings ...");
    screen.keys("8");
    screen.wait("1, newest first");
    screen.keys("\r");
    screen.wait("at its end");
    screen.keys("\x1b[H");
    let begun = screen.wait("paused");
    assert!(begun.contains("0:00 of "), "{begun}");
    screen.keys("2");
    screen.wait("nothing heard yet");
    screen.keys("8+++");
    screen.wait("at its end");
    screen.keys("2");
    screen.wait("application runs");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn arrows_that_are_pressed_quickly_move_a_recording_by_all_of_their_steps() {
    let world = World::new();
    let head = "{\"version\":2,\"timestamp\":1769860800,\"axcon\":{\"schema\":\"axcon.recording/1\",\"begun_ms\":1769860800123,\"encoding\":\"latin-1\"}}";
    let row = "  23.500;  24.125;Disabled;OpenCct ; -12.750\\r\\n";
    let rows: String = (0..=6000).map(|tenth| format!("[{}.{},\"o\",\"{row}\"]\n", tenth / 10, tenth % 10)).collect();
    fs::write(world.path("it.cast"), format!("{head}\n{rows}")).expect("written");
    let mut screen = Screen::start(world.command(&["--port", "replay:it.cast"]), 24, 80);
    screen.wait("end of the recording");
    screen.keys("8");
    screen.wait("at its end");
    // Each plays from the beginning, and none is there when the next one comes.
    screen.keys("\x1b[D\x1b[D\x1b[D");
    let there = screen.wait("9:30 of 10:00");
    assert!(there.contains("paused"), "{there}");
    screen.keys("2");
    screen.wait("newest ");
    screen.keys("8\x1b[C");
    screen.wait("9:40 of 10:00");
    screen.keys("q");
    assert_eq!(screen.wait_end(), Some(0));
}

#[test]
fn a_question_is_left_by_a_signal_and_by_ctrl_c_and_nothing_is_sent() {
    let world = World::new();
    let args = ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "400", "--out", "new.S"];
    assert_eq!(world.run(&args, b"").code, Some(0));
    std::thread::scope(|scope| {
        for (question, by_signal) in
            [("Type yes", true), ("Type yes", false), ("Password:", true), ("Password:", false)]
        {
            let world = &world;
            scope.spawn(move || {
                let mut screen = Screen::start(world.command(&["load", "--port", "emu:axtc4co", "new.S"]), 24, 80);
                screen.wait("Type yes");
                if question == "Password:" {
                    screen.keys("yes\r");
                    screen.wait(question);
                }
                if by_signal {
                    screen.signal(rustix::process::Signal::TERM);
                } else {
                    screen.keys("\x03");
                }
                assert_eq!(screen.wait_end(), Some(130), "{question}: {}", screen.text());
                assert!(screen.is_given_back(), "{question}");
                screen.wait("interrupted");
            });
        }
    });
}
