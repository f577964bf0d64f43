//! The question before something is destroyed or halted.

use std::io::{IsTerminal, Write};

use super::Global;
use super::error::{CliError, Kind};
use super::output::Output;

/// Asks, unless `--yes` has answered. `deed` says what is going to happen, as a sentence without its end.
///
/// # Errors
/// If the answer is no, or nobody can be asked; nothing has happened then.
pub fn confirm(deed: &str, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if global.yes {
        return Ok(());
    }
    if !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
        return Err(CliError::message(Kind::NeedsYes, format!("{deed}, and nobody said yes"))
            .hint("add --yes where nobody can be asked"));
    }
    let _ = write!(output.err, "{deed}. Type yes to go on: ").and_then(|()| output.err.flush());
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).map_err(|error| CliError::new(Kind::Failed, error))?;
    match answer.trim().to_lowercase().as_str() {
        "yes" | "y" => Ok(()),
        _ => Err(CliError::message(Kind::NeedsYes, "not confirmed; nothing has been done")),
    }
}
