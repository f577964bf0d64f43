//! `axcon defaults`: the factory's object dictionary, through the unit's own D.

use serde::Serialize;

use super::Global;
use super::ask::confirm;
use super::error::CliError;
use super::link;
use super::output::Output;
use super::talk::Talk;
use crate::session::{Command, Outcome};

/// Arguments of `axcon defaults`.
///
/// All parameters go back to their factory values at once and the unit resets itself; node-ID, CAN bit rate and the
/// settings of the stream stay. It is done when the unit's new banner has been seen.
#[derive(Debug, clap::Args)]
pub struct Args {}

#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    product: Option<&'a str>,
    version: Option<String>,
    node_id: Option<u8>,
    /// `false` where all that came after the Yes is what the menu shows anyway.
    restart_seen: bool,
}

/// Restores the defaults.
///
/// # Errors
/// If nobody said yes, no unit answers, or its banner does not come back.
pub fn run(_args: Args, global: &Global, output: &mut Output) -> Result<(), CliError> {
    if link::is_recording(global) {
        return Err(link::read_only("restore its defaults"));
    }
    confirm("All parameters go back to their factory values and the unit resets itself", global, output)?;
    let mut talk = Talk::open(global, output)?;
    talk.find_application()?;
    let outcome = talk.ask(Command::RestoreDefaults)?;
    let restart_seen = outcome != Outcome::DefaultsTaken;
    talk.expect_done(&outcome)?;
    let facts = talk.session().facts().clone();
    let product = facts.product.as_ref().map(|known| known.value.as_str());
    let version = facts.version.as_ref().map(|known| known.value.to_string());
    if output.json {
        let node_id = facts.node_id.as_ref().map(|known| known.value);
        return output.object(&Object { schema: "axcon.defaults/1", product, version, node_id, restart_seen });
    }
    let unit = product.unwrap_or("the unit");
    let version = version.map(|version| format!(" V{version}")).unwrap_or_default();
    let done = if restart_seen {
        format!("axcon: the defaults are restored; {unit}{version} has restarted")
    } else {
        format!(
            "axcon: {unit}{version} has taken the Yes and shows its menu; whether it has restarted cannot be seen\n  \
             'axcon dictionary dump' shows its parameters"
        )
    };
    output.remark(&done);
    Ok(())
}
