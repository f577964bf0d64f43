//! A line as words: what recognition goes by, whatever is between them.

/// The words of a line, in lower case: letters, digits, and the points within numbers.
#[derive(Debug)]
pub(super) struct Words {
    words: Vec<String>,
}

impl Words {
    /// Splits a line.
    pub(super) fn of(line: &str) -> Self {
        let mut words = Vec::new();
        for piece in line.split(|c: char| !(c.is_alphanumeric() || c == '.')) {
            let word = piece.trim_matches('.');
            if !word.is_empty() {
                words.push(word.to_lowercase());
            }
        }
        Words { words }
    }

    /// Splits a line after joining words whose key letter is bracketed: `(F)ield` is `field`.
    pub(super) fn joined(line: &str) -> Self {
        let plain: String = line.chars().filter(|c| !"()[]<>{}".contains(*c)).collect();
        Words::of(&plain)
    }

    /// The words in their order.
    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &str> + Clone {
        self.words.iter().map(String::as_str)
    }

    /// The word at a position.
    pub(super) fn get(&self, position: usize) -> Option<&str> {
        self.words.get(position).map(String::as_str)
    }

    /// Position of the first word that begins with `beginning`.
    pub(super) fn position(&self, beginning: &str) -> Option<usize> {
        self.iter().position(|word| word.starts_with(beginning))
    }

    /// Whether some word begins with one of these.
    pub(super) fn has_any(&self, beginnings: &[&str]) -> bool {
        beginnings.iter().any(|beginning| self.position(beginning).is_some())
    }

    /// Whether for each of these some word begins with it.
    pub(super) fn has_all(&self, beginnings: &[&str]) -> bool {
        beginnings.iter().all(|beginning| self.position(beginning).is_some())
    }
}

/// A whole number as units write them: `127`, `0x7F`, `7Fh`.
pub(super) fn number(word: &str) -> Option<u64> {
    if let Some(digits) = word.strip_prefix("0x") {
        return u64::from_str_radix(digits, 16).ok();
    }
    if let Some(digits) = word.strip_suffix('h') {
        return u64::from_str_radix(digits, 16).ok();
    }
    word.bytes().all(|byte| byte.is_ascii_digit()).then(|| word.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_do_not_matter_and_points_stay_in_numbers() {
        let words = Words::of("  Node-ID: 127 (0x7F)...  [V1.2.3].");
        assert_eq!(words.iter().collect::<Vec<_>>(), ["node", "id", "127", "0x7f", "v1.2.3"]);
    }

    #[test]
    fn numbers_are_read_in_every_usual_spelling() {
        assert_eq!(
            [number("127"), number("0x7f"), number("7fh"), number("7f"), number("")],
            [Some(127), Some(127), Some(127), None, None]
        );
    }
}
