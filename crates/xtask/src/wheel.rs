//! Builds the wheel of the Python package for the machine that it runs on: one for all Pythons from 3.10.
//!
//! The wheel is built with maturin, in the profile of a release. The interpreter that runs maturin need not be one that the
//! wheel is for.

use std::process::Command;

use crate::sources::root;
use crate::toolchain;

/// Builds the wheel into `target/wheels`.
pub(crate) fn run() -> anyhow::Result<()> {
    let mut command = Command::new(toolchain::maturin()?);
    command.args(["build", "--release", "--locked", "--strip", "--out", "target/wheels"]);
    command.args(["--manifest-path", "crates/python/Cargo.toml"]);
    toolchain::run(command.current_dir(root()?))
}
