//! What several targets need: raw input that is also a talk, so that files of the repository can be seeds.

use std::time::Duration;

use axcon::device::Complaint;

/// The input as a talk: bytes that come at once, and the wait before them.
///
/// A NUL followed by a byte n is a wait of n² ms, up to a minute; two NULs are a NUL. All else comes as it is, so a file
/// without a NUL comes in one piece.
pub fn pieces(input: &[u8]) -> Vec<(Duration, Vec<u8>)> {
    let mut pieces = vec![(Duration::ZERO, Vec::new())];
    let mut bytes = input.iter().copied();
    while let Some(byte) = bytes.next() {
        let wait = if byte == 0 { bytes.next().unwrap_or(0) } else { 0 };
        if wait > 0 {
            pieces.push((Duration::from_millis(u64::from(wait) * u64::from(wait)), Vec::new()));
        } else if let Some((_, piece)) = pieces.last_mut() {
            piece.push(byte);
        }
    }
    pieces
}

/// The first byte and what follows it: targets that have a parameter take it from there.
pub fn parameter(input: &[u8]) -> Option<(u8, &[u8])> {
    input.split_first().map(|(&first, rest)| (first, rest))
}

/// The complaints about a file written by hand lead to places in it, and move with the text.
///
/// # Panics
/// If they do not.
pub fn places(text: &str, complaints: &[Complaint], read: impl Fn(&str) -> Vec<Complaint>) {
    assert!(!complaints.is_empty());
    let lines: Vec<&str> = text.split('\n').collect();
    for complaint in complaints {
        assert!((1..=lines.len()).contains(&complaint.line), "{complaint}\n{text}");
        let columns = lines[complaint.line - 1].chars().count() + 1;
        assert!((1..=columns).contains(&complaint.column), "{complaint}\n{text}");
        assert!(!complaint.message.is_empty());
    }
    // A byte order mark is one only at the very beginning.
    if text.starts_with('\u{FEFF}') {
        return;
    }
    let moved = read(&format!("#\n#\n{text}"));
    assert_eq!(complaints.len(), moved.len(), "{text}");
    for (before, after) in complaints.iter().zip(&moved) {
        assert_eq!((&before.key, &before.message), (&after.key, &after.message), "{text}");
        // What is missing in the file as a whole is missing at its beginning.
        let whole = before.key.is_empty() && (after.line, after.column) == (1, 1);
        let follows = (before.line + 2, before.column) == (after.line, after.column);
        assert!(whole || follows, "{before} and {after}\n{text}");
    }
}
