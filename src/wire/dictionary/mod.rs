//! Lines of V, the view of the object dictionary (manuals, section 4.1.1).
//!
//! The manuals fix hexadecimal indices and nothing else. So a line is read by its tokens: an index in one of its usual
//! spellings, a sub-index beside it or at the head of a line below, and the rest, out of which a caller who knows the
//! entry picks its value ([`value()`]). A line that leaves a doubt stays text.

mod columns;
mod value;

pub use columns::several;
pub use value::{Expected, Reading, Shown, value};

/// Which entry a line speaks of, and what else it says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewLine {
    /// Index; `None` on a line below its object's heading.
    pub index: Option<u16>,
    /// Sub-index, where the line names one.
    pub sub: Option<SubIndex>,
    /// The line without index and sub-index.
    pub rest: String,
}

/// A sub-index as printed. Units write it in hexadecimal or in decimal digits; only its neighbours show which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubIndex {
    /// Its digits as hexadecimal ones.
    pub hexadecimal: u8,
    /// Its digits as decimal ones, if they can be and nothing marks them as hexadecimal.
    pub decimal: Option<u8>,
}

impl SubIndex {
    /// The sub-index that is meant, if it follows `before`.
    pub fn behind(self, before: Option<u8>) -> u8 {
        let next = before.map_or(0, |before| before.saturating_add(1));
        match self.decimal {
            Some(decimal) if self.hexadecimal != next && decimal == next => decimal,
            _ => self.hexadecimal,
        }
    }

    fn of(digits: &str) -> Option<Self> {
        let marked = digits.starts_with("0x") || digits.ends_with(['h', 'H']);
        let plain = digits.trim_start_matches("0x").trim_end_matches(['h', 'H']);
        let fits = (1..=2).contains(&plain.len()) && plain.bytes().all(|digit| digit.is_ascii_hexdigit());
        let hexadecimal = fits.then(|| u8::from_str_radix(plain, 16).ok()).flatten()?;
        Some(SubIndex { hexadecimal, decimal: plain.parse().ok().filter(|_| !marked) })
    }
}

/// What is between two columns of [`ViewLine::rest`].
const COLUMNS: &str = "  ";

/// Reads a line. `knows` says whether an index is that of an object: spellings that could be something else count only
/// for these.
pub fn line(text: &str, knows: impl Fn(u16) -> bool) -> Option<ViewLine> {
    let columns = columns::of(text);
    let placed: Vec<(usize, &str)> = columns::words(&columns);
    let tokens: Vec<&str> = placed.iter().map(|(_, token)| *token).collect();
    let head = sub_at_head(&tokens);
    for (place, token) in tokens.iter().enumerate() {
        // After a sub-index a number of four digits is a value: `01h RTD1 = 2711h`.
        let Some((index, sub, marked)) = address(token).filter(|_| place == 0 || head.is_none()) else { continue };
        let names_object = place == 0 || tokens[place - 1].to_ascii_lowercase().starts_with(['o', 'i']);
        // `Name  6126 sub 0  16.0`: the word after it marks it as well.
        let has_sub = tokens.get(place + 1).is_some_and(|next| is_sub(next));
        if !((marked || place == 0 || has_sub) && knows(index) || marked && index >= 0x1000 && names_object) {
            continue;
        }
        let behind = &tokens[place + 1..];
        let (sub, taken) = match sub {
            Some(sub) => (Some(sub), 0),
            None => sub_behind(token, behind),
        };
        let mut rest = placed[..place].to_vec();
        // `Name (6126h, 01h): 16.0`: the colon is that of the value.
        let last = tokens[place + taken];
        if place > 0 && last.ends_with(':') {
            rest.push((placed[place + taken].0, ":"));
        }
        rest.extend(&placed[place + taken + 1..]);
        return Some(ViewLine { index: Some(index), sub, rest: columns::join(&rest) });
    }
    let (sub, taken) = head?;
    Some(ViewLine { index: None, sub: Some(sub), rest: columns::join(&placed[taken..]) })
}

/// Index and sub-index of a token, and whether it is marked as hexadecimal: `6126h`, `0x6126`, `$6126`, `[6126:01]`,
/// `6126sub1`, `6126h.1`, `6126/1`, `6126h[1]`.
fn address(token: &str) -> Option<(u16, Option<SubIndex>, bool)> {
    let bare = token.trim_matches(['[', ']', '(', ')', '<', '>', ',', ';']).trim_end_matches([':', '.', '=']);
    let (plain, prefixed) = match bare.strip_prefix("0x").or(bare.strip_prefix("0X")).or(bare.strip_prefix('$')) {
        Some(plain) => (plain, true),
        None => (bare, false),
    };
    let digits = plain.get(..4)?;
    if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let index = u16::from_str_radix(digits, 16).ok()?;
    let rest = &plain[4..];
    let (rest, suffixed) = match rest.strip_prefix(['h', 'H']) {
        Some(rest) => (rest, true),
        None => (rest, false),
    };
    let marked = prefixed || suffixed;
    if rest.is_empty() {
        return Some((index, None, marked));
    }
    let lower = rest.to_ascii_lowercase();
    let (separator, sub) = ["sub", ":", ".", "/", ",", "[", "("]
        .iter()
        .find_map(|separator| Some((*separator, SubIndex::of(lower.strip_prefix(separator)?)?)))?;
    // A number like 6126.01 is not an address unless something marks it.
    let bracketed = token.starts_with('[');
    Some((index, Some(sub), marked || bracketed || matches!(separator, "sub" | ":")))
}

/// A sub-index in tokens of its own after an index, and how many tokens it takes: `sub 1`, `sub-index: 01`, `[1]`,
/// `01h`; also within the brackets of the index: `(6126h, 1)`.
fn sub_behind(index: &str, tokens: &[&str]) -> (Option<SubIndex>, usize) {
    let Some((sub, taken)) = sub_at_head(tokens) else { return (None, 0) };
    let first = tokens[0];
    let closes = index.starts_with(['(', '[']) && first.trim_end_matches(':').ends_with([')', ']']);
    let is_its = taken == 2 || closes || first.starts_with(['[', '(', ':', '.', '/']) || is_marked(first);
    if is_its { (Some(sub), taken) } else { (None, 0) }
}

fn is_marked(token: &str) -> bool {
    let bare = token.trim_end_matches(':');
    bare.len() == 3 && bare.ends_with(['h', 'H'])
}

/// Whether a token says that a sub-index follows.
fn is_sub(token: &str) -> bool {
    let lower = token.to_ascii_lowercase();
    matches!(lower.trim_end_matches([':', '.', '=']), "sub" | "subindex" | "sub-index" | "si")
}

/// A sub-index at the head of a line, and how many tokens it takes: `01h Name`, `sub 1: 16.0`, `[1] ...`, `1: ...`.
fn sub_at_head(tokens: &[&str]) -> Option<(SubIndex, usize)> {
    let first = *tokens.first()?;
    let lower = first.to_ascii_lowercase();
    let name = lower.trim_end_matches([':', '.', '=']);
    if is_sub(first) {
        return SubIndex::of(tokens.get(1)?.trim_end_matches([':', '.', ',', '=', ']', ')'])).map(|sub| (sub, 2));
    }
    if let Some(digits) = name.strip_prefix("sub") {
        return SubIndex::of(digits.trim_start_matches('-')).map(|sub| (sub, 1));
    }
    let marked = is_marked(first)
        || first.ends_with(':')
        || first.ends_with(')')
        || first.starts_with(['[', '(', '.', ':', '/']);
    let digits = lower.trim_matches(['[', ']', '(', ')', ':', '.', '/', ',']);
    (marked && tokens.len() > 1).then(|| SubIndex::of(digits)).flatten().map(|sub| (sub, 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::DataType;
    use proptest::prelude::*;

    fn read(text: &str) -> Option<(Option<u16>, Option<u8>, String)> {
        line(text, |index| matches!(index, 0x6126 | 0x1000 | 0x5555))
            .map(|line| (line.index, line.sub.map(|sub| sub.hexadecimal), line.rest))
    }

    #[test]
    fn indices_and_sub_indices_are_found_in_their_usual_spellings() {
        let entry = |sub, rest: &str| Some((Some(0x6126), sub, rest.to_owned()));
        let table = [
            ("6126h Scaling Factor", entry(None, "Scaling Factor")),
            ("0x6126 Scaling Factor", entry(None, "Scaling Factor")),
            ("$6126: Scaling Factor", entry(None, "Scaling Factor")),
            ("Object 6126h, Scaling", entry(None, "Object Scaling")),
            ("[6126:01] TC1 = 16.0", entry(Some(1), "TC1 = 16.0")),
            ("6126sub1 16.0", entry(Some(1), "16.0")),
            ("6126subA\t16.0", entry(Some(10), "16.0")),
            ("6126h:01  Factor: 16.0", entry(Some(1), "Factor: 16.0")),
            ("0x6126.1 Factor .... 16.0", entry(Some(1), "Factor .... 16.0")),
            ("$6126/1 16.0", entry(Some(1), "16.0")),
            ("6126 sub 2 16.0", entry(Some(2), "16.0")),
            ("6126h sub-index 02: 16.0", entry(Some(2), "16.0")),
            ("[6126 sub 2] 16.0", entry(Some(2), "16.0")),
            ("TC2 - Factor  6126 sub 2  16.0", entry(Some(2), "TC2 - Factor  16.0")),
            ("6126h 03h TC3 = 16.0", entry(Some(3), "TC3 = 16.0")),
            ("6126h [3] 16.0", entry(Some(3), "16.0")),
            ("6126 Scaling Factor", entry(None, "Scaling Factor")),
            ("16.000 6126h.4 TC4", entry(Some(4), "16.000 TC4")),
            ("6126h[1] TC1 (REAL32) = 16.0", entry(Some(1), "TC1 (REAL32) = 16.0")),
            ("TC1 (6126h, 01h): 16.0", entry(Some(1), "TC1 : 16.0")),
            ("TC1 [6126h, 1]: 16.0", entry(Some(1), "TC1 : 16.0")),
            ("6126h/1  TC1  16.0  min 0 max 65535", entry(Some(1), "TC1  16.0  min 0 max 65535")),
            ("│ 6126h:01 │ TC1 │ 16.0 │", entry(Some(1), "TC1  16.0")),
            ("  01h TC1 = 16.000", Some((None, Some(1), "TC1 = 16.000".into()))),
            ("    sub 1: 16.000", Some((None, Some(1), "16.000".into()))),
            ("sub1: 16.000", Some((None, Some(1), "16.000".into()))),
            ("[2] 16.000", Some((None, Some(2), "16.000".into()))),
            ("2: 16.000", Some((None, Some(2), "16.000".into()))),
            ("  01h RTD1 = 2711h", Some((None, Some(1), "RTD1 = 2711h".into()))),
            ("Object 2711h Something new", Some((Some(0x2711), None, "Object Something new".into()))),
            ("limit 0x2711", None),
            ("6127 Scaling Offset", None),
            ("16.000 mA", None),
            ("Supply 24.1 V", None),
            ("Main Menu - AXTC4CO V1.1.0", None),
            ("  25.1;  26.2; 100.0", None),
            ("", None),
        ];
        for (text, expected) in table {
            assert_eq!(read(text), expected, "{text:?}");
        }
    }

    #[test]
    fn a_sub_index_in_decimal_digits_is_told_by_its_neighbours() {
        let sub = |text: &str| line(text, |_| true).and_then(|line| line.sub).expect("a sub-index");
        assert_eq!((sub("sub 10: 0").behind(Some(9)), sub("sub 10: 0").behind(Some(15))), (10, 16));
        assert_eq!((sub("  10h x 0").behind(Some(9)), sub("6126.11 0").behind(Some(10))), (16, 11));
        assert_eq!((sub("sub A: 0").behind(Some(9)), sub("sub 1: 0").behind(None)), (10, 1));
    }

    proptest! {
        #[test]
        fn any_text_gives_nothing_but_what_it_says(text in "\\PC{0,120}") {
            if let Some(line) = line(&text, |_| true) {
                prop_assert!(line.rest.split_whitespace().all(|word| text.contains(word)), "{:?}", line);
                let expected = Expected { data_type: DataType::Real32, names: &["TC1", "a b"], unit: Some("ms") };
                let numeral = value(&line.rest, &expected).map(|reading| reading.numeral);
                prop_assert!(numeral.is_none_or(|numeral| line.rest.contains(&numeral)), "{:?}", line);
            }
        }

        #[test]
        fn tokens_in_any_order_give_no_other_entry_than_theirs(
            text in "((6126h|0x6126|sub|1|=|:|16\\.0|\\[|\\]|0x|h|\\.\\.\\.|é)[ ]?){0,12}"
        ) {
            if let Some(line) = line(&text, |_| true) {
                let is_of_text = |index: u16| text.contains(&format!("{index:04x}"));
                prop_assert!(line.index.is_none_or(is_of_text), "{:?}", line);
                let expected = Expected { data_type: DataType::Unsigned16, names: &["sub 1"], unit: None };
                let numeral = value(&line.rest, &expected).map(|reading| reading.numeral);
                prop_assert!(numeral.is_none_or(|numeral| line.rest.contains(&numeral)), "{:?}", line);
            }
        }
    }
}
