//! The CANopen network variables that a unit shows with its menu (AXTC4CO manual, section 4.1).
//!
//! Which these are and how they are worded is unknown. A number belongs to the label directly before it or to the unit
//! directly after it; one that is only on the same line may be anything: a time, an index of a table of bit rates.

use super::words::{Words, number};

/// CANopen network variables, as far as a line names them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Network {
    /// Node-ID, 1 to 127.
    pub node_id: Option<u8>,
    /// Bit rate in kbit/s.
    pub can_kbps: Option<u16>,
    /// State.
    pub nmt_state: Option<NmtState>,
}

/// CANopen state of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtState {
    /// Configured by SDO, no PDOs.
    PreOperational,
    /// In normal service.
    Operational,
    /// No SDO, no PDOs.
    Stopped,
}

impl NmtState {
    /// The name CANopen uses.
    pub const fn name(self) -> &'static str {
        match self {
            NmtState::PreOperational => "pre-operational",
            NmtState::Operational => "operational",
            NmtState::Stopped => "stopped",
        }
    }
}

/// Bit rates of CANopen in kbit/s (CiA 301).
const RATES: [u64; 9] = [10, 20, 50, 100, 125, 250, 500, 800, 1000];
/// From this value on a number is in bit/s: none of [`RATES`] is as large in kbit/s.
const BITS: u64 = 10_000;

/// Network variables a line names.
pub(super) fn network(words: &Words) -> Option<Network> {
    let words: Vec<&str> = words.iter().collect();
    let network = Network { node_id: node_id(&words), can_kbps: can_kbps(&words), nmt_state: nmt_state(&words) };
    (network != Network::default()).then_some(network)
}

fn has(words: &[&str], beginnings: &[&str]) -> bool {
    words.iter().any(|word| beginnings.iter().any(|beginning| word.starts_with(beginning)))
}

/// The number directly after `Node-ID`, `node`, or where the line speaks of a network, `id`.
fn node_id(words: &[&str]) -> Option<u8> {
    let speaks_of_network = has(words, &["network", "can", "nmt"]);
    let is_label = |word: &str| match word {
        "nodes" => false,
        "id" => speaks_of_network,
        _ => word.starts_with("node"),
    };
    let fillers = ["id", "is", "number", "no", "nr", "address", "addr", "hex", "hexadecimal", "dec", "decimal"];
    let behind = |label: usize| {
        let at = label + 1 + words[label + 1..].iter().take_while(|word| fillers.contains(word)).count();
        let of_a_rate = rate_unit(words, at).is_some() || words.get(at + 1).is_some_and(|unit| is_time(unit));
        let word = *words.get(at)?;
        let number = number(word).or_else(|| bare_hexadecimal(word)).filter(|_| !of_a_rate)?;
        u8::try_from(number).ok().filter(|node_id| (1..=127).contains(node_id))
    };
    (0..words.len()).filter(|&at| is_label(words[at])).find_map(behind)
}

/// `7F`: no other way of writing a node-ID looks like that. Two letters may be a word.
fn bare_hexadecimal(word: &str) -> Option<u64> {
    let [high @ b'0'..=b'7', b'a'..=b'f'] = word.as_bytes() else { return None };
    let low = u64::from_str_radix(&word[1..], 16).ok()?;
    Some(u64::from(high - b'0') * 16 + low)
}

fn is_time(word: &str) -> bool {
    matches!(word, "ms" | "s" | "sec" | "us" | "min")
}

/// The factor, in thousandths, of a unit of bit rates after the number at `at`: `kbit`, `k`, `Mbit`, `bit/s`. It may be
/// glued to the number. `Baud` after a small number is the next label, as in `ID=10 Baud=4`.
fn rate_unit(words: &[&str], at: usize) -> Option<(u64, u64)> {
    let word = *words.get(at)?;
    let digits = word.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let is_marked = number(word).is_some();
    let (digits, unit) = if digits.len() < word.len() && !is_marked {
        (digits, &word[digits.len()..])
    } else {
        (word, *words.get(at + 1)?)
    };
    let value = number(digits)?;
    let thousandths = match unit {
        "k" | "kb" | "kbd" | "kbit" | "kbits" | "kbps" | "kbaud" | "kbauds" => 1000,
        "m" | "mb" | "mbd" | "mbit" | "mbits" | "mbps" | "mbaud" => 1_000_000,
        "bit" | "bits" | "bps" | "baud" | "bd" if value >= BITS => 1,
        _ => return None,
    };
    Some((value, thousandths))
}

/// The bit rate: the number with such a unit, or the one directly after a name for it. If there are several, only one
/// with a name counts: the others may be limits.
fn can_kbps(words: &[&str]) -> Option<u16> {
    if has(words, &["rs", "serial", "uart", "115200"]) {
        return None;
    }
    let speaks_of_rate = has(words, &["baud", "kbit", "kbps", "kbaud", "kb", "mbit", "mbps", "bitrate"])
        || words.windows(2).any(|pair| matches!(pair, ["bit", "s" | "rate"]))
        || words.iter().any(|word| word.ends_with("kbit") || word.ends_with("bps") || word.ends_with("kbaud"));
    if !speaks_of_rate {
        return None;
    }
    let mut called = Vec::new();
    let mut others = Vec::new();
    for (at, word) in words.iter().enumerate() {
        let is_called = is_called_rate(&words[..at]);
        let kbps = match rate_unit(words, at) {
            Some((value, thousandths)) => value.checked_mul(thousandths).map(|bits| bits / 1000),
            None if is_called && !words.get(at + 1).is_some_and(|unit| is_time(unit)) => {
                number(word).map(|value| if value >= BITS { value / 1000 } else { value })
            }
            None => None,
        };
        if let Some(kbps) = kbps.filter(|kbps| RATES.contains(kbps)) {
            if is_called { called.push(kbps) } else { others.push(kbps) }
        }
    }
    let one = |rates: &[u64]| rates.first().copied().filter(|first| rates.iter().all(|rate| rate == first));
    let rate = if called.is_empty() { one(&others) } else { one(&called) };
    rate.and_then(|kbps| u16::try_from(kbps).ok())
}

/// Whether these words end with a name of a bit rate. One of several names before several numbers does not count, as in
/// `Node-ID, baud rate: 10, 125`.
fn is_called_rate(before: &[&str]) -> bool {
    let fillers = ["is", "can", "in", "rate", "kbit", "kbits", "kbps", "kbaud", "s", "sec"];
    let fillers = before.iter().rev().take_while(|word| fillers.contains(word)).count();
    let (named, filled) = before.split_at(before.len() - fillers);
    let Some((name, earlier)) = named.split_last() else { return false };
    let is_name = name.starts_with("baud")
        || matches!(*name, "bitrate" | "datarate")
        || (matches!(*name, "bit" | "data") && filled.first() == Some(&"rate"));
    let among_names = earlier.last().is_some_and(|word| *word == "id" || word.starts_with("node"));
    is_name && !among_names
}

/// The state: what is called so, or is the only one on the line. What a unit is set to do later is not its state.
fn nmt_state(words: &[&str]) -> Option<NmtState> {
    // `Start in Operational Mode` is object 5555h; it says nothing about the present state.
    if words.windows(2).any(|pair| pair[0].ends_with("start") && pair[1] == "in")
        || words.windows(2).any(|pair| pair[0].ends_with("starting") && pair[1] == "in")
    {
        return None;
    }
    let is_named = words.iter().any(|word| ["state", "nmt", "mode"].iter().any(|name| word.contains(name)));
    let later = ["start", "startup", "autostart", "auto", "power", "default", "boot", "initial", "after", "not", "non"];
    let mut found: Vec<(NmtState, bool)> = Vec::new();
    for (at, word) in words.iter().enumerate() {
        let behind_pre = at > 0 && words[at - 1] == "pre";
        let state = if word.contains("preop") || behind_pre && word.starts_with("op") {
            NmtState::PreOperational
        } else if is_named && word.contains("operational") {
            NmtState::Operational
        } else if is_named && word.contains("stopped") {
            NmtState::Stopped
        } else {
            continue;
        };
        let before = &words[..at - usize::from(behind_pre)];
        let is_state = |word: &&str| matches!(*word, "state" | "status" | "mode" | "nmt" | "nmtstate");
        let fillers = before.iter().rev().take_while(|word| matches!(**word, "is" | "can" | "canopen")).count();
        let nearest = before.len() - fillers;
        let is_called = before[..nearest].last().is_some_and(is_state);
        // `auto start: pre-operational`, `default state operational`.
        let label = &before[nearest.saturating_sub(2)..nearest];
        if label.iter().any(|word| later.contains(word)) {
            continue;
        }
        found.push((state, is_called));
    }
    let one = |states: Vec<NmtState>| {
        let first = states.first().copied()?;
        states.iter().all(|state| *state == first).then_some(first)
    };
    let called: Vec<NmtState> = found.iter().filter(|(_, called)| *called).map(|(state, _)| *state).collect();
    if called.is_empty() { one(found.into_iter().map(|(state, _)| state).collect()) } else { one(called) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(line: &str) -> Option<Network> {
        network(&Words::of(line))
    }

    #[test]
    fn network_variables_are_read_in_many_spellings() {
        let pre = Some(NmtState::PreOperational);
        let operational = Some(NmtState::Operational);
        let table = [
            ("Node-ID: 127 (0x7F)", Some(127), None, None),
            ("NODE ID = 7Fh, 125 kbit/s", Some(127), Some(125), None),
            ("CAN baudrate 250 kbps", None, Some(250), None),
            ("Bit rate: 1 Mbit/s", None, Some(1000), None),
            ("CAN bit rate 500000 bit/s", None, Some(500), None),
            ("Baudrate: 125k", None, Some(125), None),
            ("State: Pre-Operational", None, None, pre),
            ("NMT state OPERATIONAL", None, None, operational),
            ("network: id=7Fh  125000 bit/s", Some(127), Some(125), None),
            ("Node 5 is PRE OPERATIONAL at 20 kbit/s", Some(5), Some(20), pre),
            ("node 7F rate 125", Some(127), None, None),
            ("Node 7F at 125 kbit/s", Some(127), Some(125), None),
            ("Node-ID 0x7F (127), baud index 4", Some(127), None, None),
            ("NodeID=10 Baud=4", Some(10), None, None),
            ("Node 127 Baud 250", Some(127), Some(250), None),
            ("Baud rate 3 (125 kbit/s)", None, Some(125), None),
            ("Baud rate (kbit/s): 125, node ID: 126", Some(126), Some(125), None),
            ("Node: 20 Rate: 125 kbit/s", Some(20), Some(125), None),
            ("Bit rate 1000000 bps, Node 5, state 5", Some(5), Some(1000), None),
            ("Bit rate 250 kbit/s (10 to 1000 kbit/s)", None, Some(250), None),
            ("This node: 125 kbit/s", None, Some(125), None),
            ("Node state 5, node-ID 126", Some(126), None, None),
            (
                "Heartbeat 125 ms, node 12 of 127, state operational (auto start: pre-operational)",
                Some(12),
                None,
                operational,
            ),
            ("Pre-operational; default state operational", None, None, pre),
        ];
        for (line, node_id, can_kbps, nmt_state) in table {
            let expected = Network { node_id, can_kbps, nmt_state };
            assert_eq!(read(line), Some(expected), "{line:?}");
        }
    }

    #[test]
    fn what_is_only_on_the_same_line_is_not_a_network_variable() {
        for line in [
            "RS-232: 115200 baud",
            "Node-ID: 300",
            "Node, rate: 127, 125",
            "Node-ID, baud rate: 10, 125",
            "Nodes: 5",
            "Node guarding 100",
            "1 Mbit/s or 20 kbit/s",
            "Baud rate index 4",
            "Uptime 127 s",
            "operational amplifier",
            "Auto start: pre-operational",
            "State is not operational",
            "  00h Start in Operational Mode = 0",
        ] {
            assert_eq!(read(line), None, "{line:?}");
        }
    }

    proptest! {
        #[test]
        fn a_number_that_nothing_names_changes_nothing(number in 0u32..2_000_000, word in "(up|count|errors|total)") {
            let line = format!("Node-ID 126, bit rate 250 kbit/s, {word} {number}");
            let expected = Network { node_id: Some(126), can_kbps: Some(250), nmt_state: None };
            prop_assert_eq!(read(&line), Some(expected));
        }

        #[test]
        fn words_in_any_order_give_nothing_but_what_they_say(
            line in "((node|id|7f|125|10|baud|rate|kbit|s|state|pre|operational|stopped|is|é|[0-9]{1,22}k?)[ :=]){0,12}"
        ) {
            let network = read(&line).unwrap_or_default();
            if let Some(node_id) = network.node_id {
                let spelled = [node_id.to_string(), format!("{node_id:x}")];
                prop_assert!((1..=127).contains(&node_id) && spelled.iter().any(|digits| line.contains(digits)), "{node_id}");
            }
            prop_assert!(network.can_kbps.is_none_or(|kbps| RATES.contains(&kbps.into())), "{:?}", network);
            let names_state = line.contains("operational") || line.contains("stopped");
            prop_assert!(network.nmt_state.is_none() || names_state, "{:?}", network);
        }
    }
}
