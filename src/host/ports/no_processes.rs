//! Open files of processes, on systems that cannot be asked for them here: none is open.

use std::path::Path;

use super::Holder;

pub fn holders(paths: &[&Path], _counts: impl Fn(u32) -> bool) -> Vec<Option<Holder>> {
    vec![None; paths.len()]
}

pub fn other_host(_path: &Path) -> Option<Holder> {
    None
}

#[cfg(unix)]
pub fn name(_pid: u32) -> Option<String> {
    None
}

pub fn is_ours(pid: u32) -> bool {
    pid == std::process::id()
}
