//! The G2 loader: its texts, each of its errors, and what tells it from G1, with which it shares the rest.

use axcon::device::{LoaderKind, Product};
use axcon::emulator::memory::{Defect, StartDelay};
use axcon::emulator::{Running, Setup};
use axcon::time::{Duration, Instant, character_time};
use axcon::version::Version;

use super::loader::{PROMPT, cut_and_save_at_any_moment, each_is_taken, enter_loader, new_program};
use super::sender::{S0, S7, data_records, file, s3, send_obeying, talk_over, upload, without_flow_control};
use super::{BAUD, Bench, flash_with, old_program, program, setup};

fn g2(flash: Vec<u8>) -> Bench {
    let mut bench = Bench::new(Setup { loader: LoaderKind::G2, ..setup(flash) });
    bench.run_ms(500);
    bench
}

/// A unit that waits in its loader: menu L, password.
fn in_loader() -> Bench {
    let mut bench = g2(flash_with(&old_program()));
    bench.take();
    enter_loader(&mut bench);
    bench
}

fn complaint(number: u8) -> String {
    format!("Error # 000{number}\r\nRestarting.\r\n{PROMPT}")
}

#[test]
fn a_whole_program_is_loaded_and_started_from_the_address_its_file_names() {
    let mut bench = in_loader();
    let program = new_program();
    let mut records = file(&program);
    *records.last_mut().expect("S7") = "S70500000123D6\r".to_owned();
    let text = upload(&mut bench, &records);
    let said = without_flow_control(&text);
    let expected = "......\r\nApplication started from address 0x0123\r\n\r\nPerforming First Start Initialization";
    assert!(said.starts_with(expected), "{said}");
    assert!(said.contains("Main Menu - AXTC4CO V1.3.0"), "{said}");
    assert_eq!(text.matches('\x13').count(), 5, "one XOFF for each page that is crossed: {text:?}");
    assert_eq!(text.matches('\x11').count(), 5);
    assert_eq!(bench.unit().flash()[..program.len()], program);
    assert_eq!(bench.unit().running(), Running::Application);
    assert_eq!(bench.unit().settings().start_delay, StartDelay::AtOnce);
}

#[test]
fn it_says_nothing_before_its_prompt() {
    let mut bench = g2(flash_with(&[]));
    assert_eq!(bench.take(), PROMPT);
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn any_line_end_any_case_both_headers_and_long_records_are_taken() {
    let program = new_program();
    let with = |end: &str| file(&program).iter().map(|record| record.replace('\r', end)).collect::<Vec<_>>();
    let variants: [Vec<String>; 6] = [
        with("\r\n"),
        with("\n"),
        with(""),
        file(&program).iter().map(|record| record[..1].to_owned() + &record[1..].to_lowercase()).collect(),
        [vec!["S0030000FC\r".to_owned()], data_records(&program, 250), vec![S7.to_owned()]].concat(),
        [vec![S0.to_owned()], data_records(&program, 64), vec![S7.to_owned()]].concat(),
    ];
    each_is_taken(in_loader, &variants, &program);
}

#[test]
fn control_characters_that_end_no_line_are_error_2() {
    let mut bench = in_loader();
    bench.send(b"\r\n\n\r\x11\x13");
    bench.run_ms(100);
    assert_eq!(bench.take(), "");
    for control in ["\0", "\t", "\x1b", "\x7f"] {
        assert_eq!(talk_over(&mut in_loader(), control), complaint(2), "{control:?}");
    }
}

#[test]
fn each_error_of_a_record_has_its_number_and_leads_back_to_the_prompt() {
    let bad_sum = "S0030000FC\r".to_owned() + &s3(0, &[0; 4]).replace("F6\r", "F7\r");
    let cases = [
        ("X", 2),
        ("s0030000FC\r", 2),
        ("S00300Q0FC\r", 2),
        ("S1", 3),
        ("S3", 3),
        ("S7", 3),
        ("S0030000FC\rS2", 3),
        ("S0030000FC\rS5", 3),
        ("S0030000FC\rS304", 3),
        ("S0030000FD\r", 4),
        (&bad_sum, 4),
    ];
    for (text, number) in cases {
        let mut bench = in_loader();
        assert_eq!(talk_over(&mut bench, text), complaint(number), "{text:?}");
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V1.3.0"), "it takes a file afterwards: {said}");
    }
}

#[test]
fn what_comes_while_a_page_is_written_and_what_cannot_be_read_is_error_1() {
    let mut bench = in_loader();
    let records = file(&new_program());
    send_obeying(&mut bench, &records[..18], Instant::NEVER);
    bench.run_ms(5);
    assert!(bench.is_stopped());
    let said = talk_over(&mut bench, "S");
    assert_eq!(without_flow_control(&said), complaint(1));
    assert!(!bench.is_stopped(), "a sender may go on after an error");
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.run_ms(500);
    assert_eq!(bench.take(), complaint(1));
}

#[test]
fn a_second_record_is_parked_and_taken_up_and_a_third_is_error_5() {
    let program = new_program();
    let records = file(&program);
    let mut bench = in_loader();
    // 16 records fill the first page, the 17th and 18th are parked.
    bench.send(records[..19].concat().as_bytes());
    bench.run_ms(300);
    let said = without_flow_control(&(bench.take() + &upload(&mut bench, &records[19..])));
    assert!(said.starts_with("......\r\nApplication started") && said.contains("V1.3.0"), "{said}");
    assert_eq!(bench.unit().flash()[..program.len()], program);

    let mut bench = in_loader();
    let said = without_flow_control(&talk_over(&mut bench, &records[..20].concat()));
    assert!(said.starts_with(&complaint(5)), "{said:?}");
    assert_eq!(bench.unit().flash(), flash_with(&old_program()), "nothing was written");
}

#[test]
fn a_parked_record_that_crosses_as_well_keeps_the_sender_held() {
    let mut bench = in_loader();
    // Page 0, then one word of page 1, then one of page 2.
    let text = S0.to_owned() + &s3(0, &[1; 4]) + &s3(0x100, &[2, 2]) + &s3(0x200, &[3, 3]);
    bench.send(text.as_bytes());
    bench.run_ms(300);
    assert_eq!(bench.take(), "\x13..\x11", "one hold for both pages");
    let said = without_flow_control(&upload(&mut bench, &[S7.to_owned()]));
    assert!(said.starts_with(".\r\nApplication started from address 0x0000\r\n"), "{said:?}");
    let flash = bench.unit().flash();
    assert_eq!((flash[..4].to_vec(), flash[0x200], flash[0x400]), (vec![1; 4], 2, 3));
}

#[test]
fn flash_that_does_not_hold_or_refuses_is_error_6_and_flash_that_never_ends_error_7() {
    for (defect, number) in [(Defect::WornOut, 6), (Defect::Protected, 6), (Defect::Stuck, 7)] {
        let mut bench = in_loader();
        bench.unit().spoil_word(0x123, defect);
        let said = without_flow_control(&upload(&mut bench, &file(&new_program())[..40]));
        assert!(said.starts_with(&format!(".\r\nError # 000{number}\r\nRestarting.\r\n")), "{defect:?}: {said}");
        assert_eq!(bench.unit().running(), Running::Loader);
        bench.unit().repair_flash();
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V1.3.0"), "{said}");
    }
}

#[test]
fn the_sender_is_held_for_silence_erasing_and_programming() {
    for (flash, erase_us) in [(flash_with(&old_program()), 20_000), (flash_with(&[]), 0)] {
        let mut bench = g2(flash);
        if bench.unit().running() == Running::Application {
            enter_loader(&mut bench);
        }
        bench.take();
        let text = file(&new_program())[..18].concat();
        let crossing = bench.now + character_time(BAUD) * (text.len() as u32 - 1);
        bench.send(text.as_bytes());
        bench.run_ms(200);
        let moment = |wanted: u8| bench.heard.iter().rev().find(|(_, byte)| *byte == wanted).expect("flow control").0;
        let (held, released) = (moment(super::XOFF), moment(super::XON));
        let late = held.since(crossing);
        assert!(late < Duration::from_micros(200), "XOFF at the last digit of the crossing record: {late:?}");
        // CR, 0.6 ms of silence, erasing where a bit has to become 1, 256 words of 20 us, the dot and XON on the line.
        let busy = Duration::from_micros(87 + 600 + erase_us + 256 * 20 + 2 * 87);
        let took = released.since(crossing);
        assert!(took.abs_diff(busy) < Duration::from_micros(300), "{took:?} instead of {busy:?}");
    }
}

#[test]
fn records_still_parked_at_s7_are_lost_and_the_start_is_reported() {
    let mut bench = in_loader();
    let page = vec![0x5A; 512];
    let mut text = S0.to_owned() + &data_records(&page, 32).concat();
    text += &s3(0x1000, &[1, 2, 3, 4]);
    text += &s3(0x1002, &[5, 6]);
    text += S7;
    let said = without_flow_control(&talk_over(&mut bench, &text));
    assert!(said.starts_with(".\r\nApplication started from address 0x0000\r\n"), "{said}");
    assert_eq!(bench.unit().flash()[..512], page);
    assert_eq!(bench.unit().flash()[0x2000..0x2006], [0xFF; 6], "the parked records are nowhere");
}

#[test]
fn words_nobody_mentions_stay_and_addresses_of_other_parts_are_folded_or_skipped_without_a_word() {
    for (address, offset) in
        [(0x310u32, Some(0x620)), (0x0001_9000, Some(0x12000)), (0x0200_0000, None), (0x0040_9000, None)]
    {
        let mut bench = in_loader();
        let said = upload(&mut bench, &[S0.to_owned(), s3(address, &[0, 0, 0xFF, 0xFF]), S7.to_owned()]);
        assert!(!said.contains("Error"), "{address:#x}: {said}");
        let mut expected = flash_with(&old_program());
        if let Some(offset) = offset {
            expected[offset..offset + 4].copy_from_slice(&[0, 0, 0xFF, 0xFF]);
        }
        assert!(bench.unit().flash() == expected, "{address:#x}");
    }
}

#[test]
fn an_upload_that_has_begun_keeps_the_unit_in_its_loader() {
    let mut bench = in_loader();
    upload(&mut bench, &[S0.to_owned()]);
    assert_eq!(bench.unit().settings().start_delay, StartDelay::WaitsForEver);
    for off_ms in [1, 5_000] {
        bench.power_off();
        bench.run_ms(off_ms);
        bench.power_on();
        bench.run(Duration::from_secs(60));
        assert!(bench.take().ends_with(PROMPT), "the old program is intact, and yet");
        assert_eq!(bench.unit().running(), Running::Loader);
    }
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn a_second_upload_saves_a_unit_cut_off_at_any_moment() {
    (0..100).for_each(|seed| cut_and_save_at_any_moment(LoaderKind::G2, seed));
}

#[test]
fn it_loads_the_eight_channel_scanner_as_well() {
    let product = Product::named("AXRTD8CO").expect("built in");
    let flash = vec![0xFF; product.flash.program_words as usize * 2];
    let setup = Setup { product, loader: LoaderKind::G2, seed: 1, dialect: 0, flash, parameters: Vec::new() };
    let mut bench = Bench::new(setup);
    bench.run_ms(500);
    assert!(bench.take().ends_with("Waiting for application S-Record\r\n"));
    let said = upload(&mut bench, &file(&program("AXRTD8CO", Version::new(2, 3, 0), 1500)));
    assert!(said.contains("Application started from address 0x0000\r\n") && said.contains("V2.3.0"), "{said}");
}
