//! The terminal.

use ratatui::crossterm::event::Event as TerminalEvent;

use crate::tui::Input;
use crate::tui::pictures::stage::*;

pictures! {
    terminal_file_to_send: to_send;
    terminal_asked_to_send_an_image: |size| asked_to_send(size, "AXTC4CO_V1.2.0.elf.S");
    terminal_asked_to_send_a_file: |size| asked_to_send(size, "notes.txt");
    terminal_sending_held: |size| {
        let mut stage = asked_to_send(size, "notes.txt");
        stage.keys("y").wait(9000).bytes(b"\x13").wait(4000);
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
    terminal_find_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix().keys("/menu");
        stage
    };
}
