//! A stream that was on before we came, and how it is put back.

use std::ops::ControlFlow;

use crate::cli::error::CliError;
use crate::cli::output::Output;
use crate::cli::talk::Talk;
use crate::session::{Command, Event};
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;

/// How long a stream that runs already is listened for at first.
const LISTEN_FIRST: Duration = Duration::from_millis(1200);
/// How long the second row may take after the first: the units' own rate is one a second (errata E-105).
const LISTEN_ON: Duration = Duration::from_millis(1200);

/// The stream before we came.
#[derive(Clone, Copy, Debug)]
pub enum Before {
    /// Off.
    Off,
    /// On, and seen.
    Seen(Found),
    /// On, with rows so far apart that none was seen.
    Unseen,
}

/// What was seen of a stream.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// What its rows show.
    pub source: Source,
    /// Time between its rows, as far as two were seen.
    pub period: Option<Duration>,
}

impl Before {
    /// What was seen of it.
    pub fn seen(self) -> Option<Found> {
        match self {
            Before::Seen(found) => Some(found),
            Before::Off | Before::Unseen => None,
        }
    }

    /// The unit has shown that it was on.
    pub fn was_on(&mut self) {
        if matches!(self, Before::Off) {
            *self = Before::Unseen;
        }
    }
}

/// Looks for a stream that runs already.
///
/// # Errors
/// If the link is lost or the user interrupts.
pub fn watch(talk: &mut Talk) -> Result<Before, CliError> {
    let mut seen: Option<Rows> = None;
    let until = talk.now() + LISTEN_FIRST;
    listen(talk, until, &mut seen, u32::MAX)?;
    // One row does not show how far apart they are.
    if let Some(Rows { first, count: 1, .. }) = seen {
        listen(talk, first + LISTEN_ON, &mut seen, 2)?;
    }
    let Some(Rows { first, last, count, source }) = seen else { return Ok(Before::Off) };
    let period = (count > 1).then(|| last.since(first) / (count - 1));
    // Rows come at whole milliseconds; the clock that saw them is not that exact.
    let period = period.map(|period| Duration::from_millis(likely_millis(period)));
    Ok(Before::Seen(Found { source, period }))
}

/// The rows that were seen.
#[derive(Clone, Copy)]
struct Rows {
    first: Instant,
    last: Instant,
    count: u32,
    source: Source,
}

/// Listens for rows until then, or until there are enough.
fn listen(talk: &mut Talk, until: Instant, seen: &mut Option<Rows>, enough: u32) -> Result<(), CliError> {
    talk.hear(until, |_, event| {
        let Event::Row { at, row, .. } = event else { return Ok(ControlFlow::Continue(())) };
        let (first, before) = seen.map_or((*at, 0), |rows| (rows.first, rows.count));
        *seen = Some(Rows { first, last: *at, count: before + 1, source: row.source });
        Ok(if before + 1 >= enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })
}

/// The period that somebody has probably typed, by the one that was measured: the roundest number of milliseconds that
/// is no further off than 1 %, or 1 ms.
fn likely_millis(period: Duration) -> u64 {
    const STEPS: [u64; 6] = [1000, 500, 100, 50, 10, 5];
    let measured = period.as_secs_f64() * 1000.0;
    let mut round = STEPS.into_iter().map(|step| (measured / step as f64).round() as u64 * step);
    let is_close = |millis: &u64| *millis > 0 && (*millis as f64 - measured).abs() <= (measured / 100.0).max(1.0);
    round.find(is_close).unwrap_or((measured.round() as u64).max(1))
}

/// Puts the stream back to what it was.
///
/// # Errors
/// If the unit does not do as asked.
pub fn leave_as_found(talk: &mut Talk, before: Before, output: &mut Output) -> Result<(), CliError> {
    let command = match before {
        Before::Off => Command::StreamOff,
        Before::Seen(Found { source, period: Some(period) }) => Command::StreamOn { source, period },
        Before::Seen(Found { period: None, .. }) | Before::Unseen => {
            output.remark("axcon: the stream was on before, at a rate too slow to be seen; it is left at the new one");
            return Ok(());
        }
    };
    let outcome = talk.ask(command)?;
    talk.expect_done(&outcome)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_that_was_measured_is_the_one_that_somebody_has_typed() {
        for (measured_us, millis) in [
            (703_000, 700),
            (198_400, 200),
            (1_003_000, 1_000),
            (59_600, 60),
            (473_000, 470),
            (1_040, 1),
            (10, 1),
            (251_000, 250),
        ] {
            assert_eq!(likely_millis(Duration::from_micros(measured_us)), millis, "{measured_us}");
        }
    }
}
