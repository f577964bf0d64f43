//! Questions at the terminal. The answer is typed in a thread of its own: whoever waits for it hears signals meanwhile,
//! and reads the line.

use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use super::Global;
use super::error::{CliError, Kind};
use super::output::Output;
use super::talk::Talk;
use crate::host::signal::Signals;
use crate::host::{self, Input};

/// Whether there is somebody to ask.
pub fn somebody() -> bool {
    io::stdin().is_terminal() && io::stderr().is_terminal()
}

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
        let answer = begin(talk.inputs(), read)?;
        return talk.await_answer(&answer);
    }
    let (sender, inputs) = host::channel();
    let _signals = Signals::start(sender.clone()).map_err(|error| CliError::new(Kind::Failed, error))?;
    let answer = begin(sender, read)?;
    await_answer(&inputs, &answer)
}

/// Reads in a thread, which wakes the loop when it has.
fn begin<T: Send + 'static>(
    wake: SyncSender<Input>,
    read: impl FnOnce() -> T + Send + 'static,
) -> Result<Receiver<T>, CliError> {
    let (answer, answered) = sync_channel(1);
    let reader = thread::Builder::new().name("answer".into()).spawn(move || {
        let read = read();
        if answer.send(read).is_ok() {
            let _ = wake.send(Input::Wake);
        }
    });
    reader
        .map(|_| answered)
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot ask")))
}

fn await_answer<T>(inputs: &Receiver<Input>, answer: &Receiver<T>) -> Result<T, CliError> {
    loop {
        match inputs.recv() {
            Ok(Input::Signal(_)) => return Err(CliError::interrupted()),
            Ok(_) => {}
            Err(_) => return Err(CliError::message(Kind::Failed, "nobody answers")),
        }
        if let Ok(answer) = answer.try_recv() {
            return Ok(answer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_ends_the_wait_for_an_answer_and_an_answer_does() {
        let (sender, inputs) = host::channel();
        let answer = begin(sender.clone(), || "yes").map_err(|error| error.to_string()).expect("a thread");
        assert_eq!(await_answer(&inputs, &answer).ok(), Some("yes"));
        let (never, unanswered) = sync_channel::<&str>(1);
        sender.send(Input::Wake).and_then(|()| sender.send(Input::Signal(15))).expect("there is room");
        let error = await_answer(&inputs, &unanswered).expect_err("a signal");
        assert_eq!(error.kind, Kind::Interrupted);
        drop(never);
    }
}
