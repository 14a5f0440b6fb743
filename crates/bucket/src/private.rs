//! Folders that other users of the machine do not look into.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::Path;

/// What a group and others may do.
const OTHERS: u32 = 0o077;

/// Of a file that nobody else reads.
pub(crate) const FILE: u32 = 0o600;

/// Makes a folder, and those above it, when missing. A new one is its owner's alone; those above it are as usual, and one
/// that is there stays as it is.
///
/// # Errors
/// The system's.
pub fn make(folder: &Path) -> io::Result<()> {
    if let Some(above) = folder.parent() {
        fs::create_dir_all(above)?;
    }
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(failed) if failed.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
        made => made,
    }
}

/// Closes a folder to all but its owner. One of another owner's is that one's business, and stays as it is.
pub fn close(folder: &Path) {
    let Ok(found) = folder.metadata() else { return };
    let mode = found.permissions().mode();
    if mode & OTHERS != 0 {
        let _ = fs::set_permissions(folder, Permissions::from_mode(mode & !OTHERS));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn a_new_folder_is_its_owners_alone_and_one_that_is_there_stays_as_it_is() {
        let above = tempfile::tempdir().unwrap();
        let folder = above.path().join("one/two");
        make(&folder).unwrap();
        assert_eq!(mode(&folder), 0o700);
        assert_ne!(mode(&above.path().join("one")) & OTHERS, 0, "as usual");
        fs::set_permissions(&folder, Permissions::from_mode(0o755)).unwrap();
        make(&folder).unwrap();
        assert_eq!(mode(&folder), 0o755);
        close(&folder);
        assert_eq!(mode(&folder), 0o700);
        let file = above.path().join("file");
        fs::write(&file, "").unwrap();
        make(&file).unwrap_err();
        make(&file.join("below")).unwrap_err();
        make(Path::new(".")).unwrap();
    }
}
