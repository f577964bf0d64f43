//! What kind of file this is, judged by its beginning and never by its name.

use super::lines;

/// What a file is.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Nature {
    /// S-records, after a byte order mark of this length.
    SRecord { mark: usize },
    /// Intel HEX, after a byte order mark of this length.
    IntelHex { mark: usize },
    /// Nothing, or nothing but blanks.
    Empty,
    /// Something else, with its name.
    Other(&'static str),
}

/// The first line that looks like a record decides, so a line of junk in front is one defect and not a thousand.
pub(super) fn recognise(head: &[u8]) -> Nature {
    for (magic, what) in MAGICS {
        if head.starts_with(magic) {
            return Nature::Other(what);
        }
    }
    let text = head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head);
    let mark = head.len() - text.len();
    for line in text.split(|&byte| byte == b'\r' || byte == b'\n') {
        match line {
            [b'S' | b's', digit, ..] if digit.is_ascii_digit() => return Nature::SRecord { mark },
            [b':', high, low, ..] if high.is_ascii_hexdigit() && low.is_ascii_hexdigit() => {
                return Nature::IntelHex { mark };
            }
            _ => {}
        }
    }
    match text.trim_ascii_start() {
        [] if head.len() < lines::HEAD => Nature::Empty,
        [b'<', ..] => Nature::Other("an HTML or XML page"),
        text if text.iter().any(|byte| matches!(byte, 0..=8 | 14..=25 | 27..=31)) => Nature::Other("binary data"),
        _ => Nature::Other("a text without any record"),
    }
}

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

const MAGICS: [(&[u8], &str); 8] = [
    (b"\x7FELF", "an ELF file (the linker's output before its conversion)"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1F\x8B", "a gzip archive"),
    (b"7z\xBC\xAF", "a 7-Zip archive"),
    (b"MZ", "a Windows program"),
    (b"%PDF", "a PDF document"),
    (b"\xFF\xFE", "UTF-16 text"),
    (b"\xFE\xFF", "UTF-16 text"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_record_decides_what_a_file_is() {
        let table: [(&[u8], Nature); 12] = [
            (b"S0030000FC\r", Nature::SRecord { mark: 0 }),
            (b"\xEF\xBB\xBFs1", Nature::SRecord { mark: 3 }),
            (b"\n\n:00000001FF\n", Nature::IntelHex { mark: 0 }),
            (b"\xEF\xBB\xBF:020000040000FA", Nature::IntelHex { mark: 3 }),
            (b"junk\n:00000001FF\nS9030000FC", Nature::IntelHex { mark: 0 }),
            (b"junk\nS9030000FC\n:00000001FF", Nature::SRecord { mark: 0 }),
            (b": a remark\n", Nature::Other("a text without any record")),
            (b" \r\n", Nature::Empty),
            (&[b' '; lines::HEAD], Nature::Other("a text without any record")),
            (b"ab\x00\x01cd\n", Nature::Other("binary data")),
            (b"a\ttable\x1A\n", Nature::Other("a text without any record")),
            (b"\x1F\x8BS0", Nature::Other("a gzip archive")),
        ];
        for (head, nature) in table {
            assert_eq!(recognise(head), nature, "{}", head.escape_ascii());
        }
    }
}
