//! Seeds that only the program itself can make, so that they never go stale: `seeds FOLDER`, which is the corpus.

use std::error::Error;
use std::fs;
use std::path::Path;

use axcon::device::Product;
use axcon::emulator::fault;
use axcon::emulator::memory::ParameterStore;
use axcon::emulator::scenario::{self, Verb};
use axcon::image::Identity;
use axcon::version::Version;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("usage: seeds FOLDER")?;
    let corpus = Path::new(&folder);
    let mut verbs = lines(scenario::HELP, "");
    verbs.extend(lines(fault::HELP, "fault "));
    for line in verbs {
        if !Product::all().iter().any(|product| Verb::read(&line, product).is_ok()) {
            return Err(format!("the help says '{line}', which cannot be read").into());
        }
        let name = line.replace(|character: char| !character.is_ascii_alphanumeric(), "-");
        put(&corpus.join("orders"), &name, line.as_bytes())?;
    }
    let memory = corpus.join("memory");
    put(&memory, "identity", &[&[0][..], &program()].concat())?;
    for (number, product) in (0u8..).zip(Product::all()) {
        put(&memory, &format!("parameters-{number}"), &[&[4 | number][..], &parameters(product)].concat())?;
        put(&memory, &format!("sealed-{number}"), &[&[6 | number][..], &parameters(product)].concat())?;
    }
    Ok(())
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    Ok(fs::write(folder.join(name), bytes)?)
}

/// What can be typed according to a help text, with something in the place of each word in capitals.
fn lines(help: &str, before: &str) -> Vec<String> {
    let mut lines = Vec::new();
    for line in help.lines().filter(|line| !line.contains("...")) {
        let syntax = line.split_once("  ").map_or(line, |(syntax, _)| syntax);
        for alternative in syntax.split(", ") {
            match alternative.split_once(" | one in N") {
                Some((once, rest)) => {
                    let (what, _) = once.split_once(" at ").unwrap_or((once, ""));
                    lines.extend(expanded(&format!("{before}{once}{rest}")));
                    lines.extend(expanded(&format!("{before}{what} one in N{rest}")));
                }
                None => lines.extend(expanded(&format!("{before}{alternative}"))),
            }
        }
    }
    lines
}

/// A line for each choice that it offers: `open N [A|B]` is `open 2 A` and `open 2 B`.
fn expanded(syntax: &str) -> Vec<String> {
    syntax.split_whitespace().fold(vec![String::new()], |lines, word| {
        let word = word.trim_matches(['[', ']']);
        let choices: Vec<&str> = match word {
            "WAY" => vec!["to-unit"],
            "INDEX:SUB" => vec!["6112:1"],
            "ADDRESS" => vec!["0x40"],
            word if word.contains('|') => word.split('|').collect(),
            word if word.bytes().all(|byte| byte.is_ascii_uppercase()) => vec!["2"],
            word => vec![word],
        };
        let joined =
            |line: &String, choice: &str| if line.is_empty() { choice.into() } else { format!("{line} {choice}") };
        lines.iter().flat_map(|line| choices.iter().map(|choice| joined(line, choice)).collect::<Vec<_>>()).collect()
    })
}

/// A small program with an identity block.
fn program() -> Vec<u8> {
    let mut identity = Identity {
        product: "AXTC4CO".into(),
        version: Version::new(1, 2, 0),
        build_date: "2026-01-31".into(),
        build_time: "12:00:00".into(),
        program_words: 0,
        crc: 0,
    };
    let mut program = vec![0; 352];
    identity.stamp(&mut program);
    program
}

/// The parameter memory of a unit whose stream has been switched on.
fn parameters(product: &'static Product) -> Vec<u8> {
    let mut stores = Default::default();
    let mut store = ParameterStore::new(product, 4711, Vec::new(), &mut stores);
    store.change(&mut stores, |values| values.stream.on = true);
    store.image().to_vec()
}
