//! Lines from chunks: the same whatever the chunks are, spans in order, nothing kept without bound.
#![no_main]

use axcon::wire::{Framer, Item, LONGEST_LINE};
use libfuzzer_sys::fuzz_target;

fn frame<'a>(chunks: impl Iterator<Item = &'a [u8]>) -> Vec<Item> {
    let mut framer = Framer::default();
    let mut items = Vec::new();
    for chunk in chunks {
        framer.push(chunk, |item| items.push(item));
    }
    if let Some(text) = framer.pending() {
        items.push(Item::Line(text));
    }
    items
}

fuzz_target!(|input: (u8, &[u8])| {
    let (size, bytes) = input;
    let items = frame(std::iter::once(bytes));
    assert_eq!(items, frame(bytes.chunks(usize::from(size).max(1))));
    let mut end = 0;
    for item in &items {
        if let Item::Line(text) = item {
            assert!(text.span.start >= end && text.span.end <= bytes.len() as u64);
            assert!(text.text.chars().count() <= LONGEST_LINE);
            assert!(!text.text.chars().any(char::is_control));
            end = text.span.end;
        }
    }
});
