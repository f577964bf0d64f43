//! Lines in columns: of an entry, or with several entries side by side.
//!
//! A number of one or two digits is a sub-index only where the layout says so: in a column of its own after an index,
//! before an equals sign in a list like `1=16.000, 2=17.000`, or at the head of a column, if it follows the sub-index
//! of the column before.

use super::{COLUMNS, SubIndex, ViewLine, address, sub_at_head};

/// The columns of a line: what is between bars, tabs, semicolons, or two or more blanks.
pub(super) fn of(text: &str) -> Vec<String> {
    let is_border = |sign: char| matches!(sign, '|' | '\t' | ';' | '\u{2500}'..='\u{259F}');
    let even: String =
        text.chars().map(|sign| if is_border(sign) { COLUMNS.to_owned() } else { sign.into() }).collect();
    even.split(COLUMNS).map(str::trim).filter(|column| !column.is_empty()).map(str::to_owned).collect()
}

/// The words of some columns, each with the number of its column.
pub(super) fn words(columns: &[String]) -> Vec<(usize, &str)> {
    columns.iter().enumerate().flat_map(|(at, column)| column.split_whitespace().map(move |word| (at, word))).collect()
}

/// Words as a text that still shows the columns.
pub(super) fn join(words: &[(usize, &str)]) -> String {
    let mut text = String::new();
    let mut last = None;
    for (column, word) in words {
        match last {
            Some(last) if last == column => text.push(' '),
            Some(_) => text.push_str(COLUMNS),
            None => {}
        }
        text.push_str(word);
        last = Some(column);
    }
    text
}

/// Ways in which a line may be read as entries in columns, the likeliest first. Each counts only if all of its entries
/// have a value. What a line says as a whole is read by [`super::line`].
pub fn several(text: &str, knows: impl Fn(u16) -> bool) -> Vec<Vec<ViewLine>> {
    let columns = of(text);
    [side_by_side(&columns, &knows), listed(&columns, &knows), one(&columns, &knows).map(|line| vec![line])]
        .into_iter()
        .flatten()
        .collect()
}

/// `6126h | 01h | name | value`; with single blanks only if there is nothing but `6126 01 16.000`.
fn one(columns: &[String], knows: &impl Fn(u16) -> bool) -> Option<ViewLine> {
    let words = words(columns);
    let [(first, index), (second, sub), rest @ ..] = &words[..] else { return None };
    let (third, _) = rest.first()?;
    let is_nothing_else = columns.len() == 1 && rest.len() == 1;
    let is_in_columns = second != third && *second <= first + 1;
    // The two have their columns to themselves, or one for both.
    if !(is_nothing_else || is_in_columns) {
        return None;
    }
    let (index, _, _) = address(index).filter(|(index, sub, _)| sub.is_none() && knows(*index))?;
    let sub = SubIndex::of(&sub.trim_end_matches([':', '.', '=']).to_ascii_lowercase())?;
    Some(ViewLine { index: Some(index), sub: Some(sub), rest: join(rest) })
}

/// `6126h Name: 1=16.000, 2=16.000`, and the rest of such a list on the next line.
fn listed(columns: &[String], knows: &impl Fn(u16) -> bool) -> Option<Vec<ViewLine>> {
    let words = words(columns);
    let pair = |word: &str| {
        let (sub, value) = word.trim_end_matches([',', ';']).split_once('=')?;
        let sub = SubIndex::of(&sub.to_ascii_lowercase())?;
        (!value.is_empty()).then(|| (sub, value.to_owned()))
    };
    let pairs = words.iter().rev().map_while(|(_, word)| pair(word)).count();
    let (head, tail) = words.split_at(words.len() - pairs);
    let index = match head.first() {
        Some((_, first)) => Some(address(first).filter(|(index, sub, _)| sub.is_none() && knows(*index))?.0),
        None => None,
    };
    let entries = tail.iter().filter_map(|(_, word)| pair(word));
    let lines = entries.map(|(sub, rest)| ViewLine { index, sub: Some(sub), rest }).collect();
    in_order(lines)
}

/// Entries beside each other, each with its address or its sub-index at the head of a column:
/// `01h TC1  16.000   02h TC2  17.000`.
fn side_by_side(columns: &[String], knows: &impl Fn(u16) -> bool) -> Option<Vec<ViewLine>> {
    let mut heading = None;
    let mut entries: Vec<(ViewLine, Vec<(usize, &str)>)> = Vec::new();
    for (at, column) in columns.iter().enumerate() {
        let words: Vec<&str> = column.split_whitespace().collect();
        let place = |from: usize| words[from..].iter().map(move |word| (at, *word)).collect::<Vec<_>>();
        let addressed = words.first().and_then(|first| address(first)).filter(|(index, _, _)| knows(*index));
        let start = match addressed {
            Some((index, Some(sub), _)) => Some((Some(index), sub, 1)),
            Some((index, None, true)) => match sub_at_head(&words[1..]) {
                Some((sub, taken)) => Some((Some(index), sub, 1 + taken)),
                // The heading of entries on the same line.
                None if entries.is_empty() && at == 0 => {
                    heading = Some(index);
                    continue;
                }
                None => None,
            },
            // A column that is nothing but `05h` is a value.
            _ => {
                sub_at_head(&words).filter(|(_, taken)| words.len() > *taken).map(|(sub, taken)| (heading, sub, taken))
            }
        };
        match (start, entries.last_mut()) {
            (Some((index, sub, taken)), _) => {
                entries.push((ViewLine { index, sub: Some(sub), rest: String::new() }, place(taken)));
            }
            (None, Some((_, rest))) => rest.extend(place(0)),
            // Something else comes before the first of them.
            (None, None) => return None,
        }
    }
    in_order(entries.into_iter().map(|(line, rest)| ViewLine { rest: join(&rest), ..line }).collect())
}

/// Two entries or more of one object whose sub-indices follow one another, with something after each.
fn in_order(lines: Vec<ViewLine>) -> Option<Vec<ViewLine>> {
    let follows = |pair: &[ViewLine]| {
        let [Some(one), Some(next)] = [pair[0].sub, pair[1].sub] else { return false };
        let follows = |one: u8| one.checked_add(1).is_some_and(|expected| next.behind(Some(one)) == expected);
        pair[0].index == pair[1].index && (follows(one.hexadecimal) || one.decimal.is_some_and(follows))
    };
    let is_list = lines.len() >= 2 && lines.windows(2).all(follows) && lines.iter().all(|line| !line.rest.is_empty());
    is_list.then_some(lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The first way a line is read in, as `index.sub rest`.
    fn read(text: &str) -> Option<String> {
        let ways = several(text, |index| matches!(index, 0x6126 | 0x2000));
        let shown = |line: &ViewLine| {
            let index = line.index.map_or_else(String::new, |index| format!("{index:04X}"));
            let sub = line.sub.map_or(0, |sub| sub.hexadecimal);
            format!("{index}.{sub:X} {}", line.rest)
        };
        ways.first().map(|lines| lines.iter().map(shown).collect::<Vec<_>>().join(" / "))
    }

    #[test]
    fn a_sub_index_in_its_own_column_is_one() {
        for (text, expected) in [
            ("| 6126h | 01h | TC1 | 16.000 |", Some("6126.1 TC1  16.000")),
            ("│ 6126h │ 01h │ TC1 │ 16.000 │", Some("6126.1 TC1  16.000")),
            ("| 0x6126 | 0x01 | TC1 | REAL32 | RW | 16.000 |", Some("6126.1 TC1  REAL32  RW  16.000")),
            ("6126  01  Scaling Factor TC1    16.000", Some("6126.1 Scaling Factor TC1  16.000")),
            ("6126 01  TC1  16.000", Some("6126.1 TC1  16.000")),
            ("6126\t0A\tREAL32\t16.000", Some("6126.A REAL32  16.000")),
            ("6126;01;TC1;16.000", Some("6126.1 TC1  16.000")),
            ("6126 01 16.000", Some("6126.1 16.000")),
            ("6126h 1 16.000", Some("6126.1 16.000")),
            ("6126 01 16.000 17.000", None),
            ("6126 01 TC1 16.000", None),
            ("6126  01 TC1  16.000", None),
            ("6126  1000  16.000", None),
            ("6127  01  16.000", None),
            ("7.300  66.123  81.685", None),
            ("12:00 01 16.0", None),
            ("6126h Scaling Factor", None),
            ("6126", None),
            ("", None),
        ] {
            assert_eq!(read(text).as_deref(), expected, "{text:?}");
        }
    }

    #[test]
    fn several_entries_of_one_line_are_told_by_their_order() {
        for (text, expected) in [
            ("6126h Factor: 0=2, 1=16.000, 2=17.000", Some("6126.0 2 / 6126.1 16.000 / 6126.2 17.000")),
            ("6126h Factor: 01=16.000 02=17.000", Some("6126.1 16.000 / 6126.2 17.000")),
            ("  3=16.000, 4=17.000", Some(".3 16.000 / .4 17.000")),
            ("  01h TC1    16.000   02h TC2   17.000", Some(".1 TC1  16.000 / .2 TC2  17.000")),
            ("  00h Number    05h   01h COB-ID  0200h", Some(".0 Number  05h / .1 COB-ID  0200h")),
            ("6126h:01 TC1  16.000   6126h:02 TC2  17.000", Some("6126.1 TC1  16.000 / 6126.2 TC2  17.000")),
            ("6126h 01h TC1  16.0   6126h 02h TC2  17.0", Some("6126.1 TC1  16.0 / 6126.2 TC2  17.0")),
            ("6126h Factor   01h TC1  16.0   02h TC2  17.0", Some("6126.1 TC1  16.0 / 6126.2 TC2  17.0")),
            ("6126h Type: 1=10, 3=20", None),
            ("6126h Type: 1=10", None),
            ("6126h Type (0=off 1=on) 1", None),
            ("  01h TC1  16.000   03h TC3  17.000", None),
            ("  01h TC1  16.000   02h", None),
            ("  text  01h TC1  16.0   02h TC2  17.0", None),
        ] {
            assert_eq!(read(text).as_deref(), expected, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn columns_of_any_words_keep_all_of_them(text in "([a-z0-9=:h|│\t ]){0,60}") {
            let plain = |text: &str| text.replace(['|', '│', '\t', ' '], "");
            prop_assert_eq!(plain(&join(&words(&of(&text)))), plain(&text));
            for line in several(&text, |_| true).concat() {
                prop_assert!(line.sub.is_some() && !line.rest.is_empty(), "{:?}", line);
                prop_assert!(line.rest.split_whitespace().all(|word| text.contains(word)), "{:?}", line);
            }
        }

        #[test]
        fn an_entry_in_columns_has_one_address(
            sub in 0u8..=255, value in "[0-9]{1,5}", border in "( \\| |\t|  |   )", mark in "(0x|)"
        ) {
            let line = format!("{mark}6126{border}{mark}{sub:02X}{border}some name{border}{value}");
            prop_assert_eq!(read(&line), Some(format!("6126.{sub:X} some name  {value}")));
        }
    }
}
