//! `axcon identify`: what is at the other end, and how we know.

use std::ops::ControlFlow;

use serde::Serialize;

use super::Global;
use super::ask::{READS_DICTIONARY, confirm};
use super::error::{CliError, Kind};
use super::journal::PortJournal;
use super::link;
use super::outcome::no_answer_hints;
use super::output::Output;
use super::talk::Talk;
use crate::canopen::ObjectAddress;
use crate::host::journal::Note;
use crate::session::{Command, Facts, Known, Origin, UnitState};
use crate::time::Duration;

/// Arguments of `axcon identify`.
///
/// The unit is asked with `m`, which prints its menu and changes nothing. A unit that waits in its loader is recognised
/// too, and takes no harm from the question.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Read product code, serial number and compile date from the object dictionary too; the unit may halt scanning and
    /// CAN meanwhile.
    #[arg(long)]
    deep: bool,
    /// Wait for the power-up messages: a unit prints its version only then. Switch its power off and on within
    /// 120 s; exit code 4 if nothing has come then.
    #[arg(long, conflicts_with = "deep")]
    wait: bool,
}

/// How long somebody may take to switch the power off and on.
const POWER_CYCLE: Duration = Duration::from_secs(120);
/// How long the rest of the power-up messages may take after product and version.
const REST_OF_BANNER: Duration = Duration::from_millis(1500);

#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    state: &'static str,
    product: Option<&'a str>,
    version: Option<String>,
    serial_number: Option<u32>,
    product_code: Option<u32>,
    revision: Option<u32>,
    compiled: Option<String>,
    node_id: Option<u8>,
    can_kbps: Option<u16>,
    nmt_state: Option<&'a str>,
    unrecognised_lines: u64,
    /// An upload that was begun on this port and has not ended well: what else the unit may be.
    unfinished_upload: Option<UploadObject<'a>>,
    sources: Sources,
}

#[derive(Serialize)]
struct UploadObject<'a> {
    product: &'a str,
    image: &'a str,
}

/// Where each fact comes from.
#[derive(Serialize)]
struct Sources {
    product: Option<&'static str>,
    version: Option<&'static str>,
    serial_number: Option<&'static str>,
    node_id: Option<&'static str>,
    can_kbps: Option<&'static str>,
    nmt_state: Option<&'static str>,
}

/// Identifies the unit.
///
/// # Errors
/// If the link does not open, or nothing we know answers.
pub fn run(args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if args.deep && !link::is_recording(global) {
        confirm(READS_DICTIONARY, global, output)?;
    }
    let mut talk = Talk::open(global, output)?;
    if talk.is_recorded() {
        // Read below, in one go with everything else.
        if !args.deep {
            talk.hear_out()?;
        }
    } else if args.wait {
        wait_for_banner(&mut talk, output)?;
    } else {
        talk.ask(Command::Identify)?;
    }
    let is_deep = args.deep && (talk.is_recorded() || talk.session().facts().state == UnitState::Application);
    // What else is known of the unit is said all the same.
    let (deep, unread) = match is_deep.then(|| Deep::read(&mut talk)) {
        None => (Deep::default(), Ok(())),
        Some(Ok(deep)) => (deep, Ok(())),
        Some(Err(error)) if error.kind == Kind::PortGone || error.kind == Kind::Interrupted => return Err(error),
        Some(Err(error)) => (Deep::default(), Err(error)),
    };
    let facts = talk.session().facts().clone();
    let unfinished = PortJournal::of(&talk).note;
    if let Some(note) = &unfinished {
        let Note { product, image, .. } = note;
        output.remark(&format!(
            "axcon: an upload of {image} to the {product} on this port has not ended well; 'axcon load' with an \
             image made for the {product} brings it back"
        ));
    }
    let found = match facts.state {
        UnitState::Application | UnitState::Loader => Ok(()),
        UnitState::Silent | UnitState::Unknown => Err(talk.no_unit()),
    };
    let written = if output.json {
        output.object(&object(&facts, &deep, unfinished.as_ref()))
    } else if found.is_ok() {
        output.data((text(&facts) + &deep.text()).as_bytes())
    } else {
        Ok(())
    };
    let is_unsaid = facts.product.is_none() || facts.version.is_none();
    if is_unsaid && facts.state == UnitState::Application && !is_deep && !args.wait && !talk.is_recorded() {
        output.remark(
            "axcon: a unit says its product and version at power-up, and not every menu repeats them:\n  \
             --wait listens for that, --deep reads the product from the object dictionary (scanning may halt meanwhile)",
        );
    }
    found.and(unread).and(written)
}

/// What to do about a unit that shows no object dictionary (manuals, section 4.1.1).
pub const PRE_OPERATIONAL: &str = "units show it in the pre-operational state only: switch the unit's power off and on, or \
                                   set the state by the network's master";

/// What only the object dictionary says.
#[derive(Clone, Debug, Default)]
struct Deep {
    product_code: Option<u32>,
    serial_number: Option<u32>,
    revision: Option<u32>,
    /// Day, month and year, their decimal digits in hexadecimal ones (1020h).
    compiled: Option<u32>,
}

impl Deep {
    fn read(talk: &mut Talk) -> Result<Self, CliError> {
        let outcome = talk.ask(Command::ReadDictionary)?;
        let reading = talk.expect_reading(outcome).map_err(|error| match error.kind {
            Kind::UnitRefused => error.hint(PRE_OPERATIONAL),
            _ => error,
        })?;
        let entry = |index, sub| reading.entries.iter().find(|entry| entry.at == ObjectAddress::new(index, sub));
        let bits = |index, sub| entry(index, sub)?.value()?.as_integer().and_then(|bits| u32::try_from(bits).ok());
        Ok(Deep {
            product_code: bits(0x1018, 2),
            serial_number: bits(0x1018, 4),
            revision: bits(0x1018, 3),
            compiled: bits(0x1020, 1),
        })
    }

    fn compiled(&self) -> Option<String> {
        let digits = format!("{:08x}", self.compiled?);
        Some(format!("{}-{}-{}", &digits[4..], &digits[2..4], &digits[..2]))
    }

    fn text(&self) -> String {
        let mut lines = String::new();
        for (name, value) in [
            ("serial", self.serial_number.map(|number| format!("{number} ({number:08X}h)"))),
            ("code", self.product_code.map(|code| format!("{code:08X}h"))),
            ("revision", self.revision.map(|revision| format!("{revision:08X}h"))),
            ("compiled", self.compiled()),
        ] {
            if let Some(value) = value {
                lines.push_str(&format!("{name:<10} {value}  (from the object dictionary)\n"));
            }
        }
        lines
    }
}

/// Listens until the unit has said product and version at its start.
fn wait_for_banner(talk: &mut Talk, output: &mut Output) -> Result<(), CliError> {
    output.remark("axcon: switch the unit's power off and on; it says its version only then");
    let until = talk.now() + POWER_CYCLE;
    let mut said = false;
    talk.hear(until, |session, _| {
        let facts = session.facts();
        said = facts.product.is_some() && facts.version.is_some() || facts.state == UnitState::Loader;
        Ok(if said { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })?;
    if !said {
        let message = format!("no power-up messages within {} s", POWER_CYCLE.as_secs());
        return Err(no_answer_hints(CliError::message(Kind::NoAnswer, message)));
    }
    let until = talk.now() + REST_OF_BANNER;
    talk.hear(until, |_, _| Ok(ControlFlow::Continue(())))
}

/// The state as JSON names it.
pub fn state_name(state: UnitState) -> &'static str {
    match state {
        UnitState::Silent => "silent",
        UnitState::Unknown => "unknown",
        UnitState::Application => "application",
        UnitState::Loader => "loader",
    }
}

fn object<'a>(facts: &'a Facts, deep: &Deep, unfinished: Option<&'a Note>) -> Object<'a> {
    Object {
        schema: "axcon.identify/1",
        state: state_name(facts.state),
        product: facts.product.as_ref().map(|known| known.value.as_str()),
        version: facts.version.as_ref().map(|known| known.value.to_string()),
        serial_number: deep.serial_number,
        product_code: deep.product_code,
        revision: deep.revision,
        compiled: deep.compiled(),
        node_id: value(&facts.node_id),
        can_kbps: value(&facts.can_kbps),
        nmt_state: facts.nmt_state.as_ref().map(|known| known.value.as_str()),
        unrecognised_lines: facts.unrecognised_lines,
        unfinished_upload: unfinished.map(|Note { product, image, .. }| UploadObject { product, image }),
        sources: Sources {
            product: source(&facts.product),
            version: source(&facts.version),
            serial_number: deep.serial_number.map(|_| "object dictionary"),
            node_id: source(&facts.node_id),
            can_kbps: source(&facts.can_kbps),
            nmt_state: source(&facts.nmt_state),
        },
    }
}

fn text(facts: &Facts) -> String {
    let mut lines = String::new();
    let mut line = |name: &str, value: Option<String>, source: Option<&str>| {
        let source = source.map(|source| format!("  (from the {source})")).unwrap_or_default();
        lines.push_str(&format!("{name:<10} {}{source}\n", value.unwrap_or_else(|| "not said".into())));
    };
    match facts.state {
        UnitState::Loader => {
            line("state", Some("in its loader, waiting for a file".into()), None);
            if let Some(product) = &facts.product {
                line("product", Some(product.value.clone()), source(&facts.product));
            }
        }
        UnitState::Application | UnitState::Silent | UnitState::Unknown => {
            let version = facts.version.as_ref().map(|known| format!("V{}", known.value));
            let nmt_state = facts.nmt_state.as_ref().map(|known| known.value.clone());
            line("state", Some("application runs".into()), None);
            line("product", facts.product.as_ref().map(|known| known.value.clone()), source(&facts.product));
            line("version", version, source(&facts.version));
            line("node-ID", value(&facts.node_id).map(|id| format!("{id} ({id:02X}h)")), source(&facts.node_id));
            line("CAN", value(&facts.can_kbps).map(|kbps| format!("{kbps} kbit/s")), source(&facts.can_kbps));
            line("CANopen", nmt_state, source(&facts.nmt_state));
        }
    }
    lines
}

fn value<T: Copy>(known: &Option<Known<T>>) -> Option<T> {
    known.as_ref().map(|known| known.value)
}

fn source<T>(known: &Option<Known<T>>) -> Option<&'static str> {
    known.as_ref().map(|known| match known.origin {
        Origin::Banner => "banner",
        Origin::Menu => "menu",
        Origin::Dictionary => "object dictionary",
        Origin::Diagnostics => "diagnostics",
    })
}
