//! Lock files, as the Filesystem Hierarchy Standard has them: the process number, ten characters wide.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{Holder, processes};

/// Bytes of a lock file that are looked at: number, program and user fit.
const MOST: u64 = 64;

pub fn holder(folder: &Path, port: &Path) -> Option<Holder> {
    // Below `/dev/pts` names are bare numbers, which lock files do not tell from others.
    let port = std::fs::canonicalize(port).ok().filter(|port| !port.starts_with("/dev/pts"))?;
    let name = port.file_name()?.to_str()?;
    let mut text = Vec::new();
    File::open(folder.join(format!("LCK..{name}"))).ok()?.take(MOST).read_to_end(&mut text).ok()?;
    let pid = process(&text).filter(|&pid| pid != std::process::id() && is_alive(pid))?;
    Some(Holder { name: processes::name(pid).unwrap_or_else(|| "a program with a lock file".into()), pid })
}

/// The process that a lock file names: in digits, or as old programs write it, as a number of four bytes.
fn process(text: &[u8]) -> Option<u32> {
    let digits = std::str::from_utf8(text).ok().and_then(|text| text.split_whitespace().next()?.parse().ok());
    digits.or_else(|| text.try_into().ok().map(u32::from_ne_bytes)).filter(|&pid| pid > 0)
}

fn is_alive(pid: u32) -> bool {
    let pid = i32::try_from(pid).ok().and_then(rustix::process::Pid::from_raw);
    // A process of somebody else may not be signalled, but is there.
    pid.is_some_and(|pid| rustix::process::test_kill_process(pid) != Err(rustix::io::Errno::SRCH))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_file_counts_as_long_as_its_process_lives() {
        assert_eq!(process(b"      1234\n"), Some(1234));
        assert_eq!(process(b"      1234 minicom root\n"), Some(1234));
        assert_eq!(process(&0x0001_02FF_u32.to_ne_bytes()), Some(0x0001_02FF));
        for nonsense in [&b""[..], b"\xff\xff", b"0", b"minicom", b"\0\0\0\0"] {
            assert_eq!(process(nonsense), None, "{}", nonsense.escape_ascii());
        }
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("ttyUSB0");
        std::fs::write(&port, b"").expect("written");
        let lock = |text: String| {
            std::fs::write(folder.path().join("LCK..ttyUSB0"), text).expect("written");
            holder(folder.path(), &port).map(|holder| holder.pid)
        };
        let parent = std::os::unix::process::parent_id();
        assert_eq!(lock(format!("{parent:>10}\n")), Some(parent));
        assert_eq!(lock(format!("{:>10}\n", std::process::id())), None, "our own");
        assert_eq!(lock(format!("{:>10}\n", i32::MAX)), None, "left behind by a process that was killed");
    }
}
