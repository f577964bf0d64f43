//! Recordings: every byte in them, whatever ends the program, the password never; and every reading command on them.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use axcon::record::{Direction, Ending, Piece, Reader};

use crate::support::puppet::Puppet;
use crate::support::shell::{PATIENCE, World};

/// What a recording holds, and how it ends.
fn read(path: &Path) -> (Vec<Piece>, Ending) {
    let text = fs::read(path).expect("a recording");
    let mut reader = Reader::default();
    let mut pieces = Vec::new();
    reader.push(&text, |piece| pieces.push(piece)).expect("a sound recording");
    let ending = reader.finish(|piece| pieces.push(piece)).expect("a recording");
    (pieces, ending)
}

fn bytes(pieces: &[Piece], wanted: Direction) -> Vec<u8> {
    let bytes = pieces.iter().filter_map(|piece| match piece {
        Piece::Bytes { direction, bytes, .. } if *direction == wanted => Some(bytes.as_slice()),
        _ => None,
    });
    bytes.flatten().copied().collect()
}

fn marks(pieces: &[Piece]) -> Vec<String> {
    let marks = pieces.iter().filter_map(|piece| match piece {
        Piece::Mark { text, .. } => Some(text.clone()),
        _ => None,
    });
    marks.collect()
}

#[test]
fn every_reading_command_gives_from_its_recording_what_it_gave_from_the_unit() {
    // A moment is recorded to the microsecond and written to the millisecond, so rounding may be one off. A page of
    // diagnostics is dated when it is looked at, which a busy computer does later.
    const ROUNDED: Duration = Duration::from_millis(1);
    const LOOKED_AT: Duration = Duration::from_millis(500);
    // The smaller product where it makes no difference: it has values at once.
    let stories: [(&str, &[&str], Duration); 5] = [
        ("emu:axrtd8co", &["stream", "--period", "100", "--count", "8"], ROUNDED),
        ("emu:axtc4co", &["stream", "--source", "pv", "--period", "100", "--count", "8", "--json"], ROUNDED),
        ("emu:axtc4co", &["dictionary", "dump", "--yes", "--json"], ROUNDED),
        ("emu:axtc4co", &["diagnostics", "--count", "2", "--json"], LOOKED_AT),
        ("emu:axtc4co", &["identify", "--json"], ROUNDED),
    ];
    // Side by side: they wait for their lines, not for the processor.
    thread::scope(|scope| {
        for (port, story, apart) in stories {
            scope.spawn(move || reads_the_same(port, story, apart));
        }
    });
}

/// Runs a command on a unit and on its recording. All that may differ is the moments, and they by no more than this.
fn reads_the_same(port: &str, story: &[&str], apart: Duration) {
    let world = World::new();
    let live = world.run(&[story, &["--port", port, "--record", "it.cast"]].concat(), b"");
    assert_eq!(live.code, Some(0), "{story:?}: {}", live.err);
    // What only a unit can be told is left out.
    let keeps = |word: &&&str| !matches!(**word, "--period" | "100" | "--yes");
    let asked: Vec<&str> = story.iter().filter(keeps).copied().collect();
    let replayed = world.run(&[&asked[..], &["--port", "replay:it.cast"]].concat(), b"");
    assert_eq!(replayed.code, Some(0), "{story:?}: {}", replayed.err);
    let ((again, moments_again), (first, moments)) = (comparable(&replayed.out), comparable(&live.out));
    let at = again.bytes().zip(first.bytes()).position(|(one, other)| one != other);
    let at = at.unwrap_or(again.len().min(first.len()));
    let near = |text: &str| text.chars().skip(at.saturating_sub(40)).take(80).collect::<String>();
    assert!(again == first, "{story:?}: {:?}, not {:?}", near(&again), near(&first));
    assert_eq!(moments_again.len(), moments.len(), "{story:?}");
    for (again, first) in moments_again.iter().zip(&moments) {
        assert!(again.duration_since(*first).unsigned_abs() <= apart, "{story:?}: {again}, not {first}");
    }
}

/// A text without its moments, and those. Nor is there a number that may differ: a prompt that stands alone counts as a
/// line or not.
fn comparable(text: &str) -> (String, Vec<jiff::Timestamp>) {
    const MOMENT: usize = "2026-01-31T12:00:00.123Z".len();
    let (mut kept, mut moments) = (String::new(), Vec::new());
    let mut rest = text;
    while let Some(end) = rest.find('Z').map(|at| at + 1) {
        let begin = end.saturating_sub(MOMENT);
        match rest.get(begin..end).and_then(|moment| moment.parse().ok()) {
            Some(moment) => {
                moments.push(moment);
                kept.push_str(&rest[..begin]);
            }
            None => kept.push_str(&rest[..end]),
        }
        rest = &rest[end..];
    }
    kept.push_str(rest);
    let count = "\"unrecognised_lines\":";
    if let Some(at) = kept.find(count).map(|at| at + count.len()) {
        let digits = kept[at..].bytes().take_while(u8::is_ascii_digit).count();
        kept.replace_range(at..at + digits, "");
    }
    (kept, moments)
}

#[test]
fn the_time_of_a_streams_rows_begins_with_the_first_and_a_recording_without_rows_has_none() {
    let world = World::new();
    let made = world
        .run(&["stream", "--port", "emu:axrtd8co", "--period", "200", "--count", "5", "--record", "rows.cast"], b"");
    assert_eq!(made.code, Some(0), "{}", made.err);
    let rows = |more: &[&str]| world.run(&[&["stream", "--port", "replay:rows.cast"], more].concat(), b"");
    for (seconds, count) in [("0.5", 3), ("10", 5)] {
        let ran = rows(&["--duration", seconds]);
        assert_eq!((ran.code, ran.out.lines().count()), (Some(0), 1 + count), "{seconds}: {}", ran.out);
        let values = ran.out.lines().skip(1).flat_map(|line| line.split(',').skip(2));
        let decimals: Vec<usize> = values.filter_map(|value| Some(value.split_once('.')?.1.len())).collect();
        assert!(!decimals.is_empty() && decimals.iter().all(|&digits| digits == 1), "as printed: {}", ran.out);
    }
    let more = rows(&["--count", "9"]);
    assert_eq!((more.code, more.out.lines().count()), (Some(0), 6), "{}", more.out);
    assert!(more.err.contains("the recording has no more: 5 rows of 9"), "{}", more.err);
    let other = rows(&["--source", "pv"]);
    assert_eq!((other.code, other.out.as_str()), (Some(4), ""), "{}", other.err);
    assert!(other.err.contains("no row of the stream with process values"), "{}", other.err);
}

#[test]
fn what_writes_to_a_unit_refuses_a_recording() {
    let world = World::new();
    let made = world.run(&["identify", "--port", "emu:axtc4co", "--record", "it.cast"], b"");
    assert_eq!(made.code, Some(0), "{}", made.err);
    let image = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware_images/AXTC4CO_V1.2.0.elf.S");
    fs::write(world.path("password"), "AXIO-2010").expect("written");
    let commands: [&[&str]; 5] = [
        &["defaults", "--yes"],
        &["stream", "--off"],
        &["stream", "--period", "100"],
        &["load", image, "--yes", "--password-file", "password"],
        &["terminal", "--send", "password"],
    ];
    for command in commands {
        let ran = world.run(&[command, &["--port", "replay:it.cast"]].concat(), b"");
        assert_eq!(ran.code, Some(2), "{command:?}: {}", ran.err);
        assert!(ran.err.contains("a recording cannot be told to"), "{command:?}: {}", ran.err);
    }
}

#[test]
fn a_password_that_a_script_sends_with_everything_else_is_in_no_recording() {
    let world = World::new();
    for (number, text) in ["lAXIO-2010\n", "l\nAXIO-2010\n", "m\nL\n\nAXIO-2010\n"].into_iter().enumerate() {
        let record = format!("{number}.cast");
        fs::write(world.path("keys"), text).expect("written");
        let port = ["terminal", "--port", "emu:axtc4co", "--record", &record];
        // Enter is CR, from a file as through a pipe.
        for (way, end, stdin) in [("file", vec!["--send", "keys"], ""), ("pipe", vec!["--yes"], text)] {
            let ran = world.run(&[&port[..], &end[..]].concat(), stdin.as_bytes());
            assert_eq!(ran.code, Some(0), "{way} {text:?}: {}", ran.err);
            // Each direction alone: in the file they come by turns.
            let (pieces, _) = read(&world.path(&record));
            let [sent, heard] = [Direction::ToUnit, Direction::FromUnit]
                .map(|direction| String::from_utf8_lossy(&bytes(&pieces, direction)).into_owned());
            assert_eq!(sent, text.replace("AXIO-2010", "*********").replace('\n', "\r"), "{way} {text:?}");
            for said in [&heard, &ran.out, &ran.err] {
                assert!(!said.contains("AXIO-2010") && !said.contains("XIO-201"), "{way} {text:?}: {said}");
            }
        }
    }
}

#[test]
fn what_is_no_recording_is_said_with_its_place() {
    let world = World::new();
    let head = "{\"version\":2,\"axcon\":{\"schema\":\"axcon.recording/1\",\"encoding\":\"latin-1\"}}\n";
    for (name, text, said) in [
        ("text", "S0030000FC\n".to_owned(), "text:1:1: this is not an asciicast recording"),
        ("empty", String::new(), "empty:1:1: the file is empty"),
        (
            "later",
            format!("{head}[0.1,\"o\",\"a\"]\n[0.2,\"o\"\n[0.3,\"o\",\"b\"]\n"),
            "later:3:8: this is not an event",
        ),
    ] {
        fs::write(world.path(name), text).expect("written");
        for command in ["identify", "stream", "terminal", "diagnostics"] {
            let ran = world.run(&[command, "--port", &format!("replay:{name}")], b"");
            assert_eq!(ran.code, Some(2), "{command} {name}: {}", ran.err);
            assert!(ran.err.contains(said), "{command} {name}: {}", ran.err);
        }
    }
    let ran = world.run(&["stream", "--port", "replay:missing"], b"");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.err.contains("recordings are in"), "{}", ran.err);
    // A killed writer's last line is no fault, and is told.
    fs::write(world.path("cut"), format!("{head}[0.1,\"o\",\"hello\\r\\n\"]\n[0.2,\"o\",\"wor")).expect("written");
    let ran = world.run(&["terminal", "--port", "replay:cut"], b"");
    assert_eq!((ran.code, ran.out.as_str()), (Some(0), "hello\n"), "{}", ran.err);
    assert!(ran.err.contains("ends in the middle of a line"), "{}", ran.err);
}

#[test]
fn a_recording_takes_the_place_of_no_file_and_without_the_wanted_one_nothing_is_sent() {
    let world = World::new();
    let puppet = Puppet::silent();
    fs::write(world.path("kept"), "somebody's").expect("written");
    for command in [&["identify"][..], &["terminal"], &[]] {
        let ran = world.run(&[command, &["--port", puppet.port(), "--record", "kept"]].concat(), b"");
        assert_eq!(ran.code, Some(2), "{command:?}: {}", ran.err);
        assert!(ran.err.starts_with("axcon: kept exists already\n"), "{command:?}: {}", ran.err);
    }
    assert_eq!(fs::read_to_string(world.path("kept")).expect("there"), "somebody's");
    for command in ["identify", "terminal"] {
        let ran = world.run(&[command, "--port", puppet.port(), "--record", "no/such/folder/it.cast"], b"");
        assert_eq!(ran.code, Some(1), "{command}: {}", ran.err);
        assert!(ran.err.starts_with("axcon: this session is not recorded: no/such/folder/it.cast: "), "{}", ran.err);
    }
    assert_eq!(puppet.heard(), b"");
    let ran = world.run(&["identify", "--port", "emu:axtc4co", "--yes", "--record", "kept"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(!read(&world.path("kept")).0.is_empty());
}

#[test]
fn a_killed_program_has_recorded_whatever_it_had_shown() {
    for round in 0..25usize {
        let world = World::new();
        let puppet = Puppet::silent();
        let running = world.start(&["terminal", "--port", puppet.port(), "--record", "it.cast"]);
        puppet.wait_for_client();
        // Another moment each time: behind a few bytes, or in the middle of a flood.
        let lines: String = (0..20 + round * 300).map(|number| format!("line {number:06}\r\n")).collect();
        puppet.say(lines.as_bytes());
        running.wait_out(&format!("line {:06}", round * 150));
        running.signal(rustix::process::Signal::KILL);
        let shown = running.wait().out.replace('\n', "\r\n");
        let (pieces, _) = read(&world.path("it.cast"));
        let recorded = bytes(&pieces, Direction::FromUnit);
        assert!(lines.as_bytes().starts_with(&recorded), "round {round}: another order, or a byte lost");
        // Half of a line's end is shown as a whole one.
        let shown = shown.trim_end().as_bytes();
        assert!(recorded.len() >= shown.len() && recorded.starts_with(shown), "round {round}: shown and not recorded");
    }
}

#[test]
fn the_password_is_nowhere_however_the_unit_repeats_it() {
    let world = World::new();
    // It asks in words nobody knows, echoes, and says it again on a later line and at its next start.
    let mut line = Vec::new();
    let puppet = Puppet::start(Box::new(move |keys| {
        let mut said = Vec::new();
        for &key in keys {
            match key {
                b'l' if line.is_empty() => said.extend_from_slice(b"\r\nParole bitte: "),
                b'\r' => {
                    let typed = String::from_utf8_lossy(&std::mem::take(&mut line)).into_owned();
                    said.extend_from_slice(format!("\r\nwrong.\r\nyou said <{typed}>, {typed}!\r\n").as_bytes());
                }
                _ => {
                    line.push(key);
                    said.push(key);
                }
            }
        }
        said
    }));
    let args = ["terminal", "--echo", "--port", puppet.port(), "--log", "it.log", "--record", "it.cast"];
    let mut running = world.start(&args);
    puppet.wait_for_client();
    running.input(b"l");
    running.wait_out("Parole");
    for key in "Geheim-77".bytes() {
        running.input(&[key]);
    }
    running.input(b"\r");
    running.wait_out("you said");
    running.end_input();
    let ran = running.wait();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(puppet.heard().windows(9).any(|window| window == b"Geheim-77"), "it was sent");
    let log = fs::read(world.path("it.log")).expect("a log");
    // Each direction alone: in the file they come by turns.
    let (pieces, _) = read(&world.path("it.cast"));
    assert_eq!(bytes(&pieces, Direction::ToUnit).escape_ascii().to_string(), "l*********\\r");
    let heard = bytes(&pieces, Direction::FromUnit);
    for (what, text) in
        [("screen", ran.out.as_bytes()), ("log", &log), ("recording", &heard), ("err", ran.err.as_bytes())]
    {
        // Of two directions on one screen one may be hidden and the other not.
        let text = String::from_utf8_lossy(text).replace('*', "");
        assert!(!text.contains("Geheim"), "{what}: {text}");
    }
    assert!(String::from_utf8_lossy(&log).contains("you said <*********>, *********!"), "its place and length stay");
}

#[test]
fn a_row_of_a_flood_is_never_dropped() {
    const ROWS: usize = 20_000;
    let world = World::new();
    let puppet = Puppet::silent();
    let mut running = world.start(&["terminal", "--port", puppet.port(), "--record", "it.cast"]);
    puppet.wait_for_client();
    for chunk in 0..ROWS / 100 {
        let rows = (chunk * 100..(chunk + 1) * 100)
            .map(|row| format!("{:8.3};{:8.3};Disabled;OpenCct ;  -3.250\r\n", 25.0, row as f64 / 1000.0));
        puppet.say(rows.collect::<String>().as_bytes());
    }
    running.wait_out(&format!("{:8.3};Disabled", (ROWS - 1) as f64 / 1000.0));
    running.end_input();
    assert_eq!(running.wait().code, Some(0));
    let ran = world.run(&["stream", "--port", "replay:it.cast"], b"");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let rows: Vec<&str> = ran.out.lines().skip(1).collect();
    assert_eq!(rows.len(), ROWS);
    for (number, row) in rows.iter().enumerate() {
        let expected = format!(",fv,25.000,{:.3},disabled,open,-3.250", number as f64 / 1000.0);
        assert!(row.ends_with(&expected), "row {number}: {row}");
    }
}

#[test]
fn a_cable_that_comes_back_goes_on_in_the_same_recording() {
    let world = World::new();
    let link = world.path("unit");
    let row = |number: usize| format!("{:8.3};{:8.3};Disabled;OpenCct ;  -3.250\r\n", 25.0, number as f64);
    let menu = "AXTC4CO V1.1.0\r\nV - view object dictionary\r\nT - toggle stream\r\nS - show diagnostics\r\n";
    let answers = |keys: &[u8]| if keys.contains(&b'm') { menu.as_bytes().to_vec() } else { Vec::new() };
    let first = Puppet::start(Box::new(answers));
    symlink(first.path(), &link).expect("a link");
    let args = ["stream", "--port", link.to_str().expect("UTF-8"), "--record", "it.cast", "--count", "30"];
    let running = world.start(&args);
    first.wait_for_client();
    // A stream that runs already is joined; rows keep coming until some have been written, after the heading.
    let end = Instant::now() + PATIENCE;
    let mut number = 0;
    while running.wait_out("").lines().count() < 1 + 3 {
        assert!(Instant::now() < end, "no rows are written");
        first.say(row(number).as_bytes());
        number += 1;
        thread::sleep(Duration::from_millis(20));
    }
    drop(first);
    running.wait_err("waiting 10 s for it to come back");
    fs::remove_file(&link).expect("pulled out");
    let second = Puppet::start(Box::new(answers));
    symlink(second.path(), &link).expect("plugged in again");
    running.wait_err("link back after");
    // More than the first one can have sent.
    const BACK: usize = 2_000;
    for number in BACK..BACK + 30 {
        second.say(row(number).as_bytes());
    }
    let ran = running.wait();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let number = |line: &str| line.split(',').nth(3).and_then(|value| value.parse::<f64>().ok()).expect("TC1") as usize;
    let written: Vec<usize> = ran.out.lines().skip(1).map(number).collect();
    let (before, after) = written.split_at(written.partition_point(|&number| number < BACK));
    assert_eq!(written.len(), 30, "{}", ran.out);
    assert!(before.len() >= 3 && before.windows(2).all(|pair| pair[1] == pair[0] + 1), "{before:?}");
    assert!(!after.is_empty() && after.iter().copied().eq(BACK..BACK + after.len()), "{after:?}");
    let (pieces, ending) = read(&world.path("it.cast"));
    assert_eq!(ending, Ending::Whole);
    let heard = String::from_utf8(bytes(&pieces, Direction::FromUnit)).expect("ASCII");
    let places: Vec<Option<usize>> = written.iter().map(|&number| heard.find(&row(number))).collect();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?} in {heard}");
    let marks = marks(&pieces);
    assert!(marks[0] == "link lost" && marks[1].starts_with("link back after "), "{marks:?}");
    assert!(marks[2].starts_with("end: ") && marks[2].contains("bytes received"), "{marks:?}");
}

#[test]
fn another_unit_behind_a_cable_that_is_back_is_left_as_it_is() {
    let world = World::new();
    let link = world.path("unit");
    let emulator = world.start(&["emulate", "axtc4co", "--link", "u0", "--line-rate", "off"]);
    emulator.wait_out("serial: ");
    symlink(world.path("u0"), &link).expect("a link");
    let port = link.to_str().expect("UTF-8");
    let running = world.start(&["stream", "--port", port, "--period", "200", "--baud", "3000000"]);
    running.wait_out(",fv,");
    drop(emulator);
    running.wait_err("waiting 10 s for it to come back");
    fs::remove_file(&link).expect("pulled out");
    let other = Puppet::start(Box::new(|_| Vec::new()));
    symlink(other.path(), &link).expect("plugged in again");
    running.wait_err("link back after");
    let row = format!("{}\r\n", ["  25.0"; 8].join(";"));
    (0..3).for_each(|_| other.say(row.as_bytes()));
    let ran = running.wait();
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("the unit's rows have 8 values now and had 5"), "{}", ran.err);
    assert_eq!(other.heard(), b"", "its stream is not ours to switch off");
}

#[test]
fn no_key_is_pressed_on_what_has_not_shown_itself_behind_a_cable_that_is_back() {
    // One for each: the user has enough before it says anything, and it never says anything.
    for (interrupted, code) in [(true, 0), (false, 4)] {
        let world = World::new();
        let link = world.path("unit");
        let emulator = world.start(&["emulate", "axtc4co", "--link", "u0", "--line-rate", "off"]);
        emulator.wait_out("serial: ");
        symlink(world.path("u0"), &link).expect("a link");
        let port = link.to_str().expect("UTF-8");
        let running = world.start(&["stream", "--port", port, "--period", "200", "--baud", "3000000"]);
        running.wait_out(",fv,");
        drop(emulator);
        running.wait_err("waiting 10 s for it to come back");
        fs::remove_file(&link).expect("pulled out");
        let other = Puppet::silent();
        symlink(other.path(), &link).expect("plugged in again");
        running.wait_err("link back after");
        if interrupted {
            running.signal(rustix::process::Signal::INT);
        }
        let ran = running.wait();
        assert_eq!(ran.code, Some(code), "{}", ran.err);
        assert!(ran.err.contains("its stream is left as it is"), "{}", ran.err);
        let heard = other.heard();
        assert!(!heard.contains(&b't'), "{}", heard.escape_ascii());
        assert!(!interrupted || heard.is_empty(), "{}", heard.escape_ascii());
    }
}

#[test]
fn a_signal_ends_a_program_that_is_blocked_in_a_read() {
    let world = World::new();
    let made = world.run(&["stream", "--port", "emu:axrtd8co", "--count", "1", "--record", "rows.cast"], b"");
    assert_eq!(made.code, Some(0), "{}", made.err);
    let recording = fs::read(world.path("rows.cast")).expect("a recording");
    let mut running = world.start(&["stream", "--port", "replay:/dev/stdin"]);
    running.input(&recording);
    running.wait_out(",fv,");
    // The second one shortens the wait for a loop that does not look.
    running.signal(rustix::process::Signal::TERM);
    thread::sleep(Duration::from_millis(20));
    running.signal(rustix::process::Signal::TERM);
    assert_eq!(running.wait().code, Some(130));
}

#[test]
fn a_cable_that_stays_away_is_exit_code_3() {
    let world = World::new();
    let link = world.path("unit");
    let puppet = Puppet::start(Box::new(|_| b"AXTC4CO V1.1.0\r\nM - menu\r\n".to_vec()));
    symlink(puppet.path(), &link).expect("a link");
    let args = ["stream", "--port", link.to_str().expect("UTF-8"), "--reconnect", "1", "--json"];
    let running = world.start(&args);
    puppet.wait_for_client();
    // It is asked for its stream: until then there is nothing to lose.
    let end = Instant::now() + PATIENCE;
    while !puppet.heard().contains(&b't') {
        assert!(Instant::now() < end, "nobody asks for the stream: {}", puppet.heard().escape_ascii());
        thread::sleep(Duration::from_millis(5));
        puppet.say(b"    25.0;    25.0;    25.0;    25.0;    25.0\r\n");
    }
    drop(puppet);
    let ran = running.wait();
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.err.contains("\"port-gone\""), "{}", ran.err);
}

#[test]
fn a_stream_goes_on_behind_a_reset_of_the_unit() {
    let world = World::new();
    let link = world.path("unit");
    let port = link.to_str().expect("UTF-8");
    let mut emulator = world.start(&["emulate", "axtc4co", "--link", port]);
    emulator.wait_out("\n");
    let running = world.start(&["stream", "--port", port, "--period", "50", "--count", "70"]);
    // Its power is cut while rows come; the stream is stored in the unit and comes back with it.
    running.wait_out(",fv,");
    emulator.input(b"power off\npower on\n");
    let ran = running.wait();
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let moments: Vec<jiff::Timestamp> =
        ran.out.lines().skip(1).map(|row| row.split(',').next().expect("a time").parse().expect("a time")).collect();
    let gap = moments.windows(2).position(|pair| pair[1].duration_since(pair[0]).as_millis() > 2_000);
    let gap = gap.unwrap_or_else(|| panic!("no gap:\n{}", ran.out));
    assert!(moments.len() > gap + 10, "rows come again:\n{}", ran.out);
}
