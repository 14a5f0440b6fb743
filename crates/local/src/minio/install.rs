//! Finding MinIO, or building it from source.
//!
//! The community edition is archived, and was published as source alone; module proxies may refuse it. The version is its
//! last commit; older ones mishandle `If-Match` on a missing key. It goes into the user's cache once; a file lock keeps
//! processes from building it side by side.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, mem};

use crate::error::{Error, Result};

/// What is built when there is none.
pub const SOURCE: &str = "github.com/minio/minio@v0.0.0-20260212201848-7aac2a2c5b7c";

/// The oldest Go that builds [`SOURCE`].
const GO: (u32, u32) = (1, 25);

/// The binary that RAYFOLD_MINIO names, or `minio` on the PATH, or the one built earlier.
///
/// # Errors
/// [`Error::NoMinio`], [`Error::NamedMinioMissing`].
pub fn find() -> Result<PathBuf> {
    if let Some(named) = env::var_os("RAYFOLD_MINIO").map(PathBuf::from) {
        return if named.is_file() { Ok(named) } else { Err(Error::NamedMinioMissing(named)) };
    }
    if let Some(found) = on_path("minio") {
        return Ok(found);
    }
    let binary = cache()?.join("minio");
    if is_installed(&binary) {
        return Ok(binary);
    }
    Err(Error::NoMinio(format!("it is neither on the PATH nor in {}", binary.display())))
}

/// The same, or one built now.
///
/// `say` hears what takes time, a line at a time.
///
/// # Errors
/// [`Error::NoMinio`] without MinIO and Go, [`Error::Install`] when the build fails, [`Error::File`] for the cache.
pub fn find_or_install(say: &mut dyn FnMut(&str)) -> Result<PathBuf> {
    match find() {
        Err(Error::NoMinio(_)) => {}
        found => return found,
    }
    let folder = cache()?;
    let binary = folder.join("minio");
    fs::create_dir_all(&folder).map_err(Error::file(&folder))?;
    let lock_path = folder.join("minio.lock");
    let lock = File::create(&lock_path).map_err(Error::file(&lock_path))?;
    if lock.try_lock().is_err() {
        say("MinIO is being installed by another process; waiting for it");
        lock.lock().map_err(Error::file(&lock_path))?;
    }
    if !is_installed(&binary) {
        build(&folder, &binary, say)?;
    }
    Ok(binary)
}

/// The stamp says which source the binary is of, so that a new version replaces it.
fn is_installed(binary: &Path) -> bool {
    binary.is_file() && fs::read_to_string(stamp(binary)).is_ok_and(|version| version == SOURCE)
}

fn stamp(binary: &Path) -> PathBuf {
    binary.with_extension("version")
}

fn build(folder: &Path, binary: &Path, say: &mut dyn FnMut(&str)) -> Result<()> {
    let go = on_path("go").ok_or_else(|| Error::NoMinio("neither minio nor go is on the PATH".into()))?;
    let version = go_version(&go)?;
    if version < GO {
        return Err(Error::NoMinio(format!("the Go on the PATH is {}.{}", version.0, version.1)));
    }
    say("installing MinIO from source, once; this takes a few minutes");
    let building = folder.join("building");
    let mut child = Command::new(&go)
        .args(["install", "-v", SOURCE])
        .env("GOBIN", &building)
        .env_remove("GOFLAGS")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|source| Error::Spawn { program: go.clone(), source })?;
    let mut last = Vec::new();
    let mut packages = 0_u32;
    if let Some(errors) = child.stderr.take() {
        for line in BufReader::new(errors).lines().map_while(std::io::Result::ok) {
            packages += 1;
            if packages.is_multiple_of(100) {
                say(&format!("installing MinIO: {packages} steps done"));
            }
            last.push(line);
            if last.len() > 3 {
                last.remove(0);
            }
        }
    }
    let status = child.wait().map_err(|source| Error::Spawn { program: go, source })?;
    if !status.success() {
        return Err(Error::Install(mem::take(&mut last).join("; ")));
    }
    fs::rename(building.join("minio"), binary).map_err(Error::file(binary))?;
    fs::write(stamp(binary), SOURCE).map_err(Error::file(binary))?;
    say(&format!("MinIO is installed in {}", binary.display()));
    Ok(())
}

fn go_version(go: &Path) -> Result<(u32, u32)> {
    let output = Command::new(go)
        .args(["env", "GOVERSION"])
        .output()
        .map_err(|source| Error::Spawn { program: go.to_owned(), source })?;
    let text = String::from_utf8_lossy(&output.stdout);
    parse_go_version(text.trim()).ok_or_else(|| Error::NoMinio(format!("`go env GOVERSION` says {text:?}")))
}

fn parse_go_version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.strip_prefix("go")?.split(|c: char| !c.is_ascii_digit());
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

/// The folder that a MinIO built from source goes into.
fn cache() -> Result<PathBuf> {
    let base = env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute())
        .or_else(|| env::home_dir().map(|home| home.join(".cache")))
        .ok_or_else(|| Error::NoMinio("no home folder to install MinIO in".into()))?;
    Ok(base.join("rayfold/bin"))
}

fn on_path(program: &str) -> Option<PathBuf> {
    env::split_paths(&env::var_os("PATH")?).map(|folder| folder.join(program)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn go_versions_are_read() {
        assert_eq!(parse_go_version("go1.25.3"), Some((1, 25)));
        assert_eq!(parse_go_version("go1.26rc1"), Some((1, 26)));
        assert_eq!(parse_go_version("devel +abc"), None);
        assert!(parse_go_version("go1.9").unwrap() < GO);
    }
}
