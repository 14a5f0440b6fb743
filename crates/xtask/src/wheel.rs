//! Builds the wheel of the Python package for this machine. It works with every Python from 3.10 on.
//!
//! The wheel is built with maturin, in the profile of a release. The interpreter that runs maturin need not be one that
//! the wheel supports.

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
