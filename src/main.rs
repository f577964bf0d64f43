//! Arguments and streams to [`axcon::cli::run`], exit code back.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(axcon::cli::run(std::env::args_os()))
}
