//! `docs/devices.md` keeps its promises: every acceptance item of both products has its row, and every test that a row
//! names exists and says which item it proves.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use crate::tidy::sources_and_tests;

/// Items of the AXTC4CO's list; the numbers in between were never given out.
const AXTC4CO: &[RangeInclusive<u16>] = &[
    1..=9,
    20..=30,
    40..=52,
    60..=75,
    80..=84,
    90..=100,
    110..=131,
    140..=148,
    150..=157,
    160..=174,
    180..=199,
    210..=215,
];
/// Items of the AXRTD8CO's list.
const AXRTD8CO: &[RangeInclusive<u16>] = &[1..=148];

/// How a row begins that has no test yet; the reason follows.
const NOT_YET: &str = "not yet:";

struct Row {
    item: String,
    proof: String,
}

#[test]
fn every_acceptance_item_has_a_row_with_tests_that_name_it_or_a_reason() {
    let text = include_str!("../../docs/devices.md");
    let files = sources_and_tests();
    let mut complaints = one_test_for_two_items(text);
    for (product, ranges, digits) in [("AXTC4CO", AXTC4CO, 3), ("AXRTD8CO", AXRTD8CO, 1)] {
        let rows = rows(text, product);
        let mut count: BTreeMap<String, usize> = BTreeMap::new();
        for row in &rows {
            *count.entry(row.item.clone()).or_default() += 1;
            complaints.extend(complaint(product, row, &files));
        }
        for number in ranges.iter().cloned().flatten() {
            let item = format!("B-{number:0digits$}");
            match count.remove(&item) {
                Some(1) => {}
                Some(_) => complaints.push(format!("{product} {item} has several rows")),
                None => complaints.push(format!("{product} {item} has no row")),
            }
        }
        complaints.extend(count.into_keys().map(|item| format!("{product} has no item {item}")));
    }
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

/// Both lists have items with the same number, and a test says the number only: it is meant for one of the two.
fn one_test_for_two_items(text: &str) -> Vec<String> {
    let others = rows(text, "AXRTD8CO");
    let shared = |row: &Row| {
        let other = others.iter().find(|other| other.item == row.item)?;
        let test = tests(&row.proof).find(|test| tests(&other.proof).any(|also| also == *test))?;
        Some(format!("{test} cannot stand for {} of both products", row.item))
    };
    rows(text, "AXTC4CO").iter().filter_map(shared).collect()
}

/// Tests that a cell names.
fn tests(proof: &str) -> impl Iterator<Item = &str> {
    proof.split('`').skip(1).step_by(2)
}

/// The rows below the heading that names the product.
fn rows(text: &str, product: &str) -> Vec<Row> {
    let section = text.split("\n## ").find(|section| section.starts_with(product)).unwrap_or_default();
    section
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| B-")?.trim_end_matches('|').split('|').map(str::trim);
            let item = format!("B-{}", cells.next()?);
            Some(Row { item, proof: cells.next_back()?.to_owned() })
        })
        .collect()
}

/// What is wrong with a row, if something is.
fn complaint(product: &str, row: &Row, files: &[(String, String)]) -> Option<String> {
    let Row { item, proof } = row;
    if proof.strip_prefix(NOT_YET).is_some_and(|reason| reason.trim().len() > 10) {
        return None;
    }
    let tests: Vec<&str> = tests(proof).collect();
    if tests.is_empty() {
        return Some(format!("{product} {item} names no test and gives no reason"));
    }
    tests.iter().find_map(|test| {
        let Some((path, name)) = test.rsplit_once("::") else {
            return Some(format!("{product} {item}: {test} does not say in which file it is"));
        };
        let Some((_, text)) = files.iter().find(|(file, _)| file == path) else {
            return Some(format!("{product} {item}: there is no file {path}"));
        };
        let Some(at) = text.find(&format!("fn {name}(")) else {
            return Some(format!("{product} {item}: {path} has no test {name}"));
        };
        // From the blank line before it, or the end of another function.
        let above = text[..at].rsplit("\n\n").next().and_then(|above| above.rsplit("}\n").next());
        if above.is_none_or(|above| !above.contains("#[test]")) {
            return Some(format!("{product} {item}: {name} in {path} is no test"));
        }
        // The test's own comments, from its attribute to the next test, say which items it is for.
        let from = text[..at].rfind("#[test]").map_or(at, |test| text[..test].rfind("\n\n").unwrap_or(test));
        let to = text[at..].find("#[test]").map_or(text.len(), |next| at + next);
        let says = text[from..to].split(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).any(|word| word == item);
        (!says).then(|| format!("{product} {item}: {name} in {path} does not say that it is for it"))
    })
}
