//! Memory that outlives the power: program flash and non-volatile parameters.
//!
//! Both change only by the writes they report as [`Store`](super::Store), so a host that carries these out in their
//! order has the same memory as the unit at every moment.

mod flash;
mod parameters;

pub use flash::{Defect, Flash, Written};
pub use parameters::{IMAGE_BYTES, ParameterStore, Parameters, ParametersError, StartDelay, StreamSetting};
