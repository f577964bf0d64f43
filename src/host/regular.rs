//! Files that can be read without waiting. Opening anything else may wait for ever, as for a pipe that nobody writes to.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// If there is no such file, it is something else, or it may not be read.
pub fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    // Looked at once it is open, so that nothing else can take its name in between; a pipe does not keep us meanwhile.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, rustix::fs::OFlags::NONBLOCK.bits() as i32);
    let file = options.open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        Err(io::ErrorKind::IsADirectory.into())
    } else if metadata.is_file() {
        Ok(file)
    } else {
        Err(io::Error::new(io::ErrorKind::InvalidInput, NOT_REGULAR))
    }
}

/// What is said of a file that is something else.
pub const NOT_REGULAR: &str = "it is not a regular file";
