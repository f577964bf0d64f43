//! The tree keeps its promises: arrows point downward, the pure part touches no system, nothing is left unfinished, and the
//! documents show what the program shows.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use axcon::time::Instant;
use axcon::tui::{App, Input, Options, Palette};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode};

/// The only part of the console on the screen that may touch the system.
const TUI_LOOP: &str = "src/tui/run";

/// Names that bring in the system's clock, threads, files or environment, or an order that changes from run to run.
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
    "Timestamp::now",
    "Zoned::now",
    "TimeZone::system",
    // Several in one would hide what they are.
    "std::{",
];

#[test]
fn arrows_point_downward() {
    let architecture = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/architecture.md"));
    let table = arrows(&architecture);
    for (place, (module, used)) in table.iter().enumerate() {
        let is_below = |name: &&str| table[place + 1..].iter().any(|(lower, _)| lower == name);
        assert!(used.iter().all(is_below), "not all of what {module} may use is below it: {used:?}");
    }
    let arrows: BTreeMap<&str, Vec<&str>> = table.into_iter().collect();
    let sources = sources();
    let modules: BTreeSet<String> = sources.iter().filter_map(|(path, _)| module_of(path)).collect();
    assert!(arrows.keys().all(|module| modules.contains(*module)), "the list of arrows has modules that are gone");
    let mut reversed = Vec::new();
    for (path, text) in sources {
        let Some(module) = module_of(&path) else { continue };
        let allowed =
            arrows.get(module.as_str()).unwrap_or_else(|| panic!("{module} has no place in the list of arrows"));
        for (number, line) in code_lines(&text) {
            assert!(!line.contains("crate::{"), "{}:{number}: several modules in one `use` hide them", path.display());
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
fn nothing_is_left_unfinished() {
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
    for (path, text) in documents() {
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links.filter(|link| !link.contains("://")) {
            let (target, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = root.join(if target.is_empty() { path.clone() } else { folder.join(target) });
            if !target.exists() || !anchor.is_empty() && !anchors(&read(&target)).contains(anchor) {
                dead.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
}

/// What links to the headings of a document have after their `#`.
fn anchors(text: &str) -> BTreeSet<String> {
    // What is between fences is no heading, whatever it begins with.
    let lines = text.split("```").step_by(2).flat_map(str::lines);
    let headings = lines.filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let sign = |sign: char| match sign {
        ' ' => Some('-'),
        '-' | '_' => Some(sign),
        _ => sign.is_alphanumeric().then_some(sign),
    };
    headings.map(|heading| heading.to_lowercase().chars().filter_map(sign).collect()).collect()
}

#[test]
fn a_word_is_spelt_the_same_in_all_documents_and_sources() {
    for (path, text) in documents().into_iter().chain(sources()) {
        let wrong = text.lines().position(|line| line.to_lowercase().contains("check sum"));
        assert_eq!(wrong.map(|line| line + 1), None, "{}: checksum is one word", path.display());
    }
}

/// With this in the environment what a document shows of the program is replaced by what the program shows.
pub const UPDATE: &str = "AXCON_UPDATE_DOCS";

#[test]
fn the_pictures_and_keys_in_the_documents_are_those_of_the_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut pictures, mut screens) = (0, 0);
    for (path, text) in documents() {
        let current = with_blocks(&text, "picture", |name| {
            pictures += 1;
            let snapshot = read(&root.join(format!("src/tui/snapshots/axcon__tui__pictures__{name}.snap")));
            snapshot.splitn(3, "---\n").nth(2).expect("a picture after the header").trim_end().to_owned()
        });
        let current = with_blocks(&current, "keys", |name| {
            screens += 1;
            keys(name)
        });
        if current != text && std::env::var_os(UPDATE).is_some() {
            fs::write(root.join(&path), &current).expect("the document can be written");
            continue;
        }
        let path = path.display();
        assert!(current == text, "{path} shows other pictures or keys than the program; {UPDATE}=1 replaces them");
    }
    assert!(pictures >= 10, "pictures are looked for: {pictures}");
    assert_eq!(screens, SCREENS.len() + 1, "every screen's keys, and those that work everywhere");
}

/// Keys that show the screens.
const SCREENS: &str = "123456789";

/// The keys of a screen, by its name, or those that work `everywhere`, as the help page lists them.
fn keys(name: &str) -> String {
    if name == "everywhere" {
        let page = help_page('1');
        return [&page["The unit's menu"], "", &page["Everywhere"]].join("\n");
    }
    let mut pages = SCREENS.chars().map(help_page);
    pages.find_map(|mut page| page.remove(name)).unwrap_or_else(|| panic!("there is no screen {name}"))
}

/// The help page of the screen that this key shows: the lines of each section, by its heading.
fn help_page(screen: char) -> BTreeMap<String, String> {
    let (columns, rows) = (80, 120);
    let mut app = App::new(Options {
        link: None,
        directory: PathBuf::from("/"),
        home: None,
        palette: Palette::Mono,
        size: (columns, rows),
    });
    for key in [KeyCode::Char(screen), KeyCode::F(1)] {
        app.handle(Instant::ZERO, Input::Terminal(Event::Key(key.into())));
    }
    let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a test backend");
    terminal.draw(|frame| app.draw(frame)).expect("drawing in memory");
    let picture = terminal.backend().to_string();
    let lines = picture.lines().map(|line| line.trim_matches('"').trim_end());
    let mut sections = BTreeMap::new();
    let mut heading = None;
    for line in lines {
        if let Some(rule) = line.strip_prefix("── ") {
            heading = rule.split(" ──").next();
        } else if line.is_empty() {
            heading = None;
        } else if let Some(heading) = heading {
            let section: &mut String = sections.entry(heading.to_owned()).or_default();
            section.push_str(if section.is_empty() { "" } else { "\n" });
            section.push_str(line);
        }
    }
    sections
}

/// The document with every block of text after `<!-- KIND: NAME -->` replaced by what `draw` gives for its name.
pub fn with_blocks(text: &str, kind: &str, mut draw: impl FnMut(&str) -> String) -> String {
    let mark = format!("<!-- {kind}: ");
    let mut current = String::new();
    let mut rest = text;
    while let Some((before, block)) = rest.split_once(&mark) {
        let (name, block) = block.split_once(" -->\n```text\n").expect("a name, then the block");
        let (_, after) = block.split_once("```").expect("the block's end");
        current.push_str(&format!("{before}{mark}{name} -->\n```text\n{}\n```", draw(name)));
        rest = after;
    }
    current + rest
}

#[test]
fn what_the_documents_list_is_all_there_is() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = read(&root.join("Cargo.toml"));
    let architecture = read(&root.join("docs/architecture.md"));
    let mut wanted: Vec<(&str, &str, String)> = Vec::new();
    let dependencies = section(&architecture, "## Dependencies");
    let tables =
        manifest.split("\n[").filter(|table| table.lines().next().unwrap_or_default().contains("dependencies"));
    let crates: Vec<&str> = tables
        .flat_map(|table| table.lines().skip(1))
        .filter_map(|line| line.split(" = ").next().filter(|name| !name.is_empty() && !name.starts_with('#')))
        .collect();
    wanted.extend(crates.iter().map(|name| ("the dependencies in architecture.md", dependencies, (*name).to_owned())));
    let named = first_column(dependencies).into_iter().filter_map(|cell| cell.split(" (").next());
    let gone: Vec<&str> = named.flat_map(|names| names.split(", ")).filter(|name| !crates.contains(name)).collect();
    assert!(gone.is_empty(), "architecture.md has dependencies that Cargo.toml has not: {gone:?}");
    let testing = read(&root.join("docs/testing.md"));
    for name in files("benches", "rs").iter().filter_map(|(path, _)| path.iter().nth(1)?.to_str()) {
        wanted.push(("testing.md", testing.as_str(), name.trim_end_matches(".rs").to_owned()));
    }
    let tui = read(&root.join("docs/tui.md"));
    for (file, name) in [("src/tui/input.rs", "Effect"), ("src/tui/input.rs", "Input")] {
        let variants = variants(&read(&root.join(file)), name);
        wanted.extend(variants.into_iter().map(|variant| ("tui.md", tui.as_str(), variant)));
    }
    assert!(wanted.len() > 70, "names are looked for: {}", wanted.len());
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    let missing: Vec<String> = wanted
        .iter()
        .filter(|(_, text, name)| !text.split(|c| !is_word(c)).any(|word| word == name))
        .map(|(place, _, name)| format!("{place} does not have {name}"))
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn each_file_has_its_place_in_a_table_and_each_row_its_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (architecture, testing) = (read(&root.join("docs/architecture.md")), read(&root.join("docs/testing.md")));
    let mut wrong = Vec::new();
    for (text, heading, folder, extension) in [
        (&architecture, "## Map", "src", "rs"),
        (&testing, "## What proves what", "tests/it", "rs"),
        (&testing, "## Fuzzing", "fuzz/fuzz_targets", "rs"),
        (&testing, "## Foreign programs", "tests/clients", "py"),
    ] {
        let cells = first_column(section(text, heading));
        let names = cells.into_iter().flat_map(|cell| cell.split('`').skip(1).step_by(2));
        let place = |name: &str| {
            let path = if root.join(name).exists() { PathBuf::from(name) } else { Path::new(folder).join(name) };
            if path.extension().is_some() || name.ends_with('/') { path } else { path.with_extension(extension) }
        };
        let listed: Vec<PathBuf> = names.map(place).collect();
        let gone = listed.iter().filter(|path| !root.join(path).exists());
        wrong.extend(gone.map(|path| format!("{heading}: there is no {}", path.display())));
        for (path, _) in files(folder, extension) {
            let is_root = path.ends_with("main.rs") || path == Path::new("src/lib.rs");
            if !is_root && !listed.iter().any(|listed| path.starts_with(listed)) {
                wrong.push(format!("{heading}: {} is not listed", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What each module may use besides itself: the table in `docs/architecture.md`, from top to bottom.
fn arrows(architecture: &str) -> Vec<(&str, Vec<&str>)> {
    let rows = section(architecture, "## Arrows").lines().filter(|line| line.starts_with("| `"));
    let names = rows.map(|row| row.split('`').skip(1).step_by(2).collect::<Vec<_>>());
    names.map(|names| (names[0], names[1..].to_vec())).collect()
}

/// The first cells of the rows of all tables in a section.
fn first_column(section: &str) -> Vec<&str> {
    let mut is_row = false;
    let mut cells = Vec::new();
    for line in section.lines() {
        if is_row && let Some(row) = line.strip_prefix("| ") {
            cells.extend(row.split(" |").next());
        }
        is_row = line.starts_with("|---") || is_row && line.starts_with('|');
    }
    cells
}

/// The part of a document below a heading.
pub fn section<'a>(text: &'a str, heading: &str) -> &'a str {
    let below = text.split_once(heading).unwrap_or_else(|| panic!("no {heading}")).1;
    below.split("\n## ").next().unwrap_or_default()
}

/// The variants of an enumeration in a source file.
pub fn variants(source: &str, name: &str) -> Vec<String> {
    let body = source.split_once(&format!("pub enum {name} {{")).unwrap_or_else(|| panic!("no {name}")).1;
    let lines = body.split("\n}").next().unwrap_or_default().lines().filter_map(|line| line.strip_prefix("    "));
    let words = lines.filter_map(|line| line.split(|c: char| !c.is_alphanumeric()).next());
    words.filter(|word| word.starts_with(|c: char| c.is_ascii_uppercase())).map(str::to_owned).collect()
}

#[test]
fn the_limits_in_the_documents_are_those_of_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut wrong = Vec::new();
    let mut found = 0;
    for (path, text) in documents() {
        for (number, line) in text.lines().enumerate() {
            let cells: Vec<&str> = line.split('|').map(str::trim).collect();
            for pair in cells.windows(2) {
                let Some((file, name)) = constant(pair[1]) else { continue };
                found += 1;
                let code = read(&root.join(file));
                let definition = code.split(&format!("const {name}: ")).nth(1).and_then(|rest| rest.split(';').next());
                let says = definition.and_then(|definition| definition.split(" = ").nth(1)).unwrap_or("nothing");
                if limit(pair[0]).is_none_or(|limit| coded(says) != Some(limit)) {
                    wrong.push(format!("{}:{}: {name} is {says}, not {}", path.display(), number + 1, pair[0]));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "limits that the code does not have:\n{}", wrong.join("\n"));
    assert!(found >= 20, "limits are looked for: {found}");
}

/// File and name, if a cell names a constant: `src/session/upload.rs::RESTART` in backticks.
fn constant(cell: &str) -> Option<(&str, &str)> {
    let (file, name) = cell.strip_prefix('`')?.strip_suffix('`')?.split_once(".rs::")?;
    let is_constant = name.bytes().all(|byte| byte.is_ascii_uppercase() || byte == b'_');
    is_constant.then(|| (&cell[1..file.len() + 4], name))
}

/// A number, or a time in ms, as the documents write it: `550`, `1.5 s`, `80 ms`.
fn limit(cell: &str) -> Option<f64> {
    let (number, unit) = cell.split_once(' ').unwrap_or((cell, ""));
    let number: f64 = number.replace(',', "").parse().ok()?;
    match unit {
        "" | "ms" => Some(number),
        "s" => Some((number * 1000.0).round()),
        _ => None,
    }
}

/// The same, as the code writes it.
fn coded(definition: &str) -> Option<f64> {
    let (factor, number) = match definition.trim_end_matches(')').split_once('(') {
        Some(("Duration::from_secs", number)) => (1000.0, number),
        Some(("Duration::from_millis", number)) => (1.0, number),
        _ => (1.0, definition),
    };
    number.replace('_', "").parse::<f64>().ok().map(|number| number * factor)
}

pub fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The README and everything in `docs`, with their text.
pub fn documents() -> Vec<(PathBuf, String)> {
    let readme = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md"));
    files("docs", "md").into_iter().chain([("README.md".into(), readme)]).collect()
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
pub fn files(folder: &str, extension: &str) -> Vec<(PathBuf, String)> {
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

/// Lines of code with their numbers, without comments.
fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
        .map(|(number, line)| (number + 1, line))
}

/// First path segments after `crate::` in a line.
fn crate_paths(line: &str) -> Vec<String> {
    line.split("crate::")
        .skip(1)
        .map(|rest| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect())
        .collect()
}
