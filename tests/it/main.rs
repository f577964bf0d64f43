//! Everything that needs more than one module, in one binary.

#[cfg(unix)]
mod ptys;
#[cfg(unix)]
mod support;
