//! Reading the files of a project, which are held in memory.

use std::io::{self, Read};
use std::path::Path;

use crate::error::Error;

/// The largest size in bytes of all files of a project together.
pub(crate) const TEXT: u64 = 256 << 20;

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
