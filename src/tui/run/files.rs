//! What the console asks of files, folders and ports; all of it is done in threads.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::super::picker::is_image_name;
use super::super::{
    FIRST_BYTES, FileEntry, FileKind, Input, LARGEST_TEXT, MOST_LISTED, PortEntry, Recorded, RecordingEntry,
    RecordingList,
};
use crate::host::link::LinkSpec;
use crate::host::regular;
use crate::host::save::{SaveError, save};
use crate::host::{self, library, ports, recorder};

/// The serial ports.
pub(super) fn ports() -> Result<Vec<PortEntry>, String> {
    let ports = ports::list().map_err(|error| format!("the serial ports cannot be listed: {error}"))?;
    let holders = ports::holders(&ports);
    let entry = |(port, holder): (ports::Port, Option<ports::Holder>)| PortEntry {
        busy_by: holder.map(|holder| holder.to_string()),
        description: describe(&port),
        link: port.path,
    };
    Ok(ports.into_iter().zip(holders).map(entry).collect())
}

/// `USB, FTDI FT232R USB UART, 0403:6001, serial number AX12345, ftdi_sio`.
fn describe(port: &ports::Port) -> String {
    let mut parts = vec![match port.kind {
        ports::Kind::Usb => "USB".to_owned(),
        ports::Kind::Native => "built in".to_owned(),
        ports::Kind::Pty => "pseudo-terminal".to_owned(),
        ports::Kind::Bluetooth => "Bluetooth".to_owned(),
    }];
    if let Some(usb) = &port.usb {
        let words: Vec<&str> = [usb.manufacturer.as_deref(), usb.product.as_deref()].into_iter().flatten().collect();
        parts.extend((!words.is_empty()).then(|| words.join(" ")));
        parts.push(format!("{:04x}:{:04x}", usb.vid, usb.pid));
        parts.extend(usb.serial_number.as_ref().map(|number| format!("serial number {number}")));
    }
    parts.extend(port.driver.clone());
    parts.join(", ")
}

/// A folder.
pub(super) fn folder(directory: &Path) -> Input {
    let directory = std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned());
    let entries = fs::read_dir(&directory).map_err(|error| error.to_string()).map(|entries| {
        entries
            .flatten()
            .take(MOST_LISTED)
            .filter_map(|entry| {
                // Of a link, what it leads to.
                let metadata = fs::metadata(entry.path()).ok()?;
                let kind = if metadata.is_dir() { FileKind::Folder } else { FileKind::File };
                let name = entry.file_name().to_string_lossy().into_owned();
                let begins = if is_image_name(&name) { None } else { first_bytes(&entry.path()).ok() };
                Some(FileEntry {
                    name,
                    kind,
                    begins: begins.unwrap_or_default(),
                    bytes: if kind == FileKind::File { metadata.len() } else { 0 },
                    modified: metadata.modified().ok().and_then(host::clock::local_date_and_time),
                })
            })
            .collect()
    });
    Input::FilesListed { directory, entries }
}

fn first_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    regular::open(path)?.take(FIRST_BYTES as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Where recordings are kept.
pub(super) fn state_folder() -> Result<PathBuf, String> {
    recorder::folder().ok_or_else(|| "this system does not say where programs keep their state".to_owned())
}

/// The recordings: those of the state folder, and the one that this console writes, which may lie elsewhere.
pub(super) fn recordings(state: Result<PathBuf, String>, written: Option<PathBuf>) -> Result<RecordingList, String> {
    let written = written.and_then(library::look);
    let in_state = state.and_then(|folder| {
        library::list(&folder).map_err(|error| format!("cannot read '{}': {error}", folder.display()))
    });
    let mut library = match in_state {
        Err(_) if written.is_some() => library::Library::default(),
        in_state => in_state?,
    };
    if let Some(written) = written.filter(|written| library.listed.iter().all(|listed| listed.path != written.path)) {
        library.listed.insert(0, written);
    }
    let recorded = |content: library::Content| Recorded {
        begun: host::clock::local_text(content.header.unix_millis),
        port: content.header.port,
        part: content.header.part,
        length: content.length,
        is_being_written: content.is_being_written,
    };
    let entry = |listed: library::Listed| RecordingEntry {
        path: listed.path.display().to_string(),
        link: LinkSpec::Replay(listed.path).to_string(),
        bytes: listed.bytes,
        content: listed.content.map(recorded),
    };
    Ok(RecordingList { entries: library.listed.into_iter().map(entry).collect(), older: library.older })
}

/// Writes a new file, whole or not at all.
pub(super) fn create(path: &Path, bytes: &[u8]) -> Result<(), String> {
    save(path, bytes, false).map_err(|error| match error {
        SaveError::Exists | SaveError::NotAFile => "a file of that name already exists".to_owned(),
        SaveError::Io(error) => error.to_string(),
    })
}

/// Writes more at the end of a file, all of it or nothing.
pub(super) fn append(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let file = File::options().write(true).open(path);
    let written = file.and_then(|mut file| write_at_end(&mut file, bytes, |file, end| file.set_len(end)));
    written.map_err(|error| error.to_string())
}

/// Part of what is to be written would be taken for a whole row, and is cut off again.
fn write_at_end<F: Write + Seek>(
    file: &mut F,
    bytes: &[u8],
    cut: impl FnOnce(&mut F, u64) -> io::Result<()>,
) -> io::Result<()> {
    let end = file.seek(SeekFrom::End(0))?;
    file.write_all(bytes).inspect_err(|_| {
        let _ = cut(file, end);
    })
}

/// A text file that is not too large.
pub(super) fn text(path: &Path) -> Result<String, String> {
    let bytes = bytes(path, LARGEST_TEXT)?;
    String::from_utf8(bytes).map_err(|_| "it is not text in UTF-8".to_owned())
}

/// A file of no more bytes than this.
pub(super) fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    // One byte more than allowed shows that there is more.
    open(path)?.take(most + 1).read_to_end(&mut bytes).map_err(|error| said(&error))?;
    if bytes.len() as u64 > most {
        return Err(format!("it has more than {most} bytes"));
    }
    Ok(bytes)
}

/// A file, open, if it can be read without waiting for anybody.
pub(super) fn open(path: &Path) -> Result<File, String> {
    regular::open(path).map_err(|error| said(&error))
}

/// What the system says, without the number that it adds.
fn said(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "it may not be read".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_folder(state: &Path, written: Option<&Path>) -> RecordingList {
        recordings(Ok(state.to_owned()), written.map(Path::to_owned)).expect("listed")
    }

    #[test]
    fn a_recording_elsewhere_that_is_being_written_is_the_first_of_the_list() {
        let (state, elsewhere) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("another"));
        let cast = "{\"version\": 2, \"width\": 80, \"height\": 24}\n[1.5, \"o\", \"hello\"]\n";
        let path = elsewhere.path().join("mine.cast");
        for path in [&path, &state.path().join("20260131T120000Z-ttyUSB0-1.cast")] {
            fs::write(path, cast).expect("written");
        }
        let listed = in_folder(state.path(), Some(&path)).entries;
        assert_eq!(listed.len(), 2);
        assert_eq!(listed[0].link, format!("replay:{}", path.display()));
        let length = listed[0].content.as_ref().map(|content| content.length);
        assert_eq!(length, Ok(Some(crate::time::Duration::from_millis(1500))));
        fs::remove_file(&path).expect("removed");
        assert_eq!(in_folder(state.path(), Some(&path)).entries, listed[1..], "what is not there is not listed");
    }

    #[test]
    fn of_what_a_full_disk_takes_only_in_part_nothing_stays() {
        /// A file on a disk that has room for this many bytes.
        struct Tight(Vec<u8>, usize);

        impl Write for Tight {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                let taken = bytes.len().min(self.1 - self.0.len());
                self.0.extend(&bytes[..taken]);
                if taken > 0 { Ok(taken) } else { Err(io::ErrorKind::StorageFull.into()) }
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }

        impl Seek for Tight {
            fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
                assert_eq!(to, SeekFrom::End(0));
                Ok(self.0.len() as u64)
            }
        }

        let mut file = Tight(b"20.5\n".to_vec(), 12);
        let mut write = |row: &[u8]| {
            let written = write_at_end(&mut file, row, |file, end| {
                file.0.truncate(end as usize);
                Ok(())
            });
            (written.map_err(|error| error.kind()), file.0.clone())
        };
        assert_eq!(write(b"20.6\n"), (Ok(()), b"20.5\n20.6\n".to_vec()));
        assert_eq!(write(b"20.7\n"), (Err(io::ErrorKind::StorageFull), b"20.5\n20.6\n".to_vec()));

        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("rows.csv");
        fs::write(&path, "20.5\n").expect("written");
        append(&path, b"20.6\n").expect("there is room");
        assert_eq!(fs::read(&path).expect("there"), b"20.5\n20.6\n");
    }

    #[test]
    fn without_a_state_folder_the_recording_that_is_being_written_is_all_there_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mine.cast");
        fs::write(&path, "{\"version\": 2, \"width\": 80, \"height\": 24}\n").expect("written");
        let nowhere = || Err("nowhere".to_owned());
        assert_eq!(recordings(nowhere(), Some(path)).map(|list| list.entries.len()), Ok(1));
        assert_eq!(recordings(nowhere(), None), Err("nowhere".to_owned()));
    }
}
