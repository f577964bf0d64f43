//! Several units at once: a thread for each, a line of progress for each, one report. Nothing one of them does disturbs
//! another: each has its own link, session, recording and journal entry.

use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::meter::{Board, Meter};
use super::{Prepared, upload};
use crate::cli::Global;
use crate::cli::error::{CliError, Kind};
use crate::cli::output::{self, Closed, Output, Remarks};

#[derive(Serialize)]
struct Summary<'a> {
    schema: &'static str,
    exit_code: u8,
    units: Vec<Unit<'a>>,
}

#[derive(Serialize)]
struct Unit<'a> {
    port: &'a str,
    exit_code: u8,
}

/// The lines of one of several uploads, kept until all have ended.
#[derive(Clone)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Lines {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Hands whole lines on to standard output, which several uploads share.
struct Shared(Vec<u8>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.extend_from_slice(bytes);
        if let Some(end) = self.0.iter().rposition(|&byte| byte == b'\n') {
            let rest = self.0.split_off(end + 1);
            let lines = std::mem::replace(&mut self.0, rest);
            let mut out = std::io::stdout().lock();
            out.write_all(&lines)?;
            out.flush()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Uploads to all of them.
///
/// # Errors
/// If one of them failed: with its exit code where all failures share one, else 1.
pub fn run(ports: &[String], prepared: &Prepared, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let on_terminal = std::io::stderr().is_terminal();
    let board = Arc::new(Board::new(ports, Box::new(std::io::stderr()), on_terminal));
    let json = output.json;
    let ended: Vec<(u8, Vec<u8>, Vec<u8>)> = std::thread::scope(|scope| {
        let uploads: Vec<_> = ports
            .iter()
            .enumerate()
            .map(|(line, port)| {
                let board = board.clone();
                // The answer for all was the answer for each.
                let global = Global { ports: vec![port.clone()], yes: true, ..global.clone() };
                scope.spawn(move || {
                    let (out, err) = (Lines(Arc::default()), Lines(Arc::default()));
                    let stdout: Box<dyn Write + Send> =
                        if json { Box::new(Shared(Vec::new())) } else { Box::new(out.clone()) };
                    let mut output = Output { json, out: stdout, err: Remarks::to(err.clone()) };
                    let meter = if json { Meter::new(port, true) } else { Meter::on_board(port, board.clone(), line) };
                    let result = upload(prepared, &global, meter, &mut output);
                    let code = output::conclude_of(&mut output, Some(port), result);
                    if !json {
                        let text = if code == 0 { "done".to_owned() } else { format!("failed, exit code {code}") };
                        board.set(line, text);
                    }
                    (code, out.take(), err.take())
                })
            })
            .collect();
        // A panic in one of them is a defect of ours, and must not end the others.
        uploads
            .into_iter()
            .map(|upload| upload.join().unwrap_or((1, Vec::new(), b"axcon: panicked\n".to_vec())))
            .collect()
    });
    let mut written = Ok(());
    for (port, (_, out, err)) in ports.iter().zip(&ended) {
        for line in String::from_utf8_lossy(err).lines() {
            output.remark(&if json { line.to_owned() } else { format!("{port}: {line}") });
        }
        for line in String::from_utf8_lossy(out).lines() {
            written = written.and(output.data(format!("{port}: {line}\n").as_bytes()));
        }
    }
    let codes: Vec<u8> = ended.iter().map(|&(code, _, _)| code).collect();
    sum_up(ports, &codes, "run what was sent", written, output)
}

/// Says of each unit, one after the other, what an upload would do. One that cannot take the image does not keep the
/// next from being looked at.
///
/// # Errors
/// As [`run`], and if the user interrupts.
pub fn plan(ports: &[String], prepared: &Prepared, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let mut codes = Vec::new();
    for port in ports {
        let global = Global { ports: vec![port.clone()], ..global.clone() };
        match upload(prepared, &global, Meter::new(port, output.json), output) {
            Err(error) if error.kind == Kind::Interrupted || error.error.is::<Closed>() => return Err(error),
            planned => codes.push(output::conclude_of(output, Some(port), planned)),
        }
    }
    sum_up(ports, &codes, "can take it", Ok(()), output)
}

/// The last line, and the end of all.
fn sum_up(
    ports: &[String],
    codes: &[u8],
    deed: &str,
    mut written: Result<(), CliError>,
    output: &mut Output,
) -> Result<(), CliError> {
    let exit_code = shared_code(codes);
    if output.json {
        let units = ports.iter().zip(codes).map(|(port, &exit_code)| Unit { port, exit_code }).collect();
        written = output.object(&Summary { schema: "axcon.loads/1", exit_code, units });
    } else {
        let done = codes.iter().filter(|&&code| code == 0).count();
        output.remark(&format!("{done} of {} units {deed}", codes.len()));
    }
    let kind = Kind::ALL.into_iter().find(|kind| kind.exit_code() == exit_code).unwrap_or(Kind::Failed);
    CliError::found((exit_code != 0).then_some(kind), written)
}

/// 0 if all are, the code that all failures share, else 1.
fn shared_code(codes: &[u8]) -> u8 {
    let mut failures = codes.iter().filter(|&&code| code != 0);
    match failures.next() {
        None => 0,
        Some(&first) if failures.all(|&code| code == first) => first,
        Some(_) => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_of_one_kind_keep_their_exit_code() {
        assert_eq!([shared_code(&[0, 0]), shared_code(&[7, 0, 7]), shared_code(&[7, 3])], [0, 7, 1]);
    }
}
