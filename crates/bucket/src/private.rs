//! Folders that other users of the machine cannot read.

use std::fs::{self, DirBuilder, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::Path;

/// The permission bits of group and others.
const OTHERS: u32 = 0o077;

/// The mode of a file that only its owner can read.
pub(crate) const FILE: u32 = 0o600;

/// Creates a folder and its parents if they are missing. A new folder is accessible to its owner only. New parents
/// have the usual mode, and an existing folder keeps its own.
///
/// # Errors
/// Returns the error of the system.
pub fn make(folder: &Path) -> io::Result<()> {
    if let Some(above) = folder.parent() {
        fs::create_dir_all(above)?;
    }
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(failed) if failed.kind() == io::ErrorKind::AlreadyExists && folder.is_dir() => Ok(()),
        made => made,
    }
}

/// Removes the access of all but the owner from a folder. A folder of another owner is left unchanged.
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
