//! Rows of the stream: what is read is a row of finite numbers that is written and read again the same, and what a unit
//! writes is read.
#![no_main]

use axcon::device::Product;
use axcon::wire::stream::{Layout, Reading, Row, Source};
use axcon_fuzz::parameter;
use libfuzzer_sys::fuzz_target;

/// Equal, as far as this many decimal places and a number's precision go.
fn alike(one: &Row, other: &Row) -> bool {
    (one.source, one.decimals) == (other.source, other.decimals)
        && one.readings.len() == other.readings.len()
        && one.readings.iter().zip(&other.readings).all(|(&one, &other)| match (one, other) {
            (Reading::Value(one), Reading::Value(other)) => (one - other).abs() <= one.abs() * 1e-12 + 1e-9,
            (one, other) => one == other,
        })
}

fn check(layout: &Layout, row: &Row) {
    let written = layout.emit(row);
    let again = layout.parse(&written).unwrap_or_else(|| panic!("{row:?}\n{written:?}"));
    assert!(alike(row, &again), "{row:?}\n{written:?}\n{again:?}");
    assert_eq!(layout.parse(written.trim_end()).as_ref(), Some(&again), "without its last blanks");
    let csv = row.csv("now");
    assert_eq!(csv.split(',').count(), Row::csv_heading(&layout.channels).split(',').count(), "{csv}");
    assert!(csv.ends_with('\n') && csv.lines().count() == 1);
}

/// A row as a unit may send it, from bytes: three make a number within the field's digits, or say why there is none.
fn made(layout: &Layout, source: Source, bytes: &[u8]) -> Row {
    let format = layout.format(source);
    let scale = 10f64.powi(format.decimals as i32);
    let readings = layout.channels.iter().enumerate().map(|(channel, _)| {
        let at = |part: usize| bytes.get(channel * 3 + part).copied().unwrap_or_default();
        match at(0) % 8 {
            0 => Reading::Disabled,
            1 => Reading::Open,
            2 if format.short.is_some() => Reading::Short,
            3 if format.error.is_some() => Reading::Error,
            _ => Reading::Value(f64::from(i32::from_be_bytes([at(0), at(1), at(2), 0]) >> 8) / scale),
        }
    });
    Row { readings: readings.collect(), ..layout.row(source) }
}

fuzz_target!(|input: &[u8]| {
    let Some((choice, bytes)) = parameter(input) else { return };
    let layout = &Product::all()[usize::from(choice & 1)].stream;
    let source = if choice & 2 == 0 { Source::FieldValue } else { Source::ProcessValue };
    if choice & 4 == 0 {
        let line = String::from_utf8_lossy(bytes);
        if let Some(row) = layout.parse(&line) {
            assert_eq!(row.readings.len(), layout.channels.len());
            assert!(row.readings.iter().all(|reading| reading.value().is_none_or(f64::is_finite)), "{row:?}");
            check(layout, &row);
        }
    } else {
        let row = made(layout, source, bytes);
        // A process value with few digits may be a field value as well; then the columns' width tells, if it can.
        let written = layout.emit(&row);
        if layout.parse(&written).is_some_and(|read| read.source == source) {
            check(layout, &row);
        } else {
            assert!(source == Source::ProcessValue, "{written:?}");
        }
    }
});
