//! Entries of the object dictionary from lines, in whatever order and layout they come.

use std::collections::{BTreeMap, BTreeSet};

use super::notation;
use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::device::dictionary::{Entry, Object};
use crate::record::Span;
use crate::session::event::{DictionaryReading, ReadEntry, WalkEnd};
use crate::wire::dictionary::{Expected, Reading, Shown, ViewLine};
use crate::wire::{Message, Text, dictionary};

/// Most entries that are kept; and most lines, as long as the product is not known.
const MOST_ENTRIES: usize = 20_000;

/// Most different lines that were not understood and are kept: the largest product has 326 entries.
const MOST_UNREAD: usize = 2_000;

/// This many different lines that were not understood are more than just titles.
const MANY_UNREAD: usize = 10;

/// Where an object dictionary says which product it is: its code (manuals, object 1018h).
const PRODUCT_CODE: ObjectAddress = ObjectAddress::new(0x1018, 2);

/// What a line was.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Read {
    /// An entry, or the heading of an object that is known.
    Understood,
    /// It may be the heading of another object.
    PerhapsHeading,
    /// Nothing that belongs in an object dictionary.
    Nothing,
}

/// What has been read so far.
#[derive(Clone, Default)]
pub(in crate::session) struct Collector {
    /// The product whose objects these are, once it is known.
    pub(in crate::session) product: Option<&'static Product>,
    entries: BTreeMap<ObjectAddress, ReadEntry>,
    unrecognised_lines: u64,
    /// The same without repeats: a line that a unit prints again and again can be no missing entry.
    unread: BTreeSet<String>,
    /// The first of them.
    first_unread: Option<String>,
    /// Entries whose lines were among them.
    unread_entries: BTreeSet<ObjectAddress>,
    /// Lines that were taken for the heading of an object, and have a number.
    headings: BTreeMap<u16, String>,
    /// All lines, as long as the product is not known, to be read again once it is; each with whether it means
    /// something other than an entry.
    lines: Vec<(Text, bool)>,
    /// The object whose entries follow.
    heading: Option<u16>,
    /// The last entry that was read: its sub-index tells how the next one is written.
    last: Option<ObjectAddress>,
}

impl Collector {
    /// Takes a line of the view, or something else. Says whether it was understood.
    pub(in crate::session) fn line(&mut self, text: &Text, message: &Message) -> bool {
        self.take_line(text, *message != Message::Text)
    }

    /// `otherwise`: the line means something that is not an entry, as a menu after the view does.
    fn take_line(&mut self, text: &Text, otherwise: bool) -> bool {
        if self.product.is_none() && self.lines.len() < MOST_ENTRIES {
            self.lines.push((text.clone(), otherwise));
        }
        let read = self.read(text);
        let counts = read == Read::Nothing && !otherwise && may_be_an_entry(&text.text);
        if counts {
            self.unrecognised_lines += 1;
            self.unread(&text.text);
        }
        read == Read::Understood
    }

    fn unread(&mut self, line: &str) {
        if self.unread.len() < MOST_UNREAD {
            let line = line.trim();
            self.first_unread.get_or_insert_with(|| line.to_owned());
            self.unread.insert(line.to_owned());
        }
    }

    /// How many different lines were not understood.
    pub(in crate::session) fn unread_lines(&self) -> usize {
        self.unread.len()
    }

    /// The first line that was not understood, if there are enough such lines to be the missing entries. A unit whose
    /// software lacks objects has titles and hints of its own, but few of them.
    fn hidden(&self) -> Option<&String> {
        let missing = match self.product {
            Some(_) => self.missing(),
            None => self.count(),
        };
        let shows_one = self.unread_entries.iter().any(|at| !self.entries.contains_key(at));
        let hides = missing > 0 && (shows_one || self.unread.len() >= missing.min(MANY_UNREAD));
        self.first_unread.as_ref().filter(|_| hides)
    }

    /// Counts headings without entries below them as lines that were not understood: they held the entries themselves.
    fn count_headings(&mut self) {
        for (index, heading) in std::mem::take(&mut self.headings) {
            let entries = ObjectAddress::new(index, 0)..=ObjectAddress::new(index, u8::MAX);
            if self.entries.range(entries).next().is_none() {
                self.unrecognised_lines += 1;
                self.unread(&heading);
            }
        }
    }

    fn read(&mut self, text: &Text) -> Read {
        let product = self.product;
        let knows = |index| product.is_none_or(|product| product.dictionary.object(index).is_some());
        for lines in dictionary::several(&text.text, knows) {
            if let Some(entries) = self.read_all(&lines, text) {
                self.heading = lines.first().and_then(|line| line.index).or(self.heading);
                entries.into_iter().for_each(|entry| self.keep(entry));
                return Read::Understood;
            }
        }
        let Some(line) = dictionary::line(&text.text, knows) else { return Read::Nothing };
        if line.index.is_some() {
            self.heading = line.index;
        }
        let Some(index) = self.heading else { return Read::Nothing };
        let object = product.and_then(|product| product.dictionary.object(index));
        let single = object.is_none_or(|object| object.entries.len() == 1);
        let at = self.address(index, &line, self.last);
        let entry = object.and_then(|object| object.entry(at.sub));
        let reading = match (object, entry) {
            (Some(object), Some(entry)) if line.sub.is_some() || single => value(&line.rest, object, entry),
            (Some(object), Some(_)) => {
                self.read_list(object, &line, text);
                // A heading: no entry, but understood. With a number in it, it may be more.
                if may_be_an_entry(&line.rest) {
                    self.headings.entry(index).or_insert_with(|| text.text.trim().to_owned());
                }
                return Read::Understood;
            }
            (Some(_), None) | (None, _) => None,
        };
        match (reading, entry) {
            (Some(reading), _) => {
                self.keep(ReadEntry { at, text: line.rest, span: text.span, reading: Some(reading) });
                Read::Understood
            }
            // An object that the manual does not have is kept as it is printed.
            (None, None) if line.sub.is_some() => {
                self.keep(ReadEntry { at, text: line.rest, span: text.span, reading: None });
                Read::Understood
            }
            // The heading of a variable whose value is below it.
            (None, Some(_)) if line.sub.is_none() => Read::Understood,
            (None, Some(_)) => {
                if may_be_an_entry(&line.rest) {
                    self.unread_entries.insert(at);
                }
                Read::Nothing
            }
            (None, None) => Read::PerhapsHeading,
        }
    }

    fn address(&self, index: u16, line: &ViewLine, last: Option<ObjectAddress>) -> ObjectAddress {
        let before = last.filter(|last| last.index == index).map(|last| last.sub);
        ObjectAddress::new(index, line.sub.map_or(0, |sub| sub.behind(before)))
    }

    /// The entries that are in the columns of a line, if all of them are entries: what looks like one may be something
    /// else.
    fn read_all(&self, lines: &[ViewLine], text: &Text) -> Option<Vec<ReadEntry>> {
        let mut last = self.last;
        let mut entries = Vec::new();
        for line in lines {
            let index = line.index.or(self.heading)?;
            let at = self.address(index, line, last);
            last = Some(at);
            let reading = match self.product {
                // Their values can be read once the product is known.
                None => None,
                Some(product) => {
                    let object = product.dictionary.object(index)?;
                    Some(value(&line.rest, object, object.entry(at.sub)?)?)
                }
            };
            entries.push(ReadEntry { at, text: line.rest.clone(), span: text.span, reading });
        }
        Some(entries)
    }

    /// The values of an object one after the other, as in `6126h: 2 16.000 17.000`: all of them, and the first one says
    /// how many follow.
    fn read_list(&mut self, object: &Object, line: &ViewLine, text: &Text) {
        let words: Vec<&str> = line.rest.split_whitespace().collect();
        if words.len() != object.entries.len() {
            return;
        }
        let read = |(entry, word): (&Entry, &&str)| {
            let expected = Expected { data_type: entry.data_type, names: &[], unit: entry.unit.as_deref() };
            let reading = Some(dictionary::value(word, &expected)?);
            let at = ObjectAddress::new(object.index, entry.sub);
            Some(ReadEntry { at, text: (*word).to_owned(), span: text.span, reading })
        };
        let entries: Option<Vec<_>> = object.entries.iter().zip(&words).map(read).collect();
        let Some(entries) = entries else { return };
        let count = entries.first().and_then(ReadEntry::value).and_then(Value::as_integer);
        let highest = entries.last().map(|last| i64::from(last.at.sub));
        if count.is_some() && count == highest {
            entries.into_iter().for_each(|entry| self.keep(entry));
        }
    }

    /// Whether an entry would be read from a line.
    pub(in crate::session) fn reads(&self, text: &Text) -> bool {
        let mut trial = Collector { product: self.product, heading: self.heading, last: self.last, ..Self::default() };
        trial.read(text);
        trial.count() > 0
    }

    /// Takes back what was read at this place: it was not a whole line.
    pub(in crate::session) fn forget(&mut self, span: Span) {
        self.lines.retain(|(line, _)| line.span != span);
        self.entries.retain(|_, entry| entry.span != span);
    }

    /// Which product the unit is by the product code in its object dictionary, and where that was read.
    pub(in crate::session) fn product_shown(&self) -> Option<(&'static Product, Span)> {
        let shown = self.entries.get(&PRODUCT_CODE)?;
        let is_it = |product: &&Product| {
            let object = product.dictionary.object(PRODUCT_CODE.index);
            object.zip(object.and_then(|object| object.entry(PRODUCT_CODE.sub))).is_some_and(|(object, entry)| {
                let shown = value(&shown.text, object, entry).map(|reading| reading.shown);
                matches!(shown, Some(Shown::Value(value)) if value.as_integer() == Some(product.can.product_code.into()))
            })
        };
        Product::all().iter().find(is_it).map(|product| (product, shown.span))
    }

    /// Once the product is known, reads the lines that came before once more.
    fn read_again(&mut self) {
        let product = self.product.or_else(|| self.product_shown().map(|(product, _)| product));
        let lines = std::mem::take(&mut self.lines);
        if product.is_none() || lines.is_empty() {
            return;
        }
        let mut again = Collector { product, ..Collector::default() };
        for (line, otherwise) in &lines {
            again.take_line(line, *otherwise);
        }
        for (at, entry) in &self.entries {
            if entry.reading.is_some() || !again.entries.contains_key(at) {
                again.entries.insert(*at, entry.clone());
            }
        }
        *self = again;
    }

    /// The view has been left: a line without an index belongs to nothing read before.
    pub(in crate::session) fn interrupt(&mut self) {
        (self.heading, self.last) = (None, None);
    }

    /// Number of entries.
    pub(in crate::session) fn count(&self) -> usize {
        self.entries.len()
    }

    /// Whether every entry that the product has was there.
    pub(in crate::session) fn has_all(&self) -> bool {
        self.product.is_some() && self.missing() == 0
    }

    /// Entries that the product has and that were not there, as far as the product is known.
    pub(in crate::session) fn missing(&self) -> usize {
        self.product.map_or(0, |product| {
            product.dictionary.entries().filter(|(at, _, _)| !self.entries.contains_key(at)).count()
        })
    }

    /// Returns what was read, in the order of the addresses. `end` says how far the walk came.
    pub(in crate::session) fn take(&mut self, end: WalkEnd) -> DictionaryReading {
        self.read_again();
        self.count_headings();
        if let Some(product) = self.product {
            notation::settle(&mut self.entries, product);
        }
        let doubtful = self.entries.values().filter(|entry| entry.is_doubtful()).count();
        self.unrecognised_lines += doubtful as u64;
        let end = match (end, self.hidden()) {
            (WalkEnd::Whole, Some(first)) => WalkEnd::NotUnderstood { first: first.clone() },
            (end, _) => end,
        };
        DictionaryReading {
            entries: std::mem::take(&mut self.entries).into_values().collect(),
            end,
            unrecognised_lines: self.unrecognised_lines,
        }
    }

    fn keep(&mut self, entry: ReadEntry) {
        self.last = Some(entry.at);
        if self.entries.len() < MOST_ENTRIES || self.entries.contains_key(&entry.at) {
            self.entries.insert(entry.at, entry);
        }
    }
}

/// What a line shows of an entry of the manual.
fn value(rest: &str, object: &Object, entry: &Entry) -> Option<Reading> {
    // A unit like `100 µs` holds a number, which is not the value.
    let unit = entry.unit.as_deref().unwrap_or_default();
    let plain = unit.replace('°', "").replace('µ', "u").replace('Ω', "Ohm");
    let names = [object.name.as_str(), entry.name.as_str(), unit, plain.as_str()];
    dictionary::value(rest, &Expected { data_type: entry.data_type, names: &names, unit: entry.unit.as_deref() })
}

/// Whether a line in which nothing was recognised may be an entry all the same: it has a number. Titles and hints have
/// none.
fn may_be_an_entry(line: &str) -> bool {
    line.bytes().any(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes lines one after the other; `>` before one says that it means something that is not an entry.
    fn take(collector: &mut Collector, lines: &[&str]) {
        for line in lines {
            let (text, otherwise) = line.strip_prefix('>').map_or((*line, false), |text| (text, true));
            collector.take_line(&at(text), otherwise);
        }
    }

    /// A line with a place of its own.
    fn at(line: &str) -> Text {
        let start = line.bytes().fold(0u64, |place, byte| (place * 31 + u64::from(byte)) % 100_000);
        Text { span: Span { start, end: start + line.len() as u64 }, text: line.to_owned() }
    }

    fn of(product: &str) -> Collector {
        Collector { product: Product::named(product), ..Collector::default() }
    }

    /// Addresses and values of what has been read, and how many lines were not understood.
    fn taken(mut collector: Collector) -> (String, u64) {
        let reading = collector.take(WalkEnd::Whole);
        let shown = |entry: &ReadEntry| match entry.value() {
            Some(value) => format!("{}={value:?}", entry.at),
            None => format!("{}?{}", entry.at, entry.text),
        };
        (reading.entries.iter().map(shown).collect::<Vec<_>>().join(" "), reading.unrecognised_lines)
    }

    #[test]
    fn entries_below_a_heading_belong_to_it_until_the_view_is_left() {
        let lines = ["6126h Scaling Factor", "  01h TC1 = 16.000", "  02h TC2 = 17.000"];
        let mut collector = of("AXTC4CO");
        take(&mut collector, &lines);
        assert_eq!(taken(collector.clone()), ("6126:01=Real32(16.0) 6126:02=Real32(17.0)".into(), 0));
        collector.interrupt();
        take(&mut collector, &["  03h TC3 = 18.000"]);
        assert_eq!(taken(collector), ("6126:01=Real32(16.0) 6126:02=Real32(17.0)".into(), 1));
    }

    #[test]
    fn what_has_a_number_and_is_not_an_entry_is_counted_and_titles_are_not() {
        let mut collector = of("AXTC4CO");
        take(
            &mut collector,
            &["Object dictionary", "press Enter", "something 5", ">S - Diagnostics 7", "6126h:09 16.0"],
        );
        assert_eq!(taken(collector), ("6126:09?16.0".into(), 1));
    }

    #[test]
    fn an_object_without_sub_indices_is_read_from_its_line_or_the_one_below() {
        let mut collector = of("AXTC4CO");
        take(&mut collector, &["1017h Producer Heartbeat Time = 500"]);
        assert_eq!(taken(collector), ("1017:00=Unsigned16(500)".into(), 0));
        // The heading of an array has a number of its own, which is not a value.
        let mut collector = of("AXTC4CO");
        take(&mut collector, &["6126h Scaling Factor 4"]);
        assert_eq!(taken(collector), (String::new(), 1));
    }

    #[test]
    fn entries_in_columns_are_read_where_every_one_of_them_is_an_entry() {
        let two = "6126:01=Real32(16.0) 6126:02=Real32(17.0)";
        for (lines, expected, unrecognised) in [
            (&["| 6126h | 01h | TC1 | 16.000 |", "| 6126h | 02h | TC2 | 17.000 |"][..], two, 0),
            (&["6126  01  TC1  REAL32  16.000", "6126\t2\t17.000"], two, 0),
            (&["6126 01 16.000", "6126 02 17.000"], two, 0),
            (&["TC1 (6126h, 01h): 16.000", "TC2 (6126h, 02h): 17.000"], two, 0),
            (&["6126h/1  TC1  16.000  min 0 max 65535", "6126h/2  TC2  17.000  min 0 max 65535"], two, 0),
            (&["6126h Thermocouple Scaling Factor: 01=16.000 02=17.000"], two, 0),
            (&["6126h Something", "  01h TC1   16.000   02h TC2   17.000"], two, 0),
            (
                &["6126h: 4 16.0 17.0 18.0 19.0"],
                "6126:00=Unsigned8(4) 6126:01=Real32(16.0) 6126:02=Real32(17.0) 6126:03=Real32(18.0) 6126:04=Real32(19.0)",
                0,
            ),
            (&["6126h: 3 16.0 17.0 18.0 19.0", "6126h: 4 16.0 17.0 18.0"], "", 1),
            (&["1017h  00h  Producer Heartbeat Time  500"], "1017:00=Unsigned16(500)", 0),
            // Neither of them has such an entry, or a value of its type.
            (&["1999 01 15.5", "2027  01  31", "1000 2 5", "6126  01  open"], "", 3),
            (&["6126h  4  entries"], "", 1),
            (&["6126h Type: 1=J 2=K"], "", 1),
            (&["6126h:01 TC1 24,061"], "", 1),
        ] {
            let mut collector = of("AXTC4CO");
            take(&mut collector, lines);
            assert_eq!(taken(collector), (expected.into(), unrecognised), "{lines:?}");
        }
    }

    #[test]
    fn where_numbers_are_hexadecimal_without_a_mark_plain_digits_are_not_decimal() {
        let cob_id = "1400h:01 COB-ID C000027F";
        let mut collector = of("AXTC4CO");
        let plain = ["1017h Producer Heartbeat Time = 500", "1400h:02 255", "1400h:05 5"];
        take(&mut collector, &plain);
        take(&mut collector, &["6126h:01 16.000", "6126h:02 0", "6126h:03 20"]);
        let certain = "1017:00=Unsigned16(500) 1400:02=Unsigned8(255) 1400:05=Unsigned16(5) 6126:01=Real32(16.0) \
                       6126:02=Real32(0.0) 6126:03=Real32(20.0)";
        assert_eq!(taken(collector.clone()), (certain.into(), 0), "nothing says otherwise");
        take(&mut collector, &[cob_id]);
        let doubtful = "1017:00?= 500 1400:01?COB-ID C000027F 1400:02?255 1400:05=Unsigned16(5) 6126:01=Real32(16.0) \
                        6126:02=Real32(0.0) 6126:03?20";
        let (read, unrecognised) = taken(collector.clone());
        assert_eq!((read.replace("Producer Heartbeat Time ", "").as_str(), unrecognised), (doubtful, 4));
        take(&mut collector, &["1018h:01 Vendor ID 00000055", "1018h:02 Product Code 00010114"]);
        take(&mut collector, &["1002h Manufacturer Status Register 00000010"]);
        let (read, _) = taken(collector);
        assert!(read.contains("1400:01=Unsigned32(3221226111)"), "{read}");
        assert!(read.contains("1018:01=Unsigned32(85) 1018:02=Unsigned32(65812)"), "{read}");
        assert!(read.contains("1002:00=Unsigned32(16)"), "nobody writes eight decimal digits: {read}");
        let either = read.contains("1400:02?255") && read.contains("1017:00?Producer Heartbeat Time = 500");
        assert!(either, "what may be either stays so: {read}");
    }

    #[test]
    fn lines_say_more_once_it_is_known_whose_they_are() {
        let lines = ["6126h Scaling Factor", "  01h TC1 = 16.000", "something 5", ">S - Diagnostics 7"];
        let mut collector = Collector::default();
        take(&mut collector, &lines);
        let (unknown, _) = taken(collector.clone());
        assert_eq!(unknown, "6126:01?TC1 = 16.000");
        take(&mut collector, &["1018h:02 Product Code = 0x00010114"]);
        assert_eq!(collector.product_shown().map(|(product, _)| product.name.as_str()), Some("AXTC4CO"));
        let (read, unrecognised) = taken(collector);
        assert_eq!((read.as_str(), unrecognised), ("1018:02=Unsigned32(65812) 6126:01=Real32(16.0)", 1));
    }

    #[test]
    fn many_lines_that_nobody_understands_hide_entries_and_a_few_titles_do_not() {
        let whole = "6126h:01 TC1 = 16.000";
        let ends_as = |unread: &dyn Fn(usize) -> String, count: usize| {
            let mut collector = of("AXTC4CO");
            take(&mut collector, &[whole]);
            (0..count).for_each(|number| take(&mut collector, &[&unread(number)]));
            collector.take(WalkEnd::Whole).end
        };
        let page = |number: usize| format!("page {number} of 40");
        assert_eq!(ends_as(&page, 9), WalkEnd::Whole);
        assert_eq!(ends_as(&page, 10), WalkEnd::NotUnderstood { first: "page 0 of 40".into() });
        assert_eq!(ends_as(&|_| "more than 1 page".into(), 50), WalkEnd::Whole, "the same again and again");
        let mut collector = of("AXTC4CO");
        (0..20).for_each(|number| take(&mut collector, &[&page(number)]));
        assert_eq!(collector.take(WalkEnd::Stopped).end, WalkEnd::Stopped, "it is not the end in any case");
    }

    #[test]
    fn a_heading_with_numbers_and_nothing_below_it_was_not_one() {
        let mut collector = of("AXTC4CO");
        take(&mut collector, &["6126h:01 TC1 = 16.000", "6110h Sensor Type: one 10 two 2", "1003h Errors"]);
        let reading = collector.take(WalkEnd::Whole);
        assert_eq!(reading.unrecognised_lines, 1);
        let mut collector = of("AXTC4CO");
        take(&mut collector, &["6126h Scaling Factor 4", "  01h TC1 = 16.000"]);
        assert_eq!(collector.take(WalkEnd::Whole).unrecognised_lines, 0);
    }

    #[test]
    fn half_a_line_is_taken_back_and_what_would_be_read_is_not_taken() {
        let mut collector = of("AXTC4CO");
        let (whole, half) = ("6126h:01 TC1 = 16.000", "6126h:02 TC2 = 1");
        take(&mut collector, &[whole, half]);
        collector.forget(at(half).span);
        assert!(collector.reads(&at(half)) && !collector.reads(&at("press Enter 5")));
        assert_eq!(taken(collector), ("6126:01=Real32(16.0)".into(), 0));
        // Nor does it come back once it is known whose objects these are.
        let mut collector = Collector::default();
        take(&mut collector, &[whole, half]);
        collector.forget(at(half).span);
        take(&mut collector, &["1018h:02 Product Code = 0x00010114"]);
        assert_eq!(taken(collector), ("1018:02=Unsigned32(65812) 6126:01=Real32(16.0)".into(), 0));
    }

    #[test]
    fn an_entry_that_is_shown_again_has_its_last_value_whenever_it_was_known_whose_it_is() {
        let mut collector = Collector::default();
        take(&mut collector, &["6126h:01 TC1 = 16.000", "6126h:02 TC2 = 17.000"]);
        collector.product = Product::named("AXTC4CO");
        take(&mut collector, &["6126h:01 TC1 = 18.000"]);
        assert_eq!(taken(collector), ("6126:01=Real32(18.0) 6126:02=Real32(17.0)".into(), 0));
    }

    #[test]
    fn sub_indices_of_a_list_in_decimal_digits_go_on_where_the_one_before_ended() {
        let mut collector = Collector::default();
        take(&mut collector, &["1A00h map: 8=1 9=2 10=3"]);
        assert_eq!(taken(collector), ("1A00:08?1 1A00:09?2 1A00:0A?3".into(), 0));
    }

    #[test]
    fn more_entries_than_any_unit_has_are_not_kept_and_known_ones_are_still_read() {
        let mut collector = of("AXTC4CO");
        let entry = |number: usize| ReadEntry {
            at: ObjectAddress::new((0x2000 + number / 256) as u16, (number % 256) as u8),
            text: number.to_string(),
            span: Span::default(),
            reading: None,
        };
        (0..=MOST_ENTRIES).for_each(|number| collector.keep(entry(number)));
        assert_eq!(collector.count(), MOST_ENTRIES);
        collector.keep(ReadEntry { text: "again".into(), ..entry(7) });
        assert_eq!(collector.entries[&entry(7).at].text, "again");
        assert_eq!(collector.count(), MOST_ENTRIES);
    }
}
