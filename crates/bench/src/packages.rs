//! `rayfold-bench packages`: the packages for Lambda make the GIF that this machine's functions make, byte for byte.
//!
//! Each program answers the local invoker, and a small animation is made from the built-in store to its GIF. Programs
//! for another kind of machine are emulated by qemu.

use std::fs;
use std::io::Read as _;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, ensure};
use bytes::Bytes;
use rayfold_local::routes::Function;
use rayfold_local::{Functions, Plan, Platform, StoreKind};
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::Store as _;

use crate::fingerprints::in_small;
use crate::pipeline::{Compiled, Folder, make};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder with the packages of each architecture, as `cargo xtask package` writes it
    #[arg(default_value = "target/packages")]
    folder: PathBuf,
    /// The architectures; by default both
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
}

/// The architectures by Lambda's names, and the names that Rust and qemu have for them.
const ARCHITECTURES: [(&str, &str); 2] = [("x86_64", "x86_64"), ("arm64", "aarch64")];

/// The scripts that are drawn.
const SCRIPTS: [&str; 4] = ["frame01", "frame14", "frame26", "frame39"];

/// The time limit for the GIF, which takes an emulated program seconds.
const PATIENCE: Duration = Duration::from_secs(120);

/// A payload that no function can parse. A function that runs replies at once.
const NOTHING: &str = "{}";

/// Makes the animation with each package.
///
/// # Errors
/// Fails if a package does not make the GIF that the functions beside this program make, or if none could be run.
pub fn run(args: &Args) -> Result<()> {
    let scripts = tempfile::tempdir()?;
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/hello");
    for name in SCRIPTS {
        let text = fs::read_to_string(scenes.join(name).with_extension("txt"))?;
        fs::write(scripts.path().join(name).with_extension("txt"), in_small(&text))?;
    }
    let folder = Folder::read("hello", scripts.path())?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let native = Functions::locate(&mut |line| eprintln!("{line}"))?;
    let expected = runtime.block_on(gif(native, &folder)).context("this machine's functions")?;
    let mut is_run = false;
    for (name, machine) in ARCHITECTURES {
        if !args.only.is_empty() && !args.only.iter().any(|only| only == name) {
            continue;
        }
        let programs = tempfile::tempdir()?;
        if let Err(missing) = unpack(&args.folder.join(name), machine, programs.path()) {
            eprintln!("{name}: NOT RUN: {missing:#}");
            continue;
        }
        let made = runtime.block_on(gif(Functions::in_folder(programs.path()), &folder));
        let made = made.with_context(|| name.to_owned())?;
        ensure!(made == expected, "{name}: the GIF differs from that of this machine's functions");
        eprintln!("{name}: both functions answer, and the GIF of {} bytes is the same", made.len());
        is_run = true;
    }
    ensure!(is_run, "no package was run");
    Ok(())
}

/// Writes the program of each package into a folder, with the names that the invoker expects. Programs for another kind
/// of machine are wrapped in scripts that emulate it.
fn unpack(packages: &Path, machine: &str, into: &Path) -> Result<()> {
    for function in Function::ALL {
        let zip = packages.join(function.binary()).with_extension("zip");
        let zip = fs::File::open(&zip).with_context(|| format!("{} (cargo xtask package)", zip.display()))?;
        let mut program = Vec::new();
        zip::ZipArchive::new(zip)?.by_name("bootstrap")?.read_to_end(&mut program)?;
        let path = into.join(format!("{function}-bootstrap"));
        write_program(&path, &program)?;
        let start = into.join(function.binary());
        if machine == std::env::consts::ARCH {
            symlink(path, start)?;
            continue;
        }
        let qemu = format!("qemu-{machine}");
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let qemu = std::env::split_paths(&paths)
            .map(|folder| folder.join(&qemu))
            .find(|path| path.is_file())
            .with_context(|| format!("there is no {qemu} (Debian's qemu-user)"))?;
        let root = PathBuf::from(format!("/usr/{machine}-linux-gnu"));
        ensure!(root.is_dir(), "there is no {} (Debian's libc6-dev-arm64-cross)", root.display());
        let (qemu, root, path) = (qemu.display(), root.display(), path.display());
        write_program(&start, format!("#!/bin/sh\nexec '{qemu}' -L '{root}' '{path}'\n").as_bytes())?;
    }
    Ok(())
}

fn write_program(path: &Path, content: &[u8]) -> Result<()> {
    fs::write(path, content)?;
    Ok(fs::set_permissions(path, fs::Permissions::from_mode(0o755))?)
}

/// Returns the GIF that functions make of a folder, in a bucket of its own.
async fn gif(functions: Functions, folder: &Folder) -> Result<Bytes> {
    let data = tempfile::tempdir()?;
    let plan = Plan::new(StoreKind::BuiltIn, data.path(), functions);
    let mut platform = Platform::start(&plan, |_| {}, &mut |line| eprintln!("{line}")).await?;
    let (sender, mut seen) = tokio::sync::mpsc::unbounded_channel();
    let invoker = platform.start_invoker(Some(sender)).await?;
    for function in Function::ALL {
        let outcome = invoker.invoke(function, NOTHING).await;
        ensure!(outcome.is_success(), "{function}: {outcome:?}");
    }
    let making = make(&platform, &mut seen, folder, "film", Compiled::ByTheFunction);
    let made = tokio::time::timeout(PATIENCE, making).await;
    made.map_err(|_| anyhow!("no GIF within {} s", PATIENCE.as_secs()))??;
    let gif = platform.store().get(&Animation::new("film")?.gif()).await?.body;
    platform.stop().await;
    Ok(gif)
}
