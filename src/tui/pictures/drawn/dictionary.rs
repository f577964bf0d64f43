//! The object dictionary.

use ratatui::crossterm::event::KeyCode;

use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::dump::Dump;
use crate::record::Span;
use crate::session::{DictionaryReading, Event, Job, Outcome, ReadEntry, WalkEnd};
use crate::tui::Input;
use crate::tui::pictures::stage::*;
use crate::wire::dictionary::{Reading, Shown};

pictures! {
    dictionary_dump_to_choose: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("w");
        stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
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
        let reading = Reading { shown: Shown::Value(Value::Unsigned8(0)), numeral: "0".into(), plain: true };
        let entry = ReadEntry { at, text: "Error Register = 0".into(), span: Span::default(), reading: Some(reading) };
        let reading = DictionaryReading { entries: vec![entry], end: WalkEnd::Stopped, unrecognised_lines: 0 };
        stage.finished(Outcome::DictionaryRead(Box::new(reading)));
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
    dictionary_compared_with_another_product: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("wyesterday.json").press(KeyCode::Enter);
        let other = Product::named("AXRTD8CO").expect("built in");
        stage.input(Input::FileRead { path: "yesterday.json".into(), text: Ok(Dump::factory(other).json()) });
        stage
    };
}
