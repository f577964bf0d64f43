//! Hexadecimal digits of both formats, by table: the marks of a whole line are collected by OR, so reading has no branch.

/// Value and marks of a character.
pub(super) const fn digit(character: u8) -> u8 {
    VALUES[character as usize]
}

/// The byte that two digits spell, whatever their marks.
pub(super) const fn byte(high: u8, low: u8) -> u8 {
    (high << 4) | (low & VALUE)
}

/// Where in a text, from 0, the first character is that is not a digit.
#[cold]
pub(super) fn first_bad(text: &[u8]) -> Option<(usize, u8)> {
    text.iter().copied().enumerate().find(|&(_, character)| digit(character) & INVALID != 0)
}

/// Appends a byte as two upper-case digits.
pub(super) fn put(text: &mut Vec<u8>, byte: u8) {
    text.extend([DIGITS[usize::from(byte >> 4)], DIGITS[usize::from(byte & VALUE)]]);
}

const DIGITS: &[u8; 16] = b"0123456789ABCDEF";

/// The value's bits in what [`digit`] gives.
const VALUE: u8 = 0x0F;
/// Marks a lower-case digit.
pub(super) const LOWER: u8 = 0x10;
/// Marks what is not a digit.
pub(super) const INVALID: u8 = 0x80;

const VALUES: [u8; 256] = {
    let mut values = [INVALID; 256];
    let mut value = 0;
    while value < 16 {
        let digit = DIGITS[value as usize];
        values[digit.to_ascii_lowercase() as usize] = value | LOWER;
        values[digit as usize] = value;
        value += 1;
    }
    values
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_is_written_and_read_back() {
        for value in 0..=255 {
            let mut text = Vec::new();
            put(&mut text, value);
            assert_eq!(byte(digit(text[0]), digit(text[1])), value);
            assert_eq!(text, format!("{value:02X}").into_bytes());
        }
        assert_eq!(first_bad(b"0aF_9"), Some((3, b'_')));
        assert_eq!(first_bad(b"0aF9"), None);
    }
}
