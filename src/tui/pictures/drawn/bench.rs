//! The bench.

use ratatui::crossterm::event::KeyCode;

use crate::tui::Input;
use crate::tui::pictures::stage::*;

pictures! {
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
    bench_link_lost: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(MENU).wait(3000).keys("9o").lost();
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
        stage.press(KeyCode::Right).press(KeyCode::Down).keys("oh/fault nonsense").press(KeyCode::Enter).press(KeyCode::Esc);
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
}
