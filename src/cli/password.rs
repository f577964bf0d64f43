//! Where the password comes from: a file, the environment, or a prompt without echo. Never the command line.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Read};
use std::path::Path;

use zeroize::Zeroizing;

use super::error::{CliError, Kind};
use super::talk::Talk;
use super::{ask, files};
use crate::host::terminal::KeptTerminal;
use crate::secret::Secret;

/// The environment's name for it.
const VARIABLE: &str = "AXCON_PASSWORD";

/// Bytes of a password file at most: whatever is longer is another file.
const LONGEST: usize = 256;

/// Bytes that are read at once: more than the system's library keeps of standard input, which so keeps no copy.
const READ: usize = 64 << 10;

/// The password, if a file or the environment has it.
///
/// # Errors
/// If the file cannot be read or does not hold one line with a password.
pub fn find(file: Option<&Path>) -> Result<Option<Secret>, CliError> {
    if let Some(path) = file {
        return read(path).map(Some);
    }
    match std::env::var_os(VARIABLE) {
        Some(password) if !password.is_empty() => {
            let password = password.into_string().map_err(|_| {
                CliError::message(Kind::Usage, format!("{VARIABLE} holds characters that no keyboard line can"))
            })?;
            accept(Secret::new(password.into_bytes()), VARIABLE).map(Some)
        }
        _ => Ok(None),
    }
}

/// Asks for it, while `talk` goes on if there is one.
///
/// # Errors
/// If the terminal cannot be used, nothing is typed, the user interrupts, or the link is lost meanwhile.
pub fn ask(talk: Option<&mut Talk>) -> Result<Secret, CliError> {
    // A signal leaves the thread that hides the typing where it is.
    let _kept = KeptTerminal::now();
    let password = ask::typed(talk, || {
        // Into its place at once: a copy that waits somewhere is not wiped.
        rpassword::prompt_password("Password: ").map(|password| Secret::new(password.into_bytes()))
    })?;
    let password = password.map_err(|error| match error.kind() {
        ErrorKind::Interrupted => CliError::interrupted(),
        _ => CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot ask for the password")),
    })?;
    accept(password, "the answer")
}

fn read(path: &Path) -> Result<Secret, CliError> {
    let shown = files::shown(path);
    let failed = |error: io::Error| {
        CliError::new(Kind::Usage, anyhow::Error::new(error).context(format!("cannot read the password file {shown}")))
    };
    let text = if path == Path::new("-") {
        if io::stdin().is_terminal() {
            return Err(CliError::message(Kind::Usage, "standard input is a terminal, which shows what is typed")
                .hint("without --password-file the password is asked for, and not shown"));
        }
        read_all(io::stdin().lock())
    } else {
        File::open(path).and_then(read_all)
    };
    let mut text = text.map_err(failed)?;
    if text.len() > LONGEST {
        let message = format!("the password file {shown} is longer than {LONGEST} bytes; is it the right one?");
        return Err(CliError::message(Kind::Usage, message));
    }
    // An editor ends the line; the password has no line end.
    while text.last().is_some_and(|last| matches!(last, b'\n' | b'\r')) {
        text.pop();
    }
    accept(Secret::new(std::mem::take(&mut *text)), &format!("the password file {shown}"))
}

/// Reads to the end, or until it is too much.
fn read_all(mut from: impl Read) -> io::Result<Zeroizing<Vec<u8>>> {
    let mut piece = Zeroizing::new(vec![0u8; READ]);
    // With room for all of it, so that growing leaves no copy of a password.
    let mut text = Zeroizing::new(Vec::with_capacity(LONGEST + 2));
    while text.len() <= LONGEST {
        match from.read(&mut piece) {
            Ok(0) => break,
            Ok(count) => {
                let room = LONGEST + 1 - text.len();
                text.extend_from_slice(&piece[..count.min(room)]);
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(text)
}

fn accept(password: Secret, place: &str) -> Result<Secret, CliError> {
    if password.is_empty() {
        return Err(CliError::message(Kind::Usage, format!("{place} is empty")));
    }
    if password.reveal().iter().any(u8::is_ascii_control) {
        return Err(CliError::message(
            Kind::Usage,
            format!("{place} holds more than one line, or a control character"),
        ));
    }
    Ok(password)
}
