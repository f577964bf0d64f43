//! Says which commit a build is of, where that can be found out. A build from a package has none, and that is fine.

use std::env;
use std::fs;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = if is_own_repository() {
        // Changes with every commit and every switch to another one.
        if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
            println!("cargo::rerun-if-changed={log}");
        }
        commit()
    } else {
        None
    };
    let commit = commit.map_or_else(String::new, |commit| format!("commit {commit}, "));
    let variable = |name| env::var(name).unwrap_or_default();
    println!("cargo::rustc-env=AXCON_BUILD={commit}{}, {}", variable("TARGET"), variable("PROFILE"));
}

/// Whether the package is the repository, not something unpacked within another one.
fn is_own_repository() -> bool {
    let same =
        |root: String| Some(fs::canonicalize(root).ok()? == fs::canonicalize(env::var_os("CARGO_MANIFEST_DIR")?).ok()?);
    git(&["rev-parse", "--show-toplevel"]).and_then(same).unwrap_or(false)
}

/// The commit, with a `+` if tracked files differed from it when this script last ran, which is not at every build.
fn commit() -> Option<String> {
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changes = git(&["--no-optional-locks", "status", "--porcelain", "--untracked-files=no"])?;
    Some(if changes.is_empty() { commit } else { commit + "+" })
}

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned())
}
