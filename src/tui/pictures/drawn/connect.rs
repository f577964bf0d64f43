//! Choosing a link and leaving it; the page of keys.

use ratatui::crossterm::event::KeyCode;

use crate::tui::pictures::stage::*;
use crate::tui::{Failure, Input};

pictures! {
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
    waiting_for_a_link: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter);
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
    help_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.press(KeyCode::F(1)).lost();
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
