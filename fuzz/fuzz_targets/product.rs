//! Product files: any text is a product or gives complaints with their place; a product can be worked with.
#![no_main]

use axcon::device::{eds, schema};
use axcon::version::Version;
use axcon::wire::stream::{Reading, Row, Source};
use axcon_fuzz::places;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let read = |text: &str| schema::read("p.toml", text);
    let product = match read(text) {
        Ok(product) => product,
        Err(complaints) => return places(text, &complaints, |text| read(text).err().unwrap_or_default()),
    };
    let target = product.target();
    assert!(target.flash.end() > 0 && target.boot.is_some_and(|boot| boot.start < boot.end));
    let version = Version::new(1, 2, 3);
    assert!(product.file_name(version).contains("1.2.3"));
    let sheet = eds::write(&product);
    assert!(sheet.contains(&product.name));
    for (at, object, entry) in product.dictionary.entries() {
        assert_eq!((at.index, at.sub), (object.index, entry.sub));
        assert_eq!(product.dictionary.entry(at).map(|found| &found.name), Some(&entry.name));
        if let Some(default) = entry.default {
            let _ = default.on_node(product.can.node_id).to_string();
        }
    }
    for source in [Source::FieldValue, Source::ProcessValue] {
        for reading in [Reading::Value(-12.5), Reading::Disabled, Reading::Open, Reading::Short, Reading::Error] {
            let readings = vec![reading; product.stream.channels.len()];
            let row = Row { readings, ..product.stream.row(source) };
            let line = product.stream.emit(&row);
            assert!(product.stream.row_characters(source) > product.stream.channels.len());
            let _ = product.stream.parse(&line);
        }
    }
});
