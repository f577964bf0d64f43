//! A unit's service report: everything known of it on one page of HTML, for somebody who was not there.
//!
//! The page needs nothing but itself: no script, no picture from elsewhere, no font. All text that a device has sent is
//! escaped, control characters made visible. It prints on paper.

mod curve;
mod page;

use crate::dump::Dump;
use crate::monitor::{Fault, Monitor, Scrollback};
use crate::session::{Facts, Known, Origin, UnitState};
use crate::time::{Duration, Instant};
use crate::wire::stream::Source;
use page::Page;

/// Lines of the transcript at most, the newest.
const MOST_LINES: usize = 3000;

/// What a report is made of.
pub struct Contents<'a> {
    /// The link, as the user named it.
    pub link: &'a str,
    /// When the report was made: local date and time.
    pub made: &'a str,
    /// What is known of the unit.
    pub facts: &'a Facts,
    /// What it has shown.
    pub monitor: &'a Monitor,
    /// Its object dictionary, if it was read.
    pub dump: Option<&'a Dump>,
    /// What could not be found out, a sentence each.
    pub missing: &'a [String],
    /// The text of the line.
    pub transcript: &'a Scrollback,
    /// Local time of day at the start of time.
    pub start_of_day: Duration,
}

impl Contents<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let product = self.facts.product.as_ref().map_or("unit", |known| known.value.as_str());
        let mut page = Page::new(&format!("Service report: {product}"));
        page.paragraph(&format!("{}, {}. Made by axcon {}.", self.made, self.link, env!("CARGO_PKG_VERSION")));
        self.unit(&mut page);
        self.faults(&mut page);
        self.values(&mut page);
        self.diagnostics(&mut page);
        self.dictionary(&mut page);
        self.transcript(&mut page);
        page.end()
    }

    fn time(&self, at: Instant) -> String {
        let seconds = (self.start_of_day + at.since_start()).as_secs() % 86_400;
        format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
    }

    fn unit(&self, page: &mut Page) {
        let facts = self.facts;
        page.section("Unit");
        let state = match facts.state {
            UnitState::Silent => "silent",
            UnitState::Unknown => "talks, says nothing known",
            UnitState::Application => "application runs",
            UnitState::Loader => "in its loader, waits for a file",
        };
        page.table(
            &["", "", "known from"],
            [
                row("State", state.into(), ""),
                known("Product", &facts.product, Clone::clone),
                known("Software version", &facts.version, ToString::to_string),
                known("Node-ID", &facts.node_id, ToString::to_string),
                known("CAN bit rate", &facts.can_kbps, |rate| format!("{rate} kbit/s")),
                known("CANopen state", &facts.nmt_state, Clone::clone),
            ],
        );
        for sentence in self.missing {
            page.remark(sentence);
        }
    }

    fn faults(&self, page: &mut Page) {
        page.section("Faults");
        let listed: Vec<&str> = self.dump.into_iter().flat_map(Dump::errors).collect();
        if listed.is_empty() && self.monitor.faults.is_empty() {
            return page.paragraph("None seen.");
        }
        let seen = self.monitor.faults.iter().map(|fault| self.fault(fault));
        let listed = listed.into_iter().map(|words| {
            ["unit's list 1003h".to_owned(), words.to_owned(), String::new(), String::new()].map(Cell::bad)
        });
        page.table(&["Channel", "Fault", "since", "until"], seen.chain(listed));
    }

    fn fault(&self, fault: &Fault) -> [Cell; 4] {
        let kind = fault.kind.words();
        let until = fault.until.map_or_else(|| "still there".to_owned(), |at| self.time(at));
        let cells = [fault.channel.clone(), kind.to_owned(), self.time(fault.since), until];
        if fault.until.is_none() { cells.map(Cell::bad) } else { cells.map(Cell::plain) }
    }

    fn values(&self, page: &mut Page) {
        let stream = &self.monitor.stream;
        page.section("Values");
        let (Some(source), Some(newest)) = (stream.source, stream.newest) else {
            return page.paragraph("The stream has shown none.");
        };
        let what = match source {
            Source::FieldValue => "field values (6100h) in °C",
            Source::ProcessValue => "process values (7130h) in counts",
        };
        page.paragraph(&format!("{} rows, the last at {}: {what}.", stream.rows, self.time(newest)));
        let decimals = stream.decimals;
        let show = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"));
        let rows = stream.channels.iter().map(|channel| {
            let words = channel.words();
            let state = if channel.reading.is_fault() { Cell::bad(words) } else { Cell::plain(words) };
            let [value, min, max, mean] = [channel.reading.value(), channel.min, channel.max, channel.mean()]
                .map(|value| Cell::number(show(value)));
            [Cell::plain(&channel.name), value, state, min, max, mean]
        });
        page.table(&["Channel", "Value", "State", "Min", "Max", "Mean"], rows);
        for channel in &stream.channels {
            let samples = channel.samples(channel.begun().unwrap_or(newest), newest);
            if let Some(picture) = curve::draw(&channel.name, &samples, |at| self.time(at)) {
                page.picture(&picture);
            }
        }
    }

    fn diagnostics(&self, page: &mut Page) {
        page.section("Diagnostics");
        let diagnostics = &self.monitor.diagnostics;
        match diagnostics.at {
            None => page.paragraph("None seen."),
            Some(at) => {
                page.paragraph(&format!("As the unit printed them at {}.", self.time(at)));
                page.text(diagnostics.lines.iter().map(String::as_str));
            }
        }
    }

    fn dictionary(&self, page: &mut Page) {
        page.section("Object dictionary");
        let Some(dump) = self.dump else { return page.paragraph("It was not read.") };
        let complete = if dump.complete { "" } else { " The unit did not show all of it." };
        let compared = match dump.product {
            Some(_) => format!("{} not as the factory made them (marked)", dump.deviations()),
            None => "compared with nothing: the unit does not say which product it is".to_owned(),
        };
        page.paragraph(&format!("{} entries, {compared}.{complete}", dump.entries.len()));
        let rows = dump.entries.iter().map(|entry| {
            let address = entry.at().to_string();
            let unit = entry.unit.as_deref().unwrap_or_default();
            let value = if entry.value.is_some() { format!("{} {unit}", entry.shown()) } else { entry.text.clone() };
            let meaning = entry.meaning.clone().unwrap_or_default();
            let cells = [address, entry.name.clone(), value, meaning, entry.shown_default()];
            if entry.deviates { cells.map(Cell::marked) } else { cells.map(Cell::plain) }
        });
        page.table(&["Address", "Name", "Value", "Meaning", "Factory"], rows);
    }

    fn transcript(&self, page: &mut Page) {
        page.section("Transcript");
        let lines = self.transcript.lines();
        let skipped = lines.len().saturating_sub(MOST_LINES);
        let left_out = self.transcript.start() + skipped as u64;
        if left_out > 0 {
            page.remark(&format!("{left_out} earlier lines are left out: a recording of the session has them."));
        }
        let shown: Vec<String> = lines
            .skip(skipped)
            .map(|line| {
                let mark = match line.origin {
                    crate::monitor::Origin::Unit => " ",
                    crate::monitor::Origin::Us => "»",
                    crate::monitor::Origin::Console => "─",
                };
                format!("{} {mark} {}", self.time(line.at), line.text)
            })
            .collect();
        page.text(shown.iter().map(String::as_str));
    }
}

/// What is in a place of a table, and how.
pub struct Cell {
    text: String,
    look: Look,
}

/// How a cell of a table looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Like most.
    Plain,
    /// A fault.
    Bad,
    /// Not as the factory made it.
    Marked,
    /// A number among those above and below it.
    Number,
}

impl Cell {
    fn plain(text: impl Into<String>) -> Self {
        Cell { text: text.into(), look: Look::Plain }
    }

    fn bad(text: impl Into<String>) -> Self {
        Cell { text: text.into(), look: Look::Bad }
    }

    fn marked(text: impl Into<String>) -> Self {
        Cell { text: text.into(), look: Look::Marked }
    }

    fn number(text: impl Into<String>) -> Self {
        Cell { text: text.into(), look: Look::Number }
    }
}

fn row(label: &str, value: String, origin: &str) -> [Cell; 3] {
    [label.to_owned(), value, origin.to_owned()].map(Cell::plain)
}

fn known<T>(label: &str, fact: &Option<Known<T>>, show: impl Fn(&T) -> String) -> [Cell; 3] {
    match fact {
        None => row(label, "not known".into(), ""),
        Some(known) => {
            let origin = match known.origin {
                Origin::Banner => "banner",
                Origin::Menu => "menu",
                Origin::Dictionary => "object dictionary",
                Origin::Diagnostics => "diagnostics",
            };
            row(label, show(&known.value), origin)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;
    use crate::monitor::KEPT_LINES;
    use crate::record::Span;
    use crate::session::Event;
    use crate::wire::Text;
    use crate::wire::stream::{Reading, Row};

    /// The page of a unit of which nothing but this is known, made at noon.
    fn page(monitor: &Monitor, transcript: &Scrollback) -> String {
        let contents = Contents {
            link: "u0",
            made: "2026-01-31 12:00",
            facts: &Facts::default(),
            monitor,
            dump: None,
            missing: &[],
            transcript,
            start_of_day: Duration::from_secs(12 * 3600),
        };
        contents.html()
    }

    #[test]
    fn nothing_a_device_sends_is_more_than_text() {
        let evil = "<script>alert(1)</script>&\"'\u{1b}[2J";
        let mut monitor = Monitor::default();
        let text = Text { text: evil.into(), span: Span::default() };
        monitor.fold(&Event::Page { at: Instant::ZERO, lines: vec![text] }, None);
        let known = Known { value: evil.to_owned(), origin: Origin::Banner, span: Span::default() };
        let facts = Facts { product: Some(known.clone()), nmt_state: Some(known), ..Facts::default() };
        let mut transcript = Scrollback::default();
        transcript.note(Instant::ZERO, evil.into());
        let contents = Contents {
            link: evil,
            made: "2026-01-31 12:00",
            facts: &facts,
            monitor: &monitor,
            dump: None,
            missing: &[evil.to_owned()],
            transcript: &transcript,
            start_of_day: Duration::ZERO,
        };
        let html = contents.html();
        assert!(!html.contains("<script") && !html.contains('\u{1b}'), "{html}");
        assert_eq!(
            html.matches("&lt;script&gt;alert(1)").count(),
            8,
            "title, heading, link, two facts, remark, page, line"
        );
        assert!(!html.contains("http"), "nothing from elsewhere");
    }

    #[test]
    fn all_lines_that_are_left_out_of_the_transcript_are_counted() {
        let mut transcript = Scrollback::default();
        let lines = KEPT_LINES + 7;
        (0..lines).for_each(|number| transcript.note(Instant::ZERO, format!("line {number};")));
        let html = page(&Monitor::default(), &transcript);
        assert!(html.contains(&format!("{} earlier lines are left out", lines - MOST_LINES)), "also those not kept");
        assert!(html.contains(&format!("line {};", lines - MOST_LINES)));
        assert!(!html.contains(&format!("line {};", lines - MOST_LINES - 1)));
    }

    #[test]
    fn a_curve_has_gaps_where_nothing_was_measured_and_faults_their_times() {
        let mut monitor = Monitor::default();
        for second in 0..20u64 {
            let reading = if (8..12).contains(&second) { Reading::Open } else { Reading::Value(second as f64) };
            let row = Row { source: Source::FieldValue, decimals: 3, readings: vec![reading; 5] };
            let at = Instant::from_millis(1000 * second);
            monitor.fold(&Event::Row { at, span: Span::default(), row }, None);
        }
        let html = page(&monitor, &Scrollback::default());
        assert_eq!(html.matches("<polyline").count(), 10, "two stretches for each of five channels");
        assert!(html.contains("<td>12:00:08</td><td>12:00:12</td>"), "{html}");
    }

    #[test]
    fn values_have_the_digits_that_the_unit_printed() {
        let layout = Product::layout_with(8).expect("there is one");
        let degrees = ([56.0, 57.0], ["57.0", "56.0", "57.0", "56.5"]);
        let counts = ([4.0, 8.0], ["8", "4", "8", "6"]);
        for (readings, shown) in [degrees, counts] {
            let mut monitor = Monitor::default();
            let decimals = usize::from(shown[0].contains('.'));
            for value in readings {
                let row = layout.parse(&[format!("{value:6.decimals$}").as_str(); 8].join(";")).expect("a row");
                monitor.fold(&Event::Row { at: Instant::ZERO, span: Span::default(), row }, None);
            }
            let html = page(&monitor, &Scrollback::default());
            let [value, min, max, mean] = shown.map(|number| format!("<td class=\"n\">{number}</td>"));
            assert!(html.contains(&format!("<td>RTD1</td>{value}<td>ok</td>{min}{max}{mean}")), "{html}");
        }
    }
}
