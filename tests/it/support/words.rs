//! What a unit says, as a transcript has it, and what several stories ask and measure.

use axcon::session::Command;
use axcon::time::Duration;
use axcon::wire::stream::Source;

/// A row of field values.
pub const ROW: &str = "  23.500;  24.125;Disabled;OpenCct ; -12.750\r\n";
/// A menu that names its unit.
pub const MENU: &str = "AXTC4CO V1.1.0\r\nV - View Object Dictionary\r\nD - Default Object Dictionary\r\n\
                        T - Toggle Stream\r\nS - Diagnostics\r\nL - Load New Software\r\n";

/// The stream is wanted on.
pub fn on() -> Command {
    Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(200) }
}

/// Whole milliseconds.
pub fn millis(span: Duration) -> u64 {
    u64::try_from(span.as_nanos() / 1_000_000).expect("a short story")
}
