//! The application: banner, menu, dialogues, stream, diagnostics, flow control.

use axcon::emulator::knob::Knob;
use axcon::emulator::memory::{Parameters, StreamSetting};
use axcon::emulator::{Area, NetworkState, NmtCommand, Running, Setup, Unit};
use axcon::endpoint::Endpoint;
use axcon::time::{Duration, Instant};
use axcon::wire::stream::{Reading, Row, Source};

use super::{Bench, XOFF, XON, flash_with, old_program, product, setup};

/// Rows in a text; everything else is skipped.
fn rows(text: &str) -> Vec<Row> {
    text.lines().filter_map(|line| product().stream.parse(line)).collect()
}

/// When the last character of each row was released, in ms (rounded to the nearest).
fn row_times_ms(bench: &Bench) -> Vec<u64> {
    let mut times = Vec::new();
    let mut line = Vec::new();
    for &(at, byte) in &bench.heard {
        line.push(byte);
        if byte == b'\n' {
            let text = String::from_utf8_lossy(&line).trim_end_matches(['\r', '\n']).to_owned();
            if product().stream.parse(&text).is_some() {
                times.push((at.as_nanos() + 500_000) / 1_000_000);
            }
            line.clear();
        }
    }
    times
}

fn stream_of(bench: &mut Bench) -> StreamSetting {
    bench.unit().settings().stream
}

// B-030
#[test]
fn power_up_prints_the_banner_and_then_the_menu() {
    let mut bench = Bench::new(setup(flash_with(&old_program())));
    bench.run_ms(500);
    let text = bench.take();
    let lines: Vec<&str> = text.split("\r\n").collect();
    assert_eq!(
        lines,
        [
            "",
            "Axiomatic Technologies Corporation",
            "AXTC4CO - 4 Thermocouple Scanner",
            "Software Version V1.2.3, built 2026-01-31 12:34:56",
            "",
            "",
            "Main Menu - AXTC4CO V1.2.3",
            "  V - View Object Dictionary",
            "  D - Default Object Dictionary",
            "  T - Toggle RS-232 Stream On/Off",
            "  S - Show/Stop Diagnostics",
            "  L - Load New Software",
            "CANopen: Node-ID 127 (0x7F), Baud Rate 125 kbit/s, State Pre-Operational",
            "",
        ]
    );
}

// B-181
#[test]
fn every_line_ends_with_cr_lf() {
    let mut bench = Bench::at_menu();
    bench.run_ms(3_000);
    let mut text = bench.keys(b"m");
    text += &bench.keys(b"v\r\rx");
    text += &bench.keys(b"s");
    text += &bench.keys(b"dno\r");
    let returns = text.matches("\r\n").count();
    assert!(returns > 60, "{text}");
    assert_eq!((text.matches('\r').count(), text.matches('\n').count()), (returns, returns));
}

// B-182, B-183, B-184, B-198
#[test]
fn m_prints_the_menu_again_in_either_case_and_other_keys_do_nothing() {
    let mut bench = Bench::at_menu();
    for key in [b"m", b"M"] {
        let text = bench.keys(key);
        for item in ["View Object Dictionary", "Default Object Dictionary", "Toggle RS-232 Stream On/Off"] {
            assert!(text.contains(item), "{text}");
        }
        assert!(text.contains("Show/Stop Diagnostics") && text.contains("Load New Software"), "{text}");
        assert!(text.contains("Node-ID 127") && text.contains("125 kbit/s"), "{text}");
        assert!(text.contains("AXTC4CO") && text.contains("V1.2.3"), "{text}");
    }
    let others: Vec<u8> =
        (0..=255u8).filter(|key| !b"mMvVdDtTsSlL".contains(key) && ![XON, XOFF].contains(key)).collect();
    for lot in others.chunks(16) {
        assert_eq!(bench.keys(lot), "");
    }
}

// B-190
#[test]
fn the_stream_is_switched_on_with_two_questions_and_off_with_none() {
    for (toggle, choice, source) in [(b't', b'f', Source::FieldValue), (b'T', b'P', Source::ProcessValue)] {
        let mut bench = Bench::at_menu();
        bench.run_ms(4_500);
        let question = bench.keys(&[toggle]);
        assert!(question.contains("(F)ield") && question.contains("(P)rocess"), "{question}");
        let question = bench.keys(&[choice]);
        assert!(question.contains("ms"), "{question}");
        assert!(!stream_of(&mut bench).on, "not before the last answer");
        bench.send(b"250\r");
        bench.run_ms(2_100);
        let text = bench.take();
        assert!(text.starts_with("250"), "typed characters are echoed: {text:?}");
        let rows = rows(&text);
        assert_eq!(rows.len(), 8, "{text}");
        assert!(rows.iter().all(|row| row.source == source));
        assert_eq!(stream_of(&mut bench), StreamSetting { on: true, source, period_ms: 250 });
        let text = bench.keys(&[toggle]);
        assert!(text.contains("OFF"), "{text}");
        bench.run_ms(1_000);
        assert_eq!(bench.take(), "");
        assert_eq!(stream_of(&mut bench), StreamSetting { on: false, source, period_ms: 250 });
    }
}

#[test]
fn wrong_answers_to_the_stream_questions_change_nothing() {
    let mut bench = Bench::at_menu();
    let before = bench.unit().parameters().to_vec();
    for keys in [&b"tf0\r"[..], b"tf60001\r", b"tp-1\r", b"tfx\r", b"t\r", b"t\x1b", b"tf\x1b", b"tf12\x1b"] {
        let text = bench.keys(keys);
        assert_eq!(bench.unit().parameters(), before, "{:?}: {text}", keys.escape_ascii());
        assert!(bench.keys(b"m").contains("Main Menu"), "{:?} leads back to the menu", keys.escape_ascii());
    }
    bench.keys(b"tf\r");
    assert_eq!(stream_of(&mut bench), StreamSetting { on: true, source: Source::FieldValue, period_ms: 1_000 });
}

#[test]
fn both_limits_of_the_repetition_rate_are_taken() {
    for (answer, period_ms) in [(&b"tp1\r"[..], 1), (b"tp60000\r\n", 60_000), (b"tp9\x0825\x7f0\r", 20)] {
        let mut bench = Bench::at_menu();
        bench.keys(answer);
        assert_eq!(stream_of(&mut bench).period_ms, period_ms);
    }
}

// B-192, B-193, B-194, B-195
#[test]
fn rows_have_the_manuals_widths_in_every_condition() {
    let mut bench = Bench::at_menu();
    bench.turn(Knob::Temperature(1, 250.0));
    bench.turn(Knob::Open(2, None));
    assert_eq!(bench.write("6112:3", 0.0), Ok(()));
    bench.keys(b"tf200\r");
    bench.run_ms(4_000);
    let text = bench.take();
    let line = text.lines().last().expect("a row");
    assert_eq!(line.len(), 44, "{line}");
    assert!(line[9..].starts_with(" 250.0") || line[9..].starts_with(" 249.9"), "{line}");
    assert!(line[18..].starts_with("OpenCct ;Disabled;"), "{line}");
    bench.keys(b"t");
    bench.keys(b"tp200\r");
    bench.run_ms(1_000);
    let text = bench.take();
    let line = text.lines().last().expect("a row");
    assert_eq!(line.len(), 29, "{line}");
    assert!(line[6..].starts_with(" 8368;Open ;Null ;") || line[6..].starts_with(" 8367;Open ;Null ;"), "{line}");
    let Some(Row { readings, .. }) = product().stream.parse(line) else { panic!("{line}") };
    assert_eq!(readings[2..4], [Reading::Open, Reading::Disabled]);
}

// B-196, B-199, B-022
#[test]
fn rows_come_at_the_set_rate_and_not_before_the_first_valid_data() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tp500\r");
    bench.run_ms(6_000);
    let times = row_times_ms(&bench);
    // Power at 0, the program from 50 ms on, data 3 s later; a row takes 31 characters, 2.7 ms.
    assert_eq!(times[..4], [3_053, 3_553, 4_053, 4_553]);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 500), "{times:?}");
}

// B-060
#[test]
fn rows_repeat_the_newest_scan_and_a_scan_comes_every_200_ms() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tf50\r");
    bench.run_ms(10_000);
    let rows = rows(&bench.take());
    assert!(rows.len() > 100);
    let changes = rows.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let expected = (rows.len() - 1) / 4;
    assert!(changes.abs_diff(expected) <= 1, "{changes} changes in {} rows", rows.len());
}

#[test]
fn a_line_that_is_too_slow_loses_whole_rows() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tf1\r");
    bench.run_ms(2_700);
    bench.take();
    bench.run_ms(5_000);
    let text = bench.take();
    let lines: Vec<&str> = text.split_inclusive("\r\n").collect();
    let whole = &lines[1..lines.len() - 1];
    assert!(whole.iter().all(|line| line.len() == 46 && rows(line).len() == 1));
    // 11,520 characters a second carry 250 rows of 46.
    assert!((1_245..=1_253).contains(&whole.len()), "{}", whole.len());
    let menu = bench.keys(b"m");
    assert!(menu.contains("V - View Object Dictionary\r\n  D - Default"), "the menu comes whole: {menu}");
}

// B-197
#[test]
fn a_stream_that_fills_the_line_leaves_room_for_the_diagnostics() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tf1\rs");
    bench.run_ms(4_000);
    bench.take();
    bench.run_ms(5_000);
    let text = bench.take();
    assert_eq!(text.matches("Supply Voltage").count(), 5, "a page a second");
    assert!(rows(&text).len() > 1_100, "and rows in between: {}", rows(&text).len());
}

// B-191, B-197, B-157
#[test]
fn the_stream_comes_back_after_a_power_cycle_and_diagnostics_do_not() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tp250\rs");
    bench.power_off();
    bench.run_ms(1_000);
    bench.take();
    bench.power_on();
    bench.run_ms(5_000);
    let text = bench.take();
    assert_eq!(rows(&text).len(), 8, "{text}");
    assert!(!text.contains("Diagnostics  "), "{text}");
}

#[test]
fn a_unit_made_of_stored_writes_goes_on_where_the_other_stopped() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tp250\r");
    let mut parameters = vec![0; bench.unit().parameters().len()];
    while let Some(store) = bench.unit().poll_store() {
        assert_eq!(store.area, Area::Parameters);
        parameters[store.offset..store.offset + store.bytes.len()].copy_from_slice(&store.bytes);
    }
    assert_eq!(parameters, bench.unit().parameters());
    assert_eq!(Parameters::read(product(), &parameters).as_ref(), Ok(bench.unit().settings()));
    let mut other = Bench::new(Setup { parameters, ..setup(flash_with(&old_program())) });
    other.run_ms(5_000);
    assert!(!rows(&other.take()).is_empty());
}

#[test]
fn stream_and_diagnostics_pause_while_something_is_asked_or_shown() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tp100\rs");
    bench.run_ms(4_000);
    for (open, close) in [(&b"d"[..], &b"\r"[..]), (b"v", b"x"), (b"l", b"\x1b")] {
        bench.keys(open);
        bench.run_ms(1_000);
        bench.take();
        bench.run_ms(2_000);
        assert_eq!(bench.take(), "", "silence after {}", open.escape_ascii());
        bench.send(close);
        bench.run_ms(1_500);
        let text = bench.take();
        assert!(rows(&text).len() >= 10 && text.contains("Supply Voltage"), "{text}");
    }
}

// B-197
#[test]
fn diagnostics_repeat_every_second_until_stopped() {
    for key in [b"s", b"S"] {
        let mut bench = Bench::at_menu();
        bench.run_ms(100);
        bench.keys(key);
        bench.run_ms(1_700);
        assert!(!bench.take().contains("Supply Voltage"), "no values in the first 3 s");
        bench.run_ms(4_450);
        let text = bench.take();
        let pages: Vec<&str> = text.split("Diagnostics  ").skip(1).collect();
        assert_eq!(pages.len(), 4, "{text}");
        assert!(pages[0].contains("up 0:00:03") && pages[3].contains("up 0:00:06"), "{text}");
        for line in ["Supply Voltage", "Cold Junction", "TC4", "uV", "Active Errors", "Pre-Operational"] {
            assert!(pages[0].contains(line), "{text}");
        }
        bench.keys(key);
        bench.run_ms(3_000);
        assert_eq!(bench.take(), "");
    }
}

// B-188, B-156
#[test]
fn yes_restores_the_defaults_and_resets() {
    for key in [b"d", b"D"] {
        let mut bench = Bench::at_menu();
        bench.keys(b"tp250\r");
        assert_eq!(bench.write("6112:2", 0.0), Ok(()));
        bench.save();
        let question = bench.keys(key);
        assert!(question.contains("Yes"), "{question}");
        let text = bench.keys(b"Yes\r");
        assert!(text.starts_with("Yes"), "echo: {text}");
        assert!(text.contains("Software Version V1.2.3") && text.contains("Main Menu"), "banner again: {text}");
        assert_eq!(bench.read("6112:2"), Ok(1.0), "back at its default");
        assert!(stream_of(&mut bench).on, "stream settings survive");
        assert_eq!((bench.unit().settings().node_id, bench.unit().settings().kbps), (127, 125));
    }
}

// B-189
#[test]
fn any_other_answer_leaves_everything_as_it_is() {
    let mut bench = Bench::at_menu();
    assert_eq!(bench.write("6112:2", 0.0), Ok(()));
    for answer in [&b"dyes\r"[..], b"dYES\r", b"dYes \r", b"d\r", b"dY\r", b"dYesYes\r", b"dYes\x1b"] {
        let text = bench.keys(answer);
        assert!(text.contains("Cancelled"), "{:?}: {text}", answer.escape_ascii());
        assert!(!text.contains("V1.2.3"), "{:?}: no reset: {text}", answer.escape_ascii());
        assert_eq!(bench.read("6112:2"), Ok(0.0));
    }
    assert!(bench.keys(b"m").contains("Main Menu"));
}

// B-185, B-183
#[test]
fn the_view_shows_pdos_first_and_then_an_object_for_each_enter() {
    for (open, close) in [(b"v", b"x"), (b"V", b"X")] {
        let mut bench = Bench::at_menu();
        bench.run_ms(3_000);
        bench.send(open);
        bench.run_ms(1_000);
        let block = bench.take();
        let order =
            ["1400h", "1603h", "0x400001FF", "0xC00004FF", "0x71300410", "0x31300010"].map(|item| block.find(item));
        assert!(order.iter().all(Option::is_some) && order.is_sorted(), "{block}");
        let text = bench.keys(b"\r");
        assert!(text.contains("1000h") && text.contains("0x10020194") && !text.contains("1001h"), "{text}");
        let text = bench.keys(b"\r\n");
        assert!(text.contains("1001h") && !text.contains("100Ch"), "CR LF is one Enter: {text}");
        assert_eq!(bench.keys(b"mtdsl "), "", "the menu's keys are not served here");
        let text = bench.keys(close);
        assert!(text.contains("Main Menu"), "{text}");
        assert!(bench.keys(b"m").contains("Main Menu"));
    }
}

#[test]
fn the_view_ends_by_itself_and_freezes_the_values_meanwhile() {
    let mut bench = Bench::at_menu();
    bench.run_ms(3_000);
    bench.send(b"v");
    bench.run_ms(1_000);
    bench.take();
    let (mut objects, mut text) = (0, String::new());
    while !text.contains("Main Menu") {
        bench.turn(Knob::Temperature(1, 500.0));
        text = bench.keys(b"\r");
        objects += 1;
        if text.contains("6100h") {
            assert!(!text.contains("= 500.") && !text.contains("= 499."), "scanning is halted: {text}");
        }
        assert!(objects < 100, "the walk has an end");
    }
    assert!(objects > 20);
    bench.send(b"tp200\r");
    bench.run_ms(1_000);
    let rows = rows(&bench.take());
    let Some(Reading::Value(counts)) = rows.last().map(|row| row.readings[1]) else { panic!("{rows:?}") };
    assert!((counts - 12_368.0).abs() < 4.0, "scanning goes on: {counts}");
}

// B-185
#[test]
fn the_view_is_refused_outside_pre_operational() {
    let mut bench = Bench::at_menu();
    bench.run_ms(3_000);
    for (command, state) in [(NmtCommand::Start, NetworkState::Operational), (NmtCommand::Stop, NetworkState::Stopped)]
    {
        bench.nmt(command);
        assert_eq!(bench.unit().network_state(), Some(state));
        let text = bench.keys(b"v");
        assert!(!text.contains("1400h") && text.lines().count() < 4, "{text}");
        assert!(bench.keys(b"m").contains("Main Menu"));
    }
}

// B-210, B-214
#[test]
fn a_wrong_password_leads_back_to_the_menu_without_a_reset() {
    for (key, answer) in [(b'l', &b"axio-2010\r"[..]), (b'L', b"AXIO-2011\r"), (b'l', b"AXIO-2010 \r")] {
        let mut bench = Bench::at_menu();
        let prompt = bench.keys(&[key]);
        assert!(prompt.contains("Password"), "{prompt}");
        let text = bench.keys(answer);
        assert!(text.contains("Wrong password"), "{text}");
        assert_eq!(bench.unit().running(), Running::Application);
        assert!(bench.keys(b"m").contains("Main Menu"));
    }
    let mut bench = Bench::at_menu();
    for cancelled in [&b"l\r"[..], b"l\x1b", b"lAXIO-2010\x1b"] {
        assert!(bench.keys(cancelled).contains("Cancelled"));
        assert_eq!(bench.unit().running(), Running::Application);
    }
}

// B-211
#[test]
fn the_right_password_is_never_shown_and_leads_into_the_loader() {
    for key in [b"l", b"L"] {
        let mut bench = Bench::at_menu();
        let mut text = bench.keys(key);
        text += &bench.keys(b"AXIX\x08O-2010\r");
        assert!(text.contains("****\u{8} \u{8}******"), "{text:?}");
        assert!(text.ends_with("S-Record loader. Version 1.3\r\nWaiting for application S-Record.\r\n"), "{text}");
        assert!(!text.contains("AXI"), "{text}");
        assert_eq!(bench.unit().running(), Running::Loader);
        bench.power_off();
        bench.power_on();
        bench.run_ms(500);
        assert_eq!(bench.unit().running(), Running::Application, "nothing was loaded, so nothing is lost");
    }
}

// B-180, B-127
#[test]
fn output_is_paced_at_the_line_rate() {
    let mut bench = Bench::at_menu();
    let start = bench.now;
    bench.send(b"m");
    bench.run_ms(300);
    let menu: Vec<Instant> = bench.heard[bench.taken..].iter().map(|&(at, _)| at).collect();
    let expected = Duration::from_nanos(86_805) * (menu.len() as u32 + 1);
    let took = menu.last().expect("a menu").since(start);
    assert_eq!(took, expected, "one character for the key, one for each of the menu");
    let mut moments = menu;
    moments.dedup();
    assert!(moments.windows(2).all(|pair| pair[1].since(pair[0]) <= Duration::from_micros(1_100)));
}

// B-180
#[test]
fn xoff_stops_the_unit_within_a_character_and_xon_loses_nothing_of_the_menu() {
    let mut bench = Bench::at_menu();
    let whole = bench.keys(b"m");
    for pause_us in (0..20_000).step_by(700) {
        bench.send(b"m");
        bench.run(Duration::from_micros(1_000 + pause_us));
        bench.send(&[XOFF]);
        bench.run(Duration::from_micros(200));
        let begin = bench.take();
        bench.run_ms(2_000);
        assert_eq!(bench.take(), "", "nothing after an XOFF");
        bench.send(&[XON]);
        bench.run_ms(100);
        assert_eq!(begin + &bench.take(), whole);
    }
}

#[test]
fn keys_pressed_while_the_output_is_stopped_are_not_forgotten_and_not_without_limit() {
    let mut bench = Bench::at_menu();
    let menu = bench.keys(b"m");
    bench.send(&[XOFF]);
    bench.send(&[b'm'; 500]);
    bench.run_ms(1_000);
    bench.send(&[XON]);
    bench.run_ms(20_000);
    let menus = bench.take().matches("Main Menu").count();
    let stuck_after = 2_048usize.div_ceil(menu.len());
    assert_eq!(menus, stuck_after + 64, "what fills the output, and what the receiver keeps");
    assert_eq!(bench.keys(b"m"), menu, "and all is well again");
}

#[test]
fn a_reset_by_the_network_does_not_wait_for_the_terminal() {
    for held in [false, true] {
        let mut bench = Bench::at_menu();
        bench.send(b"m");
        bench.run_ms(10);
        if held {
            bench.send(&[XOFF]);
            bench.run_ms(1_000);
        }
        bench.nmt(NmtCommand::ResetNode);
        assert_eq!(bench.unit().running(), Running::Starting);
        bench.run_ms(500);
        let text = bench.take();
        let menus = (text.matches("Main Menu").count(), text.matches("L - Load").count());
        assert_eq!(menus, (2, 1), "half a menu, and a new start: {text}");
        assert!(text.ends_with("State Pre-Operational\r\n") && text.contains("V1.2.3, built"), "{text}");
    }
}

#[test]
fn a_unit_that_waits_for_a_file_asks_for_nothing() {
    let mut bench = Bench::at_menu();
    bench.keys(b"lAXIO-2010\r");
    assert_eq!((bench.unit().running(), bench.unit().poll_timeout()), (Running::Loader, None));
}

#[test]
fn power_can_go_at_any_moment_and_what_was_typed_is_forgotten() {
    for cut_ms in (0..1_000).step_by(37) {
        let mut bench = Bench::new(setup(flash_with(&old_program())));
        bench.send(b"mtf12");
        bench.run_ms(cut_ms);
        bench.power_off();
        assert_eq!(bench.unit().poll_timeout(), None);
        bench.run_ms(10);
        bench.take();
        bench.send(b"m");
        bench.run_ms(10_000);
        assert_eq!(bench.take(), "", "a unit without power says nothing");
        bench.power_on();
        bench.run_ms(500);
        let text = bench.take();
        assert_eq!(text.matches("Main Menu").count(), 1, "cut at {cut_ms} ms: {text}");
    }
}

#[test]
fn the_same_seed_and_inputs_give_the_same_bytes_however_often_one_asks() {
    let script: &[(u64, &[u8])] = &[
        (400, b"m"),
        (900, b"tf137\r"),
        (4_000, b"s"),
        (5_003, &[XOFF]),
        (5_011, &[XON]),
        (6_000, b"v\r\r\r"),
        (7_000, b"x"),
        (8_000, b"lAXIO-2010\r"),
        (8_500, b"S0030000FC\rhello"),
    ];
    let play = |extra_us: Option<u64>| {
        let mut unit = Unit::new(setup(flash_with(&old_program())));
        unit.power_on(Instant::ZERO);
        let mut bytes = Vec::new();
        let mut run_to = |unit: &mut Unit, from: Instant, to: Instant| {
            let mut now = from;
            while let Some(due) = unit.poll_timeout().filter(|&due| due <= to) {
                // Ask in between as well.
                while let Some(step) = extra_us.map(Duration::from_micros).filter(|&step| now + step < due) {
                    now += step;
                    unit.handle_timeout(now);
                }
                now = due;
                unit.handle_timeout(due);
            }
            while let Some(transmit) = unit.poll_transmit() {
                bytes.extend(transmit.bytes);
            }
        };
        let mut now = Instant::ZERO;
        for &(at_ms, input) in script {
            let at = Instant::from_millis(at_ms);
            run_to(&mut unit, now, at);
            unit.handle_bytes(at, input);
            now = at;
        }
        run_to(&mut unit, now, Instant::from_millis(10_000));
        bytes
    };
    let bytes = play(None);
    assert!(bytes.len() > 4_000);
    assert_eq!(bytes, play(None));
    assert_eq!(bytes, play(Some(50)));
    assert_eq!(bytes, play(Some(1_777)));
}

#[test]
fn a_unit_that_is_asked_late_says_the_same() {
    let mut early = Bench::at_menu();
    early.keys(b"tf100\r");
    early.run_ms(10_000);
    let mut unit = Unit::new(setup(flash_with(&old_program())));
    unit.power_on(Instant::ZERO);
    unit.handle_bytes(Instant::from_millis(500), b"tf100\r");
    unit.handle_timeout(early.now);
    let mut late = Vec::new();
    while let Some(transmit) = unit.poll_transmit() {
        late.extend(transmit.bytes);
    }
    let late = String::from_utf8(late).expect("ASCII");
    assert_eq!(rows(&late), rows(&early.heard.iter().map(|&(_, byte)| char::from(byte)).collect::<String>()));
}
