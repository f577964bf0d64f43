//! The service port of the AXRTD8CO, and where it differs from the AXTC4CO's (errata, C-items).

use axcon::emulator::knob::Knob;
use axcon::emulator::{NetworkState, NmtCommand, Running};

use super::Bench;

fn rtd8() -> Bench {
    Bench::of("AXRTD8CO", 0)
}

/// The last row in a text.
fn last_row(text: &str) -> String {
    text.lines().rfind(|line| line.contains(';')).expect("a row").to_owned()
}

// B-128, B-129, B-130, B-131
#[test]
fn banner_and_menu_name_the_product_its_version_and_its_network_values() {
    let mut bench = rtd8();
    for key in [b"m", b"M"] {
        let text = bench.keys(key);
        for part in
            ["AXRTD8CO", "V1.2.3", "V - View", "D - Default", "T - Toggle", "S - Show", "L - Load", "127", "125"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}

// B-136, B-137, B-138, B-139, B-140, B-141
#[test]
fn rows_have_eight_fields_of_six_characters_in_every_condition() {
    let mut bench = rtd8();
    for (channel, celsius) in [(1, 0.0), (2, 25.0), (3, 100.0), (7, -20.0), (8, 124.0)] {
        bench.turn(Knob::Temperature(channel, celsius));
    }
    bench.turn(Knob::Open(4, None));
    assert_eq!(bench.write("6112:5", 0.0), Ok(()));
    bench.turn(Knob::Short(6));
    bench.turn(Knob::LeadResistance(6, 0.0));
    let question = bench.keys(b"t");
    assert!(question.contains("ield Value") && question.contains("rocess Value"), "{question}");
    let question = bench.keys(b"f");
    assert!(question.contains("ms") && question.contains("100-60000"), "{question}");
    bench.keys(b"500\r");
    bench.run_ms(8_000);
    let row = last_row(&bench.take());
    assert_eq!(row, "   0.0;  25.0; 100.0;Open  ;Null  ;Short ; -20.0; 124.0");
    bench.keys(b"t");
    bench.keys(b"tp500\r");
    bench.run_ms(2_000);
    let row = last_row(&bench.take());
    assert_eq!(row, "  4368;  4768;  5968;Open  ;Null  ;Short ;  4048;  6352");
    bench.power_off();
    bench.run_ms(100);
    bench.power_on();
    bench.run_ms(4_900);
    assert!(!bench.take().contains(';'), "no values before 5 s");
    bench.run_ms(2_000);
    assert_eq!(last_row(&bench.take()).len(), 55, "it comes back after a power cycle");
}

// B-141: errata E-I5.
#[test]
fn the_repetition_rate_has_limits_of_its_own() {
    for (answer, taken) in [(&b"99\r"[..], false), (b"100\r", true), (b"60000\r", true), (b"60001\r", false)] {
        let mut bench = rtd8();
        bench.keys(b"tf");
        let text = bench.keys(answer);
        assert_eq!(bench.unit().settings().stream.on, taken, "{text}");
    }
}

// B-44: errata E-I4.
#[test]
fn a_frozen_converter_has_a_word_of_its_own() {
    let mut bench = rtd8();
    bench.run_ms(6_000);
    bench.turn(Knob::Freeze(true));
    bench.keys(b"tf500\r");
    bench.run_ms(4_000);
    assert!(last_row(&bench.take()).starts_with("Error ;Error ;"));
    bench.keys(b"t");
    bench.keys(b"tp500\r");
    bench.run_ms(1_500);
    assert!(last_row(&bench.take()).starts_with("  -384;  -384;"));
}

// B-142
#[test]
fn diagnostics_show_what_only_this_unit_has() {
    let mut bench = rtd8();
    bench.run_ms(6_000);
    bench.keys(b"s");
    bench.run_ms(2_100);
    let text = bench.take();
    assert!((2..=3).contains(&text.matches("Supply Voltage").count()), "every second: {text}");
    for part in ["Source Current", "RTD8", "Ohm", "uV", "PV", "status 0x00"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    bench.power_off();
    bench.run_ms(100);
    bench.power_on();
    bench.run_ms(9_000);
    assert!(!bench.take().contains("Supply Voltage"), "never on after a power cycle");
}

// B-134, B-135
#[test]
fn yes_restores_the_defaults_at_once() {
    let mut bench = rtd8();
    for (entry, number) in [("3000:1", 2.0), ("6112:2", 0.0)] {
        assert_eq!(bench.write(entry, number), Ok(()));
    }
    bench.save();
    assert!(bench.keys(b"dyes\r").contains("Cancelled"));
    assert_eq!(bench.read("3000:1"), Ok(2.0));
    assert!(bench.keys(b"dYes\r").contains("V1.2.3"), "the banner again");
    assert_eq!((bench.read("3000:1"), bench.read("6112:2"), bench.read("6114:1")), (Ok(1.0), Ok(1.0), Ok(900.0)));
}

// B-107
#[test]
fn a_start_in_the_first_five_seconds_is_lost() {
    let mut bench = rtd8();
    bench.run_ms(1_000);
    bench.nmt(NmtCommand::Start);
    bench.run_ms(8_000);
    assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational));
    bench.nmt(NmtCommand::Start);
    assert_eq!(bench.unit().network_state(), Some(NetworkState::Operational));
}

// B-143, B-147
#[test]
fn a_wrong_password_leads_back_to_the_menu() {
    let mut bench = rtd8();
    assert!(bench.keys(b"lAXIO-2010x\r").contains("Wrong password"));
    assert!(bench.keys(b"laxio-2010\r").contains("Wrong password"));
    assert_eq!(bench.unit().running(), Running::Application);
    assert!(bench.keys(b"m").contains("Main Menu"));
}

// B-148
#[test]
fn stream_and_diagnostics_do_not_disturb_the_scan() {
    let mut quiet = rtd8();
    let mut busy = rtd8();
    busy.keys(b"tf100\r");
    busy.keys(b"s");
    quiet.run_ms(600);
    for bench in [&mut quiet, &mut busy] {
        bench.run_ms(9_000);
    }
    for channel in 1..=8 {
        let entry = format!("6100:{channel}");
        assert_eq!(quiet.read(&entry), busy.read(&entry), "channel {channel}");
    }
}
