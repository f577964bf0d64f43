//! Quoted exchanges: what manuals and public sources print of the serial port is understood, in whatever chunks it comes.

use std::fs;
use std::path::Path;

use axcon::endpoint::Endpoint;
use axcon::record::Direction;
use axcon::session::{Event, Session};
use axcon::time::{Duration, Instant};
use axcon::wire::Message;
use axcon::wire::stream::Reading;
use proptest::prelude::*;

use crate::support::bench::BAUD;

/// One thing the unit says, and what it means.
#[derive(Debug)]
struct Quotation {
    place: String,
    said: Vec<u8>,
    /// The unit falls silent behind it.
    silence: bool,
    meaning: Vec<String>,
}

fn transcripts() -> Vec<(String, Vec<Quotation>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/transcripts");
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("transcripts").map(|entry| entry.expect("one").path()).collect();
    files.sort();
    files.into_iter().map(|path| (path.display().to_string(), quotations(&path))).collect()
}

fn quotations(path: &Path) -> Vec<Quotation> {
    let name = path.file_name().expect("a name").to_string_lossy().into_owned();
    let mut found: Vec<Quotation> = Vec::new();
    for (number, line) in fs::read_to_string(path).expect("a transcript").lines().enumerate() {
        let place = format!("{name}:{}", number + 1);
        match line.split_at_checked(2) {
            Some(("< ", said)) => {
                let (said, silence) = said.strip_suffix('~').map_or((said, false), |said| (said, true));
                found.push(Quotation { place, said: unescaped(said), silence, meaning: Vec::new() });
            }
            Some(("= ", meaning)) => found.last_mut().expect("said before").meaning.push(meaning.to_owned()),
            _ => assert!(line.is_empty() || line.starts_with('#'), "{place}: {line}"),
        }
    }
    found
}

/// What a text in the notation of the transcripts stands for: `\\r`, `\\n`, and `\\x13` for any other byte.
pub fn unescaped(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find('\\') {
        bytes.extend_from_slice(&rest.as_bytes()[..at]);
        let (value, length) = match &rest[at + 1..at + 2] {
            "r" => (b'\r', 2),
            "n" => (b'\n', 2),
            "x" => (u8::from_str_radix(&rest[at + 2..at + 4], 16).expect("two digits"), 4),
            other => panic!("\\{other}"),
        };
        bytes.push(value);
        rest = &rest[at + length..];
    }
    bytes.extend_from_slice(rest.as_bytes());
    bytes
}

/// Bytes in the notation of the transcripts.
pub fn escaped(bytes: &[u8]) -> String {
    let mut text = String::new();
    for &byte in bytes {
        match byte {
            b'\r' => text.push_str("\\r"),
            b'\n' => text.push_str("\\n"),
            b' '..=b'~' => text.push(char::from(byte)),
            _ => text.push_str(&format!("\\x{byte:02x}")),
        }
    }
    text
}

/// Feeds a whole transcript, each quotation in chunks of the given sizes (over and over), and gives what was understood
/// of each.
fn understood(quotations: &[Quotation], sizes: &[usize]) -> (Vec<Vec<String>>, Vec<u8>) {
    let mut session = Session::new(BAUD);
    let mut now = Instant::from_millis(1);
    let mut sizes = sizes.iter().cycle();
    let mut all = Vec::new();
    for quotation in quotations {
        let mut meaning = Vec::new();
        let mut rest = quotation.said.as_slice();
        while !rest.is_empty() {
            let (chunk, behind) = rest.split_at((*sizes.next().expect("sizes")).clamp(1, rest.len()));
            session.handle_bytes(now, chunk);
            rest = behind;
        }
        if quotation.silence {
            now += Duration::from_millis(200);
            session.handle_timeout(now);
        }
        while let Some(event) = session.poll_event() {
            match event {
                Event::Heard { message: Message::Text, .. } => meaning.push("Text".into()),
                Event::Heard { message, .. } => meaning.push(format!("{message:?}")),
                Event::Row { row, .. } => {
                    let readings = row.readings.iter().map(|reading| match reading {
                        Reading::Value(value) => value.to_string(),
                        other => format!("{other:?}"),
                    });
                    meaning.push(format!("Row({:?}) {}", row.source, readings.collect::<Vec<_>>().join(" ")));
                }
                Event::Held(held) => meaning.push(format!("Held({held})")),
                _ => {}
            }
        }
        all.push(meaning);
    }
    let record = session.record().entries().filter(|entry| entry.direction == Direction::FromUnit);
    (all, record.flat_map(|entry| entry.bytes.clone()).collect())
}

#[test]
fn every_quotation_means_what_it_says() {
    let mut wrong = Vec::new();
    for (_, quotations) in transcripts() {
        assert!(!quotations.is_empty());
        let (all, _) = understood(&quotations, &[usize::MAX]);
        for (quotation, meaning) in quotations.iter().zip(all) {
            if quotation.meaning != meaning {
                wrong.push(format!("{}: {meaning:?}, not {:?}", quotation.place, quotation.meaning));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

proptest! {
    #[test]
    fn chunks_change_neither_a_meaning_nor_a_byte(sizes in prop::collection::vec(1usize..40, 1..12)) {
        for (name, quotations) in transcripts() {
            let whole = understood(&quotations, &[usize::MAX]);
            let chunked = understood(&quotations, &sizes);
            prop_assert_eq!(&chunked.0, &whole.0, "{}", name);
            prop_assert_eq!(&chunked.1, &whole.1, "{}", name);
            let said: usize = quotations.iter().map(|quotation| quotation.said.len()).sum();
            prop_assert_eq!(chunked.1.len(), said, "{}", name);
        }
    }
}
