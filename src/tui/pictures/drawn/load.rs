//! Loading software.

use ratatui::crossterm::event::KeyCode;

use crate::session::{Event, LoadReport, Outcome, Phase, UnitNow, Verdict};
use crate::time::Duration;
use crate::tui::pictures::stage::*;
use crate::tui::{ImageFacts, Input};
use crate::version::Version;

pictures! {
    load_report_other_loader: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.keys("gg").input(Input::ImageChecked(Box::new(good_image()))).keys("g");
        stage.input(Input::ImageChecked(Box::new(good_image())));
        stage
    };
    load_picker: |size| Stage::connected(size).picking();
    load_cannot_list: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("l").input(Input::FilesListed {
            directory: "/home/service/images".into(),
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
    load_running: Stage::in_transfer;
    load_held: |size| {
        let mut stage = Stage::in_transfer(size);
        stage.fold(Event::Held(true)).wait(2400);
        stage
    };
    load_cancel_question: |size| {
        let mut stage = Stage::in_transfer(size);
        stage.press(KeyCode::Esc);
        stage
    };
    load_done: |size| {
        let mut stage = Stage::in_transfer(size);
        for said in [BANNER, MENU] {
            stage.bytes(String::from_utf8_lossy(said).replace("V1.1.0", "V1.2.0").as_bytes());
        }
        stage.wait(1000);
        let report = LoadReport {
            phase: Phase::Verify,
            version_after: Some(Version::new(1, 2, 0)),
            records: 3074,
            duration: Duration::from_secs(24),
            what: "the unit runs AXTC4CO V1.2.0".into(),
            heard: "CANopen: Node-ID 127 (0x7F), Baud Rate 125 kbit/s, State Pre-Operational".into(),
            ..report(Verdict::Done, UnitNow::Application)
        };
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report))));
        stage
    };
    load_failed: |size| {
        let mut stage = Stage::in_transfer(size);
        stage.bytes(b"Error # 0004\r\nRestarting.\r\n").wait(1000);
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
    load_of_a_unit_that_has_fallen_silent: |size| {
        let mut stage = Stage::in_transfer(size);
        stage.wait(5000);
        let report = Outcome::Loaded(Box::new(LoadReport {
            what: "the loader has fallen silent: its power may be off, or the cable out".into(),
            heard: String::new(),
            ..report(Verdict::Failed, UnitNow::Loader)
        }));
        stage.finished(report);
        stage
    };
    load_begun_question: |size| {
        let mut stage = Stage::in_loader(size, noted("AXTC4CO")).with_image(good_image());
        stage.press(KeyCode::Enter);
        stage
    };
    load_override_question: |size| {
        let mut stage = Stage::connected(size).with_image(nameless_image(&[]));
        stage.keys("o");
        stage
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
}
