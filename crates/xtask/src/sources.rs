//! The checkout that is built: its place, a copy of it elsewhere, and flags that keep its folder out of programs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};

/// Returns the compiler flags that remove folder names from panic messages.
pub(crate) fn remapped(root: &Path) -> anyhow::Result<Vec<String>> {
    let home = std::env::home_dir().context("no home folder")?;
    let cargo = std::env::var_os("CARGO_HOME").map_or_else(|| home.join(".cargo"), PathBuf::from);
    let rustup = std::env::var_os("RUSTUP_HOME").map_or_else(|| home.join(".rustup"), PathBuf::from);
    // If several match, the last one applies.
    Ok([(rustup.as_path(), "/rustup"), (cargo.as_path(), "/cargo"), (root, "/rayfold")]
        .map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display()))
        .to_vec())
}

/// Copies into `copy` the files that Git tracks in `root`, and the untracked files that it does not ignore.
pub(crate) fn copy_sources(root: &Path, copy: &Path) -> anyhow::Result<()> {
    let listing = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output()
        .context("cannot run git")?;
    ensure!(listing.status.success(), "git ls-files: {}", listing.status);
    for name in String::from_utf8(listing.stdout)?.split_terminator('\0') {
        let (from, to) = (root.join(name), copy.join(name));
        // The file is deleted, but the deletion is not committed yet.
        if !from.exists() {
            continue;
        }
        fs::create_dir_all(to.parent().context("a file without a folder")?)?;
        fs::copy(&from, &to).with_context(|| format!("cannot copy {name}"))?;
    }
    Ok(())
}

/// Returns the checkout, two folders above this crate.
pub(crate) fn root() -> anyhow::Result<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    match own.ancestors().nth(2) {
        Some(root) => Ok(root.to_owned()),
        None => bail!("{} lies in no checkout", own.display()),
    }
}
