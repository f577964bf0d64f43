//! (to be written)

use super::Global;
use super::error::CliError;
use super::output::Output;

/// Arguments.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// None yet.
pub fn run(_args: Args, _global: &Global, _output: &mut Output) -> Result<(), CliError> {
    Ok(())
}
