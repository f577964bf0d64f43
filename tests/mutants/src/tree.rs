//! The rewritten copy of the tree, and its build.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::find::{self, Mutant, Places};
use crate::schema::{self, Schema};

/// Checks after which something else must be wrong than mutants that do not compile.
const ROUNDS: usize = 20;

/// The module that knows which mutant is on.
const SWITCH: &str = "src/mutant.rs";

/// A mutant with its place in the tree.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub file: String,
    pub mutant: Mutant,
    /// Tells it from others with the same words.
    pub nth: usize,
}

impl Candidate {
    /// What it is called in files. Holds no line number: what is above may grow.
    pub fn key(&self) -> String {
        let Mutant { function, original, mutated, .. } = &self.mutant;
        format!("{}\t{function}\t{}\t{}", self.file, short(original), short(mutated))
    }

    pub fn unique_key(&self) -> String {
        format!("{}\t{}", self.key(), self.nth)
    }
}

/// The test programs of the tree.
pub struct Programs {
    pub unit: PathBuf,
    pub stories: PathBuf,
}

pub struct Tree {
    folder: PathBuf,
    sources: Vec<Source>,
    pub candidates: Vec<Candidate>,
    pub dropped: BTreeSet<u32>,
}

struct Source {
    path: String,
    text: String,
    places: Places,
    first: u32,
}

impl Tree {
    /// Copies what git knows or would know, and finds the mutants in the source files below `chosen`.
    pub fn copy(folder: &Path, chosen: &[String]) -> Result<Self> {
        let listed = Command::new("git").args(["ls-files", "-z", "-c", "-o", "--exclude-standard"]).output()?;
        ensure!(listed.status.success(), "git ls-files failed");
        let mut tree =
            Tree { folder: folder.into(), sources: Vec::new(), candidates: Vec::new(), dropped: BTreeSet::new() };
        let listed = String::from_utf8(listed.stdout)?;
        let known: BTreeSet<&str> = listed.split_terminator('\0').filter(|path| Path::new(path).is_file()).collect();
        for sources in ["src", "tests"] {
            remove_unknown(folder, Path::new(sources), &known)?;
        }
        for path in known {
            if path.starts_with("tests/mutants/") {
                continue;
            }
            let is_chosen = chosen.iter().any(|chosen| Path::new(path).starts_with(chosen));
            if is_chosen && path.ends_with(".rs") && !path.ends_with("/tests.rs") {
                tree.add(path)?;
                continue;
            }
            let to = folder.join(path);
            match path {
                "src/lib.rs" => {
                    let text = fs::read_to_string(path)?;
                    let module = "#![allow(warnings)]\n/// Switches.\npub mod mutant;\npub mod time;";
                    ensure!(text.contains("\npub mod time;"), "src/lib.rs no longer begins with `pub mod time;`");
                    write_if_new(&to, text.replacen("pub mod time;", module, 1).as_bytes())?;
                }
                "Cargo.toml" => {
                    let text = fs::read_to_string(path)? + "\n[workspace]\n";
                    write_if_new(&to, text.replace("unsafe_code = \"deny\"", "").as_bytes())?;
                }
                _ => {
                    write_if_new(&to, &fs::read(path)?)?;
                    fs::set_permissions(&to, fs::metadata(path)?.permissions())?;
                }
            }
        }
        write_if_new(&folder.join(SWITCH), include_bytes!("switch.rs"))?;
        Ok(tree)
    }

    fn add(&mut self, path: &str) -> Result<()> {
        let text = fs::read_to_string(path)?;
        let places = find::places(&text).with_context(|| format!("{path} cannot be read"))?;
        let first = self.candidates.len() as u32;
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        for mutant in places.values().flatten() {
            let mut candidate = Candidate { file: path.into(), mutant: mutant.clone(), nth: 0 };
            let nth = seen.entry(candidate.key()).or_default();
            candidate.nth = *nth;
            *nth += 1;
            self.candidates.push(candidate);
        }
        self.sources.push(Source { path: path.into(), text, places, first });
        Ok(())
    }

    /// Drops what does not compile, round by round: errors of types come before those of borrows.
    pub fn drop_what_does_not_compile(&mut self) -> Result<()> {
        for round in 1..=ROUNDS {
            let schemas = self.write()?;
            let messages = self.cargo(&["check", "--lib"])?;
            let errors: Vec<&Value> =
                messages.iter().map(|message| &message["message"]).filter(|m| m["level"] == "error").collect();
            if errors.is_empty() {
                return Ok(());
            }
            let before = self.dropped.len();
            for error in errors {
                // "Aborting due to..." has no place.
                if error["spans"].as_array().is_some_and(|spans| !spans.is_empty()) {
                    self.dropped.extend(culprits(error, &schemas));
                }
            }
            ensure!(self.dropped.len() > before, "the tree does not compile, and no mutant is to blame");
            eprintln!("check {round}: {} of {} dropped", self.dropped.len(), self.candidates.len());
        }
        bail!("it still does not compile after {ROUNDS} rounds")
    }

    pub fn build(&self) -> Result<Programs> {
        let messages = self.cargo(&["test", "--no-run", "--lib", "--bins", "--test", "it"])?;
        let program = |kind: &str, name: &str| {
            let built = messages.iter().find(|message| {
                let target = &message["target"];
                message["executable"].is_string() && target["kind"][0] == kind && target["name"] == name
            });
            let path = built.and_then(|message| message["executable"].as_str()).map(PathBuf::from);
            path.with_context(|| format!("{name} was not built"))
        };
        Ok(Programs { unit: program("lib", "axcon")?, stories: program("test", "it")? })
    }

    fn write(&self) -> Result<BTreeMap<String, Schema>> {
        let mut schemas = BTreeMap::new();
        for source in &self.sources {
            let is_dropped = |number| self.dropped.contains(&number);
            let schema = schema::write(&source.text, &source.places, source.first, is_dropped);
            write_if_new(&self.folder.join(&source.path), schema.text.as_bytes())?;
            schemas.insert(source.path.clone(), schema);
        }
        Ok(schemas)
    }

    fn cargo(&self, arguments: &[&str]) -> Result<Vec<Value>> {
        let output = Command::new("cargo")
            .args(arguments)
            .args(["--quiet", "--message-format=json"])
            .current_dir(&self.folder)
            .env("CARGO_TARGET_DIR", "target")
            .stderr(Stdio::inherit())
            .output()?;
        let lines = String::from_utf8(output.stdout)?;
        Ok(lines.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
    }
}

/// Which mutants an error is about.
fn culprits(error: &Value, schemas: &BTreeMap<String, Schema>) -> BTreeSet<u32> {
    let spans = error["spans"].as_array().into_iter().flatten().filter_map(|span| {
        let schema = schemas.get(span["file_name"].as_str()?)?;
        let range = span["byte_start"].as_u64()? as usize..span["byte_end"].as_u64()? as usize;
        Some((span["is_primary"] == true, schema, range))
    });
    let spans: Vec<_> = spans.collect();
    for primary in [true, false] {
        let own: BTreeSet<u32> = spans
            .iter()
            .filter(|span| span.0 == primary)
            .flat_map(|(_, schema, range)| {
                schema.branches.iter().filter(|branch| branch.own.start <= range.start && range.end <= branch.own.end)
            })
            .map(|branch| branch.number)
            .collect();
        if !own.is_empty() {
            return own;
        }
    }
    // A place that cannot be an expression of its own: all its mutants.
    let around = spans.iter().flat_map(|(_, schema, range)| {
        schema.branches.iter().filter(|branch| branch.whole.start <= range.start && range.end <= branch.whole.end)
    });
    let around: Vec<_> = around.collect();
    let smallest = around.iter().map(|branch| branch.whole.len()).min();
    if smallest.is_none() {
        eprintln!("{}", error["rendered"].as_str().unwrap_or("an error without words"));
    }
    around.iter().filter(|branch| Some(branch.whole.len()) == smallest).map(|branch| branch.number).collect()
}

/// A file that has been moved since the last time would be there twice.
fn remove_unknown(tree: &Path, below: &Path, known: &BTreeSet<&str>) -> Result<()> {
    let Ok(entries) = fs::read_dir(tree.join(below)) else { return Ok(()) };
    for entry in entries {
        let entry = entry?;
        let path = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            remove_unknown(tree, &path, known)?;
        } else if path.to_str().is_some_and(|path| path != SWITCH && !known.contains(path)) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// So that cargo builds only what has changed.
fn write_if_new(path: &Path, bytes: &[u8]) -> Result<()> {
    if fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    fs::create_dir_all(path.parent().context("a path below the tree")?)?;
    fs::write(path, bytes).with_context(|| format!("{} cannot be written", path.display()))
}

fn short(text: &str) -> String {
    match text.char_indices().nth(120) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.into(),
    }
}
