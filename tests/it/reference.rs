//! `docs/cli.md` is what the command line says of itself, the README agrees with it, and the examples in the documents work.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::Duration;

use clap::builder::StyledStr;
use clap::{Arg, ArgAction, Command};
use rustix::process::Signal;

use crate::support::shell::{Ran, Running, World};
use crate::tidy::{UPDATE, documents, read, section};

#[test]
fn the_reference_is_what_the_command_line_says_of_itself() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md");
    let mut command = axcon::cli::command();
    command.build();
    let mut reference = String::from(
        "# Commands\n\nMade from the command line itself: `AXCON_UPDATE_DOCS=1 cargo test --test it the_reference` rewrites \
         it.\nOptions that every command has are listed under `axcon`.\n",
    );
    describe(&command, &mut reference);
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&path, &reference).expect("written");
    }
    let current = fs::read_to_string(&path).unwrap_or_default();
    assert!(current == reference, "docs/cli.md is not what the command line says; {UPDATE}=1 rewrites it");
}

fn describe(command: &Command, out: &mut String) {
    let name = command.get_bin_name().unwrap_or_else(|| command.get_name()).to_owned();
    let is_root = !name.contains(' ');
    let text = |text: Option<&StyledStr>| text.map(ToString::to_string).unwrap_or_default();
    let about = command.get_long_about().or_else(|| command.get_about());
    write!(out, "\n## {name}\n\n{}\n", text(about).trim()).expect("a string");
    let usage = command.clone().render_usage().to_string();
    write!(out, "\n```text\n{}\n```\n", usage.trim_start_matches("Usage: ").trim()).expect("a string");
    // Every command has these; an option of the same name that takes a value is its own.
    let is_of_all = |arg: &Arg| {
        matches!(arg.get_action(), ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong | ArgAction::Version)
    };
    let described = |arg: &&Arg| !arg.is_hide_set() && (is_root || !arg.is_global_set()) && !is_of_all(arg);
    let rows: Vec<String> = command.get_arguments().filter(described).map(row).collect();
    if !rows.is_empty() {
        write!(out, "\n| argument | means |\n|---|---|\n{}\n", rows.join("\n")).expect("a string");
    }
    if let Some(after) = command.get_after_long_help().filter(|_| is_root) {
        write!(out, "\n```text\n{after}\n```\n").expect("a string");
    }
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        describe(inner, out);
    }
}

fn row(arg: &Arg) -> String {
    let takes_value =
        !matches!(arg.get_action(), ArgAction::SetTrue | ArgAction::Count | ArgAction::Help | ArgAction::Version);
    let names = arg.get_value_names().map(|names| names.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "));
    let value = names.filter(|_| takes_value).unwrap_or_default();
    let short = arg.get_short().map(|short| format!("-{short}, ")).unwrap_or_default();
    let shown = match arg.get_long() {
        Some(long) => format!("{short}--{long} {value}"),
        None => format!("[{value}]"),
    };
    let help = arg.get_long_help().or_else(|| arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let mut means = help.split_whitespace().collect::<Vec<_>>().join(" ");
    if !means.ends_with('.') {
        means.push('.');
    }
    let choices: Vec<String> = arg
        .get_possible_values()
        .iter()
        .filter(|_| takes_value)
        .map(|value| format!("`{}`", value.get_name()))
        .collect();
    if !choices.is_empty() {
        write!(means, " One of {}.", choices.join(", ")).expect("a string");
    }
    let defaults: Vec<String> =
        arg.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect();
    if takes_value && !defaults.is_empty() {
        write!(means, " Default: `{}`.", defaults.join(" ")).expect("a string");
    }
    if let Some(variable) = arg.get_env() {
        write!(means, " Environment: `{}`.", variable.to_string_lossy()).expect("a string");
    }
    // A bar would end the cell, even within the ticks of code.
    let cell = |text: &str| text.replace('|', "\\|");
    format!("| `{}` | {} |", cell(shown.trim()), cell(&means))
}

#[test]
fn completions_and_man_pages_name_every_command() {
    let world = World::new();
    let names: Vec<String> =
        axcon::cli::command().get_subcommands().map(|command| command.get_name().to_owned()).collect();
    assert!(names.len() > 10);
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let ran = world.run(&["completions", shell], b"");
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(names.iter().all(|name| ran.out.contains(name.as_str())), "{shell}: {}", ran.out);
    }
    assert_eq!(world.run(&["man", "--out", "pages"], b"").code, Some(0));
    for name in &names {
        assert!(world.path(&format!("pages/axcon-{name}.1")).exists(), "{name}");
    }
    let page = world.run(&["man"], b"");
    assert!(page.out.contains(".TH axcon 1") && page.out.contains("waits in its loader"), "{}", page.out);
    fs::write(world.path("file"), "").expect("written");
    let ran = world.run(&["man", "--out", "file"], b"");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("cannot write man pages to 'file'"), "{}", ran.err);
}

#[test]
fn the_version_says_what_was_built() {
    let world = World::new();
    assert_eq!(world.run(&["-V"], b"").out, format!("axcon {}\n", env!("CARGO_PKG_VERSION")));
    let long = world.run(&["--version"], b"").out;
    assert!(long.starts_with(&format!("axcon {}\n", env!("CARGO_PKG_VERSION"))) && long.lines().count() == 2, "{long}");
    assert!(long.contains("debug") || long.contains("release"), "{long}");
}

#[test]
fn the_exit_codes_of_the_readme_are_those_of_the_help() {
    let help = axcon::cli::command().get_after_long_help().expect("the exit codes").to_string();
    let coded = |(code, means): (&str, &str)| {
        let is_code = !code.is_empty() && code.bytes().all(|byte| byte.is_ascii_digit());
        is_code.then(|| (code.to_owned(), means.trim().to_owned()))
    };
    let helped: Vec<_> =
        help.lines().filter_map(|line| line.strip_prefix("  ")?.split_once(' ')).filter_map(coded).collect();
    let readme = readme().replace('`', "");
    let printed: Vec<_> = section(&readme, "## Exit codes")
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | "))
        .filter_map(coded)
        .collect();
    let codes = |table: &[(String, String)]| table.iter().map(|(code, _)| code.clone()).collect::<Vec<_>>();
    assert!(printed.len() > 10, "{printed:?}");
    assert_eq!(codes(&printed), codes(&helped));
    // One may say more than the other, and nothing else.
    for ((code, printed), (_, helped)) in printed.iter().zip(&helped) {
        assert!(printed.starts_with(helped) || helped.starts_with(printed), "{code}: '{printed}', but '{helped}'");
    }
}

fn readme() -> String {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md"))
}

/// What the README calls an image is one that this makes.
const MAKE_IMAGE: [&str; 10] =
    ["image", "make", "--product", "axtc4co", "--version", "1.2.0", "--words", "1600", "--out", "IMAGE"];

/// The commands run as they are printed. What they leave to the user is given here: the port and the password by the
/// environment, the answer to a question by `--yes`, the end of a stream by an interrupt.
#[test]
fn the_everyday_commands_of_the_readme_work() {
    let readme = readme();
    let cells = section(&readme, "## Everyday tasks").lines().filter_map(|line| line.split('|').nth(3));
    let commands: Vec<&str> =
        cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).filter(|text| text.starts_with("axcon ")).collect();
    assert!(commands.len() >= 8, "{commands:?}");
    let world = World::new();
    let unit = world.start(&["emulate", "axtc4co", "--link", "u0", "--line-rate", "off"]);
    unit.wait_out("serial: ");
    assert_eq!(world.run(&MAKE_IMAGE, b"").code, Some(0));
    for command in commands {
        let mut args: Vec<&str> = command.split(' ').skip(1).collect();
        let file_of_a_stream = match args[..] {
            ["stream", .., "--out", file] if !args.contains(&"--count") => Some(file),
            ["load", ..] => {
                args.push("--yes");
                None
            }
            _ => None,
        };
        let mut started = world.command(&args);
        started.env("AXCON_PORT", "u0").env("AXCON_PASSWORD", "AXIO-2010");
        let running = Running::start(started);
        if let Some(file) = file_of_a_stream {
            world.wait_in(file, ",fv,");
            running.signal(Signal::INT);
        }
        let ran = running.wait_within(EXAMPLE);
        assert_eq!(ran.code, Some(0), "{command}\n{}\n{}", ran.out, ran.err);
    }
}

/// The longest an example may take: its units run in real time, on a machine that may be busy.
const EXAMPLE: Duration = Duration::from_secs(240);

/// A file that a document prints: the block after `<!-- file: NAME -->`.
struct Printed {
    document: String,
    name: String,
    language: String,
    text: String,
}

fn printed_files() -> Vec<Printed> {
    let mut files = Vec::new();
    for (path, text) in documents() {
        for rest in text.split("<!-- file: ").skip(1) {
            let (name, rest) = rest.split_once(" -->\n```").expect("a name, then the file");
            let (language, rest) = rest.split_once('\n').expect("a language");
            let (text, _) = rest.split_once("```").expect("the file's end");
            files.push(Printed {
                document: path.display().to_string(),
                name: name.into(),
                language: language.into(),
                text: text.into(),
            });
        }
    }
    files
}

/// A world with the files of a document.
fn world_of(document: &str) -> World {
    let world = World::new();
    let files: Vec<Printed> = printed_files().into_iter().filter(|file| file.document == document).collect();
    assert!(!files.is_empty(), "{document} prints no file");
    files.iter().for_each(|file| fs::write(world.path(&file.name), &file.text).expect("written"));
    world
}

/// Runs another program, usually on one of those files, with this on its standard input.
fn run_example(world: &World, program: &Path, args: &[&str], input: &[u8]) -> Ran {
    let mut running = Running::start(world.tool(program, args));
    running.input(input);
    running.end_input();
    running.wait_within(EXAMPLE)
}

#[test]
fn every_script_in_the_documents_is_a_file_that_a_test_runs() {
    let mut printed: Vec<String> = Vec::new();
    for (path, text) in documents() {
        let scripts = text.matches("\n```sh\n").count() + text.matches("\n```python\n").count();
        let document = path.display().to_string();
        let is_script =
            |file: &&Printed| file.document == document && ["sh", "python"].contains(&file.language.as_str());
        let files = printed_files();
        let files: Vec<String> =
            files.iter().filter(is_script).map(|file| format!("{document} {}", file.name)).collect();
        assert_eq!(files.len(), scripts, "{document} has a script that no test runs");
        printed.extend(files);
    }
    printed.sort();
    assert_eq!(
        printed,
        [
            "README.md upload.sh",
            "docs/automation.md check.sh",
            "docs/automation.md test_unit.py",
            "docs/emulator.md faults.sh"
        ]
    );
}

#[test]
fn the_upload_of_the_readme_works_as_printed() {
    let world = world_of("README.md");
    let ran = run_example(&world, Path::new("/bin/sh"), &["-eu", "upload.sh"], b"");
    assert_eq!(ran.code, Some(0), "{}\n{}", ran.out, ran.err);
    assert!(ran.out.contains("V1.2.0"), "{}\n{}", ran.out, ran.err);
}

#[test]
fn the_shell_example_for_test_automation_works_as_printed() {
    let world = world_of("docs/automation.md");
    let ran = run_example(&world, Path::new("/bin/sh"), &["check.sh"], b"");
    assert_eq!(ran.code, Some(0), "{}\n{}", ran.out, ran.err);
    assert!(ran.out.ends_with("all as it should be\n"), "{}\n{}", ran.out, ran.err);
}

#[test]
fn the_pytest_example_for_test_automation_works_as_printed() {
    let Some(python) = std::env::var_os("AXCON_TEST_PYTHON") else {
        // Straight to the stream: what the test harness captures of a test that passes is never seen.
        let _ = std::io::Write::write_all(
            &mut std::io::stderr(),
            b"skipped: no pytest; set AXCON_TEST_PYTHON to a Python with pytest and pyserial, as .ci/run does\n",
        );
        return;
    };
    let world = world_of("docs/automation.md");
    let ran = run_example(&world, Path::new(&python), &["-m", "pytest", "-q", "test_unit.py"], b"");
    assert_eq!(ran.code, Some(0), "{}\n{}", ran.out, ran.err);
    assert!(ran.out.contains("4 passed"), "{}", ran.out);
}

#[test]
fn the_examples_of_scenarios_and_faults_are_taken_as_printed() {
    let world = world_of("docs/emulator.md");
    let ran = world.run(&["emulate", "axtc4co", "--scenario", "engine.toml"], b"quit\n");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{}", ran.out);
    let ran = run_example(&world, Path::new("/bin/sh"), &["faults.sh"], b"quit\n");
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{}", ran.out);
}
