//! The files of rows, behind a trait, so that a test can simulate a power cut.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::Arc;

use super::bodies::sync_folder;
use crate::private;

/// A file of the store that is open.
pub(super) trait Medium: std::fmt::Debug + Send + Sync {
    /// Returns the length in bytes.
    fn len(&self) -> io::Result<u64>;
    /// Reads at most `out.len()` bytes at an offset. Returns their number, which is 0 at the end.
    fn read_at(&self, out: &mut [u8], offset: u64) -> io::Result<usize>;
    /// Writes all bytes at an offset.
    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()>;
    /// Truncates the file, or extends it with zeros.
    fn set_len(&self, length: u64) -> io::Result<()>;
    /// Syncs all writes to disk.
    fn sync(&self) -> io::Result<()>;

    /// Fills `out` from an offset on. Bytes beyond the end are zeros.
    fn read_padded(&self, out: &mut [u8], offset: u64) -> io::Result<()> {
        let mut done = 0;
        while done < out.len() {
            match self.read_at(&mut out[done..], offset + done as u64) {
                Ok(0) => break,
                Ok(read) => done += read,
                Err(again) if again.kind() == io::ErrorKind::Interrupted => {}
                Err(failed) => return Err(failed),
            }
        }
        out[done..].fill(0);
        Ok(())
    }

    /// Returns the whole content.
    fn read_all(&self) -> io::Result<Vec<u8>> {
        let length = usize::try_from(self.len()?).map_err(io::Error::other)?;
        let mut bytes = vec![0; length];
        self.read_padded(&mut bytes, 0)?;
        Ok(bytes)
    }
}

impl Medium for File {
    fn len(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }

    fn read_at(&self, out: &mut [u8], offset: u64) -> io::Result<usize> {
        FileExt::read_at(self, out, offset)
    }

    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        FileExt::write_all_at(self, bytes, offset)
    }

    fn set_len(&self, length: u64) -> io::Result<()> {
        Self::set_len(self, length)
    }

    fn sync(&self) -> io::Result<()> {
        self.sync_data()
    }
}

/// A source of files by their paths.
pub(super) trait Files: std::fmt::Debug + Send + Sync {
    /// Opens a file, which is created if missing.
    fn open(&self, path: &Path) -> io::Result<Arc<dyn Medium>>;
    /// Returns whether the file exists.
    fn exists(&self, path: &Path) -> bool;
    /// Renames a file, replacing an existing one. It is on disk on return.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Removes a file if it exists.
    fn remove(&self, path: &Path) -> io::Result<()>;
}

/// The files of the system.
#[derive(Debug)]
pub(super) struct SystemFiles;

impl Files for SystemFiles {
    fn open(&self, path: &Path) -> io::Result<Arc<dyn Medium>> {
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false).mode(private::FILE);
        Ok(Arc::new(options.open(path)?))
    }

    fn exists(&self, path: &Path) -> bool {
        path.exists()
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)?;
        to.parent().map_or(Ok(()), sync_folder)
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        match fs::remove_file(path) {
            Err(failed) if failed.kind() != io::ErrorKind::NotFound => Err(failed),
            _ => Ok(()),
        }
    }
}
