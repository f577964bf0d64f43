//! axcon: console and emulator for Axiomatic CANopen signal scanners.
//!
//! A cable has two ends, and both are the same kind of thing ([`endpoint`]): a machine that takes bytes and the time,
//! and gives bytes, a deadline and news. [`session`] is our end, [`emulator`] the device's. They share the formats the
//! manuals fix ([`wire`], [`image`]) and the knowledge of the products ([`device`]), and never name each other.
//! [`tui`] and [`cli`] are the two ways to use a session; [`host`] holds everything that touches the system.
//! `docs/architecture.md` has the map and the invariants.

// From the bottom up: a module uses only those above it. The blank lines keep rustfmt from sorting them by name.

pub mod time; // instants and durations as values; no clock

pub mod rng; // a seeded generator: the same seed, the same numbers, for ever

pub mod version; // software versions as units and files write them

pub mod endpoint; // the contract of both ends: bytes and the time in, bytes and a deadline out

pub mod secret; // the password: never shown, wiped when dropped

pub mod count; // numbers of things, as people read them

pub mod record; // the bytes of a session, in memory and on disk

pub mod canopen; // CANopen's vocabulary: typed values, entries, refusals

pub mod wire; // the text of the service port: chunks to lines, lines to messages

pub mod image; // image files: reading, checking, comparing, converting, making

pub mod telnet; // remote serial ports: telnet and RFC 2217, pure bytes

pub mod device; // what is known about each product, as data from its manual

pub mod session; // our end: commands in, bytes and events out

pub mod dump; // an object dictionary compared with its manual

pub mod monitor; // what a unit has shown, in bounded memory

pub mod report; // all of that on one page of HTML

pub mod emulator; // the device's end: power, firmware, measurement, loader, flash

pub mod host; // ports, the only clock, threads, files: all that touches the system

pub mod tui; // the console on the screen

pub mod cli; // the command line: a file for each command
