//! Standard output and standard error: data to the one, everything else to the other.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use clap::ValueEnum;
use serde::Serialize;

use super::error::{CliError, Kind};
use crate::wire::visible;

/// Where a command's data and remarks go.
pub struct Output {
    /// Whether data and errors are JSON.
    pub json: bool,
    /// Data.
    pub out: Box<dyn Write + Send>,
    /// Everything else.
    pub err: Remarks,
}

/// Where remarks go. Code that has something to say at once, in the middle of something else, has a copy.
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

/// The reader of our output has enough. Not an error: the command ends with success.
#[derive(Debug, thiserror::Error)]
#[error("the reader of standard output has gone")]
pub struct Closed;

impl Output {
    /// The process's own streams.
    pub fn standard(json: bool) -> Self {
        Output { json, out: Box::new(io::stdout()), err: Remarks::to(io::stderr()) }
    }

    /// The format of a command's data: the one that was named, else the one that the file's ending promises, else the one
    /// that `--json` means, or the usual one.
    ///
    /// # Errors
    /// If another one was named than `--json` means. A file whose name promises one gets that: `--json` is then about
    /// errors alone.
    pub fn format<F: ValueEnum + PartialEq>(
        &self,
        named: Option<F>,
        promised: Option<F>,
        json: F,
        usual: F,
    ) -> Result<F, CliError> {
        match (named, promised) {
            (Some(named), _) if self.json && named != json => {
                let name = named.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default();
                let message = format!("--json and --format {name} contradict each other");
                Err(CliError::message(Kind::Usage, message).hint("leave out one of them"))
            }
            (Some(format), _) | (None, Some(format)) => Ok(format),
            (None, None) if self.json => Ok(json),
            (None, None) => Ok(usual),
        }
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
        self.out.write_all(bytes).and_then(|()| self.out.flush()).map_err(unwritten)
    }

    /// A remark for a person, on standard error. Nothing can be done if that fails.
    pub fn remark(&mut self, text: &str) {
        self.err.say(text);
    }
}

/// What it means that standard output cannot be written.
pub fn unwritten(error: io::Error) -> CliError {
    match error.kind() {
        io::ErrorKind::BrokenPipe => CliError::new(Kind::Failed, Closed),
        _ => CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot write to standard output")),
    }
}

/// The end of the program as JSON on standard error.
#[derive(Serialize)]
struct ErrorObject<'a> {
    schema: &'static str,
    exit_code: u8,
    kind: &'static str,
    /// Of one of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    port: Option<&'a str>,
    message: String,
    hints: &'a [String],
}

/// Tells the user about an error and gives the exit code. A reader that closed our output is not an error.
pub fn conclude(output: &mut Output, result: Result<(), CliError>) -> u8 {
    conclude_of(output, None, result)
}

/// The same for one of several links, which a program has to be able to tell apart.
pub fn conclude_of(output: &mut Output, port: Option<&str>, result: Result<(), CliError>) -> u8 {
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
            port,
            message: error.to_string(),
            hints: &error.hints,
        };
        if let Ok(line) = serde_json::to_string(&object) {
            output.remark(&line);
        }
    } else {
        output.remark(&harmless(&format!("axcon: {error}")));
        for hint in &error.hints {
            output.remark(&harmless(&format!("  {hint}")));
        }
    }
    code
}

/// A text of several lines in which nothing acts on a terminal: messages quote names, files, and what somebody has said.
fn harmless(text: &str) -> String {
    text.split('\n').map(|line| visible::line(line.as_bytes())).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_told_line_by_line_and_acts_on_no_terminal() {
        assert_eq!(harmless("cannot open 'a\x1b[2J':\n  \u{9b}1m °C"), "cannot open 'a^[[2J':\n  ‹9b›1m °C");
    }

    #[test]
    fn json_and_another_format_contradict_each_other() {
        #[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
        enum Format {
            Csv,
            Json,
        }
        let chosen = |json, named, promised| {
            let output = Output { json, out: Box::new(io::sink()), err: Remarks::to(io::sink()) };
            output.format(named, promised, Format::Json, Format::Csv).map_err(|error| error.to_string())
        };
        let (csv, json) = (Some(Format::Csv), Some(Format::Json));
        assert_eq!([chosen(false, None, None), chosen(true, None, None)], [Ok(Format::Csv), Ok(Format::Json)]);
        assert_eq!([chosen(false, json, csv), chosen(false, None, json)], [Ok(Format::Json), Ok(Format::Json)]);
        assert_eq!([chosen(true, json, csv), chosen(true, None, csv)], [Ok(Format::Json), Ok(Format::Csv)]);
        assert_eq!(chosen(true, csv, json), Err("--json and --format csv contradict each other".into()));
    }
}
