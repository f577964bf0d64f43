//! Names for ports that stay the same.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::ports;

/// A name for a port that stays the same: a symbolic link, removed on drop if it is still ours.
#[derive(Debug)]
pub struct PortLink {
    link: PathBuf,
    target: PathBuf,
}

/// Why a link could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PortLinkError {
    /// Something else than a link to a pseudo-terminal has the name.
    #[error("'{}' exists and is {what}; it is left as it is", link.display())]
    Taken {
        /// The name.
        link: PathBuf,
        /// What has it.
        what: String,
    },
    /// The system refused.
    #[error("cannot make the link '{}'", link.display())]
    Io {
        /// The name.
        link: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
}

impl PortLink {
    /// Makes `link` point at `target`. A link to a pseudo-terminal, which a killed emulator leaves behind, is replaced
    /// in one step; anything else is not touched.
    ///
    /// # Errors
    /// If the name is taken by something else, or the system refuses.
    pub fn create(link: &Path, target: &Path) -> Result<Self, PortLinkError> {
        let failed = |source| PortLinkError::Io { link: link.to_owned(), source };
        match fs::symlink_metadata(link) {
            Ok(metadata) if metadata.is_symlink() => {
                let former = fs::read_link(link).map_err(failed)?;
                // One that leads elsewhere is somebody's even if nothing is there now: a share may not be mounted.
                if !is_pseudo_terminal(&former) {
                    let what = format!("a link to '{}', not to a pseudo-terminal", former.display());
                    return Err(PortLinkError::Taken { link: link.to_owned(), what });
                }
                if let Some(host) = ports::other_host(link) {
                    let what = format!("the port of a unit that {host} emulates");
                    return Err(PortLinkError::Taken { link: link.to_owned(), what });
                }
            }
            Ok(metadata) => {
                let what = if metadata.is_dir() { "a directory" } else { "a file" };
                return Err(PortLinkError::Taken { link: link.to_owned(), what: what.into() });
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(failed(error)),
        }
        let mut temporary = link.as_os_str().to_owned();
        temporary.push(format!(".{}.tmp", std::process::id()));
        let temporary = PathBuf::from(temporary);
        // Left behind by a process of the same number that was killed: in a container they all have the same.
        let _ = fs::remove_file(&temporary);
        symlink(target, &temporary).map_err(failed)?;
        if let Err(error) = fs::rename(&temporary, link) {
            let _ = fs::remove_file(&temporary);
            return Err(failed(error));
        }
        Ok(PortLink { link: link.to_owned(), target: target.to_owned() })
    }

    /// The name.
    pub fn path(&self) -> &Path {
        &self.link
    }
}

/// Whether a path is where this system has its pseudo-terminals, those that are gone included.
fn is_pseudo_terminal(path: &Path) -> bool {
    path.starts_with("/dev/pts") || (cfg!(target_os = "macos") && path.to_string_lossy().starts_with("/dev/ttys"))
}

impl Drop for PortLink {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|target| target == self.target) {
            let _ = fs::remove_file(&self.link);
        }
    }
}

#[cfg(unix)]
fn symlink(target: &Path, link: &Path) -> io::Result<()> {
    std::os::unix::fs::symlink(target, link)
}

/// Ports are not files there.
#[cfg(not(unix))]
fn symlink(_target: &Path, _link: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_link_replaces_only_a_link_to_a_pseudo_terminal() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = folder.path().join("port");
        let create = |name: &Path| PortLink::create(name, Path::new("/dev/pts/4711"));

        let stale = folder.path().join("stale");
        std::os::unix::fs::symlink("/dev/pts/4712", &stale).expect("a link");
        let half_way = folder.path().join(format!("stale.{}.tmp", std::process::id()));
        std::os::unix::fs::symlink("/dev/pts/4713", half_way).expect("a link");
        drop(create(&stale).expect("replaced"));
        assert!(fs::symlink_metadata(&stale).is_err(), "removed on drop");

        let link = create(&name).expect("made");
        fs::remove_file(&name).expect("removed");
        fs::write(&name, "mine now").expect("a file");
        drop(link);
        assert!(name.exists(), "another's file stays");
        let error = create(&name).expect_err("refused").to_string();
        assert!(error.contains("exists and is a file"), "{error}");

        let foreign = folder.path().join("foreign");
        std::os::unix::fs::symlink(&name, &foreign).expect("a link");
        let error = create(&foreign).expect_err("refused").to_string();
        assert!(error.contains("not to a pseudo-terminal"), "{error}");

        let dangling = folder.path().join("dangling");
        std::os::unix::fs::symlink("/mnt/nas/thing", &dangling).expect("a link");
        let error = create(&dangling).expect_err("refused").to_string();
        assert!(error.contains("a link to '/mnt/nas/thing', not to a pseudo-terminal"), "{error}");
        assert_eq!(fs::read_link(&dangling).expect("still there"), Path::new("/mnt/nas/thing"));
        assert_eq!(fs::read_dir(folder.path()).expect("listed").count(), 3, "nothing temporary is left");
    }
}
