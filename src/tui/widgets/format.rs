//! Numbers, times and names as a person reads them.

use jiff::Timestamp;
use ratatui::text::Span;

pub use crate::count::{counted, grouped};
use crate::time::{Duration, Instant};

/// A number with this many digits after its point; `-` for none.
pub fn decimal(number: Option<f64>, decimals: usize) -> String {
    number.map_or_else(|| "-".to_owned(), |number| format!("{number:.decimals$}"))
}

/// `0:21`, `12:05`, `1:00:00`.
pub fn minutes(duration: Duration) -> String {
    let seconds = duration.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

/// `200 ms`, `1.5 s`, `60 s`.
pub fn period(duration: Duration) -> String {
    // Measured from when rows came: the last digits are the line's and the adapter's.
    let rounded = |step: u128| (duration.as_millis() + step / 2) / step * step;
    let millis = match duration.as_millis() {
        0..100 => rounded(1),
        100..995 => rounded(10),
        _ => rounded(100),
    };
    match millis {
        0..1000 => format!("{millis} ms"),
        _ if millis.is_multiple_of(1000) => format!("{} s", millis / 1000),
        _ => format!("{}.{} s", millis / 1000, millis % 1000 / 100),
    }
}

/// What was heard less long ago is as good as what is heard now ...
const FRESH: Duration = Duration::from_secs(10);
/// ... and what is older than a minute, or an hour, is given in whole ones.
const COARSER: [Duration; 2] = [Duration::from_secs(60), Duration::from_secs(3600)];

/// How long ago something was, `40 s ago`; nothing for what has just been.
pub fn ago(then: Instant, now: Instant) -> Option<String> {
    let age = now.since(then);
    let [minute, hour] = COARSER;
    match age {
        age if age < FRESH => None,
        age if age < minute => Some(format!("{} s ago", age.as_secs() / 10 * 10)),
        age if age < hour => Some(format!("{} min ago", age.as_secs() / 60)),
        age => Some(format!("{} h ago", age.as_secs() / 3600)),
    }
}

/// When [`ago`] says something else than it does now.
pub fn ages_at(then: Instant, now: Instant) -> Instant {
    let age = now.since(then);
    let [minute, hour] = COARSER;
    let step = match age {
        age if age < minute => FRESH,
        age if age < hour => minute,
        _ => hour,
    };
    then + Duration::from_secs((age.as_secs() / step.as_secs() + 1) * step.as_secs())
}

/// The time of day, `start` being that of [`Instant::ZERO`].
pub fn time_of_day(start: Duration, at: Instant) -> String {
    let seconds = (start + at.since_start()).as_secs() % 86_400;
    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

/// The same with milliseconds.
pub fn time_of_day_millis(start: Duration, at: Instant) -> String {
    format!("{}.{:03}", time_of_day(start, at), (start + at.since_start()).subsec_millis())
}

/// Date and time in UTC as data is written, `2026-01-31T12:00:00.123Z`; `start_millis` is the start of time since 1970.
pub fn utc(start_millis: i64, at: Instant) -> String {
    let moment = Timestamp::from_millisecond(start_millis).and_then(|start| start.checked_add(at.since_start()));
    moment.unwrap_or(Timestamp::UNIX_EPOCH).strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
}

/// Columns a text takes.
pub fn width(text: &str) -> usize {
    Span::raw(text).width()
}

/// The end of a name, for paths: what tells two of them apart is there. At most `columns` wide.
pub fn keep_end(text: &str, columns: usize) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let mut kept: Vec<char> = Vec::new();
    let mut used = 1;
    for character in text.chars().rev() {
        used += width(character.encode_utf8(&mut [0; 4]));
        if used > columns {
            break;
        }
        kept.push(character);
    }
    if columns == 0 { String::new() } else { std::iter::once('…').chain(kept.into_iter().rev()).collect() }
}

/// The beginning of a text, at most `columns` wide, `…` after it if something is missing.
pub fn keep_start(text: &str, columns: usize) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let mut kept = String::new();
    let mut used = 1;
    for character in text.chars() {
        used += width(character.encode_utf8(&mut [0; 4]));
        if used > columns {
            break;
        }
        kept.push(character);
    }
    if columns > 0 {
        kept.push('…');
    }
    kept
}

/// A name of two parts, `Low Temperature Warning Threshold, TC3`: at most `columns` wide, cut in its first part, because
/// the last one tells which of several of the same name it is.
pub fn keep_ends(text: &str, columns: usize) -> String {
    let last = text.rfind(", ").unwrap_or(text.len());
    let (first, last) = text.split_at(last);
    match columns.checked_sub(width(last)).filter(|_| width(text) > columns) {
        Some(room) if room > 0 => keep_start(first, room) + last,
        _ => keep_start(text, columns),
    }
}

/// Pads on the right to `columns`, shortening what is too long.
pub fn left(text: &str, columns: usize) -> String {
    let text = keep_start(text, columns);
    let missing = columns.saturating_sub(width(&text));
    text + &" ".repeat(missing)
}

/// Breaks a text wherever its columns are full; what it says is not for reading on, but as it came.
pub fn pieces(text: &str, columns: usize) -> Vec<String> {
    let mut pieces = vec![String::new()];
    let mut used = 0;
    for character in text.chars() {
        let needed = width(character.encode_utf8(&mut [0; 4]));
        if used + needed > columns.max(1) {
            pieces.push(String::new());
            used = 0;
        }
        used += needed;
        if let Some(piece) = pieces.last_mut() {
            piece.push(character);
        }
    }
    pieces
}

/// Breaks a text between words into lines of at most `columns`; a longer word is broken where it must be.
pub fn wrap(text: &str, columns: usize) -> Vec<String> {
    let columns = columns.max(1);
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let needed = if line.is_empty() { width(word) } else { width(&line) + 1 + width(word) };
        if needed > columns && !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        if !line.is_empty() {
            line.push(' ');
        }
        for character in word.chars() {
            if width(&line) + width(character.encode_utf8(&mut [0; 4])) > columns && !line.is_empty() {
                lines.push(std::mem::take(&mut line));
            }
            line.push(character);
        }
    }
    if !line.is_empty() || lines.is_empty() {
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_are_wanted_of_it() {
        assert_eq!([decimal(Some(23.456), 1), decimal(Some(23.5), 0), decimal(None, 3)], ["23.5", "24", "-"]);
    }

    #[test]
    fn times_read_as_people_say_them() {
        assert_eq!([21, 725, 3600].map(|s| minutes(Duration::from_secs(s))), ["0:21", "12:05", "1:00:00"]);
        assert_eq!(
            [3, 203, 999, 1000, 1500, 60_000].map(|ms| period(Duration::from_millis(ms))),
            ["3 ms", "200 ms", "1 s", "1 s", "1.5 s", "60 s"]
        );
        let late = Duration::from_secs(86_399);
        assert_eq!(time_of_day_millis(late, Instant::from_millis(1_250)), "00:00:00.250");
    }

    #[test]
    fn an_age_is_told_in_what_people_count_in_and_changes_when_it_says_so() {
        let then = Instant::from_millis(500);
        let after = |seconds: u64| then + Duration::from_secs(seconds);
        let said: Vec<_> = [9, 10, 47, 60, 119, 3599, 7300].map(|age| ago(then, after(age))).into_iter().collect();
        let expected = [
            None,
            Some("10 s ago"),
            Some("40 s ago"),
            Some("1 min ago"),
            Some("1 min ago"),
            Some("59 min ago"),
            Some("2 h ago"),
        ];
        assert_eq!(said, expected.map(|text| text.map(str::to_owned)));
        let mut now = then;
        for _ in 0..200 {
            let next = ages_at(then, now);
            let before = Instant::from_nanos(next.as_nanos() - 1);
            assert!(next > now && ago(then, before) == ago(then, now), "{now:?}");
            assert_ne!(ago(then, next), ago(then, now), "{now:?}");
            now = next;
        }
    }

    #[test]
    fn what_is_cut_says_so() {
        assert_eq!(keep_end("/dev/serial/by-id/usb-FTDI", 10), "…/usb-FTDI");
        assert_eq!(keep_start("Performing First Start", 11), "Performing…");
        assert_eq!(keep_start("short", 5), "short");
        assert_eq!(keep_start("short", 0), "");
        assert_eq!(keep_ends("High Warning Threshold, TC3", 20), "High Warning T…, TC3");
        assert_eq!(["a, bcdefgh", "abcdefgh", "ab, c"].map(|name| keep_ends(name, 5)), ["a, b…", "abcd…", "ab, c"]);
        assert_eq!(keep_end("short", 0), "");
    }

    #[test]
    fn text_is_broken_between_words_and_long_words_where_they_must() {
        assert_eq!(wrap("one two three", 7), ["one two", "three"]);
        assert_eq!(wrap("abcdefgh", 3), ["abc", "def", "gh"]);
        assert_eq!(wrap("", 3), [""]);
    }
}
