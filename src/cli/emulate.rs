//! `axcon emulate`: units on pseudo-terminals, until somebody ends it.

use std::path::PathBuf;

use super::Global;
use super::error::{CliError, Kind};
use super::output::Output;

/// Arguments of `axcon emulate`.
///
/// While it runs, standard input takes verbs, one a line: `power off`, `power on`, `quit`, `help`; with several units,
/// a number first says which one (`2 power off`). The end of standard input ends nothing; an interrupt is the normal
/// end.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What to emulate, e.g. axtc4co; several give several units.
    #[arg(value_name = "PRODUCT", required = true, num_args = 1..=MOST_UNITS)]
    products: Vec<String>,
    /// Make PATH a link to the unit's serial port; further units get PATH-2, PATH-3 and so on.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Keep flash and parameters in DIR across runs; further units get DIR-2, DIR-3 and so on.
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// Whether bytes take their time on the line; a client at another rate than 115200 then gets garbage.
    #[arg(long, value_name = "on|off", default_value = "on", value_parser = ["on", "off"], hide_possible_values = true)]
    line_rate: String,
    /// Decides everything that chance decides in a unit.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// Units of one run: each has a pseudo-terminal and a thread.
const MOST_UNITS: usize = 256;

#[cfg(not(unix))]
/// Says that it cannot be done here.
///
/// # Errors
/// Always.
pub fn run(_args: Args, _global: &Global, _output: &mut Output) -> Result<(), CliError> {
    Err(CliError::message(Kind::Failed, "emulated units need pseudo-terminals, which this system does not have"))
}

#[cfg(unix)]
pub use hosting::run;

#[cfg(unix)]
mod hosting {
    use std::ffi::OsString;
    use std::io::BufRead;
    use std::path::{Path, PathBuf};
    use std::sync::mpsc::{Receiver, SyncSender};

    use serde::Serialize;

    use super::{Args, CliError, Global, Kind, Output};
    use crate::device::Product;
    use crate::host::Input;
    use crate::host::pty::{PortLink, PortLinkError};
    use crate::host::signal::Signals;
    use crate::host::state::{Contents, State};
    use crate::host::unit::{self, Command, HostError, HostedUnit, Hosting, LineRate};

    /// One unit, as the first lines of the output tell it.
    #[derive(Serialize)]
    struct Started<'a> {
        schema: &'static str,
        product: &'a str,
        serial: String,
        pty: String,
    }

    /// A unit of this run. The link goes first, so that nobody opens a port about to end.
    struct Running {
        link: Option<PortLink>,
        unit: HostedUnit,
        product: &'static Product,
    }

    /// What can happen while units run.
    enum News {
        Input(Input),
        Line(String),
        Failed(HostError),
    }

    /// News that wait at most: lines a person types, and ends.
    const NEWS: usize = 64;

    /// Hosts units until the user has enough.
    ///
    /// # Errors
    /// If a unit cannot be hosted, at the start or later.
    pub fn run(args: Args, _global: &Global, output: &mut Output) -> Result<(), CliError> {
        let (news, happened) = std::sync::mpsc::sync_channel(NEWS);
        // Signals first: an interrupt in between would leave links behind.
        let signals = listen_for_signals(news.clone())?;
        let mut units = Vec::new();
        for (place, name) in args.products.iter().enumerate() {
            units.push(start(&args, place, name, news.clone())?);
        }
        for running in &units {
            announce(running, output)?;
        }
        listen_for_lines(news)?;
        let end = serve(&units, &happened, output);
        drop(signals);
        end
    }

    fn start(args: &Args, place: usize, name: &str, news: SyncSender<News>) -> Result<Running, CliError> {
        let product = Product::named(name).ok_or_else(|| {
            let known: Vec<String> = Product::all().iter().map(|product| product.name.to_lowercase()).collect();
            CliError::message(Kind::Usage, format!("there is no emulated '{name}'; there is {}", known.join(", ")))
        })?;
        let seed = args.seed.wrapping_add(place as u64);
        let fresh = unit::factory_unit(product, seed);
        let factory = Contents { flash: fresh.flash().to_vec(), parameters: fresh.parameters().to_vec() };
        let (state, emulated) = match &args.state {
            None => (None, fresh),
            Some(folder) => {
                let (state, contents) = State::open(&numbered(folder, place), &factory)
                    .map_err(|error| CliError::new(Kind::Failed, error))?;
                (Some(state), unit::unit(product, seed, contents.flash, contents.parameters))
            }
        };
        let hosting = Hosting {
            line_rate: if args.line_rate == "off" { LineRate::Off } else { LineRate::Real },
            state,
            seed,
            failed: Some(Box::new(move |error| {
                let _ = news.send(News::Failed(error));
            })),
            ..Hosting::default()
        };
        let unit = HostedUnit::start(emulated, hosting).map_err(|error| CliError::new(Kind::Failed, error))?;
        let link = args
            .link
            .as_ref()
            .map(|link| PortLink::create(&numbered(link, place), unit.serial()))
            .transpose()
            .map_err(link_error)?;
        Ok(Running { link, unit, product })
    }

    fn link_error(error: PortLinkError) -> CliError {
        match error {
            PortLinkError::Taken { .. } => CliError::new(Kind::Failed, error).hint("give --link another name"),
            PortLinkError::Io { .. } => CliError::new(Kind::Failed, error),
        }
    }

    fn announce(running: &Running, output: &mut Output) -> Result<(), CliError> {
        let pty = running.unit.serial().display().to_string();
        let serial = running.link.as_ref().map_or_else(|| pty.clone(), |link| link.path().display().to_string());
        if output.json {
            let product = running.product.name.as_str();
            output.object(&Started { schema: "axcon.emulate/1", product, serial, pty })
        } else {
            output.data(format!("serial: {serial}\n").as_bytes())
        }
    }

    fn serve(units: &[Running], happened: &Receiver<News>, output: &mut Output) -> Result<(), CliError> {
        loop {
            match happened.recv() {
                Ok(News::Line(line)) => match Verb::read(&line, units.len()) {
                    Ok(None) => {}
                    Ok(Some(Verb::Quit)) => return Ok(()),
                    Ok(Some(Verb::Help)) => output.remark(HELP),
                    Ok(Some(Verb::Tell { place, command })) => {
                        if !units[place].unit.command(command) {
                            output.remark("the unit takes no more commands at the moment");
                        }
                    }
                    Err(complaint) => output.remark(&complaint),
                },
                Ok(News::Failed(error)) => return Err(CliError::new(Kind::Failed, error)),
                Ok(News::Input(Input::Signal(_))) | Err(_) => return Ok(()),
                Ok(News::Input(_)) => {}
            }
        }
    }

    fn listen_for_signals(news: SyncSender<News>) -> Result<Signals, CliError> {
        let (inputs, signals) = crate::host::channel();
        let failed =
            |error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen for signals"));
        let listening = Signals::start(inputs).map_err(failed)?;
        std::thread::Builder::new()
            .name("signals to news".into())
            .spawn(move || {
                while let Ok(input) = signals.recv() {
                    if news.send(News::Input(input)).is_err() {
                        return;
                    }
                }
            })
            .map_err(failed)?;
        Ok(listening)
    }

    fn listen_for_lines(news: SyncSender<News>) -> Result<(), CliError> {
        if !crate::host::terminal::may_read_standard_input() {
            return Ok(());
        }
        let lines = move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                if news.send(News::Line(line)).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("verbs".into()).spawn(lines).map(drop).map_err(|error| {
            CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen to standard input"))
        })
    }

    /// What standard input can say.
    #[derive(Debug, PartialEq, Eq)]
    enum Verb {
        Quit,
        Help,
        Tell { place: usize, command: Command },
    }

    const HELP: &str = "power on     switch the unit's supply on
power off    switch it off: all but flash and parameters is lost
quit         end
help         this text
With several units, a number first says which one: 2 power off";

    impl Verb {
        /// Reads a line; an empty one is nothing. The complaint says what exists.
        fn read(line: &str, units: usize) -> Result<Option<Verb>, String> {
            let words: Vec<String> = line.split_whitespace().map(str::to_ascii_lowercase).collect();
            let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
            let mut place = 0;
            if let Some(number) = words.first().and_then(|word| word.parse::<usize>().ok()) {
                if number == 0 || number > units {
                    return Err(format!("there is no unit {number}: they are numbered 1 to {units}"));
                }
                place = number - 1;
                words.remove(0);
                if words.is_empty() {
                    return Err(format!("what should unit {number} do? 'help' says what there is"));
                }
            }
            match words.as_slice() {
                [] => Ok(None),
                ["quit"] => Ok(Some(Verb::Quit)),
                ["help"] => Ok(Some(Verb::Help)),
                ["power", "on"] => Ok(Some(Verb::Tell { place, command: Command::PowerOn })),
                ["power", "off"] => Ok(Some(Verb::Tell { place, command: Command::PowerOff })),
                _ => {
                    let line = crate::wire::visible::line(line.as_bytes());
                    Err(format!("'{line}' is not known; there is: power on, power off, quit, help"))
                }
            }
        }
    }

    /// The name for the unit at a place: the first has it as it is.
    fn numbered(path: &Path, place: usize) -> PathBuf {
        if place == 0 {
            return path.to_owned();
        }
        let mut name = OsString::from(path);
        name.push(format!("-{}", place + 1));
        PathBuf::from(name)
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn verbs_are_read_in_any_case_and_bad_ones_name_the_good() {
            let read = |line: &str| Verb::read(line, 2);
            assert_eq!(read(" Power  OFF "), Ok(Some(Verb::Tell { place: 0, command: Command::PowerOff })));
            assert_eq!(read("2 power on"), Ok(Some(Verb::Tell { place: 1, command: Command::PowerOn })));
            assert_eq!(read(""), Ok(None));
            assert_eq!(read("quit"), Ok(Some(Verb::Quit)));
            assert_eq!(read("3 quit"), Err("there is no unit 3: they are numbered 1 to 2".into()));
            let complaint = read("explode\x1b[2J").expect_err("no such verb");
            assert_eq!(complaint, "'explode^[[2J' is not known; there is: power on, power off, quit, help");
        }

        #[test]
        fn further_units_get_numbered_names() {
            assert_eq!(numbered(Path::new("/tmp/unit"), 0), Path::new("/tmp/unit"));
            assert_eq!(numbered(Path::new("/tmp/unit"), 2), Path::new("/tmp/unit-3"));
        }
    }
}
