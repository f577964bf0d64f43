//! Recordings.

use ratatui::crossterm::event::KeyCode;

use crate::time::Duration;
use crate::tui::pictures::stage::*;
use crate::tui::{Input, LinkInfo, LinkKind, Pace, Playing};

pictures! {
    recordings_link_lost: |size| {
        let mut stage = Stage::connected(size).with_recordings();
        stage.lost();
        stage
    };
    recordings_none: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").recordings(Vec::new());
        stage
    };
    recordings_cannot_list: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").input(Input::RecordingsListed(Err("cannot read '/home/x': permission denied".into())));
        stage
    };
    recordings_listed: |size| Stage::with_ports(size).with_recordings();
    recordings_unreadable: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").recordings(vec![
            no_recording("/home/service/20260301T120000Z-c-1.cast", "line 1: the file is empty"),
            recording("2026-01-31 11:00:00", "/dev/ttyUSB0", 1, Some(Duration::from_secs(300))),
        ]);
        stage
    };
    recordings_playing: |size| {
        let mut stage = Stage::with_ports(size).with_recordings();
        stage.press(KeyCode::Enter);
        stage.input(Input::LinkOpened(LinkInfo {
            link: format!("replay:{}", cast_file("2026-01-31 11:00:00", "/dev/ttyUSB0", 1)),
            baud: 115_200,
            kind: LinkKind::Recording,
            noted: None,
            recording: None,
            start_of_day: NOON,
            start_millis: 1_769_860_800_000,
        }));
        let (position, length) = (Duration::from_secs(75), Some(Duration::from_secs(300)));
        stage.bytes(BANNER).input(Input::Playing(Playing { position, length, pace: Pace::Times(10) }));
        stage
    };
}
