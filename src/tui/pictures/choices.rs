//! Files chosen and answers given, by keys and by clicks, in sentences.

use std::path::PathBuf;

use ratatui::crossterm::event::{KeyCode, KeyModifiers};

use super::stage::*;
use crate::device::LoaderKind;
use crate::tui::{Effect, Failure, Input};

#[test]
fn the_answers_of_a_question_can_be_clicked() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("t").click("process value");
    assert!(stage.shows("› P  process value"), "{}", stage.picture());
    stage.sent();
    stage.click("switch on");
    assert_eq!(stage.sent(), b"t");
    let mut stage = Stage::connected(SMALL);
    stage.keys("v").click("Esc back");
    assert!(!stage.shows("View the object"), "{}", stage.picture());
    stage.keys("1").press(KeyCode::Enter).click("N stay");
    assert!(stage.shows("connected"), "{}", stage.picture());
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter);
    stage.input(Input::LinkFailed(Failure { text: "no".into(), hints: Vec::new() })).click("Enter close");
    assert!(!stage.shows("Not connected"), "{}", stage.picture());
    stage.keys("p").click("Serial ports");
    assert!(stage.shows("Connect to"), "a click beside it means nothing: {}", stage.picture());
}

#[test]
fn files_to_send_and_dumps_are_chosen_by_keys_by_clicks_and_by_typing() {
    let mut stage = Stage::with_dictionary(SMALL);
    stage.keys("w");
    let folder = || PathBuf::from("/home/service/images");
    assert!(stage.asked().contains(&Effect::ListFiles(folder())));
    stage.input(Input::FilesListed { directory: folder(), entries: Ok(files()) });
    assert!(stage.shows("› before.json") && !stage.shows("readme.txt"), "{}", stage.picture());
    stage.click("bad/").click("bad/");
    assert_eq!(stage.asked(), [Effect::ListFiles(folder().join("bad"))], "a second click opens");
    stage.input(Input::FilesListed { directory: folder().join("bad"), entries: Ok(Vec::new()) });
    assert!(stage.shows("No saved object dictionary here"), "{}", stage.picture());
    stage.press(KeyCode::Backspace);
    assert_eq!(stage.asked(), [Effect::ListFiles(folder())]);
    stage.input(Input::FilesListed { directory: folder(), entries: Ok(files()) });
    stage.press(KeyCode::Down).press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::ReadFile(folder().join("before.json"))]);
    stage.keys("w~/dumps/a.json").press(KeyCode::Enter);
    assert!(stage.asked().contains(&Effect::ReadFile("/home/service/dumps/a.json".into())));
}

#[test]
fn a_tilde_means_the_home_folder_wherever_a_path_is_typed() {
    let mut stage = Stage::with_ports(SMALL);
    stage.keys("p~/unit").press(KeyCode::Enter);
    assert!(stage.asked().contains(&Effect::OpenLink("/home/service/unit".into())));
    stage.press(KeyCode::Esc).keys("preplay:~/a.cast").press(KeyCode::Enter);
    assert!(stage.asked().contains(&Effect::OpenLink("replay:/home/service/a.cast".into())));
    let mut stage = Stage::with_dictionary(SMALL).picking();
    stage.keys("p~/new.S").press(KeyCode::Enter);
    let checked = Effect::CheckImage { path: "/home/service/new.S".into(), loader: None, allow: Vec::new() };
    assert!(stage.asked().contains(&checked));
    // A folder typed as if it were a file is opened.
    stage.input(Input::FilesListed { directory: "/home/service/new.S".into(), entries: Ok(files()) });
    assert!(stage.shows("AXTC4CO_V1.2.0.elf.S"), "{}", stage.picture());
    stage.keys("5e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("~/d.txt").press(KeyCode::Enter);
    let written =
        |effect: &Effect| matches!(effect, Effect::CreateFile { path, .. } if path.ends_with("service/d.txt"));
    assert!(stage.asked().iter().any(written));
}

#[test]
fn the_keys_in_the_last_line_can_be_clicked_also_on_the_help_page() {
    let mut stage = Stage::with_ports(SMALL);
    stage.click("P path");
    assert!(stage.shows("Connect to"), "{}", stage.picture());
    stage.press(KeyCode::Esc).click("F1 help");
    assert!(stage.shows("any other key"), "{}", stage.picture());
    stage.click("any other key");
    assert!(stage.shows("Serial ports"), "{}", stage.picture());
}

#[test]
fn the_kind_of_loader_is_chosen_on_the_load_screen_judged_and_ordered() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    assert!(stage.shows("g1, assumed for every AXTC4CO; G if the unit has another"), "{}", stage.picture());
    for kind in LoaderKind::ALL.map(Some).into_iter().chain([None, Some(LoaderKind::G1)]) {
        stage.asked();
        stage.keys("g");
        let path = good_image().path;
        assert_eq!(stage.asked(), [Effect::CheckImage { path, loader: kind, allow: Vec::new() }]);
        stage.input(Input::ImageChecked(Box::new(good_image())));
        let words = kind.map_or("assumed for every".to_owned(), |kind| format!("{}, as chosen", kind.name()));
        assert!(stage.shows(&words), "{}", stage.picture());
    }
    // Of another unit nothing is known, and what was judged for the loader of this one is judged again.
    stage.keys("1").press(KeyCode::Enter).keys("y").asked();
    stage.opened("/dev/ttyUSB0");
    let again = Effect::CheckImage { path: good_image().path, loader: None, allow: Vec::new() };
    assert!(stage.asked().contains(&again));
    stage.input(Input::ImageChecked(Box::new(good_image()))).keys("4");
    assert!(stage.shows("assumed for every"), "{}", stage.picture());
}

#[test]
fn an_image_is_sent_as_it_is_only_after_y() {
    let mut stage = asked_to_send(SMALL, "AXTC4CO_V1.2.0.elf.S");
    stage.asked();
    stage.press(KeyCode::Enter);
    assert!(stage.asked().is_empty() && stage.shows("all the same"), "{}", stage.picture());
    stage.keys("y");
    assert!(stage.asked().iter().any(|effect| matches!(effect, Effect::Transmit(_))), "{}", stage.picture());
}
