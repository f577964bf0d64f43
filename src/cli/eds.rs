//! `axcon eds`: a product's electronic data sheet.

use std::path::PathBuf;

use super::error::CliError;
use super::files::Destination;
use super::output::Output;
use super::{Global, names};
use crate::device::{Product, eds};

/// Arguments of `axcon eds`.
///
/// The data sheet (CiA 306) lists every entry of the product's object dictionary for configuration tools.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which product, e.g. axtc4co.
    #[arg(value_name = "PRODUCT", value_parser = names::product)]
    product: &'static Product,
    /// Write to FILE instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the data sheet.
///
/// # Errors
/// If it cannot be written, or the file is there already and nobody said yes.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    Destination::admit(args.out.as_deref(), global.yes)?.save(eds::write(args.product).as_bytes(), output)
}
