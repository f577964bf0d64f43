//! The CANopen node's state (CiA 301, NMT): what changes it, and when it changes by itself.
//!
//! The node starts pre-operational. It is not operational before the first valid data (manuals, section 1.1); what
//! becomes of a start that comes earlier is the product's. With object 5555h set it becomes operational by itself, 5 s
//! after its start (section 3.4). Errors move it as object 1029h says.

use crate::device::{EarlyStart, Product};
use crate::time::{Duration, Instant};

/// State of the CANopen node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkState {
    /// After power-up; SDO only.
    PreOperational,
    /// With process data.
    Operational,
    /// Nothing but node control.
    Stopped,
}

/// What a network master may order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtCommand {
    /// Become operational.
    Start,
    /// Become stopped.
    Stop,
    /// Become pre-operational.
    PreOperational,
    /// Restart the application.
    ResetNode,
    /// Restart the communication, with its stored parameters.
    ResetCommunication,
}

/// From the start to operational without a master, with 5555h set (section 3.4).
const AUTONOMOUS_AFTER: Duration = Duration::from_secs(5);

/// The node's state and what is planned for it.
#[derive(Clone, Debug)]
pub struct Network {
    state: NetworkState,
    ready_at: Instant,
    early_start: EarlyStart,
    /// When it becomes operational by itself.
    start_at: Option<Instant>,
}

impl Network {
    /// The node of a unit that starts now.
    pub fn start(now: Instant, product: &Product, autonomous: bool) -> Self {
        Network {
            state: NetworkState::PreOperational,
            ready_at: now + Duration::from_millis(u64::from(product.measurement.first_data_ms)),
            early_start: product.measurement.early_start,
            start_at: autonomous.then(|| now + AUTONOMOUS_AFTER),
        }
    }

    /// The state.
    pub fn state(&self) -> NetworkState {
        self.state
    }

    /// When something is planned.
    pub fn deadline(&self) -> Option<Instant> {
        self.start_at
    }

    /// Does what is planned for now.
    pub fn step(&mut self, now: Instant) {
        if self.start_at.is_some_and(|due| due <= now) {
            self.start_at = None;
            self.state = NetworkState::Operational;
        }
    }

    /// Goes on after it was halted for a time: what was planned comes that much later, and not before the first data,
    /// which may come later too.
    pub fn resume(&mut self, halted: Duration, first_data_at: Instant) {
        self.ready_at = first_data_at;
        self.start_at = self.start_at.map(|due| first_data_at.max(due + halted));
    }

    /// Carries out an order; resets are the application's affair and only end what was planned.
    pub fn command(&mut self, now: Instant, command: NmtCommand) {
        match command {
            NmtCommand::Start if now >= self.ready_at => {
                self.start_at = None;
                self.state = NetworkState::Operational;
            }
            NmtCommand::Start if self.early_start == EarlyStart::Deferred => self.start_at = Some(self.ready_at),
            NmtCommand::Start => {}
            // An order cancels what was planned (errata E-81, E-98).
            NmtCommand::Stop => {
                self.start_at = None;
                self.state = NetworkState::Stopped;
            }
            NmtCommand::PreOperational | NmtCommand::ResetNode | NmtCommand::ResetCommunication => {
                self.start_at = None;
                self.state = NetworkState::PreOperational;
            }
        }
    }

    /// An error has become active: object 1029h says what the node does. Where that puts it it stays until a master says
    /// otherwise (errata E-72, E-D15): what was planned no longer counts.
    pub fn react(&mut self, reaction: i64) {
        let state = match (reaction, self.state) {
            (0, NetworkState::Operational) => NetworkState::PreOperational,
            (2, _) => NetworkState::Stopped,
            _ => return,
        };
        self.state = state;
        self.start_at = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(name: &str, autonomous: bool) -> Network {
        Network::start(Instant::ZERO, Product::named(name).expect("built in"), autonomous)
    }

    fn at(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    // B-021, B-023, B-024, B-025, B-026, B-107, B-108
    #[test]
    fn a_start_before_the_first_data_waits_or_is_lost() {
        for (name, ready_ms, waits) in [("AXTC4CO", 3_000, true), ("AXRTD8CO", 5_000, false)] {
            let mut network = network(name, false);
            assert_eq!((network.state(), network.deadline()), (NetworkState::PreOperational, None));
            network.command(at(1_000), NmtCommand::Start);
            network.step(at(ready_ms - 1));
            assert_eq!(network.state(), NetworkState::PreOperational);
            network.step(at(ready_ms));
            assert_eq!(network.state() == NetworkState::Operational, waits, "{name}");
            network.command(at(ready_ms + 1), NmtCommand::Start);
            assert_eq!(network.state(), NetworkState::Operational);
        }
        let mut network = network("AXTC4CO", false);
        network.command(at(1_000), NmtCommand::Start);
        network.command(at(2_000), NmtCommand::PreOperational);
        network.step(at(4_000));
        assert_eq!(network.state(), NetworkState::PreOperational, "the later order counts");
    }

    // B-027, B-109
    #[test]
    fn it_starts_by_itself_five_seconds_after_power_up_and_not_before() {
        for name in ["AXTC4CO", "AXRTD8CO"] {
            let mut network = network(name, true);
            assert_eq!(network.deadline(), Some(at(5_000)));
            network.step(at(4_999));
            assert_eq!(network.state(), NetworkState::PreOperational);
            network.step(at(5_000));
            assert_eq!((network.state(), network.deadline()), (NetworkState::Operational, None));
        }
        let mut network = network("AXTC4CO", true);
        network.command(at(4_000), NmtCommand::Stop);
        network.step(at(6_000));
        assert_eq!(network.state(), NetworkState::Stopped, "an order cancels it");
    }

    // E-110: while the view is open nothing is measured, so nothing becomes valid either.
    #[test]
    fn what_is_planned_comes_later_by_the_time_the_view_was_open() {
        let mut early = network("AXTC4CO", true);
        early.resume(Duration::from_secs(10), at(13_000));
        assert_eq!(early.deadline(), Some(at(15_000)));
        early.command(at(12_000), NmtCommand::Start);
        assert_eq!((early.state(), early.deadline()), (NetworkState::PreOperational, Some(at(13_000))));
        let mut late = network("AXTC4CO", false);
        late.resume(Duration::from_secs(10), at(3_000));
        late.command(at(14_000), NmtCommand::Start);
        assert_eq!(late.state(), NetworkState::Operational, "the first data were there before");
    }

    #[test]
    fn an_error_that_stops_the_node_cancels_its_start() {
        let mut network = network("AXTC4CO", true);
        network.react(0);
        assert_eq!(network.deadline(), Some(at(5_000)), "it was not operational: errata E-74");
        network.react(2);
        network.step(at(6_000));
        assert_eq!((network.state(), network.deadline()), (NetworkState::Stopped, None));
    }

    // B-029, B-110
    #[test]
    fn orders_change_the_state() {
        let mut network = network("AXTC4CO", false);
        for (command, state) in [
            (NmtCommand::Start, NetworkState::Operational),
            (NmtCommand::Stop, NetworkState::Stopped),
            (NmtCommand::PreOperational, NetworkState::PreOperational),
            (NmtCommand::Start, NetworkState::Operational),
            (NmtCommand::ResetCommunication, NetworkState::PreOperational),
        ] {
            network.command(at(9_000), command);
            assert_eq!(network.state(), state);
        }
    }

    // B-124, B-126, B-128, B-82, B-85
    #[test]
    fn an_error_moves_the_node_as_1029h_says() {
        use NetworkState::{Operational, PreOperational, Stopped};
        for (from, reaction, to) in [
            (Operational, 0, PreOperational),
            (Operational, 1, Operational),
            (Operational, 2, Stopped),
            (PreOperational, 0, PreOperational),
            (PreOperational, 2, Stopped),
            (Stopped, 0, Stopped),
        ] {
            let mut network = network("AXTC4CO", false);
            network.state = from;
            network.react(reaction);
            assert_eq!(network.state(), to, "{from:?} with {reaction}");
        }
    }
}
