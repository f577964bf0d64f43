//! A unit with its scenario playing and its faults happening: an endpoint like the unit alone.

use std::collections::VecDeque;

use super::{Scenario, Verb};
use crate::emulator::fault::{Arrival, Deed, Fault, MOST_FAULTS, Middleman, Way};
use crate::emulator::{NetworkState, Running, Store, Unit};
use crate::endpoint::{Endpoint, Transmit};
use crate::time::Instant;

/// A unit with its scenario playing, on a cable with faults.
#[derive(Debug)]
pub struct Stage {
    unit: Unit,
    scenario: Scenario,
    /// When the present round began.
    began: Instant,
    /// The next deed.
    next: usize,
    /// When the supply comes back.
    power_at: Option<Instant>,
    middleman: Middleman,
    /// What the client gets.
    outgoing: VecDeque<Transmit>,
}

impl Stage {
    /// A unit to which nothing happens but what is done by hand.
    pub fn bare(unit: Unit) -> Self {
        Stage::new(unit, Scenario::default())
    }

    /// A unit whose scenario begins at time zero.
    pub fn new(unit: Unit, scenario: Scenario) -> Self {
        Stage {
            unit,
            scenario,
            began: Instant::ZERO,
            next: 0,
            power_at: None,
            middleman: Middleman::new(0),
            outgoing: VecDeque::new(),
        }
    }

    /// The same with these faults from the start; `seed` decides what chance decides about them, and about those ordered
    /// later.
    pub fn with_faults(mut self, seed: u64, faults: &[Fault]) -> Self {
        self.middleman = Middleman::new(seed);
        for &fault in faults {
            self.suffer(fault);
        }
        self
    }

    /// The unit.
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// The unit, to do something to it that no verb does.
    pub fn unit_mut(&mut self) -> &mut Unit {
        &mut self.unit
    }

    /// Whether the client has heard XOFF and not yet XON. A unit that restarts holds nobody.
    pub fn holds_client(&self) -> bool {
        self.middleman.client_is_held() && self.unit.running() == Running::Loader
    }

    /// Another client has come: it knows nothing of an XOFF.
    pub fn forget_hold(&mut self) {
        self.middleman.forget_hold();
    }

    /// Whether the cable is in.
    pub fn is_plugged(&self) -> bool {
        self.middleman.is_plugged()
    }

    /// Bytes that the adapter takes ahead of the line.
    pub fn queue(&self) -> usize {
        self.middleman.queue()
    }

    /// Supply voltage comes.
    pub fn power_on(&mut self, now: Instant) {
        self.power_at = None;
        self.unit.power_on(now);
        self.collect(now);
    }

    /// Supply voltage goes.
    pub fn power_off(&mut self, now: Instant) {
        self.power_at = None;
        self.unit.power_off(now);
        self.collect(now);
    }

    /// The next write to memory that outlives the power.
    pub fn poll_store(&mut self) -> Option<Store> {
        self.unit.poll_store()
    }

    /// Does something to the unit; gives what there is to say about it.
    ///
    /// # Errors
    /// If the unit refuses, with its reason.
    pub fn perform(&mut self, now: Instant, verb: &Verb) -> Result<Option<String>, String> {
        self.handle_timeout(now);
        let answer = self.act(now, verb);
        self.collect(now);
        answer
    }

    fn suffer(&mut self, fault: Fault) {
        match fault {
            Fault::Line(fault) => self.middleman.order_on_line(fault),
            Fault::Record(fault) => self.middleman.order_at_record(fault),
            Fault::Flash { word, defect } => self.unit.spoil_word(word, defect),
            Fault::Adapter(setting) => self.middleman.set(setting),
        }
    }

    /// What the unit has sent goes on the cable, and what has arrived to the client.
    fn collect(&mut self, now: Instant) {
        while let Some(transmit) = self.unit.poll_transmit() {
            if self.middleman.is_idle() {
                self.middleman.note_client_heard(&transmit.bytes);
                self.outgoing.push_back(transmit);
            } else {
                transmit.bytes.iter().for_each(|&byte| self.middleman.carry(now, Way::FromUnit, byte));
            }
        }
        let arrived: Vec<u8> = std::iter::from_fn(|| self.middleman.next_to_client(now)).collect();
        if !arrived.is_empty() {
            self.middleman.note_client_heard(&arrived);
            self.outgoing.push_back(Transmit::open(arrived));
        }
        if matches!(self.unit.running(), Running::Off | Running::Starting) {
            self.middleman.forget_hold();
        }
    }

    /// Something arrives at the unit.
    fn deliver(&mut self, now: Instant, arrival: Arrival) {
        let loads = self.unit.running() == Running::Loader;
        match arrival {
            Arrival::Byte(byte) => self.unit.handle_bytes(now, &[byte]),
            Arrival::Unreadable => self.unit.handle_framing_error(now),
        }
        self.collect(now);
        if !loads {
            self.middleman.note_no_loader();
            return;
        }
        for deed in self.middleman.note_loader_got(arrival) {
            self.power_off(now);
            match deed {
                Deed::Reset => self.power_on(now),
                Deed::PowerCut(off) => self.power_at = off.map(|off| now + off),
            }
        }
    }

    /// Does what is due at this moment.
    fn step(&mut self, now: Instant) {
        self.unit.handle_timeout(now);
        self.collect(now);
        if self.power_at.is_some_and(|at| at <= now) {
            self.power_on(now);
        }
        if self.due().is_some_and(|at| at <= now) {
            self.play(now);
            self.collect(now);
        }
        self.middleman.handle_timeout(now);
        while let Some(arrival) = self.middleman.next_to_unit(now) {
            self.deliver(now, arrival);
        }
    }

    fn act(&mut self, now: Instant, verb: &Verb) -> Result<Option<String>, String> {
        match verb {
            Verb::Turn(knob) => self.unit.turn(now, *knob).map_err(|error| error.to_string())?,
            Verb::PowerOn => self.power_on(now),
            Verb::PowerOff => self.power_off(now),
            Verb::PowerCycle(off) => {
                self.power_off(now);
                self.power_at = Some(now + *off);
            }
            Verb::Nmt(order) => self.unit.nmt(now, *order),
            Verb::Write(at, value) => {
                let refused = |refusal| format!("{at} <- {value}: {refusal}");
                self.unit.write_object(now, *at, &value.encode()).map_err(refused)?;
            }
            Verb::Read(at) => {
                let value = self.unit.read_object(now, *at).map_err(|refusal| format!("{at}: {refusal}"))?;
                let entry = self.unit.product().dictionary.entry(*at);
                let meaning = entry.and_then(|entry| entry.meaning(value)).map(|text| format!(" ({text})"));
                let unit = entry.and_then(|entry| entry.unit.as_deref()).map(|unit| format!(" {unit}"));
                return Ok(Some(format!("{at} = {value}{}{}", unit.unwrap_or_default(), meaning.unwrap_or_default())));
            }
            Verb::Fault(_) if self.middleman.faults() + self.unit.spoiled() >= MOST_FAULTS => {
                return Err(format!("{MOST_FAULTS} faults lie in wait already: 'heal' ends them"));
            }
            Verb::Fault(fault) => self.suffer(*fault),
            Verb::Heal => {
                self.middleman.heal();
                self.unit.repair_flash();
            }
            Verb::Plug => self.middleman.plug(),
            Verb::Unplug => self.middleman.unplug(None),
            Verb::Status => return Ok(Some(self.status())),
        }
        Ok(None)
    }

    fn status(&self) -> String {
        let product = &self.unit.product().name;
        let state = match self.unit.running() {
            Running::Off => "has no power",
            Running::Starting => "starts",
            Running::Loader => "waits in its loader",
            Running::Application => match self.unit.network_state() {
                Some(NetworkState::Operational) => "runs, operational",
                Some(NetworkState::Stopped) => "runs, stopped",
                Some(NetworkState::PreOperational) | None => "runs, pre-operational",
            },
        };
        let cable = if self.middleman.is_plugged() { "" } else { ", its cable is out" };
        format!("{product} {state}{cable}")
    }

    /// When the scenario has something to do.
    fn due(&self) -> Option<Instant> {
        let deed = self.scenario.deeds.get(self.next).map(|(at, _)| *at);
        deed.or(self.scenario.repeat).map(|at| self.began + at)
    }

    /// Does what the scenario says for this moment.
    fn play(&mut self, now: Instant) {
        while self.due().is_some_and(|due| due <= now) {
            let Some((_, verb)) = self.scenario.deeds.get(self.next) else {
                self.began += self.scenario.repeat.unwrap_or_default();
                self.next = 0;
                continue;
            };
            let verb = verb.clone();
            self.next += 1;
            // A unit that refuses (no such input, an entry that is read-only) is what a scenario may want to see.
            let _ = self.act(now, &verb);
        }
    }

    /// The next moment of the stage's own.
    fn own_deadline(&self) -> Option<Instant> {
        [self.due(), self.power_at, self.middleman.deadline()].into_iter().flatten().min()
    }
}

impl Endpoint for Stage {
    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        self.handle_timeout(now);
        if self.middleman.is_idle() {
            self.unit.handle_bytes(now, bytes);
            self.collect(now);
            return;
        }
        bytes.iter().for_each(|&byte| self.middleman.carry(now, Way::ToUnit, byte));
        self.step(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        loop {
            let mut due = self.own_deadline();
            if !self.middleman.is_idle() {
                // What the unit says has to go on the cable at its own moment.
                due = [due, self.unit.poll_timeout()].into_iter().flatten().min();
            }
            match due.filter(|&due| due <= now) {
                Some(due) => self.step(due),
                None => break,
            }
        }
        self.step(now);
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        self.outgoing.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        [self.own_deadline(), self.unit.poll_timeout()].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::ObjectAddress;
    use crate::device::Product;
    use crate::image::make;
    use crate::version::Version;

    fn product() -> &'static Product {
        Product::named("AXTC4CO").expect("built in")
    }

    fn stage(text: &str) -> Stage {
        let scenario = Scenario::read("test.toml", text, product()).expect("a scenario").expect("for this product");
        let mut flash = vec![0xFF; product().flash.program_words as usize * 2];
        let recipe =
            make::Recipe { target: &product().target(), version: Version::new(1, 1, 0), words: 1024, flaw: None };
        let program = make::program(&recipe);
        flash[..program.len()].copy_from_slice(&program);
        let setup = crate::emulator::Setup {
            product: product(),
            loader: product().loader.kind,
            seed: 1,
            dialect: 0,
            flash,
            parameters: Vec::new(),
        };
        let mut stage = Stage::new(Unit::new(setup), scenario);
        stage.power_on(Instant::ZERO);
        stage
    }

    fn celsius(stage: &mut Stage, now: Instant, channel: u8) -> f64 {
        stage.unit.read_object(now, ObjectAddress::new(0x6100, channel)).expect("it runs").as_f64()
    }

    fn at(millis: u64) -> Instant {
        Instant::from_millis(millis)
    }

    #[test]
    fn deeds_happen_at_their_moments_and_ramps_in_between() {
        let mut stage = stage(
            r#"
            product = "axtc4co"
            [[at]]
            seconds = 10
            do = ["set 1 temperature 250.0", "open 3"]
            [[ramp]]
            from = 20.0
            to = 80.0
            what = "2 temperature"
            start = 25.0
            end = 145.0
            "#,
        );
        stage.handle_timeout(at(9_900));
        assert!(celsius(&mut stage, at(9_900), 1) < 120.0 && celsius(&mut stage, at(9_900), 3) > 70.0);
        stage.handle_timeout(at(12_500));
        assert!((celsius(&mut stage, at(12_500), 1) - 250.0).abs() < 0.01);
        assert!(celsius(&mut stage, at(12_500), 3).is_nan());
        for (seconds, expected) in [(20u64, 25.0), (50, 85.0), (80, 145.0), (90, 145.0)] {
            let now = at(seconds * 1_000 + 300);
            stage.handle_timeout(now);
            let found = celsius(&mut stage, now, 2);
            assert!((found - expected).abs() < 1.0, "at {seconds} s: {found}");
        }
    }

    #[test]
    fn a_scenario_repeats_and_asking_often_changes_nothing() {
        let text = "repeat = 20\n[[at]]\nseconds = 5\ndo = ['set 1 temperature 50']\n[[at]]\nseconds = 15\n\
                    do = ['set 1 temperature 90', 'power cycle 0.5']\n";
        let (mut once, mut often) = (stage(text), stage(text));
        for second in 1..=70u64 {
            for step in 0..10 {
                often.handle_timeout(at(second * 1_000 + step * 100));
            }
            once.handle_timeout(at(second * 1_000 + 900));
            assert_eq!(once.unit.running(), often.unit.running(), "{second} s");
        }
        let found = celsius(&mut once, at(70_900), 1);
        assert!((found - 50.0).abs() < 0.1, "in the fourth round, 5 s after its start: {found}");
        assert_eq!(found, celsius(&mut often, at(70_900), 1));
    }

    #[test]
    fn faults_that_a_scenario_orders_again_and_again_have_an_end() {
        let text = "repeat = 0.1\n[[at]]\nseconds = 0\n\
                    do = ['fault lost to-unit one in 100', 'fault flash worn-out at word 7']\n";
        let mut stage = stage(text);
        stage.handle_timeout(at(200_000));
        assert_eq!((stage.middleman.faults(), stage.unit.spoiled()), (MOST_FAULTS - 1, 1));
        let verb = |line: &str| Verb::read(line, product()).expect(line);
        let refused = stage.perform(at(200_001), &verb("fault lost from-unit at byte 1")).expect_err("too many");
        assert_eq!(refused, "1000 faults lie in wait already: 'heal' ends them");
        assert_eq!(stage.perform(at(200_001), &verb("heal")), Ok(None));
        assert_eq!(stage.perform(at(200_001), &verb("fault lost from-unit at byte 1")), Ok(None));
    }

    #[test]
    fn a_power_cycle_loses_what_was_not_saved() {
        let mut stage = stage("");
        stage.handle_timeout(at(1_000));
        let verb = |line: &str| Verb::read(line, product()).expect(line);
        assert_eq!(stage.perform(at(1_000), &verb("write 6126:1 18")), Ok(None));
        assert_eq!(stage.perform(at(1_000), &verb("read 6110:1")), Ok(Some("6110:01 = 1 (type J)".into())));
        assert_eq!(stage.perform(at(1_000), &verb("read 6127:1")), Ok(Some("6127:01 = 4368.0".into())));
        let refused = stage.perform(at(1_000), &verb("write 4020:1 100")).expect_err("too low");
        assert_eq!(refused, "4020:01 <- 100: the value is below the low limit (abort 06090032h)");
        assert_eq!(stage.perform(at(1_000), &verb("status")), Ok(Some("AXTC4CO runs, pre-operational".into())));
        assert_eq!(stage.perform(at(2_000), &verb("power cycle 0.5")), Ok(None));
        assert_eq!(stage.perform(at(2_100), &verb("status")), Ok(Some("AXTC4CO has no power".into())));
        assert_eq!(stage.perform(at(2_200), &verb("read 6126:1")), Err("6126:01: the unit does not answer".into()));
        stage.handle_timeout(at(3_000));
        assert_eq!(stage.perform(at(3_000), &verb("read 6126:1")), Ok(Some("6126:01 = 16.0".into())));
        let refused = stage.perform(at(3_000), &verb("set 9 temperature 20")).expect_err("no such input");
        assert_eq!(refused, "there is no input 9: this unit has inputs 1 to 4");
    }
}
