//! Numbers of things, as people read them.

/// A number with its thousands apart: `242,846`.
pub fn grouped(number: impl TryInto<u64>) -> String {
    let digits = number.try_into().unwrap_or(u64::MAX).to_string();
    let mut grouped = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// What this many things are called, given what one is called: `byte` or `bytes`, `entry` or `entries`.
pub fn noun(number: impl TryInto<u64>, one: &str) -> String {
    let number = number.try_into().unwrap_or(u64::MAX);
    match one.strip_suffix('y') {
        _ if number == 1 => one.to_owned(),
        Some(stem) => format!("{stem}ies"),
        None => format!("{one}s"),
    }
}

/// `1 row`, `1,200 rows`, `2 entries`.
pub fn counted(number: impl TryInto<u64>, one: &str) -> String {
    let number = number.try_into().unwrap_or(u64::MAX);
    format!("{} {}", grouped(number), noun(number, one))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        assert_eq!([0, 999, 1000, 242_846, 1_234_567].map(grouped), ["0", "999", "1,000", "242,846", "1,234,567"]);
    }

    #[test]
    fn one_is_one_and_all_other_numbers_are_many() {
        assert_eq!([0, 1, 1200].map(|number| counted(number, "row")), ["0 rows", "1 row", "1,200 rows"]);
        assert_eq!([0, 1, 2].map(|number| counted(number, "entry")), ["0 entries", "1 entry", "2 entries"]);
        assert_eq!([1, 2].map(|number| noun(number, "more range")), ["more range", "more ranges"]);
    }
}
