//! The location of the function binaries.
//!
//! They are in the folder of the program that runs them. In the project's own `target/` they may be missing, or older
//! than the sources, because Cargo builds only the requested targets. So they are built in that case, which takes a
//! moment if they are up to date. They are built with the features of the whole workspace, like a program run by `cargo
//! run`, so that both share one AWS SDK. Beside an installed program they may be missing too. Then they are searched
//! for on the PATH, and built in the program's sources if those still exist.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::error::{Error, Result};
use crate::routes::Function;

/// The folder that holds the binaries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Functions {
    folder: PathBuf,
}

impl Functions {
    /// Returns the functions in `folder`.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// Finds the functions. If RAYFOLD_FUNCTIONS is set, they are in that folder and are used unchanged. Otherwise they
    /// are beside this program, and are rebuilt if it is in the workspace that it was built from. Otherwise they are on
    /// the PATH, or are built in that workspace.
    ///
    /// `say` gets a line before each step that takes time.
    ///
    /// # Errors
    /// [`Error::NoFunction`] or [`Error::FunctionNowhere`] if a binary is missing, and [`Error::Build`]
    /// if a build fails.
    pub fn locate(say: &mut dyn FnMut(&str)) -> Result<Self> {
        if let Some(named) = env::var_os("RAYFOLD_FUNCTIONS") {
            let functions = Self::in_folder(named);
            functions.check()?;
            return Ok(functions);
        }
        let program = env::current_exe().map_err(Error::file("the running program"))?;
        let beside = Self::in_folder(program.parent().unwrap_or(Path::new("/")));
        let sources = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).canonicalize().ok();
        let by_cargo = env::var_os("CARGO").is_some()
            && env::var("CARGO_PKG_NAME").is_ok_and(|name| name.starts_with("rayfold"));
        match sources {
            Some(sources) if by_cargo || program.starts_with(&sources) => {
                match build(&sources, &beside.folder, say) {
                    Err(Error::Spawn { .. }) if beside.check().is_ok() => {
                        say(
                            "there is no cargo: the function binaries are used as they are, perhaps older than the sources",
                        );
                    }
                    built => built?,
                }
                beside.check()?;
                Ok(beside)
            }
            sources => beside.installed(sources.as_deref(), say),
        }
    }

    /// Finds the functions of an installed program: beside it (`self`), on the PATH, or by building
    /// them in its sources.
    fn installed(self, sources: Option<&Path>, say: &mut dyn FnMut(&str)) -> Result<Self> {
        let Err(_) = self.check() else { return Ok(self) };
        let path = env::var_os("PATH").unwrap_or_default();
        if let Some(found) =
            env::split_paths(&path).map(Self::in_folder).find(|functions| functions.check().is_ok())
        {
            return Ok(found);
        }
        if let Some(sources) = sources.filter(|sources| sources.join("crates/lambda/Cargo.toml").is_file()) {
            let built = Self::in_folder(sources.join("target/release"));
            match build(sources, &built.folder, say) {
                Err(Error::Spawn { .. }) => {}
                outcome => {
                    outcome?;
                    built.check()?;
                    return Ok(built);
                }
            }
        }
        Err(Error::FunctionNowhere { function: self.missing().unwrap_or_default(), folder: self.folder })
    }

    /// Returns the path of a function's binary.
    pub fn path(&self, function: Function) -> PathBuf {
        self.folder.join(function.binary())
    }

    /// Checks that both binaries exist.
    ///
    /// # Errors
    /// [`Error::NoFunction`] for the first one that is missing.
    pub fn check(&self) -> Result<()> {
        match self.missing() {
            Some(function) => Err(Error::NoFunction { function, folder: self.folder.clone() }),
            None => Ok(()),
        }
    }

    /// Returns the name of the first missing binary.
    fn missing(&self) -> Option<&'static str> {
        Function::ALL.into_iter().find(|function| !self.path(*function).is_file()).map(Function::binary)
    }
}

/// Builds into `folder`, which Cargo names after the profile.
fn build(workspace: &Path, folder: &Path, say: &mut dyn FnMut(&str)) -> Result<()> {
    let profile = match folder.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(name) => name,
    };
    say(&format!("building the function binaries in {}", folder.display()));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_that_is_nowhere_is_named_with_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("rayfold-render"), "").unwrap();
        let error = Functions::in_folder(folder.path()).installed(None, &mut |_| {}).unwrap_err().to_string();
        for part in ["rayfold-assemble", "cargo install --path crates/lambda", "RAYFOLD_FUNCTIONS"] {
            assert!(error.contains(part), "{error}");
        }
        std::fs::write(folder.path().join("rayfold-assemble"), "").unwrap();
        let found = Functions::in_folder(folder.path()).installed(None, &mut |_| {}).unwrap();
        assert_eq!(found, Functions::in_folder(folder.path()));
    }
}
