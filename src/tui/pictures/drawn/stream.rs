//! The stream and the diagnostics.

use ratatui::crossterm::event::KeyCode;

use crate::session::{Job, Outcome};
use crate::tui::pictures::stage::*;

pictures! {
    stream_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("tp70000").press(KeyCode::Enter);
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
    stream_refused: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("6t").press(KeyCode::Enter);
        stage.finished(Outcome::Refused { job: Job::StreamOn, reason: "invalid period".into(), heard: None });
        stage
    };
    stream_late_while_exporting: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e").press(KeyCode::Enter).written().wait(10_000);
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
        stage.keys("6e").press(KeyCode::Enter).written().bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
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
    diagnostics_of_eight_channels: |size| {
        let mut stage = Stage::connected_to_eight(size);
        stage.keys("s").wait(2000).bytes(&page_of_eight()).wait(1500);
        stage
    };
}
