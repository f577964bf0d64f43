//! The tree keeps its promises: arrows point downward, the pure part touches no system, nothing stays behind.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What each module may use, itself aside. `docs/architecture.md` draws it.
const ARROWS: &[(&str, &[&str])] = &[
    ("time", &[]),
    ("rng", &[]),
    ("version", &[]),
    ("secret", &[]),
    ("endpoint", &["time"]),
    ("record", &["endpoint", "time"]),
    ("wire", &["canopen", "record", "version"]),
    ("image", &["rng", "version"]),
    ("canopen", &[]),
    ("telnet", &[]),
    ("device", &["canopen", "image", "time", "version", "wire"]),
    ("session", &["canopen", "device", "endpoint", "image", "record", "secret", "time", "version", "wire"]),
    ("dump", &["canopen", "device", "session", "wire"]),
    ("monitor", &["device", "endpoint", "record", "session", "time", "wire"]),
    ("report", &["device", "dump", "monitor", "record", "session", "time", "wire"]),
    ("emulator", &["canopen", "device", "endpoint", "image", "rng", "time", "version", "wire"]),
    ("host", &["canopen", "device", "emulator", "endpoint", "image", "record", "rng", "telnet", "time", "version"]),
    (
        "tui",
        &[
            "canopen", "device", "dump", "endpoint", "image", "monitor", "record", "secret", "session", "time",
            "version", "wire",
        ],
    ),
    (
        "cli",
        &[
            "canopen", "device", "dump", "emulator", "endpoint", "host", "image", "monitor", "record", "report",
            "secret", "session", "telnet", "time", "tui", "version", "wire",
        ],
    ),
];

/// The one part of the console on the screen that may touch the system.
const TUI_LOOP: &str = "src/tui/run";

/// Names that bring in the system's clock, threads, files, environment, or an order that changes from run to run.
const BANNED_IN_THE_PURE_PART: &[&str] = &[
    "std::time",
    "SystemTime",
    "std::thread",
    "std::fs",
    "std::env",
    "std::net",
    "std::process",
    "HashMap",
    "HashSet",
    "rustix",
    "serialport",
    "crossterm::event::read",
    "crossterm::event::poll",
];

#[test]
fn arrows_point_downward() {
    let arrows: BTreeMap<&str, &[&str]> = ARROWS.iter().copied().collect();
    let mut reversed = Vec::new();
    for (path, text) in sources() {
        let Some(module) = module_of(&path) else { continue };
        let allowed =
            arrows.get(module.as_str()).unwrap_or_else(|| panic!("{module} has no place in the list of arrows"));
        for (number, line) in code_lines(&text) {
            for used in crate_paths(line) {
                let is_loop = path.starts_with(TUI_LOOP) && used == "host";
                if used != module && !is_loop && arrows.contains_key(used.as_str()) && !allowed.contains(&used.as_str())
                {
                    reversed.push(format!("{}:{number}: {module} -> {used}", path.display()));
                }
            }
        }
    }
    assert!(reversed.is_empty(), "arrows that point upward or sideways:\n{}", reversed.join("\n"));
}

#[test]
fn the_pure_part_touches_no_system() {
    let mut found = Vec::new();
    for (path, text) in sources() {
        let Some(module) = module_of(&path) else { continue };
        if matches!(module.as_str(), "host" | "cli") || path.starts_with(TUI_LOOP) {
            continue;
        }
        for (number, line) in code_lines(&text) {
            for name in BANNED_IN_THE_PURE_PART.iter().filter(|name| line.contains(*name)) {
                found.push(format!("{}:{number}: {name}", path.display()));
            }
        }
    }
    assert!(found.is_empty(), "the pure part touches the system:\n{}", found.join("\n"));
}

#[test]
fn nothing_is_left_open() {
    let marks = [
        "to".to_owned() + "do!(",
        "unimplemented".to_owned() + "!(",
        "#[ig".to_owned() + "nore",
        "FIX".to_owned() + "ME",
    ];
    for (path, text) in sources().into_iter().chain(files("tests", "rs")) {
        for mark in &marks {
            assert!(!text.contains(mark.as_str()), "{} holds {mark}", path.display());
        }
    }
}

#[test]
fn every_link_in_the_documents_leads_somewhere() {
    let mut dead = Vec::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = ("README.md".into(), fs::read_to_string(root.join("README.md")).expect("a README"));
    for (path, text) in files("docs", "md").into_iter().chain([readme]) {
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = link.split('#').next().unwrap_or_default();
            if !target.is_empty() && !target.contains("://") && !root.join(&folder).join(target).exists() {
                dead.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
}

/// With this in the environment the pictures in the documents are replaced by those the program draws.
const UPDATE: &str = "AXCON_UPDATE_DOCS";

#[test]
fn the_pictures_in_the_documents_are_those_the_program_draws() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut shown = 0;
    for (path, text) in files("docs", "md").into_iter().chain([("README.md".into(), read(&root.join("README.md")))]) {
        let mut current = String::new();
        let mut rest = text.as_str();
        while let Some((before, behind)) = rest.split_once("<!-- picture: ") {
            let (name, behind) = behind.split_once(" -->\n```text\n").expect("a name, then the picture");
            let (_, behind) = behind.split_once("```").expect("the picture's end");
            let snapshot = read(&root.join(format!("src/tui/snapshots/axcon__tui__pictures__{name}.snap")));
            let picture = snapshot.splitn(3, "---\n").nth(2).expect("a picture behind the header").trim_end();
            current.push_str(&format!("{before}<!-- picture: {name} -->\n```text\n{picture}\n```"));
            rest = behind;
            shown += 1;
        }
        current.push_str(rest);
        if current != text && std::env::var_os(UPDATE).is_some() {
            fs::write(root.join(&path), &current).expect("the document can be written");
            continue;
        }
        let path = path.display();
        assert!(current == text, "{path} shows other pictures than the program draws; {UPDATE}=1 replaces them");
    }
    assert!(shown >= 10, "pictures are looked for: {shown}");
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// All source files and tests with their text, by their paths from the repository's root.
pub fn sources_and_tests() -> Vec<(String, String)> {
    sources()
        .into_iter()
        .chain(files("tests", "rs"))
        .map(|(path, text)| (path.to_string_lossy().into_owned(), text))
        .collect()
}

fn sources() -> Vec<(PathBuf, String)> {
    files("src", "rs")
}

/// All files below a folder with an extension, with their text, as paths from the repository's root.
fn files(folder: &str, extension: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    let mut folders = vec![root.join(folder)];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for entry in entries.flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|found| found == extension) {
                let text = fs::read_to_string(&path).expect("a readable file");
                found.push((path.strip_prefix(root).expect("below the root").to_path_buf(), text));
            }
        }
    }
    found.sort();
    found
}

/// The top-level module a source file belongs to; `None` for the crate's roots.
fn module_of(path: &Path) -> Option<String> {
    let below = path.strip_prefix("src").ok()?;
    let first = below.iter().next()?.to_str()?;
    let module = first.strip_suffix(".rs").unwrap_or(first);
    (!matches!(module, "lib" | "main")).then(|| module.to_owned())
}

/// Lines of code with their numbers: no comments.
fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
        .map(|(number, line)| (number + 1, line))
}

/// First path segments behind `crate::` in a line.
fn crate_paths(line: &str) -> Vec<String> {
    line.split("crate::")
        .skip(1)
        .map(|rest| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect())
        .collect()
}
