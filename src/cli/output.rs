//! Standard output and standard error: data to the one, everything else to the other.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::error::{CliError, Kind};

/// Where a command's data and remarks go.
pub struct Output {
    /// Whether data and errors are JSON.
    pub json: bool,
    /// Data.
    pub out: Box<dyn Write + Send>,
    /// Everything else.
    pub err: Remarks,
}

/// Where remarks go; whoever has something to say at once, in the middle of something else, has a copy.
#[derive(Clone)]
pub struct Remarks(Arc<Mutex<Box<dyn Write + Send>>>);

impl Remarks {
    /// Remarks that are written there.
    pub fn to(writer: impl Write + Send + 'static) -> Self {
        Remarks(Arc::new(Mutex::new(Box::new(writer))))
    }

    /// A remark for a person. Nothing can be done if that fails.
    pub fn say(&mut self, text: &str) {
        let _ = writeln!(self, "{text}");
    }
}

impl Write for Remarks {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).flush()
    }
}

/// Whoever reads our output has enough. Not an error: the command ends with success.
#[derive(Debug, thiserror::Error)]
#[error("the reader of standard output has gone")]
pub struct Closed;

impl Output {
    /// The process's own streams.
    pub fn standard(json: bool) -> Self {
        Output { json, out: Box::new(io::stdout()), err: Remarks::to(io::stderr()) }
    }

    /// One JSON object on a line of its own.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub fn object(&mut self, object: &impl Serialize) -> Result<(), CliError> {
        let mut line = serde_json::to_vec(object).map_err(|error| CliError::new(Kind::Failed, error))?;
        line.push(b'\n');
        self.data(&line)
    }

    /// Text for a person or raw data, as it is.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub fn data(&mut self, bytes: &[u8]) -> Result<(), CliError> {
        self.out.write_all(bytes).and_then(|()| self.out.flush()).map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => CliError::new(Kind::Failed, Closed),
            _ => CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot write to standard output")),
        })
    }

    /// A remark for a person, on standard error. Nothing can be done if that fails.
    pub fn remark(&mut self, text: &str) {
        self.err.say(text);
    }
}

/// The end of the program as JSON on standard error.
#[derive(Serialize)]
struct ErrorObject<'a> {
    schema: &'static str,
    exit_code: u8,
    kind: &'static str,
    message: String,
    hints: &'a [String],
}

/// Tells the user about an error and gives the exit code. A reader that closed our output is not an error.
pub fn conclude(output: &mut Output, result: Result<(), CliError>) -> u8 {
    let Err(error) = result else { return 0 };
    if error.error.is::<Closed>() {
        return 0;
    }
    let code = error.kind.exit_code();
    if error.reported {
        return code;
    }
    if output.json {
        let object = ErrorObject {
            schema: "axcon.error/1",
            exit_code: code,
            kind: error.kind.name(),
            message: error.to_string(),
            hints: &error.hints,
        };
        if let Ok(line) = serde_json::to_string(&object) {
            output.remark(&line);
        }
    } else {
        output.remark(&format!("axcon: {error}"));
        for hint in &error.hints {
            output.remark(&format!("  {hint}"));
        }
    }
    code
}
