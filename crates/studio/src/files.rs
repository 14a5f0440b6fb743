//! Files, read and written whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// Bytes of all files together that are held.
pub(crate) const TEXT: u64 = 256 << 20;

/// The bytes of a file; `None` if it is not there.
pub(crate) fn read(path: &Path) -> Result<Option<Vec<u8>>, Error> {
    let failed = |source| Error::Read { path: path.to_path_buf(), source };
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    let mut text = Vec::new();
    file.take(TEXT + 1).read_to_end(&mut text).map_err(failed)?;
    if text.len() as u64 > TEXT {
        return Err(Error::TooLarge { path: path.to_path_buf(), limit: TEXT });
    }
    Ok(Some(text))
}

/// A hidden name beside a file's place.
fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

/// Writes a file that is not there yet: whole or not at all, and never over another.
pub(crate) fn write_new(path: &Path, text: &[u8]) -> io::Result<()> {
    let temporary = temporary(path);
    let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    let written = (|| {
        file.write_all(text)?;
        file.sync_all()?;
        // Unlike a rename it refuses a name that is taken.
        fs::hard_link(&temporary, path)
    })();
    let _ = fs::remove_file(&temporary);
    written
}

/// Writes a file under a hidden name beside its place, and then in its place.
pub(crate) fn write_whole(path: &Path, text: &[u8]) -> Result<(), Error> {
    let temporary = temporary(path);
    let written = (|| {
        let permissions = fs::metadata(path).ok().map(|metadata| metadata.permissions());
        // Renaming would replace it all the same.
        if permissions.as_ref().is_some_and(|permissions| permissions.readonly()) {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is read-only"));
        }
        let mut file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
        file.write_all(text)?;
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        file.sync_all()?;
        fs::rename(&temporary, path)
    })();
    written.map_err(|source| {
        let _ = fs::remove_file(&temporary);
        Error::Write { path: path.to_path_buf(), source }
    })
}
