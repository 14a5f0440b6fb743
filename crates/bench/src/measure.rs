//! `rayfold-bench measure -- PROGRAM...`: what a program takes, as JSON.
//!
//! A process of its own, because the system counts the memory of whoever starts a program as the program's.

#![allow(clippy::print_stdout, reason = "the result is read by who started it")]

use std::ffi::OsString;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, ensure};
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;
use serde::{Deserialize, Serialize};

/// The command line.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The program and its arguments
    #[arg(required = true, last = true)]
    program: Vec<OsString>,
}

/// What one run took.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Cost {
    /// Seconds by the clock.
    pub wall: f64,
    /// Seconds of all cores, user and system.
    pub cpu: f64,
    /// Most memory held, in MB.
    pub memory: f64,
}

impl Cost {
    /// The least times of two runs, and the most memory.
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
/// When it cannot be started or fails.
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
