//! The cable, and what the faults make of the bytes on it: lost, doubled, changed, late.
//!
//! Pure: a byte goes in with the moment at which an undisturbed line would deliver it, and comes out when it arrives.
//! What follows a late byte waits for it, and then arrives at the line's rate, not all at once: what stalls is the
//! adapter, not the wire behind it.

use std::collections::VecDeque;

use super::super::uart::{XOFF, XON};
use super::{Deed, LineFault, Mishap, RecordFault, Setting, Way, When};
use crate::device::BAUD;
use crate::rng::Rng;
use crate::time::{Duration, Instant, character_time};

/// What arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// A byte.
    Byte(u8),
    /// Something whose stop bit is not where it should be.
    Unreadable,
}

/// The cable with what goes wrong on it.
#[derive(Debug)]
pub struct Middleman {
    chance: Rng,
    /// Line faults ordered so far: each gets a chance of its own.
    ordered: u64,
    line_faults: Vec<Ordered>,
    /// Each with the number of records still to come.
    record_faults: Vec<RecordFault>,
    latency: Duration,
    queue: usize,
    cable: Cable,
    to_unit: Delayed,
    to_client: ToClient,
    text: Text,
}

/// A line fault that is waiting to strike.
#[derive(Debug)]
struct Ordered {
    fault: LineFault,
    /// How many of what it counts have come.
    seen: u64,
    chance: Rng,
}

/// The most faults that wait to strike; an order beyond them is refused. A scenario that repeats orders its own each time.
pub const MOST_FAULTS: usize = 1_000;

/// The most bytes under way in one direction: more than the line carries in the longest lateness. What comes beyond is
/// lost, as in an adapter that is full; only faults that add up get there, such as every byte doubled.
const MOST_UNDER_WAY: usize = 1 << 20;

/// Where the plug is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cable {
    In,
    /// Plugged in again at this moment, or by hand.
    Out {
        back_at: Option<Instant>,
    },
}

/// Bytes in one direction.
#[derive(Debug, Default)]
struct Delayed {
    pending: VecDeque<(Instant, Arrival)>,
    /// When the last one arrives.
    last: Instant,
}

/// The direction in which the unit's flow control goes.
#[derive(Debug, Default)]
struct ToClient {
    bytes: Delayed,
    /// The next XON is lost.
    loses_xon: bool,
    /// The last flow control character that the client has got was XOFF.
    holds_client: bool,
}

/// What precedes the present character on its line, as far as counting records goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Text {
    Nothing,
    Record,
    Other,
}

/// What happens to a byte.
struct Fate {
    copies: u8,
    flipped: u8,
    unreadable: bool,
    late: Duration,
}

impl Middleman {
    /// A good cable; `seed` decides what chance decides.
    pub fn new(seed: u64) -> Self {
        Middleman {
            chance: Rng::new(seed).fork("faults"),
            ordered: 0,
            line_faults: Vec::new(),
            record_faults: Vec::new(),
            latency: Duration::ZERO,
            queue: 0,
            cable: Cable::In,
            to_unit: Delayed::default(),
            to_client: ToClient::default(),
            text: Text::Nothing,
        }
    }

    /// Orders a fault of the line.
    pub fn order_on_line(&mut self, fault: LineFault) {
        let chance = self.chance.fork(&self.ordered.to_string());
        self.ordered += 1;
        self.line_faults.push(Ordered { fault, seen: 0, chance });
    }

    /// Orders a deed at a record.
    pub fn order_at_record(&mut self, fault: RecordFault) {
        self.record_faults.push(fault);
    }

    /// Changes the adapter.
    pub fn set(&mut self, setting: Setting) {
        match setting {
            Setting::Latency(latency) => self.latency = latency,
            Setting::Queue(bytes) => self.queue = bytes,
        }
    }

    /// Faults that are waiting to strike.
    pub fn faults(&self) -> usize {
        self.line_faults.len() + self.record_faults.len()
    }

    /// Ends all faults, and plugs the cable in. What is late stays late.
    pub fn heal(&mut self) {
        self.line_faults.clear();
        self.record_faults.clear();
        self.latency = Duration::ZERO;
        self.queue = 0;
        self.to_client.loses_xon = false;
        self.plug();
    }

    /// Plugs the cable in.
    pub fn plug(&mut self) {
        self.cable = Cable::In;
    }

    /// Pulls the cable out, until this moment if one is given. What is on its way is lost, and so is what is known about
    /// flow control.
    pub fn unplug(&mut self, back_at: Option<Instant>) {
        self.cable = Cable::Out { back_at };
        self.to_unit = Delayed::default();
        self.to_client = ToClient::default();
    }

    /// Whether the cable is in.
    pub fn is_plugged(&self) -> bool {
        self.cable == Cable::In
    }

    /// Bytes that the adapter takes ahead of the line.
    pub fn queue(&self) -> usize {
        self.queue
    }

    /// Whether bytes may pass by without asking.
    pub fn is_idle(&self) -> bool {
        self.faults() == 0
            && self.latency.is_zero()
            && self.is_plugged()
            && !self.to_client.loses_xon
            && self.to_unit.pending.is_empty()
            && self.to_client.bytes.pending.is_empty()
    }

    /// Takes a byte that an undisturbed line would deliver now.
    pub fn carry(&mut self, now: Instant, way: Way, byte: u8) {
        if !self.is_plugged() {
            return;
        }
        let mut fate = Fate { copies: 1, flipped: 0, unreadable: false, late: Duration::ZERO };
        if way == Way::FromUnit && byte == XON && std::mem::take(&mut self.to_client.loses_xon) {
            fate.copies = 0;
        }
        let mut pulled = None;
        for ordered in &mut self.line_faults {
            if !ordered.counts(way, byte) || !ordered.strikes() {
                continue;
            }
            match ordered.fault {
                LineFault::Bytes { mishap, .. } => fate.suffer(mishap, &mut ordered.chance),
                LineFault::NoXon(_) => self.to_client.loses_xon = true,
                LineFault::Unplug { out, .. } => pulled = Some(out),
            }
        }
        self.line_faults.retain(|ordered| !ordered.is_over());
        if let Some(out) = pulled {
            self.unplug(out.map(|out| now + out));
            return;
        }
        let arrival = if fate.unreadable { Arrival::Unreadable } else { Arrival::Byte(byte ^ fate.flipped) };
        let at = now + self.latency + fate.late;
        let delayed = match way {
            Way::ToUnit => &mut self.to_unit,
            Way::FromUnit => &mut self.to_client.bytes,
        };
        for copy in 0..fate.copies {
            delayed.push(if copy == 0 { at } else { delayed.last + character_time(BAUD) }, arrival);
        }
    }

    /// What reaches the unit by now.
    pub fn next_to_unit(&mut self, now: Instant) -> Option<Arrival> {
        self.to_unit.pop(now)
    }

    /// What reaches the client by now.
    pub fn next_to_client(&mut self, now: Instant) -> Option<u8> {
        match self.to_client.bytes.pop(now)? {
            Arrival::Byte(byte) => Some(byte),
            // Orders of this kind are not taken.
            Arrival::Unreadable => None,
        }
    }

    /// The client has got these bytes.
    pub fn note_client_heard(&mut self, bytes: &[u8]) {
        if let Some(&last) = bytes.iter().rev().find(|byte| [XON, XOFF].contains(byte)) {
            self.to_client.holds_client = last == XOFF;
        }
    }

    /// The unit restarts, or another client has come: none is held.
    pub fn forget_hold(&mut self) {
        self.to_client.holds_client = false;
    }

    /// Whether the client has got XOFF and not yet XON.
    pub fn client_is_held(&self) -> bool {
        self.to_client.holds_client
    }

    /// The loader has got a character. Gives what happens to the unit if a record ends with it: a line that begins
    /// with S, at its CR or LF.
    pub fn note_loader_got(&mut self, arrival: Arrival) -> Vec<Deed> {
        let ends = matches!(arrival, Arrival::Byte(b'\r' | b'\n'));
        let was = self.text;
        self.text = match (was, arrival) {
            _ if ends => Text::Nothing,
            (Text::Nothing, Arrival::Byte(b'S')) => Text::Record,
            // Flow control before a line is not part of it.
            (Text::Nothing, Arrival::Byte(XON | XOFF)) => Text::Nothing,
            (Text::Nothing, _) => Text::Other,
            (Text::Record | Text::Other, _) => was,
        };
        if !(ends && was == Text::Record) {
            return Vec::new();
        }
        let is_due = |fault: &mut RecordFault| {
            fault.record = fault.record.saturating_sub(1);
            fault.record == 0
        };
        self.record_faults.extract_if(.., is_due).map(|fault| fault.deed).collect()
    }

    /// No loader runs: the next character it gets begins a line.
    pub fn note_no_loader(&mut self) {
        self.text = Text::Nothing;
    }

    /// When something arrives, or the cable is plugged in again.
    pub fn deadline(&self) -> Option<Instant> {
        let back_at = match self.cable {
            Cable::In => None,
            Cable::Out { back_at } => back_at,
        };
        [self.to_unit.next(), self.to_client.bytes.next(), back_at].into_iter().flatten().min()
    }

    /// Plugs the cable in again if it is time.
    pub fn handle_timeout(&mut self, now: Instant) {
        if matches!(self.cable, Cable::Out { back_at: Some(at) } if at <= now) {
            self.plug();
        }
    }
}

impl Ordered {
    /// Whether the fault counts such a byte.
    fn counts(&self, way: Way, byte: u8) -> bool {
        match self.fault {
            LineFault::Bytes { way: its_way, .. } | LineFault::Unplug { way: its_way, .. } => its_way == way,
            LineFault::NoXon(_) => way == Way::FromUnit && byte == XOFF,
        }
    }

    /// Counts one more; whether the fault strikes it.
    fn strikes(&mut self) -> bool {
        self.seen += 1;
        match self.when() {
            When::At(number) => self.seen == number,
            When::OneIn(number) => self.chance.below(number) == 0,
        }
    }

    /// Whether it will never strike again.
    fn is_over(&self) -> bool {
        match self.when() {
            When::At(number) => self.seen >= number,
            When::OneIn(_) => false,
        }
    }

    fn when(&self) -> When {
        match self.fault {
            LineFault::Bytes { when, .. } | LineFault::NoXon(when) => when,
            LineFault::Unplug { byte, .. } => When::At(byte),
        }
    }
}

impl Fate {
    fn suffer(&mut self, mishap: Mishap, chance: &mut Rng) {
        match mishap {
            Mishap::Lost => self.copies = 0,
            // What is lost cannot be doubled, whichever of the two was ordered first.
            Mishap::Doubled => self.copies = self.copies.saturating_mul(2),
            Mishap::Corrupted => self.flipped ^= 1 << chance.below(8),
            Mishap::Unreadable => self.unreadable = true,
            Mishap::Late(late) => self.late += late,
        }
    }
}

impl Delayed {
    fn push(&mut self, at: Instant, arrival: Arrival) {
        if self.pending.len() == MOST_UNDER_WAY {
            return;
        }
        self.last = if self.last > at { self.last + character_time(BAUD) } else { at };
        self.pending.push_back((self.last, arrival));
    }

    fn next(&self) -> Option<Instant> {
        self.pending.front().map(|&(at, _)| at)
    }

    fn pop(&mut self, now: Instant) -> Option<Arrival> {
        let &(at, arrival) = self.pending.front()?;
        if at > now {
            return None;
        }
        self.pending.pop_front();
        Some(arrival)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Fault;
    use super::*;
    use crate::device::Product;

    fn middleman(faults: &[&str]) -> Middleman {
        let product = Product::named("AXTC4CO").expect("built in");
        let mut middleman = Middleman::new(1);
        for fault in faults {
            match Fault::read(fault, product).expect(fault) {
                Fault::Line(fault) => middleman.order_on_line(fault),
                Fault::Record(fault) => middleman.order_at_record(fault),
                Fault::Adapter(setting) => middleman.set(setting),
                Fault::Flash { .. } => panic!("{fault} is not on the cable"),
            }
        }
        middleman
    }

    /// Sends bytes a millisecond apart and gives what arrives, with its moment in ms.
    fn carried(middleman: &mut Middleman, way: Way, bytes: &[u8]) -> Vec<(f64, Arrival)> {
        for (number, &byte) in bytes.iter().enumerate() {
            middleman.carry(Instant::from_millis(number as u64), way, byte);
        }
        let mut found = Vec::new();
        while let Some(at) = middleman.deadline() {
            let arrival = match way {
                Way::ToUnit => middleman.next_to_unit(at),
                Way::FromUnit => middleman.next_to_client(at).map(Arrival::Byte),
            };
            found.push((at.since(Instant::ZERO).as_secs_f64() * 1e3, arrival.expect("due")));
        }
        found
    }

    fn text(carried: &[(f64, Arrival)]) -> String {
        let character = |&(_, arrival): &(f64, Arrival)| match arrival {
            Arrival::Byte(byte) => char::from(byte),
            Arrival::Unreadable => '?',
        };
        carried.iter().map(character).collect()
    }

    #[test]
    fn a_byte_is_lost_doubled_or_unreadable_on_its_way_only() {
        let faults = ["lost to-unit at byte 2", "doubled to-unit at byte 3", "unreadable to-unit at byte 4"];
        let mut cable = middleman(&faults);
        assert_eq!(text(&carried(&mut cable, Way::FromUnit, b"abcde")), "abcde");
        assert_eq!(text(&carried(&mut cable, Way::ToUnit, b"abcdeabcde")), "acc?eabcde");
        assert!(cable.is_idle(), "all has happened");
    }

    #[test]
    fn a_byte_that_is_doubled_again_and_again_has_an_end() {
        let mut cable = middleman(&["doubled to-unit one in 1"; 9]);
        assert_eq!(carried(&mut cable, Way::ToUnit, b"a").len(), 255);
        for _ in 0..MOST_UNDER_WAY / 255 + 2 {
            cable.carry(Instant::ZERO, Way::ToUnit, b'a');
        }
        assert_eq!(cable.to_unit.pending.len(), MOST_UNDER_WAY);
    }

    #[test]
    fn one_bit_of_a_corrupted_byte_is_turned_over() {
        let arrivals = carried(&mut middleman(&["corrupted from-unit one in 1"]), Way::FromUnit, &[0x55; 64]);
        let mut bits = [0; 8];
        for (_, arrival) in arrivals {
            let Arrival::Byte(byte) = arrival else { panic!("readable") };
            assert_eq!((byte ^ 0x55).count_ones(), 1);
            bits[(byte ^ 0x55).trailing_zeros() as usize] += 1;
        }
        assert!(bits.iter().all(|&count| count > 0), "any of them: {bits:?}");
    }

    #[test]
    fn chance_strikes_as_often_as_it_should_and_the_same_ones_for_a_seed() {
        let lost = |faults: &[&str]| {
            let sent: Vec<u8> = (0..20_000u32).map(|number| number as u8).collect();
            text(&carried(&mut middleman(faults), Way::ToUnit, &sent))
        };
        let once = lost(&["lost to-unit one in 100"]);
        assert!((19_750..19_850).contains(&once.chars().count()), "{}", once.chars().count());
        assert_eq!(once, lost(&["lost to-unit one in 100"]));
        assert_eq!(once, lost(&["lost to-unit one in 100", "corrupted from-unit one in 7"]), "one more moves none");
        assert_ne!(once, lost(&["corrupted from-unit one in 7", "lost to-unit one in 100"]), "each has its own chance");
    }

    #[test]
    fn what_follows_a_late_byte_waits_for_it_and_follows_at_the_lines_rate() {
        let arrivals = carried(&mut middleman(&["late to-unit at byte 2 by 10"]), Way::ToUnit, &[b'x'; 16]);
        let moments: Vec<f64> = arrivals.iter().map(|&(at, _)| (at * 10.0).round() / 10.0).collect();
        // Ten wait, and arrive one character time (0.087 ms) apart; the 13th has caught up.
        assert_eq!(moments[..4], [0.0, 11.0, 11.1, 11.2]);
        assert_eq!(moments[12..], [12.0, 13.0, 14.0, 15.0], "{moments:?}");
    }

    #[test]
    fn latency_delays_all_and_loses_nothing() {
        for way in [Way::ToUnit, Way::FromUnit] {
            let arrivals = carried(&mut middleman(&["latency 16"]), way, b"abc");
            assert_eq!(arrivals.iter().map(|&(at, _)| at).collect::<Vec<_>>(), [16.0, 17.0, 18.0]);
        }
    }

    #[test]
    fn the_xon_after_a_counted_xoff_is_lost() {
        let mut cable = middleman(&["no-xon at xoff 2"]);
        assert_eq!(text(&carried(&mut cable, Way::ToUnit, b"\x13\x11")), "\x13\x11", "the client's own does not count");
        let said = text(&carried(&mut cable, Way::FromUnit, b"\x13a\x11\x13b\x11c\x13\x11"));
        assert_eq!(said, "\x13a\x11\x13bc\x13\x11");
        cable.note_client_heard(b"\x13b");
        assert!(cable.client_is_held());
        cable.note_client_heard(b"c");
        assert!(cable.client_is_held());
        cable.note_client_heard(b"\x13\x11");
        assert!(!cable.client_is_held());
    }

    #[test]
    fn a_pulled_cable_carries_nothing_in_either_direction_until_it_is_in_again() {
        let mut cable = middleman(&["latency 5", "unplug to-unit at byte 3 for 0.1"]);
        let at = Instant::from_millis;
        cable.carry(at(0), Way::FromUnit, b'!');
        for (ms, byte) in (1..).zip(*b"abcd") {
            cable.carry(at(ms), Way::ToUnit, byte);
        }
        assert_eq!((cable.next_to_unit(at(90)), cable.next_to_client(at(90))), (None, None), "what was on its way");
        assert_eq!((cable.is_plugged(), cable.deadline()), (false, Some(at(103))));
        cable.handle_timeout(at(103));
        cable.carry(at(104), Way::ToUnit, b'e');
        assert_eq!((cable.is_plugged(), cable.next_to_unit(at(109))), (true, Some(Arrival::Byte(b'e'))));
        cable.unplug(None);
        assert_eq!(cable.deadline(), None, "nobody plugs it in");
        cable.heal();
        assert!(cable.is_plugged() && cable.is_idle());
    }

    #[test]
    fn what_was_late_or_awaited_when_the_cable_was_pulled_is_forgotten() {
        let mut cable = middleman(&["latency 5", "late to-unit at byte 1 by 60000", "no-xon at xoff 1"]);
        let at = Instant::from_millis;
        cable.carry(at(0), Way::ToUnit, b'm');
        cable.carry(at(0), Way::FromUnit, XOFF);
        cable.note_client_heard(&[XOFF]);
        cable.unplug(None);
        assert!(!cable.client_is_held());
        cable.plug();
        cable.carry(at(100), Way::ToUnit, b'm');
        cable.carry(at(100), Way::FromUnit, XON);
        assert_eq!(cable.next_to_unit(at(105)), Some(Arrival::Byte(b'm')));
        assert_eq!(cable.next_to_client(at(105)), Some(XON));
        assert_eq!(cable.deadline(), None);
    }

    #[test]
    fn records_are_counted_at_their_line_ends_and_nothing_else_is() {
        let mut cable = middleman(&["reset at record 2", "power-cut at record 3 for 1", "reset at record 4"]);
        let mut got = |text: &str| -> Vec<Deed> {
            text.bytes().flat_map(|byte| cable.note_loader_got(Arrival::Byte(byte))).collect()
        };
        assert_eq!(got("m\r\r\nS0030000FC"), [], "no line end yet");
        assert_eq!(got("\r\n"), [], "the first");
        assert_eq!(got("no S record\r\x11S3\r"), [Deed::Reset]);
        assert_eq!(got("S3\n"), [Deed::PowerCut(Some(Duration::from_secs(1)))]);
        assert_eq!(got("S3\r\nS3\r\n"), [Deed::Reset]);
    }
}
