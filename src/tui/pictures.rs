//! Keys in, picture out.
//!
//! What a person reads is held in snapshots, at the smallest size and at a large one; what keys do is said in
//! sentences. The unit is played by the bytes it would send.

/// Pictures by name: each is drawn from a stage of both sizes.
macro_rules! pictures {
    ($($name:ident: $stage:expr;)*) => {
        $(
            #[test]
            fn $name() {
                crate::tui::pictures::hold(stringify!($name), $stage);
            }
        )*
    };
}

mod choices;
mod drawn;
mod keys;
mod links;
mod loading;
mod room;
mod stage;
mod told;
mod typing;

use insta::assert_snapshot;
use ratatui::crossterm::event::KeyCode;

use stage::*;

use crate::session::{Event, Outcome, UnitNow, Verdict};

/// Holds a picture at both sizes. Here, so that all snapshots lie in one folder.
fn hold(name: &str, stage: fn((u16, u16)) -> Stage) {
    for (size, suffix) in [(SMALL, "small"), (LARGE, "large")] {
        assert_snapshot!(format!("{name}_{suffix}"), stage(size).picture());
    }
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
