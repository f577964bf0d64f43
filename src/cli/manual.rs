//! `axcon completions` and `axcon man`: the command line as shells and man pages have it, made from the same source.

use std::path::{Path, PathBuf};

use clap_complete::Shell;

use super::error::{CliError, Kind};
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
    /// Write a page for each command into this folder, which is made if need be.
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
/// If they cannot be written.
pub fn man(args: &ManArgs, output: &mut Output) -> Result<(), CliError> {
    let Some(folder) = &args.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(super::command())
            .render(&mut page)
            .map_err(|error| CliError::new(Kind::Failed, error))?;
        return output.data(&page);
    };
    let failed = |folder: &Path, error: std::io::Error| {
        let context = format!("cannot write man pages to '{}'", folder.display());
        CliError::new(Kind::Failed, anyhow::Error::new(error).context(context))
    };
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(super::command(), folder))
        .map_err(|error| failed(folder, error))
}
