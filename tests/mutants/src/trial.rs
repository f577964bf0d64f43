//! Tests run as programs: which mutants each reaches, and whether any fails with one.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

/// Stories that need programs, pseudo-terminals and real time, or read the tree: slow, and a busy computer fails them.
const LEFT_OUT: [&str; 9] = ["commands", "eds", "hostile", "lines", "live", "network", "ptys", "reference", "tidy"];

/// Seeds of the swarm and of the dialects. They usually run many more.
const SEEDS: &str = "30";

/// A test, and what it is worth here.
pub struct Test {
    pub program: PathBuf,
    pub name: String,
    pub is_unit: bool,
    pub takes: Duration,
    pub reaches: BTreeSet<u32>,
}

/// How tests ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    Passed,
    /// This one failed.
    Failed(String),
    /// The program ended otherwise.
    Crashed,
    TimedOut,
}

/// The tests in a program.
pub fn list(program: &Path, is_unit: bool) -> Result<Vec<Test>> {
    let output = Command::new(program).arg("--list").output().context("tests cannot be listed")?;
    let text = String::from_utf8(output.stdout)?;
    let names = text.lines().filter_map(|line| line.strip_suffix(": test"));
    let wanted =
        names.filter(|name| is_unit || !LEFT_OUT.iter().any(|module| name.starts_with(&format!("{module}::"))));
    let test = |name: &str| Test {
        program: program.into(),
        name: name.into(),
        is_unit,
        takes: Duration::ZERO,
        reaches: BTreeSet::new(),
    };
    Ok(wanted.map(test).collect())
}

/// Runs a test alone and notes what it reaches and how long it takes. Whether it passes.
pub fn measure(test: &mut Test, tree: &Path, notes: &Path) -> Result<bool> {
    let _ = fs::remove_file(notes);
    let begun = Instant::now();
    let limit = Duration::from_secs(60);
    let end = run(&test.program, &[&test.name], tree, ("MUTANTS_REACHED", &notes.to_string_lossy()), limit)?;
    test.takes = begun.elapsed();
    let reached = fs::read_to_string(notes).unwrap_or_default();
    test.reaches = reached.lines().filter_map(|line| line.parse().ok()).collect();
    Ok(end == End::Passed)
}

/// Runs these tests of one program one after the other, until one fails.
pub fn run(program: &Path, tests: &[&str], tree: &Path, variable: (&str, &str), limit: Duration) -> Result<End> {
    let mut child = Command::new(program)
        .args(["--test-threads=1", "--exact"])
        .args(tests)
        .current_dir(tree)
        .env("CARGO_MANIFEST_DIR", tree)
        .env("AXCON_SEEDS", SEEDS)
        .env(variable.0, variable.1)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
        .with_context(|| format!("{} does not run", program.display()))?;
    let lines = BufReader::new(child.stdout.take().context("it has an output")?).lines();
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| sender.send(line)));
    let deadline = Instant::now() + limit;
    loop {
        match receiver.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(line) => {
                let failed = line.strip_prefix("test ").and_then(|rest| rest.strip_suffix("FAILED"));
                if let Some((name, _)) = failed.and_then(|rest| rest.split_once(" ... ")) {
                    end(&mut child)?;
                    return Ok(End::Failed(name.into()));
                }
            }
            Err(RecvTimeoutError::Timeout) => {
                end(&mut child)?;
                return Ok(End::TimedOut);
            }
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    Ok(if child.wait()?.success() { End::Passed } else { End::Crashed })
}

/// Ends a test program and what it has started.
fn end(child: &mut Child) -> Result<()> {
    Command::new("kill").args(["-KILL", "--", &format!("-{}", child.id())]).stderr(Stdio::null()).status()?;
    child.wait()?;
    Ok(())
}
