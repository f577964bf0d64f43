//! `docs/errata.md` has every decision about the manuals that something cites, and no other.

use std::collections::BTreeSet;
use std::path::Path;

use crate::tidy::{documents, files, read, sources_and_tests};

const PAGE: &str = "docs/errata.md";

#[test]
fn every_decision_that_is_cited_is_listed_and_every_listed_one_is_cited() {
    let page = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE));
    let mut listed = BTreeSet::new();
    for line in page.lines() {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if is_number(cells[0]) {
            assert!(cells.len() == 4 && cells.iter().all(|cell| !cell.is_empty()), "four cells are wanted: {line}");
            assert!(listed.insert(cells[0]), "{} is listed twice", cells[0]);
        }
    }
    assert!(listed.len() > 60, "numbers are looked for: {}", listed.len());

    let others = files("src", "toml").into_iter().chain(documents());
    let others = others.map(|(path, text)| (path.to_string_lossy().into_owned(), text));
    let mut cited = BTreeSet::new();
    let mut unlisted = Vec::new();
    for (path, text) in sources_and_tests().into_iter().chain(others).filter(|(path, _)| path != PAGE) {
        for number in text.split(|c: char| !c.is_ascii_alphanumeric() && c != '-').filter(|word| is_number(word)) {
            if !listed.contains(number) {
                unlisted.push(format!("{path}: {number}"));
            }
            cited.insert(number.to_owned());
        }
    }
    assert!(unlisted.is_empty(), "{PAGE} does not have what is cited:\n{}", unlisted.join("\n"));
    let uncited: Vec<&str> = listed.into_iter().filter(|number| !cited.contains(*number)).collect();
    assert!(uncited.is_empty(), "nothing cites {uncited:?} of {PAGE}");
}

/// An E or a C, a hyphen, for the AXRTD8CO a letter, and digits.
fn is_number(word: &str) -> bool {
    let Some(rest) = word.strip_prefix("E-").or_else(|| word.strip_prefix("C-")) else { return false };
    let digits = rest.strip_prefix(|c: char| c.is_ascii_uppercase()).unwrap_or(rest);
    !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
}
