//! The data stream as the screens show it: channels with their values, trends and faults.

use std::borrow::Cow;
use std::collections::VecDeque;

use super::stand_in::StandIn;
use super::trend::Trend;
use crate::device::Product;
use crate::time::{Duration, Instant};
use crate::wire::stream::{Reading, Row, Source};

/// Samples kept of each channel as they came; a [`Trend`] keeps the rest.
pub const KEPT_SAMPLES: usize = 3600;
/// Faults kept.
pub const KEPT_FAULTS: usize = 200;
/// Marks kept.
pub const KEPT_MARKS: usize = 100;

/// Times between rows that are remembered, to know the usual one.
const KEPT_GAPS: usize = 9;
/// A curve is interrupted where no row came for this many halves of a period ...
const GAP_HALF_PERIODS: u32 = 5;
/// ... but not before this time: rows of a fast stream come in bunches.
const GAP_AT_LEAST: Duration = Duration::from_millis(200);

/// A stream is late after this many of its periods without a row ...
const LATE_PERIODS: u32 = 3;
/// ... but not before this time: a busy unit may swallow a row or two.
const LATE_AT_LEAST: Duration = Duration::from_secs(2);

/// The data stream.
#[derive(Debug, Default)]
pub struct Stream {
    /// What the newest row carries.
    pub source: Option<Source>,
    /// Digits after the point of its numbers, as printed.
    pub decimals: usize,
    /// The channels, in the row's order.
    pub channels: Vec<Channel>,
    /// Rows since the channels began.
    pub rows: u64,
    /// When the newest row came.
    pub newest: Option<Instant>,
    /// The repetition time that was set, where it was set here.
    set: Option<Duration>,
    /// The newest times between rows, without those that stand for an interruption.
    gaps: VecDeque<Duration>,
    /// The last time between rows if it was unlike those before.
    odd: Option<Duration>,
    /// The next row does not go on from the newest one: the unit or the link was away in between.
    interrupted: bool,
    /// No row for longer than the stream's period explains.
    pub late: bool,
    /// When the stream was switched on last, where that was seen.
    on_since: Option<Instant>,
    /// Moments the user has marked, oldest first.
    pub marks: VecDeque<Mark>,
}

/// A moment that somebody wants to find again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Counted from 1 on each link.
    pub number: u64,
    /// Which moment.
    pub at: Instant,
}

/// One channel of the stream.
#[derive(Debug)]
pub struct Channel {
    /// Its name, `TC1`.
    pub name: String,
    /// The newest reading.
    pub reading: Reading,
    /// Some numbers of it may stand for a fault.
    has_stand_ins: bool,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Sum of the values since minimum and maximum began, and how many they were.
    sum: (f64, u64),
    /// The newest samples, oldest first.
    pub history: VecDeque<Sample>,
    /// All samples, in stretches.
    trend: Trend,
}

/// A reading and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When it came.
    pub at: Instant,
    /// What it was.
    pub reading: Reading,
    /// Nothing is known of the time before it: rows that should have come did not.
    pub after_gap: bool,
}

/// The faults seen since connecting.
#[derive(Debug, Default)]
pub struct Faults {
    /// Those that are kept, newest first: [`KEPT_FAULTS`] at most, and every one that lasts.
    kept: VecDeque<Fault>,
    /// All of them.
    pub seen: u64,
}

/// A wiring fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The channel's name.
    pub channel: String,
    /// Open or short circuit, or another reason why there is no value.
    pub kind: Reading,
    /// First row that showed it.
    pub since: Instant,
    /// First row that did not.
    pub until: Option<Instant>,
}

impl Stream {
    /// Takes in a row; faults that begin or end with it are noted in `faults`.
    pub(super) fn row(&mut self, at: Instant, row: &Row, product: Option<&Product>, faults: &mut Faults) {
        let names = channel_names(product, row.readings.len());
        let same = (self.source, self.decimals) == (Some(row.source), row.decimals)
            && self.channels.iter().map(|channel| &channel.name).eq(names.iter());
        if !same {
            let marks = std::mem::take(&mut self.marks);
            let (source, decimals) = (Some(row.source), row.decimals);
            *self = Stream { source, decimals, marks, set: self.set, ..Stream::default() };
            // No row will ever say that they are over.
            faults.end_all(at, |fault| !names.contains(&fault.channel));
            self.channels = names.iter().cloned().map(Channel::new).collect();
        }
        let interrupted = std::mem::take(&mut self.interrupted);
        let mut gap_since = None;
        if let Some(before) = self.newest {
            let gap = at.since(before);
            let longest = self.slowest().map(|period| (period * GAP_HALF_PERIODS / 2).max(GAP_AT_LEAST));
            gap_since = (interrupted || longest.is_some_and(|longest| gap > longest)).then_some(before);
            if !interrupted {
                self.take_gap(gap);
            }
        }
        self.newest = Some(at);
        self.rows += 1;
        self.late = false;
        let has_stand_ins = StandIn::are_in(row.source, product, &names);
        for (channel, &reading) in self.channels.iter_mut().zip(&row.readings) {
            channel.has_stand_ins = has_stand_ins;
            channel.read(at, reading, gap_since);
            // This shows neither a fault nor that one is over.
            if channel.stand_in().is_none() {
                faults.note(&channel.name, Some(reading).filter(|reading| reading.is_fault()), at);
            }
        }
    }

    /// Time between rows: what was set, where that is known, else what is usual.
    pub fn period(&self) -> Option<Duration> {
        self.set.or_else(|| self.median())
    }

    /// The time between rows that was set, where that is known.
    pub fn period_set(&self) -> Option<Duration> {
        self.set
    }

    /// A repetition time was set; `None` if it is not known any more which.
    pub fn set_period(&mut self, period: Option<Duration>) {
        if self.set != period {
            self.set = period;
            (self.gaps, self.odd) = (VecDeque::new(), None);
        }
    }

    /// The unit sends from now on, so that its first row is awaited from now on.
    pub fn switched_on(&mut self, at: Instant) {
        self.on_since = Some(at);
        self.late = false;
    }

    /// Whether all rows are from before the stream was switched on.
    pub fn awaits_first_row(&self) -> bool {
        self.on_since > self.newest
    }

    /// The unit or its link is away for a moment: no curve is drawn across it.
    pub fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// The time after which the next row is expected at the latest: a line may be too slow for what was set.
    fn slowest(&self) -> Option<Duration> {
        self.set.max(self.median())
    }

    fn median(&self) -> Option<Duration> {
        let mut gaps: Vec<Duration> = self.gaps.iter().copied().collect();
        gaps.sort_unstable();
        gaps.get(gaps.len() / 2).copied()
    }

    fn take_gap(&mut self, gap: Duration) {
        let unlike = |one: Duration, other: Duration| one > other * 2 || other > one * 2;
        if self.median().is_some_and(|usual| unlike(gap, usual)) {
            // A single unusual gap is an outage or a late row; a second one like it shows another setting.
            let Some(before) = self.odd.replace(gap).filter(|before| !unlike(*before, gap)) else { return };
            self.gaps.clear();
            self.gaps.push_back(before);
        }
        self.odd = None;
        self.gaps.push_back(gap);
        if self.gaps.len() > KEPT_GAPS {
            self.gaps.pop_front();
        }
    }

    /// When the newest row is too old.
    pub fn late_at(&self) -> Option<Instant> {
        let newest = self.newest.filter(|_| !self.late)?;
        let since = self.on_since.map_or(newest, |on| on.max(newest));
        Some(since + (self.slowest().unwrap_or_default() * LATE_PERIODS).max(LATE_AT_LEAST))
    }

    /// Marks a moment, which may be one of before.
    pub fn mark(&mut self, at: Instant) -> Mark {
        let number = self.marks.iter().map(|mark| mark.number).max().unwrap_or(0).saturating_add(1);
        let mark = Mark { number, at };
        self.set_mark(mark);
        mark
    }

    /// Takes over a mark that has its number already: one in a recording.
    pub fn set_mark(&mut self, mark: Mark) {
        let place = self.marks.partition_point(|known| known.at <= mark.at);
        self.marks.insert(place, mark);
        if self.marks.len() > KEPT_MARKS {
            self.marks.pop_front();
        }
    }

    /// Restarts minimum, maximum and mean of every channel.
    pub fn restart_extremes(&mut self) {
        for channel in &mut self.channels {
            let value = channel.reading.value().filter(|_| channel.stand_in().is_none());
            (channel.min, channel.max) = (value, value);
            channel.sum = value.map_or((0.0, 0), |value| (value, 1));
        }
    }

    /// The rows that are kept as they came, oldest first.
    pub fn kept_rows(&self) -> impl Iterator<Item = (Instant, Row)> {
        let count = self.channels.first().map_or(0, |channel| channel.history.len());
        (0..count).filter_map(|number| {
            let readings: Option<Vec<Reading>> =
                self.channels.iter().map(|channel| channel.history.get(number).map(|sample| sample.reading)).collect();
            let at = self.channels.first()?.history.get(number)?.at;
            Some((at, Row { source: self.source?, decimals: self.decimals, readings: readings? }))
        })
    }
}

impl Channel {
    fn new(name: String) -> Self {
        Channel {
            name,
            reading: Reading::Disabled,
            has_stand_ins: false,
            min: None,
            max: None,
            sum: (0.0, 0),
            history: VecDeque::new(),
            trend: Trend::default(),
        }
    }

    /// Takes in a reading; rows are missing since `gap_since`, if they are.
    fn read(&mut self, at: Instant, reading: Reading, gap_since: Option<Instant>) {
        let value = reading.value();
        self.reading = reading;
        // A number that may stand for a fault says nothing of what was measured.
        if let Some(value) = value.filter(|_| self.stand_in().is_none()) {
            self.min = Some(self.min.map_or(value, |min| min.min(value)));
            self.max = Some(self.max.map_or(value, |max| max.max(value)));
            self.sum = (self.sum.0 + value, self.sum.1 + 1);
        }
        if let Some(since) = gap_since {
            self.trend.push(since, None);
        }
        self.trend.push(at, value);
        self.history.push_back(Sample { at, reading, after_gap: gap_since.is_some() });
        if self.history.len() > KEPT_SAMPLES {
            self.history.pop_front();
        }
    }

    /// The state of the newest reading, in words for a person.
    pub fn words(&self) -> &'static str {
        self.words_of(self.reading)
    }

    /// The same of an earlier one.
    pub fn words_of(&self, reading: Reading) -> &'static str {
        self.stand_in_of(reading).map_or(reading.words(), StandIn::words)
    }

    /// What the newest reading may stand for besides a value.
    pub fn stand_in(&self) -> Option<StandIn> {
        self.stand_in_of(self.reading)
    }

    /// The same of an earlier one.
    pub fn stand_in_of(&self, reading: Reading) -> Option<StandIn> {
        StandIn::of(reading).filter(|_| self.has_stand_ins)
    }

    /// Mean of the values since minimum and maximum began.
    pub fn mean(&self) -> Option<f64> {
        (self.sum.1 > 0).then(|| self.sum.0 / self.sum.1 as f64)
    }

    /// The newest values, oldest first, `None` where there was none and where rows are missing.
    pub fn newest(&self, count: usize) -> impl Iterator<Item = (Instant, Option<f64>)> {
        self.history.range(self.history.len().saturating_sub(count)..).flat_map(Sample::points)
    }

    /// Samples between two moments, oldest first, `None` where there was no value: as they came if they are kept, else
    /// the extremes of stretches of time.
    pub fn samples(&self, from: Instant, to: Instant) -> Vec<(Instant, Option<f64>)> {
        let within = |at: Instant| from <= at && at <= to;
        let kept_from = self.history.front().map_or(Instant::NEVER, |sample| sample.at);
        let kept = self.history.iter().filter(|sample| within(sample.at)).flat_map(Sample::points);
        if kept_from <= from || self.history.len() < KEPT_SAMPLES {
            return kept.collect();
        }
        let mut samples = Vec::new();
        for (at, stretch) in self.trend.stretches().filter(|(at, _)| within(*at)) {
            if stretch.count > 0 {
                samples.extend([(at, Some(stretch.min)), (at, Some(stretch.max))]);
            }
            samples.extend(stretch.has_gap.then_some((at, None)));
        }
        samples
    }

    /// When the first sample came.
    pub fn begun(&self) -> Option<Instant> {
        let first = self.trend.stretches().next().map(|(at, _)| at);
        first.into_iter().chain(self.history.front().map(|sample| sample.at)).min()
    }

    /// What the channel read at a moment: its newest sample that is not later.
    pub fn at(&self, moment: Instant) -> Option<(Instant, Reading)> {
        let behind = self.history.partition_point(|sample| sample.at <= moment);
        let sample = behind.checked_sub(1).and_then(|place| self.history.get(place))?;
        Some((sample.at, sample.reading))
    }
}

impl Sample {
    /// What it is in a curve: after a gap, the gap first.
    fn points(&self) -> impl Iterator<Item = (Instant, Option<f64>)> {
        let gap = self.after_gap.then_some((self.at, None));
        gap.into_iter().chain([(self.at, self.reading.value())])
    }
}

/// Names from the product's file; a unit that has not said what it is gives them away by their number.
fn channel_names(product: Option<&Product>, count: usize) -> Cow<'_, [String]> {
    let known = product.map(|product| &product.stream).filter(|layout| layout.channels.len() == count);
    match known.or_else(|| Product::layout_with(count)) {
        Some(layout) => Cow::Borrowed(layout.channels.as_slice()),
        None => Cow::Owned((1..=count).map(|number| format!("#{number}")).collect()),
    }
}

impl Faults {
    /// Those that are kept, newest first.
    pub fn iter(&self) -> impl Iterator<Item = &Fault> {
        self.kept.iter()
    }

    /// Those that have not ended, newest first.
    pub fn lasting(&self) -> impl Iterator<Item = &Fault> {
        self.kept.iter().filter(|fault| fault.until.is_none())
    }

    /// Those that have ended, newest first.
    pub fn ended(&self) -> impl Iterator<Item = &Fault> {
        self.kept.iter().filter(|fault| fault.until.is_some())
    }

    /// Whether there was none.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Takes in what a channel shows: a fault, or (`None`) none.
    fn note(&mut self, channel: &str, shown: Option<Reading>, at: Instant) {
        let open = self.kept.iter_mut().find(|fault| fault.until.is_none() && fault.channel == channel);
        if open.as_ref().map(|fault| fault.kind) == shown {
            return;
        }
        if let Some(fault) = open {
            fault.until = Some(at);
        }
        if let Some(kind) = shown {
            self.seen += 1;
            self.kept.push_front(Fault { channel: channel.to_owned(), kind, since: at, until: None });
            self.forget_oldest();
        }
    }

    /// A fault that lasts is not forgotten, however old: it would begin again with the next row. A channel has one at most.
    fn forget_oldest(&mut self) {
        if self.kept.len() > KEPT_FAULTS
            && let Some(oldest) = self.kept.iter().rposition(|fault| fault.until.is_some())
        {
            self.kept.remove(oldest);
        }
    }

    fn end_all(&mut self, at: Instant, is_gone: impl Fn(&Fault) -> bool) {
        for fault in self.kept.iter_mut().filter(|fault| fault.until.is_none() && is_gone(fault)) {
            fault.until = Some(at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Monitor;
    use crate::record::Span;
    use crate::session::Event;

    fn row(monitor: &mut Monitor, millis: u64, readings: [Reading; 5]) {
        let at = Instant::from_millis(millis);
        let row = Row { source: Source::FieldValue, decimals: 3, readings: readings.to_vec() };
        monitor.fold(&Event::Row { at, span: Span::default(), row }, None);
    }

    #[test]
    fn a_fault_ends_with_its_channel() {
        let mut monitor = Monitor::default();
        row(&mut monitor, 1000, with_first(Reading::Open));
        let fewer = Row { source: Source::FieldValue, decimals: 3, readings: vec![Reading::Value(1.0)] };
        let at = Instant::from_millis(2000);
        monitor.fold(&Event::Row { at, span: Span::default(), row: fewer }, None);
        let names: Vec<_> = monitor.stream.channels.iter().map(|channel| channel.name.clone()).collect();
        assert_eq!((monitor.faults.lasting().count(), monitor.faults.seen), (0, 1), "beside {names:?}");
    }

    fn with_first(reading: Reading) -> [Reading; 5] {
        [reading, Reading::Value(1.0), Reading::Value(1.0), Reading::Disabled, Reading::Value(1.0)]
    }

    #[test]
    fn a_fault_is_remembered_with_its_beginning_and_its_end() {
        let mut monitor = Monitor::default();
        let readings = [Reading::Value(20.0), Reading::Open, Reading::Open, Reading::Short, Reading::Value(21.0)];
        for (number, reading) in readings.into_iter().enumerate() {
            row(&mut monitor, 1000 * number as u64, with_first(reading));
        }
        let seen: Vec<_> = monitor.faults.iter().map(|f| (f.kind, f.since, f.until)).collect();
        let at = Instant::from_millis;
        assert_eq!(seen, [(Reading::Short, at(3000), Some(at(4000))), (Reading::Open, at(1000), Some(at(3000)))]);
        assert_eq!((monitor.stream.channels[0].min, monitor.stream.channels[0].max), (Some(20.0), Some(21.0)));
    }

    #[test]
    fn a_process_value_that_may_stand_for_a_fault_is_neither_a_fault_nor_a_good_reading() {
        let product = Product::named("AXRTD8CO");
        let mut monitor = Monitor::default();
        let pv = |monitor: &mut Monitor, second: u64, source, first, product| {
            let mut readings = vec![Reading::Value(10.0); 8];
            readings[0] = first;
            let (at, row) = (Instant::from_millis(1000 * second), Row { source, decimals: 0, readings });
            monitor.fold(&Event::Row { at, span: Span::default(), row }, product);
        };
        let value = Reading::Value;
        for (second, reading) in [value(4000.0), Reading::Open, value(-384.0)].into_iter().enumerate() {
            pv(&mut monitor, second as u64, Source::ProcessValue, reading, product);
        }
        let channel = &monitor.stream.channels[0];
        assert_eq!((channel.words(), channel.reading), ("converter?", value(-384.0)));
        assert_eq!((channel.min, channel.max, channel.mean()), (Some(4000.0), Some(4000.0), Some(4000.0)));
        assert_eq!((monitor.faults.lasting().count(), monitor.faults.seen), (1, 1), "the open circuit is not over");
        monitor.stream.restart_extremes();
        assert_eq!(monitor.stream.channels[0].min, None);
        for (code, word) in [(-512.0, "open?"), (-448.0, "short?"), (-1.0, "off?"), (-2.0, "ok")] {
            pv(&mut monitor, 9, Source::ProcessValue, value(code), None);
            assert_eq!(monitor.stream.channels[0].words(), word, "by the names of its channels");
        }
        assert_eq!(monitor.faults.lasting().count(), 0, "a value is one");
        // Degrees are what they are, and the other product has no such numbers among its eight channels.
        pv(&mut monitor, 10, Source::FieldValue, value(-1.0), product);
        assert_eq!(monitor.stream.channels[0].words(), "ok");
        pv(&mut monitor, 11, Source::ProcessValue, value(-512.0), Product::named("AXTC4CO"));
        assert_eq!(monitor.stream.channels[0].words(), "ok");
    }

    #[test]
    fn rows_that_are_kept_have_the_digits_that_were_printed() {
        let mut monitor = Monitor::default();
        let layout = Product::layout_with(8).expect("there is one");
        for text in [["  4768"; 8].join(";"), ["  56.0"; 8].join(";")] {
            let row = layout.parse(&text).expect("a row");
            monitor.fold(&Event::Row { at: Instant::ZERO, span: Span::default(), row: row.clone() }, None);
            assert_eq!(monitor.stream.kept_rows().map(|(_, kept)| kept).collect::<Vec<_>>(), [row]);
        }
        assert_eq!(monitor.stream.decimals, 1);
    }

    #[test]
    fn a_curve_has_a_gap_where_rows_are_missing_and_where_the_unit_was_away() {
        let mut monitor = Monitor::default();
        for millis in [0, 1000, 2000, 3000, 5400, 7901, 8900, 9900] {
            if millis == 9900 {
                monitor.stream.interrupt();
            }
            row(&mut monitor, millis, with_first(Reading::Value(20.0)));
        }
        let gaps = |points: Vec<(Instant, Option<f64>)>| -> Vec<u64> {
            let gaps = points.into_iter().filter(|(_, value)| value.is_none());
            gaps.map(|(at, _)| at.since_start().as_millis() as u64).collect()
        };
        let channel = &monitor.stream.channels[0];
        let all = channel.samples(Instant::ZERO, Instant::from_millis(9900));
        assert_eq!(gaps(all), [7901, 9900], "2.4 periods are not a gap, 2.501 are");
        assert_eq!(gaps(channel.newest(2).collect()), [9900]);
    }

    #[test]
    fn the_period_is_what_was_set_or_what_is_usual() {
        let mut monitor = Monitor::default();
        let second = Some(Duration::from_secs(1));
        for millis in [0, 1000, 2000, 3000, 33_000, 34_000] {
            row(&mut monitor, millis, with_first(Reading::Value(20.0)));
            assert_eq!(monitor.stream.period(), second.filter(|_| millis > 0), "{millis}: an outage is not a period");
        }
        for millis in [34_200, 34_400] {
            row(&mut monitor, millis, with_first(Reading::Value(20.0)));
        }
        assert_eq!(monitor.stream.period(), Some(Duration::from_millis(200)), "another setting shows with two rows");
        monitor.stream.set_period(Some(Duration::from_millis(1)));
        for millis in [34_403, 34_406, 34_409] {
            row(&mut monitor, millis, with_first(Reading::Value(20.0)));
        }
        assert_eq!(monitor.stream.period(), Some(Duration::from_millis(1)), "as set, not as the line carries it");
    }

    #[test]
    fn marks_keep_their_numbers_when_the_oldest_are_forgotten() {
        let mut stream = Stream::default();
        let last = (0..=KEPT_MARKS as u64).map(|second| stream.mark(Instant::from_millis(second * 1000))).last();
        assert_eq!(last.map(|mark| mark.number), Some(KEPT_MARKS as u64 + 1));
        assert_eq!((stream.marks.len(), stream.marks[0].number), (KEPT_MARKS, 2));
        // A recording may hold any number.
        let later = Instant::from_millis(1_000_000);
        stream.set_mark(Mark { number: u64::MAX, at: later });
        assert_eq!(stream.mark(later).number, u64::MAX);
    }

    #[test]
    fn history_is_bounded() {
        let mut monitor = Monitor::default();
        for number in 0..(KEPT_SAMPLES as u64 + 100) {
            row(&mut monitor, number, with_first(if number % 2 == 0 { Reading::Open } else { Reading::Short }));
        }
        assert!(monitor.stream.channels.iter().all(|channel| channel.history.len() == KEPT_SAMPLES));
        assert_eq!(monitor.faults.iter().count(), KEPT_FAULTS);
        assert_eq!(monitor.faults.seen, KEPT_SAMPLES as u64 + 100);
    }

    #[test]
    fn a_fault_that_lasts_is_not_forgotten_for_many_that_come_and_go() {
        let mut monitor = Monitor::default();
        let value = Reading::Value(1.0);
        for number in 0..3 * KEPT_FAULTS as u64 {
            let loose = if number % 2 == 0 { Reading::Open } else { value };
            row(&mut monitor, 1000 * number, [loose, value, value, value, Reading::Open]);
        }
        let lasting: Vec<_> = monitor.faults.lasting().map(|fault| fault.since).collect();
        assert_eq!(lasting, [Instant::ZERO], "since it was seen first");
        assert_eq!(monitor.faults.iter().count(), KEPT_FAULTS);
        assert_eq!(monitor.faults.seen, 3 * KEPT_FAULTS as u64 / 2 + 1);
    }
}
