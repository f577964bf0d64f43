//! The G3 loader: the dialogue of the AXRTD8CO's manual, uploads that work, its errors, and what it does to senders
//! that do not know it.

use axcon::device::{LoaderKind, Product, RING};
use axcon::emulator::memory::{Defect, StartDelay};
use axcon::emulator::{Running, Setup};
use axcon::rng::Rng;
use axcon::time::{Duration, Instant, character_time};
use axcon::version::Version;

use super::sender::{S0, S7, file, record, s3, send_obeying, talk_over, upload, without_flow_control};
use super::{BAUD, Bench, XOFF, XON, program};

const HEADER: &str = "\r\n56F83xx Serial Bootloader v2.0\r\nHit any key to continue ";
const PROMPT: &str = "Waiting for application S-Record\r\n";
const LOADED: &str = "S-File has been loaded successfully\r\n";
/// 512 sectors of 512 words.
const ERASE: Duration = Duration::from_millis(10_240);
/// Words erased together.
const SECTOR: u32 = 512;

fn rtd8() -> &'static Product {
    Product::named("AXRTD8CO").expect("built in")
}

fn flash_with(program: &[u8]) -> Vec<u8> {
    let mut flash = program.to_vec();
    flash.resize(rtd8().flash.program_words as usize * 2, 0xFF);
    flash
}

fn setup(flash: Vec<u8>) -> Setup {
    Setup { product: rtd8(), loader: LoaderKind::G3, seed: 1, dialect: 0, flash, parameters: Vec::new() }
}

fn old_program() -> Vec<u8> {
    program("AXRTD8CO", Version::new(2, 1, 1), 1024)
}

fn new_program() -> Vec<u8> {
    program("AXRTD8CO", Version::new(2, 2, 0), 1500)
}

fn at_menu() -> Bench {
    let mut bench = Bench::new(setup(flash_with(&old_program())));
    bench.run_ms(500);
    bench.take();
    bench
}

/// A unit that waits for a file: menu L, password, any key.
fn in_loader() -> Bench {
    let mut bench = at_menu();
    enter_loader(&mut bench);
    bench
}

fn enter_loader(bench: &mut Bench) {
    let text = bench.keys(b"lAXIO-2010\r");
    assert!(text.ends_with(HEADER), "{text}");
    press_key(bench);
}

fn press_key(bench: &mut Bench) {
    let text = bench.keys(b" ");
    assert!(text.ends_with(PROMPT), "{text}");
}

/// A loader that has erased and waits for data.
fn erased() -> Bench {
    let mut bench = in_loader();
    bench.send(S0.as_bytes());
    bench.run(ERASE + Duration::from_millis(100));
    bench.take();
    bench
}

fn complaint(bits: &str) -> String {
    format!("Error: {bits}\r\n{PROMPT}")
}

/// B-143, B-144: the password, the header, any key, the prompt.
#[test]
fn the_right_password_leads_to_a_header_and_any_key_to_the_prompt() {
    for (menu, key) in [(b'l', b'\r'), (b'L', b' '), (b'l', b'S'), (b'L', XON)] {
        let mut bench = at_menu();
        bench.send(&[menu]);
        bench.run_ms(100);
        let said = bench.keys(b"AXIO-2010\r");
        assert!(said.contains("Bootloader") && said.ends_with(HEADER), "{said}");
        assert_eq!(bench.unit().running(), Running::Loader);
        assert_eq!(bench.keys(&[key]), format!("\r\n{PROMPT}"));
    }
    let mut bench = at_menu();
    let said = bench.keys(b"laxio-2010\r");
    assert!(!said.contains("Bootloader"), "upper and lower case matter: {said}");
    assert_eq!(bench.unit().running(), Running::Application);
}

/// B-145, B-146: dots, the text at the end, the new banner.
#[test]
fn a_whole_program_is_loaded_and_started() {
    let mut bench = in_loader();
    let program = new_program();
    let text = upload(&mut bench, &file(&program));
    let said = without_flow_control(&text);
    let expected = format!("PROGRAM&DATA\r\n{}\r\n{LOADED}", ".".repeat(94));
    assert!(said.starts_with(&expected), "{said}");
    assert!(said.contains("AXRTD8CO") && said.contains("V2.2.0") && !said.contains("V2.1.1"), "{said}");
    assert_eq!(text.matches('\x13').count(), 96, "one XOFF for each record");
    assert_eq!(text.matches('\x11').count(), 96, "and one XON");
    assert!(bench.unit().flash() == flash_with(&program), "nothing is left of the old program");
    assert_eq!(bench.unit().running(), Running::Application);
    assert_eq!(bench.unit().settings().start_delay, StartDelay::AtOnce);
}

/// Errata E-I12.
#[test]
fn without_a_key_for_ten_seconds_the_application_starts() {
    let mut bench = at_menu();
    let text = bench.keys(b"lAXIO-2010\r");
    assert!(text.ends_with(HEADER), "{text}");
    bench.run_ms(9_400);
    assert_eq!(bench.take(), "");
    bench.run_ms(1_000);
    let said = bench.take();
    assert!(said.starts_with("\r\n") && said.contains("V2.1.1"), "the old software is untouched: {said}");
    assert_eq!(bench.unit().running(), Running::Application);
}

#[test]
fn a_unit_without_an_application_waits_for_a_key_for_ever() {
    let mut bench = Bench::new(setup(flash_with(&[])));
    bench.run(Duration::from_secs(60));
    assert_eq!(bench.take(), HEADER);
    press_key(&mut bench);
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V2.2.0"), "{said}");
}

#[test]
fn the_sender_is_held_while_everything_is_erased() {
    let mut bench = in_loader();
    let start = bench.now;
    bench.send(S0.as_bytes());
    bench.run_ms(50);
    assert!(bench.is_stopped() && bench.unit().holds_sender());
    assert_eq!(bench.unit().settings().start_delay, StartDelay::WaitsForEver);
    while bench.is_stopped() {
        bench.run_ms(1);
    }
    let took = bench.now.since(start);
    assert!(took > ERASE && took < ERASE + Duration::from_millis(10), "{took:?}");
    assert!(bench.unit().flash().iter().all(|&byte| byte == 0xFF));
}

#[test]
fn what_the_ring_holds_while_it_erases_is_taken_and_one_character_more_is_not() {
    let program = new_program();
    let records = file(&program);
    // S0 has been read when the erasing begins; then the ring takes what comes.
    let waiting = records[1..].concat();
    for (late, good) in [(RING, true), (RING + 1, false)] {
        let mut bench = in_loader();
        bench.send(S0.as_bytes());
        bench.send(&waiting.as_bytes()[..late]);
        bench.run(ERASE + Duration::from_millis(100));
        let mut remaining = vec![waiting[late..].to_owned()];
        if !good {
            remaining.clear();
        }
        let said = without_flow_control(&upload(&mut bench, &remaining));
        assert_eq!(!said.contains("Error"), good, "{late} characters: {said}");
        assert_eq!(said.contains("V2.2.0"), good, "{late} characters: {said}");
    }
}

#[test]
fn each_record_is_acknowledged_by_a_short_hold() {
    let mut bench = erased();
    let record = s3(0, &[0x5A; 32]);
    bench.send(record.as_bytes());
    let last = bench.now + character_time(BAUD) * record.len() as u32;
    bench.run_ms(20);
    let heard: Vec<(Instant, u8)> = bench.heard[bench.taken..].to_vec();
    assert_eq!(heard.iter().map(|&(_, byte)| byte).collect::<Vec<_>>(), [XOFF, b'.', XON]);
    assert!(!bench.unit().holds_sender());
    // The words are programmed before the checksum is read: 16 of 20 µs, while its digits and the CR come.
    let took = heard[2].0.since(last);
    assert!(took < Duration::from_micros(400), "{took:?} from the CR to the XON");
}

#[test]
fn each_error_has_its_bits_and_leads_back_to_the_prompt() {
    let bad_sum = s3(0, &[0; 4]).replace("F6\r", "F7\r");
    let odd = record(3, 0x3_FFFF, &[1, 2, 3, 4]);
    let data_memory = s3(0x0200_0000, &[1, 2]);
    let entry = record(7, 0x4_0000, &[]);
    let twice = s3(0x40, &[0x0F, 0x0F]) + &s3(0x40, &[0xF0, 0xF0]);
    let cases = [
        (bad_sum.as_str(), "0001"),
        ("X", "0002"),
        ("\r", "0002"),
        ("S5", "0002"),
        (&odd, "0080"),
        (&data_memory, "0080"),
        (&entry, "0020"),
        (&twice, "0010"),
    ];
    for (text, bits) in cases {
        let mut bench = erased();
        let said = without_flow_control(&talk_over(&mut bench, text));
        let said = said.trim_start_matches(".\r\n");
        // What follows the error in the record is spoken into its text, and lost.
        assert!(said.starts_with(&complaint(bits)), "{text:?}: {said:?}");
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V2.2.0"), "it takes a file afterwards: {said}");
    }
    let mut bench = in_loader();
    assert_eq!(without_flow_control(&talk_over(&mut bench, "S3")), complaint("0002"), "data before the header");
    assert_eq!(bench.unit().flash(), flash_with(&old_program()), "nothing is erased yet");
}

#[test]
fn the_last_word_of_the_flash_can_be_loaded() {
    let mut bench = erased();
    let said = talk_over(&mut bench, &s3(0x3_FFFF, &[0x12, 0x34]));
    assert_eq!(without_flow_control(&said), ".");
    let flash = bench.unit().flash();
    assert_eq!(flash[flash.len() - 2..], [0x12, 0x34]);
}

#[test]
fn a_record_is_programmed_before_its_check_sum_is_looked_at() {
    let mut bench = erased();
    let good = s3(0x1000, &[1, 2, 3, 4]);
    let bad = good.replace("DC\r", "DD\r");
    assert_ne!(bad, good);
    let said = talk_over(&mut bench, &bad);
    assert!(said.contains("Error: 0001"), "{said}");
    assert_eq!(bench.unit().flash()[0x2000..0x2004], [1, 2, 3, 4]);
}

#[test]
fn lower_case_digits_are_zeros() {
    let mut bench = erased();
    let record = s3(0x1000, &[0xAB, 0xCD]);
    let said = talk_over(&mut bench, &(record[..1].to_owned() + &record[1..].to_lowercase()));
    assert!(said.contains("Error: 0001"), "{said}");
    assert_eq!(bench.unit().flash()[0x2000..0x2002], [0, 0]);
}

#[test]
fn line_ends_other_than_cr_are_an_error_or_silence_for_ever() {
    let records = file(&new_program());
    let crlf: Vec<String> = records.iter().map(|record| record.replace('\r', "\r\n")).collect();
    let said = without_flow_control(&upload(&mut in_loader(), &crlf[..3]));
    assert!(said.starts_with("PROGRAM&DATA\r\nError: 0002\r\n"), "{said:?}");

    let lf: Vec<String> = records.iter().map(|record| record.replace('\r', "\n")).collect();
    let mut bench = in_loader();
    assert_eq!(upload(&mut bench, &lf), "PROGRAM&DATA", "mute");
    bench.run(Duration::from_secs(600));
    assert_eq!(bench.take(), "", "for ever");
    assert_eq!(bench.unit().flash(), flash_with(&old_program()));
}

#[test]
fn half_a_word_is_filled_up_and_before_that_was_mended_it_was_the_end() {
    let odd = s3(0, &[1, 2, 3]);
    let sum = u8::from_str_radix(&odd[odd.len() - 3..odd.len() - 1], 16).expect("two digits");
    let rest = [odd.clone(), s3(2, &[4, 5]), S7.to_owned()].concat();

    let mut bench = erased();
    let said = talk_over(&mut bench, &rest);
    assert!(without_flow_control(&said).starts_with(&format!("..\r\n{LOADED}")), "{said}");
    assert_eq!(bench.unit().flash()[..8], [1, 2, 3, 0xFF, 4, 5, 0xFF, 0xFF]);

    let mut bench = Bench::new(Setup { loader: LoaderKind::G3Early, ..setup(flash_with(&old_program())) });
    bench.run_ms(500);
    let said = bench.keys(b"lAXIO-2010\r");
    assert!(said.ends_with(&HEADER.replace("v2.0", "v1.3")), "{said}");
    press_key(&mut bench);
    bench.send(S0.as_bytes());
    bench.run(ERASE + Duration::from_millis(100));
    bench.take();
    let said = talk_over(&mut bench, &rest);
    assert_eq!(without_flow_control(&said), "", "neither a mark nor an error, and no success either");
    assert_eq!(bench.unit().flash()[..8], [1, 2, 3, sum, 0xFF, 0xFF, 0xFF, 0xFF], "the checksum has become data");
    assert_eq!(bench.unit().running(), Running::Loader);
}

#[test]
fn the_usual_short_header_derails_it() {
    let mut bench = in_loader();
    let mut records = file(&new_program());
    records[0] = "S0030000FC\r".to_owned();
    let heard = bench.heard.len();
    bench.send(records[..8].concat().as_bytes());
    bench.run_ms(500);
    // The records are echoed as the header's text, whatever their bytes are; then the sum of it all is wrong.
    let said: Vec<u8> = bench.heard[heard..].iter().map(|&(_, byte)| byte).collect();
    let said = String::from_utf8_lossy(&said);
    assert!(said.contains("Error: 0001"), "{said:?}");
    assert_eq!(bench.unit().flash(), flash_with(&old_program()), "nothing was erased");
    assert_eq!(bench.unit().settings().start_delay, StartDelay::AtOnce);
}

#[test]
fn the_headers_text_is_echoed_as_it_is() {
    let mut bench = in_loader();
    bench.send(record(0, 0, b"AB\x07C").as_bytes());
    bench.run_ms(100);
    assert!(bench.take().starts_with("AB\x07C"));
}

#[test]
fn a_worn_out_word_is_error_0010() {
    let mut bench = in_loader();
    bench.unit().spoil_word(0x123, Defect::WornOut);
    let said = without_flow_control(&upload(&mut bench, &file(&new_program())[..30]));
    assert!(said.contains(&complaint("0010")), "{said}");
    bench.unit().repair_flash();
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V2.2.0"), "{said}");
}

#[test]
fn a_flash_that_never_ends_is_error_0004_and_a_protected_one_0008_from_the_erasing_on() {
    for (defect, bits) in [(Defect::Stuck, "0004"), (Defect::Protected, "0008")] {
        let mut bench = in_loader();
        bench.unit().spoil_word(SECTOR + 5, defect);
        let said = without_flow_control(&talk_over(&mut bench, S0));
        assert_eq!(said, format!("PROGRAM&DATA\r\n{}", complaint(bits)), "{defect:?}");
        let flash = bench.unit().flash();
        assert!(flash[..1024].iter().all(|&byte| byte == 0xFF), "the first sector is erased");
        assert_eq!(flash[1024..], flash_with(&old_program())[1024..], "and no other");
        assert_eq!(bench.unit().settings().start_delay, StartDelay::WaitsForEver);
        bench.unit().repair_flash();
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V2.2.0"), "{said}");
    }
    let mut bench = erased();
    bench.unit().spoil_word(0x40, Defect::Protected);
    let said = without_flow_control(&talk_over(&mut bench, &s3(0x40, &[1, 2])));
    assert!(said.starts_with(&complaint("0008")), "while programming as well: {said}");
}

#[test]
fn a_character_that_cannot_be_read_is_error_0040_when_the_loader_reads_on() {
    let mut bench = in_loader();
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.run_ms(500);
    assert_eq!(bench.take(), complaint("0040"));
    bench.send(S0.as_bytes());
    bench.run_ms(50);
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.run_ms(5_000);
    assert!(!bench.take().contains("Error"), "it erases");
    bench.run_ms(6_000);
    assert!(without_flow_control(&bench.take()).ends_with(&complaint("0040")));
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V2.2.0"), "{said}");
}

#[test]
fn what_cannot_be_read_while_an_error_is_told_is_not_held_against_the_next_file() {
    let mut bench = in_loader();
    bench.send(b"m");
    bench.run_ms(1);
    let now = bench.now;
    bench.unit().handle_framing_error(now);
    bench.run_ms(500);
    assert_eq!(bench.take(), complaint("0002"));
    let said = upload(&mut bench, &file(&new_program()));
    assert!(said.contains("V2.2.0"), "{said}");
}

#[test]
fn a_program_that_is_not_intact_is_called_loaded_and_does_not_start() {
    let mut spoiled = new_program();
    spoiled[1234] ^= 1;
    for program in [spoiled, program("AXTC4CO", Version::new(2, 2, 0), 1500)] {
        let mut bench = in_loader();
        let said = without_flow_control(&upload(&mut bench, &file(&program)));
        let (_, after) = said.split_once(LOADED).expect("G3 reports success");
        assert_eq!(after, HEADER);
        bench.run(Duration::from_secs(20));
        assert_eq!(bench.unit().running(), Running::Loader);
        press_key(&mut bench);
        let said = upload(&mut bench, &file(&new_program()));
        assert!(said.contains("V2.2.0"), "{said}");
    }
}

#[test]
fn a_loader_without_texts_of_a_product_prints_the_public_ones() {
    let product = Product::named("AXTC4CO").expect("built in");
    let flash = vec![0xFF; product.flash.program_words as usize * 2];
    let mut bench =
        Bench::new(Setup { product, loader: LoaderKind::G3, seed: 1, dialect: 0, flash, parameters: Vec::new() });
    bench.run_ms(500);
    assert!(bench.take().ends_with("Waiting for application S-Record.\r\n"), "no key: its manual has none");
    let program = program("AXTC4CO", Version::new(1, 3, 0), 1500);
    let said = upload(&mut bench, &file(&program));
    assert!(said.contains("Download Complete\r\nApplication started!\r\n") && said.contains("V1.3.0"), "{said}");
}

/// A unit whose power goes in the middle of an upload, and which a second upload has to save.
fn cut_and_save(seed: u64, at: Duration) {
    let program = program("AXRTD8CO", Version::new(2, 2, 0), 700);
    let old = old_program();
    let mut bench = Bench::new(Setup { seed, ..setup(flash_with(&old)) });
    bench.run_ms(400);
    bench.take();
    enter_loader(&mut bench);
    let until = bench.now + at;
    send_obeying(&mut bench, &file(&program), until);
    let rest = until.since(bench.now);
    bench.run(rest);
    let begun = bench.unit().settings().start_delay == StartDelay::WaitsForEver;
    bench.power_off();
    bench.run_ms(20);
    bench.take();

    let (flash, parameters) = bench.memories_without_power(flash_with(&old));

    let mut bench = Bench::new(Setup { seed, flash, parameters, ..setup(Vec::new()) });
    bench.run(Duration::from_secs(12));
    let text = bench.take();
    match bench.unit().running() {
        Running::Loader => {
            assert_eq!(text, HEADER, "seed {seed}");
            press_key(&mut bench);
        }
        Running::Application => {
            assert!(!begun, "seed {seed}: an upload had begun");
            enter_loader(&mut bench);
        }
        running @ (Running::Off | Running::Starting) => panic!("seed {seed}: {running:?}"),
    }
    let said = upload(&mut bench, &file(&program));
    assert!(said.contains("V2.2.0") && !said.contains("Error"), "seed {seed}: {said}");
    assert!(bench.unit().flash() == flash_with(&program), "seed {seed}: flash differs from the image");
}

#[test]
fn a_second_upload_saves_a_unit_cut_off_at_any_moment() {
    for seed in 0..12 {
        let mut rng = Rng::new(seed);
        // A third before or while it erases, the rest among the records.
        let at = match seed % 3 {
            0 => Duration::from_millis(rng.below(10_240)),
            _ => ERASE + Duration::from_millis(rng.below(300)),
        };
        cut_and_save(seed, at);
    }
}
