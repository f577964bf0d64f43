//! axcon: console and emulator for Axiomatic CANopen signal scanners.
//!
//! A cable has two ends, and both are the same kind of thing ([`endpoint`]): a machine that takes bytes and the time,
//! and gives bytes, a deadline and news. [`session`] is our end, [`emulator`] the device's. They share the formats the
//! manuals fix ([`wire`], [`image`]) and the knowledge of the products ([`device`]), and never name each other.
//! [`tui`] and [`cli`] are the two ways to use a session; [`host`] holds everything that touches the system.
//! `docs/architecture.md` has the map and the invariants.

pub mod time;

pub mod rng;

pub mod version;

pub mod endpoint;

pub mod secret;

pub mod record;

pub mod canopen;

pub mod wire;

pub mod image;

pub mod telnet;

pub mod device;

pub mod session;

pub mod dump;

pub mod monitor;

pub mod report;

pub mod emulator;

pub mod host;

pub mod tui;

pub mod cli;
