//! Every recogniser on any line.
#![no_main]

use axcon::canopen::DataType;
use axcon::device::Product;
use axcon::wire::dictionary::Expected;
use axcon::wire::{Vocabulary, diagnostics, dictionary, visible};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|line: &str| {
    let products = Product::all();
    let vocabulary = Vocabulary {
        products: products.iter().map(|product| product.name.as_str()).collect(),
        layouts: products.iter().map(|product| &product.stream).collect(),
    };
    let _ = vocabulary.line(line);
    let _ = vocabulary.prompt(line);
    let _ = diagnostics::quantities(line);
    let knows = |index| index & 1 == 0;
    let columns = dictionary::several(line, knows).into_iter().flatten();
    for read in dictionary::line(line, knows).into_iter().chain(columns) {
        for data_type in [DataType::Boolean, DataType::Integer16, DataType::Unsigned32, DataType::Real32] {
            for unit in [None, Some("°C")] {
                let expected = Expected { data_type, names: &["Field Value", "RTD1"], unit };
                let _ = dictionary::value(&read.rest, &expected);
            }
        }
    }
    assert!(!visible::line(line.as_bytes()).chars().any(char::is_control));
});
