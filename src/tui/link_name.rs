//! Names of links, as far as the screens write or change them. What they mean is known to `host::link` alone.

use std::path::Path;

use super::picker;
use crate::device::Product;

const EMULATED: &str = "emu:";
const REPLAY: &str = "replay:";

/// The name of an emulated unit.
pub fn emulated(product: &Product) -> String {
    format!("{EMULATED}{}", product.name.to_lowercase())
}

/// A name with the home folder in place of a leading `~`: in the path of a port, or of a recording.
pub fn expanded(name: &str, home: Option<&Path>) -> String {
    let (scheme, path) = match name.split_at_checked(REPLAY.len()) {
        Some((scheme, path)) if scheme.eq_ignore_ascii_case(REPLAY) => (scheme, path),
        _ => ("", name),
    };
    match path.starts_with('~') {
        true => format!("{scheme}{}", picker::expanded(path.into(), home).display()),
        false => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_home_folder_stands_for_a_tilde_in_paths_only() {
        let expanded = |name| expanded(name, Some(Path::new("/home/me")));
        let at_home = |name| Path::new("/home/me").join(name).display().to_string();
        assert_eq!(expanded("~/port"), at_home("port"));
        assert_eq!(expanded("replay:~/a.cast"), format!("replay:{}", at_home("a.cast")));
        assert_eq!(expanded("Replay:~/a.cast"), format!("Replay:{}", at_home("a.cast")));
        for same in ["emu:axtc4co", "/dev/~", "tcp://~:1", "", "replay", "r\u{e9}play~"] {
            assert_eq!(expanded(same), same);
        }
    }
}
