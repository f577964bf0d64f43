//! Numbers of things, as people read them.

/// `1 error`, `2,000 errors`.
pub fn counted(number: u64, what: &str) -> String {
    format!("{} {what}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// What there is of several kinds, `2 errors, 1 warning`; `None` if there is nothing.
pub fn counted_all(kinds: &[(u64, &str)]) -> Option<String> {
    let there = kinds.iter().filter(|(number, _)| *number > 0);
    let list: Vec<String> = there.map(|&(number, what)| counted(number, what)).collect();
    (!list.is_empty()).then(|| list.join(", "))
}

/// A number with its thousands apart.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        let table = [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")];
        for (number, text) in table {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn one_is_one_and_what_is_not_there_is_not_said() {
        assert_eq!([0, 1, 1000].map(|number| counted(number, "record")), ["0 records", "1 record", "1,000 records"]);
        assert_eq!(counted_all(&[(0, "error"), (0, "warning")]), None);
        assert_eq!(counted_all(&[(2, "error"), (0, "note"), (1, "warning")]).as_deref(), Some("2 errors, 1 warning"));
    }
}
