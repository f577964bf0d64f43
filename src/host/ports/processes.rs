//! Open files of processes, as `/proc` shows them.
//!
//! There are hundreds of processes with thousands of files, and most time of a command that lists ports goes into
//! them: so they are looked through once for all ports, folder by folder without full paths, and nothing is
//! allocated for a file.

use std::ffi::CStr;
use std::fs;
use std::mem::MaybeUninit;
use std::ops::ControlFlow;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStringExt;
use std::path::Path;

use rustix::fs::{CWD, Mode, OFlags, RawDir, openat, readlinkat_raw};
use rustix::io::Errno;
use rustix::path::Arg;

use super::Holder;

/// The first process of our name, but not this one, that has the master of the pseudo-terminal. The name tells an
/// emulator from a terminal window that has got the number of one which is gone.
pub fn other_host(path: &Path) -> Option<Holder> {
    let target = fs::canonicalize(path).ok()?.into_os_string().into_vec();
    let own = name(std::process::id())?;
    let hosts = |pid: u32| {
        let files = fs::read_dir(format!("/proc/{pid}/fd")).ok()?;
        let mut files = files.flatten().map(|file| file.file_name());
        files.find_map(|fd| hosted(pid, &fd.to_string_lossy()).filter(|pts| *pts == target))
    };
    let processes = folder(CWD, "/proc").ok()?;
    let pid = pids(&processes).into_iter().find(|&pid| {
        !is_ours(pid)
            && name(pid).as_deref() == Some(own.as_str())
            && hosts(pid).is_some()
            && was_told_to_link(pid, path)
    })?;
    Some(Holder { name: own, pid })
}

/// Whether a process was started with `--link PATH`, where this path is PATH, or PATH with a unit's number after it. A
/// link that a killed emulator has left may lead to a pseudo-terminal of the same number that is another emulator's by
/// now; that one was not told of the link.
fn was_told_to_link(pid: u32, path: &Path) -> bool {
    let Ok(line) = fs::read(format!("/proc/{pid}/cmdline")) else { return false };
    let Ok(folder) = fs::read_link(format!("/proc/{pid}/cwd")) else { return false };
    let Ok(path) = std::path::absolute(path) else { return false };
    let words: Vec<String> = line.split(|&byte| byte == 0).map(|word| String::from_utf8_lossy(word).into()).collect();
    let following = words.windows(2).filter(|pair| pair[0] == "--link").map(|pair| pair[1].as_str());
    let joined = words.iter().filter_map(|word| word.strip_prefix("--link="));
    following.chain(joined).any(|named| {
        let named = folder.join(named);
        path.to_string_lossy().starts_with(&*named.to_string_lossy())
    })
}

/// What the system calls a process.
pub fn name(pid: u32) -> Option<String> {
    Some(fs::read_to_string(format!("/proc/{pid}/comm")).ok()?.trim_end().to_owned())
}

/// Whether it is this process, or a child of it that has not begun its own program yet.
pub fn is_ours(pid: u32) -> bool {
    let own = std::process::id();
    let program = |pid: u32| fs::read_link(format!("/proc/{pid}/exe")).ok();
    let parent = || {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
        status.lines().find_map(|line| line.strip_prefix("PPid:"))?.trim().parse::<u32>().ok()
    };
    pid == own || (parent() == Some(own) && program(pid) == program(own))
}

/// The longest name the system gives for an open file.
const LONGEST_PATH: usize = 4096;

/// A port, by what the link of an open file leads to.
struct Wanted {
    /// `None` where there is no such file.
    target: Option<Vec<u8>>,
    holder: Option<Holder>,
    /// Descriptors of the process that is being looked at.
    uses: usize,
    /// That process hosts this pseudo-terminal.
    hosts: bool,
}

impl Wanted {
    fn is_pseudo_terminal(&self) -> bool {
        self.target.as_deref().is_some_and(|target| target.starts_with(b"/dev/pts/"))
    }
}

/// For each port the first process, of those that count, that uses it.
pub fn holders(paths: &[&Path], counts: impl Fn(u32) -> bool) -> Vec<Option<Holder>> {
    let wanted = |path: &&Path| {
        let target = fs::canonicalize(path).ok().map(|target| target.into_os_string().into_vec());
        Wanted { target, holder: None, uses: 0, hosts: false }
    };
    let mut wanted: Vec<Wanted> = paths.iter().map(wanted).collect();
    let is_settled = |wanted: &[Wanted]| wanted.iter().all(|port| port.target.is_none() || port.holder.is_some());
    if !is_settled(&wanted)
        && let Ok(processes) = folder(CWD, "/proc")
    {
        for pid in pids(&processes) {
            look_at(&processes, pid, &counts, &mut wanted);
            if is_settled(&wanted) {
                break;
            }
        }
    }
    wanted.into_iter().map(|port| port.holder).collect()
}

/// Whether the process uses one of the ports. The host of a pseudo-terminal keeps one descriptor of the client's side
/// open; that one does not count.
fn look_at(processes: &OwnedFd, pid: u32, counts: &impl Fn(u32) -> bool, wanted: &mut [Wanted]) {
    let Ok(files) = folder(processes, format!("{pid}/fd")) else { return };
    for port in &mut *wanted {
        (port.uses, port.hosts) = (0, false);
    }
    let mut link = [MaybeUninit::uninit(); LONGEST_PATH];
    each_entry(&files, |file| {
        let open = match readlinkat_raw(&files, file, &mut link) {
            Ok((open, _)) => open,
            // A process that shows how many files it has and not which shows none.
            Err(Errno::ACCESS | Errno::PERM) => return ControlFlow::Break(()),
            // Closed meanwhile.
            Err(_) => return ControlFlow::Continue(()),
        };
        let is_host = open.ends_with(b"/ptmx") && wanted.iter().any(Wanted::is_pseudo_terminal);
        let hosted = if is_host { hosted(pid, &file.to_string_lossy()) } else { None };
        for port in wanted.iter_mut() {
            port.uses += usize::from(port.target.as_deref() == Some(&*open));
            port.hosts |= hosted.is_some() && port.target == hosted;
        }
        ControlFlow::Continue(())
    });
    for port in wanted.iter_mut().filter(|port| port.holder.is_none() && port.uses > usize::from(port.hosts)) {
        port.holder = counts(pid).then(|| Holder { name: name(pid).unwrap_or_default(), pid });
    }
}

fn folder(at: impl AsFd, path: impl Arg) -> rustix::io::Result<OwnedFd> {
    openat(at, path, OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())
}

/// Shows each entry of a folder until `act` has seen enough.
fn each_entry(folder: &OwnedFd, mut act: impl FnMut(&CStr) -> ControlFlow<()>) {
    let mut buffer = [MaybeUninit::uninit(); 8192];
    let mut entries = RawDir::new(folder, &mut buffer);
    while let Some(Ok(entry)) = entries.next() {
        let is_itself_or_parent = entry.file_name().to_bytes().starts_with(b".");
        if !is_itself_or_parent && act(entry.file_name()).is_break() {
            return;
        }
    }
}

/// The processes there are, in the order of their numbers.
fn pids(processes: &OwnedFd) -> Vec<u32> {
    let mut pids = Vec::new();
    each_entry(processes, |name| {
        pids.extend(name.to_str().ok().and_then(|name| name.parse::<u32>().ok()));
        ControlFlow::Continue(())
    });
    pids.sort_unstable();
    pids
}

/// The client's side of the pseudo-terminal whose master this descriptor is.
fn hosted(pid: u32, fd: &str) -> Option<Vec<u8>> {
    let info = fs::read_to_string(format!("/proc/{pid}/fdinfo/{fd}")).ok()?;
    let index = info.lines().find_map(|line| line.strip_prefix("tty-index:"))?;
    Some(format!("/dev/pts/{}", index.trim()).into_bytes())
}
