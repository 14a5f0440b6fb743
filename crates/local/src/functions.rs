//! Where the function binaries are.
//!
//! They lie beside the program that runs them. In the project's own `target/` they may be missing, or older than the
//! sources, as Cargo builds only what it is asked for; so they are built then, which costs a moment when they are fresh.
//! They are built with the whole workspace's features, as is what `cargo run` runs: both share one AWS SDK.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::routes::Function;
use crate::{Error, Result};

/// The folder that holds the binaries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Functions {
    folder: PathBuf,
}

impl Functions {
    /// Those in `folder`.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Those in the folder that RAYFOLD_FUNCTIONS names, which are taken as they are, or beside this program, built anew
    /// when it lies in the workspace it was built from.
    ///
    /// `say` hears what takes time, a line at a time.
    ///
    /// # Errors
    /// [`Error::NoFunction`], [`Error::Build`].
    pub fn locate(say: &mut dyn FnMut(&str)) -> Result<Self> {
        if let Some(named) = env::var_os("RAYFOLD_FUNCTIONS") {
            let functions = Self::in_folder(named);
            functions.check()?;
            return Ok(functions);
        }
        let program = env::current_exe().map_err(Error::file("the running program"))?;
        let folder = program.parent().unwrap_or(Path::new("/"));
        let functions = Self::in_folder(folder);
        let workspace = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
        let by_cargo = env::var_os("CARGO").is_some()
            && env::var("CARGO_PKG_NAME").is_ok_and(|name| name.starts_with("rayfold"));
        let in_workspace = workspace.canonicalize().is_ok_and(|workspace| program.starts_with(workspace));
        if by_cargo || in_workspace {
            match build(workspace, folder, say) {
                Err(Error::Spawn { .. }) if functions.check().is_ok() => {
                    say(
                        "there is no cargo: the function binaries are used as they are, perhaps older than the sources",
                    );
                }
                built => built?,
            }
        }
        functions.check()?;
        Ok(functions)
    }

    /// Of one of them.
    pub fn path(&self, function: Function) -> PathBuf {
        self.folder.join(function.binary())
    }

    /// Both are there.
    ///
    /// # Errors
    /// [`Error::NoFunction`].
    pub fn check(&self) -> Result<()> {
        match Function::ALL.map(|function| self.path(function)).into_iter().find(|path| !path.is_file()) {
            Some(missing) => Err(Error::NoFunction(missing)),
            None => Ok(()),
        }
    }
}

/// Builds into `folder`, which Cargo names after the profile.
fn build(workspace: &Path, folder: &Path, say: &mut dyn FnMut(&str)) -> Result<()> {
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(name) => name,
    };
    say("building the function binaries");
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(&cargo)
        .args(["build", "--quiet", "--workspace", "--profile", profile])
        .args(Function::ALL.iter().flat_map(|function| ["--bin", function.binary()]))
        .arg("--manifest-path")
        .arg(workspace.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(folder.parent().unwrap_or(folder))
        .stdin(Stdio::null())
        .status()
        .map_err(|source| Error::Spawn { program: cargo.into(), source })?;
    if status.success() { Ok(()) } else { Err(Error::Build(status.to_string())) }
}
