//! Finds an S3 server that is a separate program, or builds it from source.
//!
//! Both servers are written in Go and published as source. A server is built in a separate module, because `go install`
//! refuses modules with replace directives. It is installed into the user's cache once; a file lock keeps two processes
//! from building it at the same time.

use std::env;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::error::{Error, Result};
use crate::program::Program;

impl Program {
    /// Returns the binary that the variable names, the one on the PATH, or the one built earlier.
    ///
    /// # Errors
    /// [`Error::NoServer`] or [`Error::NamedServerMissing`], if the program is not found.
    pub fn find(&'static self) -> Result<PathBuf> {
        if let Some(path) = env::var_os(self.variable).map(PathBuf::from) {
            let variable = self.variable;
            return if path.is_file() { Ok(path) } else { Err(Error::NamedServerMissing { variable, path }) };
        }
        if let Some(found) = on_path(self.binary) {
            return Ok(found);
        }
        let binary = self.cache()?.join(self.binary);
        if self.is_installed(&binary) {
            return Ok(binary);
        }
        Err(self.missing(format!("it is neither on the PATH nor in {}", binary.display())))
    }

    /// Finds the binary as [`find`](Self::find) does, or builds it now.
    ///
    /// `say` receives messages about steps that take time, one line per call.
    ///
    /// # Errors
    /// [`Error::NoServer`] without the program and Go, [`Error::Install`] when the build fails, [`Error::File`] for the
    /// cache.
    pub fn find_or_install(&'static self, say: &mut dyn FnMut(&str)) -> Result<PathBuf> {
        match self.find() {
            Err(Error::NoServer { .. }) => {}
            found => return found,
        }
        let folder = self.cache()?;
        let binary = folder.join(self.binary);
        fs::create_dir_all(&folder).map_err(Error::file(&folder))?;
        let lock_path = binary.with_extension("lock");
        let lock = File::create(&lock_path).map_err(Error::file(&lock_path))?;
        if lock.try_lock().is_err() {
            say(&format!("{self} is being installed by another process; waiting for it"));
            lock.lock().map_err(Error::file(&lock_path))?;
        }
        if !self.is_installed(&binary) {
            self.build(&binary, say)?;
        }
        Ok(binary)
    }

    /// Returns whether `binary` is of the current source. The stamp contains the source of the binary, so that a new
    /// version replaces it.
    fn is_installed(&'static self, binary: &Path) -> bool {
        binary.is_file() && fs::read_to_string(stamp(binary)).is_ok_and(|source| source == self.source())
    }

    /// Returns the argument for `go get`.
    fn source(&'static self) -> String {
        format!("{}@{}", self.package, self.version)
    }

    fn missing(&'static self, reason: String) -> Error {
        Error::NoServer { program: self, reason }
    }

    fn build(&'static self, binary: &Path, say: &mut dyn FnMut(&str)) -> Result<()> {
        let go = on_path("go")
            .ok_or_else(|| self.missing(format!("neither {} nor go is on the PATH", self.binary)))?;
        let version = self.go_version(&go)?;
        if version < self.go {
            let (needed, there) = (self.go, version);
            return Err(self.missing(format!(
                "it needs Go {}.{} to be built, and the Go on the PATH is {}.{}",
                needed.0, needed.1, there.0, there.1
            )));
        }
        say(&format!("installing {self} from source, once; this takes a few minutes"));
        let module = binary.with_extension("module");
        // Remains of an interrupted build.
        let _ = fs::remove_dir_all(&module);
        fs::create_dir_all(&module).map_err(Error::file(&module))?;
        let (built, mut steps) = (module.join(self.binary), 0);
        self.go(&go, &module, &["mod", "init", "scratch"], &mut steps, say)?;
        self.go(&go, &module, &["get", "-tool", &self.source()], &mut steps, say)?;
        let output = built.to_string_lossy();
        self.go(&go, &module, &["build", "-v", "-o", &output, self.package], &mut steps, say)?;
        fs::rename(&built, binary).map_err(Error::file(binary))?;
        fs::write(stamp(binary), self.source()).map_err(Error::file(binary))?;
        let _ = fs::remove_dir_all(&module);
        say(&format!("{self} is installed in {}", binary.display()));
        Ok(())
    }

    /// Runs Go in a module, and counts the lines that it writes.
    fn go(
        &'static self,
        go: &Path,
        module: &Path,
        args: &[&str],
        steps: &mut u32,
        say: &mut dyn FnMut(&str),
    ) -> Result<()> {
        let mut child = Command::new(go)
            .args(args)
            .current_dir(module)
            .env("GOWORK", "off")
            .env_remove("GOFLAGS")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|source| Error::Spawn { program: go.to_owned(), source })?;
        let mut last = Vec::new();
        if let Some(errors) = child.stderr.take() {
            for line in BufReader::new(errors).lines().map_while(std::io::Result::ok) {
                *steps += 1;
                if steps.is_multiple_of(200) {
                    say(&format!("installing {self}: {steps} steps done"));
                }
                last.push(line);
                if last.len() > 3 {
                    last.remove(0);
                }
            }
        }
        let status = child.wait().map_err(|source| Error::Spawn { program: go.to_owned(), source })?;
        if status.success() { Ok(()) } else { Err(Error::Install { program: self, reason: last.join("; ") }) }
    }

    fn go_version(&'static self, go: &Path) -> Result<(u32, u32)> {
        let output = Command::new(go)
            .args(["env", "GOVERSION"])
            .output()
            .map_err(|source| Error::Spawn { program: go.to_owned(), source })?;
        let text = String::from_utf8_lossy(&output.stdout);
        parse_go_version(text.trim()).ok_or_else(|| self.missing(format!("`go env GOVERSION` says {text:?}")))
    }

    /// Returns the folder for a program that is built from source.
    fn cache(&'static self) -> Result<PathBuf> {
        let base = env::var_os("XDG_CACHE_HOME")
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
            .or_else(|| env::home_dir().map(|home| home.join(".cache")))
            .ok_or_else(|| self.missing("no home folder to install it in".into()))?;
        Ok(base.join("rayfold/bin"))
    }
}

fn stamp(binary: &Path) -> PathBuf {
    binary.with_extension("version")
}

fn parse_go_version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.strip_prefix("go")?.split(|c: char| !c.is_ascii_digit());
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

fn on_path(program: &str) -> Option<PathBuf> {
    env::split_paths(&env::var_os("PATH")?).map(|folder| folder.join(program)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{MINIO, SEAWEEDFS};

    #[test]
    fn go_versions_are_read() {
        assert_eq!(parse_go_version("go1.25.3"), Some((1, 25)));
        assert_eq!(parse_go_version("go1.26rc1"), Some((1, 26)));
        assert_eq!(parse_go_version("devel +abc"), None);
        assert!(parse_go_version("go1.9").unwrap() < MINIO.go);
    }

    #[test]
    fn a_missing_server_is_named_with_how_to_get_it() {
        let error = SEAWEEDFS.missing("nowhere".into()).to_string();
        for part in ["`weed`", "RAYFOLD_SEAWEEDFS", "cargo run -p rayfold-local --example stores seaweedfs"] {
            assert!(error.contains(part), "{error}");
        }
    }
}
