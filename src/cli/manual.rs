//! `axcon completions` and `axcon man`: the command line as shells and man pages have it, made from the same source.

use std::path::PathBuf;

use clap_complete::Shell;

use super::Global;
use super::error::{CliError, Kind};
use super::files::{Destination, shown};
use super::output::Output;

/// Arguments of `axcon completions`.
///
/// Put the output where the shell looks for it: bash: ~/.local/share/bash-completion/completions/axcon, zsh: _axcon in a
/// folder of $fpath, fish: ~/.config/fish/completions/axcon.fish.
#[derive(Debug, clap::Args)]
pub struct CompletionArgs {
    /// For which shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `axcon man`.
///
/// Without --out: the page axcon(1), for `man -l -`.
#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Write a page for each command into this folder, which is made if need be. Existing pages need --yes.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// Writes the completions.
///
/// # Errors
/// If they cannot be written.
pub fn completions(args: &CompletionArgs, output: &mut Output) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut super::command(), "axcon", &mut script);
    output.data(&script)
}

/// Writes the man pages.
///
/// # Errors
/// If pages are there that should stay, or they cannot be written.
pub fn man(args: &ManArgs, global: &Global, output: &mut Output) -> Result<(), CliError> {
    let Some(folder) = &args.out else {
        let page = page(&clap_mangen::Man::new(super::command()))?;
        return output.data(&page);
    };
    std::fs::create_dir_all(folder).map_err(|error| {
        let context = format!("cannot write man pages to '{}'", shown(folder));
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(context))
    })?;
    let mut command = super::command().disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    for man in mans(command) {
        pages.push((Destination::admit(Some(&folder.join(man.get_filename())), global.yes)?, page(&man)?));
    }
    // None is written before all may be.
    pages.iter_mut().try_for_each(|(place, page)| place.save(page, output))
}

/// A command's page after those of the commands within it.
fn mans(command: clap::Command) -> Vec<clap_mangen::Man> {
    let within = command.get_subcommands().filter(|within| !within.is_hide_set()).cloned();
    let mut all: Vec<_> = within.flat_map(mans).collect();
    all.push(clap_mangen::Man::new(command));
    all
}

fn page(man: &clap_mangen::Man) -> Result<Vec<u8>, CliError> {
    let mut page = Vec::new();
    man.render(&mut page).map_err(|error| CliError::new(Kind::Failed, error))?;
    Ok(page)
}
