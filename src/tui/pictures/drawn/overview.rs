//! The overview.

use ratatui::crossterm::event::KeyCode;

use crate::tui::Input;
use crate::tui::pictures::stage::*;

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
    overview_with_limits: |size| {
        let mut stage = Stage::with_dictionary(size).with_rows();
        stage.keys("2").press(KeyCode::Down);
        stage
    };
    recording_over: |size| {
        let mut stage = Stage::connected(size);
        let file = cast_file("2026-01-31 12:00:00", "/dev/ttyUSB0", 1);
        stage.input(Input::Unrecorded(format!("the recording ends here: no space left on device ({file})")));
        stage
    };
}
