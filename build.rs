//! Says which commit a build is of, where that can be found out. A build from a package has none, and that is fine.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Changes with every commit and every switch to another one.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit =
        git(&["rev-parse", "--short=12", "HEAD"]).map_or_else(String::new, |commit| format!("commit {commit}, "));
    let variable = |name| std::env::var(name).unwrap_or_default();
    println!("cargo::rustc-env=AXCON_BUILD={commit}{}, {}", variable("TARGET"), variable("PROFILE"));
}

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok().map(|text| text.trim().to_owned())
}
