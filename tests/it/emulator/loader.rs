//! The G1 loader: uploads that work, each of its errors, what it does silently, and what a power cut leaves.

use axcon::device::LoaderKind;
use axcon::emulator::memory::{Defect, StartDelay};
use axcon::emulator::{Area, Running, Setup};
use axcon::image::{DefectId, check};
use axcon::rng::Rng;
use axcon::time::{Duration, Instant, character_time};
use axcon::version::Version;

use super::sender::{S0, S7, data_records, file, s3, send_obeying, talk_over, upload, without_flow_control};
use super::{BAUD, Bench, flash_with, old_program, product, program, setup};

pub(super) const PROMPT: &str = "Waiting for application S-Record.\r\n";

pub(super) fn new_program() -> Vec<u8> {
    program("AXTC4CO", Version::new(1, 3, 0), 1500)
}

/// A unit that waits in its loader: menu L, password.
fn in_loader() -> Bench {
    let mut bench = Bench::at_menu();
    enter_loader(&mut bench);
    bench
}

pub(super) fn enter_loader(bench: &mut Bench) {
    let text = bench.keys(b"lAXIO-2010\r");
    assert!(text.ends_with(PROMPT), "{text}");
}

// B-212, B-213
#[test]
fn a_whole_program_is_loaded_and_started() {
    let mut bench = in_loader();
    let program = new_program();
    let text = upload(&mut bench, &file(&program));
    let said = without_flow_control(&text);
    let expected = "......\r\n\
        Loaded 0x05DC Program and 0x0000 Data words.\r\n\
        Application started.\r\n\
        \r\n\
        Performing First Start Initialization of the controller program...\r\n\
        \r\n\
        Axiomatic Technologies Corporation\r\n\
        AXTC4CO - 4 Thermocouple Scanner\r\n\
        Software Version V1.3.0, built 2026-01-31 12:34:56\r\n";
    assert!(said.starts_with(expected), "{said}");
    assert!(said.contains("Main Menu - AXTC4CO V1.3.0"), "{said}");
    assert_eq!(text.matches('\x13').count(), 5, "one XOFF for each page that is crossed: {text:?}");
    assert_eq!(text.matches('\x11').count(), 5);
    assert_eq!(bench.unit().flash()[..program.len()], program);
    assert_eq!(bench.unit().running(), Running::Application);

    bench.power_off();
    bench.power_on();
    bench.run_ms(500);
    let text = bench.take();
    assert!(text.contains("V1.3.0") && !text.contains("First Start"), "the first start is over: {text}");
}

/// Files of one program in several forms, each to a unit that waits for it.
pub(super) fn each_is_taken(in_loader: fn() -> Bench, files: &[Vec<String>], program: &[u8]) {
    for records in files {
        let mut bench = in_loader();
        let text = upload(&mut bench, records);
        assert!(text.contains("V1.3.0") && !text.contains("Error"), "{text:?}");
        assert_eq!(&bench.unit().flash()[..program.len()], program);
    }
}

#[test]
fn long_records_and_lower_case_and_crlf_are_taken_as_well() {
    let program = new_program();
    let variants: [Vec<String>; 3] = [
        [vec!["S0030000FC\r".to_owned()], data_records(&program, 250), vec![S7.to_owned()]].concat(),
        file(&program).iter().map(|record| record.replace('\r', "\r\n")).collect(),
        file(&program).iter().map(|record| record[..1].to_owned() + &record[1..].to_lowercase()).collect(),
    ];
    each_is_taken(in_loader, &variants, &program);
}

#[test]
fn stored_writes_make_the_same_flash() {
    let mut bench = in_loader();
    let mut flash = flash_with(&old_program());
    upload(&mut bench, &file(&new_program()));
    while let Some(store) = bench.unit().poll_store() {
        if store.area == Area::Flash {
            flash[store.offset..store.offset + store.bytes.len()].copy_from_slice(&store.bytes);
        }
    }
    assert!(flash == bench.unit().flash());
}

#[test]
fn the_sender_is_held_from_xoff_to_xon_while_a_page_is_written() {
    let mut bench = in_loader();
    let records = file(&new_program());
    let start = bench.now;
    // The header and 17 records: the last one begins the second page.
    let mut held = Vec::new();
    bench.send(records[..18].concat().as_bytes());
    let sent = records[..18].concat().len() as u32;
    while bench.now.since(start) < Duration::from_millis(200) {
        bench.run(Duration::from_micros(10));
        if bench.unit().holds_sender() {
            held.push(bench.now.since(start));
        }
    }
    let (first, last) = (held[0], held[held.len() - 1]);
    let last_digit = character_time(BAUD) * (sent - 1);
    assert!(first.abs_diff(last_digit) < Duration::from_micros(20), "XOFF at the last digit of the crossing record");
    // CR, 0.6 ms of silence, erase, 256 words.
    let busy = Duration::from_micros(87 + 600 + 20_000 + 256 * 20);
    let took = last - first;
    assert!(took > busy - Duration::from_micros(200) && took < busy + Duration::from_micros(200), "{took:?}");
    assert!(bench.take().contains("\x13.\x11"), "a dot for the page, then XON");
    assert!(!bench.unit().holds_sender());
}

#[test]
fn erased_flash_is_not_erased_again() {
    let time = |flash: Vec<u8>| {
        let mut bench = Bench::new(setup(flash));
        bench.run_ms(500);
        if bench.unit().running() == Running::Application {
            enter_loader(&mut bench);
        }
        bench.take();
        let start = bench.now;
        send_obeying(&mut bench, &file(&new_program()), Instant::NEVER);
        bench.now.since(start)
    };
    let saved = time(flash_with(&old_program())) - time(flash_with(&[]));
    let erase = Duration::from_millis(20);
    // 1024 old words lie in four pages; the fifth and sixth page are erased in both.
    assert!(saved.abs_diff(erase * 4) < Duration::from_millis(3), "{saved:?}");
}

// B-215
#[test]
fn each_error_has_its_number_and_leads_back_to_the_prompt() {
    let bad_sum = s3(0, &[0; 4]).replace("F6\r", "F7\r");
    assert_ne!(bad_sum, s3(0, &[0; 4]));
    let cases = [
        ("X", 2),
        ("s0030000FC\r", 2),
        ("S00300Q0FC\r", 2),
        ("S1", 3),
        ("S3", 3),
        ("S7", 3),
        ("S0030000FC\rS2", 3),
        ("S0030000FC\rS304", 3),
        ("S0030000FD\r", 4),
        (&("S0030000FC\r".to_owned() + &bad_sum), 4),
    ];
    for (text, number) in cases {
        let mut bench = in_loader();
        let said = talk_over(&mut bench, text);
        assert_eq!(said, format!("Error # 000{number}\r\nRestarting.\r\n{PROMPT}"), "{text:?}");
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V1.3.0"), "it takes a file afterwards: {said}");
    }
}

#[test]
fn control_characters_alone_are_no_error() {
    let mut bench = in_loader();
    let controls: Vec<u8> = (0..32u8).chain([127]).collect();
    bench.send(&controls);
    bench.run_ms(100);
    assert_eq!(bench.take(), "");
}

#[test]
fn characters_during_a_page_write_are_lost_and_give_error_1() {
    let mut bench = in_loader();
    let records = file(&new_program());
    send_obeying(&mut bench, &records[..18], Instant::NEVER);
    bench.run_ms(5);
    assert!(bench.is_stopped());
    let said = talk_over(&mut bench, "S");
    assert!(without_flow_control(&said).starts_with("Error # 0001\r\nRestarting.\r\n"), "{said:?}");
    assert!(!bench.is_stopped(), "a sender may go on after an error");
    let said = upload(&mut bench, &records);
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn a_second_record_while_one_is_parked_is_error_5() {
    let mut bench = in_loader();
    let records = file(&new_program());
    // 16 records fill the first page, the 17th is parked, the 18th is one too many.
    let said = talk_over(&mut bench, &records[..19].concat());
    assert!(without_flow_control(&said).starts_with("Error # 0005\r\nRestarting.\r\n"), "{said:?}");
    assert_eq!(bench.unit().flash(), flash_with(&old_program()), "nothing was written");
}

#[test]
fn a_record_begun_after_xoff_is_taken_up_again_after_xon() {
    let mut bench = in_loader();
    let program = new_program();
    let records = file(&program);
    let (late, rest) = records[18].split_at(60);
    // An adapter with 60 characters in its buffer: less than a record, so nothing is lost.
    bench.send((records[..18].concat() + late).as_bytes());
    bench.run_ms(250);
    let mut remaining = vec![rest.to_owned()];
    remaining.extend_from_slice(&records[19..]);
    let said = upload(&mut bench, &remaining);
    assert!(said.contains("V1.3.0") && !said.contains("Error"), "{said:?}");
    assert_eq!(bench.unit().flash()[..program.len()], program);
}

#[test]
fn a_worn_out_word_is_error_6() {
    let mut bench = in_loader();
    bench.unit().spoil_word(0x123, Defect::WornOut);
    let said = upload(&mut bench, &file(&new_program())[..40]);
    let said = without_flow_control(&said);
    assert!(said.starts_with(".\r\nError # 0006\r\nRestarting.\r\n"), "page 0 is good, page 1 is not: {said}");
    bench.unit().repair_flash();
    // The sender of above went on talking; a new attempt begins with S0 all the same.
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn a_flash_that_is_protected_is_error_6_and_one_that_never_ends_error_7() {
    for (defect, number) in [(Defect::Protected, 6), (Defect::Stuck, 7)] {
        let mut bench = in_loader();
        bench.unit().spoil_word(0x123, defect);
        let said = without_flow_control(&upload(&mut bench, &file(&new_program())[..40]));
        assert!(said.starts_with(&format!(".\r\nError # 000{number}\r\nRestarting.\r\n")), "{defect:?}: {said}");
        bench.unit().repair_flash();
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V1.3.0"), "{said}");
    }
}

#[test]
fn a_character_that_cannot_be_read_is_error_1_at_once_and_nothing_while_an_error_is_told() {
    let mut bench = in_loader();
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.unit().handle_framing_error(now);
    bench.run_ms(500);
    assert_eq!(bench.take(), format!("Error # 0001\r\nRestarting.\r\n{PROMPT}"));
}

#[test]
fn a_character_that_cannot_be_read_while_a_page_is_written_is_error_1_when_that_is_done() {
    let mut bench = in_loader();
    let records = file(&new_program());
    send_obeying(&mut bench, &records[..18], Instant::NEVER);
    bench.run_ms(5);
    assert!(bench.is_stopped());
    bench.take();
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    assert_eq!(bench.take(), "", "it is not looked at yet");
    bench.run_ms(500);
    assert_eq!(without_flow_control(&bench.take()), format!("Error # 0001\r\nRestarting.\r\n{PROMPT}"));
}

#[test]
fn what_is_sent_while_it_says_who_it_is_is_not_heard() {
    let mut bench = Bench::at_menu();
    bench.send(b"lAXIO-2010\r");
    bench.run_ms(2);
    // The header of the file leaves before the header of the loader has.
    let said = talk_over(&mut bench, &S0[..S0.len() - 8]);
    assert!(said.ends_with(PROMPT), "{said}");
    let said = talk_over(&mut bench, &S0[S0.len() - 8..]);
    assert!(said.starts_with("Error # 0002"), "the rest of a record alone is not a record: {said}");
}

#[test]
fn another_header_begins_the_load_from_scratch_even_while_the_sender_is_held() {
    let mut bench = in_loader();
    // The last record begins the second page, so it is parked and the sender held.
    let first = file(&new_program())[..18].concat() + S0;
    let said = talk_over(&mut bench, &first);
    assert_eq!(said, "\x13\x11", "held, and let go on by the header");
    let said = talk_over(&mut bench, &(s3(0x310, &[1, 2, 3, 4]) + S7));
    assert!(without_flow_control(&said).contains("Loaded 0x0002 Program and 0x0000 Data words."), "{said}");
}

#[test]
fn a_character_that_cannot_be_read_after_s7_is_error_1_and_nothing_is_started() {
    let mut bench = in_loader();
    let records = file(&new_program());
    send_obeying(&mut bench, &records, Instant::NEVER);
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.run_ms(500);
    let said = without_flow_control(&bench.take());
    assert!(said.ends_with(&format!("Error # 0001\r\nRestarting.\r\n{PROMPT}")), "{said}");
    assert_eq!(bench.unit().running(), Running::Loader);
}

#[test]
fn after_s7_the_last_page_waits_for_silence_whatever_is_on_the_line() {
    let mut bench = in_loader();
    let program = new_program();
    let records = file(&program);
    send_obeying(&mut bench, &records, Instant::NEVER);
    // Nothing of this is read, but it is not silence: characters come closer than the 0.6 ms the loader waits for.
    for _ in 0..400 {
        bench.send(b"\r");
        bench.run(Duration::from_micros(250));
    }
    let last = program.len() - 2;
    assert_eq!(bench.unit().flash()[last..last + 2], [0xFF; 2], "it is not written yet");
    bench.run_ms(500);
    assert_eq!(bench.unit().flash()[last..last + 2], program[last..], "now it is");
}

#[test]
fn a_sender_that_goes_on_after_an_error_causes_a_cascade_with_an_end() {
    let mut bench = in_loader();
    let mut records = file(&new_program());
    records[4] = records[4].replace("\r", "").to_lowercase() + "0\r";
    let said = talk_over(&mut bench, &records[..30].concat());
    let (twos, threes) = (said.matches("Error # 0002").count(), said.matches("Error # 0003").count());
    let said_in_all = said.matches("Error # ").count();
    assert!(said_in_all > 10 && twos > 5, "{said}");
    assert_eq!(twos + threes, said_in_all, "nothing but invalid characters and records: {said}");
    let spent = bench.take();
    assert_eq!(spent, "", "the cascade ends with the talk");
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn a_record_still_parked_at_s7_is_lost_and_success_is_reported() {
    let mut bench = in_loader();
    let page: Vec<u8> = vec![0x5A; 512];
    let mut text = S0.to_owned() + &data_records(&page, 32).concat();
    text += &s3(0x1000, &[1, 2, 3, 4]);
    text += S7;
    let said = without_flow_control(&talk_over(&mut bench, &text));
    assert!(
        said.starts_with(".\r\nLoaded 0x0100 Program and 0x0000 Data words.\r\nApplication started.\r\n"),
        "{said}"
    );
    assert_eq!(bench.unit().flash()[..512], page);
    assert_eq!(bench.unit().flash()[0x2000..0x2004], [0xFF; 4], "the parked record is nowhere");
}

#[test]
fn words_of_a_page_that_the_file_does_not_mention_stay() {
    let mut bench = in_loader();
    let old = flash_with(&old_program());
    upload(&mut bench, &[S0.to_owned(), s3(0x310, &[0, 0, 0xFF, 0xFF]), S7.to_owned()]);
    let mut expected = old;
    expected[0x620..0x624].copy_from_slice(&[0, 0, 0xFF, 0xFF]);
    assert!(bench.unit().flash() == expected);
}

#[test]
fn addresses_of_a_larger_part_are_folded_and_others_skipped_without_a_word() {
    let cases: [(u32, Option<usize>, &str); 8] = [
        (0x0000_9000, Some(0x12000), "Loaded 0x0002 Program and 0x0000 Data words."),
        (0x0001_9000, Some(0x12000), "Loaded 0x0002 Program and 0x0000 Data words."),
        (0x0003_9000, Some(0x12000), "Loaded 0x0002 Program and 0x0000 Data words."),
        (0x001F_9000, Some(0x12000), "Loaded 0x0002 Program and 0x0000 Data words."),
        (0x0020_9000, None, "Loaded 0x0000 Program and 0x0002 Data words."),
        (0x0200_9000, None, "Loaded 0x0000 Program and 0x0002 Data words."),
        (0x0040_9000, None, "Loaded 0x0000 Program and 0x0000 Data words."),
        (0x8000_9000, None, "Loaded 0x0000 Program and 0x0000 Data words."),
    ];
    for (address, offset, loaded) in cases {
        let mut bench = in_loader();
        let said = upload(&mut bench, &[S0.to_owned(), s3(address, &[1, 2, 3, 4]), S7.to_owned()]);
        assert!(said.contains(loaded) && !said.contains("Error"), "{address:#x}: {said}");
        let mut expected = flash_with(&old_program());
        if let Some(offset) = offset {
            expected[offset..offset + 4].copy_from_slice(&[1, 2, 3, 4]);
        }
        assert!(bench.unit().flash() == expected, "{address:#x}");
    }
}

/// What the check of an image says of data outside of the flash is what the loader does with it.
#[test]
fn the_check_and_the_loader_agree_on_where_data_goes() {
    let target = product().target_with(LoaderKind::G1);
    let high_halves = [0x0001, 0x0003, 0x001F, 0x0020, 0x0021, 0x0100, 0x0200, 0x0220, 0x0300, 0x0400, 0x0600, 0xFFFF];
    for address in high_halves.map(|high| high << 16 | 0x9000u32) {
        let mut bench = in_loader();
        let records = [S0.to_owned(), s3(address, &[1, 2, 3, 4]), S7.to_owned()];
        let said = upload(&mut bench, &records);
        let is_folded = bench.unit().flash()[0x12000..0x12004] == [1, 2, 3, 4];
        let file = records.concat();
        let report =
            check(file.as_bytes(), None, std::slice::from_ref(&target), Some("AXTC4CO"), &[]).expect("a slice");
        let found = report.defects.iter().find(|defect| {
            matches!(defect.id, DefectId::DataMemory | DefectId::OutOfRange) && defect.message.contains("9000")
        });
        let found = found.unwrap_or_else(|| panic!("{address:#x}: {:?}", report.defects));
        let fate = (found.id == DefectId::DataMemory, found.message.contains("folds that to 0x9000"));
        assert_eq!(fate, (said.contains("and 0x0002 Data words"), is_folded), "{address:#x}: {said}\n{found:?}");
    }
}

#[test]
fn an_image_with_byte_addresses_is_loaded_with_holes_and_does_not_start() {
    let mut bench = in_loader();
    let program = new_program();
    let mut records = vec![S0.to_owned()];
    records.extend(program.chunks(32).enumerate().map(|(number, data)| s3(number as u32 * 32, data)));
    records.push(S7.to_owned());
    let said = upload(&mut bench, &records);
    assert!(said.contains("Application started.") && said.ends_with(PROMPT), "{said}");
    assert_eq!(bench.unit().flash()[32..64], old_program()[32..64], "every second half line is what it was");
}

#[test]
fn a_product_name_in_lower_case_starts_as_the_check_accepts_it() {
    let mut bench = in_loader();
    let said = upload(&mut bench, &file(&program("axtc4co", Version::new(1, 3, 0), 1500)));
    assert!(said.contains("axtc4co V1.3.0"), "{said}");
    assert_eq!(bench.unit().running(), Running::Application);
}

#[test]
fn a_wrong_check_sum_or_product_does_not_start() {
    let mut spoiled = new_program();
    spoiled[1234] ^= 1;
    let foreign = program("AXRTD8CO", Version::new(1, 3, 0), 1500);
    for program in [spoiled, foreign] {
        let mut bench = in_loader();
        let said = without_flow_control(&upload(&mut bench, &file(&program)));
        let (_, after) = said.split_once("Application started.\r\n").expect("G1 reports success");
        assert_eq!(after, format!("(c) Motorola Inc. S-Record loader. Version 1.3\r\n{PROMPT}"));
        assert_eq!(bench.unit().running(), Running::Loader);
        assert_eq!(bench.unit().settings().start_delay, StartDelay::AtOnce);
        bench.power_off();
        bench.power_on();
        bench.run_ms(500);
        assert!(bench.take().ends_with(PROMPT), "nor after a power cycle");
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("First Start") && said.contains("V1.3.0"), "{said}");
    }
}

#[test]
fn an_empty_unit_waits_in_its_loader() {
    let mut bench = Bench::new(setup(flash_with(&[])));
    bench.run_ms(500);
    assert_eq!(bench.take(), format!("(c) Motorola Inc. S-Record loader. Version 1.3\r\n{PROMPT}"));
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
}

#[test]
fn an_upload_that_has_begun_keeps_the_unit_in_its_loader() {
    let mut bench = in_loader();
    upload(&mut bench, &[S0.to_owned()]);
    assert_eq!(bench.unit().settings().start_delay, StartDelay::WaitsForEver);
    bench.power_off();
    bench.power_on();
    bench.run_ms(500);
    assert!(bench.take().ends_with(PROMPT), "the old program is intact, and yet");
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V1.3.0"), "{said}");
    assert_eq!(bench.unit().settings().start_delay, StartDelay::AtOnce);
}

#[test]
fn settings_survive_an_upload() {
    let mut bench = Bench::at_menu();
    bench.keys(b"tp700\r");
    let before = bench.unit().settings().clone();
    enter_loader(&mut bench);
    upload(&mut bench, &file(&new_program()));
    assert_eq!(*bench.unit().settings(), before);
}

/// A unit whose power goes in the middle of an upload, and which a second upload has to save.
pub(super) fn cut_and_save(loader: LoaderKind, seed: u64, send: impl FnOnce(&mut Bench, &[String])) {
    let program = program("AXTC4CO", Version::new(1, 3, 0), 700);
    let old = old_program();
    let mut bench = Bench::new(Setup { seed, loader, ..setup(flash_with(&old)) });
    bench.run_ms(400);
    enter_loader(&mut bench);
    send(&mut bench, &file(&program));
    bench.power_off();
    bench.run_ms(20);
    bench.take();

    let (flash, parameters) = bench.memories_without_power(flash_with(&old));

    let mut bench = Bench::new(Setup { seed, loader, flash, parameters, ..setup(Vec::new()) });
    bench.run_ms(500);
    let text = bench.take();
    match bench.unit().running() {
        Running::Loader => assert!(text.ends_with(PROMPT), "seed {seed}: {text}"),
        // The power went before S0 or after the end of the load.
        Running::Application => enter_loader(&mut bench),
        running @ (Running::Off | Running::Starting) => panic!("seed {seed}: {running:?}"),
    }
    let said = upload(&mut bench, &file(&program));
    assert!(said.contains("V1.3.0") && !said.contains("Error"), "seed {seed}: {said}");
    // A cut while a page was erased may have spoiled words of it that no file mentions: they are nobody's.
    let page_bytes = product().flash.page_words as usize * 2;
    let pages_end = program.len().next_multiple_of(page_bytes);
    assert!(bench.unit().flash()[..program.len()] == program, "seed {seed}: flash differs from the image");
    assert!(
        bench.unit().flash()[pages_end..] == flash_with(&old)[pages_end..],
        "seed {seed}: another page has changed"
    );
}

#[test]
fn a_second_upload_saves_a_unit_cut_off_after_any_seventh_record() {
    for records in (0..46).step_by(7) {
        cut_and_save(LoaderKind::G1, 1, |bench, file| send_obeying(bench, &file[..records], Instant::NEVER));
    }
}

/// The same, cut off at a moment that the seed says.
pub(super) fn cut_and_save_at_any_moment(loader: LoaderKind, seed: u64) {
    let at = Duration::from_micros(Rng::new(seed).below(450_000));
    cut_and_save(loader, seed, |bench, file| {
        let until = bench.now + at;
        send_obeying(bench, file, until);
        let rest = until.since(bench.now);
        bench.run(rest);
    });
}

#[test]
fn a_second_upload_saves_a_unit_cut_off_at_any_moment() {
    (0..200).for_each(|seed| cut_and_save_at_any_moment(LoaderKind::G1, seed));
}

#[test]
fn a_cut_in_the_middle_of_a_page_leaves_it_half_written() {
    let mut bench = Bench::new(setup(flash_with(&[])));
    bench.run_ms(500);
    let records = file(&vec![0x5A; 1024]);
    bench.send(records[..18].concat().as_bytes());
    while !bench.unit().holds_sender() {
        bench.run(Duration::from_micros(50));
    }
    // CR, silence, then about a hundred words of 20 µs each; the page was erased already.
    bench.run(Duration::from_micros(87 + 600 + 2_000));
    bench.power_off();
    let written = bench.unit().flash().iter().take_while(|&&byte| byte == 0x5A).count() / 2;
    assert!((95..=105).contains(&written), "{written} words");
    assert!(bench.unit().flash()[written * 2..].iter().all(|&byte| byte == 0xFF));
}

#[test]
fn a_whole_flash_takes_the_time_of_the_line_and_of_its_pages() {
    let words = product().flash.program_words as usize;
    let program = program("AXTC4CO", Version::new(2, 0, 0), words);
    let mut bench = in_loader();
    let start = bench.now;
    let records = file(&program);
    let characters = records.iter().map(String::len).sum::<usize>();
    send_obeying(&mut bench, &records, Instant::NEVER);
    let took = bench.now.since(start);
    bench.run_ms(500);
    let text = bench.take();
    assert!(text.contains("Loaded 0x10000 Program and 0x0000 Data words.") && text.contains("V2.0.0"), "{text:?}");
    assert!(bench.unit().flash() == program);
    let line = Duration::from_nanos(86_805) * characters as u32;
    // 252 pages of erased flash and 4 with the old program; 0.6 ms of silence before each.
    let pages = Duration::from_micros((600 + 256 * 20) * 256) + Duration::from_millis(20 * 4);
    assert!(took > line && took < line + pages + pages / 10, "{took:?} for {line:?} on the line and {pages:?} busy");
}
