//! What can be turned, cut and connected at a unit's terminals, to disturb what it measures.

/// One turn. Channels are numbered from 1, as the manuals do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Knob {
    /// An input follows the default process again, its wiring whole.
    Process(u8),
    /// The sensor of an input has this temperature in °C, exactly.
    Temperature(u8, f64),
    /// The sensor of an input has this resistance in ohm, exactly (RTD).
    Resistance(u8, f64),
    /// An input gets this voltage in µV, exactly (thermocouple).
    Microvolts(u8, f64),
    /// Each lead of an input has this resistance in ohm (RTD).
    LeadResistance(u8, f64),
    /// A lead of an input is broken; without a lead, the circuit of the sensor.
    Open(u8, Option<Lead>),
    /// The sensor of an input is shorted.
    Short(u8),
    /// The wiring of an input is whole again; its temperature stays.
    Repair(u8),
    /// The cold junction has this temperature in °C (thermocouple); without one, that of the default process.
    ColdJunction(Option<f64>),
    /// The supply has this voltage in V; without one, that of the default process.
    Supply(Option<f64>),
    /// The current source gives this current in mA (RTD); without one, that of the default process.
    SourceCurrent(Option<f64>),
    /// The converter delivers no new data, or does again.
    Freeze(bool),
}

/// A lead of an RTD, by the terminal it is connected to (AXRTD8CO manual, section 1.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lead {
    /// A: the current comes out here.
    A,
    /// B: the voltage of a sensor with four wires.
    B,
    /// C: the resistance of the wires.
    C,
    /// Ground.
    Ground,
}

/// Why a knob cannot be turned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnobError {
    /// The unit has fewer inputs.
    #[error("there is no input {number}: this unit has inputs 1 to {inputs}")]
    NoSuchInput {
        /// The number asked for.
        number: u8,
        /// Inputs of the unit.
        inputs: u8,
    },
    /// The unit measures something else.
    #[error("a unit with {sensors} has no {what}")]
    NotHere {
        /// What is connected to its inputs.
        sensors: &'static str,
        /// What was to be turned.
        what: &'static str,
    },
    /// It cannot have this number.
    #[error("{what} cannot be {}: it is from {low} to {high}", crate::emulator::words::number(*value))]
    Value {
        /// What was to be turned.
        what: &'static str,
        /// The number.
        value: f64,
        /// The lowest it can have.
        low: f64,
        /// The highest it can have.
        high: f64,
    },
}
