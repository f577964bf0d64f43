//! `axcon identify`: what is at the other end, and how we know.

use serde::Serialize;

use super::Global;
use super::error::CliError;
use super::output::Output;
use super::talk::Talk;
use crate::session::{Command, Facts, Known, Origin, UnitState};

/// Arguments of `axcon identify`.
///
/// The unit is asked with `m`, which prints its menu and changes nothing. A unit that waits in its loader is recognised
/// too, and takes no harm from the question.
#[derive(Debug, clap::Args)]
pub struct Args {}

#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    state: &'static str,
    product: Option<&'a str>,
    version: Option<String>,
    serial_number: Option<u32>,
    node_id: Option<u8>,
    can_kbps: Option<u16>,
    nmt_state: Option<&'a str>,
    unrecognised_lines: u64,
    sources: Sources,
}

/// Where each fact comes from.
#[derive(Serialize)]
struct Sources {
    product: Option<&'static str>,
    version: Option<&'static str>,
    node_id: Option<&'static str>,
    can_kbps: Option<&'static str>,
    nmt_state: Option<&'static str>,
}

/// Identifies the unit.
///
/// # Errors
/// If the link does not open, or nothing we know answers.
pub fn run(_args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let mut talk = Talk::open(global, output)?;
    talk.ask(Command::Identify)?;
    let facts = talk.session().facts().clone();
    if output.json {
        output.object(&object(&facts))?;
    } else if matches!(facts.state, UnitState::Application | UnitState::Loader) {
        output.data(text(&facts).as_bytes())?;
    }
    let result = match facts.state {
        UnitState::Application | UnitState::Loader => Ok(()),
        UnitState::Silent | UnitState::Unknown => Err(talk.no_unit()),
    };
    talk.close(output);
    result
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

fn object(facts: &Facts) -> Object<'_> {
    Object {
        schema: "axcon.identify/1",
        state: state_name(facts.state),
        product: facts.product.as_ref().map(|known| known.value.as_str()),
        version: facts.version.as_ref().map(|known| known.value.to_string()),
        serial_number: None,
        node_id: value(&facts.node_id),
        can_kbps: value(&facts.can_kbps),
        nmt_state: facts.nmt_state.as_ref().map(|known| known.value.as_str()),
        unrecognised_lines: facts.unrecognised_lines,
        sources: Sources {
            product: source(&facts.product),
            version: source(&facts.version),
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
    })
}
