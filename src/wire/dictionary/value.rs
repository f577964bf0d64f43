//! Which of the words after an entry's address is its value.
//!
//! The caller knows the entry's type, the names it may carry, and its unit. What can be read in two ways is not a
//! value: a decimal comma, another unit of the same quantity, two numbers of which either could be meant.

use crate::canopen::{DataType, Value};
use crate::wire::units::unit;

/// What is known of an entry whose value is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Expected<'a> {
    /// Its type.
    pub data_type: DataType,
    /// Names that the line may repeat, and that may hold numbers.
    pub names: &'a [&'a str],
    /// The unit its numbers are in.
    pub unit: Option<&'a str>,
}

/// What a line says an entry holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// A value.
    Value(Value),
    /// Nothing: the unit has no number for it at the moment.
    Nothing,
    /// Digits as only a unit prints them that does not mark hexadecimal numbers: `C000027F`, `FA 00 00 00`.
    Hexadecimal,
}

/// What has been read.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// What it says.
    pub shown: Shown,
    /// The part of the line that says it.
    pub numeral: String,
    /// The numeral has only decimal digits: if the unit does not mark hexadecimal numbers, the value is another one.
    pub plain: bool,
}

/// What comes before a candidate, the surest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Equals,
    Colon,
    /// After the word `value`, or alone in its column.
    Column,
    Anywhere,
}

struct Token<'a> {
    /// `None` if it is part of a name.
    text: Option<&'a str>,
    column: usize,
}

/// The value a line shows of an entry. `None` if there is none, or more than one that could be meant.
pub fn value(rest: &str, expected: &Expected<'_>) -> Option<Reading> {
    let columns = rest.split(super::COLUMNS).enumerate();
    let mut tokens: Vec<Token<'_>> = columns
        .flat_map(|(column, cell)| cell.split_whitespace().map(move |text| Token { text: Some(text), column }))
        .collect();
    // A name may be the beginning of another: `Heartbeat Time` and `Heartbeat Time 1`.
    let mut names = expected.names.to_vec();
    names.sort_by_key(|name| std::cmp::Reverse(name.len()));
    for name in names {
        forget(&mut tokens, name);
    }
    if let Some(bytes) = bytes(&tokens) {
        let is_all = bytes.len() == expected.data_type.bytes();
        let is_hexadecimal = bytes.iter().any(|byte| byte.starts_with('0') || !is_decimal(byte));
        return (is_all && is_hexadecimal).then(|| Reading {
            shown: Shown::Hexadecimal,
            numeral: bytes.join(" "),
            plain: false,
        });
    }
    let found = candidates(&tokens, expected)?;
    let hexadecimal = unmarked_hexadecimal(&tokens, expected.data_type);
    let Some(place) = found.iter().map(|(place, _)| *place).min() else {
        // No number that could be the value.
        return match hexadecimal[..] {
            [numeral] => Some(Reading { shown: Shown::Hexadecimal, numeral: numeral.to_owned(), plain: false }),
            [] => no_number(&tokens),
            _ => None,
        };
    };
    let mut meant = found.iter().filter(|(at, _)| *at == place).map(|(_, reading)| reading);
    let one = meant.next()?.clone();
    // An unmarked hexadecimal number on the same line may be the value instead.
    let is_same =
        |digits: &&str| i64::from_str_radix(digits, 16).ok().and_then(|number| expected.data_type.integer(number));
    let is_doubtful =
        place >= Place::Column && hexadecimal.iter().any(|digits| is_same(digits).map(Shown::Value) != Some(one.shown));
    if is_doubtful || meant.any(|other| other.shown != one.shown) {
        return None;
    }
    // `250 (0xFA)`: the other spelling shows how this one is meant.
    let plain = found.iter().filter(|(_, other)| other.shown == one.shown).all(|(_, other)| other.plain);
    Some(Reading { plain: plain && hexadecimal.is_empty(), ..one })
}

/// What stands for a value where the unit has no number: words without a digit after an equals sign, as in `= not set`,
/// or signs alone at the end, as in `****`.
fn no_number(tokens: &[Token<'_>]) -> Option<Reading> {
    let nothing = |numeral: String| Some(Reading { shown: Shown::Nothing, numeral, plain: false });
    let texts: Vec<&str> = tokens.iter().filter_map(|token| token.text).collect();
    if let Some(at) = texts.iter().rposition(|text| text.contains('=')) {
        let after = texts[at].rsplit_once('=').map_or("", |(_, after)| after);
        let said = [&[after][..], &texts[at + 1..]].concat().join(" ");
        let said = said.trim();
        return if said.is_empty() || said.contains(|c: char| c.is_ascii_digit()) {
            None
        } else {
            nothing(said.to_owned())
        };
    }
    let signs = |text: &&str| text.len() >= 2 && text.bytes().all(|sign| matches!(sign, b'*' | b'?' | b'#'));
    texts.last().copied().filter(signs).and_then(|signs| nothing(signs.to_owned()))
}

/// Whether what comes after a number says that the number belongs to a name: `Scaling 9: ...`, `Type 3 = ...`.
fn is_in_name(text: &str, next: Option<&str>) -> bool {
    (text.ends_with(':') && next.is_some()) || next.is_some_and(|next| next.starts_with('=') || next == ":")
}

/// Numbers that may be the value, with their places. `None` if one of them may be meant in another way.
fn candidates(tokens: &[Token<'_>], expected: &Expected<'_>) -> Option<Vec<(Place, Reading)>> {
    let mut found = Vec::new();
    let mut place = Place::Anywhere;
    // The word directly before, whatever signs are between.
    let mut label = String::new();
    // `3 -> 1` may mean either.
    if tokens.iter().any(|token| matches!(token.text, Some("->" | "=>"))) {
        return None;
    }
    for (at, token) in tokens.iter().enumerate() {
        let Some(text) = token.text else {
            place = if place == Place::Equals { place } else { Place::Anywhere };
            label.clear();
            continue;
        };
        let word = match text.rsplit_once('=') {
            Some((before, word)) => {
                place = Place::Equals;
                if !before.is_empty() {
                    label = plain(before);
                }
                word
            }
            None => text,
        };
        let bare = bare(word);
        if is_with_comma(bare) && !text.starts_with(['(', '[']) {
            return None;
        }
        let next = tokens.get(at + 1).map(|token| token.text.unwrap_or_default());
        let is_value = !is_in_name(text, next) && !is_before_signs(tokens, at);
        if let Some(reading) = read(bare, expected).filter(|_| is_value) {
            let mut behind = tokens[at + 1..].iter().map(|token| token.text.unwrap_or_default());
            let (next, further) = (behind.next().unwrap_or_default(), behind.next().unwrap_or_default());
            // `500 min 0 max 65535` is about limits, and not about minutes.
            let is_limit =
                next == "min" && further.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '='));
            if !is_limit && !fits(plain_unit(next), expected.unit) {
                return None;
            }
            let is_column = is_alone(tokens, at) || matches!(label.as_str(), "value" | "val");
            let place = if place == Place::Anywhere && is_column { Place::Column } else { place };
            if !is_other(&label) {
                found.push((place, reading));
            }
        }
        place = match place {
            _ if is_value && read(bare, expected).is_some() => Place::Anywhere,
            _ if word.ends_with(':') || (word.len() >= 2 && word.bytes().all(|sign| sign == b'.' || sign == b'_')) => {
                Place::Colon
            }
            place if bare.is_empty() => place,
            _ => Place::Anywhere,
        };
        let next = plain(word);
        if !next.is_empty() {
            label = next;
        }
    }
    Some(found)
}

/// Whether a number ends a name in a column of its own, and signs alone follow in the value's: `Scaling 9 | ****`.
fn is_before_signs(tokens: &[Token<'_>], at: usize) -> bool {
    let column = tokens[at].column;
    let has_words_before = tokens[..at].iter().any(|token| token.column == column);
    let mut later = tokens.iter().filter(|token| token.column > column).filter_map(|token| token.text);
    has_words_before && later.next().is_some_and(|text| !text.contains(char::is_alphanumeric))
}

/// Whether a word before a number says that it is not the present value.
fn is_other(label: &str) -> bool {
    let labels = ["min", "minimum", "max", "maximum", "default", "def", "factory", "was", "old", "previous"];
    labels.contains(&label)
}

/// Whether a number has its column to itself, but for a unit and what is in brackets.
fn is_alone(tokens: &[Token<'_>], at: usize) -> bool {
    let column = tokens[at].column;
    let mut others = tokens.iter().enumerate().filter(|(place, token)| token.column == column && *place != at);
    others.all(|(place, token)| match token.text {
        None => true,
        Some(text) => place > at && (text.starts_with(['(', '[']) || unit(plain_unit(text)).is_some()),
    })
}

/// The bytes of a value that is printed byte by byte; a single one is a number.
fn bytes<'a>(tokens: &[Token<'a>]) -> Option<Vec<&'a str>> {
    let is_byte = |token: &&Token<'a>| token.text.is_some_and(|text| text.len() == 2 && is_hexadecimal(text));
    (0..tokens.len()).find_map(|at| {
        let of_one = |token: &&Token<'a>| is_byte(token) && token.column == tokens[at].column;
        let run: Vec<&str> = tokens[at..].iter().take_while(of_one).filter_map(|token| token.text).collect();
        (run.len() >= 2).then_some(run)
    })
}

/// Words that can only be hexadecimal numbers without a mark, and are no words of a language.
fn unmarked_hexadecimal<'a>(tokens: &[Token<'a>], data_type: DataType) -> Vec<&'a str> {
    let digits = data_type.bytes() * 2;
    let is_one = |word: &&str| {
        let (has_digit, is_upper) =
            (word.bytes().any(|c| c.is_ascii_digit()), !word.bytes().any(|c| c.is_ascii_lowercase()));
        is_hexadecimal(word)
            && !is_decimal(word)
            && word.len() <= digits
            && ((has_digit && (word.len() >= 2 && data_type != DataType::Real32)) || (word.len() == digits && is_upper))
    };
    let words = tokens.iter().filter_map(|token| token.text).filter(|text| !text.starts_with(['(', '[']));
    words.map(|text| bare(text.rsplit_once('=').map_or(text, |(_, word)| word))).filter(is_one).collect()
}

fn is_hexadecimal(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_hexdigit())
}

fn is_decimal(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit())
}

/// `24,061`, `1,919800E+02`, `1,000.00`: a comma between digits, and nothing but what numbers are made of.
fn is_with_comma(word: &str) -> bool {
    let bytes = word.as_bytes();
    let between = |at: usize| bytes[at] == b',' && bytes[at - 1].is_ascii_digit() && bytes[at + 1].is_ascii_digit();
    (1..bytes.len().saturating_sub(1)).any(between)
}

/// A word without the signs around it.
fn bare(word: &str) -> &str {
    word.trim_matches(['(', ')', '[', ']', '<', '>', ',', ';', '"', '\'']).trim_end_matches(':')
}

/// Takes a name's words out of the tokens, where they follow one another.
fn forget(tokens: &mut [Token<'_>], name: &str) {
    let words: Vec<String> = name.split_whitespace().map(plain).collect();
    if words.is_empty() || words.len() > tokens.len() {
        return;
    }
    for start in 0..=tokens.len() - words.len() {
        let matches =
            |(place, word): (usize, &String)| tokens[start + place].text.is_some_and(|token| plain(token) == *word);
        if words.iter().enumerate().all(matches) {
            tokens[start..start + words.len()].iter_mut().for_each(|token| token.text = None);
            return;
        }
    }
}

fn plain(word: &str) -> String {
    word.trim_matches(|c: char| !c.is_alphanumeric()).to_lowercase()
}

/// What a word says of an entry, if it is a number or means that there is none.
fn read(word: &str, expected: &Expected<'_>) -> Option<Reading> {
    let reading = |shown, numeral: &str| {
        let digits = numeral.strip_prefix(['+', '-']).unwrap_or(numeral);
        Reading { shown, numeral: numeral.to_owned(), plain: is_decimal(digits) }
    };
    if let Some(shown) = parse(word, expected.data_type) {
        return Some(reading(shown, word));
    }
    // `16ms`, `24.1V`. Letters that are also hexadecimal digits count as a unit only if the number has a point.
    let end = word.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '+' | '-')))?;
    let (numeral, behind) = word.split_at(end);
    let is_sure =
        unit(behind).is_some() && (numeral.contains('.') || !is_hexadecimal(behind)) && fits(behind, expected.unit);
    parse(numeral, expected.data_type).filter(|_| is_sure).map(|shown| reading(shown, numeral))
}

fn parse(word: &str, data_type: DataType) -> Option<Shown> {
    let lower = word.to_ascii_lowercase();
    let dashes = lower.len() >= 2 && lower.bytes().all(|sign| sign == b'-');
    let no_number = data_type == DataType::Real32 && matches!(lower.as_str(), "nan" | "-nan" | "+nan" | "inf");
    if dashes || no_number || lower == "n/a" {
        return Some(Shown::Nothing);
    }
    if data_type == DataType::Boolean {
        match lower.as_str() {
            "on" | "yes" => return Some(Shown::Value(Value::Boolean(true))),
            "off" | "no" => return Some(Shown::Value(Value::Boolean(false))),
            _ => {}
        }
    }
    let motorola = lower.strip_prefix('$').map(|digits| format!("0x{digits}"));
    let word = motorola.as_deref().unwrap_or(word);
    if data_type == DataType::Real32 {
        // A number that is given as its bits has eight digits. `40490E10` is such bits, and not a number with an
        // exponent.
        let marked = lower.strip_prefix(['$']).or(lower.strip_prefix("0x")).or(lower.strip_suffix('h'));
        if marked.map_or(lower.contains('e') && is_hexadecimal(&lower), |digits| digits.len() != 8) {
            return None;
        }
    }
    match data_type.parse(word).or_else(|| negative(&lower, data_type))? {
        Value::Real32(number) if number.is_nan() => Some(Shown::Nothing),
        value => Some(Shown::Value(value)),
    }
}

/// A negative number in hexadecimal digits: as many as its type has say that the first bit is the sign.
fn negative(word: &str, data_type: DataType) -> Option<Value> {
    let digits = word.strip_prefix(['$']).or(word.strip_prefix("0x")).or(word.strip_suffix('h'))?;
    let bits = data_type.bytes() * 8;
    let number = i64::from_str_radix(digits, 16).ok().filter(|_| digits.len() * 4 == bits && bits < 64)?;
    data_type.integer(number - (1 << bits))
}

fn plain_unit(word: &str) -> &str {
    word.trim_matches(['(', ')', '[', ']', ',', ';', '.'])
}

/// Whether a unit after a number may be that of the entry. Another one of the same quantity makes it another number:
/// `24061 mV` is not 24061 V.
fn fits(printed: &str, own: Option<&str>) -> bool {
    let (Some(printed), Some(own)) = (unit(printed), own) else { return true };
    // The unit `0.1 °C` counts tenths of a degree.
    let (factor, name) = own.rsplit_once(' ').map_or((None, own), |(factor, name)| (Some(factor), name));
    unit(name).is_none_or(|own| own.quantity != printed.quantity || (own == printed && factor.is_none()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shown(rest: &str, data_type: DataType, names: &[&str], unit: Option<&str>) -> Option<Shown> {
        value(rest, &Expected { data_type, names, unit }).map(|reading| reading.shown)
    }

    #[test]
    fn the_value_is_what_the_line_leaves_no_doubt_about() {
        let names = ["Thermocouple Scaling Factor", "TC1"];
        let real = |rest: &str| shown(rest, DataType::Real32, &names, None);
        let number = |number: f32| Some(Shown::Value(Value::Real32(number)));
        for (rest, expected) in [
            ("TC1 = 16.000", number(16.0)),
            ("Thermocouple Scaling Factor TC1 ........ 16.000", number(16.0)),
            ("Thermocouple Scaling Factor TC1: 1.6E+01 degC", number(16.0)),
            ("16.000 Thermocouple Scaling Factor TC1", number(16.0)),
            ("16.000  TC1", number(16.0)),
            ("TC1=16.000", number(16.0)),
            ("TC1 = nan", Some(Shown::Nothing)),
            ("TC1 = 0xFFFFFFFF", Some(Shown::Nothing)),
            ("TC1 = ----", Some(Shown::Nothing)),
            ("TC1 Scaling 9: ****", Some(Shown::Nothing)),
            ("TC1 Scaling 9 = not set", Some(Shown::Nothing)),
            ("TC1 Scaling 9 = ERROR", Some(Shown::Nothing)),
            ("TC1 Scaling 9 = 12abc", None),
            ("TC1 Scaling 9 = 1.5.2", None),
            ("TC1 Scaling 9 = 3 -> 1", None),
            ("TC1 Scaling 9 = 16.0", number(16.0)),
            ("TC1 Scaling 9  ****", Some(Shown::Nothing)),
            ("TC1 Scaling 9  16.0", number(16.0)),
            ("TC1 Scaling 9: 16.0", number(16.0)),
            ("input 1 factor = 16.0", number(16.0)),
            ("input 1 factor 16.0", None),
            ("REAL32 RW -1000.0 1000.0 16.0", None),
            ("REAL32 RW (-1000.0 to 1000.0) value: 16.0", number(16.0)),
            ("TC1", None),
            ("", None),
        ] {
            assert_eq!(real(rest), expected, "{rest:?}");
        }
        let whole = |rest: &str, data_type, names: &[&str]| match shown(rest, data_type, names, None) {
            Some(Shown::Value(value)) => value.as_integer(),
            _ => None,
        };
        for (rest, data_type, names, expected) in [
            ("Mapped object 1 = 0x71300110", DataType::Unsigned32, &["Mapped object 1"][..], Some(0x7130_0110)),
            ("= 60 Hz (60 Hz)", DataType::Unsigned8, &[], Some(60)),
            ("RTD1 = 10001 (3-wire RTD)", DataType::Unsigned16, &["RTD1"], Some(10_001)),
            ("RTD1 = 1 (IEC 0.00385)", DataType::Unsigned16, &["RTD1"], Some(1)),
            ("Bank 1 (TC1, TC2): 4768", DataType::Integer16, &["Bank 1 (TC1, TC2)"], Some(4_768)),
            ("Start in Operational Mode = off", DataType::Boolean, &["Start in Operational Mode"], Some(0)),
            ("COB-ID 400001FFh", DataType::Unsigned32, &["COB-ID"], Some(0x4000_01FF)),
            ("Status = 0x02 2", DataType::Unsigned8, &[], Some(2)),
            ("-200 (0.1 C)", DataType::Integer16, &[], Some(-200)),
        ] {
            assert_eq!(whole(rest, data_type, names), expected, "{rest:?}");
        }
    }

    #[test]
    fn as_many_hexadecimal_digits_as_a_signed_type_has_show_a_negative_number() {
        let read = |rest: &str, data_type| shown(rest, data_type, &["TC1"], None);
        for rest in ["TC1 = FF38h", "TC1 = $FF38", "TC1 = 0xff38", "TC1 = -200"] {
            assert_eq!(read(rest, DataType::Integer16), Some(Shown::Value(Value::Integer16(-200))), "{rest:?}");
        }
        assert_eq!(read("TC1 = 7FFFh", DataType::Integer16), Some(Shown::Value(Value::Integer16(0x7FFF))));
        assert_eq!(read("TC1 = FFFFFF38h", DataType::Integer32), Some(Shown::Value(Value::Integer32(-200))));
        assert_eq!(read("TC1 = FF38h", DataType::Unsigned16), Some(Shown::Value(Value::Unsigned16(0xFF38))));
        assert_eq!(read("TC1 = 1FF38h", DataType::Integer16), None, "more digits than it has");
    }

    #[test]
    fn a_column_of_its_own_is_the_value_unless_another_one_could_be() {
        let number = |number: f32| Some(Shown::Value(Value::Real32(number)));
        for (rest, expected) in [
            ("TC1  REAL32  RW  16.000", number(16.0)),
            ("Thermocouple 1 scaling  16.000", number(16.0)),
            ("Thermocouple 1 scaling  16.000 mV (calibrated)", number(16.0)),
            ("TC1  16.000  min 0 max 65535", number(16.0)),
            ("TC1  16.000  min=0  max=65535", number(16.0)),
            ("TC1  16.000  default: 17.000", number(16.0)),
            ("TC1 = 16.000 (was 17.000)", number(16.0)),
            ("TC1 value 16.000 default 17.000", number(16.0)),
            ("TC1  16.000  17.000", None),
            ("value 16.000  17.000", None),
            ("TC1  24,5  min 0 max 65535", None),
            ("TC1  min 0 max 65535", None),
            ("17.000 -> 16.000", None),
        ] {
            assert_eq!(shown(rest, DataType::Real32, &["TC1"], None), expected, "{rest:?}");
        }
    }

    #[test]
    fn what_can_be_read_in_two_ways_is_no_value() {
        let integer = |number: u32| Some(Shown::Value(Value::Unsigned32(number)));
        for (rest, expected) in [
            ("$10020194", integer(0x1002_0194)),
            ("value: $10020194", integer(0x1002_0194)),
            ("16ms", integer(16)),
            ("16 ms", integer(16)),
            ("16s", None),
            ("16 s", None),
            ("16 min", None),
            ("16  min 0 max 65535", integer(16)),
            ("16A", Some(Shown::Hexadecimal)),
            ("16mA", integer(16)),
            ("24,061", None),
            ("1,234 5", None),
            ("1.234.567", None),
            ("C000027F", Some(Shown::Hexadecimal)),
            ("C000027F (3221226111)", integer(3_221_226_111)),
            ("C000027F rw 4", None),
            ("FA 00 00 00", Some(Shown::Hexadecimal)),
            ("00 00 00 00", Some(Shown::Hexadecimal)),
            ("FA 00", None),
            ("10 16", None),
            ("ADD", None),
            ("3-wire", None),
        ] {
            assert_eq!(shown(rest, DataType::Unsigned32, &[], Some("ms")), expected, "{rest:?}");
        }
        let real = |rest: &str, unit| shown(rest, DataType::Real32, &[], unit);
        let number = |number: f32| Some(Shown::Value(Value::Real32(number)));
        for (rest, unit, expected) in [
            ("24.1V", Some("V"), number(24.1)),
            ("24061mV", Some("V"), None),
            ("24061 mV", Some("V"), None),
            ("24.1C", Some("°C"), number(24.1)),
            ("24C", Some("°C"), None),
            ("75.2F", Some("°C"), None),
            ("-200 C", Some("0.1 °C"), None),
            ("$41800000", None, number(16.0)),
            ("02h", None, None),
            ("40490E10", None, Some(Shown::Hexadecimal)),
            ("1.919800E+02", None, number(191.98)),
            ("1,919800E+02", None, None),
            ("1,000.00", None, None),
            ("41E80000", None, Some(Shown::Hexadecimal)),
        ] {
            assert_eq!(real(rest, unit), expected, "{rest:?}");
        }
    }

    #[test]
    fn what_says_the_value_is_told_with_it() {
        let read = |rest: &str| {
            let expected = Expected { data_type: DataType::Unsigned16, names: &["TC1"], unit: None };
            value(rest, &expected).map(|reading| (reading.numeral, reading.plain))
        };
        for (rest, numeral, plain) in [
            ("TC1 = 250", "250", true),
            ("value: 250ms", "250", true),
            ("0xFA", "0xFA", false),
            ("$FA", "$FA", false),
            ("250 (0xFA)", "250", false),
            ("250 00FA", "250", false),
        ] {
            assert_eq!(read(rest), Some((numeral.to_owned(), plain)), "{rest:?}");
        }
    }

    proptest! {
        #[test]
        fn bytes_are_never_one_of_them(number: u32) {
            let bytes = number.to_le_bytes().map(|byte| format!("{byte:02X}")).join(" ");
            let read = shown(&format!("TC1 = {bytes}"), DataType::Unsigned32, &["TC1"], None);
            prop_assert!(!matches!(read, Some(Shown::Value(_))), "{:?}", read);
        }

        #[test]
        fn a_number_without_a_mark_is_read_as_decimal_or_not_at_all(number: u32) {
            let text = format!("{number:X}");
            let read = shown(&text, DataType::Unsigned32, &[], None);
            let decimal = text.parse().ok().map(|decimal| Shown::Value(Value::Unsigned32(decimal)));
            prop_assert!(read == decimal || (decimal.is_none() && !matches!(read, Some(Shown::Value(_)))), "{:?}", read);
        }
    }
}
