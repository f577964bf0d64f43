//! The command line: what can be asked for, and where each answer is made.

pub mod ask;
pub mod calendar;
pub mod console;
pub mod defaults;
pub mod diagnostics;
pub mod dictionary;
pub mod eds;
pub mod emulate;
pub mod error;
pub mod files;
pub mod identify;
pub mod image;
pub mod journal;
pub mod link;
pub mod load;
pub mod manual;
pub mod names;
pub mod numbers;
pub mod outcome;
pub mod output;
pub mod password;
pub mod playback;
pub mod ports;
pub mod report;
pub mod stream;
pub mod talk;
pub mod terminal;
pub mod waiting;

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::device::BAUD;
use error::CliError;
use output::Output;

/// Console and emulator for Axiomatic CANopen signal scanners.
///
/// Without a command: the console on the screen.
#[derive(Debug, Parser)]
#[command(
    name = "axcon",
    version,
    long_version = LONG_VERSION,
    propagate_version = true,
    max_term_width = 100,
    after_long_help = EXIT_CODES
)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    command: Option<Command>,
}

/// Version, commit where known, target and profile of the build.
const LONG_VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\n", env!("AXCON_BUILD"));

/// What the exit codes mean, for the long help and the man page.
const EXIT_CODES: &str = "Exit codes:
  0    done
  1    failed otherwise
  2    the command line makes no sense, or it destroys something and nobody said --yes
  3    the port: none, several, missing, denied, busy, gone, or not at this line rate
  4    no answer in time, or a question that is not understood
  5    the image is refused: it has defects, cannot be read, or is not for this unit
  6    the unit refused, a wrong password above all
  7    the upload failed and the unit waits in its loader: send again
  8    the upload failed and nobody can say what the unit is now
  9    the unit runs, but not what was sent
  130  interrupted, by a key or a signal (SIGINT, SIGTERM, SIGHUP)
`stream` and `diagnostics` that were not told when to end (--count, --duration) are ended by an interrupt as is usual: 0
once something has come.
If `load` to several ports fails: the code that all failures share, else 1.
A reader that closes our output is not a failure; nor is an output that was closed before we began (>&-), which the system's
runtime replaces with /dev/null and nobody can see.";

/// What every command understands.
#[derive(Debug, Clone, Args)]
pub struct Global {
    /// Where the unit is: a serial port (/dev/ttyUSB0, COM3, or its USB adapter's serial number), a port served over a
    /// network (rfc2217://HOST:PORT, tcp://HOST:PORT), an emulated unit (emu:axtc4co), or a recording (replay:FILE).
    /// `load` takes several.
    #[arg(long = "port", value_name = "LINK", env = "AXCON_PORT", global = true)]
    pub ports: Vec<String>,
    /// Line rate in baud; the units have 115200.
    #[arg(long, value_name = "RATE", default_value_t = BAUD, global = true, allow_negative_numbers = true, value_parser = numbers::within::<u32>(50..=12_000_000))]
    pub baud: u32,
    /// Data and errors as JSON. Not for `terminal`, `eds`, `completions` and `man`, whose output has a form of its own.
    #[arg(long, global = true)]
    pub json: bool,
    /// Answer yes to every question, and replace files that are there.
    #[arg(long, short = 'y', global = true)]
    pub yes: bool,
    /// Record to this file instead of the state directory; one that is there is replaced only with --yes.
    #[arg(long, value_name = "FILE", global = true, conflicts_with = "no_record")]
    pub record: Option<PathBuf>,
    /// Record nothing.
    #[arg(long, global = true)]
    pub no_record: bool,
}

impl Global {
    /// The one link that was named, if one was.
    pub fn port(&self) -> Option<&str> {
        self.ports.first().map(String::as_str)
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the serial ports, and who holds them.
    Ports(ports::Args),
    /// Find out what is at the other end.
    Identify(identify::Args),
    /// A plain terminal: keys out, bytes in.
    Terminal(terminal::Args),
    /// Switch the data stream on and write it down.
    Stream(stream::Args),
    /// Read the unit's diagnostics pages.
    Diagnostics(diagnostics::Args),
    /// Read or compare object dictionaries.
    Dictionary(dictionary::Args),
    /// Put everything known of a unit on one page of HTML.
    Report(report::Args),
    /// Check an image, upload it, and verify the new banner.
    Load(load::Args),
    /// Restore the factory's object dictionary.
    Defaults(defaults::Args),
    /// Work on image files: check, compare, convert, make.
    Image(image::Args),
    /// Write a product's electronic data sheet.
    Eds(eds::Args),
    /// Host emulated units on pseudo-terminals.
    Emulate(emulate::Args),
    /// Write completions for a shell.
    Completions(manual::CompletionArgs),
    /// Write man pages.
    Man(manual::ManArgs),
}

impl Command {
    /// Whether it matters to the command where a unit is.
    fn looks_at_a_unit(&self) -> bool {
        match self {
            Command::Identify(_)
            | Command::Terminal(_)
            | Command::Stream(_)
            | Command::Diagnostics(_)
            | Command::Report(_)
            | Command::Load(_)
            | Command::Defaults(_) => true,
            Command::Dictionary(args) => args.reads_a_unit(),
            Command::Ports(_)
            | Command::Image(_)
            | Command::Eds(_)
            | Command::Emulate(_)
            | Command::Completions(_)
            | Command::Man(_) => false,
        }
    }

    /// What the command writes, where that has a form of its own and so none in JSON.
    fn form_of_its_own(&self) -> Option<&'static str> {
        match self {
            Command::Eds(_) => Some("an electronic data sheet"),
            Command::Completions(_) => Some("a script for a shell"),
            Command::Man(_) => Some("man pages"),
            _ => None,
        }
    }
}

/// The commands by what they are for, in the order in which the help lists them.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Find a unit and talk to it", &["ports", "identify", "terminal"]),
    ("Read a unit", &["stream", "diagnostics", "dictionary", "report"]),
    ("Change a unit", &["load", "defaults"]),
    ("Work without a unit", &["image", "eds", "emulate"]),
    ("Set up your shell", &["completions", "man"]),
];

/// The whole command line as clap knows it: what completions, man pages and the reference are made from.
pub fn command() -> clap::Command {
    let command = Cli::command();
    // clap lists all commands under one heading.
    let listed = listed(&command);
    command.help_template(format!(
        "{{before-help}}{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{listed}Options:\n{{options}}{{after-help}}"
    ))
}

/// The commands in their groups, for the help.
fn listed(command: &clap::Command) -> String {
    let abouts = |name: &str| command.find_subcommand(name).and_then(clap::Command::get_about);
    let group = |(title, names): &(&str, &[&str])| {
        let rows = names.iter().map(|name| match abouts(name) {
            Some(about) => format!("  {name:<12} {about}\n"),
            None => format!("  {name}\n"),
        });
        format!("{title}:\n{}\n", rows.collect::<String>())
    };
    GROUPS.iter().map(group).collect()
}

/// Runs the program and gives its exit code.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let parsed = command().try_get_matches_from(&args);
    let parsed = parsed.and_then(|matches| Cli::from_arg_matches(&matches).map(|cli| (cli, matches)));
    let (mut cli, matches) = match parsed {
        Ok(parsed) => parsed,
        // With --json a complaint is JSON too; help and version are not complaints.
        Err(error) if error.use_stderr() && args.iter().any(|arg| arg == "--json") => {
            let text = error.render().to_string();
            let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
            let what = lines.next().unwrap_or_default().trim_start_matches("error: ").to_owned();
            let error = lines.fold(CliError::message(error::Kind::Usage, what), |error, line| error.hint(line));
            return output::conclude(&mut Output::standard(true), Err(error));
        }
        Err(error) => {
            let printed = error.print().and_then(|()| io::stdout().flush());
            return match printed {
                // Help and version are the data of such a command.
                Err(unwritten) if !error.use_stderr() => {
                    let json = args.iter().any(|arg| arg == "--json");
                    output::conclude(&mut Output::standard(json), Err(output::unwritten(unwritten)))
                }
                _ => u8::try_from(error.exit_code()).unwrap_or(2),
            };
        }
    };
    // An empty AXCON_PORT counts as unset.
    if std::env::var_os("AXCON_PORT").is_some_and(|port| port.is_empty()) {
        cli.global.ports.retain(|port| !port.is_empty());
    }
    let mut output = Output::standard(cli.global.json);
    let result = all_ports(&cli.global, &args)
        .and_then(|()| all_of_use(&cli, &matches))
        .and_then(|()| dispatch(cli, &mut output));
    output::conclude(&mut output, result)
}

/// Makes sure that no link is lost that was named before the command: the same option after it would replace it, and
/// one of several units would never get its software.
fn all_ports(global: &Global, args: &[OsString]) -> Result<(), CliError> {
    let options = args.iter().take_while(|arg| *arg != "--").map(|arg| arg.to_string_lossy());
    let named = options.filter(|arg| arg == "--port" || arg.starts_with("--port=")).count();
    if named <= global.ports.len() {
        return Ok(());
    }
    Err(CliError::message(error::Kind::Usage, "--port is given both before the command and after it")
        .hint("name all links after the command"))
}

/// Makes sure that no option is given that the command would ignore: `--json` where there is no JSON, or an option for
/// the link to a unit where there is none. A default in the environment is given to all.
fn all_of_use(cli: &Cli, matches: &ArgMatches) -> Result<(), CliError> {
    let Some((name, given)) = matches.subcommand() else { return Ok(()) };
    if let Some(form) = cli.command.as_ref().and_then(Command::form_of_its_own).filter(|_| cli.global.json) {
        let message = format!("'axcon {name}' writes {form} and no JSON, so --json does not apply");
        return Err(CliError::message(error::Kind::Usage, message));
    }
    if cli.command.as_ref().is_none_or(Command::looks_at_a_unit) {
        return Ok(());
    }
    let of_a_link = [("ports", "--port"), ("baud", "--baud"), ("record", "--record")];
    let is_given = |(id, _): &(&str, &str)| given.value_source(id) == Some(ValueSource::CommandLine);
    let Some((_, option)) = of_a_link.into_iter().find(is_given) else { return Ok(()) };
    let deed = given.subcommand_name().map(|deed| format!(" {deed}")).unwrap_or_default();
    let message = format!("'axcon {name}{deed}' does not use a unit, so {option} does not apply");
    Err(CliError::message(error::Kind::Usage, message))
}

fn dispatch(cli: Cli, output: &mut Output) -> Result<(), CliError> {
    let global = &cli.global;
    if global.ports.len() > 1 && !matches!(cli.command, Some(Command::Load(_))) {
        let message = format!("several links were named ({}), and this works on one", global.ports.join(", "));
        return Err(CliError::message(error::Kind::Usage, message).hint("'axcon load' takes several"));
    }
    if let Some(twice) =
        global.ports.iter().enumerate().find_map(|(at, port)| global.ports[..at].contains(port).then_some(port))
    {
        return Err(CliError::message(error::Kind::Usage, format!("'{twice}' is named twice")));
    }
    if let Some((one, other)) = link::same_device(&global.ports) {
        let message = format!("'{one}' and '{other}' are the same port");
        return Err(CliError::message(error::Kind::Usage, message).hint("name each unit once"));
    }
    match cli.command {
        None => console::run(global),
        Some(Command::Ports(args)) => ports::run(args, global, output),
        Some(Command::Identify(args)) => identify::run(args, global, output),
        Some(Command::Stream(args)) => stream::run(args, global, output),
        Some(Command::Dictionary(args)) => dictionary::run(args, global, output),
        Some(Command::Diagnostics(args)) => diagnostics::run(args, global, output),
        Some(Command::Defaults(args)) => defaults::run(args, global, output),
        Some(Command::Report(args)) => report::run(&args, global, output),
        Some(Command::Load(args)) => load::run(args, global, output),
        Some(Command::Terminal(args)) => terminal::run(args, global, output),
        Some(Command::Eds(args)) => eds::run(args, global, output),
        Some(Command::Emulate(args)) => emulate::run(args, global, output),
        Some(Command::Image(args)) => image::run(args, global, output),
        Some(Command::Completions(args)) => manual::completions(&args, output),
        Some(Command::Man(args)) => manual::man(&args, global, output),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_lists_every_command_once_in_the_order_of_the_groups() {
        let command = command();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let all: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        assert_eq!(grouped, all);
        for help in [command.clone().render_help(), command.clone().render_long_help()] {
            let help = help.to_string();
            let (listed, options) = help.split_once("Options:\n").expect("options after the commands");
            for (title, names) in GROUPS {
                assert!(listed.contains(&format!("\n{title}:\n  {}", names[0])), "{title}:\n{listed}");
            }
            assert!(listed.contains("\n  load         Check an image, upload it"), "{listed}");
            assert!(options.contains("--port") && !options.contains("Commands:"), "{options}");
        }
    }
}
