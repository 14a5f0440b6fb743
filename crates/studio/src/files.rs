//! Reading the files of a project, which are held in memory.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::Error;

/// The largest size in bytes of all files of a project together.
pub(crate) const TEXT: u64 = 256 << 20;

/// The problem of a link that is not followed.
pub(crate) const LINK: &str = "expected a file of this folder, found a link to another place";

/// Returns whether a path is a link to a file outside of a folder, or to nothing.
pub(crate) fn leads_out(folder: &Path, path: &Path) -> bool {
    let inside = folder.canonicalize();
    let is_inside = |target: PathBuf| inside.as_ref().is_ok_and(|inside| target.starts_with(inside));
    path.is_symlink() && !path.canonicalize().is_ok_and(is_inside)
}

/// Returns the bytes of a file, or `None` if it does not exist.
pub(crate) fn read(path: &Path) -> Result<Option<Vec<u8>>, Error> {
    let failed = |source| Error::Read { path: path.to_path_buf(), source };
    let file = match rayfold_files::open(path) {
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
