//! The scripts in folders, in the order of their names.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rayfold_scene::natural_cmp;

/// Returns what a folder holds, in order.
pub(super) fn sorted(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| Ok(entry?.path())).collect::<Result<_, std::io::Error>>()?;
    paths.sort_by(|a, b| natural_cmp(&a.to_string_lossy(), &b.to_string_lossy()));
    Ok(paths)
}

/// Returns whether the name of a file is that of a script.
pub(super) fn is_script(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "txt")
}

/// Finds the scripts below a folder, in order.
pub(super) fn find(folder: &Path, scripts: &mut Vec<PathBuf>) -> Result<()> {
    for path in sorted(folder)? {
        if path.is_dir() {
            find(&path, scripts)?;
        } else if is_script(&path) {
            scripts.push(path);
        }
    }
    Ok(())
}
