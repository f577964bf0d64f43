//! Entries of the object dictionary from lines, in whatever order and layout they come.

use std::collections::BTreeMap;

use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::record::Span;
use crate::session::event::{DictionaryReading, ReadEntry};
use crate::wire::{Message, Text, dictionary};

/// Entries that are kept at most; and lines, as long as nobody knows whose objects they are.
const MOST_ENTRIES: usize = 20_000;

/// Where an object dictionary says which product it is: its code (manuals, object 1018h).
const PRODUCT_CODE: ObjectAddress = ObjectAddress::new(0x1018, 2);

/// What a line was.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Read {
    /// An entry, or the heading of an object that is known.
    Understood,
    /// It may be the heading of another object.
    PerhapsHeading,
    /// Nothing that belongs into an object dictionary.
    Nothing,
}

/// What has been read so far.
#[derive(Clone, Default)]
pub(in crate::session) struct Collector {
    /// The product whose objects these are, once it is known.
    pub(in crate::session) product: Option<&'static Product>,
    entries: BTreeMap<ObjectAddress, ReadEntry>,
    unrecognised_lines: u64,
    /// All lines, as long as the product is not known: with it they say more. And whether they mean something else.
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

    /// `otherwise`: the line means something that is no entry, as a menu behind the view does.
    fn take_line(&mut self, text: &Text, otherwise: bool) -> bool {
        if self.product.is_none() && self.lines.len() < MOST_ENTRIES {
            self.lines.push((text.clone(), otherwise));
        }
        let read = self.read(text);
        let counts = read == Read::Nothing && !otherwise && may_be_an_entry(&text.text);
        self.unrecognised_lines += u64::from(counts);
        read == Read::Understood
    }

    fn read(&mut self, text: &Text) -> Read {
        let product = self.product;
        let knows = |index| product.is_none_or(|product| product.dictionary.object(index).is_some());
        let Some(line) = dictionary::line(&text.text, knows) else { return Read::Nothing };
        if line.index.is_some() {
            self.heading = line.index;
        }
        let Some(index) = self.heading else { return Read::Nothing };
        let object = product.and_then(|product| product.dictionary.object(index));
        let single = object.is_none_or(|object| object.entries.len() == 1);
        let before = self.last.filter(|last| last.index == index).map(|last| last.sub);
        let at = ObjectAddress::new(index, line.sub.map_or(0, |sub| sub.behind(before)));
        let entry = object.and_then(|object| object.entry(at.sub));
        let shown = match (object, entry) {
            (Some(object), Some(entry)) if line.sub.is_some() || single => {
                // A unit like `100 µs` holds a number, which is not the value.
                let unit = entry.unit.as_deref().unwrap_or_default();
                let plain = unit.replace('°', "").replace('µ', "u").replace('Ω', "Ohm");
                dictionary::value(&line.rest, entry.data_type, &[&object.name, &entry.name, unit, &plain])
            }
            // A heading: no entry, but understood.
            (Some(_), Some(_)) => return Read::Understood,
            (Some(_), None) | (None, _) => None,
        };
        match (shown, entry) {
            (Some(shown), _) => {
                let value = match shown {
                    dictionary::Shown::Value(value) => Some(value),
                    dictionary::Shown::Nothing => None,
                };
                self.keep(ReadEntry { at, value, text: line.rest, span: text.span, known: true });
                Read::Understood
            }
            // An object that the manual does not have is kept as it is printed.
            (None, None) if line.sub.is_some() => {
                self.keep(ReadEntry { at, value: None, text: line.rest, span: text.span, known: false });
                Read::Understood
            }
            // The heading of a variable whose value stands below.
            (None, Some(_)) if line.sub.is_none() => Read::Understood,
            (None, Some(_)) => Read::Nothing,
            (None, None) => Read::PerhapsHeading,
        }
    }

    /// Whether an entry would be read from a line.
    pub(in crate::session) fn reads(&self, text: &Text) -> bool {
        let mut trial = Collector { product: self.product, heading: self.heading, last: self.last, ..Self::default() };
        trial.read(text);
        trial.count() > 0
    }

    /// Takes back what was read at this place: it was no whole line.
    pub(in crate::session) fn forget(&mut self, span: Span) {
        self.lines.retain(|(line, _)| line.span != span);
        self.entries.retain(|_, entry| entry.span != span);
    }

    /// What a unit that has not said its name is, by the product code it has shown; and where it has.
    pub(in crate::session) fn product_shown(&self) -> Option<(&'static Product, Span)> {
        let shown = self.entries.get(&PRODUCT_CODE)?;
        let is_it = |product: &&Product| {
            let object = product.dictionary.object(PRODUCT_CODE.index);
            object.zip(object.and_then(|object| object.entry(PRODUCT_CODE.sub))).is_some_and(|(object, entry)| {
                let value = dictionary::value(&shown.text, entry.data_type, &[&object.name, &entry.name]);
                matches!(value, Some(dictionary::Shown::Value(value)) if value.as_integer() == Some(product.can.product_code.into()))
            })
        };
        Product::all().iter().find(is_it).map(|product| (product, shown.span))
    }

    /// Reads what came before it was known whose objects these are once more.
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
            if entry.known || !again.entries.contains_key(at) {
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

    /// Gives what was read, in the order of the addresses.
    pub(in crate::session) fn take(&mut self, complete: bool) -> DictionaryReading {
        self.read_again();
        DictionaryReading {
            entries: std::mem::take(&mut self.entries).into_values().collect(),
            complete,
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

/// Whether a line in which nothing was recognised may be an entry all the same: it has a number. Titles and hints have
/// none.
fn may_be_an_entry(line: &str) -> bool {
    line.bytes().any(|byte| byte.is_ascii_digit())
}
