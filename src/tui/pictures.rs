//! Keys in, picture out.
//!
//! What a person reads is held in snapshots, at the smallest size and at a large one; what keys do is said in
//! sentences. The unit is played by the bytes it would send.

mod choices;
mod keys;
mod links;
mod loading;
mod room;
mod stage;
mod told;
mod typing;

use insta::assert_snapshot;
use ratatui::crossterm::event::{Event as TerminalEvent, KeyCode};

use stage::*;

use super::{Failure, ImageFacts, Input, LinkInfo, Pace, Playing};
use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::dump::Dump;
use crate::record::Span;
use crate::session::{DictionaryReading, Event, Job, LoadReport, Outcome, Phase, ReadEntry, UnitNow, Verdict};
use crate::time::Duration;
use crate::version::Version;

macro_rules! pictures {
    ($($name:ident: $stage:expr;)*) => {
        $(
            #[test]
            fn $name() {
                let stage: fn((u16, u16)) -> Stage = $stage;
                for (size, suffix) in [(SMALL, "small"), (LARGE, "large")] {
                    assert_snapshot!(format!("{}_{suffix}", stringify!($name)), stage(size).picture());
                }
            }
        )*
    };
}

pictures! {
    overview_link_back_asking: |size| {
        let mut stage = Stage::streaming(size);
        stage.lost().wait(20_000).input(Input::LinkBack("/dev/ttyUSB0".into()));
        stage
    };
    overview_another_unit: |size| {
        let mut stage = Stage::streaming(size);
        stage.lost().wait(20_000).input(Input::LinkBack("/dev/ttyUSB0".into()));
        let menu = String::from_utf8_lossy(MENU).replace("AXTC4CO V1.1.0", "AXRTD8CO V1.0.3");
        stage.bytes(menu.as_bytes()).wait(8000);
        stage
    };
    load_report_other_loader: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.keys("gg").input(Input::ImageChecked(Box::new(good_image()))).keys("g");
        stage.input(Input::ImageChecked(Box::new(good_image())));
        stage
    };
    terminal_file_to_send: to_send;
    terminal_asked_to_send_an_image: |size| asked_to_send(size, "AXTC4CO_V1.2.0.elf.S");
    terminal_asked_to_send_a_file: |size| asked_to_send(size, "notes.txt");
    terminal_sending_held: |size| {
        let mut stage = asked_to_send(size, "notes.txt");
        stage.keys("y").wait(9000).bytes(b"\x13").wait(4000);
        stage
    };
    dictionary_dump_to_choose: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("w");
        stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
        stage
    };
    connect_while_listing: Stage::new;
    connect_without_ports: |size| {
        let mut stage = Stage::new(size);
        stage.input(Input::PortsListed(Ok(Vec::new())));
        stage
    };
    connect_with_ports: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Down);
        stage
    };
    connect_cannot_list: |size| {
        let mut stage = Stage::new(size);
        stage.input(Input::PortsListed(Err("/sys/class/tty: permission denied".into())));
        stage.press(KeyCode::End);
        stage
    };
    connect_failed: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).input(Input::LinkFailed(Failure {
            text: "cannot open /dev/ttyUSB0: permission denied (it belongs to group 'dialout')".into(),
            hints: vec![
                "Add yourself to the group: sudo usermod -aG dialout $USER, then log in again.".into(),
                "Or open it once with sudo.".into(),
            ],
        }));
        stage
    };
    connect_by_path: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::End).press(KeyCode::Enter).keys("/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_AX12345-if00-port0");
        stage
    };
    overview_without_link: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("2");
        stage
    };
    overview_silent: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
        stage.wait(60_000);
        stage
    };
    overview_stream_off: Stage::connected;
    overview_streaming: |size| {
        let mut stage = Stage::streaming(size);
        stage.press(KeyCode::Down);
        stage
    };
    overview_of_a_broken_channel: |size| {
        let mut stage = Stage::streaming(size);
        stage.press(KeyCode::Down).press(KeyCode::Down).press(KeyCode::Down);
        stage
    };
    overview_of_eight_channels: Stage::eight_channels;
    overview_diagnosed: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000).bytes(b" CJ 24.50 C\r\n TC1 100.0 C raw 3991 uV\r\n TC2 open\r\n Active Errors: 0\r\n");
        stage.wait(47_000).keys("2");
        stage
    };
    overview_late: |size| {
        let mut stage = Stage::streaming(size);
        stage.wait(10_000);
        stage
    };
    overview_link_lost: |size| {
        let mut stage = Stage::streaming(size);
        stage.lost();
        stage
    };
    stream_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("tp70000").press(KeyCode::Enter);
        stage
    };
    defaults_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("dyes").press(KeyCode::Enter);
        stage
    };
    view_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v");
        stage
    };
    terminal_empty: |size| {
        let mut stage = Stage::new(size);
        stage.keys("3");
        stage
    };
    terminal_text: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3m").bytes(MENU).bytes(b"a\tb \x1b[31mred\x07 \xff\r\n");
        stage
    };
    terminal_times: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix().keys("w");
        stage
    };
    terminal_hex: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3x").prefix().keys("h");
        stage
    };
    terminal_after_prefix: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix();
        stage
    };
    terminal_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").lost();
        stage
    };
    paste_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").input(Input::Terminal(TerminalEvent::Paste("one\ntwo\n".into())));
        stage
    };
    load_picker: |size| Stage::connected(size).picking();
    load_cannot_list: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("l").input(Input::FilesListed {
            directory: "/home/other/secret".into(),
            entries: Err("permission denied".into()),
        });
        stage
    };
    load_report_good: |size| Stage::connected(size).with_image(good_image());
    load_report_bad: |size| {
        let mut stage = Stage::connected(size).with_image(bad_image());
        stage.press(KeyCode::PageDown);
        stage
    };
    load_report_other_product: |size| {
        Stage::connected(size).with_image(ImageFacts { product: Some("AXRTD8CO".into()), ..good_image() })
    };
    load_running: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress()));
        stage
    };
    load_held: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress())).fold(Event::Held(true)).wait(2400);
        stage
    };
    load_cancel_question: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress())).press(KeyCode::Esc);
        stage
    };
    load_done: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        let report = LoadReport {
            phase: Phase::Verify,
            version_after: Some(Version::new(1, 2, 0)),
            records: 3074,
            duration: Duration::from_secs(24),
            what: "The unit runs AXTC4CO 1.2.0: its new banner says so.".into(),
            heard: "AXTC4CO 4 Thermocouple Scanner Software Version V1.2.0".into(),
            ..report(Verdict::Done, UnitNow::Application)
        };
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report))));
        stage
    };
    load_failed: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Loader)))));
        stage
    };
    load_link_lost: |size| {
        let mut stage = Stage::loading(size);
        stage.wait(1000).lost();
        stage
    };
    load_in_loader_with_a_note: |size| {
        Stage::in_loader(size, noted("AXTC4CO")).with_image(good_image())
    };
    load_in_loader_noted_for_another_product: |size| {
        Stage::in_loader(size, noted("AXRTD8CO")).with_image(good_image())
    };
    label_question: |size| {
        let mut stage = Stage::in_loader(size, None).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXRTD8CO").press(KeyCode::Enter);
        stage
    };
    password_question: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXIO");
        stage
    };
    waiting_for_a_link: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter);
        stage
    };
    terminal_find_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix().keys("/menu");
        stage
    };
    order_question: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9/short 2");
        stage
    };
    temperature_question: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9").press(KeyCode::Enter).keys("hot").press(KeyCode::Enter);
        stage
    };
    disconnect_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter).keys("1").press(KeyCode::Down).press(KeyCode::Enter);
        stage
    };
    quit_viewing_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3v").prefix().keys("q");
        stage
    };
    connect_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("1").lost();
        stage
    };
    diagnostics_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000).bytes(b"Diagnostics\r\n Supply Voltage: 24.0 V\r\n").wait(1500).lost();
        stage
    };
    diagnostics_without_answer: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(60_000);
        stage
    };
    recordings_link_lost: |size| {
        let mut stage = Stage::connected(size).with_recordings();
        stage.lost();
        stage
    };
    bench_link_lost: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(MENU).wait(3000).keys("9o").lost();
        stage
    };
    help_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.press(KeyCode::F(1)).lost();
        stage
    };
    dictionary_refused: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter);
        let reason = "not in the operational state".to_owned();
        stage.finished(Outcome::Refused { job: Job::ReadDictionary, reason, heard: None });
        stage
    };
    dictionary_incomplete: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter);
        let at = ObjectAddress::new(0x1001, 0);
        let entry = ReadEntry { at, value: Some(Value::Unsigned8(0)), text: "Error Register = 0".into(), span: Span::default(), known: true };
        let reading = DictionaryReading { entries: vec![entry], complete: false, unrecognised_lines: 0 };
        stage.finished(Outcome::DictionaryRead(Box::new(reading)));
        stage
    };
    stream_refused: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("6t").press(KeyCode::Enter);
        stage.finished(Outcome::Refused { job: Job::StreamOn, reason: "invalid period".into(), heard: None });
        stage
    };
    stream_late_while_exporting: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e").press(KeyCode::Enter).wait(10_000);
        stage
    };
    overview_with_limits: |size| {
        let mut stage = Stage::with_dictionary(size).with_rows();
        stage.keys("2").press(KeyCode::Down);
        stage
    };
    recording_over: |size| {
        let mut stage = Stage::connected(size);
        stage.input(Input::Unrecorded("cannot write /home/user/a.cast: no space left on device".into()));
        stage
    };
    dictionary_of_no_unit: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("5");
        stage
    };
    dictionary_of_the_manual: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("5/filter").press(KeyCode::Enter);
        stage
    };
    dictionary_being_read: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter).fold(Event::EntriesRead(118));
        stage
    };
    dictionary_read: Stage::with_dictionary;
    dictionary_deviations: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("o").press(KeyCode::Down);
        stage
    };
    dictionary_compared: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("wyesterday.json").press(KeyCode::Enter);
        let text = Ok(Dump::factory(axtc4co()).json());
        stage.input(Input::FileRead { path: "yesterday.json".into(), text });
        stage
    };
    dictionary_finding: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("/sensor type");
        stage
    };
    dictionary_finds_nothing: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("/xyzzy").press(KeyCode::Enter);
        stage
    };
    dictionary_link_lost: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.lost();
        stage
    };
    stream_off: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("6");
        stage
    };
    stream_running: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6").press(KeyCode::Down);
        stage
    };
    stream_held_at_a_gap: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6k").press(KeyCode::Down).press(KeyCode::Down).press(KeyCode::Down);
        (0..36).for_each(|_| {
            stage.press(KeyCode::Left);
        });
        stage
    };
    stream_of_eight_channels: |size| {
        let mut stage = Stage::eight_channels(size);
        stage.keys("6").press(KeyCode::Down).press(KeyCode::Down);
        stage
    };
    stream_of_one_curve: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6zk").press(KeyCode::Down).press(KeyCode::Enter);
        stage
    };
    stream_of_a_disabled_channel: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6");
        (0..4).for_each(|_| {
            stage.press(KeyCode::Down);
        });
        stage
    };
    stream_export_question: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e");
        stage
    };
    stream_exporting: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e").press(KeyCode::Enter).bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
        stage
    };
    stream_link_lost: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6").lost();
        stage
    };
    diagnostics_none: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("7");
        stage
    };
    diagnostics_running: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000);
        for supply in ["23.91", "24.10", "24.02"] {
            let page = format!(
                "Diagnostics   up 0:00:12\r\n Supply Voltage: {supply} V\r\n Cold Junction: 24.5 C\r\n\
                 \x20TC1  100.123 C   raw   3991 uV   status 0x00\r\n TC2  180.002 C   raw   7310 uV   status 0x00\r\n\
                 \x20Active Errors: 0\r\n"
            );
            stage.bytes(page.as_bytes()).wait(1000);
        }
        stage
    };
    recordings_none: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").input(Input::RecordingsListed(Ok(Vec::new())));
        stage
    };
    recordings_cannot_list: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").input(Input::RecordingsListed(Err("cannot read '/home/x': permission denied".into())));
        stage
    };
    recordings_listed: |size| Stage::with_ports(size).with_recordings();
    recordings_playing: |size| {
        let mut stage = Stage::with_ports(size).with_recordings();
        stage.press(KeyCode::Enter);
        stage.input(Input::LinkOpened(LinkInfo {
            link: "replay:/home/user/20260131T110000Z-ttyUSB0-7.cast".into(),
            baud: 115_200,
            read_only: true,
            noted: None,
            recording: None,
            start_of_day: NOON,
            start_millis: 1_769_860_800_000,
        }));
        let (position, length) = (Duration::from_secs(75), Some(Duration::from_secs(300)));
        stage.bytes(BANNER).input(Input::Playing(Playing { position, length, pace: Pace::Times(10) }));
        stage
    };
    bench_of_a_real_unit: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("9");
        stage
    };
    bench_in_use: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co");
        stage.bytes(BANNER).bytes(MENU).wait(3000).keys("9");
        stage.press(KeyCode::Right).press(KeyCode::Down).keys("oh/fault nonsense").press(KeyCode::Enter);
        for (line, answer) in [
            ("set 1 temperature 30.0", Ok(None)),
            ("open 2", Ok(None)),
            ("short 2", Err("this input cannot be shorted".to_owned())),
        ] {
            stage.input(Input::Ordered { line: line.into(), answer });
        }
        stage
    };
    bench_of_old_values: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(BANNER).bytes(MENU).wait(3000);
        stage = stage.with_rows();
        stage.wait(10_000).keys("9");
        stage
    };
    load_path_of_nothing: |size| {
        let mut stage = Stage::connected(size).picking();
        stage.keys("pnew.S").press(KeyCode::Enter);
        let path = "/home/service/images/new.S".into();
        stage.input(Input::ImageUnreadable { path, why: "there is no such file".into() });
        stage
    };
    load_report_nameless: |size| Stage::connected(size).with_image(nameless_image(&[]));
    load_report_packed: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.keys("k");
        stage
    };
    dictionary_compared_with_another_product: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("wyesterday.json").press(KeyCode::Enter);
        let other = Product::named("AXRTD8CO").expect("built in");
        stage.input(Input::FileRead { path: "yesterday.json".into(), text: Ok(Dump::factory(other).json()) });
        stage
    };
    diagnostics_of_eight_channels: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000).bytes(&page_of_eight()).wait(1500);
        stage
    };
    help_on_overview: |size| {
        let mut stage = Stage::connected(size);
        stage.press(KeyCode::F(1));
        stage
    };
    help_on_terminal: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").press(KeyCode::F(1)).press(KeyCode::PageDown);
        stage
    };
    quit_question: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("tq");
        stage
    };
}

#[test]
fn a_small_terminal_gets_one_clear_message() {
    let mut stage = Stage::streaming(SMALL);
    stage.resized((60, 10));
    assert_snapshot!(stage.picture());
}

#[test]
fn every_screen_survives_every_size() {
    let scenes: [fn() -> Stage; 14] = [
        || Stage::with_dictionary(SMALL),
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("6").press(KeyCode::Left);
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.keys("s").wait(2000).bytes(b"Supply: 24 V\r\nCurrent: 1 A\r\n").wait(1000);
            stage
        },
        || Stage::with_ports(SMALL).with_recordings(),
        || {
            let mut stage = Stage::with_ports(SMALL);
            stage.press(KeyCode::Enter).opened("emu:axrtd8co");
            stage.keys("9o");
            stage
        },
        || Stage::with_ports(SMALL),
        || Stage::streaming(SMALL),
        || Stage::connected(SMALL).picking(),
        || Stage::connected(SMALL).with_image(bad_image()),
        || {
            let mut stage = Stage::connected(SMALL);
            stage.fold(Event::Progress(progress())).keys("4");
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.keys("4").fold(Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Unknown)))));
            stage.lost();
            stage
        },
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("3").prefix().keys("h");
            stage
        },
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("3");
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.press(KeyCode::F(1));
            stage
        },
    ];
    for scene in scenes {
        let mut stage = scene();
        for columns in 0..120 {
            for rows in 0..40 {
                stage.size = (columns, rows);
                stage.draw();
            }
        }
    }
}

/// On the terminal, asked for a file to send.
fn to_send(size: (u16, u16)) -> Stage {
    let mut stage = Stage::connected(size);
    stage.keys("3").prefix().keys("f");
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
    stage
}

/// A file is chosen and read; it is asked once more.
fn asked_to_send(size: (u16, u16), name: &str) -> Stage {
    let mut stage = to_send(size);
    stage.keys(name).press(KeyCode::Enter);
    let path = format!("/home/service/images/{name}").into();
    stage.input(Input::BytesRead { path, bytes: Ok(vec![b'S'; 242_742]) });
    stage
}

#[test]
fn every_question_survives_every_size_it_is_drawn_at() {
    type Maker = fn() -> Stage;
    let questions: [(&str, Maker); 17] = [
        ("Switch the data stream on", || typed(Stage::connected(SMALL), "t")),
        ("Type Yes", || typed(Stage::connected(SMALL), "d")),
        ("View the object", || typed(Stage::connected(SMALL), "v")),
        ("label", || pressed(Stage::in_loader(SMALL, None).with_image(good_image()), KeyCode::Enter)),
        ("Password", || pressed(Stage::connected(SMALL).with_image(good_image()), KeyCode::Enter)),
        ("Opening", || pressed(Stage::with_ports(SMALL), KeyCode::Enter)),
        ("Connect to", || typed(Stage::with_ports(SMALL), "p")),
        ("╭ Find", || typed(Stage::with_dictionary(SMALL), "/")),
        ("Image file", || typed(Stage::connected(SMALL).picking(), "p")),
        ("CSV", || typed(Stage::streaming(SMALL), "6e")),
        ("Write the object", || typed(Stage::with_dictionary(SMALL), "e")),
        ("Compare with", || typed(Stage::with_dictionary(SMALL), "w")),
        ("Send a file as it is", || to_send(SMALL)),
        ("software image", || asked_to_send(SMALL, "new.S")),
        ("Cancel the upload", || pressed(Stage::loading(SMALL), KeyCode::Esc)),
        ("being loaded", || typed(Stage::loading(SMALL), "q")),
        ("Close the link", || typed(Stage::loading(SMALL), "1x")),
    ];
    for (words, question) in questions {
        let mut stage = question();
        assert!(stage.shows(words), "{words}: {}", stage.picture());
        for columns in 70..100 {
            for rows in 20..30 {
                stage.size = (columns, rows);
                stage.picture();
            }
        }
    }
}
