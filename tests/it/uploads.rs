//! Stories of uploads: console and unit on one cable, in virtual time.

use axcon::device::{ERASE_TIME, LoaderKind, PROGRAM_TIME, Pacing};
use axcon::image::{Identity, make, srecord};
use axcon::secret::Secret;
use axcon::session::{Command, Event, LoadOrder, Outcome, Phase, UnitNow, UnitState, Verdict};
use axcon::time::{Duration, character_time};
use axcon::version::Version;
use axcon::wire::{LoaderText, Message};

use crate::support::bench::{
    BAUD, Bench, axrtd8co, axtc4co, factory_flash, flash_with, full_image, image_of, order, small_image, with_pages,
};
use crate::support::flash::assert_holds;

#[test]
fn an_upload_succeeds_and_the_flash_holds_exactly_the_image() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let image = small_image("AXTC4CO", "1.2.0");
    let report = bench.load(order(image.clone()));
    assert_eq!((report.verdict, report.unit), (Verdict::Done, UnitNow::Application), "{report:?}");
    assert_eq!(report.version_before, Some(Version::new(1, 1, 0)));
    assert_eq!(report.version_after, Some(Version::new(1, 2, 0)));
    assert_eq!(report.records, report.records_total);
    assert_holds(bench.unit.unit(), &image, "an upload");
    let identity = Identity::verify(bench.unit.unit().flash());
    assert_eq!(identity.map(|identity| identity.version), Ok(Version::new(1, 2, 0)));
}

#[test]
fn an_upload_takes_hardly_longer_than_the_line_and_the_flash_need() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let report = bench.load(order(full_image("1.2.0")));
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
    let on_the_line = character_time(BAUD) * bench.wire.len() as u32;
    // The pages of the old program are erased; those beyond it are so already, and each word is written.
    let in_flash = ERASE_TIME * 3_000_u32.div_ceil(256) + PROGRAM_TIME * 0xC000;
    // What is left: the silence before and the XON after each of 192 pages (0.8 ms), what is waited for after the
    // header and after the last data (120 ms each), the start of the new program, and the silence after its banner
    // (300 ms).
    let beside = report.duration.saturating_sub(on_the_line + in_flash);
    assert!((Duration::from_millis(500)..Duration::from_secs(1)).contains(&beside), "{beside:?} beside line and flash");
}

#[test]
fn a_late_adapter_costs_time_and_no_record() {
    let takes = |latency: Duration| {
        let mut bench = Bench::with(factory_flash("1.1.0"), latency);
        bench.run_for(Duration::from_secs(4));
        let report = bench.load(order(small_image("AXTC4CO", "1.2.0")));
        assert_eq!(report.verdict, Verdict::Done, "{latency:?}: {report:?}\n{}", bench.transcript());
        let data = bench.wire.windows(2).filter(|two| *two == b"S3").count();
        assert_eq!(data, report.records_total - 2, "{latency:?}: each record but header and end leaves once");
        report.duration
    };
    let undisturbed = takes(Duration::ZERO);
    for latency in [1, 4, 16, 20].map(Duration::from_millis) {
        // There and back for each of eleven crossings, and from the end record to the banner.
        let cost = takes(latency).saturating_sub(undisturbed);
        let reckoned = latency * 2 * 12;
        assert!(cost.abs_diff(reckoned) < Duration::from_millis(5), "{latency:?}: {cost:?}, not {reckoned:?}");
    }
}

#[test]
fn a_wrong_password_is_the_units_refusal_and_changes_nothing() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let before = bench.unit.unit().flash().to_vec();
    let mut wrong = order(small_image("AXTC4CO", "1.2.0"));
    wrong.password = Some(Secret::new(b"axio-2010".to_vec()));
    let report = bench.load(wrong);
    assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Application), "{report:?}");
    assert_eq!((report.phase, report.records), (Phase::EnterLoader, 0));
    assert_eq!(bench.unit.unit().flash(), before);
    // The unit is left in peace: it answers like any other.
    bench.ask(Command::Identify);
    assert_eq!(bench.session.facts().version.as_ref().map(|known| known.value), Some(Version::new(1, 1, 0)));
}

#[test]
fn an_image_for_another_product_is_refused_before_the_unit_is_asked_for_anything() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let mut other = order(small_image("AXTC4CO", "1.2.0"));
    other.product = Some("AXRTD8CO".into());
    bench.wire.clear();
    let report = bench.load(other);
    assert_eq!((report.verdict, report.unit), (Verdict::Refused, UnitNow::Application), "{report:?}");
    assert_eq!(bench.wire, b"\x11m", "only the question who is there");
}

#[test]
fn a_corrupted_record_stops_the_upload_within_a_record_and_the_next_one_succeeds() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    // The 5,000th character of the file loses a bit: the checksum of its record is wrong.
    bench.disturb(|number, byte| vec![if number == 5_000 { byte ^ 0x01 } else { byte }]);
    let report = bench.load(order(small_image("AXTC4CO", "1.2.0")));
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert_eq!(report.phase, Phase::Transfer);
    let damaged = 5_000 / 79;
    assert!(report.records <= damaged + 3, "{} records left, the {damaged}th was damaged", report.records);
    assert!(report.what.contains("error"), "{}", report.what);
    bench.leave_in_peace();
    let mut again = order(small_image("AXTC4CO", "1.2.0"));
    again.product = Some("AXTC4CO".into());
    let report = bench.load(again);
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
}

#[test]
fn a_power_cut_at_any_record_leaves_a_unit_that_a_second_upload_saves() {
    let image = small_image("AXTC4CO", "1.2.0");
    for cut in (0..175).step_by(17) {
        let mut bench = Bench::new();
        bench.run_for(Duration::from_secs(4));
        bench.command(Command::Load(Box::new(order(image.clone()))));
        let limit = bench.now + Duration::from_secs(60);
        let moment = |event: &Event| matches!(event, Event::Progress(progress) if progress.phase == Phase::Transfer && progress.records >= cut);
        assert!(bench.run_until(limit, moment).is_some(), "record {cut} is reached");
        bench.power_cycle(Duration::from_millis(500));
        let outcome = bench.outcome();
        let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
        // Before the header has arrived the old software is intact and comes back; then the loader waits for ever.
        let now = if cut == 0 { UnitNow::Application } else { UnitNow::Loader };
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, now), "cut at {cut}: {report:?}");
        bench.reconnect();
        if now == UnitNow::Loader {
            // It does not say which product it belongs to, and a new session cannot know: somebody has to say it.
            let report = bench.load(order(image.clone()));
            assert_eq!(report.verdict, Verdict::Refused, "cut at {cut}: {report:?}");
        }
        let mut again = order(image.clone());
        again.product = Some("AXTC4CO".into());
        let report = bench.load(again);
        assert_eq!(report.verdict, Verdict::Done, "cut at {cut}: {report:?}\n{}", bench.transcript());
        assert_holds(bench.unit.unit(), &image, &format!("cut at {cut}"));
    }
}

#[test]
fn a_unit_without_power_is_not_taken_for_another_kind_of_loader() {
    for loader in LoaderKind::ALL {
        for (begun_ms, off_s) in [(30, 1), (30, 10), (70, 10), (150, 60)] {
            let image = small_image("AXRTD8CO", "2.2.0");
            let flash = flash_with(&small_image("AXRTD8CO", "2.1.1"));
            let mut bench = Bench::of(axrtd8co(), loader, flash, Duration::from_millis(1));
            bench.run_for(Duration::from_secs(7));
            // The unit waits in its loader: an upload was left in the middle.
            bench.command(Command::Load(Box::new(order(image.clone()))));
            let limit = bench.now + Duration::from_secs(60);
            bench.run_until(limit, |event| matches!(event, Event::Progress(progress) if progress.records > 3));
            bench.ask(Command::Cancel);
            let again = LoadOrder { product: Some("AXRTD8CO".into()), ..order(image) };
            bench.command(Command::Load(Box::new(again)));
            let limit = bench.now + Duration::from_secs(60);
            bench.run_until(limit, |event| matches!(event, Event::Progress(progress) if progress.records > 3));
            bench.run_for(Duration::from_millis(begun_ms));
            let now = bench.now;
            bench.unit.unit_mut().power_off(now);
            bench.run_for(Duration::from_secs(off_s));
            let now = bench.now;
            bench.unit.unit_mut().power_on(now);
            let Outcome::Loaded(report) = bench.outcome() else { panic!("no report") };
            let story = format!("{loader:?}, off for {off_s} s: {report:?}");
            assert!(report.verdict != Verdict::Done && report.remark.is_none(), "{story}");
        }
    }
}

#[test]
fn nobody_at_the_other_end_is_said_within_seconds() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let now = bench.now;
    bench.unit.unit_mut().power_off(now);
    let report = bench.load(order(small_image("AXTC4CO", "1.2.0")));
    assert_eq!((report.verdict, report.unit), (Verdict::NoAnswer, UnitNow::Unknown), "{report:?}");
    assert!(bench.now.since(now) < Duration::from_secs(5));
}

#[test]
fn cancelling_in_the_middle_of_the_file_says_that_the_unit_waits_in_its_loader() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    bench.command(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0")))));
    let limit = bench.now + Duration::from_secs(60);
    bench.run_until(limit, |event| matches!(event, Event::Progress(progress) if progress.records > 50));
    let Outcome::Loaded(report) = bench.ask(Command::Cancel) else { panic!("no report") };
    assert_eq!((report.verdict, report.unit), (Verdict::Interrupted, UnitNow::Loader), "{report:?}");
    let sent = bench.wire.len();
    bench.run_for(Duration::from_secs(2));
    assert_eq!(bench.wire.len(), sent, "nothing leaves after that");
}

#[test]
fn the_password_is_nowhere_in_the_record() {
    let mut bench = Bench::new();
    bench.run_for(Duration::from_secs(4));
    let report = bench.load(order(small_image("AXTC4CO", "1.2.0")));
    assert_eq!(report.verdict, Verdict::Done);
    assert!(bench.wire.windows(9).any(|window| window == b"AXIO-2010"), "it was sent");
    assert!(!bench.transcript().contains("AXIO"), "and not kept");
}

/// A unit with eight channels that has run for a moment, V2.1.1 in it.
fn rtd8(latency: Duration) -> Bench {
    let flash = flash_with(&small_image("AXRTD8CO", "2.1.1"));
    let mut bench = Bench::of(axrtd8co(), LoaderKind::G3, flash, latency);
    bench.run_for(Duration::from_secs(6));
    bench
}

#[test]
fn a_loader_that_wants_a_key_and_erases_everything_gets_its_key_and_its_time() {
    let mut bench = rtd8(Duration::ZERO);
    let image = small_image("AXRTD8CO", "2.2.0");
    bench.command(Command::Load(Box::new(order(image.clone()))));
    let mut phases = Vec::new();
    let mut report = None;
    let limit = bench.now + Duration::from_secs(60);
    bench.run_until(limit, |event| {
        match event {
            Event::Progress(progress) if phases.last() != Some(&progress.phase) => phases.push(progress.phase),
            Event::Finished(Outcome::Loaded(loaded)) => report = Some(loaded.clone()),
            _ => {}
        }
        report.is_some()
    });
    let report = report.unwrap_or_else(|| panic!("no report:\n{}", bench.transcript()));
    assert_eq!((report.verdict, report.unit), (Verdict::Done, UnitNow::Application), "{report:?}");
    assert_eq!(
        (report.version_before, report.version_after),
        (Some(Version::new(2, 1, 1)), Some(Version::new(2, 2, 0)))
    );
    let steps = [Phase::EnterLoader, Phase::Transfer, Phase::Erase, Phase::Transfer, Phase::Finish, Phase::Verify];
    assert_eq!(phases, steps, "{}", bench.transcript());
    assert!(bench.unit.unit().flash() == flash_with(&image), "and nothing else is left in the flash");
}

#[test]
fn the_plan_is_what_is_sent_to_the_loader_that_is_believed_and_is_renewed_when_it_is_another() {
    for (product, before, after) in [(axtc4co(), "1.1.0", "1.2.0"), (axrtd8co(), "2.1.1", "2.2.0")] {
        let image = small_image(&product.name, after);
        for (loader, packed) in LoaderKind::ALL.into_iter().flat_map(|loader| [(loader, false), (loader, true)]) {
            for named in [None, Some(loader)] {
                let flash = flash_with(&small_image(&product.name, before));
                let mut bench = Bench::of(product, loader, flash, Duration::from_millis(1));
                bench.run_for(Duration::from_secs(6));
                let order = LoadOrder { packed, loader: named, ..order(image.clone()) };
                let planned = order.at_its_beginning();
                let is_believed = named.unwrap_or(product.loader.kind).pacing() == loader.pacing();
                bench.command(Command::Load(Box::new(order)));
                let story = format!("{} {loader:?}, packed {packed}, named {named:?}", product.name);
                let (mut last, mut totals) = (planned, Vec::new());
                while let Some(event) = bench.run_until(bench.now + Duration::from_secs(120), |event| {
                    matches!(event, Event::Progress(_) | Event::Finished(_))
                }) {
                    let Event::Progress(progress) = event else { break };
                    if totals.last() != Some(&(progress.records_total, progress.bytes_total)) {
                        totals.push((progress.records_total, progress.bytes_total));
                    }
                    assert!(!progress.again && progress.bytes <= progress.bytes_total, "{story}: {progress:?}");
                    last = progress;
                }
                assert_eq!((last.records, last.bytes), (last.records_total, last.bytes_total), "{story}: {last:?}");
                // The image's records and none other, in as many characters as were told.
                let begin = bench.wire.windows(3).position(|three| three == b"S0\x31").expect("a header");
                let sent = bench.wire[begin..].split_inclusive(|byte| *byte == b'\r').take(last.records);
                let sent: Vec<usize> = sent.filter(|record| record.starts_with(b"S")).map(<[u8]>::len).collect();
                assert_eq!((sent.len(), sent.iter().sum()), (last.records, last.bytes), "{story}");
                let changes = if is_believed || !packed { 1 } else { 2 };
                assert_eq!(totals.len(), changes, "{story}: {totals:?}");
                assert_eq!(totals[0], (planned.records_total, planned.bytes_total), "{story}");
            }
        }
    }
}

#[test]
fn what_was_taken_is_told_until_the_loader_begins_anew_and_then_that_it_does() {
    // The power goes in the middle, and does not come back: nobody has taken anything back.
    let image = small_image("AXRTD8CO", "2.2.0");
    let mut bench = rtd8(Duration::from_millis(1));
    bench.command(Command::Load(Box::new(order(image.clone()))));
    let limit = bench.now + Duration::from_secs(60);
    bench.run_until(limit, |event| matches!(event, Event::Progress(progress) if progress.records > 60));
    let now = bench.now;
    bench.unit.unit_mut().power_off(now);
    let mut told = Vec::new();
    let end = bench.run_until(now + Duration::from_secs(60), |event| {
        told.extend(if let Event::Progress(progress) = event { Some(*progress) } else { None });
        matches!(event, Event::Finished(_))
    });
    let Some(Event::Finished(Outcome::Loaded(report))) = end else { panic!("{end:?}") };
    assert!(told.iter().all(|at| at.records > 60 && !at.again), "{told:?}");
    assert!(report.records > 60 && report.address.is_some(), "{report:?}");
    // The line loses one acknowledgement, both of its characters: all of it is sent once more, and that is told.
    let mut bench = rtd8(Duration::from_millis(1));
    let mut holds = 0;
    bench.disturb_answers(move |_, byte| {
        holds += u32::from(byte == 0x13);
        if holds == 30 && matches!(byte, 0x11 | 0x13) { Vec::new() } else { vec![byte] }
    });
    bench.command(Command::Load(Box::new(order(image))));
    let (mut told, mut again) = (Vec::new(), Vec::new());
    let end = bench.run_until(bench.now + Duration::from_secs(120), |event| {
        if let Event::Progress(progress) = event {
            if progress.again { again.push(progress.records) } else { told.push(progress.records) }
        }
        matches!(event, Event::Finished(_))
    });
    let Some(Event::Finished(Outcome::Loaded(report))) = end else { panic!("{end:?}") };
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
    assert!(told.is_sorted() && told.last() > Some(&25), "{told:?}");
    assert!(again.is_sorted() && again.first() == Some(&0) && again.last() == Some(&report.records), "{again:?}");
}

/// Whatever the product's file says, and the user does not know either: what the loader does decides.
#[test]
fn every_loader_in_every_unit_is_uploaded_to_at_any_latency_packed_or_not() {
    for (product, before, after) in [(axtc4co(), "1.1.0", "1.2.0"), (axrtd8co(), "2.1.1", "2.2.0")] {
        let image = small_image(&product.name, after);
        for loader in LoaderKind::ALL {
            for (latency, packed) in [(0, false), (0, true), (1, true), (4, true), (16, false), (16, true), (20, true)]
            {
                let flash = flash_with(&small_image(&product.name, before));
                let mut bench = Bench::of(product, loader, flash, Duration::from_millis(latency));
                bench.run_for(Duration::from_secs(6));
                let mut order = order(image.clone());
                order.packed = packed;
                let report = bench.load(order);
                let story = format!("{} {loader:?} {latency} ms, packed {packed}: {report:?}", product.name);
                assert_eq!(report.verdict, Verdict::Done, "{story}\n{}", bench.transcript());
                assert_holds(bench.unit.unit(), &image, &story);
            }
        }
    }
}

/// How many words a page has is nowhere in the manuals. A loader that stops its sender elsewhere than believed is found
/// out, and the file comes to it whole, if need be in a second pass and record by record.
#[test]
fn pages_of_any_size_are_found_out() {
    let image = small_image("AXTC4CO", "1.2.0");
    for page_words in [64, 128, 512, 1024] {
        for loader in LoaderKind::ALL {
            for (latency, packed) in [(0, false), (0, true), (4, false), (16, false), (16, true), (20, true)] {
                let flash = flash_with(&small_image("AXTC4CO", "1.1.0"));
                let product = with_pages(axtc4co(), page_words);
                let mut bench = Bench::of(product, loader, flash, Duration::from_millis(latency));
                bench.run_for(Duration::from_secs(6));
                let report = bench.load(LoadOrder { packed, ..order(image.clone()) });
                let story = format!("{page_words} words, {loader:?} {latency} ms, packed {packed}: {report:?}");
                assert_eq!(report.verdict, Verdict::Done, "{story}\n{}", bench.transcript());
                assert_holds(bench.unit.unit(), &image, &story);
                let kept = format!("pages of {page_words} words");
                let told = report.remark.as_ref().is_some_and(|remark| remark.contains(&kept));
                // Longer records say less of where a small page ends, and the smallest cannot be told from none.
                assert!(loader.pacing() == Pacing::Records || told || packed && page_words < 256, "{story}");
                assert!(report.duration < Duration::from_secs(30), "{story}");
            }
        }
    }
}

#[test]
fn a_loader_of_the_56f83xx_generation_is_uploaded_to_at_any_latency() {
    for (product, before, after) in [(axtc4co(), "1.1.0", "1.2.0"), (axrtd8co(), "2.1.1", "2.2.0")] {
        for latency in [0, 1, 4, 16, 20] {
            let image = small_image(&product.name, after);
            let flash = flash_with(&small_image(&product.name, before));
            let mut bench = Bench::of(product, LoaderKind::G2, flash, Duration::from_millis(latency));
            bench.run_for(Duration::from_secs(6));
            let report = bench.load(order(image.clone()));
            let all = bench.transcript();
            assert_eq!(report.verdict, Verdict::Done, "{} {latency} ms: {report:?}", product.name);
            assert!(all.contains("Application started from address 0x00A0"), "{} {latency} ms", product.name);
            assert_holds(bench.unit.unit(), &image, &format!("{} {latency} ms", product.name));
        }
    }
}

#[test]
fn a_key_prompt_in_words_nobody_knows_gets_its_key_as_well() {
    let mut bench = rtd8(Duration::ZERO);
    // Of "Hit any key to continue" nothing is left but the number of its letters.
    let mut said = Vec::new();
    bench.disturb_answers(move |_, byte| {
        said.push(byte);
        let garbled = said.windows(20).rev().take(24).any(|window| window.ends_with(b"v2.0\r\n"));
        vec![if garbled && byte.is_ascii_alphabetic() { b'x' } else { byte }]
    });
    let report = bench.load(order(small_image("AXRTD8CO", "2.2.0")));
    assert_eq!(report.verdict, Verdict::Done, "{report:?}\n{}", bench.transcript());
    assert!(bench.transcript().contains("xxx xxx xxx"), "{}", bench.transcript());
}

#[test]
fn a_header_that_names_a_unit_is_echoed_and_taken_for_no_banner() {
    let mut bench = rtd8(Duration::ZERO);
    let file = make::make(&make::Recipe {
        target: &axrtd8co().target(),
        version: Version::new(2, 2, 0),
        words: 1000,
        flaw: None,
    });
    let file = String::from_utf8(file.expect("an image")).expect("text");
    // The text `AXRTD8CO V9.9.9`, and an XOFF that would stop us for ever.
    let header = srecord::Record { kind: srecord::Kind::Header, address: 0, data: b"\0\0AXRTD8CO V9.9.9\x13" };
    let header = String::from_utf8(header.to_text()).expect("text");
    let file = file.replacen("S0110000000050524F4752414D264441544196", &header, 1);
    let report = axcon::image::check(file.as_bytes(), None, &[axrtd8co().target()], None, &[]).expect("a slice");
    let image = report.image().unwrap_or_else(|| panic!("{:?}", report.defects));
    let report = bench.load(order(image));
    assert!(bench.transcript().contains("AXRTD8CO V9.9.9."), "{}", bench.transcript());
    assert_eq!(report.verdict, Verdict::Done, "{report:?}");
}

#[test]
fn a_corrupted_record_is_told_in_words_and_at_most_one_more_leaves_behind_the_error() {
    let mut bench = rtd8(Duration::ZERO);
    bench.disturb(|number, byte| vec![if number == 5_000 { byte ^ 0x01 } else { byte }]);
    bench.command(Command::Load(Box::new(order(small_image("AXRTD8CO", "2.2.0")))));
    let limit = bench.now + Duration::from_secs(60);
    let complaint =
        |event: &Event| matches!(event, Event::Heard { message: Message::Loader(LoaderText::Error(_)), .. });
    assert!(bench.run_until(limit, complaint).is_some(), "the loader complains");
    let sent = bench.wire.len();
    let Outcome::Loaded(report) = bench.outcome() else { panic!("no report") };
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert_eq!(report.what, "the loader reports error 0001 (wrong checksum)");
    assert!(bench.wire.len() - sent <= 79, "{} characters behind the error", bench.wire.len() - sent);
    let damaged = 5_000 / 79;
    assert!(report.records <= damaged + 3, "{} records left, the {damaged}th was damaged", report.records);
    bench.leave_in_peace();
    let mut again = order(small_image("AXRTD8CO", "2.2.0"));
    again.product = Some("AXRTD8CO".into());
    assert_eq!(bench.load(again).verdict, Verdict::Done);
}

#[test]
fn a_character_lost_in_the_last_records_is_noticed_and_the_loader_brought_out_of_its_silence() {
    let image = small_image("AXRTD8CO", "2.2.0");
    // How many characters the file has, and what is sent before it.
    let mut bench = rtd8(Duration::ZERO);
    bench.wire.clear();
    let report = bench.load(order(image.clone()));
    assert_eq!(report.verdict, Verdict::Done);
    let end = bench.wire.windows(4).position(|window| window == b"S705").expect("an end record") as u64;
    let return_of_end = end + 14;
    let returns = [end - 1, return_of_end];
    let in_the_middle =
        bench.wire.windows(3).position(|window| window == b"\rS3").expect("the header's return") + 79 * 50;
    assert_eq!(bench.wire[in_the_middle], b'\r');
    let returns = [&returns[..], &[in_the_middle as u64]].concat();
    let others = (end - 60..return_of_end).step_by(5).chain([return_of_end - 1]);
    for lost in others.chain(returns.iter().copied()) {
        let mut bench = rtd8(Duration::ZERO);
        let first = bench.wire.len() as u64;
        bench.disturb(move |number, byte| if number == first + lost { vec![] } else { vec![byte] });
        let begun = bench.now;
        let report = bench.load(order(image.clone()));
        // Where nothing but a return is lost, the loader is given another, or everything once more.
        let (verdict, unit) = if returns.contains(&lost) {
            (Verdict::Done, UnitNow::Application)
        } else {
            (Verdict::Failed, UnitNow::Loader)
        };
        assert_eq!((report.verdict, report.unit), (verdict, unit), "{lost} of {end}: {report:?}");
        assert!(bench.now.since(begun) < Duration::from_secs(30), "{lost} of {end}");
        if verdict == Verdict::Done {
            assert!(bench.unit.unit().flash() == flash_with(&image), "{lost} of {end}: nothing is missing");
        }
        bench.leave_in_peace();
        bench.ask(Command::Identify);
        let state = if verdict == Verdict::Done { UnitState::Application } else { UnitState::Loader };
        assert_eq!(bench.session.facts().state, state, "{lost} of {end}: it answers again");
    }
}

#[test]
fn a_loader_lost_in_a_record_of_an_earlier_program_is_brought_out_of_it() {
    let mut bench = rtd8(Duration::ZERO);
    bench.command(Command::Load(Box::new(order(small_image("AXRTD8CO", "2.2.0")))));
    // Behind the erasing, in the middle of a record, whoever sent it goes: without a word.
    let limit = bench.now + Duration::from_secs(60);
    bench.run_until(limit, |event| matches!(event, Event::Progress(progress) if progress.records > 50));
    let moment = Duration::from_micros(87 * 20);
    bench.run_for(moment);
    bench.unit.to_unit_mut().clear();
    bench.reconnect();
    bench.ask(Command::Identify);
    assert_eq!(bench.session.facts().state, UnitState::Silent, "it takes the question for digits");
    let mut again = order(small_image("AXRTD8CO", "2.2.0"));
    again.product = Some("AXRTD8CO".into());
    let report = bench.load(again);
    assert_eq!(report.verdict, Verdict::Done, "{report:?}\n{}", bench.transcript());
}

#[test]
fn a_power_cut_while_everything_is_erased_leaves_a_unit_that_a_second_upload_saves() {
    let image = small_image("AXRTD8CO", "2.2.0");
    for cut_ms in [1_500, 6_000, 11_000, 11_900] {
        let mut bench = rtd8(Duration::from_millis(4));
        bench.command(Command::Load(Box::new(order(image.clone()))));
        bench.run_for(Duration::from_millis(cut_ms));
        bench.power_cycle(Duration::from_millis(500));
        let Outcome::Loaded(report) = bench.outcome() else { panic!("no report") };
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{cut_ms} ms: {report:?}");
        let mut again = order(image.clone());
        again.product = Some("AXRTD8CO".into());
        let report = bench.load(again);
        assert_eq!(report.verdict, Verdict::Done, "{cut_ms} ms: {report:?}");
        assert!(bench.unit.unit().flash() == flash_with(&image), "{cut_ms} ms");
    }
}

#[test]
fn what_a_ring_of_550_characters_costs_at_any_latency() {
    let image = image_of("AXRTD8CO", "2.2.0", 20_000);
    for (latency, most) in [(0, 1.02), (4, 1.02), (16, 1.02), (20, 1.2)] {
        let mut bench = rtd8(Duration::from_millis(latency));
        bench.wire.clear();
        let report = bench.load(order(image.clone()));
        assert_eq!(report.verdict, Verdict::Done, "{latency} ms: {report:?}");
        let line = bench.wire.len() as f64 / 11_520.0;
        // Erasing, and what is waited for behind the end record until the new banner is complete.
        let ratio = (report.duration.as_secs_f64() - 10.24 - 0.6) / line;
        assert!(ratio > 0.9 && ratio <= most, "{latency} ms: {ratio}");
    }
}

#[test]
fn a_console_that_was_kept_away_in_the_middle_goes_on_where_it_was() {
    // Longer than any answer behind a record may take.
    let away = Duration::from_secs(5);
    for loader in [LoaderKind::G1, LoaderKind::G3] {
        for moment_ms in (1_500..5_500).step_by(470) {
            let flash = factory_flash("1.1.0");
            let mut bench = Bench::of(axtc4co(), loader, flash, Duration::from_millis(1));
            bench.run_for(Duration::from_secs(4));
            bench.command(Command::Load(Box::new(order(small_image("AXTC4CO", "1.2.0")))));
            bench.run_for(Duration::from_millis(moment_ms));
            bench.stand_still(away);
            let Outcome::Loaded(report) = bench.outcome() else { panic!("{loader:?} {moment_ms} ms") };
            let transcript = bench.transcript();
            assert_eq!(report.verdict, Verdict::Done, "{loader:?} {moment_ms} ms: {report:?}\n{transcript}");
        }
    }
}
