//! A file's lines, whatever its line ends, in bounded memory.
//!
//! A line end is CR, LF or CR LF. Of a line longer than any record only the beginning is handed out, and the rest is
//! skipped without being kept, so a file that is one endless line costs no more memory than another.

use std::io::{self, Read};

/// How a line ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LineEnd {
    /// Carriage return alone.
    Cr,
    /// Line feed alone.
    Lf,
    /// Carriage return, line feed.
    CrLf,
    /// The file ended.
    None,
}

impl LineEnd {
    /// The usual name.
    pub const fn name(self) -> &'static str {
        match self {
            LineEnd::Cr => "CR",
            LineEnd::Lf => "LF",
            LineEnd::CrLf => "CR LF",
            LineEnd::None => "no",
        }
    }

    /// What is in the file.
    pub const fn text(self) -> &'static [u8] {
        match self {
            LineEnd::Cr => b"\r",
            LineEnd::Lf => b"\n",
            LineEnd::CrLf => b"\r\n",
            LineEnd::None => b"",
        }
    }

    const fn characters(self) -> usize {
        match self {
            LineEnd::Cr | LineEnd::Lf => 1,
            LineEnd::CrLf => 2,
            LineEnd::None => 0,
        }
    }
}

/// One line, without its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RawLine<'a> {
    /// Its characters; at most [`LONGEST`].
    pub text: &'a [u8],
    /// Whether there was more.
    pub cut: bool,
    /// What ends it.
    pub end: LineEnd,
}

/// Reads lines.
pub(super) struct Lines<R> {
    reader: R,
    buffer: Box<[u8]>,
    /// What is read and not handed out lies in `buffer[from..to]`.
    from: usize,
    to: usize,
    at_end: bool,
    bytes: u64,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(reader: R) -> Self {
        Lines::with_buffer(reader, BUFFER)
    }

    /// Tests choose a small buffer, so that its borders come everywhere in a line.
    pub(super) fn with_buffer(reader: R, size: usize) -> Self {
        assert!(size >= SMALLEST_BUFFER, "the beginning of the file and one line have to fit");
        Lines { reader, buffer: vec![0; size].into(), from: 0, to: 0, at_end: false, bytes: 0 }
    }

    /// The first [`HEAD`] bytes of what is left, fewer at the end.
    pub(super) fn head(&mut self) -> io::Result<&[u8]> {
        if self.to - self.from < HEAD {
            self.refill(0)?;
        }
        Ok(&self.buffer[self.from..self.to.min(self.from + HEAD)])
    }

    /// Passes over bytes that [`Lines::head`] has shown.
    pub(super) fn skip(&mut self, bytes: usize) {
        self.from = (self.from + bytes).min(self.to);
    }

    /// Bytes taken from the reader.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The next line, `None` at the end of the file.
    pub(super) fn next(&mut self) -> io::Result<Option<RawLine<'_>>> {
        let mut searched = 0;
        loop {
            let found = line_end(&self.buffer[self.from + searched..self.to]);
            let Some(length) = found.map(|at| searched + at) else {
                searched = self.to - self.from;
                if self.at_end {
                    return Ok((searched > 0).then(|| self.take(searched, LineEnd::None)));
                }
                if searched > LONGEST {
                    return self.cut().map(Some);
                }
                self.refill(0)?;
                continue;
            };
            let Some(end) = self.end_at(self.from + length) else {
                // Only if the line fits does the buffer have room for what follows its CR.
                if length > LONGEST {
                    return self.cut().map(Some);
                }
                searched = length;
                self.refill(0)?;
                continue;
            };
            return Ok(Some(self.take(length, end)));
        }
    }

    /// Hands out `length` bytes and moves past their line end.
    fn take(&mut self, length: usize, end: LineEnd) -> RawLine<'_> {
        let start = self.from;
        self.from += length + end.characters();
        RawLine { text: &self.buffer[start..start + length.min(LONGEST)], cut: length > LONGEST, end }
    }

    /// What kind of line end begins here; unknown while it cannot be seen whether LF follows CR.
    fn end_at(&self, at: usize) -> Option<LineEnd> {
        match (self.buffer[at], self.buffer[at + 1..self.to].first()) {
            (b'\n', _) => Some(LineEnd::Lf),
            (_, Some(b'\n')) => Some(LineEnd::CrLf),
            (_, Some(_)) => Some(LineEnd::Cr),
            (_, None) => self.at_end.then_some(LineEnd::Cr),
        }
    }

    /// Keeps the beginning of a line that is too long and passes over the rest of it.
    #[cold]
    fn cut(&mut self) -> io::Result<RawLine<'_>> {
        self.buffer.copy_within(self.from..self.from + LONGEST, 0);
        self.from += LONGEST;
        let end = loop {
            let end = match line_end(&self.buffer[self.from..self.to]) {
                Some(at) => {
                    self.from += at;
                    self.end_at(self.from)
                }
                None => {
                    self.from = self.to;
                    self.at_end.then_some(LineEnd::None)
                }
            };
            match end {
                Some(end) => break end,
                None => self.refill(LONGEST)?,
            }
        };
        self.take(0, end);
        Ok(RawLine { text: &self.buffer[..LONGEST], cut: true, end })
    }

    /// Moves what is left to `to_offset` and fills the buffer after it, completely unless the file ends: what a
    /// report says must not depend on the pieces a reader gives.
    fn refill(&mut self, to_offset: usize) -> io::Result<()> {
        self.buffer.copy_within(self.from..self.to, to_offset);
        self.to = to_offset + (self.to - self.from);
        self.from = to_offset;
        while self.to < self.buffer.len() && !self.at_end {
            match self.reader.read(&mut self.buffer[self.to..]) {
                Ok(0) => self.at_end = true,
                Ok(read) => {
                    self.to += read;
                    self.bytes += read as u64;
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Where the first line end begins.
fn line_end(bytes: &[u8]) -> Option<usize> {
    memchr::memchr2(b'\r', b'\n', bytes)
}

/// The longest line that is handed out whole; the longest record has 514 characters.
pub(super) const LONGEST: usize = 1024;
/// Bytes at the beginning of a file that show what it is.
pub(super) const HEAD: usize = 4096;
/// Fits the second-level cache with room to spare; larger ones are not faster.
const BUFFER: usize = 128 * 1024;
/// The head, or one line and a line end across a border.
pub(super) const SMALLEST_BUFFER: usize = HEAD;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn all(bytes: &[u8], buffer: usize) -> Vec<(Vec<u8>, bool, LineEnd)> {
        let mut lines = Lines::with_buffer(bytes, buffer);
        let mut all = Vec::new();
        while let Ok(Some(line)) = lines.next() {
            all.push((line.text.to_vec(), line.cut, line.end));
        }
        all
    }

    #[test]
    fn every_kind_of_line_end_is_told() {
        let line = |text: &str, end| (text.as_bytes().to_vec(), false, end);
        assert_eq!(
            all(b"a\rb\nc\r\n\r\r\nd", HEAD),
            [
                line("a", LineEnd::Cr),
                line("b", LineEnd::Lf),
                line("c", LineEnd::CrLf),
                line("", LineEnd::Cr),
                line("", LineEnd::CrLf),
                line("d", LineEnd::None),
            ]
        );
        assert_eq!(all(b"", HEAD), []);
        assert_eq!(all(b"\r", HEAD), [line("", LineEnd::Cr)]);
    }

    #[test]
    fn a_line_end_on_the_border_of_the_buffer_is_one_line_end() {
        for length in HEAD - 4..HEAD + 4 {
            for (end, kind) in [("\r", LineEnd::Cr), ("\n", LineEnd::Lf), ("\r\n", LineEnd::CrLf)] {
                let mut bytes = vec![b'x'; length];
                bytes.extend(end.bytes());
                bytes.push(b'y');
                let lines = all(&bytes, HEAD);
                assert_eq!(lines.len(), 2, "{length} {kind:?}");
                assert_eq!((lines[0].0.len(), lines[0].1, lines[0].2), (LONGEST, true, kind), "{length}");
                assert_eq!(lines[1], (b"y".to_vec(), false, LineEnd::None), "{length} {kind:?}");
            }
        }
    }

    #[test]
    fn a_line_of_any_length_may_end_on_the_border_of_the_buffer() {
        for length in [1, LONGEST - 1, LONGEST, LONGEST + 1] {
            for end in ["\r", "\n", "\r\n"] {
                for border in HEAD - 2..HEAD + 2 {
                    let mut bytes = vec![b'a'; border - length - 1];
                    bytes.push(b'\n');
                    bytes.extend(std::iter::repeat_n(b'x', length));
                    bytes.extend(end.bytes());
                    bytes.extend(b"y\n");
                    assert_eq!(all(&bytes, HEAD), plain(&bytes), "{length} {end:?} {border}");
                }
            }
        }
    }

    /// Is interrupted before each byte, and fails after the last.
    struct Interrupted(Vec<u8>, bool);

    impl Read for Interrupted {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.1 = !self.1;
            match (self.1, self.0.pop()) {
                (true, byte) => {
                    self.0.extend(byte);
                    Err(io::ErrorKind::Interrupted.into())
                }
                (false, None) => Err(io::ErrorKind::UnexpectedEof.into()),
                (false, Some(byte)) => {
                    buffer[0] = byte;
                    Ok(1)
                }
            }
        }
    }

    #[test]
    fn a_reader_that_is_interrupted_is_asked_again_and_one_that_fails_is_not() {
        let mut lines = Lines::with_buffer(Interrupted(vec![b'x'; HEAD], false), HEAD);
        assert_eq!(lines.head().map(<[u8]>::len).ok(), Some(HEAD));
        assert_eq!(lines.next().map_err(|error| error.kind()), Err(io::ErrorKind::UnexpectedEof));
    }

    /// The same rules, written down without any regard to memory.
    fn plain(bytes: &[u8]) -> Vec<(Vec<u8>, bool, LineEnd)> {
        let mut all = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let length = rest.iter().position(|&byte| byte == b'\r' || byte == b'\n').unwrap_or(rest.len());
            let (end, skipped) = match &rest[length..] {
                [b'\r', b'\n', ..] => (LineEnd::CrLf, 2),
                [b'\r', ..] => (LineEnd::Cr, 1),
                [b'\n', ..] => (LineEnd::Lf, 1),
                _ => (LineEnd::None, 0),
            };
            all.push((rest[..length.min(LONGEST)].to_vec(), length > LONGEST, end));
            rest = &rest[length + skipped..];
        }
        all
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_buffer_size_changes_a_line(
            pieces in prop::collection::vec((0usize..3000, 0usize..4), 0..12),
            buffer in HEAD..HEAD + 300,
        ) {
            let mut bytes = Vec::new();
            for (length, end) in pieces {
                bytes.extend((0..length).map(|at| b'a' + (at % 26) as u8));
                bytes.extend([&b"\r"[..], b"\n", b"\r\n", b""][end]);
            }
            prop_assert_eq!(all(&bytes, buffer), plain(&bytes));
        }
    }
}
