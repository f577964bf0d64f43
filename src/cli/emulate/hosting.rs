//! Units on pseudo-terminals, with what becomes of them.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

use super::orders::{Order, Refused, help, places};
use super::{Args, CliError, Global, Kind, Output};
use crate::cli::{files, waiting};
use crate::device::{Complaint, Product};
use crate::emulator::fault::{self, Fault};
use crate::emulator::scenario::{LARGEST_FILE, Scenario, Stage};
use crate::emulator::{Setup, Unit};
use crate::host::Input;
use crate::host::port_link::{PortLink, PortLinkError};
use crate::host::signal::Signals;
use crate::host::state::{Contents, Opened, State};
use crate::host::unit::{self, Answer, HostError, HostedUnit, Hosting, Plug};
use crate::wire::visible;

/// One unit, as the first lines of the output tell it.
#[derive(Serialize)]
struct Started<'a> {
    schema: &'static str,
    unit: usize,
    product: &'a str,
    serial: String,
    pty: String,
}

/// A unit of this run. The link is dropped first, so that it never leads to a port that is gone.
struct Running {
    link: Option<PortLink>,
    unit: HostedUnit,
    /// The pseudo-terminal it is on.
    pty: PathBuf,
    product: &'static Product,
}

/// What can happen while units run.
enum News {
    Input(Input),
    Line(String),
    /// A unit has said something: [`Voices`] has it.
    Said,
    Failed(HostError),
}

/// What a unit says.
#[derive(Debug, PartialEq)]
enum Said {
    /// It has done what it was told, or not.
    Answered { verb: String, answer: Answer },
    /// Its cable has been pulled.
    Unplugged,
    /// It is in again.
    Replugged(PathBuf),
}

/// What all units have said, with their places, in its order. Their threads never wait for us, whatever standard output
/// does. No more waits here than the answers to one line, as the next one is read after them, and the last news of each
/// cable.
#[derive(Clone)]
struct Voices {
    said: Arc<Mutex<VecDeque<(usize, Said)>>>,
    news: SyncSender<News>,
}

impl Voices {
    /// Nothing has been said yet; that something has is put on this channel.
    fn new(news: SyncSender<News>) -> Self {
        Voices { said: Arc::default(), news }
    }

    fn say(&self, place: usize, said: Said) {
        let is_answer = |said: &Said| matches!(said, Said::Answered { .. });
        let mut all = self.all();
        if !is_answer(&said) {
            // What became of the cable before is over.
            all.retain(|(other, earlier)| *other != place || is_answer(earlier));
        }
        all.push_back((place, said));
        drop(all);
        // A full channel brings something later on, and with all that comes what has been said is asked for.
        let _ = self.news.try_send(News::Said);
    }

    /// The oldest that has not been taken.
    fn take(&self) -> Option<(usize, Said)> {
        self.all().pop_front()
    }

    fn all(&self) -> MutexGuard<'_, VecDeque<(usize, Said)>> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a unit answered, in JSON.
#[derive(Serialize)]
struct Answered<'a> {
    schema: &'static str,
    /// `None` where the line is for none in particular.
    unit: Option<usize>,
    verb: &'a str,
    ok: bool,
    said: Option<&'a str>,
}

impl<'a> Answered<'a> {
    fn to(unit: Option<usize>, verb: &'a str, answer: Result<Option<&'a str>, &'a str>) -> Self {
        let (ok, said) = match answer {
            Ok(said) => (true, said),
            Err(refused) => (false, Some(refused)),
        };
        Answered { schema: "axcon.emulate-answer/1", unit, verb, ok, said }
    }
}

/// News that wait at most: a line, signals, ends, and that units have said something.
const NEWS: usize = 256;

/// Hosts units until the user has enough.
///
/// # Errors
/// If a unit cannot be hosted, at the start or later.
pub fn run(args: Args, _global: &Global, output: &mut Output) -> Result<(), CliError> {
    let products = products(&args)?;
    let faults = faults(&args.faults, &products)?;
    let scenario = args.scenario.as_deref().map(read_scenario).transpose()?;
    // Dropped after `happened`: dropping a unit waits for its thread, which may be waiting to say that it has failed.
    let mut units = Vec::new();
    let (news, happened) = sync_channel(NEWS);
    let voices = Voices::new(news.clone());
    // Signals first: an interrupt in between would leave links behind.
    let _signals = listen_for_signals(news.clone())?;
    for (place, product) in products.into_iter().enumerate() {
        units.push(start(&args, place, product, scenario.as_ref(), &faults[place], &voices, output)?);
    }
    for (place, running) in units.iter().enumerate() {
        announce(place, running, "", output)?;
    }
    let (go_on, next) = sync_channel(1);
    listen_for_lines(news, next)?;
    serve(&args, &mut units, &voices, &happened, &go_on, output)
}

/// The products of all units, in their order.
fn products(args: &Args) -> Result<Vec<&'static Product>, CliError> {
    let repeated = |product| std::iter::repeat_n(product, usize::from(args.count));
    let products: Vec<_> = args.products.iter().copied().flat_map(repeated).collect();
    if products.len() > super::MOST_UNITS {
        let message = format!("{} units are more than {}", products.len(), super::MOST_UNITS);
        return Err(CliError::message(Kind::Usage, message).hint("start 'axcon emulate' several times"));
    }
    Ok(products)
}

/// The faults of each unit.
fn faults(specs: &[String], products: &[&Product]) -> Result<Vec<Vec<Fault>>, CliError> {
    let mut faults = vec![Vec::new(); products.len()];
    for spec in specs {
        let refused = |complaint: String| {
            let shown = crate::emulator::words::shown(spec);
            CliError::message(Kind::Usage, format!("--fault '{shown}': {complaint}"))
                .hint("docs/emulator.md describes the faults, for example: --fault 'lost to-unit at byte 5000'")
        };
        let (places, fault) = places(spec, products.len()).map_err(refused)?;
        for place in places.unwrap_or_else(|| (0..products.len()).collect()) {
            let fault = Fault::read(&fault, products[place]).map_err(|error| refused(error.to_string()))?;
            faults[place].push(fault);
        }
    }
    Ok(faults)
}

/// A scenario's file: its name and its text.
fn read_scenario(file: &Path) -> Result<(String, String), CliError> {
    let name = file.display().to_string();
    let text = files::read_text(file, LARGEST_FILE).map_err(|error| {
        CliError::new(Kind::Usage, anyhow::Error::new(error).context(format!("cannot read the scenario '{name}'")))
    })?;
    Ok((name, text))
}

fn start(
    args: &Args,
    place: usize,
    product: &'static Product,
    scenario: Option<&(String, String)>,
    faults: &[Fault],
    voices: &Voices,
    output: &mut Output,
) -> Result<Running, CliError> {
    let scenario = scenario.map(|scenario| scenario_for(scenario, product)).transpose()?.unwrap_or_default();
    let seed = args.seed.wrapping_add(place as u64);
    let mut setup = unit::factory_setup(product, seed);
    setup.dialect = args.dialect.map_or(0, |dialect| dialect.wrapping_add(place as u64));
    setup.loader = args.loader.unwrap_or(setup.loader);
    let state = match &args.state {
        Some(folder) => Some(remember(&numbered(folder, place), &mut setup, output)?),
        None => None,
    };
    let emulated = Stage::new(Unit::new(setup), scenario).with_faults(seed, faults);
    let line_rate = args.line_rate.line_rate();
    let hosting = Hosting { line_rate, state, seed, ..reporting(place, voices) };
    let unit = HostedUnit::start(emulated, hosting).map_err(|error| match error {
        HostError::NoPseudoTerminals => CliError::new(Kind::Failed, error)
            .hint(format!("'--port emu:{}' has a unit within the program", product.name.to_ascii_lowercase())),
        HostError::Port(..) | HostError::State(_) => CliError::new(Kind::Failed, error),
    })?;
    let pty = unit.serial().to_owned();
    let link = link(args, place, &pty)?;
    Ok(Running { link, unit, pty, product })
}

/// Reads a scenario for this product, given the name and the text of its file.
fn scenario_for((file, text): &(String, String), product: &Product) -> Result<Scenario, CliError> {
    let read = Scenario::read(file, text, product).map_err(|complaints| {
        let list = Complaint::list(&complaints);
        CliError::message(Kind::Usage, format!("the scenario cannot be played:\n{list}"))
            .hint("docs/emulator.md describes the format")
    })?;
    Ok(read.unwrap_or_default())
}

/// Gives a unit the flash and the parameters that are kept in a folder; those of the factory if there are none.
fn remember(folder: &Path, setup: &mut Setup, output: &mut Output) -> Result<State, CliError> {
    let fresh = Unit::new(setup.clone());
    let factory = Contents { flash: fresh.flash().to_vec(), parameters: fresh.parameters().to_vec() };
    let Opened { state, contents, damaged } =
        State::open(folder, setup.product, &factory).map_err(|error| CliError::new(Kind::Failed, error))?;
    for file in damaged {
        output.remark(&format!("axcon: {file}"));
    }
    (setup.flash, setup.parameters) = (contents.flash, contents.parameters);
    Ok(state)
}

/// How a unit's thread tells us what becomes of its cable and of itself.
fn reporting(place: usize, voices: &Voices) -> Hosting {
    let (plugs, news) = (voices.clone(), voices.news.clone());
    Hosting {
        plug: Some(Box::new(move |plug| {
            let said = match plug {
                Plug::Out => Said::Unplugged,
                Plug::In(pty) => Said::Replugged(pty.to_owned()),
            };
            plugs.say(place, said);
        })),
        failed: Some(Box::new(move |error| {
            let _ = news.send(News::Failed(error));
        })),
        ..Hosting::default()
    }
}

fn link(args: &Args, place: usize, pty: &Path) -> Result<Option<PortLink>, CliError> {
    let link = args.link.as_ref().map(|link| PortLink::create(&numbered(link, place), pty));
    link.transpose().map_err(link_error)
}

fn link_error(error: PortLinkError) -> CliError {
    match error {
        PortLinkError::Taken { .. } => CliError::new(Kind::Failed, error).hint("give --link another name"),
        PortLinkError::Io { .. } => CliError::new(Kind::Failed, error),
    }
}

fn announce(place: usize, running: &Running, prefix: &str, output: &mut Output) -> Result<(), CliError> {
    let pty = running.pty.display().to_string();
    let serial = running.link.as_ref().map_or_else(|| pty.clone(), |link| link.path().display().to_string());
    if output.json {
        let product = running.product.name.as_str();
        output.object(&Started { schema: "axcon.emulate/1", unit: place + 1, product, serial, pty })
    } else {
        output.data(format!("{prefix}serial: {serial}\n").as_bytes())
    }
}

/// Does what comes. The next line is read when all verbs of the last one are answered and the answers are written: so
/// however fast verbs come and however slowly answers are read, none is refused or lost.
fn serve(
    args: &Args,
    units: &mut [Running],
    voices: &Voices,
    happened: &Receiver<News>,
    go_on: &SyncSender<()>,
    output: &mut Output,
) -> Result<(), CliError> {
    let mut awaited = 0_usize;
    while let Ok(news) = happened.recv() {
        let mut line_is_done = false;
        while let Some((place, said)) = voices.take() {
            match said {
                Said::Answered { verb, answer } => {
                    report(place, &verb, &answer, units.len(), output)?;
                    awaited = awaited.saturating_sub(1);
                    line_is_done = awaited == 0;
                }
                // Its pseudo-terminal's number is somebody else's soon: the link must not lead there.
                Said::Unplugged => units[place].link = None,
                Said::Replugged(pty) => {
                    let prefix = prefix(place, units.len());
                    let running = &mut units[place];
                    running.link = None;
                    running.link = link(args, place, &pty)?;
                    running.pty = pty;
                    announce(place, running, &prefix, output)?;
                }
            }
        }
        match news {
            News::Line(line) => {
                let Some(told) = obey(&line, units, voices, output)? else { return Ok(()) };
                awaited = told;
                line_is_done = awaited == 0;
            }
            News::Failed(error) => return Err(CliError::new(Kind::Failed, error)),
            News::Input(Input::Signal(_)) => return Ok(()),
            News::Input(_) | News::Said => {}
        }
        if line_is_done {
            // Nobody waits for it if standard input has ended.
            let _ = go_on.try_send(());
        }
    }
    Ok(())
}

/// Does what a line says, and gives the number of answers that will come. `None` means the end.
fn obey(line: &str, units: &[Running], voices: &Voices, output: &mut Output) -> Result<Option<usize>, CliError> {
    let products: Vec<&Product> = units.iter().map(|running| running.product).collect();
    let mut told = 0;
    match Order::read(line, &products) {
        Ok(None) => {}
        Ok(Some(Order::Quit)) => return Ok(None),
        Ok(Some(Order::Help)) => tell_help(line.trim(), &help(), output)?,
        Ok(Some(Order::HelpFaults)) => tell_help(line.trim(), fault::HELP, output)?,
        Ok(Some(Order::Tell(verbs))) => {
            for (place, verb) in verbs {
                let (voices, said) = (voices.clone(), line.trim().to_owned());
                let answered = move |answer| voices.say(place, Said::Answered { verb: said, answer });
                if units[place].unit.order(verb, answered) {
                    told += 1;
                } else {
                    report(place, line.trim(), &Err("the unit has ended".to_owned()), units.len(), output)?;
                }
            }
        }
        Err(Refused { place, why }) if output.json => {
            output.object(&Answered::to(place.map(|place| place + 1), line.trim(), Err(&why)))?;
        }
        Err(Refused { why, .. }) => output.remark(&visible::line(why.as_bytes())),
    }
    Ok(Some(told))
}

/// An answer like any other: a script that waits for an object after each verb gets one.
fn tell_help(verb: &str, text: &str, output: &mut Output) -> Result<(), CliError> {
    let text = text.trim_end();
    if output.json {
        return output.object(&Answered::to(None, verb, Ok(Some(text))));
    }
    output.data(format!("{text}\n").as_bytes())
}

/// Says what came of a verb: data to standard output, refusals to standard error.
fn report(place: usize, verb: &str, answer: &Answer, units: usize, output: &mut Output) -> Result<(), CliError> {
    if output.json {
        let answer = answer.as_ref().map(Option::as_deref).map_err(String::as_str);
        return output.object(&Answered::to(Some(place + 1), verb, answer));
    }
    let unit = prefix(place, units);
    match answer {
        Ok(None) => Ok(()),
        Ok(Some(said)) => output.data(format!("{unit}{said}\n").as_bytes()),
        Err(refused) => {
            output.remark(&format!("{unit}{}", visible::line(refused.as_bytes())));
            Ok(())
        }
    }
}

/// What tells the units of a run apart in text.
fn prefix(place: usize, units: usize) -> String {
    if units > 1 { format!("{}: ", place + 1) } else { String::new() }
}

fn listen_for_signals(news: SyncSender<News>) -> Result<Signals, CliError> {
    let (inputs, signals) = crate::host::channel();
    let listening = waiting::hear_signals(inputs)?;
    let pass_on = move || {
        while let Ok(input) = signals.recv() {
            if news.send(News::Input(input)).is_err() {
                return;
            }
        }
    };
    let thread = std::thread::Builder::new().name("signals to news".into()).spawn(pass_on);
    thread
        .map(|_| listening)
        .map_err(|error| CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen for signals")))
}

/// Bytes of a line of verbs that are looked at together; no verb is nearly as long.
const LONGEST_LINE: u64 = 1 << 16;

/// Puts the lines of standard input on the channel, each but the first when `next` says so.
fn listen_for_lines(news: SyncSender<News>, next: Receiver<()>) -> Result<(), CliError> {
    if !crate::host::terminal::may_read_standard_input() {
        return Ok(());
    }
    let lines = move || {
        let mut input = std::io::stdin().lock();
        let mut line = Vec::new();
        // What is not UTF-8, or goes on for ever, is an unknown verb, and answered as such.
        while matches!(input.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line), Ok(1..)) {
            let text = String::from_utf8_lossy(&line).trim_end_matches(['\r', '\n']).to_owned();
            line.clear();
            if news.send(News::Line(text)).is_err() || next.recv().is_err() {
                return;
            }
        }
    };
    std::thread::Builder::new().name("verbs".into()).spawn(lines).map(drop).map_err(|error| {
        CliError::new(Kind::Failed, anyhow::Error::new(error).context("cannot listen to standard input"))
    })
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
    use crate::emulator::fault::Setting;
    use crate::time::Duration;

    #[test]
    fn faults_are_for_all_units_or_the_one_that_is_named() {
        let products: Vec<&Product> = Product::all().iter().collect();
        let read = |specs: &[&str]| {
            let specs: Vec<String> = specs.iter().map(|&spec| spec.to_owned()).collect();
            faults(&specs, &products).map_err(|error| error.to_string())
        };
        let latency = Fault::Adapter(Setting::Latency(Duration::from_millis(16)));
        let queue = Fault::Adapter(Setting::Queue(64));
        assert_eq!(read(&["latency 16", " 2 queue 64"]), Ok(vec![vec![latency], vec![latency, queue]]));
        // Only the second unit has this much flash.
        assert!(read(&["2 flash stuck at word 0x20000"]).is_ok());
        let complaint = read(&["flash stuck at word 0x20000"]).expect_err("the first has not");
        assert!(
            complaint.starts_with("--fault 'flash stuck at word 0x20000': column 21: '0x20000' is not 0"),
            "{complaint}"
        );
        let complaint = read(&[" 1  explode"]).expect_err("no fault");
        assert!(complaint.starts_with("--fault ' 1  explode': column 5: 'explode' is not known"), "{complaint}");
        let complaint = read(&["3 latency 1"]).expect_err("no such unit");
        assert!(complaint.contains("there is no unit 3: they are numbered 1 to 2"), "{complaint}");
    }

    #[test]
    fn what_units_say_of_their_cables_waits_once_each_and_takes_no_room_from_answers() {
        let (news, happened) = sync_channel(1);
        let voices = Voices::new(news);
        let answered = |verb: &str| Said::Answered { verb: verb.to_owned(), answer: Ok(None) };
        for round in 0..1_000 {
            voices.say(0, Said::Replugged(PathBuf::from(format!("/dev/pts/{round}"))));
            voices.say(0, Said::Unplugged);
        }
        voices.say(0, answered("unplug"));
        voices.say(1, Said::Unplugged);
        voices.say(0, Said::Replugged(PathBuf::from("/dev/pts/7")));
        voices.say(0, answered("plug"));
        let said: Vec<_> = std::iter::from_fn(|| voices.take()).collect();
        let last = Said::Replugged(PathBuf::from("/dev/pts/7"));
        assert_eq!(said, [(0, answered("unplug")), (1, Said::Unplugged), (0, last), (0, answered("plug"))]);
        assert!(matches!(happened.try_recv(), Ok(News::Said)));
        assert!(happened.try_recv().is_err(), "a full channel is enough");
    }

    #[test]
    fn further_units_get_numbered_names() {
        assert_eq!(numbered(Path::new("/tmp/unit"), 0), Path::new("/tmp/unit"));
        assert_eq!(numbered(Path::new("/tmp/unit"), 2), Path::new("/tmp/unit-3"));
    }
}
