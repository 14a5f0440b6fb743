//! Tools that pip installs: zig, which can link against a glibc older than the machine's, driven by cargo-zigbuild; and
//! maturin, which builds wheels.
//!
//! All of them have pinned versions, because other versions may give other bytes. They are installed in folders of
//! their own in the user's cache.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};

const ZIG: &str = "0.15.2";
const CARGO_ZIGBUILD: &str = "0.24.0";
const MATURIN: &str = "1.16.0";

pub(crate) struct Toolchain {
    binaries: PathBuf,
}

impl Toolchain {
    /// Returns the tools of the cache. Installs missing tools first.
    pub(crate) fn get() -> anyhow::Result<Self> {
        let packages = [format!("ziglang=={ZIG}"), format!("cargo-zigbuild=={CARGO_ZIGBUILD}")];
        let program =
            installed(&format!("zig-{ZIG}-zigbuild-{CARGO_ZIGBUILD}"), &packages, "cargo-zigbuild")?;
        let binaries = program.parent().context("a program without a folder")?.to_owned();
        Ok(Self { binaries })
    }

    /// Returns the command `cargo zigbuild`.
    pub(crate) fn cargo_zigbuild(&self) -> anyhow::Result<Command> {
        let mut path = vec![self.binaries.clone()];
        path.extend(env::split_paths(&env::var_os("PATH").unwrap_or_default()));
        let mut command = Command::new(self.binaries.join("cargo-zigbuild"));
        command.arg("zigbuild").env("PATH", env::join_paths(path)?);
        // Otherwise another zig or python on the PATH would be used.
        command.env("CARGO_ZIGBUILD_PYTHON_PATH", self.binaries.join("python"));
        command.env_remove("CARGO_ZIGBUILD_ZIG_PATH");
        Ok(command)
    }
}

/// Returns the program maturin of the cache. Installs it first if it is missing.
pub(crate) fn maturin() -> anyhow::Result<PathBuf> {
    installed(&format!("maturin-{MATURIN}"), &[format!("maturin=={MATURIN}")], "maturin")
}

/// Returns a program of a folder in the cache. Installs the packages if the program is missing. The last package has
/// the program.
fn installed(name: &str, packages: &[String], program: &str) -> anyhow::Result<PathBuf> {
    let folder = cache()?.join(name);
    let path = folder.join("bin").join(program);
    if !path.is_file() {
        let packages_shown = packages.join(" and ");
        say(&format!("installing {packages_shown} into {}", folder.display()));
        install(&folder, packages)
            .with_context(|| format!("{packages_shown} come by pip, which needs Python 3 with venv"))?;
    }
    Ok(path)
}

/// Installs packages. Deletes an incomplete installation first.
fn install(folder: &Path, packages: &[String]) -> anyhow::Result<()> {
    let parent = folder.parent().context("the cache has no parent")?;
    std::fs::create_dir_all(parent)?;
    if folder.exists() {
        std::fs::remove_dir_all(folder)?;
    }
    // A virtual environment cannot be moved. So its marker, the last package, is installed last.
    run(Command::new("python3").args(["-m", "venv"]).arg(folder))?;
    let pip = folder.join("bin/pip");
    for package in packages {
        run(Command::new(&pip).args(["install", "--quiet", "--no-deps", package]))?;
    }
    Ok(())
}

fn cache() -> anyhow::Result<PathBuf> {
    let named = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    match (named("XDG_CACHE_HOME"), named("HOME")) {
        (Some(cache), _) => Ok(cache.join("rayfold")),
        (None, Some(home)) => Ok(home.join(".cache/rayfold")),
        (None, None) => bail!("neither XDG_CACHE_HOME nor HOME is set"),
    }
}

/// Runs a command to its end. Fails if the command fails.
pub(crate) fn run(command: &mut Command) -> anyhow::Result<()> {
    let status = command.status().with_context(|| format!("cannot run {:?}", command.get_program()))?;
    ensure!(status.success(), "{:?}: {status}", command.get_program());
    Ok(())
}

/// Prints a line for the user.
#[expect(clippy::print_stderr, reason = "this is a program's own output")]
pub(crate) fn say(line: &str) {
    eprintln!("{line}");
}
