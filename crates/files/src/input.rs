//! Opening files for reading. Anything but a regular file is refused before it is opened, because opening a pipe
//! waits until another program writes to it.

use std::fs::{File, FileType};
use std::io;
use std::path::Path;

/// The error that a path names something else than a regular file. Holds the kind that was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected a file, found {0}")]
pub struct NotAFile(&'static str);

/// Opens a regular file for reading.
///
/// # Errors
/// Returns the error of the system, or [`NotAFile`] in an [`io::Error`].
pub fn open(path: &Path) -> io::Result<File> {
    match kind(path.metadata()?.file_type()) {
        None => File::open(path),
        Some(found) => Err(io::Error::new(io::ErrorKind::InvalidInput, NotAFile(found))),
    }
}

/// Returns the name of a file type, or `None` for a regular file.
pub(crate) fn kind(of: FileType) -> Option<&'static str> {
    if of.is_file() {
        return None;
    }
    if of.is_dir() {
        return Some("a folder");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if of.is_fifo() {
            return Some("a pipe");
        }
        if of.is_socket() {
            return Some("a socket");
        }
    }
    Some("a device")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "").unwrap();
        assert!(open(&path).is_ok());
        assert_eq!(open(folder.path()).unwrap_err().to_string(), "expected a file, found a folder");
        assert_eq!(open(&folder.path().join("b")).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_without_a_writer_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("7.txt");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert_eq!(open(&path).unwrap_err().to_string(), "expected a file, found a pipe");
        let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("s")).unwrap();
        assert!(open(&folder.path().join("s")).unwrap_err().to_string().ends_with("a socket"));
        assert!(open(Path::new("/dev/null")).unwrap_err().to_string().ends_with("a device"));
    }
}
