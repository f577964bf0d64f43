//! Questions at the terminal. While the answer is awaited, signals are heard and the line is read.

use std::io::{self, IsTerminal, Write};

use super::error::{CliError, Kind};
use super::output::Output;
use super::talk::Talk;
use super::{Global, waiting};
use crate::host;

/// Whether there is somebody to ask.
pub fn somebody() -> bool {
    io::stdin().is_terminal() && io::stderr().is_terminal()
}

/// What reading the object dictionary may do to the unit.
pub const READS_DICTIONARY: &str = "While the object dictionary is read, the unit may halt scanning and CAN";

/// Asks before something is destroyed or halted, unless `--yes` has answered. `deed` says what is going to happen, as a
/// sentence without its end.
///
/// # Errors
/// If the answer is no, the user interrupts, or nobody can be asked; nothing has happened then.
pub fn confirm(deed: &str, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if global.yes {
        return Ok(());
    }
    if !somebody() {
        return Err(CliError::message(Kind::NeedsYes, format!("{deed}, and nobody said yes"))
            .hint("add --yes where nobody can be asked"));
    }
    if is_yes(&format!("{deed}. Type yes to go on: "), None, output)? {
        Ok(())
    } else {
        Err(CliError::message(Kind::NeedsYes, "not confirmed; nothing has been done"))
    }
}

/// Asks for a yes, while `talk` goes on if there is one.
///
/// # Errors
/// If the user interrupts, or the link is lost meanwhile.
pub fn is_yes(question: &str, talk: Option<&mut Talk>, output: &mut Output) -> Result<bool, CliError> {
    let _ = write!(output.err, "{question}").and_then(|()| output.err.flush());
    let line = typed(talk, || {
        let mut line = String::new();
        io::stdin().read_line(&mut line).map(|_| line)
    })?;
    let line = line.map_err(|error| CliError::new(Kind::Failed, error))?;
    Ok(matches!(line.trim().to_lowercase().as_str(), "yes" | "y"))
}

/// Waits for what `read` gives, which may block for ever, while `talk` goes on if there is one.
///
/// # Errors
/// If the user interrupts, or the link is lost meanwhile.
pub fn typed<T: Send + 'static>(
    talk: Option<&mut Talk>,
    read: impl FnOnce() -> T + Send + 'static,
) -> Result<T, CliError> {
    if let Some(talk) = talk {
        let answer = waiting::begin(talk.inputs(), read)?;
        return talk.await_answer(&answer);
    }
    let (sender, inputs) = host::channel();
    let _signals = waiting::hear_signals(sender.clone())?;
    let answer = waiting::begin(sender, read)?;
    waiting::end(&inputs, &answer)
}
