//! What can be done to an emulated unit from outside its serial port, one line each: on standard input, and in scenario
//! files.

use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::emulator::NmtCommand;
use crate::emulator::fault::Fault;
use crate::emulator::knob::{Knob, Lead};
use crate::emulator::words::{LONGEST_OFF_S, WordError, Words, shown, unknown};
use crate::time::Duration;

/// One deed.
#[derive(Clone, Debug, PartialEq)]
pub enum Verb {
    /// Turn a knob at the terminals.
    Turn(Knob),
    /// Switch the supply on.
    PowerOn,
    /// Switch the supply off.
    PowerOff,
    /// Switch the supply off and on again after this time.
    PowerCycle(Duration),
    /// Order something as the network's master.
    Nmt(NmtCommand),
    /// Write an entry of the object dictionary as the network does.
    Write(ObjectAddress, Value),
    /// Read an entry of the object dictionary as the network does.
    Read(ObjectAddress),
    /// Let something go wrong from now on.
    Fault(Fault),
    /// End all faults, those of the flash too, and plug the cable in.
    Heal,
    /// Plug the serial cable in.
    Plug,
    /// Pull the serial cable out.
    Unplug,
    /// Say what the unit does.
    Status,
}

/// All verbs with what they do, for help texts.
pub const HELP: &str = "set N temperature C        the sensor of input N has this temperature in °C, exactly
set N resistance OHM       it has this resistance (RTD)
set N microvolts UV        the input gets this voltage (thermocouple)
set N lead OHM             each of its wires has this resistance (RTD)
set cold-junction C        also: set supply V, set current MA
process N                  back to the default process; also: process cold-junction, supply, current
open N [A|B|C|GND]         break the sensor's circuit, or one lead (RTD)
short N                    short the sensor
repair N                   make the wires whole again
freeze, thaw               the converter delivers no new data, or does again
power on, power off        switch the supply; off loses all but flash and parameters
power cycle [SECONDS]      off and on again, after 1 second by default
nmt start|stop|pre-operational|reset|reset-communication
write INDEX:SUB VALUE      write an entry as the network does, e.g. write 6112:1 0
read INDEX:SUB             read one
fault WHAT ...             let something go wrong; 'fault' alone says what there is
heal                       end all faults
unplug, plug               pull the serial cable, or plug it in again
status                     what the unit does";

/// What can be set and set free: an input by its number, or something there is one of.
const TERMINALS: &str = "1, cold-junction, supply, current";

/// How long the supply is off by default.
const USUAL_CYCLE: Duration = Duration::from_secs(1);

impl Verb {
    /// Reads a line for a unit of a product, in any case of its letters.
    ///
    /// # Errors
    /// If it is not a verb, with the column.
    pub fn read(line: &str, product: &Product) -> Result<Verb, WordError> {
        let mut words = Words::of(line);
        let verb = Verb::parse(&mut words, product)?;
        words.end()?;
        Ok(verb)
    }

    fn parse(words: &mut Words<'_>, product: &Product) -> Result<Verb, WordError> {
        let verbs = "set, process, open, short, repair, freeze, thaw, power, nmt, write, read, fault, heal, unplug, plug, status";
        let (column, word) = words.require("a verb", verbs)?;
        match word.to_ascii_lowercase().as_str() {
            "set" => Verb::set(words),
            "process" => match words.require("an input or a quantity", TERMINALS)? {
                (_, word) if word.eq_ignore_ascii_case("cold-junction") => Ok(Verb::Turn(Knob::ColdJunction(None))),
                (_, word) if word.eq_ignore_ascii_case("supply") => Ok(Verb::Turn(Knob::Supply(None))),
                (_, word) if word.eq_ignore_ascii_case("current") => Ok(Verb::Turn(Knob::SourceCurrent(None))),
                (column, word) => input(column, word).map(Knob::Process).map(Verb::Turn),
            },
            "open" => {
                let number = words.input()?;
                let lead = words.take().map(|(column, word)| lead(column, word)).transpose()?;
                Ok(Verb::Turn(Knob::Open(number, lead)))
            }
            "short" => words.input().map(Knob::Short).map(Verb::Turn),
            "repair" => words.input().map(Knob::Repair).map(Verb::Turn),
            "freeze" => Ok(Verb::Turn(Knob::Freeze(true))),
            "thaw" => Ok(Verb::Turn(Knob::Freeze(false))),
            "power" => {
                let (column, word) = words.require("what to do with the supply", "on, off, cycle")?;
                match word.to_ascii_lowercase().as_str() {
                    "on" => Ok(Verb::PowerOn),
                    "off" => Ok(Verb::PowerOff),
                    "cycle" => words.cycle().map(Verb::PowerCycle),
                    _ => Err(unknown(column, word, "on, off, cycle")),
                }
            }
            "nmt" => {
                let orders = "start, stop, pre-operational, reset, reset-communication";
                let (column, word) = words.require("an order", orders)?;
                match word.to_ascii_lowercase().as_str() {
                    "start" => Ok(Verb::Nmt(NmtCommand::Start)),
                    "stop" => Ok(Verb::Nmt(NmtCommand::Stop)),
                    "pre-operational" => Ok(Verb::Nmt(NmtCommand::PreOperational)),
                    "reset" => Ok(Verb::Nmt(NmtCommand::ResetNode)),
                    "reset-communication" => Ok(Verb::Nmt(NmtCommand::ResetCommunication)),
                    _ => Err(unknown(column, word, orders)),
                }
            }
            "write" => {
                let at = words.entry(product)?;
                let data_type = product.dictionary.entry(at).map(|entry| entry.data_type);
                let (column, word) = words.require("a value", "a number, true, false")?;
                let value = data_type.and_then(|data_type| data_type.parse(word)).ok_or_else(|| WordError {
                    column,
                    message: format!("'{}' is not a value of {at}", shown(word)),
                })?;
                Ok(Verb::Write(at, value))
            }
            "read" => words.entry(product).map(Verb::Read),
            "fault" => Fault::parse(words, product).map(Verb::Fault),
            "heal" => Ok(Verb::Heal),
            "unplug" => Ok(Verb::Unplug),
            "plug" => Ok(Verb::Plug),
            "status" => Ok(Verb::Status),
            _ => Err(unknown(column, word, verbs)),
        }
    }

    fn set(words: &mut Words<'_>) -> Result<Verb, WordError> {
        let (column, word) = words.require("an input or a quantity", TERMINALS)?;
        let knob = match word.to_ascii_lowercase().as_str() {
            "cold-junction" => Knob::ColdJunction(Some(words.number("a temperature in °C")?)),
            "supply" => Knob::Supply(Some(words.number("a voltage in V")?)),
            "current" => Knob::SourceCurrent(Some(words.number("a current in mA")?)),
            _ => {
                let number = input(column, word)?;
                let quantities = "temperature, resistance, microvolts, lead";
                let (column, word) = words.require("a quantity", quantities)?;
                match word.to_ascii_lowercase().as_str() {
                    "temperature" => Knob::Temperature(number, words.number("a temperature in °C")?),
                    "resistance" => Knob::Resistance(number, words.number("a resistance in ohm")?),
                    "microvolts" => Knob::Microvolts(number, words.number("a voltage in µV")?),
                    "lead" => Knob::LeadResistance(number, words.number("a resistance in ohm")?),
                    _ => return Err(unknown(column, word, quantities)),
                }
            }
        };
        Ok(Verb::Turn(knob))
    }
}

impl Words<'_> {
    fn input(&mut self) -> Result<u8, WordError> {
        let (column, word) = self.require("an input", "its number, from 1")?;
        input(column, word)
    }

    fn cycle(&mut self) -> Result<Duration, WordError> {
        if self.is_over() { Ok(USUAL_CYCLE) } else { self.seconds(LONGEST_OFF_S) }
    }

    fn entry(&mut self, product: &Product) -> Result<ObjectAddress, WordError> {
        let (column, word) = self.require("an entry", "index and sub-index, e.g. 6112:1")?;
        let at: ObjectAddress = word.parse().map_err(|_| WordError {
            column,
            message: format!("'{}' is not an entry: write index and sub-index, e.g. 6112:1", shown(word)),
        })?;
        if product.dictionary.entry(at).is_none() {
            return Err(WordError { column, message: format!("an {} has no entry {at}", product.name) });
        }
        Ok(at)
    }
}

fn input(column: usize, word: &str) -> Result<u8, WordError> {
    word.parse().ok().filter(|&number| number > 0).ok_or_else(|| WordError {
        column,
        message: format!("'{}' is not an input: write its number, from 1", shown(word)),
    })
}

fn lead(column: usize, word: &str) -> Result<Lead, WordError> {
    match word.to_ascii_lowercase().as_str() {
        "a" => Ok(Lead::A),
        "b" => Ok(Lead::B),
        "c" => Ok(Lead::C),
        "gnd" => Ok(Lead::Ground),
        _ => Err(unknown(column, word, "A, B, C, GND")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::fault::Setting;
    use proptest::prelude::*;

    fn read(line: &str) -> Result<Verb, String> {
        let product = Product::named("AXRTD8CO").expect("built in");
        Verb::read(line, product).map_err(|error| error.to_string())
    }

    #[test]
    fn every_verb_is_read_in_any_case() {
        let at = |index, sub| ObjectAddress::new(index, sub);
        let table = [
            ("set 1 temperature 250.0", Verb::Turn(Knob::Temperature(1, 250.0))),
            ("SET 8 Resistance 1e2", Verb::Turn(Knob::Resistance(8, 100.0))),
            ("set 2 microvolts -500", Verb::Turn(Knob::Microvolts(2, -500.0))),
            ("set 2 lead 2", Verb::Turn(Knob::LeadResistance(2, 2.0))),
            ("set cold-junction 25", Verb::Turn(Knob::ColdJunction(Some(25.0)))),
            ("set supply 24", Verb::Turn(Knob::Supply(Some(24.0)))),
            ("set current 4", Verb::Turn(Knob::SourceCurrent(Some(4.0)))),
            ("process 3", Verb::Turn(Knob::Process(3))),
            ("process supply", Verb::Turn(Knob::Supply(None))),
            ("  open   3 ", Verb::Turn(Knob::Open(3, None))),
            ("open 3 gnd", Verb::Turn(Knob::Open(3, Some(Lead::Ground)))),
            ("short 1", Verb::Turn(Knob::Short(1))),
            ("repair 1", Verb::Turn(Knob::Repair(1))),
            ("freeze", Verb::Turn(Knob::Freeze(true))),
            ("thaw", Verb::Turn(Knob::Freeze(false))),
            ("power OFF", Verb::PowerOff),
            ("power cycle", Verb::PowerCycle(Duration::from_secs(1))),
            ("power cycle 0.5", Verb::PowerCycle(Duration::from_millis(500))),
            ("nmt start", Verb::Nmt(NmtCommand::Start)),
            ("nmt pre-operational", Verb::Nmt(NmtCommand::PreOperational)),
            ("write 6112:1 0", Verb::Write(at(0x6112, 1), Value::Unsigned8(0))),
            ("write 5555 true", Verb::Write(at(0x5555, 0), Value::Boolean(true))),
            ("write 6126h:2 18.5", Verb::Write(at(0x6126, 2), Value::Real32(18.5))),
            ("write 4000:1 -300", Verb::Write(at(0x4000, 1), Value::Integer16(-300))),
            ("write 1010:1 0x65766173", Verb::Write(at(0x1010, 1), Value::Unsigned32(0x6576_6173))),
            ("read 6100:1", Verb::Read(at(0x6100, 1))),
            ("fault queue 64", Verb::Fault(Fault::Adapter(Setting::Queue(64)))),
            ("heal", Verb::Heal),
            ("unplug", Verb::Unplug),
            ("plug", Verb::Plug),
            ("status", Verb::Status),
        ];
        for (line, verb) in table {
            assert_eq!(read(line), Ok(verb), "{line}");
        }
    }

    #[test]
    fn a_bad_line_is_answered_with_the_column_and_what_there_is() {
        let table = [
            ("", "column 1: a verb is missing: set, process, open"),
            ("explode", "column 1: 'explode' is not known; there is: set, process, open"),
            ("open\x1b[2J", "column 1: 'open^[[2J' is not known"),
            ("open", "column 5: an input is missing"),
            ("open 0", "column 6: '0' is not an input: write its number, from 1"),
            ("open 3 D", "column 8: 'D' is not known; there is: A, B, C, GND"),
            ("set 1", "column 6: a quantity is missing: temperature, resistance, microvolts, lead"),
            ("set 1 pressure 3", "column 7: 'pressure' is not known; there is: temperature"),
            ("set 1 temperature", "column 18: a temperature in °C is missing: a number"),
            ("set 1 temperature hot", "column 19: 'hot' is not a temperature in °C: write a number like 23.5"),
            ("set 1 temperature inf", "column 19: 'inf' is not a temperature in °C"),
            ("set 1 temperature 20 C", "column 22: 'C' is too much: the line is complete before it"),
            ("power", "column 6: what to do with the supply is missing: on, off, cycle"),
            ("power cycle 1e99", "column 13: '1e99' is not 0 to 86400 seconds"),
            ("power cycle -1", "column 13: '-1' is not 0 to 86400 seconds"),
            ("nmt go", "column 5: 'go' is not known; there is: start, stop, pre-operational, reset"),
            ("write 6112", "column 11: a value is missing"),
            ("write 6112:1 x", "column 14: 'x' is not a value of 6112:01"),
            ("write 6112:1 300", "column 14: '300' is not a value of 6112:01"),
            ("write 6112:9 1", "column 7: an AXRTD8CO has no entry 6112:09"),
            ("fault", "column 6: a fault is missing: lost, doubled"),
            ("fault queue -1", "column 13: '-1' is not 0 to 4096"),
            ("heal all", "column 6: 'all' is too much"),
            ("read zzz", "column 6: 'zzz' is not an entry: write index and sub-index, e.g. 6112:1"),
            ("read \x1b[2J", "column 6: '^[[2J' is not an entry"),
            ("write 6112:1 \u{9b}2J", "column 14: '‹9b›2J' is not a value of 6112:01"),
        ];
        for (line, complaint) in table {
            let found = read(line).expect_err(line);
            assert!(found.starts_with(complaint), "{line:?}: {found}");
        }
    }

    proptest! {
        #[test]
        fn any_line_is_read_or_refused(line in "\\PC{0,80}") {
            let _ = read(&line);
        }

        #[test]
        fn any_words_after_a_verb_are_read_or_refused(
            verb in "set|open|power cycle|nmt|write|read|process|fault lost|fault flash", rest in "[ 0-9a-z:.x-]{0,30}"
        ) {
            let _ = read(&format!("{verb} {rest}"));
        }
    }
}
