//! CANopen's own vocabulary (CiA 301): typed values, where they lie in an object dictionary, and why an access is
//! refused.

mod abort;
mod address;
mod value;

pub use abort::Abort;
pub use address::{ObjectAddress, ObjectAddressError};
pub use value::{DataType, Value};
