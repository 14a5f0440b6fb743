//! `rayfold-bench measure -- PROGRAM...`: prints the time and memory of a program as JSON.
//!
//! This is a process of its own, because the system counts the memory of the starting process as the program's.

#![allow(clippy::print_stdout, reason = "the result is read by who started it")]

use std::ffi::OsString;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;
use serde::{Deserialize, Serialize};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The program and its arguments
    #[arg(required = true, last = true)]
    program: Vec<OsString>,
}

/// The cost of one run.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Cost {
    /// The elapsed time in seconds.
    pub wall: f64,
    /// The processor time in seconds of all cores, user and system.
    pub cpu: f64,
    /// The peak memory in MB.
    pub memory: f64,
}

impl Cost {
    /// Returns the least times of two runs, and the larger memory.
    pub(crate) fn least(self, other: Self) -> Self {
        Self {
            wall: self.wall.min(other.wall),
            cpu: self.cpu.min(other.cpu),
            memory: self.memory.max(other.memory),
        }
    }
}

/// Runs the program and prints its [`Cost`].
///
/// # Errors
/// Fails if it cannot be started or fails.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let name = args.program[0].to_string_lossy();
    let start = Instant::now();
    let status = Command::new(&args.program[0])
        .args(&args.program[1..])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .status()
        .with_context(|| format!("cannot start {name}"))?;
    let wall = start.elapsed().as_secs_f64();
    ensure!(status.success(), "{name} ended with {status}");
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    let cpu = (usage.user_time().num_microseconds() + usage.system_time().num_microseconds()) as f64 / 1e6;
    // Linux counts in KiB.
    let memory = usage.max_rss() as f64 * 1024.0 / 1e6;
    println!("{}", serde_json::to_string(&Cost { wall, cpu, memory })?);
    Ok(())
}
