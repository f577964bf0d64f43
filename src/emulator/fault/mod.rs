//! What can go wrong with a unit, its flash and its cable, as a user or a test orders it.
//!
//! A [`Fault`] is one order, read from a few words; what it does to the bytes is in [`Middleman`], what it does to the
//! unit is done by the stage (`scenario`). Numbers count from 1, and from the moment the fault is ordered. Chance comes
//! from a seed, with a stream of its own for each fault, so that one more fault does not move the others.
//!
//! What the unit itself finds and tells the network is called an error, as in its manual, and is in `errors`.

mod middleman;

use std::fmt;

pub use middleman::{Arrival, MOST_FAULTS, Middleman};

use super::memory::Defect;
use super::words::{LONGEST_OFF_S, WordError, Words, unknown};
use crate::device::Product;
use crate::time::Duration;

/// Something that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// On the line.
    Line(LineFault),
    /// To the unit, at a record.
    Record(RecordFault),
    /// A word of program flash is spoiled.
    Flash {
        /// Its address.
        word: u32,
        /// How.
        defect: Defect,
    },
    /// The adapter is not an ideal one.
    Adapter(Setting),
}

/// Something that goes wrong on the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineFault {
    /// Something happens to bytes.
    Bytes {
        /// What.
        mishap: Mishap,
        /// To bytes in which direction.
        way: Way,
        /// To which of them.
        when: When,
    },
    /// The XON after an XOFF of the unit is lost; the XOFFs are counted.
    NoXon(When),
    /// The cable is pulled: this byte and all that follow are lost, in both directions.
    Unplug {
        /// In which direction bytes are counted.
        way: Way,
        /// Which one.
        byte: u64,
        /// After what time it is plugged in again, unless by hand.
        out: Option<Duration>,
    },
}

/// Something that happens to the unit when its loader has got an S-record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordFault {
    /// Which one, counted from 1.
    pub record: u64,
    /// What.
    pub deed: Deed,
}

/// What the unit suffers after a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deed {
    /// Its microcontroller resets.
    Reset,
    /// Its supply fails, and comes back after this time, unless by hand.
    PowerCut(Option<Duration>),
}

/// What the adapter does to all bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// Every byte arrives this much later, in both directions, as through a USB adapter.
    Latency(Duration),
    /// It holds this many bytes of a client that sends ahead; they leave whatever the unit says.
    Queue(usize),
}

/// What happens to a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// It does not arrive.
    Lost,
    /// It arrives twice.
    Doubled,
    /// One of its bits is turned over.
    Corrupted,
    /// Its stop bit is not where it should be: the unit's receiver notices.
    Unreadable,
    /// It arrives this much later, and what follows after it.
    Late(Duration),
}

/// A direction on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// From the client to the unit.
    ToUnit,
    /// From the unit to the client.
    FromUnit,
}

/// To which of many something happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// To this one, counted from 1.
    At(u64),
    /// To one in this many, by chance.
    OneIn(u64),
}

/// All faults with what they mean, for help texts.
pub const HELP: &str = "lost|doubled|corrupted WAY at byte N | one in N    WAY is to-unit or from-unit
unreadable to-unit at byte N | one in N            the unit's receiver sees that something came, not what
late WAY at byte N | one in N [by MS]              by 20 ms by default; what follows waits for it
no-xon at xoff N | one in N                        the XON after an XOFF of the unit is lost
reset at record N                                  after the N-th S-record that the loader gets
power-cut at record N [for SECONDS]                stays off if no time is given
unplug WAY at byte N [for SECONDS]                 stays out if no time is given
flash worn-out|protected|stuck at word ADDRESS     it takes nothing, is refused, or does not come to an end
latency MS                                         of the adapter, in both directions
queue BYTES                                        the adapter takes ahead, and sends whatever the unit says";

/// How late a byte is by default: what the slowest adapters take.
const USUAL_LATENESS: Duration = Duration::from_millis(20);
/// Longest lateness or latency: longer than any console waits.
const LONGEST_LATE_MS: u64 = 60_000;
/// Largest queue: what the largest adapters' chips hold.
const LARGEST_QUEUE: u64 = 4_096;
/// Largest count: more than a line carries in ten years.
const LARGEST_COUNT: u64 = 1 << 42;

const NAMES: &str =
    "lost, doubled, corrupted, unreadable, late, no-xon, reset, power-cut, unplug, flash, latency, queue";

impl Fault {
    /// Reads a fault of a unit of a product, in any case of its letters.
    ///
    /// # Errors
    /// If the words are not a fault, with the column.
    pub fn read(line: &str, product: &Product) -> Result<Fault, WordError> {
        let mut words = Words::of(line);
        let fault = Fault::parse(&mut words, product)?;
        words.end()?;
        Ok(fault)
    }

    /// Takes the words of a fault out of a line.
    pub(super) fn parse(words: &mut Words<'_>, product: &Product) -> Result<Fault, WordError> {
        let (column, word) = words.require("a fault", NAMES)?;
        let mishap = match word.to_ascii_lowercase().as_str() {
            "lost" => Mishap::Lost,
            "doubled" => Mishap::Doubled,
            "corrupted" => Mishap::Corrupted,
            "unreadable" => Mishap::Unreadable,
            "late" => Mishap::Late(USUAL_LATENESS),
            "no-xon" => return When::parse(words, "xoff").map(|when| Fault::Line(LineFault::NoXon(when))),
            "reset" => return Ok(Fault::Record(RecordFault { record: at(words, "record")?, deed: Deed::Reset })),
            "power-cut" => {
                let record = at(words, "record")?;
                return Ok(Fault::Record(RecordFault { record, deed: Deed::PowerCut(for_a_time(words)?) }));
            }
            "unplug" => {
                let way = Way::parse(words, "to-unit, from-unit")?;
                let byte = at(words, "byte")?;
                return Ok(Fault::Line(LineFault::Unplug { way, byte, out: for_a_time(words)? }));
            }
            "flash" => return Fault::of_flash(words, product),
            "latency" => {
                let latency = words.whole("a time in ms", 0..=LONGEST_LATE_MS)?;
                return Ok(Fault::Adapter(Setting::Latency(milliseconds(latency))));
            }
            "queue" => {
                let bytes = words.whole("a number of bytes", 0..=LARGEST_QUEUE)?;
                return Ok(Fault::Adapter(Setting::Queue(bytes as usize)));
            }
            _ => return Err(unknown(column, word, NAMES)),
        };
        let ways = if mishap == Mishap::Unreadable { "to-unit" } else { "to-unit, from-unit" };
        let way = Way::parse(words, ways)?;
        let when = When::parse(words, "byte")?;
        let mishap = match mishap {
            Mishap::Late(_) if !words.is_over() => {
                words.exactly("by")?;
                Mishap::Late(words.whole("a time in ms", 1..=LONGEST_LATE_MS).map(milliseconds)?)
            }
            mishap => mishap,
        };
        Ok(Fault::Line(LineFault::Bytes { mishap, way, when }))
    }

    fn of_flash(words: &mut Words<'_>, product: &Product) -> Result<Fault, WordError> {
        let defects = "worn-out, protected, stuck";
        let (column, word) = words.require("what is wrong with it", defects)?;
        let defect = match word.to_ascii_lowercase().as_str() {
            "worn-out" => Defect::WornOut,
            "protected" => Defect::Protected,
            "stuck" => Defect::Stuck,
            _ => return Err(unknown(column, word, defects)),
        };
        words.exactly("at")?;
        words.exactly("word")?;
        let last = u64::from(product.flash.program_words.saturating_sub(1));
        let word = words.whole("an address in words", 0..=last)? as u32;
        Ok(Fault::Flash { word, defect })
    }
}

impl Way {
    fn parse(words: &mut Words<'_>, allowed: &str) -> Result<Way, WordError> {
        let (column, word) = words.require("a way", allowed)?;
        let ways = [("to-unit", Way::ToUnit), ("from-unit", Way::FromUnit)];
        let found = ways.into_iter().find(|(name, _)| word.eq_ignore_ascii_case(name) && allowed.contains(name));
        found.map(|(_, way)| way).ok_or_else(|| unknown(column, word, allowed))
    }
}

impl When {
    fn parse(words: &mut Words<'_>, counted: &str) -> Result<When, WordError> {
        let allowed = format!("at {counted} N, one in N");
        let (column, word) = words.require("when", &allowed)?;
        if word.eq_ignore_ascii_case("at") {
            words.exactly(counted)?;
            number(words).map(When::At)
        } else if word.eq_ignore_ascii_case("one") {
            words.exactly("in")?;
            number(words).map(When::OneIn)
        } else {
            Err(unknown(column, word, &allowed))
        }
    }
}

fn at(words: &mut Words<'_>, counted: &str) -> Result<u64, WordError> {
    words.exactly("at")?;
    words.exactly(counted)?;
    number(words)
}

fn number(words: &mut Words<'_>) -> Result<u64, WordError> {
    words.whole("its number", 1..=LARGEST_COUNT)
}

fn for_a_time(words: &mut Words<'_>) -> Result<Option<Duration>, WordError> {
    if words.is_over() {
        return Ok(None);
    }
    words.exactly("for")?;
    words.seconds(LONGEST_OFF_S).map(Some)
}

fn milliseconds(number: u64) -> Duration {
    Duration::from_millis(number)
}

/// As [`Fault::read`] takes it.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time =
            |time: &Option<Duration>| time.map_or_else(String::new, |time| format!(" for {}", time.as_secs_f64()));
        match self {
            Fault::Line(LineFault::Bytes { mishap, way, when }) => {
                let (name, by) = match mishap {
                    Mishap::Lost => ("lost", String::new()),
                    Mishap::Doubled => ("doubled", String::new()),
                    Mishap::Corrupted => ("corrupted", String::new()),
                    Mishap::Unreadable => ("unreadable", String::new()),
                    Mishap::Late(by) => ("late", format!(" by {}", by.as_millis())),
                };
                write!(f, "{name} {way} {}{by}", when.of("byte"))
            }
            Fault::Line(LineFault::NoXon(when)) => write!(f, "no-xon {}", when.of("xoff")),
            Fault::Line(LineFault::Unplug { way, byte, out }) => write!(f, "unplug {way} at byte {byte}{}", time(out)),
            Fault::Record(RecordFault { record, deed: Deed::Reset }) => write!(f, "reset at record {record}"),
            Fault::Record(RecordFault { record, deed: Deed::PowerCut(off) }) => {
                write!(f, "power-cut at record {record}{}", time(off))
            }
            Fault::Flash { word, defect } => {
                let defect = match defect {
                    Defect::WornOut => "worn-out",
                    Defect::Protected => "protected",
                    Defect::Stuck => "stuck",
                };
                write!(f, "flash {defect} at word {word:#x}")
            }
            Fault::Adapter(Setting::Latency(latency)) => write!(f, "latency {}", latency.as_millis()),
            Fault::Adapter(Setting::Queue(bytes)) => write!(f, "queue {bytes}"),
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Way::ToUnit => "to-unit",
            Way::FromUnit => "from-unit",
        })
    }
}

impl When {
    fn of(self, counted: &str) -> String {
        match self {
            When::At(number) => format!("at {counted} {number}"),
            When::OneIn(number) => format!("one in {number}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Result<Fault, String> {
        let product = Product::named("AXTC4CO").expect("built in");
        Fault::read(line, product).map_err(|error| error.to_string())
    }

    #[test]
    fn every_fault_is_read_in_any_case_and_written_as_it_is_read() {
        let line = |mishap, way, when| Fault::Line(LineFault::Bytes { mishap, way, when });
        let unplug = |way, byte, out| Fault::Line(LineFault::Unplug { way, byte, out });
        let at_record = |record, deed| Fault::Record(RecordFault { record, deed });
        let late = |ms| Mishap::Late(Duration::from_millis(ms));
        use {Deed::*, Mishap::*, Way::*, When::*};
        let table = [
            ("lost to-unit at byte 5000", line(Lost, ToUnit, At(5000))),
            ("Doubled FROM-unit one in 200", line(Doubled, FromUnit, OneIn(200))),
            ("corrupted to-unit one in 1", line(Corrupted, ToUnit, OneIn(1))),
            ("unreadable to-unit at byte 7", line(Unreadable, ToUnit, At(7))),
            ("late from-unit at byte 3", line(late(20), FromUnit, At(3))),
            ("  late to-unit  one in 90 by 16", line(late(16), ToUnit, OneIn(90))),
            ("no-xon at xoff 3", Fault::Line(LineFault::NoXon(At(3)))),
            ("no-xon one in 50", Fault::Line(LineFault::NoXon(OneIn(50)))),
            ("reset at record 40", at_record(40, Reset)),
            ("power-cut at record 1", at_record(1, PowerCut(None))),
            ("power-cut at record 9 for 0.5", at_record(9, PowerCut(Some(Duration::from_millis(500))))),
            ("unplug to-unit at byte 12", unplug(ToUnit, 12, None)),
            ("unplug from-unit at byte 12 for 2", unplug(FromUnit, 12, Some(Duration::from_secs(2)))),
            ("flash worn-out at word 0xFFFF", Fault::Flash { word: 0xFFFF, defect: Defect::WornOut }),
            ("flash Protected at word 512", Fault::Flash { word: 512, defect: Defect::Protected }),
            ("flash stuck at word 0x0", Fault::Flash { word: 0, defect: Defect::Stuck }),
            ("latency 16", Fault::Adapter(Setting::Latency(Duration::from_millis(16)))),
            ("queue 256", Fault::Adapter(Setting::Queue(256))),
        ];
        for (text, fault) in table {
            assert_eq!(read(text), Ok(fault), "{text}");
            assert_eq!(read(&fault.to_string()), Ok(fault), "{fault}");
        }
        for name in NAMES.split(", ") {
            assert!(HELP.contains(name), "{name} has no help");
            assert!(table.iter().any(|(text, _)| text.trim().to_lowercase().starts_with(name)), "{name} is not tested");
        }
    }

    #[test]
    fn a_bad_fault_is_answered_with_the_column_and_what_there_is() {
        let table = [
            ("", "column 1: a fault is missing: lost, doubled, corrupted"),
            ("explode", "column 1: 'explode' is not known; there is: lost, doubled"),
            ("lost", "column 5: a way is missing: to-unit, from-unit"),
            ("lost up", "column 6: 'up' is not known; there is: to-unit, from-unit"),
            ("lost to-unit", "column 13: when is missing: at byte N, one in N"),
            ("lost to-unit sometimes", "column 14: 'sometimes' is not known; there is: at byte N, one in N"),
            ("lost to-unit at 5", "column 17: '5' is not known; there is: byte"),
            ("lost to-unit at byte 0", "column 22: '0' is not 1 to "),
            ("lost to-unit at byte 5 6", "column 24: '6' is too much"),
            ("lost to-unit one of 5", "column 18: 'of' is not known; there is: in"),
            ("lost to-unit one in 0", "column 21: '0' is not 1 to "),
            ("unreadable from-unit at byte 1", "column 12: 'from-unit' is not known; there is: to-unit"),
            ("late to-unit at byte 5 for 3", "column 24: 'for' is not known; there is: by"),
            ("late to-unit at byte 5 by 0", "column 27: '0' is not 1 to 60000"),
            ("no-xon at byte 5", "column 11: 'byte' is not known; there is: xoff"),
            ("reset", "column 6: a word is missing: at"),
            ("reset at record", "column 16: its number is missing: 1 to "),
            ("power-cut at record 1 for ever", "column 27: 'ever' is not a time in seconds"),
            ("power-cut at record 1 for -1", "column 27: '-1' is not 0 to 86400 seconds"),
            ("flash torn at word 1", "column 7: 'torn' is not known; there is: worn-out, protected, stuck"),
            ("flash stuck at word 0x10000", "column 21: '0x10000' is not 0 to 65535"),
            ("flash stuck at word 0x+1", "column 21: '0x+1' is not 0 to 65535"),
            ("flash stuck at word +1", "column 21: '+1' is not 0 to 65535"),
            ("latency 16ms", "column 9: '16ms' is not 0 to 60000"),
            ("queue 5000", "column 7: '5000' is not 0 to 4096"),
            ("\x1b[2J", "column 1: '^[[2J' is not known"),
        ];
        for (text, complaint) in table {
            let found = read(text).expect_err(text);
            assert!(found.starts_with(complaint), "{text:?}: {found}");
        }
    }

    proptest! {
        #[test]
        fn any_words_after_a_fault_are_read_or_refused_and_what_is_read_is_written_the_same(
            name in "lost|late|no-xon|reset|power-cut|unplug|flash stuck|latency|queue",
            rest in "( (to-unit|from-unit|at|byte|record|xoff|word|one|in|by|for|[0-9]{1,3}|0x[0-9a-f]{1,4}|0.25)){0,6}"
        ) {
            if let Ok(fault) = read(&format!("{name}{rest}")) {
                prop_assert_eq!(read(&fault.to_string()), Ok(fault));
            }
        }

        #[test]
        fn every_fault_of_the_grammar_is_read_and_written_the_same(
            text in concat!(
                "(lost|doubled|corrupted|late) (to|from)-unit (at byte|one in) [1-9][0-9]{0,11}",
                "|unreadable to-unit (at byte|one in) [1-9][0-9]{0,11}",
                "|late (to|from)-unit (at byte|one in) [1-9][0-9]{0,11} by [1-9][0-9]{0,3}",
                "|no-xon (at xoff|one in) [1-9][0-9]{0,11}",
                "|reset at record [1-9][0-9]{0,11}",
                "|(power-cut at record|unplug (to|from)-unit at byte) [1-9][0-9]{0,11}( for [0-9]{1,4}([.]25)?)?",
                "|flash (worn-out|protected|stuck) at word (0x[0-9a-fA-F]{1,4}|[0-9]{1,4})",
                "|latency [0-9]{1,4}|queue [0-9]{1,3}",
            )
        ) {
            let fault = read(&text);
            prop_assert!(fault.is_ok(), "{text}: {fault:?}");
            let written = fault.clone().map(|fault| fault.to_string());
            prop_assert_eq!(written.and_then(|written| read(&written)), fault, "{}", text);
        }
    }
}
